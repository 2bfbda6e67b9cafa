//! GAL16V8 and GAL20V8: eight macrocells, three modes of the whole device.

use super::layout::{
    CellFuses, Enable, Feedback, Layout, Mode, PolarityGate, Register, Shape, cells,
};
use super::{Clock, DIP_20, DIP_24, Device, Figure, Polarity, PowerUp, Source, cell};

/// The devices of this file.
pub(super) const DEVICES: &[Device] = &[GAL16V8, GAL20V8];

/// The parts of this fuse map that `minipro` lists and that public projects use; the usual one first.
pub(super) const PARTS_16V8: &[&str] = &["GAL16V8D", "ATF16V8B", "ATF16V8C"];

const READ: &str = "device tables of galette and MAME jedutil; golden files of galette";

pub(super) const NO_REGISTER: Shape = Shape {
    kind: Some(false),
    register: Register::None,
    enable: Enable::Always,
    sum: 0,
    feedback: Feedback::Pin,
    polarity: PolarityGate::BeforeRegister,
};
const INPUT: Shape = Shape { kind: Some(true), enable: Enable::Never, ..NO_REGISTER };
pub(super) const WITH_ENABLE: Shape =
    Shape { kind: Some(true), enable: Enable::Row(0), sum: 1, ..NO_REGISTER };

pub(super) const fn registered(enable_pin: u32) -> Shape {
    Shape {
        kind: Some(false),
        register: Register::Pin(1),
        enable: Enable::PinLow(enable_pin),
        sum: 0,
        feedback: Feedback::NotQ,
        polarity: PolarityGate::BeforeRegister,
    }
}

static CELLS_16: [CellFuses; 8] = cells(19, 8, 2048, Some(2120));
static CELLS_20: [CellFuses; 8] = cells(22, 8, 2560, Some(2632));

/// The pins that the array of a GAL16V8 reads in its complex mode, with their columns; also those of the PALs that it replaces.
pub(super) const COMPLEX_16: &[(u32, u32)] = &[
    (1, 2),
    (2, 0),
    (3, 4),
    (4, 8),
    (5, 12),
    (6, 16),
    (7, 20),
    (8, 24),
    (9, 28),
    (11, 30),
    (13, 26),
    (14, 22),
    (15, 18),
    (16, 14),
    (17, 10),
    (18, 6),
];
/// The pins that the array of a GAL16V8 reads in its registered mode, with their columns; also those of the PALs that it replaces.
pub(super) const REGISTERED_16: &[(u32, u32)] = &[
    (2, 0),
    (3, 4),
    (4, 8),
    (5, 12),
    (6, 16),
    (7, 20),
    (8, 24),
    (9, 28),
    (12, 30),
    (13, 26),
    (14, 22),
    (15, 18),
    (16, 14),
    (17, 10),
    (18, 6),
    (19, 2),
];

/// The fuses of a GAL16V8: SYN is 2192, and AC0 is 2193.
pub(super) static LAYOUT_16: Layout = Layout {
    n_fuses: 2194,
    n_columns: 32,
    modes: &[
        Mode {
            name: "simple",
            fuses: &[(2192, true), (2193, false)],
            columns: &[
                (1, 2),
                (2, 0),
                (3, 4),
                (4, 8),
                (5, 12),
                (6, 16),
                (7, 20),
                (8, 24),
                (9, 28),
                (11, 30),
                (12, 26),
                (13, 22),
                (14, 18),
                (17, 14),
                (18, 10),
                (19, 6),
            ],
            shapes: &[NO_REGISTER, INPUT],
            deaf: &[15, 16],
        },
        Mode {
            name: "complex",
            fuses: &[(2192, true), (2193, true)],
            columns: COMPLEX_16,
            shapes: &[WITH_ENABLE],
            deaf: &[12, 19],
        },
        Mode {
            name: "registered",
            fuses: &[(2192, false), (2193, true)],
            columns: REGISTERED_16,
            shapes: &[registered(11), WITH_ENABLE],
            deaf: &[],
        },
    ],
    cells: &CELLS_16,
    async_reset: None,
    sync_preset: None,
    signature: Some(2056),
    row_switches: Some(2128),
    source: READ,
};

