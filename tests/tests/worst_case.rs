//! The static bounds of `grafsynth_backend_c::cost` against simulated machines: nothing that is measured is above its bound.

#![allow(clippy::print_stdout, reason = "tests say what they skip, and how tight the bounds are")]

use grafsynth_backend_c::cost::{self, Bound, Machine};
use grafsynth_backend_c::{Io, Options, Style, emit};
use grafsynth_engines::measure::{AvrMeter, Measured};
use grafsynth_engines::{Availability, AvrEngine, Engine, EngineError, Job, tools};
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
    Options { style, io, trace, gate: seed % 7 == 5, ..Options::default() }
}

/// Every text that we emit is understood, on every machine: in all styles, with and without what can be asked for beside.
#[test]
fn every_random_chart_has_a_bound() {
    let mut bounded = 0;
    for seed in 0..rounds(40, 2_000) {
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

/// What one chart shows on an AVR; none where it is refused or the machine is too small.
fn on_avr(
    meter: &AvrMeter,
    name: &str,
    net: &Valid<Net>,
    options: &Options,
    rows: usize,
) -> Option<f64> {
    let machine: &Machine = cost::machine("avr").expect("it is there");
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
        "{name}, {}: step {} for {} ({ratio:.2}), init {} for {}, stack {} for {}, text about {} for {}",
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
    let is_within =
        bound.step >= measured.step && bound.init >= measured.init && bound.stack >= measured.stack;
    assert!(is_within, "{name}: measured {measured:?}, bound {bound:?}");
    Some(ratio)
}

fn is_skipped() -> bool {
    if let Availability::Missing(what) = AvrEngine::default().availability() {
        println!("skipped: {what} is not here");
        return true;
    }
    false
}

#[test]
fn no_reaction_on_an_avr_is_above_its_bound() {
    if is_skipped() {
        return;
    }
    let meter = AvrMeter::default();
    let ratios: Vec<f64> = (0..rounds(4, 100))
        .filter_map(|seed| {
            let net = random_net(seed, &Features::everything());
            on_avr(&meter, &format!("seed {seed}"), &net, &options(seed), 100)
        })
        .collect();
    assert!(ratios.len() >= 2);
}

/// On charts that reach their dearest reaction in any long enough run the bound is not far away from it.
#[test]
fn bounds_are_tight_on_cells_and_rings() {
    let Some(bash) = tools::find(&["bash"]).filter(|_| !is_skipped()) else { return };
    let meter = AvrMeter::default();
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
        let ratio = on_avr(&meter, &name, &net, &options, 1_000).expect("it fits");
        assert!(ratio <= 2.5, "{name}: {ratio:.2}");
    }
}
