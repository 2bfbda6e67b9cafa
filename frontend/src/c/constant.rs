//! Constant expressions: case labels, array lengths, values of `#define` and `enum`.

use super::ast::{BinaryOp, Expr, ExprKind, UnaryOp};
use grafsynth_ir::Span;
use std::collections::BTreeMap;

/// The value of a constant expression, in exact arithmetic.
///
/// # Errors
/// Returns the span of the smallest part that is not constant or has no value (a division by 0, more than 64 bits).
pub(super) fn value(expr: &Expr, names: &BTreeMap<String, i64>) -> Result<i64, Span> {
    let span = expr.span;
    let of = |expr: &Expr| value(expr, names);
    match &expr.kind {
        ExprKind::Number { value, .. } => i64::try_from(*value).map_err(|_| span),
        ExprKind::Char(value) => Ok(*value),
        ExprKind::Name(name) => match name.as_str() {
            "true" => Ok(1),
            "false" | "NULL" => Ok(0),
            _ => names.get(name).copied().ok_or(span),
        },
        ExprKind::Unary(op, operand) => {
            let operand = of(operand)?;
            match op {
                UnaryOp::Plus => Ok(operand),
                UnaryOp::Minus => operand.checked_neg().ok_or(span),
                UnaryOp::Complement => Ok(!operand),
                UnaryOp::Not => Ok(i64::from(operand == 0)),
            }
        }
        ExprKind::Binary(op, a, b) => {
            let (a, b) = (of(a)?, of(b)?);
            let shift = u32::try_from(b).ok().filter(|by| *by < 32);
            match op {
                BinaryOp::Add => a.checked_add(b),
                BinaryOp::Sub => a.checked_sub(b),
                BinaryOp::Mul => a.checked_mul(b),
                BinaryOp::Div => a.checked_div(b),
                BinaryOp::Mod => a.checked_rem(b),
                BinaryOp::ShiftLeft => shift.and_then(|by| a.checked_mul(1 << by)),
                BinaryOp::ShiftRight => shift.map(|by| a >> by),
                BinaryOp::And => Some(a & b),
                BinaryOp::Or => Some(a | b),
                BinaryOp::Xor => Some(a ^ b),
                BinaryOp::Eq => Some(i64::from(a == b)),
                BinaryOp::Ne => Some(i64::from(a != b)),
                BinaryOp::Lt => Some(i64::from(a < b)),
                BinaryOp::Le => Some(i64::from(a <= b)),
                BinaryOp::Gt => Some(i64::from(a > b)),
                BinaryOp::Ge => Some(i64::from(a >= b)),
            }
            .ok_or(span)
        }
        ExprKind::Junction(is_and, all) => {
            for operand in all {
                if (of(operand)? != 0) != *is_and {
                    return Ok(i64::from(!is_and));
                }
            }
            Ok(i64::from(*is_and))
        }
        ExprKind::Conditional(condition, a, b) => {
            if of(condition)? != 0 {
                of(a)
            } else {
                of(b)
            }
        }
        _ => Err(span),
    }
}
