//! Turns the states of a statechart net into states of a chart: hierarchy, regions, histories, and the targets of each transition.
//!
//! For each transition, a net lists the states that it leaves and, in order, the states that it enters. This module writes the fewest targets that restore
//! these lists: a composite state entered by its initial transition is named alone; otherwise its inner states are named. The
//! target of the initial transition of a state is taken from the entries that certainly use that transition (its content runs, or a history
//! enters the state), otherwise from the most frequent entry of the state. A transition is written in the innermost state in which the
//! order of the net can be kept.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use grafsynth_ir::chart::{
    History, Item, Path, State, StepItem, StepItemKind, StepRole, Transition,
};
use grafsynth_ir::net::{
    Enter, HistoryId, Net, PartId, StepId, StepKind, TransitionId, TransitionKind,
};
use grafsynth_ir::{Diagnostic, Name, net};

use super::bodies::BodyId;
use super::{Writer, cannot};

/// Maximum nesting depth of states, the same as for the bodies of a chart.
const MAX_DEPTH: usize = 250;

/// A target of a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Goal {
    State(StepId),
    History(HistoryId),
}

/// The forest of states of a net.
#[derive(Debug, Default)]
pub(super) struct States {
    /// For each step, its children in document order.
    children: Vec<Vec<StepId>>,
    /// For each part, its outermost states.
    roots: Vec<Vec<StepId>>,
    /// For each step, the index after its last descendant.
    end: Vec<usize>,
    /// For each step, its histories.
    histories: BTreeMap<StepId, Vec<HistoryId>>,
    /// For each composite state: the entries that follow it if its initial transition is taken, without its own [`Enter::InitialContent`].
    defaults: BTreeMap<StepId, Vec<Enter>>,
    /// States that are marked as initial.
    pub(super) marked: BTreeSet<StepId>,
    /// Transitions that an `otherwise` refers to.
    looked_at: BTreeSet<TransitionId>,
    /// Reactions that are written in the body of their state; no `otherwise` counts them.
    pub(super) in_bodies: BTreeSet<TransitionId>,
    /// Transitions of the current chart that are not written yet.
    waiting: VecDeque<TransitionId>,
}

impl States {
    /// The forest of a statechart. Reports what no chart can express.
    pub(super) fn of(net: &Net, findings: &mut Vec<Diagnostic>) -> States {
        let mut states = States {
            children: vec![Vec::new(); net.steps.len()],
            roots: vec![Vec::new(); net.parts.len()],
            end: (1..=net.steps.len()).collect(),
            ..States::default()
        };
        let mut depth = vec![1_usize; net.steps.len()];
        for (id, step) in net.steps.iter() {
            match step.parent {
                Some(parent) if parent < id => {
                    depth[id.index()] = depth[parent.index()] + 1;
                    states.children[parent.index()].push(id);
                }
                Some(_) => {
                    findings.push(cannot(order_of_states(&step.name), step.name.span));
                    return States::default();
                }
                None => states.roots[step.part.index()].push(id),
            }
            if depth[id.index()] == MAX_DEPTH {
                findings.push(cannot(
                    format!(
                        "the state `{}`, which is nested more than {MAX_DEPTH} levels deep",
                        step.name
                    ),
                    step.name.span,
                ));
                return States::default();
            }
        }
        for (id, step) in net.steps.iter().rev() {
            if let Some(parent) = step.parent {
                let end = states.end[id.index()];
                states.end[parent.index()] = states.end[parent.index()].max(end);
            }
        }
        states.check_order(net, findings);
        for (id, history) in net.histories.iter() {
            states.histories.entry(history.owner).or_default().push(id);
        }
        for transition in net.transitions.values() {
            states.looked_at.extend(looked_at(&transition.guard));
        }
        states.find_defaults(net, findings);
        states
    }

    /// Checks that a state directly precedes its descendants, and that the states of different charts are not mixed.
    fn check_order(&self, net: &Net, findings: &mut Vec<Diagnostic>) {
        let mut expected = 0;
        let mut todo: Vec<StepId> = self.roots.iter().flatten().rev().copied().collect();
        while let Some(step) = todo.pop() {
            let part = net.steps[step].parent.map(|parent| net.steps[parent].part);
            if step.index() != expected || part.is_some_and(|part| part != net.steps[step].part) {
                let name = &net.steps[step].name;
                findings.push(cannot(order_of_states(name), name.span));
                return;
            }
            expected += 1;
            todo.extend(self.children[step.index()].iter().rev());
        }
    }

