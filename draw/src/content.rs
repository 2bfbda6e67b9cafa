//! A chart as symbols and links.

use crate::Style;
use crate::action_block::{self, forced};
use crate::foreign::{Foreign, note_expr, note_list};
use crate::notation::{Notation, Signs, duration, quoted};
use crate::order::Node;
use crate::picture::{Element, Pen};
use crate::states::Tree;
use crate::symbol::{Action, Kind, Symbol, When};
use crate::text::Rich;
use grafsynth_ir::chart::{
    ActionHow, ArgumentValue, Chart, Declaration, DeclarationKind, Design, Expr, Item, Length,
    Library, Path, SettingKind, Step, StepItem, StepItemKind, StepRole, Transition,
};
use grafsynth_ir::net::{Meta, Qualifier, Schedule};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// A chart, or an expansion that has a frame of its own.
#[derive(Debug, Default)]
pub(crate) struct Scope {
    pub(crate) heading: String,
    /// Remarks below the heading.
    pub(crate) remarks: Vec<Rich>,
    pub(crate) symbols: Vec<Symbol>,
    /// The sizes of the symbols before anything was added or left blank: they decide about the order. Empty if the symbols are as they were.
    pub(crate) plain: Vec<Node>,
    /// Links by the numbers of their symbols.
    pub(crate) links: Vec<(usize, usize)>,
    /// Expansions of macros and enclosing steps.
    pub(crate) inner: Vec<Scope>,
    /// The states, if this is a statechart.
    pub(crate) states: Option<Tree>,
}

/// All parts of a design that are drawn.
#[derive(Debug, Default)]
pub(crate) struct Content {
    pub(crate) scopes: Vec<Scope>,
    pub(crate) foreign: BTreeSet<Foreign>,
    pub(crate) style: Style,
    /// The explanations of colours and letters, each with its colour, if it has one.
    pub(crate) legend: Vec<(Option<Pen>, String)>,
    /// The width of a page, if the drawing is for pages.
    pub(crate) room: Option<i64>,
}

/// Collects the content of the design or of one chart, with conditions in the words of the chart language or in the signs of the style.
pub(crate) fn content(design: &Design, charts: &[&Chart], style: Style, words: bool) -> Content {
    let mut declared = BTreeSet::new();
    design.charts.iter().for_each(|chart| declare(&chart.items, &mut declared));
    for library in &design.libraries {
        declare(&library.items, &mut declared);
        declared.extend(library.parameters.iter().map(|one| one.declaration.name.text.clone()));
    }
    declared.extend(design.charts.iter().map(|chart| chart.name.text.clone()));
    let mut booleans = BTreeSet::new();
    let libraries = design.libraries.iter().map(|library| &library.items);
    for items in design.charts.iter().map(|chart| &chart.items).chain(libraries) {
        booleans.extend(items.iter().filter_map(boolean));
    }
    let signs = match style {
        _ if words => Signs::Words,
        Style::Grafcet => Signs::Grafcet,
        Style::Sfc => Signs::St,
    };
    let mut reader = Reader {
        notation: Notation { signs, declared: Rc::new(declared) },
        style,
        booleans,
        controlled: None,
        foreign: BTreeSet::new(),
        chart: String::new(),
        depth: 0,
    };
    let mut scopes: Vec<Scope> = charts.iter().map(|chart| reader.chart(chart)).collect();
    if charts.len() == design.charts.len() {
        scopes.extend(design.libraries.iter().map(|library| reader.library(library)));
    }
    let mut foreign = reader.foreign;
    if words {
        foreign.retain(|it| !it.is_in_text());
        foreign.insert(Foreign::Words);
    }
    Content { scopes, foreign, style, legend: Vec::new(), room: None }
}

/// The outputs with a qualifier that stores or gives a pulse, and the actions (semantics §3.5); `None` for all, if the chart declares `actions iec`.
fn controlled(items: &[Item]) -> Option<BTreeSet<String>> {
    let mut settings = items.iter().filter_map(Item::as_setting);
    if settings.any(|setting| setting.kind == SettingKind::ActionsIec) {
        return None;
    }
    let mut names = BTreeSet::new();
    add_controlled(items, &mut names);
    Some(names)
}

