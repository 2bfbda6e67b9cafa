//! The state of a net between two reactions (semantics §2).

use std::collections::VecDeque;

use grafsynth_ir::net::InputId;

use crate::situation::Situation;

/// Everything that a net stores between two reactions, and nothing else: equal states of one net behave the same for ever.
///
/// A state contains a bit for each step, a number for each object that the net uses (variables, timers, edges, latches, the order of activation among
/// steps that decide conflicts, …) and the pending events. It belongs to the net of the [`Simulator`](crate::Simulator) that returned it;
/// [`Simulator::save`](crate::Simulator::save) writes it by name.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct State {
    pub(crate) situation: Situation,
    pub(crate) cells: Vec<i64>,
    pub(crate) internal: VecDeque<InputId>,
    pub(crate) external: VecDeque<InputId>,
}

impl State {
    /// The set of active steps.
    #[must_use]
    pub fn situation(&self) -> &Situation {
        &self.situation
    }
}

impl Clone for State {
    fn clone(&self) -> Self {
        State {
            situation: self.situation.clone(),
            cells: self.cells.clone(),
            internal: self.internal.clone(),
            external: self.external.clone(),
        }
    }

    /// Reuses allocated memory.
    fn clone_from(&mut self, other: &Self) {
        self.situation.copy_from(&other.situation);
        self.cells.clone_from(&other.cells);
        self.internal.clone_from(&other.internal);
        self.external.clone_from(&other.external);
    }
}
