//! Laws of the minimiser, checked against truth tables and brute force.

use super::{Effort, Function, Minimum, Refused, Shape, Terms, per_output, phased, shared};
use proptest::prelude::*;

/// The functions with these truth tables over `n` inputs; `dc` is free.
fn function(n: usize, on: &[u64], dc: &[u64]) -> Function {
    let shape = Shape::new(n, on.len());
    let minterms = |tables: &[u64]| {
        let mut terms = Terms::new(shape);
        for (output, table) in tables.iter().enumerate() {
            for row in (0..1usize << n).filter(|row| table >> row & 1 == 1) {
                terms.add((0..n).map(|input| (input, row >> input & 1 == 1)), [output]);
            }
        }
        terms
    };
    Function::new(&minterms(on), &minterms(dc), None, 1 << 20).unwrap()
}

fn table(terms: &Terms, output: usize) -> u64 {
    let shape = terms.shape;
    (0..1usize << shape.inputs())
        .filter(|row| {
            terms.iter().any(|term| {
                shape.has_output(term, output)
                    && (0..shape.inputs()).all(|input| {
                        shape.literal(term, input).is_none_or(|v| v == (row >> input & 1 == 1))
                    })
            })
        })
        .fold(0, |table, row| table | 1 << row)
}

/// The minimum number of products by brute force: all maximal products within the upper functions, then depth-first over the first uncovered point.
fn brute(n: usize, on: &[u64], upper: &[u64]) -> usize {
    let mut products: Vec<Vec<u64>> = Vec::new();
    for code in 0..3usize.pow(u32::try_from(n).unwrap()) {
        let mut digits = code;
        let literals: Vec<usize> = (0..n)
            .map(|_| {
                let digit = digits % 3;
                digits /= 3;
                digit
            })
            .collect();
        let rows = (0..1usize << n)
            .filter(|row| literals.iter().enumerate().all(|(k, d)| *d == 2 || row >> k & 1 == *d))
            .fold(0u64, |rows, row| rows | 1 << row);
        let parts: Vec<u64> = upper.iter().map(|u| if rows & !u == 0 { rows } else { 0 }).collect();
        if parts.iter().any(|part| *part != 0) {
            products.push(parts);
        }
    }
    fn search(open: &[u64], products: &[Vec<u64>], used: usize, best: &mut usize) {
        let Some(output) = open.iter().position(|rows| *rows != 0) else {
            *best = (*best).min(used);
            return;
        };
        if used + 1 >= *best {
            return;
        }
        // The point with the fewest products.
        let point = (0..64)
            .filter(|row| open[output] >> row & 1 == 1)
            .min_by_key(|row| products.iter().filter(|p| p[output] >> row & 1 == 1).count())
            .unwrap();
        for product in products.iter().filter(|p| p[output] >> point & 1 == 1) {
            let rest: Vec<u64> = open.iter().zip(product).map(|(o, p)| o & !p).collect();
            search(&rest, products, used + 1, best);
        }
    }
    // Only maximal products matter.
    let inside = |a: &[u64], b: &[u64]| a.iter().zip(b).all(|(a, b)| a & !b == 0);
    let maximal: Vec<Vec<u64>> = products
        .iter()
        .filter(|p| !products.iter().any(|q| q != *p && inside(p, q)))
        .cloned()
        .collect();
    let mut best = 65;
    search(on, &maximal, 0, &mut best);
    best
}

