//! Undefined entries of a chart are don't-cares for a chip, and defined ones are proved, in every state encoding and by both methods.

#![allow(clippy::print_stdout, reason = "tests report what they have run")]

use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::{Dialect, EmitOptions};
use grafsynth_driver::coding::{self, EncodedLogic, EncodingChoice};
use grafsynth_driver::pipeline;
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Logic, Node};
use grafsynth_ir::net::Net;
use grafsynth_logic::state_assignment::{Encoding, observe};
use grafsynth_sim::Random;
use grafsynth_tests::random_table::random_table;
use grafsynth_tests::{chart, rounds};
use grafsynth_verify::equiv::{Verdict, by_enumeration, by_induction};
use grafsynth_verify::{Limits, structural_facts};

const ENCODINGS: [Encoding; 3] = [Encoding::OneHot, Encoding::ZeroHot, Encoding::Compact];

/// The circuit of a table with this encoding, and the circuit that is read back from its equations.
fn through(
    net: &Valid<Net>,
    facts: &Facts,
    encoding: Encoding,
    safe: bool,
) -> (EncodedLogic, Logic, EmitOptions) {
    let logic = pipeline::logic(net, facts).expect("a circuit");
    let options = EmitOptions { dont_cares: true, ..pipeline::emit_options(net, None, None) };
    let choice = EncodingChoice::This(encoding);
    let coded = coding::code(net, facts, &logic, choice, safe, Dialect::Palasm, &options);
    let mut read_back = pipeline::through(&coded.emitted(), Dialect::Palasm, &options)
        .expect("equations")
        .read_back;
    observe(&coded.logic, &mut read_back);
    (coded, read_back, options)
}

fn n_products(logic: &Logic, options: &EmitOptions) -> usize {
    let made = Equations::new(logic, Dialect::Palasm, options).expect("equations");
    made.equations.iter().map(|equation| equation.products.len()).sum()
}

#[test]
fn open_cells_are_free_and_what_is_said_is_proved() {
    let mut random = Random::new(23);
    let limits = Limits::default();
    let (mut n_saved, mut n_induced, mut n_circuits) = (0, 0, 0);
    for round in 0..rounds(12, 200) {
        let text = random_table(&mut random);
        let net = chart("table.kiss2", &text);
        let facts = structural_facts(&net);
        for encoding in ENCODINGS {
            for safe in [false, true] {
                let what = format!("round {round}, {encoding:?}, safe {safe}\n{text}");
                let (coded, read_back, options) = through(&net, &facts, encoding, safe);
                let verdict = by_enumeration(&net, &read_back, &limits);
                assert!(matches!(verdict, Verdict::Proved(_)), "{what}{verdict:?}");
                match by_induction(&net, &facts, &read_back, &limits) {
                    Verdict::Proved(_) => n_induced += 1,
                    Verdict::Open(_) => {}
                    Verdict::Refuted(_) => panic!("{what}"),
                }
                if safe {
                    let is_safe = grafsynth_logic::state_assignment::is_safe(&read_back);
                    assert!(is_safe.is_ok(), "{what}{is_safe:?}");
                } else {
                    let closed = Logic { open: Vec::new(), ..coded.logic.clone() };
                    let (with, without) =
                        (n_products(&coded.logic, &options), n_products(&closed, &options));
                    n_saved += without.saturating_sub(with);
                }
                n_circuits += 1;
            }
        }
    }
    println!("{n_saved} products saved; {n_induced} of {n_circuits} proved by induction too");
    assert!(n_saved > 20, "{n_saved} products saved");
    assert!(n_induced * 10 >= n_circuits * 9, "{n_induced} of {n_circuits} proved by induction");
}

/// For any change in a circuit with encoded states and undefined entries, the enumeration proves whatever the induction proves.
#[test]
fn the_induction_through_codes_proves_nothing_wrong() {
    let mut random = Random::new(31);
    let limits = Limits::default();
    let (mut n_harmless, mut n_refuted) = (0, 0);
    for round in 0..rounds(10, 120) {
        let text = random_table(&mut random);
        let net = chart("table.kiss2", &text);
        let facts = structural_facts(&net);
        for encoding in ENCODINGS {
            let (_, read_back, _) = through(&net, &facts, encoding, false);
            let nodes: Vec<_> = read_back.nodes.ids().collect();
            for _ in 0..4 {
                let Some(&id) = random.pick(&nodes) else { continue };
                let mut wrong = read_back.clone();
                wrong.nodes[id] = match wrong.nodes[id].clone() {
                    Node::Not(a) => Node::And(vec![a]),
                    Node::And(all) => Node::Or(all),
                    Node::Or(all) => Node::And(all),
                    Node::Const(value) => Node::Const(!value),
                    other @ (Node::Input(_) | Node::Flop(_) | Node::Xor(..) | Node::Mux(..)) => {
                        wrong.nodes[id] = other;
                        let Some(flop) = wrong.flops.ids().next() else { continue };
                        wrong.flops[flop].init ^= true;
                        wrong.nodes[id].clone()
                    }
                };
                let truth = by_enumeration(&net, &wrong, &limits);
                n_refuted += u32::from(matches!(truth, Verdict::Refuted(_)));
                if let Verdict::Proved(_) = by_induction(&net, &facts, &wrong, &limits) {
                    n_harmless += 1;
                    assert!(
                        matches!(truth, Verdict::Proved(_)),
                        "round {round}, {encoding:?}\n{text}{truth:?}\n{wrong:#?}"
                    );
                }
            }
        }
    }
    println!("{n_refuted} changes refuted, {n_harmless} proved harmless by induction");
    assert!(n_refuted > 30 && n_harmless > 3, "{n_refuted} refuted, {n_harmless} harmless");
}

/// The engine of fuse maps encodes the steps if the device does not have a flip-flop for each, and still shows them.
#[test]
fn the_engine_of_fuse_maps_shows_steps_that_share_a_code() {
    let mut text = ".i 1\n.o 1\n".to_owned();
    for step in 0..14 {
        text += &format!("0 s{step} s{step} {}\n", step % 2);
        text += &format!("1 s{step} s{} -\n", (step + 1) % 14);
    }
    let net = chart("ring.kiss2", &text);
    let facts = structural_facts(&net);
    let stimulus = grafsynth_sim::Stimulus::random(&net, 300, 7, 1);
    let job = grafsynth_engines::Job { net: &net, facts: &facts, stimulus: &stimulus };
    let engine = grafsynth_engines::named("jedec").expect("an engine");
    let burned = engine.run(&job).unwrap_or_else(|why| panic!("{why:?}"));
    let reference = grafsynth_sim::run(&net, &stimulus);
    assert_eq!(grafsynth_sim::compare(&reference, &burned), None);
    let steps = reference.layout.columns.iter().position(|column| column.name == "steps");
    let seen: std::collections::BTreeSet<String> =
        burned.rows.iter().map(|row| format!("{:?}", row.values[steps.expect("steps")])).collect();
    assert_eq!(seen.len(), 14, "every step is shown");
}
