//! Reads the charts of a project. In the file, each element refers to its predecessors; here these links become transitions between steps.

use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::Qualifier;
use roxmltree::Node;

use super::network::{self, Network};
use super::reader::{Reader, Unit, child, children, is_set, tag};
use crate::codes;
use crate::st::ast::{
    Action, Element, Expr, ExprKind, MacroStep, Role, Sfc, Step, Transition, Use,
};
use crate::st::parse_expr::duration;
use crate::st::parse_sfc::qualifier;
use crate::st::symbol::{Ident, Symbol};

/// Attributes in which CODESYS stores the actions of a step: while it is active, when it is entered, when it is left.
const STEP_ACTIONS: [(&str, Qualifier); 3] =
    [("700a583f", Qualifier::N), ("a6b08bd8", Qualifier::P1), ("a2621e18", Qualifier::P0)];

struct Drawing<'a, 'd> {
    nodes: BTreeMap<String, Node<'a, 'd>>,
    order: Vec<Node<'a, 'd>>,
}

impl<'a, 'd: 'a> Drawing<'a, 'd> {
    /// The predecessors of an element.
    fn before(&self, node: Node<'a, 'd>) -> Vec<Node<'a, 'd>> {
        children(node, "connectionPointIn")
            .flat_map(|point| children(point, "connection").collect::<Vec<_>>())
            .filter_map(|connection| self.nodes.get(connection.attribute("refLocalId")?).copied())
            .collect()
    }
}

