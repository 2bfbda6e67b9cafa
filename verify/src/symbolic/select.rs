//! Which of the fireable transitions fire: semantics §4 as functions.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::net::{Policy, StepId, TransitionId};

use super::aig::Lit;
use super::reaction::{Maker, Unsupported};
use super::state::{State, is_move};
use crate::exclusive::entered;

impl Maker<'_> {
    /// Determines which transitions compete under `priority-age`, and whose ages are compared.
    pub(super) fn competition(&mut self) -> Result<(), Unsupported> {
        let net = self.net;
        if net.settings.policy != Policy::PriorityAge {
            return Ok(());
        }
        let mut pairs: Vec<(TransitionId, TransitionId)> = Vec::new();
        if net.settings.fire_one {
            let moves: Vec<TransitionId> =
                net.transitions.ids().filter(|id| is_move(net, *id)).collect();
            if moves.len() > 64 {
                return Err(
                    "`fire one` under `priority-age` with more than 64 transitions is not covered"
                        .to_owned(),
                );
            }
            for (at, second) in moves.iter().enumerate() {
                pairs.extend(moves[..at].iter().map(|first| (*first, *second)));
            }
        } else {
            for all in crate::exclusive::leaving(net).values() {
                if all.len() > 128 {
                    return Err("more than 128 transitions compete by age at one step".to_owned());
                }
                for (at, second) in all.iter().enumerate() {
                    pairs.extend(all[..at].iter().map(|first| (*first, *second)));
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut older = BTreeSet::new();
        for (first, second) in pairs {
            self.rivals.entry(first).or_default().push(second);
            self.rivals.entry(second).or_default().push(first);
            if self.key(first) != self.key(second) {
                continue;
            }
            for a in entered(&net.transitions[first]) {
                for b in entered(&net.transitions[second]).filter(|b| *b != a) {
                    older.insert((a.min(b), a.max(b)));
                }
            }
        }
        self.shape.older = older.into_iter().collect();
        Ok(())
    }

    /// For each transition, whether it fires (semantics §4).
    pub(super) fn select(&mut self, state: &State) -> Result<Vec<Lit>, Unsupported> {
        let net = self.net;
        let mut chosen = self.free.clone();
        match net.settings.policy {
            Policy::PriorityAge => {
                self.select_by_age(state, &mut chosen)?;
                return Ok(chosen);
            }
            Policy::All | Policy::Priority | Policy::InnerFirst | Policy::OuterFirst => {}
        }
        let competes = net.settings.policy == Policy::Priority;
        let mut consumed = vec![Lit::FALSE; net.steps.len()];
        let mut any = Lit::FALSE;
        for id in self.transition_order.clone() {
            if !is_move(net, id) {
                continue;
            }
            let transition = &net.transitions[id];
            let mut parts = vec![self.free[id.index()]];
            if competes {
                parts.extend(transition.requires.iter().map(|step| !consumed[step.index()]));
            }
            if net.settings.fire_one {
                parts.push(!any);
            }
            let taken = self.aig.and_all(parts);
            chosen[id.index()] = taken;
            if competes {
                for step in &transition.requires {
                    consumed[step.index()] = self.aig.or(consumed[step.index()], taken);
                }
            }
            if net.settings.fire_one {
                any = self.aig.or(any, taken);
            }
        }
        Ok(chosen)
    }

    fn older(&self, state: &State, a: StepId, b: StepId) -> Lit {
        let lit = state.older.get(&(a.min(b), a.max(b))).copied().unwrap_or(Lit::FALSE);
        lit.negate_if(b < a)
    }

    /// True if the oldest following step of `a` is older than all following steps of `b`.
    fn has_older(&mut self, state: &State, a: TransitionId, b: TransitionId) -> Lit {
        let net = self.net;
        let theirs: Vec<StepId> = entered(&net.transitions[b]).collect();
        let mut ways = Vec::new();
        for mine in entered(&net.transitions[a]).filter(|step| !theirs.contains(step)) {
            let all: Vec<Lit> =
                theirs.iter().map(|other| self.older(state, mine, *other)).collect();
            ways.push(self.aig.and_all(all));
        }
        self.aig.or_all(ways)
    }

    /// True if `a` precedes `b` in the order of the policy.
    fn before(&mut self, state: &State, a: TransitionId, b: TransitionId) -> Lit {
        match self.key(a).cmp(&self.key(b)) {
            std::cmp::Ordering::Less => Lit::TRUE,
            std::cmp::Ordering::Greater => Lit::FALSE,
            std::cmp::Ordering::Equal => {
                if a < b {
                    !self.has_older(state, b, a)
                } else {
                    self.has_older(state, a, b)
                }
            }
        }
    }

    fn select_by_age(&mut self, state: &State, chosen: &mut [Lit]) -> Result<(), Unsupported> {
        let rivals = self.rivals.clone();
        let mut is_done: BTreeMap<TransitionId, bool> = BTreeMap::new();
        for start in rivals.keys() {
            if is_done.contains_key(start) {
                continue;
            }
            let mut group = vec![*start];
            is_done.insert(*start, true);
            let mut at = 0;
            while at < group.len() {
                for other in &rivals[&group[at]] {
                    if is_done.insert(*other, true).is_none() {
                        group.push(*other);
                    }
                }
                at += 1;
            }
            let is_clique = group.iter().all(|one| rivals[one].len() + 1 == group.len());
            // If not all compete with all, the one that goes first decides which others still block the next: as many rounds as transitions.
            let rounds = if is_clique { 1 } else { group.len() };
            if rounds > 12 {
                return Err(format!(
                    "{} transitions that compete by age in a chain are not covered",
                    group.len()
                ));
            }
            let mut before: BTreeMap<(TransitionId, TransitionId), Lit> = BTreeMap::new();
            for t in &group {
                for u in &rivals[t] {
                    let lit = self.before(state, *u, *t);
                    before.insert((*u, *t), lit);
                }
            }
            // Transitions that are known not to be taken: at first those that are not fireable.
            let mut out: BTreeMap<TransitionId, Lit> =
                group.iter().map(|t| (*t, !self.free[t.index()])).gather();
            let mut taken: BTreeMap<TransitionId, Lit> = BTreeMap::new();
            for _ in 0..rounds {
                for t in &group {
                    let mut parts = vec![self.free[t.index()]];
                    for u in &rivals[t] {
                        let free = self.aig.or(!before[&(*u, *t)], out[u]);
                        parts.push(free);
                    }
                    let lit = self.aig.and_all(parts);
                    taken.insert(*t, lit);
                }
                for t in &group {
                    let mut ways = vec![!self.free[t.index()]];
                    for u in &rivals[t] {
                        ways.push(self.aig.and(before[&(*u, *t)], taken[u]));
                    }
                    let lit = self.aig.or_all(ways);
                    out.insert(*t, lit);
                }
            }
            for t in &group {
                chosen[t.index()] = taken[t];
            }
        }
        self.check_size()
    }
}
