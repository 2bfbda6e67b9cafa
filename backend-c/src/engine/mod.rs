//! The style `engine`: the chart as tables that a small engine interprets, after the paper on statechart engines for CNC controllers.
//!
//! The engine (`grafsynth_engine.c`) is the same text for all charts: after a change of the chart only `NAME_tables.c` differs. It reads rows of
//! states and of transitions like the paper's `BSTATE` and `BTRANS`: it finds the transitions on an event whose origin is active, then runs the exits up to the
//! common ancestor, the action, and the entries down to atomic states. The lists that the paper computes at run time from `descendant` and `sibling` are in the rows,
//! taken from the net; instead of a search over all transitions there is an index by event. The same rows represent Grafcet charts: a list of source
//! steps and a list of target steps.
//!
//! The tables are an image: bytes without pointers, with a checksum, the same on every machine. So they can also be loaded from a flash memory or an
//! EEPROM, and `gs_check` checks once whether every number in them is in its range.
// A variant that an emitter forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

mod assemble;
pub(crate) mod btrans;
mod bytes;
pub(crate) mod check;
mod code;
mod handing;
mod image;
mod loading;
mod ops;
pub(crate) mod program;
pub(crate) mod room;

use crate::c::print::Node;
use crate::names::Names;
use crate::refusal::Refusal;
use crate::style_output::{Member, StyleOutput};
use crate::times::Ticks;
use crate::{Object, Options, Style};
use grafsynth_ir::Gather;
use grafsynth_ir::net::{
    Driver, Emission, Enter, Evolution, Expr, Input, InputId, InputKind, Leaf, Net, Output, Policy,
    Schedule, StepId, StepKind, Transition, TransitionId, TransitionKind,
};
use grafsynth_ir::plan::Needs;
use grafsynth_ir::{IdMap, Span};
use handing::{as_type, clear_words, hand_in, hand_out};
use image::{CONTENT, HISTORY, Head, Image, ImageKind, Line, MOST_STATES, NONE, Section, narrow};
use itertools::Itertools as _;
use loading::Loading;
use ops::Machine;
use room::Room;
use std::collections::{BTreeMap, BTreeSet};

/// The engine's own files.
const FILES: [(&str, &str); 2] = [
    ("grafsynth_engine.h", include_str!("grafsynth_engine.h")),
    ("grafsynth_engine.c", include_str!("grafsynth_engine.c")),
];

/// True for the name of a file that belongs to an engine, so that its text is the same for all charts.
#[must_use]
pub fn is_engine_file(name: &str) -> bool {
    let own = FILES.iter().chain(&program::FILES).map(|(file, _)| *file);
    own.chain(btrans::FILES.iter().map(|(_, file, _)| *file)).any(|file| file == name)
}

/// The style whose C includes this header of an engine; `None` if it is no such header.
#[must_use]
pub fn style_of_header(name: &str) -> Option<Style> {
    let headers = [
        (program::FILES[0].0, Style::Program),
        (FILES[0].0, Style::Engine),
        (btrans::FILES[0].1, Style::Btrans),
    ];
    headers.into_iter().find(|(header, _)| *header == name).map(|(_, style)| style)
}

/// The information that all rows share.
struct Plan<'a> {
    net: &'a Net,
    /// The position of each input in the inputs of a reaction.
    inputs: IdMap<Input, Option<u16>>,
    /// Events that trigger some transition.
    listened: BTreeSet<InputId>,
    /// The number and the maximum value of the timer of each step whose time is read.
    timers: BTreeMap<StepId, (u16, i32)>,
    /// The last descendant of each step: descendants follow their ancestor without gaps.
    last: Vec<usize>,
}

fn refuse<T>(what: impl Into<String>, span: Span) -> Result<T, Refusal> {
    Err(Refusal { what: what.into(), span })
}

