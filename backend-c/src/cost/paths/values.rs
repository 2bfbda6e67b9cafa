//! The possible values of a number: an interval and, if the interval is small, a bit for each possible value.

/// The maximum number of values that are tracked individually.
pub(in crate::cost) const SPAN: i64 = 256;

/// A set of numbers from `lo` to `hi`. If the interval has at most [`SPAN`] numbers, only those whose bit is set; otherwise all. Only
/// [`Values::NONE`] is empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::cost) struct Values {
    lo: i64,
    hi: i64,
    /// Bit k represents `lo + k`; all zero if the interval is too wide.
    bits: [u64; 4],
}

impl Values {
    /// No number: a state with this value is unreachable.
    pub(in crate::cost) const NONE: Values = Values { lo: 1, hi: 0, bits: [0; 4] };

    pub(in crate::cost) fn one(value: i64) -> Values {
        Values { lo: value, hi: value, bits: [1, 0, 0, 0] }
    }

    pub(in crate::cost) fn range(lo: i64, hi: i64) -> Values {
        if lo > hi {
            return Values::NONE;
        }
        let span = hi.checked_sub(lo).filter(|span| *span < SPAN);
        let bits = span.map_or([0; 4], |span| down([u64::MAX; 4], SPAN - 1 - span));
        Values { lo, hi, bits }
    }

    /// The numbers of a list.
    pub(in crate::cost) fn of(all: impl IntoIterator<Item = i64>) -> Values {
        let mut all: Vec<i64> = all.into_iter().collect();
        all.sort_unstable();
        all.dedup();
        let (Some(lo), Some(hi)) = (all.first().copied(), all.last().copied()) else {
            return Values::NONE;
        };
        let mut bits = [0; 4];
        if hi.checked_sub(lo).is_some_and(|span| span < SPAN) {
            for value in all {
                set(&mut bits, value - lo);
            }
        }
        Values { lo, hi, bits }
    }

    /// The numbers whose bits are set; the first bit represents `lo`.
    fn of_bits(lo: i64, bits: [u64; 4]) -> Values {
        let mut found = Values::NONE;
        for (word, base) in bits.iter().zip((0..SPAN).step_by(64)).filter(|(word, _)| **word != 0) {
            if found.is_none() {
                found.lo = lo + base + i64::from(word.trailing_zeros());
            }
            found.hi = lo + base + i64::from(63 - word.leading_zeros());
        }
        if !found.is_none() {
            found.bits = down(bits, found.lo - lo);
        }
        found
    }

    /// True if the values are tracked individually.
    fn is_listed(self) -> bool {
        self.hi.checked_sub(self.lo).is_some_and(|span| span < SPAN)
    }

    pub(in crate::cost) fn is_none(self) -> bool {
        self.lo > self.hi
    }

    pub(in crate::cost) fn lo(self) -> i64 {
        self.lo
    }

    pub(in crate::cost) fn hi(self) -> i64 {
        self.hi
    }

    /// The value, if there is only one.
    pub(in crate::cost) fn only(self) -> Option<i64> {
        (self.lo == self.hi).then_some(self.lo)
    }

    /// The entries of a table at these indices.
    pub(in crate::cost) fn entries(self, table: &[i64]) -> Values {
        match self.listed() {
            Some(list) => {
                Values::of(list.into_iter().filter_map(|at| {
                    usize::try_from(at).ok().and_then(|at| table.get(at)).copied()
                }))
            }
            None => Values::of(table.iter().copied()),
        }
    }

    /// The values, if there are few enough to track them individually.
    pub(in crate::cost) fn listed(self) -> Option<Vec<i64>> {
        if self.is_none() {
            return Some(Vec::new());
        }
        let span = self.hi.checked_sub(self.lo).filter(|span| *span < SPAN)?;
        Some((0..=span).filter(|at| has(&self.bits, *at)).map(|at| self.lo + at).collect())
    }

