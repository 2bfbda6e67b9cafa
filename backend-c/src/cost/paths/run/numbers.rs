//! Evaluates numbers, and finds the cells that they are read from.

use super::super::code::{Address, Base, Code, Question};
use super::super::values::{Kind, Number, Values, arithmetic};
use super::join::either;
use super::questions::is_plain;
use super::{Done, Run, State, Stopped};
use crate::cost::walk::compile::NOWHERE;

/// The cells of an address.
enum Cells {
    At(Vec<usize>),
    Nowhere,
}

impl Run<'_> {
    /// Evaluates code as a number: one result and state for each path, because a call or a truth value can fork.
    pub(super) fn values(&mut self, code: &Code, state: State) -> Done<Vec<(State, Number)>> {
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
                let int_bits = self.int_bits;
                let truth = |value| Number::truth(Values::one(value), int_bits);
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
            _ => {
                let mut state = state;
                let number = self.number(code, &mut state)?;
                Ok(vec![(state, number)])
            }
        }
    }

    /// Evaluates code as a number in one state: the effects of calls within it are joined.
    pub(super) fn number(&mut self, code: &Code, state: &mut State) -> Done<Number> {
        Ok(match code {
            Code::Constant(value) => Number::literal(*value, self.int_bits),
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
                    return Err(Stopped::Lost("a number without a value".to_owned()));
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
                let values = at.entries(all);
                Number::new(if values.is_none() { kind.all() } else { values }, *kind)
            }
            Code::Unary(sign, inner) => {
                let inner = self.number(inner, state)?;
                let zero = Number::truth(Values::one(0), self.int_bits);
                match *sign {
                    "-" => arithmetic("-", zero, inner, self.int_bits),
                    "+" => inner,
                    _ => inner.complement(self.int_bits),
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
                            Some(other) => other.or(number),
                            None => number,
                        });
                    }
                }
                found.ok_or_else(|| Stopped::Lost("a choice without an alternative".to_owned()))?
            }
            Code::Cast(kind, inner) => {
                let inner = self.number(inner, state)?;
                Number::new(kind.take(inner.values), *kind)
            }
            Code::Truth(_) | Code::Call(..) => {
                let found = self.values(code, state.clone())?;
                let joined = found.into_iter().reduce(|(state, number), (other, another)| {
                    (either(state, other), number.or(another))
                });
                let Some((joined, number)) = joined else {
                    return Err(Stopped::Lost("a call that does not return".to_owned()));
                };
                *state = joined;
                number
            }
        })
    }

    fn cells(&mut self, address: &Address, state: &mut State) -> Done<Cells> {
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
                        return Err(Stopped::Lost("an unknown pointer".to_owned()));
                    }
                }
            }
        };
        let mut cells: Vec<usize> = bases.into_iter().map(|it| it + address.offset).collect();
        for (index, n, stride) in &address.indices {
            // The index may be evaluated more than once, but its effects must count exactly once.
            let values = if is_plain(index) {
                self.number(index, state)?.values
            } else if calls(index) {
                return Err(Stopped::Lost("a call within an index".to_owned()));
            } else {
                self.number(index, &mut state.clone())?.values
            };
            let last = i64::try_from(n.saturating_sub(1)).unwrap_or(i64::MAX);
            let Some(all) = values.within(0, last).listed() else {
                return Err(Stopped::Lost("an unknown index".to_owned()));
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

    /// The only cell that an address can refer to.
    pub(super) fn single(&mut self, address: &Address, state: &mut State) -> Done<Option<usize>> {
        if address.is_summary {
            return Ok(None);
        }
        Ok(match self.cells(address, state)? {
            Cells::At(cells) if cells.len() == 1 => cells.first().copied(),
            Cells::At(_) | Cells::Nowhere => None,
        })
    }

    pub(super) fn store(
        &mut self,
        address: &Address,
        values: Values,
        state: &mut State,
    ) -> Done<()> {
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
}

/// Whether a number contains a call of a function of the text.
fn calls(code: &Code) -> bool {
    match code {
        Code::Call(..) => true,
        Code::Constant(_) | Code::Unknown(_) => false,
        Code::Read(address, _) | Code::Pointer(address) => {
            address.indices.iter().any(|(index, ..)| calls(index))
        }
        Code::Table(_, inner, _) | Code::Unary(_, inner) | Code::Cast(_, inner) => calls(inner),
        Code::Binary(_, a, b) => calls(a) || calls(b),
        Code::Choice(question, a, b) => asks_a_call(question) || calls(a) || calls(b),
        Code::Truth(question) => asks_a_call(question),
    }
}

fn asks_a_call(question: &Question) -> bool {
    match question {
        Question::Both(a, b) | Question::Either(a, b) => asks_a_call(a) || asks_a_call(b),
        Question::Not(inner) => asks_a_call(inner),
        Question::Compare(_, _, a, b) => calls(a) || calls(b),
        Question::Some(_, code) => calls(code),
    }
}
