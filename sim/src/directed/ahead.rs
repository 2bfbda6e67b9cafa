//! Executes directed reactions before other outputs are compared with them. The choice of reactions depends only on the net, so a batch of them can be
//! prepared before the first answer is needed, and the answering side may combine reactions of different runs.

use std::ops::Range;

use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;

use super::{Coverage, Directed, Start};
use crate::row::{InputRow, Row};

/// The number of micro-steps after which no more reactions are run. One reaction may take as many micro-steps as the chart's `limit` allows.
pub const MICRO_STEPS: u64 = 1_000_000;

/// A reaction that the net has executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Made {
    /// The state from which the reaction continues: 0 is the state after reset, `n + 1` is the state after reaction `n`.
    pub from: usize,
    /// The inputs of the reaction.
    pub row: InputRow,
}

/// Reactions of a net, in batches; see the module documentation.
pub struct Ahead<'n> {
    directed: Directed<'n>,
    made: Vec<Made>,
    /// For each saved state, by its number: its number in [`Made::from`].
    saved: Vec<usize>,
    reactions: usize,
    /// The remaining number of attempts. An attempt gives no reaction if no inputs that satisfy the chart's assumptions are found; this may happen in
    /// every attempt.
    tries: usize,
    micro_steps: u64,
}

impl<'n> Ahead<'n> {
    /// Prepares this number of reactions; fewer if no inputs are found that satisfy the chart's assumptions, or after [`MICRO_STEPS`]. `seed` and `max_dt`
    /// are those of [`Directed::new`].
    #[must_use]
    pub fn new(net: &'n Valid<Net>, seed: u64, max_dt: u32, reactions: usize) -> Self {
        Ahead {
            directed: Directed::new(net, seed, max_dt),
            made: Vec::new(),
            saved: Vec::new(),
            reactions,
            tries: reactions.saturating_mul(2),
            micro_steps: 0,
        }
    }

    /// Executes the next reactions, at most `most`: returns their numbers and the net's rows. If the result is empty, there are no more.
    #[must_use]
    pub fn batch(&mut self, most: usize) -> (Range<usize>, Vec<Row>) {
        let first = self.made.len();
        let mut rows = Vec::new();
        while rows.len() < most
            && self.made.len() < self.reactions
            && self.tries > 0
            && !self.is_over()
        {
            self.tries -= 1;
            let Some(next) = self.directed.next() else { continue };
            let from = match next.from {
                Start::Here => self.made.len(),
                Start::Reset => 0,
                Start::Saved(number) => self.saved.get(number).copied().unwrap_or(0),
            };
            self.made.push(Made { from, row: next.row });
            if let Some(number) = next.save {
                if self.saved.len() <= number {
                    self.saved.resize(number + 1, 0);
                }
                self.saved[number] = self.made.len();
            }
            self.micro_steps += u64::from(self.directed.simulator().micro_steps());
            rows.push(self.directed.row().clone());
        }
        (first..self.made.len(), rows)
    }

    fn is_over(&self) -> bool {
        self.micro_steps >= MICRO_STEPS
    }

    /// The net's row after reset, until the first batch is executed; afterwards the row of the last reaction.
    #[must_use]
    pub fn row(&self) -> &Row {
        self.directed.row()
    }

    /// The reactions executed so far.
    #[must_use]
    pub fn made(&self) -> &[Made] {
        &self.made
    }

    /// The inputs from reset up to and including a reaction.
    #[must_use]
    pub fn path(&self, last: usize) -> Vec<InputRow> {
        let mut rows = Vec::new();
        let mut next = Some(last);
        while let Some(reaction) = next.and_then(|at| self.made.get(at)) {
            rows.push(reaction.row.clone());
            next = reaction.from.checked_sub(1);
        }
        rows.reverse();
        rows
    }

    /// The coverage so far.
    #[must_use]
    pub fn coverage(&self) -> Coverage {
        Coverage {
            is_cut_short: self.is_over() && self.made.len() < self.reactions,
            ..self.directed.coverage()
        }
    }
}
