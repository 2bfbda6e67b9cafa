//! The loop of espresso [Brayton et al. 1984], with exact covering where espresso has a greedy choice, and a pool of all primes met.
//!
//! ```text
//! sum ─ expand ─ irredundant ─► reduce ─ expand ─ irredundant … ─► last gasp ─► irredundant over the pool ─► sparse
//! ```
//! Products are expanded against the forbidden products (the blocking matrix), towards those that swallow most others; where the forbidden part
//! has no sum of bearable size, against the diagram.

use super::covering::solve;
use super::function::Function;
use super::terms::{Recursion, Rows, Shape, Spent, Terms, bits, ones};
use std::collections::BTreeSet;

/// The loop over one question.
pub(super) struct Loop<'a> {
    function: &'a Function,
    shape: Shape,
    /// What each output must not cover; none: ask the diagram.
    pub(super) off: Option<Terms>,
    /// What each output may or may not cover.
    free: Terms,
    /// Every prime met.
    pool: BTreeSet<Vec<u64>>,
    /// Steps left for all recursions.
    steps: u64,
    covering_steps: u64,
}

impl<'a> Loop<'a> {
    pub(super) fn new(
        function: &'a Function,
        off: Option<Terms>,
        free: Terms,
        steps: u64,
        covering_steps: u64,
    ) -> Self {
        let shape = function.shape();
        Loop { function, shape, off, free, pool: BTreeSet::new(), steps, covering_steps }
    }

    /// Brings a sum to a local minimum. Whatever runs out, the result is a right sum.
    pub(super) fn run(&mut self, start: &Terms) -> Terms {
        let cost = |terms: &Terms| (terms.len(), terms.n_literals());
        let mut best = start.clone();
        best.absorb();
        best = self.expand(&best);
        best = self.irredundant(best);
        let mut cover = best.clone();
        loop {
            loop {
                cover = self.reduce(cover, false);
                cover = self.expand(&cover);
                cover = self.irredundant(cover);
                if cost(&cover) >= cost(&best) {
                    break;
                }
                best = cover.clone();
            }
            let gasped = self.last_gasp(&best);
            if gasped.len() >= best.len() {
                break;
            }
            best = gasped;
            cover = best.clone();
        }
        best
    }

    /// The best sum of the primes met so far.
    pub(super) fn best_of_pool(&mut self, best: Terms) -> Terms {
        let mut all = best.clone();
        let own: BTreeSet<Vec<u64>> = best.iter().map(<[u64]>::to_vec).collect();
        self.pool.iter().filter(|term| !own.contains(*term)).for_each(|term| all.push(term));
        let pooled = self.irredundant(all);
        if (pooled.len(), pooled.n_literals()) < (best.len(), best.n_literals()) {
            pooled
        } else {
            best
        }
    }

    pub(super) fn shape(&self) -> Shape {
        self.shape
    }

    /// True if a product covers nothing forbidden.
    pub(super) fn allows(&self, term: &[u64]) -> bool {
        let shape = self.shape;
        match &self.off {
            Some(off) => {
                !off.iter().any(|off| shape.share_output(term, off) && !shape.conflict(term, off))
            }
            None => self.function.allows(term),
        }
    }

    /// Makes each product prime, and drops those that lie in another.
    pub(super) fn expand(&mut self, terms: &Terms) -> Terms {
        let shape = self.shape;
        let mut order: Vec<usize> = (0..terms.len()).collect();
        let weights = weights(terms);
        order.sort_by_key(|&index| (weights[index], index));
        let mut terms = terms.select(order);
        let mut is_covered = vec![false; terms.len()];
        let mut grown = Terms::new(shape);
        for index in 0..terms.len() {
            if is_covered[index] {
                continue;
            }
            let prime = match &self.off {
                Some(off) => expand_one(&terms, index, &is_covered, off),
                None => self.expand_by_diagram(terms.get(index)),
            };
            for (other, is_covered) in is_covered.iter_mut().enumerate() {
                *is_covered |= other != index && shape.contains(&prime, terms.get(other));
            }
            terms.get_mut(index).copy_from_slice(&prime);
            self.pool.insert(prime);
        }
        for (index, term) in terms.iter().enumerate() {
            if !is_covered[index] {
                grown.push(term);
            }
        }
        grown
    }

