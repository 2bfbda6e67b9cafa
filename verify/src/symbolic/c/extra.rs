//! What the instance holds besides the state of the net: the ring of `--trace-ring`, the mark of `--safe-state` and the pointer to the image of a chart that an
//! engine interprets; and the safe outputs of a stopped chart.
//!
//! The entries of the ring are not tracked: nothing that is proved reads them, and what they contain is not part of the proof. Their index is, because a wrong
//! one would write elsewhere. The mark of `--safe-state` has one value while the chart runs, so the check before a reaction is part of the proof: it must pass
//! in every state of the chart. After `NAME_stop` the mark has another value, and then each reaction must give the safe outputs and change nothing.

use std::rc::Rc;

use grafsynth_c::tree::types::IntKind;
use grafsynth_ir::expr::{CompareOp, Type as NetType};
use grafsynth_ir::instance::{Extra, Place};
use grafsynth_ir::net::Output;

use super::attempt::Attempt;
use super::byte_code;
use super::memory::{Address, Cell, INPUTS, INSTANCE, Memory, Object, Pointer, Scalar};
use super::question::{Check, Question, Subject};
use super::value::Int;
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

impl<'a> Subject<'a> {
    /// The mark of `--safe-state`: its number in the hint, its place, and its value after a stop.
    pub(super) fn mark(self) -> Option<(usize, &'a Place, i64)> {
        self.hint.extra.iter().enumerate().find_map(|(at, (place, extra))| match extra {
            Extra::Running { stopped, .. } => Some((at, place, *stopped)),
            Extra::UpTo(_) | Extra::Written | Extra::Image => None,
        })
    }
}

