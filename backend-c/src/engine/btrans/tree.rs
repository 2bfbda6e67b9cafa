//! The states as a tree, and the destination of each transition in it. The engine's result for each row is compared with the net.

use super::{Tabled, refuse};
use crate::engine::Plan;
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Enter, Net, StepKind, Transition, TransitionKind};
use std::collections::{BTreeMap, BTreeSet};

/// How a transition moves, as encoded in its row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Move {
    External = 0,
    Internal = 1,
    Stays = 2,
}

/// The destination of a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Goal {
    pub(super) kind: Move,
    pub(super) to: usize,
    pub(super) history: Option<usize>,
}

/// The states by number: the children of each, and its default child.
pub(super) struct Tree {
    pub(super) parent: Vec<Option<usize>>,
    pub(super) children: Vec<Vec<usize>>,
    pub(super) last: Vec<usize>,
    pub(super) parallel: Vec<bool>,
    pub(super) default: Vec<Option<usize>>,
}

impl Tree {
    fn of(plan: &Plan<'_>) -> Self {
        let net = plan.net;
        let parent: Vec<Option<usize>> =
            net.steps.values().map(|step| step.parent.map(|it| it.index())).collect();
        let mut children = vec![Vec::new(); parent.len()];
        for (at, parent) in parent.iter().enumerate() {
            if let Some(parent) = parent {
                children[*parent].push(at);
            }
        }
        let is_parallel = |kind| kind == StepKind::Parallel;
        let parallel = net.steps.values().map(|step| is_parallel(step.kind)).collect();
        let default = children.iter().map(|all| all.first().copied()).collect();
        Tree { parent, children, last: plan.last.clone(), parallel, default }
    }

    /// Makes the child that transitions enter most often the default child of each state, instead of the first child.
    fn vote(&mut self, net: &Net) {
        let mut votes: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for list in net.transitions.values().map(|it| &it.enters) {
            for step in steps(list) {
                if let Some(parent) = self.parent[step] {
                    *votes.entry((parent, step)).or_default() += 1;
                }
            }
        }
        for (state, default) in self.default.iter_mut().enumerate() {
            let count = |child: &usize| votes.get(&(state, *child)).copied().unwrap_or(0);
            let best = self.children[state].iter().rev().max_by_key(|child| count(child));
            *default = best.copied();
        }
    }

    fn is_in(&self, state: usize, outer: Option<usize>) -> bool {
        outer.is_none_or(|outer| state > outer && state <= self.last[outer])
    }

    /// The domain of a transition, computed like `gb_domain`.
    fn domain(&self, from: usize, goal: Goal) -> Option<usize> {
        let mut up = Some(from);
        if goal.kind == Move::External {
            loop {
                up = up.and_then(|state| self.parent[state]);
                if up.is_none_or(|it| !self.parallel[it]) && self.is_in(goal.to, up) {
                    break;
                }
            }
        }
        up
    }

    /// The states on the path to a destination, computed like `gb_path`; `None` if the path does not lead to the domain.
    pub(super) fn path(&self, state: usize, domain: Option<usize>) -> Option<Vec<usize>> {
        let mut way = Vec::new();
        let mut up = Some(state);
        while up != domain {
            way.push(up?);
            up = up.and_then(|it| self.parent[it]);
        }
        Some(way)
    }

    /// Marks the states entered by default, like `gb_descend`; nothing is entered below `closed` by default.
    pub(super) fn descend(&self, marked: &mut BTreeSet<usize>, closed: Option<usize>) {
        for state in 0..self.parent.len() {
            if !marked.contains(&state) || closed == Some(state) {
                continue;
            }
            if self.parallel[state] {
                marked.extend(&self.children[state]);
            }
            if !self.children[state].iter().any(|child| marked.contains(child)) {
                marked.extend(self.default[state]);
            }
        }
    }

    /// Whether the engine, given this goal, does what the net defines for the transition.
    fn explains(&self, from: usize, goal: Goal, transition: &Transition) -> bool {
        let domain = self.domain(from, goal);
        let range = match domain {
            Some(domain) => domain + 1..self.last[domain] + 1,
            None => 0..self.parent.len(),
        };
        let clears: BTreeSet<usize> = transition.clears.iter().map(|it| it.index()).gather();
        let Some(way) = self.path(goal.to, domain) else { return false };
        let mut marked: BTreeSet<usize> = way.into_iter().gather();
        let owner = goal.history.map(|_| goal.to);
        self.descend(&mut marked, owner);
        range.eq(clears) && marked == steps(&transition.enters).gather()
    }
}

pub(super) fn steps(list: &[Enter]) -> impl Iterator<Item = usize> {
    list.iter().filter_map(|enter| match enter {
        Enter::Step(step) => Some(step.index()),
        Enter::InitialContent(_) | Enter::History(_) => None,
    })
}

/// The destination of each transition, and the tree with default children for which the engine does what the net defines.
pub(super) fn goals<'a>(plan: &Plan<'a>) -> Tabled<(Tree, Vec<Goal>)> {
    let net: &'a Net = plan.net;
    let mut tree = Tree::of(plan);
    let mut found = all_goals(net, &tree);
    if found.is_err() {
        tree.vote(net);
        found = all_goals(net, &tree);
    }
    let goals = found?;
    for history in net.histories.values() {
        let owner = history.owner.index();
        let way = |state: usize| tree.path(state, Some(owner));
        for case in &history.cases {
            let Some(way) = way(case.step.index()) else {
                return refuse("a history of states outside of its owner", history.meta.span);
            };
            let way: BTreeSet<usize> = way.into_iter().gather();
            let mut closed = way.clone();
            tree.descend(&mut closed, None);
            let entered: BTreeSet<usize> = steps(&case.enters).gather();
            if entered != way && entered != closed
                || case.enters.iter().any(|it| matches!(it, Enter::History(_)))
            {
                return refuse("a history that enters more than it remembers", history.meta.span);
            }
        }
    }
    Ok((tree, goals))
}

fn all_goals(net: &Net, tree: &Tree) -> Tabled<Vec<Goal>> {
    net.transitions.values().map(|transition| goal(net, tree, transition)).collect()
}

fn goal(net: &Net, tree: &Tree, transition: &Transition) -> Tabled<Goal> {
    let from = transition.requires.first().map_or(0, |step| step.index());
    if transition.kind == TransitionKind::Reaction {
        return Ok(Goal { kind: Move::Stays, to: from, history: None });
    }
    let histories: Vec<usize> = transition
        .enters
        .iter()
        .filter_map(|enter| match enter {
            Enter::History(history) => Some(history.index()),
            Enter::Step(_) | Enter::InitialContent(_) => None,
        })
        .collect();
    let targets: Vec<(usize, Option<usize>)> = match histories.as_slice() {
        [] => steps(&transition.enters).map(|state| (state, None)).collect(),
        [history] => {
            let owner = net.histories.iter().nth(*history).map(|(_, it)| it.owner.index());
            owner.map(|owner| (owner, Some(*history))).into_iter().collect()
        }
        _ => return refuse("a transition to several histories", transition.meta.span),
    };
    for kind in [Move::External, Move::Internal] {
        for (to, history) in &targets {
            let goal = Goal { kind, to: *to, history: *history };
            if tree.explains(from, goal, transition) {
                return Ok(goal);
            }
        }
    }
    refuse(
        "a transition with several destinations, or one whose path the state tables cannot express",
        transition.meta.span,
    )
}
