//! The proof by induction: a second encoding of the reaction as a circuit, and a solver that proves both circuits equal, function by function.
//!
//! Let S be the state of the net, in the coding of the flip-flops. If the circuit contains S(0) after power-up, and if for every S that satisfies the
//! invariants each D function gives the same bit as the reaction, then the circuit always contains the net's state; and if each pin's function also
//! agrees, so does the trace. The invariants are: the sequential components and caps of [`Facts`], validity of codes, timers of inactive steps at 0,
//! and the assumptions about inputs. All of them are true in every reachable state of the *net*, so they may be assumed.
//!
//! A circuit that stores steps as codes is proved through the code (see the module `codes`). If the net leaves a cell open, the cell is not checked;
//! if it leaves the next situation open, nothing that follows is checked.
//!
//! Both circuits are built in one graph that shares equal nodes, so most functions are equal before any solver is called; for the others, the solver gets only
//! the part of the graph that the query needs.
// If this encoding forgot a variant, a proof could be wrong.
#![warn(clippy::wildcard_enum_match_arm)]

mod ages;
mod aig;
mod asserts;
pub mod c;
mod calls;
mod codes;
mod cofactor;
mod composed;
mod division;
mod dominance;
mod ending;
mod forced;
mod forcing;
mod image;
mod invariant;
mod micro_steps;
mod number;
mod order;
mod pair;
mod pdr;
mod reach;
mod reaction;
mod repeat;
mod select;
mod shared;
mod state;
mod statechart;
mod stuck;
mod sweep;
mod values;

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::Valid;
use grafsynth_ir::expr::{CompareOp, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Decoded, Logic, Node, NodeId, PinRole};
use grafsynth_ir::net::{Driver, InputId, InputKind, Net, OpenCell, PropertyRole, StepId};
use grafsynth_ir::program::Origin;
use grafsynth_logic::shared_times;

use crate::equiv::binding::{Binding, Shown, What};
use crate::equiv::verdict::{Certificate, Method, Verdict};
use crate::exclusive::net_expr;
use crate::limits::Limits;
use crate::verdict::Open;
pub(crate) use asserts::never;
use asserts::over_state;
pub use division::{Apart, Joined, RoundFacts, joined};
pub use dominance::{Dominance, dominates};
pub use invariant::{Invariant, Refused, StateBit, Times, recheck, state_bits};
pub(crate) use pair::{Diagram, Equalities, Induction, Question, diagram, induction};
pub use pdr::{Directed, directed};
pub(crate) use reach::{Reached, reach};
pub(crate) use repeat::{Repeat, never_both, never_saturates, repeats};

use aig::{Aig, Lit};
use number::Number;
use pdr::{Register, Source};
use reach::legal_inputs;
use reaction::{Inputs, Maker, Reaction};
use shared::Shared;
use state::{Key, State, Value};

/// The maximum number of nodes of the graph that one query may contain.
const CONE: usize = 100_000;

/// An input that two nets share: a code counted from `lo`, of a value that is possible in both.
#[derive(Debug, Clone)]
struct SharedInput {
    bits: Vec<Lit>,
    lo: i64,
}

impl SharedInput {
    fn value(&self, aig: &mut Aig, ty: Type) -> Value {
        match ty {
            Type::Bool => {
                Value::Flag(self.bits.first().copied().unwrap_or(Lit::constant(self.lo != 0)))
            }
            Type::Int { .. } => Value::Number(Number::from_code(aig, &self.bits, self.lo)),
        }
    }
}

/// The functions of a net over free variables.
struct Model<'n> {
    maker: Maker<'n>,
    state: State,
    state_bits: BTreeMap<Key, Lit>,
    input_bits: BTreeMap<(u32, u32), Lit>,
    inputs: Inputs,
    /// The name of each variable that represents a state bit.
    name_of: BTreeMap<Lit, Key>,
    /// The order of variables in decision diagrams: Booleans, then words from the highest bit down, interleaved.
    bit_of: BTreeMap<Lit, u32>,
    /// Values of several bits (state and inputs), each with the condition that the bits are a valid code.
    valid: Vec<(Vec<Lit>, Lit)>,
    valid_of: BTreeMap<Lit, usize>,
    /// For each assumption, its variables and the condition that it excludes.
    forbidden: Vec<(Vec<Lit>, Lit)>,
    /// The number of assumptions that cannot be expressed over state and inputs. Without them, the proof also covers impossible states.
    n_passed_over: usize,
    events: Vec<Lit>,
    /// For each flip-flop of a code, the steps that it represents.
    decodes: BTreeMap<Lit, Vec<StepId>>,
    /// The names of the flip-flops of codes.
    code_bits: BTreeMap<Lit, String>,
    /// For pairs of steps whose relative age is not part of the state: a variable for it, the lower step first.
    orders: BTreeMap<(StepId, StepId), Lit>,
    /// For a statechart: the proved invariants of its states.
    structure: Option<Vec<Lit>>,
}

