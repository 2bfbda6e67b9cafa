//! Writes a statechart as an SCXML document.
//!
//! The document contains the states, regions, histories, transitions in their order, executable content, and data with their ranges.
//! Inputs, outputs and ranges are attributes of the grafsynth namespace, which other tools ignore. Something that SCXML cannot express is
//! an error if the behaviour depends on it; otherwise it is reported as lost. Reading the document gives the same chart, except for spans,
//! comments, the order of declarations, and what is reported.

use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use grafsynth_ir::chart::{
    ActionHow, Chart, DeclarationKind, Design, Expr, Item, Path, SettingKind, State, Step,
    StepItem, StepItemKind, StepRole,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, Net, Policy};
use grafsynth_ir::{Name, Span, lower};

use super::legalize::legalize;
use super::mentions::{Leaving, Mentions, marked};
use super::time;
use super::{GRAFSYNTH, SCXML};
use crate::codes;
use crate::xml;

/// Writes the document of a statechart, and reports what it cannot contain. `net` is the lowered chart, which supplies the initial values.
///
/// # Errors
/// Returns a finding, with its location, for everything that SCXML cannot express and that affects the behaviour.
pub fn write_design(
    design: &Design,
    net: &Net,
) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    let [chart] = design.charts.as_slice() else {
        return Err(vec![cannot("a file with several charts", Span::default())]);
    };
    if !net.settings.policy.is_statechart() {
        return Err(vec![cannot("a chart that is not a statechart", chart.name.span)]);
    }
    let Some((chart, notes)) = legalize(chart).map_err(|finding| vec![*finding])? else {
        return write_chart(chart, net);
    };
    let design = Design { charts: vec![chart], ..design.clone() };
    let (Some(net), chart) = (lower::lower(&design).0, &design.charts[0]) else {
        return Err(vec![cannot("this chart", design.charts[0].name.span)]);
    };
    let (text, mut lost) = write_chart(chart, &net)?;
    lost.extend(notes);
    Ok((text, lost))
}

fn write_chart(chart: &Chart, net: &Net) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    let mut writer = Writer::new(net);
    writer.chart(chart);
    if writer.errors.is_empty() { Ok((writer.out, writer.lost)) } else { Err(writer.errors) }
}

/// Like [`write_design`], for a net without its chart.
///
/// # Errors
/// The errors of [`write_design`], and a finding for everything that no chart can express.
pub fn write_net(net: &Net) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    write_design(&crate::from_net::design(net)?, net)
}

fn cannot(what: impl std::fmt::Display, span: Span) -> Diagnostic {
    let finding =
        Diagnostic::error(codes::SCXML_CANNOT_WRITE, format!("SCXML cannot express {what}"));
    let finding = if span == Span::default() { finding } else { finding.at(span, "") };
    finding.help("use `.graf`, which can express every chart")
}

mod content;

struct Writer<'c> {
    net: &'c Net,
    out: String,
    depth: usize,
    errors: Vec<Diagnostic>,
    lost: Vec<Diagnostic>,
    /// Identifiers in the document by chart names.
    ids: BTreeMap<&'c str, String>,
    taken: BTreeSet<String>,
    /// Named constants, which SCXML does not have.
    constants: BTreeMap<&'c str, &'c Expr>,
    data: BTreeSet<&'c str>,
    /// The transitions and reactions of each state, in the order of the chart.
    leaving: BTreeMap<&'c str, Vec<Leaving<'c>>>,
    /// Continuous outputs and the states that drive them, in document order.
    drivers: BTreeMap<&'c str, Vec<&'c str>>,
    /// Final states at the top level.
    endings: BTreeSet<&'c str>,
}

/// Words that cannot be names of data: reserved words of ECMAScript, and names that have a meaning in SCXML expressions.
const RESERVED: &[&str] = &[
    "In",
    "Math",
    "true",
    "false",
    "null",
    "undefined",
    "NaN",
    "Infinity",
    "new",
    "function",
    "typeof",
    "void",
    "delete",
    "instanceof",
    "this",
    "return",
    "var",
    "let",
    "const",
    "if",
    "else",
    "for",
    "while",
    "do",
    "break",
    "continue",
    "switch",
    "case",
    "throw",
    "try",
    "catch",
    "finally",
    "default",
    "class",
    "enum",
    "export",
    "extends",
    "import",
    "super",
    "in",
    "with",
    "yield",
    "debugger",
    "sizeof",
    "NULL",
];

