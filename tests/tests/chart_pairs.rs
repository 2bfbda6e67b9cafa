//! `compare` of two charts: different charts are never reported as equal and nearly always refuted by a stimulus, and small equal ones are proved.
//!
//! Whether charts differ is decided here by brute force: all inputs, ticks around every threshold, each pair of states, ten scans deep. It shares
//! nothing with the search under test except the simulator.

#![allow(clippy::print_stdout, reason = "tests say how much they covered")]

use grafsynth_ir::FileId;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{InputKind, Net, Policy};
use grafsynth_sim::{
    ColumnKind, InputRow, Random, Row, Simulator, Stimulus, TraceLayout, Value, breaks_assumption,
    run,
};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::variants::{REWRITES, Rewrite, changed, rewritten};
use grafsynth_tests::{in_parallel, readable, rounds};
use grafsynth_verify::Limits;
use grafsynth_verify::pair::{Apart, Common, SameBy, charts_by_chance, charts_equal, charts_on};
use grafsynth_verify::verdict::Verdict;
use std::collections::{BTreeMap, BTreeSet};

/// The depth of the brute-force search in scans.
const SCANS: usize = 10;
/// The maximum number of reactions for one pair of charts.
const WORK: usize = 40_000;
/// The maximum number of input rows in one state.
const MAX_ROWS: usize = 3_000;

/// Small charts of every kind.
fn features(seed: u64) -> Features {
    let everything = Features {
        max_steps: 6,
        conflict_chains: false,
        several_parts: true,
        ..Features::everything()
    };
    match seed % 4 {
        0 => Features { max_steps: 6, conflict_chains: false, ..Features::plain() },
        1 => Features { conflict_chains: false, max_steps: 6, ..Features::tabular() },
        2 => everything.without_statecharts().some(seed),
        _ => everything.some(seed),
    }
}

/// The cells that both traces have, as the indices of the columns.
struct Shared {
    layouts: [TraceLayout; 2],
    columns: Vec<(usize, usize)>,
    /// For each index in the right list of steps, the index in the left list.
    steps: Vec<u32>,
}

impl Shared {
    fn of(left: &Net, right: &Net) -> Self {
        let layouts = [TraceLayout::of(left), TraceLayout::of(right)];
        let names = |layout: &TraceLayout| -> Vec<String> {
            layout.step_names().map(str::to_owned).collect()
        };
        let (ours, theirs) = (names(&layouts[0]), names(&layouts[1]));
        let sorted = |names: &Vec<String>| names.iter().cloned().collect::<BTreeSet<_>>();
        let same_steps = sorted(&ours) == sorted(&theirs);
        let mut columns = Vec::new();
        for (at, column) in layouts[0].columns.iter().enumerate() {
            let is_given =
                matches!(column.kind, ColumnKind::Scan | ColumnKind::Dt | ColumnKind::Input(_));
            let is_left_out = column.kind == ColumnKind::Steps && !same_steps;
            let twin = layouts[1].columns.iter().position(|other| other.name == column.name);
            if let (false, false, Some(twin)) = (is_given, is_left_out, twin) {
                columns.push((at, twin));
            }
        }
        let place = |name: &String| ours.iter().position(|own| own == name).unwrap_or(0) as u32;
        let steps = if same_steps { theirs.iter().map(place).collect() } else { Vec::new() };
        Shared { layouts, columns, steps }
    }

    fn differ(&self, left: &Row, right: &Row) -> bool {
        let (ours, theirs) = (self.layouts[0].row(left), self.layouts[1].row(right));
        self.columns.iter().any(|(a, b)| match (&ours.values[*a], &theirs.values[*b]) {
            (Value::Steps(ours), Value::Steps(theirs)) => {
                let theirs: BTreeSet<u32> =
                    theirs.iter().map(|step| self.steps[*step as usize]).collect();
                ours.iter().copied().collect::<BTreeSet<_>>() != theirs
            }
            (ours, theirs) => ours != theirs,
        })
    }
}

