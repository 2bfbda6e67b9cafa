//! Inductive invariants as certificates, and their checker.
//!
//! The checker trusts nothing that the search learnt: it builds the reaction again, translates it with a few lines of its own, and asks the solver three
//! questions. Does the state after reset satisfy every clause? If a state satisfies all clauses, does every state after one more reaction satisfy them? Is no
//! reaction from such a state bad? The proof of a property therefore depends on the second encoding, the solver, and this file.

use std::collections::BTreeMap;

use batsat::{
    Callbacks, ClauseKind, Lit as SatLit, Solver, SolverInterface, SolverOpts, Var, lbool,
};
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Evolution, Expr, Net, Property};
use grafsynth_ir::program::Origin;
use grafsynth_sim::Simulator;

use super::aig::{Aig, Lit};
use super::reach::{Failed, any_time, initial, legal_inputs};
use super::reaction::{Maker, refuse_open_cells};
use super::state::Key;
use super::{Model, over_state};
use crate::limits::Limits;

/// A bit of a net's state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StateBit {
    /// The part of the state.
    pub origin: Origin,
    /// The element of an array; 0 for everything else.
    pub element: u32,
    /// The position in the code of the value (the value minus its minimum); 0 is the lowest bit.
    pub bit: u32,
}

/// The bits of a net's state between two reactions, as the second encoding stores it; none if it does not cover the net.
#[must_use]
pub fn state_bits(net: &Valid<Net>) -> Vec<StateBit> {
    if net.settings.policy.is_statechart() {
        return Vec::new();
    }
    let Ok(maker) = Maker::new(net, Some(1), usize::MAX) else { return Vec::new() };
    let (_, bits, _) = maker.shape.free(net, &mut Aig::new());
    bits.into_keys().map(|(origin, element, bit)| StateBit { origin, element, bit }).collect()
}

/// How an invariant describes time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Times {
    /// Each time may have any value in each reaction; the clauses contain no bits of times.
    Free,
    /// Times are numbers that grow with `dt`.
    Counted,
}

/// Clauses over the state that are true after reset and remain true in every reaction, and that exclude the states from which a reaction violates a property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invariant {
    /// How time is described.
    pub times: Times,
    /// The number of micro-steps that a reaction may take; the clauses also prove that no reaction takes more.
    pub micro_steps: u32,
    /// In each clause, at least one of the bits has the given value. Sorted.
    pub clauses: Vec<Vec<(StateBit, bool)>>,
}

/// The reason why an invariant is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refused {
    /// The clause, counted from 0, contains a bit that the state does not have.
    NoSuchBit(usize),
    /// The state after reset does not satisfy the clause.
    Reset(usize),
    /// The clause may be false after a reaction from a state that satisfies all clauses.
    NotInductive(usize),
    /// A reaction from a state that satisfies all clauses may violate the property, or take more micro-steps than given.
    NotSafe,
    /// The check could not be completed, with the reason.
    Unchecked(String),
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Refused::NoSuchBit(_) => {
                write!(f, "the clause contains a bit that the state of the chart does not have")
            }
            Refused::Reset(_) => write!(f, "the state after reset does not satisfy the clause"),
            Refused::NotInductive(_) => write!(
                f,
                "a reaction from a state that satisfies all clauses may lead to a state that does not satisfy this one"
            ),
            Refused::NotSafe => write!(
                f,
                "the clauses do not exclude every state from which a reaction violates the assert or takes more micro-steps"
            ),
            Refused::Unchecked(why) => f.write_str(why),
        }
    }
}

/// The functions of a reaction that a question about a property needs.
pub(super) struct Encoded<'n> {
    pub(super) model: Model<'n>,
    /// The bits of the state, without times if they are free.
    pub(super) next: BTreeMap<Key, Lit>,
    pub(super) first: BTreeMap<Key, bool>,
    pub(super) legal: Vec<Lit>,
    /// The bits of the number of ticks; empty if times are free.
    pub(super) time: Vec<Lit>,
    /// True if the reaction violates the property.
    pub(super) violated: Lit,
    /// True if the reaction takes more micro-steps than were encoded.
    pub(super) overrun: Lit,
}

