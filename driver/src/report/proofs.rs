//! The section about proofs: what was proved about each output and each property, how, and over how many states.

use super::{OutputReport, Subject, counted, table::inline};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::PropertyRole;
use grafsynth_verify::Outcome as Verdict;

pub(super) fn write(subject: &Subject<'_>) -> Option<String> {
    let mut text = String::new();
    for line in &subject.built.lines {
        text += &of_line(line);
    }
    let assumptions: Vec<String> = (subject.net.properties.iter().enumerate())
        .filter(|(_, property)| property.role == PropertyRole::Assume)
        .map(|(at, _)| inline(&property(subject, at)))
        .collect();
    for verdict in &subject.properties {
        let property = inline(&property(subject, verdict.property));
        text += &format!("- **{property}**: {}\n", said(&verdict.outcome));
    }
    if !assumptions.is_empty() {
        text += &format!(
            "\nAll of this holds for inputs that satisfy the assumptions of the chart: {}.\n",
            assumptions.join("; ")
        );
    }
    (!text.is_empty()).then_some(text)
}

/// An output: the parts of its line as a list.
fn of_line(line: &OutputReport) -> String {
    let mut text = format!("- **{}**: {}\n", inline(&line.name), line.outcome().name());
    for part in line.parts() {
        text += &format!("  - {}\n", part.replace('\n', " "));
    }
    text
}

/// A property as it was written, or its name.
pub(super) fn property(subject: &Subject<'_>, at: usize) -> String {
    let property = &subject.net.properties[at];
    let span = property.meta.span;
    let written = subject.sources.get(span.file).and_then(|source| source.text.get(span.range()));
    match written.map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")) {
        Some(text) if !text.is_empty() => text,
        Some(_) | None if property.name.is_empty() => format!("property {}", at + 1),
        Some(_) | None => property.name.clone(),
    }
}

/// The result of a property.
pub(super) fn said(outcome: &Verdict) -> String {
    match outcome {
        Verdict::Proved { by, states, .. } => {
            let how = match by {
                Proof::Explicit => "by enumeration",
                Proof::Symbolic => "in the decision diagram of all reachable states",
                Proof::Structural => "from the structure",
                Proof::Induction => "by induction",
                Proof::Directed => "by property-directed reachability",
            };
            let states = if *states > 0 {
                format!(", {}", counted(*states, "state", "states"))
            } else {
                String::new()
            };
            format!("proved {how}{states}")
        }
        Verdict::Refuted { row, .. } => {
            format!("refuted: it is violated in row {row}; `check` prints a stimulus")
        }
        Verdict::Open(why) => format!("open: {}", inline(&why.to_string())),
    }
}
