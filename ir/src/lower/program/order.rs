//! The order in which the actions of a statechart's transitions run: that of their selection (§3.3, §4).
//!
//! A transition is selected when the first active atomic state offers it. Usually that position is known: sources in different regions are selected in
//! document order, and of nested sources only one is selected. Only a transition that leaves nothing (or whose source contains the source of one that
//! leaves nothing) can be selected together with one inside its own source, before or after it, depending on the active states. Its actions are then
//! placed at each point where it may be selected, and run at the first one that applies.

use super::tree::Tree;
use super::{Builder, temp, when};
use crate::arena::IdMap;
use crate::expr::Type;
use crate::net::{Policy, Step, Transition, TransitionId};
use crate::program::{Expr, Stmt, TempRole};
use crate::simplify::simplify;

/// One position in the sequence of actions.
#[derive(Debug, Clone)]
pub(super) struct Act {
    pub(super) transition: TransitionId,
    /// The condition for this position, if the position depends on the situation.
    pub(super) here: Option<Expr>,
}

impl Builder<'_> {
    /// The positions of all actions, in order. Must be called before anything changes, because the conditions are those of the check.
    pub(super) fn action_order(
        &mut self,
        tree: &Tree,
        fireable: &IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) -> Vec<Act> {
        let net = self.net;
        let floating = IdMap::build(&net.transitions, |id, _| self.is_floating(tree, id));
        let mut own: IdMap<Step, Expr> = IdMap::filled(&net.steps, Expr::bool(false));
        let mut stirs = own.clone();
        if floating.values().any(|floats| *floats) {
            for step in &tree.post_order {
                own[*step] = Expr::or(tree.leaving[*step].iter().map(|id| fireable[*id].clone()));
                let inside = tree.children[*step].iter().map(|child| stirs[*child].clone());
                let any = Expr::or([own[*step].clone()].into_iter().chain(inside));
                let name = format!("{}.offers", net.steps[*step].name);
                stirs[*step] = self.named(name, TempRole::Helper, any, out);
            }
        }
        let mut order = Vec::new();
        for step in &tree.post_order {
            let settled = tree.leaving[*step].iter().filter(|id| !floating[**id]);
            order.extend(settled.map(|id| Act { transition: *id, here: None }));
            if !tree.is_block(net, *step) {
                continue;
            }
            // The one active atomic state of this block offers the transitions of the states above it if nothing fireable is on the path.
            let mut way = vec![self.is_active(*step), stirs[*step].clone().not()];
            let mut above = net.steps[*step].parent;
            while let Some(state) = above {
                let here = tree.leaving[state].iter().copied().filter(|id| floating[*id]);
                for id in here {
                    let name = format!("{}.here", net.transitions[id].name);
                    let here =
                        self.named(name, TempRole::Helper, simplify(&Expr::and(way.clone())), out);
                    order.push(Act { transition: id, here: Some(here) });
                }
                way.push(own[state].clone().not());
                above = net.steps[state].parent;
            }
        }
        order
    }

    /// True if its position among the actions depends on the situation.
    fn is_floating(&self, tree: &Tree, id: TransitionId) -> bool {
        let net = self.net;
        let transition = &net.transitions[id];
        let Some(source) = transition.requires.first() else { return false };
        net.settings.policy == Policy::InnerFirst
            && !transition.actions.is_empty()
            && tree.is_wide[*source]
            && tree.children[*source].iter().flat_map(|child| tree.within(*child)).any(|other| {
                let other = &net.transitions[other];
                !other.actions.is_empty()
                    && (other.clears.is_empty() || transition.clears.is_empty())
            })
    }

    /// Runs the transition actions of a micro-step.
    pub(super) fn run_actions(
        &mut self,
        order: &[Act],
        fire: &IdMap<Transition, Expr>,
        sequence: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        let mut done = IdMap::filled(&net.transitions, None);
        for act in order {
            let id = act.transition;
            let mut list = self.list(&net.transitions[id].actions);
            let Some(here) = &act.here else {
                when(fire[id].clone(), list, sequence);
                continue;
            };
            let flag = match done[id] {
                Some(flag) => flag,
                None => {
                    let name = format!("{}.done", net.transitions[id].name);
                    let flag = self.new_temp(name, Type::Bool, TempRole::Helper);
                    sequence.push(Stmt::Set(flag, Expr::bool(false)));
                    done[id] = Some(flag);
                    flag
                }
            };
            list.push(Stmt::Set(flag, Expr::bool(true)));
            when(Expr::and([fire[id].clone(), here.clone(), temp(flag).not()]), list, sequence);
        }
    }
}
