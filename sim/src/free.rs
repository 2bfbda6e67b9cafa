//! Parts that run on their own (semantics §10.7): a simulator for each part, joined by lines that deliver changes late.
//!
//! A line leads to one input of one part, from the plant or from the part that shows a step. What its source does enters it as a change; a part that reacts takes as many
//! of the oldest changes as it likes from each of its lines, and reads the last one that it took. So a pulse can be missed, lines are not faster or slower by any rule, and
//! no line ever changes the order of its own changes.

use std::collections::BTreeMap;

use grafsynth_ir::division::{Division, PartIndex, Shown, Signal, Source};
use grafsynth_ir::net::{InputId, Net, OutputId, StepId};

use crate::layout::Cell;
use crate::row::InputRow;
use crate::simulator::Simulator;
use crate::state::State;

/// The parts of a division.
#[derive(Debug, Clone)]
pub struct FreeParts<'n> {
    net: &'n Net,
    division: &'n Division,
    parts: Vec<Simulator<'n>>,
    /// For each wire, its source and the lines that it feeds: part and input.
    wires: Vec<Fed>,
    /// The owner of each output, with its output.
    outputs: BTreeMap<OutputId, (PartIndex, OutputId)>,
    /// The step of the owner for each step.
    steps: BTreeMap<StepId, (PartIndex, StepId)>,
}

#[derive(Debug, Clone)]
struct Fed {
    from: (PartIndex, OutputId),
    to: Vec<(PartIndex, InputId)>,
}

/// Parts and lines between two reactions.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Moment {
    parts: Vec<OfPart>,
}

/// A part with its lines.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct OfPart {
    state: State,
    /// The outputs of its last row.
    shown: Vec<i64>,
    /// Whether that row had a fault.
    fault: bool,
    lines: Vec<Line>,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Line {
    /// The value that the part took last.
    taken: i64,
    /// The changes under way, the oldest first.
    under_way: Vec<i64>,
}

impl<'n> FreeParts<'n> {
    /// The parts of a division.
    #[must_use]
    pub fn new(net: &'n Net, division: &'n Division) -> Self {
        let parts = division.parts.iter().map(|part| Simulator::new(&part.net)).collect();
        let wires = division.wires.iter();
        let wires = wires.map(|wire| Fed { from: (wire.from, wire.output), to: wire.to.clone() });
        let (mut outputs, mut steps) = (BTreeMap::new(), BTreeMap::new());
        for (at, part) in division.parts.iter().enumerate() {
            for (own, shown) in part.outputs.iter() {
                if let Shown::Output(id) = *shown {
                    outputs.insert(id, (at, own));
                }
            }
            let all = part.steps.iter().filter_map(|(own, original)| Some((own, original.step()?)));
            let own = all.filter(|(_, id)| division.owners.steps[*id] == at);
            own.for_each(|(own, id)| _ = steps.insert(id, (at, own)));
        }
        FreeParts { net, division, parts, wires: wires.collect(), outputs, steps }
    }

    /// All parts after reset, with inputs 0. The flip-flops that synchronise the inputs of a chip start at 0, so a wire that is 1 then is a change under way. The last part
    /// is the CPU: it starts when the chips show their first states.
    #[must_use]
    pub fn reset(&mut self) -> Moment {
        let cpu = self.parts.len().saturating_sub(1);
        let mut parts = Vec::new();
        let all = self.parts.iter_mut().zip(&self.division.parts).enumerate();
        for (at, (simulator, part)) in all {
            let row = simulator.reset();
            let lines = part.inputs.values().map(|source| {
                let taken = match *source {
                    Source::Input(id) | Source::Direct(id) => self.net.inputs[id].ty.saturate(0),
                    Source::Wire(Signal::Active(step)) if at == cpu => {
                        i64::from(self.net.steps[step].is_initial)
                    }
                    Source::Wire(Signal::Active(_) | Signal::Fires(_)) | Source::More => 0,
                };
                Line { taken, under_way: Vec::new() }
            });
            let (lines, fault) = (lines.collect(), row.fault);
            parts.push(OfPart {
                state: simulator.state().clone(),
                shown: row.outputs,
                fault,
                lines,
            });
        }
        for wire in &self.wires {
            let (from, output) = wire.from;
            let shown =
                parts.get(from).and_then(|of: &OfPart| of.shown.get(output.index())).copied();
            for (to, input) in &wire.to {
                let lines = parts.get_mut(*to).map(|of| &mut of.lines);
                let line = lines.and_then(|lines| lines.get_mut(input.index()));
                if let (Some(line), Some(shown)) = (line, shown)
                    && line.taken != shown
                {
                    line.under_way.push(shown);
                }
            }
        }
        Moment { parts }
    }

    /// The plant changes an input: the change enters each line that leads from it.
    pub fn change(&self, moment: &mut Moment, input: InputId, value: i64) {
        for (part, of_part) in self.division.parts.iter().zip(&mut moment.parts) {
            for (source, line) in part.inputs.values().zip(&mut of_part.lines) {
                if *source == Source::Input(input) {
                    line.under_way.push(value);
                }
            }
        }
    }

