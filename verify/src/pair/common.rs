//! The common part of two nets: shared inputs, compared columns, and what is omitted.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use grafsynth_ir::net::{
    InputId, InputKind, Net, Property, PropertyRole, StepId, StepKind, StmtKind,
};
use grafsynth_sim::{ColumnKind, Difference, InputRow, Row, TraceLayout, Value};

use crate::exclusive::net_expr;
use crate::relevance::Relevance;

/// One of two nets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// The first net.
    Left,
    /// The second net.
    Right,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Side::Left => "first",
            Side::Right => "second",
        })
    }
}

/// An input of either net, found by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommonInput {
    /// The name.
    pub name: String,
    /// The input of the first net; `None` if it has no such input.
    pub left: Option<InputId>,
    /// The input of the second net, if it has one.
    pub right: Option<InputId>,
    /// The smallest and the largest value that is possible in every net with this input.
    pub bounds: (i64, i64),
}

/// A column that both traces have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommonColumn {
    /// The header.
    pub name: String,
    /// The index of the column in the first net's layout.
    pub left: usize,
    /// The index of the column in the second net's layout.
    pub right: usize,
}

/// Something that the comparison does not cover.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Omitted {
    /// A column that only one net has.
    Column {
        /// The header of the column.
        name: String,
        /// The net that has the column.
        side: Side,
    },
    /// Calls of one name, with arguments in one net and without in the other.
    Calls {
        /// The name of the extern action.
        name: String,
    },
    /// Active steps: the nets do not have the same step names.
    Steps,
    /// Target-language text, which is not executed.
    Code {
        /// The net that contains the text.
        side: Side,
    },
    /// An input that only one net has; it may have any value.
    Input {
        /// The name of the input.
        name: String,
        /// The net that has the input.
        side: Side,
    },
    /// Values of an input that are possible in only one of the nets.
    Values {
        /// The name of the input.
        name: String,
        /// The smallest and the largest value in the first net.
        left: (i64, i64),
        /// The smallest and the largest value in the second net.
        right: (i64, i64),
    },
    /// The behaviour under inputs that violate an assumption of only one of the nets.
    Assumptions {
        /// The net that makes the assumption.
        side: Side,
    },
}

impl fmt::Display for Omitted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Omitted::Column { name, side } => {
                write!(f, "`{name}` is not compared: only the {side} has it")
            }
            Omitted::Calls { name } => {
                write!(
                    f,
                    "calls of `{name}` are not compared: only one of the two designs passes arguments"
                )
            }
            Omitted::Steps => {
                write!(
                    f,
                    "active steps are not compared: the two designs have different step names"
                )
            }
            Omitted::Code { side } => {
                write!(f, "verbatim code of the {side} is not compared: it is not executed")
            }
            Omitted::Input { name, side } => {
                write!(f, "only the {side} has the input `{name}`, which may have any value")
            }
            Omitted::Values { name, left, right } => write!(
                f,
                "`{name}` is {}..{} in the first and {}..{} in the second: compared only for values possible in both",
                left.0, left.1, right.0, right.1
            ),
            Omitted::Assumptions { side } => {
                write!(f, "compared only for inputs that satisfy the assumptions of the {side}")
            }
        }
    }
}

/// Why two nets cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Incomparable {
    /// The nets share no output, variable or set of steps.
    NothingInCommon,
    /// Both nets count time, but in ticks of different lengths (nanoseconds).
    Ticks {
        /// The length of the first net's tick.
        left: u64,
        /// The length of the second net's tick.
        right: u64,
    },
    /// No value of this input is possible in both.
    NoCommonValue {
        /// The name of the input.
        input: String,
    },
}

impl fmt::Display for Incomparable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Incomparable::NothingInCommon => {
                write!(f, "the two designs have no output and no variable of the same name")
            }
            Incomparable::Ticks { left, right } => write!(
                f,
                "the two designs count time in ticks of different length: {} and {}",
                duration(*left),
                duration(*right)
            ),
            Incomparable::NoCommonValue { input } => {
                write!(f, "no value of input `{input}` is possible in both designs")
            }
        }
    }
}

/// A duration in the largest unit that gives a whole number.
fn duration(ns: u64) -> String {
    let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")];
    let unit = units.iter().find(|(length, _)| ns.is_multiple_of(*length));
    unit.map_or_else(|| format!("{ns} ns"), |(length, unit)| format!("{} {unit}", ns / length))
}

/// Two nets side by side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Common {
    /// The inputs of either net, those of the first net first.
    pub inputs: Vec<CommonInput>,
    /// The columns that are compared, in the order of the first net.
    pub columns: Vec<CommonColumn>,
    /// The columns, inputs and assumptions that the comparison omits.
    pub omitted: Vec<Omitted>,
    /// Steps with the same name that a trace shows, if active steps are compared.
    pub(crate) steps: Vec<(StepId, StepId)>,
    pub(crate) layouts: (TraceLayout, TraceLayout),
}

