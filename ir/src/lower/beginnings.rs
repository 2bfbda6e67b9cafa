//! Pass `beginnings`: a Grafcet in which no step is active after reset, that no source transition starts and nothing forces never does anything.

use super::codes;
use super::context::Lowering;
use super::expand::Work;
use crate::diag::Diagnostic;
use crate::net::PartId;

/// After `forcing`, since a forced chart may begin without a step of its own.
pub(super) fn beginnings(lowering: &mut Lowering<'_>) {
    if lowering.is_statechart() {
        return;
    }
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
                format!("chart {} has no initial step, so nothing in it ever happens", chart.name),
            )
            .at(chart.name.span, "no step of this chart is active after reset")
            .help("write `initial step` where it begins");
            lowering.found.add(finding);
        }
    }
}
