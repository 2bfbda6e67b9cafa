//! The evolution of statecharts: EVOLVE-STATECHART of §3.9, the choice of §4, and SCXML's exit, content and entry (§3.3, §5).
//!
//! One round of the loop is one check: without an event, or for the event just taken from a queue. A round that fires nothing takes the next event, or
//! ends.
//!
//! # The choice as a formula
//! semantics.md offers transitions atomic state by atomic state and lets an inner one replace outer ones. Exit sets are whole subtrees, so two of them
//! intersect if and only if one domain contains the other. The result equals processing the sources from the inside out and in document order: an offered
//! transition fires unless one with an intersecting exit set was taken before it. A transition is offered if it is the first fireable one of its source
//! and, from some active atomic state, nothing fireable is on the path (inner-first: up to the source; outer-first: from the root down to it).

use std::collections::BTreeMap;

use super::enter::add;
use super::queues::{External, Queues, is_empty};
use super::tree::Tree;
use super::{Builder, cell, temp, when};
use crate::arena::IdMap;
use crate::expr::{ArithOp, CompareOp, Expr as GenericExpr, ExprKind, Type};
use crate::net::{InputId, PartId, Policy, Step, StepId, StepKind, Transition, TransitionId};
use crate::program::{Expr, Origin, Stmt, TempId, TempRole};
use crate::simplify::simplify;
use crate::span::Span;

/// The counters of an evolution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rounds {
    /// Micro-steps since the last event that restarts the count.
    pub(super) count: TempId,
    /// True if there is another round.
    pub(super) again: TempId,
    /// The number of the current event, 0 for none; `None` if the net has no events.
    pub(super) current: Option<TempId>,
    /// The number of waiting events that restart the count; `None` if nothing is sent, because then every waiting event restarts it.
    pub(super) restarts: Option<TempId>,
}

