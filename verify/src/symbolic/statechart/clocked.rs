//! One round of an evolution as a step of a machine, for decision diagrams: the state between two checks is the state of the net and what the evolution
//! carries from one check to the next (queues, the current event, the inputs of the row).
//!
//! A step from a state between reactions begins with Latch; a step after which no check follows includes the end of the reaction.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Evolution, Expr, Net};
use grafsynth_ir::program::Origin;

use super::super::Model;
use super::super::aig::Lit;
use super::super::number::Number;
use super::super::reaction::{Inputs, Maker, Unsupported};
use super::super::state::{Key, State, Value};
use super::run::{External, Run, RunQueue};

/// One step of the machine, as functions of its state and inputs.
pub(in crate::symbolic) struct Step {
    pub(in crate::symbolic) next: BTreeMap<Key, Lit>,
    /// The value of each bit that is not part of the net's state, between reactions: 0.
    pub(in crate::symbolic) helpers: Vec<Key>,
    /// True in a state between reactions.
    pub(in crate::symbolic) is_row: Lit,
    /// For each property, whether the step ends a reaction and violates it.
    pub(in crate::symbolic) broken: Vec<Lit>,
    /// The transitions that fire.
    pub(in crate::symbolic) fired: Vec<Lit>,
}

/// A list of bits that is read in the order in which it was written.
struct Bits {
    bits: Vec<Lit>,
    at: usize,
}

impl Bits {
    fn next(&mut self) -> Lit {
        let lit = self.bits.get(self.at).copied().unwrap_or(Lit::FALSE);
        self.at += 1;
        lit
    }

    fn take(&mut self, n: u32) -> Vec<Lit> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// The number of bits of a number from 0 to `most`.
fn width(most: i64) -> u32 {
    64 - most.unsigned_abs().leading_zeros()
}

fn limit_of(net: &Net) -> u32 {
    match net.settings.evolution {
        Evolution::Single => 1,
        Evolution::Stable { limit } => limit,
    }
}

impl Maker<'_> {
    /// The run as bits.
    pub(super) fn written(&mut self, run: &Run) -> Vec<Lit> {
        let listened = self.chart().listened.clone();
        let mut bits = vec![run.running, run.fresh];
        bits.extend(
            listened.iter().map(|event| run.event.get(event).copied().unwrap_or(Lit::FALSE)),
        );
        bits.extend(run.count.code(&mut self.aig, 0, width(i64::from(limit_of(self.net)))));
        let charts = self.shape.chart.ended.clone();
        bits.extend(
            charts.iter().map(|chart| run.had_ended.get(chart).copied().unwrap_or(Lit::FALSE)),
        );
        self.written_queue(&run.internal, &mut bits);
        match &run.external {
            External::Queue(queue) => self.written_queue(queue, &mut bits),
            External::Row(waits) => bits.extend(
                listened.iter().map(|event| waits.get(event).copied().unwrap_or(Lit::FALSE)),
            ),
        }
        bits
    }

    fn written_queue(&mut self, queue: &RunQueue, bits: &mut Vec<Lit>) {
        let n_bits = width(self.chart().listened.len() as i64);
        for ((item, used), waited) in queue.items.iter().zip(&queue.used).zip(&queue.waited) {
            // Elements after the end are 0, so that equal queues are equal states.
            for bit in item.code(&mut self.aig, 0, n_bits) {
                bits.push(self.aig.and(bit, *used));
            }
            bits.push(*used);
            bits.push(self.aig.and(*used, *waited));
        }
    }

    /// The run from its bits; `like` has the same queues.
    pub(super) fn read_run(&mut self, like: &Run, bits: &[Lit]) -> Run {
        let listened = self.chart().listened.clone();
        let charts = self.shape.chart.ended.clone();
        let mut bits = Bits { bits: bits.to_vec(), at: 0 };
        let (running, fresh) = (bits.next(), bits.next());
        let event = listened.iter().map(|event| (*event, bits.next())).gather();
        let count = bits.take(width(i64::from(limit_of(self.net))));
        let count = Number::from_code(&mut self.aig, &count, 0);
        let had_ended = charts.into_iter().map(|chart| (chart, bits.next())).gather();
        let internal = self.read_queue(&like.internal, &mut bits);
        let external = match &like.external {
            External::Queue(queue) => External::Queue(self.read_queue(queue, &mut bits)),
            External::Row(_) => {
                External::Row(listened.iter().map(|event| (*event, bits.next())).gather())
            }
        };
        Run {
            internal,
            external,
            fault: Lit::FALSE,
            running,
            fresh,
            event,
            count,
            // The limit may be reached in any round.
            n_rounds: limit_of(self.net),
            had_ended,
        }
    }

