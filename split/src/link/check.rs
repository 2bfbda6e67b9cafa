//! Checks that the acts of a link make one round. It executes them symbolically: the value of a pin is the name of a signal.
//!
//! The check knows what a chip expects on each of its pins, from the division and the fitting alone. It takes from the link only the connections and the acts. Every
//! pin begins with the value of the last round. A value is *settled* after a `Settle` that follows the last change of what it depends on: a pin of the CPU depends on
//! its `Put`, and a wire of a chip on the latched inputs and the tick of that chip, but on no wire (semantics §10.6).

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Gather;
use grafsynth_ir::division::{Division, PartIndex, Shown, Source};
use grafsynth_ir::net::{
    Driver, Expr, InputId, InputKind, Leaf, Net, Output, Property, PropertyLeaf, PropertyRole,
};

use super::breach::{Breach, Pins, Value, Why, expectations, label};
use super::{Act, Carries, ChipPins, Connection, ConnectionIndex, Direct, End, Link, Put, Start};
use crate::pieces::reads;

/// Checks that the acts of a link make one round of the division of a net (semantics §10.3), and that only inputs without an effect on states and wires bypass the CPU.
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
    let mut run = Run::new(link, net, division, chips).map_err(nowhere)?;
    for (at, act) in link.acts.iter().enumerate() {
        run.act(*act).map_err(|why| Breach { at: Some(at), why })?;
    }
    run.end().map_err(nowhere)
}

/// What happens at each pin of the chips, and what has happened so far.
struct Run<'l> {
    connections: &'l [Connection],
    division: &'l Division,
    cpu: PartIndex,
    /// The inputs that bypass the CPU, which its part does not read.
    direct: BTreeSet<InputId>,
    /// What each input pin of a chip must carry at the clock.
    wanted: BTreeMap<End, Value>,
    /// The connection of each pin.
    at: BTreeMap<End, ConnectionIndex>,
    /// The value of each connection.
    values: Vec<Value>,
    /// Whether it is settled.
    is_settled: Vec<bool>,
    /// The values of the inputs of the part on the CPU.
    handed: BTreeMap<InputId, Value>,
    is_latched: bool,
    has_reacted: bool,
    is_clocked: bool,
    /// Whether the outputs have settled after the clock.
    is_over: bool,
    /// The parts that were asked whether they move.
    asked: BTreeSet<PartIndex>,
}

impl<'l> Run<'l> {
    fn new(
        link: &'l Link,
        net: &Net,
        division: &'l Division,
        chips: &[ChipPins],
    ) -> Result<Self, Why> {
        let connections = &link.connections;
        let cpu = chips.len();
        if division.parts.len() != cpu + 1 {
            return Err(Why::Parts);
        }
        let (mut wanted, shown) = expectations(division, chips)?;
        bypass(&link.direct, net, division, chips, &mut wanted)?;
        let mut at = BTreeMap::new();
        let mut values = Vec::new();
        for (index, one) in connections.iter().enumerate() {
            for end in [one.from].iter().chain(&one.to) {
                if at.insert(*end, index).is_some() {
                    return Err(Why::PinTwice(*end));
                }
            }
            let drives = one.from.part == cpu;
            let value = if drives {
                // The resistor and the initialisation before the first clock give it this level.
                match one.carries == Carries::Reset && starts_high(link, index) {
                    true => Value::Run,
                    false => Value::Old,
                }
            } else {
                *shown.get(&one.from).ok_or(Why::Direction(one.from))?
            };
            let is_reader =
                |end: &&End| if end.part == cpu { !drives } else { wanted.contains_key(end) };
            if let Some(end) = one.to.iter().find(|end| !is_reader(end)) {
                return Err(Why::Direction(*end));
            }
            if !drives && value != label(one.carries) {
                return Err(Why::Label(index));
            }
            values.push(value);
        }
        if let Some(end) = wanted.keys().find(|end| !at.contains_key(end)) {
            return Err(Why::Open(*end));
        }
        once_each(link, division)?;
        let is_settled = vec![true; connections.len()];
        let handed = BTreeMap::new();
        let mut run = Run {
            connections,
            division,
            cpu,
            direct: bypassing(&link.direct).collect(),
            wanted,
            at,
            values,
            is_settled,
            handed,
            is_latched: false,
            has_reacted: false,
            is_clocked: false,
            is_over: false,
            asked: BTreeSet::new(),
        };
        // The outputs of a chip still belong to the inputs of the last round.
        for chip in 0..cpu {
            run.unsettle(chip);
        }
        Ok(run)
    }

