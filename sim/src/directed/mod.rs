//! Directed random runs: short, often restarted, and aimed at transitions that have not fired yet.
//!
//! One long random run may reach a situation that it cannot leave, and then sees nothing new. [`Directed`] instead makes many short runs, from reset or
//! from a state of an earlier run, and returns one reaction at a time; to compare an output with the net, execute the same reaction with that output:
//!
//! ```text
//! let mut directed = Directed::new(&net, seed, MAX_DT);
//! while let Some(Move { from, row, save }) = directed.next() {
//!     match from { Start::Here => {}, Start::Reset => mine.reset(), Start::Saved(n) => mine.set(&kept[n]) }
//!     let answer = mine.react(&row);
//!     if answer differs from directed.row() { return Err(directed.path()) }   // a stimulus from reset on
//!     if let Some(n) = save { kept[n] = mine.state() }
//! }
//! ```
//!
//! A run aims at a transition: towards its steps on the shortest path in the chart, then with inputs and ticks that make its receptivity true (`solve`).
//! It saves states that are new, or nearer to a transition that has never fired than all earlier ones.
#![allow(clippy::wildcard_enum_match_arm, reason = "it only chooses stimuli")]

pub(crate) mod ahead;
mod distance;
mod solve;
pub(crate) mod ticks;

use std::collections::BTreeMap;

use grafsynth_ir::Valid;
use grafsynth_ir::net::{Enter, HistoryId, Net, StepId, TransitionId};

use crate::row::{InputRow, Row};
use crate::rows::{Manner, Rows};
use crate::simulator::Simulator;
use crate::situation::Situation;
use crate::state::State;
use crate::stimulus::{MAX_DT, breaks_assumption};
use distance::{Context, Given};
use ticks::Thresholds;

/// The maximum number of states saved for new situations; those that lead to transitions are saved in addition.
const MAX_SITUATIONS: usize = 256;
/// The maximum number of transitions for which states are saved.
const MAX_WANTED: usize = 256;
/// The minimum length of a run, and the range of the random addition, in reactions.
const RUN: (usize, usize) = (6, 40);
/// The number of attempts to find a row that satisfies the chart's assumptions.
const MAX_TRIES: usize = 64;

/// The start of a reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// The state after the last reaction.
    Here,
    /// After a reset.
    Reset,
    /// The state that was saved under this number.
    Saved(usize),
}

/// One reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Move {
    /// The state in which the reaction starts.
    pub from: Start,
    /// The inputs of the reaction. They satisfy the chart's assumptions.
    pub row: InputRow,
    /// The number under which the caller must save the state after the reaction, if any. Numbers count up from 0; a repeated number replaces the earlier state.
    pub save: Option<usize>,
}

/// The part of a net that was exercised.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Coverage {
    /// The number of reactions executed.
    pub reactions: u64,
    /// Transitions and reactions of steps that fired at least once.
    pub fired: usize,
    /// Transitions and reactions of steps that never fired, in declaration order.
    pub never: Vec<TransitionId>,
    /// True if fewer reactions were executed than requested, because the limit of micro-steps ([`MICRO_STEPS`](crate::MICRO_STEPS)) was reached.
    pub is_cut_short: bool,
}

/// A state from which runs can continue.
struct Saved {
    state: State,
    /// The index of the last reaction on the path to the state; `None` for the state after reset.
    trail: Option<usize>,
    visits: u32,
    /// The number of reasons to keep the state: its situation, and transitions that it is near to. A state without reasons may be replaced.
    owners: usize,
}

/// The distance of a state from firing a transition: the length of the path to its steps, then the distance of its receptivity. Smaller is nearer.
type Nearness = (u64, u64);

/// The distance of the active steps from a step that a transition requires.
struct Distance {
    to: StepId,
    /// The number of transitions from the nearest active step to this one; [`UNREACHED`] if there is no path.
    least: u64,
    /// The active steps at this distance.
    nearest: Vec<StepId>,
}

/// The aim of a run.
#[derive(Debug, Clone, Copy)]
enum Aim {
    /// Any inputs, generated in this manner.
    Any(Manner),
    /// A reaction in which this transition fires.
    Fire(TransitionId),
}