impl<'n> Encoded<'n> {
    /// Encodes one reaction with at most this number of micro-steps; `never` is the property over state and inputs.
    pub(super) fn of(
        net: &'n Net,
        limits: &Limits,
        never: &Expr,
        times: Times,
        micro_steps: u32,
    ) -> Result<Self, String> {
        refuse_open_cells(net)?;
        if net.settings.policy.is_statechart() {
            return Err("statecharts are not covered by property-directed reachability".to_owned());
        }
        let depth = micro_steps.min(limit_of(net));
        let mut model = Model::of(net, Some(depth), limits)?;
        let time = match times {
            Times::Counted => any_time(&mut model),
            Times::Free => {
                // Without a tick, a counter keeps its value, which is an input here: any value in each reaction.
                model.inputs.tick = Lit::FALSE;
                Vec::new()
            }
        };
        let mut first = initial(&mut model).map_err(why)?;
        let (state, inputs) = (model.state.clone(), model.inputs.clone());
        let reaction = model.maker.reaction(&state, &inputs)?;
        let shape = model.maker.shape.clone();
        let mut next = shape.bits(net, model.aig(), &reaction.state);
        if times == Times::Free {
            next.retain(|(origin, _, _), _| !is_time(*origin));
            first.retain(|(origin, _, _), _| !is_time(*origin));
        }
        let legal = legal_inputs(&mut model);
        let overrun = model.maker.overrun();
        let violated = model.maker.forbidden(&reaction.state, &inputs, never);
        Ok(Encoded { model, next, first, legal, time, violated, overrun })
    }
}

fn why(failed: Failed) -> String {
    match failed {
        Failed::Open(why) => why,
        Failed::Full(full) => full.to_string(),
        Failed::Deeper => "the reset takes too many micro-steps".to_owned(),
    }
}

/// The maximum number of micro-steps in a reaction of the net.
pub(super) fn limit_of(net: &Net) -> u32 {
    match net.settings.evolution {
        Evolution::Single => 1,
        Evolution::Stable { limit } => limit,
    }
}

/// True for counters of time.
pub(super) fn is_time(origin: Origin) -> bool {
    matches!(
        origin,
        Origin::Elapsed(_) | Origin::LastElapsed(_) | Origin::Timer(_) | Origin::ActionTimer(..)
    )
}

/// Checks that an invariant proves a property: no row of any stimulus violates it.
///
/// # Errors
/// The first reason why it does not.
pub fn recheck(
    net: &Valid<Net>,
    limits: &Limits,
    property: &Property,
    invariant: &Invariant,
) -> Result<(), Refused> {
    if Simulator::new(net).is_violated(property) {
        return Err(Refused::NotSafe);
    }
    let never = over_state(net, &property.never)
        .ok_or_else(|| Refused::Unchecked("the assert reads times or mealy outputs".to_owned()))?;
    keeps(net, limits, &never, invariant)
}

/// Checks that an invariant proves that no reaction makes `never` true.
pub(super) fn keeps(
    net: &Net,
    limits: &Limits,
    never: &Expr,
    invariant: &Invariant,
) -> Result<(), Refused> {
    let Invariant { times, micro_steps, clauses } = invariant;
    let mut encoded =
        Encoded::of(net, limits, never, *times, *micro_steps).map_err(Refused::Unchecked)?;
    let bad = encoded.model.aig().or(encoded.violated, encoded.overrun);
    let mut claims = Vec::new();
    for (at, clause) in clauses.iter().enumerate() {
        let mut claim = Claim { now: Vec::new(), then: Vec::new(), is_first: false };
        for (StateBit { origin, element, bit }, value) in clause {
            let key = (*origin, *element, *bit);
            let (Some(lit), Some(next), Some(first)) = (
                encoded.model.state_bits.get(&key),
                encoded.next.get(&key),
                encoded.first.get(&key),
            ) else {
                return Err(Refused::NoSuchBit(at));
            };
            claim.now.push(lit.negate_if(!value));
            claim.then.push(next.negate_if(!value));
            claim.is_first |= first == value;
        }
        claims.push(claim);
    }
    is_kept(encoded.model.aig(), &encoded.legal, bad, &claims, limits.conflicts)
}

/// A clause of an invariant.
pub(super) struct Claim {
    /// Its literals in the state before a reaction.
    pub(super) now: Vec<Lit>,
    /// Its literals in the state after it.
    pub(super) then: Vec<Lit>,
    /// True if the state after reset satisfies it.
    pub(super) is_first: bool,
}

