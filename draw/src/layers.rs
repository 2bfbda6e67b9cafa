//! The places of cells in layers: their order, with few crossings, and their columns, with straight links.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// The distance between the cells of a layer.
pub(crate) const GAP: i64 = 24;
/// The unit of columns.
pub(crate) const PITCH: i64 = 8;
/// The number of rounds of each improvement.
const ROUNDS: usize = 6;
/// From this number of links between two layers on, crossings are not counted.
const MANY: usize = 1500;

/// A cell: something with a place in a layer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cell {
    /// The width, a multiple of two pitches.
    pub(crate) width: i64,
    /// The left side.
    pub(crate) x: i64,
    /// The place in a layer whose order is given.
    pub(crate) fixed: Option<usize>,
    /// The cell that is always directly to the left.
    pub(crate) after: Option<usize>,
    /// True for a part of a link.
    pub(crate) is_link: bool,
}

/// A link between cells of neighbouring layers, with the column of each end from the left side of its cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// The upper cell.
    pub(crate) upper: (usize, i64),
    /// The lower cell.
    pub(crate) lower: (usize, i64),
    /// How much it matters that the link is straight.
    pub(crate) weight: i64,
}

/// Orders the cells of the layers and sets their columns.
pub(crate) fn place(cells: &mut [Cell], layers: &mut [Vec<usize>], spans: &[Span]) {
    let mut layer_of = vec![0; cells.len()];
    for (index, layer) in layers.iter().enumerate() {
        layer.iter().for_each(|cell| layer_of[*cell] = index);
    }
    let mut above: Vec<Vec<Span>> = vec![Vec::new(); layers.len()];
    for span in spans {
        above[layer_of[span.lower.0]].push(*span);
    }
    order(cells, layers, &above);
    columns(cells, layers, &above);
}

/// Sorts each layer by the places of the neighbours in the layer above, then in the one below, and keeps the order with the fewest crossings.
fn order(cells: &[Cell], layers: &mut [Vec<usize>], above: &[Vec<Span>]) {
    let n = layers.len();
    let mut best = (crossings(cells, layers, above), layers.to_vec());
    for _ in 0..ROUNDS {
        for (index, spans) in above.iter().enumerate().skip(1) {
            sort(cells, layers, index, spans, true);
        }
        keep(cells, layers, above, &mut best);
        for index in (0..n.saturating_sub(1)).rev() {
            sort(cells, layers, index, &above[index + 1], false);
        }
        keep(cells, layers, above, &mut best);
    }
    layers.clone_from_slice(&best.1);
}

fn keep(
    cells: &[Cell],
    layers: &[Vec<usize>],
    above: &[Vec<Span>],
    best: &mut (usize, Vec<Vec<usize>>),
) {
    let n_crossings = crossings(cells, layers, above);
    if n_crossings < best.0 {
        *best = (n_crossings, layers.to_vec());
    }
}

/// Sorts a layer by the places of the neighbours on one side.
fn sort(cells: &[Cell], layers: &mut [Vec<usize>], index: usize, spans: &[Span], down: bool) {
    let other = if down { index - 1 } else { index + 1 };
    let place = places(cells, &layers[other]);
    let own = places(cells, &layers[index]);
    let mut sums: BTreeMap<usize, (i64, i64)> = BTreeMap::new();
    for span in spans {
        let (near, far) = if down { (span.lower, span.upper) } else { (span.upper, span.lower) };
        let sum = sums.entry(near.0).or_default();
        *sum = (sum.0 + place[&far.0] + far.1, sum.1 + 1);
    }
    layers[index].sort_by_cached_key(|cell| {
        let wish = sums.get(cell).map_or(own[cell], |(sum, n)| sum / n);
        (cells[*cell].fixed.unwrap_or(usize::MAX), wish)
    });
    follow(cells, &mut layers[index]);
}

/// Puts cells directly to the right of those that they are always beside.
fn follow(cells: &[Cell], layer: &mut Vec<usize>) {
    let mut followers: BTreeMap<usize, usize> = BTreeMap::new();
    for cell in layer.iter() {
        followers.extend(cells[*cell].after.map(|before| (before, *cell)));
    }
    layer.retain(|cell| cells[*cell].after.is_none());
    let all = layer.iter().flat_map(|cell| [Some(*cell), followers.get(cell).copied()]);
    *layer = all.flatten().collect();
}

