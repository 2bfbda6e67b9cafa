//! Where a drawing is cut into pages: in lines on which nothing but links and frames is, so that few links are cut.

use crate::channels::HALF;
use crate::picture::{Mark, Pen, Picture, Shape};
use std::ops::Range;

/// The direction in which pages follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Axis {
    Down,
    Right,
}

/// A place between two pages, with the links that cross it in order: where on the cut, and the step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Cut<'a> {
    pub(crate) at: i64,
    pub(crate) links: Vec<(i64, &'a str)>,
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

    /// The place, range and step of a part of a link that leads along the axis.
    pub(crate) fn link(self, mark: &Mark) -> Option<(i64, Range<i64>, &str)> {
        let step = mark.link.as_deref()?;
        let [(from, to), (place, other)] = self.extent(mark);
        let is_line = matches!(mark.shape, Shape::Line { .. });
        (is_line && place == other).then_some((place, from..to, step))
    }
}

/// All cuts that are possible in the part of a drawing that is in `band` across the axis.
pub(crate) fn candidates<'a>(picture: &'a Picture, axis: Axis, band: &Range<i64>) -> Vec<Cut<'a>> {
    let is_here = |mark: &&Mark| {
        let [_, (from, to)] = axis.extent(mark);
        from <= band.end && band.start <= to
    };
    let here: Vec<&Mark> = picture.marks.iter().filter(is_here).collect();
    let places = free_places(&here, axis);
    let mut cuts: Vec<Cut<'_>> = places.iter().map(|at| Cut { at: *at, links: vec![] }).collect();
    for (place, range, step) in here.iter().filter_map(|mark| axis.link(mark)) {
        let first = places.partition_point(|at| *at <= range.start);
        let last = places.partition_point(|at| *at < range.end);
        for cut in cuts.get_mut(first..last).unwrap_or_default() {
            cut.links.push((place, step));
        }
    }
    for cut in &mut cuts {
        cut.links.sort_unstable();
        // Both lines of a double line have one mark, between them.
        cut.links.dedup_by(|(place, step), (first, other)| {
            let is_double = axis == Axis::Right && *place - *first == 2 * HALF;
            *first += if is_double && step == other { HALF } else { 0 };
            step == other && (is_double || place == first)
        });
    }
    cuts
}

/// The middles of the stripes in which nothing but links and frames is.
fn free_places(marks: &[&Mark], axis: Axis) -> Vec<i64> {
    let mut blocked: Vec<(i64, i64)> = Vec::new();
    for mark in marks {
        let [(from, to), _] = axis.extent(mark);
        if matches!(mark.shape, Shape::Rect { pen: Pen::Frame, .. }) {
            blocked.extend([(from, from), (to, to)]);
        } else if axis.link(mark).is_none() {
            blocked.push((from, to));
        }
    }
    blocked.sort_unstable();
    let mut places = Vec::new();
    let mut end = 0;
    for (from, to) in blocked {
        if from - end >= 6 {
            places.push((from + end) / 2);
        }
        end = end.max(to);
    }
    places
}

/// The price of a division: by how much parts are too long, the number of links cut and of parts, and how unequal the parts are.
type Cost = (i64, usize, i64);

/// Chooses the cuts that divide a length into parts of at most `room` and cut the fewest links. `size` is the length of the part between two cuts with its
/// marks. A part without a place for a cut is longer.
pub(crate) fn division<'a>(
    cuts: &[Cut<'a>],
    length: i64,
    room: i64,
    size: impl Fn(Option<&Cut<'a>>, Option<&Cut<'a>>, i64) -> i64,
) -> Vec<Cut<'a>> {
    // The best division of what is before each cut, and the cut before it; the last one is that of the whole.
    let mut best: Vec<(Cost, Option<usize>)> = Vec::with_capacity(cuts.len() + 1);
    for end in 0..=cuts.len() {
        let cut = cuts.get(end);
        let at = cut.map_or(length, |cut| cut.at);
        let mut choice: Option<(Cost, Option<usize>)> = None;
        for start in (0..=end).rev() {
            let before = start.checked_sub(1);
            let first = before.and_then(|index| cuts.get(index));
            let net = at - first.map_or(0, |cut| cut.at);
            if net > room && choice.is_some() {
                break;
            }
            let (excess, n_cut, squares) =
                before.and_then(|index| best.get(index)).map_or((0, 0, 0), |(cost, _)| *cost);
            let more = (size(first, cut, net) - room).max(0);
            let n_cut = n_cut + 1 + cut.map_or(0, |cut| cut.links.len());
            let cost = (excess + more, n_cut, squares + net * net / 64);
            if choice.is_none_or(|(known, _)| cost < known) {
                choice = Some((cost, before));
            }
        }
        best.extend(choice);
    }
    let mut chosen = Vec::new();
    let mut at = best.last().and_then(|(_, before)| *before);
    while let Some(index) = at {
        chosen.push(index);
        at = best.get(index).and_then(|(_, before)| *before);
    }
    chosen.iter().rev().filter_map(|index| cuts.get(*index).cloned()).collect()
}
