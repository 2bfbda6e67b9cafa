//! Pass `expand`, which expands macros and collects all objects of the net. Every macro-step becomes a copy of its macro, every body becomes a scope, every
//! object becomes an item of the net with its full name, in declaration order (semantics §1). Later passes lower the contents (conditions, lists) when all
//! names are known.
//!
//! ```text
//! macro m { entry step e  exit step x  e -> x }        steps  p  a.e  a.x  b.e  b.x
//! step p  macro step a = m  macro step b = m     =>    transitions  a.e_x  b.e_x
//! ```

mod declaration;

use super::codes;
use super::context::{
    DrawnAction, Instance, Lowering, MacroDefinition, MacroId, Scope, ScopeId, Symbol, Work,
};
use crate::chart::{self, Item, SettingKind, StepItemKind, StepRole};
use crate::diag::Diagnostic;
use crate::expr::Expr;
use crate::net::{Part, PartId, Step, StepId, StepKind, Transition, TransitionKind};
use crate::span::{Name, Span};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The maximum nesting depth of bodies; the chart language has the same limit.
const MAX_DEPTH: usize = 256;

/// Creates scopes and empty items. Runs after `settings`, because the kind of chart determines which items are allowed.
pub(super) fn expand(lowering: &mut Lowering<'_>) {
    let design = lowering.design;
    let several = design.charts.len() > 1;
    if let Some(first) = design.charts.first() {
        lowering.net.name = first.name.clone();
    }
    let mut first_spans: BTreeMap<&str, Span> = BTreeMap::new();
    for (index, chart) in design.charts.iter().enumerate() {
        let part = lowering.net.parts.push(Part {
            name: chart.name.clone(),
            level: 1,
            priority: part_priority(&chart.items),
            initial: Vec::new(),
            is_cut: false,
            meta: chart.meta.clone(),
        });
        let prefix = if several { format!("{}.", chart.name) } else { String::new() };
        let scope = new_scope(lowering, None, prefix, part, None, index);
        if let Some(&first) = first_spans.get(chart.name.text.as_str()) {
            lowering.report(Diagnostic::twice(
                codes::DUPLICATE_NAME,
                format!("two charts are called `{}`", chart.name),
                [chart.name.span, first],
                "give one of them another name",
            ));
        } else {
            first_spans.insert(&chart.name.text, chart.name.span);
            lowering.charts.insert(&chart.name.text, scope);
        }
        // The parts of a chart are consecutive because each chart is expanded before the next one gets its part.
        let mut expansion =
            Expansion { lowering: &mut *lowering, open: Vec::new(), depth: 0, is_full: false };
        expansion.items(scope, &chart.items);
        if let Some(first) = chart.initial.first()
            && !expansion.lowering.is_statechart()
        {
            expansion.only_in_statechart(first.span(), "an initial transition");
        }
        let parts = part.index()..lowering.net.parts.len();
        lowering.chart_bodies.push((scope, parts));
    }
    // A nested macro-step is completed before the surrounding one, and comes after it.
    lowering.net.macros.sort_by_key(|one| (one.steps.first().copied(), Reverse(one.steps.len())));
    if !lowering.expand_unused {
        unused_macros(lowering);
    }
}

pub(super) fn new_scope(
    lowering: &mut Lowering<'_>,
    parent: Option<ScopeId>,
    prefix: String,
    part: PartId,
    inside: Option<StepId>,
    chart: usize,
) -> ScopeId {
    let home = lowering.scopes.len();
    let names = BTreeMap::new();
    let is_instance = false;
    lowering.scopes.push(Scope { parent, prefix, names, part, home, inside, chart, is_instance });
    home
}

/// The body of an enclosing step or a state in `outer`: it shares the names of the surrounding chart or expansion.
fn enclosed_scope(
    lowering: &mut Lowering<'_>,
    outer: ScopeId,
    part: PartId,
    inside: StepId,
) -> ScopeId {
    let around = &lowering.scopes[outer];
    let (home, prefix, chart) = (around.home, around.prefix.clone(), around.chart);
    let body = new_scope(lowering, Some(outer), prefix, part, Some(inside), chart);
    lowering.scopes[body].home = home;
    body
}

