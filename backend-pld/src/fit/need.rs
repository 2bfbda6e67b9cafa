//! The requirements of signals on pins, and the capabilities of a device.

use crate::device::layout::{Enable, Mode, Register, Shape};
use crate::device::{Clock, Device, Macrocell};

/// The requirement of a signal on a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Need {
    /// A clock input.
    Clock,
    /// Any pin that can be read.
    Input,
    /// A function with this many product terms; `is_read`: another function reads it.
    Macrocell { terms: usize, is_registered: bool, is_read: bool },
}

impl Need {
    /// The key for the order of placement: the signals that are hardest to place come first.
    pub(crate) fn order(self) -> (u32, usize) {
        match self {
            Need::Clock => (0, 0),
            Need::Macrocell { terms, .. } => (1, usize::MAX - terms),
            Need::Input => (2, 0),
        }
    }
}

/// An input or output whose pin is not the one given by the order of declarations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MovedPin {
    /// Its name in the source.
    pub name: String,
    /// Its pin.
    pub pin: u32,
    /// The pin given by the order of declarations.
    pub instead_of: u32,
    /// The reason.
    pub because: MovedBecause,
}

/// Why a signal is not on the pin given by the order of declarations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MovedBecause {
    /// The pin cannot carry it.
    Refused(Refusal),
    /// Another signal has the pin, because that signal can use no other pin or had this one in an earlier build.
    Needed {
        /// Its name.
        by: String,
    },
}

impl std::fmt::Display for MovedPin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let MovedPin { name, pin, instead_of, because } = self;
        write!(f, "`{name}` is on pin {pin}, not on pin {instead_of}: ")?;
        match because {
            MovedBecause::Refused(why) => write!(f, "{why}"),
            MovedBecause::Needed { by } => write!(f, "`{by}` needs that pin"),
        }
    }
}

/// Why a pin does not meet the requirement of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The package has only this many pins.
    NoSuchPin(u32),
    /// It is ground or a supply voltage.
    Supply,
    /// The pin is used to program the device.
    Jtag,
    /// The pin is not the clock input, which is this pin.
    ClockIs(u32),
    /// The pin is reserved for the clock.
    Clock,
    /// The pin controls all registered outputs.
    Control,
    /// The device has no flip-flops.
    NoFlops,
    /// It has no macrocell.
    NoMacrocell,
    /// The macrocell has no flip-flop but the function needs one, or the macrocell always uses its flip-flop and the function has none.
    OtherKind {
        /// True if the function has a flip-flop.
        is_registered: bool,
    },
    /// The function has too many product terms.
    Wide {
        /// The number of product terms of the function.
        terms: usize,
        /// The number of product terms of the macrocell.
        limit: u32,
    },
    /// In the named mode, no product term can read an output.
    NoFeedback(&'static str),
    /// No product term can read the pin: in the named mode or, if `None`, in any mode.
    Deaf(Option<&'static str>),
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Refusal::NoSuchPin(n_pins) => write!(f, "the device has {n_pins} pins"),
            Refusal::Supply => write!(f, "it is a supply pin"),
            Refusal::Jtag => write!(f, "it is a JTAG pin, which is used to program the device"),
            Refusal::ClockIs(pin) => write!(f, "the clock of the device is pin {pin}"),
            Refusal::Clock => write!(f, "it is the clock"),
            Refusal::Control => write!(f, "it controls all registered outputs"),
            Refusal::NoFlops => write!(f, "the device has no flip-flops"),
            Refusal::NoMacrocell => write!(f, "it has no output macrocell"),
            Refusal::OtherKind { is_registered: true } => {
                write!(f, "its macrocell has no flip-flop")
            }
            Refusal::OtherKind { is_registered: false } => {
                write!(f, "its macrocell always has a flip-flop")
            }
            Refusal::Wide { terms, limit } => {
                write!(f, "the function has {terms} product terms, the macrocell {limit}")
            }
            Refusal::NoFeedback(mode) => {
                write!(f, "no output is read back in the {mode} mode of the device")
            }
            Refusal::Deaf(Some(mode)) => {
                write!(f, "it cannot be read in the {mode} mode of the device")
            }
            Refusal::Deaf(None) => write!(f, "no term can read it"),
        }
    }
}

/// A device in one of its modes, for a circuit with or without flip-flops.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    pub(crate) device: &'static Device,
    /// The mode, if the device has several.
    pub(crate) mode: Option<&'static Mode>,
    pub(crate) has_registers: bool,
}