    fn act(&mut self, act: Act) -> Result<(), Why> {
        if self.is_clocked && act != Act::Settle {
            return Err(Why::Late);
        }
        match act {
            Act::Latch => once(&mut self.is_latched),
            Act::Hand { from, to } => {
                let is_there = self.division.parts[self.cpu].net.inputs.get(to).is_some();
                is_there.then_some(()).ok_or(Why::Unknown)?;
                self.is_latched.then_some(()).ok_or(Why::Early)?;
                self.handed.insert(to, Value::Input(from, 0));
                Ok(())
            }
            Act::Put { connection, value } => self.put(connection, value),
            Act::Settle => {
                self.settle();
                Ok(())
            }
            Act::Get { connection, to } => self.get(connection, to),
            Act::React => {
                once(&mut self.has_reacted)?;
                self.react()
            }
            Act::HandMore { to } => {
                let is_there = self.division.parts[self.cpu].net.inputs.get(to).is_some();
                is_there.then_some(()).ok_or(Why::Unknown)?;
                // The part on the CPU knows its own moves.
                self.all_asked(self.cpu).then_some(()).ok_or(Why::Early)?;
                if self.has_reacted {
                    return Err(Why::Late);
                }
                self.handed.insert(to, Value::More);
                Ok(())
            }
            Act::AskChip { connection } => {
                let Value::Moves(part) = self.read(connection)? else { return Err(Why::Unknown) };
                self.asked.insert(part);
                Ok(())
            }
            Act::AskCpu { output } => {
                self.has_reacted.then_some(()).ok_or(Why::Early)?;
                let mut shown = self.division.parts[self.cpu].outputs.iter();
                if !shown.any(|(id, shown)| id == output && *shown == Shown::Moves) {
                    return Err(Why::Unknown);
                }
                self.asked.insert(self.cpu);
                Ok(())
            }
            Act::Clock { connection } => {
                let one = self.connections.get(connection).ok_or(Why::Unknown)?;
                if one.from.part != self.cpu || one.carries != Carries::Clock {
                    return Err(Why::Unknown);
                }
                if !self.has_reacted {
                    return Err(Why::Early);
                }
                self.values[connection] = Value::Clock;
                self.edge()?;
                self.is_clocked = true;
                Ok(())
            }
        }
    }

    fn put(&mut self, connection: ConnectionIndex, put: Put) -> Result<(), Why> {
        let one = self.connections.get(connection).ok_or(Why::Unknown)?;
        if one.from.part != self.cpu {
            return Err(Why::Unknown);
        }
        let (value, may) = match put {
            Put::Input { input, bit } => (Value::Input(input, bit), self.is_latched),
            Put::Tick => (Value::Tick, true),
            Put::More => (Value::More, self.all_asked(self.cpu + 1)),
            Put::Output(output) => {
                let mut shown = self.division.parts[self.cpu].outputs.iter();
                match shown.find(|(id, _)| *id == output) {
                    Some((_, Shown::Wire(signal))) => (Value::Wire(*signal), self.has_reacted),
                    Some((_, Shown::Output(_) | Shown::Moves)) | None => return Err(Why::Unknown),
                }
            }
        };
        if !may {
            return Err(Why::Early);
        }
        if value != label(one.carries) {
            return Err(Why::Label(connection));
        }
        self.values[connection] = value;
        self.is_settled[connection] = false;
        for end in &one.to {
            if !matches!(self.wanted.get(end), Some(Value::Wire(_) | Value::More)) {
                self.unsettle(end.part);
            }
        }
        Ok(())
    }

    /// Marks the wires of a chip as not settled after a change of its inputs, if they depend on inputs at all.
    fn unsettle(&mut self, chip: PartIndex) {
        if self.followed(chip).next().is_none() {
            return;
        }
        for (one, is_settled) in self.connections.iter().zip(&mut self.is_settled) {
            if one.from.part == chip {
                *is_settled = false;
            }
        }
    }

