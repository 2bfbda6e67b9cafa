//! Circuits of statecharts, composed into one clock or with `busy`: proved by induction, and never if they differ from their net.

use std::collections::BTreeMap;

use grafsynth_frontend::graf;
use grafsynth_ir::logic::{Logic, Node};
use grafsynth_ir::lower::lower;
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::{Net, Policy};
use grafsynth_ir::{FileId, Valid};
use grafsynth_logic::{BusyMode, EncodeOptions, encode};
use grafsynth_sim::Random;
use grafsynth_verify::equiv::{by_chance, by_induction};
use grafsynth_verify::{Limits, Outcome, Verdict, facts, properties, structural_facts};

use crate::oracle::rounds;
use crate::random_net::{Features, random_net};

/// A lift: many events in one row, times, and queues that may overflow.
const LIFT: &str = "chart lift {
    tick 100 ms
    conflict inner-first
    queue 3
    event call0, call1, cab0, cab1, at0, at1, door_open, obstacle
    output up, down, door, lamp0, lamp1, alarm
    assert never ((up or down) and door)
    assert never (up and down)
    parallel lift {
        region drive {
            initial state f0 {
                initial state shut0
                state open0 { door }
                shut0 -> open0 on call0
                shut0 -> open0 on cab0
                open0 -> shut0 after 1 s
                in open0 on obstacle
            }
            state f1 {
                initial state shut1
                state open1 { door }
                shut1 -> open1 on call1
                shut1 -> open1 on cab1
                open1 -> shut1 after 1 s
                in open1 on obstacle
            }
            state going_up { up }
            state going_down { down }
            state stuck { alarm }
            f0 -> going_up on cab1 when not open0.active
            f1 -> going_down on cab0 when not open1.active
            going_up -> f1 on at1 when r1on.active
            going_down -> f0 on at0 when r0on.active
            going_up -> stuck after 3 s
            going_down -> stuck after 3 s
            stuck -> f0 on at0
        }
        region req0 {
            initial state r0off
            state r0on { lamp0 }
            r0off -> r0on on call0
            r0off -> r0on on cab0
            r0on -> r0off on door_open when f0.active
        }
        region req1 {
            initial state r1off
            state r1on { lamp1 }
            r1off -> r1on on call1
            r1off -> r1on on cab1
            r1on -> r1off on door_open when f1.active
        }
    }
}
";

fn chart(text: &str) -> Valid<Net> {
    let design = graf::parse(FileId(0), text).design.expect("a design");
    lower(&design).0.expect("a valid net")
}

fn encoded(net: &Valid<Net>, busy: BusyMode) -> Option<Logic> {
    let program = program(net, &ProgramOptions::default()).ok()?;
    let options =
        EncodeOptions { busy, max_nodes: 12_000, max_composed: 12_000, ..EncodeOptions::default() };
    encode(net, &program, &structural_facts(net), &options).ok()
}

#[test]
fn the_lift_is_proved() {
    let net = chart(LIFT);
    let logic = encoded(&net, BusyMode::Always).expect("a circuit");
    let verdict = by_induction(&net, &structural_facts(&net), &logic, &Limits::default());
    assert!(matches!(verdict, Verdict::Proved(_)), "{verdict:?}");
    // Flip-flops with a different value after power-up: never proved if a row shows it.
    let mut n_wrong = 0;
    for flop in logic.flops.ids().step_by(8) {
        let mut wrong = logic.clone();
        wrong.flops[flop].init = !wrong.flops[flop].init;
        if by_chance(&net, &wrong, 20).is_some() {
            n_wrong += 1;
            let verdict = by_induction(&net, &structural_facts(&net), &wrong, &Limits::default());
            let name = &logic.flops[flop].name;
            assert!(!matches!(verdict, Verdict::Proved(_)), "flip-flop `{name}` is wrong");
        }
    }
    assert!(n_wrong > 1, "{n_wrong} wrong flip-flops");
    let limits = Limits { pairs: 1000, random_rows: 100, ..Limits::default() };
    for verdict in properties(&net, &limits) {
        assert!(matches!(verdict.outcome, Outcome::Proved { .. }), "{verdict:?}");
    }
}

fn kinds() -> [Features; 2] {
    let policies = vec![Policy::InnerFirst, Policy::OuterFirst];
    [
        Features { max_steps: 6, ..Features::entering() },
        Features { policies, max_steps: 6, single: false, stable: true, ..Features::chip() },
    ]
}

