//! The `dt` values at which something changes in a state: at, just before and just after each threshold of a running counter.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::net::{Leaf, Net};

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
        let mut thresholds = Thresholds::default();
        for expr in net.expressions() {
            thresholds.collect(expr);
        }
        thresholds
    }

    fn collect(&mut self, expr: &Expr<Leaf>) {
        if let ExprKind::Compare(_, a, b) = &expr.kind {
            for (time, constant) in [(a, b), (b, a)] {
                if let (ExprKind::Leaf(leaf), ExprKind::Int(value)) = (&time.kind, &constant.kind)
                    && leaf.is_time()
                {
                    self.0.entry(*leaf).or_default().insert(*value);
                }
            }
        }
        expr.children().for_each(|operand| self.collect(operand));
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

    /// The distance from the current state to each threshold of a running counter; negative if it has passed.
    fn left(&self, simulator: &Simulator<'_>) -> BTreeSet<i64> {
        let (net, tables, state, _) = simulator.parts();
        let layout = &tables.layout;
        let mut left = BTreeSet::new();
        for (leaf, constants) in &self.0 {
            let now = match *leaf {
                Leaf::Elapsed(step) if state.situation.contains(step) => layout.elapsed(step),
                Leaf::LastElapsed(step) if state.situation.contains(step) => {
                    layout.last_elapsed(step)
                }
                Leaf::Timer(timer) if state.cells[layout.timer(timer) + 1] != 0 => {
                    Some((layout.timer(timer), 0))
                }
                _ => None,
            };
            if let Some((place, _)) = now {
                left.extend(constants.iter().map(|constant| constant - state.cells[place]));
            }
        }
        for (place, cell) in layout.cells.iter().enumerate() {
            if let Cell::ActionTimer(action, _) = *cell
                && state.cells[place + 1] != 0
            {
                left.insert(i64::from(net.actions[action].duration) - state.cells[place]);
            }
            if matches!(*cell, Cell::Slot(_)) && state.cells[place] != 0 {
                left.insert(state.cells[place]);
            }
        }
        left
    }
}
