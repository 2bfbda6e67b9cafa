//! The exit code of each verb in each situation, and a check that docs/exit-codes.md has the same table.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use crate::traced;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// The situations, in the order of the table.
const SITUATIONS: [&str; 12] = [
    "all is well",
    "the input is wrong",
    "the request is impossible",
    "an option is wrong",
    "a file cannot be read",
    "the output cannot be written",
    "refuted, or different",
    "open",
    "open, `--allow tested`",
    "a warning, `--deny warnings`",
    "a check not carried out, `--deny open`",
    "several of these",
];

/// The verbs, in the order of the table.
const VERBS: [&str; 17] = [
    "new",
    "check",
    "build",
    "split",
    "sim",
    "compare",
    "convert",
    "draw",
    "page",
    "minimise",
    "trace",
    "fmt",
    "diff",
    "explain",
    "doctor",
    "completions",
    "man",
];

/// Verb, situation, exit code, and the rest of the command line. A `>` at its end sends standard output to a full disk.
const CELLS: &[(&str, usize, i32, &str)] = &[
    ("new", 0, 0, "lamp"),
    ("new", 3, 2, "9lives"),
    ("new", 5, 2, "good.graf/lamp"),
    ("check", 0, 0, "good.graf"),
    ("check", 0, 0, "good.graf twin.graf"),
    ("check", 0, 0, "folder"),
    ("check", 1, 1, "bad.graf"),
    ("check", 1, 1, "good.graf --board bad.board"),
    ("check", 1, 1, "empty.graf"),
    ("check", 2, 1, "good.graf --certify -"),
    ("check", 2, 1, "impossible.graf"),
    ("check", 10, 4, "wide.graf --deny open"),
    ("check", 3, 2, "good.graf --proof-limit x"),
    ("check", 3, 2, "good.graf --entry main"),
    ("check", 4, 2, "missing.graf"),
    ("check", 5, 2, "good.graf >"),
    ("check", 6, 3, "refuted.graf"),
    ("check", 6, 3, "refuted.jed"),
    ("check", 7, 4, "open.graf"),
    ("check", 8, 0, "open.graf --allow tested"),
    ("check", 9, 1, "warned.graf --deny warnings"),
    ("check", 10, 4, "unasked.graf --deny open"),
    ("check", 11, 2, "refuted.graf missing.graf bad.graf open.graf"),
    ("check", 11, 1, "refuted.graf bad.graf open.graf"),
    ("check", 11, 3, "open.graf refuted.graf good.graf"),
    ("build", 0, 0, "good.graf --target verilog -o out"),
    ("build", 0, 0, "good.graf --target json -o out"),
    ("build", 0, 0, "wide.graf --target c -o out --no-proof"),
    ("build", 1, 1, "bad.graf --target verilog -o out"),
    ("build", 1, 1, "good.graf --target verilog --stimulus bad.csv -o out"),
    ("build", 2, 1, "impossible.graf --target verilog -o out"),
    ("build", 2, 1, "large.graf --target jedec --device gal16v8 -o out"),
    ("build", 3, 2, "good.graf --target pascal -o out"),
    ("build", 3, 2, "good.graf --target palasm --gate -o out"),
    ("build", 3, 2, "good.graf --target c --style fast -o out"),
    ("build", 3, 2, "good.graf --target jedec --device gal99v9 -o out"),
    ("build", 4, 2, "missing.graf --target c -o out"),
    ("build", 5, 2, "good.graf --target verilog -o good.graf/out"),
    ("build", 5, 2, "good.graf --target verilog -o out >"),
    ("build", 7, 4, "wide.graf --target c-engine -o out"),
    ("build", 8, 0, "wide.graf --target c-engine -o out --allow tested"),
    ("build", 9, 1, "warned.graf --target verilog -o out --deny warnings"),
    ("split", 0, 0, "good.graf --part chip=gal16v8 --part cpu=atmega328p -o out"),
    ("split", 1, 1, "bad.graf --part chip=gal16v8 --part cpu=atmega328p -o out"),
    ("split", 1, 1, "good.graf --with bad.split -o out"),
    ("split", 1, 1, "good.graf --with elsewhere.split -o out"),
    ("split", 1, 1, "good.graf --with devices.split -o out"),
    ("split", 2, 1, "impossible.graf --part chip=gal16v8 --part cpu=atmega328p -o out"),
    ("split", 2, 1, "states.graf --part chip=gal16v8 --part cpu=atmega328p -o out"),
    ("split", 3, 2, "good.graf --part chip=gal16v8 -o out"),
    ("split", 3, 2, "good.graf --part chip=gal16w8 --part cpu=atmega328p -o out"),
    (
        "split",
        3,
        2,
        "good.graf --part chip=gal16v8 --part cpu=atmega328p --place nobody=chip -o out",
    ),
    ("split", 4, 2, "missing.graf --part chip=gal16v8 --part cpu=atmega328p -o out"),
    ("split", 4, 2, "good.graf --with missing.split"),
    ("split", 5, 2, "good.graf --part chip=gal16v8 --part cpu=atmega328p -o good.graf/out"),
    ("sim", 0, 0, "good.graf --stimulus good.csv"),
    ("sim", 1, 1, "good.graf --stimulus bad.csv"),
    ("sim", 2, 1, "impossible.graf --random 3"),
    ("sim", 3, 2, "good.graf"),
    ("sim", 5, 2, "good.graf --stimulus good.csv --trace good.csv"),
    ("sim", 2, 1, "good.pld --stimulus good.csv --engine c"),
    ("sim", 3, 2, "good.graf --stimulus good.csv --engine warp"),
    ("sim", 4, 2, "good.graf --stimulus missing.csv"),
    ("sim", 5, 2, "good.graf --stimulus good.csv >"),
    ("sim", 6, 3, "good.graf --stimulus other_trace.csv"),
    ("sim", 6, 3, "good.graf --stimulus late_trace.csv"),
    ("sim", 9, 1, "warned.graf --stimulus good.csv --deny warnings"),
    ("compare", 0, 0, "good.graf twin.graf"),
    ("compare", 0, 0, "hard.graf hard_twin.graf --random 100"),
    ("compare", 0, 0, "good.graf --engines ir,netlist"),
    ("compare", 0, 0, "folder folder"),
    ("compare", 1, 1, "good.graf bad.graf"),
    ("compare", 1, 1, "good.graf twin.graf --stimulus bad.csv"),
    ("compare", 2, 1, "good.graf apart.graf"),
    ("compare", 2, 1, "good.graf impossible.graf"),
    ("compare", 2, 1, "never.graf always.graf"),
    ("compare", 3, 2, "good.graf twin.graf --rename Q=Q"),
    ("compare", 3, 2, "good.graf twin.graf --engines ir"),
    ("compare", 3, 2, "good.graf twin.graf --rename x"),
    ("compare", 4, 2, "good.graf missing.graf"),
    ("compare", 5, 2, "good.graf twin.graf >"),
    ("compare", 6, 3, "good.graf other.graf"),
    ("compare", 7, 4, "hard.graf hard_twin.graf"),
    ("compare", 8, 0, "hard.graf hard_twin.graf --allow tested"),
    ("compare", 9, 1, "good.graf warned.graf --deny warnings"),
    ("compare", 11, 3, "hard.graf hard_twin.graf hard_other.graf"),
    ("convert", 0, 0, "good.graf out/good.st"),
    ("convert", 1, 1, "bad.graf out/bad.st"),
    ("convert", 2, 1, "good.pld out/good.st"),
    ("convert", 3, 2, "good.graf out/good.st --to esperanto"),
    ("convert", 4, 2, "missing.graf out/good.st"),
    ("convert", 5, 2, "good.graf good.graf/good.st"),
    ("convert", 5, 2, "good.graf good.graf"),
    ("draw", 0, 0, "good.graf -o out/good.svg"),
    ("draw", 1, 1, "bad.graf -o out/bad.svg"),
    ("draw", 2, 1, "good.pld -o out/good.svg"),
    ("draw", 3, 2, "good.graf --chart nobody"),
    ("draw", 4, 2, "missing.graf -o out/good.svg"),
    ("draw", 5, 2, "good.graf -o good.graf/good.svg"),
    ("draw", 5, 2, "good.graf -o good.graf"),
    ("page", 0, 0, "good.graf -o out/good.html"),
    ("page", 1, 1, "bad.graf -o out/bad.html"),
    ("page", 2, 1, "good.pld -o out/good.html"),
    ("page", 3, 2, "good.graf --chart good"),
    ("page", 4, 2, "missing.graf -o out/good.html"),
    ("page", 5, 2, "good.graf -o good.graf/good.html"),
    ("page", 5, 2, "good.graf -o good.graf"),
    ("page", 9, 1, "warned.graf -o out/warned.html --deny warnings"),
    ("minimise", 0, 0, "good.pla"),
    ("minimise", 1, 1, "bad.pla"),
    ("minimise", 3, 2, "good.pla --budget 77"),
    ("minimise", 4, 2, "missing.pla"),
    ("minimise", 5, 2, "good.pla -o good.graf/small.pla"),
    (
        "trace",
        0,
        0,
        "dump.hex --chart ramp.graf --for avr --assert never(on.active@and@off.active)",
    ),
    ("trace", 1, 1, "bad.pla --chart ramp.graf"),
    ("trace", 2, 1, "dump.hex --chart good.graf"),
    ("trace", 3, 2, "dump.hex --chart ramp.graf --for abacus"),
    ("trace", 4, 2, "missing.hex --chart ramp.graf --for avr"),
    (
        "trace",
        5,
        2,
        "dump.hex --chart ramp.graf --for avr --assert never(on.active@and@off.active) >",
    ),
    (
        "trace",
        6,
        3,
        "damaged.hex --chart ramp.graf --for avr --assert never(on.active@and@off.active)",
    ),
    ("fmt", 0, 0, "neat.graf --check"),
    ("fmt", 1, 1, "bad.graf"),
    ("fmt", 1, 1, "ragged.graf --check"),
    ("fmt", 2, 1, "good.pla"),
    ("fmt", 3, 2, "good.graf --backwards"),
    ("fmt", 4, 2, "missing.graf"),
    ("diff", 0, 0, "good.graf good.graf"),
    ("diff", 1, 1, "good.graf bad.graf"),
    ("diff", 2, 1, "good.graf good.pld"),
    ("diff", 2, 1, "never.graf always.graf"),
    ("diff", 3, 2, "good.graf twin.graf --random x"),
    ("diff", 4, 2, "good.graf missing.graf"),
    ("diff", 5, 2, "good.graf other.graf >"),
    ("diff", 6, 3, "good.graf other.graf"),
    ("diff", 9, 1, "warned.graf warned.graf --deny warnings"),
    ("explain", 0, 0, "G0101"),
    ("explain", 3, 2, "G9999"),
    ("explain", 5, 2, "G0101 >"),
    ("doctor", 0, 0, ""),
    ("doctor", 5, 2, ">"),
    ("completions", 0, 0, "bash"),
    ("completions", 3, 2, "abacus"),
    ("completions", 5, 2, "bash >"),
    ("man", 0, 0, ""),
    ("man", 5, 2, ">"),
];

