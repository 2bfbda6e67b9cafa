//! The memory of the C program: objects as lists of scalar cells, with copies that cost little.

use std::collections::BTreeMap;
use std::rc::Rc;

use grafsynth_c::tree::types::Type;
use grafsynth_c::tree::{StructId, SymbolId, Unit};

use super::value::Int;
use crate::symbolic::aig::{Aig, Lit};

/// The objects of the interface, which are the first ones.
pub(super) const INSTANCE: usize = 0;
pub(super) const OUTPUTS: usize = 1;
pub(super) const INPUTS: usize = 2;

/// A scalar value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Scalar {
    Int(Int),
    /// Pointers with their conditions, of which exactly one is true.
    Pointer(Vec<(Pointer, Lit)>),
}

/// A pointer value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Pointer {
    Null,
    /// The cell, or the aggregate that starts there, and the number of cells of the object or array that it points into.
    To(Address, usize),
    Function(SymbolId),
    /// The first byte of a structure that starts at this cell.
    Bytes(Address, StructId),
}

/// A cell of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Address {
    pub(super) object: Object,
    pub(super) cell: usize,
}

impl Address {
    /// The cell at this distance after it.
    pub(super) fn behind(self, cells: usize) -> Address {
        Address { cell: self.cell + cells, ..self }
    }
}

/// Identifies an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Object {
    /// A constant of the program, which no path changes.
    Constant(usize),
    /// Any other object.
    Changing(usize),
}

/// The contents of a cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cell {
    /// The value; `None` before the first assignment.
    pub(super) value: Option<Scalar>,
    /// The condition that it has no value yet.
    pub(super) unset: Lit,
    /// The cell before values were excluded, if this one keeps only the values that are possible on the current path.
    pub(super) whole: Option<Rc<Cell>>,
}

impl Cell {
    pub(super) const UNSET: Cell = Cell { value: None, unset: Lit::TRUE, whole: None };

    /// Cells without values.
    pub(super) fn unset(n: usize) -> Vec<Rc<Cell>> {
        let cell = Rc::new(Cell::UNSET);
        (0..n).map(|_| cell.clone()).collect()
    }

    /// A cell with a value that is not tracked; nothing may read it.
    pub(super) const UNTRACKED: Cell = Cell { value: None, unset: Lit::FALSE, whole: None };

    pub(super) fn is_untracked(&self) -> bool {
        self.value.is_none() && self.unset == Lit::FALSE
    }

    pub(super) fn of(value: Scalar) -> Cell {
        Cell { value: Some(value), unset: Lit::FALSE, whole: None }
    }
}

/// The cells of an object.
pub(super) type Cells = Rc<Vec<Rc<Cell>>>;

/// All objects that can change, by number. A number is never used twice, so that a pointer to an object that has ended has no target.
#[derive(Debug, Clone, Default)]
pub(super) struct Memory {
    objects: BTreeMap<usize, Cells>,
}

impl Memory {
    /// Adds an object with a new number.
    pub(super) fn add(&mut self, number: usize, cells: Vec<Rc<Cell>>) -> Object {
        self.objects.insert(number, Rc::new(cells));
        Object::Changing(number)
    }

    /// The cells of an object, if it exists.
    pub(super) fn object(&self, number: usize) -> Option<&Cells> {
        self.objects.get(&number)
    }

    /// Removes the objects from this number on.
    pub(super) fn end(&mut self, first: usize) {
        self.objects.split_off(&first);
    }

    /// True if nothing was assigned to an object since `before`; exclusions of values are not assignments.
    pub(super) fn is_unchanged(&self, before: &Memory, object: usize) -> bool {
        let same = |(a, b): (&Rc<Cell>, &Rc<Cell>)| Rc::ptr_eq(whole(a), whole(b));
        match (self.object(object), before.object(object)) {
            (Some(a), Some(b)) => a.len() == b.len() && a.iter().zip(b.iter()).all(same),
            _ => false,
        }
    }

    /// Makes an object what it was before.
    pub(super) fn restore(&mut self, before: &Memory, object: usize) {
        if let Some(cells) = before.object(object) {
            self.objects.insert(object, cells.clone());
        }
    }

    /// True if both are copies of one memory to which nothing was assigned since.
    pub(super) fn is_same(&self, other: &Memory) -> bool {
        self.objects.len() == other.objects.len()
            && self
                .objects
                .iter()
                .zip(&other.objects)
                .all(|(a, b)| a.0 == b.0 && Rc::ptr_eq(a.1, b.1))
    }

    /// Replaces a cell; false if it does not exist.
    pub(super) fn put(&mut self, object: usize, cell: usize, value: Rc<Cell>) -> bool {
        let Some(cells) = self.objects.get_mut(&object) else { return false };
        match Rc::make_mut(cells).get_mut(cell) {
            Some(place) => {
                *place = value;
                true
            }
            None => false,
        }
    }

