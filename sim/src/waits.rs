//! What each transition waits for: the conditions of its receptivity that are false in the first check of the next reaction (semantics §3.4).

use grafsynth_ir::expr::{CompareOp, ExprKind};
use grafsynth_ir::net::{Expr, InputId, Leaf, StepId, Transition, TransitionId};

use crate::evaluate::eval_by;
use crate::reaction::{Trigger, value_of};
use crate::row::InputRow;
use crate::simulator::Simulator;

/// What a transition waits for; at least one of its preceding steps is active.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wait {
    /// The transition, or a reaction of a statechart.
    pub transition: TransitionId,
    /// How far it is from firing.
    pub state: WaitState,
    /// What is missing, in the order of the chart: first steps, then the event, then the factors of the condition.
    pub reasons: Vec<Reason>,
}

/// How far a transition is from firing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaitState {
    /// Some, but not all of its preceding steps are active.
    Near,
    /// It is enabled, and its receptivity is false.
    Enabled,
    /// It is enabled and its receptivity is true, but it does not fire in the first micro-step: the conflict policy prefers another transition, a forcing order
    /// prevents it, or (in a statechart) something else comes first.
    Fireable,
    /// It fires in the first micro-step.
    Fires,
}

/// Something that a transition waits for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reason {
    /// A preceding step that is not active.
    Step(StepId),
    /// One of these events.
    Event(Vec<InputId>),
    /// A time of activity of an active step: `limit` ticks, of which `left` remain from now on.
    Time {
        /// The step.
        step: StepId,
        /// The required ticks.
        limit: i64,
        /// The remaining ticks; at least 1.
        left: i64,
    },
    /// A factor of the receptivity that is false.
    Condition(Expr),
}

impl Simulator<'_> {
    /// What each transition waits for if the next reaction has this input row, in declaration order. Only transitions with an active preceding step, and those
    /// without preceding steps that are enabled, are listed. The simulator does not change.
    #[must_use]
    pub fn waits(&self, input: &InputRow) -> Vec<Wait> {
        let mut next = self.clone();
        let is_statechart = self.net().settings.policy.is_statechart();
        let mut reaction = next.reaction();
        reaction.work.recorder = None;
        reaction.l1_latch(input.dt, &input.values);
        reaction.l2_advance_timers(i64::from(input.dt));
        if is_statechart {
            reaction.l3_queue_events(input.dt, &input.values);
        } else {
            reaction.l3_events_hold(&input.values);
        }
        reaction.evaluate_edge_operands();
        reaction.check(if is_statechart { Trigger::Eventless } else { Trigger::Any });
        let mut ahead = self.clone();
        ahead.step(input);
        let fired = ahead.firings().next().unwrap_or_default();
        let wait = |(id, transition)| {
            let mut wait = self.wait(&next, id, transition)?;
            if fired.contains(&id) {
                wait.state = WaitState::Fires;
            }
            Some(wait)
        };
        self.net().transitions.iter().filter_map(wait).collect()
    }

    fn wait(
        &self,
        next: &Simulator<'_>,
        id: TransitionId,
        transition: &Transition,
    ) -> Option<Wait> {
        let net = self.net();
        let (_, tables, state, work) = next.parts();
        let is_enabled = work.enabled.binary_search(&id).is_ok();
        let missing = |step: &StepId| !state.situation.contains(*step);
        let n_missing = transition.requires.iter().filter(|step| missing(step)).count();
        // All preceding steps of a transition of a chart that has ended may be active.
        if !is_enabled && (n_missing == 0 || n_missing == transition.requires.len()) {
            return None;
        }
        let mut reasons: Vec<Reason> = transition
            .requires
            .iter()
            .filter(|step| missing(step))
            .copied()
            .map(Reason::Step)
            .collect();
        let is_present = |event: &InputId| {
            work.values[event.index()] != 0
                || state.internal.contains(event)
                || state.external.contains(event)
        };
        if !transition.events.is_empty() && !transition.events.iter().any(is_present) {
            reasons.push(Reason::Event(transition.events.clone()));
        }
        let value =
            |leaf: &Leaf, index: Option<i64>| value_of(net, tables, state, work, *leaf, index);
        for factor in transition.guard.factors() {
            if eval_by(factor, &value) != 0 {
                continue;
            }
            reasons.push(match time(factor) {
                // A step that is not active has no time yet.
                Some((step, _)) if missing(&step) && transition.requires.contains(&step) => {
                    continue;
                }
                Some((step, limit)) if !missing(&step) => {
                    Reason::Time { step, limit, left: limit - self.elapsed(step) }
                }
                _ => Reason::Condition(factor.clone()),
            });
        }
        let state = match (n_missing, reasons.is_empty()) {
            (0, true) => WaitState::Fireable,
            (0, false) => WaitState::Enabled,
            _ => WaitState::Near,
        };
        Some(Wait { transition: id, state, reasons })
    }

    /// The ticks since the activation of a step.
    fn elapsed(&self, step: StepId) -> i64 {
        let (_, tables, state, _) = self.parts();
        tables.layout.elapsed(step).map_or(0, |(place, _)| state.cells[place])
    }
}

/// The step and the ticks of a condition like `p2.t >= 300`.
fn time(factor: &Expr) -> Option<(StepId, i64)> {
    let ExprKind::Compare(op, a, b) = &factor.kind else { return None };
    let (leaf, op, limit) = match (&a.kind, &b.kind) {
        (ExprKind::Leaf(leaf), ExprKind::Int(limit)) => (leaf, *op, *limit),
        (ExprKind::Int(limit), ExprKind::Leaf(leaf)) => (leaf, op.mirrored(), *limit),
        _ => return None,
    };
    let Leaf::Elapsed(step) = leaf else { return None };
    match op {
        CompareOp::Ge => Some((*step, limit)),
        CompareOp::Gt => Some((*step, limit.saturating_add(1))),
        CompareOp::Eq | CompareOp::Ne | CompareOp::Lt | CompareOp::Le => None,
    }
}
