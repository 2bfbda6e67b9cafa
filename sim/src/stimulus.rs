//! Stimuli: the inputs of the environment, row by row (semantics §11).

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use grafsynth_ir::diag::nearest;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Input, InputId, InputKind, Leaf, Net, PropertyLeaf, PropertyRole};
use grafsynth_ir::{Diagnostic, FileId, Span};

use crate::codes;
use crate::csv::{self, Cell};
use crate::evaluate::eval_by;
use crate::expected::Expected;
use crate::row::{InputRow, has_column};
use crate::trace::TraceLayout;

/// The largest number of ticks in a row (semantics §7).
pub const MAX_DT: u32 = i32::MAX as u32;

/// The number of errors after which reading stops.
const MAX_ERRORS: usize = 100;
/// The number of names that a message lists.
const LISTED: usize = 12;

/// A list of input rows. Only the given columns are stored; the others are 0.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Stimulus {
    /// For each input, the value if there is no column.
    zero: Vec<i64>,
    /// The inputs that have a column, in the order of the columns.
    columns: Vec<InputId>,
    dts: Vec<u32>,
    /// `columns.len()` values for each row.
    values: Vec<i64>,
}

impl Stimulus {
    /// A stimulus without rows that has a column for each input of the net, in declaration order.
    #[must_use]
    pub fn new(net: &Net) -> Self {
        Stimulus {
            zero: InputRow::zero(net).values,
            columns: net
                .inputs
                .iter()
                .filter(|(_, input)| has_column(input.kind))
                .map(|(id, _)| id)
                .collect(),
            dts: Vec::new(),
            values: Vec::new(),
        }
    }

    /// A stimulus with these rows.
    #[must_use]
    pub fn of_rows<'r>(net: &Net, rows: impl IntoIterator<Item = &'r InputRow>) -> Self {
        let mut stimulus = Self::new(net);
        rows.into_iter().for_each(|row| stimulus.push(row));
        stimulus
    }

    /// Adds a row at the end.
    pub fn push(&mut self, row: &InputRow) {
        self.dts.push(row.dt);
        self.values.extend(self.columns.iter().map(|input| row.value(*input)));
    }

    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.dts.len()
    }

    /// True if there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.dts.is_empty()
    }

    /// The rows, each with a value for every input of the net.
    pub fn rows(&self) -> impl Iterator<Item = InputRow> + '_ {
        (0..self.len()).map(|row| self.row(row))
    }

    /// One row, counted from 0; row `n` of the stimulus is row `n + 1` of the trace.
    #[must_use]
    pub fn row(&self, row: usize) -> InputRow {
        let mut values = self.zero.clone();
        let width = self.columns.len();
        let given = self.values.get(row * width..(row + 1) * width).unwrap_or(&[]);
        for (input, value) in self.columns.iter().zip(given) {
            values[input.index()] = *value;
        }
        InputRow { dt: self.dts.get(row).copied().unwrap_or(1), values }
    }

    /// True if the input has a column; the others are 0 in each row.
    #[must_use]
    pub fn has_column(&self, input: InputId) -> bool {
        self.columns.contains(&input)
    }

    /// The number of rows with more than one tick.
    #[must_use]
    pub fn long_rows(&self) -> usize {
        self.dts.iter().filter(|dt| **dt > 1).count()
    }

    /// Keeps only the first `n_rows` rows.
    pub fn truncate(&mut self, n_rows: usize) {
        self.dts.truncate(n_rows);
        self.values.truncate(n_rows * self.columns.len());
    }

    /// The stimulus as CSV: `dt`, then the columns.
    #[must_use]
    pub fn to_csv(&self, net: &Net) -> String {
        let mut text = String::from("dt");
        for input in &self.columns {
            text.push(',');
            text.push_str(&net.inputs[*input].name.text);
        }
        text.push('\n');
        let width = self.columns.len();
        for (row, dt) in self.dts.iter().enumerate() {
            // Writing into a String cannot fail.
            let _ = write!(text, "{dt}");
            for value in &self.values[row * width..(row + 1) * width] {
                let _ = write!(text, ",{value}");
            }
            text.push('\n');
        }
        text
    }

    /// Reads a stimulus for the net; columns of a trace that are not inputs are skipped. With errors there is no stimulus; a violated assumption is a
    /// warning.
    #[must_use]
    pub fn parse_csv(net: &Net, file: FileId, text: &str) -> (Option<Stimulus>, Vec<Diagnostic>) {
        let (read, found) = Self::parse_with_expected(net, file, text);
        (read.map(|(stimulus, _)| stimulus), found)
    }

    /// Reads a stimulus for the net, and its expected values: a trace is a stimulus whose expected values are its own cells.
    #[must_use]
    pub fn parse_with_expected(
        net: &Net,
        file: FileId,
        text: &str,
    ) -> (Option<(Stimulus, Expected)>, Vec<Diagnostic>) {
        let mut reader = Reader {
            net,
            file,
            stimulus: Stimulus { zero: InputRow::zero(net).values, ..Stimulus::default() },
            expected: Expected::default(),
            has_rows: false,
            header: Vec::new(),
            diagnostics: Vec::new(),
            broken: 0,
        };
        let mut lines = csv::lines(text);
        let Some((start, header)) = lines.next() else {
            let place = Span::new(file, text.len(), text.len());
            let error = Diagnostic::error(codes::NO_HEADER, "the stimulus is empty")
                .at(place, "expected a header with the names of inputs")
                .help(format!(
                    "begin with a header such as `{}`",
                    Stimulus::new(net).to_csv(net).trim_end()
                ));
            return (None, vec![error]);
        };
        reader.header(start, header);
        for (start, line) in lines {
            if reader.diagnostics.len() >= MAX_ERRORS {
                break;
            }
            reader.row(start, line);
        }
        reader.finish()
    }
}

