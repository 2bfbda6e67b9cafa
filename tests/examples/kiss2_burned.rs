//! Maps state tables to devices: `kiss2_burned FOLDER [NAME]` prints for each `.kiss2` of a folder whether one GAL22V10 holds it and, if not, why, as in
//! docs/benchmarks.md.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is an example that prints")]
#![allow(clippy::disallowed_methods, reason = "it reads files and its arguments")]

use grafsynth_driver::{jedec, pipeline};
use grafsynth_ir::logic::{Logic, Node};
use grafsynth_tests::chart;
use grafsynth_verify::{Limits, Method, Verdict, equiv, structural_facts};

/// The macrocells of the device, and its pins without the supply pins.
const CELLS: usize = 10;
const PINS: usize = 22;

fn main() {
    let mut words = std::env::args().skip(1);
    let Some(folder) = words.next() else {
        eprintln!("skipped: no folder with tables given (kiss2_burned FOLDER [NAME])");
        return;
    };
    let only = words.next();
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: {folder} is not a folder");
        return;
    };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "kiss2"));
    paths.sort();
    println!(
        "| machine | in/out/states | one GAL22V10 | flip-flops | macrocells | product terms (most) | proved by |"
    );
    println!("|---|---|---|---|---|---|---|");
    for path in paths {
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into());
        if only.as_ref().is_none_or(|only| *only == name) {
            println!("| {name} | {} |", row(&text));
        }
    }
}

fn row(text: &str) -> String {
    let net = chart("table.kiss2", text);
    let facts = structural_facts(&net);
    let sizes = format!("{}/{}/{}", net.inputs.len(), net.outputs.len(), net.steps.len());
    let logic = match pipeline::logic(&net, &facts) {
        Ok(logic) => logic,
        Err(found) => return format!("{sizes} | {} | | | | |", found[0].message),
    };
    let device = Some("gal22v10");
    match jedec::burn_coded(&net, &facts, &logic, device, Some(1)) {
        Ok(burned) => {
            let cells = &burned.placement.cells;
            let terms = cells.iter().map(|cell| cell.sum.len());
            let proved = match equiv(&net, &facts, &burned.logic, &Limits::default()) {
                Verdict::Proved(certificate) => match certificate.method {
                    Method::Explicit { .. } => "enumeration",
                    Method::Symbolic { .. } => "induction",
                },
                Verdict::Refuted(_) => "REFUTED",
                Verdict::Open(_) => "open",
            };
            let code = match burned.logic.decoded.len() {
                0 => "one-hot",
                1 => "zero-hot",
                _ => "compact",
            };
            format!(
                "{sizes} | {code} | {} | {} | {} ({}) | {proved}",
                burned.logic.flops.len(),
                cells.len(),
                terms.clone().sum::<usize>(),
                terms.max().unwrap_or(0),
            )
        }
        Err(_) => format!("{sizes} | no: {} | | | |", lack(&logic)),
    }
}

/// The resource that the device lacks even with the minimum number of flip-flops.
fn lack(logic: &Logic) -> String {
    let n_bits = logic.flops.len().next_power_of_two().trailing_zeros() as usize;
    let n_cells = n_bits + logic.outputs.len();
    let n_read = logic.nodes.values().filter(|node| matches!(node, Node::Input(_))).count();
    // The clock has a pin.
    let n_pins = n_read + 1 + n_cells;
    let mut lacks = Vec::new();
    if n_cells > CELLS {
        lacks.push(format!("{n_cells} macrocells for {CELLS}"));
    }
    if n_pins > PINS {
        lacks.push(format!("{n_pins} pins for {PINS}"));
    }
    if lacks.is_empty() { "product terms".to_owned() } else { lacks.join(", ") }
}
