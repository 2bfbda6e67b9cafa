//! ATF750C: the pins of a 22V10 with twice its flip-flops. Equations only: no source for its fuse map was read.

use super::{Clock, DIP_24, Device, Figure, FlipFlop, Macrocell, Polarity, PowerUp, Source, cell};

/// The devices of this file.
pub(super) const DEVICES: &[Device] = &[ATF750C];

/// A macrocell in which only the flip-flop at the pin is used, with all product terms.
const fn both(pin: u32, terms: u32) -> Macrocell {
    Macrocell { flip_flops: &[FlipFlop::D, FlipFlop::T], ..cell(pin, terms, terms) }
}

const ATF750C: Device = Device {
    name: "atf750c",
    aliases: &["atf750", "v750"],
    palasm: "ATV750",
    cupl: "v750c",
    package: "DIP24",
    n_pins: 24,
    grounds: DIP_24.0,
    supplies: DIP_24.1,
    inputs: &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13],
    macrocells: &[
        both(14, 8),
        both(15, 10),
        both(16, 12),
        both(17, 14),
        both(18, 16),
        both(19, 16),
        both(20, 14),
        both(21, 12),
        both(22, 10),
        both(23, 8),
    ],
    clock: Clock::Term,
    control_pins: &[],
    jtag_pins: &[],
    blocks: None,
    power_up: PowerUp::ByPolarity,
    polarity: Polarity::Programmable,
    has_global_reset: false,
    deaf_pins: &[],
    free_when_combinational: true,
    layout: None,
    burned_as: "ATF750C",
    galasm: "ATF750C",
    programmers: &[],
    figures: &[
        Figure {
            what: "pins of a 22V10, twice its flip-flops, each individually D or T",
            source: Source::Read("forum.6502.org, thread 8411 on the ATF750C"),
        },
        Figure {
            what: "171 rows of 84 columns: 120 terms of sums, and an enable, two clocks and two resets for each of ten macrocells, and a preset",
            source: Source::Read(
                "sizes from the software afterburner; their distribution is our own calculation",
            ),
        },
        Figure {
            what: "product terms of a macrocell, both of its sums together; a clock term for each",
            source: Source::Memory("Atmel data sheet ATF750C"),
        },
        Figure {
            what: "flip-flops 0 after power-up, polarity gate after them",
            source: Source::Memory("Atmel data sheet ATF750C, power-up reset"),
        },
    ],
};
