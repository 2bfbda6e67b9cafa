//! The proof of C whose evolution is a loop in `NAME_step`, of statecharts and of `stable` charts: the reaction is cut at the start of each round of that loop.
//!
//! A round of the loop is one check (semantics §3.9), and so is a step of the second encoding. At each cut the instance stores the state of the net, and the
//! locals store what the evolution carries from check to check; the hint tells which local stores what. The proof shows this relation at the first cut, for
//! the part of `NAME_step` before the loop, and after one round from any related situation that satisfies the invariants of the evolution. The loop goes on
//! in exactly those situations in which the net makes another check: its counter counts the checks, of which there are never more than a proved number. Last,
//! the part after the loop gives the outputs and the state of the end of the reaction.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use grafsynth_c::tree::types::IntKind;
use grafsynth_c::tree::{Expr, Stmt, StmtKind, SymbolId, Unit};
use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::instance::{Carried, Extra, Holds};
use grafsynth_ir::program::Origin;

use super::Induction;
use super::attempt::Attempt;
use super::locals::{Meaning, Spot};
use super::machine::LoopOfImage;
use super::memory::{Cell, INPUTS, INSTANCE, Memory, OUTPUTS, Scalar, whole};
use super::net_values::{differs, length_of, queue_of};
use super::question::{Check, Place, Question, Subject};
use super::value::{Int, compare};
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;
use crate::symbolic::reaction::Reaction;
use crate::symbolic::state::{State, Value};
use crate::symbolic::statechart::cut::{Held, Which};
use crate::symbolic::statechart::run::Run;
use crate::symbolic::{Model, known_depth};

/// The maximum number of attempts to find the locals that keep their value in the loop.
const ATTEMPTS: usize = 8;

/// Where `NAME_step` is cut.
#[derive(Clone, Copy)]
enum Cut<'u> {
    /// At a loop of its text.
    Text(TextLoop<'u>),
    /// At the loop of the byte code that it executes.
    Image,
}

/// A loop of `NAME_step`, and the text around it.
#[derive(Clone, Copy)]
struct TextLoop<'u> {
    before: &'u [Stmt],
    init: &'u [Stmt],
    condition: &'u Expr,
    step: Option<&'u Expr>,
    body: &'u [Stmt],
    after: &'u [Stmt],
}

/// The loop that is entered.
enum Entered<'u> {
    Text(TextLoop<'u>),
    /// A loop of byte code, with the memory and the number of objects before the call that leads to it.
    Image(Box<LoopOfImage<'u>>, Memory, usize),
}

/// The memory at a cut.
struct AtCut<'u> {
    entered: Entered<'u>,
    memory: Memory,
    locals: BTreeMap<Spot, Meaning>,
    /// The number of checks so far.
    count: Number,
    /// The first object of the loop itself.
    first: usize,
}

/// Why a part is not proved.
enum Failed {
    /// The loop changes these locals.
    Changed(BTreeSet<Spot>),
    Open(String),
}

impl From<String> for Failed {
    fn from(why: String) -> Self {
        Failed::Open(why)
    }
}

