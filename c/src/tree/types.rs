//! Types of C, their sizes on a machine, and the conversions between integers (C99 6.2.5, 6.3.1).

use super::{EnumId, Member, StructId, SymbolId, Unit};
use std::sync::Arc;

/// The maximum nesting of a type: pointer to array of pointer to function, and so on.
pub const MAX_TYPE_DEPTH: usize = 32;

/// An integer type without its typedef name (C99 6.2.5p4..6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum IntKind {
    /// `_Bool`, which `<stdbool.h>` calls `bool`.
    Bool,
    /// `char`, whose sign depends on the machine.
    Char,
    /// `signed char`.
    SChar,
    /// `unsigned char`.
    UChar,
    /// `short`.
    Short,
    /// `unsigned short`.
    UShort,
    /// `int`.
    Int,
    /// `unsigned int`.
    UInt,
    /// `long`.
    Long,
    /// `unsigned long`.
    ULong,
    /// `long long`.
    LLong,
    /// `unsigned long long`.
    ULLong,
}

impl IntKind {
    /// The conversion rank (C99 6.3.1.1p1); a signed type and its unsigned counterpart have the same rank.
    #[must_use]
    pub fn rank(self) -> u8 {
        match self {
            IntKind::Bool => 0,
            IntKind::Char | IntKind::SChar | IntKind::UChar => 1,
            IntKind::Short | IntKind::UShort => 2,
            IntKind::Int | IntKind::UInt => 3,
            IntKind::Long | IntKind::ULong => 4,
            IntKind::LLong | IntKind::ULLong => 5,
        }
    }

    /// The unsigned type of the same rank; for `_Bool`, `_Bool` itself.
    #[must_use]
    pub fn unsigned(self) -> IntKind {
        match self {
            IntKind::Bool => IntKind::Bool,
            IntKind::Char | IntKind::SChar | IntKind::UChar => IntKind::UChar,
            IntKind::Short | IntKind::UShort => IntKind::UShort,
            IntKind::Int | IntKind::UInt => IntKind::UInt,
            IntKind::Long | IntKind::ULong => IntKind::ULong,
            IntKind::LLong | IntKind::ULLong => IntKind::ULLong,
        }
    }

    /// The type as it is spelled in C.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            IntKind::Bool => "bool",
            IntKind::Char => "char",
            IntKind::SChar => "signed char",
            IntKind::UChar => "unsigned char",
            IntKind::Short => "short",
            IntKind::UShort => "unsigned short",
            IntKind::Int => "int",
            IntKind::UInt => "unsigned",
            IntKind::Long => "long",
            IntKind::ULong => "unsigned long",
            IntKind::LLong => "long long",
            IntKind::ULLong => "unsigned long long",
        }
    }
}

/// The memory of an object, on machines that have several (Embedded C, ISO/IEC TR 18037, 5.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Space {
    /// The memory of ordinary C.
    #[default]
    Generic,
    /// `__flash` of avr-gcc.
    Flash,
    /// `__code` of sdcc.
    Code,
}

/// Type qualifiers (C99 6.7.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Qualifiers {
    /// `const`: the program must not write it.
    pub is_const: bool,
    /// `volatile`: another agent, such as an interrupt, may read or write it at any time.
    pub is_volatile: bool,
    /// `restrict`: the object is accessed only through this pointer.
    pub is_restrict: bool,
    /// The address space.
    pub space: Space,
}

impl Qualifiers {
    /// The union of two sets of qualifiers.
    #[must_use]
    pub fn with(self, other: Qualifiers) -> Qualifiers {
        Qualifiers {
            is_const: self.is_const || other.is_const,
            is_volatile: self.is_volatile || other.is_volatile,
            is_restrict: self.is_restrict || other.is_restrict,
            space: if other.space == Space::Generic { self.space } else { other.space },
        }
    }

    /// True if an object with the qualifiers `self` may be accessed through a pointer to `other` (C99 6.5.16.1p1): `other` has all of them, and the
    /// address space is the same.
    #[must_use]
    pub fn may_become(self, other: Qualifiers) -> bool {
        self.space == other.space
            && (other.is_const || !self.is_const)
            && (other.is_volatile || !self.is_volatile)
    }
}

/// A type with its qualifiers.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Qualified {
    /// The qualifiers of the type itself, such as `const` and `volatile`.
    pub qualifiers: Qualifiers,
    /// The type.
    pub ty: Type,
}

impl From<Type> for Qualified {
    fn from(ty: Type) -> Self {
        Qualified { qualifiers: Qualifiers::default(), ty }
    }
}

