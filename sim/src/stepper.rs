//! A simulation that a person drives: one reaction after another, with a panel of inputs, and each reaction can be undone.

use grafsynth_ir::net::{InputId, InputKind, StepId, TransitionId};

use crate::directed::ticks::Thresholds;
use crate::row::InputRow;
use crate::simulator::{Simulator, Snapshot};
use crate::state::State;
use crate::stimulus::{Stimulus, breaks_assumption};
use crate::trace::{Trace, TraceLayout, TraceRow};
use crate::waits::Wait;

/// The number of reactions between two saved snapshots: undoing one repeats at most this many.
const APART: usize = 64;

/// A simulator with its past and the inputs of the next reaction.
#[derive(Debug, Clone)]
pub struct Stepper<'n> {
    simulator: Simulator<'n>,
    /// The values at which something changes in time.
    turns: Thresholds,
    layout: TraceLayout,
    /// The inputs of the next reaction, by id.
    panel: Vec<i64>,
    /// The inputs of each reaction so far.
    inputs: Vec<InputRow>,
    /// The row of the start and of each reaction.
    rows: Vec<TraceRow>,
    /// The snapshots before reactions 1, 65, 129 and so on.
    saved: Vec<Snapshot>,
    /// The state before the last reaction.
    before: State,
    ticks: u64,
    /// The number of the first reaction that violated an assumption of the chart.
    broken: Option<usize>,
}

/// One micro-step of a reaction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The active steps before it, in declaration order.
    pub before: Vec<StepId>,
    /// What fires in it, in the order of the actions.
    pub fired: Vec<TransitionId>,
}

impl<'n> Stepper<'n> {
    /// Starts at the present row of a simulator: that of the reset, or of a restored state. All inputs are 0, or the bound nearest to 0.
    #[must_use]
    pub fn new(simulator: Simulator<'n>) -> Self {
        let net = simulator.net();
        let layout = TraceLayout::of(net);
        let rows = vec![layout.row(simulator.row())];
        Stepper {
            turns: Thresholds::turns(net),
            layout,
            panel: InputRow::zero(net).values,
            inputs: Vec::new(),
            rows,
            saved: Vec::new(),
            before: simulator.state().clone(),
            ticks: 0,
            broken: None,
            simulator,
        }
    }

