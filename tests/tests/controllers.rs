//! Random nets on microcontrollers: the emitted C, cross-compiled and run instruction by instruction, against the reference simulator.
//!
//! Two of the three machines have an `int` of 16 bits. A net that shows a difference is shrunk and printed; put it under `tests/cases/mismatch` when it is
//! mended.

#![allow(clippy::print_stdout, reason = "tests say what they skip")]
#![allow(clippy::disallowed_methods, reason = "the environment says which seeds to try")]

use grafsynth_backend_c::{Options, Style};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::{
    ArmEngine, Availability, AvrEngine, C8051Engine, Engine, EngineError, Job,
};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Stimulus, compare};
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_tests::{chart, readable, rounds};
use grafsynth_verify::{Limits, structural_facts};

const ROWS: usize = 150;

fn is_here(engine: &dyn Engine) -> bool {
    match engine.availability() {
        Availability::Here => true,
        Availability::Missing(what) => {
            assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
            println!("skipped: {what} is not here");
            false
        }
    }
}

/// What an engine makes of a net: nothing where the machine is too small for it.
fn difference(engine: &dyn Engine, net: &Valid<Net>, seed: u64) -> Result<bool, String> {
    let limits = Limits { pairs: 20_000, states: 2_000, ..Limits::default() };
    let facts = if net.settings.policy.is_statechart() {
        structural_facts(net)
    } else {
        grafsynth_verify::facts(net, &limits)
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

/// All policies, timers, ranges across 16 bits, calls, arrays: each machine says what the net says. Of two styles, each net has one.
fn check(styles: [(Box<dyn Engine>, Style); 2], features: &Features) {
    if !is_here(styles[0].0.as_ref()) {
        return;
    }
    let first = std::env::var("GRAFSYNTH_FIRST").ok().and_then(|it| it.parse().ok()).unwrap_or(0);
    let total = rounds(2, 100);
    let mut n_run = 0;
    for seed in first..first + total {
        let (engine, style) = &styles[usize::from(seed % 3 == 2)];
        let net = random_net(seed, features);
        match difference(engine.as_ref(), &net, seed) {
            Ok(is_run) => n_run += u64::from(is_run),
            Err(why) => {
                println!("{} seed {seed}: {why}", engine.name());
                let small = shrink(&net, |net| difference(engine.as_ref(), net, seed).is_err());
                let again = difference(engine.as_ref(), &small, seed);
                panic!(
                    "{} seed {seed}, style {}: {why}\nshrunk: {again:?}\n{}",
                    engine.name(),
                    style.name(),
                    readable(&small)
                );
            }
        }
    }
    println!("{}: {n_run} of {total} nets", styles[0].0.name());
    assert!(n_run * 10 >= total * 9, "only {n_run} of {total} fit into the machine");
}

/// Numbers of 16, 32 and 64 bits through every operator, also those that sdcc's library does not have.
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
            output high
            initial step s { high if product / d > 60000 or total mod c = 7 }
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

/// What is too large is refused by name, with a code, before anything runs.
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

fn options(style: Style) -> Options {
    Options { style, ..Options::default() }
}

#[test]
fn an_avr_does_what_the_net_does() {
    check(
        [Style::Auto, Style::Bits].map(|style| {
            let engine = AvrEngine { options: options(style), ..AvrEngine::default() };
            (Box::new(engine) as Box<dyn Engine>, style)
        }),
        &Features::everything(),
    );
}

#[test]
fn a_cortex_m3_does_what_the_net_does() {
    check(
        [Style::Auto, Style::Bits].map(|style| {
            (Box::new(ArmEngine { options: options(style) }) as Box<dyn Engine>, style)
        }),
        &Features::everything(),
    );
}

#[test]
fn an_8051_does_what_the_net_does() {
    // sdcc's time grows faster than the text of a function.
    let features = Features { max_steps: 7, ..Features::everything() };
    check(
        [Style::Auto, Style::Bits].map(|style| {
            (Box::new(C8051Engine { options: options(style) }) as Box<dyn Engine>, style)
        }),
        &features,
    );
}