/// The left sides of the cells of a layer that is packed to the left.
fn places(cells: &[Cell], layer: &[usize]) -> BTreeMap<usize, i64> {
    let mut place = BTreeMap::new();
    let mut x = 0;
    for cell in layer {
        place.insert(*cell, x);
        x += cells[*cell].width + GAP;
    }
    place
}

fn crossings(cells: &[Cell], layers: &[Vec<usize>], above: &[Vec<Span>]) -> usize {
    let mut n_crossings = 0;
    for index in 1..layers.len() {
        let spans = &above[index];
        if spans.len() > MANY {
            continue;
        }
        let (up, down) = (places(cells, &layers[index - 1]), places(cells, &layers[index]));
        let ends: Vec<(i64, i64)> = spans
            .iter()
            .map(|it| (up[&it.upper.0] + it.upper.1, down[&it.lower.0] + it.lower.1))
            .collect();
        for (place, one) in ends.iter().enumerate() {
            let crosses =
                |other: &&(i64, i64)| (one.0 - other.0).signum() * (one.1 - other.1).signum() < 0;
            n_crossings += ends[..place].iter().filter(crosses).count();
        }
    }
    n_crossings
}

/// Moves the cells of each layer as near to the columns of their neighbours as their order allows.
fn columns(cells: &mut [Cell], layers: &[Vec<usize>], above: &[Vec<Span>]) {
    let n = layers.len();
    for layer in layers {
        let place = places(cells, layer);
        layer.iter().for_each(|cell| cells[*cell].x = place[cell]);
    }
    for round in 0..ROUNDS {
        let is_late = round + 2 >= ROUNDS;
        for index in 0..n {
            pull(cells, layers, above, index, (true, is_late));
        }
        for index in (0..n).rev() {
            pull(cells, layers, above, index, (is_late, true));
        }
    }
    for (layer, spans) in layers.iter().zip(above) {
        straighten(cells, layer, spans, true);
    }
    for index in (1..n).rev() {
        straighten(cells, &layers[index - 1], &above[index], false);
    }
    align(cells, layers, above);
}

/// Moves parts of links that pass several layers to the column of the part above or below, where there is room.
fn align(cells: &mut [Cell], layers: &[Vec<usize>], above: &[Vec<Span>]) {
    let mut sides: Vec<(Option<usize>, Option<usize>)> = vec![(None, None); cells.len()];
    for layer in layers {
        for pair in layer.windows(2) {
            (sides[pair[0]].1, sides[pair[1]].0) = (Some(pair[1]), Some(pair[0]));
        }
    }
    for chain in chains(cells, above) {
        let column = |cells: &[Cell], place: usize| cells[chain[place].0].x + chain[place].1;
        let mut place = 1;
        while place < chain.len() {
            let (upper, lower) = (column(cells, place - 1), column(cells, place));
            let start = { 0..place }.rev().take_while(|it| column(cells, *it) == upper).last();
            let end = { place..chain.len() }.take_while(|it| column(cells, *it) == lower).last();
            let runs =
                [(start.unwrap_or(0)..=place - 1, lower), (place..=end.unwrap_or(place), upper)];
            let has_room = |run: &(RangeInclusive<usize>, i64)| {
                chain[run.0.clone()].iter().all(|&(cell, offset)| {
                    let (before, after) = sides[cell];
                    let left = run.1 - offset;
                    before.is_none_or(|it| cells[it].x + cells[it].width + GAP <= left)
                        && after.is_none_or(|it| left + cells[cell].width + GAP <= cells[it].x)
                })
            };
            if upper != lower
                && let Some((run, x)) = runs.into_iter().find(has_room)
            {
                chain[run].iter().for_each(|(cell, offset)| cells[*cell].x = x - offset);
            }
            place += 1;
        }
    }
}

