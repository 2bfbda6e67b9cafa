//! The parts of a design as one-line text, independent of their position.

use grafsynth_ir::chart::{
    ActionHow, ArgumentValue, Block, Declaration, DeclarationKind, Emergency, Expr, ForceOrder,
    Item, Length, MacroStep, Parameter, Place, Property, Setting, SettingKind, StepItem,
    StepItemKind, StepRole, Stmt, StmtKind, Transition, Use,
};
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Meta, Qualifier, Side, Verbatim};

use super::names::{self, Position};
use super::settings::{POLICIES, SCHEDULES};
use super::write_expr::ExprWriter;

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
                        let values: Vec<String> =
                            many.iter().map(|value| self.exprs.text(value)).collect();
                        out.push_str(&format!(" = [{}]", values.join(", ")));
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
                let params: Vec<String> = params
                    .iter()
                    .map(|(name, ty)| match name.as_str() {
                        "" => type_text(*ty),
                        name => {
                            format!("{}: {}", names::name(name, Position::Anywhere), type_text(*ty))
                        }
                    })
                    .collect();
                out.push_str(&format!("({})", params.join(", ")));
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

    /// A step item on the line of its step; `None` for an item that contains a list.
    pub(crate) fn inline_item(&self, item: &StepItem) -> Option<String> {
        match &item.kind {
            StepItemKind::Action { .. }
            | StepItemKind::Priority(_)
            | StepItemKind::Budget(_)
            | StepItemKind::Force { .. } => Some(self.step_item_head(item)),
            StepItemKind::Code(verbatim) if !verbatim.text.contains('\n') => {
                Some(self.step_item_head(item))
            }
            _ => None,
        }
    }

    /// The item without its list.
    pub(crate) fn step_item_head(&self, item: &StepItem) -> String {
        match &item.kind {
            StepItemKind::Action { target, arguments, how, condition } => {
                let arguments =
                    arguments.as_ref().map_or_else(String::new, |all| self.arguments(all));
                let condition = condition
                    .as_ref()
                    .map_or_else(String::new, |c| format!(" if {}", self.exprs.text(c)));
                let action =
                    format!("{}{arguments}", names::dotted(&target.text, Position::Action));
                let latched = names::dotted(&target.text, Position::Anywhere);
                let text = match how {
                    ActionHow::Bare => action,
                    ActionHow::After(ns) => format!("{action} after {}", names::duration(*ns)),
                    ActionHow::For(ns) => format!("{action} for {}", names::duration(*ns)),
                    // `set` and `reset` accept only a name.
                    ActionHow::Qualified(Qualifier::S, _) if arguments.is_empty() => {
                        format!("set {latched}")
                    }
                    ActionHow::Qualified(Qualifier::R, _) if arguments.is_empty() => {
                        format!("reset {latched}")
                    }
                    ActionHow::Qualified(qualifier, duration) => {
                        let duration = duration
                            .map_or_else(String::new, |ns| format!(" {}", names::duration(ns)));
                        format!("{action} {}{duration}", qualifier_word(*qualifier))
                    }
                };
                text + &condition
            }
            StepItemKind::Entry(_) => "entry".to_owned(),
            StepItemKind::Exit(_) => "exit".to_owned(),
            StepItemKind::On { events, guard, .. } => {
                let mut words = Vec::new();
                if !events.is_empty() {
                    words.push(format!("on {}", event_list(events)));
                }
                if let Some(guard) = guard {
                    words.push(format!("when {}", self.exprs.text(guard)));
                } else if events.is_empty() {
                    words.push("when true".to_owned());
                }
                words.join(" ")
            }
            StepItemKind::Priority(value) => format!("priority {value}"),
            StepItemKind::Budget(value) => format!("budget {value}"),
            StepItemKind::Task { name, cost, .. } => {
                let cost = cost.map_or_else(String::new, |cost| format!(" cost {cost}"));
                format!("task {}{cost}", names::name(&name.text, Position::Anywhere))
            }
            StepItemKind::Code(verbatim) => code(verbatim),
            StepItemKind::Force { target, order } => {
                let order = match order {
                    ForceOrder::Situation(steps) if steps.is_empty() => "{}".to_owned(),
                    ForceOrder::Situation(steps) => {
                        let steps: Vec<String> = steps
                            .iter()
                            .map(|step| names::path(step, Position::Anywhere))
                            .collect();
                        format!("{{ {} }}", steps.join(", "))
                    }
                    ForceOrder::Init => "init".to_owned(),
                    ForceOrder::Hold => "hold".to_owned(),
                };
                format!("force {} {order}", names::path(target, Position::Anywhere))
            }
        }
    }

    /// `{ a; b }`, if every statement fits on one line.
    pub(crate) fn inline_list(&self, block: &Block) -> Option<String> {
        if block.is_empty() {
            return Some("{}".to_owned());
        }
        let stmts: Option<Vec<String>> = block.iter().map(|stmt| self.inline_stmt(stmt)).collect();
        Some(format!("{{ {} }}", stmts?.join("; ")))
    }

    pub(crate) fn inline_stmt(&self, stmt: &Stmt) -> Option<String> {
        match &stmt.kind {
            StmtKind::If { .. } => None,
            StmtKind::Code(verbatim) if verbatim.text.contains('\n') => None,
            _ => Some(self.stmt_text(stmt)),
        }
    }

    pub(crate) fn stmt_text(&self, stmt: &Stmt) -> String {
        match &stmt.kind {
            StmtKind::Assign { target, index, value } => {
                let index = index
                    .as_ref()
                    .map_or_else(String::new, |index| format!("[{}]", self.exprs.text(index)));
                format!(
                    "{}{index} := {}",
                    names::path(target, Position::Anywhere),
                    self.exprs.text(value)
                )
            }
            StmtKind::Raise(event) => {
                format!("raise {}", names::dotted(&event.text, Position::Anywhere))
            }
            StmtKind::Send { event, after, slot } => {
                let after =
                    after.map_or_else(String::new, |ns| format!(" after {}", names::duration(ns)));
                let slot = slot.as_ref().map_or_else(String::new, |slot| {
                    format!(" as {}", names::name(&slot.text, Position::Anywhere))
                });
                format!("send {}{after}{slot}", names::dotted(&event.text, Position::Anywhere))
            }
            StmtKind::Cancel(slot) => {
                format!("cancel {}", names::name(&slot.text, Position::Anywhere))
            }
            StmtKind::Call { function, arguments } => {
                format!(
                    "call {}{}",
                    names::dotted(&function.text, Position::Anywhere),
                    self.arguments(arguments)
                )
            }
            StmtKind::If { condition, .. } => format!("if {}", self.exprs.text(condition)),
            StmtKind::Code(verbatim) => code(verbatim),
        }
    }

    pub(crate) fn arguments(&self, arguments: &[Expr]) -> String {
        let arguments: Vec<String> =
            arguments.iter().map(|argument| self.exprs.text(argument)).collect();
        format!("({})", arguments.join(", "))
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

    /// `name: sources -> targets`, the clauses after it except the actions, and the index of the receptivity among them.
    pub(crate) fn transition(&self, transition: &Transition) -> (String, Vec<String>, usize) {
        let mut head = String::new();
        if let Some(name) = &transition.name {
            head.push_str(&format!("{}: ", names::name(&name.text, Position::Anywhere)));
        }
        let sources: Vec<String> = transition
            .sources
            .iter()
            .map(|path| {
                let opens = transition.name.is_none() && path.names.len() == 1;
                names::path(path, if opens { Position::Source } else { Position::Anywhere })
            })
            .collect();
        let targets: Vec<String> = transition
            .targets
            .iter()
            .enumerate()
            .map(|(index, path)| {
                names::path(path, if index == 0 { Position::Target } else { Position::Anywhere })
            })
            .collect();
        if transition.is_internal && targets.is_empty() {
            // A reaction does not leave its step.
            head.push_str("in ");
            head.push_str(&sources.join(" & "));
        } else {
            head.push_str(&sources.join(" & "));
            head.push_str(if sources.is_empty() { "->" } else { " ->" });
        }
        if !targets.is_empty() {
            head.push(' ');
            head.push_str(&targets.join(" & "));
        } else if transition.is_sink {
            head.push_str(" sink");
        }
        let mut clauses = Vec::new();
        if transition.is_internal && !transition.targets.is_empty() {
            clauses.push("internal".to_owned());
        }
        if !transition.events.is_empty() {
            clauses.push(format!("on {}", event_list(&transition.events)));
        }
        let guard_at = clauses.len();
        if let Some(guard) = &transition.guard {
            clauses.push(format!("when {}", self.exprs.text(guard)));
        }
        match &transition.after {
            Some((Length::Ns(ns), _)) => clauses.push(format!("after {}", names::duration(*ns))),
            Some((Length::Named(path), _)) => {
                clauses.push(format!("after {}", names::path(path, Position::Length)));
            }
            None => {}
        }
        if let Some(priority) = transition.priority {
            clauses.push(format!("priority {priority}"));
        }
        if transition.restart {
            clauses.push("restart".to_owned());
        }
        if let Some(ns) = transition.deadline_ns {
            clauses.push(format!("deadline {}", names::duration(ns)));
        }
        let attributes = attributes(&transition.meta);
        if !attributes.is_empty() {
            clauses.push(attributes.trim_start().to_owned());
        }
        (head, clauses, guard_at)
    }

    /// `use conveyor as c1(start = m, done -> x)`
    pub(crate) fn instance(&self, one: &Use) -> String {
        let library = names::name(&one.library.text, Position::Anywhere);
        let name = names::name(&one.name.text, Position::Anywhere);
        let arguments: Vec<String> = one
            .arguments
            .iter()
            .map(|argument| {
                let parameter = names::name(&argument.parameter.text, Position::Anywhere);
                match &argument.value {
                    ArgumentValue::Reads(value) => {
                        format!("{parameter} = {}", self.exprs.text(value))
                    }
                    ArgumentValue::Drives(path) => {
                        format!("{parameter} -> {}", names::path(path, Position::Anywhere))
                    }
                }
            })
            .collect();
        let arguments = if arguments.is_empty() {
            String::new()
        } else {
            format!("({})", arguments.join(", "))
        };
        format!("use {library} as {name}{arguments}{}", attributes(&one.meta))
    }

    /// A list on one line, even if it contains other lists: `{ a := 1; if b { c := 2 } }`.
    pub(crate) fn one_line_list(&self, block: &Block) -> String {
        if block.is_empty() {
            return "{}".to_owned();
        }
        let stmts: Vec<String> = block.iter().map(|stmt| self.one_line_stmt(stmt)).collect();
        format!("{{ {} }}", stmts.join("; "))
    }

    fn one_line_stmt(&self, stmt: &Stmt) -> String {
        match &stmt.kind {
            StmtKind::If { condition, then, otherwise } => {
                let mut out =
                    format!("if {} {}", self.exprs.text(condition), self.one_line_list(then));
                if !otherwise.is_empty() {
                    out.push_str(&format!(" else {}", self.one_line_list(otherwise)));
                }
                out
            }
            StmtKind::Code(verbatim) => one_line_code(verbatim),
            _ => self.stmt_text(stmt),
        }
    }

    /// An item of the body of a step on one line, even if it contains a list.
    pub(crate) fn one_line_item(&self, item: &StepItem) -> String {
        let head = self.step_item_head(item);
        match &item.kind {
            StepItemKind::Entry(block)
            | StepItemKind::Exit(block)
            | StepItemKind::On { actions: block, .. }
            | StepItemKind::Task { body: block, .. } => {
                format!("{head} {}", self.one_line_list(block))
            }
            StepItemKind::Code(verbatim) => one_line_code(verbatim),
            _ => head,
        }
    }
}

