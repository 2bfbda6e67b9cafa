//! The public interface of the simulator.

use grafsynth_ir::net::{
    Driver, EdgeId, Leaf, Net, Output, OutputId, Property, PropertyExpr, PropertyLeaf, StepId,
    TransitionId, VarId,
};
use grafsynth_ir::{Diagnostic, Valid};

use crate::asked::{Asked, Function, Partial, Recorder, observed, partial, value};
use crate::evaluate::eval_by;
use crate::layout::Cell;
use crate::notes::Notes;
use crate::reaction::{Reaction, Work, leaf_len, value_of};
use crate::row::{Effect, InputRow, Row};
use crate::saved::{self, Restored};
use crate::state::State;
use crate::stimulus::Stimulus;
use crate::tables::Tables;
use crate::trace::{Trace, TraceLayout};

/// Runs a net, one reaction after another, exactly as `docs/semantics.md` defines.
#[derive(Debug, Clone)]
pub struct Simulator<'n> {
    net: &'n Net,
    tables: Tables,
    state: State,
    work: Work,
    row: Row,
    notes: Notes,
}

/// A moment between two reactions.
#[derive(Debug, Clone)]
pub(crate) struct Snapshot {
    state: State,
    row: Row,
    notes: Notes,
    lit: Vec<OutputId>,
}

impl<'n> Simulator<'n> {
    /// A simulator of the net after reset: [`Simulator::row`] is row 0.
    #[must_use]
    pub fn new(net: &'n Valid<Net>) -> Self {
        Self::of_net(net)
    }

    /// A simulator for the generation of stimuli, which also accepts an invalid net.
    pub(crate) fn of_net(net: &'n Net) -> Self {
        let tables = Tables::of(net);
        let state = State {
            situation: crate::Situation::empty(net.steps.len()),
            cells: vec![0; tables.layout.cells.len()],
            ..State::default()
        };
        let work = Work::of(net, &tables);
        let mut simulator =
            Simulator { net, tables, state, work, row: Row::zero(net), notes: Notes::default() };
        simulator.reset();
        simulator
    }

    pub(crate) fn tables(&self) -> &Tables {
        &self.tables
    }

