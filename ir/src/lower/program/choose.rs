//! Conflict policies outside statecharts (§4): which of the fireable transitions fire.
//!
//! Transitions compete if they share a preceding step (with `fire one`: all do). If their order is static, each one that is taken blocks the later ones
//! that share a step with it:
//!
//! ```text
//! fire t1 := fireable t1
//! fire t2 := fireable t2 and not fire t1
//! ```
//!
//! Ages are read at the start of the micro-step. If the transitions of one priority all compete with one another, a transition fires if no fireable one is
//! older; otherwise (t1 competes with t2, t2 with t3, but t1 not with t3), the order is processed in rounds.

use std::collections::BTreeMap;

use super::{Builder, cell, temp};
use crate::arena::IdMap;
use crate::expr::{ExprKind, Type};
use crate::net::{Policy, StepId, Transition, TransitionId, TransitionKind};
use crate::plan::{LAST, following, urgency};
use crate::program::{Expr, Origin, Stmt, TempId, TempRole};
use crate::simplify::{compare_shapes, simplify};

/// What transitions compete for: a step, or with `fire one` the micro-step itself.
type Prize = Option<StepId>;

/// The transitions that have taken a prize so far. Many takers are combined in one temporary, so that the tests are short.
#[derive(Debug, Default)]
struct Takers {
    recent: Vec<TransitionId>,
    gathered: Option<TempId>,
}

/// The longest list of takers that is tested individually.
const FEW: usize = 8;