/// One node with a different function.
fn mutant(logic: &Logic, random: &mut Random) -> Logic {
    let mut wrong = logic.clone();
    let nodes: Vec<_> = logic.nodes.ids().collect();
    for _ in 0..100 {
        let at = nodes[random.below(nodes.len())];
        let new = match &logic.nodes[at] {
            Node::And(all) if all.len() > 1 => {
                if random.one_in(2) {
                    Node::Or(all.clone())
                } else {
                    Node::And(all[1..].to_vec())
                }
            }
            Node::Or(all) if all.len() > 1 => {
                if random.one_in(2) {
                    Node::And(all.clone())
                } else {
                    Node::Or(all[1..].to_vec())
                }
            }
            Node::Not(inner) => Node::And(vec![*inner]),
            Node::Mux(c, a, b) => Node::Mux(*c, *b, *a),
            _ => continue,
        };
        wrong.nodes[at] = new;
        break;
    }
    wrong
}

#[test]
fn circuits_are_proved_and_wrong_ones_are_not() {
    let n: u64 = std::option_env!("VERIFY_NETS").and_then(|n| n.parse().ok()).unwrap_or(4);
    // A few large circuits would take nearly all of the time, so they are left out.
    let largest = rounds(1_000, 12_000) as usize;
    let mut open: BTreeMap<String, u32> = BTreeMap::new();
    let (mut n_proved, mut n_mutants, mut n_wrong) = (0, 0, 0);
    for seed in 0..n {
        for features in &kinds() {
            let net = random_net(seed, features);
            for busy in [BusyMode::Never, BusyMode::Always] {
                let small = |logic: &Logic| logic.nodes.len() <= largest;
                let Some(logic) = encoded(&net, busy).filter(small) else { continue };
                let known = structural_facts(&net);
                match by_induction(&net, &known, &logic, &Limits::default()) {
                    Verdict::Proved(_) => n_proved += 1,
                    Verdict::Open(why) => {
                        *open.entry(format!("{seed} {busy:?}: {why}")).or_default() += 1;
                        continue;
                    }
                    Verdict::Refuted(it) => panic!("{it:?}"),
                }
                assert!(by_chance(&net, &logic, 500).is_none(), "seed {seed}: wrongly proved");
                let mut random = Random::new(seed);
                for _ in 0..3 {
                    let wrong = mutant(&logic, &mut random);
                    n_mutants += 1;
                    let differs = by_chance(&net, &wrong, 500).is_some();
                    n_wrong += u32::from(differs);
                    let verdict = by_induction(&net, &known, &wrong, &Limits::default());
                    if let Verdict::Proved(_) = verdict {
                        assert!(!differs, "seed {seed}: a mutant that differs is proved");
                        assert!(by_chance(&net, &wrong, 5_000).is_none(), "seed {seed}: mutant");
                    }
                }
            }
        }
    }
    println!("{n_proved} proved; {n_mutants} mutants, {n_wrong} of them differ; open: {open:#?}");
    assert!(n_proved > 2 && n_wrong > 0, "{n_proved} proved, {n_wrong} mutants differ");
}

#[test]
fn the_diagram_of_a_statechart_says_what_the_enumeration_says() {
    let n: u64 = std::option_env!("VERIFY_NETS").and_then(|n| n.parse().ok()).unwrap_or(4);
    let (mut n_same, mut n_open) = (0, 0);
    for seed in 0..n {
        for features in &kinds() {
            let net = random_net(seed, features);
            let limits = Limits { pairs: 20_000, rows_per_state: 1024, ..Limits::default() };
            let explicit = facts(&net, &Limits { image_work: 0, ..limits.clone() });
            let Some(situations) = explicit.reach.as_ref().map(|reach| reach.situations) else {
                continue;
            };
            let symbolic = facts(&net, &Limits { pairs: 0, image_work: 1_000_000, ..limits });
            let Some(reach) = &symbolic.reach else {
                println!("{seed}: {:?}", symbolic.open);
                n_open += 1;
                continue;
            };
            if reach.exact {
                assert_eq!(reach.situations, situations, "seed {seed}");
                assert_eq!(symbolic.dead_transitions, explicit.dead_transitions, "seed {seed}");
            }
            n_same += 1;
        }
    }
    println!("{n_same} equal, {n_open} open");
    assert!(n_same > n_open, "{n_same} equal, {n_open} open");
}
