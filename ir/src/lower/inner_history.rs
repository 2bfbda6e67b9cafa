//! Pass `inner-histories`: transitions to a history of a state that contains their source. In SCXML, what such a transition leaves depends on the states
//! that the history restores (`getTransitionDomain` of `getEffectiveTargetStates`), which is known only at run time; but a transition of a net leaves a
//! fixed set. So each such transition becomes one transition per case, with mutually exclusive receptivities (semantics §3.9, C35).
//!
//! ```text
//! state s1 { history deep h -> a                 s1 was never left:        a_h  leaves a       enters a
//!   state s2 { state a  state b  a -> h }   =>   it was left in b:         a_h  leaves a b     enters b
//!   state c }                                    it was left in c:         a_h  leaves s2 .. c enters h
//! ```
//!
//! The recorded states are stored a second time, in hidden variables that receptivities can read.

use super::codes;
use super::context::{Goal, Inner, Lowering};
use super::statechart::{domain, entered, inside};
use crate::Gather;
use crate::arena::Arena;
use crate::diag::Diagnostic;
use crate::expr::{Expr, Type};
use crate::net::{
    Enter, HistoryId, Leaf, Meta, StepId, StepKind, Stmt, StmtKind, Transition, TransitionId, Var,
    VarId, VarOrigin,
};
use crate::span::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// The maximum number of transitions that one transition may become.
const MAX_SITUATIONS: usize = 64;

/// One case of a split transition: under its own condition, it leaves and enters its own states.
struct Way {
    condition: Expr<Leaf>,
    domain: Option<StepId>,
    enters: Vec<Enter>,
}

/// The recorded states of a history, in variables.
struct Memory {
    /// True if a state is recorded.
    any: VarId,
    /// For each atomic state, true if it is recorded.
    states: BTreeMap<StepId, VarId>,
}

/// Splits transitions to a history of a state that contains their source. Of the passes that change transitions, it runs last, because it changes their ids.
pub(super) fn inner_histories(lowering: &mut Lowering<'_>) {
    let inner = std::mem::take(&mut lowering.inner_histories);
    let mut memories: BTreeMap<HistoryId, Memory> = BTreeMap::new();
    let mut ways: BTreeMap<TransitionId, Vec<Way>> = BTreeMap::new();
    for one in inner {
        let Some(found) = ways_of(lowering, one, &mut memories) else { continue };
        ways.insert(one.transition, found);
    }
    if !ways.is_empty() {
        take_apart(lowering, ways);
        for (history, memory) in memories {
            record(lowering, history, &memory);
        }
    }
}

/// The cases of a transition that need transitions in addition to the lowered one; `None` if there are none.
fn ways_of(
    lowering: &mut Lowering<'_>,
    one: Inner,
    memories: &mut BTreeMap<HistoryId, Memory>,
) -> Option<Vec<Way>> {
    let net = &lowering.net;
    let data = &net.histories[one.history];
    let owner = data.owner;
    let &[source] = net.transitions[one.transition].requires.as_slice() else { return None };
    let (part, span) = (net.steps[source].part, net.transitions[one.transition].meta.span);
    let outermost = domain(lowering, source, &[Goal::History(one.history)], one.is_internal);
    let mut ways = Vec::new();
    let is_recorded = net.transitions.values().any(|other| other.clears.contains(&owner));
    // A shallow history also counts as deep if it records only atomic states: it then records the same states as a deep one.
    let is_deep = data
        .cases
        .iter()
        .all(|case| matches!(net.steps[case.step].kind, StepKind::Leaf | StepKind::Final));

    // If nothing is recorded: the targets of the default transition.
    let goals = lowering.history_goals.get(&one.history).cloned().unwrap_or_default();
    if !goals.is_empty() {
        let by_default = domain(lowering, source, &goals, one.is_internal);
        if by_default != outermost {
            let condition = match is_recorded {
                true => {
                    let memory = memory(lowering, one.history, memories);
                    Expr::leaf(Leaf::Var(memory.any), span).not()
                }
                false => Expr::bool(true),
            };
            let enters = entered(lowering, part, by_default, &goals, span).ok()?;
            ways.push(Way { condition, domain: by_default, enters });
        }
    }
    if is_recorded && is_deep {
        let around = shared_states(lowering, source, owner, one.is_internal);
        let Some(&widest) = around.last() else {
            return Some(ways).filter(|ways| !ways.is_empty());
        };
        let Some(situations) = situations(lowering, widest) else {
            too_many(lowering, one, widest, span);
            return None;
        };
        for atomic in situations {
            let holds = |state: &StepId| {
                let range = inside(lowering, *state);
                atomic.iter().all(|step| range.contains(&step.index()))
            };
            let Some(domain) = around.iter().copied().find(holds) else { continue };
            let enters = path_to(lowering, &atomic, domain);
            let memory = memory(lowering, one.history, memories);
            let condition = Expr::and(atomic.iter().filter_map(|step| {
                memory.states.get(step).map(|var| Expr::leaf(Leaf::Var(*var), span))
            }));
            ways.push(Way { condition, domain: Some(domain), enters });
        }
    }
    Some(ways).filter(|ways| !ways.is_empty())
}