    pub(in crate::cost) fn contains(self, value: i64) -> bool {
        if value < self.lo || value > self.hi {
            return false;
        }
        match self.hi.checked_sub(self.lo) {
            Some(span) if span < SPAN => has(&self.bits, value - self.lo),
            Some(_) | None => true,
        }
    }

    /// The union.
    pub(in crate::cost) fn or(self, other: Values) -> Values {
        if self == other || other.is_none() {
            return self;
        }
        if self.is_none() {
            return other;
        }
        let (lo, hi) = (self.lo.min(other.lo), self.hi.max(other.hi));
        if hi.checked_sub(lo).is_some_and(|span| span < SPAN) {
            let mine = up(self.bits, self.lo - lo);
            let theirs = up(other.bits, other.lo - lo);
            let bits = std::array::from_fn(|at| mine[at] | theirs[at]);
            return Values { lo, hi, bits };
        }
        Values { lo, hi, bits: [0; 4] }
    }

    /// The values within an interval.
    pub(in crate::cost) fn within(self, lo: i64, hi: i64) -> Values {
        let (from, to) = (self.lo.max(lo), self.hi.min(hi));
        if from > to {
            return Values::NONE;
        }
        if !self.is_listed() {
            return Values::range(from, to);
        }
        let kept = Values::range(from, to);
        let mask = up(kept.bits, from - self.lo);
        Values::of_bits(self.lo, std::array::from_fn(|at| self.bits[at] & mask[at]))
    }

    /// All values except one.
    pub(in crate::cost) fn without(self, value: i64) -> Values {
        if !self.contains(value) {
            return self;
        }
        if self.is_listed() {
            let mask = up([1, 0, 0, 0], value - self.lo);
            Values::of_bits(self.lo, std::array::from_fn(|at| self.bits[at] & !mask[at]))
        } else if value == self.lo {
            Values::range(self.lo + 1, self.hi)
        } else if value == self.hi {
            Values::range(self.lo, self.hi - 1)
        } else {
            self
        }
    }
}

/// Bits shifted up by this many positions, at least 0.
fn up(bits: [u64; 4], by: i64) -> [u64; 4] {
    let (words, rest) = (usize::try_from(by / 64).unwrap_or(4), by % 64);
    std::array::from_fn(|at| {
        let word = |back: usize| {
            at.checked_sub(words + back).and_then(|at| bits.get(at)).copied().unwrap_or(0)
        };
        if rest == 0 { word(0) } else { word(0) << rest | word(1) >> (64 - rest) }
    })
}

/// The bits shifted down by `by` positions; `by` is not negative.
fn down(bits: [u64; 4], by: i64) -> [u64; 4] {
    let (words, rest) = (usize::try_from(by / 64).unwrap_or(4), by % 64);
    std::array::from_fn(|at| {
        let word = |on: usize| bits.get(at + words + on).copied().unwrap_or(0);
        if rest == 0 { word(0) } else { word(0) >> rest | word(1) << (64 - rest) }
    })
}

fn set(bits: &mut [u64; 4], at: i64) {
    if let Ok(at) = usize::try_from(at)
        && let Some(word) = bits.get_mut(at / 64)
    {
        *word |= 1 << (at % 64);
    }
}

fn has(bits: &[u64; 4], at: i64) -> bool {
    usize::try_from(at)
        .is_ok_and(|at| bits.get(at / 64).is_some_and(|word| word >> (at % 64) & 1 == 1))
}

/// A number type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::cost) struct Kind {
    pub(in crate::cost) bits: u8,
    pub(in crate::cost) signed: bool,
    pub(in crate::cost) is_bool: bool,
}

impl Kind {
    pub(in crate::cost) fn int(bits: u8) -> Kind {
        Kind { bits, signed: true, is_bool: false }
    }

    /// All its values. Unsigned 64-bit numbers above the largest signed one do not occur in emitted text.
    pub(in crate::cost) fn all(self) -> Values {
        let (lo, hi) = self.ends();
        Values::range(lo, hi)
    }

