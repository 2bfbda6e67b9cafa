//! The report of a split: what is where and why, the wires, the wiring, the costs, and what was proved.

use super::conflict::place_of;
use super::free::late_on_cpu;
use super::table::{Way, ways};
use super::{Linked, PartDevice, Request, Split};
use crate::report::Document;
use crate::report::document::{Block, Figure, Inline, Item as ListItem, Rich, Section, Table};
use crate::report::proofs::of_line;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_split::Item;
use grafsynth_split::solve::{Alternative, Constraint, Usage};

/// The report. `summary` has the lines that the command line prints about the whole split, and `joined` the verdict on the joined parts with its text.
#[must_use]
pub fn report(
    net: &Valid<Net>,
    (split, linked): (&Split, &Linked),
    request: &Request<'_>,
    summary: &[String],
    joined: (&'static str, &[String]),
) -> Document {
    let subject = Subject { net, split, linked, request };
    let label = net.parts.values().next().map_or("", |part| part.meta.label.as_str());
    let section = |id, title: &str, blocks| Section {
        id,
        output: None,
        is_part: false,
        title: title.to_owned(),
        blocks,
    };
    let summary = summary.iter().map(|line| ListItem::from(Rich::message(line.clone())));
    Document {
        title: net.name.text.clone(),
        subtitle: label.to_owned(),
        sections: vec![
            section("split", "Split", vec![subject.parts(), Block::List(summary.collect())]),
            section("proofs", "What was proved", subject.proofs(joined)),
            section("partition", "What is where, and why", subject.partition()),
            section("wires", "Wires", subject.wires()),
            section("wiring", "Wiring", subject.wiring()),
            section("costs", "Costs", subject.costs()),
        ],
    }
}

struct Subject<'a> {
    net: &'a Valid<Net>,
    split: &'a Split,
    linked: &'a Linked,
    request: &'a Request<'a>,
}

