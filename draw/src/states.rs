//! A statechart as boxes inside of boxes, with its transitions.
//!
//! Texts have the words of the chart language: UML leaves the language of guards and actions open.

use crate::notation::{Notation, duration, quoted};
use crate::picture::Element;
use grafsynth_ir::Gather;
use grafsynth_ir::chart::{
    ActionHow, Argument, ArgumentValue, Chart, Expr, ForceOrder, History, Item, Length, Library,
    Path, State, Step, StepItem, StepItemKind, StepRole, Stmt, Transition,
};
use grafsynth_ir::net::Meta;
use grafsynth_ir::span::Name;
use std::collections::{BTreeMap, BTreeSet};

/// The kinds of vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The chart itself, always the first vertex.
    Chart,
    State,
    /// A part of a parallel state.
    Region,
    /// The dot from which a default transition starts.
    Initial,
    Final,
    /// A history; true if it is deep.
    History(bool),
    /// The bar at which a transition with several sources or targets joins or forks.
    Bar,
    /// An instance of a library chart.
    Instance,
    /// The name of a state that does not exist.
    Unknown,
}

/// A state or pseudo-state.
#[derive(Debug, Clone)]
pub(crate) struct Vertex {
    pub(crate) kind: Kind,
    /// The vertex around this one; the chart is its own parent.
    pub(crate) parent: usize,
    pub(crate) children: Vec<usize>,
    /// True if each child is a region.
    pub(crate) is_parallel: bool,
    /// True for a state that is drawn as active.
    pub(crate) is_active: bool,
    pub(crate) name: String,
    /// Comments and tags below the name.
    pub(crate) remarks: Vec<String>,
    /// Activities and reactions inside of the box.
    pub(crate) lines: Vec<String>,
    pub(crate) element: Option<Element>,
}

/// An arrow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Edge {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// True if the arrow starts inside of the composite state that it does not leave.
    pub(crate) is_local: bool,
    pub(crate) label: String,
    /// Comments and tags below the label.
    pub(crate) remarks: Vec<String>,
    pub(crate) element: Option<Element>,
}

/// A statechart.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) edges: Vec<Edge>,
}

impl Tree {
    pub(crate) fn of_chart(chart: &Chart, notation: &Notation) -> Tree {
        Reader::read(&chart.name.text, &chart.items, &chart.initial, notation.spelled())
    }

    pub(crate) fn of_library(library: &Library, notation: &Notation) -> Tree {
        Reader::read(&library.name.text, &library.items, &[], notation.spelled())
    }

    /// The vertices from this one to the chart.
    pub(crate) fn ancestors(&self, vertex: usize) -> Vec<usize> {
        let mut all = vec![vertex];
        while let Some(&last) = all.last()
            && last != 0
        {
            all.push(self.vertices[last].parent);
        }
        all
    }
}

/// The ends of transitions are resolved after all states are known.
struct Pending<'a> {
    scope: usize,
    what: What<'a>,
    id: String,
}

enum What<'a> {
    Transition(&'a Transition),
    /// The default of a vertex: its targets and statements.
    Default(usize, &'a [Path], &'a [Stmt]),
}

struct Reader<'a> {
    notation: Notation,
    tree: Tree,
    pending: Vec<Pending<'a>>,
    /// The vertices of each name.
    names: BTreeMap<String, Vec<usize>>,
}

impl<'a> Reader<'a> {
    fn read(name: &str, items: &'a [Item], initial: &'a [Path], notation: Notation) -> Tree {
        let tree = Tree::default();
        let mut reader = Reader { notation, tree, pending: Vec::new(), names: BTreeMap::new() };
        reader.add(0, Kind::Chart, name, None);
        reader.items(0, items, name);
        if initial.is_empty() {
            reader.default_child(0, items);
        } else {
            reader.default_of(0, initial, &[]);
        }
        for pending in std::mem::take(&mut reader.pending) {
            match pending.what {
                What::Transition(transition) => {
                    reader.transition(pending.scope, transition, pending.id);
                }
                What::Default(from, targets, actions) => {
                    let targets = reader.ends(pending.scope, targets);
                    let label = reader.suffix(actions);
                    let edge = Edge { label, ..Edge::default() };
                    reader.connect(pending.scope, &[from], &targets, edge);
                }
            }
        }
        reader.regions();
        reader.tree
    }

