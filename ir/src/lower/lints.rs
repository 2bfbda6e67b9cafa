//! Warnings about a valid net that probably does not do what was intended. All of them follow from its structure; the verifier reports those that need the
//! reachable situations.
#![allow(clippy::wildcard_enum_match_arm, reason = "a forgotten variant is a missing warning")]

mod tokens;

use super::codes;
use crate::Gather;
use crate::arena::IdMap;
use crate::diag::{Diagnostic, Notation};
use crate::expr::{CompareOp, Expr, ExprKind, Type};
use crate::interval::{TICKS, net_type};
use crate::net::{
    Block, Driver, Enter, InputId, InputKind, Leaf, Net, Policy, PropertyLeaf, Qualifier, Step,
    StepId, StepKind, StmtKind, Transition, TransitionId, TransitionKind, VarOrigin,
};
use crate::span::Span;
use crate::walk::called_in_lists;
use std::collections::{BTreeMap, BTreeSet};

/// All lints, in the order of the functions below; within one, in declaration order. Takes linear time in the size of the net, except for sorting.
#[must_use]
pub fn lints(net: &Net) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    unused(net, &mut out);
    duplicates(net, &mut out);
    unreached(net, &mut out);
    no_way_out(net, &mut out);
    constants(net, &mut out);
    never_taken(net, &mut out);
    beyond_emergency(net, &mut out);
    stays_active(net, &mut out);
    one_pulse(net, &mut out);
    tokens::tokens(net, &mut out);
    out
}

/// Warns about steps that a transition leaves and enters: outside statecharts they stay active, so their entry and exit have no effect (semantics §3.2).
fn stays_active(net: &Net, out: &mut Vec<Diagnostic>) {
    if net.settings.policy.is_statechart() {
        return;
    }
    let mut timed: IdMap<Step, bool> = IdMap::filled(&net.steps, false);
    for transition in net.transitions.values() {
        for leaf in transition.guard.leaves() {
            if let Leaf::Elapsed(step) | Leaf::LastElapsed(step) = leaf {
                timed[*step] = true;
            }
        }
    }
    let mut pulsed: IdMap<Step, Option<&crate::Name>> = IdMap::filled(&net.steps, None);
    for action in net.actions.values() {
        for one in &action.uses {
            if one.qualifier.is_pulse() {
                pulsed[one.step].get_or_insert(&action.name);
            }
        }
    }
    for (id, transition) in net.transitions.iter() {
        if transition.restart || transition.kind == TransitionKind::Reaction {
            continue;
        }
        for enter in &transition.enters {
            let Enter::Step(step) = *enter else { continue };
            if !transition.requires.contains(&step) || net.steps[step].hidden {
                continue;
            }
            let data = &net.steps[step];
            let what = if !data.entry.is_empty() || !data.exit.is_empty() {
                "its entry and exit lists do not run".to_owned()
            } else if timed[step] {
                "its time continues".to_owned()
            } else if let Some(action) = pulsed[step] {
                format!("`{action}` gets no new pulse from it")
            } else if !data.tasks.is_empty() {
                "its tasks do not start again".to_owned()
            } else {
                continue;
            };
            let (name, step) = (&transition.name, &data.name);
            out.push(
                Diagnostic::warning(
                    codes::STAYS_ACTIVE,
                    format!("`{step}` stays active when `{name}` fires: {what}"),
                )
                .at(place(net, id), format!("from `{step}` to `{step}`"))
                .help("write `restart` after the transition to enter the step again, or go through another step")
                .help_in(
                    Notation::Iec,
                    "write {grafsynth restart} in the transition to enter the step again, or go through another step",
                ),
            );
        }
    }
}

