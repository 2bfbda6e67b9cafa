//! Pass `behaviour`: lowers the contents of steps, reactions and transitions in declaration order, so that `otherwise` sees exactly the transitions above
//! it.

use super::codes;
use super::context::{Lowering, Outcome, ScopeId, Symbol, Work};
use super::place::Place;
use super::receptivities::{event_list, receptivity};
use super::statements::ListKind;
use crate::chart::{self, Path, StepItemKind};
use crate::diag::Diagnostic;
use crate::expr::{CompareOp, Expr, ExprKind};
use crate::net::{Enter, Leaf, Meta, Policy, StepId, Task, TransitionId};
use crate::span::{Name, Span};

/// Lowers the contents of steps, reactions and transitions. Runs after `roles` and `declarations`, because conditions and lists read outputs.
pub(super) fn behaviour(lowering: &mut Lowering<'_>) {
    lowering.leaving = vec![Vec::new(); lowering.net.steps.len()];
    if lowering.is_statechart() {
        super::statechart::prepare(lowering);
    }
    for index in 0..lowering.work.len() {
        match lowering.work[index] {
            Work::Step { scope, id, source } => step(lowering, scope, id, source),
            Work::Reaction { scope, id, step, source } => {
                reaction(lowering, scope, id, step, source);
            }
            Work::Transition { scope, id, source } if lowering.is_statechart() => {
                super::statechart::transition(lowering, scope, id, source);
            }
            Work::Transition { scope, id, source } => transition(lowering, scope, id, source),
            Work::State { scope, id, source } => {
                super::statechart::state(lowering, scope, id, source);
            }
            Work::Action { scope, action, source } => {
                let list = lowering.block(scope, ListKind::Body, &source.body);
                if let Some(id) = lowering.drawn_actions[action].id {
                    lowering.net.actions[id].body = list;
                }
            }
            Work::Declaration { .. }
            | Work::Emergency { .. }
            | Work::Property { .. }
            | Work::Place { .. }
            | Work::Board { .. }
            | Work::Shared { .. } => {}
        }
    }
    priorities_without_effect(lowering);
}

/// The lists, the tasks and the budget of a step.
fn step<'a>(lowering: &mut Lowering<'a>, scope: ScopeId, id: StepId, source: &'a chart::Step) {
    let mut budget: Option<(u32, Span)> = None;
    let mut tasks: Vec<Task> = Vec::new();
    let mut unknown: Vec<&Name> = Vec::new();
    for item in &source.body {
        match &item.kind {
            StepItemKind::Entry(block) => {
                let list = lowering.block(scope, ListKind::Change, block);
                lowering.net.steps[id].entry.extend(list);
            }
            StepItemKind::Exit(block) => {
                let list = lowering.block(scope, ListKind::Change, block);
                lowering.net.steps[id].exit.extend(list);
            }
            StepItemKind::Budget(number) => {
                if let Some((_, first)) = budget {
                    let message = format!("step `{}` has two budgets", source.name);
                    let (code, spans) = (codes::SETTING_TWICE, [item.span, first]);
                    lowering.report(Diagnostic::twice(code, message, spans, "keep one of them"));
                } else {
                    budget = Some((*number, item.span));
                }
            }
            StepItemKind::Task { name, cost, body } => {
                if let Some(first) = tasks.iter().find(|task| task.name.text == name.text) {
                    let message = format!("step `{}` has two tasks `{name}`", source.name);
                    let (code, spans) = (codes::DUPLICATE_NAME, [name.span, first.name.span]);
                    let help = "give one of them another name";
                    lowering.report(Diagnostic::twice(code, message, spans, help));
                }
                let body = lowering.block(scope, ListKind::Task, body);
                let meta = Meta { span: item.span, ..Meta::default() };
                if cost.is_none() {
                    lowering.undeclared.insert(item.span);
                }
                let cost = cost.or_else(|| lowering.costs.of(item.span));
                unknown.extend(cost.is_none().then_some(name));
                tasks.push(Task { name: name.clone(), cost: cost.unwrap_or(0), body, meta });
            }
            StepItemKind::Code(code) => lowering.net.steps[id].code.push(code.clone()),
            // `outputs` handles actions, `expand` priorities, `forcing` forcing orders; reactions are separate work items.
            StepItemKind::Action { .. }
            | StepItemKind::On { .. }
            | StepItemKind::Priority(_)
            | StepItemKind::Force { .. } => {}
        }
    }
    if let Some((limit, span)) = budget {
        check_budget(lowering, &source.name, (limit, span), &tasks, &unknown);
    }
    if !tasks.is_empty() {
        // Without a budget there is no bound on what a step may run (semantics §6).
        lowering.net.steps[id].budget = budget.map_or(u32::MAX, |(limit, _)| limit);
        lowering.net.steps[id].tasks = tasks;
    }
}

