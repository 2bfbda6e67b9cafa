//! A table with a bar for each number, for designs that are compared in several columns, such as the best splits of a chart.

use crate::picture::{Font, Pen, Picture};

/// The height of a row.
const ROW: i64 = 24;
/// The margin around the drawing, and between columns.
const MARGIN: i64 = 16;
/// The longest bar.
const BAR: i64 = 150;
/// The distance of a text from the left end of its bar.
const INDENT: i64 = 6;

/// The table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BarTable {
    /// The heading.
    pub title: String,
    /// The titles of the columns with bars.
    pub columns: Vec<String>,
    /// The rows, in order.
    pub rows: Vec<BarRow>,
    /// Sentences below the table, one on each line.
    pub notes: Vec<String>,
}

/// One design.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BarRow {
    /// Its name.
    pub name: String,
    /// A number and its text for each column. A number that is not known has no bar.
    pub cells: Vec<(Option<u64>, String)>,
}

/// Draws the table. The longest bar of a column belongs to its largest number.
#[must_use]
pub fn bars(table: &BarTable) -> Picture {
    let mut picture = Picture { title: table.title.clone(), ..Picture::default() };
    let mut right = picture.text((MARGIN, MARGIN + 14), &table.title, Font::Heading);
    let top = MARGIN + 14 + ROW;
    // The widths of the columns are those of their texts.
    let width = |picture: &mut Picture, x: i64, texts: &mut dyn Iterator<Item = (i64, &str)>| {
        texts.map(|(y, text)| picture.text((x, y), text, Font::Normal)).max().unwrap_or(0)
    };
    let baseline = |row: usize| top + ROW * (row as i64 + 1);
    let mut names =
        table.rows.iter().enumerate().map(|(at, row)| (baseline(at), row.name.as_str()));
    let mut x = MARGIN + width(&mut picture, MARGIN, &mut names) + MARGIN;
    for (column, title) in table.columns.iter().enumerate() {
        let cells = || table.rows.iter().map(move |row| row.cells.get(column));
        let most = cells().flatten().filter_map(|(number, _)| *number).max().unwrap_or(0).max(1);
        for (at, cell) in cells().enumerate() {
            let Some((Some(number), _)) = cell else { continue };
            // A number other than 0 has a visible bar.
            let length = (i128::from(*number) * i128::from(BAR) / i128::from(most)) as i64;
            let length = if *number > 0 { length.max(2) } else { 0 };
            if length > 0 {
                picture.rect((x, baseline(at) - 15), (length, ROW - 5), Pen::Shade);
            }
        }
        let texts =
            cells().enumerate().filter_map(|(at, cell)| Some((baseline(at), cell?.1.as_str())));
        let own = width(&mut picture, x + INDENT, &mut texts.chain([(top, title.as_str())]));
        x += BAR.max(own + INDENT) + MARGIN;
    }
    right = right.max(x - MARGIN);
    let mut y = baseline(table.rows.len()) - ROW + 8;
    for row in 0..=table.rows.len() {
        let y = baseline(row) - ROW + 6;
        picture.line((MARGIN, y), (right, y), Pen::Grid);
    }
    for note in &table.notes {
        y += ROW - 6;
        right = right.max(MARGIN + picture.text((MARGIN, y), note, Font::Small));
    }
    (picture.width, picture.height) = (right + MARGIN, y + MARGIN);
    picture
}

#[cfg(test)]
mod tests {
    use super::{BAR, BarRow, BarTable, bars};
    use crate::picture::{Pen, Shape};

    #[test]
    fn bars_are_as_long_as_their_numbers() {
        let cell = |number: Option<u64>| (number, number.map_or("-".to_owned(), |n| n.to_string()));
        let row = |name: &str, numbers: [Option<u64>; 2]| BarRow {
            name: name.to_owned(),
            cells: numbers.map(cell).to_vec(),
        };
        let table = BarTable {
            title: "splits".to_owned(),
            columns: vec!["cells".to_owned(), "pins".to_owned()],
            rows: vec![
                row("a", [Some(10), Some(0)]),
                row("b", [Some(5), None]),
                row("c", [Some(u64::MAX / 2), Some(1)]),
            ],
            notes: vec!["a note".to_owned()],
        };
        let picture = bars(&table);
        let lengths: Vec<i64> = picture
            .marks
            .iter()
            .filter_map(|mark| match mark.shape {
                Shape::Rect { width, pen: Pen::Shade, .. } => Some(width),
                _ => None,
            })
            .collect();
        assert_eq!(lengths, [2, 2, BAR, BAR]);
        for mark in &picture.marks {
            let (left, top, right, bottom) = mark.bounds();
            assert!(left >= 0 && top >= 0 && right <= picture.width && bottom <= picture.height);
        }
    }
}
