//! Constructors of expressions: they check the constraints of C99 6.5 and insert every implicit conversion.
//!
//! ```
//! use grafsynth_c::Config;
//! use grafsynth_c::tree::types::{IntKind, Type};
//! use grafsynth_c::tree::{BinaryOp, Spelling, Unit};
//!
//! let unit = Unit::new(Config::avr().machine);
//! let byte = unit.literal(200, Spelling::Decimal, IntKind::UChar, Default::default());
//! let sum = unit.binary(BinaryOp::Add, byte.clone(), byte, Default::default())?;
//! assert_eq!(sum.ty, Type::INT); // both operands are promoted
//! # Ok::<(), grafsynth_c::tree::typing::TypeError>(())
//! ```

use super::types::{FunctionType, IntKind, Qualified, Qualifiers, Space, Type};
use super::{
    BinaryOp, Callee, Expr, ExprKind, Loc, LogicalOp, Place, PlaceKind, SizeOfOperand, Spelling,
    Symbol, SymbolId, SymbolKind, UnaryOp, Unit,
};
use grafsynth_ir::diag::counted;
use std::sync::Arc;

/// Why an expression violates a constraint: a message without a location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypeError(pub String);

fn error<T>(message: impl Into<String>) -> Result<T, TypeError> {
    Err(TypeError(message.into()))
}

/// The suffix of an integer literal: `U`, `L`, `UL` and so on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Suffix {
    /// True if the suffix contains `U`.
    pub is_unsigned: bool,
    /// The number of `L` in the suffix.
    pub longs: u8,
}

impl Unit {
    /// A literal of this type.
    #[must_use]
    pub fn literal(&self, value: u64, spelling: Spelling, kind: IntKind, span: Loc) -> Expr {
        Expr { kind: ExprKind::Literal(value, spelling), ty: Type::Int(kind), span }
    }

    /// The type of a literal in a program (C99 6.4.4.1p5): the first type in the list of the standard that contains the value.
    #[must_use]
    pub fn literal_kind(&self, value: u64, is_decimal: bool, suffix: Suffix) -> Option<IntKind> {
        let all = [
            (0, IntKind::Int),
            (0, IntKind::UInt),
            (1, IntKind::Long),
            (1, IntKind::ULong),
            (2, IntKind::LLong),
            (2, IntKind::ULLong),
        ];
        let fits = |kind: IntKind| i128::from(value) <= self.machine.range(kind).1;
        all.into_iter()
            .filter(|(longs, _)| *longs >= suffix.longs)
            .map(|(_, kind)| kind)
            .filter(|kind| {
                let is_signed = self.machine.is_signed(*kind);
                if suffix.is_unsigned { !is_signed } else { is_signed || !is_decimal }
            })
            .find(|kind| fits(*kind))
    }

    /// The object or function that a symbol names.
    ///
    /// # Errors
    /// If the symbol is a type or a constant.
    pub fn place_of(&self, id: SymbolId, span: Loc) -> Result<Place, TypeError> {
        let Symbol { kind, canonical, name, .. } = &self.symbols[id];
        match kind {
            SymbolKind::Object { .. } | SymbolKind::Local { .. } | SymbolKind::Parameter => {
                let Qualified { qualifiers, ty } = canonical.clone();
                let qualifiers = qualifiers_of(qualifiers, &ty);
                Ok(Place { kind: PlaceKind::Symbol(id), ty, qualifiers, span })
            }
            SymbolKind::Function(_) | SymbolKind::Typedef | SymbolKind::Constant(_) => {
                error(format!("`{name}` is not an object"))
            }
        }
    }

    /// A pointer to a function.
    #[must_use]
    pub fn function(&self, id: SymbolId, span: Loc) -> Expr {
        let ty = Type::pointer(self.symbols[id].canonical.clone());
        Expr { kind: ExprKind::Function(id), ty, span }
    }

    /// An enumerator or another constant.
    #[must_use]
    pub fn constant_of(&self, id: SymbolId, span: Loc) -> Expr {
        let ty = self.symbols[id].canonical.ty.clone();
        Expr { kind: ExprKind::Constant(id), ty, span }
    }