/// Emits the net in this style.
///
/// # Errors
/// If the net uses something that the engine does not support.
pub(crate) fn program(net: &Net, names: &Names, options: &Options) -> Result<StyleOutput, Refusal> {
    if options.trace.is_some() {
        return refuse("a trace ring", net.name.span);
    }
    if let Some(ending) = &net.ending {
        return refuse("an end of a reaction that waits for other parts", ending.waits.span);
    }
    let plan = Plan::of(net)?;
    let cap = plan.timers.values().map(|(_, cap)| i64::from(*cap)).max();
    let ticks = cap.map(Ticks::for_cap);
    let mut image = Image::new();
    let kind = plan.kind()?;
    let order = plan.order(kind)?;
    plan.states(&mut image)?;
    plan.transitions(&order, &mut image)?;
    plan.events(kind, &order, &mut image)?;
    plan.histories(&mut image)?;
    plan.rest(&mut image)?;
    let initial: Vec<Enter> = if net.settings.policy.is_statechart() {
        net.parts.values().flat_map(|part| part.initial.iter().copied()).collect()
    } else {
        net.steps.iter().filter(|(_, it)| it.is_initial).map(|(id, _)| Enter::Step(id)).collect()
    };
    let initial = image.list(&items(&initial));
    let chosen = plan.most_atomic();
    let limit = match net.settings.evolution {
        Evolution::Single => 0,
        Evolution::Stable { limit } => match u16::try_from(limit) {
            Ok(limit) => limit,
            Err(_) => return refuse("more than 65535 micro-steps in a reaction", net.name.span),
        },
    };
    let inputs = narrow(plan.inputs.values().flatten().count());
    let reset = image.block(&code::reset(&plan));
    let interface = interface(net, ticks);
    let head = Head { kind, interface, limit, chosen, initial, inputs, reset };
    let n_states = net.steps.len();
    let bits = usize::from(plan.edge_bit(net.edges.len()));
    let work = (net.transitions.len() + 3 * n_states + 3 * net.histories.len()).div_ceil(8)
        + 2 * usize::from(chosen);
    let room = Room {
        bits: size(bits.div_ceil(8)),
        values: size(net.vars.len() + plan.timers.len()),
        work: size(work),
        inputs: inputs.into(),
        outputs: narrow(net.outputs.len()).into(),
        interface: head.interface,
        ..Room::default()
    };
    let (lines, length) = image.finish(head);
    if length > usize::from(u16::MAX) {
        return refuse(
            format!("a chart of {length} bytes of tables (at most 65535)"),
            net.name.span,
        );
    }
    Ok(emit(net, names, &room, ticks, &lines))
}

/// The length of an array of an instance, which has at least one element.
fn size(elements: usize) -> u32 {
    narrow(elements.max(1)).into()
}

/// A number on which a program and an image must agree: names, types and order of inputs and outputs, and how time is passed in.
fn interface(net: &Net, ticks: Option<Ticks>) -> u32 {
    image::crc32(interface_text(net, ticks).as_bytes())
}

fn interface_text(net: &Net, ticks: Option<Ticks>) -> String {
    let mut text = format!("{}\n", ticks.map_or("", Ticks::name));
    for (_, input) in net.inputs.iter().filter(|(_, it)| it.kind.is_handed()) {
        text.push_str(&format!("in {} {:?} {:?}\n", input.name, input.ty.bounds(), input.kind));
    }
    for output in net.outputs.values().filter(|it| !it.is_extern()) {
        text.push_str(&format!("out {} {:?}\n", output.name, output.ty.bounds()));
    }
    text
}

/// The entered states and contents, as items.
fn items(enters: &[Enter]) -> Vec<u16> {
    enters
        .iter()
        .map(|enter| match *enter {
            Enter::Step(step) => narrow(step.index()),
            Enter::InitialContent(step) => CONTENT | narrow(step.index()),
            Enter::History(history) => HISTORY | narrow(history.index()),
        })
        .collect()
}

