//! The finite set of events of a chart, and which events each descriptor matches (SCXML 1.0, §3.12.1).
//!
//! The events of a chart are the events that it raises or sends, the completions of its states, and the external events: those that its
//! transitions wait for but that nothing in it raises. A descriptor matches the events that it names and those that begin with its tokens;
//! `*` matches all.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{Name, Span};

use super::names::Names;
use super::tree::{ActKind, Child, Machine};
use crate::codes;
use crate::findings::Findings;

/// Maximum number of matches between descriptors and events.
const MAX_MATCHES: usize = 200_000;

/// One event of the chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Event {
    /// Its name in the chart.
    pub(super) name: String,
    /// Location of its first mention.
    pub(super) span: Span,
    pub(super) is_internal: bool,
    /// Whether it is the completion event of a state; such an event need not be declared.
    pub(super) is_done: bool,
}

/// All events of a chart.
#[derive(Debug, Default)]
pub(super) struct Alphabet {
    /// The events in the order of their declaration.
    pub(super) events: Vec<Event>,
    by_name: BTreeMap<String, usize>,
    matches: usize,
}

/// The tokens of a descriptor, and whether an asterisk or a dot follows them.
fn stem(descriptor: &str) -> (&str, bool) {
    if descriptor == "*" {
        return ("", true);
    }
    match descriptor.strip_suffix(".*").or(descriptor.strip_suffix('.')) {
        Some(stem) => (stem, true),
        None => (descriptor, false),
    }
}

/// Whether the name equals the stem or begins with its tokens.
fn begins(name: &str, stem: &str) -> bool {
    name.strip_prefix(stem).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// The first token.
fn head(name: &str) -> &str {
    name.split('.').next().unwrap_or(name)
}

/// The events that a document names, in the source order of their first mentions. `raised` are those that it raises or sends.
fn mentioned<'a>(machine: &'a Machine, raised: &'a BTreeMap<String, Span>) -> Vec<(&'a str, Span)> {
    let mut waited: Vec<&Name> = Vec::new();
    machine.each_state(&mut |state| {
        for child in &state.children {
            if let Child::Transition(transition) = child {
                waited.extend(&transition.events);
            }
        }
    });
    let mut wanted: Vec<(&str, Span)> = Vec::new();
    // Plain names first: a descriptor with an asterisk matches the events that others name.
    let candidates: BTreeSet<&str> = waited
        .iter()
        .map(|name| stem(&name.text))
        .filter(|(text, more)| !more && !matches!(head(text), "error" | "done"))
        .map(|(text, _)| text)
        .gather();
    let names_others = |text: &str, more: bool| {
        let prefix = format!("{text}.");
        let follows = |name: Option<&str>| name.is_some_and(|name| name.starts_with(&prefix));
        let after_raised = raised.range(prefix.clone()..).next().map(|(name, _)| name.as_str());
        let after_waited = candidates.range(prefix.as_str()..).next().copied();
        follows(after_raised) || more && follows(after_waited)
    };
    for name in &waited {
        let (text, more) = stem(&name.text);
        if text.is_empty() || matches!(head(text), "error" | "done") {
            continue;
        }
        if raised.contains_key(text) || !names_others(text, more) {
            wanted.push((text, name.span));
        }
    }
    wanted.extend(raised.iter().map(|(name, span)| (name.as_str(), *span)));
    wanted.extend(machine.settings.inputs.iter().map(|name| (name.text.as_str(), name.span)));
    // The events are in the source order of their first mentions.
    wanted.sort_by_key(|(_, span)| span.start);
    wanted
}

impl Alphabet {
    /// Collects the events of a document.
    pub(super) fn of(machine: &Machine, names: &mut Names, found: &mut Findings) -> Alphabet {
        let mut raised: BTreeMap<String, Span> = BTreeMap::new();
        machine.each_act(&mut |act| {
            if let ActKind::Raise(event) | ActKind::Send { event, .. } = &act.kind {
                raised.entry(event.text.clone()).or_insert(event.span);
            }
        });
        let outside: BTreeSet<&str> =
            machine.settings.inputs.iter().map(|name| name.text.as_str()).gather();
        let inside: BTreeSet<&str> =
            machine.settings.internals.iter().map(|name| name.text.as_str()).gather();
        let mut alphabet = Alphabet::default();
        for (text, span) in mentioned(machine, &raised) {
            if alphabet.by_name.contains_key(text) {
                continue;
            }
            if text.starts_with("done.state.")
                && raised.contains_key(text)
                && alphabet.done(text, span, names)
            {
                continue;
            }
            let is_internal =
                inside.contains(text) || raised.contains_key(text) && !outside.contains(text);
            let name = names.fresh(text, "_event");
            alphabet.add(text, Event { name, span, is_internal, is_done: false });
        }
        let done: Vec<(String, Span)> = names
            .states
            .iter()
            .filter(|(_, known)| known.completes)
            .map(|(id, known)| (format!("done.state.{id}"), known.span))
            .collect();
        for (text, span) in done {
            if !alphabet.by_name.contains_key(&text) {
                alphabet.done(&text, span, names);
            }
        }
        for name in &machine.settings.internals {
            if !alphabet.by_name.contains_key(&name.text) {
                found.report(|| {
                    Diagnostic::warning(
                        codes::SCXML_NEVER,
                        format!("the chart does not use the event `{name}`"),
                    )
                    .at(name.span, "")
                });
            }
        }
        alphabet
    }

