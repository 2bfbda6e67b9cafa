//! Links of parts that run on their own (semantics §10.7): one reaction of the CPU, and the check that each line of the model is there.
//!
//! ```text
//! plant ──► chip, CPU          each part reads the inputs that it needs from pins of its own
//! chip  ──► CPU, other chips   wires, each driven by a flip-flop
//! CPU   ──► chips              wires, each with a resistor for the level of row 0 while the CPU is in reset
//! CPU   ──► chips              reset, with a resistor that holds the chips in their first states until the CPU has started
//! oscillator ──► chips
//! ```
//!
//! The proof of §10.7 holds for any delays, so the check asks for nothing about times. It asks that every line starts and ends where the model has it, that an input of a
//! chip passes through two flip-flops before anything reads it, that its outputs change only with its reactions, and that the CPU reads each wire once before a reaction and shows each of its own after it.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::{Division, PartIndex, Shown, Signal, Source};
use grafsynth_ir::net::{InputId, Net};

use super::breach::{Breach, Pins, Value, Why, expectations, label};
use super::{
    Act, Carries, ChipPins, Connection, ConnectionIndex, End, Link, Put, Request, SYNCHRONISERS,
    Start,
};

/// One reaction of the CPU.
pub(super) fn acts(request: &Request<'_>, connections: &[Connection]) -> Vec<Act> {
    let cpu = request.chips.len();
    let mut acts = vec![Act::Latch];
    let Some(part) = request.division.parts.get(cpu) else { return acts };
    let at =
        |signal: Signal| connections.iter().position(|one| one.carries == Carries::Wire(signal));
    for (to, source) in part.inputs.iter() {
        acts.extend(match *source {
            Source::Input(from) if part.net.inputs[to].kind.is_handed() => {
                Some(Act::Hand { from, to })
            }
            Source::Input(_) | Source::Direct(_) | Source::More => None,
            Source::Wire(signal) => at(signal).map(|connection| Act::Get { connection, to }),
        });
    }
    acts.push(Act::React);
    for wire in request.division.wires.iter().filter(|wire| wire.from == cpu) {
        let value = Put::Output(wire.output);
        acts.extend(at(wire.signal).map(|connection| Act::Put { connection, value }));
    }
    acts
}

/// Checks that the lines of the model are there, and that the acts are one reaction of the CPU.
///
/// # Errors
/// The first rule that is broken.
pub(super) fn check(
    link: &Link,
    net: &Net,
    division: &Division,
    chips: &[ChipPins],
) -> Result<(), Breach> {
    let nowhere = |why| Breach { at: None, why };
    if division.parts.len() != chips.len() + 1 {
        return Err(nowhere(Why::Parts));
    }
    lines(link, net, division, chips).map_err(nowhere)?;
    let mut reaction = Reaction { link, division, done: BTreeSet::new(), handed: BTreeMap::new() };
    for (at, act) in link.acts.iter().enumerate() {
        reaction.act(*act).map_err(|why| Breach { at: Some(at), why })?;
    }
    reaction.end().map_err(nowhere)
}

fn lines(link: &Link, net: &Net, division: &Division, chips: &[ChipPins]) -> Result<(), Why> {
    let cpu = chips.len();
    let (wanted, shown) = expectations(division, chips)?;
    let mut carried = Pins::new();
    let mut drivers: BTreeSet<End> = BTreeSet::new();
    let mut reach = |end: End, value: Value| match carried.insert(end, value) {
        Some(_) => Err(Why::PinTwice(end)),
        None => Ok(()),
    };
    for end in &link.oscillator {
        reach(*end, Value::Clock)?;
    }
    for one in &link.direct {
        one.to.iter().try_for_each(|end| reach(*end, Value::Input(one.input, one.bit)))?;
    }
    for (at, one) in link.connections.iter().enumerate() {
        drivers.insert(one.from).then_some(()).ok_or(Why::PinTwice(one.from))?;
        let value = label(one.carries);
        if one.from.part == cpu {
            match one.carries {
                Carries::Reset => starts_chips(link, at)?,
                _ => from_cpu(net, division, (at, one))?,
            }
        } else {
            match shown.get(&one.from) {
                Some(is) if *is == value => {}
                Some(_) => return Err(Why::Label(at)),
                None => return Err(Why::Direction(one.from)),
            }
            let chip = chips.get(one.from.part);
            let is_registered = chip.is_some_and(|chip| chip.registered.contains(&one.from.pin));
            if matches!(value, Value::Wire(_)) && !is_registered {
                return Err(Why::Unregistered(one.from));
            }
            if chip.is_none_or(|chip| chip.following.contains(&one.from.pin)) {
                return Err(Why::Follows(one.from));
            }
        }
        one.to.iter().try_for_each(|end| reach(*end, value))?;
    }
    for (end, value) in &carried {
        match (wanted.get(end), value) {
            (Some(wanted), _) if wanted == value => {}
            // What the CPU reads is decided by its acts.
            (None, Value::Wire(_)) if end.part == cpu => {}
            (_, Value::Clock) => return Err(Why::Clock(*end)),
            _ => return Err(Why::Direction(*end)),
        }
        if drivers.contains(end) {
            return Err(Why::PinTwice(*end));
        }
    }
    for (end, value) in &wanted {
        match value {
            Value::Tick => return Err(Why::Clock(*end)),
            _ if !carried.contains_key(end) => return Err(Why::Open(*end)),
            Value::Clock => {}
            _ => {
                let stages = chips.get(end.part).and_then(|chip| chip.synchronisers.get(&end.pin));
                if stages.is_none_or(|stages| *stages < SYNCHRONISERS) {
                    return Err(Why::Unsynchronised(*end));
                }
            }
        }
    }
    Ok(())
}

