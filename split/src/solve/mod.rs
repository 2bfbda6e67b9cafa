//! The partition problem: assigns each node to a part, at minimum cost.
//!
//! [`solve`] reduces the problem, looks for a good placement by local search, and then closes the gap to the bound. [`evaluate`] returns the cost and
//! resource use of a placement, [`alternatives`] the effect of each single move. All limits count work, never time, so the same problem has the same answer everywhere.

mod conflict;
mod dual;
mod flow;
mod local;
mod model;
mod problem;
mod program;
mod report;
mod state;
#[cfg(test)]
mod tests;

pub use conflict::{Amount, Conflict, Fight};
pub use problem::{
    Choice, Forbidden, Node, NodeIndex, Part, PartIndex, Presence, Problem, ProblemError, Wire,
};
pub use report::{Alternative, Constraint, Evaluation, Usage, alternatives, evaluate};

use model::{Model, Origin};
use program::Answer;
use report::evaluate_checked;

/// Limits on the work of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Passes of the local search from each start.
    pub passes: u32,
    /// Minimum cuts for the bound of a problem with two parts.
    pub cuts: u32,
    /// Work of one search tree: its nodes times the coefficients of the 0/1 program.
    pub tree: u64,
    /// The largest 0/1 program that is tried, in coefficients: the time of one relaxation grows with the square.
    pub program: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { passes: 12, cuts: 100, tree: 4_000_000, program: 40_000 }
    }
}

/// The result of a search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// An optimal placement.
    Optimal {
        /// The part of each node.
        assignment: Vec<PartIndex>,
        /// The objective.
        value: i64,
    },
    /// The work ran out: the best placement found.
    Best {
        /// The part of each node.
        assignment: Vec<PartIndex>,
        /// The objective.
        value: i64,
        /// No placement has a smaller objective than this.
        bound: i64,
    },
    /// No placement fits.
    Infeasible {
        /// Constraints that exclude each other.
        conflict: Conflict,
    },
    /// The work ran out: no placement was found, and it is open whether there is one.
    Unknown {
        /// No placement has a smaller objective than this.
        bound: i64,
    },
}

/// Finds the placement with the smallest objective.
///
/// `warm` is a placement from which the search starts; it may be infeasible, for example that of a similar problem.
///
/// # Errors
/// [`ProblemError`] if the problem or the warm start is malformed.
pub fn solve(
    problem: &Problem,
    limits: &Limits,
    warm: Option<&[PartIndex]>,
) -> Result<Outcome, ProblemError> {
    problem.check()?;
    if let Some(warm) = warm {
        problem.check_assignment(warm)?;
    }
    Ok(match search(problem, limits, warm) {
        Found::Optimal { assignment, value } => Outcome::Optimal { assignment, value },
        Found::Stopped { best: Some((value, assignment)), bound } => {
            Outcome::Best { assignment, value, bound }
        }
        Found::Stopped { best: None, bound } => Outcome::Unknown { bound },
        Found::Infeasible => Outcome::Infeasible { conflict: conflict::find(problem, limits) },
    })
}

/// Finds a good placement by local search only, without a bound; `None` if no feasible one was found.
///
/// # Errors
/// [`ProblemError`] if the problem or the warm start is malformed.
pub fn improve(
    problem: &Problem,
    limits: &Limits,
    warm: Option<&[PartIndex]>,
) -> Result<Option<Vec<PartIndex>>, ProblemError> {
    problem.check()?;
    if let Some(warm) = warm {
        problem.check_assignment(warm)?;
    }
    let Some(model) = model::reduce(problem) else { return Ok(None) };
    let warm = warm.map(|warm| model.restrict(warm));
    let state = local::search(&model, warm.as_deref(), limits.passes);
    Ok((state.excess == 0).then(|| model.expand(&state.part)))
}

/// The result of a search, without the reason why nothing fits.
enum Found {
    Optimal { assignment: Vec<PartIndex>, value: i64 },
    Stopped { best: Option<(i64, Vec<PartIndex>)>, bound: i64 },
    Infeasible,
}

