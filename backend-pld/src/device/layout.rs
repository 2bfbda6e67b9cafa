//! Where the fuses of a device lie and what they do, as data.
//!
//! A fuse is 0 where the connection is made and 1 where it is not, as in a JEDEC file. A row of the array is a product term: it is true while every
//! signal connected to it is high, so a row of ones is always true and a row of zeros never. Rows are numbered from 0, and row `r` begins at fuse
//! `r * n_columns`.
//!
//! The mapper, the decoder and the simulator read the same tables and share nothing else.

/// The fuse map of a device.
#[derive(Debug, PartialEq, Eq)]
pub struct Layout {
    /// All fuses, those of the signature too.
    pub n_fuses: u32,
    /// Fuses of a row.
    pub n_columns: u32,
    /// What the whole device can be configured as, the plainest first.
    pub modes: &'static [Mode],
    /// The macrocells, by pin.
    pub cells: &'static [CellFuses],
    /// The row that clears all registers at once.
    pub async_reset: Option<u32>,
    /// The row that sets all registers at the clock.
    pub sync_preset: Option<u32>,
    /// The first of the 64 fuses of the user's signature, the first byte's most significant bit.
    pub signature: Option<u32>,
    /// The first of the fuses that take a row of the array out of service where they are 0, one a row.
    pub row_switches: Option<u32>,
    /// Where the figures were read.
    pub source: &'static str,
}

/// A configuration of the whole device.
#[derive(Debug, PartialEq, Eq)]
pub struct Mode {
    /// What the data sheet calls it; empty for a device that has only one.
    pub name: &'static str,
    /// The fuses that choose it: number and value.
    pub fuses: &'static [(u32, bool)],
    /// Which signal lies on which columns: pin, and the column of the level itself; the next one is its complement.
    pub columns: &'static [(u32, u32)],
    /// What a macrocell can be in this mode. A setting of its own fuse that no shape has is not documented.
    pub shapes: &'static [Shape],
    /// Macrocells that cannot be read in this mode; their columns belong to other pins.
    pub deaf: &'static [u32],
}

/// The fuses of a macrocell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellFuses {
    /// Its pin.
    pub pin: u32,
    /// Its first row.
    pub row: u32,
    /// How many rows it has, those of its enable and of its clock too.
    pub n_rows: u32,
    /// What chooses the polarity: 1 is active high.
    pub polarity: Setting,
    /// What chooses among the shapes, where there are several.
    pub kind: Option<Setting>,
}

/// A choice of a macrocell: a fuse, or made by the maker of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// This fuse.
    Fuse(u32),
    /// Always this, as if a fuse had this value.
    Fixed(bool),
}

impl Setting {
    /// The fuse, where there is one.
    #[must_use]
    pub fn fuse(self) -> Option<u32> {
        match self {
            Setting::Fuse(fuse) => Some(fuse),
            Setting::Fixed(_) => None,
        }
    }
}

/// What a macrocell is under one setting of its fuse.
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// The value of [`CellFuses::kind`], where the device has that.
    pub kind: Option<bool>,
    /// Whether the output comes from the flip-flop.
    pub register: Register,
    /// When the pin is driven.
    pub enable: Enable,
    /// The first row of the sum, counted from the macrocell's first; the sum goes on to its last.
    pub sum: u32,
    /// What the array reads.
    pub feedback: Feedback,
    /// Where the polarity gate sits.
    pub polarity: PolarityGate,
}

/// Whether the output comes from the flip-flop, and what that is clocked by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// There is none.
    None,
    /// Clocked by the rising edge of this pin.
    Pin(u32),
    /// Clocked by the rising edge of a row, cleared and set by two others; with both of these true the flip-flop is out of the way. Rows counted from
    /// the macrocell's first.
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

/// What the columns of a macrocell carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feedback {
    /// The level of the pin, whoever drives it.
    Pin,
    /// The complement of the flip-flop.
    NotQ,
}

/// Where the polarity gate sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PolarityGate {
    /// Before the flip-flop, with an inverting buffer between flip-flop and pin.
    BeforeRegister,
    /// Between flip-flop and pin.
    AfterRegister,
}

impl Layout {
    /// Rows of the array.
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
    /// The column of a pin's level; that of its complement is the next.
    #[must_use]
    pub fn column(&self, pin: u32) -> Option<u32> {
        self.columns.iter().find(|(known, _)| *known == pin).map(|(_, column)| *column)
    }

    /// The shape under a value of the macrocell's fuse.
    #[must_use]
    pub fn shape(&self, kind: Option<bool>) -> Option<&'static Shape> {
        self.shapes.iter().find(|shape| shape.kind == kind)
    }
}

/// The fuses of consecutive macrocells from the one with the highest pin down, as all of these devices have them: equal numbers of rows, one polarity
/// fuse each, and perhaps one fuse each for the kind.
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
