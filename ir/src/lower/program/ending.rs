//! Start and end of a reaction: the update of timers in Latch (§3.1), and controlled actions, tasks, free timers and outputs after the evolution (§3.8).

use std::collections::BTreeMap;

use super::{Builder, cell, temp, when};
use crate::arena::IdMap;
use crate::expr::{ArithOp, CompareOp, Expr as GenericExpr, ExprKind, Type};
use crate::net::{
    ActionId, ControlledAction, Driver, Emission, ExternCall, Output, OutputId, PartId, Qualifier,
    Transition,
};
use crate::program::{ActionPart, CellId, Expr, Leaf, Origin, Stmt, TempRole};
use crate::simplify::simplify;
use crate::span::Span;

/// The results of ACTION_CONTROL for all actions.
pub(super) struct Controlled {
    /// Q of each action.
    pub(super) q: IdMap<ControlledAction, Expr>,
    /// The bodies that run, in order, each with its condition.
    pub(super) runs: Vec<(ActionId, Expr)>,
}

/// Outputs that are evaluated before the situation changes, with their values in this reaction.
pub(super) type Mealy = BTreeMap<OutputId, Expr>;

fn plus(id: CellId, ticks: Expr) -> Expr {
    GenericExpr::new(
        ExprKind::Arith(ArithOp::Add, Box::new(cell(id)), Box::new(ticks)),
        Span::default(),
    )
}

fn dt() -> Expr {
    Expr::leaf(Leaf::Dt, Span::default())
}

fn at_least(id: CellId, ticks: u32) -> Expr {
    Expr::compare(CompareOp::Ge, cell(id), Expr::int(i64::from(ticks)))
}

/// The value of an output, or its safe value during an emergency.
fn forced(value: Expr, output: &Output, emergency: Option<&Expr>) -> Expr {
    let Some(emergency) = emergency.cloned() else { return value };
    simplify(&output.forced(value, emergency))
}

/// The cell with the last input of a part's timer: with SD and SL it is the latch before the timer.
fn held_of(part: ActionPart) -> ActionPart {
    if part == ActionPart::DS { ActionPart::DSHeld } else { part }
}