impl<'a> Plan<'a> {
    fn of(net: &'a Net) -> Result<Self, Refusal> {
        plain(net)?;
        let mut number = 0;
        let inputs = IdMap::build(&net.inputs, |_, input| {
            input.kind.is_handed().then(|| {
                number += 1;
                number - 1
            })
        });
        let listened: BTreeSet<InputId> =
            net.transitions.values().flat_map(|it| it.events.iter().copied()).gather();
        let mut timers = BTreeMap::new();
        let caps = Needs::of(net, false).elapsed;
        let read = caps.iter().filter_map(|(step, cap)| cap.map(|cap| (step, cap)));
        for (at, (step, cap)) in read.enumerate() {
            let Ok(cap) = i32::try_from(cap) else {
                return refuse("a time of more than 31 bits", net.steps[step].meta.span);
            };
            timers.insert(step, (narrow(at), cap));
        }
        let plan = Plan { net, inputs, listened, timers, last: last_descendants(net)? };
        plan.queues()?;
        Ok(plan)
    }

    /// Rejects charts that need an event queue: those with a transition on the completion of a state, and those whose queue is shorter than
    /// the events of a row. In all others, the events of a row are handled one by one, in declaration order.
    fn queues(&self) -> Result<(), Refusal> {
        let net = self.net;
        for step in net.steps.values() {
            if step.done_event.is_some_and(|event| self.listened.contains(&event)) {
                return refuse("a transition on the completion of a state", step.meta.span);
            }
        }
        let outside = self.listened.iter().filter(|id| net.inputs[**id].kind == InputKind::Event);
        match net.settings.queue {
            Some(bound) if (bound as usize) < outside.count() => {
                refuse("a queue that is shorter than the number of events in a row", net.name.span)
            }
            Some(_) | None => Ok(()),
        }
    }

    fn kind(&self) -> Result<ImageKind, Refusal> {
        let settings = &self.net.settings;
        let span = self.net.name.span;
        if settings.schedule != Schedule::Declared && self.net.parts.len() > 1 {
            return refuse("`schedule level` and `schedule priority`", span);
        }
        match settings.policy {
            Policy::All => Ok(ImageKind::All),
            Policy::Priority => {
                if self.net.parts.values().filter(|part| part.level == 1).count() > 1 {
                    return refuse("priorities in several charts of one file", span);
                }
                Ok(ImageKind::Priority)
            }
            Policy::PriorityAge => refuse("`conflict priority-age`", span),
            Policy::InnerFirst => Ok(ImageKind::InnerFirst),
            Policy::OuterFirst => Ok(ImageKind::OuterFirst),
        }
    }

    /// The transitions in the order of their rows: the order in which they compete and run their actions.
    fn order(&self, kind: ImageKind) -> Result<Vec<TransitionId>, Refusal> {
        let net = self.net;
        let is_chart = net.settings.policy.is_statechart();
        let mut order: Vec<TransitionId> = net.transitions.iter().map(|(id, _)| id).collect();
        if kind == ImageKind::Priority {
            order.sort_unstable_by_key(|id| {
                (net.transitions[*id].priority.unwrap_or(u32::MAX), *id)
            });
        }
        for transition in net.transitions.values() {
            let span = transition.meta.span;
            if !is_chart && transition.kind == TransitionKind::Reaction {
                return refuse("a reaction of a step", span);
            }
            if !is_chart && transition.restart {
                return refuse("`restart`", span);
            }
            if !is_chart && !transition.events.is_empty() {
                return refuse("events outside of statecharts", span);
            }
            if is_chart && transition.requires.len() != 1 {
                return refuse(
                    "a transition of a statechart that does not have exactly one source",
                    span,
                );
            }
        }
        Ok(order)
    }

    fn states(&self, image: &mut Image) -> Result<(), Refusal> {
        let net = self.net;
        for (id, step) in net.steps.iter() {
            let entry = self.list(&step.entry, image)?;
            let exit = self.list(&step.exit, image)?;
            let content = self.list(&step.initial_content, image)?;
            let parent = step.parent.map_or(NONE, |parent| narrow(parent.index()));
            let timer = self.timers.get(&id).map_or(NONE, |(number, _)| *number);
            let note = match step.parent {
                Some(parent) => format!("{} in {}", step.name, net.steps[parent].name),
                None => step.name.to_string(),
            };
            let last = narrow(self.last[id.index()]);
            image.row(
                Section::States,
                &[parent, last, entry, exit, content, timer],
                note,
                Some(Object::Step(id)),
            );
        }
        Ok(())
    }

