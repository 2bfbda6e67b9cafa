//! Checks a file against the table in `rules`: reports elements that the format does not have, and refuses those that are not supported.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::diag::{Diagnostic, nearest};
use itertools::Itertools;
use roxmltree::Node;

use super::reader::{Reader, Unit, children, tag};
use super::rules::{self, FREE, OTHERS, Rule, Times, Value};
use super::sfc;
use crate::codes;
use crate::graf::settings::one_of;
use crate::xml::{self, Mapped};

/// The name of an elementary type that was wrongly written as the text of `type` or `baseType` instead of as an element.
pub(super) fn type_name<'n>(node: Node<'n, '_>) -> Option<&'n str> {
    if !matches!(tag(node), "type" | "baseType" | "returnType")
        || node.children().any(|child| child.is_element())
    {
        return None;
    }
    let text = node.text()?.trim();
    let is_name = !text.is_empty()
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        && !text.as_bytes()[0].is_ascii_digit();
    is_name.then_some(text)
}

impl Reader<'_, '_> {
    /// Checks an element and its contents, except units, which are checked when they are read.
    pub(super) fn check(&mut self, node: Node<'_, '_>, kind: &str, unit: &mut Unit) {
        let Some(rule) = rules::of(kind) else { return };
        self.check_attributes(node, rule, unit);
        if matches!(kind, "FBD" | "LD" | "SFC") {
            self.check_keys(node);
        }
        self.check_block(node, kind, unit);
        let mut seen = BTreeSet::new();
        let mut chosen: Option<&str> = None;
        let mut is_text_reported = rule.text;
        for child in node.children() {
            if child.is_text()
                && !is_text_reported
                && child.text().is_some_and(|text| !text.trim().is_empty())
            {
                is_text_reported = true;
                self.report_text(node, child);
            }
            if !child.is_element() || matches!(tag(child), "addData" | "documentation") {
                continue;
            }
            let (name, parent) = (tag(child), tag(node));
            let known = rule.children.iter().copied().flatten();
            let found = known.copied().find(|(one, ..)| *one == name || *one == OTHERS);
            let Some((_, kind, times)) = found else {
                self.misplaced(child, node, rule);
                continue;
            };
            let second = match times {
                Times::Many | Times::NotRead(_) => None,
                Times::One | Times::First if seen.insert(name) => None,
                Times::One | Times::First => Some(format!("a second <{name}> in <{parent}>")),
                Times::Either => match chosen.replace(name) {
                    None => None,
                    Some(first) if first == name => {
                        Some(format!("a second <{name}> in <{parent}>"))
                    }
                    Some(first) => Some(format!(
                        "<{name}> next to <{first}> in <{parent}>, which accepts only one of them"
                    )),
                },
            };
            let span = self.span(child);
            match (second, times) {
                (Some(what), Times::First) => {
                    unit.refuse(what, span, "combine the two, or make one of them a separate unit");
                }
                (Some(what), _) => self.report(|| {
                    Diagnostic::error(codes::PLC_MARKUP, what).at(span, "").help(match name {
                        "connectionPointIn" => "move its <connection> elements into the first one",
                        _ => "delete one of them",
                    })
                }),
                // An empty element has no meaning.
                (None, Times::NotRead(_)) if kind == FREE && is_blank(child) => {}
                (None, Times::NotRead(help)) => {
                    unit.refuse(format!("<{name}> in <{parent}>"), span, help);
                }
                (None, _) if name == "pou" => {}
                (None, _) => self.check(child, kind, unit),
            }
        }
    }

    /// Refuses blocks whose meaning is in the tool that drew them.
    fn check_block(&mut self, node: Node<'_, '_>, kind: &str, unit: &mut Unit) {
        if kind == "vendorElement"
            && node.descendants().any(|one| matches!(tag(one), "connection" | "expression"))
        {
            unit.refuse(
                "a connected <vendorElement>",
                self.span(node),
                "express its function with standard elements",
            );
        }
        // CODESYS and TwinCAT draw calls of programs and actions, and statements, as blocks.
        let calls = node.descendants().filter(|one| kind == "block" && tag(*one) == "CallType");
        for call in calls.filter_map(|one| one.text()).map(str::trim) {
            if !matches!(call, "operator" | "function" | "functionblock") {
                let help = "move its content to an action or a function block";
                unit.refuse(format!("a block with the call type `{call}`"), self.span(node), help);
            }
        }
    }

