//! Circuits whose flip-flops store steps as codes: the induction decodes them.
//!
//! The state of the net is not a separate unknown; it is *read* from the state of the circuit. Each step that shares a code is active if its decoding
//! function is true ([`Logic::decoded`]), so the reaction is written over the flip-flops of the code. The proof then shows that the decoding commutes
//! with the reaction:
//!
//! ```text
//! flip-flops ──circuit──► flip-flops'
//!     │ decode                │ decode
//!     ▼                       ▼
//! situation ──reaction──► situation'
//! ```
//! A step that shares a timer is decoded in the same way: its time is the register while the step is active. The register is 0 while none of its steps is
//! active, which is an invariant of the circuit like the next one.
//!
//! The proof also shows that the power-up code decodes to the initial situation. Unused codes may behave in any way. The claim that the circuit never reaches them
//! ([`Logic::unreachable`]) is not trusted: it is one more invariant of the same induction, assumed before the clock and proved after it.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::logic::{Logic, NodeId};
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;

use super::aig::Lit;
use super::number::Number;
use super::state::Key;
use super::{CONE, Model, import};

/// The circuit's own flip-flops over the variables of the model, and the obligations about its code.
pub(super) struct Coded {
    /// The value of each flip-flop before the clock.
    pub(super) flops: Vec<Lit>,
    /// The decoded bits of state, in the order of [`Logic::decoded`].
    pub(super) keys: Vec<Key>,
}

impl Model<'_> {
    /// Connects the state of the net to the flip-flops of a circuit. States in which one of the `claims` is true are excluded by assumption.
    ///
    /// # Errors
    /// Returns a message if the circuit decodes something that the net does not have, or shows only some bits of it.
    pub(super) fn tie(&mut self, logic: &Logic, claims: &[NodeId]) -> Result<Coded, String> {
        let mut flops = Vec::new();
        for flop in logic.flops.values() {
            let known = flop.holds.and_then(|holds| {
                let lit = self.state_bits.get(&(holds.origin, holds.element, holds.bit))?;
                Some(lit.negate_if(holds.inverted))
            });
            // A flip-flop without known meaning may store anything, and the proof applies to all its values.
            let lit = match known {
                Some(lit) => lit,
                None => self.aig().variable(),
            };
            flops.push(lit);
        }
        // Decoded bits and unreachable states depend on the flip-flops only.
        let pins = vec![Lit::FALSE; logic.inputs.len()];
        let nodes = import(self.aig(), logic, &flops, &pins);
        let mut keys = Vec::new();
        for bit in &logic.decoded {
            let key = (bit.holds.origin, bit.holds.element, bit.holds.bit);
            if !self.state_bits.contains_key(&key) {
                return Err(format!("`{}` is decoded but does not exist in the net", bit.name));
            }
            let lit = nodes[bit.node.index()];
            self.state_bits.insert(key, lit);
            let (Origin::Step(step) | Origin::Elapsed(step)) = bit.holds.origin else {
                let name = &bit.name;
                return Err(format!("`{name}` is decoded but is neither a step nor its time"));
            };
            // A time is read once all of its bits are known.
            if let Origin::Step(step) = bit.holds.origin {
                self.state.active[step.index()] = lit;
            }
            for variable in self.maker.aig.support(&[lit], CONE).unwrap_or_default() {
                if !self.name_of.contains_key(&variable) {
                    self.decodes.entry(variable).or_default().push(step);
                }
            }
            keys.push(key);
        }
        self.read_times(&keys);
        let names = flops.iter().zip(logic.flops.values());
        self.code_bits = names
            .filter(|(lit, _)| self.decodes.contains_key(lit))
            .map(|(lit, flop)| (*lit, flop.name.clone()))
            .gather();
        for claim in claims {
            let lit = nodes[claim.index()];
            let support = self.maker.aig.support(&[lit], CONE).unwrap_or_default();
            self.forbidden.push((support, lit));
        }
        Ok(Coded { flops, keys })
    }

    /// Reads the times that the circuit decodes: those of steps that share a timer.
    fn read_times(&mut self, keys: &[Key]) {
        for &(origin, element, bit) in keys {
            let (Origin::Elapsed(step), 0) = (origin, bit) else { continue };
            let bits: Vec<Lit> = (0..)
                .map_while(|bit| self.state_bits.get(&(origin, element, bit)).copied())
                .collect();
            self.state.elapsed[step.index()] =
                Some(Number::from_code(&mut self.maker.aig, &bits, 0));
        }
    }

    /// The steps that these variables represent.
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
