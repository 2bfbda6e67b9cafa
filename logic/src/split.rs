//! Splits wide functions into narrow ones with buried nodes.
//!
//! A sum of two integers has exponentially many products in its upper bits, although each full adder has only a few. The graph of a circuit contains
//! these parts, so a function without a sum of acceptable size is cut where its sum becomes too wide: the node there becomes a separate signal, a
//! *buried node*, with a combinational function, and its readers read that signal.
//!
//! ```text
//! next = (big one) & x | ..          n1 = one part of it        (at most `width` products, in one polarity at least)
//!                              =>    n2 = a part that reads n1
//!                                    next = n2 & x | ..
//! ```
//! The pass goes through the graph once, operands first, and stores for each node the sums of the node and of its complement over the signals below
//! it, if they are no wider than `width`. If both would be wider, the operand with the widest sum is cut first; a junction of many operands is
//! divided into groups. A node whose operands are all cut has one or two products, so the pass always ends.
//!
//! A buried node costs a macrocell and one more pass through the array: [`Split::depth`] counts those.

use crate::build::{Builder, for_each_operand, map_operands, needed};
use crate::node_bdds::Var;
use grafsynth_ir::Gather;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{Logic, Node, NodeId, PinInput, PinInputId, PinRole};
use grafsynth_ir::net::Meta;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// A function that may be too wide for one sum.
#[derive(Debug, Clone)]
pub struct Wide {
    /// The node of the function.
    pub node: NodeId,
    /// The required polarity of the sum; `None` if either is allowed.
    pub polarity: Option<bool>,
    /// The base name of buried nodes without their own name: the signal that the function belongs to.
    pub name: String,
    /// Source location of the declaration of that signal.
    pub meta: Meta,
}

/// A buried node.
#[derive(Debug, Clone)]
pub struct Buried {
    /// The input of [`Split::logic`] through which other functions read it; it comes after the inputs of the circuit.
    pub input: PinInputId,
    /// The node's function, over the inputs, flip-flops and other buried nodes.
    pub value: NodeId,
    /// A sum of products for the function, not yet minimised.
    pub sum: NarrowSum,
    /// The name of the buried node: that of the function in the source, or of the signal to whose function the node belongs.
    pub name: String,
    /// True if the buried node is the complete function of that name, not a part of it.
    pub is_whole: bool,
    /// Source location, comment and tags of the object with that name.
    pub meta: Meta,
}

/// A circuit with buried nodes.
#[derive(Debug, Clone)]
pub struct Split {
    /// The circuit's nodes, followed by the cut functions. Its inputs are those of the circuit, followed by one for each buried node. Its flip-flops
    /// and outputs still have their original functions; the cut functions are in [`Split::wide`].
    pub logic: Logic,
    /// The buried nodes; each reads only earlier ones.
    pub nodes: Vec<Buried>,
    /// For each requested function, in order: the new node and a sum of products for it, not yet minimised.
    pub wide: Vec<(NodeId, NarrowSum)>,
    /// The longest chain of buried nodes: the number of additional passes through the array.
    pub depth: usize,
}

/// A sum of products that is narrow enough, as the search for cuts found it. It is used if a decision diagram that could give a better sum is too large.
#[derive(Debug, Clone, Default)]
pub struct NarrowSum {
    /// True if the sum represents the complement of the function.
    pub is_complemented: bool,
    /// The products.
    pub products: Vec<crate::minimise::Product>,
}

/// A product of literals over leaves, sorted.
type Product = Vec<(NodeId, bool)>;
/// A sum in which no product contains another one.
type Sum = Rc<Vec<Product>>;

/// The sums of a node and of its complement; `None` for a sum that is too wide.
#[derive(Debug, Clone, Default)]
struct Local {
    sums: [Option<Sum>; 2],
}

impl Local {
    fn leaf(node: NodeId) -> Self {
        Local { sums: [false, true].map(|value| Some(Rc::new(vec![vec![(node, value)]]))) }
    }

    fn constant(value: bool) -> Self {
        let sum =
            |is_true: bool| Some(Rc::new(if is_true { vec![Vec::new()] } else { Vec::new() }));
        Local { sums: [sum(!value), sum(value)] }
    }

    fn side(&self, value: bool) -> Option<&Sum> {
        self.sums[usize::from(value)].as_ref()
    }

    fn is_known(&self) -> bool {
        self.sums.iter().any(Option::is_some)
    }

