//! The rows that an exploration tries in a state: one of each class of rows that give the same reaction.
//! The simulator records the questions that a reaction asks about its row ([`grafsynth_sim::Asked`]). All rows with the same answers are one class, and the
//! remaining rows are the admissible rows outside all classes found so far. Both are sets of rows, kept as decision diagrams, so the number of reactions that
//! are
//! tried does not depend on the number of inputs, but on the number of different answers. The rows of an exclusive list of n events are n + 1 classes, and an
//! input that is not read has one value.
//!
//! The first row of each class in the order of all rows represents it, so a search finds what a search with all rows finds, in the same order.

use grafsynth_ir::expr::{CompareOp, Expr, ExprKind, Type};
use grafsynth_ir::net::{InputId, Leaf, Net, PropertyExpr, PropertyLeaf, PropertyRole};
use grafsynth_logic::bdd::{Bdd, Full, Ref};
use grafsynth_sim::{Asked, Function, InputRow, Question, value};

use crate::alphabet::{NoAlphabet, values};
use crate::limits::Limits;
use crate::verdict::OpenReason;

/// A function is tabulated over at most this many rows of the inputs that it reads.
const TABLE: u64 = 1 << 14;

/// Sets of rows of a net.
pub(crate) struct Classes<'n> {
    net: &'n Net,
    bdd: Bdd,
    limit: usize,
    /// The values of each input that are distinguished, the one at reset first.
    values: Vec<Vec<i64>>,
    /// The level of the highest bit of each input, and the number of its bits. The last input has the highest levels, so the first row of a set is the
    /// one in which the last inputs have their first values.
    places: Vec<(u32, u32)>,
    /// All admissible rows.
    legal: Ref,
    /// The set of rows that answer a question with yes, by the number of the question; `None` if it is not known yet or not a set.
    yes: Vec<Option<Answered>>,
}

/// The known answers to a question.
#[derive(Debug, Clone, Copy)]
enum Answered {
    /// The rows that answer it with yes.
    Set(Ref),
    /// The answer is a number, or the function reads too many inputs for a table.
    Number,
    TooLarge,
}

impl<'n> Classes<'n> {
    /// The admissible rows of a net.
    pub(crate) fn of(net: &'n Net, limits: &Limits) -> Result<Self, NoAlphabet> {
        let mut values = values(net, false, limits.rows_per_state)?;
        let mut places = vec![(0, 0); values.len()];
        let mut level = 0;
        for (id, input) in net.inputs.iter().rev() {
            let list = &mut values[id.index()];
            // The class of the value at reset comes first, and that value represents it.
            let base = input.ty.saturate(0);
            let at = list.iter().rposition(|value| *value <= base).unwrap_or(0);
            list[..=at].rotate_right(1);
            list[0] = list[0].max(base);
            let bits = u64::BITS - (list.len() as u64 - 1).leading_zeros();
            places[id.index()] = (level, bits);
            level += bits;
        }
        let mut classes = Classes {
            net,
            bdd: Bdd::with_limit(limits.bdd_nodes),
            limit: limits.bdd_nodes,
            values,
            places,
            legal: Ref::TRUE,
            yes: Vec::new(),
        };
        let full = |_: Full| NoAlphabet::TooMany(OpenReason::Assumptions);
        classes.legal = classes
            .admissible()
            .map_err(full)?
            .ok_or(NoAlphabet::TooMany(OpenReason::Assumptions))?;
        match classes.legal {
            Ref::FALSE => Err(NoAlphabet::Contradiction),
            _ => Ok(classes),
        }
    }

    /// All rows with values that exist, that break no assumption, and that contain at most one event if events are exclusive; `None` if an assumption reads
    /// too many inputs.
    fn admissible(&mut self) -> Result<Option<Ref>, Full> {
        let net = self.net;
        let mut legal = Ref::TRUE;
        for input in net.inputs.ids() {
            let valid = self.table(&[input], &mut |_| true)?;
            legal = self.bdd.and(legal, valid)?;
        }
        for property in
            net.properties.iter().filter(|property| property.role == PropertyRole::Assume)
        {
            let Some(never) = self.set(&over_inputs(&property.never))? else { return Ok(None) };
            legal = self.bdd.and_not(legal, never)?;
        }
        if net.settings.events_exclusive {
            let (mut none, mut at_most_one) = (Ref::TRUE, Ref::TRUE);
            // From the lowest level up.
            for (id, input) in net.inputs.iter().filter(|(_, input)| input.kind.is_event()) {
                let (level, bits) = self.places[id.index()];
                debug_assert!(input.ty.is_bool());
                if bits == 1 {
                    at_most_one = self.bdd.node(level, at_most_one, none)?;
                    none = self.bdd.node(level, none, Ref::FALSE)?;
                }
            }
            legal = self.bdd.and(legal, at_most_one)?;
        }
        Ok(Some(legal))
    }

