//! The emitted port header with real interrupts at random phases. They come from a timer and a pin of an ATmega1284P in simavr, two timers of a Cortex-M3 in
//! qemu, and a timer and a pin of an 8052 in s51. The chart runs in the main loop or in the timer's interrupt.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests write files for compilers")]

use grafsynth_backend_c::{Options, emit};
use grafsynth_engines::{ArmEngine, Availability, AvrEngine, C8051Engine, Engine, c, tools};
use grafsynth_tests::{chart, rounds};
use grafsynth_verify::structural_facts;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

/// The counts of a run.
#[derive(Debug)]
struct Counts {
    raised: u64,
    cycles: u64,
    /// The ticks counted by the chart.
    ticks: u64,
    edges: u64,
    torn: u64,
    /// The ticks counted by the interrupts themselves.
    isr_ticks: u64,
    isr_edges: u64,
    isr_lost: u64,
    /// The events that the ring counted as lost.
    lost: u64,
    scans: u64,
}

/// Whether a machine is available; reports it if not.
fn is_here(engine: &dyn Engine) -> bool {
    if let Availability::Missing(what) = engine.availability() {
        assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
        println!("skipped: {what} is not installed");
        return false;
    }
    true
}

/// A folder with the C of a chart and a firmware around it.
fn folder(text: &str, firmware: &[(&str, &str)]) -> tempfile::TempDir {
    let net = chart("stress.graf", text);
    let package = emit(&net, &structural_facts(&net), &Options::default()).expect("it is emitted");
    let folder = tempfile::tempdir().expect("a folder");
    for file in &package.files {
        std::fs::write(folder.path().join(&file.name), &file.text).expect("it is written");
    }
    for (name, text) in firmware {
        std::fs::write(folder.path().join(name), text).expect("it is written");
    }
    folder
}

fn compile(folder: &tempfile::TempDir, compiler: &str, arguments: &[&str]) {
    let compiler = tools::find(&[compiler]).expect("it is here");
    let compiled = tools::run(&compiler, arguments, folder.path(), b"", LIMIT).expect("it starts");
    assert!(compiled.is_success, "{}", compiled.stderr);
    assert!(
        compiled.stderr.lines().all(|line| line.contains("warning 110")),
        "{}",
        compiled.stderr
    );
}

/// Runs a firmware for this many cycles with `gap` cycles between edges, under a host; returns the output of the host.
fn run_avr(
    folder: &tempfile::TempDir,
    sources: &[&str],
    host: &str,
    cycles: u64,
    gap: (u64, u64),
    flags: &[&str],
) -> String {
    let mut arguments =
        vec!["-mmcu=atmega1284p", "-std=gnu99", "-Os", "-Wall", "-Wextra", "-o", "a.elf"];
    let headers = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/c");
    arguments.push(headers);
    arguments.extend(sources);
    arguments.extend(flags);
    compile(folder, "avr-gcc", &arguments);
    let host = c::compile_with(host, &["-O1", headers], &["-lsimavr", "-lelf"])
        .expect("the host is compiled");
    let numbers = [cycles, gap.0, gap.1].map(|it| it.to_string());
    let arguments = ["a.elf", &numbers[0], &numbers[1], &numbers[2]];
    let run = tools::run(&host.path, &arguments, folder.path(), b"", LIMIT).expect("it ends");
    assert!(run.is_success, "{} {}", run.ending, run.stderr);
    String::from_utf8_lossy(&run.stdout).into_owned()
}

fn numbers(line: &str) -> Vec<u64> {
    line.split(' ').filter_map(|it| it.parse().ok()).collect()
}