/// Warns about actions that pulse in two consecutive steps: the pulses merge into one, because the action's request does not drop between them (§3.5).
fn one_pulse(net: &Net, out: &mut Vec<Diagnostic>) {
    for action in net.actions.values() {
        let mut by_step: BTreeMap<(StepId, Qualifier), Span> = BTreeMap::new();
        for one in action.uses.iter().filter(|one| one.condition.is_none()) {
            if one.qualifier.is_pulse() {
                by_step.insert((one.step, one.qualifier), one.span);
            }
        }
        if by_step.len() < 2 {
            continue;
        }
        let mut told: BTreeSet<(StepId, Qualifier)> = BTreeSet::new();
        for transition in net.transitions.values() {
            for (from, enter) in transition
                .requires
                .iter()
                .flat_map(|from| transition.enters.iter().map(move |enter| (*from, *enter)))
            {
                let Enter::Step(to) = enter else { continue };
                for qualifier in Qualifier::ALL.into_iter().filter(|it| it.is_pulse()) {
                    let (Some(first), Some(second)) =
                        (by_step.get(&(from, qualifier)), by_step.get(&(to, qualifier)))
                    else {
                        continue;
                    };
                    if from == to || !told.insert((to, qualifier)) {
                        continue;
                    }
                    let (before, after) = (&net.steps[from].name, &net.steps[to].name);
                    out.push(
                        Diagnostic::warning(
                            codes::ONE_PULSE,
                            format!(
                                "`{}` gives only one {qualifier:?} pulse for `{before}` and the following step `{after}`",
                                action.name
                            ),
                        )
                        .at(*second, format!("no separate pulse when `{before}` is left for `{after}`"))
                        .at(*first, "pulses here")
                        .help("add a step without the action between them, or use a separate action for each step"),
                    );
                }
            }
        }
    }
}

/// Warns about extern actions that lists call: such a call is instantaneous, so an emergency cannot force it.
fn beyond_emergency(net: &Net, out: &mut Vec<Diagnostic>) {
    let Some(emergency) = &net.emergency else { return };
    for (output, at) in called_in_lists(net) {
        let name = &net.outputs[output].name;
        out.push(
            Diagnostic::warning(
                codes::BEYOND_EMERGENCY,
                format!("statement lists call `{name}` even during the emergency"),
            )
            .plural(format!("`{name}`"), "statement lists call", "even during the emergency")
            .at(at, "called here")
            .at(
                emergency.meta.span,
                "affects outputs and the calls of active steps, but not statement lists",
            )
            .help("move the call to a step action, or test the emergency condition in the list"),
        );
    }
}

/// Warns about unused inputs, variables and timers.
fn unused(net: &Net, out: &mut Vec<Diagnostic>) {
    let mut seen = Mentions {
        inputs: vec![false; net.inputs.len()],
        vars: vec![false; net.vars.len()],
        timers: vec![false; net.timers.len()],
    };
    seen.net(net);
    let mut report = |what: &str, name: &crate::span::Name, help: &str| {
        out.push(
            Diagnostic::warning(codes::UNUSED, format!("{what} `{name}` is never used"))
                .plural(format!("`{name}`"), format!("{what}s"), "are never used")
                .at(name.span, "")
                .help(help)
                .help_in(
                    Notation::Iec,
                    help.replace(
                        "use it in a condition,",
                        "use it in a condition or as an input of a call,",
                    ),
                ),
        );
    };
    for (_, input) in net.inputs.iter().filter(|(id, _)| !seen.inputs[id.index()]) {
        let what = match input.kind {
            InputKind::Pin => "input",
            InputKind::Extern => "extern condition",
            InputKind::Event | InputKind::InternalEvent => "event",
        };
        report(what, &input.name, "use it in a condition, or remove it");
    }
    // The parts of an instance share the location of its declaration: a use of one of them is a use of the instance.
    let mut used_places: BTreeSet<Span> = BTreeSet::new();
    used_places.extend(
        net.vars.iter().filter(|(id, _)| seen.vars[id.index()]).map(|(_, var)| var.name.span),
    );
    used_places.remove(&Span::default());
    for (id, var) in net.vars.iter() {
        if var.origin == VarOrigin::Declared
            && !seen.vars[id.index()]
            && !used_places.contains(&var.name.span)
        {
            report("variable", &var.name, "remove it");
        }
    }
    for (id, timer) in net.timers.iter() {
        if !seen.timers[id.index()] {
            report("timer", &timer.name, "compare it with a constant in a condition, or remove it");
        }
    }
}

/// The objects that some expression or list of the net uses.
struct Mentions {
    inputs: Vec<bool>,
    vars: Vec<bool>,
    timers: Vec<bool>,
}