impl Builder<'_> {
    /// The prizes that a transition competes for; empty for a reaction, and under `all`.
    pub(super) fn prizes(&self, id: TransitionId) -> Vec<Prize> {
        let transition = &self.net.transitions[id];
        if transition.kind == TransitionKind::Reaction {
            Vec::new()
        } else if self.net.settings.fire_one {
            vec![None]
        } else if self.net.settings.policy == Policy::All {
            Vec::new()
        } else {
            transition.requires.iter().map(|step| Some(*step)).collect()
        }
    }

    /// For each transition, its prizes that other transitions also compete for.
    pub(super) fn contested(&self) -> IdMap<Transition, Vec<Prize>> {
        let mut wanted: BTreeMap<Prize, u32> = BTreeMap::new();
        let mut contested = IdMap::build(&self.net.transitions, |id, _| self.prizes(id));
        for prize in contested.values().flatten() {
            *wanted.entry(*prize).or_default() += 1;
        }
        for id in self.net.transitions.ids() {
            contested[id].retain(|prize| wanted.get(prize).is_some_and(|n| *n > 1));
        }
        contested
    }

    /// Decides which competing transitions fire; `fire` contains the candidates before and the result afterwards.
    pub(super) fn choose(
        &mut self,
        contested: &IdMap<Transition, Vec<Prize>>,
        fire: &mut IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) {
        let mut order: Vec<TransitionId> = self.ranks.transitions.clone();
        order.retain(|id| !contested[*id].is_empty());
        let mut takers: BTreeMap<Prize, Takers> = BTreeMap::new();
        if self.net.settings.policy != Policy::PriorityAge {
            for id in order {
                self.take(id, contested, &mut takers, fire, out);
            }
            return;
        }
        let net = self.net;
        let classes = IdMap::build(&net.transitions, |id, _| {
            let is_sink = following(&net.transitions[id]).next().is_none();
            let urgency = if is_sink { LAST } else { urgency(net, id) };
            (self.ranks.of_transition(net, id), urgency, is_sink)
        });
        order.sort_unstable_by_key(|id| (classes[*id], *id));
        for group in order.chunk_by(|a, b| classes[*a] == classes[*b]) {
            if group.first().is_some_and(|id| classes[*id].2) {
                for id in group {
                    self.take(*id, contested, &mut takers, fire, out);
                }
                continue;
            }
            for party in parties(group, contested) {
                self.take_by_age(&party, contested, &mut takers, fire, out);
            }
            for id in group {
                for prize in &contested[*id] {
                    takers.entry(*prize).or_default().recent.push(*id);
                }
            }
        }
    }

    /// Adds the next transition of a static order: it fires unless an earlier one took one of its prizes.
    fn take(
        &mut self,
        id: TransitionId,
        contested: &IdMap<Transition, Vec<Prize>>,
        takers: &mut BTreeMap<Prize, Takers>,
        fire: &mut IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) {
        let free = self.free_of_takers(id, contested, takers, fire, out);
        let name = self.net.transitions[id].name.text.clone();
        fire[id] = self.named(name, TempRole::Fire(id), free, out);
        for prize in &contested[id] {
            takers.entry(*prize).or_default().recent.push(id);
        }
    }

    /// True if the transition is a candidate and none of its prizes is taken.
    fn free_of_takers(
        &mut self,
        id: TransitionId,
        contested: &IdMap<Transition, Vec<Prize>>,
        takers: &mut BTreeMap<Prize, Takers>,
        fire: &IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) -> Expr {
        let mut rivals: Vec<TransitionId> = Vec::new();
        let mut all = vec![fire[id].clone()];
        for prize in &contested[id] {
            let taken = takers.entry(*prize).or_default();
            if taken.recent.len() > FEW {
                let gathered = match taken.gathered {
                    Some(gathered) => gathered,
                    None => {
                        let name = match prize {
                            Some(step) => format!("{}.taken", self.net.steps[*step].name),
                            None => "taken".to_owned(),
                        };
                        self.new_temp(name, Type::Bool, TempRole::Helper)
                    }
                };
                let before = taken.gathered.map(temp);
                let now =
                    before.into_iter().chain(taken.recent.iter().map(|rival| fire[*rival].clone()));
                out.push(Stmt::Set(gathered, Expr::or(now)));
                taken.gathered = Some(gathered);
                taken.recent.clear();
            }
            all.extend(taken.gathered.map(|gathered| temp(gathered).not()));
            rivals.extend(&taken.recent);
        }
        rivals.sort_unstable();
        rivals.dedup();
        for rival in rivals {
            if !self.exclude_each_other(rival, id) {
                all.push(fire[rival].clone().not());
            }
        }
        Expr::and(all)
    }

    /// Decides a connected group of competing transitions of equal rank and priority by age: the oldest goes first.
    fn take_by_age(
        &mut self,
        party: &[TransitionId],
        contested: &IdMap<Transition, Vec<Prize>>,
        takers: &mut BTreeMap<Prize, Takers>,
        fire: &mut IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) {
        let names: Vec<String> =
            party.iter().map(|id| self.net.transitions[*id].name.text.clone()).collect();
        let mut open: Vec<Expr> = Vec::new();
        for (id, name) in party.iter().zip(&names) {
            let free = self.free_of_takers(*id, contested, takers, fire, out);
            let role = if party.len() == 1 { TempRole::Fire(*id) } else { TempRole::Fireable(*id) };
            let name = if party.len() == 1 { name.clone() } else { format!("{name}.fireable") };
            open.push(self.named(name, role, free, out));
        }
        if let ([only], [free]) = (party, open.as_slice()) {
            fire[*only] = free.clone();
            return;
        }
        let meet = |a: TransitionId, b: TransitionId| {
            contested[a].iter().any(|p| contested[b].contains(p))
        };
        // For each transition, those that can come before it, and under which condition.
        let mut earlier: Vec<Vec<(usize, Expr)>> = Vec::new();
        let mut is_clique = true;
        for (at, id) in party.iter().enumerate() {
            let mut list = Vec::new();
            for (other, rival) in party.iter().enumerate() {
                if other == at {
                    continue;
                }
                if !meet(*id, *rival) {
                    is_clique = false;
                } else if !self.exclude_each_other(*id, *rival) {
                    let before = self.goes_before(*rival, *id);
                    if !before.is_false() {
                        list.push((other, before));
                    }
                }
            }
            earlier.push(list);
        }
        let first = |open: &[Expr], at: usize| {
            let barred = earlier[at]
                .iter()
                .map(|(other, before)| Expr::and([open[*other].clone(), before.clone()]).not());
            Expr::and(std::iter::once(open[at].clone()).chain(barred))
        };
        if is_clique {
            for (at, id) in party.iter().enumerate() {
                fire[*id] =
                    self.named(names[at].clone(), TempRole::Fire(*id), first(&open, at), out);
            }
            return;
        }
        let mut fires = Vec::new();
        let mut opens = Vec::new();
        let mut firsts = Vec::new();
        for ((id, name), open) in party.iter().zip(&names).zip(open) {
            let fired = self.new_temp(name.clone(), Type::Bool, TempRole::Fire(*id));
            let waits = self.new_temp(format!("{name}.waits"), Type::Bool, TempRole::Helper);
            firsts.push(self.new_temp(format!("{name}.first"), Type::Bool, TempRole::Helper));
            out.push(Stmt::Set(fired, Expr::bool(false)));
            out.push(Stmt::Set(waits, open));
            fires.push(fired);
            opens.push(waits);
            fire[*id] = temp(fired);
        }
        let mut round = Vec::new();
        let open: Vec<Expr> = opens.iter().map(|id| temp(*id)).collect();
        for (at, id) in firsts.iter().enumerate() {
            round.push(Stmt::Set(*id, first(&open, at)));
        }
        for at in 0..party.len() {
            round.push(Stmt::Set(fires[at], Expr::or([temp(fires[at]), temp(firsts[at])])));
            let rivals =
                (0..party.len()).filter(|other| *other == at || meet(party[at], party[*other]));
            let barred = rivals.map(|other| temp(firsts[other]).not());
            round.push(Stmt::Set(
                opens[at],
                Expr::and(std::iter::once(open[at].clone()).chain(barred)),
            ));
        }
        let limit = u32::try_from(party.len()).unwrap_or(u32::MAX);
        out.push(Stmt::Repeat { limit, condition: Expr::or(open), body: round });
    }

    /// True if the first goes before the second: its oldest following step is older, or equally old and the first is declared earlier.
    fn goes_before(&mut self, first: TransitionId, second: TransitionId) -> Expr {
        let mine: Vec<StepId> = following(&self.net.transitions[first]).collect();
        let theirs: Vec<StepId> = following(&self.net.transitions[second]).collect();
        let share = mine.iter().any(|step| theirs.contains(step));
        if share && first < second {
            self.has_older(&theirs, &mine).not()
        } else {
            self.has_older(&mine, &theirs)
        }
    }

    /// True if the oldest of `mine` is strictly older than all of `theirs`.
    fn has_older(&mut self, mine: &[StepId], theirs: &[StepId]) -> Expr {
        let mut ways = Vec::new();
        for step in mine.iter().filter(|step| !theirs.contains(step)) {
            let than_all: Vec<Expr> =
                theirs.iter().map(|other| self.is_older(*step, *other)).collect();
            ways.push(Expr::and(than_all));
        }
        Expr::or(ways)
    }

    fn is_older(&mut self, a: StepId, b: StepId) -> Expr {
        let (low, high) = (a.min(b), a.max(b));
        let id = match self.older.get(&(low, high)) {
            Some(id) => *id,
            None => {
                let name =
                    format!("{}.older.{}", self.net.steps[low].name, self.net.steps[high].name);
                let id = self.new_cell(name, Type::Bool, Origin::Older(low, high));
                self.older.insert((low, high), id);
                id
            }
        };
        if a == low { cell(id) } else { cell(id).not() }
    }

    /// True if the receptivities show that both are never fireable at once: one contains the negation of a condition of the other.
    fn exclude_each_other(&self, a: TransitionId, b: TransitionId) -> bool {
        let (mine, theirs) = (self.conditions(a), self.conditions(b));
        mine.len() * theirs.len() <= 64
            && mine.iter().any(|x| {
                let denied = simplify(&x.clone().not());
                theirs.iter().any(|y| compare_shapes(&denied, y).is_eq())
            })
    }

    /// The conditions of the transition as a list, including its own fireability, which an `otherwise` of the other one negates.
    fn conditions(&self, id: TransitionId) -> Vec<Expr> {
        let mut all: Vec<Expr> = self.now.fireable[id].iter().cloned().collect();
        let transition = &self.net.transitions[id];
        let guard = self.read_with(&transition.guard, &transition.requires);
        let operands =
            if let ExprKind::And(operands) = guard.kind { operands } else { vec![guard] };
        for operand in operands {
            if let ExprKind::Not(inner) = &operand.kind
                && let ExprKind::Or(parts) = &inner.kind
            {
                all.extend(parts.iter().cloned().map(Expr::not));
            } else {
                all.push(operand);
            }
        }
        all
    }
}

/// Splits transitions of equal rank and priority into groups of connected competitors, each in declaration order.
fn parties(
    group: &[TransitionId],
    contested: &IdMap<Transition, Vec<Prize>>,
) -> Vec<Vec<TransitionId>> {
    let mut party_of: Vec<usize> = (0..group.len()).collect();
    let find = |party_of: &mut Vec<usize>, mut at: usize| {
        while party_of[at] != at {
            party_of[at] = party_of[party_of[at]];
            at = party_of[at];
        }
        at
    };
    let mut first_with: BTreeMap<Prize, usize> = BTreeMap::new();
    for (at, id) in group.iter().enumerate() {
        for prize in &contested[*id] {
            let other = *first_with.entry(*prize).or_insert(at);
            let (a, b) = (find(&mut party_of, at), find(&mut party_of, other));
            party_of[a.max(b)] = a.min(b);
        }
    }
    let mut parties: BTreeMap<usize, Vec<TransitionId>> = BTreeMap::new();
    for (at, id) in group.iter().enumerate() {
        let root = find(&mut party_of, at);
        parties.entry(root).or_default().push(*id);
    }
    parties.into_values().collect()
}
