//! Expression parser: precedence climbing. Chains of one operator stay flat.
//!
//! Precedence from lowest to highest: `if c then a else b`; `or ∨`; `and ∧`; `not`; comparisons (they do not chain); `+ - bor bxor`;
//! `* · / mod band shl shr`; the prefixes `/ ¬ - ↑ ↓ bnot`. The signs `+` and `*` join Booleans if no operand is a number (see [`super::numbers`]); their precedence is
//! the same in both cases. If a mix of words and signs could be understood in two ways, the parser requires parentheses.
//!
//! A tree is never deeper than the nesting limit, so functions that visit it may recurse.

use grafsynth_ir::chart::{Expr, Leaf, Path};
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use grafsynth_ir::{Name, Span};

use super::names::Position;
use super::parser::{Parse, Parser, short};
use super::steps::CLAUSES;
use super::token::{Kind, Token};
use crate::codes;

/// The kind of an expression's value, as far as the parser knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sort {
    Number,
    Truth,
    Unknown,
}

/// An AND or OR that is written with signs and without parentheses around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Loose {
    And,
    Or,
}

/// A parsed expression, with the information that decides how it may be combined with others.
struct Operand {
    expr: Expr,
    /// Depth of the expression tree.
    depth: u32,
    sort: Sort,
    loose: Option<Loose>,
}

/// Operator precedence levels, lowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Or,
    And,
    Not,
    Compare,
    Add,
    Mul,
    Prefix,
}

