//! States, regions and history of statecharts (semantics §3.3, §4, §5).

use super::codes;
use super::context::{Lowering, ScopeId};
use crate::chart;
use crate::diag::Diagnostic;
use crate::net::{StepId, TransitionId};

/// A transition of a statechart: its one source, what it leaves and what it enters.
pub(super) fn transition<'a>(
    lowering: &mut Lowering<'a>,
    _scope: ScopeId,
    _id: TransitionId,
    source: &'a chart::Transition,
) {
    lowering.report(
        Diagnostic::error(codes::NOT_SUPPORTED, "transitions of statecharts are not lowered yet")
            .at(source.meta.span, ""),
    );
}

/// What a state adds to the step that it is.
pub(super) fn state<'a>(
    _lowering: &mut Lowering<'a>,
    _scope: ScopeId,
    _id: StepId,
    _source: &'a chart::State,
) {
}
