//! Pass `limit`: the bound on micro-steps of a stable evolution, where the chart names none (semantics §3.4).

use super::context::Lowering;
use super::expand::Work;
use crate::net::{Evolution, StepKind};

/// Last, when all steps and transitions are there: leaf and enclosing steps plus transitions, reactions not counted.
pub(super) fn limit(lowering: &mut Lowering<'_>) {
    let net = &mut lowering.net;
    let Evolution::Stable { limit } = &mut net.settings.evolution else { return };
    if *limit > 0 {
        return;
    }
    let steps = net.steps.values().filter(|step| {
        !step.hidden && matches!(step.kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final)
    });
    let transitions = lowering.work.iter().filter(|work| matches!(work, Work::Transition { .. }));
    let count = steps.count() + transitions.count();
    *limit = u32::try_from(count).unwrap_or(u32::MAX).max(1);
}
