//! Directed random runs of two nets: one net leads and aims at its own transitions that have not fired yet; the follower gets the same rows.

use std::collections::BTreeMap;

use grafsynth_ir::Valid;
use grafsynth_ir::net::{InputId, Net};
use grafsynth_sim::{Directed, InputRow, MAX_DT, Move, Random, Simulator, Start, State};

use super::common::{Common, CommonInput, Side};
use super::rows::{RowPair, Rows};
use crate::alphabet::cuts;
use crate::verdict::Tested;

/// The stimulus that shows a difference, if one was found, and the coverage.
#[derive(Debug)]
pub(super) struct Tried {
    pub(super) apart: Option<Vec<RowPair>>,
    pub(super) tested: Tested,
}

/// Compares the nets in this many reactions; each net leads in half of them.
pub(super) fn compare(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    rows: &Rows<'_, '_>,
    reactions: usize,
    seed: u64,
    max_dt: u32,
) -> Tried {
    let (ours, theirs) = (Simulator::new(left), Simulator::new(right));
    if common.differs(ours.row(), theirs.row()).is_some() {
        return Tried { apart: Some(Vec::new()), tested: Tested::default() };
    }
    let mut tested = Tested::default();
    for (side, share) in [(Side::Left, reactions.div_ceil(2)), (Side::Right, reactions / 2)] {
        let (leader, follower) = match side {
            Side::Left => (left, right),
            Side::Right => (right, left),
        };
        let max_dt = max_dt.min(MAX_DT);
        let mut run = Run {
            common,
            rows,
            side,
            directed: Directed::new(leader, seed, max_dt),
            random: Random::new(seed),
            follower: Simulator::new(follower),
            kept: BTreeMap::new(),
            trail: Vec::new(),
            last: None,
            is_lost: false,
        };
        run.also_try(leader, follower);
        let apart = run.run(follower, share, &mut tested);
        if apart.is_some() {
            return Tried { apart, tested };
        }
        let coverage = run.directed.coverage();
        tested.fired += coverage.fired;
        tested.transitions += leader.transitions.len();
        tested.never.extend(coverage.never.iter().map(|id| {
            let name = &leader.transitions[*id].name.text;
            format!("{name} of the {side}")
        }));
    }
    Tried { apart: None, tested }
}

struct Run<'p, 'n> {
    common: &'p Common,
    rows: &'p Rows<'p, 'n>,
    /// The net that leads.
    side: Side,
    directed: Directed<'n>,
    /// The source of values for inputs that only the follower has.
    random: Random,
    follower: Simulator<'n>,
    /// For each saved state of the leader, by its number: the follower's state and last row, and the index of the last reaction in `trail`. `None` if the
    /// follower received a row that is not legal for it.
    kept: BTreeMap<usize, Option<(State, InputRow, Option<usize>)>>,
    /// The rows of each reaction, with the index of the preceding reaction.
    trail: Vec<(Option<usize>, RowPair)>,
    last: Option<usize>,
    /// True if a row was not a legal stimulus of the follower: then nothing is compared until the next start.
    is_lost: bool,
}

impl<'n> Run<'_, 'n> {
    fn sides(&self, input: &CommonInput) -> (Option<InputId>, Option<InputId>) {
        match self.side {
            Side::Left => (input.left, input.right),
            Side::Right => (input.right, input.left),
        }
    }

    /// Makes the leader also try the input values that are relevant for the follower.
    fn also_try(&mut self, leader: &Net, follower: &Net) {
        for input in &self.common.inputs {
            let (Some(own), Some(twin)) = self.sides(input) else { continue };
            let (lo, hi) = leader.inputs[own].ty.bounds();
            if let Some(values) = cuts(follower, twin, lo, hi) {
                let around = values.iter().flat_map(|value| [value.saturating_sub(1), *value]);
                let around: Vec<i64> = around.collect();
                self.directed.also_try(own, &around);
            }
        }
    }

    fn run(
        &mut self,
        follower: &Valid<Net>,
        reactions: usize,
        tested: &mut Tested,
    ) -> Option<Vec<RowPair>> {
        let mut previous = InputRow::zero(follower);
        for _ in 0..reactions {
            let Some(Move { from, row, save }) = self.directed.next() else { continue };
            match from {
                Start::Here => {}
                Start::Reset => {
                    self.follower.reset();
                    (self.last, self.is_lost) = (None, false);
                    previous = InputRow::zero(follower);
                }
                Start::Saved(number) => match self.kept.get(&number) {
                    Some(Some((state, row, trail))) => {
                        self.follower.set_state(state);
                        previous = row.clone();
                        (self.last, self.is_lost) = (*trail, false);
                    }
                    Some(None) | None => self.is_lost = true,
                },
            }
            if !self.is_lost {
                let other = self.translate(&row, &previous);
                let pair = match self.side {
                    Side::Left => (row, other.clone()),
                    Side::Right => (other.clone(), row),
                };
                self.is_lost = self.is_outside(&pair) || self.rows.excludes(&pair);
                if !self.is_lost {
                    self.follower.step(&other);
                    self.trail.push((self.last, pair));
                    self.last = Some(self.trail.len() - 1);
                    tested.reactions += 1;
                    let (leads, follows) = (self.directed.row(), self.follower.row());
                    let (left, right) = match self.side {
                        Side::Left => (leads, follows),
                        Side::Right => (follows, leads),
                    };
                    if self.common.differs(left, right).is_some() {
                        return Some(self.path());
                    }
                    let open = &follows.open;
                    self.is_lost = open.next || open.row;
                    previous = other;
                }
            }
            if let Some(number) = save {
                let state = (!self.is_lost)
                    .then(|| (self.follower.state().clone(), previous.clone(), self.last));
                self.kept.insert(number, state);
            }
        }
        None
    }

    /// The follower's row: inputs by name. Inputs that only the follower has change occasionally.
    fn translate(&mut self, row: &InputRow, previous: &InputRow) -> InputRow {
        let mut other = InputRow { dt: row.dt, values: previous.values.clone() };
        for input in &self.common.inputs {
            match self.sides(input) {
                (Some(own), Some(twin)) => other.values[twin.index()] = row.value(own),
                (None, Some(twin)) if self.random.one_in(3) => {
                    let (lo, hi) = input.bounds;
                    other.values[twin.index()] = self.random.between(lo, hi);
                }
                (None, Some(_)) | (_, None) => {}
            }
        }
        other
    }

    /// True if the rows contain a value that is possible in only one of the nets.
    fn is_outside(&self, (left, right): &RowPair) -> bool {
        self.common.inputs.iter().any(|input| {
            let (lo, hi) = input.bounds;
            let is_out = |row: &InputRow, id: Option<InputId>| {
                id.is_some_and(|id| !(lo..=hi).contains(&row.value(id)))
            };
            is_out(left, input.left) || is_out(right, input.right)
        })
    }

    fn path(&self) -> Vec<RowPair> {
        let mut rows = Vec::new();
        let mut next = self.last;
        while let Some((before, pair)) = next.and_then(|at| self.trail.get(at)) {
            rows.push(pair.clone());
            next = *before;
        }
        rows.reverse();
        rows
    }
}
