//! The connections of a link, the pins of the CPU, and the acts of a round.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Diagnostic;
use grafsynth_ir::Gather;
use grafsynth_ir::division::{
    Division, PartIndex, PartNet, Running, Shown, Signal, Source, rounds_of,
};
use grafsynth_ir::names::{C, Namer};
use grafsynth_ir::net::{InputId, InputKind, Net, OutputId};

use super::{
    Act, Carries, ChipSignal, Connection, ConnectionIndex, Direct, End, Link, Object, Put, Request,
    Start,
};
use super::{free, in_reset};
use crate::codes;
use crate::cpu::{Cpu, Pin};
use crate::{direct, unused_name};

/// Connects the parts, and lists the acts of a round.
///
/// Pins of the CPU that the request names are used first. The other signals get the remaining pins of the CPU in order: first the signals that the CPU reads, which
/// need pins that a chip may drive, then the signals that it drives.
///
/// # Errors
/// An unknown pin or connection in the request, or one that is used twice; a signal without a pin on a chip; more signals than the CPU has pins.
pub fn link(request: &Request<'_>) -> Result<Link, Vec<Diagnostic>> {
    let mut maker = Maker {
        request,
        connections: Vec::new(),
        direct: Vec::new(),
        oscillator: Vec::new(),
        safe: in_reset::safe(request.net).unwrap_or_default(),
        findings: Vec::new(),
    };
    maker.connect();
    if maker.findings.is_empty() {
        maker.assign_pins();
    }
    if !maker.findings.is_empty() {
        return Err(maker.findings);
    }
    let running = request.division.running;
    let acts = match running {
        Running::Lockstep => acts(request, &maker.connections, &maker.direct),
        Running::Free => free::acts(request, &maker.connections),
    };
    let starts = |(at, one): (ConnectionIndex, &Connection)| {
        let level = one.pull?;
        if running == Running::Free && one.carries != Carries::Reset {
            // Its resistor gives it the level of row 0.
            return None;
        }
        if let Carries::Wire(signal @ Signal::Active(_)) = one.carries {
            let wire = request.division.wires.iter().find(|wire| wire.signal == signal)?;
            return Some((at, Start::Output(wire.output)));
        }
        let start = level_of_row_0(request.net, one.carries);
        (start != level).then_some((at, Start::Level(start)))
    };
    let start = maker.connections.iter().enumerate().filter_map(starts).collect();
    let rounds = rounds_of(request.net).filter(|_| running == Running::Lockstep);
    let most_rounds = rounds.map(|limit| limit.saturating_add(1));
    let Maker { connections, direct, oscillator, .. } = maker;
    let once = most_rounds.map_or_else(Vec::new, |_| conditions(request));
    Ok(Link { connections, direct, oscillator, acts, most_rounds, once, start })
}

/// The extern conditions of the part on the CPU, in the net.
fn conditions(request: &Request<'_>) -> Vec<InputId> {
    let sources = request.division.parts.last().into_iter().flat_map(|part| part.inputs.values());
    let is_extern = |id: &InputId| request.net.inputs[*id].kind == InputKind::Extern;
    let inputs = sources.filter_map(|source| match source {
        Source::Input(id) => Some(*id),
        Source::Direct(_) | Source::Wire(_) | Source::More => None,
    });
    inputs.filter(is_extern).collect()
}

/// A placeholder for a pin of the CPU that is not chosen yet; no package has a pin 0.
const NO_PIN: u32 = 0;

struct Maker<'r> {
    request: &'r Request<'r>,
    connections: Vec<Connection>,
    direct: Vec<Direct>,
    oscillator: Vec<End>,
    /// Values of inputs that cause the emergency.
    safe: BTreeMap<InputId, i64>,
    findings: Vec<Diagnostic>,
}

