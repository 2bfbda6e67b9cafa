//! A drawing on several sheets of paper.
//!
//! A drawing that is wider than the paper is made smaller. One that is higher is cut between symbols, where only links cross the cut, or made smaller as long as
//! it can be read. Each end of such a link has a mark with the step that the link belongs to and the page of the other end. A part without a place for a cut is
//! made smaller, too.

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
/// The number of rows of marks from which a cut counts as impossible if there is another one.
const MOST_ROWS: i64 = 10;

/// How much smaller a drawing may be, in thousandths: its smallest letters, of 11 pixels, still have 7 points.
const READABLE: i64 = 1176;

/// Divides a drawing into pages of one size, in portrait unless the drawing is wider than that. It is made smaller, as long as it can be read, if this cuts
/// fewer links.
#[must_use]
pub fn pages(picture: &Picture, paper: Paper, title: &TitleBlock) -> Vec<Page> {
    let (short, long) = paper.size();
    let is_wide = picture.width > pixels(short) - 2 * MARGIN;
    let size = if is_wide { (long, short) } else { (short, long) };
    let inner = (pixels(size.0) - 2 * MARGIN, pixels(size.1) - 2 * MARGIN - BLOCK);
    let by_width = thousandths(picture.width, inner.0);
    let all = [by_width, by_width.max(READABLE)].map(|most| cuts(picture, inner.1 * most / 1000));
    let n_links = |cuts: &Vec<Cut<'_>>| cuts.iter().map(|cut| cut.links.len()).sum::<usize>();
    let cuts = all.into_iter().min_by_key(n_links).unwrap_or_default();
    let parts = parts(picture, &cuts);
    let needed = |part: &Picture| {
        by_width.max(thousandths(part.width, inner.0)).max(thousandths(part.height, inner.1))
    };
    // The parts without a place for a cut do not make the other pages smaller.
    let common = parts.iter().map(needed).filter(|factor| *factor <= READABLE).max();
    let n_pages = parts.len();
    let mut pages = Vec::new();
    for (number, content) in parts.into_iter().enumerate() {
        let factor = needed(&content).max(common.unwrap_or(by_width));
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

/// The parts of a drawing between the cuts, with their marks.
fn parts(picture: &Picture, cuts: &[Cut<'_>]) -> Vec<Picture> {
    let mut ends = vec![0];
    ends.extend(cuts.iter().map(|cut| cut.y));
    ends.push(picture.height);
    let cut = |number: Option<usize>| number.and_then(|number| cuts.get(number));
    { ends.windows(2).enumerate() }
        .map(|(number, pair)| {
            let (above, below) = (cut(number.checked_sub(1)), cut(Some(number)));
            part(picture, pair[0]..pair[1], above, below, number + 1)
        })
        .collect()
}

/// The pixels of a length in tenths of a millimetre.
fn pixels(tenths: i64) -> i64 {
    tenths * 96 / 254
}

/// By how much a length is too long for a space, in thousandths; at least 1000.
fn thousandths(length: i64, space: i64) -> i64 {
    ((length * 1000 + space - 1) / space.max(1)).max(1000)
}

/// A place between two pages, with the links that cross it from left to right: the column, and the step.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Cut<'a> {
    y: i64,
    links: Vec<(i64, &'a str)>,
}

impl Cut<'_> {
    /// The mark of a link: its step, and the page of the other end.
    fn label(step: &str, page: usize) -> String {
        format!("{step} / page {page}")
    }

    /// The row of the mark of each link, counted from the drawing: below or above a mark, no other link is in its way.
    fn rows(&self) -> Vec<i64> {
        let mut rows = vec![0; self.links.len()];
        for (index, (x, step)) in self.links.iter().enumerate().rev() {
            let end = x + 5 + width(&Cut::label(step, 999), Font::Small.size()) + 4;
            let right = self.links.iter().enumerate().skip(index + 1);
            let in_the_way = right.take_while(|(_, (other, _))| *other < end);
            rows[index] = in_the_way.map(|(other, _)| rows[other] + 1).max().unwrap_or(0);
        }
        rows
    }

    /// The height of the marks on each side.
    fn height(&self) -> i64 {
        self.rows().into_iter().max().map_or(0, |last| (last + 1) * ROW + GAP)
    }
}

/// The cuts of a drawing into parts of at most `room` pixels, if that is possible.
fn cuts(picture: &Picture, room: i64) -> Vec<Cut<'_>> {
    if picture.height <= room {
        return Vec::new();
    }
    let free = free_places(picture);
    let links = crossing_links(picture, &free);
    let mut cuts: Vec<Cut<'_>> = Vec::new();
    let mut candidates: Vec<Cut<'_>> =
        free.into_iter().zip(links).map(|(y, links)| Cut { y, links }).collect();
    let (mut top, mut above) = (0, 0);
    while picture.height - top + above > room {
        candidates.retain(|cut| cut.y > top);
        let fits = |cut: &&Cut<'_>| cut.y - top + above + cut.height() <= room;
        // Few links, then a full page; the beginning of a page is not a place for a cut if there is another one.
        let cost = |cut: &&Cut<'_>| {
            let n_links = i64::try_from(cut.links.len()).unwrap_or(i64::MAX / 1000);
            let waste = room - (cut.y - top);
            let is_crowded = cut.height() > MOST_ROWS * ROW;
            (is_crowded || waste > room * 3 / 5, n_links * 60 + waste)
        };
        let near = candidates.iter().take_while(|cut| cut.y - top <= room);
        let best = near.filter(fits).min_by_key(cost).or_else(|| {
            // No place on this page: a higher part, which is made smaller.
            candidates.iter().find(|cut| cut.y - top > room / 3)
        });
        let Some(cut) = best else { break };
        (top, above) = (cut.y, cut.height());
        cuts.push(cut.clone());
    }
    cuts
}

