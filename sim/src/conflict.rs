//! Which of the fireable transitions fire: steps K3 to K5 of the reaction, semantics §4.

use grafsynth_ir::net::{Enter, Policy, StepId, TransitionId};

use crate::reaction::Reaction;
use crate::tables;

impl Reaction<'_> {
    /// K3 to K5 for Grafcet charts: turns F in `chosen` into F', which includes all fireable reactions.
    pub(crate) fn select(&mut self) {
        if self.work.open_next {
            self.work.chosen.clear();
        }
        if self.work.chosen.is_empty() {
            return;
        }
        if !self.tables.forced.is_empty() {
            self.k3_remove_forced_now();
        }
        let mut candidates = std::mem::take(&mut self.work.candidates);
        candidates.clear();
        candidates.extend(
            self.work.chosen.iter().copied().filter(|transition| !self.is_reaction(*transition)),
        );
        self.work.contested.clear();
        if candidates.len() > 1 {
            self.k4_order(&mut candidates);
            let ordered = candidates.clone();
            match self.net.settings.policy {
                Policy::Priority | Policy::PriorityAge => self.k4_compete(&mut candidates),
                Policy::All | Policy::InnerFirst | Policy::OuterFirst => {}
            }
            if self.net.settings.fire_one {
                candidates.truncate(1);
            }
            if candidates.len() < ordered.len() {
                self.note_contests(&ordered, &candidates);
            }
        }
        let mut chosen = std::mem::take(&mut self.work.chosen);
        chosen.retain(|transition| self.is_reaction(*transition));
        chosen.extend_from_slice(&candidates);
        self.work.chosen = chosen;
        self.work.candidates = candidates;
        if !self.tables.forced.is_empty() {
            self.k5_remove_newly_forced();
        }
    }

    /// Records each fireable transition that was not chosen, with the chosen one that shares a preceding step with it.
    fn note_contests(&mut self, ordered: &[TransitionId], chosen: &[TransitionId]) {
        let net = self.net;
        let requires = |transition: &TransitionId| &net.transitions[*transition].requires;
        // The chosen ones are in the same order.
        let mut n_won = 0;
        for lost in ordered {
            if chosen.get(n_won) == Some(lost) {
                n_won += 1;
                continue;
            }
            for won in &chosen[..n_won] {
                if requires(won).iter().any(|step| requires(lost).contains(step)) {
                    self.work.contested.push((*won, *lost));
                }
            }
        }
    }

    /// Sorts transitions by rank, then by the key of the policy, then by declaration.
    fn k4_order(&self, candidates: &mut [TransitionId]) {
        let static_place =
            |transition: &TransitionId| self.tables.ranks.transition_place[transition.index()];
        if self.net.settings.policy != Policy::PriorityAge {
            candidates.sort_by_key(static_place);
            return;
        }
        let ranks = &self.tables.ranks;
        candidates.sort_by_cached_key(|transition| {
            let rank = ranks.of_part(self.net.transitions[*transition].part);
            (
                rank,
                ranks.following_priority(self.net, *transition),
                self.age_place(*transition),
                *transition,
            )
        });
    }

    /// The position of the oldest following step in the order of last activation; a lower position is older. A sink
    /// transition has the last position.
    fn age_place(&self, transition: TransitionId) -> usize {
        let enters = &self.net.transitions[transition].enters;
        if enters.is_empty() {
            return usize::MAX;
        }
        // If the transition has no order of last activation, all competitors with its rank and P have the same following
        // step.
        let Some(order) = self.tables.layout.age_of[transition.index()] else { return 0 };
        let order = &self.tables.layout.ages[order as usize];
        let follows = |step: StepId| {
            enters.iter().any(|enter| matches!(enter, Enter::Step(one) if *one == step))
        };
        let oldest_first = &self.state.cells[order.base..order.base + order.steps.len()];
        let is_following =
            |step: &i64| usize::try_from(*step).is_ok_and(|step| follows(StepId::from_index(step)));
        oldest_first.iter().position(is_following).unwrap_or(usize::MAX)
    }

    /// Chooses each candidate in turn, unless one that was chosen earlier shares a preceding step with it [C16].
    fn k4_compete(&mut self, candidates: &mut Vec<TransitionId>) {
        let check = self.work.check;
        let net = self.net;
        let consumed_at = &mut self.work.consumed_at;
        candidates.retain(|transition| {
            let requires = &net.transitions[*transition].requires;
            let is_free = requires.iter().all(|step| consumed_at[step.index()] != check);
            if is_free {
                requires.iter().for_each(|step| consumed_at[step.index()] = check);
            }
            is_free
        });
    }

    /// K4 for statecharts: turns F in `chosen` into F' in the order of selection.
    pub(crate) fn select_in_statechart(&mut self) {
        if self.work.open_next {
            self.work.chosen.clear();
        }
        if self.work.chosen.is_empty() {
            return;
        }
        self.work.contested.clear();
        let mut taken: Vec<TransitionId> = Vec::new();
        for state in self.state.situation.iter() {
            if !self.is_atomic(state) {
                continue;
            }
            let Some(offered) = self.offer_of(state) else { continue };
            if taken.contains(&offered) {
                continue;
            }
            let conflicting: Vec<TransitionId> = taken
                .iter()
                .copied()
                .filter(|other| self.exit_sets_meet(offered, *other))
                .collect();
            if conflicting.iter().all(|other| self.goes_before(offered, *other)) {
                taken.retain(|other| !conflicting.contains(other));
                taken.push(offered);
            }
        }
        let mut contested = std::mem::take(&mut self.work.contested);
        for lost in self.work.chosen.iter().filter(|one| !taken.contains(one)) {
            let rivals = taken.iter().filter(|won| self.exit_sets_meet(**won, *lost));
            contested.extend(rivals.map(|won| (*won, *lost)));
        }
        self.work.contested = contested;
        self.work.chosen = taken;
    }

    /// The first fireable transition on the path between an atomic state and the root; the direction depends on the policy.
    fn offer_of(&self, state: StepId) -> Option<TransitionId> {
        let mut way: Vec<StepId> =
            std::iter::once(state).chain(tables::ancestors(self.net, state)).collect();
        if self.net.settings.policy == Policy::OuterFirst {
            way.reverse();
        }
        let is_fireable = |transition: &TransitionId| {
            self.work.fireable_at[transition.index()] == self.work.check
        };
        way.into_iter()
            .find_map(|state| self.tables.leaving[state.index()].iter().copied().find(is_fireable))
    }

    fn exit_sets_meet(&self, a: TransitionId, b: TransitionId) -> bool {
        let exits_b = |step: &StepId| self.net.transitions[b].clears.contains(step);
        self.exit_set(a).any(|step| exits_b(&step))
    }

    /// The active states that a transition leaves.
    pub(crate) fn exit_set(&self, transition: TransitionId) -> impl Iterator<Item = StepId> + '_ {
        let clears = self.net.transitions[transition].clears.iter().copied();
        clears.filter(|step| self.state.situation.contains(*step))
    }

    /// True if the source of `a` is strictly inside (outer-first: outside) the source of `b`.
    fn goes_before(&self, a: TransitionId, b: TransitionId) -> bool {
        let source =
            |transition: TransitionId| self.net.transitions[transition].requires.first().copied();
        let (Some(a), Some(b)) = (source(a), source(b)) else { return false };
        match self.net.settings.policy {
            Policy::OuterFirst => tables::ancestors(self.net, b).any(|above| above == a),
            Policy::All | Policy::Priority | Policy::PriorityAge | Policy::InnerFirst => {
                tables::ancestors(self.net, a).any(|above| above == b)
            }
        }
    }
}