fn add_controlled(items: &[Item], names: &mut BTreeSet<String>) {
    for item in items {
        let step = match item {
            Item::Action(one) => {
                names.insert(one.name.text.clone());
                continue;
            }
            Item::Step(step) => step,
            Item::Enclosing(one) => {
                add_controlled(&one.items, names);
                &one.step
            }
            Item::Macro(one) => {
                add_controlled(&one.items, names);
                continue;
            }
            _ => continue,
        };
        for item in &step.body {
            if let StepItemKind::Action { target, how: ActionHow::Qualified(qualifier, _), .. } =
                &item.kind
                && !matches!(qualifier, Qualifier::N | Qualifier::D | Qualifier::L)
            {
                names.insert(target.text.clone());
            }
        }
    }
}

/// The name of a Boolean output or variable.
fn boolean(item: &Item) -> Option<String> {
    let one = item.as_declaration()?;
    let (DeclarationKind::Output { ty, .. } | DeclarationKind::Var { ty, len: None, .. }) =
        &one.kind
    else {
        return None;
    };
    ty.is_bool().then(|| one.name.text.clone())
}

/// Adds all names declared in a list of items.
fn declare(items: &[Item], names: &mut BTreeSet<String>) {
    for item in items {
        let name = match item {
            Item::Declaration(one) => &one.name,
            Item::Step(one) => &one.name,
            Item::Action(one) => &one.name,
            Item::MacroStep(one) => &one.name,
            Item::Use(one) => &one.name,
            Item::Macro(one) => {
                declare(&one.items, names);
                &one.name
            }
            Item::Enclosing(one) => {
                declare(&one.items, names);
                &one.step.name
            }
            Item::State(one) => {
                declare(&one.items, names);
                names.extend(one.histories.iter().map(|history| history.name.text.clone()));
                &one.step.name
            }
            _ => continue,
        };
        names.insert(name.text.clone());
    }
}

struct Reader {
    notation: Notation,
    style: Style,
    /// The Boolean outputs and variables.
    booleans: BTreeSet<String>,
    /// The outputs and actions of the chart that the control of IEC 61131-3 runs; `None` for all.
    controlled: Option<BTreeSet<String>>,
    foreign: BTreeSet<Foreign>,
    /// The name of the chart.
    chart: String,
    depth: usize,
}

impl Reader {
    fn chart(&mut self, chart: &Chart) -> Scope {
        self.chart.clone_from(&chart.name.text);
        self.controlled = controlled(&chart.items);
        if is_statechart(&chart.items) {
            let heading = headed("statechart", &chart.name.text, &chart.meta);
            return self.statechart(heading, &chart.items, Tree::of_chart(chart, &self.notation));
        }
        let kind = if self.style == Style::Sfc { "SFC" } else { "G" };
        let heading = headed(kind, &chart.name.text, &chart.meta);
        self.scope(heading, &chart.name.text, &chart.items)
    }

    fn library(&mut self, library: &Library) -> Scope {
        self.chart.clone_from(&library.name.text);
        self.controlled = controlled(&library.items);
        self.foreign.insert(Foreign::Library);
        let heading = headed("library", &library.name.text, &library.meta);
        let mut scope = if is_statechart(&library.items) {
            self.statechart(heading, &library.items, Tree::of_library(library, &self.notation))
        } else {
            self.scope(heading, &library.name.text, &library.items)
        };
        let parameters: Vec<String> =
            library.parameters.iter().map(|one| self.parameter(&one.declaration)).collect();
        if !parameters.is_empty() {
            scope.remarks.insert(0, Rich::plain(parameters.join(", ")));
        }
        scope
    }

    fn parameter(&self, declaration: &Declaration) -> String {
        let kind = match &declaration.kind {
            DeclarationKind::Input { .. } => "input",
            DeclarationKind::Output { .. } => "output",
            DeclarationKind::Var { .. } => "var",
            DeclarationKind::Event { .. } => "event",
            DeclarationKind::Const { .. } => "const",
            DeclarationKind::Timer { .. } => "timer",
            DeclarationKind::ExternCondition { .. } | DeclarationKind::ExternAction { .. } => {
                "extern"
            }
        };
        format!("{kind} {}", self.notation.word(&declaration.name.text))
    }

    /// A statechart, with the words of the chart language in its remarks, too.
    fn statechart(&mut self, heading: String, items: &[Item], states: Tree) -> Scope {
        let signs = std::mem::replace(&mut self.notation.signs, Signs::Words);
        // What IEC 60848 lacks is of no interest here.
        let foreign = self.foreign.clone();
        let mut remarks = settings(items);
        remarks.extend(items.iter().filter_map(|item| self.remark(item)));
        (self.notation.signs, self.foreign) = (signs, foreign);
        Scope { heading, remarks, states: Some(states), ..Scope::default() }
    }

