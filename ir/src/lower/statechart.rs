//! States, regions and history of statecharts: which states each transition leaves and enters (semantics §3.3, §3.9, §4, §5).
//!
//! ```text
//! state a { state b  state c  b -> c }         b -> c   leaves b c      enters c
//! state d { state e  state f }            =>   b -> d   leaves a .. f   enters d e
//! b -> d    c -> d.f                           c -> d.f leaves a .. f   enters d f
//! ```

use super::codes;
use super::context::{Entry, Goal, Inner, Lowering, Outcome, ScopeId, Symbol, Tree, Work};
use super::receptivities::{event_list, receptivity};
use super::statements::ListKind;
use crate::chart::{self, Path, StepRole};
use crate::diag::{Diagnostic, Notation};
use crate::net::{
    Block, Enter, HistoryCase, HistoryId, InputKind, PartId, StepId, StepKind, StmtKind,
    TransitionId, TransitionKind,
};
use crate::span::Span;
use crate::walk::statements;
use std::collections::{BTreeMap, BTreeSet};

/// Reports that two goals cannot both be active; contains the state where they conflict.
struct Clash(StepId);

/// Builds the forest; runs before any transition is lowered.
pub(super) fn prepare(lowering: &mut Lowering<'_>) {
    let net = &lowering.net;
    let mut tree = Tree {
        children: vec![Vec::new(); net.steps.len()],
        roots: vec![Vec::new(); net.parts.len()],
        end: (1..=net.steps.len()).collect(),
        initial: BTreeMap::new(),
        marked: BTreeSet::new(),
    };
    for (id, step) in net.steps.iter() {
        match step.parent {
            Some(parent) => tree.children[parent.index()].push(id),
            None => tree.roots[step.part.index()].push(id),
        }
    }
    for (id, step) in net.steps.iter().rev() {
        if let Some(parent) = step.parent {
            tree.end[parent.index()] = tree.end[parent.index()].max(tree.end[id.index()]);
        }
    }
    let mut first_marked: BTreeMap<(Option<StepId>, PartId), Span> = BTreeMap::new();
    for index in 0..lowering.work.len() {
        let Work::Step { id, source, .. } = lowering.work[index] else { continue };
        if source.role != StepRole::Initial {
            continue;
        }
        let step = &lowering.net.steps[id];
        let key = (step.parent, step.part);
        if let Some(first) = first_marked.insert(key, source.name.span) {
            lowering.report(Diagnostic::twice(
                codes::SETTING_TWICE,
                "two states of the same parent are initial",
                [source.name.span, first],
                "mark only one of them: a state is entered at one child",
            ));
        }
        tree.marked.insert(id);
    }
    lowering.tree = tree;
    for index in 0..lowering.work.len() {
        let Work::State { scope, id, source } = lowering.work[index] else { continue };
        let Some((paths, content)) = &source.initial else { continue };
        let Ok(goals) = goals(lowering, scope, paths) else { continue };
        let inside = lowering.tree.inside(id);
        let all_inside = goals.iter().all(|goal| {
            let state = goal.state(lowering);
            inside.contains(&state.index()) || (state == id && matches!(goal, Goal::History(_)))
        });
        if !all_inside || goals.is_empty() {
            let name = &source.step.name;
            lowering.report(
                Diagnostic::error(
                    codes::WRONG_KIND,
                    format!("the initial transition of `{name}` leaves the state"),
                )
                .at(paths.first().map_or(name.span, Path::span), "")
                .help(format!("name a state inside `{name}`")),
            );
            continue;
        }
        lowering.tree.initial.insert(id, (goals, !content.is_empty()));
    }
}

impl Goal {
    /// The goal itself if it is a state; the state that has the history if it is a history.
    fn state(self, lowering: &Lowering<'_>) -> StepId {
        match self {
            Goal::State(state) => state,
            Goal::History(history) => lowering.net.histories[history].owner,
        }
    }
}

