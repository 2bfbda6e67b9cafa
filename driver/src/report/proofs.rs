//! The section about proofs: what was proved about each output and each property, how, and over how many states.

use super::document::{Block, Inline, Item, Rich};
use super::{OutputReport, Subject, counted};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::PropertyRole;
use grafsynth_verify::Outcome as Verdict;

pub(super) fn write(subject: &Subject<'_>) -> Vec<Block> {
    let mut items: Vec<Item> = subject.built.lines.iter().map(of_line).collect();
    let assumptions: Vec<String> = (subject.net.properties.iter().enumerate())
        .filter(|(_, property)| property.role == PropertyRole::Assume)
        .map(|(at, _)| property(subject, at))
        .collect();
    for verdict in &subject.properties {
        let name = Inline::Strong(property(subject, verdict.property));
        items.push(Rich::say("{}: ", [name]).and(said(&verdict.outcome)).into());
    }
    let mut blocks = Vec::new();
    if !items.is_empty() {
        blocks.push(Block::List(items));
    }
    if !assumptions.is_empty() {
        blocks.push(Block::Paragraph(Rich::say(
            "All of this holds for inputs that satisfy the assumptions of the chart: {}.",
            [assumptions.join("; ").into()],
        )));
    }
    blocks
}

/// An output: the parts of its line as a list.
pub(crate) fn of_line(line: &OutputReport) -> Item {
    let name = Inline::Strong(line.name.clone());
    Item {
        text: Rich::say("{}: ", [name]).and(Rich::verdict(line.outcome().name())),
        parts: line.parts().map(|part| Rich::message(part.replace('\n', " "))).collect(),
    }
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
pub(super) fn said(outcome: &Verdict) -> Rich {
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
            Rich::verdict("proved").and(Rich::plain(format!(" {how}{states}")))
        }
        Verdict::Refuted { row, .. } => {
            let row = row.to_string().into();
            let words = ": it is violated in row {}; `check` prints a stimulus";
            Rich::verdict("refuted").and(Rich::say(words, [row]))
        }
        Verdict::Open(why) => {
            Rich::verdict("open").and(Rich::say(": {}", [why.to_string().into()]))
        }
    }
}