    /// The value of a place; an array becomes a pointer to its first element.
    ///
    /// # Errors
    /// If the type of the place is incomplete.
    pub fn read(&self, place: Place) -> Result<Expr, TypeError> {
        let span = place.span;
        if let Type::Array(element, _) = &place.ty {
            let mut element = Qualified::clone(element);
            element.qualifiers = element.qualifiers.with(place.qualifiers);
            let ty = Type::pointer(element);
            return Ok(Expr { kind: ExprKind::Decay(Box::new(place)), ty, span });
        }
        if self.layout(&place.ty).is_none() {
            return error("a value of an incomplete type cannot be read");
        }
        let ty = place.ty.clone();
        Ok(Expr { kind: ExprKind::Read(Box::new(place)), ty, span })
    }

    /// `&place`.
    ///
    /// # Errors
    /// If the place is a one-bit bit-field.
    pub fn address(&self, place: Place, span: Loc) -> Result<Expr, TypeError> {
        if self.is_bit(&place) {
            return error("a bit has no address");
        }
        // The qualifiers of an array are those of its elements.
        let is_array = matches!(place.ty, Type::Array(..));
        let qualifiers = if is_array { Qualifiers::default() } else { place.qualifiers };
        let ty = Type::pointer(Qualified { qualifiers, ty: place.ty.clone() });
        Ok(Expr { kind: ExprKind::Address(Box::new(place)), ty, span })
    }

    fn is_bit(&self, place: &Place) -> bool {
        let PlaceKind::Member(base, index) = &place.kind else { return false };
        base.ty.as_struct().is_some_and(|id| self.structs[id].members[*index].is_bit)
    }

    /// `*pointer`, for a pointer to an object.
    ///
    /// # Errors
    /// If the operand is not a pointer to an object.
    pub fn deref(&self, pointer: Expr, span: Loc) -> Result<Place, TypeError> {
        let target = self.target(&pointer)?;
        Ok(pointed(PlaceKind::Deref(Box::new(pointer)), target, span))
    }

    /// `pointer[index]`.
    ///
    /// # Errors
    /// If the operand is not a pointer to a complete object type, or the index is not an integer.
    pub fn at(&self, pointer: Expr, index: Expr, span: Loc) -> Result<Place, TypeError> {
        let target = self.target(&pointer)?;
        self.check_index(&index)?;
        if self.layout(&target.ty).is_none() {
            return error("an element of an incomplete type has no position");
        }
        Ok(pointed(PlaceKind::At(Box::new(pointer), Box::new(index)), target, span))
    }

    /// An element of an array.
    ///
    /// # Errors
    /// If the place is not an array, or the index is not an integer.
    pub fn element(&self, array: Place, index: Expr, span: Loc) -> Result<Place, TypeError> {
        let Type::Array(element, _) = &array.ty else { return error("this is not an array") };
        self.check_index(&index)?;
        let qualifiers = array.qualifiers.with(element.qualifiers);
        let ty = element.ty.clone();
        let qualifiers = qualifiers_of(qualifiers, &ty);
        let kind = PlaceKind::Element(Box::new(array), Box::new(index));
        Ok(Place { kind, ty, qualifiers, span })
    }

    /// `place.name`.
    ///
    /// # Errors
    /// If the place is not a structure, or the structure has no such member.
    pub fn member(&self, place: Place, name: &str, span: Loc) -> Result<Place, TypeError> {
        let (at, member) = self.find_member(&place.ty, name)?;
        let qualifiers = qualifiers_of(member.qualifiers.with(place.qualifiers), &member.ty);
        let ty = member.ty.clone();
        Ok(Place { kind: PlaceKind::Member(Box::new(place), at), ty, qualifiers, span })
    }

    /// A member of a value.
    ///
    /// # Errors
    /// If the value is not a structure, the structure has no such member, or the member is an array.
    pub fn member_of_value(&self, value: Expr, name: &str, span: Loc) -> Result<Expr, TypeError> {
        let (at, member) = self.find_member(&value.ty, name)?;
        if matches!(member.ty, Type::Array(..)) {
            return error("an array member of a temporary structure value cannot be used");
        }
        let ty = member.ty.clone();
        Ok(Expr { kind: ExprKind::Member(Box::new(value), at), ty, span })
    }

