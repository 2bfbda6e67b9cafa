//! Simulates a device at the level of its fuses, 64 runs in parallel.
//!
//! It uses the tables only: rows and columns, the configuration of a macrocell under its fuses, the position of the polarity gate and the feedback.
//! It shares no code with the mapper or the decoder, so that it can check them.
//!
//! # Behaviour
//! - At power-up every flip-flop is 0. An undriven pin is high: these devices have pull-ups.
//! - Levels are computed until they settle. A row is true while all signals connected to it are high. The enable row or pin decides whether a
//!   macrocell drives its pin; otherwise the pin has the level applied from outside.
//! - A flip-flop stores D at the rising edge of its clock, with the value of D just before the edge. The synchronous preset is read then too.
//! - An asynchronous reset or preset acts while its row is true.

use super::{FuseMap, codes};
use crate::device::layout::{
    CellFuses, Enable, Feedback, Layout, Mode, PolarityGate, Register, Shape,
};
use grafsynth_ir::diag::Diagnostic;

/// The number of passes after which the levels must settle: longer than any path through all macrocells, with ripple clocks.
const MOST_PASSES: u32 = 64;

/// A simulated device.
#[derive(Debug, Clone)]
pub struct Chip<'a> {
    map: &'a FuseMap,
    layout: &'static Layout,
    mode: &'static Mode,
    /// The columns connected to each row.
    wired: Vec<Option<Vec<u32>>>,
    cells: Vec<State>,
    /// True if the power-up reset is still active.
    is_held: bool,
    /// The level applied from outside to each pin, by pin number.
    put: Vec<u64>,
    /// The level of each pin.
    levels: Vec<u64>,
}

/// The state of a macrocell.
#[derive(Debug, Clone)]
struct State {
    fuses: &'static CellFuses,
    /// The configuration; `None` for an undefined setting without a row in use.
    shape: Option<&'static Shape>,
    q: u64,
    /// D before the current change.
    d: u64,
    /// The synchronous preset before the current change.
    preset: u64,
    /// The clock before the current change.
    clock: u64,
    /// The level that it outputs to its pin.
    out: u64,
    /// The runs in which it drives its pin.
    drives: u64,
}

/// The columns of the array in a pass, and their connections.
struct Rows<'c> {
    wired: &'c [Option<Vec<u32>>],
    columns: Vec<u64>,
}

impl Rows<'_> {
    fn get(&self, row: u32) -> u64 {
        match self.wired.get(row as usize) {
            Some(Some(wired)) => {
                wired.iter().fold(u64::MAX, |value, column| value & self.columns[*column as usize])
            }
            Some(None) | None => 0,
        }
    }
}

/// The columns connected to each row; `None` if they include a signal and its complement, or if the row is disabled.
fn wires(map: &FuseMap, layout: &Layout) -> Vec<Option<Vec<u32>>> {
    let wires = |row: u32| {
        if layout.row_switches.is_some_and(|first| !map.get(first + row)) {
            return None;
        }
        let is_wired = |column: &u32| !map.get(row * layout.n_columns + column);
        let wired: Vec<u32> = (0..layout.n_columns).filter(is_wired).collect();
        // Columns come in pairs of a level and its complement.
        let is_never = wired.windows(2).any(|pair| pair[0] % 2 == 0 && pair[1] == pair[0] + 1);
        (!is_never).then_some(wired)
    };
    (0..layout.n_rows()).map(wires).collect()
}

impl<'a> Chip<'a> {
    /// A device just after power-up, with all pins pulled high.
    ///
    /// # Errors
    /// If the device has no known fuse map, if a setting is undefined, or if the levels do not settle.
    pub fn new(map: &'a FuseMap) -> Result<Self, Box<Diagnostic>> {
        let layout = map.device.layout.ok_or_else(|| Box::new(super::map::no_map(map.device)))?;
        let is_set = |mode: &&Mode| mode.fuses.iter().all(|(fuse, on)| map.get(*fuse) == *on);
        let unknown = |what: String| Box::new(Diagnostic::error(codes::UNDOCUMENTED, what));
        let mode =
            layout.modes.iter().find(is_set).ok_or_else(|| {
                unknown(format!("the fuses select no mode of a {}", map.device.name))
            })?;
        let n_pins = map.device.n_pins as usize + 1;
        let mut chip = Chip {
            map,
            layout,
            mode,
            wired: wires(map, layout),
            cells: Vec::new(),
            is_held: false,
            put: vec![u64::MAX; n_pins],
            levels: vec![u64::MAX; n_pins],
        };
        for fuses in layout.cells {
            let shape = mode.shape(fuses.kind.map(|kind| map.setting(kind)));
            let mut rows = fuses.row..fuses.row + fuses.n_rows;
            if shape.is_none() && rows.any(|row| chip.wired[row as usize].is_some()) {
                return Err(unknown(format!(
                    "the fuses of pin {} of a {} have no documented meaning",
                    fuses.pin, map.device.name
                )));
            }
            chip.cells.push(State {
                fuses,
                shape,
                q: 0,
                d: 0,
                preset: 0,
                clock: u64::MAX,
                out: 0,
                drives: 0,
            });
        }
        chip.power_up()?;
        Ok(chip)
    }