impl Tree {
    /// The descendants of a state, as a range of steps.
    fn inside(&self, state: StepId) -> std::ops::Range<usize> {
        state.index() + 1..self.end[state.index()]
    }

    fn children_of(&self, state: Option<StepId>, part: PartId) -> &[StepId] {
        match state {
            Some(state) => &self.children[state.index()],
            None => &self.roots[part.index()],
        }
    }
}

/// The descendants of a state, as a range of steps.
pub(super) fn inside(lowering: &Lowering<'_>, state: StepId) -> std::ops::Range<usize> {
    lowering.tree.inside(state)
}

/// The states and histories that paths refer to.
fn goals(lowering: &mut Lowering<'_>, scope: ScopeId, paths: &[Path]) -> Outcome<Vec<Goal>> {
    let mut found = Vec::new();
    let mut failed = None;
    for path in paths {
        match lowering.wanting("state", |lowering| lowering.symbol(scope, path)) {
            Ok(Symbol::Step(state)) => found.push(Goal::State(state)),
            Ok(Symbol::History(history)) => found.push(Goal::History(history)),
            Ok(other) => failed = Some(lowering.wrong_kind(path.span(), path, other, "a state")),
            Err(reported) => failed = Some(reported),
        }
    }
    failed.map_or(Ok(found), Err)
}

/// A list of entries under construction.
struct Entering<'l, 'a> {
    lowering: &'l Lowering<'a>,
    part: PartId,
    out: Vec<Enter>,
}

impl Entering<'_, '_> {
    /// Adds all entries below `domain` (`None`: the chart) that are needed for the goals to become active.
    fn below(&mut self, domain: Option<StepId>, goals: &[Goal]) -> Result<(), Clash> {
        let mut wanted: BTreeSet<StepId> = BTreeSet::new();
        let mut histories: BTreeMap<StepId, HistoryId> = BTreeMap::new();
        for goal in goals {
            let state = goal.state(self.lowering);
            if let Goal::History(history) = *goal
                && histories.insert(state, history).is_some_and(|other| other != history)
            {
                return Err(Clash(state));
            }
            let mut next = Some(state).filter(|state| Some(*state) != domain);
            while let Some(state) = next.filter(|state| wanted.insert(*state)) {
                next =
                    self.lowering.net.steps[state].parent.filter(|parent| Some(*parent) != domain);
            }
        }
        self.content(domain, &wanted, &histories)
    }

    fn state(
        &mut self,
        state: StepId,
        wanted: &BTreeSet<StepId>,
        histories: &BTreeMap<StepId, HistoryId>,
    ) -> Result<(), Clash> {
        self.out.push(Enter::Step(state));
        self.content(Some(state), wanted, histories)
    }

    /// Enters the content of a state (`None`: the chart) that is active or just entered.
    fn content(
        &mut self,
        state: Option<StepId>,
        wanted: &BTreeSet<StepId>,
        histories: &BTreeMap<StepId, HistoryId>,
    ) -> Result<(), Clash> {
        let lowering = self.lowering;
        let children = lowering.tree.children_of(state, self.part);
        let mut chosen = children.iter().copied().filter(|child| wanted.contains(child));
        if let Some(state) = state
            && let Some(history) = histories.get(&state)
        {
            if let Some(child) = chosen.next() {
                return Err(Clash(child));
            }
            self.out.push(Enter::History(*history));
            return Ok(());
        }
        match state.map_or(StepKind::Composite, |state| lowering.net.steps[state].kind) {
            StepKind::Leaf | StepKind::Final | StepKind::Enclosing => Ok(()),
            StepKind::Parallel => {
                for child in children {
                    if wanted.contains(child) {
                        self.state(*child, wanted, histories)?;
                    } else {
                        self.by_default(*child)?;
                    }
                }
                Ok(())
            }
            StepKind::Composite => match (chosen.next(), chosen.next()) {
                (Some(child), None) => self.state(child, wanted, histories),
                (Some(_), Some(other)) => Err(Clash(other)),
                (None, _) => self.initial(state),
            },
        }
    }

