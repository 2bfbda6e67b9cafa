//! State bits that never change: ternary simulation from reset, with unknown inputs.
//!
//! The simulated set of states only grows, and it contains every reachable state. So a bit that still has its value after reset at the end has it in every
//! reachable state. An example is the last value of an edge whose operand is constant.

use super::aig::{Aig, Lit, OfNodes};

/// The maximum number of nodes that are visited, in all rounds together.
const MAX_VISITED: usize = 20_000_000;

/// A bit of the state: its variable, its value after a reaction, and its value after reset.
pub(super) struct StateBit {
    pub(super) now: Lit,
    pub(super) next: Lit,
    pub(super) first: bool,
}

/// The literals of the state that are true in every reachable state; none if the simulation takes too long.
pub(super) fn stuck(aig: &Aig, bits: &[StateBit]) -> Vec<Lit> {
    let roots: Vec<Lit> = bits.iter().map(|bit| bit.next).collect();
    let Some(cone) = aig.cone(&roots, MAX_VISITED) else { return Vec::new() };
    let mut known: Vec<&StateBit> = bits.iter().collect();
    let mut left = MAX_VISITED;
    loop {
        let Some(rest) = left.checked_sub(cone.len()) else { return Vec::new() };
        left = rest;
        let values = simulate(aig, &cone, &known);
        let n_known = known.len();
        known.retain(|bit| read(&values, bit.next) == Some(bit.first));
        if known.len() == n_known {
            return known.into_iter().map(|bit| bit.now.negate_if(!bit.first)).collect();
        }
    }
}

/// The values of all nodes in a cone if these bits have their values after reset, and all other variables are unknown.
fn simulate(aig: &Aig, cone: &[usize], known: &[&StateBit]) -> OfNodes<Option<bool>> {
    let mut values: OfNodes<Option<bool>> = OfNodes::new(aig);
    let leaves = cone.iter().filter(|node| aig.operands(**node).is_none());
    leaves.for_each(|leaf| values.insert(*leaf, None));
    values.insert(Lit::FALSE.node(), Some(false));
    for bit in known {
        values.insert(bit.now.node(), Some(bit.first != bit.now.is_negated()));
    }
    for node in cone {
        if let Some((a, b)) = aig.operands(*node) {
            let value = match (read(&values, a), read(&values, b)) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (Some(true), Some(true)) => Some(true),
                _ => None,
            };
            values.insert(*node, value);
        }
    }
    values
}

fn read(values: &OfNodes<Option<bool>>, lit: Lit) -> Option<bool> {
    values.get(lit.node()).map(|value| value != lit.is_negated())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_bits_that_can_change_are_unknown() {
        let mut aig = Aig::new();
        let [input, zero, follows, set, loops] = [(); 5].map(|()| aig.variable());
        let gated = aig.and(input, zero);
        let either = aig.or(input, set);
        let bit = |now, next, first| StateBit { now, next, first };
        let bits = [
            bit(zero, gated, false),
            bit(follows, zero, false),
            bit(set, either, false),
            bit(loops, loops, true),
        ];
        assert_eq!(stuck(&aig, &bits), [!zero, !follows, loops]);
        // A bit that follows one that starts elsewhere is not stuck.
        let bits = [bit(zero, zero, true), bit(follows, zero, false)];
        assert_eq!(stuck(&aig, &bits), [zero]);
    }
}
