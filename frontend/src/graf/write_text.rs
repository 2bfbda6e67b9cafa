//! The parts of a design as one-line text, independent of their position.

use grafsynth_ir::Gather;
use grafsynth_ir::Name;
use grafsynth_ir::chart::{
    ActionHow, ArgumentValue, Declaration, DeclarationKind, Emergency, Expr, ForceOrder, Item,
    Length, MacroStep, Parameter, Path, Place, Property, Setting, SettingKind, StepRole,
    Transition, Use,
};
use grafsynth_ir::duration;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Meta, Qualifier};
use itertools::Itertools as _;

use super::names::{self, Position};
use super::settings::{POLICIES, SCHEDULES};
use super::write_expr::ExprWriter;

/// The position of a clause in a long transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clause {
    /// On the first line, because on a line of its own it would be read as an item of the chart.
    OnFirstLine,
    /// The guard, which may be broken between its operands.
    Guard,
    Other,
}

/// Writes the parts of one design.
#[derive(Debug, Clone, Default)]
pub(crate) struct Text {
    pub(crate) exprs: ExprWriter,
}

impl Text {
    pub(crate) fn declaration(&self, declaration: &Declaration) -> String {
        let mut out = names::name(&declaration.name.text, Position::Declared);
        match &declaration.kind {
            DeclarationKind::Input { ty, .. } => out.push_str(&type_suffix(*ty)),
            DeclarationKind::Output { ty, init, safe, .. } => {
                out.push_str(&type_suffix(*ty));
                if let Some(init) = init {
                    out.push_str(&format!(" = {}", self.exprs.text(init)));
                }
                match safe.as_ref().map(|safe| (&safe.kind, safe)) {
                    None => {}
                    Some((ExprKind::Bool(true), _)) => out.push_str(" safe on"),
                    Some((ExprKind::Bool(false), _)) => out.push_str(" safe off"),
                    Some((_, safe)) => {
                        out.push_str(&format!(" safe {}", self.exprs.text(safe)));
                    }
                }
            }
            DeclarationKind::Var { ty, len, init } => {
                match (ty, len) {
                    (Type::Bool, None) => {}
                    (ty, None) => out.push_str(&format!(": {}", type_text(*ty))),
                    (ty, Some(len)) => out.push_str(&format!(": {}[{len}]", type_text(*ty))),
                }
                match init.as_slice() {
                    [] => {}
                    [one] => out.push_str(&format!(" = {}", self.exprs.text(one))),
                    many => {
                        let values = many.iter().map(|value| self.exprs.text(value));
                        out.push_str(&format!(" = [{}]", values.format(", ")));
                    }
                }
            }
            DeclarationKind::Event { .. } => {}
            DeclarationKind::Timer { condition } => {
                out.push_str(&format!(" while {}", self.exprs.text(condition)))
            }
            DeclarationKind::ExternCondition { ty } => {
                out.push_str("()");
                out.push_str(&type_suffix(*ty));
            }
            DeclarationKind::ExternAction { params } => {
                let params = params.iter().map(|(name, ty)| match name.as_str() {
                    "" => type_text(*ty),
                    name => {
                        format!("{}: {}", names::name(name, Position::Anywhere), type_text(*ty))
                    }
                });
                out.push_str(&format!("({})", params.format(", ")));
            }
            DeclarationKind::Const { value } => {
                out.push_str(&format!(" = {}", self.exprs.text(value)))
            }
        }
        out.push_str(&attributes(&declaration.meta));
        out
    }

    /// A parameter of a library chart, with its keyword.
    pub(crate) fn parameter(&self, parameter: &Parameter) -> String {
        let declaration = &parameter.declaration;
        let name = names::name(&declaration.name.text, Position::Anywhere);
        let ty = match &declaration.kind {
            DeclarationKind::Input { ty, .. }
            | DeclarationKind::Output { ty, .. }
            | DeclarationKind::Var { ty, .. } => type_suffix(*ty),
            _ => String::new(),
        };
        let default = parameter
            .default
            .as_ref()
            .map_or_else(String::new, |value| format!(" = {}", self.exprs.text(value)));
        let attributes = attributes(&declaration.meta);
        format!("{} {name}{ty}{default}{attributes}", keyword(declaration))
    }

