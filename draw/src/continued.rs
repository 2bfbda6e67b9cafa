//! The headings of frames that begin on another page: each page says in which charts and expansions its symbols are.

use crate::picture::{Font, Pen, Picture, Shape};
use crate::sheet::MARGIN;
use crate::text::{cut, width};
use std::ops::Range;

/// The height of a row of headings above a page.
const ROW: i64 = 22;
/// The width that a heading may have on a page, even if less of its frame is there.
const LEAST: i64 = 400;

/// A frame with its heading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame<'a> {
    left: i64,
    top: i64,
    right: i64,
    bottom: i64,
    heading: &'a str,
    /// The beginning of the heading.
    at: (i64, i64),
}

/// The frames of a drawing, each before those in it. The heading of a frame is the mark after it.
pub(crate) fn frames(picture: &Picture) -> Vec<Frame<'_>> {
    let headed = picture.marks.iter().zip(picture.marks.iter().skip(1));
    let frames = headed.filter_map(|(frame, text)| match (&frame.shape, &text.shape) {
        (
            Shape::Rect { pen: Pen::Frame, .. },
            Shape::Text { x, y, text, font: Font::Heading, .. },
        ) => {
            let (left, top, right, bottom) = frame.bounds();
            Some(Frame { left, top, right, bottom, heading: text, at: (*x, *y) })
        }
        _ => None,
    });
    frames.collect()
}

impl Frame<'_> {
    /// True if a part of the frame, but not its heading, is on the page.
    fn is_continued(&self, wide: &Range<i64>, high: &Range<i64>) -> bool {
        let is_here = self.left < wide.end
            && wide.start < self.right
            && self.top < high.end
            && high.start < self.bottom;
        is_here && !(wide.contains(&self.at.0) && high.contains(&self.at.1))
    }

    /// True if a symbol of a page is in the frame.
    fn has_symbols(&self, page: &Picture) -> bool {
        page.marks.iter().any(|mark| {
            let (x, y, ..) = mark.bounds();
            let is_inside = self.left < x && x < self.right && self.top < y && y < self.bottom;
            is_inside && mark.element.is_some()
        })
    }

    fn begins_above(&self, high: &Range<i64>) -> bool {
        self.at.1 < high.start
    }

    /// The heading for a page of which the frame has `most` pixels.
    fn text(&self, most: i64) -> String {
        let letter = Font::Heading.size() * 9 / 8;
        let end = ", continued";
        format!("{}{end}", cut(self.heading, letter, most.max(LEAST) - width(end, letter)))
    }
}

/// The height of the headings above a page.
pub(crate) fn height(frames: &[Frame<'_>], wide: &Range<i64>, high: &Range<i64>) -> i64 {
    let continued = frames.iter().filter(|it| it.is_continued(wide, high));
    above(&continued.collect::<Vec<_>>(), wide, high).height
}

/// The width of the headings on a page.
pub(crate) fn widest(frames: &[Frame<'_>], wide: &Range<i64>, high: &Range<i64>) -> i64 {
    let continued: Vec<_> = frames.iter().filter(|it| it.is_continued(wide, high)).collect();
    let of = |frame: &&Frame<'_>| {
        width(&frame.text(frame.right.min(wide.end) - wide.start), Font::Heading.size() * 9 / 8)
    };
    let beside = continued.iter().filter(|it| !it.begins_above(high)).map(of).max();
    above(&continued, wide, high).width.max(beside.unwrap_or(0))
}

/// Adds the headings of frames that begin to the left of a page, each in its own row, because a frame is empty to the right of its heading. Returns those of
/// frames that begin above the page, relative to its upper left corner.
pub(crate) fn headings(
    page: &mut Picture,
    frames: &[Frame<'_>],
    wide: &Range<i64>,
    high: &Range<i64>,
) -> Picture {
    let is_meant = |it: &&Frame<'_>| it.is_continued(wide, high) && it.has_symbols(page);
    let continued: Vec<_> = frames.iter().filter(is_meant).collect();
    for frame in continued.iter().filter(|it| !it.begins_above(high)) {
        let text = frame.text(frame.right.min(wide.end) - wide.start);
        let end = wide.start + page.heading((wide.start, frame.at.1), &text);
        page.width = page.width.max(end);
    }
    above(&continued, wide, high)
}

/// The headings of frames that begin above a page: those of frames inside of each other are below each other.
fn above(continued: &[&Frame<'_>], wide: &Range<i64>, high: &Range<i64>) -> Picture {
    let mut out = Picture::default();
    // Where each row is free.
    let mut free: Vec<i64> = Vec::new();
    for frame in continued.iter().filter(|it| it.begins_above(high)) {
        let start = frame.at.0.max(wide.start);
        let x = start - wide.start;
        let row = free.iter().position(|end| *end <= x).unwrap_or(free.len());
        let y = ROW * i64::try_from(row).unwrap_or(0);
        let text = frame.text(frame.right.min(wide.end) - start);
        let end = x + out.heading((x, y + 14), &text);
        (out.width, out.height) = (out.width.max(end), out.height.max(y + ROW));
        match free.get_mut(row) {
            Some(place) => *place = end + MARGIN,
            None => free.push(end + MARGIN),
        }
    }
    out
}
