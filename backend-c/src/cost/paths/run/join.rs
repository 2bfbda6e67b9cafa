//! Merges equal states and, if there are too many, also states that agree on a few cells.

use super::super::values::Values;
use super::{Done, Run, State, Step, Stopped};
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// The maximum number of states in the middle of a condition before states that are not equal are merged too.
const ASKED: usize = 32;

/// The number of copied or compared cells that counts as the work of one statement.
const CELLS_OF_WORK: u64 = 32;

impl Run<'_> {
    /// Accounts for executing or creating this many states of this many cells.
    pub(super) fn spend(&mut self, states: usize, cells: usize) -> Done<()> {
        let each = 1 + cells as u64 / CELLS_OF_WORK;
        let spent = each.saturating_mul(states as u64);
        self.work = self.work.checked_sub(spent).ok_or(Stopped::TooMuch)?;
        Ok(())
    }

    /// Accounts for comparing this many states with each other.
    fn spend_on_joining(&mut self, states: usize, first: Option<&State>) -> Done<()> {
        let each = states.checked_ilog2().unwrap_or(0) as usize;
        self.spend(states, first.map_or(0, |it| it.memory.len() * (1 + each)))
    }

    /// Merges equal states in the middle of a condition: each of its parts can double them.
    pub(super) fn same(&mut self, states: &mut Vec<State>) -> Done<()> {
        if states.len() < 3 {
            return Ok(());
        }
        self.spend_on_joining(states.len(), states.first())?;
        let mut all = Different::default();
        std::mem::take(states).into_iter().for_each(|it| all.add(it, Values::one(0)));
        states.extend(all.into_states().map(|(state, _)| state));
        if states.len() > ASKED {
            let found = std::mem::take(states);
            *states = self.few(found)?;
        }
        Ok(())
    }

    /// Reduces the states to the permitted number.
    pub(super) fn few(&mut self, states: Vec<State>) -> Done<Vec<State>> {
        let all = states.into_iter().map(|it| (it, Values::one(0))).collect();
        Ok(self.few_of(all)?.into_iter().map(|(state, _)| state).collect())
    }

    pub(super) fn few_of(&mut self, states: Vec<(State, Values)>) -> Done<Vec<(State, Values)>> {
        if states.len() < 2 {
            return Ok(states);
        }
        self.spend_on_joining(states.len(), states.first().map(|(state, _)| state))?;
        let mut all = Different::default();
        states.into_iter().for_each(|(state, value)| all.add(state, value));
        let Some(keys) = &self.keys else {
            if all.by_memory.len() > self.most_states {
                return Err(Stopped::TooMuch);
            }
            return Ok(all.into_states().collect());
        };
        let cells_of = |memory: &[Values], n: usize| -> Vec<Option<i64>> {
            keys.iter().take(n).map(|cell| memory.get(*cell).and_then(|it| it.only())).collect()
        };
        let apart: BTreeSet<Vec<Option<i64>>> =
            all.by_memory.keys().map(|(_, memory)| cells_of(memory, keys.len())).gather();
        let n = if apart.len() <= self.most_states { keys.len() } else { 0 };
        // If that is not few enough, all states are merged; but then the number of rounds of a loop is unknown.
        if n == 0 && self.depth > 0 && !keys.is_empty() {
            return Err(Stopped::TooMuch);
        }
        let mut groups: BTreeMap<Vec<Option<i64>>, (State, Values)> = BTreeMap::new();
        for (state, value) in all.into_states() {
            let key = cells_of(&state.memory, n);
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

/// A state combined with the result of a partial run that started with zero cost.
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

/// The union of two states, at the cost of the more expensive one.
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

/// A set of states, each with a value: states with equal cells and equal values are merged.
#[derive(Default)]
pub(super) struct Different {
    by_memory: BTreeMap<(Values, Vec<Values>), State>,
}

impl Different {
    pub(super) fn add(&mut self, mut state: State, value: Values) {
        let memory = std::mem::take(&mut state.memory);
        match self.by_memory.entry((value, memory)) {
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

    pub(super) fn into_states(self) -> impl Iterator<Item = (State, Values)> {
        self.by_memory
            .into_iter()
            .map(|((value, memory), state)| (State { memory, ..state }, value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::paths::code::Price;

    /// The work limit includes joining states, not only executing statements.
    #[test]
    fn joining_takes_of_the_work() {
        let states = || -> Vec<State> {
            let state =
                |n| State { memory: vec![Values::one(n); 64], price: Price::default(), way: None };
            (0..100).map(state).collect()
        };
        let run = |work| Run {
            routines: &[],
            int_bits: 16,
            work,
            most_states: 200,
            keys: None,
            is_traced: false,
            line: 0,
            frame: 0,
            size: 0,
            depth: 0,
        };
        let mut enough = run(1_000_000);
        assert_eq!(enough.few(states()).map(|it| it.len()), Ok(100));
        let taken = 1_000_000 - enough.work;
        assert!(taken > 1000, "{taken}");
        assert_eq!(run(taken - 1).few(states()).map(|it| it.len()), Err(Stopped::TooMuch));
    }
}