    fn read_queue(&mut self, like: &RunQueue, bits: &mut Bits) -> RunQueue {
        let n_bits = width(self.chart().listened.len() as i64);
        let mut queue = RunQueue::empty(0);
        for _ in &like.items {
            let code = bits.take(n_bits);
            queue.items.push(Number::from_code(&mut self.aig, &code, 0));
            queue.used.push(bits.next());
            queue.waited.push(bits.next());
        }
        queue
    }
}

impl Model<'_> {
    /// The machine that makes one check in each step. Adds its bits to those of the state.
    pub(in crate::symbolic) fn step(&mut self, never: &[&Expr]) -> Result<Step, Unsupported> {
        let net = self.maker.net;
        let shape = self.maker.shape.clone();
        let state = self.state.clone();
        // The first check of a reaction begins with Latch, with the inputs of the row.
        self.maker.inputs = self.inputs.clone();
        let mut latched = state.clone();
        self.maker.latch(&mut latched);
        self.maker.begin_evolution(&mut latched, false);
        let begun = self.maker.run.clone();
        let begun_bits = self.maker.written(&begun);

        let mut helpers = Vec::new();
        let run_bits: Vec<Lit> = begun_bits.iter().map(|_| self.helper(&mut helpers)).collect();
        let running = run_bits.first().copied().unwrap_or(Lit::FALSE);
        let (inputs, held) = self.held_inputs(running, &mut helpers);
        let merged: Vec<Lit> = run_bits
            .iter()
            .zip(&begun_bits)
            .map(|(own, begun)| self.aig().ite(running, *own, *begun))
            .collect();
        let run = self.maker.read_run(&begun, &merged);
        let mut now = self.choose_state(running, &state, &latched);
        self.maker.inputs = inputs.clone();
        self.maker.run = run;
        self.maker.fired.clear();
        self.maker.round(&mut now)?;
        let after = self.maker.run.clone();
        let goes_on = after.running;
        let after_bits = self.maker.written(&after);
        let ended = self.maker.end_of_statechart(now.clone())?.state;
        let next_state = self.choose_state(goes_on, &now, &ended);
        let mut next = shape.bits(net, self.aig(), &next_state);
        for (key, bit) in helpers.iter().zip(after_bits.into_iter().chain(held)) {
            let bit = self.aig().and(bit, goes_on);
            next.insert(*key, bit);
        }
        let mut broken = Vec::new();
        for never in never {
            let violated = self.maker.forbidden(&ended, &inputs, never);
            broken.push(self.aig().and(violated, !goes_on));
        }
        let fired = self.maker.fired.pop().unwrap_or_default();
        Ok(Step { next, helpers, is_row: !running, broken, fired })
    }

    /// A bit that is needed between two checks but is not a piece of the net's state.
    fn helper(&mut self, helpers: &mut Vec<Key>) -> Lit {
        let lit = self.aig().variable();
        let key = (Origin::Helper, helpers.len() as u32, 0);
        self.state_bits.insert(key, lit);
        self.name_of.insert(lit, key);
        helpers.push(key);
        lit
    }

    /// The inputs of the row, which are kept from its first check on, and their bits.
    fn held_inputs(&mut self, running: Lit, helpers: &mut Vec<Key>) -> (Inputs, Vec<Lit>) {
        let row = self.inputs.clone();
        let mut values = Vec::new();
        let mut held = Vec::new();
        for (input, value) in self.maker.net.inputs.values().zip(&row.values) {
            if input.kind.is_event() {
                values.push(value.clone());
                continue;
            }
            let lo = input.ty.bounds().0;
            let code = match value {
                Value::Flag(lit) => vec![*lit],
                Value::Number(number) => number.code(self.aig(), lo, input.ty.bits()),
            };
            let mut now = Vec::new();
            for fresh in code {
                let kept = self.helper(helpers);
                now.push(self.aig().ite(running, kept, fresh));
            }
            values.push(match input.ty {
                Type::Bool => Value::Flag(now.first().copied().unwrap_or(Lit::FALSE)),
                Type::Int { .. } => Value::Number(Number::from_code(self.aig(), &now, lo)),
            });
            held.extend(now);
        }
        (Inputs { values, ..row }, held)
    }

    fn choose_state(&mut self, condition: Lit, then: &State, otherwise: &State) -> State {
        let net = self.maker.net;
        let shape = self.maker.shape.clone();
        let then = shape.bits(net, self.aig(), then);
        let otherwise = shape.bits(net, self.aig(), otherwise);
        shape.read(net, self.aig(), &mut |key, aig| aig.ite(condition, then[&key], otherwise[&key]))
    }
}
