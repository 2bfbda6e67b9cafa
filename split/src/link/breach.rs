//! The rules of a link that can be broken, and what its pins carry.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use grafsynth_ir::division::{Division, PartIndex, Shown, Signal, Source};
use grafsynth_ir::net::{InputId, OutputId};

use super::{Carries, ChipPins, ConnectionIndex, End, Object, SYNCHRONISERS};

/// Where a link breaks a rule, and which.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Breach {
    /// The index of the act that breaks the rule; `None` if a connection breaks it, or if something is missing at the end.
    pub at: Option<usize>,
    /// The reason.
    pub why: Why,
}

/// A rule that a link breaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// The division does not have the parts of the chips and a CPU.
    Parts,
    /// A pin is listed in two connections, or twice in one.
    PinTwice(End),
    /// An input of a chip is not connected.
    Open(End),
    /// A connection is driven by an input, or read by an output or by a pin that the chip does not use.
    Direction(End),
    /// A connection is labelled with a different signal from the one that its pins carry.
    Label(ConnectionIndex),
    /// An input that is wired to a chip without the CPU has an effect on more than combinational outputs, is also passed on (except for an emergency), or is not a
    /// pin of the plant.
    Latched(InputId),
    /// An input of a chip that runs on its own does not pass through two synchronising flip-flops.
    Unsynchronised(End),
    /// A wire of a chip that runs on its own is not driven by a flip-flop.
    Unregistered(End),
    /// An output of a chip that runs on its own follows an input between two reactions.
    Follows(End),
    /// A chip that runs on its own has no clock, or something else has one.
    Clock(End),
    /// A resistor does not give a wire the level of row 0.
    Pull(ConnectionIndex),
    /// An act names an unknown connection or object, or the wrong end of a connection.
    Unknown,
    /// An act is repeated.
    Again,
    /// An act comes before another one that it depends on: inputs before they are latched, outputs or the clock before the reaction.
    Early,
    /// An act comes after the clock, or a wire is read after the reaction.
    Late,
    /// A wire is read before the chip that drives it has settled.
    Unsettled(ConnectionIndex),
    /// An input of the part on the CPU does not have the value of this round at its reaction.
    CpuInput(InputId),
    /// At the clock edge, a pin of a chip does not have its settled value of this round.
    ChipInput(End),
    /// An extern condition is called in each round, or the link provides a function that the part on the CPU does not call.
    Once,
    /// At the end, the inputs were not latched, the CPU has not reacted, the chips received no clock edge, their outputs have not settled, or a part was not asked
    /// whether it moves.
    Missing,
}

impl fmt::Display for Breach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(at) = self.at {
            write!(f, "operation {}: ", at + 1)?;
        }
        match self.why {
            Why::Parts => {
                f.write_str("the division does not have one part for each chip and one for the CPU")
            }
            Why::PinTwice(end) => write!(f, "{end} is connected twice"),
            Why::Open(end) => write!(f, "{end} is not connected"),
            Why::Direction(end) => write!(f, "{end} has the wrong direction"),
            Why::Label(at) => {
                write!(
                    f,
                    "connection {} carries a different signal from the one in its label",
                    at + 1
                )
            }
            Why::Latched(input) => write!(
                f,
                "input {} is wired to a chip without the CPU, but something that must be latched depends on it",
                input.index() + 1
            ),
            Why::Unsynchronised(end) => {
                write!(f, "{end} does not pass through {SYNCHRONISERS} synchronising flip-flops")
            }
            Why::Unregistered(end) => write!(f, "{end} is not driven by a flip-flop"),
            Why::Follows(end) => write!(f, "{end} follows an input between two reactions"),
            Why::Clock(end) => write!(f, "{end} has no clock, or should have none"),
            Why::Pull(at) => {
                write!(
                    f,
                    "the resistor of connection {} does not give it the level of row 0",
                    at + 1
                )
            }
            Why::Unknown => f.write_str("unknown connection or object"),
            Why::Again => f.write_str("it is repeated in this round"),
            Why::Early => f.write_str("it comes before an operation that it depends on"),
            Why::Late => f.write_str("it comes after the clock edge or the reaction"),
            Why::Unsettled(at) => write!(f, "connection {} is read before it has settled", at + 1),
            Why::CpuInput(input) => write!(
                f,
                "input {} of the CPU does not have the value of this round",
                input.index() + 1
            ),
            Why::ChipInput(end) => {
                write!(f, "{end} does not have the value of this round at the clock edge")
            }
            Why::Once => f.write_str("an extern condition is not called once in a reaction"),
            Why::Missing => f.write_str("the round is incomplete"),
        }
    }
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pin {} of part {}", self.pin, self.part + 1)
    }
}

