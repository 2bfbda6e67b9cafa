//! The links of a graph: horizontal lines between the rows, and the vertical lines that they connect.
//!
//! Each node has at most one horizontal line below it, where its links diverge, and at most one above it, where links converge. All horizontal lines between two rows
//! are in tracks: lines that would touch are in different tracks. If a line from above ends in the column in which another one begins downwards, the first one is above.

use crate::blocks::Columns;
use crate::order::{Graph, Order};
use grafsynth_ir::Gather;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

/// The distance between tracks, which is also the height of a channel without horizontal lines.
const TRACK: i64 = 14;
/// The distance between tracks on paper.
const DENSE_TRACK: i64 = 10;
/// The height of a channel without horizontal lines on paper.
const DENSE_CHANNEL: i64 = 8;
/// The length of a link that leads up for each of its arrows, so that a part of it on a page or screen has one.
const ARROWS: i64 = 600;
/// Vertical lines that are nearer than this do not share a height.
const NEAR: i64 = 8;
/// How far a double line extends beyond its links.
pub(crate) const OVERHANG: i64 = 9;
/// Half the distance between the lines of a double line.
pub(crate) const HALF: i64 = 2;

/// A graph with coordinates.
#[derive(Debug, Clone, Default)]
pub(crate) struct Placed {
    /// The axis of each node and the height at which the link from above ends.
    pub(crate) nodes: Vec<(i64, i64)>,
    /// Lines from point to point, horizontal or vertical.
    pub(crate) lines: Vec<[i64; 4]>,
    /// For each of the first lines, which are the vertical ones, the node whose link it is; the step if it joins a step and a transition.
    pub(crate) owners: Vec<usize>,
    /// Double lines: left, right, and the height between both.
    pub(crate) doubles: Vec<[i64; 3]>,
    /// Points of links that lead up, for an arrow.
    pub(crate) arrows: Vec<(i64, i64)>,
    /// Points where a vertical line crosses a horizontal one without a connection.
    pub(crate) crossings: Vec<(i64, i64)>,
    pub(crate) left: i64,
    pub(crate) right: i64,
    pub(crate) height: i64,
}

/// A layout that was tried.
#[derive(Debug)]
pub(crate) struct Tried {
    pub(crate) placed: Placed,
    /// The number of crossings, of which one with a double line counts twice, and the area.
    pub(crate) cost: (usize, i64),
}

impl Tried {
    pub(crate) fn new(placed: Placed) -> Self {
        let is_double = |(x, y): &&(i64, i64)| {
            placed.doubles.iter().any(|[left, right, at]| at == y && left <= x && x <= right)
        };
        let n_crossings =
            placed.crossings.len() + placed.crossings.iter().filter(is_double).count();
        let area = (placed.right - placed.left).saturating_mul(placed.height);
        Tried { cost: (n_crossings, area), placed }
    }
}

/// A horizontal line.
#[derive(Debug, Clone, Default)]
pub(crate) struct Horizontal {
    pub(crate) left: i64,
    pub(crate) right: i64,
    pub(crate) is_double: bool,
    /// The columns of the lines from above, and of the lines that go down.
    pub(crate) above: Vec<i64>,
    pub(crate) below: Vec<i64>,
    pub(crate) track: usize,
    /// The line that a detour leads to.
    feeds: Option<usize>,
}

impl Horizontal {
    pub(crate) fn new(above: Vec<i64>, below: Vec<i64>, is_double: bool) -> Self {
        let all = || above.iter().chain(&below).copied();
        let (left, right) = (all().min().unwrap_or(0), all().max().unwrap_or(0));
        Horizontal { left, right, is_double, above, below, track: 0, feeds: None }
    }

    fn preference(&self) -> Preference {
        match (self.above.is_empty(), self.below.is_empty()) {
            (false, true) => (0, self.right - self.left),
            (true, false) => (2, self.left - self.right),
            _ => (1, self.left),
        }
    }

    /// As how many crossings one with this line counts.
    pub(crate) fn weight(&self) -> usize {
        if self.is_double { 2 } else { 1 }
    }

    /// The number of crossings of this line with one above it, or of their ends; a double line counts twice.
    fn crossings_below(&self, upper: &Horizontal) -> usize {
        let inside = |line: &Horizontal, ends: &[i64]| {
            line.weight() * ends.iter().filter(|x| line.left < **x && **x < line.right).count()
        };
        inside(self, &upper.below) + inside(upper, &self.above)
    }

