//! States that only long runs reach: a loop that adds a constant to a variable, and may be taken any number of times, is one move.
//!
//! Rows are tried from states of directed runs. If they change nothing but one variable, the second encoding of the reaction proves that they do so for all
//! values up to a target, and then the target is reachable. Everything that is continued from such a state exists; nothing is concluded from a loop that was not
//! found.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::Valid;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Expr, InputKind, Net, VarId};
use grafsynth_sim::{Directed, InputRow, MAX_DT, Simulator, State, Stimulus, breaks_assumption};

use crate::limits::Limits;
use crate::symbolic::{self, Repeat};

/// The minimum number of repetitions worth a proof; random runs do fewer by themselves.
const MANY: i64 = 1_000;
/// The number of reactions in which loops are looked for, and the number of states from which they may start.
const REACTIONS: usize = 200;
const STARTS: usize = 8;
/// The maximum number of rows that lead to the start of a loop; the encoding executes each of them.
const LONGEST_WAY: usize = 24;
/// The maximum number of inputs that are set alone in a row of a loop.
const ALONE: usize = 16;
/// The maximum number of constants of a net that are targets.
const TARGETS: usize = 16;
/// The random runs from each state, and their lengths.
const RUNS: u64 = 8;
const ROWS: usize = 40;

/// The results of a search for loops.
#[derive(Debug, Default)]
pub(crate) struct Far {
    /// States at the ends of loops.
    states: Vec<State>,
    /// The maximum number of different values of one variable that a loop passes.
    values: u64,
}

impl Far {
    pub(crate) fn of(net: &Valid<Net>, limits: &Limits) -> Self {
        let mut far = Far::default();
        let wide: Vec<VarId> = net
            .vars
            .iter()
            .filter(|(_, var)| var.len.is_none() && span(var.ty) > MANY as u64)
            .map(|(id, _)| id)
            .collect();
        let is_covered = !net.settings.policy.is_statechart() && net.unspecified.is_empty();
        if wide.is_empty() || !is_covered {
            return far;
        }
        let rows = rows(net);
        let targets = targets(net);
        let mut runs = Directed::new(net, 1, MAX_DT);
        let mut starts = BTreeSet::new();
        let mut done = BTreeSet::new();
        for _ in 0..REACTIONS {
            if starts.len() >= STARTS || runs.next().is_none() {
                break;
            }
            let state = runs.simulator().state().clone();
            let way = runs.path();
            if way.len() > LONGEST_WAY || !starts.insert(state.situation().clone()) {
                continue;
            }
            for (var, stride, cycle) in loops(net, &state, &wide, &rows) {
                if done.insert((state.situation().clone(), var, stride)) {
                    far.follow(net, limits, &state, (var, stride), (&way, &cycle), &targets);
                }
            }
        }
        far
    }

    /// Adds the last states of a loop before and at each target.
    fn follow(
        &mut self,
        net: &Valid<Net>,
        limits: &Limits,
        state: &State,
        (var, stride): (VarId, i64),
        (way, cycle): (&[InputRow], &[InputRow]),
        targets: &BTreeSet<i64>,
    ) {
        let (lo, hi) = net.vars[var].ty.bounds();
        let mut simulator = Simulator::new(net);
        simulator.set_state(state);
        let first = simulator.var(var, 0);
        let near = targets.iter().flat_map(|at| (-1..=1).filter_map(move |by| at.checked_add(by)));
        let lasts: BTreeSet<i64> = near
            .chain([lo, hi])
            .filter(|target| (lo..=hi).contains(target))
            .filter_map(|target| {
                let times = target.checked_sub(first)? / stride;
                (times >= MANY).then(|| first + times * stride)
            })
            .gather();
        for last in lasts {
            let repeat = Repeat { way, cycle, var, stride, first, last };
            if symbolic::repeats(net, limits, &repeat) == Some(true) {
                simulator.set_var(var, last);
                self.states.push(simulator.state().clone());
                self.values = self.values.max(first.abs_diff(last) / stride.unsigned_abs());
            }
        }
    }

