//! Random small problems, compared with all their placements.

use crate::common::{Prng, random_problem};
use grafsynth_split::solve::{
    Alternative, Conflict, Constraint, Limits, Outcome, PartIndex, Problem, alternatives, evaluate,
    improve, solve,
};

/// The smallest objective over all placements, and how many placements fit.
fn brute_force(problem: &Problem) -> Option<i64> {
    let mut assignment = vec![0; problem.nodes.len()];
    let mut best: Option<i64> = None;
    loop {
        let evaluation = evaluate(problem, &assignment).expect("well-formed");
        if evaluation.broken.is_empty() {
            best = Some(best.map_or(evaluation.value, |best| best.min(evaluation.value)));
        }
        let Some(node) = assignment.iter().position(|&part| part + 1 < problem.parts.len()) else {
            return best;
        };
        assignment[node] += 1;
        assignment[..node].fill(0);
    }
}

/// Without local search the bound starts from a poor placement, so every node that it decides too early is seen.
#[test]
fn random_problems_have_the_optimum_of_all_placements() {
    let default = Limits::default();
    let all_limits = [
        default,
        Limits { passes: 0, ..default },
        Limits { passes: 0, cuts: 2, ..default },
        Limits { cuts: 0, ..default },
    ];
    let mut prng = Prng::new(7);
    let (mut feasible, mut infeasible) = (0, 0);
    for round in 0..320 {
        let problem = random_problem(&mut prng);
        let best = brute_force(&problem);
        for limits in &all_limits[..if problem.parts.len() == 2 { 4 } else { 1 }] {
            match (solve(&problem, limits, None).expect("well-formed"), best) {
                (Outcome::Optimal { assignment, value }, Some(best)) => {
                    assert_eq!(value, best, "round {round}, {limits:?}: {problem:?}");
                    let evaluation = evaluate(&problem, &assignment).expect("well-formed");
                    assert_eq!(
                        (evaluation.value, evaluation.broken),
                        (value, vec![]),
                        "round {round}"
                    );
                    check_alternatives(&problem, &assignment);
                }
                (Outcome::Infeasible { conflict }, None) if *limits == default => {
                    check_conflict(&problem, &conflict)
                }
                (Outcome::Infeasible { .. }, None) => {}
                (outcome, best) => {
                    panic!("round {round}, {limits:?}: {outcome:?}, expected {best:?}: {problem:?}")
                }
            }
        }
        feasible += usize::from(best.is_some());
        infeasible += usize::from(best.is_none());
    }
    assert!(feasible > 150 && infeasible > 60, "{feasible} feasible, {infeasible} infeasible");
}

/// Checks that a conflict is infeasible, that it is feasible without any one of its constraints, and that its amounts are the minimum.
fn check_conflict(problem: &Problem, conflict: &Conflict) {
    assert!(conflict.is_minimal && !conflict.fights.is_empty(), "{conflict:?}: {problem:?}");
    let kept: Vec<_> = conflict.fights.iter().map(|fight| fight.constraint).collect();
    assert_eq!(brute_force(&with_only(problem, &kept)), None, "{conflict:?}: {problem:?}");
    for (index, fight) in conflict.fights.iter().enumerate() {
        let mut others = kept.clone();
        others.remove(index);
        let rest = with_only(problem, &others);
        assert!(
            brute_force(&rest).is_some(),
            "{:?} is not needed: {conflict:?}: {problem:?}",
            fight.constraint
        );
        assert_eq!(
            fight.amount.map(|amount| amount.need),
            amount(&rest, fight.constraint).map(Some),
            "{conflict:?}: {problem:?}"
        );
    }
}