    fn is_literal(&self) -> bool {
        self.sums.iter().all(|sum| {
            let sum = sum.as_deref();
            sum.is_some_and(|sum| sum.len() <= 1 && sum.iter().all(|product| product.len() <= 1))
        })
    }

    /// The products that a cut here saves in the functions above, in both polarities; a sum that is too wide counts most.
    fn weight(&self, width: usize) -> usize {
        self.sums.iter().map(|sum| sum.as_ref().map_or(4 * width, |sum| sum.len())).sum()
    }
}

/// Cuts these functions so that each is a sum of at most `width` products (2 or more) in the requested polarity, and buried nodes in either.
#[must_use]
pub fn split(logic: &Logic, wide: &[Wide], width: usize) -> Split {
    let n_inputs = logic.inputs.len();
    let mut cutter = Cutter {
        builder: Builder::resume(logic.clone()),
        width: width.max(2),
        locals: BTreeMap::new(),
        images: BTreeMap::new(),
        nodes: Vec::new(),
        named: logic
            .wires
            .iter()
            .map(|wire| (wire.node, (wire.name.clone(), wire.meta.clone())))
            .gather(),
        owners: owners(logic, wide),
        wide,
        at: None,
    };
    let cone = needed(logic, wide.iter().map(|function| function.node));
    for (id, node) in logic.nodes.iter() {
        if cone[id] {
            cutter.at = Some(id);
            cutter.visit(id, node);
        }
    }
    let mut roots = Vec::with_capacity(wide.len());
    for function in wide {
        let fits = |side| cutter.locals[&function.node].side(side).is_some();
        if !function.polarity.map_or_else(|| fits(true) || fits(false), fits) {
            cutter.at = Some(function.node);
            cutter.cut(function.node);
        }
        let sum = cutter.narrow(&cutter.locals[&function.node], function.polarity);
        roots.push((cutter.images[&function.node], sum));
    }
    let Cutter { builder, nodes, .. } = cutter;
    finish(builder, nodes, roots, n_inputs)
}

/// For each node, the first of the functions that need it.
fn owners(logic: &Logic, wide: &[Wide]) -> IdMap<Node, Option<usize>> {
    let mut owners: IdMap<Node, Option<usize>> = IdMap::filled(&logic.nodes, None);
    for (index, function) in wide.iter().enumerate().rev() {
        owners[function.node] = Some(index);
    }
    for (id, node) in logic.nodes.iter().rev() {
        if let Some(owner) = owners[id] {
            for_each_operand(node, |operand| {
                if owners[operand].is_none_or(|known| known > owner) {
                    owners[operand] = Some(owner);
                }
            });
        }
    }
    owners
}

/// Drops unused buried nodes, and measures the longest chain.
fn finish(
    mut builder: Builder,
    nodes: Vec<Buried>,
    roots: Vec<(NodeId, NarrowSum)>,
    n_inputs: usize,
) -> Split {
    let logic = &builder.logic;
    let reads = |value: NodeId| -> Vec<usize> {
        let (mut open, mut seen, mut buried) = (vec![value], BTreeSet::new(), Vec::new());
        while let Some(next) = open.pop() {
            if !seen.insert(next) {
                continue;
            }
            if let Node::Input(input) = logic.nodes[next] {
                buried.extend(input.index().checked_sub(n_inputs));
            }
            for_each_operand(&logic.nodes[next], |operand| open.push(operand));
        }
        buried
    };
    let mut is_read = vec![false; nodes.len()];
    for (root, _) in &roots {
        reads(*root).into_iter().for_each(|index| is_read[index] = true);
    }
    let mut below: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for index in (0..nodes.len()).rev() {
        if is_read[index] {
            below[index] = reads(nodes[index].value);
            below[index].iter().for_each(|&index| is_read[index] = true);
        }
    }
    let mut depths = vec![0; nodes.len()];
    for index in 0..nodes.len() {
        depths[index] = 1 + below[index].iter().map(|&below| depths[below]).max().unwrap_or(0);
    }
    let depth = (0..nodes.len()).filter(|&i| is_read[i]).map(|i| depths[i]).max().unwrap_or(0);
    let mut kept = Vec::new();
    for (node, _) in nodes.into_iter().zip(&is_read).filter(|(_, is_read)| **is_read) {
        kept.push(node);
    }
    Split { logic: std::mem::take(&mut builder.logic), nodes: kept, wide: roots, depth }
}

