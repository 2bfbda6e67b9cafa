//! The emitted Verilog in external tools: Verilator reads and runs it, yosys reads it, and ABC compares two texts of one chart as we do.
//!
//! Each tool starts once for all texts. A missing tool is skipped with a message; if `CI` is set, it is a failure.

#![allow(clippy::print_stdout, reason = "tests report what they skip and count")]
#![allow(clippy::disallowed_methods, reason = "tests read and write files")]

use grafsynth_backend_pld::{Dialect, EmitOptions, emit};
use grafsynth_driver::pipeline::{self, BuildOptions, Reset, ResetStyle};
use grafsynth_driver::report::Outcome;
use grafsynth_driver::target::Target;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::logic::{Logic, Node, PinOutput, PinRole};
use grafsynth_ir::net::Net;
use grafsynth_sim::Stimulus;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, readable, rounds};
use grafsynth_verify::equiv::Verdict;
use grafsynth_verify::{Limits, structural_facts};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);
const ROWS: usize = 60;

fn tool(name: &str) -> Option<PathBuf> {
    let found = tools::find(&[name]);
    if found.is_none() {
        assert!(std::env::var_os("CI").is_none(), "{name} is missing, and CI must have it");
        println!("skipped: {name} is not installed");
    }
    found
}

fn run(program: &Path, arguments: &[&str], folder: &Path) -> String {
    let done = tools::run(program, arguments, folder, b"", LIMIT).expect("the tool starts");
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), done.stderr);
    assert!(done.is_success, "{} {}\n{said}", program.display(), done.ending);
    said
}

/// A circuit with its origin; its module is named `d0`, `d1`, ..
struct Design {
    net: Valid<Net>,
    logic: Logic,
    verilog: String,
}

/// The first `wanted` random nets that become circuits.
fn designs(wanted: u64) -> Vec<Design> {
    let mut made = Vec::new();
    for seed in 0..wanted * 4 {
        if made.len() as u64 == wanted {
            break;
        }
        let net = random_net(seed, &Features::chip());
        let Ok(mut logic) = pipeline::logic(&net, &structural_facts(&net)) else { continue };
        logic.name.text = format!("d{}", made.len());
        let Ok(emitted) = emit(&logic, Dialect::Verilog, &EmitOptions::default()) else { continue };
        made.push(Design { net, logic, verilog: emitted.text });
    }
    assert_eq!(made.len() as u64, wanted, "too few random nets become circuits");
    made
}

#[test]
fn verilator_and_yosys_read_every_text_without_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let designs = designs(rounds(40, 400));
    let mut names = Vec::new();
    for (index, design) in designs.iter().enumerate() {
        let name = format!("d{index}.v");
        fs::write(folder.path().join(&name), &design.verilog).expect("a file");
        names.push(name);
    }
    for example in ["truck/truck.graf", "crossing/crossing.graf", "drill/drill.graf"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(example);
        let text = fs::read_to_string(path).expect("an example");
        let net = chart(example, &text);
        let logic =
            pipeline::logic(&net, &pipeline::facts(&net, &Limits::default())).expect("a circuit");
        let emitted = emit(&logic, Dialect::Verilog, &EmitOptions::default()).expect("Verilog");
        let name = format!("{}.v", logic.name.text);
        fs::write(folder.path().join(&name), &emitted.text).expect("a file");
        names.push(name);
    }
    if let Some(verilator) = tool("verilator") {
        // Several top modules are intended here; a pin that a chart declares and does not read is still a pin.
        let mut arguments =
            vec!["--lint-only", "-Wall", "-Wno-MULTITOP", "-Wno-UNUSEDSIGNAL", "-Wno-DECLFILENAME"];
        arguments.extend(names.iter().map(String::as_str));
        let said = run(&verilator, &arguments, folder.path());
        assert!(!said.contains("%Warning"), "{said}");
    }
    if let Some(yosys) = tool("yosys") {
        let script =
            format!("read_verilog {}; hierarchy -check; proc; check -assert", names.join(" "));
        let said = run(&yosys, &["-q", "-p", &script], folder.path());
        assert!(!said.to_ascii_lowercase().contains("warning"), "{said}");
    }
}

