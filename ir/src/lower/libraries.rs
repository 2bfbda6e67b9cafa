//! Library charts: each `use` becomes an instance with its own copy of everything, and its arguments replace the parameters (semantics §8).
//!
//! ```text
//! library chart blink(input on, output lamp) {           steps   c.off  c.lit
//!     initial step off   step lit { lamp }        =>     lamp driven by c.lit: R
//!     off -> lit when on }                               transition  c.off_lit when a or b
//! use blink as c(on = a or b, lamp -> R)
//! ```
#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "only some items and declarations concern a library"
)]

use super::codes;
use super::context::{Alias, AliasValue, Bound, Lowering, Outcome, ScopeId, Symbol};
use super::expand::{Expansion, Open, new_scope, part_priority};
use super::place::Place;
use crate::chart::{
    Argument, ArgumentValue, Chart, Declaration, DeclarationKind, Design, Item, Library, Parameter,
    Use,
};
use crate::diag::{Diagnostic, nearest};
use crate::expr::Type;
use crate::net::Part;
use crate::span::{Name, Span};

/// The design with this library chart as its only chart: its parameters are its inputs and outputs. `None` beyond the last library chart.
#[must_use]
pub fn alone(design: &Design, library: usize) -> Option<Design> {
    let source = design.libraries.get(library)?;
    let mut items: Vec<Item> = source
        .parameters
        .iter()
        .map(|parameter| Item::Declaration(parameter.declaration.clone()))
        .collect();
    items.extend(source.items.iter().cloned());
    let chart = Chart {
        name: source.name.clone(),
        span: source.span,
        items,
        meta: source.meta.clone(),
        ..Chart::default()
    };
    let libraries = design.libraries.clone();
    Some(Design { charts: vec![chart], libraries, ..Design::default() })
}

/// The library charts that the charts of a design use, directly or indirectly.
pub(super) fn used(design: &Design) -> Vec<&Library> {
    let mut found: Vec<&Library> = Vec::new();
    let mut open: Vec<&[Item]> = design.charts.iter().map(|chart| &chart.items[..]).collect();
    while let Some(items) = open.pop() {
        for item in items {
            match item {
                Item::Use(one) => {
                    let library = design
                        .libraries
                        .iter()
                        .find(|library| library.name.text == one.library.text);
                    if let Some(library) = library
                        && !found.iter().any(|other| std::ptr::eq(*other, library))
                    {
                        found.push(library);
                        open.push(&library.items);
                    }
                }
                Item::Macro(one) => open.push(&one.items),
                Item::Enclosing(one) => open.push(&one.items),
                Item::State(one) => open.push(&one.items),
                _ => {}
            }
        }
    }
    found
}

/// Reports library charts with the same name; the name refers to the first one.
pub(super) fn duplicates(lowering: &mut Lowering<'_>) {
    let libraries = &lowering.design.libraries;
    let mut first: std::collections::BTreeMap<&str, Span> = std::collections::BTreeMap::new();
    for library in libraries {
        if let Some(earlier) = first.insert(&library.name.text, library.name.span) {
            first.insert(&library.name.text, earlier);
            lowering.report(Diagnostic::twice(
                codes::DUPLICATE_NAME,
                format!("two library charts are called `{}`", library.name),
                [library.name.span, earlier],
                "give one of them another name",
            ));
        }
    }
}

/// Finds the errors in unused library charts.
pub(super) fn unused(lowering: &mut Lowering<'_>) {
    let design = lowering.design;
    for library in 0..design.libraries.len() {
        if lowering.used_libraries.contains(&library) {
            continue;
        }
        let Some(alone) = alone(design, library) else { continue };
        // Only this library chart is lowered here; the library charts that it uses are also in the list.
        let mut one = Lowering::new(&alone);
        one.costs = lowering.costs.clone();
        super::all_passes(&mut one);
        lowering.undeclared.append(&mut one.undeclared);
        for finding in one.found.list {
            if finding.is_error() {
                lowering.found.add(finding);
            }
        }
    }
}