/// Reads the chart of a unit or macro-step.
pub(super) fn chart(
    reader: &mut Reader<'_, '_>,
    pou: Node<'_, '_>,
    body: Node<'_, '_>,
    unit: &mut Unit,
) -> Sfc {
    let mut drawing = Drawing { nodes: BTreeMap::new(), order: Vec::new() };
    for node in body.children().filter(Node::is_element) {
        // Some tools omit the number of a step and give only its position.
        let id = node.attribute("localId").map(str::to_owned);
        if let Some(id) = id {
            drawing.nodes.entry(id).or_insert(node);
        }
        drawing.order.push(node);
    }
    let mut sfc = Sfc::default();
    let mut always = Vec::new();
    let mut network = Network::of(body);
    let uses = uses(reader, &drawing, unit, &mut sfc.actions);
    let mut transitions: Vec<(Node<'_, '_>, Transition)> = Vec::new();
    let mut leads_to: BTreeMap<String, Vec<Ident>> = BTreeMap::new();
    // Steps with a wire that bypasses the transition after them.
    let mut miswired: BTreeSet<String> = BTreeSet::new();
    for node in drawing.order.clone() {
        let target = match tag(node) {
            "step" | "macroStep" => reader.name(node, "name"),
            "jumpStep" => reader.name(node, "targetName"),
            _ => continue,
        };
        let Some(target) = target else {
            let span = reader.span(node);
            reader.report(|| {
                Diagnostic::error(codes::PLC_CHART, format!("<{}> without a name", tag(node)))
                    .at(span, "")
                    .help("give it the name of the step that it leads to: name=\"..\" of a <step>, targetName=\"..\" of a <jumpStep>")
            });
            continue;
        };
        for transition in feeders(&drawing, node) {
            leads_to.entry(transition).or_default().push(target.clone());
        }
        for step in wired_steps(&drawing, node) {
            let from = step.attribute("name").unwrap_or("?").to_owned();
            let (step_span, to) = (reader.span(step), target.text.clone());
            let place = node
                .descendants()
                .find(|one| one.is_element() && tag(*one) == "connection")
                .map_or_else(|| reader.span(node), |wire| reader.span(wire));
            miswired.insert(from.clone());
            reader.report(|| {
                Diagnostic::error(
                    codes::PLC_CHART,
                    format!("step `{to}` is connected to step `{from}` without a transition between them"),
                )
                .at(place, format!("leads from step `{from}` to `{to}`"))
                .at(step_span, format!("step `{from}`"))
                .help("connect the lower step to a transition: write the localId of the transition as this refLocalId")
            });
        }
    }
    for node in drawing.order.clone() {
        if tag(node) != "transition" {
            continue;
        }
        let span = reader.span(node);
        let from = sources(reader, &drawing, node);
        let is_bypassed = from.iter().any(|step| miswired.contains(&step.text));
        let to =
            node.attribute("localId").and_then(|id| leads_to.get(id).cloned()).unwrap_or_default();
        if from.is_empty() || to.is_empty() {
            if to.is_empty() && is_bypassed {
                // The wire that bypasses it is already reported.
                continue;
            }
            let (side, help) = if from.is_empty() {
                ("above", "connect its connectionPointIn to a step")
            } else {
                ("below", "connect the connectionPointIn of a step or jump to this transition")
            };
            reader.report(|| {
                Diagnostic::error(
                    codes::PLC_CHART,
                    format!("this transition has no step {side} it"),
                )
                .at(span, "")
                .help(help)
            });
            continue;
        }
        let condition = condition(reader, pou, &mut network, node, unit, &mut always);
        let priority = priority(reader, node);
        let Some(condition) = condition else { continue };
        let label = documentation(node);
        let restart = label.contains(RESTART);
        let label = label.replace(RESTART, "").trim().to_owned();
        let transition = Transition {
            name: transition_name(reader, node),
            from,
            to,
            priority,
            restart,
            condition,
            label,
            span,
        };
        transitions.push((node, transition));
    }
    left_to_right(&drawing, &mut transitions);
    let mut kept: BTreeMap<usize, Transition> = transitions
        .into_iter()
        .map(|(node, transition)| (node.id().get_usize(), transition))
        .collect();
    let entries = roles(&drawing, body);
    for node in drawing.order.clone() {
        match tag(node) {
            "step" => {
                let Some(name) = reader.name(node, "name") else { continue };
                let key = node.attribute("localId").unwrap_or("").to_owned();
                let mut list = uses.get(&key).cloned().unwrap_or_default();
                list.extend(step_actions(reader, node));
                sfc.elements.push(Element::Step(Step {
                    is_initial: is_set(node, "initialStep"),
                    uses: list,
                    label: documentation(node),
                    role: entries.get(&name.text).copied().unwrap_or_default(),
                    span: reader.span(node),
                    name,
                }));
            }
            "macroStep" => {
                let Some(name) = reader.name(node, "name") else { continue };
                let span = reader.span(node);
                match child(node, "body").and_then(|body| child(body, "SFC")) {
                    Some(inner) if node.ancestors().count() < 64 => {
                        let body = chart(reader, pou, inner, unit);
                        sfc.actions.extend(body.actions);
                        always.extend(body.always);
                        let (body, role) =
                            (body.elements, entries.get(&name.text).copied().unwrap_or_default());
                        sfc.elements.push(Element::Macro(MacroStep { name, body, role, span }));
                    }
                    Some(_) | None => {
                        unit.refuse(
                            "a macro-step without a chart in it",
                            span,
                            "draw its chart inside it",
                        );
                    }
                }
            }
            "transition" => {
                // Competing transitions keep their positions in the list, but are sorted from left to right.
                if let Some(transition) = kept.remove(&node.id().get_usize()) {
                    sfc.elements.push(Element::Transition(transition));
                }
            }
            _ => {}
        }
    }
    let lost = |node: &&Node<'_, '_>| network::is_sink(**node) && !network.is_called(**node);
    for node in drawing.order.iter().filter(lost) {
        let (span, what) = (reader.span(*node), tag(*node));
        reader.report(|| {
            Diagnostic::warning(
                codes::ST_LEFT_OUT,
                format!("<{what}> on the page of a chart is ignored: no condition uses it"),
            )
            .at(span, "")
            .help("move it into an action")
        });
    }
    sfc.always = always;
    sfc
}

/// The priority of a transition; `None` if it is missing or invalid.
fn priority(reader: &mut Reader<'_, '_>, node: Node<'_, '_>) -> Option<u32> {
    let written = node.attribute("priority").map(str::trim).filter(|one| !one.is_empty())?;
    let found = written.parse().ok().filter(|n| *n > 0);
    if found.is_none() && written != "0" {
        let (span, written) = (reader.span(node), written.to_owned());
        reader.report(|| {
            Diagnostic::error(codes::PLC_CHART, format!("invalid priority `{written}`"))
                .at(span, "in this transition")
                .help("write a number from 1, the most urgent")
        });
    }
    found
}

/// Mark in the documentation of a transition: a step that it both leaves and enters restarts.
pub(super) const RESTART: &str = "{grafsynth restart}";

/// The name of a transition: its own name or that of its inline condition.
fn transition_name(reader: &Reader<'_, '_>, node: Node<'_, '_>) -> Option<Ident> {
    reader.name(node, "name").or_else(|| {
        let inline = child(child(node, "condition")?, "inline")?;
        reader.name(inline, "name")
    })
}

