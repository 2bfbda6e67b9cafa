//! The static bounds of `grafsynth_backend_c::cost` compared with simulated machines: no measured value exceeds its bound.

#![allow(
    clippy::print_stdout,
    reason = "tests report what they skip, and how tight the bounds are"
)]
#![allow(clippy::disallowed_methods, reason = "tests write files for compilers")]

use grafsynth_backend_c::cost::{self, Bound, Goal, Machine};
use grafsynth_backend_c::{Io, Options, Style, emit};
use grafsynth_driver::read::{Design, NetDesign, ReadLimits, Texts};
use grafsynth_driver::source::Sources;
use grafsynth_driver::task_costs::Counted;
use grafsynth_engines::measure::search::{Effort, dearest};
use grafsynth_engines::measure::{Measured, Meter, meters as meters_here};
use grafsynth_engines::{EngineError, Job, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_sim::Stimulus;
use grafsynth_tests::large_chart::LargeChart;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{rounds, small_limits};
use grafsynth_verify::facts;
use itertools::Itertools as _;
use std::path::Path;
use std::time::Duration;

fn facts_of(net: &Valid<Net>) -> Facts {
    facts(net, &small_limits())
}

/// Cycles through the styles and options.
fn options(seed: u64) -> Options {
    let style = [Style::Auto, Style::Bits, Style::Switch, Style::Tables][(seed % 4) as usize];
    let io = if seed.is_multiple_of(3) { Io::Words } else { Io::Members };
    let trace = (seed % 7 == 3).then_some(8);
    let safe_state = seed % 5 == 2;
    Options { style, io, trace, safe_state, gate: seed % 7 == 5, ..Options::default() }
}

/// Every emitted text is understood, on every machine: in all styles, with and without optional features.
#[test]
fn every_random_chart_has_a_bound() {
    let mut bounded = 0;
    let all = cost::MACHINES;
    // Of a few charts, each is read for half of the machines.
    let n_machines = rounds(2, all.len() as u64) as usize;
    for seed in 0..rounds(40, 600) {
        let net = random_net(seed, &Features::everything());
        let facts = facts_of(&net);
        let Ok(package) = emit(&net, &facts, &options(seed)) else { continue };
        for machine in all.iter().cycle().skip((seed / 4) as usize % all.len()).take(n_machines) {
            let bound = match cost::bound(&package, machine) {
                Ok(bound) => bound,
                Err(error) => {
                    let line = error.line.saturating_sub(1) as usize;
                    let source = package.files.iter().find(|file| file.name.ends_with(".c"));
                    let text = source.and_then(|file| file.text.lines().nth(line));
                    panic!("seed {seed}, {}: {error}\n{}", machine.name, text.unwrap_or_default());
                }
            };
            assert!(bound.step > 0 && bound.init > 0 && bound.stack > 0, "seed {seed}");
            // A scan takes at least as long as one reaction, and a scan in an interrupt has neither watchdog nor sleep.
            if let (Some(scan), Some(isr)) = (bound.scan, bound.scan_isr) {
                assert!(scan.time >= isr.time && isr.time >= bound.step, "seed {seed}");
                assert!(scan.stack >= isr.stack && isr.stack >= bound.stack, "seed {seed}");
            }
            // The bound is the sum of the path.
            let path: u64 = bound.path.iter().map(|place| place.time).sum();
            let call = u64::from(machine.call.time);
            assert_eq!(path + call, bound.step, "seed {seed}, {}", machine.name);
            bounded += 1;
        }
    }
    println!("{bounded} bounds");
    assert!(bounded >= 20);
}

/// The gate compares an instance byte by byte: arrays and loops as long as a structure are understood.
#[test]
fn a_gate_has_a_bound() {
    let net = grafsynth_tests::chart("a.graf", &ring(30, 10));
    for style in [Style::Switch, Style::Bits] {
        let options = Options { style, gate: true, ..Options::default() };
        let gated = emit(&net, &facts_of(&net), &options).expect("it is emitted");
        let plain = emit(&net, &facts_of(&net), &Options { gate: false, ..options });
        let plain = plain.expect("it is emitted");
        for machine in cost::MACHINES {
            let of = |package| cost::bound(package, machine).expect("it is understood").step;
            assert!(of(&gated) > of(&plain), "{}", machine.name);
        }
    }
}

/// The ratio of bound and measured value for one chart; `None` if the chart is rejected or the machine is too small.
fn on_machine(
    meter: &dyn Meter,
    name: &str,
    net: &Valid<Net>,
    options: &Options,
    rows: usize,
) -> Option<f64> {
    let machine: &Machine = cost::machine(meter.machine()).expect("it is there");
    let facts = facts_of(net);
    let package = emit(net, &facts, options).ok()?;
    let bound: Bound = cost::bound(&package, machine).expect("it is understood");
    let stimulus = Stimulus::random(net, rows, 7, 3);
    let job = Job { net, facts: &facts, stimulus: &stimulus };
    let measured: Measured = match meter.run(&job, options) {
        Ok(measured) => measured,
        Err(EngineError::Refused(_)) => return None,
        Err(EngineError::Failed(why)) => panic!("{name}: {why}"),
    };
    // A closed gate calls nothing.
    let are_all = measured.reactions == rows as u64;
    assert!(are_all || (options.gate && measured.reactions > 0), "{name}: {measured:?}");
    let ratio = bound.step as f64 / measured.step as f64;
    println!(
        "{name}, {}, {}: step {} for {} ({ratio:.2}), init {} for {}, stack {} for {:?}, text about {} for {}",
        machine.name,
        package.style,
        bound.step,
        measured.step,
        bound.init,
        measured.init,
        bound.stack,
        measured.stack,
        bound.text,
        measured.text
    );
    let is_within = bound.step >= measured.step
        && bound.init >= measured.init
        && measured.stack.is_none_or(|stack| bound.stack >= stack);
    assert!(is_within, "{name}, {}: measured {measured:?}, bound {bound:?}", machine.name);
    Some(ratio)
}

/// The bounds of a chart and the worst reaction that a search finds: no bound is below it, or more than `most` times as large. Empty if the chart is
/// rejected.
fn searched(
    name: &str,
    net: &Valid<Net>,
    options: &Options,
    most: f64,
) -> Vec<(&'static str, Bound)> {
    let facts = facts_of(net);
    let Ok(package) = emit(net, &facts, options) else { return Vec::new() };
    let mut rows = Vec::new();
    let mut bounds = Vec::new();
    for meter in meters() {
        let machine = cost::machine(meter.machine()).expect("it is there");
        let bound = cost::bound(&package, machine).expect("it is understood");
        let stimulus = Stimulus::random(net, 300, 1, 3);
        let job = Job { net, facts: &facts, stimulus: &stimulus };
        let prepared = match meter.prepare(&job, options) {
            Ok(prepared) => prepared,
            Err(EngineError::Refused(_)) => continue,
            Err(EngineError::Failed(why)) => panic!("{name}: {why}"),
        };
        let found = if rows.is_empty() {
            let effort = Effort { rows: 300, directed: 200, changes: 60 };
            let found = dearest(&*prepared, net, effort).expect("it runs");
            rows = found.rows;
            found.measured.step
        } else {
            // All machines have their worst case in about the same reaction.
            let dearest = Stimulus::of_rows(net, &rows);
            prepared.run(net, &dearest).expect("it runs").0.step
        };
        let ratio = bound.step as f64 / found as f64;
        let (at, way) = (machine.name, bound.way);
        println!(
            "{name}, {at}, {}: {} for {found} ({ratio:.2}), {way:?}",
            package.style, bound.step
        );
        assert!(bound.step >= found, "{name}, {}: {} < {found}", machine.name, bound.step);
        assert!(ratio <= most, "{name}, {}: {} for {found}", machine.name, bound.step);
        bounds.push((machine.name, bound));
    }
    bounds
}

/// The meters whose tools are available; in CI all must be.
fn meters() -> Vec<Box<dyn Meter>> {
    let all = meters_here();
    for name in ["avr", "cortex-m3"] {
        if !all.iter().any(|meter| meter.machine() == name) {
            let is_ci = std::env::var_os("CI").is_some();
            assert!(!is_ci, "the tools for {name} are missing, and CI must have them");
            println!("skipped: the tools for {name} are not here");
        }
    }
    all
}

#[test]
fn no_reaction_is_above_its_bound() {
    for meter in meters() {
        let ratios: Vec<f64> = (0..rounds(4, 100))
            .filter_map(|seed| {
                let net = random_net(seed, &Features::everything());
                on_machine(&*meter, &format!("seed {seed}"), &net, &options(seed), 100)
            })
            .collect();
        assert!(ratios.len() >= 2);
    }
}

/// A search finds reactions that random rows do not.
#[test]
fn no_search_finds_a_reaction_above_its_bound() {
    let mut bounded = 0;
    for seed in 1000..1000 + rounds(4, 150) {
        let net = random_net(seed, &Features::everything().some(seed));
        let options = Options { gate: false, ..options(seed) };
        bounded += searched(&format!("seed {seed}"), &net, &options, f64::INFINITY).len();
    }
    assert!(bounded >= 4 || meters().is_empty());
}

/// Code before or around a reaction belongs to its bound: random charts with all features rarely have a gate.
#[test]
fn what_stands_before_a_reaction_is_bounded() {
    let net = grafsynth_tests::chart("a.graf", &ring(30, 10));
    let meters = meters();
    for (gate, safe_state) in [(true, false), (false, true), (true, true)] {
        let options = Options { io: Io::Words, gate, safe_state, ..Options::default() };
        let package = emit(&net, &facts_of(&net), &options).expect("it is emitted");
        for machine in cost::MACHINES {
            cost::bound(&package, machine).expect("it is understood");
        }
        // A meter does not measure a scan that the gate ends.
        for meter in meters.iter().filter(|_| !gate) {
            on_machine(&**meter, "ring", &net, &options, 200).expect("it fits");
        }
    }
}

/// The stack is not visible beyond the painted area, so a chart that reaches the end of the area has no measured value.
#[test]
fn a_stack_deeper_than_what_is_watched_is_said() {
    let Some(meter) = meters().into_iter().find(|it| it.machine() == "cortex-m3") else { return };
    let text = |size: u32| {
        format!(
            "chart deep {{\n  input a\n  output R\n  initial step s {{ R; code c \"volatile char room[{size}]; for (long k = 0; k < {size}; ++k) {{ room[k] = 1; }}\" }}\n  s -> s when a\n}}"
        )
    };
    let run = |size| {
        let net = grafsynth_tests::chart("a.graf", &text(size));
        let facts = facts_of(&net);
        let stimulus = Stimulus::random(&net, 3, 1, 1);
        meter.run(&Job { net: &net, facts: &facts, stimulus: &stimulus }, &Options::default())
    };
    let stack = run(20_000).expect("it is measured").stack.expect("nothing of the user is called");
    assert!((20_000..21_000).contains(&stack), "{stack}");
    let Err(EngineError::Failed(why)) = run(40_000) else { panic!("it is not a measured value") };
    assert!(why.contains("bytes of stack or more"), "{why}");
}

/// For charts that reach their worst-case reaction in any long run, the bound is close to it.
#[test]
fn bounds_are_tight_on_cells_and_rings() {
    let Some(bash) = tools::find(&["bash"]) else {
        println!("skipped: bash is not here");
        return;
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for (words, style, io) in [
        (["scripts/cells", "100", ""], Style::Switch, Io::Words),
        (["scripts/rings", "par", "30"], Style::Switch, Io::Members),
        (["scripts/rings", "par", "30"], Style::Tables, Io::Words),
    ] {
        let words: Vec<&str> = words.into_iter().filter(|it| !it.is_empty()).collect();
        let run =
            tools::run(&bash, &words, &folder, b"", Duration::from_secs(20)).expect("it runs");
        assert!(run.is_success, "{}", run.stderr);
        let text = String::from_utf8_lossy(&run.stdout).into_owned();
        let net = grafsynth_tests::chart("a.graf", &text);
        let options = Options { style, io, ..Options::default() };
        let name = words.join(" ");
        for meter in meters() {
            let ratio = on_machine(&*meter, &name, &net, &options, 500).expect("it fits");
            assert!(ratio <= 2.5, "{name}: {ratio:.2}");
        }
    }
}

/// The proved depth bounds a chart that evolves until it is stable, in every style that supports it, and no reaction goes deeper.
#[test]
fn a_proved_depth_bounds_stable_charts() {
    let oven = include_str!("../../examples/microwave/oven.graf");
    let cascade = "chart cascade {
        evolution stable
        input a, b, c
        output R
        initial step s0  step s1 { R }  step s2  step s3 { R }  step s4
        s0 -> s1 when a   s1 -> s2 when b   s2 -> s3 when c   s3 -> s4 when not a   s4 -> s0 when not b
    }";
    for (name, text, styles, proved, most) in [
        ("oven", oven, &[Style::Switch, Style::Bits][..], 8, 3.5),
        ("cascade", cascade, &[Style::Switch, Style::Bits][..], 4, 3.5),
    ] {
        let net = grafsynth_tests::chart("a.graf", text);
        let facts = facts_of(&net);
        for style in styles {
            let options = Options { style: *style, ..Options::default() };
            let package = emit(&net, &facts, &options).expect("it is emitted");
            let rounds = cost::rounds(&net, &facts).expect("it evolves");
            assert_eq!(rounds.proved.map(|it| it.0), Some(proved), "{name}");
            let unproved = emit(&net, &Facts::default(), &options);
            for machine in cost::MACHINES {
                let bound = cost::bound(&package, machine).expect("it is understood");
                let is_open = machine.is_bounded && bound.unbounded.is_some();
                assert!(!is_open, "{name}: {:?}", bound.unbounded);
                if let Ok(unproved) = &unproved {
                    let wide = cost::bound(unproved, machine).expect("it is understood");
                    assert!(wide.step >= bound.step, "{name}: {} {}", wide.step, bound.step);
                }
            }
            searched(name, &net, &options, most);
        }
    }
}

/// Each event is counted once, and only states that can fire: for these charts, the text alone allows ten to a thousand times the real worst case.
#[test]
fn each_event_counts_once() {
    let switch = |rules: &str| {
        format!(
            "chart c {{
                conflict inner-first
                {rules}
                event a1, a2, a3, a4, a5, a6, a7, a8, b1, b2, b3, b4, b5, b6, b7, b8
                output o
                initial state s  state m {{ o }}
                s -> m on a1, a2, a3, a4, a5, a6, a7, a8
                m -> s on b1, b2, b3, b4, b5, b6, b7, b8
            }}"
        )
    };
    let regions = "chart r {
        conflict inner-first
        queue 4
        event tick, n, back
        parallel p {
            state a { initial state a1  state a2  state a3 }
            state b { initial state b1  state b2  state b3 }
            state c { initial state c1  state c2  state c3 }
        }
        a1 -> a2 on tick do { raise n }  a2 -> a3 on tick  a3 -> a1 on n
        b1 -> b2 on tick  b2 -> b3 on n  b3 -> b1 on back
        c1 -> c2 on n  c2 -> c3 on tick  c3 -> c1 on back
    }";
    let charts = [
        ("16 events", switch(""), 3.0),
        ("16 events, one at a time", switch("events exclusive"), 3.0),
        // The model counts calls for functions that a compiler inlines into their only caller.
        ("regions", regions.to_owned(), 3.5),
    ];
    for (name, text, most) in &charts {
        let net = grafsynth_tests::chart("a.graf", text);
        let options = Options::default();
        for (machine, bound) in searched(name, &net, &options, *most) {
            // A scan runs as many reactions as the ring has entries, each with one event.
            let scan = bound.scan.expect("there are events").time;
            assert!(scan <= 16 * bound.step + 4000, "{name}, {machine}: {scan}");
        }
    }
    // If events come one at a time, a row does not contain all of them.
    let of = |text: &str| {
        let net = grafsynth_tests::chart("a.graf", text);
        let package = emit(&net, &facts_of(&net), &Options::default()).expect("it is emitted");
        cost::bound(&package, &cost::MACHINES[0]).expect("it is understood")
    };
    let (all, single) = (of(&charts[0].1), of(&charts[1].1));
    assert!(single.step * 3 < all.step, "{} {}", single.step, all.step);
    assert_eq!(all.scan, single.scan, "the ring passes one event at a time");
}

