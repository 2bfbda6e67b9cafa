//! The crossings of many layouts of one graph that differ only in their columns.
//!
//! The horizontal and vertical lines of such layouts are the same, so they are found once. Two layouts differ only in the channels in which columns have moved
//! relative to each other; the crossings of the others are known. A layout with more crossings than the best one is not measured to its end.

use crate::blocks::Columns;
use crate::channels::{self, End, Horizontal, OVERHANG, Routes};
use crate::order::{Graph, Order};
use grafsynth_ir::Gather;
use std::collections::BTreeSet;

/// A vertical line in a channel. An end outside the channel is `None`.
#[derive(Debug, Clone, Copy)]
struct Upright {
    piece: usize,
    top: Option<usize>,
    bottom: Option<usize>,
    /// True for the line between a symbol and its horizontal line.
    is_stub: bool,
}

/// The lines between two rows. Their columns are numbers of pieces.
#[derive(Debug, Clone, Default)]
struct Channel {
    lines: Vec<Horizontal>,
    uprights: Vec<Upright>,
    /// The pieces whose columns matter.
    pieces: Vec<usize>,
}

/// What a layout has in one channel.
#[derive(Debug, Clone, Copy, Default)]
struct Measure {
    n_crossings: usize,
    n_tracks: usize,
    /// The ends of the horizontal lines, from the column of the first piece.
    left: i64,
    right: i64,
}

/// The layouts of a graph.
#[derive(Debug)]
pub(crate) struct Trials {
    channels: Vec<Channel>,
    n_rows: usize,
    /// The height of all rows.
    height: i64,
    /// True on paper.
    is_dense: bool,
}

/// A layout that was measured.
#[derive(Debug, Clone)]
pub(crate) struct Measured {
    /// The column of each piece.
    pub(crate) x: Vec<i64>,
    channels: Vec<Measure>,
    /// The number of crossings, of which one with a double line counts twice, and the area.
    pub(crate) cost: (usize, i64),
}

impl Trials {
    /// The layouts of a graph. In `columns`, the column of everything is the number of its piece.
    pub(crate) fn new(graph: &Graph, order: &Order, columns: &Columns) -> Self {
        let routes = Routes::new(graph, order, columns);
        let n_rows = routes.channels.len() - 2;
        let mut channels: Vec<Channel> = { routes.channels.iter() }
            .map(|lines| Channel { lines: lines.clone(), ..Channel::default() })
            .collect();
        let piece = |x: i64| usize::try_from(x).unwrap_or(0);
        for line in &routes.verticals {
            let at = |end: End, channel: usize| match end {
                End::Line((own, index)) if own == channel => Some(index),
                _ => None,
            };
            for channel in routes.reach(line) {
                channels[channel].uprights.push(Upright {
                    piece: piece(line.x),
                    top: at(line.top, channel),
                    bottom: at(line.bottom, channel),
                    is_stub: line.is_stub,
                });
            }
        }
        for channel in &mut channels {
            let ends = channel.lines.iter().flat_map(|line| line.above.iter().chain(&line.below));
            let all = ends.map(|x| piece(*x)).chain(channel.uprights.iter().map(|it| it.piece));
            let all: BTreeSet<usize> = all.gather();
            channel.pieces = all.into_iter().collect();
        }
        let heights = channels::row_heights(graph, order, n_rows);
        let height = heights.iter().map(|(above, below)| above + below).sum();
        Trials { channels, n_rows, height, is_dense: graph.is_dense }
    }

    /// Measures a layout.
    pub(crate) fn measure(&self, x: Vec<i64>, extent: (i64, i64)) -> Measured {
        let channels: Vec<Measure> = self.channels.iter().map(|it| it.measure(&x)).collect();
        let cost = self.cost(&x, &channels, extent);
        Measured { x, channels, cost }
    }

    /// Measures a layout if it is better than a known one.
    pub(crate) fn better(
        &self,
        known: &Measured,
        x: &[i64],
        extent: (i64, i64),
    ) -> Option<Measured> {
        let is_equal = |channel: &Channel| {
            let mut moves = channel.pieces.iter().map(|it| x[*it] - known.x[*it]);
            moves.next().is_none_or(|first| moves.all(|by| by == first))
        };
        let changed: Vec<usize> =
            (0..self.channels.len()).filter(|it| !is_equal(&self.channels[*it])).collect();
        let before: usize = changed.iter().map(|it| known.channels[*it].n_crossings).sum();
        let mut n_crossings = known.cost.0 - before;
        let mut measures = Vec::with_capacity(changed.len());
        for &index in &changed {
            if n_crossings > known.cost.0 {
                return None;
            }
            let measure = self.channels[index].measure(x);
            n_crossings += measure.n_crossings;
            measures.push(measure);
        }
        if n_crossings > known.cost.0 {
            return None;
        }
        let mut channels = known.channels.clone();
        changed.iter().zip(measures).for_each(|(index, measure)| channels[*index] = measure);
        let cost = self.cost(x, &channels, extent);
        (cost < known.cost).then(|| Measured { x: x.to_vec(), channels, cost })
    }

