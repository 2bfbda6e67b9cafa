//! The check of circuits can fail: emitted equations, Verilog, BLIF and fuse maps with one change are refuted, rejected, or equal to the chart.
//!
//! A mutant is read like logic from another source, as in `compare`. A mutant called proved is compared with the simulator on directed stimuli, from reset; mutants
//! in Verilog also run in Icarus Verilog, so that an error in our parser is detected.

#![allow(clippy::disallowed_methods, reason = "tests write files for other tools")]
#![allow(clippy::print_stdout, reason = "tests report what they skip and what they counted")]

use grafsynth_driver::judge::{self, Renames};
use grafsynth_driver::languages::Language;
use grafsynth_driver::pipeline::{self, BuildOptions};
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_driver::target::Target;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Directed, Random, Start, Stimulus};
use grafsynth_tests::{chart, in_parallel, rounds};
use grafsynth_verify::{Limits, Verdict};
use std::fs;
use std::process::Command;

/// Charts that a chip supports: moves, choices, conflicts, stored outputs, time, a shared timer, an emergency.
const CHARTS: [(&str, &str); 6] = [
    ("truck.graf", include_str!("../../examples/truck/truck.graf")),
    ("arbiter.graf", include_str!("../../examples/arbiter/arbiter.graf")),
    ("fig7.graf", include_str!("../../examples/conflict/fig7.graf")),
    ("corrected.rules", include_str!("../../examples/seed-rules/corrected.rules")),
    ("lamp.graf", LAMP),
    ("lights.graf", include_str!("../../examples/traffic-light/lights.graf")),
];

const LAMP: &str = "chart lamp {
    tick 10 ms
    conflict priority
    input go, stop, hot
    output motor, alarm
    var n: int 0..3
    emergency hot and stop
    initial step idle
    step running { motor }
    step cooling { alarm if not stop }
    idle -> running when rise(go) and n < 3 priority 1 do { n := n + 1 }
    running -> cooling when hot priority 1
    running -> idle when stop priority 2
    cooling -> idle after 50 ms
    idle -> cooling when n = 3 and stop priority 2 do { n := 0 }
}
";

/// Each language: its target, and its file extension.
const LANGUAGES: [(&str, &str); 6] = [
    ("palasm", "pds"),
    ("cupl", "pld"),
    ("galasm", "pld"),
    ("verilog", "v"),
    ("blif", "blif"),
    ("jedec", "jed"),
];

struct Subject {
    language: &'static str,
    file: String,
    net: Valid<Net>,
    text: String,
    /// The range of the text in which changes are made.
    body: std::ops::Range<usize>,
    /// A bench for Icarus Verilog, for texts in Verilog.
    bench: Option<String>,
}

/// The result for a mutant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// It is not a valid text of the language, or has other pins.
    Refused,
    Refuted,
    /// Proved, and no other check shows a difference.
    Equal,
    Open,
}

#[test]
fn no_circuit_that_differs_is_called_proved() {
    let subjects = subjects();
    for (language, _) in LANGUAGES {
        let of_it: Vec<&Subject> =
            subjects.iter().filter(|subject| subject.language == language).collect();
        assert!(of_it.len() > 1, "{language}: {} texts", of_it.len());
        let mut random = Random::new(1);
        let mutants: Vec<(&Subject, String)> = (0..rounds(40, 1_000) as usize)
            .map(|n| {
                let subject = of_it[n % of_it.len()];
                (subject, mutant(subject, &mut random))
            })
            .collect();
        let fates = in_parallel(&mutants, |(subject, text)| fate(subject, text));
        let count = |wanted: Fate| fates.iter().filter(|fate| **fate == wanted).count();
        println!(
            "{language}: {} mutants of {} texts: {} refused, {} refuted, {} proved and equal, {} open",
            mutants.len(),
            of_it.len(),
            count(Fate::Refused),
            count(Fate::Refuted),
            count(Fate::Equal),
            count(Fate::Open)
        );
        assert!(count(Fate::Refuted) * 6 > mutants.len(), "{language}: changes change something");
        assert!(count(Fate::Open) * 20 <= mutants.len(), "{language}: these charts are small");
    }
}