    /// `a(1) for 3 s if b`
    pub(crate) fn action(
        &self,
        target: &Name,
        arguments: Option<&[Expr]>,
        how: ActionHow,
        condition: Option<&Expr>,
    ) -> String {
        let arguments = arguments.map(|all| self.arguments(all)).unwrap_or_default();
        let action = format!("{}{arguments}", names::dotted(&target.text, Position::Action));
        let latched = names::dotted(&target.text, Position::Anywhere);
        let action = match how {
            ActionHow::Bare => action,
            ActionHow::After(ns) => format!("{action} after {}", duration(ns)),
            ActionHow::For(ns) => format!("{action} for {}", duration(ns)),
            // `set` and `reset` accept only a name.
            ActionHow::Qualified(Qualifier::S, _) if arguments.is_empty() => {
                format!("set {latched}")
            }
            ActionHow::Qualified(Qualifier::R, _) if arguments.is_empty() => {
                format!("reset {latched}")
            }
            ActionHow::Qualified(qualifier, None) => {
                format!("{action} {}", qualifier_word(qualifier))
            }
            ActionHow::Qualified(qualifier, Some(ns)) => {
                format!("{action} {} {}", qualifier_word(qualifier), duration(ns))
            }
        };
        match condition {
            Some(condition) => format!("{action} if {}", self.exprs.text(condition)),
            None => action,
        }
    }

    pub(crate) fn force(&self, target: &Path, order: &ForceOrder) -> String {
        let order = match order {
            ForceOrder::Situation(steps) if steps.is_empty() => "{}".to_owned(),
            ForceOrder::Situation(steps) => {
                let steps = steps.iter().map(|step| names::path(step, Position::Anywhere));
                format!("{{ {} }}", steps.format(", "))
            }
            ForceOrder::Init => "init".to_owned(),
            ForceOrder::Hold => "hold".to_owned(),
        };
        format!("force {} {order}", names::path(target, Position::Anywhere))
    }

    pub(crate) fn arguments(&self, arguments: &[Expr]) -> String {
        format!("({})", arguments.iter().map(|argument| self.exprs.text(argument)).join(", "))
    }

    pub(crate) fn emergency(&self, emergency: &Emergency) -> String {
        let condition = self.exprs.text(&emergency.condition);
        format!("emergency {condition}{}", attributes(&emergency.meta))
    }

    pub(crate) fn property(&self, property: &Property) -> String {
        let role = if property.is_assumption { "assume" } else { "assert" };
        let name = property.name.as_ref().map_or_else(String::new, |name| {
            format!("{}: ", names::name(&name.text, Position::Anywhere))
        });
        let quantor = if property.is_never { "never" } else { "always" };
        format!(
            "{role} {name}{quantor} ({}){}",
            self.exprs.text(&property.expr),
            attributes(&property.meta)
        )
    }

    /// The clauses of a transition after its head, except the actions.
    pub(crate) fn clauses(&self, transition: &Transition) -> Vec<(Clause, String)> {
        let mut clauses = Vec::new();
        if transition.is_internal && !transition.targets.is_empty() {
            clauses.push((Clause::OnFirstLine, "internal".to_owned()));
        }
        if !transition.events.is_empty() {
            clauses.push((Clause::Other, format!("on {}", event_list(&transition.events))));
        }
        if let Some(guard) = &transition.guard {
            clauses.push((Clause::Guard, format!("when {}", self.exprs.text(guard))));
        }
        if let Some((length, _)) = &transition.after {
            let length = match length {
                Length::Ns(ns) => duration(*ns),
                Length::Named(path) => names::path(path, Position::Length),
            };
            clauses.push((Clause::Other, format!("after {length}")));
        }
        if let Some(priority) = transition.priority {
            clauses.push((Clause::OnFirstLine, format!("priority {priority}")));
        }
        if transition.restart {
            clauses.push((Clause::Other, "restart".to_owned()));
        }
        if let Some(ns) = transition.deadline_ns {
            clauses.push((Clause::Other, format!("deadline {}", duration(ns))));
        }
        let attributes = attributes(&transition.meta);
        if !attributes.is_empty() {
            clauses.push((Clause::Other, attributes.trim_start().to_owned()));
        }
        clauses
    }

