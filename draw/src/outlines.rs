//! The letters of PNG files as outlines, and their widths: `font/sans.ttf`, a part of Liberation Sans 2 with Latin, Greek, Cyrillic and signs.
//!
//! The file has the tables of TrueType (ISO/IEC 14496-22): `cmap` in format 4, `glyf` with `loca` of 16 bits, and `hmtx`. scripts/font writes it.

/// The units of the letter height.
pub(crate) const UNITS: i64 = 2048;

/// The number of straight lines that stand for a curve.
const PIECES: i64 = 6;

/// A closed line.
pub(crate) type Contour = Vec<(i64, i64)>;

/// A font; all tables are in the units of the letter height.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    cmap: &'static [u8],
    glyf: &'static [u8],
    loca: &'static [u8],
    hmtx: &'static [u8],
}

/// A point of an outline, and whether the outline goes through it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Point {
    x: i64,
    y: i64,
    is_on: bool,
}

impl Face {
    /// The font of the file.
    pub(crate) fn sans() -> Face {
        const FILE: &[u8] = include_bytes!("../font/sans.ttf");
        let table = |tag: &[u8; 4]| -> &'static [u8] {
            let entries = FILE.get(12..).unwrap_or_default().chunks_exact(16);
            let number = |entry: &[u8], at| usize::try_from(u32_at(entry, at)).unwrap_or(0);
            let found = entries.take(usize::from(u16_at(FILE, 4))).find(|it| it.starts_with(tag));
            let found = found.map(|entry| (number(entry, 8), number(entry, 12)));
            found.and_then(|(at, len)| FILE.get(at..at + len)).unwrap_or_default()
        };
        // The only table of characters follows the head of `cmap`.
        let cmap = table(b"cmap").get(12..).unwrap_or_default();
        Face { cmap, glyf: table(b"glyf"), loca: table(b"loca"), hmtx: table(b"hmtx") }
    }

    /// The number of the glyph of a character.
    pub(crate) fn glyph(self, c: char) -> Option<usize> {
        let code = u16::try_from(u32::from(c)).ok()?;
        let size = usize::from(u16_at(self.cmap, 6));
        let (ends, starts) = (14, 16 + size);
        let (deltas, offsets) = (starts + size, starts + 2 * size);
        let segment = (0..size).step_by(2).find(|at| code <= u16_at(self.cmap, ends + at))?;
        let start = u16_at(self.cmap, starts + segment);
        let (delta, offset) =
            (u16_at(self.cmap, deltas + segment), u16_at(self.cmap, offsets + segment));
        let place = code.checked_sub(start)?;
        let glyph = match offset {
            0 => code.wrapping_add(delta),
            _ => match u16_at(
                self.cmap,
                offsets + segment + usize::from(offset) + 2 * usize::from(place),
            ) {
                0 => 0,
                glyph => glyph.wrapping_add(delta),
            },
        };
        (glyph != 0).then_some(usize::from(glyph))
    }

    /// The width of a glyph with the space around it.
    pub(crate) fn advance(self, glyph: usize) -> i64 {
        i64::from(u16_at(self.hmtx, 4 * glyph))
    }

    /// The outlines of a glyph with straight lines, with the y axis leading up.
    pub(crate) fn contours(self, glyph: usize) -> Vec<Contour> {
        let mut contours = Vec::new();
        for (part, dx, dy) in self.parts(glyph) {
            for points in self.outlines(part) {
                contours.push(straightened(&points, (dx, dy)));
            }
        }
        contours
    }

    fn description(self, glyph: usize) -> &'static [u8] {
        let at = |index| 2 * usize::from(u16_at(self.loca, 2 * index));
        self.glyf.get(at(glyph)..at(glyph + 1)).unwrap_or_default()
    }

    /// The glyphs that a glyph consists of, each with its place: a letter and its accent, or the glyph alone.
    fn parts(self, glyph: usize) -> Vec<(usize, i64, i64)> {
        const ARE_WORDS: u16 = 1;
        const HAS_MORE: u16 = 0x20;
        let data = self.description(glyph);
        if i16_at(data, 0) >= 0 {
            return vec![(glyph, 0, 0)];
        }
        let mut parts = Vec::new();
        let mut at = 10;
        loop {
            let (flags, part) = (u16_at(data, at), usize::from(u16_at(data, at + 2)));
            let byte = |at| data.get(at).map_or(0, |byte: &u8| i64::from(byte.cast_signed()));
            let (dx, dy, size) = if flags & ARE_WORDS == 0 {
                (byte(at + 4), byte(at + 5), 6)
            } else {
                (i16_at(data, at + 4), i16_at(data, at + 6), 8)
            };
            parts.push((part, dx, dy));
            at += size;
            if flags & HAS_MORE == 0 || at >= data.len() {
                return parts;
            }
        }
    }

    /// The outlines of a glyph without parts.
    fn outlines(self, glyph: usize) -> Vec<Vec<Point>> {
        let data = self.description(glyph);
        let n_contours = usize::try_from(i16_at(data, 0)).unwrap_or(0);
        let ends: Vec<usize> =
            (0..n_contours).map(|index| usize::from(u16_at(data, 10 + 2 * index)) + 1).collect();
        let n_points = ends.last().copied().unwrap_or(0);
        let after_ends = 10 + 2 * n_contours;
        let mut at = after_ends + 2 + usize::from(u16_at(data, after_ends));
        let mut next = || {
            at += 1;
            data.get(at - 1).copied().unwrap_or(0)
        };
        let mut flags = Vec::with_capacity(n_points);
        while flags.len() < n_points {
            let flag = next();
            let n = if flag & REPEATS == 0 { 1 } else { usize::from(next()) + 1 };
            flags.extend(std::iter::repeat_n(flag, n));
        }
        let xs = coordinates(&flags, IS_SHORT_X, IS_SAME_X, &mut next);
        let ys = coordinates(&flags, IS_SHORT_Y, IS_SAME_Y, &mut next);
        let points: Vec<Point> = (flags.iter().zip(xs).zip(ys))
            .map(|((flag, x), y)| Point { x, y, is_on: flag & IS_ON != 0 })
            .collect();
        let starts = [0].into_iter().chain(ends.iter().copied());
        let ranges = starts.zip(&ends);
        ranges.map(|(start, end)| points.get(start..*end).unwrap_or_default().to_vec()).collect()
    }
}

