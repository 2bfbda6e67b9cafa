//! States that know the same become one, and where there are too many of them, those that agree on a few cells.

use super::super::values::Values;
use super::{Done, Run, State, Step, Stopped};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// States within a condition that are still told apart by all that is known of them.
const ASKED: usize = 32;

impl Run<'_> {
    /// Those that know the same become one, in the midst of a condition: each of its parts can double them.
    pub(super) fn same(&self, states: &mut Vec<State>) -> Done<()> {
        if states.len() < 3 {
            return Ok(());
        }
        let mut all: BTreeMap<Vec<Values>, State> = BTreeMap::new();
        for mut state in std::mem::take(states) {
            let key = std::mem::take(&mut state.memory);
            merge(&mut all, key, state);
        }
        states.extend(all.into_iter().map(|(memory, state)| State { memory, ..state }));
        if states.len() > ASKED {
            let found = std::mem::take(states);
            *states = self.few(found)?;
        }
        Ok(())
    }

    /// As many states as are allowed.
    pub(super) fn few(&self, states: Vec<State>) -> Done<Vec<State>> {
        let all = states.into_iter().map(|it| (it, Values::one(0))).collect();
        Ok(self.few_of(all)?.into_iter().map(|(state, _)| state).collect())
    }

    pub(super) fn few_of(&self, states: Vec<(State, Values)>) -> Done<Vec<(State, Values)>> {
        if states.len() < 2 {
            return Ok(states);
        }
        let mut all: BTreeMap<(Values, Vec<Values>), State> = BTreeMap::new();
        for (mut state, value) in states {
            let key = (value, std::mem::take(&mut state.memory));
            merge(&mut all, key, state);
        }
        let Some(keys) = &self.keys else {
            if all.len() > self.most_states {
                return Err(Stopped::TooMuch);
            }
            return Ok(all
                .into_iter()
                .map(|((value, memory), state)| (State { memory, ..state }, value))
                .collect());
        };
        let cells_of = |memory: &[Values], n: usize| -> Vec<Option<i64>> {
            keys.iter().take(n).map(|cell| memory.get(*cell).and_then(|it| it.only())).collect()
        };
        let apart: BTreeSet<Vec<Option<i64>>> =
            all.keys().map(|(_, memory)| cells_of(memory, keys.len())).collect();
        let n = if apart.len() <= self.most_states { keys.len() } else { 0 };
        // Where that is not few enough all become one; but then nobody knows how often a loop goes.
        if n == 0 && self.depth > 0 && !keys.is_empty() {
            return Err(Stopped::TooMuch);
        }
        let mut groups: BTreeMap<Vec<Option<i64>>, (State, Values)> = BTreeMap::new();
        for ((value, memory), state) in all {
            let key = cells_of(&memory, n);
            let state = State { memory, ..state };
            match groups.entry(key) {
                std::collections::btree_map::Entry::Vacant(place) => {
                    place.insert((state, value));
                }
                std::collections::btree_map::Entry::Occupied(mut place) => {
                    let (known, values) = place.get_mut();
                    join(known, state);
                    *values = values.or(value);
                }
            }
        }
        Ok(groups.into_values().collect())
    }
}

/// A state with what a piece of a run made of it, which began without a price.
pub(super) fn behind(state: &State, end: &State) -> State {
    let mut way = state.way.clone();
    let mut steps = Vec::new();
    let mut next = &end.way;
    while let Some(step) = next {
        steps.push((step.line, step.time));
        next = &step.before;
    }
    for (line, time) in steps.into_iter().rev() {
        way = Some(Rc::new(Step { line, time, before: way }));
    }
    State { memory: end.memory.clone(), price: state.price.plus(end.price), way }
}

/// What holds in one of two states, at the price of the dearer.
pub(super) fn either(mut a: State, b: State) -> State {
    join(&mut a, b);
    a
}

fn join(known: &mut State, other: State) {
    for (mine, theirs) in known.memory.iter_mut().zip(&other.memory) {
        *mine = mine.or(*theirs);
    }
    if other.price.time > known.price.time {
        known.way = other.way;
    }
    known.price = known.price.or(other.price);
}

pub(super) fn merge<K: Ord>(all: &mut BTreeMap<K, State>, key: K, state: State) {
    match all.entry(key) {
        std::collections::btree_map::Entry::Vacant(place) => {
            place.insert(state);
        }
        std::collections::btree_map::Entry::Occupied(mut place) => {
            let old = place.get_mut();
            if state.price.time > old.price.time {
                old.way = state.way;
            }
            old.price = old.price.or(state.price);
        }
    }
}