impl Builder<'_> {
    pub(super) fn statechart_cells(&mut self) {
        self.queue_cells();
        let net = self.net;
        for (id, history) in net.histories.iter() {
            for case in &history.cases {
                let name = format!("{}.{}", history.name, net.steps[case.step].name);
                let recorded = self.new_cell(name, Type::Bool, Origin::Recorded(id, case.step));
                self.recorded.insert((id, case.step), recorded);
            }
        }
        for step in net.steps.values() {
            if step.kind == StepKind::Final && step.parent.is_none() {
                let chart = self.ranks.chart_of(step.part);
                if self.ended[chart].is_none() {
                    let name = format!("{}.ended", net.parts[chart].name);
                    self.ended[chart] = Some(self.new_cell(name, Type::Bool, Origin::Ended(chart)));
                }
            }
        }
        self.held_cells();
    }

    /// One reaction: L1 to L5 of §3.9.
    pub(super) fn statechart_reaction(&mut self) -> Vec<Stmt> {
        let mut out = Vec::new();
        let fault = self.begin_reaction(&mut out);
        self.evolve_statechart(fault, &mut out);
        self.end_reaction(fault, &mut out);
        out
    }

    /// The start of a reaction, L1 to L3 of §3.9; returns the flag that becomes true on a fault.
    pub(super) fn begin_reaction(&mut self, out: &mut Vec<Stmt>) -> TempId {
        self.note_ended(out);
        self.latch(out);
        let fault = self.begin_fault(out);
        let mut latched = Vec::new();
        self.latch_queues(&mut latched);
        match self.all_ended() {
            // The temporaries of row events are always set, so that each has a value.
            Some(all)
                if !matches!(
                    self.queues.as_ref().map(|queues| &queues.external),
                    Some(External::Row(_))
                ) =>
            {
                when(all.not(), latched, out);
            }
            Some(_) | None => out.extend(latched),
        }
        self.compare_inputs(out);
        fault
    }

    /// The end of a reaction: L5 of §3.9.
    pub(super) fn end_reaction(&mut self, fault: TempId, out: &mut Vec<Stmt>) {
        self.end(super::ending::Mealy::new(), out);
        out.push(Stmt::Fault(temp(fault)));
    }

    /// The reset: R3 to R5 of §3.9.
    pub(super) fn statechart_reset(&mut self) -> Vec<Stmt> {
        let mut out = Vec::new();
        let fault = self.begin_fault(&mut out);
        self.latch_queues(&mut out);
        let mut entries = self.no_entries();
        for part in self.net.parts.values() {
            for enter in &part.initial {
                add(&mut entries, *enter, &Expr::bool(true));
            }
        }
        self.resolve_histories(&mut entries, &mut out);
        let exits = IdMap::filled(&self.net.steps, Expr::bool(false));
        let silent = IdMap::filled(&self.net.transitions, Expr::bool(false));
        let tree = Tree::of(self.net);
        self.fire_states(&tree, &exits, &silent, &[], &entries, &mut out);
        self.compare_inputs(&mut out);
        self.evolve_statechart(fault, &mut out);
        self.end_reaction(fault, &mut out);
        out
    }

    fn begin_fault(&mut self, out: &mut Vec<Stmt>) -> TempId {
        let fault = self.new_temp("fault", Type::Bool, TempRole::Helper);
        out.push(Stmt::Set(fault, Expr::bool(false)));
        self.now.fault = Some(fault);
        fault
    }

    /// True if all charts have ended; `None` if this is impossible.
    pub(super) fn all_ended(&self) -> Option<Expr> {
        let mut all = Vec::new();
        for step in self.net.steps.values() {
            if step.parent.is_none() {
                all.push(cell(self.ended[self.ranks.chart_of(step.part)]?));
            }
        }
        (!all.is_empty()).then(|| simplify(&Expr::and(all)))
    }

    /// True if the chart of the part has ended, in this reaction or before.
    pub(super) fn has_ended(&self, part: PartId) -> Option<Expr> {
        self.ended[self.ranks.chart_of(part)].map(cell)
    }

    fn evolve_statechart(&mut self, fault: TempId, out: &mut Vec<Stmt>) {
        let net = self.net;
        let limit = self.limit().unwrap_or(1);
        let rounds = self.begin_evolution(out);
        let Rounds { count, again, current, .. } = rounds;
        let mut body = Vec::new();
        self.compare_others(&mut body);
        let tree = Tree::of(net);
        let fireable = self.fireable_in_statechart(current, &mut body);
        let fire = self.choose_in_statechart(&tree, &fireable, &mut body);
        let any = self.named("any", TempRole::Helper, Expr::or(fire.values().cloned()), &mut body);
        let is_full = Expr::compare(CompareOp::Ge, temp(count), Expr::int(i64::from(limit)));
        let too_long = self.too_long(fault, rounds);

        let mut step = Vec::new();
        let entries = self.entries(&fire);
        let exits = self.exits(&tree, &fire, &mut step);
        self.record_histories(&exits, &mut step);
        let mut entries = entries;
        self.resolve_histories(&mut entries, &mut step);
        let order = self.action_order(&tree, &fireable, &mut step);
        self.fire_states(&tree, &exits, &fire, &order, &entries, &mut step);
        step.extend(self.after_micro_step(rounds));
        let fired = vec![Stmt::If(is_full, too_long, step)];
        let idle = self.take_next(rounds);
        if any.is_false() {
            body.extend(idle);
        } else {
            body.push(Stmt::If(any.clone(), fired, idle));
        }
        // A check that fires nothing and is followed by another one does not update the edges (§3.7).
        let mut renew = Vec::new();
        self.renew_edges(&mut renew);
        when(Expr::or([any, temp(again).not()]), renew, &mut body);
        let limit = self.most_rounds(limit);
        self.evolution = Some(again);
        self.carried = self.carried(fault, rounds);
        out.push(Stmt::Repeat { limit, condition: temp(again), body });
    }

    /// Sets the first values of the round counters.
    pub(super) fn begin_evolution(&mut self, out: &mut Vec<Stmt>) -> Rounds {
        let top = i64::from(self.limit().unwrap_or(1));
        let count = self.new_temp("micro_steps", Type::Int { lo: 0, hi: top }, TempRole::Helper);
        let again = self.new_temp("again", Type::Bool, TempRole::Helper);
        let all_ended = self.all_ended();
        out.push(Stmt::Set(count, Expr::int(0)));
        out.push(Stmt::Set(again, all_ended.map_or_else(|| Expr::bool(true), Expr::not)));
        let current = self.begin_events(out);
        let restarts = self.begin_restarts(out);
        Rounds { count, again, current, restarts }
    }

    /// After a micro-step: the next check is without an event; there is none if all charts have ended.
    pub(super) fn after_micro_step(&self, rounds: Rounds) -> Vec<Stmt> {
        let mut out = vec![Stmt::Set(rounds.count, plus_one(rounds.count))];
        if let Some(current) = rounds.current {
            out.push(Stmt::Set(current, Expr::int(0)));
        }
        if let Some(all_ended) = self.all_ended() {
            let mut stop = self.drop_queues();
            stop.push(Stmt::Set(rounds.again, Expr::bool(false)));
            when(all_ended, stop, &mut out);
        }
        out
    }

    /// Runs instead of a micro-step beyond the limit.
    pub(super) fn too_long(&self, fault: TempId, rounds: Rounds) -> Vec<Stmt> {
        let mut out =
            vec![Stmt::Set(fault, Expr::bool(true)), Stmt::Set(rounds.again, Expr::bool(false))];
        out.extend(self.drop_queues());
        out
    }

    /// The number of the current event, 0 for none; `None` if the net has no events.
    fn begin_events(&mut self, out: &mut Vec<Stmt>) -> Option<TempId> {
        let queues = self.queues.as_ref()?;
        if queues.internal.is_none() && matches!(queues.external, External::None) {
            return None;
        }
        let ty = queues.number_type();
        let current = self.new_temp("event", ty, TempRole::Helper);
        out.push(Stmt::Set(current, Expr::int(0)));
        Some(current)
    }

    /// The number of waiting events that restart the count; `None` if nothing is sent, because then every waiting event restarts it.
    fn begin_restarts(&mut self, out: &mut Vec<Stmt>) -> Option<TempId> {
        let queues = self.queues.as_ref()?;
        let External::Queue(queue) = queues.external else { return None };
        if !queues.sends {
            return None;
        }
        let ty = Type::Int { lo: 0, hi: i64::from(queue.bound) };
        let restarts = self.new_temp("restarts", ty, TempRole::Helper);
        out.push(Stmt::Set(restarts, if self.reset { Expr::int(0) } else { cell(queue.length) }));
        Some(restarts)
    }

    /// A bound on the rounds: micro-steps, events taken, and the last empty check.
    pub(super) fn most_rounds(&self, limit: u32) -> u32 {
        let Some(queues) = &self.queues else { return u32::MAX };
        let outside = u64::from(queues.external_bound());
        let inside = queues.internal.map_or(0, |queue| u64::from(queue.bound));
        let steps = (outside + 1).saturating_mul(u64::from(limit));
        let sent = if queues.sends { steps.saturating_mul(outside) } else { 0 };
        let taken = steps
            .saturating_add(1)
            .saturating_mul(inside)
            .saturating_add(outside)
            .saturating_add(sent);
        u32::try_from(steps.saturating_add(taken).saturating_add(1)).unwrap_or(u32::MAX)
    }

    /// A round without effect: takes an internal event; if there is none, an external event; if there is none either, stops.
    pub(super) fn take_next(&mut self, rounds: Rounds) -> Vec<Stmt> {
        let Rounds { count, again, current, restarts } = rounds;
        let mut idle = vec![Stmt::Set(again, Expr::bool(false))];
        let (Some(current), Some(queues)) = (current, self.queues.clone()) else { return idle };
        match &queues.external {
            External::None => {}
            External::Row(events) => idle = take_of_row(events, current, count, again, &queues),
            External::Queue(queue) => {
                let mut taken = Vec::new();
                self.take_first(*queue, current, &mut taken);
                let anew = Stmt::Set(count, Expr::int(0));
                taken.push(match restarts {
                    None => anew,
                    Some(restarts) => {
                        let waits = Expr::compare(CompareOp::Gt, temp(restarts), Expr::int(0));
                        let one = Box::new(Expr::int(1));
                        let less = ExprKind::Arith(ArithOp::Sub, Box::new(temp(restarts)), one);
                        let less = Stmt::Set(restarts, Expr::new(less, Span::default()));
                        Stmt::If(waits, vec![less, anew], Vec::new())
                    }
                });
                idle = vec![Stmt::If(is_empty(*queue), idle, taken)];
            }
        }
        if let Some(queue) = queues.internal {
            let mut taken = Vec::new();
            self.take_first(queue, current, &mut taken);
            idle = vec![Stmt::If(is_empty(queue), idle, taken)];
        }
        idle
    }

    /// F of a check (§3.9): without an event, the transitions that need none; with an event, those that name it [C18].
    fn fireable_in_statechart(
        &mut self,
        current: Option<TempId>,
        out: &mut Vec<Stmt>,
    ) -> IdMap<Transition, Expr> {
        let net = self.net;
        let is = |number: i64| {
            current.map(|current| Expr::compare(CompareOp::Eq, temp(current), Expr::int(number)))
        };
        for event in net.inputs.ids() {
            if let Some(number) = self.queues.as_ref().and_then(|queues| queues.number(event)) {
                let holds = is(number).unwrap_or_else(|| Expr::bool(false));
                let name = net.inputs[event].name.text.clone();
                self.now.holds[event] = Some(self.named(name, TempRole::Holds(event), holds, out));
            }
        }
        let eventless = is(0).unwrap_or_else(|| Expr::bool(true));
        let eventless = self.named("eventless", TempRole::Helper, eventless, out);
        let mut fireable = IdMap::filled(&net.transitions, Expr::bool(false));
        for (id, transition) in net.transitions.iter() {
            let mut now = vec![self.fireable_now(id)];
            if transition.events.is_empty() {
                now.push(eventless.clone());
            }
            let running = self.has_ended(transition.part).map(Expr::not);
            let now = Expr::and(now.into_iter().chain(running));
            let name = format!("{}.fireable", transition.name);
            fireable[id] = self.named(name, TempRole::Fireable(id), now, out);
            self.now.fireable[id] = Some(fireable[id].clone());
        }
        fireable
    }

    /// The choice of the transitions that fire: K4 of §3.9 for statecharts.
    fn choose_in_statechart(
        &mut self,
        tree: &Tree,
        fireable: &IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) -> IdMap<Transition, Expr> {
        let net = self.net;
        let inner_first = net.settings.policy == Policy::InnerFirst;
        // For each state: whether a fireable transition leaves it, and whether one leaves it or a descendant (inner-first) or an ancestor (outer-first).
        let mut own = IdMap::filled(&net.steps, Expr::bool(false));
        for (step, data) in net.steps.iter() {
            let any = Expr::or(tree.leaving[step].iter().map(|id| fireable[*id].clone()));
            own[step] = self.named(format!("{}.leaves", data.name), TempRole::Helper, any, out);
        }
        let mut beyond = own.clone();
        if inner_first {
            for step in &tree.post_order {
                let inside = tree.children[*step].iter().map(|child| beyond[*child].clone());
                let any = Expr::or([own[*step].clone()].into_iter().chain(inside));
                beyond[*step] = self.named(
                    format!("{}.stirs", net.steps[*step].name),
                    TempRole::Helper,
                    any,
                    out,
                );
            }
        } else {
            for (step, data) in net.steps.iter() {
                let around = data.parent.map(|parent| beyond[parent].clone());
                let any = Expr::or([own[step].clone()].into_iter().chain(around));
                beyond[step] =
                    self.named(format!("{}.stirs", data.name), TempRole::Helper, any, out);
            }
        }
        let mut free: IdMap<Step, Option<Expr>> = IdMap::filled(&net.steps, None);
        let mut moved: BTreeMap<StepId, Expr> = BTreeMap::new();
        let mut fire = IdMap::filled(&net.transitions, Expr::bool(false));
        for step in tree.post_order.iter().copied() {
            let offers = if inner_first {
                self.is_free_below(tree, step, &own, &beyond, &mut free, out)
            } else {
                net.steps[step]
                    .parent
                    .map_or_else(|| Expr::bool(true), |parent| beyond[parent].clone().not())
            };
            for (at, id) in tree.leaving[step].iter().enumerate() {
                let earlier =
                    tree.leaving[step][..at].iter().map(|other| fireable[*other].clone().not());
                let mut all = vec![fireable[*id].clone()];
                all.extend(earlier);
                all.push(offers.clone());
                if !net.transitions[*id].clears.is_empty() {
                    let rivals = self.rivals(tree, *id, inner_first, &fire, &mut moved, out);
                    all.extend(rivals.into_iter().map(Expr::not));
                }
                let name = net.transitions[*id].name.text.clone();
                fire[*id] = self.named(name, TempRole::Fire(*id), Expr::and(all), out);
                if let Expr { kind: ExprKind::Leaf(crate::program::Leaf::Temp(temp)), .. } =
                    fire[*id]
                {
                    self.temps[temp].role = TempRole::Fire(*id);
                }
            }
        }
        fire
    }

    /// For an active state: true if, from some active atomic state inside it, nothing fireable is on the path up to that state (itself not included).
    fn is_free_below(
        &mut self,
        tree: &Tree,
        step: StepId,
        own: &IdMap<Step, Expr>,
        beyond: &IdMap<Step, Expr>,
        free: &mut IdMap<Step, Option<Expr>>,
        out: &mut Vec<Stmt>,
    ) -> Expr {
        if !tree.is_wide[step] {
            let inside = tree.children[step].iter().map(|child| beyond[*child].clone());
            return simplify(&Expr::or(inside).not());
        }
        let mut ways = Vec::new();
        for child in &tree.children[step] {
            if free[*child].is_none() {
                // Children come before their parents, so their values are already known.
                let below = self.is_free_below(tree, *child, own, beyond, free, out);
                let active = if self.net.steps[step].kind == StepKind::Parallel {
                    Expr::bool(true)
                } else {
                    self.is_active(*child)
                };
                let value = Expr::and([active, own[*child].clone().not(), below]);
                let name = format!("{}.rests", self.net.steps[*child].name);
                free[*child] = Some(self.named(name, TempRole::Helper, value, out));
            }
            ways.extend(free[*child].clone());
        }
        Expr::or(ways)
    }

    /// Transitions taken before this one whose exit sets intersect its own.
    fn rivals(
        &mut self,
        tree: &Tree,
        id: TransitionId,
        inner_first: bool,
        fire: &IdMap<Transition, Expr>,
        moved: &mut BTreeMap<StepId, Expr>,
        out: &mut Vec<Stmt>,
    ) -> Vec<Expr> {
        let net = self.net;
        let Some(source) = net.transitions[id].requires.first().copied() else { return Vec::new() };
        let mut rivals = Vec::new();
        if inner_first && tree.is_wide[source] {
            for child in &tree.children[source] {
                rivals.push(self.has_moved(tree, *child, fire, moved, out));
            }
        }
        // The transitions in earlier regions of each parallel state on the path up were taken before.
        let mut region = source;
        while let Some(parent) = net.steps[region].parent {
            if net.steps[parent].kind == StepKind::Parallel {
                let leaves_it = tree.leaves(net, id, parent);
                for other in tree.children[parent].iter().take_while(|other| **other != region) {
                    if leaves_it {
                        rivals.push(self.has_moved(tree, *other, fire, moved, out));
                    } else {
                        for rival in tree.within(*other) {
                            if tree.leaves(net, rival, parent) {
                                rivals.push(fire[rival].clone());
                            }
                        }
                    }
                }
            }
            region = parent;
        }
        rivals
    }

    /// True if a transition out of the state or out of a descendant was taken and leaves something.
    fn has_moved(
        &mut self,
        tree: &Tree,
        step: StepId,
        fire: &IdMap<Transition, Expr>,
        moved: &mut BTreeMap<StepId, Expr>,
        out: &mut Vec<Stmt>,
    ) -> Expr {
        if let Some(known) = moved.get(&step) {
            return known.clone();
        }
        let net = self.net;
        let mut all: Vec<Expr> = tree.leaving[step]
            .iter()
            .filter(|id| !net.transitions[**id].clears.is_empty())
            .map(|id| fire[*id].clone())
            .collect();
        for child in &tree.children[step] {
            all.push(self.has_moved(tree, *child, fire, moved, out));
        }
        let name = format!("{}.moves", net.steps[step].name);
        let value = self.named(name, TempRole::Helper, Expr::or(all), out);
        moved.insert(step, value.clone());
        value
    }
}

fn plus_one(id: TempId) -> Expr {
    let sum = ExprKind::Arith(ArithOp::Add, Box::new(temp(id)), Box::new(Expr::int(1)));
    GenericExpr::new(sum, Span::default())
}

/// Takes the next event of the row, in declaration order, without nested choices.
fn take_of_row(
    events: &[(InputId, Option<TempId>)],
    current: TempId,
    count: TempId,
    again: TempId,
    queues: &Queues,
) -> Vec<Stmt> {
    let mut idle = vec![Stmt::Set(current, Expr::int(0))];
    for (event, waits) in events {
        let (Some(waits), Some(number)) = (*waits, queues.number(*event)) else { continue };
        let is_first = Expr::compare(CompareOp::Eq, temp(current), Expr::int(0));
        let taken = vec![
            Stmt::Set(waits, Expr::bool(false)),
            Stmt::Set(current, Expr::int(number)),
            Stmt::Set(count, Expr::int(0)),
        ];
        idle.push(Stmt::If(Expr::and([temp(waits), is_first]), taken, Vec::new()));
    }
    let is_some = Expr::compare(CompareOp::Ne, temp(current), Expr::int(0));
    idle.push(Stmt::Set(again, is_some));
    idle
}
