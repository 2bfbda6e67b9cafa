//! Numbers of C as expressions of the net, each with the interval that the net infers for it.

use super::types::Scalar;
use grafsynth_ir::Span;
use grafsynth_ir::chart::Expr;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use grafsynth_ir::interval;

/// A number of the net with the interval that the net infers for it.
#[derive(Debug, Clone)]
pub(super) struct Num {
    pub(super) expr: Expr,
    pub(super) lo: i64,
    pub(super) hi: i64,
}

/// The representation of a value in the net.
#[derive(Debug, Clone)]
pub(super) enum Repr {
    /// 0 or 1 as a Boolean.
    Bool(Expr),
    Num(Num),
}

/// The value of a C expression.
#[derive(Debug, Clone)]
pub(super) struct Value {
    pub(super) repr: Repr,
    pub(super) ty: Scalar,
}

impl Num {
    pub(super) fn constant(value: i64, span: Span) -> Num {
        Num { expr: Expr::new(ExprKind::Int(value), span), lo: value, hi: value }
    }

    pub(super) fn is_constant(&self) -> bool {
        matches!(self.expr.kind, ExprKind::Int(_))
    }

    /// Whether the expression is small enough to be written twice.
    pub(super) fn is_small(&self) -> bool {
        matches!(self.expr.kind, ExprKind::Int(_) | ExprKind::Leaf(_))
    }

    pub(super) fn within(&self, (lo, hi): (i64, i64)) -> bool {
        self.lo >= lo && self.hi <= hi
    }

    /// The result of the operation; `None` if its interval exceeds 64 bits or the divisor's interval contains 0.
    pub(super) fn op(&self, op: ArithOp, other: &Num) -> Option<Num> {
        let span = self.expr.span.to(other.expr.span);
        if self.is_constant() && other.is_constant() {
            return op.apply(self.lo, other.lo).map(|value| Num::constant(value, span));
        }
        let neutral = match op {
            ArithOp::Add
            | ArithOp::Sub
            | ArithOp::BitOr
            | ArithOp::BitXor
            | ArithOp::Shl
            | ArithOp::Shr => 0,
            ArithOp::BitAnd => -1,
            ArithOp::Mul | ArithOp::Div => 1,
            ArithOp::Mod => i64::MIN,
        };
        if other.is_constant() && other.lo == neutral {
            return Some(self.clone());
        }
        if self.is_constant() && self.lo == neutral && matches!(op, ArithOp::Add | ArithOp::Mul) {
            return Some(other.clone());
        }
        // x mod n, if x is already in 0..n.
        if op == ArithOp::Mod && other.is_constant() && self.lo >= 0 && self.hi < other.lo {
            return Some(self.clone());
        }
        let (lo, hi) = interval::arith(op, (self.lo, self.hi), (other.lo, other.hi))?;
        let expr = Expr::new(
            ExprKind::Arith(op, Box::new(self.expr.clone()), Box::new(other.expr.clone())),
            span,
        );
        Some(Num { expr, lo, hi })
    }

    pub(super) fn by(&self, op: ArithOp, constant: i64) -> Option<Num> {
        self.op(op, &Num::constant(constant, self.expr.span))
    }

    pub(super) fn select(condition: Expr, a: &Num, b: &Num) -> Num {
        let span = a.expr.span.to(b.expr.span);
        let (lo, hi) = (a.lo.min(b.lo), a.hi.max(b.hi));
        Num {
            expr: Expr::new(
                ExprKind::Select(
                    Box::new(condition),
                    Box::new(a.expr.clone()),
                    Box::new(b.expr.clone()),
                ),
                span,
            ),
            lo,
            hi,
        }
    }

    pub(super) fn compare(&self, op: CompareOp, other: &Num) -> Expr {
        if self.is_constant() && other.is_constant() {
            return Expr::new(ExprKind::Bool(op.apply(self.lo, other.lo)), self.expr.span);
        }
        Expr::compare(op, self.expr.clone(), other.expr.clone())
    }

    pub(super) fn compare_with(&self, op: CompareOp, constant: i64) -> Expr {
        self.compare(op, &Num::constant(constant, self.expr.span))
    }
}

impl Value {
    pub(super) fn int(value: i64, ty: Scalar, span: Span) -> Value {
        Value { repr: Repr::Num(Num::constant(value, span)), ty }
    }

    /// The value as a number.
    pub(super) fn num(&self) -> Num {
        match &self.repr {
            Repr::Num(num) => num.clone(),
            Repr::Bool(Expr { kind: ExprKind::Bool(value), span }) => {
                Num::constant(i64::from(*value), *span)
            }
            Repr::Bool(expr) => Num::select(
                expr.clone(),
                &Num::constant(1, expr.span),
                &Num::constant(0, expr.span),
            ),
        }
    }

    /// The value as a Boolean: not 0.
    pub(super) fn truth(&self) -> Expr {
        match &self.repr {
            Repr::Bool(expr) => expr.clone(),
            Repr::Num(num) => num.compare_with(CompareOp::Ne, 0),
        }
    }
}