/// The comment of an element, on one line.
pub(super) fn documentation(node: Node<'_, '_>) -> String {
    child(node, "documentation")
        .map(|one| {
            one.descendants()
                .filter(Node::is_text)
                .filter_map(|text| text.text())
                .flat_map(str::split_whitespace)
                .join(" ")
        })
        .unwrap_or_default()
}

/// The steps that a transition leaves.
fn sources(
    reader: &mut Reader<'_, '_>,
    drawing: &Drawing<'_, '_>,
    node: Node<'_, '_>,
) -> Vec<Ident> {
    let mut found: Vec<Ident> = Vec::new();
    let mut seen = BTreeSet::new();
    let mut next: Vec<String> = node.attribute("localId").map(str::to_owned).into_iter().collect();
    while let Some(id) = next.pop() {
        let Some(node) = drawing.nodes.get(&id) else { continue };
        let before = drawing.before(*node);
        for one in before.into_iter().rev() {
            match tag(one) {
                "step" | "macroStep" => {
                    if let Some(name) = reader.name(one, "name")
                        && found.iter().all(|other| other.text != name.text)
                    {
                        found.push(name);
                    }
                }
                "selectionDivergence"
                | "simultaneousConvergence"
                | "simultaneousDivergence"
                | "selectionConvergence" => {
                    if let Some(id) = one.attribute("localId")
                        && seen.insert(id.to_owned())
                    {
                        next.push(id.to_owned());
                    }
                }
                _ => {}
            }
        }
    }
    // Sorts the steps in the order of the chart.
    let place = |name: &Ident| {
        drawing.order.iter().position(|node| node.attribute("name") == Some(&name.text))
    };
    found.sort_by_key(|name| place(name));
    found
}

/// The steps that are wired to a step or jump without a transition between them.
fn wired_steps<'a, 't>(drawing: &Drawing<'a, 't>, node: Node<'a, 't>) -> Vec<Node<'a, 't>> {
    drawing.before(node).into_iter().filter(|one| is_step(*one)).collect()
}

/// The transitions that lead to a step or jump.
fn feeders(drawing: &Drawing<'_, '_>, node: Node<'_, '_>) -> Vec<String> {
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    let mut next = drawing.before(node);
    while let Some(one) = next.pop() {
        let Some(id) = one.attribute("localId") else { continue };
        if !seen.insert(id.to_owned()) {
            continue;
        }
        match tag(one) {
            "transition" => found.push(id.to_owned()),
            "selectionConvergence"
            | "simultaneousDivergence"
            | "selectionDivergence"
            | "simultaneousConvergence" => next.extend(drawing.before(one)),
            _ => {}
        }
    }
    found
}

/// Sorts competing transitions of one divergence from left to right as drawn; transitions at the same position keep their order.
fn left_to_right(drawing: &Drawing<'_, '_>, transitions: &mut [(Node<'_, '_>, Transition)]) {
    let column = |node: Node<'_, '_>| {
        child(node, "position")
            .and_then(|one| one.attribute("x")?.trim().parse::<f64>().ok())
            .unwrap_or(0.0)
    };
    let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, (node, _)) in transitions.iter().enumerate() {
        for before in drawing.before(*node) {
            if tag(before) == "selectionDivergence"
                && let Some(id) = before.attribute("localId")
            {
                groups.entry(id.to_owned()).or_default().push(index);
            }
        }
    }
    for places in groups.values() {
        let mut sorted: Vec<(Node<'_, '_>, Transition)> = places
            .iter()
            .map(|index| (transitions[*index].0, transitions[*index].1.clone()))
            .collect();
        sorted.sort_by(|(a, _), (b, _)| column(*a).total_cmp(&column(*b)));
        for (place, one) in places.iter().zip(sorted) {
            transitions[*place].1 = one.1;
        }
    }
}

/// Whether an element is part of a chart, not of a network on its page.
pub(super) fn is_part(node: Node<'_, '_>) -> bool {
    const PARTS: [&str; 7] = [
        "transition",
        "jumpStep",
        "actionBlock",
        "selectionDivergence",
        "selectionConvergence",
        "simultaneousDivergence",
        "simultaneousConvergence",
    ];
    is_step(node) || PARTS.contains(&tag(node))
}

