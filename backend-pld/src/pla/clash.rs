//! Converts a table to the input of the minimiser, and finds contradictions in the table.

use super::{Kind, Pla, Places, codes};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::Span;
use grafsynth_logic::minimise::{Function, Terms};
use itertools::Itertools as _;

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
        contradiction(table, output, pair.ok().flatten().as_ref())
    });
    let overlapping = function.overlapping().iter().map(|&output| {
        let pair = on_and_free(table, places, output, &mut { PAIRS });
        overlap(
            table,
            output,
            pair.ok().flatten().as_ref(),
            "the minimiser treats it as a don't-care",
        )
    });
    let findings = contradictory.chain(overlapping).collect();
    (function.contradictory().is_empty().then_some(function), findings)
}

/// Finds contradictions in a table that is converted to a circuit ([`circuit`](super::circuit())). A point that is on and off is an error, and one that is on and
/// free is treated as on. The check of a very large table is cut short, with a note.
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
        findings.extend(off.ok().flatten().map(|pair| contradiction(table, output, Some(&pair))));
        let shown = "the circuit outputs 1";
        findings.extend(free.ok().flatten().map(|pair| overlap(table, output, Some(&pair), shown)));
    }
    findings
}

/// The maximum number of product pairs that the search for the first intersection examines in [`function`]; [`clashes`] examines up to 50 times as many.
const PAIRS: u32 = 4_000_000;

fn contradiction(table: &Pla, output: usize, pair: Option<&Pair>) -> Diagnostic {
    let name = table.output_name(output);
    let is_free = pair.is_some_and(|pair| pair.is_free);
    let value = if is_free { "a don't-care" } else { "1" };
    let message = format!("output `{name}` is {value} and 0 {}", point(table, pair));
    let finding = Diagnostic::error(codes::CONTRADICTION, message);
    at_pair(finding, pair, [format!("`{name}` is {value} here"), format!("`{name}` is 0 here")])
        .help(format!(
            "make the rows agree, or write `~` for `{name}` in the row that should not define it"
        ))
}

fn overlap(table: &Pla, output: usize, pair: Option<&Pair>, so: &str) -> Diagnostic {
    let name = table.output_name(output);
    let message = format!("output `{name}` is 1 and a don't-care {}; {so}", point(table, pair));
    let finding = Diagnostic::warning(codes::OVERLAP, message);
    let labels = [format!("`{name}` is 1 here"), format!("`{name}` is a don't-care here")];
    let cell = if table.kind == Kind::Fd { "`~` or 0" } else { "`~`" };
    at_pair(finding, pair, labels)
        .help(format!("write {cell} for `{name}` in the row that should not define it"))
}

/// A finding about outputs that the table leaves undefined for some inputs, where the circuit outputs 0.
#[must_use]
pub fn undefined(table: &Pla, places: &Places, outputs: &[usize]) -> Option<Diagnostic> {
    let first = *outputs.first()?;
    let shown: Vec<String> =
        outputs.iter().take(6).map(|output| format!("`{}`", table.output_name(*output))).collect();
    let (last, before) = shown.split_last()?;
    let names = match before {
        [] => format!("output {last} is"),
        _ if outputs.len() > shown.len() => {
            format!("outputs {} and {} more are", shown.join(", "), outputs.len() - shown.len())
        }
        _ => format!("outputs {} and {last} are", before.join(", ")),
    };
    let message = format!("{names} undefined for some inputs, and the circuit outputs 0 there");
    let row = table.free.iter().zip(&places.free);
    let row = row.filter(|(term, _)| table.shape().has_output(term, first)).map(|(_, span)| *span);
    let (label, span) = if table.kind.says_off() {
        let kind = table.kind.name();
        (format!("in a table of type {kind}, inputs in no row are don't-cares"), places.kind)
    } else {
        (format!("`{}` is a don't-care here", table.output_name(first)), row.into_iter().next())
    };
    let finding = Diagnostic::warning(crate::codes::TAKEN_AS, message).help(
        "write 1 in place of `-` where an output must be 1, or let `grafsynth minimise` choose the values",
    );
    Some(match span.or(places.on.first().copied()) {
        Some(span) => finding.at(span, label),
        None => finding,
    })
}

/// Two products of an output that intersect.
struct Pair {
    places: [Span; 2],
    /// The values of the inputs that at least one of the products fixes.
    point: Vec<(usize, bool)>,
    /// True if the first product is a don't-care; false if it is a 1.
    is_free: bool,
}

/// An input at which two products intersect, in words.
fn point(table: &Pla, pair: Option<&Pair>) -> String {
    const SHOWN: usize = 8;
    let Some(pair) = pair else { return "for some input".to_owned() };
    if pair.point.is_empty() {
        return "for every input".to_owned();
    }
    let name = |input: usize| {
        let name = table.inputs.as_ref().and_then(|names| names.get(input).cloned());
        name.unwrap_or_else(|| format!("in{input}"))
    };
    let shown = pair
        .point
        .iter()
        .take(SHOWN)
        .map(|(input, value)| format!("{} = {}", name(*input), u8::from(*value)))
        .join(", ");
    let more = if pair.point.len() > SHOWN { ", .." } else { "" };
    format!("for {shown}{more}")
}

type Found = Result<Option<Pair>, TooMany>;

/// Error: the number of product pairs exceeds the limit.
struct TooMany;

fn on_and_off(table: &Pla, places: &Places, output: usize, left: &mut u32) -> Found {
    let off = (&table.off, places.off.as_slice());
    if !table.kind.says_off() {
        return Ok(None);
    }
    Ok(match first_pair((&table.on, &places.on), off, output, left)? {
        None => first_pair((&table.free, &places.free), off, output, left)?
            .map(|pair| Pair { is_free: true, ..pair }),
        pair => pair,
    })
}

fn on_and_free(table: &Pla, places: &Places, output: usize, left: &mut u32) -> Found {
    first_pair((&table.on, &places.on), (&table.free, &places.free), output, left)
}

fn at_pair(finding: Diagnostic, pair: Option<&Pair>, labels: [String; 2]) -> Diagnostic {
    let [first, second] = labels;
    match pair {
        Some(pair) => finding.at(pair.places[0], first).at(pair.places[1], second),
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
                let shape = a.0.shape;
                let literal = |input| {
                    let value =
                        shape.literal(one, input).or_else(|| shape.literal(other, input))?;
                    Some((input, value))
                };
                let point = (0..shape.inputs()).filter_map(literal).collect();
                return Ok(Some(Pair { places: [place, other_place], point, is_free: false }));
            }
        }
    }
    Ok(None)
}