/// The `priority n` of a chart or body.
pub(super) fn part_priority(items: &[Item]) -> Option<u32> {
    items.iter().filter_map(Item::as_setting).find_map(|setting| {
        if let SettingKind::Priority(priority) = setting.kind { Some(priority) } else { None }
    })
}

fn unused_macros(lowering: &mut Lowering<'_>) {
    let unused: Vec<&Name> =
        lowering.macros.iter().filter(|one| !one.is_used).map(|one| &one.source.name).collect();
    for name in unused {
        lowering.report(
            Diagnostic::warning(codes::UNUSED_MACRO, format!("macro `{name}` is never used"))
                .plural(format!("`{name}`"), "macros", "are never used")
                .at(name.span, "")
                .help(format!("use it with `macro step m1 = {name}`, or remove it")),
        );
    }
}

/// A macro or library chart that is being expanded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Open<'a> {
    /// The name, with the location of its declaration; this location identifies the macro or library chart.
    pub(super) name: &'a Name,
    /// Location of the use.
    pub(super) span: Span,
    /// The word for the macro or library chart in messages.
    pub(super) kind: &'static str,
}

pub(super) struct Expansion<'l, 'a> {
    pub(super) lowering: &'l mut Lowering<'a>,
    /// Macros and library charts being expanded.
    pub(super) open: Vec<Open<'a>>,
    /// The nesting depth of the current body.
    depth: usize,
    /// True if the object limit was reached and reported.
    is_full: bool,
}

