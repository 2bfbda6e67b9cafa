//! The proof that the parts of a divided net, joined by their wires, equal the net (semantics §10.6).
//!
//! Let S be a state of the net, and let each part be in the state that S gives to its objects: copies have the values of the originals. The proof shows that
//! 1. after reset the parts are in the state that the net's reset state gives them, with equal outputs;
//! 2. whether a part's own transitions fire does not depend on its wires, so there is no loop of wires through several parts;
//! 3. from every S and for every row, each wire shows whether its transition fires in the net; and if the wires have these values, each part is afterwards in the
//!    state that the net's next state gives it, and its outputs are those of the net;
//! 4. if a chip reads the pins of an emergency directly, any levels of these pins only give some of its outputs their safe values ([`at_once`]).
//!
//! A part may compare a time with smaller constants than the net does. Its counter is modelled with the cap of the net: a counter that counts beyond all constants
//! that it is compared with gives the same results. A part under `priority-age` may also store a relative age that nothing in the net depends on; its value is
//! left free, so the proof shows that nothing in the part depends on it either.
//!
//! If the evolution of the net is `stable`, all this is shown for its micro-step, which is one round (semantics §10.3): then S is any state between two
//! micro-steps. It must also be proved that no reaction of the net exceeds its limit, and each part must show whether it moves.
//!
//! A statechart is on one part as a whole; [`statechart`] proves its parts.
//!
//! By induction the parts then have the net's outputs, steps and variables in every row. The proof uses the second encoding of the reaction for the net and for each
//! part. The division is a claim: the proof does not trust it, but checks which object each object of a part copies.

mod at_once;
mod statechart;
mod words;

use grafsynth_ir::Valid;
use grafsynth_ir::division::{Division, Original, PartNet, Shown, Signal, Source, round_of};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{
    Evolution, InputId, Leaf, Net, Property, PropertyLeaf, PropertyRole, StepId, TransitionId,
};
use grafsynth_ir::program::Origin;

use super::aig::{Aig, Lit};
use super::calls::{self, Call};
use super::number::Number;
use super::reaction::{Inputs, Maker, Reaction};
use super::shared::Shared;
use super::state::{Key, Shape, State, Value};
use super::{CONE, Model};
use crate::limits::Limits;
use crate::verdict::{Open, Scope, Verdict};
use words::{stored, wire};

/// The bits of `dt` if a row can take several ticks: [`grafsynth_sim::MAX_DT`] is the largest.
const BITS_OF_DT: u32 = grafsynth_sim::MAX_DT.count_ones();

/// A proof that the parts equal the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined {
    /// The number of compared functions: bits of the state of each part, outputs and wires.
    pub compared: usize,
    /// The number of functions that are equal by construction; the solver proved the others.
    pub same: usize,
    /// The rows that the proof covers.
    pub scope: Scope,
}

/// A difference between the parts and the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Apart {
    /// What differs: an output, a wire, or a bit of the state of a part.
    pub what: String,
    /// A state and inputs for which it differs, in words. The state satisfies the known invariants, but may be unreachable.
    pub when: String,
}

/// What is known before the proof.
#[derive(Debug, Clone, Copy)]
pub struct RoundFacts<'a> {
    /// The facts of the net of a round ([`round_of`]).
    pub facts: &'a Facts,
    /// Whether it is proved that no reaction of the net exceeds its limit of micro-steps; not used if the evolution is `single`.
    pub ends: bool,
}

/// Proves that the parts of a division equal the net, for every row and every `dt`; with `one_tick`, only for `dt` 0 and 1.
///
/// A difference is refuted only in the reset state, or if a wire depends on other wires. In a state that may be unreachable, the answer is open.
#[must_use]
pub fn joined(
    net: &Valid<Net>,
    known: RoundFacts<'_>,
    division: &Division,
    one_tick: bool,
    limits: &Limits,
) -> Verdict<Joined, Apart> {
    match prove(net, known, division, one_tick, limits) {
        Ok(joined) => Verdict::Proved(joined),
        Err(Failed::Apart(apart)) => Verdict::Refuted(apart),
        Err(Failed::Open(reason)) => Verdict::Open(Open::because(reason)),
    }
}

enum Failed {
    Apart(Apart),
    Open(String),
}

