//! The counters of a state that `dt` advances, for searches that represent all states that differ only in their times as one.
//!
//! A counter is read only in comparisons with constants, so only its position relative to its [`Clock::cuts`] matters. While it runs it grows by `dt` at
//! Latch; a list, a body or the end of a reaction resets it to 0; a stopped counter keeps its value until it is reset.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::expr::{CompareOp, Expr, ExprKind};
use grafsynth_ir::net::{Leaf, Net, PropertyLeaf};

use crate::constants::constant_value;
use crate::layout::Cell;
use crate::simulator::Simulator;
use crate::state::State;
use crate::statechart::{everything_has_ended, part_has_ended};

/// A counter of ticks: `s.t`, `s.T`, a free timer, the timer of a qualifier, or the time since a send was started.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Clock {
    cell: Cell,
    place: usize,
    /// The value at which the simulator stops counting.
    cap: i64,
    /// The delay of a send slot, whose cell counts down.
    delay: Option<i64>,
    /// The cuts, ascending and all above 0: two values on the same side of each cut are never distinguished. Empty for a counter whose value never
    /// matters.
    pub cuts: Vec<i64>,
}

impl Clock {
    /// The delay of a send: due sends join a queue in the order of their remaining ticks, so such clocks are also compared with each other.
    #[must_use]
    pub fn delay(&self) -> Option<i64> {
        self.delay
    }

    /// The counter in the state.
    pub(crate) fn cell(&self) -> Cell {
        self.cell
    }

    /// The stored value when `ticks` have passed since the counter was 0.
    #[must_use]
    pub fn saturate(&self, ticks: i64) -> i64 {
        ticks.min(self.cap)
    }

    /// The smallest value that no comparison distinguishes from this one.
    #[must_use]
    pub fn floor(&self, value: i64) -> i64 {
        self.cuts.iter().copied().rfind(|cut| *cut <= value).unwrap_or(0)
    }
}

