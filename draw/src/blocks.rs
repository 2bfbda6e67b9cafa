//! The columns of a graph: the axis of each node and the columns of links that pass rows.
//!
//! The blocks follow the tree of dominators. The branches below a node are laid side by side, a node that joins branches is centred below them, and a link that
//! leads up has a column beside the block of the node that it leads to. The outline of a block is known row by row, so blocks that are not in the same rows may
//! be below each other. Nothing overlaps, in any graph: each placement keeps a distance from the outline of everything placed before.

use crate::order::{Graph, Order};
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

/// The distance between nodes side by side.
const GAP: i64 = 20;
/// The distance between a link that passes a row and everything beside it.
pub(crate) const LANE: i64 = 10;
/// The left or right end of an empty row.
const NOTHING: i64 = i64::MAX / 4;

/// The columns of a graph.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    /// The axis of each node.
    pub(crate) x: Vec<i64>,
    /// The column of a link that goes down through rows, or from a fork to the turn of a link that leads up.
    pub(crate) down: Vec<Option<i64>>,
    /// The column in which a link that leads up goes down to a join.
    pub(crate) entry: Vec<Option<i64>>,
    /// The column of a link that leads up.
    pub(crate) up: Vec<Option<i64>>,
    /// The left and right end of the whole graph.
    pub(crate) extent: (i64, i64),
}

/// The outline of a block: the left and right end of each row, from the last row up, so that a row can be added above.
#[derive(Debug, Clone, Default)]
struct Outline {
    bottom: usize,
    rows: Vec<(i64, i64)>,
    /// Added to all ends.
    shift: i64,
}

impl Outline {
    fn at(&self, row: usize) -> Option<(i64, i64)> {
        let (left, right) = *self.rows.get(self.bottom.checked_sub(row)?)?;
        (left <= right).then_some((left + self.shift, right + self.shift))
    }

    /// The rows of both outlines with something in both.
    fn shared<'a>(
        &'a self,
        other: &'a Outline,
    ) -> impl Iterator<Item = ((i64, i64), (i64, i64))> + 'a {
        let bottom = self.bottom.min(other.bottom);
        let top = |outline: &Outline| (outline.bottom + 1).saturating_sub(outline.rows.len());
        let rows = top(self).max(top(other))..=bottom;
        rows.filter_map(|row| Some((self.at(row)?, other.at(row)?)))
    }

    fn add(&mut self, row: usize, left: i64, right: i64) {
        if self.rows.is_empty() {
            self.bottom = row;
        }
        if row > self.bottom {
            let missing = row - self.bottom;
            self.rows.splice(0..0, std::iter::repeat_n((NOTHING, -NOTHING), missing));
            self.bottom = row;
        }
        let index = self.bottom - row;
        while self.rows.len() <= index {
            self.rows.push((NOTHING, -NOTHING));
        }
        let at = &mut self.rows[index];
        *at = (at.0.min(left - self.shift), at.1.max(right - self.shift));
    }

    /// Adds another outline, in time proportional to the smaller one.
    fn merge(&mut self, mut other: Outline) {
        if other.rows.len() > self.rows.len() {
            std::mem::swap(self, &mut other);
        }
        let rows = other.rows.iter().enumerate();
        for (index, (left, right)) in rows.filter(|(_, (left, right))| left <= right) {
            self.add(other.bottom - index, left + other.shift, right + other.shift);
        }
    }
}

/// A part of what is below a node: branches that are joined, or a single one.
#[derive(Debug, Clone, Default)]
struct Item {
    outline: Outline,
    /// The middle of the part.
    axis: i64,
    /// The columns in which the links from the node above enter.
    ports: Vec<i64>,
    nodes: Vec<(usize, i64)>,
    lanes: Vec<(usize, i64)>,
    entries: Vec<(usize, i64)>,
    /// Links that leave the part downwards.
    pending: usize,
}

impl Item {
    fn shift(&mut self, by: i64) {
        self.outline.shift += by;
        self.axis += by;
        self.ports.iter_mut().for_each(|x| *x += by);
        self.nodes.iter_mut().for_each(|(_, x)| *x += by);
        self.lanes.iter_mut().for_each(|(_, x)| *x += by);
        self.entries.iter_mut().for_each(|(_, x)| *x += by);
    }

