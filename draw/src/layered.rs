//! The columns of a graph without structure: every node and every link that passes rows is a piece, and the pieces have one order from left to right.
//!
//! The order begins as that of the blocks. The places follow from it: each piece is as near to the pieces that it is linked with as its neighbours in its rows
//! allow. A piece is moved to another place in the order if this makes the crossings of the finished drawing fewer.

use crate::blocks::{Columns, LANE};
use crate::channels::{Placed, place};
use crate::order::{Graph, Order};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The distance between nodes side by side.
const GAP: i64 = 20;
/// The distance between links side by side.
const APART: i64 = 16;
/// The number of rounds in which pieces move towards those that they are linked with.
const ROUNDS: usize = 6;

/// A node, or the part of a link in one column.
#[derive(Debug, Clone)]
struct Piece {
    /// The rows, from the first to the last.
    rows: (usize, usize),
    /// Pixels to the left and right of the axis.
    sides: (i64, i64),
    is_link: bool,
    /// The pieces that it is linked with.
    linked: Vec<usize>,
}

/// The pieces of a graph; those of the nodes come first.
#[derive(Debug, Clone)]
struct Pieces {
    all: Vec<Piece>,
    n_nodes: usize,
    n_rows: usize,
    /// For each link its pieces: down, entry and up, as in [`Columns`].
    links: Vec<[Option<usize>; 3]>,
}

/// A drawing with few crossings, with its crossings and area. It begins with the order of `start`, and `work` is the sum of its pieces over all drawings that are
/// tried.
pub(crate) fn improved(
    graph: &Graph,
    order: &Order,
    start: &Columns,
    work: usize,
) -> (Placed, (usize, i64)) {
    let pieces = Pieces::of(graph, order);
    let tried = |places: &[usize]| {
        let placed = place(graph, order, &pieces.columns(&pieces.axes(places)));
        let cost = placed.cost();
        (placed, cost)
    };
    let mut places = pieces.order(start);
    let mut best = tried(&places);
    let mut left = work / pieces.all.len().max(1);
    loop {
        let before = best.1.0;
        for piece in pieces.crossing(&best.0, &pieces.axes(&places)) {
            let (rest, targets) = pieces.targets(piece, &places);
            for target in targets {
                if left == 0 || best.1.0 == 0 {
                    return best;
                }
                left -= 1;
                let mut other = rest.clone();
                other.insert(target, piece);
                let found = tried(&other);
                if found.1 < best.1 {
                    (best, places) = (found, other);
                }
            }
        }
        if best.1.0 == before {
            return best;
        }
    }
}

impl Pieces {
    fn of(graph: &Graph, order: &Order) -> Self {
        let nodes = graph.nodes.iter().zip(&order.row);
        let all = nodes.map(|(node, row)| Piece {
            rows: (*row, *row),
            sides: (node.left, node.right),
            is_link: false,
            linked: Vec::new(),
        });
        let n_rows = order.row.iter().max().map_or(0, |row| row + 1) + 1;
        let n_nodes = graph.nodes.len();
        let mut pieces = Pieces { all: all.collect(), n_nodes, n_rows, links: Vec::new() };
        for (index, arc) in graph.arcs.iter().enumerate() {
            let (from, to) = (order.row[arc.from], order.row[arc.to]);
            let mut own = [None; 3];
            if order.is_back[index] {
                let (below, above) =
                    (order.turns_below(graph, index), order.turns_above(graph, index));
                own[0] = below.then(|| pieces.add((from + 1, from + 1)));
                own[1] = above.then(|| pieces.add((to - 1, to - 1)));
                let rows = (to - usize::from(above), from + usize::from(below));
                own[2] = Some(pieces.add(rows));
            } else if from + 1 < to {
                own[0] = Some(pieces.add((from + 1, to - 1)));
            }
            let chain = [Some(arc.from), own[0], own[2], own[1], Some(arc.to)];
            let chain: Vec<usize> = chain.into_iter().flatten().collect();
            for pair in chain.windows(2) {
                pieces.all[pair[0]].linked.push(pair[1]);
                pieces.all[pair[1]].linked.push(pair[0]);
            }
            pieces.links.push(own);
        }
        pieces
    }

