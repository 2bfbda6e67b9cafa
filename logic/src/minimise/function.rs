//! Several incompletely specified functions of the same inputs: the problem that a minimiser solves.

use super::terms::{Shape, Terms};
use super::{Refused, isop};
use crate::bdd::{Bdd, Full, Ref};
use crate::cover::Cover;
use std::collections::BTreeMap;

/// Functions with don't-cares, each between a lower and an upper bound, as diagrams over one input order.
#[derive(Debug, Clone)]
pub struct Function {
    pub(super) shape: Shape,
    pub(super) bdd: Bdd,
    /// The lower bound of each output: the points that a sum must cover.
    pub(super) lower: Vec<Ref>,
    /// The upper bound of each output: the points that a sum may cover.
    pub(super) upper: Vec<Ref>,
    /// The input at each level.
    pub(super) input_of: Vec<usize>,
    level_of: Vec<u32>,
    /// An initial sum; empty if none is known.
    pub(super) start: Terms,
    overlapping: Vec<usize>,
    contradictory: Vec<usize>,
}

impl Function {
    /// Creates functions from sums: true on `on`, free on `dc` (also if both apply), false elsewhere. If `off` is given, the function is false there and free
    /// elsewhere.
    ///
    /// # Errors
    /// If the diagrams need more than `nodes` nodes, or there are more than [`super::MAX_VARIABLES`] inputs.
    pub fn new(on: &Terms, dc: &Terms, off: Option<&Terms>, nodes: usize) -> Result<Self, Refused> {
        let shape = on.shape;
        if shape.inputs() > super::MAX_VARIABLES {
            return Err(Refused::Variables(super::MAX_VARIABLES));
        }
        let as_written: Vec<usize> = (0..shape.inputs()).collect();
        let as_used = order_of_use(on, off);
        // With few inputs the order matters little.
        if shape.inputs() <= 10 || as_used == as_written {
            return Self::in_order(on, dc, off, nodes, as_written);
        }
        // A good order succeeds early; a bad one would use up any limit.
        let mut limit = nodes.min(1 << 14);
        loop {
            let first = Self::in_order(on, dc, off, limit, as_written.clone());
            let rest = first.as_ref().map_or(limit, |first| first.bdd.len());
            let second = Self::in_order(on, dc, off, rest, as_used.clone());
            let function = match (first, second) {
                (_, Ok(function)) | (Ok(function), Err(_)) => function,
                (Err(_), Err(_)) if limit < nodes => {
                    limit = limit.saturating_mul(8).min(nodes);
                    continue;
                }
                (Err(refused), Err(_)) => return Err(refused),
            };
            // Build again with room for the following work.
            return Self::in_order(on, dc, off, nodes, function.input_of);
        }
    }

    fn in_order(
        on: &Terms,
        dc: &Terms,
        off: Option<&Terms>,
        nodes: usize,
        input_of: Vec<usize>,
    ) -> Result<Self, Refused> {
        let shape = on.shape;
        let mut level_of = vec![0; input_of.len()];
        for (level, input) in (0u32..).zip(&input_of) {
            level_of[*input] = level;
        }
        let mut function = Function {
            shape,
            bdd: Bdd::with_limit(nodes),
            lower: Vec::new(),
            upper: Vec::new(),
            input_of,
            level_of,
            start: on.clone(),
            overlapping: Vec::new(),
            contradictory: Vec::new(),
        };
        for output in 0..shape.outputs() {
            let on = function.sum(on, output)?;
            let dc = function.sum(dc, output)?;
            let bdd = &mut function.bdd;
            let lower = bdd.and_not(on, dc)?;
            if lower != on {
                function.overlapping.push(output);
            }
            let said = bdd.or(on, dc)?;
            let upper = match off {
                None => said,
                Some(off) => {
                    let off = function.sum(off, output)?;
                    if function.bdd.and(said, off)? != Ref::FALSE {
                        function.contradictory.push(output);
                    }
                    function.bdd.not(off)?
                }
            };
            // If the sums contradict each other, `off` wins, so that the bounds stay in order.
            let lower = function.bdd.and(lower, upper)?;
            function.lower.push(lower);
            function.upper.push(upper);
        }
        Ok(function)
    }