struct Cutter<'a> {
    builder: Builder,
    width: usize,
    /// The sums of each node of the original circuit, over leaves of the new circuit.
    locals: BTreeMap<NodeId, Local>,
    /// The node of the new circuit for each original node: its function, or the input for its buried node.
    images: BTreeMap<NodeId, NodeId>,
    nodes: Vec<Buried>,
    named: BTreeMap<NodeId, (String, Meta)>,
    owners: IdMap<Node, Option<usize>>,
    wide: &'a [Wide],
    /// The current node, for names.
    at: Option<NodeId>,
}

impl Cutter<'_> {
    fn visit(&mut self, id: NodeId, node: &Node) {
        loop {
            let local = self.local(id, node);
            if local.is_known() {
                let image = map_operands(node, |operand| self.images[&operand]);
                let image = self.builder.put(image);
                self.images.insert(id, image);
                self.locals.insert(id, local);
                return;
            }
            match node {
                Node::And(all) | Node::Or(all) => {
                    self.junction(id, all, matches!(node, Node::And(_)));
                    return;
                }
                Node::Not(_) | Node::Xor(..) | Node::Mux(..) => {
                    let mut widest: Option<(usize, NodeId)> = None;
                    for_each_operand(node, |operand| {
                        let local = &self.locals[&operand];
                        let weight = local.weight(self.width);
                        if !local.is_literal() && widest.is_none_or(|(most, _)| weight > most) {
                            widest = Some((weight, operand));
                        }
                    });
                    match widest {
                        Some((_, operand)) => self.cut(operand),
                        None => unreachable!("over literals every gate has at most two products"),
                    }
                }
                Node::Const(_) | Node::Input(_) | Node::Flop(_) => {
                    unreachable!("a leaf has one product")
                }
            }
        }
    }

    /// The sums of a node, computed from those of its operands.
    fn local(&self, id: NodeId, node: &Node) -> Local {
        let of = |operand: &NodeId| &self.locals[operand];
        match node {
            Node::Const(value) => Local::constant(*value),
            Node::Input(_) | Node::Flop(_) => Local::leaf(id),
            Node::Not(a) => {
                let [off, on] = of(a).sums.clone();
                Local { sums: [on, off] }
            }
            Node::And(all) | Node::Or(all) => {
                let is_and = matches!(node, Node::And(_));
                let all: Vec<&Local> = all.iter().map(of).collect();
                let (product, sum) = (self.all_of(&all, is_and), self.any_of(&all, !is_and));
                Local { sums: if is_and { [sum, product] } else { [product, sum] } }
            }
            Node::Xor(a, b) => {
                let (a, b) = (of(a), of(b));
                let pairs = |value: bool| {
                    let one = self.both(a.side(true)?, b.side(!value)?)?;
                    let other = self.both(a.side(false)?, b.side(value)?)?;
                    self.either(&one, &other)
                };
                Local { sums: [pairs(false), pairs(true)] }
            }
            Node::Mux(c, a, b) => {
                let (c, a, b) = (of(c), of(a), of(b));
                let chosen = |value: bool| {
                    let then = self.both(c.side(true)?, a.side(value)?)?;
                    let otherwise = self.both(c.side(false)?, b.side(value)?)?;
                    self.either(&then, &otherwise)
                };
                Local { sums: [chosen(false), chosen(true)] }
            }
        }
    }

    fn all_of(&self, all: &[&Local], side: bool) -> Option<Sum> {
        let mut product: Sum = Rc::new(vec![Vec::new()]);
        for local in all {
            product = self.both(&product, local.side(side)?)?;
        }
        Some(product)
    }

    fn any_of(&self, all: &[&Local], side: bool) -> Option<Sum> {
        let mut sum = Vec::new();
        for local in all {
            sum.extend(local.side(side)?.iter().cloned());
            if sum.len() > 4 * self.width {
                sum = self.short(sum)?.to_vec();
            }
        }
        self.short(sum)
    }

    fn either(&self, a: &Sum, b: &Sum) -> Option<Sum> {
        self.short(a.iter().chain(b.iter()).cloned().collect())
    }

    fn both(&self, a: &Sum, b: &Sum) -> Option<Sum> {
        let mut sum = Vec::new();
        for one in a.iter() {
            sum.extend(b.iter().filter_map(|other| meet(one, other)));
        }
        self.short(sum)
    }

    /// Removes products that others contain and merges pairs that differ only in one literal's polarity; `None` if the sum remains too wide.
    ///
    /// The work is quadratic in the products, so a sum that is far too wide is abandoned at once.
    fn short(&self, mut sum: Vec<Product>) -> Option<Sum> {
        loop {
            if sum.len() > 8 * self.width {
                return None;
            }
            sum.sort_by(|a, b| a.len().cmp(&b.len()).then_with(|| a.cmp(b)));
            sum.dedup();
            let mut kept: Vec<Product> = Vec::with_capacity(sum.len());
            for product in sum {
                if !kept.iter().any(|wider| contains(wider, &product)) {
                    kept.push(product);
                }
            }
            let merged = (0..kept.len()).find_map(|i| {
                (i + 1..kept.len()).find_map(|j| Some((i, j, merge(&kept[i], &kept[j])?)))
            });
            match merged {
                Some((i, j, product)) => {
                    kept.swap_remove(j);
                    kept[i] = product;
                    sum = kept;
                }
                None => return (kept.len() <= self.width).then(|| Rc::new(kept)),
            }
        }
    }

    /// The shorter of the node's sums that exist and have an allowed polarity.
    fn narrow(&self, local: &Local, polarity: Option<bool>) -> NarrowSum {
        let var = |leaf: NodeId| match self.builder.logic.nodes[leaf] {
            Node::Input(input) => Var::Input(input),
            Node::Flop(flop) => Var::Flop(flop),
            _ => unreachable!("leaves are inputs and flip-flops"),
        };
        [true, false]
            .into_iter()
            .filter(|side| polarity.is_none_or(|wanted| wanted == *side))
            .filter_map(|side| Some((side, local.side(side)?)))
            .min_by_key(|(_, sum)| sum.len())
            .map(|(side, sum)| NarrowSum {
                is_complemented: !side,
                products: sum
                    .iter()
                    .map(|product| {
                        product.iter().map(|(leaf, value)| (var(*leaf), *value)).collect()
                    })
                    .collect(),
            })
            .unwrap_or_default()
    }

    /// Makes a node a separate signal.
    fn cut(&mut self, id: NodeId) {
        let value = self.images[&id];
        let named = self.named.get(&id).cloned();
        let sum = self.narrow(&self.locals[&id], None);
        let leaf = self.bury(value, sum, named);
        self.images.insert(id, leaf);
        self.locals.insert(id, Local::leaf(leaf));
    }

    fn bury(&mut self, value: NodeId, sum: NarrowSum, named: Option<(String, Meta)>) -> NodeId {
        let is_whole = named.is_some();
        let (name, meta) = named.unwrap_or_else(|| {
            let owner = self.at.and_then(|at| self.owners[at]).and_then(|at| self.wide.get(at));
            owner.map(|owner| (owner.name.clone(), owner.meta.clone())).unwrap_or_default()
        });
        let input = self.builder.logic.inputs.push(PinInput {
            name: name.clone(),
            role: PinRole::Unknown,
            meta: meta.clone(),
        });
        self.nodes.push(Buried { input, value, sum, name, is_whole, meta });
        self.builder.input(input)
    }

    /// Splits a junction that is too wide both as a sum and as a product: groups its operands, each group a buried node, until one level is narrow enough.
    fn junction(&mut self, id: NodeId, all: &[NodeId], is_and: bool) {
        // A wide operand becomes a signal. An `and` of sums is the complement of a sum of their complements.
        for operand in all {
            let local = &self.locals[operand];
            if local.side(!is_and).is_none_or(|sum| 2 * sum.len() > self.width) {
                self.cut(*operand);
            }
        }
        let mut level: Vec<(NodeId, Local)> = all
            .iter()
            .map(|operand| (self.images[operand], self.locals[operand].clone()))
            .collect();
        loop {
            let locals: Vec<&Local> = level.iter().map(|(_, local)| local).collect();
            let (product, sum) = (self.all_of(&locals, is_and), self.any_of(&locals, !is_and));
            let local = Local { sums: if is_and { [sum, product] } else { [product, sum] } };
            let operands: Vec<NodeId> = level.iter().map(|(image, _)| *image).collect();
            if local.is_known() {
                let image = self.gate(&operands, is_and);
                self.images.insert(id, image);
                self.locals.insert(id, local);
                return;
            }
            let mut groups: Vec<(Vec<(NodeId, Local)>, usize)> = Vec::new();
            for (image, local) in level {
                let n_products = local.side(!is_and).map_or(1, |sum| sum.len());
                match groups.last_mut() {
                    Some((members, count)) if *count + n_products <= self.width => {
                        members.push((image, local));
                        *count += n_products;
                    }
                    Some(_) | None => groups.push((vec![(image, local)], n_products)),
                }
            }
            level = Vec::with_capacity(groups.len());
            for (members, _) in groups {
                match &members[..] {
                    [(_, local)] if local.is_literal() => level.extend(members),
                    _ => {
                        let images: Vec<NodeId> = members.iter().map(|(image, _)| *image).collect();
                        let locals: Vec<&Local> = members.iter().map(|(_, local)| local).collect();
                        let sum = Some(self.any_of(&locals, !is_and).unwrap_or_default());
                        let mut sums = [None, None];
                        sums[usize::from(!is_and)] = sum;
                        let sum = self.narrow(&Local { sums }, None);
                        let value = self.gate(&images, is_and);
                        let leaf = self.bury(value, sum, None);
                        level.push((leaf, Local::leaf(leaf)));
                    }
                }
            }
        }
    }

    fn gate(&mut self, operands: &[NodeId], is_and: bool) -> NodeId {
        if is_and {
            self.builder.and(operands.iter().copied())
        } else {
            self.builder.or(operands.iter().copied())
        }
    }
}