    fn absorb(&mut self, other: Item) {
        self.outline.merge(other.outline);
        self.ports.extend(other.ports);
        self.nodes.extend(other.nodes);
        self.lanes.extend(other.lanes);
        self.entries.extend(other.entries);
        self.pending += other.pending;
    }

    /// Puts another part to the right of this one, and returns by how much it was moved.
    fn put_right(&mut self, mut other: Item) -> i64 {
        let shifts = self.outline.shared(&other.outline).map(|(own, next)| own.1 - next.0 + GAP);
        let shift = shifts.max().unwrap_or(0);
        other.shift(shift);
        self.absorb(other);
        shift
    }

    /// Puts another part with its axis at `x`, or at the nearest free position on a side.
    fn put_below(&mut self, mut other: Item, x: i64) {
        other.shift(x - other.axis);
        let is_free =
            |(own, next): ((i64, i64), (i64, i64))| own.1 + GAP <= next.0 || next.1 + GAP <= own.0;
        if !self.outline.shared(&other.outline).all(is_free) {
            let right = self.outline.shared(&other.outline).map(|(own, next)| own.1 - next.0 + GAP);
            let left = self.outline.shared(&other.outline).map(|(own, next)| next.1 - own.0 + GAP);
            let (right, left) = (right.max().unwrap_or(0), left.max().unwrap_or(0));
            other.shift(if right <= left { right } else { -left });
        }
        self.absorb(other);
    }
}

/// The contents of a part: a node directly below the node above, or a link from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Node(usize),
    Link(usize),
}

/// The parts below a node, from left to right; parts that were joined leave a gap.
#[derive(Debug, Default)]
struct Parts {
    all: Vec<Option<Item>>,
    place: BTreeMap<Key, usize>,
}

impl Parts {
    fn add(&mut self, key: Key, item: Item) {
        self.place.insert(key, self.all.len());
        self.all.push(Some(item));
    }

    /// Puts something to the right of the part that contains a node.
    fn beside(&mut self, key: Key, item: Item) {
        let place = self.place.get(&key).copied();
        if let Some(Some(part)) = place.and_then(|index| self.all.get_mut(index)) {
            part.put_right(item);
        }
    }

    /// Adds a node below the parts that lead to it, which become one part with everything between them.
    fn join(&mut self, from: &[Key], key: Key, item: Item) {
        let feeding: BTreeSet<usize> =
            from.iter().filter_map(|key| self.place.get(key).copied()).gather();
        let (Some(&first), Some(&last)) = (feeding.first(), feeding.last()) else {
            return self.add(key, item);
        };
        let mut whole: Option<Item> = None;
        let mut axes = Vec::new();
        for index in first..=last {
            let Some(part) = self.all.get_mut(index).and_then(Option::take) else { continue };
            let mut axis = part.axis;
            match &mut whole {
                None => whole = Some(part),
                Some(whole) => axis += whole.put_right(part),
            }
            if feeding.contains(&index) {
                axes.push(axis);
            }
        }
        let mut whole = whole.unwrap_or_default();
        let middle = axes.first().zip(axes.last()).map_or(0, |(low, high)| (low + high) / 2);
        whole.pending = whole.pending.saturating_sub(from.len());
        whole.put_below(item, middle);
        whole.axis = middle;
        self.place
            .values_mut()
            .filter(|at| (first..=last).contains(*at))
            .for_each(|at| *at = first);
        self.place.insert(key, first);
        if let Some(slot) = self.all.get_mut(first) {
            *slot = Some(whole);
        }
    }
}

/// The layout of the blocks in progress.
struct Blocks<'a> {
    graph: &'a Graph,
    order: &'a Order,
    /// The nodes whose dominator is this one; the last entry is for the root.
    children: Vec<Vec<usize>>,
    /// The links that lead up, by the node whose block has their column.
    ups: Vec<Vec<usize>>,
    /// The block of each node, until it becomes part of the block of the node above.
    blocks: Vec<Option<Item>>,
    /// The axis of each node, relative to that of its dominator.
    dx: Vec<i64>,
    /// Columns relative to the axis of the node in `down_of` or `up_of`.
    down: Vec<Option<(usize, i64)>>,
    entry: Vec<Option<(usize, i64)>>,
    up: Vec<Option<(usize, i64)>>,
    /// Maps a node to the finished node above it.
    owner: Vec<usize>,
}

