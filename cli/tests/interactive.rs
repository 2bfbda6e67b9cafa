//! `sim --interactive` with commands on standard input: output, recording, exit codes.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests read files and start programs")]

use grafsynth_engines::tools;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);

const CHART: &str = "chart drill {
    tick 100 ms
    evolution stable
    input start, down
    input depth: int 0..9
    output motor, alarm
    var holes: int 0..99 = 0
    initial step idle
    step boring { motor }
    step done
    go: idle -> boring when start
    stop: boring -> done when down or boring.t >= 3 s do { holes := holes + 1 }
    again: done -> idle when not start and depth < 5
    initial step calm
    step hot { alarm }
    warn: calm -> hot when depth > 7
}
";

fn session(folder: &Path, arguments: &[&str], commands: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(["sim", "drill.graf"])
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("grafsynth starts");
    let mut input = child.stdin.take().expect("a pipe");
    // A program that ended reads no more.
    let _ = input.write_all(commands.as_bytes());
    drop(input);
    child.wait_with_output().expect("it ends")
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("drill.graf"), CHART).expect("it is written");
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn each_line_shows_the_chart_and_what_it_waits_for() {
    let folder = folder();
    let commands = "start\nreact\ndt 12; react\ndown\nmicro\nmicro\nmicro\nundo 2\nnext\nquit\n";
    let output = session(folder.path(), &["--interactive"], commands);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let shown = text(&output.stdout);
    let parts = [
        "drill: start\n",
        "go from idle waits for start\n",
        "go from idle fires next\n",
        "drill: reaction 1, time 100 ms\n  steps     boring calm*\n",
        "motor=1*",
        "stop from boring waits for down or boring.t >= 30",
        "12 ticks (1.2 s) before each reaction",
        "drill: reaction 2, time 1.3 s",
        "boring.t = 1.2 s, next threshold in 1.8 s",
        "micro-step 1 of 1\n  steps     boring, calm\n  fires     stop\n",
        "drill: reaction 3, time 2.5 s",
        "holes=1*",
        "drill: reaction 4, time 3.7 s",
        "drill: reaction 2, time 1.3 s",
        "drill: reaction 3, time 3.1 s",
    ];
    let mut rest = shown.as_str();
    for part in parts {
        let place = rest.find(part);
        rest = &rest[place.unwrap_or_else(|| panic!("no `{part}` in:\n{rest}\nof:\n{shown}"))..];
    }
}

#[test]
fn a_recording_replays_to_the_same_trace() {
    let folder = folder();
    let commands = "start; react 2\ndepth=8;react # hot\nundo\ndepth=3; next; start; react; undo; dt 0; react\nrestart\nstart;next;next\nrestart; start=1; depth=9; react 3; dt 40; next\n";
    let out =
        ["--interactive", "--record", "run.csv", "--trace", "trace.csv", "--save", "end.json"];
    let output = session(folder.path(), &out, commands);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("it was written");
    let recorded = read("trace.csv");
    assert_eq!(read("run.csv").lines().count(), 5);
    let replayed = session(folder.path(), &["--stimulus", "run.csv", "--save", "again.json"], "");
    assert_eq!(text(&replayed.stdout), recorded);
    assert_eq!(read("again.json"), read("end.json"));
    // A session that begins in a saved state is recorded from there.
    let out = [
        "--interactive",
        "--restore",
        "end.json",
        "--record",
        "more.csv",
        "--trace",
        "more-trace.csv",
    ];
    let output = session(folder.path(), &out, "start=0; depth=0; react 4\n");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let replayed = session(folder.path(), &["--stimulus", "more.csv", "--restore", "end.json"], "");
    assert_eq!(text(&replayed.stdout), read("more-trace.csv"));
}

#[test]
fn a_wrong_line_ends_a_script_and_nothing_is_written() {
    let folder = folder();
    let out = ["--interactive", "--record", "run.csv"];
    let output = session(folder.path(), &out, "start; react\n\nstart; reakt\nquit\n");
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(said.contains("error[G0516]") && said.contains("<commands>:3:8"), "{said}");
    assert!(said.contains("did you mean `react`?"), "{said}");
    assert!(!folder.path().join("run.csv").exists());
    // The wrong line ran in no part.
    assert_eq!(text(&output.stdout).matches("reaction 1,").count(), 1);
    let long = "a".repeat(70_000);
    assert_eq!(session(folder.path(), &["--interactive"], &long).status.code(), Some(1));
    let bytes = session(folder.path(), &["--interactive"], "\u{1b}[2J\u{202e}\n");
    assert_eq!(bytes.status.code(), Some(1));
    assert!(!text(&bytes.stdout).contains('\u{1b}'));
}

#[test]
fn a_short_name_of_two_inputs_is_explained() {
    let folder = folder();
    let one = |name: &str| {
        format!(
            "chart {name} {{\n input start\n output on\n initial step off\n step up {{ on }}\n off -> up when start\n up -> off when not start\n}}\n"
        )
    };
    fs::write(folder.path().join("drill.graf"), one("left") + &one("right")).expect("written");
    let output = session(folder.path(), &["--interactive"], "start; react\n");
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(said.contains("`start` is the short name of 2 different inputs"), "{said}");
    assert!(said.contains("write the full name: `left.start`, `right.start`"), "{said}");
}

#[test]
fn the_terminal_is_as_before_after_each_end() {
    let Some(python) = tools::find(&["python3"]) else {
        assert!(std::env::var_os("CI").is_none(), "python3 is missing, and CI must have it");
        println!("skipped: python3 is not installed");
        return;
    };
    let folder = folder();
    fs::write(folder.path().join("terminal.py"), include_str!("terminal.py")).expect("written");
    let arguments = ["terminal.py", env!("CARGO_BIN_EXE_grafsynth"), "drill.graf"];
    let done = tools::run(&python, &arguments, folder.path(), b"", LIMIT).expect("it runs");
    assert!(done.is_success, "{}", done.stderr);
    assert_eq!(
        text(&done.stdout),
        "q: exit code 0, recording, terminal as before\n\
         ctrl-d: exit code 0, recording, terminal as before\n\
         ctrl-c: SIGINT, no recording, terminal as before\n\
         term: SIGTERM, no recording, terminal as before\n"
    );
}

#[test]
fn options_that_a_session_cannot_have_are_refused() {
    let folder = folder();
    for options in [
        &["--interactive", "--engine", "jedec"][..],
        &["--interactive", "--random", "5"],
        &["--interactive", "--message-format", "json"],
        &["--record", "run.csv", "--random", "5"],
        &["--interactive", "--record", "run.csv", "--trace", "run.csv"],
    ] {
        assert_eq!(session(folder.path(), options, "").status.code(), Some(2), "{options:?}");
    }
}