    /// The smallest and the largest of its values.
    fn ends(self) -> (i64, i64) {
        match (self.bits, self.signed) {
            _ if self.is_bool => (0, 1),
            (0..=63, true) => (-(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1),
            (0..=63, false) => (0, (1 << self.bits) - 1),
            (_, true) => (i64::MIN, i64::MAX),
            (_, false) => (0, i64::MAX),
        }
    }

    /// These values converted to the type.
    pub(in crate::cost) fn take(self, values: Values) -> Values {
        let (lo, hi) = self.ends();
        if values.is_none() || (values.lo() >= lo && values.hi() <= hi) {
            return values;
        }
        if self.is_bool {
            return Values::of([0, 1].into_iter().filter(|it| {
                if *it == 0 { values.contains(0) } else { values.only() != Some(0) }
            }));
        }
        match values.listed() {
            Some(listed) if self.bits < 64 => {
                Values::of(listed.into_iter().map(|it| self.wrapped(it)))
            }
            Some(_) | None => Values::range(lo, hi),
        }
    }

    fn wrapped(self, value: i64) -> i64 {
        let low = value & ((1 << self.bits) - 1);
        if self.signed && low >> (self.bits - 1) & 1 == 1 { low - (1 << self.bits) } else { low }
    }
}

/// A number with its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::cost) struct Number {
    pub(in crate::cost) values: Values,
    pub(in crate::cost) kind: Kind,
    /// True for a constant whose suffix was not kept: it may be unsigned.
    pub(in crate::cost) is_loose: bool,
}

impl Number {
    pub(in crate::cost) fn new(values: Values, kind: Kind) -> Number {
        Number { values, kind, is_loose: false }
    }

    pub(in crate::cost) fn truth(values: Values, int_bits: u8) -> Number {
        Number::new(values, Kind::int(int_bits))
    }

    /// A constant, in the smallest signed type from `int` on that contains it.
    pub(in crate::cost) fn literal(value: i64, int_bits: u8) -> Number {
        let fits = |bits: &u8| Kind::int(*bits).all().contains(value);
        let bits = [int_bits, 32].into_iter().find(fits).unwrap_or(64);
        Number { is_loose: value >= 0, ..Number::truth(Values::one(value), bits) }
    }

    /// The number from one of two paths, in the wider type.
    pub(in crate::cost) fn or(self, other: Number) -> Number {
        Number {
            values: self.values.or(other.values),
            kind: if self.kind.bits >= other.kind.bits { self.kind } else { other.kind },
            is_loose: self.is_loose || other.is_loose,
        }
    }

    /// `~`: any value of the promoted type, signed or unsigned.
    pub(in crate::cost) fn complement(self, int_bits: u8) -> Number {
        let kind = if self.kind.bits < int_bits { Kind::int(int_bits) } else { self.kind };
        let unsigned = Kind { signed: false, ..kind }.all();
        Number { values: Values::range(kind.all().lo(), unsigned.hi()), kind, is_loose: true }
    }
}

/// The maximum number of value pairs for which an operator is evaluated one by one.
const PAIRS: usize = 4096;

/// An arithmetic operator.
pub(in crate::cost) fn arithmetic(sign: &str, a: Number, b: Number, int_bits: u8) -> Number {
    let promoted = |it: Number| if it.kind.bits < int_bits { Kind::int(int_bits) } else { it.kind };
    let (left, right) = (promoted(a), promoted(b));
    let kind = match sign {
        "<<" | ">>" => left,
        _ if left.bits != right.bits => {
            if left.bits > right.bits {
                left
            } else {
                right
            }
        }
        _ => Kind { signed: left.signed && right.signed, ..left },
    };
    let is_loose = a.is_loose || b.is_loose;
    let found =
        exact(sign, a.values, b.values).unwrap_or_else(|| wide(sign, a.values, b.values, kind));
    let (least, most) = kind.ends();
    let (_, most_unsigned) = Kind { signed: false, ..kind }.ends();
    let values = if found.lo() >= least && found.hi() <= most {
        found
    } else if is_loose || kind.signed {
        // Either signedness is possible: the smaller of the minimums and the larger of the maximums.
        Values::range(least, most_unsigned.max(most))
    } else {
        kind.take(found)
    };
    let values = if is_loose && values.lo() < 0 {
        values.or(Values::range(values.lo(), most_unsigned))
    } else {
        values
    };
    Number { values, kind, is_loose: is_loose && a.kind.bits <= kind.bits }
}

