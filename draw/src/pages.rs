//! A drawing on several sheets of paper.
//!
//! A drawing that is larger than the paper is cut into rows of pages, and each row between symbols from left to right, where only links cross the cuts, or made
//! smaller as long as it can be read. Each end of such a link has a mark with the step that the link belongs to and the page of the other end; it is not drawn on
//! the pages between. A page on which a frame goes on has its heading again (`continued`). Only a part without a place for a cut is made smaller than that.

use crate::continued::{self, Frame};
use crate::grid::{Axis, Cut, Link, candidates, division, used};
use crate::picture::{Font, Mark, Pen, Picture, Shape, Way};
use crate::text::{cut, width};
use grafsynth_ir::net::{Evolution, Net};
use std::collections::{BTreeMap, BTreeSet};
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

    /// The width of a drawing at its full size on a page in landscape.
    pub(crate) fn widest(self) -> i64 {
        pixels(self.size().1) - 2 * MARGIN
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

/// The page for which marks have room.
const LAST_PAGE: usize = 999;

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
        // By how much parts without a place for a cut are too small to be read.
        let too_small: i64 =
            parts.iter().map(|part| (needed(part, (wide, high)) - READABLE).max(0)).sum();
        ((too_small, grid.n_links(), parts.len()), size, parts)
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

/// A link that ends at a border of a row of pages: its column, its step, the row of the other end, and if it has an arrow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Cord<'a> {
    x: i64,
    step: &'a str,
    other: usize,
    leads_up: bool,
}

/// A row of pages.
struct Row<'a> {
    high: Range<i64>,
    wide: Range<i64>,
    above: Vec<Cord<'a>>,
    below: Vec<Cord<'a>>,
    cuts: Vec<Cut<'a>>,
}

/// The rows of pages of a drawing.
struct Grid<'a> {
    rows: Vec<Row<'a>>,
    frames: Vec<Frame<'a>>,
}

