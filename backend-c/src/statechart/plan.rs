//! The plan of the style `statechart`: its regions, their state variables, and the region of each transition.
//!
//! # Regions
//! A region has exactly one active atomic or parallel state while it is active: it is a chart, or a child of a parallel state, with everything in it
//! down to atomic states and to parallel states, whose children are separate regions. The atomic and parallel states of a region in document order are
//! its *terminals*; its one state variable contains the number of the active one, from 1, and 0 while the region is not active. A composite state is
//! active while the variable is in the range of its terminals.
//!
//! ```text
//! chart { state a { state b  state c }  parallel d { state e { state f  state g }  state h { state i } } }
//! region chart: b 1, c 2, d 3 (a is 1..2)      region e: f 1, g 2      region h: i 1
//! ```
//!
//! # Numbers of transitions
//! The transitions out of the states of a region are numbered from 1, so that ranges answer the questions of the selection (§4): first those that exit nothing,
//! then those that stay in the region, then those that leave it, sorted by the number of parallel states that they leave.

use crate::refusal::Refusal;
use grafsynth_ir::Gather;
use grafsynth_ir::IdMap;
use grafsynth_ir::net::{
    Enter, HistoryId, Net, PartId, Policy, Step, StepId, StepKind, Transition, TransitionId,
};
use std::collections::{BTreeMap, BTreeSet};

/// A region.
#[derive(Debug, Clone)]
pub(super) struct Region {
    /// The parallel state whose child it is; `None` for a chart.
    pub(super) parent: Option<StepId>,
    /// The chart that contains it.
    pub(super) part: PartId,
    /// Its outermost state; for a chart with several, the first.
    pub(super) root: StepId,
    /// Atomic and parallel states, in document order: the number is the index plus one.
    pub(super) terminals: Vec<StepId>,
    /// Composite states, in document order.
    pub(super) composites: Vec<StepId>,
    /// Its parallel states with their regions.
    pub(super) nested: Vec<(StepId, Vec<usize>)>,
    /// True if the region is always active.
    pub(super) is_always: bool,
    /// The transitions out of its states, in the order of their numbers.
    pub(super) transitions: Vec<TransitionId>,
    /// The number of its transitions that exit nothing.
    pub(super) n_still: usize,
    /// For each enclosing parallel state, from the innermost: the number of the first transition that leaves it.
    pub(super) leavers: Vec<(StepId, usize)>,
    /// True if its variable must show at once that a state has been exited.
    pub(super) drops: bool,
}

impl Region {
    /// True if it needs a variable, because it has more than one situation.
    pub(super) fn has_variable(&self) -> bool {
        !self.is_always || self.terminals.len() > 1
    }
}

/// The regions of a transition's source and domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Route {
    /// The region of its source.
    pub(super) region: usize,
    /// Its number there.
    pub(super) number: usize,
    /// The region of its domain and the depth in it (0 is the whole region): everything deeper is exited. `None` exits nothing.
    pub(super) domain: Option<(usize, u32)>,
}

/// The data that a history records.
#[derive(Debug, Clone)]
pub(super) enum Memory {
    /// The variable of the owner's region, and for each state that the history may record, the states that are entered.
    One(usize, Vec<(StepId, Vec<Enter>)>),
    /// The variables of these regions, all inside the owner, in document order: a deep history over several regions.
    Deep(Vec<usize>),
    /// Only the fact that it was recorded: a shallow history of a parallel state, whose children are all entered.
    All(Vec<Enter>),
}

/// All decisions about the C code before it is printed.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    pub(super) regions: Vec<Region>,
    /// The region of each state; for a parallel state, the region in which it is a terminal.
    pub(super) region_of: IdMap<Step, usize>,
    /// The depth of each state in its region; the outermost state has depth 1.
    pub(super) depth: IdMap<Step, u32>,
    /// For each state, the first and last number of the terminals in it.
    pub(super) range: IdMap<Step, (usize, usize)>,
    pub(super) routes: IdMap<Transition, Option<Route>>,
    /// Regions, those of a parallel state before the region that contains it.
    pub(super) post_order: Vec<usize>,
    pub(super) memories: BTreeMap<HistoryId, Memory>,
}

