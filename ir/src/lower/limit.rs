//! Pass `limit`: chooses the limit of micro-steps of a stable evolution if the chart sets none (semantics §3.4).

use super::context::{Lowering, Work};
use crate::Gather;
use crate::net::{
    Enter, Evolution, HistoryId, InputId, MAX_LIMIT, Net, StepId, StepKind, Stmt, StmtKind,
    Transition, TransitionId, TransitionKind,
};
use crate::walk::statements;
use petgraph::algo::kosaraju_scc;
use petgraph::graph::DiGraph;
use std::collections::{BTreeMap, BTreeSet};

/// The minimum limit if the transitions of a statechart form a cycle without events: loops over a counter are common in SCXML.
const LOOPS: u32 = 1000;

/// Sets the limit of micro-steps if the chart has none. Runs last, when all steps and transitions exist: the limit is the number of leaf and enclosing steps
/// plus transitions, without reactions. Without a cycle no reaction of a statechart needs more, so only charts with a cycle get the larger limit [`LOOPS`].
pub(super) fn limit(lowering: &mut Lowering<'_>) {
    let net = &mut lowering.net;
    if !matches!(net.settings.evolution, Evolution::Stable { limit: 0 }) {
        return;
    }
    let steps = net.steps.values().filter(|step| {
        !step.hidden && matches!(step.kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final)
    });
    let transitions = lowering.work.iter().filter(|work| matches!(work, Work::Transition { .. }));
    let count = steps.count() + transitions.count();
    let mut limit = u32::try_from(count).unwrap_or(u32::MAX).max(1);
    if net.settings.policy.is_statechart() && has_circle(net) {
        limit = limit.max(LOOPS);
    }
    net.settings.evolution = Evolution::Stable { limit: limit.min(MAX_LIMIT) };
}

/// True if transitions that need no external event can follow each other for ever.
fn has_circle(net: &Net) -> bool {
    let mut raised: BTreeSet<InputId> =
        net.steps.values().filter_map(|step| step.done_event).gather();
    let steps =
        net.steps.values().flat_map(|step| [&step.entry, &step.exit, &step.initial_content]);
    let transitions = net.transitions.values().map(|transition| &transition.actions);
    let histories = net.histories.values().map(|history| &history.default_content);
    for list in steps.chain(transitions).chain(histories) {
        raised_in(net, list, &mut raised);
    }
    let is_inner = |transition: &Transition| {
        transition.events.is_empty() || transition.events.iter().any(|event| raised.contains(event))
    };
    let inner: Vec<(TransitionId, &Transition)> =
        net.transitions.iter().filter(|(_, transition)| is_inner(transition)).collect();
    // A reaction leaves its state active, so it can follow itself.
    if inner.iter().any(|(_, transition)| transition.kind == TransitionKind::Reaction) {
        return true;
    }
    let mut leaving: BTreeMap<StepId, Vec<usize>> = BTreeMap::new();
    for (index, (_, transition)) in inner.iter().enumerate() {
        for step in &transition.requires {
            leaving.entry(*step).or_default().push(index);
        }
    }
    let mut graph: DiGraph<(), ()> = DiGraph::with_capacity(inner.len(), inner.len());
    let nodes: Vec<_> = inner.iter().map(|_| graph.add_node(())).collect();
    for (index, (_, transition)) in inner.iter().enumerate() {
        for step in entered(net, transition) {
            for next in leaving.get(&step).into_iter().flatten() {
                graph.update_edge(nodes[index], nodes[*next], ());
            }
        }
    }
    kosaraju_scc(&graph)
        .iter()
        .any(|group| group.len() > 1 || group.iter().any(|node| graph.contains_edge(*node, *node)))
}

/// Everything that a transition may enter. The states that contain its source stay active; their transitions may fire next, but can repeat only if
/// something enters these states again, so they are not followed.
fn entered(net: &Net, transition: &Transition) -> BTreeSet<StepId> {
    let mut found = BTreeSet::new();
    let mut seen: BTreeSet<HistoryId> = BTreeSet::new();
    let mut todo = transition.enters.clone();
    while let Some(enter) = todo.pop() {
        match enter {
            Enter::Step(step) => {
                found.insert(step);
            }
            Enter::InitialContent(_) => {}
            Enter::History(history) => {
                if seen.insert(history) {
                    let data = &net.histories[history];
                    todo.extend(data.default.iter().copied());
                    todo.extend(data.cases.iter().flat_map(|case| case.enters.iter().copied()));
                }
            }
        }
    }
    found
}

fn raised_in(net: &Net, list: &[Stmt], out: &mut BTreeSet<InputId>) {
    for stmt in statements(list) {
        match stmt.kind {
            StmtKind::Raise(event) => {
                out.insert(event);
            }
            StmtKind::Send(slot) => {
                let send = &net.sends[slot];
                if send.delay == 0 {
                    out.insert(send.event);
                }
            }
            StmtKind::If { .. }
            | StmtKind::Assign { .. }
            | StmtKind::Cancel(_)
            | StmtKind::Call { .. }
            | StmtKind::Code(_) => {}
        }
    }
}