    /// True if an enumeration with these limits cannot end, because one variable has more values than it may store states.
    pub(crate) fn is_beyond(&self, limits: &Limits) -> bool {
        self.values > limits.states as u64
    }

    /// Runs random rows from each state, and calls `note` after each reaction.
    pub(crate) fn each(&self, net: &Valid<Net>, mut note: impl FnMut(&Simulator<'_>)) {
        let mut simulator = Simulator::new(net);
        for state in &self.states {
            for seed in 1..=RUNS {
                simulator.set_state(state);
                for row in Stimulus::random(net, ROWS, seed, 3).rows() {
                    if breaks_assumption(net, &row) {
                        break;
                    }
                    simulator.step(&row);
                    note(&simulator);
                }
            }
        }
    }
}

/// The number of values above the least one.
fn span(ty: Type) -> u64 {
    let (lo, hi) = ty.bounds();
    hi.abs_diff(lo)
}

/// Rows for loops: no input, and each input alone.
fn rows(net: &Valid<Net>) -> Vec<InputRow> {
    let zero = InputRow { dt: 1, ..InputRow::zero(net) };
    let alone = net
        .inputs
        .iter()
        .filter(|(_, input)| input.ty == Type::Bool && input.kind != InputKind::InternalEvent)
        .take(ALONE)
        .map(|(id, _)| {
            let mut row = zero.clone();
            row.values[id.index()] = 1;
            row
        });
    let all = [zero.clone()].into_iter().chain(alone);
    all.filter(|row| !breaks_assumption(net, row)).collect()
}

/// The constants of a net.
fn targets(net: &Net) -> BTreeSet<i64> {
    fn constants(expr: &Expr, into: &mut BTreeSet<i64>) {
        if let ExprKind::Int(value) = &expr.kind {
            into.insert(*value);
        }
        expr.children().for_each(|operand| constants(operand, into));
    }
    let mut all = BTreeSet::new();
    net.expressions().for_each(|expr| constants(expr, &mut all));
    // The largest ones are the farthest.
    all.into_iter().rev().take(TARGETS).gather()
}

/// Sequences of one or two rows after which only one of the variables has changed, with the change.
fn loops(
    net: &Valid<Net>,
    state: &State,
    wide: &[VarId],
    rows: &[InputRow],
) -> Vec<(VarId, i64, Vec<InputRow>)> {
    let mut simulator = Simulator::new(net);
    let mut found = Vec::new();
    let ones = rows.iter().map(|row| vec![row.clone()]);
    let twos = rows.iter().flat_map(|a| rows.iter().map(move |b| vec![a.clone(), b.clone()]));
    for cycle in ones.chain(twos) {
        simulator.set_state(state);
        let before: Vec<i64> = wide.iter().map(|var| simulator.var(*var, 0)).collect();
        cycle.iter().for_each(|row| {
            simulator.step(row);
        });
        let changed: Vec<(VarId, i64, i64)> = wide
            .iter()
            .zip(before)
            .map(|(var, before)| (*var, before, simulator.var(*var, 0)))
            .filter(|(_, before, after)| before != after)
            .collect();
        if let [(var, before, after)] = changed[..]
            && let Some(stride) = after.checked_sub(before)
        {
            simulator.set_var(var, before);
            if simulator.state() == state {
                found.push((var, stride, cycle));
            }
        }
    }
    found
}

/// The limits of an enumeration: small if it is known not to end.
pub(crate) fn within(net: &Valid<Net>, limits: &Limits) -> Limits {
    if limits.pairs > ENDLESS && Far::of(net, limits).is_beyond(limits) {
        let image_work = limits.image_work.min(ENDLESS_IMAGE);
        return Limits { pairs: ENDLESS, image_work, ..limits.clone() };
    }
    limits.clone()
}

/// The limits on pairs and on diagram work for a net that is known to have too many states.
const ENDLESS: u64 = 50_000;
const ENDLESS_IMAGE: u64 = 1_000_000;
