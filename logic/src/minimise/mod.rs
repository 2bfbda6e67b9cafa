//! Two-level minimisation: small sums of products, and proofs that no smaller one exists.
//!
//! ```text
//! Function ─ heuristic: espresso's loop, a pool of primes ─► small sum ─┐
//!    └────── exact: primes ─ essential ─ table ─ covering ─► minimum   ─┴─► checked against the Function ─► Outcome
//! diagram of a circuit's node ─ isop ─ expand, irredundant, reduce ─ (small ones: exact) ─► sum_of_products
//! ```
//! A PLA shares products between outputs ([`shared`]); a PAL does not, and can invert ([`per_output`]). Don't-cares are part of the problem: a result
//! may be anywhere between a lower and an upper function. An outcome tells whether it is a proved minimum ([`Minimum::Exact`]), and otherwise a lower
//! bound on the number of products. Every result is checked against both functions before it is returned.

mod covering;
mod diagram;
mod exact;
mod expand;
mod function;
mod heuristic;
mod local;
mod phase;
mod primes;
mod rows;
mod symbolic;
mod terms;
#[cfg(test)]
mod tests;

pub use diagram::isop;
pub use function::Function;
pub use phase::{Phased, phased};
pub use symbolic::one_hot;
pub use terms::{Shape, Terms};

use crate::bdd::{Bdd, Full, Ref};
use crate::build::for_each_operand;
use crate::cover::{Cover, Cube};
use crate::node_bdds::{Functions, Var};
use diagram::{expand, irredundant, reduce};
use grafsynth_ir::logic::{Logic, Node, NodeId};
use heuristic::Loop;

/// Limits of a minimisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// The maximum number of products.
    pub products: usize,
    /// The maximum size of the diagrams, in nodes.
    pub nodes: usize,
    /// The effort of the search for the proved minimum; with `None`, only a local minimum is computed.
    pub exact: Option<Effort>,
}

impl Default for Budget {
    fn default() -> Self {
        Budget { products: 512, nodes: 1 << 17, exact: Some(Effort::of_level(1, true)) }
    }
}

/// Why there is no sum of products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// The diagram of the function needs more nodes than this limit.
    Nodes(usize),
    /// The sum needs more products than this limit.
    Products(usize),
    /// The function has this number of variables, which is too large.
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

/// Functions of more variables are rejected, because [`isop`] recurses once per variable.
pub const MAX_VARIABLES: usize = 1024;

/// Products of literals of a circuit.
pub type Product = Vec<(Var, bool)>;

/// The function of a node as a small sum of products, each sorted by variable, flip-flops first.
///
/// With `dont_cares` the result may differ from the node if one of [`Logic::never`] is true.
///
/// # Errors
/// If the budget is not sufficient.
pub fn sum_of_products(
    logic: &Logic,
    node: NodeId,
    negated: bool,
    dont_cares: bool,
    budget: Budget,
) -> Result<Vec<Product>, Refused> {
    proved_sum_of_products(logic, node, negated, dont_cares, budget).map(|(products, _)| products)
}

/// Like [`sum_of_products`], with a lower bound on the number of products.
///
/// # Errors
/// If the budget is not sufficient.
pub fn proved_sum_of_products(
    logic: &Logic,
    node: NodeId,
    negated: bool,
    dont_cares: bool,
    budget: Budget,
) -> Result<(Vec<Product>, Minimum), Refused> {
    let dont_cares: &[NodeId] = if dont_cares { &logic.never } else { &[] };
    sum_between(logic, node, negated, dont_cares, budget)
}

