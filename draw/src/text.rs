//! Texts with overlines, and their widths.
//!
//! The widths are the advance widths of Liberation Sans 2, which has the metrics of Arial and Helvetica, in thousandths of the letter height. Characters
//! that the font of PNG files lacks get a generous width. Each text of the SVG states its width (`textLength`), so that viewers scale another font to it.

use crate::outlines::{Face, UNITS};

/// The widths of the characters from U+0020 to U+007E.
const ASCII: [u16; 95] = [
    278, 278, 355, 557, 557, 890, 667, 191, 334, 334, 390, 584, 278, 334, 278, 278, 557, 557, 557,
    557, 557, 557, 557, 557, 557, 557, 278, 278, 584, 584, 584, 557, 1016, 667, 667, 723, 723, 667,
    611, 778, 723, 278, 500, 667, 557, 834, 723, 778, 667, 778, 723, 667, 611, 723, 667, 944, 667,
    667, 611, 278, 278, 278, 470, 557, 334, 557, 557, 500, 557, 557, 278, 557, 557, 223, 223, 500,
    223, 834, 557, 557, 557, 557, 334, 500, 278, 557, 500, 723, 500, 500, 500, 334, 260, 334, 584,
];

/// The width of a text in pixels, for letters of `size` pixels, rounded up.
#[must_use]
pub(crate) fn width(text: &str, size: i64) -> i64 {
    let thousandths: i64 = text.chars().map(width_thousandths).sum();
    (thousandths * size + 999) / 1000
}

/// The width of a character in thousandths of the letter height.
pub(crate) fn width_thousandths(c: char) -> i64 {
    let ascii = usize::try_from(u32::from(c).wrapping_sub(0x20)).unwrap_or(usize::MAX);
    if let Some(width) = ASCII.get(ascii) {
        return i64::from(*width);
    }
    let face = Face::sans();
    match face.glyph(c) {
        Some(glyph) => (face.advance(glyph) * 1000 + UNITS - 1) / UNITS,
        // Letters of other alphabets; the widest are rare.
        None if c < '\u{2000}' => 800,
        // Wide scripts and pictures.
        None => 1200,
    }
}

/// A text of at most `most` pixels; a longer one is cut, and ends with `…`.
pub(crate) fn cut(text: &str, size: i64, most: i64) -> String {
    if width(text, size) <= most {
        return text.to_owned();
    }
    let mut out = String::new();
    for c in text.chars() {
        out.push(c);
        if width(&out, size) + 12 > most {
            out.pop();
            break;
        }
    }
    out.push('…');
    out
}

/// A line over a part of a text: the complement of this part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Bar {
    /// The first byte below the line.
    pub(crate) start: usize,
    /// The byte after the last.
    pub(crate) end: usize,
    /// The number of lines between this one and the text.
    pub(crate) level: i64,
}

/// A text with overlines.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Rich {
    pub(crate) text: String,
    pub(crate) bars: Vec<Bar>,
}

impl Rich {
    pub(crate) fn plain(text: impl Into<String>) -> Self {
        Rich { text: text.into(), bars: Vec::new() }
    }

    pub(crate) fn push(&mut self, text: &str) {
        self.text.push_str(text);
    }

    /// Appends another text.
    pub(crate) fn append(&mut self, other: &Rich) {
        let at = self.text.len();
        self.text.push_str(&other.text);
        let moved = other.bars.iter();
        self.bars.extend(moved.map(|bar| Bar {
            start: bar.start + at,
            end: bar.end + at,
            level: bar.level,
        }));
    }

    /// Draws a line over the text from byte `start` on.
    pub(crate) fn overline(&mut self, start: usize) {
        let inner = self.bars.iter().filter(|bar| bar.start >= start).map(|bar| bar.level + 1);
        let level = inner.max().unwrap_or(0);
        self.bars.push(Bar { start, end: self.text.len(), level });
    }

    /// The number of overlines above each other.
    pub(crate) fn levels(&self) -> i64 {
        self.bars.iter().map(|bar| bar.level + 1).max().unwrap_or(0)
    }

    /// The parts between the ends of overlines, with their first bytes.
    pub(crate) fn runs(&self) -> Vec<(usize, &str)> {
        let mut cuts: Vec<usize> = self.bars.iter().flat_map(|bar| [bar.start, bar.end]).collect();
        cuts.extend([0, self.text.len()]);
        cuts.sort_unstable();
        cuts.dedup();
        let pairs = cuts.windows(2).filter_map(|pair| {
            let (start, end) = (*pair.first()?, *pair.last()?);
            Some((start, self.text.get(start..end)?))
        });
        pairs.collect()
    }

    /// The width in pixels: each part between the ends of overlines is rounded up.
    pub(crate) fn width(&self, size: i64) -> i64 {
        self.runs().iter().map(|(_, run)| width(run, size)).sum()
    }

    /// The text in lines of about `most` pixels, broken at spaces that are not below an overline. A list of statements that is wider than this has each of
    /// them on a line of its own.
    pub(crate) fn lines(&self, size: i64, most: i64) -> Vec<Rich> {
        let is_list = self.text.contains("; ") && self.width(size) > most;
        let mut lines = Vec::new();
        let mut start = 0;
        let mut last_blank = None;
        let mut so_far = 0;
        let mut since_blank = 0;
        for (at, c) in self.text.char_indices() {
            let wide = width(&self.text[at..at + c.len_utf8()], size);
            so_far += wide;
            since_blank += wide;
            if c == ' ' && !self.bars.iter().any(|bar| bar.start <= at && at < bar.end) {
                last_blank = Some(at);
                since_blank = 0;
                if is_list && self.text[..at].ends_with(';') {
                    lines.push(self.part(start, at));
                    start = at + 1;
                    last_blank = None;
                    so_far = 0;
                }
            }
            if so_far > most
                && let Some(blank) = last_blank
            {
                lines.push(self.part(start, blank));
                start = blank + 1;
                last_blank = None;
                so_far = since_blank;
            }
        }
        lines.push(self.part(start, self.text.len()));
        lines
    }

    fn part(&self, start: usize, end: usize) -> Rich {
        let bars = self.bars.iter().filter(|bar| bar.start >= start && bar.end <= end);
        let bars = bars.map(|bar| Bar {
            start: bar.start - start,
            end: bar.end - start,
            level: bar.level,
        });
        Rich {
            text: self.text.get(start..end).unwrap_or_default().to_owned(),
            bars: bars.collect(),
        }
    }
}

/// A name in lines of at most `most` pixels. A name has no spaces, so it is broken anywhere.
pub(crate) fn broken_name(name: &str, size: i64, most: i64) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut so_far = 0;
    for c in name.chars() {
        let wide = width(c.encode_utf8(&mut [0; 4]), size);
        if so_far + wide > most && so_far > 0 {
            lines.push(String::new());
            so_far = 0;
        }
        so_far += wide;
        if let Some(line) = lines.last_mut() {
            line.push(c);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_the_font() {
        let face = Face::sans();
        for c in ' '..='~' {
            let advance = face.advance(face.glyph(c).expect("it is there"));
            assert_eq!(width_thousandths(c), (advance * 1000 + UNITS - 1) / UNITS, "{c}");
        }
    }
}
