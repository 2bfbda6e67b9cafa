//! A drawing on several sheets of paper.
//!
//! A drawing that is larger than the paper is cut into rows of pages, and each row between symbols from left to right, where only links cross the cuts, or made
//! smaller as long as it can be read. Each end of such a link has a mark with the step that the link belongs to and the page of the other end; it is not drawn on
//! the pages between. Parts that are narrow enough are columns of one page, and a line joins a link from one column to the next. A page on which a frame goes on has its heading again (`continued`). Only a part without a place for a cut is made smaller than that.

use crate::columns::{Column, Need, Place, beside, pack};
use crate::continued::{self, Frame};
use crate::ends::{
    End, Target, draw as draw_ends, draw_sides, height, label_end, labels, side_width,
};
use crate::grid::{Axis, Cut, Link, candidates, division, used};
use crate::picture::{Font, Mark, Pen, Picture, Shape, Way};
use crate::text::{cut, width};
use grafsynth_ir::net::{Evolution, Net};
use std::collections::BTreeSet;
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
    /// True if a line joins both ends, because they are in columns beside each other.
    is_drawn: bool,
}

/// A row of pages, or a column of a page.
struct Row<'a> {
    high: Range<i64>,
    wide: Range<i64>,
    above: Vec<Cord<'a>>,
    below: Vec<Cord<'a>>,
    cuts: Vec<Cut<'a>>,
    place: Place,
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
                    let links = || cut.links.iter().filter(is_here);
                    let labels = labels(links().map(|link| (link.step, Target::WIDEST)));
                    let end = |(link, label): (&Link<'_>, String)| End {
                        x: link.place,
                        label: Some(label),
                        leads_up: false,
                    };
                    links().zip(labels).map(end).collect::<Vec<_>>()
                };
                let first = ends(above, &|link| link.to <= below.at);
                let last = ends(below, &|link| link.from >= above.at);
                let high = above.resume..below.at;
                let headings = continued::height(&frames, &(0..picture.width), &high);
                let marks = height(&first, false) + height(&last, true);
                (headings + high.end - high.start + marks, last.len())
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
                    let marks = side_width(left, LAST_PAGE) + side_width(right, LAST_PAGE);
                    (right.at - left.resume + marks, right.links.len())
                });
            }
            let (above, below, place) = (Vec::new(), Vec::new(), Place::default());
            rows.push(Row { high, wide, above, below, cuts, place });
        }
        let mut grid = Grid { rows, frames };
        grid.find_cords(picture, &downs);
        grid.find_columns(picture, room);
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
                let cord = |other| Cord { x, step, other, leads_up, is_drawn: false };
                self.rows[first].below.push(cord(last));
                self.rows[last].above.push(cord(first));
            }
        }
        for cords in self.rows.iter_mut().flat_map(|row| [&mut row.above, &mut row.below]) {
            cords.sort_unstable();
            cords.dedup();
        }
    }

    /// Puts rows that are narrow enough beside each other, as columns of one page.
    fn find_columns(&mut self, picture: &Picture, room: (i64, i64)) {
        let has_rows = self.rows.len() > 1;
        let used = |row: &Row<'_>| match has_rows {
            true => used(picture, Axis::Right, &row.high),
            false => row.wide.clone(),
        };
        let wide: Vec<Range<i64>> = self.rows.iter().map(used).collect();
        (1..self.rows.len()).for_each(|index| self.draw_links(index, room.1));
        let need = |(row, wide): (&Row<'a>, &Range<i64>)| {
            let headings = continued::widest(&self.frames, wide, &row.high);
            let width = |has_next: bool, has_before: bool| {
                let is_mark = |cord: &&Cord<'_>, is_near| !(cord.is_drawn && is_near);
                let above = row.above.iter().filter(|cord| is_mark(cord, has_before));
                let below = row.below.iter().filter(|cord| is_mark(cord, has_next));
                let marks = above.chain(below).map(|cord| room_of_mark(cord) - wide.start).max();
                (wide.end - wide.start).max(headings).max(marks.unwrap_or(0))
            };
            let widths = [false, true].map(|next| [width(next, false), width(next, true)]);
            let n_drawn = row.below.iter().filter(|cord| cord.is_drawn).count();
            Need { n_pages: row.cuts.len() + 1, width: widths, n_drawn }
        };
        let needs: Vec<Need> = self.rows.iter().zip(&wide).map(need).collect();
        for ((row, wide), place) in self.rows.iter_mut().zip(wide).zip(pack(&needs, room.0)) {
            row.place = place;
            if place.n_columns > 1 {
                row.wide = wide;
            }
            let is_first = place.column == 1;
            row.above.iter_mut().for_each(|cord| cord.is_drawn &= !is_first);
            let is_last = place.column == place.n_columns;
            row.below.iter_mut().for_each(|cord| cord.is_drawn &= !is_last);
        }
    }

    /// Decides which links from the row before are drawn if both are on one page: those without a mark in their way above the row, if there is room.
    fn draw_links(&mut self, index: usize, room: i64) {
        let mut end = i64::MIN;
        let mut drawn = BTreeSet::new();
        for cord in &self.rows[index].above {
            if cord.other + 1 == index && end < cord.x {
                drawn.insert((cord.x, cord.step));
            } else {
                end = room_of_mark(cord);
            }
        }
        let mut set = |is_drawn: bool| {
            let is_it = |cord: &&mut Cord<'_>| drawn.contains(&(cord.x, cord.step));
            let before = self.rows[index - 1].below.iter_mut().filter(is_it);
            before.filter(|cord| cord.other == index).for_each(|cord| cord.is_drawn = is_drawn);
            let above = self.rows[index].above.iter_mut().filter(is_it);
            above.filter(|cord| cord.other + 1 == index).for_each(|cord| cord.is_drawn = is_drawn);
            self.height(index - 1).max(self.height(index))
        };
        if set(true) > room {
            set(false);
        }
    }

    /// The height of a row with its marks.
    fn height(&self, index: usize) -> i64 {
        let row = &self.rows[index];
        let ends = |cords: &[Cord<'a>], is_below| height(&self.ends(index, cords), is_below);
        let headings = continued::height(&self.frames, &row.wide, &row.high);
        headings + row.high.end - row.high.start + ends(&row.above, false) + ends(&row.below, true)
    }

    /// The number of links that are cut.
    fn n_links(&self) -> usize {
        let n_sides = |row: &Row<'_>| row.cuts.iter().map(|cut| cut.links.len()).sum::<usize>();
        let n_below = |row: &Row<'_>| row.below.iter().filter(|cord| !cord.is_drawn).count();
        self.rows.iter().map(|row| n_below(row) + n_sides(row)).sum()
    }

    /// The number of the page of a column in a row, from 1.
    fn page(&self, row: usize, x: i64) -> usize {
        let Some(row) = self.rows.get(row) else { return 0 };
        row.place.page + row.cuts.partition_point(|it| it.at < x)
    }

    /// The place of the other end of a link, as it is named in a row.
    fn target(&self, row: usize, cord: &Cord<'_>) -> Target {
        let page = self.page(cord.other, cord.x);
        match self.rows.get(cord.other).map(|row| row.place) {
            // The places are not known yet.
            Some(Place { n_columns: 0, .. }) => Target::WIDEST,
            Some(Place { column, n_columns, .. }) if n_columns > 1 => {
                if page == self.page(row, cord.x) {
                    Target::Column(column)
                } else {
                    Target::PageColumn(page, column)
                }
            }
            _ => Target::Page(page),
        }
    }

    /// The ends of links of a row with their marks.
    fn ends(&self, row: usize, cords: &[Cord<'a>]) -> Vec<End> {
        let marked = cords.iter().filter(|cord| !cord.is_drawn);
        let mut labels = labels(marked.map(|cord| (cord.step, self.target(row, cord)))).into_iter();
        let end = |cord: &Cord<'_>| {
            let label = if cord.is_drawn { None } else { labels.next() };
            End { x: cord.x, label, leads_up: cord.leads_up }
        };
        cords.iter().map(end).collect()
    }

    /// The parts of a drawing with their marks, one for each page.
    fn parts(&self, picture: &Picture) -> Vec<Picture> {
        let mut parts = Vec::new();
        let mut columns = Vec::new();
        for (number, row) in self.rows.iter().enumerate() {
            let ends = row.cuts.iter().map(Some).chain([None]);
            let starts = [None].into_iter().chain(row.cuts.iter().map(Some));
            for (left, right) in starts.zip(ends) {
                columns.push(self.part(picture, row, (left, right), number));
                if row.place.column == row.place.n_columns {
                    parts.push(beside(std::mem::take(&mut columns)));
                }
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
    ) -> Column {
        let start = left.map_or(row.wide.start, |cut| cut.resume);
        let wide = start..right.map_or(row.wide.end, |cut| cut.at);
        let page = self.page(number, wide.end);
        let here = |cords: &[Cord<'a>]| -> Vec<Cord<'a>> {
            cords.iter().filter(|cord| wide.contains(&cord.x)).copied().collect()
        };
        let (ends_above, ends_below) =
            (self.ends(number, &here(&row.above)), self.ends(number, &here(&row.below)));
        let mut out = shapes(picture, &wide, &row.high);
        let headings = continued::headings(&mut out, &self.frames, &wide, &row.high);
        let top = headings.height + height(&ends_above, false);
        let left_width = left.map_or(0, |cut| side_width(cut, LAST_PAGE));
        let origin = (left_width - wide.start, top - row.high.start);
        out.shift(origin.0, origin.1);
        let (end, bottom) = (origin.0 + wide.end, origin.1 + row.high.end);
        out.width = end.max(out.width + origin.0);
        out.height = bottom + height(&ends_below, true);
        out.put(headings, origin.0 + wide.start, 0);
        let above = draw_ends(&mut out, &ends_above, (origin.0, top), false);
        let below = draw_ends(&mut out, &ends_below, (origin.0, bottom), true);
        let bounds = top..bottom;
        for (cut, x, way) in [(left, origin.0 + wide.start, -1), (right, end, 1)] {
            let other = if way > 0 { page + 1 } else { page - 1 };
            if let Some(cut) = cut {
                draw_sides(&mut out, cut, (x, way), (origin.1, &bounds), other);
            }
        }
        let drawn = ends_below.iter().filter(|end| end.label.is_none()).map(|end| end.leads_up);
        Column { picture: out, above, below: below.into_iter().zip(drawn).collect() }
    }
}

/// The right end of the widest mark that a link can have.
fn room_of_mark(cord: &Cord<'_>) -> i64 {
    label_end(cord.x, &format!("{} (9) / {}", cord.step, Target::WIDEST))
}

/// The pixels of a length in tenths of a millimetre.
fn pixels(tenths: i64) -> i64 {
    tenths * 96 / 254
}

/// By how much a length is too long for a space, in thousandths; at least 1000.
fn thousandths(length: i64, space: i64) -> i64 {
    ((length * 1000 + space - 1) / space.max(1)).max(1000)
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
