//! Circuits with one micro-step per clock compared with the reference simulator: a row is a reaction, whatever the number of its clocks (semantics.md
//! §9).

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "tests report what they ran, and write files for Icarus Verilog"
)]

use grafsynth_backend_pld::{Dialect, Object};
use grafsynth_driver::pipeline::{self, BuildOptions, Through};
use grafsynth_driver::run::{logic_trace, net_trace};
use grafsynth_driver::target::Target;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::arena::Id;
use grafsynth_ir::facts::{Facts, Proof, Proved};
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::net::{Evolution, Net, Policy};
use grafsynth_logic::chip::{ChipSim, NoRow, most_clocks};
use grafsynth_logic::sim::LogicSim;
use grafsynth_logic::{BusyMode, EncodeOptions};
use grafsynth_sim::{Difference, Stimulus, compare};
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_tests::{chart, readable, rounds};
use grafsynth_verify::equiv::{by_chance, by_enumeration, by_induction};
use grafsynth_verify::{Limits, Verdict, structural_facts};
use std::collections::BTreeMap;
use std::time::Duration;

const ROWS: usize = 60;

/// The circuit with a clock for each micro-step, whether or not it could be composed.
fn clocked(net: &Valid<Net>) -> Option<Logic> {
    let logic = pipeline::logic_as(net, &structural_facts(net), BusyMode::Always).ok()?;
    has_busy(&logic).then_some(logic)
}

fn has_busy(logic: &Logic) -> bool {
    logic.outputs.values().any(|output| output.role == PinRole::Busy)
}

/// True for circuits whose sums of products are found quickly: those of larger ones are usually rejected after a long search.
fn is_small(logic: &Logic) -> bool {
    logic.nodes.len() < 700
}

fn difference(net: &Valid<Net>, logic: &Logic, seed: u64) -> Option<Difference> {
    let stimulus = Stimulus::random(net, ROWS, seed, 1);
    let got = logic_trace(net, logic, &stimulus).expect("the stimulus is for a chip");
    compare(&net_trace(net, &stimulus), &got)
}

/// Runs random stable nets with these policies; returns how many of them became circuits with `busy`.
fn check(policies: Vec<Policy>, total: u64) -> u64 {
    let features = Features { policies, emergency: false, ..Features::everything() };
    let (mut n_clocked, mut n_stable, mut n_faults) = (0, 0, 0);
    for seed in 0..total {
        let net = random_net(seed, &features);
        if net.settings.evolution == Evolution::Single {
            continue;
        }
        n_stable += 1;
        let Some(logic) = clocked(&net) else { continue };
        n_clocked += 1;
        let trace = net_trace(&net, &Stimulus::random(&net, ROWS, seed, 1));
        n_faults += u64::from(trace.to_csv().lines().skip(1).any(|line| line.ends_with(",1")));
        if let Some(found) = difference(&net, &logic, seed) {
            let is_wrong = |net: &Valid<Net>| {
                clocked(net).is_some_and(|logic| difference(net, &logic, seed).is_some())
            };
            let small = shrink(&net, is_wrong);
            let again = clocked(&small).and_then(|logic| difference(&small, &logic, seed));
            panic!("seed {seed}: {found:?}\nshrunk: {again:?}\n{}", readable(&small));
        }
    }
    println!("{n_clocked} of {n_stable} stable nets took several clocks, {n_faults} with faults");
    assert!(n_faults > 0, "no net reached its limit");
    n_clocked
}

#[test]
fn grafcet_charts_with_a_clock_for_each_micro_step() {
    use Policy::{All, Priority, PriorityAge};
    let total = rounds(120, 6_000);
    let n_clocked = check(vec![All, Priority, PriorityAge], total);
    assert!(n_clocked * 10 >= total, "only {n_clocked} of {total}");
}

#[test]
fn statecharts_with_a_clock_for_each_step() {
    use Policy::{InnerFirst, OuterFirst};
    let total = rounds(40, 3_000);
    let n_clocked = check(vec![InnerFirst, OuterFirst], total);
    assert!(n_clocked * 10 >= total, "only {n_clocked} of {total}");
}

