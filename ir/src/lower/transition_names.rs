//! Pass `transition-names`: a transition without a name is named after the steps before and after it: `p1_p2`, then `p1_p2_2`.
#![allow(clippy::wildcard_enum_match_arm, reason = "only transitions get a name here")]

use super::context::{Lowering, Work};
use crate::chart::{self, StepItemKind};
use crate::net::{Net, StepId};
use crate::span::{Name, Span};

/// Names the transitions that have no name. Runs after `expand`, when all names from the designer are in use.
pub(super) fn transition_names(lowering: &mut Lowering<'_>) {
    for index in 0..lowering.work.len() {
        let (scope, id, base, span) = match lowering.work[index] {
            Work::Transition { scope, id, source } => {
                if source.name.as_ref().is_some_and(|name| !name.text.is_empty()) {
                    continue;
                }
                let end = |paths: &[chart::Path]| {
                    paths.first().map(|path| path.to_string().replace('.', "_"))
                };
                let base = match (end(&source.sources), end(&source.targets)) {
                    (Some(from), Some(to)) => format!("{from}_{to}"),
                    (Some(from), None) => format!("{from}_out"),
                    (None, Some(to)) => format!("in_{to}"),
                    (None, None) => "always".to_owned(),
                };
                (scope, id, base, source.meta.span)
            }
            Work::Reaction { scope, id, step, source } => {
                let name = &lowering.net.steps[step].meta;
                let span = if source.span == Span::default() { name.span } else { source.span };
                let local = local_name(&lowering.net, step, &lowering.scopes[scope].prefix);
                let base = match &source.kind {
                    StepItemKind::On { events, .. } => match events.first() {
                        Some(event) => format!("{local}_on_{event}"),
                        None => format!("{local}_on"),
                    },
                    _ => unreachable!("only `on` items are reactions"),
                };
                (scope, id, base, span)
            }
            _ => continue,
        };
        let base = format!("{}{base}", lowering.scopes[scope].prefix);
        let name = lowering.fresh_name(&base);
        lowering.net.transitions[id].name = Name::new(name, span);
    }
}

fn local_name(net: &Net, step: StepId, prefix: &str) -> String {
    let full = &net.steps[step].name.text;
    full.strip_prefix(prefix).unwrap_or(full).to_owned()
}
