//! Writes a design in its canonical form, with the comments and blank lines of its source if there is one.
//!
//! Four spaces per level, 100 columns, one item per line; a short body is on the line of its step. Signs become words, lists are separated
//! by `;`, and declarations stay grouped as they were written. Comments keep their position between items; a comment inside an item moves
//! above it.

use super::Comment;
use super::lexer::Lexer;
use super::names::{self, Position};
use super::token::Kind;
use super::write_text::{
    Text, attributes, conditions, keyword, macro_step, place_text, role_words, setting_text,
};
use grafsynth_ir::Span;
use grafsynth_ir::chart::{
    Action, Block, Board, Certificate, Chart, Declaration, DeclarationKind, Design, Expr, Import,
    Item, Library, Macro, Step, StepItem, StepItemKind, StepRole, Stmt, StmtKind, Transition,
};

/// The maximum line width, where it can be kept.
pub(super) const WIDTH: usize = 100;

/// A chart, or one thing outside of charts.
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
    writer.out
}

pub(super) struct Writer<'a> {
    pub(super) out: String,
    indent: usize,
    pub(super) source: Option<Source<'a>>,
    next_comment: usize,
    /// End in the source of the part written last; `None` at the start of a block, where no blank line is kept.
    last_end: Option<u32>,
    pub(super) text: Text,
}

