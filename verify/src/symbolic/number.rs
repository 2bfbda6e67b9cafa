//! Exact integers as two's complement words of the necessary width. This is deliberately not the arithmetic of the encoder: one checks the other.

use grafsynth_ir::expr::{ArithOp, CompareOp};

use super::aig::{Aig, Lit};

/// The maximum number of bits of a number whose bounds are computed; wider ones are unbounded.
const MAX_BITS: usize = 126;

/// A signed number; the last bit is the sign and represents all higher bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Number {
    bits: Vec<Lit>,
}

impl Number {
    pub(crate) fn constant(value: i64) -> Number {
        let width = 65 - if value < 0 { (!value).leading_zeros() } else { value.leading_zeros() };
        Number {
            bits: (0..width)
                .map(|bit| Lit::constant((i128::from(value) >> bit) & 1 == 1))
                .collect(),
        }
    }

    /// The number whose code, counted from `lo`, these bits contain.
    pub(crate) fn from_code(aig: &mut Aig, code: &[Lit], lo: i64) -> Number {
        let mut bits = code.to_vec();
        bits.push(Lit::FALSE);
        let unsigned = Number { bits };
        if lo == 0 { unsigned } else { unsigned.add(aig, &Number::constant(lo), Lit::FALSE) }
    }

    /// The code of the number counted from `lo`; it must be within `lo ..= lo + 2^n_bits - 1`.
    pub(crate) fn code(&self, aig: &mut Aig, lo: i64, n_bits: u32) -> Vec<Lit> {
        let shifted =
            if lo == 0 { self.clone() } else { self.subtract(aig, &Number::constant(lo)) };
        (0..n_bits as usize).map(|bit| shifted.bit(bit)).collect()
    }

    /// The number with these bits; the last bit is the sign. Without bits, 0.
    pub(crate) fn of_bits(bits: Vec<Lit>) -> Number {
        if bits.is_empty() { Number::constant(0) } else { Number { bits }.trimmed() }
    }

    /// The bits; the last one is the sign.
    pub(crate) fn bits(&self) -> &[Lit] {
        &self.bits
    }

    /// The value, if it is constant.
    pub(crate) fn as_constant(&self) -> Option<i128> {
        if self.bits.len() > MAX_BITS {
            return None;
        }
        let mut value = 0;
        for (at, bit) in self.bits.iter().enumerate() {
            let weight = i128::from(bit.as_constant()?) << at;
            value += if at + 1 == self.bits.len() { -weight } else { weight };
        }
        Some(value)
    }

    /// Bounds of the value: each bit that is not constant counts as 0 and as 1.
    pub(crate) fn bounds(&self) -> (i128, i128) {
        if self.bits.len() > MAX_BITS {
            return (i128::MIN, i128::MAX);
        }
        let (mut least, mut largest) = (0, 0);
        for (at, bit) in self.bits.iter().enumerate() {
            let weight = 1_i128 << at;
            let (zero, one) = if at + 1 == self.bits.len() { (-weight, 0) } else { (0, weight) };
            match bit.as_constant() {
                Some(true) => {
                    let weight = if zero < 0 { zero } else { one };
                    least += weight;
                    largest += weight;
                }
                Some(false) => {}
                None => {
                    least += zero;
                    largest += one;
                }
            }
        }
        (least, largest)
    }

    /// A bit; bits beyond the sign are equal to it.
    pub(crate) fn bit(&self, at: usize) -> Lit {
        self.bits.get(at).or(self.bits.last()).copied().unwrap_or(Lit::FALSE)
    }

    fn width(&self) -> usize {
        self.bits.len()
    }

    fn sign(&self) -> Lit {
        self.bits.last().copied().unwrap_or(Lit::FALSE)
    }

    fn trimmed(mut self) -> Number {
        while self.bits.len() > 1
            && self.bits[self.bits.len() - 1] == self.bits[self.bits.len() - 2]
        {
            self.bits.pop();
        }
        self
    }

    fn add(&self, aig: &mut Aig, other: &Number, carry_in: Lit) -> Number {
        let width = self.width().max(other.width()) + 1;
        let mut carry = carry_in;
        let mut bits = Vec::with_capacity(width);
        for at in 0..width {
            let (a, b) = (self.bit(at), other.bit(at));
            let half = aig.xor(a, b);
            bits.push(aig.xor(half, carry));
            let both = aig.and(a, b);
            let one = aig.and(half, carry);
            carry = aig.or(both, one);
        }
        Number { bits }.trimmed()
    }

    fn inverted(&self) -> Number {
        Number { bits: self.bits.iter().map(|bit| !*bit).collect() }
    }