/// A value whose bits are new variables; `valid` receives the condition that they are a code of the type.
fn free_value(aig: &mut Aig, ty: Type, valid: &mut state::Codes) -> (Vec<Lit>, Value) {
    let bits: Vec<Lit> = (0..ty.bits()).map(|_| aig.variable()).collect();
    let Type::Int { lo, hi } = ty else {
        let flag = bits[0];
        return (bits, Value::Flag(flag));
    };
    let number = Number::from_code(aig, &bits, lo);
    let fits = Number::compare(aig, CompareOp::Le, &number, &Number::constant(hi));
    if fits != Lit::TRUE {
        valid.push((bits.clone(), fits));
    }
    (bits, Value::Number(number))
}

/// The rank of each bit in its word: 0 for a word of one bit, otherwise the higher bits first.
fn bit_of<W: Ord>(words: Vec<(W, u32, Lit)>) -> BTreeMap<Lit, u32> {
    let mut width: BTreeMap<&W, u32> = BTreeMap::new();
    for (word, bit, _) in &words {
        let width = width.entry(word).or_default();
        *width = (*width).max(*bit);
    }
    let rank =
        |(word, bit, lit): &(W, u32, Lit)| (*lit, if width[word] == 0 { 0 } else { 64 - bit });
    words.iter().map(rank).gather()
}

impl<'n> Model<'n> {
    /// The model of a net; `depth` is a bound on the micro-steps of a reaction, if one is known.
    fn of(net: &'n Net, depth: Option<u32>, limits: &Limits) -> Result<Self, String> {
        Self::within(Aig::new(), net, depth, limits, &BTreeMap::new())
    }

    /// Like [`Model::of`], in a graph that already contains other functions, with shared inputs.
    fn within(
        aig: Aig,
        net: &'n Net,
        depth: Option<u32>,
        limits: &Limits,
        shared: &BTreeMap<InputId, SharedInput>,
    ) -> Result<Self, String> {
        let mut maker = Maker::new(net, depth, limits.circuit_nodes)?;
        maker.aig = aig;
        let (state, state_bits, mut valid) = maker.shape.clone().free(net, &mut maker.aig);
        let mut input_bits = BTreeMap::new();
        let mut values = Vec::new();
        let mut events = Vec::new();
        for (id, input) in net.inputs.iter() {
            let (bits, value) = match shared.get(&id) {
                Some(shared) => (shared.bits.clone(), shared.value(&mut maker.aig, input.ty)),
                None => free_value(&mut maker.aig, input.ty, &mut valid),
            };
            for (bit, lit) in bits.iter().enumerate() {
                input_bits.insert((id.index() as u32, bit as u32), *lit);
            }
            if let (Value::Flag(flag), InputKind::Event) = (&value, input.kind) {
                events.push(*flag);
            }
            values.push(value);
        }
        let tick = maker.aig.variable();
        let inputs = Inputs { values, tick, dt: None };
        let mut forbidden = Vec::new();
        let mut n_passed_over = 0;
        for property in
            net.properties.iter().filter(|property| property.role == PropertyRole::Assume)
        {
            match net_expr(&property.never) {
                None => n_passed_over += 1,
                Some(never) => {
                    let lit = maker.forbidden(&state, &inputs, &never);
                    let support = maker.aig.support(&[lit], CONE).unwrap_or_default();
                    forbidden.push((support, lit));
                }
            }
        }
        let words = state_bits
            .iter()
            .map(|((origin, element, bit), lit)| ((Some((*origin, *element)), 0), *bit, *lit));
        let words =
            words.chain(input_bits.iter().map(|((input, bit), lit)| ((None, *input), *bit, *lit)));
        let bit_of = bit_of(words.collect());
        let name_of = state_bits.iter().map(|(key, lit)| (*lit, *key)).gather();
        let valid_of = valid
            .iter()
            .enumerate()
            .flat_map(|(at, (bits, _))| bits.iter().map(move |bit| (*bit, at)))
            .gather();
        if !net.settings.events_exclusive {
            events.clear();
        }
        Ok(Model {
            maker,
            state,
            state_bits,
            input_bits,
            inputs,
            name_of,
            bit_of,
            valid,
            valid_of,
            forbidden,
            n_passed_over,
            events,
            decodes: BTreeMap::new(),
            code_bits: BTreeMap::new(),
            orders: BTreeMap::new(),
            structure: None,
        })
    }

