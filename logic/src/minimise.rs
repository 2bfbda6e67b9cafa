//! Two-level minimisation for programmable arrays: one output at a time, for a PAL shares no product between outputs.
//!
//! ```text
//! diagram ─ isop ─► irredundant sum ─ expand, irredundant, reduce … ─► smaller sum ─ checked against the diagram
//! ```
//! [`isop`] is Minato's irredundant sum of products [Minato 1992, Morreale 1970]; the loop after it is that of espresso (Brayton, Hachtel, McMullen and Sangiovanni-Vincentelli 1984), on diagrams instead of
//! unate recursion, and stops when a round saves nothing. The result is a local minimum, not an exact one. Don't-cares are part of the question: the
//! result lies anywhere between a lower and an upper function. Whatever the loop does, the result is compared with both before it is returned.

use crate::bdd::{Bdd, Full, Ref};
use crate::build::for_each_operand;
use crate::cover::{Cover, Cube};
use crate::support::{Functions, Var};
use grafsynth_ir::logic::{Logic, Node, NodeId};

/// What a question may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// The largest number of products of interest.
    pub products: usize,
    /// The largest diagram, in nodes.
    pub nodes: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Budget { products: 512, nodes: 1 << 17 }
    }
}

/// Why there is no sum of products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// The diagram of the function is too large.
    Nodes(usize),
    /// The sum needs more products than the budget has.
    Products(usize),
    /// The function has too many variables.
    Variables(usize),
}

impl From<Full> for Refused {
    fn from(full: Full) -> Self {
        Refused::Nodes(full.limit)
    }
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Refused::Nodes(limit) => write!(f, "its decision diagram has more than {limit} nodes"),
            Refused::Products(limit) => write!(f, "it needs more than {limit} product terms"),
            Refused::Variables(limit) => write!(f, "it depends on more than {limit} signals"),
        }
    }
}

/// Functions of more variables are refused: [`isop`] recurses once for each.
pub const MAX_VARIABLES: usize = 1024;

/// Products of literals of a circuit.
pub type Product = Vec<(Var, bool)>;

/// The function of a node as a small sum of products, each sorted by variable, flip-flops first.
///
/// With `dont_cares` the result may differ from the node where one of [`Logic::never`] is true.
///
/// # Errors
/// When the budget does not suffice.
pub fn sum_of_products(
    logic: &Logic,
    node: NodeId,
    negated: bool,
    dont_cares: bool,
    budget: Budget,
) -> Result<Vec<Product>, Refused> {
    // Variables in the order of the circuit, flip-flops first: products come out as people write them.
    let vars = vars_of(logic, node);
    sum_of_products_over(logic, node, &vars, negated, dont_cares, budget)
}

/// The variables below a node, flip-flops first.
fn vars_of(logic: &Logic, node: NodeId) -> Vec<Var> {
    let mut open = vec![node];
    let mut seen = std::collections::BTreeSet::new();
    let mut vars = Vec::new();
    while let Some(next) = open.pop() {
        if seen.insert(next) {
            match &logic.nodes[next] {
                Node::Input(input) => vars.push(Var::Input(*input)),
                Node::Flop(flop) => vars.push(Var::Flop(*flop)),
                node @ (Node::Const(_)
                | Node::Not(_)
                | Node::And(_)
                | Node::Or(_)
                | Node::Xor(..)
                | Node::Mux(..)) => {
                    for_each_operand(node, |operand| open.push(operand));
                }
            }
        }
    }
    vars.sort_unstable();
    vars.dedup();
    vars
}

fn sum_of_products_over(
    logic: &Logic,
    node: NodeId,
    vars: &[Var],
    negated: bool,
    dont_cares: bool,
    budget: Budget,
) -> Result<Vec<Product>, Refused> {
    let mut bdd = Bdd::with_limit(budget.nodes);
    let mut functions = Functions::new();
    for &var in vars {
        functions.level(var);
    }
    let value = functions.build(&mut bdd, logic, node)?;
    let on = if negated { bdd.not(value)? } else { value };
    let (mut lower, mut upper) = (on, on);
    if dont_cares {
        for &never in &logic.never {
            // A constraint over other signals cannot make this function smaller.
            let never_node = functions.build(&mut bdd, logic, never)?;
            if bdd.support(never_node).iter().all(|&level| (level as usize) < vars.len()) {
                lower = bdd.and_not(lower, never_node)?;
                upper = bdd.or(upper, never_node)?;
            }
        }
    }
    let cover = minimise(&mut bdd, lower, upper, functions.vars().len(), budget)?;
    let vars = functions.vars();
    Ok(cover
        .cubes
        .iter()
        .map(|cube| cube.literals().map(|(level, value)| (vars[level], value)).collect())
        .collect())
}

