//! The Lagrangian bound for two parts: capacities and pins become prices, and the remaining problem is a minimum cut.
//!
//! With a price for each capacity, for the pins and for each forbidden set, the cheapest placement is a minimum cut, computed exactly in integers. Its
//! value minus the price of the available amounts is a lower bound. The best prices are found by cutting planes in a region around the best ones so far. The bound equals
//! that of the linear relaxation, in a small part of the time. Afterwards, a node whose move to the other side would cost more than the gap is decided.

use microlp::{ComparisonOp, OptimizationDirection};

use super::flow::Network;
use super::local;
use super::model::{Kind, Model, Net};
use super::problem::PartIndex;
use super::state::{Prices, State, UNIT};

/// The nodes of the network: part 0 is the side of the source.
const SOURCE: usize = 0;
const SINK: usize = 1;

/// More than any sum of capacities.
const INFINITE: i64 = i64::MAX / 4;

/// The largest step of a price.
const LARGEST: i64 = 1 << 50;

/// The maximum number of prices.
const MOST_ROWS: usize = 60;

/// The result of the bound.
#[derive(Clone, Debug)]
pub(super) struct Dual {
    /// No placement has a smaller objective.
    pub(super) bound: i64,
    /// The best feasible placement that was found.
    pub(super) best: Option<(i64, Vec<PartIndex>)>,
    /// By node: its part in every placement that is better than the best one.
    pub(super) decided: Vec<Option<PartIndex>>,
}

/// Computes the bound with at most `cuts` minimum cuts; `None` unless there are two parts, few prices and small numbers.
pub(super) fn bound(model: &Model, best: Option<&State>, cuts: u32, passes: u32) -> Option<Dual> {
    let best =
        best.filter(|state| state.excess == 0).map(|state| (state.value, state.part.clone()));
    let mut search = Search::new(model, best, passes)?;
    search.run(cuts)?;
    let decided = search.decide();
    Some(Dual { bound: search.bound(), best: search.best, decided })
}

/// A minimum cut at some prices: a plane above the bound as a function of the prices.
struct Plane {
    /// The objective of the placement, without the decided part.
    value: i64,
    /// By row: the excess use of the placement; negative if there is room.
    over: Vec<i64>,
}

struct Search<'a> {
    model: &'a Model,
    /// By row: the available amount.
    room: Vec<i64>,
    planes: Vec<Plane>,
    /// The best prices so far and the bound there, both in `1 / UNIT`, without the decided part.
    center: Vec<i64>,
    level: i64,
    best: Option<(i64, Vec<PartIndex>)>,
    passes: u32,
}

impl<'a> Search<'a> {
    fn new(model: &'a Model, best: Option<(i64, Vec<PartIndex>)>, passes: u32) -> Option<Self> {
        let room: Vec<_> = model.limits().collect();
        let center = vec![0; room.len()];
        (model.parts == 2 && room.len() <= MOST_ROWS).then_some(Self {
            model,
            room,
            planes: Vec::new(),
            center,
            level: i64::MIN,
            best,
            passes,
        })
    }

    fn bound(&self) -> i64 {
        // Rounded up: objectives are integers.
        self.model.base - (-self.level).div_euclid(UNIT)
    }

    fn is_closed(&self) -> bool {
        self.best.as_ref().is_some_and(|(value, _)| *value <= self.bound())
    }

    fn run(&mut self, cuts: u32) -> Option<()> {
        let density = self.model.row_prices(&local::density(self.model));
        let mut radius: Vec<i64> = density.iter().map(|&price| price.max(UNIT)).collect();
        let mut prices = self.center.clone();
        for _ in 0..cuts {
            let Some(is_better) = self.try_prices(&prices) else { break };
            if self.is_closed() {
                break;
            }
            radius.iter_mut().for_each(|radius| {
                *radius = (if is_better { *radius + *radius / 2 } else { *radius - *radius / 4 })
                    .min(LARGEST)
            });
            let Some((next, promise)) = self.best_prices(&radius) else { break };
            // Within the region nothing better than a fraction of the unit is possible, or the region shrank to a point.
            if promise * 64.0 < 1.0 || next == prices {
                break;
            }
            prices = next;
        }
        (!self.planes.is_empty()).then_some(())
    }

    /// Computes the bound at these prices. Returns true if it is the best so far.
    fn try_prices(&mut self, prices: &[i64]) -> Option<bool> {
        let (level, placement) = Cut::new(self.model, prices, &self.room)?.solve();
        let mut state = State::new(self.model, placement);
        let over = state.loads().zip(&self.room).map(|(load, room)| load - room).collect();
        self.planes.push(Plane { value: state.value - self.model.base, over });
        let is_better = level > self.level;
        // Near the best prices the cut is near a good placement.
        let gap = self.best.as_ref().map_or(0, |(value, _)| {
            (value - self.model.base).saturating_mul(UNIT).saturating_sub(self.level)
        });
        let is_near = self.level.saturating_sub(level) < gap;
        if is_better {
            self.level = level;
            self.center = prices.to_vec();
        }
        if is_better || is_near {
            local::improve(&mut state, &self.model.prices(prices), self.passes);
        }
        if state.excess == 0 && self.best.as_ref().is_none_or(|(value, _)| state.value < *value) {
            self.best = Some((state.value, state.part));
        }
        Some(is_better)
    }

