//! Transitions that never fire because a variable in their receptivity is never assigned.

use grafsynth_ir::Diagnostic;
use grafsynth_ir::diag::Notation;
use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::net::{Leaf, Net, StmtKind, TransitionId, VarId, VarOrigin};
use grafsynth_ir::simplify::simplify;
use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};

use crate::codes;

/// Transitions that never fire for any values of the other operands, with the variables whose initial values are the cause.
pub(super) fn causes(net: &Net) -> BTreeMap<TransitionId, Vec<VarId>> {
    let mut assigned: BTreeSet<VarId> = BTreeSet::new();
    for stmt in net.statements() {
        if let StmtKind::Assign { var, .. } = &stmt.kind {
            assigned.insert(*var);
        }
    }
    // Target-language code may assign anything.
    let has_code = net.statements().any(|stmt| matches!(stmt.kind, StmtKind::Code(_)));
    if has_code {
        return BTreeMap::new();
    }
    let is_fixed = |id: VarId| {
        let var = &net.vars[id];
        var.origin == VarOrigin::Declared && var.len.is_none() && !assigned.contains(&id)
    };
    let mut causes = BTreeMap::new();
    for (id, transition) in net.transitions.iter() {
        let guard = &transition.guard;
        let mut vars: Vec<VarId> = Vec::new();
        for leaf in guard.leaves() {
            if let Leaf::Var(var) = *leaf
                && is_fixed(var)
                && !vars.contains(&var)
            {
                vars.push(var);
            }
        }
        if !vars.is_empty() && simplify(&with_first_values(net, guard, &vars)).is_false() {
            causes.insert(id, vars);
        }
    }
    causes
}

fn with_first_values(net: &Net, guard: &Expr<Leaf>, vars: &[VarId]) -> Expr<Leaf> {
    let mut value_of = |leaf: &Leaf, span| {
        let fixed = vars.iter().find(|var| matches!(leaf, Leaf::Var(own) if own == *var));
        match fixed {
            Some(var) => {
                let value = net.vars[*var].init.first().copied().unwrap_or(0);
                let kind = match net.vars[*var].ty {
                    Type::Bool => ExprKind::Bool(value != 0),
                    Type::Int { .. } => ExprKind::Int(value),
                };
                Expr::new(kind, span)
            }
            None => Expr::leaf(*leaf, span),
        }
    };
    guard.map(&mut value_of, &mut |leaf, _| *leaf)
}

/// The finding about a transition that never fires, with the variables that are the cause.
pub(super) fn finding(net: &Net, id: TransitionId, vars: &[VarId]) -> Diagnostic {
    let data = &net.transitions[id];
    let value = |var: VarId| match (net.vars[var].ty, net.vars[var].init.first()) {
        (Type::Bool, Some(0) | None) => "false".to_owned(),
        (Type::Bool, Some(_)) => "true".to_owned(),
        (Type::Int { .. }, value) => value.copied().unwrap_or(0).to_string(),
    };
    let stays = vars
        .iter()
        .map(|var| {
            format!("`{}` is never assigned and is always {}", net.vars[*var].name, value(*var))
        })
        .join(", ");
    let mut warning = Diagnostic::warning(
        codes::DEAD_TRANSITION,
        format!("transition `{}` never fires: {}", data.name, stays),
    )
    .plural(
        format!("`{}`", data.name),
        "transitions",
        "never fire: they wait for variables that are never assigned",
    )
    .at(data.meta.span, "its receptivity is never true");
    for var in vars {
        warning = warning.at(net.vars[*var].name.span, "never assigned");
    }
    let first = &net.vars[vars[0]].name;
    warning
        .help(format!("assign `{first}`, or declare it as an input if it comes from outside"))
        .help_in(
            Notation::Scxml,
            format!("if `{first}` is a sensor, add g:role=\"input\" to its <data> and xmlns:g=\"urn:grafsynth:scxml:1\" to <scxml>; otherwise assign it"),
        )
        .help_in(
            Notation::Iec,
            format!("assign `{first}`, or declare it in VAR_INPUT if it comes from outside"),
        )
        .help_in(
            Notation::C,
            format!("assign `{first}`, or declare it `extern volatile` if it is an input"),
        )
}
