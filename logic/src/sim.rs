//! The equation simulator: executes a [`Logic`] clock by clock, with 64 independent runs at once.
//!
//! Only gates that have a changed input are computed again (selective trace), and a wide gate is a tree of narrow ones: one clock of a large chart
//! changes little, so it costs little.

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{
    Flop, FlopId, Logic, Node, NodeId, PinInput, PinInputId, PinOutput, PinOutputId,
};

/// A circuit with its current state.
///
/// Values are words: bit k of each word belongs to run k. For a single run use 0 and 1 (or all ones) and read bit 0.
#[derive(Debug, Clone)]
pub struct LogicSim<'a> {
    logic: &'a Logic,
    inputs: IdMap<PinInput, u64>,
    flops: IdMap<Flop, u64>,
    /// Registered outputs have their own flip-flop.
    registers: IdMap<PinOutput, u64>,
    gates: Gates,
    /// Values of the gates, valid except for those that depend on a gate of `dirty`.
    values: Vec<u64>,
    /// The gates to compute again, one bit each. Operands come before the gates that read them, so one upward pass visits each once.
    dirty: Vec<u64>,
}

/// How a gate combines its operands.
#[derive(Debug, Clone, Copy)]
enum Op {
    Const(bool),
    Input(PinInputId),
    Flop(FlopId),
    Not,
    And,
    Or,
    Xor,
    Mux,
}

/// The nodes as gates of at most [`WIDE`] operands; each gate comes after its operands.
#[derive(Debug, Clone)]
struct Gates {
    ops: Vec<Op>,
    operands: Lists,
    /// The gates that read each gate.
    readers: Lists,
    of_node: IdMap<Node, u32>,
    of_input: IdMap<PinInput, Vec<u32>>,
    of_flop: IdMap<Flop, Vec<u32>>,
}

/// The maximum number of operands of a gate.
const WIDE: usize = 8;

/// Lists of gates, stored one after the other.
#[derive(Debug, Clone)]
struct Lists {
    ends: Vec<u32>,
    all: Vec<u32>,
}

impl Lists {
    fn push(&mut self, list: &[u32]) {
        self.all.extend(list);
        self.ends.push(index(self.all.len()));
    }

    fn get(&self, at: u32) -> &[u32] {
        let start = if at == 0 { 0 } else { self.ends[at as usize - 1] };
        &self.all[start as usize..self.ends[at as usize] as usize]
    }
}