    fn add(&mut self, text: &str, event: Event) {
        self.by_name.insert(text.to_owned(), self.events.len());
        self.events.push(event);
    }

    /// Adds the completion of a state; false if there is no such state or it never completes.
    fn done(&mut self, text: &str, span: Span, names: &Names) -> bool {
        let id = text.strip_prefix("done.state.").unwrap_or_default();
        let Some(known) = names.states.get(id).filter(|known| known.completes) else {
            return false;
        };
        let name = format!("done.state.{}", known.name);
        self.add(text, Event { name, span, is_internal: true, is_done: true });
        true
    }

    /// The chart name of an event that is raised or sent.
    pub(super) fn named(&self, event: &Name) -> Option<Name> {
        let index = self.by_name.get(&event.text)?;
        Some(Name::new(self.events[*index].name.as_str(), event.span))
    }

    /// Whether an event matches one of these descriptors.
    pub(super) fn matches_any(&self, descriptors: &[Name]) -> bool {
        descriptors.iter().any(|descriptor| {
            let (text, _) = stem(&descriptor.text);
            let prefix = format!("{text}.");
            let mut longer = self.by_name.range(prefix.clone()..);
            text.is_empty() && !self.events.is_empty()
                || self.by_name.contains_key(text)
                || longer.next().is_some_and(|(name, _)| name.starts_with(&prefix))
        })
    }

    /// The events that the descriptors match, in the order of declaration, each event once.
    pub(super) fn matched(
        &mut self,
        descriptors: &[Name],
        names: &Names,
        found: &mut Findings,
    ) -> Vec<Name> {
        let mut all: BTreeMap<usize, Span> = BTreeMap::new();
        for descriptor in descriptors {
            let (text, _) = stem(&descriptor.text);
            let before = all.len();
            if text.is_empty() {
                if self.matches + self.events.len() > MAX_MATCHES {
                    self.too_many(descriptor, found);
                    return Vec::new();
                }
                for index in 0..self.events.len() {
                    all.entry(index).or_insert(descriptor.span);
                }
            } else {
                let exact = self.by_name.get(text).copied();
                let prefix = format!("{text}.");
                let longer = self
                    .by_name
                    .range(prefix.clone()..)
                    .take_while(|(name, _)| name.starts_with(&prefix))
                    .map(|(_, index)| *index)
                    .take(MAX_MATCHES - self.matches.min(MAX_MATCHES));
                for index in exact.into_iter().chain(longer) {
                    all.entry(index).or_insert(descriptor.span);
                }
            }
            self.matches += all.len() - before;
            if self.matches > MAX_MATCHES {
                self.too_many(descriptor, found);
                return Vec::new();
            }
            if all.len() == before {
                self.never(descriptor, names, found);
            }
        }
        all.into_iter()
            .map(|(index, span)| Name::new(self.events[index].name.as_str(), span))
            .collect()
    }

    fn too_many(&mut self, descriptor: &Name, found: &mut Findings) {
        found.report(|| {
            Diagnostic::error(
                codes::SCXML_SIZE,
                format!("the event descriptors of the chart have more than {MAX_MATCHES} matches"),
            )
            .at(descriptor.span, "the limit is exceeded here")
            .help("name single events instead of `*` or a common prefix")
        });
    }

    /// Reports a descriptor without a matching event, unless other descriptors of the same transition already matched its events.
    fn never(&self, descriptor: &Name, names: &Names, found: &mut Findings) {
        let (text, _) = stem(&descriptor.text);
        if self.by_name.keys().any(|name| begins(name, text))
            || text.is_empty() && !self.events.is_empty()
        {
            return;
        }
        if let Some(id) = text.strip_prefix("done.state.")
            && !names.states.contains_key(id)
        {
            found.report(|| names.unknown(id, descriptor.span));
            return;
        }
        found.report(|| {
            let finding = Diagnostic::warning(
                codes::SCXML_NEVER,
                format!("the event `{descriptor}` never occurs"),
            )
            .at(descriptor.span, "never matches");
            match head(text) {
                "error" => finding.help(
                    "remove this transition: a document that could raise an error event is rejected, so error events never occur",
                ),
                "done" => match text.strip_prefix("done.state.") {
                    Some(id) => finding.help(format!(
                        "only a state with a <final> child completes: add <final id=\"{id}_end\"/> to `{id}`, and a transition to it"
                    )),
                    None => finding
                        .help("write done.state. and the identifier of a state with a <final> child"),
                },
                _ => finding.help(format!(
                    "write the name of an event that a <send> or <raise> names, or declare this event as external: g:input=\"{text}\" in <scxml>"
                )),
            }
        });
    }
}