impl View {
    /// The modes of a device for such a circuit, the simplest first.
    pub(crate) fn all(device: &'static Device, has_registers: bool) -> Vec<View> {
        let view = |mode| View { device, mode, has_registers };
        let modes = device.layout.map_or(&[][..], |layout| layout.modes);
        if modes.len() < 2 {
            return vec![view(None)];
        }
        let can_hold = |mode: &&'static Mode| {
            let is_registered = |shape: &Shape| shape.register != Register::None;
            !has_registers || mode.shapes.iter().any(is_registered)
        };
        modes.iter().filter(can_hold).map(|mode| view(Some(mode))).collect()
    }

    /// The pins that may carry a signal.
    pub(crate) fn pins(&self) -> impl Iterator<Item = u32> + use<> {
        let device = self.device;
        (1..=device.n_pins)
            .filter(move |pin| !device.is_supply(*pin) && !device.jtag_pins.contains(pin))
    }

    /// The product terms of a macrocell; 0 if it has none of that kind.
    pub(crate) fn terms(&self, cell: &Macrocell, is_registered: bool) -> u32 {
        if is_registered {
            return cell.registered_terms;
        }
        // Without an enable term there is one more product term.
        let is_own = self.device.burned_as.eq_ignore_ascii_case(self.device.name);
        let rows = self.device.layout.and_then(|layout| layout.cell(cell.pin));
        match (self.mode, rows) {
            (Some(mode), Some(rows)) if is_own && cell.combinational_terms > 0 => {
                let own = mode.shapes.iter().find(|shape| {
                    shape.register == Register::None && shape.enable != Enable::Never
                });
                own.map_or(0, |shape| rows.n_rows - shape.sum)
            }
            (Some(_) | None, _) => cell.combinational_terms,
        }
    }

    /// The maximum number of products that a macrocell holds.
    pub(crate) fn widest(&self, is_registered: bool) -> usize {
        let terms = self.device.macrocells.iter().map(|cell| self.terms(cell, is_registered));
        terms.max().unwrap_or(0) as usize
    }

    /// Why a pin cannot be used.
    pub(crate) fn refuses(&self, need: Need, pin: u32) -> Option<Refusal> {
        let device = self.device;
        if pin == 0 || pin > device.n_pins {
            return Some(Refusal::NoSuchPin(device.n_pins));
        }
        if device.is_supply(pin) {
            return Some(Refusal::Supply);
        }
        if device.jtag_pins.contains(&pin) {
            return Some(Refusal::Jtag);
        }
        let is_clock_pin = device.clock == Clock::Pin(pin);
        let is_reserved = device.control_pins.contains(&pin)
            && (self.has_registers || !device.free_when_combinational);
        match need {
            Need::Clock => match device.clock {
                Clock::Pin(own) => (own != pin).then_some(Refusal::ClockIs(own)),
                Clock::Term => is_reserved.then_some(Refusal::Control),
                Clock::None => Some(Refusal::NoFlops),
            },
            Need::Input if is_reserved => Some(Refusal::Control),
            Need::Input if is_clock_pin && self.has_registers => Some(Refusal::Clock),
            Need::Input => self.cannot_be_read(pin),
            Need::Macrocell { terms, is_registered, is_read } => {
                let Some(cell) = device.macrocell(pin) else { return Some(Refusal::NoMacrocell) };
                let limit = self.terms(cell, is_registered);
                if limit == 0 {
                    return Some(Refusal::OtherKind { is_registered });
                }
                if terms > limit as usize {
                    return Some(Refusal::Wide { terms, limit });
                }
                if !is_read || is_registered {
                    return None;
                }
                // In the simplest mode of several, no output can be read; all assemblers follow this rule.
                let is_plain = |mode: &&Mode| {
                    device.layout.is_some_and(|layout| layout.modes[0].name == mode.name)
                };
                match self.mode.filter(is_plain) {
                    Some(mode) => Some(Refusal::NoFeedback(mode.name)),
                    None => self.cannot_be_read(pin),
                }
            }
        }
    }

    fn cannot_be_read(&self, pin: u32) -> Option<Refusal> {
        let device = self.device;
        let is_own = device.burned_as.eq_ignore_ascii_case(device.name);
        // For a PAL that is replaced by a GAL, the table of the PAL applies as well.
        if !is_own && !self.has_registers && device.deaf_pins.contains(&pin) {
            return Some(Refusal::Deaf(None));
        }
        if !device.can_read(pin) {
            return Some(Refusal::Deaf(None));
        }
        let mode = self.mode?;
        mode.column(pin).is_none().then_some(Refusal::Deaf(Some(mode.name)))
    }

    /// The possible pins, for a message.
    pub(crate) fn possible(&self, need: Need) -> String {
        let pins: Vec<String> = (1..=self.device.n_pins)
            .filter(|pin| self.refuses(need, *pin).is_none())
            .map(|pin| pin.to_string())
            .collect();
        if pins.is_empty() { "none".to_owned() } else { pins.join(", ") }
    }
}

/// The maximum number of product terms that any macrocell of the device holds.
pub(crate) fn widest(device: &Device) -> usize {
    let terms = |cell: &Macrocell| cell.registered_terms.max(cell.combinational_terms);
    device.macrocells.iter().map(terms).max().unwrap_or(0) as usize
}
