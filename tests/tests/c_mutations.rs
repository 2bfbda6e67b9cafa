//! The check of C can fail: emitted C with one change is refuted, equal to the chart, or not reported as proved.
//!
//! Each mutant that is not refuted is checked independently: it is compiled with an ordinary harness and compared with the simulator on stimuli from
//! reset, long random ones and directed ones.

#![allow(clippy::print_stdout, reason = "tests report what they skip and what they counted")]

use grafsynth_backend_c::{Options, Package, Style, harness};
use grafsynth_driver::c_proof::prove_c;
use grafsynth_driver::report::{Outcome, OutputReport};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::{c, exhaustive, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Directed, MAX_DT, Random, Start, Stimulus, compare};
use grafsynth_tests::{chart, in_parallel, rounds};
use grafsynth_verify::c_code::Induction;
use grafsynth_verify::{Limits, OpenReason, facts};
use std::time::Duration;

/// Realistic charts, and two small ones with the features that those lack.
const CHARTS: [(&str, &str); 10] = [
    ("truck.graf", include_str!("../../examples/truck/truck.graf")),
    ("oven.graf", include_str!("../../examples/microwave/oven.graf")),
    ("supervisor.scxml", include_str!("../../examples/supervisor/supervisor.scxml")),
    ("gravel.st", include_str!("../../examples/gravel/gravel.st")),
    ("drill.graf", include_str!("../../examples/drill/drill.graf")),
    ("arbiter.graf", include_str!("../../examples/arbiter/arbiter.graf")),
    ("filler.graf", include_str!("../../examples/bottle-filler/filler.graf")),
    ("history.graf", HISTORY),
    ("timed.graf", TIMED),
    ("follower.graf", include_str!("../../examples/line-follower/follower.graf")),
];

const HISTORY: &str = "chart history {
    conflict inner-first
    event go, back
    input dark
    var n: int 0..9
    output lamp
    initial state out
    state room {
        entry { if hall.active { n := 5 } }
        history last -> desk do { n := n + 2 }
        initial state desk
        state hall {
            lamp
            exit { if room.active { n := n + 1 } }
        }
        desk -> hall on go when dark
        hall -> desk on go when not dark
    }
    out -> last on go
    room -> out on back
}
";

/// A chart with two times and one threshold, which is missed if only small numbers of ticks are tried.
const TIMED: &str = "chart timed {
    tick 1 ms
    input hold
    output good, bad
    initial step s
    step early { good }
    step late { bad }
    s -> late when s.t >= 60 ms
    s -> early when s.t >= 5 ms and hold
    early -> s after 3 ms
    late -> s when hold
}
";

const STYLES: [Style; 6] =
    [Style::Switch, Style::Bits, Style::Engine, Style::Tables, Style::Program, Style::Btrans];
const LIMIT: Duration = Duration::from_secs(60);

/// A change of one token of one file.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    pub(crate) file: usize,
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) with: String,
}

struct Subject {
    name: &'static str,
    style: &'static str,
    net: Valid<Net>,
    facts: Facts,
    package: Package,
    changes: Vec<Change>,
}

/// The result for a mutant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    Uncompiled,
    Refuted,
    /// Proved, and the independent check shows no difference.
    Equal,
    /// Not proved, no difference in the test, and the independent check shows none.
    Tested,
    /// Not proved, and the independent check shows a difference.
    Missed,
}

