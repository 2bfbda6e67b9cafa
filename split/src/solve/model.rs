//! The problem after reduction: decided nodes are removed, and nodes that must be together are merged.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use super::problem::{NodeIndex, PartIndex, Problem};

/// A set of parts as bits.
pub(super) type Mask = u32;

/// The parts of a mask, in order.
pub(super) fn parts_of(mask: Mask) -> impl Iterator<Item = PartIndex> {
    (0..Mask::BITS as usize).filter(move |&part| mask >> part & 1 == 1)
}

/// A reduced problem. Its amounts are those of the whole problem: `base` is the decided part.
#[derive(Clone, Debug, Default)]
pub(super) struct Model {
    pub(super) parts: usize,
    pub(super) resources: usize,
    /// The capacity that is left for the free nodes, by part and resource.
    pub(super) capacity: Vec<Vec<Option<i64>>>,
    /// The pins that are left for the nets, by part.
    pub(super) pins: Vec<Option<i64>>,
    /// The cost of the decided nodes and nets.
    pub(super) base: i64,
    pub(super) nodes: Vec<FreeNode>,
    pub(super) nets: Vec<Net>,
    /// Sets of at least two decisions, of which one must be different.
    pub(super) forbidden: Vec<Vec<(usize, PartIndex)>>,
    /// For each node of the problem: its part, or the free node that represents it.
    pub(super) origin: Vec<Origin>,
}

/// The result of the reduction for a node of the problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// It is always on this part.
    Placed(PartIndex),
    /// It is on the same part as this free node.
    Free(usize),
}

/// A node that still has a choice.
#[derive(Clone, Debug, Default)]
pub(super) struct FreeNode {
    pub(super) allowed: Mask,
    /// By part; meaningless if the node is not allowed there.
    pub(super) cost: Vec<i64>,
    /// By part and resource.
    pub(super) uses: Vec<Vec<i64>>,
    pub(super) nets: Vec<usize>,
    pub(super) forbidden: Vec<usize>,
}

/// A wire or a presence, or several equal ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Net {
    /// Free members, in order; at least one.
    pub(super) members: Vec<usize>,
    /// The parts that have a placed member.
    pub(super) placed: Mask,
    pub(super) kind: Kind,
    pub(super) cost: i64,
    /// The number of its pins on a part.
    pub(super) pins: i64,
}

impl Net {
    /// The parts on which it has a pin, if its members are on these parts.
    pub(super) fn pinned(&self, present: Mask) -> Mask {
        match self.kind {
            Kind::Wire if present.count_ones() > 1 => present,
            Kind::Presence { on, at } if present & on != 0 => 1 << at,
            Kind::Wire | Kind::Presence { .. } => 0,
        }
    }

    /// Its cost if its members are on these parts.
    pub(super) fn cost_on(&self, present: Mask) -> i64 {
        let costs = match self.kind {
            Kind::Presence { on, .. } => present & on != 0,
            Kind::Wire => present.count_ones() > 1,
        };
        if costs { self.cost } else { 0 }
    }
}

impl Model {
    /// Whether the pins of a net of this kind are limited.
    fn counts_pins(&self, kind: Kind) -> bool {
        match kind {
            Kind::Wire => self.pins.iter().any(Option::is_some),
            Kind::Presence { at, .. } => self.pins[at].is_some(),
        }
    }

    /// Drops the limits that no placement reaches.
    fn drop_loose_limits(&mut self) {
        for part in 0..self.parts {
            let here = self.nodes.iter().filter(|node| node.allowed >> part & 1 == 1);
            let most = here.fold(vec![0; self.resources], |mut sums: Vec<i64>, node| {
                sums.iter_mut().zip(&node.uses[part]).for_each(|(sum, amount)| *sum += amount);
                sums
            });
            for (limit, most) in self.capacity[part].iter_mut().zip(most) {
                *limit = limit.filter(|&limit| limit < most);
            }
            let all = (1 << self.parts) - 1;
            let here = self.nets.iter().filter(|net| net.pinned(all) >> part & 1 == 1);
            let most: i64 = here.map(|net| net.pins).sum();
            self.pins[part] = self.pins[part].filter(|&limit| limit < most);
        }
    }

