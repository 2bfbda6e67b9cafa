//! Splits run as they are built: the C of the part on the CPU with that of its link, and the chips fuse by fuse, wired as the link specifies, give the rows of
//! the chart. A pin that is wired wrongly is detected.

#![allow(clippy::print_stdout, reason = "tests report what they did")]

use grafsynth_backend_pld::fuse;
use grafsynth_driver::pipeline::BuildOptions;
use grafsynth_driver::report::chip::{self, Kind};
use grafsynth_driver::run::net_trace;
use grafsynth_driver::split::{
    Item, Objective, PartDevice, Place, Request, RequestedPart, Split, link_on_host, split,
};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::{Availability, Engine as _, EngineError, Job, OfCpu, SplitEngine};
use grafsynth_ir::division::{Running, Shown};
use grafsynth_ir::logic::PinRole;
use grafsynth_ir::net::{
    Driver, Evolution, InputId, InputKind, Leaf, Net, Output, OutputId, Policy,
};
use grafsynth_ir::{Span, Valid, text};
use grafsynth_sim::{Random, Stimulus, compare};
use grafsynth_split::link::{Carries, ChipSignal, Object};
use grafsynth_split::together;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::rounds;
use grafsynth_verify::structural_facts;
use std::collections::BTreeMap;

fn net(seed: u64) -> Valid<Net> {
    let features = Features {
        max_steps: 4,
        single: seed.is_multiple_of(2),
        stable: !seed.is_multiple_of(2),
        timers: true,
        edges: true,
        integers: seed.is_multiple_of(3),
        stored_outputs: true,
        emergency: seed.is_multiple_of(5),
        // What happens once in a reaction.
        controlled_actions: seed % 4 == 1,
        tasks: seed % 8 == 3,
        externs: seed % 6 >= 3,
        ..Features::plain()
    };
    random_net(seed, &features)
}

/// What happens once in a reaction of a net, of the things that a split of a `stable` chart must do in one of its rounds.
fn once(net: &Net) -> Vec<&'static str> {
    let is_called = |output: &Output| matches!(&output.driver, Driver::Extern { calls, .. } if !calls.is_empty());
    let all = [
        ("timers", !net.timers.is_empty()),
        ("controlled actions", !net.actions.is_empty()),
        ("tasks", net.steps.values().any(|step| !step.tasks.is_empty())),
        ("calls", net.outputs.values().any(is_called)),
        ("conditions", net.inputs.values().any(|input| input.kind == InputKind::Extern)),
    ];
    all.into_iter().filter(|(_, has)| *has).map(|(what, _)| what).collect()
}

fn parts() -> [RequestedPart; 2] {
    let part = |name: &str, device: &str| RequestedPart {
        name: name.to_owned(),
        device: PartDevice::named(device).expect("the device is known"),
    };
    [part("chip", "gal22v10"), part("cpu", "atmega328p")]
}

/// A statechart whose outputs can be on the chip.
fn statechart(seed: u64) -> Valid<Net> {
    let features = Features {
        policies: vec![Policy::InnerFirst, Policy::OuterFirst],
        single: false,
        stable: true,
        max_steps: 6,
        timers: true,
        edges: true,
        events: true,
        raise: !seed.is_multiple_of(3),
        reactions: true,
        history: true,
        sends: seed.is_multiple_of(4),
        stored_outputs: true,
        emergency: seed.is_multiple_of(5),
        ..Features::plain()
    };
    random_net(seed, &features)
}

/// A split with each group on a random part; `None` if the net cannot be split in this way.
fn random_split(net: &Valid<Net>, seed: u64) -> Option<Split> {
    let groups = together(net, Running::Lockstep).ok()?;
    let mut random = Random::new(seed ^ 0xc0_51);
    let mut places = Vec::new();
    for (at, items) in groups.groups.iter().enumerate() {
        let part = if groups.cpu_only.contains_key(&at) { 1 } else { random.below(2) };
        let item = items.iter().find(|item| !matches!(item, Item::Event(_)))?;
        places.push(Place { item: *item, part, span: Span::default() });
    }
    let (stem, options) = (FileStem::of_name("random"), BuildOptions::default());
    let request = Request {
        parts: &parts(),
        places: &places,
        running: Running::Lockstep,
        reset: true,
        objective: Objective::Cycles,
        fits: 1,
        stem: &stem,
        options: &options,
        compile: None,
        told: |_| (),
    };
    split(net, &request).ok().filter(|split| !split.division.wires.is_empty())
}

/// The first difference between the split and the chart; `None` if there is none, and `Err` if the split does not run.
fn difference(net: &Valid<Net>, split: Split, seed: u64) -> Result<Option<String>, String> {
    let stem = FileStem::of_name("random");
    let engine = SplitEngine::new(net, split, &parts(), &stem, OfCpu::Host)
        .map_err(|found| format!("{found:?}"))?;
    assert_eq!(engine.availability(), Availability::Here);
    let facts = structural_facts(net);
    let stimulus = Stimulus::random(net, 100, seed, 1);
    match engine.run(&Job { net, facts: &facts, stimulus: &stimulus }) {
        Ok(got) => Ok(compare(&net_trace(net, &stimulus), &got).map(|found| format!("{found:?}"))),
        Err(EngineError::Refused(found)) => Err(format!("{found:?}")),
        Err(EngineError::Failed(why)) => Err(why),
    }
}

