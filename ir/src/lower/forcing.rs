//! Pass `forcing`: the forcing orders of steps (semantics §8).

use super::codes;
use super::context::{Lowering, Outcome, ScopeId, Symbol, Work};
use crate::chart::{self, ForceOrder, Path, StepItemKind};
use crate::diag::Diagnostic;
use crate::net::{Forcing, ForcingOrder, PartId, StepId};
use crate::span::Span;

/// Lowers the forcing orders, in declaration order, which decides between conflicting orders. Runs after `expand`.
pub(super) fn forcing(lowering: &mut Lowering<'_>) {
    let n_charts = lowering.chart_bodies.len();
    let mut forces: Vec<Vec<(usize, Span)>> = vec![Vec::new(); n_charts];
    for index in 0..lowering.work.len() {
        let Work::Step { scope, id, source } = lowering.work[index] else { continue };
        for item in &source.body {
            let StepItemKind::Force { target, order } = &item.kind else { continue };
            if lowering.is_statechart() {
                lowering.report(
                    Diagnostic::error(codes::CHART_KIND, "`force` is not allowed in a statechart")
                        .at(item.span, "")
                        .help("use a transition of an outer state: it leaves all inner states"),
                );
                continue;
            }
            if let Ok(chart) = order_of(lowering, scope, id, item, target, order) {
                forces[lowering.scopes[scope].chart].push((chart, item.span));
            }
        }
    }
    cycle(lowering, &forces);
}

fn order_of(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    step: StepId,
    item: &chart::StepItem,
    target: &Path,
    order: &ForceOrder,
) -> Outcome<usize> {
    let symbol = lowering.wanting("chart", |lowering| lowering.symbol(scope, target))?;
    let Symbol::Chart(forced) = symbol else {
        return Err(lowering.wrong_kind(target.span(), target, symbol, "a chart"));
    };
    let chart = lowering.scopes[forced].chart;
    let parts = lowering.chart_bodies[chart].1.clone();
    if parts.contains(&lowering.net.steps[step].part.index()) {
        return Err(lowering.report(
            Diagnostic::error(codes::FORCING, format!("chart `{target}` forces itself"))
                .at(item.span, "")
                .help("force it from another chart"),
        ));
    }
    let counted = lowering
        .counted
        .keys()
        .find(|step| parts.contains(&lowering.net.steps[**step].part.index()));
    if let Some(counted) = counted.copied() {
        let name = lowering.net.steps[counted].name.text.clone();
        return Err(lowering.report(
            Diagnostic::error(
                codes::FORCING,
                format!(
                    "chart `{target}` contains the counted step `{name}`, which cannot be forced"
                ),
            )
            .at(item.span, "")
            .help("move the counted step to a chart that is not forced"),
        ));
    }
    let order = match order {
        ForceOrder::Hold => ForcingOrder::Hold,
        ForceOrder::Init => {
            let steps = lowering.net.steps.iter();
            let initial =
                steps.filter(|(_, step)| step.is_initial && parts.contains(&step.part.index()));
            ForcingOrder::Situation(initial.map(|(id, _)| id).collect())
        }
        ForceOrder::Situation(paths) => {
            let found: Vec<Outcome<StepId>> =
                paths.iter().map(|path| forced_step(lowering, forced, path)).collect();
            let mut found: Vec<StepId> = found.into_iter().collect::<Outcome<_>>()?;
            found.sort_unstable();
            found.dedup();
            ForcingOrder::Situation(closed(lowering, found))
        }
    };
    let target = parts.map(PartId::from_index).collect();
    lowering.net.forcings.push(Forcing { step, target, order, span: item.span });
    Ok(chart)
}

/// A step of a forcing order; its name belongs to the forced chart.
fn forced_step(lowering: &mut Lowering<'_>, forced: ScopeId, path: &Path) -> Outcome<StepId> {
    let symbol = lowering.wanting("step", |lowering| lowering.symbol(forced, path))?;
    let step = if let Symbol::Step(step) = symbol {
        step
    } else if let Symbol::MacroStep(instance) = symbol {
        lowering.instances[instance].entry.ok_or_else(|| lowering.already_told())?
    } else {
        return Err(lowering.wrong_kind(path.span(), path, symbol, "a step"));
    };
    let chart = lowering.scopes[forced].chart;
    if !lowering.chart_bodies[chart].1.contains(&lowering.net.steps[step].part.index()) {
        let name = &lowering.design.charts[chart].name;
        return Err(lowering.report(
            Diagnostic::error(codes::FORCING, format!("step `{path}` is not in chart `{name}`"))
                .at(path.span(), "")
                .help(format!("write a step of chart `{name}`, or force the chart of this step")),
        ));
    }
    Ok(step)
}

/// A situation with the steps that its enclosing steps activate by their links, recursively.
fn closed(lowering: &Lowering<'_>, mut steps: Vec<StepId>) -> Vec<StepId> {
    let links: Vec<(StepId, StepId)> = lowering
        .net
        .steps
        .iter()
        .filter(|(_, step)| step.activation_link)
        .filter_map(|(id, step)| step.parent.map(|parent| (id, parent)))
        .collect();
    // Parents come before the steps that they enclose, so one pass in declaration order handles all levels.
    for (id, parent) in links {
        if steps.binary_search(&parent).is_ok()
            && let Err(place) = steps.binary_search(&id)
        {
            steps.insert(place, id);
        }
    }
    steps
}

/// Reports charts that force each other in a cycle.
fn cycle(lowering: &mut Lowering<'_>, forces: &[Vec<(usize, Span)>]) {
    #[derive(Clone, Copy, PartialEq)]
    enum Mark {
        New,
        Open,
        Done,
    }
    let mut marks = vec![Mark::New; forces.len()];
    for start in 0..forces.len() {
        let mut path: Vec<(usize, usize)> = vec![(start, 0)];
        if marks[start] != Mark::New {
            continue;
        }
        marks[start] = Mark::Open;
        while let Some((chart, next)) = path.last_mut() {
            let Some(&(to, span)) = forces[*chart].get(*next) else {
                marks[*chart] = Mark::Done;
                path.pop();
                continue;
            };
            *next += 1;
            match marks[to] {
                Mark::New => {
                    marks[to] = Mark::Open;
                    path.push((to, 0));
                }
                Mark::Open => {
                    let charts = &lowering.design.charts;
                    let from = path.iter().position(|(chart, _)| *chart == to).unwrap_or(0);
                    let mut names: Vec<&str> = path[from..]
                        .iter()
                        .map(|(chart, _)| charts[*chart].name.text.as_str())
                        .collect();
                    names.push(&charts[to].name.text);
                    let message =
                        format!("charts force each other in a cycle: {}", names.join(" -> "));
                    lowering.report(
                        Diagnostic::error(codes::FORCING, message)
                            .at(span, "closes the cycle")
                            .help("remove one of the orders: forcing must be hierarchical"),
                    );
                }
                Mark::Done => {}
            }
        }
    }
}
