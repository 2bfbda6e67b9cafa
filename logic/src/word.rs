//! Exact integers as bits.
//!
//! A [`Word`] is `offset + unsigned(bits)` together with the interval of its value. With the offset, reading a register of `int 5..12` needs no adder, a
//! negation needs only inverters, and a comparison with a constant remains one with a constant. Widths follow from the intervals, so no operation
//! overflows: the arithmetic is exact, as semantics.md §6 requires.

use crate::build::Builder;
use grafsynth_ir::expr::{ArithOp, CompareOp};
use grafsynth_ir::interval;
use grafsynth_ir::logic::NodeId;

/// An integer made of nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// The least significant bit first.
    pub bits: Vec<NodeId>,
    /// The value of all-zero bits.
    pub offset: i128,
    /// Smallest value; at least `offset`.
    pub lo: i128,
    /// Largest value; below `offset + 2^bits`.
    pub hi: i128,
}

/// The number of bits for the values `0..=largest`.
fn width(largest: i128) -> usize {
    (128 - largest.max(0).leading_zeros()) as usize
}

/// Bit `index` of a number.
fn bit(number: i128, index: usize) -> bool {
    index < 127 && number >> index & 1 == 1
}

impl Word {
    /// A constant, with no bits.
    #[must_use]
    pub fn constant(value: i64) -> Self {
        Word { bits: Vec::new(), offset: value.into(), lo: value.into(), hi: value.into() }
    }

    /// The register of a type `lo..=hi`: offset binary from `lo`.
    #[must_use]
    pub fn register(bits: Vec<NodeId>, lo: i64, hi: i64) -> Self {
        Word { bits, offset: lo.into(), lo: lo.into(), hi: hi.into() }
    }

    /// A Boolean as 0 or 1.
    #[must_use]
    pub fn flag(bit: NodeId) -> Self {
        Word { bits: vec![bit], offset: 0, lo: 0, hi: 1 }
    }

    /// The value, if it is a constant.
    #[must_use]
    pub fn as_constant(&self) -> Option<i128> {
        (self.lo == self.hi).then_some(self.lo)
    }

    fn trim(mut self) -> Self {
        self.bits.truncate(width(self.hi - self.offset));
        self
    }

    /// The same value, also known to be within `lo..=hi`. If the bits can never be in that range (unreachable code), the range of the bits is used.
    fn bounded(mut self, lo: i128, hi: i128) -> Self {
        let last = self.offset + (1 << self.bits.len()) - 1;
        (self.lo, self.hi) = (lo.max(self.offset), hi.min(last));
        if self.lo > self.hi {
            (self.lo, self.hi) = (self.offset, last);
        }
        self.trim()
    }

    /// The same value with another offset, which must not exceed the smallest value.
    fn rebased(self, builder: &mut Builder, offset: i128) -> Self {
        let by = self.offset - offset;
        let Word { bits, lo, hi, .. } = self;
        let n = width(hi - offset);
        // `by` may be negative; modulo 2^n the sum is correct, because the value is within the new range.
        let mut sum = Vec::with_capacity(n);
        let mut carry = builder.constant(false);
        let no = builder.constant(false);
        for index in 0..n {
            let a = bits.get(index).copied().unwrap_or(no);
            let b = builder.constant(bit(by, index));
            let half = builder.xor(a, b);
            sum.push(builder.xor(half, carry));
            let both = builder.and([a, b]);
            let rest = builder.and([half, carry]);
            carry = builder.or([both, rest]);
        }
        Word { bits: sum, offset, lo, hi }
    }

    /// The bits in offset binary from `lo`, exactly as many as a register of `lo..=hi` has; the value must be within this range.
    #[must_use]
    pub fn register_bits(self, builder: &mut Builder, lo: i64, hi: i64) -> Vec<NodeId> {
        let n = width(i128::from(hi) - i128::from(lo));
        let word =
            if self.offset == i128::from(lo) { self } else { self.rebased(builder, lo.into()) };
        let mut bits = word.bits;
        let no = builder.constant(false);
        bits.resize(n, no);
        bits
    }

