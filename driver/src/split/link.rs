//! The link of a split: its C and wiring, from the pins of the fitted chips and the interface of the emitted C.

use super::{BuiltPart, PartDevice, RequestedPart, Split, is_still};
use crate::built::OutputFile;
use crate::codes;
use crate::report::chip::{Chip, Kind};
use crate::stem::FileStem;
use grafsynth_backend_c::{Package, cost};
use grafsynth_ir::Diagnostic;
use grafsynth_ir::Gather;
use grafsynth_ir::division::{Division, PartNet, Running, Shown};
use grafsynth_ir::duration;
use grafsynth_ir::logic::{Logic, Node, NodeId, PinOutput, PinRole};
use grafsynth_ir::names::{C, Namer};
use grafsynth_ir::net::{InputId, Leaf, Net, Transition, TransitionId};
use grafsynth_sim::measures_time;
use grafsynth_split::codes::DEADLINE;
use grafsynth_split::cpu::{Cpu, HOST};
use grafsynth_split::link::{
    self, Calls, ChipPins, ChipSignal, Condition, CpuNames, Link, OSCILLATOR_HZ, Object,
    SYNCHRONISERS, Timing, calls, check, chip_ns, files, round_cycles, smallest_program, wiring_md,
    wiring_rows, wiring_svg,
};
use std::collections::{BTreeMap, BTreeSet};

/// A link with the data from which its files are printed.
#[derive(Debug, Clone)]
pub struct Linked {
    /// The connections, and the acts of a round.
    pub link: Link,
    /// The pins of each chip.
    pub chips: Vec<ChipPins>,
    /// The microcontroller.
    pub cpu: &'static Cpu,
    /// The prefix of its functions: NAME in `NAME_link_round`.
    pub name: String,
    /// How a program calls its functions.
    pub calls: Calls,
    /// The text of the smallest program that uses it, whose sizes are those of the part on the CPU.
    pub main: String,
    /// The rows of the wiring table.
    pub wiring: Vec<[String; 5]>,
    /// Its C, the wiring table and the wiring diagram.
    pub files: Vec<OutputFile>,
    /// The longest time of a reaction, or the reason why it is not known.
    pub round: Result<Round, String>,
}

/// The time of a reaction, which is one or more rounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Round {
    /// The maximum number of cycles, in one round, of the reaction of the part on the CPU.
    pub step: u64,
    /// The estimated maximum number of cycles of everything else in one round.
    pub link: u64,
    /// The clock of the CPU in cycles per second.
    pub hz: u64,
    /// The maximum number of rounds of a reaction.
    pub rounds: u32,
    /// The time of all these rounds in nanoseconds.
    pub ns: u64,
    /// The longest time from a change of an input to the outputs that follow from it: the change just misses the latch of one reaction, so it waits for the next
    /// one. In lockstep, reactions start one tick apart if the chart measures time, else one after another.
    pub pin_to_pin_ns: u64,
}

/// The link of a split for its CPU. The acts of a round are checked before they are printed.
///
/// # Errors
/// Too few pins on the CPU; signals that cannot be wired; a chip whose pins are not assigned; deadlines that are not met. A failed check is a bug in grafsynth.
pub fn link(
    net: &Net,
    split: &Split,
    parts: &[RequestedPart],
    stem: &FileStem,
) -> Result<Linked, Vec<Diagnostic>> {
    let linked = link_parts(net, (&split.division, &split.parts), parts, stem)?;
    let late = deadlines(net, split, &linked.round);
    if late.is_empty() { Ok(linked) } else { Err(late) }
}

/// The link of built parts, the chips first and the CPU last, without deadlines.
pub(super) fn link_parts(
    net: &Net,
    (division, built): (&Division, &[BuiltPart]),
    parts: &[RequestedPart],
    stem: &FileStem,
) -> Result<Linked, Vec<Diagnostic>> {
    let cpu = parts.last().and_then(|part| grafsynth_split::cpu::cpu(part.device.name()));
    link_on(net, (division, built), parts, stem, cpu)
}

/// Like [`link()`], with pins that are functions of a program on this computer, and without deadlines.
///
/// # Errors
/// Like [`link()`].
pub fn link_on_host(
    net: &Net,
    split: &Split,
    parts: &[RequestedPart],
    stem: &FileStem,
) -> Result<Linked, Vec<Diagnostic>> {
    link_on(net, (&split.division, &split.parts), parts, stem, Some(&HOST))
}

