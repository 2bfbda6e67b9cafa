//! The product of the reference simulator and the circuit, searched breadth-first.

use grafsynth_ir::Valid;
use grafsynth_ir::logic::{FlopId, Logic, Node, NodeId, PinOutputId, PinRole};
use grafsynth_ir::net::Net;
use grafsynth_logic::build::for_each_operand;
use grafsynth_logic::chip::most_clocks;
use grafsynth_logic::sim::LogicSim;
use grafsynth_sim::{Difference, InputRow, Row, Simulator, State, Stimulus};
use indexmap::{IndexMap, IndexSet};
use std::rc::Rc;

use super::binding::{Binding, Compared, Shown, What};
use super::{Certificate, Counterexample, Method, Verdict};
use crate::alphabet::{Alphabet, NoAlphabet};
use crate::limits::Limits;
use crate::relevance::{Inputs, Relevance};
use crate::verdict::{Open, OpenReason};

/// A circuit that executes up to 64 rows at once, each from its own state.
pub(super) struct Lanes<'a> {
    logic: &'a Logic,
    binding: &'a Binding,
    sim: LogicSim<'a>,
    /// For each compared bit, its value in each lane.
    pub(super) bits: Vec<u64>,
    /// The maximum number of clocks that a reaction may take.
    patience: u64,
}

impl<'a> Lanes<'a> {
    pub(super) fn new(net: &Net, logic: &'a Logic, binding: &'a Binding) -> Self {
        Lanes {
            logic,
            binding,
            sim: LogicSim::new(logic),
            bits: vec![0; binding.compared.len()],
            patience: most_clocks(net),
        }
    }

    /// Sets the circuit to its state after power-up, with the inputs of row 0.
    pub(super) fn reset(&mut self, net: &Net) {
        self.sim.reset();
        let mut zero = InputRow::zero(net);
        zero.dt = 0;
        for (pin, value) in self.binding.pin_bits(net, &zero) {
            self.sim.set_input(pin, if value { !0 } else { 0 });
        }
        self.sample(true);
        self.sample(false);
    }

    /// The flip-flops in the mask, for one lane.
    pub(super) fn code(&self, lane: usize, mask: &[u64]) -> Vec<u64> {
        let mut code = vec![0; self.logic.flops.len().div_ceil(64)];
        for flop in self.logic.flops.ids() {
            code[flop.index() / 64] |= (self.sim.flop(flop) >> lane & 1) << (flop.index() % 64);
        }
        code.iter_mut().zip(mask).for_each(|(word, mask)| *word &= mask);
        code
    }

    /// Sets all lanes to this state.
    pub(super) fn set_code(&mut self, code: &[u64]) {
        for flop in self.logic.flops.ids() {
            self.sim.set_flop(flop, if bit(code, flop) == 1 { !0 } else { 0 });
        }
    }

    /// Sets each lane to its own state (at most 64 lanes).
    pub(super) fn set_codes(&mut self, codes: &[&[u64]]) {
        for flop in self.logic.flops.ids() {
            let lanes = codes.iter().enumerate();
            let word = lanes.fold(0, |word, (lane, code)| word | bit(code, flop) << lane);
            self.sim.set_flop(flop, word);
        }
    }

    /// Runs one reaction with a row for each lane (at most 64).
    ///
    /// # Errors
    /// A lane whose reaction does not end (`busy` stays 1).
    pub(super) fn react(&mut self, net: &Net, rows: &[InputRow]) -> Result<(), usize> {
        let mut words = vec![0_u64; self.logic.inputs.len()];
        for (lane, row) in rows.iter().enumerate() {
            for (pin, value) in self.binding.pin_bits(net, row) {
                words[pin.index()] |= u64::from(value) << lane;
            }
        }
        for (pin, _) in self.logic.inputs.iter() {
            self.sim.set_input(pin, words[pin.index()]);
        }
        self.sample(true);
        self.sim.clock();
        if let Some(busy) = self.binding.busy {
            self.wait(net, busy, rows.len())?;
        }
        self.sample(false);
        Ok(())
    }