    fn by_default(&mut self, state: StepId) -> Result<(), Clash> {
        self.state(state, &BTreeSet::new(), &BTreeMap::new())
    }

    /// Takes the initial transition of a composite state or of the chart. If none is drawn, it leads to the child marked initial; if no child is marked, to the
    /// first child.
    fn initial(&mut self, state: Option<StepId>) -> Result<(), Clash> {
        let tree = &self.lowering.tree;
        if let Some(state) = state
            && let Some((goals, has_content)) = tree.initial.get(&state)
        {
            if *has_content {
                self.out.push(Enter::InitialContent(state));
            }
            return self.below(Some(state), goals);
        }
        match first_child(self.lowering, state, self.part) {
            Some(child) => self.by_default(child),
            None => Ok(()),
        }
    }
}

/// The entries below `domain` that are needed to reach the goals.
pub(super) fn entered(
    lowering: &mut Lowering<'_>,
    part: PartId,
    domain: Option<StepId>,
    goals: &[Goal],
    span: Span,
) -> Outcome<Vec<Enter>> {
    let mut entering = Entering { lowering, part, out: Vec::new() };
    let result = if goals.is_empty() {
        entering.content(domain, &BTreeSet::new(), &BTreeMap::new())
    } else {
        entering.below(domain, goals)
    };
    let out = entering.out;
    result.map(|()| out).map_err(|Clash(state)| {
        let name = lowering.net.steps[state].name.text.clone();
        lowering.report(
            Diagnostic::error(
                codes::CHART_KIND,
                format!("`{name}` and another target cannot be active at once"),
            )
            .at(span, "")
            .help("move the targets to different regions of one parallel state"),
        )
    })
}

/// Lowers a transition of a statechart: its single source, the states that it leaves, and the entries.
pub(super) fn transition<'a>(
    lowering: &mut Lowering<'a>,
    scope: ScopeId,
    id: TransitionId,
    source: &'a chart::Transition,
) {
    if let Some((what, help)) = grafcet_part(source) {
        lowering.report(
            Diagnostic::error(codes::CHART_KIND, format!("{what} is not allowed in a statechart"))
                .at(source.meta.span, "")
                .help(help),
        );
        return;
    }
    let from = goals(lowering, scope, &source.sources);
    let to = goals(lowering, scope, &source.targets);
    let from = from.and_then(|from| single_source(lowering, source, &from));
    let events = event_list(lowering, scope, &source.events);
    let requires = from.ok().map(|state| [state]);
    let guard =
        receptivity(lowering, scope, source, requires.as_ref().map(<[StepId; 1]>::as_slice));
    let actions = lowering.block(scope, ListKind::Change, &source.actions);
    let (Ok(from), Ok(to)) = (from, to) else { return };
    lowering.leaving[from.index()].push(id);
    let part = lowering.net.steps[from].part;
    if let Some(goal) = to.iter().find(|goal| lowering.net.steps[goal.state(lowering)].part != part)
    {
        let name = lowering.net.steps[goal.state(lowering)].name.text.clone();
        lowering.report(
            Diagnostic::error(
                codes::CHART_KIND,
                format!("a transition leads to `{name}`, which is in another chart"),
            )
            .at(source.meta.span, "")
            .help("raise an event here and react to it with `on` in the other chart"),
        );
        return;
    }
    let (kind, clears, enters) = if to.is_empty() {
        (TransitionKind::Reaction, Vec::new(), Vec::new())
    } else {
        let domain = domain(lowering, from, &to, source.is_internal);
        let clears: Vec<StepId> = match domain {
            Some(state) => lowering.tree.inside(state).map(StepId::from_index).collect(),
            // Other instances may be between the states of the chart, so its roots are not a range.
            None => lowering.tree.roots[part.index()]
                .iter()
                .flat_map(|root| root.index()..lowering.tree.end[root.index()])
                .map(StepId::from_index)
                .collect(),
        };
        let Ok(enters) = entered(lowering, part, domain, &to, source.meta.span) else { return };
        if let [Goal::History(history)] = *to.as_slice() {
            let owner = lowering.net.histories[history].owner;
            if lowering.tree.inside(owner).contains(&from.index()) {
                let is_internal = source.is_internal;
                lowering.inner_histories.push(Inner { transition: id, history, is_internal });
            }
        }
        (TransitionKind::Move, clears, enters)
    };
    let transition = &mut lowering.net.transitions[id];
    transition.kind = kind;
    transition.restart = kind == TransitionKind::Move;
    transition.requires = vec![from];
    transition.clears = clears;
    transition.enters = enters;
    transition.events = events;
    transition.actions = actions;
    if let Ok(guard) = guard {
        transition.guard = guard;
    }
}