    /// An operator with one operand.
    ///
    /// # Errors
    /// If the operand has no suitable type.
    pub fn unary(&self, op: UnaryOp, a: Expr, span: Loc) -> Result<Expr, TypeError> {
        if op == UnaryOp::Not {
            let a = self.scalar(a)?;
            return Ok(Expr { kind: ExprKind::Unary(op, Box::new(a)), ty: Type::INT, span });
        }
        let a = self.promote(a)?;
        let ty = a.ty.clone();
        Ok(Expr { kind: ExprKind::Unary(op, Box::new(a)), ty, span })
    }

    /// An operator with two operands.
    ///
    /// # Errors
    /// If the operands have no suitable types.
    pub fn binary(&self, op: BinaryOp, a: Expr, b: Expr, span: Loc) -> Result<Expr, TypeError> {
        if matches!(a.ty, Type::Pointer(_)) || matches!(b.ty, Type::Pointer(_)) {
            return self.pointer_operator(op, a, b, span);
        }
        let is_shift = matches!(op, BinaryOp::Shl | BinaryOp::Shr);
        let (a, b) =
            if is_shift { (self.promote(a)?, self.promote(b)?) } else { self.balance(a, b)? };
        let ty = if op.is_comparison() { Type::INT } else { a.ty.clone() };
        Ok(Expr { kind: ExprKind::Binary(op, Box::new(a), Box::new(b)), ty, span })
    }

    /// `a && b` or `a || b`; a chain of one operator is one node.
    ///
    /// # Errors
    /// If an operand is not a scalar.
    pub fn logical(&self, op: LogicalOp, a: Expr, b: Expr, span: Loc) -> Result<Expr, TypeError> {
        let (a, b) = (self.scalar(a)?, self.scalar(b)?);
        let is_chain = matches!(a.kind, ExprKind::Logical(own, _) if own == op);
        let operands = match a {
            Expr { kind: ExprKind::Logical(_, mut operands), .. } if is_chain => {
                operands.push(b);
                operands
            }
            a => vec![a, b],
        };
        Ok(Expr { kind: ExprKind::Logical(op, operands), ty: Type::INT, span })
    }

    /// `condition ? a : b` (C99 6.5.15).
    ///
    /// # Errors
    /// If the arms have no common type.
    pub fn choose(&self, c: Expr, a: Expr, b: Expr, span: Loc) -> Result<Expr, TypeError> {
        let c = self.scalar(c)?;
        let (a, b) = match (&a.ty, &b.ty) {
            (Type::Pointer(_), _) | (_, Type::Pointer(_)) => self.common_pointers(a, b)?,
            (Type::Void, Type::Void) => (a, b),
            (Type::Struct(x), Type::Struct(y)) if x == y => (a, b),
            _ => self.balance(a, b)?,
        };
        let ty = a.ty.clone();
        Ok(Expr { kind: ExprKind::Choose(Box::new(c), Box::new(a), Box::new(b)), ty, span })
    }

    /// `a, b`.
    #[must_use]
    pub fn comma(&self, a: Expr, b: Expr, span: Loc) -> Expr {
        let ty = b.ty.clone();
        Expr { kind: ExprKind::Comma(Box::new(a), Box::new(b)), ty, span }
    }

    /// `(to)a` (C99 6.5.4).
    ///
    /// # Errors
    /// If C has no such conversion.
    pub fn cast(&self, to: Qualified, a: Expr, span: Loc) -> Result<Expr, TypeError> {
        let ty = self.canonical(&to).ty;
        let is_possible = match (&ty, &a.ty) {
            (Type::Void, _) => true,
            (Type::Pointer(to), Type::Pointer(from)) => {
                let is_function = |it: &Qualified| matches!(it.ty, Type::Function(_));
                is_function(to) == is_function(from)
            }
            (to, from) => to.is_scalar() && from.is_scalar(),
        };
        if !is_possible {
            return error(format!("{} cannot be cast to {}", self.name(&a.ty), self.name(&ty)));
        }
        Ok(Expr { kind: ExprKind::Cast(to, Box::new(a)), ty, span })
    }

    /// `place = value`.
    ///
    /// # Errors
    /// If the place cannot be written, or the value has another type.
    pub fn assign(&self, place: Place, value: Expr, span: Loc) -> Result<Expr, TypeError> {
        self.check_modifiable(&place)?;
        let ty = place.ty.clone();
        let value = self.convert_to(value, &ty)?;
        Ok(Expr { kind: ExprKind::Assign(Box::new(place), Box::new(value)), ty, span })
    }