    /// The pins on which the wires of a chip depend, with what they must carry.
    fn followed(&self, chip: PartIndex) -> impl Iterator<Item = (End, Value)> + '_ {
        let of_chip = self.wanted.iter().filter(move |(end, _)| end.part == chip);
        of_chip
            .filter(|(_, value)| matches!(value, Value::Input(..) | Value::Tick))
            .map(|(end, value)| (*end, *value))
    }

    fn settle(&mut self) {
        self.is_over = self.is_clocked;
        let ready: Vec<bool> = (self.connections.iter())
            .map(|one| {
                one.from.part == self.cpu
                    || self
                        .followed(one.from.part)
                        .all(|(end, value)| self.value_at(end) == Some(value))
            })
            .collect();
        for (is_settled, ready) in self.is_settled.iter_mut().zip(ready) {
            *is_settled |= ready;
        }
    }

    fn value_at(&self, end: End) -> Option<Value> {
        self.at.get(&end).map(|at| self.values[*at])
    }

    fn get(&mut self, connection: ConnectionIndex, to: InputId) -> Result<(), Why> {
        let value = self.read(connection)?;
        if self.division.parts[self.cpu].net.inputs.get(to).is_none() {
            return Err(Why::Unknown);
        }
        if self.has_reacted {
            return Err(Why::Late);
        }
        self.handed.insert(to, value);
        Ok(())
    }

    /// The value that the CPU reads from a connection.
    fn read(&self, connection: ConnectionIndex) -> Result<Value, Why> {
        let one = self.connections.get(connection).ok_or(Why::Unknown)?;
        if !one.to.iter().any(|end| end.part == self.cpu) {
            return Err(Why::Unknown);
        }
        if !self.is_settled[connection] {
            return Err(Why::Unsettled(connection));
        }
        Ok(self.values[connection])
    }

    fn react(&self) -> Result<(), Why> {
        if !self.is_latched {
            return Err(Why::Early);
        }
        let part = &self.division.parts[self.cpu];
        for (input, source) in part.inputs.iter() {
            let wanted = match *source {
                // Functions of the program and events of the chart itself are no members of its inputs.
                Source::Input(_) if !part.net.inputs[input].kind.is_handed() => continue,
                Source::Input(from) if self.direct.contains(&from) => continue,
                Source::Input(from) => Value::Input(from, 0),
                Source::Direct(from) => Value::Direct(from, 0),
                Source::Wire(signal) => Value::Wire(signal),
                Source::More => Value::More,
            };
            if self.handed.get(&input) != Some(&wanted) {
                return Err(Why::CpuInput(input));
            }
        }
        Ok(())
    }

    /// The clock edge of the chips.
    fn edge(&self) -> Result<(), Why> {
        for (end, wanted) in &self.wanted {
            let at = *self.at.get(end).ok_or(Why::Open(*end))?;
            if self.values[at] != *wanted || !self.is_settled[at] {
                return Err(Why::ChipInput(*end));
            }
        }
        Ok(())
    }

    /// True if each of the first `n` parts that can move was asked whether it does.
    fn all_asked(&self, n: usize) -> bool {
        let shows = |shown: &Shown| *shown == Shown::Moves;
        let parts = self.division.parts.iter().enumerate().take(n);
        let moving = parts.filter(|(_, part)| part.outputs.values().any(shows));
        moving.map(|(at, _)| at).all(|at| self.asked.contains(&at))
    }

    fn end(&self) -> Result<(), Why> {
        let has_clock = self.wanted.values().any(|value| *value == Value::Clock);
        if !has_clock {
            // Without registers, the chips are outputs of their inputs, which must be there at the end.
            self.edge()?;
        }
        let is_asked = self.all_asked(self.cpu + 1);
        let is_over = self.is_over || !has_clock;
        let is_complete = self.is_latched && self.has_reacted && is_over && is_asked;
        is_complete.then_some(()).ok_or(Why::Missing)
    }
}

/// Checks that exactly the extern conditions of a reaction of several rounds are called once.
fn once_each(link: &Link, division: &Division) -> Result<(), Why> {
    let part = division.parts.last().ok_or(Why::Parts)?;
    let is_extern = |id: InputId| part.net.inputs[id].kind == InputKind::Extern;
    let called: BTreeSet<Source> = part
        .inputs
        .iter()
        .filter(|(id, _)| link.most_rounds.is_some() && is_extern(*id))
        .map(|(_, source)| *source)
        .gather();
    let given: BTreeSet<Source> = link.once.iter().map(|id| Source::Input(*id)).gather();
    (called == given).then_some(()).ok_or(Why::Once)
}