/// The values of an integer that are worth trying: all if there are few, otherwise the ends, zero, and the neighbours of every constant of either
/// chart.
fn values(nets: [&Net; 2], ty: Type) -> Vec<i64> {
    let (lo, hi) = ty.bounds();
    if hi.abs_diff(lo) < 8 {
        return (lo..=hi).collect();
    }
    let mut values: BTreeSet<i64> = [lo, hi, 0].into();
    for net in nets {
        for expr in net.expressions() {
            let mut todo = vec![expr];
            while let Some(expr) = todo.pop() {
                if let ExprKind::Int(value) = expr.kind {
                    values.extend([value - 1, value, value + 1]);
                }
                todo.extend(expr.children());
            }
        }
    }
    values.into_iter().filter(|value| (lo..=hi).contains(value)).collect()
}

/// Ticks around every constant that a time is compared with or waits for; one value if nothing counts ticks.
fn ticks(nets: [&Net; 2]) -> Vec<u32> {
    let mut constants: BTreeSet<i64> = BTreeSet::new();
    for net in nets {
        for expr in net.expressions() {
            let mut todo = vec![expr];
            while let Some(expr) = todo.pop() {
                if let ExprKind::Compare(_, a, b) = &expr.kind {
                    for (time, constant) in [(a, b), (b, a)] {
                        if let (ExprKind::Leaf(leaf), ExprKind::Int(value)) =
                            (&time.kind, &constant.kind)
                            && leaf.is_time()
                        {
                            constants.insert(*value);
                        }
                    }
                }
                todo.extend(expr.children());
            }
        }
        constants.extend(net.actions.values().map(|action| i64::from(action.duration)));
        constants.extend(net.sends.values().map(|send| i64::from(send.delay)));
    }
    let mut ticks: BTreeSet<u32> = [1].into();
    if !constants.is_empty() {
        ticks.insert(0);
        let around = constants.iter().flat_map(|it| [it - 1, *it, it + 1]);
        ticks.extend(around.filter_map(|it| u32::try_from(it).ok()));
    }
    ticks.into_iter().collect()
}

/// Every pair of rows; `None` if there are too many. One chart must have the inputs of the other.
fn rows(left: &Net, right: &Net) -> Option<Vec<(InputRow, InputRow)>> {
    let mut names: BTreeMap<&str, Type> = BTreeMap::new();
    for net in [left, right] {
        for input in net.inputs.values().filter(|one| one.kind != InputKind::InternalEvent) {
            names.insert(&input.name.text, input.ty);
        }
    }
    let mut all: Vec<BTreeMap<&str, i64>> = vec![BTreeMap::new()];
    for (name, ty) in &names {
        let values = values([left, right], *ty);
        all = all
            .iter()
            .flat_map(|row| {
                values.iter().map(move |value| {
                    let mut row = row.clone();
                    row.insert(name, *value);
                    row
                })
            })
            .collect();
        if all.len() > MAX_ROWS {
            return None;
        }
    }
    let ticks = ticks([left, right]);
    let mut rows = Vec::new();
    for row in &all {
        for dt in &ticks {
            let of = |net: &Net| {
                let mut own = InputRow { dt: *dt, ..InputRow::zero(net) };
                for (id, input) in net.inputs.iter() {
                    if let Some(value) = row.get(input.name.text.as_str()) {
                        own.values[id.index()] = *value;
                    }
                }
                own
            };
            let is_legal = |net: &Net, row: &InputRow| {
                let events = net.inputs.iter().filter(|(_, input)| input.kind.is_event());
                let n_events = events.filter(|(id, _)| row.value(*id) != 0).count();
                let two = net.settings.events_exclusive && n_events > 1;
                !two && !breaks_assumption(net, row)
            };
            let (ours, theirs) = (of(left), of(right));
            if is_legal(left, &ours) && is_legal(right, &theirs) {
                rows.push((ours, theirs));
            }
        }
    }
    (rows.len() <= MAX_ROWS).then_some(rows)
}

/// Whether two charts differ within ten scans; `None` if that is too expensive to find out.
fn differ(left: &Valid<Net>, right: &Valid<Net>, most: usize) -> Option<bool> {
    differ_within(left, right, SCANS, most)
}

