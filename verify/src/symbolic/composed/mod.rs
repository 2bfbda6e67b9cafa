//! Circuits of statecharts: the whole reaction of the circuit equals the whole reaction of the net.
//!
//! The evolution of the net is unrolled check by check. A circuit that takes several clocks for a reaction (`busy`) is unrolled clock by clock, without events
//! and ticks after the first clock, until it is not busy. Both are functions of the flip-flops and inputs before the reaction. As in the module `codes`, the
//! state of the net is read from the flip-flops, and the proof is an induction: in every state that satisfies the invariants, both reactions lead to the same
//! state of the net and the same outputs. The equality of such large functions is proved bottom-up (module `sweep`).
//!
//! Flip-flops whose meaning is unknown may contain anything, except those that have the same value after each reaction in all random runs. The induction also
//! proves that they always have this value. The same runs give the required number of checks and clocks, which is then proved.
#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "a piece without a case of its own must be stored as it is; a forgotten case only prevents a proof"
)]

mod reading;

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Valid;
use grafsynth_ir::logic::{FlopId, Logic, NodeId};
use grafsynth_ir::net::{InputId, InputKind, Net, PropertyRole};
use grafsynth_ir::program::Origin;
use grafsynth_logic::shared_times;
use grafsynth_sim::Random;

use super::aig::{Lit, word_of};
use super::reaction::Reaction;
use super::state::{Key, State};
use super::sweep::{Answer, Sweep};
use super::{Model, at_most_one, import};
use crate::equiv::binding::{Binding, Shown, What};
use crate::equiv::verdict::{Certificate, Method};
use crate::exclusive::net_expr;
use crate::limits::Limits;
use reading::{Reading, is_own};

/// The numbers of checks, and of clocks of a circuit with `busy`, that are tried.
const DEPTHS: [u32; 3] = [8, 16, 32];
/// The maximum size of the graph of both reactions.
const MAX_NODES: usize = 300_000;
/// The number of reactions in each random run; 64 runs are made at once.
const ROUNDS: usize = 64;
/// The maximum number of attempts with fewer constant flip-flops.
const ATTEMPTS: usize = 40;
/// The first claims: the numbers of checks and clocks are sufficient.
const N_COUNTS: usize = 2;

/// A statement of the induction: two functions are equal.
struct Claim {
    wanted: Lit,
    given: Lit,
    what: String,
    /// The value that the claim proves to be constant.
    constant: Option<Fixed>,
}

impl Claim {
    fn never(given: Lit, what: String) -> Claim {
        Claim { wanted: Lit::FALSE, given, what, constant: None }
    }
}

/// A value that may be the same after each reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fixed {
    /// A flip-flop without a known meaning.
    Flop(FlopId),
    /// A piece of the net's state that the circuit does not store.
    Piece(Key),
}

/// The reason why an attempt ended.
enum Failed {
    /// More checks or clocks are necessary.
    Deeper,
    /// These values are not constant.
    NotConstant(Vec<Fixed>),
    Open(String),
}

impl From<String> for Failed {
    fn from(why: String) -> Self {
        Failed::Open(why)
    }
}

/// Proves the circuit of a statechart.
pub(super) fn prove(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    limits: &Limits,
) -> Result<Certificate, String> {
    super::reaction::refuse_open_cells(net)?;
    let mut model = Model::of(net, Some(1), limits)?;
    model.prove_structure(limits)?;
    let pieces: BTreeSet<Key> = model.state_bits.into_keys().gather();
    let registered = logic.outputs.values().any(|output| output.registered.is_some());
    if binding.busy.is_some() && registered {
        return Err("registered outputs of a circuit with `busy` are not covered".to_owned());
    }
    let mut logic = logic.clone();
    let idle = shared_times::idle(&mut logic);
    let logic = &logic;
    let known = Reading::known(net, logic, binding, &pieces)?;
    // The values that are known not to be constant; every other value that is not stored is assumed to be constant until it differs.
    let mut varies: BTreeSet<Fixed> = known.into_iter().map(Fixed::Flop).gather();
    let mut depths = DEPTHS.into_iter();
    let mut depth = depths.next();
    for _ in 0..ATTEMPTS {
        let Some(unrolled) = depth else { break };
        match attempt(net, (logic, &idle), binding, limits, unrolled, &varies) {
            Ok(certificate) => return Ok(certificate),
            Err(Failed::Deeper) => depth = depths.next(),
            Err(Failed::NotConstant(fixed)) => varies.extend(fixed),
            Err(Failed::Open(why)) => return Err(why),
        }
    }
    match depth {
        None => Err(format!("a reaction may take more than {} checks or clocks", DEPTHS[2])),
        Some(_) => Err("the constant flip-flops of the circuit were not found".to_owned()),
    }
}

