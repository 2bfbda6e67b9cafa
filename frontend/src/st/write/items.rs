//! Turns a design into programs of IEC 61131-3 and makes every decision except the text layout. PLCopen XML is written from the same
//! programs.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    ActionHow, Chart, Declaration, DeclarationKind, Design, Expr, Item, Leaf, Length, Path,
    Setting, SettingKind, StepItemKind, StepRole,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Meta, Net, Policy, Qualifier};
use grafsynth_ir::{Name, Span};

use super::text::{self, Names, duration};
use crate::codes;
use crate::graf::write_text::setting_text;
use crate::st::parse::is_reserved;
use crate::st::symbol::Symbol;

/// All programs of a design.
pub(crate) struct Programs {
    pub(crate) programs: Vec<Program>,
    /// Parts that the target cannot contain and that do not affect the behaviour.
    pub(crate) lost: Vec<Diagnostic>,
    /// Parts that the target cannot express.
    pub(crate) findings: Vec<Diagnostic>,
    pub(crate) tick_ns: Option<u64>,
}

#[derive(Default)]
pub(crate) struct Program {
    pub(crate) name: String,
    pub(crate) pragmas: Vec<String>,
    /// Sections: the keyword and its variables.
    pub(crate) sections: Vec<(&'static str, Vec<Var>)>,
    pub(crate) steps: Vec<Step>,
    pub(crate) transitions: Vec<Transition>,
    pub(crate) actions: Vec<Action>,
}

pub(crate) struct Var {
    pub(crate) name: String,
    pub(crate) ty: Type,
    pub(crate) len: Option<u32>,
    /// The type, if this is a function block instance; then `init` is its PT.
    pub(crate) block: Option<String>,
    pub(crate) init: Vec<String>,
    pub(crate) address: Option<String>,
    pub(crate) label: String,
}

impl Var {
    pub(crate) fn ty_text(&self) -> String {
        if let Some(block) = &self.block {
            return block.clone();
        }
        let ty = match self.ty {
            Type::Bool => "BOOL".to_owned(),
            Type::Int { lo, hi } => format!("DINT ({lo}..{hi})"),
        };
        match self.len {
            Some(len) => format!("ARRAY [0..{}] OF {ty}", len.saturating_sub(1)),
            None => ty,
        }
    }
}

pub(crate) struct Step {
    pub(crate) name: String,
    pub(crate) is_initial: bool,
    pub(crate) uses: Vec<Use>,
    pub(crate) label: String,
}

pub(crate) struct Use {
    pub(crate) action: String,
    pub(crate) qualifier: String,
    pub(crate) duration: Option<String>,
}

pub(crate) struct Transition {
    pub(crate) name: Option<String>,
    pub(crate) from: Vec<String>,
    pub(crate) to: Vec<String>,
    pub(crate) priority: Option<u32>,
    pub(crate) restart: bool,
    pub(crate) condition: String,
    pub(crate) label: String,
}

pub(crate) struct Action {
    pub(crate) name: String,
    pub(crate) body: Vec<String>,
    pub(crate) label: String,
}

/// A part of the chart that programs cannot express.
struct Lack {
    /// The word for this kind of part.
    what: String,
    /// Its name, if it has one.
    name: Option<String>,
    span: Span,
}

/// The maximum number of locations and names that a finding shows for each unsupported kind of part; the others are counted.
const SHOWN: usize = 4;

/// One finding for each kind of part that the target cannot express, in the order of the chart.
fn cannot_write(target: &str, lacks: &[Lack]) -> Vec<Diagnostic> {
    let mut kinds: Vec<(&str, Vec<&Lack>)> = Vec::new();
    for lack in lacks {
        match kinds.iter_mut().find(|(what, _)| *what == lack.what) {
            Some((_, places)) => places.push(lack),
            None => kinds.push((&lack.what, vec![lack])),
        }
    }
    kinds.into_iter().map(|(what, places)| cannot_write_kind(target, what, &places)).collect()
}

fn cannot_write_kind(target: &str, what: &str, places: &[&Lack]) -> Diagnostic {
    let names: Vec<&str> = places.iter().filter_map(|one| one.name.as_deref()).collect();
    let more = names.len().saturating_sub(SHOWN);
    let shown = names.iter().take(SHOWN).map(|name| format!("`{name}`"));
    let mut names = shown.collect::<Vec<_>>().join(", ");
    if more > 0 {
        names.push_str(&format!(" and {more} more"));
    }
    let names = match (names.is_empty(), places.len()) {
        (false, _) => format!(" ({names})"),
        (true, 1) => String::new(),
        (true, n) => format!(" ({n} places)"),
    };
    let mut finding =
        Diagnostic::error(codes::ST_CANNOT_WRITE, format!("{target} cannot express {what}{names}"));
    for (index, place) in places.iter().take(SHOWN).enumerate() {
        finding = finding.at(place.span, if index == 0 { "used here" } else { "" });
    }
    finding.help(
        "use `.graf` or `.net`, which can express every chart, or generate C with `build --target c`",
    )
}

struct Maker<'a> {
    lost: Vec<Diagnostic>,
    lacks: Vec<Lack>,
    /// The names as written, by the names of the chart. Steps and all other objects share one namespace.
    names: BTreeMap<&'a str, String>,
    taken: BTreeSet<Symbol>,
    steps: BTreeSet<&'a str>,
    /// Actions with lists; in the target, programs cannot read whether such an action runs (its Q).
    lists: BTreeSet<&'a str>,
    leaving: BTreeSet<String>,
    /// Steps that a transition may restart, that is, leave and enter at once.
    renewed: BTreeSet<&'a str>,
    /// Outputs and actions whose values change before the actions run.
    controlled: BTreeSet<&'a str>,
    /// Why lists of steps and free timers would run in a different order; `None` if they run in the same order.
    unordered: Option<&'static str>,
    /// Lists that run when steps are left or entered, in the order of the steps.
    exits: Vec<Action>,
    entries: Vec<Action>,
    /// The calls of the timers.
    timers: Vec<String>,
}

