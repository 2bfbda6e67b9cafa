//! Bit operators: `& | ^ ~ << >>` on unsigned operands.
//!
//! C leaves bit operators on signed numbers to the implementation, and MISRA-C:2012 forbids them (rule 10.1). So operands are unsigned *words*: a place that
//! is stored unsigned is used as it is, and any other operand is cast to the unsigned type that contains it. A result is compared and stored as a word
//! (`(n & 15U) == 3U`); for arithmetic it is cast to the signed class of its interval.
//!
//! ```text
//! n band 15        n & 15U                                  n is a byte
//! x band 15        (uint16_t)x & 15U                        x is an int16_t
//! n band bnot m    n & (uint8_t)~m
//! x shr 2          (int)(uint8_t)((uint8_t)(int)((int)x + 8) >> 2U) - 2      x is in -8..7
//! ```
//! If an operand can be negative, it is cast to the unsigned type as wide as the class that contains both operands; C defines the result as the low bits of the
//! two's complement. A negative result is converted back: C leaves that conversion to the implementation, and all compilers keep the bits.

use super::arith::sign;
use super::{CExpr, Class, Prec};
use grafsynth_ir::expr::ArithOp;
use grafsynth_ir::interval;

/// An expression whose essential type is unsigned, with the exact value of a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Word {
    text: String,
    /// The width of its type: 8, 16, 32 or 64.
    n_bits: u32,
    /// Whether it is the result of an operator, which must not be converted to a wider type directly (MISRA-C:2012, rules 10.6 to 10.8).
    is_composite: bool,
}

/// Known facts about the bits of a number, in addition to its signed spelling.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Bits {
    /// The number is a word.
    Word(Word),
    /// The number is the complement of this one.
    ComplementOf(CExpr),
    /// The number is the first word, which is the second word with its sign bit inverted.
    Flipped(Word, Word),
    /// The number is a word that is read in two's complement.
    Signed(Word),
}

/// The largest numbers of the unsigned types. A mask with such a number is written as a cast.
const TYPES: [i64; 3] = [0xff, 0xffff, 0xffff_ffff];

/// The width of the smallest unsigned type for `0..=most`.
fn unsigned_bits(most: i64) -> u32 {
    match most {
        ..=0xff => 8,
        0x100..=0xffff => 16,
        0x1_0000..=0xffff_ffff => 32,
        _ => 64,
    }
}

/// The width of the class that contains `lo..hi`.
fn signed_bits(lo: i64, hi: i64) -> u32 {
    match Class::of(lo, hi) {
        Class::Bool | Class::Int => 16,
        Class::Wide => 32,
        Class::Huge => 64,
    }
}

impl Word {
    pub(super) fn place(text: &str, n_bits: u32) -> Self {
        Word { text: text.to_owned(), n_bits, is_composite: false }
    }

    fn composite(text: String, n_bits: u32) -> Self {
        Word { text, n_bits, is_composite: true }
    }

    fn literal(value: u64, n_bits: u32) -> Self {
        let text = match value {
            ..=0xffff => format!("{value}U"),
            0x1_0000..=0xffff_ffff => format!("UINT32_C({value})"),
            _ => format!("UINT64_C({value})"),
        };
        Word { text, n_bits, is_composite: false }
    }

    /// The text as an operand.
    fn operand(&self) -> String {
        if self.is_composite { format!("({})", self.text) } else { self.text.clone() }
    }

    /// Converted to a type, whose width is given if it is unsigned; a composite is converted to its own type before it is converted to a wider or signed one.
    pub(super) fn converted(&self, name: &str, unsigned_bits: Option<u32>) -> String {
        if !self.is_composite && unsigned_bits == Some(self.n_bits) {
            return self.text.clone();
        }
        let is_narrowed = unsigned_bits.is_some_and(|n_bits| n_bits <= self.n_bits);
        if self.is_composite && !is_narrowed {
            format!("({name})(uint{}_t){}", self.n_bits, self.operand())
        } else {
            format!("({name}){}", self.operand())
        }
    }

