//! Stage 3: the circuit that an independent parser reads from the output, without the parts that the chart does not have.

use super::emit::Written;
use super::encode::Encoded;
use crate::circuit;
use crate::jedec::{self, Burned};
use grafsynth_backend_pld::synchronise::Chain;
use grafsynth_backend_pld::{Emitted, reset, synchronise};
use grafsynth_ir::Diagnostic;
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_logic::state_assignment::observe;

/// The written output, and the circuit in it.
pub(crate) struct ReadBack {
    pub(crate) content: Content,
    /// The circuit, without reset and synchronisers; it shows the steps in every encoding.
    pub(crate) circuit: Logic,
}

/// The written output, after it was read back.
pub(crate) enum Content {
    Text(Emitted),
    Fuses(Box<Burned>),
}

/// Reads the written output, and removes the reset and the synchronisers after a check that they have no other effect.
///
/// # Errors
/// The text cannot be read back, or its meaning differs from the circuit.
pub(crate) fn read_back(encoded: &Encoded, written: Written) -> Result<ReadBack, Vec<Diagnostic>> {
    let (content, circuit) = match written {
        Written::Text(emitted) => {
            let circuit = circuit::read_back(&emitted)?;
            (Content::Text(emitted), circuit)
        }
        Written::Fuses(text) => {
            let burned = jedec::read_back(text)?;
            let circuit = burned.logic.clone();
            (Content::Fuses(Box::new(burned)), circuit)
        }
    };
    let strip_chains = |circuit| synchronise::strip(circuit, &encoded.chains);
    // A reset of the language is not in the circuit that was written, so it goes first; one that passes through a chain goes last.
    let is_reset = |chain: &Chain| encoded.circuit.inputs[chain.input].role == PinRole::Reset;
    let mut circuit = match encoded.chains.iter().any(is_reset) {
        true => reset::strip(strip_chains(circuit)?)?,
        false => strip_chains(reset::strip(circuit)?)?,
    };
    observe(&encoded.coded.logic, &mut circuit);
    Ok(ReadBack { content, circuit })
}