    /// One function of a manager between `lower` and `upper`, with an initial sum.
    pub(super) fn of_diagram(bdd: &Bdd, lower: Ref, upper: Ref, sum: &Cover) -> Self {
        let shape = Shape::new(sum.n_vars, 1);
        let mut start = Terms::new(shape);
        sum.cubes.iter().for_each(|cube| start.add(cube.literals(), [0]));
        Function {
            shape,
            bdd: bdd.clone(),
            lower: vec![lower],
            upper: vec![upper],
            input_of: (0..sum.n_vars).collect(),
            level_of: (0u32..).take(sum.n_vars).collect(),
            start,
            overlapping: Vec::new(),
            contradictory: Vec::new(),
        }
    }

    /// One output, or its complement, as a separate function.
    pub(super) fn single(&self, output: usize, is_complemented: bool) -> Result<Self, Refused> {
        let mut bdd = self.bdd.clone();
        let (mut lower, mut upper) = (self.lower[output], self.upper[output]);
        if is_complemented {
            (lower, upper) = (bdd.not(upper)?, bdd.not(lower)?);
        }
        let shape = Shape::new(self.shape.inputs(), 1);
        let mut start = Terms::new(shape);
        if !is_complemented {
            for term in self.start.iter().filter(|term| self.shape.has_output(term, output)) {
                let mut own = shape.empty();
                let words = shape.literal_words();
                own[..words].copy_from_slice(&term[..words]);
                shape.add_output(&mut own, 0);
                start.push(&own);
            }
        }
        Ok(Function {
            shape,
            bdd,
            lower: vec![lower],
            upper: vec![upper],
            input_of: self.input_of.clone(),
            level_of: self.level_of.clone(),
            start,
            overlapping: Vec::new(),
            contradictory: Vec::new(),
        })
    }

    /// The outputs for which some point was listed both as on and as free.
    #[must_use]
    pub fn overlapping(&self) -> &[usize] {
        &self.overlapping
    }

    /// The outputs for which some point was listed as off and also as on or free.
    #[must_use]
    pub fn contradictory(&self) -> &[usize] {
        &self.contradictory
    }