impl Subject<'_> {
    /// Proves reset and reaction of a statechart.
    pub(super) fn prove_evolution(self) -> Result<Induction, String> {
        if !self.hint.locals.iter().any(|(_, what)| *what == Carried::Again) {
            return Err("a statechart in this style is not supported by the induction".to_owned());
        }
        let this = Subject { is_cut: true, ..self };
        let mut total = Induction::default();
        let mut model = Model::of(self.net, Some(1), self.limits)?;
        match self.net.settings.policy.is_statechart() {
            true => model.prove_structure(self.limits)?,
            false => model.maker.refuse_firing_outputs()?,
        }
        let mut reset = Attempt::new(this, None)?;
        let checks = reset.reset()?;
        let settled = reset.settle_all(&checks, false, &mut total);
        settled.map_err(|why| format!("after `{}_init`, {why}", self.hint.prefix))?;
        let this = Subject { unset: reset.unset.as_deref().unwrap_or_default(), ..this };
        let name = format!("{}{}", self.hint.prefix, self.reaction());
        let is_image = self.hint.extra.iter().any(|(_, extra)| *extra == Extra::Image);
        let cuts = match is_image {
            true => vec![Cut::Image],
            false => cuts(self.unit, self.functions.get(name.as_str()).map(|(id, _)| *id)),
        };
        let mut why = "a reaction without a loop over its checks is not supported".to_owned();
        for cut in cuts {
            let mut proved = total;
            match this.prove_cut(cut, &mut proved).and_then(|()| this.prove_gate(&mut proved)) {
                Ok(()) => return Ok(proved),
                Err(reason) => why = reason,
            }
        }
        Err(why)
    }

    fn prove_cut(self, cut: Cut<'_>, total: &mut Induction) -> Result<(), String> {
        let mut start = Attempt::new(self, None)?;
        let checks = start.start(cut)?;
        start.settle_all(&checks, false, total)?;
        let mut varies = BTreeSet::new();
        let lasting = self.facts.between_micro_steps(self.net);
        let within = Subject { facts: &lasting, ..self };
        for _ in 0..ATTEMPTS {
            let mut round = Attempt::new(within, None)?;
            match round.check(cut, &varies) {
                Err(Failed::Changed(more)) => varies.extend(more),
                Err(Failed::Open(why)) => return Err(why),
                Ok(checks) => {
                    round.settle_all(&checks, true, total)?;
                    let mut end = Attempt::new(self, None)?;
                    let checks = end.end(cut, &varies)?;
                    return end.settle_all(&checks, true, total);
                }
            }
        }
        Err("the locals that keep their values in the loop were not found".to_owned())
    }
}

/// The loops of a function that are not inside other statements.
fn cuts(unit: &Unit, function: Option<SymbolId>) -> Vec<Cut<'_>> {
    let mut body: &[Stmt] = &[];
    grafsynth_c::walk::each_item(&unit.items, &mut |item| {
        if let grafsynth_c::tree::ItemKind::Function { symbol, body: own, .. } = &item.kind
            && Some(*symbol) == function
        {
            body = own;
        }
    });
    let cut = |at: usize| {
        let (init, condition, step, inner): (&[Stmt], _, _, _) = match &body[at].kind {
            StmtKind::For { init, condition: Some(condition), step, body } => {
                (init, condition, step.as_ref(), body)
            }
            StmtKind::While { condition, body } => (&[], condition, None, body),
            _ => return None,
        };
        let (before, after) = (&body[..at], &body[at + 1..]);
        Some(Cut::Text(TextLoop { before, init, condition, step, body: inner, after }))
    };
    (0..body.len()).filter_map(cut).collect()
}

impl<'a> Attempt<'a> {
    /// The checks of the part before the loop, and of the queries and `NAME_stop`.
    fn start(&mut self, cut: Cut<'a>) -> Result<Vec<Check>, String> {
        let before = self.before.clone();
        let mut memory = self.memory(Some(&before))?;
        let state = self.state.clone();
        let mut checks: Vec<Check> = std::mem::take(&mut self.exclusive)
            .into_iter()
            .map(|(at, broken)| Check { question: Question::Exclusive(at), broken })
            .collect();
        checks.extend(self.queries(&state, None, &memory)?);
        checks.extend(self.stopped(&memory)?);
        if self.of.mark().is_some() {
            let dt = self.dt()?;
            checks.extend(self.stays_stopped(&memory, &dt)?);
        }
        let start = memory.clone();
        self.link();
        let (_, first) = self.enter(cut, &mut memory)?;
        self.is_kept(&memory, &start)?;
        self.keeps_gate(&memory)?;
        let (state, inputs) = (self.state.clone(), self.inputs.clone());
        let state = self.with_model(|this| this.model.maker.start_of_evolution(&state, &inputs));
        self.next = Some(state.clone());
        let wanted = self.model.maker.calls.clone();
        checks.extend(self.call_checks(&wanted)?);
        checks.extend(self.within(Place::Start, &state, &memory)?);
        let locals = self.locals(&memory, first, &BTreeSet::new());
        let none = Number::constant(0);
        checks.extend(self.local_checks(Place::Start, &locals, &memory, &none)?);
        checks.extend(self.invariants_of_run(Place::Start, &state));
        let is_start = self.with_model(|this| this.model.maker.is_start());
        checks.push(Check { question: Question::Begins, broken: !is_start });
        checks.extend(self.obligations());
        Ok(checks)
    }

