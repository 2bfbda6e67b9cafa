//! A chart as symbols and links.

use crate::notation::{Notation, duration, path, quoted, word};
use crate::picture::Element;
use crate::states::Tree;
use crate::symbol::{Action, Kind, Symbol, When};
use crate::text::Rich;
use grafsynth_ir::chart::{
    ActionHow, ArgumentValue, Chart, Declaration, DeclarationKind, Design, Expr, ForceOrder, Item,
    Length, Library, Path, SettingKind, Step, StepItem, StepItemKind, StepRole, Transition,
};
use grafsynth_ir::net::{Meta, Policy, Schedule};
use std::collections::{BTreeMap, BTreeSet};

/// A chart, or an expansion that has a frame of its own.
#[derive(Debug, Default)]
pub(crate) struct Scope {
    pub(crate) heading: String,
    /// Remarks below the heading.
    pub(crate) remarks: Vec<Rich>,
    pub(crate) symbols: Vec<Symbol>,
    /// Links by the numbers of their symbols.
    pub(crate) links: Vec<(usize, usize)>,
    /// Expansions of macros and enclosing steps.
    pub(crate) inner: Vec<Scope>,
    /// The states, if this is a statechart.
    pub(crate) states: Option<Tree>,
}

/// Notation that is not part of IEC 60848, for the legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Foreign {
    Qualifier,
    Otherwise,
    Priority,
    Reaction,
    Task,
    Code,
    Count,
    Restart,
    Library,
    Words,
    Hold,
    Emergency,
}

impl Foreign {
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Foreign::Qualifier => "N, R, S, P, L, D, SD, DS, SL: action block of IEC 61131-3",
            Foreign::Otherwise => "otherwise: no earlier transition from the same step is fireable",
            Foreign::Priority => "priority n: rank in conflicts, 1 first",
            Foreign::Reaction => "on: runs while the step is active and the condition is true",
            Foreign::Task => {
                "task: work of the step that is not interrupted; budget: work per reaction"
            }
            Foreign::Code => "code: code in a target language",
            Foreign::Count => "count: counted step, which contains the number of its activations",
            Foreign::Restart => "restart, deadline: clauses of the chart language",
            Foreign::Library => "a named box with `name : chart`: an instance of a library chart",
            Foreign::Words => "and, or, not, …: the words of the chart language",
            Foreign::Hold => "timer, action: a named condition or list that the chart uses",
            Foreign::Emergency => "emergency: while true, all outputs have their safe values",
        }
    }
}

/// All parts of a design that are drawn.
#[derive(Debug, Default)]
pub(crate) struct Content {
    pub(crate) scopes: Vec<Scope>,
    pub(crate) foreign: BTreeSet<Foreign>,
}

/// Collects the content of the design or of one chart.
pub(crate) fn content(design: &Design, charts: &[&Chart], words: bool) -> Content {
    let mut declared = BTreeSet::new();
    design.charts.iter().for_each(|chart| declare(&chart.items, &mut declared));
    for library in &design.libraries {
        declare(&library.items, &mut declared);
        declared.extend(library.parameters.iter().map(|one| one.declaration.name.text.clone()));
    }
    declared.extend(design.charts.iter().map(|chart| chart.name.text.clone()));
    let mut reader = Reader {
        notation: Notation { words, declared },
        foreign: BTreeSet::new(),
        chart: String::new(),
        depth: 0,
    };
    if words {
        reader.foreign.insert(Foreign::Words);
    }
    let mut scopes: Vec<Scope> = charts.iter().map(|chart| reader.chart(chart)).collect();
    if charts.len() == design.charts.len() {
        scopes.extend(design.libraries.iter().map(|library| reader.library(library)));
    }
    Content { scopes, foreign: reader.foreign }
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
            _ => continue,
        };
        names.insert(name.text.clone());
    }
}

struct Reader {
    notation: Notation,
    foreign: BTreeSet<Foreign>,
    /// The name of the chart.
    chart: String,
    depth: usize,
}