    /// The number of changes under way on each line of a part.
    pub fn under_way<'m>(
        &self,
        moment: &'m Moment,
        part: PartIndex,
    ) -> impl Iterator<Item = usize> + 'm {
        moment.parts.get(part).into_iter().flat_map(|of| &of.lines).map(|line| line.under_way.len())
    }

    /// The values that a part took last from its lines.
    pub fn taken<'m>(&self, moment: &'m Moment, part: PartIndex) -> impl Iterator<Item = i64> + 'm {
        moment.parts.get(part).into_iter().flat_map(|of| &of.lines).map(|line| line.taken)
    }

    /// One reaction of a part after it took the given number of changes from each line; what it shows then enters the lines of the others.
    #[must_use]
    pub fn react(&mut self, moment: &Moment, part: PartIndex, takes: &[usize], dt: u32) -> Moment {
        let mut next = moment.clone();
        let (Some(of_part), Some(simulator)) = (next.parts.get_mut(part), self.parts.get_mut(part))
        else {
            return next;
        };
        for (line, n) in of_part.lines.iter_mut().zip(takes) {
            let n = (*n).min(line.under_way.len());
            line.taken = line.under_way.drain(..n).next_back().unwrap_or(line.taken);
        }
        let values = of_part.lines.iter().map(|line| line.taken).collect();
        simulator.set_state(&of_part.state);
        let row = simulator.step(&InputRow { dt, values });
        let before = std::mem::replace(&mut of_part.shown, row.outputs.clone());
        of_part.fault = row.fault;
        of_part.state.clone_from(simulator.state());
        let after = of_part.shown.clone();
        for wire in self.wires.iter().filter(|wire| wire.from.0 == part) {
            let at = wire.from.1.index();
            let (Some(old), Some(new)) = (before.get(at), after.get(at)) else { continue };
            if old == new {
                continue;
            }
            for (to, input) in &wire.to {
                let lines = next.parts.get_mut(*to).map(|of| &mut of.lines);
                if let Some(line) = lines.and_then(|lines| lines.get_mut(input.index())) {
                    line.under_way.push(*new);
                }
            }
        }
        next
    }

    /// What can be seen of the whole: the outputs of the net, whether each step is active, and whether a fault is shown.
    #[must_use]
    pub fn seen(&self, moment: &Moment) -> Vec<i64> {
        let output = |id: OutputId| {
            let (part, own) = self.outputs.get(&id)?;
            moment.parts.get(*part)?.shown.get(own.index()).copied()
        };
        let step = |id: StepId| {
            let (part, own) = self.steps.get(&id)?;
            Some(i64::from(moment.parts.get(*part)?.state.situation().contains(*own)))
        };
        let outputs = self.net.outputs.ids().map(|id| output(id).unwrap_or(0));
        let steps = self.net.steps.ids().map(|id| step(id).unwrap_or(0));
        let fault = i64::from(moment.parts.iter().any(|of| of.fault));
        outputs.chain(steps).chain([fault]).collect()
    }

    /// The number of stored values of the parts that differ from those of a state of the net, given by a simulator of it: counters of time, variables, edges, latches.
    #[must_use]
    pub fn differences(&self, moment: &Moment, whole: &Simulator<'_>) -> usize {
        let places: BTreeMap<Cell, usize> =
            (0..).zip(&whole.tables().layout.cells).map(|(at, cell)| (*cell, at)).collect();
        let mut n = 0;
        for ((simulator, part), of_part) in
            self.parts.iter().zip(&self.division.parts).zip(&moment.parts)
        {
            // A part may compare a time with smaller constants than the net.
            let caps: BTreeMap<Cell, i64> = simulator
                .clocks()
                .into_iter()
                .map(|clock| (clock.cell(), clock.saturate(i64::MAX)))
                .collect();
            let cells = simulator.tables().layout.cells.iter().zip(&of_part.state.cells);
            for (cell, value) in cells {
                let place = original(part, *cell).and_then(|cell| places.get(&cell));
                let Some(known) = place.and_then(|at| whole.state().cells.get(*at)) else {
                    continue;
                };
                let cap = caps.get(cell).copied().unwrap_or(i64::MAX);
                n += usize::from(*known.min(&cap) != *value);
            }
        }
        n
    }

    /// The value of a variable, or of one element of an array.
    #[must_use]
    pub fn var(&mut self, moment: &Moment, var: grafsynth_ir::net::VarId, index: u32) -> i64 {
        let owner = self.division.owners.vars[var];
        let own = self.division.parts.get(owner);
        let own = own.and_then(|part| part.vars.iter().find(|(_, id)| **id == var));
        match (own, self.parts.get_mut(owner), moment.parts.get(owner)) {
            (Some((own, _)), Some(simulator), Some(of)) => {
                simulator.set_state(&of.state);
                simulator.var(own, index)
            }
            _ => 0,
        }
    }
}

/// The cell of the whole net that a cell of a part copies, as far as it belongs to one object.
fn original(part: &grafsynth_ir::division::PartNet, cell: Cell) -> Option<Cell> {
    Some(match cell {
        Cell::Elapsed(id) => Cell::Elapsed(part.steps[id].step()?),
        Cell::LastElapsed(id) => Cell::LastElapsed(part.steps[id].step()?),
        Cell::Var(id, index) => Cell::Var(part.vars[id], index),
        Cell::Edge(id) => Cell::Edge(part.edges[id]),
        Cell::Timer(id) => Cell::Timer(part.timers[id]),
        Cell::TimerHeld(id) => Cell::TimerHeld(part.timers[id]),
        Cell::Task(id) => Cell::Task(part.steps[id].step()?),
        Cell::ActionQ(id) => Cell::ActionQ(part.actions[id]),
        Cell::Latch(id, qualifier) => Cell::Latch(part.actions[id], qualifier),
        Cell::ActionTimer(id, qualifier) => Cell::ActionTimer(part.actions[id], qualifier),
        Cell::ActionTimerHeld(id, qualifier) => Cell::ActionTimerHeld(part.actions[id], qualifier),
        Cell::Old(id, qualifier) => Cell::Old(part.actions[id], qualifier),
        // Orders of age have other places in a part; statecharts do not run like this.
        Cell::Age(..)
        | Cell::Raised(_)
        | Cell::Slot(_)
        | Cell::Recorded(..)
        | Cell::Ended(_)
        | Cell::Held(..) => return None,
    })
}