fn search(problem: &Problem, limits: &Limits, warm: Option<&[PartIndex]>) -> Found {
    let Some(model) = model::reduce(problem) else { return Found::Infeasible };
    let warm = warm.map(|warm| model.restrict(warm));
    let mut best = Candidates { problem, best: None };
    let state = local::search(&model, warm.as_deref(), limits.passes);
    if state.excess == 0 {
        best.offer(&model, &state.part);
    }
    let mut bound = lowest(&model);
    let mut core = None;
    if !best.reaches(bound)
        && let Some(dual) = dual::bound(&model, Some(&state), limits.cuts, limits.passes)
    {
        bound = bound.max(dual.bound);
        if let Some((_, placement)) = &dual.best {
            best.offer(&model, placement);
        }
        core = core_of(problem, &model, &dual.decided);
    }
    if !best.reaches(bound) {
        let core = core.as_ref().unwrap_or(problem);
        match search_tree(core, limits, &mut best) {
            // Outside the core nothing is better than what was found before.
            Some(lower) => bound = bound.max(best.value().map_or(lower, |value| value.min(lower))),
            None if best.best.is_none() => return Found::Infeasible,
            None => bound = best.value().unwrap_or(bound),
        }
    }
    let is_proved = best.reaches(bound);
    match best.best {
        Some((value, assignment)) if is_proved => Found::Optimal { assignment, value },
        best => Found::Stopped { best, bound },
    }
}

/// The problem in which the nodes are on their decided parts; `None` if nothing was decided.
fn core_of(problem: &Problem, model: &Model, decided: &[Option<PartIndex>]) -> Option<Problem> {
    decided.iter().flatten().next()?;
    let mut core = problem.clone();
    for (node, origin) in core.nodes.iter_mut().zip(&model.origin) {
        if let Origin::Free(free) = *origin
            && let Some(decided) = decided[free]
        {
            node.choices
                .iter_mut()
                .enumerate()
                .filter(|&(part, _)| part != decided)
                .for_each(|(_, choice)| *choice = None);
        }
    }
    Some(core)
}

/// Searches the tree of a problem. Returns a lower bound, or `None` if nothing in it fits.
fn search_tree(problem: &Problem, limits: &Limits, best: &mut Candidates) -> Option<i64> {
    let model = model::reduce(problem)?;
    let mut bound = lowest(&model);
    let size = program::size(&model);
    if size > limits.program {
        return Some(bound);
    }
    let nodes = limits.tree / size.max(1) as u64;
    let warm = best.best.as_ref().and_then(|(_, assignment)| {
        model.restrict(assignment).into_iter().collect::<Option<Vec<_>>>()
    });
    match program::solve(&model, nodes, warm.as_deref()) {
        Answer::Optimal(placement) => {
            if let Some(value) = best.offer(&model, &placement) {
                bound = bound.max(value);
            }
        }
        Answer::Stopped(placement, lower) => {
            if let Some(placement) = placement {
                best.offer(&model, &placement);
            }
            bound = bound.max(lower.map_or(bound, |lower| model.base + round_up(lower)));
        }
        Answer::Infeasible => return None,
    }
    Some(bound)
}

/// The minimum cost of the nodes.
fn lowest(model: &Model) -> i64 {
    let least = |node: &model::FreeNode| {
        model::parts_of(node.allowed).map(|part| node.cost[part]).min().unwrap_or(0)
    };
    model.base + model.nodes.iter().map(least).sum::<i64>()
}

/// The smallest integer that a bound with rounding errors allows.
fn round_up(bound: f64) -> i64 {
    (bound - 1e-6 * bound.abs().max(1.0)).ceil() as i64
}

/// The best placement so far. Each one is evaluated from the definition before it counts.
struct Candidates<'a> {
    problem: &'a Problem,
    best: Option<(i64, Vec<PartIndex>)>,
}

impl Candidates<'_> {
    /// Keeps a placement of the free nodes if it is better. Returns its value if it is feasible.
    fn offer(&mut self, model: &Model, free: &[PartIndex]) -> Option<i64> {
        let assignment = model.expand(free);
        let evaluation = evaluate_checked(self.problem, &assignment);
        if !evaluation.broken.is_empty() {
            return None;
        }
        let value = evaluation.value;
        if self.best.as_ref().is_none_or(|(best, _)| value < *best) {
            self.best = Some((value, assignment));
        }
        Some(value)
    }

    fn value(&self) -> Option<i64> {
        self.best.as_ref().map(|(value, _)| *value)
    }

    fn reaches(&self, bound: i64) -> bool {
        self.best.as_ref().is_some_and(|(best, _)| *best <= bound)
    }
}
