//! The loop of espresso [Brayton et al. 1984], with exact covering instead of espresso's greedy choice, and a pool of all primes found.
//!
//! ```text
//! sum ─ expand ─ irredundant ─ essential ─► reduce ─ expand ─ irredundant … ─► last gasp ─► irredundant over the pool ─► sparse
//! ```
//! Products are expanded against the forbidden products (the blocking matrix), towards primes that cover most others; if the forbidden part has too
//! many products, they are expanded against the diagram.

use super::covering::solve;
use super::expand::Growth;
use super::function::Function;
use super::rows::Rows;
use super::terms::{Recursion, Shape, Spent, Terms, bits};
use grafsynth_ir::Gather;
use grafsynth_ir::ranks::sort_by_rank;
use std::collections::BTreeSet;

/// The heuristic minimisation of one function: repeated expansion, removal and reduction of products.
pub(super) struct Loop<'a> {
    function: &'a Function,
    shape: Shape,
    /// The forbidden products of each output; `None` if the diagram is used instead.
    pub(super) off: Option<Terms>,
    /// The free part of each output: the products that a sum may or may not cover.
    free: Terms,
    /// The points that other products do not have to cover: the free part, and the essential primes once they are known.
    done: Terms,
    /// The primes that every sum of primes contains.
    essential: Option<Terms>,
    /// Every prime found.
    pool: BTreeSet<Vec<u64>>,
    /// The remaining steps of all recursions.
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
        Loop {
            function,
            shape,
            off,
            done: free.clone(),
            free,
            essential: None,
            pool: BTreeSet::new(),
            steps,
            covering_steps,
        }
    }

    /// Improves a sum to a local minimum. Even if the steps run out, the result is a correct sum.
    pub(super) fn run(&mut self, start: &Terms) -> Terms {
        let cost = |terms: &Terms| (terms.len(), terms.n_literals());
        let mut best = start.clone();
        best.absorb();
        best = self.expand(&best, &vec![false; best.len()]);
        best = self.irredundant(best);
        if self.essential.is_none() {
            let is_essential = self.essential_of(&best);
            let essential = best.select((0..best.len()).filter(|index| is_essential[*index]));
            self.done.extend(&essential);
            self.essential = Some(essential);
            best.retain(|index, _| !is_essential[index]);
        }
        let mut cover = best.clone();
        let mut round = 0;
        loop {
            loop {
                let (shrunk, is_prime) = self.reduce(cover, round % 2 == 1, false);
                cover = self.expand(&shrunk, &is_prime);
                cover = self.irredundant(cover);
                round += 1;
                if cost(&cover) >= cost(&best) {
                    break;
                }
                best = cover.clone();
            }
            let gasped = self.last_gasp(&best);
            if cost(&gasped) >= cost(&best) {
                break;
            }
            best = gasped;
            cover = best.clone();
        }
        best
    }

    /// The primes that every sum of primes contains; together with them a result of [`Loop::run`] is complete.
    pub(super) fn essential(&self) -> Terms {
        self.essential.clone().unwrap_or_else(|| Terms::new(self.shape))
    }

    /// Finds the primes that alone cover some point: a point without an allowed neighbour outside the prime and without a further
    /// allowed output.
    fn essential_of(&mut self, terms: &Terms) -> Vec<bool> {
        let shape = self.shape;
        let words = shape.literal_words();
        let mut all = terms.clone();
        all.extend(&self.done);
        let mut is_essential = vec![false; terms.len()];
        for (index, is_essential) in is_essential.iter_mut().enumerate() {
            let term = terms.get(index);
            // The points in or next to other products, and other products with more outputs.
            let mut beside = Terms::new(shape);
            for (_, near) in all.iter().enumerate().filter(|(other, _)| *other != index) {
                let Some(mut own) = shape.without_conflict(near, term) else { continue };
                let is_apart = own[..words] != near[..words];
                let mut is_more = false;
                for k in words..shape.stride() {
                    is_more |= !is_apart && near[k] & !term[k] != 0;
                    own[k] = near[k] & term[k];
                }
                if is_more {
                    own[words..].copy_from_slice(&term[words..]);
                }
                if own[words..].iter().any(|outputs| *outputs != 0) {
                    beside.push(&own);
                }
                // A product with another value of the field is adjacent for all values.
                let is_other = |value: usize| {
                    let (own, other) = (shape.literal(term, value), shape.literal(near, value));
                    own == Some(false) && other != Some(false)
                };
                if shape.one_hot().any(is_other) && !shape.conflict(near, term) {
                    let mut own = near.to_vec();
                    shape.one_hot().for_each(|value| shape.set_literal(&mut own, value, None));
                    for k in words..shape.stride() {
                        own[k] &= term[k];
                    }
                    beside.push(&own);
                }
            }
            let mut recursion = Recursion::new(&beside, self.steps);
            let near = recursion.meeting(term, |_| false);
            *is_essential = shape.regions(term).into_iter().any(|region| {
                let near = recursion.within(&near, &region);
                bits(shape.outputs_of(term)).any(|output| {
                    let list = recursion.of_output(&near, output);
                    recursion.covers(list, &mut region.clone()) == Ok(false)
                })
            });
            self.steps = recursion.steps;
        }
        is_essential
    }

    /// The best sum of the primes found so far.
    pub(super) fn best_of_pool(&mut self, best: Terms) -> Terms {
        let mut all = best.clone();
        let own: BTreeSet<Vec<u64>> = best.iter().map(<[u64]>::to_vec).gather();
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

    /// True if a product covers no forbidden point.
    pub(super) fn allows(&self, term: &[u64]) -> bool {
        let shape = self.shape;
        match &self.off {
            Some(off) => {
                !off.iter().any(|off| shape.share_output(term, off) && !shape.conflict(term, off))
            }
            None => self.function.allows(term),
        }
    }

    /// Expands each product to a prime, and drops products that another one contains.
    pub(super) fn expand(&mut self, terms: &Terms, is_prime: &[bool]) -> Terms {
        let shape = self.shape;
        let mut order: Vec<usize> = (0..terms.len()).collect();
        let weights = weights(terms);
        sort_by_rank(&mut order, |&index| [weights[index]]);
        let mut is_prime: Vec<bool> = order.iter().map(|index| is_prime[*index]).collect();
        let mut terms = terms.select(order);
        let mut is_covered: Vec<bool> = match &self.essential {
            Some(essential) => terms
                .iter()
                .map(|term| essential.iter().any(|prime| shape.contains(prime, term)))
                .collect(),
            None => vec![false; terms.len()],
        };
        for index in 0..terms.len() {
            if is_covered[index] || is_prime[index] {
                continue;
            }
            let prime = match &self.off {
                Some(off) => {
                    // No prime contains another one.
                    let open = (index + 1..terms.len())
                        .filter(|other| !is_covered[*other] && !is_prime[*other]);
                    Growth::new(&terms, index, open, off).prime()
                }
                None => self.expand_by_diagram(terms.get(index)),
            };
            for (other, is_covered) in is_covered.iter_mut().enumerate() {
                *is_covered |= other != index && shape.contains(&prime, terms.get(other));
            }
            terms.get_mut(index).copy_from_slice(&prime);
            is_prime[index] = true;
            self.pool.insert(prime);
        }
        terms.retain(|index, _| !is_covered[index]);
        terms
    }

    /// Expands one product by literals, then by outputs, as far as the diagram allows.
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

    /// True if the other products and the free part cover a product for all its outputs; also false if the steps run out.
    fn is_covered(&mut self, all: &Terms, term: &[u64], skip: impl Fn(usize) -> bool) -> bool {
        let mut recursion = Recursion::new(all, self.steps);
        let near = recursion.meeting(term, skip);
        let covered = self.shape.regions(term).into_iter().all(|region| {
            let near = recursion.within(&near, &region);
            let mut last = None;
            bits(self.shape.outputs_of(term)).all(|output| {
                let list = recursion.of_output(&near, output);
                // Outputs with the same products have the same result.
                if last.as_ref() == Some(&list) {
                    return true;
                }
                last = Some(list.clone());
                recursion.covers(list, &mut region.clone()) == Ok(true)
            })
        });
        self.steps = recursion.steps;
        covered
    }

    fn shape_outputs(&self, term: &[u64]) -> impl Iterator<Item = usize> + use<> {
        let outputs: Vec<usize> = bits(self.shape.outputs_of(term)).collect();
        outputs.into_iter()
    }

    /// A smallest subset of the products that still covers everything, as far as the steps allow.
    pub(super) fn irredundant(&mut self, terms: Terms) -> Terms {
        let n = terms.len();
        let mut all = terms.clone();
        all.extend(&self.done);
        // Products that cover something alone are kept.
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
        blockers.extend(&self.done);
        match self.choose(&optional, &blockers, &optional) {
            Some((chosen, _)) => {
                kept.extend(&optional.select(chosen));
                kept
            }
            None => self.thin(terms),
        }
    }

    /// Drops products one after the other if the rest covers them.
    fn thin(&mut self, terms: Terms) -> Terms {
        let n = terms.len();
        let mut all = terms.clone();
        all.extend(&self.done);
        let mut is_gone = vec![false; n];
        let mut order: Vec<usize> = (0..n).collect();
        sort_by_rank(&mut order, |&index| {
            let term = terms.get(index);
            [self.shape.n_outputs(term) as u64, !(self.shape.n_literals(term) as u64)]
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

    /// The fewest of `columns` that cover the regions together with the blockers, and a lower bound; `None` if the steps run out.
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
            let near = recursion.meeting(region, |_| false);
            for part in self.shape.regions(region) {
                let near = recursion.within(&near, &part);
                for output in bits(self.shape.outputs_of(region)) {
                    let list = recursion.of_output(&near, output);
                    outcome = recursion.rows(list, &part, columns.len(), rows);
                    if outcome.is_err() || rows.is_full() {
                        break 'regions;
                    }
                }
            }
        }
        self.steps = recursion.steps;
        outcome
    }

    /// Shrinks each product to the part that the others do not cover, and returns true for each unchanged product. `by_weight`: in the order of their weights
    /// only; `alone`: against the original products, not the shrunk ones.
    fn reduce(&mut self, terms: Terms, by_weight: bool, alone: bool) -> (Terms, Vec<bool>) {
        let shape = self.shape;
        let words = shape.literal_words();
        let n = terms.len();
        let weights = weights(&terms);
        let mut order: Vec<usize> = (0..n).collect();
        sort_by_rank(&mut order, |&index| [!weights[index]]);
        // As in espresso: the largest first, then by their distance from it.
        if let Some(&largest) = order.first()
            && !by_weight
        {
            let seed = terms.get(largest).to_vec();
            sort_by_rank(&mut order, |&index| {
                let term = terms.get(index);
                let differing: usize = (0..shape.input_words())
                    .map(|k| {
                        let wi = shape.input_words();
                        ((seed[k] & term[wi + k]) | (seed[wi + k] & term[k])).count_ones() as usize
                    })
                    .sum();
                [differing as u64, !weights[index], index as u64]
            });
        }
        let mut all = terms.clone();
        all.extend(&self.done);
        let mut is_empty = vec![false; n];
        let mut is_same = vec![true; n];
        let mut shrunk = terms.clone();
        for index in order {
            let term = all.get(index).to_vec();
            let mut recursion = Recursion::new(&all, self.steps);
            let mut literals: Option<Vec<u64>> = None;
            let mut kept = term.clone();
            let mut is_spent = false;
            let near =
                recursion.meeting(&term, |other| other == index || (other < n && is_empty[other]));
            let regions = shape.regions(&term);
            let near: Vec<Vec<u32>> =
                regions.iter().map(|region| recursion.within(&near, region)).collect();
            for output in self.shape_outputs(&term) {
                let mut is_open = false;
                for (region, near) in regions.iter().zip(&near) {
                    let list = recursion.of_output(near, output);
                    let hull = match recursion.hull_of_rest(list, region) {
                        Ok(None) => continue,
                        Ok(Some(hull)) => hull,
                        Err(Spent) => {
                            is_spent = true;
                            continue;
                        }
                    };
                    is_open = true;
                    match &mut literals {
                        None => literals = Some(hull),
                        Some(own) => own.iter_mut().zip(&hull).for_each(|(own, hull)| *own &= hull),
                    }
                }
                if !is_open {
                    shape.remove_output(&mut kept, output);
                }
            }
            if let Some(literals) = &mut literals {
                shape.without_positive(literals);
            }
            self.steps = recursion.steps;
            if is_spent {
                continue;
            }
            match literals {
                Some(literals) => kept[..words].copy_from_slice(&literals),
                // The other products cover all of this product.
                None if alone => continue,
                None => {
                    is_empty[index] = true;
                    continue;
                }
            }
            is_same[index] = kept == term;
            shrunk.get_mut(index).copy_from_slice(&kept);
            if !alone {
                all.get_mut(index).copy_from_slice(&kept);
            }
        }
        shrunk.retain(|index, _| !is_empty[index]);
        let is_same =
            (0..n).filter(|index| !is_empty[*index]).map(|index| is_same[index]).collect();
        (shrunk, is_same)
    }

    /// New primes that contain pairs of separately shrunk products, and the best choice that includes them.
    fn last_gasp(&mut self, terms: &Terms) -> Terms {
        let shape = self.shape;
        let (mut shrunk, is_same) = self.reduce(terms.clone(), true, true);
        // A product that did not shrink is the only one that covers some corner.
        shrunk.retain(|index, _| !is_same[index]);
        let mut found: BTreeSet<Vec<u64>> = BTreeSet::new();
        for a in 0..shrunk.len() {
            let partners: Vec<usize> = match &self.off {
                Some(off) => Growth::new(&shrunk, a, a + 1..shrunk.len(), off).partners(),
                None => (a + 1..shrunk.len())
                    .filter(|b| {
                        let mut both = shrunk.get(a).to_vec();
                        shape.join(&mut both, shrunk.get(*b));
                        self.function.allows(&both)
                    })
                    .collect(),
            };
            for b in partners {
                let mut both = shrunk.get(a).to_vec();
                shape.join(&mut both, shrunk.get(b));
                found.insert(both);
            }
        }
        if found.is_empty() {
            return terms.clone();
        }
        let mut pairs = Terms::new(shape);
        found.iter().for_each(|term| pairs.push(term));
        let primes = self.expand(&pairs, &vec![false; pairs.len()]);
        let mut all = terms.clone();
        for prime in primes.iter() {
            if !terms.iter().any(|term| term == prime) {
                all.push(prime);
            }
        }
        self.irredundant(all)
    }

    /// Removes products from outputs that do not need them, then shortens the products as far as this allows.
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

    /// A lower bound on the number of products: no product can cover two of these points. `looks` bounds the comparisons with forbidden products.
    pub(super) fn independent_points(&mut self, terms: &Terms, looks: usize) -> usize {
        let shape = self.shape;
        let mut all = terms.clone();
        all.extend(&self.free);
        let mut by_term: Vec<Vec<Vec<u64>>> = Vec::new();
        for index in 0..terms.len() {
            let term = terms.get(index).to_vec();
            let mut recursion = Recursion::new(&all, self.steps);
            let mut own = Vec::new();
            let near = recursion.meeting(&term, |other| other == index);
            for output in self.shape_outputs(&term) {
                let list = recursion.of_output(&near, output);
                let gap = shape.regions(&term).into_iter().find_map(|mut region| {
                    let list = recursion.within(&list, &region);
                    (recursion.covers(list, &mut region) == Ok(false)).then_some(region)
                });
                if let Some(region) = gap {
                    let mut point = shape.empty();
                    point[..shape.literal_words()].copy_from_slice(&region);
                    // An undecided input may have either value, but a point needs one value.
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
        // One point of each product first, then a second one: as many as can be compared pairwise at a reasonable cost.
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
        sort_by_rank(&mut order, |&point| [partners[point].len() as u64]);
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

/// A measure of what each product shares with the others: large products have large weights.
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

/// The number of literals of each product, as the weight that decides between products that cover equally much.
pub(super) fn literal_weights(terms: &Terms) -> Vec<u32> {
    let shape = terms.shape;
    terms.iter().map(|term| u32::try_from(shape.n_literals(term)).unwrap_or(u32::MAX)).collect()
}