    /// Cycles the power: flip-flops are 0 again; the levels applied to the pins are kept.
    ///
    /// # Errors
    /// If the levels do not settle.
    pub fn power_up(&mut self) -> Result<(), Box<Diagnostic>> {
        // While the reset is active, clock changes of settling levels are not edges.
        self.is_held = true;
        self.settle()?;
        self.is_held = false;
        self.settle()
    }

    /// Applies levels to pins, one bit per run, all at once.
    ///
    /// # Errors
    /// If the levels do not settle.
    pub fn put(&mut self, pins: &[(u32, u64)]) -> Result<(), Box<Diagnostic>> {
        for &(pin, value) in pins {
            if let Some(place) = self.put.get_mut(pin as usize) {
                *place = value;
            }
        }
        self.settle()
    }

    /// Applies a pulse to a clock pin: low, high, low.
    ///
    /// # Errors
    /// If the levels do not settle.
    pub fn pulse(&mut self, pin: u32) -> Result<(), Box<Diagnostic>> {
        self.put(&[(pin, 0)])?;
        self.put(&[(pin, u64::MAX)])?;
        self.put(&[(pin, 0)])
    }

    /// The level of a pin, one bit per run.
    #[must_use]
    pub fn level(&self, pin: u32) -> u64 {
        self.levels.get(pin as usize).copied().unwrap_or(u64::MAX)
    }

    /// The runs in which the device drives a pin.
    #[must_use]
    pub fn drives(&self, pin: u32) -> u64 {
        self.cells.iter().find(|cell| cell.fuses.pin == pin).map_or(0, |cell| cell.drives)
    }

    /// The flip-flop of a pin, if it is used.
    #[must_use]
    pub fn q(&self, pin: u32) -> Option<u64> {
        let cell = self.cells.iter().find(|cell| cell.fuses.pin == pin)?;
        cell.shape.filter(|shape| shape.register != Register::None).map(|_| cell.q)
    }

    /// Pins that clock flip-flops directly, not through a product term, each once.
    #[must_use]
    pub fn clock_pins(&self) -> Vec<u32> {
        let mut pins: Vec<u32> = Vec::new();
        for cell in &self.cells {
            if let Some(Shape { register: Register::Pin(pin), .. }) = cell.shape
                && !pins.contains(pin)
            {
                pins.push(*pin);
            }
        }
        pins
    }

    /// Pins that enable outputs while they are low.
    #[must_use]
    pub fn enable_pins(&self) -> Vec<u32> {
        let mut pins: Vec<u32> = Vec::new();
        for cell in &self.cells {
            if let Some(Shape {
                enable: Enable::PinLow(pin) | Enable::PinLowAndRow(pin, _), ..
            }) = cell.shape
                && !pins.contains(pin)
            {
                pins.push(*pin);
            }
        }
        pins
    }

    /// All flip-flops, as in one of the runs (0 to 63).
    #[must_use]
    pub fn state(&self, run: u32) -> Vec<bool> {
        self.cells.iter().map(|cell| cell.q >> (run & 63) & 1 == 1).collect()
    }

    /// Copies the state of this run to all runs: flip-flops and applied levels.
    ///
    /// # Errors
    /// If the levels do not settle.
    pub fn fork(&mut self, run: u32) -> Result<(), Box<Diagnostic>> {
        let spread = |word: u64| if word >> (run & 63) & 1 == 1 { u64::MAX } else { 0 };
        for cell in &mut self.cells {
            cell.q = spread(cell.q);
            cell.d = spread(cell.d);
            cell.preset = spread(cell.preset);
            cell.clock = spread(cell.clock);
            cell.out = spread(cell.out);
            cell.drives = spread(cell.drives);
        }
        for word in self.put.iter_mut().chain(&mut self.levels) {
            *word = spread(*word);
        }
        self.settle()
    }