impl<'a> Expansion<'_, 'a> {
    pub(super) fn items(&mut self, scope: ScopeId, items: &'a [Item]) {
        if self.depth >= MAX_DEPTH {
            let span = self.lowering.net.parts[self.lowering.scopes[scope].part].name.span;
            let finding = Diagnostic::error(
                codes::EXPANSION_SIZE,
                format!("bodies are nested more than {MAX_DEPTH} levels deep"),
            )
            .at(span, "the innermost one")
            .help("use fewer levels");
            self.lowering.report(finding);
            return;
        }
        self.depth += 1;
        let first_macro = self.lowering.macros.len();
        for item in items {
            if let Item::Macro(source) = item {
                let id = self.lowering.macros.len();
                self.lowering.declare(scope, &source.name, Symbol::Macro(id));
                self.lowering.macros.push(MacroDefinition { source, scope, is_used: false });
            }
        }
        let last_macro = self.lowering.macros.len();
        for item in items {
            // After the object limit nothing more is expanded; otherwise the expansion of nested macros could take for ever.
            if !self.is_full {
                self.item(scope, item);
            }
        }
        if self.lowering.expand_unused {
            for id in first_macro..last_macro {
                if !self.lowering.macros[id].is_used {
                    let name = self.lowering.macros[id].source.name.clone();
                    self.instantiate(scope, &name, id, name.span);
                }
            }
        }
        self.depth -= 1;
    }

    fn item(&mut self, scope: ScopeId, item: &'a Item) {
        match item {
            Item::Setting(chart::Setting { kind: SettingKind::Shared(sharing, names), .. })
                if !names.is_empty() =>
            {
                self.lowering.work.push(Work::Shared { scope, sharing: *sharing, names });
            }
            Item::Setting(setting) => {
                let is_top = self.lowering.scopes[scope].parent.is_none();
                if !is_top && !matches!(setting.kind, SettingKind::Priority(_)) {
                    self.lowering.report(
                        Diagnostic::error(
                            codes::DECLARED_INSIDE,
                            "this setting belongs to the chart, not to a body in it",
                        )
                        .at(setting.span, "")
                        .help("move it to the top level of the chart"),
                    );
                }
            }
            Item::Declaration(declaration) => self.declaration(scope, declaration),
            Item::Step(step) => {
                if matches!(step.role, StepRole::Final) && !self.lowering.is_statechart() {
                    self.only_in_statechart(step.name.span, "a final state");
                }
                let kind =
                    if step.role == StepRole::Final { StepKind::Final } else { StepKind::Leaf };
                self.step(scope, step, kind);
            }
            Item::Transition(transition) => self.transition(scope, transition),
            Item::Macro(_) => {}
            Item::MacroStep(step) => self.macro_step(scope, step),
            Item::Enclosing(enclosing) => self.enclosing(scope, enclosing),
            Item::State(state) => self.state(scope, state),
            Item::Use(source) => self.instance(scope, source),
            Item::Action(source) => self.action(scope, source),
            Item::Emergency(source) => {
                self.lowering.work.push(Work::Emergency { scope, source });
            }
            Item::Property(source) => {
                self.lowering.work.push(Work::Property { scope, source });
            }
            Item::Place(source) => self.lowering.work.push(Work::Place { scope, source }),
            Item::Board(source) => self.lowering.work.push(Work::Board { scope, source }),
        }
    }

    fn only_in_statechart(&mut self, span: Span, what: &str) {
        self.lowering.report(
            Diagnostic::error(
                codes::CHART_KIND,
                format!("{what} is allowed only in a statechart"),
            )
            .at(span, "")
            .help("write `conflict inner-first` or `conflict outer-first` to make it a statechart"),
        );
    }

    fn not_in_statechart(&mut self, span: Span, what: &str) {
        if self.lowering.is_statechart() {
            self.lowering.report(
                Diagnostic::error(codes::CHART_KIND, format!("{what} is not allowed in a statechart"))
                    .at(span, "")
                    .help("a statechart has states, regions and history; choose another conflict policy for a Grafcet"),
            );
        }
    }

    fn action(&mut self, scope: ScopeId, source: &'a chart::Action) {
        self.not_in_statechart(source.name.span, "a controlled action");
        let name = self.lowering.full_name(scope, &source.name);
        let action = self.lowering.drawn_actions.len();
        self.lowering.drawn_actions.push(DrawnAction { name, id: None, uses: Vec::new() });
        if self.lowering.declare(scope, &source.name, Symbol::Action(action)) {
            self.lowering.work.push(Work::Action { scope, action, source });
        }
    }

    /// True while there is room for more steps and transitions.
    pub(super) fn has_room(&mut self, span: Span) -> bool {
        // Expansions count too: macros that only contain macros create no step but still multiply.
        let net = &self.lowering.net;
        let objects = net.steps.len()
            + net.transitions.len()
            + self.lowering.instances.len()
            + self.lowering.n_instances;
        // The size of the file bounds what it contains directly; only expansions multiply.
        if self.open.is_empty() || objects < self.lowering.max_objects {
            return true;
        }
        if !self.is_full {
            self.is_full = true;
            let most = self.lowering.max_objects;
            let span = self.open.first().map_or(span, |open| open.span);
            self.lowering.report(
                Diagnostic::error(
                    codes::EXPANSION_SIZE,
                    format!(
                        "the expansion of macro-steps has more than {most} steps and transitions"
                    ),
                )
                .at(span, "reached in the expansion of this macro-step")
                .help("use fewer levels: if macros use other macros several times, the number of copies multiplies"),
            );
        }
        false
    }

    fn step(&mut self, scope: ScopeId, source: &'a chart::Step, kind: StepKind) -> Option<StepId> {
        if !self.has_room(source.name.span) {
            return None;
        }
        let name = self.lowering.full_name(scope, &source.name);
        let place = &self.lowering.scopes[scope];
        let mut step = Step { kind, meta: source.meta.clone(), ..Step::new(name, place.part) };
        step.parent = place.inside;
        step.activation_link = source.activation_link;
        let is_initial = source.role == StepRole::Initial && !self.lowering.is_statechart();
        // An initial step of a library chart is active when its instance begins: at reset, or with the enclosing step.
        let is_linked = is_initial && place.is_instance && place.inside.is_some();
        step.activation_link |= is_linked;
        step.is_initial = is_initial && !is_linked;
        let mut priority: Option<(u32, Span)> = None;
        let mut twice = Vec::new();
        for item in &source.body {
            if let StepItemKind::Priority(number) = item.kind {
                match priority {
                    Some((_, first)) => twice.push((item.span, first)),
                    None => priority = Some((number, item.span)),
                }
            }
        }
        step.priority = priority.map(|(number, _)| number);
        for (again, first) in twice {
            self.lowering.report(Diagnostic::twice(
                codes::SETTING_TWICE,
                format!("step `{}` has two priorities", source.name),
                [again, first],
                "keep one of them",
            ));
        }
        let id = self.lowering.net.steps.push(step);
        self.lowering.declare(scope, &source.name, Symbol::Step(id));
        super::counted::declare(self.lowering, scope, id, source);
        self.lowering.work.push(Work::Step { scope, id, source });
        if source.body.iter().any(|item| matches!(item.kind, StepItemKind::Task { .. })) {
            self.lowering.tasked.insert(id);
        }
        for item in &source.body {
            if matches!(item.kind, StepItemKind::On { .. }) {
                let part = self.lowering.scopes[scope].part;
                let reaction = self.skeleton(Name::default(), part, TransitionKind::Reaction);
                let reaction = self.lowering.net.transitions.push(reaction);
                self.lowering.work.push(Work::Reaction {
                    scope,
                    id: reaction,
                    step: id,
                    source: item,
                });
            }
        }
        Some(id)
    }

    fn skeleton(&self, name: Name, part: PartId, kind: TransitionKind) -> Transition {
        Transition {
            name,
            part,
            kind,
            requires: Vec::new(),
            clears: Vec::new(),
            enters: Vec::new(),
            events: Vec::new(),
            guard: Expr::bool(true),
            priority: None,
            restart: self.lowering.is_statechart(),
            actions: Vec::new(),
            deadline_ns: None,
            meta: crate::net::Meta::default(),
        }
    }

    fn transition(&mut self, scope: ScopeId, source: &'a chart::Transition) {
        if !self.has_room(source.meta.span) {
            return;
        }
        let part = self.lowering.scopes[scope].part;
        let name = match &source.name {
            Some(name) => self.lowering.full_name(scope, name),
            None => Name::default(),
        };
        let is_reaction = source.is_internal && source.targets.is_empty();
        let kind = if is_reaction { TransitionKind::Reaction } else { TransitionKind::Move };
        let mut transition = self.skeleton(name, part, kind);
        transition.priority = source.priority;
        transition.restart |= source.restart;
        if source.deadline_ns.is_some() {
            self.lowering.report(
                Diagnostic::note(codes::DEADLINE, "only `split` checks a `deadline`")
                    .at(source.meta.span, "has a deadline")
                    .help("`build --target c --report` shows the worst-case time of a reaction"),
            );
        }
        transition.deadline_ns = source.deadline_ns;
        transition.meta = source.meta.clone();
        let id = self.lowering.net.transitions.push(transition);
        if let Some(name) = &source.name {
            self.lowering.declare(scope, name, Symbol::Transition(id));
        }
        self.lowering.work.push(Work::Transition { scope, id, source });
    }

    fn macro_step(&mut self, scope: ScopeId, source: &'a chart::MacroStep) {
        self.not_in_statechart(source.name.span, "a macro-step");
        if !self.has_room(source.name.span) {
            return;
        }
        let Some(symbol) = self.macro_of(scope, source) else {
            self.lowering.declare(scope, &source.name, Symbol::Broken);
            return;
        };
        self.lowering.macros[symbol].is_used = true;
        // Declared before its expansion, so that the expansion cannot use the name for another item.
        let instance = self.lowering.instances.len();
        self.lowering.declare(scope, &source.name, Symbol::MacroStep(instance));
        let Some(instance) = self.instantiate(scope, &source.name, symbol, source.name.span) else {
            return;
        };
        let instance = &self.lowering.instances[instance];
        if let (Some(entry), Some(exit)) = (instance.entry, instance.exit) {
            if let Some(priority) = source.priority {
                self.lowering.net.steps[entry].priority = Some(priority);
            }
            if source.role == StepRole::Initial {
                self.lowering.net.steps[entry].is_initial = true;
            }
            let steps = instance.steps.clone().map(StepId::from_index).collect();
            let name = Name::new(
                format!("{}{}", self.lowering.scopes[scope].prefix, source.name.text),
                source.name.span,
            );
            self.lowering.taken.insert(name.text.clone());
            let meta = source.meta.clone();
            self.lowering.net.macros.push(crate::net::MacroStep { name, steps, entry, exit, meta });
        }
    }

    /// The macro that a macro-step uses.
    fn macro_of(&mut self, scope: ScopeId, source: &chart::MacroStep) -> Option<MacroId> {
        match self.lowering.wanting("macro", |lowering| lowering.symbol_of(scope, &source.body)) {
            Ok(Symbol::Macro(id)) => Some(id),
            Ok(other) => {
                self.lowering.wrong_kind(source.body.span, &source.body, other, "a macro");
                None
            }
            Err(_) => None,
        }
    }

    fn instantiate(
        &mut self,
        scope: ScopeId,
        name: &Name,
        id: MacroId,
        span: Span,
    ) -> Option<usize> {
        let MacroDefinition { source, scope: drawn_in, .. } = self.lowering.macros[id];
        let number = self.lowering.instances.len();
        let outer = &self.lowering.scopes[scope];
        let (outer_part, inside, chart) = (outer.part, outer.inside, outer.chart);
        let prefix = format!("{}{}.", outer.prefix, name.text);
        let part = Part {
            name: Name::new(prefix.trim_end_matches('.'), name.span),
            level: self.lowering.net.parts[outer_part].level + 1,
            priority: part_priority(&source.items).or(self.lowering.net.parts[outer_part].priority),
            initial: Vec::new(),
            is_cut: false,
            meta: source.meta.clone(),
        };
        let cycle = self.is_open(&source.name);
        let part = self.lowering.net.parts.push(part);
        let body = new_scope(self.lowering, Some(drawn_in), prefix, part, inside, chart);
        let first = self.lowering.net.steps.len();
        self.lowering.instances.push(Instance {
            scope: body,
            entry: None,
            exit: None,
            steps: first..first,
            timer: None,
        });
        if let Some(start) = cycle {
            self.recursion(start, &source.name, span);
            return None;
        }
        self.open.push(Open { name: &source.name, span, kind: "macro" });
        self.items(body, &source.items);
        self.open.pop();
        let (entry, exit) = self.ends(body, source);
        let last = self.lowering.net.steps.len();
        let instance = &mut self.lowering.instances[number];
        instance.steps = first..last;
        instance.entry = entry;
        instance.exit = exit;
        Some(number)
    }

    /// The index of the expansion with this name in the list of open expansions.
    pub(super) fn is_open(&self, name: &'a Name) -> Option<usize> {
        self.open.iter().position(|open| std::ptr::eq(open.name, name))
    }

    /// Reports an expansion that contains itself.
    pub(super) fn recursion(&mut self, start: usize, name: &Name, span: Span) {
        let open = self.open[start];
        let mut cycle: Vec<&str> =
            self.open[start..].iter().map(|open| open.name.text.as_str()).collect();
        cycle.push(&name.text);
        let message = format!("{} `{name}` contains itself: {}", open.kind, cycle.join(" -> "));
        let mut finding = Diagnostic::error(codes::MACRO_RECURSION, message)
            .at(span, format!("expands `{name}` again"));
        for open in &self.open[start + 1..] {
            finding = finding.at(open.span, "expanded here");
        }
        let finding = finding.help("remove one of these uses: every use is copied into the net, so the expansion would not end");
        self.lowering.report(finding);
    }

    /// Entry and exit step of an expansion.
    fn ends(
        &mut self,
        body: ScopeId,
        source: &'a chart::Macro,
    ) -> (Option<StepId>, Option<StepId>) {
        let mut entries: Vec<&Name> = Vec::new();
        let mut exits: Vec<&Name> = Vec::new();
        for item in &source.items {
            let (name, role) = if let Item::Step(step) = item {
                (&step.name, step.role)
            } else if let Item::MacroStep(step) = item {
                (&step.name, step.role)
            } else {
                continue;
            };
            match role {
                StepRole::MacroEntry => entries.push(name),
                StepRole::MacroExit => exits.push(name),
                StepRole::MacroEntryExit => {
                    entries.push(name);
                    exits.push(name);
                }
                StepRole::Plain | StepRole::Initial | StepRole::Final => {}
            }
        }
        (self.end(body, source, "entry", &entries), self.end(body, source, "exit", &exits))
    }

    fn end(
        &mut self,
        body: ScopeId,
        source: &chart::Macro,
        word: &str,
        steps: &[&Name],
    ) -> Option<StepId> {
        let name = &source.name;
        match steps {
            [] => {
                self.lowering.report(
                    Diagnostic::error(
                        codes::MACRO_SHAPE,
                        format!("macro `{name}` has no {word} step"),
                    )
                    .at(name.span, "")
                    .help(format!(
                        "write `{word} step` for the step where it {}",
                        if word == "entry" { "begins" } else { "ends" }
                    )),
                );
                None
            }
            [first, rest @ ..] => {
                for again in rest {
                    self.lowering.report(Diagnostic::twice(
                        codes::MACRO_SHAPE,
                        format!("macro `{name}` has more than one {word} step"),
                        [again.span, first.span],
                        "a macro-step has exactly one of each",
                    ));
                }
                match self.lowering.find(body, &first.text) {
                    Some(Symbol::Step(step)) => Some(step),
                    // If a macro begins with a macro-step, it begins where that one begins; the same applies to its end.
                    Some(Symbol::MacroStep(inner)) => {
                        let inner = &self.lowering.instances[inner];
                        if word == "entry" { inner.entry } else { inner.exit }
                    }
                    _ => None,
                }
            }
        }
    }

    fn enclosing(&mut self, scope: ScopeId, source: &'a chart::Enclosing) {
        self.not_in_statechart(source.step.name.span, "an enclosing step");
        let Some(id) = self.step(scope, &source.step, StepKind::Enclosing) else { return };
        let outer = &self.lowering.scopes[scope];
        let outer_part = outer.part;
        let part = Part {
            name: self.lowering.net.steps[id].name.clone(),
            level: self.lowering.net.parts[outer_part].level + 1,
            priority: part_priority(&source.items).or(self.lowering.net.parts[outer_part].priority),
            initial: Vec::new(),
            is_cut: false,
            meta: source.step.meta.clone(),
        };
        let part = self.lowering.net.parts.push(part);
        let body = enclosed_scope(self.lowering, scope, part, id);
        self.lowering.bodies.insert(id, body);
        self.items(body, &source.items);
    }

    fn state(&mut self, scope: ScopeId, source: &'a chart::State) {
        if !self.lowering.is_statechart() {
            self.only_in_statechart(source.step.name.span, "a state");
        }
        let has_children =
            source.items.iter().any(|item| matches!(item, Item::Step(_) | Item::State(_)));
        let kind = match (source.step.role, source.is_parallel, has_children) {
            (StepRole::Final, _, _) => StepKind::Final,
            (_, true, _) => StepKind::Parallel,
            (_, false, true) => StepKind::Composite,
            (_, false, false) => StepKind::Leaf,
        };
        let Some(id) = self.step(scope, &source.step, kind) else { return };
        let part = self.lowering.scopes[scope].part;
        let body = enclosed_scope(self.lowering, scope, part, id);
        self.lowering.bodies.insert(id, body);
        self.lowering.work.push(Work::State { scope: body, id, source });
        for history in &source.histories {
            // Histories are named after their states: `a.H`, `b.H`.
            let qualified =
                Name::new(format!("{}.{}", source.step.name, history.name), history.name.span);
            let name = self.lowering.full_name(body, &qualified);
            let made = self.lowering.net.histories.push(crate::net::History {
                name,
                owner: id,
                cases: Vec::new(),
                default: Vec::new(),
                default_content: Vec::new(),
                meta: history.meta.clone(),
            });
            self.lowering.declare_history(body, &history.name, Symbol::History(made));
        }
        self.items(body, &source.items);
    }
}