    fn subtract(&self, aig: &mut Aig, other: &Number) -> Number {
        self.add(aig, &other.inverted(), Lit::TRUE)
    }

    pub(crate) fn negate(&self, aig: &mut Aig) -> Number {
        Number::constant(0).subtract(aig, self)
    }

    pub(crate) fn select(
        aig: &mut Aig,
        condition: Lit,
        then: &Number,
        otherwise: &Number,
    ) -> Number {
        let width = then.width().max(otherwise.width());
        let bits =
            (0..width).map(|at| aig.ite(condition, then.bit(at), otherwise.bit(at))).collect();
        Number { bits }.trimmed()
    }

    fn less(&self, aig: &mut Aig, other: &Number) -> Lit {
        self.subtract(aig, other).sign()
    }

    fn equal(&self, aig: &mut Aig, other: &Number) -> Lit {
        let width = self.width().max(other.width());
        let differ: Vec<Lit> = (0..width).map(|at| aig.xor(self.bit(at), other.bit(at))).collect();
        !aig.or_all(differ)
    }

    pub(crate) fn compare(aig: &mut Aig, op: CompareOp, a: &Number, b: &Number) -> Lit {
        match op {
            CompareOp::Eq => a.equal(aig, b),
            CompareOp::Ne => !a.equal(aig, b),
            CompareOp::Lt => a.less(aig, b),
            CompareOp::Ge => !a.less(aig, b),
            CompareOp::Gt => b.less(aig, a),
            CompareOp::Le => !b.less(aig, a),
        }
    }

    fn multiply(&self, aig: &mut Aig, other: &Number) -> Number {
        // Shift and add over the bits of one factor; the sign bit has a negative weight.
        let mut sum = Number::constant(0);
        for at in 0..other.width() {
            let bit = other.bits[at];
            if bit == Lit::FALSE {
                continue;
            }
            let mut bits = vec![Lit::FALSE; at];
            bits.extend(self.bits.iter().map(|own| aig.and(*own, bit)));
            let part = Number { bits };
            sum = if at + 1 == other.width() {
                sum.subtract(aig, &part)
            } else {
                sum.add(aig, &part, Lit::FALSE)
            };
        }
        sum
    }

    fn magnitude(&self, aig: &mut Aig) -> Number {
        let negated = self.negate(aig);
        Number::select(aig, self.sign(), &negated, self)
    }

    /// Quotient and remainder, truncating toward zero.
    fn divide(&self, aig: &mut Aig, other: &Number) -> (Number, Number) {
        let (a, b) = (self.magnitude(aig), other.magnitude(aig));
        let mut rest = Number::constant(0);
        let mut quotient = vec![Lit::FALSE; a.width()];
        for at in (0..a.width()).rev() {
            let mut bits = vec![a.bit(at)];
            bits.extend(&rest.bits);
            rest = Number { bits }.trimmed();
            let fits = !rest.less(aig, &b);
            let less = rest.subtract(aig, &b);
            rest = Number::select(aig, fits, &less, &rest);
            quotient[at] = fits;
        }
        quotient.push(Lit::FALSE);
        let quotient = Number { bits: quotient }.trimmed();
        let opposite = aig.xor(self.sign(), other.sign());
        let negated = quotient.negate(aig);
        let quotient = Number::select(aig, opposite, &negated, &quotient);
        let negated = rest.negate(aig);
        let rest = Number::select(aig, self.sign(), &negated, &rest);
        (quotient, rest)
    }

    pub(crate) fn arith(aig: &mut Aig, op: ArithOp, a: &Number, b: &Number) -> Number {
        match op {
            ArithOp::Add => a.add(aig, b, Lit::FALSE),
            ArithOp::Sub => a.subtract(aig, b),
            ArithOp::Mul => a.multiply(aig, b),
            ArithOp::Div => a.divide(aig, b).0,
            ArithOp::Mod => a.divide(aig, b).1,
            ArithOp::BitAnd => a.bit_by_bit(b, |x, y| aig.and(x, y)),
            ArithOp::BitOr => a.bit_by_bit(b, |x, y| aig.or(x, y)),
            ArithOp::BitXor => a.bit_by_bit(b, |x, y| aig.xor(x, y)),
            ArithOp::Shl => a.shift(aig, b, |number, by| {
                let mut bits = vec![Lit::FALSE; by];
                bits.extend(&number.bits);
                Number { bits }
            }),
            ArithOp::Shr => a.shift(aig, b, |number, by| {
                let rest = number.bits.iter().skip(by).copied();
                Number {
                    bits: if by < number.width() { rest.collect() } else { vec![number.sign()] },
                }
            }),
        }
    }