/// Generates reactions of a net; see the module documentation.
pub struct Directed<'n> {
    net: &'n Net,
    simulator: Simulator<'n>,
    rows: Rows<'n>,
    max_dt: u32,
    thresholds: Thresholds,
    /// For each step, the transitions that require it.
    leaving: Vec<Vec<TransitionId>>,
    /// For each step, the steps that the transitions into it require.
    before: Vec<Vec<StepId>>,
    /// For each target step, the distance from each step, in transitions.
    ways: BTreeMap<StepId, Vec<u32>>,
    times_fired: Vec<u64>,
    reactions: u64,
    /// The inputs of each reaction, with the index of the preceding reaction.
    trail: Vec<(Option<usize>, InputRow)>,
    last: Option<usize>,
    saved: Vec<Saved>,
    situations: BTreeMap<Situation, usize>,
    nearest: BTreeMap<TransitionId, (Nearness, usize)>,
    left_in_run: usize,
    aim: Aim,
}

impl<'n> Directed<'n> {
    /// Generates reactions with `dt` in `0..=max_dt` (use 1 for an output that runs one reaction per clock); the same for the same seed.
    #[must_use]
    pub fn new(net: &'n Valid<Net>, seed: u64, max_dt: u32) -> Self {
        let net: &'n Net = net;
        let mut leaving = vec![Vec::new(); net.steps.len()];
        let mut before = vec![Vec::new(); net.steps.len()];
        for (id, transition) in net.transitions.iter() {
            for step in &transition.requires {
                leaving[step.index()].push(id);
            }
            for entered in entered(net, &transition.enters) {
                before[entered.index()].extend(&transition.requires);
            }
        }
        Directed {
            net,
            simulator: Simulator::of_net(net),
            rows: Rows::new(net, seed),
            max_dt: max_dt.min(MAX_DT),
            thresholds: Thresholds::of(net),
            leaving,
            before,
            ways: BTreeMap::new(),
            times_fired: vec![0; net.transitions.len()],
            reactions: 0,
            trail: Vec::new(),
            last: None,
            saved: Vec::new(),
            situations: BTreeMap::new(),
            nearest: BTreeMap::new(),
            left_in_run: 0,
            aim: Aim::Any(Manner::Noise),
        }
    }

    /// Adds values of an input that matter to something other than the net, such as a chart that is compared with it.
    pub fn also_try(&mut self, input: grafsynth_ir::net::InputId, values: &[i64]) {
        let (lo, hi) = self.net.inputs[input].ty.bounds();
        let known = &mut self.rows.interesting[input.index()];
        known.extend(values.iter().filter(|value| (lo..=hi).contains(value)));
        known.sort_unstable();
        known.dedup();
    }