/// The state that a transition leaves.
fn single_source(
    lowering: &mut Lowering<'_>,
    source: &chart::Transition,
    from: &[Goal],
) -> Outcome<StepId> {
    if let [Goal::State(state)] = from {
        return Ok(*state);
    }
    let span = source.sources.first().map_or(source.meta.span, Path::span);
    Err(lowering.report(
        Diagnostic::error(codes::WRONG_KIND, "a transition cannot leave a history")
            .at(span, "a state is needed here")
            .help("write the state that contains the history"),
    ))
}

/// A feature of the transition that only a Grafcet has, and what to write instead.
fn grafcet_part(source: &chart::Transition) -> Option<(&'static str, &'static str)> {
    match source.sources.len() {
        0 => Some(("a source transition", "name the state that it leaves")),
        1 if source.priority.is_some() => Some((
            "the priority of a transition",
            "remove it: the hierarchy, and then the order in the text, decide which transition fires",
        )),
        1 if source.restart => Some((
            "`restart`",
            "remove it: a transition always leaves its source and enters its targets again",
        )),
        1 => None,
        _ => Some((
            "a transition with several sources",
            "name one state before the arrow, and test the others, as in `when NAME.active`",
        )),
    }
}

/// The innermost composite state (`None`: the chart) that contains the source and all targets; for an internal transition it may be the source itself.
pub(super) fn domain(
    lowering: &Lowering<'_>,
    from: StepId,
    to: &[Goal],
    is_internal: bool,
) -> Option<StepId> {
    let mut next = if is_internal { Some(from) } else { lowering.net.steps[from].parent };
    while let Some(state) = next {
        let inside = lowering.tree.inside(state);
        let holds = |goal: &Goal| {
            let target = goal.state(lowering);
            inside.contains(&target.index())
                || (target == state && matches!(goal, Goal::History(_)))
        };
        if lowering.net.steps[state].kind == StepKind::Composite && to.iter().all(holds) {
            return Some(state);
        }
        next = lowering.net.steps[state].parent;
    }
    None
}

/// The targets of the default entry of a composite or parallel state.
fn default_goals(lowering: &Lowering<'_>, state: StepId) -> Vec<Goal> {
    let (net, tree) = (&lowering.net, &lowering.tree);
    if let Some((goals, _)) = tree.initial.get(&state) {
        return goals.clone();
    }
    let part = net.steps[state].part;
    match net.steps[state].kind {
        StepKind::Parallel => {
            tree.children_of(Some(state), part).iter().copied().map(Goal::State).collect()
        }
        StepKind::Leaf | StepKind::Final | StepKind::Enclosing | StepKind::Composite => {
            first_child(lowering, Some(state), part).map(Goal::State).into_iter().collect()
        }
    }
}

/// The child that is marked initial, or else the first child, of a state or of the chart.
fn first_child(lowering: &Lowering<'_>, state: Option<StepId>, part: PartId) -> Option<StepId> {
    let tree = &lowering.tree;
    let children = tree.children_of(state, part);
    let marked = children.iter().find(|child| tree.marked.contains(child));
    marked.or(children.first()).copied()
}

