//! Answers about charts of any size: from the structure of the chart, by induction over one reaction, or by runs that show everything that the structure
//! does not exclude. A check that they answer does not depend on a search of all states.

use std::collections::BTreeSet;

use grafsynth_ir::Valid;
use grafsynth_ir::expr::{CompareOp, Expr as GenericExpr, ExprKind, Type};
use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::interval::net_type;
use grafsynth_ir::net::{
    Evolution, Expr, InputId, InputKind, Leaf, Net, Output, Policy, PropertyExpr, PropertyLeaf,
    StepId, StepKind, Stmt, StmtKind, Transition, TransitionId, TransitionKind, VarId, VarOrigin,
};
use grafsynth_ir::walk::statements;
use grafsynth_sim::{Directed, Function, MAX_DT, Simulator};

use crate::classes::Classes;
use crate::exclusive::all_compatible_pairs;
use crate::far::Far;
use crate::limits::Limits;
use crate::symbolic;

/// The maximum number of pairs for which it is proved that they are never in conflict.
const PROVED: usize = 64;

/// Pairs of transitions, each in the order in which they were noted.
type Pairs = BTreeSet<(TransitionId, TransitionId)>;

/// Adds the conflicts that directed random runs show to those that were seen (`together`: pairs that fired in one micro-step; `contests`: pairs of a winner
/// and a loser). True if these are all: two transitions that leave one step either exclude each other, or were seen in conflict, or
/// induction proves that they are never fireable together.
pub(super) fn see_all_contests(
    net: &Valid<Net>,
    facts: &Facts,
    limits: &Limits,
    together: &mut Pairs,
    contests: &mut Pairs,
) -> bool {
    let is_all = net.settings.policy == Policy::All && !net.settings.fire_one;
    // Unless ages count, the declarations decide which transition wins, so it is always the same one.
    let is_mutual = net.settings.policy == Policy::PriorityAge;
    if net.settings.policy.is_statechart() {
        return false;
    }
    let is_seen = |(a, b): &(TransitionId, TransitionId), contests: &Pairs, together: &Pairs| {
        let (one, other) = (contests.contains(&(*a, *b)), contests.contains(&(*b, *a)));
        match (is_all, is_mutual) {
            (true, _) => together.contains(&(*a, *b)),
            (_, true) => one && other,
            (_, false) => one || other,
        }
    };
    let mut unseen = all_compatible_pairs(net);
    unseen.retain(|pair| !is_seen(pair, contests, together));
    let mut runs = Directed::new(net, 1, MAX_DT);
    for _ in 0..limits.random_rows {
        if unseen.is_empty() || runs.next().is_none() {
            break;
        }
        let before = (contests.len(), together.len());
        let simulator = runs.simulator();
        contests.extend(simulator.contests());
        for fired in simulator.firings().filter(|_| is_all) {
            for (at, one) in fired.iter().enumerate() {
                let pairs = fired[..at].iter().map(|other| (*one.min(other), *one.max(other)));
                together.extend(pairs.filter(|pair| unseen.contains(pair)));
            }
        }
        if before != (contests.len(), together.len()) {
            unseen.retain(|pair| !is_seen(pair, contests, together));
        }
    }
    if !unseen.is_empty() && !is_all {
        Far::of(net, limits).each(net, |simulator| contests.extend(simulator.contests()));
        unseen.retain(|pair| !is_seen(pair, contests, together));
    }
    // Proofs are tried only if they can complete the answer.
    unseen.len() <= PROVED
        && (unseen.is_empty()
            || symbolic::never_both(net, facts, limits, &unseen.into_iter().collect::<Vec<_>>())
                .into_iter()
                .all(|is_never| is_never))
}

