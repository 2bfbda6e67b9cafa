//! The integers of C as functions: exact values, which [`super::eval`] reduces to the range of a type.
//!
//! Codes of steps and everything that is computed from them by cases are kept as choices between constants, so that "the code is 3" stays one literal, and is the
//! literal of the step that has this code.

use std::collections::BTreeMap;

use grafsynth_ir::expr::{ArithOp, CompareOp};

use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::number::Number;

/// The maximum number of constants of a choice, and of pairs of constants that an operation considers.
const MAX_CHOICE: usize = 4096;
/// The maximum depth and number of nodes that are looked at to find out whether the values of a path imply its condition.
const MAX_DEPTH: u32 = 24;
const MAX_LOOKED_AT: usize = 100_000;
/// The maximum number of constants that are compared with a word one by one.
const MAX_COMPARED: usize = 64;

/// An integer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Int {
    /// 0 or 1.
    Bit(Lit),
    /// Constants with their conditions, in ascending order. On each path on which the value exists, exactly one condition is true.
    Choice(Vec<(i128, Lit)>),
    /// Any other function.
    Word(Number),
}

impl Int {
    pub(super) fn constant(value: i128) -> Int {
        Int::Choice(vec![(value, Lit::TRUE)])
    }

    /// The value, if it is constant.
    pub(super) fn as_constant(&self) -> Option<i128> {
        match self {
            Int::Bit(lit) => lit.as_constant().map(i128::from),
            Int::Choice(all) => match all.as_slice() {
                [(value, _)] => Some(*value),
                _ => None,
            },
            Int::Word(number) => number.as_constant(),
        }
    }

    /// The constants with their conditions; `None` for a word.
    pub(super) fn cases(&self) -> Option<Vec<(i128, Lit)>> {
        match self {
            Int::Bit(lit) => Some(match lit.as_constant() {
                Some(value) => vec![(i128::from(value), Lit::TRUE)],
                None => vec![(0, !*lit), (1, *lit)],
            }),
            Int::Choice(all) => Some(all.clone()),
            Int::Word(number) => number.as_constant().map(|value| vec![(value, Lit::TRUE)]),
        }
    }

    /// A choice between these constants, in any order and possibly repeated.
    pub(super) fn choice(aig: &mut Aig, cases: impl IntoIterator<Item = (i128, Lit)>) -> Int {
        let mut by_value: BTreeMap<i128, Vec<Lit>> = BTreeMap::new();
        for (value, condition) in cases {
            if condition != Lit::FALSE {
                by_value.entry(value).or_default().push(condition);
            }
        }
        if by_value.len() < 2 {
            // Exactly one condition is true; without conditions, this point is never reached.
            return Int::constant(by_value.into_keys().next().unwrap_or(0));
        }
        let all = by_value.into_iter().map(|(value, ways)| (value, aig.or_all(ways)));
        Int::Choice(all.collect()).bounded(aig)
    }

    fn bounded(self, aig: &mut Aig) -> Int {
        match &self {
            Int::Choice(all) if all.len() > MAX_CHOICE => Int::Word(self.number(aig)),
            _ => self,
        }
    }

    /// The value as a number.
    pub(super) fn number(&self, aig: &mut Aig) -> Number {
        match self {
            Int::Bit(lit) => Number::of_bits(vec![*lit, Lit::FALSE]),
            Int::Word(number) => number.clone(),
            Int::Choice(all) => {
                let width = all.iter().map(|(value, _)| width(*value)).max().unwrap_or(1);
                let bit = |aig: &mut Aig, at: usize| {
                    if all.iter().all(|(value, _)| value >> at & 1 == 1) {
                        return Lit::TRUE;
                    }
                    let ones = all.iter().filter(|(value, _)| value >> at & 1 == 1);
                    aig.or_all(ones.map(|(_, condition)| *condition).collect::<Vec<_>>())
                };
                Number::of_bits((0..width).map(|at| bit(aig, at)).collect())
            }
        }
    }

    /// The condition that the value is not 0.
    pub(super) fn truth(&self, aig: &mut Aig) -> Lit {
        match self {
            Int::Bit(lit) => *lit,
            Int::Choice(all) => holds(aig, all, |value| value != 0),
            Int::Word(number) => {
                let bits = number.bits().to_vec();
                aig.or_all(bits)
            }
        }
    }

    /// The condition that the value is this constant.
    pub(super) fn is(&self, aig: &mut Aig, value: i128) -> Lit {
        compare(aig, CompareOp::Eq, self, &Int::constant(value))
    }

    /// The condition that the value is outside these bounds.
    pub(super) fn outside(&self, aig: &mut Aig, lo: i128, hi: i128) -> Lit {
        if let Int::Word(number) = self {
            let (least, largest) = number.bounds();
            if least >= lo && largest <= hi {
                return Lit::FALSE;
            }
        }
        let below = compare(aig, CompareOp::Lt, self, &Int::constant(lo));
        let above = compare(aig, CompareOp::Gt, self, &Int::constant(hi));
        aig.or(below, above)
    }

