//! A longer tick for a design that does not fit: its times then need fewer registers, but some of them change.
//! Each time is rounded up to whole ticks, as if the chart declared this tick, and the design is fitted with the rounded times. The chart itself is not
//! changed: the suggestion names each time that would change.

use super::{Trial, bits, duration, fit};
use crate::circuit;
use crate::coding::EncodingCache;
use crate::context::BuildContext;
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{Driver, Expr, Leaf, Net};
use grafsynth_ir::walk::change_statements;
use grafsynth_ir::{counted, validate};
use std::collections::BTreeSet;

/// The factors that are tried for the tick if the longer tick is not a common divisor of all times.
const LONGER: [u64; 12] = [2, 3, 4, 5, 10, 20, 50, 100, 200, 500, 1000, 10_000];
/// The longest common divisor that is tried, in ticks.
const LONGEST_COMMON: u64 = 100_000;

/// A longer tick with which the design fits, as a sentence: the shortest that changes no time, or else the shortest that fits. `None` if the design fits with
/// none of the tried ticks, or if the chart reads no time.
pub(super) fn tick(asked: &BuildContext<'_>, trial: &Trial) -> Option<String> {
    let net: &Net = asked.net;
    let times = times(net);
    // Times of actions, of sends and in properties have no comparison that could be rounded.
    let is_elsewhere = net.actions.values().any(|action| action.duration > 0)
        || !net.sends.is_empty()
        || net
            .properties
            .iter()
            .any(|one| one.never.leaves().filter_map(|leaf| leaf.net()).any(|leaf| leaf.is_time()));
    let longest = times.iter().map(|(_, ticks)| *ticks).max().filter(|_| !is_elsewhere)?;
    let common = times.iter().map(|(_, ticks)| *ticks).fold(0, gcd);
    let exact = (2..=common.min(LONGEST_COMMON)).filter(|factor| common.is_multiple_of(*factor));
    let rounded = LONGER.into_iter().filter(|factor| *factor <= longest);
    let (factor, (n_cells, n_terms)) = shortest(asked, trial, &times, exact)
        .or_else(|| shortest(asked, trial, &times, rounded))?;
    Some(sentence(net, &times, factor, n_cells, n_terms))
}

/// The smallest of these factors with which the design fits, with its macrocells and product terms. Of factors with equally many registers only the first is
/// considered; of the others, as many are tried as a binary search needs.
fn shortest(
    asked: &BuildContext<'_>,
    trial: &Trial,
    times: &BTreeSet<(Leaf, u64)>,
    factors: impl Iterator<Item = u64>,
) -> Option<(u64, (usize, usize))> {
    let n_bits =
        |factor: u64| times.iter().map(|(_, ticks)| bits(ticks.div_ceil(factor))).sum::<u32>();
    let mut before = n_bits(1);
    let mut all: Vec<u64> = Vec::new();
    for factor in factors {
        if n_bits(factor) < before {
            before = n_bits(factor);
            all.push(factor);
        }
    }
    let longest = all.pop()?;
    let mut found = (longest, fits(asked, trial, longest)?);
    while !all.is_empty() {
        let at = all.len() / 2;
        match fits(asked, trial, all[at]) {
            Some(sizes) => {
                found = (all[at], sizes);
                all.truncate(at);
            }
            None => {
                all.drain(..=at);
            }
        }
    }
    Some(found)
}