    fn add(&mut self, parent: usize, kind: Kind, name: &str, element: Option<Element>) -> usize {
        let own = self.tree.vertices.len();
        self.tree.vertices.push(Vertex {
            kind,
            parent,
            children: Vec::new(),
            is_parallel: false,
            is_active: false,
            name: name.to_owned(),
            remarks: Vec::new(),
            lines: Vec::new(),
            element,
        });
        if own > 0 {
            self.names.entry(name.to_owned()).or_default().push(own);
            self.tree.vertices[parent].children.push(own);
        }
        own
    }

    fn items(&mut self, parent: usize, items: &'a [Item], prefix: &str) {
        for (number, item) in items.iter().enumerate() {
            match item {
                Item::State(state) => self.state(parent, state, prefix),
                Item::Step(step) => {
                    self.step(parent, step, prefix);
                }
                Item::Transition(transition) => {
                    let id = format!("{prefix}-t{number}");
                    let what = What::Transition(transition);
                    self.pending.push(Pending { scope: parent, what, id });
                }
                Item::Use(one) => {
                    let id = format!("{prefix}.{}", one.name.text);
                    let name = format!("{} : {}", one.name.text, one.library.text);
                    let element = Some(Element { id, span: one.meta.span });
                    let own = self.add(parent, Kind::Instance, &name, element);
                    self.tree.vertices[own].remarks = about(&one.meta);
                    let lines = one.arguments.iter().map(|it| argument(&self.notation, it));
                    self.tree.vertices[own].lines = lines.collect();
                }
                _ => {}
            }
        }
    }

    fn step(&mut self, parent: usize, step: &'a Step, prefix: &str) -> usize {
        let id = format!("{prefix}.{}", step.name.text);
        let kind = if step.role == StepRole::Final { Kind::Final } else { Kind::State };
        let element = Some(Element { id, span: step.meta.span });
        let own = self.add(parent, kind, &step.name.text, element);
        let mut remarks = about(&step.meta);
        let mut lines = Vec::new();
        for item in &step.body {
            match &item.kind {
                StepItemKind::Priority(rank) => remarks.push(format!("priority {rank}")),
                StepItemKind::Budget(cost) => remarks.push(format!("budget {cost}")),
                _ => lines.push(self.line(item)),
            }
        }
        let vertex = &mut self.tree.vertices[own];
        (vertex.remarks, vertex.lines) = (remarks, lines);
        own
    }

    fn state(&mut self, parent: usize, state: &'a State, prefix: &str) {
        let own = self.step(parent, &state.step, prefix);
        let prefix = format!("{prefix}.{}", state.step.name.text);
        self.tree.vertices[own].is_parallel = state.is_parallel;
        for history in &state.histories {
            self.history(own, history, &prefix);
        }
        self.items(own, &state.items, &prefix);
        match &state.initial {
            Some((targets, actions)) => self.default_of(own, targets, actions),
            None if !state.is_parallel => self.default_child(own, &state.items),
            None => {}
        }
    }

    fn history(&mut self, parent: usize, history: &'a History, prefix: &str) {
        let id = format!("{prefix}.{}", history.name.text);
        let element = Some(Element { id, span: history.meta.span });
        let own = self.add(parent, Kind::History(history.is_deep), &history.name.text, element);
        self.tree.vertices[own].remarks = about(&history.meta);
        if !history.default.is_empty() {
            let what = What::Default(own, &history.default, &history.content);
            self.pending.push(Pending { scope: parent, what, id: String::new() });
        }
    }

