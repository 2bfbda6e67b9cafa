//! Numbers of the net for front ends with their own arithmetic: an expression with the interval that the net infers for it.
//!
//! The front ends keep their own scopes and types. This module only knows the width and the sign of a type: a mask keeps the low bits, and a signed type
//! interprets them as two's complement.
//!
//! ```text
//! low_bits(8)          x band 255                            unchanged if x is in 0..255
//! wrapped(8, true)     ((x band 255) bxor 128) - 128         unchanged if x is in -128..127
//! ```

use grafsynth_ir::Span;
use grafsynth_ir::chart::Expr;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use grafsynth_ir::interval;

/// A number of the net with the interval that the net infers for it.
#[derive(Debug, Clone)]
pub(crate) struct Num {
    pub(crate) expr: Expr,
    pub(crate) lo: i64,
    pub(crate) hi: i64,
}

/// The range of `n_bits` bits (at most 62), in two's complement or unsigned.
pub(crate) fn range(n_bits: u32, is_signed: bool) -> (i64, i64) {
    let n = 1_i64 << n_bits;
    if is_signed { (-n / 2, n / 2 - 1) } else { (0, n - 1) }
}

impl Num {
    pub(crate) fn constant(value: i64, span: Span) -> Num {
        Num { expr: Expr::new(ExprKind::Int(value), span), lo: value, hi: value }
    }

    pub(crate) fn is_constant(&self) -> bool {
        matches!(self.expr.kind, ExprKind::Int(_))
    }

    /// Whether the expression is small enough to be written twice.
    pub(crate) fn is_small(&self) -> bool {
        matches!(self.expr.kind, ExprKind::Int(_) | ExprKind::Leaf(_))
    }

    pub(crate) fn within(&self, (lo, hi): (i64, i64)) -> bool {
        self.lo >= lo && self.hi <= hi
    }

    /// The result of the operation; `None` if its interval exceeds 64 bits, the divisor's interval contains 0, or the amount of a shift is out of range.
    pub(crate) fn op(&self, op: ArithOp, other: &Num) -> Option<Num> {
        let span = self.expr.span.to(other.expr.span);
        if self.is_constant() && other.is_constant() {
            return op.apply(self.lo, other.lo).map(|value| Num::constant(value, span));
        }
        if other.is_constant() && self.keeps(op, other.lo) {
            return Some(self.clone());
        }
        let is_symmetric = matches!(
            op,
            ArithOp::Add | ArithOp::Mul | ArithOp::BitAnd | ArithOp::BitOr | ArithOp::BitXor
        );
        if is_symmetric && self.is_constant() && other.keeps(op, self.lo) {
            return Some(other.clone());
        }
        interval::arith(op, (self.lo, self.hi), (other.lo, other.hi))?;
        Some(self.exact(op, other))
    }

    /// The result of the operation, without a check. If the result has no interval, lowering rejects it, and the interval here is that of all numbers.
    pub(crate) fn exact(&self, op: ArithOp, other: &Num) -> Num {
        let span = self.expr.span.to(other.expr.span);
        if self.lo == self.hi
            && other.lo == other.hi
            && let Some(value) = op.apply(self.lo, other.lo)
        {
            return Num::constant(value, span);
        }
        let found = interval::arith(op, (self.lo, self.hi), (other.lo, other.hi));
        let (lo, hi) = found.unwrap_or((i64::MIN, i64::MAX));
        let expr = ExprKind::Arith(op, Box::new(self.expr.clone()), Box::new(other.expr.clone()));
        Num { expr: Expr::new(expr, span), lo, hi }
    }

    /// Whether the operation with this right operand leaves every value of the number unchanged.
    fn keeps(&self, op: ArithOp, right: i64) -> bool {
        match op {
            ArithOp::Add
            | ArithOp::Sub
            | ArithOp::BitOr
            | ArithOp::BitXor
            | ArithOp::Shl
            | ArithOp::Shr => right == 0,
            ArithOp::Mul | ArithOp::Div => right == 1,
            ArithOp::Mod => self.lo >= 0 && self.hi < right,
            ArithOp::BitAnd => {
                let is_mask = right >= self.hi && right & right.wrapping_add(1) == 0;
                right == -1 || self.lo >= 0 && is_mask
            }
        }
    }

    /// [`Num::op`] with a constant.
    pub(crate) fn by(&self, op: ArithOp, constant: i64) -> Option<Num> {
        self.op(op, &Num::constant(constant, self.expr.span))
    }

    /// The `n_bits` low bits, at most 62, as an unsigned number.
    pub(crate) fn low_bits(&self, n_bits: u32) -> Num {
        let masked = self.by(ArithOp::BitAnd, range(n_bits, false).1);
        masked.unwrap_or_else(|| self.clone())
    }

    /// The `n_bits` low bits, as an unsigned number or in two's complement; unchanged if the number is in that range.
    pub(crate) fn wrapped(&self, n_bits: u32, is_signed: bool) -> Num {
        if self.within(range(n_bits, is_signed)) {
            return self.clone();
        }
        let low = self.low_bits(n_bits);
        if !is_signed {
            return low;
        }
        let sign = 1_i64 << (n_bits - 1);
        let signed = low.by(ArithOp::BitXor, sign).and_then(|num| num.by(ArithOp::Sub, sign));
        signed.unwrap_or(low)
    }

    pub(crate) fn select(condition: Expr, a: &Num, b: &Num) -> Num {
        let span = a.expr.span.to(b.expr.span);
        let (lo, hi) = (a.lo.min(b.lo), a.hi.max(b.hi));
        let (a, b) = (Box::new(a.expr.clone()), Box::new(b.expr.clone()));
        let kind = ExprKind::Select(Box::new(condition), a, b);
        Num { expr: Expr::new(kind, span), lo, hi }
    }

    pub(crate) fn compare(&self, op: CompareOp, other: &Num) -> Expr {
        if self.is_constant() && other.is_constant() {
            return Expr::new(ExprKind::Bool(op.apply(self.lo, other.lo)), self.expr.span);
        }
        Expr::compare(op, self.expr.clone(), other.expr.clone())
    }

    pub(crate) fn compare_with(&self, op: CompareOp, constant: i64) -> Expr {
        self.compare(op, &Num::constant(constant, self.expr.span))
    }
}
