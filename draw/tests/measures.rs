//! Measures of drawings: what an edit moves, the size of letters on paper, and the links that pages cut. The figures are in docs/benchmarks.md.

use crate::random::random_chart;
use crate::read_back::{parsed, rounds};
use grafsynth_draw::picture::{Font, Pen, Picture, Shape};
use grafsynth_draw::{Options, Paper, TitleBlock, layout, pages};
use grafsynth_ir::chart::{Design, Item, Path, Step, Transition};
use grafsynth_ir::{Name, Span};
use std::collections::BTreeMap;

fn drawn(design: &Design) -> Picture {
    layout(design, &Options::default()).expect("it is there")
}

/// The upper left corner of the box of each step, by the id of the step.
fn steps(picture: &Picture) -> BTreeMap<String, (i64, i64)> {
    let mut all = BTreeMap::new();
    for mark in &picture.marks {
        if let (Shape::Rect { x, y, width, pen: Pen::Line, .. }, Some(element)) =
            (&mark.shape, &mark.element)
        {
            // The first box of a step is its own; those of its actions follow. The axis does not depend on the width of the name. A transition has the
            // number of its item in its id.
            if !element.id.contains("-t") {
                all.entry(element.id.clone()).or_insert((x + width / 2, *y));
            }
        }
    }
    all
}

/// A new step in the middle of a link (or, if `is_alternative`, beside it): the links of the transition lead to the new step, and those of a new transition
/// from there to the old targets.
fn edited(design: &Design, number: usize, is_alternative: bool) -> Design {
    let mut design = design.clone();
    let new = Name::new("a_new_step", Span::default());
    let items = &mut design.charts[0].items;
    let links: Vec<usize> = (0..items.len())
        .filter(|index| {
            matches!(&items[*index], Item::Transition(one) if one.sources.len() == 1 && one.targets.len() == 1)
        })
        .collect();
    let place = links[number % links.len()];
    let Item::Transition(link) = &mut items[place] else { unreachable!("it was chosen so") };
    let below = Transition {
        sources: vec![Path::from(new.clone())],
        targets: link.targets.clone(),
        ..Transition::default()
    };
    let above = Transition {
        sources: link.sources.clone(),
        targets: vec![Path::from(new.clone())],
        ..Transition::default()
    };
    if !is_alternative {
        link.targets.clone_from(&above.targets);
    }
    let step = Step { name: new, ..Step::default() };
    items.insert(place + 1, Item::Transition(below));
    if is_alternative {
        items.insert(place + 1, Item::Transition(above));
    }
    items.insert(place, Item::Step(step));
    design
}

/// The number of pairs of steps whose places differ in the direction of `key`, and how many of them change their order.
fn pairs(
    before: &BTreeMap<String, (i64, i64)>,
    after: &BTreeMap<String, (i64, i64)>,
    key: impl Fn(&(i64, i64)) -> i64,
) -> (usize, usize) {
    let (mut all, mut changed) = (0, 0);
    for (index, (one, place)) in before.iter().enumerate() {
        for (other, other_place) in before.iter().skip(index + 1) {
            let old = key(place).cmp(&key(other_place));
            all += usize::from(old.is_ne());
            changed += usize::from(
                old.is_ne() && key(&after[one]).cmp(&key(&after[other])) == old.reverse(),
            );
        }
    }
    (all, changed)
}

/// One more step moves the others by at most one row, and does not change their order.
#[test]
fn one_more_step_leaves_the_others_where_they_are() {
    // A row is a step with the transition below it.
    let two = steps(&drawn(&parsed("chart c { initial step a step b a -> b b -> a }")));
    let row = two["c.b"].1 - two["c.a"].1;
    let (mut across, mut down, mut shifts) = ((0, 0), (0, 0), Vec::new());
    for number in 0..rounds(60, 500) {
        // Structured charts: even seeds, without hierarchy.
        let design = parsed(&random_chart(number * 6));
        let place = usize::try_from(number * 7).expect("it is small");
        let other = edited(&design, place, number % 3 == 2);
        let (before, after) = (steps(&drawn(&design)), steps(&drawn(&other)));
        let sum = |sum: (usize, usize), more: (usize, usize)| (sum.0 + more.0, sum.1 + more.1);
        across = sum(across, pairs(&before, &after, |place| place.0));
        down = sum(down, pairs(&before, &after, |place| place.1));
        shifts.extend(before.iter().map(|(id, place)| (after[id].1 - place.1).abs()));
    }
    shifts.sort_unstable();
    let median = shifts[shifts.len() / 2];
    println!("changed order: {across:?} across, {down:?} down; median shift {median} of {row} px");
    for (all, changed) in [across, down] {
        assert!(changed * 100 <= all * 5, "{changed} of {all} pairs of steps change their order");
    }
    assert!(median <= row, "median shift {median}, a row has {row}");
}

/// On paper, letters have at least 7 points, and pages cut few links.
#[test]
fn letters_on_paper_are_large_enough() {
    let (mut n_small, mut n_pages, mut n_cut, mut n_links) = (0, 0, 0, 0);
    for seed in 0..rounds(60, 1_000) {
        let picture = drawn(&parsed(&random_chart(seed * 2)));
        let all = pages(&picture, Paper::A4, &TitleBlock::default());
        for page in &all {
            // 96 pixels are 72 points.
            n_small += usize::from(Font::Small.size() * page.percent * 72 < 7 * 96 * 100);
        }
        n_pages += all.len();
        let links = picture.marks.iter().filter(|mark| mark.link.is_some());
        n_links += links.count();
        let is_mark = |text: &str| text.contains(" / page ");
        n_cut += (all.iter().flat_map(|page| &page.picture.marks))
            .filter(|mark| matches!(&mark.shape, Shape::Text { text, .. } if is_mark(text)))
            .count()
            / 2;
    }
    println!("{n_small} of {n_pages} pages with small letters, {n_cut} of {n_links} links are cut");
}