    /// Grows one product by literals, then by outputs, as far as the diagram allows.
    fn expand_by_diagram(&self, term: &[u64]) -> Vec<u64> {
        let shape = self.shape;
        let mut grown = term.to_vec();
        for input in 0..shape.inputs() {
            if let Some(value) = shape.literal(&grown, input) {
                shape.set_literal(&mut grown, input, None);
                if !self.function.allows(&grown) {
                    shape.set_literal(&mut grown, input, Some(value));
                }
            }
        }
        for output in 0..shape.outputs() {
            if !shape.has_output(&grown, output) {
                shape.add_output(&mut grown, output);
                if !self.function.allows(&grown) {
                    shape.remove_output(&mut grown, output);
                }
            }
        }
        grown
    }

    /// True if the others and what is free cover a product for all its outputs; false also when the steps run out.
    fn is_covered(&mut self, all: &Terms, term: &[u64], skip: impl Fn(usize) -> bool) -> bool {
        let mut recursion = Recursion::new(all, self.steps);
        let covered = self.shape_outputs(term).all(|output| {
            let list = recursion.meeting(term, output, &skip);
            let mut region = term[..self.shape.literal_words()].to_vec();
            recursion.covers(list, &mut region) == Ok(true)
        });
        self.steps = recursion.steps;
        covered
    }

    fn shape_outputs(&self, term: &[u64]) -> impl Iterator<Item = usize> + use<> {
        let outputs: Vec<usize> = bits(self.shape.outputs_of(term)).collect();
        outputs.into_iter()
    }

    /// A smallest part of the products that still covers everything, as far as the steps go.
    pub(super) fn irredundant(&mut self, terms: Terms) -> Terms {
        let n = terms.len();
        let mut all = terms.clone();
        all.extend(&self.free);
        // What nobody else covers stays.
        let needed: Vec<bool> = (0..n)
            .map(|index| !self.is_covered(&all, terms.get(index), |other| other == index))
            .collect();
        let is_optional: Vec<bool> = (0..n)
            .map(|index| {
                let is_other = |other: usize| other < n && !needed[other];
                !needed[index] && !self.is_covered(&all, terms.get(index), is_other)
            })
            .collect();
        if !is_optional.contains(&true) {
            return terms.select((0..n).filter(|index| needed[*index]));
        }
        let optional = terms.select((0..n).filter(|index| is_optional[*index]));
        let mut kept = terms.select((0..n).filter(|index| needed[*index]));
        let mut blockers = kept.clone();
        blockers.extend(&self.free);
        match self.choose(&optional, &blockers, &optional) {
            Some((chosen, _)) => {
                kept.extend(&optional.select(chosen));
                kept
            }
            None => self.thin(terms),
        }
    }

