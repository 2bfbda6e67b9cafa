//! Transitions that compete for a step: the order in which they are tested, and whether that order selects the same transitions as the policy (§4).

use super::{Plan, receptivity};
use crate::refusal::{Refusal, refuse};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{Expr, Leaf, Net, Policy, Transition, TransitionId};
use grafsynth_ir::plan::{following, urgency};

/// Checks that testing the transitions of a step one after the other, each at its owner, selects the same transitions as the policy.
pub(super) fn competition(net: &Net, plan: &Plan) -> Result<(), Refusal> {
    for step in net.steps.ids() {
        let leaving = &plan.leaving[step];
        for (index, later) in leaving.iter().enumerate() {
            let span = net.transitions[*later].meta.span;
            for earlier in &leaving[..index] {
                match net.settings.policy {
                    // Both fire if both are fireable, so the proof that a component has at most one active step must exclude that.
                    Policy::All => {
                        let excluded = following(&net.transitions[*earlier]).any(|a| {
                            following(&net.transitions[*later])
                                .any(|b| a != b && plan.place[a].0 == plan.place[b].0)
                        });
                        let excluded = excluded
                            || disjoint(net, *earlier, *later)
                            || same_effect(&net.transitions[*earlier], &net.transitions[*later]);
                        if !excluded {
                            return refuse(
                                "two transitions that may fire together from one step",
                                span,
                            );
                        }
                    }
                    Policy::Priority | Policy::PriorityAge => {
                        if net.transitions[*earlier].part != net.transitions[*later].part {
                            return refuse("transitions of two charts that compete", span);
                        }
                        if net.settings.policy == Policy::PriorityAge
                            && urgency(net, *earlier) == urgency(net, *later)
                        {
                            return refuse(
                                "transitions of equal priority that compete by age",
                                span,
                            );
                        }
                    }
                    Policy::InnerFirst | Policy::OuterFirst => {}
                }
            }
        }
    }
    if net.settings.policy == Policy::All {
        return Ok(());
    }
    // A transition is decided at its owner; everything that precedes it at its other steps must be known there.
    for (id, transition) in net.transitions.iter() {
        let Some(owner) = plan.owner[id] else { continue };
        for step in transition.requires.iter().filter(|step| plan.place[**step].0 != owner) {
            for rival in plan.leaving[*step].iter().take_while(|rival| **rival != id) {
                let known = plan.owner[*rival].is_none_or(|it| it <= owner)
                    || net.transitions[*rival].requires.iter().all(|it| it == step);
                if !known {
                    return refuse("joins that compete with each other", transition.meta.span);
                }
                let looks_back = net.transitions[*rival]
                    .guard
                    .leaves()
                    .any(|leaf| matches!(leaf, Leaf::Fireable(_)));
                if looks_back && plan.owner[*rival].is_some_and(|it| it > owner) {
                    return refuse(
                        "a join that competes with an `otherwise`",
                        transition.meta.span,
                    );
                }
            }
        }
    }
    Ok(())
}

/// True if the text of two receptivities shows that they are never both true: one requires a condition that the other negates, or one is
/// the `otherwise` of the other.
fn disjoint(net: &Net, earlier: TransitionId, later: TransitionId) -> bool {
    let (a, b) = (receptivity(net, earlier), receptivity(net, later));
    let (a, b) = (a.factors(), b.factors());
    let negates = |one: &Expr, other: &Expr| matches!(&one.kind, ExprKind::Not(inner) if inner.kind == other.kind);
    let otherwise = |all: &[Expr], of: TransitionId| {
        all.iter().any(|it| {
            matches!(&it.kind, ExprKind::Not(inner) if inner.kind == ExprKind::Leaf(Leaf::Fireable(of)))
        })
    };
    a.iter().any(|x| b.iter().any(|y| negates(x, y) || negates(y, x)))
        || otherwise(b, earlier)
        || otherwise(a, later)
}

/// True if firing both has the same effect as firing either.
fn same_effect(a: &Transition, b: &Transition) -> bool {
    a.requires == b.requires
        && a.enters == b.enters
        && a.restart == b.restart
        && a.actions.is_empty()
        && b.actions.is_empty()
}
