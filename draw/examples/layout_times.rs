//! Prints the time of the layout of charts with different structures and sizes: the best of several runs.
//!
//! ```text
//! cargo run --release -p grafsynth-draw --example layout_times
//! ```

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program that measures times"
)]

use grafsynth_draw::{Options, layout, svg};
use grafsynth_ir::chart::{Chart, Design, Expr, Item, Leaf, Path, Step, StepRole, Transition};
use grafsynth_ir::{Name, Span};
use std::time::Instant;

/// The number of runs.
const ROUNDS: usize = 5;

fn name(text: String) -> Name {
    Name::new(text, Span::default())
}

fn path(step: usize) -> Path {
    Path::from(name(format!("s{step}")))
}

/// A chart with `n` steps; the first one is initial. `links` are the transitions by the numbers of their steps.
fn chart(n: usize, links: &[(Vec<usize>, Vec<usize>)]) -> Design {
    let mut items = Vec::new();
    for step in 0..n {
        let role = if step == 0 { StepRole::Initial } else { StepRole::Plain };
        items.push(Item::Step(Step { name: name(format!("s{step}")), role, ..Step::default() }));
    }
    for (from, to) in links {
        let all = |steps: &[usize]| steps.iter().map(|step| path(*step)).collect();
        let guard = Expr::leaf(Leaf::Name(Path::from(name("a".to_owned()))), Span::default());
        items.push(Item::Transition(Transition {
            sources: all(from),
            targets: all(to),
            guard: Some(guard),
            ..Transition::default()
        }));
    }
    let chart = Chart { name: name("c".to_owned()), items, ..Chart::default() };
    Design { charts: vec![chart], ..Design::default() }
}

/// One sequence that returns to its first step.
fn sequence(n: usize) -> Design {
    let links: Vec<_> = (0..n).map(|step| (vec![step], vec![(step + 1) % n])).collect();
    chart(n, &links)
}

/// Alternatives, parallel branches and sequences in turn, ten steps each, with a link back to the first step.
fn mixed(n: usize) -> Design {
    let mut links = Vec::new();
    let mut last = 0;
    let mut next = 1;
    let mut round = 0;
    while next + 10 <= n {
        let branches: Vec<usize> = (next..next + 9).collect();
        let end = next + 9;
        match round % 3 {
            0 => {
                for branch in &branches {
                    links.push((vec![last], vec![*branch]));
                    links.push((vec![*branch], vec![end]));
                }
            }
            1 => {
                links.push((vec![last], branches.clone()));
                links.push((branches, vec![end]));
            }
            _ => {
                for pair in std::iter::once(last)
                    .chain(branches)
                    .chain([end])
                    .collect::<Vec<_>>()
                    .windows(2)
                {
                    links.push((vec![pair[0]], vec![pair[1]]));
                }
                links.push((vec![end], vec![next]));
            }
        }
        (last, next, round) = (end, next + 10, round + 1);
    }
    links.push((vec![last], vec![0]));
    chart(next, &links)
}

/// One step with a transition to each of the others, which all return to it.
fn hub(n: usize) -> Design {
    let out = (1..n).map(|step| (vec![0], vec![step]));
    let back = (1..n).map(|step| (vec![step], vec![0]));
    let links: Vec<_> = out.chain(back).collect();
    chart(n, &links)
}

/// One step with a transition to each of the others, which all lead to a last one.
fn fan(n: usize) -> Design {
    let out = (1..n - 1).map(|step| (vec![0], vec![step]));
    let back = (1..n - 1).map(|step| (vec![step], vec![n - 1]));
    let links: Vec<_> = out.chain(back).collect();
    chart(n, &links)
}

/// Every step has transitions to pseudo-random steps.
fn tangle(n: usize) -> Design {
    let mut random = 1_usize;
    let mut links: Vec<_> = (1..n).map(|step| (vec![step - 1], vec![step])).collect();
    for step in 0..n / 4 {
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        links.push((vec![(step * 4) % n], vec![(random >> 33) % n]));
    }
    chart(n, &links)
}

fn main() {
    type Made = fn(usize) -> Design;
    let kinds: [(&str, Made, &[usize]); 5] = [
        ("sequence", sequence, &[20, 100, 1000, 10_000]),
        ("mixed", mixed, &[20, 100, 1000, 10_000]),
        ("fan", fan, &[20, 100, 1000, 10_000]),
        ("hub", hub, &[20, 100, 300, 1000]),
        ("tangle", tangle, &[20, 100, 500, 1000]),
    ];
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    for (kind, made, sizes) in kinds {
        if !wanted.is_empty() && !wanted.iter().any(|one| one == kind) {
            continue;
        }
        for &n in sizes {
            let design = made(n);
            let (mut best, mut result) = ((f64::MAX, f64::MAX), (0, 0, 0, 0));
            for _ in 0..ROUNDS {
                let start = Instant::now();
                let Ok(picture) = layout(&design, &Options::default()) else { continue };
                let laid_out = start.elapsed();
                let bytes = svg(&picture).len();
                let all = start.elapsed();
                best.0 = best.0.min(laid_out.as_secs_f64() * 1e3);
                best.1 = best.1.min(all.as_secs_f64() * 1e3);
                result = (picture.marks.len(), bytes / 1000, picture.width, picture.height);
            }
            let (n_marks, kilobytes, width, height) = result;
            println!(
                "{kind:9} {n:6} steps: layout {:9.2} ms, with SVG {:9.2} ms, {n_marks} marks, {kilobytes} kB, {width} x {height}",
                best.0, best.1
            );
        }
    }
}
