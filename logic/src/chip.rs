//! Runs a circuit as the net that it was made from: rows in, rows out.

use crate::build::needed;
use crate::sim::LogicSim;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{
    FlopBit, FlopId, Logic, Node, PinInputId, PinOutputId, PinRole, shown_by,
};
use grafsynth_ir::net::{Evolution, InputId, Net, Output, OutputId, Step, StepId, VarId};
use grafsynth_ir::program::Origin;
use std::collections::BTreeMap;

/// A simulated circuit with the inputs, outputs and flip-flops of a [`Logic`]: the circuit itself, or a device that implements it.
pub trait Parts {
    /// Sets an input.
    fn set_input(&mut self, input: PinInputId, value: u64);
    /// The current value of an output; only the lowest bit is used.
    fn output(&mut self, output: PinOutputId) -> u64;
    /// The current value of a flip-flop; only the lowest bit is used.
    fn flop(&self, flop: FlopId) -> u64;
    /// Applies one clock edge.
    fn clock(&mut self);
    /// Returns to the state after power-up.
    fn reset(&mut self);
}

impl Parts for LogicSim<'_> {
    fn set_input(&mut self, input: PinInputId, value: u64) {
        LogicSim::set_input(self, input, value);
    }

    fn output(&mut self, output: PinOutputId) -> u64 {
        LogicSim::output(self, output)
    }

    fn flop(&self, flop: FlopId) -> u64 {
        LogicSim::flop(self, flop)
    }

    fn clock(&mut self) {
        LogicSim::clock(self);
    }

    fn reset(&mut self) {
        LogicSim::reset(self);
    }
}

/// Runs one reaction per clock, or clocks until the `busy` pin is 0. Inputs, outputs, steps and variables have the ids of the net.
///
/// Pins and flip-flops are found by their roles ([`PinRole`], [`FlopBit`]), so a circuit that was read from a text needs its roles restored first. A
/// pin is sampled as semantics.md §9 defines it: after the clock edge with the row's inputs still applied; a `mealy` pin just before the edge.
#[derive(Debug, Clone)]
pub struct ChipSim<'a, S = LogicSim<'a>> {
    net: &'a Net,
    logic: &'a Logic,
    sim: S,
    inputs: Vec<(PinInputId, InputId, u32)>,
    ticks: Vec<PinInputId>,
    outputs: BTreeMap<OutputId, Vec<(PinOutputId, u32)>>,
    faults: Vec<PinOutputId>,
    busy: Option<PinOutputId>,
    /// The result of [`most_clocks`].
    patience: u64,
    /// The flip-flops of each object and element.
    holders: BTreeMap<(Origin, u32), Vec<Holder>>,
    /// For each step, the bits that are all set while the step is active.
    shown: IdMap<Step, Vec<Origin>>,
    /// The values of the bits that are functions of the flip-flops, after the last clock edge.
    decoded: BTreeMap<(Origin, u32), u64>,
    sampled: IdMap<Output, Option<i64>>,
}

/// A flip-flop that stores a bit or its complement.
#[derive(Debug, Clone, Copy)]
struct Holder {
    flop: FlopId,
    bit: u32,
    inverted: bool,
}

/// The reason why a reaction gave no row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoRow {
    /// A row has more than one tick; a chip advances at most one tick per reaction.
    TooManyTicks {
        /// The number of ticks in the row.
        dt: u64,
    },
    /// The reaction does not end: `busy` is still 1 after more clocks than a correct circuit of this net needs.
    StillBusy {
        /// The number of clocks that were applied.
        clocks: u64,
    },
}

/// A bound above the number of clocks of a reaction in a correct circuit. It counts micro-steps, events taken from queues, the final empty check, and a
/// reserve. The bound is 1 if the settings allow only one clock per reaction.
#[must_use]
pub fn most_clocks(net: &Net) -> u64 {
    let Evolution::Stable { limit } = net.settings.evolution else { return 1 };
    let limit = u64::from(limit);
    let spare = 4;
    if !net.settings.policy.is_statechart() {
        return limit.saturating_add(spare);
    }
    // The count restarts with each event that waits at the start; raised and sent events wait in queues of bounded length.
    let n_events = net.inputs.values().filter(|input| input.kind.is_event()).count() as u64;
    let places = net.settings.queue.map_or(n_events, u64::from).max(n_events);
    let steps = places.saturating_add(1).saturating_mul(limit);
    let waited = steps.saturating_add(2).saturating_mul(places).saturating_mul(2);
    steps.saturating_add(waited).saturating_add(spare)
}

