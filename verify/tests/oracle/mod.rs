//! Compares the verifier on small random charts with a brute-force search that shares no code with it or with the simulator, but is written from
//! docs/semantics.md. The comparison covers every verdict, the number of situations, the steps and transitions that are never active or never fire, each pair
//! in conflict, and each dead end, for all `dt`.
//!
//! `chart` makes charts, `run` executes one reaction, and `search` tries every reaction from every state with every `dt` up to one above the largest
//! number of ticks in the chart.

mod chart;
mod run;
mod search;
mod simulated;

use chart::{Chart, Span};
use grafsynth_frontend::graf;
use grafsynth_ir::lower::lower;
use grafsynth_ir::net::{Net, PropertyRole, StepId, TransitionId};
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{Simulator, Stimulus};
use grafsynth_verify::{Check, Findings, Limits, Outcome, facts, findings, properties};
use search::{Everything, everything};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};

/// A few rounds by default, many with `GRAFSYNTH_DEEP=1`, and a fraction of these with a larger number.
#[allow(clippy::disallowed_methods, reason = "the environment says how long the tests may take")]
pub(crate) fn rounds(few: u64, many: u64) -> u64 {
    match std::env::var("GRAFSYNTH_DEEP").ok().and_then(|part| part.parse::<u64>().ok()) {
        None | Some(0) => few,
        Some(part) => many.div_ceil(part).max(few),
    }
}

/// Runs `work` for each number below `n`, on all processors.
pub(crate) fn in_parallel<R: Send>(n: u64, work: impl Fn(u64) -> R + Sync) -> Vec<R> {
    let next = AtomicU64::new(0);
    let take = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if at >= n {
                return done;
            }
            done.push(work(at));
        }
    };
    let n_workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..n_workers).map(|_| scope.spawn(take)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a worker")).collect()
    })
}

fn net_of(model: &Chart) -> Valid<Net> {
    let parsed = graf::parse(FileId(0), &model.text());
    let errors = parsed.diagnostics.iter().filter(|one| one.is_error()).count();
    assert_eq!(errors, 0, "{:#?} {}", parsed.diagnostics, model.text());
    let (net, findings) = lower(&parsed.design.expect("a design"));
    net.unwrap_or_else(|| panic!("{findings:#?} {}", model.text()))
}

/// The number of useful checks that one chart gave.
#[derive(Debug, Default, Clone)]
struct Score {
    counted: usize,
    proved: usize,
    refuted: usize,
    open: usize,
    conflicts: usize,
    dead_ends: usize,
    faults: Vec<String>,
}

/// The longest times in the charts; charts that take too long to search are left to the deep runs.
fn longest() -> i64 {
    if rounds(0, 1) == 0 { 600 } else { 5_000 }
}

fn span(seed: u64) -> Span {
    match seed % 8 {
        0 => Span::None,
        1 => Span::One(longest()),
        2 | 3 => Span::Two(60),
        4 => Span::One(60),
        _ => Span::Many(7),
    }
}

fn limits() -> Limits {
    Limits { pairs: 100_000, image_work: 1_000_000, ..Limits::default() }
}

/// The maximum number of states, and of states after time has passed, in the brute-force search.
const MOST: usize = 60_000;

fn is_broken_by(net: &Valid<Net>, property: usize, stimulus: &Stimulus) -> bool {
    let mut simulator = Simulator::new(net);
    for row in stimulus.rows() {
        simulator.step(&row);
    }
    simulator.is_violated(&net.properties[property])
}