    /// The placement of all nodes that corresponds to a placement of the free nodes.
    pub(super) fn expand(&self, free: &[PartIndex]) -> Vec<PartIndex> {
        let place = |origin: &Origin| match *origin {
            Origin::Placed(part) => part,
            Origin::Free(node) => free[node],
        };
        self.origin.iter().map(place).collect()
    }

    /// The parts of the free nodes in a placement of all nodes; `None` for a part that is not allowed.
    pub(super) fn restrict(&self, assignment: &[PartIndex]) -> Vec<Option<PartIndex>> {
        let mut free = vec![None; self.nodes.len()];
        for (origin, &part) in self.origin.iter().zip(assignment) {
            if let Origin::Free(node) = *origin
                && self.nodes[node].allowed >> part & 1 == 1
            {
                free[node] = Some(part);
            }
        }
        free
    }
}

/// Reduces a problem; `None` if it obviously has no solution.
///
/// Merges nodes that must be together, removes parts on which a node alone does not fit or is forbidden, places nodes with one part left and nodes for which
/// one part is best regardless of the others, and merges nets with the same members.
pub(super) fn reduce(problem: &Problem) -> Option<Model> {
    let mut work = Work::merged(problem);
    work.settle(problem)?;
    let mut model = work.finish(problem);
    let mut left = model.capacity.iter().flatten().chain(&model.pins);
    if left.any(|left| left.is_some_and(|left| left < 0)) {
        return None;
    }
    model.drop_loose_limits();
    Some(model)
}

/// The problem in which only nodes that must be together are merged: each node is free, even if it has one part.
pub(super) fn whole(problem: &Problem) -> Model {
    Work::merged(problem).finish(problem)
}

/// What a net is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A wire has its cost if members are on two parts or more, and then a pin on each of them.
    Wire,
    /// A presence has its cost if a member is on one of the parts `on`, and then its pins on the part `at`.
    Presence { on: Mask, at: PartIndex },
}

/// Nets by members and kind, with cost and pins.
type Nets = BTreeMap<(Vec<usize>, Kind), (i64, i64)>;

/// Classes of nodes, and their remaining choices.
struct Work {
    /// The class of each node.
    class: Vec<usize>,
    classes: Vec<FreeNode>,
    /// Open sets: class and part, of which one must be different.
    forbidden: Vec<BTreeSet<(usize, PartIndex)>>,
    nets: Nets,
    /// The use of the placed classes, by part and resource.
    used: Vec<Vec<i64>>,
    placed: Vec<bool>,
}

impl Work {
    fn merged(problem: &Problem) -> Self {
        let class = classes(problem);
        let count = class.iter().max().map_or(0, |last| last + 1);
        let (parts, resources) = (problem.parts.len(), problem.resources());
        let all = (1 << parts) - 1;
        let mut classes = vec![
            FreeNode {
                allowed: all,
                cost: vec![0; parts],
                uses: vec![vec![0; resources]; parts],
                ..FreeNode::default()
            };
            count
        ];
        for (node, &class) in problem.nodes.iter().zip(&class) {
            let into = &mut classes[class];
            for (part, choice) in node.choices.iter().enumerate() {
                let Some(choice) = choice else {
                    into.allowed &= !(1 << part);
                    continue;
                };
                into.cost[part] += choice.cost;
                for (sum, &amount) in into.uses[part].iter_mut().zip(&choice.uses) {
                    *sum += amount.cast_signed();
                }
            }
        }
        let mut forbidden = Vec::new();
        for set in &problem.forbidden {
            let set: BTreeSet<_> =
                set.decisions().iter().map(|&(node, part)| (class[node], part)).gather();
            // One class on two parts: some decision is always different.
            let mut nodes: Vec<_> = set.iter().map(|&(node, _)| node).collect();
            nodes.dedup();
            if nodes.len() == set.len() {
                forbidden.push(set);
            }
        }
        let placed = vec![false; count];
        let nets = nets(problem, &class);
        Self { class, classes, forbidden, nets, used: vec![vec![0; resources]; parts], placed }
    }

