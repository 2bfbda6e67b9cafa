//! The stages of one circuit: each is a function of the [`BuildContext`] and of the artefact of the stage before.
//!
//! ```text
//! encode      Encoded    codes of steps, don't-cares, synchronisers, test vectors
//! emit        Written    a text, or a fuse map with its placement
//! read_back   ReadBack   the circuit that an independent parser reads from it
//! prove       Proved     whether this circuit equals the net, its emergency dominates, and it is safe
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

#[cfg(test)]
mod tests {
    use super::emit::Written;
    use super::{emit, encode};
    use crate::built::BuildOptions;
    use crate::circuit::{facts, logic};
    use crate::context::{BuildContext, Medium};
    use grafsynth_backend_pld::Dialect;
    use grafsynth_ir::{FileId, lower};
    use std::rc::Rc;

    #[test]
    fn the_sums_that_chose_the_codes_are_the_sums_of_the_text() {
        let text = "chart lamp { input a, b output R initial step off step on { R } off -> on when a on -> off when b }";
        let parsed = grafsynth_frontend::graf::parse(FileId(0), text);
        let (net, found) = lower::lower(&parsed.design.expect("a chart"));
        let net = net.unwrap_or_else(|| panic!("{found:?}"));
        let options = BuildOptions::default();
        let facts = facts(&net, &options.limits);
        let logic = logic(&net, &facts).expect("a circuit");
        for dialect in [Dialect::Palasm, Dialect::Cupl, Dialect::Galasm] {
            let medium = Medium::Text(dialect);
            let (net, facts, logic, options) = (&net, &facts, &logic, &options);
            let context = BuildContext { net, facts, logic, own_timers: None, options, medium };
            let encoded = encode::encode(&context).expect("codes");
            let Ok(Written::Text(emitted)) = emit::emit(&context, &encoded) else {
                panic!("{dialect:?} is not emitted")
            };
            let (chosen, printed) = (encoded.equations(), emitted.equations);
            let (chosen, printed) = (chosen.expect("sums"), printed.expect("sums"));
            assert!(Rc::ptr_eq(&chosen, &printed), "{dialect:?} is minimised twice");
        }
    }
}
