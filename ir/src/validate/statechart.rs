//! The structure of statecharts (invariants 26 to 31).

use super::Checker;
use super::expressions::Place;
use super::statements::ListKind;
use super::structure::entered_steps;
use crate::arena::IdMap;
use crate::codes;
use crate::interval::DEPTH_LIMIT;
use crate::net::{
    Enter, Evolution, PartId, Step, StepId, StepKind, Stmt, StmtKind, Transition, TransitionKind,
};
use crate::span::Span;
use std::collections::{BTreeMap, BTreeSet};

/// The domain of a list of entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Domain {
    /// A whole chart.
    Part(PartId),
    /// A state that is active before the entries and stays active.
    State(StepId),
    /// Like `State`, for one of several lists that are entered together: this list alone need not be complete.
    Share(StepId),
}

/// The states that a list enters.
#[derive(Default)]
struct Entered {
    states: BTreeSet<StepId>,
    /// The number of entered children of each state, or of roots.
    counts: BTreeMap<Option<StepId>, usize>,
    /// The states that a history enters.
    covered: BTreeSet<StepId>,
}

impl Entered {
    /// Why the entries within a state (or chart, `None`) do not complete a configuration.
    fn incomplete(
        &self,
        state: Option<StepId>,
        is_parallel: bool,
        wanted: usize,
        name: &str,
    ) -> Option<String> {
        let by_history = state.is_some_and(|state| self.covered.contains(&state));
        let count = self.counts.get(&state).copied().unwrap_or(0) + usize::from(by_history);
        if !by_history && is_parallel && count != wanted {
            Some(format!("enters {count} of the {wanted} regions of `{name}`, but must enter all"))
        } else if !is_parallel && count != 1 {
            Some(format!("enters {count} states within `{name}`, but must enter exactly one"))
        } else {
            None
        }
    }
}

/// The states as a forest; it contains only valid links, so it has no cycle.
struct Forest {
    children: IdMap<Step, Vec<StepId>>,
    /// Number of proper descendants.
    below: IdMap<Step, usize>,
    /// Position in depth-first order, to test for descendants.
    entry: IdMap<Step, usize>,
}

impl Forest {
    fn is_below(&self, inner: StepId, outer: StepId) -> bool {
        let (at, from) = (self.entry[inner], self.entry[outer]);
        at > from && at <= from + self.below[outer]
    }
}

