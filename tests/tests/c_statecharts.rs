//! The proof of emitted C of statecharts: it covers most charts, agrees with compiled execution on random ones, and never proves a text that differs.

#![allow(clippy::print_stdout, reason = "tests report what they counted")]

use crate::c_mutations::{changes, difference};
use crate::c_reader::charts;
use grafsynth_backend_c::{Options, Package, Style, emit};
use grafsynth_driver::c_proof::prove_c;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, Policy};
use grafsynth_sim::Random;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, in_parallel, readable, rounds, small_limits};
use grafsynth_verify::{Limits, facts};

/// The styles whose evolution is a loop of checks: one state variable for each region, and one bit for each state.
const STYLES: [Style; 2] = [Style::Switch, Style::Bits];

fn emitted(net: &Valid<Net>, style: Style) -> Option<Package> {
    let options = Options { style, prefix: Some("own".to_owned()), ..Options::default() };
    let package = emit(net, &facts(net, &small_limits()), &options).ok()?;
    ["statechart", "bits"].contains(&package.style).then_some(package)
}

fn proved(net: &Valid<Net>, package: &Package) -> Result<(), String> {
    prove_c(net, &facts(net, &small_limits()), package, &Limits::default()).map(|_| ())
}

/// A lift whose queue holds fewer events than a row can have.
const LIFT: &str = "chart lift {
    tick 100 ms
    conflict inner-first
    queue 3
    event call, cab, at, shut
    input light
    output open, up, lamp
    var n: int 0..9
    parallel both {
        region drive {
            history last -> low
            initial state low { exit { n := n + 1 } }
            state door { open if light
                initial state wide
                state narrow { entry { raise shut } }
                wide -> narrow after 3 s }
            state going { up }
            low -> door on call
            door -> low on shut
            low -> going on cab when n < 7
            going -> last on at
        }
        region request {
            initial state off
            state on { lamp }
            off -> on on call, cab
            on -> off on at when door.active
            on -> off when fall(light)
        }
    }
}
";

/// Delayed and undelayed sends, a chart that ends, and a loop over a counter.
const SENDS: &str = "chart sends {
    tick 10 ms
    conflict outer-first
    queue 2
    event go, halt
    event ring, again
    output bell, idle
    var n: int 0..20
    initial state wait { idle; entry { n := 0 } }
    state ringing { bell
        entry { send ring after 300 ms as ring; send again after 200 ms }
        exit { cancel ring } }
    state counting
    final state end { bell }
    wait -> ringing on go
    ringing -> wait on ring
    ringing -> counting on again do { send go }
    counting -> counting when n < 9 do { n := n + 1 }
    counting -> wait on go when n >= 9
    counting -> end on halt
    wait -> end on halt
}
";

#[test]
fn charts_with_all_features_are_proved() {
    for (name, text) in [("lift.graf", LIFT), ("sends.graf", SENDS)] {
        let net = chart(name, text);
        for style in STYLES {
            let package = emitted(&net, style).expect("the style supports it");
            if let Err(why) = proved(&net, &package) {
                panic!("{name}: {why}\n{}", package.files[1].text);
            }
        }
    }
}

#[test]
fn all_statecharts_of_examples_and_cases_are_proved() {
    let mut charts = charts();
    charts.retain(|(_, net)| net.settings.policy.is_statechart());
    for style in STYLES {
        let answers = in_parallel(&charts, |(_, net)| {
            let package = emitted(net, style)?;
            Some(proved(net, &package))
        });
        let (mut n_all, mut n_proved) = (0, 0);
        for ((name, _), answer) in charts.iter().zip(answers) {
            let Some(answer) = answer else { continue };
            n_all += 1;
            match answer {
                Ok(()) => n_proved += 1,
                Err(why) => println!("{name}: {why}"),
            }
        }
        println!("{n_proved} of {n_all} statecharts are proved as {}", style.name());
        assert_eq!(n_proved, n_all, "{}", style.name());
    }
}

fn features() -> Features {
    Features {
        policies: vec![Policy::InnerFirst, Policy::OuterFirst],
        tasks: false,
        sharing: false,
        externs: false,
        unspecified: false,
        max_steps: rounds(8, 14) as usize,
        ..Features::everything()
    }
}