impl<'a> Expansion<'_, 'a> {
    /// Lowers `use conveyor as c1(..)`.
    pub(super) fn instance(&mut self, scope: ScopeId, source: &'a Use) {
        if !self.has_room(source.meta.span) {
            return;
        }
        let Some((index, library)) = self.library(&source.library) else {
            self.lowering.declare(scope, &source.name, Symbol::Broken);
            return;
        };
        self.lowering.used_libraries.insert(index);
        let outer = &self.lowering.scopes[scope];
        let (outer_part, inside, chart) = (outer.part, outer.inside, outer.chart);
        let prefix = format!("{}{}.", outer.prefix, source.name.text);
        if let Some(state) = inside.filter(|_| self.lowering.is_statechart()) {
            let name = self.lowering.net.steps[state].name.text.clone();
            self.lowering.report(
                Diagnostic::error(
                    codes::CHART_KIND,
                    format!("an instance is not allowed in state `{name}`: in a statechart it runs in parallel with the chart"),
                )
                .at(source.meta.span, "")
                .help("move it outside all states; use events to communicate"),
            );
        }
        let part = self.lowering.net.parts.push(Part {
            name: Name::new(prefix.trim_end_matches('.'), source.name.span),
            level: self.lowering.net.parts[outer_part].level + 1,
            priority: part_priority(&library.items)
                .or(self.lowering.net.parts[outer_part].priority),
            initial: Vec::new(),
            is_cut: false,
            meta: source.meta.clone(),
        });
        let body = new_scope(self.lowering, None, prefix, part, inside, chart);
        self.lowering.scopes[body].is_instance = true;
        self.lowering.declare(scope, &source.name, Symbol::Chart(body));
        // Objects without steps count too; otherwise nested empty instances could multiply for ever.
        self.lowering.n_instances += 1;
        if let Some(start) = self.is_open(&library.name) {
            self.recursion(start, &library.name, source.meta.span);
            return;
        }
        self.parameters(scope, body, source, library);
        let span = source.meta.span;
        self.open.push(Open { name: &library.name, span, kind: "library chart" });
        self.items(body, &library.items);
        self.open.pop();
    }

    fn library(&mut self, name: &Name) -> Option<(usize, &'a Library)> {
        let libraries = &self.lowering.design.libraries;
        let found = libraries.iter().position(|library| library.name.text == name.text);
        if let Some(index) = found {
            return Some((index, &libraries[index]));
        }
        let names = libraries.iter().map(|library| library.name.text.as_str());
        let near = nearest(&name.text, names);
        let finding =
            Diagnostic::error(codes::UNKNOWN_NAME, format!("there is no library chart `{name}`"))
                .at(name.span, "not declared");
        self.lowering.report(finding.near(
            name.span,
            near,
            "declare it with `library chart`, or import its file: `use \"FILE.graf\"` at the top",
        ));
        None
    }

    fn parameters(&mut self, outer: ScopeId, body: ScopeId, source: &'a Use, library: &'a Library) {
        let mut given: Vec<(&str, &'a Argument)> = Vec::new();
        for argument in &source.arguments {
            let name = argument.parameter.text.as_str();
            let names = library.parameters.iter().map(|one| one.declaration.name.text.as_str());
            if let Some((_, first)) = given.iter().find(|(other, _)| *other == name) {
                let finding = Diagnostic::twice(
                    codes::ARGUMENT,
                    format!("two arguments for the parameter `{name}`"),
                    [argument.span, first.span],
                    "keep one of them",
                );
                self.lowering.report(finding);
            } else if !names.clone().any(|other| other == name) {
                let finding = Diagnostic::error(
                    codes::ARGUMENT,
                    format!("library chart `{}` has no parameter `{name}`", library.name),
                )
                .at(argument.parameter.span, "not a parameter");
                let near = nearest(name, names.clone());
                let known = format!("its parameters are {}", names.collect::<Vec<_>>().join(", "));
                self.lowering.report(finding.near(argument.parameter.span, near, known));
            } else {
                given.push((name, argument));
            }
        }
        for parameter in &library.parameters {
            let name = parameter.declaration.name.text.as_str();
            let argument = given.iter().find(|(other, _)| *other == name).map(|(_, one)| *one);
            self.parameter(outer, body, source, parameter, argument);
        }
    }

    fn parameter(
        &mut self,
        outer: ScopeId,
        body: ScopeId,
        source: &'a Use,
        parameter: &'a Parameter,
        argument: Option<&'a Argument>,
    ) {
        let declaration = &parameter.declaration;
        let value = argument.map(|argument| &argument.value);
        let (scope, value) = match (&declaration.kind, value, &parameter.default) {
            (DeclarationKind::Const { value: default }, value, _) => {
                let (scope, drawn) = match value {
                    Some(ArgumentValue::Reads(drawn)) => (outer, drawn),
                    Some(ArgumentValue::Drives(path)) => {
                        self.driven_constant(path.span(), &declaration.name);
                        (body, default)
                    }
                    None => (body, default),
                };
                let symbol = match self.lowering.constant_value(scope, drawn) {
                    Ok(value) => Symbol::Const(value),
                    Err(_) => Symbol::Broken,
                };
                self.lowering.declare(body, &declaration.name, symbol);
                return;
            }
            (_, Some(ArgumentValue::Reads(drawn)), _) => (outer, AliasValue::Expr(drawn)),
            (_, Some(ArgumentValue::Drives(path)), _) => (outer, AliasValue::Path(path)),
            (_, None, Some(default)) => (body, AliasValue::Expr(default)),
            (DeclarationKind::Input { .. }, None, None) => {
                let name = &declaration.name;
                self.lowering.report(
                    Diagnostic::error(
                        codes::ARGUMENT,
                        format!("no argument for the input `{name}` of `{}`", source.library),
                    )
                    .at(source.meta.span, "used here")
                    .at(name.span, "has no default")
                    .help(format!("add the argument `{name} = ..`")),
                );
                self.lowering.declare(body, name, Symbol::Broken);
                return;
            }
            // Outputs, events and variables without an argument belong to the instance.
            (_, None, None) => {
                self.own(body, declaration);
                return;
            }
        };
        let alias = self.lowering.aliases.len();
        self.lowering.aliases.push(Alias { scope, value });
        self.lowering.declare(body, &declaration.name, Symbol::Alias(alias));
        if let Some(argument) = argument {
            let value = &argument.value;
            self.lowering.bound.push(Bound { parameter, value, scope });
        }
    }

    fn own(&mut self, body: ScopeId, declaration: &'a Declaration) {
        let first = self.lowering.net.inputs.len();
        self.declaration(body, declaration);
        // Only the instance itself raises its own events.
        let made = self.lowering.net.inputs.ids().nth(first);
        if let (DeclarationKind::Event { .. }, Some(made)) = (&declaration.kind, made) {
            self.lowering.net.inputs[made].kind = crate::net::InputKind::InternalEvent;
        }
    }

    fn driven_constant(&mut self, span: Span, name: &Name) {
        self.lowering.report(
            Diagnostic::error(codes::ARGUMENT, format!("the constant `{name}` cannot be driven"))
                .at(span, "")
                .help(format!("give it a value: `{name} = ..`")),
        );
    }
}