    /// The columns that no other line of the same track may touch.
    fn reach(&self) -> (i64, i64) {
        let more = if self.is_double { OVERHANG + NEAR / 2 } else { NEAR / 2 };
        (self.left - more, self.right + more)
    }
}

/// Where a line should be in its channel, from top to bottom: lines whose ends all lead up, the shortest first, then lines with ends on both sides from left
/// to right, then lines whose ends all lead down, the longest first. So a line is not crossed by the ends of the lines that it encloses. In a channel with fewer
/// than [`MANY`] lines, the crossings of each pair of lines come before this.
type Preference = (u8, i64);

/// A horizontal line by its channel and its number there.
pub(crate) type Place = (usize, usize);

/// An end of a vertical line.
#[derive(Debug, Clone, Copy)]
pub(crate) enum End {
    /// The lower or upper end of the symbol of a node.
    Symbol(usize),
    Line(Place),
}

/// A vertical line from top to bottom.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vertical {
    pub(crate) x: i64,
    pub(crate) top: End,
    pub(crate) bottom: End,
    leads_up: bool,
    /// True for the line between a symbol and its horizontal line.
    pub(crate) is_stub: bool,
    /// The node whose link it is.
    owner: usize,
}

/// The routing in progress. Channel `r` is above row `r`.
pub(crate) struct Routes<'a> {
    graph: &'a Graph,
    order: &'a Order,
    columns: &'a Columns,
    pub(crate) channels: Vec<Vec<Horizontal>>,
    below: Vec<Option<Place>>,
    above: Vec<Option<Place>>,
    turns: BTreeMap<usize, Place>,
    /// The turns of links that lead up, above joins.
    entries: BTreeMap<usize, Place>,
    pub(crate) verticals: Vec<Vertical>,
}

/// Assigns coordinates to all nodes and lines.
pub(crate) fn place(graph: &Graph, order: &Order, columns: &Columns) -> Placed {
    let mut routes = Routes::new(graph, order, columns);
    routes.assign_tracks();
    routes.coordinates()
}

impl<'a> Routes<'a> {
    /// All lines, without tracks.
    pub(crate) fn new(graph: &'a Graph, order: &'a Order, columns: &'a Columns) -> Self {
        let n = graph.nodes.len();
        let n_rows = order.row.iter().max().map_or(0, |last| last + 1);
        let mut routes = Routes {
            graph,
            order,
            columns,
            channels: vec![Vec::new(); n_rows + 2],
            below: vec![None; n],
            above: vec![None; n],
            turns: BTreeMap::new(),
            entries: BTreeMap::new(),
            verticals: Vec::new(),
        };
        routes.add_horizontals();
        routes.add_verticals();
        routes
    }
}

