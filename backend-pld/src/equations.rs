//! Equations: a circuit after all decisions for a PAL, ready to be printed in any of the equation languages.
//!
//! # Power-up
//! All internal flip-flops of these devices are 0 after power-up. The value of the *signal* then depends on the device ([`crate::device::PowerUp`]),
//! so the form of each registered equation follows from the signal's initial value:
//!
//! ```text
//!                      first value 0          first value 1
//! gal22v10, gal20ra10  P2 := ..               /P1 := ..               the equation's polarity decides
//! gal16v8, gal20v8     pin carries /P2        pin carries P1          the pin's polarity decides, the equation takes the shorter form
//! ```

use crate::MovedPin;
use crate::device::{Device, FlipFlop};
use crate::{Named, Object};
use grafsynth_ir::logic::{FlopId, Logic, PinInputId, PinOutputId, PinRole};
use grafsynth_ir::names::{Namer, is_unseen};
use grafsynth_ir::net::Meta;

/// The index of a signal of [`Equations`].
pub type SignalIndex = usize;

/// A whole design.
#[derive(Debug)]
pub struct Equations {
    /// The chart's name as an identifier of the language.
    pub title: String,
    /// The device.
    pub device: &'static Device,
    /// Comment lines for the header.
    pub head: Vec<String>,
    /// All signals in this order: the clock, inputs, outputs, flip-flops, buried parts.
    pub signals: Vec<Signal>,
    /// One equation for each flip-flop, for each output that does not share a macrocell, and for each buried part.
    pub equations: Vec<Equation>,
    /// True if the pins are assigned.
    pub has_pins: bool,
    /// The longest chain of buried nodes; 0 if there are none.
    pub depth: usize,
    /// The resources that the device lacks, if pins were left open for that reason.
    pub lacks: Vec<String>,
    /// Inputs and outputs that are not on the pins given by the order of declarations.
    pub moved: Vec<MovedPin>,
}

/// A named signal, with a pin if the design fits.
#[derive(Debug)]
pub struct Signal {
    /// Its name in the text.
    pub name: String,
    /// The object that it represents.
    pub source: Source,
    /// Its pin.
    pub pin: Option<u32>,
    /// True if the pin carries the complement.
    pub is_pin_inverted: bool,
    /// True if it is the complement of its flip-flop.
    pub is_complement: bool,
    /// An output without its own macrocell: the flip-flop signal whose name and pin it shares.
    pub shared: Option<SignalIndex>,
    /// Label, tags and location.
    pub meta: Meta,
}

impl Signal {
    /// A signal without a pin.
    pub(crate) fn new(name: String, source: Source, meta: &Meta) -> Self {
        Signal {
            name,
            source,
            pin: None,
            is_pin_inverted: false,
            is_complement: false,
            shared: None,
            meta: meta.clone(),
        }
    }
}

/// The object that a [`Signal`] represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The clock.
    Clock,
    /// An input bit.
    Input(PinInputId),
    /// A flip-flop.
    Flop(FlopId),
    /// An output.
    Output(PinOutputId),
    /// A part of a function that is too wide for one sum, by its index.
    Buried(usize),
}

/// The function of a signal.
#[derive(Debug)]
pub struct Equation {
    /// The signal.
    pub signal: SignalIndex,
    /// True if the sum gives the signal's complement.
    pub is_complemented: bool,
    /// True if it is clocked.
    pub is_registered: bool,
    /// Sum of products; a product without literals is always true.
    pub products: Vec<Vec<(SignalIndex, bool)>>,
    /// The kind of the flip-flop, if it is clocked.
    pub flip_flop: FlipFlop,
    /// A product that inverts the sum while it is true.
    pub inverter: Option<Vec<(SignalIndex, bool)>>,
}

impl Equation {
    /// The number of product terms that it needs in its macrocell.
    #[must_use]
    pub fn n_terms(&self) -> usize {
        self.products.len() + self.inverter.iter().count()
    }
}

impl Equations {
    /// The names for [`crate::Emitted`].
    #[must_use]
    pub fn named(&self, logic: &Logic) -> Vec<Named> {
        self.signals
            .iter()
            .map(|signal| {
                let object = match signal.source {
                    Source::Clock => Object::Clock,
                    Source::Input(id) => Object::Input(logic.inputs[id].clone()),
                    Source::Flop(id) => Object::Flop(logic.flops[id].clone()),
                    Source::Output(id) => Object::Output(logic.outputs[id].clone()),
                    Source::Buried(_) => Object::Buried,
                };
                // The text that is read back describes the level at the pin.
                let is_complement = signal.is_pin_inverted != signal.is_complement;
                Named { name: signal.name.clone(), pin: signal.pin, object, is_complement }
            })
            .collect()
    }

    /// The resources that the device lacks, if pins were left open for that reason.
    #[must_use]
    pub fn misfit(&self) -> Option<String> {
        (!self.has_pins && !self.lacks.is_empty()).then(|| self.lacks.join("; "))
    }

    /// The clock's signal.
    #[must_use]
    pub fn clock(&self) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.source == Source::Clock)
    }
}

/// The name of a register. A stored output and its memory have one name in the chart; the memory gets the suffix `_q`.
pub(crate) fn register_name(namer: &mut Namer, name: &str) -> String {
    if namer.is_taken(name) { namer.name_with_suffix(name, "_q") } else { namer.name(name) }
}

pub(crate) fn source_name(logic: &Logic, source: Source) -> &str {
    match source {
        Source::Clock => "clock",
        Source::Input(id) => &logic.inputs[id].name,
        Source::Flop(id) => &logic.flops[id].name,
        Source::Output(id) => &logic.outputs[id].name,
        // The name was generated, so only the printed name exists.
        Source::Buried(_) => "",
    }
}

/// Names for a clock without a pin number, for texts that do not declare a clock. The writer uses the first name that is free in the
/// circuit.
pub(crate) const CLOCK_NAMES: [&str; 3] = ["clk", "clock", "ck"];

pub(crate) fn source_matches(logic: &Logic, source: Source, name: &str) -> bool {
    (source == Source::Clock && name == "clk") || source_name(logic, source) == name
}

/// A header line for a circuit whose reactions may take several clocks.
pub(crate) fn busy_note(logic: &Logic) -> Option<String> {
    let busy = logic.outputs.values().find(|output| output.role == PinRole::Busy)?;
    Some(format!(
        "one micro-step per clock: inputs are read on a clock with {0} low, outputs are held until {0} is low again",
        busy.name
    ))
}

/// Text that is safe in a one-line comment of every language here.
pub(crate) fn one_line(text: &str) -> String {
    let text: String = text.chars().map(|c| if is_unseen(c) { ' ' } else { c }).collect();
    text.replace("*/", "* /")
}

/// Label and tags of something, as a comment; empty if there are none.
pub(crate) fn remark(meta: &Meta) -> String {
    let mut parts = Vec::new();
    if !meta.label.is_empty() {
        parts.push(one_line(&meta.label));
    }
    if !meta.req.is_empty() {
        parts.push(format!("[{}]", one_line(&meta.req.join(", "))));
    }
    parts.join(" ")
}
