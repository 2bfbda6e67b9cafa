//! Measures of drawings: what an edit moves, the size of letters on paper, and the links that pages cut. The figures are in docs/benchmarks.md.

use crate::pages::reference;
use crate::random::random_chart;
use crate::read_back::{parsed, rounds};
use grafsynth_draw::picture::{Font, Pen, Picture, Shape};
use grafsynth_draw::{Blank, Counts, Options, Page, Paper, TitleBlock, layout, pages};
use grafsynth_ir::chart::{Design, Item, Path, Step, Transition};
use grafsynth_ir::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// A chart of sequences, alternatives, parallel branches and loops, without hierarchy.
fn structured(number: u64) -> String {
    random_chart(number / 2 * 6 + number % 2 * 4)
}

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
        let design = parsed(&structured(number));
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

/// An exercise and its solution have the same order, and so has a drawing with counts: steps above and below each other, and side by side in a row.
#[test]
fn what_is_added_or_left_blank_does_not_change_the_order() {
    let blank = Blank { actions: true, receptivities: true, names: true };
    let counts = Counts { by_element: BTreeMap::new(), note: "a note".to_owned() };
    let others = [
        Options { blank, ..Options::default() },
        Options { blank: Blank { names: false, ..blank }, ..Options::default() },
        Options { counts: Some(&counts), ..Options::default() },
    ];
    let mut n_pairs = 0;
    for number in 0..rounds(60, 500) {
        let text = random_chart(number);
        // Parts without links between them are put where there is room.
        if text.matches("initial step").count() > 1 {
            continue;
        }
        let design = parsed(&text);
        let before = steps(&drawn(&design));
        for options in &others {
            let after = steps(&layout(&design, options).expect("it is there"));
            for (index, (one, place)) in before.iter().enumerate() {
                for (other, other_place) in before.iter().skip(index + 1) {
                    let is_in_row = place.1 == other_place.1;
                    let key = |place: &(i64, i64)| if is_in_row { place.0 } else { place.1 };
                    let orders = [&before, &after].map(|all| key(&all[one]).cmp(&key(&all[other])));
                    assert_eq!(orders[0], orders[1], "{number}: {one} and {other}");
                    n_pairs += 1;
                }
            }
        }
    }
    assert!(n_pairs > 1000, "{n_pairs}");
}

/// The number of links of a chart: one for each step before or after a transition.
fn n_links(design: &Design) -> usize {
    let items = design.charts.iter().flat_map(|chart| &chart.items);
    let links = items.map(|item| match item {
        Item::Transition(one) => one.sources.len() + one.targets.len(),
        _ => 0,
    });
    links.sum()
}

fn count(picture: &Picture, is_it: impl Fn(&str) -> bool) -> usize {
    let texts = picture.marks.iter().filter_map(|mark| match &mark.shape {
        Shape::Text { text, .. } => Some(text),
        _ => None,
    });
    texts.filter(|text| is_it(text)).count()
}

/// Links cross rarely: never in charts with structure, and in charts with links between any steps at most so often.
#[test]
fn links_cross_rarely() {
    let crossings = |text: &str| {
        let picture = drawn(&parsed(text));
        let marks = picture.marks.iter();
        marks.filter(|mark| matches!(mark.shape, Shape::Crossing { .. })).count() as u64
    };
    let sum = |all: &mut dyn Iterator<Item = String>| all.map(|text| crossings(&text)).sum::<u64>();
    let n = rounds(20, 60);
    let with_structure = sum(&mut (0..n).map(structured));
    let others = sum(&mut (0..n).map(|it| random_chart(it / 2 * 6 + 1 + it % 2 * 2)));
    println!("crossings in {n} charts: {with_structure} with structure, {others} without");
    assert_eq!(with_structure, 0);
    assert!(others * 10 <= 63 * n, "{others}");
}

/// The marks of cut links on a page: how many of them are at a side, at the upper or lower end of a link that leads up, and at another one.
fn kinds_of_marks(page: &Picture) -> [usize; 3] {
    let mut kinds = [0; 3];
    let has = |is_it: &dyn Fn(&Shape) -> bool| page.marks.iter().any(|mark| is_it(&mark.shape));
    for mark in &page.marks {
        let Shape::Text { x, y, text, .. } = &mark.shape else { continue };
        if reference(text).is_none() {
            continue;
        }
        let tick = |shape: &Shape| matches!(shape, Shape::Line { from, to, .. } if (from.0, to.0, from.1) == (x - 11, x - 3, y - 4) && from.1 == to.1);
        let arrow = |shape: &Shape| matches!(shape, Shape::Arrow { x: at, y: tip, .. } if *at == x - 7 && (tip - y).abs() < 30);
        kinds[if !has(&tick) {
            0
        } else if has(&arrow) {
            1
        } else {
            2
        }] += 1;
    }
    kinds
}