/// A large statechart, with too many instances to examine one by one, still has a bound.
#[test]
fn a_large_statechart_has_a_bound() {
    let chart = LargeChart::of_size(217).expect("it is one of them");
    let net = chart.net().expect("it is a chart");
    let package = emit(&net, &Facts::default(), &Options::default()).expect("it is emitted");
    for machine in cost::MACHINES.iter().filter(|machine| machine.is_bounded) {
        let bound = cost::bound(&package, machine).expect("it is understood");
        assert_eq!((bound.way, bound.unbounded), (cost::Way::Joined, None), "{}", machine.name);
    }
}

/// RAM is exact: instance, inputs, outputs and ring have the same size as in the compiled program, and a chart has no other
/// memory.
#[test]
fn ram_is_what_the_compiler_makes_of_it() {
    let avr = ("avr", "avr", &["-mmcu=atmega1284p", "-std=gnu99", "-Os"][..]);
    let arm =
        ("cortex-m3", "arm-none-eabi", &["-mcpu=cortex-m3", "-mthumb", "-std=c99", "-Os"][..]);
    for (name, triple, flags) in [avr, arm] {
        let tool = |end: &str| tools::find(&[format!("{triple}-{end}").as_str()]);
        let (Some(gcc), Some(nm), Some(size)) = (tool("gcc"), tool("nm"), tool("size")) else {
            assert!(
                std::env::var_os("CI").is_none(),
                "{triple}-gcc is missing, and CI must have it"
            );
            println!("skipped: {triple}-gcc is not here");
            continue;
        };
        let machine = cost::machine(name).expect("it is there");
        let mut compared = 0;
        for seed in 0..rounds(8, 100) {
            let net = random_net(seed, &Features::everything());
            let Ok(package) = emit(&net, &facts_of(&net), &options(seed)) else { continue };
            let bound = cost::bound(&package, machine).expect("it is understood");
            let folder = tempfile::tempdir().expect("a folder");
            for file in &package.files {
                std::fs::write(folder.path().join(&file.name), &file.text).expect("it is written");
            }
            let header = &package.files[0];
            let prefix = header.name.trim_end_matches(".h");
            let texts: String = package.files.iter().map(|file| file.text.as_str()).collect();
            let mut own = format!("#include \"{prefix}.h\"\n#include \"{prefix}_port.h\"\n");
            for end in ["t", "in_t", "out_t", "ring_t"] {
                if texts.contains(&format!("}} {prefix}_{end};")) {
                    own += &format!("char own_{end}[sizeof({prefix}_{end})];\n");
                }
            }
            std::fs::write(folder.path().join("own.c"), own).expect("it is written");
            let source = format!("{prefix}.c");
            let run = |program: &Path, arguments: &[&str]| {
                let run =
                    tools::run(program, arguments, folder.path(), b"", Duration::from_secs(60));
                let run = run.expect("it starts");
                assert!(run.is_success, "seed {seed}: {}", run.stderr);
                String::from_utf8_lossy(&run.stdout).into_owned()
            };
            for (from, to) in [("own.c", "own.o"), (source.as_str(), "chart.o")] {
                run(&gcc, &[flags, &["-fno-common", "-c", "-o", to, from]].concat());
            }
            let symbols = run(&nm, &["-S", "-t", "d", "own.o"]);
            let bytes = |end: &str| -> u64 {
                let name = format!("own_{end}");
                let line = symbols.lines().find(|line| line.ends_with(&format!(" {name}")));
                let size = line.and_then(|line| line.split_whitespace().nth(1));
                size.map_or(0, |size| size.parse().expect("a number"))
            };
            assert_eq!(bound.instance, bytes("t"), "seed {seed}, {name}");
            assert_eq!(bound.io, bytes("in_t") + bytes("out_t"), "seed {seed}, {name}");
            assert_eq!(bound.ring, bytes("ring_t"), "seed {seed}, {name}");
            let sections = run(&size, &["-A", "chart.o"]);
            for line in sections.lines() {
                let words: Vec<&str> = line.split_whitespace().collect();
                if let [".data" | ".bss", size, ..] = words[..] {
                    assert_eq!(size, "0", "seed {seed}, {name}: {line}");
                }
            }
            compared += 1;
        }
        assert!(compared >= 4, "{name}: {compared}");
    }
}