    /// Clocks while busy, without new events or ticks. A lane that has ended keeps its state.
    fn wait(&mut self, net: &Net, busy: PinOutputId, n_lanes: usize) -> Result<(), usize> {
        let used = if n_lanes >= 64 { !0 } else { (1_u64 << n_lanes) - 1 };
        for pin in &self.binding.ticks {
            self.sim.set_input(*pin, 0);
        }
        for (pin, input, _) in &self.binding.inputs {
            if net.inputs[*input].kind.is_event() {
                self.sim.set_input(*pin, 0);
            }
        }
        let mut clocks = 1;
        loop {
            let running = self.sim.output(busy) & used;
            if running == 0 {
                return Ok(());
            }
            if clocks >= self.patience {
                return Err(running.trailing_zeros() as usize);
            }
            clocks += 1;
            let before: Vec<u64> = self.logic.flops.ids().map(|flop| self.sim.flop(flop)).collect();
            self.sim.clock();
            for flop in self.logic.flops.ids() {
                let value = self.sim.flop(flop) & running | before[flop.index()] & !running;
                self.sim.set_flop(flop, value);
            }
        }
    }

    /// The difference for a lane whose reaction does not end.
    pub(super) fn still_busy(number: usize) -> Difference {
        Difference {
            row: number,
            column: "busy".to_owned(),
            left: "0".to_owned(),
            right: "1".to_owned(),
        }
    }

    fn sample(&mut self, want_mealy: bool) {
        for (at, compared) in self.binding.compared.iter().enumerate() {
            let word = match compared.shown {
                Shown::Pin { pin, mealy } if mealy == want_mealy => self.sim.output(pin),
                Shown::Flop { flop, inverted } if !want_mealy => {
                    self.sim.flop(flop) ^ if inverted { !0 } else { 0 }
                }
                Shown::Active(step) if !want_mealy => {
                    let bits = self.binding.active.get(&step).map_or(&[][..], Vec::as_slice);
                    bits.iter().fold(!0, |all, bit| {
                        all & match *bit {
                            Shown::Flop { flop, inverted } => {
                                self.sim.flop(flop) ^ if inverted { !0 } else { 0 }
                            }
                            Shown::Function { node } => self.sim.node(node),
                            Shown::Pin { .. } | Shown::Active(_) => 0,
                        }
                    })
                }
                Shown::Function { node } if !want_mealy => self.sim.node(node),
                _ => continue,
            };
            self.bits[at] = word;
        }
    }

    /// The first compared bit in which the lane differs from the net's row.
    pub(super) fn difference(&self, net: &Net, row: &Row, lane: usize) -> Option<&'a Compared> {
        let binding = self.binding;
        binding.compared.iter().enumerate().find_map(|(at, compared)| {
            let wanted = binding.wanted(net, row, compared)?;
            (wanted != (self.bits[at] >> lane & 1 == 1)).then_some(compared)
        })
    }

    /// For each of the first lanes, the first compared bit that differs from the net's row of that lane (at most 64 rows).
    ///
    /// The result is that of [`Lanes::difference`] for each lane, but the active steps of all rows are transposed once instead of searched for each bit.
    pub(super) fn differences(&self, net: &Net, rows: &[&Row]) -> Vec<Option<&'a Compared>> {
        let binding = self.binding;
        let mut active = vec![0_u64; net.steps.len()];
        let mut shows_steps = 0_u64;
        for (lane, row) in rows.iter().enumerate() {
            row.steps.iter().for_each(|step| active[step.index()] |= 1 << lane);
            shows_steps |= u64::from(!row.open.row && !row.open.next) << lane;
        }
        let mut found = vec![None; rows.len()];
        for (at, compared) in binding.compared.iter().enumerate() {
            let differs = if let What::Step(step) = compared.what {
                (active[step.index()] ^ self.bits[at]) & shows_steps
            } else {
                rows.iter().enumerate().fold(0, |differs, (lane, row)| {
                    let shown = self.bits[at] >> lane & 1 == 1;
                    let is_wrong =
                        binding.wanted(net, row, compared).is_some_and(|wanted| wanted != shown);
                    differs | u64::from(is_wrong) << lane
                })
            };
            if differs != 0 {
                for (lane, found) in found.iter_mut().enumerate() {
                    if differs >> lane & 1 == 1 && found.is_none() {
                        *found = Some(compared);
                    }
                }
            }
        }
        found
    }

    /// The difference as a cell of two traces.
    pub(super) fn report(
        &self,
        net: &Net,
        row: &Row,
        lane: usize,
        number: usize,
        differs: &Compared,
    ) -> Difference {
        let binding = self.binding;
        let mut circuit = |one: &Compared| {
            binding
                .compared
                .iter()
                .position(|other| other == one)
                .is_some_and(|at| self.bits[at] >> lane & 1 == 1)
        };
        let (left, right) = binding.texts(net, row, differs, &mut circuit);
        Difference { row: number, column: binding.column(net, self.logic, differs), left, right }
    }
}

