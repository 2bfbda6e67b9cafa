//! Decodes fuses to a placement, and compares two placements.

use super::{FuseMap, codes};
use crate::device::layout::{
    CellFuses, Enable, Feedback, Layout, Mode, PolarityGate, Register, Shape,
};
use crate::placement::{Cell, CellKind, Placement, Product};
use grafsynth_ir::diag::Diagnostic;

/// Decodes the macrocells that a fuse map configures. Macrocells without a function are left out; pins have no names.
///
/// A term that is never true is written as a literal and its complement over the macrocell's own pin.
///
/// # Errors
/// If the device has no known fuse map, or if no data sheet describes a setting.
pub fn decode(map: &FuseMap) -> Result<Placement, Vec<Diagnostic>> {
    let Some(layout) = map.device.layout else {
        return Err(vec![super::map::no_map(map.device)]);
    };
    let is_chosen = |mode: &&Mode| mode.fuses.iter().all(|(fuse, value)| map.get(*fuse) == *value);
    let Some(mode) = layout.modes.iter().find(is_chosen) else {
        let message = format!(
            "the configuration fuses of a {} select none of its {} modes",
            map.device.name,
            layout.modes.len()
        );
        return Err(vec![Diagnostic::error(codes::UNDOCUMENTED, message).help(OTHER_DEVICE)]);
    };
    let reader = Reader { map, layout, mode };
    let mut placement = Placement::new(map.device);
    placement.is_secured = map.is_secured;
    placement.signature = map.signature().map(Vec::from).unwrap_or_default();
    while placement.signature.last() == Some(&0) {
        placement.signature.pop();
    }
    placement.async_reset = layout.async_reset.and_then(|row| reader.row(row));
    placement.sync_preset = layout.sync_preset.and_then(|row| reader.row(row));
    let mut found = Vec::new();
    for fuses in layout.cells.iter().rev() {
        match reader.cell(fuses) {
            Ok(Some(cell)) => placement.cells.push(cell),
            Ok(None) => {}
            Err(finding) => found.push(*finding),
        }
    }
    if found.is_empty() { Ok(placement) } else { Err(found) }
}

/// The help text for fuses that make no sense for a device.
const OTHER_DEVICE: &str =
    "check that the file is for this device and was not changed: get it from its source again";

struct Reader<'a> {
    map: &'a FuseMap,
    layout: &'static Layout,
    mode: &'static Mode,
}

impl Reader<'_> {
    fn shape(&self, fuses: &CellFuses) -> Option<&'static Shape> {
        self.mode.shape(fuses.kind.map(|kind| self.map.setting(kind)))
    }

    /// The product of a row; `None` if it is never true.
    fn row(&self, row: u32) -> Option<Product> {
        if self.layout.row_switches.is_some_and(|first| !self.map.get(first + row)) {
            return None;
        }
        let first = row * self.layout.n_columns;
        let mut literals = Vec::new();
        for &(pin, column) in self.mode.columns {
            let is_inverted = self.is_fed_back_inverted(pin);
            match (self.map.get(first + column), self.map.get(first + column + 1)) {
                (true, true) => {}
                (false, true) => literals.push((pin, !is_inverted)),
                (true, false) => literals.push((pin, is_inverted)),
                (false, false) => return None,
            }
        }
        literals.sort_unstable();
        Some(Product(literals))
    }

    /// True if the first column of a pin carries the complement of the pin's value.
    fn is_fed_back_inverted(&self, pin: u32) -> bool {
        let Some(fuses) = self.layout.cell(pin) else { return false };
        let shape = self.shape(fuses);
        shape.is_some_and(|shape| {
            shape.feedback == Feedback::NotQ
                && shape.polarity == PolarityGate::AfterRegister
                && self.map.setting(fuses.polarity)
        })
    }

    /// True if a row that can be true is connected to one of this pin's columns.
    fn is_read(&self, pin: u32) -> bool {
        let Some(column) = self.mode.column(pin) else { return false };
        (0..self.layout.n_rows()).any(|row| {
            self.row(row).is_some() && {
                let first = row * self.layout.n_columns + column;
                !(self.map.get(first) && self.map.get(first + 1))
            }
        })
    }

    fn cell(&self, fuses: &CellFuses) -> Result<Option<Cell>, Box<Diagnostic>> {
        let rows = |from: u32| {
            (fuses.row + from..fuses.row + fuses.n_rows).filter_map(|row| self.row(row))
        };
        let Some(shape) = self.shape(fuses) else {
            if rows(0).next().is_none() {
                return Ok(None);
            }
            let message = format!(
                "pin {} of a {} has a configuration that no data sheet describes",
                fuses.pin, self.map.device.name
            );
            return Err(Box::new(
                Diagnostic::error(codes::UNDOCUMENTED, message).help(OTHER_DEVICE),
            ));
        };
        let never = || Product(vec![(fuses.pin, false), (fuses.pin, true)]);
        let sum: Vec<Product> = rows(shape.sum).collect();
        let enable = match shape.enable {
            Enable::Never => return Ok(None),
            Enable::Always | Enable::PinLow(_) => None,
            Enable::Row(row) | Enable::PinLowAndRow(_, row) => match self.row(fuses.row + row) {
                None => Some(never()),
                Some(product) => Some(product).filter(|product| !product.0.is_empty()),
            },
        };
        let (mut clock, mut set, mut reset) = (None, None, None);
        let mut is_registered = matches!(shape.register, Register::Pin(_));
        if let Register::Rows { clock: clocked, reset: cleared, set: preset } = shape.register {
            (set, reset) = (self.row(fuses.row + preset), self.row(fuses.row + cleared));
            let is_always = |product: &Option<Product>| {
                product.as_ref().is_some_and(|product| product.0.is_empty())
            };
            is_registered = !(is_always(&set) && is_always(&reset));
            if is_registered {
                clock = Some(self.row(fuses.row + clocked).unwrap_or_else(never));
            } else {
                (set, reset) = (None, None);
            }
        }
        let is_dead = enable.as_ref().is_some_and(Product::is_never);
        // A flip-flop that is read internally counts even if it is always 0.
        let is_buried = shape.feedback == Feedback::NotQ && self.is_read(fuses.pin);
        if is_dead && sum.is_empty() && !is_buried {
            return Ok(None);
        }
        let kind = match (is_registered, &enable) {
            (true, _) => CellKind::Registered,
            (false, Some(_)) => CellKind::Tristate,
            (false, None) => CellKind::Combinational,
        };
        let is_active_low = !self.map.setting(fuses.polarity);
        Ok(Some(Cell { pin: fuses.pin, kind, is_active_low, sum, enable, clock, set, reset }))
    }
}