/// One attempt; the circuit comes with the nodes that are true if a shared timer runs for no step.
fn attempt(
    net: &Valid<Net>,
    (logic, idle): (&Logic, &[NodeId]),
    binding: &Binding,
    limits: &Limits,
    depth: u32,
    varies: &BTreeSet<Fixed>,
) -> Result<Certificate, Failed> {
    let limits = &Limits { circuit_nodes: limits.circuit_nodes.min(MAX_NODES), ..limits.clone() };
    let mut both = Both::new(net, (logic, idle), binding, limits, depth, varies)?;
    let assumed = both.assumed();
    let (state, inputs) = (both.state.clone(), both.model.inputs.clone());
    let reaction = both.model.maker.reaction(&state, &inputs)?;
    let overruns = both.model.maker.overruns();
    let moved = both.circuit(depth)?;
    let counts = [(overruns, "the number of checks"), (moved.busy, "the number of clocks")];
    let mut claims: Vec<Claim> =
        counts.into_iter().map(|(given, what)| Claim::never(given, what.to_owned())).collect();
    both.claims_of_state(&reaction.state, &moved, &mut claims)?;
    both.claims_of_pins(&reaction, &moved, &mut claims);
    both.settle(&moved.flops, &assumed, &claims, limits)
}

/// The circuit after a reaction, as functions of the state and inputs before it.
struct Moved {
    flops: Vec<Lit>,
    nodes: Vec<Lit>,
    /// True if the reaction needs more clocks.
    busy: Lit,
}

/// Net and circuit over the same flip-flops and inputs.
struct Both<'a> {
    net: &'a Net,
    logic: &'a Logic,
    binding: &'a Binding,
    model: Model<'a>,
    reading: Reading<'a>,
    reset: Reaction,
    reset_bits: BTreeMap<Key, Lit>,
    flops: Vec<Lit>,
    constants: Vec<FlopId>,
    /// The nodes that are true if a shared timer is not 0 although none of its steps is active.
    idle: &'a [NodeId],
    pins: Vec<Lit>,
    nodes: Vec<Lit>,
    /// The state of the net, as read from the flip-flops.
    state: State,
}

impl<'a> Both<'a> {
    fn new(
        net: &'a Valid<Net>,
        (logic, idle): (&'a Logic, &'a [NodeId]),
        binding: &'a Binding,
        limits: &Limits,
        depth: u32,
        varies: &BTreeSet<Fixed>,
    ) -> Result<Self, Failed> {
        let mut model = Model::of(net, Some(depth), limits)?;
        if binding.busy.is_some() && !model.maker.shape.chart.kept.is_empty() {
            let why = "a circuit with `busy` is not covered if its chart can end".to_owned();
            return Err(Failed::Open(why));
        }
        let reset = model.maker.reset()?;
        let reset_bits = model.maker.shape.clone().bits(net, model.aig(), &reset.state);
        if reset_bits.values().any(|lit| lit.as_constant().is_none()) {
            return Err(Failed::Open("the reset does not lead to a single state".to_owned()));
        }
        let pieces: BTreeSet<Key> = reset_bits.keys().copied().gather();
        let mut reading = Reading { net, logic, flops: BTreeMap::new(), others: BTreeMap::new() };
        let (mut flops, mut constants) = (Vec::new(), Vec::new());
        for (id, flop) in logic.flops.iter() {
            if !varies.contains(&Fixed::Flop(id)) {
                constants.push(id);
                flops.push(Lit::constant(flop.init));
                continue;
            }
            flops.push(model.aig().variable());
            if let Some(holds) = flop.holds {
                let key = (holds.origin, holds.element, holds.bit);
                if is_own(key, &pieces, binding) {
                    reading.flops.insert(key, (id, holds.inverted));
                }
            }
        }
        for (key, first) in reset_bits
            .iter()
            .filter(|(key, _)| !reading.is_stored(**key))
            .map(|(key, first)| (*key, *first))
            .collect::<Vec<_>>()
        {
            let varies = varies.contains(&Fixed::Piece(key));
            let lit = if varies { model.aig().variable() } else { first };
            reading.others.insert(key, lit);
        }
        let mut pins = vec![Lit::FALSE; logic.inputs.len()];
        for (pin, input, bit) in &binding.inputs {
            let own = model.input_bits.get(&(input.index() as u32, *bit));
            pins[pin.index()] = own.copied().unwrap_or(Lit::FALSE);
        }
        for pin in &binding.ticks {
            pins[pin.index()] = model.inputs.tick;
        }
        let nodes = import(model.aig(), logic, &flops, &pins);
        let (state, _) = reading.state(&mut model, &flops, &nodes);
        Ok(Both {
            net,
            logic,
            binding,
            model,
            reading,
            reset,
            reset_bits,
            flops,
            constants,
            idle,
            pins,
            nodes,
            state,
        })
    }