/// The parts of each link from top to bottom, with the columns in them.
fn chains(cells: &[Cell], above: &[Vec<Span>]) -> Vec<Vec<(usize, i64)>> {
    let mut of_cell: BTreeMap<usize, usize> = BTreeMap::new();
    let mut chains: Vec<Vec<(usize, i64)>> = Vec::new();
    for span in above.iter().flatten().filter(|span| cells[span.lower.0].is_link) {
        let known = of_cell.get(&span.upper.0).copied();
        let chain = known.unwrap_or_else(|| {
            chains.push(if cells[span.upper.0].is_link { vec![span.upper] } else { Vec::new() });
            chains.len() - 1
        });
        chains[chain].push(span.lower);
        of_cell.insert(span.lower.0, chain);
    }
    chains
}
/// Moves the cells of a layer towards the neighbours above, below or on both sides.
fn pull(
    cells: &mut [Cell],
    layers: &[Vec<usize>],
    above: &[Vec<Span>],
    index: usize,
    (up, down): (bool, bool),
) {
    let mut wishes: BTreeMap<usize, (i64, i64)> = BTreeMap::new();
    let mut wish = |near: (usize, i64), far: (usize, i64), weight: i64, cells: &[Cell]| {
        let (sum, total) = wishes.entry(near.0).or_default();
        *sum += weight * (cells[far.0].x + far.1 - near.1);
        *total += weight;
    };
    if up {
        above[index].iter().for_each(|it| wish(it.lower, it.upper, it.weight, cells));
    }
    if down && let Some(spans) = above.get(index + 1) {
        spans.iter().for_each(|it| wish(it.upper, it.lower, it.weight, cells));
    }
    // Cells that want to overlap form a block with a common wish; each cell has its place in the block.
    struct Block {
        sum: i64,
        total: i64,
        cells: Vec<(usize, i64)>,
        width: i64,
    }
    let mut blocks: Vec<Block> = Vec::new();
    for &cell in &layers[index] {
        let wish = wishes.get(&cell);
        let (sum, total) = wish.map_or((cells[cell].x, 1), |(sum, total)| (4 * sum, 4 * total));
        let width = cells[cell].width + GAP;
        let mut block = Block { sum, total, cells: vec![(cell, 0)], width };
        while let Some(before) = blocks.pop_if(|before| {
            before.sum.div_euclid(before.total) + before.width > block.sum.div_euclid(block.total)
        }) {
            let moved = block.cells.iter().map(|(cell, at)| (*cell, at + before.width));
            let mut all = before.cells;
            all.extend(moved);
            block = Block {
                sum: before.sum + block.sum - block.total * before.width,
                total: before.total + block.total,
                width: before.width + block.width,
                cells: all,
            };
        }
        blocks.push(block);
    }
    for block in blocks {
        let x = (block.sum.div_euclid(block.total) + PITCH / 2).div_euclid(PITCH) * PITCH;
        block.cells.iter().for_each(|(cell, at)| cells[*cell].x = x + at);
    }
    // Rounding may bring two blocks too close.
    let mut least = i64::MIN;
    for &cell in &layers[index] {
        cells[cell].x = cells[cell].x.max(least);
        least = cells[cell].x + cells[cell].width + GAP;
    }
}

/// Makes single links straight where there is room.
fn straighten(cells: &mut [Cell], layer: &[usize], spans: &[Span], down: bool) {
    let ends = |it: &Span| if down { (it.lower, it.upper) } else { (it.upper, it.lower) };
    let mut links: BTreeMap<usize, Vec<&Span>> = BTreeMap::new();
    for span in spans {
        links.entry(ends(span).0.0).or_default().push(span);
    }
    for (place, &cell) in layer.iter().enumerate() {
        let Some([only]) = links.get(&cell).map(Vec::as_slice) else { continue };
        let (near, far) = ends(only);
        let x = cells[far.0].x + far.1 - near.1;
        let before = place.checked_sub(1).and_then(|index| layer.get(index));
        let is_right = before.is_none_or(|it| cells[*it].x + cells[*it].width + GAP <= x);
        let after = layer.get(place + 1);
        let is_left = after.is_none_or(|it| x + cells[cell].width + GAP <= cells[*it].x);
        if is_right && is_left && x.rem_euclid(PITCH) == 0 {
            cells[cell].x = x;
        }
    }
}
