//! Counterexamples: people see at most 20 rows, `--trace` writes all of them, and `sim` replays each file on the design that it belongs to.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A chart that toggles for a long time before the output `full` shows its number.
const LONG: &str = "chart long {
    input go
    output R
    mealy output full
    var n: int 0..40 = 0
    initial step a { full if n = 20 }
    step b { R; entry { n := n + 1 } }
    a -> b when go
    b -> a when not go
}
";

/// A chart whose reaction takes several clocks on a chip.
const STABLE: &str = "chart slow {
    evolution stable
    input go, stop
    output lit
    initial step off
    step mid
    step on { lit }
    off -> mid when go
    mid -> on
    on -> off when stop and not go
}
";

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grafsynth"));
    command.args(arguments).current_dir(folder).env("NO_COLOR", "1");
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("grafsynth starts")
}

fn put(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).expect("it is written");
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Replays a trace on the design that it belongs to: all its cells are as expected.
fn replays(folder: &Path, design: &str, trace: &str) {
    let output = run(folder, &["sim", design, "--stimulus", trace, "--trace", "again.csv"]);
    assert_eq!(output.status.code(), Some(0), "{design} {trace}: {}", stderr(&output));
    assert!(stderr(&output).contains("as expected"), "{}", stderr(&output));
    let (first, again) = (read(folder, trace), read(folder, "again.csv"));
    assert_eq!(first, again, "{design} {trace}");
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect("it was written")
}

/// The table after the first line that contains `start`: the lines that are indented by four blanks.
fn table(text: &str, start: &str) -> Vec<String> {
    let lines = text.lines().skip_while(|line| !line.contains(start)).skip(1);
    let lines = lines.skip_while(|line| !line.starts_with("    "));
    lines.take_while(|line| line.starts_with("    ")).map(str::to_owned).collect()
}

/// Checks the table of a long counterexample: a header, 20 rows with one gap, and a line with the names of the files.
fn is_short(table: &[String], wanted: &[&str]) {
    let text = table.join("\n");
    assert_eq!(table.len(), 1 + 20 + 1 + 1, "{text}");
    assert!(table[5].contains("... 20 rows"), "{text}");
    assert!(table[22].contains("20 of 40 rows are not shown; all are in "), "{text}");
    for wanted in wanted {
        assert!(text.contains(wanted), "no {wanted} in\n{text}");
    }
}

#[test]
fn each_of_two_charts_replays_its_trace() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    put(folder, "a.graf", LONG);
    let other = LONG.replace("n = 20", "n = 19").replace("input go", "input go, idle");
    put(folder, "b.graf", &other);
    for verb in ["compare", "diff"] {
        let trace = format!("{verb}.csv");
        let output = run(folder, &[verb, "a.graf", "b.graf", "--trace", &trace]);
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        let names = [trace.as_str(), &format!("{verb}-2.csv")];
        is_short(&table(&stdout(&output), "under the shortest"), &names);
        replays(folder, "a.graf", names[0]);
        replays(folder, "b.graf", names[1]);
        assert_eq!(read(folder, names[0]).lines().count(), 41, "a header and 40 rows");
    }
    // A part of the stimulus of the user, and other formats.
    let output = run(
        folder,
        &["compare", "b.graf", "a.graf", "--stimulus", "compare-2.csv", "--trace", "given.jsonl"],
    );
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    is_short(&table(&stdout(&output), "under this stimulus"), &["given.jsonl", "given-2.jsonl"]);
    assert_eq!(
        read(folder, "given.jsonl").lines().count(),
        read(folder, "given-2.jsonl").lines().count()
    );
    let output =
        run(folder, &["compare", "a.graf", "b.graf", "--random", "2000", "--trace", "r.csv"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    replays(folder, "a.graf", "r.csv");
    replays(folder, "b.graf", "r-2.csv");
}

#[test]
fn a_chart_and_logic_replay_their_traces() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    put(folder, "slow.graf", STABLE);
    let built = run(folder, &["build", "slow.graf", "-t", "verilog", "--busy", "always"]);
    assert_eq!(built.status.code(), Some(0), "{}", stderr(&built));
    let right = read(folder, "slow.v");
    let wrong = right.replace("assign lit = lit_q;", "assign lit = lit_q & ~stop;");
    assert_ne!(right, wrong);
    put(folder, "wrong.v", &wrong);
    for files in [["slow.graf", "wrong.v"], ["wrong.v", "slow.graf"]] {
        let output = run(folder, &["compare", files[0], files[1], "--trace", "slow.csv"]);
        let text = stdout(&output);
        assert_eq!(output.status.code(), Some(3), "{text}{}", stderr(&output));
        assert!(text.contains("lit: `1` in the chart, `0` in the logic"), "{text}");
        let table = table(&text, "different");
        assert!(table[0].ends_with("lit (chart)  lit (logic)"), "{text}");
        replays(folder, "slow.graf", "slow.csv");
        replays(folder, "wrong.v", "slow-2.csv");
        // A reaction of the circuit takes several clocks, each with its own row.
        let (rows, clocks) = (read(folder, "slow.csv"), read(folder, "slow-2.csv"));
        assert!(clocks.lines().count() > rows.lines().count(), "{rows}{clocks}");
    }
    let output = run(folder, &["compare", "slow.v", "wrong.v", "--trace", "logic.csv"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stdout(&output).contains("lit (first)  lit (second)"), "{}", stdout(&output));
    replays(folder, "slow.v", "logic.csv");
    replays(folder, "wrong.v", "logic-2.csv");
}

#[test]
fn a_trace_needs_a_known_format_before_anything_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    put(folder, "a.graf", LONG);
    for arguments in [
        &["compare", "a.graf", "--trace", "run.txt"][..],
        &["diff", "a.graf", "a.graf", "--trace", "run"],
        &["build", "a.graf", "-t", "net", "--trace", "run.c"],
        &["build", "a.graf", "-t", "c", "--trace", "9000"],
        &["sim", "a.graf", "--random", "5", "--save", "state.json", "--trace", "run.txt"],
    ] {
        let output = run(folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(stdout(&output).is_empty(), "{arguments:?}: {}", stdout(&output));
    }
    let names = fs::read_dir(folder).expect("the folder").count();
    assert_eq!(names, 1, "nothing was written");
}

#[test]
fn programs_get_each_row_and_the_names_of_the_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    put(folder, "a.graf", LONG);
    put(folder, "b.graf", &LONG.replace("n = 20", "n = 19"));
    let arguments = ["compare", "a.graf", "b.graf", "--trace", "t.csv", "--message-format", "json"];
    let output = run(folder, &arguments);
    let lines = stdout(&output);
    let answer = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"))
        .find(|line| line["status"] == "refuted")
        .expect("an answer");
    assert_eq!(answer["traces"], serde_json::json!(["t.csv", "t-2.csv"]));
    for member in ["witness", "witness_of_second"] {
        let witness = answer[member].as_str().expect("a stimulus");
        assert_eq!(witness.lines().count(), 40, "a header and 39 rows: {witness}");
    }
    replays(folder, "a.graf", "t.csv");
    replays(folder, "b.graf", "t-2.csv");
}