    /// The value clamped to `lo..=hi`.
    #[must_use]
    pub fn saturated(self, builder: &mut Builder, lo: i64, hi: i64) -> Self {
        let (lo, hi) = (i128::from(lo), i128::from(hi));
        let mut word = self;
        if word.lo > hi || word.hi < lo {
            let value = if word.lo > hi { hi } else { lo };
            return Word { bits: Vec::new(), offset: value, lo: value, hi: value };
        }
        if word.hi > hi {
            let fits = word.at_most(builder, hi);
            let limit = Word { bits: Vec::new(), offset: hi, lo: hi, hi };
            let lo = word.lo;
            word = select(builder, fits, &word, &limit).bounded(lo, hi);
        }
        if word.lo < lo {
            let below = word.at_most(builder, lo - 1);
            let limit = Word { bits: Vec::new(), offset: lo, lo, hi: lo };
            let hi = word.hi;
            word = select(builder, below, &limit, &word).bounded(lo, hi);
        }
        word
    }

    /// `self <= limit`.
    fn at_most(&self, builder: &mut Builder, limit: i128) -> NodeId {
        if self.hi <= limit {
            return builder.constant(true);
        }
        if self.lo > limit {
            return builder.constant(false);
        }
        let limit = limit - self.offset;
        if limit < 0 {
            return builder.constant(false);
        }
        if limit >= (1 << self.bits.len()) - 1 {
            return builder.constant(true);
        }
        // From the least significant bit: the lower bits are at most those of the limit.
        let mut result = builder.constant(true);
        for (index, &a) in self.bits.iter().enumerate() {
            let not = builder.not(a);
            result = if bit(limit, index) {
                builder.or([not, result])
            } else {
                builder.and([not, result])
            };
        }
        result
    }

    /// `-self`.
    #[must_use]
    pub fn negated(self, builder: &mut Builder) -> Self {
        let top = (1i128 << self.bits.len()) - 1;
        Word {
            bits: self.bits.iter().map(|&a| builder.not(a)).collect(),
            offset: -self.offset - top,
            lo: -self.hi,
            hi: -self.lo,
        }
    }

    /// The bits for offset 0 (`lo` must not be negative).
    fn plain(self, builder: &mut Builder) -> Self {
        if self.offset == 0 { self } else { self.rebased(builder, 0) }
    }
}

/// `then` if `condition` is true, else `otherwise`.
#[must_use]
pub fn select(builder: &mut Builder, condition: NodeId, then: &Word, otherwise: &Word) -> Word {
    if let Some(value) = builder.as_constant(condition) {
        return if value { then.clone() } else { otherwise.clone() };
    }
    let offset = then.offset.min(otherwise.offset);
    let bring = |builder: &mut Builder, word: &Word| {
        if word.offset == offset { word.clone() } else { word.clone().rebased(builder, offset) }
    };
    let (a, b) = (bring(builder, then), bring(builder, otherwise));
    let (lo, hi) = (a.lo.min(b.lo), a.hi.max(b.hi));
    let no = builder.constant(false);
    let bits = (0..width(hi - offset))
        .map(|index| {
            let (a, b) = (
                a.bits.get(index).copied().unwrap_or(no),
                b.bits.get(index).copied().unwrap_or(no),
            );
            builder.mux(condition, a, b)
        })
        .collect();
    Word { bits, offset, lo, hi }
}

/// A comparison.
#[must_use]
pub fn compare(builder: &mut Builder, op: CompareOp, a: &Word, b: &Word) -> NodeId {
    match op {
        CompareOp::Eq => equal(builder, a, b),
        CompareOp::Ne => {
            let same = equal(builder, a, b);
            builder.not(same)
        }
        CompareOp::Le => at_most(builder, a, b),
        CompareOp::Ge => at_most(builder, b, a),
        CompareOp::Lt => {
            let not = at_most(builder, b, a);
            builder.not(not)
        }
        CompareOp::Gt => {
            let not = at_most(builder, a, b);
            builder.not(not)
        }
    }
}