fn link_on(
    net: &Net,
    (division, built): (&Division, &[BuiltPart]),
    parts: &[RequestedPart],
    stem: &FileStem,
    cpu: Option<&'static Cpu>,
) -> Result<Linked, Vec<Diagnostic>> {
    let bug = |why: String| {
        let found = Diagnostic::error(codes::NO_PARTITION, why);
        vec![found.help("this is a bug in grafsynth: please report it with the chart")]
    };
    let mut chips = Vec::new();
    for ((part, requested), of_division) in built.iter().zip(parts).zip(&division.parts) {
        if let PartDevice::Chip(device) = requested.device {
            if part.built.chips.is_empty() && is_still(&of_division.net) {
                chips.push(ChipPins { device: device.name.to_owned(), ..ChipPins::default() });
                continue;
            }
            let chip = part.built.chips.first().filter(|chip| chip.misfit.is_none());
            let Some(chip) = chip else {
                // Equations that do not fit are written without pins, so this is no error of the build.
                let message = format!(
                    "part `{}` does not fit the {}: its pins are not assigned",
                    requested.name, device.name
                );
                let found = Diagnostic::error(codes::NO_PARTITION, message);
                return Err(vec![found.help("use a larger chip, or place fewer objects on it")]);
            };
            chips.push(pins(chip, of_division, device.name).map_err(bug)?);
        }
    }
    let package = built.last().and_then(|part| part.built.packages.first());
    let (Some(cpu), Some(package)) = (cpu, package) else {
        return Err(bug("the part on the CPU was not built".to_owned()));
    };
    let of_cpu = division.parts.last();
    let wanted = link::Request {
        net,
        division,
        chips: &chips,
        cpu,
        names: of_cpu.map(|part| names(package, &part.net)).unwrap_or_default(),
        stem: stem.to_string(),
        name: Namer::new(&C).name(stem.as_str()).trim_end_matches('_').to_owned(),
        wanted: BTreeMap::new(),
        timing: Timing::default(),
    };
    let link = link::link(&wanted)?;
    check(&link, net, division, &chips)
        .map_err(|breach| bug(format!("the link does not perform exactly one round: {breach}")))?;
    let round = round(net, package, &wanted, &link);
    let driver = files(&wanted, &link).into_iter();
    let mut all: Vec<OutputFile> =
        driver.map(|file| OutputFile::new(file.name, file.text)).collect();
    let (name, stem) = (wanted.name.clone(), &wanted.stem);
    all.push(OutputFile::new(format!("{stem}_wiring.md"), wiring_md(&wanted, &link)));
    all.push(OutputFile::new(format!("{stem}_wiring.svg"), wiring_svg(&wanted, &link)));
    let calls = calls(&wanted, &link);
    let (main, wiring) = (smallest_program(&wanted, &link), wiring_rows(&wanted, &link));
    Ok(Linked { link, chips, cpu, name, calls, main, wiring, files: all, round })
}

fn round(
    net: &Net,
    package: &Package,
    wanted: &link::Request<'_>,
    link: &link::Link,
) -> Result<Round, String> {
    let cpu = wanted.cpu;
    let machine = cost::machine(cpu.machine).filter(|machine| machine.is_bounded);
    let (Some(machine), Some(cycles)) = (machine, round_cycles(link, cpu, &wanted.timing)) else {
        return Err(format!("the time of C on an {} is not known", cpu.name));
    };
    let step = step_cycles(package, machine)?;
    let hz = u64::from(cpu.clock_hz);
    let rounds = link.most_rounds.unwrap_or(1);
    let clocks = step
        .saturating_mul(u64::from(machine.clocks_per_unit))
        .saturating_add(cycles * u64::from(cpu.clocks_per_cycle))
        .saturating_mul(u64::from(rounds));
    let ns = nanoseconds(cpu, clocks);
    // A part that runs on its own reacts again and again; in lockstep, the rounds of a chart that measures time are one tick apart.
    let waits = measures_time(net) && wanted.division.running == Running::Lockstep;
    let period = if waits { net.settings.tick_ns.max(ns) } else { ns };
    let pin_to_pin_ns = period.saturating_add(ns);
    Ok(Round { step, link: cycles, hz, rounds, ns, pin_to_pin_ns })
}

/// The bound of a reaction of C in cycles of the machine, or the reason why it is not known.
pub(super) fn step_cycles(package: &Package, machine: &cost::Machine) -> Result<u64, String> {
    let bound = cost::bound(package, machine).map_err(|why| why.to_string())?;
    if let Some(why) = bound.unbounded {
        return Err(why);
    }
    if bound.user_calls > 0 || bound.user_code {
        return Err("the reaction calls functions whose time is not known".to_owned());
    }
    Ok(bound.step)
}

