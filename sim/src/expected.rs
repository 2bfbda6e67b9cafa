//! Expected values in a stimulus: further columns of a trace, next to the inputs (semantics §11). A trace is therefore also a stimulus, and replaying
//! it shows where a changed chart behaves differently.

use grafsynth_ir::Span;

use crate::trace::{Difference, Trace, TraceRow};

/// The cells that a trace should contain.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Expected {
    /// The headers, and their source locations.
    columns: Vec<(String, Span)>,
    /// True if the first row is that of the reset; false if it is that of the first reaction.
    from_reset: bool,
    /// The cells of each row, as written.
    rows: Vec<Vec<String>>,
}

impl Expected {
    /// True if nothing is expected.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The number of expected cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// The number of expected cells that the trace leaves open; these cells are not checked.
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

    /// The index of each column in a trace.
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

    /// The first difference between the expected cells (left) and the cells of a trace (right). Cells that the chart leaves open never differ.
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

/// True if the cells are equal; blanks between the names of steps are ignored.
fn is_same(left: &str, right: &str) -> bool {
    left.split_whitespace().eq(right.split_whitespace())
}