/// Finds the columns of a graph.
pub(crate) fn columns(graph: &Graph, order: &Order) -> Columns {
    let n = graph.nodes.len();
    let mut children = vec![Vec::new(); n + 1];
    for &node in &order.nodes {
        children[order.dominator[node]].push(node);
    }
    let mut ups = vec![Vec::new(); n + 1];
    for (index, arc) in graph.arcs.iter().enumerate().filter(|(index, _)| order.is_back[*index]) {
        let is_outside = order.turns_above(graph, index);
        let to = if is_outside { order.dominator[arc.to] } else { arc.to };
        ups[order.common(arc.from, to)].push(index);
    }
    let mut blocks = Blocks {
        graph,
        order,
        children,
        ups,
        blocks: vec![None; n],
        dx: vec![0; n],
        down: vec![None; graph.arcs.len()],
        entry: vec![None; graph.arcs.len()],
        up: vec![None; graph.arcs.len()],
        owner: (0..=n).collect(),
    };
    for &node in order.nodes.iter().rev() {
        let item = blocks.block(node);
        blocks.blocks[node] = Some(item);
    }
    let all = blocks.block(n);
    let mut x = vec![0; n + 1];
    for &node in &order.nodes {
        x[node] = x[order.dominator[node]] + blocks.dx[node];
    }
    let absolute = |columns: &[Option<(usize, i64)>]| -> Vec<Option<i64>> {
        columns.iter().map(|column| column.map(|(node, dx)| x[node] + dx)).collect()
    };
    let shift = all.outline.shift;
    let ends = all.outline.rows.iter().filter(|(left, right)| left <= right);
    let extent =
        ends.fold((0, 0), |(left, right), row| (left.min(row.0 + shift), right.max(row.1 + shift)));
    Columns {
        down: absolute(&blocks.down),
        entry: absolute(&blocks.entry),
        up: absolute(&blocks.up),
        x,
        extent,
    }
}

