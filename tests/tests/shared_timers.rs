//! Steps that exclude each other share a timer: random timed charts run as programs, circuits and C with shared timers, and behave like the simulator.
//!
//! The charts contain the cases that such a register could get wrong: a step that is left and re-entered in one micro-step, with and without `restart`; steps
//! with different thresholds, including a small one that follows a large one; transitions, outputs and lists that read the time of an inactive step; stable
//! evolution, forcing and enclosing steps.
#![allow(clippy::print_stdout, reason = "tests report what they counted")]

use grafsynth_driver::coding::{Encoding, EncodingChoice, Timed, code_timed, groups};
use grafsynth_driver::pipeline::{self, BusyMode};
use grafsynth_ir::lower::program::{Additions, ProgramOptions, program_with, shared_timers};
use grafsynth_ir::net::Net;
use grafsynth_ir::program::Origin;
use grafsynth_ir::program_run::Machine;
use grafsynth_ir::random::Random;
use grafsynth_ir::{Valid, logic::Logic};
use grafsynth_logic::state_assignment::recode;
use grafsynth_sim::{Simulator, Stimulus};
use grafsynth_tests::{chart, in_parallel, rounds};
use grafsynth_verify::equiv::{by_enumeration, by_induction};
use grafsynth_verify::{Limits, Verdict, structural_facts};
use std::fmt::Write as _;

/// A random timed chart, as text.
fn timed(seed: u64) -> String {
    let mut random = Random::new(seed ^ 0x71e5);
    let stable = random.one_in(2);
    let policy = ["all", "priority", "priority-age"][random.below(3)];
    let mut text = "chart timed {\n    tick 10 ms\n".to_owned();
    _ = writeln!(text, "    conflict {}", if policy == "all" { "priority" } else { policy });
    if stable {
        text += "    evolution stable limit 6\n";
    }
    if random.one_in(3) {
        text += "    assign simultaneous\n";
    }
    text += "    input x, y\n    output p, q, r\n    var n: int 0..7\n";
    let n_rings = 1 + random.below(2);
    let rings: Vec<Vec<String>> = (0..n_rings)
        .map(|ring| {
            (0..3 + random.below(3)).map(|at| format!("{}{at}", ["a", "b"][ring])).collect()
        })
        .collect();
    let all: Vec<&String> = rings.iter().flatten().collect();
    let time = |random: &mut Random, step: &str| {
        let op = [">=", "<", ">", "=", "<="][random.below(5)];
        let most = if random.one_in(4) { 9 } else { 4 };
        format!("{step}.t {op} {}0 ms", 1 + random.below(most))
    };
    let any = |random: &mut Random| all[random.below(all.len())].clone();
    for ring in &rings {
        for (at, step) in ring.iter().enumerate() {
            let mut body = String::new();
            for output in ["p", "q", "r"] {
                if random.one_in(3) {
                    let other = any(&mut random);
                    let read = if random.one_in(2) { step } else { &other };
                    _ = write!(body, " {output} if {};", time(&mut random, read));
                }
            }
            if random.one_in(3) {
                let read = any(&mut random);
                let list = ["entry", "exit"][random.below(2)];
                let at = time(&mut random, &read);
                _ = write!(body, " {list} {{ if {at} {{ n := n + 1 }} else {{ n := 0 }} }};");
            }
            let initial = if at == 0 { "initial " } else { "" };
            _ = writeln!(text, "    {initial}step {step} {{{} }}", body.trim_end_matches(';'));
        }
    }
    for ring in &rings {
        for (at, step) in ring.iter().enumerate() {
            let next = &ring[(at + 1) % ring.len()];
            let other = any(&mut random);
            let guard = match random.below(4) {
                0 => format!("after {}0 ms", 1 + random.below(8)),
                1 => format!("when {} and x", time(&mut random, step)),
                2 => format!("when {} or y", time(&mut random, &other)),
                _ => format!(
                    "when {} and not ({})",
                    time(&mut random, step),
                    time(&mut random, &other)
                ),
            };
            _ = writeln!(text, "    {step} -> {next} {guard}");
            if random.one_in(3) {
                let restart = if random.one_in(2) { " restart" } else { "" };
                let at = time(&mut random, step);
                _ = writeln!(text, "    {step} -> {step} when y and {at}{restart}");
            }
            if random.one_in(4) {
                let to = &ring[random.below(ring.len())];
                _ = writeln!(text, "    {step} -> {to} when x and y restart");
            }
        }
    }
    text += "}\n";
    if random.one_in(3) {
        // Another chart forces this one and encloses a timed ring of its own.
        let order = ["init", "hold"][random.below(2)];
        let enclosed = "        step e0 *\n        step e1\n        e0 -> e1 after 20 ms\n        e1 -> e0 when e1.t >= 40 ms or e0.t >= 10 ms\n";
        _ = write!(
            text,
            "chart guard {{\n    initial step off\n    step on {{ force timed {order} }}\n    enclosing step around {{\n{enclosed}    }}\n    \
             off -> on when timed.x and off.t >= 20 ms\n    on -> around after 30 ms\n    around -> off when timed.y and around.t > 50 ms\n    around -> around when timed.x restart\n}}\n"
        );
    }
    text
}

