//! Writes steps and what they contain: actions, lists, statements.

use grafsynth_ir::Span;
use grafsynth_ir::chart::{Block, Step, StepItem, StepItemKind, StepRole, Stmt, StmtKind};
use grafsynth_ir::duration;
use grafsynth_ir::net::Verbatim;

use super::layout::{Doc, broken, on_one_line, text};
use super::names::{self, Position};
use super::token::Kind;
use super::write::Writer;
use super::write_text::{Text, attributes, event_list, role_words};

impl Writer<'_> {
    pub(super) fn step(&mut self, step: &Step) {
        // A final state is a state that contains no states.
        let word = if step.role == StepRole::Final { "state" } else { "step" };
        let head = step_head(&format!("{}{word}", role_words(step.role)), step);
        self.step_with_body(head, step, &step.body.iter().collect::<Vec<_>>());
    }

    /// Writes a head and a body of step items.
    pub(super) fn step_with_body(&mut self, head: String, step: &Step, body: &[&StepItem]) {
        let (from, end) = (step.name.span.end, step.meta.span.end);
        let (open, _) = self.find(Kind::OpenBrace, from, end);
        self.before(step.meta.span.start, open);
        if body.is_empty() && !self.has_comment(open, end) {
            self.line(head);
        } else {
            let body = self.block((from, end), "; ", |writer| {
                body.iter().for_each(|item| writer.step_item(item));
            });
            self.lines.push(text(head + " ").append(body.group()));
        }
        self.after(end);
    }

    pub(super) fn step_item(&mut self, item: &StepItem) {
        let (head, list) = match &item.kind {
            StepItemKind::Action { target, arguments, how, condition } => {
                let action =
                    self.text.action(target, arguments.as_deref(), *how, condition.as_ref());
                return self.simple(item.span, action);
            }
            StepItemKind::Priority(value) => {
                return self.simple(item.span, format!("priority {value}"));
            }
            StepItemKind::Budget(value) => {
                return self.simple(item.span, format!("budget {value}"));
            }
            StepItemKind::Force { target, order } => {
                return self.simple(item.span, self.text.force(target, order));
            }
            StepItemKind::Code(verbatim) => return self.code(verbatim, item.span),
            StepItemKind::Entry(list) => ("entry".to_owned(), list),
            StepItemKind::Exit(list) => ("exit".to_owned(), list),
            StepItemKind::On { events, guard, actions } => {
                let guard = guard.as_ref().map(|guard| self.text.exprs.text(guard));
                let head = match (events.as_slice(), guard) {
                    ([], guard) => format!("when {}", guard.as_deref().unwrap_or("true")),
                    (events, None) => format!("on {}", event_list(events)),
                    (events, Some(guard)) => format!("on {} when {guard}", event_list(events)),
                };
                (head, actions)
            }
            StepItemKind::Task { name, cost, body } => {
                let cost = cost.map_or_else(String::new, |cost| format!(" cost {cost}"));
                (format!("task {}{cost}", names::name(&name.text, Position::Anywhere)), body)
            }
        };
        let head = self.several().append(text(head));
        self.list(head, list, item.span, item.span.start);
    }

    /// Forces a line break in the enclosing group, unless everything is written on one line.
    fn several(&self) -> Doc {
        if self.on_one_line { Doc::nil() } else { broken() }
    }

    /// Writes `head { a; b }` on one line, or one line per statement. `from` is before the opening brace.
    pub(super) fn list(&mut self, head: Doc, block: &Block, span: Span, from: u32) {
        let (open, _) = self.find(Kind::OpenBrace, from, span.end);
        self.before(span.start, open);
        let body = self.stmts((from, span.end), block);
        self.lines.push(head.append(" ").append(body.group()));
        self.after(span.end);
    }

    fn stmts(&mut self, braces: (u32, u32), block: &Block) -> Doc {
        self.block(braces, "; ", |writer| block.iter().for_each(|stmt| writer.stmt(stmt)))
    }

    fn stmt(&mut self, stmt: &Stmt) {
        let anywhere = |name: &str| names::name(name, Position::Anywhere);
        let dotted = |name: &str| names::dotted(name, Position::Anywhere);
        let exprs = &self.text.exprs;
        let written = match &stmt.kind {
            StmtKind::Assign { target, index, value } => {
                let target = names::path(target, Position::Anywhere);
                let index = index.as_ref().map(|index| format!("[{}]", exprs.text(index)));
                format!("{target}{} := {}", index.unwrap_or_default(), exprs.text(value))
            }
            StmtKind::Raise(event) => format!("raise {}", dotted(&event.text)),
            StmtKind::Send { event, after, slot } => {
                let after = after.map(|ns| format!(" after {}", duration(ns)));
                let slot = slot.as_ref().map(|slot| format!(" as {}", anywhere(&slot.text)));
                let (after, slot) = (after.unwrap_or_default(), slot.unwrap_or_default());
                format!("send {}{after}{slot}", dotted(&event.text))
            }
            StmtKind::Cancel(slot) => format!("cancel {}", anywhere(&slot.text)),
            StmtKind::Call { function, arguments } => {
                format!("call {}{}", dotted(&function.text), self.text.arguments(arguments))
            }
            StmtKind::Code(verbatim) => return self.code(verbatim, stmt.span),
            StmtKind::If { condition, .. } => {
                let (open, _) = self.find(Kind::OpenBrace, condition.span.end, stmt.span.end);
                self.before(stmt.span.start, open);
                let written = self.several().append(self.conditional(stmt));
                self.lines.push(written);
                return self.after(stmt.span.end);
            }
        };
        self.simple(stmt.span, written);
    }

    /// `if a { … } else if b { … } else { … }`
    fn conditional(&mut self, stmt: &Stmt) -> Doc {
        let StmtKind::If { condition, then, otherwise } = &stmt.kind else { return Doc::nil() };
        let (from, end) = (condition.span.end, stmt.span.end);
        let (_, open_end) = self.find(Kind::OpenBrace, from, end);
        let last = then.last().map_or(open_end, |last| last.span.end);
        let (_, close_end) = self.find(Kind::CloseBrace, last, end);
        let head = text(format!("if {} ", self.text.exprs.text(condition)));
        let written = head.append(self.stmts((from, close_end), then));
        match otherwise.as_slice() {
            [] => written,
            [one @ Stmt { kind: StmtKind::If { .. }, .. }] => {
                written.append(" else ").append(self.conditional(one))
            }
            _ => written.append(" else ").append(self.stmts((close_end, end), otherwise)),
        }
    }

    /// `code c "…"`. Several lines are written between triple quotes, without escapes.
    fn code(&mut self, verbatim: &Verbatim, span: Span) {
        let language = names::name(&verbatim.language, Position::Anywhere);
        let code = &verbatim.text;
        let has_lines = code.contains('\n') && !self.on_one_line;
        let is_raw =
            has_lines && !code.contains("\"\"\"") && !code.ends_with('"') && !code.contains('\r');
        let quoted = if is_raw { format!("\"\"\"\n{code}\"\"\"") } else { names::quoted(code) };
        let start = if has_lines { broken() } else { Doc::nil() };
        self.laid_out(span, start.append(text(format!("code {language} {quoted}"))));
    }
}