/// Removes the pins that the plant drives from what the CPU must put on them.
///
/// The level of such a pin may change at any moment of the round. So no flip-flop, no wire and no output that belongs to the moment before the clock may depend on it, no
/// part on the CPU may read it, and an assumption of the net may compare it only with other such pins, which have their levels at the same moment.
fn bypass(
    direct: &[Direct],
    net: &Net,
    division: &Division,
    chips: &[ChipPins],
    wanted: &mut Pins,
) -> Result<(), Why> {
    for one in direct {
        for end in &one.to {
            match wanted.remove(end) {
                Some(Value::Input(input, bit))
                    if !one.is_emergency && (input, bit) == (one.input, one.bit) => {}
                Some(Value::Direct(input, bit))
                    if one.is_emergency && (input, bit) == (one.input, one.bit) => {}
                _ => return Err(Why::Direction(*end)),
            }
        }
    }
    at_once(division, chips)?;
    let all: BTreeSet<InputId> = bypassing(direct).collect();
    let is_direct = |value: &Value| matches!(value, Value::Input(input, _) if all.contains(input));
    for input in &all {
        let latched = Err(Why::Latched(*input));
        if net.inputs.get(*input).is_none_or(|declared| declared.kind != InputKind::Pin) {
            return latched;
        }
        for (at, part) in division.parts.iter().enumerate() {
            for (own, _) in
                part.inputs.iter().filter(|(_, source)| **source == Source::Input(*input))
            {
                let is_held = match chips.get(at) {
                    Some(chip) => chip.held.contains(&own) || is_timed(&part.net, own),
                    None => reads(&part.net, own),
                };
                if is_held {
                    return latched;
                }
            }
        }
        let reads = |property: &Property, input: InputId| {
            property.never.leaves().any(|leaf| *leaf == PropertyLeaf::Net(Leaf::Input(input)))
        };
        let compared = net
            .properties
            .iter()
            .filter(|one| one.role == PropertyRole::Assume && reads(one, *input));
        let mut others = compared.flat_map(|one| one.never.leaves());
        if others.any(
            |leaf| !matches!(leaf, PropertyLeaf::Net(Leaf::Input(other)) if all.contains(other)),
        ) {
            return latched;
        }
    }
    match wanted.values().find(|value| is_direct(value)) {
        Some(Value::Input(input, _)) => Err(Why::Latched(*input)),
        _ => Ok(()),
    }
}

/// True if a connection is high in the initialisation, and low in all rounds.
fn starts_high(link: &Link, at: ConnectionIndex) -> bool {
    let is_low = link.start.contains(&(at, Start::Level(false)));
    is_low && link.connections.get(at).is_some_and(|one| one.pull == Some(true))
}

/// The inputs that are wired to chips alone.
fn bypassing(direct: &[Direct]) -> impl Iterator<Item = InputId> + '_ {
    direct.iter().filter(|one| !one.is_emergency).map(|one| one.input)
}

/// Checks that no flip-flop and no wire of a chip depends on the pin of an emergency, which may change at any moment of the round.
fn at_once(division: &Division, chips: &[ChipPins]) -> Result<(), Why> {
    for (part, chip) in division.parts.iter().zip(chips) {
        for (own, source) in part.inputs.iter() {
            if let Source::Direct(input) = *source
                && chip.moving.contains(&own)
            {
                return Err(Why::Latched(input));
            }
        }
    }
    Ok(())
}

/// True if an output of a part shows an input at a certain moment: before the clock edge, at it, or as part of an emergency, whose level in reset makes the outputs
/// safe.
fn is_timed(part: &Net, input: InputId) -> bool {
    let reads = |expr: &Expr| expr.leaves().any(|leaf| *leaf == Leaf::Input(input));
    let emergency = part.emergency.iter().any(|emergency| reads(&emergency.condition));
    let of_moment =
        |output: &&Output| output.registered || !matches!(output.driver, Driver::Continuous(_));
    let outputs = part.outputs.values().filter(of_moment);
    emergency || outputs.flat_map(|output| output.driver.exprs()).any(reads)
}

fn once(done: &mut bool) -> Result<(), Why> {
    if std::mem::replace(done, true) { Err(Why::Again) } else { Ok(()) }
}
