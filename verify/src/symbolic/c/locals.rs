//! The locals at a cut of a reaction, scalar by scalar, with what is known about each.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use grafsynth_c::tree::types::{IntKind, Type};
use grafsynth_c::tree::{SymbolId, Unit};
use grafsynth_ir::Gather;
use grafsynth_ir::instance::LocalPart;

use super::attempt::Attempt;
use super::memory::{Cell, Memory, Object, Scalar, member_offset, n_cells};
use super::value::Int;
use crate::symbolic::CONE;
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// A scalar in memory, or one bit of a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Spot {
    pub(super) object: usize,
    pub(super) cell: usize,
    pub(super) bit: Option<u32>,
}

/// What is known about a local at a cut.
#[derive(Debug, Clone)]
pub(super) enum Meaning {
    /// What the hint says.
    Hint(usize),
    /// The number of checks so far.
    Counter,
    /// A value that the loop does not change.
    Kept(Rc<Cell>),
    /// The value that a member of the instance had before the reaction, by the number of its cell.
    Copy(usize),
    /// Nothing: it has no value yet, or any value of its type.
    Nothing,
}

impl Attempt<'_> {
    /// The locals at a cut, with what is known about each. Objects from `first` on belong to the loop.
    pub(super) fn locals(
        &mut self,
        memory: &Memory,
        first: usize,
        varies: &BTreeSet<Spot>,
    ) -> BTreeMap<Spot, Meaning> {
        let mut all = BTreeMap::new();
        let frames = self.program.frames.clone();
        for (symbol, object) in frames.into_iter().flatten() {
            let Object::Changing(number) = object else { continue };
            for spot in self.spots(symbol, number, memory) {
                let Some(cell) = self.cell_at(memory, spot) else { continue };
                let is_int = matches!(cell.value, Some(Scalar::Int(_)));
                let meaning = if let Some(hint) = self.hint_of(symbol, spot) {
                    Meaning::Hint(hint)
                } else if number >= first && is_int {
                    Meaning::Counter
                } else if !varies.contains(&spot) && self.is_constant_in_loop(&cell) {
                    Meaning::Kept(cell)
                } else if let Some(at) = self.copy_of(&cell).filter(|_| !varies.contains(&spot)) {
                    Meaning::Copy(at)
                } else {
                    Meaning::Nothing
                };
                all.insert(spot, meaning);
            }
        }
        all
    }

    /// The scalars of a local; of an array of bytes whose bits the hint describes, these bits.
    fn spots(&self, symbol: SymbolId, object: usize, memory: &Memory) -> Vec<Spot> {
        let name = &self.of.unit.symbols[symbol].name;
        let is_packed = self
            .of
            .hint
            .locals
            .iter()
            .any(|(local, _)| local.name == *name && matches!(local.part, LocalPart::Bit(_)));
        let n = memory.object(object).map_or(0, |cells| cells.len());
        let bits = |cell| {
            let bits = if is_packed { 0..8 } else { 0..0 };
            let whole = (!is_packed).then_some(None);
            bits.map(Some).chain(whole).map(move |bit| Spot { object, cell, bit })
        };
        (0..n).flat_map(bits).collect()
    }

    /// The contents of a scalar.
    pub(super) fn cell_at(&mut self, memory: &Memory, spot: Spot) -> Option<Rc<Cell>> {
        let cell = memory.object(spot.object)?.get(spot.cell)?.clone();
        match (spot.bit, &cell.value) {
            (Some(bit), Some(Scalar::Int(byte))) => {
                let bit = byte.number(self.aig()).bit(bit as usize);
                let value = Cell::of(Scalar::Int(Int::Bit(bit)));
                Some(Rc::new(Cell { unset: cell.unset, ..value }))
            }
            _ => Some(cell),
        }
    }

    /// Replaces a scalar.
    pub(super) fn put_at(&mut self, memory: &mut Memory, spot: Spot, new: Rc<Cell>) {
        let old = memory.object(spot.object).and_then(|cells| cells.get(spot.cell));
        let (Some(bit), Some(old)) = (spot.bit, old) else {
            memory.put(spot.object, spot.cell, new);
            return;
        };
        if let (Some(Scalar::Int(byte)), Some(Scalar::Int(value))) = (&old.value, &new.value) {
            let byte = byte.number(self.aig());
            let value = value.truth(self.aig());
            let own = |at| if at == bit { value } else { byte.bit(at as usize) };
            let bits = (0..8).map(own).chain([Lit::FALSE]).collect();
            let word = Cell::of(Scalar::Int(Int::Word(Number::of_bits(bits))));
            memory.put(spot.object, spot.cell, Rc::new(word));
        }
    }

    /// True if a cell has a value that only inputs and time determine.
    fn is_constant_in_loop(&mut self, cell: &Cell) -> bool {
        if cell.unset != Lit::FALSE {
            return false;
        }
        let lits: Vec<Lit> = match &cell.value {
            Some(Scalar::Int(Int::Bit(lit))) => vec![*lit],
            Some(Scalar::Int(Int::Choice(cases))) => cases.iter().map(|(_, lit)| *lit).collect(),
            Some(Scalar::Int(Int::Word(number))) => number.bits().to_vec(),
            Some(Scalar::Pointer(cases)) => cases.iter().map(|(_, lit)| *lit).collect(),
            None => return false,
        };
        let support = self.program.aig.support(&lits, CONE);
        let inputs: BTreeSet<Lit> = self.model.input_bits.values().copied().gather();
        let known = |lit: &Lit| inputs.contains(lit) || self.constant_in_loop.contains(lit);
        support.is_some_and(|support| support.iter().all(known))
    }

    /// The number of the hint about a scalar of a local.
    fn hint_of(&self, symbol: SymbolId, spot: Spot) -> Option<usize> {
        let cell = spot.cell;
        let data = &self.of.unit.symbols[symbol];
        self.of.hint.locals.iter().position(|(local, _)| {
            if local.name != data.name {
                return false;
            }
            let ty = &data.canonical.ty;
            match (&local.part, ty) {
                (LocalPart::Whole, Type::Int(_)) => cell == 0,
                (LocalPart::Element(at), Type::Array(..)) => cell == *at as usize,
                (LocalPart::Bit(at), Type::Array(..)) => {
                    cell == *at as usize / 8 && spot.bit == Some(at % 8)
                }
                (LocalPart::Member(member), Type::Struct(id)) => {
                    let members = &self.of.unit.structs[*id].members;
                    let at = members.iter().position(|it| it.name == *member);
                    at.and_then(|at| member_offset(self.of.unit, ty, at)) == Some(cell)
                }
                _ => false,
            }
        })
    }

    /// The type of a scalar of a local, if it is an integer.
    pub(super) fn kind_of_local(&self, spot: Spot) -> Option<IntKind> {
        if spot.bit.is_some() {
            return Some(IntKind::Bool);
        }
        let is_it = |it: &Object| *it == Object::Changing(spot.object);
        let mut all = self.program.frames.iter().flatten();
        let (symbol, _) = all.find(|(_, it)| is_it(it))?;
        kind_at(self.of.unit, &self.of.unit.symbols[*symbol].canonical.ty, spot.cell)
    }
}

/// The integer type of a scalar of an object.
pub(super) fn kind_at(unit: &Unit, ty: &Type, cell: usize) -> Option<IntKind> {
    match ty {
        Type::Array(element, _) => {
            let size = n_cells(unit, &element.ty)?.max(1);
            kind_at(unit, &element.ty, cell % size)
        }
        Type::Struct(id) => {
            let mut cell = cell;
            for member in &unit.structs[*id].members {
                let size = n_cells(unit, &member.canonical.ty)?;
                if cell < size {
                    return kind_at(unit, &member.canonical.ty, cell);
                }
                cell -= size;
            }
            None
        }
        ty => unit.integer(ty),
    }
}
