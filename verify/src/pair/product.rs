//! The product of two nets, searched breadth-first from reset with two reference simulators: exact, and a difference comes with a shortest stimulus.

use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Simulator, State};
use indexmap::IndexSet;

use super::common::Common;
use super::rows::{RowPair, Rows};
use crate::verdict::OpenReason;

/// The limits of a search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    /// The maximum number of reactions of both nets.
    pub(super) reactions: u64,
    /// The maximum number of pairs of states.
    pub(super) states: usize,
    /// The maximum length of a stimulus in rows.
    pub(super) rows: usize,
}

/// The result of a search.
#[derive(Debug)]
pub(super) enum Found {
    /// Every reachable pair of states was visited with every row.
    Complete {
        /// The number of pairs of states.
        states: u64,
        /// The number of reactions compared.
        reactions: u64,
    },
    /// The last of these rows shows a difference, and no shorter stimulus does.
    Apart(Vec<RowPair>),
    /// No stimulus of at most [`Budget::rows`] rows shows a difference.
    Deep,
    /// The search was abandoned.
    Open(OpenReason),
}

pub(super) fn search(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    rows: &mut Rows<'_, '_>,
    budget: Budget,
) -> Found {
    let (mut ours, mut theirs) = (Simulator::new(left), Simulator::new(right));
    if common.differs(ours.row(), theirs.row()).is_some() {
        return Found::Apart(Vec::new());
    }
    let is_open = |simulator: &Simulator<'_>| {
        let open = &simulator.row().open;
        open.next || open.row
    };
    let mut states: IndexSet<(State, State)> = IndexSet::new();
    let mut parents: Vec<Option<(u32, RowPair)>> = vec![None];
    states.insert((ours.state().clone(), theirs.state().clone()));
    let way = |parents: &[Option<(u32, RowPair)>], from: usize, last: RowPair| {
        let mut rows = vec![last];
        let mut at = from;
        while let Some(Some((before, row))) = parents.get(at) {
            rows.push(row.clone());
            at = *before as usize;
        }
        rows.reverse();
        rows
    };
    let mut reactions: u64 = 0;
    // States before `level_end` are at most `n_rows` rows away from reset.
    let (mut level_end, mut n_rows) = (1, 0);
    let mut at = 0;
    while at < states.len() {
        if at == level_end {
            (level_end, n_rows) = (states.len(), n_rows + 1);
        }
        if n_rows >= budget.rows {
            return Found::Deep;
        }
        let Some((left_state, right_state)) = states.get_index(at).cloned() else { break };
        let largest = rows.largest_dt(&left_state, &right_state);
        let tried = match rows.of_states(&left_state, &right_state) {
            Ok(tried) => tried,
            Err(why) => return Found::Open(why),
        };
        let dts = largest.map_or(1..=1, |largest| 0..=largest);
        let n_dts = u64::from(dts.end() - dts.start()) + 1;
        if reactions.saturating_add(n_dts.saturating_mul(tried.len() as u64)) > budget.reactions {
            let (limit, states) = (budget.reactions, states.len());
            return Found::Open(OpenReason::Pairs { limit, states });
        }
        for (left_row, right_row) in tried {
            for dt in dts.clone() {
                let with_dt = |row: &InputRow| InputRow { dt, values: row.values.clone() };
                reactions += 1;
                ours.set_state(&left_state);
                theirs.set_state(&right_state);
                let (a, b) = (with_dt(left_row), with_dt(right_row));
                ours.step(&a);
                theirs.step(&b);
                if common.differs(ours.row(), theirs.row()).is_some() {
                    return Found::Apart(way(&parents, at, (a, b)));
                }
                // Everything that follows an open situation is open.
                if is_open(&ours) || is_open(&theirs) {
                    continue;
                }
                let next = (ours.state().clone(), theirs.state().clone());
                if states.insert(next) {
                    parents.push(Some((at as u32, (a, b))));
                    if states.len() > budget.states {
                        return Found::Open(OpenReason::States { limit: budget.states });
                    }
                }
            }
        }
        at += 1;
    }
    Found::Complete { states: states.len() as u64, reactions }
}
