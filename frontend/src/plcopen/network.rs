//! Translates ladders and function block diagrams to statements: the inputs of each coil, variable and block, in the order of execution.
//!
//! A block with an instance is called once per scan, before the elements that read it. A wire back to an earlier block has the value of the
//! previous scan, as in the editors of such diagrams.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Span;
use roxmltree::Node;

use super::reader::{Reader, Unit, child, children, constant, is_set, tag};
use crate::codes;
use crate::st::ast::{Arg, Expr, ExprKind, Stmt, StmtKind};
use crate::st::symbol::{Ident, Symbol, spells};

/// The elements of a network by their numbers.
pub(super) struct Network<'a, 'd> {
    nodes: BTreeMap<String, Node<'a, 'd>>,
    order: Vec<Node<'a, 'd>>,
    /// Connectors by name.
    connectors: BTreeMap<String, Node<'a, 'd>>,
    /// Blocks whose calls are already in the list or are being built.
    called: BTreeSet<String>,
    open: BTreeSet<String>,
    /// The remaining budget: an element with several outgoing wires is read once per wire, so branches that meet repeatedly would double
    /// the work each time.
    budget: usize,
}

/// The number of nesting levels that one element in a chain counts as: its stack frames are larger than those of an expression.
const LEVELS: u32 = 3;
/// The budget of a small network. A larger text adds to it in proportion to its length.
const LEAST_BUDGET: usize = 100_000;

impl<'a, 'd: 'a> Network<'a, 'd> {
    pub(super) fn of(body: Node<'a, 'd>) -> Self {
        let mut nodes = BTreeMap::new();
        let mut order = Vec::new();
        let mut connectors = BTreeMap::new();
        for node in body.children().filter(Node::is_element) {
            if let Some(id) = node.attribute("localId") {
                nodes.entry(id.to_owned()).or_insert(node);
            }
            if tag(node) == "connector"
                && let Some(name) = node.attribute("name")
            {
                connectors.insert(name.to_owned(), node);
            }
            order.push(node);
        }
        Network {
            nodes,
            order,
            connectors,
            called: BTreeSet::new(),
            open: BTreeSet::new(),
            budget: LEAST_BUDGET + body.range().len() / 16,
        }
    }

    /// Enters an element. Refuses an element that is already being read: a loop of wires would never end.
    fn enter(&mut self, node: Node<'_, '_>, span: Span, unit: &mut Unit) -> Option<()> {
        let id = node.attribute("localId").unwrap_or("").to_owned();
        if self.open.insert(id) {
            return Some(());
        }
        unit.refuse("a loop of wires", span, "break the loop with a variable");
        None
    }

    fn leave(&mut self, node: Node<'_, '_>) {
        self.open.remove(node.attribute("localId").unwrap_or(""));
    }

    /// Whether the call of a block is already in the list.
    pub(super) fn is_called(&self, node: Node<'_, '_>) -> bool {
        tag(node) == "block" && self.called.contains(node.attribute("localId").unwrap_or(""))
    }

    /// The element with this number.
    pub(super) fn node(&self, id: &str) -> Option<Node<'a, 'd>> {
        self.nodes.get(id).copied()
    }
}

fn position(node: Node<'_, '_>) -> (i64, i64) {
    let part = |name: &str| {
        child(node, "position")
            .and_then(|one| one.attribute(name)?.trim().parse::<f64>().ok())
            .map_or(0, |value| {
                #[expect(clippy::cast_possible_truncation, reason = "a position on a page")]
                let whole = value as i64;
                whole
            })
    };
    (part("y"), part("x"))
}

/// The statements of a body in LD or FBD.
pub(super) fn statements(
    reader: &mut Reader<'_, '_>,
    body: Node<'_, '_>,
    unit: &mut Unit,
) -> Vec<Stmt> {
    let mut network = Network::of(body);
    let mut list = Vec::new();
    let mut sinks: Vec<Node<'_, '_>> = network.order.clone();
    sinks.retain(|node| is_sink(*node));
    // The execution order given by the designer precedes the position on the page, rows before columns.
    sinks.sort_by_key(|node| {
        let number: i64 =
            node.attribute("executionOrderId").and_then(|one| one.parse().ok()).unwrap_or(0);
        (number <= 0, number, position(*node))
    });
    for node in sinks {
        sink(reader, &mut network, node, unit, &mut list);
    }
    list
}

/// Whether a block has an instance, which is called; other blocks are functions.
fn has_instance(node: Node<'_, '_>) -> bool {
    node.attribute("instanceName").is_some_and(|name| !name.trim().is_empty())
}

