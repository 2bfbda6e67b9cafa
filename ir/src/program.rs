//! The reaction program: one reaction of a net as a bounded sequential program over finite-domain cells.
//!
//! [`crate::lower::program`] makes it from a valid net; this is the only place where all of `docs/semantics.md` is turned into sequential code. The C back
//! end prints it if no faster form exists, and the logic encoding executes it symbolically. The simulator and the second encoding of the verifier do *not*
//! use it: they are written directly from semantics.md and check it.
//!
//! A program has no unbounded loop: each [`Stmt::Repeat`] has a bound. All arithmetic is exact (the expressions of [`crate::expr`]).

use crate::arena::{Arena, Id};
use crate::expr::{Expr as GenericExpr, Type};
pub use crate::net::ActionPart;
use crate::net::{
    ActionId, EdgeId, HistoryId, InputId, OutputId, PartId, SendId, StepId, TimerId, TransitionId,
    VarId, Verbatim,
};

/// Identifies a cell.
pub type CellId = Id<Cell>;
/// Identifies a temporary.
pub type TempId = Id<Temp>;
/// An expression of a program.
pub type Expr = GenericExpr<Leaf>;

/// One reaction.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Program {
    /// State between reactions.
    pub cells: Arena<Cell>,
    /// Values within a reaction; each is set before it is read.
    pub temps: Arena<Temp>,
    /// Calls and target-language texts of the reset, in order, with constant arguments. ([`Cell::init`] contains the reset values of cells.)
    pub reset_effects: Vec<ResetEffect>,
    /// The values of all outputs after reset, by output id. Extern actions have 0 here; their calls are in `reset_effects`.
    pub reset_outputs: Vec<i64>,
    /// The fault flag of row 0: a statechart runs to completion at reset, which can fail.
    pub reset_fault: bool,
    /// The reaction.
    pub body: Vec<Stmt>,
    /// The condition that the evolution loop tests before each round (one round is one check); `None` if a reaction is a single check.
    pub evolution: Option<TempId>,
    /// For a statechart: the temporaries whose values at the end of a check are read later, with their meaning.
    pub carried: Vec<(TempId, Carried)>,
    /// The timers that several steps share.
    pub shared_timers: Vec<SharedTimer>,
}

/// A timer that steps share because they exclude each other. Its cell is [`Origin::SharedElapsed`] of the first step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedTimer {
    /// Suggested name, made from the chart's names.
    pub name: String,
    /// The steps, in declaration order, each with one above the largest constant that its time is compared with: the cap of its own `s.t`.
    pub steps: Vec<(StepId, i64)>,
    /// The value at which the register stops counting: at least the largest cap of the steps.
    pub cap: i64,
    /// True if one of the steps is always active.
    pub is_always: bool,
}

/// A call or target-language text of the reset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResetEffect {
    /// A call of an extern action with these arguments.
    Call(OutputId, Vec<i64>),
    /// Verbatim text.
    Code(Verbatim),
}

/// A piece of state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Suggested name, made from the chart's names; it may not be unique or legal in the target.
    pub name: String,
    /// The type of the value or of each element.
    pub ty: Type,
    /// The number of elements of an array; `None` for a plain cell.
    pub len: Option<u32>,
    /// The value after reset: one, or one for each element.
    pub init: Vec<i64>,
    /// The part of the net's state that the cell stores.
    pub origin: Origin,
}

impl Cell {
    /// A single cell, as near to 0 as its type allows before reset.
    #[must_use]
    pub fn plain(name: String, ty: Type, origin: Origin) -> Self {
        Cell { name, ty, len: None, init: vec![ty.saturate(0)], origin }
    }
}