impl Names for Maker<'_> {
    fn signal(&self, path: &Path) -> Option<String> {
        match path.names.as_slice() {
            [name]
                if !self.steps.contains(name.text.as_str())
                    && !self.lists.contains(name.text.as_str()) =>
            {
                self.names.get(name.text.as_str()).cloned()
            }
            _ => None,
        }
    }

    fn step(&self, name: &str) -> Option<String> {
        self.steps.get(name).and_then(|name| self.names.get(*name)).cloned()
    }

    fn leaves(&self, step: &str) -> bool {
        self.leaving.contains(step)
    }
}

/// The programs of a net, with macro-steps expanded.
///
/// # Errors
/// Returns a finding for everything that the target cannot express.
pub(crate) fn programs_of(net: &Net, target: &'static str) -> Result<Programs, Vec<Diagnostic>> {
    let (net, lost) = super::flat::flat(net);
    let design = crate::from_net::design(&net)?;
    let mut made = programs(&design, target);
    made.lost.splice(0..0, lost);
    Ok(made)
}

/// The unsupported part if the chart is a statechart, which no target can express.
fn statechart(chart: &Chart) -> Option<Lack> {
    let setting = chart.items.iter().find_map(|item| {
        let Item::Setting(setting) = item else { return None };
        let SettingKind::Conflict(policy) = setting.kind else { return None };
        policy.is_statechart().then_some(setting)
    })?;
    // The setting of a text in another language has no location of its own.
    let span = if setting.span == Span::default() { chart.name.span } else { setting.span };
    Some(Lack { what: "statecharts".to_owned(), name: None, span })
}

