//! The choice of the polarity in which a function is printed as a sum.

use crate::device::{Device, FlipFlop, Polarity, PowerUp};
use grafsynth_ir::logic::{Logic, Node, NodeId};
use grafsynth_logic::minimise::{Budget, Product, Refused, sum_between};
use grafsynth_logic::split::NarrowSum;

/// A sum in the polarity in which it is printed.
pub(crate) struct Form {
    pub(crate) is_complemented: bool,
    pub(crate) is_pin_inverted: bool,
    pub(crate) products: Vec<Product>,
    /// The kind of the flip-flop, if there is one.
    pub(crate) flip_flop: FlipFlop,
    /// A product that inverts the sum while it is true.
    pub(crate) inverter: Option<Product>,
}

impl Form {
    /// A plain sum, for a D flip-flop or none.
    pub(crate) fn plain(
        is_complemented: bool,
        is_pin_inverted: bool,
        products: Vec<Product>,
    ) -> Self {
        Form { is_complemented, is_pin_inverted, products, flip_flop: FlipFlop::D, inverter: None }
    }
}

/// The choice of the polarity of a sum.
#[derive(Clone, Copy)]
pub(crate) struct FormChoice<'a> {
    pub(crate) logic: &'a Logic,
    pub(crate) device: &'static Device,
    pub(crate) budget: Budget,
    pub(crate) dont_cares: bool,
    /// The don't-cares of the current function.
    pub(crate) open: &'a [NodeId],
}

impl FormChoice<'_> {
    /// The fixed polarity of a device without a choice: its sums give the complement of the pin, or the pin.
    fn fixed(&self) -> Option<bool> {
        match self.device.polarity {
            Polarity::Programmable => None,
            Polarity::ActiveLow => Some(true),
            Polarity::ActiveHigh => Some(false),
        }
    }

    /// The required polarity of a function (true: not complemented); `None` if both are possible. `init` is the power-up value of a clocked function.
    pub(crate) fn polarity(&self, init: Option<bool>) -> Option<bool> {
        match (init, self.device.power_up) {
            (None, _) => self.fixed().map(|is_low| !is_low),
            (Some(init), PowerUp::ByPolarity) => Some(!init),
            (Some(init), PowerUp::PinsHigh) => self.fixed().map(|is_low| is_low != init),
        }
    }

    /// The form of a function: of a clocked one with its power-up value, or of a combinational one.
    pub(crate) fn of(&self, node: NodeId, init: Option<bool>) -> Result<Form, Refused> {
        match init {
            Some(init) => self.registered(node, init),
            None => self.combinational(node),
        }
    }

    /// The form of a sum of the right polarity that was found in another way.
    pub(crate) fn of_sum(&self, sum: &NarrowSum, init: Option<bool>) -> Form {
        let is_pin_inverted = match (init, self.device.power_up) {
            (Some(init), PowerUp::PinsHigh) => !init,
            (Some(_), PowerUp::ByPolarity) => false,
            // A part in the polarity that the device lacks is shown inverted at its pin.
            (None, _) => self.fixed().is_some_and(|is_low| is_low != sum.is_complemented),
        };
        Form::plain(sum.is_complemented, is_pin_inverted, sum.products.clone())
    }

    /// A form without its sum, for a circuit that is too large for the device in any case. A function that is a single literal still gets
    /// its sum, because it may share the macrocell of a flip-flop.
    pub(crate) fn unsaid(&self, node: NodeId, init: Option<bool>) -> Form {
        let inner = if let Node::Not(inner) = self.logic.nodes[node] { inner } else { node };
        let is_literal = matches!(self.logic.nodes[inner], Node::Flop(_) | Node::Input(_));
        if is_literal && let Ok(form) = self.of(node, init) {
            return form;
        }
        let is_complemented = self.polarity(init).is_some_and(|is_plain| !is_plain);
        self.of_sum(&NarrowSum { is_complemented, products: Vec::new() }, init)
    }

    pub(crate) fn sum(&self, node: NodeId, is_complemented: bool) -> Result<Vec<Product>, Refused> {
        let all = self.logic.never.iter().chain(&self.logic.unreachable).chain(self.open);
        let dont_cares: Vec<NodeId> = all.copied().filter(|_| self.dont_cares).collect();
        sum_between(self.logic, node, is_complemented, &dont_cares, self.budget)
            .map(|(products, _)| products)
    }

    /// The function of a flip-flop with this power-up value.
    fn registered(&self, node: NodeId, init: bool) -> Result<Form, Refused> {
        match self.device.power_up {
            PowerUp::ByPolarity => Ok(Form::plain(init, false, self.sum(node, init)?)),
            // The pin is high at first; if its polarity is fixed, so is that of the sum.
            PowerUp::PinsHigh => match self.fixed() {
                None => Ok(Form { is_pin_inverted: !init, ..self.combinational(node)? }),
                Some(is_low) => {
                    let is_complemented = is_low == init;
                    let products = self.sum(node, is_complemented)?;
                    Ok(Form::plain(is_complemented, !init, products))
                }
            },
        }
    }

    /// The shorter polarity; the signal itself if they are equal.
    fn combinational(&self, node: NodeId) -> Result<Form, Refused> {
        if let Some(is_complemented) = self.fixed() {
            let products = self.sum(node, is_complemented)?;
            return Ok(Form::plain(is_complemented, false, products));
        }
        let cost =
            |products: &[Product]| (products.len(), products.iter().map(Vec::len).sum::<usize>());
        let plain = self.sum(node, false);
        if let Ok(products) = &plain
            && products.len() <= 1
        {
            return plain.map(|products| Form::plain(false, false, products));
        }
        if let Err(refused @ (Refused::Nodes(_) | Refused::Variables(_))) = plain {
            // The complement has the same diagram.
            return Err(refused);
        }
        match (plain, self.sum(node, true)) {
            (Ok(plain), Ok(complement)) if cost(&complement) >= cost(&plain) => {
                Ok(Form::plain(false, false, plain))
            }
            (Ok(_) | Err(_), Ok(complement)) => Ok(Form::plain(true, false, complement)),
            (Ok(plain), Err(_)) => Ok(Form::plain(false, false, plain)),
            (Err(refused), Err(_)) => Err(refused),
        }
    }
}