/// The product of two products; `None` if they contradict each other.
fn meet(a: &Product, b: &Product) -> Option<Product> {
    let mut product = Vec::with_capacity(a.len() + b.len());
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        match (a.get(i), b.get(j)) {
            (Some(x), Some(y)) if x.0 == y.0 => {
                if x.1 != y.1 {
                    return None;
                }
                product.push(*x);
                i += 1;
                j += 1;
            }
            (Some(x), Some(y)) if x.0 < y.0 => {
                product.push(*x);
                i += 1;
            }
            (Some(x), None) => {
                product.push(*x);
                i += 1;
            }
            (Some(_) | None, Some(y)) => {
                product.push(*y);
                j += 1;
            }
            (None, None) => break,
        }
    }
    Some(product)
}

/// True if every literal of the first is a literal of the second.
fn contains(wider: &Product, product: &Product) -> bool {
    wider.iter().all(|literal| product.binary_search(literal).is_ok())
}

/// Merges two products that differ only in the polarity of one literal.
fn merge(a: &Product, b: &Product) -> Option<Product> {
    if a.len() != b.len() || a.iter().zip(b).any(|(x, y)| x.0 != y.0) {
        return None;
    }
    let mut differing = a.iter().zip(b).enumerate().filter(|(_, (x, y))| x.1 != y.1);
    let (at, _) = differing.next()?;
    if differing.next().is_some() {
        return None;
    }
    let mut product = a.clone();
    product.remove(at);
    Some(product)
}

