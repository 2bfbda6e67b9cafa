//! The next situation outside statecharts: NEXT of §3.9, with enclosing steps, forcing and restart (§3.2, §8).
//!
//! The next bit of a plain step depends only on its transitions and is one expression of their `fire`. Steps in an enclosing step or in a forced chart get
//! a temporary for the next bit, which the hierarchy then corrects from the outside in.

use std::collections::BTreeMap;

use super::lists::select;
use super::{Builder, temp};
use crate::arena::IdMap;
use crate::expr::{ExprKind, Type};
use crate::net::{
    ForcingOrder, Net, PartId, Step, StepId, StepKind, Transition, TransitionId, TransitionKind,
};
use crate::plan::following;
use crate::program::{Expr, Leaf, Stmt, TempId, TempRole};

/// The change of one step in a micro-step.
#[derive(Debug, Clone)]
pub(super) struct Change {
    /// True if the step is activated in the sense of §3.2.
    pub(super) up: Expr,
    /// True if the step is deactivated.
    pub(super) down: Expr,
    /// The bit afterwards; `None` if the bit never changes.
    pub(super) next: Option<Expr>,
}

/// The transitions that enter and leave each step.
#[derive(Debug, Clone)]
pub(super) struct Links {
    leaving: IdMap<Step, Vec<TransitionId>>,
    entering: IdMap<Step, Vec<TransitionId>>,
}

/// A chart that is forced, with the orders for it in declaration order.
#[derive(Debug, Clone)]
pub(super) struct ForcedChart {
    pub(super) parts: Vec<PartId>,
    /// The forcing step and the situation that it requests, closed downwards and sorted; `None` is `hold`.
    pub(super) orders: Vec<(StepId, Option<Vec<StepId>>)>,
}

impl Links {
    pub(super) fn of(net: &Net) -> Self {
        let mut around = Links {
            leaving: IdMap::filled(&net.steps, Vec::new()),
            entering: IdMap::filled(&net.steps, Vec::new()),
        };
        for (id, transition) in net.transitions.iter() {
            if transition.kind == TransitionKind::Move {
                transition.clears.iter().for_each(|step| around.leaving[*step].push(id));
                following(&net.transitions[id]).for_each(|step| around.entering[step].push(id));
            }
        }
        around
    }
}

