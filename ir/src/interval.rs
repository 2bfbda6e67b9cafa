//! Static types: the interval of each expression, by exact arithmetic.
//!
//! semantics.md §6: expressions are exact integers. An expression is rejected if its interval exceeds 64 bits, if the interval of a divisor contains 0, or
//! if an index can be outside its array. All code that emits arithmetic chooses its machine type with [`type_of`], so all engines agree on when a value
//! fits.
//!
//! The interval of an operator depends only on the intervals of its operands: the result is the hull of all values that independent operands can give. The
//! interval of a `select` is the hull of both branches, for any condition.

use crate::arena::Arena;
use crate::expr::{ArithOp, CompareOp, Expr, ExprKind, LARGEST_SHIFT, Type};
use crate::net::{Leaf, Net, PropertyLeaf};
use crate::span::Span;
use std::fmt;

/// The depth limit of expressions: the limit of the chart language plus room for what a lowering adds.
pub const DEPTH_LIMIT: usize = 320;

/// The type of a tick count (`s.t`, a free timer) before it is narrowed to the constants it is compared with.
pub const TICKS: Type = Type::Int { lo: 0, hi: u32::MAX as i64 };

/// The longest time in a comparison, in ticks: a counter that saturates one above it still fits in 31 bits.
pub const LONGEST: i64 = i32::MAX as i64 - 1;

/// Why an expression has no type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypeError {
    /// The smallest faulty expression.
    pub span: Span,
    /// The kind of error.
    pub kind: TypeErrorKind,
}

/// The kinds of type errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TypeErrorKind {
    /// A number is used where a Boolean is needed.
    BoolExpected {
        /// Smallest value of the number.
        lo: i64,
        /// Largest value of the number.
        hi: i64,
    },
    /// A Boolean is used where a number is needed.
    IntExpected,
    /// One operand of a comparison or choice is Boolean and the other is a number.
    Mixed,
    /// For some operand values the result exceeds 64 bits.
    Overflow64 {
        /// The operator's symbol.
        operator: &'static str,
        /// Exact lower bound.
        lo: i128,
        /// Exact upper bound.
        hi: i128,
    },
    /// The interval of a divisor contains 0.
    DivisorMayBeZero {
        /// Smallest value of the divisor.
        lo: i64,
        /// Largest value of the divisor.
        hi: i64,
    },
    /// The interval of the amount of a shift is not within `0..=63`.
    ShiftOutOfRange {
        /// Smallest amount.
        lo: i64,
        /// Largest amount.
        hi: i64,
    },
    /// The interval of an index is not within `0..len`.
    IndexOutOfArray {
        /// Smallest value of the index.
        lo: i64,
        /// Largest value of the index.
        hi: i64,
        /// The number of elements of the array.
        len: u32,
    },
    /// An array is read without an index.
    ArrayWithoutIndex,
    /// A value that is not an array has an index.
    NotAnArray,
    /// A duration is used other than in a comparison with a constant.
    DurationAlone,
    /// A duration is compared with a constant below 0.
    DurationNegative {
        /// The constant.
        constant: i64,
    },
    /// The leaf refers to an object that does not exist (an id beyond its arena).
    Dangling,
    /// A duration is compared with a constant that a tick counter cannot reach.
    DurationTooLong {
        /// The constant.
        constant: i64,
    },
    /// The leaf may not be read at this place.
    NotReadableHere {
        /// The value that is read, in the user's terms.
        what: &'static str,
        /// The place where it is read, in the user's terms.
        place: &'static str,
    },
    /// The expression has more than [`DEPTH_LIMIT`] levels.
    TooDeep,
}