fn equal(builder: &mut Builder, a: &Word, b: &Word) -> NodeId {
    if a.hi < b.lo || b.hi < a.lo {
        return builder.constant(false);
    }
    let (a, b) = if a.as_constant().is_some() { (b, a) } else { (a, b) };
    let pairs: Vec<NodeId> = match b.as_constant() {
        Some(value) => {
            let value = value - a.offset;
            let flip = |builder: &mut Builder, (index, &a): (usize, &NodeId)| {
                if bit(value, index) { a } else { builder.not(a) }
            };
            a.bits.iter().enumerate().map(|pair| flip(builder, pair)).collect()
        }
        None => {
            let (a, b) = aligned(builder, a, b);
            a.into_iter().zip(b).map(|(a, b)| builder.iff(a, b)).collect()
        }
    };
    builder.and(pairs)
}

fn at_most(builder: &mut Builder, a: &Word, b: &Word) -> NodeId {
    if a.hi <= b.lo {
        return builder.constant(true);
    }
    if a.lo > b.hi {
        return builder.constant(false);
    }
    if let Some(limit) = b.as_constant() {
        return a.at_most(builder, limit);
    }
    if let Some(limit) = a.as_constant() {
        let below = b.at_most(builder, limit - 1);
        return builder.not(below);
    }
    let (a, b) = aligned(builder, a, b);
    let mut result = builder.constant(true);
    for (a, b) in a.into_iter().zip(b) {
        // If the bits differ, b decides; otherwise the lower bits do.
        let differ = builder.xor(a, b);
        result = builder.mux(differ, b, result);
    }
    result
}

/// Bits of both with a common offset and width.
fn aligned(builder: &mut Builder, a: &Word, b: &Word) -> (Vec<NodeId>, Vec<NodeId>) {
    let offset = a.offset.min(b.offset);
    let n = width(a.hi.max(b.hi) - offset);
    let no = builder.constant(false);
    let mut bring = |word: &Word| {
        let word = if word.offset == offset {
            word.clone()
        } else {
            word.clone().rebased(builder, offset)
        };
        let mut bits = word.bits;
        bits.resize(n, no);
        bits
    };
    (bring(a), bring(b))
}

/// Arithmetic. Division by zero gives an arbitrary value; validation excludes it.
#[must_use]
pub fn arith(builder: &mut Builder, op: ArithOp, a: Word, b: Word) -> Word {
    match op {
        ArithOp::Add => add(builder, &a, &b),
        ArithOp::Sub => {
            let b = b.negated(builder);
            add(builder, &a, &b)
        }
        ArithOp::Mul => mul(builder, a, b),
        ArithOp::Div => div_mod(builder, a, b).0,
        ArithOp::Mod => div_mod(builder, a, b).1,
        ArithOp::BitAnd => bit_by_bit(builder, op, &a, &b, |builder, x, y| builder.and([x, y])),
        ArithOp::BitOr => bit_by_bit(builder, op, &a, &b, |builder, x, y| builder.or([x, y])),
        ArithOp::BitXor => bit_by_bit(builder, op, &a, &b, Builder::xor),
        ArithOp::Shl | ArithOp::Shr => shift(builder, op, &a, b),
    }
}

/// The interval as 64-bit numbers; validation shows that no value exceeds them.
fn within_64_bits(word: &Word) -> (i64, i64) {
    let narrow = |value: i128| value.clamp(i64::MIN.into(), i64::MAX.into()) as i64;
    (narrow(word.lo), narrow(word.hi))
}

/// The number of bits of the two's complement of `lo..=hi`, with the sign bit only if a value is negative.
fn two_complement_width(lo: i128, hi: i128) -> usize {
    width(hi).max(width(-1 - lo)) + usize::from(lo < 0)
}

/// The `n` lowest bits of the two's complement.
fn two_complement(builder: &mut Builder, word: &Word, n: usize) -> Vec<NodeId> {
    let by: Vec<NodeId> = (0..n).map(|index| builder.constant(bit(word.offset, index))).collect();
    add_bits(builder, &word.bits, &by, n)
}