    fn list(&self, block: &grafsynth_ir::net::Block, image: &mut Image) -> Result<u16, Refusal> {
        Ok(image.block(&code::list(self, block)?))
    }

    fn transitions(&self, order: &[TransitionId], image: &mut Image) -> Result<(), Refusal> {
        let net = self.net;
        let is_chart = net.settings.policy.is_statechart();
        for id in order {
            let transition = &net.transitions[*id];
            let from = match transition.requires.as_slice() {
                [only] if is_chart => narrow(only.index()),
                steps => {
                    let steps: Vec<u16> = steps.iter().map(|step| narrow(step.index())).collect();
                    image.list(&steps)
                }
            };
            let (first, last) = if is_chart { self.clears(transition)? } else { (1, 0) };
            let to = image.list(&items(&transition.enters));
            let guard = if transition.guard.is_true() {
                0
            } else {
                image.block(&code::value(self, &transition.guard)?)
            };
            let action = self.list(&transition.actions, image)?;
            image.row(
                Section::Transitions,
                &[from, first, last, to, guard, action],
                transition.name.to_string(),
                Some(Object::Transition(*id)),
            );
        }
        Ok(())
    }

    /// The states that a transition exits if they are active: the descendants of a domain.
    fn clears(&self, transition: &Transition) -> Result<(u16, u16), Refusal> {
        let mut numbers: Vec<usize> = transition.clears.iter().map(|step| step.index()).collect();
        numbers.sort_unstable();
        match (numbers.first(), numbers.last()) {
            (Some(first), Some(last)) if last - first + 1 == numbers.len() => {
                Ok((narrow(*first), narrow(*last)))
            }
            (None, None) => Ok((1, 0)),
            _ => refuse("states that do not follow their ancestor", transition.meta.span),
        }
    }

    fn events(
        &self,
        kind: ImageKind,
        order: &[TransitionId],
        image: &mut Image,
    ) -> Result<(), Refusal> {
        let net = self.net;
        let is_chart = matches!(kind, ImageKind::InnerFirst | ImageKind::OuterFirst);
        let place: BTreeMap<TransitionId, usize> =
            order.iter().enumerate().map(|(at, id)| (*id, at)).gather();
        let outside = net
            .inputs
            .iter()
            .filter(|(id, it)| it.kind == InputKind::Event && self.listened.contains(id));
        let events = std::iter::once(None).chain(outside.map(|(id, _)| Some(id)));
        for event in events.take(if is_chart { usize::MAX } else { 1 }) {
            let mut on: Vec<TransitionId> = order
                .iter()
                .copied()
                .filter(|id| match event {
                    None => is_chart && net.transitions[*id].events.is_empty(),
                    Some(event) => net.transitions[*id].events.contains(&event),
                })
                .collect();
            on.sort_unstable_by_key(|id| (net.transitions[*id].requires.first().copied(), *id));
            let first = narrow(image.count(Section::Index));
            let (input, note) = match event {
                None => (NONE, "no event".to_owned()),
                Some(event) => {
                    (self.inputs[event].unwrap_or(NONE), net.inputs[event].name.to_string())
                }
            };
            image.row(Section::Events, &[input, first, narrow(on.len())], note, None);
            for id in on {
                let note = format!("on {}", event.map_or("", |it| &net.inputs[it].name.text));
                let note = if event.is_some() { note } else { "on nothing".to_owned() };
                image.row(Section::Index, &[narrow(place[&id])], note, None);
            }
        }
        Ok(())
    }

    fn histories(&self, image: &mut Image) -> Result<(), Refusal> {
        let net = self.net;
        let mut contents = BTreeSet::new();
        for history in net.histories.values() {
            if !history.default_content.is_empty() && !contents.insert(history.owner) {
                return refuse("two histories with content in one state", history.meta.span);
            }
            let first = image.count(Section::Cases);
            for case in &history.cases {
                let list = image.list(&items(&case.enters));
                let note = format!("{} of {}", net.steps[case.step].name, history.name);
                image.row(Section::Cases, &[narrow(case.step.index()), list], note, None);
            }
            let default = image.list(&items(&history.default));
            let content = self.list(&history.default_content, image)?;
            let cells = [
                narrow(history.owner.index()),
                narrow(first),
                narrow(history.cases.len()),
                default,
                content,
            ];
            image.row(Section::Histories, &cells, history.name.to_string(), None);
        }
        Ok(())
    }