/// A random statechart whose states measure time, as text: regions side by side, and states within states.
fn states(seed: u64) -> String {
    let mut random = Random::new(seed ^ 0x57a7);
    let policy = ["inner-first", "outer-first"][random.below(2)];
    let mut text = format!(
        "chart timed {{\n    tick 10 ms\n    conflict {policy}\n    queue 1\n    event e, f\n    input x\n    output p, q\n    \
         var n: int 0..3\n    parallel top {{\n"
    );
    for region in ["a", "b"].into_iter().take(1 + random.below(2)) {
        let all: Vec<String> = (0..2 + random.below(2)).map(|at| format!("{region}{at}")).collect();
        let time = |random: &mut Random, own: &str| {
            let step = if random.one_in(3) { &all[random.below(all.len())] } else { own };
            let op = [">=", "<", ">"][random.below(3)];
            format!("{step}.t {op} {}0 ms", 1 + random.below(3))
        };
        _ = writeln!(text, "        region {region} {{");
        for (at, state) in all.iter().enumerate() {
            let initial = if at == 0 { "initial " } else { "" };
            _ = writeln!(text, "            {initial}state {state} {{");
            if random.one_in(2) {
                let output = ["p", "q"][random.below(2)];
                _ = writeln!(text, "                {output} if {}", time(&mut random, state));
            }
            if random.one_in(3) {
                let list = ["entry", "exit"][random.below(2)];
                let when = time(&mut random, state);
                _ = writeln!(
                    text,
                    "                {list} {{ if {when} {{ n := n + 1 }} else {{ n := 0 }} }}"
                );
            }
            if random.one_in(4) {
                let (first, next) = (format!("{state}_in"), format!("{state}_on"));
                _ = writeln!(
                    text,
                    "                initial state {first}\n                state {next} {{ q }}"
                );
                _ = writeln!(
                    text,
                    "                {first} -> {next} after {}0 ms",
                    1 + random.below(3)
                );
                _ = writeln!(text, "                {next} -> {first} on f when {next}.t >= 20 ms");
            }
            text += "            }\n";
        }
        for (at, state) in all.iter().enumerate() {
            let next = &all[(at + 1) % all.len()];
            let guard = match random.below(3) {
                0 => format!("after {}0 ms", 1 + random.below(3)),
                1 => format!("on e when {}", time(&mut random, state)),
                _ => format!("on f when x and {}", time(&mut random, state)),
            };
            _ = writeln!(text, "            {state} -> {next} {guard}");
            if random.one_in(3) {
                _ = writeln!(
                    text,
                    "            {state} -> {state} on e when {}",
                    time(&mut random, state)
                );
            }
        }
        text += "        }\n";
    }
    text + "    }\n}\n"
}

/// The nets of random charts in which steps share timers, with their seeds.
fn sharing(wanted: u64, text: fn(u64) -> String) -> Vec<(u64, Valid<Net>)> {
    let mut nets = Vec::new();
    for seed in 0..wanted * 4 {
        let net = chart("timed.graf", &text(seed));
        if !shared_timers(&net, &structural_facts(&net)).is_empty() {
            nets.push((seed, net));
        }
        if nets.len() as u64 == wanted {
            break;
        }
    }
    assert!(nets.len() as u64 * 2 > wanted, "{} of {wanted} charts share timers", nets.len());
    nets
}

