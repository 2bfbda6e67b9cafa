//! Random problems that are too large for all placements, compared with HiGHS, a solver for linear programs with integers, if Python has its package `highspy`.
//!
//! The problems are written as linear programs here, from the definition of [`Problem`], without any code of the solver.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use crate::common::{Prng, problem_of, series};
use grafsynth_split::solve::{Limits, Outcome, Problem, evaluate, solve};

/// Reads linear programs, and prints a line `minimum N` for each, or `minimum none`; the solver may print other lines.
const SOLVER: &str = "
import highspy, sys
for path in sys.argv[1:]:
    highs = highspy.Highs()
    highs.setOptionValue('output_flag', False)
    highs.setOptionValue('mip_rel_gap', 0)
    highs.setOptionValue('mip_abs_gap', 0)
    highs.readModel(path)
    highs.run()
    status = highs.getModelStatus()
    if status == highspy.HighsModelStatus.kOptimal:
        print('minimum', round(highs.getInfo().objective_function_value))
    elif status in (highspy.HighsModelStatus.kInfeasible, highspy.HighsModelStatus.kUnboundedOrInfeasible):
        print('minimum none')
    else:
        print('minimum unknown')
";

/// A linear program in the LP format: all variables are 0 or 1.
#[derive(Default)]
struct Program {
    objective: String,
    rows: String,
    variables: BTreeSet<String>,
}

impl Program {
    fn variable(&mut self, name: String) -> String {
        self.variables.insert(name.clone());
        name
    }

    fn cost(&mut self, cost: i64, variable: &str) {
        _ = write!(self.objective, " {cost:+} {variable}");
    }

    /// A constraint: the sum of the terms, a relation and a constant.
    fn row(&mut self, terms: &[(i64, String)], relation: &str, constant: i64) {
        for (factor, variable) in terms {
            _ = write!(self.rows, " {factor:+} {variable}");
        }
        _ = writeln!(self.rows, " {relation} {constant}");
    }

    /// The variable of a node on a part.
    fn placed(node: usize, part: usize) -> String {
        format!("x{node}_{part}")
    }

    fn of(problem: &Problem) -> Program {
        let mut all = Program::default();
        let parts = problem.parts.len();
        for (at, node) in problem.nodes.iter().enumerate() {
            let mut places = Vec::new();
            for (part, choice) in node.choices.iter().enumerate() {
                let name = all.variable(Program::placed(at, part));
                match choice {
                    Some(choice) => all.cost(choice.cost, &name),
                    None => all.row(&[(1, name.clone())], "=", 0),
                }
                places.push((1, name));
            }
            all.row(&places, "=", 1);
        }
        let mut pins: Vec<Vec<(i64, String)>> = vec![Vec::new(); parts];
        for (at, wire) in problem.wires.iter().enumerate() {
            let cut = all.variable(format!("c{at}"));
            all.cost(wire.cost as i64, &cut);
            for (part, pins) in pins.iter_mut().enumerate() {
                let pin = all.variable(format!("z{at}_{part}"));
                let driver = Program::placed(wire.driver, part);
                for member in wire.readers.iter().chain([&wire.driver]) {
                    let member = Program::placed(*member, part);
                    if member != driver {
                        let terms = [(1, cut.clone()), (-1, member.clone()), (1, driver.clone())];
                        all.row(&terms, ">=", 0);
                        let terms = [(1, cut.clone()), (1, member.clone()), (-1, driver.clone())];
                        all.row(&terms, ">=", 0);
                    }
                    all.row(&[(1, pin.clone()), (-1, member), (-1, cut.clone())], ">=", -1);
                }
                pins.push((1, pin));
            }
        }
        for (at, one) in problem.presences.iter().enumerate() {
            let present = all.variable(format!("e{at}"));
            all.cost(one.cost as i64, &present);
            for part in &one.on {
                for node in &one.nodes {
                    let node = Program::placed(*node, *part);
                    all.row(&[(1, present.clone()), (-1, node)], ">=", 0);
                }
            }
            pins[one.at].push((one.pins as i64, present));
        }
        all.limits(problem, &pins);
        all
    }