/// True if the row violates an assumption of the chart.
#[must_use]
pub fn breaks_assumption(net: &Net, row: &InputRow) -> bool {
    broken_assumption(net, row).is_some()
}

/// The index in `net.properties` of the first assumption that the row violates.
fn broken_assumption(net: &Net, row: &InputRow) -> Option<usize> {
    // An assumption reads only inputs; validation rejects other leaves.
    let value = |leaf: &PropertyLeaf, _: Option<i64>| match leaf {
        PropertyLeaf::Net(Leaf::Input(input)) => row.value(*input),
        PropertyLeaf::Net(_) | PropertyLeaf::Output(_) => 0,
    };
    net.properties.iter().position(|property| {
        property.role == PropertyRole::Assume && eval_by(&property.never, &value) != 0
    })
}

/// The meaning of a column of a stimulus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Dt,
    Input(InputId),
    /// The number of the row, in a trace.
    Scan,
    /// An expected cell of the trace.
    Expected,
    /// An error was already reported.
    Nothing,
}

/// A separator other than a comma between the column names in a header, with the name of the separator.
fn other_separator<'n>(
    cell: &str,
    mut names: impl Iterator<Item = &'n str> + Clone,
) -> Option<(char, &'static str)> {
    [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(sign, _)| {
        cell.contains(*sign)
            && cell.split(*sign).any(|part| names.clone().any(|name| name == part.trim()))
            && !names.any(|name| name == cell)
    })
}

/// The only name that ends in `.short`, or `short` itself if there is none (semantics §11).
///
/// # Errors
/// The names that `short` could mean, if there are several.
pub(crate) fn full_name<'n>(short: &'n str, full: &[&'n str]) -> Result<&'n str, Vec<&'n str>> {
    let is_meant = |name: &&str| {
        let prefix = name.strip_suffix(short).and_then(|prefix| prefix.strip_suffix('.'));
        !short.is_empty() && prefix.is_some_and(|prefix| !prefix.is_empty())
    };
    let candidates: Vec<&str> = full.iter().copied().filter(is_meant).collect();
    match candidates.as_slice() {
        [] => Ok(short),
        [name] => Ok(name),
        [_, _, ..] => Err(candidates),
    }
}

