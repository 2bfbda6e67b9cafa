//! Conditions: the possible outcomes of a condition in a state, and the values that each outcome leaves for the numbers in the condition.

use super::super::code::{Code, Question};
use super::super::values::{Values, compared};
use super::{Done, Run, State};

impl Run<'_> {
    pub(super) fn ask(
        &mut self,
        question: &Question,
        mut state: State,
        yes: &mut Vec<State>,
        no: &mut Vec<State>,
    ) -> Done<()> {
        match question {
            Question::Both(a, b) => self.halves(a, b, state, true, (yes, no)),
            Question::Either(a, b) => self.halves(a, b, state, false, (no, yes)),
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
                        // Both have the same signedness in the emitted text (MISRA-C:2012, rule 10.4), so they are compared directly.
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

    /// Two halves: the second matters if the first is `goes_on`; `on` and `out` receive the states in which the last half asked is, or is not, `goes_on`.
    fn halves(
        &mut self,
        a: &Question,
        b: &Question,
        mut state: State,
        goes_on: bool,
        (on, out): (&mut Vec<State>, &mut Vec<State>),
    ) -> Done<()> {
        // If the second half decides alone, the first need not split the state.
        if self.decided(b, &mut state)? == Some(!goes_on) && self.decided(a, &mut state)?.is_none()
        {
            self.pay(&mut state, a.price().plus(b.price()));
            out.push(state);
            return Ok(());
        }
        type States = Vec<State>;
        let ask = |this: &mut Self, half, state, on: &mut States, out: &mut States| {
            let (yes, no) = if goes_on { (on, out) } else { (out, on) };
            this.ask(half, state, yes, no)
        };
        let mut first = Vec::new();
        ask(self, a, state, &mut first, out)?;
        self.same(&mut first)?;
        self.same(out)?;
        first.into_iter().try_for_each(|state| ask(self, b, state, on, out))
    }

    /// The value of a condition, if it is known and calls nothing.
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

    /// Splits a state by a condition over these numbers. If only one of their cells is unknown, each half keeps the values that lead to it: computed for a
    /// comparison with a constant, otherwise found by trying the values one by one.
    fn part(
        &mut self,
        truth: Values,
        mut state: State,
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
        self.spend(1, state.memory.len())?;
        let cell = self.open_cell(codes, &mut state)?;
        let values = cell.and_then(|cell| state.memory.get(cell).copied());
        let narrowed = match (values, values.and_then(Values::listed)) {
            (Some(values), _) if cut.is_some_and(|(yes, no)| yes.or(no) == values) => cut,
            (Some(values), Some(all)) => {
                let cell = cell.unwrap_or(usize::MAX);
                self.spend(all.len(), 0)?;
                let (mut true_for, mut false_for) = (Vec::new(), Vec::new());
                for value in all {
                    // Evaluating these numbers changes nothing, so one state is enough for all of them.
                    self.put(&mut state, cell, Values::one(value))?;
                    let mut found = Vec::with_capacity(codes.len());
                    for code in codes {
                        found.push(self.number(code, &mut state)?.values.only());
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
                self.put(&mut state, cell, values)?;
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

    /// The only cell with an unknown value among those that these numbers read.
    fn open_cell(&mut self, codes: &[&Code], state: &mut State) -> Done<Option<usize>> {
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

    /// The cells that a number reads; false if it reads anything else.
    fn cells_of(&mut self, code: &Code, state: &mut State, found: &mut Vec<usize>) -> Done<bool> {
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
            _ => false,
        })
    }
}

/// True for a number without calls and choices: its evaluation changes nothing.
pub(super) fn is_plain(code: &Code) -> bool {
    match code {
        Code::Constant(_) | Code::Unknown(_) => true,
        Code::Read(address, _) => address.indices.iter().all(|(index, ..)| is_plain(index)),
        Code::Table(_, inner, _) | Code::Unary(_, inner) | Code::Cast(_, inner) => is_plain(inner),
        Code::Binary(_, a, b) => is_plain(a) && is_plain(b),
        Code::Pointer(_) | Code::Choice(..) | Code::Truth(_) | Code::Call(..) => false,
    }
}

/// True if the number is the value of a single cell, perhaps cast.
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

/// The comparison operator with its sides exchanged.
fn turned(sign: &str) -> &str {
    match sign {
        "<" => ">",
        "<=" => ">=",
        ">" => "<",
        ">=" => "<=",
        other => other,
    }
}
