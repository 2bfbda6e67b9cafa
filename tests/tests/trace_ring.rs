//! The trace ring of the emitted C: its entries are the transitions that fired in the reference simulator, and its replay visits the simulator's
//! situations.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::{Options, Style, emit, harness};
use grafsynth_driver::ring::{self, Ring};
use grafsynth_engines::{c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, StepId, TransitionId};
use grafsynth_sim::{Simulator, Stimulus};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, readable, rounds};
use grafsynth_verify::structural_facts;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);
const ROWS: usize = 40;

/// The dump of a run, as the harness prints it; `None` if the chart cannot be traced in this style.
fn dump(net: &Valid<Net>, style: Style, places: u16, stimulus: &Stimulus) -> Option<Vec<u8>> {
    let options = Options { style, trace: Some(places), ..Options::default() };
    let package = match emit(net, &structural_facts(net), &options) {
        Ok(package) => package,
        Err(found) => {
            assert!(found.iter().all(|it| it.code.id == "G0601"), "{found:?}\n{}", readable(net));
            return None;
        }
    };
    let flags = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion"];
    let program = c::compile(&package, &harness(net, &package), &flags)
        .unwrap_or_else(|why| panic!("{why}\n{}", readable(net)));
    let input = c::lines(net, stimulus);
    let run = tools::run(&program.path, &[], program.folder.path(), input.as_bytes(), LIMIT)
        .expect("it runs");
    assert!(run.is_success, "{}", run.stderr);
    Some(run.stderr.into_bytes())
}

/// The transitions that fired in each reaction, sorted, and the situation after it.
fn expected(net: &Valid<Net>, stimulus: &Stimulus) -> Vec<(Vec<TransitionId>, Vec<StepId>)> {
    let mut simulator = Simulator::new(net);
    simulator.reset();
    stimulus
        .rows()
        .map(|row| {
            simulator.step(&row);
            let mut fired = simulator.fired().to_vec();
            fired.sort_unstable();
            (fired, net.steps.ids().filter(|step| simulator.is_active(*step)).collect())
        })
        .collect()
}

fn fired_in(ring: &Ring, reaction: usize) -> Vec<TransitionId> {
    let mut fired: Vec<TransitionId> = ring
        .entries
        .iter()
        .filter(|entry| entry.reaction as usize == reaction)
        .map(|entry| entry.transition)
        .collect();
    fired.sort_unstable();
    fired
}

/// Checks a long ring, which contains all entries, and a short one, which wraps.
fn round_trip(net: &Valid<Net>, style: Style, seed: u64) -> bool {
    let stimulus = Stimulus::random(net, ROWS, seed, 3);
    let wanted = expected(net, &stimulus);
    let total: usize = wanted.iter().map(|(fired, _)| fired.len()).sum();
    let Some(bytes) = dump(net, style, 8192, &stimulus) else { return false };
    let say =
        |what: &str| format!("seed {seed}, style {}: {what}\n{}", style.name(), readable(net));
    let whole = ring::parse(net, &bytes).unwrap_or_else(|why| panic!("{}", say(&why)));
    assert_eq!(whole.count as usize, total, "{}", say("number"));
    assert_eq!(whole.reactions as usize, ROWS);
    for (row, (fired, _)) in wanted.iter().enumerate() {
        assert_eq!(&fired_in(&whole, row + 1), fired, "{}", say(&format!("row {}", row + 1)));
    }
    let facts = structural_facts(net);
    if whole.lost() == 0 {
        let replay = ring::replay(net, &facts, &whole);
        assert_eq!(replay.broken, None, "{}", say("replay"));
        for reaction in replay.reactions.iter().filter(|it| it.number > 0) {
            let (_, active) = &wanted[reaction.number as usize - 1];
            assert_eq!(&reaction.active, active, "{}", say(&format!("row {}", reaction.number)));
        }
    }
    let bytes = dump(net, style, 7, &stimulus).expect("as before");
    let part = ring::parse(net, &bytes).unwrap_or_else(|why| panic!("{}", say(&why)));
    assert_eq!(part.entries.len(), total.min(7));
    assert_eq!(part.entries, whole.entries[whole.entries.len() - part.entries.len()..]);
    let replay = ring::replay(net, &facts, &part);
    assert_eq!(replay.broken, None, "{}", say("replay of a part"));
    for reaction in replay.reactions.iter().filter(|it| it.number > 0) {
        let (_, active) = &wanted[reaction.number as usize - 1];
        let is_right = if reaction.is_known {
            reaction.active == *active
        } else {
            reaction.active.iter().all(|step| active.contains(step))
        };
        assert!(is_right, "{}", say(&format!("part, row {}: {reaction:?}", reaction.number)));
    }
    total > 0
}