/// Each text of a circuit with `busy`, read back, behaves the same.
#[test]
fn texts_of_circuits_with_busy() {
    let total = rounds(80, 1_500);
    let (mut n_clocked, mut n_texts) = (0, 0);
    for seed in 0..total {
        let net = random_net(seed, &Features::everything());
        let Some(logic) = clocked(&net).filter(is_small) else { continue };
        let dialect = Dialect::ALL[(n_clocked % 5) as usize];
        n_clocked += 1;
        let options = pipeline::emit_options(&net, None, None);
        let Ok(through) = pipeline::through(&logic, dialect, &options) else { continue };
        n_texts += 1;
        if let Some(found) = difference(&net, &through.read_back, seed) {
            panic!("seed {seed}, {}: {found:?}\n{}", dialect.name(), readable(&net));
        }
    }
    println!("{n_texts} texts of {n_clocked} circuits");
    assert!(n_texts > 3, "only {n_texts} of {n_clocked} circuits became texts");
}

/// The enumeration proves a circuit with `busy`, and refutes it if a register is corrupted; the induction proves none that is refuted.
#[test]
fn enumeration_proves_circuits_with_busy() {
    let limits = Limits { pairs: 4_000, rows_per_state: 256, states: 1_000, ..Limits::default() };
    let little = Limits { circuit_nodes: 20_000, conflicts: 200, ..limits.clone() };
    let (mut n_proved, mut n_spoiled, mut n_refuted) = (0, 0, 0);
    for seed in 0..rounds(60, 1_500) {
        let net = random_net(seed, &Features::everything());
        let Some(logic) = clocked(&net) else { continue };
        let facts = structural_facts(&net);
        match by_enumeration(&net, &logic, &limits) {
            Verdict::Proved(_) => n_proved += 1,
            Verdict::Open(_) => continue,
            Verdict::Refuted(found) => panic!("seed {seed}: {found:?}\n{}", readable(&net)),
        }
        let busy = logic.flops.iter().find(|(_, flop)| flop.name == "busy").map(|(id, _)| id);
        let Some(busy) = busy else { continue };
        // One circuit never waits, and the other one never ends.
        for node in [false, true] {
            let mut spoiled = logic.clone();
            let constant = spoiled.nodes.push(grafsynth_ir::logic::Node::Const(node));
            spoiled.flops[busy].next = constant;
            n_spoiled += 1;
            if let Verdict::Refuted(_) = by_enumeration(&net, &spoiled, &limits) {
                n_refuted += 1;
                let verdict = by_induction(&net, &facts, &spoiled, &little);
                assert!(!matches!(verdict, Verdict::Proved(_)), "seed {seed}: {verdict:?}");
            }
            if node {
                let found = by_chance(&net, &spoiled, 200).expect("it is always busy");
                assert_eq!(found.difference.column, "busy", "seed {seed}");
            }
        }
    }
    println!("{n_proved} proved; {n_refuted} of {n_spoiled} corrupted ones refuted");
    assert!(n_proved > 3 && n_refuted * 2 > n_spoiled, "{n_proved} {n_refuted} {n_spoiled}");
}

