//! A design of which every function sits in a macrocell of a device: what the fuse mapper burns, and what the decoder gives back.
//!
//! ```text
//! equations ── fit ──► Placement ── fuse::map ──► FuseMap ── jedec::write ──► .jed
//!                          ▲                         │
//!                          └────── fuse::decode ◄────┘
//! ```
//! Literals speak of levels on pins, never of array columns: `(14, true)` is true while the level that is read at pin 14, or fed back from its
//! macrocell, is high. Which column that is, and whether the device feeds back Q or its complement, is the mapper's business.

use crate::MovedPin;
use crate::device::Device;

/// All functions of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placement {
    /// The device.
    pub device: &'static Device,
    /// The exact part, if the user named one.
    pub part: Option<&'static str>,
    /// A line for the head of a file; may be empty.
    pub title: String,
    /// The user's electronic signature, at most eight bytes; what is missing is zero.
    pub signature: Vec<u8>,
    /// The names of the pins that have one, in order of their numbers.
    pub pins: Vec<PinName>,
    /// The macrocells in use, in any order, at most one of each pin. A macrocell that is missing is a plain input or idle.
    pub cells: Vec<Cell>,
    /// While it is true, all registers are cleared at once. Only where the device has it.
    pub async_reset: Option<Product>,
    /// All registers are set at the clock while it is true. Only where the device has it.
    pub sync_preset: Option<Product>,
    /// The device cannot be read out after it was burned.
    pub is_secured: bool,
    /// Inputs and outputs whose pins were chosen out of the order of declarations.
    pub moved: Vec<MovedPin>,
}

/// A pin and what the user calls it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinName {
    /// The pin, from 1.
    pub pin: u32,
    /// Its name as the user wrote it, without a sign of negation.
    pub name: String,
    /// The user's signal is the complement of the level at the pin.
    pub is_inverted: bool,
}

/// What a macrocell does with its sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CellKind {
    /// The pin shows the sum.
    Combinational,
    /// The pin shows a flip-flop that has the sum as D.
    Registered,
    /// The pin shows the sum while [`Cell::enable`] is true, and else is not driven.
    Tristate,
}

/// One macrocell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Its pin.
    pub pin: u32,
    /// What it does with the sum.
    pub kind: CellKind,
    /// The sum gives the complement of what the pin shows.
    pub is_active_low: bool,
    /// True when one of the products is; no products: never.
    pub sum: Vec<Product>,
    /// The pin is driven while it is true; none: always, or as the device's own enable pin says for registers of those that have one.
    pub enable: Option<Product>,
    /// The clock of this flip-flop, on devices where each has its own.
    pub clock: Option<Product>,
    /// Sets the flip-flop at once, on devices where each has its own.
    pub set: Option<Product>,
    /// Clears the flip-flop at once, on devices where each has its own.
    pub reset: Option<Product>,
}

/// A conjunction of literals over pins: `(pin, true)` is the level that is read at or fed back from this pin. No literals: always true.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Product(pub Vec<(u32, bool)>);

impl Placement {
    /// An empty design for a device.
    #[must_use]
    pub fn new(device: &'static Device) -> Self {
        Placement {
            device,
            part: None,
            title: String::new(),
            signature: Vec::new(),
            pins: Vec::new(),
            cells: Vec::new(),
            async_reset: None,
            sync_preset: None,
            is_secured: false,
            moved: Vec::new(),
        }
    }

    /// The macrocell of a pin, if it is in use.
    #[must_use]
    pub fn cell(&self, pin: u32) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.pin == pin)
    }

    /// How often a signal goes through the array between two clocks beyond the first time: the longest chain of combinational macrocells that are read.
    /// Levels that go in circles are counted once.
    #[must_use]
    pub fn n_passes(&self) -> usize {
        let gates: Vec<&Cell> =
            self.cells.iter().filter(|cell| cell.kind != CellKind::Registered).collect();
        let mut depth = vec![0_usize; gates.len()];
        for _ in 0..gates.len() {
            for at in 0..gates.len() {
                let reads = |pin: u32| gates[at].sum.iter().any(|own| own.literal(pin).is_some());
                let below = (0..gates.len()).filter(|other| reads(gates[*other].pin));
                let deepest = below.map(|other| depth[other] + 1).max().unwrap_or(0);
                depth[at] = deepest.min(gates.len());
            }
        }
        let is_read = |pin: u32| {
            let registered = self.cells.iter().filter(|cell| cell.kind == CellKind::Registered);
            registered.flat_map(|cell| &cell.sum).any(|product| product.literal(pin).is_some())
        };
        let of = |at: usize| depth[at] + usize::from(is_read(gates[at].pin));
        (0..gates.len()).map(of).max().unwrap_or(0)
    }

    /// What the user calls a pin, if it has a name.
    #[must_use]
    pub fn name(&self, pin: u32) -> Option<&str> {
        self.pins.iter().find(|named| named.pin == pin).map(|named| named.name.as_str())
    }

    /// All products, those of enables, clocks, sets and resets too.
    pub fn products(&self) -> impl Iterator<Item = &Product> {
        let cells = self.cells.iter().flat_map(|cell| {
            let own = [&cell.enable, &cell.clock, &cell.set, &cell.reset];
            cell.sum.iter().chain(own.into_iter().flatten())
        });
        cells.chain(&self.async_reset).chain(&self.sync_preset)
    }
}

impl Cell {
    /// A macrocell of this kind with a sum and nothing else.
    #[must_use]
    pub fn new(pin: u32, kind: CellKind, is_active_low: bool, sum: Vec<Product>) -> Self {
        Cell { pin, kind, is_active_low, sum, enable: None, clock: None, set: None, reset: None }
    }
}

impl Product {
    /// The level that it wants of a pin, if it reads it.
    #[must_use]
    pub fn literal(&self, pin: u32) -> Option<bool> {
        self.0.iter().find(|(known, _)| *known == pin).map(|(_, value)| *value)
    }

    /// True if it wants a level and its complement of one pin.
    #[must_use]
    pub fn is_never(&self) -> bool {
        self.0.iter().any(|&(pin, value)| self.0.contains(&(pin, !value)))
    }

    /// The same with its literals in order, each once.
    #[must_use]
    pub fn sorted(mut self) -> Self {
        self.0.sort_unstable();
        self.0.dedup();
        self
    }
}
