//! Expressions (C99 6.5): recursive descent with precedences for the operators.

use super::lexer::{Token, TokenKind};
use super::{MAX_HEIGHT, Parser, Read, headers};
use crate::codes;
use crate::tree::types::{IntKind, Type};
use crate::tree::typing::TypeError;
use crate::tree::{
    BinaryOp, Expr, ExprKind, Header, Loc, LogicalOp, Place, SizeOfOperand, SymbolKind, UnaryOp,
};
use grafsynth_ir::Span;

/// Words that neither begin an expression nor name a type of the supported subset.
const UNSUPPORTED: [&str; 15] = [
    "auto",
    "double",
    "float",
    "goto",
    "register",
    "union",
    "_Complex",
    "_Imaginary",
    "case",
    "default",
    "else",
    "return",
    "typedef",
    "extern",
    "static",
];

/// The meaning of a subexpression before it is used: an object, a value and so on.
#[derive(Debug)]
enum Meaning {
    Value(Expr),
    Place(Place),
}

/// A subexpression with the height of its tree.
#[derive(Debug)]
pub(super) struct Operand {
    meaning: Meaning,
    height: usize,
}

/// An operator between two operands.
#[derive(Debug, Clone, Copy)]
enum Infix {
    Binary(BinaryOp),
    Logical(LogicalOp),
}

impl Parser<'_, '_> {
    /// A constant expression that extends to the end of the tokens.
    pub(crate) fn whole_constant(&mut self) -> Read<i128> {
        let value = self.constant()?.1;
        if self.peek().kind == TokenKind::End { Ok(value) } else { self.unexpected("an operator") }
    }

    /// A constant expression and its value (C99 6.6).
    pub(super) fn constant(&mut self) -> Read<(Expr, i128)> {
        let start = self.span();
        let operand = self.conditional()?;
        let expr = self.value(operand)?;
        match self.unit.constant(&expr) {
            Some(value) => Ok((expr, value)),
            None => {
                let span = self.since(start).0;
                self.fail(codes::TYPE, "this has no constant value", span, "here")
            }
        }
    }

    /// Reads an expression that may contain the comma operator, as a value.
    pub(super) fn expression(&mut self) -> Read<Expr> {
        let operand = self.deeper(Self::comma)?;
        self.value(operand)
    }

    /// Reads an assignment expression (without a top-level comma), as a value.
    pub(super) fn assignment_value(&mut self) -> Read<Expr> {
        let operand = self.deeper(Self::assignment)?;
        self.value(operand)
    }

    /// Reads a condition in parentheses.
    pub(super) fn condition(&mut self) -> Read<Expr> {
        self.expect("(")?;
        let condition = self.expression()?;
        self.expect(")")?;
        let span = condition.span;
        self.typed(self.unit.scalar(condition), span)
    }

    #[inline(never)]
    fn value(&mut self, operand: Operand) -> Read<Expr> {
        match operand.meaning {
            Meaning::Value(value) => Ok(value),
            Meaning::Place(place) => {
                let span = place.span;
                self.typed(self.unit.read(place), span)
            }
        }
    }

    /// Makes a node whose highest operand has this height.
    #[inline(never)]
    fn node(&mut self, expr: Result<Expr, TypeError>, span: Loc, height: usize) -> Read<Operand> {
        let expr = self.typed(expr, span)?;
        self.grown(Meaning::Value(expr), span, height)
    }

    #[inline(never)]
    fn place_node(
        &mut self,
        place: Result<Place, TypeError>,
        span: Loc,
        height: usize,
    ) -> Read<Operand> {
        let place = self.typed(place, span)?;
        self.grown(Meaning::Place(place), span, height)
    }

    #[inline(never)]
    fn grown(&mut self, meaning: Meaning, span: Loc, height: usize) -> Read<Operand> {
        if height >= MAX_HEIGHT {
            let message = format!("the expression has more than {MAX_HEIGHT} levels of operators");
            return self.fail(codes::LIMIT, message, span.0, "here");
        }
        Ok(Operand { meaning, height: height + 1 })
    }

    fn comma(&mut self) -> Read<Operand> {
        let start = self.span();
        let mut left = self.assignment()?;
        while self.take(",") {
            let right = self.assignment()?;
            let height = left.height.max(right.height);
            let (a, b) = (self.value(left)?, self.value(right)?);
            let span = self.since(start);
            left = self.node(Ok(self.unit.comma(a, b, span)), span, height)?;
        }
        Ok(left)
    }

