//! How C code represents a net between two reactions: the meaning of each member of its structures. The back end states this representation, and a proof uses
//! it as a hint. The proof checks what the hint states about the state of the net, so a wrong statement can prevent a proof but never cause a wrong one. It
//! does not check which member of the interface is which input or output, or which function answers which query: this defines the statement that is proved.

use crate::net::{HistoryId, InputId, OutputId, StepId, TransitionId, VarId};
use crate::program::Origin;

pub use crate::program::Carried;

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
    /// The functions of the user's library that are extern conditions.
    pub conditions: Vec<(InputId, String)>,
    /// The functions of the user's library that are extern actions.
    pub actions: Vec<(OutputId, String)>,
    /// For a statechart: the contents of the locals of `PREFIX_step` at the start of each round of its evolution.
    pub locals: Vec<(Local, Carried)>,
    /// The scalars of `PREFIX_t` that hold nothing of the state of the net.
    pub extra: Vec<(Place, Extra)>,
    /// If `PREFIX_step` skips reactions that cannot change anything: the members that it decides by. The reaction itself is `PREFIX_reaction`.
    pub gate: Option<Gate>,
    /// The functions of the user's library that each reaction calls for what it changed, if there are any.
    pub callbacks: Option<Callbacks>,
}

/// The functions of the user's library that a reaction calls for what it changed: once for each of these steps that it activated or deactivated, and once for
/// each of these transitions that it enabled. The order of the calls has no meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Callbacks {
    /// The function that is called with a step, and whether it is active now.
    pub activated: String,
    /// The steps, each with the constant that stands for it.
    pub steps: Vec<(StepId, String)>,
    /// The function that is called with a transition.
    pub enabled: String,
    /// The transitions, each with the constant that stands for it.
    pub transitions: Vec<(TransitionId, String)>,
}

/// The members by which `PREFIX_step` decides whether it skips a reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gate {
    /// 0 if no inputs are known, 1 if the members below are those of the last reaction, and 2 if that reaction also changed nothing.
    pub mark: String,
    /// The inputs of the last reaction, a `PREFIX_in_t`.
    pub inputs: Option<String>,
    /// The ticks of the last reaction.
    pub dt: Option<String>,
}

/// What is known, between two reactions, about a scalar of the instance that holds nothing of the state of the net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extra {
    /// A number from 0 to this one.
    UpTo(i64),
    /// Any value: neither a reaction nor a query reads it.
    Written,
    /// Whether the chart runs.
    Running {
        /// The number while it runs.
        runs: i64,
        /// The number after `PREFIX_stop`.
        stopped: i64,
    },
    /// A pointer to the image of the chart, the constant array `PREFIX_tables`.
    Image,
}

/// A scalar local of `PREFIX_step`, or a part of a local.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Local {
    /// The name of the local.
    pub name: String,
    /// The part that is meant.
    pub part: LocalPart,
}

/// A part of a local.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum LocalPart {
    /// All of it: it is a scalar.
    Whole,
    /// A member of a structure.
    Member(String),
    /// An element of an array.
    Element(u32),
    /// A bit of an array of bytes, of which the first one has the bits 0 to 7.
    Bit(u32),
}

impl std::fmt::Display for Local {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = &self.name;
        match &self.part {
            LocalPart::Whole => write!(f, "{name}"),
            LocalPart::Member(member) => write!(f, "{name}.{member}"),
            LocalPart::Element(at) => write!(f, "{name}[{at}]"),
            LocalPart::Bit(at) => write!(f, "bit {} of {name}[{}]", at % 8, at / 8),
        }
    }
}

/// A scalar member of a structure, or a bit of one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The member; that of a structure which is a member itself is `outer.inner`.
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
    /// The number of the active step among steps that exclude each other.
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
    /// What a history recorded, as the number of one of these states; 0 if nothing in them. A state counts as recorded if the history recorded it, a state that
    /// contains it, or a state in it.
    Recorded {
        /// The history.
        history: HistoryId,
        /// The states, which exclude each other, with their numbers.
        states: Vec<(StepId, i64)>,
    },
}
