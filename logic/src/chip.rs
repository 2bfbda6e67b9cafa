//! A circuit run as the net it was made from: rows in, rows out.

use crate::sim::LogicSim;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{FlopBit, FlopId, Logic, PinInputId, PinOutputId, PinRole};
use grafsynth_ir::net::{InputId, Net, Output, OutputId, StepId, VarId};
use grafsynth_ir::program::Origin;
use std::collections::BTreeMap;

/// The circuit executes one reaction a clock; inputs go in and outputs, steps and variables come out as numbers of the net.
///
/// Pins and flip-flops are found by their roles ([`PinRole`], [`FlopBit`]), so a circuit that was read from a text needs them put back first. A pin is
/// sampled as semantics.md §9 says: after the clock with the row's inputs still held, a `mealy` one just before it.
#[derive(Debug, Clone)]
pub struct ChipSim<'a> {
    net: &'a Net,
    sim: LogicSim<'a>,
    inputs: Vec<(PinInputId, InputId, u32)>,
    ticks: Vec<PinInputId>,
    outputs: BTreeMap<OutputId, Vec<(PinOutputId, u32)>>,
    faults: Vec<PinOutputId>,
    /// Flip-flops of each thing and element.
    holders: BTreeMap<(Origin, u32), Vec<Holder>>,
    sampled: IdMap<Output, Option<i64>>,
}

/// A flip-flop with the bit that it holds, or the complement of it.
#[derive(Debug, Clone, Copy)]
struct Holder {
    flop: FlopId,
    bit: u32,
    inverted: bool,
}

/// More than one tick in a row: a chip cannot do that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooManyTicks {
    /// How many.
    pub dt: u64,
}

impl<'a> ChipSim<'a> {
    /// The circuit after power-up.
    #[must_use]
    pub fn new(net: &'a Net, logic: &'a Logic) -> Self {
        let mut inputs = Vec::new();
        let mut ticks = Vec::new();
        for (pin, input) in logic.inputs.iter() {
            match input.role {
                PinRole::Input(id, bit) => inputs.push((pin, id, bit)),
                PinRole::Tick => ticks.push(pin),
                PinRole::Reset
                | PinRole::Output(..)
                | PinRole::Busy
                | PinRole::Fault
                | PinRole::Unknown => {}
            }
        }
        let mut outputs: BTreeMap<OutputId, Vec<(PinOutputId, u32)>> = BTreeMap::new();
        let mut faults = Vec::new();
        for (pin, output) in logic.outputs.iter() {
            match output.role {
                PinRole::Output(id, bit) => outputs.entry(id).or_default().push((pin, bit)),
                PinRole::Fault => faults.push(pin),
                PinRole::Input(..)
                | PinRole::Tick
                | PinRole::Reset
                | PinRole::Busy
                | PinRole::Unknown => {}
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
            sim: LogicSim::new(logic),
            inputs,
            ticks,
            outputs,
            faults,
            holders,
            sampled,
        };
        chip.reset();
        chip
    }

    /// Power-up, and row 0 of the trace: all inputs 0 (or the value nearest to it), outputs as they stand.
    pub fn reset(&mut self) {
        self.sim.reset();
        let zeros: Vec<i64> = self.net.inputs.values().map(|input| input.ty.saturate(0)).collect();
        self.put(&zeros, false);
        self.sample(true);
        self.sample(false);
    }

    /// One clock: `inputs` by number of the net's input (those without a pin are ignored, a missing one is 0), `dt` 0 or 1.
    ///
    /// # Errors
    /// When `dt` is larger than 1; nothing has happened then.
    pub fn react(&mut self, inputs: &[i64], dt: u64) -> Result<(), TooManyTicks> {
        if dt > 1 {
            return Err(TooManyTicks { dt });
        }
        self.put(inputs, dt == 1);
        self.sample(true);
        self.sim.clock();
        self.sample(false);
        Ok(())
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

    fn sample(&mut self, mealy: bool) {
        let logic = self.sim.logic();
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

    /// The value of an output in the row just made; for an extern action the number of calls. None for one without pins.
    #[must_use]
    pub fn output(&self, output: OutputId) -> Option<i64> {
        self.sampled[output]
    }

    /// Whether the step is active; none if no flip-flop says so.
    #[must_use]
    pub fn is_active(&self, step: StepId) -> Option<bool> {
        self.code(Origin::Step(step), 0).map(|code| code & 1 == 1)
    }

    /// The value of an element of a variable (element 0 of a plain one). One with a single possible value needs no flip-flop.
    #[must_use]
    pub fn var(&self, var: VarId, element: u32) -> Option<i64> {
        let (lo, hi) = self.net.vars[var].ty.bounds();
        if lo == hi {
            return Some(lo);
        }
        self.code(Origin::Var(var), element).map(|code| lo.saturating_add_unsigned(code))
    }

    /// The fault flag of the row; a circuit without the pin never faults.
    #[must_use]
    pub fn fault(&mut self) -> bool {
        self.faults.iter().any(|&pin| self.sim.output(pin) & 1 == 1)
    }

    /// The code in the flip-flops of something the net keeps.
    #[must_use]
    pub fn code(&self, origin: Origin, element: u32) -> Option<u64> {
        let holders = self.holders.get(&(origin, element))?;
        Some(holders.iter().fold(0, |code, &Holder { flop, bit, inverted }| {
            let value = (self.sim.flop(flop) & 1 == 1) != inverted;
            code | u64::from(value) << bit.min(63)
        }))
    }

    /// The circuit underneath.
    #[must_use]
    pub fn sim(&self) -> &LogicSim<'a> {
        &self.sim
    }
}