/// Whether an element has an effect even if nothing reads it.
pub(super) fn is_sink(node: Node<'_, '_>) -> bool {
    match tag(node) {
        "coil" | "outVariable" => true,
        "inOutVariable" => child(node, "connectionPointIn")
            .is_some_and(|point| child(point, "connection").is_some()),
        "block" => has_instance(node) || written_outputs(node).next().is_some(),
        _ => false,
    }
}

fn sink(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) {
    let span = reader.span(node);
    match tag(node) {
        "block" if has_instance(node) => call(reader, network, node, unit, list),
        "block" => write_outputs(reader, network, node, unit, list),
        "coil" => {
            let Some(mut value) = incoming(reader, network, node, unit, list) else { return };
            let Some(target) =
                child(node, "variable").and_then(|one| reader.expression_in(one, unit))
            else {
                return;
            };
            value = with_edge(reader, node, "edge", value, unit, list);
            value = negated(value, is_set(node, "negated"), span);
            list.push(stored(node.attribute("storage"), target, value, span));
        }
        "outVariable" | "inOutVariable" => {
            if child(node, "connectionPointIn")
                .is_none_or(|point| child(point, "connection").is_none())
            {
                return;
            }
            let Some(mut value) = incoming(reader, network, node, unit, list) else { return };
            let Some(target) =
                child(node, "expression").and_then(|one| reader.expression_in(one, unit))
            else {
                return;
            };
            let [negated, edge, storage] = match tag(node) {
                "inOutVariable" => ["negatedIn", "edgeIn", "storageIn"],
                _ => ["negated", "edge", "storage"],
            };
            value = with_edge(reader, node, edge, value, unit, list);
            value = self::negated(value, is_set(node, negated), span);
            list.push(stored(node.attribute(storage), target, value, span));
        }
        _ => {}
    }
}

/// The statement of a coil or variable with its input value: an assignment, a set or a reset.
fn stored(storage: Option<&str>, target: Expr, value: Expr, span: Span) -> Stmt {
    let is_set = match storage {
        Some("set") => true,
        Some("reset") => false,
        Some(_) | None => return Stmt { kind: StmtKind::Assign { target, value }, span },
    };
    let assign = StmtKind::Assign { target, value: constant(is_set, span) };
    let arms = vec![(value, vec![Stmt { kind: assign, span }])];
    Stmt { kind: StmtKind::If { arms, otherwise: Vec::new() }, span }
}

fn negated(value: Expr, is_negated: bool, span: Span) -> Expr {
    if is_negated { Expr::new(ExprKind::Not(Box::new(value)), span) } else { value }
}

