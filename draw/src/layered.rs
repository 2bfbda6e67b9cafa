//! The columns of a graph without structure: every node and every link that passes rows is a piece, and the pieces have one order from left to right.
//!
//! The rows are the same as with blocks, and `channels` draws the links. A piece has one column in all of its rows: nodes below each other whose only link down is
//! the one between them are one piece. The order begins as that of the blocks. The columns follow from it: each piece is as near to the pieces that it is linked
//! with as its neighbours in its rows allow. A piece whose links cross is moved to each other place beside the pieces of its rows, and stays where the finished
//! drawing has the fewest crossings. The work is limited by a count, so the result does not depend on the machine.

use crate::blocks::Columns;
use crate::channels::{Placed, Tried, place};
use crate::order::{Graph, Order};
use crate::trials::Trials;
use std::cmp::Reverse;
use std::ops::{Range, RangeInclusive};

/// Half the distance between nodes side by side.
const NODE: i64 = 10;
/// Half the distance between links side by side.
const LINK: i64 = 8;
/// The number of rounds in which pieces move towards those that they are linked with.
const ROUNDS: usize = 6;

/// What is in one column: nodes below each other with the links between them, or a part of a link.
#[derive(Debug, Clone, Default)]
struct Piece {
    first_row: usize,
    /// For each row the pixels that it needs to the left and right of its axis.
    sides: Vec<(i64, i64)>,
    /// The pieces that it is linked with.
    linked: Vec<usize>,
}

impl Piece {
    fn rows(&self) -> Range<usize> {
        self.first_row..self.first_row + self.sides.len()
    }
}

/// The pieces of a graph.
#[derive(Debug, Clone, Default)]
struct Pieces {
    all: Vec<Piece>,
    /// The piece of each node.
    nodes: Vec<usize>,
    /// For each link its pieces: down, entry and up, as in [`Columns`].
    links: Vec<[Option<usize>; 3]>,
    /// The number of rows of all pieces before each piece.
    starts: Vec<usize>,
    n_rows: usize,
}

/// For each piece its neighbours on one side, with their least distance; the rows of all pieces share one list.
struct Beside<'a> {
    starts: &'a [usize],
    counts: Vec<usize>,
    all: Vec<(usize, i64)>,
}

impl<'a> Beside<'a> {
    fn new(starts: &'a [usize]) -> Self {
        let n_rows = starts.last().copied().unwrap_or(0);
        Beside { starts, counts: vec![0; starts.len()], all: vec![(0, 0); n_rows] }
    }

    fn of(&self, piece: usize) -> &[(usize, i64)] {
        let start = self.starts[piece];
        &self.all[start..start + self.counts[piece]]
    }

    /// Adds a neighbour in the next row.
    fn add(&mut self, piece: usize, neighbour: usize, by: i64) {
        let end = self.starts[piece] + self.counts[piece];
        if let Some(last) = self.all[self.starts[piece]..end].last_mut()
            && last.0 == neighbour
        {
            last.1 = last.1.max(by);
            return;
        }
        self.all[end] = (neighbour, by);
        self.counts[piece] += 1;
    }
}

/// A layout with few crossings, and the order of its pieces. The search begins with the order of `start`, and `work` is the sum of the rows of its pieces over all
/// layouts that are tried.
pub(crate) fn improved(
    graph: &Graph,
    order: &Order,
    start: &Columns,
    work: usize,
) -> (Tried, Vec<usize>) {
    let pieces = Pieces::of(graph, order);
    let numbers: Vec<i64> = (0..).take(pieces.all.len()).collect();
    let trials = Trials::new(graph, order, &pieces.columns(&numbers));
    let mut places = pieces.order(start);
    let axes = pieces.axes(&places);
    let extent = pieces.extent(&axes);
    let mut best = trials.measure(axes, extent);
    let n_rows = pieces.starts.last().copied().unwrap_or(0);
    let mut left = work / n_rows.max(1);
    'search: loop {
        let before = best.cost.0;
        for piece in pieces.crossing(&trials.crossings(&best.x)) {
            let (rest, targets) = pieces.targets(piece, &places);
            for target in targets {
                if left == 0 || best.cost.0 == 0 {
                    break 'search;
                }
                left -= 1;
                let mut other = rest.clone();
                other.insert(target, piece);
                let axes = pieces.axes(&other);
                if let Some(found) = trials.better(&best, &axes, pieces.extent(&axes)) {
                    (best, places) = (found, other);
                }
            }
        }
        if best.cost.0 == before {
            break;
        }
    }
    (Tried::new(place(graph, order, &pieces.columns(&best.x))), places)
}

/// The layout with an order of the pieces.
pub(crate) fn ordered(graph: &Graph, order: &Order, places: &[usize]) -> Placed {
    let pieces = Pieces::of(graph, order);
    place(graph, order, &pieces.columns(&pieces.axes(places)))
}

/// The only link of these that does not lead up.
fn only(links: &[usize], order: &Order) -> Option<usize> {
    let mut down = links.iter().copied().filter(|arc| !order.is_back[*arc]);
    down.next().filter(|_| down.next().is_none())
}

