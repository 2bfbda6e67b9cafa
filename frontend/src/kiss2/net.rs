//! Turns a table into a net: one step per state, at most one transition from each state to each other state, mealy outputs, and the
//! unspecified cells.

use super::cover::covers_all;
use super::{Machine, Row, Trit};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Driver, Emission, Enter, Expr, Input, InputId, InputKind, Leaf, Meta, Net, OpenCell, Output,
    Part, Step, StepId, Transition, TransitionKind, Unspecified,
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
    let steps: Vec<StepId> = machine
        .states
        .iter()
        .enumerate()
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
    let sum = |rows: &[&Row]| Expr::or(rows.iter().map(|row| product(row, &inputs)));
    let mut emissions: Vec<Vec<Emission>> = vec![Vec::new(); outputs.len()];
    let mut budget = COVER_BUDGET;
    let mut transition_names = Names::default();
    for (state, rows) in machine.rows_by_state().iter().enumerate() {
        let step = steps[state];
        let mut by_next: BTreeMap<usize, Vec<&Row>> = BTreeMap::new();
        let mut order: Vec<usize> = Vec::new();
        for row in rows {
            if let Some(next) = row.to {
                let group = by_next.entry(next).or_default();
                if group.is_empty() {
                    order.push(next);
                }
                group.push(row);
            }
        }
        for next in order {
            let group = &by_next[&next];
            let span = group[0].span;
            if next == state {
                continue;
            }
            let label = format!("{}_{}", net.steps[step].name, net.steps[steps[next]].name);
            let mut transition_name = transition_names.take(&label, "t");
            transition_name.span = span;
            net.transitions.push(Transition {
                name: transition_name,
                part,
                kind: TransitionKind::Move,
                requires: vec![step],
                clears: vec![step],
                enters: vec![Enter::Step(steps[next])],
                events: Vec::new(),
                guard: sum(group),
                priority: None,
                restart: false,
                actions: Vec::new(),
                deadline_ns: None,
                meta: Meta { span, ..Meta::default() },
            });
        }
        let here = |said: &[&Row]| {
            let active = Expr::leaf(Leaf::Active(step), Span::default());
            Expr::and([active, sum(said).not()])
        };
        let said: Vec<&Row> = rows.iter().copied().filter(|row| row.to.is_some()).collect();
        if leaves_open(&said, &mut budget) {
            net.unspecified.push(Unspecified { when: here(&said), what: OpenCell::Next });
        }
        // Most outputs depend on the same rows, so results are cached.
        let mut known: BTreeMap<Vec<bool>, bool> = BTreeMap::new();
        for (index, output) in outputs.iter().enumerate() {
            let on: Vec<&Row> =
                rows.iter().copied().filter(|row| row.outputs[index] == Trit::High).collect();
            if !on.is_empty() {
                let condition = sum(&on);
                let condition = (!condition.is_true()).then_some(condition);
                emissions[index].push(Emission { step, condition, span: on[0].span });
            }
            let is_said: Vec<bool> =
                rows.iter().map(|row| row.outputs[index] != Trit::Any).collect();
            let said: Vec<&Row> =
                rows.iter().zip(&is_said).filter(|(_, is)| **is).map(|(row, _)| *row).collect();
            let is_open = match known.get(&is_said) {
                Some(known) => *known,
                None => {
                    let is_open = leaves_open(&said, &mut budget);
                    known.insert(is_said, is_open);
                    is_open
                }
            };
            if is_open {
                net.unspecified
                    .push(Unspecified { when: here(&said), what: OpenCell::Output(*output) });
            }
        }
    }
    for (output, emissions) in outputs.into_iter().zip(emissions) {
        net.outputs[output].driver = Driver::Mealy(emissions);
    }
    net
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
