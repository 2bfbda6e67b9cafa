//! Sums of products as written in PALASM, CUPL and `GALasm`.

use super::MAX_NESTING;
use super::ast::{ExprId, PldAst};
use super::lexer::{Kind, Lexer};
use crate::codes;
use itertools::Itertools as _;

/// The operators of a language. Exclusive-or has the lowest precedence, then or, then and.
pub(crate) struct Grammar {
    pub(crate) not: &'static str,
    pub(crate) and: &'static [&'static str],
    pub(crate) or: &'static [&'static str],
    pub(crate) xor: &'static [&'static str],
    /// True if parentheses are allowed.
    pub(crate) parens: bool,
    /// Reads a constant if there is one.
    pub(crate) constant: fn(&mut Lexer<'_>) -> Option<bool>,
    /// True if a constant must be the whole function, without negation.
    pub(crate) lone_constants: bool,
}

/// A function as written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sum {
    pub(crate) value: ExprId,
    /// The number of product terms, if the text is a plain sum of products; otherwise 0.
    pub(crate) terms: u32,
}

/// `VCC` and `GND`.
pub(crate) fn supply(lexer: &mut Lexer<'_>) -> Option<bool> {
    let value = if lexer.token.is_word("VCC") {
        true
    } else if lexer.token.is_word("GND") {
        false
    } else {
        return None;
    };
    lexer.advance();
    Some(value)
}

/// Reads a function; `None` after an error, which is reported, with the offending token ahead.
pub(crate) fn sum(lexer: &mut Lexer<'_>, draft: &mut PldAst, grammar: &Grammar) -> Option<Sum> {
    let mut parser = Parser { lexer, draft, grammar, depth: 0, terms: 0, is_plain: true };
    let value = parser.exclusive()?;
    let terms = if parser.is_plain { parser.terms } else { 0 };
    Some(Sum { value, terms })
}

struct Parser<'p, 'a> {
    lexer: &'p mut Lexer<'a>,
    draft: &'p mut PldAst,
    grammar: &'p Grammar,
    depth: u32,
    terms: u32,
    is_plain: bool,
}

impl Parser<'_, '_> {
    fn eat_any(&mut self, signs: &[&str]) -> bool {
        signs.iter().any(|sign| self.lexer.eat(sign))
    }

    fn exclusive(&mut self) -> Option<ExprId> {
        let mut value = self.or()?;
        while self.eat_any(self.grammar.xor) {
            self.is_plain = false;
            let other = self.or()?;
            value = self.draft.expr(super::ast::Expr::Xor(value, other));
        }
        Some(value)
    }

    fn or(&mut self) -> Option<ExprId> {
        let mut all = vec![self.and()?];
        while self.eat_any(self.grammar.or) {
            all.push(self.and()?);
        }
        Some(self.draft.list(&all, false))
    }

    fn and(&mut self) -> Option<ExprId> {
        if self.depth == 0 {
            self.terms = self.terms.saturating_add(1);
        }
        let mut all = vec![self.literal()?];
        while self.eat_any(self.grammar.and) {
            all.push(self.literal()?);
        }
        Some(self.draft.list(&all, true))
    }

    fn literal(&mut self) -> Option<ExprId> {
        let mut is_negated = false;
        while self.lexer.eat(self.grammar.not) {
            is_negated = !is_negated;
        }
        let span = self.lexer.span();
        let value = if let Some(value) = (self.grammar.constant)(self.lexer) {
            if self.grammar.lone_constants {
                let sign = |signs: &[&str]| signs.iter().any(|sign| self.lexer.token.is(sign));
                let is_lone = self.terms == 1 && !sign(self.grammar.and) && !sign(self.grammar.or);
                if is_negated || !is_lone {
                    let message = "`VCC` and `GND` must be the whole right side, without `/`";
                    let help = "remove the constant: `VCC` in a product and `GND` in a sum change nothing; write `GND` for `/VCC`, and `VCC` for `/GND`";
                    self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
                }
            }
            self.draft.expr(super::ast::Expr::Const(value))
        } else if self.grammar.parens && self.lexer.token.is("(") {
            if self.depth >= MAX_NESTING {
                let message = format!("parentheses are nested more than {MAX_NESTING} deep");
                self.draft.error(codes::SYNTAX, span, message);
                return None;
            }
            self.lexer.advance();
            self.is_plain = false;
            self.depth += 1;
            let value = self.exclusive()?;
            self.depth -= 1;
            if !self.lexer.eat(")") {
                let message = format!("expected `)`, found {}", self.lexer.token.shown());
                let help = "write `)` here, or remove the `(` that is open";
                self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
                return None;
            }
            value
        } else if self.lexer.token.kind == Kind::Word
            && !(self.lexer.token.is_first && self.is_next_statement())
        {
            let name = self.lexer.advance();
            if self.lexer.token.is(".") {
                let message = format!(
                    "`{}` has an extension, which is only allowed on the left side",
                    name.text
                );
                let help = format!("write `{}` alone", name.text);
                self.draft.error_with(codes::UNSUPPORTED, span, message, help);
                self.lexer.advance();
                self.lexer.advance();
            }
            let signal = self.draft.signal(name.text, span);
            self.draft.at(signal).read_at.get_or_insert(span);
            self.draft.read(signal)
        } else {
            let message = format!("expected a signal, found {}", self.lexer.token.shown());
            let signs = || self.grammar.and.iter().chain(self.grammar.or).chain(self.grammar.xor);
            let is_operator = signs().any(|sign| self.lexer.token.is(sign));
            let help = if is_operator {
                format!(
                    "write a signal before {}, or remove the operator before it",
                    self.lexer.token.shown()
                )
            } else if self.lexer.token.is("(") && !self.grammar.parens {
                "this language has no parentheses: multiply the expression out to a sum of products"
                    .to_owned()
            } else {
                let known = signs().map(|sign| format!("`{sign}`")).join(", ");
                format!(
                    "write a signal here, or remove the operator before it; operators are `{}`, {}",
                    self.grammar.not, known
                )
            };
            self.draft.error_with(codes::SYNTAX, span, message, help);
            return None;
        };
        Some(if is_negated { self.draft.not(value) } else { value })
    }

    /// True if the next word begins a new equation, so that the end of the previous sum is missing.
    fn is_next_statement(&self) -> bool {
        let mut ahead = self.lexer.clone();
        ahead.advance();
        if ahead.eat(".") {
            ahead.advance();
        }
        ahead.token.is("=") || ahead.token.is(":=") || ahead.token.is("*=")
    }
}
