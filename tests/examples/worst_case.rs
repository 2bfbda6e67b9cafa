//! Prints the bound of a reaction and the worst case that a search finds: `worst_case [--machine avr|cortex-m3] FILE...`. Without the tools of a machine,
//! prints only the bound.

#![allow(clippy::print_stdout, reason = "it prints a table")]
#![allow(clippy::disallowed_methods, reason = "it reads files")]

use grafsynth_backend_c::{Options, cost, emit};
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_engines::Job;
use grafsynth_engines::measure::{meters, search};
use grafsynth_sim::Stimulus;
use grafsynth_verify::{Limits, facts};
use std::path::Path;
use std::time::Instant;

fn main() {
    let mut machines = vec!["avr", "cortex-m3"];
    let mut files = Vec::new();
    let mut is_measured = true;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--machine" => {
                machines = vec![if arguments.next().as_deref() == Some("avr") {
                    "avr"
                } else {
                    "cortex-m3"
                }]
            }
            "--bounds" => is_measured = false,
            _ => files.push(argument),
        }
    }
    println!("| chart | machine | style | bound | found | ratio | how | s |");
    println!("|---|---|---|---|---|---|---|---|");
    let meters = meters();
    let (mut printed, mut within, mut all) = (0, 0, 0);
    for file in &files {
        let name =
            Path::new(file).file_name().and_then(|it| it.to_str()).unwrap_or_default().to_owned();
        let Ok(text) = std::fs::read_to_string(file) else {
            println!("| {name} | not read | | | | | | |");
            continue;
        };
        let mut sources = Sources::default();
        let main = sources.add(&name, &text);
        let net = match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
            (Some(Design::Net(design)), _) => design.net,
            (Some(Design::Logic(_)) | None, found) => {
                println!(
                    "| {name} | no chart: {} | | | | | | |",
                    found.first().map_or("", |it| it.message.as_str())
                );
                continue;
            }
        };
        let facts = facts(&net, &Limits::default());
        let options = Options::default();
        let Ok(package) = emit(&net, &facts, &options) else { continue };
        let mut rows = Vec::new();
        for machine in &machines {
            let Some(model) = cost::machine(machine) else { continue };
            let begin = Instant::now();
            let bound = cost::bound(&package, model);
            let seconds = begin.elapsed().as_secs_f64();
            all += 1;
            let bound = match bound {
                Ok(bound) => bound,
                Err(why) => {
                    println!(
                        "| {name} | {machine} | {} | no bound: {why} | | | | |",
                        package.style
                    );
                    continue;
                }
            };
            printed += usize::from(bound.unbounded.is_none());
            let meter = meters.iter().find(|it| it.machine() == *machine && is_measured);
            let stimulus = Stimulus::random(&net, 1000, 1, 3);
            let job = Job { net: &net, facts: &facts, stimulus: &stimulus };
            let found = meter.and_then(|meter| {
                let prepared = meter.prepare(&job, &options).ok()?;
                if rows.is_empty() {
                    let found =
                        search::dearest(&*prepared, &net, search::Effort::default()).ok()?;
                    rows = found.rows;
                    Some(found.measured.step)
                } else {
                    let random = prepared.run(&net, &stimulus).ok()?.0.step;
                    let same = prepared.run(&net, &Stimulus::of_rows(&net, &rows)).ok()?.0.step;
                    Some(random.max(same))
                }
            });
            let ratio = found.map_or(0.0, |found| bound.step as f64 / found as f64);
            within += usize::from((1.0..=3.0).contains(&ratio) && bound.unbounded.is_none());
            let way =
                bound.open.map_or_else(|| format!("{:?}", bound.way), |why| format!("text: {why}"));
            let way = bound.unbounded.map_or(way, |why| format!("no bound: {why}"));
            println!(
                "| {name} | {machine} | {} | {} | {} | {ratio:.2} | {way} | {seconds:.2} |",
                package.style,
                bound.step,
                found.map_or_else(|| "-".to_owned(), |it| it.to_string()),
            );
        }
    }
    println!(
        "\n{all} bounds requested, {printed} printed, {within} of them not below the found worst case and at most three times as large"
    );
}