    /// The same value in an unsigned type of exactly `n_bits`.
    fn resized(self, n_bits: u32) -> Word {
        if self.n_bits == n_bits {
            return self;
        }
        let text = self.converted(&format!("uint{n_bits}_t"), Some(n_bits));
        Word { text, n_bits, is_composite: false }
    }

    /// Two operands; the narrower one is widened if it is composite.
    fn paired(a: Word, b: Word) -> (Word, Word) {
        let n_bits = a.n_bits.max(b.n_bits);
        let wide = |word: Word| if word.is_composite { word.resized(n_bits) } else { word };
        (wide(a), wide(b))
    }

    fn joined(a: Word, sign: &str, b: Word) -> Word {
        let (a, b) = Word::paired(a, b);
        Word::composite(format!("{} {sign} {}", a.operand(), b.operand()), a.n_bits.max(b.n_bits))
    }
}

impl CExpr {
    /// The number as a word, if it is one without a cast.
    pub(super) fn as_word(&self) -> Option<Word> {
        match self.bits.as_deref() {
            Some(Bits::Word(word) | Bits::Flipped(word, _)) => Some(word.clone()),
            Some(Bits::ComplementOf(_) | Bits::Signed(_)) | None
                if self.is_unsigned && self.prec == Prec::Atom =>
            {
                Some(Word::place(&self.text, 8))
            }
            Some(Bits::ComplementOf(_) | Bits::Signed(_)) | None => {
                let value = u64::try_from(self.constant()?).ok()?;
                Some(Word::literal(value, unsigned_bits(self.hi)))
            }
        }
    }

    /// The words of both numbers, if one is the result of a bit operator and both can be compared as words.
    pub(super) fn compared_as_words(a: &CExpr, b: &CExpr) -> Option<(String, String)> {
        let (a, b) = (a.as_word()?, b.as_word()?);
        (a.is_composite || b.is_composite).then(|| {
            let (a, b) = Word::paired(a, b);
            (a.operand(), b.operand())
        })
    }

    /// The `n_bits` low bits of the two's complement. A word that is narrower stays as it is.
    fn low_bits(&self, n_bits: u32) -> Word {
        if let Some(value) = self.constant() {
            return Word::literal(value.cast_unsigned() & (u64::MAX >> (64 - n_bits)), n_bits);
        }
        if let Some(word) = self.as_word() {
            return if word.n_bits <= n_bits { word } else { word.resized(n_bits) };
        }
        if let Some(Bits::Signed(word)) = self.bits.as_deref()
            && word.n_bits >= n_bits
        {
            return word.clone().resized(n_bits);
        }
        let name = format!("uint{n_bits}_t");
        if let Some(Bits::ComplementOf(inner)) = self.bits.as_deref() {
            let inner = inner.low_bits(n_bits).resized(n_bits);
            let text = format!("({name})~{}", inner.operand());
            return Word { text, n_bits, is_composite: false };
        }
        let text = self.converted(&name);
        Word { text, n_bits, is_composite: false }
    }

    /// The number as a word with its exact value; it must not be negative.
    fn exact_word(&self) -> Word {
        self.as_word().unwrap_or_else(|| self.low_bits(unsigned_bits(self.hi)))
    }

    /// The number within `lo..hi` with this word as its exact value, or as its low bits.
    fn of_word(word: Word, (lo, hi): (i64, i64)) -> CExpr {
        let class = Class::of(lo, hi);
        if lo < 0 {
            let n_bits = word.n_bits;
            let text = word.converted(&format!("int{n_bits}_t"), None);
            let signed = (class == Class::Int).then(|| (format!("(int){text}"), Prec::Unary));
            let bits = Some(Box::new(Bits::Signed(word)));
            return CExpr { signed, bits, ..CExpr::exact(text, Prec::Unary, class, (lo, hi)) };
        }
        let signed = word.converted(class.name(), None);
        CExpr {
            bits: Some(Box::new(Bits::Word(word))),
            ..CExpr::exact(signed, Prec::Unary, class, (lo, hi))
        }
    }