/// The number within `lo..=hi` with this two's complement. With the offset of its sign, it needs only an inverter.
fn from_two_complement(
    builder: &mut Builder,
    mut bits: Vec<NodeId>,
    (lo, hi): (i128, i128),
) -> Word {
    let n = two_complement_width(lo, hi);
    bits.truncate(n);
    let offset = if lo < 0 { -(1 << (n - 1)) } else { 0 };
    if lo < 0
        && let Some(sign) = bits.last_mut()
    {
        *sign = builder.not(*sign);
    }
    Word { bits, offset, lo, hi }
}

/// One gate for each bit of the result, and wires where an operand is constant.
fn bit_by_bit(
    builder: &mut Builder,
    op: ArithOp,
    a: &Word,
    b: &Word,
    gate: impl Fn(&mut Builder, NodeId, NodeId) -> NodeId,
) -> Word {
    let bounds = interval::arith(op, within_64_bits(a), within_64_bits(b));
    let (lo, hi) = bounds.unwrap_or((i64::MIN, i64::MAX));
    let n = two_complement_width(lo.into(), hi.into());
    let (x, y) = (two_complement(builder, a, n), two_complement(builder, b, n));
    let bits = x.into_iter().zip(y).map(|(x, y)| gate(builder, x, y)).collect();
    from_two_complement(builder, bits, (lo.into(), hi.into()))
}

/// A shift by a constant is made of wires only. Otherwise each bit of the amount selects between the number and the number shifted by a power of two.
fn shift(builder: &mut Builder, op: ArithOp, a: &Word, amount: Word) -> Word {
    let (least, most) = (amount.lo.clamp(0, 63), amount.hi.clamp(0, 63));
    let by = |value: i128, amount: i128| {
        if op == ArithOp::Shl { value << amount } else { value >> amount }
    };
    let corners = [by(a.lo, least), by(a.lo, most), by(a.hi, least), by(a.hi, most)];
    let lo = corners.into_iter().min().unwrap_or(0);
    let hi = corners.into_iter().max().unwrap_or(0);
    let n = two_complement_width(lo, hi).max(two_complement_width(a.lo, a.hi));
    let mut bits = two_complement(builder, a, n);
    let fill = bits.last().copied().filter(|_| a.lo < 0);
    let fill = fill.unwrap_or_else(|| builder.constant(false));
    let no = builder.constant(false);
    let moved = |bits: &[NodeId], by: usize| -> Vec<NodeId> {
        if op == ArithOp::Shl {
            std::iter::repeat_n(no, by).chain(bits.iter().copied()).take(n).collect()
        } else {
            let rest = bits.iter().skip(by).copied();
            rest.chain(std::iter::repeat(fill)).take(n).collect()
        }
    };
    if least == most {
        bits = moved(&bits, usize::try_from(least).unwrap_or(0));
    } else {
        for (index, selects) in amount.plain(builder).bits.into_iter().take(6).enumerate() {
            let shifted = moved(&bits, 1 << index);
            let pairs = bits.into_iter().zip(shifted);
            bits = pairs.map(|(kept, moved)| builder.mux(selects, moved, kept)).collect();
        }
    }
    from_two_complement(builder, bits, (lo, hi))
}

fn add(builder: &mut Builder, a: &Word, b: &Word) -> Word {
    let (offset, lo, hi) = (a.offset + b.offset, a.lo + b.lo, a.hi + b.hi);
    let bits = add_bits(builder, &a.bits, &b.bits, width(hi - offset));
    Word { bits, offset, lo, hi }
}

/// The `n` lowest bits of a sum.
fn add_bits(builder: &mut Builder, a: &[NodeId], b: &[NodeId], n: usize) -> Vec<NodeId> {
    let no = builder.constant(false);
    let mut carry = no;
    (0..n)
        .map(|index| {
            let (a, b) = (a.get(index).copied().unwrap_or(no), b.get(index).copied().unwrap_or(no));
            let half = builder.xor(a, b);
            let sum = builder.xor(half, carry);
            let both = builder.and([a, b]);
            let rest = builder.and([half, carry]);
            carry = builder.or([both, rest]);
            sum
        })
        .collect()
}

