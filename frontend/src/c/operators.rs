//! The arithmetic of C in expressions of the net.
//!
//! Unsigned results wrap, and conversions to narrower types keep the low bits ([`Num::wrapped`]); bit operators are those of the net, and `>>` of a negative
//! number rounds down; division truncates. Signed arithmetic is exact within 64 bits; results that are undefined in C saturate when they are stored.

use super::ast::{BinaryOp, UnaryOp};
use super::flow::Flow;
use super::number::{Num, Repr, Value};
use super::types::Scalar;
use grafsynth_ir::Name;
use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr, Leaf, Path};
use grafsynth_ir::expr::{ArithOp, CompareOp, Type as NetType};

/// The maximum depth of an expression. Deeper ones are split, and their parts are stored in variables: the chart language allows 256 levels, and lowering adds
/// more.
const DEEPEST: usize = 48;

impl Flow<'_, '_> {
    pub(super) fn int_type(&self) -> Scalar {
        Scalar::Int { bits: self.program().widths.int, is_signed: true }
    }

    pub(super) fn of_truth(&self, expr: Expr) -> Value {
        Value { repr: Repr::Bool(expr), ty: self.int_type() }
    }

    /// A temporary variable named after `what`, in use until the end of the full expression.
    pub(super) fn temp(&mut self, what: &str, ty: NetType) -> String {
        let key = (what.to_owned(), ty);
        if let Some((names, n_used)) = self.pool.get_mut(&key)
            && let Some(name) = names.get(*n_used)
        {
            *n_used += 1;
            return name.clone();
        }
        let name = self.names.fresh(what);
        self.temps.push((name.clone(), ty));
        let (names, n_used) = self.pool.entry(key).or_default();
        names.push(name.clone());
        *n_used += 1;
        name
    }

    /// Stores a number in a variable of this range, which saturates the number, and reads the variable.
    pub(super) fn through(&mut self, what: &str, num: &Num, lo: i64, hi: i64) -> Num {
        let span = num.expr.span;
        let name = self.temp(what, NetType::Int { lo, hi });
        let path = Path::from(Name::new(name, span));
        self.assign(path.clone(), None, num.expr.clone(), span);
        Num { expr: Expr::leaf(Leaf::Name(path), span), lo, hi }
    }

    /// Like [`Flow::through`], but reuses the variable for the same number until a side effect or the end of the full expression.
    pub(super) fn clamp(&mut self, what: &str, num: &Num, lo: i64, hi: i64) -> Num {
        let key = num.expr.unplaced();
        let known = self.clamped.iter().find(|(expr, range, _)| *range == (lo, hi) && *expr == key);
        if let Some((_, _, known)) = known {
            return known.clone();
        }
        let clamped = self.through(what, num, lo, hi);
        self.clamped.push((key, (lo, hi), clamped.clone()));
        clamped
    }

    /// The value, stored in a variable of its type.
    pub(super) fn held(&mut self, value: &Value, what: &str) -> Value {
        match &value.repr {
            Repr::Bool(expr) => {
                let span = expr.span;
                let name = self.temp(what, NetType::Bool);
                let path = Path::from(Name::new(name, span));
                self.assign(path.clone(), None, expr.clone(), span);
                Value { repr: Repr::Bool(Expr::leaf(Leaf::Name(path), span)), ty: value.ty }
            }
            Repr::Num(num) => {
                let raw = self.stored(&num.clone(), value.ty);
                let (lo, hi) = value.ty.stored().bounds();
                let held = self.through(what, &raw, lo, hi);
                Value { repr: Repr::Num(loaded(&held, value.ty)), ty: value.ty }
            }
        }
    }

    fn small(&mut self, num: &Num, ty: Scalar) -> Num {
        if num.is_small() {
            return num.clone();
        }
        let held = self.held(&Value { repr: Repr::Num(num.clone()), ty }, "value");
        held.num()
    }

    /// The value that a variable of this type has after this number is stored in it.
    pub(super) fn stored(&mut self, num: &Num, ty: Scalar) -> Num {
        if !ty.is_folded() || num.within((0, i64::from(i32::MAX))) {
            return num.clone();
        }
        num.wrapped(32, true)
    }

    /// The low bits of a number as a value of the type (C99 6.3.1.3; for signed types, as common compilers do it).
    fn wrap(&mut self, num: &Num, ty: Scalar) -> Num {
        let Scalar::Int { bits, is_signed } = ty else { return num.clone() };
        num.wrapped(bits, is_signed)
    }