    fn aig(&mut self) -> &mut Aig {
        &mut self.maker.aig
    }

    /// The assumptions about the variables of a query: literals that are true, and clauses.
    fn invariants(&self, facts: &Facts, support: &[Lit]) -> (Vec<Lit>, Vec<Vec<Lit>>) {
        self.invariants_with(facts, support, |_, steps, clauses| at_most_one(steps, clauses))
    }

    /// Like [`Model::invariants`]; `exclude` adds clauses such that no two of the steps of a component are active together.
    fn invariants_with(
        &self,
        facts: &Facts,
        support: &[Lit],
        mut exclude: impl FnMut(u32, &[Lit], &mut Vec<Vec<Lit>>),
    ) -> (Vec<Lit>, Vec<Vec<Lit>>) {
        let mut holds = Vec::new();
        let mut clauses = Vec::new();
        let mut codes: Vec<usize> =
            support.iter().filter_map(|lit| self.valid_of.get(lit).copied()).collect();
        codes.sort_unstable();
        codes.dedup();
        holds.extend(codes.into_iter().map(|at| self.valid[at].1));
        for (variables, never) in &self.forbidden {
            if variables.iter().any(|variable| support.contains(variable)) {
                holds.push(!*never);
            }
        }
        at_most_one(
            &self
                .events
                .iter()
                .copied()
                .filter(|event| support.contains(event))
                .collect::<Vec<_>>(),
            &mut clauses,
        );
        let mut members: BTreeMap<u32, Vec<Lit>> = BTreeMap::new();
        for step in self.steps_of(support) {
            let own = self.state_bits[&(Origin::Step(step), 0, 0)];
            if let Some(component) = facts.component_of.as_ref().and_then(|map| map[step]) {
                members.entry(component).or_default().push(own);
            }
            if let Some(parent) = self.maker.net.steps[step].parent {
                // An enclosed step is active only together with its enclosing step.
                let parent = self.state_bits[&(Origin::Step(parent), 0, 0)];
                clauses.push(vec![!own, parent]);
            }
        }
        if let Some(structure) = &self.structure {
            holds.extend(structure);
        }
        for lit in support {
            let name = self.name_of.get(lit);
            if let Some((Origin::Elapsed(step) | Origin::TaskIndex(step), _, _)) = name {
                // Timer and task index of an inactive step are 0.
                clauses.push(vec![!*lit, self.state_bits[&(Origin::Step(*step), 0, 0)]]);
            }
        }
        for (component, lits) in members {
            exclude(component, &lits, &mut clauses);
            let data = &facts.components[component as usize];
            if data.always && data.steps.len() == lits.len() {
                clauses.push(lits);
            }
        }
        self.order_of_ages(support, &mut clauses);
        (holds, clauses)
    }

    /// A point where two functions differ although the invariants are true, as the bits that are 1. The inner `None` means that they agree, the outer
    /// one that the solver reached its limit.
    fn difference(
        &mut self,
        shared: &mut Shared,
        (facts, limits): (&Facts, &Limits),
        a: Lit,
        b: Lit,
    ) -> Option<Option<Vec<Lit>>> {
        let differ = self.aig().xor(a, b);
        if differ == Lit::FALSE {
            return Some(None);
        }
        let support = self.maker.aig.support(&[a, b], CONE)?;
        if let Some(answer) = shared.satisfy(self, facts, differ, &support) {
            return Some(answer);
        }
        let (mut holds, mut clauses) = self.invariants(facts, &support);
        self.complete_order_of_ages(&support, &mut clauses);
        holds.push(differ);
        // Words are ordered bit by bit, so that arithmetic has small diagrams.
        let rank = |lit: Lit| self.bit_of.get(&lit).copied().unwrap_or(0);
        self.maker.aig.settle(&holds, &clauses, &rank, limits)
    }