/// A number times a constant (including interval and offset).
fn scaled(builder: &mut Builder, a: &Word, factor: i128) -> Word {
    let size = factor.unsigned_abs();
    let mut total = Word::constant(0);
    for shift in 0..127 {
        if size >> shift & 1 == 1 {
            let no = builder.constant(false);
            let bits = std::iter::repeat_n(no, shift).chain(a.bits.iter().copied()).collect();
            let part =
                Word { bits, offset: a.offset << shift, lo: a.lo << shift, hi: a.hi << shift };
            total = add(builder, &total, &part);
        }
    }
    if factor < 0 { total.negated(builder) } else { total }
}

fn mul(builder: &mut Builder, a: Word, b: Word) -> Word {
    if let Some(factor) = a.as_constant() {
        return scaled(builder, &b, factor);
    }
    if let Some(factor) = b.as_constant() {
        return scaled(builder, &a, factor);
    }
    // Magnitudes and a sign: partial products then stay within the product's range.
    let corners = [a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi];
    let lo = corners.into_iter().min().unwrap_or(0);
    let hi = corners.into_iter().max().unwrap_or(0);
    let ((a, a_negative), (b, b_negative)) = (magnitude(builder, a), magnitude(builder, b));
    let n = width(a.hi * b.hi);
    let no = builder.constant(false);
    let mut sum: Vec<NodeId> = Vec::new();
    for (shift, &factor) in b.bits.iter().enumerate() {
        let gated = a.bits.iter().map(|&bit| builder.and([bit, factor])).collect::<Vec<_>>();
        let part: Vec<NodeId> = std::iter::repeat_n(no, shift).chain(gated).collect();
        sum = add_bits(builder, &sum, &part, n);
    }
    let product = Word { bits: sum, offset: 0, lo: 0, hi: a.hi * b.hi };
    let negative = builder.xor(a_negative, b_negative);
    signed(builder, product, negative, lo, hi)
}

/// The absolute value with offset 0, and whether the number is negative.
fn magnitude(builder: &mut Builder, a: Word) -> (Word, NodeId) {
    if a.lo >= 0 {
        let negative = builder.constant(false);
        return (a.plain(builder), negative);
    }
    let negative = a.at_most(builder, -1);
    let largest = a.hi.max(-a.lo);
    let minus = a.clone().negated(builder);
    // Each operand is negative only if it is not selected; if it is selected, its bits modulo 2^n are correct.
    let n = width(largest);
    let take = |builder: &mut Builder, word: Word| {
        let by: Vec<NodeId> =
            (0..n).map(|index| builder.constant(bit(word.offset, index))).collect();
        add_bits(builder, &word.bits, &by, n)
    };
    let (plus, minus) = (take(builder, a), take(builder, minus));
    let bits = plus
        .into_iter()
        .zip(minus)
        .map(|(plus, minus)| builder.mux(negative, minus, plus))
        .collect();
    (Word { bits, offset: 0, lo: 0, hi: largest }, negative)
}

/// The number with the given sign; `lo` and `hi` bound the result.
fn signed(builder: &mut Builder, magnitude: Word, negative: NodeId, lo: i128, hi: i128) -> Word {
    if builder.as_constant(negative) == Some(false) {
        return magnitude.bounded(lo, hi);
    }
    let minus = magnitude.clone().negated(builder);
    select(builder, negative, &minus, &magnitude).bounded(lo, hi)
}