    /// The value modulo `2^bits`, counted from 0 or, if signed, from the most negative number.
    pub(super) fn wrapped(&self, aig: &mut Aig, bits: u32, is_signed: bool) -> Int {
        let wrap = |value: i128| {
            let lo = if is_signed { -(1_i128 << (bits - 1)) } else { 0 };
            (value - lo).rem_euclid(1 << bits) + lo
        };
        match self {
            Int::Bit(lit) if !(is_signed && bits == 1) => Int::Bit(*lit),
            Int::Bit(_) | Int::Choice(_) => {
                let cases = self.cases().unwrap_or_default();
                if cases.iter().all(|(value, _)| wrap(*value) == *value) {
                    return self.clone();
                }
                Int::choice(aig, cases.into_iter().map(|(value, lit)| (wrap(value), lit)))
            }
            Int::Word(number) => {
                let (least, largest) = number.bounds();
                let fits = |value: i128| value.abs() < 1 << 100 && wrap(value) == value;
                if least > i128::MIN && fits(least) && fits(largest) {
                    return self.clone();
                }
                let mut kept: Vec<Lit> = (0..bits as usize).map(|at| number.bit(at)).collect();
                if !is_signed {
                    kept.push(Lit::FALSE);
                }
                Int::Word(Number::of_bits(kept))
            }
        }
    }

    /// One of several values, each with the condition under which it applies; exactly one of these conditions is true on the path.
    pub(super) fn merge(aig: &mut Aig, all: &[(Lit, Int)]) -> Int {
        if all.iter().all(|(_, value)| matches!(value, Int::Bit(_))) {
            return Int::Bit(merge_bits(aig, all.iter().map(|(when, value)| (*when, value))));
        }
        if all.iter().all(|(_, value)| !matches!(value, Int::Word(_))) {
            let mut cases = Vec::new();
            for (when, value) in all {
                // On the path of a `case` with many labels, the values themselves often imply that the path was taken.
                let labels = aig.disjuncts(*when, MAX_CHOICE);
                let mut budget = MAX_LOOKED_AT;
                for (value, condition) in value.cases().unwrap_or_default() {
                    let is_implied = labels.len() > 1
                        && aig.implies_one(condition, &labels, MAX_DEPTH, &mut budget);
                    let both = if is_implied { condition } else { aig.and(*when, condition) };
                    cases.push((value, both));
                }
            }
            return Int::choice(aig, cases);
        }
        let Some(((_, last), others)) = all.split_last() else { return Int::constant(0) };
        let mut merged = last.number(aig);
        for (when, value) in others.iter().rev() {
            let value = value.number(aig);
            merged = Number::select(aig, *when, &value, &merged);
        }
        Int::Word(merged)
    }
}

fn merge_bits<'i>(aig: &mut Aig, all: impl Iterator<Item = (Lit, &'i Int)>) -> Lit {
    let all: Vec<(Lit, Lit)> = all
        .filter_map(
            |(when, value)| if let Int::Bit(lit) = value { Some((when, *lit)) } else { None },
        )
        .collect();
    match all.as_slice() {
        [(_, only)] => *only,
        [(when, yes), (_, no)] => aig.ite(*when, *yes, *no),
        all => {
            let ways: Vec<Lit> = all.iter().map(|(when, value)| aig.and(*when, *value)).collect();
            aig.or_all(ways)
        }
    }
}

/// The number of bits of a constant in two's complement.
fn width(value: i128) -> usize {
    (129 - if value < 0 { (!value).leading_zeros() } else { value.leading_zeros() }) as usize
}

/// The number with this value.
fn constant(value: i128) -> Number {
    Number::of_bits((0..width(value)).map(|at| Lit::constant(value >> at & 1 == 1)).collect())
}

/// The condition that a choice has a property.
fn holds(aig: &mut Aig, all: &[(i128, Lit)], test: impl Fn(i128) -> bool) -> Lit {
    let (yes, no): (Vec<_>, Vec<_>) = all.iter().partition(|(value, _)| test(*value));
    if yes.is_empty() {
        return Lit::FALSE;
    }
    if no.is_empty() {
        return Lit::TRUE;
    }
    aig.or_all(yes.into_iter().map(|(_, condition)| condition).collect::<Vec<_>>())
}