    /// A dot with a default transition to the child that is marked, or to the first.
    fn default_child(&mut self, parent: usize, items: &'a [Item]) {
        let steps = items.iter().filter_map(|item| match item {
            Item::State(state) => Some(&state.step),
            _ => None,
        });
        let marked = steps.clone().find(|step| step.role == StepRole::Initial);
        if let Some(step) = marked.or_else(|| steps.clone().next()) {
            let children = self.tree.vertices[parent].children.iter().copied();
            let is_named = |child: &usize| self.tree.vertices[*child].name == step.name.text;
            if let Some(to) = { children }.find(is_named) {
                let from = self.add(parent, Kind::Initial, "", None);
                self.tree.edges.push(Edge { from, to, ..Edge::default() });
            }
        }
    }

    fn default_of(&mut self, parent: usize, targets: &'a [Path], actions: &'a [Stmt]) {
        let from = self.add(parent, Kind::Initial, "", None);
        let what = What::Default(from, targets, actions);
        self.pending.push(Pending { scope: parent, what, id: String::new() });
    }

    fn transition(&mut self, scope: usize, transition: &Transition, id: String) {
        let sources = self.ends(scope, &transition.sources);
        let label = self.label(transition);
        if transition.is_internal
            && transition.targets.is_empty()
            && let [only] = sources.as_slice()
        {
            return self.tree.vertices[*only].lines.push(label);
        }
        let mut remarks = Vec::new();
        remarks.extend(transition.priority.map(|rank| format!("priority {rank}")));
        remarks.extend(transition.restart.then(|| "restart".to_owned()));
        remarks.extend(transition.deadline_ns.map(|ns| format!("deadline {}", duration(ns))));
        remarks.extend(about(&transition.meta));
        let targets = self.ends(scope, &transition.targets);
        let is_local = match (sources.as_slice(), targets.as_slice()) {
            ([from], to) => {
                transition.is_internal && to.iter().all(|to| self.is_within(*to, *from))
            }
            _ => false,
        };
        let element = Some(Element { id, span: transition.meta.span });
        let edge = Edge { from: 0, to: 0, is_local, label, remarks, element };
        self.connect(scope, &sources, &targets, edge);
    }

    fn is_within(&self, vertex: usize, around: usize) -> bool {
        vertex != around && self.tree.ancestors(vertex).contains(&around)
    }

    /// Adds an arrow, with bars if it has several sources or targets.
    fn connect(&mut self, scope: usize, sources: &[usize], targets: &[usize], edge: Edge) {
        let all: Vec<usize> = sources.iter().chain(targets).copied().collect();
        let mut bars = |ends: &[usize]| match ends {
            [only] => *only,
            _ => {
                let mut around = self.common(&all);
                if let ([from], true) = (sources, edge.is_local) {
                    around = *from;
                }
                self.add(around, Kind::Bar, "", edge.element.clone())
            }
        };
        let from = if sources.is_empty() { None } else { Some(bars(sources)) };
        let to = if targets.is_empty() { None } else { Some(bars(targets)) };
        let from = from.unwrap_or_else(|| self.add(scope, Kind::Unknown, "none", None));
        let to = to.unwrap_or_else(|| self.add(scope, Kind::Unknown, "none", None));
        let plain = Edge { element: edge.element.clone(), ..Edge::default() };
        for one in sources.iter().filter(|one| **one != from) {
            self.tree.edges.push(Edge { from: *one, to: from, ..plain.clone() });
        }
        self.tree.edges.push(Edge { from, to, ..edge });
        for one in targets.iter().filter(|one| **one != to) {
            self.tree.edges.push(Edge { from: to, to: *one, ..plain.clone() });
        }
    }