/// The first row in which the program with shared timers differs from the simulator: steps, variables, outputs.
fn differs(net: &Valid<Net>, seed: u64) -> Option<usize> {
    let shared = shared_timers(net, &structural_facts(net));
    let additions = Additions { shared: &shared, ..Additions::default() };
    let program = program_with(net, &ProgramOptions::default(), additions).expect("a program");
    assert!(program.cells.values().any(|cell| matches!(cell.origin, Origin::SharedElapsed(_))));
    let mut machine = Machine::new(&program);
    let mut simulator = Simulator::new(net);
    let largest_dt = [1, 2, 7][(seed % 3) as usize];
    let stimulus = Stimulus::random(net, 300, seed, largest_dt);
    machine.reset();
    simulator.reset();
    for (at, input) in stimulus.rows().enumerate() {
        let shown = machine.react(&input.values, input.dt);
        let row = simulator.react(&input);
        let is_active = |step| {
            let cell = program.cells.iter().find(|(_, cell)| cell.origin == Origin::Step(step));
            cell.is_some_and(|(id, _)| machine.cell(id) == [1])
        };
        let steps: Vec<_> = net.steps.ids().filter(|step| is_active(*step)).collect();
        let value = |var| {
            let cell = program.cells.iter().find(|(_, cell)| cell.origin == Origin::Var(var));
            cell.map(|(id, _)| machine.cell(id)[0])
        };
        let vars: Vec<i64> = net.vars.ids().filter_map(value).collect();
        let is_same = steps == row.steps && vars == row.vars && shown.outputs == row.outputs;
        if !is_same || shown.fault != row.fault {
            return Some(at + 1);
        }
    }
    None
}

#[test]
fn programs_with_shared_timers_do_what_the_net_does() {
    for (text, wanted) in [(timed as fn(u64) -> String, 120), (states, 10)] {
        let nets = sharing(rounds(wanted, wanted * 160), text);
        let found = in_parallel(&nets, |(seed, net)| differs(net, *seed).map(|row| (*seed, row)));
        if let Some((seed, row)) = found.into_iter().flatten().next() {
            panic!("seed {seed} differs in row {row}:\n{}", text(seed));
        }
    }
}

/// Limits for circuits of many states: those with more are proved by induction only.
fn few() -> Limits {
    Limits { pairs: rounds(20_000, 40_000), ..Limits::default() }
}

/// The number of flip-flops of both forms, and the circuits with shared timers in two codings.
fn circuits(net: &Valid<Net>) -> Option<(usize, usize, Vec<Logic>)> {
    let facts = structural_facts(net);
    let logic = pipeline::logic_as(net, &facts, BusyMode::Never).ok()?;
    let own = pipeline::logic_with_own_timers(net, &facts, BusyMode::Never)?;
    let groups = groups(net, &facts, &logic);
    let coded = [Encoding::ZeroHot, Encoding::Compact].map(|code| recode(&logic, &groups, code, 0));
    let (n_shared, n_own) = (logic.flops.len(), own.flops.len());
    // A statechart may also take a clock for each micro-step.
    let is_statechart = net.settings.policy.is_statechart();
    let slow = is_statechart.then(|| pipeline::logic_as(net, &facts, BusyMode::Always).ok());
    let all = std::iter::once(logic).chain(coded).chain(slow.flatten());
    Some((n_own, n_shared, all.collect()))
}

#[test]
fn circuits_with_shared_timers_are_proved_in_both_ways() {
    proved_in_both_ways(rounds(4, 1_500), timed);
}

#[test]
fn circuits_of_statecharts_with_shared_timers_are_proved_in_both_ways() {
    proved_in_both_ways(rounds(3, 400), states);
}

