//! Sums of a state machine with one flip-flop per state: symbolic minimisation [De Micheli, Brayton, Sangiovanni-Vincentelli 1985].
//!
//! Of the inputs in the field, exactly one is true; elsewhere the functions are free. On the relevant points, every product of literals of those
//! inputs is a set of values: one value if it has a positive literal, all but the negated ones if it has none. So these inputs form one multi-valued
//! variable, products use negative literals only, and the codes that never occur need neither products nor diagrams: for `n` values these would be
//! n(n-1)/2 pairs.
//!
//! ```text
//! on, off ─ one forbidden product per value ─ espresso's loop over values ─► products of values ─ fewest literals ─► checked against the Function
//! ```

use super::exact::best_of_starts;
use super::function::Function;
use super::heuristic::Loop;
use super::terms::{Shape, Terms};
use super::{Effort, Minimum, Outcome, Primes, Refused};
use std::collections::BTreeMap;
use std::ops::Range;

/// A small sum for all outputs together if exactly one of the inputs in `field` is always true. It is true on `on`, false on `off`, free elsewhere and wherever
/// none or several of those inputs are true. `function` must be the same function; the result is compared with it. `known` is a sum for it that may serve as a
/// start. `None` if `function` is different, or if `on` and `off` contradict each other.
///
/// # Errors
/// If the diagrams need more than the effort's nodes.
pub fn one_hot(
    function: &Function,
    (on, off): (&Terms, &Terms),
    field: Range<usize>,
    known: Option<&Terms>,
    effort: &Effort,
) -> Result<Option<Outcome>, Refused> {
    let shape = function.shape().with_one_hot(field.clone());
    let on = of_one_value(on, shape, Terms::new(shape), add_negative);
    let off = of_one_value(off, shape, Terms::new(shape), |shape, term, value| {
        shape.set_literal(term, value, Some(true));
    });
    let Some(free) = free(&on, &off, shape, effort)? else { return Ok(None) };
    let mut question = function.clone();
    question.shape = shape;
    let mut starts = vec![on.clone(), on.unwrapped()];
    if let Some(known) = known {
        starts.push(of_values(known, shape));
    }
    let covering = (effort.steps / 5).min(1 << 22);
    let mut search = Loop::new(&question, Some(off), free, effort.steps, covering);
    let mut best = best_of_starts(&mut search, &starts);
    let lower = search.independent_points(&best, effort.looks);
    best = search.sparse(best);
    drop(search);
    let mut best = with_few_literals(&best, function.shape());
    best.sort();
    if !question.wrong_outputs(&best)?.is_empty() {
        return Ok(None);
    }
    let minimum = if lower >= best.len() {
        Minimum::Exact
    } else {
        Minimum::Between { lower, found: best.len() }
    };
    Ok(Some(Outcome { terms: best, minimum, primes: Primes::Unknown, n_essential: 0 }))
}

/// The values of the field for which a product can be true.
fn values(shape: Shape, term: &[u64]) -> Vec<usize> {
    let positive: Vec<usize> =
        shape.one_hot().filter(|value| shape.literal(term, *value) == Some(true)).collect();
    match positive.as_slice() {
        [] => shape.one_hot().filter(|value| shape.literal(term, *value) != Some(false)).collect(),
        [value] => vec![*value],
        // Two of them are never true together.
        [..] => Vec::new(),
    }
}

fn without_values(shape: Shape, term: &[u64]) -> Vec<u64> {
    let mut term = term.to_vec();
    shape.one_hot().for_each(|value| shape.set_literal(&mut term, value, None));
    term
}

/// Restricts a product to this value, with negative literals of all other values.
fn add_negative(shape: Shape, term: &mut [u64], value: usize) {
    for other in shape.one_hot().filter(|other| *other != value) {
        shape.set_literal(term, other, Some(false));
    }
}

/// Repeats each product for each of its values.
fn of_one_value(
    terms: &Terms,
    shape: Shape,
    mut single: Terms,
    add: impl Fn(Shape, &mut [u64], usize),
) -> Terms {
    for term in terms.iter() {
        for value in values(shape, term) {
            let mut own = without_values(shape, term);
            add(shape, &mut own, value);
            single.push(&own);
        }
    }
    single
}

/// Products in terms of sets of values, with negative literals only.
fn of_values(terms: &Terms, shape: Shape) -> Terms {
    let mut sets = Terms::new(shape);
    for term in terms.iter() {
        let own = values(shape, term);
        if own.is_empty() {
            continue;
        }
        let mut set = without_values(shape, term);
        for value in shape.one_hot().filter(|value| own.binary_search(value).is_err()) {
            shape.set_literal(&mut set, value, Some(false));
        }
        sets.push(&set);
    }
    sets
}

/// The points that are neither on nor off, for the values of the field; products that differ only in the value are merged. `None` if on and off
/// contradict each other.
fn free(on: &Terms, off: &Terms, shape: Shape, effort: &Effort) -> Result<Option<Terms>, Refused> {
    let mut joined: BTreeMap<Vec<u64>, Vec<usize>> = BTreeMap::new();
    for value in shape.one_hot() {
        let of_value = |terms: &Terms| {
            let mut own = Terms::new(Shape::new(shape.inputs(), shape.outputs()));
            for term in terms.iter().filter(|term| values(shape, term).contains(&value)) {
                own.push(&without_values(shape, term));
            }
            own
        };
        let none = Terms::new(Shape::new(shape.inputs(), shape.outputs()));
        let mut own = Function::new(&of_value(on), &none, Some(&of_value(off)), effort.nodes)?;
        if !own.contradictory().is_empty() {
            return Ok(None);
        }
        let Some(open) = own.free(effort.forbidden)? else { return Ok(None) };
        for term in open.iter() {
            joined.entry(term.to_vec()).or_default().push(value);
        }
    }
    let mut free = Terms::new(shape);
    for (mut term, own) in joined {
        for value in shape.one_hot().filter(|value| own.binary_search(value).is_err()) {
            shape.set_literal(&mut term, value, Some(false));
        }
        free.push(&term);
    }
    Ok(Some(free))
}