impl fmt::Display for TypeErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TypeErrorKind::BoolExpected { lo, hi } if lo == hi => {
                write!(f, "expected a Boolean, found the number {lo}")
            }
            TypeErrorKind::BoolExpected { lo, hi } => {
                write!(f, "expected a Boolean, found a number ({lo}..{hi})")
            }
            TypeErrorKind::IntExpected => f.write_str("expected a number, found a Boolean"),
            TypeErrorKind::Mixed => f.write_str("one side is a number, the other is a Boolean"),
            TypeErrorKind::Overflow64 { operator, lo, hi } => {
                let result = values(*lo, *hi);
                write!(f, "the result of `{operator}` is {result}, which exceeds 64 bits")
            }
            TypeErrorKind::DivisorMayBeZero { lo: 0, hi: 0 } => f.write_str("the divisor is 0"),
            TypeErrorKind::DivisorMayBeZero { lo, hi } => {
                write!(f, "the divisor can be 0 (its range is {lo}..{hi})")
            }
            TypeErrorKind::ShiftOutOfRange { lo, hi } => {
                write!(
                    f,
                    "the amount of the shift is {}, but the limits are 0 and 63",
                    values(*lo, *hi)
                )
            }
            TypeErrorKind::IndexOutOfArray { lo, hi, len } => {
                write!(
                    f,
                    "the index is {}, but the array has elements 0..{}",
                    values(*lo, *hi),
                    i64::from(*len) - 1
                )
            }
            TypeErrorKind::ArrayWithoutIndex => f.write_str("an array is read without an index"),
            TypeErrorKind::NotAnArray => f.write_str("only an array has an index"),
            TypeErrorKind::DurationAlone => {
                f.write_str("a time can only be compared with a constant")
            }
            TypeErrorKind::DurationNegative { constant } => {
                write!(f, "a time is compared with {constant}, but a time is never negative")
            }
            TypeErrorKind::Dangling => {
                f.write_str("this reads an object that the net does not contain")
            }
            TypeErrorKind::DurationTooLong { constant } => {
                write!(f, "a time is compared with {constant} ticks; the limit is {LONGEST}")
            }
            TypeErrorKind::NotReadableHere { what, place } => {
                write!(f, "{what} cannot be read in {place}")
            }
            TypeErrorKind::TooDeep => {
                write!(f, "the expression has more than {DEPTH_LIMIT} levels")
            }
        }
    }
}

/// The values from `lo` to `hi`, as in "is 5" or "is in 0..5".
pub(crate) fn values<T: fmt::Display + PartialEq>(lo: T, hi: T) -> String {
    if lo == hi { lo.to_string() } else { format!("in {lo}..{hi}") }
}

/// Advice on an index from `lo` to `hi` that can be outside its array.
pub(crate) fn index_help(lo: i64, hi: i64) -> &'static str {
    if lo == hi {
        "use an index of the array"
    } else if lo < 0 {
        "declare the index with the range of the array"
    } else {
        "declare the index with the range of the array, or use the index `mod` the number of elements"
    }
}

impl TypeErrorKind {
    /// Advice on how to correct the error, if there is general advice.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            TypeErrorKind::BoolExpected { .. } => Some(
                "compare it with a number, for example `n > 0`; the constants are `true` and `false`",
            ),
            TypeErrorKind::IntExpected => {
                Some("to convert a Boolean to a number, write `if c then 1 else 0`")
            }
            TypeErrorKind::Overflow64 { lo, hi, .. } if lo == hi => Some("use smaller numbers"),
            TypeErrorKind::Overflow64 { .. } => {
                Some("declare smaller ranges for the variables in it")
            }
            TypeErrorKind::DivisorMayBeZero { lo: 0, hi: 0 } => Some("use another divisor"),
            TypeErrorKind::DivisorMayBeZero { .. } => {
                Some("declare the divisor with a range that excludes 0")
            }
            TypeErrorKind::ShiftOutOfRange { lo, hi } if lo == hi => Some("use another amount"),
            TypeErrorKind::ShiftOutOfRange { .. } => Some(
                "declare the amount with a range within 0..63, or limit it: for example `n band 31`",
            ),
            TypeErrorKind::IndexOutOfArray { lo, hi, .. } => Some(index_help(*lo, *hi)),
            TypeErrorKind::Mixed => Some(
                "a Boolean is compared without a number: for `x = 1` write `x`, for `x = 0` write `not x`",
            ),
            TypeErrorKind::ArrayWithoutIndex => Some("select one element, for example `v[0]`"),
            TypeErrorKind::DurationAlone => {
                Some("write a comparison such as `s.t >= 3 s`; use a variable to count")
            }
            TypeErrorKind::TooDeep => Some("split it with several variables"),
            TypeErrorKind::DurationTooLong { .. } => {
                Some("use a longer tick, or count with a variable")
            }
            _ => None,
        }
    }
}

/// Types of the leaves of an expression, for [`check`].
pub trait Leaves<L> {
    /// The type of a plain leaf.
    ///
    /// # Errors
    /// The leaf does not exist, is an array, or cannot be read here.
    fn leaf(&mut self, leaf: &L, span: Span) -> Result<Type, TypeError>;

