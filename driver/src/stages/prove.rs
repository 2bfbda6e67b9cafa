//! Stage 4: what is proved about the circuit that was read back.

use super::encode::Encoded;
use super::read_back::ReadBack;
use crate::circuit_notes::safe;
use crate::context::BuildContext;
use crate::output_report::{Note, OutputReport};
use grafsynth_verify::equiv::only_tested;
use grafsynth_verify::{OpenReason, dominates, equiv};

/// The results.
pub(crate) struct Proved {
    /// Whether the circuit equals the net.
    pub(crate) report: OutputReport,
    /// Whether the emergency dominates in every state, for a chart that has one.
    pub(crate) emergency: Option<Note>,
    /// Whether every illegal code returns, if that was requested.
    pub(crate) safety: Option<Note>,
}

/// Proves that the circuit equals the net; without `prove`, it is only tested.
pub(crate) fn prove(context: &BuildContext<'_>, encoded: &Encoded, read_back: &ReadBack) -> Proved {
    let BuildContext { net, facts, options, .. } = *context;
    let (circuit, limits) = (&read_back.circuit, &options.limits);
    let verdict = if options.prove {
        equiv(net, facts, circuit, limits)
    } else {
        only_tested(net, circuit, vec![OpenReason::NotAsked], limits)
    };
    let dominance = options.prove.then(|| dominates(net, circuit, limits)).flatten();
    Proved {
        report: OutputReport::of_verdict(&context.file_name(), net, circuit, verdict),
        emergency: dominance.map(Note::Emergency),
        safety: options.safe.then(|| safe(&encoded.logic, circuit)),
    }
}