/// Whether an element is a step or a macro-step; the enclosing chart contains both.
fn is_step(node: Node<'_, '_>) -> bool {
    matches!(tag(node), "step" | "macroStep")
}

/// The roles of steps in the body of a macro-step: the only step without predecessors is its entry, the only step without successors its
/// exit.
fn roles(drawing: &Drawing<'_, '_>, body: Node<'_, '_>) -> BTreeMap<String, Role> {
    let mut roles = BTreeMap::new();
    let is_macro = body
        .parent()
        .and_then(|body| body.parent())
        .is_some_and(|owner| owner.is_element() && tag(owner) == "macroStep");
    if !is_macro {
        return roles;
    }
    let steps: Vec<Node<'_, '_>> =
        drawing.order.iter().copied().filter(|node| is_step(*node)).collect();
    let jumps: BTreeSet<&str> = drawing
        .order
        .iter()
        .filter(|node| tag(**node) == "jumpStep")
        .filter_map(|node| node.attribute("targetName"))
        .collect();
    let mut left: BTreeSet<String> = BTreeSet::new();
    for node in drawing.order.iter().filter(|node| tag(**node) == "transition") {
        let mut next = drawing.before(*node);
        let mut seen = BTreeSet::new();
        while let Some(one) = next.pop() {
            let Some(id) = one.attribute("localId") else { continue };
            if !seen.insert(id.to_owned()) {
                continue;
            }
            if is_step(one) {
                left.insert(id.to_owned());
            } else {
                next.extend(drawing.before(one));
            }
        }
    }
    for step in steps {
        let name = step.attribute("name").unwrap_or("");
        let is_entry = feeders(drawing, step).is_empty() && !jumps.contains(name);
        let is_exit = step.attribute("localId").is_none_or(|id| !left.contains(id));
        let role = match (is_entry, is_exit) {
            (true, true) => Role::EntryExit,
            (true, false) => Role::Entry,
            (false, true) => Role::Exit,
            (false, false) => Role::Plain,
        };
        roles.insert(name.to_owned(), role);
    }
    roles
}

/// The actions of each step, by the number of the step. Inline actions get generated names.
fn uses(
    reader: &mut Reader<'_, '_>,
    drawing: &Drawing<'_, '_>,
    unit: &mut Unit,
    actions: &mut Vec<Action>,
) -> BTreeMap<String, Vec<Use>> {
    let mut found: BTreeMap<String, Vec<Use>> = BTreeMap::new();
    for block in drawing.order.iter().filter(|node| tag(**node) == "actionBlock") {
        let steps: Vec<Node<'_, '_>> =
            drawing.before(*block).into_iter().filter(|node| tag(*node) == "step").collect();
        let owner =
            steps.first().and_then(|step| step.attribute("name")).unwrap_or("action").to_owned();
        if steps.is_empty() {
            let span = reader.span(*block);
            reader.report(|| {
                Diagnostic::error(codes::PLC_CHART, "this action block is connected to no step")
                    .at(span, "")
                    .help("connect it to a step")
            });
        }
        for action in children(*block, "action") {
            let span = reader.span(action);
            let written = action.attribute("qualifier").unwrap_or("N");
            let Some(qualifier) = qualifier(written) else {
                let written = written.to_owned();
                reader.report(|| {
                    Diagnostic::error(codes::PLC_CHART, format!("unknown qualifier `{written}`"))
                        .at(span, "")
                        .help("write N, R, S, L, D, P, P0, P1, SD, DS or SL")
                });
                continue;
            };
            let name = match (child(action, "reference"), child(action, "inline")) {
                (Some(reference), _) => reader.name(reference, "name"),
                (None, Some(inline)) => {
                    let body = reader.list(inline, unit);
                    let base = match reader.name(inline, "name") {
                        Some(name) => name.text,
                        None => format!("{owner}_inline"),
                    };
                    let mut name = Ident::new(base.as_str(), span);
                    let mut n = 2;
                    while actions.iter().any(|one| one.name.id == name.id) {
                        name = Ident::new(format!("{base}_{n}"), span);
                        n += 1;
                    }
                    actions.push(Action { name: name.clone(), body, label: String::new(), span });
                    Some(name)
                }
                (None, None) => None,
            };
            let Some(name) = name else {
                unit.mistake(
                    codes::PLC_CHART,
                    "an action has no name",
                    span,
                    "add a <reference> to a variable or an action",
                );
                continue;
            };
            if action.attribute("indicator").is_some_and(|one| !one.trim().is_empty()) {
                reader.report(|| {
                    Diagnostic::warning(codes::ST_LEFT_OUT, "the indicator variable is ignored")
                        .at(span, "has no effect")
                        .help("remove it; to see when the action runs, read its Boolean variable")
                });
            }
            let time = time(reader, action, span);
            for step in &steps {
                let key = step.attribute("localId").unwrap_or("").to_owned();
                found.entry(key).or_default().push(Use {
                    action: name.clone(),
                    qualifier,
                    duration: time.clone(),
                    span,
                });
            }
        }
    }
    found
}