    /// The assumptions: the invariants of the net's states, valid codes, and what the environment guarantees.
    fn assumed(&mut self) -> Vec<Lit> {
        let state = self.state.clone();
        // The registers of a region record nothing while the state of the history is active.
        let mut recorded = state.clone();
        for ((history, step), lit) in &mut recorded.recorded {
            if self.reading.by_region(*history, *step, &self.flops).is_some() {
                let owner = state.active[self.net.histories[*history].owner.index()];
                *lit = self.model.aig().and(*lit, !owner);
            }
        }
        let mut all = self.model.maker.structure(&recorded);
        all.extend(self.model.maker.shape.clone().valid(self.net, self.model.aig(), &state));
        all.extend(legal(&mut self.model, &state));
        all.extend(self.never().map(|(node, ..)| !self.nodes[node.index()]));
        all
    }

    /// The nodes that are never true between reactions, each with two messages for the case that it is true: after power-up, and after a reaction. That they are
    /// false is assumed before a reaction and proved after it.
    fn never(&self) -> impl Iterator<Item = (NodeId, &'static str, &'static str)> {
        const CODES: (&str, &str) =
            ("the power-up code encodes no step", "the transition into an unused code");
        const TIMERS: (&str, &str) = (
            "a shared timer is not 0 after power-up",
            "a shared timer while none of its steps is active",
        );
        let with =
            |texts: (&'static str, &'static str)| move |node: &NodeId| (*node, texts.0, texts.1);
        let codes = self.logic.unreachable.iter().map(with(CODES));
        codes.chain(self.idle.iter().map(with(TIMERS)))
    }

    /// The circuit after its reaction.
    fn circuit(&mut self, depth: u32) -> Result<Moved, Failed> {
        let logic = self.logic;
        let mut flops: Vec<Lit> =
            logic.flops.values().map(|flop| self.nodes[flop.next.index()]).collect();
        let mut pins = self.pins.clone();
        let Some(busy) = self.binding.busy.map(|pin| logic.outputs[pin].value) else {
            let nodes = import(self.model.aig(), logic, &flops, &pins);
            return Ok(Moved { flops, nodes, busy: Lit::FALSE });
        };
        let events = self.binding.inputs.iter();
        let events = events.filter(|(_, input, _)| self.net.inputs[*input].kind.is_event());
        for pin in events.map(|(pin, _, _)| pin).chain(&self.binding.ticks) {
            pins[pin.index()] = Lit::FALSE;
        }
        for _ in 0..=depth {
            let nodes = import(self.model.aig(), logic, &flops, &pins);
            let runs = nodes[busy.index()];
            if runs == Lit::FALSE {
                break;
            }
            flops = logic
                .flops
                .values()
                .zip(&flops)
                .map(|(flop, own)| self.model.aig().ite(runs, nodes[flop.next.index()], *own))
                .collect();
            if self.model.aig().len() > MAX_NODES {
                let why = format!("both reactions have more than {MAX_NODES} nodes");
                return Err(Failed::Open(why));
            }
        }
        let nodes = import(self.model.aig(), logic, &flops, &pins);
        let busy = nodes[busy.index()];
        Ok(Moved { flops, nodes, busy })
    }