impl Common {
    /// Pairs inputs and columns by name. `fault` is compared if both nets have it, and active steps if both nets have the same step names.
    ///
    /// # Errors
    /// The reason why the two nets cannot be compared.
    pub fn of(left: &Net, right: &Net) -> Result<Self, Incomparable> {
        let (ticks, other) = (left.settings.tick_ns, right.settings.tick_ns);
        if ticks != other && Relevance::of(left).has_time() && Relevance::of(right).has_time() {
            return Err(Incomparable::Ticks { left: ticks, right: other });
        }
        let mut omitted = Vec::new();
        let inputs = inputs(left, right, &mut omitted)?;
        let layouts = (TraceLayout::of(left), TraceLayout::of(right));
        let steps = steps(left, right);
        let columns = columns(&layouts, steps.is_some(), &mut omitted);
        if columns.is_empty() {
            return Err(Incomparable::NothingInCommon);
        }
        for (net, side) in [(left, Side::Left), (right, Side::Right)] {
            let has_code = net.statements().any(|stmt| matches!(stmt.kind, StmtKind::Code(_)));
            if has_code {
                omitted.push(Omitted::Code { side });
            }
        }
        assumptions(left, right, &mut omitted);
        Ok(Common { inputs, columns, omitted, steps: steps.unwrap_or_default(), layouts })
    }

    /// The first cell in which two rows differ and which neither net leaves open.
    pub(crate) fn differs(&self, left: &Row, right: &Row) -> Option<usize> {
        let (ours, theirs) = (&self.layouts.0, &self.layouts.1);
        self.columns.iter().position(|column| {
            let is_equal = match ours.columns[column.left].kind {
                ColumnKind::Steps => self.steps.iter().all(|(a, b)| {
                    left.steps.binary_search(a).is_ok() == right.steps.binary_search(b).is_ok()
                }),
                _ => ours.cell(column.left, left) == theirs.cell(column.right, right),
            };
            !is_equal && !ours.is_open(column.left, left) && !theirs.is_open(column.right, right)
        })
    }

    /// The cell of a compared column in both rows, as their traces show it.
    pub(crate) fn difference(
        &self,
        column: usize,
        number: usize,
        left: &Row,
        right: &Row,
    ) -> Difference {
        let CommonColumn { name, left: ours, right: theirs } = &self.columns[column];
        let text = |layout: &TraceLayout, column: usize, row: &Row| {
            let value: Value = layout.cell(column, row);
            layout.text(&value)
        };
        Difference {
            row: number,
            column: name.clone(),
            left: text(&self.layouts.0, *ours, left),
            right: text(&self.layouts.1, *theirs, right),
        }
    }

    /// Input rows of both nets with these values of [`Common::inputs`].
    pub(crate) fn rows(
        &self,
        left: &Net,
        right: &Net,
        dt: u32,
        values: &[i64],
    ) -> (InputRow, InputRow) {
        let mut ours = InputRow { dt, ..InputRow::zero(left) };
        let mut theirs = InputRow { dt, ..InputRow::zero(right) };
        for (input, value) in self.inputs.iter().zip(values) {
            if let Some(id) = input.left {
                ours.values[id.index()] = *value;
            }
            if let Some(id) = input.right {
                theirs.values[id.index()] = *value;
            }
        }
        (ours, theirs)
    }
}

fn inputs(
    left: &Net,
    right: &Net,
    omitted: &mut Vec<Omitted>,
) -> Result<Vec<CommonInput>, Incomparable> {
    let is_given = |kind: InputKind| kind != InputKind::InternalEvent;
    let named = |net: &Net| -> BTreeMap<String, InputId> {
        let given = net.inputs.iter().filter(|(_, input)| is_given(input.kind));
        given.map(|(id, input)| (input.name.text.clone(), id)).gather()
    };
    let (ours, theirs) = (named(left), named(right));
    let mut inputs = Vec::new();
    for (id, input) in left.inputs.iter().filter(|(_, input)| is_given(input.kind)) {
        let name = input.name.text.clone();
        let own = input.ty.bounds();
        let Some(twin) = theirs.get(&name).copied() else {
            omitted.push(Omitted::Input { name: name.clone(), side: Side::Left });
            inputs.push(CommonInput { name, left: Some(id), right: None, bounds: own });
            continue;
        };
        let other = right.inputs[twin].ty.bounds();
        let bounds = (own.0.max(other.0), own.1.min(other.1));
        if bounds.0 > bounds.1 {
            return Err(Incomparable::NoCommonValue { input: name });
        }
        if own != other {
            omitted.push(Omitted::Values { name: name.clone(), left: own, right: other });
        }
        inputs.push(CommonInput { name, left: Some(id), right: Some(twin), bounds });
    }
    for (id, input) in right.inputs.iter().filter(|(_, input)| is_given(input.kind)) {
        let name = input.name.text.clone();
        if !ours.contains_key(&name) {
            omitted.push(Omitted::Input { name: name.clone(), side: Side::Right });
            let bounds = input.ty.bounds();
            inputs.push(CommonInput { name, left: None, right: Some(id), bounds });
        }
    }
    Ok(inputs)
}

