//! The plan of a reaction: the decisions of a translation of a net before it writes anything.
//!
//! The plan contains the order of lists, competing transitions and steps, the largest count of each timer, the edges, levels of actions and events that are
//! read at all, and the value that an edge is compared with. All of these follow from the net alone, so every translation uses this plan: the reaction program
//! and the C back end's own styles. The simulator and the second encoding of a reaction do not: they check what is translated, so they must not share its
//! decisions.

mod needs;
mod ranks;

pub use needs::Needs;
pub use ranks::{LAST, Ranks, following, urgency};

use crate::net::{EdgeOperand, Leaf};

/// True if the operand reads only inputs and constants, so that it is compared with the previous reaction (§3.7).
#[must_use]
pub fn is_over_inputs(operand: &EdgeOperand) -> bool {
    operand.expr.leaves().all(|leaf| matches!(leaf, Leaf::Input(_)))
}
