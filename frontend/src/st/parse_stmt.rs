//! Parser of statements of structured text.
#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a parser matches the tokens that it accepts; all others are one case"
)]

use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, ErrorReported};

use super::ast::{Expr, ExprKind, Stmt, StmtKind};
use super::lexer::Kind;
use super::parse::{Parse, Parser};
use crate::codes;

impl Parser<'_> {
    /// Parses statements up to a word that ends the list. Reports and omits invalid ones.
    pub(crate) fn statements(&mut self) -> Vec<Stmt> {
        let mut list = Vec::new();
        loop {
            if self.take(Kind::Semicolon) {
                continue;
            }
            if self.at_end_of_list() {
                return list;
            }
            let before = self.at;
            match self.inside(Self::statement) {
                Ok(stmt) => list.push(stmt),
                Err(_) => {
                    if self.at == before {
                        self.advance();
                    }
                    self.skip_statement_from(before);
                }
            }
        }
    }

    fn statement(&mut self) -> Parse<Stmt> {
        let start = self.peek(0).start;
        let kind = match self.word(0).as_str() {
            "IF" => self.conditional()?,
            "CASE" => self.case()?,
            "FOR" => self.counted()?,
            "WHILE" => {
                self.advance();
                let condition = self.expression()?;
                self.expect_word("DO")?;
                let body = self.statements();
                self.expect_end("END_WHILE", start)?;
                StmtKind::While { condition, body }
            }
            "REPEAT" => {
                self.advance();
                let body = self.statements();
                self.expect_word("UNTIL")?;
                let until = self.expression()?;
                self.take(Kind::Semicolon);
                self.expect_end("END_REPEAT", start)?;
                StmtKind::Repeat { body, until }
            }
            "EXIT" => {
                self.advance();
                StmtKind::Exit
            }
            "CONTINUE" => {
                self.advance();
                StmtKind::Continue
            }
            "RETURN" => {
                self.advance();
                StmtKind::Return
            }
            _ => return self.simple(start),
        };
        // Some controllers accept a missing semicolon after END_IF and similar words; the standard does not.
        if !self.take(Kind::Semicolon) {
            self.missing_semicolon();
        }
        Ok(Stmt { kind, span: self.span_from(start) })
    }

    /// Parses an assignment or a call.
    fn simple(&mut self, start: usize) -> Parse<Stmt> {
        let target = self.primary()?;
        let kind = if self.take(Kind::Assign) {
            let value = self.expression()?;
            StmtKind::Assign { target, value }
        } else {
            match target.kind {
                ExprKind::Call(name, arguments) => {
                    StmtKind::Call { target: Expr::name(name), arguments }
                }
                ExprKind::Refused(what) => StmtKind::Refused(what),
                ExprKind::Name(_) | ExprKind::Field(..) | ExprKind::Index(..)
                    if self.kind(0) == Kind::Open =>
                {
                    let arguments = self.arguments()?;
                    StmtKind::Call { target, arguments }
                }
                ExprKind::Name(_)
                    if matches!(self.kind(0), Kind::Equal | Kind::Colon)
                        && !self.word(1).is_empty() =>
                {
                    let span = self.here();
                    return Err(self.report(|| {
                        Diagnostic::error(codes::ST_UNEXPECTED, "expected `:=` for an assignment")
                            .at(span, "here")
                            .help("write `:=`")
                            .fix(span, ":=")
                    }));
                }
                // CODESYS calls a program or an action by its name without parentheses.
                ExprKind::Name(_) | ExprKind::Field(..) if self.kind(0) == Kind::Semicolon => {
                    StmtKind::Call { target, arguments: Vec::new() }
                }
                _ => return Err(self.expected("`:=`")),
            }
        };
        if !self.take(Kind::Semicolon) {
            if !self.at_end_of_list() {
                return Err(self.expected("`;`"));
            }
            self.missing_semicolon();
        }
        Ok(Stmt { kind, span: self.span_from(start) })
    }

    /// Warns that a statement, condition or action has no semicolon although its end is clear: most controllers reject this.
    pub(super) fn missing_semicolon(&mut self) {
        let Some(last) = self.at.checked_sub(1).and_then(|at| self.list.tokens.get(at)).copied()
        else {
            return;
        };
        let (span, text) = (self.span(last), format!("{};", self.slice(last)));
        self.report(|| {
            Diagnostic::warning(codes::ST_UNEXPECTED, "missing `;`")
                .at(span, "expected `;` after this")
                .help("write `;`")
                .fix(span, text)
        });
    }

    /// Expects the word that closes the statement that begins at `start`.
    fn expect_end(&mut self, word: &str, start: usize) -> Parse<()> {
        if self.take_word(word) {
            return Ok(());
        }
        let opener = word.trim_start_matches("END_");
        let (span, found) = (self.here(), self.found());
        let opened = self.places.span(start, start + opener.len());
        Err(self.report(|| {
            Diagnostic::error(
                codes::ST_UNEXPECTED,
                format!("expected `{word}`, found {found}: this `{opener}` is not closed"),
            )
            .at(span, format!("expected `{word}`"))
            .at(opened, format!("this `{opener}` is not closed"))
            .help(format!("write `{word};` at the end of its statements"))
        }))
    }

    /// Explains that `ELSE IF` begins a separate IF, and that an END_IF closes only that one.
    fn unclosed_else_if(&mut self, else_if: Span) -> ErrorReported {
        let (span, found) = (self.here(), self.found());
        self.report(|| {
            Diagnostic::error(
                codes::ST_UNEXPECTED,
                format!("expected `END_IF`, found {found}: `ELSE IF` opens a second IF"),
            )
            .at(else_if, "this IF needs a separate `END_IF`")
            .at(span, "expected `END_IF`")
            .help("write `ELSIF` for another condition of the same IF")
            .fix(else_if, "ELSIF")
        })
    }

    fn conditional(&mut self) -> Parse<StmtKind> {
        let mut arms = Vec::new();
        let mut otherwise = Vec::new();
        let start = self.advance().start;
        let mut else_if = None;
        loop {
            let condition = self.expression()?;
            self.expect_word("THEN")?;
            let list = self.statements();
            arms.push((condition, list));
            if !self.take_word("ELSIF") {
                break;
            }
        }
        if self.is("ELSE") {
            let from = self.advance().start;
            if self.is("IF") {
                else_if = Some(self.places.span(from, self.peek(0).end));
            }
            otherwise = self.statements();
        }
        match else_if {
            Some(else_if) if !self.is("END_IF") => return Err(self.unclosed_else_if(else_if)),
            _ => self.expect_end("END_IF", start)?,
        }
        Ok(StmtKind::If { arms, otherwise })
    }

    fn case(&mut self) -> Parse<StmtKind> {
        let start = self.advance().start;
        let selector = self.expression()?;
        self.expect_word("OF")?;
        let mut arms = Vec::new();
        let mut otherwise = Vec::new();
        loop {
            if self.take(Kind::Semicolon) {
                continue;
            }
            if self.take_word("END_CASE") {
                return Ok(StmtKind::Case { selector, arms, otherwise });
            }
            if self.take_word("ELSE") {
                self.take(Kind::Colon);
                otherwise = self.statements();
                self.expect_end("END_CASE", start)?;
                return Ok(StmtKind::Case { selector, arms, otherwise });
            }
            let mut labels = Vec::new();
            loop {
                let low = self.expression()?;
                let high = if self.take(Kind::Range) { Some(self.expression()?) } else { None };
                labels.push((low, high));
                if !self.take(Kind::Comma) {
                    break;
                }
            }
            self.expect(Kind::Colon, "`:`")?;
            let list = self.case_list();
            arms.push((labels, list));
        }
    }

    /// Parses statements up to the next CASE label; only the colon distinguishes a label from a statement.
    fn case_list(&mut self) -> Vec<Stmt> {
        let mut list = Vec::new();
        loop {
            if self.take(Kind::Semicolon) {
                continue;
            }
            if self.at_end_of_list() || self.at_case_label() {
                return list;
            }
            let before = self.at;
            match self.inside(Self::statement) {
                Ok(stmt) => list.push(stmt),
                Err(_) => {
                    if self.at == before {
                        self.advance();
                    }
                    self.skip_statement();
                }
            }
        }
    }

    fn at_case_label(&self) -> bool {
        match self.kind(0) {
            Kind::Number | Kind::Typed | Kind::Minus => return true,
            Kind::Word => {}
            _ => return false,
        }
        // A few names and numbers, followed by a colon that is not part of an assignment.
        let mut ahead = 1;
        while ahead < 64 {
            match self.kind(ahead) {
                Kind::Colon => return true,
                Kind::Comma | Kind::Range | Kind::Number | Kind::Word | Kind::Dot | Kind::Hash => {
                    ahead += 1;
                }
                _ => return false,
            }
        }
        false
    }

    fn counted(&mut self) -> Parse<StmtKind> {
        let start = self.advance().start;
        let var = self.name("the variable of the loop")?;
        self.expect(Kind::Assign, "`:=`")?;
        let from = self.expression()?;
        self.expect_word("TO")?;
        let to = self.expression()?;
        let by = if self.take_word("BY") { Some(self.expression()?) } else { None };
        self.expect_word("DO")?;
        let body = self.statements();
        self.expect_end("END_FOR", start)?;
        Ok(StmtKind::For { var, from, to, by, body })
    }
}
