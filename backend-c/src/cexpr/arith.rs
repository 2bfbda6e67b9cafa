//! Arithmetic: sums, products, quotients and remainders in the smallest class that holds them, and stores that saturate.

use super::{CExpr, Class, Prec, literal};
use grafsynth_ir::expr::{ArithOp, Type};
use grafsynth_ir::interval;

impl CExpr {
    /// Arithmetic; validation has shown that the result fits in 64 bits.
    pub(crate) fn arith(op: ArithOp, a: CExpr, b: CExpr) -> Self {
        if let (Some(x), Some(y)) = (a.constant(), b.constant())
            && let Some(value) = op.apply(x, y)
        {
            return CExpr::int(value);
        }
        // Operations that change nothing are not computed.
        match (op, a.constant(), b.constant()) {
            (ArithOp::Add | ArithOp::Sub, _, Some(0))
            | (ArithOp::Mul | ArithOp::Div, _, Some(1)) => return a,
            (ArithOp::Sub, Some(0), _) => return b.neg(),
            (ArithOp::Add, Some(0), _) | (ArithOp::Mul, Some(1), _) => return b,
            _ => {}
        }
        // Operands with the same text are equal. They are folded here, because sdcc 4.2, which would fold them itself, wrongly passes a 16-bit 0 or 1 to a
        // function that expects 32 bits.
        if a.text == b.text && matches!(op, ArithOp::Sub | ArithOp::Mod) {
            return CExpr::int(0);
        }
        if a.text == b.text && op == ArithOp::Div {
            return CExpr::int(1);
        }
        // Validation rejects expressions without a result; the widest interval is only a fallback.
        let (lo, hi) =
            interval::arith(op, (a.lo, a.hi), (b.lo, b.hi)).unwrap_or((i64::MIN, i64::MAX));
        // The result is constant, for example the remainder of a division by 1; one of the compilers warns about such an expression.
        if lo == hi {
            return CExpr::int(lo);
        }
        if op == ArithOp::Sub
            && let Some(signed) = CExpr::sign_extended(&a, &b)
        {
            return signed;
        }
        if op.is_bitwise() {
            return CExpr::bitwise(op, a, b, (lo, hi));
        }
        // A remainder has the sign of the dividend, so only the magnitude of the divisor matters.
        let b = match (op, b.constant().and_then(i64::checked_abs)) {
            (ArithOp::Mod, Some(magnitude)) => CExpr::int(magnitude),
            _ => b,
        };
        // sdcc 4.2 divides a byte by a negative constant as if the constant were unsigned.
        if op == ArithOp::Div
            && let Some(magnitude) = b.constant().filter(|it| *it < 0).and_then(i64::checked_neg)
        {
            return if magnitude == 1 {
                a.neg()
            } else {
                CExpr::arith(op, a, CExpr::int(magnitude)).neg()
            };
        }
        let (op, a, b) = with_safe_constant(op, a, b);
        let class = Class::of(lo, hi).max(a.class).max(b.class);
        let prec = if op.is_sum() { Prec::Sum } else { Prec::Product };
        let sign = sign(op);
        let unsigned = match (a.as_unsigned(), b.as_unsigned()) {
            (Some(a), Some(b)) if class == Class::Int && lo >= 0 => {
                let text = format!("{} {sign} {}", a.operand(prec), b.within(Prec::Unary));
                Some((text, prec))
            }
            (Some(_) | None, Some(_) | None) => None,
        };
        let left = if a.class < class && b.class < class { a.cast(class) } else { a.as_signed() };
        let text = format!("{} {sign} {}", left.operand(prec), b.as_signed().within(Prec::Unary));
        CExpr { unsigned, ..CExpr::exact(text, prec, class, (lo, hi)) }
    }

    /// [`CExpr::arith`], with our own functions for the operators that some compilers lack: products and quotients of 64 bits.
    pub(super) fn arith_by(op: ArithOp, a: CExpr, b: CExpr, prefix: &str) -> Self {
        // A negative divisor is made positive, as in `arith`; done here, so that this quotient also uses the function.
        if let (ArithOp::Div, Some(magnitude @ 2..)) = (op, b.constant().and_then(i64::checked_neg))
        {
            return CExpr::arith_by(op, a, CExpr::int(magnitude), prefix).neg();
        }
        let word = match op {
            ArithOp::Add
            | ArithOp::Sub
            | ArithOp::BitAnd
            | ArithOp::BitOr
            | ArithOp::BitXor
            | ArithOp::Shl
            | ArithOp::Shr => None,
            ArithOp::Mul => Some(WIDE_FUNCTIONS[0]),
            ArithOp::Div => Some(WIDE_FUNCTIONS[1]),
            ArithOp::Mod => Some(WIDE_FUNCTIONS[2]),
        };
        let [first, second] = [&a, &b].map(|it| match it.class {
            Class::Huge => it.text.clone(),
            Class::Bool | Class::Int | Class::Wide => it.clone().cast(Class::Huge).text,
        });
        let plain = CExpr::arith(op, a, b);
        match word {
            // A quotient that became a negation is no longer a quotient.
            Some(word) if plain.class == Class::Huge && plain.prec == Prec::Product => CExpr {
                text: format!("{prefix}_{word}({first}, {second})"),
                prec: Prec::Atom,
                ..plain
            },
            Some(_) | None => plain,
        }
    }

