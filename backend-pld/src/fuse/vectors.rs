//! Test vectors for the programmer: levels to apply to the pins and levels to expect, from the fuse simulator.
//!
//! The first vector checks the device after power-up. The others are a walk: each step tries 64 rows of inputs in parallel and chooses the one
//! with the rarest state change and, among equals, the least visited state, so that the walk reaches many situations of a controller. Half of
//! the rows differ from the last one in a single input. Unused input pins are driven to both levels, so that a fuse that connects them by
//! mistake is detected.

use super::FuseMap;
use super::sim::Chip;
use crate::device::Clock;
use crate::placement::{CellKind, Placement};
use grafsynth_ir::diag::Diagnostic;
use std::collections::BTreeMap;

/// The action at one pin in a test vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// Driven low.
    Low,
    /// Driven high.
    High,
    /// A pulse: low, high, low, after the other inputs.
    Clock,
    /// A pulse: high, low, high.
    ClockLow,
    /// Low is expected.
    ExpectLow,
    /// High is expected.
    ExpectHigh,
    /// Expected to be undriven.
    ExpectOff,
    /// Neither driven nor tested.
    Ignore,
    /// A supply pin, or a pin that is not tested.
    NotTested,
}

impl Level {
    /// All levels with their letters.
    pub const ALL: [(Level, char); 9] = [
        (Level::Low, '0'),
        (Level::High, '1'),
        (Level::Clock, 'C'),
        (Level::ClockLow, 'K'),
        (Level::ExpectLow, 'L'),
        (Level::ExpectHigh, 'H'),
        (Level::ExpectOff, 'Z'),
        (Level::Ignore, 'X'),
        (Level::NotTested, 'N'),
    ];

    /// Its letter in a JEDEC file.
    #[must_use]
    pub fn letter(self) -> char {
        let of = |(level, letter): &(Level, char)| (*level == self).then_some(*letter);
        Self::ALL.iter().find_map(of).unwrap_or('X')
    }
}

/// One test vector: the action at each pin, pin 1 first.
pub type Vector = Vec<Level>;

/// The number of vectors for each product term.
const PER_TERM: usize = 24;
/// The minimum and maximum number of vectors.
const BOUNDS: (usize, usize) = (64, 1000);

/// The recommended number of vectors for a design.
#[must_use]
pub fn enough(placement: &Placement) -> usize {
    (placement.products().count() * PER_TERM).clamp(BOUNDS.0, BOUNDS.1)
}

/// Generates vectors: the levels after power-up, then `first` (levels of inputs by pin, one clock each), then a walk up to `n` vectors.
///
/// # Errors
/// If the simulator cannot run the device.
pub fn vectors(
    map: &FuseMap,
    placement: &Placement,
    first: &[Vec<(u32, bool)>],
    n: usize,
) -> Result<Vec<Vector>, Box<Diagnostic>> {
    let mut walk = Walk::new(map, placement)?;
    let mut vectors = vec![walk.wake()?];
    for row in first.iter().take(BOUNDS.1) {
        vectors.push(walk.given(row)?);
    }
    while vectors.len() < n {
        vectors.push(walk.step()?);
    }
    Ok(vectors)
}

