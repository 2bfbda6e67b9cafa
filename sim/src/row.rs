//! One row: the visible result of a reaction.

use grafsynth_ir::net::{InputId, InputKind, Net, OutputId, StepId, Verbatim};

/// The inputs of one reaction.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct InputRow {
    /// Ticks since the last reaction.
    pub dt: u32,
    /// One value for each input of the net, by id; those of internal events are never read.
    pub values: Vec<i64>,
}

impl InputRow {
    /// One tick with all inputs 0 (or the bound nearest to 0).
    #[must_use]
    pub fn zero(net: &Net) -> Self {
        InputRow { dt: 1, values: net.inputs.values().map(|input| input.ty.saturate(0)).collect() }
    }

    /// The value of an input.
    #[must_use]
    pub fn value(&self, input: InputId) -> i64 {
        self.values.get(input.index()).copied().unwrap_or(0)
    }

    /// The same row with another value for one input.
    #[must_use]
    pub fn with(mut self, input: InputId, value: i64) -> Self {
        if let Some(cell) = self.values.get_mut(input.index()) {
            *cell = value;
        }
        self
    }
}

/// An effect of a reaction beyond its outputs, in order of execution.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// A call of an extern action with its arguments, clamped to the ranges of the parameters.
    Call(OutputId, Vec<i64>),
    /// A call of an extern condition; at most one per reaction for each condition.
    Condition(InputId),
    /// Target-language text that would run here. The simulator cannot run it.
    Code(Verbatim),
}

/// The cells of a row that the chart does not determine (semantics §3.6, *unspecified*).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Open {
    /// True if the situation after this reaction is left open. Everything that follows from it is then open too: in this row (except mealy outputs) and
    /// in all later rows.
    pub next: bool,
    /// True if the whole row is open, because its state followed from an open one or because an assumption was violated.
    pub row: bool,
    /// The outputs that are left open in this row.
    pub outputs: Vec<OutputId>,
    /// The outputs that do not depend on the situation after this reaction: mealy outputs.
    pub fixed: Vec<OutputId>,
}

impl Open {
    /// True if some cell is open.
    #[must_use]
    pub fn any(&self) -> bool {
        self.next || self.row || !self.outputs.is_empty()
    }
}

/// The result of one reaction. [`TraceLayout::row`](crate::TraceLayout::row) converts it to the cells of a trace; other engines build one from their own
/// values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Row {
    /// Ticks since the last row.
    pub dt: u32,
    /// The inputs by id, from the stimulus.
    pub inputs: Vec<i64>,
    /// The active steps in declaration order, including hidden and composite ones.
    pub steps: Vec<StepId>,
    /// The output values by id. The entries of extern actions are not used; `effects` contains their calls.
    pub outputs: Vec<i64>,
    /// The variable values by id; an array contributes its elements in order.
    pub vars: Vec<i64>,
    /// The fault flag (semantics §3.4, §5).
    pub fault: bool,
    /// Calls, in order.
    pub effects: Vec<Effect>,
    /// Cells that the chart leaves open.
    pub open: Open,
}

impl Row {
    /// A row of a net with every value 0 and no active step, to be filled in.
    #[must_use]
    pub fn zero(net: &Net) -> Self {
        Row {
            inputs: InputRow::zero(net).values,
            outputs: vec![0; net.outputs.len()],
            vars: vec![0; net.vars.values().map(|var| var.len.unwrap_or(1) as usize).sum()],
            ..Row::default()
        }
    }
}

/// True for inputs that have a column in stimuli and traces: all except internal events.
pub(crate) fn has_column(kind: InputKind) -> bool {
    kind != InputKind::InternalEvent
}
