//! Breadth-first search through all states that a net can reach, with the reference simulator: the exact answer where it can be afforded.

use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Row, Simulator, State, Stimulus};
use indexmap::IndexSet;

use crate::alphabet::{Alphabet, NoAlphabet};
use crate::limits::Limits;
use crate::relevance::Relevance;
use crate::verdict::OpenReason;

/// Which `dt` are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Ticks {
    /// Any number: what holds then holds for every engine.
    Any,
    /// 0 and 1, which is all that a chip sees (semantics §9).
    Chip,
}

/// One reaction of the search.
pub(crate) struct Seen<'a, 'n> {
    /// Number of the state before.
    pub(crate) from: usize,
    /// Number of the state after, and whether it is new.
    pub(crate) to: usize,
    pub(crate) input: &'a InputRow,
    pub(crate) row: &'a Row,
    pub(crate) simulator: &'a Simulator<'n>,
}

/// All states of a net, each with the way it was found first.
#[derive(Debug, Clone)]
pub(crate) struct States {
    pub(crate) states: IndexSet<State>,
    parents: Vec<Option<(u32, InputRow)>>,
    /// Pairs of a state and a row that were tried.
    pub(crate) pairs: u64,
}

impl States {
    /// A shortest stimulus from reset to the state.
    pub(crate) fn way_to(&self, state: usize) -> Vec<InputRow> {
        let mut rows = Vec::new();
        let mut at = state;
        while let Some(Some((from, row))) = self.parents.get(at) {
            rows.push(row.clone());
            at = *from as usize;
        }
        rows.reverse();
        rows
    }

    /// The same with one more row.
    pub(crate) fn stimulus(&self, net: &Net, state: usize, last: Option<&InputRow>) -> Stimulus {
        let mut rows = self.way_to(state);
        rows.extend(last.cloned());
        Stimulus::of_rows(net, &rows)
    }
}

/// How a search ended.
pub(crate) enum Ended<B> {
    /// Every state was seen with every input.
    Complete,
    /// The visitor had enough.
    Stopped(B),
    /// It was given up, and why.
    Open(OpenReason),
}

/// Visits every reaction from every reachable state, nearest to reset first. Inputs that cannot matter in a state keep one value.
pub(crate) fn explore<'n, B>(
    net: &'n Valid<Net>,
    limits: &Limits,
    ticks: Ticks,
    visit: &mut impl FnMut(&States, &Seen<'_, 'n>) -> Option<B>,
) -> (States, Ended<B>) {
    let mut simulator = Simulator::new(net);
    let mut found = States { states: IndexSet::new(), parents: Vec::new(), pairs: 0 };
    found.states.insert(simulator.state().clone());
    found.parents.push(None);
    let alphabet = match Alphabet::of(net, false, limits.rows_per_state) {
        Ok(alphabet) => alphabet,
        // No stimulus is legal: reset is all there is.
        Err(NoAlphabet::Contradiction) => return (found, Ended::Complete),
        Err(NoAlphabet::TooMany(why)) => return (found, Ended::Open(why)),
    };
    let relevance = Relevance::of(net);
    let mut cache: indexmap::IndexMap<crate::relevance::Inputs, Vec<InputRow>> =
        indexmap::IndexMap::new();
    let mut at = 0;
    while at < found.states.len() {
        let state = found.states[at].clone();
        let matter = relevance.inputs(state.situation());
        if !cache.contains_key(&matter) {
            let Some(rows) = alphabet.rows(&matter, limits.rows_per_state) else {
                let limit = limits.rows_per_state;
                return (found, Ended::Open(OpenReason::Rows { limit }));
            };
            cache.insert(matter.clone(), rows);
        }
        let rows = &cache[&matter];
        let dts = match (relevance.largest_dt(state.situation()), ticks) {
            (None, _) => 1..=1,
            (Some(_), Ticks::Chip) => 0..=1,
            (Some(largest), Ticks::Any) => 0..=largest,
        };
        let n_dts = u64::from(dts.end() - dts.start()) + 1;
        if found.pairs.saturating_add(n_dts.saturating_mul(rows.len() as u64)) > limits.pairs {
            let states = found.states.len();
            return (found, Ended::Open(OpenReason::Pairs { limit: limits.pairs, states }));
        }
        for row in rows {
            for dt in dts.clone() {
                let mut row = row.clone();
                row.dt = dt;
                found.pairs += 1;
                simulator.set_state(&state);
                simulator.step(&row);
                let to = match found.states.get_index_of(simulator.state()) {
                    Some(index) => index,
                    None => {
                        if found.states.len() >= limits.states {
                            let limit = limits.states;
                            return (found, Ended::Open(OpenReason::States { limit }));
                        }
                        found.parents.push(Some((at as u32, row.clone())));
                        found.states.insert_full(simulator.state().clone()).0
                    }
                };
                let seen =
                    Seen { from: at, to, input: &row, row: simulator.row(), simulator: &simulator };
                if let Some(answer) = visit(&found, &seen) {
                    return (found, Ended::Stopped(answer));
                }
            }
        }
        at += 1;
    }
    (found, Ended::Complete)
}
