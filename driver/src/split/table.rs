//! What a chart costs on a chip alone, on the CPU alone, and as the split: one table.

use super::link::{nanoseconds, step_cycles};
use super::memory::memory_alone;
use super::{
    BuiltPart, Compile, Linked, Memory, PartDevice, Request, RequestedPart, Split, build_part,
    misfit, rounded,
};
use crate::built::BuildOptions;
use grafsynth_backend_c::cost;
use grafsynth_ir::Gather;
use grafsynth_ir::Valid;
use grafsynth_ir::diag::{Diagnostic, Severity};
use grafsynth_ir::division::{Division, Running, Source};
use grafsynth_ir::net::{InputId, Net};
use grafsynth_split::codes;
use grafsynth_split::cpu::{Cpu, cpu};
use grafsynth_split::link::Connection;
use std::collections::BTreeSet;

/// One way to build the chart, with its costs as texts.
pub(super) struct Way {
    pub(super) name: String,
    pub(super) cells: String,
    pub(super) chip_pins: String,
    pub(super) cpu_pins: String,
    pub(super) flash: String,
    pub(super) ram: String,
    pub(super) cycles: String,
    pub(super) latency: String,
}

impl Way {
    /// The titles of the columns.
    pub(super) const HEAD: [&'static str; 8] = [
        "",
        "macrocells",
        "pins of the chips",
        "pins of the CPU",
        "flash",
        "RAM",
        "worst-case cycles",
        "latency",
    ];

    /// The texts of the columns.
    pub(super) fn row(self) -> [String; 8] {
        let Way { name, cells, chip_pins, cpu_pins, flash, ram, cycles, latency } = self;
        [name, cells, chip_pins, cpu_pins, flash, ram, cycles, latency]
    }
}

/// The table in Markdown: a row for each chip alone, for the CPU alone, and for the split. Cycles are the bound of `build`, for the split with an
/// estimate for the link; the latency is that of one reaction. Nothing is proved.
#[must_use]
pub fn table(net: &Valid<Net>, split: &Split, linked: &Linked, request: &Request<'_>) -> String {
    let line = |cells: [String; 8]| {
        format!("| {} |\n", cells.map(|it| it.replace('|', "\\|")).join(" | "))
    };
    let head = format!("| {} |\n", Way::HEAD.join(" | ").trim_start());
    let rows: String =
        ways(net, split, linked, request).into_iter().map(|way| line(way.row())).collect();
    format!("{head}|{}\n{rows}", "---|".repeat(Way::HEAD.len()))
}

/// The chart on each chip alone, on the CPU alone, and as the split.
pub(super) fn ways(
    net: &Valid<Net>,
    split: &Split,
    linked: &Linked,
    request: &Request<'_>,
) -> Vec<Way> {
    let options = BuildOptions { prove: false, ..request.options.clone() };
    // A chip alone has no CPU that could reset it.
    let request = Request { options: &options, reset: false, ..*request };
    let mut ways: Vec<Way> = Vec::new();
    let mut tried: BTreeSet<&str> = BTreeSet::new();
    for part in request.parts {
        if !tried.insert(part.device.name()) {
            continue;
        }
        let built = build_part(net, part, &request);
        ways.push(match part.device {
            PartDevice::Chip(_) => chip_alone(part, &built),
            PartDevice::Cpu(name) => cpu_alone(net, name, &built, request.compile),
        });
    }
    ways.push(both(net, split, linked));
    ways
}

/// The pins of the CPU: for the link, and for the inputs and outputs of the plant. An input that is wired to chips alone needs none.
pub(super) fn cpu_pins(net: &Net, division: &Division, linked: &Linked) -> u64 {
    let cpu = linked.chips.len();
    let at_cpu = |one: &Connection| {
        let mut ends = [&one.from].into_iter().chain(&one.to);
        ends.any(|end| end.part == cpu)
    };
    let link = linked.link.connections.iter().filter(|one| at_cpu(one)).count() as u64;
    let own = |id| division.owners.outputs[id] == cpu;
    let outputs = net.outputs.iter().filter(|(id, it)| !it.is_extern() && own(*id));
    let outputs: u64 = outputs.map(|(_, it)| bits(it.ty)).sum();
    let inputs = net.inputs.iter().filter(|(_, it)| it.kind.is_handed());
    let inputs = inputs.filter(|(id, _)| reaches_cpu(division, linked, *id));
    let inputs: u64 = inputs.map(|(_, it)| bits(it.ty)).sum();
    inputs + outputs + link
}

/// Whether the CPU reads the pin of an input of the plant: in lockstep, unless the input is wired to chips alone; else if the part on the CPU has it.
fn reaches_cpu(division: &Division, linked: &Linked, input: InputId) -> bool {
    match division.running {
        Running::Lockstep => {
            let mut direct = linked.link.direct.iter();
            !direct.any(|one| one.input == input && !one.is_emergency)
        }
        Running::Free => {
            let mut sources = division.parts.last().into_iter().flat_map(|it| it.inputs.values());
            sources.any(|source| *source == Source::Input(input))
        }
    }
}

