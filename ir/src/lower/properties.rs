//! Pass `properties`: assumptions about the environment and assertions about the chart.

use super::codes;
use super::context::{Lowering, Outcome, ScopeId, Work};
use super::place::Place;
use crate::chart;
use crate::diag::Diagnostic;
use crate::net::{Leaf, Property, PropertyLeaf, PropertyRole};

/// Lowers all properties. Runs after `roles`, which determines how outputs are read.
pub(super) fn properties(lowering: &mut Lowering<'_>) {
    for index in 0..lowering.work.len() {
        let Work::Property { scope, source } = lowering.work[index] else { continue };
        if let Ok(property) = property(lowering, scope, source) {
            lowering.net.properties.push(property);
        }
    }
}

/// One property; `always e` is `never not e`.
pub(super) fn property(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    source: &chart::Property,
) -> Outcome<Property> {
    let expr =
        lowering.condition::<PropertyLeaf>(&source.expr, &Place::level(scope, "a property"))?;
    // An assumption of a library chart must be guaranteed by the chart that uses it.
    let is_assumption = source.is_assumption && !lowering.is_in_instance(scope);
    let role = if is_assumption { PropertyRole::Assume } else { PropertyRole::Assert };
    if is_assumption {
        let is_about_inputs =
            expr.leaves().all(|leaf| matches!(leaf, PropertyLeaf::Net(Leaf::Input(_))));
        if !is_about_inputs {
            return Err(lowering.report(
                Diagnostic::error(codes::ASSUMPTION, "an assumption can only read inputs")
                    .at(source.expr.span, "")
                    .help("use `assert` for what the chart must do; the environment can only guarantee its inputs"),
            ));
        }
    }
    let never = if source.is_never { expr } else { expr.not() };
    let name = match &source.name {
        Some(name) => lowering.full_name(scope, name).text,
        None => String::new(),
    };
    Ok(Property { name, role, never, meta: source.meta.clone() })
}
