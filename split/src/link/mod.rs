//! The link between the parts of a split: the connected pins, and the operations of the CPU in one round (semantics §10.3).
//!
//! ```text
//! division, pins of the chips, a CPU ─ link ──► connections and acts, as data
//!                                     check ─► the acts make one round, by an execution that shares no code with `link`
//!                                     files ─► NAME_link.h, NAME_link.c, NAME_link_pins.h: printed from the acts
//!                                     wiring ► wiring.md, wiring.svg: printed from the connections
//! ```
//!
//! One clock signal clocks all chips. The parts receive their inputs through the CPU, which latches them; only an input that the CPU does not read, and that nothing but
//! combinational outputs of chips depend on, is wired to the chips alone.
//!
//! If the parts run on their own (semantics §10.7), each chip has a clock and the inputs of the plant itself, and the acts are those of a reaction of the CPU: it
//! reads the wires of the others, reacts, and shows its own. Then `free` checks them.

mod breach;
mod check;
mod files;
mod free;
mod in_reset;
mod make;
mod pins_text;
mod time;
mod wiring;

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::{Division, PartIndex, Running, Signal};
use grafsynth_ir::net::{InputId, Net, OutputId};

use crate::cpu::Cpu;

pub use breach::{Breach, Why};
pub use files::{Calls, File, calls, files, smallest_program, smallest_program_alone};
pub use make::link;
pub use time::{chip_ns, least_cycles, round_cycles};
pub use wiring::{wiring_md, wiring_rows, wiring_svg};

/// The number of flip-flops through which an input of a chip that runs on its own passes before anything reads it. The first one can be caught in the middle of a
/// change; a whole clock period later, the second one stores a level.
pub const SYNCHRONISERS: usize = 2;

/// The clock of the chips that run on their own, in cycles per second, by which times are stated. Every chip of docs/devices.md allows a faster one.
pub const OSCILLATOR_HZ: u32 = 10_000_000;

/// Checks that the acts of a link make one round of the division of a net (semantics §10.3), and that only inputs without an effect on states and wires bypass the CPU.
/// If the parts run on their own, checks that each line of §10.7 is wired, synchronised and served by the CPU.
///
/// # Errors
/// The first rule that is broken.
pub fn check(
    link: &Link,
    net: &Net,
    division: &Division,
    chips: &[ChipPins],
) -> Result<(), Breach> {
    match division.running {
        Running::Lockstep => check::check(link, net, division, chips),
        Running::Free => free::check(link, net, division, chips),
    }
}

/// The input of [`link`].
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// The net that was divided.
    pub net: &'a Net,
    /// The parts.
    pub division: &'a Division,
    /// The pins of each chip: one for each part except the last.
    pub chips: &'a [ChipPins],
    /// The microcontroller that runs the last part.
    pub cpu: &'static Cpu,
    /// The C of the last part.
    pub names: CpuNames,
    /// The beginning of the names of the files: `plant` gives `plant_link.c`.
    pub stem: String,
    /// The prefix of the functions and macros, an identifier: `plant` gives `plant_link_init`.
    pub name: String,
    /// Pins of the CPU that the user chose: the name of a connection and that of the pin.
    pub wanted: BTreeMap<String, String>,
    /// The delays of the chips.
    pub timing: Timing,
}

/// How long the CPU waits for the chips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// The longest time from an input or the clock of a chip to its outputs, in nanoseconds.
    pub settle_ns: u32,
    /// The longest time from power-up to the first state of a chip, in microseconds.
    pub power_up_us: u32,
}

impl Default for Timing {
    /// 100 ns and 10 ms: more than the data sheets of the supported devices allow.
    fn default() -> Self {
        Timing { settle_ns: 100, power_up_us: 10_000 }
    }
}

