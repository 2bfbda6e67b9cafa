//! Warnings about transitions that leave more steps active than the designer probably intended. Examples are a source transition next to an initial step, and
//! parallel branches that end separately.

use crate::Gather;
use std::collections::BTreeSet;

use super::super::codes;
use super::place;
use crate::arena::IdMap;
use crate::diag::{Diagnostic, Notation};
use crate::expr::{Expr, ExprKind};
use crate::net::{
    Enter, Leaf, Net, Policy, Step, StepId, Transition, TransitionId, TransitionKind,
};

/// The maximum number of steps that a message names.
const SHOWN: usize = 4;

/// Runs both lints. Charts with forcing, enclosing steps or statecharts are skipped, because their steps can also be deactivated without a transition.
pub(super) fn tokens(net: &Net, out: &mut Vec<Diagnostic>) {
    if net.settings.policy.is_statechart() || !net.forcings.is_empty() {
        return;
    }
    let flow = Flow::new(net);
    sources(&flow, out);
    forks(&flow, out);
}

/// The transitions that enter and leave each step.
struct Flow<'n> {
    net: &'n Net,
    leaving: IdMap<Step, Vec<TransitionId>>,
    entering: IdMap<Step, Vec<TransitionId>>,
}

/// The steps that a transition enters; `None` if it also enters something else.
fn entered(transition: &Transition) -> Option<Vec<StepId>> {
    let step = |enter: &Enter| match *enter {
        Enter::Step(step) => Some(step),
        Enter::InitialContent(_) | Enter::History(_) => None,
    };
    transition.enters.iter().map(step).collect()
}

impl<'n> Flow<'n> {
    fn new(net: &'n Net) -> Self {
        let mut flow = Flow {
            net,
            leaving: IdMap::filled(&net.steps, Vec::new()),
            entering: IdMap::filled(&net.steps, Vec::new()),
        };
        for (id, one) in net.transitions.iter().filter(|(_, one)| one.kind == TransitionKind::Move)
        {
            one.requires.iter().for_each(|step| flow.leaving[*step].push(id));
            for step in entered(one).unwrap_or_default() {
                flow.entering[step].push(id);
            }
        }
        flow
    }

    /// True if only transitions activate and deactivate a step.
    fn is_plain(&self, step: StepId) -> bool {
        let data = &self.net.steps[step];
        data.parent.is_none() && !data.hidden && !data.activation_link
    }

    /// True if the receptivity reads steps in `among`, except those that the transition leaves.
    fn asks_for(&self, transition: &Transition, among: &BTreeSet<StepId>) -> bool {
        let mut found = false;
        let mut edges = Vec::new();
        let mut look = |leaf: &Leaf, edges: &mut Vec<_>| match leaf {
            Leaf::Active(step)
            | Leaf::TasksDone(step)
            | Leaf::Elapsed(step)
            | Leaf::LastElapsed(step) => {
                found |= among.contains(step) && !transition.requires.contains(step);
            }
            Leaf::Rise(edge) | Leaf::Fall(edge) => edges.push(*edge),
            // Indirect reads through a timer, variable or action are not followed.
            Leaf::Fireable(_) | Leaf::Timer(_) | Leaf::Controlled(_) => found = true,
            Leaf::Input(_) | Leaf::Var(_) => {}
        };
        for leaf in transition.guard.leaves() {
            look(leaf, &mut edges);
        }
        for edge in edges {
            for leaf in self.net.edges[edge].expr.leaves() {
                look(leaf, &mut Vec::new());
            }
        }
        found
    }
}

fn names(net: &Net, steps: impl IntoIterator<Item = StepId>, last: &str) -> String {
    let all: Vec<String> =
        steps.into_iter().map(|step| format!("`{}`", net.steps[step].name)).collect();
    match all.split_last() {
        None => String::new(),
        Some((only, [])) => only.clone(),
        Some((_, before)) if before.len() >= SHOWN => {
            format!("{} and {} more", all[..SHOWN].join(", "), all.len() - SHOWN)
        }
        Some((end, before)) => format!("{} {last} {end}", before.join(", ")),
    }
}

