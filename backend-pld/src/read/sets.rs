//! Expressions of CUPL: of single signals, and of lists and fields of them.
//!
//! An operator between two lists works bit by bit, one between a list and a signal on every bit. `field:'h'3` is true where the bits are that number,
//! `field:[2..5]` in that range, `field:&`, `field:#` and `field:$` join all bits. Numbers without a base are hexadecimal; an `X` digit is any digit.

use super::MAX_NESTING;
use super::draft::{Draft, Expr, ExprId, SignalId};
use super::lexer::{Kind, Lexer};
use crate::codes;
use grafsynth_ir::span::Span;
use std::collections::BTreeMap;

/// Bits that a list may have.
pub(crate) const MAX_BITS: usize = 64;
/// Products that a range may become.
const MAX_RANGE: usize = 256;

/// Lists under a name, the most significant bit first.
pub(crate) type Fields = BTreeMap<String, Vec<SignalId>>;

/// Reads an expression: one value, or one for each bit of a list. None after an error, which is reported.
pub(crate) fn expression(
    lexer: &mut Lexer<'_>,
    draft: &mut Draft,
    fields: &Fields,
) -> Option<Vec<ExprId>> {
    Parser { lexer, draft, fields, depth: 0 }.exclusive()
}

/// A number with digits that may be anything: value and mask of the bits that matter.
#[derive(Debug, Clone, Copy)]
struct Number {
    value: u64,
    mask: u64,
}

struct Parser<'p, 'a> {
    lexer: &'p mut Lexer<'a>,
    draft: &'p mut Draft,
    fields: &'p Fields,
    depth: u32,
}

impl Parser<'_, '_> {
    fn error<T>(&mut self, span: Span, message: impl Into<String>) -> Option<T> {
        self.draft.error(codes::SYNTAX, span, message);
        None
    }

    fn exclusive(&mut self) -> Option<Vec<ExprId>> {
        let mut value = self.or()?;
        while self.lexer.token.is("$") {
            let span = self.lexer.span();
            self.lexer.advance();
            let other = self.or()?;
            value =
                self.pairwise(&value, &other, span, |draft, a, b| draft.expr(Expr::Xor(a, b)))?;
        }
        Some(value)
    }

    fn or(&mut self) -> Option<Vec<ExprId>> {
        self.junction("#", false)
    }

    fn junction(&mut self, sign: &str, is_and: bool) -> Option<Vec<ExprId>> {
        let operand =
            |parser: &mut Self| if is_and { parser.literal() } else { parser.junction("&", true) };
        let span = self.lexer.span();
        let mut all = vec![operand(self)?];
        while self.lexer.eat(sign) {
            all.push(operand(self)?);
        }
        let width = all.iter().map(Vec::len).max().unwrap_or(1);
        if all.iter().any(|value| value.len() != width && value.len() != 1) {
            return self.error(span, "these lists have different numbers of bits");
        }
        let bit = |at: usize| -> Vec<ExprId> {
            all.iter().map(|value| if value.len() == 1 { value[0] } else { value[at] }).collect()
        };
        Some((0..width).map(|at| self.draft.list(&bit(at), is_and)).collect())
    }

    fn pairwise(
        &mut self,
        a: &[ExprId],
        b: &[ExprId],
        span: Span,
        make: impl Fn(&mut Draft, ExprId, ExprId) -> ExprId,
    ) -> Option<Vec<ExprId>> {
        let width = a.len().max(b.len());
        if [a, b].iter().any(|list| list.len() != width && list.len() != 1) {
            return self.error(span, "these lists have different numbers of bits");
        }
        let bit = |list: &[ExprId], at: usize| if list.len() == 1 { list[0] } else { list[at] };
        Some((0..width).map(|at| make(self.draft, bit(a, at), bit(b, at))).collect())
    }