#[cfg(test)]
mod tests {
    use super::{NarrowSum, Wide, split};
    use crate::build::Builder;
    use crate::minimise::{Budget, Refused, proved_sum_of_products};
    use crate::node_bdds::Var;
    use crate::sim::LogicSim;
    use grafsynth_ir::logic::{Logic, NodeId};
    use grafsynth_ir::net::Meta;
    use grafsynth_ir::random::Random;

    fn wide(node: NodeId, polarity: Option<bool>) -> Wide {
        Wide { node, polarity, name: "f".into(), meta: Meta::default() }
    }

    /// True if the sum is not the function of the node.
    fn is_wrong(logic: &Logic, node: NodeId, sum: &NarrowSum) -> bool {
        let mut builder = Builder::resume(logic.clone());
        let products: Vec<NodeId> = sum
            .products
            .iter()
            .map(|product| {
                let literals: Vec<NodeId> = product
                    .iter()
                    .map(|(var, value)| {
                        let node = match var {
                            Var::Input(input) => builder.input(*input),
                            Var::Flop(flop) => builder.flop(*flop),
                        };
                        if *value { node } else { builder.not(node) }
                    })
                    .collect();
                builder.and(literals)
            })
            .collect();
        let value = builder.or(products);
        let differ = builder.xor(value, node);
        let wrong = if sum.is_complemented { builder.not(differ) } else { differ };
        proved_sum_of_products(&builder.logic, wrong, false, false, Budget::default())
            .is_ok_and(|(products, _)| !products.is_empty())
    }