    /// Arithmetic negation.
    pub(crate) fn neg(self) -> Self {
        if let Some(value) = self.constant().and_then(i64::checked_neg) {
            return CExpr::int(value);
        }
        let (lo, hi) = (self.hi.saturating_neg(), self.lo.saturating_neg());
        let class = Class::of(lo, hi).max(self.class);
        let inner = if self.class < class { self.cast(class) } else { self.as_signed() };
        // Two signs in a row would read as a decrement.
        let inner = if inner.text.starts_with('-') {
            format!("({})", inner.text)
        } else {
            inner.within(Prec::Unary)
        };
        CExpr::exact(format!("-{inner}"), Prec::Unary, class, (lo, hi))
    }
}

/// A sum or difference without the constants for which sdcc 4.2 generates wrong code on an 8051: if the low 32 bits of a 64-bit constant equal 0, it adds only
/// the highest byte; if they equal 1, it subtracts only these bits. The other operator with the negated constant is correct.
fn with_safe_constant(op: ArithOp, a: CExpr, b: CExpr) -> (ArithOp, CExpr, CExpr) {
    let negated = |it: &CExpr, low: i64| {
        let is_wrong =
            |value: &i64| Class::of(*value, *value) == Class::Huge && value & 0xffff_ffff == low;
        it.constant().filter(is_wrong).and_then(i64::checked_neg).map(CExpr::int)
    };
    match op {
        ArithOp::Add => match (negated(&a, 0), negated(&b, 0)) {
            (_, Some(b)) => (ArithOp::Sub, a, b),
            (Some(a), None) => (ArithOp::Sub, b, a),
            (None, None) => (op, a, b),
        },
        ArithOp::Sub => match negated(&b, 1) {
            Some(b) => (ArithOp::Add, a, b),
            None => (op, a, b),
        },
        ArithOp::Mul
        | ArithOp::Div
        | ArithOp::Mod
        | ArithOp::BitAnd
        | ArithOp::BitOr
        | ArithOp::BitXor
        | ArithOp::Shl
        | ArithOp::Shr => (op, a, b),
    }
}

/// The operator in C.
pub(super) fn sign(op: ArithOp) -> &'static str {
    match op {
        ArithOp::Add => "+",
        ArithOp::Sub => "-",
        ArithOp::Mul => "*",
        ArithOp::Div => "/",
        ArithOp::Mod => "%",
        ArithOp::BitAnd => "&",
        ArithOp::BitOr => "|",
        ArithOp::BitXor => "^",
        ArithOp::Shl => "<<",
        ArithOp::Shr => ">>",
    }
}

/// The functions that [`crate::source`] defines if they are called; their names follow the prefix.
pub(crate) const WIDE_FUNCTIONS: [&str; 3] = ["mul64", "div64", "mod64"];

/// The helper functions that saturating stores need, one for each class in use.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Helpers {
    /// Whether `PREFIX_clamp16`, `PREFIX_clamp32` and `PREFIX_clamp64` are called.
    pub(crate) clamp: [bool; 3],
    /// `PREFIX_later`: adds ticks to a timer and saturates.
    pub(crate) later: bool,
}

impl Helpers {
    /// Adds the helpers that other code calls.
    pub(crate) fn add(&mut self, other: &Helpers) {
        for (mine, theirs) in self.clamp.iter_mut().zip(other.clamp) {
            *mine |= theirs;
        }
        self.later |= other.later;
    }
}

/// `value` converted to `ty`: unchanged if its interval fits, otherwise clamped by a helper of the right class.
pub(crate) fn saturated(value: CExpr, ty: Type, prefix: &str, helpers: &mut Helpers) -> CExpr {
    let Type::Int { lo, hi } = ty else { return value };
    if value.lo >= lo && value.hi <= hi {
        return value;
    }
    if value.hi <= lo {
        return CExpr::int(lo);
    }
    if value.lo >= hi {
        return CExpr::int(hi);
    }
    // Both bounds are within the interval of the value, so the class of the value contains them.
    let (lo, hi) = (lo.max(value.lo), hi.min(value.hi));
    let (width, slot) = match value.class {
        Class::Bool | Class::Int => (16, 0),
        Class::Wide => (32, 1),
        Class::Huge => (64, 2),
    };
    helpers.clamp[slot] = true;
    let class = value.class;
    let bound = |value: i64| literal(value, Class::of(value, value)).0;
    let inner = value.as_signed().text;
    let text = format!("{prefix}_clamp{width}({inner}, {}, {})", bound(lo), bound(hi));
    CExpr { text, prec: Prec::Atom, class, lo, hi, asks: None, ..CExpr::plain() }
}

