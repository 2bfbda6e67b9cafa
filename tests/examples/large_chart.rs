//! Prints a large statechart as a `.net`: `large_chart STATES [history|deep] [raise] [lists]`, with 31, 217, 513 or 1001 states; `times` prints the duration of
//! the passes instead.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is an example that prints")]
#![allow(clippy::disallowed_methods, reason = "it measures time and reads its arguments")]

use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_tests::large_chart::LargeChart;
use std::time::Instant;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| words.iter().any(|it| it == word);
    let size = words.first().and_then(|text| text.parse().ok()).and_then(LargeChart::of_size);
    let Some(chart) = size else {
        eprintln!("large_chart 31|217|513|1001 [history|deep] [raise] [lists] [times]");
        return;
    };
    let history = if has("deep") { Some(true) } else { has("history").then_some(false) };
    let chart = LargeChart { history, raises: has("raise"), lists: has("lists"), ..chart };
    let begin = Instant::now();
    let design = chart.design();
    let lowered = Instant::now();
    let net = chart.net().expect("the chart is sound");
    if !has("times") {
        println!("{}", grafsynth_ir::text::print(&net));
        return;
    }
    println!("design {:?}, design and lower {:?}", lowered - begin, lowered.elapsed());
    drop(design);
    let start = Instant::now();
    let facts = grafsynth_driver::pipeline::facts(&net, &Default::default());
    println!("facts {:?}", start.elapsed());
    let start = Instant::now();
    let made = program(&net, &ProgramOptions::default());
    println!("program {:?} {:?}", start.elapsed(), made.map(|it| it.temps.len()));
    let start = Instant::now();
    let package = grafsynth_backend_c::emit(&net, &facts, &Default::default());
    println!("C {:?} {:?}", start.elapsed(), package.map(|it| (it.style, it.reason)));
    let start = Instant::now();
    let logic = grafsynth_driver::pipeline::logic(&net, &facts);
    println!(
        "logic {:?} {:?}",
        start.elapsed(),
        logic
            .map(|it| (it.flops.len(), it.nodes.len()))
            .map_err(|found| found.into_iter().map(|it| it.message).collect::<Vec<_>>())
    );
}
