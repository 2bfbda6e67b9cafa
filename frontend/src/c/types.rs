//! The types that nets support: Booleans, integers of 8, 16 and 32 bits, and arrays of them.

use super::ast::{Base, Declarator, Specifiers};
use super::constant;
use grafsynth_ir::Span;
use grafsynth_ir::expr::Type as NetType;
use std::collections::BTreeMap;

/// The sizes that C leaves to the implementation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Widths {
    /// Bits of `int`: 16 or 32. `short` has 16, `long` has 32, `long long` is opaque.
    pub(super) int: u32,
    /// Whether plain `char` is unsigned, as on ARM.
    pub(super) is_unsigned_char: bool,
}

/// The type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    Bool,
    Int { bits: u32, is_signed: bool },
}

/// The type of a declared name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Type {
    Void,
    Scalar(Scalar),
    /// The lengths, outermost first; the first is `None` if it was not written.
    Array(Scalar, Option<u32>, Vec<u32>),
    /// A parameter that is a pointer to scalars.
    Pointer(Scalar),
    /// A type that only a C compiler can handle.
    Opaque,
}

/// The maximum length of an array in a net.
const MAX_LENGTH: i64 = 65_536;

impl Scalar {
    /// The smallest and largest value.
    pub(super) fn range(self) -> (i64, i64) {
        match self {
            Scalar::Bool => (0, 1),
            Scalar::Int { bits, is_signed: true } => (-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            Scalar::Int { bits, is_signed: false } => (0, (1 << bits) - 1),
        }
    }

    /// Whether this is the unsigned 32-bit type. Variables of the net store its values as two's complement, because their bounds are signed
    /// 32-bit numbers.
    pub(super) fn is_folded(self) -> bool {
        self == Scalar::Int { bits: 32, is_signed: false }
    }

    /// The type of a net variable that stores such values.
    pub(super) fn stored(self) -> NetType {
        match self {
            Scalar::Bool => NetType::Bool,
            _ if self.is_folded() => {
                NetType::Int { lo: i64::from(i32::MIN), hi: i64::from(i32::MAX) }
            }
            Scalar::Int { .. } => {
                let (lo, hi) = self.range();
                NetType::Int { lo, hi }
            }
        }
    }

    /// The integer promotions (C99 6.3.1.1).
    pub(super) fn promoted(self, widths: Widths) -> Scalar {
        match self {
            Scalar::Int { bits, .. } if bits >= widths.int => self,
            Scalar::Bool | Scalar::Int { .. } => Scalar::Int { bits: widths.int, is_signed: true },
        }
    }

    /// The usual arithmetic conversions (C99 6.3.1.8). A wider type contains all values of a narrower unsigned type. Types of the same
    /// width have the same rank here, such as `int` and `long` of 32 bits.
    pub(super) fn common(self, other: Scalar, widths: Widths) -> Scalar {
        match (self.promoted(widths), other.promoted(widths)) {
            (Scalar::Int { bits: a, is_signed: sa }, Scalar::Int { bits: b, is_signed: sb }) => {
                match a.cmp(&b) {
                    std::cmp::Ordering::Less => Scalar::Int { bits: b, is_signed: sb },
                    std::cmp::Ordering::Greater => Scalar::Int { bits: a, is_signed: sa },
                    std::cmp::Ordering::Equal => Scalar::Int { bits: a, is_signed: sa && sb },
                }
            }
            (a, _) => a,
        }
    }

    /// The size in bytes, as for `sizeof`.
    pub(super) fn size(self) -> i64 {
        match self {
            Scalar::Bool => 1,
            Scalar::Int { bits, .. } => i64::from(bits / 8),
        }
    }
}

/// The scalar type of the specifiers; `None` for `void` and opaque types.
pub(super) fn scalar(base: &Base, widths: Widths) -> Option<Scalar> {
    let int = |bits, is_signed| Some(Scalar::Int { bits, is_signed });
    match *base {
        Base::Void | Base::LongLong | Base::Opaque => None,
        Base::Bool => Some(Scalar::Bool),
        Base::Char(sign) => int(8, sign.unwrap_or(!widths.is_unsigned_char)),
        Base::Short { is_signed } => int(16, is_signed),
        Base::Int { is_signed } => int(widths.int, is_signed),
        Base::Long { is_signed } => int(32, is_signed),
        Base::Fixed { bits, is_signed } => int(bits, is_signed),
        Base::Enum => int(widths.int, true),
    }
}

/// The type of a declared name.
///
/// # Errors
/// Returns the span of an array length that is not a constant between 1 and 65 536.
pub(super) fn of(
    specifiers: &Specifiers,
    declarator: &Declarator,
    widths: Widths,
    constants: &BTreeMap<String, i64>,
) -> Result<Type, Span> {
    if declarator.is_opaque || declarator.is_function {
        return Ok(Type::Opaque);
    }
    let Some(scalar) = scalar(&specifiers.base, widths) else {
        let is_void = specifiers.base == Base::Void && declarator.n_pointers == 0;
        return Ok(if is_void { Type::Void } else { Type::Opaque });
    };
    match (declarator.n_pointers, declarator.lengths.split_first()) {
        (0, None) => Ok(Type::Scalar(scalar)),
        (0, Some((first, rest))) => {
            let length = |expr: &super::ast::Expr| match constant::value(expr, constants) {
                Ok(length) if (1..=MAX_LENGTH).contains(&length) => {
                    Ok(u32::try_from(length).unwrap_or(1))
                }
                Ok(_) => Err(expr.span),
                Err(span) => Err(span),
            };
            let first = first.as_ref().map(length).transpose()?;
            let rest = rest
                .iter()
                .map(|one| one.as_ref().map_or(Err(declarator.span), length))
                .collect::<Result<Vec<_>, _>>()?;
            let product = rest.iter().fold(i64::from(first.unwrap_or(1)), |product, one| {
                product.saturating_mul(i64::from(*one))
            });
            if product > MAX_LENGTH {
                return Err(declarator.span);
            }
            Ok(Type::Array(scalar, first, rest))
        }
        (1, None) => Ok(Type::Pointer(scalar)),
        _ => Ok(Type::Opaque),
    }
}
