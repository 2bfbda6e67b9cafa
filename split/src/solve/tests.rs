//! The parts of the solver against their definitions, on random problems.

use super::dual::{self, Cut};
use super::model::{Model, parts_of, reduce, whole};
use super::problem::{PartIndex, Problem};
use super::state::{Prices, State, UNIT};

#[path = "../../tests/common/mod.rs"]
mod common;

use common::{Prng, random_problem};

/// All placements of the free nodes.
fn placements(model: &Model) -> Vec<Vec<PartIndex>> {
    let mut all = vec![Vec::new()];
    for node in &model.nodes {
        all = all
            .into_iter()
            .flat_map(|placement| {
                parts_of(node.allowed).map(move |part| [&placement[..], &[part]].concat())
            })
            .collect();
    }
    all
}

/// Reduced random problems of two parts.
fn models(prng: &mut Prng, count: usize) -> Vec<Model> {
    let problems =
        std::iter::repeat_with(|| random_problem(prng)).filter(|problem| problem.parts.len() == 2);
    problems
        .filter_map(|problem| reduce(&problem))
        .filter(|model| !model.nodes.is_empty())
        .take(count)
        .collect()
}

#[test]
fn a_cut_is_the_cheapest_placement_at_its_prices() {
    let mut prng = Prng::new(1);
    for model in models(&mut prng, 150) {
        let room: Vec<_> = model.limits().collect();
        for _ in 0..3 {
            let rows: Vec<_> = room.iter().map(|_| prng.below(6000) as i64).collect();
            let (level, placement) = Cut::new(&model, &rows, &room).expect("small numbers").solve();
            let priced = |placement: Vec<PartIndex>| {
                let state = State::new(&model, placement);
                let over: i64 = state
                    .loads()
                    .zip(&room)
                    .zip(&rows)
                    .map(|((load, room), price)| price * (load - room))
                    .sum();
                (state.value - model.base) * UNIT + over
            };
            assert_eq!(priced(placement), level, "{rows:?}: {model:?}");
            assert_eq!(
                placements(&model).into_iter().map(priced).min(),
                Some(level),
                "{rows:?}: {model:?}"
            );
        }
    }
}

/// The bound holds, is exact without limits, and decides the part of a node only if every better placement puts the node there.
#[test]
fn the_bound_and_what_it_decides_hold() {
    let mut prng = Prng::new(2);
    let (mut exact, mut decided) = (0, 0);
    for (round, mut model) in models(&mut prng, 300).into_iter().enumerate() {
        if round % 2 == 0 {
            model.pins.fill(None);
            model.capacity.iter_mut().flatten().for_each(|limit| *limit = None);
        }
        let states: Vec<_> = placements(&model)
            .into_iter()
            .map(|placement| State::new(&model, placement))
            .filter(|state| state.excess == 0)
            .collect();
        let Some(optimum) = states.iter().map(|state| state.value).min() else { continue };
        // Any placement can be the start, even one that is 1 above the optimum.
        let start = states
            .iter()
            .find(|state| state.value == optimum + 1)
            .unwrap_or(&states[prng.below(states.len())]);
        let dual = dual::bound(&model, Some(start), 30, 0).expect("small numbers");
        assert!(dual.bound <= optimum, "{} > {optimum}: {model:?}", dual.bound);
        if model.limits().next().is_none() {
            assert_eq!(dual.bound, optimum, "{model:?}");
            exact += 1;
        }
        let best = dual.best.map_or(start.value, |(value, _)| value);
        for state in states.iter().filter(|state| state.value < best) {
            for (node, &part) in state.part.iter().enumerate() {
                assert!(
                    dual.decided[node].is_none_or(|decided| decided == part),
                    "node {node}: {model:?}"
                );
            }
        }
        decided += dual.decided.iter().flatten().count();
    }
    assert!(exact > 50 && decided > 200, "{exact} exact, {decided} decided");
}

/// After each move, the sums are those of a new state, and nodes that were not touched have the effects from before.
#[test]
fn moves_change_only_what_they_say() {
    let mut prng = Prng::new(3);
    for _ in 0..150 {
        let problem: Problem = random_problem(&mut prng);
        let model = whole(&problem);
        let mut prices = Prices::zero(&model);
        prices
            .capacity
            .iter_mut()
            .flatten()
            .chain(&mut prices.pins)
            .for_each(|price| *price = prng.below(3000) as i64);
        let mut state =
            State::new(&model, model.nodes.iter().map(|_| prng.below(model.parts)).collect());
        for _ in 0..12 {
            let (node, to) = (prng.below(model.nodes.len()), prng.below(model.parts));
            if state.part[node] == to {
                continue;
            }
            let all = |state: &State| -> Vec<Vec<i64>> {
                let of_node = |node: usize| {
                    (0..model.parts)
                        .map(|part| {
                            if part == state.part[node] {
                                0
                            } else {
                                state.priced(node, part, &prices)
                            }
                        })
                        .collect()
                };
                (0..model.nodes.len()).map(of_node).collect()
            };
            let (before, effect, value, excess) =
                (all(&state), state.effect(node, to), state.value, state.excess);
            let mut touched = vec![node];
            state.apply(node, to, |node| touched.push(node));
            let new = State::new(&model, state.part.clone());
            assert_eq!((state.value, state.excess), (new.value, new.excess));
            assert_eq!((state.value - value, state.excess - excess), (effect.value, effect.excess));
            assert!(state.uses().eq(new.uses()) && state.loads().eq(new.loads()));
            let after = all(&state);
            for other in (0..model.nodes.len()).filter(|other| !touched.contains(other)) {
                assert_eq!(
                    before[other], after[other],
                    "node {other} after {node} went to {to}: {model:?}"
                );
            }
        }
    }
}
