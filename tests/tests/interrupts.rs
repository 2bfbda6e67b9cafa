//! The emitted port header beside real interrupts: a timer and a pin of an ATmega1284P, at random phases, in simavr.

#![allow(clippy::print_stdout, reason = "tests say what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests write files for compilers")]

use grafsynth_backend_c::{Options, emit};
use grafsynth_engines::{Availability, AvrEngine, Engine, c, tools};
use grafsynth_tests::chart;
use grafsynth_verify::structural_facts;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

/// What a run counted.
#[derive(Debug)]
struct Counts {
    raised: u64,
    cycles: u64,
    /// By the chart.
    ticks: u64,
    edges: u64,
    torn: u64,
    /// By the interrupts themselves.
    isr_ticks: u64,
    isr_edges: u64,
    isr_lost: u64,
    /// By the ring.
    lost: u64,
    scans: u64,
}

/// Runs the chart for so many cycles with gaps between edges of `gap` cycles; none where the tools are not here.
fn run(cycles: u64, gap: (u64, u64), flags: &[&str]) -> Option<Counts> {
    if let Availability::Missing(what) = AvrEngine::default().availability() {
        assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
        println!("skipped: {what} is not here");
        return None;
    }
    let net = chart(
        "stress.graf",
        "chart stress {
            input n: int 0..65535
            event tick, edge
            output odd
            var ticks: int 0..2000000000 = 0
            var edges: int 0..2000000000 = 0
            var torn: int 0..2000000000 = 0
            conflict priority
            initial step even
            step uneven { odd }
            even -> uneven when tick priority 1 do { ticks := ticks + 1; if n mod 257 <> 0 { torn := torn + 1 } }
            uneven -> even when tick priority 1 do { ticks := ticks + 1; if n mod 257 <> 0 { torn := torn + 1 } }
            even -> even when edge priority 2 do { edges := edges + 1; if n mod 257 <> 0 { torn := torn + 1 } }
            uneven -> uneven when edge priority 2 do { edges := edges + 1; if n mod 257 <> 0 { torn := torn + 1 } }
        }",
    );
    let package = emit(&net, &structural_facts(&net), &Options::default()).expect("it is emitted");
    let folder = tempfile::tempdir().expect("a folder");
    for file in &package.files {
        std::fs::write(folder.path().join(&file.name), &file.text).expect("it is written");
    }
    let firmware = include_str!("../c/avr_stress.c");
    std::fs::write(folder.path().join("main.c"), firmware).expect("it is written");
    let mut arguments =
        vec!["-mmcu=atmega1284p", "-std=gnu99", "-Os", "-Wall", "-Wextra", "-o", "a.elf"];
    arguments.extend(["main.c", "stress.c"]);
    arguments.extend(flags);
    let compiler = tools::find(&["avr-gcc"]).expect("it is here");
    let compiled = tools::run(&compiler, &arguments, folder.path(), b"", LIMIT).expect("it starts");
    assert!(compiled.is_success && compiled.stderr.is_empty(), "{}", compiled.stderr);
    let host =
        c::compile_with(include_str!("../c/avr_stress_host.c"), &["-O1"], &["-lsimavr", "-lelf"])
            .expect("the host is compiled");
    let numbers = [cycles, gap.0, gap.1].map(|it| it.to_string());
    let arguments = ["a.elf", &numbers[0], &numbers[1], &numbers[2]];
    let run = tools::run(&host.path, &arguments, folder.path(), b"", LIMIT).expect("it ends");
    assert!(run.is_success, "{} {}", run.ending, run.stderr);
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    let all: Vec<u64> = text
        .lines()
        .last()
        .unwrap_or_default()
        .split(' ')
        .map(|it| it.parse().expect("a number"))
        .collect();
    let [raised, cycles, ticks, edges, torn, isr_ticks, isr_edges, isr_lost, lost, scans] = all[..]
    else {
        panic!("{text}")
    };
    Some(Counts { raised, cycles, ticks, edges, torn, isr_ticks, isr_edges, isr_lost, lost, scans })
}

/// Ten million cycles: each edge and each tick is in the chart's counts, and no number was seen half written.
#[test]
fn no_event_is_lost_and_no_input_is_torn() {
    let Some(counts) = run(10_000_000, (700, 3_000), &[]) else { return };
    println!("{counts:?}");
    assert!(counts.cycles >= 10_000_000 && counts.raised > 4_000 && counts.scans > 1_000);
    assert_eq!(counts.isr_edges, counts.raised, "the pin's interrupt itself missed an edge");
    assert_eq!((counts.lost, counts.isr_lost), (0, 0), "the ring overflowed: {counts:?}");
    assert_eq!((counts.edges, counts.ticks), (counts.raised, counts.isr_ticks));
    assert_eq!(counts.torn, 0);
}

/// Faster than the chart can follow: what is missing is counted, by the interrupts and, up to 255, by the ring.
#[test]
fn an_overflow_is_counted() {
    let flags = ["-DSTRESS_RING_SIZE=2U"];
    let Some(counts) = run(400_000, (130, 190), &flags) else { return };
    println!("{counts:?}");
    assert!(counts.isr_lost > 0, "nothing overflowed: {counts:?}");
    let arrived = counts.edges + counts.ticks + counts.isr_lost;
    assert_eq!(arrived, counts.isr_edges + counts.isr_ticks);
    assert_eq!(counts.lost, counts.isr_lost.min(255));
}

/// The same without the critical section: the number is seen half written, so the run above would tell.
#[test]
fn without_the_critical_section_inputs_are_torn() {
    let Some(counts) = run(10_000_000, (700, 3_000), &["-DNO_LOCK"]) else { return };
    println!("{counts:?}");
    assert!(counts.torn > 0);
}
