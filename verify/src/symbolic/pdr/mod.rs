//! Property-directed reachability: decides whether some reaction from a reachable state violates a property, for any stimulus, without a bound on its length.
//!
//! Times are first free: a proof then covers whatever time passes. A violation found in this way may need times that never occur, so the question is repeated with
//! times as numbers. What the structure of the net proves (sequential components, codes, times of inactive steps) is given to the search as lemmas.
//!
//! Neither answer depends on the search: an invariant is accepted if [`recheck`](crate::recheck) accepts it, and a violation if the reference
//! simulator shows it.

mod frames;
mod lift;
mod solver;
mod system;

use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Expr, InputId, Net, Property};
use grafsynth_sim::{InputRow, Simulator, Stimulus, breaks_assumption};

use frames::{Bounds, Ended, Search};
use system::{Bit, Cube, System};
pub(super) use system::{Register, Source};

use super::aig::{Aig, Lit};
use super::invariant::{
    Claim, Encoded, Invariant, StateBit, Times, is_kept, is_time, keeps, limit_of,
};
use super::reach::longest_time;
use super::state::Key;
use super::{Model, over_state};
use crate::limits::Limits;

/// The numbers of micro-steps that are unrolled in successive attempts.
const DEPTHS: [u32; 3] = [4, 16, 64];

/// The attempt with free times may use [`Limits::directed_work`] divided by this number: if it succeeds, it usually does so early.
const PART_FOR_FREE_TIMES: u64 = 4;
/// One proof about a circuit may use [`Limits::directed_work`] divided by this number: random reactions are a cheaper way to show that a circuit is wrong.
const PART_FOR_CIRCUITS: u64 = 4;

/// The result for one property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Directed {
    /// No reaction violates the property; the invariant shows it.
    Proved(Invariant),
    /// The last row of the stimulus violates the property, as the simulator confirms.
    Refuted {
        /// A stimulus of the chart.
        stimulus: Stimulus,
        /// True if no stimulus with fewer rows violates it.
        is_shortest: bool,
    },
    /// Open, with the reason.
    Open(String),
    /// Open, because the simulator does not show the violation that was found: the two readings of the semantics disagree.
    Unconfirmed,
}

/// The result of one attempt.
enum Attempt {
    Settled(Directed),
    /// The violation may not exist in the net: times were free, or a reaction was cut short.
    Spurious,
}

/// Decides whether some reaction violates a property. The caller checks the row of the reset.
///
/// `facts` gives the components; with `None`, nothing is known about the reachable states.
#[must_use]
pub fn directed(
    net: &Valid<Net>,
    facts: Option<&Facts>,
    limits: &Limits,
    property: &Property,
) -> Directed {
    let Some(never) = over_state(net, &property.never) else {
        return Directed::Open(
            "properties of times and of mealy outputs are not covered by property-directed reachability"
                .to_owned(),
        );
    };
    let question = Question { net, facts, limits, property, never: &never };
    let most = limit_of(net);
    let mut depths: Vec<u32> = DEPTHS.iter().map(|depth| (*depth).min(most)).collect();
    depths.dedup();
    for depth in depths {
        for times in [Times::Free, Times::Counted] {
            match question.attempt(times, depth) {
                Ok(Attempt::Settled(settled)) => return settled,
                Ok(Attempt::Spurious) => {}
                Err(why) => return Directed::Open(why),
            }
        }
    }
    Directed::Open("a reaction may need more micro-steps than were unrolled".to_owned())
}

struct Question<'q> {
    net: &'q Valid<Net>,
    facts: Option<&'q Facts>,
    limits: &'q Limits,
    property: &'q Property,
    never: &'q Expr,
}

