//! Expands one product to a prime against the forbidden products: the EXPAND step of espresso [Brayton et al. 1984].
//!
//! A product grows by *parts*: literals that it drops and outputs that it gains. The blocking matrix has a row for each forbidden product: the
//! literals that separate the product from it, and its outputs. A row forbids a set of parts that leaves none of its separating literals and includes
//! one of its outputs. Rows that are separated for good by a part that is no longer free are removed, so the matrix soon becomes small.

use super::terms::{Terms, bits, ones, subset};

/// A product that is being expanded to a prime.
pub(super) struct Growth<'a> {
    terms: &'a Terms,
    term: &'a [u64],
    /// The number of words of literals (one bit for each input), and the number of words of a row (literals and outputs).
    wi: usize,
    stride: usize,
    /// The parts that were raised, and those that can still be raised.
    raised: Vec<u64>,
    free: Vec<u64>,
    /// The rows that still restrict the product.
    rows: Vec<u64>,
    /// The candidates that may become covered, and the parts that each needs; one row of `stride` words each.
    others: Vec<usize>,
    needs: Vec<u64>,
    /// The number of candidates, at the front, that may become covered completely; the others can only be covered partly.
    n_hopeful: usize,
}

/// Above this number of rows the last step builds a large prime part by part.
const MAX_COVER_ROWS: usize = 500;

impl<'a> Growth<'a> {
    /// Starts with one product of a list; the `candidates` are the other products of the list that its prime may come to contain.
    pub(super) fn new(
        terms: &'a Terms,
        index: usize,
        candidates: impl Iterator<Item = usize>,
        off: &Terms,
    ) -> Self {
        let shape = terms.shape;
        let (wi, words) = (shape.input_words(), shape.literal_words());
        let stride = shape.stride() - wi;
        let term = terms.get(index);
        let mut raised = vec![0; stride];
        raised[wi..].copy_from_slice(&term[words..]);
        let mut free = vec![0; stride];
        for k in 0..wi {
            free[k] = term[k] | term[wi + k];
        }
        for output in 0..shape.outputs() {
            free[wi + output / 64] |= 1 << (output % 64);
        }
        for k in wi..stride {
            free[k] &= !raised[k];
        }
        let mut rows = Vec::with_capacity(off.len() * stride);
        for other in off.iter() {
            rows.extend((0..wi).map(|k| term[k] & other[wi + k] | term[wi + k] & other[k]));
            rows.extend_from_slice(&other[words..]);
        }
        let mut growth = Growth {
            terms,
            term,
            wi,
            stride,
            raised,
            free,
            rows,
            others: Vec::new(),
            needs: Vec::new(),
            n_hopeful: 0,
        };
        growth.settle();
        for other in candidates {
            let own = terms.get(other);
            let from = growth.needs.len();
            growth.needs.extend((0..wi).map(|k| term[k] & !own[k] | term[wi + k] & !own[wi + k]));
            growth.needs.extend_from_slice(&own[words..]);
            // Outside the largest product that this one can become, so never covered.
            let is_near = growth.needs[from..]
                .iter()
                .zip(growth.raised.iter().zip(&growth.free))
                .all(|(need, (raised, free))| need & !(raised | free) == 0);
            if is_near {
                growth.others.push(other);
            } else {
                growth.needs.truncate(from);
            }
        }
        growth.n_hopeful = growth.others.len();
        growth
    }

    /// Expands the product to a prime: first towards the prime that contains most of the others, then towards their common part,
    /// then towards a large prime.
    pub(super) fn prime(mut self) -> Vec<u64> {
        self.swallow();
        while !self.others.is_empty() {
            let part = self.most_needed();
            self.raise(part);
            self.settle();
            self.thin_others();
        }
        self.largest()
    }

    /// The candidates that fit into one prime together with this product, each considered alone.
    pub(super) fn partners(mut self) -> Vec<usize> {
        let mut low = vec![0; self.stride];
        let needs = std::mem::take(&mut self.needs);
        std::mem::take(&mut self.others)
            .into_iter()
            .zip(needs.chunks_exact(self.stride))
            .filter(|(_, need)| self.is_feasible(need, &mut low))
            .map(|(other, _)| other)
            .collect()
    }

