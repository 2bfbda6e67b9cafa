//! The positions and functions of the fuses of a device, as data.
//!
//! A fuse is 0 if the connection is made and 1 if it is not, as in a JEDEC file. A row of the array is a product term: it is true while every
//! signal connected to it is high, so a row of ones is always true and a row of zeros is never true. Rows are numbered from 0, and row `r` begins at
//! fuse `r * n_columns`.
//!
//! The mapper, the decoder and the simulator read the same tables and share no other code.

/// The fuse map of a device.
#[derive(Debug, PartialEq, Eq)]
pub struct Layout {
    /// The total number of fuses, including those of the signature.
    pub n_fuses: u32,
    /// The number of fuses of a row.
    pub n_columns: u32,
    /// The configurations of the whole device, the simplest first.
    pub modes: &'static [Mode],
    /// The macrocells, by pin.
    pub cells: &'static [CellFuses],
    /// The row that clears all registers asynchronously.
    pub async_reset: Option<u32>,
    /// The row that sets all registers at the clock edge.
    pub sync_preset: Option<u32>,
    /// The first of the 64 fuses of the user signature, the most significant bit of the first byte.
    pub signature: Option<u32>,
    /// The first of the fuses that disable a row of the array if they are 0, one per row.
    pub row_switches: Option<u32>,
    /// The source of the figures.
    pub source: &'static str,
}

/// A configuration of the whole device.
#[derive(Debug, PartialEq, Eq)]
pub struct Mode {
    /// Its name in the data sheet; empty for a device with only one.
    pub name: &'static str,
    /// The fuses that select it: number and value.
    pub fuses: &'static [(u32, bool)],
    /// The columns of each signal: the pin, and the column of its level; the next column is the complement.
    pub columns: &'static [(u32, u32)],
    /// The possible configurations of a macrocell in this mode. A fuse setting without a shape is not documented.
    pub shapes: &'static [Shape],
    /// Pins of macrocells that cannot be read in this mode, because other pins use their columns.
    pub deaf: &'static [u32],
}

/// The fuses of a macrocell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellFuses {
    /// Its pin.
    pub pin: u32,
    /// Its first row.
    pub row: u32,
    /// The number of its rows, including those of its enable and of its clock.
    pub n_rows: u32,
    /// The polarity setting; 1 means active high.
    pub polarity: Setting,
    /// The setting that selects the shape, if there are several.
    pub kind: Option<Setting>,
}

/// A setting of a macrocell: a fuse, or fixed by the manufacturer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// Set by this fuse.
    Fuse(u32),
    /// Fixed, as if a fuse had this value.
    Fixed(bool),
}

impl Setting {
    /// The fuse, if there is one.
    #[must_use]
    pub fn fuse(self) -> Option<u32> {
        match self {
            Setting::Fuse(fuse) => Some(fuse),
            Setting::Fixed(_) => None,
        }
    }
}

/// The configuration of a macrocell for one value of its kind setting.
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// The value of [`CellFuses::kind`], if the device has this fuse.
    pub kind: Option<bool>,
    /// Whether the output comes from the flip-flop.
    pub register: Register,
    /// When the pin is driven.
    pub enable: Enable,
    /// The first row of the sum, counted from the macrocell's first row; the sum ends at the macrocell's last row.
    pub sum: u32,
    /// The signal that the array reads.
    pub feedback: Feedback,
    /// The position of the polarity gate.
    pub polarity: PolarityGate,
}

/// Whether the output comes from a flip-flop, and its clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// Not from a flip-flop.
    None,
    /// Clocked by the rising edge of this pin.
    Pin(u32),
    /// Clocked by the rising edge of a row, cleared and set by two other rows; if both of these rows are true, the flip-flop is
    /// transparent. Rows are counted from the macrocell's first row.
    Rows {
        /// The clock's row.
        clock: u32,
        /// The row that clears it.
        reset: u32,
        /// The row that sets it.
        set: u32,
    },
}

/// When a pin is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Enable {
    /// Always.
    Always,
    /// Never: the macrocell is an input.
    Never,
    /// While this row is true, counted from the macrocell's first.
    Row(u32),
    /// While this pin is low.
    PinLow(u32),
    /// While this pin is low and this row true.
    PinLowAndRow(u32, u32),
}

/// The signal on the columns of a macrocell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feedback {
    /// The level of the pin, whatever drives it.
    Pin,
    /// The complement of the flip-flop.
    NotQ,
}

/// The position of the polarity gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PolarityGate {
    /// Before the flip-flop, with an inverting buffer between flip-flop and pin.
    BeforeRegister,
    /// Between flip-flop and pin.
    AfterRegister,
}

impl Layout {
    /// The number of rows of the array.
    #[must_use]
    pub fn n_rows(&self) -> u32 {
        let last = |cell: &CellFuses| cell.row + cell.n_rows;
        let rows = self.cells.iter().map(last);
        let global = [self.async_reset, self.sync_preset].into_iter().flatten().map(|row| row + 1);
        rows.chain(global).max().unwrap_or(0)
    }

    /// The fuses of a pin's macrocell.
    #[must_use]
    pub fn cell(&self, pin: u32) -> Option<&'static CellFuses> {
        self.cells.iter().find(|cell| cell.pin == pin)
    }
}

impl Mode {
    /// The column of a pin's level; the next column is its complement.
    #[must_use]
    pub fn column(&self, pin: u32) -> Option<u32> {
        self.columns.iter().find(|(known, _)| *known == pin).map(|(_, column)| *column)
    }

    /// The shape for a value of the macrocell's fuse.
    #[must_use]
    pub fn shape(&self, kind: Option<bool>) -> Option<&'static Shape> {
        self.shapes.iter().find(|shape| shape.kind == kind)
    }
}

/// The fuses of consecutive macrocells in descending order of their pins, as in all of these devices. Each has the same number of rows, one polarity fuse, and
/// optionally one fuse for the kind.
pub(super) const fn cells<const N: usize>(
    highest: u32,
    n_rows: u32,
    polarity: u32,
    kind: Option<u32>,
) -> [CellFuses; N] {
    let mut cells = [const {
        CellFuses { pin: 0, row: 0, n_rows: 0, polarity: Setting::Fixed(false), kind: None }
    }; N];
    let mut at = 0;
    while at < N {
        let index = at as u32;
        cells[at] = CellFuses {
            pin: highest - index,
            row: index * n_rows,
            n_rows,
            polarity: Setting::Fuse(polarity + index),
            kind: match kind {
                Some(first) => Some(Setting::Fuse(first + index)),
                None => None,
            },
        };
        at += 1;
    }
    cells
}