fn proved_in_both_ways(wanted: u64, text: fn(u64) -> String) {
    let nets = sharing(wanted, text);
    let results = in_parallel(&nets, |(seed, net)| {
        let (n_own, n_shared, logics) = circuits(net)?;
        assert!(n_shared < n_own, "seed {seed}: {n_shared} flip-flops, {n_own} without sharing");
        let facts = structural_facts(net);
        let mut proved = [0, 0];
        for logic in &logics {
            for (at, verdict) in
                [by_enumeration(net, logic, &few()), by_induction(net, &facts, logic, &few())]
                    .into_iter()
                    .enumerate()
            {
                match verdict {
                    Verdict::Proved(_) => proved[at] += 1,
                    Verdict::Open(open) => println!("seed {seed}: {open}"),
                    Verdict::Refuted(found) => {
                        panic!("seed {seed}: {:?}\n{}", found.difference, text(*seed))
                    }
                }
            }
        }
        Some((logics.len(), proved))
    });
    let all: Vec<_> = results.into_iter().flatten().collect();
    let total: usize = all.iter().map(|(n, _)| n).sum();
    let [explicit, inductive] =
        [0, 1].map(|way| all.iter().map(|(_, proved)| proved[way]).sum::<usize>());
    println!("{total} circuits: {explicit} proved by enumeration, {inductive} by induction");
    assert!(all.len() * 2 > nets.len(), "{} of {} charts are circuits", all.len(), nets.len());
    assert!(explicit * 2 > total && inductive * 10 >= total * 9);
}

/// A circuit whose register is changed in one place is refuted, or it behaves like the original.
#[test]
fn a_changed_register_is_refuted() {
    changed_registers(rounds(6, 800), timed);
}

#[test]
fn a_changed_register_of_a_statechart_is_refuted() {
    changed_registers(rounds(4, 400), states);
}

fn changed_registers(wanted: u64, text: fn(u64) -> String) {
    let nets = sharing(wanted, text);
    let counts = in_parallel(&nets, |(seed, net)| {
        let Some((_, _, logics)) = circuits(net) else { return [0, 0] };
        let mut random = Random::new(*seed);
        let facts = structural_facts(net);
        let mut counts = [0, 0];
        for logic in &logics {
            let shared = |origin| matches!(origin, Origin::SharedElapsed(_));
            let registers: Vec<_> = (logic.flops.iter())
                .filter(|(_, flop)| flop.holds.is_some_and(|bit| shared(bit.origin)))
                .map(|(id, _)| id)
                .collect();
            let mut changed = logic.clone();
            let at = registers[random.below(registers.len())];
            let other = registers[random.below(registers.len())];
            let next = changed.flops[other].next;
            let flop = &mut changed.flops[at];
            if at == other {
                flop.init = !flop.init;
            } else {
                flop.next = next;
            }
            let by_search = by_enumeration(net, &changed, &few());
            let is_refuted = matches!(by_search, Verdict::Refuted(_));
            let by_proof = by_induction(net, &facts, &changed, &few());
            let is_proved = matches!(by_proof, Verdict::Proved(_));
            assert!(!(is_refuted && is_proved), "seed {seed}: a wrong circuit is called proved");
            counts[usize::from(is_refuted)] += 1;
        }
        counts
    });
    let [same, refuted] = [0, 1].map(|at| counts.iter().map(|count| count[at]).sum::<usize>());
    println!("{refuted} mutants refuted, {same} not");
    assert!(refuted > 2 * same, "{refuted} refuted, {same} not");
}

/// A device gets the form that fits; between two that fit, the one with fewer product terms.
#[test]
fn the_form_that_fits_is_used() {
    let lights = include_str!("../../examples/traffic-light/lights.graf");
    let net = chart("lights.graf", lights);
    let facts = structural_facts(&net);
    let logic = pipeline::logic(&net, &facts).expect("a circuit");
    let own = pipeline::logic_with_own_timers(&net, &facts, BusyMode::Never).expect("it differs");
    let timed = Timed { logic: &logic, own_timers: Some(&own) };
    let options = pipeline::emit_options(&net, Some("gal22v10"), None);
    let asked = (EncodingChoice::Auto, false);
    let dialect = grafsynth_backend_pld::Dialect::Galasm;
    let cache = &mut Default::default();
    let coded = code_timed(cache, &net, &facts, timed, asked, dialect, &options);
    assert!(!coded.has_own_timers && coded.equations.is_some_and(|made| made.has_pins));
}