impl Routes<'_> {
    /// The column in which a link leaves the node above it or the horizontal line there.
    fn start(&self, arc: usize) -> i64 {
        let ends = self.graph.arcs[arc];
        match (self.columns.down[arc], self.columns.up[arc]) {
            (Some(x), _) | (None, Some(x)) => x,
            (None, None) if self.graph.ins[ends.to].len() == 1 => self.columns.x[ends.to],
            (None, None) => self.columns.x[ends.from],
        }
    }

    fn add(&mut self, channel: usize, line: Horizontal) -> Option<Place> {
        let lines = self.channels.get_mut(channel)?;
        lines.push(line);
        Some((channel, lines.len() - 1))
    }

    fn add_horizontals(&mut self) {
        for node in 0..self.graph.nodes.len() {
            let (x, row) = (self.columns.x[node], self.order.row[node]);
            let is_transition = self.graph.nodes[node].is_transition;
            let is_plain = |links: &[usize], line: &Horizontal| {
                line.left == line.right && !(is_transition && links.len() > 1)
            };
            let outs = self.graph.outs[node].as_slice();
            let (mut above, mut below) = (vec![x], Vec::new());
            for &arc in outs {
                let goes_up = self.columns.up[arc].is_some() && self.columns.down[arc].is_none();
                if goes_up { &mut above } else { &mut below }.push(self.start(arc));
            }
            let line = Horizontal::new(above, below, is_transition && outs.len() > 1);
            if !outs.is_empty() && !is_plain(outs, &line) {
                self.below[node] = self.add(row + 1, line);
            }
            for &arc in outs {
                if let (Some(down), Some(up)) = (self.columns.down[arc], self.columns.up[arc])
                    && let Some(turn) =
                        self.add(row + 2, Horizontal::new(vec![down, up], Vec::new(), false))
                {
                    self.turns.insert(arc, turn);
                }
            }
            let ins = self.graph.ins[node].as_slice();
            let (mut above, mut below) = (Vec::new(), vec![x]);
            for &arc in ins {
                match (self.columns.up[arc], self.columns.entry[arc]) {
                    (Some(up), Some(entry)) => {
                        above.push(entry);
                        let turn = Horizontal::new(Vec::new(), vec![up, entry], false);
                        if let Some(turn) = self.add(row.saturating_sub(1), turn) {
                            self.entries.insert(arc, turn);
                        }
                    }
                    (Some(up), None) => below.push(up),
                    (None, _) => above.push(self.start(arc)),
                }
            }
            let line = Horizontal::new(above, below, is_transition && ins.len() > 1);
            if !ins.is_empty() && !is_plain(ins, &line) {
                self.above[node] = self.add(row, line);
            }
        }
    }

    fn add_verticals(&mut self) {
        for node in 0..self.graph.nodes.len() {
            let x = self.columns.x[node];
            let mut add = |top, bottom| {
                let owner = node;
                let (leads_up, is_stub) = (false, true);
                self.verticals.push(Vertical { x, top, bottom, leads_up, is_stub, owner });
            };
            if let Some(line) = self.below[node] {
                add(End::Symbol(node), End::Line(line));
            }
            if let Some(line) = self.above[node] {
                add(End::Line(line), End::Symbol(node));
            }
        }
        for arc in 0..self.graph.arcs.len() {
            let ends = self.graph.arcs[arc];
            let mut top = self.below[ends.from].map_or(End::Symbol(ends.from), End::Line);
            let bottom = self.above[ends.to].map_or(End::Symbol(ends.to), End::Line);
            let start = self.start(arc);
            let owner = if self.graph.nodes[ends.from].is_transition { ends.to } else { ends.from };
            let mut add = |x, top, bottom, leads_up| {
                self.verticals.push(Vertical { x, top, bottom, leads_up, is_stub: false, owner });
            };
            let Some(up) = self.columns.up[arc] else {
                add(start, top, bottom, false);
                continue;
            };
            if let (Some(turn), Some(down)) = (self.turns.get(&arc), self.columns.down[arc]) {
                add(down, top, End::Line(*turn), false);
                top = End::Line(*turn);
            }
            let mut bottom = bottom;
            if let (Some(turn), Some(entry)) = (self.entries.get(&arc), self.columns.entry[arc]) {
                add(entry, End::Line(*turn), bottom, false);
                bottom = End::Line(*turn);
            }
            add(up, bottom, top, true);
        }
    }

    fn assign_tracks(&mut self) {
        for channel in 0..self.channels.len() {
            let mut lines = std::mem::take(&mut self.channels[channel]);
            let detours = assign(&mut lines, || self.passing(channel));
            self.channels[channel] = lines;
            for (line, from, to) in detours {
                self.detour((channel, line), from, to);
            }
        }
    }

    /// The columns of all vertical lines in a channel.
    fn passing(&self, channel: usize) -> BTreeSet<i64> {
        let inside = self.verticals.iter().filter(|line| self.reach(line).contains(&channel));
        inside.map(|line| line.x).gather()
    }

    /// The channels in which a vertical line is.
    pub(crate) fn reach(&self, line: &Vertical) -> RangeInclusive<usize> {
        let top = |end| match end {
            End::Symbol(node) => self.order.row[node] + 1,
            End::Line((channel, _)) => channel,
        };
        let bottom = |end| match end {
            End::Symbol(node) => self.order.row[node],
            End::Line((channel, _)) => channel,
        };
        top(line.top)..=bottom(line.bottom)
    }

    /// Moves the upper end of a line from above to another column by a horizontal line at the top of the channel, which is the last one there.
    fn detour(&mut self, line: Place, from: i64, to: i64) {
        let is_moved = |vertical: &Vertical| {
            vertical.x == from && matches!(vertical.bottom, End::Line(end) if end == line)
        };
        let Some(index) = self.verticals.iter().position(is_moved) else { return };
        let lines = &self.channels[line.0];
        let Some(by) = detour(lines, line.1, from, to) else { return };
        let by = End::Line((line.0, by));
        let bottom = std::mem::replace(&mut self.verticals[index].bottom, by);
        let moved = Vertical { leads_up: false, is_stub: false, ..self.verticals[index] };
        self.verticals.push(Vertical { x: to, top: by, bottom, ..moved });
    }

    fn coordinates(self) -> Placed {
        let (graph, order) = (self.graph, self.order);
        let n_rows = self.channels.len() - 2;
        let sizes = row_heights(graph, order, n_rows);
        let (track_height, _) = spaces(graph.is_dense);
        let mut y = 0;
        let mut channel_tops = Vec::new();
        let mut row_tops = Vec::new();
        for (channel, lines) in self.channels.iter().enumerate() {
            channel_tops.push(y);
            let n_tracks = lines.iter().map(|line| line.track + 1).max().unwrap_or(0);
            y += channel_height(channel, n_rows, n_tracks, graph.is_dense);
            let (above, below) = sizes.get(channel).copied().unwrap_or((0, 0));
            row_tops.push(y + above);
            y += above + below;
        }
        let line_y = |(channel, line): Place| {
            let track = self.channels[channel][line].track;
            channel_tops[channel] + track_height * (1 + i64::try_from(track).unwrap_or(0))
        };
        let nodes: Vec<(i64, i64)> = (0..graph.nodes.len())
            .map(|node| (self.columns.x[node], row_tops[order.row[node]]))
            .collect();
        let mut placed = Placed { nodes, height: y, ..Placed::default() };
        let double = |(channel, line): Place| self.channels[channel][line].is_double;
        let mut crossing: BTreeMap<usize, Vec<(i64, i64, i64)>> = BTreeMap::new();
        for vertical in &self.verticals {
            let top = match vertical.top {
                End::Symbol(node) => placed.nodes[node].1 + graph.nodes[node].body,
                End::Line(line) => line_y(line) + if double(line) { HALF } else { 0 },
            };
            let bottom = match vertical.bottom {
                End::Symbol(node) => placed.nodes[node].1,
                End::Line(line) => line_y(line) - if double(line) { HALF } else { 0 },
            };
            placed.lines.push([vertical.x, top, vertical.x, bottom]);
            placed.owners.push(vertical.owner);
            if vertical.leads_up {
                let all = arrows(top, bottom, &row_tops).into_iter();
                placed.arrows.extend(all.map(|at| (vertical.x, at)));
            }
            let first = channel_tops.partition_point(|y| *y <= top).saturating_sub(1);
            let last = channel_tops.partition_point(|y| *y < bottom);
            for channel in first..last {
                crossing.entry(channel).or_default().push((vertical.x, top, bottom));
            }
        }
        self.draw_horizontals(&mut placed, crossing, line_y);
        placed.left = placed.left.min(self.columns.extent.0);
        placed.right = placed.right.max(self.columns.extent.1);
        placed
    }

    /// Draws the horizontal lines. `crossing` has the vertical lines of each channel: column, top and bottom.
    fn draw_horizontals(
        &self,
        placed: &mut Placed,
        mut crossing: BTreeMap<usize, Vec<(i64, i64, i64)>>,
        line_y: impl Fn(Place) -> i64,
    ) {
        for (channel, lines) in self.channels.iter().enumerate() {
            let mut crossers = crossing.remove(&channel).unwrap_or_default();
            crossers.sort_unstable();
            for (index, line) in lines.iter().enumerate() {
                let y = line_y((channel, index));
                let (reach_left, reach_right) = line.reach();
                let from = crossers.partition_point(|(x, ..)| *x < reach_left);
                let near = crossers.iter().skip(from).take_while(|(x, ..)| *x <= reach_right);
                let near = near.filter(|(_, top, bottom)| *top < y - HALF && y + HALF < *bottom);
                let (mut left, mut right) = (line.left, line.right);
                if line.is_double {
                    (left, right) = (left - OVERHANG, right + OVERHANG);
                }
                for (x, ..) in near {
                    if line.left < *x && *x < line.right {
                        placed.crossings.push((*x, y));
                    } else if *x <= line.left {
                        left = left.max((x + 4).min(line.left));
                    } else {
                        right = right.min((x - 4).max(line.right));
                    }
                }
                if line.is_double {
                    placed.doubles.push([left, right, y]);
                } else {
                    placed.lines.push([left, y, right, y]);
                }
                placed.left = placed.left.min(left);
                placed.right = placed.right.max(right);
            }
        }
    }
}

