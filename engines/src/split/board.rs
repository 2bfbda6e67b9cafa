//! The board of a split: the wires of its link, with the simulated chips at their ends.

use super::lines::{Lines, Next};
use grafsynth_backend_pld::fuse::run::Burned;
use grafsynth_driver::report::Chip;
use grafsynth_driver::report::chip::Kind;
use grafsynth_driver::run::chip_row;
use grafsynth_driver::split::{Linked, Split};
use grafsynth_ir::Diagnostic;
use grafsynth_ir::Gather;
use grafsynth_ir::Valid;
use grafsynth_ir::logic::{Logic, PinInputId, PinOutputId, PinRole};
use grafsynth_ir::net::Net;
use grafsynth_logic::chip::ChipSim;
use grafsynth_logic::sim::LogicSim;
use grafsynth_sim::{InputRow, Row, Simulator};
use grafsynth_split::link::{ChipPins, Connection, End, Object};
use std::collections::BTreeMap;

/// The number of passes after which the levels of wires between chips must settle; no wire depends on another one.
const MOST_PASSES: usize = 8;

/// The wires and the chips. The pins of the CPU are set and read from outside.
pub(super) struct Board<'a> {
    linked: &'a Linked,
    chips: Vec<Device<'a>>,
    /// The level that the CPU gives each pin that it drives.
    driven: BTreeMap<u32, bool>,
    /// The level of each connection, as the chips at its ends see it.
    levels: Vec<Option<bool>>,
    /// The lines, if the parts run on their own, with the levels that have arrived at the pins of the CPU.
    lines: Option<(Lines, BTreeMap<u32, Option<bool>>)>,
    /// The level that the plant gives each pin of a chip.
    supplied: BTreeMap<End, bool>,
    /// The first mistake in the use of the pins.
    pub(super) trouble: Option<String>,
}

impl<'a> Board<'a> {
    /// The board after power-up, with the CPU in reset: the resistors give the levels.
    ///
    /// # Errors
    /// A chip that cannot be simulated.
    pub(super) fn new(split: &'a Split, linked: &'a Linked) -> Result<Self, Vec<Diagnostic>> {
        let mut chips = Vec::new();
        for (at, pins) in linked.chips.iter().enumerate() {
            let net = &split.division.parts[at].net;
            let of_part = split.parts.get(at).and_then(|part| part.built.chips.first());
            chips.push(match of_part {
                Some(chip) => Device::new(net, chip, pins)?,
                None => Device::still(net),
            });
        }
        let levels = vec![None; linked.link.connections.len()];
        let mut board = Board {
            linked,
            chips,
            driven: BTreeMap::new(),
            levels,
            lines: None,
            supplied: BTreeMap::new(),
            trouble: None,
        };
        board.update();
        Ok(board)
    }

    fn cpu(&self) -> usize {
        self.linked.chips.len()
    }

    /// From now on the parts run on their own: chips with clocks of their own, and lines that deliver changes late.
    pub(super) fn run_free(&mut self, seed: u64) {
        let cpu = self.cpu();
        let mut arrived = BTreeMap::new();
        let linked = self.linked;
        for one in &linked.link.connections {
            for end in one.to.iter().filter(|end| end.part == cpu) {
                arrived.insert(end.pin, self.level_of(one));
            }
        }
        self.lines = Some((Lines::new(seed, self.chips.len()), arrived));
    }

    /// The lines of parts that run on their own.
    pub(super) fn lines(&mut self) -> Option<&mut Lines> {
        self.lines.as_mut().map(|(lines, _)| lines)
    }

    /// Time passes until the next event at a part, but not beyond `until`.
    pub(super) fn pass(&mut self, until: u64) -> Option<Happened> {
        let happened = match self.lines()?.pass(until)? {
            Next::Arrival(end, level) => {
                self.reach(end, level);
                if end.part == self.cpu() { Happened::AtCpu } else { Happened::AtChip }
            }
            Next::Edge(at) => {
                let is_changed = self.chips.get_mut(at).is_some_and(Device::pulse);
                if !is_changed {
                    self.lines()?.is_idle(at);
                }
                Happened::Edge(at)
            }
        };
        self.update();
        Some(happened)
    }

