//! Expressions of C: a Pratt parser. Chains of `&&`, `||` and `,` stay flat.

use super::ast::{BinaryOp, Expr, ExprKind, UnaryOp};
use super::lexer::Kind;
use super::parser::{Parser, Read};
use grafsynth_ir::diag::ErrorReported;
use grafsynth_ir::{Name, Span};

/// A binary operator and its binding power. The lower powers are `,` 1, assignment 2, `?:` 3, `||` 4 and `&&` 5.
fn binary(sign: &str) -> Option<(BinaryOp, u8)> {
    Some(match sign {
        "|" => (BinaryOp::Or, 6),
        "^" => (BinaryOp::Xor, 7),
        "&" => (BinaryOp::And, 8),
        "==" => (BinaryOp::Eq, 9),
        "!=" => (BinaryOp::Ne, 9),
        "<" => (BinaryOp::Lt, 10),
        "<=" => (BinaryOp::Le, 10),
        ">" => (BinaryOp::Gt, 10),
        ">=" => (BinaryOp::Ge, 10),
        "<<" => (BinaryOp::ShiftLeft, 11),
        ">>" => (BinaryOp::ShiftRight, 11),
        "+" => (BinaryOp::Add, 12),
        "-" => (BinaryOp::Sub, 12),
        "*" => (BinaryOp::Mul, 13),
        "/" => (BinaryOp::Div, 13),
        "%" => (BinaryOp::Mod, 13),
        _ => return None,
    })
}

/// The operator of `op=`; the inner `None` is the plain assignment.
fn assignment(sign: &str) -> Option<Option<BinaryOp>> {
    if sign == "=" {
        return Some(None);
    }
    let op = sign.strip_suffix('=')?;
    match op {
        "*" | "/" | "%" | "+" | "-" | "<<" | ">>" | "&" | "^" | "|" => {
            binary(op).map(|(op, _)| Some(op))
        }
        _ => None,
    }
}

