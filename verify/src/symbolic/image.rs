//! Images of sets of states under one reaction, as decision diagrams [Burch, Clarke, Long 1991]. The relation is a list of parts, each for a few bits
//! of the next state, and each variable is quantified as soon as no later part mentions it [Ranjan, Aziz, Brayton, Plessier, Pixley 1995].
//!
//! Levels: a bit of the state has an even level, and its value after the reaction has the next odd level; inputs have even levels.

use grafsynth_logic::bdd::{Bdd, Full, Ref};

/// Parts of the relation are joined up to this size. Larger parts save passes over the set, smaller ones quantify earlier; the exact value matters
/// little.
const CLUSTER: usize = 400;
/// The minimum number of nodes at which garbage is collected.
const SWEEP: usize = 1 << 16;

/// The level of the same bit of the next state.
pub(super) fn after(level: u32) -> u32 {
    level | 1
}

/// A restriction of one reaction: a function of state and inputs, and of the next state if the part defines a bit of that state.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) relation: Ref,
    /// The levels of the state bits and inputs that the part reads.
    pub(super) reads: Vec<u32>,
}

/// Joined parts, and the variables that are quantified after them.
#[derive(Debug, Clone)]
struct Cluster {
    relation: Ref,
    done: Ref,
}

/// A manager of decision diagrams, with the relation and the functions that its client keeps.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) bdd: Bdd,
    clusters: Vec<Cluster>,
    /// The state bits that no part reads.
    unread: Ref,
    /// All levels of state and inputs.
    pub(super) all: Ref,
    /// Functions of the client; [`Machine::tidy`] updates their references.
    pub(super) kept: Vec<Ref>,
    next_sweep: usize,
}

impl Machine {
    /// A machine with this relation; `state` and `inputs` are the levels of the bits before the reaction.
    ///
    /// # Errors
    /// If the manager is full.
    pub(super) fn new(
        mut bdd: Bdd,
        parts: Vec<Part>,
        state: &[u32],
        inputs: &[u32],
        kept: Vec<Ref>,
    ) -> Result<Self, Full> {
        let n_levels = state.iter().chain(inputs).max().map_or(0, |level| *level as usize + 2);
        let parts = sorted(parts, n_levels);
        let mut is_state = vec![false; n_levels];
        state.iter().for_each(|level| is_state[*level as usize] = true);
        // For each level, the last part that reads it.
        let mut last: Vec<Option<usize>> = vec![None; n_levels];
        let mut first: Vec<Option<usize>> = vec![None; n_levels];
        for (at, part) in parts.iter().enumerate() {
            for level in &part.reads {
                last[*level as usize] = Some(at);
                first[*level as usize].get_or_insert(at);
            }
        }
        let mut clusters: Vec<Cluster> = Vec::new();
        let mut from = 0;
        while from < parts.len() {
            let mut relation = parts[from].relation;
            let mut to = from + 1;
            while to < parts.len() && bdd.size(relation) < CLUSTER {
                let joined = bdd.and(relation, parts[to].relation)?;
                if bdd.size(joined) > 2 * CLUSTER {
                    break;
                }
                relation = joined;
                to += 1;
            }
            let mut inner = Vec::new();
            let mut done = Vec::new();
            for (level, (last, first)) in last.iter().zip(&first).enumerate() {
                if last.is_some_and(|at| from <= at && at < to) {
                    // Sets of states do not depend on inputs, so inputs that only this cluster reads are quantified at once.
                    if !is_state[level] && first.is_some_and(|at| from <= at) {
                        inner.push(level as u32);
                    } else {
                        done.push(level as u32);
                    }
                }
            }
            let inner = bdd.cube(inner)?;
            let relation = bdd.exists(relation, inner)?;
            let done = bdd.cube(done)?;
            clusters.push(Cluster { relation, done });
            from = to;
        }
        let unread =
            bdd.cube(state.iter().copied().filter(|level| last[*level as usize].is_none()))?;
        let all = bdd.cube(state.iter().chain(inputs).copied())?;
        let mut machine = Machine { bdd, clusters, unread, all, kept, next_sweep: SWEEP };
        machine.sweep();
        Ok(machine)
    }