/// A wire of the CPU: it shows a step of the part on the CPU, and has the level of row 0 while the CPU is in reset.
fn from_cpu(
    net: &Net,
    division: &Division,
    (at, one): (ConnectionIndex, &Connection),
) -> Result<(), Why> {
    let Carries::Wire(Signal::Active(step)) = one.carries else { return Err(Why::Label(at)) };
    if division.owners.steps[step] + 1 != division.parts.len() {
        return Err(Why::Label(at));
    }
    let level = net.steps[step].is_initial;
    (one.pull == Some(level)).then_some(()).ok_or(Why::Pull(at))
}

/// The reset: high while the CPU is in reset, and low after its initialisation, which waits for the chips before.
fn starts_chips(link: &Link, at: ConnectionIndex) -> Result<(), Why> {
    let starts = link.start.iter().filter(|(one, _)| *one == at).map(|(_, start)| *start);
    let is_released = starts.collect::<Vec<_>>() == [Start::Level(false)];
    (link.connections[at].pull == Some(true) && is_released).then_some(()).ok_or(Why::Pull(at))
}

/// What has happened in a reaction of the CPU.
struct Reaction<'l> {
    link: &'l Link,
    division: &'l Division,
    /// The acts that may happen only once: those with a connection by its index.
    done: BTreeSet<Once>,
    handed: BTreeMap<InputId, Source>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Once {
    Latch,
    React,
    Get(ConnectionIndex),
    Put(ConnectionIndex),
}

impl Reaction<'_> {
    fn cpu(&self) -> PartIndex {
        self.division.parts.len() - 1
    }

    fn once(&mut self, what: Once) -> Result<(), Why> {
        self.done.insert(what).then_some(()).ok_or(Why::Again)
    }

    fn act(&mut self, act: Act) -> Result<(), Why> {
        let has_reacted = self.done.contains(&Once::React);
        let cpu = self.cpu();
        match act {
            Act::Latch if has_reacted => Err(Why::Late),
            Act::Latch => self.once(Once::Latch),
            Act::Hand { from, to } => {
                if !self.done.contains(&Once::Latch) {
                    return Err(Why::Early);
                }
                self.hand(to, Source::Input(from), has_reacted)
            }
            Act::Get { connection, to } => {
                let one = self.link.connections.get(connection).ok_or(Why::Unknown)?;
                let Carries::Wire(signal) = one.carries else { return Err(Why::Unknown) };
                if one.from.part == cpu || !one.to.iter().any(|end| end.part == cpu) {
                    return Err(Why::Unknown);
                }
                self.once(Once::Get(connection))?;
                self.hand(to, Source::Wire(signal), has_reacted)
            }
            Act::React => {
                self.once(Once::React)?;
                let part = &self.division.parts[cpu];
                for (input, source) in part.inputs.iter() {
                    let is_handed = part.net.inputs[input].kind.is_handed();
                    if is_handed && self.handed.get(&input) != Some(source) {
                        return Err(Why::CpuInput(input));
                    }
                }
                Ok(())
            }
            Act::Put { connection, value: Put::Output(output) } => {
                let one = self.link.connections.get(connection).ok_or(Why::Unknown)?;
                let mut shown = self.division.parts[cpu].outputs.iter();
                match shown.find(|(id, _)| *id == output) {
                    Some((_, Shown::Wire(signal))) if one.from.part == cpu => {
                        if one.carries != Carries::Wire(*signal) {
                            return Err(Why::Label(connection));
                        }
                    }
                    _ => return Err(Why::Unknown),
                }
                if !has_reacted {
                    return Err(Why::Early);
                }
                self.once(Once::Put(connection))
            }
            Act::Settle => Ok(()),
            // The CPU passes nothing on, asks nobody and clocks nothing.
            Act::Put { .. }
            | Act::HandMore { .. }
            | Act::AskChip { .. }
            | Act::AskCpu { .. }
            | Act::Clock { .. } => Err(Why::Unknown),
        }
    }

    fn hand(&mut self, to: InputId, source: Source, has_reacted: bool) -> Result<(), Why> {
        if has_reacted {
            return Err(Why::Late);
        }
        match self.handed.insert(to, source) {
            Some(_) => Err(Why::Again),
            None => Ok(()),
        }
    }

    fn end(&self) -> Result<(), Why> {
        let cpu = self.cpu();
        let mut own = self.link.connections.iter().enumerate();
        let is_put = |at| self.done.contains(&Once::Put(at));
        let is_needed = |one: &Connection| one.from.part == cpu && one.carries != Carries::Reset;
        let all_put = own.all(|(at, one)| !is_needed(one) || is_put(at));
        let has_reacted = [Once::Latch, Once::React].iter().all(|one| self.done.contains(one));
        (has_reacted && all_put).then_some(()).ok_or(Why::Missing)
    }
}