    /// `place op= value`.
    ///
    /// # Errors
    /// If the place cannot be written, or the operands have no suitable types.
    pub fn update(
        &self,
        op: BinaryOp,
        place: Place,
        value: Expr,
        span: Loc,
    ) -> Result<Expr, TypeError> {
        self.check_modifiable(&place)?;
        let ty = place.ty.clone();
        let (value, common) = if let Some(target) = ty.target() {
            if !matches!(op, BinaryOp::Add | BinaryOp::Sub) || !value.ty.is_integer() {
                return error("only an integer can be added to a pointer, or subtracted");
            }
            self.check_steps(target)?;
            (value, ty.clone())
        } else {
            let own = self.integer_of(&ty)?;
            let other = self.integer_of(&value.ty)?;
            if matches!(op, BinaryOp::Shl | BinaryOp::Shr) {
                (self.promote(value)?, Type::Int(self.machine.promoted(own)))
            } else {
                let common = Type::Int(self.machine.common(own, other));
                (convert(value, &common), common)
            }
        };
        let kind = ExprKind::Update(op, Box::new(place), Box::new(value), common);
        Ok(Expr { kind, ty, span })
    }

    /// `++place`, `place--` and so on.
    ///
    /// # Errors
    /// If the place cannot be written or is not a scalar.
    pub fn step(
        &self,
        is_increment: bool,
        is_prefix: bool,
        place: Place,
        span: Loc,
    ) -> Result<Expr, TypeError> {
        self.check_modifiable(&place)?;
        if let Some(target) = place.ty.target() {
            self.check_steps(target)?;
        } else {
            self.integer_of(&place.ty)?;
        }
        let ty = place.ty.clone();
        let place = Box::new(place);
        Ok(Expr { kind: ExprKind::Step { is_increment, is_prefix, place }, ty, span })
    }

    /// A call. The callee is a pointer to a function.
    ///
    /// # Errors
    /// If the callee is not a pointer to a function, or the arguments do not match the parameters.
    pub fn call(&self, callee: Expr, arguments: Vec<Expr>, span: Loc) -> Result<Expr, TypeError> {
        let Some(function) = function_type(&callee.ty) else {
            return error("this is not a function");
        };
        if function.params.len() != arguments.len() {
            let (wanted, got) = (function.params.len(), arguments.len());
            return error(format!(
                "the function takes {}, found {got}",
                counted(wanted, "argument", "arguments")
            ));
        }
        let converted: Result<Vec<Expr>, TypeError> = arguments
            .into_iter()
            .zip(&function.params)
            .map(|(argument, param)| self.convert_to(argument, &param.ty))
            .collect();
        let callee = if let ExprKind::Function(id) = callee.kind {
            Callee::Function(id)
        } else {
            Callee::Pointer(Box::new(callee))
        };
        let ty = function.result.ty.clone();
        Ok(Expr { kind: ExprKind::Call(callee, converted?), ty, span })
    }

    /// `sizeof`.
    ///
    /// # Errors
    /// If the operand has no size.
    pub fn size_of(&self, operand: SizeOfOperand, span: Loc) -> Result<Expr, TypeError> {
        if self.size(&operand).is_none() {
            return error("the operand of `sizeof` has no known size");
        }
        let ty = Type::Int(self.machine.size_type());
        Ok(Expr { kind: ExprKind::SizeOf(Box::new(operand)), ty, span })
    }

    /// The size of an operand of `sizeof` in bytes.
    #[must_use]
    pub fn size(&self, operand: &SizeOfOperand) -> Option<u64> {
        let layout = match operand {
            SizeOfOperand::Type(written) => self.layout(&self.canonical(written).ty),
            SizeOfOperand::Place(place) if self.is_bit(place) => None,
            SizeOfOperand::Place(place) => self.layout(&place.ty),
            SizeOfOperand::Value(value) => self.layout(&value.ty),
        };
        layout.map(|(size, _)| size)
    }