/// The engine's loop and the emitted bench both wait for `busy` in Icarus Verilog.
#[test]
fn icarus_waits_for_busy() {
    let (Some(iverilog), Some(vvp)) = (tools::find(&["iverilog"]), tools::find(&["vvp"])) else {
        assert!(std::env::var_os("CI").is_none(), "iverilog is missing, and CI must have it");
        println!("skipped: iverilog is not installed");
        return;
    };
    let engine = grafsynth_engines::named("verilog").expect("there is an engine of that name");
    let wanted = rounds(4, 100);
    let (mut n_run, mut seed) = (0, 0);
    while n_run < wanted {
        assert!(seed < wanted * 30, "only {n_run} of {seed} nets");
        let net = random_net(seed, &Features::everything());
        let facts = structural_facts(&net);
        seed += 1;
        let Ok(logic) = pipeline::logic(&net, &facts) else { continue };
        if !has_busy(&logic) {
            continue;
        }
        n_run += 1;
        let stimulus = Stimulus::random(&net, ROWS, seed, 1);
        let job = grafsynth_engines::Job { net: &net, facts: &facts, stimulus: &stimulus };
        let got = engine.run(&job).unwrap_or_else(|why| panic!("{why:?}\n{}", readable(&net)));
        if let Some(found) = compare(&net_trace(&net, &stimulus), &got) {
            panic!("seed {}: {found:?}\n{}", seed - 1, readable(&net));
        }
        let vectors = pipeline::vectors(&net, &logic, &stimulus).expect("vectors of the circuit");
        let options = pipeline::emit_options(&net, None, Some(vectors));
        let emitted = grafsynth_backend_pld::emit(&logic, Dialect::Verilog, &options)
            .expect("every circuit can be expressed in Verilog");
        let folder = tempfile::tempdir().expect("a folder");
        let put = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("a file can be written");
        };
        put("design.v", &emitted.text);
        put("bench.v", &emitted.bench.expect("a bench was requested"));
        let limit = Duration::from_secs(60);
        let arguments = ["-g2001", "-o", "bench.vvp", "design.v", "bench.v"];
        let made = tools::run(&iverilog, &arguments, folder.path(), b"", limit).expect("iverilog");
        assert!(made.is_success, "seed {}: {}", seed - 1, made.stderr);
        let run =
            tools::run(&vvp, &["-n", "bench.vvp"], folder.path(), b"", limit).expect("vvp runs");
        let said = String::from_utf8_lossy(&run.stdout).into_owned();
        assert!(said.contains("PASS"), "seed {}: {said}\n{}", seed - 1, readable(&net));
    }
}

/// Executes the SIMULATION section of a PALASM text on the circuit that is read from the text; returns the number of checks.
fn simulate_palasm(through: &Through) -> Result<usize, String> {
    let mut sim = LogicSim::new(&through.read_back);
    let (mut inputs, mut shown) = (BTreeMap::new(), BTreeMap::new());
    // The objects of the circuit that was read back are in the order of the names.
    let mut next = [0; 3];
    for named in &through.emitted.names {
        let mut number = |kind: usize| {
            next[kind] += 1;
            next[kind] - 1
        };
        match &named.object {
            Object::Input(_) => {
                inputs.insert(named.name.as_str(), number(0));
            }
            Object::Flop(_) => {
                shown.insert(named.name.as_str(), (true, number(1)));
            }
            Object::Output(_) => {
                shown.insert(named.name.as_str(), (false, number(2)));
            }
            Object::Clock | Object::Reset | Object::Buried => {}
        }
    }
    let text = &through.emitted.text;
    let at = text.find("\nSIMULATION").ok_or("no SIMULATION")?;
    let mut n_checks = 0;
    let mut verb = "";
    for line in text[at..].lines().skip(2) {
        let mut words: Vec<&str> = line.split_whitespace().collect();
        if !line.starts_with(' ') {
            verb = words.first().copied().unwrap_or_default();
            words = words.split_off(1.min(words.len()));
        }
        if verb == "CLOCKF" {
            sim.clock();
            continue;
        }
        for word in words {
            let (name, value) = word.strip_prefix('/').map_or((word, 1), |name| (name, 0));
            match verb {
                "SETF" => {
                    let pin = inputs.get(name).ok_or_else(|| format!("SETF of {name}"))?;
                    sim.set_input(Id::from_index(*pin), value);
                }
                "CHECK" => {
                    let (is_flop, number) =
                        *shown.get(name).ok_or_else(|| format!("CHECK of {name}"))?;
                    let got = if is_flop {
                        sim.flop(Id::from_index(number))
                    } else {
                        sim.output(Id::from_index(number))
                    };
                    n_checks += 1;
                    if got & 1 != value {
                        return Err(format!("check {n_checks}: {word} is {}", got & 1));
                    }
                }
                _ => {}
            }
        }
    }
    Ok(n_checks)
}

/// The SIMULATION section clocks as often as each reaction needs, and its checks pass.
#[test]
fn the_simulation_section_waits_for_busy() {
    let (mut n_run, mut n_checks) = (0, 0);
    for seed in 0..rounds(80, 1_000) {
        let net = random_net(seed, &Features::everything());
        let Some(logic) = clocked(&net).filter(is_small) else { continue };
        let stimulus = Stimulus::random(&net, 20, seed, 1);
        let vectors = pipeline::vectors(&net, &logic, &stimulus).expect("vectors of the circuit");
        let options = pipeline::emit_options(&net, None, Some(vectors));
        let Ok(through) = pipeline::through(&logic, Dialect::Palasm, &options) else { continue };
        n_run += 1;
        match simulate_palasm(&through) {
            Ok(n) => n_checks += n,
            Err(why) => panic!("seed {seed}: {why}\n{}", through.emitted.text),
        }
    }
    println!("{n_run} sections, {n_checks} checks");
    assert!(n_run > 0 && n_checks > 50 * n_run, "{n_run} sections, {n_checks} checks");
}

