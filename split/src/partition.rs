//! The part of each group of objects: the partition problem of a net, and its solution.
//!
//! A group (see [`together`](crate::together())) is a node of the problem. A wire is needed if a part has a step that a transition of another part
//! enters or leaves. So each transition is a hyperedge from its group to the groups that have or read such a step; each state of a statechart is one to the
//! outputs that depend on it. The pins for wires and inputs are counted exactly. Cycles are estimates: a few for each operator. Macrocells are counted in two ways ([`Count`]): an estimate finds a partition that probably fits, and a
//! lower bound shows that no better one exists. The fitter decides whether a part fits its chip.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Span;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::division::{Owners, PartIndex, Running, Signal, rounds_of};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Driver, Expr, InputId, InputKind, Leaf, Net, StepId, StmtKind, Transition, TransitionId,
};
use grafsynth_ir::plan::following;
use grafsynth_ir::walk::{expressions, statements};

use crate::direct::candidates;
use crate::solve::{
    self, Alternative, Choice, Conflict, Evaluation, Forbidden, Limits, Node, Outcome, Presence,
    Problem, ProblemError, Wire,
};
use crate::together::{Groups, Item};

/// The capacity of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartSpec {
    /// The name of the part, as in `--part NAME=DEVICE`.
    pub name: String,
    /// True for programmable logic, false for the CPU, which is the last part.
    pub is_chip: bool,
    /// The macrocells of a chip.
    pub cells: Option<u64>,
    /// The pins of a chip for inputs and macrocells, without clock, supply and programming pins; `None` if macrocells need no pin. The usable pins of a CPU; `None` is
    /// unlimited.
    pub pins: Option<u64>,
    /// Whether the inputs and outputs of the plant count among the pins of a CPU. Else they reach it in another way.
    pub has_plant: bool,
    /// Whether a CPU has a wire that resets the chips, in lockstep.
    pub has_reset: bool,
    /// The cycles that a CPU needs to set, read, or hand over one signal of the link.
    pub act_cycles: u32,
    /// The bytes of flash and of RAM of a CPU, as [`memory`] estimates them for groups; `None` is unlimited.
    pub memory: [Option<u64>; 2],
}

/// An object that the designer places on a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// The object.
    pub item: Item,
    /// The part.
    pub part: PartIndex,
    /// The source location of the request.
    pub span: Span,
}

/// The objective that is minimised over the partitions that fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Objective {
    /// The CPU cycles of a reaction, with four cycles for each wire.
    #[default]
    Cycles,
    /// The pins of the CPU: its inputs, its outputs, the inputs that it passes on, and the wires between parts.
    Pins,
    /// The macrocells of all chips.
    Cells,
    /// The time of a round: the CPU cycles, with those of the link for each input that it hands to its part or passes on, and for each wire that it reads or drives.
    Latency,
}

impl Objective {
    /// All objectives.
    pub const ALL: [Objective; 4] =
        [Objective::Cycles, Objective::Pins, Objective::Cells, Objective::Latency];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Objective::Cycles => "cycles",
            Objective::Pins => "pins",
            Objective::Cells => "cells",
            Objective::Latency => "latency",
        }
    }

    /// What is counted, in the plural.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Objective::Cycles => "estimated cycles of the CPU",
            Objective::Pins => "pins of the CPU",
            Objective::Cells => "macrocells",
            Objective::Latency => "estimated cycles of a round with its link",
        }
    }
}

/// How the macrocells of a chip are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// One for each step, also for a copy, and for each bit of a variable or timer. Another state encoding may need fewer.
    Estimate,
    /// Only what every encoding needs: one for each bit of an output. Every chip that holds its part satisfies it.
    Least,
}

/// A partition that satisfies a [`Count`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    /// The part of each group.
    pub part: Vec<PartIndex>,
    /// The owner of each object.
    pub owners: Owners,
    /// The value of the objective, and how much of each capacity is used.
    pub evaluation: Evaluation,
    /// A lower bound on the objective of all partitions within this count; equal to the value if the partition is optimal.
    pub bound: i64,
    /// For each group, the effect of moving it alone to each other part.
    pub alternatives: Vec<Vec<Alternative>>,
}

