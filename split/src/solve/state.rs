//! A placement of the free nodes with all its sums, and the effect of a move.

use super::model::{FreeNode, Mask, Model, Net, parts_of};
use super::problem::PartIndex;

/// The unit of prices: a price of `UNIT` for one product term makes it as expensive as 1 in the objective.
pub(super) const UNIT: i64 = 1 << 10;

/// Prices of scarce resources, in `1 / UNIT` of the objective.
#[derive(Clone, Debug)]
pub(super) struct Prices {
    /// By part and resource.
    pub(super) capacity: Vec<Vec<i64>>,
    /// By part.
    pub(super) pins: Vec<i64>,
}

impl Prices {
    pub(super) fn zero(model: &Model) -> Self {
        Self { capacity: vec![vec![0; model.resources]; model.parts], pins: vec![0; model.parts] }
    }
}

/// A placement of the free nodes.
#[derive(Clone, Debug)]
pub(super) struct State<'a> {
    pub(super) model: &'a Model,
    pub(super) part: Vec<PartIndex>,
    /// By net, then part: the number of free members on the part.
    counts: Vec<Vec<u32>>,
    /// By part and resource.
    used: Vec<Vec<i64>>,
    pins: Vec<i64>,
    /// By forbidden set: the number of its decisions that are made.
    met: Vec<usize>,
    pub(super) value: i64,
    /// The excess over the limits; 0 if it fits.
    pub(super) excess: i64,
}

/// The effect of a move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effect {
    pub(super) value: i64,
    pub(super) excess: i64,
}

impl<'a> State<'a> {
    /// The state of a placement; each part must be allowed for its node.
    pub(super) fn new(model: &'a Model, part: Vec<PartIndex>) -> Self {
        let mut state = Self {
            model,
            counts: vec![vec![0; model.parts]; model.nets.len()],
            used: vec![vec![0; model.resources]; model.parts],
            pins: vec![0; model.parts],
            met: vec![0; model.forbidden.len()],
            value: model.base,
            excess: 0,
            part,
        };
        for (node, &part) in model.nodes.iter().zip(&state.part) {
            state.value += node.cost[part];
            state.used[part]
                .iter_mut()
                .zip(&node.uses[part])
                .for_each(|(sum, amount)| *sum += amount);
            node.nets.iter().for_each(|&net| state.counts[net][part] += 1);
        }
        for (net, counts) in model.nets.iter().zip(&state.counts) {
            let present = present(net, counts);
            state.value += net.cost_on(present);
            parts_of(net.pinned(present)).for_each(|part| state.pins[part] += net.pins);
        }
        for (set, met) in model.forbidden.iter().zip(&mut state.met) {
            *met = set.iter().filter(|&&(node, part)| state.part[node] == part).count();
        }
        state.excess = state.whole_excess();
        state
    }

    fn whole_excess(&self) -> i64 {
        let capacities = self.model.capacity.iter().flatten().zip(self.used.iter().flatten());
        let pins = self.model.pins.iter().zip(&self.pins);
        let sets = self
            .model
            .forbidden
            .iter()
            .zip(&self.met)
            .filter(|(set, met)| set.len() == **met)
            .count();
        capacities.chain(pins).fold(scaled(sets), |sum, (capacity, &used)| {
            sum.saturating_add(excess(*capacity, used))
        })
    }

    /// The effect of moving a node to another part.
    pub(super) fn effect(&self, node: usize, to: PartIndex) -> Effect {
        let FreeNode { cost, uses, .. } = &self.model.nodes[node];
        let from = self.part[node];
        let (net_value, pins) = self.net_changes(node, to);
        let mut change = self.forbidden_change(node, to);
        for (part, sign) in [(from, -1), (to, 1)] {
            let limits = self.model.capacity[part].iter().zip(&self.used[part]);
            change += limits
                .zip(&uses[part])
                .map(|((limit, used), amount)| step(*limit, *used, sign * amount))
                .sum::<i64>();
        }
        for (part, &pins) in pins.iter().enumerate().take(self.model.parts) {
            if pins != 0 {
                change += step(self.model.pins[part], self.pins[part], pins);
            }
        }
        Effect { value: cost[to] - cost[from] + net_value, excess: change }
    }

    /// The change of the objective plus priced use by a move of a node, in `1 / UNIT`.
    pub(super) fn priced(&self, node: usize, to: PartIndex, prices: &Prices) -> i64 {
        let FreeNode { cost, uses, .. } = &self.model.nodes[node];
        let from = self.part[node];
        let (net_value, pins) = self.net_changes(node, to);
        let change = bill(&uses[to], &prices.capacity[to])
            - bill(&uses[from], &prices.capacity[from])
            + bill(&pins, &prices.pins);
        (cost[to] - cost[from] + net_value) * UNIT + change
    }