    /// The innermost vertex around all of these.
    fn common(&self, all: &[usize]) -> usize {
        let first = all.first().copied().unwrap_or(0);
        let around = self.tree.ancestors(first).into_iter().skip(1);
        let contains = |around: &usize| all.iter().all(|one| self.is_within(*one, *around));
        { around }.find(contains).unwrap_or(0)
    }

    fn ends(&mut self, scope: usize, paths: &[Path]) -> Vec<usize> {
        let mut all = Vec::new();
        for path in paths {
            all.push(match self.named(scope, path) {
                Some(vertex) => vertex,
                None => self.add(scope, Kind::Unknown, &path.to_string(), None),
            });
        }
        all
    }

    /// The vertex that a path means: the nearest one that has its last name, with the other names around it.
    fn named(&self, scope: usize, path: &Path) -> Option<usize> {
        let (last, around) = path.names.split_last()?;
        let is_meant = |vertex: &usize| {
            let mut above = self.tree.ancestors(*vertex).into_iter().skip(1);
            let mut names = around.iter().rev();
            names.all(|name| above.any(|it| self.tree.vertices[it].name == name.text))
        };
        let all: Vec<usize> =
            self.names.get(&last.text)?.iter().copied().filter(is_meant).collect();
        let scopes = self.tree.ancestors(scope);
        scopes.iter().find_map(|scope| {
            all.iter().copied().find(|one| self.is_within(*one, *scope) || one == scope)
        })
    }

    /// Makes the children of parallel states regions. One that is the end of a transition, or that has no states, is a box in a region.
    fn regions(&mut self) {
        let ends: BTreeSet<usize> =
            self.tree.edges.iter().flat_map(|edge| [edge.from, edge.to]).gather();
        for vertex in 0..self.tree.vertices.len() {
            let Vertex { parent, kind, is_parallel, .. } = self.tree.vertices[vertex];
            if !self.tree.vertices[parent].is_parallel || !matches!(kind, Kind::State | Kind::Final)
            {
                continue;
            }
            let has_states = !self.tree.vertices[vertex].children.is_empty();
            if kind == Kind::State && has_states && !is_parallel && !ends.contains(&vertex) {
                self.tree.vertices[vertex].kind = Kind::Region;
                continue;
            }
            let region = self.add(parent, Kind::Region, "", None);
            self.tree.vertices[region].children.push(vertex);
            self.tree.vertices[vertex].parent = region;
            let children = &mut self.tree.vertices[parent].children;
            children.pop();
            children.iter_mut().filter(|it| **it == vertex).for_each(|it| *it = region);
        }
    }

    /// ` / actions`, or nothing.
    fn suffix(&self, actions: &[Stmt]) -> String {
        if actions.is_empty() { String::new() } else { format!("/ {}", self.block(actions)) }
    }

    fn block(&self, actions: &[Stmt]) -> String {
        self.notation.block(actions)
    }

    /// `name: event [guard] / actions`.
    fn label(&self, transition: &Transition) -> String {
        let mut parts = Vec::new();
        parts.extend(
            transition.name.as_ref().map(|name| format!("{}:", self.notation.word(&name.text))),
        );
        let after = transition.after.as_ref().map(|(length, _)| match length {
            Length::Ns(ns) => format!("after {}", duration(*ns)),
            Length::Named(name) => format!("after {}", self.notation.path(name)),
        });
        parts.extend(self.trigger(&transition.events, transition.guard.as_ref(), after));
        parts.extend((!transition.actions.is_empty()).then(|| self.suffix(&transition.actions)));
        parts.join(" ")
    }

    /// Events, the time, and the guard in brackets. If an event must happen after a time, the time is a guard, too.
    fn trigger(&self, events: &[Name], guard: Option<&Expr>, after: Option<String>) -> Vec<String> {
        let names: Vec<String> = events.iter().map(|event| self.event(&event.text)).collect();
        let mut parts = Vec::new();
        parts.extend((!names.is_empty()).then(|| names.join(", ")));
        let mut guards = Vec::new();
        if names.is_empty() { &mut parts } else { &mut guards }.extend(after);
        guards.extend(guard.map(|guard| match guards.is_empty() {
            true => self.notation.expr(guard).text,
            false => self.notation.operand(guard).text,
        }));
        parts.extend((!guards.is_empty()).then(|| format!("[{}]", guards.join(" and "))));
        parts
    }

