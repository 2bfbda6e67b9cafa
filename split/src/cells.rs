//! The number of macrocells that a chip probably needs for a set of groups, with any state encoding.
//!
//! The steps of a sequential component share one code, and their times share one counter; so a component needs at least the bits of that code and the bits of
//! its longest time. A variable, a timed action and the operand of an edge have their own bits. A continuous output or a wire needs a macrocell of its own,
//! unless it is a bit of a code; one that depends on an input is no such bit. The number never falls when another group is placed, on the chip or elsewhere.
//!
//! This is no proof: a chip needs fewer if what it reads turns out to be constant or without effect. It decides which partitions are built first, never that one does
//! not fit.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::Signal;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Driver, EdgeId, Expr, Leaf, Net, StepId, VarId};

use crate::partition::{Known, exprs, known};
use crate::solve::{NodeIndex, PartIndex};
use crate::together::{Groups, Item};

/// What the objects of one group need on a chip.
#[derive(Debug, Default)]
struct Needs {
    /// The steps whose bits are read.
    steps: BTreeSet<StepId>,
    /// The bits that count the time of a step.
    times: BTreeMap<StepId, u64>,
    /// The operands of edges that are inputs.
    edges: BTreeSet<EdgeId>,
    /// The outputs that might be bits of a code.
    outputs: u64,
    /// The bits of variables and of timed actions, and the outputs that depend on inputs.
    bits: u64,
}

/// A transition that is shown to other parts if one of these groups is on another part.
#[derive(Debug)]
struct Shown {
    driver: NodeIndex,
    readers: Vec<NodeIndex>,
    /// True if it depends on an input, so that its wire is no bit of a code.
    reads_inputs: bool,
}

/// The macrocells of sets of groups.
#[derive(Debug)]
pub struct Cells<'a> {
    facts: &'a Facts,
    groups: Vec<Needs>,
    shown: Vec<Shown>,
}

impl<'a> Cells<'a> {
    /// Collects what each group needs.
    #[must_use]
    pub fn new(net: &Net, facts: &'a Facts, groups: &Groups) -> Self {
        // A variable that only lists read may change nothing that is seen.
        let conditions = net.transitions.values().map(|it| &it.guard);
        let conditions = conditions.chain(net.outputs.values().flat_map(|it| it.driver.exprs()));
        let mut read: BTreeSet<VarId> = conditions
            .flat_map(|expr| expr.leaves())
            .filter_map(|leaf| if let Leaf::Var(var) = leaf { Some(*var) } else { None })
            .gather();
        read.extend(net.outputs.values().filter_map(|output| match output.driver {
            Driver::Stored(var) => Some(var),
            _ => None,
        }));
        let is_statechart = net.settings.policy.is_statechart();
        let of = |items: &Vec<Item>| {
            let mut needs = Needs::default();
            if is_statechart {
                // A chip reads states from wires and stores nothing.
                needs.bits = items.iter().map(|item| output_bits(net, *item)).sum();
                return needs;
            }
            items.iter().for_each(|item| needs.add(net, &read, *item));
            needs.steps.retain(|step| !facts.unreachable_steps.contains(step));
            needs
        };
        let shown = known(net, groups).into_iter().filter_map(|one| {
            let Known { signal, driver, readers } = one;
            // A statechart is on the CPU, which has no macrocells.
            let Signal::Fires(id) = signal else { return None };
            let transition = &net.transitions[id];
            let reads_inputs = !transition.events.is_empty() || reads_inputs(&transition.guard);
            let is_alive = !facts.dead_transitions.contains(&id);
            is_alive.then_some(Shown { driver, readers, reads_inputs })
        });
        Cells { facts, groups: groups.groups.iter().map(of).collect(), shown: shown.collect() }
    }

