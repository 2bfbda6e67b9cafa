//! Parser of enclosing steps, states, parallel states and their regions. Their bodies contain the actions of the step and other items.

use grafsynth_ir::chart::{Block, Enclosing, History, Item, Path, State, Step, StepRole};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::Meta;

use super::parser::{Parse, Parser, RESERVED, Separators};
use super::token::Kind;
use crate::codes;

/// The contents of a body, besides the actions of the step itself.
#[derive(Default)]
struct Content {
    items: Vec<Item>,
    initial: Option<(Vec<Path>, Block)>,
    histories: Vec<History>,
}

/// The kind of body, which decides what it may contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Context {
    Enclosing,
    State,
    Parallel,
}

impl Parser<'_> {
    /// Parses `enclosing step run * { … }`, at `step`.
    pub(crate) fn enclosing(
        &mut self,
        items: &mut Vec<Item>,
        start: u32,
        role: StepRole,
    ) -> Parse<()> {
        let mut step = self.step_head(role)?;
        let mut content = Content::default();
        if self.kind(0) == Kind::OpenBrace {
            self.body_of("the enclosing step", Context::Enclosing, &mut step, &mut content)?;
        }
        step.meta.span = self.span_from(start);
        self.keep(items, Item::Enclosing(Enclosing { step, items: content.items }));
        Ok(())
    }

    /// Parses `state a { … }`, `parallel p { … }` or `region r { … }`, at that word.
    pub(crate) fn state(&mut self, items: &mut Vec<Item>, start: u32, role: StepRole) -> Parse<()> {
        let is_parallel = self.word(0) == "parallel";
        let mut step = self.step_head(role)?;
        let mut content = Content::default();
        if self.kind(0) == Kind::OpenBrace {
            let around = if is_parallel { Context::Parallel } else { Context::State };
            self.body_of("the state", around, &mut step, &mut content)?;
        }
        step.meta.span = self.span_from(start);
        let Content { items: inner, initial, histories } = content;
        let state = State { step, is_parallel, initial, histories, items: inner };
        self.keep(items, Item::State(state));
        Ok(())
    }

    /// Parses `final state f { … }`, at `state`. It contains no states, so it is a step.
    pub(crate) fn final_state(&mut self, start: u32) -> Parse<Step> {
        self.step(start, StepRole::Final)
    }

    fn body_of(
        &mut self,
        what: &str,
        around: Context,
        step: &mut Step,
        content: &mut Content,
    ) -> Parse<()> {
        self.braced(what, Separators::Mixed, &mut |parser| {
            let start = parser.peek(0).start;
            let word = parser.word(0);
            if word == "initial" && parser.kind(1) == Kind::Arrow && around != Context::Enclosing {
                return parser.initial_transition(content);
            }
            if word == "history" && parser.is_name_beside(1) && around != Context::Enclosing {
                return parser.history(&mut content.histories);
            }
            if word == "region" && parser.is_name_beside(1) && around == Context::Parallel {
                return parser.state(&mut content.items, start, StepRole::Plain);
            }
            if parser.begins_chart_item() {
                return parser.item(&mut content.items);
            }
            parser.item_of_step(step)
        })?;
        step.body.shrink_to_fit();
        Ok(())
    }

    fn item_of_step(&mut self, step: &mut Step) -> Parse<()> {
        let item = self.step_item()?;
        self.keep(&mut step.body, item);
        if !self.begins_chart_item() {
            self.separated(Separators::CommaToo);
        }
        Ok(())
    }

    /// Parses `initial -> a & b do { … }`.
    fn initial_transition(&mut self, content: &mut Content) -> Parse<()> {
        let start = self.advance().start;
        self.advance();
        let mut targets = Vec::new();
        self.paths(&mut targets)?;
        let list = self.content()?;
        let span = self.span_from(start);
        self.once(&mut content.initial, (targets, list), span, "initial ->");
        Ok(())
    }

    /// Parses `initial -> a.b & c.d` of a whole chart. A `do` list is an error: statements belong in the `entry` list of a state that the
    /// reset enters.
    pub(crate) fn initial_of_chart(&mut self, initial: &mut Option<Vec<Path>>) -> Parse<()> {
        let mut content = Content::default();
        let start = self.peek(0).start;
        self.initial_transition(&mut content)?;
        let span = self.span_from(start);
        if let Some((targets, list)) = content.initial {
            if let Some(first) = list.first() {
                let place = first.span;
                self.report(|| {
                    Diagnostic::error(
                        codes::MISPLACED,
                        "the initial transition of a chart has no content",
                    )
                    .at(place, "not allowed here")
                    .help("put it into the `entry` list of the state that is entered")
                });
            }
            self.once(initial, targets, span, "initial ->");
        }
        Ok(())
    }

    /// Parses `history H -> a do { … }` or `history deep H`.
    fn history(&mut self, histories: &mut Vec<History>) -> Parse<()> {
        let start = self.advance().start;
        let is_deep = self.word(0) == "deep" && self.is_name_beside(1);
        if is_deep {
            self.advance();
        }
        let name = self.name("the name of the history")?;
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        let mut default = Vec::new();
        // An arrow on the next line begins a source transition.
        if self.kind(0) == Kind::Arrow && !self.peek(0).new_line {
            self.advance();
            self.paths(&mut default)?;
            self.attributes(&mut meta)?;
        }
        let content = self.content()?;
        self.attributes(&mut meta)?;
        meta.span = self.span_from(start);
        self.keep(histories, History { name, is_deep, default, content, meta });
        Ok(())
    }

    /// Parses an optional `do { … }`.
    fn content(&mut self) -> Parse<Block> {
        if self.word(0) == "do" && self.kind(1) == Kind::OpenBrace {
            self.advance();
            return self.block("the content");
        }
        Ok(Block::new())
    }

    /// Reports and skips an item that belongs inside a state.
    pub(crate) fn outside_of_states(&mut self) -> Parse<()> {
        let span = self.here();
        let (message, help) = match self.word(0) {
            "region" => (
                "a region must be inside a parallel state",
                "write `parallel NAME { … }` around it",
            ),
            "history" => (
                "a history must be inside a state",
                "write it between the braces of the state that it remembers",
            ),
            _ => (
                "an initial transition must be inside a state or a chart",
                "to name a step `initial`, write it in backquotes",
            ),
        };
        self.report(|| {
            Diagnostic::error(codes::MISPLACED, message).at(span, "not allowed here").help(help)
        });
        let mut content = Content::default();
        match self.word(0) {
            "region" => self.state(&mut content.items, span.start, StepRole::Plain),
            "history" => self.history(&mut content.histories),
            _ => self.initial_transition(&mut content),
        }
    }

    /// Whether the next item of a body is an item of the chart, and not an item of the step.
    fn begins_chart_item(&self) -> bool {
        if self.kind(0) == Kind::Arrow {
            return true;
        }
        if !self.is_name(0) {
            return false;
        }
        match self.kind(1) {
            // An arrow on the next line begins a source transition.
            Kind::Arrow => return !self.peek(1).new_line,
            Kind::Ampersand | Kind::Colon => return true,
            // `a.b -> c` is a transition; `a.b` alone is an output of another chart.
            Kind::Dot => {
                return match self.kind(3) {
                    Kind::Arrow => !self.peek(3).new_line,
                    Kind::Ampersand | Kind::Dot => true,
                    _ => false,
                };
            }
            _ => {}
        }
        let next = self.word(1);
        let then_name = self.is_name_beside(1) && !RESERVED.contains(&next);
        match self.word(0) {
            "step" | "state" | "parallel" | "region" | "history" | "macro" | "input" | "output"
            | "var" | "const" | "event" | "timer" | "extern" | "registered" | "mealy"
            | "synchronous" | "assert" | "assume" | "action" | "place" | "device" | "use"
            | "in" | "conflict" | "evolution" | "schedule" | "fire" | "assign" | "actions"
            | "events" | "shared" => then_name,
            // `emergency` is not allowed here either. If it were read as an action, the message would be about an action of that name.
            "emergency" => {
                then_name
                    && !matches!(next, "for" | "after")
                    && !super::steps::qualifiers().any(|(word, _)| word == next)
            }
            "initial" => matches!(next, "step" | "macro" | "enclosing" | "state" | "parallel"),
            "final" => matches!(next, "state" | "scan"),
            "entry" | "exit" => {
                matches!(next, "step" | "entry" | "exit" | "enclosing")
                    || next == "macro" && self.word(2) == "step"
            }
            "enclosing" => next == "step",
            "internal" => next == "event",
            "priority" | "tick" | "queue" => {
                matches!(self.kind(1), Kind::Number | Kind::Fraction)
            }
            _ => false,
        }
    }
}
