//! Traces: the tables in which all engines are compared (semantics §11).

use std::fmt::Write;

use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Driver, Evolution, InputId, Net, OutputId, StepId, StepKind, VarId, VarOrigin,
};

use crate::row::{Effect, Row, has_column};

/// The content of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ColumnKind {
    /// The number of the row: 0 is the reset.
    Scan,
    /// Ticks since the last row.
    Dt,
    /// An input, extern condition or event, from the stimulus.
    Input(InputId),
    /// The active steps.
    Steps,
    /// An output; for an extern action without parameters, the number of its calls.
    Output(OutputId),
    /// The calls of an extern action with parameters.
    Calls(OutputId),
    /// A variable.
    Var(VarId),
    /// One element of an array, by its index in [`Row::vars`].
    Element(VarId, u32),
    /// The fault flag.
    Fault,
}

impl ColumnKind {
    /// True for the columns that the stimulus determines; their cells are never open.
    #[must_use]
    pub fn is_given(self) -> bool {
        matches!(self, ColumnKind::Scan | ColumnKind::Dt | ColumnKind::Input(_))
    }
}

/// One column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// The header of the column.
    pub name: String,
    /// The content of the column.
    pub kind: ColumnKind,
    /// The range of the numbers in the column, if it contains numbers.
    pub ty: Type,
}

/// Additional entries of `steps` beyond leaves and enclosing steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TraceOptions {
    /// True to list composite and parallel states, in document order.
    pub composites: bool,
    /// True to list active macro-steps, before the first step of their expansion.
    pub macros: bool,
}

/// A possible entry of the column `steps`.
#[derive(Debug, Clone, PartialEq, Eq)]
struct StepEntry {
    name: String,
    /// The steps that the entry represents; the entry is listed while one of them is active.
    steps: Vec<StepId>,
}

/// The columns of a net's traces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TraceLayout {
    /// The columns, in order.
    pub columns: Vec<Column>,
    /// The name of the module in VCD.
    pub(crate) name: String,
    entries: Vec<StepEntry>,
    /// For each step, the entry for this step alone.
    entry_of: Vec<Option<u32>>,
    /// Entries of macro-steps, which represent several steps.
    groups: Vec<u32>,
    /// For each variable, the index of its first value in [`Row::vars`].
    var_places: Vec<usize>,
}

/// A cell of a trace.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Value {
    /// A number; Booleans are 0 and 1.
    Number(i64),
    /// Active steps: their indices in the layout's list of steps, ascending.
    Steps(Vec<u32>),
    /// Calls with their arguments, in order.
    Calls(Vec<Vec<i64>>),
}

/// One row of a trace.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TraceRow {
    /// One value for each column.
    pub values: Vec<Value>,
    /// For each column, true if the chart leaves the cell open; empty if no cell is open.
    pub open: Vec<bool>,
}

/// The trace of an engine for a stimulus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trace {
    /// The columns.
    pub layout: TraceLayout,
    /// Row 0 is the reset.
    pub rows: Vec<TraceRow>,
}

impl TraceLayout {
    /// The columns of a net according to semantics §11.
    #[must_use]
    pub fn of(net: &Net) -> Self {
        Self::with(net, TraceOptions::default())
    }

    /// Like [`TraceLayout::of`], with the additional entries in `steps` that `options` select.
    #[must_use]
    pub fn with(net: &Net, options: TraceOptions) -> Self {
        let mut layout = TraceLayout {
            columns: Vec::new(),
            name: net.name.text.clone(),
            entries: Vec::new(),
            entry_of: vec![None; net.steps.len()],
            groups: Vec::new(),
            var_places: Vec::new(),
        };
        let count = Type::Int { lo: 0, hi: i64::from(i32::MAX) };
        layout.column("scan", ColumnKind::Scan, count);
        layout.column("dt", ColumnKind::Dt, count);
        for (id, input) in net.inputs.iter().filter(|(_, input)| has_column(input.kind)) {
            layout.column(&input.name.text, ColumnKind::Input(id), input.ty);
        }
        layout.column("steps", ColumnKind::Steps, Type::Bool);
        layout.list_steps(net, options);
        for (id, output) in net.outputs.iter() {
            match &output.driver {
                Driver::Extern { params, .. } if params.is_empty() => {
                    layout.column(&output.name.text, ColumnKind::Output(id), count);
                }
                Driver::Extern { .. } => {
                    layout.column(&output.name.text, ColumnKind::Calls(id), count)
                }
                Driver::Continuous(_)
                | Driver::Mealy(_)
                | Driver::Fires(_)
                | Driver::Stored(_)
                | Driver::Controlled(_) => {
                    layout.column(&output.name.text, ColumnKind::Output(id), output.ty);
                }
            }
        }
        layout.list_vars(net);
        if net.settings.evolution != Evolution::Single {
            layout.column("fault", ColumnKind::Fault, Type::Bool);
        }
        layout
    }

