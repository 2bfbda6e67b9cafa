//! The `dt` values at which something changes in a state: at, just before and just after each threshold of a running counter.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::expr::{CompareOp, Expr, ExprKind};
use grafsynth_ir::net::{ActionId, Leaf, Net, SendId, StepId, TimerId};

use crate::layout::Cell;
use crate::simulator::Simulator;
use crate::stimulus::MAX_DT;

/// The constants that each time of a net is compared with.
#[derive(Debug, Clone, Default)]
pub struct Thresholds(BTreeMap<Leaf, BTreeSet<i64>>);

impl Thresholds {
    /// The thresholds in all expressions of the net.
    #[must_use]
    pub fn of(net: &Net) -> Self {
        Self::with(net, |_, constant| vec![constant])
    }

    /// The values of each time at which a comparison in the net changes: one more than the constant for `>` and `<=`.
    #[must_use]
    pub fn turns(net: &Net) -> Self {
        Self::with(net, turns)
    }

    fn with(net: &Net, values: fn(CompareOp, i64) -> Vec<i64>) -> Self {
        let mut thresholds = Thresholds::default();
        for expr in net.expressions() {
            thresholds.collect(expr, values);
        }
        thresholds
    }

    fn collect(&mut self, expr: &Expr<Leaf>, values: fn(CompareOp, i64) -> Vec<i64>) {
        if let ExprKind::Compare(op, a, b) = &expr.kind {
            for (time, op, constant) in [(a, *op, b), (b, op.mirrored(), a)] {
                if let (ExprKind::Leaf(leaf), ExprKind::Int(value)) = (&time.kind, &constant.kind)
                    && leaf.is_time()
                {
                    self.0.entry(*leaf).or_default().extend(values(op, *value));
                }
            }
        }
        expr.children().for_each(|operand| self.collect(operand, values));
    }

    /// The remaining ticks to each threshold that is still ahead, and one less and one more; at most `max_dt`, in ascending order.
    #[must_use]
    pub fn ahead(&self, simulator: &Simulator<'_>, max_dt: u32) -> Vec<u32> {
        let left = self.left(simulator);
        let around: BTreeSet<i64> = left.iter().flat_map(|it| [it - 1, *it, it + 1]).gather();
        around
            .into_iter()
            .filter_map(|it| u32::try_from(it).ok())
            .filter(|it| (1..=max_dt).contains(it))
            .collect()
    }

    /// The number of ticks beyond which more ticks make no difference in this state: every counter is beyond its last threshold. 0 if nothing counts.
    #[must_use]
    pub fn horizon(&self, simulator: &Simulator<'_>) -> u32 {
        let farthest = self.left(simulator).last().copied().unwrap_or(-1).saturating_add(1);
        u32::try_from(farthest.max(0)).unwrap_or(MAX_DT).min(MAX_DT)
    }

    /// The ticks to the nearest threshold that is still ahead; `None` if nothing counts towards one.
    #[must_use]
    pub fn next(&self, simulator: &Simulator<'_>) -> Option<u32> {
        let left = self.left(simulator).into_iter().find(|left| *left > 0)?;
        Some(u32::try_from(left).unwrap_or(MAX_DT).min(MAX_DT))
    }

    /// The distance from the current state to each threshold of a running counter; negative if it has passed.
    fn left(&self, simulator: &Simulator<'_>) -> BTreeSet<i64> {
        self.running(simulator).into_iter().flat_map(|one| one.left).collect()
    }

    /// The counters that run in the current state.
    #[must_use]
    pub fn running(&self, simulator: &Simulator<'_>) -> Vec<Running> {
        let (net, tables, state, _) = simulator.parts();
        let layout = &tables.layout;
        let mut running = Vec::new();
        for (leaf, constants) in &self.0 {
            let found = match *leaf {
                Leaf::Elapsed(step) if state.situation.contains(step) => {
                    layout.elapsed(step).map(|(place, _)| (place, Counter::Elapsed(step)))
                }
                Leaf::LastElapsed(step) if state.situation.contains(step) => {
                    layout.last_elapsed(step).map(|(place, _)| (place, Counter::LastElapsed(step)))
                }
                Leaf::Timer(timer) if state.cells[layout.timer(timer) + 1] != 0 => {
                    Some((layout.timer(timer), Counter::Timer(timer)))
                }
                _ => None,
            };
            if let Some((place, counter)) = found {
                let ticks = state.cells[place];
                let left = constants.iter().map(|constant| constant - ticks).collect();
                running.push(Running { counter, ticks, left });
            }
        }
        for (place, cell) in layout.cells.iter().enumerate() {
            let ticks = state.cells[place];
            if let Cell::ActionTimer(action, _) = *cell
                && state.cells[place + 1] != 0
            {
                let left = vec![i64::from(net.actions[action].duration) - ticks];
                running.push(Running { counter: Counter::Action(action), ticks, left });
            }
            if let Cell::Slot(send) = *cell
                && ticks != 0
            {
                let past = i64::from(net.sends[send].delay) - ticks;
                let left = vec![ticks];
                running.push(Running { counter: Counter::Send(send), ticks: past, left });
            }
        }
        running
    }
}

/// The values of a rising counter at which the result of its comparison with a constant changes.
#[must_use]
pub fn turns(op: CompareOp, constant: i64) -> Vec<i64> {
    match op {
        CompareOp::Ge | CompareOp::Lt => vec![constant],
        CompareOp::Gt | CompareOp::Le => vec![constant.saturating_add(1)],
        CompareOp::Eq | CompareOp::Ne => vec![constant, constant.saturating_add(1)],
    }
}

/// What a running counter measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counter {
    /// The time since the activation of a step (`p2.t`).
    Elapsed(StepId),
    /// The time of a step in its last activation (`p2.T`), which is active now.
    LastElapsed(StepId),
    /// How long the condition of a timer has been true.
    Timer(TimerId),
    /// The time of a controlled action (IEC 61131-3).
    Action(ActionId),
    /// The time since a delayed event was sent.
    Send(SendId),
}

/// A counter that runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Running {
    /// What it measures.
    pub counter: Counter,
    /// Its value in ticks; it stays one above the largest threshold.
    pub ticks: i64,
    /// The ticks to each of its thresholds, not ordered; not positive if it has passed them.
    pub left: Vec<i64>,
}