    /// The type of an element of the array that `leaf` names, and the array's length if it is known.
    ///
    /// # Errors
    /// The leaf does not exist, is not an array, or cannot be read here.
    fn array(&mut self, leaf: &L, span: Span) -> Result<(Type, Option<u32>), TypeError>;

    /// True for a leaf that counts ticks and therefore is allowed only in a comparison with a constant.
    fn is_duration(&self, leaf: &L) -> bool {
        let _ = leaf;
        false
    }
}

/// The interval of an expression whose leaves have the given types; for an element, `leaf` gives the type of one element. Array lengths and the positions
/// of durations are not checked here: [`check`] does that.
///
/// # Errors
/// The first operator, left to right and inside out, that has no type.
pub fn type_of<L>(expr: &Expr<L>, leaf: &mut impl FnMut(&L) -> Type) -> Result<Type, TypeError> {
    struct Closure<'a, F>(&'a mut F);
    impl<L, F: FnMut(&L) -> Type> Leaves<L> for Closure<'_, F> {
        fn leaf(&mut self, leaf: &L, _: Span) -> Result<Type, TypeError> {
            Ok((self.0)(leaf))
        }
        fn array(&mut self, leaf: &L, _: Span) -> Result<(Type, Option<u32>), TypeError> {
            Ok(((self.0)(leaf), None))
        }
    }
    check(expr, &mut Closure(leaf))
}

/// Like [`type_of`], but also checks array lengths, durations and which leaves can be read.
///
/// # Errors
/// The errors of [`type_of`], and all errors of `leaves`.
pub fn check<L>(expr: &Expr<L>, leaves: &mut impl Leaves<L>) -> Result<Type, TypeError> {
    typed(expr, leaves, DEPTH_LIMIT).map_err(|error| *error)
}

/// A type, or a boxed error. The recursion goes [`DEPTH_LIMIT`] levels deep on any thread's stack, so its stack frames must be small: errors are boxed, and
/// arithmetic is in other functions.
type Typed<T = Type> = Result<T, Box<TypeError>>;

fn refuse<T>(span: Span, kind: TypeErrorKind) -> Typed<T> {
    Err(Box::new(TypeError { span, kind }))
}

fn typed<L>(expr: &Expr<L>, leaves: &mut impl Leaves<L>, depth: usize) -> Typed {
    let span = expr.span;
    let Some(below) = depth.checked_sub(1) else {
        return refuse(span, TypeErrorKind::TooDeep);
    };
    match &expr.kind {
        ExprKind::Bool(_) => Ok(Type::Bool),
        ExprKind::Int(value) => Ok(Type::Int { lo: *value, hi: *value }),
        ExprKind::Leaf(leaf) if leaves.is_duration(leaf) => {
            leaves.leaf(leaf, span)?;
            refuse(span, TypeErrorKind::DurationAlone)
        }
        ExprKind::Leaf(leaf) => Ok(ordered(leaves.leaf(leaf, span)?)),
        ExprKind::Element(array, index) => {
            let (ty, len) = leaves.array(array, span)?;
            let (lo, hi) = number(index, leaves, below)?;
            match len {
                Some(len) if lo < 0 || hi >= i64::from(len) => {
                    refuse(index.span, TypeErrorKind::IndexOutOfArray { lo, hi, len })
                }
                Some(_) | None => Ok(ordered(ty)),
            }
        }
        ExprKind::Not(a) => {
            condition(a, leaves, below)?;
            Ok(Type::Bool)
        }
        ExprKind::And(all) | ExprKind::Or(all) => {
            for a in all {
                condition(a, leaves, below)?;
            }
            Ok(Type::Bool)
        }
        ExprKind::Compare(op, a, b) => comparison(*op, a, b, leaves, below),
        ExprKind::Neg(a) => {
            let (lo, hi) = number(a, leaves, below)?;
            fit("-", -i128::from(hi), -i128::from(lo), span)
        }
        ExprKind::Arith(op, a, b) => {
            let a = number(a, leaves, below)?;
            let divisor_span = b.span;
            let b = number(b, leaves, below)?;
            arithmetic(*op, a, b, span, divisor_span)
        }
        ExprKind::Select(c, a, b) => {
            condition(c, leaves, below)?;
            match (typed(a, leaves, below)?, typed(b, leaves, below)?) {
                (Type::Bool, Type::Bool) => Ok(Type::Bool),
                (Type::Int { lo, hi }, Type::Int { lo: l, hi: h }) => {
                    Ok(Type::Int { lo: lo.min(l), hi: hi.max(h) })
                }
                (Type::Bool, Type::Int { .. }) | (Type::Int { .. }, Type::Bool) => {
                    refuse(span, TypeErrorKind::Mixed)
                }
            }
        }
    }
}

