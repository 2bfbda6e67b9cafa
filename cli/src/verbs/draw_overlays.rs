//! What `draw` adds to a chart: the parts of a split, the coverage of a stimulus, the situations of a trace.

use crate::load::{Session, Stop};
use crate::partition::{Written, partition_file, parts, places};
use crate::verbs::sim;
use grafsynth_draw::{Counts, Frame, Part};
use grafsynth_driver::split::{Item, RequestedPart};
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Enter, Net};
use grafsynth_ir::{Span, Valid, counted};
use grafsynth_sim::{ColumnKind, Simulator, Trace, TraceLayout, TraceRow, Value, run_observed};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The largest number of situations of a trace that are drawn.
const MOST_FRAMES: usize = 60;

/// The parts of a partition file.
pub(super) fn split_parts(
    session: &Session,
    net: &Valid<Net>,
    path: &str,
) -> Result<Vec<Part>, Stop> {
    let partition = partition_file(path)?;
    let written = Written { path: Some(path), partition: &partition };
    let requested = parts(&[], written)?;
    let places = places(session, net, &[], written, &requested)?;
    let placed = places.into_iter().filter_map(|place| match place.item {
        Item::Step(step) => Some((net.steps[step].meta.span, place.part)),
        Item::Transition(transition) => Some((net.transitions[transition].meta.span, place.part)),
        _ => None,
    });
    Ok(parts_with(&requested, placed))
}

/// The parts with the source locations of their steps and transitions.
pub(super) fn parts_with(
    requested: &[RequestedPart],
    placed: impl IntoIterator<Item = (Span, usize)>,
) -> Vec<Part> {
    let named = requested.iter().map(|part| {
        let name = format!("{} = {}", part.name, part.device.name());
        Part { name, elements: BTreeSet::new() }
    });
    let mut parts: Vec<Part> = named.collect();
    for (span, part) in placed {
        if let Some(part) = parts.get_mut(part) {
            part.elements.insert(span);
        }
    }
    parts
}

/// The number of reactions of a stimulus in which each step was active and each transition fired; `None` if the stimulus has errors, which were shown.
pub(super) fn coverage(
    session: &mut Session,
    net: &Valid<Net>,
    path: &str,
) -> Result<Option<Counts>, Stop> {
    let Some(stimulus) = sim::stimulus(session, net, Some(path), None, 1, 1)? else {
        return Ok(None);
    };
    let steps = net.steps.values().map(|step| step.meta.span);
    let transitions = net.transitions.values().map(|transition| transition.meta.span);
    let mut by_element: BTreeMap<Span, u64> =
        steps.clone().chain(transitions.clone()).map(|span| (span, 0)).gather();
    let mut count = |simulator: &Simulator<'_>| {
        let fired = || simulator.fired().iter().map(|fired| &net.transitions[*fired]);
        // A step of a transient situation is active within a reaction only.
        let entered = fired().flat_map(|transition| &transition.enters).filter_map(|it| match it {
            Enter::Step(step) => Some(*step),
            _ => None,
        });
        let ended = net.steps.ids().filter(|step| simulator.is_active(*step));
        let active = ended.chain(entered).map(|step| net.steps[step].meta.span);
        let all: BTreeSet<Span> = active.chain(fired().map(|it| it.meta.span)).gather();
        for span in all {
            if let Some(n) = by_element.get_mut(&span) {
                *n += 1;
            }
        }
    };
    let mut simulator = Simulator::new(net);
    simulator.reset();
    count(&simulator);
    run_observed(&mut simulator, &stimulus, &mut count);
    let once = |spans: &mut dyn Iterator<Item = Span>| {
        let all: BTreeSet<Span> = spans.gather();
        (all.iter().filter(|span| by_element.get(span).is_some_and(|n| *n > 0)).count(), all.len())
    };
    let (active, n_steps) = once(&mut steps.clone());
    let (fired, n_transitions) = once(&mut transitions.clone());
    let found = format!(
        "{active} of {} were active, {fired} of {} fired",
        counted(n_steps, "step", "steps"),
        counted(n_transitions, "transition", "transitions")
    );
    session.note(&format!("{path}: {found}\n"));
    let reactions = counted(stimulus.len() + 1, "reaction", "reactions");
    // The folder would make the drawing depend on where the stimulus is.
    let name = Path::new(path).file_name().map_or(path.into(), |name| name.to_string_lossy());
    let note = format!("3×: active or fired in 3 of {reactions} ({name}); {found}");
    Ok(Some(Counts { by_element, note }))
}