impl From<String> for Failed {
    fn from(reason: String) -> Self {
        Failed::Open(reason)
    }
}

/// A reaction with the calls that it makes.
struct Calling {
    reaction: Reaction,
    calls: Vec<Call>,
}

struct Proof<'a> {
    model: Model<'a>,
    shared: Shared,
    facts: &'a Facts,
    limits: &'a Limits,
    compared: usize,
    same: usize,
}

fn prove(
    net: &Valid<Net>,
    known: RoundFacts<'_>,
    division: &Division,
    one_tick: bool,
    limits: &Limits,
) -> Result<Joined, Failed> {
    covers(net, division)?;
    if net.settings.policy.is_statechart() {
        return statechart::prove(net, known.facts, division, limits);
    }
    let single = |net: &Net| net.settings.evolution == Evolution::Single;
    if !division.parts.iter().all(|part| single(&part.net)) {
        return Err(Failed::Open("a part makes more than one micro-step in a round".to_owned()));
    }
    if !single(net) {
        ends_together(net, division)?;
    }
    let round = round_of(net).map_err(|_| "one round of the net cannot be computed".to_owned())?;
    let is_bounded = single(net) || known.ends;
    let net = &round;
    let mut model = Model::of(net, None, limits)?;
    let (state, mut inputs) = (model.state.clone(), model.inputs.clone());
    if !one_tick {
        let bits: Vec<Lit> = (0..BITS_OF_DT).map(|_| model.aig().variable()).collect();
        inputs.dt = Some(Number::from_code(model.aig(), &bits, 0));
        inputs.tick = Lit::TRUE;
    }
    let reset = Calling { reaction: model.maker.reset()?, calls: model.maker.called.clone() };
    let next = model.maker.reaction(&state, &inputs)?;
    let next = Calling { reaction: next, calls: model.maker.called.clone() };
    let fires = model.maker.fired.first().cloned().unwrap_or_default();
    let facts = known.facts;
    let mut proof = Proof { model, shared: Shared::new(), facts, limits, compared: 0, same: 0 };
    for (at, part) in division.parts.iter().enumerate() {
        let own = net.transitions.ids().filter(|id| division.owners.transitions[*id] == at);
        let own: Vec<TransitionId> = own.collect();
        // The driver tells a chip whether any part moves, and the CPU whether a chip does.
        let is_cpu = at + 1 == division.parts.len();
        let all = net.transitions.ids().filter(|id| !(is_cpu && own.contains(id)));
        let fires = Fires { each: &fires, moving: all.collect(), own };
        proof.part(net, part, (&state, &inputs), &reset, &next, &fires)?;
    }
    if !is_bounded {
        let reason = "it is not proved that each reaction becomes stable within its limit of micro-steps (everything else is)";
        return Err(Failed::Open(reason.to_owned()));
    }
    let scope = if one_tick { Scope::OneTick } else { Scope::EveryStimulus };
    Ok(Joined { compared: proof.compared, same: proof.same, scope })
}

/// Checks that each output of the net is an output of a part, each step and variable is in the state of a part, and each wire has a driver.
fn covers(net: &Net, division: &Division) -> Result<(), Failed> {
    let missing =
        |what: String| Failed::Apart(Apart { what, when: "no part drives it".to_owned() });
    let twice = |what: String| Failed::Apart(Apart { what, when: "two parts drive it".to_owned() });
    let drivers = |wanted: Shown| {
        let outputs = division.parts.iter().flat_map(|part| part.outputs.values());
        outputs.filter(|shown| **shown == wanted).count()
    };
    for (id, output) in net.outputs.iter() {
        match drivers(Shown::Output(id)) {
            0 => return Err(missing(format!("output `{}`", output.name))),
            1 => {}
            // Two drivers would be equal, but a function would be called twice.
            _ => return Err(twice(format!("output `{}`", output.name))),
        }
    }
    for (id, step) in net.steps.iter() {
        if !division.parts.iter().any(|part| part.steps.values().any(|old| old.step() == Some(id)))
        {
            return Err(missing(format!("step `{}`", step.name)));
        }
    }
    for (id, var) in net.vars.iter() {
        if !division.parts.iter().any(|part| part.vars.values().any(|old| *old == id)) {
            return Err(missing(format!("variable `{}`", var.name)));
        }
    }
    for part in &division.parts {
        assumes_no_more(net, part)?;
    }
    for source in division.parts.iter().flat_map(|part| part.inputs.values()) {
        if let Source::Wire(signal) = source
            && drivers(Shown::Wire(*signal)) != 1
        {
            return Err(missing(wire(net, *signal)));
        }
    }
    Ok(())
}

