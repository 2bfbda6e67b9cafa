//! The C executed with known values: the execution of the proof, in which every function of the graph is a constant.
//!
//! No compiler is needed, and nothing runs outside this program, so that a text from a stranger can be tried.

use grafsynth_c::tree::Unit;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::{Holds, Place, Representation};
use grafsynth_ir::net::{Net, OutputId, StepId, VarId};
use grafsynth_ir::program::Origin;
use grafsynth_ir::{Span, Valid};
use std::collections::BTreeMap;
use std::rc::Rc;

use super::attempt::Attempt;
use super::exec::Danger;
use super::memory::{Address, Cell, INPUTS, INSTANCE, Memory, OUTPUTS, Object, Pointer, Scalar};
use super::question::{Functions, Subject};
use super::value::Int;
use crate::limits::Limits;
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// C that is executed one reaction at a time.
pub struct Interpreter<'a> {
    attempt: Attempt<'a>,
    /// The memory before the reset.
    blank: Memory,
    /// The members that hold elements of arrays, which no function returns.
    elements: Vec<(VarId, u32, Place)>,
}

/// The memory of the C after a reaction.
#[derive(Debug, Clone)]
pub struct Snapshot {
    memory: Memory,
    /// The active steps.
    active: Vec<StepId>,
}

/// What the C shows after a reaction.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Shown {
    /// The outputs.
    pub outputs: Vec<(OutputId, i64)>,
    /// The active steps, in the order of the net.
    pub active: Vec<StepId>,
    /// The variables with the index of the element, 0 unless it is an array.
    pub vars: Vec<(VarId, u32, i64)>,
    /// The fault; `None` if the C has no function that returns it.
    pub fault: Option<bool>,
}

/// Why a reaction has no result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stuck {
    /// The C does something that the language leaves undefined, here.
    Undefined(&'static str, Span),
    /// The callbacks do not report exactly what a reaction changes.
    Misreported(String),
    /// The text has something that cannot be executed here.
    Unsupported(String),
}

impl From<String> for Stuck {
    fn from(why: String) -> Self {
        Stuck::Unsupported(why)
    }
}

