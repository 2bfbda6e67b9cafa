//! Requirement tags: where each occurs in the chart and in the outputs, and the evidence for it.

use super::chip::{Chip, Kind};
use super::document::{Block, Rich, Table};
use super::{Outcome, OutputReport, Subject};
use grafsynth_ir::logic::{PinOutputId, PinRole};
use grafsynth_ir::net::{Enter, Meta, Net, PropertyRole, StepId};
use grafsynth_ir::program::Origin;
use grafsynth_ir::walk::called_in_lists;
use grafsynth_verify::Outcome as Verdict;
use std::collections::{BTreeMap, BTreeSet};

/// The objects with a tag.
#[derive(Debug, Default)]
struct Tagged {
    /// Kinds and names, in the order of the net.
    elements: Vec<String>,
    /// Steps whose registers have the tag.
    steps: BTreeSet<StepId>,
    /// Properties, by index.
    properties: Vec<usize>,
    /// True if the emergency has the tag; it affects all outputs.
    is_emergency: bool,
}

/// What has a tag in an output: the output, the place there, and the verdict.
type Row = (String, String, &'static str);

pub(super) fn write(subject: &Subject<'_>) -> Vec<Block> {
    if subject.is_logic {
        return Vec::new();
    }
    let tags = tags(subject);
    if tags.is_empty() {
        let none = "No element of the chart carries a requirement tag (`req \"R1\"` after a step, transition, input, output, emergency or property).";
        return vec![Block::Paragraph(Rich::say(none, []))];
    }
    let mut table =
        Table::new(["Requirement", "In the chart", "In the output", "Location", "Proved"]);
    for (tag, tagged) in &tags {
        let rows = properties(subject, tagged).into_iter().chain(outputs(subject, tag, tagged));
        let mut head = [tag.clone(), tagged.elements.join(", ")];
        for (output, place, proved) in rows {
            let [tag, elements] = std::mem::take(&mut head);
            table.row([tag, elements, output, place, String::new()]);
            table.set_last(4, Rich::verdict(proved));
        }
        if !head[0].is_empty() {
            let [tag, elements] = head;
            let none = || "-".to_owned();
            table.row([tag, elements, none(), none(), none()]);
        }
    }
    vec![Block::Table(table)]
}

/// All tags, sorted by name, with their objects.
fn tags(subject: &Subject<'_>) -> BTreeMap<String, Tagged> {
    let net = subject.net;
    let mut tags: BTreeMap<String, Tagged> = BTreeMap::new();
    let mut add =
        |meta: &Meta, kind: &str, name: &str, steps: &[StepId], property: Option<usize>| {
            for tag in &meta.req {
                let tagged = tags.entry(tag.clone()).or_default();
                tagged.elements.push(format!("{kind} {name}").trim_start().to_owned());
                tagged.steps.extend(steps);
                tagged.properties.extend(property);
            }
        };
    for part in net.parts.values() {
        add(&part.meta, "chart", &part.name.text, &[], None);
    }
    for input in net.inputs.values() {
        add(&input.meta, "input", &input.name.text, &[], None);
    }
    for output in net.outputs.values() {
        add(&output.meta, "output", &output.name.text, &[], None);
    }
    for var in net.vars.values() {
        add(&var.meta, "variable", &var.name.text, &[], None);
    }
    for timer in net.timers.values() {
        add(&timer.meta, "timer", &timer.name.text, &[], None);
    }
    for (id, step) in net.steps.iter() {
        add(&step.meta, "step", &step.name.text, &[id], None);
        for task in &step.tasks {
            add(&task.meta, "task", &task.name.text, &[id], None);
        }
    }
    for transition in net.transitions.values() {
        // A transition affects the registers of the steps that it leaves and enters.
        let entered = transition.enters.iter().filter_map(|enter| match enter {
            Enter::Step(step) => Some(*step),
            Enter::InitialContent(_) | Enter::History(_) => None,
        });
        let steps: Vec<StepId> = transition.requires.iter().copied().chain(entered).collect();
        add(&transition.meta, "transition", &transition.name.text, &steps, None);
    }
    for action in net.actions.values() {
        add(&action.meta, "action", &action.name.text, &[], None);
    }
    if let Some(emergency) = &net.emergency {
        add(&emergency.meta, "", "emergency", &[], None);
    }
    for (at, property) in net.properties.iter().enumerate() {
        // The property as it was written, without the tag, which is in the previous column.
        let name = super::proofs::property(subject, at);
        let name = name.split_once(" req ").map_or(name.as_str(), |(before, _)| before);
        add(&property.meta, "", name, &[], Some(at));
    }
    for tag in net.emergency.iter().flat_map(|emergency| &emergency.meta.req) {
        tags.entry(tag.clone()).or_default().is_emergency = true;
    }
    tags
}

/// A row for each property: where it is checked (the chart), its kind, and its result.
fn properties(subject: &Subject<'_>, tagged: &Tagged) -> Vec<Row> {
    let row = |at: &usize| {
        let verdict = subject.properties.iter().find(|verdict| verdict.property == *at);
        let role = subject.net.properties[*at].role;
        let proved = match (verdict.map(|verdict| &verdict.outcome), role) {
            (Some(Verdict::Proved { .. }), _) => "proved",
            (Some(Verdict::Refuted { .. }), _) => "refuted",
            (Some(Verdict::Open(_)), _) | (None, PropertyRole::Assert) => "open",
            (None, PropertyRole::Assume) => "assumed",
        };
        let place = match role {
            PropertyRole::Assert => "property",
            PropertyRole::Assume => "property of the environment",
        };
        ("chart".to_owned(), place.to_owned(), proved)
    };
    tagged.properties.iter().map(row).collect()
}

/// A row for each output that contains a tag: the equations of chips, and lines of texts. The proof of a chip includes that the emergency dominates.
fn outputs(subject: &Subject<'_>, tag: &str, tagged: &Tagged) -> Vec<Row> {
    let mut rows = Vec::new();
    for file in &subject.built.files {
        let chip = subject.built.chips.iter().find(|chip| chip.file == file.name);
        let mut said = Vec::new();
        if let Some(chip) = chip {
            let signals = equations(subject.net, chip, tag, tagged);
            if !signals.is_empty() {
                said.push(signals.join(", "));
            }
        }
        let lines: Vec<u32> = Subject::tagged(file, tag).iter().map(|entry| entry.line).collect();
        let is_proved = subject.built.lines.iter().any(|line| line.name == file.name);
        match lines.as_slice() {
            [] if tagged.is_emergency && chip.is_none() && is_proved => {
                said.push("all outputs".to_owned());
            }
            [] => {}
            [line] => said.push(format!("line {line}")),
            lines => said.push(format!("lines {}", ranges(lines))),
        }
        if said.is_empty() {
            continue;
        }
        // A header has no result line: it is proved with the file that includes it.
        let stem =
            |name: &str| name.rsplit_once('.').map_or(name.to_owned(), |(stem, _)| stem.to_owned());
        let line = (subject.built.lines.iter()).find(|line| line.name == file.name).or_else(|| {
            subject.built.lines.iter().find(|line| stem(&line.name) == stem(&file.name))
        });
        let proved = match line.map(OutputReport::outcome) {
            Some(Outcome::Proved) => "proved",
            Some(Outcome::Refuted) => "refuted",
            Some(Outcome::NotChecked) => "not checked",
            Some(Outcome::Open) | None => "open",
        };
        rows.push((file.name.clone(), said.join("; "), proved));
    }
    rows
}

/// The registers and outputs of a chip that have a tag, or store a step with it.
fn equations(net: &Net, chip: &Chip, tag: &str, tagged: &Tagged) -> Vec<String> {
    let circuit = &chip.circuit;
    // Extern functions that are called in lists have no lasting value, so an emergency does not force them.
    let called = called_in_lists(net);
    let is_forced = |pin: PinOutputId| {
        let PinRole::Output(output, _) = circuit.outputs[pin].role else { return false };
        tagged.is_emergency && !called.contains_key(&output)
    };
    let is_of_step = |origin: Origin| {
        let (Origin::Step(step) | Origin::Region(step)) = origin else { return false };
        tagged.steps.contains(&step)
    };
    // The flip-flops of a code that includes the step.
    let mut coded = BTreeSet::new();
    for decoded in circuit.decoded.iter().filter(|decoded| is_of_step(decoded.holds.origin)) {
        let mut open = vec![decoded.node];
        let mut seen = BTreeSet::new();
        while let Some(node) = open.pop() {
            if !seen.insert(node) {
                continue;
            }
            if let grafsynth_ir::logic::Node::Flop(flop) = &circuit.nodes[node] {
                coded.insert(*flop);
            }
            grafsynth_logic::build::for_each_operand(&circuit.nodes[node], |operand| {
                open.push(operand);
            });
        }
    }
    let is_meant = |signal: &&super::chip::Signal| {
        let has_tag = signal.meta.req.iter().any(|known| known == tag);
        match signal.kind {
            Kind::Flop(flop) => {
                let holds = circuit.flops[flop].holds;
                has_tag || coded.contains(&flop) || holds.is_some_and(|bit| is_of_step(bit.origin))
            }
            Kind::Output(pin) => has_tag || is_forced(pin),
            Kind::Input(_) => has_tag,
            Kind::Buried | Kind::Clock | Kind::Reset => false,
        }
    };
    chip.signals.iter().filter(is_meant).map(|signal| signal.name.clone()).collect()
}

/// Line numbers as ranges.
fn ranges(lines: &[u32]) -> String {
    let mut parts: Vec<(u32, u32)> = Vec::new();
    for line in lines {
        match parts.last_mut() {
            Some((_, last)) if *last + 1 == *line => *last = *line,
            Some(_) | None => parts.push((*line, *line)),
        }
    }
    let text = |(first, last): &(u32, u32)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    };
    parts.iter().map(text).collect::<Vec<_>>().join(", ")
}
