//! The bipolar PALs with 20 pins, and the same pins and limits on the GAL16V8 that replaces them (`pal16r8-as-gal16v8`).

use super::layout::Layout;
use super::{
    Clock, DIP_20, Device, Figure, Macrocell, Polarity, PowerUp, Source, bipolar, cell, v8,
};

/// The devices of this file.
pub(super) const DEVICES: &[Device] = &[
    PAL16L8,
    PAL16R4,
    PAL16R6,
    PAL16R8,
    PAL10H8,
    PAL12H6,
    PAL14H4,
    PAL16H2,
    PAL10L8,
    PAL12L6,
    PAL14L4,
    PAL16L2,
    PAL16L8_AS_GAL,
    PAL16R4_AS_GAL,
    PAL16R6_AS_GAL,
    PAL16R8_AS_GAL,
    PAL10H8_AS_GAL,
    PAL12H6_AS_GAL,
    PAL14H4_AS_GAL,
    PAL16H2_AS_GAL,
    PAL10L8_AS_GAL,
    PAL12L6_AS_GAL,
    PAL14L4_AS_GAL,
    PAL16L2_AS_GAL,
];

const READ: &str = "device tables of MAME jedutil; files of National's EQN2JED for PAL12L6 and PAL16R8 decode to their equations";

const FIGURES: &[Figure] = &[
    Figure { what: "pins, product terms, polarity", source: Source::Read(READ) },
    Figure { what: "fuse numbers, rows and columns", source: Source::Read(READ) },
];

const WITH_REGISTERS: &[Figure] = &[
    FIGURES[0],
    FIGURES[1],
    Figure {
        what: "registered pins high after power-up",
        source: Source::Memory(
            "data sheets of later manufacturers; the first bipolar parts do not guarantee it",
        ),
    },
];

const AS_GAL: &[Figure] = &[
    FIGURES[0],
    Figure {
        what: "fuse map of the GAL16V8 that replaces it",
        source: Source::Read("device tables of galette; golden files of galette"),
    },
    Figure {
        what: "registered pins high after power-up",
        source: Source::Memory("Lattice data sheet GAL16V8"),
    },
];

/// A macrocell for registered functions only.
const fn registers(pin: u32) -> Macrocell {
    cell(pin, 8, 0)
}

/// A macrocell for combinational functions with an enable term.
const fn gate(pin: u32) -> Macrocell {
    cell(pin, 0, 7)
}

const fn plain(
    [name, palasm, cupl]: [&'static str; 3],
    macrocells: &'static [Macrocell],
    layout: &'static Layout,
) -> Device {
    Device {
        name,
        aliases: &[],
        palasm,
        cupl,
        package: "DIP20",
        n_pins: 20,
        grounds: DIP_20.0,
        supplies: DIP_20.1,
        inputs: &[2, 3, 4, 5, 6, 7, 8, 9],
        macrocells,
        clock: Clock::Pin(1),
        control_pins: &[11],
        jtag_pins: &[],
        blocks: None,
        power_up: PowerUp::PinsHigh,
        has_global_reset: false,
        deaf_pins: &[],
        free_when_combinational: false,
        polarity: Polarity::ActiveLow,
        layout: Some(layout),
        burned_as: palasm,
        galasm: "GAL16V8",
        programmers: &[],
        figures: WITH_REGISTERS,
    }
}

/// A device without registers: all pins except the outputs are inputs.
const fn combinational(
    names: [&'static str; 3],
    polarity: Polarity,
    inputs: &'static [u32],
    macrocells: &'static [Macrocell],
    deaf_pins: &'static [u32],
    layout: &'static Layout,
) -> Device {
    Device {
        inputs,
        control_pins: &[],
        clock: Clock::None,
        deaf_pins,
        free_when_combinational: true,
        polarity,
        figures: FIGURES,
        ..plain(names, macrocells, layout)
    }
}

/// The device entry of a GAL16V8 that replaces a PAL.
const fn as_gal(name: &'static str, pal: Device) -> Device {
    Device {
        name,
        layout: Some(&v8::LAYOUT_16),
        burned_as: "GAL16V8",
        programmers: super::v8::PARTS_16V8,
        figures: AS_GAL,
        ..pal
    }
}

const PAL16R8: Device = plain(
    ["pal16r8", "PAL16R8", "p16r8"],
    &[
        registers(12),
        registers(13),
        registers(14),
        registers(15),
        registers(16),
        registers(17),
        registers(18),
        registers(19),
    ],
    &bipolar::R8,
);

const PAL16R6: Device = plain(
    ["pal16r6", "PAL16R6", "p16r6"],
    &[
        gate(12),
        registers(13),
        registers(14),
        registers(15),
        registers(16),
        registers(17),
        registers(18),
        gate(19),
    ],
    &bipolar::R6,
);

const PAL16R4: Device = plain(
    ["pal16r4", "PAL16R4", "p16r4"],
    &[
        gate(12),
        gate(13),
        registers(14),
        registers(15),
        registers(16),
        registers(17),
        gate(18),
        gate(19),
    ],
    &bipolar::R4,
);

const NINE: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 11];
const SIX: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 19];
const FOUR: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 18, 19];
const TWO: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14, 17, 18, 19];