impl Checker<'_> {
    pub(super) fn statechart_structure(&mut self) {
        self.no_grafcet_parts();
        let forest = self.states();
        self.queue_bound();
        let net = self.net;
        for (id, part) in net.parts.iter() {
            let span = part.name.span;
            self.entered(&part.initial, span);
            let step_name = |id: StepId| net.steps.get(id).map(|step| step.name.text.clone());
            self.twice(&entered_steps(&part.initial), span, "what is entered at reset", step_name);
            self.configuration(
                &part.initial,
                Domain::Part(id),
                &forest,
                span,
                &format!("the chart `{}`", part.name),
            );
        }
        let mut per_part: BTreeMap<PartId, usize> = BTreeMap::new();
        for step in net.steps.values() {
            *per_part.entry(step.part).or_default() += 1;
        }
        let mut stamp = IdMap::filled(&net.steps, usize::MAX);
        for (id, transition) in net.transitions.iter() {
            self.statechart_transition(transition, id.index(), &mut stamp, &forest, &per_part);
        }
        self.histories(&forest);
    }

    fn no_grafcet_parts(&mut self) {
        let net = self.net;
        let code = codes::WRONG_WORLD;
        let chart = net.name.span;
        if net.settings.evolution == Evolution::Single {
            let message =
                "the conflict policy makes this a statechart, but the evolution is single";
            self.report_with_help(codes::SETTINGS, chart, message, "use `evolution stable`");
        }
        if net.settings.fire_one {
            self.report(
                codes::SETTINGS,
                chart,
                "`fire one` is set, but a statechart takes all transitions that it selects",
            );
        }
        for forcing in &net.forcings {
            self.report(code, forcing.span, "a forcing order is not allowed in a statechart");
        }
        for drawn in &net.macros {
            self.report(
                code,
                drawn.name.span,
                format!("the macro-step `{}` is not allowed in a statechart", drawn.name),
            );
        }
        for step in net.steps.values() {
            let (name, span) = (&step.name, step.name.span);
            let what = match step.kind {
                StepKind::Enclosing => "is an enclosing step",
                _ if step.activation_link => "has an activation link",
                _ if step.priority.is_some() => "has a priority",
                _ if step.is_initial => {
                    "is marked as initial, but `initial` of its chart determines what is entered"
                }
                StepKind::Leaf | StepKind::Composite | StepKind::Parallel | StepKind::Final => {
                    continue;
                }
            };
            self.report(
                code,
                span,
                format!("`{name}` {what}, which is not allowed in a statechart"),
            );
        }
    }

    /// Checks kinds, parents and children of states; returns the forest.
    fn states(&mut self) -> Forest {
        let net = self.net;
        let mut children: IdMap<Step, Vec<StepId>> = IdMap::filled(&net.steps, Vec::new());
        for (id, step) in net.steps.iter() {
            let (name, span) = (&step.name, step.name.span);
            self.has(&net.parts, step.part, span, "partial chart");
            let Some(parent_id) = step.parent else { continue };
            if !self.has(&net.steps, parent_id, span, "step") {
                continue;
            }
            let parent = &net.steps[parent_id];
            let complaint = if parent_id >= id {
                "which is declared after it"
            } else if parent.part != step.part {
                "which is in another chart"
            } else if !matches!(parent.kind, StepKind::Composite | StepKind::Parallel) {
                "which is neither composite nor parallel"
            } else {
                children[parent_id].push(id);
                if parent.kind == StepKind::Parallel && step.kind == StepKind::Final {
                    let message =
                        format!("`{name}` is final, but a child of the parallel `{}`", parent.name);
                    self.report(codes::HIERARCHY, span, message);
                }
                continue;
            };
            self.report(
                codes::HIERARCHY,
                span,
                format!("the parent of `{name}` is `{}`, {complaint}", parent.name),
            );
        }
        for (id, step) in net.steps.iter() {
            let (name, span) = (&step.name, step.name.span);
            let is_nest = matches!(step.kind, StepKind::Composite | StepKind::Parallel);
            if is_nest && children[id].is_empty() {
                self.report(
                    codes::HIERARCHY,
                    span,
                    format!("the state `{name}` has no children, but is not atomic"),
                );
            }
            if step.kind != StepKind::Composite && !step.initial_content.is_empty() {
                let message =
                    format!("`{name}` has an initial transition, but is not a composite state");
                self.report(codes::HIERARCHY, span, message);
            }
            if let Some(event) = step.done_event
                && self.has(&net.inputs, event, span, "event")
                && !(is_nest && self.is_event(event))
            {
                let message = format!(
                    "the done event of `{name}` is not an event, or `{name}` is neither composite nor parallel"
                );
                self.report(codes::HIERARCHY, span, message);
            }
        }
        walk(net, children)
    }

    fn queue_bound(&mut self) {
        /// True if the list raises or sends an event, down to this depth; lists beyond the depth limit
        /// are reported elsewhere.
        fn raises_within(list: &[Stmt], depth: usize) -> bool {
            depth > 0
                && list.iter().any(|stmt| match &stmt.kind {
                    StmtKind::Raise(_) | StmtKind::Send(_) => true,
                    StmtKind::If { then, otherwise, .. } => {
                        raises_within(then, depth - 1) || raises_within(otherwise, depth - 1)
                    }
                    _ => false,
                })
        }
        let raises = |list: &[Stmt]| raises_within(list, DEPTH_LIMIT);
        let net = self.net;
        if net.settings.queue.is_some() {
            return;
        }
        let steps = net.steps.values();
        let needed = steps.clone().any(|step| step.done_event.is_some())
            || steps
                .flat_map(|step| [&step.entry, &step.exit, &step.initial_content])
                .any(|list| raises(list))
            || net.transitions.values().any(|transition| raises(&transition.actions))
            || net.histories.values().any(|history| raises(&history.default_content))
            || net.actions.values().any(|action| raises(&action.body));
        if needed {
            let message = "events are raised or sent, but the queues have no bound";
            self.report_with_help(
                codes::SETTINGS,
                net.name.span,
                message,
                "write `queue N` for at most N events",
            );
        }
    }

    fn statechart_transition(
        &mut self,
        transition: &Transition,
        index: usize,
        stamp: &mut IdMap<Step, usize>,
        forest: &Forest,
        per_part: &BTreeMap<PartId, usize>,
    ) {
        let net = self.net;
        let (name, span) = (&transition.name, transition.name.span);
        let Some(source) = self.single_source(transition) else { return };
        if transition.kind == TransitionKind::Reaction {
            return;
        }
        if !transition.restart {
            let message = format!(
                "the transition `{name}` does not restart, but in a statechart every transition does"
            );
            self.report(codes::WRONG_WORLD, span, message);
        }
        if transition.enters.is_empty() {
            let message = format!(
                "the transition `{name}` has no target; in a statechart only a reaction has none"
            );
            self.report(codes::WRONG_WORLD, span, message);
        }
        if transition.clears.iter().any(|step| net.steps.get(*step).is_none()) {
            return;
        }
        for step in &transition.clears {
            stamp[*step] = index;
        }
        let in_clears = |step: StepId| stamp[step] == index;
        let inside = |domain| match domain {
            Domain::State(state) | Domain::Share(state) => forest.below[state],
            Domain::Part(part) => per_part.get(&part).copied().unwrap_or(0),
        };
        let Some(domain) = self.domain(transition, source, in_clears, inside) else { return };
        let who = format!("the transition `{name}`");
        self.configuration(&transition.enters, domain, forest, span, &who);
    }

    /// Checks what a transition is by itself; gives its source.
    fn single_source(&mut self, transition: &Transition) -> Option<StepId> {
        let net = self.net;
        let (name, span) = (&transition.name, transition.name.span);
        if transition.priority.is_some() && transition.kind == TransitionKind::Move {
            let message = format!(
                "the transition `{name}` has a priority, which is not allowed in a statechart"
            );
            self.report(codes::WRONG_WORLD, span, message);
        }
        let &[source] = transition.requires.as_slice() else {
            if transition.kind == TransitionKind::Move {
                let count = transition.requires.len();
                let message = format!(
                    "the transition `{name}` has {count} sources; in a statechart it must have one"
                );
                self.report(codes::WRONG_WORLD, span, message);
            }
            return None;
        };
        let state = net.steps.get(source)?;
        if state.part != transition.part {
            let message = format!(
                "the transition `{name}` and its source `{}` are in different charts",
                state.name
            );
            self.report(codes::HIERARCHY, span, message);
        }
        if state.kind == StepKind::Final {
            let message =
                format!("the transition `{name}` leaves the final state `{}`", state.name);
            self.report(codes::TRANSITION, span, message);
        }
        Some(source)
    }

    /// The domain of a transition: it leaves exactly what is inside.
    fn domain(
        &mut self,
        transition: &Transition,
        source: StepId,
        in_clears: impl Fn(StepId) -> bool,
        inside: impl Fn(Domain) -> usize,
    ) -> Option<Domain> {
        let net = self.net;
        let (name, span) = (&transition.name, transition.name.span);
        let outer = |step: &StepId| {
            net.steps[*step].parent.filter(|parent| net.steps.get(*parent).is_some())
        };
        let mut tops = transition
            .clears
            .iter()
            .filter(|step| outer(step).is_none_or(|parent| !in_clears(parent)));
        let Some(top) = tops.next() else {
            let message = format!("the transition `{name}` leaves no state");
            self.report(codes::TRANSITION, span, message);
            return None;
        };
        let domain = match outer(top) {
            Some(state) => Domain::State(state),
            None => Domain::Part(net.steps[*top].part),
        };
        let same = tops.all(|other| {
            outer(other) == outer(top) && net.steps[*other].part == net.steps[*top].part
        });
        if !same || transition.clears.len() != inside(domain) {
            let message = format!(
                "the transition `{name}` does not leave exactly the descendants of one state"
            );
            self.report(codes::TRANSITION, span, message);
            return None;
        }
        if let Domain::State(state) = domain
            && net.steps[state].kind != StepKind::Composite
        {
            let message = format!(
                "the transition `{name}` moves within `{}`, which is not composite",
                net.steps[state].name
            );
            self.report(codes::TRANSITION, span, message);
        }
        if !in_clears(source) && domain != Domain::State(source) {
            let message = format!(
                "the transition `{name}` leaves states that do not include its source `{}`",
                net.steps[source].name
            );
            self.report(codes::TRANSITION, span, message);
        }
        Some(domain)
    }

    /// Invariant 30: the entered states complete a configuration below `domain`.
    fn configuration(
        &mut self,
        list: &[Enter],
        domain: Domain,
        forest: &Forest,
        span: Span,
        who: &str,
    ) {
        let net = self.net;
        let Some(entered) = self.entered_states(list, domain, span, who) else { return };
        let mut complete = |state: Option<StepId>, is_parallel: bool, wanted: usize, name: &str| {
            if let Some(message) = entered.incomplete(state, is_parallel, wanted, name) {
                self.report(codes::CONFIGURATION, span, format!("{who} {message}"));
            }
        };
        match domain {
            Domain::Part(part) => {
                let name = net.parts.get(part).map_or("", |part| part.name.text.as_str());
                complete(None, false, 1, name);
            }
            Domain::State(state) => {
                let step = &net.steps[state];
                let is_parallel = step.kind == StepKind::Parallel;
                complete(Some(state), is_parallel, forest.children[state].len(), &step.name.text);
            }
            Domain::Share(_) => {}
        }
        for id in entered.states.iter().copied() {
            let step = &net.steps[id];
            let name = step.name.text.as_str();
            match (step.kind, domain) {
                (StepKind::Composite, _) => complete(Some(id), false, 1, name),
                (StepKind::Parallel, Domain::Part(_) | Domain::State(_)) => {
                    complete(Some(id), true, forest.children[id].len(), name);
                }
                (StepKind::Parallel, Domain::Share(_))
                | (StepKind::Leaf | StepKind::Enclosing | StepKind::Final, _) => {}
            }
        }
    }

    /// Checks that each entry follows the entry of its parent; `None` if they cannot be counted.
    fn entered_states(
        &mut self,
        list: &[Enter],
        domain: Domain,
        span: Span,
        who: &str,
    ) -> Option<Entered> {
        let net = self.net;
        let code = codes::CONFIGURATION;
        let base = match domain {
            Domain::Part(_) => None,
            Domain::State(state) | Domain::Share(state) => Some(state),
        };
        let mut entered = Entered::default();
        for enter in list {
            match *enter {
                Enter::Step(id) => {
                    let step = net.steps.get(id)?;
                    let at_home = match step.parent {
                        Some(parent) => entered.states.contains(&parent) || base == Some(parent),
                        None => domain == Domain::Part(step.part),
                    };
                    if !at_home {
                        let message = format!(
                            "{who} enters `{}` without first entering its parent",
                            step.name
                        );
                        self.report(code, span, message);
                        return None;
                    }
                    *entered.counts.entry(step.parent).or_default() += 1;
                    entered.states.insert(id);
                }
                Enter::InitialContent(id) => {
                    let step = net.steps.get(id)?;
                    if step.kind != StepKind::Composite || !entered.states.contains(&id) {
                        let message = format!(
                            "{who} runs the initial content of `{}`, which is not a composite state entered before",
                            step.name
                        );
                        self.report(code, span, message);
                    }
                }
                Enter::History(id) => {
                    let history = net.histories.get(id)?;
                    if !entered.states.contains(&history.owner) && base != Some(history.owner) {
                        let message = format!(
                            "{who} enters the history `{}` without first entering its state",
                            history.name
                        );
                        self.report(code, span, message);
                        return None;
                    }
                    entered.covered.insert(history.owner);
                }
            }
        }
        Some(entered)
    }

    fn histories(&mut self, forest: &Forest) {
        let net = self.net;
        for history in net.histories.values() {
            let (name, span) = (&history.name, history.name.span);
            self.list(&history.default_content, Place::List, ListKind::Free, 0);
            self.entered(&history.default, span);
            for case in &history.cases {
                self.has(&net.steps, case.step, span, "step");
                self.entered(&case.enters, span);
            }
            if !self.has(&net.steps, history.owner, span, "step") {
                continue;
            }
            let owner = &net.steps[history.owner];
            if !matches!(owner.kind, StepKind::Composite | StepKind::Parallel) {
                let message = format!(
                    "the history `{name}` belongs to `{}`, which has no children",
                    owner.name
                );
                self.report(codes::HISTORY, span, message);
                continue;
            }
            let recorded: Vec<StepId> = history.cases.iter().map(|case| case.step).collect();
            let step_name = |id: StepId| net.steps.get(id).map(|step| step.name.text.clone());
            self.twice(&recorded, span, "the recorded states", step_name);
            for step in recorded.iter().filter(|step| net.steps.get(**step).is_some()) {
                if !forest.is_below(*step, history.owner) {
                    let (step, owner) = (&net.steps[*step].name, &owner.name);
                    let message = format!(
                        "the history `{name}` records `{step}`, which is not inside `{owner}`"
                    );
                    self.report(codes::HISTORY, span, message);
                }
            }
            let lists = std::iter::once(&history.default)
                .chain(history.cases.iter().map(|case| &case.enters));
            for enter in lists.flatten() {
                let Enter::History(inner) = enter else { continue };
                let inner =
                    net.histories.get(*inner).filter(|inner| net.steps.get(inner.owner).is_some());
                if let Some(inner) = inner
                    && !forest.is_below(inner.owner, history.owner)
                {
                    let message = format!(
                        "the history `{name}` enters the history `{}`, which is not inside",
                        inner.name
                    );
                    self.report(codes::HISTORY, span, message);
                }
            }
            let who = format!("the history `{name}`");
            self.configuration(&history.default, Domain::State(history.owner), forest, span, &who);
            for case in &history.cases {
                self.configuration(&case.enters, Domain::Share(history.owner), forest, span, &who);
            }
        }
    }
}

/// Numbers the forest depth first, without recursion, because the nesting depth of states is not bounded.
fn walk(net: &crate::net::Net, children: IdMap<Step, Vec<StepId>>) -> Forest {
    let mut is_root = IdMap::filled(&net.steps, true);
    for child in children.values().flatten() {
        is_root[*child] = false;
    }
    let mut forest = Forest {
        children,
        below: IdMap::filled(&net.steps, 0),
        entry: IdMap::filled(&net.steps, 0),
    };
    let mut order = Vec::with_capacity(net.steps.len());
    let mut stack: Vec<StepId> = net.steps.ids().rev().filter(|id| is_root[*id]).collect();
    while let Some(id) = stack.pop() {
        forest.entry[id] = order.len();
        order.push(id);
        stack.extend(forest.children[id].iter().rev());
    }
    for id in order.into_iter().rev() {
        let below: usize = forest.children[id].iter().map(|child| forest.below[*child] + 1).sum();
        forest.below[id] = below;
    }
    forest
}