/// All benches in one program: each reports that its rows are correct.
#[test]
fn verilator_runs_the_benches() {
    let Some(verilator) = tool("verilator") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let designs = designs(rounds(4, 60));
    let mut all = String::new();
    let mut top = "module batch;\n".to_owned();
    for (index, design) in designs.iter().enumerate() {
        let stimulus = Stimulus::random(&design.net, ROWS, index as u64, 1);
        let vectors = pipeline::vectors(&design.net, &design.logic, &stimulus).expect("vectors");
        let options = EmitOptions { vectors: Some(vectors), ..EmitOptions::default() };
        let emitted = emit(&design.logic, Dialect::Verilog, &options).expect("Verilog");
        // The first bench that ends must not end the others; all of them end on their own.
        let bench = emitted.bench.expect("a bench").replace("$finish;", "");
        let _ = writeln!(all, "`timescale 1ns / 1ps\n{}\n{bench}", emitted.text);
        let _ = writeln!(top, "    d{index}_tb bench_{index} ();");
    }
    top.push_str("endmodule\n");
    fs::write(folder.path().join("all.v"), format!("{all}{top}")).expect("a file");
    let arguments = [
        "--binary",
        "--timing",
        "-Wno-fatal",
        "-Wno-lint",
        "--top-module",
        "batch",
        "-O0",
        "-Mdir",
        "made",
        "-CFLAGS",
        "-O0",
        "-j",
        "2",
        "all.v",
    ];
    run(&verilator, &arguments, folder.path());
    let said = run(&folder.path().join("made/Vbatch"), &[], folder.path());
    let wanted = format!("PASS {} rows", ROWS + 1);
    assert_eq!(said.matches(&wanted).count(), designs.len(), "{said}");
}

/// Whether ABC reports two circuits as equal or as different, our own proof agrees.
#[test]
fn abc_agrees_with_our_proof() {
    let (Some(yosys), Some(abc)) = (tool("yosys"), tool("berkeley-abc")) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let mut abc_script = String::new();
    let mut cases: Vec<(u64, bool, String)> = Vec::new();
    let wanted = rounds(6, 50);
    let limits = Limits { pairs: 20_000, states: 2_000, ..Limits::default() };
    let mut seed = 0;
    while cases.len() as u64 / 2 < wanted {
        assert!(seed < wanted * 20, "too few random nets become equations");
        let net = random_net(seed, &Features::chip());
        seed += 1;
        let facts = structural_facts(&net);
        let Ok(logic) = pipeline::logic(&net, &facts) else { continue };
        // ABC takes minutes for larger ones.
        if logic.flops.len() > 20 {
            continue;
        }
        let options = pipeline::emit_options(&net, None, None);
        let Ok(through) = pipeline::through(&logic, Dialect::Palasm, &options) else { continue };
        let same = through.read_back;
        let Some(wrong) = with_one_fault(&same, seed) else { continue };
        for (other, is_wrong) in [(same, false), (wrong, true)] {
            let verdict = grafsynth_verify::equiv(&net, &facts, &other, &limits);
            let is_equal = match (verdict, is_wrong) {
                (Verdict::Proved(_), false) => true,
                (Verdict::Refuted(_), _) => false,
                // An error may be in a flip-flop that no trace shows; ABC sees all of them.
                (Verdict::Proved(_), true) | (Verdict::Open(_), _) => continue,
            };
            let index = cases.len();
            for (name, logic) in [("gold", &logic), ("gate", &other)] {
                let file = format!("{name}{index}");
                let text = emit(&shown(logic), Dialect::Verilog, &EmitOptions::default());
                fs::write(folder.path().join(format!("{file}.v")), text.expect("Verilog").text)
                    .expect("a file");
                // A separate run for each: in a later design of one run, yosys 0.23 loses initial values.
                let script = format!(
                    "read_verilog {file}.v; proc; opt_clean; simplemap; aigmap; write_aiger -zinit {file}.aig"
                );
                run(&yosys, &["-q", "-p", &script], folder.path());
            }
            let _ = writeln!(
                abc_script,
                "echo case {index}\ndsec -T 10 gold{index}.aig gate{index}.aig"
            );
            cases.push((seed - 1, is_equal, readable(&net)));
        }
    }
    fs::write(folder.path().join("all.abc"), abc_script).expect("a file");
    let said = run(&abc, &["-f", "all.abc"], folder.path());
    let mut answers = said.split("\ncase ").skip(1);
    let (mut n_equal, mut n_different, mut n_undecided) = (0, 0, 0);
    for (index, (seed, is_equal, text)) in cases.iter().enumerate() {
        let answer = answers.next().unwrap_or_default();
        assert!(answer.starts_with(&index.to_string()), "{said}");
        let abc_says = answer.contains("Networks are equivalent");
        if answer.contains("UNDECIDED") {
            // ABC decides most pairs within ten seconds.
            n_undecided += 1;
            continue;
        }
        let is_told = abc_says || answer.contains("NOT EQUIVALENT") || answer.contains("disproved");
        assert!(is_told, "seed {seed}: {answer}");
        assert_eq!(abc_says, *is_equal, "seed {seed}: ABC says {answer}\n{text}");
        if abc_says { n_equal += 1 } else { n_different += 1 }
    }
    println!("ABC agrees on {n_equal} equal pairs and {n_different} different ones");
    assert!(n_equal > 0 && n_different > 0 && n_undecided * 2 < cases.len(), "{n_undecided}");
}

