//! The gate (`--gate`): `NAME_step` skips a reaction that cannot change anything.
//!
//! The proof has two parts. `NAME_reaction` is proved to behave like the net, as `NAME_step` is without a gate, and to leave the members of the gate as they are.
//! In that proof the mark is 0, 1 or 2, and the other members are unset. Here the rest is proved, with calls of `NAME_reaction` that may change everything but
//! these members:
//!
//! - `NAME_step` either calls it once, with its own arguments and before it changes anything of the instance but the members of the gate, or changes nothing at all;
//! - it skips the call only if the mark is 2 and the inputs and ticks are those that the gate stores;
//! - after a call the mark is 2 only if no member of the instance has changed, and if the gate stores these inputs and ticks.
//!
//! So if the mark is 2, a reaction with the stored inputs and ticks leaves the instance as it is, and its outputs are those of the last reaction, which the
//! caller must not have changed: the reaction that set the mark has shown this, and a skipped one keeps it.

use std::collections::BTreeSet;
use std::rc::Rc;

use grafsynth_c::tree::types::Type;
use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::instance::{Gate, Place};

use super::Induction;
use super::attempt::Attempt;
use super::exec::{Done, Made, Program, Replaced};
use super::locals::kind_at;
use super::memory::{
    Cell, INPUTS, INSTANCE, Memory, OUTPUTS, Scalar, member_offset, n_cells, whole,
};
use super::question::{Check, Question, Subject};
use super::value::{Int, compare};
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// The cells of the instance that belong to the gate.
pub(super) struct GateCells {
    pub(super) mark: usize,
    /// The first cell of the inputs, and their number.
    inputs: Option<(usize, usize)>,
    dt: Option<usize>,
}

impl GateCells {
    pub(super) fn all(&self) -> BTreeSet<usize> {
        let (first, n) = self.inputs.unwrap_or((0, 0));
        (first..first + n).chain([self.mark]).chain(self.dt).collect()
    }
}

impl Program<'_> {
    /// Records a call of the replaced function.
    pub(super) fn call_replaced(
        &mut self,
        arguments: &[Scalar],
        memory: &mut Memory,
    ) -> Done<Option<Scalar>> {
        let Some(mut one) = self.replaced.take() else { return Ok(None) };
        let is_same = one.arguments.len() == arguments.len()
            && one.arguments.iter().zip(arguments).all(|(a, b)| self.is_argument(a, b));
        let before = memory.clone();
        for (object, id) in [(INSTANCE, one.instance), (OUTPUTS, one.outputs)] {
            let (Some(cells), Some(id)) = (before.object(object), id) else { continue };
            for (at, cell) in cells.iter().enumerate() {
                let is_kept = object == INSTANCE && one.kept.contains(&at);
                if is_kept || cell.value.is_none() {
                    continue;
                }
                if matches!(cell.value, Some(Scalar::Pointer(_))) {
                    // The proof of the reaction shows that it points to the image afterwards, as before.
                    continue;
                }
                let kind = kind_at(self.unit, &Type::Struct(id), at);
                let kind = kind.ok_or("a member that is not a number is not supported")?;
                let value = self.any_of(kind);
                memory.put(object, at, Rc::new(Cell::of(Scalar::Int(value))));
            }
        }
        one.calls.push(Made { when: self.here, before, after: memory.clone() });
        self.replaced = Some(one);
        if is_same {
            Ok(None)
        } else {
            Err("the step does not pass its own arguments to the reaction".to_owned())
        }
    }

    fn is_argument(&mut self, wanted: &Scalar, found: &Scalar) -> bool {
        match (wanted, found) {
            (Scalar::Int(a), Scalar::Int(b)) => {
                compare(&mut self.aig, CompareOp::Ne, a, b) == Lit::FALSE
            }
            (a, b) => a == b,
        }
    }
}

