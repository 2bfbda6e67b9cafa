//! What a stimulus expects: columns of a trace that stand in it beside the inputs (semantics §11). So a trace is a stimulus, and replaying it shows
//! where a changed chart does something else.

use grafsynth_ir::Span;

use crate::trace::{ColumnKind, Difference, Trace, TraceRow};

/// Cells that a trace should have.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Expected {
    /// The headers, and where they stand in the file.
    columns: Vec<(String, Span)>,
    /// The first row is that of the reset; else it is that of the first reaction.
    from_reset: bool,
    /// The cells of each row that was read, as they are written.
    rows: Vec<Vec<String>>,
}

impl Expected {
    /// True if nothing is expected.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The number of cells that are expected.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// How many of them stand where the trace leaves the cell open: nothing is asked of these.
    #[must_use]
    pub fn open_cells(&self, trace: &Trace) -> usize {
        let places = self.places(trace);
        let first = usize::from(!self.from_reset);
        let rows = trace.rows.iter().skip(first).take(self.rows.len());
        let is_open = |row: &TraceRow, place: Option<usize>| {
            place.is_some_and(|place| row.open.get(place).copied().unwrap_or(false))
        };
        rows.map(|row| places.iter().filter(|place| is_open(row, **place)).count()).sum()
    }

    /// Where each column stands in a trace.
    fn places(&self, trace: &Trace) -> Vec<Option<usize>> {
        let place =
            |name: &String| trace.layout.columns.iter().position(|column| column.name == *name);
        self.columns.iter().map(|(name, _)| place(name)).collect()
    }

    pub(crate) fn column(&mut self, name: &str, span: Span) {
        self.columns.push((name.to_owned(), span));
    }

    pub(crate) fn row(&mut self, cells: Vec<String>, is_reset: bool) {
        self.from_reset |= is_reset;
        self.rows.push(cells);
    }

    /// The first cell of a trace that is not as expected: the expected one is the left one. Cells that the chart leaves open are as expected.
    #[must_use]
    pub fn first_difference(&self, trace: &Trace) -> Option<Difference> {
        let places = self.places(trace);
        let first = usize::from(!self.from_reset);
        for (at, expected) in self.rows.iter().enumerate() {
            let row = at + first;
            let Some(got) = trace.rows.get(row) else { continue };
            for ((left, (name, _)), place) in expected.iter().zip(&self.columns).zip(&places) {
                let Some(place) = *place else { continue };
                if got.open.get(place).copied().unwrap_or(false) {
                    continue;
                }
                let right = trace.layout.text(&got.values[place]);
                if !is_same(left, &right) {
                    let (column, left) = (name.clone(), left.clone());
                    return Some(Difference { row, column, left, right });
                }
            }
        }
        None
    }
}

/// The same cell; blanks between the names of steps do not count.
fn is_same(left: &str, right: &str) -> bool {
    left.split_whitespace().eq(right.split_whitespace())
}

/// True for the columns of a trace that can be expected: all that the stimulus does not give.
pub(crate) fn can_be_expected(kind: ColumnKind) -> bool {
    match kind {
        ColumnKind::Scan | ColumnKind::Dt | ColumnKind::Input(_) => false,
        ColumnKind::Steps
        | ColumnKind::Output(_)
        | ColumnKind::Calls(_)
        | ColumnKind::Var(_)
        | ColumnKind::Element(..)
        | ColumnKind::Fault => true,
    }
}
