//! Golden and differential runs over all engines, in one program: it is linked once, and its tests share all processors.
//!
//! Each module tests one idea, named in its first line; `cargo test -p grafsynth-tests styles::` runs one of them. Shared code is in the
//! library of this package.

mod arbiter;
mod busy;
mod c_edited;
mod c_image;
mod c_induction;
mod c_mutations;
mod c_options;
mod c_random;
mod c_reader;
mod c_sources;
mod c_statecharts;
mod chart_pairs;
mod controllers;
mod conversions;
mod cosim;
mod counterexamples;
mod emergency;
mod engines;
mod evaluators;
mod facts;
mod frame;
mod free_cosim;
mod free_running;
mod hostile;
mod iec;
mod iec_round_trip;
mod interrupts;
mod invariants;
mod jedec;
mod kiss2;
mod link;
mod logic_mutations;
mod misra;
mod mutations;
mod net_to_chart;
mod open_cells;
mod packages;
mod page;
mod pictures;
mod plants;
mod program_vs_sim;
mod regions;
mod rewrite;
mod safe_state;
mod scxml;
mod shared_timers;
mod simulator_laws;
mod split;
mod split_fits;
mod split_memory;
mod split_report;
mod stepper;
mod strict;
mod structured_text;
mod styles;
mod table_engine;
mod templates;
mod trace_ring;
mod unread_inputs;
mod verilog_tools;
mod words;
mod worst_case;

/// A test file that no `main.rs` names would not be compiled, and nobody would notice.
#[test]
#[allow(clippy::disallowed_methods, reason = "tests read files")]
fn every_file_of_tests_is_a_module_of_its_program() {
    use std::fs;
    use std::path::Path;

    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut n_programs = 0;
    for krate in fs::read_dir(root).expect("the workspace") {
        let folder = krate.expect("an entry").path().join("tests");
        if !folder.is_dir() {
            continue;
        }
        let main = fs::read_to_string(folder.join("main.rs"))
            .unwrap_or_else(|_| panic!("{} has no main.rs", folder.display()));
        let manifest = fs::read_to_string(folder.join("../Cargo.toml")).expect("a manifest");
        n_programs += 1;
        for file in fs::read_dir(&folder).expect("a folder of tests") {
            let path = file.expect("an entry").path();
            let name = path.file_stem().expect("a name").to_string_lossy();
            if path.extension().is_some_and(|it| it == "rs") && name != "main" {
                let named = main.lines().any(|line| line == format!("mod {name};"));
                let is_program = manifest.contains(&format!("path = \"tests/{name}.rs\""));
                assert!(named || is_program, "{} is in no program", path.display());
            }
        }
    }
    assert!(n_programs > 1, "{n_programs} programs of tests");
}