    fn literal(&mut self) -> Option<Vec<ExprId>> {
        let mut is_negated = false;
        while self.lexer.eat("!") {
            is_negated = !is_negated;
        }
        let span = self.lexer.span();
        let token = self.lexer.token;
        let mut value = if token.is("(") {
            if self.depth >= MAX_NESTING {
                return self
                    .error(span, format!("parentheses are nested more than {MAX_NESTING} deep"));
            }
            self.lexer.advance();
            self.depth += 1;
            let value = self.exclusive()?;
            self.depth -= 1;
            if !self.lexer.eat(")") {
                let message = format!("expected `)`, found {}", self.lexer.token.shown());
                return self.error(self.lexer.span(), message);
            }
            value
        } else if token.is("[") {
            let signals = list(self.lexer, self.draft)?;
            signals.into_iter().map(|(signal, at)| self.read(signal, at)).collect()
        } else if token.kind == Kind::Quoted {
            let number = self.number()?;
            // A number by itself is one bit.
            if number.mask & 1 == 0 || number.value > 1 {
                return self.error(span, "a constant in an equation is 'b'0 or 'b'1");
            }
            vec![self.draft.expr(Expr::Const(number.value == 1))]
        } else if token.kind == Kind::Word {
            self.lexer.advance();
            match self.fields.get(&token.text.to_ascii_lowercase()) {
                Some(signals) => {
                    signals.clone().into_iter().map(|signal| self.read(signal, span)).collect()
                }
                None => {
                    let signal = self.draft.signal(token.text, span);
                    self.feedback()?;
                    vec![self.read(signal, span)]
                }
            }
        } else {
            return self.error(span, format!("expected a signal, found {}", token.shown()));
        };
        if self.lexer.eat(":") {
            value = vec![self.test(&value, span)?];
        }
        if is_negated {
            value = value.into_iter().map(|bit| self.draft.not(bit)).collect();
        }
        Some(value)
    }

    fn read(&mut self, signal: SignalId, span: Span) -> ExprId {
        self.draft.at(signal).read_at.get_or_insert(span);
        self.draft.read(signal)
    }

    /// `.io`, `.dfb` and their like on a right side say where the feedback is taken from; on the devices of the tables it comes from one place.
    fn feedback(&mut self) -> Option<()> {
        if !self.lexer.token.is(".") || self.lexer.token.is_first {
            return Some(());
        }
        self.lexer.advance();
        let (span, token) = (self.lexer.span(), self.lexer.advance());
        let known = ["io", "dfb", "dq", "ioad", "int"];
        if known.iter().any(|word| token.is_word(word)) {
            return Some(());
        }
        let message = format!(
            "`.{}` on a right side is not supported by this reader: known are .io and .dfb",
            token.text.chars().take(20).collect::<String>()
        );
        self.draft.error(codes::UNSUPPORTED, span, message);
        None
    }

    /// What stands behind `list:`.
    fn test(&mut self, bits: &[ExprId], span: Span) -> Option<ExprId> {
        let token = self.lexer.token;
        if token.is("&") || token.is("#") {
            self.lexer.advance();
            return Some(self.draft.list(bits, token.is("&")));
        }
        if token.is("$") {
            self.lexer.advance();
            let mut bits = bits.iter().copied();
            let first = bits.next()?;
            return Some(bits.fold(first, |value, bit| self.draft.expr(Expr::Xor(value, bit))));
        }
        if !self.lexer.eat("[") {
            let number = self.number()?;
            self.check_width(bits, number, span)?;
            return Some(self.equals(bits, number));
        }
        // `[lo..hi]` or a list of numbers.
        let first = self.number()?;
        let mut numbers = vec![first];
        if self.lexer.eat(".") {
            self.lexer.eat(".");
            let last = self.number()?;
            let count = last.value.checked_sub(first.value).and_then(|n| usize::try_from(n).ok());
            if first.mask != !0 || last.mask != !0 || count.is_none_or(|count| count >= MAX_RANGE) {
                return self.error(
                    span,
                    format!("expected a range of at most {MAX_RANGE} numbers, such as `[2..5]`"),
                );
            }
            numbers = (first.value..=last.value).map(|value| Number { value, mask: !0 }).collect();
        } else {
            while self.lexer.eat(",") {
                if numbers.len() >= MAX_RANGE {
                    return self.error(span, format!("a list has at most {MAX_RANGE} numbers"));
                }
                numbers.push(self.number()?);
            }
        }
        if !self.lexer.eat("]") {
            let message = format!("expected `]`, found {}", self.lexer.token.shown());
            return self.error(self.lexer.span(), message);
        }
        let mut terms = Vec::new();
        for number in numbers {
            self.check_width(bits, number, span)?;
            terms.push(self.equals(bits, number));
        }
        Some(self.draft.list(&terms, false))
    }

    fn check_width(&mut self, bits: &[ExprId], number: Number, span: Span) -> Option<()> {
        let is_fit = bits.len() >= 64 || (number.value & number.mask) >> bits.len() == 0;
        if is_fit {
            return Some(());
        }
        let message = format!("{} does not fit {} bits", number.value, bits.len());
        self.error(span, message)
    }