fn compare(seed: u64) -> Option<Score> {
    let model = Chart::random(seed, span(seed));
    let truth = everything(&model, MOST)?;
    let net = net_of(&model);
    let mut score = Score::default();
    let mut fault = |text: String| score.faults.push(format!("seed {seed}: {text}"));
    let facts = facts(&net, &limits());
    if let Some(reach) = facts.reach.as_ref().filter(|reach| reach.exact) {
        score.counted = 1;
        if reach.situations != truth.situations.len() as u128 {
            fault(format!("{} situations, not {}", reach.situations, truth.situations.len()));
        }
        let never: BTreeSet<usize> =
            (0..model.steps.len()).filter(|step| !truth.touched.contains(step)).collect();
        let said: BTreeSet<usize> = facts.unreachable_steps.iter().map(|it| it.index()).collect();
        if said != never {
            fault(format!("never active {said:?}, not {never:?}"));
        }
        let never: BTreeSet<usize> =
            (0..model.moves.len()).filter(|it| !truth.fired.contains(it)).collect();
        let said: BTreeSet<usize> = facts.dead_transitions.iter().map(|it| it.index()).collect();
        if said != never {
            fault(format!("never firing {said:?}, not {never:?}"));
        }
    }
    if let (Some(depth), Some(_)) = (&facts.stable_depth, model.stable)
        && (truth.fault || depth.value as usize != truth.depth.max(1))
    {
        fault(format!("depth {}, not {} ({})", depth.value, truth.depth, truth.fault));
    }
    for verdict in properties(&net, &limits()) {
        let at = net.properties[..verdict.property]
            .iter()
            .filter(|it| it.role == PropertyRole::Assert)
            .count();
        let broken = truth.broken[at];
        match (&verdict.outcome, broken) {
            (Outcome::Proved { .. }, None) => score.proved += 1,
            (Outcome::Refuted { stimulus, row, is_shortest }, Some(rows)) => {
                score.refuted += 1;
                if *row != rows && *is_shortest {
                    fault(format!("assertion {at} is broken after {rows} rows, not {row}"));
                }
                if !is_broken_by(&net, verdict.property, stimulus) {
                    fault(format!("the stimulus for assertion {at} does not break it"));
                }
            }
            (Outcome::Open(_), _) => score.open += 1,
            (outcome, broken) => fault(format!("assertion {at}: {outcome:?}, but {broken:?}")),
        }
    }
    let said = findings(&net, &facts, &limits());
    compare_findings(&model, &truth, &said, &mut fault);
    score.conflicts = said.conflicts.len();
    score.dead_ends = said.dead_ends.len();
    Some(score)
}

fn compare_findings(
    model: &Chart,
    truth: &Everything,
    said: &Findings,
    fault: &mut impl FnMut(String),
) {
    let is_checked =
        |check: Check| said.checked.iter().any(|it| it.check == check && it.open.is_none());
    let number = |id: &TransitionId| id.index();
    let all: BTreeSet<(usize, usize)> =
        said.conflicts.iter().map(|it| (number(&it.first), number(&it.second))).collect();
    let differ = |(a, b): &&(usize, usize)| {
        let (a, b) = (&model.moves[*a], &model.moves[*b]);
        (&a.from, &a.to) != (&b.from, &b.to) || !a.acts.is_empty() || !b.acts.is_empty()
    };
    let together: BTreeSet<(usize, usize)> =
        truth.together.iter().filter(differ).copied().collect();
    if !all.is_subset(&together) || is_checked(Check::Conflicts) && all != together {
        fault(format!("conflicts {all:?}, not {together:?}"));
    }
    let decided: BTreeSet<(usize, usize)> =
        said.decided.iter().map(|it| (number(&it.winner), number(&it.loser))).collect();
    if !decided.is_subset(&truth.contests)
        || is_checked(Check::Conflicts) && decided != truth.contests
    {
        fault(format!("decided {decided:?}, not {:?}", truth.contests));
    }
    let dead = &truth.dead;
    let steps = |situation: &Vec<StepId>| situation.iter().map(|it| it.index()).collect();
    let said_dead: BTreeSet<Vec<usize>> = said.dead_ends.iter().map(steps).collect();
    if !said_dead.is_subset(dead) || is_checked(Check::DeadEnds) && said_dead != *dead {
        fault(format!("dead ends {said_dead:?}, not {dead:?}"));
    }
}