    /// True if a Boolean function is true in some admissible row; false if that is not known.
    pub(crate) fn is_possible(&mut self, function: &Function) -> bool {
        let Ok(Some(set)) = self.set(function) else { return false };
        self.bdd.and(set, self.legal).is_ok_and(|both| both != Ref::FALSE)
    }

    /// All admissible rows.
    pub(crate) fn all(&self) -> Ref {
        self.legal
    }

    /// Frees memory if much is used; `rows` is the only other set in use.
    pub(crate) fn tidy(&mut self, rows: &mut Ref) {
        if self.bdd.len() <= self.limit / 2 {
            return;
        }
        let mut sets: Vec<&mut Ref> = vec![&mut self.legal, rows];
        sets.extend(self.yes.iter_mut().flatten().filter_map(|answered| match answered {
            Answered::Set(set) => Some(set),
            Answered::Number | Answered::TooLarge => None,
        }));
        let mut roots: Vec<Ref> = sets.iter().map(|set| **set).collect();
        self.bdd.keep(&mut roots);
        sets.into_iter().zip(roots).for_each(|(set, root)| *set = root);
    }

    /// The first row of a set; `None` if it is empty.
    pub(crate) fn first(&self, set: Ref, row: &mut InputRow) -> Option<()> {
        if set == Ref::FALSE {
            return None;
        }
        row.values.clear();
        row.values.resize(self.values.len(), 0);
        let mut at = set;
        for input in (0..self.values.len()).rev() {
            let (level, bits) = self.places[input];
            let mut index = 0;
            for bit in level..level + bits {
                index <<= 1;
                if self.bdd.level(at) == Some(bit) {
                    let (low, high) = self.bdd.branches(at);
                    let is_one = low == Ref::FALSE;
                    index |= usize::from(is_one);
                    at = if is_one { high } else { low };
                }
            }
            // A code above the last value is in no set of rows.
            row.values[input] = self.values[input].get(index).copied().unwrap_or(0);
        }
        Some(())
    }

    /// Removes from a set the class of a row, given the questions of its reaction.
    pub(crate) fn without(
        &mut self,
        rows: Ref,
        row: &InputRow,
        asked: &Asked,
    ) -> Result<Ref, OpenReason> {
        self.class(row, asked)
            .and_then(|class| self.bdd.and_not(rows, class))
            .map_err(|full| OpenReason::Method(full.to_string()))
    }

    fn class(&mut self, row: &InputRow, asked: &Asked) -> Result<Ref, Full> {
        let mut class = Ref::TRUE;
        for (number, answer) in &asked.answers {
            let yes = self.answered(*number, asked)?;
            let question = &asked.questions[*number];
            class = match (yes, question) {
                (Answered::Set(yes), _) if *answer != 0 => self.bdd.and(class, yes)?,
                (Answered::Set(yes), _) => self.bdd.and_not(class, yes)?,
                (Answered::Number, Question::Value(function)) => {
                    let is_equal = equals(function, *answer);
                    match self.set(&is_equal)? {
                        Some(equal) => self.bdd.and(class, equal)?,
                        None => self.as_in(class, row, question, asked)?,
                    }
                }
                (Answered::Number | Answered::TooLarge, _) => {
                    self.as_in(class, row, question, asked)?
                }
            };
        }
        Ok(class)
    }

    /// The rows of a set in which all inputs of a question have the same values as in this row.
    fn as_in(
        &mut self,
        set: Ref,
        row: &InputRow,
        question: &Question,
        asked: &Asked,
    ) -> Result<Ref, Full> {
        let mut set = set;
        for input in inputs_of(question, asked) {
            let same = self.table(&[input], &mut |values| values[0] == row.value(input))?;
            set = self.bdd.and(set, same)?;
        }
        Ok(set)
    }