/// The problem with only these constraints. If the constraint that forbids a part is left out, a node on that part costs and uses nothing.
fn with_only(problem: &Problem, kept: &[Constraint]) -> Problem {
    let mut rest = problem.clone();
    for (node, data) in rest.nodes.iter_mut().enumerate() {
        if !kept.contains(&Constraint::Allowed { node }) {
            let nothing =
                grafsynth_split::solve::Choice { cost: 0, uses: vec![0; problem.resources()] };
            data.choices
                .iter_mut()
                .filter(|choice| choice.is_none())
                .for_each(|choice| *choice = Some(nothing.clone()));
        }
    }
    for (part, data) in rest.parts.iter_mut().enumerate() {
        data.pins = data.pins.filter(|_| kept.contains(&Constraint::Pins { part }));
        for (resource, capacity) in data.capacities.iter_mut().enumerate() {
            *capacity =
                capacity.filter(|_| kept.contains(&Constraint::Capacity { part, resource }));
        }
    }
    let sets = |constraint: fn(usize) -> Constraint, len: usize| {
        (0..len).filter(move |&set| kept.contains(&constraint(set)))
    };
    rest.together = sets(|set| Constraint::Together { set }, problem.together.len())
        .map(|set| problem.together[set].clone())
        .collect();
    rest.forbidden = sets(|set| Constraint::Forbidden { set }, problem.forbidden.len())
        .map(|set| problem.forbidden[set].clone())
        .collect();
    rest
}

/// The minimum, over all placements that fit, of the usage that a constraint limits.
fn amount(problem: &Problem, constraint: Constraint) -> Option<u64> {
    let mut assignment = vec![0; problem.nodes.len()];
    let mut least = None;
    loop {
        let evaluation = evaluate(problem, &assignment).expect("well-formed");
        if evaluation.broken.is_empty() {
            let used = evaluation.usage.iter().find(|usage| usage.constraint == constraint)?.used;
            least = Some(least.map_or(used, |least: u64| least.min(used)));
        }
        let Some(node) = assignment.iter().position(|&part| part + 1 < problem.parts.len()) else {
            return least;
        };
        assignment[node] += 1;
        assignment[..node].fill(0);
    }
}

/// Checks that each alternative equals the evaluation of the moved placement.
fn check_alternatives(problem: &Problem, assignment: &[PartIndex]) {
    let table = alternatives(problem, assignment).expect("well-formed");
    for (node, row) in table.iter().enumerate() {
        for (part, alternative) in row.iter().enumerate() {
            let mut moved = assignment.to_vec();
            let mut group = vec![node];
            while let Some(set) = problem.together.iter().find(|set| {
                set.iter().any(|node| group.contains(node))
                    && !set.iter().all(|node| group.contains(node))
            }) {
                group.extend(set);
            }
            group.iter().for_each(|&node| moved[node] = part);
            let evaluation = evaluate(problem, &moved).expect("well-formed");
            match alternative {
                Alternative::Current => assert_eq!(assignment[node], part),
                Alternative::Value(value) => {
                    assert_eq!((*value, &evaluation.broken[..]), (evaluation.value, &[][..]))
                }
                Alternative::NotAllowed => assert!(
                    evaluation
                        .broken
                        .iter()
                        .any(|broken| matches!(broken, Constraint::Allowed { .. }))
                ),
                Alternative::DoesNotFit(usage) => {
                    let broken: Vec<_> =
                        evaluation.usage.iter().filter(|usage| !usage.fits()).copied().collect();
                    assert_eq!(*usage, broken);
                }
                Alternative::Forbidden => assert!(
                    evaluation
                        .broken
                        .iter()
                        .all(|broken| matches!(broken, Constraint::Forbidden { .. }))
                ),
            }
        }
    }
}

#[test]
fn local_search_finds_placements_that_fit_if_there_are_any() {
    let mut prng = Prng::new(11);
    let (mut feasible, mut found, mut best) = (0, 0, 0);
    for _ in 0..200 {
        let problem = random_problem(&mut prng);
        let Some(optimum) = brute_force(&problem) else {
            assert_eq!(improve(&problem, &Limits::default(), None), Ok(None));
            continue;
        };
        feasible += 1;
        if let Some(assignment) = improve(&problem, &Limits::default(), None).expect("well-formed")
        {
            let evaluation = evaluate(&problem, &assignment).expect("well-formed");
            assert!(evaluation.broken.is_empty() && evaluation.value >= optimum);
            found += 1;
            best += usize::from(evaluation.value == optimum);
        }
    }
    assert!(
        found * 10 >= feasible * 9 && best * 10 >= feasible * 8,
        "{feasible} feasible, {found} found, {best} best"
    );
}
