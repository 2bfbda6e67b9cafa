//! The comparison for all features of a net (statecharts, sends, qualifiers, edges, tasks): each `dt` and each row of inputs, one by one, with the
//! simulator.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::net::{
    Driver, EdgeOperand, InputKind, Leaf, Net, Policy, Property, PropertyLeaf, PropertyRole,
    StepId, StepKind, TransitionKind,
};
use grafsynth_ir::{Span, Valid, validate};
use grafsynth_sim::{InputRow, Noticed, Random, Simulator, State, breaks_assumption};
use grafsynth_verify::{Check, Limits, Outcome, facts, findings, properties};
use indexmap::IndexMap;

use super::{in_parallel, rounds};
use crate::random_net::{Features, random_net};

/// The maximum numbers of input rows, states and reactions.
const MOST: (usize, usize, usize) = (64, 4_000, 400_000);

#[derive(Debug, Default)]
struct Everything {
    situations: BTreeSet<Vec<u64>>,
    fired: BTreeSet<usize>,
    contests: BTreeSet<(usize, usize)>,
    together: BTreeSet<(usize, usize)>,
    rounds: u32,
    micro_steps: u32,
    fault: bool,
    /// The situations in which nothing ever fires again, except intended ends.
    dead: BTreeSet<Vec<usize>>,
    /// For each assertion, the smallest number of rows that violates it.
    broken: Vec<Option<usize>>,
    /// The number of different notes, by the code of the finding about them.
    noticed: BTreeMap<&'static str, usize>,
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

/// Records the results of a reaction or of the reset; `rows` is its number of rows from the reset.
fn note(found: &mut Everything, net: &Net, simulator: &Simulator<'_>, rows: usize) {
    found.situations.insert(simulator.state().situation().words().to_vec());
    found.fired.extend(simulator.fired().iter().map(|it| it.index()));
    found.contests.extend(simulator.contests().iter().map(|(a, b)| (a.index(), b.index())));
    found.rounds = found.rounds.max(simulator.rounds());
    found.micro_steps = found.micro_steps.max(simulator.micro_steps());
    found.fault |= simulator.row().fault;
    for fired in simulator.firings() {
        for (at, a) in fired.iter().enumerate() {
            for b in &fired[..at] {
                let [first, second] = [a, b].map(|it| &net.transitions[*it]);
                let is_move = [first, second].iter().all(|it| it.kind == TransitionKind::Move);
                if a != b && is_move && first.requires.iter().any(|it| second.requires.contains(it))
                {
                    found.together.insert((a.index().min(b.index()), a.index().max(b.index())));
                }
            }
        }
    }
    let asserts = net.properties.iter().filter(|it| it.role == PropertyRole::Assert);
    for (property, broken) in asserts.zip(&mut found.broken) {
        if broken.is_none() && !simulator.row().open.any() && simulator.is_violated(property) {
            *broken = Some(rows);
        }
    }
}

/// True if the chart is meant to stay in this situation.
fn is_end(net: &Net, situation: &[StepId]) -> bool {
    if net.settings.policy.is_statechart() {
        return situation.iter().any(|step| net.steps[*step].kind == StepKind::Final);
    }
    let is_left = |step: &StepId| {
        net.transitions.values().any(|transition| transition.requires.contains(step))
    };
    !situation.iter().any(is_left)
}

fn everything(net: &Valid<Net>) -> Option<Everything> {
    let rows = rows(net)?;
    let longest = u32::try_from(longest(net)).ok().filter(|it| *it < 400)?;
    let n_asserts = net.properties.iter().filter(|it| it.role == PropertyRole::Assert).count();
    let mut found = Everything { broken: vec![None; n_asserts], ..Everything::default() };
    let mut simulator = Simulator::new(net);
    note(&mut found, net, &simulator, 0);
    let mut states: IndexMap<State, usize> = IndexMap::new();
    states.insert(simulator.state().clone(), 0);
    let mut edges: Vec<(usize, usize, bool)> = Vec::new();
    let (mut at, mut n_reactions) = (0, 0);
    while let Some((state, depth)) = states.get_index(at).map(|(a, b)| (a.clone(), *b)) {
        for row in &rows {
            for dt in 0..=longest {
                simulator.set_state(&state);
                simulator.step(&InputRow { dt, ..row.clone() });
                note(&mut found, net, &simulator, depth + 1);
                let next = simulator.state();
                let to = match states.get_index_of(next) {
                    Some(to) => to,
                    None => states.insert_full(next.clone(), depth + 1).0,
                };
                edges.push((at, to, !simulator.fired().is_empty()));
                n_reactions += 1;
            }
        }
        edges.sort_unstable();
        edges.dedup();
        if states.len() > MOST.1 || n_reactions > MOST.2 {
            return None;
        }
        at += 1;
    }
    for (noticed, _) in simulator.notes().iter() {
        let code = match noticed {
            Noticed::Saturated(..) | Noticed::ArgumentSaturated(..) => "G0810",
            Noticed::Race(..) => "G0806",
            Noticed::Resent(_) | Noticed::QueueFull(_) => "G0807",
            Noticed::LimitReached => "G0805",
            Noticed::ForcingRace(_) => "G0811",
        };
        *found.noticed.entry(code).or_default() += 1;
    }
    let mut alive = vec![false; states.len()];
    edges.iter().filter(|(_, _, fires)| *fires).for_each(|(from, _, _)| alive[*from] = true);
    loop {
        let before = alive.clone();
        for (from, to, _) in &edges {
            alive[*from] |= alive[*to];
        }
        if alive == before {
            break;
        }
    }
    for (state, _) in states.keys().zip(alive).filter(|(_, is_alive)| !is_alive) {
        let situation: Vec<StepId> = state.situation().iter().collect();
        if !net.transitions.is_empty() && !is_end(net, &situation) {
            found.dead.insert(situation.iter().map(|step| step.index()).collect());
        }
    }
    Some(found)
}

/// Adds features that matter to the exploration of classes of rows: edges of one input in several places, also mixed with steps, output conditions and
/// assertions over inputs, exclusive events, and short queues.
fn spiced(net: &Valid<Net>, seed: u64) -> Option<Valid<Net>> {
    let mut random = Random::new(seed ^ 0x5eed);
    let mut net = Net::clone(net);
    let flags: Vec<Expr<Leaf>> = (net.inputs.iter())
        .filter(|(_, it)| it.ty == Type::Bool && it.kind == InputKind::Pin)
        .map(|(id, _)| Expr::leaf(Leaf::Input(id), Span::default()))
        .collect();
    net.settings.events_exclusive |= random.one_in(4);
    if net.settings.policy.is_statechart() && random.one_in(2) {
        net.settings.queue = Some(1 + random.below(3) as u32);
    }
    let steps: Vec<StepId> = net.steps.ids().collect();
    if !flags.is_empty() && random.one_in(2) {
        for _ in 0..1 + random.below(2) {
            let mut operand = random.pick(&flags)?.clone();
            if random.one_in(3) {
                let step = Expr::leaf(Leaf::Active(*random.pick(&steps)?), Span::default());
                operand = Expr::and([operand, step]);
            }
            let edge = net.edges.push(EdgeOperand { expr: operand });
            for transition in net.transitions.values_mut() {
                if random.one_in(3) {
                    let leaf = if random.one_in(2) { Leaf::Rise(edge) } else { Leaf::Fall(edge) };
                    let both = [transition.guard.clone(), Expr::leaf(leaf, Span::default())];
                    transition.guard =
                        if random.one_in(2) { Expr::and(both) } else { Expr::or(both) };
                }
            }
        }
    }
    for output in net.outputs.values_mut() {
        if let Driver::Continuous(emissions) = &mut output.driver {
            for emission in emissions {
                if let (true, Some(flag)) = (random.one_in(3), random.pick(&flags)) {
                    emission.condition = Some(flag.clone());
                }
            }
        }
    }
    let mut leaves: Vec<PropertyLeaf> =
        steps.iter().map(|step| PropertyLeaf::Net(Leaf::Active(*step))).collect();
    leaves.extend(flags.iter().flat_map(Expr::leaves).map(|leaf| PropertyLeaf::Net(*leaf)));
    let outputs = net.outputs.iter().filter(|(_, it)| it.ty == Type::Bool && !it.is_extern());
    leaves.extend(outputs.map(|(id, _)| PropertyLeaf::Output(id)));
    for _ in 0..random.below(4) {
        let mut all = Vec::new();
        for _ in 0..2 + random.below(2) {
            let leaf = Expr::leaf(*random.pick(&leaves)?, Span::default());
            all.push(if random.one_in(3) { leaf.not() } else { leaf });
        }
        net.properties.push(Property {
            name: String::new(),
            role: PropertyRole::Assert,
            never: Expr::and(all),
            meta: Default::default(),
        });
    }
    validate(net).ok()
}

fn features(seed: u64) -> Features {
    let everything = Features { unspecified: false, max_steps: 6, ..Features::everything() };
    match seed % 4 {
        0 => everything,
        1 => Features {
            policies: vec![Policy::InnerFirst, Policy::OuterFirst],
            max_steps: 4,
            delayed_sends: seed % 8 == 1,
            ..everything
        },
        2 => Features { max_steps: 4, ..Features::everything().some(seed) },
        _ => Features { unspecified: false, max_steps: 4, timers: false, ..everything.some(seed) },
    }
}

/// The differences, whether time matters, and how many checks were answered without an enumeration; `None` if the net was too large.
fn compare(seed: u64) -> Option<(Vec<String>, bool, usize)> {
    let net = random_net(seed, &features(seed));
    let net = if seed.is_multiple_of(4) { net } else { spiced(&net, seed)? };
    let truth = everything(&net)?;
    let mut faults = Vec::new();
    let enumeration = Limits { pairs: 200_000, image_work: 0, ..Limits::default() };
    compare_with(&net, &truth, &enumeration, &mut |fault| faults.push(format!("{seed}: {fault}")));
    // Other methods must answer, or leave open, what an enumeration cannot.
    let others = Limits { pairs: 3, random_rows: 500, image_work: 200_000, ..Limits::default() };
    let answered = compare_with(&net, &truth, &others, &mut |fault| {
        faults.push(format!("{seed}, without enumeration: {fault}"));
    });
    Some((faults, longest(&net) > 0, answered))
}

/// Compares all answers within these limits; returns the number of checks that were answered.
fn compare_with(
    net: &Valid<Net>,
    truth: &Everything,
    limits: &Limits,
    fault: &mut dyn FnMut(String),
) -> usize {
    let facts = facts(net, limits);
    let mut same = |what: &str, said: String, is: String| {
        if said != is {
            fault(format!("{what} {said}, not {is}"));
        }
    };
    if let Some(reach) = facts.reach.as_ref().filter(|reach| reach.exact) {
        same("situations", reach.situations.to_string(), truth.situations.len().to_string());
    }
    let never: Vec<usize> =
        net.transitions.ids().map(|it| it.index()).filter(|it| !truth.fired.contains(it)).collect();
    let said: Vec<usize> = facts.dead_transitions.iter().map(|it| it.index()).collect();
    if facts.all_dead_known {
        same("never firing", format!("{said:?}"), format!("{never:?}"));
    }
    if let Some(rounds) = &facts.rounds {
        same("rounds", rounds.value.to_string(), truth.rounds.max(1).to_string());
        same("fault", false.to_string(), truth.fault.to_string());
    }
    if let Some(depth) = &facts.stable_depth {
        same("depth", depth.value.to_string(), truth.micro_steps.max(1).to_string());
    }
    let findings = findings(net, &facts, limits);
    let is_checked =
        |check: Check| findings.checked.iter().any(|it| it.check == check && it.open.is_none());
    if is_checked(Check::Conflicts) {
        let said: BTreeSet<(usize, usize)> =
            findings.decided.iter().map(|it| (it.winner.index(), it.loser.index())).collect();
        same("decided", format!("{said:?}"), format!("{:?}", truth.contests));
        let said: BTreeSet<(usize, usize)> =
            findings.conflicts.iter().map(|it| (it.first.index(), it.second.index())).collect();
        // Pairs with the same effect are not findings.
        let all = net.transitions.values().collect::<Vec<_>>();
        let differ = |(a, b): &&(usize, usize)| {
            (&all[*a].requires, &all[*a].enters) != (&all[*b].requires, &all[*b].enters)
                || said.contains(&(*a, *b))
        };
        if net.settings.policy == Policy::All {
            let together: BTreeSet<_> = truth.together.iter().filter(differ).copied().collect();
            same("conflicts", format!("{said:?}"), format!("{together:?}"));
        }
    }
    if is_checked(Check::DeadEnds) {
        let steps = |situation: &Vec<StepId>| situation.iter().map(|it| it.index()).collect();
        let said: BTreeSet<Vec<usize>> = findings.dead_ends.iter().map(steps).collect();
        same("dead ends", format!("{said:?}"), format!("{:?}", truth.dead));
    }
    if is_checked(Check::Livelock) {
        let said = findings.found.iter().any(|it| it.code.id == "G0805");
        same("livelock", said.to_string(), truth.noticed.contains_key("G0805").to_string());
    }
    if is_checked(Check::Races) {
        for code in ["G0806", "G0807", "G0810", "G0811"] {
            let said = findings.found.iter().filter(|it| it.code.id == code).count();
            let is = truth.noticed.get(code).copied().unwrap_or(0);
            same(code, said.to_string(), is.to_string());
        }
    }
    for (verdict, broken) in properties(net, limits).iter().zip(&truth.broken) {
        match (&verdict.outcome, broken) {
            (Outcome::Proved { .. }, None) | (Outcome::Open(_), _) => {}
            (Outcome::Refuted { row, is_shortest, .. }, Some(rows)) => {
                if *is_shortest {
                    same("rows of a violation", row.to_string(), rows.to_string());
                }
            }
            (outcome, broken) => same("verdict", format!("{outcome:?}"), format!("{broken:?}")),
        }
    }
    findings.checked.iter().filter(|it| it.open.is_none()).count()
}

#[test]
fn what_the_simulator_does_for_every_dt_is_found() {
    let n_nets = rounds(24, 6_000);
    let compared: Vec<(Vec<String>, bool, usize)> =
        in_parallel(n_nets, compare).into_iter().flatten().collect();
    let faults: Vec<&String> = compared.iter().flat_map(|(faults, ..)| faults).collect();
    assert!(faults.is_empty(), "{} faults: {faults:#?}", faults.len());
    let n_timed = compared.iter().filter(|(_, is_timed, _)| *is_timed).count();
    let n_answered: usize = compared.iter().map(|(.., answered)| answered).sum();
    println!(
        "{} nets compared, {n_timed} of them with times; {n_answered} checks answered without enumeration",
        compared.len()
    );
    assert!(n_answered > compared.len());
    assert!(n_timed * 10 >= n_nets as usize, "{n_timed}");
}