    /// Reads a list of items; `prefix` makes the ids of its symbols unique.
    fn scope(&mut self, heading: String, prefix: &str, items: &[Item]) -> Scope {
        let mut scope = Scope { heading, ..Scope::default() };
        let mut steps = BTreeMap::new();
        self.depth += 1;
        scope.remarks = settings(items);
        let mut inner = Vec::new();
        for item in items {
            let (symbol, name, meta) = match item {
                Item::Step(step) => (self.step(step, Kind::Step), &step.name, &step.meta),
                Item::Enclosing(one) => {
                    let id = format!("{prefix}.{}", one.step.name.text);
                    self.foreign.insert(Foreign::Enclosing);
                    let heading = headed("", &one.step.name.text, &Meta::default());
                    inner.push(self.scope(heading, &id, &one.items));
                    (self.step(&one.step, Kind::EnclosingStep), &one.step.name, &one.step.meta)
                }
                Item::MacroStep(one) => {
                    self.foreign.insert(Foreign::Macro);
                    let mut symbol = Symbol::new(Kind::MacroStep, &one.name.text);
                    set_role(&mut symbol, one.role);
                    symbol.remarks.push(format!("= {}", self.notation.word(&one.body.text)));
                    self.priority(&mut symbol, one.priority);
                    about(&mut symbol, &one.meta);
                    (symbol, &one.name, &one.meta)
                }
                Item::Use(one) => {
                    self.foreign.insert(Foreign::Library);
                    let name = format!("{} : {}", one.name.text, one.library.text);
                    let mut symbol = Symbol::new(Kind::Instance, name);
                    for argument in &one.arguments {
                        let name = self.notation.word(&argument.parameter.text);
                        symbol.remarks.push(match &argument.value {
                            ArgumentValue::Reads(expr) => {
                                format!("{name} = {}", self.notation.spelled().expr(expr).text)
                            }
                            ArgumentValue::Drives(target) => {
                                format!("{name} → {}", self.notation.path(target))
                            }
                        });
                    }
                    about(&mut symbol, &one.meta);
                    (symbol, &one.name, &one.meta)
                }
                Item::Macro(one) => {
                    let heading = headed("M", &one.name.text, &one.meta);
                    let id = format!("{prefix}.{}", one.name.text);
                    inner.push(self.scope(heading, &id, &one.items));
                    continue;
                }
                _ => {
                    scope.remarks.extend(self.remark(item));
                    continue;
                }
            };
            let mut symbol = symbol;
            let id = format!("{prefix}.{}", name.text);
            symbol.element = Some(Element { id, span: meta.span });
            steps.entry(name.text.clone()).or_insert(scope.symbols.len());
            scope.symbols.push(symbol);
        }
        scope.inner = inner;
        for (number, item) in items.iter().enumerate() {
            if let Item::Transition(transition) = item {
                self.transition(&mut scope, &steps, transition, &format!("{prefix}-t{number}"));
            }
        }
        self.depth -= 1;
        scope
    }

    /// Texts about the other items, as remarks.
    fn remark(&mut self, item: &Item) -> Option<Rich> {
        let (mut text, condition) = match item {
            Item::Emergency(one) => {
                self.foreign.insert(Foreign::Emergency);
                (Rich::plain("emergency "), Some(&one.condition))
            }
            Item::Declaration(Declaration {
                name,
                kind: DeclarationKind::Timer { condition },
                ..
            }) => {
                self.foreign.insert(Foreign::Timer);
                (
                    Rich::plain(format!("timer {}: ", self.notation.word(&name.text))),
                    Some(condition),
                )
            }
            Item::Action(one) if !one.body.is_empty() => {
                self.foreign.insert(Foreign::NamedList);
                note_list(&mut self.foreign, &one.body);
                let name = self.notation.word(&one.name.text);
                (Rich::plain(format!("action {name}: {}", self.notation.block(&one.body))), None)
            }
            _ => return None,
        };
        if let Some(condition) = condition {
            note_expr(&mut self.foreign, condition);
            text.append(&self.notation.expr(condition));
        }
        Some(text)
    }

