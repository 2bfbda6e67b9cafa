//! Turns expressions of structured text into expressions of the chart.

use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr, Leaf};
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};

use super::context::{Elaborator, FrameId, Outcome};
use super::types::Ty;
use super::value::{Kind, Time, Value};
use crate::codes;
use crate::number::Num;
use crate::st::ast::{self, Op};

impl Elaborator<'_> {
    /// Elaborates a Boolean expression.
    pub(super) fn condition(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Expr> {
        let value = self.value(frame, syntax)?;
        self.fit(value, &Ty::Bool, "a condition").map(|value| value.expr)
    }

    /// Elaborates any simple value.
    pub(super) fn value(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Value> {
        let span = self.at(syntax.span);
        self.spend(span, 1)?;
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
        self.access(frame, syntax).and_then(|access| self.read(access, self.at(syntax.span)))
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
            Kind::Int(lo, hi) if lo >= 0 && bit < 31 => {
                let num = Num { expr: value.expr, lo, hi };
                let bit = num.exact(ArithOp::BitAnd, &Num::constant(1 << bit, span));
                Ok(Value::bool(Expr::new(bit.compare_with(CompareOp::Ne, 0).kind, span)))
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
            Kind::Int(..) => self.complement(&value, span),
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

    /// AND or OR of Booleans, or of numbers bit by bit.
    pub(super) fn join(&mut self, values: Vec<Value>, is_and: bool, span: Span) -> Outcome<Value> {
        // 0 and 1 are also literals of BOOL.
        let is_number = |value: &Value| match value.kind {
            Kind::Int(lo, hi) => lo != hi || !(0..=1).contains(&lo),
            Kind::Bool | Kind::Time(_) => false,
        };
        if values.iter().any(is_number) {
            let op = if is_and { ArithOp::BitAnd } else { ArithOp::BitOr };
            return self.bitwise(op, values, span);
        }
        let mut operands = Vec::with_capacity(values.len());
        for value in values {
            operands.push(self.fit(value, &Ty::Bool, "a condition")?.expr);
        }
        // Parentheses of the text stay, so that written text reads back as the same expression; constants are folded.
        let is_plain = self.call_site.is_none()
            && operands.len() > 1
            && operands.iter().all(|one| !matches!(one.kind, ExprKind::Bool(_)));
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
                return self.bitwise(ArithOp::BitXor, vec![a, b], span);
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
            (Kind::Time(_), _) | (_, Kind::Time(_)) => {
                return self.arithmetic_of_times(op, a, b, span);
            }
            (Kind::Bool, _) | (_, Kind::Bool) => {
                return Err(self.type_error("expected a number, found a Boolean", span));
            }
        };
        let op = match op {
            Op::Add => ArithOp::Add,
            Op::Sub => ArithOp::Sub,
            Op::Mul => ArithOp::Mul,
            Op::Div => ArithOp::Div,
            Op::Mod => ArithOp::Mod,
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
        let (a, b) = (Num { expr: a.expr, lo: al, hi: ah }, Num { expr: b.expr, lo: bl, hi: bh });
        Ok(Value::of_num(a.exact(op, &b), span))
    }

    /// An operation in which at least one operand is a time.
    fn arithmetic_of_times(&mut self, op: Op, a: Value, b: Value, span: Span) -> Outcome<Value> {
        match (&a.kind, &b.kind) {
            (Kind::Time(Time::Constant(x)), Kind::Time(Time::Constant(y))) => {
                if op == Op::Add {
                    Ok(Value::time(x.saturating_add(*y), span))
                } else if op == Op::Sub {
                    Ok(Value::time(x.saturating_sub(*y), span))
                } else {
                    Err(self.type_error("times can only be added and subtracted", span))
                }
            }
            (Kind::Time(Time::Constant(x)), Kind::Int(n, m)) if n == m => {
                if op == Op::Mul {
                    Ok(Value::time(x.saturating_mul(*n), span))
                } else if op == Op::Div && *n != 0 {
                    Ok(Value::time(x / n, span))
                } else {
                    Err(self
                        .type_error("a time can only be multiplied or divided by a number", span))
                }
            }
            (Kind::Time(_), Kind::Time(_)) => self.add_times(op, a, b, span),
            (Kind::Time(_), Kind::Int(..)) => self.scale_time(op, a, b, span),
            (Kind::Int(..), Kind::Time(_)) if op == Op::Mul => {
                self.arithmetic_of_times(op, b, a, span)
            }
            (Kind::Time(_) | Kind::Bool | Kind::Int(..), _) => {
                Err(self.type_error("a time can only be added to or subtracted from a time", span))
            }
        }
    }
}