impl Subject<'_> {
    fn name(&self, part: usize) -> &str {
        self.request.parts.get(part).map_or("", |part| part.name.as_str())
    }

    /// The parts with their contents.
    fn parts(&self) -> Block {
        let mut table = Table::new(["part", "device", "steps", "transitions", "outputs", "in use"]);
        let owners = &self.split.division.owners;
        for (at, part) in self.request.parts.iter().enumerate() {
            let steps = owners.steps.values().filter(|owner| **owner == at).count();
            let transitions = owners.transitions.values().filter(|owner| **owner == at).count();
            let outputs = owners.outputs.values().filter(|owner| **owner == at).count();
            let used = match (part.device, self.split.parts.get(at)) {
                (PartDevice::Chip(device), Some(built)) => {
                    let cells =
                        built.built.chips.iter().map(|chip| chip.cells.len()).sum::<usize>();
                    format!("{cells} of {} macrocells", device.n_cells())
                }
                _ => match &self.split.memory {
                    Ok(memory) => format!(
                        "{} of {} bytes of flash, {} of {} bytes of RAM ({})",
                        memory.flash,
                        self.linked.cpu.flash,
                        memory.ram(),
                        self.linked.cpu.ram,
                        memory.source()
                    ),
                    Err(_) => "memory not known".to_owned(),
                },
            };
            let (steps, transitions) = (steps.to_string(), transitions.to_string());
            let device = part.device.name().to_owned();
            table.row([part.name.clone(), device, steps, transitions, outputs.to_string(), used]);
        }
        Block::Table(table)
    }

    fn proofs(&self, (word, said): (&'static str, &[String])) -> Vec<Block> {
        let lines = self.split.parts.iter().flat_map(|part| &part.built.lines);
        let mut items: Vec<ListItem> = lines.map(of_line).collect();
        let name = Inline::Strong("joined parts".to_owned());
        items.push(ListItem {
            text: Rich::say("{}: ", [name]).and(Rich::verdict(word)),
            parts: said.iter().map(|line| Rich::message(line.clone())).collect(),
        });
        vec![Block::List(items)]
    }

    /// Each group with its part, the reason, and what it would cost on the other parts.
    fn partition(&self) -> Vec<Block> {
        let mut table = Table::new(["objects", "part", "because", "elsewhere"]);
        let Split { groups, partition, .. } = self.split;
        for (group, items) in groups.groups.iter().enumerate() {
            let Some(at) = partition.part.get(group) else { continue };
            let items = items.iter().filter(|item| !matches!(item, Item::Event(_)));
            let names: Vec<String> = items.map(|item| item.describe(self.net)).collect();
            let alone = match names.len() {
                1 => String::new(),
                n => format!("{}, which cannot be separated: ", counted(n, "object", "objects")),
            };
            table.add(vec![
                Rich::message(format!("{alone}{}", names.join(", "))),
                Rich::plain(self.name(*at)),
                Rich::message(self.reason(group)),
                Rich::message(self.elsewhere(group)),
            ]);
        }
        let about = "An object alone is moved; all others stay. Macrocells elsewhere are counted as in the last step of the search, so a part that fits by this \
                     count may not fit when it is built.";
        vec![Block::Paragraph(Rich::say(about, [])), Block::Table(table)]
    }

    fn reason(&self, group: usize) -> String {
        if let Some((item, why)) = self.split.groups.cpu_only.get(&group) {
            return format!("only a CPU can have {}: {why}", item.describe(self.net));
        }
        match place_of(&self.split.groups, self.request, group) {
            Some(place) => format!("{} is placed there", place.item.describe(self.net)),
            None => {
                let is_least = self.split.bound >= self.split.value;
                let found = if is_least { "the minimum of" } else { "the best that was found for" };
                format!("{found} {}", self.request.objective.unit())
            }
        }
    }

    fn elsewhere(&self, group: usize) -> String {
        let partition = &self.split.partition;
        let others = partition.alternatives.get(group).map(Vec::as_slice).unwrap_or_default();
        let unit = self.request.objective.unit();
        let text = |(part, other): (usize, &Alternative)| {
            let what = match other {
                Alternative::Current => return None,
                Alternative::NotAllowed => "not allowed".to_owned(),
                Alternative::Value(value) => match value - partition.evaluation.value {
                    0 => format!("the same number of {unit}"),
                    more if more > 0 => format!("{more} more {unit}"),
                    fewer => format!("{} fewer {unit}", -fewer),
                },
                Alternative::DoesNotFit(usages) => {
                    let usages: Vec<String> =
                        usages.iter().map(|usage| self.usage(usage)).collect();
                    format!("does not fit: {}", usages.join(", "))
                }
                Alternative::Forbidden => self.excluded(group, part),
            };
            Some(format!("on `{}`: {what}", self.name(part)))
        };
        let all: Vec<String> = others.iter().enumerate().filter_map(text).collect();
        if all.is_empty() { "not compared".to_owned() } else { all.join("; ") }
    }

    /// Why the search excluded a group on a part.
    fn excluded(&self, group: usize, part: usize) -> String {
        let late = late_on_cpu(self.net, &self.split.groups, self.request);
        match late.iter().find(|late| late.group == group && late.part == part) {
            Some(late) => late.said(self.net, self.name(part)),
            None => "does not fit, as a build shows".to_owned(),
        }
    }

    fn usage(&self, usage: &Usage) -> String {
        let (part, what) = match usage.constraint {
            Constraint::Capacity { part, resource: 0 } => (part, "macrocells"),
            Constraint::Pins { part } => (part, "pins"),
            Constraint::Capacity { part, .. } => (part, "estimated bytes of memory"),
            Constraint::Allowed { .. }
            | Constraint::Together { .. }
            | Constraint::Forbidden { .. } => {
                return "another rule".to_owned();
            }
        };
        let used = usage.used;
        match usage.capacity {
            Some(capacity) => format!("{used} {what} of {capacity} of `{}`", self.name(part)),
            None => format!("{used} {what} of `{}`", self.name(part)),
        }
    }

    fn wires(&self) -> Vec<Block> {
        let mut table = Table::new(["wire", "shows", "from", "to"]);
        for wire in &self.split.division.wires {
            let to: Vec<&str> = wire.to.iter().map(|(part, _)| self.name(*part)).collect();
            table.add(vec![
                Rich::plain(wire.name.clone()),
                Rich::message(wire.signal.describe(self.net)),
                Rich::plain(self.name(wire.from)),
                Rich::plain(to.join(", ")),
            ]);
        }
        if table.is_empty() {
            return vec![Block::Paragraph(Rich::say("The parts need no wire.", []))];
        }
        vec![Block::Table(table)]
    }

    fn wiring(&self) -> Vec<Block> {
        let drawing = self.linked.files.iter().find(|file| file.name.ends_with(".svg"));
        let figure = drawing.map(|file| {
            Block::Figure(Figure {
                about: format!("wiring of {}", self.net.name),
                file: file.name.clone(),
                svg: file.text.clone(),
            })
        });
        let mut table = Table::new(["connection", "carries", "from", "to", "resistor"]);
        for row in &self.linked.wiring {
            table.add(row.iter().map(|cell| Rich::message(cell.clone())).collect());
        }
        let cpu = self.linked.cpu;
        let source = Rich::say("Figures of the {}: {}.", [cpu.name.into(), cpu.source.into()]);
        figure.into_iter().chain([Block::Table(table), Block::Paragraph(source)]).collect()
    }

    fn costs(&self) -> Vec<Block> {
        let mut table = Table::new(Way::HEAD);
        for way in ways(self.net, self.split, self.linked, self.request) {
            table.add(way.row().into_iter().map(Rich::message).collect());
        }
        vec![Block::Table(table)]
    }
}