/// Like [`proved_sum_of_products`]; the result may differ from the node wherever one of these don't-cares is true. If a don't-care also reads other
/// signals, only the part that is true for all their values counts.
///
/// # Errors
/// If the budget is not sufficient.
pub fn sum_between(
    logic: &Logic,
    node: NodeId,
    negated: bool,
    dont_cares: &[NodeId],
    budget: Budget,
) -> Result<(Vec<Product>, Minimum), Refused> {
    // Variables in the order of the circuit, flip-flops first: this gives products in the usual notation.
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
                node => {
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
    dont_cares: &[NodeId],
    budget: Budget,
) -> Result<(Vec<Product>, Minimum), Refused> {
    let mut bdd = Bdd::with_limit(budget.nodes);
    let mut functions = Functions::new();
    for &var in vars {
        functions.level(var);
    }
    let value = functions.build(&mut bdd, logic, node)?;
    let on = if negated { bdd.not(value)? } else { value };
    let (mut lower, mut upper) = (on, on);
    let n_vars = u32::try_from(vars.len()).unwrap_or(u32::MAX);
    for &never in dont_cares {
        // Don't-cares save products; a failure to build them is no reason to reject a function.
        let Ok(open) = part_over(&mut bdd, &mut functions, logic, never, n_vars) else { continue };
        if open != Ref::FALSE {
            lower = bdd.and_not(lower, open)?;
            upper = bdd.or(upper, open)?;
        }
    }
    let (cover, minimum) = minimise(&mut bdd, lower, upper, vars.len(), budget)?;
    let vars = functions.vars();
    let products = cover
        .cubes
        .iter()
        .map(|cube| cube.literals().map(|(level, value)| (vars[level], value)).collect())
        .collect();
    Ok((products, minimum))
}

/// The assignments for which a node is true whatever the variables from level `n_vars` on are.
fn part_over(
    bdd: &mut Bdd,
    functions: &mut Functions,
    logic: &Logic,
    node: NodeId,
    n_vars: u32,
) -> Result<Ref, crate::bdd::Full> {
    let value = functions.build(bdd, logic, node)?;
    let others: Vec<u32> =
        bdd.support(value).into_iter().filter(|level| *level >= n_vars).collect();
    if others.is_empty() {
        return Ok(value);
    }
    let others = bdd.cube(others)?;
    bdd.forall(value, others)
}

/// A small sum of products between `lower` and `upper` over levels `0..n_vars`, and a lower bound.
///
/// # Errors
/// If the budget is not sufficient.
pub fn minimise(
    bdd: &mut Bdd,
    lower: Ref,
    upper: Ref,
    n_vars: usize,
    budget: Budget,
) -> Result<(Cover, Minimum), Refused> {
    if bdd.support(lower).len().max(bdd.support(upper).len()) > MAX_VARIABLES {
        return Err(Refused::Variables(MAX_VARIABLES));
    }
    let first = isop(bdd, lower, upper, n_vars, budget.products.saturating_mul(2))?;
    let mut best = first.clone();
    let mut cover = first;
    // A round is quadratic in the products in the worst case, so a long sum gets only one round.
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
    let mut minimum = Minimum::Between { lower: usize::from(lower != Ref::FALSE), found: 0 };
    if let Some(effort) = budget.exact {
        minimum = improve(bdd, lower, upper, n_vars, &effort, &mut best)?;
    }
    if let Minimum::Between { found, .. } = &mut minimum {
        *found = best.cubes.len();
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
    Ok((best, minimum))
}

/// Larger problems than these get only a local minimum: variables, products, nodes.
const SMALL: (usize, usize, usize) = (18, 96, 1 << 15);

/// Searches for the proved minimum of a small problem; a sum that is not shorter is discarded.
fn improve(
    bdd: &Bdd,
    lower: Ref,
    upper: Ref,
    n_vars: usize,
    effort: &Effort,
    best: &mut Cover,
) -> Result<Minimum, Refused> {
    let n_products = best.cubes.len();
    let at_least_one = usize::from(lower != Ref::FALSE);
    if n_products <= at_least_one {
        return Ok(Minimum::Exact);
    }
    if n_vars > SMALL.0 || n_products > SMALL.1 || bdd.len() > SMALL.2 {
        return Ok(Minimum::Between { lower: at_least_one, found: n_products });
    }
    let question = Function::of_diagram(bdd, lower, upper, best);
    let outcome = match shared(&question, effort) {
        Ok(outcome) => outcome,
        // The copy of the manager has no more room; the current sum is still correct.
        Err(Refused::Nodes(_) | Refused::Products(_) | Refused::Variables(_)) => {
            return Ok(Minimum::Between { lower: at_least_one, found: n_products });
        }
    };
    if (outcome.terms.len(), outcome.terms.n_literals()) < (n_products, best.n_literals()) {
        let shape = outcome.terms.shape;
        best.cubes = outcome
            .terms
            .iter()
            .map(|term| {
                let literals = (0..n_vars)
                    .filter_map(|var| shape.literal(term, var).map(|value| (var, value)));
                Cube::of(n_vars, literals)
            })
            .collect();
    }
    Ok(outcome.minimum)
}

/// Limits of the work of a minimisation. All figures count steps, never seconds: the same problem gives the same result on every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// True to search for the proved minimum; false to search only for a small sum.
    pub exact: bool,
    /// The maximum size of the diagrams, in nodes.
    pub nodes: usize,
    /// The maximum number of primes that are listed.
    pub primes: usize,
    /// The maximum size of the diagrams of prime sets, in nodes.
    pub sets: usize,
    /// The maximum number of rows of the table.
    pub rows: usize,
    /// Steps of the recursions over products; one step visits about one product.
    pub steps: u64,
    /// Steps of the branching over the table.
    pub branching: u64,
    /// The maximum number of forbidden products that are listed; beyond it the diagram is used instead.
    pub forbidden: usize,
    /// The maximum number of visits of forbidden products to find a lower bound, if nothing else proved one.
    pub looks: usize,
}

impl Effort {
    /// The effort of a level; each level allows ten times the work. Level 0 takes a few milliseconds, level 3 a few seconds, level 5 a few minutes.
    #[must_use]
    pub fn of_level(level: u32, exact: bool) -> Self {
        let level = level.min(9);
        let scale = 10u64.pow(level);
        let scaled = |n: u64| n.saturating_mul(scale);
        let items =
            |n: usize| n.saturating_mul(usize::try_from(scale.isqrt()).unwrap_or(usize::MAX));
        let nodes = items(200_000).min(1 << 25);
        Effort {
            exact,
            nodes,
            sets: nodes,
            primes: items(2_000),
            rows: items(2_000),
            steps: scaled(2_000_000),
            branching: scaled(400_000),
            forbidden: items(1_000).max(20_000),
            looks: if exact { 400_000_000 } else { 50_000_000 },
        }
    }

    /// The effort to find a small sum quickly: the loop may do the work of this level, but the table of primes is made only if it is short.
    #[must_use]
    pub fn quick(level: u32) -> Self {
        let effort = Self::of_level(level, true);
        Effort {
            primes: effort.primes.min(3_000),
            rows: effort.rows.min(3_000),
            sets: effort.sets.min(100_000),
            steps: effort.steps.min(7_000_000),
            branching: effort.branching.min(1_000_000),
            looks: 5_000_000,
            ..effort
        }
    }
}

/// A problem without an initial sum is rejected if its first sum is longer than this.
const MAX_START: usize = 20_000;

/// The number of primes, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primes {
    /// The exact number; all primes were listed.
    All(usize),
    /// A lower bound; there are too many primes to list.
    MoreThan(u64),
    /// Unknown: the diagram of the primes is too large, or they were not computed.
    Unknown,
}

