//! Pages as a PDF file. Text remains text, in the fonts Helvetica and Symbol, which every viewer has.

use crate::Rendered;
use crate::ink::{self, Colour};
use crate::pages::Page;
use crate::picture::{Font, Pen, Picture, Shape, Way};
use crate::text::width_thousandths;
use pdf_writer::{Content, Finish as _, Name, Pdf, Rect, Ref, Str, TextStr};
use std::collections::BTreeSet;

/// The names and the PostScript names of the fonts.
const FONTS: [(&[u8], &[u8]); 3] =
    [(b"F0", b"Helvetica"), (b"F1", b"Helvetica-Bold"), (b"F2", b"Symbol")];

/// Writes pages as a PDF file. The same pages give the same bytes.
#[must_use]
pub fn pdf(pages: &[Page], title: &str) -> Rendered {
    let mut pdf = Pdf::new();
    let mut last = 0;
    let mut next = || {
        last += 1;
        Ref::new(last)
    };
    let (catalog, tree, info) = (next(), next(), next());
    let fonts = FONTS.map(|_| next());
    let ids: Vec<(Ref, Ref)> = pages.iter().map(|_| (next(), next())).collect();
    pdf.catalog(catalog).pages(tree);
    let count = i32::try_from(ids.len()).unwrap_or(i32::MAX);
    pdf.pages(tree).kids(ids.iter().map(|(page, _)| *page)).count(count);
    pdf.document_info(info).title(TextStr(title)).producer(TextStr("grafsynth"));
    for (id, (_, base)) in fonts.into_iter().zip(FONTS) {
        let mut font = pdf.type1_font(id);
        font.base_font(Name(base));
        if base != b"Symbol" {
            font.encoding_predefined(Name(b"WinAnsiEncoding"));
        }
    }
    let mut missing = BTreeSet::new();
    for (page, (id, stream)) in pages.iter().zip(ids) {
        let (wide, high) = (points(page.size.0), points(page.size.1));
        let mut entry = pdf.page(id);
        entry.parent(tree).media_box(Rect::new(0.0, 0.0, wide, high)).contents(stream);
        let mut resources = entry.resources();
        let mut dictionary = resources.fonts();
        for (font, (name, _)) in fonts.into_iter().zip(FONTS) {
            dictionary.pair(Name(name), font);
        }
        dictionary.finish();
        resources.finish();
        entry.finish();
        let content = content(&page.picture, (wide, high), &mut missing);
        pdf.stream(stream, content.finish().as_slice());
    }
    Rendered { bytes: pdf.finish(), missing }
}

/// The points of a length in tenths of a millimetre.
#[expect(clippy::cast_precision_loss, reason = "paper is less than a million points wide")]
fn points(tenths: i64) -> f32 {
    tenths as f32 * 72.0 / 254.0
}

#[expect(
    clippy::cast_precision_loss,
    reason = "drawings are smaller than 2^24 pixels, or their pixels are smaller than the resolution of any printer"
)]
fn number(pixels: i64) -> f32 {
    pixels as f32
}

/// The drawing in the size of its paper; its `y` axis leads down, that of PDF up.
fn content(picture: &Picture, (wide, high): (f32, f32), missing: &mut BTreeSet<char>) -> Content {
    let mut content = Content::new();
    let (x, y) = (wide / number(picture.width.max(1)), high / number(picture.height.max(1)));
    content.transform([x, 0.0, 0.0, -y, 0.0, high]);
    for mark in &picture.marks {
        write_shape(&mut content, &mark.shape, missing);
    }
    content
}

fn write_shape(content: &mut Content, shape: &Shape, missing: &mut BTreeSet<char>) {
    match shape {
        Shape::Rect { x, y, width, height, pen } => {
            let [left, top, wide, high] = [*x, *y, *width, *height].map(number);
            content.save_state();
            match ink::area(*pen) {
                Some(colour) => {
                    let [red, green, blue] = parts(colour);
                    content.set_fill_rgb(red, green, blue);
                    content.rect(left, top, wide, high).fill_nonzero();
                }
                None => {
                    set_pen(content, *pen);
                    if *pen == Pen::State {
                        rounded(content, (left, top), (left + wide, top + high));
                    } else {
                        content.rect(left, top, wide, high);
                    }
                    content.stroke();
                }
            }
            content.restore_state();
        }
        Shape::Line { from, to, pen } => {
            content.save_state();
            set_pen(content, *pen);
            content.move_to(number(from.0), number(from.1));
            content.line_to(number(to.0), number(to.1)).stroke();
            content.restore_state();
        }
        Shape::Crossing { x, y } => {
            content.save_state();
            content.set_stroke_gray(1.0).set_line_width(4.0);
            content.move_to(number(x - ink::CROSSING), number(*y));
            content.line_to(number(x + ink::CROSSING), number(*y)).stroke();
            content.restore_state();
        }
        Shape::Arrow { x, y, way } => {
            let back = if *way == Way::Up { y + 9 } else { y - 9 };
            content.move_to(number(*x), number(*y));
            content.line_to(number(x - 4), number(back)).line_to(number(x + 4), number(back));
            content.close_path().fill_nonzero();
        }
        Shape::Circle { x, y, radius, is_filled } => {
            content.save_state();
            set_pen(content, Pen::Line);
            circle(content, (number(*x), number(*y)), number(*radius));
            if *is_filled {
                content.fill_nonzero()
            } else {
                content.stroke()
            };
            content.restore_state();
        }
        Shape::Text { x, y, text, font, .. } => write_text(content, (*x, *y), text, *font, missing),
    }
}

