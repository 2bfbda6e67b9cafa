//! Tests of directed runs: which transitions they reach, and whether their reactions can be replayed.

use super::net;
use crate::{Ahead, Directed, MAX_DT, MICRO_STEPS, Simulator, Start, State, Stimulus, run};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;

/// Executes reactions until all transitions have fired; returns their number, or the names of transitions that have not fired.
fn reactions_for_all(net: &Valid<Net>, most: u64, max_dt: u32) -> Result<u64, Vec<String>> {
    let mut directed = Directed::new(net, 1, max_dt);
    while directed.coverage().reactions < most {
        assert!(directed.next().is_some());
        if directed.coverage().never.is_empty() {
            return Ok(directed.coverage().reactions);
        }
    }
    let never = directed.coverage().never;
    Err(never.into_iter().map(|id| net.transitions[id].name.text.clone()).collect())
}

/// A net with numbers that random inputs do not hit, a sum that needs many reactions, and a remainder.
const SAFE: &str = "
input E bool event
input k int 0..65535
var acc int 0..65535 = 0
var w int 0..1000000 = 0
step s1 in g
step s2 in g
step s3 in g
step s4 in g
transition t1 in g s1 -> s2 clears (s1, s2, s3, s4) restart on (E) when k = 43981
transition t2 in g s2 -> s3 clears (s1, s2, s3, s4) restart on (E) when k * 7 mod 65521 = 12345
transition t3 in g s3 -> s4 clears (s1, s2, s3, s4) restart on (E) when (k + acc) mod 4099 = 1234 and w > 300000
transition r1 in g reaction s1 -> on (E)
    do { acc := (acc * 31 + k) mod 65521; w := w + k }
transition r3 in g reaction s3 -> on (E)
    do { acc := (acc * 31 + k) mod 65521; w := w + k }
";

#[test]
fn numbers_that_chance_does_not_meet_are_found() {
    let settings = "policy inner-first\nevolution stable limit 9\npart g level 1\n    enter (s1)";
    let net = net(settings, SAFE);
    assert!(reactions_for_all(&net, 3_000, 1).is_ok_and(|reactions| reactions > 5));
}

#[test]
fn runs_start_again_from_what_absorbs_them() {
    // Random inputs end in `sink` within a few rows; ten rows with the right one of eight inputs lead to `last`.
    let mut body = String::new();
    for at in 0..8 {
        body += &format!("input i{at} bool\n");
    }
    for at in 0..10 {
        body += &format!("step s{at} in g{}\n", if at == 0 { " initial" } else { "" });
    }
    body += "step last in g\nstep sink in g\n";
    let others = |right: usize| {
        let all = (0..8).filter(|it| *it != right).map(|it| format!("i{it}"));
        all.collect::<Vec<_>>().join(" or ")
    };
    for at in 0..10 {
        let (to, right) =
            if at == 9 { ("last".to_owned(), 9 % 8) } else { (format!("s{}", at + 1), at % 8) };
        let wrong = others(right);
        body += &format!("transition lost{at} in g s{at} -> sink when {wrong}\n");
        body += &format!("transition on{at} in g s{at} -> {to} when i{right} and not ({wrong})\n");
    }
    let net = net("policy priority", &body);
    assert!(reactions_for_all(&net, 2_000, 1).is_ok());
    let one_run = run(&net, &Stimulus::random(&net, 2_000, 1, 1)).to_csv();
    assert!(!one_run.contains("last"), "a run without restarts should not get there");
}

#[test]
fn ticks_stand_at_thresholds() {
    // Exactly five ticks, seen only with dt 5 at once or with single ticks: the window is left at six.
    let body = "
input a bool
step s in g initial
step w in g
step hit in g
transition t1 in g s -> w when s.t >= 3000
transition t2 in g w -> hit when w.t >= 777 and w.t < 778 and a
transition t3 in g hit -> s when hit.t = 70000
";
    let net = net("policy priority", body);
    assert!(reactions_for_all(&net, 2_000, MAX_DT).is_ok());
}

#[test]
fn a_follower_sees_the_same_and_a_path_leads_there_from_reset() {
    let settings = "policy inner-first\nevolution stable limit 9\npart g level 1\n    enter (s1)";
    let net = net(settings, SAFE);
    let mut directed = Directed::new(&net, 7, 3);
    let mut follower = Simulator::new(&net);
    let mut kept: Vec<State> = Vec::new();
    let mut starts = [0; 3];
    for number in 0..600 {
        let step = directed.next().expect("this chart assumes nothing");
        match step.from {
            Start::Here => starts[0] += 1,
            Start::Reset => {
                starts[1] += 1;
                follower.reset();
            }
            Start::Saved(at) => {
                starts[2] += 1;
                follower.set_state(&kept[at]);
            }
        }
        assert_eq!(follower.react(&step.row), *directed.row());
        if let Some(at) = step.save {
            assert!(at <= kept.len(), "numbers count up");
            match kept.get_mut(at) {
                Some(place) => *place = follower.state().clone(),
                None => kept.push(follower.state().clone()),
            }
        }
        if number % 97 == 0 {
            let path = directed.path();
            let mut again = Simulator::new(&net);
            path.iter().for_each(|row| {
                again.step(row);
            });
            assert_eq!(again.state(), follower.state());
        }
    }
    assert!(starts.iter().all(|count| *count > 5), "{starts:?}");
}

#[test]
fn what_can_never_hold_ends() {
    // A net without transitions, and one whose assumptions no input satisfies.
    let empty = net("", "step s in g initial");
    assert!(Directed::new(&empty, 1, 1).next().is_some());
    let none = net("", "input a bool\nstep s in g initial\nassume never a or not a");
    assert!(Directed::new(&none, 1, 1).next().is_none());
}

#[test]
fn reactions_made_ahead_are_those_of_a_directed_run() {
    let settings = "policy inner-first\nevolution stable limit 9\npart g level 1\n    enter (s1)";
    let net = net(settings, SAFE);
    let mut directed = Directed::new(&net, 3, MAX_DT);
    let mut ahead = Ahead::new(&net, 3, MAX_DT, 700);
    let mut seen = 0;
    loop {
        let (numbers, rows) = ahead.batch(300);
        if numbers.is_empty() {
            break;
        }
        for (number, row) in numbers.zip(rows) {
            assert!(directed.next().is_some());
            assert_eq!((number, &row), (seen, directed.row()));
            assert_eq!(ahead.path(number), directed.path());
            seen += 1;
        }
    }
    assert_eq!((seen, ahead.coverage().is_cut_short), (700, false));
}

#[test]
fn long_reactions_make_fewer() {
    let net = net(
        "evolution stable limit 1000",
        "step a in g initial\nstep b in g\ntransition t1 in g a -> b\ntransition t2 in g b -> a",
    );
    let mut ahead = Ahead::new(&net, 1, 1, 10_000);
    while !ahead.batch(512).0.is_empty() {}
    let coverage = ahead.coverage();
    assert!(coverage.is_cut_short);
    assert_eq!(coverage.reactions, MICRO_STEPS / 1000);
}