/// Runs the fuses of each chip with random pins, then with a clock while the wire of the link is high that resets it: all flip-flops must be as at power-up. Returns
/// the number of flip-flops that were not, before that clock.
fn resets(split: &Split, seed: u64) -> usize {
    let mut random = Random::new(seed ^ 0x5e5e7);
    let mut n_changed = 0;
    for chip in split.parts.iter().flat_map(|part| &part.built.chips) {
        let is_reset = |one: &&chip::Signal| match one.kind {
            Kind::Input(id) => chip.circuit.inputs[id].role == PinRole::Reset,
            _ => false,
        };
        let pin_of = |one: Option<&chip::Signal>| one.and_then(|one| one.pin);
        let Some(reset) = pin_of(chip.signals.iter().find(is_reset)) else { continue };
        let clock = pin_of(chip.signals.iter().find(|one| one.kind == Kind::Clock));
        let (clock, map) = (clock.expect("it has flip-flops"), chip.fuses.as_ref());
        let mut sim = fuse::sim::Chip::new(map.expect("a GAL has fuses")).expect("it settles");
        let first = sim.state(0);
        let inputs: Vec<u32> = chip.signals.iter().filter_map(|one| one.pin).collect();
        for _ in 0..40 {
            let levels: Vec<(u32, u64)> = inputs
                .iter()
                .filter(|pin| ![clock, reset].contains(*pin))
                .map(|pin| (*pin, random.bits()))
                .chain([(reset, 0)])
                .collect();
            sim.put(&levels).expect("it settles");
            sim.pulse(clock).expect("it settles");
        }
        let differ = |sim: &fuse::sim::Chip<'_>| {
            let states = (0..64).map(|run| sim.state(run));
            states.filter(|state| *state != first).count()
        };
        n_changed += differ(&sim);
        sim.put(&[(reset, u64::MAX)]).expect("it settles");
        sim.pulse(clock).expect("it settles");
        assert_eq!(differ(&sim), 0, "seed {seed}: a chip is not reset");
    }
    n_changed
}

/// Runs the fuses of each chip with random pins, then with the levels that the resistors of the link give its inputs while the CPU is in reset. If these cause the
/// emergency, its outputs must be safe, whatever the pins from the plant are. Returns the number of outputs that were not, before that.
fn is_safe_in_reset(net: &Valid<Net>, split: &Split, seed: u64) -> usize {
    let stem = FileStem::of_name("random");
    let linked = link_on_host(net, split, &parts(), &stem).expect("it was linked");
    let mut random = Random::new(seed ^ 0x5afe);
    let wires = || linked.link.connections.iter().filter_map(|one| Some((one, one.pull?)));
    let mut levels: BTreeMap<InputId, i64> =
        net.inputs.iter().map(|(id, it)| (id, it.ty.bounds().0)).collect();
    for (one, pull) in wires() {
        if let Carries::Input { input, bit } = one.carries {
            *levels.entry(input).or_default() += i64::from(pull) << bit;
        }
    }
    let leaf = |leaf: &Leaf| leaf.input().and_then(|id| levels.get(&id).copied());
    let Some(emergency) = &net.emergency else { return 0 };
    if emergency.condition.known(&leaf) != Some(1) {
        return 0;
    }
    let mut n_unsafe = 0;
    for (part, of_part) in split.division.parts.iter().enumerate().take(linked.chips.len()) {
        let (pins, chip) = (&linked.chips[part], &split.parts[part].built.chips[0]);
        let map = chip.fuses.as_ref().expect("a GAL has fuses");
        let mut sim = fuse::sim::Chip::new(map).expect("it settles");
        let inputs = pins.signals.iter().filter(|one| matches!(one.object, Object::Input(_)));
        let inputs: Vec<u32> = inputs.map(|one| one.pin).collect();
        let unsafe_now = |sim: &fuse::sim::Chip<'_>| {
            let shown = pins.signals.iter().filter_map(|one| match one.object {
                Object::Output(id) => match of_part.outputs.iter().find(|(own, _)| *own == id) {
                    Some((_, Shown::Output(output))) => Some((one, *output)),
                    _ => None,
                },
                Object::Input(_) => None,
            });
            let is_wrong = |(one, output): &(&ChipSignal, OutputId)| {
                let output = &net.outputs[*output];
                let code = output.safe_value() - output.ty.bounds().0;
                let wanted = if code >> one.bit & 1 == 1 { u64::MAX } else { 0 };
                sim.level(one.pin) != wanted
            };
            shown.filter(is_wrong).count()
        };
        for _ in 0..40 {
            let levels: Vec<(u32, u64)> = inputs.iter().map(|pin| (*pin, random.bits())).collect();
            sim.put(&levels).expect("it settles");
            if let Some(clock) = pins.clock {
                sim.pulse(clock).expect("it settles");
            }
        }
        n_unsafe += unsafe_now(&sim);
        for (one, pull) in wires() {
            let level = if pull { u64::MAX } else { 0 };
            let own = one.to.iter().filter(|end| end.part == part);
            let levels: Vec<(u32, u64)> = own.map(|end| (end.pin, level)).collect();
            sim.put(&levels).expect("it settles");
        }
        assert_eq!(unsafe_now(&sim), 0, "seed {seed}: an output is not safe\n{}", text::print(net));
    }
    n_unsafe
}

