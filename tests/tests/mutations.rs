//! The checks can fail: an emitted text with one change is refuted, or proved to be unchanged in behaviour.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::{Options, Package, Style};
use grafsynth_backend_pld::{Dialect, read, rebind};
use grafsynth_driver::pipeline;
use grafsynth_driver::read::{Design, ReadLimits, Texts};
use grafsynth_driver::report::Outcome;
use grafsynth_driver::source::Sources;
use grafsynth_engines::{exhaustive, tools};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_verify::equiv::{Verdict, equiv};
use grafsynth_verify::{Limits, OpenReason, facts};

const TRUCK: &str = include_str!("../../examples/truck/truck.graf");

fn truck() -> Valid<Net> {
    let mut sources = Sources::default();
    let main = sources.add("truck.graf", TRUCK);
    match grafsynth_driver::read::read(
        &sources,
        &Texts { main, ..Texts::default() },
        ReadLimits::default(),
    ) {
        (Some(Design::Net(design)), _) => design.net,
        (_, found) => panic!("the truck is a chart: {found:?}"),
    }
}

/// Each literal of the equations in turn, with its sign inverted.
fn flipped(text: &str) -> Vec<String> {
    let start = text.find("EQUATIONS").expect("a section of equations") + "EQUATIONS".len();
    let bytes = text.as_bytes();
    let mut all = Vec::new();
    let mut at = start;
    while at < bytes.len() {
        let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
        if !is_word(bytes[at]) {
            at += 1;
            continue;
        }
        let end = (at..bytes.len()).find(|place| !is_word(bytes[*place])).unwrap_or(bytes.len());
        // A comment is not a literal.
        let line = text[..at].rfind('\n').map_or(0, |place| place + 1);
        if !text[line..at].contains(';') {
            let is_negated = bytes[at - 1] == b'/';
            let (before, sign) =
                if is_negated { (&text[..at - 1], "") } else { (&text[..at], "/") };
            all.push(format!("{before}{sign}{}", &text[at..]));
        }
        at = end;
    }
    all
}

#[test]
fn each_flipped_literal_of_the_trucks_equations_is_refuted_or_changes_nothing() {
    let net = truck();
    let facts = facts(&net, &Limits::default());
    let logic = pipeline::logic(&net, &facts).expect("the truck is a circuit");
    for dialect in [Dialect::Palasm] {
        let emitted =
            grafsynth_backend_pld::emit(&logic, dialect, &pipeline::emit_options(&net, None, None))
                .expect("the truck can be written");
        let mutants = flipped(&emitted.text);
        assert!(mutants.len() > 20, "{} literals", mutants.len());
        let (mut n_refuted, mut n_refused, mut n_same) = (0, 0, 0);
        for mutant in &mutants {
            let (back, found) = read(dialect, FileId(0), mutant);
            let Some(mut back) = back.filter(|_| !any_error(&found)) else {
                n_refused += 1;
                continue;
            };
            // A flipped left side changes the polarity of the register: the parser then assigns it another power-up value.
            if any_error(&rebind(&mut back, &emitted)) {
                n_refused += 1;
                continue;
            }
            match equiv(&net, &facts, &back, &Limits::default()) {
                Verdict::Refuted(_) => n_refuted += 1,
                Verdict::Proved(_) => n_same += 1,
                Verdict::Open(why) => panic!("the truck is small enough: {why}\n{mutant}"),
            }
        }
        println!(
            "{}: {} flips: {n_refuted} refuted, {n_refused} refused by the reader, {n_same} proved to change nothing",
            dialect.name(),
            mutants.len()
        );
        // Don't-cares of the truck: situations with more or less than one step, and both limits closed at once.
        assert!(n_refuted + n_refused > n_same, "most flips change something");
    }
}

#[test]
fn each_deleted_line_of_the_trucks_step_function_is_refuted_or_changes_nothing() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI must have a C compiler");
        println!("skipped: no C compiler is installed");
        return;
    }
    let net = truck();
    let facts = facts(&net, &Limits::default());
    for style in [Style::Switch, Style::Bits] {
        let options = Options { style, ..Options::default() };
        let package = grafsynth_backend_c::emit(&net, &facts, &options)
            .expect("the truck can be expressed in C");
        let file = package.files.iter().position(|file| file.name == "truck.c").expect("truck.c");
        let text = package.files[file].text.clone();
        let lines: Vec<&str> = text.lines().collect();
        let from = lines
            .iter()
            .position(|line| line.starts_with("void truck_step("))
            .expect("the step function");
        let (mut n_refuted, mut n_uncompiled, mut n_same) = (0, 0, 0);
        for at in from + 2..lines.len() {
            if lines[at].trim().is_empty() {
                continue;
            }
            let mut mutant: Package = package.clone();
            mutant.files[file].text = lines
                .iter()
                .enumerate()
                .filter(|(place, _)| *place != at)
                .map(|(_, line)| format!("{line}\n"))
                .collect();
            match exhaustive::check(
                "truck.c",
                &net,
                &mutant,
                &Limits::default(),
                Err(OpenReason::Method("only the enumeration is tested".to_owned())),
            ) {
                Err(exhaustive::Refused(_)) => n_uncompiled += 1,
                Ok(line) => match line.outcome() {
                    Outcome::Refuted => n_refuted += 1,
                    Outcome::Proved => n_same += 1,
                    Outcome::Open | Outcome::NotChecked => panic!("{}: {line}", lines[at]),
                },
            }
        }
        println!(
            "{}: {n_refuted} refuted, {n_uncompiled} do not compile, {n_same} proved to change nothing",
            style.name()
        );
        assert!(n_refuted > 0);
    }
}