    /// Repeats the reductions until none applies.
    fn settle(&mut self, problem: &Problem) -> Option<()> {
        let mut in_net = vec![false; self.classes.len()];
        for (members, _) in self.nets.keys() {
            members.iter().for_each(|&member| in_net[member] = true);
        }
        loop {
            let mut is_changed = self.settle_forbidden()?;
            let mut in_set = in_net.clone();
            self.forbidden.iter().flatten().for_each(|&(class, _)| in_set[class] = true);
            for (class, is_bound) in in_set.into_iter().enumerate() {
                if self.placed[class] {
                    continue;
                }
                is_changed |= self.remove_parts_too_small(problem, class);
                if !is_bound && let Some(best) = self.best_alone(problem, class) {
                    self.classes[class].allowed = 1 << best;
                }
                match self.classes[class].allowed.count_ones() {
                    0 => return None,
                    1 => {
                        is_changed = true;
                        self.placed[class] = true;
                        let part = self.classes[class].allowed.trailing_zeros() as usize;
                        for (sum, amount) in
                            self.used[part].iter_mut().zip(&self.classes[class].uses[part])
                        {
                            *sum += amount;
                        }
                    }
                    _ => {}
                }
            }
            if !is_changed {
                return Some(());
            }
        }
    }

    /// Removes decided decisions from the forbidden sets. `None` if all decisions of a set are made.
    fn settle_forbidden(&mut self) -> Option<bool> {
        let mut is_changed = false;
        let mut open = Vec::new();
        for mut set in std::mem::take(&mut self.forbidden) {
            if set.iter().any(|&(class, part)| self.classes[class].allowed >> part & 1 == 0) {
                continue;
            }
            set.retain(|&(class, _)| self.classes[class].allowed.count_ones() > 1);
            match (set.len(), set.first()) {
                (1, Some(&(class, part))) => {
                    self.classes[class].allowed &= !(1 << part);
                    is_changed = true;
                }
                (0, _) => return None,
                _ => open.push(set),
            }
        }
        self.forbidden = open;
        Some(is_changed)
    }

    fn remove_parts_too_small(&mut self, problem: &Problem, class: usize) -> bool {
        let before = self.classes[class].allowed;
        for part in parts_of(before) {
            let room = problem.parts[part].capacities.iter().zip(&self.used[part]);
            let fits = |(amount, (capacity, used)): (&i64, (&Option<u64>, &i64))| {
                capacity.is_none_or(|capacity| used + amount <= signed(capacity))
            };
            if !self.classes[class].uses[part].iter().zip(room).all(fits) {
                self.classes[class].allowed &= !(1 << part);
            }
        }
        self.classes[class].allowed != before
    }

    /// The cheapest part for a class without nets, if the class uses no limited resource there.
    fn best_alone(&self, problem: &Problem, class: usize) -> Option<PartIndex> {
        let node = &self.classes[class];
        let best = parts_of(node.allowed).min_by_key(|&part| node.cost[part])?;
        let is_free = |(amount, capacity): (&i64, &Option<u64>)| *amount == 0 || capacity.is_none();
        node.uses[best].iter().zip(&problem.parts[best].capacities).all(is_free).then_some(best)
    }

    fn finish(mut self, problem: &Problem) -> Model {
        let parts = problem.parts.len();
        let mut model = Model { parts, resources: problem.resources(), ..Model::default() };
        for (part, used) in problem.parts.iter().zip(&self.used) {
            let left: Vec<_> = part
                .capacities
                .iter()
                .zip(used)
                .map(|(capacity, used)| capacity.map(|capacity| signed(capacity) - used))
                .collect();
            model.capacity.push(left);
            model.pins.push(part.pins.map(|pins| signed(pins) - part.always));
        }
        let mut free = vec![0; self.classes.len()];
        let mut places = Vec::new();
        for (class, node) in self.classes.iter_mut().enumerate() {
            if self.placed[class] {
                let part = node.allowed.trailing_zeros() as usize;
                model.base += node.cost[part];
                places.push(Origin::Placed(part));
            } else {
                free[class] = model.nodes.len();
                places.push(Origin::Free(model.nodes.len()));
                model.nodes.push(std::mem::take(node));
            }
        }
        model.origin = self.class.iter().map(|&class| places[class]).collect();
        self.add_nets(&mut model, &places);
        for set in &self.forbidden {
            set.iter().for_each(|&(class, _)| {
                model.nodes[free[class]].forbidden.push(model.forbidden.len())
            });
            model.forbidden.push(set.iter().map(|&(class, part)| (free[class], part)).collect());
        }
        model
    }

