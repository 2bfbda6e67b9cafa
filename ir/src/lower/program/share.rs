//! Steps that exclude each other share one timer.
//!
//! ```text
//! a.t, b.t, c.t            light.time
//! if a { a.t += dt } ..    if a or b or c { light.time += dt }       L2
//! a left: a.t := 0 ..      a, b or c left: light.time := 0           F2
//! a.t >= 3                 a and light.time >= 3
//! ```
//! `s.t` is 0 while s is inactive (semantics §7), and at most one step of the group is active, so the register has the time of that step whenever the step's
//! bit is set. A micro-step that leaves one step of the group and enters another clears the register at F2, before any list of F4 runs; one that leaves and
//! re-enters the same step does the same. A step that stays active is not left, and while it is active no other step of the group is.
//!
//! The register saturates one above the largest constant of all its steps. A comparison with a smaller constant has the same result.
//!
//! `s.T` keeps its value while its step is inactive, so it never shares a timer. Neither do the timers of controlled actions: they are not restarted with the step
//! (§3.5), and latches keep some of them running after the step was left.

use super::{Builder, cell};
use crate::arena::{Arena, IdMap};
use crate::expr::{Expr as GenericExpr, ExprKind, Type};
use crate::facts::Facts;
use crate::net::{self, Net, Step, StepId};
use crate::plan::Needs;
use crate::program::{Cell, CellId, Expr, Leaf, Origin, SharedTimer};

/// The timers that steps of a net can share, as proved: for each, at least two steps that exclude each other and whose time is read. Each step belongs to at
/// most one; timers that save the most bits are formed first.
#[must_use]
pub fn shared_timers(net: &Net, facts: &Facts) -> Vec<SharedTimer> {
    let caps = Needs::of(net, false).elapsed;
    let mut timed: Vec<(StepId, i64)> =
        caps.iter().filter_map(|(step, cap)| Some((step, (*cap)?))).collect();
    // A step that joins a timer with a larger cap saves all of its bits, so the widest come first.
    timed.sort_by_key(|(step, cap)| (std::cmp::Reverse(n_bits(*cap)), *step));
    let mut groups: Vec<Vec<(StepId, i64)>> = Vec::new();
    for (step, cap) in timed {
        let may_join = |group: &Vec<(StepId, i64)>| {
            group.iter().all(|(other, _)| facts.exclude(net, step, *other))
        };
        match groups.iter_mut().find(|group| may_join(group)) {
            Some(group) => group.push((step, cap)),
            None => groups.push(vec![(step, cap)]),
        }
    }
    groups.retain(|group| group.len() > 1);
    for group in &mut groups {
        group.sort_unstable();
    }
    groups.sort_unstable();
    let part = |group: &[(StepId, i64)]| {
        let part = net.steps[group[0].0].part;
        group.iter().all(|(step, _)| net.steps[*step].part == part).then_some(part)
    };
    let parts: Vec<_> = groups.iter().map(|group| part(group)).collect();
    let named = groups.into_iter().enumerate().map(|(at, steps)| {
        let is_only = parts.iter().filter(|part| **part == parts[at]).count() == 1;
        let name = match parts[at].filter(|_| is_only) {
            Some(part) => format!("{}.time", net.parts[part].name),
            None => format!("{}.group.time", net.steps[steps[0].0].name),
        };
        let all: Vec<StepId> = steps.iter().map(|(step, _)| *step).collect();
        let is_always = facts.invariants.iter().any(|it| it.count == 1 && it.steps == all);
        let cap = steps.iter().map(|(_, cap)| *cap).max().unwrap_or(1);
        SharedTimer { name, steps, cap, is_always }
    });
    named.collect()
}

/// The number of bits of a timer.
fn n_bits(cap: i64) -> u32 {
    Type::Int { lo: 0, hi: cap }.bits()
}

/// The cell of each step's time.
pub(super) struct Times {
    pub(super) cell: IdMap<Step, Option<CellId>>,
    is_shared: IdMap<Step, bool>,
}