    /// The state after the reaction is read from the flip-flops after it, and the state after reset from those after power-up.
    fn claims_of_state(
        &mut self,
        next: &State,
        moved: &Moved,
        claims: &mut Vec<Claim>,
    ) -> Result<(), Failed> {
        let (net, logic) = (self.net, self.logic);
        for flop in self.constants.clone() {
            let data = &logic.flops[flop];
            claims.push(Claim {
                wanted: Lit::constant(data.init),
                given: moved.flops[flop.index()],
                what: format!("flip-flop `{}`", data.name),
                constant: Some(Fixed::Flop(flop)),
            });
        }
        let woken: Vec<Lit> = logic.flops.values().map(|flop| Lit::constant(flop.init)).collect();
        let woken_nodes = self.power_up(&woken)?;
        let (_, first) = self.reading.state(&mut self.model, &woken, &woken_nodes);
        let (_, read) = self.reading.state(&mut self.model, &moved.flops, &moved.nodes);
        let next_bits = self.model.maker.shape.clone().bits(net, self.model.aig(), next);
        for (key, wanted) in next_bits {
            let what = describe(net, key);
            let other = self.reading.others.get(&key).copied();
            if other.is_some_and(|lit| lit.as_constant().is_none()) {
                continue;
            }
            let reset = self.reset.state.clone();
            if self.matters(key, &reset) != Lit::FALSE && first[&key] != self.reset_bits[&key] {
                return Err(Failed::Open(format!("{what} has a different value after power-up")));
            }
            let matters = self.matters(key, next);
            let wanted = self.model.aig().and(wanted, matters);
            let given = self.model.aig().and(read[&key], matters);
            let constant = other.map(|_| Fixed::Piece(key));
            claims.push(Claim { wanted, given, what, constant });
        }
        for (node, at_start, later) in self.never() {
            if woken_nodes[node.index()] != Lit::FALSE {
                return Err(Failed::Open(at_start.to_owned()));
            }
            claims.push(Claim::never(moved.nodes[node.index()], later.to_owned()));
        }
        Ok(())
    }

    /// The circuit after power-up with the inputs of row 0: its pins show row 0.
    fn power_up(&mut self, woken: &[Lit]) -> Result<Vec<Lit>, Failed> {
        let (net, logic) = (self.net, self.logic);
        let mut pins = vec![Lit::FALSE; self.pins.len()];
        for (pin, input, bit) in &self.binding.inputs {
            let ty = net.inputs[*input].ty;
            let code = ty.saturate(0).abs_diff(ty.bounds().0);
            pins[pin.index()] = Lit::constant(code >> bit & 1 == 1);
        }
        let nodes = import(self.model.aig(), logic, woken, &pins);
        for one in &self.binding.compared {
            let Shown::Pin { pin, mealy: false } = one.shown else { continue };
            let output = &logic.outputs[pin];
            let Some(wanted) = shown(&self.reset, one.what, one.bit) else { continue };
            let first = match output.registered {
                Some(first) => Lit::constant(first),
                None => nodes[output.value.index()],
            };
            if first != wanted {
                let why =
                    format!("output pin `{}` has a different value after power-up", output.name);
                return Err(Failed::Open(why));
            }
        }
        Ok(nodes)
    }

    fn claims_of_pins(&self, reaction: &Reaction, moved: &Moved, claims: &mut Vec<Claim>) {
        for one in &self.binding.compared {
            let Shown::Pin { pin, mealy } = one.shown else { continue };
            let output = &self.logic.outputs[pin];
            let Some(wanted) = shown(reaction, one.what, one.bit) else { continue };
            let is_before = mealy || output.registered.is_some();
            let from = if is_before { &self.nodes } else { &moved.nodes };
            let given = from[output.value.index()];
            let what = format!("output pin `{}`", output.name);
            claims.push(Claim { wanted, given, what, constant: None });
        }
    }

