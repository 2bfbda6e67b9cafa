//! The equation simulator: a [`Logic`] executed as it stands, clock by clock, 64 independent runs at once.

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{
    Flop, FlopId, Logic, Node, PinInput, PinInputId, PinOutput, PinOutputId,
};

/// A circuit in some state.
///
/// Values are words: bit k of each word belongs to run k. For a single run use 0 and 1 (or all ones) and look at bit 0.
#[derive(Debug, Clone)]
pub struct LogicSim<'a> {
    logic: &'a Logic,
    inputs: IdMap<PinInput, u64>,
    flops: IdMap<Flop, u64>,
    /// Registered outputs have a flip-flop of their own.
    registers: IdMap<PinOutput, u64>,
    /// Values of the nodes, valid unless `stale`.
    nodes: IdMap<Node, u64>,
    stale: bool,
}

impl<'a> LogicSim<'a> {
    /// The circuit after power-up, with all inputs 0.
    #[must_use]
    pub fn new(logic: &'a Logic) -> Self {
        let mut sim = LogicSim {
            logic,
            inputs: IdMap::filled(&logic.inputs, 0),
            flops: IdMap::filled(&logic.flops, 0),
            registers: IdMap::filled(&logic.outputs, 0),
            nodes: IdMap::filled(&logic.nodes, 0),
            stale: true,
        };
        sim.reset();
        sim
    }

    /// The circuit that runs.
    #[must_use]
    pub fn logic(&self) -> &'a Logic {
        self.logic
    }

    /// Power-up: flip-flops at their first value, inputs 0.
    pub fn reset(&mut self) {
        self.inputs = IdMap::filled(&self.logic.inputs, 0);
        self.flops = IdMap::build(&self.logic.flops, |_, flop| all(flop.init));
        self.registers =
            IdMap::build(&self.logic.outputs, |_, output| all(output.registered.unwrap_or(false)));
        self.stale = true;
    }

    /// Puts a value on an input; it stays until the next one.
    pub fn set_input(&mut self, input: PinInputId, value: u64) {
        if self.inputs[input] != value {
            self.inputs[input] = value;
            self.stale = true;
        }
    }

    /// The present value of a flip-flop.
    #[must_use]
    pub fn flop(&self, flop: FlopId) -> u64 {
        self.flops[flop]
    }

    /// Puts a flip-flop into a state.
    pub fn set_flop(&mut self, flop: FlopId, value: u64) {
        self.flops[flop] = value;
        self.stale = true;
    }

    /// The present value of an output pin: combinational ones follow the inputs, registered ones the last clock.
    pub fn output(&mut self, output: PinOutputId) -> u64 {
        if self.logic.outputs[output].registered.is_some() {
            return self.registers[output];
        }
        self.settle();
        self.nodes[self.logic.outputs[output].value]
    }

    /// The present value of any node.
    pub fn node(&mut self, node: grafsynth_ir::logic::NodeId) -> u64 {
        self.settle();
        self.nodes[node]
    }

    /// One clock edge with the inputs as they stand.
    pub fn clock(&mut self) {
        self.settle();
        for (id, flop) in self.logic.flops.iter() {
            self.flops[id] = self.nodes[flop.next];
        }
        for (id, output) in self.logic.outputs.iter() {
            if output.registered.is_some() {
                self.registers[id] = self.nodes[output.value];
            }
        }
        self.stale = true;
    }

    fn settle(&mut self) {
        if !self.stale {
            return;
        }
        for (id, node) in self.logic.nodes.iter() {
            let values = &self.nodes;
            self.nodes[id] = match node {
                Node::Const(value) => all(*value),
                Node::Input(input) => self.inputs[*input],
                Node::Flop(flop) => self.flops[*flop],
                Node::Not(a) => !values[*a],
                Node::And(operands) => operands.iter().fold(!0, |value, &a| value & values[a]),
                Node::Or(operands) => operands.iter().fold(0, |value, &a| value | values[a]),
                Node::Xor(a, b) => values[*a] ^ values[*b],
                Node::Mux(a, b, c) => values[*a] & values[*b] | !values[*a] & values[*c],
            };
        }
        self.stale = false;
    }
}

/// The same bit in all runs.
fn all(value: bool) -> u64 {
    if value { !0 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::LogicSim;
    use crate::build::Builder;
    use grafsynth_ir::logic::{PinOutput, PinRole};

    #[test]
    fn a_toggle_toggles_and_its_outputs_follow() {
        let mut builder = Builder::default();
        let enable = builder.input_named("enable");
        let (q, value) = builder.flop_named("q", true);
        builder.logic.flops[q].next = builder.xor(value, enable);
        let pin = |name: &str, registered| PinOutput {
            name: name.into(),
            role: PinRole::Unknown,
            value,
            registered,
            mealy: false,
            meta: Default::default(),
        };
        let follows = builder.logic.outputs.push(pin("follows", None));
        let late = builder.logic.outputs.push(pin("late", Some(false)));
        let logic = builder.finish();
        let mut sim = LogicSim::new(&logic);
        let enable = logic.inputs.ids().next().unwrap();
        assert_eq!((sim.flop(q), sim.output(follows), sim.output(late)), (!0, !0, 0));
        sim.set_input(enable, 0b10);
        sim.clock();
        assert_eq!((sim.flop(q), sim.output(follows), sim.output(late)), (!0b10, !0b10, !0));
        sim.clock();
        assert_eq!((sim.flop(q), sim.output(late)), (!0, !0b10));
    }
}