impl Parser<'_> {
    /// Parses a whole expression, including commas.
    pub(super) fn expression(&mut self) -> Read<Expr> {
        let first = self.assignment()?;
        if !self.is(",") {
            return Ok(first);
        }
        let start = first.span;
        let mut all = vec![first];
        while self.accept(",") {
            all.push(self.assignment()?);
        }
        Ok(Expr { kind: ExprKind::Comma(all), span: self.since(start) })
    }

    /// Parses an expression without a comma at its top level.
    pub(super) fn assignment(&mut self) -> Read<Expr> {
        let left = self.conditional()?;
        let token = self.here();
        match if token.kind == Kind::Sign { assignment(self.word_of(token)) } else { None } {
            Some(op) => self.assigned(left, op),
            None => Ok(left),
        }
    }

    fn assigned(&mut self, left: Expr, op: Option<BinaryOp>) -> Read<Expr> {
        self.take();
        let right = self.inside(Self::assignment)?;
        let span = left.span.to(right.span);
        Ok(Expr { kind: ExprKind::Assign(op, Box::new(left), Box::new(right)), span })
    }

    fn conditional(&mut self) -> Read<Expr> {
        let condition = self.junction(false)?;
        if self.is("?") { self.chosen(condition) } else { Ok(condition) }
    }

    fn chosen(&mut self, condition: Expr) -> Read<Expr> {
        self.take();
        let then = self.inside(Self::expression)?;
        self.expect(":")?;
        let otherwise = self.inside(Self::conditional)?;
        let span = condition.span.to(otherwise.span);
        let kind = ExprKind::Conditional(Box::new(condition), Box::new(then), Box::new(otherwise));
        Ok(Expr { kind, span })
    }

    /// Runs `read` two nesting levels deeper, because a whole expression uses as much stack as two levels.
    fn inside<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        self.deeper(|p| p.deeper(read))
    }

    /// Parses a chain of `||` or of `&&`.
    fn junction(&mut self, is_and: bool) -> Read<Expr> {
        let sign = if is_and { "&&" } else { "||" };
        let operand = |p: &mut Self| if is_and { p.binary(6) } else { p.junction(true) };
        let first = operand(self)?;
        if !self.is(sign) {
            return Ok(first);
        }
        let start = first.span;
        let mut all = vec![first];
        while self.accept(sign) {
            all.push(operand(self)?);
        }
        Ok(Expr { kind: ExprKind::Junction(is_and, all), span: self.since(start) })
    }

    /// Parses operators with at least the binding power `least`.
    fn binary(&mut self, least: u8) -> Read<Expr> {
        let outside = std::mem::replace(&mut self.reach, self.depth);
        let mut left = self.unary()?;
        while let Some((op, power)) = self.operator().filter(|(_, power)| *power >= least) {
            // The tree of a chain grows to the left, one level per operand.
            if !self.pushed_down() {
                return self.too_long();
            }
            self.take();
            let right = self.deeper(|p| p.binary(power + 1))?;
            let span = left.span.to(right.span);
            left = Expr { kind: ExprKind::Binary(op, Box::new(left), Box::new(right)), span };
        }
        self.reach = self.reach.max(outside);
        Ok(left)
    }

    fn operator(&self) -> Option<(BinaryOp, u8)> {
        let token = self.here();
        if token.kind == Kind::Sign { binary(self.word_of(token)) } else { None }
    }

    /// Reports that the nesting limit is exceeded.
    fn too_long<T>(&mut self) -> Read<T> {
        let depth = std::mem::replace(&mut self.depth, self.nesting);
        let result = self.deeper(|_| Err(ErrorReported));
        self.depth = depth;
        result
    }

    // One small function per form: the stack of a deep expression is the sum of their frames.

    fn unary(&mut self) -> Read<Expr> {
        let start = self.here().span;
        let token = self.here();
        let sign =
            if matches!(token.kind, Kind::Sign | Kind::Word) { self.word_of(token) } else { "" };
        match sign {
            "++" | "--" => self.prefix_step(start, if sign == "++" { 1 } else { -1 }),
            "+" => self.prefix(start, UnaryOp::Plus),
            "-" => self.prefix(start, UnaryOp::Minus),
            "~" => self.prefix(start, UnaryOp::Complement),
            "!" => self.prefix(start, UnaryOp::Not),
            "*" => self.pointed(start, true),
            "&" => self.pointed(start, false),
            "sizeof" => self.sizeof(start),
            "(" if self.begins_cast() => self.cast(start),
            _ => self.postfix(start),
        }
    }

    fn prefix_step(&mut self, start: Span, by: i64) -> Read<Expr> {
        self.take();
        let operand = Box::new(self.deeper(Self::unary)?);
        Ok(Expr { kind: ExprKind::Step { operand, by, is_prefix: true }, span: self.since(start) })
    }

    fn prefix(&mut self, start: Span, op: UnaryOp) -> Read<Expr> {
        self.take();
        let operand = Box::new(self.deeper(Self::unary)?);
        Ok(Expr { kind: ExprKind::Unary(op, operand), span: self.since(start) })
    }

    fn pointed(&mut self, start: Span, is_deref: bool) -> Read<Expr> {
        self.take();
        let operand = Box::new(self.deeper(Self::unary)?);
        let kind = if is_deref { ExprKind::Deref(operand) } else { ExprKind::AddressOf(operand) };
        Ok(Expr { kind, span: self.since(start) })
    }

    fn sizeof(&mut self, start: Span) -> Read<Expr> {
        self.take();
        if self.is("(") && self.begins_cast() {
            self.take();
            let ty = Box::new(self.type_name()?);
            self.expect(")")?;
            return Ok(Expr { kind: ExprKind::SizeofType(ty), span: self.since(start) });
        }
        let operand = Box::new(self.deeper(Self::unary)?);
        Ok(Expr { kind: ExprKind::Sizeof(operand), span: self.since(start) })
    }

    fn cast(&mut self, start: Span) -> Read<Expr> {
        self.take();
        let ty = Box::new(self.type_name()?);
        self.expect(")")?;
        let operand = Box::new(self.deeper(Self::unary)?);
        Ok(Expr { kind: ExprKind::Cast(ty, operand), span: self.since(start) })
    }

    fn postfix(&mut self, start: Span) -> Read<Expr> {
        let outside = std::mem::replace(&mut self.reach, self.depth);
        let mut value = self.primary()?;
        while self.is("[")
            || self.is("(")
            || self.is(".")
            || self.is("->")
            || self.is("++")
            || self.is("--")
        {
            if !self.pushed_down() {
                return self.too_long();
            }
            value = self.suffix(start, value)?;
        }
        self.reach = self.reach.max(outside);
        Ok(value)
    }

    fn suffix(&mut self, start: Span, value: Expr) -> Read<Expr> {
        let kind = if self.accept("[") {
            let index = self.inside(Self::expression)?;
            self.expect("]")?;
            ExprKind::Index(Box::new(value), Box::new(index))
        } else if self.accept("(") {
            let arguments = self.inside(Self::arguments)?;
            if let ExprKind::Name(name) = &value.kind {
                ExprKind::Call(Name::new(name.clone(), value.span), arguments)
            } else {
                ExprKind::Opaque(std::iter::once(value).chain(arguments).collect())
            }
        } else if self.is(".") || self.is("->") {
            self.take();
            if !self.is_name(self.here()) {
                return self.unexpected("the name of a member");
            }
            self.take();
            ExprKind::Opaque(vec![value])
        } else {
            let by = if self.is("++") { 1 } else { -1 };
            self.take();
            ExprKind::Step { operand: Box::new(value), by, is_prefix: false }
        };
        Ok(Expr { kind, span: self.since(start) })
    }

    fn arguments(&mut self) -> Read<Vec<Expr>> {
        let mut all = Vec::new();
        if self.accept(")") {
            return Ok(all);
        }
        loop {
            all.push(self.assignment()?);
            if !self.accept(",") {
                break;
            }
        }
        self.expect(")")?;
        Ok(all)
    }

    fn bracketed(&mut self) -> Read<Expr> {
        let start = self.take().span;
        let mut inner = self.inside(Self::expression)?;
        self.expect(")")?;
        // A bare name keeps its own span, because names are looked up by their spans.
        if !matches!(inner.kind, ExprKind::Name(_)) {
            inner.span = self.since(start);
        }
        Ok(inner)
    }

    fn primary(&mut self) -> Read<Expr> {
        if self.is("(") { self.bracketed() } else { self.atom() }
    }

    fn atom(&mut self) -> Read<Expr> {
        let token = self.here();
        let kind = match token.kind {
            Kind::Number { value, is_unsigned, n_long, is_decimal } => {
                ExprKind::Number { value, is_unsigned, n_long, is_decimal }
            }
            Kind::Char(value) => ExprKind::Char(value),
            Kind::Float => ExprKind::Float,
            Kind::Text => {
                self.take();
                // Adjacent strings are concatenated.
                while self.here().kind == Kind::Text {
                    self.take();
                }
                return Ok(Expr { kind: ExprKind::Text, span: self.since(token.span) });
            }
            Kind::Word if self.is_name(token) => ExprKind::Name(self.word_of(token).to_owned()),
            Kind::Word | Kind::Sign | Kind::End => return self.unexpected("an expression"),
        };
        self.take();
        Ok(Expr { kind, span: token.span })
    }
}
