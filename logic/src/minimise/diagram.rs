//! Sums of products from diagrams: Minato's irredundant sum [Minato 1992, Morreale 1970], and a loop that expands, removes and reduces products on
//! diagrams.
//!
//! Neither needs a list of forbidden products, so they also handle functions whose complement has too many products.

use super::Refused;
use crate::bdd::{Bdd, Ref};
use crate::cover::{Cover, Cube};
use grafsynth_ir::ranks::sort_by_rank;

/// An irredundant sum of products between `lower` and `upper`.
///
/// # Errors
/// If the diagram or the sum exceeds its limit.
pub fn isop(
    bdd: &mut Bdd,
    lower: Ref,
    upper: Ref,
    n_vars: usize,
    max_products: usize,
) -> Result<Cover, Refused> {
    let mut search = Isop { bdd, n_vars, max_products, path: Vec::new(), cubes: Vec::new() };
    search.run(lower, upper)?;
    Ok(Cover { n_vars, cubes: search.cubes })
}

struct Isop<'a> {
    bdd: &'a mut Bdd,
    n_vars: usize,
    max_products: usize,
    path: Vec<(usize, bool)>,
    cubes: Vec<Cube>,
}

impl Isop<'_> {
    /// Adds products that cover `lower` within `upper`, and returns their sum. The recursion depth is the number of variables.
    fn run(&mut self, lower: Ref, upper: Ref) -> Result<Ref, Refused> {
        if lower == Ref::FALSE {
            return Ok(Ref::FALSE);
        }
        if upper == Ref::TRUE {
            if self.cubes.len() >= self.max_products {
                return Err(Refused::Products(self.max_products / 2));
            }
            self.cubes.push(Cube::of(self.n_vars, self.path.iter().copied()));
            return Ok(Ref::TRUE);
        }
        let (top_lower, top_upper) = (self.bdd.level(lower), self.bdd.level(upper));
        let Some(level) = top_lower.into_iter().chain(top_upper).min() else {
            return Ok(Ref::TRUE);
        };
        let half =
            |bdd: &Bdd, f: Ref| if bdd.level(f) == Some(level) { bdd.branches(f) } else { (f, f) };
        let (lower0, lower1) = half(self.bdd, lower);
        let (upper0, upper1) = half(self.bdd, upper);
        // The parts that only the negative or only the positive literal can cover.
        let only0 = self.bdd.and_not(lower0, upper1)?;
        let only1 = self.bdd.and_not(lower1, upper0)?;
        self.path.push((level as usize, false));
        let sum0 = self.run(only0, upper0)?;
        self.path.pop();
        self.path.push((level as usize, true));
        let sum1 = self.run(only1, upper1)?;
        self.path.pop();
        // The rest is covered without this variable.
        let left0 = self.bdd.and_not(lower0, sum0)?;
        let left1 = self.bdd.and_not(lower1, sum1)?;
        let left = self.bdd.or(left0, left1)?;
        let both = self.bdd.and(upper0, upper1)?;
        let sum = self.run(left, both)?;
        let (sum0, sum1) = (self.bdd.or(sum0, sum)?, self.bdd.or(sum1, sum)?);
        Ok(self.bdd.node(level, sum0, sum1)?)
    }
}

/// Makes each product as large as `upper` allows and drops products that another one contains. Literals that few products share are removed first.
pub(super) fn expand(bdd: &Bdd, upper: Ref, cover: &mut Cover) {
    let mut uses = vec![0usize; cover.n_vars * 2];
    let slot = |(var, value): (usize, bool)| var * 2 + usize::from(value);
    for cube in &cover.cubes {
        cube.literals().for_each(|literal| uses[slot(literal)] += 1);
    }
    let mut cubes = std::mem::take(&mut cover.cubes);
    sort_by_rank(&mut cubes, |cube| [!(cube.n_literals() as u64)]);
    let mut grown: Vec<Cube> = Vec::with_capacity(cubes.len());
    for mut cube in cubes {
        if grown.iter().any(|other| other.contains(&cube)) {
            continue;
        }
        let mut literals: Vec<(usize, bool)> = cube.literals().collect();
        sort_by_rank(&mut literals, |&(var, value)| {
            [uses[slot((var, value))] as u64, var as u64, u64::from(value)]
        });
        for (var, value) in literals {
            cube.set(var, None);
            let pairs: Vec<(u32, bool)> = cube
                .literals()
                .map(|(var, value)| (u32::try_from(var).unwrap_or(u32::MAX), value))
                .collect();
            if !bdd.covers_cube(upper, &pairs) {
                cube.set(var, Some(value));
            }
        }
        grown.retain(|other| !cube.contains(other));
        grown.push(cube);
    }
    cover.cubes = grown;
}

/// Drops products that the others make superfluous, those with the most literals first.
pub(super) fn irredundant(bdd: &mut Bdd, lower: Ref, cover: &mut Cover) -> Result<(), Refused> {
    let mut cubes = std::mem::take(&mut cover.cubes);
    sort_by_rank(&mut cubes, |cube| [!(cube.n_literals() as u64)]);
    let products = cubes.iter().map(|cube| cube.to_bdd(bdd)).collect::<Result<Vec<_>, _>>()?;
    let mut later = vec![Ref::FALSE; products.len() + 1];
    for index in (0..products.len()).rev() {
        later[index] = bdd.or(later[index + 1], products[index])?;
    }
    let mut kept = Ref::FALSE;
    for (index, cube) in cubes.into_iter().enumerate() {
        let others = bdd.or(kept, later[index + 1])?;
        let own = bdd.and(lower, products[index])?;
        if bdd.and_not(own, others)? != Ref::FALSE {
            kept = bdd.or(kept, products[index])?;
            cover.cubes.push(cube);
        }
    }
    Ok(())
}

/// Shrinks each product to the part that only it covers, so that the next expansion can take another direction.
pub(super) fn reduce(bdd: &mut Bdd, lower: Ref, cover: &mut Cover) -> Result<(), Refused> {
    let mut products =
        cover.cubes.iter().map(|cube| cube.to_bdd(bdd)).collect::<Result<Vec<_>, _>>()?;
    let mut later = vec![Ref::FALSE; products.len() + 1];
    for index in (0..products.len()).rev() {
        later[index] = bdd.or(later[index + 1], products[index])?;
    }
    let mut earlier = Ref::FALSE;
    for (index, cube) in cover.cubes.iter_mut().enumerate() {
        let others = bdd.or(earlier, later[index + 1])?;
        let own = bdd.and(lower, products[index])?;
        let alone = bdd.and_not(own, others)?;
        if alone != Ref::FALSE {
            for level in bdd.support(alone) {
                let var = bdd.var(level)?;
                if bdd.and(alone, var)? == Ref::FALSE {
                    cube.set(level as usize, Some(false));
                } else if bdd.and_not(alone, var)? == Ref::FALSE {
                    cube.set(level as usize, Some(true));
                }
            }
            products[index] = cube.to_bdd(bdd)?;
        }
        earlier = bdd.or(earlier, products[index])?;
    }
    Ok(())
}