#[cfg(test)]
mod tests {
    use super::super::tests::var;
    use super::*;

    #[test]
    fn arithmetic_is_cast_before_it_can_overflow_16_bits() {
        let product = CExpr::arith(ArithOp::Mul, var("n", 0, 1000), CExpr::int(100));
        assert_eq!(product.text, "(int32_t)n * 100");
        let sum = CExpr::arith(ArithOp::Add, var("n", 0, 255), CExpr::int(1));
        assert_eq!((sum.text.as_str(), sum.class), ("(int)n + 1", Class::Int));
        let unsigned = CExpr::arith(ArithOp::Sub, var("n", 0, 65535), CExpr::int(1));
        assert_eq!(unsigned.text, "(int32_t)n - 1");
        let huge = CExpr::arith(ArithOp::Mul, var("n", 0, 100_000), var("m", 0, 100_000));
        assert_eq!(huge.text, "(int64_t)n * m");
    }

    #[test]
    fn products_of_64_bits_are_calls() {
        let [n, m] = ["n", "m"].map(|name| var(name, 0, 100_000));
        let huge = CExpr::arith_by(ArithOp::Mul, n.clone(), m, "x");
        assert_eq!(
            (huge.text.as_str(), huge.class),
            ("x_mul64((int64_t)n, (int64_t)m)", Class::Huge)
        );
        assert_eq!(CExpr::arith_by(ArithOp::Mul, n, CExpr::int(9), "x").text, "n * 9");
    }

    #[test]
    fn constants_that_sdcc_mistakes_are_negated() {
        let text = |op, a: CExpr, b: CExpr| CExpr::arith(op, a, b).text;
        let (n, int) = (|| var("n", 0, 9), CExpr::int);
        let bits_33 = 1 << 33;
        assert_eq!(text(ArithOp::Add, n(), int(bits_33)), "(int)n - -INT64_C(8589934592)");
        assert_eq!(text(ArithOp::Add, int(bits_33), n()), "(int)n - -INT64_C(8589934592)");
        assert_eq!(text(ArithOp::Add, n(), int(-bits_33)), "(int)n - INT64_C(8589934592)");
        assert_eq!(text(ArithOp::Sub, n(), int(bits_33 + 1)), "(int)n + -INT64_C(8589934593)");
        assert_eq!(text(ArithOp::Sub, n(), int(bits_33)), "(int)n - INT64_C(8589934592)");
        assert_eq!(text(ArithOp::Add, n(), int(bits_33 + 1)), "(int)n + INT64_C(8589934593)");
        assert_eq!(text(ArithOp::Sub, int(bits_33 + 1), n()), "INT64_C(8589934593) - (int)n");
        assert_eq!(text(ArithOp::Sub, n(), int(1)), "(int)n - 1");
    }

    #[test]
    fn divisors_are_positive() {
        let n = var("n", -128, 127);
        assert_eq!(CExpr::arith(ArithOp::Div, n.clone(), CExpr::int(-2)).text, "-((int)n / 2)");
        assert_eq!(CExpr::arith(ArithOp::Div, n, CExpr::int(-1)).text, "-(int)n");
    }

    #[test]
    fn what_is_equal_by_its_text_is_not_computed() {
        let n = || var("n", -128, 127);
        assert_eq!(CExpr::arith(ArithOp::Sub, n(), n()).constant(), Some(0));
        assert_eq!(CExpr::arith(ArithOp::Mod, n(), n()).constant(), Some(0));
        assert_eq!(CExpr::arith(ArithOp::Div, n(), n()).constant(), Some(1));
        assert_eq!(CExpr::arith(ArithOp::Add, n(), n()).text, "(int)n + (int)n");
    }

    #[test]
    fn rests_have_the_sign_of_the_dividend() {
        let n = var("n", -50, 50);
        assert_eq!(CExpr::arith(ArithOp::Mod, n.clone(), CExpr::int(-8)).text, "(int)n % 8");
        assert_eq!(CExpr::arith(ArithOp::Mod, n, CExpr::int(-1)).constant(), Some(0));
    }

    #[test]
    fn saturation_is_only_where_it_can_happen() {
        let mut helpers = Helpers::default();
        let ty = Type::Int { lo: 0, hi: 9 };
        let fits = saturated(var("n", 0, 9), ty, "p", &mut helpers);
        assert_eq!(fits.text, "n");
        let more = CExpr::arith(ArithOp::Add, var("n", 0, 9), CExpr::int(1));
        assert_eq!(saturated(more, ty, "p", &mut helpers).text, "p_clamp16((int)n + 1, 1, 9)");
        assert_eq!(helpers.clamp, [true, false, false]);
    }
}