    fn lies_in(&self, step: StepId, state: StepId) -> bool {
        state < step && step.index() < self.end[state.index()]
    }

    /// The index after the last entry of a list that belongs to the state entered at `at`.
    fn end_of(&self, net: &Net, list: &[Enter], at: usize, state: StepId) -> usize {
        let belongs = |enter: &Enter| match *enter {
            Enter::Step(step) => self.lies_in(step, state),
            Enter::InitialContent(owner) => owner == state || self.lies_in(owner, state),
            Enter::History(history) => {
                let owner = net.histories[history].owner;
                owner == state || self.lies_in(owner, state)
            }
        };
        at + 1 + list[at + 1..].iter().take_while(|enter| belongs(enter)).count()
    }

    fn find_defaults(&mut self, net: &Net, findings: &mut Vec<Diagnostic>) {
        let mut sure: BTreeMap<StepId, Vec<Enter>> = BTreeMap::new();
        // For each composite state: the different lists of states that are entered in it, in order, with their numbers of occurrences.
        let mut seen: BTreeMap<StepId, Vec<(Vec<Enter>, usize)>> = BTreeMap::new();
        let mut note = |state: StepId, rest: &[Enter]| match sure.get(&state) {
            None => {
                sure.insert(state, rest.to_vec());
            }
            Some(known) if known == rest => {}
            Some(_) => {
                let name = &net.steps[state].name;
                findings.push(cannot(
                    format!("two initial transitions of the state `{name}`"),
                    name.span,
                ));
            }
        };
        let mut lists: Vec<&[Enter]> = net.parts.values().map(|it| it.initial.as_slice()).collect();
        lists.extend(net.transitions.values().map(|it| it.enters.as_slice()));
        for history in net.histories.values() {
            lists.push(&history.default);
            for case in &history.cases {
                lists.push(&case.enters);
                // A shallow history enters the child as a transition to it would.
                if net.steps[case.step].parent == Some(history.owner)
                    && net.steps[case.step].kind == StepKind::Composite
                    && case.enters.first() == Some(&Enter::Step(case.step))
                {
                    let rest = match case.enters.get(1) {
                        Some(Enter::InitialContent(state)) if *state == case.step => {
                            &case.enters[2..]
                        }
                        Some(_) | None => &case.enters[1..],
                    };
                    note(case.step, rest);
                }
            }
        }
        for list in lists {
            for (at, enter) in list.iter().enumerate() {
                let Enter::Step(state) = *enter else { continue };
                if net.steps[state].kind != StepKind::Composite {
                    continue;
                }
                let rest = &list[at + 1..self.end_of(net, list, at, state)];
                if let Some((Enter::InitialContent(owner), rest)) = rest.split_first()
                    && *owner == state
                {
                    note(state, rest);
                } else if net.steps[state].initial_content.is_empty() && !rest.is_empty() {
                    let lists = seen.entry(state).or_default();
                    match lists.iter().position(|(known, _)| known == rest) {
                        Some(place) => lists[place].1 += 1,
                        // With so many different entries, searching for the initial transition is pointless.
                        None if lists.len() >= 64 => {}
                        None => lists.push((rest.to_vec(), 1)),
                    }
                }
            }
        }
        for (state, mut lists) in seen {
            // The sort is stable: of two equally frequent lists, the earlier one stays first.
            lists.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            if let Some((list, _)) = lists.into_iter().next() {
                sure.entry(state).or_insert(list);
            }
        }
        self.defaults = sure;
    }

