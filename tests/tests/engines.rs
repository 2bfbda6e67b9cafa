//! Random nets in the engines: the compiled C, the circuit and its texts, and Icarus Verilog, compared with the reference simulator.
//!
//! A net that shows a difference is shrunk and printed; put it under `tests/cases/mismatch` after the bug is fixed.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::{Options, Package, Style, multi_harness};
use grafsynth_driver::pipeline;
use grafsynth_driver::run::{logic_trace, net_trace};
use grafsynth_engines::{Availability, EngineError, Job, c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Node;
use grafsynth_ir::net::{InputKind, Net, Policy};
use grafsynth_sim::{InputRow, Stimulus, Trace, compare};
use grafsynth_tests::fleet::small_facts;
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_tests::{chart, readable, rounds};
use grafsynth_verify::{Limits, OpenReason, structural_facts};
use std::time::Duration;

const ROWS: usize = 120;
const LIMIT: Duration = Duration::from_secs(120);

fn is_here(what: &str, found: bool) -> bool {
    if !found {
        assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
        println!("skipped: {what} is not installed");
    }
    found
}

/// Facts as in `build` for a chip: for a stable chart with its proved depth, which the encoding uses.
fn chip_facts(net: &Valid<Net>) -> Facts {
    pipeline::facts(net, &limits())
}

fn limits() -> Limits {
    Limits { pairs: 20_000, states: 2_000, ..Limits::default() }
}

/// Regions with four levels and with conflicts, queues, histories and counters. The emitted C agrees with the simulator and compiles
/// without warnings, and its size grows linearly with the chart, not with its product automaton.
#[test]
fn large_statecharts_in_c_do_what_the_net_does() {
    use grafsynth_tests::large_chart::LargeChart;
    if !is_here("a C compiler", tools::c_compiler().is_some()) {
        return;
    }
    let sizes: &[usize] = if rounds(0, 1) == 0 { &[31, 217] } else { &[31, 217, 513, 1001] };
    let mut lines_of_states = Vec::new();
    for size in sizes {
        for (history, raises, lists) in
            [(None, false, false), (Some(false), true, false), (Some(true), true, true)]
        {
            let chart = LargeChart::of_size(*size).expect("a size that is measured");
            let net = LargeChart { history, raises, lists, ..chart }.net().expect("it is a chart");
            let package = package(&net);
            assert_eq!(package.style, "statechart", "{}", package.reason);
            let program = match c::compile_text(&multi_harness(&[(&net, &package)]), &STRICT) {
                Ok(program) => program,
                Err(why) => panic!("{size} states: {why}"),
            };
            let stimulus = Stimulus::random(&net, ROWS, *size as u64, 1);
            let input = c::lines(&net, &stimulus);
            let run =
                tools::run(&program.path, &["0"], program.folder.path(), input.as_bytes(), LIMIT)
                    .expect("it runs");
            let got = c::parse(&net, &run.stdout).expect("it prints a trace");
            let difference = compare(&net_trace(&net, &stimulus), &got);
            assert!(difference.is_none(), "{size} states: {difference:?}");
            let text = package.files.iter().find(|file| file.name.ends_with(".c"));
            let n_lines = text.map_or(0, |file| file.text.lines().count());
            lines_of_states.push(n_lines / size);
        }
    }
    assert!(lines_of_states.iter().all(|lines| *lines <= 40), "{lines_of_states:?}");
}

/// Warning options that the emitted text must pass.
const STRICT: [&str; 8] = [
    "-std=c99",
    "-O1",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-Werror",
    "-Wno-unused-function",
];

/// The C of a net.
fn package(net: &Valid<Net>) -> Package {
    let facts = small_facts(net, Style::Auto);
    match grafsynth_backend_c::emit(net, &facts, &Options::default()) {
        Ok(package) => package,
        Err(found) => panic!("every valid net can be expressed in C: {found:?}\n{}", readable(net)),
    }
}

/// A circuit, and every text of it that can be written and read back, behaves like the net.
#[test]
fn circuits_and_their_texts_do_what_the_net_does() {
    let total = rounds(60, 2_000);
    let (mut n_plain, mut n_circuits, mut n_texts) = (0, 0, 0);
    for seed in 0..total {
        // Every other net may have all features: stable evolution, statecharts, calls. A chip may reject those with a code.
        let is_plain = seed % 2 == 0;
        let net =
            random_net(seed, &if is_plain { Features::chip() } else { Features::everything() });
        let stimulus = Stimulus::random(&net, ROWS, seed, 1);
        let expected = net_trace(&net, &stimulus);
        let Ok(logic) = pipeline::logic(&net, &chip_facts(&net)) else { continue };
        n_circuits += 1;
        n_plain += u64::from(is_plain);
        let got = logic_trace(&net, &logic, &stimulus).expect("the stimulus is for a chip");
        if let Some(difference) = compare(&expected, &got) {
            let small = shrink(&net, |net| differs_as_circuit(net, seed));
            panic!("seed {seed}: {difference:?}\nshrunk:\n{}", readable(&small));
        }
        // Texts of every net would take too long locally: each language gets every fifth net.
        let dialect = grafsynth_backend_pld::Dialect::ALL[(seed / 2 % 5) as usize];
        let options = pipeline::emit_options(&net, None, None);
        if let Ok(through) = pipeline::through(&logic, dialect, &options) {
            n_texts += 1;
            let got = logic_trace(&net, &through.read_back, &stimulus)
                .expect("the stimulus is for a chip");
            if let Some(difference) = compare(&expected, &got) {
                panic!(
                    "seed {seed}, {}: {difference:?}\n{}\n{}",
                    dialect.name(),
                    readable(&net),
                    through.emitted.text
                );
            }
        }
    }
    println!("{n_circuits} circuits ({n_plain} of plain nets) and {n_texts} texts of {total} nets");
    assert!(
        n_plain * 20 >= total * 9,
        "only {n_plain} of {} plain nets became circuits",
        total / 2
    );
    assert!(n_texts * 10 >= total * 3, "only {n_texts} of {total} nets became texts");
}

fn differs_as_circuit(net: &Valid<Net>, seed: u64) -> bool {
    let stimulus = Stimulus::random(net, ROWS, seed, 1);
    pipeline::logic(net, &chip_facts(net)).is_ok_and(|logic| {
        logic_trace(net, &logic, &stimulus)
            .is_ok_and(|got| compare(&net_trace(net, &stimulus), &got).is_some())
    })
}

/// In a stable chart the proved depth shortens the circuit; long chains of conflicts must still be resolved.
#[test]
fn small_stable_charts_settle_their_conflicts_in_one_clock() {
    let features = Features {
        policies: vec![Policy::Priority, Policy::PriorityAge],
        single: false,
        stable: true,
        ..Features::plain()
    };
    let mut n_circuits = 0;
    let total = rounds(100, 3_000);
    for seed in 0..total {
        let net = random_net(seed, &features);
        let stimulus = Stimulus::random(&net, ROWS, seed, 1);
        let Ok(logic) = pipeline::logic(&net, &chip_facts(&net)) else { continue };
        n_circuits += 1;
        let got = logic_trace(&net, &logic, &stimulus).expect("the stimulus is for a chip");
        if let Some(difference) = compare(&net_trace(&net, &stimulus), &got) {
            let small = shrink(&net, |net| differs_as_circuit(net, seed));
            panic!("seed {seed}: {difference:?}\nshrunk:\n{}", readable(&small));
        }
    }
    assert!(n_circuits * 10 >= total * 9, "only {n_circuits} of {total} became circuits");
}

#[test]
fn icarus_runs_the_verilog_as_the_net() {
    let engine = grafsynth_engines::named("verilog").expect("there is an engine of that name");
    if !is_here("iverilog", engine.availability() == Availability::Here) {
        return;
    }
    let wanted = rounds(5, 200);
    let (mut n_run, mut seed) = (0, 0);
    while n_run < wanted {
        assert!(seed < wanted * 4, "only {n_run} of {seed} nets became Verilog");
        let net = random_net(seed, &Features::chip());
        let stimulus = Stimulus::random(&net, ROWS, seed, 1);
        let facts = structural_facts(&net);
        match engine.run(&Job { net: &net, facts: &facts, stimulus: &stimulus }) {
            Ok(got) => {
                n_run += 1;
                if let Some(difference) = compare(&net_trace(&net, &stimulus), &got) {
                    panic!("seed {seed}: {difference:?}\n{}", readable(&net));
                }
            }
            Err(EngineError::Refused(_)) => {}
            Err(EngineError::Failed(why)) => panic!("seed {seed}: {why}\n{}", readable(&net)),
        }
        seed += 1;
    }
}

/// The exhaustive comparison of compiled C refutes no random net, and proves some.
#[test]
fn exhaustive_comparison_proves_random_nets() {
    if !is_here("a C compiler", tools::c_compiler().is_some()) {
        return;
    }
    let mut n_proved = 0;
    for seed in 0..rounds(8, 60) {
        let net = random_net(seed, &Features::plain());
        let package = package(&net);
        let line = grafsynth_engines::exhaustive::check(
            &format!("{}.c", net.name),
            &net,
            &package,
            &Limits::default(),
            Err(OpenReason::Method("only the enumeration is tested".to_owned())),
        )
        .expect("it compiles");
        assert_ne!(
            line.outcome(),
            grafsynth_driver::report::Outcome::Refuted,
            "seed {seed}: {line}\n{}",
            readable(&net)
        );
        n_proved += u32::from(line.outcome() == grafsynth_driver::report::Outcome::Proved);
    }
    assert!(n_proved > 0, "no net was proved");
}

/// A trace with one changed cell is different: the comparison itself can fail.
#[test]
fn a_changed_cell_is_a_difference() {
    let net = random_net(3, &Features::plain());
    let stimulus = Stimulus::random(&net, 20, 3, 1);
    let trace = net_trace(&net, &stimulus);
    let mut lines: Vec<String> = trace.to_csv().lines().map(str::to_owned).collect();
    let last = lines.last_mut().expect("a trace has rows");
    let changed = if last.ends_with('1') { "0" } else { "1" };
    last.replace_range(last.len() - 1.., changed);
    let layout = trace.layout.clone();
    let other = Trace::parse_csv(&layout, Default::default(), &(lines.join("\n") + "\n"));
    assert!(other.map_or(true, |other| compare(&trace, &other).is_some()));
    let inputs = net.inputs.values().filter(|input| input.kind != InputKind::InternalEvent).count();
    assert_eq!(InputRow::zero(&net).values.len(), inputs);
}

/// The row of a circuit shows the values of its pins: a wrong pin of a stored output is a difference although its memory is right.
#[test]
fn a_wrong_pin_of_a_stored_output_is_a_difference() {
    let net = chart(
        "chart.graf",
        "chart count {
    input go
    output n: int 0..3 = 0
    initial step a
    step b
    a -> b when go do { n := (n + 1) mod 4 }
    b -> a when not go
}
",
    );
    let stimulus = Stimulus::random(&net, 20, 1, 1);
    let expected = net_trace(&net, &stimulus);
    let mut logic = pipeline::logic(&net, &structural_facts(&net)).expect("a circuit");
    let trace = logic_trace(&net, &logic, &stimulus).expect("a trace");
    assert!(compare(&expected, &trace).is_none());
    let pin = logic.outputs.ids().next().expect("a pin");
    let value = logic.outputs[pin].value;
    logic.outputs[pin].value = logic.nodes.push(Node::Not(value));
    let trace = logic_trace(&net, &logic, &stimulus).expect("a trace");
    let found = compare(&expected, &trace).expect("a difference");
    assert_eq!(found.column, "n");
}
