//! The reaction of semantics §3.9, step by step.
//!
//! Each function is named after its step of that program and is in the file of its section: `conflict.rs` (K3–K5, §4), `hierarchy.rs` (NEXT, §8),
//! `lists.rs` (F1–F5, §3.3), `statechart.rs` (S1–S4, §5), `control.rs` (E1, §3.5), `ending.rs` (E2–E4, E6).

use grafsynth_ir::net::{
    EdgeId, Evolution, Expr, InputId, InputKind, Leaf, Net, OutputId, StepId, TransitionId,
    TransitionKind, VarId,
};

use crate::asked::{Partial, Recorder, partial};
use crate::evaluate::eval_by;
use crate::layout::Cell;
use crate::notes::{Notes, Noticed, Writer};
use crate::row::{Effect, Row};
use crate::situation::Situation;
use crate::state::State;
use crate::tables::{self, Tables};

/// The transitions that a check considers (semantics §5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trigger {
    /// Grafcet charts: transitions with and without an event; the present events are in `ev`.
    Any,
    /// Statecharts: transitions without an event.
    Eventless,
    /// Statecharts: transitions on this event.
    Event(InputId),
}

/// All data that exists only within one reaction. It is reused so that its memory is allocated once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Work {
    /// Inputs as latched; for events, whether they are present in the current check (`ev`).
    pub(crate) values: Vec<i64>,
    /// True until a micro-step fires: edges of inputs are still visible.
    pub(crate) fresh: bool,
    /// The values of the edge operands in the last check.
    pub(crate) now: Vec<bool>,
    /// The rising edges that the last check found, by operand.
    pub(crate) rise: Vec<bool>,
    pub(crate) fall: Vec<bool>,
    /// The number of checks so far; `fireable_at[t]` is the number of the last check in which `t` was fireable.
    pub(crate) check: u64,
    pub(crate) fireable_at: Vec<u64>,
    pub(crate) enabled: Vec<TransitionId>,
    /// The set F of fireable transitions; after the selection, the set F' of those that fire (§3.9).
    pub(crate) chosen: Vec<TransitionId>,
    /// Statecharts and `otherwise`: candidates while F' is being selected.
    pub(crate) candidates: Vec<TransitionId>,
    /// Marks steps consumed in the current selection, by check number.
    pub(crate) consumed_at: Vec<u64>,
    /// The set Y of NEXT (§3.9).
    pub(crate) next: Situation,
    /// The set RS of NEXT (§3.9).
    pub(crate) restarted: Situation,
    /// A temporary set of steps.
    pub(crate) some_steps: Situation,
    pub(crate) down: Vec<StepId>,
    pub(crate) up: Vec<StepId>,
    /// With simultaneous assignments: the values that lists read.
    pub(crate) before: State,
    pub(crate) reads_before: bool,
    /// The writer of each variable cell in the current micro-step, by check number, and whether it only changed the number of a counted step by one.
    pub(crate) written: Vec<(u64, Option<Writer>, bool)>,
    /// The current list; `None` in bodies and tasks, which are not writers of a micro-step.
    pub(crate) writer: Option<Writer>,
    /// True if the next situation is left open in this reaction.
    pub(crate) open_next: bool,
    /// All transitions and reactions that fired, in order.
    pub(crate) fired: Vec<TransitionId>,
    /// For the last check: pairs of a transition that the policy chose and one that it did not choose for this reason.
    pub(crate) contested: Vec<(TransitionId, TransitionId)>,
    /// The pairs of `contested` for all micro-steps of this reaction.
    pub(crate) all_contested: Vec<(TransitionId, TransitionId)>,
    /// For each micro-step, the end of its part of `fired`.
    pub(crate) ends: Vec<usize>,
    /// Continuous outputs and extern actions that are not 0 in the row.
    pub(crate) lit: Vec<OutputId>,
    /// Statecharts: the number of events at the front of the external queue that were there at Latch.
    pub(crate) n_latched: usize,
    /// The number of checks of this reaction's evolution, and of those that fired.
    pub(crate) rounds: u32,
    pub(crate) micro_steps: u32,
    /// The maximum number of events in the internal queue at once in this reaction.
    pub(crate) longest_internal: usize,
    /// Whether a chart had ended before this reaction, by index in [`Tables::may_end`].
    pub(crate) had_ended: Vec<bool>,
    /// Records the questions that reactions ask about the row, if a search needs them.
    pub(crate) recorder: Option<Box<Recorder>>,
}