/// The time of a number of clocks at the highest frequency.
pub(super) fn nanoseconds(cpu: &Cpu, clocks: u64) -> u64 {
    clocks.saturating_mul(1_000_000_000).div_ceil(u64::from(cpu.clock_hz).max(1))
}

/// A time in microseconds, rounded up to a tenth.
#[must_use]
pub fn rounded(ns: u64) -> String {
    let tenths = ns.div_ceil(100);
    format!("{}.{} us", tenths / 10, tenths % 10)
}

/// The deadlines that a split does not meet.
fn deadlines(net: &Net, split: &Split, round: &Result<Round, String>) -> Vec<Diagnostic> {
    let is_free = split.division.running == Running::Free;
    let late = |(id, transition): (TransitionId, &Transition)| {
        let owner = split.division.owners.transitions[id];
        if is_free && owner + 1 < split.division.parts.len() {
            if let Some(step) = step_elsewhere(net, split, id) {
                let message = format!(
                    "`{}` has a deadline of {}, but it depends on step `{step}` of another part, whose time is not known",
                    transition.name,
                    duration(transition.deadline_ns?)
                );
                let found =
                    Diagnostic::error(DEADLINE, message).at(transition.meta.span, "has a deadline");
                return Some(found.help("place the step on the same chip, or remove the deadline"));
            }
            let (needs, deadline) = (chip_ns(&Timing::default()), transition.deadline_ns?);
            return (needs > deadline).then(|| {
                let message = format!(
                    "`{}` has a deadline of {}, but up to {} pass from a pin of its chip to its outputs, with {SYNCHRONISERS} synchronisers and a clock of {} MHz",
                    transition.name,
                    duration(deadline),
                    rounded(needs),
                    OSCILLATOR_HZ / 1_000_000
                );
                Diagnostic::error(DEADLINE, message).at(transition.meta.span, "has a deadline").help("make it longer")
            });
        }
        let deadline = transition.deadline_ns?;
        let (name, wanted) = (&transition.name.text, duration(deadline));
        let message = match round {
            Ok(round) if round.pin_to_pin_ns <= deadline => return None,
            Ok(round) => format!(
                "`{name}` has a deadline of {wanted}, but {} up to {} pass from pin to pin: a change waits for the next reaction, and a reaction takes up to {}",
                if is_free { "on the CPU" } else { "in lockstep" },
                rounded(round.pin_to_pin_ns),
                rounded(round.ns)
            ),
            Err(why) => {
                format!("it is open whether `{name}` meets its deadline of {wanted}: {why}")
            }
        };
        let found = Diagnostic::error(DEADLINE, message)
            .at(transition.meta.span, "has a deadline")
            .help("make it longer, choose a faster CPU, or place less work on the CPU");
        Some(found)
    };
    net.transitions.iter().filter_map(late).collect()
}

/// A step of another part that a transition reads or leaves.
fn step_elsewhere<'n>(net: &'n Net, split: &Split, id: TransitionId) -> Option<&'n str> {
    let owners = &split.division.owners;
    let transition = &net.transitions[id];
    let read = transition.guard.leaves().filter_map(Leaf::step);
    let mut all = transition.requires.iter().copied().chain(read);
    let step = all.find(|step| owners.steps[*step] != owners.transitions[id])?;
    Some(&net.steps[step].name.text)
}

