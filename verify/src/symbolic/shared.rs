//! Questions about one model that share a solver. The functions of a circuit overlap, and so do their invariants: with a solver of its own for each function,
//! most of the time is spent on adding the same clauses again. Functions that were proved equal are clauses for the questions that follow, so each bit of a
//! word is proved with the help of the lower bits.

use std::collections::{BTreeMap, BTreeSet};

use batsat::lbool;
use grafsynth_ir::facts::Facts;

use super::aig::{Aig, Lit};
use super::sweep::Query;
use super::{Model, at_most_one};

/// The maximum number of conflicts of a question; a harder one gets a solver of its own.
const FEW_CONFLICTS: u64 = 200;
/// The number of encoded nodes from which a new solver is begun: each question costs a little for each node.
const ENCODED: usize = 20_000;
/// The maximum number of steps of one component for which all pairs are clauses.
const PAIRED: usize = 512;

/// A solver that knows the invariants of all variables in the questions so far.
pub(super) struct Shared {
    query: Query,
    /// The invariants that it knows, except pairs of steps.
    known: BTreeSet<Vec<Lit>>,
    /// For each component, steps of which it knows that no two are active together.
    exclusive: BTreeMap<u32, BTreeSet<Lit>>,
}

impl Shared {
    pub(super) fn new() -> Self {
        Shared { query: Query::new(), known: BTreeSet::new(), exclusive: BTreeMap::new() }
    }

    /// A point at which this function of these variables is true although the invariants are, as the variables that are 1. The inner `None` means that there is
    /// none, the outer one that the question is hard.
    pub(super) fn satisfy(
        &mut self,
        model: &Model<'_>,
        facts: &Facts,
        function: Lit,
        support: &[Lit],
    ) -> Option<Option<Vec<Lit>>> {
        if self.query.len() > ENCODED {
            *self = Shared::new();
        }
        let aig = &model.maker.aig;
        let exclusive = &mut self.exclusive;
        let (holds, clauses) = model.invariants_with(facts, support, |component, steps, pairs| {
            exclude(exclusive.entry(component).or_default(), steps, pairs);
        });
        for clause in holds.into_iter().map(|lit| vec![lit]).chain(clauses) {
            if self.known.insert(clause.clone()) {
                self.query.assert(aig, &clause);
            }
        }
        self.ask(aig, function, support)
    }

    fn ask(&mut self, aig: &Aig, function: Lit, support: &[Lit]) -> Option<Option<Vec<Lit>>> {
        let answer = self.query.solve(aig, &[function], FEW_CONFLICTS);
        if answer == lbool::TRUE {
            let set = support.iter().copied().filter(|variable| self.query.is_true(*variable));
            return Some(Some(set.collect()));
        }
        if answer != lbool::FALSE {
            return None;
        }
        self.query.assert(aig, &[!function]);
        Some(None)
    }
}

/// Adds clauses such that no two of these steps are active together, unless they are known to be exclusive.
fn exclude(known: &mut BTreeSet<Lit>, steps: &[Lit], pairs: &mut Vec<Vec<Lit>>) {
    let new: Vec<Lit> = steps.iter().copied().filter(|step| !known.contains(step)).collect();
    if known.len() + new.len() > PAIRED {
        // The known steps stay as they are; the pairs of this question are enough for it.
        at_most_one(steps, pairs);
        return;
    }
    for step in new {
        pairs.extend(known.iter().map(|other| vec![!step, !*other]));
        known.insert(step);
    }
}