/// The bit of a flip-flop in a code.
fn bit(code: &[u64], flop: FlopId) -> u64 {
    code[flop.index() / 64] >> (flop.index() % 64) & 1
}

/// The inputs that the circuit reads in a state: with the flip-flops fixed, those that can affect a D function or a pin.
struct Reads<'a> {
    net: &'a Net,
    logic: &'a Logic,
    values: Vec<Option<bool>>,
    is_needed: Vec<bool>,
    /// True for each node that affects a pin that is sampled after the clock edge.
    is_shown: Vec<bool>,
}

impl Reads<'_> {
    /// The inputs that the circuit reads in a state, and true if the tick matters.
    fn of(&mut self, code: &[u64]) -> (Inputs, bool) {
        self.with(&|flop| Some(bit(code, flop) == 1))
    }

    /// The inputs that matter in the clocks after the first, in any state of the circuit: none, if it stores the values that it took in the first
    /// clock. Events and the tick are 0 in those clocks, so they never matter.
    fn while_busy(&mut self, busy: PinOutputId) -> Inputs {
        let (read, _) = self.with_busy(busy, true);
        let mut held = Inputs::none(self.net);
        for (id, input) in self.net.inputs.iter() {
            if read.contains(id) && !input.kind.is_event() {
                held.insert(id);
            }
        }
        held
    }

    /// A mask of the flip-flops that matter when a reaction begins. Flip-flops that store values for the last reaction do not, because they are never
    /// read again.
    fn count_between_reactions(&mut self, busy: Option<PinOutputId>) -> Vec<u64> {
        let n_words = self.logic.flops.len().div_ceil(64);
        let Some(busy) = busy else { return vec![!0; n_words] };
        self.with_busy(busy, false);
        let mut mask = vec![0; n_words];
        for (id, node) in self.logic.nodes.iter() {
            if let Node::Flop(flop) = node
                && (self.is_needed[id.index()] || self.is_shown[id.index()])
            {
                mask[flop.index() / 64] |= 1 << (flop.index() % 64);
            }
        }
        mask
    }

    /// The inputs read in any state with this value of `busy`, if that pin shows a flip-flop; otherwise in any state.
    fn with_busy(&mut self, busy: PinOutputId, value: bool) -> (Inputs, bool) {
        let logic = self.logic;
        let flop_of = |node: NodeId| match &logic.nodes[node] {
            Node::Flop(flop) => Some(*flop),
            _ => None,
        };
        let shown = logic.outputs[busy].value;
        let known = match &logic.nodes[shown] {
            Node::Not(a) => flop_of(*a).map(|flop| (flop, !value)),
            _ => flop_of(shown).map(|flop| (flop, value)),
        };
        self.with(&|flop| known.filter(|(of_busy, _)| *of_busy == flop).map(|(_, value)| value))
    }

    /// The inputs read in any state with these values of the flip-flops (`None` if unknown).
    fn with(&mut self, flops: &dyn Fn(FlopId) -> Option<bool>) -> (Inputs, bool) {
        let logic = self.logic;
        for (id, node) in logic.nodes.iter() {
            let value = |a: &grafsynth_ir::logic::NodeId| self.values[a.index()];
            self.values[id.index()] = match node {
                Node::Const(constant) => Some(*constant),
                Node::Input(_) => None,
                Node::Flop(flop) => flops(*flop),
                Node::Not(a) => value(a).map(|a| !a),
                Node::And(all) if all.iter().any(|a| value(a) == Some(false)) => Some(false),
                Node::And(all) => all.iter().all(|a| value(a) == Some(true)).then_some(true),
                Node::Or(all) if all.iter().any(|a| value(a) == Some(true)) => Some(true),
                Node::Or(all) => all.iter().all(|a| value(a) == Some(false)).then_some(false),
                Node::Xor(a, b) => value(a).zip(value(b)).map(|(a, b)| a != b),
                Node::Mux(c, a, b) => match value(c) {
                    Some(true) => value(a),
                    Some(false) => value(b),
                    None => value(a).zip(value(b)).and_then(|(a, b)| (a == b).then_some(a)),
                },
            };
        }
        self.is_needed.fill(false);
        // A pin sampled after the clock edge sees the changed flip-flops, so its inputs matter in every state.
        let mut after = std::mem::take(&mut self.is_shown);
        after.fill(false);
        for output in logic.outputs.values() {
            if output.mealy || output.registered.is_some() {
                self.is_needed[output.value.index()] = true;
            } else {
                after[output.value.index()] = true;
            }
        }
        logic.flops.values().for_each(|flop| self.is_needed[flop.next.index()] = true);
        let mut inputs = Inputs::none(self.net);
        let mut tick = false;
        for (id, node) in logic.nodes.iter().rev() {
            let at = id.index();
            let live = self.is_needed[at] && self.values[at].is_none();
            if !live && !after[at] {
                continue;
            }
            if let Node::Input(pin) = node {
                match logic.inputs[*pin].role {
                    PinRole::Input(input, _) => inputs.insert(input),
                    PinRole::Tick => tick = true,
                    _ => {}
                }
            }
            let is_after = after[at];
            let chosen = match node {
                Node::Mux(c, a, b) => {
                    self.values[c.index()].map(|value| if value { *a } else { *b })
                }
                _ => None,
            };
            for_each_operand(node, |operand| {
                let is_passed = live && chosen.is_none_or(|chosen| chosen == operand);
                self.is_needed[operand.index()] |= is_passed;
                after[operand.index()] |= is_after;
            });
        }
        self.is_shown = after;
        (inputs, tick)
    }
}

