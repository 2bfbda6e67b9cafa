//! A state as text, by name, so that a changed net can restore the parts that it still has.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Diagnostic;
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{Driver, Expr, InputId, Leaf, Net, Output, OutputId, StepId};
use serde::{Deserialize, Serialize};

use crate::codes;
use crate::layout::Cell;
use crate::row::Row;
use crate::state::State;
use crate::tables::Tables;

/// The result of restoring a saved state.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Restored {
    /// Parts that were restored, such as `step p1` or `var n`.
    pub kept: Vec<String>,
    /// Parts that were restored, but clamped to a range that is now narrower.
    pub cut: Vec<String>,
    /// Parts that the net has but the text does not; these parts have their values after reset.
    pub new: Vec<String>,
    /// Parts that the text has but the net does not.
    pub lost: Vec<String>,
}

const FORMAT: &str = "grafsynth state 1";

#[derive(Debug, Serialize, Deserialize)]
struct Saved {
    format: String,
    chart: String,
    /// Each step and whether it is active.
    steps: BTreeMap<String, bool>,
    /// All numbers, by a key made of names.
    cells: BTreeMap<String, i64>,
    /// Orders of last activation, oldest first.
    ages: Vec<Vec<String>>,
    internal: Vec<String>,
    external: Vec<String>,
    /// The outputs in the last row before saving; not part of the state, because the next reaction computes them again.
    #[serde(default)]
    outputs: BTreeMap<String, i64>,
}

/// Outputs that show a value in a row: all except calls.
fn shown(net: &Net) -> impl Iterator<Item = (OutputId, &str)> {
    let is_shown = |output: &Output| !matches!(output.driver, Driver::Extern { .. });
    let all = net.outputs.iter().filter(move |(_, output)| is_shown(output));
    all.map(|(id, output)| (id, output.name.text.as_str()))
}

pub(crate) fn save(net: &Net, tables: &Tables, state: &State, row: &Row) -> String {
    let event_names = |queue: &std::collections::VecDeque<InputId>| {
        queue.iter().map(|event| net.inputs[*event].name.text.clone()).collect()
    };
    let name_of = |index: i64| {
        let index = usize::try_from(index).unwrap_or(usize::MAX);
        net.steps
            .get(StepId::from_index(index))
            .map_or(String::new(), |step| step.name.text.clone())
    };
    let saved = Saved {
        format: FORMAT.to_owned(),
        chart: net.name.text.clone(),
        steps: net
            .steps
            .iter()
            .map(|(id, step)| (step.name.text.clone(), state.situation.contains(id)))
            .gather(),
        cells: keys(net, tables).map(|(place, key)| (key, state.cells[place])).gather(),
        ages: tables
            .layout
            .ages
            .iter()
            .map(|order| {
                state.cells[order.base..order.base + order.steps.len()]
                    .iter()
                    .map(|step| name_of(*step))
                    .collect()
            })
            .collect(),
        internal: event_names(&state.internal),
        external: event_names(&state.external),
        outputs: shown(net).map(|(id, name)| (name.to_owned(), row.outputs[id.index()])).gather(),
    };
    // The value contains only strings and numbers, so writing cannot fail.
    serde_json::to_string_pretty(&saved).unwrap_or_default() + "\n"
}