/// A warning if the CPU has too few pins for the inputs and outputs of the plant after those of the link.
#[must_use]
pub fn crowded(net: &Net, division: &Division, linked: &Linked) -> Option<Diagnostic> {
    let (all, usable) = (cpu_pins(net, division, linked), linked.cpu.pins.len() as u64);
    (all > usable).then(|| {
        let name = linked.cpu.name;
        let message = format!(
            "the link and the plant need {all} pins of the CPU, but `{name}` has only {usable} usable pins"
        );
        let help = "connect some inputs or outputs of the plant in another way, for example through a port expander, or choose a CPU with more pins";
        Diagnostic::warning(codes::PINS, message).at(net.name.span, "this chart").help(help)
    })
}

fn dash() -> String {
    "—".to_owned()
}

fn chip_alone(part: &RequestedPart, built: &BuiltPart) -> Way {
    let name = format!("{} alone", part.device.name());
    let errors = built.built.found.iter().filter(|one| one.severity == Severity::Error);
    let misfit = misfit(built).map(|why| format!("does not fit: {why}"));
    let why = errors.map(|one| one.message.clone()).next().or(misfit);
    match (why, built.built.chips.first()) {
        (None, Some(_)) => Way {
            name,
            cells: cells(built).to_string(),
            chip_pins: pins(built).to_string(),
            cpu_pins: dash(),
            flash: dash(),
            ram: dash(),
            cycles: dash(),
            latency: "1 clock".to_owned(),
        },
        (why, _) => {
            let why = why.unwrap_or_else(|| "no circuit".to_owned());
            Way {
                name,
                cells: why,
                chip_pins: dash(),
                cpu_pins: dash(),
                flash: dash(),
                ram: dash(),
                cycles: dash(),
                latency: dash(),
            }
        }
    }
}

fn cpu_alone(net: &Net, name: &str, built: &BuiltPart, compile: Option<Compile>) -> Way {
    let outputs: u64 =
        net.outputs.values().filter(|it| !it.is_extern()).map(|it| bits(it.ty)).sum();
    let bound = cpu(name).and_then(|cpu| bound(built, cpu));
    let cpu_found = cpu(name).ok_or_else(unknown);
    let memory = cpu_found.and_then(|cpu| memory_alone(net, built, cpu, compile));
    let [flash, ram] = memories(cpu(name), &memory);
    Way {
        name: format!("{name} alone"),
        cells: dash(),
        chip_pins: dash(),
        cpu_pins: (input_bits(net) + outputs).to_string(),
        flash,
        ram,
        cycles: bound.map_or_else(unknown, |(cycles, _)| cycles.to_string()),
        latency: bound.map_or_else(unknown, |(_, ns)| rounded(ns)),
    }
}

fn both(net: &Net, split: &Split, linked: &Linked) -> Way {
    let of_chips = || split.parts.iter().take(linked.chips.len());
    let round = linked.round.as_ref();
    let [flash, ram] = memories(Some(linked.cpu), &split.memory);
    Way {
        name: "split".to_owned(),
        cells: of_chips().map(cells).sum::<u64>().to_string(),
        chip_pins: of_chips().map(pins).sum::<u64>().to_string(),
        cpu_pins: cpu_pins(net, &split.division, linked).to_string(),
        flash,
        ram,
        cycles: round.map_or_else(
            |_| unknown(),
            |round| format!("{} and {} of the link, estimated", round.step, round.link),
        ),
        latency: round.map_or_else(|_| unknown(), |round| rounded(round.ns)),
    }
}

/// The used flash and RAM of a microcontroller, with the source of the figures.
fn memories(cpu: Option<&Cpu>, memory: &Result<Memory, String>) -> [String; 2] {
    let (Some(cpu), Ok(memory)) = (cpu, memory) else { return [unknown(), unknown()] };
    let source = memory.compiler.unwrap_or("estimated");
    let text = |used: u64, all: u32| {
        let misfit = if used > u64::from(all) { "does not fit: " } else { "" };
        format!("{misfit}{used} of {all} ({source})")
    };
    [text(memory.flash, cpu.flash), text(memory.ram(), cpu.ram)]
}

fn unknown() -> String {
    "not known".to_owned()
}

fn bits(ty: grafsynth_ir::expr::Type) -> u64 {
    u64::from(ty.bits())
}

fn input_bits(net: &Net) -> u64 {
    net.inputs.values().filter(|it| it.kind.is_handed()).map(|it| bits(it.ty)).sum()
}

fn cells(built: &BuiltPart) -> u64 {
    built.built.chips.iter().map(|chip| chip.cells.len() as u64).sum()
}

/// The pins of a chip that carry signals.
fn pins(built: &BuiltPart) -> u64 {
    let signals = built.built.chips.iter().flat_map(|chip| &chip.signals);
    signals.filter_map(|signal| signal.pin).gather::<BTreeSet<u32>>().len() as u64
}

/// The cycles of a reaction and its time in nanoseconds, as [`super::link`] computes them for the part on the CPU.
fn bound(built: &BuiltPart, cpu: &Cpu) -> Option<(u64, u64)> {
    let machine = cost::machine(cpu.machine).filter(|machine| machine.is_bounded)?;
    let cycles = step_cycles(built.built.packages.first()?, machine).ok()?;
    Some((cycles, nanoseconds(cpu, cycles.saturating_mul(u64::from(machine.clocks_per_unit)))))
}