    /// The checks of one round of the loop.
    fn check(&mut self, cut: Cut<'a>, varies: &BTreeSet<Spot>) -> Result<Vec<Check>, Failed> {
        let AtCut { entered, memory, locals, count, .. } = self.at_cut(cut, true, varies)?;
        // The condition is part of the round.
        let begin = memory.clone();
        let (goes_on, inner) = self.condition(&entered, memory, true)?;
        let mut checks = vec![Check { question: Question::GoesOn(Place::Check), broken: !goes_on }];
        let after = self.program.under(goes_on, |program| match &entered {
            Entered::Text(cut) => {
                let mut after = program.once(cut.body, inner)?;
                if let Some(step) = cut.step {
                    program.effect(step, &mut after)?;
                }
                Ok(after)
            }
            Entered::Image(found, ..) => program.loop_body(found, inner),
        })?;
        self.is_kept(&after, &begin)?;
        self.keeps_gate(&after)?;
        let mut changed = BTreeSet::new();
        for (spot, meaning) in &locals {
            let is_set = |memory: &Memory| {
                let cells = memory.object(spot.object);
                cells
                    .and_then(|cells| cells.get(spot.cell))
                    .is_some_and(|it| it.unset == Lit::FALSE)
            };
            if matches!(meaning, Meaning::Kept(_) | Meaning::Nothing)
                && is_set(&begin)
                && !is_set(&after)
            {
                return Err("a local may lose its value in the loop".to_owned().into());
            }
            let Meaning::Kept(value) = meaning else { continue };
            let now = self.cell_at(&after, *spot);
            if !now.is_some_and(|now| {
                Rc::ptr_eq(whole(&now), whole(value)) || now.value == value.value
            }) {
                changed.insert(*spot);
            }
        }
        if !changed.is_empty() {
            return Err(Failed::Changed(changed));
        }
        let before = self.with_model(|this| this.model.maker.run_now());
        let mut state = self.state.clone();
        self.with_model(|this| this.model.maker.one_check(&mut state))?;
        self.next = Some(state.clone());
        let too_many = self.with_model(|this| this.beyond_known_depth(&before));
        self.assumed.push(!too_many);
        let wanted = self.model.maker.calls.clone();
        checks.extend(self.call_checks(&wanted)?);
        checks.extend(self.within(Place::Check, &state, &after)?);
        let one = Number::constant(1);
        let next = Number::arith(self.aig(), grafsynth_ir::expr::ArithOp::Add, &count, &one);
        checks.extend(self.local_checks(Place::Check, &locals, &after, &next)?);
        checks.extend(self.invariants_of_run(Place::Check, &state));
        let progress = self.with_model(|this| this.model.maker.progress(&before));
        checks.push(Check { question: Question::Progress, broken: !progress });
        checks.extend(self.obligations());
        Ok(checks)
    }

    /// The condition that more micro-steps follow than any reachable reaction makes. The graph must be in the model.
    fn beyond_known_depth(&mut self, before: &Run) -> Lit {
        let is_statechart = self.of.net.settings.policy.is_statechart();
        let Some(depth) = known_depth(self.of.facts).filter(|_| !is_statechart) else {
            return Lit::FALSE;
        };
        let depth = Number::constant(i64::from(depth));
        let maker = &mut self.model.maker;
        let made = Number::compare(&mut maker.aig, CompareOp::Ge, &before.count, &depth);
        let goes_on = maker.goes_on();
        maker.aig.and(made, goes_on)
    }

