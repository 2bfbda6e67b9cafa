//! The proof of charts that an engine interprets: the image is executed together with the C around it, and no image or C that differs is proved.

#![allow(clippy::print_stdout, reason = "tests report what they counted")]

use crate::c_mutations::{Change, changes, difference};
use grafsynth_backend_c::{Options, Package, Style, emit};
use grafsynth_driver::c_proof::prove_c;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, Policy};
use grafsynth_sim::Random;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, in_parallel, rounds, small_limits};
use grafsynth_verify::c_code::Induction;
use grafsynth_verify::{Limits, facts};

/// A timer, an array with a variable index, numbers that saturate, divisions and shifts.
const NUMBERS: &str = "chart numbers {
    tick 10 ms
    evolution single
    input up, down
    input by: int 1..3
    output q: int -20..20
    output late
    var n: int -20..20
    var m: int 0..255
    var i: int 0..2
    var a: int 0..9 [3]
    initial step s { entry { q := n } }
    step t { late if t.t > 5 s }
    s -> t when up and a[i] < 9 do { a[i] := a[i] + by; n := n + by; m := n / by + n mod by; i := i + 1 }
    t -> s when down after 1 s do { n := n - a[1]; m := (m shl 1) bxor (m shr 3); i := m mod 3 }
}
";

/// Two micro-steps follow each other, so the evolution is a loop of the byte code.
const STABLE: &str = "chart stable {
    evolution stable
    input a, b
    output q
    initial step s
    step t
    step u { q }
    s -> t when a
    t -> u when b
    u -> s when not a
}
";

/// Functions of the user: a condition, an action at an entry, one with arguments in a list under a condition, and a continuous one.
const CALLS: &str = "chart calls {
    evolution single
    input a
    output q
    extern condition level(): int 0..3
    extern condition ready()
    extern action beep()
    extern action note(int 0..9, on: bool)
    extern action hold(int 0..3)
    var x: int 0..9
    initial step s { q; hold(2) }
    step t {
        q
        entry { beep(); note(x, a) }
        exit { if x > 4 { note(x - 4, ready()) } beep() }
    }
    s -> t when a and level() > 1 do { x := x + level() }
    t -> s when not a or ready()
}
";

/// Regions, history, edges, an event that a list raises, and a condition that is called when first needed.
const STATES: &str = "chart states {
    conflict inner-first
    queue 2
    input a
    event e
    internal event f
    output q, r
    extern condition ready()
    extern action beep()
    var n: int 0..3
    initial state off
    state on {
        entry { beep() }
        history last -> slow
        initial state slow { q }
        state fast {
            entry { n := n + 1; raise f }
            r if n > 1
        }
        slow -> fast on e when ready()
        fast -> slow when rise(a) or n = 3 do { n := 0 }
    }
    off -> on on e
    on -> off on f when a
    off -> on.last when fall(a)
}
";

/// Two sends can be due in one reaction, so a loop that puts them in order comes before the evolution.
const SENDS: &str = "chart sends {
    conflict inner-first
    queue 4
    tick 10 ms
    event go, e, f
    output q
    initial state off
    state on {
        entry { send e after 30 ms }
        initial -> x do { send f after 20 ms }
        state x
        state y { q }
        x -> y on e
        y -> x on f
    }
    off -> on on go
    on -> off on go
}
";

fn emitted(net: &Valid<Net>) -> Option<Package> {
    emitted_with(net, Options::default())
}

fn emitted_with(net: &Valid<Net>, options: Options) -> Option<Package> {
    let options = Options { style: Style::Program, ..options };
    emit(net, &facts(net, &small_limits()), &options).ok()
}

fn read(net: &Valid<Net>, package: &Package) -> Result<Induction, String> {
    prove_c(net, &facts(net, &small_limits()), package, &Limits::default())
}

#[test]
fn byte_code_is_proved_as_a_proof_of_the_image() {
    for text in [NUMBERS, STABLE, CALLS, STATES, SENDS] {
        let net = chart("chart.graf", text);
        let package = emitted(&net).expect("the style supports it");
        let proved = read(&net, &package).unwrap_or_else(|why| panic!("{text}: {why}"));
        assert!(proved.is_of_image);
        let other = Options { style: Style::Bits, ..Options::default() };
        let other = emit(&net, &facts(&net, &small_limits()), &other).expect("it is emitted");
        assert!(!read(&net, &other).is_ok_and(|proved| proved.is_of_image));
    }
}

/// With a trace, byte code also reports each transition that fires and each micro-step.
#[test]
fn byte_code_that_reports_what_fires_is_proved() {
    let trace = Options { trace: Some(4), ..Options::default() };
    for text in [CALLS, STABLE, STATES] {
        let net = chart("chart.graf", text);
        let package = emitted_with(&net, trace.clone()).expect("the style supports it");
        let proved = read(&net, &package).unwrap_or_else(|why| panic!("{text}: {why}"));
        assert!(proved.is_of_image);
    }
}

