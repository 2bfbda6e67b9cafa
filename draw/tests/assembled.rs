//! The pages of a drawing, joined again: how they belong together is read only from what is printed on them, such as the marks at the ends of cut links.

use crate::expected::Vocabulary;
use crate::pages::{reference, ring};
use crate::random::random_chart;
use crate::read_back::{difference_of, flaws, parsed, rounds};
use crate::reader::{self, Line, Rect, Shapes};
use grafsynth_draw::{Options, Paper, Style, TitleBlock, layout, page_svg, pages};
use grafsynth_ir::chart::Design;
use std::collections::BTreeMap;

/// Where on its page a link is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Side {
    Top,
    Bottom,
    Left,
    Right,
}

/// A page and one of its columns, both from 1.
type Place = (usize, usize);

/// The ends of links by what is printed: the place, the place of the other end, the side, and the step, perhaps with a number. A link that is drawn from one
/// column to the next has the number of its line instead.
type Ends = BTreeMap<(Place, Place, Side, String), (i64, i64)>;

/// The lines that lead from the bottom of a column to the top of the next one, which are removed: where each begins and ends. Each crosses the line between the
/// columns, and consists of five lines.
fn turns(shapes: &mut Shapes, separator: i64) -> Result<Vec<[(i64, i64); 2]>, String> {
    let mut found = Vec::new();
    let crosses = |line: &Line| line.y1 == line.y2 && line.x1 < separator && separator < line.x2;
    while let Some(at) = shapes.links.iter().position(crosses) {
        let across = shapes.links.remove(at);
        let mut next = |from: (i64, i64)| -> Result<(i64, i64), String> {
            let ends_here = |line: &Line| line.ends().contains(&from);
            let at = shapes.links.iter().position(ends_here);
            let line = shapes.links.remove(at.ok_or_else(|| format!("a loose end at {from:?}"))?);
            Ok(if line.ends()[0] == from { line.ends()[1] } else { line.ends()[0] })
        };
        let end = next((across.x2, across.y2))?;
        let lane = next((across.x1, across.y1))?;
        let below = next(lane)?;
        let start = next(below)?;
        if start.1 >= below.1 || end.1 <= across.y1 || lane.0 != across.x1 || below.1 != lane.1 {
            return Err(format!("a line between columns from {start:?} to {end:?}"));
        }
        found.push([start, end]);
    }
    Ok(found)
}

/// The columns of a page without its title block and marks, which are added to `ends`.
fn content(svg: &str, number: usize, ends: &mut Ends) -> Result<Vec<Shapes>, String> {
    let mut shapes = reader::shapes(svg)?;
    let block = shapes.insets.iter().map(|it| it.y).max().ok_or("no title block")?;
    shapes.insets.retain(|it| it.y < block);
    shapes.texts.retain(|it| it.y < block);
    let separators: Vec<i64> = shapes.separators.drain(..).map(|line| line.x1).collect();
    let column = |x: i64| 1 + separators.iter().filter(|line| **line < x).count();
    let mut all = Ends::new();
    for (before, separator) in (1..).zip(&separators) {
        for (n, [start, end]) in turns(&mut shapes, *separator)?.into_iter().enumerate() {
            let (from, to) = ((number, before), (number, before + 1));
            if (column(start.0), column(end.0)) != (from.1, to.1) {
                return Err(format!("a line from {start:?} to {end:?}"));
            }
            all.insert((from, to, Side::Bottom, format!("line {n}")), start);
            all.insert((to, from, Side::Top, format!("line {n}")), end);
        }
    }
    let marks = shapes.texts.extract_if(.., |it| reference(&it.text).is_some());
    for text in marks.collect::<Vec<_>>() {
        let (step, (page, place)) = reference(&text.text).ok_or("no mark")?;
        let y = text.y - 4;
        let ticks = [(text.x - 7, 4, 0), (text.x - 3, 0, 4), (text.x + text.width + 3, 0, 4)];
        let at = ticks.iter().find_map(|(x, dx, dy)| {
            let tick = Line { x1: x - dx, y1: y - dy, x2: x + dx, y2: y + dy };
            let tick = shapes.details.iter().position(|line| *line == tick)?;
            let ends_here =
                |line: &Line| (line.x1, line.y1) == (*x, y) || (line.x2, line.y2) == (*x, y);
            let lead = shapes.links.iter().position(ends_here)?;
            Some((tick, lead, (*x, y), *dx == 4))
        });
        let (tick, lead, end, is_down) = at.ok_or_else(|| format!("no end at {}", text.text))?;
        shapes.details.remove(tick);
        let lead = shapes.links.remove(lead);
        let cut = if (lead.x1, lead.y1) == end { (lead.x2, lead.y2) } else { (lead.x1, lead.y1) };
        let side = match (is_down, end.0 > cut.0, end.1 > cut.1) {
            (true, _, true) => Side::Bottom,
            (true, _, false) => Side::Top,
            (false, true, _) => Side::Right,
            (false, false, _) => Side::Left,
        };
        let other = (page.unwrap_or(number), place.unwrap_or(1));
        let before = all.insert(((number, column(end.0)), other, side, step.to_owned()), cut);
        if before.is_some() {
            return Err(format!("page {number}: {} twice", text.text));
        }
    }
    ends.extend(all);
    Ok((0..=separators.len()).map(|at| part(&shapes, &|x| column(x) == at + 1)).collect())
}

