//! Sums with an exclusive-or: T flip-flops, which toggle if their sum is true, and sums that one product inverts.
//!
//! ```text
//! D   x := x*/a*/b + /x*c        T   x := (x*a + x*b + /x*c) :+: x        a step that is left in many ways
//! D   s := a*/b + /a*b           XOR s := (b) :+: a                       a parity, a bit of a counter
//! ```

use super::form::{Form, FormChoice};
use crate::device::FlipFlop;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{Flop, FlopId, Logic, Node, NodeId};
use grafsynth_logic::minimise::Refused;
use grafsynth_logic::node_bdds::Var;

/// Inverters are tried only for sums with at most this many signals.
const MOST_SIGNALS: usize = 12;
/// Inverters are tried only for circuits with at most this many nodes: a larger one fits none of these devices, and each try copies the circuit.
const MOST_NODES: usize = 20_000;

/// A circuit with an additional function for each flip-flop, which is true if the flip-flop changes.
pub(crate) struct Exclusive {
    pub(crate) logic: Logic,
    changes: IdMap<Flop, NodeId>,
}

impl Exclusive {
    pub(crate) fn new(logic: &Logic) -> Self {
        let mut with = logic.clone();
        let mut changes = IdMap::filled(&logic.flops, NodeId::from_index(0));
        for (id, flop) in logic.flops.iter() {
            let present = with.nodes.push(Node::Flop(id));
            changes[id] = with.nodes.push(Node::Xor(flop.next, present));
        }
        Exclusive { logic: with, changes }
    }

    /// The form with the fewest products that the device supports; of equal forms, the simplest. The forms are the plain one, that of a T flip-flop, and, if
    /// these exceed a macrocell's own terms, one with an inverter, which counts as a product. `flop`: the flip-flop that stores the function, if any.
    pub(crate) fn best(
        &self,
        forms: &FormChoice<'_>,
        node: NodeId,
        init: Option<bool>,
        flop: Option<FlopId>,
    ) -> Result<Form, Refused> {
        let forms = FormChoice { logic: &self.logic, ..*forms };
        let plain = forms.of(node, init);
        let count = |form: &Result<Form, Refused>| {
            form.as_ref()
                .map_or(usize::MAX, |form| form.products.len() + form.inverter.iter().count())
        };
        let mut best = plain;
        // A T flip-flop is used only without inversion, so it must be 0 after power-up.
        if let (Some(flop), Some(false)) = (flop, init)
            && forms.device.has_flip_flop(FlipFlop::T)
            && count(&best) > 1
        {
            let toggles = forms.sum(self.changes[flop], false).map(|products| Form {
                is_complemented: false,
                is_pin_inverted: false,
                products,
                flip_flop: FlipFlop::T,
                inverter: None,
            });
            if count(&toggles) < count(&best) {
                best = toggles;
            }
        }
        let own_terms = forms.device.blocks.map_or(1, |blocks| blocks.own_terms as usize);
        if forms.device.has_xor()
            && count(&best) > own_terms
            && let Some(inverted) = self.inverted(&forms, node, init, &best)
        {
            best = Ok(inverted);
        }
        best
    }

    /// The sum together with a single signal that inverts it, if that saves more than the signal costs.
    fn inverted(
        &self,
        forms: &FormChoice<'_>,
        node: NodeId,
        init: Option<bool>,
        best: &Result<Form, Refused>,
    ) -> Option<Form> {
        let Ok(known) = best else { return None };
        let mut signals: Vec<Var> = known.products.iter().flatten().map(|(var, _)| *var).collect();
        signals.sort_unstable();
        signals.dedup();
        if signals.len() > MOST_SIGNALS || self.logic.nodes.len() > MOST_NODES {
            return None;
        }
        let mut least = known.products.len() + known.inverter.iter().count();
        let mut found = None;
        let mut logic = self.logic.clone();
        let others: Vec<(Var, NodeId)> = signals
            .into_iter()
            .map(|var| {
                let signal = logic.nodes.push(match var {
                    Var::Input(id) => Node::Input(id),
                    Var::Flop(id) => Node::Flop(id),
                });
                (var, logic.nodes.push(Node::Xor(node, signal)))
            })
            .collect();
        let forms = FormChoice { logic: &logic, ..*forms };
        for (var, other) in others {
            if let Ok(form) = forms.of(other, init)
                && form.products.len() + 1 < least
            {
                least = form.products.len() + 1;
                // The sum of the complement is inverted once more by the signal, so the equation's own polarity does not change.
                found = Some(Form { inverter: Some(vec![(var, true)]), ..form });
            }
        }
        found
    }
}