impl Subject<'_> {
    /// The suffix of the name of the reaction function.
    pub(super) fn reaction(&self) -> &'static str {
        if self.gate().is_some() { "_reaction" } else { "_step" }
    }

    fn gate(&self) -> Option<&Gate> {
        self.hint.gate.as_ref()
    }

    /// Proves the rest of `NAME_step`, if there is a gate.
    pub(super) fn prove_gate(self, total: &mut Induction) -> Result<(), String> {
        let Some(gate) = self.gate() else { return Ok(()) };
        // A reaction that is skipped calls nothing, and compares what it reads.
        let is_blind = !self.hint.inputs.is_empty() && gate.inputs.is_none();
        if is_blind || !self.hint.conditions.is_empty() || !self.hint.actions.is_empty() {
            return Err("a gate cannot skip the reactions of this chart".to_owned());
        }
        let mut attempt = Attempt::new(self, None)?;
        let mut own = Induction::default();
        let checks = attempt.gate()?;
        if self.net.settings.policy.is_statechart() {
            return attempt.settle_all(&checks, false, total);
        }
        for check in checks {
            if let Some(why) = attempt.settle(&check, self.limits.conflicts, &mut own) {
                return Err(why);
            }
        }
        total.same += own.same;
        total.solved += own.solved;
        total.obligations += own.obligations;
        Ok(())
    }
}