    /// The prices in the region around the center at which the planes are highest, and how much higher than the center that is.
    fn best_prices(&self, radius: &[i64]) -> Option<(Vec<i64>, f64)> {
        let mut program = microlp::Problem::new(OptimizationDirection::Maximize);
        let unit = UNIT as f64;
        let height = program.add_var(1.0, (f64::NEG_INFINITY, f64::INFINITY));
        let range = |(&center, &radius): (&i64, &i64)| {
            ((center - radius).max(0) as f64 / unit, (center + radius) as f64 / unit)
        };
        let prices: Vec<_> = self
            .center
            .iter()
            .zip(radius)
            .map(range)
            .map(|range| program.add_var(0.0, range))
            .collect();
        for plane in &self.planes {
            let terms = prices
                .iter()
                .zip(&plane.over)
                .filter(|(_, over)| **over != 0)
                .map(|(&price, &over)| (price, -over as f64));
            program.add_constraint(
                terms.chain([(height, 1.0)]).collect::<Vec<_>>(),
                ComparisonOp::Le,
                plane.value as f64,
            );
        }
        let solution = program.solve().ok()?.into_solution().ok()?;
        let next = prices
            .iter()
            .map(|&price| (solution.var_value(price) * unit).round().max(0.0) as i64)
            .collect();
        Some((next, solution.objective() - self.level as f64 / unit))
    }

    /// The nodes that are on the same part in every placement that is better than the best one.
    fn decide(&self) -> Vec<Option<PartIndex>> {
        let nodes = self.model.nodes.len();
        let none = vec![None; nodes];
        let Some((best, _)) = &self.best else { return none };
        let Some(mut cut) = Cut::new(self.model, &self.center, &self.room) else { return none };
        let (level, placement) = cut.solve();
        // A better placement has at most the value `best - 1`.
        let gap = (best - 1 - self.model.base) * UNIT - level;
        let network = &mut cut.network;
        network.keep();
        network.work = 0;
        let most = 40_000 * nodes as u64 + 10_000_000;
        let mut decided = none;
        for (node, &part) in placement.iter().enumerate() {
            let (from, to) = if part == 0 { (SOURCE, node + 2) } else { (node + 2, SINK) };
            let more = network.add_flow(from, to, gap.saturating_add(1).max(0));
            network.undo();
            if more > gap {
                decided[node] = Some(part);
            }
            if network.work > most {
                break;
            }
        }
        decided
    }
}

impl Model {
    /// The available amount of each limited resource: capacities by part, pins, and forbidden sets, of which all but one decision may be made.
    pub(super) fn limits(&self) -> impl Iterator<Item = i64> {
        let sets =
            self.forbidden.iter().map(|set| i64::try_from(set.len()).unwrap_or(i64::MAX) - 1);
        self.capacity.iter().flatten().chain(&self.pins).filter_map(|limit| *limit).chain(sets)
    }

    /// Prices by part and resource from prices by row.
    fn prices(&self, rows: &[i64]) -> Prices {
        let mut rows = rows.iter().copied();
        let mut price = |limit: &Option<i64>| limit.and_then(|_| rows.next()).unwrap_or(0);
        let capacity =
            self.capacity.iter().map(|part| part.iter().map(&mut price).collect()).collect();
        Prices { capacity, pins: self.pins.iter().map(&mut price).collect() }
    }

    /// Prices by row from prices by part and resource; 0 for forbidden sets.
    fn row_prices(&self, prices: &Prices) -> Vec<i64> {
        let limits = self.capacity.iter().flatten().chain(&self.pins);
        let all = limits.zip(prices.capacity.iter().flatten().chain(&prices.pins));
        let limited = all.filter(|(limit, _)| limit.is_some()).map(|(_, price)| *price);
        limited.chain(self.forbidden.iter().map(|_| 0)).collect()
    }
}

/// A network whose minimum cut is the cheapest placement at given prices.
pub(super) struct Cut<'a> {
    model: &'a Model,
    network: Network,
    /// By node and part: its cost there.
    costs: Vec<[i64; 2]>,
    /// The cost that all placements share.
    constant: i64,
}

