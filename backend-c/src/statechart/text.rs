//! Functions and `switch` statements.

use super::Emit;
use crate::c::print::{Kind, Node, Writer};
use crate::style_output::{mentions, without_unused};
use grafsynth_ir::program::Stmt;
use itertools::Itertools as _;
use std::collections::BTreeMap;

/// A defined function, with the data for its calls.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Function {
    name: String,
    /// Parameters that every caller has under the same name.
    common: Vec<&'static str>,
    /// The function's own parameters, in order.
    own: Vec<String>,
}

impl Function {
    /// A call from a function of the evolution. `values` maps parameters to arguments; those that the function does not have are ignored.
    pub(super) fn call(&self, values: &[(&str, &str)]) -> String {
        self.call_with("scan", values)
    }

    /// A call with another name for the data of the reaction.
    pub(super) fn call_with(&self, scan: &str, values: &[(&str, &str)]) -> String {
        let common = self.common.iter().map(|word| if *word == "scan" { scan } else { word });
        let own = self.own.iter().map(|own| {
            values.iter().find(|(name, _)| name == own).map_or(own.as_str(), |(_, value)| value)
        });
        let arguments = common.chain(own).join(", ");
        format!("{}({})", self.name, arguments)
    }
}

/// One case of a `switch`.
#[derive(Debug, Clone)]
pub(super) struct Case {
    /// The constants of the case.
    pub(super) labels: Vec<String>,
    /// The statements, without `break`.
    pub(super) body: Vec<Node>,
    /// True if it always returns.
    pub(super) returns: bool,
}

/// The maximum number of lines of a function, per transition that [`crate::Options::max_transitions`] allows.
const LINES: usize = 4;

impl Emit<'_> {
    /// Defines a function after its callees. Of the parameters `own` (type and name), it gets those that the body mentions.
    pub(super) fn define(
        &mut self,
        wanted: &str,
        result: &str,
        reads_only: bool,
        own: &[(&str, &str)],
        body: Vec<Node>,
    ) -> Function {
        let prefix = &self.names.prefix;
        let body = without_unused(body);
        let name = format!("{prefix}_{}", self.taken.name(wanted));
        let constant = if reads_only { "const " } else { "" };
        let mut parameters = Vec::new();
        let mut common = Vec::new();
        let types = [
            ("self", format!("{constant}{prefix}_t *")),
            ("in", format!("const {prefix}_in_t *")),
            ("scan", format!("{constant}{prefix}_scan_t *")),
        ];
        for (word, ty) in types {
            if mentions(&body, word) {
                parameters.push(format!("{ty}{word}"));
                common.push(word);
            }
        }
        let mut kept = Vec::new();
        for (ty, word) in own {
            if mentions(&body, word) {
                parameters.push(format!("{ty} {word}"));
                kept.push((*word).to_owned());
            }
        }
        let parameters =
            if parameters.is_empty() { "void".to_owned() } else { parameters.join(", ") };
        self.functions.push(Node::function(format!("static {result} {name}({parameters})"), body));
        self.functions.push(Node::blank());
        Function { name, common, own: kept }
    }

    /// A list of the chart. Its locals are in a separate block, because lists follow each other and follow labels.
    pub(super) fn list(&mut self, list: &[Stmt]) -> Vec<Node> {
        let nodes = self.statements.statements(list);
        if nodes.iter().all(|node| node.defines.is_none()) {
            return nodes;
        }
        vec![Node::line("{"), Kind::Nested(nodes).into(), Node::line("}")]
    }

    /// A `switch` over constants; equal bodies share a case. A `switch` that is too long for a function becomes several functions, which are called
    /// in turn.
    pub(super) fn switch(
        &mut self,
        wanted: &str,
        subject: &str,
        own: &[(&str, &str)],
        cases: Vec<Case>,
    ) -> Vec<Node> {
        let cases = merged(cases);
        let most = self.options.max_transitions.saturating_mul(LINES).max(LINES);
        if cases.iter().map(|case| lines(&case.body)).sum::<usize>() <= most {
            return switch(subject, cases);
        }
        let mut nodes = Vec::new();
        let mut part = Vec::new();
        let mut weight = 0;
        let mut parts = Vec::new();
        for case in cases {
            let own = lines(&case.body);
            if weight > 0 && weight + own > most {
                parts.push(std::mem::take(&mut part));
                weight = 0;
            }
            weight += own;
            part.push(case);
        }
        parts.push(part);
        for part in parts {
            let function = self.define(wanted, "void", false, own, switch(subject, part));
            nodes.push(Node::line(format!("{};", function.call(&[]))));
        }
        nodes
    }
}

/// Merges cases with equal bodies.
pub(super) fn merged(cases: Vec<Case>) -> Vec<Case> {
    let mut at: BTreeMap<String, usize> = BTreeMap::new();
    let mut all: Vec<Case> = Vec::new();
    for case in cases {
        if case.body.is_empty() {
            continue;
        }
        let text = Writer::write(&case.body).0;
        match at.get(&text) {
            Some(index) => all[*index].labels.extend(case.labels),
            None => {
                at.insert(text, all.len());
                all.push(case);
            }
        }
    }
    all
}

/// The `switch` itself; an `if` if there is one label.
pub(super) fn switch(subject: &str, cases: Vec<Case>) -> Vec<Node> {
    match cases.as_slice() {
        [] => return Vec::new(),
        [Case { labels, body, .. }] if labels.len() == 1 => {
            let label = &labels[0];
            let is_number = label.chars().all(|c| c.is_ascii_digit());
            let suffix = if is_number { "U" } else { "" };
            return vec![Node::when(&format!("{subject} == {label}{suffix}"), body.clone())];
        }
        _ => {}
    }
    let body: Vec<Node> = cases
        .into_iter()
        .map(|case| {
            let mut inner = case.body;
            if !case.returns {
                inner.push(Node::line("break;"));
            }
            let heads = case.labels.iter().map(|label| format!("case {label}:")).collect();
            Kind::Case(heads, inner).into()
        })
        .collect();
    vec![Node::switch(subject, body)]
}

/// The lines of code in a body.
pub(super) fn lines(nodes: &[Node]) -> usize {
    nodes
        .iter()
        .map(|node| match &node.kind {
            Kind::Blank | Kind::Comment(_) => 0,
            Kind::Line(_) | Kind::Verbatim(_) | Kind::Directive(_) => 1,
            Kind::Block(arms) => arms.iter().map(|arm| 1 + lines(&arm.body)).sum(),
            Kind::Case(_, body)
            | Kind::Nested(body)
            | Kind::Function(_, body)
            | Kind::Braces(_, body, _) => 1 + lines(body),
        })
        .sum()
}

/// Replaces a text in all lines.
pub(super) fn replace(nodes: &mut [Node], old: &str, new: &str) {
    for node in nodes {
        match &mut node.kind {
            Kind::Line(text) => *text = text.replace(old, new),
            Kind::Blank | Kind::Comment(_) | Kind::Verbatim(_) | Kind::Directive(_) => {}
            Kind::Block(arms) => {
                for arm in arms {
                    arm.head = arm.head.replace(old, new);
                    replace(&mut arm.body, old, new);
                }
            }
            Kind::Case(_, body)
            | Kind::Nested(body)
            | Kind::Function(_, body)
            | Kind::Braces(_, body, _) => replace(body, old, new),
        }
    }
}
