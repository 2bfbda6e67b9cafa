//! The end of a reaction: E2 to E6 (semantics §3.6, §3.8, §6, §7).

use grafsynth_ir::net::{Driver, OpenCell, OutputId, StepId, VarId};
use grafsynth_ir::ranks::sort_by_rank;

use crate::layout::Cell;
use crate::reaction::Reaction;
use crate::row::Effect;

impl Reaction<'_> {
    /// The end of a reaction: END of §3.9, E1 to E6.
    pub(crate) fn end(&mut self, is_reset: bool) {
        let is_last = is_reset || !self.waits();
        if is_last {
            self.e1_controlled_actions();
            self.e2_tasks();
            self.e3_free_timers();
        }
        if is_reset {
            self.evaluate_mealy_outputs();
            self.evaluate_open_mealy_outputs();
        }
        self.e4_outputs(is_last);
        if !is_reset || self.net.settings.policy.is_statechart() {
            self.e5_renew_input_operands();
        }
        self.e6_row();
    }

    /// True in a round of a part whose END waits for a later round (semantics §10.2).
    fn waits(&mut self) -> bool {
        let Some(ending) = &self.net.ending else { return false };
        let fires = self.work.micro_steps > 0;
        self.eval(&ending.waits) != 0 || ending.is_quiet && fires
    }

    /// E2: each active step runs its next tasks while their costs fit in the rest of its budget.
    fn e2_tasks(&mut self) {
        let net = self.net;
        let working: Vec<(StepId, usize)> = (self.state.situation.iter())
            .filter_map(|step| self.tables.layout.task(step).map(|place| (step, place)))
            .filter(|(step, _)| !self.part_has_ended(net.steps[*step].part))
            .collect();
        for (step, index) in working {
            let is_locked = |lock: &VarId| self.state.cells[self.tables.layout.var(*lock)] != 0;
            if self.state.cells[index] == 0 && net.steps[step].locks.iter().any(is_locked) {
                continue;
            }
            let mut rest = net.steps[step].budget;
            while let Some(task) = usize::try_from(self.state.cells[index])
                .ok()
                .and_then(|at| net.steps[step].tasks.get(at))
                && task.cost <= rest
            {
                rest -= task.cost;
                self.state.cells[index] += 1;
                self.run(&task.body);
            }
        }
    }

    /// E3: `held := e; if not held then T := 0`.
    fn e3_free_timers(&mut self) {
        if self.everything_has_ended() {
            return;
        }
        for (timer, data) in self.net.timers.iter() {
            self.mention(&data.condition);
            let held = self.eval(&data.condition) != 0;
            let place = self.tables.layout.timer(timer);
            self.state.cells[place + 1] = i64::from(held);
            if !held {
                self.state.cells[place] = 0;
            }
        }
    }

    /// Evaluates mealy outputs at L2 (at reset, at E4); they are a function of the situation before the micro-step.
    pub(crate) fn evaluate_mealy_outputs(&mut self) {
        let net = self.net;
        for output in &self.tables.mealy {
            let Driver::Mealy(emissions) = &net.outputs[*output].driver else { continue };
            self.row.outputs[output.index()] = 0;
            for emission in emissions {
                if self.state.situation.contains(emission.step)
                    && self.shows(*output, emission.condition.as_ref())
                {
                    self.row.outputs[output.index()] = 1;
                }
            }
        }
        if !self.tables.mealy.is_empty() && self.is_emergency() {
            for output in &self.tables.mealy {
                self.row.outputs[output.index()] = net.outputs[*output].safe_value();
            }
        }
    }

    /// The emergency condition in the current state: at L2 for mealy outputs, at E4 for all others.
    fn is_emergency(&mut self) -> bool {
        let Some(emergency) = &self.net.emergency else { return false };
        match &self.work.recorder {
            Some(recorder) if !recorder.emergency => {
                self.eval_unrecorded(&emergency.condition) != 0
            }
            Some(_) | None => self.eval(&emergency.condition) != 0,
        }
    }

    /// Evaluates which cells of this reaction the chart leaves open, from the inputs and from the situation before the reaction
    /// (semantics §3.6).
    pub(crate) fn evaluate_unspecified(&mut self) {
        let net = self.net;
        for open in &net.unspecified {
            if self.eval(&open.when) != 0 {
                match open.what {
                    OpenCell::Next => {
                        self.work.open_next = true;
                        self.row.open.next = true;
                        self.row.open.fixed.clone_from(&self.tables.mealy);
                    }
                    OpenCell::Output(output) => self.row.open.outputs.push(output),
                }
            }
        }
    }

    /// Marks the open mealy outputs of row 0. Such an output shows the cell for the reset situation with all inputs 0; the output is open if that cell is open.
    fn evaluate_open_mealy_outputs(&mut self) {
        // A wire of a chip already shows what fires in the first round.
        self.row.open.outputs.extend(self.tables.firings.iter().map(|(output, _)| *output));
        for open in &self.net.unspecified {
            if let OpenCell::Output(output) = open.what
                && matches!(self.net.outputs[output].driver, Driver::Mealy(_))
                && self.eval(&open.when) != 0
            {
                self.row.open.outputs.push(output);
            }
        }
    }

    /// True if there is no condition, or if the condition is true.
    fn holds(&mut self, condition: Option<&grafsynth_ir::net::Expr>) -> bool {
        condition.is_none_or(|condition| {
            self.mention(condition);
            self.eval(condition) != 0
        })
    }

    /// Like `holds`, for a condition that has an effect on this output only.
    fn shows(&mut self, output: OutputId, condition: Option<&grafsynth_ir::net::Expr>) -> bool {
        let is_of_interest =
            self.work.recorder.as_ref().is_none_or(|recorder| recorder.outputs[output.index()]);
        match condition {
            Some(condition) if !is_of_interest => self.eval_unrecorded(condition) != 0,
            Some(_) | None => self.holds(condition),
        }
    }

    /// E4: continuous outputs, copies of stored and controlled ones, and (unless END waits) continuous calls; then the effect of an emergency on them.
    fn e4_outputs(&mut self, is_last: bool) {
        let (net, tables) = (self.net, self.tables);
        // Only outputs that were on in the last row must be cleared: the cost depends on the active steps.
        for output in self.work.lit.drain(..) {
            self.row.outputs[output.index()] = 0;
        }
        for id in &tables.copied {
            self.row.outputs[id.index()] = match net.outputs[*id].driver {
                Driver::Stored(var) => self.state.cells[tables.layout.var(var)],
                Driver::Controlled(action) => {
                    self.state.cells[tables.layout.at(Cell::ActionQ(action))]
                }
                Driver::Continuous(_)
                | Driver::Mealy(_)
                | Driver::Fires(_)
                | Driver::Extern { .. } => continue,
            };
        }
        for (id, transitions) in &tables.firings {
            let fires = transitions.iter().any(|id| self.work.fired.contains(id));
            self.row.outputs[id.index()] = i64::from(fires);
        }
        let mut calls: Vec<(OutputId, u32)> = Vec::new();
        let mut at = 0;
        while let Some(step) = self.next_active(&mut at) {
            let ended = !tables.may_end.is_empty() && self.chart_had_ended(step);
            if ended {
                continue;
            }
            for (output, place) in &tables.emissions[step.index()] {
                let Driver::Continuous(emissions) = &net.outputs[*output].driver else { continue };
                let condition = emissions[*place as usize].condition.as_ref();
                if !is_last && condition.is_some_and(|condition| net.asks(condition)) {
                    continue;
                }
                if self.shows(*output, condition) {
                    self.row.outputs[output.index()] = 1;
                    self.work.lit.push(*output);
                }
            }
            calls.extend_from_slice(&tables.calls[step.index()]);
        }
        self.e4_held_outputs();
        if self.is_emergency() {
            for (id, output) in net.outputs.iter() {
                match output.driver {
                    Driver::Continuous(_) | Driver::Stored(_) | Driver::Controlled(_) => {
                        self.row.outputs[id.index()] = output.safe_value();
                        self.work.lit.push(id);
                    }
                    Driver::Mealy(_) | Driver::Fires(_) | Driver::Extern { .. } => {}
                }
            }
        } else if is_last {
            self.e4_calls(calls);
        }
        for output in &self.row.open.outputs {
            self.row.outputs[output.index()] = 0;
        }
    }

    /// The next active step with index `at` or above, without a lasting borrow of the situation; moves `at` beyond it.
    fn next_active(&self, at: &mut usize) -> Option<StepId> {
        let words = self.state.situation.words();
        let mut index = *at / 64;
        let mut word = words.get(index)? & (u64::MAX << (*at % 64));
        while word == 0 {
            index += 1;
            word = *words.get(index)?;
        }
        let found = index * 64 + word.trailing_zeros() as usize;
        *at = found + 1;
        Some(StepId::from_index(found))
    }

    fn chart_had_ended(&self, step: StepId) -> bool {
        let chart = self.tables.ranks.chart_of(self.net.steps[step].part);
        self.tables
            .may_end
            .iter()
            .position(|one| *one == chart)
            .is_some_and(|place| self.work.had_ended[place])
    }

    /// Outputs of an ended chart keep the values of the row in which it ended [C20].
    fn e4_held_outputs(&mut self) {
        let (net, tables) = (self.net, self.tables);
        for (output, chart) in &tables.layout.held {
            let Some(place) = tables.may_end.iter().position(|one| one == chart) else { continue };
            let cell = tables.layout.at(Cell::Held(*output, *chart));
            if self.work.had_ended[place] {
                self.row.outputs[output.index()] |= self.state.cells[cell];
                self.work.lit.push(*output);
            } else if self.has_ended(*chart)
                && let Driver::Continuous(emissions) = &net.outputs[*output].driver
            {
                let mut value = false;
                for emission in emissions {
                    let is_of_chart =
                        tables.ranks.chart_of(net.steps[emission.step].part) == *chart;
                    if is_of_chart && self.state.situation.contains(emission.step) {
                        value |= self.holds(emission.condition.as_ref());
                    }
                }
                self.state.cells[cell] = i64::from(value);
            }
        }
    }

    /// Calls each continuous extern action at most once: with the arguments of the first active step that calls it and whose condition is true [C22].
    fn e4_calls(&mut self, mut calls: Vec<(OutputId, u32)>) {
        let net = self.net;
        sort_by_rank(&mut calls, |(output, _)| [output.index() as u64]);
        let mut done = None;
        for (output, place) in calls {
            let Driver::Extern { calls, .. } = &net.outputs[output].driver else { continue };
            let call = &calls[place as usize];
            if self.holds(call.condition.as_ref()) && done != Some(output) {
                done = Some(output);
                self.call(output, &call.arguments);
            }
        }
    }

    /// E6: fills in the state of the row, and the texts that a target would run now.
    fn e6_row(&mut self) {
        self.row.steps.clear();
        self.row.steps.extend(self.state.situation.iter());
        self.row.vars.copy_from_slice(&self.state.cells[..self.tables.layout.n_var_cells]);
        for effect in &self.row.effects {
            if let Effect::Call(output, _) = effect {
                self.row.outputs[output.index()] += 1;
                self.work.lit.push(*output);
            }
        }
        if self.tables.has_code {
            for step in &self.row.steps {
                self.row
                    .effects
                    .extend(self.net.steps[*step].code.iter().cloned().map(Effect::Code));
            }
        }
    }
}
