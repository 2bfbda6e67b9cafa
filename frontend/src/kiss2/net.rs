//! Turns a table into a net: one step per state, at most one transition from each state to each other state, mealy outputs, and the
//! unspecified cells.

use super::cover::covers_all;
use super::{Machine, Row, Trit};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Driver, Emission, Enter, Expr, Input, InputId, InputKind, Leaf, Meta, Net, OpenCell, Output,
    OutputId, Part, PartId, Step, StepId, Transition, TransitionKind, Unspecified,
};
use grafsynth_ir::span::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of cubes to examine when testing which states have unspecified cells. Beyond that, a state counts as incomplete; if it is
/// complete, the condition of its unspecified cells is never true.
const COVER_BUDGET: u64 = 2_000_000;

/// The net of a table. Names that begin with a digit get a prefix (`s` for states), so that they are valid in every language.
///
/// A row whose next state is the present state gives no transition.
#[must_use]
pub fn net(machine: &Machine, name: &str) -> Net {
    let mut names = Names::default();
    let title = if machine.name.is_empty() { name } else { &machine.name };
    let mut net =
        Net { name: Name::new(plain(title, "machine"), Span::default()), ..Net::default() };
    let part = net.parts.push(Part { name: net.name.clone(), level: 1, ..Part::default() });
    let inputs: Vec<InputId> = machine
        .inputs
        .iter()
        .map(|input| {
            net.inputs.push(Input {
                name: names.take(input, "x"),
                ty: Type::Bool,
                kind: InputKind::Pin,
                synchronous: false,
                meta: Meta::default(),
            })
        })
        .collect();
    let outputs: Vec<_> = machine
        .outputs
        .iter()
        .map(|output| {
            net.outputs.push(Output {
                safe: None,
                name: names.take(output, "y"),
                ty: Type::Bool,
                driver: Driver::Mealy(Vec::new()),
                registered: false,
                meta: Meta::default(),
            })
        })
        .collect();
    // Steps have a separate namespace.
    let mut names = Names::default();
    let states = machine.states.iter().enumerate();
    let steps: Vec<StepId> = states
        .map(|(index, state)| {
            let mut step_name = names.take(&state.name, "s");
            step_name.span = state.span;
            net.steps.push(Step {
                is_initial: index == machine.initial,
                meta: Meta { span: state.span, ..Meta::default() },
                ..Step::new(step_name, part)
            })
        })
        .collect();
    let emissions = vec![Vec::new(); outputs.len()];
    let (names, budget) = (Names::default(), COVER_BUDGET);
    let mut cells = Cells { net, part, inputs, outputs, steps, names, emissions, budget };
    for (state, rows) in machine.rows_by_state().iter().enumerate() {
        cells.transitions(state, rows);
        let said: Vec<&Row> = rows.iter().copied().filter(|row| row.to.is_some()).collect();
        if leaves_open(&said, &mut cells.budget) {
            cells.leave_open(state, &said, OpenCell::Next);
        }
        cells.outputs(state, rows);
    }
    let Cells { mut net, outputs, emissions, .. } = cells;
    for (output, emissions) in outputs.into_iter().zip(emissions) {
        net.outputs[output].driver = Driver::Mealy(emissions);
    }
    net
}

/// The cells of the table, read state by state.
struct Cells {
    net: Net,
    part: PartId,
    inputs: Vec<InputId>,
    outputs: Vec<OutputId>,
    steps: Vec<StepId>,
    /// The names of transitions.
    names: Names,
    /// The emissions of each output so far.
    emissions: Vec<Vec<Emission>>,
    budget: u64,
}

impl Cells {
    /// The inputs of these rows.
    fn sum(&self, rows: &[&Row]) -> Expr {
        Expr::or(rows.iter().map(|row| product(row, &self.inputs)))
    }

    /// Notes that a cell is unspecified unless one of these rows applies.
    fn leave_open(&mut self, state: usize, said: &[&Row], what: OpenCell) {
        let active = Expr::leaf(Leaf::Active(self.steps[state]), Span::default());
        let when = Expr::and([active, self.sum(said).not()]);
        self.net.unspecified.push(Unspecified { when, what });
    }

