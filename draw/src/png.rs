//! A drawing as a PNG file, on white.

use crate::Rendered;
use crate::ink::{self, BLACK};
use crate::outlines::{Face, UNITS};
use crate::pages::Page;
use crate::picture::{Font, Mark, Pen, Picture, Shape, Way};
use crate::raster::{Canvas, ONE, Point};
use miniz_oxide::deflate::core::{
    CompressorOxide, TDEFLFlush, compress_to_output, create_comp_flags_from_zip_params,
};
use std::collections::BTreeSet;

/// The largest number of pixels of a file: browsers show no larger ones.
const MOST_PIXELS: i64 = 250_000_000;
/// The rows of pixels that are in memory at a time.
const BAND: i64 = 256;
/// How far a shape reaches beyond its bounds, in pixels of the drawing: arrowheads, thick lines, accents.
const REACH: i64 = 8;

/// The pixels of a drawing that are too many for a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLarge {
    /// The width of the file.
    pub width: i64,
    /// The height of the file.
    pub height: i64,
}

/// Writes a drawing as a PNG file with `scale` pixels for each pixel of the drawing, in the size of the SVG file. The same drawing gives the same bytes.
///
/// # Errors
/// Returns [`TooLarge`] if the file would have more than 250 million pixels.
pub fn png(picture: &Picture, scale: u8) -> Result<Rendered, TooLarge> {
    // 96 pixels are one inch.
    file(picture, scale, i64::from(scale) * 960_000 / 254)
}

/// Writes a page as a PNG file of the size of its paper.
///
/// # Errors
/// As [`png`].
pub fn page_png(page: &Page, scale: u8) -> Result<Rendered, TooLarge> {
    file(&page.picture, scale, page.picture.width * i64::from(scale) * 10_000 / page.size.0.max(1))
}

/// The file; `per_metre` is the number of its pixels in one metre.
fn file(picture: &Picture, scale: u8, per_metre: i64) -> Result<Rendered, TooLarge> {
    let unit = i64::from(scale.max(1));
    let pixels = |length: i64| length.max(1).saturating_mul(unit);
    let (width, height) = (pixels(picture.width), pixels(picture.height));
    let too_large = TooLarge { width, height };
    if width.saturating_mul(height) > MOST_PIXELS {
        return Err(too_large);
    }
    let (Ok(wide), Ok(high)) = (u32::try_from(width), u32::try_from(height)) else {
        return Err(too_large);
    };
    let mut writer = Writer::new((wide, high), is_gray(picture));
    let mut brush =
        Brush { canvas: Canvas::new(0, 0..0), unit, face: Face::sans(), missing: BTreeSet::new() };
    let mut top = 0;
    while top < height {
        let end = (top + BAND).min(height);
        brush.canvas = Canvas::new(wide as usize, top..end);
        let (from, to) = (top / unit - REACH, end / unit + REACH);
        for mark in &picture.marks {
            let (_, upper, _, lower) = mark.bounds();
            if upper <= to && lower >= from {
                brush.draw(&mark.shape);
            }
        }
        brush.canvas.rows().for_each(|row| writer.row(row));
        top = end;
    }
    let per_metre = u32::try_from(per_metre).unwrap_or(0);
    Ok(Rendered { bytes: writer.file(per_metre), missing: brush.missing })
}

/// True if no mark has a colour.
fn is_gray(picture: &Picture) -> bool {
    let is_coloured =
        |mark: &Mark| matches!(&mark.shape, Shape::Rect { pen, .. } if ink::area(*pen).is_some());
    !picture.marks.iter().any(is_coloured)
}

/// Draws shapes on a canvas.
struct Brush {
    canvas: Canvas,
    /// The pixels of the canvas for one of the drawing.
    unit: i64,
    face: Face,
    /// The characters that the font lacks.
    missing: BTreeSet<char>,
}

impl Brush {
    fn draw(&mut self, shape: &Shape) {
        match shape {
            Shape::Rect { x, y, width, height, pen } => {
                let (from, to) = ((*x, *y), (x + width, y + height));
                match ink::area(*pen) {
                    Some(colour) => {
                        self.canvas.fill_rect(self.at(from), self.at(to), colour);
                    }
                    None if *pen == Pen::State => self.rounded(from, to),
                    None => self.border(from, to, *pen),
                }
            }
            Shape::Line { from, to, pen: Pen::Dashed } => self.dashed(*from, *to),
            Shape::Line { from, to, pen } => self.line(*from, *to, *pen),
            Shape::Crossing { x, y } => {
                let (from, to) = ((x - ink::CROSSING, y - 2), (x + ink::CROSSING, y + 2));
                self.canvas.fill_rect(self.at(from), self.at(to), [255; 3]);
            }
            Shape::Arrow { x, y, way } => {
                let back = if *way == Way::Up { y + 9 } else { y - 9 };
                let outline = [(*x, *y), (x - 4, back), (x + 4, back)];
                let outline = outline.map(|point| self.at(point)).to_vec();
                self.canvas.fill(&[outline], BLACK);
            }
            Shape::Circle { x, y, radius, is_filled } => {
                let middle = self.at((*x, *y));
                let at = |radius| arc_points(radius).map(|(dx, dy)| (middle.0 + dx, middle.1 + dy));
                let radius = radius * self.unit * ONE;
                if *is_filled {
                    self.canvas.fill(&[at(radius).collect()], BLACK);
                } else {
                    let half = ink::stroke(Pen::Line).halves * self.unit * ONE / 4;
                    let outer = at(radius + half).collect();
                    let mut inner: Vec<Point> = at(radius - half).collect();
                    inner.reverse();
                    self.canvas.fill(&[outer, inner], BLACK);
                }
            }
            Shape::Text { x, y, text, width, font } => self.text((*x, *y), text, *width, *font),
        }
    }