impl Builder<'_> {
    /// The changes of each step by the transitions that fire. With forcing, transitions of charts that are forced in this micro-step are removed from
    /// `fire`.
    pub(super) fn change(
        &mut self,
        fire: &mut IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) -> IdMap<Step, Change> {
        let net = self.net;
        let around = Links::of(net);
        let forced = forced_charts(net);
        let is_hierarchical = in_hierarchy(net, &forced);
        let mut changes = IdMap::build(&net.steps, |step, _| {
            if is_hierarchical[step] {
                Change { up: Expr::bool(false), down: Expr::bool(false), next: None }
            } else {
                self.plain_change(step, &around, fire)
            }
        });
        let inside: Vec<StepId> =
            outer_first(net).into_iter().filter(|step| is_hierarchical[*step]).collect();
        if inside.is_empty() {
            return changes;
        }
        let mut next: BTreeMap<StepId, TempId> = BTreeMap::new();
        let mut restarted: BTreeMap<StepId, TempId> = BTreeMap::new();
        self.enclosures(&inside, &around, fire, &mut next, &mut restarted, out);
        self.force(&forced, fire, &next, &restarted, out);
        for step in inside {
            let (active, next) = (self.is_active(step), temp(next[&step]));
            let restart = restarted.get(&step).map(|id| temp(*id));
            let up = Expr::and([next.clone(), active.clone().not()]);
            let down = Expr::and([active, next.clone().not()]);
            changes[step] = Change {
                up: Expr::or([up].into_iter().chain(restart.clone())),
                down: Expr::or([down].into_iter().chain(restart)),
                next: Some(next),
            };
        }
        changes
    }

    fn plain_change(&self, step: StepId, around: &Links, fire: &IdMap<Transition, Expr>) -> Change {
        let (leaving, entering) = (&around.leaving[step], &around.entering[step]);
        let active = self.is_active(step);
        let any =
            |ids: &mut dyn Iterator<Item = TransitionId>| Expr::or(ids.map(|id| fire[id].clone()));
        let is_loop = |id: &TransitionId| leaving.contains(id) && entering.contains(id);
        // A loop that fires keeps the step active, even if another transition leaves it; it has no effect on an inactive step.
        let leaves = any(&mut leaving.iter().copied().filter(|id| !is_loop(id)));
        let enters = any(&mut entering.iter().copied());
        let enters_from_outside = any(&mut entering.iter().copied().filter(|id| !is_loop(id)));
        let restart = self.restart(leaving, entering, fire);
        let up = Expr::and([enters_from_outside.clone(), active.clone().not()]);
        let down = Expr::and([leaves.clone(), enters.clone().not()]);
        let next = if leaves.is_false() {
            (!enters_from_outside.is_false()).then(|| Expr::or([active, enters_from_outside]))
        } else {
            Some(Expr::or([Expr::and([active, leaves.not()]), enters]))
        };
        Change { up: Expr::or([up, restart.clone()]), down: Expr::or([down, restart]), next }
    }

    /// True if the step is left and is entered again by a transition with `restart`.
    fn restart(
        &self,
        leaving: &[TransitionId],
        entering: &[TransitionId],
        fire: &IdMap<Transition, Expr>,
    ) -> Expr {
        let (loops, others): (Vec<TransitionId>, Vec<TransitionId>) = entering
            .iter()
            .copied()
            .filter(|id| self.net.transitions[*id].restart)
            .partition(|id| leaving.contains(id));
        let any = |ids: &[TransitionId]| Expr::or(ids.iter().map(|id| fire[*id].clone()));
        Expr::or([any(&loops), Expr::and([any(leaving), any(&others)])])
    }

    /// N1 and N2: computes the next bits from the transitions, then applies clearing and activation links of enclosing steps, outer before inner.
    fn enclosures(
        &mut self,
        inside: &[StepId],
        around: &Links,
        fire: &IdMap<Transition, Expr>,
        next: &mut BTreeMap<StepId, TempId>,
        restarted: &mut BTreeMap<StepId, TempId>,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        // For each enclosing step, three conditions: whether it or a step around it is cleared, whether it clears, and whether it activates its links.
        let mut cleared: BTreeMap<StepId, Expr> = BTreeMap::new();
        let mut clears: BTreeMap<StepId, Expr> = BTreeMap::new();
        let mut links: BTreeMap<StepId, Expr> = BTreeMap::new();
        for step in inside.iter().copied() {
            let name = net.steps[step].name.text.clone();
            let active = self.is_active(step);
            let (leaving, entering) = (&around.leaving[step], &around.entering[step]);
            let any = |ids: &[TransitionId]| Expr::or(ids.iter().map(|id| fire[*id].clone()));
            let mut stays =
                Expr::or([Expr::and([active.clone(), any(leaving).not()]), any(entering)]);
            let mut restart = self.restart(leaving, entering, fire);
            if let Some(parent) = net.steps[step].parent {
                let none = || Expr::bool(false);
                let cleared = cleared.get(&parent).cloned().unwrap_or_else(none);
                stays = Expr::and([stays, cleared.clone().not()]);
                restart = Expr::and([restart, cleared.not()]);
                if net.steps[step].activation_link {
                    let link = links.get(&parent).cloned().unwrap_or_else(none);
                    let clear = clears.get(&parent).cloned().unwrap_or_else(none);
                    stays = Expr::or([stays, link.clone()]);
                    restart = Expr::or([restart, Expr::and([link, clear, active.clone()])]);
                }
            }
            let id = self.new_temp(format!("{name}.next"), Type::Bool, TempRole::NextActive(step));
            out.push(Stmt::Set(id, crate::simplify::simplify(&stays)));
            next.insert(step, id);
            let restart = crate::simplify::simplify(&restart);
            let restart = if restart.is_false() {
                restart
            } else {
                let id = self.new_temp(format!("{name}.restarts"), Type::Bool, TempRole::Helper);
                out.push(Stmt::Set(id, restart));
                restarted.insert(step, id);
                temp(id)
            };
            if net.steps[step].kind == StepKind::Enclosing {
                let stays = temp(id);
                let clear =
                    Expr::and([active.clone(), Expr::or([stays.clone().not(), restart.clone()])]);
                let clear = self.named(format!("{name}.clears"), TempRole::Helper, clear, out);
                let link = Expr::and([stays, Expr::or([active.not(), restart])]);
                let link = self.named(format!("{name}.links"), TempRole::Helper, link, out);
                let outer = net.steps[step].parent.and_then(|parent| cleared.get(&parent).cloned());
                let whole = Expr::or(outer.into_iter().chain([clear.clone()]));
                let whole = self.named(format!("{name}.cleared"), TempRole::Helper, whole, out);
                cleared.insert(step, whole);
                clears.insert(step, clear);
                links.insert(step, link);
            }
        }
    }

    /// K5 and N3 for forced charts, from the top of the hierarchy down: their transitions do not fire, and they get the requested situation.
    fn force(
        &mut self,
        charts: &[ForcedChart],
        fire: &mut IdMap<Transition, Expr>,
        next: &BTreeMap<StepId, TempId>,
        restarted: &BTreeMap<StepId, TempId>,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        for chart in charts {
            let name = chart.parts.first().map_or("", |part| net.parts[*part].name.text.as_str());
            let asked = Expr::or(chart.orders.iter().map(|(step, _)| temp(next[step])));
            // The forcing step's own temporary may still change (a chart may force more than one), so the condition is stored.
            let is_forced = self.new_temp(format!("{name}.forced"), Type::Bool, TempRole::Helper);
            out.push(Stmt::Set(is_forced, asked));
            for (id, transition) in net.transitions.iter() {
                let is_of_chart = chart.parts.contains(&transition.part);
                if is_of_chart && transition.kind == TransitionKind::Move && !fire[id].is_false() {
                    let fires = Expr::and([fire[id].clone(), temp(is_forced).not()]);
                    if let ExprKind::Leaf(Leaf::Temp(candidate)) = fire[id].kind {
                        self.temps[candidate].role = TempRole::Fireable(id);
                    }
                    fire[id] =
                        self.named(transition.name.text.clone(), TempRole::Fire(id), fires, out);
                }
            }
            // Selects the order that applies: the first declared one whose step is active; the last needs no test.
            let mut holds = Vec::new();
            for (at, (step, _)) in chart.orders.iter().enumerate() {
                let condition = temp(next[step]);
                let is_last = at + 1 == chart.orders.len();
                holds.push(if is_last {
                    Expr::bool(true)
                } else {
                    let id = self.new_temp(
                        format!("{}.forces.{name}", net.steps[*step].name),
                        Type::Bool,
                        TempRole::Helper,
                    );
                    out.push(Stmt::Set(id, condition));
                    temp(id)
                });
            }
            for step in outer_first(net) {
                if !chart.parts.contains(&net.steps[step].part) {
                    continue;
                }
                let mut asked = Expr::bool(false);
                for ((_, situation), holds) in chart.orders.iter().zip(&holds).rev() {
                    let bit = match situation {
                        Some(steps) => Expr::bool(steps.binary_search(&step).is_ok()),
                        None => self.is_active(step),
                    };
                    asked = if holds.is_true() { bit } else { select(holds.clone(), bit, asked) };
                }
                if let Some(parent) = net.steps[step].parent {
                    asked = Expr::and([asked, temp(next[&parent])]);
                }
                let value = select(temp(is_forced), asked, temp(next[&step]));
                out.push(Stmt::Set(next[&step], crate::simplify::simplify(&value)));
                if let Some(restart) = restarted.get(&step) {
                    out.push(Stmt::Set(
                        *restart,
                        Expr::and([temp(*restart), temp(is_forced).not()]),
                    ));
                }
            }
        }
    }
}