/// The drawing for pages of A4, as `draw --page A4` lays it out.
fn on_paper(design: &Design) -> Picture {
    let options = Options { paper: Some(Paper::A4), ..Options::default() };
    layout(design, &options).expect("it is there")
}

/// The number of lines of links that are longer than a page of this drawing, so that no choice of cuts keeps them whole.
fn n_longer_than_a_page(picture: &Picture, pages: &[Page]) -> usize {
    // The margins and the title block.
    let inner = |page: &Page| (page.picture.width - 76, page.picture.height - 76 - 48);
    let Some((wide, high)) = pages.iter().map(inner).max() else { return 0 };
    let long = picture.marks.iter().filter_map(|mark| match mark.shape {
        Shape::Line { from, to, pen: Pen::Line } if mark.link.is_some() => {
            let is_long = to.1 - from.1 > high || to.0 - from.0 > wide;
            is_long.then_some((from, to))
        }
        _ => None,
    });
    long.collect::<BTreeSet<_>>().len()
}

/// Links are cut only between pages: on one sheet, every link is a line.
#[test]
fn links_are_cut_between_pages_only() {
    let (mut n_all, mut n_cut, mut n_pages, mut n_borders, mut n_long) = (0, 0, 0, 0, 0);
    let (mut narrow, mut kinds) = ((0, 0), [0; 3]);
    for number in 0..rounds(60, 500) {
        let design = parsed(&structured(number));
        assert_eq!(count(&drawn(&design), |text| text.contains('→')), 0, "{number}");
        let picture = on_paper(&design);
        let pages = pages(&picture, Paper::A4, &TitleBlock::default());
        n_all += n_links(&design);
        n_pages += pages.len();
        n_borders += pages.len() - 1;
        for page in &pages {
            let here = kinds_of_marks(&page.picture);
            kinds.iter_mut().zip(here).for_each(|(all, more)| *all += more);
        }
        n_long += n_longer_than_a_page(&picture, &pages);
        // Both ends of a cut link have a mark.
        let marks = pages.iter().map(|page| count(&page.picture, |text| reference(text).is_some()));
        let n_here = marks.sum::<usize>() / 2;
        n_cut += n_here;
        // No wider than a page of A4.
        if picture.width <= 717 {
            narrow = (narrow.0 + n_here, narrow.1 + n_links(&design));
        }
    }
    println!("{n_pages} pages, {n_cut} cuts of {n_all} links; {n_borders} borders");
    println!("{n_long} lines longer than a page, {} other cuts", n_cut - n_long.min(n_cut));
    let [at_sides, up, down] = kinds.map(|marks| marks / 2);
    println!("of the cuts, {at_sides} are sideways, {up} of links that lead up, {down} of others");
    println!("of charts that are not wider than a page: {} of {} links", narrow.0, narrow.1);
    assert!(narrow.0 * 100 <= narrow.1 * 5, "{narrow:?}");
    // The return of a loop is longer than a page, and the sequence below it crosses each cut.
    assert!(n_cut * 100 <= n_all * 8, "{n_cut} of {n_all} links");
}

/// On paper, the letters of structured charts have at least 7 points, except on pages without a place for a cut, which are drawn smaller.
#[test]
fn letters_on_paper_are_large_enough() {
    // 96 pixels are 72 points.
    let is_small = |percent: i64| Font::Small.size() * percent * 72 < 7 * 96 * 100;
    let (mut n_small, mut n_wide, mut n_all) = (0, 0, 0);
    for number in 0..rounds(60, 500) {
        let picture = on_paper(&parsed(&structured(number)));
        for page in pages(&picture, Paper::A4, &TitleBlock::default()) {
            n_all += 1;
            n_wide += usize::from(page.percent < 100);
            n_small += usize::from(is_small(page.percent));
        }
    }
    println!("{n_all} pages, {n_wide} drawn smaller, {n_small} with letters below 7 points");
    // No place for a cut; `draw` reports them.
    assert!(n_small * 100 <= n_all, "{n_small} of {n_all} pages");
}
