//! A person drives a chart: what the transitions wait for, the timers that run, and reactions that are undone.

use super::net;
use crate::{Counter, Reason, Simulator, Stepper, WaitState};
use grafsynth_ir::Valid;
use grafsynth_ir::net::{InputId, Net};

fn a() -> InputId {
    InputId::from_index(0)
}

fn b() -> InputId {
    InputId::from_index(1)
}

fn drill() -> Valid<Net> {
    net(
        "",
        "input a bool
         input b bool
         step p1 in g initial
         step p2 in g
         step p3 in g
         step p4 in g initial
         transition t1 in g p1 -> p2 when a
         transition t2 in g p2 -> p3 when p2.t >= 30 and b
         transition t3 in g p3, p4 -> p1, p4 when not b",
    )
}

/// For each transition, its name and what it waits for, as text.
fn waits(stepper: &Stepper<'_>, dt: u32) -> Vec<String> {
    let net = stepper.simulator().net();
    let said = |reason: &Reason| match reason {
        Reason::Step(step) => format!("step {}", net.steps[*step].name),
        Reason::Event(events) => format!("event {}", net.inputs[events[0]].name),
        Reason::Time { step, limit, left } => {
            format!("{limit} in {} ({left} left)", net.steps[*step].name)
        }
        Reason::Condition(expr) => grafsynth_ir::text::print_condition(net, expr),
    };
    let all = stepper.waits(dt).into_iter();
    all.map(|one| {
        let sign = match one.state {
            WaitState::Near => "-",
            WaitState::Enabled => "?",
            WaitState::Fireable => "=",
            WaitState::Fires => "!",
        };
        let reasons: Vec<String> = one.reasons.iter().map(said).collect();
        format!("{sign} {}: {}", net.transitions[one.transition].name, reasons.join(", "))
    })
    .collect()
}

#[test]
fn a_transition_waits_for_what_is_false_in_the_next_reaction() {
    let net = drill();
    let mut stepper = Stepper::new(Simulator::new(&net));
    assert_eq!(waits(&stepper, 1), ["? t1: a", "- t3: step p3"]);
    stepper.set(a(), 1);
    assert_eq!(waits(&stepper, 1), ["! t1: ", "- t3: step p3"]);
    stepper.react(1);
    assert_eq!(waits(&stepper, 1), ["? t2: 30 in p2 (30 left), b", "- t3: step p3"]);
    stepper.react(12);
    stepper.set(b(), 1);
    assert_eq!(waits(&stepper, 17), ["? t2: 30 in p2 (18 left)", "- t3: step p3, not b"]);
    assert_eq!(waits(&stepper, 18), ["! t2: ", "- t3: step p3, not b"]);
    assert_eq!(stepper.to_threshold(), Some(18));
    stepper.react(18);
    assert_eq!(waits(&stepper, 1), ["? t3: not b"]);
    assert_eq!(stepper.to_threshold(), None);
}

#[test]
fn a_running_counter_has_its_value_and_its_thresholds() {
    let net = net(
        "",
        "input a bool
         step p1 in g initial
         step p2 in g
         transition t1 in g p1 -> p2 when p1.t > 5 or p1.t = 20",
    );
    let mut stepper = Stepper::new(Simulator::new(&net));
    stepper.react(2);
    let running = stepper.turns().running(stepper.simulator());
    assert_eq!(running.len(), 1);
    assert_eq!(running[0].counter, Counter::Elapsed(net.steps.ids().next().unwrap()));
    assert_eq!((running[0].ticks, running[0].left.as_slice()), (2, &[4, 18, 19][..]));
    // One tick less does not fire: `>` needs one more than the constant.
    stepper.react(3);
    assert!(stepper.simulator().fired().is_empty());
    assert_eq!(stepper.to_threshold(), Some(1));
    stepper.react(1);
    assert_eq!(stepper.simulator().fired().len(), 1);
}

#[test]
fn an_undone_reaction_leaves_its_inputs_and_nothing_else() {
    let net = drill();
    let mut stepper = Stepper::new(Simulator::new(&net));
    assert!(!stepper.undo());
    let start = stepper.clone();
    stepper.set(a(), 1);
    stepper.react(7);
    assert_eq!((stepper.ticks(), stepper.len()), (7, 1));
    assert!(stepper.undo());
    assert_eq!(stepper.input(a()), 1);
    assert_eq!(stepper.trace(), start.trace());
    assert_eq!(stepper.simulator().state(), start.simulator().state());
    assert_eq!((stepper.ticks(), stepper.is_empty()), (0, true));
    // Also across the places where states are saved; what fired in the last reaction is known again.
    let mut firings = Vec::new();
    for _ in 0..200 {
        stepper.react(1);
        firings.push((stepper.simulator().fired().to_vec(), stepper.frames(), stepper.trace()));
    }
    while let Some((fired, frames, trace)) = firings.pop() {
        assert_eq!((stepper.simulator().fired(), stepper.frames()), (fired.as_slice(), frames));
        assert_eq!(stepper.trace(), trace);
        stepper.undo();
    }
}

#[test]
fn a_session_starts_again_from_where_it_began() {
    let net = drill();
    let mut stepper = Stepper::new(Simulator::new(&net));
    stepper.restart();
    let start = stepper.trace();
    stepper.set(a(), 1);
    (0..100).for_each(|_| stepper.react(1));
    stepper.restart();
    assert_eq!((stepper.trace(), stepper.ticks(), stepper.input(a())), (start, 0, 1));
    stepper.react(1);
    assert_eq!(stepper.trace(), crate::run(&net, &stepper.stimulus()));
}

#[test]
fn events_occur_once_and_one_at_a_time_if_the_chart_says_so() {
    let net = net(
        "policy inner-first\nevolution stable limit 9\nqueue 4\nevents exclusive",
        "part g level 1
             enter (p1)
         input e bool event
         input f bool event
         step p1 in g
         step p2 in g
         transition t1 in g p1 -> p2 clears (p1, p2) restart on (e)",
    );
    let mut stepper = Stepper::new(Simulator::new(&net));
    assert_eq!(waits(&stepper, 1), ["? t1: event e"]);
    stepper.set(a(), 1);
    assert_eq!(waits(&stepper, 1), ["! t1: "]);
    stepper.set(b(), 1);
    assert_eq!((stepper.input(a()), stepper.input(b())), (0, 1));
    stepper.set(a(), 5);
    stepper.react(1);
    assert_eq!((stepper.input(a()), stepper.simulator().fired().len()), (0, 1));
}

#[test]
fn a_violated_assumption_leaves_the_rest_open_until_it_is_undone() {
    let net = net("", "input a bool\ninput b bool\nstep p1 in g initial\nassume never (a and b)");
    let mut stepper = Stepper::new(Simulator::new(&net));
    stepper.react(1);
    stepper.set(a(), 1);
    stepper.set(b(), 1);
    stepper.react(1);
    stepper.set(b(), 0);
    stepper.react(1);
    assert_eq!(stepper.broken(), Some(2));
    assert_eq!(stepper.trace(), crate::run(&net, &stepper.stimulus()));
    stepper.undo();
    assert_eq!(stepper.broken(), Some(2));
    stepper.undo();
    assert_eq!(stepper.broken(), None);
    stepper.set(b(), 0);
    stepper.react(1);
    assert_eq!(stepper.trace(), crate::run(&net, &stepper.stimulus()));
}