/// Checks that the claims are true after reset and preserved by every legal reaction, and that no legal reaction from a state that satisfies them is bad.
pub(super) fn is_kept(
    aig: &Aig,
    legal: &[Lit],
    bad: Lit,
    claims: &[Claim],
    conflicts: u64,
) -> Result<(), Refused> {
    if let Some(at) = claims.iter().position(|claim| !claim.is_first) {
        return Err(Refused::Reset(at));
    }
    let literals = claims.iter().flat_map(|claim| claim.now.iter().chain(&claim.then));
    let mut roots: Vec<Lit> = literals.copied().collect();
    roots.extend(legal);
    roots.push(bad);
    let mut reaction = Reaction::new(aig, &roots, conflicts);
    legal.iter().for_each(|lit| reaction.require(&[*lit]));
    claims.iter().for_each(|claim| reaction.require(&claim.now));
    match reaction.is_possible(&[bad]) {
        Some(false) => {}
        Some(true) => return Err(Refused::NotSafe),
        None => return Err(Refused::Unchecked("the solver reached its limit".to_owned())),
    }
    for (at, claim) in claims.iter().enumerate() {
        let all_false: Vec<Lit> = claim.then.iter().map(|lit| !*lit).collect();
        match reaction.is_possible(&all_false) {
            Some(false) => {}
            Some(true) => return Err(Refused::NotInductive(at)),
            None => return Err(Refused::Unchecked("the solver reached its limit".to_owned())),
        }
    }
    Ok(())
}

/// One reaction as clauses in a solver.
struct Reaction {
    solver: Solver<Conflicts>,
    vars: Vec<Option<Var>>,
    limit: u64,
}

/// Stops the solver after a number of learnt clauses.
struct Conflicts {
    seen: u64,
    last: u64,
}

impl Callbacks for Conflicts {
    fn on_new_clause(&mut self, _: &[SatLit], kind: ClauseKind) {
        self.seen += u64::from(kind == ClauseKind::Learnt);
    }

    fn stop(&self) -> bool {
        self.seen > self.last
    }
}

impl Reaction {
    /// All nodes below `roots`.
    fn new(aig: &Aig, roots: &[Lit], limit: u64) -> Self {
        let solver = Solver::new(SolverOpts::default(), Conflicts { seen: 0, last: 0 });
        let mut reaction = Reaction { solver, vars: vec![None; aig.len()], limit };
        let mut is_needed = vec![false; aig.len()];
        roots.iter().for_each(|root| is_needed[root.node()] = true);
        // An operand has a lower node than each function built from it.
        for node in (0..aig.len()).rev() {
            if let (true, Some((a, b))) = (is_needed[node], aig.operands(node)) {
                is_needed[a.node()] = true;
                is_needed[b.node()] = true;
            }
        }
        for node in (0..aig.len()).filter(|node| is_needed[*node]) {
            reaction.vars[node] = Some(reaction.solver.new_var_default());
            let own = Lit::of_node(node);
            if node == 0 {
                reaction.require(&[Lit::TRUE]);
            } else if let Some((a, b)) = aig.operands(node) {
                reaction.require(&[!own, a]);
                reaction.require(&[!own, b]);
                reaction.require(&[own, !a, !b]);
            }
        }
        reaction
    }

    fn lit(&self, lit: Lit) -> SatLit {
        match self.vars[lit.node()] {
            Some(var) => SatLit::new(var, !lit.is_negated()),
            None => unreachable!("every node below the roots has a variable"),
        }
    }

    fn require(&mut self, clause: &[Lit]) {
        let mut lits: Vec<SatLit> = clause.iter().map(|lit| self.lit(*lit)).collect();
        self.solver.add_clause_reuse(&mut lits);
    }

    /// Whether all of these can be true at once; `None` if the solver reached its limit.
    fn is_possible(&mut self, all: &[Lit]) -> Option<bool> {
        let lits: Vec<SatLit> = all.iter().map(|lit| self.lit(*lit)).collect();
        let budget = self.solver.cb_mut();
        budget.last = budget.seen + self.limit;
        let answer = self.solver.solve_limited(&lits);
        if answer == lbool::TRUE {
            Some(true)
        } else if answer == lbool::FALSE {
            Some(false)
        } else {
            None
        }
    }
}