    /// The checks of the part after the loop.
    fn end(&mut self, cut: Cut<'a>, varies: &BTreeSet<Spot>) -> Result<Vec<Check>, String> {
        let AtCut { entered, memory, first, .. } = self.at_cut(cut, false, varies)?;
        let start = memory.clone();
        let (goes_on, mut memory) = self.condition(&entered, memory, false)?;
        let mut checks = vec![Check { question: Question::GoesOn(Place::End), broken: goes_on }];
        self.is_kept(&memory, &start)?;
        memory.end(first);
        let memory = self.rest(&entered, memory)?;
        self.keeps_gate(&memory)?;
        if !memory.is_unchanged(&start, INPUTS) {
            return Err(format!("`{}_step` changes its inputs", self.of.hint.prefix));
        }
        let state = self.state.clone();
        let Reaction { state, outputs, fault } =
            self.with_model(|this| this.model.maker.rest_of_reaction(state))?;
        self.next = Some(state.clone());
        let wanted = self.model.maker.called.clone();
        checks.extend(
            self.report_checks(Attempt::was_active, |step| Some(state.active[step.index()]))?,
        );
        checks.extend(self.call_checks(&wanted)?);
        checks.extend(self.related(&state, fault, &memory)?);
        checks.extend(self.shown_outputs(&outputs, &memory)?);
        if let Some(name) = &self.of.hint.fault {
            let value = self.ask(name, &memory)?;
            let broken = differs(self.aig(), &value, &Value::Flag(fault));
            checks.push(Check { question: Question::Fault, broken });
        }
        checks.extend(self.invariants_of_row(&state));
        checks.extend(self.obligations());
        Ok(checks)
    }

    /// The condition of another round, and the memory after it on the path on which it has this truth.
    fn condition(
        &mut self,
        entered: &Entered<'a>,
        mut memory: Memory,
        truth: bool,
    ) -> Result<(Lit, Memory), String> {
        match entered {
            Entered::Text(cut) => {
                let goes_on = self.program.truth(cut.condition, &mut memory)?;
                self.program.assume(cut.condition, truth, &mut memory);
                Ok((goes_on, memory))
            }
            Entered::Image(found, ..) => self.program.loop_condition(found, memory),
        }
    }

    /// The memory after the code behind the loop.
    fn rest(&mut self, entered: &Entered<'a>, memory: Memory) -> Result<Memory, String> {
        match entered {
            Entered::Text(cut) => self.program.straight(cut.after, memory),
            Entered::Image(_, start, n_objects) => {
                self.program.frames.truncate(1);
                self.program.n_objects = *n_objects;
                let (mut after, dt) = (start.clone(), self.dt_now.clone());
                let (name, of) = (self.of.reaction(), self.of);
                let function = self.function(&format!("{}{name}", of.hint.prefix));
                let function = function.ok_or_else(|| format!("there is no `{name}`"))?;
                let arguments = self.arguments(function, dt.as_ref())?;
                self.program.call_from_loop(memory, |program| {
                    program.call(function, arguments, &mut after).map(|_| ())
                })?;
                Ok(after)
            }
        }
    }

    /// Calls `NAME_step` up to the loop. Returns the loop, and the number of its first object.
    fn enter(&mut self, cut: Cut<'a>, memory: &mut Memory) -> Result<(Entered<'a>, usize), String> {
        let dt = self.dt()?;
        self.inputs.tick = Lit::TRUE;
        self.inputs.dt = Some(dt.clone());
        self.constant_in_loop.extend(dt.bits().iter().copied());
        let name = format!("{}{}", self.of.hint.prefix, self.of.reaction());
        let function = self.function(&name).ok_or_else(|| format!("there is no `{name}`"))?;
        let arguments = self.arguments(function, Some(&dt))?;
        match cut {
            Cut::Text(cut) => {
                self.program.begin(function, arguments, memory);
                let inner = self.program.straight(cut.before, std::mem::take(memory))?;
                let first = self.program.next_object();
                *memory = self.program.straight(cut.init, inner)?;
                Ok((Entered::Text(cut), first))
            }
            Cut::Image => {
                self.dt_now = Some(dt);
                let (start, n_objects) = (memory.clone(), self.program.n_objects);
                let (found, reached) = self.program.call_up_to_loop(|program| {
                    program.call(function, arguments, memory).map(|_| ())
                })?;
                *memory = reached;
                let entered = Entered::Image(Box::new(found), start, n_objects);
                Ok((entered, self.program.next_object()))
            }
        }
    }

    /// An error if inputs or outputs were changed.
    fn is_kept(&self, after: &Memory, before: &Memory) -> Result<(), String> {
        if [INPUTS, OUTPUTS].into_iter().all(|object| after.is_unchanged(before, object)) {
            return Ok(());
        }
        Err("a change of outputs before the end of the loop is not supported".to_owned())
    }