/// Checks that a part assumes nothing about the inputs that the net does not assume.
fn assumes_no_more(net: &Net, part: &PartNet) -> Result<(), Failed> {
    for property in &part.net.properties {
        let is_input = |leaf: &PropertyLeaf| matches!(leaf, PropertyLeaf::Net(Leaf::Input(_)));
        let never = property.never.map_leaves(&|leaf| match leaf {
            PropertyLeaf::Net(Leaf::Input(id)) => match part.inputs[*id] {
                Source::Input(old) => PropertyLeaf::Net(Leaf::Input(old)),
                Source::Direct(_) | Source::Wire(_) | Source::More => {
                    PropertyLeaf::Net(Leaf::Input(InputId::from_index(usize::MAX)))
                }
            },
            PropertyLeaf::Net(_) | PropertyLeaf::Output(_) => *leaf,
        });
        let is_it = |other: &Property| other.role == PropertyRole::Assume && other.never == never;
        if property.role == PropertyRole::Assume
            && !(never.leaves().all(is_input) && net.properties.iter().any(is_it))
        {
            let what = format!("an assumption of part `{}`", part.name);
            let when = "the chart does not assume it".to_owned();
            return Err(Failed::Apart(Apart { what, when }));
        }
    }
    Ok(())
}

/// Checks what several rounds in a reaction need: each part that owns a transition shows whether it moves. Whether END waits for the
/// last round is part of the state that is compared.
fn ends_together(net: &Net, division: &Division) -> Result<(), Failed> {
    for (at, part) in division.parts.iter().enumerate() {
        let owns = division.owners.transitions.values().any(|owner| *owner == at);
        if owns && !part.outputs.values().any(|shown| *shown == Shown::Moves) {
            let what = format!("the moves of part `{}`", part.name);
            return Err(Failed::Apart(Apart { what, when: "no output shows them".to_owned() }));
        }
    }
    if net.steps.values().any(|step| !step.code.is_empty()) {
        let reason =
            "the text of a step runs once per reaction, but a reaction takes several rounds";
        return Err(Failed::Open(reason.to_owned()));
    }
    Ok(())
}

/// What fires in a reaction of the net.
struct Fires<'a> {
    /// For each transition, whether it does; empty at reset.
    each: &'a [Lit],
    /// The transitions that the part owns.
    own: Vec<TransitionId>,
    /// The transitions that decide whether the part is told that another round follows.
    moving: Vec<TransitionId>,
}

impl Fires<'_> {
    fn of(&self, id: TransitionId) -> Lit {
        self.each.get(id.index()).copied().unwrap_or(Lit::FALSE)
    }

    /// The value of a wire in a round.
    fn shows(&self, signal: Signal) -> Result<Lit, Failed> {
        match signal {
            Signal::Fires(id) => Ok(self.of(id)),
            Signal::Active(_) => Err(Failed::Open(
                "a wire shows a state, which only the wires of a statechart do".to_owned(),
            )),
        }
    }
}