    /// A bit operator whose result is in `lo..hi` and is not a constant.
    pub(super) fn bitwise(op: ArithOp, a: CExpr, b: CExpr, (lo, hi): (i64, i64)) -> CExpr {
        if let Some(same) = CExpr::unchanged(op, &a, &b) {
            return same;
        }
        match op {
            ArithOp::BitAnd if TYPES.contains(&hi) && b.constant() == Some(hi) => {
                // The mask of a type.
                let n_bits = unsigned_bits(hi);
                CExpr::of_word(a.low_bits(n_bits).resized(n_bits), (lo, hi))
            }
            ArithOp::BitAnd if a.lo >= 0 || b.lo >= 0 => {
                // The other operand is needed only where the operand that is not negative can have ones.
                let most = |it: &CExpr| if it.lo >= 0 { it.hi } else { i64::MAX };
                let n_bits = unsigned_bits(most(&a).min(most(&b)));
                let word =
                    |it: &CExpr| if it.lo >= 0 { it.exact_word() } else { it.low_bits(n_bits) };
                CExpr::of_word(Word::joined(word(&a), "&", word(&b)), (lo, hi))
            }
            ArithOp::BitXor if b.constant() == Some(-1) => {
                let bits = Some(Box::new(Bits::ComplementOf(a.clone())));
                CExpr { bits, ..CExpr::arith(ArithOp::Sub, CExpr::int(-1), a) }
            }
            ArithOp::BitXor
                if a.lo == 0 && b.constant() == Some(a.hi / 2 + 1) && TYPES.contains(&a.hi) =>
            {
                let (of, sign) = (a.exact_word(), b.exact_word());
                let result = CExpr::of_word(Word::joined(of.clone(), "^", sign), (lo, hi));
                let flipped = result.as_word().map(|word| Box::new(Bits::Flipped(word, of)));
                CExpr { bits: flipped, ..result }
            }
            ArithOp::Shl => CExpr::shifted_left(a, &b, (lo, hi)),
            ArithOp::Shr => CExpr::shifted_right(a, &b, (lo, hi)),
            ArithOp::BitAnd | ArithOp::BitOr | ArithOp::BitXor => {
                CExpr::joined(&a, sign(op), &b, (lo, hi))
            }
            ArithOp::Add | ArithOp::Sub | ArithOp::Mul | ArithOp::Div | ArithOp::Mod => {
                unreachable!("`arith` handles these")
            }
        }
    }

    fn joined(a: &CExpr, sign: &str, b: &CExpr, (lo, hi): (i64, i64)) -> CExpr {
        if a.lo >= 0 && b.lo >= 0 {
            return CExpr::of_word(Word::joined(a.exact_word(), sign, b.exact_word()), (lo, hi));
        }
        let n_bits = signed_bits(a.lo.min(b.lo).min(lo), a.hi.max(b.hi).max(hi));
        let word = Word::joined(a.low_bits(n_bits), sign, b.low_bits(n_bits));
        CExpr::of_word(word, (lo, hi))
    }

    /// `(low bits bxor sign bit) - sign bit`, which reads the low bits in two's complement: a cast.
    pub(super) fn sign_extended(a: &CExpr, b: &CExpr) -> Option<CExpr> {
        let Some(Bits::Flipped(_, word)) = a.bits.as_deref() else { return None };
        let sign = a.hi / 2 + 1;
        let word = word.clone().resized(unsigned_bits(a.hi));
        (b.constant() == Some(sign)).then(|| CExpr::of_word(word, (-sign, sign - 1)))
    }

    /// Whether the number already has the type of this width.
    pub(super) fn is_signed_word(&self, n_bits: u32) -> bool {
        matches!(self.bits.as_deref(), Some(Bits::Signed(word)) if word.n_bits == n_bits)
    }

