//! The data that all stages of one output share: the net, its facts, its circuit, the options, and what is to be written.

use crate::built::BuildOptions;
use crate::circuit::emit_options;
use crate::stem::FileStem;
use grafsynth_backend_pld::device::Device;
use grafsynth_backend_pld::{Dialect, EmitOptions, RELIES};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;

/// One output of a build that is a circuit.
#[derive(Clone, Copy)]
pub(crate) struct BuildContext<'a> {
    pub(crate) net: &'a Valid<Net>,
    pub(crate) facts: &'a Facts,
    /// The circuit with one flip-flop for each step.
    pub(crate) logic: &'a Logic,
    /// The same circuit with a timer for each timed step, if some of them share one in `logic`.
    pub(crate) own_timers: Option<&'a Logic>,
    pub(crate) options: &'a BuildOptions,
    pub(crate) medium: Medium,
}

/// The form in which a circuit is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Medium {
    /// A text.
    Text(Dialect),
    /// A fuse map.
    Fuses,
}

impl Medium {
    /// The language whose names and rules its equations follow. A fuse map needs a pin for each signal, like GALasm.
    pub(crate) fn dialect(self) -> Dialect {
        match self {
            Medium::Text(dialect) => dialect,
            Medium::Fuses => Dialect::Galasm,
        }
    }

    /// The name of its file. CUPL and GALasm share the usual extension; side by side they need two names.
    pub(crate) fn file_name(self, stem: &FileStem) -> String {
        match self {
            Medium::Text(Dialect::Cupl) => format!("{stem}.cupl.pld"),
            Medium::Text(Dialect::Galasm) => format!("{stem}.galasm.pld"),
            Medium::Text(dialect) => format!("{stem}.{}", dialect.extension()),
            Medium::Fuses => format!("{stem}.jed"),
        }
    }
}

impl BuildContext<'_> {
    /// The name of the output.
    pub(crate) fn file_name(&self) -> String {
        self.medium.file_name(&self.options.stem_for(self.net))
    }

    /// The options for the back end.
    pub(crate) fn emit_options(&self) -> EmitOptions {
        let dont_cares = self.options.dont_cares && self.medium.dialect().is_flat();
        let mut options = EmitOptions {
            dont_cares,
            keep: self.options.keep_pins.clone(),
            reset_wire: self.options.reset_wire.clone(),
            ..emit_options(self.net, self.options.device.as_deref(), None)
        };
        // With a reset, the assumptions are among the don't-cares of single functions, which do not say where they come from.
        if options.reset_wire.is_some() && dont_cares && !self.logic.never.is_empty() {
            options.notes.push(RELIES.to_owned());
        }
        options
    }

    /// The device; `None` if its name is unknown.
    pub(crate) fn device(&self) -> Option<&'static Device> {
        let own = self.net.board.device.as_ref().map(|name| name.text.as_str());
        match self.options.device.as_deref().or(own) {
            Some(name) => Device::find(name),
            None => Some(Device::default_device()),
        }
    }
}
