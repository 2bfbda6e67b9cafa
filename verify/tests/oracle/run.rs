//! One reaction of a small chart (semantics §3.9).

use super::chart::{Assign, Chart, Compare, Guard, Policy};

/// The state of a chart.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct State {
    /// The active steps.
    pub(crate) active: Vec<bool>,
    /// `s.t` of each step, at most one above the largest constant in a comparison.
    pub(crate) times: Vec<i64>,
    /// Variables.
    pub(crate) vars: Vec<i64>,
    /// Free timers, and whether each ran at the end of the last reaction.
    pub(crate) timers: Vec<(i64, bool)>,
    /// The last values of the inputs whose rising edge is read.
    pub(crate) before: Vec<bool>,
    /// Steps by their last activation, the oldest first; empty if it does not matter.
    pub(crate) ages: Vec<usize>,
}

/// The events of a reaction.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    /// The transitions of each micro-step.
    pub(crate) fired: Vec<Vec<usize>>,
    /// Pairs of transitions that share a preceding step: one that fired, and one that was also fireable but did not fire because of the first.
    pub(crate) contests: Vec<(usize, usize)>,
    /// True if the reaction did not become stable within the limit.
    pub(crate) fault: bool,
}

/// The chart with precomputed data.
#[derive(Debug)]
pub(crate) struct Runner<'c> {
    /// The chart.
    pub(crate) chart: &'c Chart,
    caps: Vec<i64>,
    timer_caps: Vec<i64>,
    asks_edges: Vec<bool>,
    /// One above the largest number of ticks in the chart; `None` if no time is read.
    pub(crate) longest: Option<i64>,
}

struct Now<'a> {
    state: &'a State,
    inputs: &'a [i64],
    fresh: bool,
}

impl<'c> Runner<'c> {
    /// A runner for this chart.
    pub(crate) fn new(chart: &'c Chart) -> Self {
        let mut caps = vec![0; chart.steps.len()];
        let mut timer_caps = vec![0; chart.timers.len()];
        let mut asks_edges = vec![false; chart.inputs.len()];
        let mut longest = None;
        chart.for_each_guard(&mut |guard| match guard {
            Guard::Time(step, _, ticks) => {
                caps[*step] = caps[*step].max(ticks + 1);
                longest = longest.max(Some(ticks + 1));
            }
            Guard::Timer(timer, _, ticks) => {
                timer_caps[*timer] = timer_caps[*timer].max(ticks + 1);
                longest = longest.max(Some(ticks + 1));
            }
            Guard::Rise(input) => asks_edges[*input] = true,
            _ => {}
        });
        Runner { chart, caps, timer_caps, asks_edges, longest }
    }

    /// All rows of inputs that the chart's assumption allows.
    pub(crate) fn rows(&self) -> Vec<Vec<i64>> {
        let mut rows: Vec<Vec<i64>> = vec![Vec::new()];
        for hi in &self.chart.inputs {
            let more = |row: &Vec<i64>| -> Vec<Vec<i64>> {
                (0..=*hi).map(|value| [row.as_slice(), &[value]].concat()).collect()
            };
            rows = rows.iter().flat_map(more).collect();
        }
        rows.retain(|row| self.chart.never_both.is_none_or(|(a, b)| row[a] == 0 || row[b] == 0));
        rows
    }

    /// Reset: the initial steps and their entry lists.
    pub(crate) fn reset(&self) -> State {
        let chart = self.chart;
        let active: Vec<bool> = chart.steps.iter().map(|step| step.initial).collect();
        let mut ages = Vec::new();
        if chart.policy == Policy::Age {
            ages.extend((0..chart.steps.len()).filter(|step| !active[*step]));
            ages.extend((0..chart.steps.len()).filter(|step| active[*step]));
        }
        let mut state = State {
            times: vec![0; active.len()],
            vars: vec![0; chart.vars.len()],
            timers: vec![(0, false); chart.timers.len()],
            before: vec![false; chart.inputs.len()],
            ages,
            active,
        };
        for step in chart.steps.iter().filter(|step| step.initial) {
            self.assign(&mut state, &step.entry);
        }
        self.end(&mut state, &vec![0; chart.inputs.len()]);
        // A Grafcet chart compares no edge at reset.
        state.before.fill(false);
        state
    }

    /// The state after `dt` ticks have passed, before anything else happens.
    pub(crate) fn latch(&self, state: &State, dt: i64) -> State {
        let mut state = state.clone();
        for step in 0..state.times.len() {
            if state.active[step] {
                state.times[step] = (state.times[step] + dt).min(self.caps[step]);
            }
        }
        for (timer, cap) in state.timers.iter_mut().zip(&self.timer_caps) {
            if timer.1 {
                timer.0 = (timer.0 + dt).min(*cap);
            }
        }
        state
    }

    /// The reaction from a state in which time has passed.
    pub(crate) fn react(&self, state: &State, inputs: &[i64]) -> (State, Seen) {
        let mut state = state.clone();
        let mut seen = Seen::default();
        loop {
            let now = Now { state: &state, inputs, fresh: seen.fired.is_empty() };
            let fireable: Vec<usize> = (0..self.chart.moves.len())
                .filter(|at| {
                    let it = &self.chart.moves[*at];
                    it.from.iter().all(|step| state.active[*step]) && self.holds(&it.guard, &now)
                })
                .collect();
            if fireable.is_empty() {
                break;
            }
            if self.chart.stable.is_some_and(|limit| seen.fired.len() == limit as usize) {
                seen.fault = true;
                break;
            }
            let chosen = self.choose(&state, &fireable, &mut seen);
            state = self.fire(&state, &chosen);
            seen.fired.push(chosen);
            if self.chart.stable.is_none() {
                break;
            }
        }
        self.end(&mut state, inputs);
        (state, seen)
    }