    fn column(&mut self, name: &str, kind: ColumnKind, ty: Type) {
        self.columns.push(Column { name: name.to_owned(), kind, ty });
    }

    fn list_steps(&mut self, net: &Net, options: TraceOptions) {
        for (id, step) in net.steps.iter() {
            if options.macros {
                for one in net.macros.iter().filter(|one| one.steps.iter().min() == Some(&id)) {
                    self.groups.push(self.entries.len() as u32);
                    self.entries
                        .push(StepEntry { name: one.name.text.clone(), steps: one.steps.clone() });
                }
            }
            let is_shown = match step.kind {
                StepKind::Leaf | StepKind::Enclosing | StepKind::Final => true,
                StepKind::Composite | StepKind::Parallel => options.composites,
            };
            if is_shown && !step.hidden {
                self.entry_of[id.index()] = Some(self.entries.len() as u32);
                self.entries.push(StepEntry { name: step.name.text.clone(), steps: vec![id] });
            }
        }
    }

    fn list_vars(&mut self, net: &Net) {
        let mut place = 0;
        for (id, var) in net.vars.iter() {
            self.var_places.push(place);
            place += var.len.unwrap_or(1) as usize;
            if var.origin != VarOrigin::Declared {
                continue;
            }
            match var.len {
                None => self.column(&var.name.text, ColumnKind::Var(id), var.ty),
                Some(len) => {
                    for element in 0..len {
                        self.column(
                            &format!("{}[{element}]", var.name),
                            ColumnKind::Element(id, element),
                            var.ty,
                        );
                    }
                }
            }
        }
    }

    /// The names that can occur in the column `steps`, in order.
    pub fn step_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.entries.iter().map(|entry| entry.name.as_str())
    }

    /// The cells of a row; [`Trace::push`] fills in `scan`, otherwise it is 0.
    #[must_use]
    pub fn row(&self, row: &Row) -> TraceRow {
        let values = self.columns.iter().map(|column| self.value(column.kind, row)).collect();
        let mut cells = TraceRow { values, open: Vec::new() };
        if row.open.row {
            self.open_all(&mut cells);
        } else if row.open.any() {
            cells.open = self.columns.iter().map(|column| is_open(column.kind, row)).collect();
        }
        cells
    }

    /// The cell of one column.
    #[must_use]
    pub fn cell(&self, column: usize, row: &Row) -> Value {
        self.columns.get(column).map_or(Value::Number(0), |column| self.value(column.kind, row))
    }

    /// True if the chart leaves the cell open.
    #[must_use]
    pub fn is_open(&self, column: usize, row: &Row) -> bool {
        self.columns.get(column).is_some_and(|column| {
            (row.open.row && !column.kind.is_given())
                || (row.open.any() && is_open(column.kind, row))
        })
    }

    /// Marks every cell as open, except those of the stimulus.
    pub fn open_all(&self, row: &mut TraceRow) {
        row.open = self.columns.iter().map(|column| !column.kind.is_given()).collect();
    }

    fn value(&self, kind: ColumnKind, row: &Row) -> Value {
        let var = |var: VarId, element: u32| {
            let place = self.var_places[var.index()] + element as usize;
            Value::Number(row.vars.get(place).copied().unwrap_or(0))
        };
        match kind {
            ColumnKind::Scan => Value::Number(0),
            ColumnKind::Dt => Value::Number(i64::from(row.dt)),
            ColumnKind::Input(input) => {
                Value::Number(row.inputs.get(input.index()).copied().unwrap_or(0))
            }
            ColumnKind::Steps => Value::Steps(self.shown_steps(&row.steps)),
            ColumnKind::Output(output) => {
                Value::Number(row.outputs.get(output.index()).copied().unwrap_or(0))
            }
            ColumnKind::Calls(output) => Value::Calls(
                row.effects
                    .iter()
                    .filter_map(|effect| match effect {
                        Effect::Call(called, arguments) if *called == output => {
                            Some(arguments.clone())
                        }
                        Effect::Call(..) | Effect::Condition(_) | Effect::Code(_) => None,
                    })
                    .collect(),
            ),
            ColumnKind::Var(id) => var(id, 0),
            ColumnKind::Element(id, element) => var(id, element),
            ColumnKind::Fault => Value::Number(i64::from(row.fault)),
        }
    }

    fn shown_steps(&self, active: &[StepId]) -> Vec<u32> {
        let mut shown: Vec<u32> = active
            .iter()
            .filter_map(|step| self.entry_of.get(step.index()).copied().flatten())
            .collect();
        for group in &self.groups {
            if self.entries[*group as usize].steps.iter().any(|step| active.contains(step)) {
                shown.push(*group);
            }
        }
        shown.sort_unstable();
        shown
    }

    /// Appends the cells of a row in the CSV format of traces, without its number and without a line end; open cells are not marked.
    pub fn write_cells(&self, row: &Row, text: &mut String) {
        for (place, column) in self.columns.iter().skip(1).enumerate() {
            if place > 0 {
                text.push(',');
            }
            self.write_value(text, &self.value(column.kind, row));
        }
    }

    /// The cell in the CSV format of traces.
    #[must_use]
    pub fn text(&self, value: &Value) -> String {
        let mut text = String::new();
        self.write_value(&mut text, value);
        text
    }

    pub(crate) fn write_value(&self, text: &mut String, value: &Value) {
        // Writing into a String cannot fail.
        match value {
            Value::Number(number) => {
                let _ = write!(text, "{number}");
            }
            Value::Steps(steps) => {
                for (place, step) in steps.iter().enumerate() {
                    if place > 0 {
                        text.push(' ');
                    }
                    text.push_str(
                        self.entries.get(*step as usize).map_or("?", |entry| entry.name.as_str()),
                    );
                }
            }
            Value::Calls(calls) => {
                for (place, call) in calls.iter().enumerate() {
                    if place > 0 {
                        text.push(';');
                    }
                    for (place, argument) in call.iter().enumerate() {
                        if place > 0 {
                            text.push(':');
                        }
                        let _ = write!(text, "{argument}");
                    }
                }
            }
        }
    }
}

