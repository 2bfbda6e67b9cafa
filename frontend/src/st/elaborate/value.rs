//! Turns expressions of structured text into expressions of the chart.

use grafsynth_ir::chart::{Expr, Leaf, Path};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::diag::ErrorReported;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use grafsynth_ir::{Name, Span};

use super::bits::BitOp;
use super::types::Ty;
use super::usage::upper;
use super::{Access, Binding, Elaborator, FrameId, ObjectKind, Outcome, Place};
use crate::codes;
use crate::st::ast::{self, Op};

/// An expression of the chart, with what is known about its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Value {
    pub(super) expr: Expr,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    /// Smallest and largest value.
    Int(i64, i64),
    Time(Time),
}

/// A time. Charts compare times only with constants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Time {
    /// A constant in nanoseconds.
    Constant(i64),
    /// The expression is a number of milliseconds. If its possible values are known, they are listed in nanoseconds.
    Varying(super::times::Values),
    /// The expression is the name of a timer or of the time of a step.
    Running,
    /// ET of an on-delay timer: the timer in the expression while the block's input was true, at most PT in nanoseconds, otherwise 0.
    Elapsed { running: Box<Expr>, limit: i64 },
}

impl Value {
    pub(super) fn bool(expr: Expr) -> Self {
        Value { expr, kind: Kind::Bool }
    }

    pub(super) fn constant(value: bool, span: Span) -> Self {
        Value::bool(Expr::new(ExprKind::Bool(value), span))
    }

    pub(super) fn int(value: i64, span: Span) -> Self {
        Value { expr: Expr::new(ExprKind::Int(value), span), kind: Kind::Int(value, value) }
    }

    /// The value of an initial value, which is a number or a Boolean.
    pub(super) fn literal(expr: Expr) -> Self {
        if let ExprKind::Int(value) = expr.kind {
            Value::int(value, expr.span)
        } else {
            Value::bool(expr)
        }
    }

    pub(super) fn time(ns: i64, span: Span) -> Self {
        let leaf = Leaf::Duration(u64::try_from(ns).unwrap_or(0));
        Value { expr: Expr::leaf(leaf, span), kind: Kind::Time(Time::Constant(ns)) }
    }

    /// Wraps the value into `lo..hi` by adding or subtracting the size of that range, as two's complement does.
    pub(super) fn wrapped(self, lo: i64, hi: i64) -> Value {
        let Kind::Int(least, most) = self.kind else { return self };
        let span = self.expr.span;
        let size = hi - lo + 1;
        if least == most {
            return Value::int((least - lo).rem_euclid(size) + lo, span);
        }
        let int = |value| Box::new(Expr::new(ExprKind::Int(value), span));
        let arith = |op, a: Expr, b: i64| Expr::new(ExprKind::Arith(op, Box::new(a), int(b)), span);
        // If one correction is enough, a choice is cheaper than a division.
        let expr = if least >= lo - size && most <= hi + size && nodes(&self.expr, 12) < 12 {
            let mut expr = self.expr.clone();
            if least < lo {
                let is_less = Expr::compare(CompareOp::Lt, self.expr.clone(), *int(lo));
                let up = arith(ArithOp::Add, self.expr.clone(), size);
                expr = Expr::new(
                    ExprKind::Select(Box::new(is_less), Box::new(up), Box::new(expr)),
                    span,
                );
            }
            if most > hi {
                let is_more = Expr::compare(CompareOp::Gt, self.expr.clone(), *int(hi));
                let down = arith(ArithOp::Sub, self.expr, size);
                expr = Expr::new(
                    ExprKind::Select(Box::new(is_more), Box::new(down), Box::new(expr)),
                    span,
                );
            }
            expr
        } else {
            let mut offset = if lo == 0 { self.expr } else { arith(ArithOp::Sub, self.expr, lo) };
            offset = arith(ArithOp::Mod, offset, size);
            if least < lo {
                offset = arith(ArithOp::Mod, arith(ArithOp::Add, offset, size), size);
            }
            if lo == 0 { offset } else { arith(ArithOp::Add, offset, lo) }
        };
        Value { expr, kind: Kind::Int(lo, hi) }
    }
}

