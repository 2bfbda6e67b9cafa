//! Statecharts: the macro-step with its two queues, and the order of exits and entries (semantics §5, §3.3; SCXML's exitStates, executeTransitionContent
//! and enterStates).

use grafsynth_ir::net::{
    Enter, Evolution, HistoryId, InputId, InputKind, PartId, StepId, StepKind,
};

use crate::layout::Cell;
use crate::notes::{Noticed, Writer};
use crate::reaction::{Reaction, Trigger};
use crate::situation::Situation;
use crate::state::State;
use crate::tables::Tables;

/// The entries of a micro-step.
#[derive(Debug, Default)]
struct EntrySet {
    states: Situation,
    /// Composite states entered by default: the content of their initial transition runs.
    by_default: Vec<StepId>,
    /// Histories that have recorded nothing: the content of their default transition runs.
    default_histories: Vec<HistoryId>,
}

impl Reaction<'_> {
    /// R3 for statecharts: enters the initial states.
    pub(crate) fn r3_enter_initial_states(&mut self) {
        let net = self.net;
        self.work.check += 1;
        let initial = net.parts.values().flat_map(|part| &part.initial);
        let entry_set = self.entry_set(initial);
        self.begin_lists();
        self.enter_states(&entry_set);
        self.end_lists();
    }

    /// L3: due sends, by remaining ticks and then by slot, and then the events of the row join the external queue.
    pub(crate) fn l3_queue_events(&mut self, dt: u32, inputs: &[i64]) {
        if self.everything_has_ended() {
            return;
        }
        let mut due: Vec<(i64, InputId)> = Vec::new();
        for (slot, data) in self.net.sends.iter() {
            let remaining = &mut self.state.cells[self.tables.layout.at(Cell::Slot(slot))];
            if *remaining == 0 {
                continue;
            }
            if *remaining <= i64::from(dt) {
                due.push((*remaining, data.event));
                *remaining = 0;
            } else {
                *remaining -= i64::from(dt);
            }
        }
        due.sort_by_key(|(remaining, _)| *remaining);
        for (_, event) in due {
            self.join_external(event);
        }
        self.record_events(inputs);
        for event in &self.tables.events {
            if self.net.inputs[*event].kind == InputKind::Event
                && inputs.get(event.index()).is_some_and(|value| *value != 0)
            {
                self.join_external(*event);
            }
        }
        self.work.n_latched = self.state.external.len();
    }

    pub(crate) fn join_internal(&mut self, event: InputId) {
        self.join(event, true);
    }

    pub(crate) fn join_external(&mut self, event: InputId) {
        self.join(event, false);
    }

    /// Adds an event to a queue, unless no `on` refers to it. If the queue is full, the newest event is dropped and the row reports a fault.
    fn join(&mut self, event: InputId, is_internal: bool) {
        if !self.tables.listened[event.index()] {
            return;
        }
        let bound = self.queue_bound();
        let queue = if is_internal { &mut self.state.internal } else { &mut self.state.external };
        if queue.len() >= bound {
            self.fault(Noticed::QueueFull(event));
        } else {
            queue.push_back(event);
        }
        self.work.longest_internal = self.work.longest_internal.max(self.state.internal.len());
    }

    pub(crate) fn queue_bound(&self) -> usize {
        self.net.settings.queue.map_or(usize::MAX, |bound| bound as usize)
    }

    /// EVOLVE of statecharts. The count of micro-steps restarts with each external event that was in the queue at Latch, but not with one that an
    /// undelayed send adds during the reaction, so that a send to oneself cannot keep a reaction running for ever.
    pub(crate) fn evolve_statechart(&mut self) {
        let limit = match self.net.settings.evolution {
            Evolution::Single => 1,
            Evolution::Stable { limit } => limit,
        };
        let mut n = 0;
        loop {
            if self.everything_has_ended() {
                self.drop_queues();
                break;
            }
            self.evaluate_edge_operands();
            self.check(Trigger::Eventless);
            self.select_in_statechart();
            if self.work.chosen.is_empty() {
                let mut is_external = false;
                let event = if let Some(event) = self.state.internal.pop_front() {
                    event
                } else {
                    self.record_absent_events();
                    let Some(event) = self.state.external.pop_front() else { break };
                    is_external = true;
                    if self.work.n_latched > 0 {
                        self.work.n_latched -= 1;
                        n = 0;
                    }
                    event
                };
                self.check(Trigger::Event(event));
                self.select_in_statechart();
                if is_external {
                    self.record_taken_event();
                }
            }
            if self.work.chosen.is_empty() {
                // The event fired nothing and is discarded.
                continue;
            }
            if n == limit {
                self.fault(Noticed::LimitReached);
                self.drop_queues();
                break;
            }
            self.fire_in_statechart();
            self.renew_edge_operands();
            self.work.fresh = false;
            self.end_micro_step();
            n += 1;
        }
        self.renew_edge_operands();
        self.record_more_rounds();
    }

    pub(crate) fn drop_queues(&mut self) {
        self.state.internal.clear();
        self.state.external.clear();
    }

    /// FIRE for statecharts: `chosen` is F' in the order of selection.
    pub(crate) fn fire_in_statechart(&mut self) {
        let net = self.net;
        let chosen = std::mem::take(&mut self.work.chosen);
        let mut exits = std::mem::take(&mut self.work.some_steps);
        exits.clear();
        for transition in &chosen {
            for step in self.exit_set(*transition) {
                exits.insert(step);
            }
        }
        self.record_histories(&exits);
        let entry_set = self
            .entry_set(chosen.iter().flat_map(|transition| &net.transitions[*transition].enters));

        self.begin_lists();
        let mut down: Vec<StepId> = exits.iter().collect();
        down.reverse();
        down.into_iter().for_each(|state| self.deactivate(state));
        chosen.iter().for_each(|transition| self.act(*transition));
        self.enter_states(&entry_set);
        self.end_lists();
        self.work.some_steps = exits;
        self.work.chosen = chosen;
    }

    /// Records histories, from the situation at the start of the micro-step, before any list runs.
    fn record_histories(&mut self, exits: &Situation) {
        for (history, data) in self.net.histories.iter() {
            if exits.contains(data.owner) {
                for (case, recorded) in data.cases.iter().enumerate() {
                    let place = self.tables.layout.at(Cell::Recorded(history, case as u32));
                    self.state.cells[place] =
                        i64::from(self.state.situation.contains(recorded.step));
                }
            }
        }
    }

    fn entry_set<'e>(&self, enters: impl IntoIterator<Item = &'e Enter>) -> EntrySet {
        let mut set =
            EntrySet { states: Situation::empty(self.net.steps.len()), ..EntrySet::default() };
        let mut seen = vec![false; self.net.histories.len()];
        enters.into_iter().for_each(|enter| self.add_to_entry_set(*enter, &mut set, &mut seen));
        set
    }

    /// Adds one item of the list of states that a transition enters to the entry set. A history is replaced by what it has recorded, otherwise by its default.
    /// `seen` marks the histories already replaced, so a cycle of histories ends.
    fn add_to_entry_set(&self, enter: Enter, set: &mut EntrySet, seen: &mut [bool]) {
        match enter {
            Enter::Step(step) => set.states.insert(step),
            Enter::InitialContent(step) => set.by_default.push(step),
            Enter::History(history) => {
                if std::mem::replace(&mut seen[history.index()], true) {
                    return;
                }
                let data = &self.net.histories[history];
                let is_recorded = |case: usize| {
                    self.state.cells[self.tables.layout.at(Cell::Recorded(history, case as u32))]
                        != 0
                };
                if (0..data.cases.len()).any(is_recorded) {
                    for (case, recorded) in data.cases.iter().enumerate() {
                        if is_recorded(case) {
                            recorded
                                .enters
                                .iter()
                                .for_each(|enter| self.add_to_entry_set(*enter, set, seen));
                        }
                    }
                } else {
                    set.default_histories.push(history);
                    data.default.iter().for_each(|enter| self.add_to_entry_set(*enter, set, seen));
                }
            }
        }
    }

    /// Activates states in document order, parent before child; default content runs after the parent's list and before its child's.
    fn enter_states(&mut self, set: &EntrySet) {
        let net = self.net;
        for state in set.states.iter() {
            self.activate(state);
            if set.by_default.contains(&state) {
                self.run_as(Writer::InitialContent(state), &net.steps[state].initial_content);
            }
            for history in &set.default_histories {
                if net.histories[*history].owner == state {
                    self.run_as(
                        Writer::HistoryContent(*history),
                        &net.histories[*history].default_content,
                    );
                }
            }
            match (net.steps[state].kind, net.steps[state].parent) {
                (StepKind::Final, Some(parent)) => self.raise_done(parent),
                (StepKind::Final, None) => self.end_chart(net.steps[state].part),
                (
                    StepKind::Leaf | StepKind::Enclosing | StepKind::Composite | StepKind::Parallel,
                    _,
                ) => {}
            }
        }
    }

    /// `done.state.P` right after the entry list of P's final child, then the event of a parallel state whose regions are all final.
    fn raise_done(&mut self, parent: StepId) {
        if let Some(event) = self.net.steps[parent].done_event {
            self.raise(event);
        }
        let Some(above) = self.net.steps[parent].parent else { return };
        if self.net.steps[above].kind == StepKind::Parallel
            && self.is_in_final_state(above)
            && let Some(event) = self.net.steps[above].done_event
        {
            self.raise(event);
        }
    }

    fn is_in_final_state(&self, state: StepId) -> bool {
        let mut children = self.tables.children[state.index()].iter().copied();
        match self.net.steps[state].kind {
            StepKind::Composite => children.any(|child| {
                self.net.steps[child].kind == StepKind::Final
                    && self.state.situation.contains(child)
            }),
            StepKind::Parallel => children.all(|child| self.is_in_final_state(child)),
            StepKind::Leaf | StepKind::Enclosing | StepKind::Final => false,
        }
    }

    pub(crate) fn is_atomic(&self, state: StepId) -> bool {
        matches!(self.net.steps[state].kind, StepKind::Leaf | StepKind::Final)
    }

    /// A top-level final state ends its chart: the exit lists run in exit order, and X keeps the final situation even while they run [C20].
    fn end_chart(&mut self, part: PartId) {
        let net = self.net;
        let chart = self.tables.ranks.chart_of(part);
        let mut active: Vec<StepId> = self.state.situation.iter().collect();
        active.retain(|step| self.tables.ranks.chart_of(net.steps[*step].part) == chart);
        for step in active.into_iter().rev() {
            self.run_as(Writer::Exit(step), &net.steps[step].exit);
        }
        let place = self.tables.layout.at(Cell::Ended(chart));
        self.state.cells[place] = 1;
    }

    /// True if the top-level chart has ended.
    pub(crate) fn has_ended(&self, chart: PartId) -> bool {
        has_ended(self.tables, self.state, chart)
    }

    /// True if the chart that contains the part has ended.
    pub(crate) fn part_has_ended(&self, part: PartId) -> bool {
        part_has_ended(self.tables, self.state, part)
    }

    /// True if all charts have ended.
    pub(crate) fn everything_has_ended(&self) -> bool {
        everything_has_ended(self.tables, self.state)
    }
}

fn has_ended(tables: &Tables, state: &State, chart: PartId) -> bool {
    state.cells[tables.layout.at(Cell::Ended(chart))] != 0
}

/// True if the chart that contains the part has ended in this state.
pub(crate) fn part_has_ended(tables: &Tables, state: &State, part: PartId) -> bool {
    let chart = tables.ranks.chart_of(part);
    tables.may_end.contains(&chart) && has_ended(tables, state, chart)
}

/// True if all charts have ended in this state.
pub(crate) fn everything_has_ended(tables: &Tables, state: &State) -> bool {
    tables.all_may_end && tables.may_end.iter().all(|chart| has_ended(tables, state, *chart))
}
