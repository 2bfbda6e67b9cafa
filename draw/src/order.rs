//! The rows of a graph: which links lead up, and in which row each node is.
//!
//! A depth-first search from the initial steps finds the links that lead back. On the rest, the row of a node is the length of the longest path to it, and the
//! dominators show the blocks: a node is drawn below its dominator.

/// A link between two nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Arc {
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// The space that a node needs, and its links.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Node {
    /// Pixels to the left of the axis.
    pub(crate) left: i64,
    /// Pixels to the right of the axis.
    pub(crate) right: i64,
    /// Pixels from the top of the node, with all marks, to the end of the link from above.
    pub(crate) above: i64,
    /// Pixels from the end of the link from above to the beginning of the link below.
    pub(crate) body: i64,
    /// Pixels from the beginning of the link below to the bottom of the node, with all marks.
    pub(crate) below: i64,
    /// True for an initial step.
    pub(crate) is_initial: bool,
    /// True for a transition: several links on one side need a double line.
    pub(crate) is_transition: bool,
}

/// A graph to be laid out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Graph {
    pub(crate) nodes: Vec<Node>,
    pub(crate) arcs: Vec<Arc>,
    /// For each node its links downwards, in order.
    pub(crate) outs: Vec<Vec<usize>>,
    /// For each node the links to it, in order.
    pub(crate) ins: Vec<Vec<usize>>,
    /// True on paper: less space between the rows, so that fewer links are cut between pages.
    pub(crate) is_dense: bool,
}

impl Graph {
    pub(crate) fn new(nodes: Vec<Node>, arcs: Vec<Arc>) -> Self {
        let mut outs = vec![Vec::new(); nodes.len()];
        let mut ins = vec![Vec::new(); nodes.len()];
        for (index, arc) in arcs.iter().enumerate() {
            outs[arc.from].push(index);
            ins[arc.to].push(index);
        }
        Graph { nodes, arcs, outs, ins, is_dense: false }
    }

    /// The sets of connected nodes, in the order of their first nodes.
    pub(crate) fn components(&self) -> Vec<Vec<usize>> {
        let mut component = vec![usize::MAX; self.nodes.len()];
        let mut all: Vec<Vec<usize>> = Vec::new();
        for start in 0..self.nodes.len() {
            if component[start] != usize::MAX {
                continue;
            }
            component[start] = all.len();
            let mut members = vec![start];
            let mut next = 0;
            while let Some(&node) = members.get(next) {
                next += 1;
                let below = self.outs[node].iter().map(|arc| self.arcs[*arc].to);
                let above = self.ins[node].iter().map(|arc| self.arcs[*arc].from);
                for other in below.chain(above) {
                    if component[other] == usize::MAX {
                        component[other] = all.len();
                        members.push(other);
                    }
                }
            }
            members.sort_unstable();
            all.push(members);
        }
        all
    }
}

/// The order of the nodes of a graph.
#[derive(Debug, Clone)]
pub(crate) struct Order {
    /// For each link whether it leads up.
    pub(crate) is_back: Vec<bool>,
    /// The nodes; each link that does not lead up goes from an earlier to a later node.
    pub(crate) nodes: Vec<usize>,
    /// The position of each node in `nodes`.
    pub(crate) position: Vec<usize>,
    /// The row of each node, from 0.
    pub(crate) row: Vec<usize>,
    /// The immediate dominator of each node; the number of nodes stands for the root above all.
    pub(crate) dominator: Vec<usize>,
    /// For each link that leads up, whether it takes the longer way around its block.
    pub(crate) takes_longer_way: Vec<bool>,
}

impl Order {
    pub(crate) fn of(graph: &Graph) -> Self {
        let n = graph.nodes.len();
        let (is_back, nodes) = search(graph);
        let mut position = vec![0; n + 1];
        for (index, node) in nodes.iter().enumerate() {
            position[*node] = index + 1;
        }
        let takes_longer_way = vec![false; graph.arcs.len()];
        let (row, dominator) = (vec![0; n], vec![n; n]);
        let mut order = Order { is_back, nodes, position, row, dominator, takes_longer_way };
        order.set_rows(graph);
        order.set_dominators(graph, n);
        order
    }

