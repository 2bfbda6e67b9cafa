//! The rounds of a divided net (semantics §10.3): one simulator for each part, joined by the wires.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::{Division, PartNet, Shown, Signal, Source, rounds_of};
use grafsynth_ir::net::{Net, OutputId};

use crate::row::{Effect, InputRow, Row};
use crate::simulator::Simulator;

/// Runs the parts of a division together, one round after another. Its rows are rows of the whole net.
#[derive(Debug, Clone)]
pub struct Joint<'n> {
    net: &'n Net,
    division: &'n Division,
    parts: Vec<Simulator<'n>>,
    /// The calls in the rounds of the last reaction before its last round.
    effects: Vec<Effect>,
    /// The number of these calls of each output that is a function.
    called: BTreeMap<OutputId, i64>,
    /// Whether a transition would still fire after the largest number of rounds that the net allows. The parts do not run that round.
    fault: bool,
}

impl<'n> Joint<'n> {
    /// All parts after reset.
    #[must_use]
    pub fn new(net: &'n Net, division: &'n Division) -> Self {
        let parts = division.parts.iter().map(|part| Simulator::new(&part.net)).collect();
        let (effects, called) = (Vec::new(), BTreeMap::new());
        let mut joint = Joint { net, division, parts, effects, called, fault: false };
        joint.show_states();
        joint
    }

    /// The chips of a statechart follow the states that the reset reaches (semantics §10.8): in row 0 their wires show them already.
    fn show_states(&mut self) {
        let zero = InputRow { dt: 0, ..InputRow::zero(self.net) };
        let mut signals = Signals::new();
        for (part, simulator) in self.division.parts.iter().zip(&self.parts) {
            shown_signals(part, simulator.row(), &mut signals);
        }
        for (part, simulator) in self.division.parts.iter().zip(&mut self.parts) {
            let is_state = |source: &Source| matches!(source, Source::Wire(Signal::Active(_)));
            if part.inputs.values().any(is_state) {
                simulator.step(&own_row(part, &zero, &signals, false));
            }
        }
    }

    /// The row of the last round (row 0 after reset), in the ids of the whole net.
    #[must_use]
    pub fn row(&self, input: &InputRow) -> Row {
        let rows = self.parts.iter().map(Simulator::row);
        let mut row = joined_row(self.net, self.division, rows, input);
        row.fault |= self.fault;
        for (output, calls) in &self.called {
            row.outputs[output.index()] += calls;
        }
        row.effects.splice(0..0, self.effects.iter().cloned());
        // The function of an extern condition is called at most once in all rounds of a reaction.
        let mut asked = BTreeSet::new();
        row.effects.retain(|effect| match effect {
            Effect::Condition(id) => asked.insert(*id),
            Effect::Call(..) | Effect::Code(_) => true,
        });
        row
    }

    /// The calls of the last round, in the ids of the whole net.
    fn calls(&self) -> Vec<Effect> {
        let parts = self.division.parts.iter().zip(&self.parts);
        parts.flat_map(|(part, simulator)| effects_of(part, simulator.row())).collect()
    }

    /// One reaction: one round or, if the evolution of the net is `stable`, rounds until nothing fires. Time and events are those of the first round.
    pub fn step(&mut self, input: &InputRow) -> Row {
        self.effects.clear();
        self.called.clear();
        self.fault = false;
        let Some(limit) = rounds_of(self.net) else {
            let decided = self.decisions(input);
            self.round(input, &decided);
            return self.row(input);
        };
        let mut held = input.clone();
        for n in 0..=limit {
            let decided = self.decisions(&held);
            let moves = decided.moving.contains(&true);
            self.fault = moves && n == limit;
            if self.fault {
                break;
            }
            self.round(&held, &decided);
            if !moves {
                break;
            }
            self.remember_calls();
            held.dt = 0;
            for (value, one) in held.values.iter_mut().zip(self.net.inputs.values()) {
                if one.kind.is_event() {
                    *value = 0;
                }
            }
        }
        self.row(input)
    }

    /// Keeps the calls of a round that is followed by another one in the same reaction.
    fn remember_calls(&mut self) {
        self.effects.extend(self.calls());
        for (part, simulator) in self.division.parts.iter().zip(&self.parts) {
            for (id, shown) in part.outputs.iter() {
                if let Shown::Output(old) = *shown
                    && self.net.outputs[old].is_extern()
                {
                    *self.called.entry(old).or_default() += simulator.row().outputs[id.index()];
                }
            }
        }
    }