const IS_ON: u8 = 1;
const IS_SHORT_X: u8 = 2;
const IS_SHORT_Y: u8 = 4;
const REPEATS: u8 = 8;
const IS_SAME_X: u8 = 16;
const IS_SAME_Y: u8 = 32;

/// The coordinates of all points. `same` is the sign of a short difference, or says that a point has the coordinate of the last one.
fn coordinates(flags: &[u8], short: u8, same: u8, next: &mut impl FnMut() -> u8) -> Vec<i64> {
    let mut at = 0;
    let all = flags.iter().map(|flag| {
        at += match (flag & short != 0, flag & same != 0) {
            (true, true) => i64::from(next()),
            (true, false) => -i64::from(next()),
            (false, true) => 0,
            (false, false) => i64::from(i16::from_be_bytes([next(), next()])),
        };
        at
    });
    all.collect()
}

/// An outline with straight lines instead of curves, moved by a distance. Between two points that it does not go through, it goes through the middle.
fn straightened(points: &[Point], (dx, dy): (i64, i64)) -> Contour {
    let middle = |a: Point, b: Point| Point { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, is_on: true };
    let mut all: Vec<Point> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let before = points[(index + points.len() - 1) % points.len()];
        if !point.is_on && !before.is_on {
            all.push(middle(before, *point));
        }
        all.push(*point);
    }
    if let Some(first) = all.iter().position(|point| point.is_on) {
        all.rotate_left(first);
    }
    let mut contour = Vec::new();
    for (index, point) in all.iter().enumerate() {
        let (before, after) = (all[index.saturating_sub(1)], all[(index + 1) % all.len()]);
        if point.is_on {
            contour.push((point.x + dx, point.y + dy));
            continue;
        }
        for t in 1..PIECES {
            let (a, b, c) = ((PIECES - t) * (PIECES - t), 2 * t * (PIECES - t), t * t);
            let at = |from, by, to| (a * from + b * by + c * to) / (PIECES * PIECES);
            contour
                .push((at(before.x, point.x, after.x) + dx, at(before.y, point.y, after.y) + dy));
        }
    }
    contour
}

