//! Checks which elements and attributes are allowed where, and reads their texts: names, expressions, words.

use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::{Name, Span};
use itertools::Itertools as _;

use super::rules::RULES;
use super::{MAX_FURTHER, MAX_NAMES, N, REFUSED, Reader};
use crate::codes;
use crate::scxml::expr::{self, Ast, AstKind};
use crate::scxml::{GRAFSYNTH, SCXML, refuse};
use crate::xml::{self, Mapped};

/// The help text for elements and attributes that only other tools read.
const FOREIGN: &str =
    "keep them for the tool that reads them, or delete them: the chart does not depend on them";

impl<'t> Reader<'_, 't> {
    pub(super) fn report(&mut self, finding: impl Into<Box<Diagnostic>>) {
        let finding: Box<Diagnostic> = finding.into();
        self.found.report(|| *finding);
    }

    pub(super) fn tag(&self, node: N<'_, 't>) -> Span {
        xml::tag_span(self.file, node)
    }

    pub(super) fn namespace(&mut self, root: N<'_, 't>) {
        let span = self.tag(root);
        let declared = root.tag_name().namespace();
        let finding = match declared {
            Some(other) => Diagnostic::error(
                codes::SCXML_NAMESPACE,
                format!("wrong namespace {other}; expected that of SCXML"),
            ),
            None => Diagnostic::warning(
                codes::SCXML_NAMESPACE,
                "the document has no namespace; it is read as SCXML",
            ),
        };
        self.report(
            finding.at(span, "").help(format!("write <scxml xmlns=\"{SCXML}\" version=\"1.0\">")),
        );
    }

    /// Whether an element belongs to SCXML: it is in its namespace, or the document has no namespace.
    pub(super) fn is_ours(&self, node: N<'_, 't>) -> bool {
        let root = node.document().root_element().tag_name().namespace();
        node.tag_name().namespace() == root
    }

    /// The SCXML children that are allowed here; reports others.
    pub(super) fn children<'a>(&mut self, node: N<'a, 't>) -> Vec<N<'a, 't>> {
        let name = node.tag_name().name();
        let allowed =
            RULES.iter().find(|rule| rule.name == name).map_or(&[][..], |rule| rule.children);
        let mut kept = Vec::new();
        let mut text_reported = false;
        for child in node.children() {
            if child.is_text() {
                let stray = child.text().is_some_and(|text| !text.trim().is_empty());
                // Text between tags is only allowed as the value of `<data>` or `<assign>`.
                if stray && !text_reported && !matches!(name, "data" | "assign") {
                    text_reported = true;
                    let span = xml::node_span(self.file, child);
                    self.report(
                        Diagnostic::error(
                            codes::SCXML_ELEMENT,
                            format!("unexpected text in <{name}>"),
                        )
                        .at(span, "no text is allowed here")
                        .help("delete it, or write it as a comment: <!-- .. -->"),
                    );
                }
                continue;
            }
            if !child.is_element() {
                continue;
            }
            let tag = child.tag_name().name();
            if !self.is_ours(child) {
                self.foreign_element(child, node);
                continue;
            }
            if !allowed.contains(&tag) {
                self.misplaced(child, node, allowed);
                continue;
            }
            if let Some((what, help)) = REFUSED.iter().find(|(refused, _)| *refused == tag) {
                let span = self.tag(child);
                self.report(refuse(span, &format!("<{what}>"), help));
                continue;
            }
            self.attributes(child);
            kept.push(child);
        }
        kept
    }

    pub(super) fn misplaced(&mut self, child: N<'_, 't>, around: N<'_, 't>, allowed: &[&str]) {
        let tag = child.tag_name().name();
        let span = self.tag(child);
        let parent = around.tag_name().name();
        if matches!(parent, "else" | "elseif") {
            // Reported once, at the branch: its other children are in the wrong place for the same reason.
            if child.prev_sibling_element().is_none() {
                self.branch_with_body(around, span);
            }
            return;
        }
        if let Some((what, help)) = REFUSED.iter().find(|(refused, _)| *refused == tag) {
            self.report(refuse(span, &format!("<{what}>"), help));
            return;
        }
        let is_known = RULES.iter().any(|rule| rule.name == tag);
        let message = if is_known {
            format!("<{tag}> is not allowed in <{parent}>")
        } else {
            format!("unknown SCXML element <{tag}>")
        };
        let mut finding = Diagnostic::error(codes::SCXML_ELEMENT, message).at(span, "");
        if let Some(near) = nearest(tag, allowed.iter().copied()).filter(|_| !is_known) {
            finding = finding.help(format!("did you mean <{near}>?"));
        } else {
            let homes: Vec<String> = RULES
                .iter()
                .filter(|rule| rule.children.contains(&tag))
                .map(|rule| format!("<{}>", rule.name))
                .collect();
            let can = if allowed.is_empty() {
                format!("<{parent}> has no child elements")
            } else {
                format!("<{parent}> can contain {}", allowed.join(", "))
            };
            finding = finding.help(if homes.is_empty() {
                format!("{can}; remove it")
            } else {
                format!("{can}; move <{tag}> into {}", homes.join(" or "))
            });
        }
        self.report(finding);
    }

    /// Reports a branch of <if> that encloses its statements; the fix ends the branch element before them.
    fn branch_with_body(&mut self, branch: N<'_, 't>, first: Span) {
        let name = branch.tag_name().name();
        let tag = self.tag(branch);
        let mut finding =
            Diagnostic::error(codes::SCXML_ELEMENT, format!("<{name}> must be empty"))
                .at(tag, "only a mark between two branches")
                .at(first, format!("belongs after <{name}/>"));
        let whole = branch.range();
        let text = self.source.get(whole.clone()).unwrap_or_default();
        let tag_text = self.source.get(tag.range()).unwrap_or_default();
        let help = format!(
            "write <{name}/> as an empty element; its branch follows it, up to the next <elseif/>, <else/> or </if>"
        );
        finding = finding.help(help);
        if let Some(opened) = tag_text.strip_suffix('>')
            && let Some(inside) =
                text.strip_prefix(tag_text).and_then(|rest| rest.rsplit_once("</"))
        {
            let (inside, _) = inside;
            finding = finding.fix(
                Span::new(self.file, whole.start, whole.end),
                format!("{}/>{}", opened.trim_end(), inside.trim_end()),
            );
        }
        self.report(finding);
    }

    /// Handles an element of another namespace: ignored, unless it would have an effect.
    pub(super) fn foreign_element(&mut self, child: N<'_, 't>, parent: N<'_, 't>) {
        let tag = child.tag_name();
        let span = self.tag(child);
        let space = tag.namespace().unwrap_or_default();
        let does_something = matches!(
            parent.tag_name().name(),
            "onentry" | "onexit" | "transition" | "if" | "foreach"
        );
        if does_something || space == "http://www.w3.org/2001/XInclude" {
            self.report(refuse(
                span,
                &format!("<{}> of {space}", tag.name()),
                "replace it by elements of SCXML",
            ));
        } else if space == GRAFSYNTH {
            self.report(
                Diagnostic::error(
                    codes::SCXML_ELEMENT,
                    format!("unknown grafsynth element <{}>", tag.name()),
                )
                .at(span, "")
                .help(
                    "remove it: grafsynth adds only attributes to SCXML, such as g:role of <data>",
                ),
            );
        } else if self.foreign.insert(space.to_owned()) {
            self.report(
                Diagnostic::warning(
                    codes::SCXML_IGNORED,
                    format!("elements and attributes of the namespace {space} are ignored"),
                )
                .at(span, "first used here")
                .help(FOREIGN),
            );
        }
    }

    /// Reports unknown attributes.
    pub(super) fn attributes(&mut self, node: N<'_, 't>) {
        let name = node.tag_name().name();
        let known =
            RULES.iter().find(|rule| rule.name == name).map_or(&[][..], |rule| rule.attributes);
        for attribute in node.attributes() {
            let span = xml::name_span(self.file, attribute);
            let word = attribute.name();
            match attribute.namespace() {
                None if known.contains(&word) => {
                    if let Some((_, help)) = REFUSED.iter().find(|(refused, _)| *refused == word) {
                        self.report(refuse(span, &format!("the attribute `{word}`"), help));
                    }
                }
                None => {
                    let mut finding = Diagnostic::error(
                        codes::SCXML_ATTRIBUTE,
                        format!("<{name}> has no attribute `{word}`"),
                    )
                    .at(span, "");
                    if let Some(near) = nearest(word, known.iter().copied()) {
                        finding = finding.help(format!("did you mean `{near}`?")).fix(span, near);
                    } else if !known.is_empty() {
                        finding = finding
                            .help(format!("write one of {}, or remove it", known.join(", ")));
                    } else {
                        finding = finding.help("remove it: this element has no attributes");
                    }
                    self.report(finding);
                }
                Some(GRAFSYNTH) => {
                    let ours: &[&str] = match name {
                        "scxml" => &["tick", "queue", "limit", "events", "input", "internal"],
                        "data" => &["range", "role", "label"],
                        "state" | "parallel" | "final" => &["label"],
                        _ => &[],
                    };
                    if !ours.contains(&word) {
                        let mut finding = Diagnostic::error(
                            codes::SCXML_ATTRIBUTE,
                            format!("unknown grafsynth attribute `{word}` of <{name}>"),
                        )
                        .at(span, "");
                        finding = if let Some(near) = nearest(word, ours.iter().copied()) {
                            finding.help(format!("did you mean `{near}`?"))
                        } else if ours.is_empty() {
                            finding.help("remove it: grafsynth adds no attribute to this element")
                        } else {
                            finding.help(format!("write one of {}, or remove it", ours.join(", ")))
                        };
                        self.report(finding);
                    }
                }
                // Attributes of XML itself, such as `xml:lang`, and of XML Schema.
                Some("http://www.w3.org/XML/1998/namespace")
                | Some("http://www.w3.org/2001/XMLSchema-instance") => {}
                Some(space) => {
                    if self.foreign.insert(space.to_owned()) {
                        self.report(
                            Diagnostic::warning(
                                codes::SCXML_IGNORED,
                                format!(
                                    "elements and attributes of the namespace {space} are ignored"
                                ),
                            )
                            .at(span, "first used here")
                            .help(FOREIGN),
                        );
                    }
                }
            }
        }
    }

    /// Reports an element with both an `expr` attribute and a text.
    pub(super) fn two_values(&mut self, node: N<'_, 't>, content: &Mapped<'_>) {
        let name = node.tag_name().name();
        self.report(
            Diagnostic::error(
                codes::SCXML_ELEMENT,
                format!("<{name}> has both an attribute expr and a text"),
            )
            .at(content.whole(), "a second value")
            .help("delete one of them"),
        );
    }

    /// The value of an attribute.
    pub(super) fn value(&self, node: N<'_, 't>, name: &str) -> Option<Mapped<'t>> {
        self.value_in(node, None, name)
    }

    pub(super) fn value_in(
        &self,
        node: N<'_, 't>,
        space: Option<&str>,
        name: &str,
    ) -> Option<Mapped<'t>> {
        node.attributes()
            .find(|attribute| attribute.name() == name && attribute.namespace() == space)
            .map(|attribute| Mapped::value(self.file, self.source, attribute))
    }

    /// The value of an attribute as one name.
    pub(super) fn name(&mut self, node: N<'_, 't>, attribute: &str) -> Option<Name> {
        let value = self.value(node, attribute)?.trimmed();
        if value.text.is_empty() || value.text.contains([' ', '\t', '\n', '\r']) {
            let tag = node.tag_name().name();
            self.report(
                Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    format!("the {attribute} of <{tag}> is not a single name: {:?}", value.text),
                )
                .at(value.whole(), "expected one name")
                .help(match value.words().map(|(word, _)| word).join("_") {
                    joined if joined.is_empty() => {
                        format!("write a name, as in {attribute}=\"name\", or remove the attribute")
                    }
                    joined => {
                        format!("write it without spaces, as in {attribute}=\"{joined}\"")
                    }
                }),
            );
            return None;
        }
        Some(Name::new(value.text.as_ref(), value.whole()))
    }

    /// Like [`Reader::name`], for a required attribute.
    pub(super) fn needed_name(&mut self, node: N<'_, 't>, attribute: &str) -> Option<Name> {
        if self.value(node, attribute).is_none() {
            self.missing(node, attribute);
        }
        self.name(node, attribute)
    }

    pub(super) fn missing(&mut self, node: N<'_, 't>, attribute: &str) {
        let tag = node.tag_name().name();
        let span = self.tag(node);
        self.report(
            Diagnostic::error(
                codes::SCXML_ATTRIBUTE,
                format!("<{tag}> needs the attribute `{attribute}`"),
            )
            .at(span, format!("no `{attribute}`"))
            .help(format!(
                "add it, as in <{tag} {attribute}=\"{}\">",
                match attribute {
                    "expr" => "0",
                    "cond" => "n == 0",
                    _ => "name",
                }
            )),
        );
    }

    /// The value of an attribute as a blank-separated list of names.
    pub(super) fn names(&mut self, node: N<'_, 't>, attribute: &str) -> Option<Vec<Name>> {
        let value = self.value(node, attribute)?;
        let names: Vec<Name> =
            value.words().take(MAX_NAMES + 1).map(|(word, span)| Name::new(word, span)).collect();
        if names.len() > MAX_NAMES {
            self.report(
                Diagnostic::error(
                    codes::SCXML_SIZE,
                    format!("the attribute {attribute} contains more than {MAX_NAMES} names"),
                )
                .at(self.tag(node), "")
                .help("write several transitions"),
            );
            return Some(Vec::new());
        }
        let before = self.n_further;
        self.n_further += names.len().saturating_sub(1);
        if self.n_further > MAX_FURTHER {
            if before <= MAX_FURTHER {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_SIZE,
                        format!("the name lists of the document contain more than {MAX_FURTHER} names"),
                    )
                    .at(self.tag(node), "the limit is reached here")
                    .help(
                        "give the events a common prefix, as in `key.a` and `key.b`, and use the prefix",
                    ),
                );
            }
            return Some(Vec::new());
        }
        Some(names)
    }

    pub(super) fn expression(&mut self, text: &Mapped<'_>) -> Option<Ast> {
        match expr::parse(text, self.language, self.nesting) {
            Ok(ast) => Some(ast),
            Err(finding) => {
                self.report(finding);
                None
            }
        }
    }

    /// An expression that is not an array.
    pub(super) fn scalar(&mut self, text: &Mapped<'_>) -> Option<Ast> {
        let ast = self.expression(text)?;
        if matches!(ast.kind, AstKind::Array(_)) {
            self.report(refuse(
                ast.span,
                "an array as a value",
                "assign the elements one by one; arrays are allowed only in <data> and <foreach>",
            ));
            return None;
        }
        Some(ast)
    }

    pub(super) fn condition(&mut self, node: N<'_, 't>) -> Option<Ast> {
        let text = self.value(node, "cond")?;
        self.scalar(&text)
    }
}