/// The pins of a fitted chip, with the meanings of their signals.
fn pins(chip: &Chip, part: &PartNet, device: &str) -> Result<ChipPins, String> {
    let pin_of = |name: &str| {
        let signal = chip.signals.iter().find(|signal| signal.name == name);
        let signal = signal.ok_or_else(|| format!("the {device} has no signal `{name}`"))?;
        signal.pin.ok_or_else(|| format!("signal `{name}` of {device} has no pin"))
    };
    let mut pins = ChipPins {
        device: device.to_owned(),
        grounded: chip.enables.clone(),
        held: held(&chip.read_back, part, |output| output.mealy),
        moving: held(&chip.read_back, part, |_| false),
        ..ChipPins::default()
    };
    for input in chip.circuit.inputs.values() {
        match input.role {
            PinRole::Input(id, bit) => {
                let (name, pin) = (input.name.clone(), pin_of(&input.name)?);
                pins.signals.push(ChipSignal { name, pin, object: Object::Input(id), bit });
            }
            PinRole::Tick => pins.tick = Some(pin_of(&input.name)?),
            PinRole::Reset => pins.reset = Some(pin_of(&input.name)?),
            _ => {
                return Err(format!(
                    "signal `{}` of {device} is not an input of the part",
                    input.name
                ));
            }
        }
    }
    for output in chip.circuit.outputs.values() {
        if let PinRole::Output(id, bit) = output.role {
            let (name, pin) = (output.name.clone(), pin_of(&output.name)?);
            pins.signals.push(ChipSignal { name, pin, object: Object::Output(id), bit });
        }
    }
    for chain in &chip.chains {
        if let Some(input) = chip.circuit.inputs.get(chain.input) {
            pins.synchronisers.insert(pin_of(&input.name)?, chain.flops.len());
        }
    }
    for output in chip.circuit.outputs.values() {
        let is_flop = matches!(chip.circuit.nodes[output.value], Node::Flop(_));
        if output.registered.is_some() || is_flop {
            pins.registered.extend(pin_of(&output.name));
        }
    }
    // That circuit has no synchronisers, whose outputs change between two reactions.
    for output in chip.read_back.outputs.values().filter(|output| output.registered.is_none()) {
        if !inputs_of(&chip.read_back, [output.value].into_iter()).is_empty() {
            let same = chip.circuit.outputs.values().find(|one| one.role == output.role);
            pins.following.extend(same.map(|one| pin_of(&one.name)).transpose()?);
        }
    }
    let clock = chip.signals.iter().find(|signal| signal.kind == Kind::Clock);
    pins.clock = clock.and_then(|signal| signal.pin);
    Ok(pins)
}

/// The inputs on which a flip-flop, a wire or an output of the plant that is `early` depends, according to the fuses or text of a chip.
fn held(logic: &Logic, part: &PartNet, early: impl Fn(&PinOutput) -> bool) -> BTreeSet<InputId> {
    let is_plain = |output: &&PinOutput| {
        let shown = match output.role {
            PinRole::Output(id, _) => part.outputs.iter().find(|(own, _)| *own == id),
            _ => None,
        };
        let is_of_plant = matches!(shown, Some((_, Shown::Output(_))));
        is_of_plant && output.registered.is_none() && !early(output)
    };
    let outputs = logic.outputs.values().filter(|output| !is_plain(output));
    let next = logic.flops.values().map(|flop| flop.next);
    inputs_of(logic, next.chain(outputs.map(|output| output.value)))
}

/// The inputs on which functions of a circuit depend without a flip-flop in between.
fn inputs_of(logic: &Logic, functions: impl Iterator<Item = NodeId>) -> BTreeSet<InputId> {
    let mut open: Vec<NodeId> = functions.collect();
    let (mut seen, mut found) = (BTreeSet::new(), BTreeSet::new());
    while let Some(node) = open.pop() {
        if !seen.insert(node) {
            continue;
        }
        match &logic.nodes[node] {
            Node::Const(_) | Node::Flop(_) => {}
            Node::Input(input) => {
                if let PinRole::Input(id, _) = logic.inputs[*input].role {
                    found.insert(id);
                }
            }
            Node::Not(one) => open.push(*one),
            Node::And(all) | Node::Or(all) => open.extend(all),
            Node::Xor(one, other) => open.extend([one, other]),
            Node::Mux(one, then, otherwise) => open.extend([one, then, otherwise]),
        }
    }
    found
}

/// The interface of the C of the last part.
pub(super) fn names(package: &Package, net: &Net) -> CpuNames {
    let interface = package.reaction_interface();
    let handed = net.inputs.iter().filter(|(_, input)| input.kind.is_handed());
    let condition = |(id, provided): (&InputId, &String)| {
        (*id, Condition { called: interface.inputs[*id].clone(), provided: provided.clone() })
    };
    let shown = net.outputs.iter().filter(|(_, output)| !output.is_extern());
    CpuNames {
        prefix: interface.prefix.to_owned(),
        header: format!("{}.h", package.stem()),
        inputs: handed.map(|(id, _)| (id, interface.inputs[id].clone())).gather(),
        outputs: shown.map(|(id, _)| (id, interface.outputs[id].clone())).gather(),
        has_instance: interface.has_instance,
        dt: interface.dt.map(str::to_owned),
        library: package.library_header(),
        conditions: interface.provided.iter().map(condition).gather(),
    }
}
