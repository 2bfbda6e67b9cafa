//! Answers the questions about one part of a cut evolution together, under the assumptions that hold there.

use batsat::lbool;

use super::Induction;
use super::attempt::Attempt;
use super::question::Check;
use crate::symbolic::aig::Lit;
use crate::symbolic::sweep::Query;

/// The conflicts for all questions about one part, as a multiple of the limit for one question.
const EFFORT: u64 = 8;
/// The conflicts for a question in the first try. Questions that stay open are tried case by case, and then value by value.
const QUICK: u64 = 1_000;

impl Attempt<'_> {
    /// What is assumed before a part: the invariants of the state, of the environment and, within an evolution, of the run.
    fn assumptions(&mut self, checks: &[Check], is_within: bool) -> Vec<Vec<Lit>> {
        if !self.of.net.settings.policy.is_statechart() {
            return self.assumptions_of_grafcet(checks, is_within);
        }
        let state = self.state.clone();
        let mut all = self.with_model(|this| this.model.maker.structure(&state));
        if !is_within {
            all.extend(self.with_model(|this| this.model.maker.row_invariants(&state)));
        }
        all.extend(self.model.valid.iter().map(|(_, holds)| *holds));
        all.extend(self.valid.iter().map(|(_, holds)| *holds));
        all.extend(&self.assumed);
        all.extend(self.model.forbidden.iter().map(|(_, forbidden)| !*forbidden));
        let mut clauses: Vec<Vec<Lit>> = all.into_iter().map(|lit| vec![lit]).collect();
        crate::symbolic::at_most_one(&self.model.events, &mut clauses);
        clauses
    }

    fn assumptions_of_grafcet(&mut self, checks: &[Check], is_within: bool) -> Vec<Vec<Lit>> {
        if !is_within {
            let state = self.state.clone();
            let own = self.with_model(|this| this.model.maker.row_invariants(&state));
            self.assumed.extend(own);
        }
        let roots = checks.iter().map(|check| check.broken).chain(self.assumed.iter().copied());
        let roots: Vec<Lit> = roots.collect();
        let support = self.program.aig.support(&roots, usize::MAX).unwrap_or_default();
        let (holds, mut clauses) = self.with_model(|this| this.assumptions_about(&support));
        self.with_model(|this| this.model.complete_order_of_ages(&support, &mut clauses));
        clauses.extend(holds.iter().chain(&self.assumed).map(|lit| vec![*lit]));
        clauses
    }

    /// Shows that no check is broken.
    pub(super) fn settle_all(
        &mut self,
        checks: &[Check],
        is_within: bool,
        total: &mut Induction,
    ) -> Result<(), String> {
        let clauses = self.assumptions(checks, is_within);
        let mut query = Query::new();
        for clause in &clauses {
            query.assert(&self.program.aig, clause);
        }
        let hard = self.unsettled(checks.to_vec(), &mut query, QUICK, total)?;
        let hard = self.unsettled_in_cases(hard, &mut query, total);
        if hard.is_empty() {
            return Ok(());
        }
        let hard = self.unproved_if(hard, (Vec::new(), clauses), total);
        let conflicts = self.of.limits.conflicts;
        let open = self.unsettled(hard, &mut query, conflicts, total)?;
        open.first().map_or(Ok(()), |check| {
            Err(format!("{}, or the solver reached its limit", self.describe(&check.question)))
        })
    }

    /// The checks that are not answered with this many conflicts for each.
    ///
    /// # Errors
    /// A check is broken in a state that nothing excludes.
    fn unsettled(
        &mut self,
        checks: Vec<Check>,
        query: &mut Query,
        conflicts: u64,
        total: &mut Induction,
    ) -> Result<Vec<Check>, String> {
        let mut left = conflicts.saturating_mul(EFFORT);
        let mut hard = Vec::new();
        for check in checks {
            if check.broken == Lit::FALSE {
                total.same += 1;
                continue;
            }
            let answer = query.solve(&self.program.aig, &[check.broken], conflicts.min(left));
            left = left.saturating_sub(query.spent());
            if answer == lbool::FALSE {
                total.add_solved(&check);
            } else if answer == lbool::TRUE {
                let what = self.describe(&check.question);
                let bits: Vec<Lit> =
                    self.model.name_of.keys().copied().filter(|lit| query.is_true(*lit)).collect();
                let place = self.model.describe(&bits);
                return Err(format!("{what} in a state that no invariant excludes: {place}"));
            } else {
                hard.push(check);
            }
        }
        Ok(hard)
    }
}
