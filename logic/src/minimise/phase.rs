//! Output phases of a PLA: chooses which outputs are inverted, so that all of them together need the fewest shared products.
//!
//! ```text
//! f1 … fm ─ with their complements: 2m outputs, minimised together [Sasao 1984] ─► one side of each, by the products it needs ─┐
//! all as they are, each at its smaller side by itself ──────────────────────────────────────────────────────────────────────┴► flips of one and two
//! ```
//! A choice is judged by the heuristic sum that it gives. The number of judged choices is fixed, so the search ends and is reproducible.

use super::terms::{Shape, Terms, bits};
use super::{Effort, Function, Outcome, Refused, shared};
use std::collections::BTreeMap;

/// Output phases and their sum.
#[derive(Debug, Clone)]
pub struct Phased {
    /// The outputs that are inverted.
    pub is_complemented: Vec<bool>,
    /// The sum of the outputs with these phases.
    pub outcome: Outcome,
    /// The number of choices judged.
    pub tries: usize,
    /// True if all possible choices were judged.
    pub is_complete: bool,
}

/// The number of products and the number of literals; `None` if the choice was not judged.
type Cost = Option<(usize, usize)>;

struct Search<'a> {
    function: &'a Function,
    effort: Effort,
    /// The cost of each choice judged so far; `None` if its sum is too long.
    known: BTreeMap<Vec<bool>, Cost>,
    tries: usize,
}

impl Search<'_> {
    /// The number of products and literals of a choice; `None` if the choice cannot be judged, or no more tries are left.
    fn cost(&mut self, phases: &[bool]) -> Cost {
        if let Some(&cost) = self.known.get(phases) {
            return cost;
        }
        if self.known.len() >= self.tries {
            return None;
        }
        let outcome =
            self.function.complemented(phases).and_then(|turned| shared(&turned, &self.effort));
        let cost = outcome.ok().map(|outcome| (outcome.terms.len(), outcome.terms.n_literals()));
        self.known.insert(phases.to_vec(), cost);
        cost
    }

    /// Inverts single outputs, then pairs, as long as this improves the cost.
    fn descend(&mut self, start: Vec<bool>) -> (Cost, Vec<bool>) {
        let n = start.len();
        let mut best = start;
        let mut cost = self.cost(&best);
        'again: loop {
            let singles = (0..n).map(|a| (a, a));
            let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b)));
            for (a, b) in singles.chain(pairs) {
                if self.known.len() >= self.tries {
                    break;
                }
                let mut flipped = best.clone();
                flipped[a] ^= true;
                flipped[b] ^= a != b;
                if let Some(other) = self.cost(&flipped)
                    && cost.is_none_or(|cost| other < cost)
                {
                    (best, cost) = (flipped, Some(other));
                    continue 'again;
                }
            }
            return (cost, best);
        }
    }
}

/// Searches for the phases with the fewest shared products; judges at most `tries` choices.
///
/// # Errors
/// If the diagrams need more than the effort's nodes, or if the sum of the outputs without inversion is too long.
pub fn phased(function: &Function, effort: &Effort, tries: usize) -> Result<Phased, Refused> {
    let n = function.shape().outputs();
    let quick = Effort { exact: false, looks: 0, steps: effort.steps / 8, ..*effort };
    let mut search =
        Search { function, effort: quick, known: BTreeMap::new(), tries: tries.max(1) };
    let mut starts = vec![vec![false; n]];
    // Phases that fit together, from the sum of all outputs and complements.
    if let Ok(doubled) = function.doubled()
        && let Ok(outcome) = shared(&doubled, &quick)
    {
        starts.push(sides(&outcome.terms, n));
    }
    if let Ok(outputs) = super::per_output(function, true, &quick) {
        starts.push(outputs.iter().map(|output| output.is_complemented).collect());
    }
    let all = u32::try_from(n).ok().and_then(|n| 1usize.checked_shl(n));
    if all.is_some_and(|all| all <= search.tries) {
        // Few enough to try all of them.
        let choices = 0..all.unwrap_or(0);
        starts = choices.map(|choice| (0..n).map(|o| choice >> o & 1 == 1).collect()).collect();
    }
    let mut best: (Cost, Vec<bool>) = (None, vec![false; n]);
    // The most promising start first, because the tries may run out.
    let mut judged: Vec<(Cost, Vec<bool>)> =
        starts.into_iter().map(|start| (search.cost(&start), start)).collect();
    judged.sort_by_key(|(cost, _)| (cost.is_none(), *cost));
    for (_, start) in judged {
        let found = search.descend(start);
        if found.0.is_some() && (best.0.is_none() || found.0 < best.0) {
            best = found;
        }
    }
    let is_complete = all == Some(search.known.len());
    let tries = search.known.len();
    let turned = function.complemented(&best.1)?;
    let outcome = shared(&turned, effort)?;
    // The quick judgement may be wrong, so the result is compared with the sum without inverted outputs.
    if best.1.contains(&true) {
        let plain = shared(function, effort)?;
        let cost = |outcome: &Outcome| (outcome.terms.len(), outcome.terms.n_literals());
        if cost(&plain) <= cost(&outcome) {
            let is_complemented = vec![false; n];
            return Ok(Phased { is_complemented, outcome: plain, tries, is_complete });
        }
    }
    Ok(Phased { is_complemented: best.1, outcome, tries, is_complete })
}

/// One phase for each of `n` outputs, from a sum of the outputs followed by their complements. Single outputs are inverted as long as this reduces the number
/// of products needed.
fn sides(terms: &Terms, n: usize) -> Vec<bool> {
    let shape = terms.shape;
    let users: Vec<Vec<usize>> =
        terms.iter().map(|term| bits(shape.outputs_of(term)).collect()).collect();
    let count = |phases: &[bool]| {
        users
            .iter()
            .filter(|outputs| outputs.iter().any(|output| phases[output % n] == (*output >= n)))
            .count()
    };
    let mut phases = vec![false; n];
    let mut least = count(&phases);
    loop {
        let before = least;
        for output in 0..n {
            phases[output] ^= true;
            let now = count(&phases);
            if now < least {
                least = now;
            } else {
                phases[output] ^= true;
            }
        }
        if least == before {
            return phases;
        }
    }
}

impl Function {
    /// The same outputs, followed by their complements.
    fn doubled(&self) -> Result<Self, Refused> {
        let mut doubled = self.clone();
        for (lower, upper) in self.lower.iter().zip(&self.upper) {
            let (low, high) = (doubled.bdd.not(*upper)?, doubled.bdd.not(*lower)?);
            doubled.lower.push(low);
            doubled.upper.push(high);
        }
        doubled.shape = Shape::new(self.shape.inputs(), 2 * self.shape.outputs());
        doubled.start = Terms::new(doubled.shape);
        Ok(doubled)
    }
}
