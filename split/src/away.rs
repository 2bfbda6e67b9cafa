//! Steps that stand for the rest of a sequential component (semantics §10.2).
//!
//! A cut through a sequential component leaves a part with some of its steps, and with images that enter one of them from nowhere or leave one of them to nowhere.
//! Nothing in the part then shows that at most one of these steps is active, so its C would have one bit for each. The step *away* is active if none of them is:
//! an image from nowhere takes it, and a transition to nowhere enters it. So the steps are a sequential component of the part again. The step changes
//! nothing that the part shows: an image from nowhere takes another step of the component, so it fires only if none of these steps is active. The joint proof shows
//! that.

use grafsynth_ir::Gather;
use grafsynth_ir::Name;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::facts::Component;
use grafsynth_ir::net::{
    Enter, Net, Policy, Step, StepId, StepKind, Transition, TransitionId, TransitionKind,
};
use grafsynth_ir::plan::following;

use crate::pieces::{Ids, unused};

/// The transitions of a part that another part decides, each with the transition of the net.
pub(crate) type Images<'n> = BTreeMap<TransitionId, &'n Transition>;

/// Adds a step for the rest of each component of the net that the part has two or more, but not all steps of. `steps` has the part's step for each step of the
/// net. Returns, for each added step in order, the steps of the net that it excludes.
pub(crate) fn add(
    part: &mut Net,
    components: &[Component],
    (steps, images): (&Ids<Step>, &Images<'_>),
    used: &mut BTreeSet<String>,
) -> Vec<Vec<StepId>> {
    let mut added = Vec::new();
    for component in components {
        let own = component.steps.iter();
        let own: BTreeMap<StepId, StepId> =
            own.filter_map(|step| Some((*step, *steps.get(step)?))).gather();
        let here: BTreeSet<StepId> = own.values().copied().gather();
        if here.len() < 2 || here.len() == component.steps.len() {
            continue;
        }
        let Some(crossings) = crossings(part, component, &here, images) else { continue };
        let Some(first) = here.first().map(|step| &part.steps[*step]) else { continue };
        let name = unused(format!("away_{}", first.name.text.replace('.', "_")), used);
        let mut away = Step::new(Name::new(name, first.name.span), first.part);
        away.meta.label = "the step is on another part".to_owned();
        away.is_initial = here.iter().all(|step| !part.steps[*step].is_initial);
        let away = part.steps.push(away);
        for (id, comes) in crossings {
            let transition = &mut part.transitions[id];
            if comes {
                transition.requires.push(away);
                transition.clears.push(away);
            } else {
                transition.enters.push(Enter::Step(away));
            }
        }
        added.push(own.into_keys().collect());
    }
    added
}

/// The transitions that change whether one of the steps `here` is active, each with whether it enters one. `None` if something else can change it, or
/// if the new step would change what the part itself decides.
fn crossings(
    part: &Net,
    component: &Component,
    here: &BTreeSet<StepId>,
    images: &Images<'_>,
) -> Option<Vec<(TransitionId, bool)>> {
    let is_plain = |step: &StepId| {
        part.steps[*step].kind == StepKind::Leaf && part.steps[*step].parent.is_none()
    };
    if !part.forcings.is_empty() || !here.iter().all(is_plain) {
        return None;
    }
    // The steps that a transition enters decide its place in the order of ages.
    let by_age = part.settings.policy == Policy::PriorityAge;
    let mut crossings = Vec::new();
    for (id, transition) in part.transitions.iter() {
        if transition.kind != TransitionKind::Move {
            continue;
        }
        let image = images.get(&id);
        let from_elsewhere =
            image.is_some_and(|it| it.requires.iter().any(|step| component.steps.contains(step)));
        let left = transition.requires.iter().filter(|step| here.contains(step)).count();
        let entered = following(transition).filter(|step| here.contains(step)).count();
        match (left, entered) {
            (0, 0) | (1, 1) => {}
            (0, 1) if from_elsewhere => crossings.push((id, true)),
            (1, 0) if image.is_some() || !by_age => crossings.push((id, false)),
            _ => return None,
        }
    }
    Some(crossings)
}
