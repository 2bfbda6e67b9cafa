//! The rounds of a divided net (semantics §10.3): one simulator for each part, joined by the wires.

use grafsynth_ir::division::{Division, Shown, Source};
use grafsynth_ir::net::Net;

use crate::row::{Effect, InputRow, Row};
use crate::simulator::Simulator;

/// Runs the parts of a division together, one round after another. Its rows are rows of the whole net.
#[derive(Debug, Clone)]
pub struct Joint<'n> {
    net: &'n Net,
    division: &'n Division,
    parts: Vec<Simulator<'n>>,
}

impl<'n> Joint<'n> {
    /// All parts after reset.
    #[must_use]
    pub fn new(net: &'n Net, division: &'n Division) -> Self {
        let parts = division.parts.iter().map(|part| Simulator::new(&part.net)).collect();
        Joint { net, division, parts }
    }

    /// The row of the last round (row 0 after reset), in the ids of the whole net.
    #[must_use]
    pub fn row(&self, input: &InputRow) -> Row {
        joined_row(self.net, self.division, self.parts.iter().map(Simulator::row), input)
    }

    /// One round: each part decides what fires, from its own state and the inputs; then all parts fire, with the wires as the decisions left them.
    pub fn step(&mut self, input: &InputRow) -> Row {
        let division = self.division;
        let mut fires = vec![0; self.net.transitions.len()];
        for (part, simulator) in division.parts.iter().zip(&self.parts) {
            if !part.outputs.values().any(|shown| matches!(shown, Shown::Fires(_))) {
                continue;
            }
            // What a part decides does not depend on its wires, so any values do here.
            let mut ahead = simulator.clone();
            let row = ahead.step(&own_row(part, input, &fires));
            for (id, shown) in part.outputs.iter() {
                if let Shown::Fires(transition) = shown {
                    fires[transition.index()] = row.outputs[id.index()];
                }
            }
        }
        for (part, simulator) in division.parts.iter().zip(&mut self.parts) {
            simulator.step(&own_row(part, input, &fires));
        }
        self.row(input)
    }
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
        let owned = |step: &&grafsynth_ir::net::StepId| division.owners.steps[**step] == at;
        let steps: Vec<_> = own.steps.iter().map(|step| part.steps[*step]).collect();
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
        row.effects.extend(own.effects.iter().map(|effect| match effect {
            Effect::Call(output, arguments) => match part.outputs[*output] {
                Shown::Output(old) => Effect::Call(old, arguments.clone()),
                Shown::Fires(_) => unreachable!("a wire is no function"),
            },
            Effect::Condition(input) => match part.inputs[*input] {
                Source::Input(old) => Effect::Condition(old),
                Source::Fires(_) => unreachable!("a wire is no function"),
            },
            Effect::Code(text) => Effect::Code(text.clone()),
        }));
    }
    row.steps.sort_unstable();
    row
}

/// The inputs of a part in a round.
fn own_row(part: &grafsynth_ir::division::PartNet, input: &InputRow, fires: &[i64]) -> InputRow {
    let value = |source: &Source| match source {
        Source::Input(old) => input.value(*old),
        Source::Fires(transition) => fires[transition.index()],
    };
    InputRow { dt: input.dt, values: part.inputs.values().map(value).collect() }
}