impl<'a> Cut<'a> {
    pub(super) fn new(model: &'a Model, rows: &[i64], room: &[i64]) -> Option<Self> {
        let prices = model.prices(rows);
        let constant = rows
            .iter()
            .zip(room)
            .try_fold(0i64, |sum, (price, room)| sum.checked_sub(price.checked_mul(*room)?))?;
        let mut cut = Self {
            model,
            network: Network::new(model.nodes.len() + 2),
            costs: Vec::new(),
            constant,
        };
        let mut largest = i128::from(constant.unsigned_abs());
        for node in &model.nodes {
            let mut costs = [0; 2];
            for (part, cost) in costs.iter_mut().enumerate() {
                let bill = node.uses[part]
                    .iter()
                    .zip(&prices.capacity[part])
                    .map(|(&amount, &price)| i128::from(amount) * i128::from(price));
                let exact = i128::from(node.cost[part]) * i128::from(UNIT) + bill.sum::<i128>();
                largest += exact.abs();
                *cost = i64::try_from(exact).ok()?;
            }
            cut.costs.push(costs);
        }
        let sets = &rows[rows.len() - model.forbidden.len()..];
        for (set, &price) in model.forbidden.iter().zip(sets) {
            largest += i128::from(price) * set.len() as i128;
            set.iter().for_each(|&(node, part)| {
                cut.costs[node][part] = cut.costs[node][part].saturating_add(price)
            });
        }
        for net in &model.nets {
            let pins: i128 =
                prices.pins.iter().map(|&price| i128::from(price) * i128::from(net.pins)).sum();
            largest += pins + i128::from(net.cost) * i128::from(UNIT);
        }
        // From here no sum can overflow.
        if largest * 2 >= i128::from(INFINITE) {
            return None;
        }
        model.nets.iter().for_each(|net| cut.add_net(net, &prices));
        cut.add_nodes();
        Some(cut)
    }

    fn add_net(&mut self, net: &Net, prices: &Prices) {
        let pins = [prices.pins[0] * net.pins, prices.pins[1] * net.pins];
        if let Kind::Presence { on, at } = net.kind {
            let cost = net.cost * UNIT + pins[at];
            match on {
                0 => {}
                1 => self.add_any(net, 0, cost),
                2 => self.add_any(net, 1, cost),
                // Every member is on one of two parts.
                _ => self.constant += cost,
            }
            return;
        }
        let cost = net.cost * UNIT + pins[0] + pins[1];
        match (&net.members[..], net.placed) {
            (_, 3) => self.constant += cost,
            (&[member], placed) if placed != 0 => {
                self.costs[member][usize::from(placed == 1)] += cost
            }
            (&[a, b], 0) => self.network.add_edge(a + 2, b + 2, cost, cost),
            (members, placed) => {
                // An edge that is cut if a member is on side 0 and a member is on side 1.
                let (first, second) = (self.network.add_node(), self.network.add_node());
                self.network.add_edge(first, second, cost, 0);
                for member in members {
                    self.network.add_edge(member + 2, first, INFINITE, 0);
                    self.network.add_edge(second, member + 2, INFINITE, 0);
                }
                match placed {
                    1 => self.network.add_edge(SOURCE, first, INFINITE, 0),
                    2 => self.network.add_edge(second, SINK, INFINITE, 0),
                    _ => {}
                }
            }
        }
    }

    /// A cost that arises if a member is on a part.
    fn add_any(&mut self, net: &Net, part: PartIndex, cost: i64) {
        match &net.members[..] {
            _ if cost == 0 => {}
            _ if net.placed >> part & 1 == 1 => self.constant += cost,
            &[member] => self.costs[member][part] += cost,
            members => {
                let any = self.network.add_node();
                if part == 0 {
                    self.network.add_edge(any, SINK, cost, 0);
                    members
                        .iter()
                        .for_each(|member| self.network.add_edge(member + 2, any, INFINITE, 0));
                } else {
                    self.network.add_edge(SOURCE, any, cost, 0);
                    members
                        .iter()
                        .for_each(|member| self.network.add_edge(any, member + 2, INFINITE, 0));
                }
            }
        }
    }

    fn add_nodes(&mut self) {
        for (node, costs) in self.costs.iter().enumerate() {
            let least = costs[0].min(costs[1]);
            self.constant += least;
            if costs[1] > least {
                self.network.add_edge(SOURCE, node + 2, costs[1] - least, 0);
            }
            if costs[0] > least {
                self.network.add_edge(node + 2, SINK, costs[0] - least, 0);
            }
        }
    }

    /// The bound, in `1 / UNIT` and without the decided part, and the placement of the cut.
    pub(super) fn solve(&mut self) -> (i64, Vec<PartIndex>) {
        let flow = self.network.add_flow(SOURCE, SINK, INFINITE);
        let reached = self.network.reached(SOURCE);
        let placement =
            (0..self.model.nodes.len()).map(|node| usize::from(!reached[node + 2])).collect();
        (self.constant + flow, placement)
    }
}
