//! Random sessions of the stepper on random nets, with undo: the recording replays to the same trace, and the predicted transitions are those that fire.

use grafsynth_ir::net::{Policy, StepId, TransitionId};
use grafsynth_ir::random::Random;
use grafsynth_sim::{Simulator, Stepper, WaitState, run};
use grafsynth_tests::random_net::{Features, random_net};

const NETS: u64 = 120;
const ACTIONS: usize = 120;

#[test]
fn a_recording_replays_to_the_trace_of_its_session() {
    for seed in 0..NETS {
        let net = random_net(seed, &Features::everything());
        let mut stepper = Stepper::new(Simulator::new(&net));
        let mut random = Random::new(seed);
        for _ in 0..ACTIONS {
            act(&mut stepper, &mut random);
        }
        let replayed = run(&net, &stepper.stimulus());
        assert_eq!(stepper.trace().to_csv(), replayed.to_csv(), "seed {seed}");
        assert_eq!(stepper.trace(), replayed, "seed {seed}");
    }
}

fn act(stepper: &mut Stepper<'_>, random: &mut Random) {
    let inputs: Vec<_> = stepper.simulator().net().inputs.ids().collect();
    match random.below(6) {
        0 => {
            stepper.undo();
        }
        1 => {
            let dt = stepper.to_threshold().unwrap_or(1);
            check_reaction(stepper, dt);
        }
        2 | 3 => {
            let dt = random.pick(&[0, 1, 2, 3]).copied().unwrap_or(1);
            check_reaction(stepper, dt);
        }
        _ => {
            if let Some(input) = random.pick(&inputs) {
                let value = random.between(-2, 9);
                stepper.set(*input, value);
            }
        }
    }
}

/// Runs a reaction and checks that the transitions of its first micro-step were predicted. With the policy `all`, every predicted transition must fire.
fn check_reaction(stepper: &mut Stepper<'_>, dt: u32) {
    let waits = stepper.waits(dt);
    let before: Vec<StepId> = stepper.simulator().state().situation().iter().collect();
    let of = |state| waits.iter().filter(move |one| one.state == state).map(|one| one.transition);
    let said: Vec<TransitionId> = of(WaitState::Fires).collect();
    stepper.react(dt);
    let net = stepper.simulator().net();
    let frames = stepper.frames();
    assert_eq!(frames.len(), stepper.simulator().micro_steps() as usize);
    assert!(frames.first().is_none_or(|frame| frame.before == before));
    let mut first = frames.first().map(|frame| frame.fired.clone()).unwrap_or_default();
    first.sort_unstable();
    assert_eq!(first, said);
    // Nothing that fires waits for anything. What is fireable and does not fire has lost against another transition, or a forcing order prevents it.
    if !net.settings.policy.is_statechart() {
        let waiting = waits.iter().filter(|one| !one.reasons.is_empty());
        assert!(waiting.clone().all(|one| !first.contains(&one.transition)));
        let is_free = net.settings.policy == Policy::All && !net.settings.fire_one;
        if is_free && net.forcings.is_empty() && !stepper.simulator().row().open.any() {
            assert_eq!(of(WaitState::Fireable).count(), 0);
        }
    }
}
