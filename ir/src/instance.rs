//! How C code represents a net between two reactions: the meaning of each member of its structures. The back end states this representation, and a proof uses
//! it as a hint. The proof checks what the hint states about the state of the net, so a wrong statement can prevent a proof but never cause a wrong one. It
//! does not check which member of the interface is which input or output, or which function answers which query: this defines the statement that is proved.

use crate::net::{InputId, OutputId, StepId, VarId};
use crate::program::Origin;

/// The representation of a net in C.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Representation {
    /// The prefix of functions and types: `PREFIX_step`, `PREFIX_t`.
    pub prefix: String,
    /// The places of the inputs in `PREFIX_in_t`.
    pub inputs: Vec<(InputId, Place)>,
    /// The places of the outputs in `PREFIX_out_t`.
    pub outputs: Vec<(OutputId, Place)>,
    /// The contents of the scalars of `PREFIX_t`.
    pub state: Vec<(Place, Holds)>,
    /// The functions that return whether a step is active.
    pub active: Vec<(StepId, String)>,
    /// The functions that return a variable.
    pub vars: Vec<(VarId, String)>,
    /// The function that returns the fault, if there is one.
    pub fault: Option<String>,
}

/// A scalar member of a structure, or a bit of one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The member.
    pub member: String,
    /// The index, if the member is an array.
    pub element: Option<u32>,
    /// The bit, if several values share the scalar.
    pub bit: Option<u32>,
}

impl Place {
    /// A member that is not an array.
    #[must_use]
    pub fn member(name: impl Into<String>) -> Place {
        Place { member: name.into(), element: None, bit: None }
    }

    /// An element of a member that is an array.
    #[must_use]
    pub fn element(name: impl Into<String>, index: u32) -> Place {
        Place { member: name.into(), element: Some(index), bit: None }
    }
}

/// The contents of a scalar of the instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Holds {
    /// An element of a piece of the net's state; the element is 0 unless it is an array.
    Piece(Origin, u32),
    /// The number of the active one of some steps that exclude each other.
    ActiveOf {
        /// The steps and their numbers.
        steps: Vec<(StepId, i64)>,
        /// The number that means that none of them is active, if there is one.
        none: Option<i64>,
    },
    /// The ticks since the active one of these steps became active, up to `cap`.
    TimeOf {
        /// The steps.
        steps: Vec<StepId>,
        /// The maximum.
        cap: i64,
        /// True if the scalar is 0 while none of the steps is active; otherwise it may then have any value up to `cap`.
        is_zero_between: bool,
    },
}