    /// The simulator after the last reaction.
    #[must_use]
    pub fn simulator(&self) -> &Simulator<'n> {
        &self.simulator
    }

    /// The columns of [`Stepper::row`].
    #[must_use]
    pub fn layout(&self) -> &TraceLayout {
        &self.layout
    }

    /// The row of the last reaction, or of the start.
    #[must_use]
    pub fn row(&self) -> &TraceRow {
        &self.rows[self.rows.len() - 1]
    }

    /// The row before that of the last reaction.
    #[must_use]
    pub fn row_before(&self) -> Option<&TraceRow> {
        self.rows.len().checked_sub(2).map(|at| &self.rows[at])
    }

    /// The number of reactions so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.inputs.len()
    }

    /// True before the first reaction.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.inputs.is_empty()
    }

    /// The ticks from the start to the last reaction.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// The number of the first reaction that violated an assumption of the chart: from there on, all cells of the trace are open.
    #[must_use]
    pub fn broken(&self) -> Option<usize> {
        self.broken
    }

    /// The value of an input in the next reaction; of an event, whether it occurs.
    #[must_use]
    pub fn input(&self, input: InputId) -> i64 {
        self.panel[input.index()]
    }

    /// Sets an input for the next reactions, or an event for the next one; the value is limited to the range of the input. If the chart excludes simultaneous
    /// events, the other events do not occur. Internal events cannot be set.
    pub fn set(&mut self, input: InputId, value: i64) {
        let net = self.simulator.net();
        let data = &net.inputs[input];
        if data.kind == InputKind::InternalEvent {
            return;
        }
        let value = data.ty.saturate(value);
        if data.kind.is_event() && value != 0 && net.settings.events_exclusive {
            self.clear_events();
        }
        self.panel[input.index()] = value;
    }

    fn clear_events(&mut self) {
        for (id, input) in self.simulator.net().inputs.iter() {
            if input.kind.is_event() {
                self.panel[id.index()] = 0;
            }
        }
    }

    /// The next input row, with these ticks.
    fn next_row(&self, dt: u32) -> InputRow {
        InputRow { dt, values: self.panel.clone() }
    }

    /// One reaction with the inputs of the panel, `dt` ticks after the last one. Events do not occur again.
    pub fn react(&mut self, dt: u32) {
        let input = self.next_row(dt);
        self.react_to(input);
        self.clear_events();
    }

    fn react_to(&mut self, input: InputRow) {
        if self.inputs.len().is_multiple_of(APART) {
            self.saved.push(self.simulator.snapshot());
        }
        self.before.clone_from(self.simulator.state());
        let mut cells = self.layout.row(self.simulator.step(&input));
        self.ticks += u64::from(input.dt);
        self.inputs.push(input);
        let input = &self.inputs[self.inputs.len() - 1];
        if self.broken.is_none() && breaks_assumption(self.simulator.net(), input) {
            self.broken = Some(self.inputs.len());
        }
        if self.broken.is_some() {
            self.layout.open_all(&mut cells);
        }
        self.rows.push(cells);
    }

    /// Undoes the last reaction; the panel then contains its inputs and events. False if there is none.
    pub fn undo(&mut self) -> bool {
        let Some(undone) = self.inputs.pop() else { return false };
        self.ticks -= u64::from(undone.dt);
        // Back to a snapshot before the reaction that is now the last, and again from there: what fired in it is then known again.
        let first = self.inputs.len().saturating_sub(1) / APART * APART;
        let again = self.inputs.split_off(first);
        self.ticks -= again.iter().map(|row| u64::from(row.dt)).sum::<u64>();
        self.rows.truncate(first + 1);
        self.broken = self.broken.filter(|broken| *broken <= first);
        self.saved.truncate(first / APART + 1);
        if let Some(snapshot) = self.saved.pop() {
            self.simulator.rewind(&snapshot);
        }
        again.into_iter().for_each(|input| self.react_to(input));
        self.panel = undone.values;
        true
    }

    /// Undoes all reactions; the panel keeps its inputs.
    pub fn restart(&mut self) {
        if let Some(first) = self.saved.first() {
            self.simulator.rewind(first);
        }
        self.before.clone_from(self.simulator.state());
        self.inputs.clear();
        self.saved.clear();
        self.rows.truncate(1);
        self.ticks = 0;
        self.broken = None;
    }

    /// The ticks to the next moment at which a timer can change something; `None` if no timer runs towards a threshold.
    #[must_use]
    pub fn to_threshold(&self) -> Option<u32> {
        self.turns.next(&self.simulator)
    }

    /// The times at which something changes.
    #[must_use]
    pub fn turns(&self) -> &Thresholds {
        &self.turns
    }

    /// What each transition waits for if the next reaction is `dt` ticks later and has the inputs of the panel.
    #[must_use]
    pub fn waits(&self, dt: u32) -> Vec<Wait> {
        self.simulator.waits(&self.next_row(dt))
    }

    /// The micro-steps of the last reaction; empty before the first one.
    #[must_use]
    pub fn frames(&self) -> Vec<Frame> {
        let mut past = self.simulator.clone();
        past.set_state(&self.before);
        let mut frames = Vec::new();
        for fired in self.simulator.firings().filter(|_| !self.inputs.is_empty()) {
            let before = past.state().situation().iter().collect();
            frames.push(Frame { before, fired: fired.to_vec() });
            past.replay(fired);
        }
        frames
    }

    /// The session as a stimulus.
    #[must_use]
    pub fn stimulus(&self) -> Stimulus {
        Stimulus::of_rows(self.simulator.net(), &self.inputs)
    }

    /// The session as a trace: the row of the start, then one row for each reaction.
    #[must_use]
    pub fn trace(&self) -> Trace {
        let mut trace = Trace::new(self.layout.clone());
        self.rows.iter().for_each(|row| trace.push(row.clone()));
        trace
    }
}