    /// The next reaction, which the net has already executed on return. `None` only if no inputs are found that satisfy the chart's assumptions.
    #[expect(
        clippy::should_implement_trait,
        reason = "an iterator would not give access to the row in between"
    )]
    pub fn next(&mut self) -> Option<Move> {
        let from = if self.left_in_run == 0 { self.begin_run() } else { Start::Here };
        self.left_in_run = self.left_in_run.saturating_sub(1);
        let row = match self.lawful() {
            Some(row) => row,
            None => {
                // Held inputs may violate an assumption only after reset.
                self.left_in_run = 0;
                return None;
            }
        };
        self.simulator.step(&row);
        self.reactions += 1;
        self.trail.push((self.last, row.clone()));
        self.last = Some(self.trail.len() - 1);
        let mut is_first = false;
        for transition in self.simulator.fired() {
            let count = &mut self.times_fired[transition.index()];
            is_first |= *count == 0;
            *count += 1;
        }
        self.rows.last.clone_from(&row);
        if let Aim::Fire(wanted) = self.aim
            && self.simulator.fired().contains(&wanted)
        {
            // The transition has fired: continue at random for a while, because what follows is also new.
            self.aim = Aim::Any(Manner::Held);
            self.left_in_run = self.left_in_run.min(4);
        }
        let open = &self.simulator.row().open;
        let save = if open.next || open.row {
            self.left_in_run = 0;
            None
        } else {
            self.keep(is_first)
        };
        Some(Move { from, row, save })
    }

    /// The net's row for the last reaction.
    #[must_use]
    pub fn row(&self) -> &Row {
        self.simulator.row()
    }

    /// The net's own state after the last reaction.
    #[must_use]
    pub fn simulator(&self) -> &Simulator<'n> {
        &self.simulator
    }

    /// The rows from reset to the last reaction.
    #[must_use]
    pub fn path(&self) -> Vec<InputRow> {
        let mut rows = Vec::new();
        let mut next = self.last;
        while let Some((before, row)) = next.and_then(|at| self.trail.get(at)) {
            rows.push(row.clone());
            next = *before;
        }
        rows.reverse();
        rows
    }

    /// The coverage so far.
    #[must_use]
    pub fn coverage(&self) -> Coverage {
        let never: Vec<TransitionId> = self
            .net
            .transitions
            .ids()
            .filter(|transition| self.times_fired[transition.index()] == 0)
            .collect();
        Coverage {
            reactions: self.reactions,
            fired: self.net.transitions.len() - never.len(),
            never,
            is_cut_short: false,
        }
    }

    // --- runs ------------------------------------------------------------------------------------------------------------------------------

    /// Chooses an aim and a start.
    fn begin_run(&mut self) -> Start {
        let (least, beyond) = RUN;
        self.left_in_run = least + self.rows.random.below(beyond);
        let wanted = self.wanted();
        self.aim = match (self.rows.random.below(8), wanted) {
            (0, _) | (1..=3, None) => Aim::Any(Manner::Noise),
            (1, _) | (4..=5, None) => Aim::Any(Manner::Held),
            (2, _) | (_, None) => Aim::Any(Manner::Pulses),
            (_, Some(transition)) => Aim::Fire(transition),
        };
        let near = match self.aim {
            Aim::Fire(transition) => self.nearest.get(&transition).map(|(_, number)| *number),
            Aim::Any(_) => None,
        };
        let number = match self.rows.random.below(4) {
            0 => None,
            1 | 2 if near.is_some() => near,
            _ => self.seldom_visited(),
        };
        match number {
            Some(number) if self.reactions > 0 => {
                let saved = &mut self.saved[number];
                saved.visits += 1;
                self.last = saved.trail;
                self.simulator.set_state(&saved.state);
                Start::Saved(number)
            }
            Some(_) | None => {
                self.last = None;
                self.simulator.reset();
                self.rows.last = InputRow::zero(self.net);
                Start::Reset
            }
        }
    }

    /// A transition that has never fired; if all have fired, one that has fired least often.
    fn wanted(&mut self) -> Option<TransitionId> {
        let never: Vec<TransitionId> = self
            .net
            .transitions
            .ids()
            .filter(|transition| self.times_fired[transition.index()] == 0)
            .collect();
        // Some of them can never fire, so only part of the runs aim at them.
        if !never.is_empty() && self.rows.random.below(4) != 0 {
            // The nearer of two.
            let (a, b) = (self.rows.random.pick(&never), self.rows.random.pick(&never));
            return a.into_iter().chain(b).min_by_key(|it| self.nearness_known(**it)).copied();
        }
        let n = self.net.transitions.len();
        let some: Vec<usize> = (0..3).map(|_| self.rows.random.below(n)).collect();
        (n > 0)
            .then(|| some.into_iter().min_by_key(|at| self.times_fired[*at]))
            .flatten()
            .map(TransitionId::from_index)
    }

    fn nearness_known(&self, transition: TransitionId) -> Nearness {
        self.nearest.get(&transition).map_or((u64::MAX, u64::MAX), |(nearness, _)| *nearness)
    }

    fn seldom_visited(&mut self) -> Option<usize> {
        let n = self.saved.len();
        let some: Vec<usize> = (0..3).map(|_| self.rows.random.below(n)).collect();
        some.into_iter()
            .filter(|at| self.saved.get(*at).is_some_and(|saved| saved.owners > 0))
            .min_by_key(|at| self.saved[*at].visits)
    }

    /// Saves the current state if it is useful, and returns its number.
    fn keep(&mut self, is_first: bool) -> Option<usize> {
        let is_wanted = self.is_new_situation(is_first);
        let never: Vec<TransitionId> = self
            .net
            .transitions
            .ids()
            .filter(|transition| self.times_fired[transition.index()] == 0)
            .take(MAX_WANTED)
            .collect();
        let mut near = Vec::new();
        for transition in never {
            let nearness = self.nearness(transition);
            let known = self.nearest.get(&transition).copied();
            let is_nearer = known.is_none_or(|(best, _)| nearness < best);
            let is_as_near = known.is_some_and(|(best, _)| nearness == best);
            if is_nearer || is_as_near && self.rows.random.one_in(32) {
                near.push((transition, nearness));
            }
        }
        if !is_wanted && near.is_empty() {
            return None;
        }
        let number = self.saved.iter().position(|saved| saved.owners == 0);
        let number = number.unwrap_or(self.saved.len());
        let state = self.simulator.state().clone();
        let owners = near.len() + usize::from(is_wanted);
        if is_wanted {
            let before = self.situations.insert(state.situation().clone(), number);
            self.give_up(before);
        }
        for (transition, nearness) in near {
            let before = self.nearest.insert(transition, (nearness, number));
            self.give_up(before.map(|(_, number)| number));
        }
        let saved = Saved { state, trail: self.last, visits: 0, owners };
        match self.saved.get_mut(number) {
            Some(place) => *place = saved,
            None => self.saved.push(saved),
        }
        Some(number)
    }

    fn give_up(&mut self, number: Option<usize>) {
        if let Some(saved) = number.and_then(|number| self.saved.get_mut(number)) {
            saved.owners -= 1;
        }
    }

    /// True if the current state should be saved for its situation. This is so if there is no such state yet; occasionally, a state replaces another one,
    /// because its variables and times may differ.
    fn is_new_situation(&mut self, is_first: bool) -> bool {
        if self.situations.contains_key(self.simulator.state().situation()) {
            return is_first || self.rows.random.one_in(16);
        }
        if self.situations.len() >= MAX_SITUATIONS {
            if !self.rows.random.one_in(4) {
                return false;
            }
            let at = self.rows.random.below(self.situations.len());
            let other = self.situations.keys().nth(at).cloned();
            let before = other.and_then(|situation| self.situations.remove(&situation));
            self.give_up(before);
        }
        true
    }

    /// The distance of the current state from firing a transition.
    fn nearness(&mut self, transition: TransitionId) -> Nearness {
        let level = self.level(transition);
        let lack = if level == 0 {
            let given = Given::Any { free_dt: self.max_dt > 1 };
            Context::of(&self.simulator, given).to_fire(transition)
        } else {
            0
        };
        (level, lack)
    }

    /// The number of transitions between the active steps and the steps that this transition requires.
    fn level(&mut self, transition: TransitionId) -> u64 {
        let net = self.net;
        let least = |step: &StepId| {
            self.know_ways(*step);
            let way = &self.ways[step];
            let active = self.simulator.state().situation();
            let nearest = active.iter().map(|step| way[step.index()]).min();
            u64::from(nearest.unwrap_or(UNREACHED))
        };
        net.transitions[transition].requires.iter().map(least).sum()
    }

    /// Computes the distances to a step if they are not known yet.
    fn know_ways(&mut self, to: StepId) {
        if !self.ways.contains_key(&to) {
            let way = self.way(to);
            self.ways.insert(to, way);
        }
    }

    /// For each step that a transition requires, the distance of the active steps from it.
    fn distances(&mut self, transition: TransitionId) -> Vec<Distance> {
        let requires = &self.net.transitions[transition].requires;
        let mut distances = Vec::with_capacity(requires.len());
        for step in requires {
            self.know_ways(*step);
            let way = &self.ways[step];
            let mut distance =
                Distance { to: *step, least: u64::from(UNREACHED), nearest: Vec::new() };
            for active in self.simulator.state().situation().iter() {
                let of = u64::from(way[active.index()]);
                if of < distance.least {
                    distance.least = of;
                    distance.nearest.clear();
                }
                if of == distance.least {
                    distance.nearest.push(active);
                }
            }
            distances.push(distance);
        }
        distances
    }

    /// The value of [`Directed::level`] after `moved` fired. The other active steps count only if `moved` clears all the nearest ones.
    fn level_after(&self, distances: &[Distance], moved: TransitionId) -> u64 {
        let data = &self.net.transitions[moved];
        let entered = entered(self.net, &data.enters);
        let of_one = |distance: &Distance| {
            let way = &self.ways[&distance.to];
            let of = |step: StepId| u64::from(way[step.index()]);
            let stays = |step: &StepId| !data.clears.contains(step);
            let staying = if distance.nearest.iter().any(stays) {
                distance.least
            } else {
                let active = self.simulator.state().situation();
                active.iter().filter(stays).map(of).min().unwrap_or(u64::from(UNREACHED))
            };
            entered.iter().map(|step| of(*step)).fold(staying, u64::min)
        };
        distances.iter().map(of_one).sum()
    }

    /// The distance from each step to this one, in transitions.
    fn way(&self, to: StepId) -> Vec<u32> {
        let mut way = vec![UNREACHED; self.net.steps.len()];
        way[to.index()] = 0;
        let mut todo = std::collections::VecDeque::from([to]);
        while let Some(step) = todo.pop_front() {
            for before in &self.before[step.index()] {
                if way[before.index()] == UNREACHED {
                    way[before.index()] = way[step.index()] + 1;
                    todo.push_back(*before);
                }
            }
        }
        way
    }

    // --- rows ------------------------------------------------------------------------------------------------------------------------------

    /// A row that satisfies the assumptions, if one is found.
    fn lawful(&mut self) -> Option<InputRow> {
        if let Aim::Fire(wanted) = self.aim
            && let Some(next) = self.toward(wanted)
        {
            let row = self.solve(next);
            if !breaks_assumption(self.net, &row) {
                return Some(row);
            }
        }
        let manner = match self.aim {
            Aim::Any(manner) => manner,
            Aim::Fire(_) if self.rows.random.one_in(3) => Manner::Noise,
            Aim::Fire(_) => Manner::Held,
        };
        for _ in 0..MAX_TRIES {
            let dt = self.dt();
            let row = self.rows.any(manner, dt);
            if !breaks_assumption(self.net, &row) {
                return Some(row);
            }
        }
        Some(self.rows.held()).filter(|row| !breaks_assumption(self.net, row))
    }

    /// The transition to fire now: the wanted one, or one on the path to it. Occasionally none, because a reaction elsewhere may help.
    fn toward(&mut self, wanted: TransitionId) -> Option<TransitionId> {
        let distances = self.distances(wanted);
        let level: u64 = distances.iter().map(|required| required.least).sum();
        if self.rows.random.one_in(4) {
            return None;
        }
        if level == 0 {
            return Some(wanted);
        }
        let active: Vec<StepId> = self.simulator.state().situation().iter().collect();
        let is_active = |step: &StepId| self.simulator.is_active(*step);
        let mut enabled: Vec<TransitionId> = active
            .iter()
            .flat_map(|step| &self.leaving[step.index()])
            .copied()
            .filter(|it| self.net.transitions[*it].requires.iter().all(is_active))
            .collect();
        enabled.sort_unstable();
        enabled.dedup();
        let mut best = Vec::new();
        for transition in &enabled {
            if self.level_after(&distances, *transition) < level {
                best.push(*transition);
            }
        }
        let from = if best.is_empty() { &enabled } else { &best };
        self.rows.random.pick(from).copied()
    }

    /// A number of ticks: usually at a threshold of the current state.
    fn dt(&mut self) -> u32 {
        if self.max_dt <= 1 {
            return if self.rows.random.one_in(4) { 0 } else { self.max_dt };
        }
        match self.rows.random.below(16) {
            0 | 1 => 0,
            2..=6 => 1,
            7..=12 => {
                let ahead = self.thresholds.ahead(&self.simulator, self.max_dt);
                self.rows.random.pick(&ahead).copied().unwrap_or(1)
            }
            13 | 14 => self.rows.random.below(12).min(self.max_dt as usize) as u32,
            _ => {
                // The limits of counters of 8, 16 and 32 bits.
                let widths = [0xFE, 0xFF, 0x100, 0xFFFE, 0xFFFF, 0x1_0000, MAX_DT - 1, MAX_DT];
                let wide = widths[self.rows.random.below(widths.len())];
                wide.min(self.max_dt)
            }
        }
    }
}

const UNREACHED: u32 = 1_000;

/// The steps that a list may enter.
fn entered(net: &Net, list: &[Enter]) -> Vec<StepId> {
    let mut steps = Vec::new();
    let mut todo: Vec<Enter> = list.to_vec();
    let mut seen: Vec<HistoryId> = Vec::new();
    while let Some(enter) = todo.pop() {
        match enter {
            Enter::Step(step) => steps.push(step),
            Enter::InitialContent(_) => {}
            Enter::History(history) => {
                if !seen.contains(&history) {
                    seen.push(history);
                    let data = &net.histories[history];
                    todo.extend(&data.default);
                    todo.extend(data.cases.iter().flat_map(|case| &case.enters));
                }
            }
        }
    }
    steps.sort_unstable();
    steps.dedup();
    steps
}
