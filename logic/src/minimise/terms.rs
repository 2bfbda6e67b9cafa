//! Products of several outputs, stored in a flat array, and the recursive queries on such lists.
//!
//! A product is a set of literals and a set of outputs: words of positive literals, words of negative literals, words of outputs. Fewer literals and more
//! outputs make it larger. The algorithms follow the unate recursive paradigm of espresso [Brayton et al. 1984]: a variable that occurs in one polarity
//! only does not need a split.

use super::rows::Rows;
use std::ops::Range;

/// The number of inputs and outputs of products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    inputs: usize,
    outputs: usize,
    /// The number of words of one polarity.
    wi: usize,
    /// The number of words of outputs.
    wo: usize,
    /// The one-hot field, in which exactly one input is always true: the first of its inputs, and their number.
    one_hot: (usize, usize),
}

impl Shape {
    /// The shape of products with these numbers of inputs and outputs.
    #[must_use]
    pub fn new(inputs: usize, outputs: usize) -> Self {
        Shape {
            inputs,
            outputs,
            wi: inputs.div_ceil(64),
            wo: outputs.div_ceil(64),
            one_hot: (0, 0),
        }
    }

    /// The same shape with a one-hot field: a run of inputs, exactly one of which is always true. Products have no positive literals there; they contain the
    /// values whose input has no negative literal. The field is one multi-valued variable.
    pub(super) fn with_one_hot(self, field: Range<usize>) -> Self {
        Shape { one_hot: (field.start, field.len()), ..self }
    }

    /// The inputs of the one-hot field; empty if there is none.
    pub(super) fn one_hot(self) -> Range<usize> {
        self.one_hot.0..self.one_hot.0 + self.one_hot.1
    }

    /// The literals of a product, repeated for each of its values of a one-hot field: regions in which a recursion can split on single inputs.
    pub(super) fn regions(self, term: &[u64]) -> Vec<Vec<u64>> {
        let field = self.one_hot();
        if field.is_empty() {
            return vec![self.literals_of(term).to_vec()];
        }
        let mut empty = self.literals_of(term).to_vec();
        field.clone().for_each(|value| self.set_literal(&mut empty, value, Some(false)));
        let region = |value: usize| {
            let mut region = empty.clone();
            self.set_literal(&mut region, value, Some(true));
            region
        };
        field.filter(|value| self.literal(term, *value) != Some(false)).map(region).collect()
    }

    /// Removes the positive literals of the one-hot field, which the negative ones imply.
    pub(super) fn without_positive(self, literals: &mut [u64]) {
        for value in self.one_hot() {
            literals[value / 64] &= !(1 << (value % 64));
        }
    }

    /// The number of inputs.
    #[must_use]
    pub fn inputs(self) -> usize {
        self.inputs
    }

    /// The number of outputs.
    #[must_use]
    pub fn outputs(self) -> usize {
        self.outputs
    }

    /// The number of words of one product.
    pub(super) fn stride(self) -> usize {
        self.literal_words() + self.wo
    }

    /// The number of words of its literals.
    pub(super) fn literal_words(self) -> usize {
        2 * self.wi
    }

    /// The number of words of one polarity.
    pub(super) fn input_words(self) -> usize {
        self.wi
    }

    pub(super) fn literals_of(self, term: &[u64]) -> &[u64] {
        &term[..self.literal_words()]
    }

    pub(super) fn outputs_of(self, term: &[u64]) -> &[u64] {
        &term[self.literal_words()..]
    }

    /// The literal of an input.
    #[must_use]
    pub fn literal(self, term: &[u64], input: usize) -> Option<bool> {
        let (word, bit) = (input / 64, input % 64);
        match (term[word] >> bit & 1, term[self.wi + word] >> bit & 1) {
            (0, 0) => None,
            (0, _) => Some(false),
            _ => Some(true),
        }
    }

