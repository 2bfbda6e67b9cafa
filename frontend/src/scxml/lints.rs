//! Warnings about valid documents that are probably mistakes.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;

use super::tree::{Child, Machine, State, StateKind};
use crate::codes;
use crate::findings::Findings;

/// Reports all warnings.
pub(super) fn lints(machine: &Machine, found: &mut Findings) {
    machine.each_state(&mut |state| {
        if state.kind == StateKind::Parallel {
            between_regions(state, found);
        }
    });
}

/// Warns about transitions between two children of `<parallel>` that are single states. The children are active together, so such a
/// transition leaves and enters all of them. Regions with states of their own are not checked.
fn between_regions(parallel: &State, found: &mut Findings) {
    let regions: BTreeMap<&str, Span> = parallel
        .states()
        .filter(|region| region.kind == StateKind::State && region.states().next().is_none())
        .filter_map(|region| Some((region.id.as_ref()?.text.as_str(), region.span)))
        .gather();
    for region in parallel.states() {
        let Some(from) = region.id.as_ref().map(|id| id.text.as_str()) else { continue };
        if !regions.contains_key(from) {
            continue;
        }
        for child in &region.children {
            let Child::Transition(transition) = child else { continue };
            let [to] = transition.targets.as_slice() else { continue };
            let to = to.text.as_str();
            let Some(target) = regions.get(to).filter(|_| to != from) else { continue };
            let around =
                parallel.id.as_ref().map_or_else(String::new, |id| format!(" `{}`", id.text));
            let (at, source, target) = (transition.span, region.span, *target);
            found.report(|| {
                Diagnostic::warning(
                    codes::SCXML_REGIONS,
                    format!("`{from}` and `{to}` are always active together: they are two regions of <parallel>{around}"),
                )
                .at(at, format!("this leaves <parallel>{around} and enters all its regions again"))
                .at(source, "one region")
                .at(target, "another region")
                .help(format!(
                    "to switch from `{from}` to `{to}`, put both into one <state> inside <parallel>{around}"
                ))
            });
        }
    }
}
