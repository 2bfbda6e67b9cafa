//! Compares the layout of random charts with that of a program that lays out graphs in the JSON of the Eclipse Layout Kernel, with the same boxes: crossings of
//! links, width and area.
//!
//! ```text
//! cargo install elkrs --version 0.1.1
//! cargo run --release -p grafsynth-draw --example against_elk -- elkrs 200
//! ```

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program that compares with another one"
)]

#[path = "../tests/random.rs"]
mod random;

use grafsynth_draw::picture::{Pen, Picture, Shape};
use grafsynth_draw::{Options, layout};
use grafsynth_frontend::graf;
use grafsynth_ir::FileId;
use grafsynth_ir::chart::{Design, Item};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::process::{Command, Stdio};

/// A horizontal or vertical line, from its upper or left end.
type Line = ((i64, i64), (i64, i64));

/// What is compared.
#[derive(Debug, Clone, Copy, Default)]
struct Measure {
    crossings: usize,
    width: i64,
    height: i64,
}

/// The points where a horizontal and a vertical line cross each other; a line that ends at another one does not cross it.
fn crossings(lines: &[Line]) -> usize {
    let (flat, upright): (Vec<&Line>, Vec<&Line>) =
        lines.iter().filter(|line| line.0 != line.1).partition(|line| line.0.1 == line.1.1);
    let mut points = BTreeSet::new();
    for ((x1, y), (x2, _)) in flat {
        for ((x, y1), (_, y2)) in &upright {
            if x1 < x && x < x2 && y1 < y && y < y2 {
                points.insert((*x, *y));
            }
        }
    }
    points.len()
}

fn ordered(a: (i64, i64), b: (i64, i64)) -> Line {
    (a.min(b), a.max(b))
}

/// The drawing, and the size of each symbol with its texts and actions, by its name.
fn own(picture: &Picture) -> (Measure, BTreeMap<String, (i64, i64)>) {
    let mut boxes: BTreeMap<String, [i64; 4]> = BTreeMap::new();
    let (mut lines, mut all) = (Vec::new(), [i64::MAX, i64::MAX, 0, 0]);
    let extend = |old: &mut [i64; 4], new: [i64; 4]| {
        *old = [old[0].min(new[0]), old[1].min(new[1]), old[2].max(new[2]), old[3].max(new[3])];
    };
    for mark in &picture.marks {
        let bounds = match &mark.shape {
            Shape::Line { from, to, pen: Pen::Line } if mark.element.is_none() => {
                let line = ordered(*from, *to);
                lines.push(line);
                [line.0.0, line.0.1, line.1.0, line.1.1]
            }
            Shape::Line { from, to, .. } => {
                [from.0.min(to.0), from.1.min(to.1), from.0.max(to.0), from.1.max(to.1)]
            }
            Shape::Rect { x, y, width, height, .. } => [*x, *y, x + width, y + height],
            Shape::Text { x, y, width, font, .. } => [*x, y - font.size(), x + width, y + 4],
            _ => continue,
        };
        match &mark.element {
            Some(element) => {
                let start = [i64::MAX, i64::MAX, 0, 0];
                extend(boxes.entry(element.id.clone()).or_insert(start), bounds);
            }
            None if !matches!(mark.shape, Shape::Line { pen: Pen::Line, .. }) => continue,
            None => {}
        }
        extend(&mut all, bounds);
    }
    let (width, height) = (all[2] - all[0], all[3] - all[1]);
    let sizes = boxes.into_iter().map(|(id, it)| (id, (it[2] - it[0], it[3] - it[1])));
    (Measure { crossings: crossings(&lines), width, height }, sizes.collect())
}

