//! The maximum of timers, and the type in which ticks are passed.

use crate::cexpr::{CExpr, Class, Prec};
use grafsynth_ir::expr::Type;

/// How `NAME_step` receives the ticks since the last reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ticks {
    /// True if ticks are passed as 16 bits: no timer counts beyond them, and all timers saturate.
    pub(crate) short: bool,
}

impl Ticks {
    /// The C type.
    pub(crate) fn name(self) -> &'static str {
        if self.short { "uint16_t" } else { "uint32_t" }
    }

    /// The largest number of ticks that can be passed; a larger number is passed as this one, which makes no difference.
    pub(crate) fn max(self) -> i64 {
        if self.short { 65535 } else { i64::from(i32::MAX) }
    }

    /// The type for a chart whose largest timer counts to `cap`.
    pub(crate) fn for_cap(cap: i64) -> Self {
        Ticks { short: cap <= 65535 }
    }
}

/// The unsigned type that counts to `cap`: for timers, counters and codes of steps.
pub(crate) fn count_type(cap: i64) -> &'static str {
    if cap <= 0xff {
        "uint8_t"
    } else if cap <= 0xffff {
        "uint16_t"
    } else {
        "uint32_t"
    }
}

/// The value of a timer of [`count_type`], as an exact number.
pub(crate) fn timer_place(text: &str, cap: i64) -> CExpr {
    if cap <= 0xff {
        return CExpr::place(text, Type::Int { lo: 0, hi: cap });
    }
    // Unsigned types of two bytes and more are as wide as `int` on some machines, so their values are widened or made signed at once.
    let class = Class::of(0, cap);
    CExpr::exact(format!("({}){text}", class.name()), Prec::Unary, class, (0, cap))
}

/// A constant of an unsigned type.
pub(crate) fn unsigned(value: i64) -> String {
    if value <= 0xffff { format!("{value}U") } else { format!("{value}UL") }
}
