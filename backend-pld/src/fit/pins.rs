//! Pins: the user's wishes first, then what is left.

use super::misfit::Misfit;
use crate::EmitOptions;
use crate::codes;
use crate::device::{Clock, Device};
use crate::equations::{Equation, Equations, SignalIndex, Source, source_matches, source_name};
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::logic::Logic;
use std::collections::{BTreeMap, BTreeSet};

impl Equations {
    /// Numbers the pins; gives the reason where the design does not fit. Impossible wishes of the board are findings.
    pub(crate) fn assign_pins(
        &mut self,
        logic: &Logic,
        options: &EmitOptions,
        findings: &mut Vec<Diagnostic>,
    ) -> Option<Misfit> {
        let device = self.device;
        let mut free: Vec<u32> = (1..=device.n_pins)
            .filter(|pin| !device.is_supply(*pin) && !device.jtag_pins.contains(pin))
            .collect();
        let mut needs: Vec<(SignalIndex, Need)> = Vec::new();
        let mut equation_of: Vec<Option<&Equation>> = vec![None; self.signals.len()];
        for equation in &self.equations {
            equation_of[equation.signal] = Some(equation);
        }
        for (index, signal) in self.signals.iter().enumerate() {
            needs.push((
                index,
                match (signal.source, equation_of[index]) {
                    (Source::Clock, _) => Need::Clock,
                    (_, Some(equation)) => Need::Macrocell {
                        terms: equation.n_terms(),
                        is_registered: equation.is_registered,
                    },
                    (
                        Source::Input(_) | Source::Flop(_) | Source::Output(_) | Source::Buried(_),
                        None,
                    ) => Need::Input,
                },
            ));
        }
        let has_registers = self.equations.iter().any(|equation| equation.is_registered);
        let before = findings.len();
        for (name, pin) in &options.pins {
            let Some(index) = self.find_source(logic, name) else {
                let known = self.signals.iter().map(|signal| source_name(logic, signal.source));
                let mut finding = Diagnostic::error(
                    codes::BAD_PIN,
                    format!(
                        "the board gives pin {pin} to `{name}`, and the circuit has no such signal"
                    ),
                );
                if let Some(near) = nearest(name, known) {
                    finding = finding.help(format!("did you mean `{near}`?"));
                }
                findings.push(finding);
                continue;
            };
            let need = needs[index].1;
            if let Some(other) = self.signals.iter().find(|signal| signal.pin == Some(*pin)) {
                let message = format!(
                    "pin {pin} is given to `{}` and to `{name}`",
                    source_name(logic, other.source)
                );
                findings.push(
                    Diagnostic::error(codes::BAD_PIN, message)
                        .help("give each signal a pin of its own"),
                );
            } else if let Some(reason) = need.refuses(device, has_registers, *pin) {
                let message =
                    format!("pin {pin} of a {} cannot be `{name}`: {reason}", device.name);
                findings.push(
                    Diagnostic::error(codes::BAD_PIN, message)
                        .help(format!("possible pins: {}", need.possible(device, has_registers))),
                );
            } else {
                free.retain(|other| other != pin);
                self.signals[index].pin = Some(*pin);
            }
        }
        if findings.len() > before {
            return None;
        }
        if let Some(blocks) = device.blocks {
            let misfit = self.assign_blocks(blocks, free, &needs);
            return self.settled(misfit, logic, options);
        }
        // The widest sums choose first and take the narrowest macrocell that holds them; inputs take what only inputs can use.
        needs.retain(|(index, _)| self.signals[*index].pin.is_none());
        needs.sort_by_key(|(index, need)| match need {
            Need::Clock => (0, 0, *index),
            Need::Macrocell { terms, .. } => (1, usize::MAX - terms, *index),
            Need::Input => (2, 0, *index),
        });
        let mut misfit = Misfit::default();
        let mut matching = Matching { device, has_registers, free, taken: BTreeMap::new() };
        for (index, need) in needs {
            if !matching.place(index, need, &mut BTreeSet::new()) {
                misfit.note(need, &self.signals[index], device);
            }
        }
        for (pin, (index, _)) in &matching.taken {
            self.signals[*index].pin = Some(*pin);
        }
        self.settled(misfit, logic, options)
    }

    /// Keeps the pins if everything has one; if not, only those that the board gives.
    fn settled(&mut self, misfit: Misfit, logic: &Logic, options: &EmitOptions) -> Option<Misfit> {
        if misfit.is_none() {
            self.has_pins = true;
            return None;
        }
        for signal in &mut self.signals {
            signal.pin = options
                .pins
                .iter()
                .find(|(name, _)| source_matches(logic, signal.source, name))
                .map(|(_, pin)| *pin);
        }
        Some(misfit)
    }