impl Plan {
    /// The regions of a parallel state.
    pub(super) fn regions_in(&self, parallel: StepId) -> &[usize] {
        let region = &self.regions[self.region_of[parallel]];
        region.nested.iter().find(|(it, _)| *it == parallel).map_or(&[], |(_, inner)| inner)
    }

    /// The regions of a parallel state and all regions in these, in document order.
    pub(super) fn all_regions_in(&self, parallel: StepId) -> Vec<usize> {
        let mut all = Vec::new();
        let mut todo = self.regions_in(parallel).to_vec();
        while let Some(region) = todo.pop() {
            all.push(region);
            todo.extend(self.regions[region].nested.iter().flat_map(|(_, inner)| inner));
        }
        all.sort_unstable();
        all
    }

    /// The enclosing parallel states of a region, from the innermost.
    pub(super) fn around(&self, region: usize) -> Vec<StepId> {
        let mut all = Vec::new();
        let mut next = self.regions[region].parent;
        while let Some(parallel) = next {
            all.push(parallel);
            next = self.regions[self.region_of[parallel]].parent;
        }
        all
    }
}

fn refuse<T>(what: impl Into<String>, span: grafsynth_ir::Span) -> Result<T, Refusal> {
    Err(Refusal { what: what.into(), span })
}

/// The plan, or the reason why there is none.
pub(super) fn plan(net: &Net) -> Result<Plan, Refusal> {
    if net.settings.assign_simultaneous {
        return refuse("`assign simultaneous` in a statechart", net.name.span);
    }
    in_document_order(net)?;
    let mut plan = regions(net)?;
    for (id, transition) in net.transitions.iter() {
        plan.routes[id] = route(net, &plan, transition);
    }
    number(net, &mut plan);
    plan.post_order = post_order(&plan);
    fixed_order(net, &plan)?;
    for (id, history) in net.histories.iter() {
        let Some(memory) = memory(net, &plan, id) else {
            return refuse(format!("the history `{}`", history.name), history.meta.span);
        };
        plan.memories.insert(id, memory);
    }
    Ok(plan)
}

/// The maximum nesting depth of states: the functions that walk the tree are recursive.
const DEEPEST: usize = 256;

/// Checks that each state directly precedes the states inside it.
fn in_document_order(net: &Net) -> Result<(), Refusal> {
    let mut around: Vec<StepId> = Vec::new();
    for (id, step) in net.steps.iter() {
        while around.last().is_some_and(|top| Some(*top) != step.parent) {
            around.pop();
        }
        if step.parent.is_some() && around.is_empty() {
            return refuse("states that are not in tree order", step.meta.span);
        }
        if around.len() >= DEEPEST {
            return refuse(format!("states nested more than {DEEPEST} deep"), step.meta.span);
        }
        around.push(id);
    }
    Ok(())
}

impl Region {
    /// A region without states.
    fn new(parent: Option<StepId>, part: PartId, root: StepId) -> Self {
        Region {
            parent,
            part,
            root,
            terminals: Vec::new(),
            composites: Vec::new(),
            nested: Vec::new(),
            is_always: parent.is_none(),
            transitions: Vec::new(),
            n_still: 0,
            leavers: Vec::new(),
            drops: false,
        }
    }
}

