//! GAL20RA10: ten macrocells, each with its own clock, reset and preset.

use super::layout::{
    CellFuses, Enable, Feedback, Layout, Mode, PolarityGate, Register, Shape, cells,
};
use super::{Clock, DIP_24, Device, Figure, Polarity, PowerUp, Source, cell};

/// The devices of this file.
pub(super) const DEVICES: &[Device] = &[GAL20RA10];

const READ: &str = "device tables of galette and MAME jedutil; golden files of galette";

static CELLS: [CellFuses; 10] = cells(23, 8, 3200, None);

static LAYOUT: Layout = Layout {
    n_fuses: 3274,
    n_columns: 40,
    modes: &[Mode {
        name: "",
        fuses: &[],
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
        shapes: &[Shape {
            kind: None,
            register: Register::Rows { clock: 1, reset: 2, set: 3 },
            enable: Enable::PinLowAndRow(13, 0),
            sum: 4,
            feedback: Feedback::Pin,
            polarity: PolarityGate::AfterRegister,
        }],
        deaf: &[],
    }],
    cells: &CELLS,
    async_reset: None,
    sync_preset: None,
    signature: Some(3210),
    row_switches: None,
    source: READ,
};

const GAL20RA10: Device = Device {
    name: "gal20ra10",
    aliases: &["pal20ra10", "palce20ra10", "p20ra10", "g20ra10"],
    palasm: "PAL20RA10",
    cupl: "p20ra10",
    package: "DIP24",
    n_pins: 24,
    grounds: DIP_24.0,
    supplies: DIP_24.1,
    inputs: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
    macrocells: &[
        cell(14, 4, 4),
        cell(15, 4, 4),
        cell(16, 4, 4),
        cell(17, 4, 4),
        cell(18, 4, 4),
        cell(19, 4, 4),
        cell(20, 4, 4),
        cell(21, 4, 4),
        cell(22, 4, 4),
        cell(23, 4, 4),
    ],
    clock: Clock::Term,
    control_pins: &[1, 13],
    jtag_pins: &[],
    blocks: None,
    power_up: PowerUp::ByPolarity,
    polarity: Polarity::Programmable,
    has_global_reset: false,
    deaf_pins: &[],
    free_when_combinational: false,
    layout: Some(&LAYOUT),
    burned_as: "GAL20RA10",
    galasm: "GAL20RA10",
    programmers: &[],
    figures: &[
        Figure { what: "fuse numbers, rows and columns", source: Source::Read(READ) },
        Figure { what: "product terms of a macrocell", source: Source::Read(READ) },
        Figure {
            what: "enable by pin 13 and a term, register transparent while reset and preset are true",
            source: Source::Read("GALer documentation, section on the GAL20RA10"),
        },
        Figure {
            what: "feedback from the pin, polarity gate after the flip-flop",
            source: Source::Memory("Lattice data sheet GAL20RA10, macrocell diagram"),
        },
        Figure {
            what: "flip-flops 0 after power-up",
            source: Source::Memory("Lattice data sheet GAL20RA10, power-up reset"),
        },
    ],
};
