//! From one state before a reaction to a set of such states: the bits that a given result does not depend on are dropped, under the same inputs.
//!
//! First the result is justified from its operands down, which visits only what is needed; then ternary simulation drops bit by bit what is still not needed.

use super::system::{Bit, Cube, System};
use crate::symbolic::aig::Lit;

/// A bound on the nodes that ternary simulation visits for one set; beyond it, the justified bits are kept.
const TERNARY: usize = 1 << 21;

/// The value of a node: known, or unknown because it depends on dropped bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    No,
    Yes,
    Unknown,
}

impl Known {
    fn of(value: bool) -> Known {
        if value { Known::Yes } else { Known::No }
    }

    fn negate_if(self, condition: bool) -> Known {
        match (self, condition) {
            (Known::No, true) | (Known::Yes, false) => Known::Yes,
            (Known::Yes, true) | (Known::No, false) => Known::No,
            (Known::Unknown, _) => Known::Unknown,
        }
    }

    fn and(self, other: Known) -> Known {
        match (self, other) {
            (Known::No, _) | (_, Known::No) => Known::No,
            (Known::Yes, Known::Yes) => Known::Yes,
            (Known::Unknown, _) | (_, Known::Unknown) => Known::Unknown,
        }
    }
}

/// A set of states with inputs under which each of them gives the result.
pub(super) struct Lifted {
    pub(super) cube: Cube,
    /// The nodes of the inputs that are 1.
    pub(super) inputs: Vec<usize>,
}

/// Working memory for one system.
pub(super) struct Lift<'s> {
    system: &'s System,
    values: Vec<Known>,
    costs: Vec<u32>,
    mark: Vec<bool>,
    /// The number of nodes visited so far.
    pub(super) work: u64,
}

impl<'s> Lift<'s> {
    pub(super) fn new(system: &'s System) -> Self {
        let n = system.aig.len();
        let (values, costs) = (vec![Known::No; n], vec![0; n]);
        Lift { system, values, costs, mark: vec![false; n], work: 0 }
    }

    /// The states around one in which all of `results` and the conditions on the inputs are true. `is_one` gives the value of a variable.
    pub(super) fn lift(&mut self, results: &[Lit], is_one: impl Fn(usize) -> bool) -> Lifted {
        let mut roots = results.to_vec();
        roots.extend(&self.system.legal);
        let cone = self.cone(&roots);
        let mut inputs = Vec::new();
        for node in &cone {
            let (value, cost) = match self.system.aig.operands(*node) {
                Some((a, b)) => {
                    let (known, cost) =
                        (self.read(a).and(self.read(b)), (self.cost(a), self.cost(b)));
                    let is_zero = |lit: Lit| self.read(lit) == Known::No;
                    let cost = match (is_zero(a), is_zero(b)) {
                        (true, true) => cost.0.min(cost.1),
                        (true, false) => cost.0,
                        (false, true) => cost.1,
                        (false, false) => cost.0.saturating_add(cost.1),
                    };
                    (known, cost)
                }
                None => {
                    let is_bit = self.system.bit_of(*node).is_some();
                    let value = *node > 0 && is_one(*node);
                    if value && !is_bit {
                        inputs.push(*node);
                    }
                    (Known::of(value), u32::from(is_bit))
                }
            };
            self.values[*node] = value;
            self.costs[*node] = cost;
        }
        let needed = self.justify(&roots);
        let cube = self.drop_bits(&cone, &roots, needed);
        Lifted { cube, inputs }
    }

    fn read(&self, lit: Lit) -> Known {
        self.values[lit.node()].negate_if(lit.is_negated())
    }

    fn cost(&self, lit: Lit) -> u32 {
        self.costs[lit.node()]
    }

    /// The nodes below the roots, operands first.
    fn cone(&mut self, roots: &[Lit]) -> Vec<usize> {
        let mut cone = Vec::new();
        let mut todo: Vec<usize> = roots.iter().map(|root| root.node()).collect();
        while let Some(node) = todo.pop() {
            if std::mem::replace(&mut self.mark[node], true) {
                continue;
            }
            cone.push(node);
            if let Some((a, b)) = self.system.aig.operands(node) {
                todo.extend([a.node(), b.node()]);
            }
        }
        cone.sort_unstable();
        cone.iter().for_each(|node| self.mark[*node] = false);
        self.work += cone.len() as u64;
        cone
    }

    /// Bits whose values, with the inputs, are sufficient for the values of the roots.
    fn justify(&mut self, roots: &[Lit]) -> Vec<usize> {
        let mut needed = Vec::new();
        let mut seen = Vec::new();
        let mut todo: Vec<usize> = roots.iter().map(|root| root.node()).collect();
        while let Some(node) = todo.pop() {
            if std::mem::replace(&mut self.mark[node], true) {
                continue;
            }
            seen.push(node);
            let Some((a, b)) = self.system.aig.operands(node) else {
                needed.extend(self.system.bit_of(node));
                continue;
            };
            if self.values[node] == Known::Yes {
                todo.extend([a.node(), b.node()]);
                continue;
            }
            let weight = |lit: Lit| match self.read(lit) {
                Known::No if self.mark[lit.node()] => 0,
                Known::No => u64::from(self.cost(lit)) + 1,
                Known::Yes | Known::Unknown => u64::MAX,
            };
            todo.push(if weight(a) <= weight(b) { a.node() } else { b.node() });
        }
        seen.iter().for_each(|node| self.mark[*node] = false);
        needed.sort_unstable();
        needed
    }

    /// Drops from the needed bits those without which the roots still have their values.
    fn drop_bits(&mut self, cone: &[usize], roots: &[Lit], needed: Vec<usize>) -> Cube {
        let value = |lift: &Self, at: usize| lift.values[at + 1] == Known::Yes;
        let mut cube: Cube =
            needed.iter().map(|at| Bit { at: *at as u32, value: value(self, *at) }).collect();
        if cube.len().saturating_mul(cone.len()) > TERNARY {
            return cube;
        }
        for node in cone {
            if self.system.bit_of(*node).is_some_and(|at| needed.binary_search(&at).is_err()) {
                self.values[*node] = Known::Unknown;
            }
        }
        for bit in cube.clone() {
            self.values[bit.index() + 1] = Known::Unknown;
            self.simulate(cone);
            if roots.iter().all(|root| self.read(*root) == Known::Yes) {
                cube.retain(|one| *one != bit);
            } else {
                self.values[bit.index() + 1] = Known::of(bit.value);
            }
        }
        cube
    }

    fn simulate(&mut self, cone: &[usize]) {
        self.work += cone.len() as u64 / 4;
        for node in cone {
            if let Some((a, b)) = self.system.aig.operands(*node) {
                self.values[*node] = self.read(a).and(self.read(b));
            }
        }
    }
}
