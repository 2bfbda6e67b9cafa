//! The interface of a package: the emitted functions and their parameters.

use crate::names::Names;
use crate::times::Ticks;

/// The data that a caller of the emitted functions must know; the harness is generated from them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Interface {
    pub(crate) names: Names,
    pub(crate) has_instance: bool,
    pub(crate) has_in: bool,
    pub(crate) has_out: bool,
    pub(crate) ticks: Option<Ticks>,
    pub(crate) has_fault: bool,
    pub(crate) callbacks: bool,
    /// True if the user provides functions: those of the chart, or callbacks.
    pub(crate) has_library: bool,
    /// True if the gate (`--gate`) precedes the reaction.
    pub(crate) gate: bool,
    /// The number of entries of the trace ring.
    pub(crate) trace: Option<u16>,
    /// True if a reaction checks the state variables first.
    pub(crate) safe_state: bool,
}

impl Interface {
    /// The declarations of the variables that a caller needs: `self`, `in` if it has inputs to write, `out`.
    pub(crate) fn variables(&self, has_in: bool) -> impl Iterator<Item = String> {
        [(self.has_instance, "_t self;"), (has_in, "_in_t in;"), (self.has_out, "_out_t out;")]
            .into_iter()
            .filter(|(is_there, _)| *is_there)
            .map(|(_, rest)| format!("{}{rest}", self.names.prefix))
    }

    /// The parameters of `NAME_init`, `NAME_step` and `NAME_stop`, without those that the chart does not need.
    pub(crate) fn parameters(&self, with_in: bool, with_dt: bool) -> String {
        let prefix = &self.names.prefix;
        let mut all = Vec::new();
        if self.has_instance {
            all.push(format!("{prefix}_t *self"));
        }
        if with_in && self.has_in {
            all.push(format!("const {prefix}_in_t *in"));
        }
        if let (true, Some(ticks)) = (with_dt, self.ticks) {
            all.push(format!("{} dt", ticks.name()));
        }
        if self.has_out {
            all.push(format!("{prefix}_out_t *out"));
        }
        if all.is_empty() { "void".to_string() } else { all.join(", ") }
    }
}