    /// The transitions that fire, in the order of their actions.
    fn choose(&self, state: &State, fireable: &[usize], seen: &mut Seen) -> Vec<usize> {
        let chart = self.chart;
        let mut order = fireable.to_vec();
        let urgency = |number: Option<u32>| number.unwrap_or(u32::MAX);
        let by_steps = |at: usize| {
            chart.moves[at].to.iter().map(|to| urgency(chart.steps[*to].priority)).min()
        };
        match chart.policy {
            Policy::All => return order,
            Policy::Priority => order.sort_by_key(|at| (urgency(chart.moves[*at].priority), *at)),
            Policy::Age => order.sort_by_key(|at| {
                let to = &chart.moves[*at].to;
                (by_steps(*at), state.ages.iter().position(|step| to.contains(step)), *at)
            }),
        }
        let mut chosen: Vec<usize> = Vec::new();
        let shares = |a: usize, b: usize| {
            chart.moves[a].from.iter().any(|step| chart.moves[b].from.contains(step))
        };
        for at in order {
            let rivals: Vec<usize> = chosen.iter().copied().filter(|it| shares(*it, at)).collect();
            if rivals.is_empty() {
                chosen.push(at);
            } else {
                seen.contests.extend(rivals.into_iter().map(|won| (won, at)));
            }
        }
        // Ages never order actions (semantics §3.3).
        if chart.policy == Policy::Age {
            chosen.sort_by_key(|at| (by_steps(*at), *at));
        }
        chosen
    }

    fn fire(&self, state: &State, chosen: &[usize]) -> State {
        let chart = self.chart;
        let mut after = state.clone();
        for at in chosen {
            chart.moves[*at].from.iter().for_each(|step| after.active[*step] = false);
        }
        for at in chosen {
            chart.moves[*at].to.iter().for_each(|step| after.active[*step] = true);
        }
        let left: Vec<usize> = (0..chart.steps.len())
            .filter(|step| state.active[*step] && !after.active[*step])
            .collect();
        for step in left {
            let list = &chart.steps[step].exit;
            self.assign(&mut after, list);
            after.times[step] = 0;
        }
        for at in chosen {
            self.assign(&mut after, &chart.moves[*at].acts);
        }
        let fresh: Vec<usize> = (0..chart.steps.len())
            .filter(|step| !state.active[*step] && after.active[*step])
            .collect();
        for step in &fresh {
            after.times[*step] = 0;
            self.assign(&mut after, &chart.steps[*step].entry);
        }
        if chart.policy == Policy::Age {
            after.ages.retain(|step| !fresh.contains(step));
            after.ages.extend(fresh);
        }
        after
    }

    fn assign(&self, state: &mut State, list: &[Assign]) {
        for it in list {
            let old = if it.adds { state.vars[it.var] } else { 0 };
            state.vars[it.var] = (old + it.number).clamp(0, self.chart.vars[it.var]);
        }
    }

    fn end(&self, state: &mut State, inputs: &[i64]) {
        for at in 0..self.chart.timers.len() {
            let held = self.holds_after(&self.chart.timers[at], state, inputs);
            let time = if held { state.timers[at].0 } else { 0 };
            state.timers[at] = (time, held);
        }
        for (at, asked) in self.asks_edges.iter().enumerate() {
            state.before[at] = *asked && inputs[at] != 0;
        }
    }

    /// Whether a condition is true in a row: after the reaction, with its inputs.
    pub(crate) fn holds_after(&self, guard: &Guard, state: &State, inputs: &[i64]) -> bool {
        self.holds(guard, &Now { state, inputs, fresh: false })
    }

    fn holds(&self, guard: &Guard, now: &Now<'_>) -> bool {
        let is = |value: i64, compare: Compare, number: i64| match compare {
            Compare::Is => value == number,
            Compare::Below => value < number,
            Compare::AtMost => value <= number,
            Compare::Above => value > number,
            Compare::AtLeast => value >= number,
        };
        match guard {
            Guard::True => true,
            Guard::Input(at, _, number) if self.chart.inputs[*at] == 1 => {
                // The input is compared as 0 or 1.
                (now.inputs[*at] != 0) == (*number != 0)
            }
            Guard::Input(at, compare, number) => is(now.inputs[*at], *compare, *number),
            Guard::Rise(at) => now.fresh && now.inputs[*at] != 0 && !now.state.before[*at],
            Guard::Var(at, compare, number) => is(now.state.vars[*at], *compare, *number),
            Guard::Time(at, compare, number) => is(now.state.times[*at], *compare, *number),
            Guard::Timer(at, compare, number) => is(now.state.timers[*at].0, *compare, *number),
            Guard::Active(at) => now.state.active[*at],
            Guard::Not(one) => !self.holds(one, now),
            Guard::And(all) => all.iter().all(|one| self.holds(one, now)),
            Guard::Or(all) => all.iter().any(|one| self.holds(one, now)),
        }
    }
}