    /// Reports text in an element that has none.
    fn report_text(&mut self, node: Node<'_, '_>, text: Node<'_, '_>) {
        let (span, name) = (xml::node_span(self.file, text), tag(node).to_owned());
        let ty = type_name(node).map(str::to_owned);
        self.report(|| {
            let finding =
                Diagnostic::error(codes::PLC_MARKUP, format!("unexpected text in <{name}>"));
            match ty {
                Some(ty) => finding
                    .at(span, "a type is an element, not text")
                    .help(format!("write <{name}><{ty}/></{name}>"))
                    .fix(span, format!("<{ty}/>")),
                None => finding
                    .at(span, "no text is allowed here")
                    .help("delete it, or write it as a comment"),
            }
        });
    }

    fn misplaced(&mut self, child: Node<'_, '_>, parent: Node<'_, '_>, rule: &Rule) {
        let (name, span) = (tag(child), self.span(child));
        let mut all = rules::RULES.iter().flat_map(|rule| rule.children).copied().flatten();
        let is_known = all.any(|(one, ..)| *one == name);
        let allowed = rule.children.iter().copied().flatten().map(|(one, ..)| *one);
        let near = nearest(name, allowed).filter(|_| !is_known);
        let everywhere =
            || rules::RULES.iter().flat_map(|rule| rule.children).copied().flatten().copied();
        let meant =
            if is_known { Some(name) } else { nearest(name, everywhere().map(|(one, ..)| one)) };
        // The help suggests no move if the element may be in several others.
        let homes = meant.and_then(|meant| {
            let mut kinds = rules::RULES.iter().filter(|rule| {
                rule.children.iter().copied().flatten().any(|(one, ..)| *one == meant)
            });
            let kind = kinds.next().filter(|_| kinds.next().is_none())?.kind;
            let mut homes: Vec<&str> =
                everywhere().filter(|(_, of, _)| *of == kind).map(|(home, ..)| home).collect();
            homes.sort_unstable();
            homes.dedup();
            let [home] = homes.as_slice() else { return None };
            Some((meant, *home))
        });
        self.report(|| {
            let message = if is_known {
                format!("<{name}> is not allowed in <{}>", tag(parent))
            } else {
                format!("unknown PLCopen element <{name}> in <{}>", tag(parent))
            };
            let help = match (near, homes) {
                (Some(near), _) => format!("did you mean <{near}>?"),
                (None, Some((meant, home))) if meant == name => format!("move it into <{home}>"),
                (None, Some((meant, home))) => format!("did you mean <{meant}> in <{home}>?"),
                (None, None) => {
                    "delete it, or move it into <addData>, which is for the data of tools"
                        .to_owned()
                }
            };
            Diagnostic::error(codes::PLC_MARKUP, message).at(span, "").help(help)
        });
    }

