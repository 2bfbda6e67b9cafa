//! Reads the charts of a project. In the file, each element refers to its predecessors; here these links become transitions between steps.

use grafsynth_ir::Gather;
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

/// The chart of a unit or macro-step while it is read.
struct Chart<'c, 'r, 't, 'a, 'd> {
    reader: &'c mut Reader<'r, 't>,
    pou: Node<'a, 'd>,
    unit: &'c mut Unit,
    drawing: Drawing<'a, 'd>,
    /// The diagram around the chart, which computes conditions.
    network: Network<'a, 'd>,
    sfc: Sfc,
}

/// Reads the chart of a unit or macro-step.
pub(super) fn chart<'a, 'd: 'a>(
    reader: &mut Reader<'_, '_>,
    pou: Node<'a, 'd>,
    body: Node<'a, 'd>,
    unit: &mut Unit,
) -> Sfc {
    let mut drawing = Drawing { nodes: BTreeMap::new(), order: Vec::new() };
    for node in body.children().filter(Node::is_element) {
        // Some tools omit the number of a step and give only its position.
        if let Some(id) = node.attribute("localId") {
            drawing.nodes.entry(id.to_owned()).or_insert(node);
        }
        drawing.order.push(node);
    }
    let (network, sfc) = (Network::of(body), Sfc::default());
    let mut chart = Chart { reader, pou, unit, drawing, network, sfc };
    let uses = chart.uses();
    let transitions = chart.transitions();
    chart.elements(body, uses, transitions);
    chart.report_unused();
    chart.sfc
}

impl<'a, 'd: 'a> Chart<'_, '_, '_, 'a, 'd> {
    /// The elements with one of these names, in the order of the file.
    fn all(&self, names: &[&str]) -> Vec<Node<'a, 'd>> {
        self.drawing.order.iter().copied().filter(|node| names.contains(&tag(*node))).collect()
    }

