//! The stages of one circuit: each is a function of the [`BuildContext`] and of the artefact of the stage before.
//!
//! ```text
//! encode      Encoded    codes of steps, don't-cares, synchronisers, test vectors
//! emit        Written    a text, or a fuse map with its placement
//! read_back   ReadBack   the circuit that an independent reader finds in it
//! prove       Proved     whether this circuit equals the net, dominates in an emergency, and is safe
//! describe    Described  the report, the files and the data of the report page
//! ```
//! The stages of C are in [`c`].

pub(crate) mod c;
mod describe;
mod emit;
mod encode;
mod prove;
mod read_back;

use crate::context::BuildContext;
use crate::fit_advice;
pub(crate) use describe::Described;
use encode::Encoded;
use grafsynth_ir::Diagnostic;
use read_back::ReadBack;

/// Makes one output, from the circuit of the net to the description.
///
/// # Errors
/// The language or the device does not support something; if it does not fit, with advice on what would.
pub(crate) fn circuit(context: &BuildContext<'_>) -> Result<Described, Vec<Diagnostic>> {
    let (encoded, read_back) = written_and_read(context).map_err(|mut found| {
        fit_advice::advise(context, &mut found);
        found
    })?;
    let proved = prove::prove(context, &encoded, &read_back);
    Ok(describe::describe(context, encoded, read_back, proved))
}

fn written_and_read(context: &BuildContext<'_>) -> Result<(Encoded, ReadBack), Vec<Diagnostic>> {
    let encoded = encode::encode(context)?;
    let written = emit::emit(context, &encoded)?;
    let read_back = read_back::read_back(&encoded, written)?;
    Ok((encoded, read_back))
}
