//! The plan of a reaction: what a translation of a net decides before it writes anything.
//!
//! Which order lists, competing transitions and steps have, how far a timer counts, which edges, levels of actions and events are read at all, and what an edge is
//! compared with: these follow from the net alone, so every translation takes them from here, the reaction program as well as the C back end's own styles.
//! The simulator and the second encoding of a reaction do not: they check what is translated, so they must not share its decisions.

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
