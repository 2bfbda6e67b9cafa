//! The files that `build --package` writes, and those that it does not change.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const CHART: &str = "chart lamp {\n extern condition dark\n output lit\n initial step off\n step on { lit }\n off -> on when dark\n on -> off when not dark\n}\n";

fn build(folder: &Path, arguments: &[&str]) -> Output {
    fs::write(folder.join("lamp.graf"), CHART).expect("it is written");
    Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(["build", "lamp.graf", "--no-proof", "-o", "out"])
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("grafsynth starts")
}

#[test]
fn the_files_of_the_user_stay() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--target", "c", "--package", "plain", "--package", "arduino,cmake"];
    assert!(build(folder.path(), &arguments).status.success());
    let out = folder.path().join("out");
    let own = [
        "lamp-plain/lamp_user.c",
        "lamp-plain/example/board.c",
        "lamp-arduino/examples/lamp/lamp.ino",
        "lamp-cmake/src/lamp_user.c",
    ];
    let ours = ["lamp-plain/lamp.c", "lamp-plain/Makefile", "lamp-arduino/library.properties"];
    for name in own.iter().chain(&ours) {
        fs::write(out.join(name), "changed\n").expect("it is written");
    }
    assert!(build(folder.path(), &arguments).status.success());
    for name in own {
        assert_eq!(fs::read_to_string(out.join(name)).expect("it is there"), "changed\n", "{name}");
    }
    for name in ours {
        assert_ne!(fs::read_to_string(out.join(name)).expect("it is there"), "changed\n", "{name}");
    }
    assert!(!out.join("lamp.c").exists(), "packages replace the separate files");
}

#[test]
fn all_files_are_written_or_none() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    fs::create_dir(&out).expect("it is made");
    // A file in place of the folder of the last package.
    fs::write(out.join("lamp-platformio"), "mine\n").expect("it is written");
    let run = build(folder.path(), &["--target", "c", "--package", "plain,arduino,platformio"]);
    assert_eq!(run.status.code(), Some(2), "{}", String::from_utf8_lossy(&run.stderr));
    let left: Vec<_> = fs::read_dir(&out)
        .expect("it is there")
        .map(|it| it.expect("an entry").file_name())
        .collect();
    assert_eq!(left, ["lamp-platformio"], "nothing is left of the others");
    assert_eq!(fs::read_to_string(out.join("lamp-platformio")).expect("it is there"), "mine\n");
}

#[test]
fn a_package_needs_a_name_and_c() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = build(folder.path(), &["--target", "c", "--package", "ardiuno"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("did you mean `arduino`?"));
    let run = build(folder.path(), &["--target", "net", "--package", "plain"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(!folder.path().join("out").exists());
}