/// The search through pairs of states: of the chart and of the circuit.
struct Search<'a> {
    /// The rows to try; `None` if the assumptions allow none.
    alphabet: Option<Alphabet<'a>>,
    relevance: Relevance<'a>,
    /// The inputs that the circuit reads in the clocks after the first.
    while_busy: Option<Inputs>,
    /// The rows for inputs that matter, and for time that does or does not.
    rows: IndexMap<(Inputs, bool), Rc<[InputRow]>>,
    pairs: IndexSet<(State, Vec<u64>)>,
    /// For each pair except the first: the pair before, and the row between.
    parents: Vec<Option<(u32, InputRow)>>,
}

impl Search<'_> {
    /// The rows of a state in which the circuit reads these inputs, and the tick; `None` if there are more than `limit`.
    fn rows(
        &mut self,
        state: &State,
        (read, tick): (Inputs, bool),
        limit: u64,
    ) -> Option<Rc<[InputRow]>> {
        let mut matter = self.relevance.inputs(state.situation());
        matter.add(&read);
        if let Some(read) = &self.while_busy {
            matter.add(read);
        }
        let time = tick || self.relevance.largest_dt(state.situation()).is_some();
        let key = (matter, time);
        if let Some(rows) = self.rows.get(&key) {
            return Some(rows.clone());
        }
        let rows = match &self.alphabet {
            None => Vec::new(),
            Some(alphabet) => alphabet.rows(&key.0, limit)?,
        };
        let dts = if time { 0..=1 } else { 1..=1 };
        let with_dt = |row: &InputRow| {
            let values = row.values.clone();
            dts.clone().map(move |dt| InputRow { dt, values: values.clone() })
        };
        let rows: Rc<[InputRow]> = rows.iter().flat_map(with_dt).collect();
        self.rows.insert(key, rows.clone());
        Some(rows)
    }

    /// The rows from reset to a pair, and the last one.
    fn way(&self, pair: usize, last: &InputRow) -> Vec<InputRow> {
        let mut rows = vec![last.clone()];
        let mut from = pair;
        while let Some(Some((before, row))) = self.parents.get(from) {
            rows.push(row.clone());
            from = *before as usize;
        }
        rows.reverse();
        rows
    }

    /// Adds a pair that a row leads to.
    fn add(&mut self, from: usize, row: &InputRow, pair: (State, Vec<u64>)) {
        let (to, is_new) = self.pairs.insert_full(pair);
        if is_new {
            debug_assert_eq!(to, self.parents.len());
            self.parents.push(Some((from as u32, row.clone())));
        }
    }
}