/// Runs grafsynth with a C compiler that changes one number in the emitted C; `None` if there is no compiler.
#[cfg(unix)]
fn with_wrong_c(folder: &Path, arguments: &[&str]) -> Option<Output> {
    use std::os::unix::fs::PermissionsExt as _;
    if Command::new("cc").arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: no C compiler");
        return None;
    }
    let script = folder.join("cc.sh");
    let text = "#!/bin/sh
for file in *.c
do sed -i 's/n == 20U/n == 19U/' \"$file\"
done
exec cc \"$@\"
";
    fs::write(&script, text).expect("a script");
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).expect("a program");
    put(folder, "a.graf", LONG);
    Some(command(folder, arguments).env("CC", &script).output().expect("grafsynth starts"))
}

#[cfg(unix)]
#[test]
fn engines_that_differ_show_the_difference_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    put(folder, "a.csv", &format!("dt,go\n{}", "1,1\n1,0\n".repeat(30)));
    let arguments = ["compare", "a.graf", "--stimulus", "a.csv", "--trace", "t.csv"];
    let arguments = [&arguments[..], &["--engines", "c,palasm,c:switch"]].concat();
    let Some(output) = with_wrong_c(folder, &arguments) else { return };
    let text = stdout(&output);
    assert_eq!(output.status.code(), Some(3), "{text}{}", stderr(&output));
    assert_eq!(text.matches("ir has `0`, c has `1`").count(), 1, "{text}");
    assert!(text.contains("full is declared at a.graf:4:5"), "{text}");
    assert!(text.contains("c:switch   DIFFERENT in the same way as c\n"), "{text}");
    assert!(text.contains("palasm     no difference\n"), "{text}");
    let table = table(&text, "is declared at");
    is_short(&table, &["full (ir)  full (c)", "t.csv (ir) and t-2.csv (c)"]);
    replays(folder, "a.graf", "t.csv");
    let again = run(folder, &["sim", "a.graf", "--stimulus", "t-2.csv", "--trace", "x.csv"]);
    assert_eq!(again.status.code(), Some(3));
    assert!(
        stderr(&again).contains("scan 39, full: expected `1`, found `0`"),
        "{}",
        stderr(&again)
    );
    assert!(!folder.join("t-3.csv").exists(), "the same difference has no further files");
}

#[cfg(unix)]
#[test]
fn a_refuted_output_shows_what_matters() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let arguments = ["build", "a.graf", "-t", "c,net", "--trace", "t.csv", "-o", "out"];
    let Some(output) = with_wrong_c(folder, &arguments) else { return };
    let text = stdout(&output);
    assert_eq!(output.status.code(), Some(3), "{text}{}", stderr(&output));
    assert!(!folder.join("out").exists(), "nothing is written");
    assert!(text.contains("full is `0` in the chart and `1` in C"), "{text}");
    let table = table(&text, "is declared at a.graf:4:5");
    is_short(&table, &["full (chart)  full (C)", "t.csv (chart) and t-2.csv (C)"]);
    replays(folder, "a.graf", "t.csv");
    let again = run(folder, &["sim", "a.graf", "--stimulus", "t-2.csv", "--trace", "x.csv"]);
    assert_eq!(again.status.code(), Some(3));
    assert!(
        stderr(&again).contains("scan 39, full: expected `1`, found `0`"),
        "{}",
        stderr(&again)
    );
    // Without `--trace`, the missing rows are counted; an output that is only tested is shown in the same way.
    let Some(output) = with_wrong_c(folder, &["build", "a.graf", "-t", "c"]) else { return };
    assert!(stdout(&output).contains("20 of 40 rows are not shown; --trace FILE writes all"));
    let Some(output) = with_wrong_c(folder, &["build", "a.graf", "-t", "c", "--no-proof"]) else {
        return;
    };
    let text = stdout(&output);
    assert!(text.contains("full (chart)  full (C)"), "{text}");
    assert!(text.lines().count() < 28, "{text}");
}
