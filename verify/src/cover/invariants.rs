//! Sets of which exactly one step is always active, beyond the disjoint components of a cover.
//!
//! Between a fork and a join the token of a component M is in some set R ⊂ M exactly while another branch B runs: the parallel rule found that B and R always contain
//! equally many tokens. So `(M \ R) ∪ B` always contains one token, as M does. The same is true for a branch inside B.
//!
//! How a set was found proves nothing here: [`keeps_one`] checks each of them against the net itself, with the conditions of the module `cover`.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::net::{ForcingOrder, Net, Step, StepId, TransitionId, TransitionKind};

use super::{closure, initial_situation};
use crate::exclusive;

/// The maximum number of steps in all sets together, as a multiple of the number of steps of the net, and for small nets.
const STEPS_OF_ALL: usize = 16;
const STEPS_OF_SMALL: usize = 1 << 16;

/// A branch that always contains as many tokens as some steps of another place did when the two were compared.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    pub(super) steps: Vec<StepId>,
    /// The steps of the other place at that time.
    pub(super) like: Vec<StepId>,
}

/// What the structure of a net tells about the number of tokens in a set.
pub(super) struct Checker<'n> {
    net: &'n Net,
    starts: IdMap<Step, bool>,
    /// Steps that two transitions may leave together in different ways.
    is_doubled: IdMap<Step, bool>,
    touching: IdMap<Step, Vec<TransitionId>>,
    /// For each forcing order, the parts that it forces, and the situation (`None` for `hold`).
    forced: Vec<(BTreeSet<usize>, Option<BTreeSet<StepId>>)>,
}

impl<'n> Checker<'n> {
    pub(super) fn new(net: &'n Net) -> Self {
        let mut starts = IdMap::filled(&net.steps, false);
        initial_situation(net).into_iter().for_each(|step| starts[step] = true);
        let mut is_doubled = IdMap::filled(&net.steps, false);
        exclusive::firing_together(net).iter().for_each(|one| is_doubled[one.step] = true);
        let mut touching = IdMap::filled(&net.steps, Vec::new());
        for (id, transition) in net.transitions.iter() {
            if transition.kind == TransitionKind::Move {
                let both =
                    transition.requires.iter().copied().chain(exclusive::entered(transition));
                both.for_each(|step| touching[step].push(id));
            }
        }
        let forced = net.forcings.iter().map(|forcing| {
            let parts = forcing.target.iter().map(|part| part.index()).gather();
            let situation = match &forcing.order {
                ForcingOrder::Hold => None,
                ForcingOrder::Situation(steps) => {
                    Some(closure(net, steps.iter().copied()).into_iter().gather())
                }
            };
            (parts, situation)
        });
        Checker { net, starts, is_doubled, touching, forced: forced.collect() }
    }

    /// True if the structure alone proves that exactly one of these steps is active in every situation, also between two micro-steps. False proves nothing.
    pub(super) fn keeps_one(&self, set: &BTreeSet<StepId>) -> bool {
        let steps = || set.iter().map(|step| (*step, &self.net.steps[*step]));
        if steps().any(|(id, step)| self.is_doubled[id] || step.parent.is_some())
            || set.iter().filter(|step| self.starts[**step]).count() != 1
        {
            return false;
        }
        let moves: BTreeSet<TransitionId> =
            set.iter().flat_map(|step| self.touching[*step].iter().copied()).gather();
        let keeps = moves.into_iter().all(|id| {
            let transition = &self.net.transitions[id];
            let taken = transition.requires.iter().filter(|step| set.contains(step)).count();
            let put = exclusive::entered(transition).filter(|step| set.contains(step)).count();
            taken == 1 && put == 1
        });
        keeps
            && self.forced.iter().all(|(parts, situation)| {
                let n = steps().filter(|(_, step)| parts.contains(&step.part.index())).count();
                let fits = situation.as_ref().is_none_or(|situation| {
                    set.iter().filter(|step| situation.contains(step)).count() == 1
                });
                n == 0 || n == set.len() && fits
            })
    }
}

/// The sets with one token among some candidates, and those that follow from always active sets and from branches.
///
/// `always` maps a place to a set with one token that contains the place. `branches` maps a place that was set aside to the number of the place that stayed,
/// and to the branch with the steps that held as many tokens.
pub(super) fn derived(
    net: &Net,
    candidates: Vec<Vec<StepId>>,
    always: &BTreeMap<u32, Vec<StepId>>,
    branches: &BTreeMap<u32, (u32, Branch)>,
) -> Vec<Vec<StepId>> {
    if candidates.is_empty() && branches.is_empty() {
        return Vec::new();
    }
    let checker = Checker::new(net);
    let mut budget = STEPS_OF_SMALL.max(net.steps.len() * STEPS_OF_ALL);
    let mut known: BTreeMap<u32, Option<BTreeSet<StepId>>> = BTreeMap::new();
    let mut found = Vec::new();
    for steps in candidates {
        let set: BTreeSet<StepId> = steps.into_iter().gather();
        if set.len() <= budget && checker.keeps_one(&set) {
            budget -= set.len();
            found.push(set.into_iter().collect());
        }
    }
    for place in branches.keys() {
        // The places from this one up to one whose set is known.
        let mut chain = Vec::new();
        let mut at = *place;
        while !known.contains_key(&at)
            && let Some((above, branch)) = branches.get(&at)
        {
            chain.push((at, branch));
            at = *above;
        }
        let mut set = match known.get(&at) {
            Some(set) => set.clone(),
            None => always.get(&at).map(|steps| steps.iter().copied().gather()),
        };
        for (at, branch) in chain.into_iter().rev() {
            if let Some(mut own) = set.take() {
                branch.like.iter().for_each(|step| {
                    own.remove(step);
                });
                own.extend(branch.steps.iter().copied());
                let size = own.len();
                if size <= budget && checker.keeps_one(&own) {
                    budget -= size;
                    found.push(own.iter().copied().collect());
                    set = Some(own);
                }
            }
            known.insert(at, set.clone());
        }
    }
    found
}
