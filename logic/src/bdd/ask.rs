//! Queries about one function that create no node: size, support, values, number of satisfying assignments.

use super::{Bdd, LEAF, Ref};

impl Bdd {
    /// The inner nodes of `f` including its root, in ascending order.
    pub(super) fn reached(&self, f: Ref) -> Vec<Ref> {
        let mut seen = std::collections::BTreeSet::new();
        let mut open = vec![f];
        while let Some(next) = open.pop() {
            if !next.is_const() && seen.insert(next) {
                let node = self.nodes[next.0 as usize];
                open.push(node.low);
                open.push(node.high);
            }
        }
        seen.into_iter().collect()
    }

    /// The number of inner nodes of `f`.
    #[must_use]
    pub fn size(&self, f: Ref) -> usize {
        self.reached(f).len()
    }

    /// The levels that `f` depends on, ascending.
    #[must_use]
    pub fn support(&self, f: Ref) -> Vec<u32> {
        let mut levels: Vec<u32> =
            self.reached(f).into_iter().map(|node| self.nodes[node.0 as usize].level).collect();
        levels.sort_unstable();
        levels.dedup();
        levels
    }

    /// The value of `f` if the variable of each level has the value `value(level)`.
    pub fn eval(&self, f: Ref, mut value: impl FnMut(u32) -> bool) -> bool {
        let mut at = f;
        while !at.is_const() {
            let node = self.nodes[at.0 as usize];
            at = if value(node.level) { node.high } else { node.low };
        }
        at == Ref::TRUE
    }

    /// An assignment that makes `f` true, with 0 preferred, for the variables on one path; the others are free. `None` if `f` is never true.
    #[must_use]
    pub fn any_sat(&self, f: Ref) -> Option<Vec<(u32, bool)>> {
        if f == Ref::FALSE {
            return None;
        }
        let mut path = Vec::new();
        let mut at = f;
        while !at.is_const() {
            let node = self.nodes[at.0 as usize];
            let value = node.low == Ref::FALSE;
            path.push((node.level, value));
            at = if value { node.high } else { node.low };
        }
        Some(path)
    }

    /// The number of assignments to the variables of `levels` that make `f` true (`levels` is ascending and contains the support of `f`); `u128::MAX`
    /// means that number or more.
    #[must_use]
    pub fn sat_count(&self, f: Ref, levels: &[u32]) -> u128 {
        let rank = |level: u32| {
            if level == LEAF { levels.len() } else { levels.partition_point(|&l| l < level) }
        };
        let scaled = |count: u128, by: usize| {
            if count == 0 {
                0
            } else if by < 128 && count.leading_zeros() as usize > by {
                count << by
            } else {
                u128::MAX
            }
        };
        let mut counts: Vec<(Ref, u128)> = Vec::new();
        let count_of = |counts: &[(Ref, u128)], child: Ref| match child {
            Ref::FALSE => 0,
            Ref::TRUE => 1,
            inner => {
                counts.binary_search_by_key(&inner, |entry| entry.0).map_or(0, |at| counts[at].1)
            }
        };
        for node_ref in self.reached(f) {
            let node = self.nodes[node_ref.0 as usize];
            let own = rank(node.level);
            let of = |child: Ref| {
                let gap = rank(self.nodes[child.0 as usize].level) - own - 1;
                scaled(count_of(&counts, child), gap)
            };
            let count = of(node.low).saturating_add(of(node.high));
            counts.push((node_ref, count));
        }
        scaled(count_of(&counts, f), rank(self.nodes[f.0 as usize].level))
    }

    /// True if `f` is true for all assignments with these (level, value) pairs; pairs ascending by level.
    #[must_use]
    pub fn covers_cube(&self, f: Ref, cube: &[(u32, bool)]) -> bool {
        let mut seen = std::collections::BTreeSet::new();
        let mut open = vec![f];
        while let Some(next) = open.pop() {
            if next == Ref::FALSE {
                return false;
            }
            if next == Ref::TRUE || !seen.insert(next) {
                continue;
            }
            let node = self.nodes[next.0 as usize];
            match cube.binary_search_by_key(&node.level, |pair| pair.0) {
                Ok(at) => open.push(if cube[at].1 { node.high } else { node.low }),
                Err(_) => open.extend([node.low, node.high]),
            }
        }
        true
    }
}
