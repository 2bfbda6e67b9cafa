//! Every kind of project that `grafsynth new` writes builds and passes its own tests, and the tour of the README runs as printed.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const TOOL: &str = env!("CARGO_BIN_EXE_grafsynth");

/// Each kind, the contents of its folder after `make`, and the tools that `make` needs.
const KINDS: [(&str, &[&str], &[&str]); 6] = [
    ("grafcet", &["build/lamp.c", "build/lamp.jed", "build/lamp.report.md"], &["make", "cc"]),
    ("statechart", &["build/lamp.c", "build/lamp.v"], &["make", "cc"]),
    ("rules", &["build/lamp.c", "build/lamp.pds"], &["make", "cc"]),
    ("sfc", &["build/lamp.c", "build/lamp.v"], &["make", "cc"]),
    ("gal", &["build/lamp.jed", "build/lamp.report.md"], &["make"]),
    ("avr", &["build/lamp.c", "build/lamp.hex"], &["make", "cc", "avr-gcc"]),
];

fn is_here(tool: &str) -> bool {
    Command::new(tool).arg("--version").output().is_ok_and(|output| output.status.success())
}

fn text(output: &Output) -> String {
    format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

fn grafsynth(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(TOOL);
    command.args(arguments).current_dir(folder).env("NO_COLOR", "1");
    command.output().expect("grafsynth starts")
}

#[test]
fn each_kind_of_project_builds_and_passes_its_tests() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (kind, files, tools) in KINDS {
        if let Some(tool) = tools.iter().find(|tool| !is_here(tool)) {
            println!("skipped: new --kind {kind}: {tool} is not installed");
            continue;
        }
        let home = folder.path().join(kind);
        fs::create_dir(&home).expect("a folder");
        let made = grafsynth(&home, &["new", "lamp", "--kind", kind]);
        assert!(made.status.success(), "{kind}: {}", text(&made));
        for target in [None, Some("test")] {
            let mut make = Command::new("make");
            make.args(["-C", "lamp"]).args(target).current_dir(&home);
            let made = make.env("GRAFSYNTH", TOOL).output().expect("make starts");
            let said = text(&made);
            assert!(made.status.success(), "{kind}, make {target:?}:\n{said}");
            assert!(!said.contains("warning"), "{kind}, make {target:?}:\n{said}");
        }
        for file in files {
            assert!(home.join("lamp").join(file).exists(), "{kind}: {file} is missing");
        }
        let source = fs::read_dir(home.join("lamp")).expect("the project");
        for entry in source {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|extension| extension == "graf") {
                let path = path.to_string_lossy().into_owned();
                let formatted = grafsynth(&home, &["fmt", "--check", &path]);
                assert!(formatted.status.success(), "{kind}: {}", text(&formatted));
            }
        }
    }
}

/// Lines of the tour that need more than this test has, with the reason.
const NOT_RUN: [(&str, &str); 2] = [
    ("grafsynth trace", "needs a dump from a controller: cli/tests/traced.rs"),
    ("--engines c-avr", "needs simulators: scripts/acceptance"),
];

/// Runs each line of the tour of the README in order, in a folder with the files that the reader is supposed to have.
#[test]
fn the_tour_of_the_readme_runs_as_printed() {
    let readme = include_str!("../../README.md");
    let tour = readme.split_once("## A tour").expect("the README has a tour").1;
    let block = tour.split("```").nth(1).expect("a block of commands");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let old = "chart door {\n    input button\n    output open\n    initial step shut\n    step wide { open }\n    shut -> wide when button\n    wide -> shut when not button\n}\n";
    let new = old.replace("when not button", "when not button after 50 ms");
    let plant = include_str!("../../examples/gravel/gravel.st");
    for (name, text) in [
        ("old.graf", old),
        ("new.graf", &new),
        ("plant.st", plant),
        ("table.pla", ".i 2\n.o 1\n.ilb a b\n.ob y\n01 1\n10 1\n11 1\n.e\n"),
    ] {
        fs::write(folder.path().join(name), text).expect("it is written");
    }
    let drawn = grafsynth(folder.path(), &["convert", "plant.st", "plant.xml"]);
    assert!(drawn.status.success(), "{}", text(&drawn));
    let mut n_run = 0;
    for line in block.lines().filter(|line| !line.trim().is_empty()) {
        let command = line.split(" # ").next().unwrap_or_default().trim();
        let mut words = command.split_whitespace();
        assert_eq!(words.next(), Some("grafsynth"), "{line}");
        if NOT_RUN.iter().any(|(part, _)| command.contains(part)) {
            continue;
        }
        let arguments: Vec<&str> = words.collect();
        let output = grafsynth(folder.path(), &arguments);
        // `diff` ends with 3 because the files of the tour do differ.
        let expected = if arguments.first() == Some(&"diff") { 3 } else { 0 };
        assert_eq!(output.status.code(), Some(expected), "{command}:\n{}", text(&output));
        n_run += 1;
    }
    assert!(n_run >= 10, "{n_run} lines of the tour were run");
}
