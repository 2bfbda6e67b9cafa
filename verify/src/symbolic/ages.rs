//! Ages: which of two steps was activated first. The steps of a chart are a total order by age.
//!
//! The state has the order of only those pairs that compete. If `a` competes with `c` and `d`, and `b` too, no three of the four are compared with each other, so
//! triangles alone do not exclude that `a` is older than `c`, `c` than `b`, `b` than `d`, and `d` than `a`.

use std::collections::BTreeSet;

use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;
use itertools::Itertools as _;
use petgraph::unionfind::UnionFind;

use super::Model;
use super::aig::Lit;

/// The maximum number of steps whose ages are assumed to be a total order: there are two clauses for each three of them.
const MAX_ORDERED: usize = 40;
/// The maximum number of such steps if variables are needed for some pairs.
const MAX_COMPLETED: usize = 24;

impl Model<'_> {
    /// Adds the assumption that the ages of the steps in this support are a total order, as far as triangles of pairs of the state say it.
    pub(super) fn order_of_ages(&self, support: &[Lit], clauses: &mut Vec<Vec<Lit>>) {
        let steps = self.aged(support);
        if steps.len() <= MAX_ORDERED {
            self.triangles(&steps.into_iter().collect_vec(), clauses);
        }
    }

    /// Adds the assumption that the ages are a total order, with a variable for each pair whose order is not part of the state. Such variables are for
    /// questions whether a point exists, not for clauses about the state alone.
    pub(super) fn complete_order_of_ages(&mut self, support: &[Lit], clauses: &mut Vec<Vec<Lit>>) {
        for steps in self.compared(&self.aged(support)) {
            let pairs = steps.iter().array_combinations();
            let lacking = pairs.filter(|[a, b]| !self.is_compared(**a, **b)).collect_vec();
            if lacking.is_empty() || steps.len() > MAX_COMPLETED {
                continue;
            }
            for [a, b] in lacking {
                if !self.orders.contains_key(&(*a, *b)) {
                    let order = self.aig().variable();
                    self.orders.insert((*a, *b), order);
                }
            }
            self.triangles(&steps, clauses);
        }
    }

    /// The steps whose ages are compared by bits of the state in this support.
    fn aged(&self, support: &[Lit]) -> BTreeSet<StepId> {
        let mut steps = BTreeSet::new();
        for lit in support {
            if let Some((Origin::Older(a, b), _, _)) = self.name_of.get(lit) {
                steps.extend([*a, *b]);
            }
        }
        steps
    }

    /// These steps, divided into sets whose ages are compared directly or through other steps of the set; each in the order of declaration.
    fn compared(&self, steps: &BTreeSet<StepId>) -> Vec<Vec<StepId>> {
        let mut sets: UnionFind<usize> = UnionFind::new(steps.len());
        for [(at, a), (other, b)] in steps.iter().enumerate().array_combinations() {
            if self.is_compared(*a, *b) {
                sets.union(at, other);
            }
        }
        let set_of = steps.iter().enumerate().map(|(at, step)| (sets.find(at), *step));
        set_of.into_group_map().into_values().sorted().collect()
    }

    /// True if the state has the order of two steps, the lower one first.
    fn is_compared(&self, a: StepId, b: StepId) -> bool {
        self.state_bits.contains_key(&(Origin::Older(a, b), 0, 0))
    }

    /// The literal that step `a` is older than step `b`, the lower one first, if it is a variable.
    fn older(&self, a: StepId, b: StepId) -> Option<Lit> {
        let state = self.state_bits.get(&(Origin::Older(a, b), 0, 0));
        state.or_else(|| self.orders.get(&(a, b))).copied()
    }

    fn triangles(&self, steps: &[StepId], clauses: &mut Vec<Vec<Lit>>) {
        for [a, b, c] in steps.iter().array_combinations() {
            if let (Some(ab), Some(bc), Some(ac)) =
                (self.older(*a, *b), self.older(*b, *c), self.older(*a, *c))
            {
                clauses.push(vec![!ab, !bc, ac]);
                clauses.push(vec![ab, bc, !ac]);
            }
        }
    }
}