/// The number of a gate in 32 bits, which are enough for every circuit.
fn index(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl Gates {
    fn new(logic: &Logic) -> Self {
        let none = || Lists { ends: Vec::new(), all: Vec::new() };
        let mut gates = Gates {
            ops: Vec::new(),
            operands: none(),
            readers: none(),
            of_node: IdMap::filled(&logic.nodes, 0),
            of_input: IdMap::filled(&logic.inputs, Vec::new()),
            of_flop: IdMap::filled(&logic.flops, Vec::new()),
        };
        for (id, node) in logic.nodes.iter() {
            let of = |operands: &[NodeId]| -> Vec<u32> {
                operands.iter().map(|operand| gates.of_node[*operand]).collect()
            };
            let gate = match node {
                Node::Const(value) => gates.gate(Op::Const(*value), &[]),
                Node::Input(input) => {
                    let gate = gates.gate(Op::Input(*input), &[]);
                    gates.of_input[*input].push(gate);
                    gate
                }
                Node::Flop(flop) => {
                    let gate = gates.gate(Op::Flop(*flop), &[]);
                    gates.of_flop[*flop].push(gate);
                    gate
                }
                Node::Not(a) => {
                    let operands = of(&[*a]);
                    gates.gate(Op::Not, &operands)
                }
                Node::And(all) => {
                    let operands = of(all);
                    gates.tree(Op::And, operands)
                }
                Node::Or(all) => {
                    let operands = of(all);
                    gates.tree(Op::Or, operands)
                }
                Node::Xor(a, b) => {
                    let operands = of(&[*a, *b]);
                    gates.gate(Op::Xor, &operands)
                }
                Node::Mux(a, b, c) => {
                    let operands = of(&[*a, *b, *c]);
                    gates.gate(Op::Mux, &operands)
                }
            };
            gates.of_node[id] = gate;
        }
        gates.readers = gates.turned();
        gates
    }

    fn gate(&mut self, op: Op, operands: &[u32]) -> u32 {
        self.ops.push(op);
        self.operands.push(operands);
        index(self.ops.len() - 1)
    }

    fn tree(&mut self, op: Op, mut operands: Vec<u32>) -> u32 {
        while operands.len() > WIDE {
            operands = operands.chunks(WIDE).map(|part| self.gate(op, part)).collect();
        }
        self.gate(op, &operands)
    }

    /// For each gate, the gates that read it.
    fn turned(&self) -> Lists {
        let mut ends = vec![0; self.ops.len()];
        for operand in &self.operands.all {
            ends[*operand as usize] += 1;
        }
        let mut sum = 0;
        let mut next = Vec::with_capacity(ends.len());
        for end in &mut ends {
            next.push(sum);
            sum += *end;
            *end = sum;
        }
        let mut all = vec![0; self.operands.all.len()];
        for gate in 0..index(self.ops.len()) {
            for operand in self.operands.get(gate) {
                let place = &mut next[*operand as usize];
                all[*place as usize] = gate;
                *place += 1;
            }
        }
        Lists { ends, all }
    }
}

fn mark(dirty: &mut [u64], gates: &[u32]) {
    for gate in gates {
        dirty[*gate as usize / 64] |= 1 << (gate % 64);
    }
}

impl<'a> LogicSim<'a> {
    /// The circuit after power-up, with all inputs 0.
    #[must_use]
    pub fn new(logic: &'a Logic) -> Self {
        let gates = Gates::new(logic);
        let mut sim = LogicSim {
            logic,
            inputs: IdMap::filled(&logic.inputs, 0),
            flops: IdMap::filled(&logic.flops, 0),
            registers: IdMap::filled(&logic.outputs, 0),
            values: vec![0; gates.ops.len()],
            dirty: Vec::new(),
            gates,
        };
        sim.reset();
        sim
    }

    /// The simulated circuit.
    #[must_use]
    pub fn logic(&self) -> &'a Logic {
        self.logic
    }

    /// Sets the state after power-up: flip-flops at their initial value, inputs 0.
    pub fn reset(&mut self) {
        self.inputs = IdMap::filled(&self.logic.inputs, 0);
        self.reset_registers();
    }

    /// Gives all flip-flops their initial values; the inputs keep theirs.
    pub fn reset_registers(&mut self) {
        self.flops = IdMap::build(&self.logic.flops, |_, flop| all(flop.init));
        self.registers =
            IdMap::build(&self.logic.outputs, |_, output| all(output.registered.unwrap_or(false)));
        let n_gates = self.values.len();
        self.dirty = vec![!0; n_gates.div_ceil(64)];
        if let Some(last) = self.dirty.last_mut().filter(|_| !n_gates.is_multiple_of(64)) {
            *last = (1 << (n_gates % 64)) - 1;
        }
    }

    /// Sets an input; it keeps the value until the next call.
    pub fn set_input(&mut self, input: PinInputId, value: u64) {
        if self.inputs[input] != value {
            self.inputs[input] = value;
            mark(&mut self.dirty, &self.gates.of_input[input]);
        }
    }

    /// The current value of a flip-flop.
    #[must_use]
    pub fn flop(&self, flop: FlopId) -> u64 {
        self.flops[flop]
    }

    /// Sets a flip-flop.
    pub fn set_flop(&mut self, flop: FlopId, value: u64) {
        if self.flops[flop] != value {
            self.flops[flop] = value;
            mark(&mut self.dirty, &self.gates.of_flop[flop]);
        }
    }

    /// The current value of an output pin: a combinational output follows the inputs, and a registered output has its value from the last clock edge.
    pub fn output(&mut self, output: PinOutputId) -> u64 {
        if self.logic.outputs[output].registered.is_some() {
            return self.registers[output];
        }
        self.settle();
        self.value(self.logic.outputs[output].value)
    }

    /// The current value of any node.
    pub fn node(&mut self, node: grafsynth_ir::logic::NodeId) -> u64 {
        self.settle();
        self.value(node)
    }

    /// Applies one clock edge with the current inputs.
    pub fn clock(&mut self) {
        self.settle();
        for (id, flop) in self.logic.flops.iter() {
            self.set_flop(id, self.value(flop.next));
        }
        for (id, output) in self.logic.outputs.iter() {
            if output.registered.is_some() {
                self.registers[id] = self.value(output.value);
            }
        }
    }

    /// The value of a node after [`LogicSim::settle`].
    fn value(&self, node: NodeId) -> u64 {
        self.values[self.gates.of_node[node] as usize]
    }

    fn settle(&mut self) {
        for word in 0..self.dirty.len() {
            // A gate may mark later gates of the same word.
            while self.dirty[word] != 0 {
                let gate = word * 64 + self.dirty[word].trailing_zeros() as usize;
                self.dirty[word] &= self.dirty[word] - 1;
                let value = self.computed(index(gate));
                if self.values[gate] != value {
                    self.values[gate] = value;
                    mark(&mut self.dirty, self.gates.readers.get(index(gate)));
                }
            }
        }
    }

    fn computed(&self, gate: u32) -> u64 {
        let mut operands =
            self.gates.operands.get(gate).iter().map(|operand| self.values[*operand as usize]);
        match self.gates.ops[gate as usize] {
            Op::Const(value) => all(value),
            Op::Input(input) => self.inputs[input],
            Op::Flop(flop) => self.flops[flop],
            Op::Not => operands.fold(0, |_, value| !value),
            Op::And => operands.fold(!0, |all, value| all & value),
            Op::Or => operands.fold(0, |all, value| all | value),
            Op::Xor => operands.fold(0, |all, value| all ^ value),
            Op::Mux => {
                let mut next = || operands.next().unwrap_or_default();
                let (condition, then, otherwise) = (next(), next(), next());
                condition & then | !condition & otherwise
            }
        }
    }
}

