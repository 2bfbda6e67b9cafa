//! Extreme and malformed problems, warm starts, and solving again after a fit failed.

use crate::common::{Prng, random_problem, series, three_parts};
use grafsynth_split::solve::{
    Choice, Constraint, Forbidden, Limits, Node, Outcome, Part, Presence, Problem, Wire,
    alternatives, evaluate, solve,
};

/// Two parts; each node costs these amounts on them, and uses 1 of the only resource on part 0.
fn two_parts(capacity: Option<u64>, costs: &[(i64, i64)]) -> Problem {
    let part = |capacity| Part { capacities: vec![capacity], ..Part::default() };
    let choice = |cost, amount| Some(Choice { cost, uses: vec![amount] });
    let nodes = costs
        .iter()
        .map(|&(first, second)| Node { choices: vec![choice(first, 1), choice(second, 0)] })
        .collect();
    Problem { parts: vec![part(capacity), part(None)], nodes, ..Problem::default() }
}

fn optimum(problem: &Problem) -> (Vec<usize>, i64) {
    match solve(problem, &Limits::default(), None) {
        Ok(Outcome::Optimal { assignment, value }) => (assignment, value),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_problem_without_nodes_is_solved() {
    assert_eq!(optimum(&two_parts(Some(0), &[])), (vec![], 0));
}

#[test]
fn the_largest_numbers_are_added_without_overflow() {
    let most = 1 << 30;
    let mut problem = two_parts(Some(u64::MAX), &[(-most, most); 40]);
    for (index, node) in problem.nodes.iter_mut().enumerate() {
        node.choices.iter_mut().flatten().for_each(|choice| choice.uses = vec![1 << 30]);
        problem.wires.push(Wire { driver: index, readers: (0..40).collect(), cost: 1 << 30 });
        problem.presences.push(Presence::pins(vec![index, (index + 7) % 40], 0, 1));
    }
    assert_eq!(optimum(&problem).1, -40 * most);
    problem.parts[0].capacities = vec![Some(20 << 30)];
    problem.parts[1].capacities = vec![Some(25 << 30)];
    problem.parts[0].pins = Some(u64::MAX);
    let (assignment, value) = optimum(&problem);
    assert_eq!(evaluate(&problem, &assignment).expect("well-formed").broken, []);
    assert_eq!(value, 40 * most);
}

#[test]
fn malformed_problems_are_errors() {
    let good = two_parts(Some(1), &[(0, 1)]);
    let mut problems =
        vec![Problem::default(), Problem { parts: good.parts[..1].to_vec(), ..good.clone() }];
    let mut change = |change: fn(&mut Problem)| {
        let mut problem = good.clone();
        change(&mut problem);
        problems.push(problem);
    };
    change(|problem| problem.parts[1].capacities = vec![]);
    change(|problem| problem.nodes[0].choices.truncate(1));
    change(|problem| problem.nodes[0].choices[0] = Some(Choice { cost: i64::MIN, uses: vec![0] }));
    change(|problem| problem.nodes[0].choices[0] = Some(Choice { cost: 0, uses: vec![u64::MAX] }));
    change(|problem| problem.nodes[0].choices[0] = Some(Choice::default()));
    change(|problem| problem.wires.push(Wire { driver: 1, readers: vec![0], cost: 0 }));
    change(|problem| problem.presences.push(Presence::pins(vec![1], 0, 1)));
    change(|problem| problem.presences.push(Presence::pins(vec![0], 2, 1)));
    change(|problem| problem.parts[0].always = i64::MIN);
    change(|problem| problem.together.push(vec![0, 1]));
    change(|problem| problem.forbidden.push(Forbidden::Decisions(vec![(0, 2)])));
    for problem in &problems {
        let error = solve(problem, &Limits::default(), None).expect_err("malformed").to_string();
        assert!(!error.is_empty());
        assert!(evaluate(problem, &[0]).is_err() && alternatives(problem, &[0]).is_err());
    }
    assert!(solve(&good, &Limits::default(), Some(&[])).is_err());
    assert!(solve(&good, &Limits::default(), Some(&[2])).is_err());
}

#[test]
fn an_impossible_problem_names_what_is_needed() {
    let mut problem = two_parts(Some(3), &[(0, 1); 6]);
    for node in &mut problem.nodes[1..6] {
        node.choices[1] = None;
    }
    let Ok(Outcome::Infeasible { conflict }) = solve(&problem, &Limits::default(), None) else {
        panic!("not infeasible")
    };
    assert!(conflict.is_minimal);
    let capacity = conflict.fights.iter().find_map(|fight| fight.amount).expect("a capacity");
    assert_eq!(
        (capacity.need, capacity.have, conflict.fights.len()),
        (Some(4), 3, 5),
        "any four of the five nodes, and the capacity"
    );
}

#[test]
fn impossible_nodes_and_sets_are_conflicts() {
    let mut nowhere = two_parts(None, &[(0, 1)]);
    nowhere.nodes[0].choices = vec![None, None];
    let mut empty = two_parts(None, &[(0, 1)]);
    empty.forbidden.push(Forbidden::Decisions(vec![]));
    for (problem, constraint) in
        [(nowhere, Constraint::Allowed { node: 0 }), (empty, Constraint::Forbidden { set: 0 })]
    {
        let Ok(Outcome::Infeasible { conflict }) = solve(&problem, &Limits::default(), None) else {
            panic!("not infeasible")
        };
        assert_eq!(
            conflict.fights.iter().map(|fight| fight.constraint).collect::<Vec<_>>(),
            [constraint]
        );
    }
}

/// As if real fits failed, each answer is forbidden, until none is left. The values never decrease, and each placement is found once.
#[test]
fn forbidding_each_answer_enumerates_all_placements() {
    for are_decisions in [true, false] {
        let mut problem = two_parts(Some(3), &[(3, 4), (1, 9), (7, 2), (5, 5)]);
        problem.wires.push(Wire { driver: 0, readers: vec![1, 2], cost: 2 });
        let mut values = Vec::new();
        while let Ok(Outcome::Optimal { assignment, value }) =
            solve(&problem, &Limits::default(), None)
        {
            values.push(value);
            problem.forbidden.push(if are_decisions {
                Forbidden::Decisions(assignment.into_iter().enumerate().collect())
            } else {
                Forbidden::Together {
                    nodes: (0..4).filter(|&node| assignment[node] == 0).collect(),
                    part: 0,
                }
            });
            assert!(values.len() <= 15, "more answers than placements");
        }
        assert!(values.is_sorted(), "{values:?}");
        assert!(
            if are_decisions { values.len() == 15 } else { (2..15).contains(&values.len()) },
            "{values:?}"
        );
    }
}

#[test]
fn any_warm_start_gives_the_same_optimum() {
    let mut prng = Prng::new(5);
    for _ in 0..40 {
        let problem = random_problem(&mut prng);
        let warm: Vec<_> = problem.nodes.iter().map(|_| prng.below(problem.parts.len())).collect();
        let cold = solve(&problem, &Limits::default(), None).expect("well-formed");
        let warm = solve(&problem, &Limits::default(), Some(&warm)).expect("well-formed");
        match (cold, warm) {
            (Outcome::Optimal { value: cold, .. }, Outcome::Optimal { value: warm, .. }) => {
                assert_eq!(cold, warm)
            }
            (Outcome::Infeasible { conflict: cold }, Outcome::Infeasible { conflict: warm }) => {
                assert_eq!(cold, warm)
            }
            other => panic!("{other:?}"),
        }
    }
}

/// With little work the answer is a placement that fits and a bound, or a bound; never a wrong claim.
#[test]
fn little_work_gives_bounds_that_hold() {
    let mut prng = Prng::new(3);
    let mut stopped = 0;
    for round in 0..30 {
        let problem = if round % 2 == 0 { three_parts(&mut prng, 10) } else { series(10 + round) };
        let (_, optimum) = optimum(&problem);
        for limits in [
            Limits { passes: 0, cuts: 0, tree: 0, program: 0 },
            Limits { passes: 1, cuts: 3, tree: 0, program: 1000 },
        ] {
            match solve(&problem, &limits, None).expect("well-formed") {
                Outcome::Optimal { value, .. } => assert_eq!(value, optimum),
                Outcome::Best { assignment, value, bound } => {
                    stopped += 1;
                    let evaluation = evaluate(&problem, &assignment).expect("well-formed");
                    assert_eq!((evaluation.value, evaluation.broken), (value, vec![]));
                    assert!(bound <= optimum && optimum <= value);
                }
                Outcome::Unknown { bound } => {
                    stopped += 1;
                    assert!(bound <= optimum);
                }
                Outcome::Infeasible { conflict } => panic!("{conflict:?}"),
            }
        }
    }
    assert!(stopped > 20, "{stopped}");
}