    /// Sets or removes a literal.
    pub fn set_literal(self, term: &mut [u64], input: usize, literal: Option<bool>) {
        let (word, bit) = (input / 64, 1 << (input % 64));
        term[word] &= !bit;
        term[self.wi + word] &= !bit;
        match literal {
            Some(true) => term[word] |= bit,
            Some(false) => term[self.wi + word] |= bit,
            None => {}
        }
    }

    /// True if the product belongs to this output.
    #[must_use]
    pub fn has_output(self, term: &[u64], output: usize) -> bool {
        term[self.literal_words() + output / 64] >> (output % 64) & 1 == 1
    }

    /// Adds an output to the product.
    pub fn add_output(self, term: &mut [u64], output: usize) {
        term[self.literal_words() + output / 64] |= 1 << (output % 64);
    }

    /// Removes an output from the product.
    pub fn remove_output(self, term: &mut [u64], output: usize) {
        term[self.literal_words() + output / 64] &= !(1 << (output % 64));
    }

    /// The number of literals.
    #[must_use]
    pub fn n_literals(self, term: &[u64]) -> usize {
        ones(self.literals_of(term))
    }

    /// The number of outputs.
    #[must_use]
    pub fn n_outputs(self, term: &[u64]) -> usize {
        ones(self.outputs_of(term))
    }

    /// True if both products belong to this output and have a common point.
    #[must_use]
    pub fn meet(self, a: &[u64], b: &[u64], output: usize) -> bool {
        self.has_output(a, output) && self.has_output(b, output) && !self.conflict(a, b)
    }

    /// True if the products have no common point.
    pub(super) fn conflict(self, a: &[u64], b: &[u64]) -> bool {
        (0..self.wi).any(|k| a[k] & b[self.wi + k] | a[self.wi + k] & b[k] != 0)
    }

    /// A product without the one literal that separates it from another; `None` if there are two such literals.
    pub(super) fn without_conflict(self, a: &[u64], b: &[u64]) -> Option<Vec<u64>> {
        let mut term = a.to_vec();
        let mut n = 0;
        for k in 0..self.wi {
            let apart = a[k] & b[self.wi + k] | a[self.wi + k] & b[k];
            n += apart.count_ones();
            term[k] &= !apart;
            term[self.wi + k] &= !apart;
        }
        (n <= 1).then_some(term)
    }

    /// True if both products belong to a common output.
    pub(super) fn share_output(self, a: &[u64], b: &[u64]) -> bool {
        self.outputs_of(a).iter().zip(self.outputs_of(b)).any(|(a, b)| a & b != 0)
    }

    /// True if `a` contains `b`: fewer literals, more outputs.
    pub(super) fn contains(self, a: &[u64], b: &[u64]) -> bool {
        subset(self.literals_of(a), self.literals_of(b))
            && subset(self.outputs_of(b), self.outputs_of(a))
    }

    /// Makes `a` the smallest product that contains both.
    pub(super) fn join(self, a: &mut [u64], b: &[u64]) {
        let literals = self.literal_words();
        for k in 0..literals {
            a[k] &= b[k];
        }
        for k in literals..self.stride() {
            a[k] |= b[k];
        }
    }

    /// The product without literals and without outputs.
    pub(super) fn empty(self) -> Vec<u64> {
        vec![0; self.stride()]
    }
}

pub(super) fn ones(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

pub(super) fn subset(a: &[u64], b: &[u64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a & !b == 0)
}

/// The positions of the set bits.
pub(super) fn bits(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    words.iter().enumerate().flat_map(|(index, &word)| {
        let mut rest = word;
        std::iter::from_fn(move || {
            (rest != 0).then(|| {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                index * 64 + bit
            })
        })
    })
}

/// A list of products of one shape.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terms {
    /// The shape of each product.
    pub shape: Shape,
    data: Vec<u64>,
    n: usize,
}

impl Terms {
    /// An empty list.
    #[must_use]
    pub fn new(shape: Shape) -> Self {
        Terms { shape, data: Vec::new(), n: 0 }
    }