    fn cost(&self, x: &[i64], channels: &[Measure], extent: (i64, i64)) -> (usize, i64) {
        let (mut left, mut right) = extent;
        let (mut n_crossings, mut height) = (0, self.height);
        for (index, (channel, measure)) in self.channels.iter().zip(channels).enumerate() {
            n_crossings += measure.n_crossings;
            height += channels::channel_height(index, self.n_rows, measure.n_tracks, self.is_dense);
            if let Some(first) = channel.pieces.first().filter(|_| measure.n_tracks > 0) {
                left = left.min(x[*first] + measure.left);
                right = right.max(x[*first] + measure.right);
            }
        }
        (n_crossings, (right - left).saturating_mul(height))
    }

    /// For each piece the number of crossings of its lines, at their ends.
    pub(crate) fn crossings(&self, x: &[i64]) -> Vec<usize> {
        let mut counts = vec![0; x.len()];
        for channel in &self.channels {
            let (lines, uprights) = channel.routed(x);
            for (line, upright) in crossing(&lines, &uprights) {
                let ends = line.above.iter().chain(&line.below);
                let outer = ends.filter(|at| **at == line.left || **at == line.right);
                let columns: BTreeSet<i64> = outer.copied().chain([upright.0]).gather();
                for piece in channel.pieces.iter().filter(|it| columns.contains(&x[**it])) {
                    counts[*piece] += 1;
                }
            }
        }
        counts
    }
}

/// A vertical line with its column and the tracks between which it is.
type Placed = (i64, Option<usize>, Option<usize>);

/// Each crossing: the horizontal line and the vertical one.
fn crossing<'a>(
    lines: &'a [Horizontal],
    uprights: &'a [Placed],
) -> impl Iterator<Item = (&'a Horizontal, &'a Placed)> {
    uprights.iter().flat_map(move |upright| {
        let (x, top, bottom) = upright;
        let crossed = lines.iter().filter(move |line| {
            line.left < *x
                && *x < line.right
                && top.is_none_or(|top| top < line.track)
                && bottom.is_none_or(|bottom| line.track < bottom)
        });
        crossed.map(move |line| (line, upright))
    })
}

impl Channel {
    fn measure(&self, x: &[i64]) -> Measure {
        let column = |piece: &i64| usize::try_from(*piece).map_or(0, |piece| x[piece]);
        if self.lines.is_empty() {
            return Measure::default();
        }
        if let [line] = self.lines.as_slice()
            && !line.is_double
        {
            let ends = || line.above.iter().chain(&line.below).map(column);
            let (left, right) = (ends().min().unwrap_or(0), ends().max().unwrap_or(0));
            if left == right {
                return Measure::default();
            }
            let first = self.pieces.first().map_or(0, |piece| x[*piece]);
            let is_crossing = |it: &&Upright| {
                it.top.is_none() && it.bottom.is_none() && left < x[it.piece] && x[it.piece] < right
            };
            let n_crossings = self.uprights.iter().filter(is_crossing).count();
            return Measure { n_crossings, n_tracks: 1, left: left - first, right: right - first };
        }
        let (lines, uprights) = self.routed(x);
        let first = self.pieces.first().map_or(0, |piece| x[*piece]);
        let more = |line: &Horizontal| if line.is_double { OVERHANG } else { 0 };
        Measure {
            n_crossings: crossing(&lines, &uprights).map(|(line, _)| line.weight()).sum(),
            n_tracks: lines.iter().map(|line| line.track + 1).max().unwrap_or(0),
            left: lines.iter().map(|line| line.left - more(line)).min().unwrap_or(first) - first,
            right: lines.iter().map(|line| line.right + more(line)).max().unwrap_or(first) - first,
        }
    }

    /// The horizontal lines with their tracks, and the vertical ones.
    fn routed(&self, x: &[i64]) -> (Vec<Horizontal>, Vec<Placed>) {
        let column = |piece: &i64| usize::try_from(*piece).map_or(0, |piece| x[piece]);
        let mut lines: Vec<Horizontal> = Vec::with_capacity(self.lines.len());
        // The new number of each line; a line without length is not drawn.
        let mut numbers = Vec::with_capacity(self.lines.len());
        for line in &self.lines {
            let ends = |all: &[i64]| all.iter().map(column).collect();
            let own = Horizontal::new(ends(&line.above), ends(&line.below), line.is_double);
            let is_drawn = own.is_double || own.left < own.right;
            numbers.push(is_drawn.then_some(lines.len()));
            lines.extend(is_drawn.then_some(own));
        }
        let number = |line: Option<usize>| line.and_then(|index| numbers[index]);
        let is_there = |it: &&Upright| !it.is_stub || number(it.top.or(it.bottom)).is_some();
        let mut uprights: Vec<Placed> = { self.uprights.iter().filter(is_there) }
            .map(|it| (x[it.piece], number(it.top), number(it.bottom)))
            .collect();
        let passing = || uprights.iter().map(|(x, ..)| *x).gather();
        for (line, from, to) in channels::assign(&mut lines, passing) {
            let by = channels::detour(&lines, line, from, to);
            let moved = uprights.iter_mut().find(|it| it.0 == from && it.2 == Some(line));
            if let (Some(moved), Some(by)) = (moved, by) {
                moved.2 = Some(by);
                uprights.push((to, Some(by), Some(line)));
            }
        }
        let track = |line: Option<usize>| line.map(|index| lines[index].track);
        for (_, top, bottom) in &mut uprights {
            (*top, *bottom) = (track(*top), track(*bottom));
        }
        (lines, uprights)
    }
}
