//! The reachable product automaton of a chart: one state for each reachable state of the chart, with rows for all its inputs. Fig. 3 of the paper on the
//! Graphical FSM Editor (GFE) calls it the equivalent finite-state machine.
//!
//! Outputs are those of the reaction, as in a row of the trace. A machine that is read back has them as Mealy outputs, so its trace equals that of the chart
//! from row 1 on; its row 0, before any reaction, shows the result of a first reaction with all inputs 0.

use crate::codes::NO_TABLE;
use crate::rows;
use grafsynth_frontend::kiss2::{self, Machine, Trit};
use grafsynth_ir::net::{InputId, InputKind, Net, OutputId};
use grafsynth_ir::span::Span;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{InputRow, Row, Simulator, State};
use indexmap::IndexMap;
use std::collections::{BTreeMap, BTreeSet};

/// The maximum number of inputs that are enumerated, including the tick.
const MAX_INPUTS: usize = 14;
/// The maximum number of states of a table.
const MAX_STATES: usize = 10_000;
/// The maximum number of reactions that [`machine`] runs.
const MAX_REACTIONS: usize = 1 << 21;

/// The reaction to one combination of inputs in a state: the next state and the outputs.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Answer {
    to: Option<usize>,
    outputs: Vec<Trit>,
}

/// The state table of a net. An input `tick` is added if the net measures time.
///
/// Inputs that violate an assumption have no row, so they are don't-cares; so is everything that the net leaves undefined.
///
/// # Errors
/// An input or output is not a single bit, the chart calls a function, or the table would be too large.
pub fn machine(net: &Valid<Net>) -> Result<Machine, Vec<Diagnostic>> {
    machine_within(net, MAX_REACTIONS)
}

/// Like [`machine`], with at most this many reactions.
///
/// # Errors
/// Like [`machine`].
pub fn machine_within(net: &Valid<Net>, max_reactions: usize) -> Result<Machine, Vec<Diagnostic>> {
    let (inputs, outputs) = bits(net)?;
    let has_time = rows::uses_time(net);
    let n_inputs = inputs.len() + usize::from(has_time);
    let too_large = |message: String| {
        let finding = Diagnostic::error(NO_TABLE, message).at(net.name.span, "");
        vec![finding.help("convert a part of the chart, or write it as blif, net or graf")]
    };
    if n_inputs > MAX_INPUTS {
        return Err(too_large(format!(
            "the table would have 2^{n_inputs} inputs in each state; the limit is 2^{MAX_INPUTS}"
        )));
    }
    let more_than =
        |n: usize, what: &str| too_large(format!("the table would have more than {n} {what}"));
    let mut simulator = Simulator::new(net);
    simulator.reset();
    let mut states: IndexMap<State, String> = IndexMap::new();
    states.insert(simulator.state().clone(), name(net, simulator.row()));
    let mut table = Machine {
        name: net.name.text.clone(),
        inputs: inputs.iter().map(|id| net.inputs[*id].name.text.clone()).collect(),
        outputs: outputs.iter().map(|id| net.outputs[*id].name.text.clone()).collect(),
        ..Machine::default()
    };
    if has_time {
        table.inputs.push("tick".to_owned());
    }
    let mut answers: BTreeMap<Answer, BTreeSet<u32>> = BTreeMap::new();
    let mut n_reactions = 0;
    let mut at = 0;
    while let Some((state, _)) = states.get_index(at) {
        let state = state.clone();
        answers.clear();
        for code in 0..1_u32 << n_inputs {
            let Some(row) = legal(net, &inputs, code, has_time) else { continue };
            n_reactions += 1;
            if n_reactions > max_reactions {
                return Err(more_than(max_reactions, "entries"));
            }
            simulator.set_state(&state);
            let shown = simulator.step(&row).clone();
            let to = if shown.open.next || shown.open.row {
                None
            } else {
                let entry = states.entry(simulator.state().clone());
                let index = entry.index();
                entry.or_insert_with(|| name(net, &shown));
                Some(index)
            };
            if states.len() > MAX_STATES {
                return Err(more_than(MAX_STATES, "states"));
            }
            let answer = Answer { to, outputs: cells(&shown, &outputs) };
            answers.entry(answer).or_default().insert(code);
        }
        for (answer, codes) in &answers {
            if answer.to.is_none() && answer.outputs.iter().all(|trit| *trit == Trit::Any) {
                continue;
            }
            let (from, to, span) = (Some(at), answer.to, Span::default());
            for inputs in cubes(codes, n_inputs) {
                let outputs = answer.outputs.clone();
                table.rows.push(kiss2::Row { inputs, from, to, outputs, span });
            }
        }
        at += 1;
    }
    table.states = unique(states.into_values());
    Ok(table)
}