/// The number of nodes of an expression, counted up to `most`.
pub(super) fn nodes(expr: &Expr, most: usize) -> usize {
    let mut count = 1;
    for operand in expr.children() {
        if count >= most {
            return count;
        }
        count += nodes(operand, most - count);
    }
    count
}

/// A leaf that reads a name.
pub(super) fn leaf(path: Path, span: Span) -> Expr {
    Expr::leaf(Leaf::Name(path), span)
}

/// Limits the bounds of an exact integer result; lowering refuses larger results anyway.
fn clamp(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value < 0 { i64::MIN } else { i64::MAX })
}

/// The object that a name at `span` refers to.
fn accessed(binding: Binding, span: Span) -> Outcome<Access> {
    match binding {
        Binding::Value(value) => {
            Ok(Access::Value(Value { expr: Expr::new(value.expr.kind, span), kind: value.kind }))
        }
        Binding::Place(place) => Ok(Access::Place(place)),
        Binding::Object(object) => Ok(Access::Object(object)),
        Binding::Step(step) => Ok(Access::Step(step)),
        Binding::Broken => Err(ErrorReported),
    }
}

impl Elaborator<'_> {
    /// Elaborates a Boolean expression.
    pub(super) fn condition(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Expr> {
        let value = self.value(frame, syntax)?;
        self.fit(value, &Ty::Bool, "a condition").map(|value| value.expr)
    }

    /// Elaborates any simple value.
    pub(super) fn value(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Value> {
        self.spend(syntax.span, 1)?;
        let span = syntax.span;
        match &syntax.kind {
            ast::ExprKind::Bool(value) => Ok(Value::constant(*value, span)),
            ast::ExprKind::Int(value) => Ok(Value::int(*value, span)),
            ast::ExprKind::Time(ns) => Ok(Value::time(*ns, span)),
            ast::ExprKind::Name(_)
            | ast::ExprKind::Field(..)
            | ast::ExprKind::Index(..)
            | ast::ExprKind::Address(_)
            | ast::ExprKind::Flag(_) => self.accessed(frame, syntax),
            // Operands are handled in separate functions, because the frame of this function is on the stack once per level.
            ast::ExprKind::Bit(inner, bit) => {
                self.value(frame, inner).and_then(|value| self.bit_of(value, *bit, span))
            }
            ast::ExprKind::Not(inner) => {
                self.value(frame, inner).and_then(|value| self.not_of(value, span))
            }
            ast::ExprKind::Neg(inner) => {
                self.value(frame, inner).and_then(|value| self.negative_of(value, span))
            }
            ast::ExprKind::And(all) => self.junction(frame, all, true, span),
            ast::ExprKind::Or(all) => self.junction(frame, all, false, span),
            ast::ExprKind::Binary(op, a, b) => self.operation(frame, *op, a, b, span),
            ast::ExprKind::Call(name, arguments) => {
                self.call_function(frame, name, arguments, span)
            }
            ast::ExprKind::Refused(_) => Err(ErrorReported),
        }
    }

    fn accessed(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Value> {
        self.access(frame, syntax).and_then(|access| self.read(access, syntax.span))
    }

    fn operation(
        &mut self,
        frame: FrameId,
        op: Op,
        a: &ast::Expr,
        b: &ast::Expr,
        span: Span,
    ) -> Outcome<Value> {
        let (a, b) = (self.value(frame, a), self.value(frame, b));
        self.binary(op, a?, b?, span)
    }

    /// Elaborates all values; continues after an invalid one.
    pub(super) fn values<'e>(
        &mut self,
        frame: FrameId,
        syntax: impl Iterator<Item = &'e ast::Expr>,
    ) -> Outcome<Vec<Value>> {
        let mut values = Vec::new();
        let mut failed = None;
        for one in syntax {
            match self.value(frame, one) {
                Ok(value) => values.push(value),
                Err(told) => failed = Some(told),
            }
        }
        failed.map_or(Ok(values), Err)
    }

    fn bit_of(&mut self, value: Value, bit: u32, span: Span) -> Outcome<Value> {
        match value.kind {
            Kind::Int(lo, _) if lo >= 0 && bit < 31 => {
                let new = |kind| Expr::new(kind, span);
                let int = |n| Box::new(new(ExprKind::Int(n)));
                let shifted =
                    new(ExprKind::Arith(ArithOp::Div, Box::new(value.expr), int(1 << bit)));
                let low = new(ExprKind::Arith(ArithOp::Mod, Box::new(shifted), int(2)));
                Ok(Value::bool(new(ExprKind::Compare(CompareOp::Eq, Box::new(low), int(1)))))
            }
            Kind::Int(..) | Kind::Bool | Kind::Time(_) => Err(self.type_error(
                "single bits can only be read from BYTE, WORD and unsigned integers, up to bit 30",
                span,
            )),
        }
    }

    pub(super) fn not_of(&mut self, value: Value, span: Span) -> Outcome<Value> {
        match value.kind {
            Kind::Bool => Ok(Value::bool(Expr::new(value.expr.not().kind, span))),
            Kind::Int(lo, hi) if lo == hi && (0..=1).contains(&lo) => {
                Ok(Value::constant(lo == 0, span))
            }
            Kind::Int(..) => self.complement(value, span),
            Kind::Time(_) => Err(self.type_error("expected a Boolean, found a time", span)),
        }
    }

    fn negative_of(&mut self, value: Value, span: Span) -> Outcome<Value> {
        match value.kind {
            Kind::Int(lo, hi) if lo == hi => Ok(Value::int(lo.saturating_neg(), span)),
            Kind::Int(lo, hi) => {
                let expr = Expr::new(ExprKind::Neg(Box::new(value.expr)), span);
                let kind = Kind::Int(hi.saturating_neg(), lo.saturating_neg());
                Ok(Value { expr, kind })
            }
            Kind::Time(Time::Constant(ns)) => Ok(Value::time(ns.saturating_neg(), span)),
            Kind::Time(_) | Kind::Bool => Err(self.type_error("expected a number", span)),
        }
    }

    pub(super) fn type_error(&mut self, message: &str, span: Span) -> ErrorReported {
        self.report(Diagnostic::error(codes::ST_TYPE, message).at(span, ""))
    }

    fn junction(
        &mut self,
        frame: FrameId,
        all: &[ast::Expr],
        is_and: bool,
        span: Span,
    ) -> Outcome<Value> {
        let values = self.values(frame, all.iter())?;
        self.join(values, is_and, span)
    }

    /// AND or OR of Booleans, or bit by bit of numbers.
    pub(super) fn join(&mut self, values: Vec<Value>, is_and: bool, span: Span) -> Outcome<Value> {
        // 0 and 1 are also literals of BOOL.
        let is_number = |value: &Value| match value.kind {
            Kind::Int(lo, hi) => lo != hi || !(0..=1).contains(&lo),
            Kind::Bool | Kind::Time(_) => false,
        };
        if values.iter().any(is_number) {
            let op = if is_and { BitOp::And } else { BitOp::Or };
            return self.bitwise(op, values, span);
        }
        let mut operands = Vec::with_capacity(values.len());
        for value in values {
            operands.push(self.fit(value, &Ty::Bool, "a condition")?.expr);
        }
        // Parentheses stay, so that written text reads back as the same expression; constants are folded.
        let is_plain =
            operands.len() > 1 && operands.iter().all(|one| !matches!(one.kind, ExprKind::Bool(_)));
        let mut expr = match (is_plain, is_and) {
            (true, true) => Expr::new(ExprKind::And(operands), span),
            (true, false) => Expr::new(ExprKind::Or(operands), span),
            (false, true) => Expr::and(operands),
            (false, false) => Expr::or(operands),
        };
        expr.span = span;
        Ok(Value::bool(expr))
    }

    /// A binary operator on two values.
    pub(super) fn binary(&mut self, op: Op, a: Value, b: Value, span: Span) -> Outcome<Value> {
        let compare = match op {
            Op::Eq => Some(CompareOp::Eq),
            Op::Ne | Op::Xor => Some(CompareOp::Ne),
            Op::Lt => Some(CompareOp::Lt),
            Op::Le => Some(CompareOp::Le),
            Op::Gt => Some(CompareOp::Gt),
            Op::Ge => Some(CompareOp::Ge),
            Op::Add | Op::Sub | Op::Mul | Op::Div | Op::Mod | Op::Power => None,
        };
        if let Some(compare) = compare {
            return self.compare(compare, op == Op::Xor, a, b, span);
        }
        self.arithmetic(op, a, b, span)
    }

    fn compare(
        &mut self,
        op: CompareOp,
        is_xor: bool,
        a: Value,
        b: Value,
        span: Span,
    ) -> Outcome<Value> {
        match (&a.kind, &b.kind) {
            (Kind::Time(_), Kind::Time(_)) => return self.compare_times(op, a, b, span),
            (Kind::Bool, _) | (_, Kind::Bool) => {
                let a = self.fit(a, &Ty::Bool, "a comparison with a Boolean")?.expr;
                let b = self.fit(b, &Ty::Bool, "a comparison with a Boolean")?.expr;
                let expr = match (op, &a.kind, &b.kind) {
                    (CompareOp::Eq, _, ExprKind::Bool(true))
                    | (CompareOp::Ne, _, ExprKind::Bool(false)) => a,
                    (CompareOp::Eq, _, ExprKind::Bool(false))
                    | (CompareOp::Ne, _, ExprKind::Bool(true)) => a.not(),
                    (CompareOp::Eq, ExprKind::Bool(true), _)
                    | (CompareOp::Ne, ExprKind::Bool(false), _) => b,
                    (CompareOp::Eq, ExprKind::Bool(false), _)
                    | (CompareOp::Ne, ExprKind::Bool(true), _) => b.not(),
                    // false < true
                    (CompareOp::Lt, ..) => Expr::and([a.not(), b]),
                    (CompareOp::Gt, ..) => Expr::and([a, b.not()]),
                    (CompareOp::Le, ..) => Expr::or([a.not(), b]),
                    (CompareOp::Ge, ..) => Expr::or([a, b.not()]),
                    (CompareOp::Eq | CompareOp::Ne, ..) => Expr::compare(op, a, b),
                };
                return Ok(Value::bool(Expr::new(expr.kind, span)));
            }
            (Kind::Int(..), Kind::Int(..)) if is_xor => {
                return self.bitwise(BitOp::Xor, vec![a, b], span);
            }
            (Kind::Int(al, ah), Kind::Int(bl, bh)) => {
                if al == ah && bl == bh {
                    return Ok(Value::constant(op.apply(*al, *bl), span));
                }
            }
            (Kind::Int(..), Kind::Time(_)) | (Kind::Time(_), Kind::Int(..)) => {
                return Err(self.type_error("a time cannot be compared with a number", span));
            }
        }
        let expr = ExprKind::Compare(op, Box::new(a.expr), Box::new(b.expr));
        Ok(Value::bool(Expr::new(expr, span)))
    }

    pub(super) fn compare_times(
        &mut self,
        op: CompareOp,
        a: Value,
        b: Value,
        span: Span,
    ) -> Outcome<Value> {
        let is_varying = |value: &Value| matches!(value.kind, Kind::Time(Time::Varying(_)));
        let is_clock =
            |value: &Value| matches!(value.kind, Kind::Time(Time::Running | Time::Elapsed { .. }));
        match (is_varying(&a), is_varying(&b)) {
            (false, true) if is_clock(&a) => return self.compare_clock(op, &a, &b, span),
            (true, false) if is_clock(&b) => {
                return self.compare_clock(op.mirrored(), &b, &a, span);
            }
            (false, false) => {}
            _ => return self.compare_varying(op, a, b, span),
        }
        let (a_span, b_span) = (a.expr.span, b.expr.span);
        let (op, timer, running, ns, ns_span) = match (a.kind, b.kind) {
            (Kind::Time(Time::Constant(a)), Kind::Time(Time::Constant(b))) => {
                return Ok(Value::constant(op.apply(a, b), span));
            }
            (Kind::Time(running), Kind::Time(Time::Constant(ns))) => {
                (op, a.expr, running, ns, b_span)
            }
            (Kind::Time(Time::Constant(ns)), Kind::Time(running)) => {
                (op.mirrored(), b.expr, running, ns, a_span)
            }
            _ => {
                return Err(self.refused(
                    "a comparison of two running times",
                    span,
                    "compare each with a constant",
                ));
            }
        };
        // A time is never negative.
        if ns < 0 {
            let holds = matches!(op, CompareOp::Gt | CompareOp::Ge | CompareOp::Ne);
            return Ok(Value::constant(holds, span));
        }
        let with = |op, ns: i64| {
            let bound = Expr::leaf(Leaf::Duration(u64::try_from(ns).unwrap_or(0)), ns_span);
            Expr::new(ExprKind::Compare(op, Box::new(timer.clone()), Box::new(bound)), span)
        };
        let expr = match running {
            Time::Constant(_) | Time::Varying(_) | Time::Running => with(op, ns),
            Time::Elapsed { running, limit } => {
                let while_running = match op {
                    CompareOp::Ge if ns > limit => Expr::bool(false),
                    CompareOp::Gt if ns >= limit => Expr::bool(false),
                    CompareOp::Lt if ns > limit => Expr::bool(true),
                    CompareOp::Le if ns >= limit => Expr::bool(true),
                    CompareOp::Eq if ns > limit => Expr::bool(false),
                    CompareOp::Ne if ns > limit => Expr::bool(true),
                    CompareOp::Eq if ns == limit => with(CompareOp::Ge, ns),
                    CompareOp::Ne if ns == limit => with(CompareOp::Lt, ns),
                    CompareOp::Ge
                    | CompareOp::Gt
                    | CompareOp::Lt
                    | CompareOp::Le
                    | CompareOp::Eq
                    | CompareOp::Ne => with(op, ns),
                };
                if op.apply(0, ns) {
                    Expr::or([running.not(), while_running])
                } else {
                    Expr::and([*running, while_running])
                }
            }
        };
        Ok(Value::bool(Expr::new(expr.kind, span)))
    }

    fn arithmetic(&mut self, op: Op, a: Value, b: Value, span: Span) -> Outcome<Value> {
        let (al, ah, bl, bh) = match (&a.kind, &b.kind) {
            (Kind::Int(al, ah), Kind::Int(bl, bh)) => (*al, *ah, *bl, *bh),
            (Kind::Time(Time::Constant(x)), Kind::Time(Time::Constant(y))) => {
                return if op == Op::Add {
                    Ok(Value::time(x.saturating_add(*y), span))
                } else if op == Op::Sub {
                    Ok(Value::time(x.saturating_sub(*y), span))
                } else {
                    Err(self.type_error("times can only be added and subtracted", span))
                };
            }
            (Kind::Time(Time::Constant(x)), Kind::Int(n, m)) if n == m => {
                return if op == Op::Mul {
                    Ok(Value::time(x.saturating_mul(*n), span))
                } else if op == Op::Div && *n != 0 {
                    Ok(Value::time(x / n, span))
                } else {
                    Err(self
                        .type_error("a time can only be multiplied or divided by a number", span))
                };
            }
            (Kind::Time(_), Kind::Time(_)) => return self.add_times(op, a, b, span),
            (Kind::Time(_), Kind::Int(..)) => return self.scale_time(op, a, b, span),
            (Kind::Int(..), Kind::Time(_)) if op == Op::Mul => {
                return self.arithmetic(op, b, a, span);
            }
            (Kind::Time(_), _) | (_, Kind::Time(_)) => {
                return Err(
                    self.type_error("a time can only be added to or subtracted from a time", span)
                );
            }
            (Kind::Bool, _) | (_, Kind::Bool) => {
                return Err(self.type_error("expected a number, found a Boolean", span));
            }
        };
        let (op, ends) = match op {
            Op::Add => (
                ArithOp::Add,
                [i128::from(al) + i128::from(bl), i128::from(ah) + i128::from(bh), 0, 0],
            ),
            Op::Sub => (
                ArithOp::Sub,
                [i128::from(al) - i128::from(bh), i128::from(ah) - i128::from(bl), 0, 0],
            ),
            Op::Mul => {
                let times = |x, y| i128::from(x) * i128::from(y);
                (ArithOp::Mul, [times(al, bl), times(al, bh), times(ah, bl), times(ah, bh)])
            }
            Op::Div => (ArithOp::Div, [0; 4]),
            Op::Mod => (ArithOp::Mod, [0; 4]),
            Op::Power => {
                if al == ah
                    && bl == bh
                    && let Ok(exponent) = u32::try_from(bl)
                    && let Some(power) = al.checked_pow(exponent)
                {
                    return Ok(Value::int(power, span));
                }
                return Err(self.refused("powers of variables", span, "multiply instead"));
            }
            Op::Xor | Op::Eq | Op::Ne | Op::Lt | Op::Le | Op::Gt | Op::Ge => {
                unreachable!("comparisons are handled above")
            }
        };
        let (lo, hi) = match op {
            ArithOp::Add | ArithOp::Sub => (ends[0], ends[1]),
            ArithOp::Mul => {
                (ends.iter().copied().min().unwrap_or(0), ends.iter().copied().max().unwrap_or(0))
            }
            // The quotient is not larger than the dividend, and the remainder is smaller than the divisor.
            ArithOp::Div => {
                let most = i128::from(al).abs().max(i128::from(ah).abs());
                let negative = al < 0 || bl < 0;
                let positive = (ah >= 0 && bh >= 0) || (al <= 0 && bl <= 0);
                (if negative { -most } else { 0 }, if positive { most } else { 0 })
            }
            ArithOp::Mod => {
                let most = i128::from(bl).abs().max(i128::from(bh).abs()) - 1;
                let most = most.max(0);
                (if al < 0 { -most } else { 0 }, if ah > 0 { most.min(i128::from(ah)) } else { 0 })
            }
        };
        if al == ah
            && bl == bh
            && let Some(value) = op.apply(al, bl)
        {
            return Ok(Value::int(value, span));
        }
        let expr = Expr::new(ExprKind::Arith(op, Box::new(a.expr), Box::new(b.expr)), span);
        Ok(Value { expr, kind: Kind::Int(clamp(lo), clamp(hi)) })
    }

    // Names

    /// Resolves a name, a field or an element.
    pub(super) fn access(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Access> {
        let span = syntax.span;
        match &syntax.kind {
            ast::ExprKind::Name(name) => self.named_access(frame, name),
            ast::ExprKind::Address(address) => self.address(address, span),
            ast::ExprKind::Flag(flag) => {
                let binding = self.frames[frame].flags.get(flag).cloned();
                binding.map_or(Err(ErrorReported), |binding| accessed(binding, span))
            }
            ast::ExprKind::Field(inner, field) => {
                // `color.red` and `globals.x`: the name of a list before a name.
                if let ast::ExprKind::Name(list) = &inner.kind
                    && self.lookup(frame, &list.text).is_none()
                    && let Some(found) = self.qualified(frame, list, field)
                {
                    return found;
                }
                match self.access(frame, inner)? {
                    Access::Object(object) => self.field(object, field),
                    Access::Step(step) => self.step_field(&step, field),
                    Access::Place(_) | Access::Value(_) => Err(self.unknown(
                        "field",
                        &field.text,
                        field.span,
                        &[],
                        "not a structure, block or step",
                    )),
                }
            }
            ast::ExprKind::Index(inner, indices) => self.indexed(frame, inner, indices, span),
            ast::ExprKind::Refused(_) => Err(ErrorReported),
            ast::ExprKind::Bool(_)
            | ast::ExprKind::Int(_)
            | ast::ExprKind::Time(_)
            | ast::ExprKind::Bit(..)
            | ast::ExprKind::Not(_)
            | ast::ExprKind::Neg(_)
            | ast::ExprKind::Binary(..)
            | ast::ExprKind::And(_)
            | ast::ExprKind::Or(_)
            | ast::ExprKind::Call(..) => Err(self.type_error("expected a variable", span)),
        }
    }

    fn indexed(
        &mut self,
        frame: FrameId,
        inner: &ast::Expr,
        indices: &[ast::Expr],
        span: Span,
    ) -> Outcome<Access> {
        let values = self.values(frame, indices.iter())?;
        match self.access(frame, inner)? {
            Access::Place(place) => self.element(place, values, span),
            Access::Value(_) | Access::Object(_) | Access::Step(_) => {
                Err(self.type_error("not an array", inner.span))
            }
        }
    }

    fn named_access(&mut self, frame: FrameId, name: &Name) -> Outcome<Access> {
        let span = name.span;
        if let Some(binding) = self.lookup(frame, &name.text) {
            return accessed(binding, span);
        }
        if let Some(value) = self.enumerated.get(&upper(&name.text)) {
            return Ok(Access::Value(Value::int(*value, span)));
        }
        let candidates = self.candidates(frame);
        Err(self.unknown("variable", &name.text, span, &candidates, "declare it in a VAR block"))
    }

    /// Resolves `list.name`, if `list` is an enumeration or the name of a list of globals.
    fn qualified(&mut self, frame: FrameId, list: &Name, name: &Name) -> Option<Outcome<Access>> {
        let is_enum = self
            .types
            .get(&upper(&list.text))
            .is_some_and(|def| matches!(def.ty.kind, ast::TypeKind::Enum(_)));
        if is_enum {
            return Some(self.named_access(frame, name));
        }
        let globals = self.globals;
        if self.lookup(globals, &name.text).is_some() {
            return Some(self.named_access(globals, name));
        }
        None
    }

    fn field(&mut self, object: usize, field: &Name) -> Outcome<Access> {
        let frame = self.objects[object].frame;
        if let Some(value) = self.block_field(object, &upper(&field.text), field.span) {
            return value.map(Access::Value);
        }
        match self.frames[frame].names.get(&upper(&field.text)).cloned() {
            Some(Binding::Place(place)) => Ok(Access::Place(place)),
            Some(Binding::Value(value)) => Ok(Access::Value(value)),
            Some(Binding::Object(inner)) => Ok(Access::Object(inner)),
            Some(Binding::Broken) => Err(ErrorReported),
            // A step of a chart that was called earlier.
            Some(Binding::Step(step)) => Ok(Access::Step(step)),
            None => {
                let known: Vec<String> = self.frames[frame].names.keys().cloned().collect();
                let what = match self.objects[object].kind {
                    ObjectKind::Struct => "field",
                    ObjectKind::Standard(_) | ObjectKind::User(_) => "variable of the block",
                };
                Err(self.unknown(
                    what,
                    &field.text,
                    field.span,
                    &known,
                    "use one of the names that it declares",
                ))
            }
        }
    }

    fn step_field(&mut self, step: &Name, field: &Name) -> Outcome<Access> {
        let span = step.span.to(field.span);
        let part = |text: &str| Path { names: vec![step.clone(), Name::new(text, field.span)] };
        match upper(&field.text).as_str() {
            "X" => Ok(Access::Value(Value::bool(leaf(part("active"), span)))),
            "T" => {
                let is_left = self.leaving.contains(&upper(&step.text));
                // The time of a step that is certainly active needs no memory.
                let path = part(if is_left { "t" } else { "T" });
                Ok(Access::Value(Value { expr: leaf(path, span), kind: Kind::Time(Time::Running) }))
            }
            other => {
                let candidates = ["X".to_owned(), "T".to_owned()];
                Err(self.unknown(
                    "part of a step",
                    other,
                    field.span,
                    &candidates,
                    "a step has X (active) and T (time)",
                ))
            }
        }
    }

    fn element(&mut self, place: Place, indices: Vec<Value>, span: Span) -> Outcome<Access> {
        let Ty::Array(bounds, element) = place.ty.clone() else {
            return Err(self.type_error("not an array", span));
        };
        if place.index.is_some() || indices.len() > bounds.len() {
            return Err(self.type_error("this array has fewer dimensions", span));
        }
        if indices.len() < bounds.len() {
            // Only `a[1, 2]` is supported, not the equivalent `a[1][2]`.
            return Err(self.refused(
                "a part of an array of several dimensions",
                span,
                "write all indices in one pair of brackets: `a[1, 2]`",
            ));
        }
        let mut index: Option<Value> = None;
        for (value, (lo, hi)) in indices.into_iter().zip(&bounds) {
            let at = value.expr.span;
            if !matches!(value.kind, Kind::Int(..)) {
                return Err(self.type_error("an index must be a number", at));
            }
            let own = if *lo == 0 {
                value
            } else {
                self.binary(Op::Sub, value, Value::int(*lo, at), at)?
            };
            index = Some(match index {
                None => own,
                Some(outer) => {
                    let size = Value::int(hi - lo + 1, at);
                    let scaled = self.binary(Op::Mul, outer, size, at)?;
                    self.binary(Op::Add, scaled, own, at)?
                }
            });
        }
        let index = index.map(|index| index.expr);
        Ok(Access::Place(Place { index, ty: *element, ..place }))
    }

    /// The value of a resolved object.
    pub(super) fn read(&mut self, access: Access, span: Span) -> Outcome<Value> {
        match access {
            Access::Value(value) => Ok(value),
            Access::Place(place) => {
                let path = self.path(&place, span);
                let values = if place.ty == Ty::Time { self.values_of(&place) } else { None };
                let name = Leaf::Name(path);
                let expr = match place.index {
                    Some(index) => Expr::new(ExprKind::Element(name, Box::new(index)), span),
                    None => Expr::leaf(name, span),
                };
                match place.ty {
                    Ty::Bool => Ok(Value { expr, kind: Kind::Bool }),
                    Ty::Int { lo, hi, .. } => Ok(Value { expr, kind: Kind::Int(lo, hi) }),
                    Ty::Broken => Err(ErrorReported),
                    Ty::Time => Ok(Value { expr, kind: Kind::Time(Time::Varying(values)) }),
                    Ty::Array(..) | Ty::Block(_) | Ty::User(_) | Ty::Struct(_) => Err(self
                        .type_error(
                            "expected a simple value, found a whole array, block or structure",
                            span,
                        )),
                }
            }
            Access::Object(_) => {
                Err(self.type_error("expected a value, found a block or a structure", span))
            }
            Access::Step(step) => Err(self.report(
                Diagnostic::error(
                    codes::ST_TYPE,
                    format!("step `{step}` cannot be used as a value"),
                )
                .at(span, "")
                .help(format!("write `{step}.X` to test whether it is active"))
                .fix(span, format!("{step}.X")),
            )),
        }
    }
}