    fn step(&mut self, step: &Step, kind: Kind) -> Symbol {
        let mut symbol = Symbol::new(kind, &step.name.text);
        set_role(&mut symbol, step.role);
        if step.activation_link {
            let star = if symbol.left.is_empty() { "*" } else { " *" };
            symbol.left.push_str(star);
        }
        let own = Path::from(step.name.clone());
        symbol.is_stacked = self.style == Style::Sfc;
        for item in &step.body {
            match &item.kind {
                StepItemKind::Priority(rank) => self.priority(&mut symbol, Some(*rank)),
                StepItemKind::Budget(cost) => {
                    self.foreign.insert(Foreign::Task);
                    symbol.remarks.push(format!("budget {cost}"));
                }
                _ if symbol.is_stacked => {
                    let mut context = action_block::Context {
                        notation: &self.notation,
                        booleans: &self.booleans,
                        controlled: self.controlled.as_ref(),
                        foreign: &mut self.foreign,
                    };
                    symbol.actions.extend(action_block::row(&mut context, item));
                }
                _ => symbol.actions.push(self.action(&own, item)),
            }
        }
        if let Some(count) = step.count {
            self.foreign.insert(Foreign::Count);
            let initial = count.initial.map(|n| format!(" = {n}")).unwrap_or_default();
            symbol.remarks.push(format!("count 0..{}{initial}", count.max));
        }
        about(&mut symbol, &step.meta);
        symbol
    }

    /// The box of an item in the notation of Grafcet.
    fn action(&mut self, step: &Path, item: &StepItem) -> Action {
        let mut action = Action::default();
        match &item.kind {
            StepItemKind::Action { target, arguments, how, condition } => {
                action.text = Rich::plain(self.notation.word(&target.text));
                if let Some(arguments) = arguments {
                    let words = self.notation.spelled();
                    let all: Vec<String> =
                        arguments.iter().map(|one| words.expr(one).text).collect();
                    action.text.push(&format!("({})", all.join(", ")));
                }
                self.how(&mut action, step, *how, condition.as_ref());
            }
            StepItemKind::Entry(block) => {
                action.when = When::Activation;
                action.text = Rich::plain(self.notation.block(block));
            }
            StepItemKind::Exit(block) => {
                action.when = When::Deactivation;
                action.text = Rich::plain(self.notation.block(block));
            }
            StepItemKind::On { events, guard, actions } => {
                self.foreign.insert(Foreign::Reaction);
                action.qualifier = "on".to_owned();
                action.text = Rich::plain(self.notation.block(actions));
                let events: Vec<String> = events.iter().map(|name| name.text.clone()).collect();
                action.condition = self.condition(&events, guard.as_ref(), &[]);
            }
            StepItemKind::Priority(_) | StepItemKind::Budget(_) => {}
            StepItemKind::Task { name, cost, body } => {
                self.foreign.insert(Foreign::Task);
                let cost = cost.map(|cost| format!(" cost {cost}")).unwrap_or_default();
                action.qualifier = format!("task {}{cost}", self.notation.word(&name.text));
                action.text = Rich::plain(self.notation.block(body));
            }
            StepItemKind::Code(code) => {
                self.foreign.insert(Foreign::Code);
                action.qualifier = "code".to_owned();
                let language = self.notation.word(&code.language);
                action.text = Rich::plain(format!("{language} {}", quoted(&code.text)));
            }
            StepItemKind::Force { target, order } => {
                action.is_forcing = true;
                action.text = Rich::plain(forced(&self.notation, target, order));
            }
        }
        action
    }

    /// Adds the qualifier and the condition of an action.
    fn how(&mut self, action: &mut Action, step: &Path, how: ActionHow, condition: Option<&Expr>) {
        let mut conditions = Vec::new();
        match how {
            ActionHow::Bare => {}
            ActionHow::After(ns) => conditions.push(self.notation.elapsed(step, ns)),
            ActionHow::For(ns) => {
                let elapsed = self.notation.elapsed(step, ns);
                let mut not = Rich::default();
                if self.notation.signs == Signs::Words {
                    not.push("not (");
                    not.append(&elapsed);
                    not.push(")");
                } else {
                    not.append(&elapsed);
                    not.overline(0);
                }
                conditions.push(not);
            }
            ActionHow::Qualified(qualifier, ns) => {
                self.foreign.insert(Foreign::Qualifier);
                action.qualifier = qualifier.letters().to_owned();
                if let Some(ns) = ns {
                    action.qualifier.push_str(&format!(" {}", duration(ns)));
                }
            }
        }
        if let Some(condition) = condition {
            conditions.push(if conditions.is_empty() {
                self.notation.expr(condition)
            } else {
                self.notation.operand(condition)
            });
        }
        if !conditions.is_empty() {
            action.condition = Some(self.notation.all(&conditions));
        }
    }