    /// The memory after several paths, each with its condition, of which exactly one is true. Objects from `first` on were made after the paths
    /// separated, and end here.
    pub(super) fn merge(aig: &mut Aig, all: Vec<(Lit, Memory)>, first: usize) -> Memory {
        let mut all = all;
        all.iter_mut().for_each(|(_, memory)| memory.end(first));
        if all.len() == 1 {
            return all.pop().map(|(_, memory)| memory).unwrap_or_default();
        }
        let mut objects = BTreeMap::new();
        let numbers: Vec<usize> = all
            .first()
            .map(|(_, memory)| memory.objects.keys().copied().collect())
            .unwrap_or_default();
        for number in numbers {
            let versions: Vec<(Lit, &Cells)> = all
                .iter()
                .filter_map(|(when, memory)| Some((*when, memory.object(number)?)))
                .collect();
            let Some((_, first)) = versions.first() else { continue };
            if versions.iter().all(|(_, cells)| Rc::ptr_eq(cells, first)) {
                objects.insert(number, (*first).clone());
                continue;
            }
            let merged = (0..first.len()).map(|cell| {
                let cells: Vec<(Lit, &Rc<Cell>)> =
                    versions.iter().map(|(when, cells)| (*when, &cells[cell])).collect();
                merge_cells(aig, &cells)
            });
            objects.insert(number, Rc::new(merged.collect()));
        }
        Memory { objects }
    }
}

/// A cell before values were excluded.
pub(super) fn whole(cell: &Rc<Cell>) -> &Rc<Cell> {
    let mut cell = cell;
    while let Some(larger) = &cell.whole {
        cell = larger;
    }
    cell
}

/// A cell after several paths, each with its condition, of which exactly one is true.
pub(super) fn merge_cells(aig: &mut Aig, all: &[(Lit, &Rc<Cell>)]) -> Rc<Cell> {
    let Some((_, first)) = all.first() else { return Rc::new(Cell::UNSET) };
    if all.iter().all(|(_, cell)| Rc::ptr_eq(cell, first)) {
        return (*first).clone();
    }
    // No value was assigned; some were only excluded.
    if all.iter().all(|(_, cell)| Rc::ptr_eq(whole(cell), whole(first))) {
        return whole(first).clone();
    }
    if all.iter().any(|(_, cell)| cell.is_untracked()) {
        return Rc::new(Cell::UNTRACKED);
    }
    let unset: Vec<Lit> = all.iter().map(|(when, cell)| aig.and(*when, cell.unset)).collect();
    let unset = aig.or_all(unset);
    // A path without a value has any value.
    let set: Vec<(Lit, &Scalar)> =
        all.iter().filter_map(|(when, cell)| Some((*when, cell.value.as_ref()?))).collect();
    let value = merge_scalars(aig, &set);
    Rc::new(Cell { value, unset, whole: None })
}

/// A value after several paths. `None` if there is none, or if integers and pointers are mixed.
pub(super) fn merge_scalars(aig: &mut Aig, all: &[(Lit, &Scalar)]) -> Option<Scalar> {
    let (_, first) = all.first()?;
    if all.iter().all(|(_, value)| value == first) {
        return Some((*first).clone());
    }
    let mut ints = Vec::new();
    let mut pointers = Vec::new();
    for (when, value) in all {
        match value {
            Scalar::Int(value) => ints.push((*when, value.clone())),
            Scalar::Pointer(cases) => {
                for (pointer, condition) in cases {
                    pointers.push((*pointer, aig.and(*when, *condition)));
                }
            }
        }
    }
    match (ints.is_empty(), pointers.is_empty()) {
        (false, true) => Some(Scalar::Int(Int::merge(aig, &ints))),
        (true, false) => Some(Scalar::Pointer(pointer_cases(aig, pointers))),
        _ => None,
    }
}

/// The cases of a pointer, each target once.
pub(super) fn pointer_cases(aig: &mut Aig, all: Vec<(Pointer, Lit)>) -> Vec<(Pointer, Lit)> {
    let mut by_target: BTreeMap<Pointer, Vec<Lit>> = Default::default();
    for (pointer, condition) in all {
        if condition != Lit::FALSE {
            by_target.entry(pointer).or_default().push(condition);
        }
    }
    if by_target.len() == 1 {
        return by_target.into_keys().map(|pointer| (pointer, Lit::TRUE)).collect();
    }
    by_target.into_iter().map(|(pointer, ways)| (pointer, aig.or_all(ways))).collect()
}

/// The number of cells of an object of a type; `None` for types without objects.
pub(super) fn n_cells(unit: &Unit, ty: &Type) -> Option<usize> {
    unit.n_scalars(ty).filter(|n| *n < u64::MAX).and_then(|n| usize::try_from(n).ok())
}

/// The first cell of a member, counted from the start of its structure.
pub(super) fn member_offset(unit: &Unit, ty: &Type, member: usize) -> Option<usize> {
    let members = &unit.structs[ty.as_struct()?].members;
    members
        .iter()
        .take(member)
        .try_fold(0_usize, |sum, one| sum.checked_add(n_cells(unit, &one.canonical.ty)?))
}
