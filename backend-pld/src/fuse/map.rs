//! Converts a placement to fuses.

use super::FuseMap;
use super::codes;
use crate::device::Device;
use crate::device::layout::{
    CellFuses, Enable, Feedback, Layout, Mode, PolarityGate, Register, Setting, Shape,
};
use crate::placement::{Cell, CellKind, Placement, Product};
use grafsynth_ir::diag::Diagnostic;

/// The fuses of a placement. Idle macrocells and unused rows are zero, so they are never true.
///
/// # Errors
/// Returns everything that the device cannot hold: pins that do not exist or cannot be read, sums that are too wide, terms that it does not have. A device
/// without a known fuse map is also an error.
pub fn map(placement: &Placement) -> Result<FuseMap, Vec<Diagnostic>> {
    let Some(layout) = placement.device.layout else {
        return Err(vec![no_map(placement.device)]);
    };
    let (mode, found) = choose_mode(placement, layout);
    let fuses = vec![false; layout.n_fuses as usize];
    let mut mapper = Mapper { placement, layout, mode, fuses, found };
    mapper.run();
    if mapper.found.is_empty() {
        Ok(FuseMap {
            device: placement.device,
            fuses: mapper.fuses,
            is_secured: placement.is_secured,
        })
    } else {
        Err(mapper.found)
    }
}

/// Why there is no fuse map for a device.
pub(crate) fn no_map(device: &Device) -> Diagnostic {
    let known: Vec<&str> = crate::device::DEVICES
        .iter()
        .filter(|known| known.layout.is_some())
        .map(|known| known.name)
        .collect();
    let ways = if device.blocks.is_some() {
        "build `cupl` for WinCUPL and the manufacturer's fitter, or `verilog` for yosys with atf15xx_yosys before that fitter"
    } else {
        "build equations for the manufacturer's tools with `palasm` or `cupl`"
    };
    Diagnostic::error(
        codes::NO_FUSE_MAP,
        format!(
            "the fuse map of {} is not known for certain, so none is written",
            device.with_article()
        ),
    )
    .help(format!("{ways}, or use one of {}", known.join(", ")))
}

/// True if some product reads the pin.
fn is_read(placement: &Placement, pin: u32) -> bool {
    placement.products().any(|product| product.literal(pin).is_some())
}

