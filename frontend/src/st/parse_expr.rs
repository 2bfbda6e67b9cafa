//! Parser of expressions and literals of structured text.
#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a parser matches the tokens that it accepts; all others are one case"
)]

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;

use super::ast::{Arg, Expr, ExprKind, Op};
use super::lexer::{Kind, Token};
use super::parse::{Parse, Parser};
use super::symbol::{Ident, Symbol};
use crate::codes;

impl Parser<'_> {
    // One small function per form: the stack of a deep expression is the sum of their frames. Each function leaves the height of its tree
    // in `height`, because chains of operators and accesses make the tree higher than the nesting of the text.

    pub(crate) fn expression(&mut self) -> Parse<Expr> {
        self.inside(|parser| parser.operators(1))
    }

    /// Parses operators with at least the precedence `least`, by precedence climbing.
    fn operators(&mut self, least: u8) -> Parse<Expr> {
        let mut left = self.prefix()?;
        let mut height = self.height;
        // The operator of the list `left`, if it was built here and is not in parentheses.
        let mut chain = None;
        while let Some((op, power)) = self.operator().filter(|(_, power)| *power >= least) {
            self.advance();
            let right = self.deeper(|parser| parser.operators(power + 1))?;
            let is_flat = chain == Some(op) && matches!(op, Infix::And | Infix::Or);
            let highest = if is_flat { height - 1 } else { height }.max(self.height);
            height = self.raised(highest)?;
            left = joined(op, left, right, is_flat);
            chain = Some(op);
        }
        self.height = height;
        Ok(left)
    }

    /// The current operator with its precedence (IEC 61131-3, table 71, lowest first).
    fn operator(&self) -> Option<(Infix, u8)> {
        Some(match self.kind(0) {
            Kind::Word => return self.word_operator(),
            Kind::Ampersand => (Infix::And, 3),
            Kind::Bars => (Infix::Or, 1),
            Kind::Equal => (Infix::Op(Op::Eq), 4),
            Kind::NotEqual => (Infix::Op(Op::Ne), 4),
            Kind::Less => (Infix::Op(Op::Lt), 5),
            Kind::LessEqual => (Infix::Op(Op::Le), 5),
            Kind::Greater => (Infix::Op(Op::Gt), 5),
            Kind::GreaterEqual => (Infix::Op(Op::Ge), 5),
            Kind::Plus => (Infix::Op(Op::Add), 6),
            Kind::Minus => (Infix::Op(Op::Sub), 6),
            Kind::Star => (Infix::Op(Op::Mul), 7),
            Kind::Slash => (Infix::Op(Op::Div), 7),
            Kind::Power => (Infix::Op(Op::Power), 8),
            _ => return None,
        })
    }

    fn word_operator(&self) -> Option<(Infix, u8)> {
        Some(match self.word(0).as_str() {
            // The short-circuit forms mean the same, because expressions have no side effects.
            "OR" | "OR_ELSE" => (Infix::Or, 1),
            "XOR" => (Infix::Op(Op::Xor), 2),
            "AND" | "AND_THEN" => (Infix::And, 3),
            "MOD" => (Infix::Op(Op::Mod), 7),
            _ => return None,
        })
    }

    /// Returns `height` plus one; an error if the tree becomes too high.
    fn raised(&mut self, height: u32) -> Parse<u32> {
        if height >= self.limit {
            return Err(self.too_deep());
        }
        Ok(height + 1)
    }

    pub(crate) fn prefix(&mut self) -> Parse<Expr> {
        match self.kind(0) {
            Kind::Minus => self.negative(),
            Kind::Plus => {
                self.advance();
                self.deeper(Self::prefix)
            }
            Kind::Exclamation => self.not(),
            Kind::Word if self.is("NOT") => self.not(),
            _ => self.primary(),
        }
    }

    fn not(&mut self) -> Parse<Expr> {
        let start = self.advance().start;
        let inner = Box::new(self.deeper(Self::prefix)?);
        self.height = self.raised(self.height)?;
        Ok(Expr::new(ExprKind::Not(inner), self.span_from(start)))
    }

    fn negative(&mut self) -> Parse<Expr> {
        let start = self.advance().start;
        let inner = self.deeper(Self::prefix)?;
        self.height = self.raised(self.height)?;
        Ok(Expr::new(negated(inner), self.span_from(start)))
    }

    pub(super) fn primary(&mut self) -> Parse<Expr> {
        let start = self.peek(0).start;
        let expr = if self.kind(0) == Kind::Open { self.enclosed()? } else { self.atom()? };
        match self.kind(0) {
            Kind::Open | Kind::OpenBracket | Kind::Dot | Kind::Caret => self.access(start, expr),
            _ => Ok(expr),
        }
    }

    /// Parses `( expression )`.
    fn enclosed(&mut self) -> Parse<Expr> {
        self.advance();
        let inner = self.expression()?;
        self.expect(Kind::Close, "`)`")?;
        Ok(inner)
    }

    fn atom(&mut self) -> Parse<Expr> {
        self.height = 1;
        let token = self.peek(0);
        let span = self.span(token);
        match token.kind {
            Kind::Number => {
                self.advance();
                Ok(Expr::new(ExprKind::Int(self.number(token, span)?), span))
            }
            Kind::Typed => self.typed(),
            Kind::Time => self.time_constant(token, span),
            Kind::Real => {
                self.advance();
                Ok(self.refused_expr(
                    "numbers with a fraction (REAL)",
                    span,
                    "use integers, in a smaller unit if necessary",
                ))
            }
            Kind::Text => {
                self.advance();
                Ok(self.refused_expr(
                    "strings, dates and times of day",
                    span,
                    "use integers or enumerations",
                ))
            }
            Kind::Address => {
                self.advance();
                Ok(Expr::new(ExprKind::Address(self.name_of(token)), span))
            }
            Kind::Word => match self.word(0).as_str() {
                "TRUE" => {
                    self.advance();
                    Ok(Expr::new(ExprKind::Bool(true), span))
                }
                "FALSE" => {
                    self.advance();
                    Ok(Expr::new(ExprKind::Bool(false), span))
                }
                // Operators in function form: `OR(a, b)`.
                "AND" | "OR" | "XOR" | "NOT" | "MOD" if self.kind(1) == Kind::Open => {
                    self.advance();
                    self.called(token.start, self.name_of(token))
                }
                _ => Ok(Expr::name(self.name("an expression")?)),
            },
            _ => Err(self.expected("an expression")),
        }
    }

    fn time_constant(&mut self, token: Token, span: Span) -> Parse<Expr> {
        self.advance();
        let ns = match self.time(token) {
            Some(ns) => ns,
            None => {
                let written = self.slice(token).split_once('#').map_or("", |(_, rest)| rest);
                let (label, help) = why_no_duration(written);
                self.report(|| {
                    Diagnostic::error(codes::ST_CONSTANT, "invalid duration")
                        .at(span, label)
                        .help(help)
                });
                // A substitute value, so that the text after it is still parsed.
                1_000_000_000
            }
        };
        Ok(Expr::new(ExprKind::Time(ns), span))
    }

    /// Parses the suffixes of a value: arguments, indices, fields.
    pub(super) fn access(&mut self, start: usize, mut expr: Expr) -> Parse<Expr> {
        let mut levels = 0;
        loop {
            expr = match self.kind(0) {
                Kind::Open => match expr {
                    Expr { kind: ExprKind::Name(name), .. } => self.called(start, name)?,
                    other => return Ok(other),
                },
                Kind::OpenBracket => self.indexed(start, expr)?,
                Kind::Dot => self.part(start, expr)?,
                Kind::Caret => {
                    self.advance();
                    let span = self.span_from(start);
                    self.refused_expr("pointers", span, "name the variable itself")
                }
                _ => return Ok(expr),
            };
            levels += 1;
            if levels > 64 {
                return Err(self.expected("an access with fewer indices and fields"));
            }
        }
    }

    fn called(&mut self, start: usize, name: Ident) -> Parse<Expr> {
        let arguments = self.arguments()?;
        Ok(Expr::new(ExprKind::Call(name, arguments), self.span_from(start)))
    }

    fn indexed(&mut self, start: usize, expr: Expr) -> Parse<Expr> {
        let mut height = self.height;
        let mut indices = Vec::new();
        loop {
            self.advance();
            indices.push(self.expression()?);
            height = height.max(self.height);
            if self.kind(0) != Kind::Comma {
                break;
            }
        }
        self.expect(Kind::CloseBracket, "`]`")?;
        self.height = self.raised(height)?;
        Ok(Expr::new(ExprKind::Index(Box::new(expr), indices), self.span_from(start)))
    }

    /// Parses `.field` or `.3`.
    fn part(&mut self, start: usize, expr: Expr) -> Parse<Expr> {
        self.advance();
        self.height = self.raised(self.height)?;
        let inner = Box::new(expr);
        let kind = if self.kind(0) == Kind::Number {
            let token = self.advance();
            ExprKind::Bit(inner, self.slice(token).parse().unwrap_or(u32::MAX))
        } else {
            ExprKind::Field(inner, self.field()?)
        };
        Ok(Expr::new(kind, self.span_from(start)))
    }

    /// Parses a name after a dot, which may be a reserved word.
    fn field(&mut self) -> Parse<Ident> {
        if self.kind(0) == Kind::Word {
            let token = self.advance();
            return Ok(self.name_of(token));
        }
        Err(self.expected("a name"))
    }

    fn refused_expr(&mut self, what: &str, span: Span, help: &str) -> Expr {
        self.refuse(what, span, help);
        Expr::new(ExprKind::Refused(what.to_owned()), span)
    }

    /// Parses a single number; a parenthesis after it is not a call.
    pub(crate) fn expression_before_parenthesis(&mut self) -> Parse<Expr> {
        let token = self.expect(Kind::Number, "a number")?;
        let span = self.span(token);
        Ok(Expr::new(ExprKind::Int(self.number(token, span)?), span))
    }

    /// Parses the arguments of a call; `height` becomes that of the call.
    pub(crate) fn arguments(&mut self) -> Parse<Vec<Arg>> {
        self.expect(Kind::Open, "`(`")?;
        let mut arguments = Vec::new();
        let mut height = 1;
        self.height = height;
        if self.take(Kind::Close) {
            return Ok(arguments);
        }
        loop {
            arguments.extend(self.argument()?);
            height = height.max(self.height);
            if !self.take(Kind::Comma) {
                break;
            }
        }
        self.height = self.raised(height)?;
        self.expect(Kind::Close, "`)`")?;
        Ok(arguments)
    }

    fn argument(&mut self) -> Parse<Option<Arg>> {
        let is_negated =
            self.is("NOT") && self.kind(1) == Kind::Word && self.kind(2) == Kind::Arrow;
        if is_negated {
            self.advance();
        }
        let named =
            self.kind(0) == Kind::Word && matches!(self.kind(1), Kind::Assign | Kind::Arrow);
        if !named {
            let value = self.expression()?;
            return Ok(Some(Arg { name: None, value, is_output: false, is_negated: false }));
        }
        let token = self.advance();
        let name = Some(self.name_of(token));
        let is_output = self.advance().kind == Kind::Arrow;
        // `Q => )` and `IN := ,` are accepted: an empty argument means no argument.
        if matches!(self.kind(0), Kind::Comma | Kind::Close) {
            return Ok(None);
        }
        let value = self.expression()?;
        Ok(Some(Arg { name, value, is_output, is_negated }))
    }

    // Literals

    fn number(&mut self, token: Token, span: Span) -> Parse<i64> {
        match number(self.slice(token)) {
            Some(value) => Ok(value),
            None => {
                self.report(|| {
                    Diagnostic::error(codes::ST_CONSTANT, "invalid number").at(span, "").help(
                        "write a number of at most 63 bits in base 2, 8, 10 or 16, as in 16#FF",
                    )
                });
                Ok(0)
            }
        }
    }

    /// Parses `INT#5`, `BOOL#1` or `color#red`.
    fn typed(&mut self) -> Parse<Expr> {
        let start = self.peek(0).start;
        let prefix = self.advance();
        let ty = Symbol::of(self.slice(prefix).trim_end_matches('#'));
        let token = self.peek(0);
        let negative = self.take(Kind::Minus);
        let token = if negative { self.peek(0) } else { token };
        let span = self.span(token);
        let kind = match token.kind {
            Kind::Number => {
                self.advance();
                let value = self.number(token, span)?;
                let value = if negative { -value } else { value };
                let value = self.within(&ty, value, start);
                if ty == "BOOL" { ExprKind::Bool(value != 0) } else { ExprKind::Int(value) }
            }
            Kind::Word if ty == "BOOL" => match self.word(0).as_str() {
                "TRUE" => {
                    self.advance();
                    ExprKind::Bool(true)
                }
                "FALSE" => {
                    self.advance();
                    ExprKind::Bool(false)
                }
                _ => return Err(self.expected("TRUE, FALSE, 0 or 1")),
            },
            // An enumeration value is found by its own name, without the type.
            Kind::Word => ExprKind::Name(self.name("a value")?),
            Kind::Real => {
                self.advance();
                let span = self.span_from(start);
                return Ok(self.refused_expr(
                    "numbers with a fraction (REAL)",
                    span,
                    "use integers, in a smaller unit if necessary",
                ));
            }
            _ => return Err(self.expected("a value")),
        };
        Ok(Expr::new(kind, self.span_from(start)))
    }

    /// Reports a number outside the range of its type: `INT#70000`. Returns a value of the type.
    fn within(&mut self, ty: &str, value: i64, start: usize) -> i64 {
        let Some((lo, hi)) = range_of(ty).filter(|(lo, hi)| !(*lo..=*hi).contains(&value)) else {
            return value;
        };
        let span = self.span_from(start);
        let wider = WIDER.into_iter().find(|wider| {
            range_of(wider).is_some_and(|(from, to)| from <= lo && (from..=to).contains(&value))
        });
        self.report(|| {
            let finding =
                Diagnostic::error(codes::ST_CONSTANT, format!("`{value}` is not a value of {ty}"))
                    .at(span, format!("{ty} is {lo} to {hi}"));
            match wider {
                Some(wider) => {
                    finding.help(format!("write a value in this range, or `{wider}#{value}`"))
                }
                None => finding.help("write a value in this range"),
            }
        });
        value.clamp(lo, hi)
    }

    /// Nanoseconds of `T#1h2m3.5s`.
    pub(crate) fn time(&self, token: Token) -> Option<i64> {
        duration(self.slice(token).split_once('#')?.1)
    }
}