    /// The active steps among some bits, and the number of other state bits that are 1, for a message.
    fn describe(&self, bits: &[Lit]) -> String {
        let mut steps = Vec::new();
        let mut n_others = 0;
        for (origin, _, _) in bits.iter().filter_map(|lit| self.name_of.get(lit)) {
            if let Origin::Step(step) = origin {
                steps.push(self.maker.net.steps[*step].name.text.clone());
            } else {
                n_others += 1;
            }
        }
        let set = bits.iter().filter_map(|lit| self.code_bits.get(lit));
        steps.extend(set.map(|name| format!("({name})")));
        match (steps.is_empty(), n_others) {
            (true, 0) => "any".to_owned(),
            (true, _) => format!("{n_others} bits set"),
            (false, _) => format!("active {}, {n_others} other bits set", steps.join(" ")),
        }
    }
}

fn known_depth(facts: &Facts) -> Option<u32> {
    facts.stable_depth.as_ref().map(|proved| proved.value)
}

fn at_most_one(lits: &[Lit], clauses: &mut Vec<Vec<Lit>>) {
    // Beyond a few hundred steps the pairs cost more than they help; omitting some only weakens the assumptions.
    for (at, a) in lits.iter().enumerate().take(512) {
        clauses.extend(lits[..at].iter().map(|b| vec![!*a, !*b]));
    }
}

/// The functions of all nodes of a circuit, over the given functions of its flip-flops and inputs.
fn import(aig: &mut Aig, logic: &Logic, flops: &[Lit], inputs: &[Lit]) -> Vec<Lit> {
    let mut lits: Vec<Lit> = Vec::with_capacity(logic.nodes.len());
    for node in logic.nodes.values() {
        let at = |id: &grafsynth_ir::logic::NodeId| lits[id.index()];
        let lit = match node {
            Node::Const(value) => Lit::constant(*value),
            Node::Input(pin) => inputs[pin.index()],
            Node::Flop(flop) => flops[flop.index()],
            Node::Not(a) => !at(a),
            Node::And(all) => aig.and_all(all.iter().map(at)),
            Node::Or(all) => aig.or_all(all.iter().map(at)),
            Node::Xor(a, b) => aig.xor(at(a), at(b)),
            Node::Mux(c, a, b) => aig.ite(at(c), at(a), at(b)),
        };
        lits.push(lit);
    }
    lits
}

/// The proof of one circuit by induction.
pub(crate) fn equiv(
    net: &Valid<Net>,
    facts: &Facts,
    logic: &Logic,
    binding: &Binding,
    limits: &Limits,
) -> Verdict {
    match prove(net, facts, logic, binding, limits) {
        Ok(certificate) => Verdict::Proved(certificate),
        Err(why) => Verdict::Open(Open::because(why)),
    }
}

fn prove(
    net: &Valid<Net>,
    facts: &Facts,
    logic: &Logic,
    binding: &Binding,
    limits: &Limits,
) -> Result<Certificate, String> {
    let has_arguments = net.outputs.values().any(
        |output| matches!(&output.driver, Driver::Extern { params, .. } if !params.is_empty()),
    );
    if has_arguments {
        return Err("calls with arguments are not covered by the symbolic proof".to_owned());
    }
    if net.settings.policy.is_statechart() {
        return composed::prove(net, logic, binding, limits);
    }
    if binding.busy.is_some() {
        return Err("a circuit that takes several clocks for a reaction is not covered by the symbolic proof".to_owned());
    }
    // The circuit's claims about its own states need a proof too, so they are omitted if the steps alone are sufficient.
    let mut logic = logic.clone();
    let idle = shared_times::idle(&mut logic);
    let logic = &logic;
    let is_coded = logic.decoded.iter().any(is_step);
    let plain = if is_coded {
        Err(String::new())
    } else {
        prove_tied(net, facts, logic, binding, limits, &idle)
    };
    match plain {
        Err(_) if is_coded || !logic.unreachable.is_empty() => {
            let claims: Vec<NodeId> = idle.iter().chain(&logic.unreachable).copied().collect();
            prove_tied(net, facts, logic, binding, limits, &claims)
        }
        settled => settled,
    }
}