#[test]
fn no_mutant_that_differs_is_called_proved() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI must have a C compiler");
        println!("skipped: no C compiler is installed");
        return;
    }
    let subjects = subjects();
    assert_ne!(subjects.len() % 7, 0, "otherwise some would never be used");
    let mut random = Random::new(1);
    let wanted = rounds(8, 1_000) as usize;
    // Charts and styles alternate; every pair occurs before any occurs twice.
    let mut mutants: Vec<(usize, Change)> = Vec::new();
    while mutants.len() < wanted {
        let turn = mutants.len() % subjects.len();
        let at = turn * 7 % subjects.len();
        let change = random.pick(&subjects[at].changes).expect("C has tokens");
        mutants.push((at, change.clone()));
    }
    let fates = in_parallel(&mutants, |(at, change)| fate(&subjects[*at], change));
    let count = |wanted: Fate| fates.iter().filter(|fate| **fate == wanted).count();
    println!(
        "{} mutants of {} texts: {} do not compile, {} refuted, {} proved and equal, {} tested and equal, {} tested and different",
        mutants.len(),
        subjects.len(),
        count(Fate::Uncompiled),
        count(Fate::Refuted),
        count(Fate::Equal),
        count(Fate::Tested),
        count(Fate::Missed)
    );
    for ((at, change), fate) in mutants.iter().zip(&fates) {
        if matches!(fate, Fate::Missed | Fate::Equal) {
            println!("{fate:?}: {}", shown(&subjects[*at], change));
        }
    }
    assert!(count(Fate::Refuted) * 2 > mutants.len(), "most changes have an effect");
    assert!(count(Fate::Missed) * 50 <= mutants.len(), "the test detects nearly all of them");
}

#[test]
fn a_run_that_survives_undefined_behaviour_is_no_proof() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI must have a C compiler");
        println!("skipped: no C compiler is installed");
        return;
    }
    let net = chart("follower.graf", include_str!("../../examples/line-follower/follower.graf"));
    let facts = facts(&net, &few());
    let options = Options { style: Style::Program, ..Options::default() };
    let mut package = grafsynth_backend_c::emit(&net, &facts, &options).expect("it is emitted");
    let check = |package: &Package| {
        let read = read(&net, &facts, package);
        exhaustive::check("follower.c", &net, package, &Limits::default(), read).expect("compiles")
    };
    assert_eq!(check(&package).outcome(), Outcome::Proved);

    // The loop that clears the values at a reset runs beyond them; what is behind them is used by nobody.
    let engine = package.files.iter_mut().find(|it| it.name == "grafsynth_program.c");
    let text = &mut engine.expect("the engine is a file of the package").text;
    let last = text.rfind("gs_u16(image, GP_AT_VALUES)").expect("the loop reads their number");
    text.replace_range(last.., &text[last..].replacen("GP_AT_VALUES", "GP_BODY", 1));
    let report = check(&package).to_string();
    assert!(
        report.contains("undefined behaviour: grafsynth_program.c:")
            || report.contains("undefined behaviour was not looked for"),
        "{report}"
    );
}

/// Limits that all charts except the gravel plant stay far below; the gravel plant exceeds even the usual limits.
fn few() -> Limits {
    Limits { pairs: 100_000, ..Limits::default() }
}

fn subjects() -> Vec<Subject> {
    let mut all = Vec::new();
    for (name, text) in CHARTS {
        let net = chart(name, text);
        let facts = facts(&net, &few());
        for style in STYLES {
            let options = Options { style, ..Options::default() };
            let Ok(package) = grafsynth_backend_c::emit(&net, &facts, &options) else { continue };
            let changes = changes(&package);
            all.push(Subject {
                name,
                style: style.name(),
                net: net.clone(),
                facts: facts.clone(),
                package,
                changes,
            });
        }
    }
    all
}

fn shown(subject: &Subject, change: &Change) -> String {
    let text = &subject.package.files[change.file].text;
    let line = text[..change.from].matches('\n').count();
    let old = text.lines().nth(line).unwrap_or_default().trim();
    format!(
        "{} as {}, line {}: `{old}`: `{}` becomes `{}`",
        subject.name,
        subject.style,
        line + 1,
        &text[change.from..change.to],
        change.with
    )
}

