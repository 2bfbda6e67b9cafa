//! Writes a design in its canonical form, with the comments and blank lines of its source if there is one.
//!
//! The canonical form has four spaces per level, 100 columns, and one item per line; a short body is on the line of its step. Signs become words, the statements of a
//! list on one line are separated by `;`, and declarations stay grouped as they were written. Comments keep their position between items; a
//! comment inside an item, but outside its braces, moves above the item.

use super::Comment;
use super::layout::{Doc, Lines, WIDTH, broken, fill, indented, text, wide};
use super::lexer::Lexer;
use super::names::{self, Position};
use super::token::Kind;
use super::write_text::{
    Clause, Text, attributes, conditions, keyword, macro_step, place_text, setting_text,
    transition_head,
};
use grafsynth_ir::Span;
use grafsynth_ir::chart::{
    Action, Board, Certificate, Chart, Declaration, DeclarationKind, Design, Expr, Import, Item,
    Library, Macro, Transition,
};
use itertools::Itertools as _;

/// A chart, or one item outside of charts.
enum Part<'a> {
    Import(&'a Import),
    Library(&'a Library),
    Certificate(&'a Certificate),
    Chart(&'a Chart),
}

/// The text from which a design was read.
pub(super) struct Source<'a> {
    pub(super) text: &'a str,
    pub(super) comments: &'a [Comment],
}

/// Writes a design. With a source, also writes its comments and blank lines.
pub(super) fn write(design: &Design, source: Option<Source<'_>>) -> String {
    let mut writer = Writer { source, ..Writer::bare(Text::default()) };
    writer.design(design);
    let text = writer.lines.render();
    if text.is_empty() { text } else { text + "\n" }
}

pub(super) struct Writer<'a> {
    /// The lines of the innermost open block.
    pub(super) lines: Lines,
    /// The number of open blocks.
    level: usize,
    pub(super) source: Option<Source<'a>>,
    next_comment: usize,
    /// End in the source of the part written last; `None` at the start of a block, where no blank line is kept.
    last_end: Option<u32>,
    pub(super) text: Text,
    /// True if everything is written on one line, even a list of several statements.
    pub(super) on_one_line: bool,
}

impl Writer<'_> {
    /// A writer without a source.
    pub(super) fn bare(text: Text) -> Self {
        Writer {
            lines: Lines::outermost(),
            level: 0,
            source: None,
            next_comment: 0,
            last_end: None,
            text,
            on_one_line: false,
        }
    }

    // Lines, comments, blank lines

    pub(super) fn line(&mut self, line: impl Into<Box<str>>) {
        self.lines.push(text(line));
    }

    fn comment(&self) -> Option<Span> {
        let source = self.source.as_ref()?;
        source.comments.get(self.next_comment).map(|comment| comment.span)
    }

    /// A comment. The group that contains it is written on several lines.
    fn comment_text(&self, before: &str, span: Span) -> Doc {
        let text =
            self.source.as_ref().and_then(|source| source.text.get(span.range())).unwrap_or("#");
        wide(format!("{before}{}", text.trim_end())).append(broken())
    }

    /// Called before an item whose head extends from `start` to `inner`. Writes the comments before and inside the head on lines of their own, and keeps a
    /// blank line of the source before the item.
    pub(super) fn before(&mut self, start: u32, inner: u32) {
        self.flush(start);
        self.keep_blank(start);
        if self.comment().is_some_and(|next| next.start < inner) {
            // These comments are inside the item, so no blank line of the source separates them from the item that they move above.
            self.last_end = None;
            self.flush(inner);
        }
    }

    /// Writes the comments that begin before `limit` on their own lines.
    fn flush(&mut self, limit: u32) {
        while let Some(span) = self.comment()
            && span.start < limit
        {
            self.keep_blank(span.start);
            let text = self.comment_text("", span);
            self.lines.push(text);
            self.last_end = Some(span.end);
            self.next_comment += 1;
        }
    }

    fn keep_blank(&mut self, start: u32) {
        let Some(source) = &self.source else { return };
        if let Some(end) = self.last_end
            && let Some(gap) = source.text.get(end as usize..start as usize)
            && gap.bytes().all(|b| b.is_ascii_whitespace() || matches!(b, b',' | b';'))
            && gap.bytes().filter(|&b| b == b'\n').nth(1).is_some()
        {
            self.lines.blank();
        }
    }

    /// Called after an item that ends at `end`. A comment on the same line stays there.
    pub(super) fn after(&mut self, end: u32) {
        let comment = self.comment_after(end);
        self.lines.extend_last(comment);
    }

    fn comment_after(&mut self, end: u32) -> Option<Doc> {
        self.last_end = Some(end);
        let span = self.comment()?;
        let gap = self.source.as_ref()?.text.get(end as usize..span.start as usize)?;
        if !gap.bytes().all(|b| matches!(b, b' ' | b'\t' | b',' | b';' | b'\r')) {
            return None;
        }
        self.last_end = Some(span.end);
        self.next_comment += 1;
        Some(self.comment_text("  ", span))
    }

    /// Whether a comment that is not yet written is between the two positions.
    pub(super) fn has_comment(&self, start: u32, end: u32) -> bool {
        self.source.is_some() && self.comment().is_some_and(|next| next.start < end) && {
            let comments = self.source.as_ref().map_or(&[][..], |source| source.comments);
            comments[self.next_comment..]
                .iter()
                .map(|comment| comment.span.start)
                .find(|at| *at >= start)
                .is_some_and(|at| at < end)
        }
    }

    /// Start and end of the first token of this kind between `from` and `until`; if there is none, `until` as both.
    pub(super) fn find(&self, kind: Kind, from: u32, until: u32) -> (u32, u32) {
        let Some(source) = &self.source else { return (until, until) };
        let mut lexer = Lexer::starting_at(source.text, from as usize);
        loop {
            let token = lexer.next(&mut |_, _| {}, &mut |_| {});
            if token.start >= until || token.kind == Kind::End {
                return (until, until);
            }
            if token.kind == kind {
                return (token.start, token.end);
            }
        }
    }

    /// A body in braces. `from` is before the opening brace, `end` is the end of the closing one; `between` separates its parts on one line.
    pub(super) fn block(
        &mut self,
        (from, end): (u32, u32),
        between: &'static str,
        body: impl FnOnce(&mut Self),
    ) -> Doc {
        let outer = std::mem::replace(&mut self.lines, Lines::separated_by(between));
        let (_, open_end) = self.find(Kind::OpenBrace, from, end);
        let comment = self.comment_after(open_end);
        // No blank line after an opening brace, and none before a closing one.
        self.last_end = None;
        self.level += 1;
        body(self);
        self.flush(end);
        self.level -= 1;
        self.last_end = Some(end);
        std::mem::replace(&mut self.lines, outer).in_braces(comment)
    }

    /// Writes a head and its contents on several lines. `from` is after the name.
    pub(super) fn container(
        &mut self,
        head: Doc,
        span: Span,
        from: u32,
        is_empty: bool,
        body: impl FnOnce(&mut Self),
    ) {
        let (open, _) = self.find(Kind::OpenBrace, from, span.end);
        self.before(span.start, open);
        if is_empty && !self.has_comment(open, span.end) {
            self.lines.push(head.append(" {}"));
        } else {
            let body = self.block((from, span.end), "", body);
            self.lines.push(head.append(" ").append(body));
        }
        self.after(span.end);
    }

    // Design and charts

    fn design(&mut self, design: &Design) {
        if let Some((number, span)) = design.edition {
            self.simple(span, format!("edition {number}"));
        }
        for part in self.parts(design) {
            if self.source.is_none() && !matches!(part, Part::Import(_)) {
                self.lines.blank();
            }
            match part {
                Part::Import(import) => {
                    self.simple(import.span, format!("use {}", names::quoted(&import.file)));
                }
                Part::Library(library) => self.library(library),
                Part::Certificate(certificate) => self.certificate(certificate),
                Part::Chart(chart) => {
                    self.text.exprs.conditions = conditions(&chart.items);
                    self.chart(chart);
                }
            }
        }
        self.flush(u32::MAX);
    }

    /// The parts of a source in their order. Without a source, imports come first and charts last.
    fn parts<'d>(&self, design: &'d Design) -> Vec<Part<'d>> {
        let mut parts: Vec<Part<'d>> = design.imports.iter().map(Part::Import).collect();
        for library in &design.libraries {
            parts.push(Part::Library(library));
            parts.extend(library.certificate.as_ref().map(Part::Certificate));
        }
        parts.extend(design.charts.iter().map(Part::Chart));
        if self.source.is_some() {
            parts.sort_by_key(|part| match part {
                Part::Import(import) => import.span.start,
                Part::Library(library) => library.span.start,
                Part::Certificate(certificate) => certificate.span.start,
                Part::Chart(chart) => chart.span.start,
            });
        }
        parts
    }

    pub(super) fn chart(&mut self, chart: &Chart) {
        let head = format!(
            "chart {}{}",
            names::name(&chart.name.text, Position::Anywhere),
            attributes(&chart.meta)
        );
        let is_empty = chart.items.is_empty() && chart.initial.is_empty();
        self.container(text(head), chart.span, chart.name.span.end, is_empty, |writer| {
            writer.content_of_chart(chart);
        });
    }

    pub(super) fn items(&mut self, items: &[Item]) {
        self.items_of(items, false);
    }

    /// Writes the items of a chart or body. The states in a parallel state are its regions.
    pub(super) fn items_of(&mut self, items: &[Item], is_parallel: bool) {
        let mut at = 0;
        let mut class = None;
        while let Some(item) = items.get(at) {
            // Without a source, a blank line separates items of different kinds, and each block from the item before it.
            let this = class_of(item);
            if self.source.is_none()
                && class.is_some_and(|last| last != this || this == Class::Block)
            {
                self.lines.blank();
            }
            class = Some(this);
            if let Item::Declaration(_) = item {
                let n = self.group(&items[at..]);
                self.declarations(&items[at..at + n]);
                at += n;
            } else {
                if let Item::State(state) = item {
                    self.state(state, is_parallel);
                } else {
                    self.item(item);
                }
                at += 1;
            }
            self.lines.settle(self.level);
        }
    }

    pub(super) fn item(&mut self, item: &Item) {
        match item {
            Item::Setting(setting) => self.simple(setting.span, setting_text(setting)),
            Item::Declaration(_) => self.declarations(std::slice::from_ref(item)),
            Item::Step(step) => self.step(step),
            Item::Transition(transition) => self.transition(transition),
            Item::Macro(body) => self.macro_body(body),
            Item::MacroStep(step) => self.simple(step.meta.span, macro_step(step)),
            Item::Enclosing(enclosing) => self.enclosing(enclosing),
            Item::State(state) => self.state(state, false),
            Item::Use(one) => self.simple(one.meta.span, self.text.instance(one)),
            Item::Action(action) => self.action(action),
            Item::Emergency(emergency) => {
                self.simple(emergency.meta.span, self.text.emergency(emergency))
            }
            Item::Property(property) => {
                self.simple(property.meta.span, self.text.property(property))
            }
            Item::Place(place) => self.simple(place.span, place_text(place)),
            Item::Board(board) => self.board(board),
        }
    }

    /// Writes an item without a body. Comments inside it move above it.
    pub(super) fn simple(&mut self, span: Span, item: impl Into<Box<str>>) {
        self.laid_out(span, text(item));
    }

    pub(super) fn laid_out(&mut self, span: Span, item: Doc) {
        self.before(span.start, span.end);
        self.lines.push(item);
        self.after(span.end);
    }

    // Declarations

    /// The number of items at the start of `items` that are written together: declarations that share one keyword, otherwise 1.
    fn group(&self, items: &[Item]) -> usize {
        let first = match items.first() {
            Some(Item::Declaration(first)) => first,
            _ => return 1,
        };
        let belongs = |item: &&Item| match item {
            Item::Declaration(next) if self.source.is_some() => {
                next.meta.span.start == next.name.span.start
            }
            Item::Declaration(next) => {
                keyword(next) == keyword(first) && is_short(next) && is_short(first)
            }
            _ => false,
        };
        1 + items[1..].iter().take_while(belongs).count()
    }

    fn declarations(&mut self, items: &[Item]) {
        let declarations: Vec<&Declaration> = items
            .iter()
            .filter_map(|item| {
                if let Item::Declaration(declaration) = item { Some(declaration) } else { None }
            })
            .collect();
        let (Some(first), Some(last)) = (declarations.first(), declarations.last()) else { return };
        let keyword = keyword(first);
        let pieces: Vec<String> =
            declarations.iter().map(|declaration| self.text.declaration(declaration)).collect();
        let span = Span { end: last.meta.span.end, ..first.meta.span };
        if declarations.len() == 1 || !self.has_comment(first.meta.span.end, span.end) {
            let list = fill(&pieces, ",", "", 0);
            return self.laid_out(span, text(format!("{keyword} ")).append(list));
        }
        // One per line, so that each comment stays next to its declaration.
        for (index, (declaration, piece)) in declarations.iter().zip(&pieces).enumerate() {
            let comma = if index + 1 < pieces.len() { "," } else { "" };
            let head = if index == 0 { format!("{keyword} ") } else { String::new() };
            self.lines.hanging = index > 0;
            self.simple(declaration.meta.span, format!("{head}{piece}{comma}"));
        }
        self.lines.hanging = false;
    }

    /// `action count { n := n + 1 }`
    fn action(&mut self, action: &Action) {
        let span = action.meta.span;
        let head = format!(
            "action {}{}",
            names::name(&action.name.text, Position::Anywhere),
            attributes(&action.meta)
        );
        let (open, _) = self.find(Kind::OpenBrace, action.name.span.end, span.end);
        if action.body.is_empty() && !self.has_comment(open, span.end) {
            self.simple(span, head);
        } else {
            self.list(text(head), &action.body, span, action.name.span.end);
        }
    }

    // Transitions

    fn transition(&mut self, transition: &Transition) {
        let mut clauses = vec![(Clause::OnFirstLine, transition_head(transition))];
        clauses.extend(self.text.clauses(transition));
        let flat = clauses.iter().map(|(_, clause)| clause).join(" ");
        // The length of the list does not count, because the list can be broken without breaking the clauses.
        let is_flat = 4 * self.level + flat.len() <= WIDTH;
        let head =
            if is_flat { text(flat) } else { self.tall(&clauses, transition.guard.as_ref()) };
        let span = transition.meta.span;
        if transition.actions.is_empty() {
            return self.laid_out(span, head);
        }
        let start = if is_flat { Doc::space() } else { indented(Doc::hardline()) };
        let head = head.append(indented(start.append("do")));
        self.list(head, &transition.actions, span, span.start);
    }

    /// A long transition, with each clause on a separate line.
    fn tall(&self, clauses: &[(Clause, String)], guard: Option<&Expr>) -> Doc {
        let (first, others): (Vec<_>, Vec<_>) =
            clauses.iter().partition(|(clause, _)| *clause == Clause::OnFirstLine);
        let first = first.into_iter().map(|(_, text)| text).join(" ");
        let others = others.into_iter().map(|(clause, written)| {
            let operands = guard.filter(|_| *clause == Clause::Guard);
            let doc = match operands.and_then(|guard| self.text.exprs.junction(guard)) {
                Some((word, pieces)) => Doc::text("when ").append(fill(&pieces, "", word, 0)),
                None => text(written.as_str()),
            };
            Doc::hardline().append(doc)
        });
        text(first).append(indented(Doc::concat(others)))
    }

    // Other items

    fn macro_body(&mut self, body: &Macro) {
        let head = format!(
            "macro {}{}",
            names::name(&body.name.text, Position::Anywhere),
            attributes(&body.meta)
        );
        self.container(text(head), body.meta.span, body.name.span.end, false, |writer| {
            writer.items(&body.items);
        });
    }

    fn board(&mut self, board: &Board) {
        let head = format!("device {}", names::device(&board.device.text));
        let (span, from) = (board.span, board.device.span.end);
        if board.pins.is_empty() && !self.has_comment(span.start, span.end) {
            return self.simple(span, head);
        }
        let (open, _) = self.find(Kind::OpenBrace, from, span.end);
        self.before(span.start, open);
        let pins = self.block((from, span.end), "  ", |writer| {
            for (name, pin) in &board.pins {
                writer.before(name.span.start, name.span.end);
                writer.line(format!("{} {pin}", names::signal(&name.text)));
                // The number follows the name.
                let (_, end) = writer.find(Kind::Number, name.span.end, span.end);
                writer.after(end);
            }
        });
        self.lines.push(text(format!("{head} ")).append(pins.group()));
        self.after(span.end);
    }
}

/// Kinds of items. In a design that is written without a source, a blank line separates items of different kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    Setting,
    Declaration,
    Property,
    Action,
    Step,
    Transition,
    Block,
    Board,
}

fn class_of(item: &Item) -> Class {
    match item {
        Item::Setting(_) => Class::Setting,
        Item::Declaration(_) => Class::Declaration,
        Item::Emergency(_) | Item::Property(_) => Class::Property,
        Item::Step(_) | Item::MacroStep(_) | Item::Use(_) => Class::Step,
        Item::Action(_) => Class::Action,
        Item::Transition(_) => Class::Transition,
        Item::Macro(_) | Item::Enclosing(_) | Item::State(_) => Class::Block,
        Item::Place(_) | Item::Board(_) => Class::Board,
    }
}

/// Whether the declaration is short: short declarations share a line if there is no source to follow.
fn is_short(declaration: &Declaration) -> bool {
    declaration.meta.req.is_empty()
        && matches!(
            declaration.kind,
            DeclarationKind::Input { .. }
                | DeclarationKind::Output { .. }
                | DeclarationKind::Event { .. }
                | DeclarationKind::ExternCondition { .. }
                | DeclarationKind::ExternAction { .. }
        )
}