fn is_step(bit: &Decoded) -> bool {
    matches!(bit.holds.origin, Origin::Step(_))
}

/// The induction. One of its invariants is that the states in which one of the `claims` is true are unreachable.
fn prove_tied(
    net: &Valid<Net>,
    facts: &Facts,
    logic: &Logic,
    binding: &Binding,
    limits: &Limits,
    claims: &[NodeId],
) -> Result<Certificate, String> {
    let mut model = Model::of(net, known_depth(facts), limits)?;
    let reset = model.maker.reset()?;
    let reset_bits = {
        let shape = model.maker.shape.clone();
        shape.bits(net, model.aig(), &reset.state)
    };
    let coded = model.tie(logic, claims)?;
    let (state, inputs) = (model.state.clone(), model.inputs.clone());
    let open = OpenCells::of(&mut model, &state, &inputs);
    let Reaction { state: next, outputs, fault } = model.maker.reaction(&state, &inputs)?;
    let next_bits = {
        let shape = model.maker.shape.clone();
        shape.bits(net, model.aig(), &next)
    };
    let after = model.maker.outputs_of_state(&state, &inputs);

    // The circuit over the same variables.
    let mut pins = vec![Lit::FALSE; logic.inputs.len()];
    for (pin, input, bit) in &binding.inputs {
        pins[pin.index()] =
            model.input_bits.get(&(input.index() as u32, *bit)).copied().unwrap_or(Lit::FALSE);
    }
    for pin in &binding.ticks {
        pins[pin.index()] = inputs.tick;
    }
    debug_assert!(logic.inputs.values().all(|pin| pin.role != PinRole::Unknown));
    let nodes = import(model.aig(), logic, &coded.flops, &pins);

    let next: Vec<Lit> = logic.flops.values().map(|flop| nodes[flop.next.index()]).collect();
    let moved = Moved {
        logic,
        coded: &coded,
        nodes: &nodes,
        pins: &pins,
        next: &next,
        next_bits: &next_bits,
        reset_bits: &reset_bits,
        open: &open,
        fault,
    };
    let mut proof = Proof {
        model,
        shared: Shared::new(),
        facts,
        limits,
        same: 0,
        solved: 0,
        compared: 0,
        can_search: net.unspecified.is_empty(),
        apart: Vec::new(),
        first_apart: None,
    };
    proof.flops(&moved)?;
    let is_needed = !coded.keys.is_empty() || !claims.is_empty();
    let mut composed = is_needed.then(|| proof.composed(&moved));
    if let Some(composed) = &composed {
        proof.decoded(&moved, claims, composed)?;
    }
    proof.pins(&moved, binding, &outputs, &after, &mut composed)?;
    let clauses = if proof.apart.is_empty() { 0 } else { proof.exclude(&moved)? };
    let method = Method::Symbolic { same: proof.same, solved: proof.solved, clauses };
    Ok(Certificate { method, compared: proof.compared })
}

/// The circuit and the net after a reaction, as functions of the state before it.
struct Moved<'m> {
    logic: &'m Logic,
    coded: &'m codes::Coded,
    /// The nodes before the clock.
    nodes: &'m [Lit],
    pins: &'m [Lit],
    /// The next value of each flip-flop.
    next: &'m [Lit],
    next_bits: &'m BTreeMap<Key, Lit>,
    reset_bits: &'m BTreeMap<Key, Lit>,
    open: &'m OpenCells,
    /// The fault flag of the reaction.
    fault: Lit,
}

/// The conditions under which the net leaves cells open, as functions of the state before a reaction and its inputs (semantics §3.6).
struct OpenCells {
    /// The condition under which the next situation, and everything that follows from it, is open.
    next: Lit,
    /// For each output, the condition under which it is open.
    outputs: Vec<Lit>,
}

impl OpenCells {
    fn of(model: &mut Model<'_>, state: &State, inputs: &Inputs) -> Self {
        let net = model.maker.net;
        let mut open = OpenCells { next: Lit::FALSE, outputs: vec![Lit::FALSE; net.outputs.len()] };
        for cell in &net.unspecified {
            let when = model.maker.forbidden(state, inputs, &cell.when);
            let place = match cell.what {
                OpenCell::Next => &mut open.next,
                OpenCell::Output(output) => &mut open.outputs[output.index()],
            };
            *place = model.maker.aig.or(*place, when);
        }
        open
    }
}