/// True if a link joins nodes in neighbouring rows and is the only one down from the upper and to the lower node.
fn is_straight(graph: &Graph, order: &Order, arc: usize) -> bool {
    let ends = graph.arcs[arc];
    only(&graph.outs[ends.from], order) == Some(arc)
        && only(&graph.ins[ends.to], order) == Some(arc)
        && order.row[ends.from] + 1 == order.row[ends.to]
}

impl Pieces {
    fn of(graph: &Graph, order: &Order) -> Self {
        let n_nodes = graph.nodes.len();
        let links = vec![[None; 3]; graph.arcs.len()];
        let mut pieces = Pieces { nodes: vec![0; n_nodes], links, ..Pieces::default() };
        for &node in &order.nodes {
            let size = &graph.nodes[node];
            let sides = (size.left + NODE, size.right + NODE);
            pieces.nodes[node] = match only(&graph.ins[node], order) {
                Some(arc) if is_straight(graph, order, arc) => {
                    let piece = pieces.nodes[graph.arcs[arc].from];
                    pieces.all[piece].sides.push(sides);
                    piece
                }
                _ => pieces.add(order.row[node], vec![sides]),
            };
        }
        for (index, arc) in graph.arcs.iter().enumerate() {
            let (from, to) = (order.row[arc.from], order.row[arc.to]);
            let mut add = |rows: RangeInclusive<usize>| {
                pieces.add(*rows.start(), rows.map(|_| (LINK, LINK)).collect())
            };
            let mut own = [None; 3];
            if order.is_back[index] {
                let below = order.turns_below(graph, index);
                let above = order.turns_above(graph, index);
                own[0] = below.then(|| add(from + 1..=from + 1));
                own[1] = above.then(|| add(to - 1..=to - 1));
                own[2] = Some(add(to - usize::from(above)..=from + usize::from(below)));
            } else if from + 1 < to {
                own[0] = Some(add(from + 1..=to - 1));
            }
            pieces.links[index] = own;
            let ends = [pieces.nodes[arc.from], pieces.nodes[arc.to]].map(Some);
            let chain: Vec<usize> =
                [ends[0], own[0], own[2], own[1], ends[1]].into_iter().flatten().collect();
            for pair in chain.windows(2).filter(|pair| pair[0] != pair[1]) {
                pieces.all[pair[0]].linked.push(pair[1]);
                pieces.all[pair[1]].linked.push(pair[0]);
            }
        }
        pieces.starts = { [0].into_iter() }
            .chain(pieces.all.iter().scan(0, |sum, piece| {
                *sum += piece.sides.len();
                Some(*sum)
            }))
            .collect();
        pieces.n_rows = pieces.all.iter().map(|piece| piece.rows().end).max().unwrap_or(0);
        pieces
    }

    fn add(&mut self, first_row: usize, sides: Vec<(i64, i64)>) -> usize {
        self.all.push(Piece { first_row, sides, linked: Vec::new() });
        self.all.len() - 1
    }

    /// The order of a drawing.
    fn order(&self, columns: &Columns) -> Vec<usize> {
        let mut x = vec![0; self.all.len()];
        for (piece, at) in self.nodes.iter().zip(&columns.x) {
            x[*piece] = *at;
        }
        for (index, [down, entry, up]) in self.links.iter().enumerate() {
            let places = [
                (down, columns.down[index]),
                (entry, columns.entry[index]),
                (up, columns.up[index]),
            ];
            for (piece, at) in places {
                if let (Some(piece), Some(at)) = (piece, at) {
                    x[*piece] = at;
                }
            }
        }
        let mut order: Vec<usize> = (0..self.all.len()).collect();
        order.sort_by_key(|piece| x[*piece]);
        order
    }

    /// The pieces with crossings; those with most crossings come first.
    fn crossing(&self, counts: &[usize]) -> Vec<usize> {
        let mut all: Vec<usize> = (0..counts.len()).filter(|piece| counts[*piece] > 0).collect();
        all.sort_by_key(|piece| (Reverse(counts[*piece]), *piece));
        all
    }

    /// The order without a piece, and the places in that order where the piece can be put.
    fn targets(&self, piece: usize, places: &[usize]) -> (Vec<usize>, Vec<usize>) {
        let at = places.iter().position(|it| *it == piece).unwrap_or(0);
        let rest: Vec<usize> = places.iter().copied().filter(|it| *it != piece).collect();
        let beside: Vec<usize> =
            (0..rest.len()).filter(|to| self.share_rows(piece, rest[*to])).collect();
        // To the left of each neighbour on the left, and to the right of each on the right.
        let targets = beside.iter().map(|to| if *to < at { *to } else { to + 1 });
        let targets = targets.collect();
        (rest, targets)
    }