    /// Combines the bits at each place, the sign included.
    fn bit_by_bit(&self, other: &Number, mut combine: impl FnMut(Lit, Lit) -> Lit) -> Number {
        let width = self.width().max(other.width());
        Number { bits: (0..width).map(|at| combine(self.bit(at), other.bit(at))).collect() }
            .trimmed()
    }

    /// Shifts by each power of two whose bit is set in the amount, which is in `0..=63`; `by` shifts by a constant.
    fn shift(
        &self,
        aig: &mut Aig,
        amount: &Number,
        by: impl Fn(&Number, usize) -> Number,
    ) -> Number {
        let mut result = self.clone();
        for at in 0..amount.width().min(6) {
            let shifted = by(&result, 1 << at);
            result = Number::select(aig, amount.bit(at), &shifted, &result);
        }
        result
    }

    /// The value clamped to the bounds.
    pub(crate) fn saturate(&self, aig: &mut Aig, lo: i64, hi: i64) -> Number {
        let (low, high) = (Number::constant(lo), Number::constant(hi));
        let below = self.less(aig, &low);
        let above = high.less(aig, self);
        let value = Number::select(aig, below, &low, self);
        Number::select(aig, above, &high, &value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(aig: &Aig, number: &Number, variables: &[Lit], pattern: u32) -> i64 {
        let bits = aig.eval(number.bits(), |lit| {
            variables
                .iter()
                .position(|variable| *variable == lit)
                .is_some_and(|at| pattern >> at & 1 == 1)
        });
        let n = bits.len();
        bits.iter().enumerate().fold(0, |sum, (at, bit)| {
            let weight = 1_i64 << at;
            sum + if *bit { if at + 1 == n { -weight } else { weight } } else { 0 }
        })
    }

    #[test]
    fn arithmetic_agrees_with_integers() {
        let mut aig = Aig::new();
        let variables: Vec<Lit> = (0..8).map(|_| aig.variable()).collect();
        let (lo_a, lo_b) = (-7, -9);
        let a = Number::from_code(&mut aig, &variables[..4], lo_a);
        let b = Number::from_code(&mut aig, &variables[4..], lo_b);
        for op in [ArithOp::Add, ArithOp::Sub, ArithOp::Mul, ArithOp::Div, ArithOp::Mod] {
            let result = Number::arith(&mut aig, op, &a, &b);
            for pattern in (0..256).step_by(3) {
                let (x, y) = (lo_a + i64::from(pattern & 15), lo_b + i64::from(pattern >> 4));
                let Some(wanted) = op.apply(x, y) else { continue };
                assert_eq!(value(&aig, &result, &variables, pattern), wanted, "{x} {op:?} {y}");
            }
        }
        for op in [
            CompareOp::Eq,
            CompareOp::Lt,
            CompareOp::Le,
            CompareOp::Gt,
            CompareOp::Ge,
            CompareOp::Ne,
        ] {
            let result = Number::compare(&mut aig, op, &a, &b);
            for pattern in (0..256).step_by(5) {
                let (x, y) = (lo_a + i64::from(pattern & 15), lo_b + i64::from(pattern >> 4));
                let got = aig.eval(&[result], |lit| {
                    variables
                        .iter()
                        .position(|variable| *variable == lit)
                        .is_some_and(|at| pattern >> at & 1 == 1)
                });
                assert_eq!(got[0], op.apply(x, y), "{x} {op:?} {y}");
            }
        }
        let by = Number::from_code(&mut aig, &variables[4..], 0);
        for op in [ArithOp::BitAnd, ArithOp::BitOr, ArithOp::BitXor, ArithOp::Shl, ArithOp::Shr] {
            let (other, lo) = if op.is_shift() { (&by, 0) } else { (&b, lo_b) };
            let result = Number::arith(&mut aig, op, &a, other);
            for pattern in 0..256 {
                let (x, y) = (lo_a + i64::from(pattern & 15), lo + i64::from(pattern >> 4));
                let wanted = op.apply(x, y).unwrap();
                assert_eq!(value(&aig, &result, &variables, pattern), wanted, "{x} {op:?} {y}");
            }
        }
        let clamped = a.saturate(&mut aig, -3, 2);
        for pattern in 0..16 {
            let x = lo_a + i64::from(pattern);
            assert_eq!(value(&aig, &clamped, &variables, pattern), x.clamp(-3, 2));
        }
        let code = clamped.code(&mut aig, -3, 3);
        assert_eq!(code.len(), 3);
    }
}
