//! Precomputed tables for the reaction: lists by step, so that its cost depends only on the active steps.

use grafsynth_ir::Gather;
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{
    Driver, ForcingOrder, InputId, InputKind, Leaf, Net, OutputId, PartId, StepId, StepKind,
    TransitionId,
};
use grafsynth_ir::ranks::sort_by_rank;

use std::collections::BTreeSet;

use crate::layout::Layout;
use crate::ranks::Ranks;
use crate::situation::Situation;

/// All forcing orders for one chart (semantics §8).
#[derive(Debug, Clone)]
pub(crate) struct ForcedChart {
    /// For each part, true if the part belongs to the forced chart.
    pub(crate) has_part: Vec<bool>,
    /// The first part of the forced chart, which gives the chart its name.
    pub(crate) part: PartId,
    /// The steps of the forced chart, in declaration order.
    pub(crate) steps: Vec<StepId>,
    /// The forcing steps with the requested situations, closed downwards; `None` is `hold`. In declaration order.
    pub(crate) orders: Vec<(StepId, Option<Vec<StepId>>)>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Tables {
    pub(crate) layout: Layout,
    pub(crate) ranks: Ranks,
    /// For each step, the transitions and reactions whose first preceding step it is, in declaration order.
    pub(crate) leaving: Vec<Vec<TransitionId>>,
    /// Transitions without preceding steps, each with its enclosing step.
    pub(crate) sources: Vec<(TransitionId, Option<StepId>)>,
    /// For each step, the continuous outputs that it drives, with the index of the emission.
    pub(crate) emissions: Vec<Vec<(OutputId, u32)>>,
    /// Mealy outputs.
    pub(crate) mealy: Vec<OutputId>,
    /// Outputs that show that a transition fires.
    pub(crate) firings: Vec<(OutputId, Vec<TransitionId>)>,
    /// Outputs that are copied from a variable or an action at the end of a reaction.
    pub(crate) copied: Vec<OutputId>,
    /// For each step, its continuous calls, with the index of the call.
    pub(crate) calls: Vec<Vec<(OutputId, u32)>>,
    /// For each step, the steps directly inside it, in declaration order.
    pub(crate) children: Vec<Vec<StepId>>,
    /// Enclosing steps, outer before inner.
    pub(crate) enclosing: Vec<StepId>,
    /// Forced charts, top of the hierarchy first.
    pub(crate) forced: Vec<ForcedChart>,
    /// Events.
    pub(crate) events: Vec<InputId>,
    /// For each edge operand, whether it reads only inputs and constants (semantics §3.7).
    pub(crate) edge_over_inputs: Vec<bool>,
    /// True if there are extern conditions, so that their calls must be tracked.
    pub(crate) has_extern_conditions: bool,
    /// Extern conditions in an edge operand: called in every reaction (semantics §6).
    pub(crate) always_called: Vec<InputId>,
    /// Charts that can end: statecharts with a top-level final state.
    pub(crate) may_end: Vec<PartId>,
    /// True if every chart can end.
    pub(crate) all_may_end: bool,
    /// For each input, true if some transition has `on` with this event.
    pub(crate) listened: Vec<bool>,
    /// True if some step has target-language text.
    pub(crate) has_code: bool,
    /// For each variable, true if it is the number of a counted step, which has a hidden step of the same name (semantics §8).
    pub(crate) counts: Vec<bool>,
}

impl Tables {
    pub(crate) fn of(net: &Net) -> Tables {
        let ranks = Ranks::of(net);
        let layout = Layout::of(net, &ranks);
        let n_steps = net.steps.len();
        let mut tables = Tables {
            leaving: vec![Vec::new(); n_steps],
            emissions: vec![Vec::new(); n_steps],
            calls: vec![Vec::new(); n_steps],
            children: vec![Vec::new(); n_steps],
            has_extern_conditions: net.inputs.values().any(|input| input.kind == InputKind::Extern),
            counts: counts(net),
            has_code: net.steps.values().any(|step| !step.code.is_empty()),
            may_end: net
                .parts
                .ids()
                .filter(|part| layout.find(crate::layout::Cell::Ended(*part)).is_some())
                .collect(),
            ..Tables::default()
        };
        tables.steps(net);
        tables.transitions(net);
        tables.outputs(net);
        tables.inputs_and_edges(net);
        tables.forced = forced_charts(net, &tables.children);
        let may_end = |part: PartId| tables.may_end.contains(&ranks.chart_of(part));
        tables.all_may_end =
            !tables.may_end.is_empty() && net.steps.values().all(|step| may_end(step.part));
        tables.layout = layout;
        tables.ranks = ranks;
        tables
    }

    fn steps(&mut self, net: &Net) {
        for (id, step) in net.steps.iter() {
            if let Some(parent) = step.parent {
                self.children[parent.index()].push(id);
            }
        }
        let mut enclosing: Vec<StepId> = net
            .steps
            .iter()
            .filter(|(_, step)| step.kind == StepKind::Enclosing)
            .map(|(id, _)| id)
            .collect();
        sort_by_rank(&mut enclosing, |step| [ancestors(net, *step).count() as u64]);
        self.enclosing = enclosing;
    }

    fn transitions(&mut self, net: &Net) {
        self.listened = vec![false; net.inputs.len()];
        for event in net.transitions.values().flat_map(|transition| &transition.events) {
            self.listened[event.index()] = true;
        }
        // The steps of an enclosed chart all have the enclosing step as parent; a source transition of the chart is enabled while that step is active
        // [C4].
        let mut enclosing_of_part = vec![None; net.parts.len()];
        for step in net.steps.values() {
            if let Some(parent) =
                step.parent.filter(|parent| net.steps[*parent].kind == StepKind::Enclosing)
            {
                enclosing_of_part[step.part.index()] = Some(parent);
            }
        }
        for (id, transition) in net.transitions.iter() {
            match transition.requires.first() {
                Some(step) => self.leaving[step.index()].push(id),
                None => self.sources.push((id, enclosing_of_part[transition.part.index()])),
            }
        }
    }

