//! The two equivalence proofs against each other, on random nets and on circuits with injected errors.

use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Logic, Node};
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::Net;
use grafsynth_logic::build::Builder;
use grafsynth_logic::minimise::{Budget, sum_of_products};
use grafsynth_logic::node_bdds::Var;
use grafsynth_logic::{EncodeOptions, encode};
use grafsynth_sim::{Simulator, Stimulus, breaks_assumption};
use grafsynth_verify::equiv::{by_enumeration, by_induction};
use grafsynth_verify::{Limits, Verdict, structural_facts};

use crate::random_net::{Features, random_net};

fn limits() -> Limits {
    Limits {
        pairs: 3_000,
        rows_per_state: 256,
        states: 1_000,
        conflicts: 1_000,
        ..Limits::default()
    }
}

fn encoded(net: &Valid<Net>) -> Option<Logic> {
    let program = program(net, &ProgramOptions::default()).ok()?;
    encode(net, &program, &Facts::default(), &EncodeOptions::default()).ok()
}

#[test]
fn both_proofs_agree_on_random_nets() {
    let features = Features::chip().without_statecharts();
    let (mut n_both, mut n_induction, mut n_enumeration) = (0, 0, 0);
    let mut open: std::collections::BTreeMap<String, Vec<u64>> = std::collections::BTreeMap::new();
    let n_nets: u64 = std::option_env!("VERIFY_NETS").and_then(|n| n.parse().ok()).unwrap_or(30);
    for seed in 0..n_nets {
        let net = random_net(seed, &features);
        let Some(logic) = encoded(&net) else { continue };
        let facts = structural_facts(&net);
        let induction = by_induction(&net, &facts, &logic, &limits());
        let enumeration = by_enumeration(&net, &logic, &limits());
        match &enumeration {
            Verdict::Refuted(counterexample) => {
                assert!(
                    !matches!(induction, Verdict::Proved(_)),
                    "seed {seed}: {:?}",
                    counterexample.difference
                );
                println!("seed {seed}: the circuit is wrong: {:?}", counterexample.difference);
            }
            Verdict::Proved(_) => {
                n_enumeration += 1;
                n_both += u32::from(matches!(induction, Verdict::Proved(_)));
            }
            Verdict::Open(_) => {}
        }
        match induction {
            Verdict::Proved(_) => n_induction += 1,
            Verdict::Open(why) => open.entry(why.to_string()).or_default().push(seed),
            Verdict::Refuted(_) => panic!("the induction does not refute"),
        }
    }
    for (why, seeds) in &open {
        println!("{} x {why}: {:?}", seeds.len(), &seeds[..seeds.len().min(6)]);
    }
    println!("induction {n_induction}, enumeration {n_enumeration}, both {n_both}");
    assert!(n_induction > 20 && n_both > 6, "{n_induction} {n_both}");
}

/// The circuit as two-level equations would return it: each function is a minimised sum of products.
fn two_level(logic: &Logic) -> Option<Logic> {
    let mut builder = Builder::resume(logic.clone());
    let mut sum = |node| {
        let products = sum_of_products(logic, node, false, true, Budget::default()).ok()?;
        let terms: Vec<_> = products
            .into_iter()
            .map(|product| {
                let literals: Vec<_> = product
                    .into_iter()
                    .map(|(var, value)| {
                        let lit = match var {
                            Var::Flop(flop) => builder.flop(flop),
                            Var::Input(input) => builder.input(input),
                        };
                        if value { lit } else { builder.not(lit) }
                    })
                    .collect();
                builder.and(literals)
            })
            .collect();
        Some(builder.or(terms))
    };
    let flops: Vec<_> = logic.flops.values().map(|flop| sum(flop.next)).collect::<Option<_>>()?;
    let outputs: Vec<_> =
        logic.outputs.values().map(|output| sum(output.value)).collect::<Option<_>>()?;
    let mut logic = builder.logic;
    for ((_, flop), next) in logic.flops.iter_mut().zip(flops) {
        flop.next = next;
    }
    for ((_, output), value) in logic.outputs.iter_mut().zip(outputs) {
        output.value = value;
    }
    Some(logic)
}

