//! The comparison for all features of a net (statecharts, sends, qualifiers, edges, tasks): each `dt` and each row of inputs, one by one, with the
//! simulator.

use std::collections::BTreeSet;

use grafsynth_ir::Valid;
use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::net::{InputKind, Leaf, Net};
use grafsynth_sim::{InputRow, Simulator, State, breaks_assumption};
use grafsynth_verify::{Check, Limits, facts, findings};
use indexmap::IndexSet;

use super::{in_parallel, rounds};
use crate::random_net::{Features, random_net};

/// The maximum numbers of input rows, states and reactions.
const MOST: (usize, usize, usize) = (64, 4_000, 400_000);

#[derive(Debug, Default)]
struct Everything {
    situations: BTreeSet<Vec<u64>>,
    fired: BTreeSet<usize>,
    contests: BTreeSet<(usize, usize)>,
    rounds: u32,
    fault: bool,
}

/// One above the largest number of ticks in the net; 0 if it contains none.
fn longest(net: &Net) -> i64 {
    fn walk(expr: &Expr<Leaf>, longest: &mut i64) {
        if let ExprKind::Compare(_, a, b) = &expr.kind {
            for (time, number) in [(a, b), (b, a)] {
                if let (ExprKind::Leaf(leaf), ExprKind::Int(number)) = (&time.kind, &number.kind)
                    && leaf.is_time()
                {
                    *longest = (*longest).max(number + 1);
                }
            }
        }
        expr.children().for_each(|operand| walk(operand, longest));
    }
    let mut longest = 0;
    for expr in net.expressions() {
        walk(expr, &mut longest);
    }
    let others =
        net.actions.values().map(|it| it.duration).chain(net.sends.values().map(|it| it.delay));
    longest.max(others.map(|ticks| i64::from(ticks) + 1).max().unwrap_or(0))
}

fn rows(net: &Net) -> Option<Vec<InputRow>> {
    let mut rows = vec![InputRow::zero(net)];
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind != InputKind::InternalEvent) {
        let (lo, hi) = input.ty.bounds();
        if hi - lo >= 8 || rows.len() > MOST.0 {
            return None;
        }
        let with = |row: &InputRow, value: i64| {
            let mut row = row.clone();
            row.values[id.index()] = value;
            row
        };
        rows = rows
            .iter()
            .flat_map(|row| (lo..=hi).map(|value| with(row, value)).collect::<Vec<_>>())
            .collect();
    }
    let events = |row: &InputRow| {
        net.inputs
            .iter()
            .filter(|(id, it)| it.kind.is_event() && row.values[id.index()] != 0)
            .count()
    };
    rows.retain(|row| {
        !breaks_assumption(net, row) && (!net.settings.events_exclusive || events(row) <= 1)
    });
    (rows.len() <= MOST.0).then_some(rows)
}

fn everything(net: &Valid<Net>) -> Option<Everything> {
    let rows = rows(net)?;
    let longest = u32::try_from(longest(net)).ok().filter(|it| *it < 400)?;
    let mut found = Everything::default();
    let mut simulator = Simulator::new(net);
    let note = |found: &mut Everything, simulator: &Simulator<'_>| {
        found.situations.insert(simulator.state().situation().words().to_vec());
        found.fired.extend(simulator.fired().iter().map(|it| it.index()));
        found.contests.extend(simulator.contests().iter().map(|(a, b)| (a.index(), b.index())));
        found.rounds = found.rounds.max(simulator.rounds());
        found.fault |= simulator.row().fault;
    };
    note(&mut found, &simulator);
    let mut states: IndexSet<State> = IndexSet::from([simulator.state().clone()]);
    let (mut at, mut n_reactions) = (0, 0);
    while let Some(state) = states.get_index(at).cloned() {
        for row in &rows {
            for dt in 0..=longest {
                simulator.set_state(&state);
                simulator.step(&InputRow { dt, ..row.clone() });
                note(&mut found, &simulator);
                states.insert(simulator.state().clone());
                n_reactions += 1;
            }
        }
        if states.len() > MOST.1 || n_reactions > MOST.2 {
            return None;
        }
        at += 1;
    }
    Some(found)
}

/// The differences, and whether time matters; `None` if the net was too large.
fn compare(seed: u64) -> Option<(Vec<String>, bool)> {
    let mut features = Features::everything();
    (features.unspecified, features.max_steps) = (false, 6);
    let net = random_net(seed, &features);
    let truth = everything(&net)?;
    let limits = Limits { pairs: 200_000, image_work: 0, ..Limits::default() };
    let facts = facts(&net, &limits);
    let reach = facts.reach.as_ref()?;
    let mut faults = Vec::new();
    let mut same = |what: &str, said: String, is: String| {
        if said != is {
            faults.push(format!("seed {seed}: {what} {said}, not {is}"));
        }
    };
    same("situations", reach.situations.to_string(), truth.situations.len().to_string());
    let never: Vec<usize> =
        net.transitions.ids().map(|it| it.index()).filter(|it| !truth.fired.contains(it)).collect();
    let said: Vec<usize> = facts.dead_transitions.iter().map(|it| it.index()).collect();
    same("never firing", format!("{said:?}"), format!("{never:?}"));
    if let Some(rounds) = &facts.rounds {
        same("rounds", rounds.value.to_string(), truth.rounds.max(1).to_string());
        same("fault", false.to_string(), truth.fault.to_string());
    }
    let findings = findings(&net, &facts, &limits);
    if findings.checked.iter().any(|it| it.check == Check::Conflicts && it.open.is_none()) {
        let said: BTreeSet<(usize, usize)> =
            findings.decided.iter().map(|it| (it.winner.index(), it.loser.index())).collect();
        same("decided", format!("{said:?}"), format!("{:?}", truth.contests));
    }
    Some((faults, longest(&net) > 0))
}

#[test]
fn what_the_simulator_does_for_every_dt_is_found() {
    let n_nets = rounds(16, 6_000);
    let compared: Vec<(Vec<String>, bool)> =
        in_parallel(n_nets, compare).into_iter().flatten().collect();
    let faults: Vec<&String> = compared.iter().flat_map(|(faults, _)| faults).collect();
    assert!(faults.is_empty(), "{} faults: {faults:#?}", faults.len());
    let n_timed = compared.iter().filter(|(_, is_timed)| *is_timed).count();
    println!("{} nets compared, {n_timed} of them with times", compared.len());
    assert!(n_timed * 10 >= n_nets as usize, "{n_timed}");
}