impl Maker<'_> {
    fn division(&self) -> &Division {
        self.request.division
    }

    /// The index of the part on the CPU.
    fn cpu(&self) -> PartIndex {
        self.request.chips.len()
    }

    fn refuse(&mut self, message: String) {
        self.findings.push(Diagnostic::error(codes::LINK, message));
    }

    fn connect(&mut self) {
        let request = self.request;
        if self.division().parts.len() != self.cpu() + 1 {
            let (parts, chips) = (self.division().parts.len(), self.cpu());
            self.refuse(format!(
                "expected the pins of {} chips for {parts} parts, found {chips}",
                parts.saturating_sub(1)
            ));
            return;
        }
        let ends = |pin: &dyn Fn(&super::ChipPins) -> Option<u32>| -> Vec<End> {
            let all = request.chips.iter().enumerate();
            all.filter_map(|(part, chip)| Some(End { part, pin: pin(chip)? })).collect()
        };
        let mut namer = Namer::new(&C);
        // What the chart names keeps its name, in the fuse map of a chip and here.
        let own = |name| unused_name(request.net, name);
        match self.division().running {
            Running::Lockstep => {
                self.driven(&own("clock"), Carries::Clock, ends(&|chip| chip.clock), &mut namer);
                self.driven(&own("tick"), Carries::Tick, ends(&|chip| chip.tick), &mut namer);
            }
            Running::Free => self.oscillator = ends(&|chip| chip.clock),
        }
        self.driven(&own("reset"), Carries::Reset, ends(&|chip| chip.reset), &mut namer);
        self.connect_inputs(&mut namer);
        self.connect_wires(&mut namer);
        self.connect_moves(&mut namer);
        self.connect_more(&mut namer);
        self.connect_outputs(&mut namer);
    }

    /// Adds a connection that the CPU drives, unless nothing reads it.
    fn driven(&mut self, name: &str, carries: Carries, to: Vec<End>, namer: &mut Namer) {
        if to.is_empty() {
            return;
        }
        let from = End { part: self.cpu(), pin: NO_PIN };
        let pull = Some(in_reset::level(self.request, &self.safe, carries));
        self.connections.push(Connection { name: namer.name(name), carries, from, to, pull });
    }

    fn connect_inputs(&mut self, namer: &mut Namer) {
        let request = self.request;
        let mut ends: BTreeMap<(InputId, u32), Vec<End>> = BTreeMap::new();
        let mut at_once: BTreeMap<InputId, Vec<End>> = BTreeMap::new();
        for (part, chip) in request.chips.iter().enumerate() {
            for signal in &chip.signals {
                let Object::Input(input) = signal.object else { continue };
                let Some(source) = source(&request.division.parts[part], input) else {
                    self.refuse(format!(
                        "part `{}` has no input `{}`",
                        request.division.parts[part].name, signal.name
                    ));
                    continue;
                };
                let end = End { part, pin: signal.pin };
                if let Source::Direct(input) = source {
                    at_once.entry(input).or_default().push(end);
                }
                let Source::Input(input) = source else { continue };
                let Some(declared) = request.net.inputs.get(input) else { continue };
                if !declared.kind.is_handed() {
                    self.refuse(format!(
                        "a chip cannot read `{}`, which the CPU computes during its reaction",
                        declared.name.text
                    ));
                    continue;
                }
                ends.entry((input, signal.bit)).or_default().push(end);
            }
        }
        let direct = match request.division.running {
            Running::Lockstep => direct::direct(request.net, request.division, request.chips),
            Running::Free => request.net.inputs.ids().gather(),
        };
        for ((input, bit), to) in ends {
            let declared = &request.net.inputs[input];
            let name = bit_name(&declared.name.text, declared.ty.is_bool(), bit);
            if direct.contains(&input) {
                let name = namer.name(&name);
                self.direct.push(Direct { name, input, bit, to, is_emergency: false });
                continue;
            }
            self.driven(&name, Carries::Input { input, bit }, to, namer);
        }
        for (input, to) in at_once {
            let name = namer.name(&format!("{}_direct", request.net.inputs[input].name.text));
            self.direct.push(Direct { name, input, bit: 0, to, is_emergency: true });
        }
    }

    fn connect_wires(&mut self, namer: &mut Namer) {
        let request = self.request;
        for wire in &request.division.wires {
            let mut to = Vec::new();
            for (part, input) in &wire.to {
                if *part == self.cpu() {
                    to.push(End { part: *part, pin: NO_PIN });
                    continue;
                }
                // A chip whose logic does not depend on the wire has no pin for it.
                let signals = request.chips.get(*part).map_or(&[][..], |chip| &chip.signals);
                to.extend(
                    pins_of(signals, Object::Input(*input)).map(|pin| End { part: *part, pin }),
                );
            }
            let carries = Carries::Wire(wire.signal);
            if wire.from == self.cpu() {
                self.driven(&wire.name, carries, to, namer);
                continue;
            }
            if to.is_empty() {
                continue;
            }
            let signals = request.chips.get(wire.from).map_or(&[][..], |chip| &chip.signals);
            match pins_of(signals, Object::Output(wire.output)).next() {
                Some(pin) => {
                    let from = End { part: wire.from, pin };
                    let name = namer.name(&wire.name);
                    self.connections.push(Connection { name, carries, from, to, pull: None });
                }
                None => self.refuse(format!(
                    "`{}` has no pin for the wire `{}`",
                    request.division.parts[wire.from].name, wire.name
                )),
            }
        }
    }

    /// Each chip of a net with evolution `stable` tells the CPU whether it moves.
    fn connect_moves(&mut self, namer: &mut Namer) {
        let request = self.request;
        for (part, chip) in request.chips.iter().enumerate() {
            let net = &request.division.parts[part];
            let Some(output) = moves(net) else { continue };
            let name = &net.net.outputs[output].name.text;
            match pins_of(&chip.signals, Object::Output(output)).next() {
                Some(pin) => {
                    let (from, to) = (End { part, pin }, End { part: self.cpu(), pin: NO_PIN });
                    self.connections.push(Connection {
                        name: namer.name(name),
                        carries: Carries::Moves(part),
                        from,
                        to: vec![to],
                        pull: None,
                    });
                }
                None => self.refuse(format!("`{}` has no pin for the wire `{name}`", net.name)),
            }
        }
    }

    /// The CPU tells each chip with something that happens once in a reaction whether another round follows.
    fn connect_more(&mut self, namer: &mut Namer) {
        let request = self.request;
        let (mut name, mut to) = ("more", Vec::new());
        for (part, chip) in request.chips.iter().enumerate() {
            let net = &request.division.parts[part];
            for (input, _) in net.inputs.iter().filter(|(_, source)| **source == Source::More) {
                name = &net.net.inputs[input].name.text;
                let pins = pins_of(&chip.signals, Object::Input(input));
                to.extend(pins.map(|pin| End { part, pin }));
            }
        }
        self.driven(name, Carries::More, to, namer);
    }

    fn connect_outputs(&mut self, namer: &mut Namer) {
        let request = self.request;
        for (part, chip) in request.chips.iter().enumerate() {
            for signal in &chip.signals {
                let Object::Output(id) = signal.object else { continue };
                let shown = request.division.parts[part].outputs.iter().find(|(one, _)| *one == id);
                let Some((_, Shown::Output(output))) = shown else { continue };
                let declared = &request.net.outputs[*output];
                let name = bit_name(&declared.name.text, declared.ty.is_bool(), signal.bit);
                let carries = Carries::Plant { output: *output, bit: signal.bit };
                let from = End { part, pin: signal.pin };
                self.connections.push(Connection {
                    name: namer.name(&name),
                    carries,
                    from,
                    to: Vec::new(),
                    pull: None,
                });
            }
        }
    }

    fn assign_pins(&mut self) {
        let cpu = self.request.cpu;
        let mut used: BTreeSet<u32> = BTreeSet::new();
        let mut chosen: BTreeMap<ConnectionIndex, Pin> = BTreeMap::new();
        for (signal, name) in &self.request.wanted {
            let at = self
                .connections
                .iter()
                .position(|one| one.name == *signal && self.end_of_cpu(one).is_some());
            match (at, cpu.pin(name)) {
                (None, _) => self.refuse(format!("the CPU has no connection `{signal}`")),
                (_, None) => self.refuse(format!("`{}` has no usable pin `{name}`", cpu.name)),
                (Some(at), Some(pin)) if used.insert(pin.number) => _ = chosen.insert(at, pin),
                (_, Some(_)) => self.refuse(format!("pin `{name}` is requested for two signals")),
            }
        }
        // What the CPU reads comes first, because it needs pins that a chip may drive.
        let cpu_part = self.cpu();
        let is_read = |one: &Connection| one.from.part != cpu_part;
        let (reads, drives): (Vec<_>, Vec<_>) = (0..self.connections.len())
            .filter(|at| {
                !chosen.contains_key(at) && self.end_of_cpu(&self.connections[*at]).is_some()
            })
            .partition(|at| is_read(&self.connections[*at]));
        let (n_reads, needed) = (reads.len(), reads.len() + drives.len() + used.len());
        for (at, must_take_5v) in
            reads.into_iter().map(|at| (at, true)).chain(drives.into_iter().map(|at| (at, false)))
        {
            if let Some(pin) = free_pin(cpu, &used, must_take_5v) {
                used.insert(pin.number);
                chosen.insert(at, pin);
            }
        }
        if chosen.len() < needed {
            let n_5v = cpu.pins.iter().filter(|pin| pin.takes_5v).count();
            let message = if needed > cpu.pins.len() {
                let usable = cpu.pins.len();
                format!(
                    "the link needs {needed} pins of the CPU, but `{}` has only {usable} usable pins",
                    cpu.name
                )
            } else {
                format!(
                    "the CPU reads {n_reads} signals from chips, but `{}` has only {n_5v} pins that accept 5 V",
                    cpu.name
                )
            };
            let help = "place related objects on the same part, so that fewer signals connect the parts, choose a CPU with more pins, or save the wire that resets the chips (`--no-reset`)";
            self.findings.push(Diagnostic::error(codes::PINS, message).help(help));
        }
        for (at, pin) in chosen {
            let connection = &mut self.connections[at];
            if connection.from.part == cpu_part {
                connection.from.pin = pin.number;
            }
            for end in connection.to.iter_mut().filter(|end| end.part == cpu_part) {
                end.pin = pin.number;
            }
        }
    }

    fn end_of_cpu(&self, connection: &Connection) -> Option<End> {
        let mut ends = [connection.from].into_iter().chain(connection.to.iter().copied());
        ends.find(|end| end.part == self.cpu())
    }
}