impl Attempt<'_> {
    /// Makes the cells of the scalars that hold nothing of the net, for a state between two reactions.
    pub(super) fn hold_extra(&mut self) -> Result<(), String> {
        for (place, extra) in &self.of.hint.extra {
            let cell = match *extra {
                Extra::UpTo(most) => {
                    let (_, kind) = self.cell_of(self.structures.instance, place)?;
                    Cell::of(Scalar::Int(self.up_to(most, kind)))
                }
                Extra::Written => Cell::UNTRACKED,
                Extra::Running { runs, .. } => {
                    Cell::of(Scalar::Int(Int::constant(i128::from(runs))))
                }
                Extra::Image => {
                    self.program.engine = Some(byte_code::call);
                    let image = self.image()?;
                    Cell::of(Scalar::Pointer(vec![(image, Lit::TRUE)]))
                }
            };
            self.extra.push(cell);
        }
        if let Some(gate) = self.gate_cells()? {
            // Each member is a cell of its own, so that a copy of one into another is seen.
            for at in gate.all() {
                self.gate_members.insert(at, Rc::new(Cell::UNSET));
            }
            let mark = self.up_to(2, IntKind::UChar);
            self.gate_members.insert(gate.mark, Rc::new(Cell::of(Scalar::Int(mark))));
        }
        Ok(())
    }

    /// A pointer to the image of the chart.
    fn image(&self) -> Result<Pointer, String> {
        let name = format!("{}_tables", self.of.hint.prefix);
        let mut statics = self.program.statics.iter();
        let found = statics.find(|(symbol, _)| self.of.unit.symbols[**symbol].name == name);
        let (_, object) = found.ok_or_else(|| format!("the text has no constant `{name}`"))?;
        let n = match object {
            Object::Constant(id) => self.program.constants.get(*id).map_or(0, |it| it.len()),
            Object::Changing(_) => 0,
        };
        Ok(Pointer::To(Address { object: *object, cell: 0 }, n))
    }

    /// An element of a queue that is not used: any value of its type. The check of `--safe-state` tests these elements too, so there it is an event or 0.
    pub(super) fn unused_item(&mut self, place: &Place) -> Result<Scalar, String> {
        if self.of.mark().is_none() {
            return self.anything(self.structures.instance, place);
        }
        let n_events = self.with_model(|this| this.model.maker.n_events());
        Ok(Scalar::Int(self.up_to(n_events, IntKind::Int)))
    }

    /// The condition that a value is neither an event nor 0, if the check of `--safe-state` tests it.
    pub(super) fn no_item(&mut self, value: &Int) -> Lit {
        if self.of.mark().is_none() {
            return Lit::FALSE;
        }
        let n_events = self.with_model(|this| this.model.maker.n_events());
        value.outside(self.aig(), 0, i128::from(n_events))
    }

    /// Any number from 0 to `most`.
    fn up_to(&mut self, most: i64, kind: IntKind) -> Int {
        if kind == IntKind::Bool {
            return Int::Bit(self.aig().variable());
        }
        let bits = self.fresh(64 - most.leading_zeros());
        let number = Number::from_code(self.aig(), &bits, 0);
        let fits = Number::compare(self.aig(), CompareOp::Le, &number, &Number::constant(most));
        if fits != Lit::TRUE {
            self.valid.push((bits, fits));
        }
        Int::Word(number)
    }

    /// The checks that these scalars have possible values after the reset, a reaction or a part of one.
    pub(super) fn extra_checks(&mut self, memory: &Memory) -> Result<Vec<Check>, String> {
        let mut checks = Vec::new();
        for (at, (place, extra)) in self.of.hint.extra.iter().enumerate() {
            let question = Question::Extra(at);
            let cell = self.read(memory, INSTANCE, self.structures.instance, place)?;
            if cell.unset != Lit::FALSE {
                checks.push(Check { question: question.clone(), broken: cell.unset });
            }
            let value = match (&cell.value, extra) {
                (_, Extra::Written) => continue,
                (Some(Scalar::Pointer(cases)), Extra::Image) => {
                    let image = self.image()?;
                    let others = cases.iter().filter(|(pointer, _)| *pointer != image);
                    let others: Vec<Lit> = others.map(|(_, when)| *when).collect();
                    checks.push(Check { question, broken: self.aig().or_all(others) });
                    continue;
                }
                (Some(Scalar::Int(value)), _) => value.clone(),
                (_, _) => return Err(format!("`{}` is not set", place.member)),
            };
            let aig = self.aig();
            let broken = match *extra {
                Extra::UpTo(most) => value.outside(aig, 0, i128::from(most)),
                Extra::Running { runs, .. } => !value.is(aig, i128::from(runs)),
                Extra::Written | Extra::Image => continue,
            };
            checks.push(Check { question, broken });
        }
        Ok(checks)
    }

    /// The checks after a call of `NAME_stop`, if the text defines it: each output has its safe value, and nothing of the instance
    /// changes but the mark, which `NAME_stopped` returns.
    pub(super) fn stopped(&mut self, memory: &Memory) -> Result<Vec<Check>, String> {
        let name = format!("{}_stop", self.of.hint.prefix);
        if self.function(&name).is_none() {
            return Ok(Vec::new());
        }
        let mut after = memory.clone();
        self.call("_stop", &mut after, None)?;
        let mut checks = self.safe_outputs(&after)?;
        if let Some((at, place, stopped)) = self.of.mark() {
            for (memory, wanted) in [(memory, false), (&after, true)] {
                let answer = self.ask(&format!("{name}ped"), memory)?;
                let broken = answer.truth(self.aig()).negate_if(wanted);
                checks.push(Check { question: Question::Extra(at), broken });
            }
            let (cell, _) = self.cell_of(self.structures.instance, place)?;
            let now = self.read(&after, INSTANCE, self.structures.instance, place)?;
            let Some(Scalar::Int(value)) = &now.value else {
                return Err(format!("`{}` is not set", place.member));
            };
            let is_stopped = value.is(self.aig(), i128::from(stopped));
            let broken = self.aig().or(!is_stopped, now.unset);
            checks.push(Check { question: Question::Extra(at), broken });
            let before = memory.object(INSTANCE).and_then(|cells| cells.get(cell)).cloned();
            if let Some(before) = before {
                after.put(INSTANCE, cell, before);
            }
        }
        if ![INSTANCE, INPUTS].into_iter().all(|object| after.is_unchanged(memory, object)) {
            return Err(format!("`{name}` changes the instance"));
        }
        Ok(checks)
    }

    /// The checks of a reaction after a stop: each output has its safe value, and nothing else changes.
    pub(super) fn stays_stopped(
        &mut self,
        memory: &Memory,
        dt: &Number,
    ) -> Result<Vec<Check>, String> {
        let Some((_, place, stopped)) = self.of.mark() else { return Ok(Vec::new()) };
        let (cell, _) = self.cell_of(self.structures.instance, place)?;
        let value = Scalar::Int(Int::constant(i128::from(stopped)));
        let mut memory = memory.clone();
        memory.put(INSTANCE, cell, Rc::new(Cell::of(value)));
        let start = memory.clone();
        self.call(self.of.reaction(), &mut memory, Some(dt))?;
        if ![INSTANCE, INPUTS].into_iter().all(|object| memory.is_unchanged(&start, object)) {
            return Err("a reaction after a stop changes the instance".to_owned());
        }
        self.safe_outputs(&memory)
    }

    /// The checks that each output has its safe value.
    fn safe_outputs(&mut self, memory: &Memory) -> Result<Vec<Check>, String> {
        let code = |output: &Output| {
            let lo = match output.ty {
                NetType::Bool => 0,
                NetType::Int { lo, .. } => lo,
            };
            let code = output.safe_value().wrapping_sub(lo);
            (0..output.ty.bits()).map(|bit| Lit::constant(code >> bit & 1 == 1)).collect()
        };
        let codes: Vec<Vec<Lit>> = self.of.net.outputs.values().map(code).collect();
        let mut checks = self.shown_outputs(&codes, memory)?;
        for check in &mut checks {
            // An output after a reaction is another question, which other cases may answer.
            if let Question::Output(at) = check.question {
                check.question = Question::Stopped(at);
            }
        }
        Ok(checks)
    }
}