    fn priority(&mut self, symbol: &mut Symbol, rank: Option<u32>) {
        if let Some(rank) = rank {
            self.foreign.insert(Foreign::Priority);
            symbol.remarks.push(format!("priority {rank}"));
        }
    }

    /// The conjunction of events, a condition and times; `None` if there is none of them.
    fn condition(
        &mut self,
        events: &[String],
        guard: Option<&Expr>,
        times: &[Rich],
    ) -> Option<Rich> {
        let n_parts = usize::from(!events.is_empty()) + usize::from(guard.is_some()) + times.len();
        let mut parts = Vec::new();
        if !events.is_empty() {
            parts.push(self.notation.any_of(events));
        }
        if let Some(guard) = guard {
            note_expr(&mut self.foreign, guard);
            parts.push(if n_parts > 1 {
                self.notation.operand(guard)
            } else {
                self.notation.expr(guard)
            });
        }
        parts.extend(times.iter().cloned());
        (n_parts > 0).then(|| self.notation.all(&parts))
    }

    fn transition(
        &mut self,
        scope: &mut Scope,
        steps: &BTreeMap<String, usize>,
        transition: &Transition,
        id: &str,
    ) {
        let times: Vec<Rich> = match &transition.after {
            None => Vec::new(),
            Some((length, _)) => {
                let sources = transition.sources.iter();
                let time = |step: &Path| match length {
                    Length::Ns(ns) => self.notation.elapsed(step, *ns),
                    Length::Named(name) => {
                        let time = self.notation.time(step);
                        self.notation.compared(&time, ">=", &self.notation.path(name))
                    }
                };
                sources.map(time).collect()
            }
        };
        let events: Vec<String> = transition.events.iter().map(|name| name.text.clone()).collect();
        let condition = self.condition(&events, transition.guard.as_ref(), &times);
        if condition.as_ref().is_some_and(|it| it.text.contains("otherwise")) {
            self.foreign.insert(Foreign::Otherwise);
        }
        let is_reaction = transition.is_internal && transition.targets.is_empty();
        if is_reaction
            && let Some(step) = transition.sources.first().and_then(|it| self.local(steps, it))
        {
            self.foreign.insert(Foreign::Reaction);
            let name = transition.name.as_ref();
            let name = name.map(|name| format!("{}: ", self.notation.word(&name.text)));
            let text = self.notation.block(&transition.actions);
            scope.symbols[step].actions.push(Action {
                qualifier: "on".to_owned(),
                text: Rich::plain(name.unwrap_or_default() + &text),
                condition,
                ..Action::default()
            });
            return;
        }
        let name = transition.name.as_ref().map(|name| name.text.clone()).unwrap_or_default();
        let mut symbol = Symbol::new(Kind::Transition, name);
        symbol.receptivity =
            Some(condition.unwrap_or_else(|| Rich::plain(self.notation.truth(true))));
        self.priority(&mut symbol, transition.priority);
        if transition.restart {
            self.foreign.insert(Foreign::Restart);
            symbol.remarks.push("restart".to_owned());
        }
        if let Some(ns) = transition.deadline_ns {
            self.foreign.insert(Foreign::Deadline);
            symbol.remarks.push(format!("deadline {}", duration(ns)));
        }
        about(&mut symbol, &transition.meta);
        if !transition.actions.is_empty() {
            self.foreign.insert(Foreign::OnFiring);
            note_list(&mut self.foreign, &transition.actions);
            let text = Rich::plain(self.notation.block(&transition.actions));
            symbol.actions.push(Action { text, ..Action::default() });
        }
        symbol.element = Some(Element { id: id.to_owned(), span: transition.meta.span });
        let own = scope.symbols.len();
        scope.symbols.push(symbol);
        if transition.sources.is_empty() || transition.targets.is_empty() {
            self.foreign.insert(Foreign::Open);
        }
        for step in &transition.sources {
            let from = self.end(scope, steps, step, true);
            scope.links.push((from, own));
        }
        for step in &transition.targets {
            let to = self.end(scope, steps, step, false);
            scope.links.push((own, to));
        }
    }

