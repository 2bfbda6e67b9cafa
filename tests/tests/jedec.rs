//! Charts mapped to devices: random ones compared with the reference, and the truck with each of its live fuses flipped.

#![allow(clippy::print_stdout, reason = "tests report what they count")]
#![allow(clippy::disallowed_methods, reason = "tests read files")]

use grafsynth_backend_pld::Object;
use grafsynth_backend_pld::device::layout::{Layout, Mode};
use grafsynth_backend_pld::fuse::sim::Chip;
use grafsynth_backend_pld::fuse::vectors::failures;
use grafsynth_backend_pld::fuse::{FuseMap, decode, differences, logic as circuit_of};
use grafsynth_driver::jedec::{Burned, burn};
use grafsynth_driver::pipeline;
use grafsynth_driver::report;
use grafsynth_driver::run::{device_trace, net_trace};
use grafsynth_driver::source::Sources;
use grafsynth_driver::target::Target;
use grafsynth_frontend::graf;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::{Net, Policy};
use grafsynth_ir::{FileId, Valid, lower};
use grafsynth_logic::sim::LogicSim;
use grafsynth_sim::{Random, Stimulus, compare};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{DEVICE_LIMITS, readable, rounds};
use grafsynth_verify::{Limits, Verdict};
use std::collections::BTreeSet;

const ROWS: usize = 60;

/// Small charts with all features of flip-flops and gates.
fn features(max_steps: usize) -> Features {
    Features {
        policies: vec![Policy::All, Policy::Priority],
        max_steps,
        odd_shapes: true,
        edges: true,
        stored_outputs: true,
        mealy: true,
        assumptions: true,
        ..Features::plain()
    }
}

/// Tries random charts on one device until this many fit.
fn charts_on(device: &str, wanted: u64, max_steps: usize) {
    let (mut n_burned, mut n_refused) = (0, 0);
    for seed in 0..wanted * 20 {
        if n_burned == wanted {
            break;
        }
        let net = random_net(seed, &features(max_steps));
        let facts = pipeline::facts(&net, &Limits { pairs: 2_000, ..Limits::default() });
        let Ok(logic) = pipeline::logic(&net, &facts) else { continue };
        let burned = match burn(&net, &logic, Some(device), None, Some(1)) {
            Ok(burned) => burned,
            Err(found) => {
                assert!(
                    found.iter().all(|one| DEVICE_LIMITS.contains(&one.code.id)),
                    "seed {seed}: {found:#?}\n{}",
                    readable(&net)
                );
                n_refused += 1;
                continue;
            }
        };
        n_burned += 1;
        let stimulus = Stimulus::random(&net, ROWS, seed, 1);
        let got = device_trace(&net, &burned.map, &burned.logic, &burned.roles, &stimulus)
            .unwrap_or_else(|found| panic!("seed {seed}: {found:#?}"));
        let difference = compare(&net_trace(&net, &stimulus), &got);
        assert!(difference.is_none(), "seed {seed}: {difference:?}\n{}", readable(&net));
    }
    println!("{device}: {n_burned} charts mapped and run, {n_refused} too large for it");
    assert_eq!(n_burned, wanted, "{device}");
}

#[test]
fn random_charts_on_a_22v10() {
    charts_on("gal22v10", rounds(30, 1_000), 5);
}

#[test]
fn random_charts_on_a_16v8() {
    charts_on("gal16v8", rounds(30, 1_000), 4);
}

#[test]
fn random_charts_on_a_20v8() {
    charts_on("gal20v8", rounds(30, 1_000), 4);
}

#[test]
fn random_charts_on_a_20ra10() {
    charts_on("gal20ra10", rounds(30, 1_000), 4);
}

#[test]
fn random_charts_in_place_of_a_pal16r4() {
    charts_on("pal16r4", rounds(10, 100), 3);
}

fn truck() -> Valid<Net> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/truck/truck.graf");
    let text = std::fs::read_to_string(path).expect("the example");
    let parsed = graf::parse(FileId(0), &text);
    let (net, found) = lower::lower(&parsed.design.expect("a chart"));
    net.unwrap_or_else(|| panic!("{found:?}"))
}