impl Trace {
    /// A trace without rows.
    #[must_use]
    pub fn new(layout: TraceLayout) -> Self {
        Trace { layout, rows: Vec::new() }
    }

    /// The number of reactions with at least one cell that is not open. In all other reactions every cell is open, because an assumption was violated or an
    /// earlier situation was left open, so a comparison finds no difference there.
    #[must_use]
    pub fn asked_reactions(&self) -> usize {
        let computed = |at: usize| !self.layout.columns[at].kind.is_given();
        let is_asked = |row: &&TraceRow| {
            row.open.is_empty()
                || row.open.iter().enumerate().any(|(at, open)| !open && computed(at))
        };
        self.rows.iter().skip(1).filter(is_asked).count()
    }

    /// Adds a row and numbers it.
    pub fn push(&mut self, mut row: TraceRow) {
        if let Some(scan) = row.values.first_mut() {
            *scan = Value::Number(self.rows.len() as i64);
        }
        self.rows.push(row);
    }
}

/// Semantics §3.6: open cells, and those that depend on them in this row. A mealy output does not depend on the next situation.
fn is_open(kind: ColumnKind, row: &Row) -> bool {
    if let ColumnKind::Output(output) | ColumnKind::Calls(output) = kind {
        let is_fixed = row.open.fixed.contains(&output);
        return row.open.outputs.contains(&output) || (row.open.next && !is_fixed);
    }
    row.open.next && !kind.is_given()
}

/// The first cell in which two traces differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The row; if one trace is shorter, the first missing row.
    pub row: usize,
    /// The header of the column; `scan` if a row is missing, and the position of the column if the headers differ.
    pub column: String,
    /// The cell in the left trace; empty if there is none.
    pub left: String,
    /// The cell in the right trace; empty if there is none.
    pub right: String,
}

/// The first difference of two traces, row by row, left to right within a row; `None` if they are equal. A cell that either trace marks as open is equal
/// to everything.
#[must_use]
pub fn compare(left: &Trace, right: &Trace) -> Option<Difference> {
    let name = |trace: &Trace, at: usize| {
        trace.layout.columns.get(at).map_or(String::new(), |column| column.name.clone())
    };
    let n_columns = left.layout.columns.len().max(right.layout.columns.len());
    for at in 0..n_columns {
        let (left, right) = (name(left, at), name(right, at));
        if left != right {
            return Some(Difference { row: 0, column: format!("header {}", at + 1), left, right });
        }
    }
    let same_names = left.layout.entries.iter().map(|entry| &entry.name).eq(right
        .layout
        .entries
        .iter()
        .map(|entry| &entry.name));
    for row in 0..left.rows.len().max(right.rows.len()) {
        let (Some(a), Some(b)) = (left.rows.get(row), right.rows.get(row)) else {
            let shown = |trace: &Trace| {
                if row < trace.rows.len() { row.to_string() } else { String::new() }
            };
            return Some(Difference {
                row,
                column: "scan".to_owned(),
                left: shown(left),
                right: shown(right),
            });
        };
        for at in 0..n_columns {
            let is_open = [a, b].iter().any(|row| row.open.get(at).copied().unwrap_or(false));
            let cells = (a.values.get(at), b.values.get(at));
            let is_equal = match cells {
                (Some(Value::Steps(_)), Some(Value::Steps(_))) if !same_names => {
                    cell_text(left, row, at) == cell_text(right, row, at)
                }
                (a, b) => a == b,
            };
            if !is_equal && !is_open {
                let column = name(left, at);
                return Some(Difference {
                    row,
                    column,
                    left: cell_text(left, row, at),
                    right: cell_text(right, row, at),
                });
            }
        }
    }
    None
}

fn cell_text(trace: &Trace, row: usize, at: usize) -> String {
    let value = trace.rows.get(row).and_then(|row| row.values.get(at));
    value.map_or(String::new(), |value| trace.layout.text(value))
}
