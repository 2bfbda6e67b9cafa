//! The subject of a proof, and its questions.

use grafsynth_c::tree::Unit;
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::{Net, StepId};

use crate::limits::Limits;
use crate::symbolic::aig::Lit;

/// A question of the induction; every case asks the same questions.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Question {
    /// A scalar of the instance, by its number in the hint, after a reaction.
    State(usize),
    /// An output, by its number in the hint.
    Output(usize),
    /// The fault flag.
    Fault,
    /// The function that returns whether a step is active, by its number in the hint.
    Active(usize),
    /// The function that returns a variable, by its number in the hint.
    Var(usize),
    /// An operation that C may leave undefined, with its location.
    Obligation(&'static str, u32, usize),
}

pub(super) struct Check {
    pub(super) question: Question,
    /// The condition that must never be true.
    pub(super) broken: Lit,
}

/// A case: the active step of a component, or none of its steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Focus {
    pub(super) component: usize,
    pub(super) active: Option<StepId>,
}

/// The subject of a proof: the net with its facts, the C, the hint about their relation, and the limits.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub(super) net: &'a Valid<Net>,
    pub(super) facts: &'a Facts,
    pub(super) unit: &'a Unit,
    pub(super) hint: &'a Representation,
    pub(super) limits: &'a Limits,
}