/// A small sum of products between `lower` and `upper` over levels `0..n_vars`.
///
/// # Errors
/// When the budget does not suffice.
pub fn minimise(
    bdd: &mut Bdd,
    lower: Ref,
    upper: Ref,
    n_vars: usize,
    budget: Budget,
) -> Result<Cover, Refused> {
    if bdd.support(lower).len().max(bdd.support(upper).len()) > MAX_VARIABLES {
        return Err(Refused::Variables(MAX_VARIABLES));
    }
    let first = isop(bdd, lower, upper, n_vars, budget.products.saturating_mul(2))?;
    let mut best = first.clone();
    let mut cover = first;
    // A round is quadratic in the products at worst; a long sum is taken as it comes.
    let rounds = if best.cubes.len() <= 600 { 8 } else { 1 };
    for _ in 0..rounds {
        expand(bdd, upper, &mut cover);
        irredundant(bdd, lower, &mut cover)?;
        let cost = |cover: &Cover| (cover.cubes.len(), cover.n_literals());
        if cost(&cover) < cost(&best) {
            best = cover.clone();
        } else if cover != best {
            break;
        }
        reduce(bdd, lower, &mut cover)?;
    }
    best.sort();
    let value = best.to_bdd(bdd)?;
    let (missing, excess) = (bdd.and_not(lower, value)?, bdd.and_not(value, upper)?);
    if missing != Ref::FALSE || excess != Ref::FALSE {
        unreachable!("every step keeps the sum between both functions");
    }
    if best.cubes.len() > budget.products {
        return Err(Refused::Products(budget.products));
    }
    Ok(best)
}

/// An irredundant sum of products between `lower` and `upper`.
///
/// # Errors
/// When the diagram or the sum grows beyond its limit.
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
    /// Adds products that cover `lower` within `upper`, and gives their sum. As deep as there are variables.
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
        // What only the negative, what only the positive literal can cover.
        let only0 = self.bdd.and_not(lower0, upper1)?;
        let only1 = self.bdd.and_not(lower1, upper0)?;
        self.path.push((level as usize, false));
        let sum0 = self.run(only0, upper0)?;
        self.path.pop();
        self.path.push((level as usize, true));
        let sum1 = self.run(only1, upper1)?;
        self.path.pop();
        // What is left is covered without this variable.
        let left0 = self.bdd.and_not(lower0, sum0)?;
        let left1 = self.bdd.and_not(lower1, sum1)?;
        let left = self.bdd.or(left0, left1)?;
        let both = self.bdd.and(upper0, upper1)?;
        let sum = self.run(left, both)?;
        let (sum0, sum1) = (self.bdd.or(sum0, sum)?, self.bdd.or(sum1, sum)?);
        Ok(self.bdd.node(level, sum0, sum1)?)
    }
}