/// Runs the chart for this many cycles with `gap` cycles between edges; `None` if the tools are not available.
fn run(cycles: u64, gap: (u64, u64), flags: &[&str]) -> Option<Counts> {
    if !is_here(&AvrEngine::default()) {
        return None;
    }
    let folder = folder(
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
        &[("main.c", include_str!("../c/avr_stress.c"))],
    );
    let host = include_str!("../c/avr_stress_host.c");
    let text = run_avr(&folder, &["main.c", "stress.c"], host, cycles, gap, flags);
    let [raised, cycles, ticks, edges, torn, isr_ticks, isr_edges, isr_lost, lost, scans] =
        numbers(text.lines().last().unwrap_or_default())[..]
    else {
        panic!("{text}")
    };
    Some(Counts { raised, cycles, ticks, edges, torn, isr_ticks, isr_edges, isr_lost, lost, scans })
}

/// In ten million cycles the chart counts each edge and each tick, and no number is read half-written.
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

/// If events are faster than the chart, lost events are counted: by the interrupts and, up to 255, by the ring.
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

/// The test above without the critical section: the number is read half-written, so the test above would detect it.
#[test]
fn without_the_critical_section_inputs_are_torn() {
    let Some(counts) = run(10_000_000, (700, 3_000), &["-DNO_LOCK"]) else { return };
    println!("{counts:?}");
    assert!(counts.torn > 0);
}

/// The chart for the machines below: both numbers are equal unless they were read in the middle of an interrupt.
const PAIR: &str = "chart stress {
    conflict priority
    input n: int 0..65535
    input m: int 0..65535
    event tick, edge
    output odd
    var ticks: int 0..60000 = 0
    var edges: int 0..60000 = 0
    var torn: int 0..60000 = 0
    initial step even
    step uneven { odd }
    even -> uneven when tick priority 1 do { ticks := ticks + 1; if n <> m { torn := torn + 1 } }
    uneven -> even when tick priority 1 do { ticks := ticks + 1; if n <> m { torn := torn + 1 } }
    even -> even when edge priority 2 do { edges := edges + 1; if n <> m { torn := torn + 1 } }
    uneven -> uneven when edge priority 2 do { edges := edges + 1; if n <> m { torn := torn + 1 } }
}";

/// The counts of one of these machines. The meaning of `other` depends on the machine: nested interrupts, or pulses of the pin.
#[derive(Debug)]
struct PairCounts {
    ticks: u64,
    edges: u64,
    torn: u64,
    isr_ticks: u64,
    isr_edges: u64,
    other: u64,
    isr_lost: u64,
    lost: u64,
    scans: u64,
}

fn answer(folder: &tempfile::TempDir) -> PairCounts {
    let bytes = std::fs::read(folder.path().join("answer.bin")).expect("the machine answered");
    let words: Vec<u64> = bytes
        .chunks_exact(4)
        .map(|it| u64::from(u32::from_le_bytes([it[0], it[1], it[2], it[3]])))
        .collect();
    let [ticks, edges, torn, isr_ticks, isr_edges, other, isr_lost, lost, scans] = words[..] else {
        panic!("{words:?}")
    };
    PairCounts { ticks, edges, torn, isr_ticks, isr_edges, other, isr_lost, lost, scans }
}

fn run_arm(flags: &[&str]) -> Option<PairCounts> {
    if !is_here(&ArmEngine::default()) {
        return None;
    }
    let link = include_str!("../c/arm.ld");
    let folder = folder(PAIR, &[("main.c", include_str!("../c/arm_stress.c")), ("link.ld", link)]);
    let mut arguments = vec!["-mcpu=cortex-m3", "-mthumb", "-std=c99", "-Os", "-Wall", "-Wextra"];
    arguments.extend(["-nostartfiles", "-T", "link.ld", "-o", "a.elf", "main.c", "stress.c"]);
    arguments.extend(flags);
    compile(&folder, "arm-none-eabi-gcc", &arguments);
    let qemu = tools::find(&["qemu-system-arm"]).expect("it is here");
    // An instruction takes a nanosecond, so the run is reproducible, and a timer counts once every 40 instructions.
    let arguments = "-M mps2-an385 -display none -monitor none -serial none -icount shift=0 \
                     -semihosting-config enable=on,target=native -kernel a.elf";
    let arguments: Vec<&str> = arguments.split_whitespace().collect();
    let run = tools::run(&qemu, &arguments, folder.path(), b"", LIMIT).expect("it ends");
    assert!(run.is_success, "{} {}", run.ending, run.stderr);
    Some(answer(&folder))
}