/// The chart as a graph of steps and transitions.
fn graph(design: &Design, sizes: &BTreeMap<String, (i64, i64)>) -> Value {
    let chart = &design.charts[0];
    let step = |name: &str| format!("{}.{name}", chart.name.text);
    let mut edges = Vec::new();
    for (number, item) in chart.items.iter().enumerate() {
        let Item::Transition(one) = item else { continue };
        let own = format!("{}-t{number}", chart.name.text);
        let from = one.sources.iter().map(|it| (step(&it.to_string()), own.clone()));
        let to = one.targets.iter().map(|it| (own.clone(), step(&it.to_string())));
        edges.extend(from.chain(to));
    }
    let edges = edges.iter().enumerate().map(
        |(number, (from, to))| json!({"id": format!("e{number}"), "sources": [from], "targets": [to]}),
    );
    let nodes = sizes.iter().map(|(id, (w, h))| json!({"id": id, "width": w, "height": h}));
    json!({
        "id": "root",
        "layoutOptions": {
            "elk.algorithm": "layered",
            "elk.direction": "DOWN",
            "elk.edgeRouting": "ORTHOGONAL",
            "elk.layered.cycleBreaking.strategy": "DEPTH_FIRST",
            "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
        },
        "children": nodes.collect::<Vec<_>>(),
        "edges": edges.collect::<Vec<_>>(),
    })
}

/// The same graph by the other program.
fn other(program: &str, graph: &Value) -> Result<Measure, String> {
    let child = Command::new(program).arg("-").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = child.map_err(|error| format!("{program}: {error}"))?;
    let mut input = child.stdin.take().ok_or("no input")?;
    input.write_all(graph.to_string().as_bytes()).map_err(|error| error.to_string())?;
    drop(input);
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let done: Value = serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())?;
    // Tenths of a pixel.
    let number = |value: &Value| (value.as_f64().unwrap_or(0.0) * 10.0).round() as i64;
    let point = |value: &Value| (number(&value["x"]), number(&value["y"]));
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let (mut lines, mut all) = (Vec::new(), [i64::MAX, i64::MAX, 0, 0]);
    let mut extend = |(x, y): (i64, i64)| {
        all = [all[0].min(x), all[1].min(y), all[2].max(x), all[3].max(y)];
    };
    for node in list(&done["children"]) {
        let (x, y) = point(&node);
        extend((x, y));
        extend((x + number(&node["width"]), y + number(&node["height"])));
    }
    for section in list(&done["edges"]).iter().flat_map(|edge| list(&edge["sections"])) {
        let mut points = vec![point(&section["startPoint"])];
        points.extend(list(&section["bendPoints"]).iter().map(point));
        points.push(point(&section["endPoint"]));
        points.iter().for_each(|it| extend(*it));
        lines.extend(points.windows(2).map(|pair| ordered(pair[0], pair[1])));
    }
    let (width, height) = ((all[2] - all[0]) / 10, (all[3] - all[1]) / 10);
    Ok(Measure { crossings: crossings(&lines), width, height })
}

fn main() -> Result<(), String> {
    let mut arguments = std::env::args().skip(1);
    let program = arguments.next().ok_or("name a program that lays out graphs, such as elkrs")?;
    let count = arguments.next().and_then(|it| it.parse().ok()).unwrap_or(100);
    for (kind, remainders) in [("structured", [0, 4]), ("random links", [1, 3])] {
        let (mut ours, mut theirs, mut wider, mut larger) = (0, 0, Vec::new(), Vec::new());
        let (mut n_more, mut n_nodes) = (0, 0);
        for number in 0..count {
            let text = random::random_chart(number / 2 * 6 + remainders[(number % 2) as usize]);
            let design = graf::parse(FileId(0), &text).design.ok_or("not a chart")?;
            let picture = layout(&design, &Options::default()).map_err(|it| format!("{it:?}"))?;
            let (own, sizes) = own(&picture);
            let other = other(&program, &graph(&design, &sizes))?;
            n_nodes += sizes.len();
            ours += own.crossings;
            theirs += other.crossings;
            n_more += usize::from(own.crossings > other.crossings);
            let ratio = |a: i64, b: i64| a as f64 / b.max(1) as f64;
            wider.push(ratio(own.width, other.width));
            larger.push(ratio(own.width * own.height, other.width * other.height));
        }
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        println!(
            "{kind}: {count} charts with {n_nodes} symbols; {ours} crossings, {program} {theirs} ({n_more} charts have fewer there); width {:.2}, area {:.2} of it",
            mean(&wider),
            mean(&larger)
        );
    }
    Ok(())
}