/// The bounds in order, so that a declaration with `lo > hi` (reported elsewhere) does not break the arithmetic.
fn ordered(ty: Type) -> Type {
    match ty {
        Type::Bool => Type::Bool,
        Type::Int { lo, hi } => Type::Int { lo: lo.min(hi), hi: lo.max(hi) },
    }
}

fn condition<L>(expr: &Expr<L>, leaves: &mut impl Leaves<L>, depth: usize) -> Typed<()> {
    match typed(expr, leaves, depth)? {
        Type::Bool => Ok(()),
        Type::Int { lo, hi } => refuse(expr.span, TypeErrorKind::BoolExpected { lo, hi }),
    }
}

fn number<L>(expr: &Expr<L>, leaves: &mut impl Leaves<L>, depth: usize) -> Typed<(i64, i64)> {
    match typed(expr, leaves, depth)? {
        Type::Int { lo, hi } => Ok((lo, hi)),
        Type::Bool => refuse(expr.span, TypeErrorKind::IntExpected),
    }
}

fn comparison<L>(
    op: CompareOp,
    a: &Expr<L>,
    b: &Expr<L>,
    leaves: &mut impl Leaves<L>,
    depth: usize,
) -> Typed {
    for (duration, other) in [(a, b), (b, a)] {
        if let (ExprKind::Leaf(leaf), ExprKind::Int(constant)) = (&duration.kind, &other.kind)
            && leaves.is_duration(leaf)
        {
            leaves.leaf(leaf, duration.span)?;
            return if *constant > LONGEST {
                refuse(other.span, TypeErrorKind::DurationTooLong { constant: *constant })
            } else if *constant < 0 {
                refuse(other.span, TypeErrorKind::DurationNegative { constant: *constant })
            } else {
                Ok(Type::Bool)
            };
        }
    }
    match (typed(a, leaves, depth)?, typed(b, leaves, depth)?) {
        (Type::Int { .. }, Type::Int { .. }) => Ok(Type::Bool),
        (Type::Bool, Type::Bool) if matches!(op, CompareOp::Eq | CompareOp::Ne) => Ok(Type::Bool),
        (Type::Bool, Type::Bool) => refuse(a.span, TypeErrorKind::IntExpected),
        (Type::Bool, Type::Int { .. }) | (Type::Int { .. }, Type::Bool) => {
            refuse(a.span.to(b.span), TypeErrorKind::Mixed)
        }
    }
}

fn arithmetic(op: ArithOp, a: (i64, i64), b: (i64, i64), span: Span, right_span: Span) -> Typed {
    if let Some(kind) = bad_operand(op, b) {
        return refuse(right_span, kind);
    }
    let (lo, hi) = exact(op, a, b);
    fit(op.symbol(), lo, hi, span)
}

/// The interval of an arithmetic result. `None` if the divisor may be 0, a shift may be by less than 0 or more than 63, or a bound exceeds 64 bits.
#[must_use]
pub fn arith(op: ArithOp, a: (i64, i64), b: (i64, i64)) -> Option<(i64, i64)> {
    if bad_operand(op, b).is_some() {
        return None;
    }
    let (lo, hi) = exact(op, a, b);
    Some((i64::try_from(lo).ok()?, i64::try_from(hi).ok()?))
}

/// Why the right operand is not allowed: a divisor that may be 0, or an amount that may be out of range.
fn bad_operand(op: ArithOp, (lo, hi): (i64, i64)) -> Option<TypeErrorKind> {
    match op {
        ArithOp::Div | ArithOp::Mod if lo <= 0 && hi >= 0 => {
            Some(TypeErrorKind::DivisorMayBeZero { lo, hi })
        }
        ArithOp::Shl | ArithOp::Shr if lo < 0 || hi > LARGEST_SHIFT => {
            Some(TypeErrorKind::ShiftOutOfRange { lo, hi })
        }
        _ => None,
    }
}