impl<'a> Grid<'a> {
    /// The cuts into parts of at most the size `room`, if that is possible.
    fn new(picture: &'a Picture, room: (i64, i64)) -> Self {
        let frames = continued::frames(picture);
        let mut downs = Vec::new();
        if picture.height > room.1 {
            let all = candidates(picture, Axis::Down, &(0..picture.width));
            downs = division(&all, &(0..picture.height), room.1, |above, below| {
                // The links that do not only pass.
                let ends = |cut: &Cut<'a>, is_here: &dyn Fn(&&Link<'a>) -> bool| {
                    let links = cut.links.iter().filter(is_here);
                    labels(links.map(|link| (link.place, link.step, LAST_PAGE)))
                };
                let first = ends(above, &|link| link.to <= below.at);
                let last = ends(below, &|link| link.from >= above.at);
                let high = above.resume..below.at;
                let headings = continued::height(&frames, &(0..picture.width), &high);
                (headings + high.end - high.start + height(&first) + height(&last), last.len())
            });
        }
        let starts = [0].into_iter().chain(downs.iter().map(|cut| cut.resume));
        let ends = downs.iter().map(|cut| cut.at).chain([picture.height]);
        let mut rows: Vec<Row<'a>> = Vec::new();
        for (start, end) in starts.zip(ends) {
            let high = start..end;
            let (mut cuts, mut wide) = (Vec::new(), 0..picture.width);
            if picture.width > room.0 {
                wide = used(picture, Axis::Right, &high);
                let all = candidates(picture, Axis::Right, &high);
                cuts = division(&all, &wide, room.0, |left, right| {
                    (
                        right.at - left.resume + side_width(left) + side_width(right),
                        right.links.len(),
                    )
                });
            }
            rows.push(Row { high, wide, above: Vec::new(), below: Vec::new(), cuts });
        }
        let mut grid = Grid { rows, frames };
        grid.find_cords(picture, &downs);
        grid
    }

    /// Finds the links from one row to another one.
    fn find_cords(&mut self, picture: &'a Picture, downs: &[Cut<'_>]) {
        let arrows: BTreeSet<(i64, i64)> = { picture.marks.iter() }
            .filter_map(|mark| match mark.shape {
                Shape::Arrow { x, y, way: Way::Up } => Some((x, y)),
                _ => None,
            })
            .collect();
        for Link { place: x, step, from, to } in
            picture.marks.iter().filter_map(|mark| Axis::Down.link(mark))
        {
            let first = downs.partition_point(|cut| cut.at <= from);
            let last = downs.partition_point(|cut| cut.at < to);
            if first < last {
                let leads_up = arrows.range((x, from)..=(x, to)).next().is_some();
                self.rows[first].below.push(Cord { x, step, other: last, leads_up });
                self.rows[last].above.push(Cord { x, step, other: first, leads_up });
            }
        }
        for cords in self.rows.iter_mut().flat_map(|row| [&mut row.above, &mut row.below]) {
            cords.sort_unstable();
            cords.dedup();
        }
    }

    /// The number of links that are cut.
    fn n_links(&self) -> usize {
        let n_sides = |row: &Row<'_>| row.cuts.iter().map(|cut| cut.links.len()).sum::<usize>();
        self.rows.iter().map(|row| row.below.len() + n_sides(row)).sum()
    }

    /// The number of the page of a column in a row, from 1.
    fn page(&self, row: usize, x: i64) -> usize {
        let before: usize = self.rows.iter().take(row).map(|row| row.cuts.len() + 1).sum();
        let cuts = self.rows.get(row).map_or(0, |row| row.cuts.partition_point(|it| it.at < x));
        before + cuts + 1
    }

    /// The parts of a drawing with their marks.
    fn parts(&self, picture: &Picture) -> Vec<Picture> {
        let mut parts = Vec::new();
        for (number, row) in self.rows.iter().enumerate() {
            let ends = row.cuts.iter().map(Some).chain([None]);
            let starts = [None].into_iter().chain(row.cuts.iter().map(Some));
            for (left, right) in starts.zip(ends) {
                parts.push(self.part(picture, row, (left, right), number));
            }
        }
        parts
    }

    /// The part of a row between two cuts.
    fn part(
        &self,
        picture: &Picture,
        row: &Row<'a>,
        (left, right): (Option<&Cut<'a>>, Option<&Cut<'a>>),
        number: usize,
    ) -> Picture {
        let start = left.map_or(row.wide.start, |cut| cut.resume);
        let wide = start..right.map_or(row.wide.end, |cut| cut.at);
        let page = self.page(number, wide.end);
        let here = |cords: &[Cord<'a>]| -> Vec<Cord<'a>> {
            cords.iter().filter(|cord| wide.contains(&cord.x)).copied().collect()
        };
        let (above, below) = (here(&row.above), here(&row.below));
        let named = |cords: &[Cord<'a>]| {
            labels(cords.iter().map(|cord| (cord.x, cord.step, self.page(cord.other, cord.x))))
        };
        let (names_above, names_below) = (named(&above), named(&below));
        let mut out = shapes(picture, &wide, &row.high);
        let headings = continued::headings(&mut out, &self.frames, &wide, &row.high);
        let top = headings.height + height(&names_above);
        let origin = (left.map_or(0, side_width) - wide.start, top - row.high.start);
        out.shift(origin.0, origin.1);
        let (end, bottom) = (origin.0 + wide.end, origin.1 + row.high.end);
        (out.width, out.height) = (end.max(out.width + origin.0), bottom + height(&names_below));
        out.put(headings, origin.0 + wide.start, 0);
        for (cords, names, y, way) in
            [(above, names_above, top, -1), (below, names_below, bottom, 1)]
        {
            for ((cord, (x, label)), row) in cords.iter().zip(&names).zip(rows(&names)) {
                let away = way * (GAP + row * ROW);
                mark(&mut out, label, (x + origin.0, y), away, cord.leads_up);
            }
        }
        let bounds = top..bottom;
        for (cut, x, way) in [(left, origin.0 + wide.start, -1), (right, end, 1)] {
            let other = if way > 0 { page + 1 } else { page - 1 };
            if let Some(cut) = cut {
                side_marks(&mut out, cut, (x, way), (origin.1, &bounds), other);
            }
        }
        out
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

/// The places of links at a border with their marks: the step, and the page of the other end. If several links of a step lead to that page, they are numbered
/// in their order, which is the same on both pages.
fn labels<'a>(links: impl Iterator<Item = (i64, &'a str, usize)>) -> Vec<(i64, String)> {
    let links: Vec<_> = links.collect();
    let mut numbers: BTreeMap<(&str, usize), (usize, usize)> = BTreeMap::new();
    for (_, step, page) in &links {
        numbers.entry((step, *page)).or_default().1 += 1;
    }
    let label = |(place, step, page): &(i64, &'a str, usize)| {
        let (number, all) = numbers.entry((step, *page)).or_default();
        *number += 1;
        let number = if *all > 1 { format!(" ({number})") } else { String::new() };
        (*place, format!("{step}{number} / page {page}"))
    };
    links.iter().map(label).collect()
}

