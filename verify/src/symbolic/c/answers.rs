//! Answers to the questions of an attempt, by construction or by the solver.

use batsat::lbool;
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use grafsynth_ir::facts::is_active;
use grafsynth_ir::instance::Holds;
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;

use super::Induction;
use super::attempt::Attempt;
use super::exec::Danger;
use super::question::{Check, Question, Subject};
use crate::limits::Limits;
use crate::symbolic::CONE;
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::cofactor::Residue;
use crate::symbolic::reach::initial;
use crate::symbolic::stuck::{StateBit, stuck};
use crate::symbolic::sweep::Query;

/// The maximum number of conflicts for all questions about one reaction, and of graph nodes for all questions of a proof.
const ALL_CONFLICTS: u64 = 20_000;
pub(super) const ALL_NODES: usize = 400_000;
/// The maximum number of remaining graph nodes: of one question over all its cases, and of all questions of a proof.
pub(super) const SPLIT_NODES: usize = 400_000;
const ALL_SPLIT_NODES: usize = 1_000_000;
/// The conflicts in one case of a question.
const FEW_CONFLICTS: u64 = 500;
/// The maximum number of steps whose pairs are all examined, and of situations that are searched for these pairs.
const MAX_PAIRED: usize = 200;
const MAX_SITUATIONS: usize = 5_000;
/// The maximum number of situations, as far as a question depends on them, that are listed in an assumption.
const MAX_PROJECTED: usize = 256;

/// The cases of a component: its steps as variables, and for each case the one that is active, or [`Lit::FALSE`] for none.
struct Cases {
    variables: Vec<Lit>,
    active: Vec<Lit>,
}

/// A check split into the cases of a component.
pub(super) struct Split {
    pub(super) component: usize,
    cases: Rc<Cases>,
    /// What is left of the check; `None` if it was not split.
    residue: Option<Residue>,
}

