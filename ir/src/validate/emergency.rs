//! Safe values and the condition that forces them (invariant 32).

use super::Checker;
use crate::Gather;
use crate::codes;
use crate::diag::Diagnostic;
use crate::net::{InputId, InputKind, Leaf, Net};
use std::collections::BTreeSet;

impl Checker<'_> {
    /// Reports what prevents an emergency from forcing every output at once, and safe values outside the type of the output.
    pub(super) fn emergency(&mut self) {
        let net = self.net;
        for output in net.outputs.values() {
            let Some(safe) = output.safe else { continue };
            let (name, span) = (&output.name, output.name.span);
            if output.is_extern() {
                let message = format!("the extern action `{name}` has a safe value");
                let help =
                    "remove the safe value: an emergency only stops calling an extern action";
                self.report_with_help(codes::BAD_INIT, span, message, help);
            } else if matches!(output.ty.bounds(), (lo, hi) if safe < lo || safe > hi) {
                let message = format!("the safe value {safe} of `{name}` is outside its type");
                self.report(codes::BAD_INIT, span, message);
            }
        }
        self.out.extend(unenforceable(net));
    }
}

/// The reasons why the emergency of a net cannot force every output at once. They need only the declarations and the condition, so [`crate::lower`] reports
/// them for a chart with other errors too.
pub(crate) fn unenforceable(net: &Net) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let Some(emergency) = &net.emergency else { return found };
    let span = emergency.meta.span;
    let is_extern =
        |id: &InputId| net.inputs.get(*id).is_some_and(|input| input.kind == InputKind::Extern);
    let read = emergency.condition.leaves().filter_map(Leaf::input);
    let asked: BTreeSet<InputId> = read.filter(is_extern).gather();
    for name in asked.into_iter().map(|id| &net.inputs[id].name) {
        found.push(
            Diagnostic::error(
                codes::EMERGENCY,
                format!("the emergency reads the extern condition `{name}`"),
            )
            .at(emergency.condition.span, "")
            .at(name.span, "declared here")
            .help("make it an input: an emergency must not wait for a function call"),
        );
    }
    for output in net.outputs.values().filter(|output| output.registered) {
        let name = &output.name;
        found.push(
            Diagnostic::error(
                codes::EMERGENCY,
                format!(
                    "the output `{name}` is registered, so an emergency cannot force it between clock edges"
                ),
            )
            .at(name.span, "declared here")
            .at(span, "forces all outputs")
            .help("remove `registered`"),
        );
    }
    if let Some(open) = net.unspecified.first() {
        found.push(
            Diagnostic::error(codes::EMERGENCY, "a net with an emergency contains open cells")
                .at(span, "")
                .at(open.when.span, "outputs have no defined value here")
                .help("specify the open cells, or remove the emergency"),
        );
    }
    found
}
