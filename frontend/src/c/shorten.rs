//! Reduces the number of steps of a computation.
//!
//! ```text
//! always          empty joins disappear; a condition after one step moves to the transitions of that step, as NBS88 draws `if`;
//!                 unreachable nodes are removed
//! with --fuse     a step and its only successor are merged if the successor has no other predecessor; a condition where several ways
//!                 meet is copied
//!                 to the steps before it
//! ```

use super::graph::{Graph, Next, Node, NodeId};
use grafsynth_ir::Gather;
use grafsynth_ir::chart::{Expr, Leaf, Stmt, StmtKind};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of copied statements that prepare a condition, for each way that leads to it.
const COPIED: usize = 4;

/// Shortens a graph. `lasting` lists the externally visible names: two accesses to one of them stay in two steps.
pub(super) fn shorten(graph: &mut Graph, fuse: bool, lasting: &BTreeSet<String>) {
    constants(&mut graph.nodes);
    joins(graph);
    let temps: BTreeSet<String> = graph.temps.iter().map(|(name, _)| name.clone()).gather();
    merge(graph, &|before, after| {
        let is_pure = after.body.iter().all(|stmt| matches!(&stmt.kind, StmtKind::Assign { target, .. } if temps.contains(&target.to_string())));
        let is_branch = after.is_test && matches!(after.next, Next::Branch(..));
        let is_call = after.body.is_empty() && matches!(after.next, Next::Call(..));
        (is_branch && is_pure || is_call)
            && !after.is_kept
            && before.group == after.group
            && matches!(before.next, Next::Goto(_))
    });
    if fuse {
        let mergeable = |before: &Node, after: &Node| {
            before.group == after.group
                && matches!(before.next, Next::Goto(_))
                && !both_touch(before, after, lasting)
        };
        merge(graph, &mergeable);
        copy_tests(graph, &temps, lasting);
        merge(graph, &mergeable);
    }
    reachable(graph);
}

/// Resolves branches with constant conditions.
fn constants(nodes: &mut [Node]) {
    for node in nodes {
        if let Next::Branch(ways, otherwise) = &mut node.next {
            ways.retain(|way| !way.guard.is_false());
            if let Some(certain) = ways.iter().position(|way| way.guard.is_true()) {
                *otherwise = ways[certain].to;
                ways.truncate(certain);
            }
            if ways.is_empty() {
                node.next = Next::Goto(*otherwise);
            }
        }
    }
}

/// All references of a node to other nodes.
pub(super) fn targets(next: &mut Next) -> Vec<&mut NodeId> {
    match next {
        Next::None | Next::Exit => Vec::new(),
        Next::Goto(to) | Next::Call(_, to) => vec![to],
        Next::Branch(ways, otherwise) => {
            ways.iter_mut().map(|way| &mut way.to).chain([otherwise]).collect()
        }
    }
}

/// The successors of a node.
pub(super) fn successors(next: &Next) -> Vec<NodeId> {
    match next {
        Next::None | Next::Exit => Vec::new(),
        Next::Goto(to) | Next::Call(_, to) => vec![*to],
        Next::Branch(ways, otherwise) => {
            ways.iter().map(|way| way.to).chain([*otherwise]).collect()
        }
    }
}

fn joins(graph: &mut Graph) {
    let n = graph.nodes.len();
    let is_join = |node: &Node| node.body.is_empty() && !node.is_kept;
    let mut end_of: Vec<NodeId> = (0..n).collect();
    let mut is_known = vec![false; n];
    for first in 0..n {
        let mut way: Vec<NodeId> = Vec::new();
        let mut seen = BTreeSet::new();
        let mut at = first;
        let mut label = String::new();
        while let Next::Goto(to) = graph.nodes[at].next {
            if is_known[at] {
                at = end_of[at];
                break;
            }
            if !is_join(&graph.nodes[at]) || !seen.insert(at) {
                break;
            }
            way.push(at);
            if !graph.nodes[at].hint.is_empty()
                && !graph.nodes[at].is_test
                && graph.nodes[at].text.is_empty()
            {
                label.clone_from(&graph.nodes[at].hint);
            }
            at = to;
        }
        // A cycle that consists only of joins is an endless loop that does nothing; one of its joins stays.
        for passed in way {
            end_of[passed] = at;
            is_known[passed] = true;
        }
        if at != first
            && !label.is_empty()
            && !matches!(graph.nodes[at].next, Next::Exit)
            && at != graph.start
        {
            graph.nodes[at].hint = label;
        }
    }
    for node in &mut graph.nodes {
        for to in targets(&mut node.next) {
            *to = end_of[*to];
        }
    }
}