/// Restores a saved state into `state`, which must be the state after reset; parts that the text does not contain are unchanged.
pub(crate) fn restore(
    net: &Net,
    tables: &Tables,
    state: &mut State,
    row: &mut Row,
    text: &str,
) -> Result<Restored, Vec<Diagnostic>> {
    let saved: Saved = serde_json::from_str(text)
        .map_err(|error| bad(format!("the saved state cannot be read: {error}")))?;
    if saved.format != FORMAT {
        return Err(bad(format!(
            "the saved state has format `{}`, but this version reads `{FORMAT}`",
            saved.format
        )));
    }
    let mut restored = Restored::default();
    let mut steps = saved.steps;
    for (id, step) in net.steps.iter() {
        let label = format!("step {}", step.name);
        match steps.remove(&step.name.text) {
            Some(is_active) => {
                state.situation.set(id, is_active);
                restored.kept.push(label);
            }
            None => restored.new.push(label),
        }
    }
    restored.lost.extend(steps.into_keys().map(|name| format!("step {name}")));
    // Equal edge operands share a key, and always have equal values.
    let mut unused: BTreeSet<&String> = saved.cells.keys().gather();
    for (place, key) in keys(net, tables) {
        match saved.cells.get(&key).copied() {
            Some(value) => {
                unused.remove(&key);
                let (lo, hi) = bounds(net, tables, tables.layout.cells[place]);
                state.cells[place] = value.clamp(lo, hi);
                if state.cells[place] == value {
                    restored.kept.push(key)
                } else {
                    restored.cut.push(key)
                }
            }
            None => restored.new.push(key),
        }
    }
    restored.lost.extend(unused.into_iter().cloned());
    restore_ages(net, tables, state, &saved.ages);
    for (id, name) in shown(net) {
        if let Some(value) = saved.outputs.get(name) {
            row.outputs[id.index()] = net.outputs[id].ty.saturate(*value);
        }
    }
    for (queue, names) in
        [(&mut state.internal, saved.internal), (&mut state.external, saved.external)]
    {
        queue.clear();
        for name in names {
            match net
                .inputs
                .iter()
                .find(|(_, input)| input.name.text == name && input.kind.is_event())
            {
                Some((event, _)) => queue.push_back(event),
                None => restored.lost.push(format!("pending event {name}")),
            }
        }
    }
    Ok(restored)
}

fn bad(message: String) -> Vec<Diagnostic> {
    vec![
        Diagnostic::error(codes::BAD_STATE, message)
            .help("save the state again, or start from reset"),
    ]
}

/// Restores the age orders, each from the saved one with which it shares the most steps; steps that the saved order does not contain become older than those
/// that it contains.
fn restore_ages(net: &Net, tables: &Tables, state: &mut State, saved: &[Vec<String>]) {
    for order in &tables.layout.ages {
        let name = |step: &StepId| net.steps[*step].name.text.as_str();
        let shared = |names: &&Vec<String>| {
            order.steps.iter().filter(|step| names.iter().any(|n| n == name(step))).count()
        };
        let Some(names) = saved.iter().rev().max_by_key(shared) else { continue };
        let place_in =
            |step: &StepId| names.iter().position(|n| n == name(step)).map_or(0, |place| place + 1);
        let mut steps = order.steps.clone();
        steps.sort_by_key(place_in);
        for (place, step) in steps.into_iter().enumerate() {
            state.cells[order.base + place] = step.index() as i64;
        }
    }
}

/// The range of a restored value.
fn bounds(net: &Net, tables: &Tables, cell: Cell) -> (i64, i64) {
    let layout = &tables.layout;
    match cell {
        Cell::Var(var, _) => net.vars[var].ty.bounds(),
        Cell::Elapsed(step) => (0, layout.elapsed(step).map_or(0, |(_, cap)| cap)),
        Cell::LastElapsed(step) => (0, layout.last_elapsed(step).map_or(0, |(_, cap)| cap)),
        Cell::Timer(timer) => (0, layout.timer_cap(timer)),
        Cell::ActionTimer(action, _) => (0, i64::from(net.actions[action].duration)),
        Cell::Task(step) => (0, net.steps[step].tasks.len() as i64),
        Cell::Slot(send) => (0, i64::from(net.sends[send].delay)),
        Cell::Age(..) => (0, i64::MAX),
        Cell::Edge(_)
        | Cell::TimerHeld(_)
        | Cell::ActionQ(_)
        | Cell::Latch(..)
        | Cell::ActionTimerHeld(..)
        | Cell::Old(..)
        | Cell::Raised(_)
        | Cell::Recorded(..)
        | Cell::Ended(_)
        | Cell::Held(..) => (0, 1),
    }
}

/// All cells except those of age orders, each with its key.
fn keys<'k>(net: &'k Net, tables: &'k Tables) -> impl Iterator<Item = (usize, String)> + 'k {
    tables
        .layout
        .cells
        .iter()
        .enumerate()
        .filter_map(|(place, cell)| key(net, *cell).map(|key| (place, key)))
}

