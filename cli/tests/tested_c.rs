//! C code that differs from its chart, or that the compiler rejects, is never written; the exit code shows what could not be checked.

#![cfg(unix)]
#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Output};

const LAMP: &str = "chart lamp {
    input button
    output lit
    initial step off
    step on { lit }
    off -> on when button
    on -> off when not button
}
";

/// Builds the lamp with a script as its C compiler.
fn build(folder: &Path, compiler: &str, arguments: &[&str]) -> Output {
    let script = folder.join("compiler.sh");
    fs::write(&script, format!("#!/bin/sh\n{compiler}\n")).expect("a script");
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).expect("a program");
    run(folder, &script.to_string_lossy(), arguments)
}

fn run(folder: &Path, compiler: &str, arguments: &[&str]) -> Output {
    fs::write(folder.join("lamp.graf"), LAMP).expect("a chart");
    Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(["build", "lamp.graf", "-o", "out"])
        .args(arguments)
        .current_dir(folder)
        .env("CC", compiler)
        .env("NO_COLOR", "1")
        .output()
        .expect("grafsynth starts")
}

fn is_written(folder: &Path) -> bool {
    folder.join("out/lamp.c").is_file()
}

fn text(output: &Output) -> String {
    format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

fn has_compiler() -> bool {
    let found = Command::new("cc").arg("--version").output().is_ok();
    assert!(found || std::env::var_os("CI").is_none(), "CI must have a C compiler");
    found
}

/// Corrupts the text of one style on its way to the compiler.
const SPOILED: &str = "if grep -q 'style switch' lamp.c
then sed -i 's/in->button/!in->button/' lamp.c
fi
exec cc \"$@\"";

#[test]
fn c_that_differs_is_not_written_and_the_style_that_is_right_is_named() {
    if !has_compiler() {
        return;
    }
    for proof in [&["-t", "c-switch"][..], &["-t", "c-switch", "--no-proof"]] {
        let folder = tempfile::tempdir().expect("a folder");
        let output = build(folder.path(), SPOILED, proof);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(!is_written(folder.path()), "{said}");
        assert!(said.contains("differs from the chart after"), "{said}");
        let how =
            if proof.len() > 2 { "showed no difference in the tests" } else { "is proved equal" };
        assert!(said.contains(&format!("the style `bits` {how}")), "{said}");
        // The suggested style can be written.
        let output = build(folder.path(), SPOILED, &["-t", "c-bits"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        assert!(is_written(folder.path()));
    }
}

#[test]
fn c_that_crashes_is_not_written() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let spoiled = SPOILED.replace("!in->button", "*(volatile int *)0 != 0");
    let output = build(folder.path(), &spoiled, &["-t", "c-switch"]);
    let said = text(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(!is_written(folder.path()), "{said}");
    assert!(said.contains("crashed"), "{said}");
}

#[test]
fn c_that_the_compiler_refuses_is_an_error() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let refuses = "case \"$*\" in *lamp.c*) echo 'lamp.c:7: no such thing' >&2; exit 1;; esac; exec cc \"$@\"";
    let output = build(folder.path(), refuses, &["-t", "c"]);
    let said = text(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(!is_written(folder.path()), "{said}");
    assert!(said.contains("lamp.c:7: no such thing"), "{said}");
}

/// Without a compiler for this machine, a text is proved by reading it, or its check is open.
#[test]
fn c_without_a_compiler_for_this_machine_is_written_and_not_run() {
    let folder = tempfile::tempdir().expect("a folder");
    for (arguments, code, word) in [
        (&["-t", "c"][..], 0, "not compiled"),
        (&["-t", "c", "--no-proof"], 4, "not checked"),
        (&["-t", "c-program"], 0, "not compiled"),
        (&["-t", "c-engine"], 4, "not checked"),
    ] {
        let output = build(folder.path(), "echo 'cannot link' >&2; exit 1", arguments);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(is_written(folder.path()), "{said}");
        assert!(
            said.contains(&format!(
                "{word}: the C compiler cannot create programs for this machine"
            )),
            "{said}"
        );
        let output = run(folder.path(), "/nowhere/cc", arguments);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains(&format!("{word}: a C compiler not installed")), "{said}");
    }
}

#[test]
fn what_nobody_can_check_is_done() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = run(folder.path(), "/nowhere/cc", &["-t", "json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert!(text(&output).contains("not checked"), "{}", text(&output));
}