    /// Substitutes each buried node back: the functions must be unchanged at random points.
    fn same_functions(logic: &Logic, asked: &[Wide], width: usize) -> usize {
        let split = split(logic, asked, width);
        let (mut before, mut after) = (LogicSim::new(logic), LogicSim::new(&split.logic));
        let mut random = Random::new(1);
        for _ in 0..20 {
            for pin in logic.inputs.ids() {
                let state = random.bits();
                before.set_input(pin, state);
                after.set_input(pin, state);
            }
            for node in &split.nodes {
                let value = after.node(node.value);
                after.set_input(node.input, value);
            }
            for (function, (now, _)) in asked.iter().zip(&split.wide) {
                assert_eq!(before.node(function.node), after.node(*now));
            }
        }
        let narrow = Budget { products: width, ..Budget::default() };
        for (function, (now, narrow_sum)) in asked.iter().zip(&split.wide) {
            assert!(
                narrow_sum.products.len() <= width && !is_wrong(&split.logic, *now, narrow_sum)
            );
            let sum = |negated| {
                proved_sum_of_products(&split.logic, *now, negated, false, narrow).is_ok()
            };
            assert!(match function.polarity {
                Some(value) => sum(!value),
                None => sum(false) || sum(true),
            });
        }
        for node in &split.nodes {
            assert!(
                node.sum.products.len() <= width && !is_wrong(&split.logic, node.value, &node.sum)
            );
            let sum = |negated| {
                proved_sum_of_products(&split.logic, node.value, negated, false, narrow).is_ok()
            };
            assert!(sum(false) || sum(true));
        }
        split.nodes.len()
    }

    fn adder(bits: usize) -> (Logic, Vec<NodeId>) {
        let mut builder = Builder::default();
        let word = |builder: &mut Builder, name: &str| -> Vec<NodeId> {
            (0..bits).map(|bit| builder.input_named(&format!("{name}{bit}"))).collect()
        };
        let (a, b) = (word(&mut builder, "a"), word(&mut builder, "b"));
        let mut carry = builder.constant(false);
        let mut sums = Vec::new();
        for (&a, &b) in a.iter().zip(&b) {
            let half = builder.xor(a, b);
            sums.push(builder.xor(half, carry));
            carry = builder.mux(half, carry, a);
        }
        sums.push(carry);
        (builder.logic, sums)
    }

    #[test]
    fn an_adder_becomes_a_chain_of_narrow_sums() {
        let (logic, sums) = adder(16);
        let top = sums[15];
        let budget = Budget { products: 512, ..Budget::default() };
        assert!(matches!(
            proved_sum_of_products(&logic, top, false, false, budget),
            Err(Refused::Products(_) | Refused::Nodes(_))
        ));
        let asked: Vec<_> = sums.iter().map(|&node| wide(node, Some(true))).collect();
        for width in [4, 8, 16] {
            let n_nodes = same_functions(&logic, &asked, width);
            assert!((3..=32).contains(&n_nodes), "{n_nodes} buried nodes of {width} products");
        }
    }

    #[test]
    fn a_wide_junction_is_cut_into_groups() {
        let mut builder = Builder::default();
        let pairs: Vec<NodeId> = (0..100)
            .map(|k| {
                let (a, b) =
                    (builder.input_named(&format!("a{k}")), builder.input_named(&format!("b{k}")));
                builder.and([a, b])
            })
            .collect();
        let any = builder.or(pairs.iter().copied());
        let none = builder.not(any);
        let asked = [wide(any, Some(true)), wide(none, Some(true)), wide(none, None)];
        let n_nodes = same_functions(&builder.logic, &asked, 8);
        assert!((13..=16).contains(&n_nodes), "{n_nodes}");
    }

    #[test]
    fn random_graphs_keep_their_functions() {
        let mut random = Random::new(1);
        let mut next = |below: usize| random.below(below);
        for round in 0..40 {
            let mut builder = Builder::default();
            let mut all: Vec<NodeId> =
                (0..6).map(|k| builder.input_named(&format!("i{k}"))).collect();
            for _ in 0..40 {
                let (a, b, c) = (all[next(all.len())], all[next(all.len())], all[next(all.len())]);
                let made = match next(5) {
                    0 => builder.not(a),
                    1 => builder.and([a, b, c]),
                    2 => builder.or([a, b, c]),
                    3 => builder.xor(a, b),
                    _ => builder.mux(a, b, c),
                };
                all.push(made);
            }
            let asked: Vec<_> = (0..4)
                .map(|k| wide(all[all.len() - 1 - k], [None, Some(true), Some(false)][k % 3]))
                .collect();
            same_functions(&builder.logic, &asked, 2 + round % 4);
        }
    }
}
