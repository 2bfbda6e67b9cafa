//! Combines findings of one kind into one finding for people: one message, all locations.
//!
//! Findings are of one kind if their codes, severities and files are the same, and if in addition either their messages and help texts or their wordings
//! for several findings ([`Plural`]) are the same.

use grafsynth_driver::source::Sources;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::{Diagnostic, Label, Plural, Severity, joined};
use grafsynth_ir::{FileId, Span};
use std::collections::BTreeSet;

/// The maximum number of source lines shown for one finding; further locations are given as line numbers.
const MOST_LINES: usize = 6;
/// The maximum number of names that are all listed; of a longer list, only the first [`NAMES_OF_MANY`] are shown.
const MOST_NAMES: usize = 6;
/// The number of names shown of a longer list.
const NAMES_OF_MANY: usize = 3;
/// The maximum number of line numbers, or ranges of them, that are listed.
const MOST_NUMBERS: usize = 12;

/// A finding, or several of one kind.
pub(super) struct Folded<'a> {
    /// The first finding, which has the common properties of all.
    pub(super) first: &'a Diagnostic,
    /// The message.
    pub(super) message: String,
    /// The locations that are shown, the main ones first.
    pub(super) labels: Vec<Label>,
    /// The number of main labels.
    pub(super) n_main: usize,
    /// The line numbers of the other locations, as a sentence.
    pub(super) rest: Option<String>,
    /// The help; if it differs between the findings, the help of the first one.
    pub(super) help: Option<String>,
}

/// Each finding separately, not combined with others.
pub(super) fn apart(sorted: Vec<&Diagnostic>) -> Vec<Folded<'_>> {
    sorted.into_iter().map(alone).collect()
}

fn alone(first: &Diagnostic) -> Folded<'_> {
    let (message, labels) = (first.message.clone(), first.labels.clone());
    Folded { first, message, labels, n_main: 1, rest: None, help: first.help.clone() }
}

/// The properties that findings of one kind have in common.
#[derive(PartialEq)]
struct Kind<'a> {
    code: &'static str,
    severity: Severity,
    file: FileId,
    words: Words<'a>,
}

#[derive(PartialEq)]
enum Words<'a> {
    Message { message: &'a str, help: Option<&'a str> },
    Plural { before: &'a str, after: &'a str },
}

/// The kind of a finding; `None` if it has no location, so it cannot be combined with others.
fn kind(one: &Diagnostic) -> Option<Kind<'_>> {
    let words = match &one.plural {
        Some(Plural { before, after, .. }) => Words::Plural { before, after },
        None => Words::Message { message: &one.message, help: one.help.as_deref() },
    };
    Some(Kind {
        code: one.code.id,
        severity: one.severity,
        file: one.labels.first()?.span.file,
        words,
    })
}

/// Combines findings of one kind; the result has the position of the first of its kind.
pub(super) fn fold<'a>(sources: &Sources, sorted: Vec<&'a Diagnostic>) -> Vec<Folded<'a>> {
    let mut groups: Vec<(Option<Kind<'_>>, Vec<&Diagnostic>)> = Vec::new();
    for one in sorted {
        let is_repeated = one.labels.is_empty() && groups.iter().any(|(_, all)| all.contains(&one));
        if is_repeated {
            continue;
        }
        let kind = kind(one);
        let known = groups.iter_mut().find(|(other, _)| other.is_some() && *other == kind);
        match known {
            Some((_, all)) => all.push(one),
            None => groups.push((kind, vec![one])),
        }
    }
    groups.iter().map(|(_, all)| together(sources, all)).collect()
}

