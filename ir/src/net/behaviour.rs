//! The behaviour of steps and transitions: statement lists, tasks, actions with qualifiers, delayed events.

use super::{Expr, InputId, Meta, OutputId, Qualifier, SendId, StepId, VarId};
use crate::span::{Name, Span};

/// A list of statements; they run in order, and each sees the effects of the earlier ones (unless assignments are simultaneous).
pub type Block = Vec<Stmt>;

/// A statement with its source location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stmt {
    /// The statement itself.
    pub kind: StmtKind,
    /// Source location.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StmtKind {
    /// Stores a value, saturated to the type of the variable.
    Assign {
        /// The variable.
        var: VarId,
        /// The element's index, for an array.
        index: Option<Expr>,
        /// The new value.
        value: Expr,
    },
    /// Raises an event (§5).
    Raise(InputId),
    /// Starts a send slot.
    Send(SendId),
    /// Stops a send slot.
    Cancel(SendId),
    /// Calls an extern action.
    Call {
        /// An output whose driver is `Extern`.
        output: OutputId,
        /// The arguments, one for each parameter.
        arguments: Vec<Expr>,
    },
    /// A choice of two lists.
    If {
        /// The condition, a Boolean.
        condition: Expr,
        /// The statements that run if the condition is true.
        then: Block,
        /// The statements that run if the condition is false.
        otherwise: Block,
    },
    /// Target-language text; simulation and proof ignore it.
    Code(Verbatim),
}

/// Target-language text, passed through unchanged.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Verbatim {
    /// The language's name, such as `c`.
    pub language: String,
    /// The text.
    pub text: String,
}

/// An indivisible unit of a step's work (§6).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    /// The name of the task.
    pub name: Name,
    /// The cost; at most the step's budget.
    pub cost: u32,
    /// Assignments and extern calls.
    pub body: Block,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// An action with qualifiers: the ACTION_CONTROL of IEC 61131-3 (§3.5).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ControlledAction {
    /// The name of the action: that of the output that it drives, if it drives one.
    pub name: Name,
    /// The steps that use the action, with their qualifiers.
    pub uses: Vec<ActionUse>,
    /// The common duration of the action's timed qualifiers, in ticks; 0 if it has none.
    pub duration: u32,
    /// The statements that run once per reaction if Q is true (and once more afterwards, with a final scan).
    pub body: Block,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// One step's use of a [`ControlledAction`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ActionUse {
    /// The step.
    pub step: StepId,
    /// The qualifier.
    pub qualifier: Qualifier,
    /// An additional condition of the use; contains no edge and no event.
    pub condition: Option<Expr>,
    /// Source location.
    pub span: Span,
}

/// A slot for one pending send of an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SendSlot {
    /// The name of the slot.
    pub name: Name,
    /// The event that joins the external queue.
    pub event: InputId,
    /// The delay in ticks; with 0 the event joins the queue at once.
    pub delay: u32,
    /// Source location, comment and tags.
    pub meta: Meta,
}
