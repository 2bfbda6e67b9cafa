//! The data of statecharts: what is known before any reaction, and what one evolution carries from check to check.

use std::collections::BTreeMap;
use std::rc::Rc;

use grafsynth_ir::net::{Driver, InputId, Net, PartId, StepKind, StmtKind};
use grafsynth_ir::walk::statements;

use super::super::aig::Lit;
use super::super::number::Number;
use super::super::state::ChartShape;
use super::possible::Possible;
use super::tree::Tree;

/// The static data of the statecharts of a net, and the data of the current reaction.
#[derive(Debug, Clone)]
pub(crate) struct Statechart {
    pub(in crate::symbolic) tree: Rc<Tree>,
    /// The events that some transition is `on`, in declaration order; the first has number 1.
    pub(super) listened: Vec<InputId>,
    /// The bound of each queue.
    pub(super) bound: u32,
    /// True if lists send to the external queue, so that it is not only the events of a row.
    pub(super) sends: bool,
    /// The events and sends that can occur.
    pub(super) possible: Possible,
}

/// The data of one evolution. Outside statecharts, there are no queues, and no chart ends.
#[derive(Debug, Clone)]
pub(in crate::symbolic) struct Run {
    pub(in crate::symbolic) internal: RunQueue,
    pub(in crate::symbolic) external: External,
    /// The reaction has a fault so far.
    pub(in crate::symbolic) fault: Lit,
    /// The evolution is not over.
    pub(in crate::symbolic) running: Lit,
    /// No micro-step has been made yet, so edges of inputs are visible.
    pub(in crate::symbolic) fresh: Lit,
    /// The events that are present in this check; in a statechart, there is at most one.
    pub(in crate::symbolic) event: BTreeMap<InputId, Lit>,
    /// Micro-steps since the last external event that waited at Latch; outside statecharts, since the start of the reaction.
    pub(in crate::symbolic) count: Number,
    pub(in crate::symbolic) n_rounds: u32,
    /// The charts that had ended before this reaction.
    pub(in crate::symbolic) had_ended: BTreeMap<PartId, Lit>,
}

/// A queue during a reaction.
#[derive(Debug, Clone)]
pub(in crate::symbolic) struct RunQueue {
    /// The number of the event at each place.
    pub(super) items: Vec<Number>,
    /// For each place, whether it is used: the first ones are.
    pub(super) used: Vec<Lit>,
    /// For each place, whether the event waited there at Latch.
    pub(super) waited: Vec<Lit>,
}

/// The external events during a reaction.
#[derive(Debug, Clone)]
pub(in crate::symbolic) enum External {
    /// The events of the row only: for each, whether it still waits. They are taken in declaration order.
    Row(BTreeMap<InputId, Lit>),
    Queue(RunQueue),
}

impl Statechart {
    /// The data of a net, and its evolution with empty queues; `None` if it is not a statechart.
    pub(in crate::symbolic) fn of(net: &Net) -> Result<Option<(Self, Run)>, String> {
        if !net.settings.policy.is_statechart() {
            return Ok(None);
        }
        let mut listened: Vec<InputId> =
            net.transitions.values().flat_map(|one| one.events.iter().copied()).collect();
        listened.sort_unstable();
        listened.dedup();
        let is_listened = |event: &InputId| listened.binary_search(event).is_ok();
        let sends = net.sends.values().any(|slot| is_listened(&slot.event));
        let raises =
            net.steps.values().filter_map(|step| step.done_event).any(|it| is_listened(&it))
                || net
                    .statements()
                    .any(|stmt| matches!(&stmt.kind, StmtKind::Raise(event) if is_listened(event)));
        if net.settings.queue.is_none() && (sends || raises) {
            return Err("a queue without a bound is not covered by the symbolic proof".to_owned());
        }
        let bound = net.settings.queue.unwrap_or(listened.len() as u32);
        if (sends || raises) && bound > 64 {
            let message = format!("queues of {bound} events are not covered by the symbolic proof");
            return Err(message);
        }
        let internal = RunQueue::empty(if raises { bound } else { 0 });
        let external = if sends {
            External::Queue(RunQueue::empty(bound))
        } else {
            External::Row(BTreeMap::new())
        };
        let tree = Rc::new(Tree::of(net));
        let chart = Statechart { tree, listened, bound, sends, possible: Possible::of(net) };
        Ok(Some((chart, Run { internal, external, ..Run::default() })))
    }

    /// The pieces of state that only statecharts have.
    pub(in crate::symbolic) fn shape(&self, net: &Net) -> ChartShape {
        let later = || {
            let bodies = net.actions.values().map(|action| &action.body);
            let tasks = net.steps.values().flat_map(|step| &step.tasks).map(|task| &task.body);
            bodies.chain(tasks).flat_map(|list| statements(list))
        };
        let is_listened = |event: &InputId| self.listened.binary_search(event).is_ok();
        let raises_later =
            later().any(|stmt| matches!(&stmt.kind, StmtKind::Raise(event) if is_listened(event)));
        let sends_later = later().any(|stmt| {
            matches!(&stmt.kind, StmtKind::Send(slot)
                if net.sends[*slot].delay == 0 && is_listened(&net.sends[*slot].event))
        });
        let mut shape = ChartShape {
            slots: net
                .sends
                .values()
                .map(|slot| (slot.delay > 0).then_some(i64::from(slot.delay)))
                .collect(),
            n_events: self.listened.len() as i64,
            internal: raises_later.then_some(self.bound),
            external: sends_later.then_some(self.bound),
            ..ChartShape::default()
        };
        for (id, history) in net.histories.iter() {
            shape.recorded.extend(history.cases.iter().map(|case| (id, case.step)));
        }
        for step in net.steps.values() {
            if step.kind == StepKind::Final && step.parent.is_none() {
                shape.ended.push(self.tree.chart_of[step.part.index()]);
            }
        }
        shape.ended.sort_unstable();
        shape.ended.dedup();
        for (id, output) in net.outputs.iter() {
            if let Driver::Continuous(emissions) = &output.driver {
                for emission in emissions {
                    let chart = self.tree.chart_of[net.steps[emission.step].part.index()];
                    if shape.ended.contains(&chart) && !shape.kept.contains(&(id, chart)) {
                        shape.kept.push((id, chart));
                    }
                }
            }
        }
        shape
    }
}

impl Default for Run {
    fn default() -> Self {
        Run {
            internal: RunQueue::empty(0),
            external: External::Row(BTreeMap::new()),
            fault: Lit::FALSE,
            running: Lit::FALSE,
            fresh: Lit::FALSE,
            event: BTreeMap::new(),
            count: Number::constant(0),
            n_rounds: 0,
            had_ended: BTreeMap::new(),
        }
    }
}

impl RunQueue {
    pub(super) fn empty(bound: u32) -> Self {
        let n = bound as usize;
        RunQueue {
            items: vec![Number::constant(0); n],
            used: vec![Lit::FALSE; n],
            waited: vec![Lit::FALSE; n],
        }
    }
}
