//! Ranges of numbers as functions of some of their bits.

use super::ast::{Expr, ExprId, PldAst};
use std::collections::BTreeMap;

/// A function, or a constant that needs no expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Const(bool),
    Expr(ExprId),
}

/// True for the numbers from `low` to `high`, over these bits; the other bits are free. `low` is at most `high`.
///
/// It is built from the lowest bit up, with one condition for each case in which the lower bits still matter: the higher bits equal those of `low`, of
/// `high`, or of both. The resulting sum has at most two products for each bit, and no redundant one if the bits have no gaps.
pub(crate) fn within(
    draft: &mut PldAst,
    bits: &BTreeMap<u32, ExprId>,
    low: u64,
    high: u64,
) -> ExprId {
    // The conditions on the bits read so far (the lower ones) for a number whose higher bits equal those of the low limit
    // (`above`), of the high limit (`below`), or of both (`both`).
    let (mut above, mut below, mut both) =
        (Part::Const(true), Part::Const(true), Part::Const(true));
    for at in 0..u64::BITS {
        let (is_low_one, is_high_one) = (low >> at & 1 == 1, high >> at & 1 == 1);
        let bit = bits.get(&at).copied();
        let all = Part::Const(true);
        let none = Part::Const(false);
        let (next_above, next_below);
        if is_low_one {
            next_above = branch(draft, bit, none, above);
        } else {
            next_above = branch(draft, bit, above, all);
        }
        if is_high_one {
            next_below = branch(draft, bit, all, below);
        } else {
            next_below = branch(draft, bit, below, none);
        }
        both = match (is_low_one, is_high_one) {
            (false, false) => branch(draft, bit, both, none),
            (true, true) => branch(draft, bit, none, both),
            (false, true) => branch(draft, bit, above, below),
            // This occurs only below the highest bit in which the limits differ, so no number's higher bits equal those of both limits.
            (true, false) => none,
        };
        (above, below) = (next_above, next_below);
    }
    match both {
        Part::Const(value) => draft.expr(Expr::Const(value)),
        Part::Expr(expr) => expr,
    }
}

/// One function if the bit is 0 and another if it is 1; if the bit is not tested, the OR of both.
fn branch(draft: &mut PldAst, bit: Option<ExprId>, zero: Part, one: Part) -> Part {
    let Some(bit) = bit else { return or(draft, zero, one) };
    if zero == one {
        return zero;
    }
    // If one side is always true, the other needs no literal.
    if one == Part::Const(true) {
        return or(draft, Part::Expr(bit), zero);
    }
    let not = Part::Expr(draft.not(bit));
    if zero == Part::Const(true) {
        return or(draft, not, one);
    }
    let (zero, one) = (and(draft, not, zero), and(draft, Part::Expr(bit), one));
    or(draft, zero, one)
}

fn or(draft: &mut PldAst, a: Part, b: Part) -> Part {
    match (a, b) {
        (Part::Const(true), _) | (_, Part::Const(true)) => Part::Const(true),
        (Part::Const(false), other) | (other, Part::Const(false)) => other,
        (Part::Expr(a), Part::Expr(b)) if a == b => Part::Expr(a),
        (Part::Expr(a), Part::Expr(b)) => Part::Expr(draft.list(&[a, b], false)),
    }
}

fn and(draft: &mut PldAst, a: Part, b: Part) -> Part {
    match (a, b) {
        (Part::Const(false), _) | (_, Part::Const(false)) => Part::Const(false),
        (Part::Const(true), other) | (other, Part::Const(true)) => other,
        (Part::Expr(a), Part::Expr(b)) => Part::Expr(draft.list(&[a, b], true)),
    }
}
