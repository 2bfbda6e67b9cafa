//! Pages and reports have no serious finding of axe-core, light and dark, wide and narrow.
//!
//! `GRAFSYNTH_AXE=$(scripts/axe-core) cargo test -p grafsynth accessible`; `scripts/test` sets the variable.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests read the environment and start the program")]

use grafsynth_engines::scratch::Scratch;
use grafsynth_engines::tools;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(600);

/// A chart with what the examples do not have together: numbers, events, a call, text in C and a warning of an assumption.
const MIXED: &str = "chart mixed {
    evolution stable
    input go
    input level: int 0..10
    event reset
    extern action beep(int 0..9)
    output motor
    output speed: int 0..9 = 0
    var n: int 0..5 = 0
    assume never (go and level > 8)

    initial step rest { motor if go }
    step work {
        entry { n := n + 1; speed := 4; beep(3) }
        exit { speed := 0 }
        code c \"f()\"
    }

    rest -> work when rise(go) and level > 2
    work -> rest on reset when work.t >= 30 ms
}
";

/// A page with a button without a name, and a text that is hard to read in the light and in the dark.
const SPOILED: &str = "<!DOCTYPE html><html lang=\"en\"><title>spoiled</title><main><h1>spoiled</h1><button></button>\
                       <p style=\"color: #888; background: #999\">grey</p></main></html>";

/// Node, chromium and the script of axe-core; `None` if one of them is missing.
fn programs() -> Option<(PathBuf, PathBuf, PathBuf)> {
    let axe = std::env::var_os("GRAFSYNTH_AXE").map(PathBuf::from);
    let node = tools::find(&["node", "nodejs"]);
    let chromium = tools::find(&["chromium", "chromium-browser", "google-chrome"]);
    for (is_here, what) in [
        (axe.is_some(), "axe-core (scripts/axe-core)"),
        (node.is_some(), "node"),
        (chromium.is_some(), "chromium"),
    ] {
        if !is_here {
            assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
            println!("skipped: {what} is not installed");
        }
    }
    Some((node?, chromium?, axe?))
}

/// Runs the program in a folder.
fn run(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("grafsynth starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn axe_core_has_no_serious_finding() {
    let Some((node, chromium, axe)) = programs() else { return };
    let scratch = Scratch::new().expect("a folder");
    let folder = scratch.path();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let example = |name: &str| examples.join(name).display().to_string();
    fs::write(folder.join("mixed.graf"), MIXED).expect("written");
    fs::write(folder.join("spoiled.html"), SPOILED).expect("written");
    for (chart, page) in [
        (&*example("truck/truck.graf"), "grafcet.html"),
        (&*example("supervisor/supervisor.scxml"), "statechart.html"),
        ("mixed.graf", "mixed.html"),
    ] {
        run(folder, &["page", chart, "-o", page]);
    }
    let truck = example("truck/truck.graf");
    let targets = ["--target", "c,palasm", "--device", "gal16v8"];
    run(folder, &[&["build", &*truck, "--report", "-o", "."], &targets[..]].concat());
    for (name, text) in [
        ("chromium.js", include_str!("../../tests/tests/page_scripts/chromium.js")),
        ("axe.js", include_str!("../../tests/tests/page_scripts/axe.js")),
    ] {
        fs::write(folder.join(name), text).expect("written");
    }
    let (chromium, axe) = (chromium.display().to_string(), axe.display().to_string());
    let pages =
        ["grafcet.html", "statechart.html", "mixed.html", "truck.report.html", "spoiled.html"];
    let arguments = [&["axe.js", &*chromium, &*axe], &pages[..]].concat();
    let done = tools::run(&node, &arguments, folder, b"", LIMIT).expect("it runs");
    assert!(done.is_success, "{}", done.stderr);
    let found = String::from_utf8_lossy(&done.stdout);
    let is_spoiled = |line: &&str| line.starts_with("spoiled.html, ");
    let (expected, findings): (Vec<&str>, Vec<&str>) = found.lines().partition(is_spoiled);
    assert_eq!(findings, [""; 0], "{found}");
    // What is spoiled is found, in each look that depends on it.
    for (rule, looks) in [("button-name", 4), ("color-contrast", 8)] {
        let n = expected.iter().filter(|line| line.contains(&format!(": {rule}: "))).count();
        assert_eq!(n, looks, "{rule}: {found}");
    }
}
