//! The pages of a drawing, joined again: how they belong together is read only from what is printed on them, such as the marks at the ends of cut links.

use crate::expected::Vocabulary;
use crate::random::random_chart;
use crate::read_back::{difference_of, parsed, rounds};
use crate::reader::{self, Line, Shapes};
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

/// The ends of links by what is printed: the page, the page of the other end, the side, and the step, perhaps with a number.
type Ends = BTreeMap<(usize, usize, Side, String), (i64, i64)>;

/// The shapes of a page without its title block and marks, which are added to `ends`.
fn content(svg: &str, number: usize, ends: &mut Ends) -> Result<Shapes, String> {
    let mut shapes = reader::shapes(svg)?;
    let block = shapes.insets.iter().map(|it| it.y).max().ok_or("no title block")?;
    shapes.insets.retain(|it| it.y < block);
    shapes.texts.retain(|it| it.y < block);
    let marks: Vec<_> = shapes.texts.extract_if(.., |it| it.text.contains(" / page ")).collect();
    for text in marks {
        let (step, page) = text.text.rsplit_once(" / page ").ok_or("no page")?;
        let page: usize = page.parse().map_err(|_| format!("page {page}"))?;
        let y = text.y - 4;
        let ticks = [(text.x - 7, 4, 0), (text.x - 3, 0, 4), (text.x + text.width + 3, 0, 4)];
        let place = ticks.iter().find_map(|(x, dx, dy)| {
            let tick = Line { x1: x - dx, y1: y - dy, x2: x + dx, y2: y + dy };
            let tick = shapes.details.iter().position(|line| *line == tick)?;
            let ends_here =
                |line: &Line| (line.x1, line.y1) == (*x, y) || (line.x2, line.y2) == (*x, y);
            let lead = shapes.links.iter().position(ends_here)?;
            Some((tick, lead, (*x, y), *dx == 4))
        });
        let (tick, lead, end, is_down) = place.ok_or_else(|| format!("no end at {}", text.text))?;
        shapes.details.remove(tick);
        let lead = shapes.links.remove(lead);
        let cut = if (lead.x1, lead.y1) == end { (lead.x2, lead.y2) } else { (lead.x1, lead.y1) };
        let side = match (is_down, end.0 > cut.0, end.1 > cut.1) {
            (true, _, true) => Side::Bottom,
            (true, _, false) => Side::Top,
            (false, true, _) => Side::Right,
            (false, false, _) => Side::Left,
        };
        let before = ends.insert((number, page, side, step.to_owned()), cut);
        if before.is_some() {
            return Err(format!("page {number}: {} twice", text.text));
        }
    }
    Ok(shapes)
}

/// All pages as one drawing.
fn assembled(svgs: &[String]) -> Result<Shapes, String> {
    let mut ends = Ends::new();
    let mut parts = Vec::new();
    for (number, svg) in (1..).zip(svgs) {
        parts.push(content(svg, number, &mut ends)?);
    }
    let mut pairs = Vec::new();
    for ((page, other, side, step), here) in &ends {
        let opposite = match side {
            Side::Bottom => Side::Top,
            Side::Right => Side::Left,
            _ => continue,
        };
        let there = ends.get(&(*other, *page, opposite, step.clone()));
        let there = there.ok_or_else(|| format!("{step}: pages {page} and {other}"))?;
        if page >= other {
            return Err(format!("{step}: page {other} before page {page}"));
        }
        pairs.push((*page, *other, *side, (*here, *there)));
    }
    if ends.len() != 2 * pairs.len() {
        return Err("an end without another one".to_owned());
    }
    // Pages beside each other are moved until their links meet; all others are below each other, and so far
    // to the right that no line from page to page is vertical.
    let mut origins: Vec<(i64, i64)> = Vec::new();
    for (page, far) in (1..=svgs.len()).zip(1i64..) {
        let mut left =
            pairs.iter().filter(|(_, other, side, _)| (*other, *side) == (page, Side::Right));
        let origin = left.next().and_then(|(from, _, _, (end, start))| {
            let (x, y) = origins.get(from - 1)?;
            Some((x + end.0 - start.0, y + end.1 - start.1))
        });
        origins.push(origin.unwrap_or((10_000 * far, 10_000 * far)));
    }
    let mut all = Shapes::default();
    for (part, origin) in parts.into_iter().zip(&origins) {
        all.add(part, *origin);
    }
    for (page, other, side, (end, start)) in pairs {
        let at = |page: usize, (x, y): (i64, i64)| {
            let (dx, dy) = origins[page - 1];
            (x + dx, y + dy)
        };
        let ((x1, y1), (x2, y2)) = (at(page, end), at(other, start));
        if side == Side::Bottom {
            // Pages that were placed by other links may meet here already.
            all.links.extend(((x1, y1) != (x2, y2)).then_some(Line { x1, y1, x2, y2 }));
            continue;
        }
        if (x1, y1) != (x2, y2) {
            return Err(format!("pages {page} and {other} do not fit"));
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
            return Err(format!("no line at page {other}"));
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
    let (mut n_down, mut n_right) = (0, 0);
    for number in 0..rounds(60, 500) {
        let design = chart(number);
        let svgs = on_paper(&design);
        let why = difference(&design, &Vocabulary::of(&design), &svgs);
        assert_eq!(why, None, "{number}");
        let mut ends = Ends::new();
        for (number, svg) in (1..).zip(&svgs) {
            content(svg, number, &mut ends).expect("it was read");
        }
        n_down += ends.keys().filter(|(_, _, side, _)| *side == Side::Bottom).count();
        n_right += ends.keys().filter(|(_, _, side, _)| *side == Side::Right).count();
    }
    println!("{n_down} ends at the bottom, {n_right} at the right");
    assert!(n_down > 100 && n_right > 40, "{n_down} {n_right}");
}

/// A mark that is lost, or that names another page or step, is noticed; so is one at another place.
#[test]
fn spoiled_marks_are_noticed() {
    let mut n_spoiled = 0;
    for number in 0..rounds(6, 100) {
        let design = chart(number);
        let vocabulary = Vocabulary::of(&design);
        let svgs = on_paper(&design);
        for (page, svg) in svgs.iter().enumerate() {
            for line in svg.lines().filter(|line| line.contains(" / page ")) {
                let (before, after) = line.split_once(" / page ").expect("it is there");
                let (at, _) = before.split_once("x=\"").expect("a text");
                let changed = [
                    String::new(),
                    format!("{before} / page 9{after}"),
                    format!("{before}q / page {after}"),
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
    println!("{n_spoiled} spoiled pages");
    assert!(n_spoiled > 100, "{n_spoiled}");
}