impl<'a> ChipSim<'a> {
    /// The circuit after power-up.
    #[must_use]
    pub fn new(net: &'a Net, logic: &'a Logic) -> Self {
        Self::over(net, logic, LogicSim::new(logic))
    }
}

impl<'a, S: Parts> ChipSim<'a, S> {
    /// A simulated device in place of the circuit, after power-up.
    #[must_use]
    pub fn over(net: &'a Net, logic: &'a Logic, sim: S) -> Self {
        let mut inputs = Vec::new();
        let mut ticks = Vec::new();
        for (pin, input) in logic.inputs.iter() {
            match input.role {
                PinRole::Input(id, bit) => inputs.push((pin, id, bit)),
                PinRole::Tick => ticks.push(pin),
                _ => {}
            }
        }
        let mut outputs: BTreeMap<OutputId, Vec<(PinOutputId, u32)>> = BTreeMap::new();
        let mut faults = Vec::new();
        let mut busy = None;
        for (pin, output) in logic.outputs.iter() {
            match output.role {
                PinRole::Output(id, bit) => outputs.entry(id).or_default().push((pin, bit)),
                PinRole::Fault => faults.push(pin),
                PinRole::Busy => busy = Some(pin),
                PinRole::Input(..) | PinRole::Tick | PinRole::Reset | PinRole::Unknown => {}
            }
        }
        let mut holders: BTreeMap<(Origin, u32), Vec<Holder>> = BTreeMap::new();
        for (id, flop) in logic.flops.iter() {
            if let Some(FlopBit { origin, element, bit, inverted }) = flop.holds {
                holders.entry((origin, element)).or_default().push(Holder {
                    flop: id,
                    bit,
                    inverted,
                });
            }
        }
        let sampled = IdMap::filled(&net.outputs, None);
        let mut chip = ChipSim {
            net,
            logic,
            sim,
            inputs,
            ticks,
            outputs,
            faults,
            busy,
            patience: most_clocks(net),
            shown: shown_by(net, |origin| {
                holders.contains_key(&(origin, 0))
                    || logic.decoded.iter().any(|bit| bit.holds.origin == origin)
            }),
            holders,
            decoded: BTreeMap::new(),
            sampled,
        };
        chip.reset();
        chip
    }

    /// Returns to the state after power-up, and records row 0 of the trace: all inputs are 0 (or the value nearest to 0), and outputs have their current
    /// values.
    pub fn reset(&mut self) {
        self.sim.reset();
        let zeros: Vec<i64> = self.net.inputs.values().map(|input| input.ty.saturate(0)).collect();
        self.put(&zeros, false);
        self.sample(true);
        self.sample(false);
    }

    /// Runs one reaction. `inputs` has a value for each input of the net, by id (inputs without a pin are ignored, missing values are 0); `dt` is 0 or 1.
    ///
    /// A circuit with a `busy` pin is clocked until the pin is 0, without a new event or tick (semantics.md §9). Returns the number of clocks.
    ///
    /// # Errors
    /// If `dt` is larger than 1 (then nothing is executed), or if the reaction does not end.
    pub fn react(&mut self, inputs: &[i64], dt: u64) -> Result<u64, NoRow> {
        if dt > 1 {
            return Err(NoRow::TooManyTicks { dt });
        }
        self.put(inputs, dt == 1);
        self.sample(true);
        self.sim.clock();
        let mut clocks = 1;
        if self.is_busy() {
            self.end_events();
        }
        while self.is_busy() {
            if clocks >= self.patience {
                return Err(NoRow::StillBusy { clocks });
            }
            self.sim.clock();
            clocks += 1;
        }
        self.sample(false);
        Ok(clocks)
    }

    /// Applies a single clock edge with these inputs, whether or not the previous reaction has ended; outputs are sampled after the edge.
    pub fn clock(&mut self, inputs: &[i64], tick: bool) {
        self.put(inputs, tick);
        self.sim.clock();
        self.sample(false);
    }

    /// True if the reaction is still running; always false without a `busy` pin.
    #[must_use]
    pub fn is_busy(&mut self) -> bool {
        self.busy.is_some_and(|busy| self.sim.output(busy) & 1 == 1)
    }

    /// Sets events and the tick back to 0: they last one clock period.
    fn end_events(&mut self) {
        for &pin in &self.ticks {
            self.sim.set_input(pin, 0);
        }
        for &(pin, input, _) in &self.inputs {
            if self.net.inputs[input].kind.is_event() {
                self.sim.set_input(pin, 0);
            }
        }
    }

