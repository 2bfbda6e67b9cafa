//! The proof in one piece or, if the solver needs it, by cases: one for each step of a component.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::instance::Carried;
use grafsynth_ir::net::Net;

use super::Induction;
use super::answers::{ALL_NODES, SPLIT_NODES};
use super::attempt::Attempt;
use super::question::{Check, Focus, Question, Subject};
use crate::limits::Limits;

/// The limits of one question: the conflicts of the solver if the question can still be split into cases, the conflicts otherwise, the nodes of a decision
/// diagram, and the nodes of the graph of a reaction. Most questions need no solver; one that needs much work will probably not end.
const FEW_CONFLICTS: u64 = 500;
const CONFLICTS: u64 = 4_000;
const DIAGRAM: usize = 1 << 18;
const NODES: usize = 400_000;
/// From this number of nodes on, questions that can be split into cases are split.
const FEW_NODES: usize = 100_000;
/// The maximum number of cases times the size of the net.
const MAX_CASES: usize = 8_000_000;

impl Subject<'_> {
    /// Proves reset and reaction, in one piece if possible, otherwise by cases.
    pub(super) fn prove(self) -> Result<Induction, String> {
        refuse(self.net)?;
        for (id, output) in self.net.outputs.iter() {
            let is_known = match output.is_extern() {
                true => self.hint.actions.iter().any(|(known, _)| *known == id),
                false => self.hint.outputs.iter().any(|(known, _)| *known == id),
            };
            if !is_known {
                return Err(format!("it is not known where the C stores output `{}`", output.name));
            }
        }
        let limits = Limits {
            conflicts: self.limits.conflicts.min(CONFLICTS),
            bdd_nodes: self.limits.bdd_nodes.min(DIAGRAM),
            circuit_nodes: self.limits.circuit_nodes.min(NODES),
            ..self.limits.clone()
        };
        let this = Subject { limits: &limits, ..self };
        if self.net.settings.policy.is_statechart() {
            return this.prove_evolution();
        }
        // If the evolution cannot be cut, it is unrolled, which also uses what is known about whole reactions.
        match self.hint.locals.iter().any(|(_, what)| *what == Carried::Again) {
            true => this.prove_evolution().or_else(|why| this.prove_within().map_err(|_| why)),
            false => this.prove_within(),
        }
    }

    pub(super) fn prove_within(self) -> Result<Induction, String> {
        let mut total = Induction::default();
        let mut reset = Attempt::new(self, None)?;
        let checks = reset.reset()?;
        for check in checks {
            if let Some(why) = reset.settle(&check, self.limits.conflicts, &mut total) {
                return Err(format!("after `{}_init`, {why}", self.hint.prefix));
            }
        }
        let this = Subject { unset: reset.unset.as_deref().unwrap_or_default(), ..self };
        let mut total = this.prove_reaction(total)?;
        this.prove_gate(&mut total)?;
        Ok(total)
    }

    /// Proves the reaction.
    fn prove_reaction(self, mut total: Induction) -> Result<Induction, String> {
        let open = self.attempt(None, None, &mut total)?;
        let n_cases: usize = open
            .keys()
            .filter_map(|component| self.facts.components.get(*component))
            .map(|component| component.steps.len() + 1)
            .sum();
        let size = self.net.steps.len() + self.net.transitions.len();
        if n_cases.saturating_mul(size) > MAX_CASES {
            return Err(format!(
                "the proof needs {n_cases} cases, too many for a chart of this size"
            ));
        }
        for (component, questions) in &open {
            let data = self
                .facts
                .components
                .get(*component)
                .ok_or("a component of the chart is not known")?;
            let steps = data.steps.iter().map(|step| Some(*step));
            for active in steps.chain((!data.always).then_some(None)) {
                let focus = Focus { component: *component, active };
                self.attempt(Some(focus), Some(questions), &mut total)?;
            }
        }
        Ok(total)
    }

    /// Answers the questions, all of them or those in `only`. Returns those that are open, by the component whose cases could answer them; in a case,
    /// an open question is an error.
    pub(super) fn attempt(
        self,
        focus: Option<Focus>,
        only: Option<&BTreeSet<Question>>,
        total: &mut Induction,
    ) -> Result<BTreeMap<usize, BTreeSet<Question>>, String> {
        let mut attempt = Attempt::new(self, focus)?;
        let is_of_query = |question: &Question| {
            matches!(
                question,
                Question::Active(_)
                    | Question::Var(_)
                    | Question::Stopped(_)
                    | Question::Extra(_)
                    | Question::Obligation(..)
            )
        };
        let checks = attempt.reaction(only.is_none_or(|only| only.iter().any(is_of_query)))?;
        let mut open: BTreeMap<usize, BTreeSet<Question>> = BTreeMap::new();
        let mut checks: Vec<Check> = checks
            .into_iter()
            .filter(|check| only.is_none_or(|only| only.contains(&check.question)))
            .collect();
        let mut left = ALL_NODES;
        let is_large = !checks.iter().all(|check| {
            let fits = left.checked_sub(attempt.size(check));
            left = fits.unwrap_or(0);
            fits.is_some()
        });
        if focus.is_none() && is_large {
            // One by one, the questions would exceed their limit.
            checks = attempt.unproved(checks, total);
        }
        let mut left = self.settle_each(&mut attempt, focus, checks, total);
        if focus.is_none() && !is_large && !left.is_empty() {
            let open = left.open.into_iter().map(|(check, _)| check);
            let checks = attempt.unproved(open.chain(left.rest).collect(), total);
            left = self.settle_each(&mut attempt, focus, checks, total);
        }
        match left.why {
            Some(why) => return Err(why),
            None => left.open.into_iter().for_each(|(check, component)| {
                open.entry(component).or_default().insert(check.question);
            }),
        }
        Ok(open)
    }

    /// Settles checks one by one, up to one that fails for good.
    fn settle_each(
        self,
        attempt: &mut Attempt<'_>,
        focus: Option<Focus>,
        checks: Vec<Check>,
        total: &mut Induction,
    ) -> Left {
        let mut splits = match focus {
            None => attempt.splits(&checks),
            Some(_) => Vec::new(),
        };
        splits.resize_with(checks.len(), || None);
        let mut left = Left::default();
        for (check, split) in checks.into_iter().zip(splits) {
            if left.why.is_some() {
                left.rest.push(check);
                continue;
            }
            let Some(split) = split else {
                left.why = attempt.settle(&check, self.limits.conflicts, total);
                left.rest.extend(left.why.is_some().then_some(check));
                continue;
            };
            // If the cases leave little, that is faster than a search over all of them.
            let small = attempt.size(&check);
            let conflicts = self.limits.conflicts.min(FEW_CONFLICTS);
            let is_settled = attempt.settle_by_cases(&check, &split, small, total)
                || total.work <= FEW_NODES && attempt.settle(&check, conflicts, total).is_none()
                || attempt.settle_by_cases(&check, &split, SPLIT_NODES, total);
            if !is_settled {
                left.open.push((check, split.component));
            }
        }
        left
    }
}

/// The checks that are not settled.
#[derive(Default)]
struct Left {
    /// Those that the cases of a component could settle, with the component.
    open: Vec<(Check, usize)>,
    /// One that failed for good, and those after it.
    rest: Vec<Check>,
    /// Why it failed.
    why: Option<String>,
}

impl Left {
    fn is_empty(&self) -> bool {
        self.open.is_empty() && self.rest.is_empty()
    }
}

/// An error for a net with a feature that no proof of C covers yet.
fn refuse(net: &Net) -> Result<(), String> {
    if !net.c_texts().is_empty() {
        return Err("C code of the chart's author is not covered by the induction".to_owned());
    }
    if !net.unspecified.is_empty() {
        return Err("cells that the chart leaves open are not covered by the induction".to_owned());
    }
    Ok(())
}
