//! Goes through a function with what is known of every number: all ways that the values allow, and what each costs.
//!
//! A state is a memory with the dearest way that leads to it. A condition that may be true or false parts a state in two, each with what the condition says of the
//! numbers in it. States that know the same become one, at the price of the dearer. Where there would be too many, those become one that agree on
//! a few cells ([`Run::keys`]), and then hold for each number what either holds: so every way that a processor can go is among those that are counted.

use super::code::{Address, Base, Code, Op, Price, Question, Routine, What};
use super::values::{Kind, Number, Values, arithmetic, compared};
use crate::cost::walk::NOWHERE;
use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;

/// A place of a way: its line with what it took there, and what came before.
#[derive(Debug)]
pub(in crate::cost) struct Step {
    pub(in crate::cost) line: u32,
    pub(in crate::cost) time: u64,
    pub(in crate::cost) before: Way,
}

pub(in crate::cost) type Way = Option<Rc<Step>>;

/// What is known at a point of a run, and the dearest way to it.
#[derive(Debug, Clone)]
pub(in crate::cost) struct State {
    pub(in crate::cost) memory: Vec<Values>,
    pub(in crate::cost) price: Price,
    pub(in crate::cost) way: Way,
}

/// Why a run was given up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::cost) enum Stopped {
    /// Too many states at once, or too many statements.
    TooMuch,
    /// Something that a run can't follow.
    Lost(String),
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stopped::TooMuch => f.write_str("a reaction can go more ways than are counted"),
            Stopped::Lost(what) => write!(f, "the ways of a reaction depend on {what}"),
        }
    }
}

/// Where the states behind a list go on.
#[derive(Debug, Default)]
struct Ends {
    next: Vec<State>,
    returned: Vec<(State, Values)>,
    broken: Vec<State>,
    continued: Vec<State>,
}

/// Goes through functions.
pub(in crate::cost) struct Run<'a> {
    pub(in crate::cost) routines: &'a [Routine],
    pub(in crate::cost) int_bits: u8,
    /// What the machine takes for a call is in the price of the statement.
    pub(in crate::cost) work: u64,
    /// Statements that may still be gone through.
    pub(in crate::cost) most_states: usize,
    /// Cells by which states are told apart where there are too many; none: a run that has too many is given up.
    pub(in crate::cost) keys: Option<Vec<usize>>,
    /// Ways are remembered.
    pub(in crate::cost) is_traced: bool,
    /// The present line.
    pub(in crate::cost) line: u32,
    /// The first cell of the present function, and how many it has.
    pub(in crate::cost) frame: usize,
    pub(in crate::cost) size: usize,
    /// Loops around it.
    pub(in crate::cost) depth: u32,
}

type Done<T> = Result<T, Stopped>;

