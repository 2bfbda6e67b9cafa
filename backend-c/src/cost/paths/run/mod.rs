//! Executes a function on sets of possible values: all paths that the values allow, with the cost of each.
//!
//! A state is a memory with the most expensive path to it. A condition that may be true or false splits a state in two, and each half records what the
//! condition implies for its numbers. Equal states are merged, at the cost of the more expensive one. If there would be too many, states that agree
//! on a few cells ([`Run::keys`]) are merged, and each number then has the values of either; so every path that a processor can take is among those
//! counted.

mod join;
mod numbers;
mod questions;

use self::join::behind;
use super::code::{Code, Op, Price, Question, Routine, What};
use super::values::Values;
use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;

/// A step of a path: its line with the cost there, and the previous step.
#[derive(Debug)]
pub(in crate::cost) struct Step {
    pub(in crate::cost) line: u32,
    pub(in crate::cost) time: u64,
    pub(in crate::cost) before: Way,
}

pub(in crate::cost) type Way = Option<Rc<Step>>;

/// The known facts at a point of a run, and the most expensive path to that point.
#[derive(Debug, Clone)]
pub(in crate::cost) struct State {
    pub(in crate::cost) memory: Vec<Values>,
    pub(in crate::cost) price: Price,
    pub(in crate::cost) way: Way,
}

/// Why a run was abandoned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::cost) enum Stopped {
    /// Too many simultaneous states, or too many statements.
    TooMuch,
    /// The costs of the machine are estimates.
    Estimate,
    /// Something that a run cannot follow.
    Lost(String),
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stopped::TooMuch => f.write_str("a reaction has too many paths to count"),
            Stopped::Estimate => {
                f.write_str("there is no bound for this machine, only an estimate")
            }
            Stopped::Lost(what) => write!(f, "the paths of a reaction depend on {what}"),
        }
    }
}

/// The states after a statement list, by where they continue.
#[derive(Debug, Default)]
struct Ends {
    next: Vec<State>,
    returned: Vec<(State, Values)>,
    broken: Vec<State>,
    continued: Vec<State>,
}

/// Executes functions.
pub(in crate::cost) struct Run<'a> {
    pub(in crate::cost) routines: &'a [Routine],
    pub(in crate::cost) int_bits: u8,
    /// The remaining work.
    pub(in crate::cost) work: u64,
    /// The maximum number of simultaneous states.
    pub(in crate::cost) most_states: usize,
    /// The cells that keep states apart if there are too many; `None`: a run with too many states is abandoned.
    pub(in crate::cost) keys: Option<Vec<usize>>,
    /// True if paths are recorded.
    pub(in crate::cost) is_traced: bool,
    /// The current line.
    pub(in crate::cost) line: u32,
    /// The first cell of the current function, and the number of its cells.
    pub(in crate::cost) frame: usize,
    pub(in crate::cost) size: usize,
    /// The number of enclosing loops.
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

    /// The states after a call of a function, with its result.
    pub(in crate::cost) fn call(
        &mut self,
        index: usize,
        given: &[Values],
        mut state: State,
    ) -> Done<Vec<(State, Values)>> {
        let routines = self.routines;
        let Some(routine) = routines.get(index) else {
            return Err(Stopped::Lost("a function that is not defined".to_owned()));
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
        let mut out = Vec::new();
        for (mut state, value) in ends.returned.into_iter().chain(nothing) {
            let value = routine.gives.map_or(value, |kind| kind.take(value));
            if let Some(own) = state.memory.get_mut(own.clone()) {
                own.fill(Values::one(0));
            }
            out.push((state, value));
        }
        self.few_of(out)
    }

    fn put(&self, state: &mut State, cell: usize, values: Values) -> Done<()> {
        match state.memory.get_mut(cell) {
            Some(place) => {
                *place = values;
                Ok(())
            }
            None => Err(Stopped::Lost("a location outside the memory".to_owned())),
        }
    }

    fn list(&mut self, list: &[Op], states: Vec<State>) -> Done<Ends> {
        let mut ends = Ends { next: states, ..Ends::default() };
        for op in list {
            if ends.next.is_empty() {
                break;
            }
            let states = std::mem::take(&mut ends.next);
            self.spend(states.len(), 0)?;
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

    /// A loop: condition, body, step, and the cost of a jump.
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
        // The result of one round for a memory, which can occur again after more or fewer rounds.
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
                let n = one.next.len() + one.broken.len() + one.returned.len();
                self.spend(1 + n, state.memory.len())?;
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
        // For each section the states that begin there; after them those that no label matches.
        let mut begin: Vec<Vec<State>> = vec![Vec::new(); sections.len() + 1];
        let default = sections.iter().position(|(labels, _)| labels.contains(&None));
        for mut state in states {
            self.pay(&mut state, price);
            for (mut state, number) in self.values(subject, state)? {
                self.spend(sections.len(), state.memory.len())?;
                let place = if let Code::Read(address, _) = subject {
                    self.single(address, &mut state)?
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
}

impl Ends {
    fn join(&mut self, other: Ends) {
        self.next.extend(other.next);
        self.returned.extend(other.returned);
        self.broken.extend(other.broken);
        self.continued.extend(other.continued);
    }
}
