//! Parser of transitions: their name, paths and clauses.

use grafsynth_ir::chart::{Length, Path, Transition};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};

use itertools::Itertools as _;

use super::parser::{Parse, Parser, short};
use super::steps::CLAUSES;
use super::token::{Kind, SINK};
use crate::codes;

impl Parser<'_> {
    /// Parses `[name:] SOURCES -> TARGETS` and its clauses.
    pub(crate) fn transition(&mut self) -> Parse<Transition> {
        let start = self.peek(0).start;
        let mut transition = Transition::default();
        if (self.is_name(0) || self.kind(0) == Kind::Number) && self.kind(1) == Kind::Colon {
            transition.name = Some(self.name("the name of a transition")?);
            self.advance();
        }
        if self.word(0) == "in" && self.is_name_beside(1) {
            // A reaction does not leave its step.
            self.advance();
            self.paths(&mut transition.sources)?;
            transition.is_internal = true;
            return self.transition_rest(start, transition);
        }
        if self.kind(0) != Kind::Arrow {
            if !self.is_name(0) && self.kind(0) != Kind::Number
                || transition.name.is_some() && self.peek(0).new_line
            {
                return Err(self.unexpected("the preceding steps, or `->`"));
            }
            self.paths(&mut transition.sources)?;
        }
        let arrow = self.here();
        self.expect(Kind::Arrow, "`->`")?;
        let is_numbered = self.kind(0) == Kind::Number && !self.peek(0).new_line;
        if (self.is_name_beside(0) || is_numbered) && !self.begins_clause() {
            let is_quoted = self.kind(0) == Kind::Quoted;
            self.paths(&mut transition.targets)?;
            if !is_quoted && self.is_sink(&transition) {
                transition.targets.clear();
                transition.is_sink = true;
            }
            self.second_arrow(&transition);
        } else if !transition.sources.is_empty() {
            self.bare_arrows.push(arrow);
        }
        self.transition_rest(start, transition)
    }

    /// Reports `a -> b -> c`: these are two transitions, and the second leaves no step, which is rarely intended.
    fn second_arrow(&mut self, transition: &Transition) {
        let arrow = self.peek(0);
        if arrow.kind != Kind::Arrow || arrow.new_line || transition.sources.is_empty() {
            return;
        }
        let span = self.span(arrow);
        let from = match transition.targets.as_slice() {
            [only] => only.to_string(),
            _ => "b".to_owned(),
        };
        self.report(|| {
            Diagnostic::warning(
                codes::AMBIGUOUS,
                "a second arrow begins another transition, which leaves no step",
            )
            .at(span, "the first transition ends before this arrow")
            .help(format!("write the second transition on a line of its own, as in `{from} -> …`"))
        });
    }

    /// Whether this is `a -> sink`, and no step of the file is named `sink`.
    fn is_sink(&self, transition: &Transition) -> bool {
        let [target] = transition.targets.as_slice() else { return false };
        let [name] = target.names.as_slice() else { return false };
        name.text == SINK
            && !transition.sources.is_empty()
            && self.numbers.is_none_or(|names| !names.has_sink)
    }

    fn transition_rest(&mut self, start: u32, mut transition: Transition) -> Parse<Transition> {
        self.clauses(&mut transition)?;
        transition.meta.span = self.span_from(start);
        Ok(transition)
    }

    pub(crate) fn paths(&mut self, paths: &mut Vec<Path>) -> Parse<()> {
        loop {
            let path = self.path("a step")?;
            self.keep(paths, path);
            if !self.eat(Kind::Ampersand) {
                paths.shrink_to_fit();
                return Ok(());
            }
        }
    }

    /// Whether a clause of a transition begins here: a word followed by what the clause requires.
    fn begins_clause(&self) -> bool {
        let next = self.kind(1);
        match self.word(0) {
            "when" => !matches!(next, Kind::Ampersand | Kind::Colon | Kind::Arrow | Kind::Dot),
            // `a -> on when b` leads to a step named `on`.
            "on" => self.is_name_beside(1) && !CLAUSES.contains(&self.word(1)),
            "after" if self.is_name_beside(1) => !CLAUSES.contains(&self.word(1)),
            "after" | "deadline" => matches!(next, Kind::Number | Kind::Fraction),
            // A `priority` on a line of its own belongs to the chart.
            "priority" => next == Kind::Number && !self.peek(0).new_line,
            "restart" => {
                self.peek(1).new_line
                    || !matches!(next, Kind::Ampersand | Kind::Colon | Kind::Arrow | Kind::Dot)
            }
            "do" => next == Kind::OpenBrace,
            "req" => matches!(next, Kind::Text | Kind::RawText),
            _ => matches!(self.kind(0), Kind::Text | Kind::RawText),
        }
    }

    /// Whether the word `internal` after a target is a clause, and not the declaration of an internal event.
    fn begins_internal(&self) -> bool {
        self.word(0) == "internal"
            && !self.peek(0).new_line
            && (self.peek(1).new_line
                || self.word(1) != "event"
                    && !matches!(
                        self.kind(1),
                        Kind::Ampersand | Kind::Colon | Kind::Arrow | Kind::Dot
                    ))
    }

    pub(crate) fn clauses(&mut self, transition: &mut Transition) -> Parse<()> {
        let mut events = None;
        let mut actions = None;
        let mut restart = None;
        let mut internal = None;
        loop {
            if self.begins_internal() {
                let span = self.here();
                self.advance();
                self.once(&mut internal, (), span, "internal");
                continue;
            }
            if !self.begins_clause() {
                break;
            }
            if self.attribute(&mut transition.meta)? {
                continue;
            }
            let start = self.peek(0).start;
            let word = self.word(0);
            self.advance();
            match word {
                "on" => {
                    let names = self.events()?;
                    let span = self.span_from(start);
                    self.once(&mut events, names, span, word);
                }
                "when" => {
                    let guard = self.expr()?;
                    let span = self.span_from(start);
                    self.once(&mut transition.guard, guard, span, word);
                }
                "after" => {
                    let length = if let Some(ns) = self.iec_duration() {
                        Length::Ns(ns)
                    } else if self.is_name(0) {
                        Length::Named(self.path("a duration")?)
                    } else {
                        Length::Ns(self.duration()?)
                    };
                    let span = self.span_from(start);
                    self.once(&mut transition.after, (length, span), span, word);
                }
                "priority" => {
                    let value = self.count("a priority")?;
                    let span = self.span_from(start);
                    self.once(&mut transition.priority, value, span, word);
                }
                "deadline" => {
                    let duration = self.duration()?;
                    let span = self.span_from(start);
                    self.once(&mut transition.deadline_ns, duration, span, word);
                }
                "restart" => {
                    let span = self.span_from(start);
                    self.once(&mut restart, (), span, word);
                }
                _ => {
                    let block = self.block("the actions")?;
                    let span = self.span_from(start);
                    self.once(&mut actions, block, span, word);
                }
            }
        }
        transition.events = events.unwrap_or_default();
        transition.actions = actions.unwrap_or_default();
        transition.restart = restart.is_some();
        transition.is_internal |= internal.is_some();
        self.clause_misspelt(transition)
    }

    /// Reports an unknown word on the same line after a transition, which can only be a misspelt clause.
    fn clause_misspelt(&mut self, transition: &Transition) -> Parse<()> {
        if !self.is_name_beside(0)
            || matches!(self.kind(1), Kind::Colon | Kind::Arrow | Kind::Ampersand | Kind::Dot)
            || super::items::ITEM_WORDS.contains(&self.word(0))
        {
            return Ok(());
        }
        let word = self.word(0);
        let span = self.here();
        if matches!(word, "or" | "and") && !transition.events.is_empty() {
            let names = transition.events.iter().map(|name| short(&name.text)).join(", ");
            self.report(|| {
                let finding = Diagnostic::error(
                    codes::UNEXPECTED,
                    format!("a clause `on` has no `{word}`"),
                )
                .at(span, "`on` names events, not a condition");
                finding.help(if word == "or" {
                    format!("replace each `or` between events by `,`; for inputs write `when {names} or …`")
                } else {
                    format!("replace this `and` by `when` and a condition; for inputs write `when {names} and …`")
                })
            });
            return Err(ErrorReported);
        }
        let near = nearest(
            word,
            ["on", "when", "after", "priority", "internal", "restart", "deadline", "do", "req"],
        );
        self.report(|| {
            let finding = Diagnostic::error(codes::UNKNOWN_WORD, format!("unknown clause `{}` of a transition", short(word)));
            finding.unknown_word(span, near, "the clauses are `on`, `when`, `after`, `priority`, `internal`, `restart`, `deadline`, `req`, `do` and a label in quotes")
        });
        Err(ErrorReported)
    }
}
