//! The tree of states of a statechart.

use crate::arena::IdMap;
use crate::net::{Net, Step, StepId, StepKind, Transition, TransitionId};

/// Parents, children, and the transitions that leave each state.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    pub(super) children: IdMap<Step, Vec<StepId>>,
    /// Transitions by source, in document order.
    pub(super) leaving: IdMap<Step, Vec<TransitionId>>,
    /// True if more than one atomic state may be active in the state.
    pub(super) is_wide: IdMap<Step, bool>,
    /// Children before parents, otherwise in document order.
    pub(super) post_order: Vec<StepId>,
    /// The state whose proper descendants a transition leaves; `None` for a whole part.
    pub(super) domain: IdMap<Transition, Option<StepId>>,
}

impl Tree {
    pub(super) fn of(net: &Net) -> Self {
        let mut children = IdMap::filled(&net.steps, Vec::new());
        let mut roots = Vec::new();
        for (id, step) in net.steps.iter() {
            match step.parent {
                Some(parent) => children[parent].push(id),
                None => roots.push(id),
            }
        }
        let mut leaving = IdMap::filled(&net.steps, Vec::new());
        for (id, transition) in net.transitions.iter() {
            if let Some(source) = transition.requires.first() {
                leaving[*source].push(id);
            }
        }
        // Depth first without recursion: a state is pushed a second time, to be listed after its children.
        let mut post_order = Vec::new();
        let mut todo: Vec<(StepId, bool)> = roots.iter().rev().map(|step| (*step, false)).collect();
        while let Some((step, is_done)) = todo.pop() {
            if is_done {
                post_order.push(step);
            } else {
                todo.push((step, true));
                todo.extend(children[step].iter().rev().map(|child| (*child, false)));
            }
        }
        let mut is_wide = IdMap::filled(&net.steps, false);
        for step in &post_order {
            let branches = net.steps[*step].kind == StepKind::Parallel && children[*step].len() > 1;
            is_wide[*step] = branches || children[*step].iter().any(|child| is_wide[*child]);
        }
        // The first state in document order that a transition leaves is a child of its domain, because parents are declared before children.
        let domain = IdMap::build(&net.transitions, |_, transition| {
            transition.clears.iter().min().and_then(|first| net.steps[*first].parent)
        });
        Tree { children, leaving, is_wide, post_order, domain }
    }

    /// True if exactly one atomic state is active in the state while it is active, and this is not the case for its parent.
    pub(super) fn is_block(&self, net: &Net, step: StepId) -> bool {
        !self.is_wide[step] && net.steps[step].parent.is_none_or(|parent| self.is_wide[parent])
    }

    /// The transitions out of a state and out of its descendants.
    pub(super) fn within(&self, step: StepId) -> Vec<TransitionId> {
        let mut all = Vec::new();
        let mut todo = vec![step];
        while let Some(step) = todo.pop() {
            all.extend(&self.leaving[step]);
            todo.extend(&self.children[step]);
        }
        all
    }

    /// True if firing leaves everything in `state`, which contains the transition's source.
    pub(super) fn leaves(&self, net: &Net, transition: TransitionId, state: StepId) -> bool {
        if net.transitions[transition].clears.is_empty() {
            return false;
        }
        let Some(domain) = self.domain[transition] else { return true };
        domain == state
            || std::iter::successors(net.steps[state].parent, |step| net.steps[*step].parent)
                .take(net.steps.len())
                .any(|step| step == domain)
    }
}
