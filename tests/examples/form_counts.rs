//! Counts the product terms of families of charts in each form: `form_counts FOLDER...` treats the `.graf` files of each folder as a family and prints
//! the table of docs/benchmarks.md.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is an example that prints")]
#![allow(clippy::disallowed_methods, reason = "it reads files and its arguments")]

use grafsynth_backend_pld::{Dialect, EmitOptions};
use grafsynth_driver::coding::{Encoding, EncodingChoice, code};
use grafsynth_driver::forms::{Form, Forms, of_outputs, of_steps};
use grafsynth_driver::pipeline;
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_logic::minimise::{Budget, Minimum};
use grafsynth_verify::{Limits, facts};
use std::path::Path;

fn main() {
    let folders: Vec<String> = std::env::args().skip(1).collect();
    if folders.is_empty() {
        eprintln!("skipped: no folder with charts given (form_counts FOLDER...)");
    }
    for folder in folders {
        match family(Path::new(&folder)) {
            Ok(family) => family.print(&folder),
            Err(why) => eprintln!("skipped: {folder}: {why}"),
        }
    }
}

/// The charts of one folder, counted.
#[derive(Default)]
struct Family {
    charts: usize,
    /// With each encoding, one-hot first.
    coded: Vec<EncodedLogic>,
    /// Charts that could not be counted, and why.
    left_out: Vec<String>,
}

struct EncodedLogic {
    encoding: Encoding,
    flops: Vec<Forms>,
    outputs: Vec<usize>,
}

fn family(folder: &Path) -> Result<Family, String> {
    let entries = std::fs::read_dir(folder).map_err(|why| why.to_string())?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "graf"));
    paths.sort();
    if paths.is_empty() {
        return Err("there is no .graf in it".to_owned());
    }
    let mut family = Family::default();
    for encoding in [Encoding::OneHot, Encoding::ZeroHot, Encoding::Compact] {
        family.coded.push(EncodedLogic { encoding, flops: Vec::new(), outputs: Vec::new() });
    }
    for path in paths {
        match chart(&path) {
            Ok(counted) => {
                family.charts += 1;
                for (all, one) in family.coded.iter_mut().zip(counted) {
                    all.flops.extend(one.flops);
                    all.outputs.extend(one.outputs);
                }
            }
            Err(why) => family.left_out.push(format!("{}: {why}", path.display())),
        }
    }
    Ok(family)
}

/// One chart with each encoding, with all its reachable situations known.
fn chart(path: &Path) -> Result<Vec<EncodedLogic>, String> {
    let text = std::fs::read_to_string(path).map_err(|why| why.to_string())?;
    let mut sources = Sources::default();
    let main = sources.add(path.to_string_lossy(), text);
    match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
        (Some(Design::Net(design)), _) => coded(&design.net),
        (Some(Design::Logic(_)) | None, found) => Err(message(&found)),
    }
}

fn coded(net: &Valid<Net>) -> Result<Vec<EncodedLogic>, String> {
    let facts = facts(net, &Limits::default());
    if !facts.reach.as_ref().is_some_and(|reach| reach.exact) {
        return Err("its reachable situations are not known".to_owned());
    }
    let logic = pipeline::logic(net, &facts).map_err(|found| message(&found))?;
    let made = |encoding| -> Result<EncodedLogic, String> {
        let choice = EncodingChoice::This(encoding);
        let options = EmitOptions::default();
        let logic: Logic =
            code(net, &facts, &logic, choice, false, Dialect::Palasm, &options).logic;
        let flops = of_steps(&logic, Budget::default()).map_err(|why| why.to_string())?;
        let outputs = of_outputs(&logic, Budget::default()).map_err(|why| why.to_string())?;
        Ok(EncodedLogic { encoding, flops, outputs })
    };
    [Encoding::OneHot, Encoding::ZeroHot, Encoding::Compact].into_iter().map(made).collect()
}

fn message(found: &[Diagnostic]) -> String {
    found.first().map_or_else(|| "it cannot be read".to_owned(), |first| first.message.clone())
}

impl Family {
    fn print(&self, folder: &str) {
        for why in &self.left_out {
            println!("left out: {why}");
        }
        let Some(hot) = self.coded.first() else { return };
        println!("{folder}: {} charts, {} flip-flops of steps", self.charts, hot.flops.len());
        println!();
        println!("| products | D | inverted D | T | inverted T | best of D | best of all |");
        println!("|---|---|---|---|---|---|---|");
        let plain = total(&hot.flops, &[Form::D], false);
        let row = |what: &str, dont_cares: bool| {
            let one = Form::ALL.map(|form| share(total(&hot.flops, &[form], dont_cares), plain));
            println!(
                "| {what} | {} | {} | {} |",
                one.join(" | "),
                share(total(&hot.flops, &Form::OF_D, dont_cares), plain),
                share(total(&hot.flops, &Form::ALL, dont_cares), plain),
            );
        };
        row("as they are", false);
        row("with don't-cares", true);
        let chosen = Form::ALL.map(|form| {
            let is_it = |forms: &&Forms| forms.best(&Form::ALL, true).1 == form;
            hot.flops.iter().filter(is_it).count().to_string()
        });
        println!("| flip-flops for which it is best | {} | | |", chosen.join(" | "));
        println!();
        println!(
            "| code | flip-flops | best of D | best of all | other output pins | their products |"
        );
        println!("|---|---|---|---|---|---|");
        for coded in &self.coded {
            println!(
                "| {} | {} | {} | {} | {} | {} |",
                match coded.encoding {
                    Encoding::OneHot => "one-hot",
                    Encoding::ZeroHot => "zero-hot",
                    Encoding::Compact => "compact",
                },
                coded.flops.len(),
                share(total(&coded.flops, &Form::OF_D, true), plain),
                share(total(&coded.flops, &Form::ALL, true), plain),
                coded.outputs.len(),
                coded.outputs.iter().sum::<usize>(),
            );
        }
        println!();
        let all = self.coded.iter().flat_map(|coded| &coded.flops);
        let sums: Vec<Minimum> = all
            .flat_map(|forms| forms.as_it_is.iter().chain(&forms.with_dont_cares))
            .map(|sum| sum.minimum)
            .collect();
        let proved = sums.iter().filter(|minimum| **minimum == Minimum::Exact).count();
        println!("{proved} of {} sums are proved to be the minimum", sums.len());
        println!();
    }
}

fn total(flops: &[Forms], forms: &[Form], dont_cares: bool) -> usize {
    flops.iter().map(|flop| flop.best(forms, dont_cares).0).sum()
}

/// A number of products, and its ratio to the plain ones.
fn share(products: usize, plain: usize) -> String {
    format!("{products} ({:.3})", products as f64 / plain.max(1) as f64)
}