fn run_8051(flags: &[&str]) -> Option<PairCounts> {
    if !is_here(&C8051Engine::default()) {
        return None;
    }
    let firmware = include_str!("../c/c8051_stress.c");
    let folder = folder(PAIR, &[("main.c", firmware), ("stimulus.bin", "")]);
    let common = ["-mmcs51", "--model-large", "--std-sdcc99", "--nogcse", "--noinvariant"];
    for source in ["main.c", "stress.c"] {
        let mut arguments = common.to_vec();
        arguments.extend(["-c", source]);
        arguments.extend(flags);
        compile(&folder, "sdcc", &arguments);
    }
    let mut arguments = common.to_vec();
    arguments.extend(["--xram-size", "65280", "-o", "a.ihx", "main.rel", "stress.rel"]);
    compile(&folder, "sdcc", &arguments);
    let s51 = tools::find(&["s51", "ucsim_51"]).expect("it is here");
    let door = "if=xram[0xffff],in=stimulus.bin,out=answer.bin";
    let arguments = ["-t", "C52", "-I", door, "a.ihx"];
    let run = tools::run(&s51, &arguments, folder.path(), b"run\nquit\n", LIMIT).expect("it ends");
    assert!(run.is_success, "{} {}", run.ending, run.stderr);
    Some(answer(&folder))
}

/// SysTick and a board timer with higher priority, which interrupts it: both write to the ring, each in a critical section.
#[test]
fn on_a_cortex_m3_no_event_is_lost_and_no_input_is_torn() {
    let n = format!("-DROUNDS={}U", rounds(10_000, 50_000));
    let Some(counts) = run_arm(&[&n]) else { return };
    println!("{counts:?}");
    assert!(counts.isr_ticks >= 10_000 && counts.isr_edges > 5_000 && counts.scans > 10_000);
    assert!(counts.other > 50, "no interrupt was interrupted: {counts:?}");
    assert_eq!((counts.lost, counts.isr_lost, counts.torn), (0, 0, 0), "{counts:?}");
    assert_eq!((counts.ticks, counts.edges), (counts.isr_ticks, counts.isr_edges));
    let Some(unlocked) = run_arm(&["-DNO_LOCK"]) else { return };
    println!("without critical sections {unlocked:?}");
    assert!(unlocked.torn > 0);
    assert!(unlocked.ticks + unlocked.edges < unlocked.isr_ticks + unlocked.isr_edges);
}

#[test]
fn on_a_cortex_m3_an_overflow_is_counted() {
    let Some(counts) = run_arm(&["-DSTRESS_RING_SIZE=2U", "-DGAP=2U", "-DSPREAD=3U"]) else {
        return;
    };
    println!("{counts:?}");
    assert!(counts.isr_lost > 0, "nothing overflowed: {counts:?}");
    let arrived = counts.ticks + counts.edges + counts.isr_lost;
    assert_eq!(arrived, counts.isr_ticks + counts.isr_edges);
    assert_eq!((counts.lost, counts.torn), (counts.isr_lost.min(255), 0));
}

/// Timer 0 and the pin P3.2 (`INT0`), which gets external pulses at random times; sdcc's `int` has 16 bits and its functions are not re-entrant.
#[test]
fn on_an_8052_no_event_is_lost_and_no_input_is_torn() {
    let Some(counts) = run_8051(&[]) else { return };
    println!("{counts:?}");
    assert!(counts.isr_ticks >= 250 && counts.isr_edges >= 200 && counts.scans > 100);
    assert_eq!(counts.isr_edges, counts.other, "the pin's interrupt itself missed an edge");
    assert_eq!((counts.lost, counts.isr_lost, counts.torn), (0, 0, 0), "{counts:?}");
    assert_eq!((counts.ticks, counts.edges), (counts.isr_ticks, counts.isr_edges));
}