    fn find_source(&self, logic: &Logic, name: &str) -> Option<SignalIndex> {
        self.signals.iter().position(|signal| source_matches(logic, signal.source, name))
    }
}

/// Signals to pins: each takes the pin that is of least use to others; where none is left, one that has another possibility makes room. So everything
/// finds a pin that can, whatever the order.
struct Matching {
    device: &'static Device,
    has_registers: bool,
    free: Vec<u32>,
    taken: BTreeMap<u32, (SignalIndex, Need)>,
}

impl Matching {
    /// Finds a pin, not one of `tried`. The recursion is bounded by the number of pins.
    fn place(&mut self, index: SignalIndex, need: Need, tried: &mut BTreeSet<u32>) -> bool {
        let mut possible: Vec<u32> = (1..=self.device.n_pins)
            .filter(|pin| self.free.contains(pin) || self.taken.contains_key(pin))
            .filter(|pin| need.refuses(self.device, self.has_registers, *pin).is_none())
            .collect();
        possible.sort_by_key(|pin| self.rank(need, *pin));
        if let Some(pin) = possible.iter().copied().find(|pin| self.free.contains(pin)) {
            self.free.retain(|other| *other != pin);
            self.taken.insert(pin, (index, need));
            return true;
        }
        for pin in possible {
            let Some(&(other, others_need)) = self.taken.get(&pin) else { continue };
            if tried.insert(pin) && self.place(other, others_need, tried) {
                self.taken.insert(pin, (index, need));
                return true;
            }
        }
        false
    }

    /// The narrowest macrocell that holds a sum; for an input what only inputs can use.
    fn rank(&self, need: Need, pin: u32) -> (u32, u32) {
        match (need, self.device.macrocell(pin)) {
            (Need::Macrocell { .. }, Some(cell)) => {
                (cell.registered_terms.max(cell.combinational_terms), pin)
            }
            (Need::Macrocell { .. } | Need::Input | Need::Clock, None) => (0, pin),
            (Need::Input | Need::Clock, Some(_)) => {
                (u32::from(self.device.deaf_pins.contains(&pin)) + 1, pin)
            }
        }
    }
}

/// What a signal needs of a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Need {
    Clock,
    Input,
    Macrocell { terms: usize, is_registered: bool },
}

impl Need {
    /// Why this pin will not do.
    pub(crate) fn refuses(self, device: &Device, has_registers: bool, pin: u32) -> Option<String> {
        if pin == 0 || pin > device.n_pins {
            return Some(format!("it has {} pins", device.n_pins));
        }
        if device.is_supply(pin) {
            return Some("it is a supply pin".to_owned());
        }
        if device.jtag_pins.contains(&pin) {
            return Some("it is a JTAG pin, by which the device is programmed".to_owned());
        }
        let is_clock_pin = device.clock == Clock::Pin(pin);
        let is_reserved = device.control_pins.contains(&pin)
            && (has_registers || !device.free_when_combinational);
        match self {
            Need::Clock => match device.clock {
                Clock::Pin(own) => (own != pin).then(|| format!("its clock is pin {own}")),
                Clock::Term => is_reserved.then(|| "it controls all outputs".to_owned()),
                Clock::None => Some("the device has no flip-flops".to_owned()),
            },
            Need::Input if is_reserved => Some("it controls all registered outputs".to_owned()),
            Need::Input if !device.can_read(pin) => Some("no term can read it".to_owned()),
            Need::Input => (is_clock_pin && has_registers).then(|| "it is the clock".to_owned()),
            Need::Macrocell { terms, is_registered } => match device.macrocell(pin) {
                None => Some("it has no output macrocell".to_owned()),
                Some(cell) => {
                    let limit = if is_registered {
                        cell.registered_terms
                    } else {
                        cell.combinational_terms
                    };
                    if limit == 0 {
                        let has = if is_registered { "no flip-flop" } else { "always a flip-flop" };
                        return Some(format!("its macrocell has {has}"));
                    }
                    (terms > limit as usize).then(|| {
                        format!("the function has {terms} product terms, the macrocell {limit}")
                    })
                }
            },
        }
    }

    fn possible(self, device: &Device, has_registers: bool) -> String {
        let pins: Vec<String> = (1..=device.n_pins)
            .filter(|pin| self.refuses(device, has_registers, *pin).is_none())
            .map(|pin| pin.to_string())
            .collect();
        if pins.is_empty() { "none".to_owned() } else { pins.join(", ") }
    }
}