    /// The targets of each transition, by its number, and the steps with a wire that bypasses the transition after them.
    fn targets(&mut self) -> (BTreeMap<String, Vec<Ident>>, BTreeSet<&'a str>) {
        let mut leads_to: BTreeMap<String, Vec<Ident>> = BTreeMap::new();
        let mut miswired = BTreeSet::new();
        for node in self.all(&["step", "macroStep", "jumpStep"]) {
            let attribute = if is_step(node) { "name" } else { "targetName" };
            let Some(target) = self.reader.name(node, attribute) else {
                let span = self.reader.span(node);
                self.reader.report(|| {
                    Diagnostic::error(codes::PLC_CHART, format!("<{}> without a name", tag(node)))
                        .at(span, "")
                        .help("give it the name of the step that it leads to: name=\"..\" of a <step>, targetName=\"..\" of a <jumpStep>")
                });
                continue;
            };
            for transition in feeders(&self.drawing, node) {
                leads_to.entry(transition).or_default().push(target.clone());
            }
            for step in self.drawing.before(node).into_iter().filter(|one| is_step(*one)) {
                let from = step.attribute("name").unwrap_or("?");
                let (step_span, to) = (self.reader.span(step), &target.text);
                let mut wires = node.descendants().filter(|one| one.is_element());
                let wire = wires.find(|one| tag(*one) == "connection").unwrap_or(node);
                let place = self.reader.span(wire);
                miswired.insert(from);
                self.reader.report(|| {
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
        (leads_to, miswired)
    }

    /// The transitions by the ids of their XML nodes. Competing transitions are exchanged so that they are sorted from left to right.
    fn transitions(&mut self) -> BTreeMap<usize, Transition> {
        let (leads_to, miswired) = self.targets();
        let mut transitions: Vec<(Node<'a, 'd>, Transition)> = Vec::new();
        for node in self.all(&["transition"]) {
            let span = self.reader.span(node);
            let from = sources(self.reader, &self.drawing, node);
            let is_bypassed = from.iter().any(|step| miswired.contains(step.text.as_str()));
            let to = node.attribute("localId").and_then(|id| leads_to.get(id).cloned());
            let to = to.unwrap_or_default();
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
                self.reader.report(|| {
                    let message = format!("this transition has no step {side} it");
                    Diagnostic::error(codes::PLC_CHART, message).at(span, "").help(help)
                });
                continue;
            }
            let condition = self.condition(node);
            let priority = priority(self.reader, node);
            let Some(condition) = condition else { continue };
            let label = documentation(node);
            let restart = label.contains(RESTART);
            let label = label.replace(RESTART, "").trim().to_owned();
            let name = transition_name(self.reader, node);
            let transition =
                Transition { name, from, to, priority, restart, condition, label, span };
            transitions.push((node, transition));
        }
        left_to_right(&self.drawing, &mut transitions);
        transitions
            .into_iter()
            .map(|(node, transition)| (node.id().get_usize(), transition))
            .gather()
    }

    /// Adds the steps, macro-steps and transitions in the order of the file.
    fn elements(
        &mut self,
        body: Node<'a, 'd>,
        uses: BTreeMap<&'a str, Vec<Use>>,
        mut transitions: BTreeMap<usize, Transition>,
    ) {
        let roles = roles(&self.drawing, body);
        for node in self.drawing.order.clone() {
            if let Some(transition) = transitions.remove(&node.id().get_usize()) {
                self.sfc.elements.push(Element::Transition(transition));
            }
            if !is_step(node) {
                continue;
            }
            let Some(name) = self.reader.name(node, "name") else { continue };
            let span = self.reader.span(node);
            let role = roles.get(&name.text).copied().unwrap_or_default();
            if tag(node) == "step" {
                let id = node.attribute("localId").unwrap_or("");
                let mut uses = uses.get(id).cloned().unwrap_or_default();
                uses.extend(step_actions(self.reader, node));
                let (is_initial, label) = (is_set(node, "initialStep"), documentation(node));
                let step = Step { name, is_initial, uses, label, role, span };
                self.sfc.elements.push(Element::Step(step));
                continue;
            }
            match child(node, "body").and_then(|body| child(body, "SFC")) {
                Some(inner) if node.ancestors().count() < 64 => {
                    let inner = chart(self.reader, self.pou, inner, self.unit);
                    self.sfc.actions.extend(inner.actions);
                    self.sfc.always.extend(inner.always);
                    let step = MacroStep { name, body: inner.elements, role, span };
                    self.sfc.elements.push(Element::Macro(step));
                }
                Some(_) | None => {
                    let what = "a macro-step without a chart in it";
                    self.unit.refuse(what, span, "draw its chart inside it");
                }
            }
        }
    }

    /// Reports elements with an effect that no condition uses.
    fn report_unused(&mut self) {
        for node in &self.drawing.order {
            if !network::is_sink(*node) || self.network.is_called(*node) {
                continue;
            }
            let (span, what) = (self.reader.span(*node), tag(*node));
            self.reader.report(|| {
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("<{what}> on the page of a chart is ignored: no condition uses it"),
                )
                .at(span, "")
                .help("move it into an action")
            });
        }
    }

    /// The actions of each step, by the number of the step.
    fn uses(&mut self) -> BTreeMap<&'a str, Vec<Use>> {
        let mut found: BTreeMap<&'a str, Vec<Use>> = BTreeMap::new();
        for block in self.all(&["actionBlock"]) {
            let mut steps = self.drawing.before(block);
            steps.retain(|node| tag(*node) == "step");
            let owner = steps.first().and_then(|step| step.attribute("name")).unwrap_or("action");
            if steps.is_empty() {
                let span = self.reader.span(block);
                self.reader.report(|| {
                    let message = "this action block is connected to no step";
                    let finding = Diagnostic::error(codes::PLC_CHART, message).at(span, "");
                    finding.help("connect it to a step")
                });
            }
            for action in children(block, "action") {
                let Some(one) = self.action_use(action, owner) else { continue };
                for step in &steps {
                    let id = step.attribute("localId").unwrap_or("");
                    found.entry(id).or_default().push(one.clone());
                }
            }
        }
        found
    }

    fn action_use(&mut self, node: Node<'a, 'd>, owner: &str) -> Option<Use> {
        let span = self.reader.span(node);
        let written = node.attribute("qualifier").unwrap_or("N");
        let Some(qualifier) = qualifier(written) else {
            self.reader.report(|| {
                Diagnostic::error(codes::PLC_CHART, format!("unknown qualifier `{written}`"))
                    .at(span, "")
                    .help(format!("write {}", Qualifier::known()))
            });
            return None;
        };
        let action = match (child(node, "reference"), child(node, "inline")) {
            (Some(reference), _) => self.reader.name(reference, "name"),
            (None, Some(inline)) => Some(self.inline_action(inline, owner, span)),
            (None, None) => None,
        };
        let Some(action) = action else {
            let help = "add a <reference> to a variable or an action";
            self.unit.mistake(codes::PLC_CHART, "an action has no name", span, help);
            return None;
        };
        if node.attribute("indicator").is_some_and(|one| !one.trim().is_empty()) {
            self.reader.report(|| {
                Diagnostic::warning(codes::ST_LEFT_OUT, "the indicator variable is ignored")
                    .at(span, "has no effect")
                    .help("remove it; to see when the action runs, read its Boolean variable")
            });
        }
        let duration = time(self.reader, node, span);
        Some(Use { action, qualifier, duration, span })
    }

    /// Adds an inline action with an unused name.
    fn inline_action(&mut self, inline: Node<'a, 'd>, owner: &str, span: Span) -> Ident {
        let body = self.reader.list(inline, self.unit);
        let own = self.reader.name(inline, "name").map(|name| name.text);
        let base = own.unwrap_or_else(|| format!("{owner}_inline"));
        let mut name = Ident::new(base.as_str(), span);
        let mut n = 2;
        while self.sfc.actions.iter().any(|one| one.name.id == name.id) {
            name = Ident::new(format!("{base}_{n}"), span);
            n += 1;
        }
        let action = Action { name: name.clone(), body, label: String::new(), span };
        self.sfc.actions.push(action);
        name
    }

    /// The condition of a transition.
    fn condition(&mut self, node: Node<'a, 'd>) -> Option<Expr> {
        let span = self.reader.span(node);
        let Some(written) = child(node, "condition") else {
            self.reader.report(|| {
                Diagnostic::error(codes::PLC_CHART, "missing transition condition")
                    .at(span, "")
                    .help("add a condition; TRUE fires as soon as the preceding steps are active")
            });
            return None;
        };
        let value = if let Some(reference) = child(written, "reference") {
            let name = self.reader.name(reference, "name")?;
            self.named_condition(name)?
        } else if let Some(inline) = child(written, "inline") {
            self.body_condition(inline, "")?
        } else {
            let always = &mut self.sfc.always;
            network::incoming(self.reader, &mut self.network, written, self.unit, always)?
        };
        if is_set(written, "negated") {
            return Some(Expr::new(ExprKind::Not(Box::new(value)), span));
        }
        Some(value)
    }

    /// The condition with this name: a transition of the unit or a Boolean variable.
    fn named_condition(&mut self, name: Ident) -> Option<Expr> {
        let lists = children(self.pou, "transitions");
        let found = lists
            .flat_map(|list| children(list, "transition"))
            .find(|one| one.attribute("name").is_some_and(|other| Symbol::of(other) == name.id));
        match found {
            Some(transition) => self.body_condition(child(transition, "body")?, &name.text),
            None => Some(Expr::name(name)),
        }
    }

    /// The condition that a body in any language computes.
    fn body_condition(&mut self, body: Node<'a, 'd>, name: &str) -> Option<Expr> {
        let inner = body.children().find(|one| one.is_element() && tag(*one) != "documentation")?;
        match tag(inner) {
            "ST" => self.reader.expression_in(inner, self.unit),
            "LD" | "FBD" => {
                let always = &mut self.sfc.always;
                network::condition(self.reader, inner, name, self.unit, always)
            }
            other => {
                let span = self.reader.span(inner);
                let what = format!("a condition in {other}");
                self.unit.refuse(what, span, "use ST, LD or FBD");
                None
            }
        }
    }
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
        .gather();
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