    /// The result of an operation that changes nothing.
    fn unchanged(op: ArithOp, a: &CExpr, b: &CExpr) -> Option<CExpr> {
        let is_mask = |it: &CExpr, of: &CExpr| {
            it.constant().is_some_and(|mask| {
                mask == -1 || of.lo >= 0 && mask >= of.hi && mask & mask.wrapping_add(1) == 0
            })
        };
        let is_zero = |it: &CExpr| it.constant() == Some(0);
        match op {
            ArithOp::BitAnd | ArithOp::BitOr if a.text == b.text => Some(a.clone()),
            ArithOp::BitXor if a.text == b.text => Some(CExpr::int(0)),
            ArithOp::BitAnd if is_mask(b, a) => Some(a.clone()),
            ArithOp::BitAnd if is_mask(a, b) => Some(b.clone()),
            ArithOp::BitOr | ArithOp::BitXor if is_zero(a) => Some(b.clone()),
            ArithOp::BitOr | ArithOp::BitXor | ArithOp::Shl | ArithOp::Shr if is_zero(b) => {
                Some(a.clone())
            }
            ArithOp::Add
            | ArithOp::Sub
            | ArithOp::Mul
            | ArithOp::Div
            | ArithOp::Mod
            | ArithOp::BitAnd
            | ArithOp::BitOr
            | ArithOp::BitXor
            | ArithOp::Shl
            | ArithOp::Shr => None,
        }
    }

    fn shifted_left(a: CExpr, by: &CExpr, (lo, hi): (i64, i64)) -> CExpr {
        if a.lo >= 0 {
            // The type of the left operand must contain the result.
            let n_bits = unsigned_bits(hi);
            let word = a.exact_word().resized(n_bits);
            return CExpr::of_word(word.shifted("<<", by), (lo, hi));
        }
        // Some compilers lack products of 64 bits.
        if let Some(by @ 0..=62) = by.constant()
            && Class::of(lo, hi) < Class::Huge
        {
            return CExpr::arith(ArithOp::Mul, a, CExpr::int(1 << by));
        }
        let n_bits = signed_bits(a.lo.min(lo), a.hi.max(hi));
        let word = a.low_bits(n_bits).resized(n_bits);
        CExpr::of_word(word.shifted("<<", by).cast(), (lo, hi))
    }

    fn shifted_right(a: CExpr, by: &CExpr, (lo, hi): (i64, i64)) -> CExpr {
        let wider_than = |most: i64| match most {
            ..8 => 8,
            8..16 => 16,
            16..32 => 32,
            _ => 64,
        };
        if a.lo >= 0 {
            let word = a.exact_word();
            let n_bits = word.n_bits.max(wider_than(by.hi));
            return CExpr::of_word(word.resized(n_bits).shifted(">>", by), (lo, hi));
        }
        // A multiple of the divisor is added, so that the number is not negative, and its quotient is subtracted.
        if let Some(by_constant @ 0..=62) = by.constant()
            && let Some(lift) = (-(a.lo >> by_constant)).checked_mul(1 << by_constant)
            && let Some((least, most)) = interval::arith(ArithOp::Add, (a.lo, a.hi), (lift, lift))
            && Class::of(least, most) <= a.class
        {
            let lifted = CExpr::arith(ArithOp::Add, a, CExpr::int(lift));
            let quotient = CExpr::arith(ArithOp::Shr, lifted, by.clone());
            return CExpr::arith(ArithOp::Sub, quotient, CExpr::int(lift >> by_constant));
        }
        // The same with the weight of the sign bit as the addend, modulo 2^n.
        let n_bits = signed_bits(a.lo, a.hi).max(wider_than(by.hi));
        let sign = Word::literal(1 << (n_bits - 1), n_bits);
        let lifted = Word::joined(a.low_bits(n_bits).resized(n_bits), "^", sign.clone());
        let lifted = lifted.cast();
        let sign = sign.cast();
        let difference = Word::joined(lifted.shifted(">>", by), "-", sign.shifted(">>", by));
        CExpr::of_word(difference.cast(), (lo, hi))
    }
}

