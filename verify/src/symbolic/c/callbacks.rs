//! Callbacks (`--callbacks`): after each reaction, the C calls a function of the user's library once for each step that the reaction activated or deactivated, and
//! another one once for each transition that it enabled. A callback gets no pointer, so it changes nothing that the chart reads.
//!
//! The calls are compared as a set, because their order has no meaning. If the reaction is cut at a loop, the state before it is known only by what the C copied
//! of the instance. The instance of that time is then any instance, also one that no reaction leaves: its members are variables, the copies have their values, and
//! the steps that were active in it are those that the queries return.

use std::rc::Rc;

use grafsynth_c::tree::types::Type;
use grafsynth_c::tree::{Symbol, SymbolKind};
use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::instance::Holds;
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;

use super::attempt::Attempt;
use super::exec::Extern;
use super::locals::kind_at;
use super::memory::{Cell, INSTANCE, Memory, Scalar, whole};
use super::question::{Check, Question};
use super::report::{Callback, Earlier, Report};
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

impl Attempt<'_> {
    /// From here on, the callbacks may be called. Forgets earlier calls.
    pub(super) fn link_callbacks(&mut self) {
        self.program.reports.clear();
        let hint = self.of.hint;
        let Some(callbacks) = &hint.callbacks else { return };
        for (name, of) in
            [(&callbacks.activated, Callback::Activated), (&callbacks.enabled, Callback::Enabled)]
        {
            if let Some(function) = self.function(name) {
                self.program.externs.insert(function, Extern::Callback(of));
            }
        }
    }

    /// The checks that no callback was called since they were linked.
    pub(super) fn no_reports(&mut self) -> Vec<Check> {
        let reports = std::mem::take(&mut self.program.reports);
        let check = |it: Report| Check { question: Question::Callbacks, broken: it.when };
        reports.into_iter().map(check).collect()
    }

    /// The checks that the callbacks since they were linked report what changed. `was` and `is` return whether a step is active before and after the reaction,
    /// or `None` if that is not known: then nothing is checked about it.
    pub(super) fn report_checks(
        &mut self,
        mut was: impl FnMut(&mut Self, StepId) -> Result<Option<Lit>, String>,
        is: impl Fn(StepId) -> Option<Lit>,
    ) -> Result<Vec<Check>, String> {
        let (net, hint) = (self.of.net, self.of.hint);
        let Some(callbacks) = &hint.callbacks else { return Ok(Vec::new()) };
        let reports = std::mem::take(&mut self.program.reports);
        let mut broken = Vec::new();
        let mut known = vec![Lit::FALSE; reports.len()];
        for (step, name) in &callbacks.steps {
            let code = self.constant(name)?;
            let made = self.reported(&reports, Callback::Activated, code, &mut known);
            let (Some(before), Some(after)) = (was(self, *step)?, is(*step)) else { continue };
            let changes = self.aig().xor(before, after);
            broken.extend(self.unlike(changes, &made));
            for (when, rest) in made {
                let told = rest.first().ok_or("a callback without the state of its step")?;
                let aig = self.aig();
                let told = Number::compare(aig, CompareOp::Ne, told, &Number::constant(0));
                let differs = aig.xor(told, after);
                broken.push(aig.and(when, differs));
            }
        }
        for (transition, name) in &callbacks.transitions {
            let code = self.constant(name)?;
            let requires = &net.transitions[*transition].requires;
            let made = self.reported(&reports, Callback::Enabled, code, &mut known);
            let before = requires.iter().map(|step| was(self, *step));
            let before = before.collect::<Result<Option<Vec<Lit>>, String>>()?;
            let after = requires.iter().map(|step| is(*step)).collect::<Option<Vec<Lit>>>();
            let (Some(before), Some(after)) = (before, after) else { continue };
            let aig = self.aig();
            let (was_enabled, is_enabled) = (aig.and_all(before), aig.and_all(after));
            let becomes = aig.and(is_enabled, !was_enabled);
            broken.extend(self.unlike(becomes, &made));
        }
        for (report, known) in reports.iter().zip(known) {
            broken.push(self.aig().and(report.when, !known));
        }
        let check = |broken| Check { question: Question::Callbacks, broken };
        Ok(broken.into_iter().map(check).collect())
    }

    /// The conditions of the calls of a callback about one object, each with the arguments after the first one. `known` are the conditions that the calls are
    /// about an object that has a constant.
    fn reported<'r>(
        &mut self,
        reports: &'r [Report],
        of: Callback,
        code: i64,
        known: &mut [Lit],
    ) -> Vec<(Lit, &'r [Number])> {
        let mut made = Vec::new();
        for (report, known) in reports.iter().zip(known) {
            let Some((first, rest)) = report.arguments.split_first().filter(|_| report.of == of)
            else {
                continue;
            };
            let aig = &mut self.program.aig;
            let is_it = Number::compare(aig, CompareOp::Eq, first, &Number::constant(code));
            *known = aig.or(*known, is_it);
            let when = aig.and(report.when, is_it);
            if when != Lit::FALSE {
                made.push((when, rest));
            }
        }
        made
    }

    /// The conditions that one of these calls is not made exactly once under a condition, and none of them otherwise.
    fn unlike(&mut self, wanted: Lit, made: &[(Lit, &[Number])]) -> [Lit; 2] {
        let aig = self.aig();
        let (mut once, mut twice) = (Lit::FALSE, Lit::FALSE);
        for (when, _) in made {
            let again = aig.and(once, *when);
            twice = aig.or(twice, again);
            once = aig.or(once, *when);
        }
        [twice, aig.xor(once, wanted)]
    }

    /// The value of an enumerator.
    fn constant(&self, name: &str) -> Result<i64, String> {
        let is_it = |symbol: &&Symbol| symbol.name == name;
        let symbol = self.of.unit.symbols.values().find(is_it);
        match symbol.map(|symbol| &symbol.kind) {
            Some(SymbolKind::Constant(value)) => i64::try_from(*value).ok(),
            _ => None,
        }
        .ok_or_else(|| format!("the text has no constant `{name}`"))
    }

    /// Prepares for copies of the instance in the part before a cut, which starts with this memory.
    pub(super) fn begin_copies(&mut self, start: &Memory) -> Result<(), String> {
        let (Some(_), Some(instance)) = (&self.of.hint.callbacks, self.structures.instance) else {
            return Ok(());
        };
        let copied: Vec<Rc<Cell>> =
            start.object(INSTANCE).map(|cells| cells.to_vec()).unwrap_or_default();
        let mut memory = start.clone();
        let mut cells = Vec::new();
        for (at, own) in copied.iter().enumerate() {
            let cell = match kind_at(self.of.unit, &Type::Struct(instance), at) {
                Some(kind) => Rc::new(Cell::of(Scalar::Int(self.program.any_of(kind)))),
                // A pointer to the image, which never changes.
                None => own.clone(),
            };
            memory.put(INSTANCE, at, cell.clone());
            cells.push(cell);
        }
        self.earlier = Some(Earlier { copied, cells, memory });
        Ok(())
    }

    /// The number of the member of the instance of which a cell is a copy.
    pub(super) fn copy_of(&self, cell: &Rc<Cell>) -> Option<usize> {
        let copied = &self.earlier.as_ref().filter(|_| cell.unset == Lit::FALSE)?.copied;
        copied.iter().position(|own| Rc::ptr_eq(whole(own), whole(cell)))
    }

    /// Whether a step was active in the instance before a reaction that is cut.
    pub(super) fn was_active(&mut self, step: StepId) -> Result<Option<Lit>, String> {
        let hint = self.of.hint;
        let name = &self.of.net.steps[step].name.text;
        let unknown = || format!("whether `{name}` was active before a reaction is not known");
        let memory = self.earlier.as_ref().map(|it| it.memory.clone()).ok_or_else(unknown)?;
        if let Some((_, query)) = hint.active.iter().find(|(own, _)| *own == step) {
            let answer = self.ask(query, &memory)?;
            return Ok(Some(answer.truth(self.aig())));
        }
        for (place, holds) in &hint.state {
            let code = match holds {
                Holds::Piece(Origin::Step(own), _) if *own == step => 1,
                Holds::ActiveOf { steps, .. } => match steps.iter().find(|(own, _)| *own == step) {
                    Some((_, code)) => *code,
                    None => continue,
                },
                _ => continue,
            };
            let cell = self.read(&memory, INSTANCE, self.structures.instance, place)?;
            if let Some(Scalar::Int(value)) = &cell.value {
                return Ok(Some(value.is(self.aig(), i128::from(code))));
            }
        }
        Err(unknown())
    }
}
