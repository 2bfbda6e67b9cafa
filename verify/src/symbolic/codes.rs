//! Circuits whose flip-flops hold steps by a code: the induction goes through the code.
//!
//! The state of the net is not guessed beside that of the circuit; it is *read* from it. Each step that shares a code is active where the function says
//! so by which the circuit shows it ([`Logic::decoded`]), so the reaction is written over the flip-flops of the code. What is to be proved is then that the
//! decoding commutes with the reaction:
//!
//! ```text
//! flip-flops ──circuit──► flip-flops'
//!     │ decode                │ decode
//!     ▼                       ▼
//! situation ──reaction──► situation'
//! ```
//! and that it holds at power-up. Codes that no step has need not behave: that the circuit never reaches them ([`Logic::unreachable`]) is nobody's word but
//! one more invariant of the same induction, assumed before the clock and proved after it.

use std::collections::BTreeSet;

use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;

use super::aig::Lit;
use super::state::Key;
use super::{CONE, Model, import};

/// The circuit's own flip-flops over the variables of the model, and what is to be shown of its code.
pub(super) struct Coded {
    /// For each flip-flop its value before the clock.
    pub(super) flops: Vec<Lit>,
    /// The bits of state that are decoded, by their place in [`Logic::decoded`].
    pub(super) keys: Vec<Key>,
    /// How many of [`Logic::unreachable`] are assumed: all of them or none.
    pub(super) is_closed: bool,
}

impl Model<'_> {
    /// Ties the state of the net to the flip-flops of a circuit. With `is_closed` the states that the circuit calls unreachable are assumed away.
    ///
    /// # Errors
    /// A sentence if the circuit decodes what the net does not have, or shows only some bits of it.
    pub(super) fn tie(&mut self, logic: &Logic, is_closed: bool) -> Result<Coded, String> {
        let mut flops = Vec::new();
        for flop in logic.flops.values() {
            let known = flop.holds.and_then(|holds| {
                let lit = self.state_bits.get(&(holds.origin, holds.element, holds.bit))?;
                Some(lit.negate_if(holds.inverted))
            });
            // A flip-flop without known meaning may hold anything: what is proved then holds whatever it is.
            let lit = match known {
                Some(lit) => lit,
                None => self.aig().variable(),
            };
            flops.push(lit);
        }
        // Decoded bits and unreachable states are functions of the flip-flops alone.
        let pins = vec![Lit::FALSE; logic.inputs.len()];
        let nodes = import(self.aig(), logic, &flops, &pins);
        let mut keys = Vec::new();
        for bit in &logic.decoded {
            let key = (bit.holds.origin, bit.holds.element, bit.holds.bit);
            let Origin::Step(step) = bit.holds.origin else {
                return Err(format!("`{}` is decoded and is no step", bit.name));
            };
            if !self.state_bits.contains_key(&key) || self.state.active.len() <= step.index() {
                return Err(format!("`{}` is decoded and the net does not have it", bit.name));
            }
            let lit = nodes[bit.node.index()];
            self.state.active[step.index()] = lit;
            self.state_bits.insert(key, lit);
            for variable in self.maker.aig.support(&[lit], CONE).unwrap_or_default() {
                self.decodes.entry(variable).or_default().push(step);
            }
            keys.push(key);
        }
        let names = flops.iter().zip(logic.flops.values());
        self.code_bits = names
            .filter(|(lit, _)| self.decodes.contains_key(lit))
            .map(|(lit, flop)| (*lit, flop.name.clone()))
            .collect();
        if is_closed {
            for node in &logic.unreachable {
                let lit = nodes[node.index()];
                let support = self.maker.aig.support(&[lit], CONE).unwrap_or_default();
                self.forbidden.push((support, lit));
            }
        }
        Ok(Coded { flops, keys, is_closed })
    }

    /// The steps that some of these variables tell of.
    pub(super) fn steps_of(&self, variables: &[Lit]) -> BTreeSet<StepId> {
        let mut steps = BTreeSet::new();
        for variable in variables {
            if let Some((Origin::Step(step), _, _)) = self.name_of.get(variable) {
                steps.insert(*step);
            }
            steps.extend(self.decodes.get(variable).into_iter().flatten());
        }
        steps
    }
}
