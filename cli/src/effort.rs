//! The options that limit the work of proofs.

use crate::numbers::whole;
use clap::Args;
use grafsynth_verify::{DEFAULT_EFFORT, MAX_EFFORT};

/// The effort of proofs.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Effort {
    /// Effort of proofs: 0 tries only what is quick; 2 and 3 allow about 10 and 100 times the work of 1.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_EFFORT, value_parser = whole(0..=MAX_EFFORT))]
    pub(crate) effort: u8,
}

/// Limits on the effort of proofs.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Limits {
    #[command(flatten)]
    pub(crate) effort: Effort,
    /// Enumerate at most N pairs of a state and an input (2 000 000 at effort 1).
    #[arg(long, value_name = "N", value_parser = whole(0..=u64::MAX))]
    pub(crate) proof_limit: Option<u64>,
}

impl Effort {
    /// The limits of this effort.
    pub(crate) fn limits(self) -> grafsynth_verify::Limits {
        grafsynth_verify::Limits::of_effort(self.effort)
    }
}

impl Limits {
    /// The limits of the effort, with the given number of pairs.
    pub(crate) fn limits(self) -> grafsynth_verify::Limits {
        let limits = self.effort.limits();
        grafsynth_verify::Limits { pairs: self.proof_limit.unwrap_or(limits.pairs), ..limits }
    }
}