impl Times {
    pub(super) fn of(
        net: &Net,
        needs: &Needs,
        shared: &[SharedTimer],
        cells: &mut Arena<Cell>,
    ) -> Self {
        let mut push = |name: String, cap: i64, origin: Origin| {
            let ty = Type::Int { lo: 0, hi: cap };
            cells.push(Cell::plain(name, ty, origin))
        };
        let mut times = Times {
            cell: IdMap::filled(&net.steps, None),
            is_shared: IdMap::filled(&net.steps, false),
        };
        for (id, step) in net.steps.iter() {
            if times.cell[id].is_some() {
                continue;
            }
            let timer = shared.iter().find(|timer| timer.steps.iter().any(|(one, _)| *one == id));
            let Some(timer) = timer else {
                times.cell[id] = needs.elapsed[id]
                    .map(|cap| push(format!("{}.t", step.name), cap, Origin::Elapsed(id)));
                continue;
            };
            let shared = push(timer.name.clone(), timer.cap, Origin::SharedElapsed(id));
            for (step, _) in &timer.steps {
                times.cell[*step] = Some(shared);
                times.is_shared[*step] = true;
            }
        }
        times
    }

    /// The register that the step shares with others.
    pub(super) fn shared(&self, step: StepId) -> Option<CellId> {
        self.cell[step].filter(|_| self.is_shared[step])
    }
}

impl Builder<'_> {
    /// `s.t` at this point of the program; `is_active` is true if the step is known to be active here.
    pub(super) fn time_of(&self, step: StepId, is_active: bool) -> Expr {
        let Some(ticks) = self.times.cell[step] else { return Expr::int(0) };
        if is_active || self.times.shared(step).is_none() {
            return cell(ticks);
        }
        super::lists::select(self.is_active(step), cell(ticks), Expr::int(0))
    }

    /// The condition under which a step's timer runs at Latch; a shared timer is given once, for all of its steps.
    pub(super) fn running(&self, step: StepId, ticks: CellId) -> Option<Expr> {
        let runs = |step: StepId| {
            let goes_on = self.has_ended(self.net.steps[step].part).map(Expr::not);
            Expr::and([self.is_active(step)].into_iter().chain(goes_on))
        };
        if self.times.shared(step) != Some(ticks) {
            return Some(runs(step));
        }
        let sharing = || self.net.steps.ids().filter(|one| self.times.cell[*one] == Some(ticks));
        (sharing().next() == Some(step)).then(|| {
            let timer = self.shared.iter().find(|timer| timer.steps[0].0 == step);
            let can_end = sharing().any(|one| self.has_ended(self.net.steps[one].part).is_some());
            if timer.is_some_and(|timer| timer.is_always) && !can_end {
                return Expr::bool(true);
            }
            Expr::or(sharing().map(runs))
        })
    }
}

/// The expression with each choice between a value and a constant resolved where it is compared: `(s ? t : 0) >= 3` is `s and t >= 3`.
pub(super) fn resolved(mut expr: Expr) -> Expr {
    let mut operands: Vec<Expr> = Vec::new();
    for operand in expr.children_mut() {
        operands.push(std::mem::replace(operand, GenericExpr::int(0)));
    }
    let mut done = operands.into_iter().map(resolved);
    for operand in expr.children_mut() {
        if let Some(own) = done.next() {
            *operand = own;
        }
    }
    let ExprKind::Compare(op, a, b) = &expr.kind else { return expr };
    let (choice, other, is_left) = match (&a.kind, &b.kind) {
        (ExprKind::Select(..), ExprKind::Int(value)) => (a, *value, true),
        (ExprKind::Int(value), ExprKind::Select(..)) => (b, *value, false),
        _ => return expr,
    };
    let ExprKind::Select(condition, value, otherwise) = &choice.kind else { return expr };
    let ExprKind::Int(otherwise) = otherwise.kind else { return expr };
    if !matches!(condition.kind, ExprKind::Leaf(Leaf::Cell(_))) {
        return expr;
    }
    let constant = Expr::int(other);
    let value = (**value).clone();
    let (compared, idle) = if is_left {
        (Expr::compare(*op, value, constant), op.apply(otherwise, other))
    } else {
        (Expr::compare(*op, constant, value), op.apply(other, otherwise))
    };
    let condition = (**condition).clone();
    if idle { Expr::or([condition.not(), compared]) } else { Expr::and([condition, compared]) }
}

/// The step whose `s.t` the leaf reads; `None` for any other leaf.
pub(super) fn elapsed(leaf: net::Leaf) -> Option<StepId> {
    if let net::Leaf::Elapsed(step) = leaf { Some(step) } else { None }
}