/// The fuses that define the design: used rows, and the polarity and kind of used macrocells; and those that select the mode of the whole device.
fn live_fuses(burned: &Burned, layout: &Layout) -> Vec<u32> {
    let map = &burned.map;
    // A used row has a fuse that is 1; idle rows are all 0.
    let is_used = |row: &u32| {
        let first = row * layout.n_columns;
        (first..first + layout.n_columns).any(|fuse| map.get(fuse))
    };
    let mut live: Vec<u32> = (0..layout.n_rows())
        .filter(is_used)
        .flat_map(|row| row * layout.n_columns..(row + 1) * layout.n_columns)
        .collect();
    for cell in &burned.placement.cells {
        let fuses = layout.cell(cell.pin).expect("a macrocell");
        live.extend(fuses.polarity.fuse());
        live.extend(fuses.kind.and_then(|kind| kind.fuse()));
    }
    live.extend(layout.modes[0].fuses.iter().map(|(fuse, _)| *fuse));
    live
}

/// The effect of a flip on the pins of the design, over all reachable situations and all inputs that the assumptions allow.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Clone, Copy)]
enum Effect {
    /// The device cannot be decoded or is no longer a synchronous circuit.
    Broken,
    /// A different value after power-up.
    PowerUp,
    /// A different output or next state in a reachable situation.
    Behaviour,
    /// No reachable effect.
    Hidden,
}

fn effect(burned: &Burned, wanted: &Logic, flipped: &FuseMap) -> Effect {
    let Ok(mut said) = decode(flipped) else { return Effect::Broken };
    said.pins.clone_from(&burned.placement.pins);
    let Ok(other) = circuit_of(&said, &burned.roles) else { return Effect::Broken };
    let first = |logic: &Logic| logic.flops.values().map(|flop| flop.init).collect::<Vec<_>>();
    if first(&burned.logic) != first(&other) {
        return Effect::PowerUp;
    }
    let n_own = burned.logic.inputs.len();
    let mut states: BTreeSet<Vec<bool>> = BTreeSet::new();
    let mut open = vec![first(&burned.logic)];
    // Inputs of the flipped device that the design does not have are unused pins: both levels of all of them are tried.
    let n_inputs = other.inputs.len();
    assert!(n_inputs <= n_own + 1);
    while let Some(state) = open.pop() {
        if !states.insert(state.clone()) {
            continue;
        }
        for row in 0..1u64 << n_inputs {
            // Inputs that violate the assumptions of the chart are not tried.
            let mut judge = LogicSim::new(wanted);
            for (at, id) in wanted.inputs.ids().enumerate() {
                judge.set_input(id, row >> at & 1);
            }
            if wanted.never.iter().any(|node| judge.node(*node) & 1 == 1) {
                continue;
            }
            let (mut a, mut b) = (LogicSim::new(&burned.logic), LogicSim::new(&other));
            let ids: Vec<_> = burned.logic.flops.ids().collect();
            for (at, id) in ids.iter().enumerate() {
                a.set_flop(*id, u64::from(state[at]));
                b.set_flop(*id, u64::from(state[at]));
            }
            for (at, id) in other.inputs.ids().enumerate() {
                if at < n_own {
                    a.set_input(id, row >> at & 1);
                }
                b.set_input(id, row >> at & 1);
            }
            for id in burned.logic.outputs.ids() {
                if (a.output(id) ^ b.output(id)) & 1 == 1 {
                    return Effect::Behaviour;
                }
            }
            a.clock();
            b.clock();
            let next: Vec<bool> = ids.iter().map(|id| a.flop(*id) & 1 == 1).collect();
            if ids.iter().any(|id| (a.flop(*id) ^ b.flop(*id)) & 1 == 1) {
                return Effect::Behaviour;
            }
            open.push(next);
        }
    }
    Effect::Hidden
}

