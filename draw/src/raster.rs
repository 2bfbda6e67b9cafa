//! Fills areas on a canvas of pixels.
//!
//! Lengths are in 1/256 of a pixel, and everything is computed with whole numbers, so the same shapes give the same bytes on every machine. The part of a pixel
//! that an area covers is exact for areas with vertical and horizontal sides. For others, it is the mean of 16 rows in each pixel.

use crate::ink::Colour;

/// The parts of a pixel.
pub(crate) const ONE: i64 = 256;
/// The rows in a pixel at which an area is measured.
const ROWS: i64 = 16;

/// A point in 1/256 of a pixel.
pub(crate) type Point = (i64, i64);

/// A white canvas with its upper left corner at (0, 0).
#[derive(Debug, Clone)]
pub(crate) struct Canvas {
    width: usize,
    height: usize,
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
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Canvas { width, height, pixels: vec![255; width * height * 3] }
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
        let columns = from.0.div_euclid(ONE)..=(to.0 - 1).div_euclid(ONE);
        for row in from.1.div_euclid(ONE)..=(to.1 - 1).div_euclid(ONE) {
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
        let top = sides.iter().map(|side| side.from.1).min().unwrap_or(0).div_euclid(ONE).max(0);
        let bottom = sides.iter().map(|side| side.to.1).max().unwrap_or(0).div_euclid(ONE);
        let all = || sides.iter().flat_map(|side| [side.from.0, side.to.0]);
        let left = all().min().unwrap_or(0).div_euclid(ONE);
        let right = all().max().unwrap_or(0).div_euclid(ONE);
        let mut covered = vec![0; usize::try_from(right - left + 1).unwrap_or(0)];
        for row in top..=bottom.min(i64::try_from(self.height).unwrap_or(i64::MAX) - 1) {
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

    /// Mixes a colour into a pixel; `share` is between 0 and `ONE`.
    fn blend(&mut self, row: i64, column: i64, share: i64, colour: Colour) {
        let (Ok(row), Ok(column)) = (usize::try_from(row), usize::try_from(column)) else { return };
        if share == 0 || column >= self.width || row >= self.height {
            return;
        }
        let at = (row * self.width + column) * 3;
        for (pixel, part) in self.pixels.iter_mut().skip(at).zip(colour) {
            let (old, new) = (i64::from(*pixel), i64::from(part));
            let mixed = old + (new - old) * share / ONE;
            *pixel = u8::try_from(mixed).unwrap_or(part);
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
        let mut canvas = Canvas::new(3, 2);
        canvas.fill_rect((128, 0), (2 * ONE, ONE + 64), [0; 3]);
        assert_eq!(shares(&canvas), [[127, 255, 0], [31, 63, 0]]);
        let mut canvas = Canvas::new(3, 2);
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
        let mut canvas = Canvas::new(3, 3);
        canvas.fill(&[square(0, 3), hole], [0; 3]);
        assert_eq!(shares(&canvas), [[255; 3], [255, 0, 255], [255; 3]]);
        // The same direction twice is not.
        let mut canvas = Canvas::new(3, 3);
        canvas.fill(&[square(0, 3), square(1, 2)], [0; 3]);
        assert_eq!(shares(&canvas), [[255; 3]; 3]);
    }

    #[test]
    fn what_is_outside_is_left_out() {
        let mut canvas = Canvas::new(2, 1);
        canvas.fill_rect((-ONE, -ONE), (ONE, 5 * ONE), [0; 3]);
        canvas.fill(&[vec![(-9 * ONE, -ONE), (9 * ONE, -ONE), (0, 0)]], [0; 3]);
        assert_eq!(shares(&canvas), [[255, 0]]);
    }
}