/// A binary operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Infix {
    And,
    Or,
    Op(Op),
}

/// Combines two operands. In a chain of AND or OR, which is flat, it appends the right one.
pub(crate) fn joined(op: Infix, left: Expr, right: Expr, is_chain: bool) -> Expr {
    let span = left.span.to(right.span);
    let kind = match (op, left.kind) {
        (Infix::And, ExprKind::And(mut all)) if is_chain => {
            all.push(right);
            ExprKind::And(all)
        }
        (Infix::Or, ExprKind::Or(mut all)) if is_chain => {
            all.push(right);
            ExprKind::Or(all)
        }
        (Infix::And, kind) => ExprKind::And(vec![Expr::new(kind, left.span), right]),
        (Infix::Or, kind) => ExprKind::Or(vec![Expr::new(kind, left.span), right]),
        (Infix::Op(op), kind) => {
            ExprKind::Binary(op, Box::new(Expr::new(kind, left.span)), Box::new(right))
        }
    };
    Expr::new(kind, span)
}

/// The negation; the negation of a constant is a constant.
fn negated(inner: Expr) -> ExprKind {
    match inner.kind {
        ExprKind::Int(value) => match value.checked_neg() {
            Some(value) => ExprKind::Int(value),
            None => ExprKind::Neg(Box::new(inner)),
        },
        ExprKind::Time(ns) => ExprKind::Time(ns.saturating_neg()),
        _ => ExprKind::Neg(Box::new(inner)),
    }
}

