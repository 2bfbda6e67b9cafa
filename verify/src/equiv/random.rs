//! Compares net and circuit in directed random runs, which restart often and aim at transitions that have not fired yet.

use std::collections::VecDeque;
use std::ops::Range;

use grafsynth_ir::Valid;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Ahead, Difference, InputRow, Row, Stimulus};

use super::Counterexample;
use super::binding::Binding;
use super::explicit::Lanes;
use crate::verdict::Tested;

/// The number of reactions that the net executes before the circuit executes them.
const BATCH: usize = 1024;
/// The number of reactions that the circuit executes at once.
const LANES: usize = 64;

/// Compares some reactions: returns a difference if there is one, and the coverage.
pub(super) fn compare(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    n_rows: usize,
) -> (Option<Counterexample>, Tested) {
    // One clock of a chip is at most one tick.
    let mut ahead = Ahead::new(net, 1, 1, n_rows);
    let found = difference(net, logic, binding, &mut ahead);
    (found, Tested::of(net, &ahead.coverage()))
}

fn difference(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    ahead: &mut Ahead<'_>,
) -> Option<Counterexample> {
    let mut lanes = Lanes::new(net, logic, binding);
    lanes.reset(net);
    if let Some(differs) = lanes.difference(net, ahead.row(), 0) {
        let difference = lanes.report(net, ahead.row(), 0, 0, differs);
        return Some(Counterexample { stimulus: Stimulus::new(net), difference });
    }
    let mut circuit = Circuit {
        net,
        lanes,
        every_flop: vec![!0; logic.flops.len().div_ceil(64)],
        codes: Vec::new(),
    };
    circuit.codes.push(circuit.lanes.code(0, &circuit.every_flop));
    loop {
        let (numbers, expected) = ahead.batch(BATCH);
        if numbers.is_empty() {
            return None;
        }
        if let Some(different) = circuit.answer(ahead, numbers, &expected) {
            let stimulus = Stimulus::of_rows(net, &ahead.path(different.number));
            let row = stimulus.len();
            return Some(Counterexample {
                stimulus,
                difference: Difference { row, ..different.difference },
            });
        }
    }
}

/// A reaction that differs in the circuit.
struct Different {
    number: usize,
    difference: Difference,
}

/// The circuit, and its state after each reaction.
struct Circuit<'a> {
    net: &'a Net,
    lanes: Lanes<'a>,
    every_flop: Vec<u64>,
    /// The state of the circuit, by index: 0 is the state after reset, `n + 1` the state after reaction `n`.
    codes: Vec<Vec<u64>>,
}

impl Circuit<'_> {
    /// Executes a batch of reactions, in parallel if their start states are known; returns the first that differs.
    fn answer(
        &mut self,
        ahead: &Ahead<'_>,
        numbers: Range<usize>,
        expected: &[Row],
    ) -> Option<Different> {
        let first = numbers.start;
        let batch = &ahead.made()[numbers];
        self.codes.resize(first + 1 + batch.len(), Vec::new());
        let mut ready = VecDeque::new();
        // For each reaction of the batch: the reactions that start from its result.
        let mut next = vec![Vec::new(); batch.len()];
        for (at, reaction) in batch.iter().enumerate() {
            match reaction.from.checked_sub(first + 1) {
                Some(before) => next[before].push(at),
                None => ready.push_back(at),
            }
        }
        let mut earliest: Option<Different> = None;
        while !ready.is_empty() {
            let group: Vec<usize> = ready.drain(..ready.len().min(LANES)).collect();
            let codes: Vec<&[u64]> =
                group.iter().map(|at| self.codes[batch[*at].from].as_slice()).collect();
            self.lanes.set_codes(&codes);
            let rows: Vec<InputRow> = group.iter().map(|at| batch[*at].row.clone()).collect();
            if let Err(lane) = self.lanes.react(self.net, &rows) {
                return Some(Different {
                    number: first + group[lane],
                    difference: Lanes::still_busy(0),
                });
            }
            let rows: Vec<&Row> = group.iter().map(|at| &expected[*at]).collect();
            let differences = self.lanes.differences(self.net, &rows);
            for (lane, (at, differs)) in group.into_iter().zip(differences).enumerate() {
                let (number, row) = (first + at, &expected[at]);
                match differs {
                    Some(differs) => {
                        if earliest.as_ref().is_none_or(|other| number < other.number) {
                            let difference = self.lanes.report(self.net, row, lane, 0, differs);
                            earliest = Some(Different { number, difference });
                        }
                    }
                    None => {
                        self.codes[number + 1] = self.lanes.code(lane, &self.every_flop);
                        ready.extend(next[at].iter().copied());
                    }
                }
            }
        }
        earliest
    }
}