#[test]
fn on_an_8052_an_overflow_is_counted_and_a_missing_lock_is_seen() {
    let Some(counts) = run_8051(&["-DSTRESS_RING_SIZE=2U", "-DGAP=300U"]) else { return };
    println!("{counts:?}");
    assert!(counts.isr_lost > 0, "nothing overflowed: {counts:?}");
    let arrived = counts.ticks + counts.edges + counts.isr_lost;
    assert_eq!(arrived, counts.isr_ticks + counts.isr_edges);
    assert_eq!((counts.lost, counts.torn), (counts.isr_lost.min(255), 0));
    let Some(unlocked) = run_8051(&["-DNO_LOCK"]) else { return };
    println!("without critical sections {unlocked:?}");
    assert!(unlocked.torn > 0);
}

/// The chart runs in a timer interrupt; main writes inputs, posts events and reads outputs and instance. Returns the counts of main.
fn run_in_interrupt(cycles: u64, flags: &[&str]) -> Option<Vec<u64>> {
    if !is_here(&AvrEngine::default()) {
        return None;
    }
    let folder = folder(
        "chart handed {
            conflict priority
            input n: int 0..65535
            input m: int 0..65535
            event go
            output a: int 0..65535
            output b: int 0..65535
            var c: int 0..65535 = 0
            var d: int 0..65535 = 0
            var goes: int 0..2000000000 = 0
            var torn: int 0..2000000000 = 0
            initial step even
            step uneven
            even -> uneven when go priority 1 do { c := (c + 257) mod 65536; a := c; b := c; d := c; goes := goes + 1; if n <> m { torn := torn + 1 } }
            uneven -> even when go priority 1 do { c := (c + 257) mod 65536; a := c; b := c; d := c; goes := goes + 1; if n <> m { torn := torn + 1 } }
            even -> uneven priority 2 do { c := (c + 257) mod 65536; a := c; b := c; d := c; if n <> m { torn := torn + 1 } }
            uneven -> even priority 2 do { c := (c + 257) mod 65536; a := c; b := c; d := c; if n <> m { torn := torn + 1 } }
        }",
        &[("main.c", include_str!("../c/avr_isr.c"))],
    );
    let host = include_str!("../c/avr_stress_host.c");
    let text = run_avr(&folder, &["main.c", "handed.c"], host, cycles, (700, 3_000), flags);
    Some(numbers(text.lines().last().unwrap_or_default()))
}

#[test]
fn a_chart_in_a_timer_interrupt_hands_everything_over_whole() {
    let cycles = rounds(3_000_000, 10_000_000);
    let Some(counts) = run_in_interrupt(cycles, &[]) else { return };
    println!("goes, torn in, posted, lost, reads, torn out, torn self, scans: {counts:?}");
    let [_, _, goes, torn_in, posted, lost, reads, torn_out, torn_self, scans] = counts[..] else {
        panic!("{counts:?}")
    };
    assert!(scans > 1_000 && reads > 1_000 && posted > 100, "{counts:?}");
    assert_eq!(goes, posted - lost);
    assert_eq!((torn_in, torn_out, torn_self), (0, 0, 0));
    let Some(unlocked) = run_in_interrupt(cycles, &["-DNO_LOCK"]) else { return };
    println!("without critical sections: {unlocked:?}");
    assert!(unlocked[3] > 0 && unlocked[7] > 0 && unlocked[8] > 0, "{unlocked:?}");
}

/// Costs and budget of the chart below, in clock cycles, and the stated costs of the concurrent interrupts (docs/c.md).
const COSTS: [u64; 3] = [600, 900, 850];
const BUDGET: u64 = 1600;
/// The time that one interrupt with an event takes from a task, and the maximum time with interrupts disabled: `NAME_latch` for two bytes.
const INTERRUPT: u64 = 160;
const BLOCKING: u64 = 40;