impl Question<'_> {
    /// Searches with free or counted times and at most `depth` micro-steps in a reaction.
    fn attempt(&self, times: Times, depth: u32) -> Result<Attempt, String> {
        let mut encoded = Encoded::of(self.net, self.limits, self.never, times, depth)?;
        let has_time = encoded.model.state_bits.keys().any(|(origin, _, _)| is_time(*origin));
        if times == Times::Free && !has_time {
            // Nothing is free, so the other attempt is the same.
            return Ok(Attempt::Spurious);
        }
        let keys: Vec<Key> = encoded.next.keys().copied().collect();
        let registers = keys.iter().map(|key| Register {
            lit: encoded.model.state_bits[key],
            next: encoded.next[key],
            first: encoded.first[key],
        });
        let registers = registers.collect();
        let bad = encoded.model.aig().or(encoded.violated, encoded.overrun);
        let lemmas = self.facts.map_or_else(Vec::new, |facts| lemmas(&mut encoded.model, facts));
        let source = Source { registers, legal: encoded.legal.clone(), bad, lemmas };
        let mut system = System::of(encoded.model.aig(), &source);
        let part = if times == Times::Free { PART_FOR_FREE_TIMES } else { 1 };
        let work = self.limits.directed_work / part;
        let bounds = Bounds { conflicts: self.limits.conflicts, work };
        loop {
            match Search::new(&system, bounds).run() {
                Ended::Proved(cubes) => {
                    let invariant =
                        |cubes: &[Cube]| self.invariant(&system, &keys, times, depth, cubes);
                    let accepted = closed(&system, cubes, |cubes| {
                        keeps(self.net, self.limits, self.never, &invariant(cubes)).is_ok()
                    });
                    match accepted {
                        Some(cubes) => {
                            let invariant = invariant(&cubes);
                            return Ok(Attempt::Settled(Directed::Proved(invariant)));
                        }
                        None if system.lemmas.is_empty() => {
                            return Err("the invariant found is not inductive".to_owned());
                        }
                        // The lemmas have a proof of their own, but are not inductive.
                        None => system.forget_lemmas(),
                    }
                }
                Ended::Refuted { rows, at_least } => {
                    return Ok(self.replay(&encoded, &system, &rows, at_least));
                }
                Ended::Spent if times == Times::Free => return Ok(Attempt::Spurious),
                Ended::Spent => {
                    return Err("property-directed reachability reached its work limit".to_owned());
                }
            }
        }
    }

    fn invariant(
        &self,
        system: &System,
        keys: &[Key],
        times: Times,
        depth: u32,
        cubes: &[Cube],
    ) -> Invariant {
        let bit = |bit: &Bit| {
            let (origin, element, place) = keys[system.source[bit.index()]];
            (StateBit { origin, element, bit: place }, !bit.value)
        };
        let clause = |cube: &Cube| cube.iter().map(bit).collect();
        let mut clauses: Vec<Vec<_>> = cubes.iter().map(clause).collect();
        clauses.sort_unstable();
        clauses.dedup();
        Invariant { times, micro_steps: depth.min(limit_of(self.net)), clauses }
    }

    /// Runs the simulator with the inputs of a violation; no violation has fewer than `at_least` rows.
    fn replay(
        &self,
        encoded: &Encoded<'_>,
        system: &System,
        rows: &[Vec<usize>],
        at_least: usize,
    ) -> Attempt {
        let net = self.net;
        let mut simulator = Simulator::new(net);
        let mut stimulus = Stimulus::new(net);
        for ones in rows {
            let row = self.row(encoded, system, ones);
            if breaks_assumption(net, &row) {
                break;
            }
            simulator.step(&row);
            stimulus.push(&row);
            if simulator.is_violated(self.property) {
                let is_shortest = stimulus.len() <= at_least;
                return Attempt::Settled(Directed::Refuted { stimulus, is_shortest });
            }
        }
        let is_cut = encoded.overrun != Lit::FALSE;
        let is_free = encoded.time.is_empty() && longest_time(net, &encoded.model.maker.shape) > 0;
        if is_cut || is_free {
            return Attempt::Spurious;
        }
        if encoded.model.n_passed_over == 0 {
            return Attempt::Settled(Directed::Unconfirmed);
        }
        let why = "a violation was found only with inputs that an assumption may exclude";
        Attempt::Settled(Directed::Open(why.to_owned()))
    }

    /// The row in which these inputs of the system are 1.
    fn row(&self, encoded: &Encoded<'_>, system: &System, ones: &[usize]) -> InputRow {
        let mut ones: Vec<Lit> = ones.iter().filter_map(|node| system.inputs[*node]).collect();
        ones.sort_unstable();
        let is_one = |lit: Lit| u64::from(ones.binary_search(&lit).is_ok());
        let mut row = InputRow::zero(self.net);
        let mut codes = vec![0_u64; row.values.len()];
        for ((input, bit), lit) in &encoded.model.input_bits {
            codes[*input as usize] |= is_one(*lit) << bit;
        }
        for ((id, input), code) in self.net.inputs.iter().zip(codes) {
            row = row.with(
                InputId::from_index(id.index()),
                input.ty.bounds().0.saturating_add_unsigned(code),
            );
        }
        let ticks =
            (encoded.time.iter().enumerate()).fold(0, |all, (at, bit)| all | is_one(*bit) << at);
        let longest = longest_time(self.net, &encoded.model.maker.shape).unsigned_abs();
        row.dt = u32::try_from(ticks.min(longest)).unwrap_or(u32::MAX).min(grafsynth_sim::MAX_DT);
        row
    }
}