    /// The simulated net.
    #[must_use]
    pub fn net(&self) -> &'n Net {
        self.net
    }

    /// Resets the net and forgets all notes; returns row 0.
    pub fn reset(&mut self) -> Row {
        self.notes.clear();
        self.row.open = crate::Open::default();
        self.reaction().reset();
        self.row.clone()
    }

    /// One reaction. Values outside an input's range are clamped to it.
    pub fn react(&mut self, input: &InputRow) -> Row {
        self.step(input).clone()
    }

    /// Like [`Simulator::react`], but borrows the row instead of copying it.
    pub fn step(&mut self, input: &InputRow) -> &Row {
        self.notes.row += 1;
        self.reaction().react(input.dt, &input.values);
        &self.row
    }

    /// Makes one micro-step in which exactly these transitions fire, regardless of their receptivities: to replay known firings if the inputs are unknown.
    /// Returns false and changes nothing if the situation does not enable all of them, or if the policy would not let them fire together.
    ///
    /// Lists run, but with unknown inputs, so afterwards the situation (and the memory of histories) is correct, but variables and outputs are not. Only
    /// micro-steps and resets should follow.
    pub fn replay(&mut self, fired: &[TransitionId]) -> bool {
        self.reaction().replay(fired)
    }

    /// The values that an expression can read, for searches that do not execute a reaction.
    pub(crate) fn parts(&self) -> (&'n Net, &Tables, &State, &Work) {
        (self.net, &self.tables, &self.state, &self.work)
    }

    pub(crate) fn reaction(&mut self) -> Reaction<'_> {
        Reaction {
            net: self.net,
            tables: &self.tables,
            state: &mut self.state,
            work: &mut self.work,
            row: &mut self.row,
            notes: &mut self.notes,
        }
    }

    /// The row of the last reaction (row 0 after a reset). After [`Simulator::set_state`] it is outdated until the next reaction.
    #[must_use]
    pub fn row(&self) -> &Row {
        &self.row
    }

    /// The current state.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Restores a state that [`Simulator::state`] returned. It must come from a simulator of the same net.
    pub fn set_state(&mut self, state: &State) {
        self.state.clone_from(state);
        self.row.open = crate::Open::default();
    }

    /// Everything that the next reaction depends on, and what the last one showed.
    pub(crate) fn snapshot(&self) -> Snapshot {
        Snapshot {
            state: self.state.clone(),
            row: self.row.clone(),
            notes: self.notes.clone(),
            lit: self.work.lit.clone(),
        }
    }

    /// Returns to a snapshot of this simulator. What fired in the reaction before it is not known again.
    pub(crate) fn rewind(&mut self, snapshot: &Snapshot) {
        self.state.clone_from(&snapshot.state);
        self.row.clone_from(&snapshot.row);
        self.notes.clone_from(&snapshot.notes);
        self.work.lit.clone_from(&snapshot.lit);
        self.work.fired.clear();
        self.work.ends.clear();
    }

    /// Changes a variable of the current state (the first element of an array); the value is saturated to its type.
    pub fn set_var(&mut self, var: VarId, value: i64) {
        let place = self.tables.layout.var(var);
        if let Some(cell) = self.state.cells.get_mut(place) {
            *cell = self.net.vars[var].ty.saturate(value);
        }
    }

    /// True if the step is active.
    #[must_use]
    pub fn is_active(&self, step: StepId) -> bool {
        self.state.situation.contains(step)
    }

    /// The value of a variable, or of one element of an array; an index beyond the array reads its last element.
    #[must_use]
    pub fn var(&self, var: VarId, index: u32) -> i64 {
        let last = self.net.vars[var].len.unwrap_or(1).max(1) - 1;
        self.state.cells[self.tables.layout.var(var) + index.min(last) as usize]
    }

    /// The transitions and reactions that fired in the last reaction, micro-step after micro-step, in the order of their actions.
    #[must_use]
    pub fn fired(&self) -> &[TransitionId] {
        &self.work.fired
    }

    /// The transitions and reactions that fired in each micro-step of the last reaction, in the order of their actions.
    pub fn firings(&self) -> impl Iterator<Item = &[TransitionId]> {
        let begin = std::iter::once(0).chain(self.work.ends.iter().copied());
        begin.zip(&self.work.ends).map(|(from, to)| &self.work.fired[from..*to])
    }

    /// The pairs of transitions in conflict in the last reaction: one that fired, and one that was also fireable but was not chosen by the conflict policy
    /// in the same micro-step. They share a preceding step; in a statechart, an active state that both leave.
    #[must_use]
    pub fn contests(&self) -> &[(TransitionId, TransitionId)] {
        &self.work.all_contested
    }

    /// The number of checks in the last reaction (EVOLVE of semantics §3.9). There is one for each micro-step, one for each event taken from a queue that fires
    /// nothing, and the final empty check.
    #[must_use]
    pub fn rounds(&self) -> u32 {
        self.work.rounds
    }

    /// The number of micro-steps of the last reaction, over all its external events.
    #[must_use]
    pub fn micro_steps(&self) -> u32 {
        self.work.micro_steps
    }

    /// The maximum number of events in the internal queue at once in the last reaction.
    #[must_use]
    pub fn longest_internal(&self) -> usize {
        self.work.longest_internal
    }

    /// Calls and verbatim texts of the last reaction, in order.
    #[must_use]
    pub fn effects(&self) -> &[Effect] {
        &self.row.effects
    }

    /// The notes since the last reset.
    #[must_use]
    pub fn notes(&self) -> &Notes {
        &self.notes
    }

    /// True if the condition that the property excludes is true in the current row.
    #[must_use]
    pub fn is_violated(&self, property: &Property) -> bool {
        self.value(&property.never) != 0
    }

    /// The value of an expression of a property in the present row.
    #[must_use]
    pub fn value(&self, expr: &PropertyExpr) -> i64 {
        let value = |leaf: &PropertyLeaf, index: Option<i64>| match leaf {
            PropertyLeaf::Output(output) => self.row.outputs[output.index()],
            PropertyLeaf::Net(Leaf::Input(input)) => self.row.inputs[input.index()],
            PropertyLeaf::Net(leaf) => {
                value_of(self.net, &self.tables, &self.state, &self.work, *leaf, index)
            }
        };
        eval_by(expr, &value)
    }

    /// From now on, records the questions that each reaction asks about its row. The values of outputs that are not in `outputs` may differ between rows with
    /// the same answers.
    pub fn record(&mut self, outputs: &[OutputId]) {
        let has_calls = self.net.outputs.values().any(Output::is_extern);
        let recorder = Recorder {
            is_free: vec![false; self.net.inputs.len()],
            outputs: observed(self.net.outputs.len(), outputs),
            emergency: has_calls || !outputs.is_empty(),
            ..Recorder::default()
        };
        self.work.recorder = Some(Box::new(recorder));
    }

    /// The questions of the last reaction, if they are recorded.
    #[must_use]
    pub fn asked(&self) -> Option<&Asked> {
        self.work.recorder.as_deref().map(|recorder| &recorder.asked)
    }

    /// Like [`Simulator::is_violated`], for a property that reads only recorded outputs. It is one more question of the last reaction.
    pub fn ask(&mut self, property: &Property) -> bool {
        let value = self.value(&property.never);
        if let Some(mut recorder) = self.work.recorder.take() {
            let leaf = |leaf: &PropertyLeaf, index: Option<i64>| match leaf {
                PropertyLeaf::Net(Leaf::Input(input)) => Partial::input(*input),
                PropertyLeaf::Net(leaf) => Partial::Known(value_of(
                    self.net,
                    &self.tables,
                    &self.state,
                    &self.work,
                    *leaf,
                    index,
                )),
                PropertyLeaf::Output(output) => Partial::Known(self.row.outputs[output.index()]),
            };
            let len = |leaf: &PropertyLeaf| leaf.net().map_or(1, |leaf| leaf_len(self.net, leaf));
            recorder.note(partial(&property.never, &leaf, &len), value);
            self.work.recorder = Some(recorder);
        }
        value != 0
    }

    /// One more question of the last reaction: the value of this function in its row.
    pub fn ask_function(&mut self, function: Function) {
        let value = value(&function, &|input| self.row.inputs[input.index()]);
        if let Some(recorder) = &mut self.work.recorder {
            recorder.note(Partial::Free(function), value);
        }
    }

    /// Makes the value of an edge operand that stays in the state a question of the last reaction.
    pub fn ask_edge(&mut self, edge: EdgeId) {
        let value = self.state.cells[self.tables.layout.at(Cell::Edge(edge))];
        if let Some(recorder) = &mut self.work.recorder {
            recorder.note(recorder.old[edge.index()].clone(), value);
        }
    }

    /// Forgets the last compared value of an edge operand in a state, if the next reaction will not read an edge of it.
    pub fn forget_edge(&self, state: &mut State, edge: EdgeId) {
        state.cells[self.tables.layout.at(Cell::Edge(edge))] = 0;
    }

    /// The state as text, by name: JSON that a later version of the chart can read.
    #[must_use]
    pub fn save(&self) -> String {
        saved::save(self.net, &self.tables, &self.state, &self.row)
    }

    /// Restores a saved state by name. Parts that only this net has get their values after reset; parts that only the text has are lost; both are
    /// reported.
    ///
    /// # Errors
    /// The text is not a saved state.
    pub fn restore(&mut self, text: &str) -> Result<Restored, Vec<Diagnostic>> {
        self.reset();
        let (state, row) = (&mut self.state, &mut self.row);
        let restored = saved::restore(self.net, &self.tables, state, row, text)?;
        // Outputs that are on in the row are cleared in the next reaction, as after any other.
        let is_lit = |(id, output): &(OutputId, &Output)| {
            matches!(output.driver, Driver::Continuous(_)) && self.row.outputs[id.index()] != 0
        };
        let lit: Vec<OutputId> = self.net.outputs.iter().filter(is_lit).map(|(id, _)| id).collect();
        self.work.lit.extend(lit);
        self.row.steps = self.state.situation.iter().collect();
        self.row.vars.copy_from_slice(&self.state.cells[..self.tables.layout.n_var_cells]);
        Ok(restored)
    }
}