/// Whether two devices behave differently at the pins of the design, in 64 parallel runs of 100 clocks: for flips that leave no circuit with
/// one clock. All undriven pins are then inputs; the assumptions of the chart are kept.
fn shows_at_the_pins(burned: &Burned, wanted: &Logic, flipped: &FuseMap) -> bool {
    let mut own = Chip::new(&burned.map).expect("it runs");
    let Ok(mut other) = Chip::new(flipped) else { return true };
    let clocks: Vec<u32> = (burned.roles.iter())
        .filter(|role| matches!(role.object, Object::Clock))
        .map(|role| role.pin)
        .collect();
    let device = burned.map.device;
    let mut fixed: Vec<(u32, u64)> = clocks.iter().map(|pin| (*pin, 0)).collect();
    fixed.extend(own.enable_pins().iter().map(|pin| (*pin, 0)));
    let is_free = |pin: &u32| {
        burned.placement.cell(*pin).is_none()
            && !device.is_supply(*pin)
            && !fixed.iter().any(|(known, _)| known == pin)
    };
    let free: Vec<u32> = (1..device.n_pins).filter(is_free).collect();
    for chip in [&mut own, &mut other] {
        if chip.put(&fixed).and_then(|()| chip.power_up()).is_err() {
            return true;
        }
    }
    let mut random = Random::new(1);
    for _ in 0..100 {
        let mut judge = LogicSim::new(wanted);
        let mut levels = Vec::new();
        for pin in &free {
            levels.push((*pin, random.bits()));
        }
        for (id, input) in wanted.inputs.iter() {
            let role = burned
                .roles
                .iter()
                .find(|role| matches!(&role.object, Object::Input(own) if own.name == input.name));
            let pin = role.expect("a pin").pin;
            let level = levels.iter().find(|(known, _)| *known == pin).expect("free").1;
            judge.set_input(id, level);
        }
        let broken = wanted.never.iter().fold(0, |all, node| all | judge.node(*node));
        for (_, level) in &mut levels {
            *level &= !broken;
        }
        for chip in [&mut own, &mut other] {
            let mut outcome = chip.put(&levels);
            for pin in &clocks {
                outcome = outcome.and_then(|()| chip.pulse(*pin));
            }
            if outcome.is_err() {
                return true;
            }
        }
        let differs = |cell: &grafsynth_backend_pld::placement::Cell| {
            own.level(cell.pin) != other.level(cell.pin)
                || own.drives(cell.pin) != other.drives(cell.pin)
        };
        if burned.placement.cells.iter().any(differs) {
            return true;
        }
    }
    false
}

/// Every single live fuse of the truck: the proof detects each flip, and the test vectors detect nearly all that change the behaviour.
#[test]
fn each_flipped_fuse_of_the_truck_is_caught() {
    let net = truck();
    let facts = pipeline::facts(&net, &Limits::default());
    let logic = pipeline::logic(&net, &facts).expect("a circuit");
    for device in ["gal22v10", "gal16v8", "gal20v8", "gal20ra10"] {
        let burned = burn(&net, &logic, Some(device), None, None).expect("it fits");
        let verdict = grafsynth_verify::equiv(&net, &facts, &burned.logic, &Limits::default());
        assert!(matches!(verdict, Verdict::Proved(_)), "{verdict:?}");
        assert_eq!(failures(&burned.map, &burned.vectors, 1).expect("it runs"), []);
        let layout = burned.map.device.layout.expect("a map");
        let live = live_fuses(&burned, layout);
        let (mut n_by_logic, mut n_other, mut n_changed, mut n_tested) = (0, 0, 0, 0);
        let mut n_of = [0; 4];
        for &fuse in &live {
            let mut flipped = burned.map.clone();
            flipped.fuses[fuse as usize] ^= true;
            // The proof first compares every product with the intended one; this already detects each flip.
            let said = decode(&flipped);
            let is_seen = match &said {
                Err(_) => true,
                Ok(said) => !differences(&burned.placement, said).is_empty(),
            };
            assert!(is_seen, "{device}: a flip of fuse {fuse} is not detected");
            let effect = effect(&burned, &logic, &flipped);
            n_of[effect as usize] += 1;
            let is_changed = effect == Effect::Behaviour
                || effect == Effect::Broken && shows_at_the_pins(&burned, &logic, &flipped);
            if is_changed {
                n_changed += 1;
                let failures = failures(&flipped, &burned.vectors, 1);
                let is_tested = !matches!(failures, Ok(none) if none.is_empty());
                n_tested += u64::from(is_tested);
            }
            if effect == Effect::Behaviour {
                n_other += 1;
                let mut said = said.expect("it was decoded");
                said.pins.clone_from(&burned.placement.pins);
                let circuit = circuit_of(&said, &burned.roles).expect("it was a circuit");
                let verdict = grafsynth_verify::equiv(&net, &facts, &circuit, &Limits::default());
                n_by_logic += u64::from(!matches!(verdict, Verdict::Proved(_)));
            }
        }
        println!(
            "{device}: {} live fuses, each flip detected by the proof; {} leave no circuit with one clock and {n_other} another one, {} change the power-up, {} have no reachable effect; {} vectors catch {n_tested} of the {n_changed} of the first two kinds that show at the pins",
            live.len(),
            n_of[0],
            n_of[1],
            n_of[3],
            burned.vectors.len()
        );
        assert_eq!(n_by_logic, n_other, "{device}: the circuit itself is refuted too");
        assert!(n_changed > 100, "{device}: {n_changed}");
        assert!(n_tested * 100 >= n_changed * 95, "{device}: {n_tested} of {n_changed}");
    }
}

