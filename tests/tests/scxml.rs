//! SCXML: the core of the W3C's assertions as our own charts on every kind of engine, and the rejection of the rest.
//!
//! Each file of `scxml/w3c` is named after the assertion that it shows and ends in its state `pass`. Each file of `scxml/errors` shows one that
//! requires an error event when the chart runs; here it is a finding before the run, whose code is in the second line of the file.

#![allow(clippy::disallowed_methods, reason = "tests read files")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::{Options, Package, multi_harness};
use grafsynth_driver::pipeline;
use grafsynth_driver::read::{Design, NetDesign, ReadLimits, Texts, read};
use grafsynth_driver::run::net_trace;
use grafsynth_driver::source::Sources;
use grafsynth_engines::{Availability, EngineError, Job, c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::facts::{Facts, Proof, Proved};
use grafsynth_ir::logic::PinRole;
use grafsynth_ir::net::{Net, StepKind};
use grafsynth_logic::kept_apart;
use grafsynth_sim::{Stimulus, Trace, compare};
use grafsynth_verify::{Limits, Verdict, structural_facts};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// The 47 assertions of the core: states, queues, history, data, time.
const CORE: [&str; 47] = [
    "144", "147", "148", "149", "158", "185", "189", "208", "279", "287", "310", "355", "364",
    "372", "375", "377", "387", "388", "399", "403a", "403b", "403c", "404", "405", "406", "407",
    "409", "411", "412", "413", "415", "416", "417", "419", "421", "423", "436", "503", "504",
    "505", "506", "533", "550", "570", "576", "579", "580",
];
/// Assertions whose charts have loops over arrays, which are unrolled.
const LOOPS: [&str; 5] = ["150", "151", "153", "155", "525"];
/// Assertions about run-time errors, which are findings here.
const ERRORS: [&str; 31] = [
    "152", "156", "159", "194", "199", "277", "280", "286", "298", "309", "311", "312", "313",
    "314", "322", "326", "331", "332", "343", "344", "346", "376", "378", "401", "402", "487",
    "488", "496", "521", "528", "553",
];
/// The number of rows: more than any delay in the charts takes (300 ms at 10 ms a row).
const ROWS: usize = 40;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scxml").join(name)
}

/// The files of a folder by name without extension.
fn files(name: &str) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder(name)).expect("the folder is there");
    entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let stem = path.file_stem().expect("a name").to_string_lossy().into_owned();
            (stem, fs::read_to_string(&path).expect("a text"))
        })
        .collect()
}

fn read_text(text: &str) -> (Option<Design>, Vec<Diagnostic>) {
    let mut sources = Sources::default();
    let main = sources.add("chart.scxml", text);
    read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default())
}

fn chart(name: &str, text: &str) -> NetDesign {
    match read_text(text) {
        (Some(Design::Net(design)), _) => *design,
        (_, found) => panic!("{name}: {found:#?}"),
    }
}

/// Rows in which only time passes.
fn waiting(net: &Valid<Net>) -> Stimulus {
    Stimulus::parse_csv(
        net,
        grafsynth_ir::FileId::default(),
        &format!("dt\n{}", "1\n".repeat(ROWS)),
    )
    .0
    .expect("a column of ticks is a stimulus")
}

/// The end of the trace: the steps and the fault of its last row.
fn ending(trace: &Trace) -> (String, String) {
    let csv = trace.to_csv();
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let last: Vec<&str> = lines.next_back().unwrap_or_default().split(',').collect();
    let cell = |name: &str| {
        let at = head.iter().position(|column| *column == name).expect("the column is there");
        last[at].to_owned()
    };
    (cell("steps"), cell("fault"))
}

/// The facts of a chart. The limits are enough to prove the number of micro-steps of a reaction, because the charts have few states.
fn facts(net: &Valid<Net>) -> Facts {
    grafsynth_verify::facts(net, &Limits { pairs: 20_000, states: 2_000, ..Limits::default() })
}

fn passed(name: &str, engine: &str, trace: &Trace) {
    let (steps, fault) = ending(trace);
    assert!(
        steps == "pass" && fault == "0",
        "{name} on {engine}: it ends in `{steps}`, fault {fault}\n{}",
        trace.to_csv()
    );
}

/// All charts of the folder, with their stimuli.
fn charts() -> Vec<(String, Valid<Net>, Stimulus)> {
    files("w3c")
        .into_iter()
        .map(|(name, text)| {
            let net = chart(&name, &text).net;
            let stimulus = waiting(&net);
            (name, net, stimulus)
        })
        .collect()
}

#[test]
fn every_assertion_has_its_chart() {
    let mut wanted: Vec<&str> = CORE.iter().chain(&LOOPS).copied().collect();
    wanted.sort_unstable();
    let core = files("w3c");
    assert_eq!(core.keys().map(String::as_str).collect::<Vec<_>>(), wanted);
    let errors = files("errors");
    assert_eq!(errors.keys().map(String::as_str).collect::<Vec<_>>(), ERRORS);
    for (name, text) in core.iter().chain(&errors) {
        assert!(text.contains(&format!("assertion {name} ")), "{name} does not say what it shows");
    }
}