    /// The number of products.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// True if the list is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// A product.
    #[must_use]
    pub fn get(&self, index: usize) -> &[u64] {
        let stride = self.shape.stride();
        &self.data[index * stride..(index + 1) * stride]
    }

    pub(super) fn get_mut(&mut self, index: usize) -> &mut [u64] {
        let stride = self.shape.stride();
        &mut self.data[index * stride..(index + 1) * stride]
    }

    /// All products, in order.
    pub fn iter(&self) -> impl Iterator<Item = &[u64]> {
        (0..self.n).map(|index| self.get(index))
    }

    pub(super) fn push(&mut self, term: &[u64]) {
        self.data.extend_from_slice(term);
        self.n += 1;
    }

    /// Adds the product of these literals for these outputs.
    pub fn add(
        &mut self,
        literals: impl IntoIterator<Item = (usize, bool)>,
        outputs: impl IntoIterator<Item = usize>,
    ) {
        let mut term = self.shape.empty();
        literals
            .into_iter()
            .for_each(|(input, value)| self.shape.set_literal(&mut term, input, Some(value)));
        outputs.into_iter().for_each(|output| self.shape.add_output(&mut term, output));
        self.push(&term);
    }

    pub(super) fn extend(&mut self, other: &Terms) {
        self.data.extend_from_slice(&other.data);
        self.n += other.n;
    }

    /// The number of literals of all products.
    #[must_use]
    pub fn n_literals(&self) -> usize {
        self.iter().map(|term| self.shape.n_literals(term)).sum()
    }

    /// Keeps the products for which `keep` returns true.
    pub(super) fn retain(&mut self, mut keep: impl FnMut(usize, &[u64]) -> bool) {
        let mut kept = Terms::new(self.shape);
        for (index, term) in self.iter().enumerate() {
            if keep(index, term) {
                kept.push(term);
            }
        }
        *self = kept;
    }

    /// The products with these indices, in this order.
    pub(super) fn select(&self, order: impl IntoIterator<Item = usize>) -> Terms {
        let mut selected = Terms::new(self.shape);
        order.into_iter().for_each(|index| selected.push(self.get(index)));
        selected
    }

    /// The products of one output, as products with a single output.
    #[must_use]
    pub fn of_output(&self, output: usize) -> Terms {
        let shape = self.shape;
        let words = shape.literal_words();
        let mut own = Terms::new(Shape { outputs: 1, wo: 1, ..shape });
        for term in self.iter().filter(|term| shape.has_output(term, output)) {
            let mut single = own.shape.empty();
            single[..words].copy_from_slice(&term[..words]);
            own.shape.add_output(&mut single, 0);
            own.push(&single);
        }
        own
    }

    /// Repeats each product for each of its outputs.
    pub(super) fn unwrapped(&self) -> Terms {
        let shape = self.shape;
        let words = shape.literal_words();
        let mut single = Terms::new(shape);
        for term in self.iter() {
            for output in bits(shape.outputs_of(term)) {
                let mut own = shape.empty();
                own[..words].copy_from_slice(&term[..words]);
                shape.add_output(&mut own, output);
                single.push(&own);
            }
        }
        single
    }

    /// Drops products that another one contains; of equal ones the first is kept.
    pub(super) fn absorb(&mut self) {
        let mut order: Vec<usize> = (0..self.n).collect();
        let size = |index: &usize| {
            let term = self.get(*index);
            (self.shape.n_literals(term), std::cmp::Reverse(self.shape.n_outputs(term)))
        };
        order.sort_by_key(size);
        let mut kept: Vec<usize> = Vec::new();
        for index in order {
            let term = self.get(index);
            if !kept.iter().any(|&other| self.shape.contains(self.get(other), term)) {
                kept.push(index);
            }
        }
        kept.sort_unstable();
        *self = self.select(kept);
    }