/// After `go`, three micro-steps lead from `p0` to `p3`; `E` leads back and is counted in `n`.
const WALK: &str = "chart walk {
    evolution stable limit 8
    input go
    event E
    var n: int 0..7 = 0
    output there
    initial step p0
    step p1
    step p2
    step p3 { there }
    p0 -> p1 when rise(go)
    p1 -> p2
    p2 -> p3
    p3 -> p0 on E do { n := n + 1 }
}
";

/// The protocol of semantics.md §9, clock by clock: rows do not show it, so it is tested on the circuit itself.
#[test]
fn what_arrives_while_busy_waits_for_the_next_reaction() {
    let net = chart("chart.graf", WALK);
    let logic = clocked(&net).expect("a circuit");
    let (there, n) = (Id::from_index(0), Id::from_index(0));
    let (go, event) = ([1, 0], [0, 1]);
    let mut chip = ChipSim::new(&net, &logic);
    // Row 1 takes three micro-steps and the final check. Inputs are latched: resetting `go` does not matter.
    chip.clock(&go, false);
    for _ in 0..3 {
        assert!(chip.is_busy());
        assert_eq!(chip.output(there), Some(0), "outputs keep their last stable value");
        chip.clock(&[0, 0], false);
    }
    assert!(!chip.is_busy());
    assert_eq!((chip.output(there), chip.fault()), (Some(1), false));
    assert_eq!(chip.react(&event, 0), Ok(2));
    assert_eq!((chip.output(there), chip.var(n, 0)), (Some(0), Some(1)));

    // An event in the second clock is kept in its bit, and is part of the next reaction.
    chip.clock(&go, false);
    chip.clock(&event, false);
    chip.clock(&[0, 0], false);
    assert!(chip.is_busy());
    chip.clock(&[0, 0], false);
    assert_eq!((chip.is_busy(), chip.output(there), chip.var(n, 0)), (false, Some(1), Some(1)));
    assert!(!chip.fault());
    assert_eq!(chip.react(&[0, 0], 0), Ok(2));
    assert_eq!((chip.output(there), chip.var(n, 0), chip.fault()), (Some(0), Some(2), false));
    assert_eq!(chip.react(&[0, 0], 0), Ok(1), "it was taken once");
    assert_eq!(chip.var(n, 0), Some(2));

    // A second event while the first is still pending is lost, and the row reports it; the first one counts.
    chip.clock(&go, false);
    chip.clock(&event, false);
    chip.clock(&event, false);
    chip.clock(&[0, 0], false);
    assert_eq!((chip.is_busy(), chip.output(there), chip.fault()), (false, Some(1), true));
    assert_eq!(chip.react(&[0, 0], 0), Ok(2));
    assert_eq!((chip.var(n, 0), chip.fault()), (Some(3), false));

    // The same happens for an event in the clock that takes the pending one.
    chip.clock(&go, false);
    chip.clock(&event, false);
    chip.clock(&[0, 0], false);
    chip.clock(&[0, 0], false);
    assert_eq!(chip.react(&event, 0), Ok(2));
    assert_eq!((chip.var(n, 0), chip.fault()), (Some(4), true));
}

/// A tick that arrives while busy is not lost: the step's time counts it in the next reaction.
#[test]
fn a_tick_while_busy_is_counted_later() {
    let timed = WALK.replace("p0 on E do", "p0 when p3.t >= 20 ms do");
    let net = chart("chart.graf", &timed);
    let logic = clocked(&net).expect("a circuit");
    let n = Id::from_index(0);
    let mut chip = ChipSim::new(&net, &logic);
    chip.clock(&[1, 0], false);
    chip.clock(&[0, 0], true);
    chip.clock(&[0, 0], false);
    chip.clock(&[0, 0], false);
    assert!(!chip.is_busy());
    assert_eq!(chip.react(&[0, 0], 0), Ok(1));
    assert_eq!(chip.var(n, 0), Some(0));
    assert_eq!(chip.react(&[0, 0], 1), Ok(2));
    assert_eq!((chip.var(n, 0), chip.fault()), (Some(1), false));
}

