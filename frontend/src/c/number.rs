//! Values of C: truth values and numbers of the net, with their types.

use super::types::Scalar;
pub(super) use crate::number::Num;
use grafsynth_ir::Span;
use grafsynth_ir::chart::Expr;
use grafsynth_ir::expr::{CompareOp, ExprKind};

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
