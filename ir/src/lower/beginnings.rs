//! Pass `beginnings`: reports a Grafcet that never does anything: no step is active after reset, there is no source transition, and nothing forces it.

use super::codes;
use super::context::{Lowering, Work};
use crate::diag::{Diagnostic, Notation};
use crate::net::PartId;

/// Reports Grafcets that never do anything. Runs after `forcing`, because a forced chart needs no initial step of its own.
pub(super) fn beginnings(lowering: &mut Lowering<'_>) {
    if lowering.is_statechart() {
        return;
    }
    inside_of_inactive(lowering);
    let net = &lowering.net;
    let chart_of = |part: PartId| {
        lowering.chart_bodies.partition_point(|(_, parts)| parts.end <= part.index())
    };
    let n_charts = lowering.chart_bodies.len();
    let mut has_steps = vec![false; n_charts];
    let mut starts = vec![false; n_charts];
    for step in net.steps.values() {
        let chart = chart_of(step.part);
        has_steps[chart] = true;
        starts[chart] |= step.is_initial;
    }
    for work in &lowering.work {
        if let Work::Transition { id, source, .. } = work {
            starts[chart_of(net.transitions[*id].part)] |= source.sources.is_empty();
        }
    }
    for forcing in &net.forcings {
        for part in &forcing.target {
            starts[chart_of(*part)] = true;
        }
    }
    for (index, chart) in lowering.design.charts.iter().enumerate() {
        if has_steps[index] && !starts[index] {
            let finding = Diagnostic::error(
                codes::NO_INITIAL_STEP,
                format!("chart `{}` has no initial step, so it never does anything", chart.name),
            )
            .at(chart.name.span, "no step of this chart is active after reset")
            .help("write `initial step` for the step that is active after reset")
            .help_in(
                Notation::Iec,
                "write `INITIAL_STEP` for the step that is active after reset (in PLCopen XML: `initialStep=\"true\"`)",
            );
            lowering.found.add(finding);
        }
    }
}

/// Reports initial steps inside enclosing steps that are not active after reset.
fn inside_of_inactive(lowering: &mut Lowering<'_>) {
    let net = &lowering.net;
    let mut active = vec![false; net.steps.len()];
    let mut wrong = Vec::new();
    // A step is declared after the step that encloses it.
    for (id, step) in net.steps.iter() {
        let parent = step.parent;
        let is_around = parent.is_some_and(|parent| active[parent.index()]);
        active[id.index()] = step.is_initial || step.activation_link && is_around;
        if let Some(parent) = parent.filter(|_| step.is_initial && !is_around) {
            wrong.push((step.name.clone(), net.steps[parent].name.clone()));
        }
    }
    for (step, parent) in wrong {
        lowering.report(
            Diagnostic::error(
                codes::INITIAL_INSIDE,
                format!("step `{step}` is initial, but its enclosing step `{parent}` is not active after reset"),
            )
            .at(step.span, "initial")
            .at(parent.span, "not active after reset")
            .help(format!("write `step {step} *` so that `{parent}` activates it")),
        );
    }
}