    /// A transition to each other state, in the order of the rows.
    fn transitions(&mut self, state: usize, rows: &[&Row]) {
        let step = self.steps[state];
        let mut order: Vec<usize> = Vec::new();
        let mut by_next: BTreeMap<usize, Vec<&Row>> = BTreeMap::new();
        for row in rows {
            if let Some(next) = row.to.filter(|next| *next != state) {
                let group = by_next.entry(next).or_default();
                if group.is_empty() {
                    order.push(next);
                }
                group.push(row);
            }
        }
        for next in order {
            let group = &by_next[&next];
            let (next, span) = (self.steps[next], group[0].span);
            let label = format!("{}_{}", self.net.steps[step].name, self.net.steps[next].name);
            let name = Name { span, ..self.names.take(&label, "t") };
            let guard = self.sum(group);
            self.net.transitions.push(Transition {
                name,
                part: self.part,
                kind: TransitionKind::Move,
                requires: vec![step],
                clears: vec![step],
                enters: vec![Enter::Step(next)],
                events: Vec::new(),
                guard,
                priority: None,
                restart: false,
                actions: Vec::new(),
                deadline_ns: None,
                meta: Meta { span, ..Meta::default() },
            });
        }
    }

    /// The outputs in a state: when each is 1, and when it is unspecified.
    fn outputs(&mut self, state: usize, rows: &[&Row]) {
        // Most outputs depend on the same rows, so results are cached.
        let mut known: BTreeMap<Vec<bool>, bool> = BTreeMap::new();
        for index in 0..self.outputs.len() {
            let on: Vec<&Row> =
                rows.iter().copied().filter(|row| row.outputs[index] == Trit::High).collect();
            if let Some(first) = on.first() {
                let condition = Some(self.sum(&on)).filter(|it| !it.is_true());
                let step = self.steps[state];
                self.emissions[index].push(Emission { step, condition, span: first.span });
            }
            let is_said: Vec<bool> =
                rows.iter().map(|row| row.outputs[index] != Trit::Any).collect();
            let said: Vec<&Row> =
                rows.iter().zip(&is_said).filter(|(_, is)| **is).map(|(row, _)| *row).collect();
            let budget = &mut self.budget;
            if *known.entry(is_said).or_insert_with(|| leaves_open(&said, budget)) {
                self.leave_open(state, &said, OpenCell::Output(self.outputs[index]));
            }
        }
    }
}

fn leaves_open(said: &[&Row], budget: &mut u64) -> bool {
    let cubes: Vec<&[Trit]> = said.iter().map(|row| row.inputs.as_slice()).collect();
    !covers_all(&cubes, budget).unwrap_or(false)
}

fn product(row: &Row, inputs: &[InputId]) -> Expr {
    Expr::and(row.inputs.iter().zip(inputs).filter_map(|(trit, input)| {
        let leaf = Expr::leaf(Leaf::Input(*input), row.span);
        match trit {
            Trit::High => Some(leaf),
            Trit::Low => Some(leaf.not()),
            Trit::Any => None,
        }
    }))
}

/// A name of letters, digits and `_` that does not begin with a digit.
fn plain(wanted: &str, before: &str) -> String {
    let text: String =
        wanted.chars().map(|c| if c.is_alphanumeric() || c == '_' { c } else { '_' }).collect();
    if text.chars().next().is_none_or(|first| first.is_ascii_digit()) {
        format!("{before}{text}")
    } else {
        text
    }
}

/// Generator of unique names.
#[derive(Default)]
struct Names {
    taken: BTreeSet<String>,
    /// For each name requested before, the number of its last copy.
    copies: BTreeMap<String, usize>,
}

impl Names {
    fn take(&mut self, wanted: &str, before: &str) -> Name {
        let base = plain(wanted, before);
        let is_column = ["dt", "scan", "steps", "fault"].contains(&base.as_str());
        let mut own = if is_column { format!("{base}_") } else { base.clone() };
        while !self.taken.insert(own.clone()) {
            let copy = self.copies.entry(base.clone()).or_insert(1);
            *copy += 1;
            own = format!("{base}_{copy}");
        }
        Name::new(own, Span::default())
    }
}