    /// A pin gets another level: at once in lockstep, otherwise when the line delivers it.
    fn put(&mut self, end: End, level: Option<bool>) {
        match self.lines() {
            Some(lines) => lines.send(end, level),
            None => self.reach(end, level),
        }
    }

    fn reach(&mut self, end: End, level: Option<bool>) {
        if let Some(chip) = self.chips.get_mut(end.part) {
            // An undriven pin is high.
            chip.put(end.pin, level.unwrap_or(true));
        } else if let Some((_, arrived)) = &mut self.lines {
            arrived.insert(end.pin, level);
        }
    }

    /// The plant gives the inputs of a row to the chips that have them without the CPU; `inverted` gives the opposite levels.
    pub(super) fn supply(&mut self, net: &Net, input: &InputRow, inverted: bool) {
        let linked = self.linked;
        for one in &linked.link.direct {
            let offset = input.value(one.input).abs_diff(net.inputs[one.input].ty.bounds().0);
            let level = offset.checked_shr(one.bit).unwrap_or(0) & 1 == 1;
            for end in &one.to {
                let level = level != inverted;
                if self.supplied.insert(*end, level) != Some(level) {
                    self.put(*end, Some(level));
                }
            }
        }
        self.update();
    }

    /// The CPU drives a pin, or makes it an input.
    pub(super) fn set(&mut self, pin: u32, level: Option<bool>) {
        let before = self.driven.get(&pin).copied();
        if before == level {
            return;
        }
        let end = End { part: self.cpu(), pin };
        let is_read = |one: &Connection| one.from != end && one.to.contains(&end);
        match level {
            Some(level) => {
                if let Some(one) = self.linked.link.connections.iter().find(|one| is_read(one)) {
                    let message =
                        format!("the CPU drives pin {pin}, but a chip drives `{}`", one.name);
                    self.trouble.get_or_insert(message);
                }
                self.driven.insert(pin, level);
            }
            None => _ = self.driven.remove(&pin),
        }
        self.update();
    }

    /// The level at a pin of the CPU; a pin without a connection is low.
    pub(super) fn level(&mut self, pin: u32) -> bool {
        if let Some(level) = self.driven.get(&pin) {
            return *level;
        }
        let end = End { part: self.cpu(), pin };
        let linked = self.linked;
        let Some(one) = linked.link.connections.iter().find(|one| one.to.contains(&end)) else {
            return false;
        };
        let arrived = self.lines.as_ref().and_then(|(_, arrived)| arrived.get(&pin).copied());
        let level = arrived.unwrap_or_else(|| self.level_of(one));
        if level.is_none() {
            let message = format!("the CPU reads `{}`, which nothing drives", one.name);
            self.trouble.get_or_insert(message);
        }
        level.unwrap_or(true)
    }

    fn level_of(&mut self, one: &Connection) -> Option<bool> {
        if one.from.part == self.cpu() {
            self.driven.get(&one.from.pin).copied().or(one.pull)
        } else {
            self.chips.get_mut(one.from.part)?.driven(one.from.pin)
        }
    }

    /// The chips follow the wires.
    fn update(&mut self) {
        let linked = self.linked;
        for _ in 0..MOST_PASSES {
            let mut is_settled = true;
            for (at, one) in linked.link.connections.iter().enumerate() {
                let level = self.level_of(one);
                if level == self.levels[at] {
                    continue;
                }
                self.levels[at] = level;
                is_settled = false;
                one.to.iter().for_each(|end| self.put(*end, level));
            }
            if is_settled {
                return;
            }
        }
        self.trouble.get_or_insert_with(|| "the wires between the chips do not settle".to_owned());
    }