/// The first pin that is free.
fn free_pin(cpu: &Cpu, used: &BTreeSet<u32>, must_take_5v: bool) -> Option<Pin> {
    let mut free = cpu.pins.iter().filter(|pin| !used.contains(&pin.number));
    free.find(|pin| pin.takes_5v || !must_take_5v).copied()
}

fn source(part: &PartNet, input: InputId) -> Option<Source> {
    part.inputs.iter().find(|(id, _)| *id == input).map(|(_, source)| *source)
}

/// The output of a part that shows whether it moves.
fn moves(part: &PartNet) -> Option<OutputId> {
    part.outputs.iter().find(|(_, shown)| **shown == Shown::Moves).map(|(id, _)| id)
}

fn pins_of(signals: &[ChipSignal], object: Object) -> impl Iterator<Item = u32> + '_ {
    signals.iter().filter(move |signal| signal.object == object).map(|signal| signal.pin)
}

fn bit_name(name: &str, is_bool: bool, bit: u32) -> String {
    if is_bool { name.to_owned() } else { format!("{name}_{bit}") }
}

/// The level in row 0, in which every input is 0 or the nearest value of its range.
fn level_of_row_0(net: &Net, carries: Carries) -> bool {
    let Carries::Input { input, bit } = carries else { return false };
    let ty = net.inputs[input].ty;
    let value = ty.saturate(0).abs_diff(ty.bounds().0);
    value.checked_shr(bit).unwrap_or(0) & 1 == 1
}

