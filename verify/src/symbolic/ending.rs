//! The end of a reaction as functions: controlled actions (semantics §3.5), tasks (§6), free timers (§7), outputs (§3.6).

use grafsynth_ir::ranks::sort_by_rank;
use std::collections::BTreeMap;

use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::net::{ActionId, Driver, Emission, ExternCall, Output, OutputId, Qualifier};
use grafsynth_ir::program::ActionPart;

use super::aig::Lit;
use super::calls::Call;
use super::number::Number;
use super::reaction::{Maker, Unsupported};
use super::state::{State, Value, held_of};

impl Maker<'_> {
    /// Steps E1 to E3 of semantics §3.9.
    pub(super) fn end(&mut self, state: &mut State) -> Result<(), Unsupported> {
        let net = self.net;
        let mut fell = Vec::new();
        let mut runs = Vec::new();
        for (id, _) in net.actions.iter() {
            let ended = self.action_has_ended(state, id);
            let stopped = self.aig.or(ended, self.waits);
            let before =
                (stopped != Lit::FALSE).then(|| (state.latches.clone(), state.times.clone()));
            let mut q = self.action_control(state, id);
            let was = state.q[id.index()];
            let falls = self.aig.and_all([was, !q, !stopped]);
            fell.push(falls);
            runs.push(self.aig.and(q, !stopped));
            if let Some((latches, times)) = before {
                q = self.aig.ite(stopped, was, q);
                for (key, value) in &mut state.latches {
                    *value = self.aig.ite(stopped, latches[key], *value);
                }
                for (key, value) in &mut state.times {
                    *value = Number::select(&mut self.aig, stopped, &times[key], value);
                }
            }
            state.q[id.index()] = q;
        }
        if net.settings.final_scan {
            for (id, action) in net.actions.iter() {
                self.block(state, fell[id.index()], &action.body);
            }
        }
        for (id, action) in net.actions.iter() {
            self.block(state, runs[id.index()], &action.body);
        }
        self.tasks(state);
        let ended = self.everything_has_ended(state);
        let stopped = self.aig.or(ended, self.waits);
        for (id, timer) in net.timers.iter() {
            let holds = self.flag(state, &timer.condition);
            state.held[id.index()] = self.aig.ite(stopped, state.held[id.index()], holds);
            if let Some(mut counter) = state.timers[id.index()].take() {
                let clears = self.aig.and(!holds, !stopped);
                self.set(clears, &mut counter, &Number::constant(0));
                state.timers[id.index()] = Some(counter);
            }
        }
        self.check_size()
    }

    /// Decides whether END waits for a later round (semantics §10.2), from what fires in this one.
    pub(super) fn decide_waiting(&mut self, state: &State) {
        let net = self.net;
        self.waits = Lit::FALSE;
        let Some(ending) = &net.ending else { return };
        let mut ways = vec![self.flag(state, &ending.waits)];
        if ending.is_quiet {
            ways.extend(self.fired.first().into_iter().flatten());
        }
        self.waits = self.aig.or_all(ways);
    }

    /// ACTION_CONTROL of one action (semantics §3.5).
    fn action_control(&mut self, state: &mut State, id: ActionId) -> Lit {
        let net = self.net;
        let action = &net.actions[id];
        let mut input: BTreeMap<Qualifier, Lit> = BTreeMap::new();
        for one in &action.uses {
            let condition =
                one.condition.as_ref().map_or(Lit::TRUE, |condition| self.flag(state, condition));
            let asks = self.aig.and(state.active[one.step.index()], condition);
            let so_far = input.get(&one.qualifier).copied().unwrap_or(Lit::FALSE);
            let either = self.aig.or(so_far, asks);
            input.insert(one.qualifier, either);
        }
        let asks = |qualifier: Qualifier| input.get(&qualifier).copied();
        let reset = asks(Qualifier::R).unwrap_or(Lit::FALSE);
        let mut ways: Vec<Lit> = asks(Qualifier::N).into_iter().collect();
        for (qualifier, part) in [
            (Qualifier::S, ActionPart::S),
            (Qualifier::SD, ActionPart::SD),
            (Qualifier::SL, ActionPart::SL),
        ] {
            if let Some(set) = asks(qualifier) {
                let either = self.aig.or(state.latches[&(id, part)], set);
                let latch = self.aig.and(!reset, either);
                state.latches.insert((id, part), latch);
                if part == ActionPart::S {
                    ways.push(latch);
                }
            }
        }
        for (qualifier, part) in [
            (Qualifier::L, ActionPart::L),
            (Qualifier::D, ActionPart::D),
            (Qualifier::DS, ActionPart::DS),
            (Qualifier::SD, ActionPart::SD),
            (Qualifier::SL, ActionPart::SL),
        ] {
            let Some(asked) = asks(qualifier) else { continue };
            let input = match part {
                ActionPart::SD | ActionPart::SL => state.latches[&(id, part)],
                ActionPart::L
                | ActionPart::D
                | ActionPart::DS
                | ActionPart::S
                | ActionPart::P
                | ActionPart::P0
                | ActionPart::P1
                | ActionPart::DSHeld => asked,
            };
            let mut time = state.times[&(id, part)].clone();
            self.set(!input, &mut time, &Number::constant(0));
            state.latches.insert((id, held_of(part)), input);
            let late = Number::compare(
                &mut self.aig,
                CompareOp::Ge,
                &time,
                &Number::constant(i64::from(action.duration)),
            );
            state.times.insert((id, part), time);
            let ton = self.aig.and(input, late);
            match part {
                ActionPart::L | ActionPart::SL => ways.push(self.aig.and(input, !ton)),
                ActionPart::D | ActionPart::SD => ways.push(ton),
                ActionPart::DS => {
                    let either = self.aig.or(state.latches[&(id, ActionPart::DS)], ton);
                    let latch = self.aig.and(!reset, either);
                    state.latches.insert((id, ActionPart::DS), latch);
                    ways.push(latch);
                }
                ActionPart::S
                | ActionPart::P
                | ActionPart::P0
                | ActionPart::P1
                | ActionPart::DSHeld => {}
            }
        }
        for (qualifier, part) in [
            (Qualifier::P, ActionPart::P),
            (Qualifier::P1, ActionPart::P1),
            (Qualifier::P0, ActionPart::P0),
        ] {
            if let Some(now) = asks(qualifier) {
                let old = state.latches[&(id, part)];
                ways.push(if part == ActionPart::P0 {
                    self.aig.and(old, !now)
                } else {
                    self.aig.and(now, !old)
                });
                state.latches.insert((id, part), now);
            }
        }
        let any = self.aig.or_all(ways);
        self.aig.and(!reset, any)
    }

    /// Step E2. For each task index, the tasks that fit in the budget are known in advance.
    fn tasks(&mut self, state: &mut State) {
        let net = self.net;
        for (id, step) in net.steps.iter() {
            let Some(mut index) = state.task[id.index()].clone() else { continue };
            let n = step.tasks.len();
            let end_from = |start: usize| {
                let mut rest = step.budget;
                let mut at = start;
                while at < n && step.tasks[at].cost <= rest {
                    rest -= step.tasks[at].cost;
                    at += 1;
                }
                at
            };
            let ended = self.part_has_ended(state, step.part);
            let active = self.aig.and_all([state.active[id.index()], !ended, !self.waits]);
            let locks: Vec<Lit> = (step.locks.iter())
                .map(|lock| match state.vars[lock.index()].first() {
                    Some(Value::Flag(held)) => *held,
                    Some(Value::Number(_)) | None => unreachable!("locks are plain and Boolean"),
                })
                .collect();
            let locked = self.aig.or_all(locks);
            let starts: Vec<Lit> = (0..=n)
                .map(|start| {
                    let here = self.equals(&index, start);
                    let runs = self.aig.and(active, here);
                    if start == 0 { self.aig.and(runs, !locked) } else { runs }
                })
                .collect();
            for (at, task) in step.tasks.iter().enumerate() {
                let ways =
                    (0..=at).filter(|start| at < end_from(*start)).map(|start| starts[start]);
                let ways: Vec<Lit> = ways.collect();
                let runs = self.aig.or_all(ways);
                // The task sees the index after itself: `s.done` is true in the last one.
                let mut after = index.clone();
                self.set(runs, &mut after, &Number::constant(at as i64 + 1));
                state.task[id.index()] = Some(after.clone());
                self.block(state, runs, &task.body);
                index = after;
            }
        }
    }

    /// Step E4: the outputs of a state, without mealy ones. Calls in lists are those of the last reaction.
    pub(super) fn outputs(&mut self, state: &State) -> Vec<Vec<Lit>> {
        let net = self.net;
        let mut all = Vec::new();
        let emergency = self.emergency(state);
        self.called = self.calls.clone();
        for (id, output) in net.outputs.iter() {
            let code = match &output.driver {
                Driver::Continuous(emissions) => vec![self.continuous(state, id, emissions)],
                Driver::Mealy(_) => vec![Lit::FALSE],
                Driver::Fires(transitions) => {
                    // Evolution `Single`: at most one micro-step; none at reset.
                    let fires: Vec<Lit> = (self.fired.first().into_iter())
                        .flat_map(|fired| transitions.iter().map(|id| fired[id.index()]))
                        .collect();
                    all.push(vec![self.aig.or_all(fires)]);
                    continue;
                }
                Driver::Stored(var) => match state.vars[var.index()].first().cloned() {
                    Some(Value::Flag(lit)) => vec![lit],
                    Some(Value::Number(number)) => {
                        number.code(&mut self.aig, output.ty.bounds().0, output.ty.bits())
                    }
                    None => Vec::new(),
                },
                Driver::Controlled(action) => vec![state.q[action.index()]],
                Driver::Extern { calls, .. } => {
                    self.continuous_calls(state, id, calls, emergency);
                    let own = self.called.iter().filter(|call| call.output == id);
                    let ways: Vec<Lit> = own.map(|call| call.when).collect();
                    all.push(vec![self.aig.or_all(ways)]);
                    continue;
                }
            };
            all.push(self.forced(output, code, emergency));
        }
        all
    }

    /// The call of a continuous extern action: that of the first active step whose condition is true, if there is no emergency [C22].
    fn continuous_calls(
        &mut self,
        state: &State,
        output: OutputId,
        calls: &[ExternCall],
        emergency: Lit,
    ) {
        let mut calls: Vec<&ExternCall> = calls.iter().collect();
        sort_by_rank(&mut calls, |call| [call.step.index() as u64]);
        let mut asks = Vec::new();
        for call in &calls {
            let condition =
                call.condition.as_ref().map_or(Lit::TRUE, |condition| self.flag(state, condition));
            let had_ended = self.part_had_ended(self.net.steps[call.step].part);
            let active = state.active[call.step.index()];
            asks.push(self.aig.and_all([active, condition, !had_ended]));
        }
        if calls.first().is_some_and(|first| first.arguments.is_empty()) {
            let any = self.aig.or_all(asks);
            let when = self.aig.and_all([any, !emergency, !self.waits]);
            self.called.push(Call { output, when, arguments: Vec::new() });
            return;
        }
        let mut free = self.aig.and(!emergency, !self.waits);
        for (call, asks) in calls.into_iter().zip(asks) {
            let when = self.aig.and(free, asks);
            let call = self.call(state, when, output, &call.arguments);
            self.called.push(call);
            free = self.aig.and(free, !asks);
        }
    }

    /// The value of a continuous output: charts that have ended contribute what they showed when they ended [C20].
    fn continuous(&mut self, state: &State, output: OutputId, emissions: &[Emission]) -> Lit {
        let mut ways = Vec::new();
        for emission in emissions {
            let ended = self.part_has_ended(state, self.net.steps[emission.step].part);
            let mut value = self.emitted(state, std::slice::from_ref(emission));
            if emission.condition.as_ref().is_some_and(|condition| self.net.asks(condition)) {
                value = self.aig.and(value, !self.waits);
            }
            ways.push(self.aig.and(value, !ended));
        }
        for ((own, chart), kept) in &state.kept {
            if *own == output {
                ways.push(self.aig.and(*kept, state.ended[chart]));
            }
        }
        self.aig.or_all(ways)
    }

    /// Whether the emergency condition is true in a state, with the current inputs.
    pub(super) fn emergency(&mut self, state: &State) -> Lit {
        let net = self.net;
        match &net.emergency {
            Some(emergency) => self.flag(state, &emergency.condition),
            None => Lit::FALSE,
        }
    }

    /// The code of an output, or of its safe value if `emergency` is true.
    pub(super) fn forced(&mut self, output: &Output, code: Vec<Lit>, emergency: Lit) -> Vec<Lit> {
        if emergency == Lit::FALSE {
            return code;
        }
        let (lo, bits) = (output.ty.bounds().0, output.ty.bits());
        let safe = if output.ty.is_bool() {
            vec![if output.safe_value() == 0 { Lit::FALSE } else { Lit::TRUE }]
        } else {
            Number::constant(output.safe_value()).code(&mut self.aig, lo, bits)
        };
        code.into_iter()
            .zip(safe)
            .map(|(bit, safe)| {
                let kept = self.aig.and(bit, !emergency);
                let set = self.aig.and(safe, emergency);
                self.aig.or(kept, set)
            })
            .collect()
    }
}