/// The inputs and outputs of a table.
fn bits(net: &Net) -> Result<(Vec<InputId>, Vec<OutputId>), Vec<Diagnostic>> {
    let mut found = Vec::new();
    let mut refuse = |span: Span, what: String, help: &str| {
        let message = format!("a state table cannot express {what}");
        found.push(Diagnostic::error(NO_TABLE, message).at(span, "").help(help));
    };
    let bits = "convert to `.net` or `.v`, or use one input or output for each bit";
    let calls = "convert to `.net`, or use an output in place of the call";
    let mut inputs: Vec<InputId> = Vec::new();
    for (id, input) in net.inputs.iter().filter(|(_, input)| input.kind != InputKind::InternalEvent)
    {
        if !input.ty.is_bool() {
            refuse(input.meta.span, format!("the integer input `{}`", input.name), bits);
        }
        inputs.push(id);
    }
    let mut outputs: Vec<OutputId> = Vec::new();
    for (id, output) in net.outputs.iter() {
        if output.is_extern() {
            refuse(output.meta.span, format!("a call of `{}`", output.name), calls);
        } else if !output.ty.is_bool() {
            refuse(output.meta.span, format!("the integer output `{}`", output.name), bits);
        }
        outputs.push(id);
    }
    if found.is_empty() { Ok((inputs, outputs)) } else { Err(found) }
}

/// The row of inputs with these bits, the last of which is the tick; `None` if the net excludes it.
fn legal(net: &Valid<Net>, inputs: &[InputId], code: u32, has_time: bool) -> Option<InputRow> {
    let tick = !has_time || code >> inputs.len() & 1 == 1;
    let mut row = InputRow { dt: u32::from(tick), ..InputRow::zero(net) };
    for (bit, input) in inputs.iter().enumerate() {
        row = row.with(*input, i64::from(code >> bit & 1));
    }
    let is_event = |id: &&InputId| net.inputs[**id].kind.is_event() && row.value(**id) != 0;
    let is_excluded = net.settings.events_exclusive && inputs.iter().filter(is_event).count() > 1;
    (!is_excluded && !grafsynth_sim::breaks_assumption(net, &row)).then_some(row)
}

/// The outputs of a reaction; those that the net leaves undefined are don't-cares.
fn cells(shown: &Row, outputs: &[OutputId]) -> Vec<Trit> {
    let open = &shown.open;
    let is_open = |output: &OutputId| {
        let is_in_next = open.next && !open.fixed.contains(output);
        open.row || open.outputs.contains(output) || is_in_next
    };
    let cell = |output: &OutputId| match shown.outputs[output.index()] {
        _ if is_open(output) => Trit::Any,
        0 => Trit::Low,
        _ => Trit::High,
    };
    outputs.iter().map(cell).collect()
}

/// The states of a table: equal names get a number.
fn unique(names: impl Iterator<Item = String>) -> Vec<kiss2::State> {
    let mut taken = BTreeSet::new();
    let mut own = |name: String| {
        let copies = (2..).map(|copy| format!("{name}_{copy}"));
        let free = std::iter::once(name.clone()).chain(copies).find(|one| !taken.contains(one));
        taken.extend(free.clone());
        kiss2::State { name: free.unwrap_or(name), span: Span::default() }
    };
    names.map(&mut own).collect()
}

/// The name of a state: its active steps.
fn name(net: &Net, row: &Row) -> String {
    let steps = row.steps.iter().filter(|step| !net.steps[**step].hidden);
    let names: Vec<&str> = steps.map(|step| net.steps[*step].name.text.as_str()).collect();
    if names.is_empty() { "empty".to_owned() } else { names.join("+") }
}

/// A few cubes that cover exactly these points. Each uncovered point is widened column by column, as long as every point of the cube is in
/// the set.
fn cubes(codes: &BTreeSet<u32>, n_inputs: usize) -> Vec<Vec<Trit>> {
    let mut covered: BTreeSet<u32> = BTreeSet::new();
    let mut cubes = Vec::new();
    for code in codes {
        if covered.contains(code) {
            continue;
        }
        let mut points = vec![*code];
        let mut free = 0_u32;
        for bit in 0..n_inputs {
            let flipped: Vec<u32> = points.iter().map(|point| point ^ (1 << bit)).collect();
            if flipped.iter().all(|point| codes.contains(point)) {
                points.extend(flipped);
                free |= 1 << bit;
            }
        }
        covered.extend(points);
        let trit = |bit: usize| match (free >> bit & 1, code >> bit & 1) {
            (1, _) => Trit::Any,
            (_, 1) => Trit::High,
            (_, _) => Trit::Low,
        };
        cubes.push((0..n_inputs).map(trit).collect());
    }
    cubes
}

#[cfg(test)]
mod tests {
    use super::cubes;
    use std::collections::BTreeSet;

    #[test]
    fn cubes_cover_the_points_and_no_other() {
        for set in 0..1_u32 << 8 {
            let codes: BTreeSet<u32> = (0..8).filter(|code| set >> code & 1 == 1).collect();
            let cubes = cubes(&codes, 3);
            for point in 0..8_u32 {
                let is_in = cubes.iter().any(|cube| {
                    use grafsynth_frontend::kiss2::Trit;
                    cube.iter().enumerate().all(|(bit, trit)| match trit {
                        Trit::Any => true,
                        Trit::High => point >> bit & 1 == 1,
                        Trit::Low => point >> bit & 1 == 0,
                    })
                });
                assert_eq!(is_in, codes.contains(&point), "{set:b}");
            }
        }
    }
}
