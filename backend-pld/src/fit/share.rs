//! Outputs that equal a flip-flop: one macrocell for both.
//!
//! ```text
//! p2 := m * p1 + /b * p2          R := m * p1 + /b * R       step p2 and output R are one pin
//! R   = p2                   =>
//! ```
//! The test uses the minimised sum: it must be a single literal of the flip-flop, possibly only because of don't-cares. A bit of a compact code can therefore be
//! an output. An output that is the complement of a flip-flop shares its macrocell as well: the pin then shows the complement, which starts with the
//! other value. If registered pins are always high after power-up ([`PowerUp::PinsHigh`]), only an output that is true at first can be the pin itself.

use crate::EmitOptions;
use crate::device::{FlipFlop, Polarity, PowerUp};
use crate::equations::{Equations, SignalIndex, Source, source_matches};
use grafsynth_ir::logic::Logic;
use itertools::Itertools as _;

impl Equations {
    /// Removes the equations of outputs that use the pin of a flip-flop. A flip-flop serves one output, or several that are assigned to one pin.
    pub(crate) fn share_pins(&mut self, logic: &Logic, options: &EmitOptions) {
        let mut at = 0;
        while at < self.equations.len() {
            match self.flop_shown_by(at) {
                Some((flop, is_complement)) if self.may_share(logic, options, at, flop) => {
                    let output = self.equations.remove(at).signal;
                    if is_complement {
                        self.invert(flop);
                    }
                    self.share(output, flop);
                }
                Some(_) | None => at += 1,
            }
        }
    }

    /// If a combinational equation is a single literal of a flip-flop whose pin can show it: the flip-flop, and whether the output is its
    /// complement.
    fn flop_shown_by(&self, at: usize) -> Option<(SignalIndex, bool)> {
        let equation = &self.equations[at];
        let is_output = matches!(self.signals[equation.signal].source, Source::Output(_));
        let [product] = &equation.products[..] else { return None };
        let [(signal, value)] = product[..] else { return None };
        let is_flop = matches!(self.signals[signal].source, Source::Flop(_));
        if !is_output || !is_flop || equation.is_registered || equation.inverter.is_some() {
            return None;
        }
        let is_complement = value == equation.is_complemented;
        let can_show = if is_complement {
            self.can_be_inverted(signal)
        } else {
            !self.signals[signal].is_pin_inverted
        };
        can_show.then_some((signal, is_complement))
    }

    /// True if the flip-flop can be replaced by its complement, which the pin then shows.
    fn can_be_inverted(&self, flop: SignalIndex) -> bool {
        let is_shared = self.signals.iter().any(|signal| signal.shared == Some(flop));
        // The function of a T flip-flop has no polarity to change.
        let is_toggled = self
            .equations
            .iter()
            .any(|equation| equation.signal == flop && equation.flip_flop == FlipFlop::T);
        !is_shared
            && !is_toggled
            && match self.device.power_up {
                PowerUp::ByPolarity => self.device.polarity == Polarity::Programmable,
                PowerUp::PinsHigh => self.signals[flop].is_pin_inverted,
            }
    }

    /// True if an output may share the pin of a flip-flop. The user must not assign them to different pins, and the flip-flop must have no other output unless
    /// both are assigned to one pin.
    fn may_share(
        &self,
        logic: &Logic,
        options: &EmitOptions,
        at: usize,
        flop: SignalIndex,
    ) -> bool {
        let wish = |signal: SignalIndex| {
            let source = self.signals[signal].source;
            let named = options.pins.iter().find(|(name, _)| source_matches(logic, source, name));
            named.map(|(_, pin)| *pin)
        };
        let own = wish(self.equations[at].signal);
        let is_apart = |other: Option<u32>| own.is_some() && other.is_some() && own != other;
        let others: Vec<SignalIndex> = (0..self.signals.len())
            .filter(|index| self.signals[*index].shared == Some(flop))
            .collect();
        let is_on_one_pin = |other: &SignalIndex| own.is_some() && wish(*other) == own;
        !is_apart(wish(flop)) && others.iter().all(is_on_one_pin)
    }

    /// Replaces the signal by the complement of its flip-flop: its equation and every literal of it.
    fn invert(&mut self, flop: SignalIndex) {
        let signal = &mut self.signals[flop];
        signal.is_complement = !signal.is_complement;
        signal.is_pin_inverted = false;
        for equation in &mut self.equations {
            if equation.signal == flop {
                equation.is_complemented = !equation.is_complemented;
            }
            let literals = equation.products.iter_mut().chain(&mut equation.inverter).flatten();
            for (_, value) in literals.filter(|(signal, _)| *signal == flop) {
                *value = !*value;
            }
        }
    }

    /// Gives the flip-flop and the output at its pin the same name, that of the output.
    fn share(&mut self, output: SignalIndex, flop: SignalIndex) {
        if self.signals.iter().any(|signal| signal.shared == Some(flop)) {
            let name = self.signals[flop].name.clone();
            self.signals[output].name = name;
        }
        self.signals[output].shared = Some(flop);
        self.signals[output].is_pin_inverted = false;
        let (name, meta) = (self.signals[output].name.clone(), self.signals[output].meta.clone());
        let signal = &mut self.signals[flop];
        let not = if signal.is_complement { "not " } else { "" };
        let step = std::mem::replace(&mut signal.name, name);
        let labels = [meta.label, format!("{not}{step}"), signal.meta.label.clone()];
        let labels = labels.into_iter().filter(|label| !label.is_empty()).join(", ");
        signal.meta.label = labels;
        signal.meta.req.extend(meta.req);
    }
}