    fn add(&mut self, rows: (usize, usize)) -> usize {
        self.all.push(Piece { rows, sides: (0, 0), is_link: true, linked: Vec::new() });
        self.all.len() - 1
    }

    /// The order of a drawing.
    fn order(&self, columns: &Columns) -> Vec<usize> {
        let mut x = columns.x.clone();
        x.resize(self.all.len(), 0);
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

    /// The pieces in the columns of links that cross, and of the ends of these links; those with most crossings come first.
    fn crossing(&self, placed: &Placed, axes: &[i64]) -> Vec<usize> {
        let mut columns: BTreeMap<i64, usize> = BTreeMap::new();
        let flat = |y: i64| placed.lines.iter().filter(move |line| line[1] == y && line[3] == y);
        for (x, y) in &placed.crossings {
            let crossed = flat(*y).filter(|line| line[0] < *x && *x < line[2]);
            for column in crossed.flat_map(|line| [line[0], line[2]]).chain([*x]) {
                *columns.entry(column).or_default() += 1;
            }
        }
        let count = |piece: &usize| columns.get(&axes[*piece]).copied().unwrap_or(0);
        let mut all: Vec<usize> = (0..axes.len()).filter(|piece| count(piece) > 0).collect();
        all.sort_by_key(|piece| (Reverse(count(piece)), *piece));
        all
    }

    /// The order without a piece, and the places where it can be in it.
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
        let (a, b) = (self.all[a].rows, self.all[b].rows);
        a.0 <= b.1 && b.0 <= a.1
    }

    /// The distance between the axes of neighbours.
    fn distance(&self, left: usize, right: usize) -> i64 {
        let (one, other) = (&self.all[left], &self.all[right]);
        let gap = match (one.is_link, other.is_link) {
            (false, false) => GAP,
            (true, true) => APART,
            _ => LANE,
        };
        one.sides.1 + gap + other.sides.0
    }

    /// The axis of each piece for an order of the pieces.
    fn axes(&self, order: &[usize]) -> Vec<i64> {
        let n = self.all.len();
        let mut last: Vec<Option<usize>> = vec![None; self.n_rows + 1];
        let (mut lefts, mut rights) = (vec![Vec::new(); n], vec![Vec::new(); n]);
        let mut x = vec![0; n];
        for &piece in order {
            let (first, end) = self.all[piece].rows;
            for before in last[first..=end].iter_mut().map(|it| it.replace(piece)) {
                let Some(before) = before else { continue };
                if lefts[piece].last().is_none_or(|(it, _)| *it != before) {
                    let distance = self.distance(before, piece);
                    lefts[piece].push((before, distance));
                    rights[before].push((piece, distance));
                }
            }
            let least = lefts[piece].iter().map(|(before, by)| x[*before] + by).max();
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
                let least = lefts[piece].iter().map(|(it, by)| x[*it] + by).max();
                let most = rights[piece].iter().map(|(it, by)| x[*it] - by).min();
                x[piece] = wish.min(most.unwrap_or(wish)).max(least.unwrap_or(i64::MIN));
            };
            if round % 2 == 0 {
                order.iter().rev().for_each(|piece| pull(*piece));
            } else {
                order.iter().for_each(|piece| pull(*piece));
            }
        }
        let left = self.all.iter().zip(&x).map(|(piece, x)| x - piece.sides.0).min().unwrap_or(0);
        x.iter().map(|x| x - left).collect()
    }

    /// The columns by the axes of the pieces.
    fn columns(&self, x: &[i64]) -> Columns {
        let of = |which: usize| {
            let pieces = self.links.iter().map(|own| own[which]);
            pieces.map(|piece| piece.map(|piece| x[piece])).collect()
        };
        let right = self.all.iter().zip(x).map(|(piece, x)| x + piece.sides.1).max();
        Columns {
            x: x[..self.n_nodes].to_vec(),
            down: of(0),
            entry: of(1),
            up: of(2),
            extent: (0, right.unwrap_or(0)),
        }
    }
}