fn one_line_code(verbatim: &Verbatim) -> String {
    format!(
        "code {} {}",
        names::name(&verbatim.language, Position::Anywhere),
        names::quoted(&verbatim.text)
    )
}

/// The names of extern conditions, which are written with parentheses.
pub(crate) fn conditions(items: &[Item]) -> std::collections::BTreeSet<String> {
    items
        .iter()
        .filter_map(Item::as_declaration)
        .filter(|one| matches!(one.kind, DeclarationKind::ExternCondition { .. }))
        .map(|one| one.name.text.clone())
        .collect()
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
    let items: Vec<String> =
        place.items.iter().map(|item| names::path(item, Position::Anywhere)).collect();
    let side = match place.side {
        Side::Chip => "chip",
        Side::Cpu => "cpu",
    };
    format!("place {} on {side}", items.join(", "))
}

pub(crate) fn event_list(events: &[grafsynth_ir::Name]) -> String {
    let events: Vec<String> = events
        .iter()
        .enumerate()
        .map(|(index, event)| {
            names::event(
                &event.text,
                if index == 0 { Position::Target } else { Position::Anywhere },
            )
        })
        .collect();
    events.join(", ")
}

/// `code c "…"`. Several lines are written between triple quotes, without escapes.
pub(crate) fn code(verbatim: &Verbatim) -> String {
    let language = names::name(&verbatim.language, Position::Anywhere);
    let text = &verbatim.text;
    let is_raw = text.contains('\n')
        && !text.contains("\"\"\"")
        && !text.ends_with('"')
        && !text.contains('\r');
    if is_raw {
        format!("code {language} \"\"\"\n{text}\"\"\"")
    } else {
        format!("code {language} {}", names::quoted(text))
    }
}

/// The letters of the standard, except for the pulse, which has a word.
pub(crate) fn qualifier_word(qualifier: Qualifier) -> &'static str {
    if qualifier == Qualifier::P { "pulse" } else { qualifier.letters() }
}

pub(crate) fn setting_text(setting: &Setting) -> String {
    match &setting.kind {
        SettingKind::Tick(ns) => format!("tick {}", names::duration(*ns)),
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
            let paths: Vec<String> =
                paths.iter().map(|path| names::path(path, names::Position::Anywhere)).collect();
            format!("shared {} {}", sharing.word(), paths.join(", ")).trim_end().to_owned()
        }
    }
}