impl Mentions {
    fn net(&mut self, net: &Net) {
        let in_properties = net.properties.iter().flat_map(|property| property.never.leaves());
        let in_properties = in_properties.filter_map(PropertyLeaf::net);
        for leaf in net.expressions().flat_map(Expr::leaves).chain(in_properties) {
            self.leaf(*leaf);
        }
        for stmt in net.statements() {
            match stmt.kind {
                StmtKind::Assign { var, .. } => self.vars[var.index()] = true,
                StmtKind::Raise(event) => self.inputs[event.index()] = true,
                _ => {}
            }
        }
        for output in net.outputs.values() {
            if let Driver::Stored(var) = output.driver {
                self.vars[var.index()] = true;
            }
        }
        let received = net.transitions.values().flat_map(|transition| &transition.events);
        let done = net.steps.values().filter_map(|step| step.done_event.as_ref());
        let sent = net.sends.values().map(|slot| &slot.event);
        for event in received.chain(done).chain(sent) {
            self.inputs[event.index()] = true;
        }
    }

    fn leaf(&mut self, leaf: Leaf) {
        match leaf {
            Leaf::Input(input) => self.inputs[input.index()] = true,
            Leaf::Var(var) => self.vars[var.index()] = true,
            Leaf::Timer(timer) => self.timers[timer.index()] = true,
            _ => {}
        }
    }
}

/// The location to show for a transition.
fn place(net: &Net, id: TransitionId) -> Span {
    let transition = &net.transitions[id];
    if transition.meta.span == Span::default() {
        transition.name.span
    } else {
        transition.meta.span
    }
}

/// Warns about transitions with the same steps, events and receptivity.
fn duplicates(net: &Net, out: &mut Vec<Diagnostic>) {
    type Ends<'n> = (&'n [StepId], &'n [Enter], &'n [InputId]);
    let mut groups: BTreeMap<Ends<'_>, Vec<TransitionId>> = BTreeMap::new();
    for (id, one) in net.transitions.iter().filter(|(_, one)| one.kind == TransitionKind::Move) {
        groups.entry((&one.requires, &one.enters, &one.events)).or_default().push(id);
    }
    let mut found: Vec<(TransitionId, TransitionId)> = Vec::new();
    for group in groups.values().filter(|group| group.len() > 1) {
        let mut first: BTreeMap<Expr<Leaf>, TransitionId> = BTreeMap::new();
        for id in group {
            let earlier = *first.entry(net.transitions[*id].guard.without_spans()).or_insert(*id);
            if earlier != *id {
                found.push((*id, earlier));
            }
        }
    }
    found.sort_unstable();
    for (id, earlier) in found {
        let (again, first) = (&net.transitions[id].name, &net.transitions[earlier].name);
        out.push(
            Diagnostic::warning(
                codes::DUPLICATE_TRANSITION,
                format!("transition `{again}` is the same as `{first}`"),
            )
            .plural(format!("`{again}`"), "transitions", "are the same as earlier ones")
            .at(place(net, id), "again here")
            .at(place(net, earlier), "first here")
            .help("remove one of them"),
        );
    }
}