fn regions(net: &Net) -> Result<Plan, Refusal> {
    let mut is_parent = IdMap::filled(&net.steps, false);
    for parent in net.steps.values().filter_map(|step| step.parent) {
        is_parent[parent] = true;
    }
    let mut plan = Plan {
        regions: Vec::new(),
        region_of: IdMap::filled(&net.steps, 0),
        depth: IdMap::filled(&net.steps, 0),
        range: IdMap::filled(&net.steps, (usize::MAX, 0)),
        routes: IdMap::filled(&net.transitions, None),
        post_order: Vec::new(),
        memories: BTreeMap::new(),
    };
    let mut of_part: BTreeMap<PartId, usize> = BTreeMap::new();
    for (id, step) in net.steps.iter() {
        let in_parallel =
            step.parent.filter(|parent| net.steps[*parent].kind == StepKind::Parallel);
        let (region, depth) = match (step.parent, in_parallel) {
            (Some(parent), None) => (plan.region_of[parent], plan.depth[parent] + 1),
            (None, _) if of_part.contains_key(&step.part) => (of_part[&step.part], 1),
            (parent, _) => {
                let index = plan.regions.len();
                plan.regions.push(Region::new(parent, step.part, id));
                match parent {
                    Some(parent) => {
                        let outer = plan.region_of[parent];
                        if let Some((_, inner)) =
                            plan.regions[outer].nested.iter_mut().find(|(it, _)| *it == parent)
                        {
                            inner.push(index);
                        }
                    }
                    None => {
                        of_part.insert(step.part, index);
                    }
                }
                (index, 1)
            }
        };
        plan.region_of[id] = region;
        plan.depth[id] = depth;
        match (step.kind, is_parent[id]) {
            (StepKind::Composite, true) => plan.regions[region].composites.push(id),
            (StepKind::Leaf | StepKind::Final, false) | (StepKind::Parallel, true) => {
                plan.regions[region].terminals.push(id);
                let number = plan.regions[region].terminals.len();
                if step.kind == StepKind::Parallel {
                    plan.regions[region].nested.push((id, Vec::new()));
                }
                let mut next = Some(id);
                while let Some(state) = next.filter(|state| plan.region_of[*state] == region) {
                    let (first, last) = plan.range[state];
                    plan.range[state] = (first.min(number), last.max(number));
                    next = net.steps[state].parent;
                }
            }
            (StepKind::Composite | StepKind::Parallel, false) => {
                return refuse(
                    format!("the state `{}` without children", step.name),
                    step.meta.span,
                );
            }
            (StepKind::Leaf | StepKind::Final | StepKind::Enclosing, _) => {
                return refuse(format!("the step `{}`", step.name), step.meta.span);
            }
        }
    }
    for index in 0..plan.regions.len() {
        if let Some(parent) = plan.regions[index].parent {
            let outer = &plan.regions[plan.region_of[parent]];
            plan.regions[index].is_always = outer.is_always && outer.terminals.len() == 1;
        }
    }
    Ok(plan)
}

fn route(net: &Net, plan: &Plan, transition: &Transition) -> Option<Route> {
    let source = *transition.requires.first()?;
    let region = plan.region_of[source];
    // The exit set is everything in the domain, so its first state is a child of the domain.
    let domain = transition.clears.iter().min().map(|first| match net.steps[*first].parent {
        Some(domain) => (plan.region_of[domain], plan.depth[domain]),
        None => (plan.region_of[*first], 0),
    });
    Some(Route { region, number: 0, domain })
}

fn number(net: &Net, plan: &mut Plan) {
    let mut all: Vec<Vec<(usize, TransitionId)>> = vec![Vec::new(); plan.regions.len()];
    for id in net.transitions.ids() {
        if let Some(Route { region, domain, .. }) = plan.routes[id] {
            let around = plan.around(region);
            // 0 exits nothing, 1 stays in the region, 2 leaves the innermost enclosing parallel state, and so on.
            let far = domain.map_or(0, |(to, _)| {
                let of = |parallel: &StepId| plan.region_of[*parallel] == to;
                if to == region {
                    1
                } else {
                    2 + around.iter().position(of).unwrap_or(around.len())
                }
            });
            all[region].push((far, id));
        }
    }
    for (index, mut transitions) in all.into_iter().enumerate() {
        transitions.sort_unstable();
        let first_of = |far: usize| 1 + transitions.iter().filter(|(it, _)| *it < far).count();
        let around = plan.around(index);
        let leavers =
            around.iter().enumerate().map(|(at, parallel)| (*parallel, first_of(at + 2))).collect();
        plan.regions[index].leavers = leavers;
        plan.regions[index].n_still = first_of(1) - 1;
        for (at, (_, id)) in transitions.iter().enumerate() {
            if let Some(route) = &mut plan.routes[*id] {
                route.number = at + 1;
            }
        }
        plan.regions[index].transitions = transitions.into_iter().map(|(_, id)| id).collect();
    }
}

fn post_order(plan: &Plan) -> Vec<usize> {
    let mut order = Vec::new();
    let outermost = (0..plan.regions.len()).filter(|it| plan.regions[*it].parent.is_none());
    let mut todo: Vec<(usize, bool)> = outermost.rev().map(|it| (it, false)).collect();
    while let Some((region, is_done)) = todo.pop() {
        if is_done {
            order.push(region);
        } else {
            todo.push((region, true));
            let nested = plan.regions[region].nested.iter().flat_map(|(_, inner)| inner);
            todo.extend(nested.rev().map(|inner| (*inner, false)));
        }
    }
    order
}