impl Attempt<'_> {
    /// The component with the most steps that a question depends on.
    pub(super) fn component(&mut self, check: &Check) -> Option<usize> {
        if check.broken.as_constant().is_some() {
            return None;
        }
        let support = self.program.aig.support(&[check.broken], CONE * 10)?;
        let mut count: BTreeMap<usize, usize> = BTreeMap::new();
        for lit in support {
            if let Some((Origin::Step(step), _, _)) = self.model.name_of.get(&lit)
                && let Some(component) =
                    self.of.facts.component_of.as_ref().and_then(|of| of[*step])
            {
                *count.entry(component as usize).or_default() += 1;
            }
        }
        let best =
            count.into_iter().max_by_key(|(component, n)| (*n, std::cmp::Reverse(*component)));
        best.map(|(component, _)| component)
    }

    /// The number of nodes of the condition of a check, at most [`CONE`].
    pub(super) fn size(&self, check: &Check) -> usize {
        self.program.aig.size(check.broken, CONE).unwrap_or(CONE)
    }

    /// Shows that the condition of a check is never true; otherwise returns the reason.
    pub(super) fn settle(
        &mut self,
        check: &Check,
        conflicts: u64,
        total: &mut Induction,
    ) -> Option<String> {
        if check.broken == Lit::FALSE {
            total.same += 1;
            return None;
        }
        if self.program.aig.is_never_true(check.broken) {
            total.add_solved(check);
            return None;
        }
        total.work = total.work.saturating_add(self.size(check));
        if self.program.aig.spent() > ALL_CONFLICTS || total.work > ALL_NODES {
            return Some("the solver reached the limit for the total of all questions".to_owned());
        }
        let limits = Limits { conflicts, ..self.of.limits.clone() };
        let broken = check.broken;
        let answer = self.with_model(|this| this.reachable(broken, &[], &limits));
        let what = self.describe(&check.question);
        match answer {
            Some(None) => {
                total.add_solved(check);
                None
            }
            Some(Some(bits)) => {
                let place = self.model.describe(&bits);
                Some(format!("{what} in a state that no invariant excludes: {place}"))
            }
            None => Some(format!("{what}, or the solver reached its limit")),
        }
    }

    /// What is left of the checks in the cases of the component that each depends on most: in each case, the steps of the component are constants. `None` for a
    /// check without a component, or if the work limit is reached.
    pub(super) fn splits(&mut self, checks: &[Check]) -> Vec<Option<Split>> {
        let mut of_component: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (at, check) in checks.iter().enumerate() {
            if let Some(component) = self.component(check) {
                of_component.entry(component).or_default().push(at);
            }
        }
        let mut splits: Vec<Option<Split>> = checks.iter().map(|_| None).collect();
        for (component, numbers) in of_component {
            let Some(cases) = self.cases_of(component).map(Rc::new) else { continue };
            let roots: Vec<Lit> = numbers.iter().map(|at| checks[*at].broken).collect();
            let all = self.program.aig.residues(&roots, &cases.variables, &cases.active);
            let mut all = all.into_iter().flatten();
            for at in numbers {
                splits[at] = Some(Split { component, cases: cases.clone(), residue: all.next() });
            }
        }
        splits
    }

    /// The cases of a component; `None` for an unknown component.
    fn cases_of(&self, component: usize) -> Option<Cases> {
        let data = self.of.facts.components.get(component)?;
        let own = data.steps.iter().map(|it| self.state.active[it.index()]);
        // A step that is never active is constant; all others are variables.
        let variables: Vec<Lit> = own.filter(|lit| *lit != Lit::FALSE).collect();
        let mut active = variables.clone();
        if !data.always {
            active.push(Lit::FALSE);
        }
        Some(Cases { variables, active })
    }

    /// True if what is left of a check is false in each of its cases. False also if the limits are reached, or if there is more left than `most` nodes.
    pub(super) fn settle_by_cases(
        &mut self,
        check: &Check,
        split: &Split,
        most: usize,
        total: &mut Induction,
    ) -> bool {
        let limits = Limits { conflicts: FEW_CONFLICTS, ..self.of.limits.clone() };
        let is_false = |this: &mut Self, broken: Lit, case: &[Lit]| {
            this.program.aig.spent() <= ALL_CONFLICTS
                && this.with_model(|this| this.reachable(broken, case, &limits)) == Some(None)
        };
        if !self.each_case(split, most, total, is_false) {
            return false;
        }
        total.add_solved(check);
        true
    }

    /// True if the rest of a check is false in each of its cases. A case is given by literals: which of its steps is active, and which are not.
    fn each_case(
        &mut self,
        split: &Split,
        most: usize,
        total: &mut Induction,
        mut is_false: impl FnMut(&mut Self, Lit, &[Lit]) -> bool,
    ) -> bool {
        let Split { cases, residue: Some(residue), .. } = split else { return false };
        let is_variable = |lit: &Lit| self.model.name_of.contains_key(lit);
        if !cases.variables.iter().all(is_variable) {
            return false;
        }
        let mut left = 0_usize;
        for (_, broken) in residue {
            left = left.saturating_add(self.program.aig.size(*broken, CONE).unwrap_or(CONE));
            if left > most {
                return false;
            }
        }
        total.split = total.split.saturating_add(left);
        total.split <= ALL_SPLIT_NODES
            && residue.iter().all(|(case, broken)| {
                let active = cases.active[*case];
                let case: Vec<Lit> =
                    cases.variables.iter().map(|lit| lit.negate_if(*lit != active)).collect();
                self.program.aig.is_never_true(*broken) || is_false(self, *broken, &case)
            })
    }

    /// Answers checks case by case, under the assumptions of a query. Returns those that stay open.
    pub(super) fn unsettled_in_cases(
        &mut self,
        checks: Vec<Check>,
        query: &mut Query,
        total: &mut Induction,
    ) -> Vec<Check> {
        let mut hard = Vec::new();
        let splits = self.splits(&checks);
        for (check, split) in checks.into_iter().zip(splits) {
            let is_false = |this: &mut Self, broken: Lit, case: &[Lit]| {
                let all: Vec<Lit> = case.iter().copied().chain([broken]).collect();
                query.solve(&this.program.aig, &all, FEW_CONFLICTS) == lbool::FALSE
            };
            match split.filter(|split| self.each_case(split, SPLIT_NODES, total, is_false)) {
                Some(_) => total.add_solved(&check),
                None => hard.push(check),
            }
        }
        hard
    }

    /// Whether a condition can be true in a case (literals of steps that are true), as far as is known: a point where it is true, or `None`. If there is such a
    /// point, the search goes on with what is true of reachable states but costs more: the situation is a reachable one, and the reaction does not take more
    /// micro-steps than any reachable one.
    fn reachable(
        &mut self,
        broken: Lit,
        case: &[Lit],
        limits: &Limits,
    ) -> Option<Option<Vec<Lit>>> {
        let answer = self.satisfiable(broken, &[], case, limits);
        if !matches!(answer, Some(Some(_))) || self.of.net.settings.policy.is_statechart() {
            return answer;
        }
        let functions = [broken, self.overrun];
        let support = self.model.maker.aig.support(&functions, CONE)?;
        let mut known = vec![!self.overrun, self.reachable_situation(&support)];
        let is_read = |lit: &&Lit| support.contains(&lit.negate_if(lit.is_negated()));
        known.extend(self.stuck().iter().filter(is_read));
        let answer = self.satisfiable(broken, &known, case, limits);
        if !matches!(answer, Some(Some(_))) {
            return answer;
        }
        let next = self.stays_reachable();
        if next.is_empty() {
            return answer;
        }
        known.extend(next);
        self.satisfiable(broken, &known, case, limits)
    }

    /// What is true of every reachable state after a reaction too, unless the reaction fails: a step that is never active is not active then, and steps that
    /// share a timer because they exclude each other are not active together.
    fn stays_reachable(&mut self) -> Vec<Lit> {
        let Subject { net, facts, hint, is_cut, .. } = self.of;
        let (Some(next), false) = (&self.next, is_cut) else { return Vec::new() };
        let active = |step: &StepId| next.active[step.index()];
        let mut never: Vec<Vec<Lit>> =
            facts.unreachable_steps.iter().map(|step| vec![active(step)]).collect();
        for (_, holds) in &hint.state {
            let Holds::TimeOf { steps, .. } = holds else { continue };
            for (at, one) in steps.iter().enumerate() {
                let others = steps[..at].iter().filter(|other| facts.exclude(net, *one, **other));
                never.extend(others.map(|other| vec![active(one), active(other)]));
            }
        }
        let aig = &mut self.model.maker.aig;
        let holds = never.into_iter().map(|together| {
            let together = aig.and_all(together);
            aig.or(self.fault, !together)
        });
        holds.filter(|lit| *lit != Lit::TRUE).collect()
    }

    /// The literals of the state that are true in every reachable state, because their bits never change.
    fn stuck(&mut self) -> &[Lit] {
        if self.stuck.is_none() {
            self.stuck = Some(self.find_stuck().unwrap_or_default());
        }
        self.stuck.as_deref().unwrap_or_default()
    }

    fn find_stuck(&mut self) -> Option<Vec<Lit>> {
        // In a case, the reaction starts in a part of the states only, so a bit that it never changes there may change elsewhere.
        if self.is_case {
            return None;
        }
        let first = initial(&mut self.model).ok()?;
        let next = self.next.clone()?;
        let shape = self.model.maker.shape.clone();
        let next = shape.bits(self.of.net, self.model.aig(), &next);
        let bits = self.model.state_bits.iter().filter_map(|(key, now)| {
            Some(StateBit { now: *now, next: *next.get(key)?, first: *first.get(key)? })
        });
        let bits: Vec<StateBit> = bits.collect();
        Some(stuck(self.model.aig(), &bits))
    }

    /// The condition that the steps among these variables are active as in some reachable situation; true if there are too many possibilities.
    fn reachable_situation(&mut self, support: &[Lit]) -> Lit {
        let sets = self.of.facts.reach.as_ref().and_then(|reach| reach.sets.as_ref());
        let Some(sets) = sets.filter(|sets| sets.len() <= MAX_SITUATIONS) else { return Lit::TRUE };
        let steps = self.model.steps_of(support);
        let known: BTreeSet<Vec<bool>> = sets
            .iter()
            .map(|set| steps.iter().map(|step| is_active(set, *step)).collect())
            .gather();
        if known.len() > MAX_PROJECTED {
            return Lit::TRUE;
        }
        let active: Vec<Lit> =
            steps.iter().map(|step| self.model.state_bits[&(Origin::Step(*step), 0, 0)]).collect();
        let aig = self.model.aig();
        let ways: Vec<Lit> = (known.iter())
            .map(|is| {
                let lits = active.iter().zip(is).map(|(lit, is)| lit.negate_if(!is));
                aig.and_all(lits.collect::<Vec<_>>())
            })
            .collect();
        aig.or_all(ways)
    }

    /// Whether a condition can be true in a case, together with other literals.
    fn satisfiable(
        &mut self,
        broken: Lit,
        known: &[Lit],
        case: &[Lit],
        limits: &Limits,
    ) -> Option<Option<Vec<Lit>>> {
        let all: Vec<Lit> = known.iter().copied().chain([broken]).collect();
        let mut support = self.model.maker.aig.support(&all, CONE)?;
        support.extend(
            case.iter()
                .filter(|lit| !lit.is_negated() && !support.contains(lit))
                .copied()
                .collect::<Vec<_>>(),
        );
        let (mut holds, mut clauses) = self.assumptions_about(&support);
        self.model.complete_order_of_ages(&support, &mut clauses);
        holds.extend(case);
        holds.extend(all);
        let rank = |lit: Lit| {
            let own = self.bit_of.get(&lit).or_else(|| self.model.bit_of.get(&lit));
            own.copied().unwrap_or(0)
        };
        self.model.maker.aig.settle(&holds, &clauses, &rank, limits)
    }

    /// What is assumed about the variables of a question: literals that are true, and clauses. The graph must be in the model.
    pub(super) fn assumptions_about(&mut self, support: &[Lit]) -> (Vec<Lit>, Vec<Vec<Lit>>) {
        let (mut holds, mut clauses) = self.model.invariants(self.of.facts, support);
        // Nothing else says this about the variables of these steps, because the state has constants instead. Times and task indices depend on it.
        let never = self.of.facts.unreachable_steps.iter();
        let never = never.filter(|step| self.state.active[step.index()] == Lit::FALSE);
        let bits = &self.model.state_bits;
        holds
            .extend(never.filter_map(|step| bits.get(&(Origin::Step(*step), 0, 0))).map(|it| !*it));
        for (steps, made) in &mut self.invariants {
            if support.iter().any(|lit| steps.contains(lit)) {
                let aig = &mut self.model.maker.aig;
                holds.push(*made.get_or_insert_with(|| exactly_one(aig, steps.iter().copied())));
            }
        }
        self.never_together(support, &mut clauses);
        for (bits, fits) in &self.valid {
            if bits.iter().any(|bit| support.contains(bit)) {
                holds.push(*fits);
            }
        }
        (holds, clauses)
    }

    /// The assumption that two steps are not active together, for each pair of steps of which no reachable situation contains both.
    pub(super) fn never_together(&self, support: &[Lit], clauses: &mut Vec<Vec<Lit>>) {
        let sets = self.of.facts.reach.as_ref().and_then(|reach| reach.sets.as_ref());
        let Some(sets) = sets else { return };
        let steps: Vec<(StepId, Lit)> = support
            .iter()
            .filter_map(|lit| match self.model.name_of.get(lit) {
                Some((Origin::Step(step), _, _)) => Some((*step, *lit)),
                Some(_) | None => None,
            })
            .collect();
        if steps.len() > MAX_PAIRED || sets.len() > MAX_SITUATIONS {
            return;
        }
        for (at, (a, lit_a)) in steps.iter().enumerate() {
            for (b, lit_b) in &steps[..at] {
                if !sets.iter().any(|set| is_active(set, *a) && is_active(set, *b)) {
                    clauses.push(vec![!*lit_a, !*lit_b]);
                }
            }
        }
    }

    pub(super) fn describe(&self, question: &Question) -> String {
        match question {
            Question::State(at) => {
                let member = &self.of.hint.state[*at].0.member;
                format!("`self->{member}` may differ from the state of the chart after a reaction")
            }
            Question::Output(at) => {
                let output = self.of.hint.outputs[*at].0;
                format!("output `{}` may differ from the chart", self.of.net.outputs[output].name)
            }
            Question::Stopped(at) => {
                let output = &self.of.net.outputs[self.of.hint.outputs[*at].0];
                format!("output `{}` may not have its safe value after `NAME_stop`", output.name)
            }
            Question::Extra(at) => {
                let member = &self.of.hint.extra[*at].0.member;
                format!("`self->{member}` may have a wrong value after a reaction")
            }
            Question::Gate => "the gate may skip a reaction that changes something".to_owned(),
            Question::Fault => "the fault flag may differ from the chart".to_owned(),
            Question::Active(at) => {
                format!("`{}` may differ from the chart", self.of.hint.active[*at].1)
            }
            Question::Var(at) => {
                format!("`{}` may differ from the chart", self.of.hint.vars[*at].1)
            }
            Question::Calls => {
                "number, order or arguments of the calls of extern actions may differ from the chart"
                    .to_owned()
            }
            Question::Callbacks => {
                "the callbacks may not report exactly the changes of a reaction".to_owned()
            }
            Question::CalledTwice(at) => {
                let name = &self.of.hint.conditions[*at].1;
                format!("the extern condition `{name}` may be called twice in a reaction")
            }
            Question::Obligation(Danger::Undefined(what), _, _) => {
                format!("the C may have undefined behaviour (it {what})")
            }
            Question::Obligation(Danger::Leaves, _, _) => {
                "the C may return before the reaction is complete".to_owned()
            }
            Question::Exclusive(at) => {
                let member = &self.of.hint.state[*at].0.member;
                format!(
                    "it is not proved that the steps in `{member}` exclude each other: they may be active together"
                )
            }
            Question::Within(place, at) => {
                let member = &self.of.hint.state[*at].0.member;
                format!("`self->{member}` may differ from the state of the chart {}", place.text())
            }
            Question::Local(place, at) => {
                let local = &self.of.hint.locals[*at].0;
                format!("the local `{local}` may differ from the chart {}", place.text())
            }
            Question::Counter(place, _) => {
                format!("the counter of the loop may not count the checks {}", place.text())
            }
            Question::GoesOn(place) => {
                format!("the loop may end too early or too late {}", place.text())
            }
            Question::Invariant(place, _) => {
                format!("an invariant of the evolution may be false {}", place.text())
            }
            Question::Begins | Question::Progress => "an evolution may never end".to_owned(),
        }
    }
}

/// The condition that exactly one of some functions is true.
pub(super) fn exactly_one(aig: &mut Aig, all: impl IntoIterator<Item = Lit>) -> Lit {
    let (mut one, mut two) = (Lit::FALSE, Lit::FALSE);
    for lit in all {
        let again = aig.and(one, lit);
        two = aig.or(two, again);
        one = aig.or(one, lit);
    }
    aig.and(one, !two)
}
