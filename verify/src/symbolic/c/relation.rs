//! The induction: states of the net and of the instance that belong together, one reaction of both, and what must be true after it.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use grafsynth_c::tree::types::{IntKind, Type};
use grafsynth_c::tree::{ItemKind, StructId, SymbolId, Unit};
use grafsynth_c::walk::each_item;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::{CompareOp, Type as NetType};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::{Holds, Place, Representation};
use grafsynth_ir::net::{InputKind, Net, StepId};
use grafsynth_ir::program::Origin;

use super::Induction;
use super::exec::Program;
use super::memory::{Address, Cell, Memory, Object, Pointer, Scalar, member_offset, n_cells};
use super::value::{Int, compare};
use crate::limits::Limits;
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::number::Number;
use crate::symbolic::reaction::{Inputs, Reaction};
use crate::symbolic::state::{State, Value};
use crate::symbolic::{CONE, Model, known_depth};

/// The limits of one question: its conflicts, if it can still be split into cases, and otherwise; the nodes of a decision diagram; and the nodes of the graph of a
/// reaction. Most questions need no solver, so one that needs much work will probably not end.
const FEW_CONFLICTS: u64 = 500;
const CONFLICTS: u64 = 4_000;
const DIAGRAM: usize = 1 << 18;
const NODES: usize = 400_000;
/// The maximum number of conflicts of all questions about one reaction, and of nodes of the graph in all questions of a proof.
const ALL_CONFLICTS: u64 = 20_000;
const ALL_NODES: usize = 400_000;
/// From this number of nodes on, questions that can be split into cases are.
const FEW_NODES: usize = 100_000;
/// The maximum number of cases times the size of the net.
const MAX_CASES: usize = 8_000_000;

/// The maximum number of steps of which all pairs are considered, and of situations in which they are looked for.
const MAX_PAIRED: usize = 200;
const MAX_SITUATIONS: usize = 5_000;

/// A question of the induction; the same one in every case.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Question {
    /// A scalar of the instance, by its number in the hint, after a reaction.
    State(usize),
    /// An output, by its number in the hint.
    Output(usize),
    /// The fault flag.
    Fault,
    /// The function that tells whether a step is active, by its number in the hint.
    Active(usize),
    /// Something that C leaves undefined, with its location.
    Obligation(&'static str, u32, usize),
}

struct Check {
    question: Question,
    /// The condition that must never be true.
    broken: Lit,
}

/// A case: the active step of a component, or none of its steps.
#[derive(Debug, Clone, Copy)]
struct Focus {
    component: usize,
    active: Option<StepId>,
}

/// Everything that a proof is about.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub(super) net: &'a Valid<Net>,
    pub(super) facts: &'a Facts,
    pub(super) unit: &'a Unit,
    pub(super) hint: &'a Representation,
    pub(super) limits: &'a Limits,
}