/// Warns about steps that no chain of transitions can reach, whatever the receptivities are.
fn unreached(net: &Net, out: &mut Vec<Diagnostic>) {
    let mut reach = Reach { net, reached: IdMap::filled(&net.steps, false), todo: Vec::new() };
    net.steps.iter().filter(|(_, step)| step.is_initial).for_each(|(id, _)| reach.step(id));
    for part in net.parts.values() {
        reach.enters(&part.initial);
    }
    for forcing in &net.forcings {
        if let crate::net::ForcingOrder::Situation(steps) = &forcing.order {
            steps.iter().for_each(|step| reach.step(*step));
        }
    }
    let mut leaving: IdMap<Step, Vec<TransitionId>> = IdMap::filled(&net.steps, Vec::new());
    let mut linked: IdMap<Step, Vec<StepId>> = IdMap::filled(&net.steps, Vec::new());
    let mut missing: Vec<usize> = Vec::with_capacity(net.transitions.len());
    for (id, transition) in net.transitions.iter() {
        missing.push(transition.requires.len());
        for step in &transition.requires {
            leaving[*step].push(id);
        }
        if transition.requires.is_empty() {
            reach.enters(&transition.enters);
        }
    }
    for (id, step) in net.steps.iter() {
        if let Some(parent) = step.parent.filter(|_| step.activation_link) {
            linked[parent].push(id);
        }
    }
    while let Some(step) = reach.todo.pop() {
        for next in &linked[step] {
            reach.step(*next);
        }
        for id in &leaving[step] {
            missing[id.index()] -= 1;
            if missing[id.index()] == 0 {
                reach.enters(&net.transitions[*id].enters);
            }
        }
    }
    let mut entered: IdMap<Step, bool> = IdMap::filled(&net.steps, false);
    for transition in net.transitions.values() {
        for enter in &transition.enters {
            if let Enter::Step(step) = enter {
                entered[*step] = true;
            }
        }
    }
    for (id, step) in net.steps.iter().filter(|(id, step)| !reach.reached[*id] && !step.hidden) {
        let name = &step.name;
        let (why, of_each) = if entered[id] {
            ("the steps before it are never active", "the steps before them are never active")
        } else {
            ("no transition leads to it", "no transition leads to them")
        };
        let message = format!("step `{name}` can never be active: {why}");
        out.push(
            Diagnostic::warning(codes::UNREACHED_STEP, message)
                .plural(format!("`{name}`"), "steps", format!("can never be active: {of_each}"))
                .at(name.span, "")
                .help("make the step initial, add a transition to it, or remove it"),
        );
    }
}

struct Reach<'n> {
    net: &'n Net,
    reached: IdMap<Step, bool>,
    todo: Vec<StepId>,
}

impl Reach<'_> {
    fn step(&mut self, step: StepId) {
        if !self.reached[step] {
            self.reached[step] = true;
            self.todo.push(step);
        }
    }

    fn enters(&mut self, enters: &[Enter]) {
        let net = self.net;
        for enter in enters {
            match *enter {
                Enter::Step(step) => self.step(step),
                Enter::InitialContent(_) => {}
                // A history can only record states that were entered in another way before, so only its default adds steps.
                Enter::History(history) => {
                    for enter in &net.histories[history].default {
                        if let Enter::Step(step) = *enter {
                            self.step(step);
                        }
                    }
                }
            }
        }
    }
}

/// Marks the enclosing steps that a transition leaves: those that contain its source but not its target.
fn leave_enclosing(net: &Net, transition: &Transition, left: &mut IdMap<Step, bool>) {
    let is_inside = |step: StepId, around: StepId| {
        std::iter::successors(net.steps[step].parent, |step| net.steps[*step].parent)
            .any(|one| one == around)
    };
    for source in &transition.requires {
        let enclosing =
            std::iter::successors(net.steps[*source].parent, |step| net.steps[*step].parent);
        for around in enclosing {
            left[around] |= transition.enters.iter().any(|enter| match *enter {
                Enter::Step(step) => !is_inside(step, around),
                Enter::InitialContent(_) => false,
                Enter::History(history) => {
                    let owner = net.histories[history].owner;
                    owner != around && !is_inside(owner, around)
                }
            });
        }
    }
}

/// Warns about steps that are entered but never left by a transition.
fn no_way_out(net: &Net, out: &mut Vec<Diagnostic>) {
    let mut left: IdMap<Step, bool> = IdMap::filled(&net.steps, false);
    let mut entered: IdMap<Step, bool> = IdMap::filled(&net.steps, false);
    for transition in net.transitions.values().filter(|one| one.kind == TransitionKind::Move) {
        transition.requires.iter().for_each(|step| left[*step] = true);
        leave_enclosing(net, transition, &mut left);
        for enter in &transition.enters {
            if let Enter::Step(step) = enter {
                entered[*step] = true;
            }
        }
    }
    let forced: Vec<bool> = {
        let mut forced = vec![false; net.parts.len()];
        net.forcings
            .iter()
            .flat_map(|forcing| &forcing.target)
            .for_each(|part| forced[part.index()] = true);
        forced
    };
    let macro_of: BTreeMap<StepId, &crate::net::MacroStep> =
        net.macros.iter().map(|one| (one.exit, one)).gather();
    for (id, step) in net.steps.iter() {
        // An enclosing step, a state or a forcing order can deactivate a step too. A step that stays active for ever may also be intended.
        let is_plain = step.parent.is_none() && step.kind != StepKind::Final && !step.hidden;
        if left[id] || !entered[id] || !is_plain || forced[step.part.index()] {
            continue;
        }
        let (what, name, span) = match macro_of.get(&id) {
            Some(one) => ("macro-step", &one.name, one.name.span),
            None if net.settings.policy.is_statechart() => ("state", &step.name, step.name.span),
            None => ("step", &step.name, step.name.span),
        };
        out.push(
            Diagnostic::warning(
                codes::NO_WAY_OUT,
                format!("{what} `{name}` has no outgoing transition"),
            )
            .plural(format!("`{name}`"), format!("{what}s"), "have no outgoing transition")
            .at(span, "no transition leaves it: once active, it stays active for ever")
            .help(format!("add a transition that leaves the {what}")),
        );
    }
}