    /// The situation at a cut: any state and any run, with `goes_on` before another check, else after the last one.
    fn at_cut(
        &mut self,
        cut: Cut<'a>,
        goes_on: bool,
        varies: &BTreeSet<Spot>,
    ) -> Result<AtCut<'a>, String> {
        let before = self.before.clone();
        let mut memory = self.memory(Some(&before))?;
        let start = memory.clone();
        self.link();
        self.begin_copies(&start)?;
        let (entered, first) = self.enter(cut, &mut memory)?;
        // The first part has proved them.
        self.program.obligations.clear();
        // What is assumed about the state is assumed between reactions only.
        let inputs: BTreeSet<Lit> = self.model.input_bits.values().copied().gather();
        self.model.forbidden.retain(|(support, _)| support.iter().all(|lit| inputs.contains(lit)));
        self.link();
        let (state, inputs) = (self.state.clone(), self.inputs.clone());
        self.with_model(|this| this.model.maker.any_run(&state, &inputs, goes_on));
        // The run changes below.
        let invariants = self.with_model(|this| this.model.maker.run_invariants(&state));
        self.assumed.extend(invariants);
        let never_fails = self.never_fails();
        self.assumed.extend(never_fails);
        memory.restore(&start, INSTANCE);
        memory.restore(&start, OUTPUTS);
        self.any_within(&state, &mut memory)?;
        self.any_asked();
        let count = self.any_count(&entered, goes_on)?;
        let mut locals = self.locals(&memory, first, varies);
        let mut kept = BTreeMap::new();
        for (spot, meaning) in &locals {
            let kind = self.kind_of_local(*spot);
            let value = match meaning {
                Meaning::Kept(_) => continue,
                Meaning::Copy(at) => {
                    let cells = self.earlier.as_ref().map(|it| &it.cells);
                    let cell = cells.and_then(|cells| cells.get(*at)).cloned();
                    let cell = cell.ok_or("a copy of no member of the instance")?;
                    self.put_at(&mut memory, *spot, cell.clone());
                    kept.insert(*spot, Meaning::Kept(cell));
                    continue;
                }
                Meaning::Counter => Some(Int::Word(count.clone())),
                // Nothing is proved of it after the last check.
                Meaning::Hint(at) if !goes_on && !is_read_later(&self.of.hint.locals[*at].1) => {
                    None
                }
                Meaning::Hint(at) => {
                    let what = &self.of.hint.locals[*at].1;
                    let asked = kind.and_then(|kind| self.asked_at_cut(what, kind));
                    asked.or_else(|| self.carried(what))
                }
                Meaning::Nothing => None,
            };
            let new = match (value, kind) {
                (Some(value), Some(kind)) => Cell::of(self.typed(Scalar::Int(value), kind)),
                (None, Some(kind)) => Cell::of(Scalar::Int(self.program.any_of(kind))),
                (_, None) => return Err("a local of this type is not supported".to_owned()),
            };
            let has_value = memory.object(spot.object).and_then(|cells| cells.get(spot.cell));
            let has_value = has_value.is_some_and(|cell| cell.unset == Lit::FALSE);
            // A local without a value before the loop must get one before it is read.
            let new = if has_value { Rc::new(new) } else { Rc::new(Cell::UNSET) };
            self.put_at(&mut memory, *spot, new);
        }
        locals.append(&mut kept);
        Ok(AtCut { entered, memory, locals, count, first })
    }

    /// Any number of checks so far at a cut.
    fn any_count(&mut self, entered: &Entered<'a>, goes_on: bool) -> Result<Number, String> {
        let most = self.with_model(|this| this.model.maker.most_rounds());
        if let Entered::Image(found, ..) = entered
            && u64::from(found.rounds) < most
        {
            // It may end because of its number of rounds.
            return Err("the loop of the byte code has too few rounds".to_owned());
        }
        let most = i64::try_from(most).unwrap_or(i64::MAX);
        // There is another check, so there were fewer before.
        let most = if goes_on { most - 1 } else { most };
        let bits = self.fresh(64 - most.leading_zeros());
        let count = Number::from_code(self.aig(), &bits, 0);
        let fits = Number::compare(self.aig(), CompareOp::Le, &count, &Number::constant(most));
        self.assumed.push(fits);
        Ok(count)
    }

    /// Gives the members of the instance the values that they have within an evolution, or any value if they have no meaning there.
    fn any_within(&mut self, state: &State, memory: &mut Memory) -> Result<(), String> {
        for (at, (place, holds)) in self.of.hint.state.iter().enumerate() {
            let (cell, kind) = self.cell_of(self.structures.instance, place)?;
            let value = match (self.value_within(state, at), holds) {
                (Some((value, used)), _) if used == Lit::TRUE => value,
                (Some((value, used)), _) => {
                    let other = match holds {
                        Holds::Piece(origin, _) if queue_of(*origin).is_some() => {
                            self.unused_item(place)?
                        }
                        _ => self.anything(self.structures.instance, place)?,
                    };
                    let Scalar::Int(other) = other else { continue };
                    Int::merge(self.aig(), &[(used, value), (!used, other)])
                }
                (None, Holds::Piece(Origin::Fault, _)) => {
                    match self.anything(self.structures.instance, place)? {
                        Scalar::Int(value) => value,
                        Scalar::Pointer(_) => continue,
                    }
                }
                (None, _) => continue,
            };
            let spot = Spot { object: INSTANCE, cell, bit: place.bit };
            let kind = if place.bit.is_some() { IntKind::Bool } else { kind };
            let value = self.typed(Scalar::Int(value), kind);
            self.put_at(memory, spot, Rc::new(Cell::of(value)));
        }
        Ok(())
    }

    fn carried(&mut self, what: &Carried) -> Option<Int> {
        let held = self.with_model(|this| this.model.maker.carried(what))?;
        Some(self.int_of(held))
    }

    fn int_of(&mut self, held: Held) -> Int {
        match held {
            Held::Flag(lit) => Int::Bit(lit),
            Held::Number(number) => Int::Word(number),
            Held::Cases(cases) => {
                let cases = cases.into_iter().map(|(value, when)| (i128::from(value), when));
                Int::choice(self.aig(), cases)
            }
        }
    }

    /// The value of a scalar of the instance within an evolution, and the condition that it has a meaning; `None` if it is the same as between reactions.
    fn value_within(&mut self, state: &State, at: usize) -> Option<(Int, Lit)> {
        let Holds::Piece(origin, element) = self.of.hint.state[at].1 else { return None };
        if let Origin::Edge(edge) = origin {
            let (lit, used) = self.with_model(|this| this.model.maker.compared(state, edge))?;
            return Some((Int::Bit(lit), used));
        }
        if matches!(origin, Origin::Pending(_)) && !self.of.net.settings.policy.is_statechart() {
            // The events that were raised are those of the next check.
            return Some((Int::Bit(Lit::FALSE), Lit::TRUE));
        }
        if let Some(which) = length_of(origin) {
            let held = self.with_model(|this| this.model.maker.queue_length(which))?;
            return Some((self.int_of(held), Lit::TRUE));
        }
        let which: Which = queue_of(origin)?;
        let (item, used) = self.with_model(|this| this.model.maker.queue_item(which, element))?;
        Some((Int::Word(item), used))
    }

    /// The checks that the instance stores the state within an evolution.
    fn within(
        &mut self,
        place: Place,
        state: &State,
        memory: &Memory,
    ) -> Result<Vec<Check>, String> {
        let mut checks = Vec::new();
        for (at, (member, holds)) in self.of.hint.state.iter().enumerate() {
            let question = Question::Within(place, at);
            let cell = self.read(memory, INSTANCE, self.structures.instance, member)?;
            let Some(Scalar::Int(value)) = &cell.value else {
                return Err(format!("`{}` has no value", member.member));
            };
            let is_fault = matches!(holds, Holds::Piece(Origin::Fault, _));
            if !is_fault || cell.unset != Lit::FALSE {
                checks.push(Check { question: question.clone(), broken: cell.unset });
            }
            if is_fault {
                continue;
            }
            if let Some((wanted, used)) = self.value_within(state, at) {
                let differ = compare(self.aig(), CompareOp::Ne, value, &wanted);
                let broken = self.aig().and(used, differ);
                checks.push(Check { question: question.clone(), broken });
                if matches!(holds, Holds::Piece(origin, _) if queue_of(*origin).is_some()) {
                    checks.push(Check { question, broken: self.no_item(value) });
                }
                continue;
            }
            for broken in self.broken(holds, value, state, Lit::FALSE) {
                checks.push(Check { question: question.clone(), broken });
            }
        }
        checks.extend(self.extra_checks(memory)?);
        Ok(checks)
    }

    /// The checks that the locals store what the evolution carries, after a number of checks. Most have a meaning only if there is another check.
    fn local_checks(
        &mut self,
        place: Place,
        locals: &BTreeMap<Spot, Meaning>,
        memory: &Memory,
        count: &Number,
    ) -> Result<Vec<Check>, String> {
        let goes_on = self.with_model(|this| this.model.maker.goes_on());
        let mut checks = Vec::new();
        for (spot, meaning) in locals {
            let cell = self.cell_at(memory, *spot);
            if let Meaning::Hint(hint) = meaning
                && let Some(Scalar::Int(value)) = cell.as_ref().and_then(|it| it.value.as_ref())
            {
                let what = &self.of.hint.locals[*hint].1;
                if let Some(wrong) = self.asked_wrongly(what, value, (locals, memory)) {
                    let unset = cell.as_ref().map_or(Lit::TRUE, |it| it.unset);
                    let broken = self.aig().or(wrong, unset);
                    checks.push(Check { question: Question::Local(place, *hint), broken });
                    continue;
                }
            }
            let (question, wanted, matters) = match meaning {
                Meaning::Counter => {
                    (Question::Counter(place, spot.cell), Int::Word(count.clone()), Lit::TRUE)
                }
                Meaning::Hint(hint) => {
                    let what = &self.of.hint.locals[*hint].1;
                    let Some(wanted) = self.carried(what) else {
                        return Err("what a local stores is unknown".to_owned());
                    };
                    let matters = if is_read_later(what) { Lit::TRUE } else { goes_on };
                    (Question::Local(place, *hint), wanted, matters)
                }
                Meaning::Kept(_) | Meaning::Copy(_) | Meaning::Nothing => continue,
            };
            let Some(cell) = cell else { continue };
            let Some(Scalar::Int(value)) = &cell.value else {
                return Err("a local without a value at the start of the loop".to_owned());
            };
            let differ = compare(self.aig(), CompareOp::Ne, value, &wanted);
            let broken = self.aig().and(differ, matters);
            // After the last check it may be any number, but it is one.
            let broken = self.aig().or(broken, cell.unset);
            checks.push(Check { question, broken });
        }
        Ok(checks)
    }

    /// The invariants of an evolution, and the ranges of its state. The structure of the states is proved for every micro-step.
    fn invariants_of_run(&mut self, place: Place, state: &State) -> Vec<Check> {
        let net = self.of.net;
        let all = self.with_model(|this| {
            let maker = &mut this.model.maker;
            let shape = maker.shape.clone();
            let mut all = maker.run_invariants(state);
            all.extend(shape.valid(net, &mut maker.aig, state));
            all
        });
        let all: Vec<Lit> = all.into_iter().chain(self.never_fails()).collect();
        let check = |(at, holds): (usize, Lit)| Check {
            question: Question::Invariant(place, at),
            broken: !holds,
        };
        all.into_iter().enumerate().map(check).collect()
    }

    /// If no local stores the fault, the condition that there is none: a program leaves it out if it never occurs.
    fn never_fails(&mut self) -> Option<Lit> {
        let is_fault = |(_, what): &(_, Carried)| *what == Carried::Fault;
        if self.of.hint.locals.iter().any(is_fault) {
            return None;
        }
        Some(!self.with_model(|this| this.model.maker.has_fault()))
    }

    /// The invariants between reactions, and the ranges of the state.
    pub(super) fn invariants_of_row(&mut self, state: &State) -> Vec<Check> {
        let net = self.of.net;
        let all = self.with_model(|this| {
            let maker = &mut this.model.maker;
            let shape = maker.shape.clone();
            let mut all = maker.row_invariants(state);
            all.extend(shape.valid(net, &mut maker.aig, state));
            all
        });
        let check = |(at, holds): (usize, Lit)| Check {
            question: Question::Invariant(Place::End, at),
            broken: !holds,
        };
        all.into_iter().enumerate().map(check).collect()
    }
}

/// Whether the text may read such a local after the last check, so that its value there is proved.
fn is_read_later(what: &Carried) -> bool {
    matches!(
        what,
        Carried::Fault
            | Carried::Again
            | Carried::HadEnded(_)
            | Carried::Asked(_)
            | Carried::Answer(_)
    )
}