/// Lowers the parts of a state other than its step: the content of its initial transition, and its histories.
pub(super) fn state<'a>(
    lowering: &mut Lowering<'a>,
    scope: ScopeId,
    id: StepId,
    source: &'a chart::State,
) {
    if let Some((_, content)) = &source.initial {
        let content = lowering.block(scope, ListKind::Change, content);
        lowering.net.steps[id].initial_content = content;
    }
    for history in &source.histories {
        let known = lowering.scopes[scope].names.get(history.name.text.as_str());
        let Some(&Entry { symbol: Symbol::History(made), .. }) = known else { continue };
        let content = lowering.block(scope, ListKind::Change, &history.content);
        lowering.net.histories[made].default_content = content;
        // In a Grafcet the state itself is an error, and there is no forest to search.
        if !lowering.is_statechart() {
            continue;
        }
        let part = lowering.net.steps[id].part;
        let span = history.name.span;
        let goals = match history.default.as_slice() {
            [] => Ok(default_goals(lowering, id)),
            default => goals(lowering, scope, default),
        };
        if let Ok(goals) = goals
            && let Ok(mut default) = entered(lowering, part, Some(id), &goals, span)
        {
            lowering.history_goals.insert(made, goals);
            // Entry by history does not take the initial transition, even if it leads to the same states.
            default.retain(|enter| *enter != Enter::InitialContent(id));
            lowering.net.histories[made].default = default;
        }
        let cases = cases(lowering, id, history.is_deep, span);
        lowering.net.histories[made].cases = cases;
    }
}

/// The cases of a history: the states that it records and enters again. A shallow history has the children of its state; a deep history has the atomic
/// descendants with all states between.
fn cases(
    lowering: &mut Lowering<'_>,
    owner: StepId,
    is_deep: bool,
    span: Span,
) -> Vec<HistoryCase> {
    let part = lowering.net.steps[owner].part;
    let recorded: Vec<StepId> = if is_deep {
        let inside = lowering.tree.inside(owner).map(StepId::from_index);
        inside
            .filter(|step| {
                matches!(lowering.net.steps[*step].kind, StepKind::Leaf | StepKind::Final)
            })
            .collect()
    } else {
        lowering.tree.children[owner.index()].clone()
    };
    let mut cases = Vec::with_capacity(recorded.len());
    for step in recorded {
        let enters = if is_deep {
            let mut path = vec![Enter::Step(step)];
            let mut next = lowering.net.steps[step].parent;
            while let Some(state) = next.filter(|state| *state != owner) {
                path.push(Enter::Step(state));
                next = lowering.net.steps[state].parent;
            }
            path.reverse();
            path
        } else {
            let mut entering = Entering { lowering, part, out: Vec::new() };
            let result = entering.by_default(step);
            let out = entering.out;
            if result.is_err() {
                // A conflict in the initial transition is reported where the state is entered by default.
                lowering.report(
                    Diagnostic::error(
                        codes::CHART_KIND,
                        "the states that this history enters cannot be active at once",
                    )
                    .at(span, "")
                    .help("check the initial transitions of the states inside"),
                );
            }
            out
        };
        cases.push(HistoryCase { step, enters });
    }
    cases
}

/// Pass `statecharts`: the states that reset enters, and a bound for the queues. Runs after `behaviour` and `outputs`, whose lists raise and send
/// events.
pub(super) fn statecharts(lowering: &mut Lowering<'_>) {
    if !lowering.is_statechart() {
        return;
    }
    for part in lowering.net.parts.ids() {
        let span = lowering.net.parts[part].name.span;
        let Ok(goals) = initial_goals(lowering, part) else { continue };
        if let Ok(initial) = entered(lowering, part, None, &goals, span) {
            lowering.net.parts[part].initial = initial;
        }
    }
    for (name, span) in step_priorities(lowering) {
        lowering.report(
            Diagnostic::error(
                codes::CHART_KIND,
                "the priority of a step is not allowed in a statechart",
            )
            .at(span, format!("step `{name}`"))
            .help("remove it: the order of the transitions decides"),
        );
    }
    queues(lowering);
}