fn fate(subject: &Subject, change: &Change) -> Fate {
    let mut mutant = subject.package.clone();
    mutant.files[change.file].text.replace_range(change.from..change.to, &change.with);
    let net = &subject.net;
    let read = read(net, &subject.facts, &mutant);
    let report = match exhaustive::check(subject.name, net, &mutant, &Limits::default(), read) {
        Ok(report) => report,
        Err(exhaustive::Refused(_)) => return Fate::Uncompiled,
    };
    // A proof of the image says nothing about the engine.
    let is_engine = mutant.files[change.file].name.starts_with("grafsynth_");
    let is_image = report.to_string().contains("not part of the proof");
    match report.outcome() {
        Outcome::Refuted => Fate::Refuted,
        Outcome::Proved if is_engine && is_image => match difference(net, &mutant) {
            None => Fate::Tested,
            Some(_) => Fate::Missed,
        },
        Outcome::Proved => match difference(net, &mutant) {
            None => Fate::Equal,
            Some(why) => panic!("called proved: {}: {why}\n{report}", shown(subject, change)),
        },
        Outcome::Open | Outcome::NotChecked => {
            assert!(is_tested(&report), "{}: {report}", shown(subject, change));
            if difference(net, &mutant).is_some() { Fate::Missed } else { Fate::Tested }
        }
    }
}

/// The proof of the text by induction.
fn read(net: &Valid<Net>, facts: &Facts, package: &Package) -> Result<Induction, OpenReason> {
    prove_c(net, facts, package, &Limits::default()).map_err(OpenReason::Method)
}

fn is_tested(report: &OutputReport) -> bool {
    report.to_string().contains("tested: 10 000 reactions")
}

/// A difference between mutant and simulator that these stimuli show.
pub(crate) fn difference(net: &Valid<Net>, mutant: &Package) -> Option<String> {
    let program = match c::compile(mutant, &harness(net, mutant), &["-std=c99", "-O0"]) {
        Ok(program) => program,
        Err(why) => return Some(why.to_string()),
    };
    let mut stimuli: Vec<Stimulus> = [1, 3, 70, 2_000, 70_000]
        .into_iter()
        .map(|most| Stimulus::random(net, 1_000, u64::from(most), most))
        .collect();
    stimuli.extend(directed(net));
    stimuli.iter().find_map(|stimulus| {
        let input = c::lines(net, stimulus);
        let run =
            match tools::run(&program.path, &[], program.folder.path(), input.as_bytes(), LIMIT) {
                Ok(run) if run.is_success => run,
                Ok(run) => return Some(run.ending),
                Err(why) => return Some(why),
            };
        match c::parse(net, &run.stdout) {
            Err(why) => Some(format!("{why:?}")),
            Ok(got) => compare(&net_trace(net, stimulus), &got).map(|it| format!("{it:?}")),
        }
    })
}

/// Directed runs from reset, with random numbers other than those of the check.
fn directed(net: &Valid<Net>) -> Vec<Stimulus> {
    let mut stimuli = Vec::new();
    let mut directed = Directed::new(net, 77, MAX_DT);
    let mut last = Vec::new();
    for _ in 0..rounds(1_500, 4_000) {
        let Some(next) = directed.next() else { continue };
        if next.from != Start::Here && !last.is_empty() {
            stimuli.push(Stimulus::of_rows(net, &last));
        }
        last = directed.path();
    }
    stimuli
}

/// All changes of a package: in the bodies of functions and in tables.
pub(crate) fn changes(package: &Package) -> Vec<Change> {
    let mut all = Vec::new();
    for (file, text) in package.files.iter().enumerate() {
        let is_c = text.name.ends_with(".c") || text.name.ends_with(".h");
        if !is_c || text.keep_existing || text.name.ends_with("_port.h") {
            continue;
        }
        let tokens = tokens(&text.text);
        let word = |at: usize| tokens.get(at).map_or("", |(from, to)| &text.text[*from..*to]);
        let kinds: Vec<Option<String>> = (0..tokens.len())
            .map(|at| {
                kind(&[word(at.wrapping_sub(2)), word(at.wrapping_sub(1)), word(at), word(at + 1)])
            })
            .collect();
        for (at, (from, to)) in tokens.iter().enumerate() {
            let others = (1..tokens.len()).map(|step| (at + step) % tokens.len());
            let other =
                others.filter(|it| kinds[*it] == kinds[at]).map(word).find(|it| *it != word(at));
            let name = other.filter(|_| kinds[at].is_some());
            for with in replacements(word(at), name) {
                all.push(Change { file, from: *from, to: *to, with });
            }
        }
    }
    all
}

