//! The behaviour of steps and transitions: statement lists, tasks, actions with qualifiers, delayed events.

use super::{Expr, InputId, Meta, OutputId, SendId, StepId, VarId};
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

/// Qualifiers of IEC 61131-3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "the names are those of the standard")]
pub enum Qualifier {
    N,
    R,
    S,
    L,
    D,
    P,
    P0,
    P1,
    SD,
    DS,
    SL,
}

impl Qualifier {
    /// All qualifiers, in the order of the standard's table.
    pub const ALL: [Qualifier; 11] = [
        Qualifier::N,
        Qualifier::R,
        Qualifier::S,
        Qualifier::L,
        Qualifier::D,
        Qualifier::P,
        Qualifier::P0,
        Qualifier::P1,
        Qualifier::SD,
        Qualifier::DS,
        Qualifier::SL,
    ];

    /// The letters of all qualifiers, as a list in a message.
    #[must_use]
    pub fn known() -> String {
        let [others @ .., last] = Self::ALL.map(Self::letters);
        format!("{} or {last}", others.join(", "))
    }

    /// True for a qualifier that makes all uses of its action controlled.
    #[must_use]
    pub const fn is_controlling(self) -> bool {
        !matches!(self, Qualifier::N | Qualifier::L | Qualifier::D)
    }

    /// True for a qualifier with a duration.
    #[must_use]
    pub const fn is_timed(self) -> bool {
        matches!(self, Qualifier::L | Qualifier::D | Qualifier::SD | Qualifier::DS | Qualifier::SL)
    }

    /// The standard's letters.
    #[must_use]
    pub const fn letters(self) -> &'static str {
        match self {
            Qualifier::N => "N",
            Qualifier::R => "R",
            Qualifier::S => "S",
            Qualifier::L => "L",
            Qualifier::D => "D",
            Qualifier::P => "P",
            Qualifier::P0 => "P0",
            Qualifier::P1 => "P1",
            Qualifier::SD => "SD",
            Qualifier::DS => "DS",
            Qualifier::SL => "SL",
        }
    }
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
