//! What is known of a net beyond its text. `grafsynth-verify` finds facts; back ends use only those that are marked proved.

use crate::arena::IdMap;
use crate::net::{Evolution, Net, Step, StepId, TransitionId};

/// All facts of one net.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Facts {
    /// How the situations were explored.
    pub reach: Option<Reach>,
    /// Place invariants: in every reachable situation exactly `count` of the steps are active.
    pub invariants: Vec<Invariant>,
    /// A cover by sequential components, each with exactly one active step; disjoint. Empty when none was found.
    pub components: Vec<Component>,
    /// The component of each step, as an index into `components`, where it has one.
    pub component_of: Option<IdMap<Step, Option<u32>>>,
    /// Steps that are never active.
    pub unreachable_steps: Vec<StepId>,
    /// Transitions that never fire.
    pub dead_transitions: Vec<TransitionId>,
    /// A bound on the micro-steps of one reaction, where one below `limit` was proved.
    pub stable_depth: Option<Proved<u32>>,
    /// The most checks of one reaction (rounds of EVOLVE, semantics.md §3.9), with the empty one at its end. Also for statecharts, where a check may be
    /// for an event taken from a queue.
    pub rounds: Option<Proved<u32>>,
    /// No reaction ever ends with a fault: each evolution becomes stable within the limit, and no queue overflows. Also for statecharts, where the limit
    /// counts anew with each external event and so is no depth.
    pub always_stable: Option<Proof>,
    /// At most one event is ever pending in the internal queue.
    pub single_pending: Option<Proved<bool>>,
    /// What was not found out, and why: for reports.
    pub open: Vec<String>,
}

impl Facts {
    /// The most rounds of the evolution of one reaction that are proved: checks, the one that finds nothing to fire among them. None for charts without
    /// evolution, and where nothing was proved. Outside statecharts a bound on the micro-steps is one on the rounds too, with one more.
    #[must_use]
    pub fn most_rounds(&self, net: &Net) -> Option<Proved<u32>> {
        let Evolution::Stable { .. } = net.settings.evolution else { return None };
        let of_depth = self
            .stable_depth
            .as_ref()
            .filter(|_| !net.settings.policy.is_statechart())
            .map(|depth| Proved { value: depth.value.saturating_add(1), by: depth.by });
        self.rounds.clone().into_iter().chain(of_depth).min_by_key(|rounds| rounds.value)
    }
}

/// A value with the way it was found out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proved<T> {
    /// The value.
    pub value: T,
    /// How it was proved.
    pub by: Proof,
}

/// How something was proved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Proof {
    /// All reachable states were enumerated.
    Explicit,
    /// All reachable situations were computed as a decision diagram.
    Symbolic,
    /// It follows from the structure for every input (place invariants and the fork/join structure).
    Structural,
    /// By induction over one reaction.
    Induction,
}

/// The reachable set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reach {
    /// Number of reachable situations (an over-approximation unless `exact`); `u128::MAX` stands for that many or more.
    pub situations: u128,
    /// True when every reachable situation is counted once and no other is.
    pub exact: bool,
    /// How.
    pub by: Proof,
    /// The situations themselves where they are few enough: bit sets over the steps, 64 to a word, in order of discovery.
    pub sets: Option<Vec<Vec<u64>>>,
}

/// Exactly `count` of these steps are active in every reachable situation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invariant {
    /// The steps, in declaration order.
    pub steps: Vec<StepId>,
    /// How many of them are active.
    pub count: u32,
    /// How it was proved.
    pub by: Proof,
}

/// A sequential component: at most one of its steps is active, exactly one if `always`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    /// The steps, in declaration order.
    pub steps: Vec<StepId>,
    /// One of them is active in every reachable situation; else there are situations in which none is.
    pub always: bool,
    /// How it was proved.
    pub by: Proof,
}