    /// The parts of a list that belong to each child of a parallel state; `None` if it does not contain one part per child.
    fn regions<'l>(
        &self,
        net: &Net,
        state: StepId,
        inner: &'l [Enter],
    ) -> Option<Vec<(StepId, &'l [Enter])>> {
        let mut at = 0;
        let mut found = Vec::new();
        for child in &self.children[state.index()] {
            if inner.get(at) != Some(&Enter::Step(*child)) {
                return None;
            }
            let end = self.end_of(net, inner, at, *child);
            found.push((*child, &inner[at + 1..end]));
            at = end;
        }
        (at == inner.len()).then_some(found)
    }

    /// Whether entering this state without further targets gives this list.
    fn is_default(&self, net: &Net, state: StepId, inner: &[Enter]) -> bool {
        match net.steps[state].kind {
            StepKind::Leaf | StepKind::Final | StepKind::Enclosing => inner.is_empty(),
            StepKind::Parallel => self.regions(net, state, inner).is_some_and(|regions| {
                regions.iter().all(|(child, inner)| self.is_default(net, *child, inner))
            }),
            StepKind::Composite => {
                let (has_content, rest) = match inner.split_first() {
                    Some((Enter::InitialContent(owner), rest)) if *owner == state => (true, rest),
                    Some(_) | None => (false, inner),
                };
                has_content != net.steps[state].initial_content.is_empty()
                    && self.defaults.get(&state).is_some_and(|default| default == rest)
            }
        }
    }

    /// Adds the fewest targets that restore a list; `None` if no targets do.
    fn goals(&self, net: &Net, list: &[Enter], out: &mut Vec<Goal>) -> Option<()> {
        let mut at = 0;
        while let Some(enter) = list.get(at) {
            match *enter {
                Enter::History(history) => {
                    out.push(Goal::History(history));
                    at += 1;
                }
                Enter::InitialContent(_) => return None,
                Enter::Step(state) => {
                    let end = self.end_of(net, list, at, state);
                    self.goals_of(net, state, &list[at + 1..end], out)?;
                    at = end;
                }
            }
        }
        Some(())
    }

    fn goals_of(
        &self,
        net: &Net,
        state: StepId,
        inner: &[Enter],
        out: &mut Vec<Goal>,
    ) -> Option<()> {
        if self.is_default(net, state, inner) {
            out.push(Goal::State(state));
            return Some(());
        }
        if net.steps[state].kind != StepKind::Parallel {
            return if inner.is_empty() { None } else { self.goals(net, inner, out) };
        }
        if let [Enter::History(history)] = inner
            && net.histories[*history].owner == state
        {
            out.push(Goal::History(*history));
            return Some(());
        }
        for (child, inner) in self.regions(net, state, inner)? {
            // Children without a target inside are entered by default.
            if !self.is_default(net, child, inner) {
                self.goals_of(net, child, inner, out)?;
            }
        }
        Some(())
    }

    /// The innermost composite state around the source that contains all targets, as determined by lowering; `None` for the chart.
    fn domain(&self, net: &Net, from: StepId, goals: &[Goal], is_internal: bool) -> Option<StepId> {
        let mut next = if is_internal { Some(from) } else { net.steps[from].parent };
        while let Some(state) = next {
            let holds = |goal: &Goal| match *goal {
                Goal::State(target) => self.lies_in(target, state),
                Goal::History(history) => {
                    let owner = net.histories[history].owner;
                    owner == state || self.lies_in(owner, state)
                }
            };
            if net.steps[state].kind == StepKind::Composite && goals.iter().all(holds) {
                return Some(state);
            }
            next = net.steps[state].parent;
        }
        None
    }

    /// The targets of a transition, and whether it is internal.
    fn targets(&self, net: &Net, transition: &net::Transition) -> Option<(Vec<Goal>, bool)> {
        let [from] = transition.requires.as_slice() else { return None };
        let first = transition.enters.first()?;
        let domain = match *first {
            Enter::Step(state) => net.steps[state].parent,
            Enter::History(history) => Some(net.histories[history].owner),
            Enter::InitialContent(_) => return None,
        };
        let cleared: Vec<StepId> = match domain {
            Some(state) => {
                (state.index() + 1..self.end[state.index()]).map(StepId::from_index).collect()
            }
            None => self.roots[transition.part.index()]
                .iter()
                .flat_map(|root| root.index()..self.end[root.index()])
                .map(StepId::from_index)
                .collect(),
        };
        if cleared != transition.clears {
            return None;
        }
        let is_internal = domain == Some(*from);
        let mut goals = Vec::new();
        self.goals(net, &transition.enters, &mut goals)?;
        // If the only target is a history of a state around the source, the states that are left would depend on the recorded ones
        // (semantics C35).
        let is_inner = |history: HistoryId| {
            let owner = net.histories[history].owner;
            self.lies_in(*from, owner) && (is_internal || net.steps[*from].parent != Some(owner))
        };
        let depends = matches!(*goals.as_slice(), [Goal::History(history)] if is_inner(history));
        if depends || self.domain(net, *from, &goals, is_internal) != domain {
            // The outermost entered state is named too, so that the transition leaves the states that the net lists.
            let Enter::Step(outermost) = *first else { return None };
            goals.insert(0, Goal::State(outermost));
        }
        (self.domain(net, *from, &goals, is_internal) == domain).then_some((goals, is_internal))
    }

    /// Whether a history is deep; `None` if its cases differ from those that lowering creates.
    fn kind_of(&self, net: &Net, history: &net::History) -> Option<bool> {
        let children = &self.children[history.owner.index()];
        let is_case = |case: &net::HistoryCase, step: &StepId| {
            case.step == *step
                && case.enters.first() == Some(&Enter::Step(*step))
                && self.is_default(net, *step, &case.enters[1..])
        };
        if history.cases.len() == children.len()
            && history.cases.iter().zip(children).all(|(case, step)| is_case(case, step))
        {
            return Some(false);
        }
        let inside = history.owner.index() + 1..self.end[history.owner.index()];
        let atomic: Vec<StepId> = inside
            .map(StepId::from_index)
            .filter(|step| matches!(net.steps[*step].kind, StepKind::Leaf | StepKind::Final))
            .collect();
        let is_way = |case: &net::HistoryCase, step: &StepId| {
            let mut way = vec![Enter::Step(*step)];
            let mut next = net.steps[*step].parent;
            while let Some(state) = next.filter(|state| *state != history.owner) {
                way.push(Enter::Step(state));
                next = net.steps[state].parent;
            }
            way.reverse();
            case.step == *step && case.enters == way
        };
        let is_deep = history.cases.len() == atomic.len()
            && history.cases.iter().zip(&atomic).all(|(case, step)| is_way(case, step));
        is_deep.then_some(true)
    }
}