    /// True if a link that leads up first goes down from a fork, whose double line then stays short.
    pub(crate) fn turns_below(&self, graph: &Graph, arc: usize) -> bool {
        let from = graph.arcs[arc].from;
        self.is_back[arc] && graph.nodes[from].is_transition && graph.outs[from].len() > 1
    }

    /// True if a link that leads up goes down to a join at its end, because links meet at a double line from above.
    pub(crate) fn turns_above(&self, graph: &Graph, arc: usize) -> bool {
        let to = graph.arcs[arc].to;
        self.is_back[arc] && graph.nodes[to].is_transition && graph.ins[to].len() > 1
    }

    fn set_rows(&mut self, graph: &Graph) {
        for &node in &self.nodes {
            let is_join = graph.ins[node].len() > 1;
            // A link from below to a join turns above it, which takes a row.
            let turns = graph.ins[node].iter().any(|arc| self.turns_above(graph, *arc));
            let least = if turns { 2 } else { 0 };
            self.row[node] = least;
            for &arc in graph.ins[node].iter().filter(|arc| !self.is_back[**arc]) {
                let from = graph.arcs[arc].from;
                // A link between a divergence and a convergence needs a column of its own, which the rows between them provide.
                let rows = if is_join && graph.outs[from].len() > 1 { 3 } else { 1 };
                self.row[node] = self.row[node].max(self.row[from] + rows + least);
            }
        }
        // Source transitions and references move down to what follows them.
        for &node in self.nodes.iter().rev() {
            if graph.ins[node].is_empty() && !graph.nodes[node].is_initial {
                let rows = |to: usize| {
                    if graph.ins[to].len() > 1 && graph.outs[node].len() > 1 { 3 } else { 1 }
                };
                let down = graph.outs[node].iter().filter(|arc| !self.is_back[**arc]);
                let below = down.map(|arc| graph.arcs[*arc].to);
                let row = below.map(|to| self.row[to].saturating_sub(rows(to))).min();
                self.row[node] = row.unwrap_or(0).max(self.row[node]);
            }
        }
    }

    fn set_dominators(&mut self, graph: &Graph, root: usize) {
        for index in 0..self.nodes.len() {
            let node = self.nodes[index];
            let mut dominator = None;
            for &arc in graph.ins[node].iter().filter(|arc| !self.is_back[**arc]) {
                let from = graph.arcs[arc].from;
                dominator = Some(match dominator {
                    None => from,
                    Some(other) => self.common(other, from),
                });
            }
            self.dominator[node] = dominator.unwrap_or(root);
        }
    }

    /// The lowest node that dominates both.
    pub(crate) fn common(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            if self.position[a] < self.position[b] {
                b = self.dominator[b];
            } else {
                a = self.dominator[a];
            }
        }
        a
    }
}

/// The links that lead up, and the nodes in an order of the other links.
fn search(graph: &Graph) -> (Vec<bool>, Vec<usize>) {
    let n = graph.nodes.len();
    let mut is_back = vec![false; graph.arcs.len()];
    let (mut is_known, mut is_open) = (vec![false; n], vec![false; n]);
    let mut finished = Vec::with_capacity(n);
    // The last search comes first in the order, so the first initial step is searched last.
    let initial = (0..n).rev().filter(|node| graph.nodes[*node].is_initial);
    let sources = (0..n).filter(|node| graph.ins[*node].is_empty());
    for start in initial.chain(sources).chain(0..n) {
        if is_known[start] {
            continue;
        }
        is_known[start] = true;
        is_open[start] = true;
        let mut path = vec![(start, 0)];
        while let Some((node, next)) = path.last_mut() {
            let node = *node;
            // The links are followed from the last, so that the reversed order begins with the first.
            let link = graph.outs[node].iter().rev().nth(*next);
            *next += 1;
            let Some(&arc) = link else {
                is_open[node] = false;
                finished.push(node);
                path.pop();
                continue;
            };
            let to = graph.arcs[arc].to;
            // Initial steps are in the first row, so every link to one leads up.
            if is_open[to] || graph.nodes[to].is_initial {
                is_back[arc] = true;
            } else if !is_known[to] {
                is_known[to] = true;
                is_open[to] = true;
                path.push((to, 0));
            }
        }
    }
    finished.reverse();
    (is_back, finished)
}