    fn answered(&mut self, number: usize, asked: &Asked) -> Result<Answered, Full> {
        if let Some(Some(answered)) = self.yes.get(number) {
            return Ok(*answered);
        }
        let answered = match &asked.questions[number] {
            Question::Value(function) if !self.is_flag(function) => Answered::Number,
            Question::Value(function) => {
                self.set(function)?.map_or(Answered::TooLarge, Answered::Set)
            }
            Question::Queued { list, place, room } => {
                let events = &asked.lists[*list];
                let fits = self.fewer_than(&events[..*place], *room)?;
                let occurs = self.flag(events[*place])?;
                Answered::Set(self.bdd.and(occurs, fits)?)
            }
            Question::Lost { list, place, room } => {
                let events = &asked.lists[*list];
                let fits = self.fewer_than(&events[..*place], *room)?;
                let occurs = self.flag(events[*place])?;
                Answered::Set(self.bdd.and_not(occurs, fits)?)
            }
            Question::Overflow { list, room } => {
                let fit = self.fewer_than(&asked.lists[*list], room.saturating_add(1))?;
                Answered::Set(self.bdd.not(fit)?)
            }
        };
        self.yes.resize(self.yes.len().max(number + 1), None);
        self.yes[number] = Some(answered);
        Ok(answered)
    }

    /// The rows in which fewer than `limit` of these events occur.
    fn fewer_than(&mut self, events: &[InputId], limit: usize) -> Result<Ref, Full> {
        // For each number of events from 0: the rows in which fewer than that many of the events so far occur.
        let mut fewer = vec![Ref::TRUE; limit.min(events.len() + 1) + 1];
        fewer[0] = Ref::FALSE;
        for event in events {
            let occurs = self.flag(*event)?;
            for limit in (1..fewer.len()).rev() {
                fewer[limit] = self.bdd.ite(occurs, fewer[limit - 1], fewer[limit])?;
            }
        }
        Ok(fewer[fewer.len() - 1])
    }

    fn is_flag(&self, function: &Function) -> bool {
        match &function.kind {
            ExprKind::Leaf(input) => self.net.inputs[*input].ty == Type::Bool,
            ExprKind::Bool(_) | ExprKind::Not(_) | ExprKind::And(_) | ExprKind::Or(_) => true,
            ExprKind::Compare(..) => true,
            // A known operand of a selection between Booleans is a number too.
            ExprKind::Select(_, a, b) => self.is_flag(a) || self.is_flag(b),
            ExprKind::Int(_) | ExprKind::Element(..) | ExprKind::Neg(_) | ExprKind::Arith(..) => {
                false
            }
        }
    }

    fn flag(&mut self, input: InputId) -> Result<Ref, Full> {
        self.table(&[input], &mut |values| values[0] != 0)
    }

    /// The rows in which a Boolean function is true; `None` if it reads too many inputs for a table.
    fn set(&mut self, function: &Function) -> Result<Option<Ref>, Full> {
        let all = match &function.kind {
            ExprKind::Bool(value) => return Ok(Some(Ref::constant(*value))),
            ExprKind::Int(value) => return Ok(Some(Ref::constant(*value != 0))),
            ExprKind::Not(a) => {
                let Some(a) = self.set(a)? else { return Ok(None) };
                return self.bdd.not(a).map(Some);
            }
            ExprKind::And(all) | ExprKind::Or(all) => all,
            ExprKind::Select(condition, a, b) if self.is_flag(function) => {
                let (Some(condition), Some(a), Some(b)) =
                    (self.set(condition)?, self.set(a)?, self.set(b)?)
                else {
                    return Ok(None);
                };
                return self.bdd.ite(condition, a, b).map(Some);
            }
            ExprKind::Compare(op, a, b) if self.is_flag(a) && self.is_flag(b) => {
                let (Some(a), Some(b)) = (self.set(a)?, self.set(b)?) else { return Ok(None) };
                return match op {
                    CompareOp::Eq => self.bdd.iff(a, b).map(Some),
                    CompareOp::Ne => self.bdd.xor(a, b).map(Some),
                    CompareOp::Lt | CompareOp::Le | CompareOp::Gt | CompareOp::Ge => {
                        self.tabulated(function)
                    }
                };
            }
            ExprKind::Leaf(_)
            | ExprKind::Compare(..)
            | ExprKind::Select(..)
            | ExprKind::Element(..)
            | ExprKind::Neg(_)
            | ExprKind::Arith(..) => return self.tabulated(function),
        };
        let is_and = matches!(function.kind, ExprKind::And(_));
        let mut whole = Ref::constant(is_and);
        for one in all {
            let Some(one) = self.set(one)? else { return Ok(None) };
            whole = if is_and { self.bdd.and(whole, one)? } else { self.bdd.or(whole, one)? };
        }
        Ok(Some(whole))
    }

