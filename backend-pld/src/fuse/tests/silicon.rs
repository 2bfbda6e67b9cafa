//! Data-sheet behaviour, tested on single macrocells of the simulator.

use crate::device::Device;
use crate::fuse::sim::Chip;
use crate::fuse::{FuseMap, map};
use crate::placement::{Cell, CellKind, Placement, Product};

fn product(literals: &[(u32, bool)]) -> Product {
    Product(literals.to_vec())
}

fn burn(device: &str, change: impl FnOnce(&mut Placement)) -> FuseMap {
    let mut placement = Placement::new(Device::find(device).unwrap());
    change(&mut placement);
    map(&placement).unwrap()
}

/// All registers are 0 after power-up: the pins of a 22V10 depend on the polarity, those of a 16V8 are high.
#[test]
fn power_up() {
    for (device, plain, low) in
        [("gal22v10", false, true), ("gal20ra10", false, true), ("gal16v8", true, true)]
    {
        let fuses = burn(device, |placement| {
            for (pin, is_active_low) in [(17, false), (18, true)] {
                let mut cell = Cell::new(
                    pin,
                    CellKind::Registered,
                    is_active_low,
                    vec![product(&[(2, true)])],
                );
                cell.clock = (device == "gal20ra10").then(|| product(&[(3, true)]));
                placement.cells.push(cell);
            }
        });
        let mut chip = Chip::new(&fuses).unwrap();
        let enables: Vec<(u32, u64)> = chip.enable_pins().iter().map(|pin| (*pin, 0)).collect();
        chip.put(&enables).unwrap();
        assert_eq!((chip.level(17), chip.level(18)), (spread(plain), spread(low)), "{device}");
        assert_eq!((chip.q(17), chip.q(18)), (Some(0), Some(0)));
    }
}

fn spread(value: bool) -> u64 {
    if value { u64::MAX } else { 0 }
}

/// The feedback of a register is the value that its pin would show, in either polarity, even while the pin is disabled and pulled to another level.
#[test]
fn registers_are_read_behind_a_pin_that_is_off() {
    for is_active_low in [false, true] {
        let fuses = burn("gal22v10", |placement| {
            let mut source =
                Cell::new(14, CellKind::Registered, is_active_low, vec![product(&[(2, true)])]);
            source.enable = Some(product(&[(3, true)]));
            placement.cells.push(source);
            let shown = vec![product(&[(14, true)])];
            placement.cells.push(Cell::new(15, CellKind::Combinational, false, shown));
        });
        let mut chip = Chip::new(&fuses).unwrap();
        for data in [0, u64::MAX, 0x0F0F, 0] {
            chip.put(&[(1, 0), (2, data), (3, u64::MAX)]).unwrap();
            chip.pulse(1).unwrap();
            let level = if is_active_low { !data } else { data };
            assert_eq!(chip.level(14), level);
            assert_eq!(chip.level(15), level);
            chip.put(&[(3, 0), (14, !level)]).unwrap();
            assert_eq!((chip.drives(14), chip.level(14), chip.level(15)), (0, !level, level));
        }
    }
}

/// The asynchronous reset clears at once and as long as it is active; the preset waits for the clock.
#[test]
fn reset_and_preset_of_a_22v10() {
    let fuses = burn("gal22v10", |placement| {
        placement.async_reset = Some(product(&[(2, true)]));
        placement.sync_preset = Some(product(&[(3, true)]));
        placement.cells.push(Cell::new(14, CellKind::Registered, false, Vec::new()));
        placement.cells.push(Cell::new(15, CellKind::Registered, true, Vec::new()));
    });
    let mut chip = Chip::new(&fuses).unwrap();
    chip.put(&[(1, 0), (2, 0), (3, u64::MAX)]).unwrap();
    assert_eq!((chip.level(14), chip.level(15)), (0, u64::MAX));
    chip.pulse(1).unwrap();
    assert_eq!((chip.level(14), chip.level(15)), (u64::MAX, 0));
    chip.put(&[(2, u64::MAX)]).unwrap();
    assert_eq!((chip.level(14), chip.level(15)), (0, u64::MAX));
    chip.pulse(1).unwrap();
    assert_eq!((chip.level(14), chip.level(15)), (0, u64::MAX));
    chip.put(&[(2, 0)]).unwrap();
    assert_eq!((chip.level(14), chip.level(15)), (0, u64::MAX));
}

/// Each register of a 20RA10 has its own clock, reset and preset; if both of the latter are true, it is transparent.
#[test]
fn the_terms_of_a_20ra10() {
    let fuses = burn("gal20ra10", |placement| {
        let mut cell = Cell::new(14, CellKind::Registered, false, vec![product(&[(2, true)])]);
        cell.clock = Some(product(&[(3, true), (4, false)]));
        cell.reset = Some(product(&[(5, true)]));
        cell.set = Some(product(&[(6, true)]));
        placement.cells.push(cell);
        // A ripple counter: this one is clocked by the falling edge of the first.
        let mut cell = Cell::new(15, CellKind::Registered, false, vec![product(&[(15, false)])]);
        cell.clock = Some(product(&[(14, false)]));
        placement.cells.push(cell);
    });
    let mut chip = Chip::new(&fuses).unwrap();
    let low = [(2, 0), (3, 0), (4, 0), (5, 0), (6, 0), (13, 0)];
    chip.put(&low).unwrap();
    chip.power_up().unwrap();
    assert_eq!((chip.level(14), chip.level(15)), (0, 0));
    chip.put(&[(2, u64::MAX)]).unwrap();
    assert_eq!(chip.level(14), 0);
    chip.put(&[(3, u64::MAX), (4, 0xFF)]).unwrap();
    assert_eq!(chip.level(14), !0xFF, "only if pin 4 is low");
    chip.put(&[(5, 0xF000)]).unwrap();
    assert_eq!(
        (chip.level(14), chip.level(15)),
        (!0xF0FF, 0xF000),
        "reset at once, and the next one counts"
    );
    chip.put(&[(5, 0), (6, 0x0F)]).unwrap();
    assert_eq!(chip.level(14), !0xF0F0);
    chip.put(&[(5, 0xF), (6, 0xF), (2, 0x3)]).unwrap();
    assert_eq!(chip.level(14) & 0xF, 0x3, "the sum itself");
    chip.put(&[(13, u64::MAX)]).unwrap();
    assert_eq!(chip.drives(14), 0);
}

/// A pin that depends on its own complement never settles.
#[test]
fn an_oscillator_is_reported() {
    let fuses = burn("gal22v10", |placement| {
        let own = vec![product(&[(14, false)])];
        placement.cells.push(Cell::new(14, CellKind::Combinational, false, own));
    });
    let found = Chip::new(&fuses).unwrap_err();
    assert!(found.message.contains("14"), "{found:?}");
}

/// A latch built from two gates keeps its value.
#[test]
fn a_latch_of_gates_holds() {
    let fuses = burn("gal16v8", |placement| {
        let q = vec![product(&[(2, true)]), product(&[(13, true), (3, false)])];
        placement.cells.push(Cell::new(13, CellKind::Combinational, false, q));
    });
    let mut chip = Chip::new(&fuses).unwrap();
    chip.put(&[(2, 0), (3, u64::MAX)]).unwrap();
    assert_eq!(chip.level(13), 0);
    chip.put(&[(2, 5), (3, 0)]).unwrap();
    chip.put(&[(2, 0)]).unwrap();
    assert_eq!(chip.level(13), 5);
}