/// Checks that a step with a budget has tasks, that their costs are known, and that each fits.
fn check_budget(
    lowering: &mut Lowering<'_>,
    step: &Name,
    (limit, span): (u32, Span),
    tasks: &[Task],
    unknown: &[&Name],
) {
    if tasks.is_empty() {
        let message = format!("step `{step}` has a budget but no task");
        lowering.report(
            Diagnostic::warning(codes::NO_EFFECT, message)
                .plural(format!("`{step}`"), "steps", "have a budget and no task")
                .at(span, "")
                .help("write `task NAME cost N { .. }` in it, or remove the budget"),
        );
    }
    for name in unknown {
        let message =
            format!("task `{name}` has no cost, but its step `{step}` has a budget of {limit}");
        lowering.report(
            Diagnostic::error(codes::TASK_WITHOUT_COST, message)
                .at(name.span, "no `cost` here")
                .at(span, "the budget")
                .help("write `cost N` after its name, or select a machine with a cost model: `--for avr`"),
        );
    }
    for Task { name, cost, .. } in tasks.iter().filter(|task| task.cost > limit) {
        let message =
            format!("task `{name}` costs {cost}, but its step `{step}` has a budget of {limit}");
        lowering.report(
            Diagnostic::error(codes::BUDGET, message)
                .at(name.span, "can never run")
                .at(span, "the budget")
                .help("split the task, or raise the budget"),
        );
    }
}

fn reaction<'a>(
    lowering: &mut Lowering<'a>,
    scope: ScopeId,
    id: TransitionId,
    step: StepId,
    source: &'a chart::StepItem,
) {
    let StepItemKind::On { events, guard, actions } = &source.kind else {
        unreachable!("only `on` items become reactions");
    };
    let events = event_list(lowering, scope, events);
    let place =
        Place { edges: true, events: true, ..Place::level(scope, "the condition of a reaction") };
    let guard = guard.as_ref().map(|guard| lowering.condition::<Leaf>(guard, &place));
    let actions = lowering.block(scope, ListKind::Change, actions);
    let reaction = &mut lowering.net.transitions[id];
    reaction.requires = vec![step];
    reaction.events = events;
    if let Some(Ok(guard)) = guard {
        reaction.guard = guard;
    }
    reaction.actions = actions;
    reaction.restart = false;
    reaction.meta.span = source.span;
}

/// The source or target side of a transition.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Source,
    Target,
}

fn transition<'a>(
    lowering: &mut Lowering<'a>,
    scope: ScopeId,
    id: TransitionId,
    source: &'a chart::Transition,
) {
    if source.is_internal {
        return reaction_of_step(lowering, scope, id, source);
    }
    let requires = steps(lowering, scope, &source.sources, End::Source);
    let enters = steps(lowering, scope, &source.targets, End::Target);
    let events = event_list(lowering, scope, &source.events);
    let guard = receptivity(lowering, scope, source, requires.as_deref().ok());
    let actions = lowering.block(scope, ListKind::Change, &source.actions);
    if source.sources.is_empty() && source.targets.is_empty() {
        lowering.report(
            Diagnostic::error(codes::WRONG_KIND, "a transition needs a step on at least one side")
                .at(source.meta.span, "")
                .help("name the steps before and after it"),
        );
    }
    let (Ok(requires), Ok(mut enters)) = (requires, enters) else { return };
    for step in &requires {
        lowering.leaving[step.index()].push(id);
    }
    let changes = super::counted::changes(lowering, &requires, &enters, source.meta.span);
    if !changes.is_empty() {
        if source.restart {
            lowering.report(
                Diagnostic::error(codes::COUNTED, "a transition of a counted step cannot restart it")
                    .at(source.meta.span, "")
                    .help("remove `restart`: the number decreases by one and increases by one, so it does not change"),
            );
        }
        // The hidden step of a counted step never becomes inactive: its variable stores the number of activations.
        enters.extend(requires.iter().copied().filter(|step| lowering.counted.contains_key(step)));
        enters.sort_unstable();
        enters.dedup();
    }
    let transition = &mut lowering.net.transitions[id];
    transition.requires.clone_from(&requires);
    transition.clears = requires;
    transition.enters = enters.into_iter().map(Enter::Step).collect();
    transition.events = events;
    transition.actions = changes;
    transition.actions.extend(actions);
    if let Ok(guard) = guard {
        transition.guard = guard;
    }
}