    /// The row that a chip shows now.
    pub(super) fn row(&mut self, chip: usize, net: &Net, input: &InputRow) -> Option<Row> {
        self.chips.get_mut(chip).map(|chip| chip.row(net, input))
    }

    /// The rows of the chips at the end of a round.
    pub(super) fn rows(&mut self, nets: &[&Net], input: &InputRow) -> Vec<Row> {
        self.chips.iter_mut().zip(nets).map(|(chip, net)| chip.row(net, input)).collect()
    }

    /// Adds the first error of a chip to the mistakes.
    pub(super) fn trouble(&mut self) -> Option<String> {
        let of_chip = self.chips.iter().find_map(Device::trouble);
        self.trouble.clone().or(of_chip)
    }
}

/// An event at a part that runs on its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Happened {
    /// A pin of the CPU has another level.
    AtCpu,
    /// A pin of a chip has another level.
    AtChip,
    /// This chip has made a reaction.
    Edge(usize),
}

/// A simulated chip with its pins.
struct Device<'a> {
    circuit: Circuit<'a>,
    clock: Option<u32>,
    /// The pin that resets the flip-flops at the clock, and its level.
    reset: Option<u32>,
    is_reset: bool,
    is_high: bool,
    /// True if there was a clock edge in this round.
    is_clocked: bool,
}

/// How a chip is simulated.
enum Circuit<'a> {
    /// Fuse by fuse.
    Fuses(Box<ChipSim<'a, Burned<'a>>>),
    /// The circuit that was read back from its text, for a device without a documented fuse map. For each output pin: whether it carries the complement.
    Text {
        logic: &'a Logic,
        sim: Box<ChipSim<'a, LogicSim<'a>>>,
        inputs: BTreeMap<u32, PinInputId>,
        outputs: BTreeMap<u32, (PinOutputId, bool)>,
    },
    /// A chip with nothing on it, for which no text was written: all its rows are row 0.
    Still(Row),
}

impl<'a> Device<'a> {
    fn still(net: &Valid<Net>) -> Self {
        let circuit = Circuit::Still(Simulator::new(net).reset());
        let (is_reset, is_high, is_clocked) = (false, false, false);
        Device { circuit, clock: None, reset: None, is_reset, is_high, is_clocked }
    }

    fn new(net: &'a Net, chip: &'a Chip, pins: &ChipPins) -> Result<Self, Vec<Diagnostic>> {
        let circuit = match &chip.fuses {
            Some(map) => {
                let mut burned = Burned::new(map, &chip.read_back, &chip.roles)
                    .map_err(|finding| vec![*finding])?;
                // A pin that is not wired is high, which disables outputs.
                for pin in chip.enables.iter().filter(|pin| !pins.grounded.contains(pin)) {
                    burned.put_pin(*pin, true);
                }
                Circuit::Fuses(Box::new(ChipSim::over(net, &chip.read_back, burned)))
            }
            None => text(net, chip, pins),
        };
        let (clock, reset) = (pins.clock, pins.reset);
        let (is_reset, is_high, is_clocked) = (false, false, false);
        Ok(Device { circuit, clock, reset, is_reset, is_high, is_clocked })
    }

    /// Applies a level to a pin.
    fn put(&mut self, pin: u32, level: bool) {
        let is_edge = self.clock == Some(pin) && level && !self.is_high;
        if self.clock == Some(pin) {
            self.is_high = level;
        }
        if self.reset == Some(pin) {
            self.is_reset = level;
        }
        // A reset is no reaction.
        if is_edge && !self.is_reset {
            self.sample(true);
            self.is_clocked = true;
        }
        match &mut self.circuit {
            Circuit::Fuses(sim) => sim.sim_mut().put_pin(pin, level),
            Circuit::Still(_) => {}
            Circuit::Text { sim, inputs, .. } => {
                if let Some(input) = inputs.get(&pin) {
                    sim.sim_mut().set_input(*input, if level { u64::MAX } else { 0 });
                }
                // The circuit that was read back is without its reset.
                match (is_edge, self.is_reset) {
                    (true, true) => sim.sim_mut().reset_registers(),
                    (true, false) => sim.sim_mut().clock(),
                    (false, _) => {}
                }
            }
        }
    }