/// Pass `arguments`: checks each argument against its parameter. Runs after `outputs`, because expressions read all kinds of values.
pub(super) fn arguments(lowering: &mut Lowering<'_>) {
    for index in 0..lowering.bound.len() {
        let Bound { parameter, value, scope } = lowering.bound[index];
        // All errors were already reported.
        let _: Outcome<()> = match value {
            ArgumentValue::Reads(drawn) => reads(lowering, scope, parameter, drawn),
            ArgumentValue::Drives(path) => drives(lowering, scope, parameter, path),
        };
    }
}

fn reads(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    parameter: &Parameter,
    drawn: &crate::chart::Expr,
) -> Outcome<()> {
    let name = &parameter.declaration.name;
    let wanted = match &parameter.declaration.kind {
        DeclarationKind::Input { ty, .. } => *ty,
        DeclarationKind::Event { .. } => {
            if let Some(path) = path_of(drawn) {
                return drives(lowering, scope, parameter, path);
            }
            return Err(lowering.report(
                Diagnostic::error(codes::ARGUMENT, format!("`{name}` is an event"))
                    .at(drawn.span, "the name of an event is needed here")
                    .help("write the name of an `event` of this chart"),
            ));
        }
        DeclarationKind::Output { .. } | DeclarationKind::Var { .. } => {
            return Err(lowering.report(
                Diagnostic::error(
                    codes::ARGUMENT,
                    format!("the instance drives `{name}`; it does not read it"),
                )
                .at(drawn.span, "an expression cannot be driven")
                .help(format!("write `{name} -> NAME` with the output or variable that it drives")),
            ));
        }
        _ => return Ok(()),
    };
    if let Some(path) = path_of(drawn)
        && let Some(super::names::Resolved::Symbol(Symbol::Input(input))) =
            lowering.peek(scope, path)
        && lowering.net.inputs[input].kind.is_event()
        && lowering.is_statechart()
    {
        return Err(lowering.report(
            Diagnostic::error(
                codes::ARGUMENT,
                format!("the parameter `{name}` is an input, but `{path}` is an event"),
            )
            .at(drawn.span, "")
            .help("declare the parameter with `event`: a statechart processes one event at a time"),
        ));
    }
    let place = Place { edges: true, events: true, ..Place::level(scope, "an argument") };
    let (expr, ty) = lowering.typed(drawn, &place)?;
    let fits = match (wanted, ty) {
        (Type::Bool, Type::Bool) => true,
        (Type::Int { lo, hi }, Type::Int { lo: least, hi: most }) => lo <= least && most <= hi,
        (Type::Bool, Type::Int { .. }) | (Type::Int { .. }, Type::Bool) => false,
    };
    if fits {
        return Ok(());
    }
    let text = |ty| match ty {
        Type::Bool => "true or false".to_owned(),
        Type::Int { lo, hi } => format!("{lo}..{hi}"),
    };
    Err(lowering.report(
        Diagnostic::error(
            codes::ARGUMENT,
            format!(
                "the argument for `{name}` is {}, but the parameter is {}",
                text(ty),
                text(wanted)
            ),
        )
        .at(expr.span, text(ty))
        .at(name.span, text(wanted))
        .help("use an argument within the type of the parameter"),
    ))
}

