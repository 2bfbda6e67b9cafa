//! Facts about a net that an analysis found. `grafsynth-verify` finds them; back ends use only facts that are marked as proved.

use crate::arena::IdMap;
use crate::net::{Evolution, Net, Step, StepId, TransitionId};

/// All facts of one net.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Facts {
    /// The result of the exploration of situations.
    pub reach: Option<Reach>,
    /// Place invariants: each gives the number of active steps in a set, which is the same in every reachable situation.
    pub invariants: Vec<Invariant>,
    /// A cover by disjoint sequential components. Empty if none was found.
    pub components: Vec<Component>,
    /// The component of each step, as an index into `components`, if it has one.
    pub component_of: Option<IdMap<Step, Option<u32>>>,
    /// Steps that are never active.
    pub unreachable_steps: Vec<StepId>,
    /// Transitions that never fire.
    pub dead_transitions: Vec<TransitionId>,
    /// True if all other steps are active at some time, and all other transitions fire.
    pub all_dead_known: bool,
    /// A bound on the micro-steps of one reaction, if one below `limit` was proved.
    pub stable_depth: Option<Proved<u32>>,
    /// The maximum number of checks in one reaction (rounds of EVOLVE, semantics.md §3.9), including the final check that finds nothing to fire. This also
    /// applies to statecharts, where a check may be for an event taken from a queue.
    pub rounds: Option<Proved<u32>>,
    /// The proof that no reaction ends with a fault, if one was found: each evolution becomes stable within the limit, and no queue overflows. This also
    /// applies to statecharts, where the count starts again with each external event, so the limit does not bound the micro-steps of a reaction.
    pub always_stable: Option<Proof>,
    /// True if at most one event is ever pending in the internal queue.
    pub single_pending: Option<Proved<bool>>,
    /// Open questions and the reason for each, for reports.
    pub open: Vec<String>,
}

impl Facts {
    /// The proved maximum number of rounds in the evolution of one reaction, including the last check, which finds nothing to fire. `None` for charts
    /// without evolution, and if nothing was proved. Outside statecharts, the rounds are at most the proved bound on the micro-steps plus one.
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

    /// Without the facts that apply only at the ends of reactions: those about situations that a search found.
    #[must_use]
    pub fn between_micro_steps(&self, net: &Net) -> Facts {
        let lasts = |by: Proof| is_about_micro_steps(net, by);
        let is_kept = |at: &u32| self.components.get(*at as usize).is_some_and(|it| lasts(it.by));
        let component_of = self
            .component_of
            .as_ref()
            .map(|of| IdMap::build(&net.steps, |step, _| of[step].filter(is_kept)));
        Facts {
            reach: self.reach.clone().filter(|reach| lasts(reach.by)),
            invariants: self.invariants.iter().filter(|it| lasts(it.by)).cloned().collect(),
            component_of,
            unreachable_steps: Vec::new(),
            dead_transitions: Vec::new(),
            all_dead_known: false,
            ..self.clone()
        }
    }

    /// True if it is proved that the two steps are never active together, not even between the micro-steps of a reaction.
    #[must_use]
    pub fn exclude(&self, net: &Net, a: StepId, b: StepId) -> bool {
        let both = |steps: &[StepId]| steps.contains(&a) && steps.contains(&b);
        let of_components = self.components.iter().map(|it| (&it.steps, it.by));
        let of_invariants =
            self.invariants.iter().filter(|it| it.count == 1).map(|it| (&it.steps, it.by));
        let is_alone = of_components.chain(of_invariants);
        if is_alone.into_iter().any(|(steps, by)| is_about_micro_steps(net, by) && both(steps)) {
            return true;
        }
        let known = self.reach.as_ref().filter(|reach| is_about_micro_steps(net, reach.by));
        let sets = known.and_then(|reach| reach.sets.as_ref());
        sets.is_some_and(|sets| !sets.iter().any(|set| is_active(set, a) && is_active(set, b)))
    }
}

/// True if a fact proved in this way also applies between the micro-steps of a reaction: a search visits only the situations at the ends of reactions.
fn is_about_micro_steps(net: &Net, by: Proof) -> bool {
    net.settings.evolution == Evolution::Single
        || matches!(by, Proof::Structural | Proof::Induction)
}

/// True if the step is active in a situation of [`Reach::sets`].
#[must_use]
pub fn is_active(set: &[u64], step: StepId) -> bool {
    set.get(step.index() / 64).is_some_and(|word| word >> (step.index() % 64) & 1 == 1)
}

/// A value with the method that proved it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proved<T> {
    /// The value.
    pub value: T,
    /// The method that proved the value.
    pub by: Proof,
}

/// The method that proved a fact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Proof {
    /// All reachable states were enumerated.
    Explicit,
    /// All reachable situations were computed as a decision diagram.
    Symbolic,
    /// The structure of the net (place invariants and forks and joins) implies the fact for all inputs.
    Structural,
    /// By induction over one reaction.
    Induction,
    /// By property-directed reachability: a set of clauses, found by search, is an inductive invariant that implies the fact.
    Directed,
}

/// The reachable set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reach {
    /// Number of reachable situations (an over-approximation unless `exact`); `u128::MAX` means at least that many.
    pub situations: u128,
    /// True if every reachable situation is counted once and no other situation is counted.
    pub exact: bool,
    /// The method that computed the set.
    pub by: Proof,
    /// The situations themselves if there are few enough: bit sets over the steps, 64 per word, in order of discovery.
    pub sets: Option<Vec<Vec<u64>>>,
}

/// Exactly `count` of these steps are active in every reachable situation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invariant {
    /// The steps, in declaration order.
    pub steps: Vec<StepId>,
    /// The number of active steps.
    pub count: u32,
    /// The method that proved the invariant.
    pub by: Proof,
}

/// A sequential component: at most one of its steps is active, exactly one if `always`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    /// The steps, in declaration order.
    pub steps: Vec<StepId>,
    /// True if one of the steps is active in every reachable situation; otherwise there may be situations in which none is.
    pub always: bool,
    /// The method that proved the component.
    pub by: Proof,
}
