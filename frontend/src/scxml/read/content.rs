//! Executable content: the statements of transitions, entries and exits.

use grafsynth_ir::Name;
use grafsynth_ir::diag::Diagnostic;

use super::super::expr;
use super::super::tree::{Act, ActKind};
use super::super::{refuse, time};
use super::{N, Reader};
use crate::codes;
use crate::xml::Mapped;

impl<'t> Reader<'_, 't> {
    /// Reads executable content.
    pub(super) fn acts(&mut self, node: N<'_, 't>) -> Vec<Act> {
        let children = self.children(node);
        children.into_iter().filter_map(|child| self.act(child)).collect()
    }

    fn act(&mut self, node: N<'_, 't>) -> Option<Act> {
        let span = self.tag(node);
        let kind = match node.tag_name().name() {
            "raise" => ActKind::Raise(self.event(node)?),
            "assign" => self.assign(node)?,
            "send" => self.send(node)?,
            "cancel" => ActKind::Cancel(self.needed_name(node, "sendid")?),
            "if" => self.choice(node)?,
            "foreach" => self.foreach(node)?,
            "log" => {
                if self.ignored.insert("log") {
                    self.report(
                        Diagnostic::warning(
                            codes::SCXML_IGNORED,
                            "<log> is ignored: a controller has no log",
                        )
                        .at(span, "first used here")
                        .help("keep it for other tools, or delete it; to make a value visible, assign it to a <data> with g:role=\"output\""),
                    );
                }
                return None;
            }
            _ => return None,
        };
        // The children of a simple statement are only checked.
        if !matches!(kind, ActKind::If { .. } | ActKind::Foreach { .. }) {
            self.children(node);
        }
        Some(Act { kind, span })
    }

    /// The event of a statement, which must be a single event.
    fn event(&mut self, node: N<'_, 't>) -> Option<Name> {
        let event = self.needed_name(node, "event")?;
        if event.text.contains('*') {
            self.report(
                Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    format!("expected one event, found `{event}`, which matches several"),
                )
                .at(event.span, "`*` is only for the events of a <transition>")
                .help("write the complete name of one event"),
            );
            return None;
        }
        Some(event)
    }

    fn assign(&mut self, node: N<'_, 't>) -> Option<ActKind> {
        let Some(location) = self.value(node, "location") else {
            self.missing(node, "location");
            return None;
        };
        let location = location.trimmed();
        let first = location.text.split(['.', '[', ' ']).next().unwrap_or_default();
        if matches!(first, "_event" | "_sessionid" | "_name" | "_ioprocessors" | "_x") {
            self.report(
                Diagnostic::error(
                    codes::SCXML_LOCATION,
                    format!("`{first}` is a system variable and cannot be assigned"),
                )
                .at(location.whole(), "")
                .help("assign a data element that is declared with <data>"),
            );
            return None;
        }
        let place = match expr::location(&location, self.language, self.nesting) {
            Ok(place) => Some(place),
            Err(finding) => {
                self.report(finding);
                None
            }
        };
        let content = Mapped::content(self.file, self.source, node).trimmed();
        let value = match self.value(node, "expr") {
            Some(_) if !content.text.is_empty() => {
                self.two_values(node, &content);
                None
            }
            Some(value) => self.scalar(&value),
            None if !content.text.is_empty() => self.scalar(&content),
            None => {
                self.missing(node, "expr");
                None
            }
        };
        let (target, index) = place?;
        let target_span = location.whole();
        Some(ActKind::Assign { target, target_span, index, value: value? })
    }

    fn send(&mut self, node: N<'_, 't>) -> Option<ActKind> {
        for (attribute, value) in [("type", self.value(node, "type"))] {
            let Some(value) = value else { continue };
            let known = [
                "scxml",
                "http://www.w3.org/TR/scxml/#SCXMLEventProcessor",
                "http://www.w3.org/TR/scxml",
            ];
            if !known.contains(&value.text.trim().trim_end_matches('/')) {
                let finding = refuse(
                    value.whole(),
                    &format!("the {attribute} `{}` of <send>", value.text.trim()),
                    "the chart sends events only to itself: remove `type`",
                );
                self.report(finding);
                return None;
            }
        }
        let target = self.value(node, "target");
        let is_internal = match &target {
            None => false,
            Some(target) if target.text.trim() == "#_internal" => true,
            Some(target) => {
                let finding = refuse(
                    target.whole(),
                    &format!("the target `{}` of <send>", target.text.trim()),
                    "the chart sends events only to itself: remove `target`, or write target=\"#_internal\"",
                );
                self.report(finding);
                return None;
            }
        };
        // The event is checked even if another attribute is rejected.
        let event = if self.value(node, "eventexpr").is_some() { None } else { self.event(node) };
        let slot = self.name(node, "id");
        let after_ns = self.delay(node)?;
        let event = event?;
        if is_internal {
            if after_ns.is_some_and(|ns| ns > 0) {
                let span = self.tag(node);
                self.report(
                    Diagnostic::error(
                        codes::SCXML_TIME,
                        "an event of the internal queue cannot be delayed",
                    )
                    .at(span, "")
                    .help("remove `target`: a delayed event goes to the external queue"),
                );
                return None;
            }
            return Some(ActKind::Raise(event));
        }
        Some(ActKind::Send { event, after_ns, slot })
    }

    /// The delay of a send in nanoseconds; the outer `None` means that it is rejected.
    fn delay(&mut self, node: N<'_, 't>) -> Option<Option<u64>> {
        let (text, is_expression) = match (self.value(node, "delay"), self.value(node, "delayexpr"))
        {
            (None, None) => return Some(None),
            (Some(delay), None) => (delay.trimmed(), false),
            (None, Some(delay)) => (delay.trimmed(), true),
            (Some(_), Some(second)) => {
                self.report(
                    Diagnostic::error(codes::SCXML_ATTRIBUTE, "the delay is given twice")
                        .at(second.whole(), "again here")
                        .help("keep one of `delay` and `delayexpr`"),
                );
                return None;
            }
        };
        let written = if is_expression {
            // In ECMAScript a time can only be written as a string, so a string literal is accepted.
            ['\'', '"'].iter().find_map(|quote| {
                let inside = text.text.strip_prefix(*quote)?.strip_suffix(*quote)?;
                (!inside.contains(*quote)).then_some(inside)
            })
        } else {
            Some(text.text.as_ref())
        };
        let Some(written) = written else {
            self.report(
                Diagnostic::error(codes::SCXML_TIME, "the delay must be constant")
                    .at(text.whole(), "")
                    .help("write it as `delay=\"2s\"`; for several delays use one <send> for each"),
            );
            return None;
        };
        match time::nanoseconds(written.trim()) {
            Some(ns) => Some(Some(ns)),
            None => {
                let message = format!("invalid delay `{written}`");
                self.report(
                    Diagnostic::error(codes::SCXML_TIME, message)
                        .at(text.whole(), "")
                        .help("write a number with ms or s: `250ms`, `1.5s`"),
                );
                None
            }
        }
    }

    /// Reads `if` with its `elseif` and `else`, which are siblings of the statements.
    fn choice(&mut self, node: N<'_, 't>) -> Option<ActKind> {
        if self.value(node, "cond").is_none() {
            self.missing(node, "cond");
        }
        let mut arms = vec![(self.condition(node), Vec::new())];
        let mut otherwise: Option<Vec<Act>> = None;
        for child in self.children(node) {
            match child.tag_name().name() {
                word @ ("elseif" | "else") => {
                    self.children(child);
                    if otherwise.is_some() {
                        let span = self.tag(child);
                        self.report(
                            Diagnostic::error(
                                codes::SCXML_ELEMENT,
                                format!("<{word}> after the <else> of its <if>"),
                            )
                            .at(span, "never reached")
                            .help(if word == "else" {
                                "remove one of the two <else/>, or write <elseif cond=\"..\"/> for the first one"
                            } else {
                                "move it with its branch before <else/>"
                            }),
                        );
                    } else if word == "else" {
                        otherwise = Some(Vec::new());
                    } else {
                        if self.value(child, "cond").is_none() {
                            self.missing(child, "cond");
                        }
                        let condition = self.condition(child);
                        arms.push((condition, Vec::new()));
                    }
                }
                _ => {
                    let Some(act) = self.act(child) else { continue };
                    match (&mut otherwise, arms.last_mut()) {
                        (Some(list), _) => list.push(act),
                        (None, Some((_, list))) => list.push(act),
                        (None, None) => {}
                    }
                }
            }
        }
        let arms: Option<Vec<_>> =
            arms.into_iter().map(|(condition, list)| Some((condition?, list))).collect();
        Some(ActKind::If { arms: arms?, otherwise: otherwise.unwrap_or_default() })
    }

    fn foreach(&mut self, node: N<'_, 't>) -> Option<ActKind> {
        let array = match self.value(node, "array") {
            Some(text) => self.expression(&text),
            None => {
                self.missing(node, "array");
                None
            }
        };
        let item = self.loop_variable(node, "item", true);
        let has_index = self.value(node, "index").is_some();
        let index = self.loop_variable(node, "index", false);
        let body = self.acts(node);
        if has_index && index.is_none() {
            return None;
        }
        Some(ActKind::Foreach { array: array?, item: item?, index, body })
    }

    fn loop_variable(&mut self, node: N<'_, 't>, attribute: &str, needed: bool) -> Option<Name> {
        let text = match self.value(node, attribute) {
            Some(text) => text.trimmed(),
            None if needed => {
                self.missing(node, attribute);
                return None;
            }
            None => return None,
        };
        match expr::location(&text, self.language, self.nesting) {
            Ok((name, None)) if !name.starts_with('_') => Some(Name::new(name, text.whole())),
            Ok(_) | Err(_) => {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_LOCATION,
                        format!("invalid name `{}` for the {attribute} of a loop", text.text),
                    )
                    .at(text.whole(), "")
                    .help("write a new name, or the name of a data element"),
                );
                None
            }
        }
    }
}