    /// Parts that a single row depends on are no longer free; rows that cannot be violated any more are removed.
    fn settle(&mut self) {
        let (wi, stride) = (self.wi, self.stride);
        for row in self.rows.chunks_exact(stride) {
            let (literals, outputs) = row.split_at(wi);
            let mut open = 0;
            let mut is_safe = false;
            for (literals, (raised, free)) in
                literals.iter().zip(self.raised.iter().zip(&self.free))
            {
                let apart = literals & !raised;
                is_safe |= apart & !free != 0;
                open += apart.count_ones();
            }
            if is_safe || open > 1 {
                continue;
            }
            let is_shared =
                outputs.iter().zip(&self.raised[wi..]).any(|(row, raised)| row & raised != 0);
            if open == 1 && is_shared {
                for (free, (row, raised)) in
                    self.free.iter_mut().zip(literals.iter().zip(&self.raised))
                {
                    *free &= !row | raised;
                }
            } else if open == 0 && !is_shared {
                self.free[wi..].iter_mut().zip(outputs).for_each(|(free, row)| *free &= !row);
            }
        }
        let mut kept = 0;
        for at in (0..self.rows.len()).step_by(stride) {
            let row = &self.rows[at..at + stride];
            let is_apart = (0..wi).any(|k| row[k] & !self.raised[k] & !self.free[k] != 0);
            let can_share = (wi..stride).any(|k| row[k] & (self.raised[k] | self.free[k]) != 0);
            if !is_apart && can_share {
                self.rows.copy_within(at..at + stride, kept);
                kept += stride;
            }
        }
        self.rows.truncate(kept);
    }

    fn raise(&mut self, part: usize) {
        self.raised[part / 64] |= 1 << (part % 64);
        self.free[part / 64] &= !(1 << (part % 64));
    }

    /// Raises parts that occur in no row.
    fn raise_harmless(&mut self) {
        let mut asked = vec![0; self.stride];
        for row in self.rows.chunks_exact(self.stride) {
            asked.iter_mut().zip(row).for_each(|(asked, row)| *asked |= row);
        }
        for (k, asked) in asked.iter().enumerate() {
            self.raised[k] |= self.free[k] & !asked;
            self.free[k] &= asked;
        }
    }

    /// Keeps the candidates that may still become covered and are not covered yet.
    fn thin_others(&mut self) {
        let stride = self.stride;
        let (mut kept, mut hopeful) = (0, 0);
        for at in 0..self.others.len() {
            let need = &self.needs[at * stride..(at + 1) * stride];
            let is_inside = subset(need, &self.raised);
            let is_near = need
                .iter()
                .zip(self.raised.iter().zip(&self.free))
                .all(|(need, (raised, free))| need & !(raised | free) == 0);
            if is_near && !is_inside {
                self.others[kept] = self.others[at];
                self.needs.copy_within(at * stride..(at + 1) * stride, kept * stride);
                kept += 1;
                hopeful += usize::from(at < self.n_hopeful);
            }
        }
        self.n_hopeful = hopeful;
        self.others.truncate(kept);
        self.needs.truncate(kept * stride);
    }

    /// True if all these parts can be raised; adds to `low` the parts that then cannot be raised any more.
    fn is_feasible(&self, need: &[u64], low: &mut [u64]) -> bool {
        let (wi, stride) = (self.wi, self.stride);
        low.fill(0);
        for row in self.rows.chunks_exact(stride) {
            let open: u32 =
                (0..wi).map(|k| (row[k] & !self.raised[k] & !need[k]).count_ones()).sum();
            if open > 1 {
                continue;
            }
            let is_shared = (wi..stride).any(|k| row[k] & (self.raised[k] | need[k]) != 0);
            match (open, is_shared) {
                (0, true) => return false,
                (0, false) => {
                    for k in wi..stride {
                        low[k] |= row[k];
                    }
                }
                (_, true) => {
                    for k in 0..wi {
                        low[k] |= row[k] & !self.raised[k] & !need[k];
                    }
                }
                (_, false) => {}
            }
        }
        true
    }

    /// Covers one candidate after the other, each time the one that leaves room for most of the others.
    fn swallow(&mut self) {
        let stride = self.stride;
        let mut low = vec![0; stride];
        loop {
            self.raise_harmless();
            self.thin_others();
            let mut lows: Vec<u64> = Vec::new();
            let mut n_feasible = 0;
            for at in 0..self.n_hopeful {
                if self.is_feasible(&self.needs[at * stride..(at + 1) * stride], &mut low) {
                    lows.extend_from_slice(&low);
                    self.swap_others(n_feasible, at);
                    n_feasible += 1;
                }
            }
            self.n_hopeful = n_feasible;
            let hopeful = &self.needs[..n_feasible * stride];
            let best = lows.chunks_exact(stride).enumerate().max_by_key(|(at, low)| {
                let room = hopeful
                    .chunks_exact(stride)
                    .filter(|need| need.iter().zip(*low).all(|(need, low)| need & low == 0))
                    .count();
                let own = &hopeful[at * stride..(at + 1) * stride];
                let size: u32 =
                    own.iter().zip(&self.free).map(|(need, free)| (need & free).count_ones()).sum();
                (room, std::cmp::Reverse((size, *at)))
            });
            let Some((best, _)) = best else { return };
            for k in 0..stride {
                let need = self.needs[best * stride + k];
                self.raised[k] |= need & self.free[k];
                self.free[k] &= !need;
            }
            self.settle();
        }
    }