    /// The value converted to a type.
    pub(super) fn converted(&mut self, value: &Value, ty: Scalar) -> Value {
        if ty == Scalar::Bool {
            return Value { repr: Repr::Bool(value.truth()), ty };
        }
        if matches!(value.repr, Repr::Bool(_)) {
            return Value { repr: value.repr.clone(), ty };
        }
        let num = value.num();
        // A signed value outside the range of its type is an overflow, so only the values inside that range must be correct.
        let (lo, hi) = value.ty.range();
        let (to_lo, to_hi) = ty.range();
        let is_signed = matches!(ty, Scalar::Int { is_signed: true, .. });
        let num = if is_signed && lo >= to_lo && hi <= to_hi { num } else { self.wrap(&num, ty) };
        Value { repr: Repr::Num(num), ty }
    }

    /// Stores the value in a variable if its expression is deeper than [`DEEPEST`].
    pub(super) fn shallow(&mut self, value: Value) -> Value {
        let levels = match &value.repr {
            Repr::Bool(expr) | Repr::Num(Num { expr, .. }) => expr.height(),
        };
        if levels > DEEPEST { self.held(&value, "value") } else { value }
    }

    pub(super) fn unary(&mut self, op: UnaryOp, operand: &Value, span: Span) -> Value {
        if op == UnaryOp::Not {
            return self.of_truth(Expr { span, ..operand.truth().not() });
        }
        let ty = operand.ty.promoted(self.program().widths);
        let num = self.converted(operand, ty).num();
        let zero = Num::constant(0, span);
        let result = match op {
            UnaryOp::Plus | UnaryOp::Not => num,
            UnaryOp::Minus => self.exact(ArithOp::Sub, &zero, &num, ty),
            // For an unsigned type, `~` inverts the bits of the type. For a signed type, x ^ -1 inverts every bit of the two's complement.
            UnaryOp::Complement => {
                let is_unsigned = matches!(ty, Scalar::Int { is_signed: false, .. });
                let ones = Num::constant(if is_unsigned { ty.range().1 } else { -1 }, span);
                self.exact(ArithOp::BitXor, &num, &ones, ty)
            }
        };
        let num = self.result(&result, ty);
        self.shallow(Value { repr: Repr::Num(num), ty })
    }

    /// Performs an operation. Stores the operands in variables if the result would exceed 64 bits.
    fn exact(&mut self, op: ArithOp, a: &Num, b: &Num, ty: Scalar) -> Num {
        if let Some(result) = a.op(op, b) {
            return result;
        }
        let (lo, hi) = ty.range();
        // Only signed operands can exceed their range. After they are stored in variables of 32 bits, the result fits.
        let (a, b) = if ty.is_folded() {
            (a.clone(), b.clone())
        } else {
            (self.through("value", a, lo, hi), self.through("value", b, lo, hi))
        };
        a.op(op, &b).unwrap_or(a)
    }

    fn result(&mut self, num: &Num, ty: Scalar) -> Num {
        if matches!(ty, Scalar::Int { is_signed: false, .. }) {
            self.wrap(num, ty)
        } else {
            num.clone()
        }
    }

    /// A binary operator with evaluated operands.
    pub(super) fn binary(&mut self, op: BinaryOp, a: &Value, b: &Value, span: Span) -> Value {
        let widths = self.program().widths;
        let compare = match op {
            BinaryOp::Eq => Some(CompareOp::Eq),
            BinaryOp::Ne => Some(CompareOp::Ne),
            BinaryOp::Lt => Some(CompareOp::Lt),
            BinaryOp::Le => Some(CompareOp::Le),
            BinaryOp::Gt => Some(CompareOp::Gt),
            BinaryOp::Ge => Some(CompareOp::Ge),
            _ => None,
        };
        if let (Repr::Bool(x), Repr::Bool(y)) = (&a.repr, &b.repr) {
            let both = || (x.clone(), y.clone());
            let truth = match op {
                BinaryOp::And => Some(Expr::and(<[Expr; 2]>::from(both()))),
                BinaryOp::Or => Some(Expr::or(<[Expr; 2]>::from(both()))),
                BinaryOp::Eq => Some(Expr::compare(CompareOp::Eq, x.clone(), y.clone())),
                BinaryOp::Xor | BinaryOp::Ne => {
                    Some(Expr::compare(CompareOp::Ne, x.clone(), y.clone()))
                }
                _ => None,
            };
            if let Some(truth) = truth {
                let value = self.of_truth(truth);
                return self.shallow(value);
            }
        }
        if matches!(op, BinaryOp::ShiftLeft | BinaryOp::ShiftRight) {
            let ty = a.ty.promoted(widths);
            let num = self.converted(a, ty).num();
            let amount = b.num();
            let num = self.shift(op == BinaryOp::ShiftLeft, &num, &amount, ty);
            return self.shallow(Value { repr: Repr::Num(num), ty });
        }
        let ty = a.ty.common(b.ty, widths);
        let (x, y) = (self.converted(a, ty).num(), self.converted(b, ty).num());
        if let Some(op) = compare {
            let value = self.of_truth(Expr { span, ..x.compare(op, &y) });
            return self.shallow(value);
        }
        let num = match op {
            BinaryOp::Add => self.exact(ArithOp::Add, &x, &y, ty),
            BinaryOp::Sub => self.exact(ArithOp::Sub, &x, &y, ty),
            BinaryOp::Mul => self.product(&x, &y, ty),
            BinaryOp::Div | BinaryOp::Mod => self.quotient(op == BinaryOp::Div, &x, &y, ty),
            BinaryOp::And => self.exact(ArithOp::BitAnd, &x, &y, ty),
            BinaryOp::Or => self.exact(ArithOp::BitOr, &x, &y, ty),
            BinaryOp::Xor => self.exact(ArithOp::BitXor, &x, &y, ty),
            _ => x,
        };
        let num = self.result(&num, ty);
        self.shallow(Value { repr: Repr::Num(num), ty })
    }

