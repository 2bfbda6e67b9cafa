//! GAL22V10: ten macrocells of eight to sixteen product terms, a common reset and preset.

use super::layout::{
    CellFuses, Enable, Feedback, Layout, Mode, PolarityGate, Register, Setting, Shape,
};
use super::{Clock, DIP_24, Device, Figure, Polarity, PowerUp, Source, cell};

/// The devices of this file.
pub(super) const DEVICES: &[Device] = &[GAL22V10];

const READ: &str = "device tables of galette and MAME jedutil; golden files of galette";

const fn fuses(pin: u32, row: u32, n_rows: u32) -> CellFuses {
    let polarity = 5808 + 2 * (23 - pin);
    let kind = Some(Setting::Fuse(polarity + 1));
    CellFuses { pin, row, n_rows, polarity: Setting::Fuse(polarity), kind }
}

/// S0 and S1 of each macrocell are adjacent, from fuse 5808 on, pin 23 first.
static LAYOUT: Layout = Layout {
    n_fuses: 5892,
    n_columns: 44,
    modes: &[Mode {
        name: "",
        fuses: &[],
        columns: &[
            (1, 0),
            (2, 4),
            (3, 8),
            (4, 12),
            (5, 16),
            (6, 20),
            (7, 24),
            (8, 28),
            (9, 32),
            (10, 36),
            (11, 40),
            (13, 42),
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
        shapes: &[
            Shape {
                kind: Some(true),
                register: Register::None,
                enable: Enable::Row(0),
                sum: 1,
                feedback: Feedback::Pin,
                polarity: PolarityGate::AfterRegister,
            },
            Shape {
                kind: Some(false),
                register: Register::Pin(1),
                enable: Enable::Row(0),
                sum: 1,
                feedback: Feedback::NotQ,
                polarity: PolarityGate::AfterRegister,
            },
        ],
        deaf: &[],
    }],
    cells: &[
        fuses(23, 1, 9),
        fuses(22, 10, 11),
        fuses(21, 21, 13),
        fuses(20, 34, 15),
        fuses(19, 49, 17),
        fuses(18, 66, 17),
        fuses(17, 83, 15),
        fuses(16, 98, 13),
        fuses(15, 111, 11),
        fuses(14, 122, 9),
    ],
    async_reset: Some(0),
    sync_preset: Some(131),
    signature: Some(5828),
    row_switches: None,
    source: READ,
};

const GAL22V10: Device = Device {
    name: "gal22v10",
    aliases: &[
        "pal22v10",
        "palce22v10",
        "ampal22v10",
        "atf22v10",
        "atf22v10c",
        "g22v10",
        "p22v10",
        "g22v10cp",
        "g22lv10",
        "g22lv10cp",
        "atf22lv10",
        "atf22lv10c",
    ],
    palasm: "PAL22V10",
    cupl: "g22v10",
    package: "DIP24",
    n_pins: 24,
    grounds: DIP_24.0,
    supplies: DIP_24.1,
    inputs: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13],
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
    clock: Clock::Pin(1),
    control_pins: &[],
    jtag_pins: &[],
    blocks: None,
    power_up: PowerUp::ByPolarity,
    polarity: Polarity::Programmable,
    has_global_reset: true,
    deaf_pins: &[],
    free_when_combinational: true,
    layout: Some(&LAYOUT),
    burned_as: "GAL22V10",
    galasm: "GAL22V10",
    programmers: &["GAL22V10D", "ATF22V10C", "ATF22V10CQZ"],
    figures: &[
        Figure { what: "fuse numbers, rows and columns", source: Source::Read(READ) },
        Figure { what: "product terms of a macrocell", source: Source::Read(READ) },
        Figure {
            what: "registered feedback is the complement of Q, polarity gate after the flip-flop",
            source: Source::Read(
                "galette after its fix of 2024, and MAME's WinCUPL pair gal22v10_registered_mode",
            ),
        },
        Figure {
            what: "flip-flops 0 after power-up",
            source: Source::Memory("Lattice data sheet GAL22V10, power-up reset"),
        },
    ],
};