/// A bitstream equals the proved Verilog, and a changed bit is detected.
#[test]
fn bitstreams_are_read_back_and_proved() {
    let missing = grafsynth_engines::ice40::missing();
    if !missing.is_empty() {
        assert!(std::env::var_os("CI").is_none(), "{missing:?} are missing, and CI must have them");
        println!("skipped: {} are not here", missing.join(", "));
        return;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/truck/truck.graf");
    let net = chart("truck.graf", &fs::read_to_string(path).expect("the truck"));
    let limits = Limits::default();
    let facts = pipeline::facts(&net, &limits);
    let reset = |style| Some(Reset { name: "rst".to_owned(), style });
    for (synchronise, reset) in
        [(0, None), (0, reset(ResetStyle::Asynchronous)), (2, reset(ResetStyle::Synchronous))]
    {
        let options = BuildOptions {
            synchronise,
            reset,
            prove: true,
            limits: limits.clone(),
            ..BuildOptions::default()
        };
        let built = pipeline::build(&net, &facts, &[Target::Ice40], &options);
        let job = built.bitstreams.first().unwrap_or_else(|| panic!("{:?}", built.found));
        let made = grafsynth_engines::ice40::bitstream(job).expect("a bitstream");
        let line = grafsynth_driver::ice40::judge(job, &made.read_back, &limits);
        assert_eq!(line.outcome(), Outcome::Proved, "{line}\n{}", made.read_back);
        assert!(made.remark.contains("logic cells"), "{}", made.remark);

        // Every lookup table matters: a complemented one is detected.
        let lines: Vec<&str> = made.read_back.lines().collect();
        let tables = lines.iter().filter(|line| line.contains("/* LUT"));
        assert!(tables.clone().count() > 2, "{}", made.read_back);
        for table in tables {
            let negated = table.replace("*/ ", "*/ !(").replace(';', ");");
            let wrong = made.read_back.replace(table, &negated);
            let line = grafsynth_driver::ice40::judge(job, &wrong, &limits);
            assert_eq!(line.outcome(), Outcome::Refuted, "{table}: {line}\n{wrong}");
        }
    }
}

/// The circuit with a pin for each flip-flop, so that a tool that compares pins also compares states.
fn shown(logic: &Logic) -> Logic {
    let mut logic = logic.clone();
    for id in logic.flops.ids() {
        let value = logic.nodes.push(Node::Flop(id));
        let name = format!("state_of_{}", logic.flops[id].name);
        logic.outputs.push(PinOutput {
            name,
            role: PinRole::Unknown,
            value,
            registered: None,
            mealy: false,
            meta: Default::default(),
        });
    }
    logic
}

/// The circuit with the function of one flip-flop negated.
fn with_one_fault(logic: &Logic, seed: u64) -> Option<Logic> {
    let mut wrong = logic.clone();
    let count = wrong.flops.len();
    let which = wrong.flops.ids().nth(usize::try_from(seed).ok()?.checked_rem(count)?)?;
    let next = wrong.flops[which].next;
    let not = wrong.nodes.push(Node::Not(next));
    for (id, flop) in wrong.flops.iter_mut() {
        if id == which {
            flop.next = not;
        }
    }
    Some(wrong)
}
