//! Parser of steps with their bodies, and lists of statements.

use grafsynth_ir::chart::{
    ActionHow, Block, Expr, ForceOrder, Item, Path, Step, StepCount, StepItem, StepItemKind,
    StepRole, Stmt, StmtKind,
};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};
use grafsynth_ir::net::{Meta, Qualifier, Verbatim};
use grafsynth_ir::{Name, Span};
use itertools::Itertools as _;

use super::parser::{Parse, Parser, Separators, short};
use super::token::Kind;
use crate::codes;

/// The qualifiers as words after an action.
pub(crate) fn qualifiers() -> impl Iterator<Item = (&'static str, Qualifier)> {
    let pulse = std::iter::once(("pulse", Qualifier::P));
    pulse.chain(Qualifier::ALL.into_iter().map(|one| (one.letters(), one)))
}

/// The words that begin a clause of a transition, except `internal`.
pub(crate) const CLAUSES: &[&str] =
    &["on", "when", "after", "priority", "restart", "deadline", "do", "req"];

/// Prefix of the event for the completion of a state.
pub(crate) const DONE: &str = "done.state.";

impl Parser<'_> {
    // Steps

    /// Parses `initial step p1 … { … }`, `entry exit step e` or `initial macro step m = fill`.
    pub(crate) fn step_or_macro_step(&mut self, items: &mut Vec<Item>) -> Parse<()> {
        let start = self.peek(0).start;
        let (mut is_initial, mut is_entry, mut is_exit) = (false, false, false);
        loop {
            if self.is_behind_a_step() {
                return Err(self.misplaced(
                    "the role of a step belongs before `step` or `state`",
                    "write it at the beginning of the line, as in `initial step p1`",
                ));
            }
            match self.word(0) {
                "initial" => is_initial = true,
                "entry" => is_entry = true,
                "exit" => is_exit = true,
                _ => break,
            }
            self.advance();
        }
        let item = match self.word(0) {
            "macro" if self.word(1) == "step" => {
                let role = self.step_role(is_initial, is_entry, is_exit)?;
                self.advance();
                Item::MacroStep(self.macro_step(start, role)?)
            }
            "step" => {
                let role = self.step_role(is_initial, is_entry, is_exit)?;
                Item::Step(self.step(start, role)?)
            }
            "enclosing" if self.word(1) == "step" => {
                let role = self.step_role(is_initial, is_entry, is_exit)?;
                self.advance();
                return self.enclosing(items, start, role);
            }
            "state" | "parallel" if !is_entry && !is_exit => {
                return self.state(items, start, StepRole::Initial);
            }
            _ => return Err(self.unexpected("`step`")),
        };
        self.keep(items, item);
        Ok(())
    }

    /// Whether `initial`, `entry` or `exit` is the last word of a line but not the first, as in `step p1 initial`.
    fn is_behind_a_step(&self) -> bool {
        matches!(self.word(0), "initial" | "entry" | "exit")
            && !self.peek(0).new_line
            && self.peek(1).new_line
            && self.previous_end > 0
    }

    /// The role of a step that is declared with these words.
    fn step_role(&mut self, is_initial: bool, is_entry: bool, is_exit: bool) -> Parse<StepRole> {
        if is_initial && (is_entry || is_exit) {
            return Err(self.misplaced(
                "a step of a macro cannot be initial",
                "write `initial macro step NAME = MACRO` where the macro is used, so that its entry step is initial",
            ));
        }
        Ok(match (is_initial, is_entry, is_exit) {
            (true, ..) => StepRole::Initial,
            (false, true, true) => StepRole::MacroEntryExit,
            (false, true, false) => StepRole::MacroEntry,
            (false, false, true) => StepRole::MacroExit,
            (false, false, false) => StepRole::Plain,
        })
    }

    pub(crate) fn step(&mut self, start: u32, role: StepRole) -> Parse<Step> {
        let mut step = self.step_head(role)?;
        if self.kind(0) == Kind::OpenBrace {
            let body = &mut step.body;
            self.braced("the step", Separators::CommaToo, &mut |parser| {
                let item = parser.step_item()?;
                parser.keep(body, item);
                Ok(())
            })?;
        }
        step.body.shrink_to_fit();
        step.meta.span = self.span_from(start);
        Ok(step)
    }

    /// Parses the part of a step before its body, at the word before its name. A priority given here becomes the first item of the body.
    pub(crate) fn step_head(&mut self, role: StepRole) -> Parse<Step> {
        self.advance();
        let name = self.name("the name of the step")?;
        let mut meta = Meta::default();
        let mut priority = None;
        let mut activation_link = None;
        let mut count = None;
        loop {
            if self.attribute(&mut meta)? {
            } else if self.word(0) == "priority"
                && self.kind(1) == Kind::Number
                && !self.peek(0).new_line
            {
                // A priority in the head has the same meaning as in the body.
                let at = self.advance().start;
                let value = self.count("a priority")?;
                let span = self.span_from(at);
                self.once(
                    &mut priority,
                    StepItem { kind: StepItemKind::Priority(value), span },
                    span,
                    "priority",
                );
            } else if self.kind(0) == Kind::Star && !self.peek(0).new_line {
                let span = self.here();
                self.advance();
                self.once(&mut activation_link, (), span, "*");
            } else if self.word(0) == "count"
                && self.kind(1) == Kind::Number
                && !self.peek(0).new_line
            {
                let value = self.step_count()?;
                self.once(&mut count, value, value.span, "count");
            } else {
                break;
            }
        }
        let body = priority.into_iter().collect();
        let activation_link = activation_link.is_some();
        Ok(Step { name, role, activation_link, count, body, meta })
    }

    /// Parses `count 0..5 = 2`.
    fn step_count(&mut self) -> Parse<StepCount> {
        let start = self.advance().start;
        let least = self.peek(0);
        let bounds = self.span(least);
        if self.count("the smallest number")? != 0 {
            self.report(|| {
                Diagnostic::error(codes::RANGE, "the number of activations must begin at 0")
                    .at(bounds, "an inactive step has 0")
                    .help("write 0")
                    .fix(bounds, "0")
            });
        }
        self.expect(Kind::Range, "`..` and the largest number")?;
        let most = self.span(self.peek(0));
        let mut max = self.count("the largest number")?;
        if max == 0 {
            self.report(|| {
                Diagnostic::error(codes::RANGE, "a step with at most 0 activations is never active")
                    .at(most, "at least 1")
                    .help("write 1 or more, or remove the step")
            });
            max = 1;
        }
        let initial =
            if self.eat(Kind::Equal) { Some(self.count("the number at reset")?) } else { None };
        Ok(StepCount { max, initial, span: self.span_from(start) })
    }

    pub(crate) fn step_item(&mut self) -> Parse<StepItem> {
        let start = self.peek(0).start;
        let next = self.kind(1);
        let kind = match self.word(0) {
            "entry" if next == Kind::OpenBrace => {
                self.advance();
                StepItemKind::Entry(self.block("the entry list")?)
            }
            "exit" if next == Kind::OpenBrace => {
                self.advance();
                StepItemKind::Exit(self.block("the exit list")?)
            }
            "on" if self.is_name_beside(1) => {
                self.advance();
                let events = self.events()?;
                let guard = if self.eat_word("when") { Some(self.expr()?) } else { None };
                StepItemKind::On { events, guard, actions: self.block("the statements")? }
            }
            "when" => {
                self.advance();
                let guard = Some(self.expr()?);
                StepItemKind::On {
                    events: Vec::new(),
                    guard,
                    actions: self.block("the statements")?,
                }
            }
            "priority" if next == Kind::Number => {
                self.advance();
                StepItemKind::Priority(self.count("a priority")?)
            }
            "budget" if next == Kind::Number => {
                self.advance();
                StepItemKind::Budget(self.count("a budget")?)
            }
            "task" if self.is_name_beside(1) => {
                self.advance();
                let name = self.name("the name of the task")?;
                let cost = if self.eat_word("cost") {
                    Some(self.count("the cost of the task")?)
                } else {
                    None
                };
                StepItemKind::Task { name, cost, body: self.block("the task")? }
            }
            "code"
                if self.is_name_beside(1) && matches!(self.kind(2), Kind::Text | Kind::RawText) =>
            {
                StepItemKind::Code(self.verbatim()?)
            }
            "force" if self.is_name_beside(1) => self.force()?,
            "set" if self.is_name_beside(1) => self.latch(Qualifier::S)?,
            "reset" if self.is_name_beside(1) => self.latch(Qualifier::R)?,
            "if" | "raise" | "send" | "cancel" | "call"
                if next != Kind::Open && (self.is_name_beside(1) || self.word(0) == "if") =>
            {
                let word = self.word(0);
                return Err(self.misplaced(
                    &format!("`{word}` is not allowed directly in a step"),
                    if word == "if" {
                        "for an output with a condition, write `OUTPUT if CONDITION`; put statements into `entry { … }`, `exit { … }` or `on EVENT { … }`"
                    } else {
                        "put it into `entry { … }`, `exit { … }` or `on EVENT { … }`"
                    },
                ));
            }
            _ => self.action()?,
        };
        Ok(StepItem { kind, span: self.span_from(start) })
    }

    /// Parses a name that may belong to another chart; the dots are part of it.
    fn dotted(&mut self, what: &str) -> Parse<Name> {
        let path = self.path(what)?;
        Ok(Name::new(path.to_string(), path.span()))
    }

    /// Parses events by name. `p.done` is the completion of a state, which is `done.state.p` in a net.
    pub(super) fn events(&mut self) -> Parse<Vec<Name>> {
        let mut names = Vec::new();
        loop {
            let path = self.path("an event")?;
            let span = path.span();
            let text = match path.names.split_last() {
                Some((last, before)) if last.text == "done" && !before.is_empty() => {
                    let before = before.iter().map(|name| name.text.as_str()).join(".");
                    format!("{DONE}{before}")
                }
                _ => path.to_string(),
            };
            self.keep(&mut names, Name::new(text, span));
            if self.kind(0) != Kind::Comma {
                names.shrink_to_fit();
                return Ok(names);
            }
            self.advance();
        }
    }

    /// Parses `set R` or `reset R if c`.
    fn latch(&mut self, qualifier: Qualifier) -> Parse<StepItemKind> {
        self.advance();
        let target = self.dotted("the name of an output")?;
        let condition = self.action_condition()?;
        Ok(StepItemKind::Action {
            target,
            arguments: None,
            how: ActionHow::Qualified(qualifier, None),
            condition,
        })
    }

    fn action_condition(&mut self) -> Parse<Option<Expr>> {
        if self.word(0) == "if" {
            self.advance();
            return Ok(Some(self.expr()?));
        }
        Ok(None)
    }

    /// Parses `R`, `R if c`, `R after 3 s`, `R SD 3 s` or `speed(5)`.
    fn action(&mut self) -> Parse<StepItemKind> {
        if self.word(0) == "not" && self.is_name_beside(1) {
            return Err(self.output_negated());
        }
        if !self.is_name(0) {
            return Err(self.unexpected("an action"));
        }
        let assigns = |kind| matches!(kind, Kind::Assign | Kind::OpenBracket | Kind::Equal);
        let is_assignment =
            assigns(self.kind(1)) || self.kind(1) == Kind::Dot && assigns(self.kind(3));
        if is_assignment && let Some(result) = self.output_assigned() {
            return result;
        }
        if is_assignment {
            return Err(self.misplaced(
                "an assignment is not allowed directly in a step",
                "put it into `entry { … }`, `exit { … }` or `on EVENT { … }`",
            ));
        }
        let target = self.dotted("an action")?;
        let arguments = if self.kind(0) == Kind::Open && !self.peek(0).new_line {
            Some(self.arguments()?)
        } else {
            None
        };
        let how = if self.peek(0).new_line { ActionHow::Bare } else { self.how()? };
        let condition = self.action_condition()?;
        Ok(StepItemKind::Action { target, arguments, how, condition })
    }

    /// Reports `not R` in a step, and skips it.
    fn output_negated(&mut self) -> ErrorReported {
        let start = self.advance().start;
        let shown = short(super::numbers::slice(self.text, self.peek(0)));
        self.advance();
        let place = self.span_from(start);
        let written = format!("`not {shown}`");
        let help = format!("remove {written}; to end a `set {shown}`, write `reset {shown}`");
        self.report(|| not_an_action(&written, place).help(help));
        ErrorReported
    }

    /// Reports an assignment of a constant to a Boolean output in a step, and reads `pump = 1` as `pump` and `pump = 0` as nothing. `None`
    /// if this is not such an assignment.
    fn output_assigned(&mut self) -> Option<Parse<StepItemKind>> {
        let token = self.peek(0);
        let name = super::numbers::name_of(self.text, token);
        let is_output =
            self.numbers.is_some_and(|numbers| numbers.is_output(name) && !numbers.contains(name));
        if !is_output || !matches!(self.kind(1), Kind::Equal | Kind::Assign) {
            return None;
        }
        let value = super::numbers::slice(self.text, self.peek(2));
        let is_on = match value.to_ascii_lowercase().as_str() {
            "1" | "true" | "on" => true,
            "0" | "false" | "off" => false,
            _ => return None,
        };
        let shown = short(super::numbers::slice(self.text, token));
        let target = self.name("an action").map(|name| vec![name]);
        let sign = self.advance();
        self.advance();
        let mut span = self.span_from(token.start);
        let sign = short(super::numbers::slice(self.text, sign));
        let written = format!("`{shown} {sign} {value}`");
        if is_on {
            let message = format!("{written} has a value, but an action of a step has none");
            self.report(|| {
                Diagnostic::error(codes::MISPLACED, message)
                    .plural(written, "", "have values, but actions of a step have none")
                    .at(span, "on while the step is active")
                    .help("write only the name of the output")
                    .fix(span, shown)
            });
            return Some(target.map(|names| {
                let path = Path { names };
                StepItemKind::Action {
                    target: Name::new(path.to_string(), path.span()),
                    arguments: None,
                    how: ActionHow::Bare,
                    condition: None,
                }
            }));
        }
        // The separator after the item is removed too.
        let next = self.peek(1);
        if matches!(self.kind(0), Kind::Semicolon | Kind::Comma) && !next.new_line {
            span.end = next.start;
        }
        let place = self.span_from(token.start);
        self.report(|| {
            not_an_action(&written, place).help("remove the name and its value").fix(span, "")
        });
        Some(Err(ErrorReported))
    }

    fn how(&mut self) -> Parse<ActionHow> {
        let word = self.word(0);
        match word {
            "after" => {
                self.advance();
                return Ok(ActionHow::After(self.duration()?));
            }
            "for" => {
                self.advance();
                return Ok(ActionHow::For(self.duration()?));
            }
            "" | "if" => return Ok(ActionHow::Bare),
            _ => {}
        }
        if let Some((_, qualifier)) = qualifiers().find(|(other, _)| *other == word) {
            self.advance();
            let duration = if qualifier.is_timed() { Some(self.duration()?) } else { None };
            return Ok(ActionHow::Qualified(qualifier, duration));
        }
        let span = self.here();
        let words = ["after", "for", "if"].into_iter().chain(qualifiers().map(|(word, _)| word));
        let near = nearest(word, words.filter(|word| word.len() > 2));
        if let Some(near) = near {
            self.report(|| {
                Diagnostic::error(
                    codes::UNKNOWN_WORD,
                    format!("unknown qualifier `{}`", short(word)),
                )
                .at(span, "unknown word")
                .help(format!("did you mean `{near}`?"))
                .fix(span, near)
            });
            return Err(ErrorReported);
        }
        // Anything else is the next action on the same line. The block reports the missing separator.
        Ok(ActionHow::Bare)
    }

    fn arguments(&mut self) -> Parse<Vec<Expr>> {
        self.expect(Kind::Open, "`(`")?;
        let mut arguments = Vec::new();
        while self.kind(0) != Kind::Close {
            let argument = self.expr()?;
            self.keep(&mut arguments, argument);
            if !self.eat(Kind::Comma) {
                break;
            }
        }
        self.expect(Kind::Close, "`,` or `)`")?;
        arguments.shrink_to_fit();
        Ok(arguments)
    }

    /// Parses `force g { s3 }`, `force g init` or `force g hold`.
    fn force(&mut self) -> Parse<StepItemKind> {
        self.advance();
        let target = self.path("the name of a chart")?;
        let order = match self.word(0) {
            "init" => {
                self.advance();
                ForceOrder::Init
            }
            "hold" => {
                self.advance();
                ForceOrder::Hold
            }
            _ => {
                let mut steps = Vec::new();
                self.braced("the situation", Separators::CommaToo, &mut |parser| {
                    let path = parser.path("the name of a step")?;
                    parser.keep(&mut steps, path);
                    // Steps of a situation need no separator.
                    while parser.is_name_beside(0) {
                        let path = parser.path("the name of a step")?;
                        parser.keep(&mut steps, path);
                    }
                    Ok(())
                })?;
                ForceOrder::Situation(steps)
            }
        };
        Ok(StepItemKind::Force { target, order })
    }

    /// Parses `code c "…"`.
    fn verbatim(&mut self) -> Parse<Verbatim> {
        self.advance();
        let language = self.name("the name of a target language")?.text;
        let text = self.text("the text in quotes")?;
        Ok(Verbatim { language, text })
    }

    // Statements

    /// Parses `{ n := n + 1; raise e }`.
    pub(crate) fn block(&mut self, what: &str) -> Parse<Block> {
        let mut block = Block::new();
        self.braced(what, Separators::Semicolon, &mut |parser| {
            let stmt = parser.stmt()?;
            parser.keep(&mut block, stmt);
            Ok(())
        })?;
        block.shrink_to_fit();
        Ok(block)
    }

    fn stmt(&mut self) -> Parse<Stmt> {
        let start = self.peek(0).start;
        let is_keyword =
            !matches!(self.kind(1), Kind::Assign | Kind::OpenBracket | Kind::Dot | Kind::Equal);
        let kind = match self.word(0) {
            "raise" if is_keyword => {
                self.advance();
                StmtKind::Raise(self.dotted("an event")?)
            }
            "send" if is_keyword => self.send()?,
            "cancel" if is_keyword => {
                self.advance();
                StmtKind::Cancel(self.name("the name of a send")?)
            }
            "call" if is_keyword && self.is_name(1) => {
                self.advance();
                let function = self.dotted("an extern action")?;
                let arguments =
                    if self.kind(0) == Kind::Open { self.arguments()? } else { Vec::new() };
                StmtKind::Call { function, arguments }
            }
            "code" if is_keyword && self.is_name(1) => StmtKind::Code(self.verbatim()?),
            "if" => self.conditional()?,
            _ => self.assignment()?,
        };
        Ok(Stmt { kind, span: self.span_from(start) })
    }

    fn send(&mut self) -> Parse<StmtKind> {
        self.advance();
        let event = self.dotted("an event")?;
        let after = if self.eat_word("after") { Some(self.duration()?) } else { None };
        let slot = if self.word(0) == "as" && !self.peek(0).new_line {
            self.advance();
            Some(self.name("the name of the send")?)
        } else {
            None
        };
        Ok(StmtKind::Send { event, after, slot })
    }

    fn conditional(&mut self) -> Parse<StmtKind> {
        self.advance();
        let condition = self.expr()?;
        let then = self.block("the statements of this branch")?;
        let mut otherwise = Block::new();
        if self.eat_word("else") {
            if self.word(0) == "if" {
                self.enter()?;
                let stmt = self.stmt()?;
                self.leave();
                self.keep(&mut otherwise, stmt);
                otherwise.shrink_to_fit();
            } else {
                otherwise = self.block("the statements of `else`")?;
            }
        }
        Ok(StmtKind::If { condition, then, otherwise })
    }

    /// Parses `n := 1`, `v[i] := 1`, or `f(1)` as a short form of `call f(1)`.
    fn assignment(&mut self) -> Parse<StmtKind> {
        if !self.is_name(0) {
            return Err(self.unexpected("a statement"));
        }
        if self.is_name_beside(1) {
            let word = self.word(0);
            let near = nearest(word, ["raise", "send", "cancel", "call", "code", "if"]);
            let span = self.here();
            self.report(|| {
                let finding = Diagnostic::error(
                    codes::UNKNOWN_WORD,
                    format!("unknown statement `{}`", short(word)),
                );
                finding.unknown_word(span, near, "an assignment is written `n := n + 1`")
            });
            return Err(ErrorReported);
        }
        let function_or_target = self.name("a statement")?;
        if self.kind(0) == Kind::Open && !self.peek(0).new_line {
            let arguments = self.arguments()?;
            return Ok(StmtKind::Call { function: function_or_target, arguments });
        }
        let target = self.path_from(function_or_target)?;
        let index = if self.eat(Kind::OpenBracket) {
            let index = self.expr()?;
            self.expect(Kind::CloseBracket, "`]`")?;
            Some(index)
        } else {
            None
        };
        if self.kind(0) == Kind::Equal {
            let span: Span = self.here();
            self.report(|| {
                Diagnostic::error(codes::UNEXPECTED, "expected `:=`, found `=`")
                    .at(span, "`=` compares, `:=` assigns")
                    .help("write `:=`")
                    .fix(span, ":=")
            });
            self.advance();
        } else {
            self.expect(Kind::Assign, "`:=` and the new value")?;
        }
        let value = self.expr()?;
        Ok(StmtKind::Assign { target, index, value })
    }
}

/// The finding about an item that would switch an output off.
fn not_an_action(written: &str, place: Span) -> Diagnostic {
    Diagnostic::error(codes::MISPLACED, format!("{written} is not an action of a step"))
        .plural(written, "", "are not actions of a step")
        .at(place, "an output is off unless an active step names it")
}