/// Why there is no partition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unplaced {
    /// Two objects of one group are placed on different parts.
    Places(Place, Place),
    /// An object is placed on a chip, but only a CPU can have it.
    NeedsCpu(Place, &'static str),
    /// Constraints that exclude each other.
    Conflict(Conflict),
    /// The search reached its limit without a partition.
    Unknown,
    /// The problem is too large or malformed.
    Malformed(ProblemError),
}

/// The best partition within a count that is not excluded.
///
/// # Errors
/// The reason why there is no partition.
pub fn partition(
    net: &Net,
    groups: &Groups,
    parts: &[PartSpec],
    places: &[Place],
    (objective, count): (Objective, Count),
    excluded: &[Forbidden],
) -> Result<Partition, Unplaced> {
    let problem = problem(net, groups, parts, places, (objective, count), excluded)?;
    let outcome = solve::solve(&problem, &Limits::default(), None).map_err(Unplaced::Malformed)?;
    let (part, bound) = match outcome {
        Outcome::Optimal { assignment, value } => (assignment, value),
        Outcome::Best { assignment, bound, .. } => (assignment, bound),
        Outcome::Infeasible { conflict } => return Err(Unplaced::Conflict(conflict)),
        Outcome::Unknown { .. } => return Err(Unplaced::Unknown),
    };
    let evaluation = solve::evaluate(&problem, &part).map_err(Unplaced::Malformed)?;
    let alternatives = solve::alternatives(&problem, &part).map_err(Unplaced::Malformed)?;
    Ok(Partition { owners: owners(net, groups, &part), part, evaluation, bound, alternatives })
}

/// The partition that the places give, whether it fits or not; `None` if they leave a choice.
///
/// # Errors
/// As [`partition()`], but not for constraints that contradict each other.
pub fn given(
    net: &Net,
    groups: &Groups,
    parts: &[PartSpec],
    places: &[Place],
    (objective, count): (Objective, Count),
) -> Result<Option<Partition>, Unplaced> {
    let problem = problem(net, groups, parts, places, (objective, count), &[])?;
    let only = |node: &Node| {
        let mut allowed = (0..node.choices.len()).filter(|part| node.choices[*part].is_some());
        allowed.next().filter(|_| allowed.next().is_none())
    };
    let Some(part) = problem.nodes.iter().map(only).collect::<Option<Vec<PartIndex>>>() else {
        return Ok(None);
    };
    placed_at(net, groups, &problem, part).map(Some)
}

/// A partition of a problem, without a bound for others.
fn placed_at(
    net: &Net,
    groups: &Groups,
    problem: &Problem,
    part: Vec<PartIndex>,
) -> Result<Partition, Unplaced> {
    let evaluation = solve::evaluate(problem, &part).map_err(Unplaced::Malformed)?;
    let alternatives = solve::alternatives(problem, &part).map_err(Unplaced::Malformed)?;
    let owners = owners(net, groups, &part);
    Ok(Partition { owners, part, evaluation, bound: i64::MIN, alternatives })
}

/// The partition with the smallest objective among those within a count that differ from this one in the part of one group, if that is below `below`.
///
/// # Errors
/// As [`partition()`].
pub fn neighbour(
    net: &Net,
    groups: &Groups,
    parts: &[PartSpec],
    places: &[Place],
    (objective, count): (Objective, Count),
    (part, below): (&[PartIndex], i64),
    excluded: &[Forbidden],
) -> Result<Option<Partition>, Unplaced> {
    let problem = problem(net, groups, parts, places, (objective, count), excluded)?;
    let alternatives = solve::alternatives(&problem, part).map_err(Unplaced::Malformed)?;
    let mut best: Option<(i64, usize, PartIndex)> = None;
    for (group, all) in alternatives.iter().enumerate() {
        for (to, one) in all.iter().enumerate() {
            if let Alternative::Value(value) = *one
                && value < best.map_or(below, |(least, ..)| least)
            {
                best = Some((value, group, to));
            }
        }
    }
    let Some((_, group, to)) = best else { return Ok(None) };
    let mut part = part.to_vec();
    part[group] = to;
    placed_at(net, groups, &problem, part).map(Some)
}