/// The states that reset enters according to the chart; empty if its outermost states decide.
fn initial_goals(lowering: &mut Lowering<'_>, part: PartId) -> Outcome<Vec<Goal>> {
    let design = lowering.design;
    let chart = lowering.chart_bodies.iter().position(|(_, parts)| parts.start == part.index());
    let Some((scope, paths)) = chart.and_then(|chart| {
        Some((lowering.chart_bodies[chart].0, &design.charts.get(chart)?.initial))
    }) else {
        return Ok(Vec::new());
    };
    let goals = goals(lowering, scope, paths)?;
    match goals.iter().find(|goal| lowering.net.steps[goal.state(lowering)].part != part) {
        None => Ok(goals),
        Some(goal) => {
            let name = lowering.net.steps[goal.state(lowering)].name.text.clone();
            let span = paths.first().map_or(Span::default(), Path::span);
            Err(lowering.report(
                Diagnostic::error(
                    codes::WRONG_KIND,
                    format!("reset cannot enter `{name}`, which is in another chart"),
                )
                .at(span, "")
                .help("use states of this chart"),
            ))
        }
    }
}

fn step_priorities(lowering: &Lowering<'_>) -> Vec<(String, Span)> {
    let steps = lowering.net.steps.values().filter(|step| step.priority.is_some());
    steps.map(|step| (step.name.text.clone(), step.name.span)).collect()
}

/// Determines the bound of the queues if the designer gives none. Without raised events and undelayed sends, the external queue contains at most the
/// events of one row and every slot once; otherwise a missing bound is an error.
fn queues(lowering: &mut Lowering<'_>) {
    if lowering.net.settings.queue.is_some() {
        return;
    }
    let net = &lowering.net;
    let mut first: Option<Span> = None;
    for step in net.steps.values() {
        for list in [&step.entry, &step.exit, &step.initial_content] {
            first = first.or(unbounded(lowering, list));
        }
        if let Some(event) = step.done_event {
            first = first.or(Some(net.inputs[event].name.span));
        }
    }
    for transition in net.transitions.values() {
        first = first.or(unbounded(lowering, &transition.actions));
    }
    for history in net.histories.values() {
        first = first.or(unbounded(lowering, &history.default_content));
    }
    for action in net.actions.values() {
        first = first.or(unbounded(lowering, &action.body));
    }
    if let Some(span) = first {
        lowering.report(
            Diagnostic::error(codes::QUEUE_NEEDED, "events are raised or sent without delay, but the queues have no bound")
                .at(span, "adds to a queue")
                .help("write `queue 4` for 4 events in each queue; a further event is dropped and sets `fault`")
                .help_in(
                    Notation::Scxml,
                    "write g:queue=\"4\" on <scxml> for 4 events in each queue; a further event is dropped and sets the fault",
                ),
        );
        return;
    }
    let n_slots = net.sends.len();
    if n_slots > 0 {
        let in_a_row = net.inputs.values().filter(|input| input.kind == InputKind::Event).count();
        let in_a_row = if net.settings.events_exclusive { in_a_row.min(1) } else { in_a_row };
        lowering.net.settings.queue = u32::try_from(in_a_row + n_slots).ok();
    }
}

/// The first statement of a list that adds to a queue without delay.
fn unbounded(lowering: &Lowering<'_>, block: &Block) -> Option<Span> {
    statements(block).find_map(|stmt| match &stmt.kind {
        StmtKind::Raise(_) => Some(stmt.span),
        StmtKind::Send(slot) if lowering.net.sends[*slot].delay == 0 => Some(stmt.span),
        StmtKind::Send(_)
        | StmtKind::If { .. }
        | StmtKind::Assign { .. }
        | StmtKind::Cancel(_)
        | StmtKind::Call { .. }
        | StmtKind::Code(_) => None,
    })
}
