//! Plants beside a chart (docs/plant.md): the plant moves while time passes, sets its inputs, the chart reacts, and the plant sees the outputs.
//!
//! All arithmetic is exact. Between two reactions the outputs and inputs are those of the first one, and every condition of a move is read once, at its end.
//! The script of a page does the same (`page/src/web/plant.js`); the tests compare both.

use grafsynth_ir::net::{InputId, Net};
use grafsynth_ir::plant::{Condition, MAX_UNITS, Plant, Reading, SCALE, Sensor};
use grafsynth_ir::{Diagnostic, Valid};

use crate::clocked::Clocked;
use crate::row::{InputRow, Row};
use crate::simulator::Simulator;
use crate::stimulus::Stimulus;

/// A plant with the values of its quantities.
#[derive(Debug, Clone)]
pub struct RunningPlant<'p> {
    plant: &'p Plant,
    /// Nanoseconds per tick.
    tick_ns: i128,
    /// For each quantity, its value in [`SCALE`]ths of a unit.
    values: Vec<i64>,
    /// The inputs and the outputs of the last reaction.
    inputs: Vec<i64>,
    outputs: Vec<i64>,
}

impl<'p> RunningPlant<'p> {
    /// The plant after the reset of a chart whose row is given.
    #[must_use]
    pub fn new(plant: &'p Plant, net: &Net, reset: &Row) -> Self {
        let mut it = RunningPlant {
            plant,
            tick_ns: i128::from(net.settings.tick_ns),
            values: plant.quantities.values().map(|quantity| quantity.init * SCALE).collect(),
            inputs: Vec::new(),
            outputs: Vec::new(),
        };
        it.hold(reset);
        it
    }

    /// The value of each quantity, in [`SCALE`]ths of a unit.
    #[must_use]
    pub fn values(&self) -> &[i64] {
        &self.values
    }

    /// Takes the inputs and outputs of a reaction.
    pub fn hold(&mut self, row: &Row) {
        self.inputs.clone_from(&row.inputs);
        self.outputs.clone_from(&row.outputs);
    }

    /// Lets time pass.
    pub fn advance(&mut self, ticks: u32) {
        let mut rates = vec![0i128; self.values.len()];
        for one in &self.plant.moves {
            if self.holds(&one.when) {
                let speed = one.speed.map_or(1, |output| self.outputs[output.index()]);
                rates[one.quantity.index()] += i128::from(one.rate) * i128::from(speed);
            }
        }
        let elapsed = i128::from(ticks).saturating_mul(self.tick_ns);
        for ((value, rate), quantity) in
            self.values.iter_mut().zip(rates).zip(self.plant.quantities.values())
        {
            // A change that saturates is far beyond the range of the quantity.
            let moved = i128::from(*value).saturating_add(rate.saturating_mul(elapsed));
            let limited =
                moved.clamp(i128::from(quantity.lo * SCALE), i128::from(quantity.hi * SCALE));
            *value = i64::try_from(limited).unwrap_or(MAX_UNITS * SCALE);
        }
        for set in &self.plant.sets {
            if self.holds(&set.when) {
                self.values[set.quantity.index()] = set.value * SCALE;
            }
        }
    }

    /// Sets the inputs that the plant drives, except those that are forced.
    pub fn drive(&self, net: &Net, row: &mut InputRow, is_forced: impl Fn(InputId) -> bool) {
        for (input, sensor) in &self.plant.sensors {
            if is_forced(*input) {
                continue;
            }
            row.values[input.index()] = match sensor {
                Sensor::Is(condition) => i64::from(self.holds(condition)),
                Sensor::Measures(quantity) => {
                    let units = self.values[quantity.index()].div_euclid(SCALE);
                    net.inputs[*input].ty.saturate(units)
                }
            };
        }
    }

    fn holds(&self, condition: &Condition) -> bool {
        match condition {
            Condition::All(all) => all.iter().all(|one| self.holds(one)),
            Condition::Any(any) => any.iter().any(|one| self.holds(one)),
            Condition::Not(inner) => !self.holds(inner),
            Condition::Within(reading, lo, hi) => {
                let value = match reading {
                    Reading::Quantity(id) => self.values[id.index()],
                    Reading::Input(id) => self.inputs[id.index()],
                    Reading::Output(id) => self.outputs[id.index()],
                };
                lo.is_none_or(|lo| value >= lo) && hi.is_none_or(|hi| value <= hi)
            }
        }
    }
}

/// Runs a chart with its plant, one tick at a time: a row of the stimulus with k ticks becomes k reactions with its inputs, as on a chip (semantics §9). The
/// plant drives its inputs, except those that have a column in the stimulus. Returns the inputs as they were set.
///
/// # Errors
/// If the stimulus takes too many ticks.
pub fn with_plant(
    net: &Valid<Net>,
    plant: &Plant,
    stimulus: &Stimulus,
) -> Result<Stimulus, Box<Diagnostic>> {
    let clocked = Clocked::of(net, stimulus)?.stimulus;
    let mut simulator = Simulator::new(net);
    let mut running = RunningPlant::new(plant, net, &simulator.reset());
    let mut driven = Stimulus::new(net);
    for mut row in clocked.rows() {
        running.advance(row.dt);
        running.drive(net, &mut row, |input| stimulus.has_column(input));
        running.hold(simulator.step(&row));
        driven.push(&row);
    }
    Ok(driven)
}