/// Quotient, truncated toward zero, and remainder, with the sign of the dividend.
fn div_mod(builder: &mut Builder, a: Word, b: Word) -> (Word, Word) {
    let (a_lo, a_hi) = (a.lo, a.hi);
    let ((a, a_negative), (b, b_negative)) = (magnitude(builder, a), magnitude(builder, b));
    // Restoring division, most significant bit first.
    let n = b.bits.len() + 1;
    let no = builder.constant(false);
    let mut divisor = b.bits.clone();
    divisor.resize(n, no);
    let minus: Vec<NodeId> = divisor.iter().map(|&bit| builder.not(bit)).collect();
    let one = builder.constant(true);
    let mut rest = vec![no; n];
    let mut quotient = Vec::with_capacity(a.bits.len());
    for &bit in a.bits.iter().rev() {
        rest.pop();
        rest.insert(0, bit);
        // rest - divisor = rest + not divisor + 1: there is no borrow if and only if the carry out is 1.
        let mut carry = one;
        let mut difference = Vec::with_capacity(n);
        for (&a, &b) in rest.iter().zip(&minus) {
            let half = builder.xor(a, b);
            difference.push(builder.xor(half, carry));
            let both = builder.and([a, b]);
            let through = builder.and([half, carry]);
            carry = builder.or([both, through]);
        }
        rest =
            rest.iter().zip(&difference).map(|(&old, &new)| builder.mux(carry, new, old)).collect();
        quotient.push(carry);
    }
    quotient.reverse();
    let smallest = divisor_floor(b.lo);
    let largest = a.hi / smallest;
    let quotient = Word { bits: quotient, offset: 0, lo: 0, hi: largest }.trim();
    let rest_hi = a.hi.min(b.hi - 1).max(0);
    let rest = Word { bits: rest, offset: 0, lo: 0, hi: rest_hi }.trim();
    let negative = builder.xor(a_negative, b_negative);
    let may_be_negative = builder.as_constant(negative) != Some(false);
    let may_be_positive = builder.as_constant(negative) != Some(true);
    let quotient_lo = if may_be_negative { -largest } else { 0 };
    let quotient_hi = if may_be_positive { largest } else { 0 };
    let quotient = signed(builder, quotient, negative, quotient_lo, quotient_hi);
    let rest_lo = if a_lo < 0 { -rest_hi } else { 0 };
    let rest = signed(builder, rest, a_negative, rest_lo, if a_hi < 0 { 0 } else { rest_hi });
    (quotient, rest)
}

/// The smallest magnitude of a divisor that is not zero.
fn divisor_floor(lo: i128) -> i128 {
    lo.max(1)
}

#[cfg(test)]
mod tests {
    use super::{Word, arith, compare, select};
    use crate::build::Builder;
    use crate::sim::LogicSim;
    use grafsynth_ir::expr::{ArithOp, CompareOp, Type};
    use grafsynth_ir::logic::NodeId;
    use proptest::prelude::*;

    /// A register of the type, made of input pins.
    fn operand(builder: &mut Builder, lo: i64, hi: i64) -> Word {
        let bits = (0..Type::Int { lo, hi }.bits()).map(|_| builder.input_named("x")).collect();
        Word::register(bits, lo, hi)
    }

    /// The value of a word if the inputs have these numbers in turn.
    fn value(builder: &Builder, word: &Word, numbers: &[(i64, i64, i64)]) -> i128 {
        let (bits, offset) = (word.bits.clone(), word.offset);
        let read = run(builder, numbers, &bits);
        offset + read.iter().enumerate().map(|(k, &bit)| i128::from(bit) << k).sum::<i128>()
    }

    fn run(builder: &Builder, numbers: &[(i64, i64, i64)], nodes: &[NodeId]) -> Vec<bool> {
        let logic = builder.logic.clone();
        let mut sim = LogicSim::new(&logic);
        let mut pins = logic.inputs.ids();
        for &(number, lo, hi) in numbers {
            for k in 0..(Type::Int { lo, hi }).bits() {
                let pin = pins.next().unwrap();
                sim.set_input(pin, number.abs_diff(lo) >> k & 1);
            }
        }
        nodes.iter().map(|&node| sim.node(node) & 1 == 1).collect()
    }

    fn range_with() -> impl Strategy<Value = (i64, i64, i64)> {
        (-40i64..40, 0i64..60).prop_flat_map(|(lo, span)| {
            (lo..=lo + span).prop_map(move |value| (value, lo, lo + span))
        })
    }

