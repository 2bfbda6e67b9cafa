//! Minimises two-level logic tables: read, minimise, report.

use grafsynth_backend_pld::pla::{self, Kind, Pla};
use grafsynth_ir::diag::{Diagnostic, counted};
use grafsynth_ir::span::FileId;
use grafsynth_logic::minimise::{
    Effort, Minimum, OneOutput, Outcome, Primes, Refused, per_output, phased, shared,
};
use std::fmt::Write as _;

/// The options of the minimiser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Minimise each output separately, as for a PAL; otherwise outputs share products.
    pub per_output: bool,
    /// True if outputs may be inverted.
    pub free_polarity: bool,
    /// Find the proved minimum, not only a small sum.
    pub exact: bool,
    /// The effort: see [`Effort::of_level`].
    pub budget: u32,
}

/// A minimised table.
#[derive(Debug, Clone)]
pub struct Minimised {
    /// The minimised table.
    pub table: Pla,
    /// The table as text.
    pub text: String,
    /// Products, literals and what is proved, in a few lines.
    pub report: String,
    /// True if each number of products is proved to be the minimum.
    pub is_exact: bool,
}

/// Reads and minimises a table. The result is compared with the original before it is returned.
///
/// # Errors
/// There is no table if one of the findings is an error.
pub fn minimise(
    file: FileId,
    text: &str,
    options: &Options,
) -> (Option<Minimised>, Vec<Diagnostic>) {
    let (read, mut findings) = pla::read(file, text);
    let Some((table, places)) = read else { return (None, findings) };
    let effort = if options.exact {
        Effort::of_level(options.budget, true)
    } else {
        Effort::quick(options.budget)
    };
    let (function, more) = pla::function(&table, &places, effort.nodes);
    findings.extend(more);
    let Some(function) = function else { return (None, findings) };
    let outcome = if options.per_output {
        per_output(&function, options.free_polarity, &effort)
            .map(|outputs| separate(&table, &outputs))
    } else if options.free_polarity {
        with_phases(&table, &function, options, &effort)
    } else {
        shared(&function, &effort)
            .map(|outcome| together(&table, outcome, &vec![false; table.shape().outputs()]))
    };
    match outcome {
        Ok(minimised) => (Some(minimised), findings),
        Err(refused) => {
            let finding = Diagnostic::error(
                pla::codes::TOO_LARGE,
                format!("the table cannot be minimised: {refused}"),
            )
            .help("raise --budget to allow larger diagrams, or split the table by outputs");
            findings.push(match places.on.first() {
                Some(&span) => finding.at(span, "the first product of the table"),
                None => finding,
            });
            (None, findings)
        }
    }
}

/// The number of phase combinations that are tried for each unit of the budget.
const TRIES: usize = 40;

/// The shared sum with those of the tried phases that need the fewest products, and the number of tries.
fn with_phases(
    table: &Pla,
    function: &grafsynth_logic::minimise::Function,
    options: &Options,
    effort: &Effort,
) -> Result<Minimised, Refused> {
    let tries = TRIES * options.budget.max(1) as usize;
    let found = phased(function, effort, tries)?;
    let mut small = together(table, found.outcome, &found.is_complemented);
    let _ = writeln!(
        small.report,
        "phases: {}{} tried",
        if found.is_complete { "all " } else { "" },
        counted(found.tries, "choice", "choices")
    );
    Ok(small)
}

fn together(table: &Pla, outcome: Outcome, phases: &[bool]) -> Minimised {
    let mut report = String::new();
    let _ = writeln!(
        report,
        "shared: {}, {}; {}{}",
        counted(outcome.terms.len(), "product", "products"),
        proof(outcome.minimum),
        counted(outcome.terms.n_literals(), "literal", "literals"),
        primes(&outcome)
    );
    if phases.contains(&true) {
        let names: Vec<String> = (0..phases.len())
            .filter(|output| phases[*output])
            .map(|output| table.output_name(output))
            .collect();
        let _ = writeln!(report, "inverted: {}", names.join(" "));
    }
    let is_exact = outcome.minimum == Minimum::Exact;
    let small = Pla {
        kind: Kind::Fd,
        free: grafsynth_logic::minimise::Terms::new(table.shape()),
        off: grafsynth_logic::minimise::Terms::new(table.shape()),
        on: outcome.terms,
        is_inverted: flipped(&table.is_inverted, phases),
        ..table.clone()
    };
    Minimised { text: pla::write(&small), table: small, report, is_exact }
}

fn separate(table: &Pla, outputs: &[OneOutput]) -> Minimised {
    let shape = table.shape();
    let mut small = Pla::new(Kind::Fd, shape);
    small.inputs.clone_from(&table.inputs);
    small.outputs.clone_from(&table.outputs);
    let phases: Vec<bool> = outputs.iter().map(|output| output.is_complemented).collect();
    small.is_inverted = flipped(&table.is_inverted, &phases);
    let mut report = String::new();
    let width = (0..outputs.len()).map(|o| table.output_name(o).chars().count()).max().unwrap_or(0);
    let (mut products, mut literals, mut lower) = (0, 0, 0);
    for (index, output) in outputs.iter().enumerate() {
        let terms = &output.outcome.terms;
        for term in terms.iter() {
            let own = terms.shape;
            let row = (0..own.inputs())
                .filter_map(|input| own.literal(term, input).map(|value| (input, value)));
            small.on.add(row, [index]);
        }
        products += terms.len();
        literals += terms.n_literals();
        lower += match output.outcome.minimum {
            Minimum::Exact => terms.len(),
            Minimum::Between { lower, .. } => lower,
        };
        let _ = writeln!(
            report,
            "{:width$}  {}  {}, {}; {}",
            table.output_name(index),
            if output.is_complemented { "inverted" } else { "as it is" },
            counted(terms.len(), "product", "products"),
            proof(output.outcome.minimum),
            counted(terms.n_literals(), "literal", "literals"),
        );
    }
    let is_exact = lower == products;
    let minimum =
        if is_exact { Minimum::Exact } else { Minimum::Between { lower, found: products } };
    let _ = writeln!(
        report,
        "per output: {}, {}; {}",
        counted(products, "product", "products"),
        proof(minimum),
        counted(literals, "literal", "literals")
    );
    Minimised { text: pla::write(&small), table: small, report, is_exact }
}

fn flipped(before: &[bool], phases: &[bool]) -> Vec<bool> {
    before.iter().zip(phases).map(|(before, phase)| before ^ phase).collect()
}

/// Describes what is proved about a number of products. Nothing is proved about literals.
fn proof(minimum: Minimum) -> String {
    match minimum {
        Minimum::Exact => "proved minimum".to_owned(),
        Minimum::Between { lower, .. } => format!("at least {lower} are needed"),
    }
}

fn primes(outcome: &Outcome) -> String {
    match outcome.primes {
        Primes::All(n) => {
            format!(" ({}, {} essential)", counted(n, "prime", "primes"), outcome.n_essential)
        }
        Primes::MoreThan(n) => format!(" ({n} primes, too many to list)"),
        Primes::Unknown => String::new(),
    }
}
