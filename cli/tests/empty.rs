//! An empty file is an error in every language, never a design without parts.

#![allow(clippy::disallowed_methods, reason = "tests write files and start the program")]

use grafsynth_driver::languages::LANGUAGES;
use std::fs;
use std::process::Command;

#[test]
fn an_empty_file_is_an_error_in_every_language() {
    let folder = tempfile::tempdir().unwrap();
    for extension in LANGUAGES.iter().flat_map(|language| language.extensions) {
        // Empty, blank lines, and a byte order mark alone, as left by editors.
        for text in ["", " \n\n\t\n", "\u{feff}\n"] {
            let file = format!("nothing.{extension}");
            fs::write(folder.path().join(&file), text).unwrap();
            let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
                .args(["check", &file])
                .current_dir(folder.path())
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{file} with {text:?}: {said}");
            assert!(said.contains("error[G"), "{file} with {text:?}: {said}");
        }
    }
}

/// Files beside a design may be empty, except a stimulus, which needs at least a header.
#[test]
fn an_empty_stimulus_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let chart = "chart c {\n    input x\n    initial step a\n    a -> a when x\n}\n";
    fs::write(folder.path().join("c.graf"), chart).unwrap();
    fs::write(folder.path().join("rows.csv"), "").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(["sim", "c.graf", "--stimulus", "rows.csv"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("error[G0507]"), "{said}");
    assert_ne!(output.status.code(), Some(0), "{said}");
}