/// The interval of an arithmetic result whose right operand is allowed.
fn exact(op: ArithOp, (a_lo, a_hi): (i64, i64), (b_lo, b_hi): (i64, i64)) -> (i128, i128) {
    let (al, ah, bl, bh) = (i128::from(a_lo), i128::from(a_hi), i128::from(b_lo), i128::from(b_hi));
    // Multiplication is monotone in each operand, and so are shifts, and truncated division while the divisor keeps its sign: the extremes are at the
    // corners.
    let corners = |f: fn(i128, i128) -> i128| {
        let all = [f(al, bl), f(al, bh), f(ah, bl), f(ah, bh)];
        (all.into_iter().min().unwrap_or(0), all.into_iter().max().unwrap_or(0))
    };
    let bits = |f: fn(bool, bool) -> bool| {
        let (lo, hi) = bitwise(f, (a_lo, a_hi), (b_lo, b_hi));
        (lo.into(), hi.into())
    };
    match op {
        ArithOp::Add => (al + bl, ah + bh),
        ArithOp::Sub => (al - bh, ah - bl),
        ArithOp::Mul => corners(|x, y| x * y),
        ArithOp::Div => corners(|x, y| x / y),
        ArithOp::Mod => {
            let (lo, hi) = remainder((al, ah), (bl, bh));
            // The hardware (and `ArithOp::apply`) computes a remainder with a division, and that division must not overflow either.
            let overflows = a_lo == i64::MIN && b_lo <= -1 && b_hi >= -1;
            if overflows { (lo.min(al), -al) } else { (lo, hi) }
        }
        ArithOp::BitAnd => bits(|x, y| x && y),
        ArithOp::BitOr => bits(|x, y| x || y),
        ArithOp::BitXor => bits(|x, y| x != y),
        ArithOp::Shl => corners(|x, by| x << by),
        ArithOp::Shr => corners(|x, by| x >> by),
    }
}

/// The exact interval of an operation that combines the operands bit by bit.
fn bitwise(f: fn(bool, bool) -> bool, a: (i64, i64), b: (i64, i64)) -> (i64, i64) {
    (!largest(|x, y| !f(x, y), a, b), largest(f, a, b))
}

/// The largest result of an operation that combines the operands bit by bit. The bits are chosen from the sign down: each one as large as the operands allow.
/// Each state records which bounds the bits chosen so far are equal to; a bound does not limit the lower bits of an operand that already differs from it.
fn largest(f: impl Fn(bool, bool) -> bool, a: (i64, i64), b: (i64, i64)) -> i64 {
    /// Whether the bits chosen so far are equal to those of `a.0`, `a.1`, `b.0` and `b.1`.
    type Equal = [bool; 4];
    let bounds = [a.0, a.1, b.0, b.1];
    let mut states: Vec<Equal> = vec![[true; 4]];
    let mut result = 0_i64;
    for at in (0..i64::BITS).rev() {
        // The sign bit has a negative weight: with all of them inverted, the order is that of the numbers.
        let is_sign = at == i64::BITS - 1;
        let limit = bounds.map(|bound| (bound >> at & 1 == 1) != is_sign);
        let next = |state: &Equal, x: bool, y: bool| -> Option<Equal> {
            let digits = [x, x, y, y];
            let mut equal = *state;
            for side in 0..4 {
                let is_lower = side % 2 == 0;
                let (digit, limit) = (digits[side], limit[side]);
                if state[side] && digit != limit && digit != is_lower {
                    return None;
                }
                equal[side] &= digit == limit;
            }
            Some(equal)
        };
        let mut best = (false, Vec::new());
        for state in &states {
            for (x, y) in [(false, false), (false, true), (true, false), (true, true)] {
                let Some(equal) = next(state, x, y) else { continue };
                let digit = f(x != is_sign, y != is_sign) != is_sign;
                if digit && !best.0 {
                    best = (true, Vec::new());
                }
                if digit == best.0 && !best.1.contains(&equal) {
                    best.1.push(equal);
                }
            }
        }
        result |= i64::from(best.0 != is_sign) << at;
        states = best.1;
    }
    result
}