    /// A point of the drawing on the canvas.
    fn at(&self, (x, y): (i64, i64)) -> Point {
        (x * self.unit * ONE, y * self.unit * ONE)
    }

    fn line(&mut self, from: (i64, i64), to: (i64, i64), pen: Pen) {
        let stroke = ink::stroke(pen);
        let half = stroke.halves * self.unit * ONE / 4;
        let (from, to) = (self.at(from), self.at(to));
        if from.0 == to.0 || from.1 == to.1 {
            // The ends are where the line ends, not half its thickness further.
            let (wide, high) = if from.0 == to.0 { (half, 0) } else { (0, half) };
            let low = (from.0.min(to.0) - wide, from.1.min(to.1) - high);
            let end = (from.0.max(to.0) + wide, from.1.max(to.1) + high);
            self.canvas.fill_rect(low, end, stroke.colour);
            return;
        }
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = (dx * dx + dy * dy).isqrt().max(1);
        let (nx, ny) = (-dy * half / length, dx * half / length);
        let outline = vec![
            (from.0 + nx, from.1 + ny),
            (to.0 + nx, to.1 + ny),
            (to.0 - nx, to.1 - ny),
            (from.0 - nx, from.1 - ny),
        ];
        self.canvas.fill(&[outline], stroke.colour);
    }

    /// A vertical or horizontal line of dashes.
    fn dashed(&mut self, from: (i64, i64), to: (i64, i64)) {
        let (dx, dy) = ((to.0 - from.0).signum(), (to.1 - from.1).signum());
        let length = (to.0 - from.0).abs().max((to.1 - from.1).abs());
        let mut start = 0;
        while start < length {
            let end = (start + ink::DASH.0).min(length);
            let at = |along: i64| (from.0 + dx * along, from.1 + dy * along);
            self.line(at(start), at(end), Pen::Dashed);
            start = end + ink::DASH.1;
        }
    }

    fn border(&mut self, from: (i64, i64), to: (i64, i64), pen: Pen) {
        let stroke = ink::stroke(pen);
        let half = stroke.halves * self.unit * ONE / 4;
        let ((left, top), (right, bottom)) = (self.at(from), self.at(to));
        // Both outlines are one area: where two sides met, their pixels would be mixed twice.
        let outline = |by: i64| {
            let (left, top, right, bottom) = (left - by, top - by, right + by, bottom + by);
            vec![(left, top), (right, top), (right, bottom), (left, bottom)]
        };
        let mut inner = outline(-half);
        inner.reverse();
        self.canvas.fill(&[outline(half), inner], stroke.colour);
    }

    /// The border of a state.
    fn rounded(&mut self, from: (i64, i64), to: (i64, i64)) {
        let stroke = ink::stroke(Pen::State);
        let half = stroke.halves * self.unit * ONE / 4;
        let ((left, top), (right, bottom)) = (self.at(from), self.at(to));
        let round = ink::ROUND * self.unit * ONE;
        // From quarter to quarter, clockwise from the right.
        let middles = [(right - round, bottom - round), (left + round, bottom - round)]
            .into_iter()
            .chain([(left + round, top + round), (right - round, top + round)]);
        let outline = |radius: i64| -> Vec<Point> {
            let points: Vec<Point> = arc_points(radius).collect();
            let quarters = points.chunks(ARC.len() - 1);
            let mut all = Vec::new();
            for (index, (middle, quarter)) in middles.clone().zip(quarters).enumerate() {
                // The first point of the next quarter is the last one of this.
                let last = points.get((index + 1) * (ARC.len() - 1)).or(points.first());
                let moved = |point: &Point| (point.0 + middle.0, point.1 + middle.1);
                all.extend(quarter.iter().chain(last).map(moved));
            }
            all
        };
        let mut inner = outline(round - half);
        inner.reverse();
        self.canvas.fill(&[outline(round + half), inner], stroke.colour);
    }