/// Proves that no reachable situation is a dead end: in each of them some transition is enabled that inputs and time alone can make fireable.
pub(super) fn is_always_alive(net: &Valid<Net>, facts: &Facts, limits: &Limits) -> bool {
    let may_end = net.steps.values().any(|step| step.kind == StepKind::Final);
    if may_end || !net.forcings.is_empty() || !net.unspecified.is_empty() {
        return false;
    }
    let Ok(mut classes) = Classes::of(net, limits) else { return false };
    let live: Vec<&Transition> = (net.transitions.values())
        .filter(|transition| !transition.requires.is_empty())
        .filter(|transition| can_become_fireable(net, &mut classes, transition))
        .collect();
    let after_reset = Simulator::new(net);
    let is_enabled = |transition: &&Transition| {
        transition.requires.iter().all(|step| after_reset.is_active(*step))
    };
    if !live.iter().any(is_enabled) {
        return false;
    }
    let is_active = |step: &StepId| {
        PropertyExpr::leaf(PropertyLeaf::Net(Leaf::Active(*step)), Default::default())
    };
    let is_disabled = |transition: &&Transition| {
        PropertyExpr::and(transition.requires.iter().map(is_active)).not()
    };
    let none = PropertyExpr::and(live.iter().map(is_disabled));
    if symbolic::never(net, facts, limits, &none).is_some() {
        return true;
    }
    // If the facts come from a diagram of all reachable states, such a diagram can also answer this question.
    let has_diagram = facts.reach.as_ref().is_some_and(|reach| reach.by == Proof::Symbolic);
    has_diagram
        && symbolic::reach(net, facts, limits, &[&none], &[])
            .is_ok_and(|reached| reached.breaks == [Some(false)])
}

/// True if an enabled transition becomes fireable by some inputs, after some time in which nothing fires, in every state.
fn can_become_fireable(net: &Net, classes: &mut Classes<'_>, transition: &Transition) -> bool {
    let external = |event: &&InputId| net.inputs[**event].kind == InputKind::Event;
    let events: Vec<Function> = (transition.events.iter().filter(external))
        .map(|event| Function::leaf(*event, Default::default()))
        .collect();
    let event =
        if transition.events.is_empty() { Function::bool(true) } else { Function::or(events) };
    transition.guard.alternatives().iter().any(|guard| {
        let mut now = vec![event.clone()];
        let mut before = Vec::new();
        let is_possible = guard.factors().iter().all(|factor| match &factor.kind {
            ExprKind::Leaf(Leaf::Active(step)) => transition.requires.contains(step),
            ExprKind::Leaf(Leaf::Rise(edge)) | ExprKind::Leaf(Leaf::Fall(edge)) => {
                // An edge is present only if the operand had the other value in the previous row.
                let is_rise = matches!(factor.kind, ExprKind::Leaf(Leaf::Rise(_)));
                let Some(operand) = over_inputs(net, &net.edges[*edge].expr) else { return false };
                let other = operand.clone().not();
                let (new, old) = if is_rise { (operand, other) } else { (other, operand) };
                now.push(new);
                before.push(old);
                true
            }
            ExprKind::Compare(CompareOp::Ge | CompareOp::Gt, time, number)
            | ExprKind::Compare(CompareOp::Le | CompareOp::Lt, number, time)
                if matches!(number.kind, ExprKind::Int(_)) =>
            {
                // The time of an active step grows until it is above all numbers that it is compared with.
                matches!(&time.kind, ExprKind::Leaf(Leaf::Elapsed(step)) if transition.requires.contains(step))
            }
            _ => over_inputs(net, factor).map(|factor| now.push(factor)).is_some(),
        });
        is_possible
            && classes.is_possible(&Function::and(now))
            && classes.is_possible(&Function::and(before))
    })
}

/// An expression over inputs that no event and no state changes; `None` for others.
fn over_inputs(net: &Net, expr: &Expr) -> Option<Function> {
    let is_level =
        |leaf: &Leaf| matches!(leaf, Leaf::Input(input) if !net.inputs[*input].kind.is_event());
    if !expr.leaves().all(is_level) {
        return None;
    }
    let leaf = |leaf: &Leaf, span| match leaf {
        Leaf::Input(input) => GenericExpr::leaf(*input, span),
        _ => GenericExpr::bool(false),
    };
    Some(expr.map(&mut |one, span| leaf(one, span), &mut |_, _| InputId::from_index(0)))
}