/// Lowers `in a on E do { .. }`: the reaction of a step, written as a transition so that it can have a name.
fn reaction_of_step<'a>(
    lowering: &mut Lowering<'a>,
    scope: ScopeId,
    id: TransitionId,
    source: &'a chart::Transition,
) {
    let refused = if !source.targets.is_empty() {
        Some((
            "an internal transition is allowed only in a statechart",
            "remove `internal`, or write `in STEP on EVENT do { .. }` without a target",
        ))
    } else if source.restart || source.priority.is_some() {
        Some((
            "a reaction leaves no step, so `restart` and `priority` are not allowed",
            "remove the word",
        ))
    } else if source.sources.len() != 1 {
        Some(("a reaction belongs to exactly one step", "write one reaction for each step"))
    } else {
        None
    };
    if let Some((message, help)) = refused {
        lowering.report(
            Diagnostic::error(codes::CHART_KIND, message).at(source.meta.span, "").help(help),
        );
        return;
    }
    let step = match lowering.symbol(scope, &source.sources[0]) {
        Ok(Symbol::Step(step)) => Ok(step),
        Ok(other) => {
            let path = &source.sources[0];
            Err(lowering.wrong_kind(path.span(), path, other, "a step"))
        }
        Err(reported) => Err(reported),
    };
    let events = event_list(lowering, scope, &source.events);
    let place =
        Place { edges: true, events: true, ..Place::level(scope, "the condition of a reaction") };
    let guard = source.guard.as_ref().map(|guard| lowering.condition::<Leaf>(guard, &place));
    let after = source.after.as_ref();
    let after = after.map(|(length, span)| (lowering.length(scope, length, *span), *span));
    let actions = lowering.block(scope, ListKind::Change, &source.actions);
    let Ok(step) = step else { return };
    let mut operands: Vec<Expr<Leaf>> = guard.into_iter().flatten().collect();
    if let Some((Ok(ticks), span)) = after
        && ticks > 0
    {
        let ticks = Expr::new(ExprKind::Int(i64::from(ticks)), span);
        operands.push(Expr::compare(CompareOp::Ge, Expr::leaf(Leaf::Elapsed(step), span), ticks));
    }
    let reaction = &mut lowering.net.transitions[id];
    reaction.requires = vec![step];
    reaction.events = events;
    reaction.guard = Expr::and(operands);
    reaction.actions = actions;
}

/// The steps on one side of a transition, in declaration order. A macro-step as a source means its exit step; as a target it means its entry step.
fn steps(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    paths: &[Path],
    end: End,
) -> Outcome<Vec<StepId>> {
    let mut found: Vec<StepId> = Vec::new();
    let mut failed = None;
    for path in paths {
        match one_step(lowering, scope, path, end) {
            Ok(step) if found.contains(&step) => {
                lowering.report(
                    Diagnostic::warning(
                        codes::STEP_TWICE,
                        format!("step `{path}` is listed twice"),
                    )
                    .at(path.span(), "again here")
                    .help("remove it: one mention is enough"),
                );
            }
            Ok(step) => found.push(step),
            Err(reported) => failed = Some(reported),
        }
    }
    found.sort_unstable();
    failed.map_or(Ok(found), Err)
}

fn one_step(lowering: &mut Lowering<'_>, scope: ScopeId, path: &Path, end: End) -> Outcome<StepId> {
    let symbol = lowering.wanting("step", |lowering| lowering.symbol(scope, path))?;
    if let Symbol::Step(step) = symbol {
        return Ok(step);
    }
    if let Symbol::MacroStep(instance) = symbol {
        let instance = &lowering.instances[instance];
        let step = if end == End::Source { instance.exit } else { instance.entry };
        return step.ok_or_else(|| lowering.already_told());
    }
    Err(lowering.wrong_kind(path.span(), path, symbol, "a step"))
}

/// Warns about priorities that the conflict policy ignores.
fn priorities_without_effect(lowering: &mut Lowering<'_>) {
    let (of_transitions, of_steps, policy) = match lowering.net.settings.policy {
        Policy::All => (false, false, "all"),
        Policy::Priority => (true, false, "priority"),
        Policy::PriorityAge => (false, true, "priority-age"),
        // In statecharts a priority is an error, which is reported elsewhere.
        Policy::InnerFirst | Policy::OuterFirst => return,
    };
    let transitions = lowering.net.transitions.values();
    let transition =
        transitions.filter(|one| one.priority.is_some() && !of_transitions).map(|one| {
            (
                "transition",
                one.name.text.clone(),
                one.meta.span,
                "priorities of steps: write `priority` in the following step",
            )
        });
    let steps = lowering.net.steps.values();
    let step = steps
        .filter(|one| one.priority.is_some() && !of_steps)
        .map(|one| ("step", one.name.text.clone(), one.name.span, "priorities of transitions"));
    let found: Vec<_> = transition.chain(step).collect();
    for (what, name, span, other) in found {
        let help = match lowering.net.settings.policy {
            Policy::All => "all fireable transitions fire: choose `conflict priority`, or make the conditions mutually exclusive".to_owned(),
            Policy::Priority | Policy::PriorityAge | Policy::InnerFirst | Policy::OuterFirst => {
                format!("`conflict {policy}` uses {other}")
            }
        };
        lowering.report(
            Diagnostic::warning(
                codes::PRIORITY_UNUSED,
                format!("the priority of {what} `{name}` has no effect under `conflict {policy}`"),
            )
            .plural(
                format!("`{name}`"),
                format!("the priorities of the {what}s"),
                format!("have no effect under `conflict {policy}`"),
            )
            .at(span, "")
            .help(help),
        );
    }
}
