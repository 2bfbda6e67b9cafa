//! One check of an evolution from any point of it, for proofs that match the loop of a program check by check.
//!
//! An evolution is cut at the start of each check. Between two checks there are the state of the net and the [`Run`]; both are free variables here, restricted
//! by invariants that the proof has to show for the start of an evolution and for each check.
//!
//! # Why an evolution ends
//! Let L be the limit of micro-steps, w the number of waiting events that restart the count, n the micro-steps since the last such event, and q the number of
//! the other events in both queues, of which there are never more than U. While the evolution goes on, each check does one of three things: it fires, and n
//! grows by 1; it takes an event that restarts the count, so w falls by 1, n becomes 0, and q does not grow; or it takes another event, and q falls by 1. So
//! `w (L (U + 1) + 1) + (L - n) (U + 1) + q` falls with each check, and [`Maker::most_rounds`] is its largest value at the start, plus the last check.
//! [`Maker::progress`] is the statement about one check, for a solver.

use grafsynth_ir::expr::{ArithOp, CompareOp};
use grafsynth_ir::instance::Carried;
use grafsynth_ir::net::{EdgeId, InputId, InputKind, PartId, StepKind};

use super::super::aig::Lit;
use super::super::number::Number;
use super::super::reaction::{Inputs, Maker, Reaction, Unsupported};
use super::super::state::State;
use super::run::{External, Run, RunQueue};

/// A value that an evolution carries.
#[derive(Debug, Clone)]
pub(in crate::symbolic) enum Held {
    Flag(Lit),
    Number(Number),
    /// Constants with their conditions, of which exactly one is true.
    Cases(Vec<(i64, Lit)>),
}

/// A queue during an evolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::symbolic) enum Which {
    Internal,
    External,
}