fn too_many(lowering: &mut Lowering<'_>, one: Inner, state: StepId, span: Span) {
    let history = lowering.net.histories[one.history].name.text.clone();
    let state = lowering.net.steps[state].name.text.clone();
    lowering.report(
        Diagnostic::error(
            codes::EXPANSION_SIZE,
            format!("the history `{history}` of a state that contains this transition's source can restore more than {MAX_SITUATIONS} situations in `{state}`"),
        )
        .at(span, "the states that it leaves depend on them")
        .help("target a state instead, or start the transition at the state that has the history"),
    );
}

/// The composite states inside `owner` that contain the source and may contain everything recorded, innermost first. Between such a state and the owner there
/// is no parallel state with several regions, because states in its other regions would be recorded too.
fn shared_states(
    lowering: &Lowering<'_>,
    source: StepId,
    owner: StepId,
    is_internal: bool,
) -> Vec<StepId> {
    let net = &lowering.net;
    let up = |step: &StepId| net.steps[*step].parent.filter(|parent| *parent != owner);
    let first = if is_internal { Some(source) } else { up(&source) };
    let mut chain: Vec<StepId> = std::iter::successors(first, up).collect();
    let forks = |step: &StepId| {
        let children = net.steps.values().filter(|child| child.parent == Some(*step));
        net.steps[*step].kind == StepKind::Parallel && children.count() > 1
    };
    // The history of a parallel state records states in all its regions.
    if forks(&owner) {
        return Vec::new();
    }
    // States inside a parallel state are recorded together with states in its other regions, so the search begins outside the outermost one.
    if let Some(last) = chain.iter().rposition(forks) {
        chain.drain(..=last);
    }
    chain.retain(|step| net.steps[*step].kind == StepKind::Composite);
    chain
}

/// The sets of atomic states that can be active together in an active state; `None` if there are too many.
fn situations(lowering: &Lowering<'_>, state: StepId) -> Option<Vec<BTreeSet<StepId>>> {
    let net = &lowering.net;
    // A state comes before its descendants.
    let mut of: BTreeMap<StepId, Vec<BTreeSet<StepId>>> = BTreeMap::new();
    let range = inside(lowering, state);
    for index in range.rev().chain([state.index()]) {
        let step = StepId::from_index(index);
        let children = net.steps.iter().filter(|(_, child)| child.parent == Some(step));
        let mut children = children.map(|(id, _)| of.remove(&id).unwrap_or_default());
        let sets: Vec<BTreeSet<StepId>> = match net.steps[step].kind {
            StepKind::Leaf | StepKind::Final | StepKind::Enclosing => {
                vec![[step].into_iter().gather()]
            }
            StepKind::Composite => children.flatten().collect(),
            StepKind::Parallel => {
                let first = children.next().unwrap_or_default();
                children.try_fold(first, |sets, region| {
                    let product = sets.len().checked_mul(region.len())?;
                    (product <= MAX_SITUATIONS).then(|| {
                        sets.iter()
                            .flat_map(|set| region.iter().map(move |other| set | other))
                            .collect()
                    })
                })?
            }
        };
        if sets.len() > MAX_SITUATIONS {
            return None;
        }
        of.insert(step, sets);
    }
    of.remove(&state)
}

/// All states below `domain` that are active when these atomic states are active, each before its descendants.
fn path_to(lowering: &Lowering<'_>, atomic: &BTreeSet<StepId>, domain: StepId) -> Vec<Enter> {
    let net = &lowering.net;
    let mut wanted: BTreeSet<StepId> = BTreeSet::new();
    for step in atomic {
        let up = |step: &StepId| net.steps[*step].parent;
        wanted.extend(std::iter::successors(Some(*step), up).take_while(|step| *step != domain));
    }
    wanted.into_iter().map(Enter::Step).collect()
}