#[test]
fn the_core_passes_in_the_simulator() {
    for (name, net, stimulus) in charts() {
        passed(&name, "ir", &net_trace(&net, &stimulus));
    }
}

/// All charts in one program.
#[test]
fn the_core_passes_in_c() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: a C compiler is not installed");
        return;
    }
    let charts = charts();
    let packages: Vec<Package> = charts
        .iter()
        .enumerate()
        .map(|(at, (name, net, _))| {
            let options = Options { prefix: Some(format!("w{at}")), ..Options::default() };
            let facts = structural_facts(net);
            grafsynth_backend_c::emit(net, &facts, &options)
                .unwrap_or_else(|found| panic!("{name}: {found:#?}"))
        })
        .collect();
    let pairs: Vec<(&Valid<Net>, &Package)> =
        charts.iter().map(|(_, net, _)| net).zip(&packages).collect();
    let flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function"];
    let program = c::compile_text(&multi_harness(&pairs), &flags).expect("the C is accepted");
    for (at, (name, net, stimulus)) in charts.iter().enumerate() {
        let input = c::lines(net, stimulus);
        let (number, limit) = (at.to_string(), Duration::from_secs(60));
        let run =
            tools::run(&program.path, &[&number], program.folder.path(), input.as_bytes(), limit)
                .unwrap_or_else(|why| panic!("{name}: {why}"));
        let got = c::parse(net, &run.stdout).unwrap_or_else(|why| panic!("{name}: {why:?}"));
        passed(name, "c", &got);
        assert_eq!(compare(&net_trace(net, stimulus), &got), None, "{name}");
    }
}

