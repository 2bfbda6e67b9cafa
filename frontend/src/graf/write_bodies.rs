//! Writes enclosing steps and states. The actions of the step and its contents share one pair of braces, in source order.

use super::layout::text;
use super::names::{self, Position};
use super::token::Kind;
use super::write::Writer;
use super::write_steps::step_head;
use super::write_text::{attributes, paths, role_words};
use grafsynth_ir::Span;
use grafsynth_ir::chart::{
    Block, Chart, Enclosing, History, Item, Path, State, Step, StepItem, StepItemKind, StepRole,
};

/// One part of the body.
enum Piece<'a> {
    Does(&'a StepItem),
    Initial(&'a [Path], &'a Block),
    History(&'a History),
    /// A range of the items.
    Lies(std::ops::Range<usize>),
}

impl Writer<'_> {
    pub(super) fn enclosing(&mut self, enclosing: &Enclosing) {
        let words = format!("{}enclosing step", role_words(enclosing.step.role));
        let (head, body) = head_and_body(&words, &enclosing.step);
        let pieces = body.into_iter().map(Piece::Does).collect();
        self.with_content(head, &enclosing.step, pieces, &enclosing.items, false);
    }

    /// Writes a state; inside a parallel state it is a region.
    pub(super) fn state(&mut self, state: &State, is_region: bool) {
        let word = match (state.is_parallel, is_region && state.step.role == StepRole::Plain) {
            (true, _) => "parallel",
            (false, true) => "region",
            (false, false) => "state",
        };
        let words = format!("{}{word}", role_words(state.step.role));
        let (head, body) = head_and_body(&words, &state.step);
        let is_plain =
            state.items.is_empty() && state.histories.is_empty() && state.initial.is_none();
        if is_plain && !state.is_parallel {
            return self.step_with_body(head, &state.step, &body);
        }
        let mut pieces: Vec<Piece<'_>> = body.into_iter().map(Piece::Does).collect();
        if let Some((targets, content)) = &state.initial {
            pieces.push(Piece::Initial(targets, content));
        }
        pieces.extend(state.histories.iter().map(Piece::History));
        self.with_content(head, &state.step, pieces, &state.items, state.is_parallel);
    }

    /// Writes the body of a chart.
    pub(super) fn content_of_chart(&mut self, chart: &Chart) {
        let content = Block::new();
        let mut pieces = Vec::new();
        if !chart.initial.is_empty() {
            pieces.push(Piece::Initial(&chart.initial, &content));
        }
        let pieces = self.in_order(pieces, &chart.items);
        self.pieces(&pieces, &chart.items, chart.span.end, false);
    }

    fn with_content<'p>(
        &mut self,
        head: String,
        step: &Step,
        pieces: Vec<Piece<'p>>,
        items: &[Item],
        is_parallel: bool,
    ) {
        let pieces = self.in_order(pieces, items);
        let span = step.meta.span;
        self.container(text(head), span, step.name.span.end, pieces.is_empty(), |writer| {
            writer.pieces(&pieces, items, span.end, is_parallel);
        });
    }

    fn pieces(&mut self, pieces: &[Piece<'_>], items: &[Item], end: u32, is_parallel: bool) {
        for piece in pieces {
            match piece {
                Piece::Does(item) => self.step_item(item),
                Piece::Initial(targets, content) => self.initial(targets, content, end),
                Piece::History(history) => self.history(history),
                Piece::Lies(range) => {
                    if self.source.is_none() {
                        self.lines.blank();
                    }
                    self.items_of(&items[range.clone()], is_parallel);
                }
            }
        }
    }

    /// The pieces and the items in source order. Without a source, items come last.
    fn in_order<'p>(&self, pieces: Vec<Piece<'p>>, items: &[Item]) -> Vec<Piece<'p>> {
        let Some(_) = self.source else {
            let mut all = pieces;
            if !items.is_empty() {
                all.push(Piece::Lies(0..items.len()));
            }
            return all;
        };
        let mut all: Vec<(u32, Piece<'p>)> =
            pieces.into_iter().map(|piece| (piece.start(), piece)).collect();
        all.extend(
            items
                .iter()
                .enumerate()
                .map(|(index, item)| (start_of(item).start, Piece::Lies(index..index + 1))),
        );
        all.sort_by_key(|(start, _)| *start);
        let mut joined: Vec<Piece<'p>> = Vec::new();
        for (_, piece) in all {
            // Consecutive items stay in one range, so that declarations with a shared keyword are written together.
            if let (Some(Piece::Lies(last)), Piece::Lies(next)) = (joined.last_mut(), &piece)
                && last.end == next.start
            {
                last.end = next.end;
                continue;
            }
            joined.push(piece);
        }
        joined
    }

    /// Writes `initial -> a do { … }`. The tree has only the spans of the targets and of the statements, so the writer searches for the
    /// keyword before the targets.
    fn initial(&mut self, targets: &[Path], content: &Block, limit: u32) {
        let first = targets.first().map_or(Span::default(), Path::span);
        let last = targets.last().map_or(first, Path::span);
        let start = self.source.as_ref().map_or(first.start, |source| {
            let before = source.text.get(..first.start as usize).unwrap_or("");
            before.rfind("initial").and_then(|at| u32::try_from(at).ok()).unwrap_or(first.start)
        });
        let end = match content.last() {
            None => last.end,
            Some(stmt) => self.find(Kind::CloseBrace, stmt.span.end, limit).1,
        };
        let head = format!("initial -> {}", paths(targets, " & "));
        let span = Span { start, end, ..first };
        self.head_and_content(head, content, span, last.end);
    }

    fn history(&mut self, history: &History) {
        let deep = if history.is_deep { "deep " } else { "" };
        let mut head =
            format!("history {deep}{}", names::name(&history.name.text, Position::History));
        let from = history.default.last().map_or(history.name.span.end, |path| path.span().end);
        if !history.default.is_empty() {
            head.push_str(&format!(" -> {}", paths(&history.default, " & ")));
        }
        head.push_str(&attributes(&history.meta));
        self.head_and_content(head, &history.content, history.meta.span, from);
    }

    /// Writes a head, and `do { … }` if there is content.
    fn head_and_content(&mut self, head: String, content: &Block, span: Span, from: u32) {
        if content.is_empty() {
            self.simple(span, head);
        } else {
            self.list(text(head + " do"), content, span, from);
        }
    }
}