/// The proof by enumeration.
pub(super) fn equiv(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    limits: &Limits,
) -> Verdict {
    let mut lanes = Lanes::new(net, logic, binding);
    let mut simulator = Simulator::new(net);
    lanes.reset(net);
    if let Some(differs) = lanes.difference(net, simulator.row(), 0) {
        let difference = lanes.report(net, simulator.row(), 0, 0, differs);
        return Verdict::Refuted(Counterexample { stimulus: Stimulus::new(net), difference });
    }
    let alphabet = match Alphabet::of(net, true, limits.rows_per_state) {
        Ok(alphabet) => Some(alphabet),
        Err(NoAlphabet::Contradiction) => None,
        Err(NoAlphabet::TooMany(why)) => return Verdict::Open(Open::because(why)),
    };
    let mut reads = Reads {
        net,
        logic,
        values: vec![None; logic.nodes.len()],
        is_needed: vec![false; logic.nodes.len()],
        is_shown: vec![false; logic.nodes.len()],
    };
    let while_busy = binding.busy.map(|busy| reads.while_busy(busy));
    let mask = reads.count_between_reactions(binding.busy);
    let mut search = Search {
        alphabet,
        relevance: Relevance::of(net),
        while_busy,
        rows: IndexMap::new(),
        pairs: IndexSet::from([(simulator.state().clone(), lanes.code(0, &mask))]),
        parents: vec![None],
    };
    let open = |reason| Verdict::Open(Open::because(reason));
    let mut reactions: u64 = 0;
    let mut at = 0;
    while let Some((state, code)) = search.pairs.get_index(at).cloned() {
        let Some(rows) = search.rows(&state, reads.of(&code), limits.rows_per_state) else {
            return open(OpenReason::Rows { limit: limits.rows_per_state });
        };
        if reactions.saturating_add(rows.len() as u64) > limits.pairs {
            return open(OpenReason::Pairs { limit: limits.pairs, states: search.pairs.len() });
        }
        reactions += rows.len() as u64;
        for chunk in rows.chunks(64) {
            lanes.set_code(&code);
            let ended = lanes.react(net, chunk);
            for (lane, input) in chunk.iter().enumerate() {
                simulator.set_state(&state);
                let row = simulator.step(input);
                let differs = match ended {
                    // The other lanes were not sampled, so nothing is known about them.
                    Err(stuck) if stuck != lane => continue,
                    Err(_) => None,
                    Ok(()) => lanes.difference(net, row, lane),
                };
                if differs.is_some() || ended.is_err() {
                    let way = search.way(at, input);
                    let difference = match differs {
                        Some(differs) => lanes.report(net, row, lane, way.len(), differs),
                        None => Lanes::still_busy(way.len()),
                    };
                    let stimulus = Stimulus::of_rows(net, &way);
                    return Verdict::Refuted(Counterexample { stimulus, difference });
                }
                // If the next row is unspecified, there is nothing left to compare.
                if !row.open.next && !row.open.row {
                    search.add(at, input, (simulator.state().clone(), lanes.code(lane, &mask)));
                    if search.pairs.len() > limits.states {
                        return open(OpenReason::States { limit: limits.states });
                    }
                }
            }
        }
        at += 1;
    }
    let method = Method::Explicit { states: search.pairs.len() as u64, reactions };
    Verdict::Proved(Certificate { method, compared: binding.compared.len() })
}