/// The type of a function: always a prototype, never variadic.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct FunctionType {
    /// The return type.
    pub result: Qualified,
    /// The types of the parameters; array and function parameters are already adjusted to pointers (C99 6.7.5.3p7).
    pub params: Vec<Qualified>,
}

/// A type. A *written* type may name typedefs; a *canonical* one ([`Unit::canonical`]) contains none, and only canonical types are compared.
///
/// Parts are shared, so that a clone costs nothing. No type is nested deeper than [`MAX_TYPE_DEPTH`].
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Type {
    /// `void`.
    Void,
    /// An integer.
    Int(IntKind),
    /// An enumeration: an integer type of the machine's choice (C99 6.7.2.2p4, [`Unit::integer`]).
    Enum(EnumId),
    /// A structure.
    Struct(StructId),
    /// A pointer.
    Pointer(Arc<Qualified>),
    /// An array of elements with a length; `None` if the length is unknown (C99 6.2.5p22).
    Array(Arc<Qualified>, Option<u64>),
    /// A function.
    Function(Arc<FunctionType>),
    /// The name of a typedef.
    Named(SymbolId),
}

impl Type {
    /// `int`.
    pub const INT: Type = Type::Int(IntKind::Int);

    /// A pointer to `target`.
    #[must_use]
    pub fn pointer(target: Qualified) -> Type {
        Type::Pointer(Arc::new(target))
    }

    /// True for arithmetic types and pointers (C99 6.2.5p21); there is no floating point.
    #[must_use]
    pub fn is_scalar(&self) -> bool {
        matches!(self, Type::Int(_) | Type::Enum(_) | Type::Pointer(_))
    }

    /// The type that a pointer points to.
    #[must_use]
    pub fn target(&self) -> Option<&Qualified> {
        if let Type::Pointer(target) = self { Some(target) } else { None }
    }

    /// The structure, if this type is a structure.
    #[must_use]
    pub fn as_struct(&self) -> Option<StructId> {
        if let Type::Struct(id) = self { Some(*id) } else { None }
    }

    /// The function type, if this type is a function.
    #[must_use]
    pub fn as_function(&self) -> Option<&Arc<FunctionType>> {
        if let Type::Function(function) = self { Some(function) } else { None }
    }

    /// True for integers and enumerations.
    #[must_use]
    pub fn is_integer(&self) -> bool {
        matches!(self, Type::Int(_) | Type::Enum(_))
    }

    /// The nesting of the type; a name counts as one level.
    #[must_use]
    pub fn depth(&self) -> usize {
        match self {
            Type::Void | Type::Int(_) | Type::Enum(_) | Type::Struct(_) | Type::Named(_) => 1,
            Type::Pointer(target) | Type::Array(target, _) => 1 + target.ty.depth(),
            Type::Function(function) => {
                let params = function.params.iter().map(|param| param.ty.depth());
                1 + params.fold(function.result.ty.depth(), usize::max)
            }
        }
    }
}

/// The sizes of a machine (C99 5.2.4.2.1, 6.2.6, 6.7.2.2p4).
///
/// Signed integers are in two's complement, and a conversion to a signed type that does not contain the value wraps: C99 6.3.1.3p3 leaves it to the
/// implementation, and gcc, clang, avr-gcc and sdcc document this choice. A right shift of a negative number is arithmetic (C99 6.5.7p5, likewise).
/// Overflow of signed arithmetic stays undefined (C99 6.5p5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machine {
    /// Bits of `int`: 16 or 32.
    pub int_bits: u32,
    /// Bits of `long`: 32 or 64.
    pub long_bits: u32,
    /// Bytes of a pointer to an object.
    pub pointer_bytes: u64,
    /// The size in bytes of a pointer to a function or to program memory.
    pub code_pointer_bytes: u64,
    /// The largest alignment in bytes: 1 on machines without alignment.
    pub max_align: u64,
    /// True if `char` is signed.
    pub has_signed_char: bool,
    /// True if an enumeration has the smallest type that contains its values; otherwise it is `unsigned`, or `int` if a value is negative.
    pub has_short_enums: bool,
}

impl Machine {
    /// The number of bits of the value representation; a `_Bool` has one.
    #[must_use]
    pub fn bits(&self, kind: IntKind) -> u32 {
        match kind {
            IntKind::Bool => 1,
            IntKind::Char | IntKind::SChar | IntKind::UChar => 8,
            IntKind::Short | IntKind::UShort => 16,
            IntKind::Int | IntKind::UInt => self.int_bits,
            IntKind::Long | IntKind::ULong => self.long_bits,
            IntKind::LLong | IntKind::ULLong => 64,
        }
    }

