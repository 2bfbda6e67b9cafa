//! Runs a programmed device in place of the circuit that was decoded from it: the same pins and flip-flops, simulated fuse by fuse.

use super::sim::Chip;
use super::{FuseMap, Role};
use crate::Object;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Flop, FlopId, Logic, PinInput, PinInputId, PinOutput, PinOutputId};
use grafsynth_logic::chip::Parts;
use grafsynth_logic::sim::LogicSim;

/// A pin, and whether it carries the complement of its signal.
type Wire = Option<(u32, bool)>;

/// A device that is driven and read by the names of a circuit.
#[derive(Debug, Clone)]
pub struct Burned<'a> {
    chip: Chip<'a>,
    inputs: IdMap<PinInput, Wire>,
    flops: IdMap<Flop, Wire>,
    outputs: IdMap<PinOutput, Wire>,
    clocks: Vec<u32>,
    /// The first error of the device.
    trouble: Option<Box<Diagnostic>>,
}

fn input_name(object: &Object) -> Option<&str> {
    if let Object::Input(input) = object { Some(&input.name) } else { None }
}

fn flop_name(object: &Object) -> Option<&str> {
    if let Object::Flop(flop) = object { Some(&flop.name) } else { None }
}

fn output_name(object: &Object) -> Option<&str> {
    if let Object::Output(output) = object { Some(&output.name) } else { None }
}

/// Removes the first wire with this name from a list and returns it.
fn take(wires: &mut Vec<(&str, Wire)>, name: &str) -> Wire {
    let at = wires.iter().position(|(known, _)| *known == name)?;
    wires.remove(at).1
}

impl<'a> Burned<'a> {
    /// The device just after power-up. `roles` map pins to parts of `logic`; parts are found by kind and name.
    ///
    /// # Errors
    /// If the simulator cannot run the device.
    pub fn new(map: &'a FuseMap, logic: &Logic, roles: &[Role]) -> Result<Self, Box<Diagnostic>> {
        let mut chip = Chip::new(map)?;
        // Two flip-flops may have the same name: the first of the circuit is the first of the roles, and so on.
        let names = |name_of: fn(&Object) -> Option<&str>| {
            let mut all: Vec<(&str, Wire)> = Vec::new();
            for role in roles {
                if let Some(name) = name_of(&role.object) {
                    all.push((name, Some((role.pin, role.is_inverted))));
                }
            }
            all
        };
        let mut own = names(input_name);
        let inputs = IdMap::build(&logic.inputs, |_, input| take(&mut own, &input.name));
        let mut own = names(flop_name);
        let flops = IdMap::build(&logic.flops, |_, flop| take(&mut own, &flop.name));
        let mut own = names(output_name);
        let outputs = IdMap::build(&logic.outputs, |_, output| take(&mut own, &output.name));
        let of_roles = roles.iter().filter(|role| matches!(role.object, Object::Clock));
        let clocks: Vec<u32> = of_roles.map(|role| role.pin).collect();
        let enables = chip.enable_pins();
        let low: Vec<(u32, u64)> = clocks.iter().chain(&enables).map(|pin| (*pin, 0)).collect();
        chip.put(&low)?;
        chip.power_up()?;
        Ok(Burned { chip, inputs, flops, outputs, clocks, trouble: None })
    }

    /// The first error of the device: levels that did not settle. Later results are meaningless.
    #[must_use]
    pub fn trouble(&self) -> Option<&Diagnostic> {
        self.trouble.as_deref()
    }

    /// Applies a level to a pin. A rising edge at the pin of the clock is a clock edge.
    pub fn put_pin(&mut self, pin: u32, level: bool) {
        let outcome = self.chip.put(&[(pin, if level { u64::MAX } else { 0 })]);
        self.done(outcome);
    }

    /// The level that the device gives a pin; `None` if it does not drive the pin.
    #[must_use]
    pub fn driven(&self, pin: u32) -> Option<bool> {
        (self.chip.drives(pin) & 1 == 1).then(|| self.chip.level(pin) & 1 == 1)
    }

    /// The values of all flip-flops, also of those that the circuit does not name.
    #[must_use]
    pub fn state(&self) -> Vec<bool> {
        self.chip.state(0)
    }

    fn done(&mut self, outcome: Result<(), Box<Diagnostic>>) {
        if let Err(trouble) = outcome {
            self.trouble.get_or_insert(trouble);
        }
    }

    fn level(&self, wire: Wire) -> u64 {
        wire.map_or(0, |(pin, is_inverted)| {
            let level = self.chip.level(pin);
            if is_inverted { !level } else { level }
        })
    }
}

impl Parts for Burned<'_> {
    fn set_input(&mut self, input: PinInputId, value: u64) {
        if let Some((pin, is_inverted)) = self.inputs[input] {
            let value = if is_inverted { !value } else { value };
            let outcome = self.chip.put(&[(pin, value)]);
            self.done(outcome);
        }
    }

    fn output(&mut self, output: PinOutputId) -> u64 {
        self.level(self.outputs[output])
    }

    fn flop(&self, flop: FlopId) -> u64 {
        self.level(self.flops[flop])
    }

    fn clock(&mut self) {
        for pin in self.clocks.clone() {
            let outcome = self.chip.pulse(pin);
            self.done(outcome);
        }
    }

    fn reset(&mut self) {
        let outcome = self.chip.power_up();
        self.done(outcome);
    }
}

/// Compares a device with a circuit from power-up, in 64 parallel runs with random inputs; returns the first difference in words.
///
/// # Errors
/// If the simulator cannot run the device.
pub fn difference(
    map: &FuseMap,
    logic: &Logic,
    roles: &[Role],
    clocks: usize,
) -> Result<Option<String>, Box<Diagnostic>> {
    let mut device = Burned::new(map, logic, roles)?;
    let mut circuit = LogicSim::new(logic);
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    for clock in 0..clocks {
        for input in logic.inputs.ids() {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            // In four of the 64 runs all inputs stay low.
            let value = random & !0xF;
            device.set_input(input, value);
            circuit.set_input(input, value);
        }
        for output in logic.outputs.ids() {
            // A registered output shows its flip-flop, which the circuit does not store here.
            let own = &logic.outputs[output];
            if own.registered.is_none() && device.output(output) != circuit.output(output) {
                return Ok(Some(format!("output `{}` before clock {clock}", own.name)));
            }
        }
        device.clock();
        circuit.clock();
        for flop in logic.flops.ids() {
            if device.flop(flop) != circuit.flop(flop) {
                return Ok(Some(format!("`{}` after clock {clock}", logic.flops[flop].name)));
            }
        }
        if let Some(trouble) = device.trouble {
            return Err(trouble);
        }
    }
    Ok(None)
}
