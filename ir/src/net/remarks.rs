//! What is said about a net besides how it runs: properties, open cells, macro-steps as they were drawn, places and pins.

use super::{Expr, Leaf, Meta, OutputId, StepId, TransitionId, VarId};
use crate::expr::Expr as GenericExpr;
use crate::span::{Name, Span};

/// Something that is, or must be, never true of a row: inputs, situation, outputs and variables after a reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Its name; may be empty.
    pub name: String,
    /// Assumed of the environment, or to be proved.
    pub role: PropertyRole,
    /// What never holds.
    pub never: PropertyExpr,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// What a [`Property`] is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PropertyRole {
    /// The environment guarantees it; over inputs only.
    Assume,
    /// The chart must guarantee it.
    Assert,
}

/// An expression that may also read the outputs of the row.
pub type PropertyExpr = GenericExpr<PropertyLeaf>;

/// What a property can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PropertyLeaf {
    /// A value of the net at the end of the reaction.
    Net(Leaf),
    /// An output of the row.
    Output(OutputId),
}

/// A cell that the designer left open (KISS2 `-` and `*`, §3.6).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unspecified {
    /// True in the situation before the reaction and this reaction's inputs for which the cell is open.
    pub when: Expr,
    /// The next situation, or one output.
    pub what: OpenCell,
}

/// What is left open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum OpenCell {
    /// The whole next situation.
    Next,
    /// The value of one output.
    Output(OutputId),
}

/// A macro-step as it was drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MacroStep {
    /// Full name.
    pub name: Name,
    /// All steps of its expansion, nested ones included.
    pub steps: Vec<StepId>,
    /// The entry step E.
    pub entry: StepId,
    /// The exit step S.
    pub exit: StepId,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// Where something shall be (§10).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placement {
    /// The step, variable, transition or output meant.
    pub item: PlacedItem,
    /// Chip or CPU.
    pub side: Side,
    /// Where it was written.
    pub span: Span,
}

/// What a [`Placement`] places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "each variant names the thing it places")]
pub enum PlacedItem {
    Step(StepId),
    Var(VarId),
    Transition(TransitionId),
    Output(OutputId),
}

/// The two sides of a split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Programmable logic.
    Chip,
    /// The microcontroller.
    Cpu,
}

/// Pins and device of one board.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Board {
    /// The device named, such as `gal22v10`.
    pub device: Option<Name>,
    /// Signal names (`clock` among them) and pin numbers, as written.
    pub pins: Vec<(Name, u32)>,
}