/// The middles of the horizontal stripes in which nothing but links and frames is.
fn free_places(picture: &Picture) -> Vec<i64> {
    let mut blocked: Vec<(i64, i64)> = Vec::new();
    for mark in &picture.marks {
        let (_, top, _, bottom) = mark.bounds();
        let is_frame = matches!(mark.shape, Shape::Rect { pen: Pen::Frame, .. });
        if is_frame {
            blocked.extend([(top, top), (bottom, bottom)]);
        } else if link(mark).is_none() {
            blocked.push((top, bottom));
        }
    }
    blocked.sort_unstable();
    let mut places = Vec::new();
    let mut end = 0;
    for (top, bottom) in blocked {
        if top - end >= 6 {
            places.push((top + end) / 2);
        }
        end = end.max(bottom);
    }
    places
}

/// The column, range and step of a vertical link.
fn link(mark: &Mark) -> Option<(i64, Range<i64>, &str)> {
    match &mark.shape {
        Shape::Line { from, to, .. } if from.0 == to.0 => {
            let step = mark.link.as_deref()?;
            Some((from.0, from.1.min(to.1)..from.1.max(to.1), step))
        }
        _ => None,
    }
}

/// The links that cross each of the places, which are in order.
fn crossing_links<'a>(picture: &'a Picture, places: &[i64]) -> Vec<Vec<(i64, &'a str)>> {
    let mut all: Vec<Vec<(i64, &str)>> = vec![Vec::new(); places.len()];
    for (x, range, step) in picture.marks.iter().filter_map(link) {
        let first = places.partition_point(|y| *y <= range.start);
        let last = places.partition_point(|y| *y < range.end);
        for links in all.get_mut(first..last).unwrap_or_default() {
            links.push((x, step));
        }
    }
    all.iter_mut().for_each(|links| {
        links.sort_unstable();
        links.dedup();
    });
    all
}

/// The drawing between two cuts with their marks, from `y` = 0. `number` is that of its page, from 1.
fn part(
    picture: &Picture,
    range: Range<i64>,
    above: Option<&Cut<'_>>,
    below: Option<&Cut<'_>>,
    number: usize,
) -> Picture {
    let mut out = Picture { width: picture.width, ..Picture::default() };
    for mark in &picture.marks {
        let (left, top, right, bottom) = mark.bounds();
        if bottom < range.start || range.end < top {
            continue;
        }
        let mut shape = mark.shape.clone();
        if let Some((x, line, _)) = link(mark) {
            if let Shape::Line { from, to, .. } = &mut shape {
                *from = (x, line.start.max(range.start));
                *to = (x, line.end.min(range.end));
            }
        } else if top < range.start || range.end < bottom {
            // A frame: the sides that are on this page.
            let (from, to) = (top.max(range.start), bottom.min(range.end));
            out.line((left, from), (left, to), Pen::Frame);
            out.line((right, from), (right, to), Pen::Frame);
            for y in [top, bottom].into_iter().filter(|y| range.contains(y)) {
                out.line((left, y), (right, y), Pen::Frame);
            }
            continue;
        }
        out.marks.push(Mark { shape, ..mark.clone() });
    }
    let space = above.map_or(0, Cut::height);
    out.shift(0, space - range.start);
    out.height = space + range.end - range.start;
    if let Some(cut) = above {
        marks(&mut out, cut, number.saturating_sub(1), (space, -1));
    }
    if let Some(cut) = below {
        let y = out.height;
        marks(&mut out, cut, number + 1, (y, 1));
        out.height += cut.height();
    }
    out
}

/// The ends of the links at a cut, from its height on upwards (-1) or downwards (1), with the step and the page of the other end.
fn marks(out: &mut Picture, cut: &Cut<'_>, other: usize, (y, way): (i64, i64)) {
    for ((x, step), row) in cut.links.iter().zip(cut.rows()) {
        let end = y + way * (GAP / 2 + row * ROW + ROW / 2);
        out.line((*x, y), (*x, end), Pen::Line);
        out.line((x - 4, end), (x + 4, end), Pen::Detail);
        let label = Cut::label(step, other);
        let wide = out.text((x + 7, end + 4), &label, Font::Small);
        out.width = out.width.max(x + 7 + wide);
    }
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