/// Steps that traces show, by name; `None` if the nets do not have the same names.
fn steps(left: &Net, right: &Net) -> Option<Vec<(StepId, StepId)>> {
    let shown = |net: &Net| -> BTreeMap<String, StepId> {
        let steps = net.steps.iter().filter(|(_, step)| {
            !step.hidden
                && match step.kind {
                    StepKind::Leaf | StepKind::Enclosing | StepKind::Final => true,
                    StepKind::Composite | StepKind::Parallel => false,
                }
        });
        steps.map(|(id, step)| (step.name.text.clone(), id)).gather()
    };
    let (ours, theirs) = (shown(left), shown(right));
    ours.keys()
        .eq(theirs.keys())
        .then(|| ours.values().copied().zip(theirs.into_values()).collect())
}

fn columns(
    layouts: &(TraceLayout, TraceLayout),
    same_steps: bool,
    omitted: &mut Vec<Omitted>,
) -> Vec<CommonColumn> {
    let mut columns = Vec::new();
    let mut met: BTreeSet<usize> = BTreeSet::new();
    let has_arguments = |kind: ColumnKind| matches!(kind, ColumnKind::Calls(_));
    let theirs: BTreeMap<(&str, bool), usize> = layouts
        .1
        .columns
        .iter()
        .enumerate()
        .filter(|(_, column)| !column.kind.is_given())
        // A chart may have an output called `steps` or `fault`, which is not the column with that meaning.
        .map(|(at, column)| ((column.name.as_str(), is_own(column.kind)), at))
        .gather();
    for (at, column) in
        layouts.0.columns.iter().enumerate().filter(|(_, column)| !column.kind.is_given())
    {
        let name = column.name.clone();
        match theirs.get(&(column.name.as_str(), is_own(column.kind))) {
            None => omitted.push(Omitted::Column { name, side: Side::Left }),
            Some(twin) => {
                met.insert(*twin);
                let other = layouts.1.columns[*twin].kind;
                if column.kind == ColumnKind::Steps && !same_steps {
                    omitted.push(Omitted::Steps);
                } else if has_arguments(column.kind) != has_arguments(other) {
                    omitted.push(Omitted::Calls { name });
                } else {
                    columns.push(CommonColumn { name, left: at, right: *twin });
                }
            }
        }
    }
    for (at, column) in layouts.1.columns.iter().enumerate() {
        if !column.kind.is_given() && !met.contains(&at) {
            omitted.push(Omitted::Column { name: column.name.clone(), side: Side::Right });
        }
    }
    columns
}

/// True for the columns that every trace has, whatever the chart declares.
fn is_own(kind: ColumnKind) -> bool {
    matches!(kind, ColumnKind::Steps | ColumnKind::Fault)
}

/// Lists the assumptions that only one net makes, because they restrict the comparison. An assumption that both nets make in the same words is not listed.
fn assumptions(left: &Net, right: &Net, omitted: &mut Vec<Omitted>) {
    let texts = |net: &Net| -> BTreeSet<String> {
        let assumed = net.properties.iter().filter(|one| one.role == PropertyRole::Assume);
        let mut texts: BTreeSet<String> = assumed.map(|one| assumption(net, one)).gather();
        if net.settings.events_exclusive {
            let events = net.inputs.values().filter(|input| input.kind == InputKind::Event);
            let mut names: Vec<&str> = events.map(|input| input.name.text.as_str()).collect();
            names.sort_unstable();
            texts.insert(format!("exclusive {}", names.join(" ")));
        }
        texts
    };
    let (ours, theirs) = (texts(left), texts(right));
    for (own, other, side) in [(&ours, &theirs, Side::Left), (&theirs, &ours, Side::Right)] {
        if own.difference(other).next().is_some() {
            omitted.push(Omitted::Assumptions { side });
        }
    }
}

fn assumption(net: &Net, property: &Property) -> String {
    net_expr(&property.never).map_or_else(
        || format!("{:?}", property.never),
        |never| grafsynth_ir::text::print_expr(net, &never),
    )
}
