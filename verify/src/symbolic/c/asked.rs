//! Extern conditions of statecharts: whichever part of a reaction calls one, no other call follows in the same reaction, and its value is kept.
//!
//! A local says whether the condition was called, and another one keeps the value. At a cut the first one is any Boolean, and the second one the value of the
//! condition if the first one is true, else anything. Each part must leave the locals so: a call sets the first one, and nothing clears it. So a call under
//! the condition that the first local is false is the only one of a reaction. For a condition without such a local, only the part before the loop may call.

use std::collections::BTreeMap;

use grafsynth_c::tree::types::IntKind;
use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::instance::Carried;
use grafsynth_ir::net::InputId;

use super::attempt::Attempt;
use super::locals::{Meaning, Spot};
use super::memory::{Cell, Memory, Scalar};
use super::net_values::scalar;
use super::value::{Int, compare};
use crate::symbolic::aig::Lit;

impl Attempt<'_> {
    /// At a cut, any conditions may have been called.
    pub(super) fn any_asked(&mut self) {
        for (input, _) in &self.of.hint.conditions {
            let is_noted = self.of.hint.locals.iter().any(|(_, it)| *it == Carried::Asked(*input));
            let before = if is_noted { self.aig().variable() } else { Lit::TRUE };
            self.asked_before.insert(*input, before);
        }
    }

    /// The value at a cut of a local that stores something about an extern condition; `None` for all other locals.
    pub(super) fn asked_at_cut(&mut self, what: &Carried, kind: IntKind) -> Option<Int> {
        let before = |this: &Self, input: &InputId| this.asked_before.get(input).copied();
        match what {
            Carried::Asked(input) => Some(Int::Bit(before(self, input)?)),
            Carried::Answer(input) => {
                let asked = before(self, input)?;
                let Scalar::Int(answer) = scalar(&self.inputs.values[input.index()]) else {
                    return None;
                };
                let other = self.program.any_of(kind);
                Some(Int::merge(self.aig(), &[(asked, answer), (!asked, other)]))
            }
            _ => None,
        }
    }

    /// The condition that such a local has a wrong value at the end of a part; `None` for all other locals.
    pub(super) fn asked_wrongly(
        &mut self,
        what: &Carried,
        value: &Int,
        (locals, memory): (&BTreeMap<Spot, Meaning>, &Memory),
    ) -> Option<Lit> {
        match what {
            Carried::Asked(input) => {
                let none = Lit::FALSE;
                let before = self.asked_before.get(input).copied().unwrap_or(none);
                let here = self.asked_here.get(input).copied().unwrap_or(none);
                let aig = self.aig();
                let (was_asked, is_noted) = (aig.or(before, here), value.truth(aig));
                let is_missing = aig.and(was_asked, !is_noted);
                // At the next cut it is 0 or 1.
                let is_other = value.outside(aig, 0, 1);
                Some(aig.or(is_missing, is_other))
            }
            Carried::Answer(input) => {
                let noted = self.noted(*input, locals, memory);
                let Scalar::Int(answer) = scalar(&self.inputs.values[input.index()]) else {
                    return Some(Lit::TRUE);
                };
                let differ = compare(self.aig(), CompareOp::Ne, value, &answer);
                Some(self.aig().and(noted, differ))
            }
            _ => None,
        }
    }

    /// The literal that a condition was called, from the local that stores it; true if there is no such local.
    fn noted(&mut self, input: InputId, locals: &BTreeMap<Spot, Meaning>, memory: &Memory) -> Lit {
        let hints = &self.of.hint.locals;
        let mut all = Vec::new();
        for (spot, meaning) in locals {
            let Meaning::Hint(hint) = meaning else { continue };
            if hints[*hint].1 != Carried::Asked(input) {
                continue;
            }
            match self.cell_at(memory, *spot).as_deref() {
                Some(Cell { value: Some(Scalar::Int(value)), .. }) => all.push(value.clone()),
                _ => return Lit::TRUE,
            }
        }
        if all.is_empty() {
            return Lit::TRUE;
        }
        let aig = self.aig();
        let ways: Vec<Lit> = all.iter().map(|value| value.truth(aig)).collect();
        aig.or_all(ways)
    }
}