/// A colour as PDF has it.
fn parts(colour: Colour) -> [f32; 3] {
    colour.map(|part| f32::from(part) / 255.0)
}

fn set_pen(content: &mut Content, pen: Pen) {
    let ink::Stroke { halves, colour: [gray, ..] } = ink::stroke(pen);
    content.set_line_width(number(halves) / 2.0).set_stroke_gray(f32::from(gray) / 255.0);
    if pen == Pen::Dashed {
        content.set_dash_pattern([number(ink::DASH.0), number(ink::DASH.1)], 0.0);
    }
}

/// A rectangle with round corners.
fn rounded(content: &mut Content, (left, top): (f32, f32), (right, bottom): (f32, f32)) {
    let round = number(ink::ROUND);
    // The distance of a control point from its corner.
    let near = round * (1.0 - 0.552_285);
    content.move_to(left + round, top).line_to(right - round, top);
    content.cubic_to(right - near, top, right, top + near, right, top + round);
    content.line_to(right, bottom - round);
    content.cubic_to(right, bottom - near, right - near, bottom, right - round, bottom);
    content.line_to(left + round, bottom);
    content.cubic_to(left + near, bottom, left, bottom - near, left, bottom - round);
    content.line_to(left, top + round);
    content.cubic_to(left, top + near, left + near, top, left + round, top);
    content.close_path();
}

/// A circle of four curves.
fn circle(content: &mut Content, (x, y): (f32, f32), radius: f32) {
    let near = radius * 0.552_285;
    content.move_to(x + radius, y);
    content.cubic_to(x + radius, y + near, x + near, y + radius, x, y + radius);
    content.cubic_to(x - near, y + radius, x - radius, y + near, x - radius, y);
    content.cubic_to(x - radius, y - near, x - near, y - radius, x, y - radius);
    content.cubic_to(x + near, y - radius, x + radius, y - near, x + radius, y);
    content.close_path();
}

/// A text in runs of one font, each at its own place.
fn write_text(
    content: &mut Content,
    (x, y): (i64, i64),
    text: &str,
    font: Font,
    missing: &mut BTreeSet<char>,
) {
    let plain = if font == Font::Heading { 1 } else { 0 };
    let mut runs: Vec<(usize, i64, Vec<u8>)> = Vec::new();
    let mut at = 0;
    for c in text.chars() {
        let (face, byte) = match (win_ansi(c), symbol(c)) {
            (Some(byte), _) => (plain, byte),
            (None, Some(byte)) => (2, byte),
            (None, None) => {
                missing.insert(c);
                (plain, b'?')
            }
        };
        match runs.last_mut() {
            Some((last, _, bytes)) if *last == face => bytes.push(byte),
            _ => runs.push((face, at, vec![byte])),
        }
        at += width_thousandths(c) * font.size();
    }
    content.save_state();
    content.set_fill_gray(f32::from(ink::letters(font)[0]) / 255.0);
    content.begin_text();
    for (face, at, bytes) in runs {
        let Some((name, _)) = FONTS.get(face) else { continue };
        content.set_font(Name(name), number(font.size()));
        content.set_text_matrix([1.0, 0.0, 0.0, -1.0, number(x) + number(at) / 1000.0, number(y)]);
        content.show(Str(&bytes));
    }
    content.end_text();
    content.restore_state();
}

/// The code of a character in the encoding WinAnsi.
fn win_ansi(c: char) -> Option<u8> {
    const HIGH: &str = "€\u{0}‚ƒ„…†‡ˆ‰Š‹Œ\u{0}Ž\u{0}\u{0}‘’“”•–—˜™š›œ\u{0}žŸ";
    match u32::from(c) {
        code @ (0x20..=0x7e | 0xa0..=0xff) => u8::try_from(code).ok(),
        _ => {
            let place = HIGH.chars().position(|one| one == c && c != '\u{0}')?;
            u8::try_from(0x80 + place).ok()
        }
    }
}

/// The code of a character in the font Symbol.
fn symbol(c: char) -> Option<u8> {
    const GREEK: &str = "αβχδεφγηιϕκλμνοπθρστυϖωξψζ";
    const CAPITALS: &str = "ΑΒΧΔΕΦΓΗΙϑΚΛΜΝΟΠΘΡΣΤΥςΩΞΨΖ";
    let signs = [
        ('≤', 0xa3),
        ('∞', 0xa5),
        ('↔', 0xab),
        ('←', 0xac),
        ('↑', 0xad),
        ('→', 0xae),
        ('↓', 0xaf),
        ('≥', 0xb3),
        ('≠', 0xb9),
    ];
    if let Some((_, code)) = signs.iter().find(|(sign, _)| *sign == c) {
        return Some(*code);
    }
    let letter = |first: u8, all: &str| {
        let place = all.chars().position(|one| one == c)?;
        Some(first + u8::try_from(place).ok()?)
    };
    letter(b'a', GREEK).or_else(|| letter(b'A', CAPITALS))
}
