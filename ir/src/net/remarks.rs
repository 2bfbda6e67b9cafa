//! Information about a net that does not affect its execution: properties, open cells, macro-steps as drawn, placements and pins.

use super::{Expr, Leaf, Meta, OutputId, StepId, TransitionId, VarId};
use crate::expr::Expr as GenericExpr;
use crate::span::{Name, Span};

/// A condition that is assumed or required never to be true in any row. A row consists of inputs, situation, outputs and
/// variables after a reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// The name of the property; may be empty.
    pub name: String,
    /// Whether the property is assumed or must be proved.
    pub role: PropertyRole,
    /// The condition that is never true.
    pub never: PropertyExpr,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The role of a [`Property`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PropertyRole {
    /// The environment guarantees the property, which reads only inputs.
    Assume,
    /// The chart must guarantee the property.
    Assert,
}

/// An expression that may also read the outputs of the row.
pub type PropertyExpr = GenericExpr<PropertyLeaf>;

/// A value that a property can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PropertyLeaf {
    /// A value of the net at the end of the reaction.
    Net(Leaf),
    /// An output of the row.
    Output(OutputId),
}

impl PropertyLeaf {
    /// The value of the net, if the leaf reads one.
    #[must_use]
    pub fn net(&self) -> Option<&Leaf> {
        if let PropertyLeaf::Net(leaf) = self { Some(leaf) } else { None }
    }
}

/// A cell that the designer left open (KISS2 `-` and `*`, §3.6).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unspecified {
    /// True for the situations before the reaction and the inputs of the reaction for which the cell is open.
    pub when: Expr,
    /// The open value: the next situation, or one output.
    pub what: OpenCell,
}

/// The open value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum OpenCell {
    /// The whole next situation.
    Next,
    /// The value of one output.
    Output(OutputId),
}

/// A macro-step as drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MacroStep {
    /// Full name.
    pub name: Name,
    /// All steps of the macro-step's expansion, nested ones included.
    pub steps: Vec<StepId>,
    /// The entry step E.
    pub entry: StepId,
    /// The exit step S.
    pub exit: StepId,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// A placement request (§10).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placement {
    /// The step, variable, transition or output to place.
    pub item: PlacedItem,
    /// The name of the requested part, as in `--part NAME=DEVICE`.
    pub part: Name,
    /// Source location.
    pub span: Span,
}

/// The object of a [`Placement`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "each variant names the thing it places")]
pub enum PlacedItem {
    Step(StepId),
    Var(VarId),
    Transition(TransitionId),
    Output(OutputId),
}

/// Pins and device of one board.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Board {
    /// The device named, such as `gal22v10`.
    pub device: Option<Name>,
    /// Signal names (including `clock`) and pin numbers, as written.
    pub pins: Vec<(Name, u32)>,
}