/// The shapes that begin in a column.
fn part(all: &Shapes, is_here: &dyn Fn(i64) -> bool) -> Shapes {
    let rects = |all: &[Rect]| all.iter().filter(|it| is_here(it.x)).copied().collect();
    let lines = |all: &[Line]| all.iter().filter(|it| is_here(it.x1)).copied().collect();
    Shapes {
        boxes: rects(&all.boxes),
        frames: rects(&all.frames),
        insets: rects(&all.insets),
        links: lines(&all.links),
        details: lines(&all.details),
        bars: lines(&all.bars),
        texts: all.texts.iter().filter(|it| is_here(it.x)).cloned().collect(),
        dots: all.dots.iter().filter(|it| is_here(it.0)).copied().collect(),
        ..Shapes::default()
    }
}

/// All pages as one drawing.
fn assembled(svgs: &[String]) -> Result<Shapes, String> {
    let mut ends = Ends::new();
    let mut parts: Vec<(Place, Shapes)> = Vec::new();
    for (number, svg) in (1..).zip(svgs) {
        let columns = content(svg, number, &mut ends)?;
        parts.extend((1..).zip(columns).map(|(column, shapes)| ((number, column), shapes)));
    }
    let mut pairs = Vec::new();
    for ((page, other, side, step), here) in &ends {
        let opposite = match side {
            Side::Bottom => Side::Top,
            Side::Right => Side::Left,
            _ => continue,
        };
        let there = ends.get(&(*other, *page, opposite, step.clone()));
        let there = there.ok_or_else(|| format!("{step}: pages {page:?} and {other:?}"))?;
        if page >= other {
            return Err(format!("{step}: page {other:?} before page {page:?}"));
        }
        pairs.push((*page, *other, *side, (*here, *there)));
    }
    if ends.len() != 2 * pairs.len() {
        return Err("an end without another one".to_owned());
    }
    // Pages beside each other are moved until their links meet; all others are below each other, and so far
    // to the right that no line from page to page is vertical.
    let mut origins: BTreeMap<Place, (i64, i64)> = BTreeMap::new();
    for ((page, _), far) in parts.iter().zip(1i64..) {
        let mut left =
            pairs.iter().filter(|(_, other, side, _)| (*other, *side) == (*page, Side::Right));
        let origin = left.next().and_then(|(from, _, _, (end, start))| {
            let (x, y) = origins.get(from)?;
            Some((x + end.0 - start.0, y + end.1 - start.1))
        });
        origins.insert(*page, origin.unwrap_or((10_000 * far, 10_000 * far)));
    }
    let mut all = Shapes::default();
    for (page, part) in parts {
        all.add(part, origins[&page]);
    }
    for (page, other, side, (end, start)) in pairs {
        let at = |page: Place, (x, y): (i64, i64)| {
            let (dx, dy) = origins[&page];
            (x + dx, y + dy)
        };
        let ((x1, y1), (x2, y2)) = (at(page, end), at(other, start));
        if side == Side::Bottom {
            // Pages that were placed by other links may meet here already.
            all.links.extend(((x1, y1) != (x2, y2)).then_some(Line { x1, y1, x2, y2 }));
            continue;
        }
        if (x1, y1) != (x2, y2) {
            return Err(format!("pages {page:?} and {other:?} do not fit"));
        }
        let mut n_joined = 0;
        for y in [y1 - 2, y1, y1 + 2] {
            let left = all.links.iter().position(|it| (it.x2, it.y1, it.y2) == (x1, y, y));
            let right = all.links.iter().position(|it| (it.x1, it.y1, it.y2) == (x1, y, y));
            if let (Some(left), Some(right)) = (left, right) {
                all.links[left].x2 = all.links[right].x2;
                all.links.remove(right);
                n_joined += 1;
            }
        }
        if n_joined == 0 {
            return Err(format!("no line at page {other:?}"));
        }
    }
    Ok(all)
}