impl Maker<'_> {
    /// Makes the external events a queue even if nothing is sent, as a program may store them.
    pub(in crate::symbolic) fn with_external_queue(&mut self) {
        self.chart().sends = true;
    }

    /// The state at the first check of a reaction.
    pub(in crate::symbolic) fn start_of_evolution(
        &mut self,
        state: &State,
        inputs: &Inputs,
    ) -> State {
        let mut state = state.clone();
        self.inputs = inputs.clone();
        self.calls.clear();
        self.fired.clear();
        self.latch(&mut state);
        match self.statechart {
            Some(_) => self.begin_evolution(&mut state, false),
            None => self.begin_micro_steps(&mut state),
        }
        state
    }

    /// Replaces the run by free variables, for a state in the middle of an evolution that goes on or, with `goes_on` false, has just ended.
    pub(in crate::symbolic) fn any_run(&mut self, state: &State, inputs: &Inputs, goes_on: bool) {
        self.start_of_evolution(state, inputs);
        if self.statechart.is_none() {
            return self.any_micro_steps(goes_on);
        }
        let like = self.run.clone();
        let bits: Vec<Lit> = self.written(&like).iter().map(|_| self.aig.variable()).collect();
        let mut run = self.read_run(&like, &bits);
        run.running = Lit::constant(goes_on);
        run.fault = self.aig.variable();
        if let (External::Row(waits), External::Row(known)) = (&mut run.external, &like.external) {
            waits.retain(|event, _| known.contains_key(event));
        }
        self.run = run;
    }

    /// One check. An evolution in which all charts have ended ends at once, as its next check would find.
    pub(in crate::symbolic) fn one_check(&mut self, state: &mut State) -> Result<(), Unsupported> {
        if self.statechart.is_none() {
            return self.one_micro_step(state);
        }
        self.round(state)?;
        let running = self.run.running;
        let is_over = self.everything_has_ended(state);
        let stops = self.aig.and(running, is_over);
        self.drop_queues(stops);
        self.run.running = self.aig.and(running, !is_over);
        Ok(())
    }

    /// The rest of a reaction after its evolution.
    pub(in crate::symbolic) fn rest_of_reaction(
        &mut self,
        mut state: State,
    ) -> Result<Reaction, Unsupported> {
        state.raised.fill(Lit::FALSE);
        match self.statechart {
            Some(_) => self.end_of_statechart(state),
            None => self.end_of_reaction(state, self.run.fault),
        }
    }

    /// True if the reaction has a fault so far.
    pub(in crate::symbolic) fn has_fault(&mut self) -> Lit {
        self.run.fault
    }

    /// True if there is another check.
    pub(in crate::symbolic) fn goes_on(&mut self) -> Lit {
        self.run.running
    }

    pub(in crate::symbolic) fn run_now(&mut self) -> Run {
        self.run.clone()
    }

    /// The invariants of the run, each a condition.
    pub(in crate::symbolic) fn run_invariants(&mut self, state: &State) -> Vec<Lit> {
        let limit = Number::constant(i64::from(self.limit()));
        let is_within = Number::compare(&mut self.aig, CompareOp::Le, &self.run.count, &limit);
        if self.statechart.is_none() {
            let mut all = self.invariants_of_micro_steps(state);
            all.push(is_within);
            return all;
        }
        let has_sends = self.has_sends();
        let run = self.run.clone();
        let n_events = Number::constant(self.n_events());
        let mut all = self.kept_invariants(state);
        all.push(is_within);
        let never = self.never();
        all.extend(run.event.iter().filter(|(event, _)| never.contains(event)).map(|it| !*it.1));
        let mut queues = vec![&run.internal];
        if let External::Queue(queue) = &run.external {
            queues.push(queue);
            // Events that waited at Latch come first.
            let mut earlier = Lit::TRUE;
            for (used, waited) in queue.used.iter().zip(&queue.waited) {
                let waits = self.aig.and(*used, *waited);
                all.push(self.aig.or(!waits, earlier));
                earlier = waits;
                if !has_sends {
                    all.push(self.aig.or(!*used, *waited));
                }
            }
        }
        for queue in queues {
            for at in 0..queue.used.len() {
                if at == 0 {
                    // After the last check nothing waits.
                    all.push(self.aig.or(!queue.used[at], run.running));
                } else {
                    all.push(self.aig.or(!queue.used[at], queue.used[at - 1]));
                }
                let item = &queue.items[at];
                let least =
                    Number::compare(&mut self.aig, CompareOp::Ge, item, &Number::constant(1));
                let most = Number::compare(&mut self.aig, CompareOp::Le, item, &n_events);
                let is_event = self.aig.and(least, most);
                all.push(self.aig.or(!queue.used[at], is_event));
                for event in &never {
                    let is_it = self.is_event(item, *event);
                    all.push(!self.aig.and(queue.used[at], is_it));
                }
            }
        }
        let events: Vec<Lit> = run.event.values().copied().collect();
        let (mut one, mut two) = (Lit::FALSE, Lit::FALSE);
        for event in events {
            let both = self.aig.and(one, event);
            two = self.aig.or(two, both);
            one = self.aig.or(one, event);
        }
        all.push(!two);
        for (part, had) in &run.had_ended {
            let ended = state.ended.get(part).copied().unwrap_or(Lit::FALSE);
            all.push(self.aig.or(!*had, ended));
        }
        let is_over = self.everything_has_ended(state);
        let both = self.aig.and(run.running, is_over);
        all.push(!both);
        all
    }

    /// The number of events that some transition is `on`: the largest number in a queue.
    pub(in crate::symbolic) fn n_events(&mut self) -> i64 {
        self.chart().listened.len() as i64
    }

    /// True if a list sends an event that some transition is `on`.
    fn has_sends(&mut self) -> bool {
        let net = self.net;
        let listened = &self.chart().listened;
        net.sends.values().any(|slot| listened.binary_search(&slot.event).is_ok())
    }

    /// A bound on the checks of a reaction.
    pub(in crate::symbolic) fn most_rounds(&mut self) -> u64 {
        let limit = u64::from(self.limit());
        if self.statechart.is_none() {
            return limit.saturating_add(1);
        }
        let net = self.net;
        let has_sends = self.has_sends();
        let inside = self.run.internal.items.len() as u64;
        let is_queue = matches!(self.run.external, External::Queue(_));
        let chart = self.chart();
        let bound = u64::from(chart.bound);
        let is_of_row = |event: &&InputId| net.inputs[**event].kind == InputKind::Event;
        let of_row = chart.listened.iter().filter(is_of_row).count() as u64;
        // Without sends, the external queue contains only events of the row.
        let (waiting, sent) = match (is_queue, has_sends) {
            (true, true) => (bound, bound),
            (true, false) | (false, _) => (bound.min(of_row), 0),
        };
        let others = inside.saturating_add(sent);
        let block = limit.saturating_mul(others.saturating_add(1));
        let all = waiting.saturating_mul(block.saturating_add(1)).saturating_add(block);
        all.saturating_add(inside).saturating_add(1)
    }

    /// The waiting events that restart the count, and the other waiting ones.
    fn waiting(&mut self, run: &Run) -> (Vec<Lit>, Vec<Lit>) {
        let (mut restarting, mut others) = (Vec::new(), run.internal.used.clone());
        match &run.external {
            External::Row(waits) => restarting.extend(waits.values()),
            External::Queue(queue) => {
                for (used, waited) in queue.used.iter().zip(&queue.waited) {
                    restarting.push(self.aig.and(*used, *waited));
                    others.push(self.aig.and(*used, !*waited));
                }
            }
        }
        (restarting, others)
    }

    fn number_of(&mut self, all: &[Lit]) -> Number {
        let mut sum = Number::constant(0);
        for lit in all {
            let one = Number::of_bits(vec![*lit, Lit::FALSE]);
            sum = Number::arith(&mut self.aig, ArithOp::Add, &sum, &one);
        }
        sum
    }

    /// True if the evolution has ended with the last check, or the check made progress in the sense of the module.
    pub(in crate::symbolic) fn progress(&mut self, before: &Run) -> Lit {
        let after = self.run.clone();
        let ((waited, others), (waits, rest)) = (self.waiting(before), self.waiting(&after));
        let [waited, others, waits, rest] =
            [waited, others, waits, rest].map(|all| self.number_of(&all));
        let one = Number::constant(1);
        let mut compare = |a: &Number, op: CompareOp, b: &Number, plus_one: bool| {
            let b = if plus_one {
                Number::arith(&mut self.aig, ArithOp::Add, b, &one)
            } else {
                b.clone()
            };
            Number::compare(&mut self.aig, op, a, &b)
        };
        let same_waiting = compare(&waits, CompareOp::Eq, &waited, false);
        let fires = compare(&after.count, CompareOp::Eq, &before.count, true);
        let one_less = compare(&waited, CompareOp::Eq, &waits, true);
        let not_more = compare(&rest, CompareOp::Le, &others, false);
        let same_count = compare(&after.count, CompareOp::Eq, &before.count, false);
        let fewer = compare(&others, CompareOp::Eq, &rest, true);
        let ways = [
            self.aig.and(same_waiting, fires),
            self.aig.and(one_less, not_more),
            self.aig.and_all([same_waiting, same_count, fewer]),
        ];
        let any = self.aig.or_all(ways);
        self.aig.or(!after.running, any)
    }

    /// True if every external event restarts the count and the number of micro-steps is 0, as at the start of a reaction.
    pub(in crate::symbolic) fn is_start(&mut self) -> Lit {
        let run = self.run.clone();
        let mut all = vec![self.equals(&run.count, 0)];
        if let External::Queue(queue) = &run.external {
            for (used, waited) in queue.used.iter().zip(&queue.waited) {
                all.push(self.aig.or(!*used, *waited));
            }
        }
        self.aig.and_all(all)
    }

    /// The invariants between reactions: an event that waits in a queue has a number from 1 on, none waits after the end of all charts, and only charts that have
    /// ended keep outputs.
    pub(in crate::symbolic) fn row_invariants(&mut self, state: &State) -> Vec<Lit> {
        if self.statechart.is_none() {
            return self.invariants_of_rows(state);
        }
        let mut all = self.kept_invariants(state);
        let never = self.never();
        let is_over = self.everything_has_ended(state);
        for queue in [&state.internal, &state.external].into_iter().flatten() {
            for (item, at) in queue.items.iter().zip(0..) {
                let place = Number::constant(at);
                let is_free = Number::compare(&mut self.aig, CompareOp::Le, &queue.length, &place);
                let is_event =
                    Number::compare(&mut self.aig, CompareOp::Ge, item, &Number::constant(1));
                let may_wait = self.aig.and(is_event, !is_over);
                all.push(self.aig.or(is_free, may_wait));
                for event in &never {
                    let is_it = self.is_event(item, *event);
                    all.push(self.aig.or(is_free, !is_it));
                }
            }
        }
        all
    }

    /// The events that some transition is `on` although they cannot occur.
    fn never(&mut self) -> Vec<InputId> {
        let chart = self.chart();
        let listened = chart.listened.iter();
        listened.filter(|event| !chart.possible.events.contains(event)).copied().collect()
    }

    /// True if an element of a queue is this event.
    fn is_event(&mut self, item: &Number, event: InputId) -> Lit {
        let at = self.chart().listened.binary_search(&event);
        at.map_or(Lit::FALSE, |at| self.equals(item, at + 1))
    }

    /// Invariants: a chart keeps its outputs only after it has ended, an ended chart is in a final state, and a send that cannot occur is not running.
    fn kept_invariants(&mut self, state: &State) -> Vec<Lit> {
        let net = self.net;
        let possible = self.chart().possible.slots.clone();
        let never = net.sends.ids().filter(|slot| !possible.contains(slot));
        let idle: Vec<Lit> = never
            .filter_map(|slot| state.slots.get(slot.index())?.as_ref())
            .map(|left| self.equals(left, 0))
            .collect();
        let kept = state.kept.iter().map(|((_, part), kept)| {
            let ended = state.ended.get(part).copied().unwrap_or(Lit::FALSE);
            self.aig.or(!*kept, ended)
        });
        let mut all: Vec<Lit> = idle.into_iter().chain(kept).collect();
        for (chart, ended) in &state.ended {
            let is_its = |part: PartId| self.chart_of(part) == Some(*chart);
            let finals = net.steps.iter().filter(|(_, step)| {
                step.kind == StepKind::Final && step.parent.is_none() && is_its(step.part)
            });
            let finals: Vec<Lit> = finals.map(|(id, _)| state.active[id.index()]).collect();
            let any = self.aig.or_all(finals);
            all.push(self.aig.or(!*ended, any));
        }
        all
    }

    fn chart_of(&self, part: PartId) -> Option<PartId> {
        Some(self.statechart.as_ref()?.tree.chart_of[part.index()])
    }

    /// A value that the evolution carries; `None` if this evolution has none.
    pub(in crate::symbolic) fn carried(&mut self, what: &Carried) -> Option<Held> {
        let run = self.run.clone();
        Some(match what {
            Carried::Fault => Held::Flag(run.fault),
            Carried::Again => Held::Flag(run.running),
            Carried::Event(numbers) => {
                // A number of its own for each event, else two of the cases could be true.
                if numbers.iter().enumerate().any(|(at, event)| numbers[..at].contains(event)) {
                    return None;
                }
                let own = |event| run.event.get(event).copied().unwrap_or(Lit::FALSE);
                let mut cases: Vec<(i64, Lit)> =
                    (1..).zip(numbers).map(|(number, event)| (number, own(event))).collect();
                let any = self.aig.or_all(cases.iter().map(|(_, lit)| *lit));
                cases.push((0, !any));
                Held::Cases(cases)
            }
            Carried::Count => Held::Number(run.count),
            Carried::Restarts => {
                let (restarting, _) = self.waiting(&run);
                Held::Cases(self.length(&restarting))
            }
            Carried::Present(event) => Held::Flag(run.event.get(event).copied()?),
            Carried::Waits(event) => match &run.external {
                External::Row(waits) => Held::Flag(waits.get(event).copied()?),
                External::Queue(_) => return None,
            },
            Carried::HadEnded(part) => Held::Flag(run.had_ended.get(part).copied()?),
            // They are no part of the net.
            Carried::Asked(_) | Carried::Answer(_) => return None,
        })
    }

    fn queue(&mut self, which: Which) -> Option<RunQueue> {
        let run = &self.run;
        match (which, &run.external) {
            (Which::Internal, _) => Some(run.internal.clone()),
            (Which::External, External::Queue(queue)) => Some(queue.clone()),
            (Which::External, External::Row(_)) => None,
        }
    }

    /// The length of a queue in the evolution.
    pub(in crate::symbolic) fn queue_length(&mut self, which: Which) -> Option<Held> {
        let queue = self.queue(which)?;
        Some(Held::Cases(self.length(&queue.used)))
    }

    /// The number of places that are used; the first ones are.
    fn length(&mut self, used: &[Lit]) -> Vec<(i64, Lit)> {
        let n = used.len();
        let is = |aig: &mut super::super::aig::Aig, at: usize| {
            let longer = used.get(at).copied().unwrap_or(Lit::FALSE);
            let reaches = if at == 0 { Lit::TRUE } else { used[at - 1] };
            aig.and(reaches, !longer)
        };
        (0..=n).map(|at| (at as i64, is(&mut self.aig, at))).collect()
    }

    /// The event number at a place of a queue, and whether the place is used.
    pub(in crate::symbolic) fn queue_item(
        &mut self,
        which: Which,
        at: u32,
    ) -> Option<(Number, Lit)> {
        let queue = self.queue(which)?;
        let at = at as usize;
        Some((queue.items.get(at)?.clone(), queue.used.get(at).copied()?))
    }

    /// The value that a program stores for an edge operand between two checks, and the condition that it is read later: that of an input changes with the first
    /// micro-step and after the last check.
    pub(in crate::symbolic) fn compared(
        &mut self,
        state: &State,
        edge: EdgeId,
    ) -> Option<(Lit, Lit)> {
        let old = state.old.get(edge.index()).copied()?;
        if !self.over_inputs[edge.index()] {
            return Some((old, Lit::TRUE));
        }
        let net = self.net;
        let now = self.flag(state, &net.edges[edge].expr);
        let run = self.run.clone();
        let keeps = self.aig.and(run.fresh, run.running);
        let is_over = self.everything_has_ended(state);
        Some((self.aig.ite(keeps, old, now), !is_over))
    }

    /// The condition that a piece of the state of an edge is read later, between reactions.
    pub(in crate::symbolic) fn compares_later(&mut self, state: &State, edge: EdgeId) -> Lit {
        if self.over_inputs[edge.index()] { !self.everything_has_ended(state) } else { Lit::TRUE }
    }
}