    fn swap_others(&mut self, a: usize, b: usize) {
        self.others.swap(a, b);
        (0..self.stride).for_each(|k| self.needs.swap(a * self.stride + k, b * self.stride + k));
    }

    /// The part that most candidates need.
    fn most_needed(&self) -> usize {
        let mut counts = vec![0u32; self.stride * 64];
        for need in self.needs.chunks_exact(self.stride) {
            bits(need).for_each(|part| counts[part] += 1);
        }
        bits(&self.free).max_by_key(|part| (counts[*part], std::cmp::Reverse(*part))).unwrap_or(0)
    }

    /// A large prime: raises as many free parts as possible.
    fn largest(mut self) -> Vec<u64> {
        self.raise_harmless();
        if self.rows.len() > MAX_COVER_ROWS * self.stride {
            while !self.rows.is_empty() {
                let part = self.least_blocking();
                self.raise(part);
                self.settle();
                if self.rows.len() <= MAX_COVER_ROWS * self.stride {
                    break;
                }
            }
        }
        // Rows as sets of parts, at least one of which must not be raised; an output that a row already shares does not help.
        let (wi, stride) = (self.wi, self.stride);
        let mut sets: Vec<Vec<u64>> = Vec::new();
        for row in self.rows.chunks_exact(stride) {
            let mut literals = vec![0; stride];
            for k in 0..wi {
                literals[k] = row[k] & self.free[k];
            }
            if (wi..stride).any(|k| row[k] & self.raised[k] != 0) {
                sets.push(literals);
                continue;
            }
            let outputs: Vec<u64> = (wi..stride).map(|k| row[k] & self.free[k]).collect();
            for output in bits(&outputs) {
                let mut set = literals.clone();
                set[wi + output / 64] |= 1 << (output % 64);
                sets.push(set);
            }
        }
        let mut counts = vec![0usize; stride * 64];
        let mut kept: Vec<usize> = Vec::new();
        let mut open: Vec<usize> = (0..sets.len()).collect();
        while !open.is_empty() {
            counts.fill(0);
            for set in open.iter().map(|at| &sets[*at]) {
                // A part that a short row depends on is likely to be needed.
                let weight = 64 / ones(set).clamp(1, 64);
                bits(set).for_each(|part| counts[part] += weight);
            }
            let Some(part) =
                bits(&self.free).max_by_key(|part| (counts[*part], std::cmp::Reverse(*part)))
            else {
                break;
            };
            kept.push(part);
            self.free[part / 64] &= !(1 << (part % 64));
            open.retain(|at| sets[*at][part / 64] >> (part % 64) & 1 == 0);
        }
        // Parts chosen first may have become superfluous.
        let mut stay = vec![0u64; stride];
        kept.iter().for_each(|part| stay[part / 64] |= 1 << (part % 64));
        for part in kept {
            stay[part / 64] &= !(1 << (part % 64));
            if sets.iter().any(|set| set.iter().zip(&stay).all(|(set, stay)| set & stay == 0)) {
                stay[part / 64] |= 1 << (part % 64);
            } else {
                self.free[part / 64] |= 1 << (part % 64);
            }
        }
        for (raised, free) in self.raised.iter_mut().zip(&self.free) {
            *raised |= free;
        }
        self.term()
    }

    /// The part that blocks the fewest forbidden products.
    fn least_blocking(&self) -> usize {
        let mut counts = vec![0u32; self.stride * 64];
        for row in self.rows.chunks_exact(self.stride) {
            bits(row).for_each(|part| counts[part] += 1);
        }
        bits(&self.free).min_by_key(|part| (counts[*part], *part)).unwrap_or(0)
    }

    /// The current product.
    fn term(&self) -> Vec<u64> {
        let shape = self.terms.shape;
        let (wi, words) = (self.wi, shape.literal_words());
        let mut term = self.term.to_vec();
        for k in 0..wi {
            term[k] &= !self.raised[k];
            term[wi + k] &= !self.raised[k];
        }
        term[words..].copy_from_slice(&self.raised[wi..]);
        term
    }
}