#[test]
fn the_ring_holds_what_fired_and_its_replay_is_the_simulators() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: no C compiler");
        return;
    }
    let (mut n_bits, mut n_shaped) = (0, 0);
    for seed in 0..rounds(3, 30) {
        let features = if seed % 3 == 0 { Features::everything() } else { Features::plain() };
        let net = random_net(seed, &features);
        n_bits += usize::from(round_trip(&net, Style::Bits, seed));
        n_shaped += usize::from(round_trip(&net, Style::Tables, seed));
    }
    assert!(n_bits > 0 && n_shaped > 0, "{n_bits} with bits, {n_shaped} with variables");
}

const RINGS: &str = "chart rings {
    input a, b
    output R
    conflict priority
    initial step one
    step two { R }
    initial step three
    step four
    step five
    go: one -> two when a
    back: two -> one when not a
    t3: three -> four when b
    t4: four -> five when not b
    t5: five -> three when b
    t6: five -> five when a
}";

#[test]
fn tables_and_statecharts_note_what_fires() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler");
        return;
    }
    let rings = chart("rings.graf", RINGS);
    for style in [Style::Switch, Style::Tables, Style::Bits, Style::Engine] {
        assert!(round_trip(&rings, style, 1));
    }
    let oven = chart("oven.graf", include_str!("../../examples/microwave/oven.graf"));
    for style in [Style::Switch, Style::Bits, Style::Engine] {
        assert!(round_trip(&oven, style, 1));
    }
    let drill = chart("drill.graf", include_str!("../../examples/drill/drill.graf"));
    assert!(round_trip(&drill, Style::Auto, 1));
}

/// A ring with these entries and a valid header.
fn made(net: &Net, places: u16, entries: &[(u32, u16)]) -> Vec<u8> {
    let count = u32::try_from(entries.len()).expect("few");
    let reactions = entries.iter().map(|it| it.0).max().unwrap_or(0);
    let mut bytes = b"GTR1".to_vec();
    bytes.extend(grafsynth_backend_c::trace::hash(net).to_le_bytes());
    bytes.extend(reactions.to_le_bytes());
    bytes.extend(count.to_le_bytes());
    bytes.extend(places.to_le_bytes());
    bytes.extend(u16::try_from(entries.len()).expect("few").rem_euclid(places).to_le_bytes());
    for place in 0..usize::from(places) {
        let (reaction, transition) = entries.get(place).copied().unwrap_or_default();
        bytes.extend(reaction.to_le_bytes());
        bytes.extend(transition.to_le_bytes());
    }
    bytes
}

#[test]
fn what_no_chart_can_do_is_said_and_what_is_damaged_refused() {
    let net = chart("rings.graf", RINGS);
    let facts = structural_facts(&net);
    let good = made(&net, 8, &[(3, 0), (4, 1), (4, 2)]);
    let ring = ring::parse(&net, &good).expect("it is one");
    let text = ring::to_csv(&net, &ring::replay(&net, &facts, &ring));
    assert_eq!(text, "scan,fired,steps\n0,,one three\n3,go,two three\n4,back t3,one four\n");
    let hex: String = good.iter().map(|byte| format!("{byte:02X}\n")).collect();
    assert_eq!(ring::parse(&net, hex.as_bytes()), Ok(ring));

    let bad = ring::parse(&net, &made(&net, 8, &[(3, 0), (4, 0)])).expect("it is one");
    let replay = ring::replay(&net, &facts, &bad);
    let why = "in reaction 4 go fires, which is impossible in this chart";
    assert_eq!(replay.broken.as_deref(), Some(why));
    // Entries of competing transitions, which cannot follow each other.
    let bad = ring::parse(&net, &made(&net, 8, &[(1, 2), (2, 3), (3, 4), (3, 5)])).expect("one");
    assert!(ring::replay(&net, &facts, &bad).broken.is_some());

    let other = chart("rings.graf", &RINGS.replace("when a\n", "when b\n"));
    assert!(ring::parse(&other, &good).expect_err("another chart").contains("another"));
    for cut in 0..good.len() {
        assert!(ring::parse(&net, &good[..cut]).is_err(), "{cut} bytes");
    }
    for entries in [&[(3, 9)][..], &[(4, 0), (3, 1), (3, 2)]] {
        assert!(ring::parse(&net, &made(&net, 8, entries)).is_err(), "{entries:?}");
    }
}

#[test]
fn without_a_ring_nothing_is_there() {
    let net = chart("rings.graf", RINGS);
    for style in [Style::Switch, Style::Tables, Style::Bits] {
        let options = Options { style, ..Options::default() };
        let package = emit(&net, &structural_facts(&net), &options).expect("it is emitted");
        assert!(package.files.iter().all(|file| !file.text.contains("trace")));
    }
    let gated = Options { gate: true, trace: Some(8), ..Options::default() };
    let found = emit(&net, &structural_facts(&net), &gated).expect_err("it is refused");
    assert_eq!(found[0].code.id, "G0607");
}