/// The number of ways to each node from reachable nodes.
fn predecessors(graph: &Graph) -> Vec<usize> {
    let mut n_ways = vec![0; graph.nodes.len()];
    n_ways[graph.start] = 1;
    for id in reached(graph) {
        for to in successors(&graph.nodes[id].next) {
            n_ways[to] += 1;
        }
    }
    n_ways
}

fn reached(graph: &Graph) -> BTreeSet<NodeId> {
    let mut seen: BTreeSet<_> = [graph.start].into_iter().gather();
    let mut open = vec![graph.start];
    while let Some(id) = open.pop() {
        for to in successors(&graph.nodes[id].next) {
            if seen.insert(to) {
                open.push(to);
            }
        }
    }
    seen
}

/// Merges nodes into their predecessors, as long as `may` allows it.
fn merge(graph: &mut Graph, may: &dyn Fn(&Node, &Node) -> bool) {
    let n_ways = predecessors(graph);
    for id in reached(graph) {
        while let Next::Goto(to) = graph.nodes[id].next {
            let is_exit =
                matches!(graph.nodes[to].next, Next::Exit) && graph.nodes[to].body.is_empty();
            if to == id || n_ways[to] != 1 || is_exit || !may(&graph.nodes[id], &graph.nodes[to]) {
                break;
            }
            let next = std::mem::replace(&mut graph.nodes[to].next, Next::None);
            let body = std::mem::take(&mut graph.nodes[to].body);
            let comments = std::mem::take(&mut graph.nodes[to].comments);
            let (text, test, hint) = (
                graph.nodes[to].text.clone(),
                graph.nodes[to].test.clone(),
                graph.nodes[to].hint.clone(),
            );
            let span = graph.nodes[to].span;
            let is_start = id == graph.start;
            let node = &mut graph.nodes[id];
            // Statements keep their text. The first one names the step; the first step of a function keeps its name.
            if !text.is_empty() && !node.text.contains(&text) {
                node.text =
                    if node.text.is_empty() { text } else { format!("{} {text}", node.text) };
            }
            if node.hint.is_empty() || (node.hint == "null" && !is_start) {
                node.hint = hint;
            }
            node.test = test;
            node.comments.extend(comments);
            node.body.extend(body);
            node.next = next;
            node.span = node.span.to(span);
        }
    }
}

fn copy_tests(graph: &mut Graph, temps: &BTreeSet<String>, lasting: &BTreeSet<String>) {
    for id in reached(graph) {
        // A condition may lead to another condition.
        for _ in 0..8 {
            let Next::Goto(to) = graph.nodes[id].next else { break };
            let test = &graph.nodes[to];
            let is_pure = test.body.iter().all(|stmt| matches!(&stmt.kind, StmtKind::Assign { target, .. } if temps.contains(&target.to_string())));
            let is_copied = test.is_test
                && is_pure
                && !test.is_kept
                && matches!(test.next, Next::Branch(..))
                && test.body.len() <= COPIED;
            if to == id
                || !is_copied
                || test.group != graph.nodes[id].group
                || both_touch(&graph.nodes[id], test, lasting)
            {
                break;
            }
            let (body, next, test) = (test.body.clone(), test.next.clone(), test.test.clone());
            let node = &mut graph.nodes[id];
            node.body.extend(body);
            node.next = next;
            node.test = test;
        }
    }
}

/// Removes unreachable nodes.
fn reachable(graph: &mut Graph) {
    let mut kept = reached(graph);
    // A macro has an exit step even if its function never returns.
    kept.extend(graph.nodes.iter().position(|node| matches!(node.next, Next::Exit)));
    let new: BTreeMap<NodeId, NodeId> =
        kept.iter().enumerate().map(|(new, old)| (*old, new)).gather();
    let nodes = std::mem::take(&mut graph.nodes);
    graph.nodes = nodes
        .into_iter()
        .enumerate()
        .filter(|(id, _)| kept.contains(id))
        .map(|(_, node)| node)
        .collect();
    for node in &mut graph.nodes {
        for to in targets(&mut node.next) {
            *to = new[to];
        }
    }
    graph.start = new[&graph.start];
}

fn both_touch(a: &Node, b: &Node, lasting: &BTreeSet<String>) -> bool {
    let (a, b) = (touched(&a.body, lasting), touched(&b.body, lasting));
    a.intersection(&b).next().is_some()
}

fn touched(body: &[Stmt], lasting: &BTreeSet<String>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for stmt in body {
        if let StmtKind::Assign { target, index, value } = &stmt.kind {
            let mut add = |name: String| {
                if lasting.contains(&name) {
                    found.insert(name);
                }
            };
            add(target.to_string());
            for expr in index.iter().chain([value]) {
                names(expr, &mut add);
            }
        }
    }
    found
}

fn names(expr: &Expr, add: &mut impl FnMut(String)) {
    for leaf in expr.leaves() {
        if let Leaf::Name(path) = leaf {
            add(path.to_string());
        }
    }
}
