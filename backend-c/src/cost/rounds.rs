//! The number of rounds that a bound counts for the loop over micro-steps.

use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::net::{Evolution, Net};

/// The maximum number of checks of one reaction that a bound counts, for charts that evolve until they are stable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rounds {
    /// The proved number of checks, with its proof: the loop counts as this many rounds. Without a proof, it counts as many rounds as the text allows.
    pub proved: Option<(u32, Proof)>,
    /// The chart's own limit of micro-steps (for a statechart, for each event).
    pub limit: u32,
    /// Why nothing is proved, if the reason is known.
    pub open: Option<String>,
}

/// The number of rounds that a bound counts for the loop over micro-steps in the C of a net that is emitted with these facts; `None` if a reaction is
/// a single check.
#[must_use]
pub fn rounds(net: &Net, facts: &Facts) -> Option<Rounds> {
    let Evolution::Stable { limit } = net.settings.evolution else { return None };
    let proved = facts.most_rounds(net).map(|rounds| (rounds.value, rounds.by));
    let open = if proved.is_none() { facts.open.first().cloned() } else { None };
    Some(Rounds { proved, limit, open })
}