    /// A text, stretched to its width; a heading has its letters further apart instead.
    fn text(&mut self, (x, y): (i64, i64), text: &str, width: i64, font: Font) {
        let mut glyphs = Vec::new();
        for c in text.chars() {
            let own = self.face.glyph(c);
            if own.is_none() {
                self.missing.insert(c);
            }
            glyphs.extend(own.or_else(|| self.face.glyph('?')));
        }
        let natural: i64 = glyphs.iter().map(|glyph| self.face.advance(*glyph)).sum();
        let (wide, high) = (width * self.unit * ONE, font.size() * self.unit * ONE);
        let start = self.at((x, y));
        let mut along = 0;
        for glyph in glyphs {
            let contours = self.face.contours(glyph);
            let from = along * wide / natural.max(1);
            let (own, of) = if font == Font::Heading { (high, UNITS) } else { (wide, natural) };
            let placed = |shift: i64| {
                let at = move |(gx, gy): &Point| {
                    let gx = from + (shift + gx) * own / of.max(1);
                    (start.0 + gx, start.1 - gy * high / UNITS)
                };
                contours.iter().map(move |contour| contour.iter().map(at).collect::<Vec<Point>>())
            };
            let mut outlines: Vec<Vec<Point>> = placed(0).collect();
            if font == Font::Heading {
                // A heading is bold: each letter is there twice.
                outlines.extend(placed(UNITS / 24));
            }
            self.canvas.fill(&outlines, ink::letters(font));
            along += self.face.advance(glyph);
        }
    }
}

/// Cosine and sine of nine angles in a quarter of a circle, in 1/4096.
const ARC: [(i64, i64); 9] = [
    (4096, 0),
    (4017, 799),
    (3784, 1567),
    (3406, 2276),
    (2896, 2896),
    (2276, 3406),
    (1567, 3784),
    (799, 4017),
    (0, 4096),
];

/// The points of a circle around (0, 0), in the order right, lower, left, upper.
fn arc_points(radius: i64) -> impl Iterator<Item = Point> {
    (0..4).flat_map(move |quarter| {
        ARC.iter().take(ARC.len() - 1).map(move |(cos, sin)| {
            let (a, b) = (radius * cos / 4096, radius * sin / 4096);
            match quarter {
                0 => (a, b),
                1 => (-b, a),
                2 => (-a, -b),
                _ => (b, -a),
            }
        })
    })
}

/// Writes rows of pixels as a file (ISO/IEC 15948).
struct Writer {
    size: (u32, u32),
    is_gray: bool,
    compressor: CompressorOxide,
    /// The row before, as it is in the file.
    above: Vec<u8>,
    /// A row as it is compressed.
    line: Vec<u8>,
    compressed: Vec<u8>,
}

impl Writer {
    fn new(size: (u32, u32), is_gray: bool) -> Self {
        // With the header of zlib.
        let flags = create_comp_flags_from_zip_params(7, 15, 0);
        Writer {
            size,
            is_gray,
            compressor: CompressorOxide::new(flags),
            above: vec![0; size.0 as usize * if is_gray { 1 } else { 3 }],
            line: Vec::new(),
            compressed: Vec::new(),
        }
    }

    /// Adds a row; it is written as the difference from the row above, which is 0 for the most part.
    fn row(&mut self, row: &[u8]) {
        const UP: u8 = 2;
        let step = if self.is_gray { 3 } else { 1 };
        self.line.clear();
        self.line.push(UP);
        for (byte, last) in row.iter().step_by(step).zip(&mut self.above) {
            self.line.push(byte.wrapping_sub(*last));
            *last = *byte;
        }
        self.compress(TDEFLFlush::None);
    }

    fn compress(&mut self, flush: TDEFLFlush) {
        let Writer { compressor, line, compressed, .. } = self;
        // All of the line is read, because every output is accepted.
        compress_to_output(compressor, line, flush, |bytes| {
            compressed.extend_from_slice(bytes);
            true
        });
    }

    fn file(mut self, per_metre: u32) -> Vec<u8> {
        self.line.clear();
        self.compress(TDEFLFlush::Finish);
        let mut head = Vec::new();
        head.extend(self.size.0.to_be_bytes());
        head.extend(self.size.1.to_be_bytes());
        // 8 bits for each part; gray, or red, green and blue.
        head.extend([8, if self.is_gray { 0 } else { 2 }, 0, 0, 0]);
        let mut physical = Vec::new();
        physical.extend(per_metre.to_be_bytes());
        physical.extend(per_metre.to_be_bytes());
        // The unit is the metre.
        physical.push(1);
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        chunk(&mut file, *b"IHDR", &head);
        chunk(&mut file, *b"pHYs", &physical);
        chunk(&mut file, *b"IDAT", &self.compressed);
        chunk(&mut file, *b"IEND", &[]);
        file
    }
}

fn chunk(file: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    file.extend(u32::try_from(data.len()).unwrap_or(u32::MAX).to_be_bytes());
    let start = file.len();
    file.extend(kind);
    file.extend(data);
    let checked = file.get(start..).map_or(0, crc);
    file.extend(checked.to_be_bytes());
}

/// The checksum of a chunk: CRC-32.
fn crc(data: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in data {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
        }
    }
    !crc
}
