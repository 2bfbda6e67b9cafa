//! Where a drawing is cut into pages: in lines on which nothing but links and frames is, so that few links are cut.

use crate::channels::HALF;
use crate::picture::{Mark, Pen, Picture, Shape};
use crate::sheet::MARGIN;
use std::ops::Range;

/// The least width of a free stripe.
const LEAST: i64 = 6;

/// The distance of a side of a frame from what is in it, up to which it is on the same page.
const NEAR: i64 = 4 * MARGIN;

/// The direction in which pages follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Axis {
    Down,
    Right,
}

/// A part of a link: its place across the axis, its step, and its first and last place along the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Link<'a> {
    pub(crate) place: i64,
    pub(crate) step: &'a str,
    pub(crate) from: i64,
    pub(crate) to: i64,
}

/// A place between two pages, with the links that cross it in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Cut<'a> {
    /// The end of the page before.
    pub(crate) at: i64,
    /// The beginning of the next page; between both is nothing but links that cross.
    pub(crate) resume: i64,
    pub(crate) links: Vec<Link<'a>>,
    /// The number of symbols that begin before this place.
    n_before: usize,
}

impl Axis {
    /// The first and the last place of a mark along the axis, and across it.
    fn extent(self, mark: &Mark) -> [(i64, i64); 2] {
        let (left, top, right, bottom) = mark.bounds();
        match self {
            Axis::Down => [(top, bottom), (left, right)],
            Axis::Right => [(left, right), (top, bottom)],
        }
    }

    fn across(self) -> Axis {
        match self {
            Axis::Down => Axis::Right,
            Axis::Right => Axis::Down,
        }
    }

    /// True for a link that leads along the axis through the whole band, and is not drawn there.
    fn passes(self, mark: &Mark, band: &Range<i64>) -> bool {
        self.link(mark).is_some_and(|link| link.from < band.start && band.end < link.to)
    }

    /// The part of a link that a mark is, if it leads along the axis.
    pub(crate) fn link(self, mark: &Mark) -> Option<Link<'_>> {
        let step = mark.link.as_deref()?;
        let [(from, to), (place, other)] = self.extent(mark);
        let is_line = matches!(mark.shape, Shape::Line { .. });
        (is_line && place == other).then_some(Link { place, step, from, to })
    }
}

/// All cuts that are possible in the part of a drawing that is in `band` across the axis.
pub(crate) fn candidates<'a>(picture: &'a Picture, axis: Axis, band: &Range<i64>) -> Vec<Cut<'a>> {
    let is_here = |mark: &&Mark| {
        let [_, (from, to)] = axis.extent(mark);
        from <= band.end && band.start <= to && !axis.across().passes(mark, band)
    };
    let here: Vec<&Mark> = picture.marks.iter().filter(is_here).collect();
    let places = free_places(&here, axis);
    let mut cuts: Vec<Cut<'_>> = { places.iter() }
        .map(|&(at, resume, n_before)| Cut { at, resume, links: vec![], n_before })
        .collect();
    for link in here.iter().filter_map(|mark| axis.link(mark)) {
        let first = places.partition_point(|(at, ..)| *at <= link.from);
        let last = places.partition_point(|(at, ..)| *at < link.to);
        for cut in cuts.get_mut(first..last).unwrap_or_default() {
            cut.links.push(link);
        }
    }
    for cut in &mut cuts {
        cut.links.sort_unstable();
        // Both lines of a double line have one mark, between them.
        cut.links.dedup_by(|link, first| {
            let is_double = axis == Axis::Right && link.place - first.place == 2 * HALF;
            let is_same = link.step == first.step && (is_double || link.place == first.place);
            first.place += if is_same { (link.place - first.place) / 2 } else { 0 };
            is_same
        });
    }
    cuts
}

/// The part across a band that has marks other than links that only pass, with the margin of a drawing on both sides.
pub(crate) fn used(picture: &Picture, axis: Axis, band: &Range<i64>) -> Range<i64> {
    let length = if axis == Axis::Down { picture.height } else { picture.width };
    let is_frame = |mark: &Mark| matches!(mark.shape, Shape::Rect { pen: Pen::Frame, .. });
    let is_here = |mark: &&Mark| {
        let [_, (from, to)] = axis.extent(mark);
        from <= band.end && band.start <= to && !axis.across().passes(mark, band)
    };
    let (frames, drawn): (Vec<&Mark>, Vec<&Mark>) =
        picture.marks.iter().filter(is_here).partition(|mark| is_frame(mark));
    let ends = drawn.into_iter().map(|mark| axis.extent(mark)[0]);
    let ends = ends.reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)));
    let (mut from, mut to) = ends.unwrap_or((0, length));
    // A side of a frame that is far from everything in it needs no paper. Inner frames come last.
    for frame in frames.into_iter().rev() {
        let [(first, last), _] = axis.extent(frame);
        from = if (from - NEAR..from).contains(&first) { first } else { from };
        to = if (to..to + NEAR).contains(&last) { last } else { to };
    }
    (from - MARGIN).max(0)..(to + MARGIN + 1).min(length)
}