/// The vectors that a device fails, numbered from 0, with the pin and the letter for its actual level; at most `most`.
///
/// # Errors
/// If the simulator cannot run the device.
pub fn failures(
    map: &FuseMap,
    vectors: &[Vector],
    most: usize,
) -> Result<Vec<(usize, u32, Level)>, Box<Diagnostic>> {
    let mut chip = Chip::new(map)?;
    let mut failures = Vec::new();
    for (at, vector) in vectors.iter().enumerate() {
        let mut levels = Vec::new();
        for (pin, level) in (1..).zip(vector) {
            if matches!(level, Level::Low | Level::Clock) {
                levels.push((pin, 0));
            } else if matches!(level, Level::High | Level::ClockLow) {
                levels.push((pin, u64::MAX));
            }
        }
        if at == 0 {
            // The levels are applied before the power-up.
            chip.put(&levels)?;
            chip.power_up()?;
        } else {
            chip.put(&levels)?;
        }
        for (pin, level) in (1..).zip(vector) {
            let (there, back) = if *level == Level::Clock {
                (u64::MAX, 0)
            } else if *level == Level::ClockLow {
                (0, u64::MAX)
            } else {
                continue;
            };
            chip.put(&[(pin, there)])?;
            chip.put(&[(pin, back)])?;
        }
        for (pin, level) in (1..).zip(vector) {
            let is_high = chip.level(pin) & 1 == 1;
            let seen = match (chip.drives(pin) & 1 == 1, is_high) {
                (true, true) => Level::ExpectHigh,
                (true, false) => Level::ExpectLow,
                (false, _) => Level::ExpectOff,
            };
            let is_looked_at =
                matches!(level, Level::ExpectLow | Level::ExpectHigh | Level::ExpectOff);
            if is_looked_at && seen != *level {
                failures.push((at, pin, seen));
                if failures.len() >= most {
                    return Ok(failures);
                }
            }
        }
    }
    Ok(failures)
}

struct Walk<'a> {
    chip: Chip<'a>,
    placement: &'a Placement,
    clocks: Vec<u32>,
    /// Pins that the walk drives, except clocks and enables.
    inputs: Vec<u32>,
    /// Pins with a constant level.
    fixed: Vec<(u32, bool)>,
    last: Vec<(u32, bool)>,
    /// How often each state change was made.
    edges: BTreeMap<(Vec<bool>, Vec<bool>), u32>,
    /// How often each state was reached.
    states: BTreeMap<Vec<bool>, u32>,
    random: u64,
}

impl<'a> Walk<'a> {
    fn new(map: &'a FuseMap, placement: &'a Placement) -> Result<Self, Box<Diagnostic>> {
        let chip = Chip::new(map)?;
        let device = placement.device;
        let is_registered = |cell: &&crate::placement::Cell| cell.kind == CellKind::Registered;
        let mut clocks = match device.clock {
            Clock::Term => Vec::new(),
            Clock::Pin(_) | Clock::None => {
                if placement.cells.iter().any(|cell| is_registered(&cell)) {
                    chip.clock_pins()
                } else {
                    Vec::new()
                }
            }
        };
        for cell in placement.cells.iter().filter(is_registered) {
            // Clock terms of a single pin get pulses; other clock terms follow from the levels.
            if let Some([(pin, _)]) = cell.clock.as_ref().map(|product| product.0.as_slice())
                && !clocks.contains(pin)
                && placement.cell(*pin).is_none()
            {
                clocks.push(*pin);
            }
        }
        let enables = chip.enable_pins();
        let (mut inputs, mut fixed) = (Vec::new(), Vec::new());
        for pin in 1..=device.n_pins {
            if device.is_supply(pin) || clocks.contains(&pin) || placement.cell(pin).is_some() {
                continue;
            }
            if enables.contains(&pin) {
                fixed.push((pin, false));
            } else if device.control_pins.contains(&pin) && !device.free_when_combinational {
                fixed.push((pin, true));
            } else if chip.drives(pin) == 0 {
                inputs.push(pin);
            }
        }
        Ok(Walk {
            chip,
            placement,
            clocks,
            inputs,
            fixed,
            last: Vec::new(),
            edges: BTreeMap::new(),
            states: BTreeMap::new(),
            random: 0x9E37_79B9_7F4A_7C15,
        })
    }

    fn random(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random
    }

    /// Powers the device up with all inputs low, and returns the vector that checks it.
    fn wake(&mut self) -> Result<Vector, Box<Diagnostic>> {
        let mut levels: Vec<(u32, u64)> = self.inputs.iter().map(|pin| (*pin, 0)).collect();
        levels.extend(self.clocks.iter().map(|pin| (*pin, 0)));
        levels.extend(self.fixed.iter().map(|&(pin, value)| (pin, spread(value))));
        self.chip.put(&levels)?;
        self.chip.power_up()?;
        self.last = self.inputs.iter().map(|pin| (*pin, false)).collect();
        Ok(self.vector(false))
    }

