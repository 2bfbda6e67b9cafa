//! From `build --trace-ring` to `trace`: the ring of a chart that was built for a machine is read with the same options, and rejected with others.

#![allow(clippy::disallowed_methods, reason = "tests read files and start programs")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const CHART: &str = "chart ramp {
    input a
    var m: int 0..65535 = 1
    initial step off
    step on {
        budget 100000
        task first { m := m * 7 mod 1000 }
    }
    go: off -> on when a
    back: on -> off when not a
}
";

/// Two reactions, then the bytes of the ring.
const MAIN: &str = "#include \"ramp.h\"
#include <stdio.h>

int main(void)
{
    static ramp_t ramp;
    ramp_in_t in = { 0 };
    ramp_init(&ramp);
    in.a = 1;
    ramp_step(&ramp, &in);
    in.a = 0;
    ramp_step(&ramp, &in);
    for (uint16_t at = 0; at < 20 + 6 * 8; at++) {
        printf(\"%02x\\n\", ramp_trace_byte(&ramp, at));
    }
    return 0;
}
";

fn grafsynth(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("grafsynth starts")
}

/// Costs from a model and properties are part of the hash of the chart.
const READING: [&str; 4] = ["--for", "avr", "--assert", "never (on.active and off.active)"];

/// Builds `ramp.graf` in the folder, runs it, and leaves its ring in `dump.hex`; false if no compiler is available.
pub(crate) fn dump(folder: &Path) -> bool {
    if Command::new("cc").arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: no C compiler");
        return false;
    }
    fs::write(folder.join("ramp.graf"), CHART).expect("it is written");
    fs::write(folder.join("main.c"), MAIN).expect("it is written");
    let build = ["build", "ramp.graf", "--target", "c", "--trace", "8", "--no-proof"];
    let built = grafsynth(folder, &[&build[..], &READING].concat());
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let compiled = Command::new("cc")
        .args(["-std=c99", "-o", "ramp", "main.c", "ramp.c"])
        .current_dir(folder)
        .output()
        .expect("the compiler starts");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let run = Command::new(folder.join("ramp")).output().expect("it starts");
    fs::write(folder.join("dump.hex"), run.stdout).expect("it is written");
    true
}

#[test]
fn a_ring_is_read_with_the_options_that_it_was_built_with() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    if !dump(folder) {
        return;
    }
    let trace = ["trace", "dump.hex", "--chart", "ramp.graf"];
    let traced = grafsynth(folder, &[&trace[..], &READING].concat());
    assert_eq!(traced.status.code(), Some(0), "{}", String::from_utf8_lossy(&traced.stderr));
    let shown = String::from_utf8_lossy(&traced.stdout);
    assert_eq!(shown, "scan,fired,steps\n0,,off\n1,go,on\n2,back,off\n");

    let other = grafsynth(folder, &[&trace[..], &["--for", "host"]].concat());
    assert_eq!(other.status.code(), Some(1));
    let said = String::from_utf8_lossy(&other.stderr);
    assert!(said.contains("another version of this one"), "{said}");
    assert!(said.contains("other options"), "{said}");
}
