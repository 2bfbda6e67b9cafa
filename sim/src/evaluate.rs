//! The value of an expression, over any leaves.

use grafsynth_ir::expr::{ArithOp, CompareOp, Expr, ExprKind};

/// The value of an expression over any leaves; for an element of an array, `value` gets the index. Operands that `and` and `or` skip have no effects.
pub(crate) fn eval_by<L>(expr: &Expr<L>, value: &impl Fn(&L, Option<i64>) -> i64) -> i64 {
    let eval = |expr: &Expr<L>| eval_by(expr, value);
    match &expr.kind {
        ExprKind::Bool(value) => i64::from(*value),
        ExprKind::Int(value) => *value,
        ExprKind::Leaf(leaf) => value(leaf, None),
        ExprKind::Element(leaf, index) => value(leaf, Some(eval(index))),
        ExprKind::Not(a) => i64::from(eval(a) == 0),
        ExprKind::And(all) => i64::from(all.iter().all(|a| eval(a) != 0)),
        ExprKind::Or(all) => i64::from(all.iter().any(|a| eval(a) != 0)),
        ExprKind::Compare(op, a, b) => i64::from(compares(*op, eval(a), eval(b))),
        // Validation excludes a divisor of 0 and results beyond 64 bits.
        ExprKind::Neg(a) => arithmetic(ArithOp::Sub, 0, eval(a)).unwrap_or(0),
        ExprKind::Arith(op, a, b) => arithmetic(*op, eval(a), eval(b)).unwrap_or(0),
        ExprKind::Select(a, b, c) => {
            if eval(a) != 0 {
                eval(b)
            } else {
                eval(c)
            }
        }
    }
}

pub(crate) fn compares(op: CompareOp, a: i64, b: i64) -> bool {
    match op {
        CompareOp::Eq => a == b,
        CompareOp::Ne => a != b,
        CompareOp::Lt => a < b,
        CompareOp::Le => a <= b,
        CompareOp::Gt => a > b,
        CompareOp::Ge => a >= b,
    }
}

/// The exact result, without the arithmetic of `ir` (semantics §6); `None` if the result does not exist or exceeds 64 bits.
fn arithmetic(op: ArithOp, a: i64, b: i64) -> Option<i64> {
    let (a, b) = (i128::from(a), i128::from(b));
    let exact = match op {
        ArithOp::Add => a + b,
        ArithOp::Sub => a - b,
        ArithOp::Mul => a * b,
        ArithOp::Div => a.checked_div(b)?,
        ArithOp::Mod => a.checked_rem(b)?,
        ArithOp::BitAnd => a & b,
        ArithOp::BitOr => a | b,
        ArithOp::BitXor => a ^ b,
        ArithOp::Shl => a * power(b)?,
        ArithOp::Shr => a.div_euclid(power(b)?),
    };
    i64::try_from(exact).ok()
}

/// 2 to the power of the amount of a shift, which is at most 63.
fn power(amount: i128) -> Option<i128> {
    (0..=63).contains(&amount).then(|| 1 << amount)
}
