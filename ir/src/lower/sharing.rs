//! Pass `sharing`: carries out the sharing settings for variables of tasks (semantics §6).
#![allow(clippy::wildcard_enum_match_arm, reason = "only variables and stored outputs are shared")]

use super::codes;
use super::context::{Lowering, Role, Symbol, Work};
use crate::Gather;
use crate::diag::Diagnostic;
use crate::net::{Sharing, VarId, VarOrigin};
use crate::span::Span;
use std::collections::BTreeMap;

/// Lowers the sharing settings. Runs after all passes that make lists and receptivities: [`crate::sharing::separate`] rewrites them.
pub(super) fn sharing(lowering: &mut Lowering<'_>) {
    let mut said: BTreeMap<VarId, (Sharing, Span)> = BTreeMap::new();
    for index in 0..lowering.work.len() {
        let Work::Shared { scope, sharing, names } = lowering.work[index] else { continue };
        for path in names {
            let Ok(symbol) = lowering.symbol(scope, path) else { continue };
            let Some(var) = memory(lowering, symbol) else {
                lowering.wrong_kind(path.span(), path, symbol, "a variable or a stored output");
                continue;
            };
            match said.get(&var) {
                Some((other, first)) if *other != sharing => {
                    let first = *first;
                    lowering.report(
                        Diagnostic::error(
                            codes::SETTING_TWICE,
                            format!("`shared` is set twice for `{path}`"),
                        )
                        .at(path.span(), "again here")
                        .at(first, "first here")
                        .help("keep one of them"),
                    );
                }
                Some(_) => {}
                None => {
                    said.insert(var, (sharing, path.span()));
                }
            }
        }
    }
    let mut sharing: BTreeMap<VarId, Sharing> =
        said.into_iter().map(|(var, (sharing, _))| (var, sharing)).gather();
    if let Some(default) = lowering.sharing {
        for (id, var) in lowering.net.vars.iter() {
            if var.origin != VarOrigin::Hidden {
                sharing.entry(id).or_insert(default);
            }
        }
    }
    lowering.net.sharing = sharing;
    crate::sharing::separate(&mut lowering.net);
}

/// The variable that a name refers to.
fn memory(lowering: &Lowering<'_>, symbol: Symbol) -> Option<VarId> {
    match symbol {
        Symbol::Var(var) => Some(var),
        Symbol::Step(step) => lowering.counted.get(&step).copied(),
        Symbol::Output(output) => match lowering.roles.get(output.index())? {
            Role::Stored(var) => Some(*var),
            _ => None,
        },
        _ => None,
    }
}
