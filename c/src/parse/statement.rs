//! Statements (C99 6.8).

use super::declarator::Storage;
use super::lexer::TokenKind;
use super::{Parser, Read};
use crate::codes;
use crate::tree::types::Type;
use crate::tree::{Arm, Case, Expr, Label, Loc, Marks, Stmt, StmtKind, SymbolKind};
use grafsynth_ir::Span;
use std::collections::BTreeSet;

impl Parser<'_, '_> {
    /// Reads the statements up to the closing brace.
    pub(super) fn statements(&mut self) -> Read<Vec<Stmt>> {
        let mut all = Vec::new();
        while !self.take("}") {
            self.block_item(&mut all)?;
        }
        Ok(all)
    }

    fn block_item(&mut self, into: &mut Vec<Stmt>) -> Read<()> {
        if self.begins_declaration() && !self.peek_at(1).is(":") {
            return self.local(into);
        }
        self.statement(into)
    }

    /// Reads a statement and adds it to `into`; an empty statement adds nothing.
    fn statement(&mut self, into: &mut Vec<Stmt>) -> Read<()> {
        let start = self.span();
        let token = self.peek();
        let kind = match (token.kind, token.text) {
            (TokenKind::Sign, ";") => {
                self.next();
                return Ok(());
            }
            (TokenKind::Sign, "{") => {
                self.next();
                StmtKind::Block(self.deeper(|parser| parser.scoped(Self::statements))?)
            }
            (TokenKind::Opaque, text) => {
                self.next();
                StmtKind::Opaque(text.to_owned())
            }
            (TokenKind::Word, "if") => self.if_statement()?,
            (TokenKind::Word, "switch") => self.switch_statement()?,
            (TokenKind::Word, "while") => {
                self.next();
                let condition = self.condition()?;
                StmtKind::While { condition, body: self.round()? }
            }
            (TokenKind::Word, "do") => self.do_statement()?,
            (TokenKind::Word, "for") => self.for_statement()?,
            (TokenKind::Word, "break" | "continue" | "return") => self.jump()?,
            (TokenKind::Word, "case" | "default") => {
                let message =
                    "a `case` or `default` label must be directly in the block of a `switch`";
                return self.fail(codes::SYNTAX, message, start, "here");
            }
            (TokenKind::Word, "__asm__" | "__asm" | "asm") => self.barrier()?,
            (TokenKind::Word, "goto") => {
                return self.fail(codes::SYNTAX, "`goto` is not supported", start, "here");
            }
            (TokenKind::Word, _) if self.peek_at(1).is(":") => {
                return self.fail(codes::SYNTAX, "labels are not supported", start, "here");
            }
            _ => {
                let value = self.expression()?;
                self.expect(";")?;
                StmtKind::Expr(value)
            }
        };
        into.push(self.stmt(kind, start));
        Ok(())
    }

    fn stmt(&self, kind: StmtKind, start: Span) -> Stmt {
        Stmt { kind, marks: Marks::default(), span: self.since(start) }
    }

    /// Reads a statement as the body of another one; the body is a scope (C99 6.8.4p3).
    fn body(&mut self) -> Read<Vec<Stmt>> {
        self.deeper(|parser| {
            parser.scoped(|parser| {
                if parser.take("{") {
                    return parser.statements();
                }
                let mut all = Vec::new();
                parser.statement(&mut all)?;
                Ok(all)
            })
        })
    }

    /// The body of a loop.
    fn round(&mut self) -> Read<Vec<Stmt>> {
        self.n_loops += 1;
        let body = self.body()?;
        self.n_loops -= 1;
        Ok(body)
    }

    fn if_statement(&mut self) -> Read<StmtKind> {
        let (mut arms, mut otherwise) = (Vec::new(), Vec::new());
        self.next();
        loop {
            let condition = self.condition()?;
            let body = self.body()?;
            arms.push(Arm { condition, body, marks: Marks::default() });
            if !self.take_word("else") {
                break;
            }
            if !self.take_word("if") {
                otherwise = self.body()?;
                break;
            }
        }
        Ok(StmtKind::If { arms, otherwise })
    }

    fn switch_statement(&mut self) -> Read<StmtKind> {
        self.next();
        let on = self.condition()?;
        let span = on.span;
        let on = self.typed(self.unit.promote(on), span)?;
        self.n_switches += 1;
        self.expect("{")?;
        let (mut cases, mut seen, mut has_default) = (Vec::new(), BTreeSet::new(), false);
        self.deeper(|parser| {
            parser.scoped(|parser| {
                while !parser.take("}") {
                    let case = parser.case(&on, &mut seen, &mut has_default)?;
                    cases.push(case);
                }
                Ok(())
            })
        })?;
        self.n_switches -= 1;
        Ok(StmtKind::Switch { on, cases })
    }

    fn case(&mut self, on: &Expr, seen: &mut BTreeSet<i128>, has_default: &mut bool) -> Read<Case> {
        let mut case = Case { labels: Vec::new(), body: Vec::new(), marks: Marks::default() };
        loop {
            let start = self.span();
            if self.take_word("default") {
                if std::mem::replace(has_default, true) {
                    return self.fail(
                        codes::TYPE,
                        "this `switch` has two `default` labels",
                        start,
                        "the second one",
                    );
                }
                case.labels.push(Label::Default);
            } else if self.take_word("case") {
                let (value, number) = self.deeper(Self::constant)?;
                let kind = self.unit.integer(&on.ty);
                let number = kind.map_or(number, |kind| self.unit.machine.wrap(number, kind));
                if !seen.insert(number) {
                    let message = format!("the value {number} has two labels");
                    return self.fail(codes::TYPE, message, start, "the second one");
                }
                case.labels.push(Label::Case(value, number));
            } else {
                break;
            }
            self.expect(":")?;
        }
        if case.labels.is_empty() {
            return self.unexpected("`case`");
        }
        if self.begins_declaration() {
            return self.unexpected("a statement after the label");
        }
        while !(self.peek().is("}")
            || self.peek().is_word("case")
            || self.peek().is_word("default"))
        {
            self.block_item(&mut case.body)?;
        }
        Ok(case)
    }