    /// The same functions with the marked outputs complemented.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn complemented(&self, is_complemented: &[bool]) -> Result<Self, Refused> {
        let mut function = self.clone();
        let mut is_changed = false;
        for (output, _) in is_complemented.iter().enumerate().filter(|(_, marked)| **marked) {
            is_changed = true;
            let (lower, upper) = (self.lower[output], self.upper[output]);
            function.lower[output] = function.bdd.not(upper)?;
            function.upper[output] = function.bdd.not(lower)?;
        }
        if is_changed {
            function.start = Terms::new(self.shape);
        }
        Ok(function)
    }

    /// The numbers of inputs and outputs.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The literals of a product as a diagram.
    pub(super) fn product(&mut self, term: &[u64]) -> Result<Ref, Full> {
        let mut value = Ref::TRUE;
        for &input in self.input_of.iter().rev() {
            let level = self.level_of[input];
            value = match self.shape.literal(term, input) {
                None => value,
                Some(true) => self.bdd.node(level, Ref::FALSE, value)?,
                Some(false) => self.bdd.node(level, value, Ref::FALSE)?,
            };
        }
        Ok(value)
    }

    /// The sum of an output as a diagram.
    pub(super) fn sum(&mut self, terms: &Terms, output: usize) -> Result<Ref, Full> {
        let mut products = Vec::new();
        for term in terms.iter().filter(|term| terms.shape.has_output(term, output)) {
            products.push(self.product(term)?);
        }
        self.bdd.or_all(products)
    }

    /// An irredundant sum for each output between two functions, with equal products shared; `None` beyond `limit` products.
    pub(super) fn sums(
        &mut self,
        bounds: &[(Ref, Ref)],
        limit: usize,
    ) -> Result<Option<Terms>, Refused> {
        let words = self.shape.literal_words();
        let mut joined: BTreeMap<Vec<u64>, Vec<u64>> = BTreeMap::new();
        for (output, &(lower, upper)) in bounds.iter().enumerate() {
            let cover = match isop(&mut self.bdd, lower, upper, self.input_of.len(), limit) {
                Ok(cover) => cover,
                Err(Refused::Products(_)) => return Ok(None),
                Err(refused @ (Refused::Nodes(_) | Refused::Variables(_))) => return Err(refused),
            };
            for cube in &cover.cubes {
                let mut term = self.shape.empty();
                for (level, value) in cube.literals() {
                    self.shape.set_literal(&mut term, self.input_of[level], Some(value));
                }
                let whole = joined.entry(term[..words].to_vec()).or_insert_with(|| term.clone());
                self.shape.add_output(whole, output);
            }
            if joined.len() > limit {
                return Ok(None);
            }
        }
        let mut terms = Terms::new(self.shape);
        joined.values().for_each(|term| terms.push(term));
        Ok(Some(terms))
    }

    /// Products that cover the free part of each output.
    pub(super) fn free(&mut self, limit: usize) -> Result<Option<Terms>, Refused> {
        let mut bounds = Vec::new();
        for output in 0..self.shape.outputs() {
            let free = self.bdd.and_not(self.upper[output], self.lower[output])?;
            bounds.push((free, free));
        }
        self.sums(&bounds, limit)
    }

    /// Products that cover the forbidden part of each output.
    pub(super) fn forbidden(&mut self, limit: usize) -> Result<Option<Terms>, Refused> {
        let mut bounds = Vec::new();
        for output in 0..self.shape.outputs() {
            let off = self.bdd.not(self.upper[output])?;
            bounds.push((off, off));
        }
        self.sums(&bounds, limit)
    }

    /// True if a product is within the upper bound of each of its outputs.
    pub(super) fn allows(&self, term: &[u64]) -> bool {
        let mut pairs: Vec<(u32, bool)> = Vec::new();
        for (level, &input) in (0u32..).zip(&self.input_of) {
            if let Some(value) = self.shape.literal(term, input) {
                pairs.push((level, value));
            }
        }
        (0..self.shape.outputs())
            .filter(|output| self.shape.has_output(term, *output))
            .all(|output| self.bdd.covers_cube(self.upper[output], &pairs))
    }

    /// The outputs whose sum is wrong: it covers too little or too much. Empty if the sum is correct.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn wrong_outputs(&mut self, terms: &Terms) -> Result<Vec<usize>, Refused> {
        let mut wrong = Vec::new();
        for output in 0..self.shape.outputs() {
            let value = self.sum(terms, output)?;
            let missing = self.bdd.and_not(self.lower[output], value)?;
            let excess = self.bdd.and_not(value, self.upper[output])?;
            if missing != Ref::FALSE || excess != Ref::FALSE {
                wrong.push(output);
            }
        }
        Ok(wrong)
    }
}

/// The inputs in the order of their first use in the products, so that inputs used together are neighbours.
fn order_of_use(on: &Terms, off: Option<&Terms>) -> Vec<usize> {
    let shape = on.shape;
    let mut order = Vec::new();
    let mut is_known = vec![false; shape.inputs()];
    for term in on.iter().chain(off.iter().flat_map(|off| off.iter())) {
        for (input, is_known) in is_known.iter_mut().enumerate() {
            if !*is_known && shape.literal(term, input).is_some() {
                *is_known = true;
                order.push(input);
            }
        }
    }
    order.extend((0..shape.inputs()).filter(|input| !is_known[*input]));
    order
}