    /// The successors of these states after one reaction.
    ///
    /// # Errors
    /// If the manager is full.
    pub(super) fn image(&mut self, from: Ref) -> Result<Ref, Full> {
        let mut set = self.bdd.exists(from, self.unread)?;
        for cluster in &self.clusters {
            if set == Ref::FALSE {
                break;
            }
            set = self.bdd.and_exists(set, cluster.relation, cluster.done)?;
        }
        self.bdd.rename(set, |level| level & !1)
    }

    /// True if the two functions have a common point.
    ///
    /// # Errors
    /// If the manager is full.
    pub(super) fn meet(&mut self, a: Ref, b: Ref) -> Result<bool, Full> {
        Ok(self.bdd.and_exists(a, b, self.all)? != Ref::FALSE)
    }

    /// Collects garbage if there is much of it. Returns the functions with updated references.
    pub(super) fn tidy<const N: usize>(&mut self, functions: [Ref; N]) -> [Ref; N] {
        if self.bdd.len() < self.next_sweep {
            return functions;
        }
        let n_kept = self.kept.len();
        self.kept.extend(functions);
        self.sweep();
        let mut renamed = functions;
        renamed.copy_from_slice(&self.kept[n_kept..]);
        self.kept.truncate(n_kept);
        renamed
    }

    fn sweep(&mut self) {
        let mut roots = self.kept.clone();
        roots.extend(self.clusters.iter().flat_map(|cluster| [cluster.relation, cluster.done]));
        roots.extend([self.unread, self.all]);
        self.bdd.keep(&mut roots);
        let mut roots = roots.into_iter();
        let mut next = || roots.next().unwrap_or(Ref::FALSE);
        self.kept.iter_mut().for_each(|kept| *kept = next());
        for cluster in &mut self.clusters {
            cluster.relation = next();
            cluster.done = next();
        }
        self.unread = next();
        self.all = next();
        // Garbage may grow to three times the live nodes, so collecting costs no more than creating it.
        self.next_sweep = (self.bdd.len() * 4).max(SWEEP);
    }
}

/// The parts in the order in which they are joined to a set. The next one is always the part that completes the most variables for the fewest new ones; if
/// equal, the nearest one after the last.
fn sorted(parts: Vec<Part>, n_levels: usize) -> Vec<Part> {
    let mut n_left = vec![0usize; n_levels];
    for level in parts.iter().flat_map(|part| &part.reads) {
        n_left[*level as usize] += 1;
    }
    let mut left: Vec<Option<Part>> = parts.into_iter().map(Some).collect();
    let mut order = Vec::with_capacity(left.len());
    let mut is_open = vec![false; n_levels];
    let mut behind = 0;
    for _ in 0..left.len() {
        let mut best: Option<(isize, usize, usize)> = None;
        for (at, part) in left.iter().enumerate() {
            let Some(part) = part else { continue };
            let mut gain: isize = 0;
            for level in &part.reads {
                gain += 2 * isize::from(n_left[*level as usize] == 1);
                gain -= isize::from(!is_open[*level as usize]);
            }
            let distance = if at >= behind { at - behind } else { left.len() + behind - at };
            if best
                .is_none_or(|(most, nearest, _)| gain > most || gain == most && distance < nearest)
            {
                best = Some((gain, distance, at));
            }
        }
        let Some(part) = best.and_then(|(_, _, at)| {
            behind = at;
            left[at].take()
        }) else {
            break;
        };
        for level in &part.reads {
            n_left[*level as usize] -= 1;
            is_open[*level as usize] = true;
        }
        order.push(part);
    }
    order
}