/// A task without a declared cost gets the cost that the model estimates. The estimate is never too low: the task makes the worst-case reaction more
/// expensive by at most its cost.
#[test]
fn a_task_takes_no_more_than_the_model_says() {
    let meters = meters();
    for body in [
        "sum := (sum + n / 7) mod 32749",
        "if n > 500 { sum := n * 3 - sum; m := m + 1 } else { sum := sum * n }",
        "m := m * m mod 1000; big := big * 17 + n; R := m > 500",
    ] {
        let chart = |task: &str| {
            format!(
                "chart work {{
                    conflict priority
                    input n: int 0..65535
                    output R
                    var sum: int 0..65535 = 0  var m: int 0..999 = 5  var big: int 0..2000000000 = 1
                    initial step s {{ budget 100000; {task} }}
                    s -> s when s.done restart
                }}"
            )
        };
        for meter in &meters {
            let machine = cost::machine(meter.machine()).expect("it is there");
            let (with, counted) = read_for(&chart(&format!("task t {{ {body} }}")), machine);
            let counted = counted.expect("the task declares no cost");
            assert_eq!((counted.machine.name, counted.costs.known.len()), (machine.name, 1));
            let model = u64::from(with.steps.values().next().expect("a step").tasks[0].cost);
            // The same chart with a task that changes nothing.
            let (without, counted) = read_for(&chart("task t cost 1 { sum := sum }"), machine);
            assert_eq!(counted, None);
            let dearest = |net: &Valid<Net>| {
                on_machine(&**meter, "task", net, &Options::default(), 300).expect("it fits");
                let stimulus = Stimulus::random(net, 300, 7, 3);
                let job = Job { net, facts: &facts_of(net), stimulus: &stimulus };
                meter.run(&job, &Options::default()).expect("it runs").step
            };
            let (with, without) = (dearest(&with), dearest(&without));
            println!("{}: {body}: {model} for {}", machine.name, with.saturating_sub(without));
            assert!(with > without, "{body} takes no time");
            assert!(model >= with - without, "{body}: {model} for {}", with - without);
            assert!(model <= 6 * (with - without), "{body}: {model} for {}", with - without);
        }
    }
}