    fn limits(&mut self, problem: &Problem, pins: &[Vec<(i64, String)>]) {
        for (at, part) in problem.parts.iter().enumerate() {
            if let Some(most) = part.pins {
                // A row needs a variable: that of any node.
                let none = (0, Program::placed(0, at));
                let all: Vec<_> = pins[at].iter().cloned().chain([none]).collect();
                self.row(&all, "<=", most as i64 - part.always);
            }
            for (resource, most) in part.capacities.iter().enumerate() {
                let Some(most) = most else { continue };
                let nodes = problem.nodes.iter().enumerate();
                let uses = nodes.filter_map(|(node, it)| {
                    let uses = it.choices[at].as_ref()?.uses[resource];
                    Some((uses as i64, Program::placed(node, at)))
                });
                let uses: Vec<_> = uses.collect();
                if !uses.is_empty() {
                    self.row(&uses, "<=", *most as i64);
                }
            }
            for set in &problem.together {
                for pair in set.windows(2).filter(|pair| pair[0] != pair[1]) {
                    let (a, b) = (Program::placed(pair[0], at), Program::placed(pair[1], at));
                    self.row(&[(1, a), (-1, b)], "=", 0);
                }
            }
        }
        for forbidden in &problem.forbidden {
            let decisions: BTreeSet<(usize, usize)> = forbidden.decisions().into_iter().collect();
            let terms: Vec<(i64, String)> =
                decisions.iter().map(|(node, part)| (1, Program::placed(*node, *part))).collect();
            self.row(&terms, "<=", terms.len() as i64 - 1);
        }
    }

    fn text(&self) -> String {
        let variables: Vec<&str> = self.variables.iter().map(String::as_str).collect();
        format!(
            "Minimize\n obj:{}\nSubject To\n{}Binary\n {}\nEnd\n",
            self.objective,
            self.rows,
            variables.join("\n ")
        )
    }
}

/// The minimum of each problem by HiGHS; the inner `None`: infeasible. `None` if it is not installed.
#[allow(clippy::disallowed_methods, reason = "programs for another solver go through files")]
fn by_highs(problems: &[Problem], folder: &Path) -> Option<Vec<Option<i64>>> {
    let python = |arguments: &[String]| Command::new("python3").args(arguments).output();
    let probe = python(&["-c".to_owned(), "import highspy".to_owned()]);
    if !probe.is_ok_and(|it| it.status.success()) {
        return None;
    }
    std::fs::create_dir_all(folder).expect("a temporary folder");
    let mut arguments = vec!["-c".to_owned(), SOLVER.to_owned()];
    for (at, problem) in problems.iter().enumerate() {
        let path = folder.join(format!("{at}.lp"));
        std::fs::write(&path, Program::of(problem).text()).expect("a temporary file");
        arguments.push(path.display().to_string());
    }
    let output = python(&arguments).expect("it ran before");
    let text = String::from_utf8_lossy(&output.stdout);
    let why = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{why}");
    let one = |line: &str| match line {
        "none" => None,
        value => Some(value.parse().unwrap_or_else(|_| panic!("HiGHS said `{value}`"))),
    };
    let values = text.lines().filter_map(|line| line.strip_prefix("minimum "));
    let all: Vec<Option<i64>> = values.map(one).collect();
    assert_eq!(all.len(), problems.len(), "{text}{why}");
    Some(all)
}

#[test]
fn highs_finds_the_same_optima() {
    let mut prng = Prng::new(29);
    let is_deep = std::env::var_os("GRAFSYNTH_DEEP").is_some();
    let (count, most) = if is_deep { (150, 40) } else { (30, 16) };
    let mut problems: Vec<Problem> = (0..count)
        .map(|_| {
            let parts = 2 + prng.below(3);
            let nodes = 8 + prng.below(most);
            problem_of(&mut prng, parts, nodes)
        })
        .collect();
    problems.extend([20, 50, 100].into_iter().take(if is_deep { 3 } else { 1 }).map(series));
    let folder = std::env::temp_dir().join(format!("grafsynth_highs_{}", std::process::id()));
    let found = by_highs(&problems, &folder);
    #[allow(clippy::disallowed_methods, reason = "its own temporary folder")]
    let _ = std::fs::remove_dir_all(&folder);
    let Some(found) = found else {
        println!("skipped: python3 has no package highspy");
        return;
    };
    let (mut optimal, mut infeasible, mut gaps) = (0, 0, 0);
    for (at, (problem, wanted)) in problems.iter().zip(found).enumerate() {
        match (solve(problem, &Limits::default(), None).expect("well-formed"), wanted) {
            (Outcome::Optimal { assignment, value }, Some(wanted)) => {
                assert_eq!(value, wanted, "problem {at}: {problem:?}");
                assert!(evaluate(problem, &assignment).expect("well-formed").broken.is_empty());
                optimal += 1;
            }
            (Outcome::Best { value, bound, .. }, Some(wanted)) => {
                assert!((bound..=value).contains(&wanted), "problem {at}: {problem:?}");
                gaps += 1;
            }
            (Outcome::Infeasible { .. }, None) => infeasible += 1,
            (Outcome::Unknown { .. }, _) => gaps += 1,
            (outcome, wanted) => panic!("problem {at}: {outcome:?}, HiGHS {wanted:?}: {problem:?}"),
        }
    }
    println!("{optimal} equal optima, {infeasible} infeasible for both, {gaps} with a gap");
    assert!(optimal >= 8 && gaps * 10 <= optimal, "{optimal}, {infeasible}, {gaps}");
}
