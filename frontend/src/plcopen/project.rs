//! Reads projects: units with their interfaces, types, tasks and programs.

use grafsynth_ir::diag::Diagnostic;
use itertools::Itertools as _;
use roxmltree::Node;

use super::reader::{Reader, Unit, child, children, is_set, tag};
use super::{il, network, sfc};
use crate::codes;
use crate::st::ast::{
    Action, Body, Init, Instance, Library, Options, Pou, PouKind, Section, Stmt, Task, TypeDef,
    TypeKind, TypeRef, Var,
};
use crate::st::lexer::Places;
use crate::st::parse::Parser;
use crate::st::parse_expr::duration;
use crate::st::symbol::{Ident, Symbol};

impl Reader<'_, '_> {
    pub(super) fn project(&mut self, root: Node<'_, '_>) -> Library {
        let mut library = Library::default();
        let mut outside = Unit::default();
        self.check(root, "project", &mut outside);
        for node in root.descendants().filter(Node::is_element) {
            // Private data of tools is skipped, with these exceptions.
            if node.parent().is_some_and(|parent| tag(parent) == "data") {
                match tag(node) {
                    "globalVars" => self.check(node, "variables", &mut outside),
                    name @ ("configuration" | "resource" | "task" | "pouInstance" | "dataType") => {
                        self.check(node, name, &mut outside);
                    }
                    _ => {}
                }
            }
            match tag(node) {
                "pou" => {
                    if let Some(pou) = self.pou(node) {
                        library.pous.push(pou);
                    }
                }
                "dataType" => {
                    if let Some(def) = self.data_type(node, &mut outside) {
                        library.types.push(def);
                    }
                }
                "globalVars" if node.ancestors().all(|one| tag(one) != "interface") => {
                    self.vars(node, Section::Global, &mut library.globals, &mut outside);
                }
                "task" => self.task(node, &mut library),
                "pouInstance" => self.program(node, &mut library),
                _ => {}
            }
        }
        for refusal in outside.refused {
            self.report(|| refusal.diagnostic());
        }
        library
    }