/// A comparison of exact values.
pub(super) fn compare(aig: &mut Aig, op: CompareOp, a: &Int, b: &Int) -> Lit {
    if let (Int::Bit(lit), Some(value)) = (a, b.as_constant()) {
        let at = |bit: i128| apply(op, bit, value);
        return match (at(0), at(1)) {
            (false, false) => Lit::FALSE,
            (false, true) => *lit,
            (true, false) => !*lit,
            (true, true) => Lit::TRUE,
        };
    }
    match (a.cases(), b.cases()) {
        (Some(a), Some(b)) if a.len() == 1 || b.len() == 1 => {
            let (x, y) = (a[0].0, b[0].0);
            return if b.len() == 1 {
                holds(aig, &a, |value| apply(op, value, y))
            } else {
                holds(aig, &b, |value| apply(op, x, value))
            };
        }
        (Some(a), Some(b)) if a.len() * b.len() <= MAX_CHOICE => {
            let mut ways = Vec::new();
            for (x, when_x) in &a {
                let fitting: Vec<Lit> =
                    b.iter().filter(|(y, _)| apply(op, *x, *y)).map(|(_, when)| *when).collect();
                let any = if fitting.len() == b.len() { Lit::TRUE } else { aig.or_all(fitting) };
                ways.push(aig.and(*when_x, any));
            }
            return aig.or_all(ways);
        }
        (Some(all), None) | (None, Some(all)) if all.len() <= MAX_COMPARED && all.len() > 1 => {
            let is_left = b.cases().is_none();
            let word = if is_left { b } else { a };
            let word = word.number(aig);
            let mut ways = Vec::new();
            for (value, when) in all {
                let value = constant(value);
                let (a, b) = if is_left { (&value, &word) } else { (&word, &value) };
                let is = Number::compare(aig, op, a, b);
                ways.push(aig.and(when, is));
            }
            return aig.or_all(ways);
        }
        _ => {}
    }
    let (a, b) = (a.number(aig), b.number(aig));
    Number::compare(aig, op, &a, &b)
}

/// A comparison of constants.
pub(super) fn apply(op: CompareOp, a: i128, b: i128) -> bool {
    match op {
        CompareOp::Eq => a == b,
        CompareOp::Ne => a != b,
        CompareOp::Lt => a < b,
        CompareOp::Le => a <= b,
        CompareOp::Gt => a > b,
        CompareOp::Ge => a >= b,
    }
}

/// An operation on two integers, exact: `constant` on constants (`None` if it has no value for them), `word` on all others. Also returns the condition under which it
/// has no value.
pub(super) fn binary(
    aig: &mut Aig,
    a: &Int,
    b: &Int,
    apply: impl Fn(i128, i128) -> Option<i128>,
    word: impl FnOnce(&mut Aig, &Number, &Number) -> Option<(Number, Lit)>,
) -> Option<(Int, Lit)> {
    if let (Some(xs), Some(ys)) = (a.cases(), b.cases())
        && (xs.len() == 1 || ys.len() == 1 || xs.len() * ys.len() <= MAX_COMPARED)
    {
        let mut cases = Vec::new();
        let mut without = Vec::new();
        for (x, when_x) in &xs {
            for (y, when_y) in &ys {
                let when = aig.and(*when_x, *when_y);
                match apply(*x, *y) {
                    Some(value) => cases.push((value, when)),
                    None => without.push(when),
                }
            }
        }
        let without = aig.or_all(without);
        let value = if cases.is_empty() { Int::constant(0) } else { Int::choice(aig, cases) };
        return Some((value, without));
    }
    let (a, b) = (a.number(aig), b.number(aig));
    let (value, without) = word(aig, &a, &b)?;
    Some((Int::Word(value), without))
}

/// The exact result of an arithmetic operator.
pub(super) fn arith(aig: &mut Aig, op: ArithOp, a: &Number, b: &Number) -> (Number, Lit) {
    let without = match op {
        ArithOp::Div | ArithOp::Mod => {
            let bits: Vec<Lit> = b.bits().to_vec();
            !aig.or_all(bits)
        }
        _ => Lit::FALSE,
    };
    (Number::arith(aig, op, a, b), without)
}

/// The bits of two numbers combined one by one, sign bits included.
pub(super) fn bitwise(
    aig: &mut Aig,
    a: &Number,
    b: &Number,
    combine: impl Fn(&mut Aig, Lit, Lit) -> Lit,
) -> Number {
    let width = a.bits().len().max(b.bits().len());
    Number::of_bits((0..width).map(|at| combine(aig, a.bit(at), b.bit(at))).collect())
}

/// The number times `2^by`.
pub(super) fn shifted_left(a: &Number, by: usize) -> Number {
    let mut bits = vec![Lit::FALSE; by];
    bits.extend(a.bits());
    Number::of_bits(bits)
}

/// The number divided by `2^by`, rounded down.
pub(super) fn shifted_right(a: &Number, by: usize) -> Number {
    let last = a.bits().len() - 1;
    Number::of_bits(a.bits()[by.min(last)..].to_vec())
}
