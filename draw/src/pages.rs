//! A drawing on several sheets of paper.
//!
//! A drawing that is larger than the paper is cut into rows of pages, and each row between symbols from left to right, where only links cross the cuts, or made
//! smaller as long as it can be read. Each end of such a link has a mark with the step that the link belongs to and the page of the other end. Only a part without
//! a place for a cut is made smaller than that.

use crate::grid::{Axis, Cut, candidates, division};
use crate::picture::{Font, Mark, Pen, Picture, Shape};
use crate::text::{cut, width};
use grafsynth_ir::net::{Evolution, Net};
use std::ops::Range;

/// The sizes of paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paper {
    /// 210 mm x 297 mm.
    A4,
    /// 297 mm x 420 mm.
    A3,
    /// 8.5 in x 11 in.
    Letter,
}

impl Paper {
    /// The shorter and the longer side in tenths of a millimetre.
    #[must_use]
    pub fn size(self) -> (i64, i64) {
        match self {
            Paper::A4 => (2100, 2970),
            Paper::A3 => (2970, 4200),
            Paper::Letter => (2159, 2794),
        }
    }
}

/// One sheet of paper with its part of the drawing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The sheet with margins and title block; its size is that of the paper in the unit of the drawing.
    pub picture: Picture,
    /// The width and height of the paper in tenths of a millimetre.
    pub size: (i64, i64),
    /// The size of the drawing on paper in per cent; at most 100, which is 96 pixels for one inch.
    pub percent: i64,
}

/// What is written at the bottom of each page: labels with their texts. The page number is added.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TitleBlock {
    /// The cells from left to right.
    pub cells: Vec<(String, String)>,
}

impl TitleBlock {
    /// The name and the settings of a net, and a name for its source, such as a hash.
    #[must_use]
    pub fn of(net: &Net, source: &str) -> Self {
        let evolution = match net.settings.evolution {
            Evolution::Single => "single".to_owned(),
            Evolution::Stable { limit } => format!("stable, limit {limit}"),
        };
        let cells = [
            ("chart", net.name.text.clone()),
            ("tick", grafsynth_ir::duration(net.settings.tick_ns)),
            ("conflict", net.settings.policy.word().to_owned()),
            ("evolution", evolution),
            ("source", source.to_owned()),
        ];
        TitleBlock { cells: cells.map(|(label, text)| (label.to_owned(), text)).to_vec() }
    }
}

/// The margin of a page of full size, in pixels.
const MARGIN: i64 = 38;
/// The height of the title block with its distance from the drawing.
const BLOCK: i64 = 48;
/// The width from which texts of the title block are cut.
const LONGEST_TEXT: i64 = 200;
/// The height of a row of marks at a cut.
const ROW: i64 = 14;
/// The distance of marks from the drawing.
const GAP: i64 = 8;
/// The width in which the lines to marks at the side of a page are spread.
const LEAD: i64 = 14;

/// How much smaller a drawing may be, in thousandths: its smallest letters, of 11 pixels, still have 7 points.
const READABLE: i64 = 1176;