/// The owners of all objects when each group is on its part.
#[must_use]
pub fn owners(net: &Net, groups: &Groups, part: &[PartIndex]) -> Owners {
    let of =
        |item: Item| groups.of.get(&item).and_then(|group| part.get(*group)).copied().unwrap_or(0);
    Owners {
        steps: IdMap::build(&net.steps, |id, _| of(Item::Step(id))),
        transitions: IdMap::build(&net.transitions, |id, _| of(Item::Transition(id))),
        vars: IdMap::build(&net.vars, |id, _| of(Item::Var(id))),
        actions: IdMap::build(&net.actions, |id, _| of(Item::Action(id))),
        outputs: IdMap::build(&net.outputs, |id, _| of(Item::Output(id))),
    }
}

/// The partition problem of a net.
///
/// # Errors
/// Places that contradict each other or the rules.
pub fn problem(
    net: &Net,
    groups: &Groups,
    parts: &[PartSpec],
    places: &[Place],
    (objective, count): (Objective, Count),
    excluded: &[Forbidden],
) -> Result<Problem, Unplaced> {
    let mut placed: BTreeMap<usize, Place> = BTreeMap::new();
    for place in places {
        let Some(group) = groups.of.get(&place.item) else { continue };
        if let Some((_, why)) = groups.cpu_only.get(group)
            && parts.get(place.part).is_some_and(|part| part.is_chip)
        {
            return Err(Unplaced::NeedsCpu(*place, why));
        }
        match placed.get(group) {
            Some(other) if other.part != place.part => {
                return Err(Unplaced::Places(*other, *place));
            }
            Some(_) | None => {
                placed.insert(*group, *place);
            }
        }
    }
    let readers = readers_of_inputs(net, groups);
    let mut needs = Needs { net, groups, parts, presences: Vec::new() };
    needs.add_chips(&readers, count);
    let always = needs.add_cpu(&readers, objective, count);
    let constant = match objective {
        Objective::Pins => always,
        Objective::Latency => needs.add_latency(&readers),
        Objective::Cycles | Objective::Cells => 0,
    };
    let nodes = groups.groups.iter().enumerate().map(|(at, items)| {
        let cells = match count {
            Count::Estimate => cells(net, items),
            Count::Least => output_bits(net, items),
        };
        let cycles = cycles(net, items);
        let choices = parts.iter().enumerate().map(|(part, spec)| {
            let elsewhere = placed.get(&at).is_some_and(|place| place.part != part);
            if elsewhere || spec.is_chip && groups.cpu_only.contains_key(&at) {
                return None;
            }
            let own = match objective {
                Objective::Cycles | Objective::Latency if !spec.is_chip => cycles,
                Objective::Cells if spec.is_chip => cells,
                Objective::Cycles | Objective::Latency | Objective::Cells | Objective::Pins => 0,
            };
            let cost = own + if at == 0 { constant } else { 0 };
            let uses = match (spec.is_chip, count) {
                (true, _) => vec![cells.unsigned_abs(), 0, 0],
                (false, Count::Estimate) => [&[0][..], &memory(net, items)].concat(),
                // No number of bytes is needed with every compiler.
                (false, Count::Least) => vec![0, 0, 0],
            };
            Some(Choice { cost, uses })
        });
        Node { choices: choices.collect() }
    });
    let capacity = |spec: &PartSpec| {
        let [flash, ram] = spec.memory;
        let always = if spec.is_chip || !spec.has_plant { 0 } else { always };
        solve::Part { capacities: vec![spec.cells, flash, ram], pins: spec.pins, always }
    };
    Ok(Problem {
        parts: parts.iter().map(capacity).collect(),
        nodes: nodes.collect(),
        wires: wires(net, groups, objective, count),
        presences: needs.presences,
        together: Vec::new(),
        forbidden: excluded.to_vec(),
    })
}