fn ambiguous(cell: Cell<'_>, candidates: &[&str]) -> Diagnostic {
    let names = listed(candidates.iter().copied());
    Diagnostic::error(
        codes::AMBIGUOUS_COLUMN,
        format!("`{}` is the short name of {} different columns", cell.text, candidates.len()),
    )
    .at(cell.span, "")
    .help(format!("write the full name: {names}"))
}

struct Reader<'t> {
    net: &'t Net,
    file: FileId,
    stimulus: Stimulus,
    expected: Expected,
    /// True if a row was read.
    has_rows: bool,
    header: Vec<Meaning>,
    diagnostics: Vec<Diagnostic>,
    broken: usize,
}

impl Reader<'_> {
    fn header(&mut self, start: usize, line: &str) {
        let net = self.net;
        let inputs: BTreeMap<&str, InputId> =
            net.inputs.iter().map(|(id, input)| (input.name.text.as_str(), id)).gather();
        let layout = TraceLayout::of(net);
        let computed: BTreeSet<&str> = layout
            .columns
            .iter()
            .filter(|column| !column.kind.is_given())
            .map(|column| column.name.as_str())
            .gather();
        let given = net.inputs.values().filter(|input| has_column(input.kind));
        let full: Vec<&str> = given
            .map(|input| input.name.text.as_str())
            .chain(computed.iter().copied().filter(|name| !inputs.contains_key(name)))
            .collect();
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        let mut unknown = Vec::new();
        for cell in csv::cells(self.file, start, line) {
            let is_full = inputs.contains_key(cell.text) || computed.contains(cell.text);
            let named = if is_full || ["dt", "scan"].contains(&cell.text) {
                Ok(cell.text)
            } else {
                full_name(cell.text, &full)
            };
            let meaning = match named {
                Err(candidates) => {
                    self.diagnostics.push(ambiguous(cell, &candidates));
                    Meaning::Nothing
                }
                Ok(name) => match seen.insert(name, cell.span) {
                    Some(earlier) => {
                        self.diagnostics.push(
                            Diagnostic::error(
                                codes::DOUBLE_COLUMN,
                                format!("column `{name}` is listed twice"),
                            )
                            .at(cell.span, "the second one")
                            .at(earlier, "the first one")
                            .help("remove one of them"),
                        );
                        Meaning::Nothing
                    }
                    None => {
                        let cell = Cell { text: name, ..cell };
                        self.meaning(&inputs, &computed, cell, &mut unknown)
                    }
                },
            };
            if let Meaning::Input(input) = meaning {
                self.stimulus.columns.push(input);
            }
            self.header.push(meaning);
            if self.diagnostics.len() + unknown.len() >= MAX_ERRORS {
                break;
            }
        }
        self.unknown(&unknown);
    }

    /// Reports the columns that are neither inputs nor events, in one finding.
    fn unknown(&mut self, columns: &[Cell<'_>]) {
        let given = self.net.inputs.values().filter(|input| has_column(input.kind));
        let names = || given.clone().map(|input| input.name.text.as_str()).chain(["dt"]);
        let error =
            |what| Diagnostic::error(codes::UNKNOWN_COLUMN, format!("the chart has no {what}"));
        let known = format!("columns can be {}", listed(names()));
        let finding = match columns {
            [] => return,
            [cell] => {
                let error = error(format!("input or event `{}`", cell.text)).at(cell.span, "");
                match nearest(cell.text, names()) {
                    Some(name) => {
                        error.help(format!("did you mean `{name}`?")).fix(cell.span, name)
                    }
                    None => error.help(known),
                }
            }
            several => {
                let all = listed(several.iter().map(|cell| cell.text));
                let label = |finding: Diagnostic, cell: &Cell<'_>| {
                    let near = nearest(cell.text, names());
                    let near = near.map(|name| format!("did you mean `{name}`?"));
                    finding.at(cell.span, near.unwrap_or_default())
                };
                let finding = error(format!("inputs or events {all}"));
                several.iter().take(LISTED).fold(finding, label).help(known)
            }
        };
        self.diagnostics.push(finding);
    }

    fn meaning<'c>(
        &mut self,
        inputs: &BTreeMap<&str, InputId>,
        computed: &BTreeSet<&str>,
        cell: Cell<'c>,
        unknown: &mut Vec<Cell<'c>>,
    ) -> Meaning {
        if cell.text == "dt" {
            return Meaning::Dt;
        }
        if !inputs.contains_key(cell.text) {
            if cell.text == "scan" && self.header.is_empty() {
                return Meaning::Scan;
            }
            if computed.contains(cell.text) {
                self.expected.column(cell.text, cell.span);
                return Meaning::Expected;
            }
        }
        let found = inputs.get(cell.text).map(|id| (*id, &self.net.inputs[*id]));
        match found {
            Some((id, input)) if has_column(input.kind) => Meaning::Input(id),
            Some((_, input)) => {
                self.diagnostics.push(
                    Diagnostic::error(
                        codes::INTERNAL_EVENT,
                        format!("`{}` is an internal event: only the chart raises it", cell.text),
                    )
                    .at(cell.span, "")
                    .at(input.meta.span, "declared here")
                    .help("remove the column, or declare the event without `internal`"),
                );
                Meaning::Nothing
            }
            None => {
                let known = self.net.inputs.values().filter(|input| has_column(input.kind));
                let names = known.map(|input| input.name.text.as_str()).chain(["dt"]);
                if let Some((sign, name)) = other_separator(cell.text, names) {
                    self.diagnostics.push(
                        Diagnostic::error(
                            codes::UNKNOWN_COLUMN,
                            format!("expected commas between the columns, found {name}"),
                        )
                        .at(cell.span, "")
                        .help("save the file with commas between the cells, or replace each separator")
                        .fix(cell.span, cell.text.split(sign).map(str::trim).collect::<Vec<_>>().join(",")),
                    );
                    return Meaning::Nothing;
                }
                unknown.push(cell);
                Meaning::Nothing
            }
        }
    }

    fn row(&mut self, start: usize, line: &str) {
        let mut dt = 1;
        let first_value = self.stimulus.values.len();
        let mut n_cells = 0;
        let mut events: Vec<(Cell<'_>, InputId)> = Vec::new();
        let mut expected = Vec::new();
        let mut is_reset = false;
        let span = Span::new(self.file, start, start + line.trim_end().len());
        for (place, cell) in csv::cells(self.file, start, line).enumerate() {
            n_cells = place + 1;
            match self.header.get(place).copied() {
                Some(Meaning::Dt) => dt = self.dt(cell),
                Some(Meaning::Input(input)) => {
                    let value = self.value(input, cell);
                    if value != 0 && self.net.inputs[input].kind.is_event() {
                        events.push((cell, input));
                    }
                    self.stimulus.values.push(value);
                }
                // Row 0 of a trace is the reset, which is not part of a stimulus.
                Some(Meaning::Scan) => {
                    is_reset = !self.has_rows && cell.text == "0";
                }
                Some(Meaning::Expected) => expected.push(cell.text.to_owned()),
                Some(Meaning::Nothing) | None => {}
            }
        }
        if n_cells != self.header.len() {
            let n_columns = self.header.len();
            self.diagnostics.push(
                Diagnostic::error(
                    codes::CELL_COUNT,
                    format!(
                        "wrong number of cells in this row: expected {n_columns}, found {n_cells}"
                    ),
                )
                .at(
                    span,
                    if n_cells < n_columns {
                        format!("{} missing", n_columns - n_cells)
                    } else {
                        format!("{} too many", n_cells - n_columns)
                    },
                )
                .help("write one cell for each column of the header"),
            );
            self.stimulus.values.resize(first_value + self.stimulus.columns.len(), 0);
        }
        self.has_rows = true;
        if !self.expected.is_empty() {
            self.expected.row(expected, is_reset);
        }
        if is_reset {
            self.check_reset(first_value, span);
            self.stimulus.values.truncate(first_value);
            return;
        }
        self.stimulus.dts.push(dt);
        if let [(_, first), (cell, second), ..] = events.as_slice()
            && self.net.settings.events_exclusive
        {
            let (first, second) = (&self.net.inputs[*first].name, &self.net.inputs[*second].name);
            let row = self.stimulus.len();
            self.diagnostics.push(
                Diagnostic::error(
                    codes::EXCLUSIVE_EVENTS,
                    format!("`{first}` and `{second}` occur in one row ({row}), but the chart declares `events exclusive`"),
                )
                .at(cell.span, "the second event")
                .help("split them into two rows; with `dt` 0 no time passes in between"),
            );
        }
        self.assumption(start, line);
    }

    /// Warns about inputs in row 0, which reads none.
    fn check_reset(&mut self, first_value: usize, span: Span) {
        let zero = InputRow::zero(self.net);
        let given = &self.stimulus.values[first_value..];
        let mut given = self.stimulus.columns.iter().zip(given);
        if let Some((input, _)) = given.find(|(input, value)| zero.value(**input) != **value) {
            let name = &self.net.inputs[*input].name;
            self.diagnostics.push(
                Diagnostic::warning(
                    codes::RESET_ROW,
                    format!(
                        "row 0 is the reset, which reads no inputs: `{name}` has no effect there"
                    ),
                )
                .at(span, "")
                .help("number the rows of a stimulus from 1, or remove the column `scan`"),
            );
        }
    }

    fn assumption(&mut self, start: usize, line: &str) {
        let last = self.stimulus.row(self.stimulus.len() - 1);
        let Some(place) = broken_assumption(self.net, &last) else { return };
        self.broken += 1;
        if self.broken == 1 {
            let property = &self.net.properties[place];
            let row = self.stimulus.len();
            self.diagnostics.push(
                Diagnostic::warning(codes::ASSUMPTION_BROKEN, format!("row {row} violates an assumption of the chart"))
                    .at(Span::new(self.file, start, start + line.trim_end().len()), "the chart assumes that this never happens")
                    .at(property.meta.span, "the assumption")
                    .help("change the row; from here on comparisons ignore all cells, because back ends may rely on the assumption"),
            );
        }
    }

    fn dt(&mut self, cell: Cell<'_>) -> u32 {
        match cell.text.parse::<u32>() {
            Ok(dt) if dt <= MAX_DT => dt,
            Ok(_) | Err(_) => {
                let why = if cell.text.starts_with('-') && cell.text[1..].parse::<u64>().is_ok() {
                    "it is negative"
                } else {
                    "it is not a whole number of ticks"
                };
                self.diagnostics.push(
                    Diagnostic::error(codes::BAD_DT, format!("invalid dt `{}`: {why}", cell.text))
                        .at(cell.span, "")
                        .help(format!("write a number of ticks from 0 to {MAX_DT}")),
                );
                0
            }
        }
    }

    fn value(&mut self, input: InputId, cell: Cell<'_>) -> i64 {
        let data: &Input = &self.net.inputs[input];
        let (lo, hi) = data.ty.bounds();
        match cell.text.parse::<i64>() {
            Ok(value) if (lo..=hi).contains(&value) => value,
            Ok(_) | Err(_) => {
                let expected = match (data.ty, data.kind) {
                    (Type::Bool, InputKind::Event) => {
                        "1 where the event occurs, 0 elsewhere".to_owned()
                    }
                    (Type::Bool, InputKind::Pin | InputKind::Extern | InputKind::InternalEvent) => {
                        "0 or 1".to_owned()
                    }
                    (Type::Int { .. }, _) => format!("a whole number from {lo} to {hi}"),
                };
                self.diagnostics.push(
                    Diagnostic::error(
                        codes::BAD_VALUE,
                        format!("invalid value for `{}`: `{}`", data.name, cell.text),
                    )
                    .at(cell.span, "")
                    .help(format!("write {expected}")),
                );
                data.ty.saturate(0)
            }
        }
    }

    fn finish(self) -> (Option<(Stimulus, Expected)>, Vec<Diagnostic>) {
        let has_error = self.diagnostics.iter().any(Diagnostic::is_error);
        ((!has_error).then_some((self.stimulus, self.expected)), self.diagnostics)
    }
}

/// The first names, and the number of further ones.
pub(crate) fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    let all: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    match all.len() {
        0..=LISTED => all.join(", "),
        n => format!("{} and {} more", all[..LISTED].join(", "), n - LISTED),
    }
}
