//! Fills areas on a canvas of pixels.
//!
//! Lengths are in 1/256 of a pixel, and everything is computed with whole numbers, so the same shapes give the same bytes on every machine. The part of a pixel
//! that an area covers is exact for areas with vertical and horizontal sides. For others, it is the mean of 16 rows in each pixel.

use crate::ink::Colour;
use std::ops::Range;

/// The parts of a pixel.
pub(crate) const ONE: i64 = 256;
/// The rows in a pixel at which an area is measured.
const ROWS: i64 = 16;

/// A point in 1/256 of a pixel.
pub(crate) type Point = (i64, i64);

/// A white canvas with its left side at 0: some rows of a picture.
#[derive(Debug, Clone)]
pub(crate) struct Canvas {
    width: usize,
    /// The rows of the picture that are on the canvas.
    range: Range<i64>,
    /// Red, green and blue of each pixel, row by row.
    pixels: Vec<u8>,
}

/// A side of an area, from its upper to its lower end.
#[derive(Debug, Clone, Copy)]
struct Side {
    from: Point,
    to: Point,
    /// 1 if the outline goes down here, -1 if it goes up.
    way: i64,
}

impl Side {
    /// The place of the side at a height.
    fn x(&self, y: i64) -> i64 {
        let (dx, dy) = (self.to.0 - self.from.0, self.to.1 - self.from.1);
        self.from.0 + dx * (y - self.from.1) / dy.max(1)
    }
}

impl Canvas {
    pub(crate) fn new(width: usize, range: Range<i64>) -> Self {
        let n_rows = usize::try_from(range.end - range.start).unwrap_or(0);
        Canvas { width, range, pixels: vec![255; width * n_rows * 3] }
    }

    /// The rows of pixels, three bytes for each.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[u8]> {
        self.pixels.chunks_exact((self.width * 3).max(1))
    }

    /// Fills a rectangle between its upper left and its lower right corner.
    pub(crate) fn fill_rect(&mut self, from: Point, to: Point, colour: Colour) {
        let share = |low: i64, high: i64, pixel: i64| {
            (high.min((pixel + 1) * ONE) - low.max(pixel * ONE)).max(0)
        };
        let right = i64::try_from(self.width).unwrap_or(i64::MAX) - 1;
        let columns = from.0.div_euclid(ONE).max(0)..=(to.0 - 1).div_euclid(ONE).min(right);
        for row in self.rows_between(from.1, to.1 - 1) {
            let high = share(from.1, to.1, row);
            for column in columns.clone() {
                self.blend(row, column, share(from.0, to.0, column) * high / ONE, colour);
            }
        }
    }

    /// Fills the area inside of closed outlines. An outline in the opposite direction inside of another one is the border of a hole.
    pub(crate) fn fill(&mut self, outlines: &[Vec<Point>], colour: Colour) {
        let mut sides = Vec::new();
        for outline in outlines {
            for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                if a.1 != b.1 {
                    let (from, to, way) = if a.1 < b.1 { (*a, *b, 1) } else { (*b, *a, -1) };
                    sides.push(Side { from, to, way });
                }
            }
        }
        let top = sides.iter().map(|side| side.from.1).min().unwrap_or(0);
        let bottom = sides.iter().map(|side| side.to.1).max().unwrap_or(0);
        let all = || sides.iter().flat_map(|side| [side.from.0, side.to.0]);
        let left = all().min().unwrap_or(0).div_euclid(ONE);
        let right = all().max().unwrap_or(0).div_euclid(ONE);
        let mut covered = vec![0; usize::try_from(right - left + 1).unwrap_or(0)];
        for row in self.rows_between(top, bottom) {
            let is_here = |side: &&Side| side.from.1 < (row + 1) * ONE && row * ONE < side.to.1;
            let here: Vec<Side> = sides.iter().filter(is_here).copied().collect();
            covered.fill(0);
            for index in 0..ROWS {
                let y = row * ONE + (2 * index + 1) * ONE / (2 * ROWS);
                for (from, to) in spans(&here, y) {
                    cover(&mut covered, from - left * ONE, to - left * ONE);
                }
            }
            for (column, sum) in (left..).zip(&covered) {
                self.blend(row, column, sum / ROWS, colour);
            }
        }
    }

    /// The rows on the canvas between two heights.
    fn rows_between(&self, top: i64, bottom: i64) -> Range<i64> {
        let (first, last) = (top.div_euclid(ONE), bottom.div_euclid(ONE));
        first.max(self.range.start)..(last + 1).min(self.range.end)
    }

    /// Mixes a colour into a pixel of a row on the canvas; `share` is between 0 and `ONE`.
    fn blend(&mut self, row: i64, column: i64, share: i64, colour: Colour) {
        let row = usize::try_from(row - self.range.start);
        let (Ok(row), Ok(column)) = (row, usize::try_from(column)) else { return };
        if share == 0 || column >= self.width {
            return;
        }
        let at = (row * self.width + column) * 3;
        let Some(pixel) = self.pixels.get_mut(at..at + 3) else { return };
        for (part, new) in pixel.iter_mut().zip(colour) {
            let (old, to) = (i64::from(*part), i64::from(new));
            let mixed = old + (to - old) * share / ONE;
            *part = u8::try_from(mixed).unwrap_or(new);
        }
    }
}

