//! What a chart costs on a chip alone, on the CPU alone, and as the split: one table.

use super::{BuiltPart, Linked, PartDevice, Request, RequestedPart, Split, build_part, misfit};
use crate::built::BuildOptions;
use grafsynth_backend_c::cost;
use grafsynth_ir::Valid;
use grafsynth_ir::diag::Severity;
use grafsynth_ir::net::Net;
use grafsynth_split::cpu::{Cpu, cpu};
use grafsynth_split::link::{Act, Connection};
use std::collections::BTreeSet;

/// The estimated cycles of an access of a pin, as in the partition problem.
const CYCLES_OF_ACCESS: u64 = 4;

/// One way to build the chart.
struct Way {
    name: String,
    cells: String,
    chip_pins: String,
    cpu_pins: String,
    cycles: String,
    latency: String,
}

/// The table in Markdown: a row for each chip alone, for the CPU alone, and for the split. Cycles are the bound of `build`, without the link; the latency of the
/// split adds an estimate for it. Nothing is proved.
#[must_use]
pub fn table(net: &Valid<Net>, split: &Split, linked: &Linked, request: &Request<'_>) -> String {
    let options = BuildOptions { prove: false, ..request.options.clone() };
    let request = Request { options: &options, ..*request };
    let mut ways: Vec<Way> = Vec::new();
    let mut tried: BTreeSet<&str> = BTreeSet::new();
    for part in request.parts {
        if !tried.insert(part.device.name()) {
            continue;
        }
        let built = build_part(net, part, &request);
        ways.push(match part.device {
            PartDevice::Chip(_) => chip_alone(part, &built),
            PartDevice::Cpu(name) => cpu_alone(net, name, &built),
        });
    }
    ways.push(both(net, split, linked));
    let mut text = "| | macrocells | pins of the chips | pins of the CPU | worst-case cycles | latency |\n|---|---|---|---|---|---|\n".to_owned();
    for way in ways {
        let Way { name, cells, chip_pins, cpu_pins, cycles, latency } = way;
        text +=
            &format!("| {name} | {cells} | {chip_pins} | {cpu_pins} | {cycles} | {latency} |\n");
    }
    text
}

fn dash() -> String {
    "—".to_owned()
}

fn chip_alone(part: &RequestedPart, built: &BuiltPart) -> Way {
    let name = format!("{} alone", part.device.name());
    let errors = built.built.found.iter().filter(|one| one.severity == Severity::Error);
    let why = errors.map(|one| one.message.as_str()).next().or(misfit(built));
    match (why, built.built.chips.first()) {
        (None, Some(_)) => Way {
            name,
            cells: cells(built).to_string(),
            chip_pins: pins(built).to_string(),
            cpu_pins: dash(),
            cycles: dash(),
            latency: "1 clock".to_owned(),
        },
        (why, _) => {
            let why = why.unwrap_or("no circuit").replace('|', "\\|");
            Way {
                name,
                cells: format!("does not fit: {why}"),
                chip_pins: dash(),
                cpu_pins: dash(),
                cycles: dash(),
                latency: dash(),
            }
        }
    }
}

fn cpu_alone(net: &Net, name: &str, built: &BuiltPart) -> Way {
    let outputs: u64 =
        net.outputs.values().filter(|it| !it.is_extern()).map(|it| bits(it.ty)).sum();
    let cycles = cpu(name).and_then(|cpu| Some((cpu, bound(built, cpu)?)));
    Way {
        name: format!("{name} alone"),
        cells: dash(),
        chip_pins: dash(),
        cpu_pins: (input_bits(net) + outputs).to_string(),
        cycles: cycles.map_or_else(unknown, |(_, cycles)| cycles.to_string()),
        latency: cycles.map_or_else(unknown, |(cpu, cycles)| microseconds(cpu, cycles, 0)),
    }
}

fn both(net: &Net, split: &Split, linked: &Linked) -> Way {
    let of_chips = || split.parts.iter().take(linked.chips.len());
    let at_cpu = |one: &Connection| {
        let mut ends = [&one.from].into_iter().chain(&one.to);
        ends.any(|end| end.part == linked.chips.len())
    };
    let wires = linked.link.connections.iter().filter(|one| at_cpu(one)).count() as u64;
    let own = |id| split.division.owners.outputs[id] == linked.chips.len();
    let outputs = net.outputs.iter().filter(|(id, it)| !it.is_extern() && own(*id));
    let outputs: u64 = outputs.map(|(_, it)| bits(it.ty)).sum();
    let cycles = split.parts.last().and_then(|part| bound(part, linked.cpu));
    let (mut accesses, mut waits) = (0, 0);
    for act in &linked.link.acts {
        match act {
            Act::Put { .. } | Act::Get { .. } => accesses += 1,
            Act::Settle => waits += 1,
            Act::Clock { .. } => {
                accesses += 2;
                waits += 1;
            }
            Act::Latch | Act::Hand { .. } | Act::React => {}
        }
    }
    let of_link = accesses * CYCLES_OF_ACCESS;
    Way {
        name: "split".to_owned(),
        cells: of_chips().map(cells).sum::<u64>().to_string(),
        chip_pins: of_chips().map(pins).sum::<u64>().to_string(),
        cpu_pins: (input_bits(net) + outputs + wires).to_string(),
        cycles: cycles
            .map_or_else(unknown, |cycles| format!("{cycles}, and {accesses} accesses of pins")),
        latency: cycles.map_or_else(unknown, |cycles| {
            let time = microseconds(linked.cpu, cycles + of_link, waits * linked.settle_ns);
            format!("about {time}")
        }),
    }
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
    signals.filter_map(|signal| signal.pin).collect::<BTreeSet<u32>>().len() as u64
}

fn bound(built: &BuiltPart, cpu: &Cpu) -> Option<u64> {
    let package = built.built.packages.first()?;
    cost::bound(package, cost::machine(cpu.machine)?).ok().map(|bound| bound.step)
}

/// The time of so many cycles at the highest frequency, and a wait.
fn microseconds(cpu: &Cpu, cycles: u64, wait_ns: u64) -> String {
    let hz = u64::from(cpu.clock_hz / cpu.clocks_per_cycle).max(1);
    let ns = cycles.saturating_mul(1_000_000_000) / hz + wait_ns;
    format!("{}.{} µs", ns / 1000, ns % 1000 / 100)
}
