//! From chart to net: names resolved, macro-steps expanded, everything typed.
//!
//! Front ends hand over what was drawn ([`crate::chart`]); this is the one place that says what it means, so a mistake reads the same whatever the
//! language. All mistakes of a design are found at once: a pass that meets one leaves the item out and goes on.
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
mod placement;
pub mod program;
mod properties;
mod roles;
mod settings;
mod sharing;
mod statechart;
mod statements;
mod task_costs;
mod times;
mod transition_names;

#[cfg(test)]
mod tests;

pub use finished::{board, properties};
pub use libraries::alone;
pub use task_costs::TaskCosts;

use crate::chart::Design;
use crate::diag::{Diagnostic, any_error};
use crate::net::Net;
use crate::span::Span;
use crate::validate::{Valid, validate};
use context::Lowering;
use std::collections::BTreeSet;

/// A pass adds its share to the net.
type Pass = fn(&mut Lowering<'_>);

/// The passes with their stable names, in order. Each one's own documentation says what it needs of those before it.
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
    // It moves the ids of transitions, so what is made of the drawn ones comes before it.
    ("inner-histories", inner_history::inner_histories),
    // Last: it reads the lists and receptivities of everything.
    ("sharing", sharing::sharing),
];

/// The names of all passes, in the order in which they run.
pub fn passes() -> impl Iterator<Item = &'static str> {
    PIPELINE.iter().map(|(name, _)| *name)
}

/// Lowers a design to its net, with every finding of the design: errors, and warnings about what is probably not meant.
///
/// There is a net exactly if no finding is an error. The same design gives the same net and the same findings in the same order.
#[must_use]
pub fn lower(design: &Design) -> (Option<Valid<Net>>, Vec<Diagnostic>) {
    let lowered = lower_with(design, &TaskCosts::default());
    (lowered.net, lowered.found)
}

/// What [`lower_with`] gives.
#[derive(Debug, Clone)]
pub struct Lowered {
    /// The net; there is one exactly if no finding is an error.
    pub net: Option<Valid<Net>>,
    /// The findings.
    pub found: Vec<Diagnostic>,
    /// The places of the tasks that declare no cost: the [`crate::net::Meta::span`] of the tasks that they became, in macros and library charts that nothing
    /// uses too.
    pub undeclared: BTreeSet<Span>,
}

/// As [`lower`], with costs of tasks that declare none.
#[must_use]
pub fn lower_with(design: &Design, costs: &TaskCosts) -> Lowered {
    let (net, mut found, undeclared) = run(design, costs, PIPELINE);
    // A file of library charts alone is a good file, and nothing runs.
    if any_error(&found) || design.charts.is_empty() {
        return Lowered { net: None, found, undeclared };
    }
    match validate(net) {
        Ok(net) => {
            found.extend(lints::lints(&net));
            Lowered { net: Some(net), found, undeclared }
        }
        // Whatever a pass does not look for itself; the breach has its place in the source.
        Err(breaches) => {
            found.extend(breaches);
            Lowered { net: None, found, undeclared }
        }
    }
}

/// The net as it stands after a pass, for looking into the lowering, with costs of tasks that declare none; none if there is no pass of that name.
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

/// All passes, without a look at what nothing uses.
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
    // What nothing uses is in no net, but its mistakes are mistakes: they are found in a second lowering that expands each unused macro once.
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