fn subjects() -> Vec<Subject> {
    let mut all = Vec::new();
    for (name, text) in CHARTS {
        let net = chart(name, text);
        let facts = pipeline::facts(&net, &Limits::default());
        let stimulus = Stimulus::random(&net, 400, 3, 1);
        for (language, extension) in LANGUAGES {
            let options = BuildOptions {
                stimulus: (language == "verilog").then(|| stimulus.clone()),
                dont_cares: true,
                ..BuildOptions::default()
            };
            let target = Target::named(language).expect("a target");
            let built = pipeline::build(&net, &facts, &[target], &options);
            if any_error(&built.found) {
                println!("{name} is no {language}: {}", built.found[0].message);
                continue;
            }
            let is_bench = |name: &str| name.ends_with("_tb.v");
            let file = built
                .files
                .iter()
                .find(|file| file.name.ends_with(extension) && !is_bench(&file.name))
                .expect("the text");
            let bench = built.files.iter().find(|file| is_bench(&file.name));
            all.push(Subject {
                language,
                file: file.name.clone(),
                net: net.clone(),
                body: body(language, &file.text),
                text: file.text.clone(),
                bench: bench.map(|bench| bench.text.clone()),
            });
        }
    }
    all
}

/// The part of a text that defines its functions.
fn body(language: &str, text: &str) -> std::ops::Range<usize> {
    let after = |word: &str| text.find(word).map_or(0, |at| at + word.len());
    let start = match language {
        "palasm" => after("EQUATIONS"),
        "verilog" => after(");"),
        "blif" => after(".outputs"),
        "jedec" => after("\nL"),
        // Equations follow the pins.
        _ => text.find(" = ").map_or(0, |at| text[..at].rfind('\n').unwrap_or(0)),
    };
    let end = match language {
        "palasm" => text.find("SIMULATION").unwrap_or(text.len()),
        "jedec" => text.rfind("\nC").unwrap_or(text.len()),
        "galasm" => text.find("DESCRIPTION").unwrap_or(text.len()),
        _ => text.len(),
    };
    start..end
}

/// The text with one random change.
fn mutant(subject: &Subject, random: &mut Random) -> String {
    let text = &subject.text;
    if subject.language == "jedec" {
        return with_other_fuse(text, random);
    }
    let tokens = tokens(text, subject.body.clone());
    let (from, to) = *random.pick(&tokens).expect("a body has tokens");
    let word = &text[from..to];
    let is_name = |word: &str| word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    let names: Vec<&str> =
        tokens.iter().map(|(from, to)| &text[*from..*to]).filter(|word| is_name(word)).collect();
    let other = match random.below(6) {
        // Removed, or repeated.
        0 => String::new(),
        1 => format!("{word} {word}"),
        // Negated.
        2 if is_name(word) => {
            let sign = match subject.language {
                "verilog" => "~",
                "cupl" => "!",
                _ => "/",
            };
            format!("{sign}{word}")
        }
        _ if is_name(word) => {
            random.pick(&names).map_or_else(String::new, |name| (*name).to_owned())
        }
        _ => match word {
            "*" => "+".to_owned(),
            "+" => "*".to_owned(),
            "&" => (if subject.language == "cupl" { "#" } else { "|" }).to_owned(),
            "#" | "|" => "&".to_owned(),
            "/" | "!" | "~" => String::new(),
            number if number.contains(['0', '1']) => {
                let at: Vec<usize> = number.match_indices(['0', '1']).map(|(at, _)| at).collect();
                let at = *random.pick(&at).expect("a digit");
                let digit = if number[at..].starts_with('0') { "1" } else { "0" };
                let digit =
                    if subject.language == "blif" && random.below(3) == 0 { "-" } else { digit };
                format!("{}{digit}{}", &number[..at], &number[at + 1..])
            }
            _ => String::new(),
        },
    };
    format!("{}{other}{}", &text[..from], &text[to..])
}

/// Names, numbers and operators, without comments.
fn tokens(text: &str, body: std::ops::Range<usize>) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-';
    let mut all = Vec::new();
    let mut at = body.start;
    while at < body.end {
        let line_end = text[at..].find('\n').map_or(body.end, |n| at + n);
        let starts_comment = text[at..].starts_with("//")
            || bytes[at] == b';'
            || bytes[at] == b'#' && (at == 0 || bytes[at - 1] == b'\n');
        if starts_comment {
            at = line_end;
        } else if text[at..].starts_with("/*") {
            at = text[at..].find("*/").map_or(body.end, |n| at + n + 2);
        } else if is_word(bytes[at]) {
            let end = (at..body.end).find(|place| !is_word(bytes[*place])).unwrap_or(body.end);
            all.push((at, end));
            at = end;
        } else {
            if b"*+&|#/!~^".contains(&bytes[at]) {
                all.push((at, at + 1));
            }
            at += 1;
        }
    }
    all
}