/// Proved bounds on the number of products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Minimum {
    /// The sum is a proved minimum: no sum has fewer products.
    Exact,
    /// `found` products are sufficient, and `lower` are necessary.
    Between {
        /// No sum has fewer products.
        lower: usize,
        /// The number of products of the sum.
        found: usize,
    },
}

/// A minimised sum, checked against the problem.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The products.
    pub terms: Terms,
    /// Whether the sum is a proved minimum, otherwise the proved bounds.
    pub minimum: Minimum,
    /// The number of primes of the problem.
    pub primes: Primes,
    /// The number of primes that every minimal sum of primes contains, as far as it is known.
    pub n_essential: usize,
}

/// A small sum for all outputs together, with shared products: for a PLA. Minimises the number of products, then the literals.
///
/// # Errors
/// If the diagrams need more than the effort's nodes, or if there is no initial sum and the first one computed is too long.
pub fn shared(function: &Function, effort: &Effort) -> Result<Outcome, Refused> {
    let mut function = function.clone();
    let free = function.free(effort.forbidden)?;
    let off = function.forbidden(effort.forbidden)?;
    let bounds: Vec<(Ref, Ref)> =
        function.lower.iter().copied().zip(function.upper.iter().copied()).collect();
    let mut starts = Vec::new();
    if !function.start.is_empty() {
        starts.push(function.start.clone());
        starts.push(function.start.unwrapped());
    }
    let own = if starts.is_empty() { MAX_START } else { effort.forbidden.min(4_000) };
    match function.sums(&bounds, own)? {
        Some(sums) => starts.push(sums),
        None if starts.is_empty() => return Err(Refused::Products(own)),
        None => {}
    }
    let is_free_known = free.is_some();
    let free = free.unwrap_or_else(|| Terms::new(function.shape));
    let mut search =
        Loop::new(&function, off, free.clone(), effort.steps, (effort.steps / 5).min(1 << 22));
    let mut best = exact::best_of_starts(&mut search, &starts);
    let mut found = exact::Found { terms: None, lower: 0, primes: Primes::Unknown, n_essential: 0 };
    if effort.exact && is_free_known {
        found = exact::exact(&function, &best, &free, effort);
        if let Some(terms) = found.terms.take()
            && (terms.len(), terms.n_literals()) < (best.len(), best.n_literals())
        {
            best = terms;
        }
    }
    let mut lower = found.lower;
    if is_free_known && lower < best.len() {
        lower = lower.max(search.independent_points(&best, effort.looks));
    }
    best = search.sparse(best);
    drop(search);
    best.sort();
    if !function.wrong_outputs(&best)?.is_empty() {
        unreachable!("every step keeps each sum between its bounds");
    }
    let minimum = if lower >= best.len() {
        Minimum::Exact
    } else {
        Minimum::Between { lower, found: best.len() }
    };
    Ok(Outcome { terms: best, minimum, primes: found.primes, n_essential: found.n_essential })
}

