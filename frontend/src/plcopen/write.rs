//! Charts to text.
use grafsynth_ir::Diagnostic;
use grafsynth_ir::net::Net;
pub(super) fn net(net: &Net) -> Result<String, Vec<Diagnostic>> {
    Err(vec![Diagnostic::error(crate::codes::CANNOT_WRITE, "not yet").at(net.name.span, "")])
}
