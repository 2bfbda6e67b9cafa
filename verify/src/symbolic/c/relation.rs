//! The relation between the net and the instance: which states correspond to each other, and which outputs are equal.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_c::tree::StructId;
use grafsynth_c::tree::types::IntKind;
use grafsynth_ir::expr::{CompareOp, Type as NetType};
use grafsynth_ir::instance::{Holds, Place};
use grafsynth_ir::net::{EdgeId, HistoryId, StepId};
use grafsynth_ir::program::Origin;

use super::answers::exactly_one;
use super::attempt::Attempt;
use super::memory::{INSTANCE, Memory, OUTPUTS, Scalar};
use super::net_values::{differs, item, piece, queue_of};
use super::question::{Check, Question};
use super::value::Int;
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;
use crate::symbolic::state::{State, Value};
use crate::symbolic::statechart::Tree;
use crate::symbolic::statechart::cut::Which;

impl Attempt<'_> {
    pub(super) fn fresh(&mut self, n_bits: u32) -> Vec<Lit> {
        let bits: Vec<Lit> = (0..n_bits).map(|_| self.aig().variable()).collect();
        self.bit_of.extend(bits.iter().zip(0..).map(|(bit, at): (_, u32)| (*bit, 64 - at)));
        bits
    }

    /// The value of a scalar of the instance before a reaction.
    pub(super) fn held(&mut self, place: &Place, holds: &Holds) -> Result<Scalar, String> {
        match holds {
            Holds::Piece(origin, element) => {
                if let Some(which) = queue_of(*origin) {
                    return self.held_item(place, which, *element);
                }
                if let Origin::Edge(edge) = *origin
                    && self.of.net.settings.policy.is_statechart()
                {
                    return self.held_edge(place, edge);
                }
                match piece(&self.state, *origin, *element) {
                    Some(Value::Flag(lit)) => Ok(Scalar::Int(Int::Bit(lit))),
                    Some(Value::Number(number)) => Ok(Scalar::Int(Int::Word(number))),
                    // The second encoding has no such piece, so the instance may have any value there.
                    None => self.anything(self.structures.instance, place),
                }
            }
            Holds::ActiveOf { steps, none } => {
                self.exclude_each_other(place, steps, none.is_some())?;
                let mut cases: Vec<(i128, Lit)> = steps
                    .iter()
                    .map(|(step, code)| (i128::from(*code), self.state.active[step.index()]))
                    .collect();
                if let Some(none) = none {
                    let any = cases.iter().map(|(_, active)| *active).collect::<Vec<_>>();
                    let any = self.aig().or_all(any);
                    cases.push((i128::from(*none), !any));
                }
                if self.of.net.settings.policy.is_statechart() {
                    let known: Vec<Lit> = cases.iter().map(|(_, when)| *when).collect();
                    let one = exactly_one(self.aig(), known);
                    self.exclusive.push((self.before.len(), !one));
                }
                Ok(Scalar::Int(Int::choice(self.aig(), cases)))
            }
            Holds::Recorded { history, states } => Ok(self.held_record(*history, states)),
            Holds::TimeOf { steps, cap, is_zero_between } => {
                let n_bits = 64 - cap.leading_zeros();
                let bits = self.fresh(n_bits);
                let time = Number::from_code(self.aig(), &bits, 0);
                let largest = Number::constant(*cap);
                let fits = Number::compare(self.aig(), CompareOp::Le, &time, &largest);
                self.time_bits.push((self.before.len(), bits.clone()));
                if fits != Lit::TRUE {
                    self.valid.push((bits, fits));
                }
                let time = if *is_zero_between {
                    let active: Vec<Lit> =
                        steps.iter().map(|step| self.state.active[step.index()]).collect();
                    let any = self.aig().or_all(active);
                    Number::select(self.aig(), any, &time, &Number::constant(0))
                } else {
                    time
                };
                for step in steps {
                    let Some(own) = self.model.maker.shape.elapsed[step.index()] else { continue };
                    let elapsed = self.shown(self.state.active[step.index()], &time, own);
                    self.state.elapsed[step.index()] = Some(elapsed);
                }
                Ok(Scalar::Int(Int::Word(time)))
            }
        }
    }

    /// The last value of an operand: any value if nothing compares it again.
    fn held_edge(&mut self, place: &Place, edge: EdgeId) -> Result<Scalar, String> {
        let state = self.state.clone();
        let used = self.with_model(|this| this.model.maker.compares_later(&state, edge));
        let old = Int::Bit(state.old.get(edge.index()).copied().unwrap_or(Lit::FALSE));
        let other = self.anything(self.structures.instance, place)?;
        let Scalar::Int(other) = other else { return Ok(other) };
        Ok(Scalar::Int(Int::merge(self.aig(), &[(used, old), (!used, other)])))
    }

    /// An element of a queue: any value if it is not used.
    fn held_item(&mut self, place: &Place, which: Which, element: u32) -> Result<Scalar, String> {
        let other = self.unused_item(place)?;
        let state = self.state.clone();
        let item = item(self.aig(), &state, which, element);
        let (Some((number, used)), Scalar::Int(other)) = (item, &other) else { return Ok(other) };
        let ways = [(used, Int::Word(number)), (!used, other.clone())];
        Ok(Scalar::Int(Int::merge(self.aig(), &ways)))
    }

    /// What a history recorded: any of the states, or none. The records of the net follow from it.
    fn held_record(&mut self, history: HistoryId, states: &[(StepId, i64)]) -> Scalar {
        let net = self.of.net;
        let bits: Vec<Lit> = states.iter().map(|_| self.aig().variable()).collect();
        let any = self.aig().or_all(bits.iter().copied());
        let one = exactly_one(self.aig(), bits.iter().copied().chain([!any]));
        self.assumed.push(one);
        for case in &net.histories[history].cases {
            let within = states.iter().zip(&bits);
            let within: Vec<Lit> = within
                .filter(|((step, _), _)| Tree::is_within(net, *step, case.step))
                .map(|(_, bit)| *bit)
                .collect();
            if !within.is_empty() {
                let recorded = self.aig().or_all(within);
                self.state.recorded.insert((history, case.step), recorded);
            }
        }
        let cases = states.iter().zip(&bits).map(|((_, code), bit)| (i128::from(*code), *bit));
        let cases: Vec<(i128, Lit)> = cases.chain([(0, !any)]).collect();
        Scalar::Int(Int::choice(self.aig(), cases))
    }

    /// Assumes the rest of the relation between what histories recorded and the instance.
    pub(super) fn relate_recorded(&mut self) {
        let state = self.state.clone();
        for (at, (_, holds)) in self.of.hint.state.iter().enumerate() {
            let Holds::Recorded { history, states } = holds else { continue };
            let Some(Scalar::Int(value)) = self.before.get(at).cloned() else { continue };
            for broken in self.unrecorded(*history, states, &value, &state) {
                self.assumed.push(!broken);
            }
        }
    }

    /// The conditions under which a scalar is not the number of the state that a history recorded.
    fn unrecorded(
        &mut self,
        history: HistoryId,
        states: &[(StepId, i64)],
        value: &Int,
        state: &State,
    ) -> Vec<Lit> {
        let net = self.of.net;
        let aig = &mut self.program.aig;
        let none = value.is(aig, 0);
        let is: Vec<Lit> =
            states.iter().map(|(_, code)| value.is(aig, i128::from(*code))).collect();
        let mut all = vec![!exactly_one(aig, is.iter().copied().chain([none]))];
        let cases = &net.histories[history].cases;
        let recorded =
            |step: StepId| state.recorded.get(&(history, step)).copied().unwrap_or(Lit::FALSE);
        for case in cases {
            let within = states.iter().zip(&is);
            let within: Vec<Lit> = within
                .filter(|((step, _), _)| Tree::is_within(net, *step, case.step))
                .map(|(_, is)| *is)
                .collect();
            if !within.is_empty() {
                let any = aig.or_all(within);
                all.push(aig.xor(any, recorded(case.step)));
            }
        }
        for ((step, _), is) in states.iter().zip(&is) {
            if cases.iter().any(|case| Tree::is_within(net, *step, case.step)) {
                continue;
            }
            let inside = cases.iter().filter(|case| Tree::is_within(net, case.step, *step));
            let any = aig.or_all(inside.map(|case| recorded(case.step)).collect::<Vec<_>>());
            all.push(aig.xor(*is, any));
        }
        all
    }

    /// The time of a step as the net counts it, from a timer that may count further than the cap.
    pub(super) fn shown(&mut self, active: Lit, time: &Number, cap: i64) -> Number {
        let aig = &mut self.program.aig;
        let capped = time.saturate(aig, 0, cap);
        Number::select(aig, active, &capped, &Number::constant(0))
    }

    /// A scalar without a meaning; it may have any value of its type.
    pub(super) fn anything(
        &mut self,
        of: Option<StructId>,
        place: &Place,
    ) -> Result<Scalar, String> {
        let (_, kind) = self.cell_of(of, place)?;
        if kind == IntKind::Bool {
            return Ok(Scalar::Int(Int::Bit(self.aig().variable())));
        }
        let machine = self.of.unit.machine;
        let mut bits = self.fresh(machine.bits(kind));
        if !machine.is_signed(kind) {
            bits.push(Lit::FALSE);
        }
        Ok(Scalar::Int(Int::Word(Number::of_bits(bits))))
    }

    /// The steps of one code must be one proved component.
    pub(super) fn exclude_each_other(
        &self,
        place: &Place,
        steps: &[(StepId, i64)],
        has_none: bool,
    ) -> Result<(), String> {
        let codes: BTreeSet<i64> = steps.iter().map(|(_, code)| *code).gather();
        // In a statechart this is a question of its own.
        if self.of.net.settings.policy.is_statechart() && codes.len() == steps.len() {
            return Ok(());
        }
        let component = |step: StepId| self.of.facts.component_of.as_ref().and_then(|of| of[step]);
        let first = steps.first().and_then(|(step, _)| component(*step));
        let is_one = match (steps, first) {
            ([_], _) if has_none => true,
            (_, Some(id)) => {
                let data = &self.of.facts.components[id as usize];
                steps.iter().all(|(step, _)| component(*step) == first)
                    && (has_none || data.always && data.steps.len() == steps.len())
            }
            (_, None) => false,
        };
        if is_one && codes.len() == steps.len() {
            return Ok(());
        }
        Err(format!("it is not proved that the steps in `{}` exclude each other", place.member))
    }

    /// The checks that the state of the net and the instance are related.
    pub(super) fn related(
        &mut self,
        state: &State,
        fault: Lit,
        memory: &Memory,
    ) -> Result<Vec<Check>, String> {
        let mut checks = Vec::new();
        for (at, (place, holds)) in self.of.hint.state.iter().enumerate() {
            let question = Question::State(at);
            if self.of.unset.contains(&at) {
                continue;
            }
            let cell = self.read(memory, INSTANCE, self.structures.instance, place)?;
            let value = match (&cell.value, holds) {
                (Some(Scalar::Int(value)), _) => value.clone(),
                (_, Holds::Piece(origin, element))
                    if piece(state, *origin, *element).is_none()
                        && *origin != Origin::Fault
                        && queue_of(*origin).is_none() =>
                {
                    // Nothing may read it before a reaction writes it.
                    let Some(unset) = &mut self.unset else {
                        return Err(format!("`{}` may lose its value", place.member));
                    };
                    unset.push(at);
                    continue;
                }
                _ => return Err(format!("`{}` is not set", place.member)),
            };
            let broken = match holds {
                Holds::Piece(origin, element) if queue_of(*origin).is_some() => {
                    self.wrong_item(*origin, *element, &value, state)
                }
                Holds::Piece(Origin::Edge(edge), _)
                    if self.of.net.settings.policy.is_statechart() =>
                {
                    let used =
                        self.with_model(|this| this.model.maker.compares_later(state, *edge));
                    let all = self.broken(holds, &value, state, fault);
                    all.into_iter().map(|broken| self.program.aig.and(broken, used)).collect()
                }
                _ => self.broken(holds, &value, state, fault),
            };
            let add = |broken| Check { question: question.clone(), broken };
            checks.extend([cell.unset].into_iter().chain(broken).map(add));
        }
        let places = self.of.hint.state.iter().map(|(place, _)| place);
        let instance = (INSTANCE, self.structures.instance);
        checks.extend(self.unused_bits(instance, places, memory, Question::State)?);
        checks.extend(self.extra_checks(memory)?);
        Ok(checks)
    }

    /// The condition under which an element of a queue differs although it is used, between reactions.
    fn wrong_item(&mut self, origin: Origin, element: u32, value: &Int, state: &State) -> Vec<Lit> {
        let outside = self.no_item(value);
        let aig = &mut self.program.aig;
        let found = queue_of(origin).and_then(|which| item(aig, state, which, element));
        let Some((number, used)) = found else { return vec![outside] };
        let differ = differs(aig, value, &Value::Number(number));
        vec![aig.and(used, differ), outside]
    }

    /// The conditions under which a scalar does not have the required value.
    pub(super) fn broken(
        &mut self,
        holds: &Holds,
        value: &Int,
        state: &State,
        fault: Lit,
    ) -> Vec<Lit> {
        if let Holds::Recorded { history, states } = holds {
            return self.unrecorded(*history, states, value, state);
        }
        let aig = &mut self.program.aig;
        let mut all = Vec::new();
        let mut add = |broken: Lit| all.push(broken);
        match holds {
            Holds::Piece(Origin::Fault, _) => {
                let broken = differs(aig, value, &Value::Flag(fault));
                add(broken);
            }
            Holds::Piece(origin, element) => {
                if let Some(wanted) = piece(state, *origin, *element) {
                    let broken = differs(aig, value, &wanted);
                    add(broken);
                }
            }
            Holds::ActiveOf { steps, none } => {
                let mut known = Vec::new();
                for (step, code) in steps {
                    let is = value.is(aig, i128::from(*code));
                    known.push(is);
                    let broken = aig.xor(is, state.active[step.index()]);
                    add(broken);
                }
                if let Some(none) = none {
                    let is = value.is(aig, i128::from(*none));
                    known.push(is);
                }
                let codes: BTreeSet<i128> =
                    steps.iter().map(|(_, code)| *code).chain(*none).map(i128::from).gather();
                let unknown = match value.cases() {
                    Some(cases) => {
                        let other = cases.iter().filter(|(code, _)| !codes.contains(code));
                        aig.or_all(other.map(|(_, when)| *when).collect::<Vec<_>>())
                    }
                    None => !aig.or_all(known),
                };
                add(unknown);
            }
            Holds::TimeOf { steps, cap, is_zero_between } => {
                let outside = value.outside(aig, 0, i128::from(*cap));
                add(outside);
                if *is_zero_between {
                    let active = steps.iter().map(|step| state.active[step.index()]);
                    let any = aig.or_all(active.collect::<Vec<_>>());
                    let zero = value.is(aig, 0);
                    let broken = aig.and(!any, !zero);
                    add(broken);
                }
                let time = value.number(aig);
                for step in steps {
                    let index = step.index();
                    let (Some(own), Some(wanted)) =
                        (self.model.maker.shape.elapsed[index], &state.elapsed[index])
                    else {
                        continue;
                    };
                    let capped = time.saturate(aig, 0, own);
                    let differ = Number::compare(aig, CompareOp::Ne, &capped, wanted);
                    let broken = aig.and(state.active[index], differ);
                    add(broken);
                }
            }
            Holds::Recorded { .. } => {}
        }
        all
    }

    pub(super) fn shown_outputs(
        &mut self,
        outputs: &[Vec<Lit>],
        memory: &Memory,
    ) -> Result<Vec<Check>, String> {
        let mut checks = Vec::new();
        for (at, (output, place)) in self.of.hint.outputs.iter().enumerate() {
            let cell = self.read(memory, OUTPUTS, self.structures.outputs, place)?;
            let Some(Scalar::Int(value)) = &cell.value else {
                return Err(format!("output `{}` is not set", self.of.net.outputs[*output].name));
            };
            let aig = &mut self.program.aig;
            let code = &outputs[output.index()];
            let wanted = match self.of.net.outputs[*output].ty {
                NetType::Bool => Value::Flag(code.first().copied().unwrap_or(Lit::FALSE)),
                NetType::Int { lo, .. } => Value::Number(Number::from_code(aig, code, lo)),
            };
            let broken = differs(aig, value, &wanted);
            let broken = aig.or(broken, cell.unset);
            checks.push(Check { question: Question::Output(at), broken });
        }
        let places = self.of.hint.outputs.iter().map(|(_, place)| place);
        let outputs = (OUTPUTS, self.structures.outputs);
        checks.extend(self.unused_bits(outputs, places, memory, Question::Output)?);
        Ok(checks)
    }

    /// Checks that the bits of words that hold nothing are 0.
    fn unused_bits<'p>(
        &mut self,
        (object, of): (usize, Option<StructId>),
        places: impl Iterator<Item = &'p Place>,
        memory: &Memory,
        question: fn(usize) -> Question,
    ) -> Result<Vec<Check>, String> {
        let mut words: BTreeMap<Place, (usize, BTreeSet<u32>)> = BTreeMap::new();
        for (at, place) in places.enumerate() {
            if let Some(bit) = place.bit {
                let word = Place { bit: None, ..place.clone() };
                words.entry(word).or_insert((at, BTreeSet::new())).1.insert(bit);
            }
        }
        let mut checks = Vec::new();
        for (place, (at, used)) in words {
            let cell = self.read(memory, object, of, &place)?;
            let Some(Scalar::Int(value)) = &cell.value else { continue };
            let aig = &mut self.program.aig;
            let number = value.number(aig);
            let unused = (0..).zip(number.bits()).filter(|(bit, _)| !used.contains(bit));
            let broken = aig.or_all(unused.map(|(_, lit)| *lit).collect::<Vec<_>>());
            checks.push(Check { question: question(at), broken });
        }
        Ok(checks)
    }
}