/// Makes each product as large as `upper` allows and drops those that lie in another. Literals that few products share go first.
fn expand(bdd: &Bdd, upper: Ref, cover: &mut Cover) {
    let mut uses = vec![0usize; cover.n_vars * 2];
    let slot = |(var, value): (usize, bool)| var * 2 + usize::from(value);
    for cube in &cover.cubes {
        cube.literals().for_each(|literal| uses[slot(literal)] += 1);
    }
    let mut cubes = std::mem::take(&mut cover.cubes);
    cubes.sort_by_key(|cube| std::cmp::Reverse(cube.n_literals()));
    let mut grown: Vec<Cube> = Vec::with_capacity(cubes.len());
    for mut cube in cubes {
        if grown.iter().any(|other| other.contains(&cube)) {
            continue;
        }
        let mut literals: Vec<(usize, bool)> = cube.literals().collect();
        literals.sort_by_key(|&literal| (uses[slot(literal)], literal));
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

/// Drops products that the others make superfluous, those with most literals first.
fn irredundant(bdd: &mut Bdd, lower: Ref, cover: &mut Cover) -> Result<(), Refused> {
    let mut cubes = std::mem::take(&mut cover.cubes);
    cubes.sort_by_key(|cube| std::cmp::Reverse(cube.n_literals()));
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

/// Shrinks each product to what only it covers, so that the next expansion can go another way.
fn reduce(bdd: &mut Bdd, lower: Ref, cover: &mut Cover) -> Result<(), Refused> {
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

#[cfg(test)]
mod tests {
    use super::{Budget, Refused, expand, irredundant, isop, minimise, sum_of_products};
    use crate::bdd::{Bdd, Ref};
    use crate::build::Builder;
    use crate::cover::{Cover, Cube};
    use crate::support::Var;
    use proptest::prelude::*;

    const N: usize = 6;

    fn build(bdd: &mut Bdd, table: u64) -> Ref {
        let rows: Vec<Ref> = (0..64usize)
            .filter(|row| table >> row & 1 == 1)
            .map(|row| {
                Cube::of(N, (0..N).map(|var| (var, row >> var & 1 == 1))).to_bdd(bdd).unwrap()
            })
            .collect();
        bdd.or_all(rows).unwrap()
    }

    fn table(cover: &Cover) -> u64 {
        (0..64usize)
            .filter(|row| cover.eval(|var| row >> var & 1 == 1))
            .fold(0, |table, row| table | 1 << row)
    }

    proptest! {
        #[test]
        fn the_sum_lies_between_both_functions_and_is_irredundant(on: u64, dc: u64) {
            let mut bdd = Bdd::default();
            let (on, upper) = (on & !dc, on | dc);
            let (lower, above) = (build(&mut bdd, on), build(&mut bdd, upper));
            let raw = isop(&mut bdd, lower, above, N, 1000).unwrap();
            let small = minimise(&mut bdd, lower, above, N, Budget::default()).unwrap();
            for cover in [&raw, &small] {
                prop_assert_eq!(on & !table(cover), 0);
                prop_assert_eq!(table(cover) & !upper, 0);
            }
            prop_assert!(small.cubes.len() <= raw.cubes.len());
            // Prime: no literal can go; irredundant: no product can go.
            for (index, cube) in small.cubes.iter().enumerate() {
                for (var, _) in cube.literals() {
                    let mut larger = cube.clone();
                    larger.set(var, None);
                    let outside = table(&Cover { n_vars: N, cubes: vec![larger] }) & !upper;
                    prop_assert_ne!(outside, 0);
                }
                let mut rest = small.clone();
                rest.cubes.remove(index);
                prop_assert!(on & !table(&rest) != 0);
            }
        }

        #[test]
        fn expanding_and_thinning_keep_the_function(on: u64) {
            let mut bdd = Bdd::default();
            let function = build(&mut bdd, on);
            let minterms = (0..64usize).filter(|row| on >> row & 1 == 1);
            let mut cover = Cover { n_vars: N, cubes: minterms.map(|row| Cube::of(N, (0..N).map(|var| (var, row >> var & 1 == 1)))).collect() };
            expand(&bdd, function, &mut cover);
            prop_assert_eq!(table(&cover), on);
            irredundant(&mut bdd, function, &mut cover).unwrap();
            prop_assert_eq!(table(&cover), on);
            // Variable order does not change the function.
            let again = cover.to_bdd(&mut bdd).unwrap();
            prop_assert_eq!(again, function);
        }
    }

    #[test]
    fn parity_has_no_small_sum_and_the_budget_says_so() {
        let mut builder = Builder::default();
        let mut parity = builder.constant(false);
        for _ in 0..10 {
            let input = builder.input_named("x");
            parity = builder.xor(parity, input);
        }
        let budget = Budget { products: 100, nodes: 10_000 };
        assert_eq!(
            sum_of_products(&builder.logic, parity, false, false, budget),
            Err(Refused::Products(100))
        );
        let enough = Budget { products: 512, nodes: 10_000 };
        assert_eq!(
            sum_of_products(&builder.logic, parity, true, false, enough).unwrap().len(),
            512
        );
    }

    #[test]
    fn constraints_are_used_only_when_asked_for() {
        // Never a and b: a*/b is then a.
        let mut builder = Builder::default();
        let (a, b) = (builder.input_named("a"), builder.input_named("b"));
        let not_b = builder.not(b);
        let value = builder.and([a, not_b]);
        let both = builder.and([a, b]);
        builder.logic.never.push(both);
        let pins: Vec<Var> = builder.logic.inputs.ids().map(Var::Input).collect();
        let as_written =
            sum_of_products(&builder.logic, value, false, false, Budget::default()).unwrap();
        assert_eq!(as_written, vec![vec![(pins[0], true), (pins[1], false)]]);
        let relaxed =
            sum_of_products(&builder.logic, value, false, true, Budget::default()).unwrap();
        assert_eq!(relaxed, vec![vec![(pins[0], true)]]);
    }
}