    /// The condition under which a piece of a state is read later: elements of queues below the length; records of the registers of a region while the state
    /// of the history is not active.
    fn matters(&mut self, key: Key, state: &State) -> Lit {
        match key.0 {
            Origin::Recorded(history, step)
                if self.reading.by_region(history, step, &self.flops).is_some() =>
            {
                !state.active[self.net.histories[history].owner.index()]
            }
            Origin::InternalQueue => used(&mut self.model, state.internal.as_ref(), key.1),
            Origin::ExternalQueue => used(&mut self.model, state.external.as_ref(), key.1),
            _ => Lit::TRUE,
        }
    }

    /// Runs both at random, and then proves the claims.
    fn settle(
        &self,
        moved: &[Lit],
        assumed: &[Lit],
        claims: &[Claim],
        limits: &Limits,
    ) -> Result<Certificate, Failed> {
        let reached = || "the solver reached its limit".to_owned();
        let patterns = self.patterns(moved, assumed, claims)?;
        let aig = &self.model.maker.aig;
        let mut sweep = Sweep::new(aig, assumed, &patterns, limits).ok_or_else(reached)?;
        let roots: Vec<Lit> = claims.iter().flat_map(|claim| [claim.wanted, claim.given]).collect();
        sweep.prepare(&roots).ok_or_else(reached)?;
        let mut varied = Vec::new();
        let (mut same, mut solved) = (0, 0);
        for (at, claim) in claims.iter().enumerate() {
            if claim.wanted == claim.given {
                same += 1;
                continue;
            }
            match (sweep.equal(claim.wanted, claim.given), claim.constant) {
                (Answer::Equal, _) => solved += 1,
                (Answer::Different(_), _) if at < N_COUNTS => return Err(Failed::Deeper),
                (Answer::Different(_), Some(fixed)) => varied.push(fixed),
                // The claims about the state assume that these flip-flops are constant.
                (Answer::Different(_), None) if !varied.is_empty() => break,
                (Answer::Different(example), None) => {
                    return Err(Failed::Open(self.differs(&claim.what, &example)));
                }
                (Answer::Unknown, _) => {
                    let why = reached();
                    return Err(Failed::Open(format!("{}: {why}", claim.what)));
                }
            }
        }
        if !varied.is_empty() {
            return Err(Failed::NotConstant(varied));
        }
        let method = Method::Symbolic { same, solved, clauses: 0 };
        Ok(Certificate { method, compared: claims.len() })
    }

    fn differs(&self, what: &str, example: &[Lit]) -> String {
        let flops = self.logic.flops.values().zip(&self.flops);
        let set = flops.filter(|(_, lit)| example.contains(lit));
        let set = set.map(|(flop, _)| flop.name.as_str()).collect::<Vec<_>>().join(" ");
        format!("{what} differs from the net in a state that no invariant excludes: {set} set")
    }

    /// The assignments of random runs of the circuit from power-up.
    fn patterns(
        &self,
        moved: &[Lit],
        assumed: &[Lit],
        claims: &[Claim],
    ) -> Result<Vec<BTreeMap<Lit, u64>>, Failed> {
        let aig = &self.model.maker.aig;
        let mut random = Random::new(1);
        let mut state: Vec<u64> =
            self.logic.flops.values().map(|flop| if flop.init { !0 } else { 0 }).collect();
        let mut all = Vec::new();
        for round in 0..ROUNDS {
            let mut pattern = self.row(&mut random, round);
            let stored = self.flops.iter().zip(&state);
            pattern.extend(
                stored
                    .filter(|(lit, _)| lit.as_constant().is_none())
                    .map(|(lit, word)| (*lit, *word)),
            );
            let Some(words) = aig.legal_words(&mut pattern, assumed) else { continue };
            differences(claims, &words)?;
            for (own, lit) in state.iter_mut().zip(moved) {
                *own = word_of(&words, *lit);
            }
            all.push(pattern);
            // Some runs start again.
            let restart = random.bits() & random.bits() & random.bits() & random.bits();
            for (own, flop) in state.iter_mut().zip(self.logic.flops.values()) {
                *own = *own & !restart | if flop.init { restart } else { 0 };
            }
        }
        Ok(all)
    }