/// The head and the items of the body. A `priority` in the body would be read as an item of the chart, so the priority of the step is
/// written before the brace.
fn head_and_body<'s>(words: &str, step: &'s Step) -> (String, Vec<&'s StepItem>) {
    let mut head = step_head(words, step);
    let mut body = Vec::with_capacity(step.body.len());
    for item in &step.body {
        if let StepItemKind::Priority(priority) = item.kind {
            head.push_str(&format!(" priority {priority}"));
        } else {
            body.push(item);
        }
    }
    (head, body)
}

impl Piece<'_> {
    fn start(&self) -> u32 {
        match self {
            Piece::Does(item) => item.span.start,
            Piece::Initial(targets, _) => targets.first().map_or(0, |path| path.span().start),
            Piece::History(history) => history.meta.span.start,
            Piece::Lies(_) => 0,
        }
    }
}

fn start_of(item: &Item) -> Span {
    match item {
        Item::Setting(one) => one.span,
        Item::Declaration(one) => one.meta.span,
        Item::Step(one) => one.meta.span,
        Item::Transition(one) => one.meta.span,
        Item::Macro(one) => one.meta.span,
        Item::MacroStep(one) => one.meta.span,
        Item::Enclosing(one) => one.step.meta.span,
        Item::State(one) => one.step.meta.span,
        Item::Use(one) => one.meta.span,
        Item::Action(one) => one.meta.span,
        Item::Emergency(one) => one.meta.span,
        Item::Property(one) => one.meta.span,
        Item::Place(one) => one.span,
        Item::Board(one) => one.span,
    }
}