    /// The value converted as by an assignment to an object of this type (C99 6.5.16.1p1).
    ///
    /// # Errors
    /// If there is no implicit conversion.
    pub fn convert_to(&self, value: Expr, ty: &Type) -> Result<Expr, TypeError> {
        let is_possible = match (ty, &value.ty) {
            (Type::Int(IntKind::Bool), from) => from.is_scalar(),
            (Type::Int(_) | Type::Enum(_), from) => from.is_integer(),
            (Type::Struct(to), Type::Struct(from)) => to == from,
            (Type::Pointer(_), _) if self.is_null(&value) => true,
            (Type::Pointer(to), Type::Pointer(from)) => {
                let is_same = to.ty == from.ty
                    || (to.ty == Type::Void || from.ty == Type::Void)
                        && !matches!(
                            (&to.ty, &from.ty),
                            (Type::Function(_), _) | (_, Type::Function(_))
                        );
                is_same && pointee_may_become(from.qualifiers, to.qualifiers)
            }
            _ => false,
        };
        if !is_possible {
            let (from, to) = (self.name(&value.ty), self.name(ty));
            return error(format!("{from} is not converted to {to} without a cast"));
        }
        Ok(convert(value, ty))
    }

    /// An integer after its promotion.
    ///
    /// # Errors
    /// If the operand is not an integer.
    pub fn promote(&self, a: Expr) -> Result<Expr, TypeError> {
        let kind = self.machine.promoted(self.integer_of(&a.ty)?);
        Ok(convert(a, &Type::Int(kind)))
    }

    /// The value, if it has a scalar type; a condition compares such a value with 0.
    ///
    /// # Errors
    /// If the value is not a scalar.
    pub fn scalar(&self, a: Expr) -> Result<Expr, TypeError> {
        if a.ty.is_scalar() {
            Ok(a)
        } else {
            error(format!("{} is not a number or a pointer", self.name(&a.ty)))
        }
    }

    /// A short description of a type for messages.
    #[must_use]
    pub fn name(&self, ty: &Type) -> String {
        format!("`{}`", crate::print::type_name(self, &ty.clone().into()))
    }

    fn balance(&self, a: Expr, b: Expr) -> Result<(Expr, Expr), TypeError> {
        let kind = self.machine.common(self.integer_of(&a.ty)?, self.integer_of(&b.ty)?);
        let ty = Type::Int(kind);
        Ok((convert(a, &ty), convert(b, &ty)))
    }

    fn integer_of(&self, ty: &Type) -> Result<IntKind, TypeError> {
        self.integer(ty).ok_or_else(|| TypeError(format!("{} is not an integer", self.name(ty))))
    }

    fn pointer_operator(
        &self,
        op: BinaryOp,
        a: Expr,
        b: Expr,
        span: Loc,
    ) -> Result<Expr, TypeError> {
        let (a, b, ty) = match (op, &a.ty, &b.ty) {
            (BinaryOp::Add | BinaryOp::Sub, Type::Pointer(target), other) if other.is_integer() => {
                self.check_steps(target)?;
                let ty = a.ty.clone();
                (a, b, ty)
            }
            (BinaryOp::Add, other, Type::Pointer(target)) if other.is_integer() => {
                self.check_steps(target)?;
                let ty = b.ty.clone();
                (a, b, ty)
            }
            (BinaryOp::Sub, Type::Pointer(x), Type::Pointer(y)) if x.ty == y.ty => {
                self.check_steps(x)?;
                (a, b, Type::Int(self.machine.difference_type()))
            }
            _ if op.is_comparison() => {
                let (a, b) = self.common_pointers(a, b)?;
                (a, b, Type::INT)
            }
            _ => return error(format!("`{}` is not an operator for pointers", op.sign())),
        };
        Ok(Expr { kind: ExprKind::Binary(op, Box::new(a), Box::new(b)), ty, span })
    }

