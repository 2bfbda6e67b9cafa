//! Counts the flip-flops of charts with a timer for each step and with shared timers, and the product terms of both, one flip-flop per step on a
//! `gal22v10`: `timer_counts FILE...` prints the table of docs/benchmarks.md.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is an example that prints")]
#![allow(clippy::disallowed_methods, reason = "it reads files and its arguments")]

use grafsynth_backend_pld::Dialect;
use grafsynth_backend_pld::equations::Equations;
use grafsynth_driver::coding::{Encoding, EncodingChoice, code};
use grafsynth_driver::pipeline::{self, BusyMode};
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_verify::Limits;

fn main() {
    println!("| chart | flip-flops: own timers, shared | product terms: own timers, shared |");
    println!("|---|---|---|");
    for path in std::env::args().skip(1) {
        match counts(&path) {
            Ok(row) => println!("| {path} | {row} |"),
            Err(why) => eprintln!("left out: {path}: {why}"),
        }
    }
}

fn counts(path: &str) -> Result<String, String> {
    let text = std::fs::read_to_string(path).map_err(|why| why.to_string())?;
    let mut sources = Sources::default();
    let main = sources.add(path, text);
    let net = match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
        (Some(Design::Net(design)), _) => design.net,
        (Some(Design::Logic(_)) | None, found) => return Err(message(&found)),
    };
    let facts = pipeline::facts(&net, &Limits::default());
    let own = pipeline::logic_with_own_timers(&net, &facts, BusyMode::default())
        .ok_or("no steps share a timer")?;
    let shared = pipeline::logic(&net, &facts).map_err(|found| message(&found))?;
    let [a, b] = [&own, &shared].map(|logic| terms(&net, &facts, logic));
    Ok(format!("{}, {} | {}, {}", own.flops.len(), shared.flops.len(), a?, b?))
}

/// The product terms of all equations.
fn terms(net: &Valid<Net>, facts: &Facts, logic: &Logic) -> Result<usize, String> {
    let options = pipeline::emit_options(net, Some("gal22v10"), None);
    let (choice, dialect) = (EncodingChoice::This(Encoding::OneHot), Dialect::Palasm);
    let coded = code(net, facts, logic, choice, false, dialect, &options);
    let made =
        Equations::open(&coded.emitted(), dialect, &options).map_err(|found| message(&found))?;
    Ok(made.equations.iter().map(|equation| equation.products.len()).sum())
}

fn message(found: &[Diagnostic]) -> String {
    found.first().map_or_else(|| "it cannot be read".to_owned(), |first| first.message.clone())
}