fn u16_at(data: &[u8], at: usize) -> u16 {
    data.get(at..at + 2).map_or(0, |bytes| u16::from(bytes[0]) << 8 | u16::from(bytes[1]))
}

fn i16_at(data: &[u8], at: usize) -> i64 {
    i64::from(u16_at(data, at).cast_signed())
}

fn u32_at(data: &[u8], at: usize) -> u32 {
    u32::from(u16_at(data, at)) << 16 | u32::from(u16_at(data, at + 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_outlines_and_widths() {
        let face = Face::sans();
        let area = |contour: &Contour| -> i64 {
            let next = contour.iter().cycle().skip(1);
            contour.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<i64>() / 2
        };
        let glyph = |c| face.glyph(c).expect("it is there");
        // A full stop is a square.
        let [stop] = face.contours(glyph('.')).try_into().expect("one outline");
        assert_eq!((stop.len(), face.advance(glyph('.'))), (4, 569));
        // The hole of an o is drawn the other way round.
        let areas: Vec<i64> = face.contours(glyph('o')).iter().map(area).collect();
        assert!(areas.len() == 2 && areas[0] * areas[1] < 0, "{areas:?}");
        // A letter with an accent contains the letter.
        let (plain, accented) = (face.contours(glyph('a')), face.contours(glyph('ä')));
        assert_eq!((plain.len(), accented.len()), (2, 4));
        assert_eq!(accented[..2], plain);
        for c in "AzÄßŁαΩЖя≤·↑…¬".chars() {
            assert!(!face.contours(glyph(c)).is_empty(), "{c}");
        }
        assert_eq!((face.glyph('日'), face.glyph('🚀')), (None, None));
    }

    /// The whole file has only what is read here: widths for all glyphs, and glyphs of parts that are moved, but not scaled, and have no parts themselves.
    #[test]
    fn all_glyphs_of_the_file_are_understood() {
        const ARE_DISTANCES: u16 = 2;
        const ARE_SCALED: u16 = 8 | 0x40 | 0x80;
        let face = Face::sans();
        let n_glyphs = face.loca.len() / 2 - 1;
        assert!(n_glyphs > 500 && face.hmtx.len() == 4 * n_glyphs, "{n_glyphs}");
        for glyph in 0..n_glyphs {
            let data = face.description(glyph);
            let parts = face.parts(glyph);
            if !data.is_empty() && i16_at(data, 0) < 0 {
                let mut at = 10;
                for (part, ..) in &parts {
                    let flags = u16_at(data, at);
                    assert!(flags & ARE_DISTANCES != 0 && flags & ARE_SCALED == 0, "{glyph}");
                    assert!(i16_at(face.description(*part), 0) >= 0, "{glyph}");
                    at += if flags & 1 == 0 { 6 } else { 8 };
                }
            }
            // Everything is in the box that the glyph says it has.
            let points: Vec<(i64, i64)> = face.contours(glyph).concat();
            let bounds = [2, 4, 6, 8].map(|at| i16_at(data, at));
            let of = |key: fn(&(i64, i64)) -> i64| {
                let all = || points.iter().map(key);
                (all().min().unwrap_or(0), all().max().unwrap_or(0))
            };
            let ((left, right), (low, high)) = (of(|it| it.0), of(|it| it.1));
            for (is, must) in [left, low, right, high].into_iter().zip(bounds) {
                assert!((is - must).abs() <= 1, "{glyph}: {is} instead of {must}");
            }
        }
    }
}
