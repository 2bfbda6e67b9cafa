//! Fewer crossings: branches that change places, and links that lead up on the other side.
//!
//! A chart is first laid out as it was written. Only if links cross, branches below a node are exchanged, or a link that leads up is moved to the other side of
//! its block, for as long as each change makes the crossings fewer, or the drawing smaller with as many crossings. Then the search starts again from other
//! orders. So a drawing without crossings keeps the order of its source. If links still cross, the search goes on without blocks (`layered`), and what it finds is
//! drawn if it has fewer crossings.
//!
//! The search may use other sizes of symbols than the drawing has: what is added or left blank does not change the order.

use crate::blocks;
use crate::channels::{Placed, Tried, place};
use crate::layered;
use crate::order::{Graph, Node, Order};

/// The work for one graph: the number of layouts that are tried, times the square of the number of nodes. The blocks of a large graph without structure rarely
/// become free of crossings, so most of its work is in the search without blocks.
const WORK: usize = 200_000;
/// The work of the search without blocks: the number of layouts, times that of the rows of all pieces.
const WORK_OF_ROWS: usize = 90_000;
/// A larger graph is laid out only once.
const MOST_NODES: usize = 600;

/// A change of a layout.
#[derive(Debug, Clone, Copy)]
enum Change {
    /// The branches of this node at these places are exchanged.
    Branches(usize, usize, usize),
    /// All branches from this node on are in the opposite order.
    Mirror(usize),
    /// This link takes the other way if it leads up.
    Side(usize),
}

/// What the drawing of a graph depends on.
#[derive(Debug, Clone)]
struct Choice {
    graph: Graph,
    /// For each link whether it takes the longer way around its block if it leads up.
    longer_way: Vec<bool>,
}

/// Lays out a connected graph. The sizes of its nodes decide about the order; `drawn` are those that the drawing has.
pub(crate) fn lay_out(graph: &Graph, drawn: Vec<Node>) -> Placed {
    let mut choice = Choice { graph: graph.clone(), longer_way: vec![false; graph.arcs.len()] };
    let mut best = choice.tried();
    let mut best_choice = choice.clone();
    let n_nodes = graph.nodes.len();
    if best.cost.0 == 0 || n_nodes > MOST_NODES {
        return best_choice.drawn(best, drawn);
    }
    let mut left = WORK / n_nodes.pow(2).max(1);
    let changes = choice.changes();
    for start in 0.. {
        let found = choice.improved(&changes, &mut left);
        if found.cost < best.cost {
            best = found;
            best_choice = choice.clone();
        }
        if left == 0 || best.cost.0 == 0 || changes.is_empty() {
            break;
        }
        // Another start: every so many changes.
        let step = 2 + start % 5;
        changes.iter().skip(start).step_by(step).for_each(|change| choice.make(*change));
    }
    if best.cost.0 > 0 {
        let order = best_choice.order();
        let columns = blocks::columns(&best_choice.graph, &order);
        let graph = &mut best_choice.graph;
        let (found, places) = layered::improved(graph, &order, &columns, WORK_OF_ROWS);
        if found.cost.0 < best.cost.0 {
            if graph.nodes == drawn {
                return found.placed;
            }
            graph.nodes = drawn;
            return layered::ordered(graph, &order, &places);
        }
    }
    best_choice.drawn(best, drawn)
}

impl Choice {
    fn order(&self) -> Order {
        let mut order = Order::of(&self.graph);
        order.takes_longer_way.clone_from(&self.longer_way);
        order
    }

    fn tried(&self) -> Tried {
        let order = self.order();
        let placed = place(&self.graph, &order, &blocks::columns(&self.graph, &order));
        Tried::new(placed)
    }

    /// The layout with other sizes of nodes; `own` is that with the sizes of the graph.
    fn drawn(mut self, own: Tried, nodes: Vec<Node>) -> Placed {
        if self.graph.nodes == nodes {
            return own.placed;
        }
        self.graph.nodes = nodes;
        self.tried().placed
    }

    /// All changes.
    fn changes(&self) -> Vec<Change> {
        let graph = &self.graph;
        let branches = graph.outs.iter().enumerate().flat_map(|(node, outs)| {
            let pairs = (1..outs.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
            pairs.map(move |(a, b)| Change::Branches(node, a, b))
        });
        let nodes = 0..graph.nodes.len();
        let mirrors = nodes.filter(|node| graph.outs[*node].len() > 1).map(Change::Mirror);
        branches.chain(mirrors).chain((0..graph.arcs.len()).map(Change::Side)).collect()
    }

    /// Makes each change that helps, until none does or `left` layouts were tried.
    fn improved(&mut self, changes: &[Change], left: &mut usize) -> Tried {
        let mut best = self.tried();
        // The number of changes since the last one that helped.
        let mut in_vain = 0;
        for change in changes.iter().cycle() {
            if *left == 0 || best.cost.0 == 0 || in_vain == changes.len() {
                break;
            }
            *left -= 1;
            in_vain += 1;
            let before = self.clone();
            self.make(*change);
            let other = self.tried();
            if other.cost < best.cost {
                if other.cost.0 < best.cost.0 {
                    in_vain = 0;
                }
                best = other;
            } else {
                *self = before;
            }
        }
        best
    }

    fn make(&mut self, change: Change) {
        match change {
            Change::Branches(node, a, b) => self.graph.outs[node].swap(a, b),
            Change::Mirror(top) => {
                let order = Order::of(&self.graph);
                for (node, outs) in self.graph.outs.iter_mut().enumerate() {
                    if order.common(node, top) == top {
                        outs.reverse();
                    }
                }
            }
            Change::Side(arc) => self.longer_way[arc] = !self.longer_way[arc],
        }
    }
}
