//! The sheet: arranges charts, expansions and the legend beside and below each other.

use crate::Style;
use crate::channels::{HALF, Placed};
use crate::content::{Content, Scope};
use crate::exchange::lay_out;
use crate::nest;
use crate::order::{Arc, Graph, Node};
use crate::picture::{Font, Mark, Pen, Picture, Shape, Way};
use std::collections::BTreeMap;

/// The distance between the parts of a sheet.
const GAP: i64 = 36;
/// The margin inside frames and around the sheet.
pub(crate) const MARGIN: i64 = 16;
/// The smallest width at which parts are put below each other.
const WIDTH: i64 = 1000;

/// Draws everything.
pub(crate) fn draw(content: &Content, title: String) -> Picture {
    sheet(charts(content), content, title)
}

/// The charts in one frame with a heading.
pub(crate) fn framed(content: &Content, title: &str) -> Picture {
    let mut frame = Picture::default();
    let wide = frame.heading((MARGIN, MARGIN + 12), title);
    frame.width = MARGIN + wide;
    frame.put(flow(charts(content), content.room), MARGIN, MARGIN + 24);
    (frame.width, frame.height) = (frame.width + MARGIN, frame.height + MARGIN);
    let (width, height) = (frame.width, frame.height);
    let shape = Shape::Rect { x: 0, y: 0, width, height, pen: Pen::Frame };
    frame.marks.insert(0, shape.into());
    frame
}

fn charts(content: &Content) -> Vec<Picture> {
    let is_single = content.scopes.len() == 1;
    content.scopes.iter().map(|scope| draw_scope(scope, !is_single, content.room)).collect()
}

/// The parts on one sheet, with the explanations below.
pub(crate) fn sheet(parts: Vec<Picture>, content: &Content, title: String) -> Picture {
    let mut sheet = Picture { title, ..Picture::default() };
    sheet.put(flow(parts, content.room.map(|room| room - 2 * MARGIN)), MARGIN, MARGIN);
    let style = content.style;
    let mut legend = content.legend.clone();
    let foreign = content.foreign.iter().filter(|it| it.is_missing_in(style));
    let foreign: Vec<_> = foreign.map(|it| (None, it.meaning().to_owned())).collect();
    if !foreign.is_empty() {
        let heading = match style {
            Style::Grafcet => "not IEC 60848:",
            Style::Sfc => "not IEC 61131-3:",
        };
        legend.push((None, heading.to_owned()));
        legend.extend(foreign);
    }
    let mut y = sheet.height + 13;
    for (pen, text) in &legend {
        y += 15;
        let mut x = MARGIN;
        if let Some(pen) = pen {
            sheet.rect((x, y - 9), (16, 11), *pen);
            sheet.rect((x, y - 9), (16, 11), Pen::Detail);
            x += 22;
        }
        let wide = sheet.text((x, y), text, Font::Small);
        sheet.width = sheet.width.max(x + wide);
        sheet.height = y + 4;
    }
    sheet.width += MARGIN;
    sheet.height += MARGIN;
    sheet
}

/// A chart or an expansion, with its heading and perhaps a frame.
fn draw_scope(scope: &Scope, framed: bool, room: Option<i64>) -> Picture {
    let margin = if framed { MARGIN } else { 0 };
    let room = room.map(|room| room - 2 * margin);
    let mut parts = components(scope, room.is_some());
    parts.extend(scope.states.as_ref().map(nest::draw));
    parts.extend(scope.inner.iter().map(|inner| draw_scope(inner, true, room)));
    let body = flow(parts, room);
    let mut picture = Picture::default();
    let mut y = margin + 12;
    let mut widest = picture.heading((margin, y), &scope.heading);
    let small = Font::Small;
    for remark in scope.remarks.iter().flat_map(|remark| remark.lines(small.size(), 500)) {
        y += 17 + 3 * remark.levels();
        picture.rich((margin, y), &remark, small);
        widest = widest.max(remark.width(small.size()));
    }
    picture.width = margin + widest;
    picture.height = y + 4;
    if body.width > 0 {
        picture.put(body, margin, y + 20);
    }
    if framed {
        picture.width += MARGIN;
        picture.height += MARGIN;
        let size = (picture.width, picture.height);
        let frame = Shape::Rect { x: 0, y: 0, width: size.0, height: size.1, pen: Pen::Frame };
        picture.marks.insert(0, frame.into());
    }
    picture
}

