//! Two designs on one stimulus, by what they have in common.

use crate::codes;
use crate::run::net_trace;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{ColumnKind, Difference, InputRow, Stimulus, Trace, Value};
use std::collections::BTreeMap;

/// What a comparison found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The first difference.
    pub difference: Option<Difference>,
    /// How many computed columns both have.
    pub n_columns: usize,
    /// Outputs that only one of both has, each with the one that has it: they were not compared.
    pub apart: Apart,
}

/// Outputs that only one of two designs has.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Apart {
    /// Those of the first.
    pub first: Vec<String>,
    /// Those of the second.
    pub second: Vec<String>,
}

impl std::fmt::Display for Apart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sides = [(&self.first, "first"), (&self.second, "second")];
        let sides = sides.into_iter().filter(|(names, _)| !names.is_empty());
        let said: Vec<String> = sides
            .map(|(names, which)| format!("{} (only in the {which})", names.join(", ")))
            .collect();
        write!(f, "{}", said.join("; "))
    }
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
    Ok(Outcome { difference: by_text(&ours, &theirs), n_columns, apart: apart(left, right) })
}

/// The outputs that one of two nets has and the other has not.
fn apart(left: &Net, right: &Net) -> Apart {
    let only = |own: &Net, other: &Net| -> Vec<String> {
        let has = |name: &str| other.outputs.values().any(|output| output.name.text == name);
        let names = own.outputs.values().map(|output| &output.name.text);
        names.filter(|name| !has(name)).cloned().collect()
    };
    Apart { first: only(left, right), second: only(right, left) }
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

pub(crate) fn nothing_in_common() -> Vec<Diagnostic> {
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
