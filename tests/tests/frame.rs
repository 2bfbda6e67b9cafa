//! The example `mcs-frame`: its stimulus in the simulator, and its program on an ATmega1284P in simavr, with a real timer and a real emergency button.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests write files for compilers")]

use grafsynth_backend_c::{Options, emit};
use grafsynth_engines::{Availability, AvrEngine, Engine, c, tools};
use grafsynth_ir::net::{Net, StepId};
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{Simulator, Stimulus};
use grafsynth_tests::chart;
use grafsynth_verify::structural_facts;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);

fn frame() -> Valid<Net> {
    chart("frame.graf", include_str!("../../examples/mcs-frame/frame.graf"))
}

fn step(net: &Net, name: &str) -> StepId {
    net.steps.iter().find(|(_, it)| it.name.text == name).map(|(id, _)| id).expect("it is there")
}

#[test]
fn the_stimulus_goes_through_all_tasks_a_stop_and_a_fault() {
    let net = frame();
    let csv = include_str!("../../examples/mcs-frame/frame.csv");
    let (stimulus, problems) = Stimulus::parse_csv(&net, FileId(0), csv);
    assert!(problems.is_empty(), "{problems:?}");
    let stimulus = stimulus.expect("it is one");
    let mut simulator = Simulator::new(&net);
    let mut entered = Vec::new();
    let names = ["inz", "dig", "erh", "rst", "ssc", "mcs", "acs", "mos", "pgs", "pss", "ocs"];
    for row in stimulus.rows() {
        simulator.step(&row);
        let now = names.into_iter().find(|name| simulator.is_active(step(&net, name)));
        if let Some(now) = now
            && entered.last() != Some(&now)
        {
            entered.push(now);
        }
    }
    let expected = "inz dig ssc mcs acs ocs dig ssc mcs mos ocs dig ssc mcs pgs ocs dig erh dig erh rst \
                    inz dig ssc mcs pss ocs dig erh rst inz";
    assert_eq!(entered.join(" "), expected);
}

#[test]
fn the_program_stops_its_drives_and_starts_anew_on_an_avr() {
    if let Availability::Missing(what) = AvrEngine::default().availability() {
        assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
        println!("skipped: {what} is not installed");
        return;
    }
    let net = frame();
    let package = emit(&net, &structural_facts(&net), &Options::default()).expect("it is emitted");
    assert_eq!(package.style, "switch");
    let folder = tempfile::tempdir().expect("a folder");
    for file in &package.files {
        std::fs::write(folder.path().join(&file.name), &file.text).expect("it is written");
    }
    let main = include_str!("../../examples/mcs-frame/frame_main.c");
    std::fs::write(folder.path().join("frame_main.c"), main).expect("it is written");
    let arguments = [
        "-mmcu=atmega1284p",
        "-std=gnu99",
        "-Os",
        "-Wall",
        "-Wextra",
        "-o",
        "a.elf",
        "frame_main.c",
        "frame.c",
    ];
    let compiler = tools::find(&["avr-gcc"]).expect("it is here");
    let compiled = tools::run(&compiler, &arguments, folder.path(), b"", LIMIT).expect("it starts");
    assert!(compiled.is_success && compiled.stderr.is_empty(), "{}", compiled.stderr);
    let host =
        c::compile_with(include_str!("../c/avr_frame_host.c"), &["-O1"], &["-lsimavr", "-lelf"])
            .expect("the host is compiled");
    let (stop, key) = (400_000, 480_000);
    let arguments = ["a.elf", "400000", "480000", "800000"];
    let run = tools::run(&host.path, &arguments, folder.path(), b"", LIMIT).expect("it ends");
    assert!(run.is_success, "{} {}", run.ending, run.stderr);
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    let changes: Vec<(&str, u64)> = text
        .lines()
        .filter_map(|line| line.split_once(' '))
        .filter_map(|(what, cycle)| Some((what, cycle.parse().ok()?)))
        .collect();
    let lamps: Vec<(&str, u64)> =
        changes.iter().copied().filter(|(what, _)| !what.starts_with('r')).collect();
    let order: Vec<&str> = lamps.iter().map(|(what, _)| *what).collect();
    assert_eq!(order, ["d1", "d0", "a1", "a0", "d1"], "{text}");
    // The interrupt alone switches the drives off, the alarm goes on one scan later, and both stay so until the operator acknowledges.
    assert!((stop..stop + 200).contains(&lamps[1].1), "{lamps:?}");
    assert!(lamps[2].1 < stop + 5_000, "{lamps:?}");
    assert!(lamps[3].1 > key && lamps[4].1 < key + 20_000, "{lamps:?}");
    let rounds = changes.iter().filter(|(what, _)| what.starts_with('r'));
    let n_rounds = rounds.count();
    assert!(n_rounds > 200, "the background is blocked: {n_rounds} rounds");
}