    /// True if the type has negative values.
    #[must_use]
    pub fn is_signed(&self, kind: IntKind) -> bool {
        match kind {
            IntKind::Char => self.has_signed_char,
            IntKind::SChar | IntKind::Short | IntKind::Int | IntKind::Long | IntKind::LLong => true,
            IntKind::Bool
            | IntKind::UChar
            | IntKind::UShort
            | IntKind::UInt
            | IntKind::ULong
            | IntKind::ULLong => false,
        }
    }

    /// The smallest and the largest value of a type.
    #[must_use]
    pub fn range(&self, kind: IntKind) -> (i128, i128) {
        let bits = self.bits(kind);
        if self.is_signed(kind) {
            (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)
        } else {
            (0, (1 << bits) - 1)
        }
    }

    /// A value converted to a type (C99 6.3.1.2, 6.3.1.3): `_Bool` compares with 0, all others wrap.
    #[must_use]
    pub fn wrap(&self, value: i128, kind: IntKind) -> i128 {
        if kind == IntKind::Bool {
            return i128::from(value != 0);
        }
        let (lo, hi) = self.range(kind);
        (value - lo).rem_euclid(hi - lo + 1) + lo
    }

    /// Integer promotion (C99 6.3.1.1p2): `int` if that contains all values, otherwise `unsigned`; types whose rank is at least that of `int` are not changed.
    #[must_use]
    pub fn promoted(&self, kind: IntKind) -> IntKind {
        if kind.rank() >= IntKind::Int.rank() {
            return kind;
        }
        let (_, hi) = self.range(kind);
        if hi <= self.range(IntKind::Int).1 { IntKind::Int } else { IntKind::UInt }
    }

    /// The common type of two operands: the usual arithmetic conversions (C99 6.3.1.8).
    #[must_use]
    pub fn common(&self, a: IntKind, b: IntKind) -> IntKind {
        let (a, b) = (self.promoted(a), self.promoted(b));
        let (is_a, is_b) = (self.is_signed(a), self.is_signed(b));
        if is_a == is_b {
            return if a.rank() >= b.rank() { a } else { b };
        }
        let (signed, unsigned) = if is_a { (a, b) } else { (b, a) };
        if unsigned.rank() >= signed.rank() {
            unsigned
        } else if self.bits(signed) > self.bits(unsigned) {
            signed
        } else {
            signed.unsigned()
        }
    }

    /// The signed or unsigned integer type with exactly `bits` bits, as `<stdint.h>` defines it.
    #[must_use]
    pub fn exact(&self, bits: u32, is_signed: bool) -> IntKind {
        let signed = match bits {
            8 => IntKind::SChar,
            16 if self.int_bits == 16 => IntKind::Int,
            16 => IntKind::Short,
            32 if self.int_bits == 32 => IntKind::Int,
            32 => IntKind::Long,
            _ if self.long_bits == 64 => IntKind::Long,
            _ => IntKind::LLong,
        };
        if is_signed { signed } else { signed.unsigned() }
    }

    /// The type of `sizeof` (C99 7.17p2).
    #[must_use]
    pub fn size_type(&self) -> IntKind {
        if self.long_bits == 64 { IntKind::ULong } else { IntKind::UInt }
    }

    /// The type of a difference of pointers (C99 7.17p2).
    #[must_use]
    pub fn difference_type(&self) -> IntKind {
        if self.long_bits == 64 { IntKind::Long } else { IntKind::Int }
    }
}

impl Unit {
    /// The type without typedef names; the qualifiers of a typedef are added to those of its use. Qualifiers of an array are those of its elements
    /// (C99 6.7.3p8).
    #[must_use]
    pub fn canonical(&self, written: &Qualified) -> Qualified {
        let own = written.qualifiers;
        match &written.ty {
            Type::Named(id) => {
                let meant = &self.symbols[*id].canonical;
                if let Type::Array(element, len) = &meant.ty {
                    let qualifiers = element.qualifiers.with(own);
                    let element = Qualified { qualifiers, ty: element.ty.clone() };
                    return Type::Array(Arc::new(element), *len).into();
                }
                Qualified { qualifiers: meant.qualifiers.with(own), ty: meant.ty.clone() }
            }
            Type::Pointer(target) => {
                Qualified { qualifiers: own, ty: Type::pointer(self.canonical(target)) }
            }
            Type::Array(element, len) => {
                let mut element = self.canonical(element);
                element.qualifiers = element.qualifiers.with(own);
                Type::Array(Arc::new(element), *len).into()
            }
            Type::Function(function) => {
                let result = self.canonical(&function.result).ty.into();
                // Qualifiers of a parameter itself are not part of the type (C99 6.7.5.3p15).
                let params = function.params.iter().map(|one| self.canonical(one).ty.into());
                Type::Function(Arc::new(FunctionType { result, params: params.collect() })).into()
            }
            Type::Void | Type::Int(_) | Type::Enum(_) | Type::Struct(_) => written.clone(),
        }
    }