    fn product(&mut self, x: &Num, y: &Num, ty: Scalar) -> Num {
        if let Some(product) = x.op(ArithOp::Mul, y) {
            return product;
        }
        if !ty.is_folded() {
            return self.exact(ArithOp::Mul, x, y, ty);
        }
        // Unsigned 32 × 32 bits, modulo 2^32: x · y = x · low(y) + (x · high(y) mod 2^16) · 2^16
        let (x, y) = (self.small(x, ty), self.small(y, ty));
        let whole = || {
            let low = x.op(ArithOp::Mul, &y.low_bits(16))?;
            let high = x.op(ArithOp::Mul, &y.by(ArithOp::Shr, 16)?)?;
            low.op(ArithOp::Add, &high.low_bits(16).by(ArithOp::Shl, 16)?)
        };
        whole().unwrap_or_else(|| x.clone())
    }

    /// Quotient or remainder. A divisor that may be 0 is stored in variables that exclude 0: division by 0 is undefined in C.
    fn quotient(&mut self, is_quotient: bool, x: &Num, y: &Num, ty: Scalar) -> Num {
        let op = if is_quotient { ArithOp::Div } else { ArithOp::Mod };
        if let Some(result) = x.op(op, y) {
            return result;
        }
        let most = i64::from(i32::MAX);
        let y = self.small(y, ty);
        let x = if y.hi > most || y.lo < 0 || x.by(op, 3).is_none() {
            self.small(x, ty)
        } else {
            x.clone()
        };
        let positive = self.through("divisor", &y, 1, y.hi.clamp(1, most));
        let by_positive = x.op(op, &positive).unwrap_or_else(|| x.clone());
        if y.lo < 0 {
            let negative = self.through("divisor", &y, y.lo.max(i64::from(i32::MIN)), -1);
            let by_negative = x.op(op, &negative).unwrap_or_else(|| x.clone());
            return Num::select(y.compare_with(CompareOp::Gt, 0), &by_positive, &by_negative);
        }
        if y.hi > most {
            // A 32-bit number is less than twice a divisor of 2^31 or more, so the quotient is 0 or 1.
            let zero = Num::constant(0, x.expr.span);
            let one = Num::constant(1, x.expr.span);
            let is_larger = x.compare(CompareOp::Ge, &y);
            let large = if is_quotient {
                Num::select(is_larger, &one, &zero)
            } else {
                let rest = x.op(ArithOp::Sub, &y).unwrap_or_else(|| x.clone());
                Num::select(is_larger, &rest, &x)
            };
            return Num::select(y.compare_with(CompareOp::Gt, most), &large, &by_positive);
        }
        by_positive
    }

    fn shift(&mut self, is_left: bool, x: &Num, amount: &Num, ty: Scalar) -> Num {
        let Scalar::Int { bits, .. } = ty else { return x.clone() };
        // Any other shift amount is undefined in C.
        let most = i64::from(bits) - 1;
        let amount = if amount.is_constant() {
            Num::constant(amount.lo.clamp(0, most), amount.expr.span)
        } else if amount.within((0, most)) {
            amount.clone()
        } else {
            self.through("shift", amount, 0, most)
        };
        if is_left {
            let shifted = self.exact(ArithOp::Shl, x, &amount, ty);
            return self.result(&shifted, ty);
        }
        self.exact(ArithOp::Shr, x, &amount, ty)
    }
}

/// The value of a variable of this type that contains the number `raw`: the inverse of [`Flow::stored`].
pub(super) fn loaded(raw: &Num, ty: Scalar) -> Num {
    if ty.is_folded() { raw.low_bits(32) } else { raw.clone() }
}
