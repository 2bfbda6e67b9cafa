//! Random nets on microcontrollers: the emitted C, cross-compiled and run in instruction simulators, compared with the reference simulator.
//!
//! Two of the three machines have a 16-bit `int`. A net that shows a difference is shrunk and printed; put it under `tests/cases/mismatch` after the
//! bug is fixed.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "the environment says which seeds to try")]

use grafsynth_backend_c::{Options, Style};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::{
    ArmEngine, Availability, AvrEngine, C8051Engine, Engine, EngineError, Job, Machine, Piece,
};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Stimulus, compare};
use grafsynth_tests::random_net::{random_net, shrink};
use grafsynth_tests::{chart, fleet, in_parallel, readable, rounds, small_limits};
use grafsynth_verify::structural_facts;

/// The number of charts in a firmware, if they fit.
const UNIT: usize = 8;
const ROWS: usize = 150;

fn is_here(engine: &dyn Engine) -> bool {
    match engine.availability() {
        Availability::Here => true,
        Availability::Missing(what) => {
            assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
            println!("skipped: {what} is not installed");
            false
        }
    }
}

/// The result of an engine for a net: false if the net does not fit the machine.
fn difference(engine: &dyn Engine, net: &Valid<Net>, seed: u64) -> Result<bool, String> {
    let facts = if net.settings.policy.is_statechart() {
        structural_facts(net)
    } else {
        grafsynth_verify::facts(net, &small_limits())
    };
    let stimulus = Stimulus::random(net, ROWS, seed, 3);
    match engine.run(&Job { net, facts: &facts, stimulus: &stimulus }) {
        Ok(got) => match compare(&net_trace(net, &stimulus), &got) {
            None => Ok(true),
            Some(found) => Err(format!("{found:?}")),
        },
        Err(EngineError::Refused(found)) if found.iter().all(|it| it.code.id == "G0604") => {
            Ok(false)
        }
        Err(EngineError::Refused(found)) => Err(format!("{found:?}")),
        Err(EngineError::Failed(why)) => Err(why),
    }
}

/// A chart with the facts, options and stimulus that it is run with.
struct Chart {
    seed: u64,
    net: Valid<Net>,
    facts: Facts,
    options: Options,
    stimulus: Stimulus,
}

impl Chart {
    /// A random chart with all policies, timers, ranges at the limits of 16 and 32 bits, calls and arrays, in one of the styles
    /// and with random options.
    fn random(seed: u64, max_steps: usize) -> Self {
        let styles = [Style::Auto, Style::Switch, Style::Tables, Style::Bits, Style::Engine];
        let style = styles[(seed % 5) as usize];
        let net = random_net(seed, &fleet::features(seed / 5, style, max_steps));
        // If a style does not support the chart, the best style is used.
        let (_, options) = fleet::emitted(&net, fleet::options(seed, style))
            .or_else(|_| fleet::emitted(&net, fleet::options(seed, Style::Auto)))
            .unwrap_or_else(|why| panic!("seed {seed}: {why}"));
        Self::of(seed, net, options)
    }

    fn of(seed: u64, net: Valid<Net>, options: Options) -> Self {
        let facts = fleet::small_facts(&net, options.style);
        let stimulus = fleet::stimulus(&net, seed, &options);
        Chart { seed, net, facts, options, stimulus }
    }

    fn piece(&self) -> Piece<'_> {
        let job = Job { net: &self.net, facts: &self.facts, stimulus: &self.stimulus };
        Piece { job, options: self.options.clone() }
    }
}

/// Runs charts in one firmware, or in several if they do not fit: returns how many ran, or the first that differs.
fn run(machine: &dyn Machine, charts: &[Chart]) -> Result<u64, (usize, String)> {
    let pieces: Vec<Piece<'_>> = charts.iter().map(Chart::piece).collect();
    match machine.run_all(&pieces) {
        Ok(traces) => {
            for (at, (chart, got)) in charts.iter().zip(&traces).enumerate() {
                if let Some(found) = compare(&net_trace(&chart.net, &chart.stimulus), got) {
                    return Err((at, format!("{found:?}")));
                }
            }
            Ok(charts.len() as u64)
        }
        Err(EngineError::Refused(found)) if found.iter().all(|it| it.code.id == "G0604") => {
            if charts.len() < 2 {
                return Ok(0);
            }
            let (left, right) = charts.split_at(charts.len() / 2);
            let n_left = run(machine, left)?;
            let n_right = run(machine, right).map_err(|(at, why)| (left.len() + at, why))?;
            Ok(n_left + n_right)
        }
        Err(EngineError::Refused(found)) => Err((0, format!("{found:?}"))),
        Err(EngineError::Failed(why)) => Err((0, why)),
    }
}