/// Swaps the pins of the first input with those of several others, one after the other. `None` if there is no other; else whether one of the splits differs.
fn crossing_is_found(net: &Valid<Net>, seed: u64) -> Option<bool> {
    let again = || random_split(net, seed).expect("it was split before");
    // Swapped operands of an `and` make no difference.
    let mut all = (1..4).map_while(|other| crossed(again(), other)).peekable();
    all.peek()?;
    Some(all.any(|crossed| !matches!(difference(net, crossed, seed), Ok(None))))
}

/// Swaps the pins of the first input and another one in the data for the link; the fuses do not change.
fn crossed(mut split: Split, other: usize) -> Option<Split> {
    let signals = &mut split.parts[0].built.chips.first_mut()?.signals;
    let inputs: Vec<usize> = (0..signals.len())
        .filter(|at| matches!(signals[*at].kind, Kind::Input(_)) && signals[*at].pin.is_some())
        .collect();
    let (a, b) = (*inputs.first()?, *inputs.get(other)?);
    let (one, other) = (signals[a].pin, signals[b].pin);
    (signals[a].pin, signals[b].pin) = (other, one);
    Some(split)
}

#[test]
fn splits_of_statecharts_with_their_links_give_the_rows_of_the_chart() {
    let (mut seed, mut run, mut wires, mut found, mut wrong) = (0, 0, 0, 0, 0);
    while run < rounds(4, 300) {
        seed += 1;
        let net = statechart(seed);
        let Some(split) = random_split(&net, seed) else { continue };
        run += 1;
        wires += split.division.wires.len();
        match difference(&net, split, seed) {
            Ok(None) => {}
            other => panic!("seed {seed}: {other:?}\n{}", text::print(&net)),
        }
        let Some(is_found) = crossing_is_found(&net, seed) else { continue };
        wrong += 1;
        found += u32::from(is_found);
    }
    println!(
        "{run} statecharts with {wires} wires, {found} of {wrong} crossed pairs of pins found"
    );
    assert!(found * 4 >= wrong && found > 0);
}

#[test]
fn splits_with_their_links_give_the_rows_of_the_chart() {
    let (mut seed, mut run, mut stable, mut found, mut wrong) = (0, 0, 0, 0, 0);
    let mut reset = 0;
    let mut happens: BTreeMap<&str, u32> = BTreeMap::new();
    while run < rounds(6, 300) {
        seed += 1;
        let net = net(seed);
        // A reaction with a fault ends the comparison of a part.
        let facts = grafsynth_driver::pipeline::facts(&net, &grafsynth_verify::Limits::default());
        let is_stable = net.settings.evolution != Evolution::Single;
        if is_stable && facts.always_stable.is_none() {
            continue;
        }
        let Some(split) = random_split(&net, seed) else { continue };
        run += 1;
        reset += resets(&split, seed);
        stable += u32::from(is_stable);
        for what in once(&net).into_iter().filter(|_| is_stable) {
            *happens.entry(what).or_default() += 1;
        }
        match difference(&net, split, seed) {
            Ok(None) => {}
            other => panic!("seed {seed}: {other:?}\n{}", text::print(&net)),
        }
        let Some(is_found) = crossing_is_found(&net, seed) else { continue };
        wrong += 1;
        found += u32::from(is_found);
    }
    println!(
        "{run} splits ({stable} stable, with {happens:?}), {found} of {wrong} crossed pairs of pins found"
    );
    assert!(found * 2 >= wrong && wrong > 0 && stable > 0);
    assert!(reset > 0, "no chip had left its first state");
}

#[test]
fn outputs_of_chips_are_safe_while_the_cpu_is_in_reset() {
    let (mut seed, mut run, mut made_safe) = (0, 0, 0);
    while run < rounds(20, 200) {
        // Every fifth net has an emergency.
        seed += 5;
        let net = net(seed);
        let Some(split) = random_split(&net, seed) else { continue };
        run += 1;
        made_safe += is_safe_in_reset(&net, &split, seed);
    }
    println!("{made_safe} outputs are safe because of the resistors");
    assert!(made_safe > 0, "the resistors never mattered");
}
