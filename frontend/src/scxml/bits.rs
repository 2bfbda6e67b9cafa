//! Bit operators of ECMAScript and C, on two's complement of 32 bits (ECMA-262, ToInt32 and ToUint32). A number that has more bits loses the high ones.

use super::expr::BitOp;
use super::values::{Data, Kind};
use crate::number::Num;
use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr, Leaf};
use grafsynth_ir::expr::{ArithOp, Type};
use grafsynth_ir::interval::{self, Leaves, TypeError, TypeErrorKind};

/// The types of data as far as they are known before ranges are inferred.
struct Widest<'d>(&'d Data);

impl Leaves<Leaf> for Widest<'_> {
    fn leaf(&mut self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        let unknown = TypeError { span, kind: TypeErrorKind::Dangling };
        let Leaf::Name(path) = leaf else { return Err(unknown) };
        // Other paths are the activities of states.
        let [name] = path.names.as_slice() else { return Ok(Type::Bool) };
        let var = self.0.vars.iter().find(|var| var.name == name.text).ok_or(unknown)?;
        Ok(match var.kind() {
            Kind::Bool => Type::Bool,
            Kind::Int => {
                let (lo, hi) = var.range.unwrap_or((i32::MIN.into(), i32::MAX.into()));
                let values = var.init.iter().map(|value| value.number());
                let least = values.clone().min().unwrap_or(lo);
                Type::Int { lo: lo.min(least), hi: hi.max(values.max().unwrap_or(hi)) }
            }
        })
    }

    fn array(&mut self, leaf: &Leaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        self.leaf(leaf, span).map(|ty| (ty, None))
    }
}

impl Data {
    fn num(&self, expr: Expr) -> Num {
        let ty = interval::check(&expr, &mut Widest(self));
        let (lo, hi) = ty.map_or((i64::MIN, i64::MAX), Type::bounds);
        let folded = grafsynth_ir::simplify::simplify(&expr);
        Num { expr: if lo == hi { folded } else { expr }, lo, hi }
    }

    /// The result of a bit operator on two numbers.
    pub(super) fn bitwise(&self, op: BitOp, a: Expr, b: Expr, span: Span) -> Expr {
        let is_signed = op != BitOp::UnsignedShr;
        let (mut a, mut b) = (self.num(a), self.num(b));
        let op = match op {
            BitOp::And => ArithOp::BitAnd,
            BitOp::Or => ArithOp::BitOr,
            BitOp::Xor => ArithOp::BitXor,
            BitOp::Shl => ArithOp::Shl,
            BitOp::Shr | BitOp::UnsignedShr => ArithOp::Shr,
        };
        if op.is_shift() {
            (a, b) = (a.wrapped(32, is_signed), b.low_bits(5));
        }
        let result = a.op(op, &b).unwrap_or_else(|| a.exact(op, &b));
        Expr::new(result.wrapped(32, is_signed).expr.kind, span)
    }
}