impl Blocks<'_> {
    fn find(&mut self, node: usize) -> usize {
        let mut top = node;
        while self.owner[top] != top {
            let next = self.owner[top];
            self.owner[top] = self.owner[next];
            top = next;
        }
        top
    }

    /// The branches that begin below a node, in the order of its links, and the link of each.
    fn branches(&mut self, node: usize) -> Vec<(usize, Item)> {
        let mut items = Vec::new();
        let outs = self.graph.outs.get(node).map(Vec::as_slice).unwrap_or_default();
        for &arc in outs {
            let to = self.graph.arcs[arc].to;
            let row = self.order.row[node];
            let (first, last) = if self.order.turns_below(self.graph, arc) {
                (row + 1, row + 1)
            } else if self.order.is_back[arc] {
                continue;
            } else if self.graph.ins[to].len() == 1 {
                if let Some(mut item) = self.blocks[to].take() {
                    item.ports = vec![0];
                    items.push((arc, item));
                }
                continue;
            } else {
                (row + 1, self.order.row[to] - 1)
            };
            let mut item = Item { ports: vec![0], lanes: vec![(arc, 0)], ..Item::default() };
            item.pending = usize::from(!self.order.is_back[arc]);
            for row in first..=last {
                item.outline.add(row, -LANE, LANE);
            }
            items.push((arc, item));
        }
        items
    }

    /// The block of a node with everything below it, with the axis of the node at 0.
    fn block(&mut self, node: usize) -> Item {
        let branches = self.branches(node);
        let mut parts = Parts::default();
        for (arc, item) in branches {
            let key = item.nodes.first().map_or(Key::Link(arc), |(child, _)| Key::Node(*child));
            parts.add(key, item);
        }
        for join in self.children[node].clone() {
            // Branches were taken already.
            let Some(item) = self.blocks[join].take() else { continue };
            let ins = self.graph.ins[join].iter().copied();
            let ins: Vec<usize> = ins.filter(|arc| !self.order.is_back[*arc]).collect();
            let keys = ins.iter().map(|arc| {
                let from = self.graph.arcs[*arc].from;
                if from == node { Key::Link(*arc) } else { Key::Node(self.find(from)) }
            });
            let keys: Vec<Key> = keys.collect();
            parts.join(&keys, Key::Node(join), item);
            let entries = self.graph.ins[join].iter().copied();
            for arc in entries.filter(|arc| self.order.turns_above(self.graph, *arc)) {
                let mut entry = Item { entries: vec![(arc, 0)], ..Item::default() };
                entry.outline.add(self.order.row[join] - 1, -LANE, LANE);
                parts.beside(Key::Node(join), entry);
            }
        }
        self.finish(node, parts.all.into_iter().flatten().collect())
    }

    /// Lays the parts side by side, with the node above them and the links that lead up beside them.
    fn finish(&mut self, node: usize, items: Vec<Item>) -> Item {
        let row = self.order.row.get(node).copied();
        let is_stub = |item: &Item| {
            item.pending == 0 && row.is_some_and(|row| item.outline.bottom <= row + 3)
        };
        let has_main = items.iter().any(|item| !item.ports.is_empty() && !is_stub(item));
        let mut whole: Option<Item> = None;
        let mut main: Vec<i64> = Vec::new();
        for item in items {
            let counts = !has_main || !is_stub(&item);
            let n_before = whole.as_ref().map_or(0, |whole| whole.ports.len());
            match &mut whole {
                None => whole = Some(item),
                Some(whole) => {
                    whole.put_right(item);
                }
            }
            let ports = whole.as_ref().map(|whole| whole.ports.as_slice()).unwrap_or_default();
            main.extend(ports[n_before..].iter().filter(|_| counts));
        }
        let mut whole = whole.unwrap_or_default();
        let (low, high) = (main.iter().min(), main.iter().max());
        let axis = if let (Some(low), Some(high)) = (low, high) { (low + high) / 2 } else { 0 };
        whole.shift(-axis);
        if let (Some(row), Some(size)) = (row, self.graph.nodes.get(node)) {
            whole.outline.add(row, -size.left, size.right);
        }
        for (child, dx) in std::mem::take(&mut whole.nodes) {
            self.dx[child] = dx;
            self.owner[child] = node;
        }
        for (arc, dx) in std::mem::take(&mut whole.lanes) {
            self.down[arc] = Some((node, dx));
        }
        for (arc, dx) in std::mem::take(&mut whole.entries) {
            self.entry[arc] = Some((node, dx));
        }
        self.add_ups(node, &mut whole);
        whole.nodes = vec![(node, 0)];
        whole.ports = Vec::new();
        whole.axis = 0;
        whole
    }

    /// Adds the columns of links that lead up: the shortest first, and of equal ones first those that begin near the side, so that each encloses the ones
    /// before.
    fn add_ups(&mut self, node: usize, whole: &mut Item) {
        let mut ups = std::mem::take(&mut self.ups[node]);
        let rows = |arc: usize| {
            let bottom = self.order.row[self.graph.arcs[arc].from];
            let below = usize::from(self.order.turns_below(self.graph, arc));
            let above = usize::from(self.order.turns_above(self.graph, arc));
            self.order.row[self.graph.arcs[arc].to] - above..=bottom + below
        };
        let start = |arc: usize| match self.down[arc] {
            Some((from, dx)) => self.offset(from, node) + dx,
            None => self.offset(self.graph.arcs[arc].from, node),
        };
        let sides = |outline: &Outline, arc: usize| {
            let ends = || rows(arc).filter_map(|row| outline.at(row));
            let left = ends().map(|(left, _)| left).min().unwrap_or(0) - LANE;
            (left, ends().map(|(_, right)| right).max().unwrap_or(0) + LANE)
        };
        ups.sort_by_cached_key(|arc| {
            let (left, right) = sides(&whole.outline, *arc);
            let start = start(*arc);
            (rows(*arc).end() - rows(*arc).start(), (start - left).min(right - start), *arc)
        });
        let mut columns = Vec::new();
        for arc in ups {
            let start = start(arc);
            let goal = self.offset(self.graph.arcs[arc].to, node);
            let (left, right) = sides(&whole.outline, arc);
            // The shorter way around the block.
            let is_right = 2 * right - start - goal < start + goal - 2 * left;
            let x = if is_right == self.order.takes_longer_way[arc] { left } else { right };
            for row in rows(arc) {
                whole.outline.add(row, x - LANE / 2, x + LANE / 2);
            }
            columns.push((arc, x));
        }
        for (arc, x) in columns {
            self.up[arc] = Some((node, x));
        }
    }

    /// The axis of a node relative to that of a node above it.
    fn offset(&self, mut node: usize, above: usize) -> i64 {
        let mut offset = 0;
        while node != above && node < self.dx.len() {
            offset += self.dx[node];
            node = self.order.dominator[node];
        }
        offset
    }
}