    /// The changes of the cost of the nets and of the pins by part.
    fn net_changes(&self, node: usize, to: PartIndex) -> (i64, [i64; 16]) {
        let from = self.part[node];
        let (mut value, mut pins) = (0, [0; 16]);
        for &index in &self.model.nodes[node].nets {
            let (net, counts) = (&self.model.nets[index], &self.counts[index]);
            let before = present(net, counts);
            let mut after = before | 1 << to;
            if counts[from] == 1 && net.placed >> from & 1 == 0 {
                after &= !(1 << from);
            }
            if before != after {
                value += net.cost_on(after) - net.cost_on(before);
                let (old, new) = (net.pinned(before), net.pinned(after));
                parts_of(new & !old).for_each(|part| pins[part] += net.pins);
                parts_of(old & !new).for_each(|part| pins[part] -= net.pins);
            }
        }
        (value, pins)
    }

    fn forbidden_change(&self, node: usize, to: PartIndex) -> i64 {
        let from = self.part[node];
        let mut change = 0;
        for &index in &self.model.nodes[node].forbidden {
            let set = &self.model.forbidden[index];
            let is_met = set.len() == self.met[index];
            let met = self.met[index] + usize::from(set.contains(&(node, to)))
                - usize::from(set.contains(&(node, from)));
            change += scaled(usize::from(met == set.len())) - scaled(usize::from(is_met));
        }
        change
    }

    /// Moves a node, and calls `touch` with each node whose move may now have another effect.
    pub(super) fn apply(&mut self, node: usize, to: PartIndex, mut touch: impl FnMut(usize)) {
        let effect = self.effect(node, to);
        let (from, (_, pins)) = (self.part[node], self.net_changes(node, to));
        self.value += effect.value;
        self.excess += effect.excess;
        self.pins.iter_mut().zip(pins).for_each(|(sum, change)| *sum += change);
        let data = &self.model.nodes[node];
        self.used[from].iter_mut().zip(&data.uses[from]).for_each(|(sum, amount)| *sum -= amount);
        self.used[to].iter_mut().zip(&data.uses[to]).for_each(|(sum, amount)| *sum += amount);
        for &index in &data.forbidden {
            let set = &self.model.forbidden[index];
            self.met[index] += usize::from(set.contains(&(node, to)));
            self.met[index] -= usize::from(set.contains(&(node, from)));
        }
        for &index in &data.nets {
            let counts = &mut self.counts[index];
            counts[from] -= 1;
            counts[to] += 1;
            // Otherwise no member is the first or the last one on a part that was not so before.
            if counts[from] < 2 || counts[to] < 3 {
                self.model.nets[index].members.iter().for_each(|&member| touch(member));
            }
        }
        self.part[node] = to;
    }

    /// The use of each limited resource: capacities by part, pins, and the decisions of forbidden sets.
    pub(super) fn loads(&self) -> impl Iterator<Item = i64> {
        let limited = self.uses().filter(|(limit, _)| limit.is_some()).map(|(_, used)| used);
        limited.chain(self.met.iter().map(|&met| i64::try_from(met).unwrap_or(i64::MAX)))
    }

    /// The uses of all capacities, then of the pins, each with its limit.
    pub(super) fn uses(&self) -> impl Iterator<Item = (Option<i64>, i64)> {
        let capacities = self.model.capacity.iter().flatten().zip(self.used.iter().flatten());
        capacities
            .chain(self.model.pins.iter().zip(&self.pins))
            .map(|(capacity, used)| (*capacity, *used))
    }
}

/// The cost of amounts at given prices. Each term is clamped, so that no sum of such costs overflows.
pub(super) fn bill(amounts: &[i64], prices: &[i64]) -> i64 {
    const MOST: i64 = 1 << 55;
    amounts
        .iter()
        .zip(prices)
        .map(|(amount, price)| amount.saturating_mul(*price).clamp(-MOST, MOST))
        .sum()
}

/// The parts on which a net has a member.
fn present(net: &Net, counts: &[u32]) -> Mask {
    counts
        .iter()
        .enumerate()
        .fold(net.placed, |mask, (part, &count)| mask | Mask::from(count > 0) << part)
}

/// One unit of excess for each thousandth of the capacity that is exceeded, so that small and large capacities have the same weight.
fn excess(capacity: Option<i64>, used: i64) -> i64 {
    match capacity {
        Some(capacity) if used > capacity => {
            ((used - capacity) * 1000 / (capacity.max(0) + 1)).max(1)
        }
        _ => 0,
    }
}

fn step(capacity: Option<i64>, used: i64, change: i64) -> i64 {
    if change == 0 { 0 } else { excess(capacity, used + change) - excess(capacity, used) }
}

fn scaled(sets: usize) -> i64 {
    i64::try_from(sets).unwrap_or(i64::MAX).saturating_mul(1000)
}