/// The trace of a net for a stimulus: row 0 is the reset, then one row for each row of the stimulus. From the first row that violates an assumption, all
/// cells are open.
#[must_use]
pub fn run(net: &Valid<Net>, stimulus: &Stimulus) -> Trace {
    let mut simulator = Simulator::new(net);
    run_with(&mut simulator, stimulus)
}

/// Like [`run`], on a simulator that the caller keeps to read its notes; it is reset first.
pub fn run_with(simulator: &mut Simulator<'_>, stimulus: &Stimulus) -> Trace {
    run_observed(simulator, stimulus, &mut |_| {})
}

/// Like [`run_with`]; `observe` sees the simulator after each reaction, but not after the reset.
pub fn run_observed(
    simulator: &mut Simulator<'_>,
    stimulus: &Stimulus,
    observe: &mut dyn FnMut(&Simulator<'_>),
) -> Trace {
    let net = simulator.net();
    let mut trace = Trace::new(TraceLayout::of(net));
    trace.push(trace.layout.row(&simulator.reset()));
    let mut is_open = false;
    for input in stimulus.rows() {
        let row = simulator.step(&input);
        let mut cells = trace.layout.row(row);
        is_open = is_open || crate::stimulus::breaks_assumption(net, &input);
        if is_open {
            trace.layout.open_all(&mut cells);
        }
        trace.push(cells);
        observe(simulator);
    }
    trace
}