/// Divides a drawing into pages of one size, row by row, in portrait unless the drawing is wider than that. It is made smaller, as long as it can be read, if
/// this cuts fewer links.
#[must_use]
pub fn pages(picture: &Picture, paper: Paper, title: &TitleBlock) -> Vec<Page> {
    let (short, long) = paper.size();
    let is_wide = picture.width > pixels(short) - 2 * MARGIN;
    let sizes = if is_wide { vec![(long, short), (short, long)] } else { vec![(short, long)] };
    let inner =
        |size: (i64, i64)| (pixels(size.0) - 2 * MARGIN, pixels(size.1) - 2 * MARGIN - BLOCK);
    let needed = |part: &Picture, inner: (i64, i64)| {
        thousandths(part.width, inner.0).max(thousandths(part.height, inner.1))
    };
    let all = sizes.iter().flat_map(|size| [(*size, 1000), (*size, READABLE)]);
    let all = all.map(|(size, most)| {
        let (wide, high) = inner(size);
        let grid = Grid::new(picture, (wide * most / 1000, high * most / 1000));
        let parts = grid.parts(picture);
        let n_small = parts.iter().filter(|part| needed(part, (wide, high)) > READABLE).count();
        ((n_small, grid.n_links(), parts.len()), size, parts)
    });
    let Some((_, size, parts)) = all.min_by_key(|(cost, ..)| *cost) else { return Vec::new() };
    // The parts without a place for a cut do not make the other pages smaller.
    let needed = |part: &Picture| needed(part, inner(size));
    let common = parts.iter().map(needed).filter(|factor| *factor <= READABLE).max();
    let n_pages = parts.len();
    let mut pages = Vec::new();
    for (number, content) in parts.into_iter().enumerate() {
        let factor = needed(&content).max(common.unwrap_or(1000));
        let scaled = |length: i64| (length * factor + 999) / 1000;
        let mut page = Picture {
            width: scaled(pixels(size.0)),
            height: scaled(pixels(size.1)),
            title: picture.title.clone(),
            marks: Vec::new(),
        };
        let (width, height) = (page.width, page.height);
        page.put(content, scaled(MARGIN), scaled(MARGIN));
        let block = title_block(title, (number + 1, n_pages), width - 2 * scaled(MARGIN));
        let y = height - scaled(MARGIN) - block.height;
        page.put(block, scaled(MARGIN), y);
        (page.width, page.height) = (width, height);
        pages.push(Page { picture: page, size, percent: 100_000 / factor });
    }
    pages
}

/// The cuts of a drawing.
struct Grid<'a> {
    downs: Vec<Cut<'a>>,
    /// The rows of pages, and the cuts of each.
    rows: Vec<(Range<i64>, Vec<Cut<'a>>)>,
    width: i64,
}

impl<'a> Grid<'a> {
    /// The cuts into parts of at most the size `room`, if that is possible.
    fn new(picture: &'a Picture, room: (i64, i64)) -> Self {
        let (mut downs, mut rows) = (Vec::new(), Vec::new());
        if picture.height > room.1 {
            let all = candidates(picture, Axis::Down, &(0..picture.width));
            let high = |cut: Option<&Cut<'_>>| cut.map_or(0, height);
            let size = |above: Option<&Cut<'_>>, below: Option<&Cut<'_>>, net: i64| {
                net + high(above) + high(below)
            };
            downs = division(&all, picture.height, room.1, size);
        }
        let ends = downs.iter().map(|cut| cut.at).chain([picture.height]);
        let mut top = 0;
        for end in ends {
            let row = top..end;
            top = end;
            let mut cuts = Vec::new();
            if picture.width > room.0 {
                let all = candidates(picture, Axis::Right, &row);
                let wide = |cut: Option<&Cut<'_>>| cut.map_or(0, side_width);
                let size = |left: Option<&Cut<'_>>, right: Option<&Cut<'_>>, net: i64| {
                    net + wide(left) + wide(right)
                };
                cuts = division(&all, picture.width, room.0, size);
            }
            rows.push((row, cuts));
        }
        Grid { downs, rows, width: picture.width }
    }

    fn n_links(&self) -> usize {
        let all = self.rows.iter().flat_map(|(_, cuts)| cuts).chain(&self.downs);
        all.map(|cut| cut.links.len()).sum()
    }

    /// The number of the page of a column in a row, from 1.
    fn page(&self, row: usize, x: i64) -> usize {
        let before: usize = self.rows.iter().take(row).map(|(_, cuts)| cuts.len() + 1).sum();
        let cuts = self.rows.get(row).map_or(0, |(_, cuts)| cuts.partition_point(|it| it.at < x));
        before + cuts + 1
    }