    /// Two pointers, one of which may be a null pointer constant, as pointers of one type (C99 6.5.9, 6.5.15p6).
    fn common_pointers(&self, a: Expr, b: Expr) -> Result<(Expr, Expr), TypeError> {
        let ty = match (&a.ty, &b.ty) {
            (Type::Pointer(_), _) if self.is_null(&b) => a.ty.clone(),
            (_, Type::Pointer(_)) if self.is_null(&a) => b.ty.clone(),
            (Type::Pointer(x), Type::Pointer(y))
                if x.qualifiers.space == y.qualifiers.space
                    && (x.ty == y.ty || x.ty == Type::Void || y.ty == Type::Void) =>
            {
                let ty = if x.ty == y.ty { x.ty.clone() } else { Type::Void };
                Type::pointer(Qualified { qualifiers: x.qualifiers.with(y.qualifiers), ty })
            }
            (x, y) => {
                let (x, y) = (self.name(x), self.name(y));
                return error(format!("{x} and {y} have no common type"));
            }
        };
        Ok((convert(a, &ty), convert(b, &ty)))
    }

    /// A null pointer constant (C99 6.3.2.3p3), as a literal.
    fn is_null(&self, value: &Expr) -> bool {
        if let ExprKind::Cast(_, inner) = &value.kind {
            let is_void = |to: &Qualified| *to == Qualified::from(Type::Void);
            return value.ty.target().is_some_and(is_void)
                && matches!(inner.kind, ExprKind::Literal(0, _));
        }
        matches!(value.kind, ExprKind::Null | ExprKind::Literal(0, _))
    }

    fn target(&self, pointer: &Expr) -> Result<Qualified, TypeError> {
        let Some(target) = pointer.ty.target() else {
            return error(format!("{} is not a pointer", self.name(&pointer.ty)));
        };
        if target.ty == Type::Void || target.ty.as_function().is_some() {
            return error(format!("{} is not the type of an object", self.name(&target.ty)));
        }
        Ok(target.clone())
    }

    fn check_index(&self, index: &Expr) -> Result<(), TypeError> {
        self.integer_of(&index.ty).map(|_| ())
    }

    fn check_steps(&self, target: &Qualified) -> Result<(), TypeError> {
        match self.layout(&target.ty) {
            Some(_) => Ok(()),
            None => error("arithmetic on a pointer to an incomplete type is not allowed"),
        }
    }

    fn check_modifiable(&self, place: &Place) -> Result<(), TypeError> {
        if place.qualifiers.is_const || self.has_const(&place.ty.clone().into()) {
            return error("this is `const` and cannot be written");
        }
        if matches!(place.ty, Type::Array(..)) {
            return error("an array cannot be assigned as a whole");
        }
        if self.layout(&place.ty).is_none() {
            return error("an incomplete type cannot be written");
        }
        Ok(())
    }

    fn find_member(&self, ty: &Type, name: &str) -> Result<(usize, &Qualified), TypeError> {
        let Type::Struct(id) = ty else {
            return error(format!("{} is not a structure", self.name(ty)));
        };
        let members = self.structs[*id].members.iter().enumerate();
        let mut found = members.filter(|(_, member)| member.name == name);
        match found.next() {
            Some((at, member)) => Ok((at, &member.canonical)),
            None => error(format!("{} has no member `{name}`", self.name(ty))),
        }
    }
}

/// The function type, if the given type is a pointer to a function.
#[must_use]
pub fn function_type(ty: &Type) -> Option<Arc<FunctionType>> {
    ty.target()?.ty.as_function().map(Arc::clone)
}

/// The expression, with a conversion node if its type differs from `ty`.
fn convert(a: Expr, ty: &Type) -> Expr {
    if a.ty == *ty {
        return a;
    }
    let span = a.span;
    Expr { kind: ExprKind::Convert(Box::new(a)), ty: ty.clone(), span }
}

/// The qualifiers of a place; for an array, also those of its elements (C99 6.7.3p8).
fn qualifiers_of(own: Qualifiers, ty: &Type) -> Qualifiers {
    if let Type::Array(element, _) = ty { own.with(element.qualifiers) } else { own }
}

fn pointed(kind: PlaceKind, target: Qualified, span: Loc) -> Place {
    let qualifiers = qualifiers_of(target.qualifiers, &target.ty);
    Place { kind, ty: target.ty, qualifiers, span }
}

/// Like [`Qualifiers::may_become`], but a generic pointer of sdcc may also point to program memory.
fn pointee_may_become(from: Qualifiers, to: Qualifiers) -> bool {
    let is_generic = from.space == Space::Code && to.space == Space::Generic;
    let from = Qualifiers { space: if is_generic { Space::Generic } else { from.space }, ..from };
    from.may_become(to)
}