/// A chart that never becomes stable takes as many clocks as the limit allows and sets the fault; a circuit that never ends gives no row.
#[test]
fn a_livelock_faults_and_a_hang_is_found() {
    let net = chart(
        "chart.graf",
        "chart swing {
    evolution stable limit 5
    input go
    initial step a
    step b
    a -> b when go
    b -> a when go
}
",
    );
    let logic = clocked(&net).expect("a circuit");
    let mut chip = ChipSim::new(&net, &logic);
    assert_eq!(chip.react(&[1], 0), Ok(6));
    assert_eq!((chip.fault(), chip.is_active(Id::from_index(1))), (true, Some(true)));
    assert_eq!(chip.react(&[0], 0), Ok(1));
    assert!(!chip.fault());
    let mut stuck = logic.clone();
    let one = stuck.nodes.push(grafsynth_ir::logic::Node::Const(true));
    for (_, flop) in stuck.flops.iter_mut() {
        if flop.name == "busy" {
            flop.next = one;
        }
    }
    let mut chip = ChipSim::new(&net, &stuck);
    assert_eq!(chip.react(&[0], 0), Err(NoRow::StillBusy { clocks: most_clocks(&net) }));
    let stimulus = Stimulus::random(&net, 3, 1, 1);
    let trace = logic_trace(&net, &stuck, &stimulus).expect("a short trace");
    assert_eq!(trace.rows.len(), 1);
    assert!(compare(&net_trace(&net, &stimulus), &trace).is_some());
}

/// The number of clocks of a chart's circuit: one if the depth is proved, unless the circuit is too large; otherwise several.
#[test]
fn the_form_follows_the_proof_and_the_size() {
    let net = chart("chart.graf", WALK);
    let proved = pipeline::facts(&net, &Limits::default());
    let unknown = structural_facts(&net);
    assert_eq!(proved.stable_depth.as_ref().map(|depth| depth.value), Some(3));
    let form = |facts: &Facts, busy: BusyMode| {
        let logic = pipeline::logic_as(&net, facts, busy).expect("a circuit");
        let text = pipeline::form(&net, facts, &logic, busy).expect("it is stable");
        assert_eq!(has_busy(&logic), text.contains("`busy`"), "{text}");
        text
    };
    let composed = "micro-steps composed into one clock, at most 3, as proved";
    assert_eq!(form(&proved, BusyMode::WhenUnproved), composed);
    assert_eq!(form(&proved, BusyMode::WhenTooLarge), composed);
    assert!(form(&unknown, BusyMode::WhenTooLarge).starts_with("micro-steps composed"));
    assert!(
        form(&unknown, BusyMode::WhenUnproved)
            .ends_with("it is not proved that 8 micro-steps are always enough")
    );
    assert!(form(&proved, BusyMode::Always).ends_with("as asked"));
    let program =
        grafsynth_ir::lower::program::program(&net, &Default::default()).expect("a program");
    let small = EncodeOptions {
        busy: BusyMode::WhenTooLarge,
        max_composed: 30,
        ..EncodeOptions::default()
    };
    let logic = grafsynth_logic::encode(&net, &program, &unknown, &small).expect("a circuit");
    assert!(has_busy(&logic));
    assert!(
        pipeline::form(&net, &unknown, &logic, BusyMode::WhenTooLarge)
            .is_some_and(|text| text.ends_with("would be too large"))
    );
}