impl Attempt<'_> {
    pub(super) fn gate_cells(&self) -> Result<Option<GateCells>, String> {
        let Some(gate) = &self.of.hint.gate else { return Ok(None) };
        let cell = |name: &String| {
            let (cell, _) = self.cell_of(self.structures.instance, &Place::member(name))?;
            Ok::<usize, String>(cell)
        };
        let missing =
            || "the instance has no member that stores the inputs for the gate".to_owned();
        let inputs = match &gate.inputs {
            None => None,
            Some(name) => {
                let (Some(instance), Some(inputs)) =
                    (self.structures.instance, self.structures.inputs)
                else {
                    return Err(missing());
                };
                let (unit, own) = (self.of.unit, Type::Struct(inputs));
                let members = &unit.structs[instance].members;
                let is_it = |member: &grafsynth_c::tree::Member| {
                    member.name == *name && member.canonical.ty == own
                };
                let at = members.iter().position(is_it).ok_or_else(missing)?;
                let first = member_offset(unit, &Type::Struct(instance), at);
                Some((first.ok_or_else(missing)?, n_cells(unit, &own).ok_or_else(missing)?))
            }
        };
        let dt = gate.dt.as_ref().map(cell).transpose()?;
        Ok(Some(GateCells { mark: cell(&gate.mark)?, inputs, dt }))
    }

    /// An error if a reaction may have changed a member of the gate.
    pub(super) fn keeps_gate(&self, memory: &Memory) -> Result<(), String> {
        let cells = memory.object(INSTANCE);
        let is_kept = |(at, member): (&usize, &Rc<Cell>)| {
            let cell = cells.and_then(|cells| cells.get(*at));
            cell.is_some_and(|cell| Rc::ptr_eq(whole(cell), member))
        };
        if self.gate_members.iter().all(is_kept) {
            return Ok(());
        }
        Err("the reaction changes a member of the gate".to_owned())
    }

    /// The check that the reset closes the gate.
    pub(super) fn gate_after_reset(&mut self, memory: &Memory) -> Result<Vec<Check>, String> {
        let Some(gate) = self.gate_cells()? else { return Ok(Vec::new()) };
        let cell = memory.object(INSTANCE).and_then(|cells| cells.get(gate.mark)).cloned();
        let broken = match cell.as_ref().map(|cell| (&cell.value, cell.unset)) {
            Some((Some(Scalar::Int(value)), unset)) => {
                let aig = self.aig();
                let is_zero = value.is(aig, 0);
                aig.or(unset, !is_zero)
            }
            _ => Lit::TRUE,
        };
        Ok(vec![Check { question: Question::Gate, broken }])
    }

    /// The checks of `NAME_step` around the reaction.
    fn gate(&mut self) -> Result<Vec<Check>, String> {
        let gate = self.gate_cells()?.ok_or("there is no gate")?;
        let name = format!("{}{}", self.of.hint.prefix, self.of.reaction());
        let function = self.function(&name).ok_or_else(|| format!("there is no `{name}`"))?;
        let dt = self.dt()?;
        let arguments = self.arguments(function, Some(&dt))?;
        let before = self.before.clone();
        let mut memory = self.memory(Some(&before))?;
        let is_closed = self.any_gate(&gate, &mut memory)?;
        self.any_mark(&mut memory)?;
        let start = memory.clone();
        self.program.replaced = Some(Replaced {
            function,
            arguments,
            instance: self.structures.instance,
            outputs: self.structures.outputs,
            kept: gate.all(),
            calls: Vec::new(),
        });
        self.link();
        self.call("_step", &mut memory, Some(&dt))?;
        let calls = self.program.replaced.take().map(|it| it.calls).unwrap_or_default();
        if !memory.is_unchanged(&start, INPUTS) {
            return Err(format!("`{}_step` changes its inputs", self.of.hint.prefix));
        }
        let mut broken = self.call_checks(&[])?.into_iter().map(|it| it.broken).collect::<Vec<_>>();
        let (mut any, mut twice) = (Lit::FALSE, Lit::FALSE);
        for made in &calls {
            let again = self.aig().and(any, made.when);
            twice = self.aig().or(twice, again);
            any = self.aig().or(any, made.when);
        }
        broken.push(twice);
        broken.extend(self.skipped(&gate, !any, is_closed, &dt, (&start, &memory)));
        for made in &calls {
            broken.extend(self.called(&gate, made, &dt, (&start, &memory))?);
        }
        let as_check = |broken| Check { question: Question::Gate, broken };
        let mut checks: Vec<Check> = broken.into_iter().map(as_check).collect();
        checks.extend(self.obligations());
        Ok(checks)
    }

    /// Gives the members of the gate any possible values: those of inputs and ticks are unset if the mark is 0. Returns the condition that the mark is 2.
    fn any_gate(&mut self, gate: &GateCells, memory: &mut Memory) -> Result<Lit, String> {
        let instance = self.structures.instance.ok_or("there is no instance")?;
        let bits: [Lit; 2] = [self.aig().variable(), self.aig().variable()];
        // The mark is 0, 1 or 2.
        let two = self.aig().and(bits[1], !bits[0]);
        let one = self.aig().and(bits[0], !bits[1]);
        let zero = self.aig().and(!bits[0], !bits[1]);
        let three = self.aig().and(bits[0], bits[1]);
        let ways = [(0, self.aig().or(zero, three)), (1, one), (2, two)];
        let unset = ways[0].1;
        let mark = Int::choice(self.aig(), ways.map(|(value, when)| (i128::from(value), when)));
        memory.put(INSTANCE, gate.mark, Rc::new(Cell::of(Scalar::Int(mark))));
        for at in gate.all().into_iter().filter(|at| *at != gate.mark) {
            let kind = kind_at(self.of.unit, &Type::Struct(instance), at);
            let kind = kind.ok_or("a member of the gate is not a number")?;
            let value = Some(Scalar::Int(self.program.any_of(kind)));
            memory.put(INSTANCE, at, Rc::new(Cell { value, unset, whole: None }));
        }
        Ok(two)
    }

    /// Makes the chart possibly stopped: the code around `NAME_reaction` must be right for a stopped chart too.
    fn any_mark(&mut self, memory: &mut Memory) -> Result<(), String> {
        let Some((_, place, stopped)) = self.of.mark() else { return Ok(()) };
        let (cell, _) = self.cell_of(self.structures.instance, place)?;
        let runs = memory.object(INSTANCE).and_then(|cells| cells.get(cell)).cloned();
        let Some(Scalar::Int(runs)) = runs.and_then(|it| it.value.clone()) else {
            return Err(format!("`{}` is not set", place.member));
        };
        let is_stopped = self.aig().variable();
        let stopped = Int::constant(i128::from(stopped));
        let mark = Int::merge(self.aig(), &[(is_stopped, stopped), (!is_stopped, runs)]);
        memory.put(INSTANCE, cell, Rc::new(Cell::of(Scalar::Int(mark))));
        Ok(())
    }

    /// The condition that two cells have different values; a cell without a value equals only one without a value.
    fn differ(&mut self, a: Option<&Rc<Cell>>, b: Option<&Rc<Cell>>) -> Lit {
        let (Some(a), Some(b)) = (a, b) else { return Lit::TRUE };
        if Rc::ptr_eq(whole(a), whole(b)) {
            return Lit::FALSE;
        }
        let aig = self.aig();
        let sets = aig.xor(a.unset, b.unset);
        let values = match (&a.value, &b.value) {
            (Some(Scalar::Int(a)), Some(Scalar::Int(b))) => compare(aig, CompareOp::Ne, a, b),
            (a, b) if a == b => Lit::FALSE,
            _ => Lit::TRUE,
        };
        aig.or(sets, values)
    }

    /// The conditions that two memories differ in a cell of an object that is not `except`.
    fn differences(
        &mut self,
        object: usize,
        (a, b): (&Memory, &Memory),
        except: &BTreeSet<usize>,
    ) -> Vec<Lit> {
        let (Some(a), Some(b)) = (a.object(object).cloned(), b.object(object).cloned()) else {
            return vec![Lit::TRUE];
        };
        let cells = (0..a.len().max(b.len())).filter(|at| !except.contains(at));
        cells.map(|at| self.differ(a.get(at), b.get(at))).collect()
    }

    /// The conditions that the gate does not store the inputs and the ticks of this reaction.
    fn not_stored(&mut self, gate: &GateCells, dt: &Number, memory: &Memory) -> Vec<Lit> {
        let cells = memory.object(INSTANCE).cloned();
        let cell = |at: usize| cells.as_ref().and_then(|cells| cells.get(at)).cloned();
        let mut broken = Vec::new();
        if let Some((first, n)) = gate.inputs {
            let inputs = memory.object(INPUTS).cloned();
            for at in 0..n {
                let input = inputs.as_ref().and_then(|cells| cells.get(at)).cloned();
                broken.push(self.differ(input.as_ref(), cell(first + at).as_ref()));
            }
        }
        if let Some(at) = gate.dt {
            let now = Rc::new(Cell::of(Scalar::Int(Int::Word(dt.clone()))));
            broken.push(self.differ(Some(&now), cell(at).as_ref()));
        }
        broken
    }

    /// The conditions that a call is skipped wrongly: the mark is not 2, the inputs or ticks are others, or something changes.
    fn skipped(
        &mut self,
        gate: &GateCells,
        skips: Lit,
        is_closed: Lit,
        dt: &Number,
        (start, end): (&Memory, &Memory),
    ) -> Vec<Lit> {
        let mut all = vec![!is_closed];
        all.extend(self.not_stored(gate, dt, start));
        all.extend(self.differences(INSTANCE, (start, end), &BTreeSet::new()));
        all.extend(self.differences(OUTPUTS, (start, end), &BTreeSet::new()));
        all.into_iter().map(|broken| self.program.aig.and(skips, broken)).collect()
    }

    /// The conditions that a call is wrong: something but the gate differs from what the caller or the reaction left, or the mark is wrong.
    fn called(
        &mut self,
        gate: &GateCells,
        made: &Made,
        dt: &Number,
        (start, end): (&Memory, &Memory),
    ) -> Result<Vec<Lit>, String> {
        let own = gate.all();
        let mut all = self.differences(INSTANCE, (start, &made.before), &own);
        all.extend(self.differences(OUTPUTS, (start, &made.before), &BTreeSet::new()));
        all.extend(self.differences(INSTANCE, (&made.after, end), &own));
        all.extend(self.differences(OUTPUTS, (&made.after, end), &BTreeSet::new()));
        let cells = end.object(INSTANCE).cloned().ok_or("there is no instance")?;
        let (_, wrong) = self.mark_of(gate, &made.before)?;
        all.push(wrong);
        let (value, wrong) = self.mark_of(gate, end)?;
        all.push(wrong);
        let aig = self.aig();
        let (is_open, is_closed) = (value.is(aig, 0), value.is(aig, 2));
        for at in own.iter().filter(|at| **at != gate.mark) {
            let unset = cells.get(*at).map_or(Lit::TRUE, |cell| cell.unset);
            all.push(self.aig().and(!is_open, unset));
        }
        let mut changed = self.differences(INSTANCE, (start, end), &own);
        changed.extend(self.not_stored(gate, dt, end));
        all.extend(changed.into_iter().map(|it| self.program.aig.and(is_closed, it)));
        Ok(all.into_iter().map(|broken| self.program.aig.and(made.when, broken)).collect())
    }

    /// The value of the mark, and the condition that it is none of its values.
    fn mark_of(&mut self, gate: &GateCells, memory: &Memory) -> Result<(Int, Lit), String> {
        let cell = memory.object(INSTANCE).and_then(|cells| cells.get(gate.mark)).cloned();
        let Some((Some(Scalar::Int(value)), unset)) = cell.map(|it| (it.value.clone(), it.unset))
        else {
            return Err("the gate member of the instance may be unset".to_owned());
        };
        let aig = self.aig();
        let outside = value.outside(aig, 0, 2);
        Ok((value, aig.or(unset, outside)))
    }
}
