//! A design in which every function is assigned to a macrocell of a device: the input of the fuse mapper, and the result of the decoder.
//!
//! ```text
//! equations ── fit ──► Placement ── fuse::map ──► FuseMap ── jedec::write ──► .jed
//!                          ▲                         │
//!                          └────── fuse::decode ◄────┘
//! ```
//! Literals refer to levels on pins, never to array columns: `(14, true)` is true while the level that is read at pin 14, or fed back from its
//! macrocell, is high. The mapper determines the column, and whether the device feeds back Q or its complement.

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
    /// The user's electronic signature, at most eight bytes, padded with zeros.
    pub signature: Vec<u8>,
    /// The names of the pins that have one, in order of pin numbers.
    pub pins: Vec<PinName>,
    /// The macrocells in use, in any order, at most one for each pin. A missing macrocell is a plain input or idle.
    pub cells: Vec<Cell>,
    /// While it is true, all registers are cleared asynchronously; only if the device supports it.
    pub async_reset: Option<Product>,
    /// All registers are set at the clock edge while it is true; only if the device supports it.
    pub sync_preset: Option<Product>,
    /// True if the device cannot be read out after it was programmed.
    pub is_secured: bool,
    /// Inputs and outputs that are not on the pins given by the order of declarations.
    pub moved: Vec<MovedPin>,
}

/// A pin and its user-defined name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinName {
    /// The pin, from 1.
    pub pin: u32,
    /// Its name as the user wrote it, without a negation sign.
    pub name: String,
    /// True if the user's signal is the complement of the level at the pin.
    pub is_inverted: bool,
}

/// How a macrocell uses its sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CellKind {
    /// The pin shows the sum.
    Combinational,
    /// The pin shows a flip-flop with the sum as D.
    Registered,
    /// The pin shows the sum while [`Cell::enable`] is true, otherwise it is not driven.
    Tristate,
}

/// One macrocell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Its pin.
    pub pin: u32,
    /// How it uses the sum.
    pub kind: CellKind,
    /// True if the sum gives the complement of the pin's value.
    pub is_active_low: bool,
    /// The sum: true if one of the products is true; without products, never true.
    pub sum: Vec<Product>,
    /// The condition under which the pin is driven. `None`: always, or for registers, as controlled by the device's enable pin if it
    /// has one.
    pub enable: Option<Product>,
    /// The clock of this flip-flop, on devices with individual clocks.
    pub clock: Option<Product>,
    /// Sets the flip-flop asynchronously, on devices with individual sets.
    pub set: Option<Product>,
    /// Clears the flip-flop asynchronously, on devices with individual resets.
    pub reset: Option<Product>,
}

/// A conjunction of literals over pins: `(pin, true)` is the level that is read at or fed back from this pin. Without literals, it is always true.
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

    /// The number of additional passes through the array between two clocks: the length of the longest chain of combinational macrocells
    /// that are read. Each macrocell of a combinational loop is counted once.
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

    /// The user-defined name of a pin, if it has one.
    #[must_use]
    pub fn name(&self, pin: u32) -> Option<&str> {
        self.pins.iter().find(|named| named.pin == pin).map(|named| named.name.as_str())
    }

    /// All products, including those of enables, clocks, sets and resets.
    pub fn products(&self) -> impl Iterator<Item = &Product> {
        let cells = self.cells.iter().flat_map(|cell| {
            let own = [&cell.enable, &cell.clock, &cell.set, &cell.reset];
            cell.sum.iter().chain(own.into_iter().flatten())
        });
        cells.chain(&self.async_reset).chain(&self.sync_preset)
    }
}

impl Cell {
    /// A macrocell of this kind with only a sum.
    #[must_use]
    pub fn new(pin: u32, kind: CellKind, is_active_low: bool, sum: Vec<Product>) -> Self {
        Cell { pin, kind, is_active_low, sum, enable: None, clock: None, set: None, reset: None }
    }
}

impl Product {
    /// The level that it requires of a pin, if it reads the pin.
    #[must_use]
    pub fn literal(&self, pin: u32) -> Option<bool> {
        self.0.iter().find(|(known, _)| *known == pin).map(|(_, value)| *value)
    }

    /// True if it requires a level and its complement of one pin.
    #[must_use]
    pub fn is_never(&self) -> bool {
        self.0.iter().any(|&(pin, value)| self.0.contains(&(pin, !value)))
    }

    /// The product with its literals sorted, each once.
    #[must_use]
    pub fn sorted(mut self) -> Self {
        self.0.sort_unstable();
        self.0.dedup();
        self
    }
}
