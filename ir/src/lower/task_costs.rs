//! Costs of tasks that declare none (semantics §6). They are plain data: this crate does not know which machine they come from.

use crate::span::Span;
use std::collections::BTreeMap;

/// Costs of tasks, in the unit of the budgets of the chart.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TaskCosts {
    /// The known costs, by the source location of the task. A task in a macro or a library chart has one cost for all its
    /// expansions.
    pub known: BTreeMap<Span, u32>,
    /// The cost of all other tasks. Without it, a task without a cost is an error if its step has a budget.
    pub otherwise: Option<u32>,
}

impl TaskCosts {
    /// The cost of a task that declares none.
    #[must_use]
    pub fn of(&self, place: Span) -> Option<u32> {
        self.known.get(&place).copied().or(self.otherwise)
    }
}