    /// Adds the sections of variables, timers, edges and outputs.
    fn rest(&self, image: &mut Image) -> Result<(), Refusal> {
        let net = self.net;
        for (id, var) in net.vars.iter() {
            let Some(bytes) = image::cell(id.index(), 1, var.ty) else {
                return refuse("a variable of more than 32 bits", var.meta.span);
            };
            image.raw(Section::Vars, bytes, var.name.to_string(), Some(Object::Var(id)));
        }
        for (step, (_, cap)) in &self.timers {
            let mut bytes = narrow(step.index()).to_le_bytes().to_vec();
            bytes.extend(cap.to_le_bytes());
            image.raw(Section::Timers, bytes, format!("{}.t", net.steps[*step].name), None);
        }
        for edge in net.edges.values() {
            let block = image.block(&code::value(self, &edge.expr)?);
            image.row(Section::Edges, &[block], "", None);
        }
        for (id, output) in net.outputs.iter() {
            let value = net.forced(id, shown(output)?);
            let block = image.block(&code::value(self, &value)?);
            image.row(
                Section::Outputs,
                &[block],
                output.name.to_string(),
                Some(Object::Output(id)),
            );
        }
        Ok(())
    }

    /// The bit of an edge's operand before the reaction, after the situation and the recorded cases; the next one is its value now.
    fn edge_bit(&self, edge: usize) -> u16 {
        let cases: usize = self.net.histories.values().map(|history| history.cases.len()).sum();
        narrow(self.net.steps.len() + cases + 2 * edge)
    }

    /// The maximum number of atomic states that are active together, which is also the maximum number of chosen transitions.
    fn most_atomic(&self) -> u16 {
        let net = self.net;
        if !net.settings.policy.is_statechart() {
            return 0;
        }
        let mut most = vec![0_usize; net.steps.len()];
        let mut roots: BTreeMap<_, usize> = BTreeMap::new();
        let mut all: Vec<StepId> = net.steps.iter().map(|(id, _)| id).collect();
        all.reverse();
        for id in all {
            let step = &net.steps[id];
            let own = most[id.index()].max(1);
            most[id.index()] = own;
            match step.parent {
                Some(parent) if net.steps[parent].kind == StepKind::Parallel => {
                    most[parent.index()] += own;
                }
                Some(parent) => most[parent.index()] = most[parent.index()].max(own),
                None => {
                    let root = roots.entry(step.part).or_insert(0);
                    *root = (*root).max(own);
                }
            }
        }
        narrow(roots.values().sum())
    }
}

/// The value of an output without an emergency, as an expression for the tables.
fn shown(output: &Output) -> Result<Expr, Refusal> {
    let span = output.meta.span;
    match &output.driver {
        Driver::Continuous(emissions) => Ok(lit(emissions)),
        Driver::Stored(var) => Ok(Expr::leaf(Leaf::Var(*var), span)),
        Driver::Mealy(_) => refuse("a mealy output", span),
        Driver::Fires(_) => refuse("an output that shows that a transition fires", span),
        Driver::Controlled(_) => refuse("a controlled action", span),
        Driver::Extern { .. } => refuse("an extern action", span),
    }
}

/// A continuous output as an expression.
fn lit(emissions: &[Emission]) -> Expr {
    Expr::or(emissions.iter().map(|emission| {
        let active = Expr::leaf(Leaf::Active(emission.step), emission.span);
        match &emission.condition {
            Some(condition) => Expr::and([active, condition.clone()]),
            None => active,
        }
    }))
}