fn order_of_states(name: &Name) -> String {
    format!("the position of the state `{name}`")
}

/// The transitions whose fireability an expression refers to.
fn looked_at(expr: &net::Expr) -> impl Iterator<Item = TransitionId> {
    expr.leaves().filter_map(
        |leaf| {
            if let net::Leaf::Fireable(id) = leaf { Some(*id) } else { None }
        },
    )
}

impl Writer<'_> {
    /// A statechart: the states that a reset enters, and its items.
    pub(super) fn statechart(&mut self, body: BodyId) -> (Vec<Path>, Vec<Item>) {
        let net = self.net;
        let part = self.bodies.part(body);
        let mut items = self.declarations(body);
        self.states.waiting =
            net.transitions.iter().filter(|(_, one)| one.part == part).map(|(id, _)| id).collect();
        let roots = self.states.roots[part.index()].clone();
        let initial = self.initial_of_chart(part, body);
        for root in roots {
            let item = self.state(root, body);
            items.push(item);
            self.drain(&mut items, body, |states, from| from == root || states.lies_in(from, root));
        }
        self.drain(&mut items, body, |_, _| true);
        (initial, items)
    }

    /// The states that a reset enters, if marking an outermost state as initial cannot express them.
    fn initial_of_chart(&mut self, part: PartId, body: BodyId) -> Vec<Path> {
        let net = self.net;
        let data = &net.parts[part];
        let mut goals = Vec::new();
        let mut expected = data.initial.as_slice();
        if self.states.goals(net, expected, &mut goals).is_none() {
            self.findings.push(cannot(
                format!("the states that `{}` enters at reset", data.name),
                data.name.span,
            ));
            expected = &[];
        }
        match goals.as_slice() {
            _ if expected.is_empty() => Vec::new(),
            [Goal::State(state)]
                if net.steps[*state].parent.is_none()
                    && net.steps[*state].kind != StepKind::Final =>
            {
                self.states.marked.insert(*state);
                Vec::new()
            }
            _ => self.paths(&goals, body),
        }
    }

    fn paths(&self, goals: &[Goal], body: BodyId) -> Vec<Path> {
        let net = self.net;
        let path = |goal: &Goal| match *goal {
            Goal::State(state) => self.bodies.path(&net.steps[state].name, body),
            Goal::History(history) => {
                let data = &net.histories[history];
                let mut path = self.bodies.path(&net.steps[data.owner].name, body);
                path.names.push(self.history_name(history));
                path
            }
        };
        goals.iter().map(path).collect()
    }

    /// The name of a history in its state.
    fn history_name(&self, id: HistoryId) -> Name {
        let history = &self.net.histories[id];
        let owner = &self.net.steps[history.owner].name.text;
        let text = history.name.text.as_str();
        let local = text.strip_prefix(owner.as_str()).and_then(|rest| rest.strip_prefix('.'));
        let text = local.or(text.rsplit('.').next()).unwrap_or(text);
        Name::new(text, history.name.span)
    }

    /// Writes the next transitions in order, as long as `belongs` accepts their source.
    fn drain(
        &mut self,
        items: &mut Vec<Item>,
        body: BodyId,
        belongs: impl Fn(&States, StepId) -> bool,
    ) {
        while let Some(id) = self.states.waiting.front().copied() {
            let source = self.net.transitions[id].requires.first().copied();
            if source.is_some_and(|from| !belongs(&self.states, from)) {
                return;
            }
            self.states.waiting.pop_front();
            let item = self.of_state(id, body);
            items.push(item);
        }
    }

    /// A state with its contents.
    fn state(&mut self, id: StepId, body: BodyId) -> Item {
        let net = self.net;
        let data = &net.steps[id];
        let initial = self.initial_of(id, body);
        let mut step = self.step(id, body);
        // If the next transitions are reactions of this state, they are written in its body.
        let mut reactions = Vec::new();
        while let Some(next) = self.states.waiting.front().copied()
            && let Some(item) = self.reaction_in_body(id, next, body)
        {
            self.states.waiting.pop_front();
            self.states.in_bodies.insert(next);
            reactions.push(item);
        }
        step.body.extend(reactions);
        match data.kind {
            StepKind::Leaf | StepKind::Enclosing | StepKind::Final => {
                if data.kind == StepKind::Final {
                    step.role = StepRole::Final;
                }
                if let Some(history) = self.states.histories.get(&id).and_then(|all| all.first()) {
                    let name = &net.histories[*history].name;
                    self.findings.push(cannot(
                        format!("the history `{name}` of a state without child states"),
                        name.span,
                    ));
                }
                Item::Step(step)
            }
            StepKind::Composite | StepKind::Parallel => {
                let histories = self.histories_of(id, body);
                let mut items = Vec::new();
                self.drain(&mut items, body, |_, from| from == id);
                for child in self.states.children[id.index()].clone() {
                    let item = self.state(child, body);
                    items.push(item);
                    self.drain(&mut items, body, |states, from| {
                        from == child || states.lies_in(from, child)
                    });
                }
                self.drain(&mut items, body, |states, from| states.lies_in(from, id));
                let is_parallel = data.kind == StepKind::Parallel;
                if self.states.children[id.index()].is_empty() {
                    self.findings.push(cannot(
                        format!("the composite state `{}` without child states", data.name),
                        data.name.span,
                    ));
                }
                Item::State(State { step, is_parallel, initial, histories, items })
            }
        }
    }

    /// The initial transition of a composite state; `None` if marking a child as initial expresses it, or if it is never taken.
    fn initial_of(
        &mut self,
        id: StepId,
        body: BodyId,
    ) -> Option<(Vec<Path>, grafsynth_ir::chart::Block)> {
        let net = self.net;
        let data = &net.steps[id];
        if data.kind != StepKind::Composite {
            return None;
        }
        let mut goals = Vec::new();
        match self.states.defaults.get(&id) {
            Some(default) => {
                if self.states.goals(net, default, &mut goals).is_none() {
                    self.findings.push(cannot(
                        format!("the states that `{}` enters by default", data.name),
                        data.name.span,
                    ));
                    return None;
                }
            }
            None if data.initial_content.is_empty() => return None,
            None => {
                goals.extend(self.states.children[id.index()].first().map(|it| Goal::State(*it)));
            }
        }
        if data.initial_content.is_empty()
            && let [Goal::State(state)] = goals.as_slice()
            && net.steps[*state].parent == Some(id)
            && net.steps[*state].kind != StepKind::Final
        {
            self.states.marked.insert(*state);
            return None;
        }
        Some((self.paths(&goals, body), self.block(&data.initial_content, body)))
    }

    fn histories_of(&mut self, id: StepId, body: BodyId) -> Vec<History> {
        let net = self.net;
        let mut all = Vec::new();
        for history in self.states.histories.get(&id).cloned().unwrap_or_default() {
            let data = &net.histories[history];
            let mut goals = Vec::new();
            let is_deep = self.states.kind_of(net, data);
            let is_parallel = net.steps[id].kind == StepKind::Parallel;
            let known = if is_parallel && self.states.is_default(net, id, &data.default) {
                Some(())
            } else if is_parallel {
                self.states.goals_of(net, id, &data.default, &mut goals)
            } else {
                self.states.goals(net, &data.default, &mut goals)
            };
            let (Some(is_deep), Some(())) = (is_deep, known) else {
                self.findings.push(cannot(
                    format!("the states that the history `{}` records or enters", data.name),
                    data.name.span,
                ));
                continue;
            };
            all.push(History {
                name: self.history_name(history),
                is_deep,
                default: self.paths(&goals, body),
                content: self.block(&data.default_content, body),
                meta: data.meta.clone(),
            });
        }
        all
    }

    /// A reaction as an item in the body of its state, if it belongs to this state and no `otherwise` refers to it.
    fn reaction_in_body(
        &mut self,
        state: StepId,
        id: TransitionId,
        body: BodyId,
    ) -> Option<StepItem> {
        let transition = &self.net.transitions[id];
        // A name given by the designer would be lost in the body.
        let stem = format!("{}_on", self.net.steps[state].name);
        let fits = transition.kind == TransitionKind::Reaction
            && transition.name.text.starts_with(&stem)
            && transition.requires == [state]
            && transition.deadline_ns.is_none()
            && transition.meta.label.is_empty()
            && transition.meta.req.is_empty()
            && !self.states.looked_at.contains(&id)
            && !self.holds_otherwise(&transition.guard);
        if !fits {
            return None;
        }
        let events = self.events(&transition.events, body);
        let guard = (!transition.guard.is_true() || events.is_empty())
            .then(|| self.expr(&transition.guard, body, None));
        let actions = self.block(&transition.actions, body);
        let kind = StepItemKind::On { events, guard, actions };
        Some(StepItem { kind, span: transition.meta.span })
    }

    fn holds_otherwise(&self, guard: &net::Expr) -> bool {
        looked_at(guard).next().is_some()
    }

    /// The chart names of events: the completion event of a state is named after the state.
    pub(super) fn events(&mut self, events: &[net::InputId], body: BodyId) -> Vec<Name> {
        let net = self.net;
        let mut all = Vec::new();
        for event in events {
            all.push(match self.completed.get(event) {
                Some(state) => {
                    let step = &net.steps[*state].name;
                    let path = self.bodies.path(step, body);
                    Name::new(format!("done.state.{path}"), step.span)
                }
                None => self.one_name(&net.inputs[*event].name, body),
            });
        }
        all
    }

    /// A transition of a statechart.
    fn of_state(&mut self, id: TransitionId, body: BodyId) -> Item {
        let net = self.net;
        let transition = &net.transitions[id];
        let span = transition.meta.span;
        let (goals, is_internal) = match transition.kind {
            TransitionKind::Reaction => (Vec::new(), true),
            TransitionKind::Move => self.states.targets(net, transition).unwrap_or_else(|| {
                let finding = format!("the states that `{}` leaves and enters", transition.name);
                self.findings.push(cannot(finding, span));
                (Vec::new(), false)
            }),
        };
        if transition.requires.len() != 1 || transition.priority.is_some() {
            let finding = format!("`{}`, which is not a transition of a state", transition.name);
            self.findings.push(cannot(finding, span));
        }
        let guard =
            (!transition.guard.is_true()).then(|| self.expr(&transition.guard, body, Some(id)));
        Item::Transition(Transition {
            name: Some(self.bodies.own(body, &transition.name)),
            sources: transition
                .requires
                .iter()
                .map(|step| self.bodies.path(&net.steps[*step].name, body))
                .collect(),
            targets: self.paths(&goals, body),
            events: self.events(&transition.events, body),
            guard,
            after: None,
            priority: None,
            is_sink: false,
            restart: false,
            is_internal,
            deadline_ns: transition.deadline_ns,
            actions: self.block(&transition.actions, body),
            meta: transition.meta.clone(),
        })
    }
}

/// The state of each completion event. Reports an event that triggers no transition, because no chart can express it.
pub(super) fn completed(
    net: &Net,
    findings: &mut Vec<Diagnostic>,
) -> BTreeMap<net::InputId, StepId> {
    let mut all = BTreeMap::new();
    let waited: BTreeSet<net::InputId> =
        net.transitions.values().flat_map(|it| it.events.iter().copied()).gather();
    for (id, step) in net.steps.iter() {
        let Some(event) = step.done_event else { continue };
        if !waited.contains(&event) || all.insert(event, id).is_some() {
            let name = &net.inputs[event].name;
            findings.push(cannot(
                format!("the event `{name}`, which is not the completion of a single state or triggers no transition"),
                name.span,
            ));
        }
    }
    all
}