/// The pins of a chip after fitting.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChipPins {
    /// The device, for the drawing.
    pub device: String,
    /// The signals of the design, without clock and tick.
    pub signals: Vec<ChipSignal>,
    /// The pin of the clock, active on the rising edge; `None` if nothing on the chip is registered.
    pub clock: Option<u32>,
    /// The pin that is 1 in a round in which a tick passes; `None` if the chip has no timer.
    pub tick: Option<u32>,
    /// The pin that sets all flip-flops to their initial values at the clock while it is high.
    pub reset: Option<u32>,
    /// The inputs of the part on which a flip-flop, a wire or a mealy output of the fitted chip depends.
    pub held: BTreeSet<InputId>,
    /// Those on which a flip-flop or a wire depends.
    pub moving: BTreeSet<InputId>,
    /// The number of flip-flops through which each input pin passes first, if there are any.
    pub synchronisers: BTreeMap<u32, usize>,
    /// The output pins that a flip-flop drives.
    pub registered: BTreeSet<u32>,
    /// The output pins that depend on an input other than through flip-flops that store the state.
    pub following: BTreeSet<u32>,
    /// Pins that are connected to ground: they enable outputs while they are low.
    pub grounded: Vec<u32>,
}

/// A signal on a pin of a chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChipSignal {
    /// The name of the signal in the design of the chip.
    pub name: String,
    /// The pin.
    pub pin: u32,
    /// The object of the net of the part.
    pub object: Object,
    /// The bit of an integer, from 0; its pins carry the value minus the lower bound of its range.
    pub bit: u32,
}

/// An input or output of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Object {
    /// An input, in the net of the part.
    Input(InputId),
    /// An output, in the net of the part.
    Output(OutputId),
}

/// The C names of the part on the CPU: the interface of `NAME_step`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CpuNames {
    /// The prefix: NAME in `NAME_step`.
    pub prefix: String,
    /// The header that declares it.
    pub header: String,
    /// The members of `NAME_in_t`: all inputs that the caller supplies. Without any, `NAME_step` has no parameter `in`.
    pub inputs: BTreeMap<InputId, String>,
    /// The members of `NAME_out_t`. Without any, `NAME_step` has no parameter `out`.
    pub outputs: BTreeMap<OutputId, String>,
    /// True if `NAME_step` has a parameter `self`.
    pub has_instance: bool,
    /// The type of the parameter `dt`, if there is one.
    pub dt: Option<String>,
    /// The header that declares the functions of the user.
    pub library: String,
    /// The functions for extern conditions, if the link provides those that the part calls.
    pub conditions: BTreeMap<InputId, Condition>,
}

/// The functions for an extern condition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Condition {
    /// The function that the part calls.
    pub called: String,
    /// The user's function.
    pub provided: String,
}

/// A pin of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct End {
    /// The part; the last one is the CPU.
    pub part: PartIndex,
    /// The number of the pin on its package.
    pub pin: u32,
}

/// What a connection carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Carries {
    /// The clock of all chips.
    Clock,
    /// Whether a tick passes in the round.
    Tick,
    /// High while the CPU initialises: a clock then sets all flip-flops of the chips to their initial values.
    Reset,
    /// A bit of an input of the net, as latched for the round.
    Input {
        /// The input, in the net.
        input: InputId,
        /// The bit of the value minus the lower bound.
        bit: u32,
    },
    /// What a wire between parts shows in the round.
    Wire(Signal),
    /// Whether any transition of a chip fires in the round, which decides whether there is another one.
    Moves(PartIndex),
    /// Whether any part moves in the round, so that END waits for a later one.
    More,
    /// A bit of an output of the net, from a chip to the plant.
    Plant {
        /// The output, in the net.
        output: OutputId,
        /// The bit of the value minus the lower bound.
        bit: u32,
    },
}

/// Pins that are connected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Connection {
    /// A name that no other connection has; a C identifier.
    pub name: String,
    /// What it carries.
    pub carries: Carries,
    /// The pin that drives it.
    pub from: End,
    /// The pins that read it; empty for an output to the plant.
    pub to: Vec<End>,
    /// The level while the CPU is in reset, given by a resistor, if the CPU drives it: a chip drives its own outputs.
    pub pull: Option<bool>,
}

