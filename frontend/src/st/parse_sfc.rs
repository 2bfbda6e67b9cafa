//! Parser of sequential function charts in text: steps, transitions, actions.

use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};
use grafsynth_ir::net::Qualifier;

use super::ast::{Action, Element, Role, Sfc, Step, Transition, Use};
use super::lexer::Kind;
use super::parse::{Parse, Parser};
use super::symbol::{Ident, Symbol, spells};
use crate::codes;

/// The qualifier with this name.
pub(crate) fn qualifier(text: &str) -> Option<Qualifier> {
    Qualifier::ALL.into_iter().find(|one| spells(text, one.letters()))
}

impl Parser<'_> {
    /// Parses the elements of a chart up to the end of its unit.
    pub(crate) fn sfc(&mut self, end: &str) -> Sfc {
        let mut sfc = Sfc::default();
        loop {
            let word = self.word(0);
            if self.kind(0) == Kind::End || word == end {
                return sfc;
            }
            let before = self.at;
            let result = match word.as_str() {
                "INITIAL_STEP" | "STEP" => {
                    self.step().map(|step| sfc.elements.push(Element::Step(step)))
                }
                "TRANSITION" => self
                    .transition()
                    .map(|transition| sfc.elements.push(Element::Transition(transition))),
                "ACTION" => self.action().map(|action| sfc.actions.push(action)),
                "PROGRAM" | "FUNCTION" | "FUNCTION_BLOCK" | "CONFIGURATION" => return sfc,
                _ if self.kind(0) == Kind::Semicolon => {
                    self.advance();
                    Ok(())
                }
                _ => {
                    let span = self.here();
                    Err(self.report(|| {
                        let finding = Diagnostic::error(
                            codes::ST_UNEXPECTED,
                            "expected a step, a transition or an action",
                        );
                        let known = ["INITIAL_STEP", "STEP", "TRANSITION", "ACTION"];
                        match nearest(&word, known) {
                            Some(near) => {
                                finding
                                    .at(span, "unknown word")
                                    .help(format!("did you mean `{near}`?"))
                                    .fix(span, near)
                            }
                            None => finding.at(span, "not allowed here").help(
                                "move statements into an `ACTION name: .. END_ACTION`, or remove this",
                            ),
                        }
                    }))
                }
            };
            if result.is_err() {
                self.lose(before + 1);
                if self.at == before {
                    self.advance();
                }
                self.skip_element(end);
            }
        }
    }

    fn skip_element(&mut self, end: &str) {
        loop {
            let word = self.word(0);
            if self.kind(0) == Kind::End
                || word == end
                || matches!(
                    word.as_str(),
                    "INITIAL_STEP"
                        | "STEP"
                        | "TRANSITION"
                        | "ACTION"
                        | "PROGRAM"
                        | "FUNCTION"
                        | "FUNCTION_BLOCK"
                        | "CONFIGURATION"
                )
            {
                return;
            }
            self.advance();
            if matches!(word.as_str(), "END_STEP" | "END_TRANSITION" | "END_ACTION") {
                return;
            }
        }
    }

    fn step(&mut self) -> Parse<Step> {
        let start = self.peek(0).start;
        let is_initial = self.word(0) == "INITIAL_STEP";
        self.advance();
        let name = self.name("the name of the step")?;
        self.expect(Kind::Colon, "`:`")?;
        let label = self.label();
        let mut uses = Vec::new();
        while !self.take_word("END_STEP") {
            if self.take(Kind::Semicolon) {
                continue;
            }
            if self.at_end_of_list() {
                return Err(self.expected("an action or `END_STEP`"));
            }
            let before = self.at;
            match self.action_use() {
                Ok(one) => uses.push(one),
                Err(_) => {
                    if self.at == before {
                        self.advance();
                    }
                    self.skip_statement();
                }
            }
        }
        let span = self.span_from(start);
        Ok(Step { name, is_initial, uses, label, role: Role::Plain, span })
    }

    /// Parses `siren(D, T#5s);`.
    fn action_use(&mut self) -> Parse<Use> {
        let start = self.peek(0).start;
        let action = self.name("an action")?;
        if self.kind(0) == Kind::Assign {
            return Err(self.assignment_in_step(&action));
        }
        let mut found = Qualifier::N;
        let mut duration = None;
        if self.take(Kind::Open) && !self.take(Kind::Close) {
            if self.kind(0) == Kind::Word && matches!(self.kind(1), Kind::Comma | Kind::Close) {
                let token = self.advance();
                let text = self.slice(token);
                match qualifier(text) {
                    Some(one) => found = one,
                    None => {
                        let span = self.span(token);
                        let near =
                            nearest(&Symbol::of(text), Qualifier::ALL.map(Qualifier::letters))
                                .map(str::to_owned);
                        self.report(|| {
                            let finding = Diagnostic::error(
                                codes::ST_UNEXPECTED,
                                format!("unknown qualifier `{text}`"),
                            )
                            .at(span, "")
                            .help(format!("write {}", Qualifier::known()));
                            match near {
                                Some(near) => finding.fix(span, near),
                                None => finding,
                            }
                        });
                    }
                }
            }
            // Some files contain `(P, )`. A duration comes first, then indicator variables, which have no effect.
            while self.take(Kind::Comma) {
                if self.kind(0) == Kind::Close {
                    break;
                }
                let value = self.expression()?;
                let is_time = matches!(value.kind, super::ast::ExprKind::Time(_));
                if duration.is_none() && (found.is_timed() || is_time) {
                    duration = Some(value);
                } else {
                    self.findings.report(|| {
                        Diagnostic::warning(codes::ST_LEFT_OUT, "the indicator variable is ignored")
                            .at(value.span, "has no effect")
                            .help(
                                "remove it; to see when the action runs, read its Boolean variable",
                            )
                    });
                }
            }
            self.expect(Kind::Close, "`)`")?;
        }
        let span = self.span_from(start);
        if !self.is("END_STEP") {
            self.expect(Kind::Semicolon, "`;`")?;
        } else {
            self.missing_semicolon();
        }
        Ok(Use { action, qualifier: found, duration, span })
    }

    /// Reports `motor := TRUE;` in a step.
    fn assignment_in_step(&mut self, variable: &Ident) -> ErrorReported {
        let mut span = variable.span;
        span.end = self.here().end;
        let name = &variable.text;
        self.report(|| {
            Diagnostic::error(codes::ST_UNEXPECTED, "an assignment is not allowed directly in a step")
                .at(span, "a step names its actions")
                .help(format!(
                    "write `{name};` if `{name}` is a Boolean that is on while the step is active; move other statements into an `ACTION name: .. END_ACTION`, and write `name;` here"
                ))
        })
    }

    fn transition(&mut self) -> Parse<Transition> {
        let start = self.peek(0).start;
        self.advance();
        let mut name: Option<Ident> = None;
        if !self.is("FROM") && self.kind(0) == Kind::Word {
            name = Some(self.name("the name of the transition")?);
        }
        let mut priority = None;
        if self.take(Kind::Open) {
            self.expect_word("PRIORITY")?;
            self.expect(Kind::Assign, "`:=`")?;
            let token = self.expect(Kind::Number, "a priority")?;
            priority = self.slice(token).replace('_', "").parse().ok();
            self.expect(Kind::Close, "`)`")?;
        }
        self.expect_word("FROM")?;
        let from = self.steps()?;
        self.expect_word("TO")?;
        let to = self.steps()?;
        let refused = self.kind(0) == Kind::Colon;
        if refused {
            let span = self.here();
            self.refuse(
                "a transition condition in a language other than structured text",
                span,
                "write it as `:= condition;`",
            );
            while self.kind(0) != Kind::End && !self.is("END_TRANSITION") {
                self.advance();
            }
        }
        if self.kind(0) == Kind::Equal {
            let span = self.here();
            self.report(|| {
                Diagnostic::error(
                    codes::ST_UNEXPECTED,
                    "the condition of a transition follows `:=`",
                )
                .at(span, "`=` compares two values")
                .help("write `:=`")
                .fix(span, ":=")
            });
        }
        let condition = if self.take(Kind::Assign) || self.take(Kind::Equal) {
            let condition = self.expression()?;
            if !self.take(Kind::Semicolon) && self.is("END_TRANSITION") {
                self.missing_semicolon();
            }
            condition
        } else if self.is("END_TRANSITION") && refused {
            super::ast::Expr::new(super::ast::ExprKind::Refused(String::new()), self.here())
        } else {
            return Err(self.expected("`:=` and a condition"));
        };
        self.expect_word("END_TRANSITION")?;
        let span = self.span_from(start);
        self.take(Kind::Semicolon);
        let label = self.label();
        let (begin, end) = (start, self.peek(0).start);
        let mut restart = false;
        for setting in self.pragmas(begin, end) {
            if setting.text == "restart" {
                restart = true;
                continue;
            }
            self.report(|| {
                Diagnostic::error(
                    codes::ST_UNEXPECTED,
                    format!("unknown setting `{}` of a transition", setting.text),
                )
                .at(setting.span, "in this transition")
                .help("the only setting of a transition is {grafsynth restart}; move other settings to the chart")
            });
        }
        Ok(Transition { name, from, to, priority, restart, condition, label, span })
    }

    fn steps(&mut self) -> Parse<Vec<Ident>> {
        if !self.take(Kind::Open) {
            return Ok(vec![self.name("a step")?]);
        }
        let mut steps = vec![self.name("a step")?];
        while self.take(Kind::Comma) {
            steps.push(self.name("a step")?);
        }
        self.expect(Kind::Close, "`)`")?;
        Ok(steps)
    }

    fn action(&mut self) -> Parse<Action> {
        let start = self.peek(0).start;
        self.advance();
        let name = self.name("the name of the action")?;
        self.expect(Kind::Colon, "`:`")?;
        let label = self.label();
        let body = self.statements();
        if !self.take_word("END_ACTION") {
            return Err(self.expected("a statement or `END_ACTION`"));
        }
        let span = self.span_from(start);
        self.take(Kind::Semicolon);
        Ok(Action { name, body, label, span })
    }
}
