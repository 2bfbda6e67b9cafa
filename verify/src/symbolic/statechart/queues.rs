//! The event queues of statecharts (semantics §5).

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::expr::{ArithOp, CompareOp};
use grafsynth_ir::net::{InputId, InputKind, SendId};

use super::super::aig::Lit;
use super::super::number::Number;
use super::super::reaction::Maker;
use super::super::state::{Queue, State};
use super::run::{External, RunQueue};

/// The event that a round takes.
pub(super) struct Taken {
    pub(super) events: BTreeMap<InputId, Lit>,
    pub(super) any: Lit,
    /// It is an external event that restarts the count of micro-steps.
    pub(super) restarts: Lit,
}

impl Maker<'_> {
    /// The number of an event in the queues; `None` if nothing is `on` it.
    fn event_number(&self, event: InputId) -> Option<i64> {
        let chart = self.statechart.as_ref()?;
        chart.listened.binary_search(&event).ok().map(|at| at as i64 + 1)
    }

    /// The queues as they are between reactions.
    pub(super) fn load_queues(&mut self, state: &State) {
        let n_internal = self.run.internal.items.len() as u32;
        let chart = self.chart();
        let bound = chart.bound;
        let sends = chart.sends;
        let internal = match &state.internal {
            Some(queue) => self.loaded(queue),
            None => RunQueue::empty(n_internal),
        };
        let external = match (&state.external, sends) {
            (Some(queue), _) => External::Queue(self.loaded(queue)),
            (None, true) => External::Queue(RunQueue::empty(bound)),
            (None, false) => External::Row(BTreeMap::new()),
        };
        let run = &mut self.run;
        run.internal = internal;
        run.external = external;
    }

    fn loaded(&mut self, queue: &Queue) -> RunQueue {
        let used: Vec<Lit> = (0..queue.items.len())
            .map(|at| {
                let place = Number::constant(at as i64);
                Number::compare(&mut self.aig, CompareOp::Gt, &queue.length, &place)
            })
            .collect();
        RunQueue { items: queue.items.clone(), waited: used.clone(), used }
    }

    /// Writes the queues back at the end of a reaction.
    pub(super) fn store_queues(&mut self, state: &mut State) {
        if state.internal.is_some() {
            let queue = self.run.internal.clone();
            state.internal = Some(self.stored(&queue));
        }
        if state.external.is_some()
            && let External::Queue(queue) = self.run.external.clone()
        {
            state.external = Some(self.stored(&queue));
        }
    }

    fn stored(&mut self, queue: &RunQueue) -> Queue {
        let mut length = Number::constant(0);
        for (at, used) in queue.used.iter().enumerate() {
            let longer = Number::constant(at as i64 + 1);
            length = Number::select(&mut self.aig, *used, &longer, &length);
        }
        Queue { items: queue.items.clone(), length }
    }

    fn join(&mut self, queue: &mut RunQueue, number: &Number, condition: Lit, waits: Lit) {
        let mut before = Lit::TRUE;
        for at in 0..queue.items.len() {
            let here = self.aig.and_all([condition, before, !queue.used[at]]);
            before = queue.used[at];
            queue.items[at] = Number::select(&mut self.aig, here, number, &queue.items[at]);
            queue.waited[at] = self.aig.ite(here, waits, queue.waited[at]);
            queue.used[at] = self.aig.or(queue.used[at], here);
        }
        // A full queue drops the newest event. `before` is the last place as it was.
        let lost = self.aig.and(condition, before);
        let fault = self.run.fault;
        self.run.fault = self.aig.or(fault, lost);
    }

    pub(in crate::symbolic) fn raise_internal(&mut self, event: InputId, condition: Lit) {
        let Some(number) = self.event_number(event) else { return };
        if condition == Lit::FALSE {
            return;
        }
        let mut queue = std::mem::replace(&mut self.run.internal, RunQueue::empty(0));
        self.join(&mut queue, &Number::constant(number), condition, Lit::FALSE);
        self.run.internal = queue;
    }

    fn join_external(&mut self, number: &Number, condition: Lit, waits: Lit) {
        let empty = External::Row(BTreeMap::new());
        let mut external = std::mem::replace(&mut self.run.external, empty);
        if let External::Queue(queue) = &mut external {
            self.join(queue, number, condition, waits);
        }
        self.run.external = external;
    }

    /// `send`: a delayed send starts its slot; any other joins the external queue.
    pub(in crate::symbolic) fn send(&mut self, state: &mut State, slot: SendId, condition: Lit) {
        let net = self.net;
        let data = &net.sends[slot];
        if data.delay > 0 {
            if let Some(mut left) = state.slots[slot.index()].take() {
                self.set(condition, &mut left, &Number::constant(i64::from(data.delay)));
                state.slots[slot.index()] = Some(left);
            }
        } else if let Some(number) = self.event_number(data.event) {
            self.join_external(&Number::constant(number), condition, Lit::FALSE);
        }
    }

    pub(in crate::symbolic) fn cancel(&mut self, state: &mut State, slot: SendId, condition: Lit) {
        if let Some(mut left) = state.slots[slot.index()].take() {
            self.set(condition, &mut left, &Number::constant(0));
            state.slots[slot.index()] = Some(left);
        }
    }

    /// L3: due sends by their remaining ticks, then by slot; then the events of the row.
    pub(super) fn latch_events(&mut self, state: &mut State, running: Lit) {
        let net = self.net;
        self.latch_sends(state, running);
        let bound = self.chart().bound as usize;
        let sends = self.chart().sends || state.external.is_some();
        let mut earlier: Vec<Lit> = Vec::new();
        let mut waits = BTreeMap::new();
        for event in self.chart().listened.clone() {
            if net.inputs[event].kind != InputKind::Event {
                continue;
            }
            let occurs = self.inputs.values[event.index()].flag();
            let occurs = self.aig.and(occurs, running);
            if sends {
                if let Some(number) = self.event_number(event) {
                    self.join_external(&Number::constant(number), occurs, Lit::TRUE);
                }
                continue;
            }
            let full =
                if earlier.len() < bound { Lit::FALSE } else { self.at_least(&earlier, bound) };
            let kept = self.aig.and(occurs, !full);
            let lost = self.aig.and(occurs, full);
            let fault = self.run.fault;
            self.run.fault = self.aig.or(fault, lost);
            waits.insert(event, kept);
            earlier.push(occurs);
        }
        if !sends {
            self.run.external = External::Row(waits);
        }
    }

    /// True if at least `n` of these are true.
    fn at_least(&mut self, all: &[Lit], n: usize) -> Lit {
        // `counts[k]` is true if more than k of the literals so far are true.
        let mut counts = vec![Lit::FALSE; n];
        for lit in all {
            for at in (0..n).rev() {
                let below = if at == 0 { Lit::TRUE } else { counts[at - 1] };
                let grows = self.aig.and(*lit, below);
                counts[at] = self.aig.or(counts[at], grows);
            }
        }
        counts.last().copied().unwrap_or(Lit::TRUE)
    }

    fn latch_sends(&mut self, state: &mut State, running: Lit) {
        let net = self.net;
        let tick = self.inputs.tick;
        let dt = self.inputs.dt.clone().unwrap_or_else(|| Number::constant(1));
        let zero = Number::constant(0);
        let mut due: Vec<(InputId, Lit, Number)> = Vec::new();
        for (id, data) in net.sends.iter() {
            let Some(left) = state.slots.get(id.index()).cloned().flatten() else { continue };
            let runs = Number::compare(&mut self.aig, CompareOp::Gt, &left, &zero);
            let ends = Number::compare(&mut self.aig, CompareOp::Le, &left, &dt);
            let passes = self.aig.and_all([runs, tick, running]);
            let is_due = self.aig.and(passes, ends);
            let less = Number::arith(&mut self.aig, ArithOp::Sub, &left, &dt);
            let less = Number::select(&mut self.aig, is_due, &zero, &less);
            let bits = 64 - u64::from(data.delay).leading_zeros();
            let code = less.code(&mut self.aig, 0, bits);
            let less = Number::from_code(&mut self.aig, &code, 0);
            state.slots[id.index()] = Some(Number::select(&mut self.aig, passes, &less, &left));
            if self.event_number(data.event).is_some() {
                due.push((data.event, is_due, left));
            }
        }
        // The place of each due send among them.
        let n = due.len();
        let mut joins: Vec<Vec<(i64, Lit)>> = vec![Vec::new(); n];
        for (at, (event, is_due, left)) in due.iter().enumerate() {
            let mut earlier = Vec::new();
            for (other, (_, other_due, other_left)) in due.iter().enumerate() {
                if other == at {
                    continue;
                }
                let op = if other < at { CompareOp::Le } else { CompareOp::Lt };
                let first = Number::compare(&mut self.aig, op, other_left, left);
                earlier.push(self.aig.and(*other_due, first));
            }
            let number = self.event_number(*event).unwrap_or(0);
            for (place, joins) in joins.iter_mut().enumerate() {
                let reaches = if place == 0 { Lit::TRUE } else { self.at_least(&earlier, place) };
                let exceeds = if place + 1 > earlier.len() {
                    Lit::FALSE
                } else {
                    self.at_least(&earlier, place + 1)
                };
                let here = self.aig.and_all([*is_due, reaches, !exceeds]);
                joins.push((number, here));
            }
        }
        for ways in joins {
            let mut number = Number::constant(0);
            for (event, here) in &ways {
                number = Number::select(&mut self.aig, *here, &Number::constant(*event), &number);
            }
            let any = self.aig.or_all(ways.iter().map(|(_, here)| *here));
            self.join_external(&number, any, Lit::TRUE);
        }
    }

    /// Takes the next event if `condition` is true: from the internal queue, or from the external queue if the internal one is empty.
    pub(super) fn take_event(&mut self, condition: Lit) -> Taken {
        let mut events: BTreeMap<InputId, Vec<Lit>> = BTreeMap::new();
        let mut internal = std::mem::replace(&mut self.run.internal, RunQueue::empty(0));
        let (from_inside, _) = self.take_first(&mut internal, condition, &mut events);
        self.run.internal = internal;
        let outside = self.aig.and(condition, !from_inside);
        let empty = External::Row(BTreeMap::new());
        let mut external = std::mem::replace(&mut self.run.external, empty);
        let (from_outside, restarts) = match &mut external {
            External::Queue(queue) => self.take_first(queue, outside, &mut events),
            External::Row(waits) => {
                let mut left = outside;
                for (event, waits) in waits.iter_mut() {
                    let taken = self.aig.and(left, *waits);
                    left = self.aig.and(left, !*waits);
                    *waits = self.aig.and(*waits, !taken);
                    events.entry(*event).or_default().push(taken);
                }
                let any = self.aig.and(outside, !left);
                (any, any)
            }
        };
        self.run.external = external;
        let any = self.aig.or(from_inside, from_outside);
        let events =
            events.into_iter().map(|(event, ways)| (event, self.aig.or_all(ways))).gather();
        Taken { events, any, restarts }
    }

    /// Takes the first event of a queue; returns whether there was one, and whether it had waited at Latch.
    fn take_first(
        &mut self,
        queue: &mut RunQueue,
        condition: Lit,
        events: &mut BTreeMap<InputId, Vec<Lit>>,
    ) -> (Lit, Lit) {
        let Some(first) = queue.used.first().copied() else { return (Lit::FALSE, Lit::FALSE) };
        let takes = self.aig.and(condition, first);
        if takes == Lit::FALSE {
            return (Lit::FALSE, Lit::FALSE);
        }
        let waited = self.aig.and(takes, queue.waited[0]);
        let item = queue.items[0].clone();
        for (at, event) in self.chart().listened.clone().into_iter().enumerate() {
            let is_it = self.equals(&item, at + 1);
            let taken = self.aig.and(takes, is_it);
            events.entry(event).or_default().push(taken);
        }
        for at in 0..queue.items.len() {
            let (item, used, waited) = match queue.used.get(at + 1) {
                Some(used) => (queue.items[at + 1].clone(), *used, queue.waited[at + 1]),
                None => (Number::constant(0), Lit::FALSE, Lit::FALSE),
            };
            queue.items[at] = Number::select(&mut self.aig, takes, &item, &queue.items[at]);
            queue.used[at] = self.aig.ite(takes, used, queue.used[at]);
            queue.waited[at] = self.aig.ite(takes, waited, queue.waited[at]);
        }
        (takes, waited)
    }

    pub(super) fn drop_queues(&mut self, condition: Lit) {
        if condition == Lit::FALSE {
            return;
        }
        let mut run = self.run.clone();
        let mut clear = |used: &mut Lit| *used = self.aig.and(*used, !condition);
        run.internal.used.iter_mut().for_each(&mut clear);
        match &mut run.external {
            External::Queue(queue) => queue.used.iter_mut().for_each(&mut clear),
            External::Row(waits) => waits.values_mut().for_each(&mut clear),
        }
        self.run = run;
    }
}