impl Builder<'_> {
    /// Adds the cells of controlled actions: Q if it is read later, and the memory of the standard's block for the qualifiers in use.
    pub(super) fn action_cells(&mut self) {
        let net = self.net;
        for (id, action) in net.actions.iter() {
            let has_final_scan = net.settings.final_scan && !action.body.is_empty();
            // On a chip, Q of an output that an emergency forces is stored in a flip-flop, so that the pin is a function of the state after the clock edge.
            let is_forced = net.emergency.is_some()
                && net.outputs.values().any(|output| output.driver == Driver::Controlled(id));
            let statechart = net.settings.policy.is_statechart();
            // In a round without END, it is the Q of an earlier one.
            let is_kept = net.ending.is_some();
            if self.needs.controlled[id] || has_final_scan || statechart || is_forced || is_kept {
                let q = self.new_cell(action.name.text.clone(), Type::Bool, Origin::ActionQ(id));
                self.action_q[id] = Some(q);
            }
            let used = |it: &Qualifier| action.uses.iter().any(|one| one.qualifier == *it);
            let mut used: Vec<Qualifier> = Qualifier::ALL.into_iter().filter(used).collect();
            used.sort_by_key(|it| it.stores().next());
            for qualifier in used {
                // The stored bits: the latch, the last input of a pulse, or whether the timer's input was true.
                for (at, part) in qualifier.stores().enumerate() {
                    let name = format!("{}.{}", action.name, part.name().replace('-', "."));
                    let origin = Origin::ActionLatch(id, part);
                    let latch = self.new_cell(name.clone(), Type::Bool, origin);
                    self.action_latch.insert((id, part), latch);
                    if at == 0 && qualifier.is_timed() {
                        let ty = Type::Int { lo: 0, hi: i64::from(action.duration) };
                        let origin = Origin::ActionTimer(id, part);
                        let timer = self.new_cell(format!("{name}.time"), ty, origin);
                        self.action_time.insert((id, part), timer);
                    }
                }
            }
        }
    }

    /// L2 without mealy outputs and sends: all timers advance.
    pub(super) fn latch(&mut self, out: &mut Vec<Stmt>) {
        for (step, _) in self.net.steps.iter() {
            let counters = [self.times.cell[step], self.last_elapsed[step]];
            for id in counters.into_iter().flatten() {
                if let Some(running) = self.running(step, id) {
                    when(running, vec![Stmt::Store(id, None, plus(id, dt()))], out);
                }
            }
        }
        self.advance_timers(out);
    }

    /// The part of L2 that does not depend on steps: free timers and the timers of controlled actions advance.
    pub(super) fn advance_timers(&self, out: &mut Vec<Stmt>) {
        let running = self.all_ended().map_or_else(|| Expr::bool(true), Expr::not);
        for (ticks, runs) in self.timer.values().flatten() {
            when(
                Expr::and([cell(*runs), running.clone()]),
                vec![Stmt::Store(*ticks, None, plus(*ticks, dt()))],
                out,
            );
        }
        for ((id, part), time) in &self.action_time {
            if let Some(held) = self.action_latch.get(&(*id, held_of(*part))) {
                let running = self.action_stops(*id).map(Expr::not);
                let condition = Expr::and([cell(*held)].into_iter().chain(running));
                when(condition, vec![Stmt::Store(*time, None, plus(*time, dt()))], out);
            }
        }
    }

    /// Mealy outputs: evaluated before the micro-step; at reset, together with the others.
    pub(super) fn mealy_outputs(&mut self, out: &mut Vec<Stmt>) -> Mealy {
        let mut mealy = Mealy::new();
        let net = self.net;
        if !net.outputs.values().any(|output| matches!(output.driver, Driver::Mealy(_))) {
            return mealy;
        }
        let emergency = self.emergency(out);
        for (id, output) in net.outputs.iter() {
            if let Driver::Mealy(emissions) = &output.driver {
                let value = forced(self.emitted(emissions), output, emergency.as_ref());
                let value = self.named(output.name.text.clone(), TempRole::Helper, value, out);
                mealy.insert(id, value);
            }
        }
        mealy
    }

    /// Outputs that show that a transition fires, or one of several: evaluated before the situation changes, like mealy outputs.
    pub(super) fn shown_firings(
        &mut self,
        fire: &IdMap<Transition, Expr>,
        mealy: &mut Mealy,
        out: &mut Vec<Stmt>,
    ) {
        for (id, output) in self.net.outputs.iter() {
            if let Driver::Fires(transitions) = &output.driver {
                let name = output.name.text.clone();
                let value = Expr::or(transitions.iter().map(|id| fire[*id].clone()));
                let value = self.named(name, TempRole::Helper, value, out);
                mealy.insert(id, value);
            }
        }
    }

    /// END of §3.9: E1 to E4. Nothing is executed for charts that have ended [C20].
    pub(super) fn end(&mut self, mealy: Mealy, out: &mut Vec<Stmt>) {
        let mut last = Vec::new();
        let q = self.controlled_actions(&mut last);
        self.tasks(&mut last);
        self.free_timers(&mut last);
        when(self.is_last(), last, out);
        let mealy = if self.reset { self.mealy_outputs(out) } else { mealy };
        self.outputs(&mealy, &q, out);
        for (step, data) in self.net.steps.iter() {
            let texts = data.code.iter().cloned().map(Stmt::Code).collect();
            when(self.is_active(step), texts, out);
        }
    }

    /// Notes whether something fires, before the situation changes, if END waits for a round in which nothing does (§10.2).
    pub(super) fn note_waiting(&mut self, fire: &IdMap<Transition, Expr>, out: &mut Vec<Stmt>) {
        let Some(ending) = &self.net.ending else { return };
        let own = fire.values().filter(|_| ending.is_quiet).cloned();
        let waits = Expr::or([self.read(&ending.waits)].into_iter().chain(own));
        self.now.waits = Some(self.named("waits", TempRole::Helper, waits, out));
    }

    /// False in a round whose END waits for a later one. The END of a reset never waits.
    fn is_last(&self) -> Expr {
        let waits = self.now.waits.clone().filter(|_| !self.reset);
        waits.map_or_else(|| Expr::bool(true), |waits| simplify(&waits.not()))
    }

    /// True if all charts that use the action have ended; `None` if this is impossible.
    fn action_stops(&self, id: ActionId) -> Option<Expr> {
        let mut all = Vec::new();
        for one in &self.net.actions[id].uses {
            all.push(self.has_ended(self.net.steps[one.step].part)?);
        }
        (!all.is_empty()).then(|| simplify(&Expr::and(all)))
    }

    /// Records which charts had ended before this reaction.
    pub(super) fn note_ended(&mut self, out: &mut Vec<Stmt>) {
        for (part, data) in self.net.parts.iter() {
            if let Some(ended) = self.ended[part] {
                let name = format!("{}.had_ended", data.name);
                self.now.had_ended[part] =
                    Some(self.named(name, TempRole::Helper, cell(ended), out));
            }
        }
    }

    /// True if the emission of a step counts: its chart had not ended before this reaction.
    fn counts(&self, step: crate::net::StepId) -> Expr {
        let chart = self.ranks.chart_of(self.net.steps[step].part);
        self.now.had_ended[chart].clone().map_or_else(|| Expr::bool(true), Expr::not)
    }

    /// Cells that store the contribution of an ended chart to an output.
    pub(super) fn held_cells(&mut self) {
        let net = self.net;
        for (id, output) in net.outputs.iter() {
            let Driver::Continuous(emissions) = &output.driver else { continue };
            for emission in emissions {
                let chart = self.ranks.chart_of(net.steps[emission.step].part);
                if self.ended[chart].is_some() && !self.held.contains_key(&(id, chart)) {
                    let name = format!("{}.held", output.name);
                    let held = self.new_cell(name, Type::Bool, Origin::HeldOutput(id, chart));
                    self.held.insert((id, chart), held);
                }
            }
        }
    }

    /// E1: the three passes of §3.5. Returns Q of each action.
    pub(super) fn controlled_actions(
        &mut self,
        out: &mut Vec<Stmt>,
    ) -> IdMap<ControlledAction, Expr> {
        let controlled = self.action_controls(|_| false, out);
        for (id, condition) in controlled.runs {
            let body = self.list(&self.net.actions[id].body);
            when(condition, body, out);
        }
        controlled.q
    }

    /// Pass (1) of §3.5, and the bodies that passes (2) and (3) run. Q of an action that is `plain` is a Boolean function of step bits, and only the body of
    /// this action uses it; no value is named for it.
    pub(super) fn action_controls(
        &mut self,
        is_plain: impl Fn(ActionId) -> bool,
        out: &mut Vec<Stmt>,
    ) -> Controlled {
        let net = self.net;
        let mut q = IdMap::filled(&net.actions, Expr::bool(false));
        let mut on = q.clone();
        let mut fell: Vec<(ActionId, Expr)> = Vec::new();
        for (id, action) in net.actions.iter() {
            if is_plain(id) {
                on[id] = self.action_input(id, Qualifier::N);
                continue;
            }
            let name = action.name.text.clone();
            let stops = self.action_stops(id);
            let mut list = Vec::new();
            let now = self.action_control(id, &mut list);
            let now = self.named(name.clone(), TempRole::Helper, now, &mut list);
            on[id] = self.unless(&stops, &name, now.clone(), &mut list, out);
            q[id] = now.clone();
            if let Some(memory) = self.action_q[id] {
                if net.settings.final_scan && !action.body.is_empty() {
                    let name = format!("{name}.fell");
                    let value = Expr::and([cell(memory), now.clone().not()]);
                    let value = self.named(name.clone(), TempRole::Helper, value, &mut list);
                    fell.push((id, self.unless(&stops, &name, value, &mut list, out)));
                }
                list.push(Stmt::Store(memory, None, now));
                q[id] = cell(memory);
            }
            self.remember_pulses(id, &mut list);
            when(stops.map_or_else(|| Expr::bool(true), Expr::not), list, out);
        }
        let all = net.actions.ids().map(|id| (id, on[id].clone()));
        let runs = fell.into_iter().chain(all).collect();
        Controlled { q, runs }
    }

    /// `value`, which `list` computes, or false if the list does not run because the charts of the action have ended.
    fn unless(
        &mut self,
        stops: &Option<Expr>,
        name: &str,
        value: Expr,
        list: &mut Vec<Stmt>,
        out: &mut Vec<Stmt>,
    ) -> Expr {
        if stops.is_none() {
            return value;
        }
        let id = self.new_temp(format!("{name}.runs"), Type::Bool, TempRole::Helper);
        out.push(Stmt::Set(id, Expr::bool(false)));
        list.push(Stmt::Set(id, value));
        temp(id)
    }

    /// The OR over the steps that use the action with this qualifier.
    fn action_input(&self, id: ActionId, qualifier: Qualifier) -> Expr {
        let uses = self.net.actions[id].uses.iter().filter(|one| one.qualifier == qualifier);
        Expr::or(uses.map(|one| {
            Expr::and([
                self.is_active(one.step),
                self.read_condition(one.condition.as_ref(), one.step),
            ])
        }))
    }

    /// ACTION_CONTROL: updates latches and timers, and returns Q.
    fn action_control(&mut self, id: ActionId, out: &mut Vec<Stmt>) -> Expr {
        let name = self.net.actions[id].name.text.clone();
        let reset = self.action_input(id, Qualifier::R);
        let reset = self.named(format!("{name}.R"), TempRole::Helper, reset, out);
        let latch = |this: &Self, part| this.action_latch.get(&(id, part)).copied();
        let store = |latch, value| {
            Stmt::Store(latch, None, simplify(&Expr::and([reset.clone().not(), value])))
        };
        let mut ways = vec![self.action_input(id, Qualifier::N)];
        for (qualifier, part) in [
            (Qualifier::S, ActionPart::S),
            (Qualifier::SD, ActionPart::SD),
            (Qualifier::SL, ActionPart::SL),
        ] {
            if let Some(latch) = latch(self, part) {
                let value = Expr::or([cell(latch), self.action_input(id, qualifier)]);
                out.push(store(latch, value));
                if part == ActionPart::S {
                    ways.push(cell(latch));
                }
            }
        }
        for part in [ActionPart::L, ActionPart::D, ActionPart::DS, ActionPart::SD, ActionPart::SL] {
            let time = self.action_time.get(&(id, part)).copied();
            let Some((time, held)) = time.zip(latch(self, held_of(part))) else { continue };
            let input = match part {
                ActionPart::L => Some(Qualifier::L),
                ActionPart::D => Some(Qualifier::D),
                ActionPart::DS => Some(Qualifier::DS),
                ActionPart::SD
                | ActionPart::SL
                | ActionPart::S
                | ActionPart::P
                | ActionPart::P0
                | ActionPart::P1
                | ActionPart::DSHeld => None,
            };
            if let Some(qualifier) = input {
                let value = self.action_input(id, qualifier);
                out.push(Stmt::Store(held, None, simplify(&value)));
            }
            let input = cell(held);
            when(input.clone().not(), vec![Stmt::Store(time, None, Expr::int(0))], out);
            let late = at_least(time, self.net.actions[id].duration);
            match part {
                ActionPart::L | ActionPart::SL => {
                    ways.push(Expr::and([input, simplify(&late.not())]))
                }
                ActionPart::D | ActionPart::SD => ways.push(Expr::and([input, late])),
                ActionPart::DS => {
                    if let Some(latch) = latch(self, ActionPart::DS) {
                        let value = Expr::or([cell(latch), Expr::and([input, late])]);
                        out.push(store(latch, value));
                        ways.push(cell(latch));
                    }
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
            if let Some(old) = latch(self, part) {
                let now = self.action_input(id, qualifier);
                ways.push(if part == ActionPart::P0 {
                    Expr::and([cell(old), now.not()])
                } else {
                    Expr::and([now, cell(old).not()])
                });
            }
        }
        Expr::and([reset.not(), Expr::or(ways)])
    }

    /// Stores the inputs of pulses for the comparison in the next reaction. They are evaluated again here: what they read has not changed since Q was computed.
    fn remember_pulses(&mut self, id: ActionId, out: &mut Vec<Stmt>) {
        for (qualifier, part) in [
            (Qualifier::P, ActionPart::P),
            (Qualifier::P1, ActionPart::P1),
            (Qualifier::P0, ActionPart::P0),
        ] {
            if let Some(old) = self.action_latch.get(&(id, part)).copied() {
                let now = self.action_input(id, qualifier);
                out.push(Stmt::Store(old, None, simplify(&now)));
            }
        }
    }

    /// E2: the tasks that fit in the budget, step by step.
    pub(super) fn tasks(&mut self, out: &mut Vec<Stmt>) {
        let net = self.net;
        for (id, step) in net.steps.iter() {
            let Some(index) = self.task[id] else { continue };
            let mut list = Vec::new();
            let budget = i64::from(step.budget);
            let costs: i64 =
                step.tasks.iter().map(|task| i64::from(task.cost)).fold(0, i64::saturating_add);
            // If all tasks fit at once, no counter is needed.
            let rest = (costs > budget).then(|| {
                self.new_temp(
                    format!("{}.rest", step.name),
                    Type::Int { lo: 0, hi: budget },
                    TempRole::Helper,
                )
            });
            if let Some(rest) = rest {
                list.push(Stmt::Set(rest, Expr::int(budget)));
            }
            for (at, task) in step.tasks.iter().enumerate() {
                let at = i64::try_from(at).unwrap_or(i64::MAX);
                let cost = Expr::int(i64::from(task.cost));
                let is_next = Expr::compare(CompareOp::Eq, cell(index), Expr::int(at));
                let fits = rest.map(|rest| Expr::compare(CompareOp::Ge, temp(rest), cost.clone()));
                // A step that holds a lock has already begun; only the first task waits for the locks of others.
                let free = step.locks.iter().map(|lock| cell(self.var[*lock]).not());
                let free: Vec<Expr> = if at == 0 { free.collect() } else { Vec::new() };
                let mut body = vec![Stmt::Store(index, None, Expr::int(at.saturating_add(1)))];
                if let Some(rest) = rest {
                    let left = ExprKind::Arith(ArithOp::Sub, Box::new(temp(rest)), Box::new(cost));
                    body.push(Stmt::Set(rest, Expr::new(left, Span::default())));
                }
                body.extend(self.list(&task.body));
                let runs = Expr::and([is_next].into_iter().chain(free).chain(fits));
                list.push(Stmt::If(runs, body, Vec::new()));
            }
            let running = self.has_ended(step.part).map(Expr::not);
            when(Expr::and([self.is_active(id)].into_iter().chain(running)), list, out);
        }
    }

    /// E3: resets a free timer if its condition is false.
    pub(super) fn free_timers(&mut self, out: &mut Vec<Stmt>) {
        let running = self.all_ended().map_or_else(|| Expr::bool(true), Expr::not);
        for (id, timer) in self.net.timers.iter() {
            let Some((ticks, runs)) = self.timer[id] else { continue };
            let holds = self.read(&timer.condition);
            let mut list = vec![Stmt::Store(runs, None, holds)];
            when(cell(runs).not(), vec![Stmt::Store(ticks, None, Expr::int(0))], &mut list);
            when(running.clone(), list, out);
        }
    }

    /// E4: outputs and calls of continuous extern actions, in declaration order.
    pub(super) fn outputs(
        &mut self,
        mealy: &Mealy,
        q: &IdMap<ControlledAction, Expr>,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        let emergency = self.emergency(out);
        let force = |value: Expr, output: &Output| forced(value, output, emergency.as_ref());
        for (id, output) in net.outputs.iter() {
            match &output.driver {
                Driver::Continuous(emissions) => {
                    let held: Vec<_> = self
                        .held
                        .range((id, PartId::from_index(0))..)
                        .take_while(|((output, _), _)| *output == id)
                        .map(|((_, chart), held)| (*chart, *held))
                        .collect();
                    for (chart, held) in &held {
                        let of_chart = emissions
                            .iter()
                            .filter(|one| self.ranks.chart_of(net.steps[one.step].part) == *chart);
                        let value = simplify(&self.emitted(of_chart));
                        let had = self.now.had_ended[*chart]
                            .clone()
                            .map_or_else(|| Expr::bool(true), Expr::not);
                        let ends = Expr::and(self.has_ended(*chart).into_iter().chain([had]));
                        when(ends, vec![Stmt::Store(*held, None, value)], out);
                    }
                    let kept = held.iter().map(|(_, held)| cell(*held));
                    let value = Expr::or([self.emitted(emissions)].into_iter().chain(kept));
                    let value = self.silent_unless_last(id, emissions, simplify(&value), out);
                    out.push(Stmt::Output(id, force(value, output)));
                }
                Driver::Mealy(_) | Driver::Fires(_) => {
                    out.push(Stmt::Output(
                        id,
                        mealy.get(&id).cloned().unwrap_or_else(|| Expr::bool(false)),
                    ));
                }
                Driver::Stored(var) => {
                    out.push(Stmt::Output(id, force(cell(self.var[*var]), output)));
                }
                Driver::Controlled(action) => {
                    out.push(Stmt::Output(id, force(q[*action].clone(), output)));
                }
                Driver::Extern { calls, .. } => {
                    let mut list = Vec::new();
                    self.continuous_call(id, calls, &mut list);
                    let calls = emergency.clone().map_or_else(|| Expr::bool(true), Expr::not);
                    when(Expr::and([calls, self.is_last()]), list, out);
                }
            }
        }
    }

    /// The value of a continuous output, without the emissions that call a function if END waits: such a round calls no function.
    fn silent_unless_last(
        &mut self,
        id: OutputId,
        emissions: &[Emission],
        value: Expr,
        out: &mut Vec<Stmt>,
    ) -> Expr {
        let net = self.net;
        let last = self.is_last();
        let asks = |one: &&Emission| one.condition.iter().any(|it| net.asks(it));
        let asking = Expr::or(emissions.iter().filter(asks).map(|one| self.is_active(one.step)));
        if last.is_true() || asking.is_false() {
            return value;
        }
        let silent = simplify(&self.emitted(emissions.iter().filter(|one| !asks(one))));
        let shown = self.new_temp(net.outputs[id].name.text.clone(), Type::Bool, TempRole::Helper);
        let called = simplify(&Expr::and([last, asking]));
        out.push(Stmt::If(called, vec![Stmt::Set(shown, value)], vec![Stmt::Set(shown, silent)]));
        temp(shown)
    }

    /// Whether the emergency condition is true in the current state; `None` in a net without an emergency.
    fn emergency(&mut self, out: &mut Vec<Stmt>) -> Option<Expr> {
        let emergency = self.net.emergency.as_ref()?;
        let holds = self.read(&emergency.condition);
        let holds = self.named("emergency", TempRole::Helper, holds, out);
        (!holds.is_false()).then_some(holds)
    }

    /// True if one of the emissions applies: its step is active, its condition is true, and its chart had not ended before this reaction.
    pub(super) fn emitted<'e>(&self, emissions: impl IntoIterator<Item = &'e Emission>) -> Expr {
        Expr::or(emissions.into_iter().map(|emission| {
            let condition = self.read_condition(emission.condition.as_ref(), emission.step);
            Expr::and([self.is_active(emission.step), condition, self.counts(emission.step)])
        }))
    }

    /// Calls a continuous extern action once per reaction, with the arguments of the first calling step in declaration order [C22].
    pub(super) fn continuous_call(
        &mut self,
        id: OutputId,
        calls: &[ExternCall],
        out: &mut Vec<Stmt>,
    ) {
        let mut calls: Vec<&ExternCall> = calls.iter().collect();
        calls.sort_by_key(|call| call.step);
        let asks: Vec<Expr> = calls
            .iter()
            .map(|call| {
                let condition = self.read_condition(call.condition.as_ref(), call.step);
                Expr::and([self.is_active(call.step), condition, self.counts(call.step)])
            })
            .collect();
        let Some(first) = calls.first() else { return };
        if first.arguments.is_empty() {
            when(Expr::or(asks), vec![Stmt::Call(id, Vec::new())], out);
            return;
        }
        let name = self.net.outputs[id].name.text.clone();
        let called = (calls.len() > 1)
            .then(|| self.new_temp(format!("{name}.called"), Type::Bool, TempRole::Helper));
        if let Some(called) = called {
            out.push(Stmt::Set(called, Expr::bool(false)));
        }
        for (at, (call, asks)) in calls.iter().copied().zip(asks).enumerate() {
            let mut body = Vec::new();
            let arguments = call.arguments.iter().map(|argument| self.read(argument)).collect();
            self.call(id, arguments, &mut body);
            let free = called.filter(|_| at > 0).map(|called| temp(called).not());
            if let Some(called) = called.filter(|_| at + 1 < calls.len()) {
                body.push(Stmt::Set(called, Expr::bool(true)));
            }
            when(Expr::and([asks].into_iter().chain(free)), body, out);
        }
    }
}
