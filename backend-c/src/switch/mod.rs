//! The style `switch`: one small state variable for each sequential component; only the transitions of the active steps are tested.
// A variant that an emitter forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

mod emit;
mod plan;
mod table;

use crate::names::Names;
use crate::refusal::{Failure, Refusal};
use crate::style_output::StyleOutput;
use crate::{Options, Style};
use emit::Surroundings;
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::lower::program::frame;
use grafsynth_ir::net::Net;

/// The net in this style.
///
/// # Errors
/// If the style does not support something in the net, or the net has no reaction program.
pub(crate) fn program(
    net: &Valid<Net>,
    facts: &Facts,
    names: &Names,
    options: &Options,
) -> Result<StyleOutput, Failure> {
    let plan = plan::plan(net, facts).map_err(Failure::Refused)?;
    if options.style == Style::Auto && !pays(&plan) {
        return Err(Failure::Refused(Refusal {
            what: "a chart most of whose steps belong to no sequential component".to_string(),
            span: net.name.span,
        }));
    }
    let tables = table::Tables::choose(net, names, &plan, options);
    let surroundings = Surroundings::of(frame(net).map_err(Failure::Errors)?, net);
    Ok(emit::emit(net, facts, names, &plan, &tables, options, &surroundings))
}

/// Whether the components cover enough of the net for their variables to be better than one bit per step.
fn pays(plan: &plan::Plan) -> bool {
    let steps: usize = plan.machines.iter().map(|machine| machine.steps.len()).sum();
    let alone = plan.machines.iter().filter(|machine| machine.steps.len() == 1).count();
    alone <= 4 || alone * 3 <= steps
}