/// In ten million cycles, each task stays within its cost and each step within its budget, plus the time of the interrupts in between; an interrupt waits at
/// most for the longest critical section, or another interrupt; nothing is lost or torn.
#[test]
fn tasks_stay_within_their_budgets_beside_interrupts() {
    if !is_here(&AvrEngine::default()) {
        return;
    }
    let [first, second, third] = COSTS;
    let text = format!(
        "chart work {{
            conflict priority
            shared buffer sum
            input n: int 0..65535
            event tick, edge
            extern action begin(int 0..15)
            extern action done(int 0..15)
            extern action filter(int 0..65535)
            extern action reacted()
            output odd
            var sum: int 0..65535 = 0
            var ticks: int 0..2000000000 = 0
            var edges: int 0..2000000000 = 0
            var torn: int 0..2000000000 = 0
            var rounds: int 0..2000000000 = 0
            initial step even
            step uneven {{ odd }}
            even -> uneven when tick priority 1 do {{ ticks := ticks + 1; if n mod 257 <> 0 {{ torn := torn + 1 }} }}
            uneven -> even when tick priority 1 do {{ ticks := ticks + 1; if n mod 257 <> 0 {{ torn := torn + 1 }} }}
            even -> even when edge priority 2 do {{ edges := edges + 1; if n mod 257 <> 0 {{ torn := torn + 1 }} }}
            uneven -> uneven when edge priority 2 do {{ edges := edges + 1; if n mod 257 <> 0 {{ torn := torn + 1 }} }}
            initial step control {{
                reacted
                budget {BUDGET}
                task smooth cost {first} {{ begin(1); filter(n); done(1) }}
                task add cost {second} {{ begin(2); sum := (sum + n / 7) mod 32749; done(2) }}
                task again cost {third} {{ begin(3); filter(sum); sum := sum / 3; done(3) }}
            }}
            control -> control when control.done priority 1 do {{ rounds := rounds + 1 }} restart
        }}"
    );
    let folder = folder(&text, &[("main.c", include_str!("../c/avr_tasks.c"))]);
    let host = include_str!("../c/avr_tasks_host.c");
    let said = run_avr(&folder, &["main.c", "work.c"], host, 10_000_000, (4_000, 9_000), &[]);
    println!("{said}");
    // The simulator reports the files that it loads.
    let said_by_host = said.lines().filter(|line| !line.starts_with("Loaded"));
    let lines: Vec<Vec<u64>> = said_by_host.map(numbers).filter(|it| !it.is_empty()).collect();
    let [raised, cycles, ticks, edges, torn, n_rounds, isr_ticks, isr_edges, isr_lost, _] =
        lines[0][..]
    else {
        panic!("{said}")
    };
    assert!(cycles >= 10_000_000 && raised > 1_000 && n_rounds > 300, "{said}");
    assert_eq!((isr_edges, torn, isr_lost), (raised, 0, 0), "{said}");
    assert_eq!((ticks, edges), (isr_ticks, isr_edges), "{said}");
    let tasks: Vec<&Vec<u64>> = lines.iter().filter(|line| line.len() == 6).collect();
    assert_eq!(tasks.len(), COSTS.len(), "{said}");
    for (task, cost) in tasks.into_iter().zip(COSTS) {
        let [_, runs, alone, with, inside, most] = task[..] else { panic!("{said}") };
        assert!(runs > 300 && alone > 0, "{said}");
        assert!(alone <= cost, "task {task:?} takes longer than its cost {cost}");
        assert!(alone * 2 > cost, "the cost {cost} is far from {task:?}");
        assert!(with <= cost + inside * INTERRUPT, "task {task:?}");
        assert!(most <= 3, "task {task:?}");
    }
    let [latency, body, taken] = lines[lines.len() - 2][..] else { panic!("{said}") };
    assert!(taken <= INTERRUPT, "an interrupt takes {taken} cycles");
    assert!(latency <= BLOCKING + INTERRUPT, "an interrupt waited {latency} cycles");
    assert!(body <= INTERRUPT, "{body}");
    let [_, longest] = lines[lines.len() - 1][..] else { panic!("{said}") };
    assert!(longest <= BUDGET, "a step used {longest} cycles of {BUDGET}");
}