    /// Drops products one after the other that the rest covers.
    fn thin(&mut self, terms: Terms) -> Terms {
        let n = terms.len();
        let mut all = terms.clone();
        all.extend(&self.free);
        let mut is_gone = vec![false; n];
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&index| {
            let term = terms.get(index);
            (self.shape.n_outputs(term), std::cmp::Reverse(self.shape.n_literals(term)), index)
        });
        for index in order {
            is_gone[index] = true;
            let skip: Vec<bool> = is_gone.clone();
            if !self.is_covered(&all, terms.get(index), |other| other < n && skip[other]) {
                is_gone[index] = false;
            }
        }
        terms.select((0..n).filter(|index| !is_gone[*index]))
    }

    /// The fewest of `columns` that cover the regions with the help of the blockers, and how many are needed at least; none when steps run out.
    pub(super) fn choose(
        &mut self,
        columns: &Terms,
        blockers: &Terms,
        regions: &Terms,
    ) -> Option<(Vec<usize>, usize)> {
        let mut rows = Rows::new(columns.len(), 50_000);
        let outcome = self.fill(columns, blockers, regions, &mut rows);
        if outcome.is_err() || rows.is_full() || rows.has_gap {
            return None;
        }
        let weights = literal_weights(columns);
        let solution = solve(&rows.sets(), &weights, self.covering_steps);
        Some((solution.columns.iter().map(|c| *c as usize).collect(), solution.lower))
    }

    fn fill(
        &mut self,
        columns: &Terms,
        blockers: &Terms,
        regions: &Terms,
        rows: &mut Rows,
    ) -> Result<(), Spent> {
        let mut all = columns.clone();
        all.extend(blockers);
        let mut recursion = Recursion::new(&all, self.steps);
        let mut outcome = Ok(());
        'regions: for region in regions.iter() {
            for output in bits(self.shape.outputs_of(region)) {
                let list = recursion.meeting(region, output, |_| false);
                outcome = recursion.rows(list, region, columns.len(), rows);
                if outcome.is_err() || rows.is_full() {
                    break 'regions;
                }
            }
        }
        self.steps = recursion.steps;
        outcome
    }

    /// Shrinks each product to what the others leave to it; `alone`: the others as they were, not as they became.
    pub(super) fn reduce(&mut self, terms: Terms, alone: bool) -> Terms {
        let shape = self.shape;
        let words = shape.literal_words();
        let n = terms.len();
        let weights = weights(&terms);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&index| (std::cmp::Reverse(weights[index]), index));
        // As espresso: the largest first, then by their distance from it.
        if let Some(&largest) = order.first() {
            let seed = terms.get(largest).to_vec();
            order.sort_by_key(|&index| {
                let term = terms.get(index);
                let differing: usize = (0..shape.input_words())
                    .map(|k| {
                        let wi = shape.input_words();
                        ((seed[k] & term[wi + k]) | (seed[wi + k] & term[k])).count_ones() as usize
                    })
                    .sum();
                (differing, std::cmp::Reverse(weights[index]), index)
            });
        }
        let mut all = terms.clone();
        all.extend(&self.free);
        let mut is_empty = vec![false; n];
        let mut shrunk = terms.clone();
        for index in order {
            let term = all.get(index).to_vec();
            let mut recursion = Recursion::new(&all, self.steps);
            let mut literals: Option<Vec<u64>> = None;
            let mut kept = term.clone();
            let mut is_spent = false;
            for output in self.shape_outputs(&term) {
                let list = recursion.meeting(&term, output, |other| {
                    other == index || (other < n && is_empty[other])
                });
                match recursion.hull_of_rest(list, &term) {
                    Ok(None) => shape.remove_output(&mut kept, output),
                    Ok(Some(hull)) => match &mut literals {
                        None => literals = Some(hull),
                        Some(own) => own.iter_mut().zip(&hull).for_each(|(own, hull)| *own &= hull),
                    },
                    Err(Spent) => is_spent = true,
                }
            }
            self.steps = recursion.steps;
            if is_spent {
                continue;
            }
            match literals {
                Some(literals) => kept[..words].copy_from_slice(&literals),
                // The others cover it all.
                None if alone => continue,
                None => {
                    is_empty[index] = true;
                    continue;
                }
            }
            shrunk.get_mut(index).copy_from_slice(&kept);
            if !alone {
                all.get_mut(index).copy_from_slice(&kept);
            }
        }
        shrunk.retain(|index, _| !is_empty[index]);
        shrunk
    }

    /// New primes over pairs of products that were shrunk each by itself, and the best choice with them.
    fn last_gasp(&mut self, terms: &Terms) -> Terms {
        let shape = self.shape;
        let shrunk = self.reduce(terms.clone(), true);
        let mut found: BTreeSet<Vec<u64>> = BTreeSet::new();
        let budget = 40_000_000 / self.off.as_ref().map_or(100_000, |off| off.len() + 1);
        let mut tried = 0;
        'pairs: for a in 0..shrunk.len() {
            for b in a + 1..shrunk.len() {
                let mut both = shrunk.get(a).to_vec();
                shape.join(&mut both, shrunk.get(b));
                // Nothing but the universe has so few literals; asking costs little there too.
                tried += 1;
                if tried > budget {
                    break 'pairs;
                }
                if self.allows(&both) {
                    found.insert(both);
                }
            }
        }
        if found.is_empty() {
            return terms.clone();
        }
        let mut pairs = Terms::new(shape);
        found.iter().for_each(|term| pairs.push(term));
        let primes = self.expand(&pairs);
        let mut all = terms.clone();
        for prime in primes.iter() {
            if !terms.iter().any(|term| term == prime) {
                all.push(prime);
            }
        }
        self.irredundant(all)
    }

    /// Takes products away from outputs that do without them, then makes them as short as that allows.
    pub(super) fn sparse(&mut self, mut terms: Terms) -> Terms {
        let shape = self.shape;
        let n = terms.len();
        let mut all = terms.clone();
        all.extend(&self.free);
        for index in 0..n {
            let term = all.get(index).to_vec();
            for output in self.shape_outputs(&term) {
                if shape.n_outputs(all.get(index)) == 1 {
                    break;
                }
                let mut own = term.clone();
                own[shape.literal_words()..].fill(0);
                shape.add_output(&mut own, output);
                if self.is_covered(&all, &own, |other| other == index) {
                    shape.remove_output(all.get_mut(index), output);
                }
            }
            let mut grown = all.get(index).to_vec();
            for input in 0..shape.inputs() {
                if let Some(value) = shape.literal(&grown, input) {
                    shape.set_literal(&mut grown, input, None);
                    if !self.allows(&grown) {
                        shape.set_literal(&mut grown, input, Some(value));
                    }
                }
            }
            all.get_mut(index).copy_from_slice(&grown);
            terms.get_mut(index).copy_from_slice(&grown);
        }
        terms
    }

    /// At least so many products are needed: pairwise no product can cover two of these points. `looks` bounds the comparisons with forbidden products.
    pub(super) fn independent_points(&mut self, terms: &Terms, looks: usize) -> usize {
        let shape = self.shape;
        let mut all = terms.clone();
        all.extend(&self.free);
        let mut by_term: Vec<Vec<Vec<u64>>> = Vec::new();
        for index in 0..terms.len() {
            let term = terms.get(index).to_vec();
            let mut recursion = Recursion::new(&all, self.steps);
            let mut own = Vec::new();
            for output in self.shape_outputs(&term) {
                let list = recursion.meeting(&term, output, |other| other == index);
                let mut region = term[..shape.literal_words()].to_vec();
                if recursion.covers(list, &mut region) == Ok(false) {
                    let mut point = shape.empty();
                    point[..shape.literal_words()].copy_from_slice(&region);
                    // An input that is still open may have either value; points have one.
                    for input in 0..shape.inputs() {
                        if shape.literal(&point, input).is_none() {
                            shape.set_literal(&mut point, input, Some(false));
                        }
                    }
                    shape.add_output(&mut point, output);
                    own.push(point);
                }
            }
            self.steps = recursion.steps;
            by_term.push(own);
        }
        // One point of each product first, then the second ones: as many as can be compared pairwise at a bearable cost.
        let cost = self.off.as_ref().map_or(10_000, |off| off.len() + 1);
        let most = (looks / cost).isqrt().clamp(64, 4_000);
        let longest = by_term.iter().map(Vec::len).max().unwrap_or(0);
        let points: Vec<Vec<u64>> = (0..longest)
            .flat_map(|at| by_term.iter().filter_map(move |own| own.get(at).cloned()))
            .take(most)
            .collect();
        let n = points.len();
        let mut partners: Vec<Vec<usize>> = vec![Vec::new(); n];
        for a in 0..n {
            for b in a + 1..n {
                let mut both = points[a].clone();
                shape.join(&mut both, &points[b]);
                if self.allows(&both) {
                    partners[a].push(b);
                    partners[b].push(a);
                }
            }
        }
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&point| (partners[point].len(), point));
        let mut is_out = vec![false; n];
        let mut count = 0;
        for point in order {
            if !is_out[point] {
                count += 1;
                partners[point].iter().for_each(|other| is_out[*other] = true);
            }
        }
        count
    }
}

