//! Pass `outputs`: converts the uses of each output to its driver: emissions, a controlled action, a variable, or calls (semantics §3.5, §3.6).

use super::codes;
use super::context::{Lowering, Outcome, Role, Symbol, Use, Work};
use super::place::Place;
use super::roles::{empty_driver, is_controlling, main_duration, more_timers};
use crate::chart::ActionHow;
use crate::diag::{Diagnostic, ErrorReported};
use crate::duration;
use crate::expr::{CompareOp, Expr, ExprKind};
use crate::net::{
    ActionId, ActionUse, ControlledAction, Driver, Emission, ExternCall, Leaf, OutputId, Qualifier,
    Stmt, StmtKind,
};
use crate::span::Span;
use std::collections::BTreeMap;

/// Lowers the uses of outputs to their drivers. Runs after `roles`; no later pass reads what it adds.
pub(super) fn outputs(lowering: &mut Lowering<'_>) {
    for id in lowering.net.outputs.ids() {
        let role = lowering.roles[id.index()];
        let driver = empty_driver(role, &lowering.net.outputs[id].driver);
        lowering.net.outputs[id].driver = driver;
    }
    for index in 0..lowering.drawn_actions.len() {
        let uses = std::mem::take(&mut lowering.drawn_actions[index].uses);
        let (id, name) =
            (lowering.drawn_actions[index].id, lowering.drawn_actions[index].name.clone());
        for one in uses.iter().filter(|one| one.arguments.is_some()) {
            lowering.report(
                Diagnostic::error(
                    codes::CALL_ARGUMENTS,
                    format!("`{name}` is an action, which takes no arguments"),
                )
                .at(one.span, "")
                .at(name.span, "declared here")
                .help(format!("write `{name}` without parentheses")),
            );
        }
        if let Some(id) = id {
            controlled(lowering, id, &uses);
        }
        lowering.drawn_actions[index].uses = uses;
    }
    // The outputs are processed in declaration order, so that the controlled actions of extern actions are in this order too.
    for index in 0..lowering.work.len() {
        let Work::Declaration { scope, symbol: Symbol::Output(id), .. } = lowering.work[index]
        else {
            continue;
        };
        let uses = std::mem::take(&mut lowering.uses[id.index()]);
        let role = lowering.roles[id.index()];
        match role {
            Role::Continuous | Role::Mealy => {
                let emissions = emissions(lowering, id, &uses);
                let output = &mut lowering.net.outputs[id];
                output.driver = if role == Role::Mealy {
                    Driver::Mealy(emissions)
                } else {
                    Driver::Continuous(emissions)
                };
            }
            Role::Controlled(action) => {
                for one in &uses {
                    no_arguments(lowering, id, one);
                }
                controlled(lowering, action, &uses);
            }
            Role::Extern => {
                let iec = lowering.iec.get(lowering.scopes[scope].chart).copied().unwrap_or(false);
                if iec || uses.iter().any(|one| is_controlling(one.how)) {
                    controlled_extern(lowering, id, &uses);
                } else {
                    calls(lowering, id, &uses);
                }
            }
            Role::Stored(_) | Role::Broken => {}
        }
        lowering.uses[id.index()] = uses;
    }
}

const CONDITION: &str = "the condition of an output";

/// The `if` of an action.
fn condition(lowering: &mut Lowering<'_>, one: &Use<'_>) -> Outcome<Option<Expr<Leaf>>> {
    let place = Place::level(one.scope, CONDITION);
    let written =
        one.condition.map(|condition| lowering.condition(condition, &place)).transpose()?;
    Ok(match lowering.counted.get(&one.step) {
        None => written,
        Some(var) => {
            let active = super::counted::is_active(*var, one.span, |leaf| leaf);
            Some(Expr::and(std::iter::once(active).chain(written)))
        }
    })
}

