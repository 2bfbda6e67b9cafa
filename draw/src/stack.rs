//! Action blocks of IEC 61131-3 below each other: a box with a row for each, and columns for qualifier, action and indicator.

use crate::picture::{Font, Pen, Picture};
use crate::text::{Rich, width};

/// The height of a line of text.
const LINE: i64 = 15;
/// The distance of texts from the lines around them.
const MARGIN: i64 = 8;
/// The width from which texts of actions are broken at spaces.
const LONGEST_LINE: i64 = 260;

/// The texts of one action block.
pub(crate) struct Row<'a> {
    /// The qualifier with its time.
    pub(crate) qualifier: &'a str,
    /// The action.
    pub(crate) text: &'a Rich,
    /// The indicator variable; empty if there is none.
    pub(crate) indicator: &'a str,
}

/// The box with its upper left corner at (0, 0), and the height of the middle of its first row.
pub(crate) fn draw(rows: &[Row<'_>]) -> (Picture, i64) {
    let size = Font::Normal.size();
    let texts: Vec<Vec<Rich>> = rows.iter().map(|row| row.text.lines(size, LONGEST_LINE)).collect();
    let widest = |all: &mut dyn Iterator<Item = i64>| all.max().unwrap_or(0);
    let left = widest(&mut rows.iter().map(|row| width(row.qualifier, size))) + 2 * MARGIN;
    let middle = widest(&mut texts.iter().flatten().map(|line| line.width(size))) + 2 * MARGIN;
    let right = widest(&mut rows.iter().map(|row| width(row.indicator, size)));
    let right = if right > 0 { right + 2 * MARGIN } else { 0 };
    let wide = left + middle + right;
    let mut picture = Picture::default();
    let mut y = 0;
    let mut level = 0;
    for (index, (row, lines)) in rows.iter().zip(&texts).enumerate() {
        let high = i64::try_from(lines.len()).unwrap_or(1) * LINE + 9;
        if index == 0 {
            level = high / 2;
        } else {
            picture.line((0, y), (wide, y), Pen::Detail);
        }
        picture.text((MARGIN, y + 16), row.qualifier, Font::Normal);
        picture.line((left, y), (left, y + high), Pen::Detail);
        for (number, line) in (0..).zip(lines) {
            picture.rich((left + MARGIN, y + 16 + number * LINE), line, Font::Normal);
        }
        if !row.indicator.is_empty() {
            let x = left + middle;
            picture.line((x, y), (x, y + high), Pen::Detail);
            picture.text((x + MARGIN, y + 16), row.indicator, Font::Normal);
        }
        y += high;
    }
    picture.rect((0, 0), (wide, y), Pen::Line);
    (picture.width, picture.height) = (wide, y);
    (picture, level)
}