    fn put(&mut self, inputs: &[i64], tick: bool) {
        for &(pin, input, bit) in &self.inputs {
            let ty = self.net.inputs[input].ty;
            let value = ty.saturate(inputs.get(input.index()).copied().unwrap_or(0));
            let code = value.abs_diff(ty.bounds().0);
            self.sim.set_input(pin, code >> bit & 1);
        }
        for &pin in &self.ticks {
            self.sim.set_input(pin, u64::from(tick));
        }
    }

    /// Computes the decoded bits. A node refers only to earlier nodes, and these functions read no input.
    fn decode(&mut self) {
        let logic = self.logic;
        if logic.decoded.is_empty() {
            return;
        }
        let wanted = needed(logic, logic.decoded.iter().map(|bit| bit.node));
        let mut values: IdMap<Node, bool> = IdMap::filled(&logic.nodes, false);
        for (id, node) in logic.nodes.iter().filter(|(id, _)| wanted[*id]) {
            values[id] = match node {
                Node::Const(value) => *value,
                Node::Input(_) => false,
                Node::Flop(flop) => self.sim.flop(*flop) & 1 == 1,
                Node::Not(a) => !values[*a],
                Node::And(all) => all.iter().all(|a| values[*a]),
                Node::Or(all) => all.iter().any(|a| values[*a]),
                Node::Xor(a, b) => values[*a] != values[*b],
                Node::Mux(a, b, c) => values[if values[*a] { *b } else { *c }],
            };
        }
        self.decoded.clear();
        for bit in &logic.decoded {
            let code = self.decoded.entry((bit.holds.origin, bit.holds.element)).or_insert(0);
            *code |= u64::from(values[bit.node]) << bit.holds.bit.min(63);
        }
    }

    /// Stores the current values of the pins as those of the row: of the `mealy` pins, just before a clock edge, or of the others, after it.
    pub fn sample(&mut self, mealy: bool) {
        let logic = self.logic;
        self.decode();
        for (&output, pins) in &self.outputs {
            let mut code: u64 = 0;
            let mut is_own = true;
            for &(pin, bit) in pins {
                is_own &= logic.outputs[pin].mealy == mealy;
                code |= (self.sim.output(pin) & 1) << bit.min(63);
            }
            if is_own && let Some(declared) = self.net.outputs.get(output) {
                self.sampled[output] = Some(declared.ty.bounds().0.saturating_add_unsigned(code));
            }
        }
    }

    /// The value of an output in the last row; for an extern action, the number of calls. `None` if the output has no pins.
    #[must_use]
    pub fn output(&self, output: OutputId) -> Option<i64> {
        self.sampled[output]
    }

    /// Whether the step is active; `None` if no flip-flop represents it.
    #[must_use]
    pub fn is_active(&self, step: StepId) -> Option<bool> {
        let bits = &self.shown[step];
        (!bits.is_empty())
            .then(|| bits.iter().all(|bit| self.code(*bit, 0).is_some_and(|code| code & 1 == 1)))
    }

    /// The value of an element of a variable (element 0 of a plain one). A variable with a single possible value needs no flip-flop.
    #[must_use]
    pub fn var(&self, var: VarId, element: u32) -> Option<i64> {
        let (lo, hi) = self.net.vars[var].ty.bounds();
        if lo == hi {
            return Some(lo);
        }
        self.code(Origin::Var(var), element).map(|code| lo.saturating_add_unsigned(code))
    }

    /// The fault flag of the row; false if the circuit has no fault pin.
    #[must_use]
    pub fn fault(&mut self) -> bool {
        self.faults.iter().any(|&pin| self.sim.output(pin) & 1 == 1)
    }

    /// The code in the flip-flops of a stored object.
    #[must_use]
    pub fn code(&self, origin: Origin, element: u32) -> Option<u64> {
        let decoded = self.decoded.get(&(origin, element)).copied();
        let Some(holders) = self.holders.get(&(origin, element)) else { return decoded };
        Some(holders.iter().fold(decoded.unwrap_or(0), |code, &Holder { flop, bit, inverted }| {
            let value = (self.sim.flop(flop) & 1 == 1) != inverted;
            code | u64::from(value) << bit.min(63)
        }))
    }

    /// The underlying simulator, to set its pins one by one.
    pub fn sim_mut(&mut self) -> &mut S {
        &mut self.sim
    }

    /// The underlying simulator.
    #[must_use]
    pub fn sim(&self) -> &S {
        &self.sim
    }
}
