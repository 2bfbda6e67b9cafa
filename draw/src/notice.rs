//! A notice above a drawing: why it is not the drawing of the present source.

use crate::picture::{Font, Mark, Pen, Picture};
use crate::text::cut;
use grafsynth_ir::Span;
use std::collections::BTreeMap;

/// The number of lines that are shown; the others are counted.
const LINES: usize = 12;
/// The width in pixels that a notice has at least, and the one that it has at most if the drawing is not wider.
const WIDTHS: (i64, i64) = (480, 1000);
const LINE: i64 = 18;
const MARGIN: i64 = 12;
/// How far the area behind an element with an error extends beyond it.
const HALO: i64 = 5;

/// The drawing below a notice with a heading and lines of text.
#[must_use]
pub fn noticed(picture: &Picture, heading: &str, lines: &[String]) -> Picture {
    let mut shown: Vec<String> = lines.iter().take(LINES).cloned().collect();
    if lines.len() > LINES {
        shown.push(format!("and {} more", lines.len() - LINES));
    }
    let longest = shown.iter().map(|line| crate::text::width(line, Font::Normal.size())).max();
    let wanted = longest.unwrap_or(0) + 4 * MARGIN;
    let width = wanted.clamp(WIDTHS.0, WIDTHS.1).max(picture.width);
    let n_lines = i64::try_from(shown.len()).unwrap_or(0);
    let height = (n_lines + 1) * LINE + 2 * MARGIN;
    let mut sheet =
        Picture { width, height: height + MARGIN, title: picture.title.clone(), marks: Vec::new() };
    sheet.rect((MARGIN, MARGIN), (width - 2 * MARGIN, height - MARGIN), Pen::Never);
    let mut at = MARGIN + LINE;
    sheet.heading((2 * MARGIN, at), heading);
    for line in &shown {
        at += LINE;
        let text = cut(line, Font::Normal.size(), width - 4 * MARGIN);
        sheet.text((2 * MARGIN, at), &text, Font::Normal);
    }
    sheet.put(picture.clone(), 0, height + MARGIN);
    sheet
}

/// An error in the source of a drawing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MarkedError {
    /// Its places in the source.
    pub places: Vec<Span>,
    /// One line of text.
    pub text: String,
}

/// The drawing of a source with errors: each error has a number, which is beside its element and in a list above the drawing.
#[must_use]
pub fn marked(picture: &Picture, heading: &str, errors: &[MarkedError]) -> Picture {
    let mut drawing = picture.clone();
    let mut halos = Picture::default();
    // The numbers of the errors beside each area.
    let mut numbers: BTreeMap<Bounds, Vec<usize>> = BTreeMap::new();
    for (number, error) in (1..).zip(errors) {
        for area in error.places.iter().filter_map(|place| area(picture, *place)) {
            let all = numbers.entry(area).or_default();
            if !all.contains(&number) {
                all.push(number);
            }
        }
    }
    for ((left, top, right, bottom), numbers) in numbers {
        let (left, top) = ((left - HALO).max(0), (top - HALO).max(0));
        halos.rect((left, top), (right + HALO - left, bottom + HALO - top), Pen::Never);
        let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
        let text = format!("({})", numbers.join(", "));
        let at = right + HALO + 2;
        let width = drawing.text((at, i64::midpoint(top, bottom) + HALO), &text, Font::Small);
        drawing.width = drawing.width.max(at + width + HALO);
        drawing.height = drawing.height.max(bottom + 2 * HALO);
    }
    // The areas are behind everything else.
    halos.marks.append(&mut drawing.marks);
    drawing.marks = halos.marks;
    let lines =
        (1..).zip(errors).map(|(number, error): (usize, _)| format!("({number}) {}", error.text));
    noticed(&drawing, heading, &lines.collect::<Vec<_>>())
}

/// The left, top, right and bottom edge of an area.
type Bounds = (i64, i64, i64, i64);

/// The area of the smallest element of the drawing whose source contains a place.
fn area(picture: &Picture, place: Span) -> Option<Bounds> {
    let contains =
        |span: Span| span.file == place.file && span.start <= place.start && place.end <= span.end;
    let elements = picture.marks.iter().filter_map(|mark| mark.element.as_ref());
    let element = elements
        .filter(|element| contains(element.span))
        .min_by_key(|element| element.span.end - element.span.start)?;
    let own = picture.marks.iter().filter(|mark| mark.element.as_ref() == Some(element));
    own.map(Mark::bounds).reduce(|a, b| (a.0.min(b.0), a.1.min(b.1), a.2.max(b.2), a.3.max(b.3)))
}

#[cfg(test)]
mod tests {
    use super::{LINES, MarkedError, marked, noticed};
    use crate::picture::{Element, Pen, Picture, Shape};
    use crate::svg;
    use grafsynth_ir::{FileId, Span};

    #[test]
    fn an_error_is_marked_at_the_smallest_element_around_it() {
        let mut picture =
            Picture { width: 200, height: 100, title: "x".to_owned(), marks: Vec::new() };
        let span = |start, end| Span::new(FileId(0), start, end);
        for (id, at, place) in [("outer", 10, span(0, 90)), ("inner", 60, span(20, 40))] {
            picture.rect((at, 10), (20, 20), Pen::Line);
            let element = Element { id: id.to_owned(), span: place };
            picture.marks.last_mut().expect("it was added").element = Some(element);
        }
        let error = |places: Vec<Span>, text: &str| MarkedError { places, text: text.to_owned() };
        let errors = [
            error(vec![span(25, 26)], "inside"),
            error(vec![span(95, 96)], "elsewhere"),
            error(vec![span(22, 23), span(39, 40)], "twice"),
        ];
        let sheet = marked(&picture, "broken", &errors);
        let areas = sheet.marks.iter().filter_map(|mark| match mark.shape {
            Shape::Rect { x, width, pen: Pen::Never, .. } => Some((x, width)),
            _ => None,
        });
        // The notice, and one area for both errors of the inner element.
        assert_eq!(areas.skip(1).collect::<Vec<_>>(), [(55, 30)]);
        let text = svg(&sheet);
        assert!(text.contains(">(1, 3)<") && text.contains(">(2) elsewhere<"), "{text}");
    }

    #[test]
    fn a_notice_is_above_the_drawing_and_within_the_sheet() {
        let mut picture =
            Picture { width: 100, height: 50, title: "x".to_owned(), marks: Vec::new() };
        picture.text((5, 20), "p1", crate::picture::Font::Normal);
        let lines: Vec<String> =
            (0..20).map(|n| format!("line {n}: `<script>` {}", "w".repeat(300))).collect();
        let sheet = noticed(&picture, "broken", &lines);
        let (mut notice, mut drawing) = (0, 0);
        for mark in &sheet.marks {
            let (left, top, right, bottom) = mark.bounds();
            assert!(left >= 0 && top >= 0 && right <= sheet.width && bottom <= sheet.height);
            match &mark.shape {
                Shape::Text { text, .. } if text == "p1" => drawing = top,
                Shape::Text { text, .. } if text.starts_with("line") => notice = bottom,
                _ => {}
            }
        }
        assert!(drawing > notice && notice > 0);
        let text = svg(&sheet);
        assert!(!text.contains("<script>") && text.contains("and 8 more"));
        assert_eq!(text.matches(">line ").count(), LINES);
    }
}