impl Writer<'_> {
    /// A writer without a source.
    pub(super) fn bare(text: Text) -> Self {
        Writer {
            out: String::new(),
            indent: 0,
            source: None,
            next_comment: 0,
            last_end: None,
            text,
        }
    }

    // Lines, comments, blank lines

    pub(super) fn line(&mut self, text: &str) {
        for _ in 0..self.indent {
            self.out.push_str("    ");
        }
        self.out.push_str(text);
        self.out.push('\n');
    }

    pub(super) fn blank(&mut self) {
        if !self.out.is_empty() && !self.out.ends_with("\n\n") && !self.out.ends_with("{\n") {
            self.out.push('\n');
        }
    }

    fn comment(&self) -> Option<Span> {
        let source = self.source.as_ref()?;
        source.comments.get(self.next_comment).map(|comment| comment.span)
    }

    fn comment_text(&self, span: Span) -> String {
        let text =
            self.source.as_ref().and_then(|source| source.text.get(span.range())).unwrap_or("#");
        text.trim_end().to_owned()
    }

    /// Called before an item that begins at `start` and has no block of its own before `inner`. Writes the comments up to `inner` on their
    /// own lines, and a blank line if the source has one.
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
            let text = self.comment_text(span);
            self.line(&text);
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
            self.blank();
        }
    }

    /// Called after an item that ends at `end`. A comment on the same line stays there.
    pub(super) fn after(&mut self, end: u32) {
        self.last_end = Some(end);
        let Some(source) = &self.source else { return };
        if let Some(span) = self.comment()
            && span.start >= end
            && let Some(gap) = source.text.get(end as usize..span.start as usize)
            && gap.bytes().all(|b| matches!(b, b' ' | b'\t' | b',' | b';' | b'\r'))
        {
            let text = self.comment_text(span);
            if self.out.ends_with('\n') {
                self.out.pop();
            }
            self.out.push_str("  ");
            self.out.push_str(&text);
            self.out.push('\n');
            self.last_end = Some(span.end);
            self.next_comment += 1;
        }
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

    /// Start and end of the first token of this kind at or after `from`; `until` twice if there is none before it.
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

    /// Writes `head {`, the body one level deeper, and `}`. `from` is before the opening brace, `end` is the end of the closing one.
    pub(super) fn block(
        &mut self,
        head: &str,
        from: u32,
        end: u32,
        body: &mut dyn FnMut(&mut Self),
    ) {
        self.line(&format!("{head} {{"));
        let (_, open_end) = self.find(Kind::OpenBrace, from, end);
        self.after(open_end);
        // No blank line after an opening brace, and none before a closing one.
        self.last_end = None;
        self.indent += 1;
        body(self);
        self.flush(end);
        self.indent -= 1;
        self.line("}");
        self.last_end = Some(end);
    }

    // Design and charts

    fn design(&mut self, design: &Design) {
        if let Some((number, span)) = design.edition {
            self.before(span.start, span.end);
            self.line(&format!("edition {number}"));
            self.after(span.end);
        }
        for part in self.parts(design) {
            if self.source.is_none() && !self.out.is_empty() && !matches!(part, Part::Import(_)) {
                self.blank();
            }
            match part {
                Part::Import(import) => {
                    self.simple(import.span, &format!("use {}", names::quoted(&import.file)));
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
        let (open, _) = self.find(Kind::OpenBrace, chart.name.span.end, chart.span.end);
        self.before(chart.span.start, open);
        let head = format!(
            "chart {}{}",
            names::name(&chart.name.text, Position::Anywhere),
            attributes(&chart.meta)
        );
        let is_empty = chart.items.is_empty() && chart.initial.is_empty();
        if is_empty && !self.has_comment(open, chart.span.end) {
            self.line(&format!("{head} {{}}"));
        } else {
            self.block(&head, chart.name.span.end, chart.span.end, &mut |writer| {
                writer.content_of_chart(chart);
            });
        }
        self.after(chart.span.end);
    }

    pub(super) fn items(&mut self, items: &[Item]) {
        self.items_of(items, false);
    }

    /// Writes the items of a chart or body. The states in a parallel state are its regions.
    pub(super) fn items_of(&mut self, items: &[Item], is_parallel: bool) {
        let mut at = 0;
        let mut class = None;
        while let Some(item) = items.get(at) {
            // Without a source, items of one kind are grouped.
            let this = class_of(item);
            if self.source.is_none()
                && class.is_some_and(|last| last != this || this == Class::Block)
            {
                self.blank();
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
        }
    }

    pub(super) fn item(&mut self, item: &Item) {
        match item {
            Item::Setting(setting) => self.simple(setting.span, &setting_text(setting)),
            Item::Declaration(_) => self.declarations(std::slice::from_ref(item)),
            Item::Step(step) => self.step(step),
            Item::Transition(transition) => self.transition(transition),
            Item::Macro(body) => self.macro_body(body),
            Item::MacroStep(step) => self.simple(step.meta.span, &macro_step(step)),
            Item::Enclosing(enclosing) => self.enclosing(enclosing),
            Item::State(state) => self.state(state, false),
            Item::Use(one) => {
                let text = self.text.instance(one);
                self.simple(one.meta.span, &text);
            }
            Item::Action(action) => self.action(action),
            Item::Emergency(emergency) => {
                let text = self.text.emergency(emergency);
                self.simple(emergency.meta.span, &text);
            }
            Item::Property(property) => {
                let text = self.text.property(property);
                self.simple(property.meta.span, &text);
            }
            Item::Place(place) => self.simple(place.span, &place_text(place)),
            Item::Board(board) => self.board(board),
        }
    }

    /// Writes a one-line item, which contains no comment.
    pub(super) fn simple(&mut self, span: Span, text: &str) {
        self.before(span.start, span.end);
        self.line(text);
        self.after(span.end);
    }

    // Declarations

    /// The number of declarations at the start of `items` that share one keyword.
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
        let (start, end) = (first.meta.span.start, last.meta.span.end);
        if declarations.len() > 1 && self.has_comment(first.meta.span.end, end) {
            // One per line, so that each comment stays next to its declaration.
            for (index, (declaration, piece)) in declarations.iter().zip(&pieces).enumerate() {
                let comma = if index + 1 < pieces.len() { "," } else { "" };
                let head = if index == 0 { format!("{keyword} ") } else { String::new() };
                self.indent += usize::from(index > 0);
                self.before(declaration.meta.span.start, declaration.meta.span.end);
                self.line(&format!("{head}{piece}{comma}"));
                self.indent -= usize::from(index > 0);
                self.after(declaration.meta.span.end);
            }
            return;
        }
        self.before(start, end);
        let lines = fill(&format!("{keyword} "), &pieces, ",", "", self.room());
        self.filled(&lines);
        self.after(end);
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
            self.simple(span, &head);
        } else {
            self.list(&head, &action.body, span, action.name.span.end);
        }
    }

    /// The columns available on a line at this level.
    pub(super) fn room(&self) -> usize {
        WIDTH.saturating_sub(4 * self.indent)
    }

    /// Writes the first line at this level, the others one level deeper.
    pub(super) fn filled(&mut self, lines: &[String]) {
        for (index, line) in lines.iter().enumerate() {
            self.indent += usize::from(index > 0);
            self.line(line);
            self.indent -= usize::from(index > 0);
        }
    }

    // Steps

    fn step(&mut self, step: &Step) {
        // A final state is a state that contains no states.
        let word = if step.role == StepRole::Final { "state" } else { "step" };
        let head = step_head(&format!("{}{word}", role_words(step.role)), step);
        let body: Vec<&StepItem> = step.body.iter().collect();
        self.step_with_body(&head, step, &body);
    }

    /// Writes a head and a body of step items.
    pub(super) fn step_with_body(&mut self, head: &str, step: &Step, body: &[&StepItem]) {
        let span = step.meta.span;
        let (open, _) = self.find(Kind::OpenBrace, step.name.span.end, span.end);
        let has_body = !body.is_empty() || self.has_comment(open, span.end);
        if has_body && !self.has_comment(open, span.end) {
            let inline: Option<Vec<String>> =
                body.iter().map(|item| self.text.inline_item(item)).collect();
            if let Some(items) = inline {
                let text = format!("{head} {{ {} }}", items.join("; "));
                if text.len() <= self.room() && !text.contains('\n') {
                    self.before(span.start, open);
                    self.line(&text);
                    self.after(span.end);
                    return;
                }
            }
        }
        self.before(span.start, open);
        if has_body {
            self.block(head, step.name.span.end, span.end, &mut |writer| {
                for item in body {
                    writer.step_item(item);
                }
            });
        } else {
            self.line(head);
        }
        self.after(span.end);
    }

    pub(super) fn step_item(&mut self, item: &StepItem) {
        let head = self.text.step_item_head(item);
        match &item.kind {
            StepItemKind::Entry(block) | StepItemKind::Exit(block) => {
                self.list(&head, block, item.span, item.span.start)
            }
            StepItemKind::On { actions, .. } => {
                self.list(&head, actions, item.span, item.span.start)
            }
            StepItemKind::Task { body, .. } => self.list(&head, body, item.span, item.span.start),
            _ => self.simple(item.span, &head),
        }
    }

    /// Writes `head { a; b }` on one line, or one line per statement. `from` is before the opening brace.
    pub(super) fn list(&mut self, head: &str, block: &Block, span: Span, from: u32) {
        let (open, _) = self.find(Kind::OpenBrace, from, span.end);
        self.before(span.start, open);
        if !self.has_comment(open, span.end)
            && let Some(text) = self.text.inline_list(block)
        {
            let text = format!("{head} {text}");
            // A wrapped head contains its own indentation.
            let (room, last) = match text.rsplit_once('\n') {
                Some((_, last)) => (WIDTH, last),
                None => (self.room(), text.as_str()),
            };
            if last.len() <= room {
                self.line(&text);
                self.after(span.end);
                return;
            }
        }
        self.block(head, from, span.end, &mut |writer| writer.stmts(block));
        self.after(span.end);
    }

    fn stmts(&mut self, block: &Block) {
        for stmt in block {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::If { condition, then, otherwise } => {
                let (open, _) = self.find(Kind::OpenBrace, condition.span.end, stmt.span.end);
                self.before(stmt.span.start, open);
                self.conditional(
                    &format!("if {}", self.text.exprs.text(condition)),
                    condition.span.end,
                    then,
                    otherwise,
                    stmt.span,
                );
                self.after(stmt.span.end);
            }
            _ => {
                let text = self.text.stmt_text(stmt);
                self.simple(stmt.span, &text);
            }
        }
    }

    /// Writes `head { … } else { … }`. For an `else if`, the head follows a closing brace.
    fn conditional(&mut self, head: &str, from: u32, then: &Block, otherwise: &Block, span: Span) {
        let (_, open_end) = self.find(Kind::OpenBrace, from, span.end);
        let (_, close_end) = self.find(
            Kind::CloseBrace,
            then.last().map_or(open_end, |last| last.span.end),
            span.end,
        );
        self.block(head, from, close_end, &mut |writer| writer.stmts(then));
        if otherwise.is_empty() {
            return;
        }
        // `} else` is on the line of the brace.
        while self.out.ends_with('\n') {
            self.out.pop();
        }
        if let [Stmt { kind: StmtKind::If { condition, then, otherwise }, span }] =
            otherwise.as_slice()
        {
            let head = format!("}} else if {}", self.text.exprs.text(condition));
            self.close_to_else();
            self.conditional(&head, condition.span.end, then, otherwise, *span);
        } else {
            self.close_to_else();
            self.block("} else", close_end, span.end, &mut |writer| writer.stmts(otherwise));
        }
    }

    /// Removes the closing brace and its indentation; the next head writes them again.
    fn close_to_else(&mut self) {
        self.out.pop();
        while self.out.ends_with(' ') {
            self.out.pop();
        }
    }

    // Transitions

    fn transition(&mut self, transition: &Transition) {
        let span = transition.meta.span;
        let (head, clauses, guard_at) = self.text.transition(transition);
        let mut text = head.clone();
        for clause in &clauses {
            text.push(' ');
            text.push_str(clause);
        }
        if text.len() > self.room() {
            text = self.wrapped(&head, &clauses, guard_at, transition.guard.as_ref());
            if !transition.actions.is_empty() {
                text.push('\n');
                text.push_str(&"    ".repeat(self.indent + 1));
                text.push_str("do");
            }
        } else if !transition.actions.is_empty() {
            text.push_str(" do");
        }
        if transition.actions.is_empty() {
            self.simple(span, &text);
        } else {
            self.list(&text, &transition.actions, span, span.start);
        }
    }

    /// Writes a long transition with each clause on its own line. A priority stays on the first line, where it cannot be read as the
    /// chart's.
    fn wrapped(
        &self,
        head: &str,
        clauses: &[String],
        guard_at: usize,
        guard: Option<&Expr>,
    ) -> String {
        let pad = "    ".repeat(self.indent + 1);
        let mut text = head.to_owned();
        for clause in clauses.iter().filter(|clause| stays_on_first_line(clause)) {
            text.push(' ');
            text.push_str(clause);
        }
        for (index, clause) in
            clauses.iter().enumerate().filter(|(_, clause)| !stays_on_first_line(clause))
        {
            let room = self.room().saturating_sub(4);
            let lines = match guard
                .filter(|_| index == guard_at && clause.len() > room)
                .and_then(|guard| self.text.exprs.junction(guard))
            {
                Some((word, pieces)) => fill("when ", &pieces, "", word, room),
                None => vec![clause.clone()],
            };
            for (n, line) in lines.iter().enumerate() {
                text.push('\n');
                text.push_str(&pad);
                if n > 0 {
                    text.push_str("    ");
                }
                text.push_str(line);
            }
        }
        text
    }

    // Other items

    fn macro_body(&mut self, body: &Macro) {
        let (open, _) = self.find(Kind::OpenBrace, body.name.span.end, body.meta.span.end);
        self.before(body.meta.span.start, open);
        let head = format!(
            "macro {}{}",
            names::name(&body.name.text, Position::Anywhere),
            attributes(&body.meta)
        );
        self.block(&head, body.name.span.end, body.meta.span.end, &mut |writer| {
            writer.items(&body.items)
        });
        self.after(body.meta.span.end);
    }

    fn board(&mut self, board: &Board) {
        let head = format!("device {}", names::name(&board.device.text, Position::Anywhere));
        if board.pins.is_empty() && !self.has_comment(board.span.start, board.span.end) {
            self.simple(board.span, &head);
            return;
        }
        let pins: Vec<String> = board
            .pins
            .iter()
            .map(|(name, pin)| format!("{} {pin}", names::signal(&name.text)))
            .collect();
        let text = format!("{head} {{ {} }}", pins.join("  "));
        let (open, _) = self.find(Kind::OpenBrace, board.device.span.end, board.span.end);
        self.before(board.span.start, open.min(board.span.end));
        if text.len() <= self.room() && !self.has_comment(board.span.start, board.span.end) {
            self.line(&text);
        } else {
            self.block(&head, board.device.span.end, board.span.end, &mut |writer| {
                for ((name, _), text) in board.pins.iter().zip(&pins) {
                    writer.before(name.span.start, name.span.end);
                    writer.line(text);
                    // The number follows the name.
                    let (_, end) = writer.find(Kind::Number, name.span.end, board.span.end);
                    writer.after(end);
                }
            });
        }
        self.after(board.span.end);
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

/// Whether a clause on a line of its own would be read as an item of the chart.
fn stays_on_first_line(clause: &str) -> bool {
    clause.starts_with("priority ") || clause == "internal"
}

/// Groups of items in a design that is written without a source.
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

/// Joins pieces within `room` columns. The first line begins with `head`, `between` ends each piece but the last, `lead` begins each but
/// the first.
pub(super) fn fill(
    head: &str,
    pieces: &[String],
    between: &str,
    lead: &str,
    room: usize,
) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = head.to_owned();
    for (index, piece) in pieces.iter().enumerate() {
        let text = format!(
            "{}{piece}{}",
            if index > 0 { lead } else { "" },
            if index + 1 < pieces.len() { between } else { "" }
        );
        // Later lines are indented one level deeper.
        let room = if lines.is_empty() { room } else { room.saturating_sub(4) };
        if index == 0 {
            line.push_str(&text);
        } else if line.len() + 1 + text.len() > room {
            lines.push(std::mem::replace(&mut line, text));
        } else {
            line.push(' ');
            line.push_str(&text);
        }
    }
    lines.push(line);
    lines
}

/// Whether the declaration is short: short declarations share a line if there is no source to follow.
fn is_short(declaration: &Declaration) -> bool {
    declaration.meta.req.is_empty()
        && matches!(
            &declaration.kind,
            DeclarationKind::Input { .. }
                | DeclarationKind::Output { .. }
                | DeclarationKind::Event { .. }
                | DeclarationKind::ExternCondition { .. }
                | DeclarationKind::ExternAction { .. }
        )
}