/// A loop around the engine that serves it wrongly is not proved, whatever it changes.
#[test]
fn a_loop_that_does_something_else_is_not_proved() {
    let net = chart("chart.graf", CALLS);
    let package = emitted(&net).expect("the style supports it");
    for (from, to) in [
        ("while (wants != GP_DONE)", "while (wants > GP_ASK)"),
        ("while (wants != GP_DONE)", "while (wants <= GP_CALL)"),
        ("calls_ask(run->number, inputs);", "calls_ask((uint16_t)(run->number ^ 3U), inputs);"),
        ("calls_call(run);", "calls_call(run); run->at = 40U;"),
        ("calls_call(run);", "calls_call(run); run->depth = 1U;"),
        ("calls_call(run);", "calls_call(run); run->fault = run->at > 60U;"),
        ("calls_call(run);", "calls_call(run); run->rounds[0] = 1U;"),
        ("calls_call(run);", "if (run->stack[5] == 0) { calls_call(run); }"),
        ("calls_call(run);", "calls_call(run); return;"),
        ("calls_call(run);", "run->stack[0] = 1; calls_call(run);"),
        ("calls_call(run);", "calls_call(run); calls_call(run);"),
        ("calls_call(run);", "calls_call(run); run->bits[0] = 0U;"),
        ("calls_call(run);", "calls_call(run); run->cells = 44U;"),
        ("calls_call(run);", "calls_call(run); run->flags = run->bits;"),
        ("gp_begin(&run, false);", "gp_begin(&run, false); run.cells = 44U;"),
        ("gp_begin(&run, false);", "gp_begin(&run, false); run.depth = 1U;"),
    ] {
        let mut changed = package.clone();
        let is_c = |name: &str| name.ends_with(".c") && !name.starts_with("grafsynth_");
        let file =
            changed.files.iter_mut().find(|file| is_c(&file.name) && file.text.contains(from));
        let file = file.unwrap_or_else(|| panic!("no text has `{from}`"));
        file.text = file.text.replace(from, to);
        assert!(read(&net, &changed).is_err(), "{to}");
    }
}

/// The evolution of a statechart is a loop of the byte code, at which the reaction is cut.
#[test]
fn random_statecharts_as_byte_code_are_proved() {
    let seeds: Vec<u64> = (7..7 + rounds(16, 1_000)).collect();
    let policies = vec![Policy::InnerFirst, Policy::OuterFirst];
    let base = Features { policies, ..Features::everything() };
    let answers = in_parallel(&seeds, |seed| {
        let net = random_net(*seed, &base.some(*seed));
        let of = |style| {
            let options = Options { style, ..Options::default() };
            let package = emit(&net, &facts(&net, &small_limits()), &options).ok()?;
            Some(read(&net, &package))
        };
        let answers = [Style::Program, Style::Bits].map(of);
        println!("seed {seed}: {answers:?}");
        answers.map(|it| it.is_some_and(|it| it.is_ok()))
    });
    let count = |at: usize| answers.iter().filter(|it| it[at]).count();
    println!("{} of {}; as bits {}", count(0), answers.len(), count(1));
    assert!(count(0) * 8 >= count(1) * 7 && count(1) * 4 >= answers.len() * 3);
}

/// Random charts with all features are proved or stay open.
#[test]
fn most_random_byte_code_is_proved() {
    let base = Features::everything().without_statecharts();
    let seeds: Vec<u64> = (7..7 + rounds(16, 2_000)).collect();
    let answers = in_parallel(&seeds, |seed| {
        let net = random_net(*seed, &base.some(*seed));
        let answer = read(&net, &emitted(&net)?);
        if let Err(why) = &answer {
            println!("seed {seed}: {why}");
        }
        Some(answer.is_ok())
    });
    let answers: Vec<bool> = answers.into_iter().flatten().collect();
    let n_proved = answers.iter().filter(|it| **it).count();
    println!("{n_proved} of {} are proved", answers.len());
    assert!(n_proved == answers.len() && answers.len() * 4 >= seeds.len() * 3);
}

/// Changed bytes of images, and changed tokens of the C around them.
#[test]
fn no_mutant_of_an_image_that_differs_is_proved() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let subject = |text: &str| {
        let net = chart("chart.graf", text);
        let package = emitted(&net).expect("the style supports it");
        let is_of_chart = |change: &Change| {
            let name = &package.files[change.file].name;
            name.ends_with(".c") && !name.starts_with("grafsynth_")
        };
        let changes: Vec<Change> = changes(&package).into_iter().filter(is_of_chart).collect();
        (net, package, changes)
    };
    let subjects = [NUMBERS, STABLE, CALLS, STATES, SENDS].map(subject);
    let mut random = Random::new(5);
    let numbers = 0..rounds(60, 2_000) as usize;
    let mutants: Vec<_> = numbers
        .map(|at| {
            let subject = &subjects[at % subjects.len()];
            (subject, random.pick(&subject.2).expect("C has tokens").clone())
        })
        .collect();
    let proved = in_parallel(&mutants, |((net, package, _), change)| {
        let mut mutant = package.clone();
        mutant.files[change.file].text.replace_range(change.from..change.to, &change.with);
        let is_proved = read(net, &mutant).is_ok();
        if is_proved && let Some(why) = difference(net, &mutant) {
            panic!("proved, but different: {change:?}: {why}");
        }
        is_proved
    });
    let n_proved = proved.iter().filter(|it| **it).count();
    println!("{n_proved} of {} mutants are proved and equal", mutants.len());
    assert!(n_proved * 2 < mutants.len(), "most changes have an effect");
}