    /// The symbol at the end of a link: a step of the scope, or a reference to a step elsewhere.
    fn end(
        &mut self,
        scope: &mut Scope,
        steps: &BTreeMap<String, usize>,
        step: &Path,
        is_source: bool,
    ) -> usize {
        if let Some(symbol) = self.local(steps, step) {
            return symbol;
        }
        let name = self.notation.path(step);
        let text = if is_source { format!("{name} →") } else { format!("→ {name}") };
        self.foreign.insert(Foreign::Open);
        scope.symbols.push(Symbol::new(Kind::Reference, text));
        scope.symbols.len() - 1
    }

    /// The step of the scope with this path.
    fn local(&self, steps: &BTreeMap<String, usize>, step: &Path) -> Option<usize> {
        match step.names.as_slice() {
            [only] => steps.get(&only.text).copied(),
            [chart, only] if chart.text == self.chart && self.depth == 1 => {
                steps.get(&only.text).copied()
            }
            _ => None,
        }
    }
}

fn set_role(symbol: &mut Symbol, role: StepRole) {
    match role {
        StepRole::Plain | StepRole::Final => {}
        StepRole::Initial => symbol.is_initial = true,
        StepRole::MacroEntry => symbol.left.push('E'),
        StepRole::MacroExit => symbol.left.push('S'),
        StepRole::MacroEntryExit => symbol.left.push_str("E S"),
    }
}

/// Adds the comment and the requirement tags.
fn about(symbol: &mut Symbol, meta: &Meta) {
    if !meta.label.is_empty() {
        symbol.remarks.push(quoted(&meta.label));
    }
    if !meta.req.is_empty() {
        symbol.remarks.push(format!("req {}", meta.req.join(", ")));
    }
}

fn headed(kind: &str, name: &str, meta: &Meta) -> String {
    let kind = if kind.is_empty() { String::new() } else { format!("{kind} ") };
    let label =
        if meta.label.is_empty() { String::new() } else { format!(" {}", quoted(&meta.label)) };
    format!("{kind}{name}{label}")
}

/// True if the chart has states, or a policy of statecharts.
fn is_statechart(items: &[Item]) -> bool {
    items.iter().any(|item| match item {
        Item::State(_) => true,
        Item::Setting(setting) => {
            matches!(setting.kind, SettingKind::Conflict(policy) if policy.is_statechart())
        }
        _ => false,
    })
}

/// The settings on one line, if there are any.
fn settings(items: &[Item]) -> Vec<Rich> {
    let all: Vec<String> =
        items.iter().filter_map(Item::as_setting).map(|one| setting(&one.kind)).collect();
    let line = (!all.is_empty()).then(|| Rich::plain(all.join(" · ")));
    line.into_iter().collect()
}

/// A setting as in the chart language.
fn setting(kind: &SettingKind) -> String {
    match kind {
        SettingKind::Tick(ns) => format!("tick {}", duration(*ns)),
        SettingKind::Conflict(policy) => {
            format!("conflict {}", policy.word())
        }
        SettingKind::EvolutionSingle => "evolution single".to_owned(),
        SettingKind::EvolutionStable(None) => "evolution stable".to_owned(),
        SettingKind::EvolutionStable(Some(limit)) => format!("evolution stable limit {limit}"),
        SettingKind::Schedule(schedule) => {
            let schedule = match schedule {
                Schedule::Declared => "declared",
                Schedule::Level => "level",
                Schedule::Priority => "priority",
            };
            format!("schedule {schedule}")
        }
        SettingKind::FireOne(one) => format!("fire {}", if *one { "one" } else { "all" }),
        SettingKind::AssignSimultaneous(true) => "assign simultaneous".to_owned(),
        SettingKind::AssignSimultaneous(false) => "assign ordered".to_owned(),
        SettingKind::ActionsIec => "actions iec".to_owned(),
        SettingKind::FinalScan => "final scan".to_owned(),
        SettingKind::Queue(n) => format!("queue {n}"),
        SettingKind::EventsExclusive => "events exclusive".to_owned(),
        SettingKind::Priority(rank) => format!("priority {rank}"),
        SettingKind::Shared(..) => "shared".to_owned(),
    }
}