/// The steps and inputs that the objects of a group read, also through edges and timers.
#[derive(Default)]
struct Reads {
    steps: BTreeSet<StepId>,
    inputs: BTreeSet<InputId>,
}

impl Reads {
    fn of(net: &Net, items: &[Item]) -> Reads {
        let mut reads = Reads::default();
        for item in items {
            exprs(net, *item).into_iter().for_each(|expr| reads.add(net, expr));
            match *item {
                Item::Step(id) => {
                    reads.steps.insert(id);
                }
                Item::Transition(id) => {
                    reads.steps.extend(&net.transitions[id].requires);
                    reads.inputs.extend(&net.transitions[id].events);
                }
                Item::Action(id) => {
                    reads.steps.extend(net.actions[id].uses.iter().map(|one| one.step));
                }
                Item::Output(id) => match &net.outputs[id].driver {
                    Driver::Continuous(all) | Driver::Mealy(all) => {
                        reads.steps.extend(all.iter().map(|one| one.step));
                    }
                    Driver::Extern { calls, .. } => {
                        reads.steps.extend(calls.iter().map(|one| one.step));
                    }
                    Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
                },
                Item::Var(_) | Item::Event(_) => {}
            }
        }
        reads
    }

    fn add(&mut self, net: &Net, expr: &Expr) {
        for leaf in expr.leaves() {
            match *leaf {
                Leaf::Input(id) => {
                    self.inputs.insert(id);
                }
                Leaf::Timer(id) => self.add(net, &net.timers[id].condition),
                Leaf::Rise(id) | Leaf::Fall(id) => self.add(net, &net.edges[id].expr),
                _ => self.steps.extend(leaf.step()),
            }
        }
    }
}

/// The expressions of an object.
pub(crate) fn exprs(net: &Net, item: Item) -> Vec<&Expr> {
    match item {
        Item::Step(id) => {
            let step = &net.steps[id];
            let tasks = step.tasks.iter().map(|task| &task.body);
            [&step.entry, &step.exit]
                .into_iter()
                .chain(tasks)
                .flat_map(|list| expressions(list))
                .collect()
        }
        Item::Transition(id) => {
            let transition = &net.transitions[id];
            std::iter::once(&transition.guard).chain(expressions(&transition.actions)).collect()
        }
        Item::Action(id) => {
            let action = &net.actions[id];
            let conditions = action.uses.iter().filter_map(|one| one.condition.as_ref());
            conditions.chain(expressions(&action.body)).collect()
        }
        Item::Output(id) => {
            let output = &net.outputs[id];
            let emergency = net.emergency.iter().map(|emergency| &emergency.condition);
            output.driver.exprs().chain(emergency).collect()
        }
        Item::Var(_) | Item::Event(_) => Vec::new(),
    }
}

/// A signal that other groups may need: the group that has it, and those that read it.
pub(crate) struct Known {
    pub(crate) signal: Signal,
    pub(crate) driver: usize,
    pub(crate) readers: Vec<usize>,
}

/// What groups may have to know about each other: for each transition, the groups that have or read a step that it enters or leaves; for each state of a
/// statechart, the outputs that depend on it; if the parts run on their own, the groups that read a step.
pub(crate) fn known(net: &Net, groups: &Groups) -> Vec<Known> {
    let mut readers: BTreeMap<StepId, Vec<usize>> = BTreeMap::new();
    for (group, items) in groups.groups.iter().enumerate() {
        for step in Reads::of(net, items).steps {
            readers.entry(step).or_default().push(group);
        }
    }
    let of = |signal: Signal, item: Item, steps: Vec<StepId>| {
        let driver = *groups.of.get(&item)?;
        let steps = steps.into_iter().filter_map(|step| readers.get(&step));
        let all: BTreeSet<usize> = steps.flatten().copied().gather();
        let readers: Vec<usize> = all.into_iter().filter(|group| *group != driver).collect();
        (!readers.is_empty()).then_some(Known { signal, driver, readers })
    };
    if net.settings.policy.is_statechart() || groups.running == Running::Free {
        let of = |id| of(Signal::Active(id), Item::Step(id), vec![id]);
        return net.steps.ids().filter_map(of).collect();
    }
    let of = |(id, transition): (TransitionId, &Transition)| {
        let touched = transition.requires.iter().copied().chain(following(transition));
        of(Signal::Fires(id), Item::Transition(id), touched.collect())
    };
    net.transitions.iter().filter_map(of).collect()
}