/// Findings of one kind as one.
fn together<'a>(sources: &Sources, all: &[&'a Diagnostic]) -> Folded<'a> {
    let mut folded = alone(all[0]);
    // Equal findings at the same location count as one.
    let mut places: BTreeSet<Span> = BTreeSet::new();
    let all: Vec<&Diagnostic> = all
        .iter()
        .copied()
        .filter(|one| one.labels.first().is_some_and(|label| places.insert(label.span)))
        .collect();
    if all.len() < 2 {
        return folded;
    }
    folded.message = message(&all);
    if all.iter().any(|one| one.help != all[0].help) {
        folded.help = folded.help.map(|help| format!("for the first one: {help}"));
    } else if !folded.message.starts_with(&all[0].message) {
        // The message names several objects, but the help is written for one of them.
        folded.help = folded.help.map(|help| format!("in each case: {help}"));
    }
    let line = |span: Span| {
        sources.get(span.file).map_or(0, |source| source.line_of(span.start as usize) + 1)
    };
    let mut lines: BTreeSet<usize> = BTreeSet::new();
    let (mut main, mut others): (Vec<Label>, Vec<Label>) = (Vec::new(), Vec::new());
    let mut rest: Vec<usize> = Vec::new();
    for one in &all {
        let own = || one.labels.iter().map(|label| line(label.span));
        let new = own().filter(|line| !lines.contains(line)).gather::<BTreeSet<_>>().len();
        if !main.is_empty() && lines.len() + new > MOST_LINES {
            rest.extend(own().next());
            continue;
        }
        lines.extend(own());
        let mut labels = one.labels.iter().cloned();
        if let Some(mut label) = labels.next() {
            // A label text that all locations share is shown only at the first.
            if main.iter().any(|known| known.text == label.text) {
                label.text.clear();
            }
            main.push(label);
        }
        others.extend(labels);
    }
    let mut known: BTreeSet<Span> = main.iter().map(|label| label.span).gather();
    others.retain(|label| known.insert(label.span));
    folded.n_main = main.len();
    main.append(&mut others);
    folded.labels = main;
    folded.rest = (!rest.is_empty()).then(|| also_on(&rest));
    folded
}

/// The message for several findings: it lists what they name, or counts the locations.
fn message(all: &[&Diagnostic]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for plural in all.iter().filter_map(|one| one.plural.as_ref()) {
        if !names.contains(&plural.item.as_str()) {
            names.push(&plural.item);
        }
    }
    let Some(Plural { before, after, .. }) = all[0].plural.as_ref().filter(|_| names.len() > 1)
    else {
        return format!("{} ({} places)", all[0].message, all.len());
    };
    let list = if names.len() <= MOST_NAMES {
        joined(&names, "and")
    } else {
        format!("{}, ... ({})", names[..NAMES_OF_MANY].join(", "), names.len())
    };
    let parts = [before.as_str(), &list, after].into_iter().filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join(" ")
}

/// Line numbers as a sentence; consecutive numbers as a range.
fn also_on(lines: &[usize]) -> String {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for line in lines.iter().copied().gather::<BTreeSet<_>>() {
        match ranges.last_mut() {
            Some((_, to)) if line == *to + 1 => *to = line,
            _ => ranges.push((line, line)),
        }
    }
    let noun = if matches!(ranges[..], [(from, to)] if from == to) { "line" } else { "lines" };
    let left: usize = ranges.iter().skip(MOST_NUMBERS).map(|(from, to)| to - from + 1).sum();
    let shown = ranges.iter().take(MOST_NUMBERS).map(|(from, to)| match to - from {
        0 => from.to_string(),
        1 => format!("{from}, {to}"),
        _ => format!("{from} to {to}"),
    });
    let mut text = format!("also on {noun} {}", shown.collect::<Vec<_>>().join(", "));
    if left > 0 {
        text += &format!(", and {left} more");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::also_on;

    #[test]
    fn neighbouring_lines_are_a_range() {
        assert_eq!(also_on(&[7]), "also on line 7");
        assert_eq!(also_on(&[3, 4, 9, 10, 11, 3]), "also on lines 3, 4, 9 to 11");
        let many: Vec<usize> = (1..=20).map(|n| 2 * n).collect();
        assert!(also_on(&many).ends_with("22, 24, and 8 more"));
    }
}
