//! A notice above a drawing: why it is not the drawing of the present source.

use crate::picture::{Font, Pen, Picture};
use crate::text::cut;

/// The number of lines that are shown; the others are counted.
const LINES: usize = 12;
/// The width in pixels that a notice has at least, and the one that it has at most if the drawing is not wider.
const WIDTHS: (i64, i64) = (480, 1000);
const LINE: i64 = 18;
const MARGIN: i64 = 12;

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

#[cfg(test)]
mod tests {
    use super::{LINES, noticed};
    use crate::picture::{Picture, Shape};
    use crate::svg;

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