/// One hyperedge for each signal: its readers need its wire if they are on another part.
fn wires(net: &Net, groups: &Groups, objective: Objective, count: Count) -> Vec<Wire> {
    let cost = match objective {
        Objective::Cycles => 4,
        Objective::Pins => 1,
        // Most wires from a chip need a macrocell.
        Objective::Cells => u64::from(count == Count::Estimate),
        // Only the wires of the CPU take time; those between chips do not.
        Objective::Latency => 0,
    };
    let all = known(net, groups).into_iter();
    all.map(|Known { driver, readers, .. }| Wire { driver, readers, cost }).collect()
}

/// The groups that read each input of the plant.
fn readers_of_inputs(net: &Net, groups: &Groups) -> BTreeMap<InputId, Vec<usize>> {
    let mut readers: BTreeMap<InputId, Vec<usize>> = BTreeMap::new();
    for (group, items) in groups.groups.iter().enumerate() {
        for input in Reads::of(net, items).inputs {
            readers.entry(input).or_default().push(group);
        }
    }
    readers.retain(|input, _| matches!(net.inputs[*input].kind, InputKind::Pin | InputKind::Event));
    readers
}

/// What groups need once on a part, while it is collected: pins, and cycles of the link.
struct Needs<'a> {
    net: &'a Net,
    groups: &'a Groups,
    parts: &'a [PartSpec],
    presences: Vec<Presence>,
}

