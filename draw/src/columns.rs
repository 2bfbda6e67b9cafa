//! Narrow parts of a drawing as columns of one page, which are read from left to right.

use crate::picture::{Pen, Picture, Shape, Way};

/// The distance between columns, with a line in the middle.
const GAP: i64 = 24;
/// The distance between links that lead from the bottom of a column to the top of the next one.
const LANE: i64 = 10;

/// Where a row of a drawing is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Place {
    /// Its first page, from 1.
    pub(crate) page: usize,
    /// Its column, from 1.
    pub(crate) column: usize,
    /// The number of columns of its page.
    pub(crate) n_columns: usize,
}

/// What a row of a drawing needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Need {
    /// The number of pages that it is cut into from left to right.
    pub(crate) n_pages: usize,
    /// Its width with its marks, if it is on a page with the row before (second index 1) and with the next one (first index 1).
    pub(crate) width: [[i64; 2]; 2],
    /// The number of links that are drawn to the next row, if both are on one page.
    pub(crate) n_drawn: usize,
}

/// The width between two columns.
fn gap(n_links: usize) -> i64 {
    GAP + LANE * i64::try_from(n_links).unwrap_or(i64::MAX / 1000)
}

/// Puts as many rows as possible beside each other on each page.
pub(crate) fn pack(needs: &[Need], room: i64) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    // The number of pages before the next row, and the width of all columns before the last one.
    let (mut n_pages, mut width) = (0, 0);
    for (index, need) in needs.iter().enumerate() {
        let before = index.checked_sub(1).and_then(|at| needs.get(at).zip(places.last().copied()));
        let beside = before.filter(|(last, _)| last.n_pages == 1 && need.n_pages == 1);
        let beside = beside.map(|(last, place)| {
            let own = last.width[1][usize::from(place.column > 1)];
            (width + own + gap(last.n_drawn), place)
        });
        if let Some((start, place)) = beside.filter(|(start, _)| start + need.width[0][1] <= room) {
            let column = place.column + 1;
            places.push(Place { page: place.page, column, n_columns: column });
            places.iter_mut().rev().take(column).for_each(|place| place.n_columns = column);
            width = start;
        } else {
            places.push(Place { page: n_pages + 1, column: 1, n_columns: 1 });
            n_pages += need.n_pages;
            width = 0;
        }
    }
    places
}

/// A column with the links that come from the column before, and lead to the next one.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Column {
    pub(crate) picture: Picture,
    /// Where links end above the drawing, from left to right.
    pub(crate) above: Vec<(i64, i64)>,
    /// Where links begin below the drawing, from left to right, and whether each leads up.
    pub(crate) below: Vec<((i64, i64), bool)>,
}

/// The columns of a page beside each other, with the links between them.
pub(crate) fn beside(columns: Vec<Column>) -> Picture {
    let mut page = Picture::default();
    let height = columns.iter().map(|column| column.picture.height).max().unwrap_or(0);
    let mut before: Vec<((i64, i64), bool)> = Vec::new();
    for (index, column) in columns.into_iter().enumerate() {
        let mut x = page.width;
        if index > 0 {
            let start = x + GAP / 2;
            x += gap(before.len());
            page.line((x - GAP / 2, 0), (x - GAP / 2, height), Pen::Grid);
            // The first link is the outermost, so no two of them cross.
            for (lane, ((from, leads_up), to)) in (0..).zip(before.iter().zip(&column.above).rev())
            {
                let (middle, to) = (start + LANE * lane, (to.0 + x, to.1));
                page.line(*from, (middle, from.1), Pen::Line);
                page.line((middle, from.1), (middle, to.1), Pen::Line);
                page.line((middle, to.1), to, Pen::Line);
                if !leads_up {
                    let y = (from.1 + to.1) / 2;
                    page.add(Shape::Arrow { x: middle, y, way: Way::Up });
                }
            }
        }
        let moved = column.below.iter().map(|((at, y), leads_up)| ((at + x, *y), *leads_up));
        before = moved.collect();
        page.put(column.picture, x, 0);
    }
    page
}
