//! Forcing orders (semantics §8) as functions: K3, K5 and N3 of §3.9.

use std::collections::BTreeSet;

use grafsynth_ir::net::{ForcingOrder, Net, StepId, TransitionId};

use super::aig::Lit;
use super::reaction::{Maker, Unsupported};
use super::state::{State, is_move};
use crate::cover;

/// More charts than that are not unrolled: each costs a situation of its own.
const CHARTS: usize = 32;

/// All orders for one chart.
#[derive(Debug, Clone)]
pub(super) struct ForcedChart {
    steps: Vec<StepId>,
    transitions: Vec<TransitionId>,
    /// The forcing step, and the situation that it asks for; none is `hold`. In declaration order.
    orders: Vec<(StepId, Option<BTreeSet<StepId>>)>,
}

/// The forced charts of a net, those that force others before those.
pub(super) fn forced_charts(net: &Net) -> Result<Vec<ForcedChart>, Unsupported> {
    let mut charts: Vec<(BTreeSet<usize>, ForcedChart)> = Vec::new();
    for forcing in &net.forcings {
        let parts: BTreeSet<usize> = forcing.target.iter().map(|part| part.index()).collect();
        let wanted = match &forcing.order {
            ForcingOrder::Situation(steps) => {
                Some(cover::closure(net, steps.iter().copied()).into_iter().collect())
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
        // One that no other of the rest forces; forcing has no cycle.
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

impl Maker<'_> {
    /// K3: transitions of a chart that an active step forces do not fire.
    pub(super) fn hold_forced(&mut self, state: &State) {
        self.free = self.fireable.clone();
        for chart in self.forced.clone() {
            let forces: Vec<Lit> =
                chart.orders.iter().map(|(step, _)| state.active[step.index()]).collect();
            let forces = self.aig.or_all(forces);
            for transition in chart.transitions {
                self.free[transition.index()] =
                    self.aig.and(self.free[transition.index()], !forces);
            }
        }
    }

    /// K5: nor do those of a chart that becomes forced by this very micro-step.
    pub(super) fn stop_forced(&mut self, state: &State, chosen: &mut [Lit]) {
        for chart in self.forced.clone() {
            let (next, _) = self.next(state, chosen);
            let forces: Vec<Lit> =
                chart.orders.iter().map(|(step, _)| next[step.index()]).collect();
            let forces = self.aig.or_all(forces);
            for transition in chart.transitions {
                chosen[transition.index()] = self.aig.and(chosen[transition.index()], !forces);
            }
        }
    }

    /// N3: the situation of every chart that is forced now.
    pub(super) fn force(&mut self, before: &[Lit], next: &mut [Lit], restarted: &mut [Lit]) {
        let net = self.net;
        for chart in self.forced.clone() {
            // The first declared order of an active step.
            let mut applies = Vec::new();
            let mut earlier = Lit::FALSE;
            for (step, _) in &chart.orders {
                let active = next[step.index()];
                applies.push(self.aig.and(active, !earlier));
                earlier = self.aig.or(earlier, active);
            }
            for step in &chart.steps {
                let at = step.index();
                let mut ways = Vec::new();
                for ((_, wanted), applies) in chart.orders.iter().zip(&applies) {
                    let asked = match wanted {
                        None => before[at],
                        Some(wanted) => Lit::constant(wanted.contains(step)),
                    };
                    ways.push(self.aig.and(*applies, asked));
                }
                let mut asked = self.aig.or_all(ways);
                // Parents stand before their children, so theirs is known.
                if let Some(parent) = net.steps[*step].parent {
                    asked = self.aig.and(asked, next[parent.index()]);
                }
                next[at] = self.aig.ite(earlier, asked, next[at]);
                restarted[at] = self.aig.and(restarted[at], !earlier);
            }
        }
    }

    /// R2: what is active after reset.
    pub(super) fn initial_situation(&mut self) -> Vec<StepId> {
        let net = self.net;
        let initial = cover::initial_situation(net);
        let mut next = vec![Lit::FALSE; net.steps.len()];
        initial.iter().for_each(|step| next[step.index()] = Lit::TRUE);
        // A chart that is held keeps its initial situation.
        let before = next.clone();
        let mut restarted = vec![Lit::FALSE; next.len()];
        self.force(&before, &mut next, &mut restarted);
        net.steps.ids().filter(|step| next[step.index()] == Lit::TRUE).collect()
    }
}
