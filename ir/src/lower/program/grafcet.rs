//! The evolution outside statecharts: EVOLVE, CHECK and FIRE of §3.9.

use super::change::{Change, forced_charts, initial_situation};
use super::{Builder, cell, temp, when};
use crate::arena::IdMap;
use crate::expr::{ArithOp, CompareOp, Expr as GenericExpr, ExprKind, Type};
use crate::net::{Step, StepId, Transition, TransitionId, TransitionKind};
use crate::plan::is_over_inputs;
use crate::program::{Carried, Expr, Leaf, Stmt, TempRole};
use crate::span::Span;

impl Builder<'_> {
    /// One reaction: REACTION of §3.9.
    pub(super) fn grafcet_reaction(&mut self) -> Vec<Stmt> {
        let mut out = Vec::new();
        self.latch(&mut out);
        let mut mealy = self.mealy_outputs(&mut out);
        self.latch_events(&mut out);
        self.compare_inputs(&mut out);
        match self.limit() {
            None => {
                let mut fire = self.check(&mut out);
                let changes = self.change(&mut fire, &mut out);
                self.shown_firings(&fire, &mut mealy, &mut out);
                self.note_waiting(&fire, &mut out);
                self.fire(&fire, &changes, &mut out);
                self.renew_edges(&mut out);
            }
            Some(limit) => self.evolve(limit, &mut out),
        }
        self.end(mealy, &mut out);
        out
    }

    /// The reset: R2, R3 and R5 of §3.9, from the empty situation.
    pub(super) fn grafcet_reset(&mut self) -> Vec<Stmt> {
        let situation = initial_situation(self.net);
        let older: Vec<_> = self.older.iter().map(|(pair, id)| (*pair, *id)).collect();
        let mut out = Vec::new();
        for ((a, b), id) in older {
            let is_in = |step: StepId| situation.binary_search(&step).is_ok();
            out.push(Stmt::Store(id, None, Expr::bool(!is_in(a) || is_in(b))));
        }
        self.begin_sequence();
        let mut sequence = Vec::new();
        let mut late = Vec::new();
        for step in self.ranks.steps.clone() {
            if situation.binary_search(&step).is_ok() {
                let rise = Stmt::Store(self.step[step], None, Expr::bool(true));
                if self.simultaneous {
                    late.push(rise)
                } else {
                    sequence.push(rise)
                }
                sequence.extend(self.list(&self.net.steps[step].entry));
            }
        }
        sequence.extend(late);
        out.extend(self.end_sequence(sequence));
        self.end(super::ending::Mealy::new(), &mut out);
        out
    }

    /// EVOLVE in mode `stable`. One round is one check; a round that finds something fireable at the limit only sets the fault.
    fn evolve(&mut self, limit: u32, out: &mut Vec<Stmt>) {
        let top = i64::from(limit);
        let count = self.new_temp("micro_steps", Type::Int { lo: 0, hi: top }, TempRole::Helper);
        let again = self.new_temp("again", Type::Bool, TempRole::Helper);
        let fault = self.new_temp("fault", Type::Bool, TempRole::Helper);
        let mut body = Vec::new();
        let mut fire = self.check(&mut body);
        let changes = self.change(&mut fire, &mut body);
        let any = Expr::or(fire.values().cloned());
        if any.is_false() {
            // Nothing can ever fire, so one check is enough.
            out.extend(body);
            self.renew_edges(out);
            out.push(Stmt::Fault(Expr::bool(false)));
            return;
        }
        out.push(Stmt::Set(count, Expr::int(0)));
        out.push(Stmt::Set(again, Expr::bool(true)));
        out.push(Stmt::Set(fault, Expr::bool(false)));
        let any = self.named("any", TempRole::Helper, any, &mut body);
        // An event that makes nothing fire is not pending: only firings count [C11].
        let at_limit = Expr::compare(CompareOp::Eq, temp(count), Expr::int(top));
        body.push(Stmt::Set(fault, Expr::and([at_limit.clone(), any.clone()])));
        body.push(Stmt::Set(again, Expr::and([any, crate::simplify::simplify(&at_limit.not())])));
        let mut step = Vec::new();
        self.fire(&fire, &changes, &mut step);
        for event in self.net.inputs.ids() {
            let Some(GenericExpr { kind: ExprKind::Leaf(Leaf::Temp(holds)), .. }) =
                self.now.holds[event]
            else {
                continue;
            };
            self.carried.push((holds, Carried::Present(event)));
            step.push(Stmt::Set(
                holds,
                self.pending[event].map_or_else(|| Expr::bool(false), cell),
            ));
            if let Some(pending) = self.pending[event] {
                step.push(Stmt::Store(pending, None, Expr::bool(false)));
            }
        }
        let one_more = ExprKind::Arith(ArithOp::Add, Box::new(temp(count)), Box::new(Expr::int(1)));
        step.push(Stmt::Set(count, Expr::new(one_more, Span::default())));
        body.push(Stmt::If(temp(again), step, Vec::new()));
        self.renew_edges(&mut body);
        self.evolution = Some(again);
        self.carried.extend([
            (fault, Carried::Fault),
            (again, Carried::Again),
            (count, Carried::Count),
        ]);
        out.push(Stmt::Repeat { limit: limit.saturating_add(1), condition: temp(again), body });
        out.push(Stmt::Fault(temp(fault)));
    }

    /// L3: the events of this row and those raised since the last check are present now.
    fn latch_events(&mut self, out: &mut Vec<Stmt>) {
        let stable = self.limit().is_some();
        for (event, input) in self.net.inputs.iter() {
            if !input.kind.is_event() {
                continue;
            }
            let row =
                self.is_external(event).then(|| Expr::leaf(Leaf::Input(event), Span::default()));
            let pending = self.pending[event];
            let holds = Expr::or(row.into_iter().chain(pending.map(cell)));
            self.now.holds[event] = Some(if holds.is_false() || !(stable || pending.is_some()) {
                holds
            } else {
                let id = self.new_temp(input.name.text.clone(), Type::Bool, TempRole::Holds(event));
                out.push(Stmt::Set(id, holds));
                temp(id)
            });
            if let Some(pending) = pending {
                out.push(Stmt::Store(pending, None, Expr::bool(false)));
            }
        }
    }

    /// Computes the current values of the operands over inputs, which do not change during the reaction.
    pub(super) fn compare_inputs(&mut self, out: &mut Vec<Stmt>) {
        for (edge, operand) in self.net.edges.iter() {
            if self.needs.edge[edge] && is_over_inputs(operand) {
                let now = self.read(&operand.expr);
                self.now.edge[edge] = Some(if matches!(now.kind, ExprKind::Leaf(_)) {
                    now
                } else {
                    self.named(
                        super::read::name_of_operand(self.net, operand),
                        TempRole::EdgeNow(edge),
                        now,
                        out,
                    )
                });
            }
        }
    }

    /// Computes the current values of all other operands, at a check.
    pub(super) fn compare_others(&mut self, out: &mut Vec<Stmt>) {
        for (edge, operand) in self.net.edges.iter() {
            if self.needs.edge[edge] && !is_over_inputs(operand) {
                let now = self.read(&operand.expr);
                let name = super::read::name_of_operand(self.net, operand);
                self.now.edge[edge] = Some(self.named(name, TempRole::EdgeNow(edge), now, out));
            }
        }
    }

    /// Stores the compared values for the next comparison.
    pub(super) fn renew_edges(&mut self, out: &mut Vec<Stmt>) {
        for edge in self.net.edges.ids() {
            if let (Some(id), Some(now)) = (self.edge[edge], self.now.edge[edge].clone()) {
                out.push(Stmt::Store(id, None, now));
            }
        }
    }

    /// True if the transition is enabled, an event of its list is present, and the receptivity is true.
    pub(super) fn fireable_now(&self, id: TransitionId) -> Expr {
        let transition = &self.net.transitions[id];
        let enabled = transition.requires.iter().map(|step| self.is_active(*step));
        let events = transition.events.iter().filter_map(|event| self.now.holds[*event].clone());
        let trigger = (!transition.events.is_empty()).then(|| Expr::or(events));
        let guard = self.read_with(&transition.guard, &transition.requires);
        Expr::and(enabled.chain(trigger).chain([guard]))
    }

    /// CHECK: the transitions that fire, before this micro-step's own forcing orders.
    fn check(&mut self, out: &mut Vec<Stmt>) -> IdMap<Transition, Expr> {
        let net = self.net;
        self.compare_others(out);
        let contested = self.contested();
        let charts = forced_charts(net);
        let mut is_forced = IdMap::filled(&net.parts, None);
        for chart in &charts {
            let name = chart.parts.first().map_or("", |part| net.parts[*part].name.text.as_str());
            let forces = Expr::or(chart.orders.iter().map(|(step, _)| self.is_active(*step)));
            let forces = self.named(format!("{name}.stands"), TempRole::Helper, forces, out);
            for part in &chart.parts {
                let before = is_forced[*part].take();
                is_forced[*part] = Some(Expr::or(before.into_iter().chain([forces.clone()])));
            }
        }
        // A source transition of an enclosed chart is enabled with the enclosing step [C4].
        let mut around = IdMap::filled(&net.parts, None);
        for step in net.steps.values() {
            if step.parent.is_some() {
                around[step.part] = step.parent;
            }
        }
        let mut fire = IdMap::filled(&net.transitions, Expr::bool(false));
        for (id, transition) in net.transitions.iter() {
            let name = transition.name.text.clone();
            let mut fireable = self.fireable_now(id);
            if transition.requires.is_empty()
                && let Some(step) = around[transition.part]
            {
                fireable = Expr::and([self.is_active(step), fireable]);
            }
            let forced = match transition.kind {
                TransitionKind::Move => is_forced[transition.part].clone(),
                TransitionKind::Reaction => None,
            };
            let is_decided = contested[id].is_empty() && forced.is_none();
            if is_decided {
                fireable = self.named(name, TempRole::Fire(id), fireable, out);
            } else if self.needs.fireable[id] || contested[id].is_empty() {
                fireable =
                    self.named(format!("{name}.fireable"), TempRole::Fireable(id), fireable, out);
            }
            if self.needs.fireable[id] {
                self.now.fireable[id] = Some(fireable.clone());
            }
            fire[id] = Expr::and([fireable].into_iter().chain(forced.map(Expr::not)));
        }
        self.choose(&contested, &mut fire, out);
        fire
    }

    /// FIRE: deactivation, transition actions, activation, and the new situation.
    fn fire(
        &mut self,
        fire: &IdMap<Transition, Expr>,
        changes: &IdMap<Step, Change>,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        let mut changes = changes.clone();
        self.begin_sequence();
        // With simultaneous assignments lists do not see changes, so bits and counters are stored after them.
        let watched =
            IdMap::build(&net.steps, |step, _| self.needs.watched[step] && !self.simultaneous);
        self.name_changes(&mut changes, &watched, out);
        let mut sequence = Vec::new();
        let mut late = Vec::new();
        self.mark(fire, &mut sequence);
        for step in self.ranks.steps.clone() {
            let mut list = self.list(&net.steps[step].exit);
            let mut drop = Vec::new();
            if watched[step] {
                drop.push(Stmt::Store(self.step[step], None, Expr::bool(false)));
            }
            // The task index is 0 on activation; clearing it here gives an inactive step a single state.
            for id in [self.times.cell[step], self.task[step]].into_iter().flatten() {
                drop.push(Stmt::Store(id, None, Expr::int(0)));
            }
            if self.simultaneous {
                when(changes[step].down.clone(), drop, &mut late);
            } else {
                list.extend(drop);
            }
            when(changes[step].down.clone(), list, &mut sequence);
        }
        for id in self.ranks.transitions.clone() {
            let list = self.list(&net.transitions[id].actions);
            when(fire[id].clone(), list, &mut sequence);
        }
        for step in self.ranks.steps.clone() {
            let mut rise = Vec::new();
            if watched[step] {
                rise.push(Stmt::Store(self.step[step], None, Expr::bool(true)));
            }
            if let Some(last) = self.last_elapsed[step] {
                rise.push(Stmt::Store(last, None, Expr::int(0)));
            }
            let list = self.list(&net.steps[step].entry);
            if self.simultaneous {
                when(changes[step].up.clone(), rise, &mut late);
                when(changes[step].up.clone(), list, &mut sequence);
            } else {
                rise.extend(list);
                when(changes[step].up.clone(), rise, &mut sequence);
            }
        }
        sequence.extend(late);
        for ((a, b), id) in &self.older {
            let stays = Expr::and([cell(*id), changes[*a].up.clone().not()]);
            let value = Expr::or([stays, changes[*b].up.clone()]);
            sequence.push(Stmt::Store(*id, None, crate::simplify::simplify(&value)));
        }
        for (step, change) in changes.iter() {
            if let (Some(next), false) = (&change.next, watched[step]) {
                sequence.push(Stmt::Store(self.step[step], None, crate::simplify::simplify(next)));
            }
        }
        out.extend(self.end_sequence(sequence));
    }

    /// Names the changes that are read more than once, or after the step's bit has changed.
    fn name_changes(
        &mut self,
        changes: &mut IdMap<Step, Change>,
        watched: &IdMap<Step, bool>,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        let mut ages = IdMap::filled(&net.steps, 0u32);
        for (a, b) in self.older.keys() {
            ages[*a] += 1;
            ages[*b] += 1;
        }
        for (id, step) in net.steps.iter() {
            let counts = self.last_elapsed[id].is_some();
            let (up_uses, down_uses) = if self.simultaneous {
                let drops = self.times.cell[id].is_some() || self.task[id].is_some();
                (
                    u32::from(counts) + u32::from(!step.entry.is_empty()) + ages[id],
                    u32::from(drops) + u32::from(!step.exit.is_empty()),
                )
            } else {
                (u32::from(counts || watched[id] || !step.entry.is_empty()) + ages[id], 1)
            };
            if up_uses > 1 {
                let up = changes[id].up.clone();
                changes[id].up = self.named(
                    format!("{}.activated", step.name),
                    TempRole::Activated(id),
                    up,
                    out,
                );
            }
            if down_uses > 1 {
                let down = changes[id].down.clone();
                changes[id].down = self.named(
                    format!("{}.deactivated", step.name),
                    TempRole::Deactivated(id),
                    down,
                    out,
                );
            }
        }
    }
}