fn differ_within(left: &Valid<Net>, right: &Valid<Net>, scans: usize, most: usize) -> Option<bool> {
    let shared = Shared::of(left, right);
    let rows = rows(left, right)?;
    let (mut ours, mut theirs) = (Simulator::new(left), Simulator::new(right));
    if shared.differ(ours.row(), theirs.row()) {
        return Some(true);
    }
    let mut seen = BTreeSet::new();
    let mut level = vec![(ours.state().clone(), theirs.state().clone())];
    let mut work = 0;
    for _ in 0..scans {
        let mut next = Vec::new();
        for (a, b) in &level {
            work += rows.len();
            if work > most {
                return None;
            }
            for (left_row, right_row) in &rows {
                ours.set_state(a);
                theirs.set_state(b);
                ours.step(left_row);
                theirs.step(right_row);
                if shared.differ(ours.row(), theirs.row()) {
                    return Some(true);
                }
                let pair = (ours.state().clone(), theirs.state().clone());
                if seen.insert(pair.clone()) {
                    next.push(pair);
                }
            }
        }
        level = next;
    }
    Some(false)
}

/// Replays the witness like `sim`: two stimulus texts, two traces, and the cell that is reported to differ.
fn replays(left: &Valid<Net>, right: &Valid<Net>, apart: &Apart) -> bool {
    let cell = |net: &Valid<Net>, stimulus: &Stimulus| {
        let (read, found) = Stimulus::parse_csv(net, FileId(0), &stimulus.to_csv(net));
        assert!(found.is_empty(), "{found:?}");
        let csv = run(net, &read.expect("a stimulus")).to_csv();
        let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
        let column = lines[0].iter().rposition(|name| *name == apart.difference.column);
        let mut words: Vec<String> = lines[apart.difference.row + 1][column.expect("the column")]
            .split(' ')
            .map(str::to_owned)
            .collect();
        words.sort();
        words
    };
    cell(left, &apart.left) != cell(right, &apart.right)
}

fn both(left: &Valid<Net>, right: &Valid<Net>) -> String {
    format!("{}\n---- and ----\n{}", readable(left), readable(right))
}

/// The result for one pair.
#[derive(Debug, Clone)]
enum Came {
    /// A stimulus with this many rows shows a difference, as a replay confirmed.
    Refuted(usize),
    /// Proved equal, and the brute force found no difference.
    Proved,
    /// Unknown, with the reason and the result of the brute force.
    Open(String, Option<bool>),
}

fn ask(left: &Valid<Net>, right: &Valid<Net>) -> Option<Came> {
    let common = Common::of(left, right).ok()?;
    let limits = Limits { pairs: 300_000, states: 100_000, ..Limits::default() };
    Some(match charts_equal(left, right, &common, &limits, 1) {
        Verdict::Proved(by) => {
            let found = differ(left, right, WORK);
            assert!(found != Some(true), "{by}, but they differ:\n{}", both(left, right));
            // Random stimuli are tried in addition, because the brute force may not decide.
            let other = charts_by_chance(left, right, &common, 500, 9, 1_000);
            assert!(other.is_ok(), "{by}, but they differ:\n{}", both(left, right));
            Came::Proved
        }
        Verdict::Refuted(apart) => {
            assert!(replays(left, right, &apart), "no witness: {apart:?}\n{}", both(left, right));
            let n_rows = apart.left.len();
            let mut shorter = apart.left.clone();
            shorter.truncate(n_rows.saturating_sub(1));
            let before = charts_on(left, right, &common, &shorter);
            assert!(n_rows == 0 || before.apart.is_none(), "the last row shows it");
            if apart.is_shortest && n_rows > 1 {
                let found = differ_within(left, right, n_rows - 1, 4_000);
                assert!(found != Some(true), "not the shortest: {}", both(left, right));
            }
            Came::Refuted(n_rows)
        }
        Verdict::Open(why) => Came::Open(why.to_string(), differ(left, right, WORK)),
    })
}

/// Tests one pair after another, as many in parallel as there are processors, until enough of them count.
fn until<T: Send>(
    wanted: usize,
    first: u64,
    make: impl Fn(u64) -> Option<T> + Sync,
    counts: impl Fn(&T) -> bool,
) -> Vec<T> {
    let mut all = Vec::new();
    let mut seed = first;
    while all.iter().filter(|one| counts(one)).count() < wanted {
        assert!(seed < first + 20 * wanted as u64 + 100, "too few pairs are usable");
        let seeds: Vec<u64> = (seed..seed + 8.min(wanted as u64)).collect();
        seed += seeds.len() as u64;
        all.extend(in_parallel(&seeds, |seed| make(*seed)).into_iter().flatten());
    }
    all
}

