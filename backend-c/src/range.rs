//! The value ranges of the instance members: a style defines them, and the check of the safe state uses them.

use crate::cexpr::CExpr;
use crate::times::unsigned;

/// The value range of an instance member; for an array, of each element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Range {
    /// The member's name in the instance.
    pub(crate) name: String,
    /// Its C type.
    pub(crate) ty: &'static str,
    /// The first element of an array and the end of its elements (exclusive); `None` for members that are not arrays.
    pub(crate) elements: Option<(u32, u32)>,
    /// The minimum value.
    pub(crate) lo: i64,
    /// The maximum value.
    pub(crate) hi: i64,
    /// True if it counts the events in a queue.
    pub(crate) is_count: bool,
}

impl Range {
    /// The range of a member that is not an array.
    pub(crate) fn of(name: String, ty: &'static str, lo: i64, hi: i64) -> Self {
        Range { name, ty, elements: None, lo, hi, is_count: false }
    }

    /// The C type and the maximum value of the member, if the bitwise OR of several such members shows whether one of them exceeds this
    /// value.
    pub(crate) fn union(&self) -> Option<(&'static str, i64)> {
        let (least, largest) = bounds(self.ty);
        let is_mask =
            self.hi >= 0 && self.hi.checked_add(1).is_some_and(|next| next & self.hi == 0);
        let ty = if self.ty == "bool" { "uint8_t" } else { self.ty };
        (least == 0 && self.lo == 0 && self.hi < largest && is_mask).then_some((ty, self.hi))
    }

    /// The member, or its element at `index`, as a number.
    pub(crate) fn value(&self, index: &str) -> String {
        let place = match self.elements {
            Some(_) => format!("self->{}[{index}]", self.name),
            None => format!("self->{}", self.name),
        };
        // A corrupt `bool` may be neither 0 nor 1, so it is read as a byte.
        if self.ty == "bool" { format!("*(const volatile uint8_t *)&{place}") } else { place }
    }

    /// The conditions under which `value` is out of range; empty if the type has no values outside the range.
    pub(crate) fn broken(&self, value: &str) -> Vec<String> {
        let (least, largest) = bounds(self.ty);
        let literal = |value: i64| {
            if least == 0 { unsigned(value) } else { CExpr::int(value).text }
        };
        let below = (self.lo > least).then(|| format!("{value} < {}", literal(self.lo)));
        let above = (self.hi < largest).then(|| match self.hi {
            0 if least == 0 => format!("{value} != 0U"),
            hi => format!("{value} > {}", literal(hi)),
        });
        below.into_iter().chain(above).collect()
    }
}

/// The minimum and maximum value of an integer type of C; `bool` as its byte in memory.
fn bounds(ty: &str) -> (i64, i64) {
    match ty {
        "bool" | "uint8_t" => (0, 0xff),
        "int8_t" => (-0x80, 0x7f),
        "int16_t" => (-0x8000, 0x7fff),
        "uint16_t" => (0, 0xffff),
        "int32_t" => (i64::from(i32::MIN), i64::from(i32::MAX)),
        "uint32_t" => (0, i64::from(u32::MAX)),
        "int64_t" => (i64::MIN, i64::MAX),
        other => unreachable!("no member has the type {other}"),
    }
}