impl Proof<'_> {
    fn part(
        &mut self,
        net: &Net,
        part: &PartNet,
        (state, inputs): (&State, &Inputs),
        reset: &Calling,
        next: &Calling,
        fires: &Fires<'_>,
    ) -> Result<(), Failed> {
        let aig = std::mem::replace(self.model.aig(), Aig::new());
        let mut maker = Maker::new(&part.net, None, self.limits.circuit_nodes)?;
        let whole = &self.model.maker.shape;
        let cap = |own: &mut Option<i64>, whole: Option<i64>| *own = own.and(whole);
        for (id, old) in part.steps.iter() {
            let Some(old) = old.step() else { continue };
            let (at, old) = (id.index(), old.index());
            cap(&mut maker.shape.elapsed[at], whole.elapsed[old]);
            cap(&mut maker.shape.last_elapsed[at], whole.last_elapsed[old]);
        }
        for (id, old) in part.timers.iter() {
            cap(&mut maker.shape.timers[id.index()], whole.timers[old.index()]);
        }
        maker.aig = aig;
        let done = self.with(&mut maker, (net, part), (state, inputs), (reset, next), fires);
        *self.model.aig() = std::mem::replace(&mut maker.aig, Aig::new());
        let pairs = done?;
        for pair in pairs {
            self.show(part, pair)?;
        }
        Ok(())
    }

    /// The pairs of functions that must be equal, made in the graph of the part's maker.
    fn with(
        &self,
        maker: &mut Maker<'_>,
        (net, part): (&Net, &PartNet),
        (state, inputs): (&State, &Inputs),
        (reset, next): (&Calling, &Calling),
        fires: &Fires<'_>,
    ) -> Result<Vec<Pair>, Failed> {
        let whole = &self.model.maker.shape;
        // 1. The reset.
        let own = maker.reset()?;
        let none = Fires { each: &[], own: Vec::new(), moving: Vec::new() };
        let of_reset = Wanted { net, whole, of: reset, fires: &none };
        let mut pairs = of_reset.pairs(maker, part, &own, true)?;
        // 2. The wires do not depend on wires.
        let given = seen(maker, whole, net, part, state)?;
        let mut own_inputs = independent(maker, net, part, &given, inputs)?;
        // 3. The reaction, if each wire shows whether its transition fires.
        for (value, source) in own_inputs.values.iter_mut().zip(part.inputs.values()) {
            match source {
                Source::Input(_) | Source::Direct(_) => {}
                Source::Wire(signal) => *value = Value::Flag(fires.shows(*signal)?),
                Source::More => {
                    let moving = fires.moving.iter().map(|id| fires.of(*id));
                    *value = Value::Flag(maker.aig.or_all(moving));
                }
            }
        }
        // The lists run under what fires in the net, which makes most functions equal by construction; that the part decides the same is shown for each transition.
        let claimed: Vec<Lit> = part.transitions.values().map(|old| fires.of(*old)).collect();
        maker.claimed = Some(claimed.clone());
        let own = maker.reaction(&given, &own_inputs)?;
        if maker.decided.len() != claimed.len() {
            return Err(Failed::Open("the fired transitions of a part are unknown".to_owned()));
        }
        let decided = part.transitions.iter().zip(maker.decided.clone()).zip(claimed);
        pairs.extend(decided.map(|(((id, _), given), wanted)| Pair {
            what: What::Decision(id.index()),
            wanted,
            given,
            at_reset: false,
        }));
        let of_next = Wanted { net, whole, of: next, fires };
        pairs.extend(of_next.pairs(maker, part, &own, false)?);
        // 4. The pins of an emergency.
        pairs.extend(at_once::pairs(maker, part, (&given, &own_inputs), &own)?);
        Ok(pairs)
    }

    fn show(&mut self, part: &PartNet, pair: Pair) -> Result<(), Failed> {
        self.compared += 1;
        if pair.wanted == pair.given {
            self.same += 1;
            return Ok(());
        }
        let what = pair.what.describe(part);
        if pair.at_reset {
            // Both are constants after reset.
            return Err(Failed::Apart(Apart { what, when: "after reset".to_owned() }));
        }
        match self.model.difference(
            &mut self.shared,
            (self.facts, self.limits),
            pair.wanted,
            pair.given,
        ) {
            Some(None) => Ok(()),
            Some(Some(bits)) => {
                let when = self.model.describe(&bits);
                Err(Failed::Open(format!(
                    "{what} differs in a state that may be unreachable ({when})"
                )))
            }
            None => Err(Failed::Open(format!("the solver reached its limit for {what}"))),
        }
    }
}