impl Subject<'_> {
    /// Proves reset and reaction, in one piece if possible, else by cases.
    pub(super) fn prove(self) -> Result<Induction, String> {
        refuse(self.net)?;
        let limits = Limits {
            conflicts: self.limits.conflicts.min(CONFLICTS),
            bdd_nodes: self.limits.bdd_nodes.min(DIAGRAM),
            circuit_nodes: self.limits.circuit_nodes.min(NODES),
            ..self.limits.clone()
        };
        Subject { limits: &limits, ..self }.prove_within()
    }

    fn prove_within(self) -> Result<Induction, String> {
        let mut total = Induction::default();
        let mut reset = Attempt::new(self, None)?;
        let checks = reset.reset()?;
        for check in checks {
            if let Some(why) = reset.settle(&check, self.limits.conflicts, &mut total) {
                return Err(format!("after `{}_init`, {why}", self.hint.prefix));
            }
        }
        let open = self.attempt(None, None, &mut total)?;
        let n_cases: usize = open
            .keys()
            .filter_map(|component| self.facts.components.get(*component))
            .map(|component| component.steps.len() + 1)
            .sum();
        let size = self.net.steps.len() + self.net.transitions.len();
        if n_cases.saturating_mul(size) > MAX_CASES {
            return Err(format!("{n_cases} cases are too many for a chart of this size"));
        }
        for (component, questions) in &open {
            let Some(data) = self.facts.components.get(*component) else { continue };
            let steps = data.steps.iter().map(|step| Some(*step));
            for active in steps.chain((!data.always).then_some(None)) {
                let focus = Focus { component: *component, active };
                self.attempt(Some(focus), Some(questions), &mut total)?;
            }
        }
        Ok(total)
    }

    /// Answers the questions, all of them or those in `only`. Returns those that are open, by the component whose cases could answer them; in a case,
    /// an open question is an error.
    fn attempt(
        self,
        focus: Option<Focus>,
        only: Option<&BTreeSet<Question>>,
        total: &mut Induction,
    ) -> Result<BTreeMap<usize, BTreeSet<Question>>, String> {
        let mut attempt = Attempt::new(self, focus)?;
        let checks = attempt.reaction()?;
        let mut open: BTreeMap<usize, BTreeSet<Question>> = BTreeMap::new();
        for check in checks {
            if only.is_some_and(|only| !only.contains(&check.question)) {
                continue;
            }
            let component = if focus.is_none() { attempt.component(&check) } else { None };
            let conflicts = self.limits.conflicts;
            let conflicts =
                if component.is_some() { conflicts.min(FEW_CONFLICTS) } else { conflicts };
            let is_late = component.is_some() && total.work > FEW_NODES;
            let settled = check.broken == Lit::FALSE || !is_late;
            let why = match settled {
                true => attempt.settle(&check, conflicts, total),
                false => Some(String::new()),
            };
            let Some(why) = why else { continue };
            match component {
                Some(component) => {
                    open.entry(component).or_default().insert(check.question);
                }
                None => return Err(why),
            }
        }
        Ok(open)
    }
}

/// What no proof covers yet.
fn refuse(net: &Net) -> Result<(), String> {
    if net.settings.policy.is_statechart() {
        return Err("C of statecharts is not covered by the induction".to_owned());
    }
    if !net.c_texts().is_empty() {
        return Err("C code of the chart's author".to_owned());
    }
    if net.outputs.values().any(|output| output.is_extern()) {
        return Err("calls of the user's functions are not covered by the induction".to_owned());
    }
    if net.steps.values().any(|step| !step.tasks.is_empty()) {
        return Err("tasks are not covered by the induction".to_owned());
    }
    if !net.unspecified.is_empty() {
        return Err("cells that the chart leaves open are not covered by the induction".to_owned());
    }
    Ok(())
}

/// The structures of the interface.
struct Structures {
    instance: Option<StructId>,
    inputs: Option<StructId>,
    outputs: Option<StructId>,
}

struct Attempt<'a> {
    of: Subject<'a>,
    model: Model<'a>,
    program: Program<'a>,
    structures: Structures,
    /// The state of the net before the reaction.
    state: State,
    inputs: Inputs,
    /// The values of the instance before the reaction, in the order of the hint.
    before: Vec<Scalar>,
    /// Own variables, each group with the condition that it has a possible value.
    valid: Vec<(Vec<Lit>, Lit)>,
    /// The place of own variables in their words, for the order of decision diagrams.
    bit_of: BTreeMap<Lit, u32>,
    /// The place invariants with one active step: their steps, and the invariant as a function once it was needed.
    invariants: Vec<(BTreeSet<Lit>, Option<Lit>)>,
}