const GOOD: &str = "chart lamp {
    input a, b
    output Q
    initial step off
    step on { Q }
    off -> on when a and not b
    on -> off when b
    assert never (on.active and off.active)
}
";

/// A loop with more rounds than proofs unroll, and a number with too many values to enumerate.
fn hard(kept: &str, assert: &str) -> String {
    format!(
        "chart hard {{
    evolution stable limit 400
    input a
    input n: int 0..100000
    output Q
    var k: int 0..200
    var x: int 0..200000
    initial step s {{ Q }}
    step t
    s -> t when a do {{
        k := 0
        x := {kept}
    }}
    t -> t when k < 150 do {{ k := k + 1 }} restart
    t -> s when k >= 150 and not a
    {assert}
}}
"
    )
}

fn files(folder: &Path) {
    let put = |name: &str, text: &str| fs::write(folder.join(name), text).expect("it is written");
    fs::create_dir(folder.join("out")).expect("a folder");
    fs::create_dir(folder.join("folder")).expect("a folder");
    put("good.graf", GOOD);
    put("folder/good.graf", GOOD);
    put("neat.graf", GOOD);
    put("twin.graf", &GOOD.replace("a and not b", "not b and a"));
    put("other.graf", &GOOD.replace("a and not b", "a or b"));
    put("apart.graf", "chart c { input x output Y initial step s { Y if x } }\n");
    put("ragged.graf", "chart c {\ninput x output Y\n      initial step s { Y if x } }\n");
    put("bad.graf", "chart lamp { input a, output Q initial stop }\n");
    put("empty.graf", "");
    put("bad.board", "device gal22v10 { nonsense 77 }\n");
    put("refuted.graf", &GOOD.replace("(on.active and off.active)", "on.active"));
    put(
        "warned.graf",
        "chart lamp { input a, b output Q initial step off step on { Q } off -> on when a and b }\n",
    );
    put("open.graf", &hard("n + 1", "assert never x = 177777"));
    put("unasked.graf", &hard("n + 1", ""));
    put("hard.graf", &hard("n + 1", ""));
    put("hard_twin.graf", &hard("1 + n", ""));
    put("hard_other.graf", &hard("n + 2", ""));
    put("wide.graf", &hard("n", ""));
    let outputs: Vec<String> = (0..30).map(|n| format!("Q{n}")).collect();
    let steps: String = (0..30)
        .map(|n| format!("    step s{n} {{ Q{n} }}\n    s{n} -> s{} when a\n", (n + 1) % 30))
        .collect();
    let steps = steps.replacen("    step s0", "    initial step s0", 1);
    put(
        "states.graf",
        "chart oven {\n    conflict inner-first\n    event open\n    output light\n    initial step shut\n    final state ajar { light }\n    shut -> ajar on open\n}\n",
    );
    put(
        "large.graf",
        &format!("chart large {{\n    input a\n    output {}\n{steps}}}\n", outputs.join(", ")),
    );
    put("bad.split", "nonsense\n");
    put("elsewhere.split", "part chip = gal16v8\npart cpu = atmega328p\nplace nobody on chip\n");
    put("devices.split", "part chip = gal16w8\npart cpu = atmega328p\n");
    put("good.csv", "a,b\n1,0\n0,1\n");
    put("bad.csv", "a,b,c\n1,0\n7,x,y\n");
    put("late_trace.csv", "scan,a,b,Q\n0,0,0,0\n0,1,0,0\n");
    put("never.graf", &GOOD.replace("assert", "assume never a\n    assert"));
    put("always.graf", &GOOD.replace("assert", "assume always a\n    assert"));
    put(
        "wide.graf",
        "chart wide {\n    input a: int 0..60000\n    input b: int 0..60000\n    output q\n    initial step s\n    step t { q }\n    s -> t when a > b\n    t -> s when b > a\n}\n",
    );
    put(
        "impossible.graf",
        &GOOD.replace("assert", "assume never a\n    assume always a\n    assert"),
    );
    put("other_trace.csv", "scan,a,b,steps,Q\n0,0,0,off,0\n1,1,0,off,1\n");
    put("good.pla", ".i 2\n.o 1\n11 1\n10 1\n.e\n");
    put("bad.pla", ".i 2\n.o 1\n111 1\n");
    put(
        "good.pld",
        "Name good;\nDevice g22v10;\nPIN 2 = a;\nPIN 3 = b;\nPIN 23 = Q;\nQ = a & b;\n",
    );
}