impl<'a> Interpreter<'a> {
    /// Prepares the execution of a unit. `interface` has no state; `state` tells where the elements of arrays are.
    ///
    /// # Errors
    /// The net or the text has something that cannot be executed.
    pub fn new(
        net: &'a Valid<Net>,
        facts: &'a Facts,
        (unit, functions): (&'a Unit, &'a Functions<'a>),
        interface: &'a Representation,
        state: &[(Place, Holds)],
        limits: &'a Limits,
    ) -> Result<Self, String> {
        let subject = Subject {
            net,
            facts,
            further: &[],
            unit,
            functions,
            hint: interface,
            unset: &[],
            is_cut: false,
            limits,
        };
        let mut attempt = Attempt::new(subject, None)?;
        attempt.program.is_executed = true;
        let blank = attempt.memory(None)?;
        let element = |(place, holds): &(Place, Holds)| match holds {
            Holds::Piece(Origin::Var(var), at) if net.vars[*var].len.is_some() => {
                Some((*var, *at, place.clone()))
            }
            _ => None,
        };
        Ok(Interpreter { attempt, blank, elements: state.iter().filter_map(element).collect() })
    }

    /// Calls `NAME_init`.
    ///
    /// # Errors
    /// It does something undefined, or cannot be executed.
    pub fn start(&mut self) -> Result<(Snapshot, Shown), Stuck> {
        let mut memory = self.blank.clone();
        self.attempt.link_callbacks();
        self.attempt.call("_init", &mut memory, None)?;
        let (state, shown) = self.shown(memory)?;
        // The reset reports nothing.
        self.misreported(&state.active, &state.active)?;
        Ok((state, shown))
    }

    /// Calls `NAME_step`, with the inputs by their ids. More ticks than the parameter can count are passed as the largest number.
    ///
    /// # Errors
    /// It does something undefined, or cannot be executed.
    pub fn react(
        &mut self,
        from: &Snapshot,
        dt: u32,
        inputs: &[i64],
    ) -> Result<(Snapshot, Shown), Stuck> {
        let mut memory = from.memory.clone();
        self.put_inputs(&mut memory, inputs)?;
        let name = format!("{}_step", self.attempt.of.hint.prefix);
        let params = self.attempt.function(&name).map(|step| self.attempt.params(step));
        let unit = self.attempt.of.unit;
        let bits = params
            .unwrap_or_default()
            .iter()
            .find_map(|param| unit.integer(&unit.symbols[*param].canonical.ty))
            .map_or(32, |kind| unit.machine.bits(kind));
        let most = if bits < 32 { (1_i64 << bits) - 1 } else { i64::from(i32::MAX) };
        let dt = Number::constant(i64::from(dt).min(most));
        self.attempt.link_callbacks();
        self.attempt.call("_step", &mut memory, Some(&dt))?;
        let (state, shown) = self.shown(memory)?;
        self.misreported(&from.active, &state.active)?;
        Ok((state, shown))
    }

    /// Fails if the callbacks that were called do not report exactly the changes between two sets of active steps.
    fn misreported(&mut self, was: &[StepId], is: &[StepId]) -> Result<(), Stuck> {
        let hint = self.attempt.of.hint;
        let Some(callbacks) = &hint.callbacks else { return Ok(()) };
        // Whether a hidden step is active is not known.
        let active = |of: &[StepId], step: StepId| {
            let is_known = hint.active.iter().any(|(own, _)| *own == step);
            is_known.then(|| Lit::constant(of.contains(&step)))
        };
        let checks =
            self.attempt.report_checks(|_, step| Ok(active(was, step)), |step| active(is, step))?;
        if checks.iter().any(|check| check.broken == Lit::TRUE) {
            let (activated, enabled) = (&callbacks.activated, &callbacks.enabled);
            return Err(Stuck::Misreported(format!(
                "`{activated}` and `{enabled}` are not called for exactly what a reaction changes"
            )));
        }
        if checks.iter().any(|check| check.broken != Lit::FALSE) {
            return Err(Stuck::Unsupported("the arguments of a callback are not known".to_owned()));
        }
        Ok(())
    }

    /// The values of instance and outputs: equal if and only if every later reaction is equal. `None` if one is not known, or if a pointer has a target
    /// that is not constant.
    #[must_use]
    pub fn key(&self, of: &Snapshot) -> Option<Vec<Option<i128>>> {
        let mut key = Vec::new();
        for object in [INSTANCE, OUTPUTS] {
            for cell in of.memory.object(object)?.iter() {
                key.push(match &cell.value {
                    None => None,
                    Some(_) if cell.unset == Lit::TRUE => None,
                    Some(Scalar::Int(value)) => Some(value.as_constant()?),
                    Some(Scalar::Pointer(cases)) => match cases.as_slice() {
                        [(Pointer::To(Address { object: Object::Constant(id), cell }, _), _)] => {
                            Some(((*id as i128) << 64) + *cell as i128)
                        }
                        _ => return None,
                    },
                });
            }
        }
        Some(key)
    }

    fn put_inputs(&mut self, memory: &mut Memory, inputs: &[i64]) -> Result<(), String> {
        let hint = self.attempt.of.hint;
        let structure = self.attempt.structures.inputs;
        let mut words: BTreeMap<usize, i64> = BTreeMap::new();
        for (input, place) in &hint.inputs {
            let (at, kind) = self.attempt.cell_of(structure, place)?;
            let value = inputs.get(input.index()).copied().unwrap_or(0);
            if let Some(bit) = place.bit {
                let word = words.entry(at).or_default();
                *word |= i64::from(value != 0).checked_shl(bit).unwrap_or(0);
                continue;
            }
            let value = Scalar::Int(Int::constant(i128::from(value)));
            let value = self.attempt.typed(value, kind);
            memory.put(INPUTS, at, Rc::new(Cell::of(value)));
        }
        for (at, word) in words {
            let value = Scalar::Int(Int::constant(i128::from(word)));
            memory.put(INPUTS, at, Rc::new(Cell::of(value)));
        }
        Ok(())
    }

    /// The result of a call, after which nothing undefined may have happened.
    fn shown(&mut self, memory: Memory) -> Result<(Snapshot, Shown), Stuck> {
        self.defined()?;
        let Attempt { of, structures, .. } = &self.attempt;
        let (of, outputs, instance) = (*of, structures.outputs, structures.instance);
        let hint = of.hint;
        let mut shown = Shown::default();
        for (output, place) in &hint.outputs {
            let cell = self.attempt.read(&memory, OUTPUTS, outputs, place)?;
            let name = || format!("output `{}` is not set", of.net.outputs[*output].name);
            let value = value_of(&cell).ok_or_else(name)?;
            shown.outputs.push((*output, value));
        }
        for (var, element, place) in &self.elements {
            let cell = self.attempt.read(&memory, INSTANCE, instance, place)?;
            let name = || format!("`{}` is not set", place.member);
            shown.vars.push((*var, *element, value_of(&cell).ok_or_else(name)?));
        }
        for (step, name) in &hint.active {
            if self.answer(name, &memory)? != 0 {
                shown.active.push(*step);
            }
        }
        for (var, name) in &hint.vars {
            shown.vars.push((*var, 0, self.answer(name, &memory)?));
        }
        if let Some(name) = &hint.fault {
            shown.fault = Some(self.answer(name, &memory)? != 0);
        }
        self.defined()?;
        let active = shown.active.clone();
        Ok((Snapshot { memory, active }, shown))
    }

    fn answer(&mut self, name: &str, memory: &Memory) -> Result<i64, String> {
        let value = self.attempt.ask(name, memory)?;
        let value = value.as_constant().and_then(|value| i64::try_from(value).ok());
        value.ok_or_else(|| format!("the result of `{name}` is not known"))
    }

    /// Fails if the last calls did something undefined.
    fn defined(&mut self) -> Result<(), Stuck> {
        let all = std::mem::take(&mut self.attempt.program.obligations);
        for one in all {
            match one.broken.as_constant() {
                Some(true) => match one.what {
                    Danger::Undefined(what) => return Err(Stuck::Undefined(what, one.loc.0)),
                    // Only the proof asks this: here the whole reaction is executed.
                    Danger::Leaves => {}
                },
                Some(false) => {}
                None => return Err(Stuck::Unsupported("it is not known whether the behaviour is defined, because a value is not known".to_owned())),
            }
        }
        Ok(())
    }
}

/// The value of a cell, if it was set.
fn value_of(cell: &Cell) -> Option<i64> {
    match &cell.value {
        Some(Scalar::Int(value)) if cell.unset == Lit::FALSE => {
            value.as_constant().and_then(|value| i64::try_from(value).ok())
        }
        _ => None,
    }
}
