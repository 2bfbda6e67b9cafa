//! The static bounds of `grafsynth_backend_c::cost` against simulated machines: nothing that is measured is above its bound.

#![allow(clippy::print_stdout, reason = "tests say what they skip, and how tight the bounds are")]

use grafsynth_backend_c::cost::{self, Bound, Goal, Machine};
use grafsynth_backend_c::{Io, Options, Style, emit};
use grafsynth_engines::measure::{Measured, Meter, meters as meters_here};
use grafsynth_engines::{EngineError, Job, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_sim::Stimulus;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::rounds;
use grafsynth_verify::{Limits, facts};
use std::path::Path;
use std::time::Duration;

fn facts_of(net: &Valid<Net>) -> Facts {
    facts(net, &Limits { pairs: 20_000, states: 2_000, ..Limits::default() })
}

/// The styles and options in turn.
fn options(seed: u64) -> Options {
    let style = [Style::Auto, Style::Bits, Style::Switch, Style::Tables][(seed % 4) as usize];
    let io = if seed.is_multiple_of(3) { Io::Words } else { Io::Members };
    let trace = (seed % 7 == 3).then_some(8);
    let safe_state = seed % 5 == 2;
    Options { style, io, trace, safe_state, gate: seed % 7 == 5, ..Options::default() }
}

/// Every text that we emit is understood, on every machine: in all styles, with and without what can be asked for beside.
#[test]
fn every_random_chart_has_a_bound() {
    let mut bounded = 0;
    for seed in 0..rounds(40, 600) {
        let net = random_net(seed, &Features::everything());
        let facts = facts_of(&net);
        let Ok(package) = emit(&net, &facts, &options(seed)) else { continue };
        for machine in cost::MACHINES {
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
            // The path is what the bound is made of.
            let path: u64 = bound.path.iter().map(|place| place.time).sum();
            let call = u64::from(machine.call.time);
            assert_eq!(path + call, bound.step, "seed {seed}, {}", machine.name);
            bounded += 1;
        }
    }
    println!("{bounded} bounds");
    assert!(bounded >= 20);
}

/// The ratio of bound and measured on one chart; none where the chart is refused or the machine is too small.
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
    assert_eq!(measured.reactions, rows as u64, "{name}");
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

/// The meters whose tools are here; in CI all must be.
fn meters() -> Vec<Box<dyn Meter>> {
    let all = meters_here();
    for name in ["avr", "cortex-m3"] {
        if !all.iter().any(|meter| meter.machine() == name) {
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

/// On charts that reach their dearest reaction in any long enough run the bound is not far away from it.
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

/// A chart that evolves until it is stable is bounded by the depth that is proved, in every style that carries it, and no reaction goes deeper.
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
        ("oven", oven, &[Style::Switch, Style::Bits][..], 8, 20.0),
        ("cascade", cascade, &[Style::Switch, Style::Bits][..], 4, 8.0),
    ] {
        let net = grafsynth_tests::chart("a.graf", text);
        let facts = facts_of(&net);
        for style in styles {
            let options = Options { style: *style, ..Options::default() };
            let package = emit(&net, &facts, &options).expect("it is emitted");
            let rounds = package.rounds.clone().expect("it evolves");
            assert_eq!(rounds.proved.map(|it| it.0), Some(proved), "{name}");
            let unproved = emit(&net, &Facts::default(), &options);
            for machine in cost::MACHINES {
                let bound = cost::bound(&package, machine).expect("it is understood");
                if let Ok(unproved) = &unproved {
                    assert_eq!(unproved.rounds.as_ref().expect("it evolves").proved, None);
                    let wide = cost::bound(unproved, machine).expect("it is understood");
                    assert!(wide.step > bound.step, "{name}: {} {}", wide.step, bound.step);
                }
            }
            for meter in meters() {
                let ratio = on_machine(&*meter, name, &net, &options, 500).expect("it fits");
                assert!(ratio <= most, "{name}: {ratio:.2}");
            }
        }
    }
}

/// Rings of 10 by 3: on microcontrollers a jump is cheaper than a row of a table, on the host the other way round. Where text is to be small it is the table everywhere.
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
        // It is what the style gives that was asked for by name.
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

/// Rings of `size` steps, `n` steps in all, as `scripts/rings` writes them.
fn ring(n: usize, size: usize) -> String {
    let list =
        |letter: &str| (0..16).map(|k| format!("{letter}{k}")).collect::<Vec<_>>().join(", ");
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