impl Reader {
    fn chart(&mut self, chart: &Chart) -> Scope {
        self.chart.clone_from(&chart.name.text);
        if is_statechart(&chart.items) {
            let heading = headed("statechart", &chart.name.text, &chart.meta);
            return self.statechart(heading, &chart.items, Tree::of_chart(chart));
        }
        let heading = headed("G", &chart.name.text, &chart.meta);
        self.scope(heading, &chart.name.text, &chart.items)
    }

    fn library(&mut self, library: &Library) -> Scope {
        self.chart.clone_from(&library.name.text);
        self.foreign.insert(Foreign::Library);
        let heading = headed("library", &library.name.text, &library.meta);
        let mut scope = if is_statechart(&library.items) {
            self.statechart(heading, &library.items, Tree::of_library(library))
        } else {
            self.scope(heading, &library.name.text, &library.items)
        };
        let parameters: Vec<String> =
            library.parameters.iter().map(|one| parameter(&one.declaration)).collect();
        if !parameters.is_empty() {
            scope.remarks.insert(0, Rich::plain(parameters.join(", ")));
        }
        scope
    }

    /// A statechart, with the words of the chart language in its remarks, too.
    fn statechart(&mut self, heading: String, items: &[Item], states: Tree) -> Scope {
        let words = std::mem::replace(&mut self.notation.words, true);
        // What IEC 60848 lacks is of no interest here.
        let foreign = self.foreign.clone();
        let mut remarks = settings(items);
        remarks.extend(items.iter().filter_map(|item| self.remark(item)));
        (self.notation.words, self.foreign) = (words, foreign);
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
                    let heading = headed("", &one.step.name.text, &Meta::default());
                    inner.push(self.scope(heading, &id, &one.items));
                    (self.step(&one.step, Kind::EnclosingStep), &one.step.name, &one.step.meta)
                }
                Item::MacroStep(one) => {
                    let mut symbol = Symbol::new(Kind::MacroStep, &one.name.text);
                    set_role(&mut symbol, one.role);
                    symbol.remarks.push(format!("= {}", word(&one.body.text)));
                    self.priority(&mut symbol, one.priority);
                    about(&mut symbol, &one.meta);
                    (symbol, &one.name, &one.meta)
                }
                Item::Use(one) => {
                    self.foreign.insert(Foreign::Library);
                    let name = format!("{} : {}", one.name.text, one.library.text);
                    let mut symbol = Symbol::new(Kind::Instance, name);
                    for argument in &one.arguments {
                        let name = word(&argument.parameter.text);
                        symbol.remarks.push(match &argument.value {
                            ArgumentValue::Reads(expr) => {
                                let words = Notation { words: true, ..Notation::default() };
                                format!("{name} = {}", words.expr(expr).text)
                            }
                            ArgumentValue::Drives(target) => format!("{name} → {}", path(target)),
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
                self.foreign.insert(Foreign::Hold);
                (Rich::plain(format!("timer {}: ", word(&name.text))), Some(condition))
            }
            Item::Action(one) if !one.body.is_empty() => {
                self.foreign.insert(Foreign::Hold);
                let name = word(&one.name.text);
                (Rich::plain(format!("action {name}: {}", self.notation.block(&one.body))), None)
            }
            _ => return None,
        };
        if let Some(condition) = condition {
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
        for item in &step.body {
            self.item(&mut symbol, &own, item);
        }
        if let Some(count) = step.count {
            self.foreign.insert(Foreign::Count);
            let initial = count.initial.map(|n| format!(" = {n}")).unwrap_or_default();
            symbol.remarks.push(format!("count 0..{}{initial}", count.max));
        }
        about(&mut symbol, &step.meta);
        symbol
    }

    fn item(&mut self, symbol: &mut Symbol, step: &Path, item: &StepItem) {
        let mut action = Action {
            qualifier: String::new(),
            when: When::Always,
            text: Rich::default(),
            condition: None,
            is_forcing: false,
        };
        match &item.kind {
            StepItemKind::Action { target, arguments, how, condition } => {
                action.text = Rich::plain(word(&target.text));
                if let Some(arguments) = arguments {
                    let words = Notation { words: true, ..Notation::default() };
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
            StepItemKind::Priority(rank) => return self.priority(symbol, Some(*rank)),
            StepItemKind::Budget(cost) => {
                self.foreign.insert(Foreign::Task);
                symbol.remarks.push(format!("budget {cost}"));
                return;
            }
            StepItemKind::Task { name, cost, body } => {
                self.foreign.insert(Foreign::Task);
                let cost = cost.map(|cost| format!(" cost {cost}")).unwrap_or_default();
                action.qualifier = format!("task {}{cost}", word(&name.text));
                action.text = Rich::plain(self.notation.block(body));
            }
            StepItemKind::Code(code) => {
                self.foreign.insert(Foreign::Code);
                action.qualifier = "code".to_owned();
                action.text =
                    Rich::plain(format!("{} {}", word(&code.language), quoted(&code.text)));
            }
            StepItemKind::Force { target, order } => {
                action.is_forcing = true;
                let order = match order {
                    ForceOrder::Situation(steps) => {
                        let steps: Vec<String> = steps.iter().map(path).collect();
                        steps.join(", ")
                    }
                    ForceOrder::Init => "INIT".to_owned(),
                    ForceOrder::Hold => "*".to_owned(),
                };
                action.text = Rich::plain(format!("G {} {{{order}}}", path(target)));
            }
        }
        symbol.actions.push(action);
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
                if self.notation.words {
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
                        self.notation.compared(&format!("{}.t", path(step)), ">=", &path(name))
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
            let name = transition.name.as_ref().map(|name| format!("{}: ", word(&name.text)));
            let text = self.notation.block(&transition.actions);
            scope.symbols[step].actions.push(Action {
                qualifier: "on".to_owned(),
                when: When::Always,
                text: Rich::plain(name.unwrap_or_default() + &text),
                condition,
                is_forcing: false,
            });
            return;
        }
        let name = transition.name.as_ref().map(|name| name.text.clone()).unwrap_or_default();
        let mut symbol = Symbol::new(Kind::Transition, name);
        let always = if self.notation.words { "true" } else { "1" };
        symbol.receptivity = Some(condition.unwrap_or_else(|| Rich::plain(always)));
        self.priority(&mut symbol, transition.priority);
        if transition.restart || transition.deadline_ns.is_some() {
            self.foreign.insert(Foreign::Restart);
        }
        if transition.restart {
            symbol.remarks.push("restart".to_owned());
        }
        if let Some(ns) = transition.deadline_ns {
            symbol.remarks.push(format!("deadline {}", duration(ns)));
        }
        about(&mut symbol, &transition.meta);
        if !transition.actions.is_empty() {
            symbol.actions.push(Action {
                qualifier: String::new(),
                when: When::Always,
                text: Rich::plain(self.notation.block(&transition.actions)),
                condition: None,
                is_forcing: false,
            });
        }
        symbol.element = Some(Element { id: id.to_owned(), span: transition.meta.span });
        let own = scope.symbols.len();
        scope.symbols.push(symbol);
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
        let text =
            if is_source { format!("{} →", path(step)) } else { format!("→ {}", path(step)) };
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

fn parameter(declaration: &Declaration) -> String {
    let kind = match &declaration.kind {
        DeclarationKind::Input { .. } => "input",
        DeclarationKind::Output { .. } => "output",
        DeclarationKind::Var { .. } => "var",
        DeclarationKind::Event { .. } => "event",
        DeclarationKind::Const { .. } => "const",
        DeclarationKind::Timer { .. } => "timer",
        DeclarationKind::ExternCondition { .. } | DeclarationKind::ExternAction { .. } => "extern",
    };
    format!("{kind} {}", word(&declaration.name.text))
}

/// True if the chart has states, or a policy of statecharts.
fn is_statechart(items: &[Item]) -> bool {
    items.iter().any(|item| match item {
        Item::State(_) => true,
        Item::Setting(setting) => {
            matches!(setting.kind, SettingKind::Conflict(Policy::InnerFirst | Policy::OuterFirst))
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
            let policy = match policy {
                Policy::All => "all",
                Policy::Priority => "priority",
                Policy::PriorityAge => "priority-age",
                Policy::InnerFirst => "inner-first",
                Policy::OuterFirst => "outer-first",
            };
            format!("conflict {policy}")
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