/// The inputs of a part with a free variable for each wire, after showing that no wire of the part depends on one: whether its own transitions fire is a
/// function of its state and the inputs of the net.
fn independent(
    maker: &mut Maker<'_>,
    net: &Net,
    part: &PartNet,
    given: &State,
    inputs: &Inputs,
) -> Result<Inputs, Failed> {
    let mut own = Inputs { values: Vec::new(), tick: inputs.tick, dt: inputs.dt.clone() };
    let mut free = Vec::new();
    for source in part.inputs.values() {
        own.values.push(match source {
            Source::Input(id) | Source::Direct(id) => inputs.values[id.index()].clone(),
            Source::Wire(_) | Source::More => {
                let lit = maker.aig.variable();
                free.push(lit);
                Value::Flag(lit)
            }
        });
    }
    let loose = maker.reaction(given, &own)?;
    for (id, shown) in part.outputs.iter() {
        let what = match shown {
            Shown::Output(_) => continue,
            Shown::Wire(signal) => wire(net, *signal),
            Shown::Moves => format!("whether part `{}` moves", part.name),
        };
        let support = maker
            .aig
            .support(&loose.outputs[id.index()], CONE)
            .ok_or_else(|| "the function of a wire is too large".to_owned())?;
        if support.iter().any(|lit| free.contains(lit)) {
            let when = "it depends on a wire of another part".to_owned();
            return Err(Failed::Apart(Apart { what, when }));
        }
    }
    Ok(own)
}

/// A reaction of the net that the parts must reproduce.
struct Wanted<'a> {
    net: &'a Net,
    whole: &'a Shape,
    of: &'a Calling,
    /// What fires.
    fires: &'a Fires<'a>,
}

impl Wanted<'_> {
    /// The state and outputs of the part, paired with those of the net.
    fn pairs(
        &self,
        maker: &mut Maker<'_>,
        part: &PartNet,
        own: &Reaction,
        at_reset: bool,
    ) -> Result<Vec<Pair>, Failed> {
        let given = seen(maker, self.whole, self.net, part, &self.of.reaction.state)?;
        let shape = maker.shape.clone();
        let wanted = shape.bits(&part.net, &mut maker.aig, &given);
        let own_bits = shape.bits(&part.net, &mut maker.aig, &own.state);
        let bits = own_bits.into_iter().filter(|(key, _)| !is_free(part, self.whole, key.0));
        let mut pairs: Vec<Pair> = bits
            .map(|(key, given)| Pair {
                what: What::Bit(key),
                wanted: wanted[&key],
                given,
                at_reset,
            })
            .collect();
        for (id, shown) in part.outputs.iter() {
            let wanted = match shown {
                Shown::Output(old) => self.of.reaction.outputs[old.index()].clone(),
                Shown::Wire(signal) => vec![self.fires.shows(*signal)?],
                Shown::Moves => {
                    let own: Vec<Lit> =
                        self.fires.own.iter().map(|id| self.fires.of(*id)).collect();
                    vec![maker.aig.or_all(own)]
                }
            };
            let codes = wanted.into_iter().zip(&own.outputs[id.index()]);
            pairs.extend(codes.map(|(wanted, given)| Pair {
                what: What::Output(id.index()),
                wanted,
                given: *given,
                at_reset,
            }));
        }
        let old = |call: &Call| match part.outputs[call.output] {
            Shown::Output(output) => Some(Call { output, ..call.clone() }),
            Shown::Wire(_) | Shown::Moves => None,
        };
        let own: Vec<Call> = maker.called.iter().filter_map(old).collect();
        let is_own =
            |call: &&Call| part.outputs.values().any(|it| *it == Shown::Output(call.output));
        let whole: Vec<Call> = self.of.calls.iter().filter(is_own).cloned().collect();
        let apart = calls::differ(&mut maker.aig, &own, &whole)?;
        pairs.extend(apart.into_iter().map(|given| Pair {
            what: What::Calls,
            wanted: Lit::FALSE,
            given,
            at_reset,
        }));
        Ok(pairs)
    }
}

/// Two functions that must be equal.
struct Pair {
    what: What,
    wanted: Lit,
    given: Lit,
    at_reset: bool,
}

enum What {
    Bit(Key),
    Output(usize),
    Decision(usize),
    Calls,
}