/// The height of each row above the end of the link to its nodes, and below.
pub(crate) fn row_heights(graph: &Graph, order: &Order, n_rows: usize) -> Vec<(i64, i64)> {
    let mut heights = vec![(0, 0); n_rows];
    for (node, size) in graph.nodes.iter().enumerate() {
        let row: &mut (i64, i64) = &mut heights[order.row[node]];
        *row = (row.0.max(size.above), row.1.max(size.body + size.below));
    }
    heights
}

/// The distance between tracks, and the height of a channel without any.
fn spaces(is_dense: bool) -> (i64, i64) {
    if is_dense { (DENSE_TRACK, DENSE_CHANNEL) } else { (TRACK, TRACK) }
}

/// The height of a channel; above the first row and below the last one it is 0 without lines.
pub(crate) fn channel_height(
    channel: usize,
    n_rows: usize,
    n_tracks: usize,
    is_dense: bool,
) -> i64 {
    let is_end = channel == 0 || channel >= n_rows;
    let n_tracks = i64::try_from(n_tracks).unwrap_or(0);
    let (track, free) = spaces(is_dense);
    if n_tracks == 0 && is_end { 0 } else { free + n_tracks * track }
}

/// The line of a detour.
pub(crate) fn detour(lines: &[Horizontal], fed: usize, from: i64, to: i64) -> Option<usize> {
    let is_it =
        |one: &Horizontal| one.feeds == Some(fed) && one.above == [from] && one.below == [to];
    lines.iter().position(is_it)
}