    /// The parts of a drawing with their marks.
    fn parts(&self, picture: &Picture) -> Vec<Picture> {
        let mut parts = Vec::new();
        for (row, (high, cuts)) in self.rows.iter().enumerate() {
            for column in 0..=cuts.len() {
                let left = column.checked_sub(1).and_then(|left| cuts.get(left));
                let right = cuts.get(column);
                let wide = left.map_or(0, |cut| cut.at)..right.map_or(self.width, |cut| cut.at);
                let at = |cut: &Cut<'a>| {
                    let links = cut.links.iter().filter(|(x, _)| wide.contains(x));
                    Cut { at: cut.at, links: links.copied().collect() }
                };
                let above = row.checked_sub(1).and_then(|above| self.downs.get(above)).map(at);
                let below = self.downs.get(row).map(at);
                let number = self.page(row, wide.end);
                let (top, bottom) = (above.as_ref().map_or(0, height), below.as_ref());
                let margin = left.map_or(0, side_width);
                let mut out = part(picture, &wide, high);
                out.shift(margin - wide.start, top - high.start);
                (out.width, out.height) =
                    (margin + wide.end - wide.start, top + high.end - high.start);
                let end = out.width;
                let bounds = top..out.height;
                let shift = (margin - wide.start, top - high.start);
                if let Some(cut) = &above {
                    let pages = |x| self.page(row.saturating_sub(1), x);
                    marks(&mut out, cut, shift.0, (top, -1), pages);
                }
                if let Some(cut) = bottom {
                    let y = out.height;
                    marks(&mut out, cut, shift.0, (y, 1), |x| self.page(row + 1, x));
                    out.height += height(cut);
                }
                if let Some(cut) = left {
                    side_marks(&mut out, cut, (margin, -1), (shift.1, &bounds), number - 1);
                }
                if let Some(cut) = right {
                    side_marks(&mut out, cut, (end, 1), (shift.1, &bounds), number + 1);
                }
                parts.push(out);
            }
        }
        parts
    }
}

/// The pixels of a length in tenths of a millimetre.
fn pixels(tenths: i64) -> i64 {
    tenths * 96 / 254
}

/// By how much a length is too long for a space, in thousandths; at least 1000.
fn thousandths(length: i64, space: i64) -> i64 {
    ((length * 1000 + space - 1) / space.max(1)).max(1000)
}

/// The mark of a link: its step, and the page of the other end.
fn label(step: &str, page: usize) -> String {
    format!("{step} / page {page}")
}

/// The width of the mark of a link.
fn label_width(step: &str) -> i64 {
    width(&label(step, 999), Font::Small.size())
}

/// The row of the mark of each link, counted from the drawing: below or above a mark, no other link is in its way.
fn rows(cut: &Cut<'_>) -> Vec<i64> {
    let mut rows = vec![0; cut.links.len()];
    for (index, (x, step)) in cut.links.iter().enumerate().rev() {
        let end = x + 5 + label_width(step) + 4;
        let right = cut.links.iter().enumerate().skip(index + 1);
        let in_the_way = right.take_while(|(_, (other, _))| *other < end);
        rows[index] = in_the_way.map(|(other, _)| rows[other] + 1).max().unwrap_or(0);
    }
    rows
}

/// The height of the marks on each side of a cut between two rows of pages.
fn height(cut: &Cut<'_>) -> i64 {
    rows(cut).into_iter().max().map_or(0, |last| (last + 1) * ROW + GAP)
}

/// The width of the marks on each side of a cut in a row of pages.
fn side_width(cut: &Cut<'_>) -> i64 {
    cut.links.iter().map(|(_, step)| LEAD + 4 + label_width(step)).max().unwrap_or(0)
}