    fn equals(&mut self, bits: &[ExprId], number: Number) -> ExprId {
        let mut literals = Vec::new();
        for (at, bit) in bits.iter().rev().enumerate().take(64) {
            if number.mask >> at & 1 == 1 {
                let is_one = number.value >> at & 1 == 1;
                literals.push(if is_one { *bit } else { self.draft.not(*bit) });
            }
        }
        if literals.is_empty() {
            return self.draft.expr(Expr::Const(true));
        }
        self.draft.list(&literals, true)
    }

    /// `'b'10X`, `'o'17`, `'d'12`, `'h'1F`, or hexadecimal digits.
    fn number(&mut self) -> Option<Number> {
        let span = self.lexer.span();
        let mut base = 16;
        if self.lexer.token.kind == Kind::Quoted {
            base = match self.lexer.token.text.to_ascii_lowercase().as_str() {
                "'b'" => 2,
                "'o'" => 8,
                "'d'" => 10,
                "'h'" => 16,
                other => {
                    let message = format!("expected a base such as 'b' or 'h', found `{other}`");
                    return self.error(span, message);
                }
            };
            self.lexer.advance();
        }
        let token = self.lexer.token;
        if token.kind != Kind::Number && token.kind != Kind::Word {
            return self.error(span, format!("expected a number, found {}", token.shown()));
        }
        self.lexer.advance();
        let (mut value, mut mask) = (0_u64, !0_u64);
        for c in token.text.chars() {
            let (digit, known) = match (c, c.to_digit(base)) {
                ('x' | 'X', _) if base != 10 => (0, 0),
                (_, Some(digit)) => (u64::from(digit), u64::from(base) - 1),
                (_, None) => {
                    return self.error(
                        span,
                        format!("expected a number of base {base}, found {}", token.shown()),
                    );
                }
            };
            let (next, is_over) = value.overflowing_mul(u64::from(base));
            if is_over || value >> 59 != 0 {
                return self.error(span, "this number has more than 64 bits");
            }
            value = next + digit;
            if base != 10 {
                mask = mask << base.trailing_zeros() | known;
            }
        }
        Some(Number { value, mask })
    }
}

/// `[A, B, C]`, `[A7..A0]`, `[A7..0]`: the signals with their places, the most significant first. None after an error, which is reported.
pub(crate) fn list(lexer: &mut Lexer<'_>, draft: &mut Draft) -> Option<Vec<(SignalId, Span)>> {
    let names = names(lexer, draft)?;
    Some(names.into_iter().map(|(name, span)| (draft.signal(&name, span), span)).collect())
}

/// The names of such a list.
pub(crate) fn names(lexer: &mut Lexer<'_>, draft: &mut Draft) -> Option<Vec<(String, Span)>> {
    lexer.advance();
    let mut found = Vec::new();
    loop {
        let (span, token) = (lexer.span(), lexer.token);
        if token.kind != Kind::Word {
            draft.error(codes::SYNTAX, span, format!("expected a name, found {}", token.shown()));
            return None;
        }
        lexer.advance();
        if lexer.token.is(".") {
            lexer.advance();
            lexer.eat(".");
            let (end, last) = (lexer.span(), lexer.advance());
            let split = |text: &str| -> Option<(String, u32)> {
                let digits = text.len() - text.trim_end_matches(|c: char| c.is_ascii_digit()).len();
                let (stem, number) = text.split_at(text.len() - digits);
                Some((stem.to_owned(), number.parse().ok()?))
            };
            let ends = split(token.text)
                .zip(split(last.text))
                .filter(|((a, _), (b, _))| b.is_empty() || a.eq_ignore_ascii_case(b));
            let Some(((stem, from), (_, to))) = ends.filter(|((_, a), (_, b))| a.abs_diff(*b) < 64)
            else {
                draft.error(
                    codes::SYNTAX,
                    end,
                    "expected a range of names such as `A7..A0` or `A7..0`",
                );
                return None;
            };
            let numbers: Vec<u32> =
                if from >= to { (to..=from).rev().collect() } else { (from..=to).collect() };
            found.extend(numbers.into_iter().map(|number| (format!("{stem}{number}"), span)));
        } else {
            found.push((token.text.to_owned(), span));
        }
        if found.len() > MAX_BITS {
            draft.error(codes::SYNTAX, span, format!("a list has at most {MAX_BITS} names"));
            return None;
        }
        if lexer.eat("]") {
            return Some(found);
        }
        if !lexer.eat(",") {
            let message = format!("expected `,` or `]`, found {}", lexer.token.shown());
            draft.error(codes::SYNTAX, lexer.span(), message);
            return None;
        }
    }
}