/// The fuses of a GAL20V8: SYN is 2704, and AC0 is 2705.
pub(super) static LAYOUT_20: Layout = Layout {
    n_fuses: 2706,
    n_columns: 40,
    modes: &[
        Mode {
            name: "simple",
            fuses: &[(2704, true), (2705, false)],
            columns: &[
                (1, 2),
                (2, 0),
                (3, 4),
                (4, 8),
                (5, 12),
                (6, 16),
                (7, 20),
                (8, 24),
                (9, 28),
                (10, 32),
                (11, 36),
                (13, 38),
                (14, 34),
                (15, 30),
                (16, 26),
                (17, 22),
                (20, 18),
                (21, 14),
                (22, 10),
                (23, 6),
            ],
            shapes: &[NO_REGISTER, INPUT],
            deaf: &[18, 19],
        },
        Mode {
            name: "complex",
            fuses: &[(2704, true), (2705, true)],
            columns: &[
                (1, 2),
                (2, 0),
                (3, 4),
                (4, 8),
                (5, 12),
                (6, 16),
                (7, 20),
                (8, 24),
                (9, 28),
                (10, 32),
                (11, 36),
                (13, 38),
                (14, 34),
                (16, 30),
                (17, 26),
                (18, 22),
                (19, 18),
                (20, 14),
                (21, 10),
                (23, 6),
            ],
            shapes: &[WITH_ENABLE],
            deaf: &[15, 22],
        },
        Mode {
            name: "registered",
            fuses: &[(2704, false), (2705, true)],
            columns: &[
                (2, 0),
                (3, 4),
                (4, 8),
                (5, 12),
                (6, 16),
                (7, 20),
                (8, 24),
                (9, 28),
                (10, 32),
                (11, 36),
                (14, 38),
                (15, 34),
                (16, 30),
                (17, 26),
                (18, 22),
                (19, 18),
                (20, 14),
                (21, 10),
                (22, 6),
                (23, 2),
            ],
            shapes: &[registered(13), WITH_ENABLE],
            deaf: &[],
        },
    ],
    cells: &CELLS_20,
    async_reset: None,
    sync_preset: None,
    signature: Some(2568),
    row_switches: Some(2640),
    source: READ,
};

/// The known figures of both devices, with their sources.
pub(super) const FIGURES: &[Figure] = &[
    Figure { what: "fuse numbers, rows and columns", source: Source::Read(READ) },
    Figure { what: "product terms of a macrocell", source: Source::Read(READ) },
    Figure { what: "pins read in each mode", source: Source::Read(READ) },
    Figure {
        what: "polarity gate before the flip-flop",
        source: Source::Read("MAME jedutil and WinCUPL pairs of its regression tests"),
    },
    Figure {
        what: "registered pins high after power-up",
        source: Source::Memory("Lattice data sheets GAL16V8 and GAL20V8, power-up reset"),
    },
];

const GAL16V8: Device = Device {
    name: "gal16v8",
    aliases: &[
        "palce16v8",
        "atf16v8",
        "atf16v8b",
        "g16v8",
        "g16v8a",
        "g16v8ms",
        "g16v8ma",
        "g16v8s",
        "g16v8as",
        "g16v8cp",
        "g16v8cps",
        "g16v8cpas",
        "g16v8cpma",
        "g16v8cpms",
        "p16v8",
        "atf16v8c",
    ],
    palasm: "PALCE16V8",
    cupl: "g16v8",
    package: "DIP20",
    n_pins: 20,
    grounds: DIP_20.0,
    supplies: DIP_20.1,
    inputs: &[2, 3, 4, 5, 6, 7, 8, 9],
    macrocells: &[
        cell(12, 8, 7),
        cell(13, 8, 7),
        cell(14, 8, 7),
        cell(15, 8, 7),
        cell(16, 8, 7),
        cell(17, 8, 7),
        cell(18, 8, 7),
        cell(19, 8, 7),
    ],
    clock: Clock::Pin(1),
    control_pins: &[11],
    jtag_pins: &[],
    blocks: None,
    power_up: PowerUp::PinsHigh,
    polarity: Polarity::Programmable,
    has_global_reset: false,
    deaf_pins: &[12, 19],
    free_when_combinational: true,
    layout: Some(&LAYOUT_16),
    burned_as: "GAL16V8",
    galasm: "GAL16V8",
    programmers: PARTS_16V8,
    figures: FIGURES,
};

const GAL20V8: Device = Device {
    name: "gal20v8",
    aliases: &[
        "palce20v8",
        "atf20v8",
        "g20v8",
        "g20v8a",
        "g20v8ms",
        "g20v8ma",
        "g20v8s",
        "g20v8as",
        "g20v8cp",
        "g20v8cps",
        "g20v8cpas",
        "g20v8cpma",
        "g20v8cpms",
        "p20v8",
        "atf20v8b",
        "pal20l8",
        "pal20r4",
        "pal20r6",
        "pal20r8",
    ],
    palasm: "PALCE20V8",
    cupl: "g20v8",
    package: "DIP24",
    n_pins: 24,
    grounds: DIP_24.0,
    supplies: DIP_24.1,
    inputs: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 14, 23],
    macrocells: &[
        cell(15, 8, 7),
        cell(16, 8, 7),
        cell(17, 8, 7),
        cell(18, 8, 7),
        cell(19, 8, 7),
        cell(20, 8, 7),
        cell(21, 8, 7),
        cell(22, 8, 7),
    ],
    clock: Clock::Pin(1),
    control_pins: &[13],
    jtag_pins: &[],
    blocks: None,
    power_up: PowerUp::PinsHigh,
    polarity: Polarity::Programmable,
    has_global_reset: false,
    deaf_pins: &[15, 22],
    free_when_combinational: true,
    layout: Some(&LAYOUT_20),
    burned_as: "GAL20V8",
    galasm: "GAL20V8",
    programmers: &["GAL20V8B"],
    figures: FIGURES,
};