struct Proof<'n, 'f> {
    model: Model<'n>,
    shared: Shared,
    facts: &'f Facts,
    limits: &'f Limits,
    same: usize,
    solved: usize,
    /// The number of compared bits.
    compared: usize,
    /// True if differences in states that no invariant excludes are left to a search for a stronger invariant.
    can_search: bool,
    /// These differences.
    apart: Vec<Lit>,
    /// The message about the first of them.
    first_apart: Option<String>,
}

impl Proof<'_, '_> {
    /// The circuit after the clock, as functions of the state before it.
    fn composed(&mut self, moved: &Moved<'_>) -> Vec<Lit> {
        import(self.model.aig(), moved.logic, moved.next, moved.pins)
    }

    /// The flip-flops that store a bit of the state or the fault flag.
    fn flops(&mut self, moved: &Moved<'_>) -> Result<(), String> {
        let Moved { logic, nodes, next_bits, reset_bits, open, fault, .. } = moved;
        for flop in logic.flops.values() {
            let Some(holds) = flop.holds else { continue };
            let key = (holds.origin, holds.element, holds.bit);
            let is_fault = holds.origin == Origin::Fault;
            let Some(wanted) = next_bits.get(&key).copied().or(is_fault.then_some(*fault)) else {
                continue;
            };
            self.compared += 1;
            let first = if is_fault {
                Some(false)
            } else {
                reset_bits.get(&key).and_then(|lit| lit.as_constant())
            };
            if first.is_some_and(|first| first != (flop.init != holds.inverted)) {
                return Err(format!(
                    "flip-flop `{}` has a different value after power-up",
                    flop.name
                ));
            }
            let given = nodes[flop.next.index()].negate_if(holds.inverted);
            self.show(wanted, given, open.next, &format!("flip-flop `{}`", flop.name))?;
        }
        Ok(())
    }

    /// The bits of the state that flip-flops encode, and the unused codes.
    fn decoded(
        &mut self,
        moved: &Moved<'_>,
        claims: &[NodeId],
        composed: &[Lit],
    ) -> Result<(), String> {
        let Moved { logic, coded, pins, next_bits, reset_bits, open, .. } = moved;
        let woken: Vec<Lit> = logic.flops.values().map(|flop| Lit::constant(flop.init)).collect();
        let woken = import(self.model.aig(), logic, &woken, pins);
        for (bit, key) in logic.decoded.iter().zip(&coded.keys) {
            let what = if is_step(bit) {
                format!("step `{}`, by its code,", bit.name)
            } else {
                format!("time `{}`, by its shared timer,", bit.name)
            };
            self.compared += 1;
            let first = reset_bits.get(key).copied().unwrap_or(Lit::FALSE);
            if woken[bit.node.index()] != first {
                return Err(format!("{what} has a different value after power-up"));
            }
            let wanted = next_bits.get(key).copied().unwrap_or(Lit::FALSE);
            self.show(wanted, composed[bit.node.index()], open.next, &what)?;
        }
        for node in claims {
            if woken[node.index()] != Lit::FALSE {
                return Err("the power-up code encodes no step".to_owned());
            }
            let what = "the transition into an unused code";
            self.show(Lit::FALSE, composed[node.index()], open.next, what)?;
        }
        Ok(())
    }

