//! Two designs on one stimulus, by what they have in common.

use crate::codes;
use crate::run::net_trace;
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_logic::chip::most_clocks;
use grafsynth_logic::sim::LogicSim;
use grafsynth_sim::{ColumnKind, Difference, InputRow, Stimulus, Trace, Value};
use std::collections::BTreeMap;

/// What a comparison found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The first difference.
    pub difference: Option<Difference>,
    /// How many computed columns both have.
    pub n_columns: usize,
}

/// Two nets under a stimulus of the first: inputs by name, and every computed column that both have, `steps` if they have the same step names.
///
/// # Errors
/// When they have no column in common.
pub fn nets(
    left: &Valid<Net>,
    right: &Valid<Net>,
    stimulus: &Stimulus,
) -> Result<Outcome, Vec<Diagnostic>> {
    let mut other = Stimulus::new(right);
    for row in stimulus.rows() {
        let mut taken = InputRow { dt: row.dt, ..InputRow::zero(right) };
        for (id, input) in right.inputs.iter() {
            if let Some((from, _)) =
                left.inputs.iter().find(|(_, known)| known.name.text == input.name.text)
            {
                taken = taken.with(id, input.ty.saturate(row.value(from)));
            }
        }
        other.push(&taken);
    }
    let mut ours = net_trace(left, stimulus);
    let mut theirs = net_trace(right, &other);
    let same_steps = same_step_names(left, right);
    let n_columns = keep_common(&mut ours, &mut theirs, same_steps);
    if n_columns == 0 {
        return Err(nothing_in_common());
    }
    Ok(Outcome { difference: by_text(&ours, &theirs), n_columns })
}

/// A net and logic by others: pins are found by name, and every Boolean output of the net that the logic has is compared.
///
/// Where the chart evolves until it is stable, logic with an output `busy` that the chart does not have takes several clocks for a reaction
/// (semantics.md §9): it is clocked until `busy` is 0.
///
/// # Errors
/// When an input of the logic is not in the net, or no output is common, or the stimulus is not for a chip.
pub fn with_logic(
    net: &Valid<Net>,
    logic: &Logic,
    stimulus: &Stimulus,
) -> Result<Outcome, Vec<Diagnostic>> {
    if let Some(diagnostic) = stimulus.check_for_chip() {
        return Err(vec![diagnostic]);
    }
    let fold = str::to_lowercase;
    let mut found = Vec::new();
    let mut inputs = Vec::new();
    for (pin, input) in logic.inputs.iter() {
        match net.inputs.iter().find(|(_, known)| fold(&known.name.text) == fold(&input.name)) {
            Some((id, _)) => inputs.push((pin, id)),
            None if input.role == PinRole::Tick || fold(&input.name) == "tick" => {}
            None => found.push(
                Diagnostic::error(
                    codes::LOGIC_DOES_NOT_FIT,
                    format!("the logic has an input `{}`, the chart has none", input.name),
                )
                .at(input.meta.span, "")
                .help("inputs are found by name; letter case does not matter"),
            ),
        }
    }
    if !found.is_empty() {
        return Err(found);
    }
    let trace = net_trace(net, stimulus);
    let outputs: Vec<_> = trace
        .layout
        .columns
        .iter()
        .enumerate()
        .filter(|(_, column)| matches!(column.kind, ColumnKind::Output(_)) && column.ty.is_bool())
        .filter_map(|(at, column)| {
            let named = |name: &str| fold(name) == fold(&column.name);
            let pin =
                logic.outputs.iter().find(|(_, output)| named(&output.name)).map(|(pin, _)| pin)?;
            Some((at, pin, column.name.clone()))
        })
        .collect();
    if outputs.is_empty() {
        return Err(nothing_in_common());
    }
    let mut chip = LogicSim::new(logic);
    let mut difference = None;
    let tick =
        logic.inputs.iter().find(|(_, input)| fold(&input.name) == "tick").map(|(pin, _)| pin);
    let has_own_busy = net.outputs.values().any(|output| fold(&output.name.text) == "busy");
    let is_stable = most_clocks(net) > 1;
    let busy = logic
        .outputs
        .iter()
        .find(|(_, output)| is_stable && !has_own_busy && fold(&output.name) == "busy")
        .map(|(pin, _)| pin);
    let rows = std::iter::once(InputRow { dt: 0, ..InputRow::zero(net) }).chain(stimulus.rows());
    'rows: for (at, row) in rows.enumerate() {
        for (pin, id) in &inputs {
            chip.set_input(*pin, u64::from(row.value(*id) != 0));
        }
        if let Some(tick) = tick {
            chip.set_input(tick, u64::from(row.dt == 1));
        }
        if at > 0 {
            chip.clock();
            let mut clocks = 1;
            let is_busy =
                |chip: &mut LogicSim<'_>| busy.is_some_and(|busy| chip.output(busy) & 1 == 1);
            if is_busy(&mut chip) {
                // Events and the tick are one clock wide.
                for (pin, id) in &inputs {
                    if net.inputs[*id].kind.is_event() {
                        chip.set_input(*pin, 0);
                    }
                }
                if let Some(tick) = tick {
                    chip.set_input(tick, 0);
                }
            }
            while is_busy(&mut chip) {
                if clocks >= most_clocks(net) {
                    difference = Some(Difference {
                        row: at,
                        column: "busy".to_owned(),
                        left: "0".to_owned(),
                        right: "1".to_owned(),
                    });
                    break 'rows;
                }
                chip.clock();
                clocks += 1;
            }
        }
        let Some(expected) = trace.rows.get(at) else { break };
        for (column, pin, name) in &outputs {
            let value = Value::Number(i64::from(chip.output(*pin) & 1 == 1));
            let is_open = expected.open.get(*column).copied().unwrap_or(false);
            if let Some(wanted) = expected.values.get(*column)
                && !is_open
                && *wanted != value
            {
                difference = Some(Difference {
                    row: at,
                    column: name.clone(),
                    left: trace.layout.text(wanted),
                    right: trace.layout.text(&value),
                });
                break 'rows;
            }
        }
    }
    Ok(Outcome { difference, n_columns: outputs.len() })
}