/// Rejects a chart in which the order of actions depends on the situation. It does if a transition of a state with several regions can be selected together
/// with a transition inside that state, and comes before or after it depending on the active states. In such a pair one exits nothing, and both have actions.
fn fixed_order(net: &Net, plan: &Plan) -> Result<(), Refusal> {
    if net.settings.policy != Policy::InnerFirst {
        return Ok(());
    }
    for (id, transition) in net.transitions.iter() {
        let Some(source) = transition.requires.first().copied() else { continue };
        if transition.actions.is_empty() || plan.routes[id].is_none() {
            continue;
        }
        let (first, last) = plan.range[source];
        let region = &plan.regions[plan.region_of[source]];
        for (parallel, inner) in &region.nested {
            if !(first..=last).contains(&plan.range[*parallel].0) || inner.len() < 2 {
                continue;
            }
            let inside = plan.all_regions_in(*parallel);
            let others = inside.iter().flat_map(|it| &plan.regions[*it].transitions);
            let floats = others.map(|other| &net.transitions[*other]).any(|other| {
                !other.actions.is_empty()
                    && (other.clears.is_empty() || transition.clears.is_empty())
                    && meet(transition, other)
            });
            if floats {
                let what = format!(
                    "the actions of `{}`, whose order depends on the situation",
                    transition.name
                );
                return refuse(what, transition.meta.span);
            }
        }
    }
    Ok(())
}

/// True if both transitions may be fireable in the same check.
fn meet(a: &Transition, b: &Transition) -> bool {
    if a.events.is_empty() || b.events.is_empty() {
        return a.events.is_empty() && b.events.is_empty();
    }
    a.events.iter().any(|event| b.events.contains(event))
}

/// The data that a history records; `None` if its cases are not of a known form.
fn memory(net: &Net, plan: &Plan, id: HistoryId) -> Option<Memory> {
    let history = &net.histories[id];
    let owner = history.owner;
    let region = plan.region_of[owner];
    let (first, last) = plan.range[owner];
    let nested: Vec<StepId> = plan.regions[region]
        .nested
        .iter()
        .map(|(parallel, _)| *parallel)
        .filter(|parallel| (first..=last).contains(&plan.range[*parallel].0))
        .collect();
    let is_shallow = history.cases.iter().all(|case| net.steps[case.step].parent == Some(owner));
    if is_shallow && net.steps[owner].kind == StepKind::Parallel {
        let n_children = plan.regions_in(owner).len();
        let cases: Vec<Enter> =
            history.cases.iter().flat_map(|case| case.enters.iter().copied()).collect();
        return (history.cases.len() == n_children).then_some(Memory::All(cases));
    }
    if is_shallow || nested.is_empty() {
        if history.cases.iter().any(|case| plan.region_of[case.step] != region) {
            return None;
        }
        let cases = history.cases.iter().map(|case| (case.step, case.enters.clone())).collect();
        return Some(Memory::One(region, cases));
    }
    // Deep, over several regions: every atomic state below, each with the path down to it.
    let mut regions: Vec<usize> =
        nested.iter().flat_map(|parallel| plan.all_regions_in(*parallel)).collect();
    if net.steps[owner].kind != StepKind::Parallel {
        regions.push(region);
    }
    regions.sort_unstable();
    let is_below = |step: StepId| {
        let is_atomic = matches!(net.steps[step].kind, StepKind::Leaf | StepKind::Final);
        let inside = if plan.region_of[step] == region {
            (first..=last).contains(&plan.range[step].0) && step != owner
        } else {
            regions.contains(&plan.region_of[step])
        };
        is_atomic && inside
    };
    let wanted: BTreeSet<StepId> = net.steps.ids().filter(|step| is_below(*step)).gather();
    let recorded: BTreeSet<StepId> = history.cases.iter().map(|case| case.step).gather();
    let is_usual = history.cases.iter().all(|case| {
        let mut way = Vec::new();
        let mut next = Some(case.step);
        while let Some(state) = next.filter(|state| *state != owner) {
            way.push(Enter::Step(state));
            next = net.steps[state].parent;
        }
        way.reverse();
        way == case.enters
    });
    (is_usual && wanted == recorded).then_some(Memory::Deep(regions))
}