impl Run<'_> {
    fn pay(&self, state: &mut State, price: Price) {
        state.price = state.price.plus(price);
        if self.is_traced && price.time > 0 {
            let before = state.way.take();
            state.way = Some(Rc::new(Step { line: self.line, time: price.time, before }));
        }
    }

    /// The states behind a call of a function, with what it gives.
    pub(in crate::cost) fn call(
        &mut self,
        index: usize,
        given: &[Values],
        mut state: State,
    ) -> Done<Vec<(State, Values)>> {
        let routines = self.routines;
        let Some(routine) = routines.get(index) else {
            return Err(Stopped::Lost("a function that is not there".to_owned()));
        };
        let (line, frame, size) = (self.line, self.frame, self.size);
        self.line = routine.line;
        self.frame = frame + size;
        self.size = routine.cells;
        self.pay(&mut state, routine.entry);
        for ((cell, kind), values) in routine.parameters.iter().zip(given) {
            let values = kind.map_or(*values, |kind| kind.take(*values));
            self.put(&mut state, self.frame + *cell, values)?;
        }
        let ends = self.list(&routine.body, vec![state]);
        let own = self.frame..self.frame + self.size;
        (self.line, self.frame, self.size) = (line, frame, size);
        let ends = ends?;
        let nothing = ends.next.into_iter().map(|state| (state, Values::one(0)));
        let mut all: BTreeMap<(Values, Vec<Values>), State> = BTreeMap::new();
        for (mut state, value) in ends.returned.into_iter().chain(nothing) {
            let value = routine.gives.map_or(value, |kind| kind.take(value));
            if let Some(own) = state.memory.get_mut(own.clone()) {
                own.fill(Values::one(0));
            }
            let key = (value, std::mem::take(&mut state.memory));
            merge(&mut all, key, state);
        }
        let out: Vec<(State, Values)> = all
            .into_iter()
            .map(|((value, memory), state)| (State { memory, ..state }, value))
            .collect();
        self.few_of(out)
    }

    fn put(&self, state: &mut State, cell: usize, values: Values) -> Done<()> {
        match state.memory.get_mut(cell) {
            Some(place) => {
                *place = values;
                Ok(())
            }
            None => Err(Stopped::Lost("a place outside of the memory".to_owned())),
        }
    }

    // --- statements ------------------------------------------------------------------------------------------------------------------------

    fn list(&mut self, list: &[Op], states: Vec<State>) -> Done<Ends> {
        let mut ends = Ends { next: states, ..Ends::default() };
        for op in list {
            if ends.next.is_empty() {
                break;
            }
            let states = std::mem::take(&mut ends.next);
            let spent = states.len() as u64;
            self.work = self.work.checked_sub(spent).ok_or(Stopped::TooMuch)?;
            self.line = op.line;
            let n = states.len();
            let one = self.op(op, states)?;
            ends.returned.extend(one.returned);
            ends.broken.extend(one.broken);
            ends.continued.extend(one.continued);
            let is_forgotten = matches!(op.what, What::Forget(..));
            let is_more = one.next.len() > n || (is_forgotten && n > 1);
            ends.next = if is_more { self.few(one.next)? } else { one.next };
        }
        Ok(ends)
    }

    fn op(&mut self, op: &Op, states: Vec<State>) -> Done<Ends> {
        let mut ends = Ends::default();
        match &op.what {
            What::Lost(why) => return Err(Stopped::Lost(why.clone())),
            What::Pay(price) => {
                for mut state in states {
                    self.pay(&mut state, *price);
                    ends.next.push(state);
                }
            }
            What::Set(price, place, value) => {
                for mut state in states {
                    self.pay(&mut state, *price);
                    for (mut state, number) in self.values(value, state)? {
                        if let Some((address, kind)) = place {
                            self.store(address, kind.take(number.values), &mut state)?;
                        }
                        ends.next.push(state);
                    }
                }
            }
            What::If(arms, otherwise) => {
                let mut open = states;
                for (question, body, jump) in arms {
                    self.line = op.line;
                    let (mut yes, mut no) = (Vec::new(), Vec::new());
                    for state in open {
                        self.ask(question, state, &mut yes, &mut no)?;
                    }
                    open = self.few(no)?;
                    let yes = self.few(yes)?;
                    let mut one = self.list(body, yes)?;
                    self.line = op.line;
                    one.next.iter_mut().for_each(|it| self.pay(it, *jump));
                    ends.join(one);
                }
                let one = self.list(otherwise, open)?;
                ends.join(one);
            }
            What::Switch { price, subject, sections, jump } => {
                self.switch(op, *price, subject, sections, *jump, states, &mut ends)?;
            }
            What::Loop { init, condition, step, body, jump, rounds, is_proved } => {
                let begun = self.list(init, states)?;
                let parts = (condition.as_ref(), body.as_slice(), step.as_slice(), *jump);
                self.repeat(op.line, parts, (*rounds, *is_proved), begun.next, &mut ends)?;
            }
            What::Return(price, value) => {
                for mut state in states {
                    self.pay(&mut state, *price);
                    match value {
                        Some(value) => {
                            for (state, number) in self.values(value, state)? {
                                ends.returned.push((state, number.values));
                            }
                        }
                        None => ends.returned.push((state, Values::one(0))),
                    }
                }
                let found = std::mem::take(&mut ends.returned);
                ends.returned = self.few_of(found)?;
            }
            What::Break => ends.broken = states,
            What::Continue => ends.continued = states,
            What::Block(body) => ends = self.list(body, states)?,
            What::Forget(first, last) => {
                for mut state in states {
                    if let Some(own) = state.memory.get_mut(self.frame + *first..self.frame + *last)
                    {
                        own.fill(Values::one(0));
                    }
                    ends.next.push(state);
                }
            }
        }
        Ok(ends)
    }

    /// A loop: condition, body, what is counted, and the price of a jump.
    fn repeat(
        &mut self,
        line: u32,
        parts: (Option<&Question>, &[Op], &[Op], Price),
        (rounds, is_proved): (u64, bool),
        begun: Vec<State>,
        ends: &mut Ends,
    ) -> Done<()> {
        let (condition, body, step, jump) = parts;
        let mut open = begun;
        // What one round makes of a memory, which comes again after more or fewer rounds.
        let mut known: BTreeMap<Vec<Values>, Rc<Ends>> = BTreeMap::new();
        let mut round = 0;
        self.depth += 1;
        while !open.is_empty() {
            self.line = line;
            let mut go = Vec::new();
            match condition {
                Some(condition) => {
                    for state in open {
                        self.ask(condition, state, &mut go, &mut ends.next)?;
                    }
                }
                None => go = open,
            }
            if round >= rounds {
                if !is_proved {
                    ends.next.append(&mut go);
                }
                break;
            }
            round += 1;
            let mut again = Vec::new();
            for state in self.few(go)? {
                let one = match known.get(&state.memory) {
                    Some(one) => Rc::clone(one),
                    None => {
                        let from = State { price: Price::default(), way: None, ..state.clone() };
                        let one = self.list(body, vec![from])?;
                        let Ends { next, returned, broken, continued } = one;
                        let mut on = next;
                        on.extend(continued);
                        let on = self.few(on)?;
                        let counted = self.list(step, on)?;
                        let one = Rc::new(Ends {
                            next: counted.next,
                            returned,
                            broken,
                            ..Ends::default()
                        });
                        known.insert(state.memory.clone(), Rc::clone(&one));
                        one
                    }
                };
                self.work = self.work.checked_sub(1).ok_or(Stopped::TooMuch)?;
                self.line = line;
                let behind = |end: &State| behind(&state, end);
                for end in &one.next {
                    let mut end = behind(end);
                    self.pay(&mut end, jump);
                    again.push(end);
                }
                for end in &one.broken {
                    let mut end = behind(end);
                    self.pay(&mut end, jump);
                    ends.next.push(end);
                }
                ends.returned.extend(one.returned.iter().map(|(end, value)| (behind(end), *value)));
            }
            open = self.few(again)?;
        }
        self.depth -= 1;
        let found = std::mem::take(&mut ends.next);
        ends.next = self.few(found)?;
        Ok(())
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of a `switch`")]
    fn switch(
        &mut self,
        op: &Op,
        price: Price,
        subject: &Code,
        sections: &[(Vec<Option<i64>>, Vec<Op>)],
        jump: Price,
        states: Vec<State>,
        ends: &mut Ends,
    ) -> Done<()> {
        let labels: Vec<i64> =
            sections.iter().flat_map(|(labels, _)| labels.iter().flatten().copied()).collect();
        // For each section the states that begin there; behind them those that no label names.
        let mut begin: Vec<Vec<State>> = vec![Vec::new(); sections.len() + 1];
        let default = sections.iter().position(|(labels, _)| labels.contains(&None));
        for mut state in states {
            self.pay(&mut state, price);
            for (state, number) in self.values(subject, state)? {
                let place = if let Code::Read(address, _) = subject {
                    self.single(address, &state)?
                } else {
                    None
                };
                let mut enter = |at: usize, values: Values| {
                    if values.is_none() {
                        return;
                    }
                    let mut state = state.clone();
                    if let Some(place) = place.and_then(|place| state.memory.get_mut(place)) {
                        *place = values;
                    }
                    if let Some(list) = begin.get_mut(at) {
                        list.push(state);
                    }
                };
                for (at, (labels, _)) in sections.iter().enumerate() {
                    let here = labels.iter().flatten().copied();
                    enter(at, Values::of(here.filter(|it| number.values.contains(*it))));
                }
                let other = match number.values.listed() {
                    Some(all) => Values::of(all.into_iter().filter(|it| !labels.contains(it))),
                    None => number.values,
                };
                enter(default.unwrap_or(sections.len()), other);
            }
        }
        let mut through: Vec<State> = Vec::new();
        for (at, (_, body)) in sections.iter().enumerate() {
            self.line = op.line;
            if let Some(list) = begin.get_mut(at) {
                through.append(list);
            }
            let states = self.few(std::mem::take(&mut through))?;
            let one = self.list(body, states)?;
            through = one.next;
            self.line = op.line;
            for mut state in one.broken {
                self.pay(&mut state, jump);
                ends.next.push(state);
            }
            ends.returned.extend(one.returned);
            ends.continued.extend(one.continued);
        }
        ends.next.append(&mut through);
        if let Some(rest) = begin.last_mut() {
            ends.next.append(rest);
        }
        Ok(())
    }

    // --- conditions ------------------------------------------------------------------------------------------------------------------------

    fn ask(
        &mut self,
        question: &Question,
        mut state: State,
        yes: &mut Vec<State>,
        no: &mut Vec<State>,
    ) -> Done<()> {
        match question {
            // What the second half decides alone needs no parting by the first.
            Question::Both(a, b)
                if self.decided(b, &mut state)? == Some(false)
                    && self.decided(a, &mut state)?.is_none() =>
            {
                self.pay(&mut state, a.price().plus(b.price()));
                no.push(state);
                Ok(())
            }
            Question::Either(a, b)
                if self.decided(b, &mut state)? == Some(true)
                    && self.decided(a, &mut state)?.is_none() =>
            {
                self.pay(&mut state, a.price().plus(b.price()));
                yes.push(state);
                Ok(())
            }
            Question::Both(a, b) => {
                let mut first = Vec::new();
                self.ask(a, state, &mut first, no)?;
                first.into_iter().try_for_each(|state| self.ask(b, state, yes, no))
            }
            Question::Either(a, b) => {
                let mut first = Vec::new();
                self.ask(a, state, yes, &mut first)?;
                first.into_iter().try_for_each(|state| self.ask(b, state, yes, no))
            }
            Question::Not(inner) => self.ask(inner, state, no, yes),
            Question::Some(price, Code::Truth(inner)) => {
                self.pay(&mut state, *price);
                self.ask(inner, state, yes, no)
            }
            Question::Some(price, code) => {
                self.pay(&mut state, *price);
                for (state, number) in self.values(code, state)? {
                    let truth = compared("!=", number.values, Values::one(0));
                    let cut = is_direct(code).then(|| cut("!=", number.values, 0));
                    let holds = |all: &[i64]| all.first() != Some(&0);
                    self.part(truth, state, &[code], cut, holds, (&mut *yes, &mut *no))?;
                }
                Ok(())
            }
            Question::Compare(price, sign, a, b) => {
                self.pay(&mut state, *price);
                for (state, left) in self.values(a, state)? {
                    for (state, right) in self.values(b, state)? {
                        // Both are of one sign in our text (MISRA-C:2012, rule 10.4), so they are compared as they are.
                        let truth = compared(sign, left.values, right.values);
                        let cut = match (left.values.only(), right.values.only()) {
                            (None, Some(value)) if is_direct(a) => {
                                Some(cut(sign, left.values, value))
                            }
                            (Some(value), None) if is_direct(b) => {
                                Some(cut(turned(sign), right.values, value))
                            }
                            _ => None,
                        };
                        let holds = |all: &[i64]| match all {
                            [a, b] => {
                                compared(sign, Values::one(*a), Values::one(*b)) == Values::one(1)
                            }
                            _ => true,
                        };
                        self.part(truth, state, &[a, b], cut, holds, (&mut *yes, &mut *no))?;
                    }
                }
                Ok(())
            }
        }
    }

    /// Whether a condition is known, where it calls nothing.
    fn decided(&mut self, question: &Question, state: &mut State) -> Done<Option<bool>> {
        Ok(match question {
            Question::Both(a, b) => match (self.decided(a, state)?, self.decided(b, state)?) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (Some(true), Some(true)) => Some(true),
                _ => None,
            },
            Question::Either(a, b) => match (self.decided(a, state)?, self.decided(b, state)?) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (Some(false), Some(false)) => Some(false),
                _ => None,
            },
            Question::Not(inner) => self.decided(inner, state)?.map(|it| !it),
            Question::Some(_, code) if is_plain(code) => {
                let values = self.number(code, state)?.values;
                compared("!=", values, Values::one(0)).only().map(|it| it == 1)
            }
            Question::Compare(_, sign, a, b) if is_plain(a) && is_plain(b) => {
                let (a, b) = (self.number(a, state)?.values, self.number(b, state)?.values);
                compared(sign, a, b).only().map(|it| it == 1)
            }
            Question::Some(..) | Question::Compare(..) => None,
        })
    }

    /// Parts a state by a condition over some numbers. Where only one cell of them is open, it keeps in each part the values that lead there: those of a comparison
    /// with a constant, else those that are tried one by one.
    fn part(
        &mut self,
        truth: Values,
        state: State,
        codes: &[&Code],
        cut: Option<(Values, Values)>,
        holds: impl Fn(&[i64]) -> bool,
        ways: (&mut Vec<State>, &mut Vec<State>),
    ) -> Done<()> {
        let (yes, no) = ways;
        if truth.only() == Some(1) {
            yes.push(state);
            return Ok(());
        }
        if truth.only() == Some(0) {
            no.push(state);
            return Ok(());
        }
        let cell = self.open_cell(codes, &state)?;
        let values = cell.and_then(|cell| state.memory.get(cell).copied());
        let narrowed = match (values, values.and_then(Values::listed)) {
            (Some(values), _) if cut.is_some_and(|(yes, no)| yes.or(no) == values) => cut,
            (Some(_), Some(all)) => {
                let (mut true_for, mut false_for) = (Vec::new(), Vec::new());
                for value in all {
                    let mut one = state.clone();
                    self.put(&mut one, cell.unwrap_or(usize::MAX), Values::one(value))?;
                    let mut found = Vec::new();
                    for code in codes {
                        found.push(self.number(code, &mut one)?.values.only());
                    }
                    let found: Option<Vec<i64>> = found.into_iter().collect();
                    let verdict = found.map(|all| holds(&all));
                    if verdict != Some(false) {
                        true_for.push(value);
                    }
                    if verdict != Some(true) {
                        false_for.push(value);
                    }
                }
                Some((Values::of(true_for), Values::of(false_for)))
            }
            _ => None,
        };
        let Some(((true_for, false_for), cell)) = narrowed.zip(cell) else {
            yes.push(state.clone());
            no.push(state);
            return Ok(());
        };
        for (values, list) in [(true_for, yes), (false_for, no)] {
            if !values.is_none() {
                let mut state = state.clone();
                self.put(&mut state, cell, values)?;
                list.push(state);
            }
        }
        Ok(())
    }

    /// The only cell whose value is not known that these numbers are made of.
    fn open_cell(&mut self, codes: &[&Code], state: &State) -> Done<Option<usize>> {
        let mut found = Vec::new();
        for code in codes {
            if !self.cells_of(code, state, &mut found)? {
                return Ok(None);
            }
        }
        found.sort_unstable();
        found.dedup();
        found.retain(|cell| state.memory.get(*cell).is_some_and(|it| it.only().is_none()));
        Ok(match found.as_slice() {
            [only] => Some(*only),
            _ => None,
        })
    }

    /// The cells that a number is made of; false where it is made of more than cells.
    fn cells_of(&mut self, code: &Code, state: &State, found: &mut Vec<usize>) -> Done<bool> {
        Ok(match code {
            Code::Constant(_) => true,
            Code::Read(address, _) => match self.single(address, state)? {
                Some(cell) => {
                    found.push(cell);
                    true
                }
                None => false,
            },
            Code::Table(_, inner, _) | Code::Unary(_, inner) | Code::Cast(_, inner) => {
                self.cells_of(inner, state, found)?
            }
            Code::Binary(_, a, b) => {
                self.cells_of(a, state, found)? && self.cells_of(b, state, found)?
            }
            Code::Pointer(_)
            | Code::Unknown(_)
            | Code::Choice(..)
            | Code::Truth(_)
            | Code::Call(..) => false,
        })
    }

    // --- numbers ---------------------------------------------------------------------------------------------------------------------------

    /// A number, with a state for each way that a call or a truth value parts.
    fn values(&mut self, code: &Code, state: State) -> Done<Vec<(State, Number)>> {
        match code {
            Code::Call(index, given) => {
                let mut state = state;
                let mut all = Vec::with_capacity(given.len());
                for one in given {
                    all.push(self.number(one, &mut state)?.values);
                }
                let kind = self.routines.get(*index).and_then(|it| it.gives);
                let kind = kind.unwrap_or(Kind::int(self.int_bits));
                let found = self.call(*index, &all, state)?;
                Ok(found.into_iter().map(|(state, it)| (state, Number::new(it, kind))).collect())
            }
            Code::Truth(question) => {
                let (mut yes, mut no) = (Vec::new(), Vec::new());
                self.ask(question, state, &mut yes, &mut no)?;
                let truth = |value| Number::truth(Values::one(value), self.int_bits);
                let mut out = Vec::new();
                out.extend(self.few(yes)?.into_iter().map(|it| (it, truth(1))));
                out.extend(self.few(no)?.into_iter().map(|it| (it, truth(0))));
                Ok(out)
            }
            Code::Cast(kind, inner) => {
                let found = self.values(inner, state)?;
                Ok(found
                    .into_iter()
                    .map(|(state, it)| (state, Number::new(kind.take(it.values), *kind)))
                    .collect())
            }
            Code::Constant(_)
            | Code::Read(..)
            | Code::Pointer(_)
            | Code::Table(..)
            | Code::Unknown(_)
            | Code::Unary(..)
            | Code::Binary(..)
            | Code::Choice(..) => {
                let mut state = state;
                let number = self.number(code, &mut state)?;
                Ok(vec![(state, number)])
            }
        }
    }

    /// A number in one state: what calls within it do is joined.
    fn number(&mut self, code: &Code, state: &mut State) -> Done<Number> {
        let int = Kind::int(self.int_bits);
        Ok(match code {
            Code::Constant(value) => {
                let bits = if int.all().contains(*value) { self.int_bits } else { 32 };
                let bits = if Kind::int(bits).all().contains(*value) { bits } else { 64 };
                Number { values: Values::one(*value), kind: Kind::int(bits), is_loose: *value >= 0 }
            }
            Code::Unknown(kind) => Number::new(kind.all(), *kind),
            Code::Read(address, kind) => {
                let values = match self.cells(address, state)? {
                    Cells::Nowhere => kind.all(),
                    Cells::At(cells) => cells
                        .into_iter()
                        .filter_map(|it| state.memory.get(it).copied())
                        .fold(Values::NONE, Values::or),
                };
                if values.is_none() {
                    return Err(Stopped::Lost("a number that nothing gives".to_owned()));
                }
                Number::new(values, *kind)
            }
            Code::Pointer(address) => {
                let pointer = Kind { bits: 64, signed: true, is_bool: false };
                match self.cells(address, state)? {
                    Cells::Nowhere => Number::new(Values::one(NOWHERE), pointer),
                    Cells::At(cells) => {
                        let all = cells.into_iter().filter_map(|it| i64::try_from(it).ok());
                        Number::new(Values::of(all), pointer)
                    }
                }
            }
            Code::Table(all, index, kind) => {
                let at = self.number(index, state)?.values;
                let values = match at.listed() {
                    Some(list) => Values::of(list.into_iter().filter_map(|at| {
                        usize::try_from(at).ok().and_then(|at| all.get(at)).copied()
                    })),
                    None => Values::of(all.iter().copied()),
                };
                Number::new(if values.is_none() { kind.all() } else { values }, *kind)
            }
            Code::Unary(sign, inner) => {
                let inner = self.number(inner, state)?;
                let zero = Number { values: Values::one(0), kind: int, is_loose: false };
                match *sign {
                    "-" => arithmetic("-", zero, inner, self.int_bits),
                    "+" => inner,
                    _ => {
                        let kind = if inner.kind.bits < self.int_bits { int } else { inner.kind };
                        let all = kind.all();
                        let unsigned = Kind { signed: false, ..kind }.all();
                        Number {
                            values: Values::range(all.lo(), unsigned.hi()),
                            kind,
                            is_loose: true,
                        }
                    }
                }
            }
            Code::Binary(sign, a, b) => {
                let a = self.number(a, state)?;
                let b = self.number(b, state)?;
                arithmetic(sign, a, b, self.int_bits)
            }
            Code::Choice(question, a, b) => {
                let (mut yes, mut no) = (Vec::new(), Vec::new());
                self.ask(question, state.clone(), &mut yes, &mut no)?;
                let mut found: Option<Number> = None;
                for (states, code) in [(yes, a), (no, b)] {
                    for mut one in states {
                        let number = self.number(code, &mut one)?;
                        found = Some(match found {
                            Some(other) => Number {
                                values: other.values.or(number.values),
                                kind: if other.kind.bits >= number.kind.bits {
                                    other.kind
                                } else {
                                    number.kind
                                },
                                is_loose: other.is_loose || number.is_loose,
                            },
                            None => number,
                        });
                    }
                }
                found.ok_or_else(|| Stopped::Lost("a choice of nothing".to_owned()))?
            }
            Code::Cast(kind, inner) => {
                let inner = self.number(inner, state)?;
                Number::new(kind.take(inner.values), *kind)
            }
            Code::Truth(_) | Code::Call(..) => {
                let found = self.values(code, state.clone())?;
                let mut all = found.into_iter();
                let Some((first, number)) = all.next() else {
                    return Err(Stopped::Lost("a call that does not return".to_owned()));
                };
                let (joined, number) =
                    all.fold((first, number), |(joined, number), (state, other)| {
                        (
                            either(joined, state),
                            Number { values: number.values.or(other.values), ..number },
                        )
                    });
                *state = joined;
                number
            }
        })
    }

    // --- places ----------------------------------------------------------------------------------------------------------------------------

    fn cells(&mut self, address: &Address, state: &State) -> Done<Cells> {
        let bases: Vec<usize> = match address.base {
            Base::Nowhere => return Ok(Cells::Nowhere),
            Base::Cell(cell) => vec![self.frame + cell],
            Base::Behind(cell) => {
                let values = state.memory.get(self.frame + cell).copied().unwrap_or(Values::NONE);
                if values == Values::one(NOWHERE) {
                    return Ok(Cells::Nowhere);
                }
                let all = values.listed().unwrap_or_default();
                let all: Option<Vec<usize>> =
                    all.into_iter().map(|it| usize::try_from(it).ok()).collect();
                match all {
                    Some(all) if !all.is_empty() => all,
                    Some(_) | None => {
                        return Err(Stopped::Lost("a pointer that is not known".to_owned()));
                    }
                }
            }
        };
        let mut cells: Vec<usize> = bases.into_iter().map(|it| it + address.offset).collect();
        for (index, n, stride) in &address.indices {
            let values = self.number(index, &mut state.clone())?.values;
            let last = i64::try_from(n.saturating_sub(1)).unwrap_or(i64::MAX);
            let Some(all) = values.within(0, last).listed() else {
                return Err(Stopped::Lost("an index that is not known".to_owned()));
            };
            let mut next = Vec::with_capacity(cells.len() * all.len());
            for cell in &cells {
                for at in &all {
                    next.push(cell + usize::try_from(*at).unwrap_or(0) * stride);
                }
            }
            cells = next;
        }
        Ok(Cells::At(cells))
    }

    /// The only cell that an address can be.
    fn single(&mut self, address: &Address, state: &State) -> Done<Option<usize>> {
        if address.is_summary {
            return Ok(None);
        }
        Ok(match self.cells(address, state)? {
            Cells::At(cells) if cells.len() == 1 => cells.first().copied(),
            Cells::At(_) | Cells::Nowhere => None,
        })
    }

    fn store(&mut self, address: &Address, values: Values, state: &mut State) -> Done<()> {
        match self.cells(address, state)? {
            Cells::Nowhere => Ok(()),
            Cells::At(cells) => {
                let is_one = cells.len() == 1 && !address.is_summary;
                for cell in cells {
                    let old = state.memory.get(cell).copied().unwrap_or(Values::NONE);
                    self.put(state, cell, if is_one { values } else { old.or(values) })?;
                }
                Ok(())
            }
        }
    }

    // --- states ----------------------------------------------------------------------------------------------------------------------------

    /// As many states as are allowed.
    fn few(&self, states: Vec<State>) -> Done<Vec<State>> {
        let all = states.into_iter().map(|it| (it, Values::one(0))).collect();
        Ok(self.few_of(all)?.into_iter().map(|(state, _)| state).collect())
    }

    fn few_of(&self, states: Vec<(State, Values)>) -> Done<Vec<(State, Values)>> {
        if states.len() < 2 {
            return Ok(states);
        }
        let mut all: BTreeMap<(Values, Vec<Values>), State> = BTreeMap::new();
        for (mut state, value) in states {
            let key = (value, std::mem::take(&mut state.memory));
            merge(&mut all, key, state);
        }
        let Some(keys) = &self.keys else {
            if all.len() > self.most_states {
                return Err(Stopped::TooMuch);
            }
            return Ok(all
                .into_iter()
                .map(|((value, memory), state)| (State { memory, ..state }, value))
                .collect());
        };
        // Where that is not few enough all become one; but then nobody knows how often a loop goes.
        for n in [keys.len(), 0] {
            if n == 0 && self.depth > 0 && !keys.is_empty() {
                return Err(Stopped::TooMuch);
            }
            let mut groups: BTreeMap<Vec<Option<i64>>, (State, Values)> = BTreeMap::new();
            for ((value, memory), state) in &all {
                let key = keys
                    .iter()
                    .take(n)
                    .map(|cell| memory.get(*cell).and_then(|it| it.only()))
                    .collect();
                let state = State { memory: memory.clone(), ..state.clone() };
                match groups.entry(key) {
                    std::collections::btree_map::Entry::Vacant(place) => {
                        place.insert((state, *value));
                    }
                    std::collections::btree_map::Entry::Occupied(mut place) => {
                        let (other, before) = place.get().clone();
                        place.insert((either(other, state), before.or(*value)));
                    }
                }
            }
            if groups.len() <= self.most_states || n == 0 {
                return Ok(groups.into_values().collect());
            }
        }
        Err(Stopped::TooMuch)
    }
}