impl<'a> Attempt<'a> {
    fn new(of: Subject<'a>, focus: Option<Focus>) -> Result<Self, String> {
        let mut model = Model::of(of.net, known_depth(of.facts), of.limits)?;
        let aig = std::mem::replace(model.aig(), Aig::new());
        let program = Program::new(of.unit, aig, of.limits.circuit_nodes)?;
        let named = |suffix: &str| {
            let name = format!("{}{suffix}", of.hint.prefix);
            let symbol = of.unit.symbols.values().find(|symbol| symbol.name == name)?;
            symbol.canonical.ty.as_struct()
        };
        let structures =
            Structures { instance: named("_t"), inputs: named("_in_t"), outputs: named("_out_t") };
        let (mut state, mut inputs) = (model.state.clone(), model.inputs.clone());
        for step in &of.facts.unreachable_steps {
            state.active[step.index()] = Lit::FALSE;
        }
        if let Some(focus) = focus {
            for step in &of.facts.components[focus.component].steps {
                state.active[step.index()] = Lit::constant(Some(*step) == focus.active);
            }
        }
        for (id, input) in of.net.inputs.iter() {
            if input.kind == InputKind::InternalEvent {
                inputs.values[id.index()] = Value::Flag(Lit::FALSE);
            }
        }
        let mut this = Attempt {
            of,
            model,
            program,
            structures,
            state,
            inputs,
            before: Vec::new(),
            valid: Vec::new(),
            bit_of: BTreeMap::new(),
            invariants: Vec::new(),
        };
        let singles = of.facts.invariants.iter().filter(|invariant| invariant.count == 1);
        for invariant in singles {
            let steps = invariant.steps.iter().map(|step| this.state.active[step.index()]);
            this.invariants.push((steps.collect(), None));
        }
        for (place, holds) in &of.hint.state {
            let value = this.held(place, holds)?;
            this.before.push(value);
        }
        Ok(this)
    }

    fn aig(&mut self) -> &mut Aig {
        &mut self.program.aig
    }

    /// Runs a part with the graph in the model, where the second encoding expects it.
    fn with_model<T>(&mut self, part: impl FnOnce(&mut Self) -> T) -> T {
        std::mem::swap(&mut self.program.aig, &mut self.model.maker.aig);
        let done = part(self);
        std::mem::swap(&mut self.program.aig, &mut self.model.maker.aig);
        done
    }

    // ---- the relation ----

    fn fresh(&mut self, n_bits: u32) -> Vec<Lit> {
        let bits: Vec<Lit> = (0..n_bits).map(|_| self.aig().variable()).collect();
        self.bit_of.extend(bits.iter().zip(0..).map(|(bit, at): (_, u32)| (*bit, 64 - at)));
        bits
    }