    /// Clocks once with these inputs (the others keep their values), and returns the vector.
    fn given(&mut self, row: &[(u32, bool)]) -> Result<Vector, Box<Diagnostic>> {
        for (pin, value) in &mut self.last {
            if let Some((_, given)) = row.iter().find(|(known, _)| known == pin) {
                *value = *given;
            }
        }
        let levels: Vec<_> = self.last.iter().map(|&(pin, value)| (pin, spread(value))).collect();
        let before = self.chip.state(0);
        self.clock(&levels)?;
        let after = self.chip.state(0);
        self.count(before, after);
        Ok(self.vector(true))
    }

    /// Clocks once with the inputs that cause the rarest state change and, among equals, lead to the least visited state; returns the vector.
    fn step(&mut self) -> Result<Vector, Box<Diagnostic>> {
        let before = self.chip.state(0);
        // Half of the runs change single inputs of the last row, so that the walk tests both sides of every literal.
        let mut tried: Vec<(u32, u64)> = Vec::new();
        for at in 0..self.inputs.len() {
            let (pin, last) = (self.inputs[at], self.last.get(at).is_some_and(|(_, value)| *value));
            let wild = self.random();
            let mut near = spread(last);
            for run in 0..32 {
                let mut toggles = run % self.inputs.len();
                if run >= self.inputs.len() {
                    toggles =
                        usize::try_from(wild >> run & 0xFFFF).unwrap_or(0) % self.inputs.len();
                }
                if toggles == at {
                    near ^= 1 << run;
                }
            }
            tried.push((pin, near & 0xFFFF_FFFF | wild & !0xFFFF_FFFF));
        }
        let mut chip = self.chip.clone();
        chip.put(&tried)?;
        for pin in &self.clocks {
            chip.pulse(*pin)?;
        }
        let offset = u32::try_from(self.random() & 63).unwrap_or(0);
        let best = (0..64)
            .map(|run| (run + offset) & 63)
            .min_by_key(|run| {
                let after = chip.state(*run);
                let states = self.states.get(&after).copied().unwrap_or(0);
                let edges = self.edges.get(&(before.clone(), after)).copied().unwrap_or(0);
                (edges.min(8), states)
            })
            .unwrap_or(0);
        self.last = tried.iter().map(|&(pin, values)| (pin, values >> best & 1 == 1)).collect();
        chip.fork(best)?;
        let after = chip.state(0);
        self.chip = chip;
        self.count(before, after);
        Ok(self.vector(true))
    }

    fn clock(&mut self, levels: &[(u32, u64)]) -> Result<(), Box<Diagnostic>> {
        self.chip.put(levels)?;
        for pin in self.clocks.clone() {
            self.chip.pulse(pin)?;
        }
        Ok(())
    }

    fn count(&mut self, before: Vec<bool>, after: Vec<bool>) {
        *self.states.entry(after.clone()).or_default() += 1;
        *self.edges.entry((before, after)).or_default() += 1;
    }

    fn vector(&self, is_clocked: bool) -> Vector {
        let device = self.placement.device;
        (1..=device.n_pins)
            .map(|pin| {
                let of = |levels: &[(u32, bool)]| {
                    levels.iter().find(|(known, _)| *known == pin).map(|(_, value)| *value)
                };
                if device.is_supply(pin) {
                    Level::NotTested
                } else if self.clocks.contains(&pin) {
                    if is_clocked { Level::Clock } else { Level::Low }
                } else if let Some(value) = of(&self.last).or_else(|| of(&self.fixed)) {
                    if value { Level::High } else { Level::Low }
                } else if self.placement.cell(pin).is_some() {
                    match (self.chip.drives(pin) & 1, self.chip.level(pin) & 1) {
                        (1, 1) => Level::ExpectHigh,
                        (1, _) => Level::ExpectLow,
                        _ => Level::ExpectOff,
                    }
                } else {
                    Level::Ignore
                }
            })
            .collect()
    }
}

fn spread(value: bool) -> u64 {
    if value { u64::MAX } else { 0 }
}