impl Needs<'_> {
    /// The parts that are chips, or those that are not.
    fn those(&self, is_chip: bool) -> Vec<PartIndex> {
        (0..self.parts.len()).filter(|part| self.parts[*part].is_chip == is_chip).collect()
    }

    /// Pins that each chip with one of these groups needs.
    fn on_chips(&mut self, groups: &[usize], pins: u64) {
        let of = |chip| Presence::pins(groups.to_vec(), chip, pins);
        self.presences.extend(self.those(true).into_iter().map(of));
    }

    /// The pins of the chips for inputs and macrocells: one for each input bit on each chip that reads it, and one for each macrocell, which nothing else can use.
    fn add_chips(&mut self, readers: &BTreeMap<InputId, Vec<usize>>, count: Count) {
        let (net, groups) = (self.net, self.groups);
        let is_free = groups.running == Running::Free;
        for (input, readers) in readers {
            // Two flip-flops synchronise an input of a chip that runs on its own; their pins carry nothing else.
            let synchronisers = if is_free && count == Count::Estimate { 2 } else { 0 };
            self.on_chips(readers, input_bits(net, *input) * (1 + synchronisers));
        }
        if count == Count::Least {
            for (group, items) in groups.groups.iter().enumerate() {
                self.on_chips(&[group], output_bits(net, items).unsigned_abs());
            }
            return;
        }
        // A step needs a macrocell on each part that has it or a copy of it. A state of a statechart has no copy, only a wire.
        let has_copies = !net.settings.policy.is_statechart();
        let mut present: BTreeMap<StepId, Vec<usize>> = BTreeMap::new();
        for (group, items) in groups.groups.iter().enumerate() {
            let all = Reads::of(net, items);
            let own =
                |step: &&StepId| !is_free || groups.of.get(&Item::Step(**step)) == Some(&group);
            for step in all.steps.iter().filter(|_| has_copies).filter(own) {
                present.entry(*step).or_default().push(group);
            }
            let steps = items.iter().filter(|item| matches!(item, Item::Step(_))).count() as u64;
            self.on_chips(&[group], cells(net, items).unsigned_abs().saturating_sub(steps));
        }
        present.into_values().for_each(|groups| self.on_chips(&groups, 1));
    }

    /// The pins of the CPU, without those of wires, each with its cost if that is the objective. Returns how many pins more it has in every placement; negative if
    /// groups count some twice.
    ///
    /// An input that may be wired to chips alone needs a pin if a group on the CPU reads it, and another one if groups on chips read it too: 2 for a reader on the CPU, 1
    /// for one on a chip, and −1 in any case. The inputs of one assumption count as one, because they are wired in the same way. Every other input needs a pin in any
    /// case, and another one if a group on a chip reads it. If the parts run on their own, an input needs a pin if a group on the CPU reads it.
    fn add_cpu(
        &mut self,
        readers: &BTreeMap<InputId, Vec<usize>>,
        objective: Objective,
        count: Count,
    ) -> i64 {
        let (net, groups) = (self.net, self.groups);
        let (chips, cpus) = (self.those(true), self.those(false));
        let Some(&cpu) = cpus.first() else { return 0 };
        let is_free = groups.running == Running::Free;
        let has_plant = self.parts[cpu].has_plant;
        let is_goal = objective == Objective::Pins;
        let presence = |nodes: &[usize], on: &[PartIndex], all: u64, link: u64| {
            let (nodes, on) = (nodes.to_vec(), on.to_vec());
            // If the plant is not counted, only the link is.
            let pins = if has_plant { all } else { link };
            Presence { nodes, on, cost: if is_goal { all } else { 0 }, pins, at: cpu }
        };
        let candidates = candidates(net);
        let mut always = 0;
        for (input, declared) in net.inputs.iter().filter(|(_, it)| it.kind.is_handed()) {
            let bits = u64::from(declared.ty.bits());
            let own = readers.get(&input).map_or(&[][..], Vec::as_slice);
            match candidates.get(&input) {
                _ if is_free => self.presences.push(presence(own, &cpus, bits, 0)),
                Some(class) => {
                    let all = readers_of(readers, class);
                    self.presences.push(presence(&all, &cpus, 2 * bits, 0));
                    self.presences.push(presence(&all, &chips, bits, 0));
                    always -= i64::from(declared.ty.bits());
                }
                None => {
                    self.presences.push(presence(own, &chips, bits, bits));
                    always += i64::from(declared.ty.bits());
                }
            }
        }
        for (group, items) in groups.groups.iter().enumerate() {
            let outputs = output_bits(net, items).unsigned_abs();
            self.presences.push(presence(&[group], &cpus, outputs, 0));
        }
        self.add_link(cpu, &chips, count);
        always
    }

    /// Cycles that the link takes if any of these groups is on one of these parts.
    fn takes(&mut self, groups: &[usize], on: &[PartIndex], cycles: u32) {
        let (nodes, on, cost) = (groups.to_vec(), on.to_vec(), u64::from(cycles));
        self.presences.push(Presence { nodes, on, cost, pins: 0, at: 0 });
    }

    /// Cycles that it takes if one of these groups is on the CPU and another one on a chip: both count, and once less in any case. Returns that.
    fn takes_on_both(&mut self, groups: &[usize], cycles: u32) -> i64 {
        for is_chip in [false, true] {
            self.takes(groups, &self.those(is_chip), cycles);
        }
        -i64::from(cycles)
    }

    /// What the link costs in cycles: an act for each input that the part on the CPU reads, for each bit that it passes on, and for each wire that it reads or drives.
    /// Returns what every placement costs in addition; negative if groups count some twice.
    fn add_latency(&mut self, readers: &BTreeMap<InputId, Vec<usize>>) -> i64 {
        let (net, groups) = (self.net, self.groups);
        let (chips, cpus) = (self.those(true), self.those(false));
        let Some(&cpu) = cpus.first() else { return 0 };
        let is_free = groups.running == Running::Free;
        let act = self.parts[cpu].act_cycles;
        let mut always = 0;
        let candidates = candidates(net);
        for (input, own) in readers {
            self.takes(own, &cpus, act);
            let cycles = net.inputs[*input].ty.bits() * act;
            match candidates.get(input) {
                _ if is_free => {}
                Some(class) => {
                    always += self.takes_on_both(&readers_of(readers, class), cycles);
                }
                None => self.takes(own, &chips, cycles),
            }
        }
        for Known { driver, mut readers, .. } in known(net, groups) {
            readers.push(driver);
            always += self.takes_on_both(&readers, act);
        }
        if !is_free {
            // The clock and the wait after it.
            self.takes(&stored(net, groups), &chips, 2 * act);
            self.takes(&timed(net, groups), &chips, act);
        }
        always
    }

    /// The pins for the signals that every link has.
    fn add_link(&mut self, cpu: PartIndex, chips: &[PartIndex], count: Count) {
        let (net, groups) = (self.net, self.groups);
        let is_free = groups.running == Running::Free;
        if rounds_of(net).is_some() && !is_free {
            // Each chip tells the CPU whether it moves.
            let moving = with(groups, |item| matches!(item, Item::Transition(_)));
            let tells =
                |chip: &PartIndex| Presence { at: cpu, ..Presence::pins(moving.clone(), *chip, 1) };
            self.presences.extend(chips.iter().map(tells));
        }
        if count == Count::Least {
            return;
        }
        let reset = u64::from(self.parts[cpu].has_reset);
        let stored = stored(net, groups);
        // On a chip that runs on its own, the reset has synchronisers, too, whose pins carry nothing else.
        self.on_chips(&stored, reset * if is_free { 3 } else { 1 });
        // The clock and the tick come from the CPU in lockstep.
        let (clocks, ticks) = if is_free { (reset, 0) } else { (1 + reset, 1) };
        for (nodes, pins) in [(stored, clocks), (timed(net, groups), ticks)] {
            self.presences.push(Presence { nodes, on: chips.to_vec(), cost: 0, pins, at: cpu });
        }
    }
}

