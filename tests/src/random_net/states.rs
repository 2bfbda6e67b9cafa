//! Random statecharts: a tree of states, transitions between any two of them, histories and final states.

use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Input;
use grafsynth_ir::net::{
    Enter, Expr, History, HistoryCase, HistoryId, InputKind, Meta, Part, PartId, Step, StepId,
    StepKind, Transition, TransitionKind,
};

use super::{Builder, name, step};

/// The domain of a transition: its least common composite ancestor.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Domain {
    State(StepId),
    Chart(PartId),
}

impl Builder<'_> {
    pub(super) fn states(&mut self) {
        let n_parts = if self.on.several_parts && self.random.one_in(4) { 2 } else { 1 };
        let budget = 2 + self.random.below(self.on.max_steps.max(2) - 1);
        for index in 1..=n_parts {
            let part = self.net.parts.push(Part {
                name: name(format!("g{index}")),
                level: 1,
                ..Part::default()
            });
            let mut left = budget / n_parts;
            let n_children = 1 + self.random.below(3);
            for at in 0..n_children {
                self.state(part, None, at + 1 == n_children && at > 0, 0, &mut left);
            }
            if self.on.entries && self.random.one_in(2) {
                self.nest(part);
            }
        }
        self.done_events();
        self.histories();
        for part in self.net.parts.ids() {
            let first = self.initial_child(part, None);
            self.net.parts[part].initial =
                first.map_or(Vec::new(), |state| self.default_entry(state));
        }
    }

    /// Adds a state with its contents, in document order.
    fn state(
        &mut self,
        part: PartId,
        parent: Option<StepId>,
        may_be_final: bool,
        depth: usize,
        left: &mut usize,
    ) {
        let mut data = step(format!("s{}", self.net.steps.len() + 1), part, false);
        data.parent = parent;
        *left = left.saturating_sub(1);
        let is_region =
            parent.is_some_and(|parent| self.net.steps[parent].kind == StepKind::Parallel);
        data.kind = if may_be_final && self.wants(self.on.finals, 3) {
            StepKind::Final
        } else if is_region || (*left > 1 && depth < 3 && self.random.one_in(3)) {
            StepKind::Composite
        } else if *left > 3
            && depth < if self.on.entries { 3 } else { 2 }
            && self.random.one_in(if self.on.entries { 2 } else { 3 })
        {
            StepKind::Parallel
        } else {
            StepKind::Leaf
        };
        let kind = data.kind;
        let id = self.net.steps.push(data);
        let n_children = match kind {
            StepKind::Composite => 1 + self.random.below(3),
            StepKind::Parallel => 2 + self.random.below(2),
            StepKind::Leaf | StepKind::Final | StepKind::Enclosing => 0,
        };
        for at in 0..n_children {
            let may_be_final = kind == StepKind::Composite && at > 0 && at + 1 == n_children;
            self.state(part, Some(id), may_be_final, depth + 1, left);
        }
        if kind == StepKind::Composite && self.random.one_in(3) {
            self.net.steps[id].initial_content = self.list(1);
        }
    }

    /// Adds a composite state around a parallel one: transitions to the history of the inner one enter both.
    fn nest(&mut self, part: PartId) {
        let mut add = |kind: StepKind, parent: Option<StepId>| {
            let text = format!("s{}", self.net.steps.len() + 1);
            self.net.steps.push(Step { kind, parent, ..step(text, part, false) })
        };
        let outer = add(StepKind::Composite, None);
        let inner = add(StepKind::Parallel, Some(outer));
        for _ in 0..1 + self.random.below(2) {
            let region = add(StepKind::Composite, Some(inner));
            for _ in 0..1 + self.random.below(2) {
                add(StepKind::Leaf, Some(region));
            }
        }
    }

    /// Adds a transition from some state to the history of each parallel state within another one; the transition waits only for
    /// an event.
    fn moves_to_nests(&mut self, states: &[StepId]) {
        let ids: Vec<HistoryId> = self.net.histories.ids().collect();
        for id in ids {
            let owner = self.net.histories[id].owner;
            let part = self.net.steps[owner].part;
            let is_nested = self.net.steps[owner].kind == StepKind::Parallel
                && self.net.steps[owner].parent.is_some();
            let outside: Vec<StepId> = (states.iter().copied())
                .filter(|state| self.net.steps[*state].part == part)
                .filter(|state| self.ancestors(owner).iter().all(|above| above != state))
                .filter(|state| *state != owner && !self.lies_in(*state, owner))
                .collect();
            if let (true, Some(source)) = (is_nested, self.random.pick(&outside).copied()) {
                self.move_to(source, owner, Some(id), true);
            }
        }
    }

    fn children(&self, part: PartId, parent: Option<StepId>) -> Vec<StepId> {
        self.net
            .steps
            .iter()
            .filter(|(_, step)| step.part == part && step.parent == parent)
            .map(|(id, _)| id)
            .collect()
    }

    fn children_of(&self, state: StepId) -> Vec<StepId> {
        self.children(self.net.steps[state].part, Some(state))
    }

    /// The default child: always the same one, the second if there are three.
    fn initial_child(&self, part: PartId, parent: Option<StepId>) -> Option<StepId> {
        let children = self.children(part, parent);
        children.get(children.len() / 3).copied()
    }

    fn default_entry(&self, state: StepId) -> Vec<Enter> {
        let mut enters = vec![Enter::Step(state)];
        self.complete(state, &mut enters);
        enters
    }

    /// Adds to `enters` the states that entering `state` enters inside it.
    fn complete(&self, state: StepId, enters: &mut Vec<Enter>) {
        match self.net.steps[state].kind {
            StepKind::Composite => {
                if !self.net.steps[state].initial_content.is_empty() {
                    enters.push(Enter::InitialContent(state));
                }
                if let Some(child) = self.initial_child(self.net.steps[state].part, Some(state)) {
                    enters.extend(self.default_entry(child));
                }
            }
            StepKind::Parallel => {
                for region in self.children_of(state) {
                    enters.extend(self.default_entry(region));
                }
            }
            StepKind::Leaf | StepKind::Final | StepKind::Enclosing => {}
        }
    }

    fn ancestors(&self, state: StepId) -> Vec<StepId> {
        std::iter::successors(self.net.steps[state].parent, |above| self.net.steps[*above].parent)
            .collect()
    }

    fn lies_in(&self, state: StepId, outer: StepId) -> bool {
        self.ancestors(state).contains(&outer)
    }

    /// Enters `at` and, inside it, `target` (or its history), with all other regions by default.
    fn enter_towards(
        &self,
        at: StepId,
        target: StepId,
        history: Option<HistoryId>,
        enters: &mut Vec<Enter>,
    ) {
        enters.push(Enter::Step(at));
        if at == target {
            match history {
                Some(history) => enters.push(Enter::History(history)),
                None => self.complete(at, enters),
            }
            return;
        }
        for child in self.children_of(at) {
            if child == target || self.lies_in(target, child) {
                self.enter_towards(child, target, history, enters);
            } else if self.net.steps[at].kind == StepKind::Parallel {
                enters.extend(self.default_entry(child));
            }
        }
    }

    fn done_events(&mut self) {
        for id in self.net.steps.ids() {
            let is_nest =
                matches!(self.net.steps[id].kind, StepKind::Composite | StepKind::Parallel);
            if is_nest && self.wants(self.on.finals && self.on.raise, 2) {
                let text = format!("done.{}", self.net.steps[id].name);
                let kind = InputKind::InternalEvent;
                let event = Input {
                    name: name(text),
                    ty: Type::Bool,
                    kind,
                    synchronous: false,
                    meta: Meta::default(),
                };
                let event = self.net.inputs.push(event);
                self.net.steps[id].done_event = Some(event);
            }
        }
    }

    fn histories(&mut self) {
        let owners: Vec<StepId> = (self.net.steps.iter())
            .filter(|(_, step)| matches!(step.kind, StepKind::Composite | StepKind::Parallel))
            .map(|(id, _)| id)
            .collect();
        for owner in owners {
            let rarity = if self.on.entries { 1 } else { 3 };
            if !self.wants(self.on.history, rarity) {
                continue;
            }
            let is_deep = self.random.one_in(2);
            let cases = if is_deep { self.deep_cases(owner) } else { self.shallow_cases(owner) };
            let default = match self.net.steps[owner].kind {
                StepKind::Parallel => self
                    .children_of(owner)
                    .into_iter()
                    .flat_map(|r| self.default_entry(r))
                    .collect(),
                StepKind::Composite | StepKind::Leaf | StepKind::Final | StepKind::Enclosing => {
                    let children = self.children_of(owner);
                    self.random
                        .pick(&children)
                        .copied()
                        .map_or(Vec::new(), |child| self.default_entry(child))
                }
            };
            let default_content = if self.on.entries {
                let mut list = self.list_about(owner);
                list.extend(self.mark());
                list
            } else if self.random.one_in(2) {
                self.list(1)
            } else {
                Vec::new()
            };
            let text = name(format!("h{}", self.net.histories.len() + 1));
            self.net.histories.push(History {
                name: text,
                owner,
                cases,
                default,
                default_content,
                meta: Meta::default(),
            });
        }
    }

    /// States that are entered or left together with this one, or almost.
    pub(super) fn near(&self, state: StepId) -> Vec<StepId> {
        let mut near = vec![state];
        near.extend(self.ancestors(state));
        near.extend(self.children_of(state));
        let part = self.net.steps[state].part;
        near.extend(self.children(part, self.net.steps[state].parent));
        near
    }

    fn shallow_cases(&self, owner: StepId) -> Vec<HistoryCase> {
        let case = |step: StepId| HistoryCase { step, enters: self.default_entry(step) };
        self.children_of(owner).into_iter().map(case).collect()
    }

    fn deep_cases(&self, owner: StepId) -> Vec<HistoryCase> {
        let is_atomic =
            |step: StepId| matches!(self.net.steps[step].kind, StepKind::Leaf | StepKind::Final);
        (self.net.steps.ids())
            .filter(|step| is_atomic(*step) && self.lies_in(*step, owner))
            .map(|step| {
                let mut way = self.ancestors(step);
                way.truncate(way.iter().position(|above| *above == owner).unwrap_or(0));
                way.reverse();
                way.push(step);
                HistoryCase { step, enters: way.into_iter().map(Enter::Step).collect() }
            })
            .collect()
    }

    pub(super) fn statechart_transitions(&mut self) {
        let states: Vec<StepId> = self
            .net
            .steps
            .iter()
            .filter(|(_, step)| step.kind != StepKind::Final)
            .map(|(id, _)| id)
            .collect();
        let n_transitions = states.len() + self.random.below(states.len() + 3);
        for _ in 0..n_transitions {
            let Some(source) = self.random.pick(&states).copied() else { return };
            if self.wants(self.on.reactions, 8) {
                self.reaction();
            } else {
                self.move_from(source);
            }
        }
        if self.on.entries {
            self.moves_to_nests(&states);
        }
    }

    fn move_from(&mut self, source: StepId) {
        let part = self.net.steps[source].part;
        let targets: Vec<StepId> =
            self.net.steps.iter().filter(|(_, step)| step.part == part).map(|(id, _)| id).collect();
        let histories: Vec<HistoryId> = self
            .net
            .histories
            .iter()
            .filter(|(_, history)| self.net.steps[history.owner].part == part)
            .map(|(id, _)| id)
            .collect();
        let rarity = if self.on.entries { 2 } else { 3 };
        let history =
            if self.random.one_in(rarity) { self.random.pick(&histories).copied() } else { None };
        let target = match history {
            Some(history) => self.net.histories[history].owner,
            None => self.random.pick(&targets).copied().unwrap_or(source),
        };
        self.move_to(source, target, history, false);
    }

    /// Adds a transition to a state or its history.
    fn move_to(
        &mut self,
        source: StepId,
        target: StepId,
        history: Option<HistoryId>,
        waits_for_event_only: bool,
    ) {
        let part = self.net.steps[source].part;
        let is_composite = |state: StepId| self.net.steps[state].kind == StepKind::Composite;
        // The target itself is inside the owner of a history, so the owner can be the domain.
        let inside =
            |outer: StepId| self.lies_in(target, outer) || (history.is_some() && target == outer);
        let may_stay_inside = is_composite(source) && inside(source);
        let common =
            self.ancestors(source).into_iter().find(|above| is_composite(*above) && inside(*above));
        let domain = if may_stay_inside && self.random.one_in(2) {
            Domain::State(source)
        } else {
            common.map_or(Domain::Chart(part), Domain::State)
        };
        let mut enters = Vec::new();
        match domain {
            Domain::State(state) if state == target => enters.extend(history.map(Enter::History)),
            Domain::State(state) => {
                self.enter_child_towards(part, Some(state), target, history, &mut enters)
            }
            Domain::Chart(part) => {
                self.enter_child_towards(part, None, target, history, &mut enters)
            }
        }
        let clears = (self.net.steps.iter())
            .filter(|(id, step)| match domain {
                Domain::State(state) => self.lies_in(*id, state),
                Domain::Chart(part) => step.part == part,
            })
            .map(|(id, _)| id)
            .collect();
        let event = self.any_event(false).filter(|_| !self.random.one_in(4));
        let guard = match event {
            Some(_) if waits_for_event_only || !self.random.one_in(3) => Expr::bool(true),
            _ => self.receptivity(),
        };
        let actions = if self.random.one_in(3) { self.list(2) } else { Vec::new() };
        let id = self.net.transitions.len() + 1;
        self.net.transitions.push(Transition {
            name: name(format!("t{id}")),
            part,
            kind: TransitionKind::Move,
            requires: vec![source],
            clears,
            enters,
            events: event.into_iter().collect(),
            guard,
            priority: None,
            restart: true,
            actions,
            deadline_ns: None,
            meta: Meta::default(),
        });
    }

    fn enter_child_towards(
        &self,
        part: PartId,
        parent: Option<StepId>,
        target: StepId,
        history: Option<HistoryId>,
        enters: &mut Vec<Enter>,
    ) {
        for child in self.children(part, parent) {
            if child == target || self.lies_in(target, child) {
                self.enter_towards(child, target, history, enters);
            }
        }
    }
}