    fn tabulated(&mut self, function: &Function) -> Result<Option<Ref>, Full> {
        let inputs = leaves(function);
        let sizes = inputs.iter().map(|input| self.values[input.index()].len() as u64);
        if sizes.fold(1, u64::saturating_mul) > TABLE {
            return Ok(None);
        }
        let place = |input: InputId| inputs.iter().position(|one| *one == input).unwrap_or(0);
        self.table(&inputs, &mut |values| value(function, &|input| values[place(input)]) != 0)
            .map(Some)
    }

    /// The rows in which a condition on the values of some inputs (ascending) is true.
    fn table(
        &mut self,
        inputs: &[InputId],
        holds: &mut dyn FnMut(&[i64]) -> bool,
    ) -> Result<Ref, Full> {
        let mut values = vec![0; inputs.len()];
        self.rows_of(inputs, &mut values, holds)
    }

    /// Assigns values to the last inputs first, because they have the highest levels.
    fn rows_of(
        &mut self,
        inputs: &[InputId],
        values: &mut [i64],
        holds: &mut dyn FnMut(&[i64]) -> bool,
    ) -> Result<Ref, Full> {
        let Some((input, others)) = inputs.split_last() else {
            return Ok(Ref::constant(holds(values)));
        };
        let list = self.values[input.index()].clone();
        let (level, bits) = self.places[input.index()];
        let mut row = Vec::with_capacity(1 << bits);
        for code in 0..1_usize << bits {
            // A code without a value is in no row.
            row.push(match list.get(code) {
                Some(value) => {
                    values[others.len()] = *value;
                    self.rows_of(others, values, holds)?
                }
                None => Ref::FALSE,
            });
        }
        for bit in (level..level + bits).rev() {
            let mut shorter = Vec::with_capacity(row.len() / 2);
            for pair in row.chunks(2) {
                shorter.push(self.bdd.node(bit, pair[0], pair[pair.len() - 1])?);
            }
            row = shorter;
        }
        Ok(row.first().copied().unwrap_or(Ref::FALSE))
    }

    /// A lower bound on the number of classes, given the questions of one reaction: those of its first check are asked in every reaction, and if no two of them
    /// read a common input that is free of assumptions, all answers occur.
    pub(crate) fn least(&mut self, asked: &Asked) -> Result<u64, OpenReason> {
        let full = |full: Full| OpenReason::Method(full.to_string());
        let mut used: Vec<u32> = self.bdd.support(self.legal);
        let mut least: u64 = 1;
        for number in &asked.first_check {
            let Answered::Set(yes) = self.answered(*number, asked).map_err(full)? else {
                continue;
            };
            let support = self.bdd.support(yes);
            if !support.is_empty() && support.iter().all(|level| !used.contains(level)) {
                used.extend(support);
                least = least.saturating_mul(2);
            }
        }
        Ok(least)
    }
}

/// The function that is true if another one has this value.
fn equals(function: &Function, value: i64) -> Function {
    Expr::compare(CompareOp::Eq, function.clone(), Expr::int(value))
}

/// An assumption as a function of the row: it reads only inputs.
fn over_inputs(never: &PropertyExpr) -> Function {
    never.map(
        &mut |leaf: &PropertyLeaf, span| match leaf {
            PropertyLeaf::Net(Leaf::Input(input)) => Expr::leaf(*input, span),
            PropertyLeaf::Net(_) | PropertyLeaf::Output(_) => Expr::bool(false),
        },
        &mut |_, _| InputId::from_index(0),
    )
}

/// The inputs that a function reads, ascending.
fn leaves(function: &Function) -> Vec<InputId> {
    let mut inputs: Vec<InputId> = function.leaves().copied().collect();
    inputs.sort_unstable();
    inputs.dedup();
    inputs
}

fn inputs_of(question: &Question, asked: &Asked) -> Vec<InputId> {
    match question {
        Question::Value(function) => leaves(function),
        Question::Queued { list, .. }
        | Question::Lost { list, .. }
        | Question::Overflow { list, .. } => asked.lists[*list].clone(),
    }
}