#[test]
fn minimised_equations_are_proved_too() {
    let features = Features::chip().without_statecharts();
    let (mut n_proved, mut n_made) = (0, 0);
    for seed in 0..16 {
        let net = random_net(seed, &features);
        let Some(logic) = encoded(&net).filter(|logic| logic.nodes.len() < 2_000) else { continue };
        let Some(minimised) = two_level(&logic) else { continue };
        let facts = structural_facts(&net);
        if !matches!(by_induction(&net, &facts, &logic, &limits()), Verdict::Proved(_)) {
            continue;
        }
        n_made += 1;
        match by_induction(&net, &facts, &minimised, &limits()) {
            Verdict::Proved(_) => n_proved += 1,
            Verdict::Open(why) => println!("seed {seed}: {why}"),
            Verdict::Refuted(_) => panic!("the induction does not refute"),
        }
    }
    println!("{n_proved} of {n_made}");
    assert!(n_proved * 10 >= n_made * 8 && n_made > 5, "{n_proved} of {n_made}");
}

#[test]
fn a_spoiled_circuit_is_never_proved() {
    let features = Features::chip().without_statecharts();
    let (mut n_refuted, mut n_harmless) = (0, 0);
    for seed in 0..16 {
        let net = random_net(seed, &features);
        let Some(logic) = encoded(&net) else { continue };
        let facts = structural_facts(&net);
        let nots: Vec<_> = logic
            .nodes
            .iter()
            .filter_map(
                |(id, node)| if let Node::Not(inner) = node { Some((id, *inner)) } else { None },
            )
            .collect();
        for (id, inner) in nots.into_iter().step_by(7).take(3) {
            let mut wrong = logic.clone();
            wrong.nodes[id] = Node::And(vec![inner]);
            match by_enumeration(&net, &wrong, &limits()) {
                Verdict::Refuted(counterexample) => {
                    n_refuted += 1;
                    let induction = by_induction(&net, &facts, &wrong, &limits());
                    assert!(
                        !matches!(induction, Verdict::Proved(_)),
                        "seed {seed}: {:?}",
                        counterexample.difference
                    );
                }
                Verdict::Proved(_) => n_harmless += 1,
                Verdict::Open(_) => {}
            }
        }
    }
    println!("refuted {n_refuted}, harmless {n_harmless}");
    assert!(n_refuted > 4, "{n_refuted}");
}

#[test]
fn charts_that_run_until_stable_are_proved() {
    let mut features = Features::chip().without_statecharts();
    (features.single, features.stable) = (false, true);
    let (mut n_proved, mut n_refuted) = (0, 0);
    for seed in 0..9 {
        let net = random_net(seed, &features);
        let Some(logic) = encoded(&net).filter(|logic| logic.nodes.len() < 3_000) else { continue };
        let facts = structural_facts(&net);
        let enumeration = by_enumeration(&net, &logic, &limits());
        match by_induction(&net, &facts, &logic, &limits()) {
            Verdict::Proved(_) => n_proved += 1,
            Verdict::Open(why) => println!("seed {seed}: {why}"),
            Verdict::Refuted(_) => panic!("the induction does not refute"),
        }
        if let Verdict::Refuted(counterexample) = enumeration {
            println!("seed {seed}: the circuit is wrong: {:?}", counterexample.difference);
            n_refuted += 1;
        }
    }
    println!("proved {n_proved}, refuted {n_refuted}");
    assert!(n_proved > 2, "{n_proved}");
}

#[test]
fn what_the_structure_says_is_never_seen_broken() {
    let mut n_components = 0;
    for seed in 0..400 {
        let net = random_net(seed, &Features::everything());
        let facts = structural_facts(&net);
        n_components += facts.components.len();
        let mut simulator = Simulator::new(&net);
        let check = |simulator: &Simulator<'_>, row: usize| {
            for component in &facts.components {
                let n = component.steps.iter().filter(|step| simulator.is_active(**step)).count();
                assert!(
                    n <= 1 && (n == 1 || !component.always),
                    "seed {seed}, row {row}: {n} of {component:?}"
                );
            }
            for step in &facts.unreachable_steps {
                assert!(!simulator.is_active(*step), "seed {seed}, row {row}: {step:?}");
            }
            for transition in simulator.fired() {
                assert!(
                    !facts.dead_transitions.contains(transition),
                    "seed {seed}, row {row}: {transition:?}"
                );
            }
        };
        check(&simulator, 0);
        for (number, input) in Stimulus::random(&net, 60, seed, 3).rows().enumerate() {
            simulator.step(&input);
            if breaks_assumption(&net, &input) {
                break;
            }
            check(&simulator, number + 1);
        }
    }
    assert!(n_components > 200, "{n_components}");
}
