//! Gives everything in a document a unique name: SCXML separates the names of states, data and events; a chart has a single namespace.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::Path;
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::{Name, Span};

use super::tree::{Machine, State, StateKind};
use crate::codes;
use crate::findings::Findings;

/// The meaning of an identifier in a document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Known {
    /// Its name in the chart, where names of states need no path (semantics C25).
    pub(super) name: String,
    /// Whether this is one of the outermost states.
    pub(super) is_outermost: bool,
    pub(super) span: Span,
    pub(super) is_history: bool,
    /// Whether its completion raises an event: it has a final child, or it is a parallel state of such states.
    pub(super) completes: bool,
}

/// The names of a document.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// States and histories by their identifiers.
    pub(super) states: BTreeMap<String, Known>,
    /// The chart names of all states in document order; the names of histories follow those of their states.
    order: Vec<String>,
    /// Chart names in use.
    taken: BTreeSet<String>,
}

/// A valid chart name: dots would separate the parts of a path, commas and blanks the cells of a trace.
fn plain(text: &str) -> String {
    let good = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    let name: String = text.chars().map(|c| if good(c) { c } else { '_' }).collect();
    if name.is_empty() { "_".to_owned() } else { name }
}

impl Names {
    /// Returns an unused name; appends `_2` and so on if necessary.
    pub(super) fn fresh(&mut self, wanted: &str, suffix: &str) -> String {
        let base = plain(wanted);
        let mut name = base.clone();
        if self.taken.contains(&name) && !suffix.is_empty() {
            name = format!("{base}{suffix}");
        }
        let mut number = 2_u32;
        let stem = name.clone();
        while !self.taken.insert(name.clone()) {
            name = format!("{stem}_{number}");
            number += 1;
        }
        name
    }

    /// Names all states and histories; reports duplicate identifiers.
    pub(super) fn of_states(machine: &Machine, found: &mut Findings) -> Names {
        let mut names = Names::default();
        // Existing identifiers are used first, before names are invented for states without one.
        machine.each_state(&mut |state| {
            let ids =
                state.id.iter().chain(state.histories.iter().filter_map(|one| one.id.as_ref()));
            for id in ids {
                if let Some(earlier) = names.states.get(&id.text) {
                    let first = earlier.span;
                    found.report(|| twice(id, first));
                    continue;
                }
                let known = Known {
                    name: String::new(),
                    is_outermost: false,
                    span: id.span,
                    is_history: false,
                    completes: false,
                };
                names.states.insert(id.text.clone(), known);
            }
        });
        let wanted: Vec<String> = names.states.keys().cloned().collect();
        let mut given: BTreeMap<String, String> = BTreeMap::new();
        for id in wanted {
            let name = names.fresh(&id, "");
            given.insert(id, name);
        }
        let mut path = Vec::new();
        for state in &machine.states {
            names.walk(state, &mut path, &given);
        }
        names
    }

    fn walk(&mut self, state: &State, path: &mut Vec<String>, given: &BTreeMap<String, String>) {
        let name = match state.id.as_ref().and_then(|id| given.get(&id.text)) {
            Some(name) => name.clone(),
            None => {
                let kind = match state.kind {
                    StateKind::State => "state",
                    StateKind::Parallel => "parallel",
                    StateKind::Final => "final",
                };
                match path.last() {
                    Some(around) => self.fresh(&format!("{around}_{kind}"), ""),
                    None => self.fresh(kind, ""),
                }
            }
        };
        self.order.push(name.clone());
        path.push(name);
        if let Some(known) = state.id.as_ref().and_then(|id| self.states.get_mut(&id.text)) {
            known.name = path.last().cloned().unwrap_or_default();
            known.is_outermost = path.len() == 1;
            known.completes = completes(state);
        }
        for history in &state.histories {
            let name = match history.id.as_ref().and_then(|id| given.get(&id.text)) {
                Some(name) => name.clone(),
                None => {
                    let around = path.last().cloned().unwrap_or_default();
                    self.fresh(&format!("{around}_history"), "")
                }
            };
            self.order.push(name.clone());
            if let Some(known) = history.id.as_ref().and_then(|id| self.states.get_mut(&id.text)) {
                known.name = name;
                known.is_history = true;
            }
        }
        for inner in state.states() {
            self.walk(inner, path, given);
        }
        path.pop();
    }

    /// The names of states and histories in the order in which [`Names::of_states`] visited them.
    pub(super) fn in_order(&self) -> impl Iterator<Item = &String> {
        self.order.iter()
    }

    /// The path of a state or history; `None` (with a report) if none has this identifier.
    pub(super) fn path(&self, id: &Name, found: &mut Findings) -> Option<Path> {
        match self.states.get(&id.text) {
            Some(known) => Some(self.path_of(known, id.span)),
            None => {
                found.report(|| self.unknown(&id.text, id.span));
                None
            }
        }
    }

    pub(super) fn path_of(&self, known: &Known, span: Span) -> Path {
        Path::from(Name::new(known.name.as_str(), span))
    }

    pub(super) fn unknown(&self, id: &str, span: Span) -> Diagnostic {
        let finding =
            Diagnostic::error(codes::SCXML_TARGET, format!("no state has the identifier `{id}`"))
                .at(span, "");
        finding.near(
            span,
            nearest(id, self.states.keys().take(10_000).map(String::as_str)),
            format!("add it, as in <state id=\"{id}\"/>, or write the identifier of another state"),
        )
    }
}

pub(super) fn twice(id: &Name, first: Span) -> Diagnostic {
    Diagnostic::twice(
        codes::SCXML_TWICE,
        format!("the identifier `{id}` is given twice"),
        [id.span, first],
        "rename one of them",
    )
}

/// Whether the completion of a state can be observed: SCXML raises `done.state` for it.
pub(super) fn completes(state: &State) -> bool {
    match state.kind {
        StateKind::Final => false,
        StateKind::State => state.states().any(|inner| inner.kind == StateKind::Final),
        StateKind::Parallel => state.states().next().is_some() && state.states().all(completes),
    }
}