const PAL16L8: Device = combinational(
    ["pal16l8", "PAL16L8", "p16l8"],
    Polarity::ActiveLow,
    NINE,
    &[gate(12), gate(13), gate(14), gate(15), gate(16), gate(17), gate(18), gate(19)],
    &[12, 19],
    &bipolar::L8,
);

const OF_EIGHT: &[Macrocell] = &[
    cell(12, 0, 2),
    cell(13, 0, 2),
    cell(14, 0, 2),
    cell(15, 0, 2),
    cell(16, 0, 2),
    cell(17, 0, 2),
    cell(18, 0, 2),
    cell(19, 0, 2),
];
const OF_SIX: &[Macrocell] = &[
    cell(13, 0, 4),
    cell(14, 0, 2),
    cell(15, 0, 2),
    cell(16, 0, 2),
    cell(17, 0, 2),
    cell(18, 0, 4),
];
const OF_FOUR: &[Macrocell] = &[cell(14, 0, 4), cell(15, 0, 4), cell(16, 0, 4), cell(17, 0, 4)];
const OF_TWO: &[Macrocell] = &[cell(15, 0, 8), cell(16, 0, 8)];

macro_rules! small {
    ($name:ident, $lower:literal, $upper:literal, $cupl:literal, $polarity:ident, $inputs:expr, $cells:expr, $deaf:expr, $map:ident) => {
        const $name: Device = combinational(
            [$lower, $upper, $cupl],
            Polarity::$polarity,
            $inputs,
            $cells,
            $deaf,
            &bipolar::$map,
        );
    };
}

const DEAF_EIGHT: &[u32] = &[12, 13, 14, 15, 16, 17, 18, 19];
const DEAF_SIX: &[u32] = &[13, 14, 15, 16, 17, 18];
const DEAF_FOUR: &[u32] = &[14, 15, 16, 17];
const DEAF_TWO: &[u32] = &[15, 16];

small!(PAL10H8, "pal10h8", "PAL10H8", "p10h8", ActiveHigh, NINE, OF_EIGHT, DEAF_EIGHT, H8);
small!(PAL12H6, "pal12h6", "PAL12H6", "p12h6", ActiveHigh, SIX, OF_SIX, DEAF_SIX, H6);
small!(PAL14H4, "pal14h4", "PAL14H4", "p14h4", ActiveHigh, FOUR, OF_FOUR, DEAF_FOUR, H4);
small!(PAL16H2, "pal16h2", "PAL16H2", "p16h2", ActiveHigh, TWO, OF_TWO, DEAF_TWO, H2);
small!(PAL10L8, "pal10l8", "PAL10L8", "p10l8", ActiveLow, NINE, OF_EIGHT, DEAF_EIGHT, L8_OF_10);
small!(PAL12L6, "pal12l6", "PAL12L6", "p12l6", ActiveLow, SIX, OF_SIX, DEAF_SIX, L6);
small!(PAL14L4, "pal14l4", "PAL14L4", "p14l4", ActiveLow, FOUR, OF_FOUR, DEAF_FOUR, L4);
small!(PAL16L2, "pal16l2", "PAL16L2", "p16l2", ActiveLow, TWO, OF_TWO, DEAF_TWO, L2);

const PAL16L8_AS_GAL: Device = as_gal("pal16l8-as-gal16v8", PAL16L8);
const PAL16R4_AS_GAL: Device = as_gal("pal16r4-as-gal16v8", PAL16R4);
const PAL16R6_AS_GAL: Device = as_gal("pal16r6-as-gal16v8", PAL16R6);
const PAL16R8_AS_GAL: Device = as_gal("pal16r8-as-gal16v8", PAL16R8);
const PAL10H8_AS_GAL: Device = as_gal("pal10h8-as-gal16v8", PAL10H8);
const PAL12H6_AS_GAL: Device = as_gal("pal12h6-as-gal16v8", PAL12H6);
const PAL14H4_AS_GAL: Device = as_gal("pal14h4-as-gal16v8", PAL14H4);
const PAL16H2_AS_GAL: Device = as_gal("pal16h2-as-gal16v8", PAL16H2);
const PAL10L8_AS_GAL: Device = as_gal("pal10l8-as-gal16v8", PAL10L8);
const PAL12L6_AS_GAL: Device = as_gal("pal12l6-as-gal16v8", PAL12L6);
const PAL14L4_AS_GAL: Device = as_gal("pal14l4-as-gal16v8", PAL14L4);
const PAL16L2_AS_GAL: Device = as_gal("pal16l2-as-gal16v8", PAL16L2);