impl What {
    fn describe(&self, part: &PartNet) -> String {
        let name = &part.name;
        match self {
            What::Output(at) => {
                let output = part.net.outputs.values().nth(*at).map(|it| it.name.text.as_str());
                format!("output `{}` of part `{name}`", output.unwrap_or_default())
            }
            What::Calls => {
                format!("number, order or arguments of the calls of part `{name}`")
            }
            What::Decision(at) => {
                let transition =
                    part.net.transitions.values().nth(*at).map(|it| it.name.text.as_str());
                let transition = transition.unwrap_or_default();
                format!("the firing of transition `{transition}` of part `{name}`")
            }
            What::Bit((origin, _, _)) => {
                format!("{} of part `{name}`", stored(&part.net, *origin))
            }
        }
    }
}

/// The state of a part that corresponds to a state of the net.
fn seen(
    maker: &mut Maker<'_>,
    whole: &Shape,
    net: &Net,
    part: &PartNet,
    state: &State,
) -> Result<State, Failed> {
    let bits = whole.bits(net, &mut maker.aig, state);
    let shape = maker.shape.clone();
    let mut missing = None;
    let mut given = shape.read(&part.net, &mut maker.aig, &mut |(origin, element, bit), aig| {
        if is_free(part, whole, origin) {
            return aig.variable();
        }
        if let Origin::Step(id) = origin
            && let Original::Away(others) = &part.steps[id]
        {
            return !aig.or_all(others.iter().map(|id| state.active[id.index()]));
        }
        let lit = old_origin(part, origin)
            .and_then(|(old, inverted)| Some(bits.get(&(old, element, bit))?.negate_if(inverted)));
        lit.unwrap_or_else(|| {
            let what = stored(&part.net, origin);
            missing = Some(format!("part `{}` stores {what}, which the chart does not", part.name));
            Lit::FALSE
        })
    });
    if let Some(reason) = missing {
        return Err(Failed::Open(reason));
    }
    // The code of a number is its distance from the lower bound. A number that is read back from its code is a sum, which no sharing of nodes finds equal to the
    // number itself; so numbers are taken as they are.
    for (id, old) in part.vars.iter() {
        let (own, var) = (&part.net.vars[id], &net.vars[*old]);
        if (own.ty, own.len) == (var.ty, var.len) {
            given.vars[id.index()].clone_from(&state.vars[old.index()]);
        }
    }
    Ok(given)
}

/// True for a relative age that the net does not store. Nor does it store the age of a step that stands for the rest of a component.
fn is_free(part: &PartNet, whole: &Shape, origin: Origin) -> bool {
    let Origin::Older(a, b) = origin else { return false };
    match (part.steps[a].step(), part.steps[b].step()) {
        (Some(a), Some(b)) => !whole.older.contains(&(a.min(b), a.max(b))),
        _ => true,
    }
}

/// The piece of the net's state that a piece of a part's state copies, and whether it is inverted. Without one, the answer is open.
#[allow(clippy::wildcard_enum_match_arm, reason = "a forgotten piece leaves the answer open")]
fn old_origin(part: &PartNet, origin: Origin) -> Option<(Origin, bool)> {
    let step = |id: StepId| part.steps[id].step();
    let old = match origin {
        Origin::Step(id) => Origin::Step(step(id)?),
        Origin::Elapsed(id) => Origin::Elapsed(step(id)?),
        Origin::LastElapsed(id) => Origin::LastElapsed(step(id)?),
        Origin::Timer(id) => Origin::Timer(part.timers[id]),
        Origin::TaskIndex(id) => Origin::TaskIndex(step(id)?),
        Origin::Var(id) => Origin::Var(part.vars[id]),
        Origin::TimerCondition(id) => Origin::TimerCondition(part.timers[id]),
        Origin::Edge(id) => Origin::Edge(part.edges[id]),
        Origin::Older(a, b) => {
            let (a, b) = (step(a)?, step(b)?);
            return Some(if a < b {
                (Origin::Older(a, b), false)
            } else {
                (Origin::Older(b, a), true)
            });
        }
        Origin::ActionQ(id) => Origin::ActionQ(part.actions[id]),
        Origin::ActionLatch(id, latch) => Origin::ActionLatch(part.actions[id], latch),
        Origin::ActionTimer(id, timer) => Origin::ActionTimer(part.actions[id], timer),
        Origin::Pending(id) => match part.inputs[id] {
            Source::Input(old) => Origin::Pending(old),
            Source::Direct(_) | Source::Wire(_) | Source::More => return None,
        },
        _ => return None,
    };
    Some((old, false))
}
