//! The style `bits`: the reaction program, printed.

use crate::Options;
use crate::cprogram::CProgram;
use crate::names::Names;
use grafsynth_ir::Valid;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::Net;

pub(crate) fn program(
    net: &Valid<Net>,
    names: &Names,
    options: &Options,
) -> Result<CProgram, Vec<Diagnostic>> {
    let _ = (net, names, options);
    Err(vec![Diagnostic::error(crate::codes::STYLE_REFUSED, "the style `bits` is not there yet")])
}