/// Checks the requested number of charts on this machine.
fn check(machine: &(dyn Machine + Sync), max_steps: usize) {
    if !is_here(machine) {
        return;
    }
    let first = std::env::var("GRAFSYNTH_FIRST").ok().and_then(|it| it.parse().ok()).unwrap_or(0);
    let wanted = rounds(2, 100);
    let (mut n_run, mut next) = (0, first);
    while n_run < wanted {
        assert!(next - first < 2 * wanted, "only {n_run} of {} fit into it", next - first);
        let seeds: Vec<u64> = (next..next + (wanted - n_run)).collect();
        next += seeds.len() as u64;
        let charts = in_parallel(&seeds, |seed| Chart::random(*seed, max_steps));
        let units: Vec<&[Chart]> = charts.chunks(UNIT).collect();
        for (unit, found) in units.iter().zip(in_parallel(&units, |unit| run(machine, unit))) {
            match found {
                Ok(n) => n_run += n,
                Err((at, why)) => {
                    // If a whole firmware stops, it does not report which chart caused this, so each chart is run alone.
                    let alone =
                        unit.iter().find(|it| run(machine, std::slice::from_ref(it)).is_err());
                    report(machine, alone.unwrap_or(&unit[at]), &why);
                }
            }
        }
    }
    println!("{}: {n_run} charts, {} did not fit", machine.name(), next - first - n_run);
}

/// Shrinks a chart that shows a difference.
fn report(machine: &dyn Machine, chart: &Chart, why: &str) {
    println!("{} seed {}: {why}", machine.name(), chart.seed);
    let again = |net: &Valid<Net>| {
        let (_, options) = fleet::emitted(net, chart.options.clone()).ok()?;
        let chart = Chart::of(chart.seed, net.clone(), options);
        run(machine, &[chart]).err()
    };
    let small = shrink(&chart.net, |net| again(net).is_some());
    panic!(
        "{} seed {}, {:?}: {why}\nshrunk: {:?}\n{}",
        machine.name(),
        chart.seed,
        chart.options,
        again(&small),
        readable(&small)
    );
}

/// Numbers of 16, 32 and 64 bits with every operator, including those that sdcc's library lacks.
#[test]
fn wide_arithmetic_is_exact_where_int_has_16_bits() {
    let net = chart(
        "wide.graf",
        "chart wide {
            conflict priority
            input a: int -40000..40000
            input b: int -300..70000
            input c: int 1..2000000000
            input d: int -9..-1
            input e: int -128..127
            var half: int -64..64 = 0
            var sum: int -32768..32767 = 0
            var product: int -2000000000..2000000000 = 0
            var quotient: int -2147483648..2147483647 = 0
            var rest: int -2000000000..2000000000 = 0
            var shorter: int -50000..50000 = 0
            var total: int -2000000000..2147483647 = 7
            output high, over, under
            initial step s {
                high if product / d > 60000 or total mod c = 7
                over if total * 4 + 8589934592 > 4294967296
                under if total * 4 - 8589934593 < -4294967296
            }
            step r { high if a * b * 3 < -1000000 and not (a - b >= 70000) }
            t1: s -> r when a + 1 > b do {
                sum := a + b; product := a * b; quotient := product * 1000 / d - a; rest := quotient mod c
            }
            t2: r -> s when true do {
                total := total + product * a; shorter := total / c mod d; half := e / -2; total := total * a / -77; rest := -rest mod 65536
            }
        }",
    );
    let machines: [Box<dyn Engine>; 3] = [
        Box::new(AvrEngine::default()),
        Box::new(ArmEngine::default()),
        Box::new(C8051Engine::default()),
    ];
    for engine in machines.iter().filter(|engine| is_here(engine.as_ref())) {
        let found = difference(engine.as_ref(), &net, 5);
        assert_eq!(found, Ok(true), "{}", engine.name());
    }
}

/// A chart that is too large is rejected with a code before anything runs.
#[test]
fn machines_refuse_what_does_not_fit() {
    let page = include_str!("../../docs/codes/G0604.md");
    let example = page.split("```").nth(1).and_then(|block| block.split_once('\n'));
    let net = chart("log.graf", example.expect("an example").1);
    let engine = AvrEngine::default();
    if is_here(&engine) {
        let stimulus = Stimulus::random(&net, 1, 1, 1);
        let facts = structural_facts(&net);
        match engine.run(&Job { net: &net, facts: &facts, stimulus: &stimulus }) {
            Err(EngineError::Refused(found)) => assert_eq!(found[0].code.id, "G0604"),
            other => panic!("{:?}", other.map(|trace| trace.to_csv().len())),
        }
    }
}

#[test]
fn an_avr_does_what_the_net_does() {
    check(&AvrEngine::default(), 12);
}

#[test]
fn a_cortex_m3_does_what_the_net_does() {
    check(&ArmEngine::default(), 12);
}

#[test]
fn an_8051_does_what_the_net_does() {
    // sdcc's time grows faster than the text of a function.
    check(&C8051Engine::default(), 7);
}