/// The products with few literals: a product of one value gets only its positive literal; one of several values keeps the negative literals of the others.
fn with_few_literals(terms: &Terms, plain: Shape) -> Terms {
    let shape = terms.shape;
    let mut short = Terms::new(plain);
    for term in terms.iter() {
        let mut own = term.to_vec();
        if let [value] = values(shape, term)[..] {
            own = without_values(shape, term);
            shape.set_literal(&mut own, value, Some(true));
        }
        short.push(&own);
    }
    short
}

#[cfg(test)]
mod tests {
    use super::one_hot;
    use crate::minimise::{Effort, Function, Minimum, Shape, Terms, shared};
    use grafsynth_ir::random::Random;

    const INPUTS: usize = 2;

    /// A state machine over two inputs: next states and outputs, some of them open.
    fn machine(dice: &mut Random, n_states: usize, n_outputs: usize) -> (Terms, Terms) {
        let shape = Shape::new(INPUTS + n_states, n_states + n_outputs);
        let (mut on, mut off) = (Terms::new(shape), Terms::new(shape));
        // Few different rows, so that states have much in common.
        let mut rows: Vec<(Vec<usize>, Vec<usize>)> = Vec::new();
        for state in 0..n_states {
            for word in 0..1usize << INPUTS {
                let is_new = rows.is_empty() || dice.below(3) == 0;
                let row = if is_new {
                    let (mut high, mut low) = (Vec::new(), Vec::new());
                    if dice.below(6) > 0 {
                        let next = dice.below(n_states);
                        high.push(next);
                        low.extend((0..n_states).filter(|other| *other != next));
                    }
                    for output in n_states..n_states + n_outputs {
                        match dice.below(3) {
                            0 => high.push(output),
                            1 => low.push(output),
                            _ => {}
                        }
                    }
                    rows.push((high.clone(), low.clone()));
                    (high, low)
                } else {
                    rows[dice.below(rows.len())].clone()
                };
                let literals = (0..INPUTS)
                    .map(|input| (input, word >> input & 1 == 1))
                    .chain((0..n_states).map(|other| (INPUTS + other, other == state)));
                on.add(literals.clone(), row.0);
                off.add(literals, row.1);
            }
        }
        (on, off)
    }

    #[test]
    fn states_as_one_variable_give_the_table_and_the_least_count_where_that_is_known() {
        let mut dice = Random::new(1);
        let effort = Effort::of_level(1, true);
        let (mut n_least, mut n_all) = (0, 0);
        for round in 0..30 {
            let n_states = 3 + dice.below(4);
            let (on, off) = machine(&mut dice, n_states, 2);
            let function =
                Function::new(&on, &Terms::new(on.shape), Some(&off), 1 << 16).expect("small");
            let field = INPUTS..INPUTS + n_states;
            let alone = one_hot(&function, (&on, &off), field.clone(), None, &effort)
                .expect("small")
                .expect("a machine");
            let terms = &alone.terms;
            // For each point: the specified value of each row.
            for (asked, rows) in [(true, &on), (false, &off)] {
                for row in rows.iter() {
                    for output in 0..on.shape.outputs() {
                        if on.shape.has_output(row, output) {
                            // A row is a single point.
                            let is_met = terms.iter().any(|term| on.shape.meet(term, row, output));
                            assert_eq!(is_met, asked, "machine {round}, output {output}");
                        }
                    }
                }
            }
            let plain = shared(&function, &effort).expect("small");
            assert_eq!(plain.minimum, Minimum::Exact);
            assert!(plain.terms.len() <= terms.len(), "less than the proved minimum");
            if let Minimum::Between { lower, .. } = alone.minimum {
                assert!(lower <= plain.terms.len(), "more are needed than the minimum has");
            } else {
                assert_eq!(terms.len(), plain.terms.len());
            }
            n_all += 1;
            n_least += usize::from(terms.len() == plain.terms.len());
            let both = one_hot(&function, (&on, &off), field, Some(&plain.terms), &effort)
                .expect("small")
                .expect("a machine");
            assert_eq!(both.terms.len(), plain.terms.len(), "a known sum is not lost");
        }
        assert!(n_least * 10 >= n_all * 9, "{n_least} of {n_all} are the least");
    }

    #[test]
    fn a_function_that_says_more_than_the_table_is_refused() {
        // Two states; the strict function is also true if none is active.
        let shape = Shape::new(2, 1);
        let (mut on, mut off) = (Terms::new(shape), Terms::new(shape));
        on.add([(0, true), (1, false)], [0]);
        off.add([(0, false), (1, true)], [0]);
        let mut more = on.clone();
        more.add([(0, false), (1, false)], [0]);
        let none = Terms::new(shape);
        let effort = Effort::of_level(0, true);
        let loose = Function::new(&on, &none, Some(&off), 1 << 10).expect("small");
        let strict = Function::new(&more, &none, Some(&off), 1 << 10).expect("small");
        let sums = (&on, &off);
        let found = one_hot(&loose, sums, 0..2, None, &effort).expect("small").expect("a sum");
        assert_eq!((found.terms.len(), found.terms.n_literals()), (1, 1));
        assert!(one_hot(&strict, sums, 0..2, None, &effort).expect("small").is_none());
        let contradictory = one_hot(&loose, (&on, &on), 0..2, None, &effort).expect("small");
        assert!(contradictory.is_none());
    }
}