    /// Adds the nets that still depend on a free node; the other nets are decided.
    fn add_nets(&self, model: &mut Model, places: &[Origin]) {
        let mut merged: BTreeMap<(Vec<usize>, Mask, Kind), (i64, i64)> = BTreeMap::new();
        for ((members, kind), &(cost, pins)) in &self.nets {
            let mut placed = 0;
            let mut open = Vec::new();
            for &member in members {
                match places[member] {
                    Origin::Placed(part) => placed |= 1 << part,
                    Origin::Free(node) => open.push(node),
                }
            }
            let sums = merged.entry((open, placed, *kind)).or_default();
            sums.0 += cost;
            sums.1 += pins;
        }
        for ((members, placed, kind), (cost, pins)) in merged {
            let net = Net { members, placed, kind, cost, pins };
            if net.members.is_empty() {
                model.base += net.cost_on(placed);
                parts_of(net.pinned(placed)).for_each(|part| {
                    if let Some(left) = &mut model.pins[part] {
                        *left -= pins;
                    }
                });
            } else if cost > 0 || model.counts_pins(kind) {
                net.members
                    .iter()
                    .for_each(|&member| model.nodes[member].nets.push(model.nets.len()));
                model.nets.push(net);
            }
        }
    }
}

/// A capacity as a signed number; very large capacities are treated as unlimited.
pub(super) fn signed(capacity: u64) -> i64 {
    i64::try_from(capacity).unwrap_or(i64::MAX).min(1 << 60)
}

/// The class of each node, numbered in order of the first member.
fn classes(problem: &Problem) -> Vec<usize> {
    let mut leader: Vec<NodeIndex> = (0..problem.nodes.len()).collect();
    fn find(leader: &mut [NodeIndex], mut node: NodeIndex) -> NodeIndex {
        while leader[node] != node {
            leader[node] = leader[leader[node]];
            node = leader[node];
        }
        node
    }
    for set in &problem.together {
        for pair in set.windows(2) {
            let (a, b) = (find(&mut leader, pair[0]), find(&mut leader, pair[1]));
            leader[a.max(b)] = a.min(b);
        }
    }
    let mut numbers = BTreeMap::new();
    let number = |node| {
        let next = numbers.len();
        *numbers.entry(find(&mut leader, node)).or_insert(next)
    };
    (0..problem.nodes.len()).map(number).collect()
}

/// The nets over classes, with the sums of cost and pins of equal nets.
fn nets(problem: &Problem, class: &[usize]) -> Nets {
    let mut nets = Nets::new();
    let members = |nodes: &mut dyn Iterator<Item = NodeIndex>| {
        nodes.map(|node| class[node]).gather::<BTreeSet<_>>().into_iter().collect::<Vec<_>>()
    };
    for wire in &problem.wires {
        let members = members(&mut wire.readers.iter().copied().chain([wire.driver]));
        if members.len() > 1 {
            let sums = nets.entry((members, Kind::Wire)).or_default();
            *sums = (sums.0 + wire.cost.cast_signed(), sums.1 + 1);
        }
    }
    for one in problem.presences.iter().filter(|one| !one.nodes.is_empty()) {
        let on = one.on.iter().fold(0, |mask, part| mask | 1 << part);
        let members = members(&mut one.nodes.iter().copied());
        let sums = nets.entry((members, Kind::Presence { on, at: one.at })).or_default();
        *sums = (sums.0 + one.cost.cast_signed(), sums.1 + one.pins.cast_signed());
    }
    nets
}