/// The interval of a truncated remainder. A remainder is smaller than the largest divisor (both as absolute values), no farther from 0 than the dividend, and
/// has the dividend's sign; if the dividend is smaller than every divisor, the remainder is the dividend itself.
fn remainder((al, ah): (i128, i128), (bl, bh): (i128, i128)) -> (i128, i128) {
    let largest = bl.abs().max(bh.abs()) - 1;
    let smallest = bl.abs().min(bh.abs()) - 1;
    if al == ah && bl == bh {
        return (al % bl, al % bl);
    }
    if al >= -smallest && ah <= smallest {
        return (al, ah);
    }
    (if al < 0 { al.max(-largest) } else { 0 }, if ah > 0 { ah.min(largest) } else { 0 })
}

fn fit(operator: &'static str, lo: i128, hi: i128, span: Span) -> Typed {
    match (i64::try_from(lo), i64::try_from(hi)) {
        (Ok(lo), Ok(hi)) => Ok(Type::Int { lo, hi }),
        _ => refuse(span, TypeErrorKind::Overflow64 { operator, lo, hi }),
    }
}

/// The leaves of a net's expressions; every leaf can be read.
#[derive(Debug, Clone, Copy)]
pub struct NetLeaves<'a>(
    /// The net that the leaves belong to.
    pub &'a Net,
);

impl Leaves<Leaf> for NetLeaves<'_> {
    fn leaf(&mut self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        fn exists<T>(arena: &Arena<T>, id: crate::arena::Id<T>, ty: Type) -> Option<Type> {
            arena.get(id).map(|_| ty)
        }
        let net = self.0;
        let found = match *leaf {
            Leaf::Input(input) => net.inputs.get(input).map(|input| input.ty),
            Leaf::Var(var) => match net.vars.get(var) {
                Some(var) if var.len.is_some() => {
                    return Err(TypeError { span, kind: TypeErrorKind::ArrayWithoutIndex });
                }
                found => found.map(|var| var.ty),
            },
            Leaf::Active(step) | Leaf::TasksDone(step) => exists(&net.steps, step, Type::Bool),
            Leaf::Elapsed(step) | Leaf::LastElapsed(step) => exists(&net.steps, step, TICKS),
            Leaf::Timer(timer) => exists(&net.timers, timer, TICKS),
            Leaf::Rise(edge) | Leaf::Fall(edge) => exists(&net.edges, edge, Type::Bool),
            Leaf::Fireable(transition) => exists(&net.transitions, transition, Type::Bool),
            Leaf::Controlled(action) => exists(&net.actions, action, Type::Bool),
        };
        found.ok_or(TypeError { span, kind: TypeErrorKind::Dangling })
    }

    fn array(&mut self, leaf: &Leaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        let Leaf::Var(var) = *leaf else {
            return Err(TypeError { span, kind: TypeErrorKind::NotAnArray });
        };
        match self.0.vars.get(var) {
            None => Err(TypeError { span, kind: TypeErrorKind::Dangling }),
            Some(var) if var.len.is_none() => {
                Err(TypeError { span, kind: TypeErrorKind::NotAnArray })
            }
            Some(var) => Ok((var.ty, var.len)),
        }
    }

    fn is_duration(&self, leaf: &Leaf) -> bool {
        leaf.is_time()
    }
}

impl Leaves<PropertyLeaf> for NetLeaves<'_> {
    fn leaf(&mut self, leaf: &PropertyLeaf, span: Span) -> Result<Type, TypeError> {
        match leaf {
            PropertyLeaf::Net(leaf) => Leaves::<Leaf>::leaf(self, leaf, span),
            PropertyLeaf::Output(output) => {
                let output = self.0.outputs.get(*output);
                output
                    .map(|output| output.ty)
                    .ok_or(TypeError { span, kind: TypeErrorKind::Dangling })
            }
        }
    }

    fn array(&mut self, leaf: &PropertyLeaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        match leaf {
            PropertyLeaf::Net(leaf) => Leaves::<Leaf>::array(self, leaf, span),
            PropertyLeaf::Output(_) => Err(TypeError { span, kind: TypeErrorKind::NotAnArray }),
        }
    }

    fn is_duration(&self, leaf: &PropertyLeaf) -> bool {
        match leaf {
            PropertyLeaf::Net(leaf) => Leaves::<Leaf>::is_duration(self, leaf),
            PropertyLeaf::Output(_) => false,
        }
    }
}