fn memory<'m>(
    lowering: &mut Lowering<'_>,
    history: HistoryId,
    memories: &'m mut BTreeMap<HistoryId, Memory>,
) -> &'m Memory {
    memories.entry(history).or_insert_with(|| {
        let name = lowering.net.histories[history].name.clone();
        let any = bit(lowering, &format!("{name}_recorded"), name.span);
        let owner = lowering.net.histories[history].owner;
        let atomic = inside(lowering, owner).map(StepId::from_index).filter(|step| {
            matches!(lowering.net.steps[*step].kind, StepKind::Leaf | StepKind::Final)
        });
        let atomic: Vec<StepId> = atomic.collect();
        let states = atomic.into_iter().map(|step| {
            let base = format!("{name}_{}", lowering.net.steps[step].name);
            (step, bit(lowering, &base, name.span))
        });
        Memory { any, states: states.gather() }
    })
}

fn bit(lowering: &mut Lowering<'_>, base: &str, span: Span) -> VarId {
    let name = Name::new(lowering.fresh_name(base), span);
    lowering.net.vars.push(Var {
        name,
        ty: Type::Bool,
        len: None,
        init: vec![0],
        origin: VarOrigin::Hidden,
        meta: Meta { span, ..Meta::default() },
    })
}

fn set(var: VarId, value: Expr<Leaf>, span: Span) -> Stmt {
    Stmt { kind: StmtKind::Assign { var, index: None, value }, span }
}

/// Adds the statements that update the memory when the owner is left, as the history itself is updated. With `assign simultaneous` the owner's exit list still
/// sees which states were active. Otherwise they are already inactive, so each state sets a mark in its own exit list; the owner's exit list reads and clears
/// the marks, and a transition that leaves the state but not the owner clears its mark.
fn record(lowering: &mut Lowering<'_>, history: HistoryId, memory: &Memory) {
    let owner = lowering.net.histories[history].owner;
    let span = lowering.net.histories[history].name.span;
    let mut list = vec![set(memory.any, Expr::bool(true), span)];
    for (step, var) in &memory.states {
        if lowering.net.settings.assign_simultaneous {
            list.push(set(*var, Expr::leaf(Leaf::Active(*step), span), span));
            continue;
        }
        let mark = bit(lowering, &format!("{}_left", lowering.net.vars[*var].name), span);
        let net = &mut lowering.net;
        net.steps[*step].exit.push(set(mark, Expr::bool(true), span));
        list.push(set(*var, Expr::leaf(Leaf::Var(mark), span), span));
        list.push(set(mark, Expr::bool(false), span));
        for id in net.transitions.ids() {
            let transition = &mut net.transitions[id];
            if transition.clears.contains(step) && !transition.clears.contains(&owner) {
                transition.actions.insert(0, set(mark, Expr::bool(false), span));
            }
        }
    }
    lowering.net.steps[owner].exit.extend(list);
}

/// Adds the other cases of each transition after it. Their order does not matter, because at most one of them is enabled.
fn take_apart(lowering: &mut Lowering<'_>, mut ways: BTreeMap<TransitionId, Vec<Way>>) {
    let old = std::mem::take(&mut lowering.net.transitions);
    let mut new: Arena<Transition> = Arena::default();
    let mut moved: BTreeMap<TransitionId, Vec<TransitionId>> = BTreeMap::new();
    for (id, mut transition) in old.iter().map(|(id, transition)| (id, transition.clone())) {
        transition.guard = renamed(&transition.guard, &moved);
        let ids = moved.entry(id).or_default();
        let ways = ways.remove(&id).unwrap_or_default();
        let others = Expr::or(ways.iter().map(|way| way.condition.clone())).not();
        for way in ways {
            let clears = inside_of(lowering, &transition, way.domain);
            let mut part = Transition { clears, enters: way.enters, ..transition.clone() };
            part.guard = Expr::and([way.condition, transition.guard.clone()]);
            if !others.is_false() {
                let name = lowering.fresh_name(&transition.name.text);
                part.name = Name::new(name, transition.name.span);
            }
            ids.push(new.push(part));
        }
        if !others.is_false() {
            transition.guard = Expr::and([others, transition.guard]);
            ids.push(new.push(transition));
        }
    }
    lowering.net.transitions = new;
}

fn inside_of(
    lowering: &Lowering<'_>,
    transition: &Transition,
    domain: Option<StepId>,
) -> Vec<StepId> {
    match domain {
        Some(state) => inside(lowering, state).map(StepId::from_index).collect(),
        None => transition.clears.clone(),
    }
}

/// Replaces each test of whether a transition is fireable with a test of all the transitions into which it was split.
fn renamed(guard: &Expr<Leaf>, moved: &BTreeMap<TransitionId, Vec<TransitionId>>) -> Expr<Leaf> {
    guard.map(
        &mut |leaf, span| {
            let Leaf::Fireable(id) = leaf else { return Expr::leaf(*leaf, span) };
            let became = moved.get(id).into_iter().flatten();
            Expr::or(became.map(|id| Expr::leaf(Leaf::Fireable(*id), span)))
        },
        &mut |leaf, _| *leaf,
    )
}