/// A word with the same bit in all runs.
fn all(value: bool) -> u64 {
    if value { !0 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::LogicSim;
    use crate::build::Builder;
    use grafsynth_ir::logic::{NodeId, PinOutput, PinRole};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_computed_again_is_all_that_changed(
            gates in proptest::collection::vec((0u8..5, 0usize..100, 0usize..100, 0usize..100), 1..90),
            moves in proptest::collection::vec((0usize..4, 0usize..8, any::<u64>()), 1..30),
        ) {
            let mut builder = Builder::default();
            let mut nodes: Vec<NodeId> = (0..4).map(|_| builder.input_named("x")).collect();
            let (ids, values): (Vec<_>, Vec<_>) = (0..4).map(|_| builder.flop_named("q", false)).unzip();
            nodes.extend(values);
            for (kind, a, b, c) in gates {
                let at = |index: usize| nodes[index % nodes.len()];
                let (a, b, c) = (at(a), at(b), at(c));
                nodes.push(match kind {
                    0 => builder.and([a, b, c]),
                    1 => builder.or([a, b, c]),
                    2 => builder.xor(a, b),
                    3 => builder.mux(a, b, c),
                    _ => builder.not(a),
                });
            }
            for (k, id) in ids.iter().enumerate() {
                builder.logic.flops[*id].next = nodes[nodes.len() - 1 - k % nodes.len()];
            }
            let logic = builder.logic;
            let inputs: Vec<_> = logic.inputs.ids().collect();
            let mut sim = LogicSim::new(&logic);
            let mut held = [0_u64; 4];
            for (kind, at, value) in moves {
                match kind {
                    0 => sim.clock(),
                    1 => sim.set_flop(ids[at % 4], value),
                    2 => sim.reset(),
                    _ => sim.set_input(inputs[at % 4], value),
                }
                match kind {
                    2 => held = [0; 4],
                    3 => held[at % 4] = value,
                    _ => {}
                }
                // A new simulator computes everything.
                let mut fresh = LogicSim::new(&logic);
                inputs.iter().zip(held).for_each(|(input, value)| fresh.set_input(*input, value));
                ids.iter().for_each(|id| fresh.set_flop(*id, sim.flop(*id)));
                for node in logic.nodes.ids() {
                    prop_assert_eq!(sim.node(node), fresh.node(node));
                }
                if kind == 0 {
                    continue;
                }
                let expected: Vec<u64> = ids.iter().map(|id| fresh.node(logic.flops[*id].next)).collect();
                fresh.clock();
                prop_assert_eq!(ids.iter().map(|id| fresh.flop(*id)).collect::<Vec<_>>(), expected);
            }
        }
    }

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