fn key(net: &Net, cell: Cell) -> Option<String> {
    let step = |step: StepId| &net.steps[step].name.text;
    Some(match cell {
        Cell::Elapsed(id) => format!("time of {}", step(id)),
        Cell::LastElapsed(id) => format!("last time of {}", step(id)),
        Cell::Var(var, element) => match net.vars[var].len {
            None => format!("var {}", net.vars[var].name),
            Some(_) => format!("var {}[{element}]", net.vars[var].name),
        },
        Cell::Edge(edge) => format!("edge of {}", expr_key(net, &net.edges[edge].expr)),
        Cell::Timer(timer) => format!("timer {}", net.timers[timer].name),
        Cell::TimerHeld(timer) => format!("timer {} held", net.timers[timer].name),
        Cell::Age(..) => return None,
        Cell::Task(id) => format!("task index of {}", step(id)),
        Cell::ActionQ(action) => format!("action {} Q", net.actions[action].name),
        Cell::Latch(action, which) => {
            format!("action {} {}_FF", net.actions[action].name, which.letters())
        }
        Cell::ActionTimer(action, which) => {
            format!("action {} {}_TON", net.actions[action].name, which.letters())
        }
        Cell::ActionTimerHeld(action, which) => {
            format!("action {} {}_TON held", net.actions[action].name, which.letters())
        }
        Cell::Old(action, which) => {
            format!("action {} {}_old", net.actions[action].name, which.letters())
        }
        Cell::Raised(event) => format!("raised {}", net.inputs[event].name),
        Cell::Slot(send) => format!("send {}", net.sends[send].name),
        Cell::Recorded(history, case) => {
            let data = &net.histories[history];
            let recorded =
                data.cases.get(case as usize).map_or("", |case| step(case.step).as_str());
            format!("history {} {recorded}", data.name)
        }
        Cell::Ended(part) => format!("ended {}", net.parts[part].name),
        Cell::Held(output, part) => {
            format!("held {} {}", net.outputs[output].name, net.parts[part].name)
        }
    })
}

/// The key of an edge operand, which has no name: its text in prefix form, with names.
fn expr_key(net: &Net, expr: &Expr) -> String {
    let operands: Vec<String> = expr.children().map(|operand| expr_key(net, operand)).collect();
    let head = match &expr.kind {
        ExprKind::Bool(value) => return value.to_string(),
        ExprKind::Int(value) => return value.to_string(),
        ExprKind::Leaf(leaf) => return leaf_key(net, *leaf),
        ExprKind::Element(leaf, _) => {
            return format!("{}[{}]", leaf_key(net, *leaf), operands.join(" "));
        }
        ExprKind::Not(_) => "not",
        ExprKind::And(_) => "and",
        ExprKind::Or(_) => "or",
        ExprKind::Compare(op, ..) => op.symbol(),
        ExprKind::Neg(_) => "neg",
        ExprKind::Arith(op, ..) => op.symbol(),
        ExprKind::Select(..) => "select",
    };
    format!("({head} {})", operands.join(" "))
}

fn leaf_key(net: &Net, leaf: Leaf) -> String {
    match leaf {
        Leaf::Input(id) => net.inputs[id].name.text.clone(),
        Leaf::Var(id) => net.vars[id].name.text.clone(),
        Leaf::Active(id) => format!("{}.active", net.steps[id].name),
        Leaf::Elapsed(id) => format!("{}.t", net.steps[id].name),
        Leaf::LastElapsed(id) => format!("{}.T", net.steps[id].name),
        Leaf::TasksDone(id) => format!("{}.done", net.steps[id].name),
        Leaf::Timer(id) => net.timers[id].name.text.clone(),
        Leaf::Rise(id) => format!("rise({})", expr_key(net, &net.edges[id].expr)),
        Leaf::Fall(id) => format!("fall({})", expr_key(net, &net.edges[id].expr)),
        Leaf::Fireable(id) => format!("{}.fireable", net.transitions[id].name),
        Leaf::Controlled(id) => net.actions[id].name.text.clone(),
    }
}
