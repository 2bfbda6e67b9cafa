//! Costs of tasks that declare none (semantics §6), handed to the lowering as data: which machine they come from is no business of this crate.

use crate::span::Span;
use std::collections::BTreeMap;

/// What tasks cost, in the unit that the budgets of the chart are in.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TaskCosts {
    /// By the place of the task in its source. One that is drawn in a macro or a library stands for all its expansions.
    pub known: BTreeMap<Span, u32>,
    /// What all others cost; without that number a task without a cost is an error where its step has a budget.
    pub otherwise: Option<u32>,
}

impl TaskCosts {
    /// The cost of a task that declares none.
    #[must_use]
    pub fn of(&self, place: Span) -> Option<u32> {
        self.known.get(&place).copied().or(self.otherwise)
    }
}
