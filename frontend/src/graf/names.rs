//! How names are written: plain if they can be read back, otherwise in backquotes.

use grafsynth_ir::chart::Path;
use itertools::Itertools as _;

use super::lexer::is_word;
use super::parser::RESERVED;
use super::steps::{CLAUSES, DONE};
use super::token::SINK;

/// The position of a name. It decides which words would be read as keywords.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Position {
    /// Only reserved words need backquotes.
    Anywhere,
    /// After the keyword of a declaration.
    Declared,
    /// The first word of an item in a step's body.
    Action,
    /// The first target or event of a transition.
    Target,
    /// The name of a step where it is declared.
    Step,
    /// After `after`.
    Length,
    /// The first word of a transition, where `initial ->` has its own meaning.
    Source,
    /// After `history`.
    History,
}

/// Words that begin something else in the body of a step, or look like the next item of the chart.
const ACTION_WORDS: &[&str] = &[
    "entry",
    "exit",
    "on",
    "when",
    "priority",
    "budget",
    "task",
    "code",
    "force",
    "set",
    "reset",
    "raise",
    "send",
    "cancel",
    "call",
    "step",
    "input",
    "output",
    "var",
    "event",
    "internal",
    "timer",
    "action",
    "extern",
    "macro",
    "enclosing",
    "state",
    "parallel",
    "region",
    "history",
    "use",
    "in",
    "final",
    "const",
    "registered",
    "mealy",
    "synchronous",
    "place",
    "device",
    "schedule",
    "fire",
    "assign",
    "actions",
    "events",
    "conflict",
    "chart",
    "evolution",
    "assert",
    "assume",
    "initial",
];

/// The name in the syntax of the chart language.
pub(crate) fn name(text: &str, position: Position) -> String {
    let taken = match position {
        Position::Anywhere => false,
        Position::Declared => matches!(text, "synchronous" | "registered" | "mealy" | "internal"),
        Position::Action => ACTION_WORDS.contains(&text),
        // Without backquotes, `sink` would mean a transition without a target.
        Position::Target => CLAUSES.contains(&text) || text == SINK,
        Position::Step => text == SINK,
        Position::Length => CLAUSES.contains(&text),
        Position::Source => text == "initial",
        Position::History => text == "deep",
    };
    if is_word(text) && !RESERVED.contains(&text) && !taken {
        return text.to_owned();
    }
    // Backquotes cannot contain a backquote or a line break.
    let inner: String =
        text.chars().map(|c| if c == '`' || c == '\n' { '\'' } else { c }).collect();
    if inner.is_empty() { "`_`".to_owned() } else { format!("`{inner}`") }
}

/// The name of a device: without backquotes even if it contains `-` between words and numbers, as in `atf1504-plcc44`.
pub(crate) fn device(text: &str) -> String {
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|one| one.is_ascii_digit());
    let is_plain = |part: &str| is_word(part) || is_number(part);
    let plain = text.split_once('-').filter(|(first, rest)| {
        name(first, Position::Anywhere) == *first && rest.split('-').all(is_plain)
    });
    plain.map_or_else(|| name(text, Position::Anywhere), |_| text.to_owned())
}

/// A name that may belong to another chart, with its dots.
pub(crate) fn dotted(text: &str, position: Position) -> String {
    let parts: Vec<&str> = text.split('.').collect();
    if parts.iter().any(|part| part.is_empty()) {
        return name(text, position);
    }
    let places = std::iter::once(position).chain(std::iter::repeat(Position::Anywhere));

    parts.iter().zip(places).map(|(part, position)| name(part, position)).join(".")
}

/// An event in the syntax of `on`: `p.done` for the completion of a state.
pub(crate) fn event(text: &str, position: Position) -> String {
    match text.strip_prefix(DONE) {
        Some(owner) if !owner.split('.').any(str::is_empty) => {
            format!("{}.done", dotted(owner, position))
        }
        // A name that would be read as a completion but is not one needs backquotes.
        Some(_) => name(text, position),
        None if text.ends_with(".done") => name(text, position),
        None => dotted(text, position),
    }
}

/// Whether the name reads back unchanged when it is written.
pub(crate) fn is_writable(text: &str) -> bool {
    !text.is_empty() && !text.contains(['`', '\n'])
}

/// A dotted name.
pub(crate) fn path(path: &Path, first: Position) -> String {
    let mut out = String::new();
    for (index, part) in path.names.iter().enumerate() {
        if index > 0 {
            out.push('.');
        }
        out.push_str(&name(&part.text, if index == 0 { first } else { Position::Anywhere }));
    }
    out
}

/// A signal of a board. Dots and the number of a bit or element are part of its name.
pub(crate) fn signal(text: &str) -> String {
    let (stem, index) = match text.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
        Some((stem, digits))
            if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) =>
        {
            (stem, Some(digits))
        }
        _ => (text, None),
    };
    let is_plain = stem.split('.').all(|part| is_word(part) && !RESERVED.contains(&part));
    // A number that would read back differently (`007`, or too large) keeps its backquotes.
    let reads_back =
        index.is_none_or(|digits| digits.parse::<u32>().is_ok_and(|n| n.to_string() == digits));
    if is_plain && reads_back { text.to_owned() } else { name(text, Position::Anywhere) }
}

/// A text in double quotes.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