/// The situations of a trace, one frame for each change.
pub(super) fn trace_frames(
    session: &mut Session,
    net: &Valid<Net>,
    path: &str,
) -> Result<Vec<Frame>, Stop> {
    let file = session.text(path)?;
    let text = session.sources.get(file).map(|source| source.text.clone()).unwrap_or_default();
    let trace = Trace::parse_csv(&TraceLayout::of(net), file, &text).map_err(|found| {
        session.show(&found);
        Stop::Errors
    })?;
    let mut frames = of_trace(net, &trace);
    if frames.len() > MOST_FRAMES {
        let n = frames.len();
        session
            .note(&format!("{path} has {n} situations; only the first {MOST_FRAMES} are drawn\n"));
        frames.truncate(MOST_FRAMES);
    }
    Ok(frames)
}

/// The rows of a trace, with rows of the same situation as one frame.
fn of_trace(net: &Net, trace: &Trace) -> Vec<Frame> {
    let spans: BTreeMap<&str, Span> =
        net.steps.values().map(|step| (step.name.text.as_str(), step.meta.span)).gather();
    let names: Vec<&str> = trace.layout.step_names().collect();
    // The first and last row of each frame.
    let mut groups: Vec<(usize, usize, BTreeSet<Span>)> = Vec::new();
    for (index, row) in trace.rows.iter().enumerate() {
        let active: BTreeSet<Span> = active_steps(trace, row)
            .into_iter()
            .filter_map(|step| spans.get(names.get(step)?).copied())
            .gather();
        match groups.last_mut() {
            Some((_, last, before)) if *before == active => *last = index,
            _ => groups.push((index, index, active)),
        }
    }
    let frames = (1..).zip(groups).map(|(number, (first, last, active))| {
        let rows = match (first, last) {
            (0, 0) => "reset".to_owned(),
            (0, last) => format!("reset to reaction {last}"),
            (first, last) if first == last => format!("reaction {first}"),
            (first, last) => format!("reactions {first} to {last}"),
        };
        let changes = changes(trace, first);
        let title = format!("{number}: {rows}{changes}");
        Frame { title, active }
    });
    frames.collect()
}

fn active_steps(trace: &Trace, row: &TraceRow) -> Vec<usize> {
    let is_steps = |column: &grafsynth_sim::Column| column.kind == ColumnKind::Steps;
    let column = trace.layout.columns.iter().position(is_steps);
    match column.and_then(|column| row.values.get(column)) {
        Some(Value::Steps(active)) => {
            active.iter().filter_map(|step| usize::try_from(*step).ok()).collect()
        }
        _ => Vec::new(),
    }
}

/// The inputs that changed in a row.
fn changes(trace: &Trace, row: usize) -> String {
    let Some(before) = row.checked_sub(1).and_then(|before| trace.rows.get(before)) else {
        return String::new();
    };
    let Some(row) = trace.rows.get(row) else { return String::new() };
    let inputs = trace.layout.columns.iter().enumerate();
    let inputs = inputs.filter(|(_, column)| matches!(column.kind, ColumnKind::Input(_)));
    let changed = inputs.filter_map(|(index, column)| {
        let (now, then) = (row.values.get(index)?, before.values.get(index)?);
        (now != then).then(|| format!("{} = {}", column.name, trace.layout.text(now)))
    });
    let changed: Vec<String> = changed.collect();
    if changed.is_empty() { String::new() } else { format!("; {}", changed.join(", ")) }
}