    fn outputs(&mut self, net: &Net) {
        for (id, output) in net.outputs.iter() {
            match &output.driver {
                Driver::Continuous(emissions) => {
                    for (place, emission) in emissions.iter().enumerate() {
                        self.emissions[emission.step.index()].push((id, place as u32));
                    }
                }
                Driver::Mealy(_) => self.mealy.push(id),
                Driver::Fires(transitions) => self.firings.push((id, transitions.clone())),
                Driver::Extern { calls, .. } => {
                    for (place, call) in calls.iter().enumerate() {
                        self.calls[call.step.index()].push((id, place as u32));
                    }
                }
                Driver::Stored(_) | Driver::Controlled(_) => self.copied.push(id),
            }
        }
    }

    fn inputs_and_edges(&mut self, net: &Net) {
        self.events = net
            .inputs
            .iter()
            .filter(|(_, input)| input.kind.is_event())
            .map(|(id, _)| id)
            .collect();
        for edge in net.edges.values() {
            let mut over_inputs = true;
            for leaf in edge.expr.leaves() {
                let Leaf::Input(input) = leaf else {
                    over_inputs = false;
                    continue;
                };
                let kind = net.inputs[*input].kind;
                if kind == InputKind::Extern && !self.always_called.contains(input) {
                    self.always_called.push(*input);
                }
                over_inputs &= !kind.is_event();
            }
            self.edge_over_inputs.push(over_inputs);
        }
        self.always_called.sort_unstable();
    }
}

/// The steps that enclose this one, innermost first.
pub(crate) fn ancestors(net: &Net, step: StepId) -> impl Iterator<Item = StepId> + '_ {
    // In a valid net each step is deeper than its parent; the bound protects against an endless loop in a broken one.
    std::iter::successors(net.steps[step].parent, |above| net.steps[*above].parent)
        .take(net.steps.len())
}

/// Semantics §2: a situation closed downwards; enclosing steps add the steps that they have an activation link to.
pub(crate) fn closure(
    net: &Net,
    children: &[Vec<StepId>],
    steps: impl IntoIterator<Item = StepId>,
) -> Vec<StepId> {
    let mut closed = Situation::empty(net.steps.len());
    let mut todo: Vec<StepId> = steps.into_iter().collect();
    while let Some(step) = todo.pop() {
        if closed.contains(step) {
            continue;
        }
        closed.insert(step);
        if net.steps[step].kind == StepKind::Enclosing {
            todo.extend(
                children[step.index()]
                    .iter()
                    .copied()
                    .filter(|child| net.steps[*child].activation_link),
            );
        }
    }
    closed.iter().collect()
}

/// Groups the forcing orders by forced chart, and puts each chart before the charts that it forces (semantics §8, top of the hierarchy first).
fn forced_charts(net: &Net, children: &[Vec<StepId>]) -> Vec<ForcedChart> {
    let mut charts: Vec<ForcedChart> = Vec::new();
    for forcing in &net.forcings {
        let mut has_part = vec![false; net.parts.len()];
        forcing.target.iter().for_each(|part| has_part[part.index()] = true);
        let asked = match &forcing.order {
            ForcingOrder::Situation(steps) => Some(closure(net, children, steps.iter().copied())),
            ForcingOrder::Hold => None,
        };
        let order = (forcing.step, asked);
        match charts.iter_mut().find(|chart| chart.has_part == has_part) {
            Some(chart) => chart.orders.push(order),
            None => {
                let steps = net
                    .steps
                    .iter()
                    .filter(|(_, step)| has_part[step.part.index()])
                    .map(|(id, _)| id)
                    .collect();
                let part = forcing.target.first().copied().unwrap_or(PartId::from_index(0));
                charts.push(ForcedChart { has_part, part, steps, orders: vec![order] });
            }
        }
    }
    let mut sorted: Vec<ForcedChart> = Vec::new();
    while !charts.is_empty() {
        let is_forced_by = |chart: &ForcedChart, other: &ForcedChart| {
            chart.orders.iter().any(|(step, _)| other.has_part[net.steps[*step].part.index()])
        };
        // A cycle of forcing is an error (§8), so there is always a chart that no remaining chart forces; in an invalid net, any chart will do.
        let next = (0..charts.len())
            .find(|at| {
                (0..charts.len())
                    .all(|other| other == *at || !is_forced_by(&charts[*at], &charts[other]))
            })
            .unwrap_or(0);
        sorted.push(charts.remove(next));
    }
    sorted
}

/// Calls `visit` for each extern condition in the expression.
pub(crate) fn extern_conditions(
    net: &Net,
    expr: &grafsynth_ir::net::Expr,
    visit: &mut impl FnMut(InputId),
) {
    if matches!(expr.kind, ExprKind::Bool(_) | ExprKind::Int(_)) {
        return;
    }
    for leaf in expr.leaves() {
        if let Leaf::Input(input) = leaf
            && net.inputs[*input].kind == InputKind::Extern
        {
            visit(*input);
        }
    }
}

fn counts(net: &Net) -> Vec<bool> {
    let hidden: BTreeSet<&str> =
        net.steps.values().filter(|step| step.hidden).map(|step| step.name.text.as_str()).gather();
    net.vars.values().map(|var| hidden.contains(var.name.text.as_str())).collect()
}