    /// The output pins. `after` are the outputs of the situation, as functions of the state alone.
    fn pins(
        &mut self,
        moved: &Moved<'_>,
        binding: &Binding,
        outputs: &[Vec<Lit>],
        after: &[Option<Vec<Lit>>],
        composed: &mut Option<Vec<Lit>>,
    ) -> Result<(), String> {
        let Moved { logic, nodes, open, fault, .. } = moved;
        for one in &binding.compared {
            let Shown::Pin { pin, mealy } = one.shown else { continue };
            let output = &logic.outputs[pin];
            self.compared += 1;
            let what = format!("output pin `{}`", output.name);
            let (before_clock, after_clock, own) = match one.what {
                What::Output(id) => {
                    let bit = one.bit as usize;
                    let code = |code: &[Lit]| code.get(bit).copied().unwrap_or(Lit::FALSE);
                    let after = after[id.index()].as_ref().map(|all| code(all));
                    (code(&outputs[id.index()]), after, open.outputs[id.index()])
                }
                What::Fault => (*fault, None, Lit::FALSE),
                What::Step(_) | What::Var(..) => continue,
            };
            if mealy {
                self.show(before_clock, nodes[output.value.index()], own, &what)?;
                continue;
            }
            let own = self.model.aig().or_all([own, open.next]);
            if output.registered.is_some() {
                self.show(before_clock, nodes[output.value.index()], own, &what)?;
                continue;
            }
            // The pin is a function of the new state. This is proved for any state if possible, otherwise for the states after a reaction.
            if let Some(wanted) = after_clock
                && self.try_show(wanted, nodes[output.value.index()])
            {
                continue;
            }
            let composed = composed.get_or_insert_with(|| self.composed(moved));
            self.show(before_clock, composed[output.value.index()], own, &what)?;
        }
        Ok(())
    }

    /// Proves by property-directed reachability that the functions that differ in some states are equal in every reachable one. Returns the number of clauses.
    ///
    /// Up to the first reaction in which they differ, circuit and net are in the same state. So the states that the circuit reaches with its own functions,
    /// together with what only the net stores, are the states of both.
    fn exclude(&mut self, moved: &Moved<'_>) -> Result<usize, String> {
        let first_apart = self.first_apart.take().unwrap_or_default();
        let Moved { logic, coded, next, next_bits, reset_bits, .. } = moved;
        let mut registers: BTreeMap<Lit, Register> = BTreeMap::new();
        for ((flop, lit), next) in logic.flops.values().zip(&coded.flops).zip(next.iter()) {
            let inverted = lit.is_negated();
            let lit = lit.negate_if(inverted);
            let (next, first) = (next.negate_if(inverted), flop.init != inverted);
            registers.entry(lit).or_insert(Register { lit, next, first });
        }
        for (key, next) in *next_bits {
            let lit = self.model.state_bits[key];
            if self.model.name_of.contains_key(&lit) && !registers.contains_key(&lit) {
                let Some(first) = reset_bits.get(key).and_then(|lit| lit.as_constant()) else {
                    return Err(first_apart);
                };
                registers.insert(lit, Register { lit, next: *next, first });
            }
        }
        let legal = legal_inputs(&mut self.model);
        let bad = self.model.aig().or_all(self.apart.clone());
        let lemmas = pdr::lemmas(&mut self.model, self.facts);
        let source = Source { registers: registers.into_values().collect(), legal, bad, lemmas };
        pdr::is_never_bad(&self.model.maker.aig, &source, self.limits).ok_or(first_apart)
    }

    fn try_show(&mut self, wanted: Lit, given: Lit) -> bool {
        if wanted == given {
            self.same += 1;
            return true;
        }
        let known = (self.facts, self.limits);
        let agrees = self.model.difference(&mut self.shared, known, wanted, given) == Some(None);
        self.solved += usize::from(agrees);
        agrees
    }

    /// Proves that `wanted` and `given` are equal whenever the net does not leave them open.
    fn show(&mut self, wanted: Lit, given: Lit, open: Lit, what: &str) -> Result<(), String> {
        if wanted == given {
            self.same += 1;
            return Ok(());
        }
        let wanted = self.model.aig().and(wanted, !open);
        let given = self.model.aig().and(given, !open);
        let known = (self.facts, self.limits);
        match self.model.difference(&mut self.shared, known, wanted, given) {
            Some(None) => {
                self.solved += 1;
                Ok(())
            }
            Some(Some(bits)) => {
                let place = self.model.describe(&bits);
                let message = format!(
                    "{what} differs from the net in a state that no invariant excludes: {place}"
                );
                if !self.can_search {
                    return Err(message);
                }
                let differ = self.model.aig().xor(wanted, given);
                self.apart.push(differ);
                self.first_apart.get_or_insert(message);
                Ok(())
            }
            None => Err(format!("{what}: the solver reached its limit")),
        }
    }
}

#[cfg(test)]
#[allow(clippy::wildcard_enum_match_arm, reason = "random nets may have any features")]
mod tests;
