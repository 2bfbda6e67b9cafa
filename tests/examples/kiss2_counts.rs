//! Counts the product terms of state tables: `kiss2_counts FOLDER [TRIES [LEVEL [NAME]]]` prints a row for each `.kiss2` of a folder, as in docs/benchmarks.md.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is an example that prints")]
#![allow(clippy::disallowed_methods, reason = "it reads files and its arguments")]

use grafsynth_driver::state_table::{
    Coding, Search, few_products, function, one_hot, one_hot_per_output, table,
};
use grafsynth_frontend::kiss2::{self, Machine};
use grafsynth_ir::FileId;
use grafsynth_logic::minimise::{Effort, Minimum, OneOutput, Refused, per_output, shared};

fn main() {
    let mut words = std::env::args().skip(1);
    let Some(folder) = words.next() else {
        eprintln!("skipped: no folder with tables given (kiss2_counts FOLDER [TRIES])");
        return;
    };
    let tries = words.next().and_then(|word| word.parse().ok()).unwrap_or(300);
    let level = words.next().and_then(|word| word.parse().ok()).unwrap_or(1);
    let only = words.next();
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: {folder} is not a folder");
        return;
    };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "kiss2"));
    paths.sort();
    println!(
        "| machine | in/out/states | one-hot shared | one-hot per output (most) | binary | compact | per output (most) |"
    );
    println!("|---|---|---|---|---|---|---|");
    for path in paths {
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        let Some(machine) = kiss2::parse(FileId(0), &text).0 else { continue };
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        if only.is_some() && only != name {
            continue;
        }
        match row(&machine, tries, level) {
            Ok(row) => println!("| {} | {row} |", name.unwrap_or_default()),
            Err(why) => println!("| {} | {why} |", name.unwrap_or_default()),
        }
    }
}

fn mark(n: usize, minimum: Minimum) -> String {
    match minimum {
        Minimum::Exact => format!("{n} ="),
        Minimum::Between { .. } => n.to_string(),
    }
}

fn sizes(outputs: &[OneOutput]) -> Vec<usize> {
    outputs.iter().map(|output| output.outcome.terms.len()).collect()
}

fn one_hot_sizes(machine: &Machine, effort: &Effort) -> Result<Vec<usize>, Refused> {
    let outcomes = one_hot_per_output(machine, 1 << 25, effort)?;
    Ok(outcomes.iter().map(|outcome| outcome.terms.len()).collect())
}

fn row(machine: &Machine, tries: u64, level: u32) -> Result<String, Refused> {
    let (n_inputs, n_outputs, n_states) =
        (machine.inputs.len(), machine.outputs.len(), machine.states.len());
    // Proofs only for machines that are small enough for them to finish soon.
    let effort = if machine.rows.len() > 400 {
        Effort::of_level(level.saturating_sub(1), false)
    } else {
        Effort::of_level(level, true)
    };
    let together = one_hot(machine, 1 << 25, &effort)?;
    let single = one_hot_sizes(machine, &effort)?;
    // Published counts leave out the rows that apply to every state.
    let mut without = machine.clone();
    without.rows.retain(|row| row.from.is_some());
    let without = if without.rows.len() < machine.rows.len() {
        let sum: usize = one_hot_sizes(&without, &effort)?.iter().sum();
        format!("; {sum} without `*`")
    } else {
        String::new()
    };
    let is_large = machine.rows.len() > 400 || n_states > 64;
    let search = Search { tries: if is_large { 0 } else { tries }, seed: 1 };
    let binary = shared(&function(&table(machine, &Coding::binary(machine)), 1 << 25)?, &effort)?;
    let (coding, compact) = few_products(machine, search, &effort)?;
    let free = sizes(&per_output(&function(&table(machine, &coding), 1 << 25)?, true, &effort)?);
    let most = |sizes: &[usize]| sizes.iter().copied().max().unwrap_or(0);
    Ok(format!(
        "{n_inputs}/{n_outputs}/{n_states} | {} | {} ({}){without} | {} | {} | {} ({})",
        mark(together.terms.len(), together.minimum),
        single.iter().sum::<usize>(),
        most(&single),
        mark(binary.terms.len(), binary.minimum),
        mark(compact.terms.len(), compact.minimum),
        free.iter().sum::<usize>(),
        most(&free),
    ))
}