/// Checks that the page reports for each macrocell as many terms as rows are used in the fuses (counted here row by row), and that no reported count is below
/// its bound or above the available number.
fn pages_of_charts_on(device: &str, wanted: u64, max_steps: usize) {
    let mut n_pages = 0;
    let limits = Limits { pairs: 2_000, ..Limits::default() };
    for seed in 0..wanted * 20 {
        if n_pages == wanted {
            break;
        }
        let net = random_net(seed, &features(max_steps));
        let facts = pipeline::facts(&net, &limits);
        let options = pipeline::BuildOptions {
            device: Some(device.to_owned()),
            dont_cares: true,
            report: true,
            limits: limits.clone(),
            ..pipeline::BuildOptions::default()
        };
        let built = pipeline::build(&net, &facts, &[Target::Jedec], &options);
        let Some(chip) = built.chips.first() else { continue };
        n_pages += 1;
        let map = chip.fuses.as_ref().expect("the fuses");
        let layout = map.device.layout.expect("a layout");
        let is_set = |mode: &&Mode| mode.fuses.iter().all(|(fuse, value)| map.get(*fuse) == *value);
        let mode = layout.modes.iter().find(is_set).expect("a mode");
        for cell in &chip.cells {
            let fuses = layout.cell(cell.pin.expect("a pin")).expect("a macrocell");
            let shape = mode.shape(fuses.kind.map(|kind| map.setting(kind))).expect("a shape");
            // A used row has a fuse that is 1; idle rows are all 0.
            let is_used = |row: &u32| {
                let first = row * layout.n_columns;
                (first..first + layout.n_columns).any(|fuse| map.get(fuse))
            };
            let rows = (fuses.row + shape.sum..fuses.row + fuses.n_rows).filter(is_used).count();
            let readable = readable(&net);
            assert_eq!(cell.sum.len(), rows, "seed {seed}, {:?}\n{readable}", cell.pin);
            assert!(cell.available.is_some_and(|terms| rows <= terms as usize), "{readable}");
            assert!(cell.count.least.is_none_or(|least| least <= rows), "seed {seed}\n{readable}");
            let (least, without) = (cell.count.least, cell.count.without);
            if let (Some(least), Some((found, bound))) = (least, without) {
                assert!(least <= found && bound <= found, "seed {seed}\n{readable}");
            }
        }
        let sources = Sources::default();
        let document = report::document(&net, &facts, &built, None, &sources, &limits);
        let pages = report::markdown_files(&document, &options.stem_for(&net));
        let n_terms: usize = chip.cells.iter().map(|cell| cell.sum.len()).sum();
        assert!(pages[0].text.contains(&format!("\n{n_terms} of ")), "{}", pages[0].text);
    }
    assert_eq!(n_pages, wanted, "{device}");
}

#[test]
fn pages_say_what_the_fuses_are() {
    for (device, max_steps) in [("gal22v10", 5), ("gal16v8", 4), ("gal20ra10", 3)] {
        pages_of_charts_on(device, rounds(6, 60), max_steps);
    }
}

