//! Random designs for every device: mapped, written, read, decoded and simulated, and compared with each other.

use crate::device::{Clock, DEVICES, Device, Macrocell, Polarity};
use crate::fuse::sim::Chip;
use crate::fuse::vectors::{failures, vectors};
use crate::fuse::{FuseMap, decode, differences, logic, map, own_roles};
use crate::jedec;
use crate::placement::{Cell, CellKind, PinName, Placement, Product};
use grafsynth_ir::span::FileId;
use grafsynth_logic::sim::LogicSim;
use proptest::prelude::RngExt as _;
use proptest::test_runner::{RngAlgorithm, TestRng};

fn below(random: &mut TestRng, n: usize) -> usize {
    random.random_range(0..n)
}

/// A design without combinational feedback: sums read inputs and registers.
fn design(device: &'static Device, random: &mut TestRng) -> Placement {
    let mut placement = Placement::new(device);
    placement.title = "random".to_owned();
    placement.signature = b"random".to_vec();
    let mut kinds: Vec<(Macrocell, CellKind)> = Vec::new();
    let mut inputs: Vec<u32> = device.inputs.to_vec();
    for &macrocell in device.macrocells {
        let is_registered = match (macrocell.registered_terms, macrocell.combinational_terms) {
            (0, _) => false,
            (_, 0) => true,
            _ => below(random, 2) == 0,
        };
        match below(random, 4) {
            // An input, if every mode of the device can read it.
            0 if !is_registered && !device.deaf_pins.contains(&macrocell.pin) => {
                inputs.push(macrocell.pin);
            }
            0 => {}
            _ if is_registered => kinds.push((macrocell, CellKind::Registered)),
            _ => kinds.push((macrocell, CellKind::Combinational)),
        }
    }
    let has_registers = kinds.iter().any(|(_, kind)| *kind == CellKind::Registered);
    if !has_registers {
        // Without registers the simplest mode may be chosen, which reads other pins.
        inputs.retain(|pin| device.inputs.contains(pin));
    }
    let clock = (device.clock == Clock::Term).then(|| inputs.remove(0));
    let registers: Vec<u32> = kinds
        .iter()
        .filter(|(_, kind)| *kind == CellKind::Registered)
        .map(|(macrocell, _)| macrocell.pin)
        .collect();
    let sources: Vec<u32> = inputs.iter().chain(&registers).copied().collect();
    let product = |random: &mut TestRng| {
        let mut product = Product::default();
        for _ in 0..below(random, 4) {
            let pin = sources[below(random, sources.len())];
            if product.literal(pin).is_none() {
                product.0.push((pin, below(random, 2) == 0));
            }
        }
        product.sorted()
    };
    for (macrocell, kind) in kinds {
        let limit = if kind == CellKind::Registered {
            macrocell.registered_terms
        } else {
            macrocell.combinational_terms
        };
        let sum = (0..below(random, limit as usize + 1)).map(|_| product(random)).collect();
        let is_active_low = match device.polarity {
            Polarity::Programmable => below(random, 2) == 0,
            Polarity::ActiveLow => true,
            Polarity::ActiveHigh => false,
        };
        let mut cell = Cell::new(macrocell.pin, kind, is_active_low, sum);
        if kind == CellKind::Registered {
            cell.clock = clock.map(|pin| Product(vec![(pin, true)]));
        }
        placement.cells.push(cell);
    }
    if device.has_global_reset && below(random, 2) == 0 {
        placement.sync_preset = Some(product(random)).filter(|product| !product.0.is_empty());
    }
    placement.pins = sources
        .iter()
        .map(|pin| PinName { pin: *pin, name: format!("s{pin}"), is_inverted: false })
        .collect();
    placement
}

/// Checks that the fuses and the decoded circuit give the same levels of all macrocells for random inputs, from power-up.
fn same_levels(map: &FuseMap, said: &Placement, random: &mut TestRng) {
    let circuit = logic(said, &[]).unwrap();
    let (mut chip, mut sim) = (Chip::new(map).unwrap(), LogicSim::new(&circuit));
    let clocks: Vec<u32> = match said.device.clock {
        Clock::Pin(pin) => vec![pin],
        Clock::Term => vec![2],
        Clock::None => Vec::new(),
    };
    let enables = chip.enable_pins();
    chip.put(&clocks.iter().chain(&enables).map(|pin| (*pin, 0)).collect::<Vec<_>>()).unwrap();
    chip.power_up().unwrap();
    for _ in 0..40 {
        let mut levels = Vec::new();
        for (id, input) in circuit.inputs.iter() {
            let pin: u32 = input.name.trim_start_matches("pin").parse().unwrap();
            let value = u64::from_le_bytes(random.random());
            levels.push((pin, value));
            sim.set_input(id, value);
        }
        chip.put(&levels).unwrap();
        for output in circuit.outputs.ids() {
            let pin: u32 = circuit.outputs[output].name.trim_start_matches("pin").parse().unwrap();
            assert_eq!(chip.drives(pin), u64::MAX, "pin {pin}");
            assert_eq!(chip.level(pin), sim.output(output), "pin {pin} of a {}", said.device.name);
        }
        for pin in &clocks {
            chip.pulse(*pin).unwrap();
        }
        sim.clock();
    }
}

#[test]
fn mapper_decoder_simulator_and_file_agree() {
    let mut random = TestRng::from_seed(RngAlgorithm::XorShift, &[11; 16]);
    for device in DEVICES.iter().filter(|device| device.layout.is_some()) {
        for _ in 0..12 {
            let placement = design(device, &mut random);
            let fuses = map(&placement).unwrap_or_else(|found| panic!("{placement:?}: {found:?}"));
            let said = decode(&fuses).unwrap();
            assert_eq!(differences(&placement, &said), [""; 0], "{placement:?}");
            same_levels(&fuses, &said, &mut random);
            let vectors = vectors(&fuses, &placement, &[], 20).unwrap();
            assert_eq!(failures(&fuses, &vectors, 1).unwrap(), []);
            let head = jedec::Head { lines: vec!["a*b".into()], pins: placement.pins.clone() };
            let text = jedec::write(&fuses, &head, &vectors);
            let (file, found) = jedec::read(FileId(0), &text);
            assert_eq!(found, [], "{text}");
            let file = file.unwrap();
            assert_eq!(file.fuse_map(Some(device)).unwrap(), fuses);
            assert_eq!(file.vectors, vectors);
            let names = file.pins();
            assert_eq!(names, placement.pins);
        }
    }
}

/// No fuse string causes a panic, and a decoded map is mapped to equivalent fuses.
#[test]
fn any_fuses_are_decoded_or_refused() {
    let mut random = TestRng::from_seed(RngAlgorithm::XorShift, &[12; 16]);
    let mut n_decoded = 0;
    for device in DEVICES {
        let Some(layout) = device.layout else { continue };
        for round in 0..20 {
            let mut fuses: Vec<bool> =
                (0..layout.n_fuses).map(|_| below(&mut random, 24) > round).collect();
            let mode = &layout.modes[below(&mut random, layout.modes.len())];
            for &(fuse, value) in mode.fuses {
                fuses[fuse as usize] = value;
            }
            let fuses = FuseMap { device, fuses, is_secured: false };
            let _ = Chip::new(&fuses);
            if let Ok(said) = decode(&fuses) {
                n_decoded += 1;
                let _ = logic(&said, &own_roles(&said));
                if let Ok(again) = map(&said) {
                    assert_eq!(differences(&said, &decode(&again).unwrap()), [""; 0]);
                }
            }
        }
    }
    assert!(n_decoded > 100, "{n_decoded}");
}
