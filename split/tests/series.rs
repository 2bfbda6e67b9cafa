//! Problems with known optima, up to thousands of nodes.

use crate::common::series;
use grafsynth_split::solve::{Limits, Outcome, evaluate, improve, solve};

/// The optima of the series, found by two other solvers.
const OPTIMA: [(usize, i64); 6] =
    [(20, 154), (50, 487), (100, 983), (300, 2886), (1000, 9940), (3000, 29315)];

#[test]
fn the_series_is_solved_to_its_known_optima() {
    for (steps, optimum) in OPTIMA.into_iter().take(4) {
        let problem = series(steps);
        let outcome = solve(&problem, &Limits::default(), None).expect("well-formed");
        let Outcome::Optimal { assignment, value } = outcome else {
            panic!("{steps} steps: {outcome:?}")
        };
        assert_eq!(-value, optimum, "{steps} steps");
        assert_eq!(
            evaluate(&problem, &assignment).expect("well-formed").broken,
            [],
            "{steps} steps"
        );
    }
}

#[test]
fn local_search_alone_is_near_the_known_optima() {
    for (steps, optimum) in OPTIMA.into_iter().take(4) {
        let problem = series(steps);
        let assignment = improve(&problem, &Limits::default(), None)
            .expect("well-formed")
            .expect("a placement that fits");
        let value = -evaluate(&problem, &assignment).expect("well-formed").value;
        assert!(
            value * 10 >= optimum * 9 && value <= optimum,
            "{steps} steps: {value}, optimum {optimum}"
        );
    }
}

/// The processor time that this thread has used, in seconds; a busy machine does not change it. Linux only, otherwise 0.
#[allow(clippy::disallowed_methods, reason = "a measurement")]
fn seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace()
        .next()
        .and_then(|nanoseconds| nanoseconds.parse::<f64>().ok())
        .unwrap_or_default()
        * 1e-9
}

#[test]
#[ignore = "prints times, for a release build"]
fn table() {
    println!("| steps | known optimum | local search | CPU s | solved | bound | gap % | CPU s |");
    for steps in [20, 50, 100, 300, 1000, 3000, 10_000] {
        let problem = series(steps);
        let known = OPTIMA
            .iter()
            .find(|known| known.0 == steps)
            .map_or("-".to_owned(), |known| known.1.to_string());
        let start = seconds();
        let assignment = improve(&problem, &Limits::default(), None)
            .expect("well-formed")
            .expect("a placement that fits");
        let local =
            (-evaluate(&problem, &assignment).expect("well-formed").value, seconds() - start);
        let start = seconds();
        let (value, bound) = match solve(&problem, &Limits::default(), None).expect("well-formed") {
            Outcome::Optimal { value, .. } => (-value, -value),
            Outcome::Best { value, bound, .. } => (-value, -bound),
            other => panic!("{other:?}"),
        };
        let gap = 100.0 * (bound - value) as f64 / value as f64;
        println!(
            "| {steps} | {known} | {} | {:.2} | {value} | {bound} | {gap:.3} | {:.2} |",
            local.0,
            local.1,
            seconds() - start
        );
    }
}