/// A proof and compiled execution never disagree.
#[test]
fn proofs_of_random_statecharts_agree_with_compiled_execution() {
    let seeds: Vec<u64> = (0..rounds(12, 2_000)).collect();
    let has_compiler = tools::c_compiler().is_some();
    let answers = in_parallel(&seeds, |seed| {
        let net = random_net(*seed, &features().some(*seed));
        let package = emitted(&net, STYLES[(*seed % 2) as usize])?;
        let answer = proved(&net, &package);
        if answer.is_ok() && has_compiler && seed % rounds(4, 1) == 0 {
            let found = difference(&net, &package);
            assert!(found.is_none(), "seed {seed}: {found:?}\n{}", readable(&net));
        }
        Some((*seed, answer))
    });
    let (mut n_all, mut n_proved) = (0, 0);
    for (seed, answer) in answers.into_iter().flatten() {
        n_all += 1;
        match answer {
            Ok(()) => n_proved += 1,
            Err(why) => println!("seed {seed}: {why}"),
        }
    }
    println!("{n_proved} of {n_all} random statecharts are proved");
    assert!(n_proved * 20 >= n_all * 19, "{n_proved} of {n_all}");
}

/// No mutant is proved unless it is equal.
#[test]
fn no_mutant_of_a_statechart_that_differs_is_proved() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let mut subjects: Vec<(Valid<Net>, Package)> = Vec::new();
    for (name, text) in [("lift.graf", LIFT), ("sends.graf", SENDS)] {
        let net = chart(name, text);
        for style in STYLES {
            let package = emitted(&net, style).expect("the style supports it");
            subjects.push((net.clone(), package));
        }
    }
    let mut random = Random::new(5);
    let mut mutants = Vec::new();
    for at in 0..rounds(16, 1_500) as usize {
        let (net, package) = &subjects[at % subjects.len()];
        let changes = changes(package);
        let change = random.pick(&changes).expect("C has tokens").clone();
        let mut mutant = package.clone();
        mutant.files[change.file].text.replace_range(change.from..change.to, &change.with);
        mutants.push((net, package, change, mutant));
    }
    let proved = in_parallel(&mutants, |(net, package, change, mutant)| {
        let is_proved = proved(net, mutant).is_ok();
        if is_proved && let Some(why) = difference(net, mutant) {
            let line = package.files[change.file].text[..change.from].matches('\n').count() + 1;
            panic!("proved, but different: line {line}, {change:?}: {why}");
        }
        is_proved
    });
    let n_proved = proved.iter().filter(|it| **it).count();
    println!("{n_proved} of {} mutants are proved and equal", mutants.len());
    assert!(n_proved * 2 < mutants.len(), "most changes have an effect");
}

/// The text with a change, which must apply.
fn changed(package: &Package, old: &str, new: &str) -> Package {
    let mut package = package.clone();
    let mut n = 0;
    for file in package.files.iter_mut().filter(|file| file.name == "own.c") {
        n += file.text.matches(old).count();
        file.text = file.text.replacen(old, new, 1);
    }
    assert!(n > 0, "`{old}` is not in the text:\n{}", package.files[1].text);
    package
}

#[test]
fn a_wrong_reset_or_a_wrong_loop_is_not_proved() {
    let net = chart("lift.graf", LIFT);
    let package = emitted(&net, Style::Switch).expect("the style supports it");
    for (old, new, why) in [
        ("self->fault = false;", "self->fault = true;", "after `own_init`"),
        ("self->external_length = 0;", "self->external_length = 1;", "after `own_init`"),
        ("self->internal_length = 0;", "", "is not set"),
        ("self->external[0] = 0;", "", "is not set"),
        (
            "self->drive = OWN_low;\n    self->request",
            "self->drive = OWN_going;\n    self->request",
            "after `own_init`",
        ),
        // The bound of the loop is exact, so it would end one check too early.
        ("uint8_t round = 0;", "uint8_t round = 1;", "the counter of the loop"),
        ("again = true;", "again = false;", "before the first check"),
        ("micro_steps = 0;", "micro_steps = 1;", ""),
    ] {
        let answer = proved(&net, &changed(&package, old, new));
        let Err(found) = answer else { panic!("proved: `{old}` becomes `{new}`") };
        assert!(found.contains(why), "`{old}` becomes `{new}`: {found}");
    }
}