fn check(n: usize, on: &[u64], dc: &[u64], effort: &Effort) -> Result<usize, TestCaseError> {
    let rows = if n == 6 { u64::MAX } else { (1 << (1 << n)) - 1 };
    let dc: Vec<u64> = dc.iter().map(|dc| dc & rows).collect();
    let lower: Vec<u64> = on.iter().zip(&dc).map(|(on, dc)| on & rows & !dc).collect();
    let upper: Vec<u64> = on.iter().zip(&dc).map(|(on, dc)| on & rows | dc).collect();
    let function = function(n, &lower, &dc);
    let outcome = shared(&function, effort).unwrap();
    for output in 0..on.len() {
        let got = table(&outcome.terms, output);
        prop_assert_eq!(lower[output] & !got, 0);
        prop_assert_eq!(got & !upper[output], 0);
    }
    let least = brute(n, &lower, &upper);
    match outcome.minimum {
        Minimum::Exact => prop_assert_eq!(outcome.terms.len(), least),
        Minimum::Between { lower, found } => {
            prop_assert!(lower <= least && least <= found);
            prop_assert!(!effort.exact, "a function of {} inputs is minimised exactly", n);
        }
    }
    Ok(least)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    #[test]
    fn one_output_of_four_inputs_gets_the_fewest_products(on: u64, dc: u64) {
        check(4, &[on], &[dc & on.rotate_left(7)], &Effort::of_level(2, true))?;
    }

    #[test]
    fn shared_products_of_three_inputs_are_the_fewest(on: [u64; 3], dc: [u64; 3]) {
        check(3, &on, &dc, &Effort::of_level(2, true))?;
    }

    #[test]
    fn the_heuristic_is_right_and_its_bound_true(on: [u64; 2], dc: u64) {
        check(3, &on, &[dc, 0], &Effort::of_level(1, false))?;
        check(4, &on[..1], &[dc], &Effort::of_level(1, false))?;
        check(4, &on[..1], &[dc], &Effort::quick(1))?;
    }

    #[test]
    fn what_runs_out_of_steps_is_still_right(on: [u64; 2], dc: u64, steps in 0u64..3000) {
        let effort = Effort { steps, branching: steps / 8, exact: false, ..Effort::of_level(1, false) };
        check(3, &on, &[dc, dc >> 9], &effort)?;
        let tight = Effort { primes: 4, rows: 2, forbidden: 3, ..effort };
        check(3, &on, &[dc, dc >> 9], &tight)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn one_output_of_five_inputs_gets_the_fewest_products(on: u32, dc: u32, thin: u32) {
        check(5, &[u64::from(on)], &[u64::from(dc & thin)], &Effort::of_level(2, true))?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn shared_products_of_four_inputs_are_the_fewest(on: [u64; 2], dc: [u64; 2], thin: [u64; 2]) {
        check(4, &on, &[dc[0] & thin[0], dc[1] & thin[1]], &Effort::of_level(2, true))?;
    }

    #[test]
    fn phases_give_the_same_functions_with_no_more_products(on: [u64; 3], dc: [u64; 3]) {
        let rows = 0xff;
        let dc = dc.map(|dc| dc & rows & dc >> 8);
        let lower: Vec<u64> = on.iter().zip(&dc).map(|(on, dc)| on & rows & !dc).collect();
        let off: Vec<u64> = lower.iter().zip(&dc).map(|(on, dc)| rows & !(on | dc)).collect();
        let function = function(3, &lower, &dc);
        let effort = Effort::of_level(2, true);
        let found = phased(&function, &effort, 40).unwrap();
        prop_assert!(found.is_complete);
        prop_assert!(found.outcome.terms.len() <= shared(&function, &effort).unwrap().terms.len());
        for output in 0..3 {
            let got = table(&found.outcome.terms, output);
            let got = if found.is_complemented[output] { rows & !got } else { got };
            prop_assert_eq!(lower[output] & !got, 0);
            prop_assert_eq!(got & off[output], 0);
        }
        // No choice of phases needs fewer products than the best of all choices.
        let least = (0..8usize).map(|choice| {
            let side = |output: usize| if choice >> output & 1 == 1 { off[output] } else { lower[output] };
            let on: Vec<u64> = (0..3).map(side).collect();
            let upper: Vec<u64> = on.iter().zip(&dc).map(|(on, dc)| on | dc).collect();
            brute(3, &on, &upper)
        }).min().unwrap();
        prop_assert!(found.outcome.terms.len() >= least);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn free_polarity_takes_the_smaller_side(on: u64, dc: u64) {
        let rows = 0xffff;
        let (lower, dc) = (on & !dc & rows, dc & rows);
        let function = function(4, &[lower], &[dc]);
        let outputs = per_output(&function, true, &Effort::of_level(2, true)).unwrap();
        let off = rows & !(lower | dc);
        let least = brute(4, &[lower], &[lower | dc]).min(brute(4, &[off], &[off | dc]));
        prop_assert_eq!(outputs[0].outcome.terms.len(), least);
        let got = table(&outputs[0].outcome.terms, 0) ^ if outputs[0].is_complemented { rows } else { 0 };
        prop_assert_eq!(lower & !got, 0);
        prop_assert_eq!(got & off, 0);
    }

    #[test]
    fn any_change_of_a_minimal_sum_is_caught(on: u64, which: prop::sample::Index, input in 0usize..4, value: Option<bool>) {
        let mut function = function(4, &[on & 0xffff], &[0]);
        let outcome = shared(&function, &Effort::of_level(2, true)).unwrap();
        prop_assert!(function.wrong_outputs(&outcome.terms).unwrap().is_empty());
        if !outcome.terms.is_empty() {
            let index = which.index(outcome.terms.len());
            let mut changed = outcome.terms.clone();
            changed.shape.set_literal(changed.get_mut(index), input, value);
            let is_same = table(&changed, 0) == on & 0xffff;
            prop_assert_eq!(function.wrong_outputs(&changed).unwrap().is_empty(), is_same);
            let mut fewer = outcome.terms.clone();
            fewer.retain(|at, _| at != index);
            prop_assert_eq!(function.wrong_outputs(&fewer).unwrap(), vec![0]);
        }
    }
}

#[test]
fn functions_without_a_bearable_complement_are_minimised_too() {
    // a0 b0 + a1 b1 + …: the complement has 2^30 products, the sum has 30 primes, all essential; in the written order the diagram explodes.
    let n = 30;
    let shape = Shape::new(2 * n, 1);
    let mut on = Terms::new(shape);
    (0..n).for_each(|k| on.add([(k, true), (n + k, true)], [0]));
    let function = Function::new(&on, &Terms::new(shape), None, 1 << 16).unwrap();
    let outcome = shared(&function, &Effort::of_level(2, true)).unwrap();
    assert_eq!((outcome.terms.len(), outcome.minimum), (n, Minimum::Exact));
    assert_eq!(outcome.n_essential, n);
}

#[test]
fn a_complement_without_a_bearable_sum_is_no_choice() {
    // The complement of 40 disjoint pairs has 2^40 products.
    let n = 40;
    let shape = Shape::new(2 * n, 1);
    let mut on = Terms::new(shape);
    (0..n).for_each(|k| on.add([(2 * k, true), (2 * k + 1, true)], [0]));
    let function = Function::new(&on, &Terms::new(shape), None, 1 << 16).unwrap();
    let effort = Effort::of_level(2, true);
    let outputs = per_output(&function, true, &effort).unwrap();
    assert_eq!((outputs[0].is_complemented, outputs[0].outcome.terms.len()), (false, n));
    let found = phased(&function, &effort, 10).unwrap();
    assert_eq!((found.is_complemented, found.outcome.terms.len()), (vec![false], n));
    let turned = function.complemented(&[true]).unwrap();
    assert!(matches!(shared(&turned, &effort), Err(Refused::Products(_))));
}

#[test]
fn constants_and_nothing() {
    for (on, products) in [(0u64, 0), (0xffff, 1)] {
        let outcome = shared(&function(4, &[on], &[0]), &Effort::of_level(1, true)).unwrap();
        assert_eq!((outcome.terms.len(), outcome.minimum), (products, Minimum::Exact));
    }
    let shape = Shape::new(0, 2);
    let mut on = Terms::new(shape);
    on.add([], [1]);
    let function = Function::new(&on, &Terms::new(shape), None, 100).unwrap();
    let outcome = shared(&function, &Effort::of_level(1, true)).unwrap();
    assert_eq!((outcome.terms.len(), outcome.minimum), (1, Minimum::Exact));
}