/// The type of an expression of `net`. Array lengths and the positions of durations are checked.
///
/// # Errors
/// The errors of [`check`].
pub fn net_type(net: &Net, expr: &crate::net::Expr) -> Result<Type, TypeError> {
    check(expr, &mut NetLeaves(net))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type E = Expr<usize>;

    fn int(lo: i64, hi: i64) -> Type {
        Type::Int { lo, hi }
    }
    fn leaf(index: usize) -> E {
        Expr::leaf(index, Span::default())
    }
    fn node(kind: ExprKind<usize>) -> E {
        Expr::new(kind, Span::default())
    }
    fn arith(op: ArithOp, a: E, b: E) -> E {
        node(ExprKind::Arith(op, Box::new(a), Box::new(b)))
    }
    fn ty(expr: &E, types: &[Type]) -> Result<Type, TypeErrorKind> {
        type_of(expr, &mut |leaf: &usize| types[*leaf]).map_err(|error| error.kind)
    }

    #[test]
    fn intervals_are_those_of_exact_arithmetic() {
        let types = [int(-3, 5), int(2, 4), Type::Bool];
        for (op, lo, hi) in [
            (ArithOp::Add, -1, 9),
            (ArithOp::Sub, -7, 3),
            (ArithOp::Mul, -12, 20),
            (ArithOp::Div, -1, 2),
            (ArithOp::Mod, -3, 3),
        ] {
            assert_eq!(ty(&arith(op, leaf(0), leaf(1)), &types), Ok(int(lo, hi)), "{op:?}");
        }
        assert_eq!(ty(&node(ExprKind::Neg(Box::new(leaf(0)))), &types), Ok(int(-5, 3)));
        let choice = ExprKind::Select(Box::new(leaf(2)), Box::new(leaf(0)), Box::new(Expr::int(9)));
        assert_eq!(ty(&node(choice), &types), Ok(int(-3, 9)));
    }

    #[test]
    fn intervals_of_bit_operators_are_tight() {
        let byte = (0, 255);
        assert_eq!(super::arith(ArithOp::BitAnd, (-1000, 70_000), (15, 15)), Some((0, 15)));
        assert_eq!(super::arith(ArithOp::BitAnd, byte, (-16, -16)), Some((0, 240)));
        assert_eq!(super::arith(ArithOp::BitOr, byte, (0, 1023)), Some((0, 1023)));
        assert_eq!(super::arith(ArithOp::BitOr, byte, (256, 256)), Some((256, 511)));
        assert_eq!(super::arith(ArithOp::BitXor, byte, (-1, -1)), Some((-256, -1)));
        assert_eq!(super::arith(ArithOp::BitXor, (i64::MIN, -1), byte), Some((i64::MIN, -1)));
        assert_eq!(super::arith(ArithOp::Shr, (-7, 255), (1, 4)), Some((-4, 127)));
        assert_eq!(super::arith(ArithOp::Shl, byte, (0, 31)), Some((0, 255 << 31)));
        assert_eq!(super::arith(ArithOp::Shl, byte, (0, 63)), None, "more than 64 bits");
        assert_eq!(super::arith(ArithOp::Shr, byte, (-1, 3)), None, "a negative amount");
        assert_eq!(super::arith(ArithOp::Shr, byte, (0, 64)), None, "an amount of 64");
    }

    #[test]
    fn what_has_no_type_says_why() {
        let types = [int(-3, 5), int(2, 4), Type::Bool];
        let div = arith(ArithOp::Div, leaf(1), leaf(0));
        assert_eq!(ty(&div, &types), Err(TypeErrorKind::DivisorMayBeZero { lo: -3, hi: 5 }));
        let big = arith(ArithOp::Add, Expr::int(i64::MAX), leaf(1));
        let Err(TypeErrorKind::Overflow64 { operator: "+", hi, .. }) = ty(&big, &types) else {
            panic!("fits")
        };
        assert_eq!(hi, i128::from(i64::MAX) + 4);
        let worst = arith(ArithOp::Mod, Expr::int(i64::MIN), Expr::int(-1));
        assert!(
            matches!(ty(&worst, &types), Err(TypeErrorKind::Overflow64 { .. })),
            "as ArithOp::apply says"
        );
        assert_eq!(
            ty(&Expr::not(leaf(0)), &types),
            Err(TypeErrorKind::BoolExpected { lo: -3, hi: 5 })
        );
        assert_eq!(
            ty(&arith(ArithOp::Add, leaf(0), leaf(2)), &types),
            Err(TypeErrorKind::IntExpected)
        );
        assert_eq!(
            ty(&Expr::compare(CompareOp::Eq, leaf(0), leaf(2)), &types),
            Err(TypeErrorKind::Mixed)
        );
        assert_eq!(
            ty(&Expr::compare(CompareOp::Lt, leaf(2), leaf(2)), &types),
            Err(TypeErrorKind::IntExpected)
        );
        assert_eq!(ty(&Expr::compare(CompareOp::Eq, leaf(2), leaf(2)), &types), Ok(Type::Bool));
    }

    #[test]
    fn depth_is_bounded() {
        let mut expr = leaf(0);
        for _ in 0..DEPTH_LIMIT {
            expr = node(ExprKind::Neg(Box::new(expr)));
        }
        assert_eq!(ty(&expr, &[int(0, 1)]), Err(TypeErrorKind::TooDeep));
    }

    fn expr() -> impl Strategy<Value = E> {
        let leaves = prop_oneof![(0usize..3).prop_map(leaf), (-9i64..9).prop_map(Expr::int)];
        leaves.prop_recursive(5, 24, 3, |inner| {
            let ops = prop_oneof![
                Just(ArithOp::Add),
                Just(ArithOp::Sub),
                Just(ArithOp::Mul),
                Just(ArithOp::Div),
                Just(ArithOp::Mod),
                Just(ArithOp::BitAnd),
                Just(ArithOp::BitOr),
                Just(ArithOp::BitXor),
                Just(ArithOp::Shl),
                Just(ArithOp::Shr)
            ];
            prop_oneof![
                4 => (ops, inner.clone(), inner.clone()).prop_map(|(op, a, b)| arith(op, a, b)),
                1 => inner.clone().prop_map(|a| node(ExprKind::Neg(Box::new(a)))),
                1 => (inner.clone(), inner.clone(), inner).prop_map(|(a, b, c)| {
                    let condition = Expr::compare(CompareOp::Lt, a.clone(), b.clone());
                    node(ExprKind::Select(Box::new(condition), Box::new(c), Box::new(b)))
                }),
            ]
        })
    }

    fn value(expr: &E, of: &[i64; 3]) -> Option<i64> {
        Some(match &expr.kind {
            ExprKind::Int(value) => *value,
            ExprKind::Leaf(leaf) => of[*leaf],
            ExprKind::Neg(a) => value(a, of)?.checked_neg()?,
            ExprKind::Arith(op, a, b) => op.apply(value(a, of)?, value(b, of)?)?,
            ExprKind::Select(c, a, b) => value(if value(c, of)? != 0 { a } else { b }, of)?,
            ExprKind::Compare(op, a, b) => i64::from(op.apply(value(a, of)?, value(b, of)?)),
            _ => unreachable!("the strategy makes none"),
        })
    }

    proptest! {
        /// For all values of the leaves, the result exists and is in the interval.
        #[test]
        fn values_stay_in_the_interval(expr in expr(), a in -5i64..=3, b in 1i64..=7, c in -4i64..=-2) {
            let types = [int(-5, 3), int(1, 7), int(-4, -2)];
            if let Ok(Type::Int { lo, hi }) = ty(&expr, &types) {
                let value = value(&expr, &[a, b, c]);
                prop_assert!(value.is_some_and(|value| (lo..=hi).contains(&value)), "{value:?} {lo}..{hi}");
            }
        }

        /// For small operands the interval of one operator is the exact hull (except for `mod`, where it is a safe bound).
        #[test]
        fn one_operator_is_exact(al in -9i64..9, aw in 0i64..6, bl in -9i64..9, bw in 0i64..6) {
            let (ah, bh) = (al + aw, bl + bw);
            for op in [
                ArithOp::Add, ArithOp::Sub, ArithOp::Mul, ArithOp::Div, ArithOp::BitAnd, ArithOp::BitOr, ArithOp::BitXor,
                ArithOp::Shl, ArithOp::Shr,
            ] {
                if op == ArithOp::Div && bl <= 0 && bh >= 0 || op.is_shift() && bl < 0 { continue; }
                let all: Vec<i64> =
                    (al..=ah).flat_map(|a| (bl..=bh).filter_map(move |b| op.apply(a, b))).collect();
                let hull = int(*all.iter().min().unwrap(), *all.iter().max().unwrap());
                prop_assert_eq!(ty(&arith(op, leaf(0), leaf(1)), &[int(al, ah), int(bl, bh)]), Ok(hull));
            }
        }
    }
}
