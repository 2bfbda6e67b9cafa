//! The ends of the links that a cut between pages or columns crosses: a mark with the step and the place of the other end, or a turn to the next column.

use crate::grid::{Cut, Link};
use crate::picture::{Font, Pen, Picture, Shape, Way};
use crate::text::width;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

/// The height of a row of marks at a cut.
const ROW: i64 = 14;
/// The distance of marks from the drawing.
const GAP: i64 = 8;
/// The width in which the lines to marks at the side of a page are spread.
const LEAD: i64 = 14;
/// The distance of a mark from its link.
const BESIDE: i64 = 7;

/// The other end of a link, as a mark names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Target {
    /// A page with one column.
    Page(usize),
    /// A column of another page.
    PageColumn(usize, usize),
    /// Another column of the same page.
    Column(usize),
}

impl Target {
    /// The widest of all, for which marks have room.
    pub(crate) const WIDEST: Target = Target::PageColumn(999, 9);
}

impl fmt::Display for Target {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Target::Page(page) => write!(out, "page {page}"),
            Target::PageColumn(page, column) => write!(out, "page {page}, column {column}"),
            Target::Column(column) => write!(out, "column {column}"),
        }
    }
}

/// The end of a link at a border of a row of pages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct End {
    pub(crate) x: i64,
    /// The mark; `None` for a link that goes on in the next column.
    pub(crate) label: Option<String>,
    pub(crate) leads_up: bool,
}

/// The marks of links: the step, and the place of the other end. If several links of a step lead to one place, they are numbered in their order, which is the
/// same at both ends.
pub(crate) fn labels<'a>(links: impl Iterator<Item = (&'a str, Target)>) -> Vec<String> {
    let links: Vec<_> = links.collect();
    let mut numbers: BTreeMap<(&str, Target), (usize, usize)> = BTreeMap::new();
    for link in &links {
        numbers.entry(*link).or_default().1 += 1;
    }
    let label = |(step, target): &(&'a str, Target)| {
        let (number, all) = numbers.entry((step, *target)).or_default();
        *number += 1;
        let number = if *all > 1 { format!(" ({number})") } else { String::new() };
        format!("{step}{number} / {target}")
    };
    links.iter().map(label).collect()
}

/// The marks of the links at a cut in a row of pages; those of its other side have another page.
fn side_labels(cut: &Cut<'_>, page: usize) -> Vec<(i64, String)> {
    let labels = labels(cut.links.iter().map(|link| (link.step, Target::Page(page))));
    cut.links.iter().map(|link| link.place).zip(labels).collect()
}

/// The width of a mark.
fn label_width(label: &str) -> i64 {
    width(label, Font::Small.size())
}

/// The right end of a mark at a link, with its distance from everything else.
pub(crate) fn label_end(x: i64, label: &str) -> i64 {
    x + BESIDE + label_width(label) + 2
}

/// The row of each end, counted from the drawing. Below or above a mark, no other link is in its way, and no end is in the way of a turn, which leads to the
/// right below the drawing, and comes from the left above it.
fn rows(ends: &[End], is_below: bool) -> Vec<i64> {
    let mut rows: Vec<i64> = vec![0; ends.len()];
    for (index, end) in ends.iter().enumerate().rev() {
        let reach = match &end.label {
            Some(label) => label_end(end.x, label),
            None if is_below => i64::MAX,
            None => continue,
        };
        let in_the_way = ends.iter().zip(&rows).skip(index + 1);
        let in_the_way = in_the_way.take_while(|(other, _)| other.x < reach);
        rows[index] = in_the_way.map(|(_, row)| row + 1).max().unwrap_or(0);
    }
    if !is_below {
        let mut free = 0;
        for (row, end) in rows.iter_mut().zip(ends) {
            if end.label.is_none() {
                *row = free;
            }
            free = free.max(*row + 1);
        }
    }
    rows
}

/// The height of the ends at a border of a row of pages.
pub(crate) fn height(ends: &[End], is_below: bool) -> i64 {
    rows(ends, is_below).into_iter().max().map_or(0, |last| (last + 1) * ROW + GAP)
}

/// The width of the marks on each side of a cut in a row of pages.
pub(crate) fn side_width(cut: &Cut<'_>, page: usize) -> i64 {
    let labels = side_labels(cut, page);
    labels.iter().map(|(_, label)| LEAD + 4 + label_width(label)).max().unwrap_or(0)
}

/// Draws the ends of links below or above a drawing, from the height `y` on, and returns where the turns begin.
pub(crate) fn draw(
    out: &mut Picture,
    ends: &[End],
    (shift, y): (i64, i64),
    is_below: bool,
) -> Vec<(i64, i64)> {
    let mut turns = Vec::new();
    for (end, row) in ends.iter().zip(rows(ends, is_below)) {
        let x = end.x + shift;
        let away = GAP + row * ROW + (ROW - GAP) / 2;
        let last = if is_below { y + away } else { y - away };
        out.line((x, y), (x, last), Pen::Line);
        if end.leads_up {
            out.add(Shape::Arrow { x, y: y.min(last + 4) - 2, way: Way::Up });
        }
        let Some(label) = &end.label else {
            turns.push((x, last));
            continue;
        };
        out.line((x - 4, last), (x + 4, last), Pen::Detail);
        let wide = out.text((x + BESIDE, last + 4), label, Font::Small);
        out.width = out.width.max(x + BESIDE + wide);
    }
    turns
}

/// The ends of the links at a cut, from its column on to the left (-1) or to the right (1). The marks are beside their links, or as near as there is space for
/// all of them in `bounds`.
pub(crate) fn draw_sides(
    out: &mut Picture,
    cut: &Cut<'_>,
    (x, way): (i64, i64),
    (shift, bounds): (i64, &Range<i64>),
    page: usize,
) {
    let mut heights: Vec<i64> = Vec::new();
    for Link { place: at, .. } in &cut.links {
        let free = heights.last().map_or(bounds.start + ROW / 2, |last| last + ROW);
        heights.push(free.max(at + shift));
    }
    let n_links = i64::try_from(cut.links.len()).unwrap_or(i64::MAX / 1000);
    let mut free = bounds.end.max(bounds.start + ROW * n_links) - ROW / 2;
    for height in heights.iter_mut().rev() {
        *height = free.min(*height);
        free = *height - ROW;
    }
    for ((at, label), height) in side_labels(cut, page).iter().zip(heights) {
        let end = x + way * LEAD;
        out.line((x, at + shift), (end, height), Pen::Line);
        out.line((end, height - 4), (end, height + 4), Pen::Detail);
        let wide = label_width(label);
        let left = if way > 0 { end + 3 } else { end - 3 - wide };
        out.text((left, height + 4), label, Font::Small);
        out.width = out.width.max(left + wide);
    }
}