/// Costs decide where a step halts, and so which of its variables are buffered. The costs include that, and a budget that is too small for one task
/// is an error.
#[test]
fn counted_costs_decide_where_a_step_halts() {
    let chart = |budget: u32| {
        format!(
            "chart work {{
                shared buffer sum
                input n: int 0..65535
                var sum: int 0..65535 = 0
                initial step s {{
                    budget {budget}
                    task a {{ sum := sum + n }}
                    task b {{ sum := sum mod 1000 }}
                    task c cost 7 {{ sum := sum + 1 }}
                }}
                initial step r  step q
                r -> q when sum = 3
            }}"
        )
    };
    let avr = cost::machine("avr").expect("it is there");
    let costs = |net: &Valid<Net>| -> Vec<u32> {
        net.steps.values().flat_map(|step| step.tasks.iter().map(|task| task.cost)).collect()
    };
    let (at_once, _) = read_for(&chart(60_000), avr);
    let (halting, _) = read_for(&chart(900), avr);
    let (few, more) = (costs(&at_once), costs(&halting));
    let first = |net: &Valid<Net>| net.steps.values().next().expect("a step").clone();
    assert_eq!((first(&at_once).chunks().len(), first(&halting).chunks().len()), (1, 2));
    assert!(more[0] > few[0], "the copy costs something: {few:?} {more:?}");
    assert_eq!((few[2], more[2]), (7, 7), "declared is declared");
    let m3 = cost::machine("cortex-m3").expect("it is there");
    let (other, _) = read_for(&chart(60_000), m3);
    assert!(costs(&other)[0] < few[0], "another machine, another cost");
    let found = read(&chart(20), Some(avr)).1;
    assert!(found.iter().any(|it| it.code.id == "G0224"), "{found:#?}");
    let found = read(&chart(20), None).1;
    assert_eq!(found.iter().filter(|it| it.code.id == "G0254").count(), 2, "{found:#?}");
}