/// Steps whose next bit depends on more than their transitions: enclosing and enclosed steps, forcing and forced steps.
fn in_hierarchy(net: &Net, forced: &[ForcedChart]) -> IdMap<Step, bool> {
    let mut inside = IdMap::build(&net.steps, |_, step| {
        step.kind == StepKind::Enclosing
            || step.parent.is_some()
            || forced.iter().any(|chart| chart.parts.contains(&step.part))
    });
    for chart in forced {
        chart.orders.iter().for_each(|(step, _)| inside[*step] = true);
    }
    inside
}

/// All steps, each after its enclosing step; otherwise in declaration order.
pub(super) fn outer_first(net: &Net) -> Vec<StepId> {
    let mut depth = IdMap::filled(&net.steps, 0u32);
    // In a valid net parents are declared before their children.
    for (id, step) in net.steps.iter() {
        depth[id] = step.parent.map_or(0, |parent| depth[parent].saturating_add(1));
    }
    let mut steps: Vec<StepId> = net.steps.ids().collect();
    steps.sort_by_key(|step| depth[*step]);
    steps
}

/// A situation with all steps that its enclosing steps have an activation link to, recursively; sorted.
pub(super) fn closure(net: &Net, steps: impl IntoIterator<Item = StepId>) -> Vec<StepId> {
    let mut is_in = IdMap::filled(&net.steps, false);
    steps.into_iter().for_each(|step| is_in[step] = true);
    for step in outer_first(net) {
        let data = &net.steps[step];
        if let Some(parent) = data.parent
            && data.activation_link
            && is_in[parent]
        {
            is_in[step] = true;
        }
    }
    is_in.iter().filter(|(_, is_in)| **is_in).map(|(step, _)| step).collect()
}