/// Warns about a source transition into a part of the chart that has an initial step and from which no transition removes a step. Each time it fires, one more
/// step stays active.
fn sources(flow: &Flow<'_>, out: &mut Vec<Diagnostic>) {
    let net = flow.net;
    for (id, transition) in net.transitions.iter() {
        if transition.kind != TransitionKind::Move || !transition.requires.is_empty() {
            continue;
        }
        let Some(targets) = entered(transition).filter(|targets| !targets.is_empty()) else {
            continue;
        };
        // All steps that transitions connect with the targets.
        let mut steps: BTreeSet<StepId> = targets.iter().copied().gather();
        let mut todo = targets.clone();
        let mut is_kept = true;
        while let Some(step) = todo.pop() {
            is_kept &= flow.is_plain(step);
            for other in flow.leaving[step].iter().chain(&flow.entering[step]) {
                let other = &net.transitions[*other];
                let Some(next) = entered(other) else {
                    is_kept = false;
                    continue;
                };
                is_kept &= other.requires.len() <= next.len();
                for step in next.into_iter().chain(other.requires.iter().copied()) {
                    if steps.insert(step) {
                        todo.push(step);
                    }
                }
            }
        }
        let begins = steps.iter().any(|step| net.steps[*step].is_initial);
        if !is_kept || !begins || flow.asks_for(transition, &steps) {
            continue;
        }
        let left = || steps.iter().copied().filter(|step| !targets.contains(step));
        let (name, target) = (&transition.name, names(net, targets.iter().copied(), "and"));
        let mut finding = Diagnostic::warning(
            codes::SOURCE_ADDS,
            format!("transition `{name}` leaves no step: it activates {target}, and all other steps stay active"),
        )
        .plural(format!("`{name}`"), "transitions", "leave no step: they activate a step, and all others stay active")
        .at(place(net, id), "no step before the transition");
        if left().next().is_some() {
            let order = match net.settings.policy {
                Policy::Priority => ", before the other transitions of that step",
                Policy::All | Policy::PriorityAge | Policy::InnerFirst | Policy::OuterFirst => "",
            };
            let steps = names(net, left(), "or");
            finding = finding.help(match left().count() {
                1 => format!("to leave {steps}, write a transition from it to {target}{order}"),
                _ => format!(
                    "to leave {steps}, write one transition to {target} for each of them{order}"
                ),
            });
        }
        out.push(finding);
    }
}

/// A branch of a fork: its steps, and the transitions that lead back to the step before the fork.
struct Branch {
    steps: BTreeSet<StepId>,
    back: Vec<TransitionId>,
}

/// Warns about branches that start together but return separately, so that the step before them is active while one of them is still running.
fn forks(flow: &Flow<'_>, out: &mut Vec<Diagnostic>) {
    let net = flow.net;
    for (id, fork) in net.transitions.iter() {
        if fork.kind != TransitionKind::Move || fork.requires.is_empty() || fork.enters.len() < 2 {
            continue;
        }
        let Some(targets) = entered(fork) else { continue };
        let is_apart = fork.requires.iter().chain(&targets).all(|step| flow.is_plain(*step))
            && targets.iter().all(|step| !fork.requires.contains(step));
        if !is_apart {
            continue;
        }
        let branches: Option<Vec<Branch>> =
            targets.iter().map(|step| branch(flow, *step, &fork.requires)).collect();
        let Some(branches) = branches else { continue };
        let all: BTreeSet<StepId> =
            branches.iter().flat_map(|branch| branch.steps.iter().copied()).gather();
        let asks = |step: &StepId| {
            flow.leaving[*step].iter().any(|one| flow.asks_for(&net.transitions[*one], &all))
        };
        // A branch that also runs alone has no other branch to wait for.
        let begins_alone = |step: &StepId| {
            net.steps[*step].is_initial
                || flow.entering[*step].iter().any(|one| {
                    let from = &net.transitions[*one].requires;
                    *one != id && (from.is_empty() || !from.iter().all(|step| all.contains(step)))
                })
        };
        if all.iter().any(asks) || all.iter().any(begins_alone) {
            continue;
        }
        report(net, id, &targets, &branches, out);
    }
}

/// The branch that begins with `first`; `None` if one of its steps waits for another branch, never ends, or is in an enclosing step.
fn branch(flow: &Flow<'_>, first: StepId, ends: &[StepId]) -> Option<Branch> {
    let mut branch = Branch { steps: [first].into_iter().gather(), back: Vec::new() };
    let mut todo = vec![first];
    while let Some(step) = todo.pop() {
        if !flow.is_plain(step) {
            return None;
        }
        for id in &flow.leaving[step] {
            let transition = &flow.net.transitions[*id];
            let next = entered(transition).filter(|next| !next.is_empty())?;
            if transition.requires.len() != 1 {
                return None;
            }
            for step in next {
                if ends.contains(&step) {
                    branch.back.push(*id);
                } else if branch.steps.insert(step) {
                    todo.push(step);
                }
            }
        }
    }
    Some(branch)
}