/// The programs of a design. `target` is the name of the target for messages.
fn programs(design: &Design, target: &'static str) -> Programs {
    let mut all =
        Programs { programs: Vec::new(), lost: Vec::new(), findings: Vec::new(), tick_ns: None };
    let mut taken_charts = BTreeSet::new();
    let mut lacks: Vec<Lack> = design.charts.iter().filter_map(statechart).collect();
    // For a statechart, further unsupported parts are not reported: they are consequences.
    let charts = if lacks.is_empty() { design.charts.as_slice() } else { &[] };
    for chart in charts {
        let mut maker = Maker {
            lost: Vec::new(),
            lacks: Vec::new(),
            names: BTreeMap::new(),
            taken: BTreeSet::new(),
            steps: BTreeSet::new(),
            lists: BTreeSet::new(),
            leaving: BTreeSet::new(),
            renewed: BTreeSet::new(),
            controlled: BTreeSet::new(),
            unordered: (design.charts.len() > 1).then_some("in one of several charts"),
            exits: Vec::new(),
            entries: Vec::new(),
            timers: Vec::new(),
        };
        let mut program = maker.program(chart, &mut all.tick_ns);
        let mut name = identifier(&chart.name.text);
        while !taken_charts.insert(Symbol::of(&name)) {
            name.push('_');
        }
        program.name = name;
        all.programs.push(program);
        all.lost.extend(maker.lost);
        lacks.extend(maker.lacks);
    }
    all.findings.extend(cannot_write(target, &lacks));
    all
}

/// A name that the standard accepts, made from a name of the chart.
fn identifier(text: &str) -> String {
    let mut out: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    if out.starts_with(|c: char| c.is_ascii_digit()) || out.is_empty() {
        out.insert(0, '_');
    }
    // The parser of this crate accepts FROM and TO as names; other tools do not.
    let word = Symbol::of(&out);
    if is_reserved(&word) || matches!(word.as_str(), "FROM" | "TO") {
        out.push('_');
    }
    out
}

impl<'a> Maker<'a> {
    fn cannot(&mut self, what: impl Into<String>, span: Span) {
        self.lacks.push(Lack { what: what.into(), name: None, span });
    }

    /// Like `cannot`, for an object with a name.
    fn cannot_name(&mut self, what: &str, name: &Name, span: Span) {
        self.lacks.push(Lack { what: what.to_owned(), name: Some(name.text.clone()), span });
    }

    fn said(&mut self, written: Result<String, text::Cannot>) -> String {
        match written {
            Ok(text) => text,
            Err((what, span)) => {
                self.cannot(what, span);
                String::new()
            }
        }
    }

    fn lose(&mut self, what: impl Into<String>, span: Span) {
        self.lost.push(
            Diagnostic::warning(codes::ST_LOST, what)
                .at(span, "this")
                .help("the behaviour of the program does not change"),
        );
    }

    fn declare(&mut self, name: &'a Name) -> String {
        let base = identifier(&name.text);
        let mut written = base.clone();
        let mut n = 2;
        while !self.taken.insert(Symbol::of(&written)) {
            written = format!("{base}_{n}");
            n += 1;
        }
        if written != name.text {
            self.lose(format!("`{}` is renamed to `{written}`", name.text), name.span);
        }
        self.names.insert(&name.text, written.clone());
        written
    }

    fn label(&mut self, meta: &Meta) -> String {
        if !meta.req.is_empty() {
            self.lose(format!("the requirement {} is omitted", meta.req.join(", ")), meta.span);
        }
        let one_line = meta.label.split_whitespace().collect::<Vec<_>>().join(" ");
        one_line.replace("*)", "* )").replace("(*", "( *")
    }