/// How much each product has in common with the others: large ones have large weights.
fn weights(terms: &Terms) -> Vec<u64> {
    let shape = terms.shape;
    let n = terms.len() as u64;
    let mut counts = vec![0u64; shape.stride() * 64];
    for term in terms.iter() {
        bits(term).for_each(|bit| counts[bit] += 1);
    }
    let first_output = shape.literal_words() * 64;
    // Each value of each input counts for all products that allow it: those without the opposite literal.
    let all_values = 2 * n * shape.inputs() as u64 - counts[..first_output].iter().sum::<u64>();
    terms
        .iter()
        .map(|term| {
            let forbidden: u64 = bits(shape.literals_of(term)).map(|bit| n - counts[bit]).sum();
            let outputs: u64 =
                bits(shape.outputs_of(term)).map(|output| counts[first_output + output]).sum();
            (all_values + outputs).saturating_sub(forbidden)
        })
        .collect()
}

/// Products that do the same are told apart by their literals.
pub(super) fn literal_weights(terms: &Terms) -> Vec<u32> {
    let shape = terms.shape;
    terms.iter().map(|term| u32::try_from(shape.n_literals(term)).unwrap_or(u32::MAX)).collect()
}

/// Grows one product to a prime: towards the one that covers most of the others that are not covered yet, then towards what they have in common,
/// then to as few literals as possible.
fn expand_one(terms: &Terms, index: usize, is_covered: &[bool], off: &Terms) -> Vec<u64> {
    let shape = terms.shape;
    let (wi, words, stride) = (shape.input_words(), shape.literal_words(), shape.stride());
    let mut raise = terms.get(index).to_vec();
    // What may still be given up: literals; what may still be gained: outputs.
    let mut free = raise.clone();
    let mut universe = shape.empty();
    (0..shape.outputs()).for_each(|output| shape.add_output(&mut universe, output));
    for k in words..stride {
        free[k] = universe[k] & !raise[k];
    }
    let mut active: Vec<usize> = (0..off.len()).collect();
    let mut candidates: Vec<usize> =
        (0..terms.len()).filter(|other| *other != index && !is_covered[*other]).collect();
    let mut blocking = vec![0u64; words];
    loop {
        // A forbidden product that one part alone keeps out fixes that part.
        for &at in &active {
            let other = off.get(at);
            for k in 0..wi {
                blocking[k] = raise[k] & other[wi + k];
                blocking[wi + k] = raise[wi + k] & other[k];
            }
            let is_shared = shape.share_output(&raise, other);
            match (ones(&blocking), is_shared) {
                (1, true) => free.iter_mut().zip(&blocking).for_each(|(f, b)| *f &= !b),
                (0, false) => {
                    for k in words..stride {
                        free[k] &= !other[k];
                    }
                }
                _ => {}
            }
        }
        if free.iter().all(|word| *word == 0) {
            return raise;
        }
        let mut most = raise.clone();
        for k in 0..words {
            most[k] &= !free[k];
        }
        for k in words..stride {
            most[k] |= free[k];
        }
        active.retain(|&at| {
            let other = off.get(at);
            shape.share_output(&most, other) && !shape.conflict(&most, other)
        });
        if active.is_empty() {
            return most;
        }
        candidates.retain(|&at| {
            let other = terms.get(at);
            shape.contains(&most, other) && !shape.contains(&raise, other)
        });
        let is_allowed = |term: &[u64]| {
            !active.iter().any(|&at| {
                let other = off.get(at);
                shape.share_output(term, other) && !shape.conflict(term, other)
            })
        };
        let mut best: Option<(usize, usize, Vec<u64>)> = None;
        for &at in &candidates {
            let mut joined = raise.clone();
            shape.join(&mut joined, terms.get(at));
            if best.as_ref().is_some_and(|(_, _, best)| *best == joined) || !is_allowed(&joined) {
                continue;
            }
            let swallowed =
                candidates.iter().filter(|c| shape.contains(&joined, terms.get(**c))).count();
            let size = ones(&joined[..words]);
            if best
                .as_ref()
                .is_none_or(|(count, literals, _)| (swallowed, size) > (*count, *literals))
            {
                best = Some((swallowed, size, joined));
            }
        }
        if let Some((_, _, joined)) = best {
            raise = joined;
        } else {
            let part = if candidates.is_empty() {
                least_blocking(&raise, &free, &active, off)
            } else {
                most_common(&free, &candidates, terms)
            };
            if part < words * 64 {
                raise[part / 64] &= !(1 << (part % 64));
            } else {
                raise[part / 64] |= 1 << (part % 64);
            }
        }
        for k in 0..words {
            free[k] &= raise[k];
        }
        for k in words..stride {
            free[k] &= !raise[k];
        }
    }
}