#[test]
fn the_verifier_says_what_a_brute_force_finds() {
    let n_charts = rounds(24, 3_600);
    let scores: Vec<Score> = in_parallel(n_charts, compare).into_iter().flatten().collect();
    let faults: Vec<&String> = scores.iter().flat_map(|score| &score.faults).collect();
    assert!(faults.is_empty(), "{} faults: {faults:#?}", faults.len());
    let sum = |of: fn(&Score) -> usize| scores.iter().map(of).sum::<usize>();
    println!(
        "{} charts compared, {} counted, assertions: {} proved, {} refuted, {} open; {} conflicts, {} dead ends",
        scores.len(),
        sum(|it| it.counted),
        sum(|it| it.proved),
        sum(|it| it.refuted),
        sum(|it| it.open),
        sum(|it| it.conflicts),
        sum(|it| it.dead_ends),
    );
    assert!(scores.len() as u64 * 10 >= n_charts * 8, "{} charts compared", scores.len());
    assert!(sum(|it| it.open) * 20 <= sum(|it| it.proved) + sum(|it| it.refuted));
}

/// An open answer is allowed but counted: no false assertion over a timed chart is proved and most are refuted; most true ones are
/// proved.
#[test]
fn true_assertions_are_proved_and_false_ones_refuted() {
    let wanted = rounds(6, 100) as usize;
    let spans = [Span::One(longest()), Span::Two(60), Span::Many(20)];
    let (mut of_true, mut of_false) = ([0_usize; 2], [0_usize; 2]);
    let mut seed = 0;
    while of_true[0] < wanted || of_false[0] < wanted {
        seed += 1;
        let mut model = Chart::random(900_000 + seed, spans[seed as usize % 3]);
        model.asserts.truncate(1);
        let Some(truth) = everything(&model, MOST) else { continue };
        let net = net_of(&model);
        let Some(verdict) = properties(&net, &limits()).pop() else { continue };
        let is_true = truth.broken[0].is_none();
        // A property of unreachable objects is trivial.
        if is_true && truth.situations.len() < 3 || truth.broken[0] == Some(0) {
            continue;
        }
        let is_settled = match verdict.outcome {
            Outcome::Proved { .. } => {
                assert!(is_true, "a false proof: {}", model.text());
                true
            }
            Outcome::Refuted { .. } => {
                assert!(!is_true, "a false counterexample: {}", model.text());
                true
            }
            Outcome::Open(_) => false,
        };
        let count = if is_true { &mut of_true } else { &mut of_false };
        if count[0] < wanted {
            count[0] += 1;
            count[1] += usize::from(is_settled);
        }
    }
    println!(
        "true: {} of {} proved; false: {} of {} refuted",
        of_true[1], of_true[0], of_false[1], of_false[0]
    );
    assert!(of_true[1] * 10 >= of_true[0] * 9 && of_false[1] * 10 >= of_false[0] * 9);
}

/// A long time next to a short one, in forms for which an exploration with a few `dt` finds no counterexample.
#[test]
fn a_long_time_beside_a_short_one_hides_nothing() {
    let race = "chart k { tick 1 ms  conflict priority  output A  assert never bad.active
         initial step s  step good  step bad  initial step w  step late  step done
         s -> bad when s.t >= 2000 ms
         s -> good when s.t >= 5 ms
         w -> late after 1 h
         w -> done when w.t >= 6 ms }";
    let wait = "chart c { tick 1 ms  conflict priority  input a  output o  assert never bad.active
         initial step s  step w  step m  step bad { o }
         s -> w after 3 s
         w -> m when a
         m -> s when m.t >= 1 ms and m.t < 5 ms
         m -> bad when m.t >= 5 ms }";
    for (text, rows) in [(race, 1), (wait, 3)] {
        let parsed = graf::parse(FileId(0), text);
        let net = lower(&parsed.design.expect("a design")).0.expect("a net");
        let verdicts = properties(&net, &Limits::default());
        let Outcome::Refuted { stimulus, row, is_shortest } = &verdicts[0].outcome else {
            panic!("{verdicts:?}");
        };
        assert_eq!((*row, stimulus.len(), *is_shortest), (rows, rows, true));
        assert!(is_broken_by(&net, 0, stimulus));
    }
}