    fn check_attributes(&mut self, node: Node<'_, '_>, rule: &Rule, unit: &mut Unit) {
        let name = tag(node);
        // Attributes with a namespace belong to XML itself or to a tool.
        for attribute in node.attributes().filter(|one| one.namespace().is_none()) {
            let (word, value) = (attribute.name(), attribute.value());
            let span = xml::name_span(self.file, attribute);
            let known = || rule.attributes.iter().copied().flatten().copied();
            let Some((_, allowed)) = known().find(|(one, _)| *one == word) else {
                let near = nearest(word, known().map(|(one, _)| one));
                self.report(|| {
                    let finding = Diagnostic::error(
                        codes::PLC_MARKUP,
                        format!("<{name}> has no attribute `{word}`"),
                    )
                    .at(span, "");
                    finding.near(span, near, "delete it")
                });
                continue;
            };
            let (expected, n_read, place) = match allowed {
                Value::Any => continue,
                Value::Boolean | Value::False => {
                    const TRUTH: &[&str] = &["false", "0", "true", "1"];
                    let n_read = if matches!(allowed, Value::False) { 2 } else { 4 };
                    (TRUTH, n_read, TRUTH.iter().position(|one| *one == value.trim()))
                }
                Value::Word(words, n_read) => {
                    (words, n_read, words.iter().position(|one| *one == value))
                }
            };
            match place {
                Some(place) if place >= n_read => {
                    let help = match word {
                        "negated" => {
                            "remove it; to negate a value, use a negated <contact> or <inVariable>, or write NOT in an expression"
                        }
                        "storage" => "remove it, and store the value with a <coil>",
                        "edge" => {
                            "remove it, and read the edge with a <contact>, or with R_TRIG or F_TRIG"
                        }
                        _ => "remove it",
                    };
                    unit.refuse(format!("{word}=\"{value}\" of <{name}>"), span, help);
                }
                None if !value.is_empty() => {
                    let near = nearest(value, expected.iter().copied());
                    let lower = value.to_ascii_lowercase();
                    let near = expected
                        .iter()
                        .copied()
                        .find(|one| *one == lower)
                        .or_else(|| synonym(word, &lower))
                        .or(near);
                    let place = Mapped::value(self.file, self.text, attribute).whole();
                    self.report(|| {
                        let finding = Diagnostic::error(
                            codes::PLC_MARKUP,
                            format!(
                                "invalid value `{value}` of the attribute `{word}` of <{name}>"
                            ),
                        )
                        .at(span, format!("expected {}", one_of(expected.iter().copied())));
                        match near {
                            Some(near) => {
                                finding.help(format!("did you mean `{near}`?")).fix(place, near)
                            }
                            None if word == "edge" => finding.help("write edge=\"rising\" or edge=\"falling\"; for both edges draw two contacts in parallel"),
                            None => {
                                let others = expected[1..]
                                    .iter()
                                    .map(|one| format!("{word}=\"{one}\"")).join(" or ");
                                finding.help(format!("write {others}, or remove it"))
                            }
                        }
                    });
                }
                Some(_) | None => {}
            }
        }
    }

    /// Checks the keys of connections: the number of each element and the name of each connector must be unique, and the wires of charts
    /// must begin at an existing element.
    fn check_keys(&mut self, picture: Node<'_, '_>) {
        let mut seen: BTreeMap<(&str, &str), Node<'_, '_>> = BTreeMap::new();
        for node in picture.children().filter(Node::is_element) {
            let id = node.attribute("localId").map(|id| ("localId", id));
            let name = node.attribute("name").filter(|_| tag(node) == "connector");
            for key in id.into_iter().chain(name.map(|name| ("name", name))) {
                let Some(first) = seen.insert(key, node) else { continue };
                let (first, span) = (self.span(first), self.span(node));
                self.report(|| {
                    Diagnostic::error(
                        codes::PLC_CHART,
                        format!("two elements have the {} {}", key.0, key.1),
                    )
                    .at(span, "second element")
                    .at(first, "first element")
                    .help("give each element its own number: connections refer to it")
                });
            }
        }
        let mut ids: Vec<&str> =
            seen.keys().filter(|(key, _)| *key == "localId").map(|(_, id)| *id).collect();
        ids.sort_unstable_by_key(|id| (id.len(), *id));
        if ids.len() > 12 {
            ids.truncate(12);
            ids.push("..");
        }
        // Only the wires of charts are checked here: in other networks every wire is followed, and a missing element is reported then.
        for node in picture.children().filter(|one| sfc::is_part(*one)) {
            let points = children(node, "connectionPointIn");
            for wire in points.flat_map(|point| children(point, "connection")) {
                let id = wire.attribute("refLocalId").unwrap_or("");
                if !seen.contains_key(&("localId", id)) {
                    let span = self.span(wire);
                    let own = node.attribute("localId");
                    let others = ids.iter().filter(|id| Some(**id) != own).join(", ");
                    self.report(|| {
                        Diagnostic::error(
                            codes::PLC_CHART,
                            format!("connection from unknown element {id}"),
                        )
                        .at(span, format!("in this <{}>", tag(node)))
                        .help(format!("write the localId of another element: {others}"))
                    });
                }
            }
        }
    }
}

/// The value that the format has for a word that other tools write in this attribute.
fn synonym(attribute: &str, value: &str) -> Option<&'static str> {
    match (attribute, value) {
        ("storage", "latch" | "s") => Some("set"),
        ("storage", "unlatch" | "r") => Some("reset"),
        ("edge", "positive" | "rise" | "p") => Some("rising"),
        ("edge", "negative" | "fall" | "n") => Some("falling"),
        _ => None,
    }
}

/// Whether an element is empty.
fn is_blank(node: Node<'_, '_>) -> bool {
    node.children().all(|one| {
        !one.is_element() && one.text().is_none_or(|text| !one.is_text() || text.trim().is_empty())
    })
}