/// The parts of a row that are inside.
fn spans(sides: &[Side], y: i64) -> Vec<(i64, i64)> {
    let here = sides.iter().filter(|side| side.from.1 <= y && y < side.to.1);
    let mut crossings: Vec<(i64, i64)> = here.map(|side| (side.x(y), side.way)).collect();
    crossings.sort_unstable();
    let mut spans = Vec::new();
    let (mut winding, mut start) = (0, 0);
    for (x, way) in crossings {
        if winding == 0 {
            start = x;
        }
        winding += way;
        if winding == 0 {
            spans.push((start, x));
        }
    }
    spans
}

/// Adds a part of a row to what is covered of each pixel.
fn cover(covered: &mut [i64], from: i64, to: i64) {
    let first = usize::try_from(from / ONE).unwrap_or(0);
    for (pixel, sum) in (from / ONE..).zip(covered.iter_mut().skip(first)) {
        if pixel * ONE >= to {
            break;
        }
        *sum += to.min((pixel + 1) * ONE) - from.max(pixel * ONE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of black in each pixel, in 1/256.
    fn shares(canvas: &Canvas) -> Vec<Vec<u8>> {
        canvas.rows().map(|row| row.chunks_exact(3).map(|pixel| 255 - pixel[0]).collect()).collect()
    }

    #[test]
    fn areas_cover_parts_of_pixels() {
        let mut canvas = Canvas::new(3, 0..2);
        canvas.fill_rect((128, 0), (2 * ONE, ONE + 64), [0; 3]);
        assert_eq!(shares(&canvas), [[127, 255, 0], [31, 63, 0]]);
        let mut canvas = Canvas::new(3, 0..2);
        let outline = vec![(128, 0), (2 * ONE, 0), (2 * ONE, ONE + 64), (128, ONE + 64)];
        canvas.fill(&[outline], [0; 3]);
        assert_eq!(shares(&canvas), [[127, 255, 0], [31, 63, 0]]);
    }

    #[test]
    fn an_outline_in_the_opposite_direction_is_a_hole() {
        let square = |low: i64, high: i64| {
            [(low, low), (high, low), (high, high), (low, high)]
                .map(|(x, y)| (x * ONE, y * ONE))
                .to_vec()
        };
        let mut hole = square(1, 2);
        hole.reverse();
        let mut canvas = Canvas::new(3, 0..3);
        canvas.fill(&[square(0, 3), hole], [0; 3]);
        assert_eq!(shares(&canvas), [[255; 3], [255, 0, 255], [255; 3]]);
        // The same direction twice is not.
        let mut canvas = Canvas::new(3, 0..3);
        canvas.fill(&[square(0, 3), square(1, 2)], [0; 3]);
        assert_eq!(shares(&canvas), [[255; 3]; 3]);
    }

    #[test]
    fn what_is_outside_is_left_out() {
        let mut canvas = Canvas::new(2, 0..1);
        canvas.fill_rect((-ONE, -ONE), (ONE, 5 * ONE), [0; 3]);
        canvas.fill(&[vec![(-9 * ONE, -ONE), (9 * ONE, -ONE), (0, 0)]], [0; 3]);
        assert_eq!(shares(&canvas), [[255, 0]]);
    }

    #[test]
    fn a_canvas_can_have_the_lower_rows_only() {
        let draw = |canvas: &mut Canvas| {
            canvas.fill_rect((128, 128), (2 * ONE, 3 * ONE), [0; 3]);
            canvas.fill(&[vec![(0, 0), (4 * ONE, 2 * ONE), (0, 5 * ONE)]], [99; 3]);
        };
        let (mut all, mut lower) = (Canvas::new(4, 0..5), Canvas::new(4, 2..5));
        draw(&mut all);
        draw(&mut lower);
        assert_eq!(shares(&all)[2..], shares(&lower));
    }
}
