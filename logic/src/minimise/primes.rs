//! All prime products of several functions at once, implicitly.
//!
//! ```text
//! upper functions f1 … fm  ─►  g = (f1 + y1)(f2 + y2) … (fm + ym)  ─►  primes of g, as a diagram of sets  ─►  list
//! ```
//! Each output has a tag y; a prime of `g` without the tag of an output is a prime product of that output [Bartee 1961]. The primes come from the
//! recursion of Coudert and Madre [1992]: the primes without a literal of the top input are the primes of the conjunction of both halves; the primes with
//! such a literal are the primes of that half that are not among them. Sets of products are stored as diagrams with three branches per node (negative
//! literal, positive literal, none), so many primes take few nodes.

use super::terms::{Shape, Terms};
use crate::bdd::{Bdd, Ref};
use std::collections::BTreeMap;

/// A set of products: 0 is the empty set, and 1 contains only the product without literals.
type Set = u32;

const EMPTY: Set = 0;
const UNIT: Set = 1;
const LEAF: u32 = u32::MAX;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    level: u32,
    negative: Set,
    positive: Set,
    none: Set,
}

/// Why there is no list of primes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TooMany {
    /// The diagrams exceed their limit.
    Nodes,
    /// The number of primes (saturated) exceeds the limit.
    Primes(u64),
}

struct Sets {
    nodes: Vec<Node>,
    unique: BTreeMap<Node, Set>,
    without: BTreeMap<(Set, Set), Set>,
    limit: usize,
}

impl Sets {
    fn node(&mut self, node: Node) -> Result<Set, TooMany> {
        if node.negative == EMPTY && node.positive == EMPTY {
            return Ok(node.none);
        }
        if let Some(&set) = self.unique.get(&node) {
            return Ok(set);
        }
        if self.nodes.len() >= self.limit {
            return Err(TooMany::Nodes);
        }
        let set = u32::try_from(self.nodes.len()).map_err(|_| TooMany::Nodes)?;
        self.nodes.push(node);
        self.unique.insert(node, set);
        Ok(set)
    }

    /// The products of `a` that are not in `b`. The recursion depth is the number of levels.
    fn without(&mut self, a: Set, b: Set) -> Result<Set, TooMany> {
        if a == EMPTY || a == b {
            return Ok(EMPTY);
        }
        if b == EMPTY {
            return Ok(a);
        }
        let (node_a, node_b) = (self.nodes[a as usize], self.nodes[b as usize]);
        if node_b.level < node_a.level {
            return self.without(a, node_b.none);
        }
        if let Some(&set) = self.without.get(&(a, b)) {
            return Ok(set);
        }
        let set = if node_a.level < node_b.level {
            let none = self.without(node_a.none, b)?;
            self.node(Node { none, ..node_a })?
        } else {
            let negative = self.without(node_a.negative, node_b.negative)?;
            let positive = self.without(node_a.positive, node_b.positive)?;
            let none = self.without(node_a.none, node_b.none)?;
            self.node(Node { level: node_a.level, negative, positive, none })?
        };
        self.without.insert((a, b), set);
        Ok(set)
    }

    fn count(&self, set: Set) -> u64 {
        // The id of a node is larger than those of its branches.
        let mut counts: Vec<u64> = vec![0, 1];
        for node in &self.nodes[2..=(set as usize).max(1)] {
            let of = |set: Set| counts[set as usize];
            counts.push(
                of(node.negative).saturating_add(of(node.positive)).saturating_add(of(node.none)),
            );
        }
        counts[set as usize]
    }
}

struct Search<'a> {
    bdd: &'a mut Bdd,
    sets: Sets,
    primes: BTreeMap<Ref, Set>,
    /// The first level of a tag; all levels from here on are tags.
    first_tag: u32,
}

impl Search<'_> {
    /// The primes of a function. The recursion depth is the number of levels.
    fn primes(&mut self, f: Ref) -> Result<Set, TooMany> {
        let Some(level) = self.bdd.level(f) else {
            return Ok(if f == Ref::TRUE { UNIT } else { EMPTY });
        };
        if let Some(&set) = self.primes.get(&f) {
            return Ok(set);
        }
        let (low, high) = self.bdd.branches(f);
        let set = if level >= self.first_tag {
            // The tag occurs in no negative literal: low implies high.
            let none = self.primes(low)?;
            let positive = self.primes(high)?;
            let positive = self.sets.without(positive, none)?;
            self.sets.node(Node { level, negative: EMPTY, positive, none })?
        } else {
            let both = self.bdd.and(low, high).map_err(|_| TooMany::Nodes)?;
            let none = self.primes(both)?;
            let negative = self.primes(low)?;
            let negative = self.sets.without(negative, none)?;
            let positive = self.primes(high)?;
            let positive = self.sets.without(positive, none)?;
            self.sets.node(Node { level, negative, positive, none })?
        };
        self.primes.insert(f, set);
        Ok(set)
    }

    /// Lists a set. The recursion depth is the number of levels.
    fn list(&self, set: Set, input_of: &[usize], term: &mut Vec<u64>, found: &mut Terms) {
        let shape = found.shape;
        if set == EMPTY {
            return;
        }
        if set == UNIT {
            if shape.n_outputs(term) > 0 {
                found.push(term);
            }
            return;
        }
        let node = self.sets.nodes[set as usize];
        let level = node.level;
        if level >= self.first_tag {
            let output = (level - self.first_tag) as usize;
            self.list(node.none, input_of, term, found);
            shape.remove_output(term, output);
            self.list(node.positive, input_of, term, found);
            shape.add_output(term, output);
        } else {
            let input = input_of[level as usize];
            for (branch, literal) in
                [(node.positive, Some(true)), (node.negative, Some(false)), (node.none, None)]
            {
                shape.set_literal(term, input, literal);
                self.list(branch, input_of, term, found);
            }
        }
    }
}

/// The prime products of these functions, whose inputs have the levels `0..inputs`; `input_of` maps each level to its input.
///
/// # Errors
/// If there are more than `max_primes`, or if the diagrams need more than `max_nodes` nodes.
pub(super) fn all_primes(
    bdd: &mut Bdd,
    upper: &[Ref],
    input_of: &[usize],
    max_primes: usize,
    max_nodes: usize,
) -> Result<Terms, TooMany> {
    let shape = Shape::new(input_of.len(), upper.len());
    let first_tag = u32::try_from(input_of.len()).map_err(|_| TooMany::Nodes)?;
    let mut tagged = Vec::new();
    for (level, &function) in (first_tag..).zip(upper) {
        let tag = bdd.var(level).map_err(|_| TooMany::Nodes)?;
        tagged.push(bdd.or(function, tag).map_err(|_| TooMany::Nodes)?);
    }
    let all = bdd.and_all(tagged).map_err(|_| TooMany::Nodes)?;
    let leaf = |set| Node { level: LEAF, negative: set, positive: set, none: set };
    let sets = Sets {
        nodes: vec![leaf(EMPTY), leaf(UNIT)],
        unique: BTreeMap::new(),
        without: BTreeMap::new(),
        limit: max_nodes,
    };
    let mut search = Search { bdd, sets, primes: BTreeMap::new(), first_tag };
    let set = search.primes(all)?;
    let count = search.sets.count(set);
    if count > max_primes as u64 + 1 {
        return Err(TooMany::Primes(count));
    }
    let mut found = Terms::new(shape);
    let mut term = shape.empty();
    (0..shape.outputs()).for_each(|output| shape.add_output(&mut term, output));
    search.list(set, input_of, &mut term, &mut found);
    Ok(found)
}
