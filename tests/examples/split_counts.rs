//! Splits charts on real devices: `split_counts CHARTS` prints a row for each chart, as in docs/benchmarks.md.
//!
//! A row has the numbers of steps, groups and outputs, the objective with its bound, the partitions that were built (and of these, those in which a part did not
//! fit), the sets of decisions that were excluded without a build, the macrocells and the pins of the CPU, and the time of the search with the proofs.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is an example that prints")]
#![allow(
    clippy::disallowed_methods,
    reason = "it reads files and its arguments, and measures time"
)]

use grafsynth_driver::pipeline::BuildOptions;
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_driver::split::{Objective, PartDevice, Request, RequestedPart, Split, costs, split};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::memory::sizes;
use grafsynth_ir::diag::Severity;
use grafsynth_ir::division::Running;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_verify::Limits;
use std::time::Instant;

/// The devices of each row.
const DEVICES: [&str; 2] = ["gal22v10", "stm32f103"];

fn main() {
    let charts: Vec<String> = std::env::args().skip(1).collect();
    if charts.is_empty() {
        eprintln!("skipped: no charts given (split_counts CHART ..)");
        return;
    }
    println!(
        "| chart | steps | groups | minimised | best | bound | built (unfit) | excluded | macrocells | pins of the CPU | time |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let (mut n, mut optimal) = (0, 0);
    for path in &charts {
        let name = std::path::Path::new(path).file_stem().unwrap_or_default().to_string_lossy();
        match net(path) {
            Err(why) => println!("| {name} | not read: {why} |"),
            Ok(net) => {
                for objective in Objective::ALL {
                    let (text, is_optimal) = row(&net, objective);
                    println!("| {name} | {text} |");
                    n += 1;
                    optimal += usize::from(is_optimal);
                }
            }
        }
    }
    println!("\n{optimal} of {n} splits are proved to be the best.");
}

/// The net of a chart without errors.
fn net(path: &str) -> Result<Valid<Net>, String> {
    let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    let mut sources = Sources::default();
    let main = sources.add(path, &text);
    let (design, found) =
        read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
    match design {
        Some(Design::Net(design)) => Ok(design.net),
        Some(Design::Logic(_)) => Err("it is logic".to_owned()),
        None => Err(first(&found)),
    }
}

fn first(found: &[Diagnostic]) -> String {
    let error = found.iter().find(|one| one.severity == Severity::Error);
    error.map_or_else(|| "no reason".to_owned(), |one| one.message.replace('|', "/"))
}

/// The row of a chart, and whether its split is proved to be the best.
fn row(net: &Valid<Net>, objective: Objective) -> (String, bool) {
    let [chip, cpu] = DEVICES;
    let part = |name: &str, device: &str| {
        PartDevice::named(device).map(|device| RequestedPart { name: name.to_owned(), device })
    };
    let parts: Vec<RequestedPart> =
        [part("chip", chip), part("cpu", cpu)].into_iter().flatten().collect();
    let stem = FileStem::of_name("bench");
    let limits = Limits { pairs: 100_000, ..Limits::default() };
    let options =
        BuildOptions { dont_cares: true, trusts_code: true, limits, ..BuildOptions::default() };
    let request = Request {
        parts: &parts,
        places: &[],
        running: Running::Lockstep,
        reset: true,
        objective,
        fits: 8,
        stem: &stem,
        options: &options,
        compile: Some(sizes),
        told: |_| (),
    };
    let steps = net.steps.len();
    let start = Instant::now();
    let made = split(net, &request);
    let time = start.elapsed().as_millis();
    match made {
        Err(found) => {
            let text = format!(
                "{steps} | | {} | {} | | | | | | {time} ms",
                objective.name(),
                first(&found)
            );
            (text, false)
        }
        Ok(split) => {
            let is_optimal = split.bound >= split.value;
            let Split { groups, value, bound, builds, unfit, cuts, .. } = &split;
            let costs = costs(net, &request);
            let (cells, pins) = match &costs {
                Ok(costs) => (costs.cells.to_string(), costs.pins.to_string()),
                Err(why) => (String::new(), why.replace('|', "/")),
            };
            let bound = if is_optimal { "=".to_owned() } else { bound.to_string() };
            let groups = groups.groups.len();
            let text = format!(
                "{steps} | {groups} | {} | {value} | {bound} | {builds} ({unfit}) | {cuts} | {cells} | {pins} | {time} ms",
                objective.name()
            );
            (text, is_optimal)
        }
    }
}