    /// The number of macrocells that a chip probably needs for some groups, if others are on other parts.
    #[must_use]
    pub fn least(&self, chip: PartIndex, decisions: &[(NodeIndex, PartIndex)]) -> u64 {
        let (mut steps, mut times) = (BTreeSet::new(), BTreeMap::new());
        let (mut edges, mut outputs, mut bits) = (BTreeSet::<EdgeId>::new(), 0, 0);
        let (mut here, mut elsewhere) = (BTreeSet::new(), BTreeSet::new());
        for (node, part) in decisions {
            if *part == chip {
                here.insert(*node)
            } else {
                elsewhere.insert(*node)
            };
        }
        for needs in here.iter().filter_map(|node| self.groups.get(*node)) {
            steps.extend(&needs.steps);
            for (step, width) in &needs.times {
                let widest = times.entry(*step).or_insert(0);
                *widest = (*widest).max(*width);
            }
            edges.extend(&needs.edges);
            outputs += needs.outputs;
            bits += needs.bits;
        }
        for shown in self.shown.iter().filter(|shown| here.contains(&shown.driver)) {
            if shown.readers.iter().any(|reader| elsewhere.contains(reader)) {
                *(if shown.reads_inputs { &mut bits } else { &mut outputs }) += 1;
            }
        }
        // By component; a step without one is alone.
        let mut codes: BTreeMap<Result<u32, StepId>, (usize, u64)> = BTreeMap::new();
        let component = |step: StepId| {
            let of = self.facts.component_of.as_ref();
            of.and_then(|of| of[step]).ok_or(step)
        };
        for step in steps {
            codes.entry(component(step)).or_default().0 += 1;
        }
        for (step, width) in times {
            let widest = &mut codes.entry(component(step)).or_default().1;
            *widest = (*widest).max(width);
        }
        let mut code_bits = 0;
        for (component, (steps, time)) in codes {
            let is_complete = component.is_ok_and(|id| {
                let data = self.facts.components.get(id as usize);
                data.is_some_and(|data| data.always && data.steps.len() == steps)
            });
            bits += time;
            code_bits += width_of(steps + usize::from(!is_complete));
        }
        bits + edges.len() as u64 + outputs.max(code_bits)
    }

    /// A minimal set of decisions of a placement that together probably need more than `room` macrocells of a chip; if any one of them is removed, the rest might fit.
    /// `None` if the whole placement might.
    #[must_use]
    pub fn too_much(
        &self,
        chip: PartIndex,
        placement: &[PartIndex],
        room: u64,
    ) -> Option<Vec<(NodeIndex, PartIndex)>> {
        let all: Vec<(NodeIndex, PartIndex)> = placement.iter().copied().enumerate().collect();
        if self.least(chip, &all) <= room {
            return None;
        }
        let mut kept = all.clone();
        for decision in &all {
            let fewer: Vec<_> = kept.iter().copied().filter(|it| it != decision).collect();
            if self.least(chip, &fewer) > room {
                kept = fewer;
            }
        }
        Some(kept)
    }
}

/// The bits of a continuous output.
fn output_bits(net: &Net, item: Item) -> u64 {
    let Item::Output(id) = item else { return 0 };
    let output = &net.outputs[id];
    match &output.driver {
        Driver::Continuous(all) if !all.is_empty() => u64::from(output.ty.bits()),
        _ => 0,
    }
}

/// True if an expression reads an input, also through an edge.
fn reads_inputs(expr: &Expr) -> bool {
    expr.leaves().any(|leaf| matches!(leaf, Leaf::Input(_) | Leaf::Rise(_) | Leaf::Fall(_)))
}

/// The bits of a code with this many values.
fn width_of(values: usize) -> u64 {
    u64::from(usize::BITS - values.saturating_sub(1).leading_zeros())
}

impl Needs {
    fn add(&mut self, net: &Net, read: &BTreeSet<VarId>, item: Item) {
        for expr in exprs(net, item) {
            for leaf in expr.leaves() {
                match *leaf {
                    Leaf::Active(step) => {
                        self.steps.insert(step);
                    }
                    Leaf::Rise(edge) | Leaf::Fall(edge) => {
                        let operand = &net.edges[edge].expr.kind;
                        if matches!(operand, ExprKind::Leaf(Leaf::Input(_))) {
                            self.edges.insert(edge);
                        }
                    }
                    _ => {}
                }
            }
            for (leaf, constant) in expr.compared() {
                if let Leaf::Elapsed(step) = *leaf {
                    let width = u64::from(Type::Int { lo: 0, hi: constant.max(0) }.bits());
                    let widest = self.times.entry(step).or_insert(0);
                    *widest = (*widest).max(width);
                }
            }
        }
        match item {
            Item::Transition(id) => self.steps.extend(&net.transitions[id].requires),
            Item::Output(id) => {
                if let Driver::Continuous(all) | Driver::Mealy(all) = &net.outputs[id].driver {
                    self.steps.extend(all.iter().map(|one| one.step));
                    let bits = u64::from(net.outputs[id].ty.bits());
                    let mut conditions = all.iter().filter_map(|one| one.condition.as_ref());
                    if conditions.any(reads_inputs) {
                        self.bits += bits;
                    } else if !all.is_empty() {
                        self.outputs += bits;
                    }
                }
            }
            Item::Action(id) => {
                let action = &net.actions[id];
                self.steps.extend(action.uses.iter().map(|one| one.step));
            }
            Item::Var(id) if read.contains(&id) => {
                let var = &net.vars[id];
                self.bits += u64::from(var.ty.bits()) * u64::from(var.len.unwrap_or(1));
            }
            Item::Var(_) | Item::Step(_) | Item::Event(_) => {}
        }
    }
}
