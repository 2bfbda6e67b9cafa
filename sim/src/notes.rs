//! Notes of a simulation, in addition to the trace: saturated assignments, races, lost events.

use std::collections::BTreeMap;

use grafsynth_ir::diag::Notation;
use grafsynth_ir::net::{
    HistoryId, InputId, Net, OutputId, PartId, SendId, StepId, TransitionId, VarId,
};
use grafsynth_ir::{Diagnostic, Span};

use crate::codes;

/// A list of statements that may write a variable: one writer in the sense of semantics §3.6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Writer {
    /// The deactivation list of a step.
    Exit(StepId),
    /// The actions of a transition or reaction.
    Transition(TransitionId),
    /// The activation list of a step.
    Entry(StepId),
    /// The content of the initial transition of a composite state.
    InitialContent(StepId),
    /// The content of the default transition of a history.
    HistoryContent(HistoryId),
}

/// A kind of note.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Noticed {
    /// The value of an assignment was out of range, and the nearest bound was stored (semantics §6).
    Saturated(VarId, Span),
    /// The value of an argument was out of range for its parameter (semantics §6).
    ArgumentSaturated(OutputId, Span),
    /// Two lists wrote the same variable (or the same element) in one micro-step (semantics §3.6).
    Race(VarId, Writer, Writer),
    /// A send slot was started while it was running (semantics §5).
    Resent(SendId),
    /// The event was dropped because its queue was full (semantics §5).
    QueueFull(InputId),
    /// After `limit` micro-steps something was still fireable or pending (semantics §3.4).
    LimitReached,
    /// Two orders for the chart that contains this part contradicted each other (semantics §8).
    ForcingRace(PartId),
}

/// The first row and the number of occurrences of a note.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Occurrence {
    /// The first row of the trace in which the note occurred.
    pub first_row: usize,
    /// The number of occurrences.
    pub count: u64,
}

/// All notes since the last reset, each kind once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Notes {
    pub(crate) row: usize,
    list: BTreeMap<Noticed, Occurrence>,
}

impl Notes {
    /// All notes with their first row and count, in a fixed order.
    pub fn iter(&self) -> impl Iterator<Item = (&Noticed, &Occurrence)> {
        self.list.iter()
    }

    /// True if there are no notes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub(crate) fn add(&mut self, what: Noticed) {
        let row = self.row;
        self.list.entry(what).or_insert(Occurrence { first_row: row, count: 0 }).count += 1;
    }

    pub(crate) fn contains(&self, what: Noticed) -> bool {
        self.list.contains_key(&what)
    }

    pub(crate) fn clear(&mut self) {
        self.list.clear();
        self.row = 0;
    }

    /// The notes as warnings for the designer.
    #[must_use]
    pub fn diagnostics(&self, net: &Net) -> Vec<Diagnostic> {
        self.list.iter().map(|(what, seen)| diagnostic(net, *what, *seen)).collect()
    }
}

fn diagnostic(net: &Net, what: Noticed, seen: Occurrence) -> Diagnostic {
    let when = match seen.count {
        1 => format!("in row {}", seen.first_row),
        n => format!("first in row {}, {n} times in total", seen.first_row),
    };
    match what {
        Noticed::Saturated(var, span) => {
            let (lo, hi) = net.vars[var].ty.bounds();
            let name = &net.vars[var].name;
            Diagnostic::warning(
                codes::SATURATED,
                format!("a value for `{name}` was outside {lo}..{hi}, {when}"),
            )
            .at(span, "the nearest bound was stored")
            .help("widen the range of the variable or test the value before the assignment")
        }
        Noticed::ArgumentSaturated(output, span) => {
            let name = &net.outputs[output].name;
            Diagnostic::warning(
                codes::SATURATED,
                format!("an argument of `{name}` was outside the range of its parameter, {when}"),
            )
            .at(span, "the nearest bound was passed")
            .help("widen the range of the parameter or test the value before the call")
        }
        Noticed::Race(var, first, second) => {
            let name = &net.vars[var].name;
            let (first_text, first_span) = describe(net, first);
            let (second_text, second_span) = describe(net, second);
            Diagnostic::warning(
                codes::RACE,
                format!("`{name}` is written by {first_text} and by {second_text} in one micro-step, {when}"),
            )
            .at(second_span, "this value is kept")
            .at(first_span, "this value is lost")
            .help("let only one of them write it, or make sure that they never run together")
        }
        Noticed::Resent(slot) => {
            let name = &net.sends[slot].name;
            Diagnostic::warning(
                codes::RESENT,
                format!("the send `{name}` was started again while it was running, {when}"),
            )
            .at(net.sends[slot].meta.span, "its delay starts again")
            .help("give sends that may run at the same time different names with `as`, or cancel the first")
            .help_in(
                Notation::Scxml,
                "SCXML would deliver both: write two <send> with an `id` each, or <cancel> the first",
            )
        }
        Noticed::QueueFull(event) => {
            let name = &net.inputs[event].name;
            let bound = net.settings.queue.unwrap_or(u32::MAX);
            Diagnostic::warning(
                codes::QUEUE_FULL,
                format!("event `{name}` was dropped: its queue of {bound} was full, {when}"),
            )
            .at(net.inputs[event].meta.span, "declared here")
            .help("declare a longer queue with `queue N`")
            .help_in(
                Notation::Scxml,
                "allow a longer queue with the attribute `g:queue` of <scxml>",
            )
        }
        Noticed::LimitReached => {
            let limit = match net.settings.evolution {
                grafsynth_ir::net::Evolution::Single => 1,
                grafsynth_ir::net::Evolution::Stable { limit } => limit,
            };
            Diagnostic::warning(
                codes::LIMIT_REACHED,
                format!("the reaction was not stable after {limit} micro-steps, {when}"),
            )
            .at(net.name.span, "fault is 1 in such rows")
            .help("look for a cycle of transitions that stay fireable (`check` may show one), or allow more micro-steps with `evolution stable limit N`")
            .help_in(
                Notation::Scxml,
                "look for a cycle of transitions that stay fireable (`check` may show one), or allow more micro-steps with the attribute `g:limit` of <scxml>",
            )
            .help_in(
                Notation::Iec,
                "look for a cycle of transitions that stay fireable (`check` may show one), or allow more micro-steps with {grafsynth evolution stable limit N}",
            )
        }
        Noticed::ForcingRace(part) => {
            let name = &net.parts[part].name;
            Diagnostic::warning(
                codes::FORCING_RACE,
                format!("two forcing orders for `{name}` contradict each other, {when}"),
            )
            .at(net.parts[part].meta.span, "the order declared first wins")
            .help("let only one of the forcing steps be active at a time")
        }
    }
}

fn describe(net: &Net, writer: Writer) -> (String, Span) {
    match writer {
        Writer::Exit(step) => {
            (format!("the exit list of `{}`", net.steps[step].name), net.steps[step].meta.span)
        }
        Writer::Entry(step) => {
            (format!("the entry list of `{}`", net.steps[step].name), net.steps[step].meta.span)
        }
        Writer::Transition(transition) => {
            let transition = &net.transitions[transition];
            (format!("the actions of `{}`", transition.name), transition.meta.span)
        }
        Writer::InitialContent(step) => (
            format!("the initial transition of `{}`", net.steps[step].name),
            net.steps[step].meta.span,
        ),
        Writer::HistoryContent(history) => (
            format!("the default of history `{}`", net.histories[history].name),
            net.histories[history].meta.span,
        ),
    }
}