/// The groups that read one of these inputs.
fn readers_of(readers: &BTreeMap<InputId, Vec<usize>>, inputs: &BTreeSet<InputId>) -> Vec<usize> {
    let all = inputs.iter().filter_map(|one| readers.get(one)).flatten().copied();
    all.gather::<BTreeSet<usize>>().into_iter().collect()
}

/// The groups with such an object.
fn with(groups: &Groups, is_it: impl Fn(&Item) -> bool) -> Vec<usize> {
    let all = groups.groups.iter().enumerate();
    all.filter(|(_, items)| items.iter().any(&is_it)).map(|(group, _)| group).collect()
}

/// The groups for which a chip needs a clock. The chips of a statechart store nothing.
fn stored(net: &Net, groups: &Groups) -> Vec<usize> {
    let is_stored = |item: &Item| matches!(item, Item::Step(_) | Item::Var(_) | Item::Action(_));
    if net.settings.policy.is_statechart() { Vec::new() } else { with(groups, is_stored) }
}

/// The groups for which a chip must know whether a tick passes.
fn timed(net: &Net, groups: &Groups) -> Vec<usize> {
    with(groups, |item| timer_bits(net, item) > 0)
}

fn input_bits(net: &Net, input: InputId) -> u64 {
    u64::from(net.inputs[input].ty.bits())
}

/// The bits of the outputs of a group.
fn output_bits(net: &Net, items: &[Item]) -> i64 {
    let bits = |item: &Item| match *item {
        Item::Output(id) if !net.outputs[id].is_extern() => i64::from(net.outputs[id].ty.bits()),
        _ => 0,
    };
    items.iter().map(bits).sum::<i64>().min(1 << 20)
}