/// A chart with an emergency has one clock per reaction, even if several are requested. The reason is reported in the form, in a warning, and in the error if
/// the circuit with one clock is too large.
#[test]
fn an_emergency_leaves_one_clock() {
    let net =
        chart("chart.graf", &WALK.replacen("    initial", "    emergency go\n    initial", 1));
    let unknown = structural_facts(&net);
    for busy in [BusyMode::WhenUnproved, BusyMode::Always] {
        let logic = pipeline::logic_as(&net, &unknown, busy).expect("a circuit");
        assert!(!has_busy(&logic));
        let text = pipeline::form(&net, &unknown, &logic, busy).expect("it is stable");
        assert!(
            text.contains("no output may be delayed") && !text.contains("nothing fires"),
            "{text}"
        );
        let options = BuildOptions { busy, ..BuildOptions::default() };
        let verilog = [Target::Logic(Dialect::Verilog)];
        let built = pipeline::build(&net, &unknown, &verilog, &options);
        let n_warnings = usize::from(busy == BusyMode::Always);
        assert_eq!(built.found.len(), n_warnings, "{:?}", built.found);
        assert!(built.found.iter().all(|found| found.code.id == "G0014"));
    }
    let program =
        grafsynth_ir::lower::program::program(&net, &Default::default()).expect("a program");
    let small = EncodeOptions { max_nodes: 30, ..EncodeOptions::default() };
    let found = grafsynth_logic::encode(&net, &program, &unknown, &small).expect_err("too large");
    let help = found[0].help.as_deref().unwrap_or_default();
    assert!(help.contains("emergency") && !help.contains("calls"), "{help}");
}

/// The proved number of rounds is exact: a composition of this many rounds equals the net, and a composition of fewer rounds is refuted unless the missing
/// rounds have no effect.
#[test]
fn as_many_rounds_as_proved_and_no_fewer() {
    use Policy::{InnerFirst, OuterFirst};
    let total = rounds(150, 1_200);
    let features = Features {
        policies: vec![InnerFirst, OuterFirst],
        emergency: false,
        ..Features::everything()
    };
    let limits = Limits { pairs: 3_000, states: 300, image_work: 1, ..Limits::default() };
    let (mut n_proved, mut n_refuted) = (0, 0);
    for seed in 0..total {
        let net = random_net(seed, &features);
        let facts = grafsynth_verify::facts(&net, &limits);
        let Some(Proved { value, by: Proof::Explicit }) = facts.rounds else { continue };
        let composed = |rounds: u32| {
            let rounds = Some(Proved { value: rounds, by: Proof::Explicit });
            let facts = Facts { rounds, stable_depth: None, ..facts.clone() };
            pipeline::logic_as(&net, &facts, BusyMode::Never).ok()
        };
        let Some(logic) = composed(value).filter(|logic| logic.nodes.len() < 20_000) else {
            continue;
        };
        match by_enumeration(&net, &logic, &limits) {
            Verdict::Proved(_) => n_proved += 1,
            // The circuit may read more inputs than the net does.
            Verdict::Open(_) => continue,
            Verdict::Refuted(found) => {
                panic!("seed {seed}, {value} rounds: {:?}\n{}", found.difference, readable(&net))
            }
        }
        // The last round may be an empty check, and a micro-step may return to its start.
        let mut fewer = (0..value).rev().filter_map(composed);
        n_refuted += u64::from(
            fewer.any(|logic| matches!(by_enumeration(&net, &logic, &limits), Verdict::Refuted(_))),
        );
    }
    println!("{n_proved} compositions proved; {n_refuted} wrong bounds were refuted");
    assert!(n_proved * 15 >= total, "{n_proved} of {total}");
    assert!(n_refuted * 50 >= total, "{n_refuted} of {total}");
}

/// Too large for one clock: a search of depth four thousand with a division in it.
#[test]
fn a_deep_search_with_wide_arithmetic_is_a_circuit() {
    let net = chart(
        "chart.graf",
        "chart wide {
    evolution stable limit 4000
    input go
    input k: int 1..65535
    var n: int 0..65535 = 0
    initial step a
    step b
    a -> b when go do { n := (n + k) * k / 3 }
    b -> a when n mod k > 3
}
",
    );
    let facts = structural_facts(&net);
    let program =
        grafsynth_ir::lower::program::program(&net, &Default::default()).expect("a program");
    let encode = |busy| {
        let options = EncodeOptions { busy, max_nodes: 30_000, ..EncodeOptions::default() };
        grafsynth_logic::encode(&net, &program, &facts, &options)
    };
    let refused = encode(BusyMode::Never).expect_err("too large");
    assert_eq!(refused.first().map(|found| found.code.id), Some("G0704"));
    let logic = encode(BusyMode::WhenTooLarge).expect("a circuit");
    assert!(has_busy(&logic));
    assert_eq!(difference(&net, &logic, 1), None);
}
