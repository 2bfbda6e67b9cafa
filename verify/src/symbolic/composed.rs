//! Circuits of statecharts: the whole reaction of the circuit equals the whole reaction of the net.
//!
//! The evolution of the net is unrolled check by check. A circuit that takes several clocks for a reaction (`busy`) is unrolled clock by clock, without events
//! and ticks after the first clock, until it is not busy. Both are functions of the flip-flops and inputs before the reaction. As in the module `codes`, the
//! state of the net is read from the flip-flops, and the proof is an induction: in every state that satisfies the invariants, both reactions lead to the same
//! state of the net and the same outputs. The equality of such large functions is proved bottom-up (module `sweep`).
//!
//! Flip-flops whose meaning is unknown may contain anything, except those that have the same value after each reaction in all random runs. That they do is
//! one more statement of the induction. The number of checks and clocks that suffices is found by the same runs, and proved.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Valid;
use grafsynth_ir::logic::{FlopId, Logic};
use grafsynth_ir::net::{Enter, HistoryId, InputKind, Net, PropertyRole, StepId, StepKind};
use grafsynth_ir::program::Origin;
use grafsynth_sim::Random;

use super::aig::{Aig, Lit, word_of};
use super::reaction::Reaction;
use super::state::{Key, State};
use super::statechart::Tree;
use super::sweep::{Answer, Sweep};
use super::{Model, at_most_one, import};
use crate::equiv::binding::{Binding, Shown, What};
use crate::equiv::verdict::{Certificate, Method};
use crate::exclusive::net_expr;
use crate::limits::Limits;

/// The numbers of checks, and of clocks of a circuit with `busy`, that are tried.
const DEPTHS: [u32; 3] = [8, 16, 32];
/// The maximum size of the graph of both reactions.
const MAX_NODES: usize = 600_000;
/// The number of reactions in each random run; 64 runs are made at once.
const ROUNDS: usize = 64;
/// The maximum number of attempts with fewer constant flip-flops.
const ATTEMPTS: usize = 40;