    fn program(&mut self, chart: &'a Chart, tick: &mut Option<u64>) -> Program {
        let mut program = Program::default();
        let (mut inputs, mut outputs, mut vars) = (Vec::new(), Vec::new(), Vec::new());
        let settings = || chart.items.iter().filter_map(Item::as_setting).map(|one| &one.kind);
        let priority = settings().any(|kind| *kind == SettingKind::Conflict(Policy::Priority));
        let iec = settings().any(|kind| *kind == SettingKind::ActionsIec);
        // Names are assigned first, because lists and conditions may refer to later items.
        for item in &chart.items {
            match item {
                Item::Declaration(declaration) => {
                    if let Some((kind, var)) = self.variable(declaration) {
                        match kind {
                            0 => inputs.push(var),
                            1 => outputs.push(var),
                            _ => vars.push(var),
                        }
                    }
                }
                Item::Step(step) => {
                    self.steps.insert(&step.name.text);
                    self.declare(&step.name);
                }
                Item::Action(action) => {
                    let name = self.declare(&action.name);
                    if !action.body.is_empty() {
                        self.lists.insert(&action.name.text);
                    } else {
                        let label = self.label(&action.meta);
                        let (address, label) = address(&label, true);
                        vars.push(Var {
                            name,
                            ty: Type::Bool,
                            len: None,
                            block: None,
                            init: Vec::new(),
                            address,
                            label,
                        });
                    }
                }
                Item::Setting(setting) => self.setting(setting, tick, &mut program),
                Item::Transition(_) => {}
                Item::Macro(one) => self.cannot_name("macros", &one.name, one.name.span),
                Item::MacroStep(one) => {
                    self.cannot_name("macro-steps", &one.name, one.name.span);
                }
                Item::Enclosing(one) => {
                    self.cannot_name("enclosing steps", &one.step.name, one.step.name.span);
                }
                Item::State(one) => {
                    self.cannot_name("states", &one.step.name, one.step.name.span);
                }
                Item::Use(one) => {
                    self.cannot_name("library charts", &one.name, one.name.span);
                }
                Item::Emergency(one) => self.cannot("emergencies", one.meta.span),
                Item::Property(one) => self.lose("a property is omitted", one.meta.span),
                Item::Place(one) => self.lose("a partition request is omitted", one.span),
                Item::Board(one) => self.lose("the device and its pins are omitted", one.span),
            }
        }
        if !priority && !program.pragmas.iter().any(|one| one.starts_with("conflict")) {
            program.pragmas.push("conflict all".to_owned());
        }
        self.renewed = super::lists::renewed(chart);
        self.controlled = super::lists::controlled(chart);
        self.bodies(chart, iec, &mut program);
        self.lists_and_timers(chart, *tick, &mut program, &mut vars);
        program.sections = vec![("VAR_INPUT", inputs), ("VAR_OUTPUT", outputs), ("VAR", vars)];
        program
    }

    /// Writes as a pragma each setting that the standard does not imply, except the tick.
    fn setting(&mut self, setting: &Setting, tick: &mut Option<u64>, program: &mut Program) {
        match &setting.kind {
            SettingKind::Tick(ns) => *tick = Some(*ns),
            SettingKind::Conflict(Policy::Priority)
            | SettingKind::ActionsIec
            | SettingKind::EvolutionSingle => {}
            SettingKind::FinalScan => {
                self.unordered = Some("together with a final scan");
                program.pragmas.push("final scan".to_owned());
            }
            _ => {
                if let SettingKind::EvolutionStable(_) = setting.kind {
                    self.unordered = Some("in a chart that evolves until it is stable");
                } else if let SettingKind::AssignSimultaneous(_) = setting.kind {
                    self.unordered = Some("with simultaneous assignments");
                }
                let text = setting_text(setting);
                self.lost.push(
                    Diagnostic::warning(codes::ST_LOST, format!("`{text}` is written as a pragma"))
                        .at(setting.span, "this")
                        .help("grafsynth reads it back; other tools ignore it and follow the standard"),
                );
                program.pragmas.push(text);
            }
        }
    }

    /// Puts the lists of steps before all other actions, and the calls of timers after them.
    fn lists_and_timers(
        &mut self,
        chart: &'a Chart,
        tick: Option<u64>,
        program: &mut Program,
        vars: &mut Vec<Var>,
    ) {
        let first = self.exits.drain(..).chain(self.entries.drain(..)).collect::<Vec<_>>();
        program.actions.splice(0..0, first);
        // The clock of a TON stops at PT, so PT must exceed every value that it is compared with.
        let preset = super::lists::longest(chart).saturating_add(tick.unwrap_or(10_000_000));
        for item in &chart.items {
            let Item::Declaration(declaration) = item else { continue };
            let DeclarationKind::Timer { condition } = &declaration.kind else { continue };
            let span = declaration.name.span;
            self.ordered("free timers", span);
            let Some(clock) = self.names.get(declaration.name.text.as_str()).cloned() else {
                continue;
            };
            let name = clock.trim_end_matches(".ET").to_owned();
            let written = text::expr(self, condition);
            let input = self.said(written);
            self.timers.push(format!("{name}(IN := {input});"));
            let label = self.label(&declaration.meta);
            vars.push(Var {
                name,
                ty: Type::Bool,
                len: None,
                block: Some("TON".to_owned()),
                init: vec![duration(preset)],
                address: None,
                label,
            });
        }
        if self.timers.is_empty() {
            return;
        }
        let name = self.free("timers");
        let body = std::mem::take(&mut self.timers);
        program.actions.push(Action { name: name.clone(), body, label: String::new() });
        let qualifier = "S".to_owned();
        match program.steps.iter_mut().find(|step| step.is_initial) {
            Some(step) => step.uses.push(Use { action: name, qualifier, duration: None }),
            None => self.cannot("free timers in a chart without an initial step", chart.span),
        }
    }