impl<'c> Writer<'c> {
    fn new(net: &'c Net) -> Self {
        Writer {
            net,
            out: String::new(),
            depth: 0,
            errors: Vec::new(),
            lost: Vec::new(),
            ids: BTreeMap::new(),
            taken: BTreeSet::new(),
            constants: BTreeMap::new(),
            data: BTreeSet::new(),
            leaving: BTreeMap::new(),
            drivers: BTreeMap::new(),
            endings: BTreeSet::new(),
        }
    }

    fn line(&mut self, text: &str) {
        for _ in 0..self.depth {
            self.out.push_str("  ");
        }
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn open(&mut self, text: &str) {
        self.line(&format!("<{text}>"));
        self.depth += 1;
    }

    fn close(&mut self, name: &str) {
        self.depth -= 1;
        self.line(&format!("</{name}>"));
    }

    fn refuse(&mut self, what: impl std::fmt::Display, span: Span) {
        self.errors.push(cannot(what, span));
    }

    fn lose(&mut self, message: impl Into<String>, span: Span) {
        let finding = Diagnostic::note(codes::SCXML_CANNOT_WRITE, message.into());
        let finding = if span == Span::default() { finding } else { finding.at(span, "") };
        self.lost.push(finding);
    }

    /// Gives an object of the chart an identifier. The identifier of a data element is also a valid ECMAScript name.
    fn give(&mut self, name: &'c Name, is_datum: bool) {
        let first = |c: char| c == '_' || c.is_alphabetic();
        let later = |c: char| first(c) || c.is_numeric() || !is_datum && matches!(c, '-' | '.');
        let mut id = String::new();
        for c in name.text.chars() {
            if id.is_empty() && !first(c) || is_datum && id.is_empty() && c == '_' {
                id.push_str("n_");
            }
            id.push(if later(c) { c } else { '_' });
        }
        if id.is_empty() || RESERVED.contains(&id.as_str()) {
            id.push('_');
        }
        let stem = id.clone();
        let mut number = 2_u32;
        while !self.taken.insert(id.clone()) {
            id = format!("{stem}_{number}");
            number += 1;
        }
        if id != name.text {
            self.lose(format!("`{name}` is renamed to `{id}` in the document"), name.span);
        }
        self.ids.insert(&name.text, id);
    }

    /// Names an event with a single token, so that its descriptor matches no other event.
    fn give_event(&mut self, name: &'c Name) {
        let bad = |c: char| c.is_whitespace() || matches!(c, '*' | '.');
        let mut id: String = name.text.chars().map(|c| if bad(c) { '_' } else { c }).collect();
        if matches!(id.as_str(), "done" | "error" | "") {
            id.push('_');
        }
        let stem = id.clone();
        let mut number = 2_u32;
        while !self.taken.insert(id.clone()) {
            id = format!("{stem}_{number}");
            number += 1;
        }
        if id != name.text {
            self.lose(
                format!("the event `{name}` is renamed to `{id}` in the document"),
                name.span,
            );
        }
        self.ids.insert(&name.text, id);
    }

    fn id(&self, name: &str) -> String {
        self.ids.get(name).cloned().unwrap_or_else(|| name.to_owned())
    }

    /// The identifier of the state or history at the end of a path. State names are unique in the chart (semantics C25).
    fn target(&self, path: &Path) -> String {
        path.names.last().map_or_else(String::new, |name| self.id(&name.text))
    }

    fn event(&self, name: &Name) -> String {
        match name.text.strip_prefix("done.state.") {
            Some(path) => {
                format!("done.state.{}", self.id(path.rsplit('.').next().unwrap_or(path)))
            }
            None => self.id(&name.text),
        }
    }

    fn chart(&mut self, chart: &'c Chart) {
        self.names(&chart.items, true);
        let settings = self.settings(chart);
        let body_at = self.out.len();
        self.depth = 1;
        self.data(&chart.items);
        for item in &chart.items {
            self.item(item);
        }
        self.depth = 0;
        self.line("</scxml>");
        let mut head = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let _ = write!(head, "<scxml xmlns=\"{SCXML}\"");
        // The namespace is only declared if it is used.
        if settings.contains(" g:") || self.out[body_at..].contains(" g:") {
            let _ = write!(head, " xmlns:g=\"{GRAFSYNTH}\"");
        }
        let _ = write!(head, " version=\"1.0\" datamodel=\"ecmascript\"{settings}");
        let name = xml::attribute(&chart.name.text);
        let _ = write!(head, " name=\"{name}\"");
        let marked = marked(&chart.items).map(|name| self.id(name));
        let initial: Vec<String> = chart.initial.iter().map(|path| self.target(path)).collect();
        let initial = if initial.is_empty() { marked } else { Some(initial.join(" ")) };
        if let Some(initial) = initial {
            let _ = write!(head, " initial=\"{}\"", xml::attribute(&initial));
        }
        head.push_str(">\n");
        self.out.insert_str(body_at, &head);
    }

    /// Gives every object its identifier, and assigns transitions to the states that they leave.
    fn names(&mut self, items: &'c [Item], is_outermost: bool) {
        for item in items {
            match item {
                Item::State(state) => {
                    self.give(&state.step.name, false);
                    self.reactions(&state.step);
                    for history in &state.histories {
                        self.give(&history.name, false);
                    }
                    self.names(&state.items, false);
                }
                Item::Step(step) => {
                    self.give(&step.name, false);
                    self.reactions(step);
                    if is_outermost && step.role == StepRole::Final {
                        self.endings.insert(&step.name.text);
                    }
                }
                Item::Transition(transition) => {
                    if let [source] = transition.sources.as_slice()
                        && let Some(name) = source.names.last()
                    {
                        let list = self.leaving.entry(&name.text).or_default();
                        list.push(Leaving::Transition(transition));
                    } else {
                        self.refuse(
                            "a transition that does not leave one state",
                            transition.meta.span,
                        );
                    }
                }
                Item::Declaration(declaration) => match &declaration.kind {
                    DeclarationKind::Const { value } => {
                        self.constants.insert(&declaration.name.text, value);
                    }
                    DeclarationKind::Event { .. } => self.give_event(&declaration.name),
                    DeclarationKind::Input { .. }
                    | DeclarationKind::Output { .. }
                    | DeclarationKind::Var { .. } => {
                        self.give(&declaration.name, true);
                        self.data.insert(&declaration.name.text);
                    }
                    DeclarationKind::Timer { .. } => {
                        self.refuse("a timer", declaration.name.span);
                    }
                    _ => {
                        self.refuse(
                            "a function of the program around the chart",
                            declaration.name.span,
                        );
                    }
                },
                Item::Setting(_) => {}
                Item::Macro(one) => self.refuse("a macro-step", one.name.span),
                Item::MacroStep(one) => self.refuse("a macro-step", one.name.span),
                Item::Enclosing(one) => self.refuse("an enclosing step", one.step.name.span),
                Item::Use(one) => self.refuse("an instance of a library chart", one.name.span),
                Item::Action(one) => self.refuse("a controlled action", one.name.span),
                Item::Emergency(one) => self.refuse("an emergency", one.meta.span),
                Item::Property(one) => self.omit("a property", one.meta.span),
                Item::Place(one) => self.omit("a partition request", one.span),
                Item::Board(one) => self.omit("the board", one.span),
            }
        }
    }

    /// Collects the reactions in the body of a state, which are written as transitions without target, and the outputs that the state
    /// drives.
    fn reactions(&mut self, step: &'c Step) {
        for StepItem { kind, span } in &step.body {
            let span = *span;
            match kind {
                StepItemKind::On { events, guard, actions } => {
                    let guard = guard.as_ref();
                    let list = self.leaving.entry(&step.name.text).or_default();
                    list.push(Leaving::Reaction { events, guard, actions, span });
                }
                StepItemKind::Action { target, arguments, how, condition } => {
                    if arguments.is_some() || *how != ActionHow::Bare || condition.is_some() {
                        self.refuse("an output with a condition, a time or a qualifier", span);
                        continue;
                    }
                    let users = self.drivers.entry(&target.text).or_default();
                    if users.is_empty() {
                        self.lost.push(
                            Diagnostic::note(
                                codes::SCXML_CANNOT_WRITE,
                                format!("the output {target} is written as assignments when its states are entered and left"),
                            )
                            .at(span, "driven here"),
                        );
                    }
                    users.push(&step.name.text);
                }
                StepItemKind::Entry(_) | StepItemKind::Exit(_) => {}
                StepItemKind::Priority(_) => self.refuse("the priority of a step", span),
                StepItemKind::Budget(_) | StepItemKind::Task { .. } => self.refuse("a task", span),
                StepItemKind::Code(_) => self.refuse("code in another language", span),
                StepItemKind::Force { .. } => self.refuse("a forcing order", span),
            }
        }
    }

    /// The settings of the chart as attributes of the document.
    fn settings(&mut self, chart: &'c Chart) -> String {
        let mut out = String::new();
        for item in &chart.items {
            let Item::Setting(setting) = item else { continue };
            let span = setting.span;
            match &setting.kind {
                SettingKind::Tick(ns) => {
                    let _ = write!(out, " g:tick=\"{}\"", time::text(*ns));
                }
                SettingKind::Conflict(Policy::OuterFirst) => {
                    self.refuse("`conflict outer-first`: the inner state has priority", span);
                }
                SettingKind::Conflict(_) => {}
                SettingKind::EvolutionStable(Some(limit)) => {
                    let _ = write!(out, " g:limit=\"{limit}\"");
                }
                SettingKind::EvolutionStable(None) => {}
                SettingKind::Queue(bound) => {
                    let _ = write!(out, " g:queue=\"{bound}\"");
                }
                SettingKind::EventsExclusive => out.push_str(" g:events=\"exclusive\""),
                SettingKind::AssignSimultaneous(false) | SettingKind::FireOne(false) => {}
                SettingKind::AssignSimultaneous(true) => self.refuse("`assign simultaneous`", span),
                SettingKind::Shared(..) => self.refuse("`shared`", span),
                _ => self.refuse("a setting of Grafcet charts", span),
            }
        }
        out.push_str(&self.event_lists(chart));
        out
    }

    /// The attributes that list the events whose origin cannot be inferred from the document.
    fn event_lists(&mut self, chart: &'c Chart) -> String {
        let mut mentioned: BTreeMap<&str, u32> = BTreeMap::new();
        let mut raised: BTreeSet<&str> = BTreeSet::new();
        let mut mention = Mentions { place: 0, mentioned: &mut mentioned, raised: &mut raised };
        for item in &chart.items {
            mention.item(item, &self.leaving);
        }
        let (mut outside, mut inside) = (Vec::new(), Vec::new());
        for item in &chart.items {
            let Item::Declaration(declaration) = item else { continue };
            let DeclarationKind::Event { internal } = declaration.kind else { continue };
            let name = declaration.name.text.as_str();
            if !internal {
                outside.push((name, mentioned.get(name).copied(), raised.contains(name)));
            } else if mentioned.contains_key(name) && !raised.contains(name) {
                inside.push(self.id(name));
            }
        }
        let in_order = outside.is_sorted_by_key(|(_, place, _)| place.unwrap_or(u32::MAX));
        let is_plain = outside.iter().all(|(_, place, is_raised)| place.is_some() && !is_raised);
        let mut out = String::new();
        if !(in_order && is_plain) {
            let names = outside.iter().map(|(name, ..)| self.id(name)).join(" ");
            let _ = write!(out, " g:input=\"{}\"", xml::attribute(&names));
        }
        if !inside.is_empty() {
            let _ = write!(out, " g:internal=\"{}\"", xml::attribute(&inside.join(" ")));
        }
        out
    }

    fn data(&mut self, items: &'c [Item]) {
        let mut lines: Vec<String> = Vec::new();
        for item in items {
            let Item::Declaration(declaration) = item else { continue };
            let name = declaration.name.text.as_str();
            let span = declaration.name.span;
            let (ty, values, len, role) = match &declaration.kind {
                DeclarationKind::Input { ty, synchronous } => {
                    if *synchronous {
                        self.omit(&format!("the property `synchronous` of input {name}"), span);
                    }
                    (*ty, vec![0], None, " g:role=\"input\"")
                }
                DeclarationKind::Output { ty, registered, mealy, safe, .. } => {
                    if safe.is_some() {
                        self.omit(&format!("the safe value of {name}"), span);
                    }
                    if *mealy {
                        self.refuse("a mealy output", span);
                    }
                    if *registered {
                        self.omit(&format!("the property `registered` of output {name}"), span);
                    }
                    let output = self.net.outputs.values().find(|output| output.name.text == name);
                    let init = output.and_then(|output| match output.driver {
                        Driver::Stored(var) => self.net.vars[var].init.first().copied(),
                        _ => None,
                    });
                    (*ty, vec![init.unwrap_or(0)], None, " g:role=\"output\"")
                }
                DeclarationKind::Var { ty, len, .. } => {
                    let var = self.net.vars.values().find(|var| var.name.text == name);
                    let Some(var) = var else {
                        self.refuse("a variable that is not in the net", span);
                        continue;
                    };
                    (*ty, var.init.clone(), *len, "")
                }
                _ => continue,
            };
            let value = |value: &i64| match ty {
                Type::Bool => if *value == 0 { "false" } else { "true" }.to_owned(),
                Type::Int { .. } => ty.saturate(*value).to_string(),
            };
            let text = match len {
                None => values.first().map_or_else(|| value(&0), value),
                Some(_) => {
                    format!("[{}]", values.iter().map(value).join(", "))
                }
            };
            let mut line = format!("<data id=\"{}\" expr=\"{text}\"", self.id(name));
            if let Type::Int { lo, hi } = ty {
                let _ = write!(line, " g:range=\"{lo}..{hi}\"");
            }
            line.push_str(role);
            if !declaration.meta.label.is_empty() {
                let _ = write!(line, " g:label=\"{}\"", xml::attribute(&declaration.meta.label));
            }
            line.push_str("/>");
            lines.push(line);
            self.tags(&declaration.meta.req, span);
        }
        if lines.is_empty() {
            return;
        }
        self.open("datamodel");
        for line in &lines {
            self.line(line);
        }
        self.close("datamodel");
    }

    /// Notes that the document does not contain something.
    fn omit(&mut self, what: &str, span: Span) {
        self.lose(format!("{what} is omitted from the document"), span);
    }

    fn tags(&mut self, tags: &[String], span: Span) {
        if !tags.is_empty() {
            self.omit("a requirement tag", span);
        }
    }

    /// Writes a state with its contents; skips any other item. The recursion is as deep as the states are nested.
    fn item(&mut self, item: &'c Item) {
        match item {
            Item::State(state) => self.state(state),
            Item::Step(step) => {
                let tag = if step.role == StepRole::Final { "final" } else { "state" };
                self.element(tag, step, None);
            }
            _ => {}
        }
    }

    fn state(&mut self, state: &'c State) {
        let tag = if state.step.role == StepRole::Final {
            "final"
        } else if state.is_parallel {
            "parallel"
        } else {
            "state"
        };
        for item in &state.items {
            if let Item::Declaration(declaration) = item {
                self.refuse("a declaration inside a state", declaration.name.span);
            }
        }
        self.element(tag, &state.step, Some(state));
    }

    /// Writes a `state`, `parallel` or `final` element with its contents.
    fn element(&mut self, tag: &str, step: &'c Step, state: Option<&'c State>) {
        if let Some(count) = step.count {
            self.refuse("a step that counts its activations", count.span);
        }
        self.tags(&step.meta.req, step.name.span);
        let mut head = format!("{tag} id=\"{}\"", self.id(&step.name.text));
        let initial = state.and_then(|state| state.initial.as_ref());
        match initial {
            Some((targets, content)) if content.is_empty() => {
                let names = targets.iter().map(|path| self.target(path)).join(" ");
                let _ = write!(head, " initial=\"{names}\"");
            }
            Some(_) => {}
            None => {
                let marked = state.and_then(|state| marked(&state.items));
                if let Some(marked) = marked {
                    let _ = write!(head, " initial=\"{}\"", self.id(marked));
                }
            }
        }
        if !step.meta.label.is_empty() {
            let _ = write!(head, " g:label=\"{}\"", xml::attribute(&step.meta.label));
        }
        let before = self.out.len();
        self.open(&head);
        let inside = self.out.len();
        if let Some((targets, content)) = initial
            && !content.is_empty()
        {
            let names = targets.iter().map(|path| self.target(path)).join(" ");
            self.open("initial");
            self.with_content(&format!("transition target=\"{names}\""), content);
            self.close("initial");
        }
        self.handlers(step);
        let leaving = self.leaving.remove(step.name.text.as_str()).unwrap_or_default();
        for one in leaving {
            self.leaving(&one, tag);
        }
        if let Some(state) = state {
            for history in &state.histories {
                let kind = if history.is_deep { "deep" } else { "shallow" };
                self.open(&format!(
                    "history id=\"{}\" type=\"{kind}\"",
                    self.id(&history.name.text)
                ));
                if history.default.is_empty() {
                    self.refuse("a history without a default", history.name.span);
                }
                let names = history.default.iter().map(|path| self.target(path)).join(" ");
                let head = format!("transition target=\"{names}\"");
                self.with_content(&head, &history.content);
                self.close("history");
            }
            for item in &state.items {
                self.item(item);
            }
        }
        if self.out.len() == inside {
            self.depth -= 1;
            self.out.truncate(before);
            self.line(&format!("<{head}/>"));
        } else {
            self.close(tag);
        }
    }

    fn handlers(&mut self, step: &'c Step) {
        let driven: Vec<(String, Vec<String>)> = self
            .drivers
            .iter()
            .filter(|(_, users)| users.contains(&step.name.text.as_str()))
            .map(|(output, users)| {
                let others = users.iter().filter(|user| **user != step.name.text);
                (self.id(output), others.map(|user| format!("In('{}')", self.id(user))).collect())
            })
            .collect();
        for item in &step.body {
            if let StepItemKind::Entry(block) = &item.kind {
                self.open("onentry");
                self.block(block);
                self.close("onentry");
            }
        }
        if !driven.is_empty() {
            self.open("onentry");
            for (output, _) in &driven {
                self.line(&format!("<assign location=\"{output}\" expr=\"true\"/>"));
            }
            self.close("onentry");
        }
        for item in &step.body {
            if let StepItemKind::Exit(block) = &item.kind {
                self.open("onexit");
                self.block(block);
                self.close("onexit");
            }
        }
        // A state that ends the chart keeps its outputs (semantics C20).
        if !driven.is_empty() && !self.endings.contains(step.name.text.as_str()) {
            self.open("onexit");
            for (output, others) in &driven {
                let value =
                    if others.is_empty() { "false".to_owned() } else { others.join(" || ") };
                self.line(&format!("<assign location=\"{output}\" expr=\"{value}\"/>"));
            }
            self.close("onexit");
        }
    }

    fn leaving(&mut self, one: &Leaving<'c>, tag: &str) {
        let (events, guard, actions, targets, span, is_internal) = match one {
            Leaving::Reaction { events, guard, actions, span } => {
                (*events, *guard, *actions, &[][..], *span, false)
            }
            Leaving::Transition(transition) => {
                if transition.after.is_some() {
                    self.refuse("`after`: send an event with a delay when the state is entered, and cancel it when it is left", transition.meta.span);
                }
                if transition.deadline_ns.is_some() {
                    self.omit("a deadline", transition.meta.span);
                }
                if transition.priority.is_some() || transition.restart {
                    self.refuse("the priority or restart of a transition", transition.meta.span);
                }
                self.tags(&transition.meta.req, transition.meta.span);
                (
                    transition.events.as_slice(),
                    transition.guard.as_ref(),
                    transition.actions.as_slice(),
                    transition.targets.as_slice(),
                    transition.meta.span,
                    transition.is_internal && !transition.targets.is_empty(),
                )
            }
        };
        if tag == "final" {
            self.refuse("a transition that leaves a final state", span);
        }
        let mut head = String::from("transition");
        if !events.is_empty() {
            let names = events.iter().map(|name| self.event(name)).join(" ");
            let _ = write!(head, " event=\"{}\"", xml::attribute(&names));
        }
        if let Some(guard) = guard {
            let guard = self.expr(guard, 0);
            let _ = write!(head, " cond=\"{}\"", xml::attribute(&guard));
        }
        if !targets.is_empty() {
            let names = targets.iter().map(|path| self.target(path)).join(" ");
            let _ = write!(head, " target=\"{names}\"");
        } else if events.is_empty() && guard.is_none() {
            head.push_str(" cond=\"true\"");
        }
        if is_internal {
            head.push_str(" type=\"internal\"");
        }
        self.with_content(&head, actions);
    }
}