/// A statement of the induction: two functions are equal.
struct Claim {
    wanted: Lit,
    given: Lit,
    what: String,
    /// What the claim shows to be constant.
    constant: Option<Fixed>,
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
    let pieces: BTreeSet<Key> = model.state_bits.into_keys().collect();
    let registered = logic.outputs.values().any(|output| output.registered.is_some());
    if binding.busy.is_some() && registered {
        return Err("registered outputs of a circuit with `busy` are not covered".to_owned());
    }
    let known = Reading::known(net, logic, binding, &pieces)?;
    // The values that are not constant; everything that is not stored is assumed to be until it differs.
    let mut varies: BTreeSet<Fixed> = known.into_iter().map(Fixed::Flop).collect();
    let mut depths = DEPTHS.into_iter();
    let mut depth = depths.next();
    for _ in 0..ATTEMPTS {
        let Some(unrolled) = depth else { break };
        match attempt(net, logic, binding, limits, unrolled, &varies) {
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

/// How the state of the net is read from the flip-flops of a circuit.
struct Reading<'a> {
    net: &'a Net,
    logic: &'a Logic,
    flops: BTreeMap<Key, (FlopId, bool)>,
    /// Pieces that the circuit does not store: their value after reset if they are constant, else a variable of their own.
    others: BTreeMap<Key, Lit>,
}

impl<'a> Reading<'a> {
    /// The flip-flops that store a piece of the net's state.
    fn known(
        net: &Net,
        logic: &Logic,
        binding: &Binding,
        pieces: &BTreeSet<Key>,
    ) -> Result<BTreeSet<FlopId>, String> {
        let mut keys: BTreeSet<Key> = BTreeSet::new();
        let mut known = BTreeSet::new();
        for (id, flop) in logic.flops.iter() {
            let Some(holds) = flop.holds else { continue };
            if is_own((holds.origin, holds.element, holds.bit), pieces, binding) {
                if !keys.insert((holds.origin, holds.element, holds.bit)) {
                    return Err(format!("flip-flop `{}` stores a bit again", flop.name));
                }
                known.insert(id);
            }
        }
        for (id, history) in net.histories.iter() {
            let is_stored = |case: &grafsynth_ir::net::HistoryCase| {
                keys.contains(&(Origin::Recorded(id, case.step), 0, 0))
            };
            let in_region = net.steps.iter().any(|(step, _)| {
                keys.contains(&(Origin::Region(step), 0, 0))
                    && Tree::is_inside(net, step, history.owner)
            });
            if in_region && !history.cases.iter().all(is_stored) && !is_left_before_entry(net, id) {
                return Err(format!(
                    "history `{}` is entered without leaving its state",
                    history.name
                ));
            }
        }
        // The states of a decoded step may be any function of flip-flops without a meaning of their own.
        if !logic.decoded.is_empty() {
            known = logic
                .flops
                .ids()
                .filter(|id| logic.flops[*id].holds.is_none())
                .chain(known)
                .collect();
        }
        Ok(known)
    }

    /// The value of a piece of state, given those of all flip-flops, of all nodes, and of the steps declared earlier.
    fn bit(&self, key: Key, flops: &[Lit], nodes: &[Lit], active: &[Lit], aig: &mut Aig) -> Lit {
        let stored = |key: &Key| {
            self.flops.get(key).map(|(flop, inverted)| flops[flop.index()].negate_if(*inverted))
        };
        if let Some(lit) = stored(&key) {
            return lit;
        }
        let decoded = self
            .logic
            .decoded
            .iter()
            .find(|bit| (bit.holds.origin, bit.holds.element, bit.holds.bit) == key);
        if let Some(decoded) = decoded {
            return nodes[decoded.node.index()];
        }
        match key.0 {
            Origin::Step(step) => {
                if let Some(parent) = self.net.steps[step].parent {
                    let around = active[parent.index()];
                    if let Some(own) = stored(&(Origin::Region(step), 0, 0)) {
                        return aig.and(own, around);
                    }
                    if self.net.steps[parent].kind == StepKind::Parallel {
                        return around;
                    }
                }
            }
            Origin::Recorded(history, step) => {
                if let Some(all) = self.by_region(history, step, flops) {
                    return aig.and_all(all);
                }
            }
            _ => {}
        }
        self.others.get(&key).copied().unwrap_or(Lit::FALSE)
    }

    /// True if the circuit stores the piece, or its value follows from what is stored.
    fn is_stored(&self, key: Key) -> bool {
        let has = |key: &Key| self.flops.contains_key(key);
        let is_decoded = self
            .logic
            .decoded
            .iter()
            .any(|bit| (bit.holds.origin, bit.holds.element, bit.holds.bit) == key);
        has(&key)
            || is_decoded
            || match key.0 {
                Origin::Step(step) => self.net.steps[step].parent.is_some_and(|parent| {
                    has(&(Origin::Region(step), 0, 0))
                        || self.net.steps[parent].kind == StepKind::Parallel
                }),
                Origin::Recorded(history, step) => {
                    let flops = vec![Lit::FALSE; self.logic.flops.len()];
                    self.by_region(history, step, &flops).is_some()
                }
                _ => false,
            }
    }

    /// The registers of the regions from a recorded state up to the owner of the history; `None` if the circuit has none there.
    fn by_region(&self, history: HistoryId, step: StepId, flops: &[Lit]) -> Option<Vec<Lit>> {
        let owner = self.net.histories[history].owner;
        let mut all = Vec::new();
        let mut at = step;
        while at != owner {
            if let Some((flop, inverted)) = self.flops.get(&(Origin::Region(at), 0, 0)) {
                all.push(flops[flop.index()].negate_if(*inverted));
            }
            at = self.net.steps[at].parent?;
        }
        (!all.is_empty()).then_some(all)
    }

    fn state(
        &self,
        model: &mut Model<'_>,
        flops: &[Lit],
        nodes: &[Lit],
    ) -> (State, BTreeMap<Key, Lit>) {
        let shape = model.maker.shape.clone();
        let mut active = vec![Lit::FALSE; self.net.steps.len()];
        let mut bits = BTreeMap::new();
        let state = shape.read(self.net, model.aig(), &mut |key, aig| {
            let lit = self.bit(key, flops, nodes, &active, aig);
            if let (Origin::Step(step), _, _) = key {
                active[step.index()] = lit;
            }
            bits.insert(key, lit);
            lit
        });
        (state, bits)
    }
}

/// True if a flip-flop stores this piece between reactions. While a chip is busy, its pins show registers that are not read; and a queue that is empty after
/// each reaction is no piece of the state.
fn is_own(key: Key, pieces: &BTreeSet<Key>, binding: &Binding) -> bool {
    match key.0 {
        Origin::HeldOutput(..) => binding.busy.is_none() && pieces.contains(&key),
        Origin::Region(_) => true,
        _ => pieces.contains(&key),
    }
}

/// True if every transition that enters the history leaves the state of the history, so that what was recorded earlier is never read while the state is
/// active.
fn is_left_before_entry(net: &Net, wanted: HistoryId) -> bool {
    net.transitions.values().all(|transition| {
        let mut lists = vec![transition.enters.as_slice()];
        let mut seen: BTreeSet<HistoryId> = BTreeSet::new();
        while let Some(list) = lists.pop() {
            for enter in list {
                if let Enter::History(id) = enter
                    && seen.insert(*id)
                {
                    let history = &net.histories[*id];
                    lists.push(&history.default);
                    lists.extend(history.cases.iter().map(|case| case.enters.as_slice()));
                }
            }
        }
        !seen.contains(&wanted) || transition.clears.contains(&net.histories[wanted].owner)
    })
}

fn attempt(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    limits: &Limits,
    depth: u32,
    varies: &BTreeSet<Fixed>,
) -> Result<Certificate, Failed> {
    let limits = &Limits { circuit_nodes: limits.circuit_nodes.min(MAX_NODES), ..limits.clone() };
    let mut model = Model::of(net, Some(depth), limits)?;
    if binding.busy.is_some() && !model.maker.shape.chart.kept.is_empty() {
        let why = "a circuit with `busy` of a chart that ends is not covered".to_owned();
        return Err(Failed::Open(why));
    }
    let reset = model.maker.reset()?;
    let shape = model.maker.shape.clone();
    let reset_bits = shape.bits(net, model.aig(), &reset.state);
    if reset_bits.values().any(|lit| lit.as_constant().is_none()) {
        return Err(Failed::Open("the reset does not lead to a single state".to_owned()));
    }
    let pieces: BTreeSet<Key> = reset_bits.keys().copied().collect();
    let mut reading = Reading { net, logic, flops: BTreeMap::new(), others: BTreeMap::new() };
    let mut flops = Vec::new();
    let mut constants = Vec::new();
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
    for (key, first) in &reset_bits {
        if !reading.is_stored(*key) {
            let varies = varies.contains(&Fixed::Piece(*key));
            let lit = if varies { model.aig().variable() } else { *first };
            reading.others.insert(*key, lit);
        }
    }
    let inputs = model.inputs.clone();
    let mut pins = vec![Lit::FALSE; logic.inputs.len()];
    for (pin, input, bit) in &binding.inputs {
        pins[pin.index()] =
            model.input_bits.get(&(input.index() as u32, *bit)).copied().unwrap_or(Lit::FALSE);
    }
    for pin in &binding.ticks {
        pins[pin.index()] = inputs.tick;
    }
    let nodes = import(model.aig(), logic, &flops, &pins);
    let (state, _) = reading.state(&mut model, &flops, &nodes);

    // The assumptions: the invariants of the net's states, valid codes, and what the environment guarantees.
    let mut assumed = {
        // The registers of a region record nothing while the state of the history is active.
        let mut state = state.clone();
        for ((history, step), recorded) in &mut state.recorded {
            if reading.by_region(*history, *step, &flops).is_some() {
                let owner = state.active[net.histories[*history].owner.index()];
                *recorded = model.aig().and(*recorded, !owner);
            }
        }
        model.maker.structure(&state)
    };
    assumed.extend(shape.valid(net, model.aig(), &state));
    assumed.extend(legal(&mut model, &state));
    for node in &logic.unreachable {
        assumed.push(!nodes[node.index()]);
    }

    let Reaction { state: next, outputs, fault } = model.maker.reaction(&state, &inputs)?;
    let overruns = model.maker.overruns();
    let next_bits = shape.bits(net, model.aig(), &next);

    // The circuit.
    let mut moved: Vec<Lit> = logic.flops.values().map(|flop| nodes[flop.next.index()]).collect();
    let mut after_pins = pins.clone();
    let mut still_busy = Lit::FALSE;
    if let Some(busy) = binding.busy {
        for (pin, input, _) in &binding.inputs {
            if net.inputs[*input].kind.is_event() {
                after_pins[pin.index()] = Lit::FALSE;
            }
        }
        for pin in &binding.ticks {
            after_pins[pin.index()] = Lit::FALSE;
        }
        let busy = logic.outputs[busy].value;
        for _ in 0..=depth {
            let nodes = import(model.aig(), logic, &moved, &after_pins);
            still_busy = nodes[busy.index()];
            if still_busy == Lit::FALSE {
                break;
            }
            moved = logic
                .flops
                .values()
                .zip(&moved)
                .map(|(flop, own)| model.aig().ite(still_busy, nodes[flop.next.index()], *own))
                .collect();
            if model.aig().len() > MAX_NODES {
                return Err(Failed::Open(format!(
                    "both reactions have more than {MAX_NODES} nodes"
                )));
            }
        }
        let nodes = import(model.aig(), logic, &moved, &after_pins);
        still_busy = nodes[busy.index()];
    }
    let after_nodes = import(model.aig(), logic, &moved, &after_pins);
    let (_, read) = reading.state(&mut model, &moved, &after_nodes);

    let mut claims = vec![
        Claim {
            wanted: Lit::FALSE,
            given: overruns,
            what: "the number of checks".to_owned(),
            constant: None,
        },
        Claim {
            wanted: Lit::FALSE,
            given: still_busy,
            what: "the number of clocks".to_owned(),
            constant: None,
        },
    ];
    for flop in constants {
        let data = &logic.flops[flop];
        claims.push(Claim {
            wanted: Lit::constant(data.init),
            given: moved[flop.index()],
            what: format!("flip-flop `{}`", data.name),
            constant: Some(Fixed::Flop(flop)),
        });
    }
    // Power-up.
    let woken: Vec<Lit> = logic.flops.values().map(|flop| Lit::constant(flop.init)).collect();
    let woken_nodes = import(model.aig(), logic, &woken, &vec![Lit::FALSE; pins.len()]);
    let (_, first) = reading.state(&mut model, &woken, &woken_nodes);
    for (key, wanted) in &next_bits {
        let what = format!("the state `{}`", describe(net, *key));
        let other = reading.others.get(key);
        if other.is_some_and(|lit| lit.as_constant().is_none()) {
            continue;
        }
        let matters = self::matters(&mut model, &reading, &flops, *key, &next);
        let at_reset = self::matters(&mut model, &reading, &flops, *key, &reset.state);
        if at_reset != Lit::FALSE && first[key] != reset_bits[key] {
            return Err(Failed::Open(format!("{what} has a different value after power-up")));
        }
        let wanted = model.aig().and(*wanted, matters);
        let given = model.aig().and(read[key], matters);
        let constant = other.map(|_| Fixed::Piece(*key));
        claims.push(Claim { wanted, given, what, constant });
    }
    for node in &logic.unreachable {
        if woken_nodes[node.index()] != Lit::FALSE {
            return Err(Failed::Open("the power-up code encodes no step".to_owned()));
        }
        let what = "the transition into an unused code".to_owned();
        let given = after_nodes[node.index()];
        claims.push(Claim { wanted: Lit::FALSE, given, what, constant: None });
    }
    for one in &binding.compared {
        let Shown::Pin { pin, mealy } = one.shown else { continue };
        let output = &logic.outputs[pin];
        let wanted = match one.what {
            What::Output(id) => {
                outputs[id.index()].get(one.bit as usize).copied().unwrap_or(Lit::FALSE)
            }
            What::Fault => fault,
            What::Step(_) | What::Var(..) => continue,
        };
        let from = if mealy || output.registered.is_some() { &nodes } else { &after_nodes };
        let given = from[output.value.index()];
        let what = format!("output pin `{}`", output.name);
        claims.push(Claim { wanted, given, what, constant: None });
    }
    settle(&model, logic, limits, &flops, &moved, &assumed, claims)
}

/// The condition under which a piece of a state is read later: elements of queues below the length; records of the registers of a region while the state of
/// the history is not active.
fn matters(
    model: &mut Model<'_>,
    reading: &Reading<'_>,
    flops: &[Lit],
    key: Key,
    state: &State,
) -> Lit {
    let net = model.maker.net;
    match key.0 {
        Origin::Recorded(history, step) if reading.by_region(history, step, flops).is_some() => {
            !state.active[net.histories[history].owner.index()]
        }
        Origin::InternalQueue => used(model, state.internal.as_ref(), key.1),
        Origin::ExternalQueue => used(model, state.external.as_ref(), key.1),
        _ => Lit::TRUE,
    }
}

/// Runs both at random, and then proves the claims.
fn settle(
    model: &Model<'_>,
    logic: &Logic,
    limits: &Limits,
    flops: &[Lit],
    moved: &[Lit],
    assumed: &[Lit],
    claims: Vec<Claim>,
) -> Result<Certificate, Failed> {
    let aig = &model.maker.aig;
    let patterns = patterns(model, logic, flops, moved, assumed, &claims)?;
    let mut sweep = Sweep::new(aig, assumed, &patterns, limits)
        .ok_or_else(|| "the solver reached its limit".to_owned())?;
    let roots: Vec<Lit> = claims.iter().flat_map(|claim| [claim.wanted, claim.given]).collect();
    sweep.prepare(&roots).ok_or_else(|| "the solver reached its limit".to_owned())?;
    let mut varied = Vec::new();
    let (mut same, mut solved) = (0, 0);
    let compared = claims.len();
    for (at, claim) in claims.iter().enumerate() {
        if claim.wanted == claim.given {
            same += 1;
            continue;
        }
        match sweep.equal(claim.wanted, claim.given) {
            Answer::Equal => solved += 1,
            Answer::Different(_) if at < 2 => return Err(Failed::Deeper),
            Answer::Different(example) => {
                if let Some(fixed) = claim.constant {
                    varied.push(fixed);
                    continue;
                }
                if !varied.is_empty() {
                    break;
                }
                let names: Vec<&str> = logic
                    .flops
                    .values()
                    .zip(flops)
                    .filter(|(_, lit)| example.contains(lit))
                    .map(|(flop, _)| flop.name.as_str())
                    .collect();
                return Err(Failed::Open(format!(
                    "{} differs from the net in a state that no invariant excludes: {} set",
                    claim.what,
                    names.join(" ")
                )));
            }
            Answer::Unknown => {
                return Err(Failed::Open(format!("{}: the solver reached its limit", claim.what)));
            }
        }
    }
    if !varied.is_empty() {
        return Err(Failed::NotConstant(varied));
    }
    Ok(Certificate { method: Method::Symbolic { same, solved }, compared })
}

/// The assignments of random runs of the circuit from power-up.
fn patterns(
    model: &Model<'_>,
    logic: &Logic,
    flops: &[Lit],
    moved: &[Lit],
    assumed: &[Lit],
    claims: &[Claim],
) -> Result<Vec<BTreeMap<Lit, u64>>, Failed> {
    let aig = &model.maker.aig;
    let net = model.maker.net;
    let mut random = Random::new(1);
    let mut state: Vec<u64> =
        logic.flops.values().map(|flop| if flop.init { !0 } else { 0 }).collect();
    let mut all = Vec::new();
    let mut varied: BTreeSet<Fixed> = BTreeSet::new();
    for round in 0..ROUNDS {
        let mut pattern: BTreeMap<Lit, u64> = BTreeMap::new();
        for (lit, word) in flops.iter().zip(&state) {
            if lit.as_constant().is_none() {
                pattern.insert(*lit, *word);
            }
        }
        let mut events: Vec<Lit> = Vec::new();
        for ((input, _), lit) in &model.input_bits {
            let kind = net.inputs[grafsynth_ir::net::InputId::from_index(*input as usize)].kind;
            let word = match kind {
                InputKind::Event => {
                    events.push(*lit);
                    random.bits() & random.bits() & if round % 2 == 0 { random.bits() } else { !0 }
                }
                InputKind::InternalEvent => 0,
                InputKind::Pin | InputKind::Extern => random.bits(),
            };
            pattern.insert(*lit, word);
        }
        // One half of the runs has few events, so that time passes.
        let busy = random.bits();
        if net.settings.events_exclusive {
            let mut free = busy;
            for event in &events {
                let word = pattern[event] & free;
                free &= !word;
                pattern.insert(*event, word);
            }
        } else {
            for event in &events {
                let word = pattern[event] & busy;
                pattern.insert(*event, word);
            }
        }
        pattern.insert(model.inputs.tick, random.bits() | random.bits());
        let mut words = aig.all_words(|lit| pattern.get(&lit).copied().unwrap_or(0));
        let legal = assumed.iter().fold(!0, |all, lit| all & word_of(&words, *lit));
        if legal == 0 {
            continue;
        }
        if legal != !0 {
            // Runs with an impossible row repeat one with a possible row.
            let from = legal.trailing_zeros();
            for word in pattern.values_mut() {
                let copy = if *word >> from & 1 == 1 { !0 } else { 0 };
                *word = *word & legal | copy & !legal;
            }
            words = aig.all_words(|lit| pattern.get(&lit).copied().unwrap_or(0));
        }
        for (at, claim) in claims.iter().enumerate() {
            let differ = word_of(&words, claim.wanted) ^ word_of(&words, claim.given);
            if differ != 0 {
                if at < 2 {
                    return Err(Failed::Deeper);
                }
                match claim.constant {
                    Some(fixed) => {
                        varied.insert(fixed);
                    }
                    None if varied.is_empty() => {
                        return Err(Failed::Open(format!("{} differs from the net", claim.what)));
                    }
                    None => {}
                }
            }
        }
        for (own, lit) in state.iter_mut().zip(moved) {
            *own = word_of(&words, *lit);
        }
        all.push(pattern);
        if !varied.is_empty() {
            return Err(Failed::NotConstant(varied.into_iter().collect()));
        }
        // Some runs start again.
        let restart = random.bits() & random.bits() & random.bits() & random.bits();
        for (own, flop) in state.iter_mut().zip(logic.flops.values()) {
            *own = *own & !restart | if flop.init { restart } else { 0 };
        }
    }
    Ok(all)
}

/// What the environment guarantees about a row, as conditions.
fn legal(model: &mut Model<'_>, state: &State) -> Vec<Lit> {
    let net = model.maker.net;
    let inputs = model.inputs.clone();
    let is_input: BTreeSet<Lit> = model.input_bits.values().copied().collect();
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
        Origin::Step(step) => net.steps[step].name.text.clone(),
        Origin::Elapsed(step) | Origin::LastElapsed(step) => {
            format!("time of {}", net.steps[step].name)
        }
        Origin::Var(var) => net.vars[var].name.text.clone(),
        Origin::Recorded(history, step) => {
            format!("{} of {}", net.steps[step].name, net.histories[history].name)
        }
        Origin::SendTimer(slot) => net.sends[slot].name.text.clone(),
        other => format!("{other:?}"),
    }
}