    #[test]
    fn masks_and_shifts_by_constants_are_wires() {
        for (lo, hi) in [(0, 255), (-128, 127), (-8, 255)] {
            let mut builder = Builder::default();
            let x = operand(&mut builder, lo, hi);
            let n_inputs = builder.logic.nodes.len();
            for (op, constant) in
                [(ArithOp::BitAnd, 60), (ArithOp::Shl, 5), (ArithOp::Shr, 3), (ArithOp::Shr, 20)]
            {
                let _ = arith(&mut builder, op, x.clone(), Word::constant(constant));
            }
            let n_gates = builder.logic.nodes.len() - n_inputs;
            // Constants, and inverters of signs; only the offset -8 needs an adder.
            assert!(n_gates <= 3 || lo == -8, "{n_gates} gates for {lo}..{hi}");
        }
        let mut builder = Builder::default();
        let (x, y) = (operand(&mut builder, 0, 255), operand(&mut builder, 0, 255));
        let n_before = builder.logic.nodes.len();
        let both = arith(&mut builder, ArithOp::BitAnd, x, y);
        assert_eq!(both.bits.len(), 8);
        assert!(builder.logic.nodes.len() <= n_before + 8 + 2, "one gate for each bit");
    }

    proptest! {
        #[test]
        fn arithmetic_is_exact((a, a_lo, a_hi) in range_with(), (b, b_lo, b_hi) in range_with(), c in any::<bool>()) {
            let numbers = [(a, a_lo, a_hi), (b, b_lo, b_hi), (i64::from(c), 0, 1)];
            let mut builder = Builder::default();
            let x = operand(&mut builder, a_lo, a_hi);
            let y = operand(&mut builder, b_lo, b_hi);
            let z = operand(&mut builder, 0, 1);
            for op in [
                ArithOp::Add, ArithOp::Sub, ArithOp::Mul, ArithOp::Div, ArithOp::Mod, ArithOp::BitAnd, ArithOp::BitOr, ArithOp::BitXor,
                ArithOp::Shl, ArithOp::Shr,
            ] {
                if matches!(op, ArithOp::Div | ArithOp::Mod) && b_lo <= 0 && b_hi >= 0
                    || op.is_shift() && (b_lo < 0 || b_hi > 50)
                {
                    continue;
                }
                let word = arith(&mut builder, op, x.clone(), y.clone());
                let want = i128::from(op.apply(a, b).unwrap());
                prop_assert_eq!(value(&builder, &word, &numbers), want, "{:?}", op);
                prop_assert!(word.lo <= want && want <= word.hi);
                prop_assert!(word.offset <= word.lo && word.hi - word.offset < 1 << word.bits.len());
                let held = word.saturated(&mut builder, -7, 20);
                let want = want.clamp(-7, 20);
                prop_assert_eq!(value(&builder, &held, &numbers), want);
                let bits = held.register_bits(&mut builder, -7, 20);
                let register = Word::register(bits, -7, 20);
                prop_assert_eq!(value(&builder, &register, &numbers), want);
            }
            for op in [CompareOp::Eq, CompareOp::Ne, CompareOp::Lt, CompareOp::Le, CompareOp::Gt, CompareOp::Ge] {
                let node = compare(&mut builder, op, &x, &y);
                prop_assert_eq!(run(&builder, &numbers, &[node]), vec![op.apply(a, b)]);
                let node = compare(&mut builder, op, &x, &Word::constant(b));
                prop_assert_eq!(run(&builder, &numbers, &[node]), vec![op.apply(a, b)]);
                let node = compare(&mut builder, op, &Word::constant(a), &y);
                prop_assert_eq!(run(&builder, &numbers, &[node]), vec![op.apply(a, b)]);
            }
            let chosen = select(&mut builder, z.bits[0], &x, &y);
            prop_assert_eq!(value(&builder, &chosen, &numbers), i128::from(if c { a } else { b }));
            let minus = x.clone().negated(&mut builder);
            prop_assert_eq!(value(&builder, &minus, &numbers), i128::from(-a));
        }
    }
}
