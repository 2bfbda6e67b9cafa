//! The proved minimum: all primes, the essential ones, a table of the rest, and its smallest cover [Quine 1952, McCluskey 1956].
//!
//! Each row of the table represents a kind of points, not a single point. The recursion finds the sets of primes that cover some point and that no other point
//! makes superfluous; these correspond to the signature cubes of McGeer et al. [1993].

use super::covering::solve;
use super::function::Function;
use super::heuristic::{Loop, literal_weights};
use super::primes::{TooMany, all_primes};
use super::rows::Rows;
use super::terms::{Recursion, Terms, bits};
use super::{Effort, Primes};
use grafsynth_ir::Gather;

/// The result of the exact method.
pub(super) struct Found {
    /// The smallest sum found, if the table was completed.
    pub(super) terms: Option<Terms>,
    /// A lower bound: no sum has fewer products.
    pub(super) lower: usize,
    /// The number of primes, as far as it is known.
    pub(super) primes: Primes,
    /// The number of primes that every minimal sum contains.
    pub(super) n_essential: usize,
}

/// Searches for the smallest sum. `cover` is a sum of primes; the products of `free` cover the free part.
pub(super) fn exact(function: &Function, cover: &Terms, free: &Terms, effort: &Effort) -> Found {
    let mut bdd = function.bdd.clone();
    bdd.limit_work(30 * effort.sets as u64);
    let nothing = |primes| Found { terms: None, lower: 0, primes, n_essential: 0 };
    let primes =
        match all_primes(&mut bdd, &function.upper, &function.input_of, effort.primes, effort.sets)
        {
            Ok(primes) => primes,
            Err(TooMany::Nodes) => return nothing(Primes::Unknown),
            Err(TooMany::Primes(n)) => return nothing(Primes::MoreThan(n)),
        };
    drop(bdd);
    let shape = function.shape();
    let n_primes = Primes::All(primes.len());
    // Every sum of primes contains the essential ones, so only primes of the given sum can be essential.
    let mut all = primes.clone();
    all.extend(free);
    let mut recursion = Recursion::new(&all, effort.steps);
    let mut is_essential = vec![false; cover.len()];
    for (index, term) in cover.iter().enumerate() {
        let near = recursion.meeting(term, |other| all.get(other) == term);
        is_essential[index] = bits(shape.outputs_of(term)).any(|output| {
            let list = recursion.of_output(&near, output);
            let mut region = shape.literals_of(term).to_vec();
            recursion.covers(list, &mut region) == Ok(false)
        });
    }
    let essential = cover.select((0..cover.len()).filter(|index| is_essential[*index]));
    let regions = cover.select((0..cover.len()).filter(|index| !is_essential[*index]));
    let n_essential = essential.len();
    if regions.is_empty() {
        return Found { terms: Some(essential), lower: n_essential, primes: n_primes, n_essential };
    }
    let mut columns = primes;
    let known: std::collections::BTreeSet<&[u64]> = essential.iter().gather();
    columns.retain(|_, term| !known.contains(term));
    let n_columns = columns.len();
    let mut all = columns;
    all.extend(&essential);
    all.extend(free);
    let mut recursion = Recursion::new(&all, recursion.steps);
    let mut rows = Rows::new(n_columns, effort.rows);
    let mut is_whole = true;
    for region in regions.iter() {
        let near = recursion.meeting(region, |_| false);
        for output in bits(shape.outputs_of(region)) {
            let list = recursion.of_output(&near, output);
            is_whole &= recursion.rows(list, region, n_columns, &mut rows).is_ok();
        }
    }
    is_whole &= !rows.is_full() && !rows.has_gap;
    // A part of the rows still gives a bound.
    let weights = literal_weights(&all.select(0..n_columns));
    let solution = solve(&rows.sets(), &weights, effort.branching);
    let terms = is_whole.then(|| {
        let mut terms = essential;
        terms.extend(&all.select(solution.columns.iter().map(|c| *c as usize)));
        terms
    });
    Found { terms, lower: n_essential + solution.lower, primes: n_primes, n_essential }
}

/// Runs the loop from each start; returns the best sum of all primes found.
pub(super) fn best_of_starts(search: &mut Loop<'_>, starts: &[Terms]) -> Terms {
    let mut best: Option<Terms> = None;
    for start in starts {
        let found = search.run(start);
        let is_better = best
            .as_ref()
            .is_none_or(|best| (found.len(), found.n_literals()) < (best.len(), best.n_literals()));
        if is_better {
            best = Some(found);
        }
    }
    let best = best.unwrap_or_else(|| Terms::new(search.shape()));
    let mut best = search.best_of_pool(best);
    best.extend(&search.essential());
    best
}