/// The part of the net's state that a [`Cell`] stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Origin {
    /// The step's bit.
    Step(StepId),
    /// The bit of a state in the register of its region, on a chip: the state is active if this bit is set and its parent is active. While the parent is
    /// inactive, the register keeps its last value, which a history records.
    Region(StepId),
    /// `s.t`, saturated one above the largest constant that it is compared with.
    Elapsed(StepId),
    /// The time of whichever step of a [`SharedTimer`] is active; 0 if none is. The payload is the first step of that timer.
    SharedElapsed(StepId),
    /// `s.T`.
    LastElapsed(StepId),
    /// A variable.
    Var(VarId),
    /// The operand's value in the last comparison.
    Edge(EdgeId),
    /// A free timer.
    Timer(TimerId),
    /// True if the timer's condition was true at the end of the last reaction.
    TimerCondition(TimerId),
    /// The first step is older (was activated earlier) than the second.
    Older(StepId, StepId),
    /// The index of the step's next task.
    TaskIndex(StepId),
    /// Q of a controlled action at the end of the last reaction.
    ActionQ(ActionId),
    /// A latch of a controlled action's standard block.
    ActionLatch(ActionId, ActionPart),
    /// A timer of a controlled action's standard block.
    ActionTimer(ActionId, ActionPart),
    /// The event was raised and will be present in the next micro-step.
    Pending(InputId),
    /// The internal queue of a statechart (an array of event numbers); its length is in `InternalLength`.
    InternalQueue,
    /// The length of the internal queue.
    InternalLength,
    /// The external queue.
    ExternalQueue,
    /// The length of the external queue.
    ExternalLength,
    /// Ticks until a send is due; 0 while the slot is not running.
    SendTimer(SendId),
    /// The slot is running.
    SendRuns(SendId),
    /// The history recorded this step.
    Recorded(HistoryId, StepId),
    /// The statechart of this part has ended in a top-level final state.
    Ended(PartId),
    /// The fault flag of the last reaction.
    Fault,
    /// The contribution of an ended chart's steps to an output in its last row; or the value of an output that is held while a chip is busy.
    HeldOutput(OutputId, PartId),
    /// The value of a step's bit when an edge comparison started, and other auxiliary cells of one pass.
    Helper,
}

/// What an evolution carries from one check to the next, besides the state of the net (semantics §3.9).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Carried {
    /// The reaction has a fault so far.
    Fault,
    /// There is another check.
    Again,
    /// The number of the event of this check, counted from 1 in this list; 0 for a check without an event.
    Event(Vec<InputId>),
    /// The micro-steps since the last event that restarts the count; outside statecharts, since the start of the reaction.
    Count,
    /// Outside statecharts: this event is present in this check.
    Present(InputId),
    /// The number of waiting events that restart the count.
    Restarts,
    /// This event of the row is still waiting.
    Waits(InputId),
    /// The chart had ended before this reaction.
    HadEnded(PartId),
    /// This extern condition was called in this reaction.
    Asked(InputId),
    /// The value of this extern condition, if it was called in this reaction.
    Answer(InputId),
}

/// A value within a reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Temp {
    /// Suggested name of the temporary.
    pub name: String,
    /// The type of the temporary.
    pub ty: Type,
    /// The meaning of the temporary.
    pub role: TempRole,
}

/// The meaning of a [`Temp`]; emitters use it for comments and provenance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TempRole {
    /// The transition is enabled and its receptivity is true.
    Fireable(TransitionId),
    /// The transition fires.
    Fire(TransitionId),
    /// The step's bit at the end of the micro-step.
    NextActive(StepId),
    /// The step is activated in this micro-step.
    Activated(StepId),
    /// The step is deactivated in this micro-step.
    Deactivated(StepId),
    /// The event is present in this micro-step.
    Holds(InputId),
    /// The edge operand's present value.
    EdgeNow(EdgeId),
    /// The variable's value at the start of the micro-step (simultaneous assignments).
    Before(VarId),
    /// Anything else.
    Helper,
}