    /// Reports a list or timer that would run in a different order.
    fn ordered(&mut self, what: &str, span: Span) {
        if let Some(why) = self.unordered {
            self.cannot(format!("{what} {why}"), span);
        }
    }

    /// Makes a list of a step into a separate action.
    fn list_of(
        &mut self,
        step: &Name,
        which: &str,
        list: &grafsynth_ir::chart::Block,
        span: Span,
    ) -> Action {
        self.ordered("`entry` and `exit` lists", span);
        if super::lists::asks_for_steps(list) {
            self.cannot("`entry` and `exit` lists that read steps", span);
        }
        if let Some(name) = super::lists::asks_for(list, &self.controlled) {
            self.cannot(
                format!("an `entry` or `exit` list that reads the previous value of `{name}`"),
                span,
            );
        }
        if self.renewed.contains(step.text.as_str()) {
            let name = step.clone();
            self.cannot_name("`entry` and `exit` lists of a step that a transition with `restart` leaves and enters at once", &name, span);
        }
        let mut body = Vec::new();
        if let Err((what, span)) = text::block(self, list, 0, &mut body) {
            self.cannot(what, span);
        }
        let step = self.names.get(step.text.as_str()).cloned().unwrap_or_default();
        let name = self.free(&format!("{step}_{which}"));
        Action { name, body, label: String::new() }
    }

    /// An unused name.
    fn free(&mut self, base: &str) -> String {
        let mut name = base.to_owned();
        let mut n = 2;
        while !self.taken.insert(Symbol::of(&name)) {
            name = format!("{base}_{n}");
            n += 1;
        }
        name
    }

    fn bodies(&mut self, chart: &'a Chart, iec: bool, program: &mut Program) {
        // If two steps use one output with a delay or time limit, each use has its own time; in the standard they share one.
        let mut timed: BTreeMap<&str, usize> = BTreeMap::new();
        for item in &chart.items {
            let Item::Step(step) = item else { continue };
            for one in &step.body {
                if let StepItemKind::Action {
                    target,
                    how: ActionHow::After(_) | ActionHow::For(_),
                    ..
                } = &one.kind
                {
                    *timed.entry(&target.text).or_default() += 1;
                }
            }
        }
        for item in &chart.items {
            match item {
                Item::Step(step) => {
                    let made = self.step(step, iec, &timed);
                    program.steps.push(made);
                }
                Item::Transition(transition) => {
                    if let Some(made) = self.transition(transition) {
                        program.transitions.push(made);
                    }
                }
                Item::Action(action) if !action.body.is_empty() => {
                    let mut body = Vec::new();
                    if let Err((what, span)) = text::block(self, &action.body, 0, &mut body) {
                        self.cannot(what, span);
                    }
                    let name =
                        self.names.get(action.name.text.as_str()).cloned().unwrap_or_default();
                    let label = self.label(&action.meta);
                    program.actions.push(Action { name, body, label });
                }
                _ => {}
            }
        }
    }

