//! Types: how a type of IEC 61131-3 becomes a type of a chart.

use grafsynth_ir::chart::Expr;
use grafsynth_ir::expr::Type;

use crate::st::ast;

/// A resolved type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Ty {
    Bool,
    /// An integer. It wraps around at its bounds, as on controllers, unless it is a subrange or has 64 bits.
    Int {
        lo: i64,
        hi: i64,
        wraps: bool,
    },
    Time,
    /// The bounds of each dimension, and the element type.
    Array(Vec<(i64, i64)>, Box<Ty>),
    /// A function block, by its index among the units.
    Block(usize),
    Struct(Vec<ast::Var>),
    /// An invalid type that is already reported.
    Broken,
}

impl Ty {
    /// The type in a chart; `None` if it is not a simple type.
    pub(super) fn simple(&self) -> Option<Type> {
        match self {
            Ty::Bool => Some(Type::Bool),
            Ty::Int { lo, hi, .. } => Some(Type::Int { lo: *lo, hi: *hi }),
            Ty::Time | Ty::Array(..) | Ty::Block(_) | Ty::Struct(_) | Ty::Broken => None,
        }
    }
}

/// The integer types: name, smallest and largest value.
pub(super) const INTEGERS: [(&str, i64, i64); 12] = [
    ("SINT", -128, 127),
    ("INT", -32_768, 32_767),
    ("DINT", i32::MIN as i64, i32::MAX as i64),
    ("LINT", i64::MIN, i64::MAX),
    ("USINT", 0, 255),
    ("UINT", 0, 65_535),
    ("UDINT", 0, u32::MAX as i64),
    ("ULINT", 0, i64::MAX),
    ("BYTE", 0, 255),
    ("WORD", 0, 65_535),
    ("DWORD", 0, u32::MAX as i64),
    ("LWORD", 0, i64::MAX),
];

/// The bounds of an integer type.
pub(super) fn integer(name: &str) -> Option<(i64, i64)> {
    INTEGERS.iter().find(|(known, ..)| *known == name).map(|(_, lo, hi)| (*lo, *hi))
}

/// The range of 32 bits, the widest that a chart can declare.
pub(super) const WIDEST: (i64, i64) = (i32::MIN as i64, i32::MAX as i64);

/// The number of elements of an array.
pub(super) fn length(bounds: &[(i64, i64)]) -> usize {
    bounds
        .iter()
        .map(|(lo, hi)| usize::try_from(hi.abs_diff(*lo)).unwrap_or(usize::MAX).saturating_add(1))
        .fold(1, usize::saturating_mul)
}

/// An integer type with these bounds, which wraps around if it has at most 32 bits.
pub(super) fn wrapping(lo: i64, hi: i64) -> Ty {
    let fits = lo >= WIDEST.0 && hi <= WIDEST.1;
    Ty::Int { lo, hi, wraps: fits }
}

/// The default initial value: 0, or the lower bound of a subrange that does not contain 0.
pub(super) fn zero(ty: &Ty) -> Expr {
    match ty.simple() {
        Some(Type::Bool) | None => Expr::bool(false),
        Some(ty @ Type::Int { .. }) => Expr::int(ty.saturate(0)),
    }
}
