//! Covers: sums of products as sets of cubes, two bits per variable.

use crate::bdd::{Bdd, Full, Ref};
use std::cmp::Ordering;

/// A product of literals over variables `0..n`.
///
/// Each variable has one bit in `positive` and one in `negative`; if neither is set, the variable does not occur. (If both were set, the product would
/// never be true; such a product is never made.)
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cube {
    positive: Vec<u64>,
    negative: Vec<u64>,
}

impl Cube {
    /// The product without literals, which is always true, over `n_vars` variables.
    #[must_use]
    pub fn universe(n_vars: usize) -> Self {
        let words = vec![0; n_vars.div_ceil(64)];
        Cube { positive: words.clone(), negative: words }
    }

    /// The product of these literals.
    #[must_use]
    pub fn of(n_vars: usize, literals: impl IntoIterator<Item = (usize, bool)>) -> Self {
        let mut cube = Self::universe(n_vars);
        for (var, value) in literals {
            cube.set(var, Some(value));
        }
        cube
    }

    /// The literal of a variable: `Some(true)` positive, `Some(false)` negative, `None` absent.
    #[must_use]
    pub fn literal(&self, var: usize) -> Option<bool> {
        let (word, bit) = (var / 64, var % 64);
        match (self.positive[word] >> bit & 1, self.negative[word] >> bit & 1) {
            (0, 0) => None,
            (0, _) => Some(false),
            _ => Some(true),
        }
    }

    /// Sets or removes a literal.
    pub fn set(&mut self, var: usize, literal: Option<bool>) {
        let (word, bit) = (var / 64, 1 << (var % 64));
        self.positive[word] &= !bit;
        self.negative[word] &= !bit;
        match literal {
            Some(true) => self.positive[word] |= bit,
            Some(false) => self.negative[word] |= bit,
            None => {}
        }
    }

    /// The number of literals.
    #[must_use]
    pub fn n_literals(&self) -> usize {
        self.positive.iter().chain(&self.negative).map(|word| word.count_ones() as usize).sum()
    }

    /// The literals by variable.
    pub fn literals(&self) -> impl Iterator<Item = (usize, bool)> + '_ {
        (0..self.positive.len() * 64).filter_map(|var| self.literal(var).map(|value| (var, value)))
    }

    /// True if this product contains every point of `other`.
    #[must_use]
    pub fn contains(&self, other: &Cube) -> bool {
        let within = |own: &[u64], others: &[u64]| {
            own.iter().zip(others).all(|(own, other)| own & !other == 0)
        };
        within(&self.positive, &other.positive) && within(&self.negative, &other.negative)
    }

    /// The value at a point.
    pub fn eval(&self, value: impl Fn(usize) -> bool) -> bool {
        self.literals().all(|(var, literal)| value(var) == literal)
    }

    /// The product as a diagram, with variable k at level k.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn to_bdd(&self, bdd: &mut Bdd) -> Result<Ref, Full> {
        let mut literals: Vec<(usize, bool)> = self.literals().collect();
        literals.reverse();
        let mut product = Ref::TRUE;
        for (var, value) in literals {
            let level = u32::try_from(var).unwrap_or(u32::MAX - 1);
            product = if value {
                bdd.node(level, Ref::FALSE, product)?
            } else {
                bdd.node(level, product, Ref::FALSE)?
            };
        }
        Ok(product)
    }
}

/// A sum of products.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cover {
    /// The number of variables.
    pub n_vars: usize,
    /// The products; without any product the sum is never true.
    pub cubes: Vec<Cube>,
}

impl Cover {
    /// The number of literals of all products.
    #[must_use]
    pub fn n_literals(&self) -> usize {
        self.cubes.iter().map(Cube::n_literals).sum()
    }

    /// The value at a point.
    pub fn eval(&self, value: impl Fn(usize) -> bool) -> bool {
        self.cubes.iter().any(|cube| cube.eval(&value))
    }

    /// The sum as a diagram, with variable k at level k.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn to_bdd(&self, bdd: &mut Bdd) -> Result<Ref, Full> {
        let products =
            self.cubes.iter().map(|cube| cube.to_bdd(bdd)).collect::<Result<Vec<_>, _>>()?;
        bdd.or_all(products)
    }

    /// Sorts the products in the usual order: by their literals from the first variable on, positive before negative before absent.
    pub fn sort(&mut self) {
        self.cubes.sort_by(|a, b| {
            let rank = |literal: Option<bool>| match literal {
                Some(true) => 0,
                Some(false) => 1,
                None => 2,
            };
            (0..self.n_vars)
                .map(|var| rank(a.literal(var)).cmp(&rank(b.literal(var))))
                .find(|order| *order != Ordering::Equal)
                .unwrap_or(Ordering::Equal)
        });
    }
}