impl Simulator<'_> {
    /// All counters that a state of the net has.
    #[must_use]
    pub fn clocks(&self) -> Vec<Clock> {
        let net = self.net();
        let cuts = leaf_cuts(net);
        let layout = &self.tables().layout;
        let caps = crate::constants::timer_caps(net);
        let mut clocks = Vec::new();
        for (place, cell) in layout.cells.iter().enumerate() {
            let of_leaf = |leaf: Leaf| {
                let cuts = cuts.get(&leaf).map(|cuts| cuts.iter().copied().collect());
                Some((caps.get(&leaf).copied().unwrap_or(0), cuts.unwrap_or_default(), None))
            };
            let at = |ticks: u32| {
                let ticks = i64::from(ticks);
                (ticks, if ticks > 0 { vec![ticks] } else { Vec::new() })
            };
            let clock = match *cell {
                Cell::Elapsed(step) => of_leaf(Leaf::Elapsed(step)),
                Cell::LastElapsed(step) => of_leaf(Leaf::LastElapsed(step)),
                Cell::Timer(timer) => of_leaf(Leaf::Timer(timer)),
                Cell::ActionTimer(action, _) => {
                    let (cap, cuts) = at(net.actions[action].duration);
                    Some((cap, cuts, None))
                }
                Cell::Slot(send) => {
                    let (delay, cuts) = at(net.sends[send].delay);
                    Some((delay, cuts, Some(delay)))
                }
                Cell::Var(..)
                | Cell::Edge(_)
                | Cell::TimerHeld(_)
                | Cell::Age(..)
                | Cell::Task(_)
                | Cell::ActionQ(_)
                | Cell::Latch(..)
                | Cell::ActionTimerHeld(..)
                | Cell::Old(..)
                | Cell::Raised(_)
                | Cell::Recorded(..)
                | Cell::Ended(_)
                | Cell::Held(..) => None,
            };
            if let Some((cap, cuts, delay)) = clock {
                clocks.push(Clock { cell: *cell, place, cap, delay, cuts });
            }
        }
        clocks
    }

    /// The value of a counter in a state of this net: the ticks since the counter was 0.
    #[must_use]
    pub fn ticks(&self, state: &State, clock: &Clock) -> i64 {
        let value = state.cells[clock.place];
        match clock.delay {
            Some(delay) if value > 0 => delay - value,
            Some(_) => 0,
            None => value,
        }
    }

    /// Sets a counter that [`runs`](Self::runs), or a stopped one with a value, to this number of ticks (for a send, less than its delay).
    pub fn set_ticks(&self, state: &mut State, clock: &Clock, ticks: i64) {
        let cell = &mut state.cells[clock.place];
        *cell = match clock.delay {
            Some(_) if *cell == 0 => 0,
            Some(delay) => (delay - ticks).max(1),
            None => clock.saturate(ticks),
        };
    }

    /// True if the next Latch advances the counter.
    #[must_use]
    pub fn runs(&self, state: &State, clock: &Clock) -> bool {
        let (net, tables) = (self.net(), self.tables());
        let part_goes_on = |step| {
            tables.may_end.is_empty() || !part_has_ended(tables, state, net.steps[step].part)
        };
        match clock.cell {
            Cell::Elapsed(step) | Cell::LastElapsed(step) => {
                state.situation.contains(step) && part_goes_on(step)
            }
            Cell::Timer(_) => {
                state.cells[clock.place + 1] != 0 && !everything_has_ended(tables, state)
            }
            Cell::ActionTimer(action, _) => {
                let uses = &net.actions[action].uses;
                state.cells[clock.place + 1] != 0
                    && (uses.is_empty() || uses.iter().any(|one| part_goes_on(one.step)))
            }
            Cell::Slot(_) => state.cells[clock.place] != 0 && !everything_has_ended(tables, state),
            Cell::Var(..)
            | Cell::Edge(_)
            | Cell::TimerHeld(_)
            | Cell::Age(..)
            | Cell::Task(_)
            | Cell::ActionQ(_)
            | Cell::Latch(..)
            | Cell::ActionTimerHeld(..)
            | Cell::Old(..)
            | Cell::Raised(_)
            | Cell::Recorded(..)
            | Cell::Ended(_)
            | Cell::Held(..) => false,
        }
    }
}

/// For each time that an expression or a property reads, the values at which a comparison changes.
fn leaf_cuts(net: &Net) -> BTreeMap<Leaf, BTreeSet<i64>> {
    let mut cuts = BTreeMap::new();
    for expr in net.expressions() {
        collect(expr, &mut cuts, &|leaf| Some(*leaf));
    }
    for property in &net.properties {
        collect(&property.never, &mut cuts, &|leaf: &PropertyLeaf| leaf.net().copied());
    }
    cuts
}

fn collect<L>(
    expr: &Expr<L>,
    cuts: &mut BTreeMap<Leaf, BTreeSet<i64>>,
    net_leaf: &impl Fn(&L) -> Option<Leaf>,
) {
    if let ExprKind::Compare(op, a, b) = &expr.kind {
        for (timer, constant, mirrored) in [(a, b, false), (b, a, true)] {
            if let (ExprKind::Leaf(leaf), Some(value)) = (&timer.kind, constant_value(constant))
                && let Some(leaf) = net_leaf(leaf).filter(Leaf::is_time)
            {
                let next = value.saturating_add(1);
                let places: &[i64] = match (op, mirrored) {
                    (CompareOp::Lt | CompareOp::Ge, false)
                    | (CompareOp::Gt | CompareOp::Le, true) => &[value],
                    (CompareOp::Gt | CompareOp::Le, false)
                    | (CompareOp::Lt | CompareOp::Ge, true) => &[next],
                    (CompareOp::Eq | CompareOp::Ne, _) => &[value, next],
                };
                let entry = cuts.entry(leaf).or_default();
                entry.extend(places.iter().filter(|place| **place > 0));
            }
        }
    }
    for operand in expr.children() {
        collect(operand, cuts, net_leaf);
    }
}
