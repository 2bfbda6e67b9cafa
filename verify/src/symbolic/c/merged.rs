//! Questions about large functions, answered together. The reaction of the net and that of the C compute the same values in similar steps, for example micro-step
//! by micro-step: nodes that have equal values in random runs are proved equal and merged, from the variables up, so that each query is small (module `sweep`).

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::net::Evolution;
use grafsynth_sim::Random;

use super::Induction;
use super::attempt::Attempt;
use super::question::Check;
use crate::limits::Limits;
use crate::symbolic::aig::{Lit, word_of};
use crate::symbolic::sweep::{Answer, Sweep};

/// The number of reactions in each random run; 64 runs are made at once.
const ROUNDS: usize = 48;
/// The conflicts of one question; the effort for all of them is a multiple of it.
const CONFLICTS: u64 = 10_000;
/// The maximum number of assumptions.
const MAX_ASSUMED: usize = 50_000;

/// 64 assignments of variables.
type Pattern = BTreeMap<Lit, u64>;

/// A variable of the state, with its value after a reaction and after the reset.
struct Register {
    variable: Lit,
    next: Lit,
    first: bool,
}

impl Attempt<'_> {
    /// Proves that the conditions of checks are never true. Returns the checks for which it does not, which are all of them if a limit is reached early.
    pub(super) fn unproved(&mut self, mut checks: Vec<Check>, total: &mut Induction) -> Vec<Check> {
        if let Some(longer) = self.longer() {
            for check in &mut checks {
                check.broken = self.aig().and(check.broken, !longer);
            }
        }
        let roots: Vec<Lit> = checks.iter().map(|check| check.broken).collect();
        let Some(support) = self.program.aig.support(&roots, usize::MAX) else { return checks };
        let (holds, clauses) = self.with_model(|this| this.assumptions_about(&support));
        self.unproved_if(checks, (holds, clauses), total)
    }

    /// Like [`Attempt::unproved`], where these literals and clauses are true.
    pub(super) fn unproved_if(
        &mut self,
        checks: Vec<Check>,
        (holds, clauses): (Vec<Lit>, Vec<Vec<Lit>>),
        total: &mut Induction,
    ) -> Vec<Check> {
        if clauses.len() > MAX_ASSUMED {
            return checks;
        }
        let mut assumed = holds;
        for clause in clauses {
            assumed.push(self.aig().or_all(clause));
        }
        let mut seen = BTreeSet::new();
        assumed.retain(|lit| *lit != Lit::TRUE && seen.insert(*lit));
        let roots: Vec<Lit> =
            checks.iter().map(|check| check.broken).chain(assumed.iter().copied()).collect();
        let Some(support) = self.program.aig.support(&roots, usize::MAX) else { return checks };
        let Some(registers) = self.registers() else { return checks };
        let patterns = self.patterns(&support, &assumed, &registers);
        let limits = Limits { conflicts: CONFLICTS, ..self.of.limits.clone() };
        let aig = &self.program.aig;
        let Some(mut sweep) = Sweep::new(aig, &assumed, &patterns, &limits) else { return checks };
        let mut unproved = Vec::new();
        for check in checks {
            if !matches!(sweep.equal(check.broken, Lit::FALSE), Answer::Equal) {
                unproved.push(check);
            } else if check.broken == Lit::FALSE {
                total.same += 1;
            } else {
                total.add_solved(&check);
            }
        }
        unproved
    }

    /// The condition that the reaction takes more micro-steps than are proved to be possible; `None` if no such number is proved.
    fn longer(&self) -> Option<Lit> {
        let maker = &self.model.maker;
        let is_single = self.of.net.settings.evolution == Evolution::Single;
        if is_single || maker.may_fault {
            return None;
        }
        maker.more.get(maker.depth as usize).copied()
    }

    /// The variables of the state. They only guide the search, so one that is missing does no harm.
    fn registers(&mut self) -> Option<Vec<Register>> {
        let net = self.of.net;
        let next = self.next.clone()?;
        let (next, first) = self.with_model(|this| {
            let maker = &mut this.model.maker;
            let shape = maker.shape.clone();
            let next = shape.bits(net, &mut maker.aig, &next);
            let first = maker.reset().ok()?.state;
            Some((next, shape.bits(net, &mut maker.aig, &first)))
        })?;
        let mut all = Vec::new();
        for (key, variable) in &self.model.state_bits {
            let Some(next) = next.get(key) else { continue };
            let first = first.get(key).and_then(|lit| lit.as_constant()).unwrap_or(false);
            all.push(Register { variable: *variable, next: *next, first });
        }
        for (bits, next) in &self.next_times {
            let each = bits.iter().enumerate();
            all.extend(each.map(|(at, variable)| Register {
                variable: *variable,
                next: next.bit(at),
                first: false,
            }));
        }
        Some(all)
    }

    /// The assignments of random runs from the reset.
    fn patterns(&self, support: &[Lit], assumed: &[Lit], registers: &[Register]) -> Vec<Pattern> {
        let aig = &self.program.aig;
        let mut random = Random::new(1);
        let reset = |one: &Register| if one.first { !0 } else { 0 };
        let mut state: Vec<u64> = registers.iter().map(reset).collect();
        let mut all = Vec::new();
        for _ in 0..ROUNDS {
            let mut pattern = self.row(support, &mut random);
            pattern.extend(registers.iter().map(|one| one.variable).zip(state.iter().copied()));
            let Some(words) = aig.legal_words(&mut pattern, assumed) else { continue };
            // Some runs start again.
            let restart = (0..4).fold(!0, |all, _| all & random.bits());
            for (own, one) in state.iter_mut().zip(registers) {
                *own = word_of(&words, one.next) & !restart | reset(one) & restart;
            }
            all.push(pattern);
        }
        all
    }

    /// A random row for each run: few events, and mostly few ticks.
    fn row(&self, support: &[Lit], random: &mut Random) -> Pattern {
        let mut row: Pattern = support.iter().map(|lit| (*lit, random.bits())).gather();
        for bit in &self.dt_bits {
            let rare = random.bits() & random.bits() & random.bits();
            row.insert(*bit, rare);
        }
        if let Some(first) = self.dt_bits.first() {
            row.insert(*first, random.bits());
        }
        let mut free = !0;
        for event in &self.model.events {
            let word = random.bits() & random.bits() & free;
            free &= !word;
            row.insert(*event, word);
        }
        row
    }
}