/// The condition of a continuous use, with its `after` or `for`.
fn timed_condition(lowering: &mut Lowering<'_>, one: &Use<'_>) -> Outcome<Option<Expr<Leaf>>> {
    let written = condition(lowering, one);
    let (op, ns) = match one.how {
        ActionHow::Bare | ActionHow::Qualified(Qualifier::N, None) => return written,
        ActionHow::After(ns) | ActionHow::Qualified(Qualifier::D, Some(ns)) => (CompareOp::Ge, ns),
        ActionHow::For(ns) | ActionHow::Qualified(Qualifier::L, Some(ns)) => (CompareOp::Lt, ns),
        ActionHow::Qualified(..) => return Err(wrong_duration(lowering, one)),
    };
    let ticks = lowering.ticks(ns, one.span);
    let (written, ticks) = (written?, ticks?);
    if ticks == 0 && op == CompareOp::Ge {
        return Ok(written);
    }
    let time = Expr::leaf(Leaf::Elapsed(one.step), one.span);
    let ticks = Expr::new(ExprKind::Int(i64::from(ticks)), one.span);
    let timed = Expr::compare(op, time, ticks);
    Ok(Some(Expr::and(written.into_iter().chain([timed]))))
}

fn emissions(lowering: &mut Lowering<'_>, id: OutputId, uses: &[Use<'_>]) -> Vec<Emission> {
    let mut emissions = Vec::with_capacity(uses.len());
    for one in uses {
        no_arguments(lowering, id, one);
        if let Ok(condition) = timed_condition(lowering, one) {
            emissions.push(Emission { step: one.step, condition, span: one.span });
        }
    }
    emissions
}

fn no_arguments(lowering: &mut Lowering<'_>, id: OutputId, one: &Use<'_>) {
    if one.arguments.is_some() {
        let name = lowering.net.outputs[id].name.clone();
        lowering.report(
            Diagnostic::error(
                codes::CALL_ARGUMENTS,
                format!("`{name}` is an output, which takes no arguments"),
            )
            .at(one.span, "")
            .at(name.span, "declared here")
            .help(format!(
                "write `{name}` without parentheses, or declare `extern action {name}()`"
            )),
        );
    }
}

fn arguments(lowering: &mut Lowering<'_>, id: OutputId, one: &Use<'_>) -> Outcome<Vec<Expr<Leaf>>> {
    let name = lowering.net.outputs[id].name.clone();
    let place = Place::level(one.scope, "an argument of a continuous call");
    lowering.arguments(&place, id, &name, one.arguments.unwrap_or(&[]), one.span)
}

fn calls(lowering: &mut Lowering<'_>, id: OutputId, uses: &[Use<'_>]) {
    let mut made = Vec::with_capacity(uses.len());
    for one in uses {
        let condition = timed_condition(lowering, one);
        let arguments = arguments(lowering, id, one);
        if let (Ok(condition), Ok(arguments)) = (condition, arguments) {
            made.push(ExternCall { step: one.step, condition, arguments, span: one.span });
        }
    }
    if let Driver::Extern { calls, .. } = &mut lowering.net.outputs[id].driver {
        *calls = made;
    }
}