/// The reaction of the part on the CPU. Before it, the part is told whether a chip moves; after it, the part is asked whether it moves itself.
fn reaction(part: &PartNet) -> impl Iterator<Item = Act> {
    let is_more = |(_, source): &(InputId, &Source)| **source == Source::More;
    let told = part.inputs.iter().find(is_more).map(|(to, _)| Act::HandMore { to });
    let asked = moves(part).map(|output| Act::AskCpu { output });
    told.into_iter().chain([Act::React]).chain(asked)
}

/// The acts of a round, without unnecessary `Settle` acts.
fn acts(request: &Request<'_>, connections: &[Connection], direct: &[Direct]) -> Vec<Act> {
    let cpu = request.chips.len();
    let mut acts = vec![Act::Latch];
    let Some(part) = request.division.parts.get(cpu) else { return acts };
    for (to, source) in part.inputs.iter() {
        if let Source::Input(from) = *source
            && part.net.inputs[to].kind.is_handed()
            && direct.iter().all(|one| one.is_emergency || one.input != from)
        {
            acts.push(Act::Hand { from, to });
        }
    }
    let all = || connections.iter().enumerate();
    let put = |(connection, one): (ConnectionIndex, &Connection)| {
        let value = match one.carries {
            Carries::Input { input, bit } => Put::Input { input, bit },
            Carries::Tick => Put::Tick,
            _ => return None,
        };
        (one.from.part == cpu).then_some(Act::Put { connection, value })
    };
    let mut puts: Vec<Act> = all().filter_map(put).collect();
    // The CPU reads nothing from the chips of a statechart. They get the inputs together with the states that the reaction reaches, not before it.
    let mut late = Vec::new();
    let target = if request.net.settings.policy.is_statechart() { &mut late } else { &mut acts };
    target.append(&mut puts);
    let mut is_unsettled = matches!(acts.last(), Some(Act::Put { .. }));
    // The wires of a chip without such inputs depend on its state alone.
    let follows = |chip: &PartIndex| {
        let is_input =
            |one: &Connection| matches!(one.carries, Carries::Input { .. } | Carries::Tick);
        connections.iter().any(|one| is_input(one) && one.to.iter().any(|end| end.part == *chip))
    };
    let mut gets = Vec::new();
    let mut is_followed = false;
    for wire in &request.division.wires {
        let carries = Carries::Wire(wire.signal);
        let reader = wire.to.iter().find(|(part, _)| *part == cpu);
        let (Some((_, to)), Some((connection, _))) =
            (reader, all().find(|(_, one)| one.carries == carries))
        else {
            continue;
        };
        gets.push(Act::Get { connection, to: *to });
        is_followed |= follows(&wire.from);
    }
    for (connection, one) in all() {
        if let Carries::Moves(part) = one.carries {
            gets.push(Act::AskChip { connection });
            is_followed |= follows(&part);
        }
    }
    if is_unsettled && is_followed {
        acts.push(Act::Settle);
        is_unsettled = false;
    }
    acts.append(&mut gets);
    acts.extend(reaction(part));
    is_unsettled |= !late.is_empty();
    if let Some((connection, _)) = all().find(|(_, one)| one.carries == Carries::More) {
        acts.push(Act::Put { connection, value: Put::More });
        is_unsettled = true;
    }
    acts.append(&mut late);
    for wire in request.division.wires.iter().filter(|wire| wire.from == cpu) {
        let carries = Carries::Wire(wire.signal);
        if let Some((connection, _)) = all().find(|(_, one)| one.carries == carries) {
            acts.push(Act::Put { connection, value: Put::Output(wire.output) });
            is_unsettled = true;
        }
    }
    if is_unsettled {
        acts.push(Act::Settle);
    }
    if let Some((connection, _)) = all().find(|(_, one)| one.carries == Carries::Clock) {
        acts.push(Act::Clock { connection });
        acts.push(Act::Settle);
    }
    acts
}