/// The kind of a name, if another name of that kind may replace it: a member of the same structure, or an enumerator. The parameters are the two
/// tokens before it, the name, and the token after it.
fn kind([structure, joint, name, after]: &[&str; 4]) -> Option<String> {
    let is_name = name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
    if !is_name || *after == "(" {
        return None;
    }
    if matches!(*joint, "->" | ".") {
        return Some((*structure).to_owned());
    }
    let is_constant =
        name.contains('_') && name.starts_with(|first: char| first.is_ascii_uppercase());
    is_constant.then(|| "constant".to_owned())
}

/// The replacements of a token.
fn replacements(token: &str, name: Option<&str>) -> Vec<String> {
    let pairs = [
        ("==", "!="),
        ("!=", "=="),
        ("<", "<="),
        ("<=", "<"),
        (">", ">="),
        (">=", ">"),
        ("&&", "||"),
        ("||", "&&"),
        ("+", "-"),
        ("-", "+"),
        ("*", "+"),
        ("/", "*"),
        ("%", "/"),
        ("&", "|"),
        ("|", "&"),
        ("^", "|"),
        ("<<", ">>"),
        (">>", "<<"),
        ("!", ""),
        ("~", ""),
        ("+=", "-="),
        ("-=", "+="),
        ("|=", "&="),
        ("&=", "|="),
        ("++", "--"),
        ("--", "++"),
        ("true", "false"),
        ("false", "true"),
        ("break", ""),
    ];
    if let Some((_, other)) = pairs.iter().find(|(from, _)| *from == token) {
        return vec![(*other).to_owned()];
    }
    let digits = token.trim_end_matches(['U', 'L', 'u', 'l']);
    let number = match digits.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).ok(),
        None => digits.parse::<i64>().ok(),
    };
    if let Some(number) = number {
        let suffix = &token[digits.len()..];
        let mut others = vec![format!("{}{suffix}", number + 1), format!("{}{suffix}", number ^ 2)];
        if number > 0 {
            others.push(format!("{}{suffix}", number - 1));
        }
        return others;
    }
    name.map(str::to_owned).into_iter().collect()
}

/// The ranges of the tokens within functions and tables; comments, strings and preprocessor lines are left out.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    const LONG: [&str; 17] = [
        "<<=", ">>=", "->", "==", "!=", "<=", ">=", "&&", "||", "<<", ">>", "+=", "-=", "|=", "&=",
        "++", "--",
    ];
    let mut all = Vec::new();
    let (mut at, mut is_inside, mut is_comment) = (0, false, false);
    for line in text.split_inclusive('\n') {
        let start = at;
        at += line.len();
        let begins = line.starts_with('{') || line.trim_end().ends_with("= {");
        if !is_inside && begins {
            is_inside = true;
            continue;
        }
        if line.starts_with('}') {
            is_inside = false;
        }
        if !is_inside || line.starts_with('#') {
            continue;
        }
        let mut place = 0;
        while place < line.len() {
            let rest = &line[place..];
            if is_comment {
                let end = rest.find("*/");
                is_comment = end.is_none();
                place = end.map_or(line.len(), |end| place + end + 2);
            } else if rest.starts_with("/*") {
                is_comment = true;
                place += 2;
            } else if let Some(string) = rest.strip_prefix('"') {
                place += string.find('"').map_or(rest.len(), |end| end + 2);
            } else {
                let first = rest.chars().next().unwrap_or(' ');
                let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
                let length = if is_word(first) {
                    rest.find(|c| !is_word(c)).unwrap_or(rest.len())
                } else {
                    let long = LONG.iter().find(|it| rest.starts_with(**it));
                    long.map_or(first.len_utf8(), |it| it.len())
                };
                if !first.is_whitespace() {
                    all.push((start + place, start + place + length));
                }
                place += length;
            }
        }
    }
    all
}