/// The shapes of a part of a drawing.
fn part(picture: &Picture, wide: &Range<i64>, high: &Range<i64>) -> Picture {
    let mut out = Picture::default();
    for mark in &picture.marks {
        let (left, top, right, bottom) = mark.bounds();
        if right < wide.start || wide.end < left || bottom < high.start || high.end < top {
            continue;
        }
        let (from, to) = (left.max(wide.start), right.min(wide.end));
        let (first, last) = (top.max(high.start), bottom.min(high.end));
        let is_whole = (from, to, first, last) == (left, right, top, bottom);
        let is_link = mark.link.is_some() && matches!(mark.shape, Shape::Line { .. });
        if !is_whole && is_link {
            let shape = Shape::Line { from: (from, first), to: (to, last), pen: Pen::Line };
            out.marks.push(Mark { shape, ..mark.clone() });
        } else if !is_whole && matches!(mark.shape, Shape::Rect { pen: Pen::Frame, .. }) {
            // The sides that are on this page.
            for x in [left, right].into_iter().filter(|x| wide.contains(x)) {
                out.line((x, first), (x, last), Pen::Frame);
            }
            for y in [top, bottom].into_iter().filter(|y| high.contains(y)) {
                out.line((from, y), (to, y), Pen::Frame);
            }
        } else {
            out.marks.push(mark.clone());
        }
    }
    out
}

/// The ends of the links at a cut, from its height on upwards (-1) or downwards (1), with the step and the page of the other end.
fn marks(
    out: &mut Picture,
    cut: &Cut<'_>,
    shift: i64,
    (y, way): (i64, i64),
    page: impl Fn(i64) -> usize,
) {
    for ((at, step), row) in cut.links.iter().zip(rows(cut)) {
        let x = at + shift;
        let end = y + way * (GAP / 2 + row * ROW + ROW / 2);
        out.line((x, y), (x, end), Pen::Line);
        out.line((x - 4, end), (x + 4, end), Pen::Detail);
        let wide = out.text((x + 7, end + 4), &label(step, page(*at)), Font::Small);
        out.width = out.width.max(x + 7 + wide);
    }
}

/// The ends of the links at a cut, from its column on to the left (-1) or to the right (1). The marks are beside their links, or as near as there is space for
/// all of them in `bounds`.
fn side_marks(
    out: &mut Picture,
    cut: &Cut<'_>,
    (x, way): (i64, i64),
    (shift, bounds): (i64, &Range<i64>),
    page: usize,
) {
    let mut heights: Vec<i64> = Vec::new();
    for (at, _) in &cut.links {
        let free = heights.last().map_or(bounds.start + ROW / 2, |last| last + ROW);
        heights.push(free.max(at + shift));
    }
    let mut free = bounds.end.max(bounds.start + ROW * count(cut.links.len())) - ROW / 2;
    for height in heights.iter_mut().rev() {
        *height = free.min(*height);
        free = *height - ROW;
    }
    for ((at, step), height) in cut.links.iter().zip(heights) {
        let label = label(step, page);
        let end = x + way * LEAD;
        out.line((x, at + shift), (end, height), Pen::Line);
        out.line((end, height - 4), (end, height + 4), Pen::Detail);
        let wide = width(&label, Font::Small.size());
        let left = if way > 0 { end + 3 } else { end - 3 - wide };
        out.text((left, height + 4), &label, Font::Small);
        out.width = out.width.max(left + wide);
    }
}

fn count(n: usize) -> i64 {
    i64::try_from(n).unwrap_or(i64::MAX / 1000)
}

/// The title block, at most `most` pixels wide if that is possible.
fn title_block(title: &TitleBlock, (number, n_pages): (usize, usize), most: i64) -> Picture {
    let page = ("page".to_owned(), format!("{number} of {n_pages}"));
    let mut block = Picture::default();
    let mut x = 0;
    let height = 32;
    let cells: Vec<&(String, String)> = title.cells.iter().chain([&page]).collect();
    for (index, (label, text)) in cells.iter().enumerate() {
        let small = Font::Small;
        let text = cut(text, Font::Normal.size(), LONGEST_TEXT);
        let wide = width(label, small.size()).max(width(&text, Font::Normal.size())) + 12;
        // The last cell ends at the right margin.
        let wide = if index + 1 == cells.len() { wide.max(most - x) } else { wide };
        block.rect((x, 0), (wide, height), Pen::Detail);
        block.text((x + 6, 12), label, small);
        block.text((x + 6, 27), &text, Font::Normal);
        x += wide;
    }
    (block.width, block.height) = (x, height);
    block
}