    /// What the parts show in the next round. Each part decides from its own state and the inputs.
    fn decisions(&self, input: &InputRow) -> Decisions {
        let mut signals = Signals::new();
        let mut moving = vec![false; self.parts.len()];
        let parts = self.division.parts.iter().zip(&self.parts);
        for ((part, simulator), moves) in parts.zip(&mut moving) {
            if !part.outputs.values().any(|shown| !matches!(shown, Shown::Output(_))) {
                continue;
            }
            // The decisions of a part do not depend on its wires, so any values will do here.
            let mut ahead = simulator.clone();
            let row = ahead.step(&own_row(part, input, &signals, false));
            *moves = shown_signals(part, row, &mut signals);
        }
        Decisions { signals, moving }
    }

    /// One round: all parts fire, with the wires as the decisions left them. A chip knows whether any part moves; the CPU knows whether a chip does.
    fn round(&mut self, input: &InputRow, decided: &Decisions) {
        let cpu = self.parts.len().saturating_sub(1);
        let parts = self.division.parts.iter().zip(&mut self.parts);
        for (at, (part, simulator)) in parts.enumerate() {
            let known = if at == cpu { &decided.moving[..cpu] } else { &decided.moving };
            let more = known.contains(&true);
            simulator.step(&own_row(part, input, &decided.signals, more));
        }
    }
}

/// What the parts show before they make a round.
struct Decisions {
    signals: Signals,
    /// For each part, whether one of its transitions fires, if it shows that.
    moving: Vec<bool>,
}

/// The values on wires.
type Signals = BTreeMap<Signal, i64>;

/// Adds what the wires of a part show in a row; returns whether a transition of the part fires, if it shows that.
fn shown_signals(part: &PartNet, row: &Row, signals: &mut Signals) -> bool {
    let mut moves = false;
    for (id, shown) in part.outputs.iter() {
        let value = row.outputs[id.index()];
        match shown {
            Shown::Wire(signal) => _ = signals.insert(*signal, value),
            Shown::Moves => moves |= value != 0,
            Shown::Output(_) => {}
        }
    }
    moves
}

/// The row of the whole net, from a row of each part in order.
pub fn joined_row<'r>(
    net: &Net,
    division: &Division,
    rows: impl IntoIterator<Item = &'r Row>,
    input: &InputRow,
) -> Row {
    let mut row = Row { dt: input.dt, inputs: input.values.clone(), ..Row::zero(net) };
    for (at, (part, own)) in division.parts.iter().zip(rows).enumerate() {
        row.fault |= own.fault;
        let owned = |step: &&grafsynth_ir::net::StepId| division.owners.steps[**step] == at;
        let steps: Vec<_> = own.steps.iter().filter_map(|step| part.steps[*step].step()).collect();
        row.steps.extend(steps.iter().filter(owned));
        for (id, shown) in part.outputs.iter() {
            if let Shown::Output(old) = shown {
                row.outputs[old.index()] = own.outputs[id.index()];
            }
        }
        let mut place = 0;
        for (id, var) in part.net.vars.iter() {
            let len = var.len.unwrap_or(1) as usize;
            let before = net.vars.values().take(part.vars[id].index());
            let start: usize = before.map(|var| var.len.unwrap_or(1) as usize).sum();
            row.vars[start..start + len].copy_from_slice(&own.vars[place..place + len]);
            place += len;
        }
        row.effects.extend(effects_of(part, own));
    }
    row.steps.sort_unstable();
    row
}

/// The effects in a row of a part, in the ids of the whole net.
fn effects_of<'r>(part: &'r PartNet, row: &'r Row) -> impl Iterator<Item = Effect> + 'r {
    row.effects.iter().map(|effect| match effect {
        Effect::Call(output, arguments) => match part.outputs[*output] {
            Shown::Output(old) => Effect::Call(old, arguments.clone()),
            Shown::Wire(_) | Shown::Moves => unreachable!("a wire is no function"),
        },
        Effect::Condition(input) => match part.inputs[*input] {
            Source::Input(old) => Effect::Condition(old),
            Source::Direct(_) | Source::Wire(_) | Source::More => {
                unreachable!("a wire is no function")
            }
        },
        Effect::Code(text) => Effect::Code(text.clone()),
    })
}

/// The inputs of a part in a round.
fn own_row(part: &PartNet, input: &InputRow, signals: &Signals, more: bool) -> InputRow {
    let value = |source: &Source| match source {
        Source::Input(old) | Source::Direct(old) => input.value(*old),
        Source::Wire(signal) => signals.get(signal).copied().unwrap_or_default(),
        Source::More => i64::from(more),
    };
    InputRow { dt: input.dt, values: part.inputs.values().map(value).collect() }
}