/// The map with one fuse inverted, without the checksum of the fuses, and with the transmission checksum 0000, which disables it.
fn with_other_fuse(text: &str, random: &mut Random) -> String {
    let mut fuses = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        if let Some(rest) = line.strip_prefix('L')
            && let Some((_, bits)) = rest.split_once(' ')
        {
            let start = at + line.len() - bits.len();
            fuses.extend(
                bits.bytes()
                    .enumerate()
                    .filter(|(_, bit)| matches!(bit, b'0' | b'1'))
                    .map(|(n, _)| start + n),
            );
        }
        at += line.len();
    }
    let at = *random.pick(&fuses).expect("a fuse map has fuses");
    let other = if text.as_bytes()[at] == b'0' { "1" } else { "0" };
    let text = format!("{}{other}{}", &text[..at], &text[at + 1..]);
    let lines: Vec<&str> =
        text.split_inclusive('\n').filter(|line| !line.starts_with(['C', 'V'])).collect();
    let text = lines.concat();
    match text.find('\u{3}') {
        Some(end) => format!("{}\u{3}0000\n", &text[..end]),
        None => text,
    }
}

fn fate(subject: &Subject, text: &str) -> Fate {
    let mut sources = Sources::default();
    let main = sources.add(subject.file.as_str(), text);
    let language = Language::named(subject.language);
    let texts = Texts { main, language, ..Texts::default() };
    let (design, found) = read(&sources, &texts, ReadLimits::default());
    let Some(Design::Logic(design)) = design.filter(|_| !any_error(&found)) else {
        return Fate::Refused;
    };
    let Ok(circuit) = design.circuit() else { return Fate::Refused };
    let renames = Renames::default();
    let proof = judge::prove_with_net(&subject.net, circuit, &renames, &Limits::default());
    match proof {
        Err(_) => Fate::Refused,
        Ok(Verdict::Open(_)) => Fate::Open,
        Ok(Verdict::Refuted(_)) => Fate::Refuted,
        Ok(Verdict::Proved(_)) => {
            for stimulus in directed(&subject.net) {
                let tested = judge::with_net(&subject.net, circuit, &stimulus, &renames);
                let difference = tested.expect("it was bound for the proof").difference;
                assert_eq!(difference, None, "{} is called proved:\n{text}", subject.file);
            }
            if let Some(bench) = &subject.bench
                && let (Some(ours), Some(theirs)) = (rows(&subject.text, bench), rows(text, bench))
            {
                assert_eq!(
                    ours, theirs,
                    "Icarus shows a difference in a circuit that is reported as proved:\n{text}"
                );
            }
            Fate::Equal
        }
    }
}

/// Directed runs from reset, with random numbers other than those of the check.
fn directed(net: &Valid<Net>) -> Vec<Stimulus> {
    let mut stimuli = Vec::new();
    let mut directed = Directed::new(net, 77, 1);
    let mut last = Vec::new();
    for _ in 0..rounds(600, 2_000) {
        let Some(next) = directed.next() else { continue };
        if next.from != Start::Here && !last.is_empty() {
            stimuli.push(Stimulus::of_rows(net, &last));
        }
        last = directed.path();
    }
    stimuli
}

/// The outputs in each row of the bench; `None` if Icarus is not available, or does not accept the text.
fn rows(text: &str, bench: &str) -> Option<Vec<String>> {
    if tools::find(&["iverilog"]).is_none() {
        assert!(std::env::var_os("CI").is_none(), "CI must have Icarus Verilog");
        return None;
    }
    let folder = tempfile::tempdir().ok()?;
    let path = |name: &str| folder.path().join(name);
    fs::write(path("it.v"), text).ok()?;
    fs::write(path("tb.v"), bench).ok()?;
    let made = Command::new("iverilog")
        .args(["-g2001", "-o", "it.vvp", "it.v", "tb.v"])
        .current_dir(folder.path())
        .output()
        .ok()?;
    if !made.status.success() {
        return None;
    }
    let run =
        Command::new("vvp").args(["it.vvp", "+trace"]).current_dir(folder.path()).output().ok()?;
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    let rows = said.lines().filter_map(|line| line.strip_prefix("row "));
    // Lines of differences begin with the number of the row; flip-flops may have other codes.
    let rows = rows.filter(|line| !line.contains(':'));
    Some(rows.filter_map(|line| line.split(' ').next().map(str::to_owned)).collect())
}
