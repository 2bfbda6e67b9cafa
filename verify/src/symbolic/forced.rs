//! The forced charts of a net, their forcing steps, and the precedence of the orders.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::net::{ForcingOrder, Net, StepId, TransitionId};

use super::state::is_move;
use crate::cover;

/// The maximum number of charts that are unrolled: each costs a situation of its own.
const CHARTS: usize = 32;

/// All orders for one chart.
#[derive(Debug, Clone)]
pub(super) struct ForcedChart {
    pub(super) steps: Vec<StepId>,
    pub(super) transitions: Vec<TransitionId>,
    /// The forcing step and the requested situation; `None` is `hold`. In declaration order.
    pub(super) orders: Vec<(StepId, Option<BTreeSet<StepId>>)>,
}

/// The forced charts of a net; a chart comes before the charts that it forces.
pub(super) fn forced_charts(net: &Net) -> Result<Vec<ForcedChart>, String> {
    let mut charts: Vec<(BTreeSet<usize>, ForcedChart)> = Vec::new();
    for forcing in &net.forcings {
        let parts: BTreeSet<usize> = forcing.target.iter().map(|part| part.index()).gather();
        let wanted = match &forcing.order {
            ForcingOrder::Situation(steps) => {
                Some(cover::closure(net, steps.iter().copied()).into_iter().gather())
            }
            ForcingOrder::Hold => None,
        };
        let order = (forcing.step, wanted);
        match charts.iter_mut().find(|(known, _)| *known == parts) {
            Some((_, chart)) => chart.orders.push(order),
            None => {
                let steps = net.steps.iter().filter(|(_, step)| parts.contains(&step.part.index()));
                let steps = steps.map(|(id, _)| id).collect();
                let transitions =
                    net.transitions.iter().filter(|(_, one)| parts.contains(&one.part.index()));
                let transitions =
                    transitions.map(|(id, _)| id).filter(|id| is_move(net, *id)).collect();
                charts.push((parts, ForcedChart { steps, transitions, orders: vec![order] }));
            }
        }
    }
    if charts.len() > CHARTS {
        return Err(format!(
            "more than {CHARTS} forced charts are not covered by the symbolic proof"
        ));
    }
    let mut sorted = Vec::new();
    while !charts.is_empty() {
        // A chart that no other remaining chart forces; forcing has no cycle.
        let is_forced_by = |chart: &ForcedChart, parts: &BTreeSet<usize>| {
            chart.orders.iter().any(|(step, _)| parts.contains(&net.steps[*step].part.index()))
        };
        let next = (0..charts.len())
            .find(|at| {
                (0..charts.len())
                    .all(|other| other == *at || !is_forced_by(&charts[*at].1, &charts[other].0))
            })
            .unwrap_or(0);
        sorted.push(charts.remove(next).1);
    }
    Ok(sorted)
}
