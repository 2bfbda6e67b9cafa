//! Checks a run against the facts of its net. The check does not use the code that finds facts: it inspects the simulator after each
//! reaction.
//!
//! ```text
//! assert_eq!(refuted(&net, &facts, &stimulus), None);    // the run contradicts no fact
//! ```

use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, StepId};
use grafsynth_sim::{Simulator, Stimulus};
use itertools::Itertools as _;
use std::collections::BTreeSet;

/// The first fact that a run contradicts, with its row; row 0 is reset.
#[must_use]
pub fn refuted(net: &Valid<Net>, facts: &Facts, stimulus: &Stimulus) -> Option<String> {
    let listed = facts.reach.as_ref().and_then(|reach| reach.sets.as_ref());
    let listed: Option<BTreeSet<&[u64]>> =
        listed.map(|sets| sets.iter().map(Vec::as_slice).collect());
    let mut simulator = Simulator::new(net);
    let mut rows = stimulus.rows();
    let mut row = 0;
    loop {
        let situation = simulator.state().situation();
        if listed.as_ref().is_some_and(|listed| !listed.contains(situation.words())) {
            let steps: Vec<StepId> = situation.iter().collect();
            return Some(format!("row {row}: {} counts as unreachable", names(net, &steps)));
        }
        if let Some(why) = contradicted(net, facts, &simulator) {
            return Some(format!("row {row}: {why}"));
        }
        simulator.step(&rows.next()?);
        row += 1;
    }
}

fn names(net: &Net, steps: &[StepId]) -> String {
    steps.iter().map(|step| net.steps[*step].name.text.as_str()).join(", ")
}

/// Compares the situation and the last reaction of a simulator with the facts.
fn contradicted(net: &Net, facts: &Facts, simulator: &Simulator<'_>) -> Option<String> {
    let active = |steps: &[StepId]| -> Vec<StepId> {
        steps.iter().copied().filter(|step| simulator.is_active(*step)).collect()
    };
    for component in &facts.components {
        let active = active(&component.steps);
        if active.len() > 1 || component.always && active.is_empty() {
            let steps = names(net, &component.steps);
            return Some(format!("of the component {steps} are active: {:?}", names(net, &active)));
        }
    }
    for invariant in &facts.invariants {
        let n_active = active(&invariant.steps).len();
        if n_active != invariant.count as usize {
            let (steps, count) = (names(net, &invariant.steps), invariant.count);
            return Some(format!("{n_active} of {steps} are active, not {count}"));
        }
    }
    if let Some(step) = active(&facts.unreachable_steps).first() {
        return Some(format!("{} is active, and counts as unreachable", names(net, &[*step])));
    }
    let fired = |transition| simulator.fired().contains(transition);
    if let Some(transition) = facts.dead_transitions.iter().find(|transition| fired(transition)) {
        return Some(format!("{} fires, and counts as dead", net.transitions[*transition].name));
    }
    let took = [
        ("micro-steps", facts.stable_depth.as_ref(), simulator.micro_steps()),
        ("checks", facts.rounds.as_ref(), simulator.rounds()),
    ];
    for (what, most, took) in took {
        if let Some(most) = most
            && took > most.value
        {
            return Some(format!(
                "a reaction took {took} {what}, but the proved maximum is {}",
                most.value
            ));
        }
    }
    (facts.always_stable.is_some() && simulator.row().fault)
        .then(|| "a reaction ends with a fault, and every one counts as stable".to_owned())
}