/// The heights of the arrows on a vertical line, each where a row begins, if possible: no horizontal line is there.
fn arrows(top: i64, bottom: i64, row_tops: &[i64]) -> Vec<i64> {
    let n = 1 + (bottom - top) / ARROWS;
    let near_row = |number: i64| {
        let middle = top + (bottom - top) * (2 * number + 1) / (2 * n);
        let row = row_tops.partition_point(|row| *row <= middle).saturating_sub(1);
        let at = row_tops.iter().skip(row).take(2).copied();
        let at = at.filter(|y| y - 6 > top && y + 6 < bottom);
        at.min_by_key(|y| (y - middle).abs()).unwrap_or(middle)
    };
    let mut all: Vec<i64> = (0..n).map(near_row).collect();
    all.dedup();
    all
}

/// Assigns a track to each line of a channel. Returns the lines from above that need a detour, because the order of the tracks would be cyclic:
/// the line they lead to, their column, and the column of the new line, which is at the end of `lines`.
pub(crate) fn assign(
    lines: &mut Vec<Horizontal>,
    passing: impl Fn() -> BTreeSet<i64>,
) -> Vec<(usize, i64, i64)> {
    // A single line has the first track already.
    if lines.len() < 2 {
        return Vec::new();
    }
    let mut detours = Vec::new();
    let mut used = None;
    loop {
        let downs = downwards(lines);
        let wishes = wishes(lines);
        match sorted(lines, &downs, &wishes) {
            Ok(order) => {
                pack(lines, &order, &downs, &wishes);
                return detours;
            }
            Err((line, from)) => {
                let used = used.get_or_insert_with(&passing);
                let is_free = |x: &i64| used.range(x - NEAR + 1..x + NEAR).next().is_none();
                let to = (1..).flat_map(|n| [from + n * NEAR, from - n * NEAR]).find(is_free);
                let Some(to) = to else { return detours };
                used.insert(to);
                if let Some(at) = lines[line].above.iter_mut().find(|x| **x == from) {
                    *at = to;
                }
                let moved = &mut lines[line];
                let all = || moved.above.iter().chain(&moved.below).copied();
                let (left, right) = (all().min().unwrap_or(to), all().max().unwrap_or(to));
                (moved.left, moved.right) = (left, right);
                let detour = Horizontal::new(vec![from], vec![to], false);
                lines.push(Horizontal { feeds: Some(line), ..detour });
                detours.push((line, from, to));
            }
        }
    }
}

/// For each line, the lines that must be below it, with the column that requires this.
fn downwards(lines: &[Horizontal]) -> Vec<Vec<(usize, i64)>> {
    let mut starts: Vec<(i64, usize)> = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        starts.extend(line.below.iter().map(|x| (*x, index)));
    }
    starts.sort_unstable();
    let below = |index: usize, line: &Horizontal| {
        let mut all = Vec::new();
        for &x in &line.above {
            let from = starts.partition_point(|(at, _)| *at <= x - NEAR);
            let near = starts.iter().skip(from).take_while(|(at, _)| *at < x + NEAR);
            let others = near.map(|(_, other)| *other);
            let others =
                others.filter(|other| *other != index && lines[*other].feeds != Some(index));
            all.extend(others.map(|other| (other, x)));
        }
        all.extend(line.feeds.map(|fed| (fed, line.left)));
        all
    };
    lines.iter().enumerate().map(|(index, line)| below(index, line)).collect()
}