fn sentence(
    net: &Net,
    times: &BTreeSet<(Leaf, u64)>,
    factor: u64,
    n_cells: usize,
    n_terms: usize,
) -> String {
    let tick = net.settings.tick_ns;
    let changed: Vec<String> = (times.iter())
        .filter(|(_, ticks)| !ticks.is_multiple_of(factor))
        .map(|(leaf, ticks)| {
            format!(
                "`{}` from {} to {}",
                name(net, *leaf),
                duration(tick * ticks),
                duration(tick * factor * ticks.div_ceil(factor))
            )
        })
        .collect();
    let longer = duration(tick * factor);
    let changes = if changed.is_empty() {
        "no time of the chart changes".to_owned()
    } else {
        format!("these times change: {}", changed.join(", "))
    };
    format!(
        "with `tick {longer}` (in rules `# option: tick {longer}`) instead of {} it fits ({}, {}): {changes}, and all times are only accurate to {longer}",
        duration(tick),
        counted(n_cells, "macrocell", "macrocells"),
        counted(n_terms, "product term", "product terms")
    )
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn name(net: &Net, leaf: Leaf) -> &str {
    match leaf {
        Leaf::Elapsed(step) | Leaf::LastElapsed(step) => &net.steps[step].name.text,
        Leaf::Timer(timer) => &net.timers[timer].name.text,
        _ => "",
    }
}

/// The number of macrocells and product terms with the longer tick, if the design fits.
fn fits(asked: &BuildContext<'_>, trial: &Trial, factor: u64) -> Option<(usize, usize)> {
    let mut net = (**asked.net).clone();
    net.settings.tick_ns = net.settings.tick_ns.checked_mul(factor)?;
    change_times(&mut net, &mut |ticks| ticks.div_ceil(factor));
    let net = validate(net).ok()?;
    let facts = circuit::facts(&net, &asked.options.limits);
    let logic = circuit::logic_as(&net, &facts, asked.options.busy).ok()?;
    let own_timers = circuit::logic_with_own_timers(&net, &facts, asked.options.busy);
    let slower = BuildContext {
        net: &net,
        facts: &facts,
        logic: &logic,
        own_timers: own_timers.as_ref(),
        ..*asked
    };
    let (_, n_cells, n_terms) = fit(&slower, trial, &mut EncodingCache::default())?;
    Some((n_cells, n_terms))
}

/// The times of the chart that are compared with numbers of ticks above 0.
fn times(net: &Net) -> BTreeSet<(Leaf, u64)> {
    let mut times = BTreeSet::new();
    for expr in net.expressions().flat_map(Expr::subexpressions) {
        if let ExprKind::Compare(_, a, b) = &expr.kind
            && let (ExprKind::Leaf(leaf), ExprKind::Int(ticks))
            | (ExprKind::Int(ticks), ExprKind::Leaf(leaf)) = (&a.kind, &b.kind)
            && leaf.is_time()
            && let Ok(ticks @ 1..) = u64::try_from(*ticks)
        {
            times.insert((*leaf, ticks));
        }
    }
    times
}

/// Replaces the number of ticks in each comparison of a time.
fn change_times(net: &mut Net, change: &mut impl FnMut(u64) -> u64) {
    let mut one = |expr: &mut Expr| change_in(expr, change);
    for output in net.outputs.values_mut() {
        match &mut output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                emissions.iter_mut().filter_map(|it| it.condition.as_mut()).for_each(&mut one);
            }
            Driver::Extern { calls, .. } => {
                for call in calls {
                    call.condition.iter_mut().chain(&mut call.arguments).for_each(&mut one);
                }
            }
            Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
        }
    }
    net.emergency.iter_mut().for_each(|emergency| one(&mut emergency.condition));
    net.timers.values_mut().for_each(|timer| one(&mut timer.condition));
    net.edges.values_mut().for_each(|edge| one(&mut edge.expr));
    net.transitions.values_mut().for_each(|transition| one(&mut transition.guard));
    for action in net.actions.values_mut() {
        action.uses.iter_mut().filter_map(|it| it.condition.as_mut()).for_each(&mut one);
    }
    for list in net.lists_mut() {
        change_statements(list, &mut |stmt| stmt.exprs_mut().for_each(&mut one));
    }
    net.unspecified.iter_mut().for_each(|open| one(&mut open.when));
}

fn change_in(expr: &mut Expr, change: &mut impl FnMut(u64) -> u64) {
    if let ExprKind::Compare(_, a, b) = &mut expr.kind
        && let (ExprKind::Leaf(leaf), ExprKind::Int(ticks))
        | (ExprKind::Int(ticks), ExprKind::Leaf(leaf)) = (&mut a.kind, &mut b.kind)
        && leaf.is_time()
    {
        if let Ok(old) = u64::try_from(*ticks) {
            *ticks = i64::try_from(change(old)).unwrap_or(*ticks);
        }
        return;
    }
    expr.children_mut().for_each(|operand| change_in(operand, change));
}