/// The edge of a value, detected by a new instance.
fn with_edge(
    reader: &mut Reader<'_, '_>,
    node: Node<'_, '_>,
    attribute: &str,
    value: Expr,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Expr {
    let is_rising = match node.attribute(attribute) {
        Some("rising") => true,
        Some("falling") => false,
        Some(_) | None => return value,
    };
    let span = reader.span(node);
    let base = value.root().map_or_else(|| "edge".to_owned(), |root| root.text.clone());
    let name = unit.edge(&base, is_rising, span);
    let argument =
        Arg { name: Some(Ident::new("CLK", span)), value, is_output: false, is_negated: false };
    let target = Expr::name(name);
    let kind = StmtKind::Call { target: target.clone(), arguments: vec![argument] };
    list.push(Stmt { kind, span });
    Expr::new(ExprKind::Field(Box::new(target), Ident::new("Q", span)), span)
}

/// The input of an element: the OR of its wires; `None` if a part of it could not be read.
pub(super) fn incoming(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Option<Expr> {
    let span = reader.span(node);
    let Some(point) = child(node, "connectionPointIn") else {
        unit.mistake(codes::PLC_CHART, "this element is not connected", span, "connect it");
        return None;
    };
    let mut all = Vec::new();
    for connection in children(point, "connection") {
        all.push(wire(reader, network, connection, unit, list)?);
    }
    match all.len() {
        0 => {
            unit.mistake(codes::PLC_CHART, "this element is not connected", span, "connect it");
            None
        }
        1 => all.pop(),
        _ => Some(Expr::new(ExprKind::Or(all), span)),
    }
}

fn wire(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    connection: Node<'_, '_>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Option<Expr> {
    let id = connection.attribute("refLocalId").unwrap_or("");
    let Some(from) = network.node(id) else {
        let (span, id) = (reader.span(connection), id.to_owned());
        unit.mistake(
            codes::PLC_CHART,
            format!("connection from unknown element {id}"),
            span,
            "connect it to an existing element",
        );
        return None;
    };
    let Some(nesting) = reader.nesting.checked_sub(LEVELS) else {
        let span = reader.span(connection);
        unit.refuse(
            "a chain of elements beyond the nesting limit",
            span,
            "split it with variables, or raise the limit with --nesting-limit",
        );
        return None;
    };
    let Some(budget) = network.budget.checked_sub(1 + from.range().len() / 64) else {
        let span = reader.span(connection);
        unit.refuse(
            "a network whose branches merge too often",
            span,
            "assign parts of it to variables",
        );
        return None;
    };
    network.budget = budget;
    // Inner expressions of the element may use the remaining levels.
    let outside = std::mem::replace(&mut reader.nesting, nesting);
    let value = output(reader, network, from, connection.attribute("formalParameter"), unit, list);
    reader.nesting = outside;
    value
}

/// The output value of an element.
fn output(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    parameter: Option<&str>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Option<Expr> {
    let span = reader.span(node);
    match tag(node) {
        "leftPowerRail" => Some(constant(true, span)),
        "contact" => {
            network.enter(node, span, unit)?;
            let before = incoming(reader, network, node, unit, list);
            network.leave(node);
            let variable =
                child(node, "variable").and_then(|one| reader.expression_in(one, unit))?;
            let value = with_edge(reader, node, "edge", variable, unit, list);
            let value = negated(value, is_set(node, "negated"), span);
            match before? {
                Expr { kind: ExprKind::Bool(true), .. } => Some(value),
                // Contacts in series become one flat list of operands.
                Expr { kind: ExprKind::And(mut all), .. } => {
                    all.push(value);
                    Some(Expr::new(ExprKind::And(all), span))
                }
                before => Some(Expr::new(ExprKind::And(vec![before, value]), span)),
            }
        }
        "coil" => {
            network.enter(node, span, unit)?;
            let value = incoming(reader, network, node, unit, list);
            network.leave(node);
            value
        }
        "inVariable" | "inOutVariable" => {
            let value =
                child(node, "expression").and_then(|one| reader.expression_in(one, unit))?;
            let [negated, edge] = match tag(node) {
                "inOutVariable" => ["negatedOut", "edgeOut"],
                _ => ["negated", "edge"],
            };
            let value = with_edge(reader, node, edge, value, unit, list);
            Some(self::negated(value, is_set(node, negated), span))
        }
        "continuation" => {
            let name = node.attribute("name").unwrap_or("");
            let Some(connector) = network.connectors.get(name).copied() else {
                unit.mistake(
                    codes::PLC_CHART,
                    format!("no connector has the name of the continuation `{name}`"),
                    span,
                    "give both the same name",
                );
                return None;
            };
            network.enter(node, span, unit)?;
            let value = incoming(reader, network, connector, unit, list);
            network.leave(node);
            value
        }
        "block" => block_output(reader, network, node, parameter, unit, list),
        other => {
            unit.refuse(
                format!("<{other}> in a network"),
                span,
                "use contacts, coils, variables and blocks",
            );
            None
        }
    }
}

fn block_output(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    parameter: Option<&str>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Option<Expr> {
    let span = reader.span(node);
    let outputs = child(node, "outputVariables");
    let is_negated = outputs.is_some_and(|outputs| {
        children(outputs, "variable").any(|one| {
            is_set(one, "negated")
                && (parameter.is_none() || one.attribute("formalParameter") == parameter)
        })
    });
    let first = outputs
        .and_then(|outputs| children(outputs, "variable").next())
        .and_then(|one| one.attribute("formalParameter"));
    let value = match reader.name(node, "instanceName") {
        Some(instance) => {
            call(reader, network, node, unit, list);
            let field = parameter.filter(|one| !one.is_empty()).or(first).unwrap_or("Q");
            Expr::new(
                ExprKind::Field(Box::new(Expr::name(instance)), Ident::new(field, span)),
                span,
            )
        }
        None if parameter.is_some_and(|one| spells(one, "ENO")) => {
            unit.refuse("ENO of a function", span, "draw it without EN and ENO");
            return None;
        }
        None => {
            network.enter(node, span, unit)?;
            let arguments = arguments(reader, network, node, false, unit, list);
            network.leave(node);
            let name = reader.name(node, "typeName")?;
            Expr::new(ExprKind::Call(name, arguments?), span)
        }
    };
    Some(negated(value, is_negated, span))
}

fn arguments(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    named: bool,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Option<Vec<Arg>> {
    let mut made = Vec::new();
    let lists = ["inputVariables", "inOutVariables"];
    for variables in lists.iter().filter_map(|name| child(node, name)) {
        for variable in children(variables, "variable") {
            let is_wired = child(variable, "connectionPointIn")
                .is_some_and(|point| child(point, "connection").is_some());
            if !is_wired {
                continue;
            }
            let span = reader.span(variable);
            let mut value = incoming(reader, network, variable, unit, list)?;
            value = with_edge(reader, variable, "edge", value, unit, list);
            value = negated(value, is_set(variable, "negated"), span);
            let name = reader.name(variable, "formalParameter");
            if !named && name.as_ref().is_some_and(|name| name.id == "EN") {
                if matches!(value.kind, ExprKind::Bool(true)) {
                    continue;
                }
                unit.refuse("a function with EN", span, "draw it without EN, and use SEL");
                return None;
            }
            made.push(Arg { name, value, is_output: false, is_negated: false });
        }
    }
    // If the parameters of a function have no names, they are positional.
    if !named && made.iter().any(|one| one.name.is_none()) {
        made.iter_mut().for_each(|one| one.name = None);
    }
    Some(made)
}

/// Calls the instance of a block once.
fn call(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) {
    let span = reader.span(node);
    let id = node.attribute("localId").unwrap_or("").to_owned();
    if !network.called.insert(id) {
        return;
    }
    let Some(instance) = reader.name(node, "instanceName") else { return };
    let Some(arguments) = arguments(reader, network, node, true, unit, list) else { return };
    let kind = StmtKind::Call { target: Expr::name(instance), arguments };
    list.push(Stmt { kind, span });
    write_outputs(reader, network, node, unit, list);
}

/// The outputs of a block with a variable attached, together with that variable.
fn written_outputs<'a, 'd: 'a>(
    node: Node<'a, 'd>,
) -> impl Iterator<Item = (Node<'a, 'd>, Node<'a, 'd>)> {
    let variables = children(node, "outputVariables").flat_map(|list| children(list, "variable"));
    variables.filter_map(|variable| {
        let target = child(child(variable, "connectionPointOut")?, "expression")?;
        let is_blank = target.text().is_none_or(|text| text.trim().is_empty());
        (!is_blank).then_some((variable, target))
    })
}

/// Assigns the outputs of a block to the variables that are attached to them.
fn write_outputs(
    reader: &mut Reader<'_, '_>,
    network: &mut Network<'_, '_>,
    node: Node<'_, '_>,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) {
    let found: Vec<(Node<'_, '_>, Node<'_, '_>)> = written_outputs(node).collect();
    for (variable, target) in found {
        let span = reader.span(variable);
        let parameter = variable.attribute("formalParameter");
        let value = block_output(reader, network, node, parameter, unit, list);
        let target = reader.expression_in(target, unit);
        if let (Some(value), Some(target)) = (value, target) {
            list.push(Stmt { kind: StmtKind::Assign { target, value }, span });
        }
    }
}

/// The condition that a network computes for `name`: the value of its output variable or coil.
pub(super) fn condition(
    reader: &mut Reader<'_, '_>,
    body: Node<'_, '_>,
    name: &str,
    unit: &mut Unit,
    list: &mut Vec<Stmt>,
) -> Option<Expr> {
    let mut network = Network::of(body);
    let sinks = network.order.clone();
    let sink = sinks.iter().find(|node| {
        let written = match tag(**node) {
            "outVariable" => child(**node, "expression"),
            "coil" => child(**node, "variable"),
            _ => None,
        };
        written.and_then(|one| one.text()).is_some_and(|text| Symbol::of(text.trim()) == *name)
    });
    let span = reader.span(body);
    let Some(sink) =
        sink.or_else(|| sinks.iter().find(|node| matches!(tag(**node), "outVariable" | "coil")))
    else {
        unit.mistake(
            codes::PLC_CHART,
            "this condition has no result",
            span,
            "draw an output variable or a coil with the name of the transition",
        );
        return None;
    };
    let sink = *sink;
    let value = incoming(reader, &mut network, sink, unit, list)?;
    let value = with_edge(reader, sink, "edge", value, unit, list);
    // Other effects of the network would be lost.
    let others = sinks.iter().filter(|node| **node != sink && is_sink(**node));
    let others = others.filter(|node| !network.is_called(**node));
    for node in others {
        unit.refuse(
            "a condition with other effects",
            reader.span(*node),
            "move the other effects to an action",
        );
    }
    if matches!(sink.attribute("storage"), Some("set" | "reset")) {
        unit.refuse("a stored condition", span, "use a coil without S or R");
        return None;
    }
    Some(negated(value, is_set(sink, "negated"), span))
}