/// The differences between a fuse map and the intended placement, in words; empty if there are none. An unintended macrocell may show a constant
/// that nothing reads: some devices cannot switch an output off.
#[must_use]
pub fn differences(meant: &Placement, said: &Placement) -> Vec<String> {
    let mut differences = Vec::new();
    if meant.device.layout != said.device.layout {
        differences.push(format!("expected {}, found {}", meant.device.name, said.device.name));
    }
    let mut of = |what: String, is_same: bool| {
        if !is_same {
            differences.push(what);
        }
    };
    of("the asynchronous reset".to_owned(), same_term(&meant.async_reset, &said.async_reset));
    of("the synchronous preset".to_owned(), same_term(&meant.sync_preset, &said.sync_preset));
    of("the security fuse".to_owned(), meant.is_secured == said.is_secured);
    let signature = |placement: &Placement| {
        let mut bytes = placement.signature.clone();
        bytes.resize(8, 0);
        bytes
    };
    let has_signature = said.device.layout.is_some_and(|layout| layout.signature.is_some());
    of("the signature".to_owned(), !has_signature || signature(meant) == signature(said));
    for cell in &meant.cells {
        let same = said.cell(cell.pin).is_some_and(|other| same_cell(cell, other));
        of(format!("the macrocell of pin {}", cell.pin), same);
    }
    for cell in &said.cells {
        let is_meant = meant.cell(cell.pin).is_some();
        let is_constant = cell.sum.is_empty() && cell.enable.is_none();
        let is_read = meant.products().any(|product| product.literal(cell.pin).is_some());
        of(format!("pin {}, which should be idle", cell.pin), is_meant || is_constant && !is_read);
    }
    differences
}

fn same_term(a: &Option<Product>, b: &Option<Product>) -> bool {
    let term = |product: &Option<Product>| {
        product.clone().filter(|product| !product.is_never()).map(Product::sorted)
    };
    term(a) == term(b)
}

fn same_cell(a: &Cell, b: &Cell) -> bool {
    let enable = |cell: &Cell| match &cell.enable {
        None => Some(Product::default()),
        Some(product) if product.is_never() => None,
        Some(product) => Some(product.clone().sorted()),
    };
    let sum = |cell: &Cell| {
        let mut sum: Vec<Product> = cell
            .sum
            .iter()
            .filter(|product| !product.is_never())
            .cloned()
            .map(Product::sorted)
            .collect();
        sum.sort_unstable();
        sum
    };
    (a.kind == CellKind::Registered) == (b.kind == CellKind::Registered)
        && a.is_active_low == b.is_active_low
        && enable(a) == enable(b)
        && sum(a) == sum(b)
        && same_term(&a.clock, &b.clock)
        && same_term(&a.set, &b.set)
        && same_term(&a.reset, &b.reset)
}