/// Rejects everything that the engine does not support at all.
fn plain(net: &Net) -> Result<(), Refusal> {
    let span = net.name.span;
    if net.steps.len() > MOST_STATES || net.histories.len() > MOST_STATES {
        return refuse("more than 16383 states", span);
    }
    if let Some(action) = net.actions.values().next() {
        return refuse("a controlled action", action.meta.span);
    }
    if let Some(timer) = net.timers.values().next() {
        return refuse("a free timer", timer.meta.span);
    }
    if let Some(send) = net.sends.values().next() {
        return refuse("`send`", send.meta.span);
    }
    if let Some(forcing) = net.forcings.first() {
        return refuse("forcing", forcing.span);
    }
    if net.settings.fire_one {
        return refuse("`fire one`", span);
    }
    if net.settings.assign_simultaneous {
        return refuse("`assign simultaneous`", span);
    }
    if let Some(input) = net.inputs.values().find(|it| it.kind == InputKind::Extern) {
        return refuse("an extern condition", input.meta.span);
    }
    if let Some(var) = net.vars.values().find(|it| it.len.is_some()) {
        return refuse("an array", var.meta.span);
    }
    for step in net.steps.values() {
        if step.kind == StepKind::Enclosing {
            return refuse("an enclosing step", step.meta.span);
        }
        if step.kind == StepKind::Final && step.parent.is_none() {
            return refuse("a final state that ends its chart", step.meta.span);
        }
        if !step.tasks.is_empty() {
            return refuse("tasks", step.meta.span);
        }
        if !step.code.is_empty() {
            return refuse("text of another language", step.meta.span);
        }
    }
    for edge in net.edges.values() {
        let outside = edge.expr.leaves().all(|leaf| matches!(leaf, Leaf::Input(_)));
        if !outside {
            return refuse("an edge of anything but inputs", edge.expr.span);
        }
    }
    Ok(())
}

/// The last descendant of each step; the step itself if it has none.
fn last_descendants(net: &Net) -> Result<Vec<usize>, Refusal> {
    let mut last: Vec<usize> = (0..net.steps.len()).collect();
    let mut size = vec![1_usize; net.steps.len()];
    let mut all: Vec<StepId> = net.steps.iter().map(|(id, _)| id).collect();
    all.reverse();
    for id in all {
        let step = &net.steps[id];
        if let Some(parent) = step.parent {
            let (own, at) = (size[id.index()], last[id.index()]);
            if parent.index() >= id.index() {
                return refuse("states that do not follow their ancestor", step.meta.span);
            }
            size[parent.index()] += own;
            last[parent.index()] = last[parent.index()].max(at);
        }
        if last[id.index()] - id.index() + 1 != size[id.index()] {
            return refuse("states that do not follow their ancestor", step.meta.span);
        }
    }
    Ok(last)
}

// --- text --------------------------------------------------------------------------------------------------------------------------------------

fn emit(
    net: &Net,
    names: &Names,
    room: &Room,
    ticks: Option<Ticks>,
    lines: &[Line],
) -> StyleOutput {
    let upper = &names.upper;
    let has_fault = net.settings.evolution != Evolution::Single;
    let loading = Loading { names, room, locals: ["room", "found"] };
    let mut instance = loading.instance([
        "the tables that it runs",
        "situation, histories, edges",
        "variables, timers",
    ]);
    if has_fault {
        instance.push(member("bool fault", "the last reaction did not become stable"));
    }
    let run = |reset: bool| {
        let mut body = vec![
            Node::line(format!("int32_t inputs[{}];", room.inputs.max(1))),
            Node::line(format!("int32_t outputs[{}];", room.outputs.max(1))),
            Node::line(format!("uint8_t work[{upper}_WORK];")),
            Node::line("gs_run_t run;"),
        ];
        let handed = net.inputs.iter().filter(|(_, it)| it.kind.is_handed());
        let handed: Vec<_> = handed.enumerate().map(|(at, (id, _))| (id, at)).collect();
        body.extend(hand_in(net, names, &handed, "inputs", reset));
        body.extend(set_run(&[
            ("image", "self->image"),
            ("bits", "self->bits"),
            ("values", "self->values"),
            ("in", "inputs"),
            ("out", "outputs"),
            ("work", "work"),
            ("chosen", "0U"),
            ("cells", "0U"),
            ("at", "0U"),
            ("end", "0U"),
            ("depth", "0U"),
        ]));
        let dt = if ticks.is_some() { "(int32_t)dt" } else { "0" };
        let call = if reset { "gs_init(&run)".to_owned() } else { format!("gs_step(&run, {dt})") };
        let call =
            if has_fault { format!("self->fault = {call};") } else { format!("(void){call};") };
        body.push(Node::line(call));
        let outputs = net.outputs.iter().enumerate();
        let outputs = outputs.map(|(at, (id, _))| (id, format!("outputs[{at}]")));
        body.extend(hand_out(net, names, outputs));
        body
    };
    let mut reset = clear_words(names);
    reset.extend(run(true));
    let mut step = clear_words(names);
    step.extend(run(false));
    let values = net
        .vars
        .iter()
        .map(|(id, var)| (id, as_type(var.ty, &format!("self->values[{}]", id.index()))))
        .gather();
    StyleOutput {
        style: "engine",
        instance,
        active: IdMap::build(&net.steps, |id, _| format!("gs_bit(self->bits, {}U)", id.index())),
        fault: has_fault.then(|| "self->fault".to_owned()),
        has_fault: has_fault || net.settings.queue.is_some(),
        ticks,
        functions: loading.functions("these tables", reset),
        init: loading.init(),
        step,
        engine: Some(loading.engine(FILES, Machine::Narrow, None, values, lines)),
        ..StyleOutput::default()
    }
}