/// The marks of the links at a cut in a row of pages; those of its other side have another page.
fn side_labels(cut: &Cut<'_>, page: usize) -> Vec<(i64, String)> {
    labels(cut.links.iter().map(|link| (link.place, link.step, page)))
}

/// The width of the mark of a link.
fn label_width(label: &str) -> i64 {
    width(label, Font::Small.size())
}

/// The row of the mark of each link, counted from the drawing: below or above a mark, no other link is in its way.
fn rows(links: &[(i64, String)]) -> Vec<i64> {
    let mut rows = vec![0; links.len()];
    for (index, (x, label)) in links.iter().enumerate().rev() {
        let end = x + 5 + label_width(label) + 4;
        let right = links.iter().enumerate().skip(index + 1);
        let in_the_way = right.take_while(|(_, (other, _))| *other < end);
        rows[index] = in_the_way.map(|(other, _)| rows[other] + 1).max().unwrap_or(0);
    }
    rows
}

/// The height of the marks at a border of a row of pages.
fn height(links: &[(i64, String)]) -> i64 {
    rows(links).into_iter().max().map_or(0, |last| (last + 1) * ROW + GAP)
}

/// The width of the marks on each side of a cut in a row of pages.
fn side_width(cut: &Cut<'_>) -> i64 {
    let labels = side_labels(cut, LAST_PAGE);
    labels.iter().map(|(_, label)| LEAD + 4 + label_width(label)).max().unwrap_or(0)
}

/// The shapes of a part of a drawing.
fn shapes(picture: &Picture, wide: &Range<i64>, high: &Range<i64>) -> Picture {
    let passes = |link: &Link<'_>| link.from < high.start && high.end < link.to;
    let links = picture.marks.iter().filter_map(|mark| Axis::Down.link(mark));
    let passing: BTreeSet<i64> = links.filter(passes).map(|link| link.place).collect();
    let mut out = Picture::default();
    for mark in &picture.marks {
        let (left, top, right, bottom) = mark.bounds();
        if right < wide.start || wide.end < left || bottom < high.start || high.end < top {
            continue;
        }
        let is_passing = match mark.shape {
            Shape::Arrow { x, .. } | Shape::Crossing { x, .. } => passing.contains(&x),
            _ => Axis::Down.link(mark).as_ref().is_some_and(passes),
        };
        if is_passing {
            continue;
        }
        let (from, to) = (left.max(wide.start), right.min(wide.end));
        let (first, last) = (top.max(high.start), bottom.min(high.end));
        let is_whole = (from, to, first, last) == (left, right, top, bottom);
        let is_link = mark.link.is_some() && matches!(mark.shape, Shape::Line { .. });
        if !is_whole && is_link && (from, first) == (to, last) {
            // It only touches this page.
            continue;
        }
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

/// The end of a link at the border of a row, as far away as its row of marks; upwards if that is negative.
fn mark(out: &mut Picture, label: &str, (x, y): (i64, i64), away: i64, leads_up: bool) {
    let end = y + away + away.signum() * (ROW - GAP) / 2;
    out.line((x, y), (x, end), Pen::Line);
    out.line((x - 4, end), (x + 4, end), Pen::Detail);
    if leads_up {
        out.add(Shape::Arrow { x, y: y.min(end + 4) - 2, way: Way::Up });
    }
    let wide = out.text((x + 7, end + 4), label, Font::Small);
    out.width = out.width.max(x + 7 + wide);
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
    for Link { place: at, .. } in &cut.links {
        let free = heights.last().map_or(bounds.start + ROW / 2, |last| last + ROW);
        heights.push(free.max(at + shift));
    }
    let mut free = bounds.end.max(bounds.start + ROW * count(cut.links.len())) - ROW / 2;
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