impl Work {
    pub(crate) fn of(net: &Net, tables: &Tables) -> Work {
        let no_steps = Situation::empty(net.steps.len());
        Work {
            values: vec![0; net.inputs.len()],
            now: vec![false; net.edges.len()],
            rise: vec![false; net.edges.len()],
            fall: vec![false; net.edges.len()],
            fireable_at: vec![0; net.transitions.len()],
            consumed_at: vec![0; net.steps.len()],
            next: no_steps.clone(),
            restarted: no_steps.clone(),
            some_steps: no_steps,
            written: vec![(0, None, false); tables.layout.n_var_cells],
            had_ended: vec![false; tables.may_end.len()],
            ..Work::default()
        }
    }
}

/// One reaction during its execution.
pub(crate) struct Reaction<'a> {
    pub(crate) net: &'a Net,
    pub(crate) tables: &'a Tables,
    pub(crate) state: &'a mut State,
    pub(crate) work: &'a mut Work,
    pub(crate) row: &'a mut Row,
    pub(crate) notes: &'a mut Notes,
}

impl Reaction<'_> {
    /// The reset: RESET of §3.9, R1 to R5.
    pub(crate) fn reset(&mut self) {
        self.r1_declared_values();
        if self.net.settings.policy.is_statechart() {
            self.r3_enter_initial_states();
            self.evolve_statechart();
        } else {
            self.r2_initial_situation();
            self.r3_initial_lists();
        }
        self.end(true);
    }

    /// One reaction: REACTION of §3.9, L1 to L5.
    pub(crate) fn react(&mut self, dt: u32, inputs: &[i64]) {
        self.begin_record();
        self.l1_latch(dt, inputs);
        self.l2_advance_timers(i64::from(dt));
        self.evaluate_mealy_outputs();
        self.evaluate_unspecified();
        if self.net.settings.policy.is_statechart() {
            self.l3_queue_events(dt, inputs);
            self.evolve_statechart();
        } else {
            self.l3_events_hold(inputs);
            self.evolve();
        }
        self.end(false);
    }

    /// R1: sets all values as declared; no step is active, no event is present, and edges read false.
    fn r1_declared_values(&mut self) {
        self.state.situation.clear();
        self.state.internal.clear();
        self.state.external.clear();
        for (place, cell) in self.tables.layout.cells.iter().enumerate() {
            self.state.cells[place] = if let Cell::Var(var, element) = *cell {
                let var = &self.net.vars[var];
                var.ty.saturate(
                    var.init.get(element as usize).or(var.init.first()).copied().unwrap_or(0),
                )
            } else if let Cell::Timer(timer) = *cell
                && self.net.timers[timer].starts_expired
            {
                self.tables.layout.timer_cap(timer)
            } else {
                0
            };
        }
        self.begin_row(0);
        for (id, input) in self.net.inputs.iter() {
            self.work.values[id.index()] = input.ty.saturate(0);
            self.row.inputs[id.index()] = input.ty.saturate(0);
        }
        self.work.now.fill(false);
        self.work.rise.fill(false);
        self.work.fall.fill(false);
        self.work.had_ended.fill(false);
    }

    fn begin_row(&mut self, dt: u32) {
        self.row.dt = dt;
        self.row.fault = false;
        self.row.effects.clear();
        // Everything that follows an open situation is open from now on.
        self.row.open.row |= std::mem::take(&mut self.row.open.next);
        self.row.open.outputs.clear();
        self.work.fresh = true;
        self.work.open_next = false;
        self.work.n_latched = 0;
        self.work.rounds = 0;
        self.work.micro_steps = 0;
        self.work.longest_internal = self.state.internal.len();
        self.work.fired.clear();
        self.work.all_contested.clear();
        self.work.ends.clear();
        self.work.writer = None;
        self.work.reads_before = false;
    }

    /// L1: inputs are read once; events are absent until L3.
    pub(crate) fn l1_latch(&mut self, dt: u32, inputs: &[i64]) {
        self.begin_row(dt);
        for (id, input) in self.net.inputs.iter() {
            let value = input.ty.saturate(inputs.get(id.index()).copied().unwrap_or(0));
            self.row.inputs[id.index()] = value;
            self.work.values[id.index()] = if input.kind.is_event() { 0 } else { value };
        }
        if let Some(recorder) = &mut self.work.recorder {
            for (id, input) in self.net.inputs.iter() {
                recorder.is_free[id.index()] = !input.kind.is_event();
            }
        }
        for place in 0..self.tables.may_end.len() {
            self.work.had_ended[place] = self.has_ended(self.tables.may_end[place]);
        }
        for input in &self.tables.always_called {
            self.row.effects.push(Effect::Condition(*input));
        }
    }

    /// L2: adds `dt` ticks to the timers of all active objects; each timer saturates one above the largest constant that it is compared with.
    pub(crate) fn l2_advance_timers(&mut self, dt: i64) {
        let layout = &self.tables.layout;
        for step in self.state.situation.iter() {
            for (place, cap) in layout.elapsed(step).into_iter().chain(layout.last_elapsed(step)) {
                if !self.tables.may_end.is_empty() && self.part_has_ended(self.net.steps[step].part)
                {
                    continue;
                }
                let cell = &mut self.state.cells[place];
                *cell = (*cell + dt).min(cap);
            }
        }
        if self.everything_has_ended() {
            return;
        }
        for timer in self.net.timers.ids() {
            let place = layout.timer(timer);
            if self.state.cells[place + 1] != 0 {
                self.state.cells[place] =
                    (self.state.cells[place] + dt).min(layout.timer_cap(timer));
            }
        }
        self.advance_qualifier_timers(dt);
    }

    /// L3 for Grafcet charts: `ev` contains the events of this row and those raised for this check.
    pub(crate) fn l3_events_hold(&mut self, inputs: &[i64]) {
        self.l3_take_raised();
        for event in &self.tables.events {
            if let Some(recorder) = &mut self.work.recorder {
                // A raised event is present whatever the row contains.
                recorder.is_free[event.index()] = self.net.inputs[*event].kind == InputKind::Event
                    && self.work.values[event.index()] == 0;
            }
            if self.net.inputs[*event].kind == InputKind::Event
                && inputs.get(event.index()).is_some_and(|value| *value != 0)
            {
                self.work.values[event.index()] = 1;
            }
        }
    }

    /// `ev := next; next := {}`.
    fn l3_take_raised(&mut self) {
        for event in &self.tables.events {
            if let Some(place) = self.tables.layout.raised(*event) {
                self.work.values[event.index()] = std::mem::take(&mut self.state.cells[place]);
            }
            self.is_no_longer_free(*event);
        }
    }

    fn is_no_longer_free(&mut self, event: InputId) {
        if let Some(recorder) = &mut self.work.recorder {
            recorder.is_free[event.index()] = false;
        }
    }

    /// EVOLVE of Grafcet charts (semantics §3.4). One more check follows for an event that the last allowed micro-step raised. If that check would
    /// fire something, it sets the fault instead [C11].
    fn evolve(&mut self) {
        let mut n = 0;
        loop {
            self.evaluate_edge_operands();
            self.check(Trigger::Any);
            self.select();
            if self.work.chosen.is_empty() {
                self.renew_edge_operands();
                break;
            }
            if self.net.settings.evolution == (Evolution::Stable { limit: n }) {
                self.fault(Noticed::LimitReached);
                self.renew_edge_operands();
                break;
            }
            self.fire();
            self.renew_edge_operands();
            self.work.fresh = false;
            self.end_micro_step();
            n += 1;
            if self.net.settings.evolution == Evolution::Single {
                break;
            }
            self.l3_take_raised();
        }
        self.no_event_holds();
    }

    /// Records what fired in the micro-step and what was not chosen.
    pub(crate) fn end_micro_step(&mut self) {
        let work = &mut *self.work;
        work.micro_steps += 1;
        work.ends.push(work.fired.len());
        work.all_contested.extend_from_slice(&work.contested);
    }

    /// Makes a micro-step with exactly these transitions; false if the situation or the policy does not allow it.
    pub(crate) fn replay(&mut self, fired: &[TransitionId]) -> bool {
        self.work.check += 1;
        self.work.fired.clear();
        self.work.open_next = false;
        self.k2_enabled();
        let mut wanted = fired.to_vec();
        wanted.sort_unstable();
        wanted.dedup();
        if wanted.len() != fired.len()
            || wanted.iter().any(|it| self.work.enabled.binary_search(it).is_err())
        {
            return false;
        }
        for transition in &wanted {
            self.work.fireable_at[transition.index()] = self.work.check;
        }
        self.work.chosen.clone_from(&wanted);
        let is_statechart = self.net.settings.policy.is_statechart();
        if is_statechart {
            self.select_in_statechart()
        } else {
            self.select()
        }
        let mut chosen = self.work.chosen.clone();
        chosen.sort_unstable();
        if chosen != wanted {
            return false;
        }
        if is_statechart {
            self.fire_in_statechart();
            self.drop_queues();
        } else {
            self.fire();
        }
        true
    }

    /// `ev := {}`.
    pub(crate) fn no_event_holds(&mut self) {
        for event in &self.tables.events {
            self.work.values[event.index()] = 0;
            self.is_no_longer_free(*event);
        }
    }

    pub(crate) fn fault(&mut self, why: Noticed) {
        self.notes.add(why);
        self.row.fault = true;
    }

    /// `now[e] := eval(e)` for every operand of the net, whether it is used now or not [C15].
    pub(crate) fn evaluate_edge_operands(&mut self) {
        for (edge, operand) in self.net.edges.iter() {
            self.evaluate_edge_operand(edge, &operand.expr);
        }
    }

    fn evaluate_edge_operand(&mut self, edge: EdgeId, operand: &Expr) {
        self.work.now[edge.index()] = self.eval_unrecorded(operand) != 0;
        self.record(|reaction, recorder| {
            recorder.now[edge.index()] = reaction.partial(recorder, operand);
        });
    }

    /// `old := now`, for all operands except those over inputs alone.
    pub(crate) fn renew_edge_operands(&mut self) {
        for edge in self.net.edges.ids() {
            if !self.tables.edge_over_inputs[edge.index()] {
                self.renew_edge_operand(edge);
            }
        }
    }

    fn renew_edge_operand(&mut self, edge: EdgeId) {
        self.state.cells[self.tables.layout.edge(edge)] = i64::from(self.work.now[edge.index()]);
        if let Some(recorder) = &mut self.work.recorder {
            recorder.old[edge.index()] = recorder.now[edge.index()].clone();
        }
    }

    /// E5: `in_old := in` for the operands over inputs alone.
    pub(crate) fn e5_renew_input_operands(&mut self) {
        for (edge, operand) in self.net.edges.iter() {
            if self.tables.edge_over_inputs[edge.index()] {
                self.evaluate_edge_operand(edge, &operand.expr);
                self.renew_edge_operand(edge);
            }
        }
    }

    /// CHECK, K1 and K2: computes F in `chosen`, in declaration order.
    pub(crate) fn check(&mut self, trigger: Trigger) {
        self.work.check += 1;
        self.work.rounds += 1;
        self.k1_edges();
        self.k2_enabled();
        self.work.chosen.clear();
        for at in 0..self.work.enabled.len() {
            let transition = self.work.enabled[at];
            if self.k2_is_fireable(transition, trigger) {
                self.work.fireable_at[transition.index()] = self.work.check;
                self.work.chosen.push(transition);
            }
        }
    }

    /// K1: computes which edges are present (semantics §3.7).
    fn k1_edges(&mut self) {
        for edge in self.net.edges.ids() {
            let now = self.work.now[edge.index()];
            let old = self.state.cells[self.tables.layout.edge(edge)] != 0;
            let live = self.work.fresh || !self.tables.edge_over_inputs[edge.index()];
            self.work.rise[edge.index()] = live && now && !old;
            self.work.fall[edge.index()] = live && !now && old;
            if let Some(recorder) = &mut self.work.recorder {
                recorder.edge(edge.index(), live);
            }
        }
    }

    /// K2: the enabled transitions (E of semantics §3.2), in declaration order.
    fn k2_enabled(&mut self) {
        let is_active = |step: StepId| self.state.situation.contains(step);
        self.work.enabled.clear();
        for step in self.state.situation.iter() {
            for transition in &self.tables.leaving[step.index()] {
                if self.net.transitions[*transition].requires.iter().all(|step| is_active(*step)) {
                    self.work.enabled.push(*transition);
                }
            }
        }
        for (transition, enclosing) in &self.tables.sources {
            if enclosing.is_none_or(is_active) {
                self.work.enabled.push(*transition);
            }
        }
        if !self.tables.may_end.is_empty() {
            let mut enabled = std::mem::take(&mut self.work.enabled);
            enabled
                .retain(|transition| !self.part_has_ended(self.net.transitions[*transition].part));
            self.work.enabled = enabled;
        }
        self.work.enabled.sort_unstable();
    }

    /// The receptivity, given that the transition is enabled. Transitions are evaluated in declaration order, so that `otherwise` finds the results of the
    /// earlier ones.
    fn k2_is_fireable(&mut self, transition: TransitionId, trigger: Trigger) -> bool {
        let data = &self.net.transitions[transition];
        self.mention(&data.guard);
        let event_holds = match trigger {
            Trigger::Any => {
                data.events.is_empty()
                    || data.events.iter().any(|event| self.work.values[event.index()] != 0)
            }
            Trigger::Eventless => data.events.is_empty(),
            Trigger::Event(event) => data.events.contains(&event),
        };
        let is_fireable = event_holds && self.eval_unrecorded(&data.guard) != 0;
        self.record(|reaction, recorder| {
            reaction.ask_receptivity(recorder, transition, trigger, is_fireable)
        });
        is_fireable
    }

    /// Records the receptivity of an enabled transition as one question.
    fn ask_receptivity(
        &self,
        recorder: &mut Recorder,
        transition: TransitionId,
        trigger: Trigger,
        is_fireable: bool,
    ) {
        let data = &self.net.transitions[transition];
        let event = match trigger {
            Trigger::Any if data.events.is_empty() => Partial::Known(1),
            Trigger::Any => {
                Partial::or(data.events.iter().map(|event| match recorder.is_free[event.index()] {
                    true => Partial::input(*event),
                    false => Partial::Known(self.work.values[event.index()]),
                }))
            }
            Trigger::Eventless => Partial::Known(i64::from(data.events.is_empty())),
            Trigger::Event(event) => Partial::Known(i64::from(data.events.contains(&event))),
        };
        if event == Partial::Known(0) {
            return;
        }
        let guard = self.partial(recorder, &data.guard);
        let n_answers = recorder.asked.answers.len();
        recorder.note(Partial::and([event, guard]), i64::from(is_fireable));
        // A receptivity with `otherwise` depends on the answers about other transitions, so it is not a question of every reaction.
        if self.work.rounds == 1
            && !data.guard.leaves().any(|leaf| matches!(leaf, Leaf::Fireable(_)))
            && let Some((question, _)) = recorder.asked.answers.get(n_answers)
        {
            recorder.asked.first_check.push(*question);
        }
    }

    pub(crate) fn is_reaction(&self, transition: TransitionId) -> bool {
        self.net.transitions[transition].kind == TransitionKind::Reaction
    }

    /// Records that evaluating this expression calls its extern conditions, once per reaction (semantics §6).
    pub(crate) fn mention(&mut self, expr: &Expr) {
        if self.tables.has_extern_conditions {
            let effects = &mut self.row.effects;
            tables::extern_conditions(self.net, expr, &mut |input| {
                let called = Effect::Condition(input);
                if !effects.contains(&called) {
                    effects.push(called);
                }
            });
        }
    }

    /// `eval`: the exact value in the current state, 0 and 1 for Booleans; with simultaneous assignments, the value at the start of the micro-step.
    pub(crate) fn eval(&mut self, expr: &Expr) -> i64 {
        let value = self.eval_unrecorded(expr);
        self.record(|reaction, recorder| recorder.note(reaction.partial(recorder, expr), value));
        value
    }

    /// Like [`Reaction::eval`], but records no question.
    pub(crate) fn eval_unrecorded(&self, expr: &Expr) -> i64 {
        let state = if self.work.reads_before { &self.work.before } else { &*self.state };
        eval_by(expr, &|leaf, index| {
            value_of(self.net, self.tables, state, self.work, *leaf, index)
        })
    }

    /// Calls `note` if questions are recorded.
    pub(crate) fn record(&mut self, note: impl FnOnce(&Self, &mut Recorder)) {
        if let Some(mut recorder) = self.work.recorder.take() {
            note(self, &mut recorder);
            self.work.recorder = Some(recorder);
        }
    }

    fn begin_record(&mut self) {
        let (cells, layout) = (&self.state.cells, &self.tables.layout);
        if let Some(recorder) = &mut self.work.recorder {
            recorder.begin(self.net.edges.ids().map(|edge| cells[layout.edge(edge)]));
        }
    }

    /// The value of an expression as far as it is known without the row.
    fn partial(&self, recorder: &Recorder, expr: &Expr) -> Partial {
        let state = if self.work.reads_before { &self.work.before } else { &*self.state };
        let leaf = |leaf: &Leaf, index: Option<i64>| {
            if let Leaf::Input(input) = *leaf
                && recorder.is_free[input.index()]
            {
                Partial::input(input)
            } else if let Leaf::Rise(edge) = *leaf {
                recorder.rise[edge.index()].clone()
            } else if let Leaf::Fall(edge) = *leaf {
                recorder.fall[edge.index()].clone()
            } else {
                let (net, tables) = (self.net, self.tables);
                Partial::Known(value_of(net, tables, state, self.work, *leaf, index))
            }
        };
        partial(expr, &leaf, &|leaf| leaf_len(self.net, leaf))
    }

    /// The cell of a variable or of one element.
    pub(crate) fn var_place(&self, var: VarId, index: Option<i64>) -> usize {
        var_place(self.net, self.tables, var, index)
    }
}

