//! Local search in the manner of Fiduccia and Mattheyses, for several parts and resources.
//!
//! C. M. Fiduccia, R. M. Mattheyses: A linear-time heuristic for improving network partitions, 1982. A pass moves each node at most once, always the best
//! move even if it makes things worse, and keeps the best state on the way. Here a move may exceed a capacity; the next moves then have to repair this, which
//! allows one node to be exchanged for several. Moves are compared by the objective plus the priced use of scarce resources.

use std::collections::BTreeSet;

use super::model::{Model, parts_of};
use super::problem::PartIndex;
use super::state::{Prices, State, UNIT, bill};

/// The number of moves of a queue that are tried to find one that repairs.
const SCAN: usize = 400;

/// A good placement of the free nodes, feasible if the state's excess is 0.
pub(super) fn search<'a>(
    model: &'a Model,
    warm: Option<&[Option<PartIndex>]>,
    passes: u32,
) -> State<'a> {
    let mut best: Option<State<'a>> = None;
    let density = density(model);
    let empty = vec![None; model.nodes.len()];
    let starts = [warm, Some(&empty[..])];
    for start in starts.into_iter().flatten() {
        for quarter in [4, 2, 1, 0] {
            let prices = part_of(&density, quarter);
            let placed = start
                .iter()
                .enumerate()
                .map(|(node, part)| part.unwrap_or_else(|| cheapest(model, node, &prices)))
                .collect();
            let mut state = State::new(model, placed);
            improve(&mut state, &prices, passes);
            if best.as_ref().is_none_or(|best| is_better(&state, best)) {
                best = Some(state);
            }
        }
    }
    let mut state = best.unwrap_or_else(|| State::new(model, Vec::new()));
    for quarter in [3, 1, 0, 2] {
        improve(&mut state, &part_of(&density, quarter), passes);
    }
    state
}

fn is_better(a: &State, b: &State) -> bool {
    (a.excess, a.value) < (b.excess, b.value)
}

/// The part on which a node has the lowest cost, with its use there.
fn cheapest(model: &Model, node: usize, prices: &Prices) -> PartIndex {
    let node = &model.nodes[node];
    parts_of(node.allowed)
        .min_by_key(|&part| node.cost[part] * UNIT + bill(&node.uses[part], &prices.capacity[part]))
        .unwrap_or(0)
}

/// For each limited resource, the average gain per unit of the nodes that would be cheaper there.
pub(super) fn density(model: &Model) -> Prices {
    let mut prices = Prices::zero(model);
    for part in 0..model.parts {
        let mut gain = 0i64;
        let mut uses = vec![0i64; model.resources];
        for node in model.nodes.iter().filter(|node| node.allowed >> part & 1 == 1) {
            let others = parts_of(node.allowed & !(1 << part)).map(|other| node.cost[other]).min();
            gain += others.map_or(0, |other| (other - node.cost[part]).max(0));
            uses.iter_mut().zip(&node.uses[part]).for_each(|(sum, amount)| *sum += amount);
        }
        for (resource, uses) in uses.into_iter().enumerate() {
            if model.capacity[part][resource].is_some() && uses > 0 {
                prices.capacity[part][resource] = gain.saturating_mul(UNIT) / uses;
            }
        }
        let pins: i64 = model.nets.iter().map(|net| net.pins).sum();
        if model.pins[part].is_some() && pins > 0 {
            prices.pins[part] = gain.saturating_mul(UNIT) / pins / 2;
        }
    }
    prices
}

fn part_of(prices: &Prices, quarters: i64) -> Prices {
    let scale = |price: &i64| price / 4 * quarters;
    Prices {
        capacity: prices.capacity.iter().map(|row| row.iter().map(scale).collect()).collect(),
        pins: prices.pins.iter().map(scale).collect(),
    }
}

/// Repeats passes until one brings no improvement.
pub(super) fn improve(state: &mut State, prices: &Prices, passes: u32) {
    for _ in 0..passes {
        let before = (state.excess, state.value);
        pass(state, prices);
        if (state.excess, state.value) >= before {
            break;
        }
    }
}

/// The moves by their effect, best first.
struct Queue {
    entries: BTreeSet<(i64, usize, PartIndex)>,
    /// By node: the keys of its entries; `None` if it has already moved.
    keys: Vec<Option<Vec<(i64, PartIndex)>>>,
}

impl Queue {
    fn new(state: &State, prices: &Prices) -> Self {
        let nodes = state.model.nodes.len();
        let mut queue = Self { entries: BTreeSet::new(), keys: vec![Some(Vec::new()); nodes] };
        (0..nodes).for_each(|node| queue.renew(state, prices, node));
        queue
    }

    fn renew(&mut self, state: &State, prices: &Prices, node: usize) {
        let Some(keys) = &mut self.keys[node] else { return };
        let others = state.model.nodes[node].allowed & !(1 << state.part[node]);
        let new: Vec<_> =
            parts_of(others).map(|part| (state.priced(node, part, prices), part)).collect();
        if *keys != new {
            for &(key, part) in keys.iter() {
                self.entries.remove(&(key, node, part));
            }
            self.entries.extend(new.iter().map(|&(key, part)| (key, node, part)));
            *keys = new;
        }
    }

    fn lock(&mut self, node: usize) {
        if let Some(keys) = self.keys[node].take() {
            for (key, part) in keys {
                self.entries.remove(&(key, node, part));
            }
        }
    }

    /// The best move; if the state does not fit, the best one that reduces the excess.
    fn choose(&self, state: &State) -> Option<(usize, PartIndex)> {
        let mut entries = self.entries.iter().map(|&(_, node, part)| (node, part));
        if state.excess == 0 {
            return entries.next();
        }
        entries
            .take(SCAN)
            .find(|&(node, part)| state.effect(node, part).excess < 0)
            .or_else(|| self.nearest(state))
    }

    fn nearest(&self, state: &State) -> Option<(usize, PartIndex)> {
        let moves = self.entries.iter().map(|&(_, node, part)| (node, part));
        let repair = moves
            .map(|(node, part)| (state.effect(node, part).excess, node, part))
            .find(|&(excess, ..)| excess < 0);
        repair.map(|(_, node, part)| (node, part))
    }
}

fn pass(state: &mut State, prices: &Prices) {
    let mut queue = Queue::new(state, prices);
    let mut best = (state.excess, state.value);
    let mut log: Vec<(usize, PartIndex)> = Vec::new();
    let mut kept = 0;
    let patience = 50 + state.model.nodes.len() / 4;
    let mut touched = BTreeSet::new();
    while let Some((node, to)) = queue.choose(state) {
        let from = state.part[node];
        queue.lock(node);
        touched.clear();
        state.apply(node, to, |node| touched.extend([node]));
        touched.iter().for_each(|&node| queue.renew(state, prices, node));
        log.push((node, from));
        if (state.excess, state.value) < best {
            best = (state.excess, state.value);
            kept = log.len();
        } else if log.len() - kept > patience {
            break;
        }
    }
    for &(node, from) in log[kept..].iter().rev() {
        state.apply(node, from, |_| ());
    }
}