    /// The value of a scalar of the instance before a reaction.
    fn held(&mut self, place: &Place, holds: &Holds) -> Result<Scalar, String> {
        match holds {
            Holds::Piece(origin, element) => {
                match piece(&self.state, *origin, *element) {
                    Some(Value::Flag(lit)) => Ok(Scalar::Int(Int::Bit(lit))),
                    Some(Value::Number(number)) => Ok(Scalar::Int(Int::Word(number))),
                    // The second encoding has no such piece: the instance may hold anything there.
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
                Ok(Scalar::Int(Int::choice(self.aig(), cases)))
            }
            Holds::TimeOf { steps, cap } => {
                let n_bits = 64 - cap.leading_zeros();
                let bits = self.fresh(n_bits);
                let time = Number::from_code(self.aig(), &bits, 0);
                let largest = Number::constant(*cap);
                let fits = Number::compare(self.aig(), CompareOp::Le, &time, &largest);
                if fits != Lit::TRUE {
                    self.valid.push((bits, fits));
                }
                for step in steps {
                    let Some(own) = self.model.maker.shape.elapsed[step.index()] else { continue };
                    let elapsed = self.shown(self.state.active[step.index()], &time, own);
                    self.state.elapsed[step.index()] = Some(elapsed);
                }
                Ok(Scalar::Int(Int::Word(time)))
            }
        }
    }

    /// The time of a step as the net counts it, from a count that goes on longer.
    fn shown(&mut self, active: Lit, time: &Number, cap: i64) -> Number {
        let aig = &mut self.program.aig;
        let capped = time.saturate(aig, 0, cap);
        Number::select(aig, active, &capped, &Number::constant(0))
    }

    /// A scalar without a meaning: any value of its type.
    fn anything(&mut self, of: Option<StructId>, place: &Place) -> Result<Scalar, String> {
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
    fn exclude_each_other(
        &self,
        place: &Place,
        steps: &[(StepId, i64)],
        has_none: bool,
    ) -> Result<(), String> {
        let codes: BTreeSet<i64> = steps.iter().map(|(_, code)| *code).collect();
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

    /// What must be true for the state of the net and the instance to belong together.
    fn related(
        &mut self,
        state: &State,
        fault: Lit,
        memory: &Memory,
    ) -> Result<Vec<Check>, String> {
        let mut checks = Vec::new();
        for (at, (place, holds)) in self.of.hint.state.iter().enumerate() {
            let question = Question::State(at);
            let cell = self.read(memory, 0, self.structures.instance, place)?;
            let value = match (&cell.value, holds) {
                (Some(Scalar::Int(value)), _) => value.clone(),
                (_, Holds::Piece(origin, element))
                    if piece(state, *origin, *element).is_none() && *origin != Origin::Fault =>
                {
                    continue;
                }
                _ => return Err(format!("`{}` has no value", place.member)),
            };
            let aig = &mut self.program.aig;
            let mut add = |broken: Lit| checks.push(Check { question: question.clone(), broken });
            match holds {
                Holds::Piece(Origin::Fault, _) => {
                    add(cell.unset);
                    let broken = differs(aig, &value, &Value::Flag(fault));
                    add(broken);
                }
                Holds::Piece(origin, element) => {
                    if let Some(wanted) = piece(state, *origin, *element) {
                        add(cell.unset);
                        let broken = differs(aig, &value, &wanted);
                        add(broken);
                    }
                }
                Holds::ActiveOf { steps, none } => {
                    add(cell.unset);
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
                        steps.iter().map(|(_, code)| *code).chain(*none).map(i128::from).collect();
                    let unknown = match value.cases() {
                        Some(cases) => {
                            let other = cases.iter().filter(|(code, _)| !codes.contains(code));
                            aig.or_all(other.map(|(_, when)| *when).collect::<Vec<_>>())
                        }
                        None => !aig.or_all(known),
                    };
                    add(unknown);
                }
                Holds::TimeOf { steps, cap } => {
                    add(cell.unset);
                    let outside = value.outside(aig, 0, i128::from(*cap));
                    add(outside);
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
            }
        }
        Ok(checks)
    }

    fn shown_outputs(
        &mut self,
        outputs: &[Vec<Lit>],
        memory: &Memory,
    ) -> Result<Vec<Check>, String> {
        let mut checks = Vec::new();
        for (at, (output, place)) in self.of.hint.outputs.iter().enumerate() {
            let cell = self.read(memory, 1, self.structures.outputs, place)?;
            let Some(Scalar::Int(value)) = &cell.value else {
                return Err(format!("output `{}` is not set", self.of.net.outputs[*output].name));
            };
            let aig = &mut self.program.aig;
            let code = &outputs[output.index()];
            let wanted = match self.of.net.outputs[*output].ty {
                NetType::Bool => Value::Flag(code.first().copied().unwrap_or(Lit::FALSE)),
                NetType::Int { lo, .. } => Value::Number(Number::from_code(aig, code, lo)),
            };
            let value = match place.bit {
                Some(bit) => Int::Bit(value.number(aig).bit(bit as usize)),
                None => value.clone(),
            };
            let broken = differs(aig, &value, &wanted);
            let broken = aig.or(broken, cell.unset);
            checks.push(Check { question: Question::Output(at), broken });
        }
        Ok(checks)
    }

    // ---- the two sides ----

    /// What must be true after reset.
    fn reset(&mut self) -> Result<Vec<Check>, String> {
        let Reaction { state, outputs, fault } =
            self.with_model(|this| this.model.maker.reset())?;
        let mut memory = self.memory(None)?;
        self.call("_init", &mut memory, None)?;
        let mut checks = self.related(&state, fault, &memory)?;
        checks.extend(self.shown_outputs(&outputs, &memory)?);
        checks.extend(self.obligations());
        Ok(checks)
    }

    /// What must be true after a reaction.
    fn reaction(&mut self) -> Result<Vec<Check>, String> {
        let dt = self.dt();
        self.inputs.tick = Lit::TRUE;
        self.inputs.dt = Some(dt.clone());
        let (state, inputs) = (self.state.clone(), self.inputs.clone());
        let Reaction { state: next, outputs, fault } =
            self.with_model(|this| this.model.maker.reaction(&state, &inputs))?;
        let before = self.before.clone();
        let mut memory = self.memory(Some(&before))?;
        for (input, name) in &self.of.hint.conditions {
            if let Some(symbol) = self.function(name) {
                let value = scalar(&self.inputs.values[input.index()]);
                self.program.given.insert(symbol, value);
            }
        }
        let mut checks = Vec::new();
        for (at, (step, name)) in self.of.hint.active.iter().enumerate() {
            let Some(value) = self.ask(name, &mut memory)? else { continue };
            let active = Value::Flag(self.state.active[step.index()]);
            let broken = differs(self.aig(), &value, &active);
            checks.push(Check { question: Question::Active(at), broken });
        }
        self.call("_step", &mut memory, Some(&dt))?;
        checks.extend(self.related(&next, fault, &memory)?);
        checks.extend(self.shown_outputs(&outputs, &memory)?);
        let name = format!("{}_fault", self.of.hint.prefix);
        if let Some(value) = self.ask(&name, &mut memory)? {
            let broken = differs(self.aig(), &value, &Value::Flag(fault));
            checks.push(Check { question: Question::Fault, broken });
        }
        checks.extend(self.obligations());
        Ok(checks)
    }

    fn obligations(&mut self) -> Vec<Check> {
        let all = std::mem::take(&mut self.program.obligations);
        all.into_iter()
            .map(|one| {
                let span = one.loc.0;
                let question = Question::Obligation(one.what, span.file.0, span.range().start);
                Check { question, broken: one.broken }
            })
            .collect()
    }

    /// The ticks of a reaction: every value of the parameter, or any number if there is none.
    fn dt(&mut self) -> Number {
        let mut n_bits = 0;
        if let Some(step) = self.function(&format!("{}_step", self.of.hint.prefix)) {
            for param in self.params(step) {
                let ty = &self.of.unit.symbols[param].canonical.ty;
                if let Some(kind) = self.of.unit.integer(ty) {
                    n_bits = self.of.unit.machine.bits(kind);
                }
            }
        }
        let bits = self.fresh(if n_bits == 0 { 16 } else { n_bits });
        Number::from_code(self.aig(), &bits, 0)
    }

    fn function(&self, name: &str) -> Option<SymbolId> {
        let mut all = self.of.unit.symbols.iter();
        all.find(|(_, symbol)| symbol.name == name).map(|(id, _)| id)
    }

    fn params(&self, function: SymbolId) -> Vec<SymbolId> {
        let mut found = Vec::new();
        each_item(&self.of.unit.items, &mut |item| {
            if let ItemKind::Function { symbol, params, .. } = &item.kind
                && *symbol == function
            {
                found.clone_from(params);
            }
        });
        found
    }

    /// The instance, the outputs, and the inputs; before the reset, instance and outputs have no values.
    fn memory(&mut self, state: Option<&[Scalar]>) -> Result<Memory, String> {
        let unset = |unit: &Unit, id: Option<StructId>| {
            let n = id.and_then(|id| n_cells(unit, &Type::Struct(id))).unwrap_or(0);
            vec![Rc::new(Cell::UNSET); n]
        };
        let Structures { instance, inputs, outputs } = self.structures;
        let mut cells = unset(self.of.unit, instance);
        for ((place, _), value) in self.of.hint.state.iter().zip(state.unwrap_or(&[])) {
            let (at, kind) = self.cell_of(instance, place)?;
            let value = self.typed(value.clone(), kind);
            cells[at] = Rc::new(Cell::of(value));
        }
        let mut memory = Memory::default();
        memory.add(cells);
        let mut cells = unset(self.of.unit, outputs);
        if state.is_some() {
            // The reset set them, and the caller may have written anything since.
            for (_, place) in &self.of.hint.outputs {
                let (at, _) = self.cell_of(outputs, place)?;
                cells[at] = Rc::new(Cell::of(self.anything(outputs, place)?));
            }
        }
        memory.add(cells);
        let mut cells = unset(self.of.unit, inputs);
        let mut words: BTreeMap<usize, Vec<Lit>> = BTreeMap::new();
        for (input, place) in &self.of.hint.inputs {
            let (at, kind) = self.cell_of(inputs, place)?;
            let value = scalar(&self.inputs.values[input.index()]);
            if let Some(bit) = place.bit {
                let width = self.of.unit.machine.bits(kind) as usize;
                let word = words.entry(at).or_insert_with(|| vec![Lit::FALSE; width + 1]);
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
            cells[at] = Rc::new(Cell::of(Scalar::Int(Int::Word(Number::of_bits(bits)))));
        }
        memory.add(cells);
        Ok(memory)
    }

    /// A value as its cell stores it: a flag only in a `bool`.
    fn typed(&mut self, value: Scalar, kind: IntKind) -> Scalar {
        match value {
            Scalar::Int(value) if kind == IntKind::Bool => {
                Scalar::Int(Int::Bit(value.truth(self.aig())))
            }
            value => value,
        }
    }

    /// The cell of a place in a structure, and its type.
    fn cell_of(&self, of: Option<StructId>, place: &Place) -> Result<(usize, IntKind), String> {
        let unit = self.of.unit;
        let missing = || format!("there is no member `{}`", place.member);
        let id = of.ok_or_else(missing)?;
        let members = &unit.structs[id].members;
        let at = members.iter().position(|member| member.name == place.member);
        let at = at.ok_or_else(missing)?;
        let offset = member_offset(unit, &Type::Struct(id), at).ok_or_else(missing)?;
        let mut ty = &members[at].canonical.ty;
        let mut cell = offset;
        if let Type::Array(element, len) = ty {
            let index = place.element.unwrap_or(0);
            if len.is_none_or(|len| u64::from(index) >= len) {
                return Err(missing());
            }
            cell += index as usize * n_cells(unit, &element.ty).ok_or_else(missing)?;
            ty = &element.ty;
        }
        let kind = unit.integer(ty).ok_or_else(missing)?;
        Ok((cell, kind))
    }

    fn read(
        &self,
        memory: &Memory,
        object: usize,
        of: Option<StructId>,
        place: &Place,
    ) -> Result<Rc<Cell>, String> {
        let (cell, _) = self.cell_of(of, place)?;
        let found = memory.objects.get(object).and_then(|cells| cells.get(cell));
        found.cloned().ok_or_else(|| format!("there is no member `{}`", place.member))
    }

    /// Calls a function of the interface with the arguments that its parameters require.
    fn call(
        &mut self,
        suffix: &str,
        memory: &mut Memory,
        dt: Option<&Number>,
    ) -> Result<(), String> {
        let name = format!("{}{suffix}", self.of.hint.prefix);
        let function = self.function(&name).ok_or_else(|| format!("there is no `{name}`"))?;
        let arguments = self.arguments(function, dt)?;
        self.program.call(function, arguments, memory).map(|_| ())
    }

    fn arguments(
        &mut self,
        function: SymbolId,
        dt: Option<&Number>,
    ) -> Result<Vec<Scalar>, String> {
        let Structures { instance, inputs, outputs } = self.structures;
        let mut arguments = Vec::new();
        for param in self.params(function) {
            let symbol = &self.of.unit.symbols[param];
            let ty = &symbol.canonical.ty;
            let target = ty.target().and_then(|it| it.ty.as_struct());
            let object = match target {
                Some(id) if Some(id) == instance => 0,
                Some(id) if Some(id) == outputs => 1,
                Some(id) if Some(id) == inputs => 2,
                _ => match (dt, self.of.unit.integer(ty)) {
                    (Some(dt), Some(_)) => {
                        arguments.push(Scalar::Int(Int::Word(dt.clone())));
                        continue;
                    }
                    _ => return Err(format!("the parameter `{}` is unknown", symbol.name)),
                },
            };
            let address = Address { object: Object::Changing(object), cell: 0 };
            arguments.push(Scalar::Pointer(vec![(Pointer::To(address), Lit::TRUE)]));
        }
        Ok(arguments)
    }

    /// The answer of a query about the instance; `None` if there is no such function.
    fn ask(&mut self, name: &str, memory: &mut Memory) -> Result<Option<Int>, String> {
        let Some(function) = self.function(name) else { return Ok(None) };
        let arguments = self.arguments(function, None)?;
        match self.program.call(function, arguments, memory)? {
            Some(Scalar::Int(value)) => Ok(Some(value)),
            _ => Err(format!("`{name}` returns no number")),
        }
    }

    // ---- answers ----

    /// The component with the most steps that a question depends on.
    fn component(&mut self, check: &Check) -> Option<usize> {
        if check.broken.as_constant().is_some() {
            return None;
        }
        let support = self.program.aig.support(&[check.broken], CONE * 10)?;
        let mut count: BTreeMap<usize, usize> = BTreeMap::new();
        for lit in support {
            if let Some((Origin::Step(step), _, _)) = self.model.name_of.get(&lit)
                && let Some(component) =
                    self.of.facts.component_of.as_ref().and_then(|of| of[*step])
            {
                *count.entry(component as usize).or_default() += 1;
            }
        }
        let best =
            count.into_iter().max_by_key(|(component, n)| (*n, std::cmp::Reverse(*component)));
        best.map(|(component, _)| component)
    }

    /// Shows that the condition of a check is never true; otherwise returns the reason.
    fn settle(&mut self, check: &Check, conflicts: u64, total: &mut Induction) -> Option<String> {
        let is_obligation = matches!(check.question, Question::Obligation(..));
        if check.broken == Lit::FALSE {
            total.same += 1;
            return None;
        }
        let size = self.program.aig.size(check.broken, CONE);
        total.work = total.work.saturating_add(size.unwrap_or(CONE));
        if self.program.aig.spent() > ALL_CONFLICTS || total.work > ALL_NODES {
            return Some("the solver reached its limit for all questions together".to_owned());
        }
        let limits = Limits { conflicts, ..self.of.limits.clone() };
        let broken = check.broken;
        let answer = self.with_model(|this| this.satisfiable(broken, &limits));
        let what = self.describe(&check.question);
        match answer {
            Some(None) => {
                total.solved += usize::from(!is_obligation);
                total.obligations += usize::from(is_obligation);
                None
            }
            Some(Some(bits)) => {
                let place = self.model.describe(&bits);
                Some(format!("{what} in a state that no invariant excludes: {place}"))
            }
            None => Some(format!("{what}, or the solver reached its limit")),
        }
    }

    fn satisfiable(&mut self, broken: Lit, limits: &Limits) -> Option<Option<Vec<Lit>>> {
        let support = self.model.maker.aig.support(&[broken], CONE)?;
        let (mut holds, mut clauses) = self.model.invariants(self.of.facts, &support);
        for (steps, made) in &mut self.invariants {
            if support.iter().any(|lit| steps.contains(lit)) {
                let aig = &mut self.model.maker.aig;
                holds.push(*made.get_or_insert_with(|| exactly_one(aig, steps)));
            }
        }
        self.never_together(&support, &mut clauses);
        for (bits, fits) in &self.valid {
            if bits.iter().any(|bit| support.contains(bit)) {
                holds.push(*fits);
            }
        }
        holds.push(broken);
        let rank = |lit: Lit| {
            let own = self.bit_of.get(&lit).or_else(|| self.model.bit_of.get(&lit));
            own.copied().unwrap_or(0)
        };
        self.model.maker.aig.settle(&holds, &clauses, rank, limits)
    }

    /// The assumption that two steps are not active together, for each pair of steps of which no reachable situation contains both.
    fn never_together(&self, support: &[Lit], clauses: &mut Vec<Vec<Lit>>) {
        let sets = self.of.facts.reach.as_ref().and_then(|reach| reach.sets.as_ref());
        let Some(sets) = sets else { return };
        let steps: Vec<(StepId, Lit)> = support
            .iter()
            .filter_map(|lit| match self.model.name_of.get(lit) {
                Some((Origin::Step(step), _, _)) => Some((*step, *lit)),
                Some(_) | None => None,
            })
            .collect();
        if steps.len() > MAX_PAIRED || sets.len() > MAX_SITUATIONS {
            return;
        }
        let is_in = |set: &Vec<u64>, step: StepId| {
            let at = step.index();
            set.get(at / 64).is_some_and(|word| word >> (at % 64) & 1 == 1)
        };
        for (at, (a, lit_a)) in steps.iter().enumerate() {
            for (b, lit_b) in &steps[..at] {
                if !sets.iter().any(|set| is_in(set, *a) && is_in(set, *b)) {
                    clauses.push(vec![!*lit_a, !*lit_b]);
                }
            }
        }
    }

    fn describe(&self, question: &Question) -> String {
        match question {
            Question::State(at) => {
                let member = &self.of.hint.state[*at].0.member;
                format!("`self->{member}` may not hold the state of the chart after a reaction")
            }
            Question::Output(at) => {
                let output = self.of.hint.outputs[*at].0;
                format!("output `{}` may differ from the chart", self.of.net.outputs[output].name)
            }
            Question::Fault => "the fault flag may differ from the chart".to_owned(),
            Question::Active(at) => {
                format!("`{}` may differ from the chart", self.of.hint.active[*at].1)
            }
            Question::Obligation(what, _, _) => format!("the C may do what is undefined ({what})"),
        }
    }
}

/// The condition that exactly one of some functions is true.
fn exactly_one(aig: &mut Aig, all: &BTreeSet<Lit>) -> Lit {
    let (mut one, mut two) = (Lit::FALSE, Lit::FALSE);
    for lit in all {
        let again = aig.and(one, *lit);
        two = aig.or(two, again);
        one = aig.or(one, *lit);
    }
    aig.and(one, !two)
}

fn scalar(value: &Value) -> Scalar {
    Scalar::Int(match value {
        Value::Flag(lit) => Int::Bit(*lit),
        Value::Number(number) => Int::Word(number.clone()),
    })
}

/// The condition that two values differ.
fn differs(aig: &mut Aig, value: &Int, wanted: &Value) -> Lit {
    match (value, wanted) {
        (Int::Bit(lit), Value::Flag(wanted)) => aig.xor(*lit, *wanted),
        (value, Value::Flag(wanted)) => compare(aig, CompareOp::Ne, value, &Int::Bit(*wanted)),
        (value, Value::Number(number)) => {
            compare(aig, CompareOp::Ne, value, &Int::Word(number.clone()))
        }
    }
}

/// A piece of the net's state; `None` if the second encoding has none with this name.
fn piece(state: &State, origin: Origin, element: u32) -> Option<Value> {
    let flag = |lit: Option<&Lit>| lit.map(|lit| Value::Flag(*lit));
    let number = |number: Option<&Option<Number>>| number?.clone().map(Value::Number);
    match origin {
        Origin::Step(id) => flag(state.active.get(id.index())),
        Origin::Elapsed(id) => number(state.elapsed.get(id.index())),
        Origin::LastElapsed(id) => number(state.last_elapsed.get(id.index())),
        Origin::TaskIndex(id) => number(state.task.get(id.index())),
        Origin::Var(id) => state.vars.get(id.index())?.get(element as usize).cloned(),
        Origin::Edge(id) => flag(state.old.get(id.index())),
        Origin::Timer(id) => number(state.timers.get(id.index())),
        Origin::TimerCondition(id) => flag(state.held.get(id.index())),
        Origin::Older(a, b) => flag(state.older.get(&(a, b))),
        Origin::ActionQ(id) => flag(state.q.get(id.index())),
        Origin::ActionLatch(id, part) => flag(state.latches.get(&(id, part))),
        Origin::ActionTimer(id, part) => {
            state.times.get(&(id, part)).map(|number| Value::Number(number.clone()))
        }
        Origin::Pending(id) => flag(state.raised.get(id.index())),
        _ => None,
    }
}