/// The simplest mode that can hold the design, with no findings. If there is none, the mode with the fewest obstacles, and the obstacles of
/// all modes (those of the chosen mode first).
fn choose_mode(placement: &Placement, layout: &'static Layout) -> (&'static Mode, Vec<Diagnostic>) {
    let has_registers = placement.cells.iter().any(|cell| cell.kind == CellKind::Registered);
    let is_registered = |shape: &Shape| shape.register != Register::None;
    let mut tried: Vec<(&'static Mode, Vec<Diagnostic>)> = Vec::new();
    for mode in layout.modes {
        let refusals = refusals(placement, layout, mode);
        if refusals.is_empty() {
            return (mode, refusals);
        }
        // That a mode has no flip-flops is not worth reporting if another mode has them.
        if !has_registers || mode.shapes.iter().any(is_registered) {
            tried.push((mode, refusals));
        }
    }
    tried.sort_by_key(|(_, refusals)| refusals.len());
    match tried.first() {
        Some((mode, _)) => (*mode, tried.into_iter().flat_map(|(_, refusals)| refusals).collect()),
        None => {
            let last = &layout.modes[layout.modes.len() - 1];
            (last, refusals(placement, layout, last))
        }
    }
}

/// The parts of a design that a mode cannot hold; sums are not counted.
fn refusals(placement: &Placement, layout: &Layout, mode: &Mode) -> Vec<Diagnostic> {
    let device = placement.device;
    let in_mode = |text: String| {
        if mode.name.is_empty() { text } else { format!("{text} in its {} mode", mode.name) }
    };
    let mut found = Vec::new();
    for cell in &placement.cells {
        if layout.cell(cell.pin).is_some() && shape_for(layout, mode, cell).is_none() {
            let what = match cell.kind {
                CellKind::Combinational => "a combinational output",
                CellKind::Registered => "a registered output",
                CellKind::Tristate => "an output with an enable term",
            };
            found.push(refused(in_mode(format!(
                "pin {} of a {} cannot be {what}",
                cell.pin, device.name
            ))));
        }
    }
    for pin in 1..=device.n_pins {
        if !is_read(placement, pin) {
            continue;
        }
        // A pin whose macrocell feeds back while it is an output excludes the simplest mode, as in all assemblers.
        let is_dedicated = layout.modes.len() > 1
            && mode.name == layout.modes[0].name
            && placement.cell(pin).is_some();
        if mode.column(pin).is_none() || is_dedicated {
            let name = placement.name(pin).map(|name| format!(" (`{name}`)")).unwrap_or_default();
            found.push(refused(in_mode(format!(
                "pin {pin}{name} of a {} cannot be read",
                device.name
            ))));
        }
    }
    found
}

/// The shape that a macrocell needs, among the possible ones.
fn shape_for(layout: &Layout, mode: &'_ Mode, cell: &Cell) -> Option<&'static Shape> {
    let fixed = match layout.cell(cell.pin)?.kind {
        Some(Setting::Fixed(kind)) => Some(kind),
        Some(Setting::Fuse(_)) | None => None,
    };
    mode.shapes.iter().filter(|shape| fixed.is_none() || shape.kind == fixed).find(|shape| {
        let has_row = matches!(shape.enable, Enable::Row(_) | Enable::PinLowAndRow(..));
        match cell.kind {
            CellKind::Combinational => {
                // The shape depends on the mode, so an enable term that is always true may be part of it.
                !matches!(shape.register, Register::Pin(_)) && shape.enable != Enable::Never
            }
            CellKind::Registered => {
                shape.register != Register::None && (cell.enable.is_none() || has_row)
            }
            CellKind::Tristate => !matches!(shape.register, Register::Pin(_)) && has_row,
        }
    })
}

fn refused(message: String) -> Diagnostic {
    Diagnostic::error(codes::CANNOT_HOLD, message)
        .help("use another device, or change the equation")
}

struct Mapper<'a> {
    placement: &'a Placement,
    layout: &'static Layout,
    mode: &'static Mode,
    fuses: Vec<bool>,
    found: Vec<Diagnostic>,
}

impl Mapper<'_> {
    fn run(&mut self) {
        for &(fuse, value) in self.mode.fuses {
            self.set(fuse, value);
        }
        if let Some(first) = self.layout.row_switches {
            for row in 0..self.layout.n_rows() {
                self.set(first + row, true);
            }
        }
        self.signature();
        let placement = self.placement;
        self.global("asynchronous reset", self.layout.async_reset, placement.async_reset.as_ref());
        self.global("synchronous preset", self.layout.sync_preset, placement.sync_preset.as_ref());
        for cell in self.layout.cells {
            match self.placement.cell(cell.pin) {
                Some(own) => self.cell(cell, own),
                None => self.idle(cell),
            }
        }
        for cell in &self.placement.cells {
            if self.layout.cell(cell.pin).is_none() {
                let message = format!(
                    "pin {} of a {} has no macrocell",
                    cell.pin, self.placement.device.name
                );
                self.found.push(refused(message));
            }
        }
    }

    fn set(&mut self, fuse: u32, value: bool) {
        if let Some(place) = self.fuses.get_mut(fuse as usize) {
            *place = value;
        }
    }

    fn signature(&mut self) {
        let Some(first) = self.layout.signature else { return };
        let bytes = &self.placement.signature;
        if bytes.len() > 8 {
            self.found.push(refused(format!(
                "the signature has {} bytes, but the device stores only 8",
                bytes.len()
            )));
        }
        let bits =
            bytes.iter().take(8).flat_map(|byte| (0..8).map(move |bit| byte << bit & 0x80 != 0));
        for (fuse, bit) in (first..).zip(bits) {
            self.set(fuse, bit);
        }
    }

    /// Programs a row that acts on the whole device; it is an error if the device has no such row.
    fn global(&mut self, what: &str, row: Option<u32>, product: Option<&Product>) {
        match (row, product) {
            (Some(row), Some(product)) => self.row(row, product),
            (None, Some(_)) => {
                self.found.push(refused(format!("a {} has no {what}", self.placement.device.name)));
            }
            (Some(_) | None, None) => {}
        }
    }

    /// Sets up a macrocell without a function: if possible, it drives nothing, and its pin can be read if necessary.
    fn idle(&mut self, cell: &CellFuses) {
        if let Some(Setting::Fuse(kind)) = cell.kind {
            self.set(kind, is_read(self.placement, cell.pin));
        }
    }

    fn cell(&mut self, fuses: &CellFuses, cell: &Cell) {
        // Without a shape, the mode was rejected before.
        let Some(shape) = shape_for(self.layout, self.mode, cell) else { return };
        if let (Some(Setting::Fuse(fuse)), Some(kind)) = (fuses.kind, shape.kind) {
            self.set(fuse, kind);
        }
        // Wherever the gate is, 1 passes the sum itself to the pin: before the flip-flop it compensates the inverting buffer.
        match fuses.polarity {
            Setting::Fuse(fuse) => self.set(fuse, !cell.is_active_low),
            Setting::Fixed(is_high) if is_high == cell.is_active_low => {
                let level = if is_high { "high" } else { "low" };
                self.refuse_cell(cell, &format!("is always active {level}"));
            }
            Setting::Fixed(_) => {}
        }
        let always = Product::default();
        match shape.enable {
            Enable::Row(row) | Enable::PinLowAndRow(_, row) => {
                self.row(fuses.row + row, cell.enable.as_ref().unwrap_or(&always));
            }
            Enable::Always | Enable::Never | Enable::PinLow(_) => {
                if cell.enable.is_some() {
                    self.refuse_cell(cell, "has no enable term");
                }
            }
        }
        self.clock(shape, fuses, cell);
        let limit = (fuses.n_rows - shape.sum) as usize;
        if cell.sum.len() > limit {
            self.refuse_cell(
                cell,
                &format!("has {limit} product terms, but its function needs {}", cell.sum.len()),
            );
            return;
        }
        for (row, product) in (fuses.row + shape.sum..).zip(&cell.sum) {
            self.row(row, product);
        }
    }

    /// Programs the rows for the clock, reset and preset of a single macrocell.
    fn clock(&mut self, shape: &Shape, fuses: &CellFuses, cell: &Cell) {
        let always = Product::default();
        match (shape.register, cell.kind) {
            (Register::Rows { clock, reset, set }, CellKind::Registered) => {
                match &cell.clock {
                    Some(product) => self.row(fuses.row + clock, product),
                    None => self.refuse_cell(cell, "needs a clock term"),
                }
                for (row, product) in [(reset, &cell.reset), (set, &cell.set)] {
                    if let Some(product) = product {
                        self.row(fuses.row + row, product);
                    }
                }
            }
            (Register::Rows { reset, set, .. }, CellKind::Combinational | CellKind::Tristate) => {
                // If both are always true, the flip-flop is transparent.
                self.row(fuses.row + reset, &always);
                self.row(fuses.row + set, &always);
                self.no_own_terms(cell);
            }
            (
                Register::None | Register::Pin(_),
                CellKind::Combinational | CellKind::Registered | CellKind::Tristate,
            ) => self.no_own_terms(cell),
        }
    }

    fn no_own_terms(&mut self, cell: &Cell) {
        let terms = [(&cell.clock, "clock"), (&cell.set, "preset"), (&cell.reset, "reset")];
        for (term, what) in terms {
            if term.is_some() {
                self.refuse_cell(cell, &format!("has no {what} term"));
            }
        }
    }

    fn refuse_cell(&mut self, cell: &Cell, what: &str) {
        let name = self.placement.name(cell.pin);
        let name = name.map(|name| format!(" (`{name}`)")).unwrap_or_default();
        let device = self.placement.device.name;
        self.found.push(refused(format!("pin {}{name} of a {device} {what}", cell.pin)));
    }

    /// Connects the literals of a product to a row.
    fn row(&mut self, row: u32, product: &Product) {
        let first = row * self.layout.n_columns;
        for column in 0..self.layout.n_columns {
            self.set(first + column, true);
        }
        for &(pin, value) in &product.0 {
            // A pin without a column was rejected with the mode.
            let Some(column) = self.mode.column(pin) else { continue };
            let column = column + u32::from(value == self.is_fed_back_inverted(pin));
            self.set(first + column, false);
        }
    }

    /// True if the first column of this pin carries the complement of its level.
    fn is_fed_back_inverted(&self, pin: u32) -> bool {
        let Some(cell) = self.placement.cell(pin) else { return false };
        let Some(shape) = shape_for(self.layout, self.mode, cell) else { return false };
        match (shape.feedback, shape.polarity) {
            (Feedback::Pin, _) | (Feedback::NotQ, PolarityGate::BeforeRegister) => false,
            // The pin is Q for a sum of the pin itself, and the column carries its complement.
            (Feedback::NotQ, PolarityGate::AfterRegister) => !cell.is_active_low,
        }
    }
}
