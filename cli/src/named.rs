//! Option values that are known by a name: the parser gives the value itself, so that no name is compared later.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, Command, Error, ValueEnum};
use grafsynth_backend_c::Io;
use grafsynth_backend_c::cost::Goal;
use grafsynth_driver::coding::{Encoding, EncodingChoice};
use grafsynth_driver::pipeline::ResetStyle;
use grafsynth_driver::read::{CCalls, CGroup};
use grafsynth_driver::split::Objective;
use grafsynth_ir::division::Running;
use std::ffi::OsStr;

/// Values of `check --notes`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Notes {
    Conflicts,
}

/// Values of `build --emit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Emit {
    Map,
}

/// Values of `--group`.
pub(crate) const GROUPS: Named<CGroup> =
    Named(&[("comments", CGroup::Comments), ("blocks", CGroup::Blocks)]);

/// Values of `--calls`.
pub(crate) const CALLS: Named<CCalls> = Named(&[("copy", CCalls::Copy), ("share", CCalls::Share)]);

/// Values of `--int`.
pub(crate) const INTS: Named<u32> = Named(&[("16", 16), ("32", 32)]);

/// Values of `--minimise`.
pub(crate) const OBJECTIVES: Named<Objective> = Named(&[
    ("cycles", Objective::Cycles),
    ("pins", Objective::Pins),
    ("cells", Objective::Cells),
    ("latency", Objective::Latency),
]);

/// Values of `split --link`.
pub(crate) const LINKS: Named<Running> =
    Named(&[("lockstep", Running::Lockstep), ("free-running", Running::Free)]);

/// Values of `--optimise`.
pub(crate) const GOALS: Named<Goal> = Named(&[("speed", Goal::Speed), ("size", Goal::Size)]);

/// Values of `--io`.
pub(crate) const FORMS: Named<Io> = Named(&[("members", Io::Members), ("words", Io::Words)]);

/// Values of `--encoding`.
pub(crate) const ENCODINGS: Named<EncodingChoice> = Named(&[
    ("auto", EncodingChoice::Auto),
    ("one-hot", EncodingChoice::This(Encoding::OneHot)),
    ("zero-hot", EncodingChoice::This(Encoding::ZeroHot)),
    ("compact", EncodingChoice::This(Encoding::Compact)),
]);

/// Values of `--reset-style`.
pub(crate) const RESETS: Named<ResetStyle> =
    Named(&[("sync", ResetStyle::Synchronous), ("async", ResetStyle::Asynchronous)]);

/// The values of an option, each with its name on the command line.
#[derive(Debug, Clone)]
pub(crate) struct Named<T: 'static>(pub(crate) &'static [(&'static str, T)]);

impl<T: Clone + Send + Sync + 'static> Named<T> {
    fn names(&self) -> PossibleValuesParser {
        PossibleValuesParser::new(self.0.iter().map(|(name, _)| *name))
    }
}

impl<T: Clone + Send + Sync + 'static> TypedValueParser for Named<T> {
    type Value = T;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, given: &OsStr) -> Result<T, Error> {
        let given = self.names().parse_ref(command, arg, given)?;
        let value = self.0.iter().find(|(name, _)| *name == given);
        Ok(value.unwrap_or_else(|| unreachable!("`{given}` is a possible value")).1.clone())
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(self.0.iter().map(|(name, _)| PossibleValue::new(*name))))
    }
}