    /// A random row for each run; every other row has many events.
    fn row(&self, random: &mut Random, round: usize) -> BTreeMap<Lit, u64> {
        let net = self.net;
        let mut pattern: BTreeMap<Lit, u64> = BTreeMap::new();
        // One half of the runs has no event in this row, so that time passes.
        let mut free = random.bits();
        for ((input, _), lit) in &self.model.input_bits {
            let kind = net.inputs[InputId::from_index(*input as usize)].kind;
            let word = match kind {
                InputKind::Event => {
                    let few = if round.is_multiple_of(2) { random.bits() } else { !0 };
                    let word = random.bits() & random.bits() & few & free;
                    if net.settings.events_exclusive {
                        free &= !word;
                    }
                    word
                }
                InputKind::InternalEvent => 0,
                InputKind::Pin | InputKind::Extern => random.bits(),
            };
            pattern.insert(*lit, word);
        }
        pattern.insert(self.model.inputs.tick, random.bits() | random.bits());
        pattern
    }
}

/// A bit that a pin shows after a reaction; `None` for what only flip-flops show.
fn shown(reaction: &Reaction, what: What, bit: u32) -> Option<Lit> {
    match what {
        What::Output(id) => {
            let code = &reaction.outputs[id.index()];
            Some(code.get(bit as usize).copied().unwrap_or(Lit::FALSE))
        }
        What::Fault => Some(reaction.fault),
        What::Step(_) | What::Var(..) => None,
    }
}

/// Whether the claims are true in all 64 runs.
fn differences(claims: &[Claim], words: &[u64]) -> Result<(), Failed> {
    let differ = |claim: &&Claim| word_of(words, claim.wanted) != word_of(words, claim.given);
    let (counts, others) = claims.split_at(N_COUNTS);
    if counts.iter().any(|claim| differ(&claim)) {
        return Err(Failed::Deeper);
    }
    let varied: Vec<Fixed> =
        others.iter().filter(differ).filter_map(|claim| claim.constant).collect();
    if !varied.is_empty() {
        return Err(Failed::NotConstant(varied));
    }
    match others.iter().find(differ) {
        Some(claim) => Err(Failed::Open(format!("{} differs from the net", claim.what))),
        None => Ok(()),
    }
}

/// The guarantees of the environment about a row, as conditions.
fn legal(model: &mut Model<'_>, state: &State) -> Vec<Lit> {
    let net = model.maker.net;
    let inputs = model.inputs.clone();
    let is_input: BTreeSet<Lit> = model.input_bits.values().copied().gather();
    let mut all: Vec<Lit> = model
        .valid
        .iter()
        .filter(|(bits, _)| bits.iter().all(|bit| is_input.contains(bit)))
        .map(|(_, holds)| *holds)
        .collect();
    for property in net.properties.iter().filter(|one| one.role == PropertyRole::Assume) {
        if let Some(never) = net_expr(&property.never) {
            let excluded = model.maker.forbidden(state, &inputs, &never);
            all.push(!excluded);
        }
    }
    let mut pairs = Vec::new();
    at_most_one(&model.events.clone(), &mut pairs);
    for pair in pairs {
        all.push(model.aig().or_all(pair));
    }
    all
}

/// True if the element of a queue is used.
fn used(model: &mut Model<'_>, queue: Option<&super::state::Queue>, element: u32) -> Lit {
    let Some(queue) = queue else { return Lit::FALSE };
    let place = super::number::Number::constant(i64::from(element));
    super::number::Number::compare(
        model.aig(),
        grafsynth_ir::expr::CompareOp::Gt,
        &queue.length,
        &place,
    )
}

fn describe(net: &Net, key: Key) -> String {
    match key.0 {
        Origin::Step(step) => format!("step `{}`", net.steps[step].name),
        Origin::Elapsed(step) | Origin::LastElapsed(step) => {
            format!("the time of `{}`", net.steps[step].name)
        }
        Origin::Var(var) => format!("variable `{}`", net.vars[var].name),
        Origin::Recorded(history, step) => {
            format!("`{}` in history `{}`", net.steps[step].name, net.histories[history].name)
        }
        Origin::SendTimer(slot) => format!("send `{}`", net.sends[slot].name),
        _ => "a bit of the state without a name".to_owned(),
    }
}
