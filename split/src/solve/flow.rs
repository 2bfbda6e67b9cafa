//! Maximum flow and minimum cut, with the algorithm of Dinic.
//!
//! E. A. Dinic: Algorithm for solution of a problem of maximum flow in networks with power estimation, 1970.

/// A network with integer capacities. An edge and its reverse have the indices 2 i and 2 i + 1.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    /// By node: its edges.
    edges: Vec<Vec<u32>>,
    to: Vec<u32>,
    /// By edge: the remaining capacity.
    left: Vec<i64>,
    /// The changes of `left` since the log was cleared.
    log: Vec<(u32, i64)>,
    levels: Vec<u32>,
    /// By node: the number of its edges that are exhausted in this phase.
    tried: Vec<usize>,
    /// The number of visited edges.
    pub(super) work: u64,
}

/// No level: not reached.
const NONE: u32 = u32::MAX;

impl Network {
    pub(super) fn new(nodes: usize) -> Self {
        Self { edges: vec![Vec::new(); nodes], ..Self::default() }
    }

    pub(super) fn add_node(&mut self) -> usize {
        self.edges.push(Vec::new());
        self.edges.len() - 1
    }

    /// Adds an edge with its capacity in both directions.
    pub(super) fn add_edge(&mut self, from: usize, to: usize, forward: i64, backward: i64) {
        for (a, b, capacity) in [(from, to, forward), (to, from, backward)] {
            self.edges[a].push(index(self.to.len()));
            self.to.push(index(b));
            self.left.push(capacity);
        }
    }

    /// Adds flow until no path is left, or until `limit` is reached. Returns the added flow.
    pub(super) fn add_flow(&mut self, from: usize, to: usize, limit: i64) -> i64 {
        let mut flow = 0;
        while flow < limit && self.set_levels(from, to) {
            self.tried.clear();
            self.tried.resize(self.edges.len(), 0);
            while flow < limit {
                let added = self.add_path(from, to, limit - flow);
                if added == 0 {
                    break;
                }
                flow += added;
            }
        }
        flow
    }

    /// Removes all flow that was added since the last call of [`Self::keep`].
    pub(super) fn undo(&mut self) {
        for (edge, amount) in std::mem::take(&mut self.log) {
            self.left[edge as usize] += amount;
            self.left[edge as usize ^ 1] -= amount;
        }
    }

    /// Makes the flow permanent.
    pub(super) fn keep(&mut self) {
        self.log.clear();
    }

    /// By node: true if more flow can reach it.
    pub(super) fn reached(&mut self, from: usize) -> Vec<bool> {
        self.set_levels(from, usize::MAX);
        self.levels.iter().map(|&level| level != NONE).collect()
    }

    /// Numbers the nodes by distance. Returns true if `to` is reached.
    fn set_levels(&mut self, from: usize, to: usize) -> bool {
        self.levels.clear();
        self.levels.resize(self.edges.len(), NONE);
        self.levels[from] = 0;
        let mut queue = vec![from];
        let mut next = 0;
        while next < queue.len() {
            let node = queue[next];
            next += 1;
            self.work += self.edges[node].len() as u64;
            for &edge in &self.edges[node] {
                let target = self.to[edge as usize] as usize;
                if self.left[edge as usize] > 0 && self.levels[target] == NONE {
                    self.levels[target] = self.levels[node] + 1;
                    if target == to {
                        return true;
                    }
                    queue.push(target);
                }
            }
        }
        false
    }

    /// Adds flow on one path along the levels, and returns it; 0 if there is no path.
    fn add_path(&mut self, from: usize, to: usize, limit: i64) -> i64 {
        let mut path: Vec<u32> = Vec::new();
        let mut node = from;
        while node != to {
            self.work += 1;
            if let Some(&edge) = self.edges[node].get(self.tried[node]) {
                let target = self.to[edge as usize] as usize;
                if self.left[edge as usize] > 0
                    && self.levels[target] != NONE
                    && self.levels[target] == self.levels[node] + 1
                {
                    path.push(edge);
                    node = target;
                } else {
                    self.tried[node] += 1;
                }
            } else if let Some(edge) = path.pop() {
                node = self.to[edge as usize ^ 1] as usize;
                self.tried[node] += 1;
            } else {
                return 0;
            }
        }
        let added = path.iter().map(|&edge| self.left[edge as usize]).fold(limit, i64::min);
        for edge in path {
            self.left[edge as usize] -= added;
            self.left[edge as usize ^ 1] += added;
            self.log.push((edge, added));
        }
        added
    }
}

/// Problems have far fewer nodes and nets than 2^32.
fn index(index: usize) -> u32 {
    index as u32
}