/// The connected parts of a chart, each laid out; with less space between the rows on paper.
fn components(scope: &Scope, is_on_paper: bool) -> Vec<Picture> {
    let (nodes, mut drawn): (Vec<_>, Vec<_>) =
        scope.symbols.iter().map(crate::symbol::Symbol::draw).unzip();
    let arcs = scope.links.iter().map(|(from, to)| Arc { from: *from, to: *to }).collect();
    let whole = Graph::new(nodes, arcs);
    let all = whole.components();
    let mut number = vec![(0, 0); whole.nodes.len()];
    for (component, members) in all.iter().enumerate() {
        for (index, node) in members.iter().enumerate() {
            number[*node] = (component, index);
        }
    }
    let mut links: Vec<Vec<Arc>> = vec![Vec::new(); all.len()];
    for arc in &whole.arcs {
        let (component, from) = number[arc.from];
        links[component].push(Arc { from, to: number[arc.to].1 });
    }
    let parts = all.iter().zip(links).map(|(members, arcs)| {
        let of = |all: &[Node]| members.iter().map(|node| all[*node].clone()).collect::<Vec<_>>();
        let drawn_nodes = of(&whole.nodes);
        let plain = if scope.plain.is_empty() { drawn_nodes.clone() } else { of(&scope.plain) };
        let graph = Graph { is_dense: is_on_paper, ..Graph::new(plain, arcs) };
        let placed = lay_out(&graph, drawn_nodes);
        let symbols = members.iter().map(|node| std::mem::take(&mut drawn[*node])).collect();
        let own = members.iter().map(|node| &scope.symbols[*node]);
        let names: Vec<Option<&str>> = own.map(crate::symbol::Symbol::of_link).collect();
        assemble(placed, symbols, &names)
    });
    parts.collect()
}

/// The drawing of a graph with its symbols. `names` are those of steps, for their links.
fn assemble(placed: Placed, symbols: Vec<Picture>, names: &[Option<&str>]) -> Picture {
    let mut picture = Picture::default();
    let is_vertical = |line: &[i64; 4]| line[0] == line[2];
    let name = |index: usize| placed.owners.get(index).and_then(|node| *names.get(*node)?);
    let verticals = || placed.lines.iter().enumerate().filter(|(_, line)| is_vertical(line));
    // A horizontal line has the name of the first link that it joins.
    let mut ends: BTreeMap<i64, BTreeMap<i64, &str>> = BTreeMap::new();
    for (index, [x, top, _, bottom]) in verticals() {
        for y in [top, bottom] {
            if let Some(name) = name(index) {
                ends.entry(*y).or_default().insert(*x, name);
            }
        }
    }
    let joined = |left: i64, right: i64, heights: &[i64]| {
        let all = heights.iter().filter_map(|y| ends.get(y)?.range(left..=right).next());
        all.min().map(|(_, name)| (*name).to_owned())
    };
    let mut draw = |from: (i64, i64), to: (i64, i64), link: Option<String>| {
        let shape = Shape::Line { from, to, pen: Pen::Line };
        picture.marks.push(Mark { link, ..shape.into() });
    };
    for [left, y, right, y2] in placed.lines.iter().filter(|line| !is_vertical(line)) {
        draw((*left, *y), (*right, *y2), joined(*left, *right, &[*y]));
    }
    for [left, right, y] in &placed.doubles {
        let heights = [y - HALF, y + HALF];
        for y in heights {
            draw((*left, y), (*right, y), joined(*left, *right, &heights));
        }
    }
    let mut doubles: BTreeMap<i64, Vec<(i64, i64)>> = BTreeMap::new();
    for [left, right, y] in &placed.doubles {
        doubles.entry(*y).or_default().push((*left, *right));
    }
    for (x, y) in &placed.crossings {
        let lines = doubles.get(y).map(Vec::as_slice).unwrap_or_default();
        if lines.iter().any(|(left, right)| left <= x && x <= right) {
            picture.add(Shape::Crossing { x: *x, y: y - HALF });
            picture.add(Shape::Crossing { x: *x, y: y + HALF });
        } else {
            picture.add(Shape::Crossing { x: *x, y: *y });
        }
    }
    for (index, [x1, y1, x2, y2]) in verticals() {
        let link = name(index);
        let shape = Shape::Line { from: (*x1, *y1), to: (*x2, *y2), pen: Pen::Line };
        picture.marks.push(Mark { link: link.map(str::to_owned), ..shape.into() });
    }
    for (x, y) in &placed.arrows {
        picture.add(Shape::Arrow { x: *x, y: *y, way: Way::Up });
    }
    for (mut symbol, (x, y)) in symbols.into_iter().zip(&placed.nodes) {
        symbol.shift(*x, *y);
        picture.marks.append(&mut symbol.marks);
    }
    picture.shift(-placed.left, 0);
    picture.width = placed.right - placed.left;
    picture.height = placed.height;
    picture
}

/// Puts parts beside each other, and below if a row is full: on paper, if it is wider than a page.
fn flow(parts: Vec<Picture>, room: Option<i64>) -> Picture {
    let area: i64 = parts.iter().map(|part| (part.width + GAP) * (part.height + GAP)).sum();
    let widest = parts.iter().map(|part| part.width).max().unwrap_or(0);
    let most = room.unwrap_or(WIDTH.max(widest).max(area.max(0).isqrt() * 3 / 2));
    let mut whole = Picture::default();
    let (mut x, mut y, mut high) = (0, 0, 0);
    for part in parts {
        if x > 0 && x + part.width > most {
            (x, y, high) = (0, y + high + GAP, 0);
        }
        let next = x + part.width + GAP;
        high = high.max(part.height);
        whole.put(part, x, y);
        x = next;
    }
    whole
}
