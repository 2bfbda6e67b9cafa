//! The fuse positions of the bipolar PALs with 20 pins. Only the array has fuses: polarity, registers and enables are fixed by the device.

use super::layout::{CellFuses, Layout, Mode, Setting, Shape};
use super::v8;

/// A sum without an enable term.
const OUTPUT: bool = false;
/// A flip-flop without an enable term.
const REGISTER: bool = false;
/// A sum with an enable term in its first row.
const SWITCHED: bool = true;

const fn cell(pin: u32, row: u32, n_rows: u32, kind: bool, is_high: bool) -> CellFuses {
    CellFuses {
        pin,
        row,
        n_rows,
        polarity: Setting::Fixed(is_high),
        kind: Some(Setting::Fixed(kind)),
    }
}

/// Eight macrocells of eight rows, from pin 19 down: the middle `n_registers` are registers, and the outer ones have an enable term.
const fn eights(n_registers: u32) -> [CellFuses; 8] {
    let mut cells = [cell(0, 0, 8, SWITCHED, false); 8];
    let (mut at, outer) = (0, (8 - n_registers) / 2);
    while at < 8 {
        let kind = if at < outer || at >= 8 - outer { SWITCHED } else { REGISTER };
        cells[at as usize] = cell(19 - at, at * 8, 8, kind, false);
        at += 1;
    }
    cells
}

/// Macrocells from the highest pin down with these numbers of rows.
const fn rows<const N: usize>(highest: u32, n_rows: [u32; N], is_high: bool) -> [CellFuses; N] {
    let mut cells = [cell(0, 0, 0, OUTPUT, is_high); N];
    let (mut at, mut row) = (0, 0);
    while at < N {
        cells[at] = cell(highest - at as u32, row, n_rows[at], OUTPUT, is_high);
        row += n_rows[at];
        at += 1;
    }
    cells
}

const fn map(
    n_rows: u32,
    n_columns: u32,
    modes: &'static [Mode],
    cells: &'static [CellFuses],
) -> Layout {
    Layout {
        n_fuses: n_rows * n_columns,
        n_columns,
        modes,
        cells,
        async_reset: None,
        sync_preset: None,
        signature: None,
        row_switches: None,
        source: "device tables of MAME jedutil",
    }
}

const fn mode(
    columns: &'static [(u32, u32)],
    shapes: &'static [Shape],
    deaf: &'static [u32],
) -> Mode {
    Mode { name: "", fuses: &[], columns, shapes, deaf }
}

const PLAIN: &[Shape] = &[v8::NO_REGISTER];

static GATES: [Mode; 1] = [mode(v8::COMPLEX_16, &[v8::WITH_ENABLE], &[12, 19])];
static REGISTERS: [Mode; 1] =
    [mode(v8::REGISTERED_16, &[v8::registered(11), v8::WITH_ENABLE], &[])];

static CELLS_L8: [CellFuses; 8] = eights(0);
static CELLS_R4: [CellFuses; 8] = eights(4);
static CELLS_R6: [CellFuses; 8] = eights(6);
static CELLS_R8: [CellFuses; 8] = eights(8);
pub(super) static L8: Layout = map(64, 32, &GATES, &CELLS_L8);
pub(super) static R4: Layout = map(64, 32, &REGISTERS, &CELLS_R4);
pub(super) static R6: Layout = map(64, 32, &REGISTERS, &CELLS_R6);
pub(super) static R8: Layout = map(64, 32, &REGISTERS, &CELLS_R8);

static OF_EIGHT: [Mode; 1] = [mode(
    &[(1, 2), (2, 0), (3, 4), (4, 6), (5, 8), (6, 10), (7, 12), (8, 14), (9, 16), (11, 18)],
    PLAIN,
    &[12, 13, 14, 15, 16, 17, 18, 19],
)];
static OF_SIX: [Mode; 1] = [mode(
    &[
        (1, 2),
        (2, 0),
        (3, 4),
        (4, 8),
        (5, 10),
        (6, 12),
        (7, 14),
        (8, 16),
        (9, 20),
        (11, 22),
        (12, 18),
        (19, 6),
    ],
    PLAIN,
    &[13, 14, 15, 16, 17, 18],
)];
static OF_FOUR: [Mode; 1] = [mode(
    &[
        (1, 2),
        (2, 0),
        (3, 4),
        (4, 8),
        (5, 12),
        (6, 14),
        (7, 16),
        (8, 20),
        (9, 24),
        (11, 26),
        (12, 22),
        (13, 18),
        (18, 10),
        (19, 6),
    ],
    PLAIN,
    &[14, 15, 16, 17],
)];
static OF_TWO: [Mode; 1] = [mode(
    &[
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
    PLAIN,
    &[15, 16],
)];

static CELLS_10H8: [CellFuses; 8] = rows(19, [2; 8], true);
static CELLS_10L8: [CellFuses; 8] = rows(19, [2; 8], false);
static CELLS_12H6: [CellFuses; 6] = rows(18, [4, 2, 2, 2, 2, 4], true);
static CELLS_12L6: [CellFuses; 6] = rows(18, [4, 2, 2, 2, 2, 4], false);
static CELLS_14H4: [CellFuses; 4] = rows(17, [4; 4], true);
static CELLS_14L4: [CellFuses; 4] = rows(17, [4; 4], false);
static CELLS_16H2: [CellFuses; 2] = rows(16, [8; 2], true);
static CELLS_16L2: [CellFuses; 2] = rows(16, [8; 2], false);
pub(super) static H8: Layout = map(16, 20, &OF_EIGHT, &CELLS_10H8);
pub(super) static L8_OF_10: Layout = map(16, 20, &OF_EIGHT, &CELLS_10L8);
pub(super) static H6: Layout = map(16, 24, &OF_SIX, &CELLS_12H6);
pub(super) static L6: Layout = map(16, 24, &OF_SIX, &CELLS_12L6);
pub(super) static H4: Layout = map(16, 28, &OF_FOUR, &CELLS_14H4);
pub(super) static L4: Layout = map(16, 28, &OF_FOUR, &CELLS_14L4);
pub(super) static H2: Layout = map(16, 32, &OF_TWO, &CELLS_16H2);
pub(super) static L2: Layout = map(16, 32, &OF_TWO, &CELLS_16L2);