/// The sum of one output in the form of a PAL.
#[derive(Debug, Clone)]
pub struct OneOutput {
    /// True if the sum represents the complement, and the output inverts it.
    pub is_complemented: bool,
    /// The minimised sum.
    pub outcome: Outcome,
}

/// A small sum for each output separately, for a PAL. With `free_polarity` the complement is chosen if it needs fewer products, or equally many and
/// fewer literals.
///
/// # Errors
/// If the diagrams need more than the effort's nodes.
pub fn per_output(
    function: &Function,
    free_polarity: bool,
    effort: &Effort,
) -> Result<Vec<OneOutput>, Refused> {
    let mut outputs = Vec::new();
    // The limit for all outputs together.
    let n_outputs = (function.shape.outputs() as u64).max(1);
    let effort = &Effort {
        steps: effort.steps / n_outputs,
        branching: effort.branching / n_outputs,
        ..*effort
    };
    for output in 0..function.shape.outputs() {
        let plain = function.single(output, false)?;
        if !free_polarity {
            let outcome = shared(&plain, effort)?;
            outputs.push(OneOutput { is_complemented: false, outcome });
            continue;
        }
        // First both polarities quickly; the proof starts with the smaller one and often makes the other unnecessary.
        let quick = Effort { exact: false, ..*effort };
        let cost = |outcome: &Outcome| (outcome.terms.len(), outcome.terms.n_literals());
        let mut sides = Vec::new();
        for is_complemented in [false, true] {
            let side = if is_complemented { function.single(output, true)? } else { plain.clone() };
            match shared(&side, &quick) {
                Ok(outcome) => sides.push((side, OneOutput { is_complemented, outcome })),
                // A complement without a sum of acceptable length is not an option.
                Err(Refused::Products(_)) if is_complemented => {}
                Err(refused) => return Err(refused),
            }
        }
        sides.sort_by_key(|(_, one)| cost(&one.outcome));
        let mut best: Option<OneOutput> = None;
        for (side, mut one) in sides {
            let needed = match one.outcome.minimum {
                Minimum::Exact => one.outcome.terms.len(),
                Minimum::Between { lower, .. } => lower,
            };
            if best.as_ref().is_some_and(|best| needed > best.outcome.terms.len()) {
                continue;
            }
            if effort.exact {
                one.outcome = shared(&side, effort)?;
            }
            if best.as_ref().is_none_or(|best| cost(&one.outcome) < cost(&best.outcome)) {
                best = Some(one);
            }
        }
        outputs.extend(best);
    }
    Ok(outputs)
}

#[cfg(test)]
mod circuit_tests {
    use super::{Budget, Refused, expand, irredundant, isop, minimise, sum_of_products};
    use crate::bdd::{Bdd, Ref};
    use crate::build::Builder;
    use crate::cover::{Cover, Cube};
    use crate::node_bdds::Var;
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
            let (small, minimum) = minimise(&mut bdd, lower, above, N, Budget::default()).unwrap();
            prop_assert_eq!(minimum, super::Minimum::Exact);
            for cover in [&raw, &small] {
                prop_assert_eq!(on & !table(cover), 0);
                prop_assert_eq!(table(cover) & !upper, 0);
            }
            prop_assert!(small.cubes.len() <= raw.cubes.len());
            // Prime: no literal can be removed; irredundant: no product can be removed.
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
        let budget = Budget { products: 100, nodes: 10_000, exact: None };
        assert_eq!(
            sum_of_products(&builder.logic, parity, false, false, budget),
            Err(Refused::Products(100))
        );
        let enough = Budget { products: 512, nodes: 10_000, exact: None };
        assert_eq!(
            sum_of_products(&builder.logic, parity, true, false, enough).unwrap().len(),
            512
        );
    }

    #[test]
    fn constraints_are_used_only_when_asked_for() {
        // a and b are never both true, so a*/b is a.
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
