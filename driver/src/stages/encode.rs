//! Stage 1: the circuit of the net with the codes of its steps, and with synchronisers.

use crate::circuit::{delayed_vectors, synchronised};
use crate::coding::{self, EncodedLogic, EncodingCache};
use crate::context::BuildContext;
use grafsynth_backend_pld::EmitOptions;
use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::synchronise::Chain;
use grafsynth_ir::Diagnostic;
use grafsynth_ir::logic::Logic;
use std::rc::Rc;

/// The circuit to write.
pub(crate) struct Encoded {
    /// The circuit with its codes, and how they were chosen.
    pub(crate) coded: EncodedLogic,
    /// The circuit to emit, without synchronisers.
    pub(crate) logic: Logic,
    /// The circuit with its synchronisers.
    pub(crate) circuit: Logic,
    pub(crate) chains: Vec<Chain>,
    /// The options for the back end, with the reset and the test vectors.
    pub(crate) options: EmitOptions,
}

impl Encoded {
    /// The equations of the circuit, if they were made to choose its codes.
    pub(crate) fn equations(&self) -> Option<Rc<Equations>> {
        self.coded.equations.clone().filter(|_| self.chains.is_empty())
    }
}

/// Chooses codes for the language and the device, and adds synchronisers.
///
/// # Errors
/// A stimulus that cannot become test vectors of this circuit.
pub(crate) fn encode(context: &BuildContext<'_>) -> Result<Encoded, Vec<Diagnostic>> {
    let BuildContext { net, facts, options, medium, .. } = *context;
    let wishes = context.emit_options();
    let (choice, safe) = (options.encoding, options.safe);
    let cache = &mut EncodingCache::default();
    let timed = coding::Timed { logic: context.logic, own_timers: context.own_timers };
    let coded =
        coding::code_timed(cache, net, facts, timed, (choice, safe), medium.dialect(), &wishes);
    let logic = coded.emitted();
    // The synchronisers come last, so the reset passes through some of them, too, and does not touch the others.
    let circuit = EncodedLogic::with_reset(logic.clone(), &wishes);
    let (circuit, chains) = synchronised(net, circuit, options.synchronise);
    let delayed = |stimulus| delayed_vectors(net, &logic, &circuit, &chains, stimulus);
    let vectors = options.stimulus.as_ref().map(delayed).transpose()?;
    let options = EmitOptions { reset: options.reset.clone(), vectors, ..wishes };
    Ok(Encoded { coded, logic, circuit, chains, options })
}
