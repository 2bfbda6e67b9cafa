//! ATF750C: the pins of a 22V10, twice its flip-flops. Equations only: its fuse map was not read anywhere.

use super::{Clock, Device, Figure, Polarity, PowerUp, Source, cell};

pub(super) const ATF750C: Device = Device {
    name: "atf750c",
    palasm: "ATV750",
    cupl: "v750c",
    n_pins: 24,
    inputs: &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13],
    macrocells: &[
        cell(14, 8, 8),
        cell(15, 10, 10),
        cell(16, 12, 12),
        cell(17, 14, 14),
        cell(18, 16, 16),
        cell(19, 16, 16),
        cell(20, 14, 14),
        cell(21, 12, 12),
        cell(22, 10, 10),
        cell(23, 8, 8),
    ],
    clock: Clock::Term,
    control_pins: &[],
    power_up: PowerUp::ByPolarity,
    polarity: Polarity::Programmable,
    has_global_reset: false,
    deaf_pins: &[],
    free_when_combinational: true,
    layout: None,
    burned_as: "ATF750C",
    programmer: None,
    figures: &[
        Figure {
            what: "pins, and a clock term for each macrocell",
            source: Source::Memory("Atmel data sheet ATF750C"),
        },
        Figure {
            what: "product terms of a macrocell, both of its sums taken together",
            source: Source::Memory("Atmel data sheet ATF750C"),
        },
        Figure {
            what: "flip-flops 0 after power-up",
            source: Source::Memory("Atmel data sheet ATF750C, power-up reset"),
        },
    ],
};