/// The duration of an action: a time, or the name of a variable or constant.
fn time(reader: &mut Reader<'_, '_>, action: Node<'_, '_>, span: Span) -> Option<Expr> {
    let name = reader.name(action, "duration")?;
    let text = name.text.split_once('#').map_or(name.text.as_str(), |(_, rest)| rest);
    let starts_with_digit = text.starts_with(|c: char| c.is_ascii_digit());
    match duration(text) {
        Some(ns) if starts_with_digit => Some(Expr::new(ExprKind::Time(ns), span)),
        _ => Some(Expr::name(name)),
    }
}

/// Actions that CODESYS stores in its own data.
fn step_actions(reader: &Reader<'_, '_>, step: Node<'_, '_>) -> Vec<Use> {
    let span = reader.span(step);
    let mut uses = Vec::new();
    let Some(data) = child(step, "addData") else { return uses };
    for attribute in data.descendants().filter(|one| one.is_element() && tag(*one) == "attribute") {
        let guid = attribute.attribute("guid").unwrap_or("");
        let Some((_, qualifier)) = STEP_ACTIONS.iter().find(|(known, _)| guid.starts_with(known))
        else {
            continue;
        };
        let text = attribute.text().unwrap_or("").trim();
        if !text.is_empty() {
            let action = Ident::new(text, span);
            uses.push(Use { action, qualifier: *qualifier, duration: None, span });
        }
    }
    uses
}

fn condition(
    reader: &mut Reader<'_, '_>,
    pou: Node<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    unit: &mut Unit,
    always: &mut Vec<crate::st::ast::Stmt>,
) -> Option<Expr> {
    let span = reader.span(node);
    let Some(written) = child(node, "condition") else {
        reader.report(|| {
            Diagnostic::error(codes::PLC_CHART, "missing transition condition")
                .at(span, "")
                .help("add a condition; TRUE fires as soon as the preceding steps are active")
        });
        return None;
    };
    let value = if let Some(reference) = child(written, "reference") {
        let name = reader.name(reference, "name")?;
        named_condition(reader, pou, &name, unit, always)?
    } else if let Some(inline) = child(written, "inline") {
        body_condition(reader, inline, "", unit, always)?
    } else {
        network::incoming(reader, network, written, unit, always)?
    };
    if is_set(written, "negated") {
        return Some(Expr::new(ExprKind::Not(Box::new(value)), span));
    }
    Some(value)
}

/// The condition with this name: a transition of the unit or a Boolean variable.
fn named_condition(
    reader: &mut Reader<'_, '_>,
    pou: Node<'_, '_>,
    name: &Ident,
    unit: &mut Unit,
    always: &mut Vec<crate::st::ast::Stmt>,
) -> Option<Expr> {
    let found = children(pou, "transitions")
        .flat_map(|list| children(list, "transition").collect::<Vec<_>>())
        .find(|one| one.attribute("name").is_some_and(|other| Symbol::of(other) == name.id));
    match found {
        Some(transition) => {
            let body = child(transition, "body")?;
            body_condition(reader, body, &name.text, unit, always)
        }
        None => Some(Expr::name(name.clone())),
    }
}

/// The condition that a body in any language computes.
fn body_condition(
    reader: &mut Reader<'_, '_>,
    body: Node<'_, '_>,
    name: &str,
    unit: &mut Unit,
    always: &mut Vec<crate::st::ast::Stmt>,
) -> Option<Expr> {
    let inner = body.children().find(|one| one.is_element() && tag(*one) != "documentation")?;
    match tag(inner) {
        "ST" => reader.expression_in(inner, unit),
        "LD" | "FBD" => network::condition(reader, inner, name, unit, always),
        other => {
            let span = reader.span(inner);
            unit.refuse(format!("a condition in {other}"), span, "use ST, LD or FBD");
            None
        }
    }
}