/// The interval of a number, including times.
fn bounds(net: &Net, expr: &Expr<Leaf>) -> Option<(i64, i64)> {
    if matches!(&expr.kind, ExprKind::Leaf(leaf) if leaf.is_time()) {
        return Some(TICKS.bounds());
    }
    match net_type(net, expr) {
        Ok(Type::Int { lo, hi }) => Some((lo, hi)),
        Ok(Type::Bool) | Err(_) => None,
    }
}

/// The value of a condition if it is constant.
fn truth(net: &Net, expr: &Expr<Leaf>) -> Option<bool> {
    match &expr.kind {
        ExprKind::Bool(value) => Some(*value),
        ExprKind::Not(a) => truth(net, a).map(|value| !value),
        ExprKind::And(all) => junction(net, all, true),
        ExprKind::Or(all) => junction(net, all, false),
        ExprKind::Compare(op, a, b) => {
            let ((al, ah), (bl, bh)) = (bounds(net, a)?, bounds(net, b)?);
            let (always, never) = match op {
                CompareOp::Eq => (al == ah && bl == bh && al == bl, ah < bl || bh < al),
                CompareOp::Ne => (ah < bl || bh < al, al == ah && bl == bh && al == bl),
                CompareOp::Lt => (ah < bl, al >= bh),
                CompareOp::Le => (ah <= bl, al > bh),
                CompareOp::Gt => (al > bh, ah <= bl),
                CompareOp::Ge => (al >= bh, ah < bl),
            };
            if always { Some(true) } else { never.then_some(false) }
        }
        ExprKind::Select(c, a, b) => match truth(net, c)? {
            true => truth(net, a),
            false => truth(net, b),
        },
        _ => None,
    }
}

/// The value of a conjunction or disjunction if it is constant; `a and not a` is false, and `a or not a` is true.
fn junction(net: &Net, all: &[Expr<Leaf>], is_and: bool) -> Option<bool> {
    let values: Vec<Option<bool>> = all.iter().map(|one| truth(net, one)).collect();
    if values.contains(&Some(!is_and)) {
        return Some(!is_and);
    }
    if values.iter().all(|value| *value == Some(is_and)) {
        return Some(is_and);
    }
    let mut plain: Vec<Expr<Leaf>> = Vec::new();
    let mut negated: Vec<Expr<Leaf>> = Vec::new();
    for one in all {
        match &one.kind {
            ExprKind::Not(inner) => negated.push(inner.without_spans()),
            _ => plain.push(one.without_spans()),
        }
    }
    plain.sort_unstable();
    negated.iter().any(|one| plain.binary_search(one).is_ok()).then_some(!is_and)
}