/// Random charts on every known device: as a fuse map if it has one, otherwise as equations that are read back and proved.
#[test]
fn every_device_takes_random_charts() {
    use grafsynth_backend_pld::device::DEVICES;
    use grafsynth_backend_pld::{Dialect, EmitOptions, emit, read, rebind};
    for (at, device) in (0..).zip(DEVICES) {
        let wanted = rounds(1, 12);
        let has_registers = device.macrocells.iter().any(|cell| cell.registered_terms > 0);
        let (mut n_taken, mut n_refused) = (0, 0);
        for seed in 0..wanted * 100 {
            if n_taken == wanted {
                break;
            }
            let net = random_net(at * 1_000 + seed, &features(4));
            let facts = pipeline::facts(&net, &Limits { pairs: 2_000, ..Limits::default() });
            let Ok(mut logic) = pipeline::logic(&net, &facts) else { continue };
            if !has_registers {
                // The function is tested without memory: the inputs and flip-flops of the chart are inputs, and one function is
                // the output.
                logic = one_function(&logic);
            }
            if device.layout.is_some() && has_registers {
                match burn(&net, &logic, Some(device.name), None, Some(1)) {
                    Ok(burned) => {
                        let verdict = grafsynth_verify::equiv(
                            &net,
                            &facts,
                            &burned.logic,
                            &Limits::default(),
                        );
                        let is_wrong = matches!(verdict, Verdict::Refuted(_));
                        assert!(!is_wrong, "{} {seed}: {verdict:?}", device.name);
                    }
                    Err(_) => {
                        n_refused += 1;
                        continue;
                    }
                }
            } else {
                let options =
                    EmitOptions { device: Some(device.name.into()), ..EmitOptions::default() };
                let made = emit(&logic, Dialect::Cupl, &options).expect("equations");
                if made.text.contains("does not fit") {
                    n_refused += 1;
                    continue;
                }
                let (back, found) = read(Dialect::Cupl, FileId(0), &made.text);
                assert_eq!(found, [], "{}: {}", device.name, made.text);
                let mut back = back.expect("a circuit");
                assert_eq!(rebind(&mut back, &made), []);
                same_signals(&logic, &back, &made.text);
                if has_registers {
                    let verdict = grafsynth_verify::equiv(&net, &facts, &back, &Limits::default());
                    assert!(!matches!(verdict, Verdict::Refuted(_)), "{} {seed}", device.name);
                }
                if device.layout.is_some() {
                    let (placement, roles) =
                        grafsynth_backend_pld::fuse::place(&logic, &options).expect("it fits");
                    let map = grafsynth_backend_pld::fuse::map(&placement).expect("fuses");
                    let said = decode(&map).expect("known");
                    assert_eq!(differences(&placement, &said), [""; 0]);
                    same_signals(&logic, &circuit_of(&said, &roles).expect("a circuit"), "");
                }
            }
            n_taken += 1;
        }
        assert_eq!(n_taken, wanted, "{}: {n_refused} refused", device.name);
    }
}

/// The function of the first flip-flop alone, over everything it reads.
fn one_function(logic: &Logic) -> Logic {
    use grafsynth_ir::logic::{Node, PinInput, PinOutput, PinRole};
    let mut free = logic.clone();
    let flops = std::mem::take(&mut free.flops);
    let inputs: Vec<_> = flops
        .values()
        .map(|flop| {
            let (name, meta) = (format!("{}_now", flop.name), flop.meta.clone());
            free.inputs.push(PinInput { name, role: PinRole::Unknown, meta })
        })
        .collect();
    for id in logic.nodes.ids() {
        if let Node::Flop(flop) = logic.nodes[id] {
            free.nodes[id] = Node::Input(inputs[flop.index()]);
        }
    }
    free.outputs = Default::default();
    free.wires.clear();
    free.never.clear();
    free.unreachable.clear();
    if let Some(flop) = flops.values().next() {
        free.outputs.push(PinOutput {
            name: "next".into(),
            role: PinRole::Unknown,
            value: flop.next,
            registered: None,
            mealy: false,
            meta: flop.meta.clone(),
        });
    }
    free
}

/// Checks that both circuits show the same outputs and store the same values for random inputs.
fn same_signals(a: &Logic, b: &Logic, text: &str) {
    let (mut x, mut y) = (LogicSim::new(a), LogicSim::new(b));
    let mut random = Random::new(1);
    for _ in 0..100 {
        for id in a.inputs.ids() {
            let random = random.bits();
            x.set_input(id, random);
            y.set_input(id, random);
        }
        for id in a.outputs.ids() {
            assert_eq!(x.output(id), y.output(id), "`{}`\n{text}", a.outputs[id].name);
        }
        x.clock();
        y.clock();
        for id in a.flops.ids() {
            assert_eq!(x.flop(id), y.flop(id), "`{}`\n{text}", a.flops[id].name);
        }
    }
}