/// What no cut crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Blocked {
    /// The first side of a frame, which stays with what follows it.
    FrameStart,
    /// The last side of a frame, which stays with what precedes it.
    FrameEnd,
    /// A symbol with its texts, or a state.
    Content,
    /// A line of a link across the axis: a cut may be before or after it, but it has no page of its own.
    Link,
    /// A heading, a legend, or a sign on a link: it has no page of its own.
    Note,
}

/// The ends and beginnings of pages in the stripes between symbols, which are not crossed by anything but links and frames, with the number of symbols that begin
/// before. A symbol and its texts are one thing.
fn free_places(marks: &[&Mark], axis: Axis) -> Vec<(i64, i64, usize)> {
    let mut blocked: Vec<(i64, i64, Blocked)> = Vec::new();
    for group in marks.chunk_by(|mark, next| mark.element.is_some() && mark.element == next.element)
    {
        let mut whole: Option<(i64, i64)> = None;
        let is_note = group.iter().all(|mark| match mark.shape {
            Shape::Arrow { .. } | Shape::Crossing { .. } => true,
            Shape::Text { .. } => axis == Axis::Down && mark.element.is_none(),
            _ => false,
        });
        let kind = match is_note {
            true => Blocked::Note,
            false if group.iter().all(|mark| mark.link.is_some()) => Blocked::Link,
            false => Blocked::Content,
        };
        for mark in group.iter().filter(|mark| axis.link(mark).is_none()) {
            let [(from, to), _] = axis.extent(mark);
            if matches!(mark.shape, Shape::Rect { pen: Pen::Frame, .. }) {
                blocked.extend([(from, from, Blocked::FrameStart), (to, to, Blocked::FrameEnd)]);
            } else {
                let known = whole.unwrap_or((from, to));
                whole = Some((known.0.min(from), known.1.max(to)));
            }
        }
        blocked.extend(whole.map(|(from, to)| (from, to, kind)));
    }
    blocked.sort_unstable();
    let is_content = |&&(.., kind): &&(i64, i64, Blocked)| kind == Blocked::Content;
    let last = blocked.iter().filter(is_content).map(|(from, ..)| *from).max().unwrap_or(0);
    let mut places = Vec::new();
    let (mut end, mut before) = (0, Blocked::FrameStart);
    let (mut n_symbols, mut has_content) = (0, false);
    for (from, to, kind) in blocked {
        let is_between = before != Blocked::FrameStart && kind != Blocked::FrameEnd;
        if has_content && is_between && from - end >= LEAST && end < last {
            let middle = (from + end) / 2;
            places.push((middle.min(end + MARGIN), middle.max(from - MARGIN), n_symbols));
            has_content = false;
        }
        n_symbols += usize::from(kind == Blocked::Content);
        has_content |= kind == Blocked::Content || kind == Blocked::Link && n_symbols > 0;
        if to >= end {
            (end, before) = (to, kind);
        }
    }
    places
}

/// The price of a division: by how much parts are too long, the number of links cut and of parts, and how unequal the parts are.
type Cost = (i64, usize, i64);

/// Chooses cuts that cut the fewest links and leave parts of at most `room`; unused length at the ends does not count. `part` has the length of a part between two cuts with its marks, and
/// the number of links that are cut at its end. A part without a place for a cut is longer.
pub(crate) fn division<'a>(
    cuts: &[Cut<'a>],
    used: &Range<i64>,
    room: i64,
    part: impl Fn(&Cut<'a>, &Cut<'a>) -> (i64, usize),
) -> Vec<Cut<'a>> {
    let border = |at, n_before| Cut { at, resume: at, links: Vec::new(), n_before };
    let cuts: Vec<Cut<'a>> = [border(used.start, 0)]
        .into_iter()
        .chain(cuts.iter().cloned())
        .chain([border(used.end, usize::MAX)])
        .collect();
    // The best division of what is before each cut, and the cut before it.
    let mut best: Vec<(Cost, usize)> = vec![((0, 0, 0), 0)];
    for cut in &cuts[1..] {
        let mut choice: Option<(Cost, usize)> = None;
        for (index, ((excess, n_cut, squares), _)) in best.iter().enumerate().rev() {
            let net = cut.at - cuts[index].resume;
            if net > room && choice.is_some() {
                break;
            }
            let (size, n_links) = part(&cuts[index], cut);
            // A page without symbols is as bad as one that is twice too long.
            let is_empty = cut.n_before == cuts[index].n_before;
            let too_long = (size - room).max(if is_empty { room } else { 0 });
            let cost = (excess + too_long, n_cut + n_links + 1, squares + net * net);
            if choice.is_none_or(|(known, _)| cost < known) {
                choice = Some((cost, index));
            }
        }
        best.extend(choice);
    }
    let before = |at: &usize| best.get(*at).map(|(_, before)| *before).filter(|at| *at > 0);
    let mut chosen: Vec<Cut<'a>> = std::iter::successors(before(&(cuts.len() - 1)), before)
        .filter_map(|index| cuts.get(index).cloned())
        .collect();
    chosen.reverse();
    chosen
}