    fn assignment(&mut self) -> Read<Operand> {
        let start = self.span();
        let left = self.conditional()?;
        let sign = self.peek();
        let op = match update_op(sign) {
            Some(op) => Some(op),
            None if sign.is("=") => None,
            None => return Ok(left),
        };
        let Meaning::Place(place) = left.meaning else {
            let message = format!("the left side of `{}` is not an object", sign.text);
            return self.fail(codes::TYPE, message, sign.span, "here");
        };
        self.next();
        let right = self.deeper(Self::assignment)?;
        let height = left.height.max(right.height);
        let value = self.value(right)?;
        let span = self.since(start);
        let expr = match op {
            Some(op) => self.unit.update(op, place, value, span),
            None => self.unit.assign(place, value, span),
        };
        self.node(expr, span, height)
    }

    fn conditional(&mut self) -> Read<Operand> {
        let start = self.span();
        let condition = self.binary(0)?;
        if !self.take("?") {
            return Ok(condition);
        }
        let a = self.deeper(Self::comma)?;
        self.expect(":")?;
        let b = self.deeper(Self::conditional)?;
        let height = condition.height.max(a.height).max(b.height);
        let (c, a, b) = (self.value(condition)?, self.value(a)?, self.value(b)?);
        let span = self.since(start);
        self.node(self.unit.choose(c, a, b, span), span, height)
    }

    /// Reads binary operators of at least the precedence `least`, all of which are left-associative.
    fn binary(&mut self, least: u8) -> Read<Operand> {
        let start = self.span();
        let mut left = self.cast()?;
        while let Some((op, binding)) = infix(self.peek()).filter(|(_, it)| *it >= least) {
            self.next();
            let right = self.deeper(|parser| parser.binary(binding + 1))?;
            left = self.combine(op, left, right, start)?;
        }
        Ok(left)
    }

    #[inline(never)]
    fn combine(&mut self, op: Infix, left: Operand, right: Operand, start: Span) -> Read<Operand> {
        let height = left.height.max(right.height);
        let (a, b) = (self.value(left)?, self.value(right)?);
        let span = self.since(start);
        // A chain of one logical operator is one node, so its height does not grow.
        let is_chain = match (op, &a.kind) {
            (Infix::Logical(op), ExprKind::Logical(own, _)) => op == *own,
            _ => false,
        };
        let expr = match op {
            Infix::Binary(op) => self.unit.binary(op, a, b, span),
            Infix::Logical(op) => self.unit.logical(op, a, b, span),
        };
        let mut whole = self.node(expr, span, if is_chain { height - 1 } else { height })?;
        whole.height = whole.height.max(height);
        Ok(whole)
    }

    fn cast(&mut self) -> Read<Operand> {
        if !(self.peek().is("(") && self.begins_type(1)) {
            return self.unary();
        }
        let start = self.span();
        self.next();
        let ty = self.type_name()?;
        self.expect(")")?;
        if self.peek().is("{") {
            let span = self.span();
            return self.fail(codes::SYNTAX, "compound literals are not supported", span, "here");
        }
        let operand = self.deeper(Self::cast)?;
        let height = operand.height;
        let value = self.value(operand)?;
        let span = self.since(start);
        self.node(self.unit.cast(ty, value, span), span, height)
    }

    fn unary(&mut self) -> Read<Operand> {
        let start = self.span();
        let token = self.peek();
        if token.is_word("sizeof") {
            return self.size_of();
        }
        let op = match (token.kind, token.text) {
            (TokenKind::Sign, "+") => Some(UnaryOp::Plus),
            (TokenKind::Sign, "-") => Some(UnaryOp::Neg),
            (TokenKind::Sign, "~") => Some(UnaryOp::BitNot),
            (TokenKind::Sign, "!") => Some(UnaryOp::Not),
            (TokenKind::Sign, "&" | "*" | "++" | "--") => None,
            _ => return self.postfix(),
        };
        self.next();
        let operand =
            self.deeper(if matches!(token.text, "++" | "--") { Self::unary } else { Self::cast })?;
        let height = operand.height;
        if let Some(op) = op {
            let value = self.value(operand)?;
            let span = self.since(start);
            return self.node(self.unit.unary(op, value, span), span, height);
        }
        let span = self.since(start);
        match (token.text, operand.meaning) {
            ("&", Meaning::Place(place)) => self.node(self.unit.address(place, span), span, height),
            // A function decays to the same pointer, and dereferencing that gives the function again (C99 6.5.3.2p4).
            ("&", Meaning::Value(value)) if matches!(value.kind, ExprKind::Function(_)) => {
                Ok(Operand { meaning: Meaning::Value(value), height })
            }
            ("*", meaning) => {
                let value = self.value(Operand { meaning, height })?;
                if crate::tree::typing::function_type(&value.ty).is_some() {
                    return Ok(Operand { meaning: Meaning::Value(value), height });
                }
                self.place_node(self.unit.deref(value, span), span, height)
            }
            ("++" | "--", Meaning::Place(place)) => {
                let expr = self.unit.step(token.text == "++", true, place, span);
                self.node(expr, span, height)
            }
            (sign, _) => {
                let message = format!("the operand of `{sign}` is not an object");
                self.fail(codes::TYPE, message, span.0, "here")
            }
        }
    }