/// The cells of an address.
enum Cells {
    At(Vec<usize>),
    Nowhere,
}

impl Ends {
    fn join(&mut self, other: Ends) {
        self.next.extend(other.next);
        self.returned.extend(other.returned);
        self.broken.extend(other.broken);
        self.continued.extend(other.continued);
    }
}

/// A number that no call and no way decides: to find it changes nothing.
fn is_plain(code: &Code) -> bool {
    match code {
        Code::Constant(_) | Code::Unknown(_) => true,
        Code::Read(address, _) => address.indices.iter().all(|(index, ..)| is_plain(index)),
        Code::Table(_, inner, _) | Code::Unary(_, inner) | Code::Cast(_, inner) => is_plain(inner),
        Code::Binary(_, a, b) => is_plain(a) && is_plain(b),
        Code::Pointer(_) | Code::Choice(..) | Code::Truth(_) | Code::Call(..) => false,
    }
}

/// A number is a cell as it is, perhaps cast.
fn is_direct(code: &Code) -> bool {
    let mut code = code;
    while let Code::Cast(_, inner) = code {
        code = inner;
    }
    matches!(code, Code::Read(..))
}

/// The values for which a comparison with a constant is true, and those for which it is false.
fn cut(sign: &str, values: Values, with: i64) -> (Values, Values) {
    let (least, most) = (i64::MIN, i64::MAX);
    let below = values.within(least, with.saturating_sub(1));
    let above = values.within(with.saturating_add(1), most);
    let upto = values.within(least, with);
    let from = values.within(with, most);
    let (same, other) = (values.within(with, with), values.without(with));
    match sign {
        "==" => (same, other),
        "!=" => (other, same),
        "<" => (below, from),
        "<=" => (upto, above),
        ">" => (above, upto),
        _ => (from, below),
    }
}