/// The estimated macrocells of a group.
fn cells(net: &Net, items: &[Item]) -> i64 {
    let bits = |ty: Type, len: Option<u32>| i64::from(ty.bits()) * i64::from(len.unwrap_or(1));
    let has_copies = !net.settings.policy.is_statechart();
    let one = |item: &Item| match *item {
        Item::Step(_) => 1,
        Item::Var(id) => bits(net.vars[id].ty, net.vars[id].len),
        Item::Action(id) => {
            let action = &net.actions[id];
            let timed = action.uses.iter().any(|one| one.qualifier.is_timed());
            let ticks = Type::Int { lo: 0, hi: i64::from(action.duration) };
            1 + if timed { i64::from(ticks.bits()) } else { 0 }
        }
        // An output that is one step's bit can share its macrocell.
        Item::Output(id) => match &net.outputs[id].driver {
            Driver::Continuous(all)
                if all.len() == 1 && all[0].condition.is_none() && has_copies =>
            {
                0
            }
            Driver::Continuous(_) | Driver::Mealy(_) => 1,
            Driver::Fires(_)
            | Driver::Stored(_)
            | Driver::Controlled(_)
            | Driver::Extern { .. } => 0,
        },
        Item::Transition(_) | Item::Event(_) => 0,
    };
    let all = items.iter().map(|item| one(item).saturating_add(timer_bits(net, item)));
    all.sum::<i64>().min(1 << 20)
}

/// The bits of the longest time that an object compares; 0 if it compares none.
fn timer_bits(net: &Net, item: &Item) -> i64 {
    let compared = exprs(net, *item).into_iter().flat_map(|expr| expr.compared());
    let caps = compared.filter(|(leaf, _)| leaf.is_time()).map(|(_, constant)| constant);
    caps.max()
        .map_or(0, |cap| i64::from(Type::Int { lo: 0, hi: cap.saturating_add(1).max(1) }.bits()))
}

/// The estimated bytes of flash and of RAM of a group on a CPU. They compare groups; what a program needs besides is not included.
#[must_use]
pub fn memory(net: &Net, items: &[Item]) -> [u64; 2] {
    let bytes = |bits: u64| bits.div_ceil(8);
    let of_data = |item: &Item| match *item {
        Item::Var(id) => {
            let var = &net.vars[id];
            bytes(u64::from(var.ty.bits())).saturating_mul(u64::from(var.len.unwrap_or(1)))
        }
        Item::Action(_) => 4,
        Item::Output(_) | Item::Step(_) => 1,
        Item::Transition(_) | Item::Event(_) => 0,
    };
    let data = items.iter().map(of_data).fold(0, u64::saturating_add);
    // About two bytes of code for a cycle.
    [2 * cycles(net, items).unsigned_abs(), data.min(1 << 20)]
}

/// The estimated cycles of a group in a reaction of the CPU.
fn cycles(net: &Net, items: &[Item]) -> i64 {
    let size = |expr: &Expr| 2 + 3 * expr.leaves().count() as i64;
    let one = |item: &Item| {
        let read: i64 = exprs(net, *item).into_iter().map(size).sum();
        let lists: Vec<&grafsynth_ir::net::Block> = match *item {
            Item::Step(id) => vec![&net.steps[id].entry, &net.steps[id].exit],
            Item::Transition(id) => vec![&net.transitions[id].actions],
            Item::Action(id) => vec![&net.actions[id].body],
            Item::Var(_) | Item::Output(_) | Item::Event(_) => Vec::new(),
        };
        let stored = lists.into_iter().flat_map(|list| statements(list));
        let stored =
            stored.filter(|stmt| matches!(stmt.kind, StmtKind::Assign { .. })).count() as i64;
        let fixed = match *item {
            Item::Transition(_) => 8,
            Item::Action(_) => 20,
            Item::Output(id) => match &net.outputs[id].driver {
                Driver::Continuous(all) | Driver::Mealy(all) => 2 + 4 * all.len() as i64,
                Driver::Fires(_)
                | Driver::Stored(_)
                | Driver::Controlled(_)
                | Driver::Extern { .. } => 4,
            },
            Item::Step(_) => 2,
            Item::Var(_) | Item::Event(_) => 0,
        };
        fixed + read + 6 * stored
    };
    items.iter().map(one).sum::<i64>().min(1 << 20)
}