fn exact(sign: &str, a: Values, b: Values) -> Option<Values> {
    if let (Some(a), Some(b)) = (a.only(), b.only()) {
        return one(sign, a, b).map(Values::one);
    }
    let (left, right) = (a.listed()?, b.listed()?);
    if left.len().saturating_mul(right.len()) > PAIRS {
        return None;
    }
    let mut all = Vec::with_capacity(left.len() * right.len());
    for a in &left {
        for b in &right {
            all.push(one(sign, *a, *b)?);
        }
    }
    Some(Values::of(all))
}

fn one(sign: &str, a: i64, b: i64) -> Option<i64> {
    match sign {
        "+" => a.checked_add(b),
        "-" => a.checked_sub(b),
        "*" => a.checked_mul(b),
        "/" => {
            if b == 0 {
                Some(0)
            } else {
                a.checked_div(b)
            }
        }
        "%" => {
            if b == 0 {
                Some(0)
            } else {
                a.checked_rem(b)
            }
        }
        "&" => Some(a & b),
        "|" => Some(a | b),
        "^" => Some(a ^ b),
        "<<" => i64::checked_shl(a, u32::try_from(b).ok()?).filter(|it| b < 62 && it >> b == a),
        ">>" => i64::checked_shr(a, u32::try_from(b).ok()?),
        _ => None,
    }
}

/// The result computed from the ends of the intervals.
fn wide(sign: &str, a: Values, b: Values, kind: Kind) -> Values {
    let ends = |find: &dyn Fn(i64, i64) -> Option<i64>| {
        let all: Option<Vec<i64>> =
            [(a.lo(), b.lo()), (a.lo(), b.hi()), (a.hi(), b.lo()), (a.hi(), b.hi())]
                .into_iter()
                .map(|(a, b)| find(a, b))
                .collect();
        let all = all?;
        Some(Values::range(all.iter().copied().min()?, all.iter().copied().max()?))
    };
    let both_positive = a.lo() >= 0 && b.lo() >= 0;
    let top = |it: i64| {
        it.checked_add(1)
            .and_then(|it| it.cast_unsigned().checked_next_power_of_two())
            .map_or(i64::MAX, |it| it.cast_signed().saturating_sub(1))
    };
    let found = match sign {
        "+" | "-" | "*" => ends(&|a, b| one(sign, a, b)),
        "/" if b.lo() > 0 => ends(&|a, b| one("/", a, b)),
        "%" if b.lo() > 0 && a.lo() >= 0 => Some(Values::range(0, a.hi().min(b.hi() - 1))),
        "%" if b.lo() > 0 => Some(Values::range(1 - b.hi(), b.hi() - 1)),
        "&" if both_positive => Some(Values::range(0, a.hi().min(b.hi()))),
        "&" if a.lo() >= 0 => Some(Values::range(0, a.hi())),
        "&" if b.lo() >= 0 => Some(Values::range(0, b.hi())),
        "|" if both_positive => Some(Values::range(a.lo().max(b.lo()), top(a.hi().max(b.hi())))),
        "^" if both_positive => Some(Values::range(0, top(a.hi().max(b.hi())))),
        "<<" if both_positive && b.hi() < 62 => ends(&|a, b| one("<<", a, b)),
        ">>" if both_positive => {
            Some(Values::range(a.lo() >> b.hi().min(62), a.hi() >> b.lo().min(62)))
        }
        _ => None,
    };
    found.unwrap_or_else(|| {
        let all = kind.all();
        Values::range(all.lo(), Kind { signed: false, ..kind }.all().hi().max(all.hi()))
    })
}