impl Word {
    /// Cast to its own type, so that it is not composite and an operator does not promote it to another type.
    fn cast(self) -> Word {
        let text = format!("(uint{}_t){}", self.n_bits, self.operand());
        Word { text, is_composite: false, ..self }
    }

    fn shifted(self, sign: &str, by: &CExpr) -> Word {
        let text = format!("{} {sign} {}", self.operand(), by.exact_word().operand());
        Word::composite(text, self.n_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::var;
    use super::*;
    use grafsynth_ir::expr::{CompareOp, Type};

    fn text(op: ArithOp, a: CExpr, b: CExpr) -> String {
        let result = CExpr::arith(op, a, b);
        result.as_word().map_or(result.text, |word| word.text)
    }

    #[test]
    fn operands_are_unsigned() {
        let (n, m) = (|| var("n", 0, 255), || var("m", 0, 255));
        let (x, u, w) = (|| var("x", -300, 300), || var("u", 0, 65535), || var("w", 0, 1_000_000));
        let int = CExpr::int;
        for (op, a, b, expected) in [
            (ArithOp::BitAnd, n(), int(15), "n & 15U"),
            (ArithOp::BitAnd, n(), int(-16), "n & 240U"),
            (ArithOp::BitAnd, n(), int(255), "n"),
            (ArithOp::BitOr, n(), m(), "n | m"),
            (ArithOp::BitXor, n(), u(), "n ^ u"),
            (ArithOp::BitAnd, x(), int(15), "(uint8_t)x & 15U"),
            (ArithOp::BitAnd, w(), int(0xffff), "(uint16_t)w"),
            (ArithOp::BitOr, x(), int(1), "(int16_t)(uint16_t)((uint16_t)x | 1U)"),
            (ArithOp::BitXor, x(), int(-1), "-1 - (int)x"),
            (ArithOp::Shl, n(), int(3), "(uint16_t)n << 3U"),
            (ArithOp::Shl, int(1), var("k", 0, 31), "(uint32_t)1U << k"),
            (ArithOp::Shl, x(), int(3), "(int)x * 8"),
            (ArithOp::Shr, n(), int(3), "n >> 3U"),
            (
                ArithOp::Shr,
                var("y", -8, 7),
                int(2),
                "(int)(uint8_t)((uint8_t)(int)((int)y + 8) >> 2U) - 2",
            ),
        ] {
            assert_eq!(text(op, a, b), expected);
        }
        let low = CExpr::arith(ArithOp::BitAnd, w(), int(0xffff));
        let flipped = CExpr::arith(ArithOp::BitXor, low, int(0x8000));
        assert_eq!(text(ArithOp::Sub, flipped, int(0x8000)), "(int16_t)(uint16_t)w");
        let mask = CExpr::arith(ArithOp::BitXor, m(), int(-1));
        assert_eq!(text(ArithOp::BitAnd, n(), mask), "n & (uint8_t)~m");
    }

    #[test]
    fn results_are_compared_and_stored_as_words() {
        let low = || CExpr::arith(ArithOp::BitAnd, var("n", 0, 255), CExpr::int(15));
        assert_eq!(CExpr::compare(CompareOp::Eq, low(), CExpr::int(3)).text, "(n & 15U) == 3U");
        assert_eq!(low().stored_as(Type::Int { lo: 0, hi: 15 }), "(uint8_t)(n & 15U)");
        assert_eq!(low().stored_as(Type::Int { lo: 0, hi: 999 }), "(int16_t)(uint8_t)(n & 15U)");
        let sum = CExpr::arith(ArithOp::Add, low(), var("x", -3, 3));
        assert_eq!(sum.text, "(int)(uint8_t)(n & 15U) + (int)x");
    }
}