/// The comparison with its sides exchanged.
fn turned(sign: &str) -> &str {
    match sign {
        "<" => ">",
        "<=" => ">=",
        ">" => "<",
        ">=" => "<=",
        other => other,
    }
}

/// A state with what a piece of a run made of it, which began without a price.
fn behind(state: &State, end: &State) -> State {
    let mut way = state.way.clone();
    let mut steps = Vec::new();
    let mut next = &end.way;
    while let Some(step) = next {
        steps.push((step.line, step.time));
        next = &step.before;
    }
    for (line, time) in steps.into_iter().rev() {
        way = Some(Rc::new(Step { line, time, before: way }));
    }
    State { memory: end.memory.clone(), price: state.price.plus(end.price), way }
}

/// What holds in one of two states, at the price of the dearer.
fn either(a: State, b: State) -> State {
    let memory = a.memory.iter().zip(&b.memory).map(|(a, b)| a.or(*b)).collect();
    let way = if b.price.time > a.price.time { b.way } else { a.way };
    State { memory, price: a.price.or(b.price), way }
}

fn merge<K: Ord>(all: &mut BTreeMap<K, State>, key: K, state: State) {
    match all.entry(key) {
        std::collections::btree_map::Entry::Vacant(place) => {
            place.insert(state);
        }
        std::collections::btree_map::Entry::Occupied(mut place) => {
            let old = place.get_mut();
            if state.price.time > old.price.time {
                old.way = state.way;
            }
            old.price = old.price.or(state.price);
        }
    }
}