    #[inline(never)]
    fn size_of(&mut self) -> Read<Operand> {
        let start = self.span();
        self.next();
        let (operand, height) = if self.peek().is("(") && self.begins_type(1) {
            self.next();
            let ty = self.type_name()?;
            self.expect(")")?;
            (SizeOfOperand::Type(ty), 0)
        } else {
            let operand = self.deeper(Self::unary)?;
            match operand.meaning {
                Meaning::Place(place) => (SizeOfOperand::Place(place), operand.height),
                Meaning::Value(value) if matches!(value.kind, ExprKind::Function(_)) => {
                    return self.fail(codes::TYPE, "a function has no size", value.span.0, "here");
                }
                Meaning::Value(value) => (SizeOfOperand::Value(value), operand.height),
            }
        };
        let span = self.since(start);
        self.node(self.unit.size_of(operand, span), span, height)
    }

    fn postfix(&mut self) -> Read<Operand> {
        let start = self.span();
        let mut left = self.primary()?;
        loop {
            let token = self.peek();
            if token.kind != TokenKind::Sign {
                return Ok(left);
            }
            let height = left.height;
            match token.text {
                "(" => {
                    let callee = self.value(left)?;
                    let (arguments, highest) = self.arguments()?;
                    let span = self.since(start);
                    let call = self.unit.call(callee, arguments, span);
                    left = self.node(call, span, height.max(highest))?;
                }
                "[" => left = self.index(left)?,
                "." | "->" => left = self.member(left)?,
                "++" | "--" => {
                    self.next();
                    let span = self.since(start);
                    let Meaning::Place(place) = left.meaning else {
                        let message = format!("the operand of `{}` is not an object", token.text);
                        return self.fail(codes::TYPE, message, span.0, "here");
                    };
                    let expr = self.unit.step(token.text == "++", false, place, span);
                    left = self.node(expr, span, height)?;
                }
                _ => return Ok(left),
            }
        }
    }

    fn arguments(&mut self) -> Read<(Vec<Expr>, usize)> {
        self.expect("(")?;
        let (mut arguments, mut highest) = (Vec::new(), 0);
        if self.take(")") {
            return Ok((arguments, highest));
        }
        loop {
            let argument = self.deeper(Self::assignment)?;
            highest = highest.max(argument.height);
            arguments.push(self.value(argument)?);
            if !self.take(",") {
                self.expect(")")?;
                return Ok((arguments, highest));
            }
        }
    }

    fn index(&mut self, left: Operand) -> Read<Operand> {
        let start = match &left.meaning {
            Meaning::Value(value) => value.span.0,
            Meaning::Place(place) => place.span.0,
        };
        self.expect("[")?;
        let index = self.deeper(Self::comma)?;
        self.expect("]")?;
        let height = left.height.max(index.height);
        let span = self.since(start);
        let index = self.value(index)?;
        let value = match left.meaning {
            Meaning::Place(place) if matches!(place.ty, Type::Array(..)) => {
                return self.place_node(self.unit.element(place, index, span), span, height);
            }
            Meaning::Place(place) => {
                let span = place.span;
                self.typed(self.unit.read(place), span)?
            }
            Meaning::Value(value) => value,
        };
        // `2[p]` is `p[2]` (C99 6.5.2.1p2).
        let is_swapped = index.ty.target().is_some();
        let (pointer, index) = if is_swapped { (index, value) } else { (value, index) };
        self.place_node(self.unit.at(pointer, index, span), span, height)
    }