/// Reads a chart for a machine.
fn read_for(text: &str, machine: &'static Machine) -> (Valid<Net>, Option<Counted>) {
    let (design, found) = read(text, Some(machine));
    let design = design.unwrap_or_else(|| panic!("{found:#?}"));
    (design.net, design.counted)
}

fn read(
    text: &str,
    machine: Option<&'static Machine>,
) -> (Option<NetDesign>, Vec<grafsynth_ir::Diagnostic>) {
    let mut sources = Sources::default();
    let main = sources.add("a.graf", text);
    let texts = Texts { main, machine, ..Texts::default() };
    match grafsynth_driver::read::read(&sources, &texts, ReadLimits::default()) {
        (Some(Design::Net(design)), found) => (Some(*design), found),
        (Some(Design::Logic(_)) | None, found) => (None, found),
    }
}

/// Rings of 10 by 3: on microcontrollers a jump is cheaper than a table row; on the host the opposite is true. If code size is optimised, the table
/// is best everywhere.
#[test]
fn the_style_follows_the_machine() {
    let text = ring(30, 10);
    let net = grafsynth_tests::chart("a.graf", &text);
    let facts = facts_of(&net);
    let taken = |machine: &str, goal: Goal| {
        let machine = cost::machine(machine);
        let options = Options { machine, goal, io: Io::Words, ..Options::default() };
        let package = emit(&net, &facts, &options).expect("it is emitted");
        let style = package.tried.iter().find(|it| it.is_taken).expect("one is").style;
        // The chosen style gives the same files if it is requested by name.
        let asked = Options { style, io: Io::Words, ..Options::default() };
        assert_eq!(package.files, emit(&net, &facts, &asked).expect("it is emitted").files);
        style
    };
    assert_eq!(taken("avr", Goal::Speed), Style::Switch);
    assert_eq!(taken("cortex-m3", Goal::Speed), Style::Switch);
    assert_eq!(taken("host", Goal::Speed), Style::Tables);
    assert_eq!(taken("avr", Goal::Size), Style::Tables);
    assert_eq!(taken("cortex-m3", Goal::Size), Style::Tables);
}

/// Rings of `size` steps, `n` steps in total, as `scripts/rings` writes them.
fn ring(n: usize, size: usize) -> String {
    let list = |letter: &str| (0..16).map(|k| format!("{letter}{k}")).join(", ");
    let mut text = format!(
        "chart ring {{\n evolution single\n conflict priority\n input {}\n output {}\n",
        list("i"),
        list("o")
    );
    for k in 0..n {
        let initial = if k % size == 0 { "initial " } else { "" };
        text += &format!(" {initial}step s{k} {{ o{} }}\n", k % 16);
    }
    for k in 0..n {
        let next = if (k + 1) % size == 0 { k + 1 - size } else { k + 1 };
        text += &format!(" s{k} -> s{next} when i{}\n", k % 16);
    }
    text + "}\n"
}
