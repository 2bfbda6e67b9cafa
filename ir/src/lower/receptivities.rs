//! Triggers and receptivities of transitions, for Grafcet and for statecharts: the events after `on`, and the condition made of `when` and `after`.

use super::codes;
use super::context::{Lowering, Outcome, ScopeId};
use super::place::Place;
use crate::chart;
use crate::diag::Diagnostic;
use crate::expr::{CompareOp, Expr, ExprKind};
use crate::net::{InputId, Leaf, StepId};
use crate::span::{Name, Span};

/// The events after `on`, without duplicates.
pub(super) fn event_list(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    names: &[Name],
) -> Vec<InputId> {
    let mut events: Vec<InputId> = Vec::new();
    for name in names {
        let Ok(event) = lowering.event(scope, name) else { continue };
        if events.contains(&event) {
            lowering.report(
                Diagnostic::warning(codes::STEP_TWICE, format!("event `{name}` is listed twice"))
                    .at(name.span, "again here")
                    .help("remove it"),
            );
        } else {
            events.push(event);
        }
    }
    events
}

/// The receptivity of a transition, from its `when` and `after`.
pub(super) fn receptivity(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    source: &chart::Transition,
    requires: Option<&[StepId]>,
) -> Outcome<Expr<Leaf>> {
    let mut operands = Vec::new();
    let mut failed = None;
    if let Some(guard) = &source.guard {
        // Rejected sources must not cause a second error about `otherwise`.
        if let Some(requires) = requires {
            let place = Place {
                edges: true,
                events: true,
                otherwise: Some(requires),
                ..Place::level(scope, "a receptivity")
            };
            match lowering.condition::<Leaf>(guard, &place) {
                Ok(guard) => operands.push(guard),
                Err(reported) => failed = Some(reported),
            }
        }
    }
    if let Some((length, span)) = &source.after {
        let span = *span;
        if source.sources.is_empty() {
            failed = Some(
                lowering.report(
                    Diagnostic::error(
                        codes::AFTER_SOURCE,
                        "`after` is not allowed on a source transition",
                    )
                    .at(span, "no step before the arrow whose time could be measured")
                    .help("add a step before it, or use `timer T while ..` and `when T >= ..`"),
                ),
            );
        }
        match lowering.length(scope, length, span) {
            // `after 0` is true.
            Ok(0) => {}
            Ok(ticks) => operands.extend(timed(lowering, requires, span).into_iter().map(|step| {
                let time = Expr::leaf(Leaf::Elapsed(step), span);
                let ticks = Expr::new(ExprKind::Int(i64::from(ticks)), span);
                Expr::compare(CompareOp::Ge, time, ticks)
            })),
            Err(reported) => failed = Some(reported),
        }
    }
    let counted = super::counted::conditions(lowering, requires.unwrap_or(&[]), source.meta.span);
    operands.splice(0..0, counted);
    if let (Some([]), Some(inside)) = (requires, lowering.scopes[scope].inside) {
        // A source transition inside an enclosure is enabled while the enclosing step is active (semantics C4).
        operands.insert(0, Expr::leaf(Leaf::Active(inside), source.meta.span));
    }
    failed.map_or_else(|| Ok(Expr::and(operands)), Err)
}

/// The steps whose time `after` reads; a counted step has no time.
fn timed(lowering: &mut Lowering<'_>, requires: Option<&[StepId]>, span: Span) -> Vec<StepId> {
    let steps = requires.unwrap_or(&[]);
    let counted = steps.iter().copied().find(|step| lowering.counted.contains_key(step));
    if let Some(step) = counted {
        super::counted::no_time(lowering, step, span);
    }
    steps.to_vec()
}
