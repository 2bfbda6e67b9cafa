//! From equations with pins to the macrocells of a device.

use crate::device::Clock;
use crate::equations::{Equations, SignalIndex};
use crate::fuse::Role;
use crate::placement::{Cell, CellKind, PinName, Placement, Product};
use grafsynth_ir::logic::Logic;

impl Equations {
    /// The role of each pin, by which a fuse map is read back as the original circuit.
    #[must_use]
    pub fn roles(&self, logic: &Logic) -> Vec<Role> {
        let named = self.named(logic).into_iter().zip(&self.signals);
        named
            .filter_map(|(named, signal)| {
                Some(Role {
                    pin: named.pin?,
                    object: named.object,
                    is_inverted: signal.is_pin_inverted != signal.is_complement,
                })
            })
            .collect()
    }

    /// The macrocells for the fuse mapper; `None` if pins were left open.
    #[must_use]
    pub fn placement(&self) -> Option<Placement> {
        if !self.has_pins {
            return None;
        }
        let mut placement = Placement::new(self.device);
        placement.title.clone_from(&self.title);
        placement.moved.clone_from(&self.moved);
        let literal = |(signal, value): (SignalIndex, bool)| {
            let signal = &self.signals[signal];
            Some((signal.pin?, value != signal.is_pin_inverted))
        };
        for signal in self.signals.iter().filter(|signal| signal.shared.is_none()) {
            placement.pins.push(PinName {
                pin: signal.pin?,
                name: signal.name.clone(),
                is_inverted: signal.is_pin_inverted,
            });
        }
        placement.pins.sort_by_key(|named| named.pin);
        let clock = match (self.device.clock, self.clock()) {
            (Clock::Term, Some(clock)) => Some(Product(vec![(clock.pin?, true)])),
            (Clock::Term | Clock::Pin(_) | Clock::None, _) => None,
        };
        for equation in &self.equations {
            let signal = &self.signals[equation.signal];
            let products = equation.products.iter().map(|product| {
                let literals: Option<Vec<_>> = product.iter().copied().map(literal).collect();
                literals.map(|literals| Product(literals).sorted())
            });
            let kind =
                if equation.is_registered { CellKind::Registered } else { CellKind::Combinational };
            let is_active_low = equation.is_complemented != signal.is_pin_inverted;
            let sum = products.collect::<Option<Vec<_>>>()?;
            let cell = Cell::new(signal.pin?, kind, is_active_low, sum);
            placement
                .cells
                .push(Cell { clock: clock.clone().filter(|_| equation.is_registered), ..cell });
        }
        Some(placement)
    }
}
