//! Tests the names of files that are made from standard input.

#![allow(clippy::disallowed_methods, reason = "tests write files and start the program")]

use std::fs;
use std::io::Write as _;
use std::process::{Command, Stdio};

/// The files that a build of this text leaves, in order.
fn built(text: &str) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut program = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(["build", "-", "--target", "palasm", "--target", "verilog", "-o", "out"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts");
    program.stdin.take().expect("a pipe").write_all(text.as_bytes()).expect("it reads");
    assert!(program.wait().expect("it ends").success(), "{text}");
    let entries = fs::read_dir(folder.path().join("out")).expect("the outputs");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    names.sort();
    names
}

#[test]
fn outputs_of_standard_input_are_called_as_the_first_chart() {
    let chart = |name: &str| {
        format!(
            "chart {name} {{\n    input {name}_go\n    output {name}_on\n    initial step a\n    step b {{ {name}_on }}\n    a -> b when {name}_go\n}}\n"
        )
    };
    let of =
        |stem: &str| [format!("{stem}.outputs.json"), format!("{stem}.pds"), format!("{stem}.v")];
    assert_eq!(built(&format!("{}\n{}", chart("pump"), chart("lamp"))), of("pump"));
    let rules = "Step p\nTransition t\nInput go\nOutput on\nMarking p\nTransitions:\nt: p*go |- @p\nSteps:\np: |- on\n";
    assert_eq!(built(rules), of("rules"), "a text without any name");
}
