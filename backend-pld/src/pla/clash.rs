//! A table as the question that the minimiser is asked, and where the table disagrees with itself.

use super::{Kind, Pla, Places, codes};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::Span;
use grafsynth_logic::minimise::{Function, Terms};

/// The functions of a table, and what is doubtful about it. Where a point is both on and free it is free, as espresso has it; both on and off is
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
            .help("a larger --budget allows larger diagrams, or split the table by outputs");
            let finding = match places.on.first() {
                Some(&span) => finding.at(span, "the first product of the table"),
                None => finding,
            };
            return (None, vec![finding]);
        }
    };
    let mut findings = Vec::new();
    let mut has_error = false;
    for &output in function.contradictory() {
        has_error = true;
        let message = format!("output {} is on and off at one point", table.output_name(output));
        let pair = first_pair((&table.on, &places.on), (&table.off, &places.off), output)
            .or_else(|| first_pair((&table.free, &places.free), (&table.off, &places.off), output));
        findings.push(at_pair(
            Diagnostic::error(codes::CONTRADICTION, message),
            pair,
            ["these points are said to be on or free", "and some of them off here"],
        ));
    }
    for &output in function.overlapping() {
        let message = format!(
            "output {} is on and free at one point, which is taken as free",
            table.output_name(output)
        );
        let pair = first_pair((&table.on, &places.on), (&table.free, &places.free), output);
        let finding = at_pair(
            Diagnostic::warning(codes::OVERLAP, message),
            pair,
            ["these points are on", "and some of them free here"],
        );
        findings.push(if table.kind == Kind::Fd {
            finding.help("write `~` or 0 for an output of which the product says nothing")
        } else {
            finding
        });
    }
    ((!has_error).then_some(function), findings)
}

fn at_pair(finding: Diagnostic, pair: Option<(Span, Span)>, labels: [&str; 2]) -> Diagnostic {
    match pair {
        Some((a, b)) => finding.at(a, labels[0]).at(b, labels[1]),
        None => finding,
    }
}

/// The first two products of an output that meet, of the first few million pairs.
fn first_pair(a: (&Terms, &[Span]), b: (&Terms, &[Span]), output: usize) -> Option<(Span, Span)> {
    let mut left = 4_000_000u32;
    for (one, &place) in a.0.iter().zip(a.1) {
        if !a.0.shape.has_output(one, output) {
            continue;
        }
        for (other, &other_place) in b.0.iter().zip(b.1) {
            left = left.checked_sub(1)?;
            if a.0.shape.meet(one, other, output) {
                return Some((place, other_place));
            }
        }
    }
    None
}