/// The value on a pin or in a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Value {
    /// The value of an earlier round, or no value.
    Old,
    /// A bit of an input of the net, latched in this round.
    Input(InputId, u32),
    /// A bit of an input of the net, as its pin shows it at every moment.
    Direct(InputId, u32),
    /// Whether this round has a tick.
    Tick,
    /// The level with which a chip is not reset.
    Run,
    /// What a wire shows in this round.
    Wire(Signal),
    /// Whether any transition of a part fires in this round.
    Moves(PartIndex),
    /// Whether any part moves in this round; in the part on the CPU, whether a chip does.
    More,
    /// The level of the clock.
    Clock,
    /// A bit of an output to the plant.
    Plant(OutputId, u32),
}

/// The values of pins.
pub(super) type Pins = BTreeMap<End, Value>;

/// What each input pin of the chips expects, and what each output pin shows.
pub(super) fn expectations(division: &Division, chips: &[ChipPins]) -> Result<(Pins, Pins), Why> {
    let (mut wanted, mut shown) = (Pins::new(), Pins::new());
    let mut used = BTreeSet::new();
    for (part, chip) in chips.iter().enumerate() {
        let net = &division.parts[part];
        for signal in &chip.signals {
            let end = End { part, pin: signal.pin };
            if !used.insert(end) {
                return Err(Why::PinTwice(end));
            }
            match signal.object {
                Object::Input(input) => {
                    let (_, source) =
                        net.inputs.iter().find(|(id, _)| *id == input).ok_or(Why::Unknown)?;
                    let value = match *source {
                        Source::Input(input) => Value::Input(input, signal.bit),
                        Source::Direct(input) => Value::Direct(input, signal.bit),
                        Source::Wire(signal) => Value::Wire(signal),
                        Source::More => Value::More,
                    };
                    wanted.insert(end, value);
                }
                Object::Output(output) => {
                    let (_, meaning) =
                        net.outputs.iter().find(|(id, _)| *id == output).ok_or(Why::Unknown)?;
                    let value = match *meaning {
                        Shown::Output(output) => Value::Plant(output, signal.bit),
                        Shown::Wire(signal) => Value::Wire(signal),
                        Shown::Moves => Value::Moves(part),
                    };
                    shown.insert(end, value);
                }
            }
        }
        for (pin, value) in
            [(chip.clock, Value::Clock), (chip.tick, Value::Tick), (chip.reset, Value::Run)]
        {
            let Some(pin) = pin else { continue };
            let end = End { part, pin };
            if !used.insert(end) {
                return Err(Why::PinTwice(end));
            }
            wanted.insert(end, value);
        }
    }
    Ok((wanted, shown))
}

/// The value that a connection should carry, by its label.
pub(super) fn label(carries: Carries) -> Value {
    match carries {
        Carries::Clock => Value::Clock,
        Carries::Tick => Value::Tick,
        Carries::Reset => Value::Run,
        Carries::Input { input, bit } => Value::Input(input, bit),
        Carries::Wire(signal) => Value::Wire(signal),
        Carries::Moves(part) => Value::Moves(part),
        Carries::More => Value::More,
        Carries::Plant { output, bit } => Value::Plant(output, bit),
    }
}