    /// The columns of the array.
    fn rows(&self) -> Rows<'_> {
        let mut columns = vec![u64::MAX; self.layout.n_columns as usize];
        for &(pin, column) in self.mode.columns {
            let cell = self.cells.iter().find(|cell| cell.fuses.pin == pin);
            let feedback = cell.and_then(|cell| Some((cell.q, cell.shape?.feedback)));
            let value = match feedback {
                Some((q, Feedback::NotQ)) => !q,
                Some((_, Feedback::Pin)) | None => self.level(pin),
            };
            columns[column as usize] = value;
            columns[column as usize + 1] = !value;
        }
        Rows { wired: &self.wired, columns }
    }

    /// Makes one pass over all macrocells; true if a level or a flip-flop changed.
    fn pass(&mut self) -> bool {
        let rows = self.rows();
        let reset_all = self.layout.async_reset.map_or(0, |row| rows.get(row));
        let preset_all = self.layout.sync_preset.map_or(0, |row| rows.get(row));
        let next: Vec<State> = self
            .cells
            .iter()
            .map(|cell| next_state(self, cell, &rows, reset_all, preset_all))
            .collect();
        let mut has_changed = false;
        for (old, new) in self.cells.iter().zip(&next) {
            has_changed |= old.q != new.q || old.d != new.d || old.preset != new.preset;
        }
        self.cells = next;
        for pin in 0..self.levels.len() {
            let (drives, out) = self
                .cells
                .iter()
                .find(|cell| cell.fuses.pin as usize == pin)
                .map_or((0, 0), |cell| (cell.drives, cell.out));
            let level = drives & out | !drives & self.put[pin];
            has_changed |= level != self.levels[pin];
            self.levels[pin] = level;
        }
        has_changed
    }

    fn settle(&mut self) -> Result<(), Box<Diagnostic>> {
        for _ in 0..MOST_PASSES {
            if !self.pass() {
                return Ok(());
            }
        }
        let before = self.levels.clone();
        self.pass();
        let pins = (0..before.len())
            .filter(|pin| before[*pin] != self.levels[*pin])
            .map(|pin| pin.to_string())
            .collect::<Vec<_>>();
        let what = match pins.as_slice() {
            [only] => format!("the level of pin {only} does not settle"),
            all => format!("the levels of pins {} do not settle", all.join(", ")),
        };
        let finding = Diagnostic::error(codes::NOT_SETTLING, what)
            .help("a combinational output that depends on its own complement oscillates");
        Err(Box::new(finding))
    }
}

/// The state of a macrocell after a pass.
fn next_state(
    chip: &Chip<'_>,
    cell: &State,
    rows: &Rows<'_>,
    reset_all: u64,
    preset_all: u64,
) -> State {
    let Some(shape) = cell.shape else { return cell.clone() };
    let mut next = cell.clone();
    let (first, end) = (cell.fuses.row, cell.fuses.row + cell.fuses.n_rows);
    let sum = (first + shape.sum..end).fold(0, |sum, row| sum | rows.get(row));
    let gate = if chip.map.setting(cell.fuses.polarity) { u64::MAX } else { 0 };
    let d = match shape.polarity {
        PolarityGate::BeforeRegister => sum ^ gate,
        PolarityGate::AfterRegister => sum,
    };
    // Runs in which the flip-flop is transparent.
    let mut is_open = 0;
    match shape.register {
        Register::None => is_open = u64::MAX,
        Register::Pin(pin) => {
            let clock = chip.level(pin);
            let edge = clock & !cell.clock;
            next.q = edge & (cell.d | cell.preset) | !edge & cell.q;
            next.q &= !reset_all;
            next.clock = clock;
        }
        Register::Rows { clock, reset, set } => {
            let clock = rows.get(first + clock);
            let (reset, set) = (rows.get(first + reset), rows.get(first + set));
            let edge = clock & !cell.clock;
            next.q = edge & cell.d | !edge & cell.q;
            next.q = (next.q | set & !reset) & !(reset & !set);
            next.clock = clock;
            is_open = reset & set;
        }
    }
    if chip.is_held {
        next.q = 0;
    }
    next.d = d;
    next.preset = preset_all;
    let stored = is_open & d | !is_open & next.q;
    next.out = match shape.polarity {
        PolarityGate::BeforeRegister => !stored,
        PolarityGate::AfterRegister => stored ^ !gate,
    };
    next.drives = match shape.enable {
        Enable::Always => u64::MAX,
        Enable::Never => 0,
        Enable::Row(row) => rows.get(first + row),
        Enable::PinLow(pin) => !chip.level(pin),
        Enable::PinLowAndRow(pin, row) => !chip.level(pin) & rows.get(first + row),
    };
    next
}