/// The value of a leaf.
pub(crate) fn value_of(
    net: &Net,
    tables: &Tables,
    state: &State,
    work: &Work,
    leaf: Leaf,
    index: Option<i64>,
) -> i64 {
    let layout = &tables.layout;
    match leaf {
        Leaf::Input(input) => work.values[input.index()],
        Leaf::Var(var) => state.cells[var_place(net, tables, var, index)],
        Leaf::Active(step) => i64::from(state.situation.contains(step)),
        Leaf::Elapsed(step) => layout.elapsed(step).map_or(0, |(place, _)| state.cells[place]),
        Leaf::LastElapsed(step) => {
            layout.last_elapsed(step).map_or(0, |(place, _)| state.cells[place])
        }
        Leaf::TasksDone(step) => {
            let index = layout.task(step).map_or(0, |place| state.cells[place]);
            i64::from(state.situation.contains(step) && index >= net.steps[step].tasks.len() as i64)
        }
        Leaf::Timer(timer) => state.cells[layout.timer(timer)],
        Leaf::Rise(edge) => i64::from(work.rise[edge.index()]),
        Leaf::Fall(edge) => i64::from(work.fall[edge.index()]),
        Leaf::Fireable(transition) => i64::from(work.fireable_at[transition.index()] == work.check),
        Leaf::Controlled(action) => {
            layout.find(Cell::ActionQ(action)).map_or(0, |place| state.cells[place])
        }
    }
}

/// The number of elements of a leaf.
pub(crate) fn leaf_len(net: &Net, leaf: &Leaf) -> i64 {
    if let Leaf::Var(var) = leaf { i64::from(net.vars[*var].len.unwrap_or(1)) } else { 1 }
}

/// The cell of a variable or of one element. Validation excludes an index outside the array.
fn var_place(net: &Net, tables: &Tables, var: VarId, index: Option<i64>) -> usize {
    let last = i64::from(net.vars[var].len.unwrap_or(1).max(1)) - 1;
    let index = index.unwrap_or(0).clamp(0, last);
    tables.layout.var(var) + usize::try_from(index).unwrap_or(0)
}
