//! Constant expressions (C99 6.6): only sizes of arrays, labels, enumerators and conditions of the preprocessor are evaluated.

use super::types::{IntKind, Machine};
use super::{BinaryOp, Expr, ExprKind, LogicalOp, Place, PlaceKind, SymbolKind, UnaryOp, Unit};

impl Unit {
    /// The value of an integer constant expression; `None` if it is not one, or if its evaluation is undefined: overflow (C99 6.6p4), division by 0, or a
    /// shift by too many bits.
    #[must_use]
    pub fn constant(&self, expr: &Expr) -> Option<i128> {
        let kind = self.integer(&expr.ty)?;
        let value = match &expr.kind {
            ExprKind::Literal(value, _) => i128::from(*value),
            ExprKind::Bool(value) => i128::from(*value),
            ExprKind::Constant(id) => match self.symbols[*id].kind {
                SymbolKind::Constant(value) => value,
                _ => return None,
            },
            ExprKind::Unary(op, a) => {
                let a = self.constant(a)?;
                match op {
                    UnaryOp::Plus => a,
                    UnaryOp::Neg => -a,
                    // Wraps to the same bits.
                    UnaryOp::BitNot => return Some(self.machine.wrap(!a, kind)),
                    UnaryOp::Not => i128::from(a == 0),
                }
            }
            ExprKind::Binary(op, a, b) => {
                let operand = self.integer(&a.ty)?;
                self.integer(&b.ty)?;
                return binary(&self.machine, *op, operand, self.constant(a)?, self.constant(b)?);
            }
            ExprKind::Logical(op, all) => {
                for operand in all {
                    let value = self.constant(operand)? != 0;
                    if value == (*op == LogicalOp::Or) {
                        return Some(i128::from(value));
                    }
                }
                i128::from(*op == LogicalOp::And)
            }
            ExprKind::Choose(c, a, b) => {
                return self.constant(if self.constant(c)? != 0 { a } else { b });
            }
            ExprKind::Convert(a) | ExprKind::Cast(_, a) => {
                return Some(self.machine.wrap(self.constant(a)?, kind));
            }
            ExprKind::SizeOf(operand) => i128::from(self.size(operand)?),
            _ => return None,
        };
        settled(&self.machine, kind, value)
    }

    /// True if the value is known before the program runs: a constant expression, or the address of an object with static storage duration (C99 6.6p7..p9).
    #[must_use]
    pub fn is_static_constant(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Literal(..)
            | ExprKind::Bool(_)
            | ExprKind::Null
            | ExprKind::Constant(_)
            | ExprKind::Function(_)
            | ExprKind::SizeOf(_) => true,
            ExprKind::Address(place) | ExprKind::Decay(place) => self.is_static_place(place),
            ExprKind::Unary(_, a) | ExprKind::Convert(a) | ExprKind::Cast(_, a) => {
                self.is_static_constant(a)
            }
            ExprKind::Binary(_, a, b) => self.is_static_constant(a) && self.is_static_constant(b),
            ExprKind::Logical(_, all) => all.iter().all(|one| self.is_static_constant(one)),
            ExprKind::Choose(c, a, b) => [c, a, b].iter().all(|one| self.is_static_constant(one)),
            _ => false,
        }
    }

    fn is_static_place(&self, place: &Place) -> bool {
        match &place.kind {
            PlaceKind::Symbol(id) => matches!(
                self.symbols[*id].kind,
                SymbolKind::Object { .. } | SymbolKind::Local { is_static: true }
            ),
            PlaceKind::Member(base, _) => self.is_static_place(base),
            PlaceKind::Element(base, index) => {
                self.is_static_place(base) && self.is_static_constant(index)
            }
            PlaceKind::At(base, index) => {
                self.is_static_constant(base) && self.is_static_constant(index)
            }
            PlaceKind::Deref(base) => self.is_static_constant(base),
        }
    }
}

/// The result of an operator on two values of a type; `None` if it is undefined. For a shift, `kind` is the type of the left operand.
#[must_use]
pub fn binary(machine: &Machine, op: BinaryOp, kind: IntKind, a: i128, b: i128) -> Option<i128> {
    let truth = |it: bool| Some(i128::from(it));
    let value = match op {
        // Exact for signed types, whose values have at most 64 bits; the product of two unsigned values can exceed 127 bits, but only its low bits matter.
        BinaryOp::Mul => a.wrapping_mul(b),
        BinaryOp::Div => a.checked_div(b)?,
        BinaryOp::Rem => {
            // If the quotient is not representable, the remainder is not defined either (C99 6.5.5p6).
            settled(machine, kind, a.checked_div(b)?)?;
            a.checked_rem(b)?
        }
        BinaryOp::Add => a.checked_add(b)?,
        BinaryOp::Sub => a.checked_sub(b)?,
        BinaryOp::Shl | BinaryOp::Shr => {
            let count = u32::try_from(b).ok().filter(|count| *count < machine.bits(kind))?;
            if op == BinaryOp::Shr {
                a >> count
            } else if machine.is_signed(kind) && a < 0 {
                return None;
            } else {
                a << count
            }
        }
        BinaryOp::Lt => return truth(a < b),
        BinaryOp::Le => return truth(a <= b),
        BinaryOp::Gt => return truth(a > b),
        BinaryOp::Ge => return truth(a >= b),
        BinaryOp::Eq => return truth(a == b),
        BinaryOp::Ne => return truth(a != b),
        BinaryOp::BitAnd => a & b,
        BinaryOp::BitXor => a ^ b,
        BinaryOp::BitOr => a | b,
    };
    settled(machine, kind, value)
}

/// The value in its type: unsigned arithmetic wraps (C99 6.2.5p9), signed arithmetic must not overflow (C99 6.5p5).
fn settled(machine: &Machine, kind: IntKind, value: i128) -> Option<i128> {
    let (lo, hi) = machine.range(kind);
    if machine.is_signed(kind) {
        (lo..=hi).contains(&value).then_some(value)
    } else {
        Some(machine.wrap(value, kind))
    }
}