/// Sets the members of the local `run`, with which the engine is called.
fn set_run(members: &[(&str, &str)]) -> impl Iterator<Item = Node> {
    members.iter().map(|(name, value)| Node::line(format!("run.{name} = {value};")))
}

/// The part of the header before the instance.
fn macros(names: &Names, sizes: &[(&str, String)], interface: u32) -> Vec<Node> {
    let (prefix, upper) = (&names.prefix, &names.upper);
    let mut nodes = vec![Node::comment(
        "Sizes of an instance: to load larger charts, define larger values before this file is included.",
    )];
    for (name, value) in sizes {
        nodes.extend(Node::default_macro(&format!("{upper}_{name}"), value));
    }
    nodes.extend([
        Node::blank(),
        Node::comment("Identifies inputs and outputs: an image must contain the same number."),
        Node::directive(format!("#define {upper}_INTERFACE 0x{interface:08X}UL")),
        Node::blank(),
        Node::comment("The chart."),
        Node::line(format!("extern GS_ROM uint8_t {prefix}_tables[];")),
    ]);
    nodes
}

/// `NAME_load` in the header.
fn declarations(load: &str) -> Vec<Node> {
    vec![
        Node::comment(
            "Resets with an image. Returns GS_OK, or why the image is rejected; the instance is then unchanged. The image must stay in place.",
        ),
        Node::line(format!("{load};")),
        Node::blank(),
    ]
}

fn member(declaration: &str, note: &str) -> Member {
    Member { declaration: declaration.to_owned(), note: note.to_owned(), objects: Vec::new() }
}

fn clear_array(length: &str, statement: &str) -> Node {
    Node::block(
        format!("for (uint16_t i = 0U; i < {length}; ++i)"),
        vec![Node::line(statement.to_owned())],
    )
}

/// The image as a constant array, row by row.
fn table(names: &Names, lines: &[Line]) -> Vec<Node> {
    let prefix = &names.prefix;
    let mut body = Vec::new();
    for line in lines {
        if let Some(title) = line.title {
            body.push(Node::comment(title));
        }
        for (part, bytes) in line.bytes.chunks(20).enumerate() {
            let text = bytes.iter().map(|byte| format!("0x{byte:02X},")).join(" ");
            let mut node = Node::line(text);
            if part == 0 {
                node = node.note(line.note.clone());
                if let Some(object) = line.object {
                    node = node.about(object);
                }
            }
            body.push(node);
        }
    }
    vec![
        Node::directive(format!("#include \"{}.h\"", names.stem)),
        Node::blank(),
        Node::braced(format!("GS_ROM uint8_t {prefix}_tables[] ="), body),
    ]
}