    /// True if the type, its elements or its members are `const`.
    #[must_use]
    pub fn has_const(&self, ty: &Qualified) -> bool {
        let inner = match &ty.ty {
            Type::Array(element, _) => self.has_const(element),
            Type::Struct(id) => self.structs[*id].has_const,
            _ => false,
        };
        inner || ty.qualifiers.is_const
    }

    /// True if every scalar of an object of the type is `const`, so that its value never changes.
    #[must_use]
    pub fn is_const(&self, ty: &Qualified) -> bool {
        let inner = match &ty.ty {
            Type::Array(element, _) => self.is_const(element),
            Type::Struct(id) => self.structs[*id].is_const,
            _ => false,
        };
        inner || ty.qualifiers.is_const
    }

    /// The number of scalars of an object of a canonical type, `u64::MAX` if there are more; `None` for types without objects.
    #[must_use]
    pub fn n_scalars(&self, ty: &Type) -> Option<u64> {
        match ty {
            Type::Int(_) | Type::Enum(_) | Type::Pointer(_) => Some(1),
            Type::Array(element, len) => Some(self.n_scalars(&element.ty)?.saturating_mul((*len)?)),
            Type::Struct(id) => {
                let data = &self.structs[*id];
                data.layout.map(|_| data.n_scalars)
            }
            Type::Void | Type::Function(_) | Type::Named(_) => None,
        }
    }

    /// How deep structures are nested in a type: 0 if there is none.
    #[must_use]
    pub fn struct_nesting(&self, ty: &Type) -> usize {
        match ty {
            Type::Array(element, _) => self.struct_nesting(&element.ty),
            Type::Struct(id) => self.structs[*id].nesting,
            _ => 0,
        }
    }

    /// The integer type of a canonical type, if it is an integer or an enumeration.
    #[must_use]
    pub fn integer(&self, ty: &Type) -> Option<IntKind> {
        match ty {
            Type::Int(kind) => Some(*kind),
            Type::Enum(id) => Some(self.enums[*id].kind),
            _ => None,
        }
    }

    /// Size and alignment in bytes of a canonical type; `None` for functions, `void`, and structures and arrays that are not complete.
    #[must_use]
    pub fn layout(&self, ty: &Type) -> Option<(u64, u64)> {
        let machine = &self.machine;
        let simple = |size: u64| (size, size.min(machine.max_align));
        match ty {
            Type::Int(_) | Type::Enum(_) => {
                let kind = self.integer(ty)?;
                Some(simple(u64::from(machine.bits(kind).div_ceil(8))))
            }
            Type::Pointer(target) => {
                let is_code = matches!(target.ty, Type::Function(_))
                    || target.qualifiers.space != Space::Generic;
                let size = if is_code { machine.code_pointer_bytes } else { machine.pointer_bytes };
                Some(simple(size))
            }
            Type::Array(element, len) => {
                let (size, align) = self.layout(&element.ty)?;
                Some((size.checked_mul((*len)?)?, align))
            }
            Type::Struct(id) => self.structs[*id].layout,
            Type::Void | Type::Function(_) | Type::Named(_) => None,
        }
    }

    /// The layout of a structure with these members (C99 6.7.2.1p10..15): each member is at the next multiple of its alignment, and up to eight consecutive
    /// one-bit members share a byte.
    #[must_use]
    pub fn layout_of(&self, members: &[Member]) -> Option<(u64, u64)> {
        let (mut size, mut align, mut n_bits) = (0_u64, 1, 0_u32);
        for member in members {
            n_bits = if member.is_bit { n_bits + 1 } else { 0 };
            if member.is_bit && n_bits % 8 != 1 {
                continue;
            }
            let (own, own_align) = self.layout(&member.canonical.ty)?;
            size = size.checked_next_multiple_of(own_align.max(1))?.checked_add(own)?;
            align = align.max(own_align);
        }
        Some((size.checked_next_multiple_of(align)?, align))
    }
}