/// An input of the plant that is wired to chips.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Direct {
    /// A name that no connection has.
    pub name: String,
    /// The input, in the net.
    pub input: InputId,
    /// The bit of the value minus the lower bound.
    pub bit: u32,
    /// The pins of the chips.
    pub to: Vec<End>,
    /// True if the CPU latches the input and passes it on, too, and only the emergency of the chips reads these pins; else the CPU neither reads it nor passes it on.
    pub is_emergency: bool,
}

/// The index of a connection in [`Link::connections`].
pub type ConnectionIndex = usize;

/// The value that the CPU puts on a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Put {
    /// A bit of a latched input of the net, as in [`Carries::Input`].
    Input {
        /// The input, in the net.
        input: InputId,
        /// The bit of the value minus the lower bound.
        bit: u32,
    },
    /// Whether `dt` is not 0.
    Tick,
    /// A Boolean output of the part on the CPU.
    Output(OutputId),
    /// Whether any part that was asked moves.
    More,
}

/// One operation of the CPU in a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Act {
    /// Copies all inputs of the net.
    Latch,
    /// Hands a latched input to the part on the CPU.
    Hand {
        /// The input of the net.
        from: InputId,
        /// The input of the part.
        to: InputId,
    },
    /// Sets a pin.
    Put {
        /// The connection of the pin.
        connection: ConnectionIndex,
        /// The value.
        value: Put,
    },
    /// Waits until the outputs of the chips have followed their inputs.
    Settle,
    /// Reads a pin.
    Get {
        /// The connection of the pin.
        connection: ConnectionIndex,
        /// The input of the part on the CPU that gets the value.
        to: InputId,
    },
    /// Reads from a pin whether a transition of a chip fires in this round.
    AskChip {
        /// The connection of the pin.
        connection: ConnectionIndex,
    },
    /// Tells the part on the CPU whether a chip moves, before it reacts.
    HandMore {
        /// The input of the part.
        to: InputId,
    },
    /// Calls `NAME_step` of the part on the CPU.
    React,
    /// Takes from an output of the part on the CPU whether one of its transitions fires in this round.
    AskCpu {
        /// The output.
        output: OutputId,
    },
    /// A pulse on the clock of all chips.
    Clock {
        /// The connection of the clock.
        connection: ConnectionIndex,
    },
}

/// The connections, and the acts of the CPU in each round.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Clock, tick, inputs, wires, outputs to the plant.
    pub connections: Vec<Connection>,
    /// The inputs that are wired to chips alone, and those that an emergency also reads there; if the parts run on their own, all inputs of chips, which the CPU may read too.
    pub direct: Vec<Direct>,
    /// The pins that get a clock of their own, if the parts run on their own.
    pub oscillator: Vec<End>,
    /// One round, in order; if the parts run on their own, one reaction of the CPU.
    pub acts: Vec<Act>,
    /// The maximum number of rounds of a reaction, if it has several: the CPU repeats the acts, except [`Act::Latch`], while some part moves; the rounds after
    /// the first one are without time and events.
    pub most_rounds: Option<u32>,
    /// The extern conditions (inputs of the net) whose functions are called at most once in all rounds of a reaction: the first call of the part on the CPU calls
    /// the user's function, and [`Act::Latch`] forgets the result of the last reaction.
    pub once: Vec<InputId>,
    /// What the CPU puts on its pins for row 0, in which all inputs are 0, if that may differ from the levels in reset.
    pub start: Vec<(ConnectionIndex, Start)>,
}

/// What the CPU puts on a pin after its initialisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Start {
    /// This level.
    Level(bool),
    /// A Boolean output of the part on the CPU, in row 0.
    Output(OutputId),
}