impl Level {
    fn tighter(self) -> Level {
        match self {
            Level::Or => Level::And,
            Level::And => Level::Not,
            Level::Not => Level::Compare,
            Level::Compare => Level::Add,
            Level::Add => Level::Mul,
            Level::Mul | Level::Prefix => Level::Prefix,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Infix {
    Or,
    And,
    Compare(CompareOp),
    Arith(ArithOp),
    /// `·`, which multiplies like `*`; between Booleans it is `and`.
    Dot,
}

impl<'a> Parser<'a> {
    /// Parses an expression.
    pub(crate) fn expr(&mut self) -> Parse<Expr> {
        self.operand_at(Level::Or).map(|operand| operand.expr)
    }

    fn operand_at(&mut self, min: Level) -> Parse<Operand> {
        self.enter()?;
        let mut left = self.prefix(min)?;
        while let Some((infix, level)) = self.infix()
            && level >= min
        {
            left = match infix {
                Infix::Compare(op) => self.comparison(op, left)?,
                Infix::Or | Infix::And => self.junction(infix, left)?,
                Infix::Arith(_) | Infix::Dot => self.chain(level, left)?,
            };
        }
        self.leave();
        Ok(left)
    }

    fn infix(&self) -> Option<(Infix, Level)> {
        Some(match self.kind(0) {
            Kind::Word => match self.word(0) {
                "or" => (Infix::Or, Level::Or),
                "and" => (Infix::And, Level::And),
                "mod" => (Infix::Arith(ArithOp::Mod), Level::Mul),
                "band" => (Infix::Arith(ArithOp::BitAnd), Level::Mul),
                "bor" => (Infix::Arith(ArithOp::BitOr), Level::Add),
                "bxor" => (Infix::Arith(ArithOp::BitXor), Level::Add),
                "shl" => (Infix::Arith(ArithOp::Shl), Level::Mul),
                "shr" => (Infix::Arith(ArithOp::Shr), Level::Mul),
                _ => return None,
            },
            Kind::OrSign => (Infix::Or, Level::Or),
            // `junction` reports `&`.
            Kind::AndSign | Kind::Ampersand => (Infix::And, Level::And),
            Kind::Equal => (Infix::Compare(CompareOp::Eq), Level::Compare),
            Kind::NotEqual => (Infix::Compare(CompareOp::Ne), Level::Compare),
            Kind::Less => (Infix::Compare(CompareOp::Lt), Level::Compare),
            Kind::LessEqual => (Infix::Compare(CompareOp::Le), Level::Compare),
            Kind::Greater => (Infix::Compare(CompareOp::Gt), Level::Compare),
            Kind::GreaterEqual => (Infix::Compare(CompareOp::Ge), Level::Compare),
            Kind::Plus => (Infix::Arith(ArithOp::Add), Level::Add),
            Kind::Minus => (Infix::Arith(ArithOp::Sub), Level::Add),
            Kind::Star => (Infix::Arith(ArithOp::Mul), Level::Mul),
            Kind::Slash => (Infix::Arith(ArithOp::Div), Level::Mul),
            Kind::PercentSign => (Infix::Arith(ArithOp::Mod), Level::Mul),
            Kind::MiddleDot => (Infix::Dot, Level::Mul),
            _ => return None,
        })
    }

    fn comparison(&mut self, op: CompareOp, left: Operand) -> Parse<Operand> {
        let sign = self.advance();
        let right = self.operand_at(Level::Compare.tighter())?;
        for side in [&left, &right] {
            if side.loose.is_some() {
                let span = side.expr.span;
                self.report(|| {
                    Diagnostic::error(
                        codes::AMBIGUOUS,
                        "signs between Booleans inside a comparison are ambiguous",
                    )
                    .at(span, "unclear whether all of this is compared, or only part of it")
                    .help("put this, or the comparison, in parentheses")
                });
            }
        }
        if let Some((Infix::Compare(_), _)) = self.infix() {
            let (first, second) = (self.span(sign), self.span(self.peek(0)));
            self.report(|| {
                Diagnostic::error(codes::AMBIGUOUS, "comparisons do not chain")
                    .at(second, "second comparison")
                    .at(first, "first comparison")
                    .help("join them with `and`: `a < b and b < c`")
            });
            return Err(ErrorReported);
        }
        let depth = self.deeper(left.depth.max(right.depth))?;
        Ok(Operand {
            expr: Expr::compare(op, left.expr, right.expr),
            depth,
            sort: Sort::Truth,
            loose: None,
        })
    }

    /// Parses `a and b and c` or `a or b or c` as one flat list.
    fn junction(&mut self, infix: Infix, first: Operand) -> Parse<Operand> {
        let is_and = infix == Infix::And;
        let level = if is_and { Level::And } else { Level::Or };
        let start = first.expr.span;
        let mut depth = first.depth;
        let mut operands = Vec::new();
        self.take_into(&mut operands, first, is_and);
        while self.infix() == Some((infix, level)) {
            let sign = self.advance();
            if sign.kind == Kind::Ampersand {
                let span = self.span(sign);
                self.report(|| {
                    Diagnostic::error(codes::UNEXPECTED, "expected `and`, found `&`")
                        .at(span, "`&` joins steps, not conditions")
                        .fix(span, "and")
                });
            }
            let operand = self.operand_at(level.tighter())?;
            depth = depth.max(operand.depth);
            self.take_into(&mut operands, operand, is_and);
        }
        let depth = self.deeper(depth)?;
        let kind = if is_and { ExprKind::And(operands) } else { ExprKind::Or(operands) };
        let span = self.span_from(start.start);
        Ok(Operand { expr: Expr::new(kind, span), depth, sort: Sort::Truth, loose: None })
    }

    /// Adds an operand to an AND or OR that is written with words. An operand that is the same operation written with signs is merged into
    /// it.
    fn take_into(&mut self, operands: &mut Vec<Expr>, operand: Operand, is_and: bool) {
        match (operand.loose, operand.expr.kind, is_and) {
            (Some(Loose::And), ExprKind::And(inner), true)
            | (Some(Loose::Or), ExprKind::Or(inner), false) => {
                operands.extend(inner);
            }
            (loose, kind, _) => {
                let span = operand.expr.span;
                if is_and && loose == Some(Loose::Or) {
                    self.report(|| {
                        Diagnostic::error(codes::AMBIGUOUS, "`+` next to `and` is ambiguous")
                            .at(span, "binds tighter than `and` here")
                            .help(
                                "put the part that belongs together in parentheses, or write `or`",
                            )
                    });
                }
                self.keep(operands, Expr::new(kind, span));
            }
        }
    }

    /// Parses operands joined by operators of one level: arithmetic if an operand is a number or an operator is neither `+` nor `*` nor `·`,
    /// otherwise `or` and `and`.
    fn chain(&mut self, level: Level, first: Operand) -> Parse<Operand> {
        let start = first.expr.span;
        let mut depth = first.depth;
        let mut is_number = first.sort == Sort::Number;
        let mut is_arithmetic = false;
        let mut division: Option<Token> = None;
        let mut rest: Vec<(ArithOp, Expr, Sort)> = Vec::new();
        let mut n_rest = 0u32;
        while let Some((infix, at)) = self.infix()
            && at == level
        {
            let sign = self.advance();
            let op = match infix {
                Infix::Arith(op) => op,
                Infix::Dot | Infix::Or | Infix::And | Infix::Compare(_) => ArithOp::Mul,
            };
            match op {
                ArithOp::Div => division = division.or(Some(sign)),
                ArithOp::Add | ArithOp::Mul => {}
                _ => is_arithmetic = true,
            }
            let operand = self.operand_at(level.tighter())?;
            depth = depth.max(operand.depth);
            is_number |= operand.sort == Sort::Number;
            n_rest += 1;
            self.keep(&mut rest, (op, operand.expr, operand.sort));
        }
        let mut first = first;
        if division.is_some() && self.old_delays(&mut first, &mut rest) {
            is_number =
                first.sort == Sort::Number || rest.iter().any(|(_, _, sort)| *sort == Sort::Number);
            if rest.iter().all(|(op, ..)| *op != ArithOp::Div) {
                division = None;
            }
            if rest.is_empty() {
                return Ok(Operand { depth: self.deeper(depth)?, ..first });
            }
        }
        if let (Some(sign), false, Some(_)) = (division, is_number || is_arithmetic, self.numbers) {
            let span = self.span(sign);
            let is_comment = self.text[sign.end as usize..].starts_with('/');
            self.report(|| {
                let finding =
                    Diagnostic::error(codes::AMBIGUOUS, "`/` between Booleans is not an operator");
                if is_comment {
                    finding.at(span, "divides numbers").help("a comment begins with `#`, not `//`")
                } else {
                    finding
                        .at(span, "between two values it divides, before one value it negates")
                        .help("for `a and not b` write `a * /b`")
                }
            });
        }
        let span = self.span_from(start.start);
        if is_number || is_arithmetic || division.is_some() {
            // A chain of arithmetic is a left-leaning tree with one level per operator.
            let depth = self.deeper(depth.saturating_add(n_rest) - 1)?;
            let mut expr = first.expr;
            for (op, operand, _) in rest {
                let span = expr.span.to(operand.span);
                expr = Expr::new(ExprKind::Arith(op, Box::new(expr), Box::new(operand)), span);
            }
            return Ok(Operand { expr, depth, sort: Sort::Number, loose: None });
        }
        let depth = self.deeper(depth)?;
        let mut operands = Vec::with_capacity(rest.len() + 1);
        operands.push(first.expr);
        operands.extend(rest.into_iter().map(|(_, operand, _)| operand));
        let (kind, loose) = if level == Level::Mul {
            (ExprKind::And(operands), Loose::And)
        } else {
            (ExprKind::Or(operands), Loose::Or)
        };
        Ok(Operand { expr: Expr::new(kind, span), depth, sort: Sort::Truth, loose: Some(loose) })
    }

    /// Reports `t/X2/5s`, the step time in the notation of IEC 60848 before 2002, and reads it as `5 s/X2.active`. Returns whether the
    /// chain contains one.
    fn old_delays(&mut self, first: &mut Operand, rest: &mut Vec<(ArithOp, Expr, Sort)>) -> bool {
        fn name(expr: &Expr) -> Option<&Path> {
            match &expr.kind {
                ExprKind::Leaf(Leaf::Name(path)) => Some(path),
                _ => None,
            }
        }
        if self.numbers.is_none_or(|numbers| numbers.contains("t")) {
            return false;
        }
        let mut found = false;
        let mut at = 0;
        while at + 1 < rest.len() {
            let time = if at == 0 { &first.expr } else { &rest[at - 1].1 };
            let [(ArithOp::Div, step, _), (ArithOp::Div, length, _)] = &rest[at..at + 2] else {
                at += 1;
                continue;
            };
            let (Some(t), Some(path), ExprKind::Leaf(Leaf::Duration(ns))) =
                (name(time), name(step), &length.kind)
            else {
                at += 1;
                continue;
            };
            if t.to_string() != "t" {
                at += 1;
                continue;
            }
            let (span, ns) = (time.span.to(length.span), *ns);
            let mut names = path.names.clone();
            names.push(Name::new("active", path.span()));
            let path = Path { names };
            let written = format!(
                "{}/{}",
                grafsynth_ir::duration(ns),
                super::names::path(&path, Position::Anywhere)
            );
            self.report(|| {
                Diagnostic::error(
                    codes::AMBIGUOUS,
                    "`t/step/duration` is the notation of IEC 60848 before 2002",
                )
                .at(span, "not supported")
                .help(format!("write `{written}`"))
                .fix(span, written)
            });
            let active = Expr::new(ExprKind::Leaf(Leaf::Name(path)), span);
            let delay = Expr::new(ExprKind::Leaf(Leaf::Delay(ns, Box::new(active), 0)), span);
            if at == 0 {
                first.expr = delay;
                (first.sort, first.loose) = (Sort::Truth, None);
            } else {
                (rest[at - 1].1, rest[at - 1].2) = (delay, Sort::Truth);
            }
            rest.drain(at..at + 2);
            found = true;
            at += 1;
        }
        found
    }

    /// The depth of a tree whose deepest subtree has depth `depth`. Reports a depth beyond the limit.
    fn deeper(&mut self, depth: u32) -> Parse<u32> {
        if depth < self.limits.nesting { Ok(depth + 1) } else { Err(self.too_deep()) }
    }

    fn prefix(&mut self, min: Level) -> Parse<Operand> {
        let token = self.peek(0);
        match token.kind {
            Kind::Word => match self.word(0) {
                "not" => {
                    self.advance();
                    // After an operator with a higher precedence, `not` accepts only an operand that this operator would accept.
                    let operand = self.operand_at(if min <= Level::Not {
                        Level::Not
                    } else {
                        Level::Prefix
                    })?;
                    if operand.loose.is_some() {
                        let span = operand.expr.span;
                        self.report(|| {
                            Diagnostic::error(
                                codes::AMBIGUOUS,
                                "`not` before operands joined by signs is ambiguous",
                            )
                            .at(
                                span,
                                "unclear whether all of this is negated, or only its first part",
                            )
                            .help("put this in parentheses, or negate the first part with `/`")
                        });
                    }
                    self.negated(token, operand)
                }
                "bnot" => self.complement(token),
                "if" => self.select(token),
                "true" | "false" => {
                    let value = self.word(0) == "true";
                    self.advance();
                    Ok(self.leaf_operand(ExprKind::Bool(value), token.start, Sort::Truth))
                }
                "otherwise" => {
                    self.advance();
                    Ok(self.leaf_operand(ExprKind::Leaf(Leaf::Otherwise), token.start, Sort::Truth))
                }
                "rise" | "fall" if self.kind(1) == Kind::Open => {
                    let is_rise = self.word(0) == "rise";
                    self.advance();
                    let operand = self.parenthesised()?;
                    self.edge(token, is_rise, operand)
                }
                _ => self.named(),
            },
            Kind::Quoted => self.named(),
            Kind::Number | Kind::Fraction => self.number(false),
            Kind::Open => self.parenthesised(),
            Kind::Slash | Kind::NotSign => {
                self.advance();
                let operand = self.operand_at(Level::Prefix)?;
                self.negated(token, operand)
            }
            Kind::Minus => {
                self.advance();
                if self.kind(0) == Kind::Number && self.unit(1).is_none() {
                    let mut operand = self.number(true)?;
                    operand.expr.span = self.span_from(token.start);
                    return Ok(operand);
                }
                let operand = self.operand_at(Level::Prefix)?;
                let depth = self.deeper(operand.depth)?;
                let kind = ExprKind::Neg(Box::new(operand.expr));
                Ok(Operand {
                    expr: Expr::new(kind, self.span_from(token.start)),
                    depth,
                    sort: Sort::Number,
                    loose: None,
                })
            }
            Kind::Up | Kind::Down => {
                self.advance();
                let operand = self.operand_at(Level::Prefix)?;
                self.edge(token, token.kind == Kind::Up, operand)
            }
            _ => Err(self.unexpected("a condition or a value")),
        }
    }

    fn leaf_operand(&self, kind: ExprKind<Leaf>, start: u32, sort: Sort) -> Operand {
        Operand { expr: Expr::new(kind, self.span_from(start)), depth: 1, sort, loose: None }
    }

    fn negated(&mut self, sign: Token, operand: Operand) -> Parse<Operand> {
        let depth = self.deeper(operand.depth)?;
        let kind = ExprKind::Not(Box::new(operand.expr));
        Ok(Operand {
            expr: Expr::new(kind, self.span_from(sign.start)),
            depth,
            sort: Sort::Truth,
            loose: None,
        })
    }

    /// Parses `bnot x`, which is `x bxor -1`.
    fn complement(&mut self, sign: Token) -> Parse<Operand> {
        self.advance();
        let operand = self.operand_at(Level::Prefix)?;
        let depth = self.deeper(operand.depth)?;
        let span = self.span_from(sign.start);
        let ones = Box::new(Expr::new(ExprKind::Int(-1), span));
        let kind = ExprKind::Arith(ArithOp::BitXor, Box::new(operand.expr), ones);
        Ok(Operand { expr: Expr::new(kind, span), depth, sort: Sort::Number, loose: None })
    }

    fn edge(&mut self, sign: Token, is_rise: bool, operand: Operand) -> Parse<Operand> {
        let depth = self.deeper(operand.depth)?;
        let inner = Box::new(operand.expr);
        let leaf = if is_rise { Leaf::Rise(inner) } else { Leaf::Fall(inner) };
        Ok(Operand { depth, ..self.leaf_operand(ExprKind::Leaf(leaf), sign.start, Sort::Truth) })
    }

    fn parenthesised(&mut self) -> Parse<Operand> {
        let open = self.expect(Kind::Open, "`(`")?;
        if self.kind(0) == Kind::Close {
            return Err(
                self.missing("the parentheses are empty", "write a condition or a value there")
            );
        }
        let mut inner = self.operand_at(Level::Or)?;
        if self.kind(0) != Kind::Close {
            let open = self.span(open);
            let failed = self.unexpected("`)`");
            if let Some(finding) = self.findings.kept.last_mut()
                && self.findings.rest == 0
                && finding.code == codes::UNEXPECTED
            {
                finding
                    .labels
                    .push(grafsynth_ir::diag::Label { span: open, text: "opened here".to_owned() });
            }
            return Err(failed);
        }
        self.advance();
        inner.expr.span = self.span_from(open.start);
        inner.loose = None;
        Ok(inner)
    }

    /// Parses `if c then a else b`.
    fn select(&mut self, token: Token) -> Parse<Operand> {
        self.advance();
        let condition = self.operand_at(Level::Or)?;
        self.expect_word("then")?;
        let first = self.operand_at(Level::Or)?;
        self.expect_word("else")?;
        let second = self.operand_at(Level::Or)?;
        let depth = self.deeper(condition.depth.max(first.depth).max(second.depth))?;
        let sort = if first.sort == Sort::Unknown { second.sort } else { first.sort };
        let kind =
            ExprKind::Select(Box::new(condition.expr), Box::new(first.expr), Box::new(second.expr));
        Ok(Operand { expr: Expr::new(kind, self.span_from(token.start)), depth, sort, loose: None })
    }

    /// Parses a number, a duration, or `3 s/E/2 s`.
    fn number(&mut self, is_negative: bool) -> Parse<Operand> {
        let token = self.peek(0);
        if token.kind == Kind::Fraction || self.unit(1).is_some() {
            let on_delay = self.duration()?;
            if self.kind(0) == Kind::Slash {
                return self.delay(token, on_delay);
            }
            return Ok(self.leaf_operand(
                ExprKind::Leaf(Leaf::Duration(on_delay)),
                token.start,
                Sort::Number,
            ));
        }
        self.advance();
        let value = self.number_at(token).and_then(|value| {
            let value = if is_negative { -i128::from(value) } else { i128::from(value) };
            i64::try_from(value).ok()
        });
        let value = value.unwrap_or_else(|| {
            let span = self.span(token);
            self.report(|| {
                Diagnostic::error(codes::NUMBER, "number beyond 64 bits")
                    .at(span, "the largest number is 9223372036854775807")
                    .help("write a smaller number")
            });
            0
        });
        Ok(self.leaf_operand(ExprKind::Int(value), token.start, Sort::Number))
    }

    /// Parses the rest of `3 s/E/2 s` or `3 s/E` after its first duration: on-delay and off-delay of IEC 60848.
    fn delay(&mut self, token: Token, on_delay: u64) -> Parse<Operand> {
        self.advance();
        let operand = self.operand_at(Level::Prefix)?;
        let off_delay = if self.kind(0) == Kind::Slash
            && matches!(self.kind(1), Kind::Number | Kind::Fraction)
            && self.unit(2).is_some()
        {
            self.advance();
            self.duration()?
        } else {
            0
        };
        let depth = self.deeper(operand.depth)?;
        let leaf = Leaf::Delay(on_delay, Box::new(operand.expr), off_delay);
        Ok(Operand { depth, ..self.leaf_operand(ExprKind::Leaf(leaf), token.start, Sort::Truth) })
    }

    /// Parses `m1.s3.active`, `f()` or `v[i]`.
    fn named(&mut self) -> Parse<Operand> {
        let token = self.peek(0);
        if let Some(ns) = self.iec_duration() {
            let leaf = ExprKind::Leaf(Leaf::Duration(ns));
            return Ok(self.leaf_operand(leaf, token.start, Sort::Number));
        }
        if self.looks_like_next_item() {
            return Err(self.missing(
                "a condition or a value is missing",
                "write it here, or remove the word before it",
            ));
        }
        let start = self.peek(0).start;
        let mut last = self.peek(0);
        let first = self.name("a condition or a value")?;
        let mut names = vec![first];
        while self.kind(0) == Kind::Dot {
            self.advance();
            last = self.peek(0);
            let name = self.name("a name after the dot")?;
            self.keep(&mut names, name);
        }
        let is_path = last.start != start;
        let text = super::numbers::name_of(self.text, last);
        let is_declared = self.numbers.is_some_and(|numbers| numbers.contains(text));
        let sort = match text {
            "t" | "T" if is_path => Sort::Number,
            "active" | "done" if is_path => Sort::Truth,
            _ if is_declared => Sort::Number,
            _ => Sort::Unknown,
        };
        names.shrink_to_fit();
        let leaf = Leaf::Name(Path { names });
        match self.kind(0) {
            Kind::Open if !self.peek(0).new_line => {
                self.advance();
                if self.kind(0) != Kind::Close {
                    return Err(self.no_arguments(token, text));
                }
                self.advance();
                Ok(self.leaf_operand(ExprKind::Leaf(leaf), start, sort))
            }
            Kind::OpenBracket => {
                self.advance();
                let index = self.operand_at(Level::Or)?;
                self.expect(Kind::CloseBracket, "`]`")?;
                let depth = self.deeper(index.depth)?;
                let kind = ExprKind::Element(leaf, Box::new(index.expr));
                Ok(Operand { depth, ..self.leaf_operand(kind, start, sort) })
            }
            _ => Ok(self.leaf_operand(ExprKind::Leaf(leaf), start, sort)),
        }
    }

    /// Reports `rising(go)`: a function of another language, or an extern condition with arguments.
    fn no_arguments(&mut self, token: Token, name: &str) -> ErrorReported {
        const EDGES: [(&str, &[&str]); 2] = [
            ("rise", &["rising", "rising_edge", "posedge", "r_trig", "re", "redge"]),
            ("fall", &["falling", "falling_edge", "negedge", "f_trig", "fe", "fedge"]),
        ];
        let lower = name.to_ascii_lowercase();
        let edge = EDGES.iter().find(|(edge, others)| *edge == lower || others.contains(&&*lower));
        let span = self.span(token);
        self.report(|| {
            let finding = Diagnostic::error(
                codes::UNEXPECTED,
                format!("`{}` is written with arguments, but conditions have none", short(name)),
            );
            match edge {
                Some((edge, _)) => finding
                    .at(span, "no function of the chart language")
                    .help(format!("did you mean `{edge}`?"))
                    .fix(span, *edge),
                None => finding.at(span, "no function of the chart language").help(
                    "the functions are `rise` and `fall`; an extern condition is written with empty parentheses",
                ),
            }
        });
        ErrorReported
    }

    /// Whether an operand is missing at the end of the line, so that the first word of the next line would be used as that operand. A word
    /// before a keyword of the expression or of a clause (`step do {`) counts as the operand, so that valid text is accepted.
    fn looks_like_next_item(&self) -> bool {
        let goes_on = matches!(self.word(1), "then" | "else") || CLAUSES.contains(&self.word(1));
        self.peek(0).new_line
            && (matches!(self.kind(1), Kind::Colon | Kind::Arrow | Kind::Ampersand | Kind::Assign)
                || matches!(self.word(0), "entry" | "exit") && self.kind(1) == Kind::OpenBrace
                || self.begins_outer_item() && !goes_on)
    }

    /// Parses a dotted name.
    pub(crate) fn path(&mut self, what: &str) -> Parse<Path> {
        let first = self.name(what)?;
        self.path_from(first)
    }

    /// Parses the rest of a dotted name.
    pub(crate) fn path_from(&mut self, first: Name) -> Parse<Path> {
        let mut names = vec![first];
        while self.kind(0) == Kind::Dot {
            self.advance();
            let name = self.name("a name after the dot")?;
            self.keep(&mut names, name);
        }
        names.shrink_to_fit();
        Ok(Path { names })
    }

    /// The span of the next token.
    pub(crate) fn here(&self) -> Span {
        self.span(self.peek(0))
    }
}