/// The possible results of a comparison: 1, 0 or both.
pub(in crate::cost) fn compared(sign: &str, a: Values, b: Values) -> Values {
    let (mut yes, mut no) = (true, true);
    match sign {
        "==" | "!=" => {
            let is_apart = a.hi() < b.lo()
                || b.hi() < a.lo()
                || match (a.only(), b.only()) {
                    (Some(one), _) => !b.contains(one),
                    (_, Some(one)) => !a.contains(one),
                    (None, None) => false,
                };
            let is_same = a.only().is_some() && a.only() == b.only();
            (yes, no) = if sign == "==" { (!is_apart, !is_same) } else { (!is_same, !is_apart) };
        }
        "<" => (yes, no) = (a.lo() < b.hi(), a.hi() >= b.lo()),
        "<=" => (yes, no) = (a.lo() <= b.hi(), a.hi() > b.lo()),
        ">" => (yes, no) = (a.hi() > b.lo(), a.lo() <= b.hi()),
        ">=" => (yes, no) = (a.hi() >= b.lo(), a.lo() < b.hi()),
        _ => {}
    }
    Values::of([0, 1].into_iter().filter(|it| if *it == 1 { yes } else { no }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of every operator on sets contains its result for each pair of members.
    #[test]
    fn operators_hold_every_pair() {
        let sets = [
            Values::of([0, 3, 7]),
            Values::range(0, 255),
            Values::range(-5, 5),
            Values::range(0, 60_000),
            Values::one(1),
            Values::of([2, 200]),
            Values::range(-30_000, 30_000),
        ];
        for bits in [16, 32] {
            for sign in ["+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>"] {
                for a in sets {
                    for b in sets {
                        let number = |it| Number::new(it, Kind::int(32));
                        let found = arithmetic(sign, number(a), number(b), bits).values;
                        for x in [a.lo(), a.hi(), a.lo() + (a.hi() - a.lo()) / 3] {
                            for y in [b.lo(), b.hi()] {
                                if !a.contains(x)
                                    || !b.contains(y)
                                    || (matches!(sign, "<<" | ">>") && !(0..31).contains(&y))
                                    || (matches!(sign, "/" | "%") && y == 0)
                                {
                                    continue;
                                }
                                let value = one(sign, x, y).filter(|it| i32::try_from(*it).is_ok());
                                assert!(
                                    value.is_none_or(|it| found.contains(it)),
                                    "{x} {sign} {y} in {found:?}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn sets_join_and_narrow() {
        // Shifts compared with lists, including shifts across word boundaries.
        let sets = [
            vec![0, 3, 7],
            vec![-5, 58, 59, 60, 123],
            vec![100, 164, 228, 250],
            (-70..=130).collect(),
            vec![63],
            vec![64, 300],
        ];
        let all = |list: &[i64]| Values::of(list.iter().copied());
        for a in &sets {
            for b in &sets {
                let joined = all(&[a.as_slice(), b].concat());
                assert_eq!(all(a).or(all(b)), joined, "{a:?} {b:?}");
            }
            for (lo, hi) in [(-100, 400), (0, 64), (59, 60), (64, 200), (7, 7), (250, 90)] {
                let kept: Vec<i64> =
                    a.iter().copied().filter(|it| (lo..=hi).contains(it)).collect();
                assert_eq!(all(a).within(lo, hi), all(&kept), "{a:?} {lo} {hi}");
            }
            for out in [-70, 3, 60, 64, 250] {
                let kept: Vec<i64> = a.iter().copied().filter(|it| *it != out).collect();
                assert_eq!(all(a).without(out), all(&kept), "{a:?} {out}");
            }
        }
        let all = Values::of([1, 5]).or(Values::one(900));
        assert!(all.contains(5) && all.contains(900) && all.listed().is_none());
        assert_eq!(Values::of([1, 5, 9]).within(2, 9).listed(), Some(vec![5, 9]));
        assert_eq!(Values::of([1, 5]).without(1), Values::one(5));
        assert_eq!(compared("==", Values::of([1, 5]), Values::one(3)), Values::one(0));
        assert_eq!(compared("<", Values::range(0, 9), Values::one(5)), Values::range(0, 1));
    }
}