    fn variable(&mut self, declaration: &'a Declaration) -> Option<(u8, Var)> {
        let span = declaration.name.span;
        let constant = |expr: &grafsynth_ir::chart::Expr| match expr.kind {
            ExprKind::Bool(value) => (if value { "TRUE" } else { "FALSE" }).to_owned(),
            ExprKind::Int(value) => value.to_string(),
            _ => String::new(),
        };
        let (section, ty, len, init) = match &declaration.kind {
            DeclarationKind::Input { ty, .. } => (0, *ty, None, Vec::new()),
            DeclarationKind::Output { mealy: true, .. } => {
                self.cannot_name("mealy outputs", &declaration.name, span);
                return None;
            }
            DeclarationKind::Output { ty, init, registered, safe, .. } => {
                if safe.is_some() {
                    self.lose(format!("the safe value of `{}` is omitted", declaration.name), span);
                }
                if *registered {
                    self.lose(
                        format!("the property `registered` of `{}` is omitted", declaration.name),
                        span,
                    );
                }
                (1, *ty, None, init.iter().map(constant).collect())
            }
            DeclarationKind::Var { ty, len, init } => {
                (2, *ty, *len, init.iter().map(constant).collect())
            }
            DeclarationKind::Event { .. } => {
                self.cannot_name("events", &declaration.name, span);
                return None;
            }
            DeclarationKind::Timer { .. } => {
                // Its clock is that of an on-delay timer.
                let name = self.declare(&declaration.name);
                self.names.insert(&declaration.name.text, format!("{name}.ET"));
                self.lose(format!("the timer `{name}` is written as an instance of TON"), span);
                return None;
            }
            DeclarationKind::ExternCondition { .. } | DeclarationKind::ExternAction { .. } => {
                self.cannot_name("extern functions", &declaration.name, span);
                return None;
            }
            DeclarationKind::Const { .. } => {
                self.cannot_name("constants of this kind", &declaration.name, span);
                return None;
            }
        };
        let name = self.declare(&declaration.name);
        let label = self.label(&declaration.meta);
        let (address, label) = address(&label, section == 2);
        Some((section, Var { name, ty, len, block: None, init, address, label }))
    }

    fn step(
        &mut self,
        step: &'a grafsynth_ir::chart::Step,
        iec: bool,
        timed: &BTreeMap<&str, usize>,
    ) -> Step {
        if !matches!(step.role, StepRole::Plain | StepRole::Initial) {
            self.cannot_name("entry, exit and final steps", &step.name, step.name.span);
        }
        if step.count.is_some() {
            self.cannot_name("counted steps", &step.name, step.name.span);
        }
        let mut uses = Vec::new();
        for item in &step.body {
            let span = item.span;
            match &item.kind {
                StepItemKind::Action { target, arguments: None, how, condition: None } => {
                    let (qualifier, ns) = match how {
                        ActionHow::Bare => (Qualifier::N, None),
                        ActionHow::After(ns) => (Qualifier::D, Some(*ns)),
                        ActionHow::For(ns) => (Qualifier::L, Some(*ns)),
                        ActionHow::Qualified(qualifier, ns) => (*qualifier, *ns),
                    };
                    let common = timed.get(target.text.as_str()).is_some_and(|n| *n > 1);
                    if !iec && common && matches!(how, ActionHow::After(_) | ActionHow::For(_)) {
                        self.cannot(
                            "outputs with a different time limit or delay in each step",
                            span,
                        );
                    }
                    match self.names.get(target.text.as_str()).cloned() {
                        Some(action) => uses.push(Use {
                            action,
                            qualifier: format!("{qualifier:?}"),
                            duration: ns.filter(|_| qualifier.is_timed()).map(duration),
                        }),
                        None => self.cannot("extern actions", span),
                    }
                }
                StepItemKind::Action { arguments: Some(_), .. } => {
                    self.cannot("calls of extern actions", span);
                }
                StepItemKind::Action { .. } => {
                    self.cannot("actions under a condition", span);
                }
                StepItemKind::Entry(list) => {
                    let action = self.list_of(&step.name, "entry", list, span);
                    uses.push(pulse(&action, "P1"));
                    self.entries.push(action);
                }
                StepItemKind::Exit(list) => {
                    let action = self.list_of(&step.name, "exit", list, span);
                    uses.push(pulse(&action, "P0"));
                    self.exits.push(action);
                }
                StepItemKind::On { .. } => self.cannot("reactions of steps", span),
                StepItemKind::Priority(_) => self.cannot("priorities of steps", span),
                StepItemKind::Budget(_) | StepItemKind::Task { .. } => self.cannot("tasks", span),
                StepItemKind::Code(_) => self.cannot("code in other languages", span),
                StepItemKind::Force { .. } => self.cannot("forcing orders", span),
            }
        }
        let name = self.names.get(step.name.text.as_str()).cloned().unwrap_or_default();
        let label = self.label(&step.meta);
        Step { name, is_initial: step.role == StepRole::Initial, uses, label }
    }