    fn do_statement(&mut self) -> Read<StmtKind> {
        self.next();
        let body = self.round()?;
        if !self.take_word("while") {
            return self.unexpected("`while`");
        }
        let condition = self.condition()?;
        self.expect(";")?;
        Ok(StmtKind::DoWhile { body, condition })
    }

    fn for_statement(&mut self) -> Read<StmtKind> {
        self.next();
        self.expect("(")?;
        self.scoped(|parser| {
            let mut init = Vec::new();
            if parser.begins_declaration() {
                let span = parser.span();
                if parser.peek().is_word("static") {
                    return parser.fail(
                        codes::SYNTAX,
                        "the counter of a loop cannot be `static`",
                        span,
                        "here",
                    );
                }
                parser.local(&mut init)?;
            } else if !parser.take(";") {
                let start = parser.span();
                let value = parser.expression()?;
                parser.expect(";")?;
                init.push(parser.stmt(StmtKind::Expr(value), start));
            }
            let condition = if parser.peek().is(";") {
                None
            } else {
                let condition = parser.expression()?;
                let span = condition.span;
                Some(parser.typed(parser.unit.scalar(condition), span)?)
            };
            parser.expect(";")?;
            let step = if parser.peek().is(")") { None } else { Some(parser.expression()?) };
            parser.expect(")")?;
            Ok(StmtKind::For { init, condition, step, body: parser.round()? })
        })
    }

    fn jump(&mut self) -> Read<StmtKind> {
        let token = self.next();
        let kind = match token.text {
            "break" if self.n_loops + self.n_switches > 0 => StmtKind::Break,
            "continue" if self.n_loops > 0 => StmtKind::Continue,
            "return" => self.return_value(token.span)?,
            word => {
                let place = if word == "break" { "loops and `switch`" } else { "loops" };
                let message = format!("`{word}` is only allowed in {place}");
                return self.fail(codes::SYNTAX, message, token.span, "here");
            }
        };
        self.expect(";")?;
        Ok(kind)
    }

    fn return_value(&mut self, span: Span) -> Read<StmtKind> {
        let result = self.result.clone().unwrap_or(Type::Void);
        if self.peek().is(";") {
            if result != Type::Void {
                return self.fail(codes::TYPE, "this function returns a value", span, "here");
            }
            return Ok(StmtKind::Return(None));
        }
        let value = self.expression()?;
        let Loc(at) = value.span;
        if result == Type::Void {
            return self.fail(codes::TYPE, "this function returns no value", at, "here");
        }
        let value = self.typed(self.unit.convert_to(value, &result), Loc(at))?;
        Ok(StmtKind::Return(Some(value)))
    }

    /// Reads `__asm__ volatile("" ::: "memory");` of gcc.
    fn barrier(&mut self) -> Read<StmtKind> {
        let start = self.next().span;
        let is_barrier = (self.take_word("volatile") || self.take_word("__volatile__"))
            && self.take("(")
            && self.next().text == "\"\""
            && (0..3).all(|_| self.take(":"))
            && self.next().text == "\"memory\""
            && self.take(")");
        if !is_barrier {
            let message = "only `__asm__ volatile(\"\" ::: \"memory\")` is supported";
            return self.fail(codes::SYNTAX, message, start, "here");
        }
        self.expect(";")?;
        Ok(StmtKind::Barrier)
    }

    /// A declaration in a block: one statement for each declarator.
    fn local(&mut self, into: &mut Vec<Stmt>) -> Read<()> {
        let specifiers = self.specifiers()?;
        let is_static = match specifiers.storage {
            None => false,
            Some(Storage::Static) => true,
            Some(Storage::Extern | Storage::Typedef) => {
                let message = "only variables can be declared in a function";
                return self.fail(codes::SYNTAX, message, specifiers.span, "here");
            }
        };
        loop {
            let declared = self.declare(&specifiers.base)?;
            let Some((name, span)) = declared.name else { return self.unexpected("a name") };
            let canonical = self.unit.canonical(&declared.ty).ty;
            if matches!(canonical, Type::Function(_) | Type::Void) || specifiers.is_inline {
                let message = "only variables can be declared in a function";
                return self.fail(codes::SYNTAX, message, span, "here");
            }
            let kind = SymbolKind::Local { is_static };
            let symbol = self.declare_symbol(&name, span, kind, declared.ty)?;
            let init = if !self.take("=") {
                None
            } else if is_static {
                Some(self.static_initialiser(symbol)?)
            } else {
                Some(self.symbol_initialiser(symbol)?)
            };
            if self.unit.layout(&self.unit.symbols[symbol].canonical.ty).is_none() {
                return self.fail(codes::TYPE, "the object has no known size", span, "here");
            }
            into.push(self.stmt(StmtKind::Define { symbol, init }, specifiers.span));
            if !self.take(",") {
                self.expect(";")?;
                return Ok(());
            }
        }
    }
}