fn drives(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    parameter: &Parameter,
    path: &crate::chart::Path,
) -> Outcome<()> {
    let name = &parameter.declaration.name;
    let symbol = lowering.symbol(scope, path)?;
    let (fits, wanted) = match (&parameter.declaration.kind, symbol) {
        (_, Symbol::Broken) => return Err(lowering.already_told()),
        (DeclarationKind::Output { ty, .. }, Symbol::Output(output)) => {
            (lowering.net.outputs[output].ty == *ty, "an output of the same type")
        }
        (DeclarationKind::Output { .. }, _) => (false, "an output"),
        (DeclarationKind::Var { ty, .. }, Symbol::Var(var)) => {
            let var = &lowering.net.vars[var];
            (var.ty == *ty && var.len.is_none(), "a variable of the same type")
        }
        (DeclarationKind::Var { .. }, _) => (false, "a variable"),
        (DeclarationKind::Event { .. }, Symbol::Input(input)) => {
            (lowering.net.inputs[input].kind.is_event(), "an event")
        }
        (DeclarationKind::Event { .. }, _) => (false, "an event"),
        (DeclarationKind::Input { .. }, _) => {
            return Err(lowering.report(
                Diagnostic::error(
                    codes::ARGUMENT,
                    format!("the instance reads `{name}`; it does not drive it"),
                )
                .at(path.span(), "")
                .help(format!("write `{name} = {path}`")),
            ));
        }
        _ => return Ok(()),
    };
    if fits {
        return Ok(());
    }
    let kind = lowering.kind(symbol);
    Err(lowering.report(
        Diagnostic::error(
            codes::ARGUMENT,
            format!("`{path}` is {kind}, but `{name}` needs {wanted}"),
        )
        .at(path.span(), format!("{wanted} is needed here"))
        .at(name.span, "the parameter")
        .help(format!("write the name of {wanted}, or change the parameter")),
    ))
}

fn path_of(drawn: &crate::chart::Expr) -> Option<&crate::chart::Path> {
    if let crate::expr::ExprKind::Leaf(crate::chart::Leaf::Name(path)) = &drawn.kind {
        Some(path)
    } else {
        None
    }
}