    /// A pulse of the clock; true if a flip-flop has changed.
    fn pulse(&mut self) -> bool {
        let before = self.flops();
        if let Some(clock) = self.clock {
            self.put(clock, true);
            self.put(clock, false);
        }
        self.flops() != before
    }

    /// The values of all flip-flops.
    fn flops(&self) -> Vec<bool> {
        match &self.circuit {
            Circuit::Fuses(sim) => sim.sim().state(),
            Circuit::Text { sim, logic, .. } => {
                logic.flops.ids().map(|flop| sim.sim().flop(flop) & 1 == 1).collect()
            }
            Circuit::Still(_) => Vec::new(),
        }
    }

    /// The level that the chip gives a pin.
    fn driven(&mut self, pin: u32) -> Option<bool> {
        match &mut self.circuit {
            Circuit::Fuses(sim) => sim.sim().driven(pin),
            Circuit::Still(_) => None,
            Circuit::Text { sim, outputs, .. } => {
                let (output, is_inverted) = *outputs.get(&pin)?;
                Some((sim.sim_mut().output(output) & 1 == 1) != is_inverted)
            }
        }
    }

    fn sample(&mut self, mealy: bool) {
        match &mut self.circuit {
            Circuit::Fuses(sim) => sim.sample(mealy),
            Circuit::Text { sim, .. } => sim.sample(mealy),
            Circuit::Still(_) => {}
        }
    }

    fn row(&mut self, net: &Net, input: &InputRow) -> Row {
        if !self.is_clocked {
            self.sample(true);
        }
        self.is_clocked = false;
        self.sample(false);
        match &mut self.circuit {
            Circuit::Fuses(sim) => chip_row(net, sim, input.clone()),
            Circuit::Text { sim, .. } => chip_row(net, sim, input.clone()),
            Circuit::Still(row) => row.clone(),
        }
    }

    fn trouble(&self) -> Option<String> {
        match &self.circuit {
            Circuit::Fuses(sim) => sim.sim().trouble().map(|found| found.message.clone()),
            Circuit::Text { .. } | Circuit::Still(_) => None,
        }
    }
}

/// The circuit of a text, with its pins.
fn text<'a>(net: &'a Net, chip: &'a Chip, pins: &ChipPins) -> Circuit<'a> {
    let pin_of = |object: Object, bit: u32| {
        let signal = pins.signals.iter().find(|one| one.object == object && one.bit == bit);
        signal.map(|signal| signal.pin)
    };
    let circuit = &chip.read_back;
    let inputs = circuit.inputs.iter().filter_map(|(id, input)| match input.role {
        PinRole::Input(object, bit) => Some((pin_of(Object::Input(object), bit)?, id)),
        PinRole::Tick => Some((pins.tick?, id)),
        _ => None,
    });
    let outputs = circuit.outputs.iter().filter_map(|(id, output)| match output.role {
        PinRole::Output(object, bit) => {
            let pin = pin_of(Object::Output(object), bit)?;
            let is_it = |kind: Kind| matches!(kind, Kind::Output(_));
            let shown = chip.signals.iter().find(|one| one.pin == Some(pin) && is_it(one.kind));
            Some((pin, (id, shown.is_some_and(|one| one.is_inverted))))
        }
        _ => None,
    });
    let (inputs, outputs) = (inputs.gather(), outputs.gather());
    Circuit::Text { logic: circuit, sim: Box::new(ChipSim::new(net, circuit)), inputs, outputs }
}
