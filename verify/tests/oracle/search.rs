//! All reachable behaviour of a small chart, reaction by reaction.

use super::chart::{Chart, Policy};
use super::run::{Runner, Seen, State};
use indexmap::IndexMap;
use std::collections::BTreeSet;

/// The results.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Everything {
    /// Situations after reactions, as sets of steps.
    pub(crate) situations: BTreeSet<Vec<usize>>,
    /// Steps that are ever active, even if only between micro-steps.
    pub(crate) touched: BTreeSet<usize>,
    /// Transitions that ever fire.
    pub(crate) fired: BTreeSet<usize>,
    /// For each property the minimum number of reactions that violates it.
    pub(crate) broken: Vec<Option<usize>>,
    /// The largest number of micro-steps of a reaction.
    pub(crate) depth: usize,
    /// True if some reaction does not become stable within the limit.
    pub(crate) fault: bool,
    /// Pairs that fire in one micro-step and share a preceding step; the lower number first.
    pub(crate) together: BTreeSet<(usize, usize)>,
    /// Winner and loser, where the policy decides.
    pub(crate) contests: BTreeSet<(usize, usize)>,
    /// The situations of states after which nothing ever fires again, although a transition leaves one of their steps.
    pub(crate) dead: BTreeSet<Vec<usize>>,
}

/// A state in which time has passed.
#[derive(Debug)]
struct Latched {
    /// The index of the same state one tick later; `None` if it does not change.
    later: Option<usize>,
    /// The states after its reactions.
    after: Vec<usize>,
    /// True if one of its reactions fires something.
    fires: bool,
}

/// Tries every row with every `dt` from every state; `None` if there are more than `most` states.
pub(crate) fn everything(chart: &Chart, most: usize) -> Option<Everything> {
    let runner = Runner::new(chart);
    let rows = runner.rows();
    let mut found = Everything { broken: vec![None; chart.asserts.len()], ..Everything::default() };
    let reset = runner.reset();
    found.see_state(&reset);
    let zero = vec![0; chart.inputs.len()];
    for (guard, broken) in chart.asserts.iter().zip(&mut found.broken) {
        *broken = runner.holds_after(guard, &reset, &zero).then_some(0);
    }
    let mut states: IndexMap<State, usize> = IndexMap::from([(reset, 0)]);
    let mut latched: IndexMap<State, Latched> = IndexMap::new();
    // For each state, the index of the same state before any time passes.
    let mut first = Vec::new();
    while let Some((state, depth)) = states.get_index(first.len()) {
        let (state, depth) = (state.clone(), *depth);
        let mut before: Option<usize> = None;
        for dt in 0..=runner.longest.unwrap_or(0) {
            let now = runner.latch(&state, dt);
            let known = latched.get_index_of(&now);
            let number = known.unwrap_or(latched.len());
            match before {
                None => first.push(number),
                Some(before) if before == number => break,
                Some(before) => latched[before].later = Some(number),
            }
            if known.is_some() {
                // The states one tick later were already handled together with that state.
                break;
            }
            let mut here = Latched { later: None, after: Vec::new(), fires: false };
            for row in &rows {
                let (next, seen) = runner.react(&now, row);
                here.fires |= !seen.fired.is_empty();
                found.see(chart, &runner, &next, row, &seen, depth + 1);
                let entry = states.entry(next);
                here.after.push(entry.index());
                entry.or_insert(depth + 1);
            }
            latched.insert(now, here);
            before = Some(number);
        }
        if states.len() + latched.len() > most {
            return None;
        }
    }
    found.dead = dead(chart, &states, &first, latched.values().collect());
    Some(found)
}

fn active(state: &State) -> Vec<usize> {
    (0..state.active.len()).filter(|step| state.active[*step]).collect()
}

impl Everything {
    fn see_state(&mut self, state: &State) {
        let situation = active(state);
        self.touched.extend(&situation);
        self.situations.insert(situation);
    }

    fn see(
        &mut self,
        chart: &Chart,
        runner: &Runner<'_>,
        next: &State,
        row: &[i64],
        seen: &Seen,
        depth: usize,
    ) {
        self.see_state(next);
        self.fault |= seen.fault;
        self.depth = self.depth.max(seen.fired.len());
        for (guard, broken) in chart.asserts.iter().zip(&mut self.broken) {
            if broken.is_none() && runner.holds_after(guard, next, row) {
                *broken = Some(depth);
            }
        }
        self.contests.extend(&seen.contests);
        for fired in &seen.fired {
            for (at, one) in fired.iter().enumerate() {
                self.fired.insert(*one);
                self.touched.extend(&chart.moves[*one].to);
                for other in fired[..at].iter().filter(|_| chart.policy == Policy::All) {
                    let from = &chart.moves[*other].from;
                    if chart.moves[*one].from.iter().any(|step| from.contains(step)) {
                        self.together.insert((*one.min(other), *one.max(other)));
                    }
                }
            }
        }
    }
}

/// The situations of states after which nothing ever fires again, although a transition leaves one of their steps.
fn dead(
    chart: &Chart,
    states: &IndexMap<State, usize>,
    first: &[usize],
    latched: Vec<&Latched>,
) -> BTreeSet<Vec<usize>> {
    let mut before_state: Vec<Vec<usize>> = vec![Vec::new(); first.len()];
    let mut before_latched: Vec<Vec<usize>> = vec![Vec::new(); latched.len()];
    let mut states_at: Vec<Vec<usize>> = vec![Vec::new(); latched.len()];
    for (number, one) in latched.iter().enumerate() {
        one.after.iter().for_each(|state| before_state[*state].push(number));
        one.later.iter().for_each(|later| before_latched[*later].push(number));
    }
    first.iter().enumerate().for_each(|(state, number)| states_at[*number].push(state));
    let mut lives: Vec<bool> = latched.iter().map(|one| one.fires).collect();
    let mut todo: Vec<usize> = (0..latched.len()).filter(|at| lives[*at]).collect();
    while let Some(number) = todo.pop() {
        let by_reaction = states_at[number].iter().flat_map(|state| &before_state[*state]);
        for earlier in by_reaction.chain(&before_latched[number]) {
            if !std::mem::replace(&mut lives[*earlier], true) {
                todo.push(*earlier);
            }
        }
    }
    let can_leave = |situation: &Vec<usize>| {
        chart.moves.iter().any(|it| it.from.iter().any(|step| situation.contains(step)))
    };
    states
        .keys()
        .zip(first)
        .filter(|(_, number)| !lives[**number])
        .map(|(state, _)| active(state))
        .filter(can_leave)
        .collect()
}