    fn share_rows(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.all[a].rows(), self.all[b].rows());
        a.start < b.end && b.start < a.end
    }

    /// The axis of each piece for an order of the pieces.
    fn axes(&self, order: &[usize]) -> Vec<i64> {
        let mut x = vec![0; self.all.len()];
        let (mut lefts, mut rights) = (Beside::new(&self.starts), Beside::new(&self.starts));
        // The last piece of each row, with what it needs to the right.
        let mut last: Vec<Option<(usize, i64)>> = vec![None; self.n_rows];
        for &piece in order {
            let own = &self.all[piece];
            for ((left, right), last) in own.sides.iter().zip(&mut last[own.rows()]) {
                let Some((before, by)) = last.replace((piece, *right)) else { continue };
                lefts.add(piece, before, by + left);
                rights.add(before, piece, by + left);
            }
            let least = lefts.of(piece).iter().map(|(before, by)| x[*before] + by).max();
            x[piece] = least.unwrap_or(0);
        }
        for round in 0..ROUNDS {
            let mut pull = |piece: usize| {
                let linked = &self.all[piece].linked;
                let Ok(count) = i64::try_from(linked.len()) else { return };
                if count == 0 {
                    return;
                }
                let wish = linked.iter().map(|it| x[*it]).sum::<i64>().div_euclid(count);
                let least = lefts.of(piece).iter().map(|(it, by)| x[*it] + by).max();
                let most = rights.of(piece).iter().map(|(it, by)| x[*it] - by).min();
                x[piece] = wish.min(most.unwrap_or(wish)).max(least.unwrap_or(i64::MIN));
            };
            if round % 2 == 0 {
                order.iter().rev().for_each(|piece| pull(*piece));
            } else {
                order.iter().for_each(|piece| pull(*piece));
            }
        }
        let ends = self.all.iter().zip(&x);
        let ends = ends.flat_map(|(piece, x)| piece.sides.iter().map(move |(left, _)| x - left));
        let left = ends.min().unwrap_or(0);
        x.iter().map(|x| x - left).collect()
    }

    /// The columns by the axes of the pieces.
    fn columns(&self, x: &[i64]) -> Columns {
        let of = |which: usize| {
            let pieces = self.links.iter().map(|own| own[which]);
            pieces.map(|piece| piece.map(|piece| x[piece])).collect()
        };
        Columns {
            x: self.nodes.iter().map(|piece| x[*piece]).collect(),
            down: of(0),
            entry: of(1),
            up: of(2),
            extent: self.extent(x),
        }
    }
    /// The left and right end of all pieces; the first is 0.
    fn extent(&self, x: &[i64]) -> (i64, i64) {
        let ends = self.all.iter().zip(x);
        let ends = ends.flat_map(|(piece, x)| piece.sides.iter().map(move |(_, right)| x + right));
        (0, ends.max().unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks;
    use crate::order::{Arc, Node};

    /// Steps and transitions in turn, with more links between any of them.
    fn tangle(n: usize, mut seed: usize) -> Graph {
        let mut random = |below: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695);
            (seed >> 33) % below
        };
        let node = |index: usize| Node {
            left: 20 + (index as i64 % 3) * 10,
            right: 40 + (index as i64 % 5) * 12,
            above: 10,
            body: 20,
            below: 10,
            is_initial: index == 0,
            is_transition: index % 2 == 1,
        };
        let mut arcs: Vec<Arc> = (1..n).map(|to| Arc { from: to - 1, to }).collect();
        // A link joins a step and a transition, which have numbers of different parity.
        arcs.extend((0..n / 3).map(|_| {
            let from = random(n);
            Arc { from, to: (random(n / 2) * 2 + (from + 1) % 2) % n }
        }));
        Graph::new((0..n).map(node).collect(), arcs)
    }

    #[test]
    fn trials_have_the_crossings_of_the_drawing() {
        let (mut n_crossings, mut n_better) = (0, 0);
        for seed in 0..30 {
            let graph = tangle(20 + 2 * (seed % 7), seed);
            let order = Order::of(&graph);
            let pieces = Pieces::of(&graph, &order);
            let numbers: Vec<i64> = (0..).take(pieces.all.len()).collect();
            let trials = Trials::new(&graph, &order, &pieces.columns(&numbers));
            let drawn = |x: &[i64]| Tried::new(place(&graph, &order, &pieces.columns(x))).cost.0;
            let start = pieces.order(&blocks::columns(&graph, &order));
            let axes = pieces.axes(&start);
            let known = trials.measure(axes.clone(), pieces.extent(&axes));
            assert_eq!(known.cost.0, drawn(&axes), "{seed}");
            for piece in 0..pieces.all.len() {
                let (mut other, targets) = pieces.targets(piece, &start);
                let Some(target) = targets.get(targets.len() / 2) else { continue };
                other.insert(*target, piece);
                let axes = pieces.axes(&other);
                let extent = pieces.extent(&axes);
                let measured = trials.measure(axes.clone(), extent);
                assert_eq!(measured.cost.0, drawn(&axes), "{seed}: {piece}");
                n_crossings += measured.cost.0;
                // What is known of the channels that did not change is right.
                let better = trials.better(&known, &axes, extent).map(|it| it.cost);
                assert_eq!(better, (measured.cost < known.cost).then_some(measured.cost));
                n_better += usize::from(better.is_some());
            }
        }
        assert!(n_crossings > 1000 && n_better > 20, "{n_crossings}, {n_better}");
    }
}