/// Warns that two branches of one fork lead back to the same step by transitions that may fire at different times.
fn report(
    net: &Net,
    fork: TransitionId,
    targets: &[StepId],
    branches: &[Branch],
    out: &mut Vec<Diagnostic>,
) {
    let back = |branch: &Branch| {
        let id = *branch.back.first()?;
        let transition = &net.transitions[id];
        Some((id, *transition.requires.first()?, entered(transition)?))
    };
    let when = |id: TransitionId| -> (Expr<Leaf>, _) {
        let one = &net.transitions[id];
        (one.guard.without_spans(), &one.events)
    };
    for (at, one) in branches.iter().enumerate() {
        let Some((first, from, to)) = back(one) else { continue };
        for other in &branches[at + 1..] {
            let Some((second, other_from, other_to)) = back(other) else { continue };
            let Some(again) = to.iter().find(|step| {
                net.transitions[fork].requires.contains(step) && other_to.contains(step)
            }) else {
                continue;
            };
            // Both have the same condition: the branches end together.
            if first == second || when(first) == when(second) {
                continue;
            }
            let again = &net.steps[*again].name;
            let (left, right) = (&net.steps[from].name, &net.steps[other_from].name);
            out.push(
                Diagnostic::warning(
                    codes::NO_JOIN,
                    format!(
                        "`{again}` becomes active again before all of its branches have ended: `{left}` and `{right}` lead to it separately"
                    ),
                )
                .at(place(net, first), format!("activates `{again}` while the other branch may still be active"))
                .at(place(net, second), "also activates it")
                .at(
                    place(net, fork),
                    format!("{} become active together here", names(net, targets.iter().copied(), "and")),
                )
                .help({
                    let both = both(net, first, second, "and", "not").map_or_else(
                        || "a and b` with their receptivities for a and b".to_owned(),
                        |both| format!("{both}`"),
                    );
                    format!(
                        "let each branch end in a step of its own that waits for the other, and join these: `{left}_done & {right}_done -> {again}`; if `{left}` and `{right}` may both stay active until both have ended, replace the two transitions by `{left} & {right} -> {again} when {both}"
                    )
                })
                .help_in(
                    Notation::Iec,
                    {
                        let both = both(net, first, second, "AND", "NOT").map_or_else(
                            || "a AND b; END_TRANSITION` with their conditions for a and b".to_owned(),
                            |both| format!("{both}; END_TRANSITION`"),
                        );
                        format!(
                            "let each branch end in a step of its own that waits for the other, and join these: `TRANSITION FROM ({left}_done, {right}_done) TO {again} := TRUE; END_TRANSITION`; if `{left}` and `{right}` may both stay active until both have ended, replace the two transitions by `TRANSITION FROM ({left}, {right}) TO {again} := {both}"
                        )
                    },
                ),
            );
            return;
        }
    }
}

/// The receptivities of two transitions as one, if they are simple: names and their negations.
fn both(net: &Net, a: TransitionId, b: TransitionId, and: &str, not: &str) -> Option<String> {
    fn text(net: &Net, expr: &Expr<Leaf>, and: &str, not: &str) -> Option<String> {
        Some(match &expr.kind {
            ExprKind::Leaf(Leaf::Input(input)) => net.inputs[*input].name.text.clone(),
            ExprKind::Leaf(Leaf::Var(var)) => net.vars[*var].name.text.clone(),
            ExprKind::Not(inner) => match &inner.kind {
                ExprKind::Leaf(_) => format!("{not} {}", text(net, inner, and, not)?),
                _ => return None,
            },
            ExprKind::And(all) if !all.is_empty() => {
                let parts: Option<Vec<String>> =
                    all.iter().map(|one| text(net, one, and, not)).collect();
                parts?.join(&format!(" {and} "))
            }
            _ => return None,
        })
    }
    let one = |id: TransitionId| {
        let transition = &net.transitions[id];
        if transition.events.is_empty() { text(net, &transition.guard, and, not) } else { None }
    };
    Some(format!("{} {and} {}", one(a)?, one(b)?))
}