/// Proves that no reachable reaction is bad. Returns the number of clauses of the invariant, or `None` if there is none or the search reached its limit.
pub(super) fn is_never_bad(aig: &Aig, source: &Source, limits: &Limits) -> Option<usize> {
    let mut system = System::of(aig, source);
    let work = limits.directed_work / PART_FOR_CIRCUITS;
    let bounds = Bounds { conflicts: limits.conflicts, work };
    loop {
        let Ended::Proved(cubes) = Search::new(&system, bounds).run() else { return None };
        let claim = |cube: &Cube| {
            let of = |bit: &Bit| (source.registers[system.source[bit.index()]], bit.value);
            Claim {
                now: cube.iter().map(of).map(|(it, value)| it.lit.negate_if(value)).collect(),
                then: cube.iter().map(of).map(|(it, value)| it.next.negate_if(value)).collect(),
                is_first: cube.iter().map(of).any(|(it, value)| it.first != value),
            }
        };
        let accepted = closed(&system, cubes, |cubes| {
            let claims: Vec<Claim> = cubes.iter().map(claim).collect();
            is_kept(aig, &source.legal, source.bad, &claims, limits.conflicts).is_ok()
        });
        match accepted {
            Some(cubes) => return Some(cubes.len()),
            None if system.lemmas.is_empty() => return None,
            None => system.forget_lemmas(),
        }
    }
}

/// The facts about the reachable states that the structure proves, as clauses over the bits of the state.
pub(super) fn lemmas(model: &mut Model<'_>, facts: &Facts) -> Vec<Vec<Lit>> {
    let bits: Vec<Lit> = model.state_bits.values().copied().collect();
    let (_, mut clauses) = model.invariants(facts, &bits);
    for (code, fits) in model.valid.clone() {
        clauses.extend(at_most(model, &code, fits));
    }
    clauses
}

/// The clauses that limit a code to the largest value for which `fits` is true; all smaller values fit too.
fn at_most(model: &mut Model<'_>, code: &[Lit], fits: Lit) -> Vec<Vec<Lit>> {
    let mut largest: indexmap::IndexMap<Lit, Lit> =
        code.iter().map(|bit| (*bit, Lit::FALSE)).collect();
    let mut clauses = Vec::new();
    let mut ones = Vec::new();
    for bit in code.iter().rev() {
        largest.insert(*bit, Lit::TRUE);
        if model.aig().substitute(&[fits], &largest) == [Lit::TRUE] {
            ones.push(!*bit);
        } else {
            largest.insert(*bit, Lit::FALSE);
            clauses.push(ones.iter().copied().chain([!*bit]).collect());
        }
    }
    clauses
}

/// The cubes, with as few lemmas as are needed so that `is_inductive` accepts them. `None` if not even all lemmas suffice.
fn closed(
    system: &System,
    cubes: Vec<Cube>,
    is_inductive: impl Fn(&[Cube]) -> bool,
) -> Option<Vec<Cube>> {
    if is_inductive(&cubes) {
        return Some(cubes);
    }
    let all: Vec<Cube> = cubes.into_iter().chain(system.lemmas.iter().cloned()).collect();
    is_inductive(&all).then_some(all)
}
