//! Every kind of project that `grafsynth new` writes builds and passes its own tests.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const TOOL: &str = env!("CARGO_BIN_EXE_grafsynth");

/// Each kind, the contents of its folder after `make`, and the tools that `make` needs.
const KINDS: [(&str, &[&str], &[&str]); 6] = [
    ("grafcet", &["build/lamp.c", "build/lamp.jed", "build/lamp.report.html"], &["make", "cc"]),
    ("statechart", &["build/lamp.c", "build/lamp.v"], &["make", "cc"]),
    ("rules", &["build/lamp.c", "build/lamp.pds"], &["make", "cc"]),
    ("sfc", &["build/lamp.c", "build/lamp.v"], &["make", "cc"]),
    ("gal", &["build/lamp.jed", "build/lamp.report.html"], &["make"]),
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
