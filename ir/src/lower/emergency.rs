//! Pass `emergency`: the one condition that forces all outputs to their safe values (semantics §3.8).

use super::codes;
use super::context::{Lowering, Work};
use super::place::Place;
use crate::diag::Diagnostic;
use crate::net::{self, Emergency};

/// Lowers the emergency. Runs after `roles`, which determines which outputs can be read. [`crate::validate`] reports what a net with an emergency must not
/// contain.
pub(super) fn emergency(lowering: &mut Lowering<'_>) {
    let mut first = None;
    for index in 0..lowering.work.len() {
        let Work::Emergency { scope, source } = lowering.work[index] else { continue };
        let span = source.meta.span;
        if lowering.scopes[scope].parent.is_some() || lowering.scopes[scope].is_instance {
            lowering.report(
                Diagnostic::error(
                    codes::DECLARED_INSIDE,
                    "an emergency belongs to the chart, not to a body in it",
                )
                .at(span, "")
                .help("move it to the top level of the chart: it applies to all outputs"),
            );
            continue;
        }
        let place = Place::level(scope, "an emergency");
        let condition = lowering.condition::<net::Leaf>(&source.condition, &place);
        let Some(first) = first else {
            first = Some(span);
            if let Ok(condition) = condition {
                lowering.net.emergency = Some(Emergency { condition, meta: source.meta.clone() });
            }
            continue;
        };
        lowering.report(
            Diagnostic::twice(codes::EMERGENCY_TWICE,
                "second emergency: a design can have only one, because it forces all outputs of all charts", [span, first], "combine the conditions with `or`"),
        );
    }
}