    /// Reads a task. The interval is `T#10ms`, or `PT0.01S` in the syntax of XML durations.
    fn task(&mut self, node: Node<'_, '_>, library: &mut Library) {
        let Some(name) = self.name(node, "name") else { return };
        let interval_text = node.attribute("interval").unwrap_or("").trim();
        let interval = interval_text;
        let settings =
            node.descendants().find(|one| one.is_element() && tag(*one) == "TaskSettings");
        let given = match settings.and_then(|one| {
            Some((one.attribute("Interval")?, one.attribute("IntervalUnit").unwrap_or("us")))
        }) {
            Some((number, unit)) => duration(&format!("{number}{unit}")),
            None => match interval.strip_prefix("PT") {
                Some(rest) => duration(rest),
                None => duration(interval.split_once('#').map_or(interval, |(_, rest)| rest)),
            },
        };
        let interval = given.and_then(|ns| u64::try_from(ns).ok()).filter(|ns| *ns > 0);
        if interval.is_none() && !interval_text.is_empty() {
            let (span, text) = (self.span(node), interval_text.to_owned());
            self.report(|| {
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("the task interval `{text}` is ignored: it is not a positive time"),
                )
                .at(span, "the tick is 10 ms")
                .help("write a positive time, as in interval=\"T#10ms\"")
            });
        }
        if node.attribute("single").is_some_and(|single| !single.trim().is_empty()) {
            let (span, name) = (self.span(node), name.clone());
            self.report(|| {
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("`single` of task `{name}` is ignored: its programs run once per tick"),
                )
                .at(span, "")
                .help("remove single, and write interval=\"T#10ms\" for the period; to wait for its variable, test it in the program")
            });
        }
        library.tasks.push(Task { name, interval });
    }

    fn program(&mut self, node: Node<'_, '_>, library: &mut Library) {
        let Some(name) = self.name(node, "name") else { return };
        // In version 1.01 the attribute is called `type`.
        let program = self.name(node, "typeName").or_else(|| self.name(node, "type"));
        let program = program.unwrap_or_else(|| name.clone());
        let task = node
            .ancestors()
            .find(|one| tag(*one) == "task")
            .and_then(|task| self.name(task, "name"));
        library.programs.push(Instance { name, task, program });
    }

    fn data_type(&mut self, node: Node<'_, '_>, unit: &mut Unit) -> Option<TypeDef> {
        let name = self.name(node, "name")?;
        let ty = self.type_in(child(node, "baseType")?, unit)?;
        let init = child(node, "initialValue").and_then(|one| self.initial(one, unit));
        Some(TypeDef { name, ty, init })
    }

    fn pou(&mut self, node: Node<'_, '_>) -> Option<Pou> {
        let name = self.name(node, "name")?;
        let mut unit = Unit::default();
        self.check(node, "pou", &mut unit);
        let interface = child(node, "interface");
        let kind = match node.attribute("pouType").unwrap_or("") {
            "program" => PouKind::Program,
            "functionBlock" => PouKind::FunctionBlock,
            "function" => {
                let result = interface.and_then(|one| child(one, "returnType"));
                PouKind::Function(result.and_then(|one| self.type_in(one, &mut unit)))
            }
            other => {
                let (span, other) = (self.span(node), other.to_owned());
                self.report(|| {
                    Diagnostic::error(codes::PLC_PROJECT, format!("unknown pouType `{other}`"))
                        .at(span, "expected program, functionBlock or function")
                        .help("write pouType=\"program\", \"functionBlock\" or \"function\"")
                });
                return None;
            }
        };
        let mut vars = Vec::new();
        let sections = [
            ("inputVars", Section::Input),
            ("outputVars", Section::Output),
            ("inOutVars", Section::InOut),
            ("localVars", Section::Local),
            ("tempVars", Section::Temp),
            ("externalVars", Section::External),
            ("globalVars", Section::Global),
        ];
        if let Some(interface) = interface {
            for list in interface.children().filter(Node::is_element) {
                if let Some((_, section)) = sections.iter().find(|(name, _)| *name == tag(list)) {
                    self.vars(list, *section, &mut vars, &mut unit);
                }
            }
        }
        let mut actions = self.actions(node, &mut unit);
        // CODESYS and TwinCAT run each action once more when it ends.
        let final_scan =
            node.descendants().any(|one| one.is_element() && tag(one) == "SFCSettings");
        let mut options = Options { final_scan, ..Options::default() };
        if let Some(documentation) = child(node, "documentation") {
            let mapped = self.content(documentation);
            let places = Places::Mapped(&mapped);
            let mut parser = Parser::new(&mapped.text, places, self.findings, self.nesting);
            let found = parser.options(0, mapped.text.len());
            parser.unread_pragmas();
            options.final_scan |= found.final_scan;
            options.settings = found.settings;
        }
        let body = match child(node, "body") {
            Some(body) => self.body(node, body, &mut actions, &mut unit),
            None => Body::Statements(Vec::new()),
        };
        vars.append(&mut unit.vars);
        Some(Pou { kind, name, vars, body, actions, options, refused: unit.refused })
    }

    /// The named actions of a unit; CODESYS keeps them in its own data.
    fn actions(&mut self, pou: Node<'_, '_>, unit: &mut Unit) -> Vec<Action> {
        let mut actions = Vec::new();
        let lists = pou.children().filter(|one| one.is_element() && tag(*one) == "actions");
        for node in lists.flat_map(|list| list.children().filter(Node::is_element)) {
            let Some(name) = self.name(node, "name") else { continue };
            let Some(body) = child(node, "body") else { continue };
            let body = match child(body, "SFC") {
                Some(chart) => {
                    let span = self.span(chart);
                    unit.refuse(
                        format!("the action `{name}` with its own chart"),
                        span,
                        "make it a separate program, or a macro-step",
                    );
                    Vec::new()
                }
                None => self.list(body, unit),
            };
            let label = sfc::documentation(node);
            actions.push(Action { name, body, label, span: self.span(node) });
        }
        actions
    }

    /// The statements of a body without a chart.
    pub(super) fn list(&mut self, body: Node<'_, '_>, unit: &mut Unit) -> Vec<Stmt> {
        let Some(inner) =
            body.children().find(|one| one.is_element() && tag(*one) != "documentation")
        else {
            return Vec::new();
        };
        match tag(inner) {
            "ST" => self.statements(inner, unit),
            "IL" => {
                let mapped = self.content(inner);
                self.parsed(&mapped, unit, il::statements)
            }
            "LD" | "FBD" => network::statements(self, inner, unit),
            "SFC" => {
                let span = self.span(inner);
                unit.refuse(
                    "an action with its own chart",
                    span,
                    "make it a function block or a macro-step",
                );
                Vec::new()
            }
            other => {
                let span = self.span(inner);
                unit.refuse(format!("a body in {other}"), span, "use SFC, ST, LD, FBD or IL");
                Vec::new()
            }
        }
    }

    fn body(
        &mut self,
        pou: Node<'_, '_>,
        body: Node<'_, '_>,
        actions: &mut Vec<Action>,
        unit: &mut Unit,
    ) -> Body {
        match child(body, "SFC") {
            Some(drawn) => {
                let mut chart = sfc::chart(self, pou, drawn, unit);
                chart.actions.splice(0..0, actions.drain(..));
                Body::Sfc(chart)
            }
            None => {
                let list = self.list(body, unit);
                Body::Statements(list)
            }
        }
    }

    // Interfaces

    fn vars(&mut self, list: Node<'_, '_>, section: Section, vars: &mut Vec<Var>, unit: &mut Unit) {
        let is_constant = is_set(list, "constant");
        for word in ["retain", "persistent"] {
            if is_set(list, word) {
                let span = self.span(list);
                self.report(|| {
                    Diagnostic::warning(
                        codes::ST_LEFT_OUT,
                        format!(
                            "{word} is ignored: these variables start with their initial values"
                        ),
                    )
                    .at(span, "")
                });
            }
        }
        for node in children(list, "variable") {
            let Some(name) = self.name(node, "name") else {
                let span = self.span(node);
                unit.mistake(codes::PLC_MARKUP, "a variable has no name", span, "give it a name");
                continue;
            };
            let Some(ty) = child(node, "type").and_then(|ty| self.type_in(ty, unit)) else {
                let span = self.span(node);
                unit.refuse(format!("the type of `{name}`"), span, "write a type such as <BOOL/>");
                continue;
            };
            let init = child(node, "initialValue").and_then(|one| self.initial(one, unit));
            let address = self.name(node, "address");
            let label = child(node, "documentation")
                .map(|one| {
                    let mapped = self.content(one);
                    mapped.text.split_whitespace().join(" ")
                })
                .unwrap_or_default();
            vars.push(Var { name, section, is_constant, ty, init, address, label });
        }
    }

    fn type_in(&mut self, node: Node<'_, '_>, unit: &mut Unit) -> Option<TypeRef> {
        let Some(inner) = node.children().find(Node::is_element) else {
            // A type written as text is already reported; the uses of the variable are valid.
            let text = super::markup::type_name(node)?;
            return Some(TypeRef::named(text, self.span(node)));
        };
        let span = self.span(inner);
        let kind = match tag(inner) {
            "derived" => TypeKind::Named(self.name(inner, "name")?),
            "array" => {
                let mut ranges = Vec::new();
                for dimension in children(inner, "dimension") {
                    let low = self.expression_of(dimension, "lower", unit)?;
                    let high = self.expression_of(dimension, "upper", unit)?;
                    ranges.push((low, high));
                }
                let base = self.type_in(child(inner, "baseType")?, unit)?;
                TypeKind::Array(ranges, Box::new(base))
            }
            "subrangeSigned" | "subrangeUnsigned" => {
                let range = child(inner, "range")?;
                let low = self.expression_of(range, "lower", unit)?;
                let high = self.expression_of(range, "upper", unit)?;
                let base = self.type_in(child(inner, "baseType")?, unit)?;
                if let TypeKind::Named(name) = base.kind {
                    TypeKind::Subrange(name, Box::new((low, high)))
                } else {
                    base.kind
                }
            }
            "enum" => {
                let mut values = Vec::new();
                for value in
                    inner.descendants().filter(|one| one.is_element() && tag(*one) == "value")
                {
                    let Some(name) = self.name(value, "name") else { continue };
                    values.push((name, self.expression_of(value, "value", unit)));
                }
                TypeKind::Enum(values)
            }
            "struct" => {
                let mut fields = Vec::new();
                self.vars(inner, Section::Local, &mut fields, unit);
                TypeKind::Struct(fields)
            }
            "string" | "wstring" => TypeKind::Refused(Symbol::of(tag(inner)).to_string()),
            "pointer" => TypeKind::Refused("POINTER types".to_owned()),
            name => TypeKind::Named(Ident::new(name, span)),
        };
        Some(TypeRef { kind, span })
    }

    fn initial(&mut self, node: Node<'_, '_>, unit: &mut Unit) -> Option<Init> {
        let inner = node.children().find(Node::is_element)?;
        let span = self.span(inner);
        match tag(inner) {
            "simpleValue" => self.expression_of(inner, "value", unit).map(Init::Value),
            "arrayValue" => {
                let mut values = Vec::new();
                for value in children(inner, "value") {
                    let count = self.expression_of(value, "repetitionValue", unit);
                    values.push((count, self.initial(value, unit)?));
                }
                Some(Init::List(values, span))
            }
            "structValue" => {
                let mut fields = Vec::new();
                for value in children(inner, "value") {
                    let Some(member) = self.name(value, "member") else { continue };
                    fields.push((member, self.initial(value, unit)?));
                }
                Some(Init::Fields(fields, span))
            }
            _ => None,
        }
    }
}