/// Why pages do not match their chart.
fn difference(design: &Design, vocabulary: &Vocabulary, svgs: &[String]) -> Option<String> {
    let region = assembled(svgs).and_then(|shapes| reader::region(shapes, Style::Grafcet));
    match region {
        Ok(read) => difference_of(Style::Grafcet, design, &[], vocabulary, read),
        Err(why) => Some(why),
    }
}

fn on_paper(design: &Design) -> Vec<String> {
    let options = Options { paper: Some(Paper::A4), ..Options::default() };
    let picture = layout(design, &options).expect("it is there");
    pages(&picture, Paper::A4, &TitleBlock::default()).iter().map(page_svg).collect()
}

/// Charts without hierarchy; each second one has links that fit no structure.
fn chart(number: u64) -> Design {
    parsed(&random_chart(number / 2 * 6 + number % 2 * 3))
}

#[test]
fn pages_are_their_chart() {
    let (mut n_down, mut n_right, mut n_turns) = (0, 0, 0);
    for number in 0..rounds(60, 500) {
        let design = chart(number);
        let svgs = on_paper(&design);
        let why = difference(&design, &Vocabulary::of(&design), &svgs);
        assert_eq!(why, None, "{number}");
        for svg in &svgs {
            assert_eq!(flaws(svg), None, "{number}");
        }
        let mut ends = Ends::new();
        for (number, svg) in (1..).zip(&svgs) {
            content(svg, number, &mut ends).expect("it was read");
        }
        let is_turn = |step: &str| step.strip_prefix("line ").is_some();
        n_turns += ends.keys().filter(|(.., step)| is_turn(step)).count() / 2;
        n_down += ends.keys().filter(|(_, _, side, _)| *side == Side::Bottom).count();
        n_right += ends.keys().filter(|(_, _, side, _)| *side == Side::Right).count();
    }
    println!("{n_down} ends at the bottom, {n_right} at the right; {n_turns} lines to a column");
    assert!(n_down > 100 && n_right > 40 && n_turns > 8, "{n_down} {n_right} {n_turns}");
}

/// A mark that is lost, or that names another page or step, is noticed; so is one at another place, and a line between columns that is lost.
#[test]
fn spoiled_marks_are_noticed() {
    let (mut n_spoiled, mut n_lines) = (0, 0);
    for design in (0..rounds(6, 100)).map(chart).chain([ring(50)]) {
        let vocabulary = Vocabulary::of(&design);
        let svgs = on_paper(&design);
        for (page, svg) in svgs.iter().enumerate() {
            let separators = reader::shapes(svg).expect("it was read").separators;
            let across = |line: &&str| {
                let shapes = reader::shapes(&format!("<svg>{line}</svg>")).unwrap_or_default();
                let is_it = |it: &Line| separators.iter().any(|at| it.x1 < at.x1 && at.x1 < it.x2);
                shapes.links.iter().any(is_it)
            };
            for line in svg.lines().filter(|line| line.contains("<line")).filter(across) {
                let mut spoiled = svgs.clone();
                spoiled[page] = svg.replacen(line, "", 1);
                assert!(difference(&design, &vocabulary, &spoiled).is_some(), "{line}");
                n_lines += 1;
            }
            let is_mark =
                |line: &&str| [" / page ", " / column "].iter().any(|it| line.contains(it));
            for line in svg.lines().filter(is_mark) {
                let (before, after) = line.rsplit_once(" / ").expect("it is there");
                let (kind, number) = after.split_once(' ').expect("it is there");
                let (at, _) = before.split_once("x=\"").expect("a text");
                let changed = [
                    String::new(),
                    format!("{before} / {kind} 9{number}"),
                    format!("{before}q / {after}"),
                    format!("{at}x=\"1{}", &line[at.len() + 3..]),
                ];
                for other in changed {
                    let mut spoiled = svgs.clone();
                    spoiled[page] = svg.replacen(line, &other, 1);
                    assert!(
                        difference(&design, &vocabulary, &spoiled).is_some(),
                        "{line}\n{other}"
                    );
                    n_spoiled += 1;
                }
            }
        }
    }
    println!("{n_spoiled} spoiled marks, {n_lines} spoiled lines between columns");
    assert!(n_spoiled > 100 && n_lines > 0, "{n_spoiled} {n_lines}");
}