    /// `use conveyor as c1(start = m, done -> x)`
    pub(crate) fn instance(&self, one: &Use) -> String {
        let library = names::name(&one.library.text, Position::Anywhere);
        let name = names::name(&one.name.text, Position::Anywhere);
        let arguments = one.arguments.iter().map(|argument| {
            let parameter = names::name(&argument.parameter.text, Position::Anywhere);
            match &argument.value {
                ArgumentValue::Reads(value) => format!("{parameter} = {}", self.exprs.text(value)),
                ArgumentValue::Drives(path) => {
                    format!("{parameter} -> {}", names::path(path, Position::Anywhere))
                }
            }
        });
        let arguments = if one.arguments.is_empty() {
            String::new()
        } else {
            format!("({})", arguments.format(", "))
        };
        format!("use {library} as {name}{arguments}{}", attributes(&one.meta))
    }
}

/// `name: sources -> targets`
pub(super) fn transition_head(transition: &Transition) -> String {
    let name = transition.name.as_ref();
    let label = name.map_or_else(String::new, |name| {
        format!("{}: ", names::name(&name.text, Position::Anywhere))
    });
    let mut sources = transition.sources.iter().map(|path| {
        let opens = name.is_none() && path.names.len() == 1;
        names::path(path, if opens { Position::Source } else { Position::Anywhere })
    });
    let is_reaction = transition.is_internal && transition.targets.is_empty();
    // A reaction does not leave its step.
    let words = if is_reaction { ["in", ""] } else { ["", "->"] };
    let is_sink = transition.is_sink && transition.targets.is_empty();
    let targets = if is_sink { "sink".to_owned() } else { paths(&transition.targets, " & ") };
    let parts = [words[0], &sources.join(" & "), words[1], &targets];
    label + &parts.into_iter().filter(|part| !part.is_empty()).join(" ")
}

/// The names of extern conditions, which are written with parentheses.
pub(crate) fn conditions(items: &[Item]) -> std::collections::BTreeSet<String> {
    items
        .iter()
        .filter_map(Item::as_declaration)
        .filter(|one| matches!(one.kind, DeclarationKind::ExternCondition { .. }))
        .map(|one| one.name.text.clone())
        .gather()
}

pub(crate) fn attributes(meta: &Meta) -> String {
    let mut out = String::new();
    if !meta.label.is_empty() {
        out.push(' ');
        out.push_str(&names::quoted(&meta.label));
    }
    for tag in &meta.req {
        out.push_str(" req ");
        out.push_str(&names::quoted(tag));
    }
    out
}

/// The keyword of a declaration with its modifiers.
pub(crate) fn keyword(declaration: &Declaration) -> &'static str {
    match &declaration.kind {
        DeclarationKind::Input { synchronous: false, .. } => "input",
        DeclarationKind::Input { synchronous: true, .. } => "input synchronous",
        DeclarationKind::Output { registered: false, mealy: false, .. } => "output",
        DeclarationKind::Output { registered: true, mealy: false, .. } => "output registered",
        DeclarationKind::Output { registered: false, mealy: true, .. } => "output mealy",
        DeclarationKind::Output { registered: true, mealy: true, .. } => "output registered mealy",
        DeclarationKind::Var { .. } => "var",
        DeclarationKind::Event { internal: false } => "event",
        DeclarationKind::Event { internal: true } => "internal event",
        DeclarationKind::Timer { .. } => "timer",
        DeclarationKind::ExternCondition { .. } => "extern condition",
        DeclarationKind::ExternAction { .. } => "extern action",
        DeclarationKind::Const { .. } => "const",
    }
}

