//! From chart to net: names resolved, macro-steps expanded, everything typed.
//!
//! Front ends pass on what was drawn ([`crate::chart`]); only this module interprets it, so an error is reported in the same words for every language. All
//! errors of a design are found in one run: a pass that finds one skips the item and continues.
//!
//! ```
//! use grafsynth_ir::chart::{Chart, Design, Item, Step, StepRole};
//! use grafsynth_ir::{FileId, Name, Span, lower};
//!
//! let name = |text| Name::new(text, Span::new(FileId(0), 0, 0));
//! let step = Step { name: name("p1"), role: StepRole::Initial, ..Step::default() };
//! let chart = Chart { name: name("demo"), items: vec![Item::Step(step)], ..Chart::default() };
//! let (net, findings) = lower::lower(&Design { charts: vec![chart], ..Design::default() });
//! assert!(findings.is_empty());
//! assert_eq!(net.unwrap().steps.len(), 1);
//! ```
// If a pass forgot a variant, the net would be wrong.
#![warn(clippy::wildcard_enum_match_arm)]

mod beginnings;
mod behaviour;
pub mod codes;
mod context;
mod counted;
mod declarations;
mod emergency;
mod expand;
mod expressions;
mod finished;
mod forcing;
mod inner_history;
mod libraries;
mod limit;
pub mod lints;
mod names;
mod outputs;
mod place;
mod placement;
pub mod program;
mod properties;
mod receptivities;
mod roles;
mod settings;
mod sharing;
mod statechart;
mod statements;
mod task_costs;
mod times;
mod transition_names;

#[cfg(test)]
#[allow(clippy::wildcard_enum_match_arm, reason = "each test names what it expects")]
mod tests;

pub use finished::{board, properties};
pub use libraries::alone;
pub use task_costs::TaskCosts;

use crate::chart::Design;
use crate::diag::{Diagnostic, any_error};
use crate::net::Net;
use crate::span::Span;
use crate::validate::emergency::unenforceable;
use crate::validate::{Valid, validate};
use context::Lowering;
use std::collections::BTreeSet;

/// A pass; it adds its part to the net.
type Pass = fn(&mut Lowering<'_>);

/// The passes with their stable names, in order. The documentation of each pass names the passes that must run before it.
const PIPELINE: &[(&str, Pass)] = &[
    ("settings", settings::settings),
    ("expand", expand::expand),
    ("transition-names", transition_names::transition_names),
    ("roles", roles::roles),
    ("declarations", declarations::declarations),
    ("behaviour", behaviour::behaviour),
    ("outputs", outputs::outputs),
    ("arguments", libraries::arguments),
    ("statecharts", statechart::statecharts),
    ("forcing", forcing::forcing),
    ("beginnings", beginnings::beginnings),
    ("emergency", emergency::emergency),
    ("properties", properties::properties),
    ("placement", placement::placement),
    ("limit", limit::limit),
    // This pass changes the ids of transitions, so all passes that depend on the transitions as drawn run before it.
    ("inner-histories", inner_history::inner_histories),
    // Last, because it reads all lists and receptivities.
    ("sharing", sharing::sharing),
];

/// The names of all passes, in the order in which they run.
pub fn passes() -> impl Iterator<Item = &'static str> {
    PIPELINE.iter().map(|(name, _)| *name)
}

/// Lowers a design to its net, with all findings of the design: errors, and warnings about probable mistakes.
///
/// There is a net if and only if no finding is an error. The same design gives the same net and the same findings in the same order.
#[must_use]
pub fn lower(design: &Design) -> (Option<Valid<Net>>, Vec<Diagnostic>) {
    let lowered = lower_with(design, &TaskCosts::default());
    (lowered.net, lowered.found)
}

/// The result of [`lower_with`].
#[derive(Debug, Clone)]
pub struct Lowered {
    /// The net; there is one if and only if no finding is an error.
    pub net: Option<Valid<Net>>,
    /// The findings.
    pub found: Vec<Diagnostic>,
    /// The locations of the tasks that declare no cost: the [`crate::net::Meta::span`] of the tasks that they became. Tasks of unused macros and library
    /// charts are included.
    pub undeclared: BTreeSet<Span>,
}

/// Like [`lower`], with costs for tasks that declare none.
#[must_use]
pub fn lower_with(design: &Design, costs: &TaskCosts) -> Lowered {
    let (net, mut found, undeclared) = run(design, costs, PIPELINE);
    // A file that contains only library charts is valid, but there is nothing to run.
    if any_error(&found) || design.charts.is_empty() {
        found.extend(unenforceable(&net));
        return Lowered { net: None, found, undeclared };
    }
    match validate(net) {
        Ok(net) => {
            found.extend(lints::lints(&net));
            Lowered { net: Some(net), found, undeclared }
        }
        // Violations that no pass checks itself; each one has a source location.
        Err(breaches) => {
            found.extend(breaches);
            Lowered { net: None, found, undeclared }
        }
    }
}

/// The net after a pass, for debugging the lowering, with costs for tasks that declare none; `None` if no pass has this name.
#[must_use]
pub fn dump_after(design: &Design, costs: &TaskCosts, pass: &str) -> Option<Net> {
    let end = PIPELINE.iter().position(|(name, _)| *name == pass)?;
    let mut lowering = Lowering::new(design);
    lowering.costs = costs.clone();
    for (_, pass) in &PIPELINE[..=end] {
        pass(&mut lowering);
    }
    Some(lowering.net)
}

/// Runs all passes, without checking unused items.
fn all_passes(lowering: &mut Lowering<'_>) {
    for (_, pass) in PIPELINE {
        pass(lowering);
    }
}

fn run(
    design: &Design,
    costs: &TaskCosts,
    pipeline: &[(&str, Pass)],
) -> (Net, Vec<Diagnostic>, BTreeSet<Span>) {
    let mut lowering = Lowering::new(design);
    lowering.costs = costs.clone();
    for (_, pass) in pipeline {
        pass(&mut lowering);
    }
    libraries::duplicates(&mut lowering);
    libraries::unused(&mut lowering);
    if lowering.macros.iter().all(|one| one.is_used) {
        return (lowering.net, lowering.found.list, lowering.undeclared);
    }
    // Unused items are in no net, but their errors are reported: a second lowering expands each unused macro once.
    let mut second = Lowering::new(design);
    second.costs = costs.clone();
    second.expand_unused = true;
    for (_, pass) in pipeline {
        pass(&mut second);
    }
    lowering.undeclared.append(&mut second.undeclared);
    for finding in second.found.list {
        if finding.is_error() {
            lowering.found.add(finding);
        }
    }
    (lowering.net, lowering.found.list, lowering.undeclared)
}