/// Parses `12`, `1_000` or `16#ff`.
pub(crate) fn number(text: &str) -> Option<i64> {
    let digits: String = text.chars().filter(|c| *c != '_').collect();
    match digits.split_once('#') {
        None => digits.parse().ok(),
        Some((base, digits)) => {
            let base: u32 = base.parse().ok()?;
            if ![2, 8, 10, 16].contains(&base) {
                return None;
            }
            i64::from_str_radix(digits, base).ok()
        }
    }
}

/// Types that are suggested for a value outside the range of another type.
const WIDER: [&str; 3] = ["INT", "DINT", "LINT"];

/// The smallest and the largest value of an elementary type.
fn range_of(ty: &str) -> Option<(i64, i64)> {
    Some(match ty {
        "BOOL" => (0, 1),
        "SINT" => (i64::from(i8::MIN), i64::from(i8::MAX)),
        "INT" => (i64::from(i16::MIN), i64::from(i16::MAX)),
        "DINT" => (i64::from(i32::MIN), i64::from(i32::MAX)),
        "LINT" => (i64::MIN, i64::MAX),
        "USINT" | "BYTE" => (0, i64::from(u8::MAX)),
        "UINT" | "WORD" => (0, i64::from(u16::MAX)),
        "UDINT" | "DWORD" => (0, i64::from(u32::MAX)),
        "ULINT" | "LWORD" => (0, i64::MAX),
        _ => return None,
    })
}