    #[inline(never)]
    fn member(&mut self, left: Operand) -> Read<Operand> {
        let arrow = self.next();
        let name = self.next();
        let height = left.height;
        if name.kind != TokenKind::Word {
            return self.fail(codes::SYNTAX, "expected the name of a member", name.span, "here");
        }
        if arrow.is("->") {
            let pointer = self.value(left)?;
            let span = Loc(pointer.span.0.to(name.span));
            let base = self.typed(self.unit.deref(pointer, span), span)?;
            return self.place_node(self.unit.member(base, name.text, span), span, height + 1);
        }
        match left.meaning {
            Meaning::Place(place) => {
                let span = Loc(place.span.0.to(name.span));
                self.place_node(self.unit.member(place, name.text, span), span, height)
            }
            Meaning::Value(value) => {
                let span = Loc(value.span.0.to(name.span));
                self.node(self.unit.member_of_value(value, name.text, span), span, height)
            }
        }
    }

    fn primary(&mut self) -> Read<Operand> {
        let token = self.peek();
        let value = match token.kind {
            TokenKind::Number => self.number()?,
            TokenKind::Character => self.character()?,
            TokenKind::Word => return self.name(),
            TokenKind::Sign if token.text == "(" => {
                self.next();
                let inner = self.deeper(Self::comma)?;
                self.expect(")")?;
                return Ok(inner);
            }
            TokenKind::String => {
                let message = "strings are not supported";
                return self.fail(codes::SYNTAX, message, token.span, "here");
            }
            TokenKind::Sign
            | TokenKind::Stray(_)
            | TokenKind::Opaque
            | TokenKind::Header
            | TokenKind::End => return self.unexpected("an expression"),
        };
        Ok(Operand { meaning: Meaning::Value(value), height: 1 })
    }

    #[inline(never)]
    fn name(&mut self) -> Read<Operand> {
        let token = self.peek();
        let span = Loc(token.span);
        let meaning = |value| Ok(Operand { meaning: Meaning::Value(value), height: 1 });
        if let Some(id) = self.lookup(token.text) {
            self.next();
            return match self.unit.symbols[id].kind {
                SymbolKind::Constant(_) => meaning(self.unit.constant_of(id, span)),
                SymbolKind::Function(_) => meaning(self.unit.function(id, span)),
                SymbolKind::Object { .. }
                | SymbolKind::Local { .. }
                | SymbolKind::Parameter
                | SymbolKind::Typedef => {
                    let place = self.typed(self.unit.place_of(id, span), span)?;
                    Ok(Operand { meaning: Meaning::Place(place), height: 1 })
                }
            };
        }
        let value = match token.text {
            "true" | "false" if self.is_cpp || self.has_header(Header::StdBool) => {
                let kind = ExprKind::Bool(token.text == "true");
                Expr { kind, ty: Type::Int(IntKind::Int), span }
            }
            "NULL" if self.has_header(Header::StdDef) => {
                Expr { kind: ExprKind::Null, ty: Type::pointer(Type::Void.into()), span }
            }
            name if headers::sized_constant(name).is_some() && self.has_header(Header::StdInt) => {
                return meaning(self.sized_constant()?);
            }
            name if UNSUPPORTED.contains(&name) => return self.unexpected("an expression"),
            name => return self.unknown_name(name, token.span),
        };
        self.next();
        meaning(value)
    }
}

/// The operator of a compound assignment.
fn update_op(token: Token) -> Option<BinaryOp> {
    let sign = token.text.strip_suffix('=').filter(|_| token.kind == TokenKind::Sign)?;
    BinaryOp::ALL.into_iter().find(|op| op.can_update() && op.sign() == sign)
}

/// An infix operator and its precedence (C99 6.5.5..14).
fn infix(token: Token) -> Option<(Infix, u8)> {
    if token.kind != TokenKind::Sign {
        return None;
    }
    let logical = [LogicalOp::Or, LogicalOp::And].into_iter().zip(0..);
    if let Some((op, binding)) = logical.into_iter().find(|(op, _)| op.sign() == token.text) {
        return Some((Infix::Logical(op), binding));
    }
    let op = BinaryOp::ALL.into_iter().find(|op| op.sign() == token.text)?;
    let binding = match op {
        BinaryOp::BitOr => 2,
        BinaryOp::BitXor => 3,
        BinaryOp::BitAnd => 4,
        BinaryOp::Eq | BinaryOp::Ne => 5,
        BinaryOp::Lt | BinaryOp::Le | BinaryOp::Gt | BinaryOp::Ge => 6,
        BinaryOp::Shl | BinaryOp::Shr => 7,
        BinaryOp::Add | BinaryOp::Sub => 8,
        BinaryOp::Mul | BinaryOp::Div | BinaryOp::Rem => 9,
    };
    Some((Infix::Binary(op), binding))
}