/// From this number of lines in a channel on, the crossings of pairs are not counted.
const MANY: usize = 64;

/// For each line, the lines that should be below it, with the number of crossings that this saves.
fn wishes(lines: &[Horizontal]) -> Vec<Vec<(usize, usize)>> {
    let mut wishes = vec![Vec::new(); lines.len()];
    if lines.len() >= MANY {
        return wishes;
    }
    for (low, one) in lines.iter().enumerate() {
        for (high, other) in lines[..low].iter().enumerate() {
            let (below, above) = (one.crossings_below(other), other.crossings_below(one));
            match below.cmp(&above) {
                Ordering::Less => wishes[high].push((low, above - below)),
                Ordering::Greater => wishes[low].push((high, below - above)),
                Ordering::Equal => {}
            }
        }
    }
    wishes
}

/// The lines in order from top to bottom; or, if the order is cyclic, a line of the cycle and the column of a line from above.
fn sorted(
    lines: &[Horizontal],
    downs: &[Vec<(usize, i64)>],
    wishes: &[Vec<(usize, usize)>],
) -> Result<Vec<usize>, (usize, i64)> {
    let mut n_above = vec![0; lines.len()];
    for (below, _) in downs.iter().flatten() {
        n_above[*below] += 1;
    }
    // The crossings that each line would cause by being above all that are left.
    let mut harm = vec![0; lines.len()];
    for (below, saved) in wishes.iter().flatten() {
        harm[*below] += saved;
    }
    let mut ready: BTreeSet<(usize, Preference, usize)> = BTreeSet::new();
    let key = |index: usize, harm: &[usize]| (harm[index], lines[index].preference(), index);
    ready.extend((0..lines.len()).filter(|index| n_above[*index] == 0).map(|it| key(it, &harm)));
    let mut order = Vec::new();
    while let Some((.., index)) = ready.pop_first() {
        order.push(index);
        for (below, saved) in &wishes[index] {
            let is_ready = ready.remove(&key(*below, &harm));
            harm[*below] -= saved;
            if is_ready {
                ready.insert(key(*below, &harm));
            }
        }
        for (below, _) in &downs[index] {
            n_above[*below] -= 1;
            if n_above[*below] == 0 {
                ready.insert(key(*below, &harm));
            }
        }
    }
    if order.len() == lines.len() {
        return Ok(order);
    }
    // What is left is a circle or below one. Going up from any of it leads into a circle.
    let is_left = |index: usize| n_above[index] > 0;
    let mut above = vec![None; lines.len()];
    for index in (0..lines.len()).filter(|index| is_left(*index)) {
        for (below, x) in downs[index].iter().filter(|(below, _)| is_left(*below)) {
            above[*below] = Some((index, *x));
        }
    }
    let mut at = (0..lines.len()).find(|index| is_left(*index)).unwrap_or(0);
    let mut found = (at, 0);
    for _ in 0..=lines.len() {
        if let Some((index, x)) = above[at] {
            found = (index, x);
            at = index;
        }
    }
    Err(found)
}

/// The lowest track that each line can have.
fn pack(
    lines: &mut [Horizontal],
    order: &[usize],
    downs: &[Vec<(usize, i64)>],
    wishes: &[Vec<(usize, usize)>],
) {
    let mut least = vec![0; lines.len()];
    // For each track the ends of its lines by where they begin; they do not overlap.
    let mut tracks: Vec<BTreeMap<i64, i64>> = Vec::new();
    for &index in order {
        let (left, right) = lines[index].reach();
        let is_free = |track: &BTreeMap<i64, i64>| {
            track.range(..=right).next_back().is_none_or(|(_, end)| *end < left)
        };
        let first = least[index];
        let found = tracks.iter().skip(first).position(is_free).map(|more| first + more);
        let track = found.unwrap_or(tracks.len().max(first));
        while tracks.len() <= track {
            tracks.push(BTreeMap::new());
        }
        tracks[track].insert(left, right);
        lines[index].track = track;
        let wished = wishes[index].iter().map(|(below, _)| *below);
        for below in downs[index].iter().map(|(below, _)| *below).chain(wished) {
            least[below] = least[below].max(track + 1);
        }
    }
}