/// A value that an expression of a program can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leaf {
    /// The current value of a cell.
    Cell(CellId),
    /// A temporary.
    Temp(TempId),
    /// An input, extern condition or external event of this reaction, as latched.
    Input(InputId),
    /// The ticks since the last reaction, 0 or more; 0 or 1 on a chip.
    Dt,
}

impl Leaf {
    /// The input, extern condition or event.
    #[must_use]
    pub fn input(&self) -> Option<InputId> {
        if let Leaf::Input(input) = self { Some(*input) } else { None }
    }
}

/// A statement of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stmt {
    /// Sets a temporary.
    Set(TempId, Expr),
    /// Stores into a cell, saturated to its type; the index is for arrays.
    Store(CellId, Option<Expr>, Expr),
    /// Runs the first list if the condition is true, otherwise the second.
    If(Expr, Vec<Stmt>, Vec<Stmt>),
    /// Runs the list at most `limit` times; stops before a round whose condition is false.
    Repeat {
        /// Maximum number of rounds.
        limit: u32,
        /// The condition that is evaluated before each round; it reads cells and temporaries that were set before the loop or in the previous round.
        condition: Expr,
        /// The statements of one round.
        body: Vec<Stmt>,
    },
    /// Sets the value of an output in this reaction; each output except extern actions is set exactly once, at the end.
    Output(OutputId, Expr),
    /// Calls an extern action.
    Call(OutputId, Vec<Expr>),
    /// Runs target-language text.
    Code(Verbatim),
    /// Records what the reaction does at this point, for an observer; it changes nothing. Only programs with
    /// [`Additions::marks`](crate::lower::program::Additions::marks) contain it.
    Mark(Mark),
    /// Sets the fault flag of this reaction (stable evolution and queues only).
    Fault(Expr),
}

/// What a [`Stmt::Mark`] records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mark {
    /// A micro-step of a stable evolution begins; a single check needs no such mark.
    MicroStep,
    /// The transition or reaction fires, before any list of its micro-step runs.
    Fires(TransitionId),
}

impl Stmt {
    /// The expressions that the statement itself evaluates, in this order; those of its lists are not included.
    pub fn exprs(&self) -> impl Iterator<Item = &Expr> {
        let (few, many): ([Option<&Expr>; 2], &[Expr]) = match self {
            Stmt::Set(_, value) | Stmt::Output(_, value) | Stmt::Fault(value) => {
                ([Some(value), None], &[])
            }
            Stmt::Store(_, index, value) => ([index.as_ref(), Some(value)], &[]),
            Stmt::If(condition, ..) | Stmt::Repeat { condition, .. } => {
                ([Some(condition), None], &[])
            }
            Stmt::Call(_, arguments) => ([None; 2], arguments),
            Stmt::Code(_) | Stmt::Mark(_) => ([None; 2], &[]),
        };
        few.into_iter().flatten().chain(many)
    }

    /// The temporary or cell that the statement itself sets.
    #[must_use]
    pub fn target(&self) -> Option<Leaf> {
        match self {
            Stmt::Set(temp, _) => Some(Leaf::Temp(*temp)),
            Stmt::Store(cell, ..) => Some(Leaf::Cell(*cell)),
            _ => None,
        }
    }

    /// The statement lists inside: both branches of a choice, or the body of a loop.
    #[must_use]
    pub fn lists(&self) -> [&[Stmt]; 2] {
        match self {
            Stmt::If(_, then, otherwise) => [then, otherwise],
            Stmt::Repeat { body, .. } => [body, &[]],
            _ => [&[]; 2],
        }
    }
}

/// All statements of a list in the order of the text, each before those inside it.
pub fn statements(list: &[Stmt]) -> impl Iterator<Item = &Stmt> {
    crate::walk::nested(list, Stmt::lists)
}

/// All expressions of a list and of the lists inside, without their operands.
pub fn expressions(list: &[Stmt]) -> impl Iterator<Item = &Expr> {
    statements(list).flat_map(Stmt::exprs)
}
