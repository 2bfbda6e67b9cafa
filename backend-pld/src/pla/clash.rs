//! Converts a table to the input of the minimiser, and finds contradictions in the table.

use super::{Kind, Pla, Places, codes};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::Span;
use grafsynth_logic::minimise::{Function, Terms};

/// The functions of a table, and findings about it. A point that is both on and free is free, as in espresso; a point that is both on and off is
/// an error. `nodes` bounds the diagrams.
#[must_use]
pub fn function(table: &Pla, places: &Places, nodes: usize) -> (Option<Function>, Vec<Diagnostic>) {
    let off = table.kind.says_off().then_some(&table.off);
    let function = match Function::new(&table.on, &table.free, off, nodes) {
        Ok(function) => function,
        Err(refused) => {
            let finding = Diagnostic::error(
                codes::TOO_LARGE,
                format!("the table cannot be minimised: {refused}"),
            )
            .help("raise --budget to allow larger diagrams, or split the table by outputs");
            let finding = match places.on.first() {
                Some(&span) => finding.at(span, "the first product of the table"),
                None => finding,
            };
            return (None, vec![finding]);
        }
    };
    let contradictory = function.contradictory().iter().map(|&output| {
        let pair = on_and_off(table, places, output, &mut { PAIRS });
        contradiction(table, output, pair.ok().flatten())
    });
    let overlapping = function.overlapping().iter().map(|&output| {
        let pair = on_and_free(table, places, output, &mut { PAIRS });
        overlap(table, output, pair.ok().flatten(), "which is treated as a don't-care")
    });
    let findings = contradictory.chain(overlapping).collect();
    (function.contradictory().is_empty().then_some(function), findings)
}

/// Finds contradictions in a table that is converted to a circuit ([`circuit`](super::circuit())): a point that is on and off is an error, one that is on
/// and free is treated as on. The check of a very large table is cut short, with a note.
#[must_use]
pub fn clashes(table: &Pla, places: &Places) -> Vec<Diagnostic> {
    let mut left = 50 * PAIRS;
    let mut findings = Vec::new();
    for output in 0..table.shape().outputs() {
        let off = on_and_off(table, places, output, &mut left);
        let free = on_and_free(table, places, output, &mut left);
        if off.is_err() || free.is_err() {
            let message = "the table is large, so only part of it was checked for points that are both on and off";
            let finding = Diagnostic::warning(codes::TOO_LARGE, message);
            findings.push(match places.on.first() {
                Some(&span) => finding.at(span, "the first product of the table"),
                None => finding,
            });
            break;
        }
        findings.extend(off.ok().flatten().map(|pair| contradiction(table, output, Some(pair))));
        let shown = "and the circuit treats it as on";
        findings.extend(free.ok().flatten().map(|pair| overlap(table, output, Some(pair), shown)));
    }
    findings
}

/// The maximum number of product pairs that the search for the first intersection examines.
const PAIRS: u32 = 4_000_000;

fn contradiction(table: &Pla, output: usize, pair: Option<(Span, Span)>) -> Diagnostic {
    let message = format!("output {} is on and off at one point", table.output_name(output));
    let finding = Diagnostic::error(codes::CONTRADICTION, message);
    at_pair(finding, pair, ["these points are on or don't-care", "and some of them off here"])
}

fn overlap(table: &Pla, output: usize, pair: Option<(Span, Span)>, so: &str) -> Diagnostic {
    let message = format!(
        "output `{}` is both on and a don't-care at one point, {so}",
        table.output_name(output)
    );
    let finding = Diagnostic::warning(codes::OVERLAP, message);
    let finding =
        at_pair(finding, pair, ["these points are on", "and some of them are don't-cares here"]);
    if table.kind == Kind::Fd {
        finding.help("write `~` or 0 for an output that the product does not define")
    } else {
        finding
    }
}

type Found = Result<Option<(Span, Span)>, TooMany>;

/// There are more pairs than the limit.
struct TooMany;

fn on_and_off(table: &Pla, places: &Places, output: usize, left: &mut u32) -> Found {
    let off = (&table.off, places.off.as_slice());
    if !table.kind.says_off() {
        return Ok(None);
    }
    Ok(match first_pair((&table.on, &places.on), off, output, left)? {
        None => first_pair((&table.free, &places.free), off, output, left)?,
        pair => pair,
    })
}

fn on_and_free(table: &Pla, places: &Places, output: usize, left: &mut u32) -> Found {
    first_pair((&table.on, &places.on), (&table.free, &places.free), output, left)
}

fn at_pair(finding: Diagnostic, pair: Option<(Span, Span)>, labels: [&str; 2]) -> Diagnostic {
    match pair {
        Some((a, b)) => finding.at(a, labels[0]).at(b, labels[1]),
        None => finding,
    }
}

/// The first two products of an output that intersect.
fn first_pair(a: (&Terms, &[Span]), b: (&Terms, &[Span]), output: usize, left: &mut u32) -> Found {
    for (one, &place) in a.0.iter().zip(a.1) {
        if !a.0.shape.has_output(one, output) {
            continue;
        }
        for (other, &other_place) in b.0.iter().zip(b.1) {
            *left = left.checked_sub(1).ok_or(TooMany)?;
            if a.0.shape.meet(one, other, output) {
                return Ok(Some((place, other_place)));
            }
        }
    }
    Ok(None)
}