impl Text {
    /// A list on one line; `None` if it contains something that needs several lines.
    pub(crate) fn list(&self, block: &Block) -> Option<String> {
        let mut writer = Writer::bare(self.clone());
        let list = on_one_line(writer.stmts((0, 0), block));
        (!list.contains('\n')).then_some(list)
    }

    /// A list on one line, even if it contains other lists: `{ a := 1; if b { c := 2 } }`.
    pub(crate) fn one_line_list(&self, block: &Block) -> String {
        let mut writer = Writer::bare(self.clone());
        writer.on_one_line = true;
        on_one_line(writer.stmts((0, 0), block))
    }

    /// An item of the body of a step on one line, even if it contains a list.
    pub(crate) fn one_line_item(&self, item: &StepItem) -> String {
        let mut writer = Writer::bare(self.clone());
        writer.on_one_line = true;
        writer.step_item(item);
        on_one_line(writer.lines.below())
    }
}

/// The head of a step: `WORDS NAME`, and the other parts before its body.
pub(super) fn step_head(words: &str, step: &Step) -> String {
    let mut head = format!("{words} {}", names::name(&step.name.text, Position::Step));
    if step.activation_link {
        head.push_str(" *");
    }
    if let Some(count) = step.count {
        head.push_str(&format!(" count 0..{}", count.max));
        if let Some(initial) = count.initial {
            head.push_str(&format!(" = {initial}"));
        }
    }
    head.push_str(&attributes(&step.meta));
    head
}