    /// The name of an event; the event that a state raises when it is completed is `state.done`.
    fn event(&self, name: &str) -> String {
        match name.strip_prefix("done.state.") {
            Some(state) => {
                let names: Vec<String> =
                    state.split('.').map(|name| self.notation.word(name)).collect();
                format!("{}.done", names.join("."))
            }
            None => self.notation.word(name),
        }
    }

    /// An activity or reaction of a state.
    fn line(&self, item: &StepItem) -> String {
        match &item.kind {
            StepItemKind::Action { target, arguments, how, condition } => {
                let mut text = format!("do / {}", self.notation.word(&target.text));
                if let Some(arguments) = arguments {
                    let all = arguments.iter().map(|one| self.notation.expr(one).text);
                    text.push_str(&format!("({})", all.collect::<Vec<_>>().join(", ")));
                }
                match how {
                    ActionHow::Bare => {}
                    ActionHow::After(ns) => text.push_str(&format!(" after {}", duration(*ns))),
                    ActionHow::For(ns) => text.push_str(&format!(" for {}", duration(*ns))),
                    ActionHow::Qualified(qualifier, ns) => {
                        text.push_str(&format!(" {}", qualifier.letters()));
                        if let Some(ns) = ns {
                            text.push_str(&format!(" {}", duration(*ns)));
                        }
                    }
                }
                if let Some(condition) = condition {
                    text.push_str(&format!(" if {}", self.notation.expr(condition).text));
                }
                text
            }
            StepItemKind::Entry(list) => format!("entry / {}", self.block(list)),
            StepItemKind::Exit(list) => format!("exit / {}", self.block(list)),
            StepItemKind::On { events, guard, actions } => {
                let mut parts = self.trigger(events, guard.as_ref(), None);
                parts.push(format!("/ {}", self.block(actions)));
                parts.join(" ")
            }
            StepItemKind::Priority(rank) => format!("priority {rank}"),
            StepItemKind::Budget(cost) => format!("budget {cost}"),
            StepItemKind::Task { name, cost, body } => {
                let cost = cost.map(|cost| format!(" cost {cost}")).unwrap_or_default();
                format!("task {}{cost} / {}", self.notation.word(&name.text), self.block(body))
            }
            StepItemKind::Code(code) => {
                format!("code {} {}", self.notation.word(&code.language), quoted(&code.text))
            }
            StepItemKind::Force { target, order } => {
                let order = match order {
                    ForceOrder::Situation(steps) => steps
                        .iter()
                        .map(|step| self.notation.path(step))
                        .collect::<Vec<_>>()
                        .join(", "),
                    ForceOrder::Init => "INIT".to_owned(),
                    ForceOrder::Hold => "*".to_owned(),
                };
                format!("force {} {{{order}}}", self.notation.path(target))
            }
        }
    }
}

/// The comment and the requirement tags.
fn about(meta: &Meta) -> Vec<String> {
    let mut all = Vec::new();
    all.extend((!meta.label.is_empty()).then(|| quoted(&meta.label)));
    all.extend((!meta.req.is_empty()).then(|| format!("req {}", meta.req.join(", "))));
    all
}

/// `start = m` or `done → x`.
fn argument(notation: &Notation, argument: &Argument) -> String {
    let name = notation.word(&argument.parameter.text);
    match &argument.value {
        ArgumentValue::Reads(expr) => format!("{name} = {}", notation.expr(expr).text),
        ArgumentValue::Drives(target) => format!("{name} → {}", notation.path(target)),
    }
}
