//! The bytes of an object, read through a pointer to `unsigned char` (C99 6.2.6.1p4), and reads through a pointer to a volatile type.
//!
//! All machines of the proof store the low byte of a number first, and the first of consecutive one-bit members in the lowest bit. Bits between members, and
//! bytes of members that were never set or are pointers, may have any value at each read. Where the C is executed with known values, they are 0.

use grafsynth_c::tree::types::{IntKind, Qualified, Type};
use grafsynth_c::tree::{Expr, ExprKind, Place, PlaceKind, StructId, Unit};

use super::exec::{Done, Program};
use super::memory::{Address, Memory, Pointer, Scalar, n_cells};
use super::value::Int;
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// A part of a byte: bits of a cell, from one of its bits on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    cell: usize,
    /// The first bit of the cell, and its position in the byte.
    from: u32,
    to: u32,
    n_bits: u32,
}

impl<'u> Program<'u> {
    /// A pointer to a structure or to a `bool` as one to its bytes, which may only be read.
    pub(super) fn as_bytes(
        &self,
        cases: &[(Pointer, Lit)],
        from: &Type,
        to: &Qualified,
    ) -> Option<Scalar> {
        if self.unit.integer(&to.ty) != Some(IntKind::UChar) || !to.qualifiers.is_const {
            return None;
        }
        let from = &from.target()?.ty;
        if *from == Type::Int(IntKind::Bool) && self.unit.machine.bits(IntKind::Bool) <= 8 {
            // The only byte of a `bool` is 0 or 1.
            return Some(Scalar::Pointer(cases.to_vec()));
        }
        let id = from.as_struct()?;
        let bytes = cases.iter().map(|(pointer, when)| match pointer {
            Pointer::To(address, _) => Some((Pointer::Bytes(*address, id), *when)),
            Pointer::Null | Pointer::Function(_) | Pointer::Bytes(..) => None,
        });
        bytes.collect::<Option<Vec<_>>>().map(Scalar::Pointer)
    }

    /// The value of a place that is a byte of an object: an element behind a local pointer, at a known index. `None` for any other place.
    pub(super) fn byte(&mut self, place: &'u Place, memory: &mut Memory) -> Done<Option<Int>> {
        let PlaceKind::At(pointer, index) = &place.kind else { return Ok(None) };
        let Some(Pointer::Bytes(address, id)) = self.local_pointer(pointer, memory) else {
            return Ok(None);
        };
        let at = self.int(index, memory)?.as_constant();
        let at = at.and_then(|at| usize::try_from(at).ok());
        let at = at.ok_or("reading a byte at a variable index is not supported")?;
        let bytes = bytes_of(self.unit, id).ok_or("the memory layout of an object is not known")?;
        let Some(parts) = bytes.get(at) else {
            self.oblige(Lit::TRUE, "uses an index outside of its array", place.span);
            return Ok(Some(Int::constant(0)));
        };
        let mut bits = vec![None; 8];
        for part in parts {
            let cell = self.at(address.behind(part.cell), memory)?;
            let Some(Scalar::Int(value)) = cell.value.as_ref().filter(|_| cell.unset == Lit::FALSE)
            else {
                continue;
            };
            let number = value.number(&mut self.aig);
            for bit in 0..part.n_bits {
                let to = (part.to + bit) as usize;
                if let Some(place) = bits.get_mut(to) {
                    *place = Some(number.bit((part.from + bit) as usize));
                }
            }
        }
        let mut all: Vec<Lit> =
            bits.into_iter().map(|bit| bit.unwrap_or_else(|| self.unknown_bit())).collect();
        all.push(Lit::FALSE);
        Ok(Some(Int::Word(Number::of_bits(all))))
    }

    fn unknown_bit(&mut self) -> Lit {
        if self.is_executed { Lit::FALSE } else { self.aig.variable() }
    }

    /// The only value of a local pointer, read without effects.
    fn local_pointer(&self, expr: &Expr, memory: &Memory) -> Option<Pointer> {
        let ExprKind::Read(place) = &expr.kind else { return None };
        let PlaceKind::Symbol(symbol) = &place.kind else { return None };
        let object = *self.frames.last()?.get(symbol)?;
        let cell = self.at(Address { object, cell: 0 }, memory).ok()?;
        match (&cell.value, cell.unset) {
            (Some(Scalar::Pointer(cases)), Lit::FALSE) => match cases.as_slice() {
                [(pointer, Lit::TRUE)] => Some(*pointer),
                _ => None,
            },
            _ => None,
        }
    }

    /// True if an object or a member is volatile itself. An access through a pointer to a volatile type has the value of the object (C99 6.7.3p5).
    pub(super) fn is_declared_volatile(&self, place: &Place) -> bool {
        match &place.kind {
            PlaceKind::Symbol(_) => place.qualifiers.is_volatile,
            PlaceKind::Member(base, member) => {
                let members = base.ty.as_struct().map(|id| &self.unit.structs[id].members);
                let own = members.and_then(|members| members.get(*member));
                own.is_none_or(|own| own.canonical.qualifiers.is_volatile)
            }
            PlaceKind::Element(..) | PlaceKind::At(..) | PlaceKind::Deref(_) => false,
        }
    }
}

/// The parts of each byte of a structure; bits that are in no part belong to no member. `None` if the layout is not known.
fn bytes_of(unit: &Unit, id: StructId) -> Option<Vec<Vec<Part>>> {
    let (size, _) = unit.structs[id].layout?;
    let mut all = vec![Vec::new(); usize::try_from(size).ok()?];
    place(unit, &Type::Struct(id), (0, 0), &mut all)?;
    Some(all)
}

/// Adds the parts of an object whose first byte and first cell are given, as [`Unit::layout_of`] places them.
fn place(unit: &Unit, ty: &Type, (at, cell): (u64, usize), all: &mut Vec<Vec<Part>>) -> Option<()> {
    match ty {
        Type::Array(element, len) => {
            let (size, _) = unit.layout(&element.ty)?;
            let step = n_cells(unit, &element.ty)?;
            for index in 0..(*len)? {
                let cells = usize::try_from(index).ok()?.checked_mul(step)?;
                place(unit, &element.ty, (at + index * size, cell + cells), all)?;
            }
        }
        Type::Struct(id) => {
            let (mut offset, mut n_bits, mut cell) = (0_u64, 0_u32, cell);
            for member in &unit.structs[*id].members {
                let ty = &member.canonical.ty;
                n_bits = if member.is_bit { n_bits + 1 } else { 0 };
                if !member.is_bit || n_bits % 8 == 1 {
                    let (own, align) = unit.layout(ty)?;
                    offset = offset.checked_next_multiple_of(align.max(1))?.checked_add(own)?;
                }
                if member.is_bit {
                    let byte = usize::try_from(at + offset - 1).ok()?;
                    let part = Part { cell, from: 0, to: (n_bits - 1) % 8, n_bits: 1 };
                    all.get_mut(byte)?.push(part);
                } else {
                    let (own, _) = unit.layout(ty)?;
                    place(unit, ty, (at + offset - own, cell), all)?;
                }
                cell += n_cells(unit, ty)?;
            }
        }
        Type::Int(_) | Type::Enum(_) => {
            let (size, _) = unit.layout(ty)?;
            for byte in 0..size {
                let from = u32::try_from(byte * 8).ok()?;
                let part = Part { cell, from, to: 0, n_bits: 8 };
                all.get_mut(usize::try_from(at + byte).ok()?)?.push(part);
            }
        }
        Type::Pointer(_) => {}
        Type::Void | Type::Function(_) | Type::Named(_) => return None,
    }
    Some(())
}