    fn transition(
        &mut self,
        transition: &'a grafsynth_ir::chart::Transition,
    ) -> Option<Transition> {
        let span = transition.meta.span;
        if transition.is_internal && transition.targets.is_empty() {
            self.cannot("reactions of steps", span);
            return None;
        }
        if transition.sources.is_empty() || transition.targets.is_empty() {
            self.cannot("source and sink transitions", span);
            return None;
        }
        if !transition.events.is_empty() {
            self.cannot("events", span);
        }
        if !transition.actions.is_empty() {
            self.cannot("actions of transitions", span);
        }
        if transition.is_internal {
            self.cannot("internal transitions", span);
        }
        if transition.deadline_ns.is_some() {
            self.lose("a deadline is omitted", span);
        }
        let side = |this: &mut Self, paths: &[Path]| -> Vec<String> {
            let mut names = Vec::new();
            for path in paths {
                let found = match path.names.as_slice() {
                    [name] => Names::step(this, &name.text),
                    _ => None,
                };
                match found {
                    Some(name) => names.push(name),
                    None => this.cannot("steps of other charts", path.span()),
                }
            }
            names
        };
        let (from, to) = (side(self, &transition.sources), side(self, &transition.targets));
        self.leaving = transition
            .sources
            .iter()
            .filter_map(|path| path.names.first().map(|name| name.text.clone()))
            .gather();
        let mut conditions = Vec::new();
        if let Some(guard) = &transition.guard {
            let written = text::expr(self, guard);
            conditions.push(self.said(written));
        }
        if let Some((length, span)) = &transition.after {
            let length = match length {
                Length::Ns(ns) => duration(*ns),
                Length::Named(path) => {
                    let name = Expr::leaf(Leaf::Name(path.clone()), *span);
                    let written = text::expr(self, &name);
                    self.said(written)
                }
            };
            conditions.extend(from.iter().map(|step| format!("{step}.T >= {length}")));
        }
        self.leaving.clear();
        let condition = match conditions.len() {
            0 => "TRUE".to_owned(),
            1 => conditions.remove(0),
            _ => conditions.iter().map(|one| format!("({one})")).collect::<Vec<_>>().join(" AND "),
        };
        // Omits a name that is already used in another letter case or was given to a list or the timers.
        let name = transition.name.as_ref().and_then(|name| {
            let made = format!("{}_{}", from.join("_"), to.join("_"));
            let written = identifier(&name.text);
            (name.text != made && written == name.text && self.taken.insert(Symbol::of(&written)))
                .then_some(written)
        });
        let label = self.label(&transition.meta);
        let (priority, restart) = (transition.priority, transition.restart);
        Some(Transition { name, from, to, priority, restart, condition, label })
    }
}

fn pulse(action: &Action, qualifier: &str) -> Use {
    Use { action: action.name.clone(), qualifier: qualifier.to_owned(), duration: None }
}

/// An address at the beginning of a label, and the rest of the label. If `is_inner`, there is no address: a variable with a pin would
/// become an input or output.
fn address(label: &str, is_inner: bool) -> (Option<String>, String) {
    let (first, rest) = label.split_once(' ').unwrap_or((label, ""));
    let is_address = first.starts_with('%')
        && first.len() > 2
        && (!is_inner || first[1..].starts_with(['M', 'm']))
        && first[1..].chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '*'));
    if is_address { (Some(first.to_owned()), rest.to_owned()) } else { (None, label.to_owned()) }
}