/// Warns about constant conditions, except for a receptivity that is written as `true`.
fn constants(net: &Net, out: &mut Vec<Diagnostic>) {
    for (id, transition) in net.transitions.iter() {
        let name = &transition.name;
        match truth(net, &transition.guard) {
            Some(true) if !transition.guard.is_true() => {
                out.push(
                    constant(
                        &transition.guard,
                        place(net, id),
                        format!("the condition of `{name}` is always true"),
                        "or remove it",
                    )
                    .plural(
                        format!("`{name}`"),
                        "the conditions of",
                        "are always true",
                    ),
                );
            }
            Some(false) => {
                out.push(
                    constant(
                        &transition.guard,
                        place(net, id),
                        format!("the condition of `{name}` is never true, so this transition never fires"),
                        "or remove the transition",
                    )
                    .plural(
                        format!("`{name}`"),
                        "the conditions of",
                        "are never true, so these transitions never fire",
                    ),
                );
            }
            Some(true) | None => {}
        }
        conditions_in(net, &transition.actions, out);
    }
    for step in net.steps.values() {
        for list in [&step.entry, &step.exit, &step.initial_content] {
            conditions_in(net, list, out);
        }
    }
    for output in net.outputs.values() {
        let (Driver::Continuous(emissions) | Driver::Mealy(emissions)) = &output.driver else {
            continue;
        };
        for emission in emissions {
            let Some(condition) = &emission.condition else { continue };
            if let Some(value) = truth(net, condition) {
                let step = &net.steps[emission.step].name;
                out.push(constant(
                    condition,
                    emission.span,
                    format!("the condition of `{}` in `{step}` is always {value}", output.name),
                    "or remove it",
                ));
            }
        }
    }
}

fn conditions_in(net: &Net, block: &Block, out: &mut Vec<Diagnostic>) {
    for stmt in block {
        let StmtKind::If { condition, then, otherwise } = &stmt.kind else { continue };
        if let Some(value) = truth(net, condition) {
            out.push(constant(
                condition,
                stmt.span,
                format!("this `if` is always {value}"),
                "or remove the `if`",
            ));
        }
        conditions_in(net, then, out);
        conditions_in(net, otherwise, out);
    }
}

/// A warning about a constant condition; `otherwise` is the other way out.
fn constant(
    condition: &Expr<Leaf>,
    fallback: Span,
    message: String,
    otherwise: &str,
) -> Diagnostic {
    let span = if condition.span == Span::default() { fallback } else { condition.span };
    let what = match condition.leaves().next() {
        Some(_) => "check the ranges of the variables in the condition",
        None => "write the intended condition",
    };
    let help = format!("{what}, {otherwise}");
    Diagnostic::warning(codes::CONSTANT_CONDITION, message).at(span, "").help(help)
}

/// Under `priority`: warns about transitions after one that always fires.
fn never_taken(net: &Net, out: &mut Vec<Diagnostic>) {
    if net.settings.policy != Policy::Priority {
        return;
    }
    let mut leaving: IdMap<Step, Vec<TransitionId>> = IdMap::filled(&net.steps, Vec::new());
    for (id, one) in net.transitions.iter().filter(|(_, one)| one.kind == TransitionKind::Move) {
        one.requires.iter().for_each(|step| leaving[*step].push(id));
    }
    let mut found: BTreeMap<TransitionId, TransitionId> = BTreeMap::new();
    for (_, group) in leaving.iter() {
        let mut group: Vec<TransitionId> = group.clone();
        group.sort_unstable_by_key(|id| (net.transitions[*id].priority.unwrap_or(u32::MAX), *id));
        let first = group.iter().position(|id| {
            let one = &net.transitions[*id];
            one.requires.len() == 1 && one.events.is_empty() && truth(net, &one.guard) == Some(true)
        });
        let Some(first) = first else { continue };
        let winner = group[first];
        for id in &group[first + 1..] {
            // The rank comes before the priority: only transitions of the same partial chart certainly have the same rank.
            if net.transitions[*id].part == net.transitions[winner].part {
                found.entry(*id).or_insert(winner);
            }
        }
    }
    for (id, winner) in found {
        let (name, winner_name) = (&net.transitions[id].name, &net.transitions[winner].name);
        out.push(
            Diagnostic::warning(
                codes::NEVER_TAKEN,
                format!("transition `{name}` is never taken: `{winner_name}` always fires first"),
            )
            .plural(format!("`{name}`"), "transitions", "are never taken: others always fire first")
            .at(place(net, id), "")
            .at(place(net, winner), "its condition is always true")
            .help(
                "add a condition to that transition, or give this one a more urgent `priority` (1 is the most urgent)",
            ),
        );
    }
}