/// The units of a duration with their nanoseconds; a unit precedes any shorter unit that it begins with (`ms` precedes `m`).
const UNITS: [(&str, i128); 7] = [
    ("ms", 1_000_000),
    ("us", 1_000),
    ("ns", 1),
    ("d", 86_400_000_000_000),
    ("h", 3_600_000_000_000),
    ("m", 60_000_000_000),
    ("s", 1_000_000_000),
];

/// The reason why a text is not a duration, for the label, and the help text.
fn why_no_duration(text: &str) -> (String, String) {
    let general = "write days, hours, minutes, seconds and milliseconds in this order, as in T#1h30m or T#2.5s".to_owned();
    let lower = text.to_ascii_lowercase();
    let mut rest = lower.as_str();
    let mut before: Option<(&str, i128)> = None;
    while !rest.is_empty() {
        let number =
            rest.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '_'));
        if number.is_empty() {
            return (format!("no unit after `{rest}`"), format!("write `T#{lower}s` for seconds"));
        }
        if number.len() == rest.len() {
            return (format!("expected a number before `{number}`"), general);
        }
        let Some((word, unit)) = UNITS.iter().find(|(word, _)| number.starts_with(word)) else {
            return (format!("`{number}` does not begin with a unit"), general);
        };
        match before {
            Some((first, _)) if first == *word => return (format!("`{word}` twice"), general),
            Some((first, longer)) if *unit > longer => {
                return (format!("`{word}` after `{first}`"), general);
            }
            _ => before = Some((word, *unit)),
        }
        rest = &number[word.len()..];
    }
    match before {
        None => ("no number".to_owned(), general),
        Some(_) if lower.contains('.') => {
            ("only the last number can have a fraction".to_owned(), general)
        }
        Some(_) => ("too long".to_owned(), "write a shorter duration".to_owned()),
    }
}

