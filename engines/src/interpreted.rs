//! C that is executed from its tree, in place of a compiled program: for text that is not from grafsynth, and without a compiler.

use crate::executed::{Instance, Trouble};
use grafsynth_c::tree::Unit;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::{InputKind, Net};
use grafsynth_ir::{Span, Valid};
use grafsynth_sim::{InputRow, Row, TraceLayout};
use grafsynth_verify::Limits;
use grafsynth_verify::c_code::{Functions, Interpreter, Shown, Snapshot, Stuck};
use std::collections::BTreeMap;

/// A text to execute.
pub struct Text<'a> {
    /// Its tree, for a 64-bit host.
    pub unit: &'a Unit,
    /// Its functions.
    pub functions: &'a Functions<'a>,
    /// How it represents the net; without a state if that is not known.
    pub hint: &'a Representation,
    /// What is proved about the net.
    pub facts: &'a Facts,
    /// The limits of work.
    pub limits: &'a Limits,
    /// A location as people read it.
    pub place: &'a dyn Fn(Span) -> String,
}

/// The executed text with the states that it has been in.
pub(crate) struct Tree<'n> {
    net: &'n Valid<Net>,
    layout: TraceLayout,
    /// For each variable, the index of its first value in [`Row::vars`].
    var_places: Vec<usize>,
    interpreter: Interpreter<'n>,
    place: &'n dyn Fn(Span) -> String,
    numbers: BTreeMap<Vec<Option<i128>>, Instance>,
    states: Vec<Snapshot>,
    /// The state after each answer, and its row number.
    after: Vec<(Instance, usize)>,
}

impl<'n> Tree<'n> {
    /// Executes the reset. Returns the row after it, and the number of its state.
    ///
    /// # Errors
    /// The text cannot be executed, or does something that C leaves undefined.
    pub(crate) fn start(
        net: &'n Valid<Net>,
        text: &'n Text<'n>,
        interface: &'n Representation,
    ) -> Result<(Tree<'n>, String, Instance), Trouble> {
        let state = &text.hint.state;
        let made = Interpreter::new(
            net,
            text.facts,
            (text.unit, text.functions),
            interface,
            state,
            text.limits,
        );
        let interpreter = made.map_err(not_executed)?;
        let mut var_places = Vec::new();
        let mut n_values = 0;
        for var in net.vars.values() {
            var_places.push(n_values);
            n_values += var.len.unwrap_or(1) as usize;
        }
        let mut tree = Tree {
            net,
            layout: TraceLayout::of(net),
            var_places,
            interpreter,
            place: text.place,
            numbers: BTreeMap::new(),
            states: Vec::new(),
            after: Vec::new(),
        };
        let (state, shown) = tree.interpreter.start().map_err(|stuck| tree.trouble(stuck))?;
        let zero = InputRow { dt: 0, ..InputRow::zero(net) };
        let row = tree.row(0, &zero, &shown);
        let instance = tree.add(state, 0)?;
        Ok((tree, row, instance))
    }

    /// Executes one requested reaction. Returns its row and the number of the state after it.
    pub(crate) fn answer(&mut self, question: &str) -> Result<(String, Instance), Trouble> {
        let mut numbers = question.split_ascii_whitespace().map(str::parse::<i64>);
        let mut next = || numbers.next().and_then(Result::ok);
        let lost =
            || Trouble::Machine("internal error: unknown form of a reaction request".to_owned());
        let from = next().ok_or_else(lost)?;
        let dt = next().and_then(|dt| u32::try_from(dt).ok()).ok_or_else(lost)?;
        let mut row = InputRow { dt, ..InputRow::zero(self.net) };
        for (id, input) in self.net.inputs.iter() {
            if input.kind != InputKind::InternalEvent {
                row = row.with(id, next().ok_or_else(lost)?);
            }
        }
        let (instance, scan) = match usize::try_from(from) {
            Ok(instance) => (instance, 0),
            Err(_) => {
                let answer = from.unsigned_abs() as usize - 1;
                *self.after.get(answer).ok_or_else(lost)?
            }
        };
        let state = self.states.get(instance).ok_or_else(lost)?;
        let done = self.interpreter.react(state, row.dt, &row.values);
        let (state, shown) = done.map_err(|stuck| self.trouble(stuck))?;
        let text = self.row(scan + 1, &row, &shown);
        let instance = self.add(state, scan + 1)?;
        Ok((text, instance))
    }

    /// The number of a state, which becomes the state after the next answer.
    fn add(&mut self, state: Snapshot, scan: usize) -> Result<Instance, Trouble> {
        let key = self.interpreter.key(&state);
        let key =
            key.ok_or_else(|| not_executed("a value of the instance is not known".to_owned()))?;
        let next = self.states.len();
        let instance = *self.numbers.entry(key).or_insert(next);
        if instance == next {
            self.states.push(state);
        }
        self.after.push((instance, scan));
        Ok(instance)
    }

    fn row(&self, scan: usize, inputs: &InputRow, shown: &Shown) -> String {
        let mut row = Row::zero(self.net);
        row.dt = inputs.dt;
        row.inputs.clone_from(&inputs.values);
        row.steps.clone_from(&shown.active);
        row.steps.sort_unstable();
        row.fault = shown.fault.unwrap_or(false);
        for (output, value) in &shown.outputs {
            if let Some(cell) = row.outputs.get_mut(output.index()) {
                *cell = *value;
            }
        }
        for (var, element, value) in &shown.vars {
            let first = self.var_places.get(var.index()).copied().unwrap_or(usize::MAX);
            let at = first.saturating_add(*element as usize);
            if let Some(cell) = row.vars.get_mut(at) {
                *cell = *value;
            }
        }
        let mut text = format!("{scan},");
        self.layout.write_cells(&row, &mut text);
        text
    }

    fn trouble(&self, stuck: Stuck) -> Trouble {
        match stuck {
            Stuck::Unsupported(why) => not_executed(why),
            Stuck::Misreported(why) => Trouble::Chart(why),
            Stuck::Undefined(what, span) => {
                Trouble::Chart(format!("the C {what}, at {}", (self.place)(span)))
            }
        }
    }
}

fn not_executed(why: String) -> Trouble {
    Trouble::Machine(format!("the text cannot be executed: {why}"))
}