pub(crate) fn type_text(ty: Type) -> String {
    match ty {
        Type::Bool => "bool".to_owned(),
        Type::Int { lo, hi } => format!("int {lo}..{hi}"),
    }
}

/// The suffix after a name: empty for a Boolean.
pub(crate) fn type_suffix(ty: Type) -> String {
    if ty.is_bool() { String::new() } else { format!(": {}", type_text(ty)) }
}

pub(crate) fn role_words(role: StepRole) -> &'static str {
    match role {
        StepRole::Plain => "",
        StepRole::Initial => "initial ",
        StepRole::MacroEntry => "entry ",
        StepRole::MacroExit => "exit ",
        StepRole::MacroEntryExit => "entry exit ",
        StepRole::Final => "final ",
    }
}

pub(crate) fn macro_step(step: &MacroStep) -> String {
    let role = role_words(step.role);
    let priority = step.priority.map_or_else(String::new, |value| format!(" priority {value}"));
    format!(
        "{role}macro step {} = {}{priority}{}",
        names::name(&step.name.text, Position::Step),
        names::name(&step.body.text, Position::Anywhere),
        attributes(&step.meta)
    )
}

pub(crate) fn place_text(place: &Place) -> String {
    let items = place.items.iter().map(|item| names::path(item, Position::Anywhere));
    let part = names::name(&place.part.text, Position::Anywhere);
    format!("place {} on {part}", items.format(", "))
}

/// The position of the name with this index in a list after a keyword or sign: only the first may be read as a clause.
fn position(index: usize) -> Position {
    if index == 0 { Position::Target } else { Position::Anywhere }
}

/// Paths after a keyword or sign.
pub(super) fn paths(paths: &[Path], between: &str) -> String {
    paths.iter().enumerate().map(|(at, path)| names::path(path, position(at))).join(between)
}

pub(crate) fn event_list(events: &[Name]) -> String {
    events.iter().enumerate().map(|(at, event)| names::event(&event.text, position(at))).join(", ")
}

/// The letters of IEC 61131-3; `P` is written as the word `pulse`.
pub(crate) fn qualifier_word(qualifier: Qualifier) -> &'static str {
    if qualifier == Qualifier::P { "pulse" } else { qualifier.letters() }
}

pub(crate) fn setting_text(setting: &Setting) -> String {
    match &setting.kind {
        SettingKind::Tick(ns) => format!("tick {}", duration(*ns)),
        SettingKind::Conflict(policy) => {
            format!(
                "conflict {}",
                POLICIES.iter().find(|(_, other)| other == policy).map_or("", |(word, _)| word)
            )
        }
        SettingKind::EvolutionSingle => "evolution single".to_owned(),
        SettingKind::EvolutionStable(None) => "evolution stable".to_owned(),
        SettingKind::EvolutionStable(Some(limit)) => format!("evolution stable limit {limit}"),
        SettingKind::Schedule(schedule) => {
            format!(
                "schedule {}",
                SCHEDULES.iter().find(|(_, other)| other == schedule).map_or("", |(word, _)| word)
            )
        }
        SettingKind::FireOne(true) => "fire one".to_owned(),
        SettingKind::FireOne(false) => "fire all".to_owned(),
        SettingKind::AssignSimultaneous(true) => "assign simultaneous".to_owned(),
        SettingKind::AssignSimultaneous(false) => "assign ordered".to_owned(),
        SettingKind::ActionsIec => "actions iec".to_owned(),
        SettingKind::FinalScan => "final scan".to_owned(),
        SettingKind::Queue(n) => format!("queue {n}"),
        SettingKind::EventsExclusive => "events exclusive".to_owned(),
        SettingKind::Priority(n) => format!("priority {n}"),
        SettingKind::Shared(sharing, paths) => {
            let paths = paths.iter().map(|path| names::path(path, Position::Anywhere));
            format!("shared {} {}", sharing.word(), paths.format(", ")).trim_end().to_owned()
        }
    }
}