    /// Sorts the products in the usual order: by literals from the first input on, positive before negative before absent.
    pub(super) fn sort(&mut self) {
        let rank = |term: &[u64], input: usize| match self.shape.literal(term, input) {
            Some(true) => 0,
            Some(false) => 1,
            None => 2,
        };
        let mut order: Vec<usize> = (0..self.n).collect();
        order.sort_by(|&a, &b| {
            let (a, b) = (self.get(a), self.get(b));
            (0..self.shape.inputs)
                .map(|input| rank(a, input).cmp(&rank(b, input)))
                .find(|order| order.is_ne())
                .unwrap_or_else(|| self.shape.outputs_of(b).cmp(self.shape.outputs_of(a)))
        });
        *self = self.select(order);
    }
}

/// The steps of a query ran out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Spent;

/// The state of the recursion over the products of one output within one region.
pub(super) struct Recursion<'a> {
    terms: &'a Terms,
    /// Steps left.
    pub(super) steps: u64,
}

/// The products that are relevant in a part of a region, as a range of a shared stack.
type Part = Range<usize>;

impl<'a> Recursion<'a> {
    pub(super) fn new(terms: &'a Terms, steps: u64) -> Self {
        Recursion { terms, steps }
    }

    fn literals(&self, index: u32) -> &'a [u64] {
        self.terms.shape.literals_of(self.terms.get(index as usize))
    }

    fn spend(&mut self, n: usize) -> Result<(), Spent> {
        let cost = n as u64 + 1;
        if self.steps < cost {
            self.steps = 0;
            return Err(Spent);
        }
        self.steps -= cost;
        Ok(())
    }

    /// The products that intersect a product in some output, except those that `skip` selects: for [`Recursion::of_output`].
    pub(super) fn meeting(&self, term: &[u64], skip: impl Fn(usize) -> bool) -> Vec<u32> {
        let shape = self.terms.shape;
        (0u32..)
            .zip(self.terms.data.chunks_exact(shape.stride().max(1)))
            .filter(|(index, other)| {
                !shape.conflict(other, term)
                    && shape.share_output(other, term)
                    && !skip(*index as usize)
            })
            .map(|(index, _)| index)
            .collect()
    }

    /// The products of a list that have this output.
    pub(super) fn of_output(&self, list: &[u32], output: usize) -> Vec<u32> {
        let shape = self.terms.shape;
        list.iter()
            .copied()
            .filter(|index| shape.has_output(self.terms.get(*index as usize), output))
            .collect()
    }

    /// The products of a list that intersect a region.
    pub(super) fn within(&self, list: &[u32], region: &[u64]) -> Vec<u32> {
        let shape = self.terms.shape;
        list.iter()
            .copied()
            .filter(|index| !shape.conflict(self.literals(*index), region))
            .collect()
    }

    /// True if these products together cover all of a region. Otherwise, if a witness is wanted, adds to `region` the literals of an uncovered part.
    pub(super) fn covers(&mut self, list: Vec<u32>, region: &mut Vec<u64>) -> Result<bool, Spent> {
        let mut stack = list;
        let part = 0..stack.len();
        self.covers_part(&mut stack, part, region)
    }

    fn covers_part(
        &mut self,
        stack: &mut Vec<u32>,
        part: Part,
        region: &mut Vec<u64>,
    ) -> Result<bool, Spent> {
        self.spend(part.len())?;
        let words = self.terms.shape.literal_words();
        let before = stack.len();
        if stack[part.clone()].iter().any(|&term| subset(self.literals(term), &region[..words])) {
            return Ok(true);
        }
        stack.extend_from_within(part);
        let start = self.drop_unate(stack, before, region);
        if stack.len() == start {
            stack.truncate(before);
            return Ok(false);
        }
        let own = start..stack.len();
        let input = self.most_binate(&stack[own.clone()], region);
        let shape = self.terms.shape;
        let saved = region.clone();
        for value in [false, true] {
            region.clone_from(&saved);
            shape.set_literal(region, input, Some(value));
            let end = stack.len();
            for at in own.clone() {
                if shape.literal(self.literals(stack[at]), input) != Some(!value) {
                    stack.push(stack[at]);
                }
            }
            let child = end..stack.len();
            let covered = self.covers_part(stack, child, region);
            stack.truncate(end);
            if covered != Ok(true) {
                stack.truncate(before);
                return covered;
            }
        }
        region.clone_from(&saved);
        stack.truncate(before);
        Ok(true)
    }

    /// Moves to the corner that is hardest to cover: each input that occurs in only one polarity gets the opposite value, and the products with that input are
    /// removed. The products from `start` on are filtered in place.
    fn drop_unate(&self, stack: &mut Vec<u32>, start: usize, region: &mut [u64]) -> usize {
        let wi = self.terms.shape.input_words();
        let mut both = vec![0u64; 2 * wi];
        loop {
            both.fill(0);
            for &term in &stack[start..] {
                for (sum, literal) in both.iter_mut().zip(self.literals(term)) {
                    *sum |= literal;
                }
            }
            let mut any = false;
            for k in 0..wi {
                let (pos, neg) = (both[k] & !region[k], both[wi + k] & !region[wi + k]);
                let (only_pos, only_neg) = (pos & !neg, neg & !pos);
                any |= only_pos | only_neg != 0;
                (both[k], both[wi + k]) = (only_pos, only_neg);
                region[k] |= only_neg;
                region[wi + k] |= only_pos;
            }
            if !any {
                return start;
            }
            let mut kept = start;
            for at in start..stack.len() {
                let term = stack[at];
                if self
                    .literals(term)
                    .iter()
                    .zip(&both)
                    .all(|(literal, unate)| literal & unate == 0)
                {
                    stack[kept] = term;
                    kept += 1;
                }
            }
            stack.truncate(kept);
        }
    }

    /// The input outside the region's literals that occurs in the most products.
    fn most_binate(&self, list: &[u32], region: &[u64]) -> usize {
        let shape = self.terms.shape;
        let wi = shape.input_words();
        let mut counts = vec![[0u32; 2]; shape.inputs()];
        for &term in list {
            let literals = self.literals(term);
            for k in 0..wi {
                let known = region[k] | region[wi + k];
                for (polarity, word) in [literals[k], literals[wi + k]].into_iter().enumerate() {
                    bits(&[word & !known]).for_each(|bit| counts[k * 64 + bit][polarity] += 1);
                }
            }
        }
        let best = (0..counts.len()).max_by_key(|&input| {
            let [a, b] = counts[input];
            (a.min(b) > 0, a + b, a.min(b), std::cmp::Reverse(input))
        });
        best.unwrap_or(0)
    }

    /// The literals of the smallest product that contains the part of a region that these products do not cover; `None` if they cover it all.
    pub(super) fn hull_of_rest(
        &mut self,
        list: Vec<u32>,
        region: &[u64],
    ) -> Result<Option<Vec<u64>>, Spent> {
        let words = self.terms.shape.literal_words();
        let mut hull = None;
        let mut stack = list;
        let part = 0..stack.len();
        self.rest(&mut stack, part, &region[..words], &mut hull)?;
        Ok(hull)
    }

    /// Adds the uncovered rest of a region to the hull.
    fn rest(
        &mut self,
        stack: &mut Vec<u32>,
        part: Part,
        region: &[u64],
        hull: &mut Option<Vec<u64>>,
    ) -> Result<(), Spent> {
        // A region inside the hull adds nothing.
        if hull.as_ref().is_some_and(|hull| subset(hull, region)) {
            return Ok(());
        }
        self.spend(part.len())?;
        if stack[part.clone()].iter().any(|&term| subset(self.literals(term), region)) {
            return Ok(());
        }
        let shape = self.terms.shape;
        let wi = shape.input_words();
        let mut both = vec![0u64; 2 * wi];
        for &term in &stack[part.clone()] {
            for (sum, literal) in both.iter_mut().zip(self.literals(term)) {
                *sum |= literal;
            }
        }
        let is_unate = (0..wi).all(|k| both[k] & both[wi + k] & !(region[k] | region[wi + k]) == 0);
        if is_unate {
            // The uncovered part of a unate sum touches both sides of each input, except if one literal alone is a product.
            let mut rest = region.to_vec();
            for &term in &stack[part] {
                let free = |k: usize| self.literals(term)[k] & !region[k];
                if (0..2 * wi).map(|k| free(k).count_ones()).sum::<u32>() == 1 {
                    for k in 0..wi {
                        rest[k] |= free(wi + k);
                        rest[wi + k] |= free(k);
                    }
                }
            }
            match hull {
                Some(hull) => hull.iter_mut().zip(&rest).for_each(|(hull, rest)| *hull &= rest),
                None => *hull = Some(rest),
            }
            return Ok(());
        }
        let input = self.most_binate(&stack[part.clone()], region);
        for value in [false, true] {
            let mut half = region.to_vec();
            shape.set_literal(&mut half, input, Some(value));
            let end = stack.len();
            for at in part.clone() {
                if shape.literal(self.literals(stack[at]), input) != Some(!value) {
                    stack.push(stack[at]);
                }
            }
            let child = end..stack.len();
            let done = self.rest(stack, child, &half, hull);
            stack.truncate(end);
            done?;
        }
        Ok(())
    }

    /// Which columns (the products below `n_columns`) can cover the points of a region: one set of columns for each kind of point that no other kind makes
    /// superfluous. Points that the other products cover need no column. Adds the sets to `rows`.
    pub(super) fn rows(
        &mut self,
        list: Vec<u32>,
        region: &[u64],
        n_columns: usize,
        rows: &mut Rows,
    ) -> Result<(), Spent> {
        let words = self.terms.shape.literal_words();
        let mut stack = list;
        let part = 0..stack.len();
        self.rows_part(&mut stack, part, &region[..words], n_columns, &mut Vec::new(), rows)
    }

    fn rows_part(
        &mut self,
        stack: &mut Vec<u32>,
        part: Part,
        region: &[u64],
        n_columns: usize,
        whole: &mut Vec<u32>,
        rows: &mut Rows,
    ) -> Result<(), Spent> {
        self.spend(part.len())?;
        if rows.is_full() {
            // Further sets would be searched but not stored.
            return Err(Spent);
        }
        let (before, n_whole) = (stack.len(), whole.len());
        let mut is_covered = false;
        for at in part {
            let term = stack[at];
            if subset(self.literals(term), region) {
                is_covered |= term as usize >= n_columns;
                whole.push(term);
            } else {
                stack.push(term);
            }
        }
        let outcome = if is_covered {
            Ok(())
        } else {
            let (is_known, looks) = rows.has_subset_of(whole);
            match self.spend(looks) {
                Ok(()) if is_known => Ok(()),
                Ok(()) => self.rows_split(stack, before, region, n_columns, whole, rows),
                Err(spent) => Err(spent),
            }
        };
        stack.truncate(before);
        whole.truncate(n_whole);
        outcome
    }

    fn rows_split(
        &mut self,
        stack: &mut Vec<u32>,
        before: usize,
        region: &[u64],
        n_columns: usize,
        whole: &mut Vec<u32>,
        rows: &mut Rows,
    ) -> Result<(), Spent> {
        let mut corner = region.to_vec();
        self.drop_unate(stack, before, &mut corner);
        if stack.len() == before {
            rows.add(whole);
            return Ok(());
        }
        let shape = self.terms.shape;
        let own = before..stack.len();
        let input = self.most_binate(&stack[own.clone()], &corner);
        for value in [false, true] {
            let mut half = corner.clone();
            shape.set_literal(&mut half, input, Some(value));
            let end = stack.len();
            for at in own.clone() {
                if shape.literal(self.literals(stack[at]), input) != Some(!value) {
                    stack.push(stack[at]);
                }
            }
            let child = end..stack.len();
            let done = self.rows_part(stack, child, &half, n_columns, whole, rows);
            stack.truncate(end);
            done?;
        }
        Ok(())
    }
}
