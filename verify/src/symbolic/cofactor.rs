//! Functions under each of several cases: one of some variables is true, the others are false. From one case to the next, only what depends on the two variables
//! that change is evaluated again, so that a thousand cases cost little more than one.

use grafsynth_ir::Gather;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use super::aig::{Aig, Lit, OfNodes};

/// The maximum number of nodes that are evaluated for all cases together, of new nodes, and of pairs of a function and a case.
const MAX_EVALUATED: usize = 4_000_000;
const MAX_NEW: usize = 1_000_000;
const MAX_PAIRS: usize = 4_000_000;

/// The operands of a node: their places in the cone, and whether they are negated.
type Operands = [(usize, bool); 2];

/// What is left of a function: the cases in which it is not the constant false, by number, each with the function in this case.
pub(crate) type Residue = Vec<(usize, Lit)>;

impl Aig {
    /// For each function, what is left of it in these cases: in each case, the variable `active` is true (none of them for [`Lit::FALSE`]), and all others of
    /// `variables` are false. `None` if that needs too much work.
    pub(crate) fn residues(
        &mut self,
        roots: &[Lit],
        variables: &[Lit],
        cases: &[Lit],
    ) -> Option<Vec<Residue>> {
        if roots.len().saturating_mul(cases.len()) > MAX_PAIRS {
            return None;
        }
        let n_before = self.len();
        let cone = self.cone(roots, MAX_EVALUATED)?;
        let mut place: OfNodes<u32> = OfNodes::new(self);
        cone.iter().zip(0..).for_each(|(node, at)| place.insert(*node, at));
        let operands: Vec<Option<Operands>> = cone
            .iter()
            .map(|node| {
                let (a, b) = self.operands(*node)?;
                Some([a, b].map(|lit| (place.get(lit.node()) as usize, lit.is_negated())))
            })
            .collect();
        let users = users_of(&operands);
        let mut now: Vec<Lit> = cone.iter().map(|node| Lit::of_node(*node)).collect();
        let places: BTreeMap<Lit, usize> = now.iter().copied().zip(0..).gather();
        let place_of: BTreeMap<Lit, usize> = variables
            .iter()
            .filter_map(|variable| Some((*variable, *places.get(variable)?)))
            .gather();
        place_of.values().for_each(|at| now[*at] = Lit::FALSE);
        let mut todo = Todo::all(cone.len());
        let mut residues = vec![Residue::new(); roots.len()];
        let mut before = Lit::FALSE;
        let mut n_evaluated = 0;
        for (case, active) in cases.iter().enumerate() {
            for (lit, value) in [(before, Lit::FALSE), (*active, Lit::TRUE)] {
                let Some(at) = place_of.get(&lit) else { continue };
                now[*at] = value;
                todo.push_users(&users[*at], &operands, &now);
            }
            before = *active;
            while let Some(at) = todo.pop() {
                let Some([a, b]) = operands[at] else { continue };
                n_evaluated += 1;
                let value = self.and(now[a.0].negate_if(a.1), now[b.0].negate_if(b.1));
                if value != now[at] {
                    now[at] = value;
                    todo.push_users(&users[at], &operands, &now);
                }
            }
            if n_evaluated > MAX_EVALUATED || self.len() - n_before > MAX_NEW {
                return None;
            }
            for (root, residue) in roots.iter().zip(&mut residues) {
                let own = now[place.get(root.node()) as usize].negate_if(root.is_negated());
                if own != Lit::FALSE {
                    residue.push((case, own));
                }
            }
        }
        Some(residues)
    }
}

/// For each place, the places of which it is an operand.
fn users_of(operands: &[Option<Operands>]) -> Vec<Vec<u32>> {
    let mut users = vec![Vec::new(); operands.len()];
    for (at, own) in (0..).zip(operands) {
        for (below, _) in own.iter().flatten() {
            users[*below].push(at);
        }
    }
    users
}

/// The places that are evaluated next, operands first, each once.
struct Todo {
    heap: BinaryHeap<Reverse<usize>>,
    is_in: Vec<bool>,
}

impl Todo {
    fn all(n: usize) -> Self {
        Todo { heap: (0..n).map(Reverse).collect(), is_in: vec![true; n] }
    }

    /// Adds the users of a node that has changed, except those that stay false because of their other operand; if that one changes too, it adds them.
    fn push_users(&mut self, users: &[u32], operands: &[Option<Operands>], now: &[Lit]) {
        for user in users {
            let at = *user as usize;
            let is_false = |it: &(usize, bool)| now[it.0].negate_if(it.1) == Lit::FALSE;
            let stays = now[at] == Lit::FALSE && operands[at].iter().flatten().any(is_false);
            if !stays && !std::mem::replace(&mut self.is_in[at], true) {
                self.heap.push(Reverse(at));
            }
        }
    }

    fn pop(&mut self) -> Option<usize> {
        let Reverse(at) = self.heap.pop()?;
        self.is_in[at] = false;
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grafsynth_sim::Random;

    /// In each case, what is left of a function is the function with the constants of the case, for random graphs.
    #[test]
    fn residues_are_the_functions_with_constants() {
        let mut random = Random::new(1);
        let mut n_left = 0;
        for _ in 0..40 {
            let mut aig = Aig::new();
            let variables: Vec<Lit> = (0..9).map(|_| aig.variable()).collect();
            let mut all = variables.clone();
            for _ in 0..80 {
                let mut operand = || {
                    let at = random.below(all.len());
                    all[at].negate_if(random.below(2) == 1)
                };
                let (a, b) = (operand(), operand());
                all.push(aig.and(a, b));
            }
            let roots: Vec<Lit> =
                all.iter().rev().take(12).map(|lit| lit.negate_if(random.below(2) == 1)).collect();
            let own = &variables[..6];
            let cases: Vec<Lit> = own.iter().copied().chain([Lit::FALSE]).collect();
            let residues = aig.residues(&roots, own, &cases).expect("a small graph");
            for (root, residue) in roots.iter().zip(residues) {
                for (case, active) in cases.iter().enumerate() {
                    let constants = own.iter().map(|lit| (*lit, Lit::constant(lit == active)));
                    let wanted = aig.substitute(&[*root], &constants.collect())[0];
                    let found = residue.iter().find(|(at, _)| *at == case);
                    let found = found.map_or(Lit::FALSE, |(_, left)| *left);
                    n_left += usize::from(found != Lit::FALSE);
                    // Eight assignments of the other three variables, twice: with 0 and with 1 for the own ones.
                    let words = aig.words(&[found, wanted], |lit| {
                        match variables[6..].iter().position(|other| *other == lit) {
                            Some(at) => [0xaaaa, 0xcccc, 0xf0f0][at],
                            None => 0xff00,
                        }
                    });
                    assert_eq!(words[0] & 0xffff, words[1] & 0xffff, "case {case} of {root:?}");
                }
            }
        }
        assert!(n_left > 500, "{n_left} functions are left");
    }
}