#[test]
fn the_core_passes_in_verilog() {
    let engine = grafsynth_engines::named("verilog").expect("there is an engine of that name");
    if engine.availability() != Availability::Here {
        assert!(std::env::var_os("CI").is_none(), "iverilog is missing, and CI must have it");
        println!("skipped: iverilog is not installed");
        return;
    }
    let charts = charts();
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some((name, net, stimulus)) = charts.get(next.fetch_add(1, Ordering::Relaxed)) {
            let facts = facts(net);
            match engine.run(&Job { net, facts: &facts, stimulus }) {
                Ok(got) => {
                    passed(name, "verilog", &got);
                    assert_eq!(compare(&net_trace(net, stimulus), &got), None, "{name}");
                }
                Err(EngineError::Refused(found)) => panic!("{name}: {found:#?}"),
                Err(EngineError::Failed(why)) => panic!("{name}: {why}"),
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
}

/// The charts can fail: if one word is changed, they do not end in `pass`.
#[test]
fn a_wrong_chart_does_not_pass() {
    let text = files("w3c").remove("144").expect("it is there");
    let swapped = text.replacen("event=\"one\"", "event=\"two\"", 1);
    assert_ne!(text, swapped);
    let net = chart("144", &swapped).net;
    let stimulus = waiting(&net);
    assert_eq!(ending(&net_trace(&net, &stimulus)).0, "fail");
}

#[test]
fn errors_of_the_run_are_findings_before_it() {
    for (name, text) in files("errors") {
        let line = text.lines().nth(1).unwrap_or_default();
        let code = line.split(['<', '!', '-', ' ', '>']).find(|word| word.starts_with("G0"));
        let code = code.unwrap_or_else(|| panic!("{name}: no code in its second line"));
        let (_, found) = read_text(&text);
        let wanted = found.iter().find(|finding| finding.code.id == code);
        let wanted = wanted.unwrap_or_else(|| panic!("{name}: {code} is not among {found:#?}"));
        let label = wanted.labels.first().unwrap_or_else(|| panic!("{name}: no place"));
        assert!(label.span.end > label.span.start && label.span.start > 0, "{name}: {label:?}");
        // An error that never occurs is a warning; all others are errors.
        assert_eq!(wanted.is_error(), code != "G0434", "{name}: {wanted:#?}");
        assert_eq!(any_error(&found), wanted.is_error(), "{name}: {found:#?}");
    }
}

/// The mode control of a machine tool: the behaviour described in the paper, row by row, with equal results from all engines.
#[test]
fn the_supervisor_does_what_its_paper_says() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/supervisor");
    let text = fs::read_to_string(example.join("supervisor.scxml")).expect("the chart");
    let net = chart("supervisor", &text).net;
    let n_events = net.inputs.values().filter(|input| input.kind.is_event()).count();
    assert_eq!((net.steps.len(), n_events), (15, 13));
    let rows = fs::read_to_string(example.join("supervisor.csv")).expect("the stimulus");
    let (stimulus, found) = Stimulus::parse_csv(&net, grafsynth_ir::FileId::default(), &rows);
    let stimulus = stimulus.unwrap_or_else(|| panic!("{found:#?}"));
    let trace = net_trace(&net, &stimulus);
    let csv = trace.to_csv();
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let at = |name: &str| head.iter().position(|column| *column == name).expect("the column");
    let (steps, error) = (at("steps"), at("Error"));
    let seen: Vec<(String, String)> = lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (cells[steps].to_owned(), cells[error].to_owned())
        })
        .collect();
    let expected = [
        ("Off", "0"),         // at the start
        ("MEM", "0"),         // On_P: nothing is remembered, so Auto, whose first mode is MEM
        ("MDI", "0"),         // MDI_P
        ("JOG", "0"),         // JOG_P
        ("Off", "0"),         // Off_P
        ("Handle", "0"),      // On_P: Manual is remembered, and entered at its first mode
        ("Estop", "1"),       // EStop_P sets the error
        ("Estop", "1"),       // Off_P: not while an error waits
        ("Estop", "0"),       // Reset_P
        ("Off", "0"),         // Off_P
        ("Handle", "0"),      // On_P: still Manual
        ("ProgramEdit", "0"), // Edit_P
        ("Off", "0"),         // Off_P
        ("ProgramEdit", "0"), // On_P
    ];
    let seen: Vec<(&str, &str)> =
        seen.iter().map(|(steps, error)| (steps.as_str(), error.as_str())).collect();
    assert_eq!(seen, expected);

    // All pairs of a situation and a button prove how many checks a reaction needs: without an event, for the button, and without an event again. So
    // the circuit is composed into one clock, without `busy` and without a fault.
    let facts = pipeline::facts(&net, &Limits::default());
    assert_eq!(facts.rounds, Some(Proved { value: 3, by: Proof::Explicit }));
    let logic = pipeline::logic(&net, &facts).expect("a circuit");
    assert!(logic.outputs.values().all(|pin| matches!(pin.role, PinRole::Output(..))));
    // A bound that is too low is refuted.
    let wrong = Facts { rounds: Some(Proved { value: 1, by: Proof::Explicit }), ..facts.clone() };
    let too_short = pipeline::logic(&net, &wrong).expect("a circuit");
    let verdict = grafsynth_verify::equiv(&net, &facts, &too_short, &Limits::default());
    assert!(matches!(verdict, Verdict::Refuted(_)), "{verdict:?}");
    // One register for each region, a flip-flop for each child, and none for the history: the register of `On` keeps its value. The error is a bit.
    let n_children = net.steps.values().filter(|step| {
        step.parent.is_none_or(|parent| net.steps[parent].kind != StepKind::Parallel)
    });
    let n_data: u32 = net.vars.values().map(|var| var.ty.bits() * var.len.unwrap_or(1)).sum();
    assert_eq!(logic.flops.len(), n_children.count() + n_data as usize);
    assert_eq!(logic.flops.len(), 16);
    assert!(kept_apart(&net).is_empty());
    for stimulus in [stimulus, Stimulus::random(&net, 500, 1, 1)] {
        let expected = net_trace(&net, &stimulus);
        for engine in grafsynth_engines::all().into_iter().filter(|engine| engine.by_default()) {
            if let Availability::Missing(tool) = engine.availability() {
                println!("skipped: {tool} is not installed");
                continue;
            }
            match engine.run(&Job { net: &net, facts: &facts, stimulus: &stimulus }) {
                Ok(got) => assert_eq!(compare(&expected, &got), None, "{}", engine.name()),
                // The text for one device is rejected for the expected reason: the device has fewer macrocells than the chart has states.
                Err(EngineError::Refused(found))
                    if ["galasm", "jedec"].contains(&engine.name()) =>
                {
                    let codes: Vec<&str> = found.iter().map(|finding| finding.code.id).collect();
                    assert_eq!(codes, ["G0711"], "{found:?}");
                }
                Err(why) => panic!("{}: {why:?}", engine.name()),
            }
        }
    }
}

/// Documents by others, if available: each is read, or each error has a location.
#[test]
fn documents_by_others_are_read_or_refused_by_name() {
    let folder = match std::env::var_os("GRAFSYNTH_SCXML_CORPUS") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scxml-corpus"),
    };
    let Ok(entries) = fs::read_dir(&folder) else {
        println!("skipped: no SCXML by others is here (GRAFSYNTH_SCXML_CORPUS names a folder)");
        return;
    };
    for entry in entries {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "scxml") {
            continue;
        }
        let text = fs::read_to_string(&path).expect("a text");
        let (design, found) = read_text(&text);
        match design {
            Some(Design::Net(design)) => {
                let stimulus = Stimulus::random(&design.net, 50, 1, 1);
                assert_eq!(net_trace(&design.net, &stimulus).rows.len(), 51, "{path:?}");
            }
            Some(Design::Logic(_)) | None => {
                let errors = found.iter().filter(|finding| finding.is_error());
                assert!(errors.clone().count() > 0, "{path:?}: nothing read and no error");
                for finding in errors {
                    assert!(!finding.labels.is_empty(), "{path:?}: no place in {finding:?}");
                }
            }
        }
    }
}
