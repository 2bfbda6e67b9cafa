//! How often a loop over micro-steps is counted.

use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::net::{Evolution, Net};

/// The most checks of one reaction that a bound counts, for charts that evolve until they are stable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rounds {
    /// Checks, where a number of them is proved, and how: the loop is counted so often. Else it is counted as often as the text lets it go.
    pub proved: Option<(u32, Proof)>,
    /// The most micro-steps that the chart allows itself (in a statechart, for each event).
    pub limit: u32,
    /// Why nothing is proved, as far as that is known.
    pub open: Option<String>,
}

/// How often a bound counts the loop over micro-steps in the C of a net that is emitted with these facts; none where a reaction is a single check.
#[must_use]
pub fn rounds(net: &Net, facts: &Facts) -> Option<Rounds> {
    let Evolution::Stable { limit } = net.settings.evolution else { return None };
    let proved = facts.most_rounds(net).map(|rounds| (rounds.value, rounds.by));
    let open = if proved.is_none() { facts.open.first().cloned() } else { None };
    Some(Rounds { proved, limit, open })
}
