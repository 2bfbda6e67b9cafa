//! The reaction program: one reaction of a net, written out as a bounded sequential program over finite-domain cells.
//!
//! [`crate::lower::program`] makes it from a valid net; it is the one place where the full generality of `docs/semantics.md` is turned into straight code.
//! The C back end prints it where no faster shape exists, and the logic encoding executes it symbolically. The simulator and the second encoding of the
//! verifier do *not* use it: they are written from semantics.md itself and check it.
//!
//! A program has no unbounded loop: [`Stmt::Repeat`] carries its bound. All arithmetic is exact (the expressions of [`crate::expr`]).

use crate::arena::{Arena, Id};
use crate::expr::{Expr as GenericExpr, Type};
use crate::net::{
    ActionId, EdgeId, HistoryId, InputId, OutputId, PartId, SendId, StepId, TimerId, TransitionId,
    VarId, Verbatim,
};

/// Names a cell.
pub type CellId = Id<Cell>;
/// Names a temporary.
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
    /// Calls and verbatim texts that reset makes, in order, with constant arguments. (What reset does to cells is in [`Cell::init`].)
    pub reset_effects: Vec<ResetEffect>,
    /// The values of all outputs after reset, by output id; extern actions show their calls in `reset_effects` and have 0 here.
    pub reset_outputs: Vec<i64>,
    /// The fault flag of row 0: a statechart runs to completion at reset, and may fail to.
    pub reset_fault: bool,
    /// The reaction.
    pub body: Vec<Stmt>,
    /// What the loop of an evolution asks before each round, which is one check; none where a reaction is a single check.
    pub evolution: Option<TempId>,
}

/// A call or text of the reset.
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
    /// Suggested name, made of the chart's names; not unique, not yet fit for any target.
    pub name: String,
    /// The type of the value or of each element.
    pub ty: Type,
    /// The number of elements of an array; none for a plain cell.
    pub len: Option<u32>,
    /// The value after reset: one, or one for each element.
    pub init: Vec<i64>,
    /// What of the net it holds.
    pub origin: Origin,
}

/// What of the net's state a [`Cell`] holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Origin {
    /// The step's bit.
    Step(StepId),
    /// The bit of a state in the register of the region that it belongs to, on a chip: the state is active if this is set and its parent is active.
    /// While the parent is not, the register keeps what it was when the parent was left, which is what a history records.
    Region(StepId),
    /// `s.t`, saturated one above the largest constant it is compared with.
    Elapsed(StepId),
    /// `s.T`.
    LastElapsed(StepId),
    /// A variable.
    Var(VarId),
    /// The operand's value when last compared.
    Edge(EdgeId),
    /// A free timer.
    Timer(TimerId),
    /// Whether the timer's condition held at the end of the last reaction.
    TimerCondition(TimerId),
    /// The first step is older (activated longer ago) than the second.
    Older(StepId, StepId),
    /// The step's next task.
    TaskIndex(StepId),
    /// Q of a controlled action at the end of the last reaction.
    ActionQ(ActionId),
    /// A latch of a controlled action's standard block.
    ActionLatch(ActionId, ActionPart),
    /// A timer of a controlled action's standard block.
    ActionTimer(ActionId, ActionPart),
    /// The event was raised and holds in the next micro-step.
    Pending(InputId),
    /// The internal queue of a statechart (array of event numbers), its length in `InternalLength`.
    InternalQueue,
    /// The length of the internal queue.
    InternalLength,
    /// The external queue.
    ExternalQueue,
    /// The length of the external queue.
    ExternalLength,
    /// Ticks until a send is due; 0 while the slot does not run.
    SendTimer(SendId),
    /// The slot runs.
    SendRuns(SendId),
    /// The history recorded this step.
    Recorded(HistoryId, StepId),
    /// The statechart of this part has ended in a top-level final state.
    Ended(PartId),
    /// The fault flag of the last reaction.
    Fault,
    /// What the steps of an ended chart gave to an output in its last row; or an output that is held while a chip is busy.
    HeldOutput(OutputId, PartId),
    /// The value a step's bit had when an edge comparison started; and other helpers of one pass.
    Helper,
}

/// The parts of the ACTION_CONTROL block that keep state. `DSHeld` is the last input of the timer of DS, whose own latch stands behind the timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "the names are those of the standard's block")]
pub enum ActionPart {
    S,
    L,
    D,
    P,
    P0,
    P1,
    SD,
    DS,
    DSHeld,
    SL,
}

/// A value within a reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Temp {
    /// Suggested name.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// What it says.
    pub role: TempRole,
}

/// What a [`Temp`] says; emitters make comments and provenance of it.
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
    /// The event holds in this micro-step.
    Holds(InputId),
    /// The edge operand's present value.
    EdgeNow(EdgeId),
    /// The value at the start of the micro-step (simultaneous assignments).
    Before(VarId),
    /// Anything else.
    Helper,
}

/// A value that an expression of a program can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leaf {
    /// A cell as it stands.
    Cell(CellId),
    /// A temporary.
    Temp(TempId),
    /// An input, extern condition or external event of this reaction, as latched.
    Input(InputId),
    /// The ticks since the last reaction, 0 or more; 0 or 1 on a chip.
    Dt,
}

/// A statement of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stmt {
    /// Sets a temporary.
    Set(TempId, Expr),
    /// Stores into a cell, saturated to its type; the index is for arrays.
    Store(CellId, Option<Expr>, Expr),
    /// Either list.
    If(Expr, Vec<Stmt>, Vec<Stmt>),
    /// Runs the list at most `limit` times, ending before a round whose condition is false.
    Repeat {
        /// Bound.
        limit: u32,
        /// Asked before each round; over cells and temps set before the loop or in the previous round.
        condition: Expr,
        /// One round.
        body: Vec<Stmt>,
    },
    /// Gives the value of an output in this reaction; each output but extern actions is given exactly once, at the end.
    Output(OutputId, Expr),
    /// Calls an extern action.
    Call(OutputId, Vec<Expr>),
    /// Runs verbatim text.
    Code(Verbatim),
    /// Gives the fault flag of this reaction (stable evolution and queues only).
    Fault(Expr),
}