/// The forcing orders by forced chart; charts that force others come before these.
pub(super) fn forced_charts(net: &Net) -> Vec<ForcedChart> {
    let mut charts: Vec<ForcedChart> = Vec::new();
    for forcing in &net.forcings {
        let mut parts = forcing.target.clone();
        parts.sort_unstable();
        let situation = match &forcing.order {
            ForcingOrder::Situation(steps) => Some(closure(net, steps.iter().copied())),
            ForcingOrder::Hold => None,
        };
        match charts.iter_mut().find(|chart| chart.parts == parts) {
            Some(chart) => chart.orders.push((forcing.step, situation)),
            None => charts.push(ForcedChart { parts, orders: vec![(forcing.step, situation)] }),
        }
    }
    let mut sorted = Vec::new();
    while !charts.is_empty() {
        let waits_for = |chart: &ForcedChart, other: &ForcedChart| {
            chart.orders.iter().any(|(step, _)| other.parts.contains(&net.steps[*step].part))
        };
        // A valid net has no forcing cycle, so there is always one that waits for no other.
        let free = (0..charts.len()).find(|at| {
            (0..charts.len()).all(|other| other == *at || !waits_for(&charts[*at], &charts[other]))
        });
        sorted.push(charts.remove(free.unwrap_or(0)));
    }
    sorted
}

/// The situation after reset: the initial steps closed downwards, then forced from the top of the hierarchy (R2).
pub(super) fn initial_situation(net: &Net) -> Vec<StepId> {
    let initial = net.steps.iter().filter(|(_, step)| step.is_initial).map(|(id, _)| id);
    let mut is_in = IdMap::filled(&net.steps, false);
    let start = closure(net, initial);
    start.iter().for_each(|step| is_in[*step] = true);
    for chart in forced_charts(net) {
        let Some((_, situation)) = chart.orders.iter().find(|(step, _)| is_in[*step]) else {
            continue;
        };
        let kept = situation.as_ref().unwrap_or(&start);
        for step in outer_first(net) {
            let data = &net.steps[step];
            if chart.parts.contains(&data.part) {
                is_in[step] = kept.binary_search(&step).is_ok()
                    && data.parent.is_none_or(|parent| is_in[parent]);
            }
        }
    }
    is_in.iter().filter(|(_, is_in)| **is_in).map(|(step, _)| step).collect()
}
