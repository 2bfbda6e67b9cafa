//! Statecharts: EVOLVE and FIRE of semantics §3.9 as functions, with the two queues of §5.
//!
//! The evolution is unrolled *round* by round. A round is one check, without an event or for the event that was taken last, and the micro-step if
//! something is fireable. If nothing is, the round takes the next event, of the internal queue or else of the external one; without one, the reaction ends.
//! After an event that nothing reacts to, the check without an event would be the same as before, so the next event is taken at once.

mod clocked;
pub(super) mod cut;
mod enter;
mod possible;
mod queues;
pub(super) mod run;
mod select;
mod structure;
mod tree;

use std::collections::BTreeMap;

use grafsynth_ir::expr::ArithOp;
use grafsynth_ir::net::{Driver, Emission, Enter, Evolution, InputId, PartId, TransitionId};

use super::aig::Lit;
use super::number::Number;
use super::reaction::{Maker, Reaction, Unsupported};
use super::state::State;
use run::Statechart;
pub(super) use tree::Tree;

/// The largest number of rounds of the reset, whose functions are constants.
const RESET_ROUNDS: usize = 256;

/// A transition that an atomic state offered, and whether it was selected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Selected {
    pub(super) transition: TransitionId,
    pub(super) taken: Lit,
}

impl Maker<'_> {
    pub(super) fn chart(&mut self) -> &mut Statechart {
        match &mut self.statechart {
            Some(chart) => chart,
            None => unreachable!("only statecharts evolve like this"),
        }
    }

    /// True if the chart that contains the part has ended in this state.
    pub(super) fn part_has_ended(&self, state: &State, part: PartId) -> Lit {
        let chart = self.statechart.as_ref().map(|chart| chart.tree.chart_of[part.index()]);
        chart.and_then(|chart| state.ended.get(&chart).copied()).unwrap_or(Lit::FALSE)
    }

    /// True if the chart that contains the part had ended before this reaction.
    pub(super) fn part_had_ended(&self, part: PartId) -> Lit {
        let Some(chart) = &self.statechart else { return Lit::FALSE };
        let own = chart.tree.chart_of[part.index()];
        self.run.had_ended.get(&own).copied().unwrap_or(Lit::FALSE)
    }

    /// True if all charts have ended in this state.
    pub(super) fn everything_has_ended(&mut self, state: &State) -> Lit {
        let net = self.net;
        if self.statechart.is_none() || state.ended.is_empty() {
            return Lit::FALSE;
        }
        let mut all: Vec<Lit> =
            net.steps.values().map(|step| self.part_has_ended(state, step.part)).collect();
        all.sort_unstable();
        all.dedup();
        self.aig.and_all(all)
    }

    /// True if all charts that use a controlled action have ended, so that it stops.
    pub(super) fn action_has_ended(
        &mut self,
        state: &State,
        action: grafsynth_ir::net::ActionId,
    ) -> Lit {
        let net = self.net;
        let uses = &net.actions[action].uses;
        if uses.is_empty() || state.ended.is_empty() {
            return Lit::FALSE;
        }
        let all: Vec<Lit> =
            uses.iter().map(|one| self.part_has_ended(state, net.steps[one.step].part)).collect();
        self.aig.and_all(all)
    }

    /// L1 and L3: what the evolution starts with.
    pub(super) fn begin_evolution(&mut self, state: &mut State, is_reset: bool) {
        self.events.fill(Lit::FALSE);
        let had_ended = if is_reset { BTreeMap::new() } else { state.ended.clone() };
        let running = !self.everything_has_ended(state);
        let run = &mut self.run;
        run.fault = Lit::FALSE;
        run.running = running;
        run.fresh = Lit::TRUE;
        run.event.clear();
        run.count = Number::constant(0);
        run.n_rounds = 0;
        run.had_ended = had_ended;
        self.load_queues(state);
        if !is_reset {
            self.latch_events(state, running);
        }
    }

    /// EVOLVE; returns whether the reaction has a fault. The evolution may need more rounds than are unrolled: see [`Run::running`].
    pub(super) fn evolve_statechart(&mut self, state: &mut State) -> Result<Lit, Unsupported> {
        for _ in 0..self.depth {
            if self.run.running == Lit::FALSE {
                break;
            }
            self.round(state)?;
        }
        Ok(self.run.fault)
    }

    /// RESET of a statechart: R3 to R5.
    pub(super) fn reset_statechart(&mut self, state: &mut State) -> Result<Lit, Unsupported> {
        let net = self.net;
        self.begin_evolution(state, true);
        let items: Vec<(Enter, Lit)> = (net.parts.values().flat_map(|part| &part.initial))
            .map(|item| (*item, Lit::TRUE))
            .collect();
        let entries = self.entries(state, &items);
        self.begin_lists(state);
        self.enter_states(state, &entries);
        self.frozen = None;
        if self.structure(state).into_iter().any(|holds| holds != Lit::TRUE) {
            return Err("the initial states are not a configuration".to_owned());
        }
        for _ in 0..RESET_ROUNDS {
            if self.run.running == Lit::FALSE {
                return Ok(self.run.fault);
            }
            self.round(state)?;
        }
        Err(format!("the reset takes more than {RESET_ROUNDS} micro-steps"))
    }

    pub(super) fn begin_lists(&mut self, state: &State) {
        if self.net.settings.assign_simultaneous {
            self.frozen = Some(Box::new(state.clone()));
        }
    }

    /// One round of EVOLVE.
    pub(super) fn round(&mut self, state: &mut State) -> Result<(), Unsupported> {
        let net = self.net;
        let is_over = self.everything_has_ended(state);
        let running = self.run.running;
        let stops = self.aig.and(running, is_over);
        self.drop_queues(stops);
        let active = self.aig.and(running, !is_over);

        let now: Vec<Lit> =
            net.edges.values().map(|operand| self.flag(state, &operand.expr)).collect();
        let fresh = self.run.fresh;
        self.edges(state, &now, fresh);
        let event = self.run.event.clone();
        let fireable = self.fireable_in_statechart(state, &event);
        self.check_size()?;
        let selected = self.select_in_statechart(state, &fireable);
        let any = self.aig.or_all(selected.iter().map(|one| one.taken));
        let any = self.aig.and(any, active);
        let takes = self.aig.and(active, !any);
        let taken = self.take_event(takes);

        let too_long = self.count(any, taken.restarts);
        let fires = self.aig.and(any, !too_long);
        self.drop_queues(too_long);
        let goes_on = self.aig.or(fires, taken.any);
        let over = self.aig.and(active, !goes_on);
        let renews = self.aig.or(fires, over);
        {
            let run = &mut self.run;
            run.running = goes_on;
            run.event = taken.events;
            run.n_rounds += 1;
        }
        let fault = self.run.fault;
        self.run.fault = self.aig.or(fault, too_long);
        let fired = self.fire_in_statechart(state, &selected, fires)?;
        self.fired.push(fired);
        for (edge, now) in now.iter().enumerate() {
            if !self.over_inputs[edge] {
                state.old[edge] = self.aig.ite(renews, *now, state.old[edge]);
            }
        }
        self.run.fresh = self.aig.and(fresh, !fires);
        self.check_size()
    }

    /// Counts a micro-step if `any` is true, and starts again from 0 with an event that waited at Latch. True if there would be too many micro-steps.
    fn count(&mut self, any: Lit, restarts: Lit) -> Lit {
        let limit = match self.net.settings.evolution {
            Evolution::Single => 1,
            Evolution::Stable { limit } => limit,
        };
        let count = self.run.count.clone();
        let is_full = if self.run.n_rounds < limit {
            Lit::FALSE
        } else {
            self.equals(&count, limit as usize)
        };
        let counts = self.aig.and(any, !is_full);
        let more = Number::arith(&mut self.aig, ArithOp::Add, &count, &Number::constant(1));
        let code = more.code(&mut self.aig, 0, 64 - u64::from(limit).leading_zeros());
        let more = Number::from_code(&mut self.aig, &code, 0);
        let count = Number::select(&mut self.aig, counts, &more, &count);
        let count = Number::select(&mut self.aig, restarts, &Number::constant(0), &count);
        self.run.count = count;
        self.aig.and(any, is_full)
    }

    /// K1: the edges of a check.
    pub(super) fn edges(&mut self, state: &State, now: &[Lit], fresh: Lit) {
        for (edge, now) in now.iter().enumerate() {
            let alive = if self.over_inputs[edge] { fresh } else { Lit::TRUE };
            let rises = self.aig.and(*now, !state.old[edge]);
            let falls = self.aig.and(!*now, state.old[edge]);
            self.rise[edge] = self.aig.and(alive, rises);
            self.fall[edge] = self.aig.and(alive, falls);
        }
    }

    /// K2: the transitions without an event, or those on the event of this check.
    fn fireable_in_statechart(
        &mut self,
        state: &State,
        event: &BTreeMap<InputId, Lit>,
    ) -> Vec<Lit> {
        let net = self.net;
        let eventless = !self.aig.or_all(event.values().copied());
        self.fireable.fill(Lit::FALSE);
        for (id, transition) in net.transitions.iter() {
            let triggered = if transition.events.is_empty() {
                eventless
            } else {
                let all = transition.events.iter().filter_map(|one| event.get(one));
                let all: Vec<Lit> = all.copied().collect();
                self.aig.or_all(all)
            };
            if triggered == Lit::FALSE {
                continue;
            }
            let mut parts = vec![triggered, !self.part_has_ended(state, transition.part)];
            parts.extend(transition.requires.iter().map(|step| state.active[step.index()]));
            parts.push(self.flag(state, &transition.guard));
            self.fireable[id.index()] = self.aig.and_all(parts);
        }
        self.fireable.clone()
    }

    /// FIRE: S1 to S4. Returns for each transition whether it fires.
    fn fire_in_statechart(
        &mut self,
        state: &mut State,
        selected: &[Selected],
        fires: Lit,
    ) -> Result<Vec<Lit>, Unsupported> {
        let net = self.net;
        let mut by: Vec<Vec<Lit>> = vec![Vec::new(); net.transitions.len()];
        let mut acts = Vec::with_capacity(selected.len());
        for one in selected {
            let taken = self.aig.and(one.taken, fires);
            by[one.transition.index()].push(taken);
            acts.push(taken);
        }
        let fired: Vec<Lit> = by.into_iter().map(|ways| self.aig.or_all(ways)).collect();
        // S1
        let mut ways: Vec<Vec<Lit>> = vec![Vec::new(); net.steps.len()];
        let mut items = Vec::new();
        for (id, transition) in net.transitions.iter() {
            let fires = fired[id.index()];
            if fires == Lit::FALSE {
                continue;
            }
            transition.clears.iter().for_each(|step| ways[step.index()].push(fires));
            items.extend(transition.enters.iter().map(|item| (*item, fires)));
        }
        let down: Vec<Lit> = ways
            .into_iter()
            .zip(state.active.clone())
            .map(|(ways, active)| {
                let leaves = self.aig.or_all(ways);
                self.aig.and(active, leaves)
            })
            .collect();
        for (id, history) in net.histories.iter() {
            let records = down[history.owner.index()];
            for case in &history.cases {
                if let Some(recorded) = state.recorded.get_mut(&(id, case.step)) {
                    let active = state.active[case.step.index()];
                    *recorded = self.aig.ite(records, active, *recorded);
                }
            }
        }
        let entries = self.entries(state, &items);
        self.begin_lists(state);
        // S2
        for step in net.steps.ids().rev() {
            let at = step.index();
            self.block(state, down[at], &net.steps[step].exit);
            state.active[at] = self.aig.and(state.active[at], !down[at]);
            for number in [&mut state.elapsed[at], &mut state.task[at]].into_iter().flatten() {
                *number = Number::select(&mut self.aig, down[at], &Number::constant(0), number);
            }
        }
        // S3
        for (one, acts) in selected.iter().zip(acts) {
            self.block(state, acts, &net.transitions[one.transition].actions);
        }
        // S4
        self.enter_states(state, &entries);
        self.frozen = None;
        Ok(fired)
    }

    /// If a chart ends in this reaction, stores the values that its outputs show [C20].
    pub(super) fn keep_outputs(&mut self, state: &mut State) {
        let net = self.net;
        for (output, chart) in self.shape.chart.kept.clone() {
            let Driver::Continuous(emissions) = &net.outputs[output].driver else {
                continue;
            };
            let own: Vec<Emission> = emissions
                .iter()
                .filter(|one| {
                    self.statechart.as_ref().is_some_and(|data| {
                        data.tree.chart_of[net.steps[one.step].part.index()] == chart
                    })
                })
                .cloned()
                .collect();
            let value = self.emitted(state, &own);
            let had = self.part_had_ended(chart);
            let ends = self.aig.and(state.ended[&chart], !had);
            let before = state.kept[&(output, chart)];
            let after = self.aig.ite(ends, value, before);
            state.kept.insert((output, chart), after);
        }
    }
}

impl Maker<'_> {
    /// True if the last reaction needs more rounds than were unrolled.
    pub(crate) fn overruns(&self) -> Lit {
        self.statechart.as_ref().map_or(Lit::FALSE, |_| self.run.running)
    }

    /// The reaction of a statechart whose evolution has been made.
    pub(super) fn end_of_statechart(&mut self, mut state: State) -> Result<Reaction, Unsupported> {
        self.events.fill(Lit::FALSE);
        self.rise.fill(Lit::FALSE);
        self.fall.fill(Lit::FALSE);
        self.end(&mut state)?;
        self.store_queues(&mut state);
        self.keep_outputs(&mut state);
        for (edge, operand) in self.net.edges.iter() {
            if self.over_inputs[edge.index()] {
                state.old[edge.index()] = self.flag(&state, &operand.expr);
            }
        }
        let outputs = self.outputs(&state);
        let fault = self.run.fault;
        Ok(Reaction { state, outputs, fault })
    }
}