/// The part that most candidates do without (a literal) or have (an output).
fn most_common(free: &[u64], candidates: &[usize], terms: &Terms) -> usize {
    let first_output = terms.shape.literal_words() * 64;
    let count = |part: usize| {
        candidates
            .iter()
            .filter(|at| {
                let has = terms.get(**at)[part / 64] >> (part % 64) & 1 == 1;
                has == (part >= first_output)
            })
            .count()
    };
    bits(free).max_by_key(|part| (count(*part), std::cmp::Reverse(*part))).unwrap_or(0)
}

/// The part that keeps out the fewest forbidden products.
fn least_blocking(raise: &[u64], free: &[u64], active: &[usize], off: &Terms) -> usize {
    let shape = off.shape;
    let (wi, words) = (shape.input_words(), shape.literal_words());
    let mut counts = vec![0u32; free.len() * 64];
    for &at in active {
        let other = off.get(at);
        for k in 0..wi {
            bits(&[raise[k] & other[wi + k]]).for_each(|bit| counts[k * 64 + bit] += 1);
            bits(&[raise[wi + k] & other[k]]).for_each(|bit| counts[(wi + k) * 64 + bit] += 1);
        }
        if !shape.share_output(raise, other) {
            bits(shape.outputs_of(other)).for_each(|bit| counts[words * 64 + bit] += 1);
        }
    }
    bits(free).min_by_key(|part| (counts[*part], *part)).unwrap_or(0)
}
