//! The functions and structures of the interface: their objects in memory, and calls.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;
use std::rc::Rc;

use grafsynth_c::tree::types::{IntKind, Type};
use grafsynth_c::tree::{StructId, SymbolId};
use grafsynth_ir::expr::Type as NetType;
use grafsynth_ir::instance::Place;

use super::attempt::{Attempt, Structures};
use super::exec::Extern;
use super::memory::{
    Address, Cell, INPUTS, INSTANCE, Memory, OUTPUTS, Object, Pointer, Scalar, member_offset,
    n_cells,
};
use super::net_values::{differs, scalar};
use super::question::{Check, Question};
use super::value::Int;
use crate::symbolic::aig::Lit;
use crate::symbolic::calls::{self, Call};
use crate::symbolic::number::Number;
use crate::symbolic::state::{State, Value};

/// The maximum number of values in a structure of the interface.
const MAX_CELLS: usize = 1 << 20;

impl Attempt<'_> {
    pub(super) fn function(&self, name: &str) -> Option<SymbolId> {
        self.of.functions.get(name).map(|(function, _)| *function)
    }

    pub(super) fn params(&self, function: SymbolId) -> &[SymbolId] {
        let name = self.of.unit.symbols[function].name.as_str();
        self.of.functions.get(name).map(|(_, params)| *params).unwrap_or_default()
    }

    /// The instance, the outputs, and the inputs; before the reset, instance and outputs have no values.
    pub(super) fn memory(&mut self, state: Option<&[Scalar]>) -> Result<Memory, String> {
        let Structures { instance, inputs, outputs } = self.structures;
        for id in [instance, inputs, outputs].into_iter().flatten() {
            if n_cells(self.of.unit, &Type::Struct(id)).is_none_or(|n| n > MAX_CELLS) {
                return Err(format!("a structure has more than {MAX_CELLS} values"));
            }
        }
        let mut cells = self.unset(instance);
        // Unused bits of words are 0.
        let mut words: BTreeMap<usize, Vec<Lit>> = BTreeMap::new();
        for (number, value) in state.unwrap_or(&[]).iter().enumerate() {
            let place = &self.of.hint.state[number].0;
            let (at, kind) = self.cell_of(instance, place)?;
            if let Some(bit) = place.bit {
                let Scalar::Int(value) = value else { continue };
                let own = value.truth(self.aig());
                let width = self.of.unit.machine.bits(kind);
                put_bit(&mut words, (at, width), bit, own)?;
                continue;
            }
            let value = self.typed(value.clone(), kind);
            // A reaction that reads it before it writes it may read a value that was never set.
            let unset = Lit::constant(self.of.unset.contains(&number));
            cells[at] = Rc::new(Cell { unset, ..Cell::of(value) });
        }
        for (at, word) in words {
            cells[at] = Rc::new(word_cell(word));
        }
        if state.is_some() {
            for (number, value) in self.extra.iter().enumerate() {
                let (at, _) = self.scalar_of(instance, &self.of.hint.extra[number].0)?;
                cells[at] = Rc::new(value.clone());
            }
            for (at, member) in &self.gate_members {
                cells[*at] = member.clone();
            }
        }
        let mut memory = Memory::default();
        self.program.object(&mut memory, cells);
        let cells = self.output_cells(state.is_some())?;
        self.program.object(&mut memory, cells);
        let cells = self.input_cells()?;
        self.program.object(&mut memory, cells);
        Ok(memory)
    }

    /// The outputs. After the reset, the caller may have written any values; unused bits of words stay 0.
    fn output_cells(&mut self, is_set: bool) -> Result<Vec<Rc<Cell>>, String> {
        let outputs = self.structures.outputs;
        let mut cells = self.unset(outputs);
        let mut words: BTreeMap<usize, Vec<Lit>> = BTreeMap::new();
        for (_, place) in self.of.hint.outputs.iter().filter(|_| is_set) {
            let (at, kind) = self.cell_of(outputs, place)?;
            if let Some(bit) = place.bit {
                let own = self.fresh(1)[0];
                let width = self.of.unit.machine.bits(kind);
                put_bit(&mut words, (at, width), bit, own)?;
            } else {
                cells[at] = Rc::new(Cell::of(self.anything(outputs, place)?));
            }
        }
        for (at, bits) in words {
            cells[at] = Rc::new(word_cell(bits));
        }
        Ok(cells)
    }

    /// The inputs. A port register may be copied to a word, so its unused bits may have any value.
    fn input_cells(&mut self) -> Result<Vec<Rc<Cell>>, String> {
        let inputs = self.structures.inputs;
        let mut cells = self.unset(inputs);
        let mut words: BTreeMap<usize, Vec<Lit>> = BTreeMap::new();
        for (input, place) in &self.of.hint.inputs {
            let (at, kind) = self.cell_of(inputs, place)?;
            let value = scalar(&self.inputs.values[input.index()]);
            if let Some(bit) = place.bit {
                let width = self.of.unit.machine.bits(kind) as usize;
                let mut fresh = self.fresh(u32::try_from(width).unwrap_or(0));
                fresh.push(Lit::FALSE);
                let word = words.entry(at).or_insert(fresh);
                if let (Some(place), Scalar::Int(Int::Bit(lit))) =
                    (word.get_mut(bit as usize), value)
                {
                    *place = lit;
                }
            } else {
                cells[at] = Rc::new(Cell::of(self.typed(value, kind)));
            }
        }
        for (at, bits) in words {
            cells[at] = Rc::new(word_cell(bits));
        }
        Ok(cells)
    }

    /// A structure without values.
    fn unset(&self, id: Option<StructId>) -> Vec<Rc<Cell>> {
        let n = id.and_then(|id| n_cells(self.of.unit, &Type::Struct(id))).unwrap_or(0);
        Cell::unset(n)
    }

    /// A value in the form in which its cell stores it: in a `bool`, 0 or 1.
    pub(super) fn typed(&mut self, value: Scalar, kind: IntKind) -> Scalar {
        match value {
            Scalar::Int(value) if kind == IntKind::Bool => {
                Scalar::Int(Int::Bit(value.truth(self.aig())))
            }
            value => value,
        }
    }

    /// The cell of an integer in a structure, and its type.
    pub(super) fn cell_of(
        &self,
        of: Option<StructId>,
        place: &Place,
    ) -> Result<(usize, IntKind), String> {
        let (cell, ty) = self.scalar_of(of, place)?;
        let kind = self.of.unit.integer(ty);
        Ok((cell, kind.ok_or_else(|| format!("the text has no member `{}`", place.member))?))
    }

    /// The cell of a place in a structure, and its type.
    pub(super) fn scalar_of(
        &self,
        of: Option<StructId>,
        place: &Place,
    ) -> Result<(usize, &Type), String> {
        let unit = self.of.unit;
        let missing = || format!("the text has no member `{}`", place.member);
        let mut inner = of;
        let (mut ty, mut cell) = (&Type::Void, 0);
        for name in place.member.split('.') {
            let id = inner.ok_or_else(missing)?;
            let members = &unit.structs[id].members;
            let at = members.iter().position(|member| member.name == name);
            let at = at.ok_or_else(missing)?;
            cell += member_offset(unit, &Type::Struct(id), at).ok_or_else(missing)?;
            ty = &members[at].canonical.ty;
            inner = ty.as_struct();
        }
        if let Type::Array(element, len) = ty {
            let index = place.element.unwrap_or(0);
            if len.is_none_or(|len| u64::from(index) >= len) {
                return Err(missing());
            }
            cell += index as usize * n_cells(unit, &element.ty).ok_or_else(missing)?;
            ty = &element.ty;
        } else if place.element.is_some() {
            return Err(format!("`{}` is not an array", place.member));
        }
        Ok((cell, ty))
    }

    /// The contents of a place in a structure: of a scalar, or of one bit of it.
    pub(super) fn read(
        &mut self,
        memory: &Memory,
        object: usize,
        of: Option<StructId>,
        place: &Place,
    ) -> Result<Rc<Cell>, String> {
        let (cell, _) = self.scalar_of(of, place)?;
        let found = memory.object(object).and_then(|cells| cells.get(cell)).cloned();
        let found = found.ok_or_else(|| format!("the text has no member `{}`", place.member))?;
        let (Some(bit), Some(Scalar::Int(word))) = (place.bit, &found.value) else {
            return Ok(found);
        };
        let bit = word.number(self.aig()).bit(bit as usize);
        Ok(Rc::new(Cell { unset: found.unset, ..Cell::of(Scalar::Int(Int::Bit(bit))) }))
    }

    /// Calls a function of the interface with the arguments that its parameters require.
    pub(super) fn call(
        &mut self,
        suffix: &str,
        memory: &mut Memory,
        dt: Option<&Number>,
    ) -> Result<(), String> {
        let name = format!("{}{suffix}", self.of.hint.prefix);
        let function =
            self.function(&name).ok_or_else(|| format!("the text has no function `{name}`"))?;
        let arguments = self.arguments(function, dt)?;
        self.program.call(function, arguments, memory).map(|_| ())
    }

    pub(super) fn arguments(
        &mut self,
        function: SymbolId,
        dt: Option<&Number>,
    ) -> Result<Vec<Scalar>, String> {
        let Structures { instance, inputs, outputs } = self.structures;
        let mut arguments = Vec::new();
        for param in self.params(function) {
            let symbol = &self.of.unit.symbols[*param];
            let ty = &symbol.canonical.ty;
            let target = ty.target().and_then(|it| it.ty.as_struct());
            let object = match target {
                Some(id) if Some(id) == instance => INSTANCE,
                Some(id) if Some(id) == outputs => OUTPUTS,
                Some(id) if Some(id) == inputs => INPUTS,
                _ => match (dt, self.of.unit.integer(ty)) {
                    (Some(dt), Some(_)) => {
                        arguments.push(Scalar::Int(Int::Word(dt.clone())));
                        continue;
                    }
                    _ => {
                        return Err(format!(
                            "the meaning of the parameter `{}` is not known",
                            symbol.name
                        ));
                    }
                },
            };
            let address = Address { object: Object::Changing(object), cell: 0 };
            let extent = n_cells(self.of.unit, &ty.target().map_or(Type::Void, |it| it.ty.clone()));
            let pointer = Pointer::To(address, extent.unwrap_or(0));
            arguments.push(Scalar::Pointer(vec![(pointer, Lit::TRUE)]));
        }
        Ok(arguments)
    }

    /// From here on, the functions of the user's library may be called. Forgets earlier calls.
    pub(super) fn link(&mut self) {
        let hint = self.of.hint;
        self.program.calls.clear();
        self.program.asked.clear();
        let conditions = hint.conditions.iter().filter(|(input, name)| {
            let ty = self.of.net.inputs[*input].ty;
            self.function(name).is_some_and(|function| self.returns(function, ty))
        });
        let conditions = conditions.map(|(input, name)| {
            (name, Extern::Condition(scalar(&self.inputs.values[input.index()])))
        });
        let actions = hint.actions.iter().map(|(output, name)| (name, Extern::Action(*output)));
        let named = conditions.chain(actions);
        let all = named.filter_map(|(name, known)| Some((self.function(name)?, known))).gather();
        self.program.externs = all;
        self.link_callbacks();
    }

    /// True if the function returns a type that has all values of a type of the net, and for `bool` only these.
    fn returns(&self, function: SymbolId, ty: NetType) -> bool {
        let result = self.of.unit.symbols[function].canonical.ty.as_function();
        let Some(kind) = result.and_then(|it| self.of.unit.integer(&it.result.ty)) else {
            return false;
        };
        let (lo, hi) = ty.bounds();
        let is_value = |value| self.of.unit.machine.wrap(value, kind) == value;
        ty.is_bool() == (kind == IntKind::Bool) && is_value(lo.into()) && is_value(hi.into())
    }

    /// The checks that the calls since [`Attempt::link`] are those of the chart. From here on, no function of the user's library may be called.
    pub(super) fn call_checks(&mut self, wanted: &[Call]) -> Result<Vec<Check>, String> {
        self.program.externs.clear();
        let made = std::mem::take(&mut self.program.calls);
        let asked = std::mem::take(&mut self.program.asked);
        let apart = calls::differ(self.aig(), &made, wanted)?;
        let mut checks: Vec<Check> =
            apart.into_iter().map(|broken| Check { question: Question::Calls, broken }).collect();
        checks.extend(self.no_reports());
        for (at, (input, name)) in self.of.hint.conditions.iter().enumerate() {
            let ways = self.function(name).and_then(|function| asked.get(&function));
            let Some(ways) = ways else { continue };
            let earlier = self.asked_before.get(input).copied().unwrap_or(Lit::FALSE);
            let aig = &mut self.program.aig;
            let (mut any, mut once, mut twice) = (Lit::FALSE, earlier, Lit::FALSE);
            for way in ways {
                let again = aig.and(once, *way);
                twice = aig.or(twice, again);
                once = aig.or(once, *way);
                any = aig.or(any, *way);
            }
            self.asked_here.insert(*input, any);
            checks.push(Check { question: Question::CalledTwice(at), broken: twice });
        }
        Ok(checks)
    }

    /// The answer of a query, which must not change anything.
    pub(super) fn ask(&mut self, name: &str, memory: &Memory) -> Result<Int, String> {
        let function =
            self.function(name).ok_or_else(|| format!("the text has no function `{name}`"))?;
        let arguments = self.arguments(function, None)?;
        let mut after = memory.clone();
        let answer = self.program.call(function, arguments, &mut after)?;
        let objects = [INSTANCE, OUTPUTS, INPUTS];
        if !objects.into_iter().all(|object| after.is_unchanged(memory, object)) {
            return Err(format!("`{name}` changes the instance"));
        }
        match answer {
            Some(Scalar::Int(value)) => Ok(value),
            _ => Err(format!("`{name}` returns no number")),
        }
    }

    /// The checks of the functions that return parts of a state.
    pub(super) fn queries(
        &mut self,
        state: &State,
        fault: Option<Lit>,
        memory: &Memory,
    ) -> Result<Vec<Check>, String> {
        let hint = self.of.hint;
        let mut checks = Vec::new();
        for (at, (step, name)) in hint.active.iter().enumerate() {
            let value = self.ask(name, memory)?;
            let active = Value::Flag(state.active[step.index()]);
            let broken = differs(self.aig(), &value, &active);
            checks.push(Check { question: Question::Active(at), broken });
        }
        for (at, (var, name)) in hint.vars.iter().enumerate() {
            let value = self.ask(name, memory)?;
            let Some(wanted) = state.vars[var.index()].first().cloned() else { continue };
            let broken = differs(self.aig(), &value, &wanted);
            checks.push(Check { question: Question::Var(at), broken });
        }
        if let (Some(fault), Some(name)) = (fault, &hint.fault) {
            let value = self.ask(name, memory)?;
            let broken = differs(self.aig(), &value, &Value::Flag(fault));
            checks.push(Check { question: Question::Fault, broken });
        }
        Ok(checks)
    }
}

/// Sets a bit of a word, which is found by its cell and has this width; its other bits are 0.
fn put_bit(
    words: &mut BTreeMap<usize, Vec<Lit>>,
    (cell, width): (usize, u32),
    bit: u32,
    value: Lit,
) -> Result<(), String> {
    let word = words.entry(cell).or_insert_with(|| vec![Lit::FALSE; width as usize + 1]);
    let place = word.get_mut(bit as usize).filter(|_| bit < width);
    *place.ok_or("a bit is outside of its word")? = value;
    Ok(())
}

/// A word of these bits, of which the last is the sign.
fn word_cell(bits: Vec<Lit>) -> Cell {
    Cell::of(Scalar::Int(Int::Word(Number::of_bits(bits))))
}