/// Lowers an extern action with qualifiers: to one controlled action for each list of arguments, with the call as its body.
fn controlled_extern(lowering: &mut Lowering<'_>, id: OutputId, uses: &[Use<'_>]) {
    let mut by_arguments: BTreeMap<Vec<Expr<Leaf>>, usize> = BTreeMap::new();
    let mut groups: Vec<(Vec<Expr<Leaf>>, Vec<Use<'_>>)> = Vec::new();
    for one in uses {
        let Ok(arguments) = arguments(lowering, id, one) else { continue };
        let shape = arguments.iter().map(Expr::without_spans).collect();
        let group = *by_arguments.entry(shape).or_insert(groups.len());
        if group == groups.len() {
            groups.push((arguments, Vec::new()));
        }
        groups[group].1.push(*one);
    }
    let output = &lowering.net.outputs[id];
    let (name, meta) = (output.name.clone(), output.meta.clone());
    for (index, (arguments, uses)) in groups.into_iter().enumerate() {
        let mut name = name.clone();
        if index > 0 {
            name.text = lowering.fresh_name(&name.text);
        }
        let timers = more_timers(lowering, &name, &meta, &uses);
        let span = uses.first().map_or(name.span, |one| one.span);
        let call = Stmt { kind: StmtKind::Call { output: id, arguments }, span };
        let action = lowering.net.actions.push(ControlledAction {
            name,
            uses: Vec::new(),
            duration: 0,
            body: vec![call],
            meta: meta.clone(),
        });
        lowering.more_timers.insert(action, timers);
        controlled(lowering, action, &uses);
    }
}

/// Lowers the uses of a controlled action and its durations.
fn controlled(lowering: &mut Lowering<'_>, action: ActionId, uses: &[Use<'_>]) {
    let mut made = Vec::with_capacity(uses.len());
    let timers = lowering.more_timers.remove(&action).unwrap_or_default();
    let main = main_duration(uses);
    let mut duration_at: Option<(u64, Span)> = None;
    for one in uses {
        let (qualifier, ns) = match one.how {
            ActionHow::Bare => (Qualifier::N, None),
            ActionHow::After(ns) => (Qualifier::D, Some(ns)),
            ActionHow::For(ns) => (Qualifier::L, Some(ns)),
            ActionHow::Qualified(qualifier, ns) => (qualifier, ns),
        };
        if qualifier.is_timed() != ns.is_some() {
            wrong_duration(lowering, one);
            continue;
        }
        if let Some(ns) = ns.filter(|ns| main != Some(*ns))
            && matches!(qualifier, Qualifier::L | Qualifier::D)
            && let Some((_, timer)) = timers.iter().find(|(other, _)| *other == ns)
        {
            if let Ok(ticks) = lowering.ticks(ns, one.span) {
                lowering.net.actions[*timer].duration = ticks;
            }
            if let Ok(condition) = condition(lowering, one) {
                let (step, span) = (one.step, one.span);
                let own = ActionUse { step, qualifier, condition, span };
                lowering.net.actions[*timer].uses.push(own);
                let runs = Some(Expr::leaf(Leaf::Controlled(*timer), span));
                made.push(ActionUse { step, qualifier: Qualifier::N, condition: runs, span });
            }
            continue;
        }
        if let Some(ns) = ns {
            match duration_at {
                Some((first, first_span)) if first != ns => {
                    let name = lowering.net.actions[action].name.text.clone();
                    lowering.report(
                        Diagnostic::error(
                            codes::ACTION_DURATION,
                            format!("the stored qualifiers of action `{name}` have two durations, {} and {}", duration(first), duration(ns)),
                        )
                        .at(one.span, format!("{} here", duration(ns)))
                        .at(first_span, format!("{} here", duration(first)))
                        .help("SD, DS and SL of one action share its memory: use one duration for them, or two actions"),
                    );
                }
                Some(_) => {}
                None => {
                    duration_at = Some((ns, one.span));
                    if let Ok(ticks) = lowering.ticks(ns, one.span) {
                        lowering.net.actions[action].duration = ticks;
                    }
                }
            }
        }
        if let Ok(condition) = condition(lowering, one) {
            made.push(ActionUse { step: one.step, qualifier, condition, span: one.span });
        }
    }
    lowering.net.actions[action].uses = made;
}

fn wrong_duration(lowering: &mut Lowering<'_>, one: &Use<'_>) -> ErrorReported {
    let (qualifier, has) = match one.how {
        ActionHow::Qualified(qualifier, ns) => (format!("{qualifier:?}"), ns.is_some()),
        ActionHow::Bare | ActionHow::After(_) | ActionHow::For(_) => ("N".to_owned(), false),
    };
    let message = if has {
        format!("qualifier {qualifier} takes no duration")
    } else {
        format!("qualifier {qualifier} needs a duration")
    };
    let help = if has {
        "remove the duration, or use a timed qualifier"
    } else {
        "write a duration, such as `3 s`"
    };
    lowering.report(Diagnostic::error(codes::ACTION_DURATION, message).at(one.span, "").help(help))
}