/// Proves that no value is out of range, that no variable is written twice in one micro-step, and that nothing else is lost or contradicts itself.
pub(super) fn is_free_of_races(net: &Valid<Net>, facts: &Facts, limits: &Limits) -> bool {
    if net.settings.queue.is_some() || net.forcings.len() > 1 || !net.sends.is_empty() {
        return false;
    }
    let fits = |value: &Expr, ty: Type| {
        let (lo, hi) = ty.bounds();
        match net_type(net, value) {
            Ok(Type::Bool) => true,
            Ok(Type::Int { lo: least, hi: most }) => lo <= least && most <= hi,
            Err(_) => false,
        }
    };
    let is_in_range = net.statements().all(|stmt| match &stmt.kind {
        StmtKind::Assign { var, value, .. } => fits(value, net.vars[*var].ty),
        _ => true,
    });
    let calls = net.statements().any(|stmt| matches!(stmt.kind, StmtKind::Call { .. }));
    let has_calls = calls || net.outputs.values().any(Output::is_extern);
    !has_calls
        && is_written_once(net, facts)
        && (is_in_range || has_types(net) && symbolic::never_saturates(net, facts, limits))
}

/// True if the bounds of every assigned value are known, so that its arithmetic is exact.
fn has_types(net: &Net) -> bool {
    net.statements().all(|stmt| match &stmt.kind {
        StmtKind::Assign { value, .. } => net_type(net, value).is_ok(),
        _ => true,
    })
}

/// A list that writes a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum List {
    Exit(StepId),
    Entry(StepId),
    Move(TransitionId),
    Other,
}

/// True if any two lists of one phase that write the same variable belong to one sequential component, which makes at most one move at a time.
fn is_written_once(net: &Net, facts: &Facts) -> bool {
    let mut writers: Vec<(VarId, List)> = Vec::new();
    let mut note = |block: &[Stmt], list: List| {
        for stmt in statements(block) {
            if let StmtKind::Assign { var, .. } = &stmt.kind
                && net.vars[*var].origin != VarOrigin::Hidden
                && writers.last() != Some(&(*var, list))
            {
                writers.push((*var, list));
            }
        }
    };
    for (id, step) in net.steps.iter() {
        note(&step.exit, List::Exit(id));
        note(&step.entry, List::Entry(id));
        note(&step.initial_content, List::Other);
    }
    for (id, transition) in net.transitions.iter() {
        let is_move = transition.kind == TransitionKind::Move;
        note(&transition.actions, if is_move { List::Move(id) } else { List::Other });
    }
    net.histories.values().for_each(|history| note(&history.default_content, List::Other));
    writers.iter().enumerate().all(|(at, (var, list))| {
        let others = writers[..at].iter().filter(|(other, _)| other == var);
        others.map(|(_, other)| *other).all(|other| exclude(net, facts, other, *list))
    })
}

/// True if two lists never run in the same phase of a micro-step.
fn exclude(net: &Net, facts: &Facts, a: List, b: List) -> bool {
    // Between the micro-steps of a reaction, only what the structure shows is known.
    let is_single = net.settings.evolution == Evolution::Single;
    let component = |step: StepId| {
        let number = facts.component_of.as_ref().and_then(|map| map[step])?;
        let by = facts.components[number as usize].by;
        (is_single || by == Proof::Structural).then_some(number)
    };
    let is_same = |a: StepId, b: StepId| component(a).is_some() && component(a) == component(b);
    match (a, b) {
        (List::Other, _) | (_, List::Other) => false,
        (List::Exit(a), List::Exit(b)) | (List::Entry(a), List::Entry(b)) => {
            a == b || is_same(a, b)
        }
        (List::Move(a), List::Move(b)) => {
            let competes = matches!(net.settings.policy, Policy::Priority | Policy::PriorityAge);
            let requires = |transition: TransitionId| &net.transitions[transition].requires;
            let apart = |a: StepId, b: StepId| if a == b { competes } else { is_same(a, b) };
            a == b
                || requires(a).iter().any(|a| requires(b).iter().any(|b| apart(*a, *b)))
                    && !net.settings.policy.is_statechart()
        }
        (List::Exit(_) | List::Entry(_) | List::Move(_), _) => true,
    }
}