/// Which cells of single rows of two nets are compared: outputs and variables by name, steps if both have the same names.
#[derive(Debug, Clone)]
pub struct RowComparison {
    layouts: (grafsynth_sim::TraceLayout, grafsynth_sim::TraceLayout),
    common: Vec<(usize, usize)>,
}

impl RowComparison {
    /// Finds the columns that both have.
    #[must_use]
    pub fn new(left: &Net, right: &Net) -> Self {
        let layouts = (grafsynth_sim::TraceLayout::of(left), grafsynth_sim::TraceLayout::of(right));
        let common = common_columns(&layouts.0, &layouts.1, same_step_names(left, right));
        RowComparison { layouts, common }
    }

    /// True if a cell that both have differs, and neither leaves it open.
    #[must_use]
    pub fn differ(&self, left: &grafsynth_sim::Row, right: &grafsynth_sim::Row) -> bool {
        let (a, b) = (self.layouts.0.row(left), self.layouts.1.row(right));
        self.common.iter().any(|(at, other)| {
            let is_open = |row: &grafsynth_sim::TraceRow, at: usize| {
                row.open.get(at).copied().unwrap_or(false)
            };
            if is_open(&a, *at) || is_open(&b, *other) {
                return false;
            }
            let (Some(ours), Some(theirs)) = (a.values.get(*at), b.values.get(*other)) else {
                return false;
            };
            match (ours, theirs) {
                (Value::Steps(_), Value::Steps(_)) => {
                    sorted_words(&self.layouts.0.text(ours))
                        != sorted_words(&self.layouts.1.text(theirs))
                }
                (ours, theirs) => ours != theirs,
            }
        })
    }
}

fn sorted_words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = text.split(' ').map(str::to_owned).collect();
    words.sort();
    words
}

fn same_step_names(left: &Net, right: &Net) -> bool {
    let names = |net: &Net| {
        let mut names: Vec<String> =
            net.steps.values().map(|step| step.name.text.clone()).collect();
        names.sort();
        names
    };
    names(left) == names(right)
}

fn common_columns(
    left: &grafsynth_sim::TraceLayout,
    right: &grafsynth_sim::TraceLayout,
    same_steps: bool,
) -> Vec<(usize, usize)> {
    let is_computed = |kind: ColumnKind| match kind {
        ColumnKind::Scan | ColumnKind::Dt | ColumnKind::Input(_) => false,
        ColumnKind::Steps => same_steps,
        ColumnKind::Output(_)
        | ColumnKind::Calls(_)
        | ColumnKind::Var(_)
        | ColumnKind::Element(..)
        | ColumnKind::Fault => true,
    };
    let names = |layout: &grafsynth_sim::TraceLayout| -> BTreeMap<String, usize> {
        let columns = layout.columns.iter().enumerate();
        columns
            .filter(|(_, column)| is_computed(column.kind))
            .map(|(at, column)| (column.name.clone(), at))
            .collect()
    };
    let (ours, theirs) = (names(left), names(right));
    let mut common: Vec<(usize, usize)> =
        ours.iter().filter_map(|(name, at)| theirs.get(name).map(|other| (*at, *other))).collect();
    common.sort_unstable();
    common
}

fn nothing_in_common() -> Vec<Diagnostic> {
    vec![
        Diagnostic::error(
            codes::LOGIC_DOES_NOT_FIT,
            "the two designs have no output and no variable of the same name",
        )
        .help("designs are compared by the columns that both have"),
    ]
}

/// Drops the columns that only one trace has, and the inputs; how many are left.
fn keep_common(left: &mut Trace, right: &mut Trace, same_steps: bool) -> usize {
    let common = common_columns(&left.layout, &right.layout, same_steps);
    let pick = |trace: &mut Trace, columns: Vec<usize>| {
        trace.layout.columns =
            columns.iter().filter_map(|at| trace.layout.columns.get(*at).cloned()).collect();
        for row in &mut trace.rows {
            row.values = columns.iter().filter_map(|at| row.values.get(*at).cloned()).collect();
            if !row.open.is_empty() {
                row.open =
                    columns.iter().map(|at| row.open.get(*at).copied().unwrap_or(false)).collect();
            }
        }
    };
    pick(left, common.iter().map(|(at, _)| *at).collect());
    pick(right, common.iter().map(|(_, at)| *at).collect());
    common.len()
}

/// As [`grafsynth_sim::compare`], but active steps are compared as sets of names: two nets may declare them in another order.
fn by_text(left: &Trace, right: &Trace) -> Option<Difference> {
    for (row, (ours, theirs)) in left.rows.iter().zip(&right.rows).enumerate() {
        for (at, column) in left.layout.columns.iter().enumerate() {
            let is_open =
                [ours, theirs].iter().any(|row| row.open.get(at).copied().unwrap_or(false));
            let (Some(a), Some(b)) = (ours.values.get(at), theirs.values.get(at)) else { continue };
            let (a, b) = (left.layout.text(a), right.layout.text(b));
            let is_equal = if column.kind == ColumnKind::Steps {
                sorted_words(&a) == sorted_words(&b)
            } else {
                a == b
            };
            if !is_equal && !is_open {
                return Some(Difference { row, column: column.name.clone(), left: a, right: b });
            }
        }
    }
    None
}