/// Nanoseconds of `1h2m3.5s`: the units from the longest to the shortest, each at most once; only the last one may have a fraction.
pub(crate) fn duration(text: &str) -> Option<i64> {
    let lower = text.to_ascii_lowercase();
    let (negative, mut rest) = match lower.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, lower.as_str()),
    };
    if rest.is_empty() {
        return None;
    }
    let mut total: i128 = 0;
    let mut shortest = i128::MAX;
    while !rest.is_empty() {
        rest = rest.trim_start_matches('_');
        let end = rest.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | '_'))?;
        let digits: String = rest[..end].chars().filter(|c| *c != '_').collect();
        let (whole, fraction) = digits.split_once('.').unwrap_or((&digits, ""));
        let (word, unit) = UNITS.iter().find(|(word, _)| rest[end..].starts_with(word))?;
        if *unit >= shortest || !fraction.is_empty() && rest.len() > end + word.len() {
            return None;
        }
        shortest = *unit;
        let whole: i128 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
        total = total.checked_add(whole.checked_mul(*unit)?)?;
        if !fraction.is_empty() {
            if fraction.len() > 18 {
                return None;
            }
            let scale = 10_i128.checked_pow(u32::try_from(fraction.len()).ok()?)?;
            total =
                total.checked_add(fraction.parse::<i128>().ok()?.checked_mul(*unit)? / scale)?;
        }
        rest = &rest[end + word.len()..];
    }
    i64::try_from(if negative { -total } else { total }).ok()
}