#[test]
fn charts_that_differ_are_refuted() {
    let wanted = rounds(4, 300) as usize;
    let make = |seed| {
        let net = random_net(seed, &features(seed));
        ask(&net, &changed(&net, &mut Random::new(seed)))
    };
    // Pairs that are proved equal count only if they were also compared by brute force.
    let counts = |came: &Came| match came {
        Came::Refuted(rows) => *rows <= SCANS,
        Came::Open(_, found) => *found == Some(true),
        Came::Proved => false,
    };
    let all = until(wanted, 0, make, counts);
    let within = all.iter().filter(|came| counts(came)).count();
    let n_refuted =
        all.iter().filter(|came| matches!(came, Came::Refuted(rows) if *rows <= SCANS)).count();
    let n_later =
        all.iter().filter(|came| matches!(came, Came::Refuted(rows) if *rows > SCANS)).count();
    let n_equal = all.iter().filter(|came| matches!(came, Came::Proved)).count();
    println!(
        "{within} pairs that differ within {SCANS} scans: {n_refuted} refuted, 0 called equal; {n_later} differ later; {n_equal} changes have no effect and are proved"
    );
    for came in &all {
        if let Came::Open(why, found) = came {
            println!("open (brute force: {found:?}): {why}");
        }
    }
    assert!(n_refuted * 100 >= within * 95, "{n_refuted} of {within} are refuted");
}

#[test]
fn equal_charts_are_proved() {
    let wanted = rounds(4, 100) as usize;
    let is_whole = wanted >= 100;
    // For a few pairs the limits are low: the test must be fast, and no proportions are measured.
    let limits = if is_whole {
        Limits::default()
    } else {
        Limits { pairs: 100_000, random_rows: 1_000, ..Limits::default() }
    };
    let make = |seed: u64| {
        let mut random = Random::new(seed);
        let mut on = features(seed);
        let is_sequence = seed % 5 == 4;
        if is_sequence {
            // Sequences, whose steps can be doubled.
            on = Features { policies: vec![Policy::Priority], max_steps: 5, ..Features::tabular() };
            (on.odd_shapes, on.timers, on.conflict_chains) = (false, false, false);
        }
        let net = random_net(seed, &on);
        let mut other = net.clone();
        let mut ways: Vec<Rewrite> = Vec::new();
        for way in REWRITES {
            let wants = (way == Rewrite::Doubled && is_sequence) || random.one_in(2);
            if let Some(new) = wants.then(|| rewritten(&other, way, &mut random)).flatten() {
                other = new;
                ways.push(way);
            }
        }
        let is_small = net.steps.len().max(other.steps.len()) <= 8;
        if !is_small || ways.is_empty() {
            return None;
        }
        let common = Common::of(&net, &other).ok()?;
        assert!(differ(&net, &other, 3_000) != Some(true), "{ways:?}\n{}", both(&net, &other));
        match charts_equal(&net, &other, &common, &limits, 1) {
            Verdict::Proved(by) => Some((ways, Ok(by))),
            Verdict::Refuted(apart) => {
                panic!("{ways:?} {apart:?}\n{}", both(&net, &other))
            }
            Verdict::Open(why) => Some((ways, Err(why.to_string()))),
        }
    };
    let pairs = until(wanted, 10_000, make, |_| true);
    let n_proved = pairs.iter().filter(|(_, settled)| settled.is_ok()).count();
    let by = |is_it: fn(&SameBy) -> bool| {
        pairs.iter().filter(|(_, settled)| settled.as_ref().is_ok_and(is_it)).count()
    };
    println!(
        "{} equal pairs: {n_proved} proved ({} by enumeration, {} by induction, {} by diagrams)",
        pairs.len(),
        by(|by| matches!(by, SameBy::Product { .. })),
        by(|by| matches!(by, SameBy::Induction { .. })),
        by(|by| matches!(by, SameBy::Diagram { .. })),
    );
    for way in REWRITES {
        println!("{way:?}: {}", pairs.iter().filter(|(ways, _)| ways.contains(&way)).count());
    }
    for why in pairs.iter().filter_map(|(_, settled)| settled.as_ref().err()) {
        println!("open: {why}");
    }
    let share = if is_whole { 90 } else { 40 };
    assert!(n_proved * 100 >= pairs.len() * share, "{n_proved} of {} are proved", pairs.len());
}