fn run(folder: &Path, verb: &str, rest: &str) -> (Option<i32>, String) {
    let (rest, is_lost) = match rest.strip_suffix('>') {
        Some(rest) => (rest, true),
        None => (rest, false),
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_grafsynth"));
    command.arg(verb).args(rest.split_whitespace().map(|word| word.replace('@', " ")));
    command.current_dir(folder).env("NO_COLOR", "1").stdin(Stdio::null());
    if is_lost {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a full disk");
        command.stdout(full);
    }
    let output = command.output().expect("grafsynth starts");
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    (output.status.code(), said)
}

#[test]
fn each_verb_has_the_same_codes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    files(folder);
    assert_eq!(run(folder, "fmt", "neat.graf").0, Some(0));
    let has_compiler = traced::dump(folder);
    if has_compiler {
        let dump = fs::read_to_string(folder.join("dump.hex")).expect("the ring");
        // The first fired transition becomes one that was not enabled.
        let mut lines: Vec<&str> = dump.lines().collect();
        let (first, second) = (20, 26);
        for byte in 4..6 {
            lines.swap(first + byte, second + byte);
        }
        fs::write(folder.join("damaged.hex"), lines.join("\n")).expect("it is written");
    }
    // A fuse map whose fuses fail its test vectors.
    let (made, said) = run(folder, "build", "good.graf --target jedec --stimulus good.csv -o out");
    assert_eq!(made, Some(0), "{said}");
    let map = fs::read_to_string(folder.join("out/good.jed")).expect("the fuse map");
    fs::write(folder.join("refuted.jed"), spoiled(&map)).expect("it is written");
    let mut wrong = String::new();
    for (verb, situation, code, rest) in CELLS {
        let is_c = rest.contains("--target c") || *verb == "trace";
        if is_c && !has_compiler || rest.ends_with('>') && !Path::new("/dev/full").exists() {
            continue;
        }
        let (got, said) = run(folder, verb, rest);
        if got != Some(*code) {
            let situation = SITUATIONS[*situation];
            let _ =
                writeln!(wrong, "{verb} {rest} ({situation}): {got:?} instead of {code}\n{said}");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// The map with the first tested output of a vector inverted, and without checksums.
fn spoiled(map: &str) -> String {
    let mut is_done = false;
    let lines = map.lines().filter(|line| !line.starts_with('C')).map(|line| {
        if !is_done && line.starts_with('V') && line.contains(['H', 'L']) {
            is_done = true;
            let at = line.find(['H', 'L']).unwrap_or(0);
            let other = if line[at..].starts_with('H') { "L" } else { "H" };
            return format!("{}{other}{}", &line[..at], &line[at + 1..]);
        }
        line.to_owned()
    });
    let text: Vec<String> = lines.collect();
    // The checksum of the transmission after ETX is not checked if it is 0000.
    let text = text.join("\n");
    match text.find('\u{3}') {
        Some(end) => format!("{}\u{3}0000\n", &text[..end]),
        None => text,
    }
}

/// The output of a command that is interrupted during this task; it gets more time if it has not reached the task.
#[cfg(unix)]
fn interrupted(folder: &Path, arguments: &[&str], doing: &str) -> std::process::Output {
    let mut said = String::new();
    for wait in [1_500, 6_000, 20_000] {
        let child = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
            .args(arguments)
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("grafsynth starts");
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(killed.expect("kill starts").success());
        let output = child.wait_with_output().expect("it ends");
        said = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text)).concat();
        if said.contains(doing) {
            return output;
        }
    }
    panic!("`{doing}` is not in\n{said}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_verb_writes_nothing_and_ends_by_the_signal() {
    use std::os::unix::process::ExitStatusExt as _;
    let folder = tempfile::tempdir().expect("a temporary folder");
    files(folder.path());
    let doing = "stopped while comparing hard.graf and hard_twin.graf; nothing was written";
    // This many reactions take hours.
    let arguments = ["compare", "hard.graf", "hard_twin.graf", "--random", "1000000000"];
    let output = interrupted(folder.path(), &arguments, doing);
    assert_eq!(output.status.signal(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A user who interrupts a long `check` sees the findings from before the exploration.
#[cfg(unix)]
#[test]
fn an_interrupted_check_says_what_it_found() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let chart = "chart big {\n input a, unread\n output R\n var n: int 0..60000, m: int 0..60000\n initial step s { entry { n := (n + 1) mod 59997 } }\n step t { R; entry { m := (m * 7 + n) mod 59999 } }\n s -> t when a\n t -> s when not a\n assert never (n = 59998 and m = 17)\n}\n";
    fs::write(folder.path().join("big.graf"), chart).expect("it is written");
    for (format, wanted) in [("human", "input `unread` is never used"), ("json", "\"G0240\"")] {
        let arguments =
            ["check", "big.graf", "--proof-limit", "1000000000", "--message-format", format];
        let doing = "stopped while exploring the states of big";
        let output = interrupted(folder.path(), &arguments, doing);
        let said = if format == "json" { &output.stdout } else { &output.stderr };
        let said = String::from_utf8_lossy(said);
        assert_eq!(said.matches(wanted).count(), 1, "{said}");
    }
}

/// The table as Markdown.
fn table() -> String {
    let mut text = String::from("| |");
    for situation in SITUATIONS {
        let _ = write!(text, " {situation} |");
    }
    text.push_str("\n|---|");
    text.push_str(&"---|".repeat(SITUATIONS.len()));
    text.push('\n');
    for verb in VERBS {
        let _ = write!(text, "| `{verb}` |");
        for situation in 0..SITUATIONS.len() {
            let mut codes: Vec<String> = CELLS
                .iter()
                .filter(|(of, at, ..)| *of == verb && *at == situation)
                .map(|(_, _, code, _)| code.to_string())
                .collect();
            codes.dedup();
            let cell = if codes.is_empty() { "–".to_owned() } else { codes.join(", ") };
            let _ = write!(text, " {cell} |");
        }
        text.push('\n');
    }
    text
}

#[test]
fn the_page_has_the_same_table() {
    let page = include_str!("../../docs/exit-codes.md");
    let table = table();
    assert!(page.contains(&table), "docs/exit-codes.md does not contain this table:\n{table}");
}
