//! One check of an evolution outside statecharts, from any point of it, for proofs that match the loop of a program check by check.
//!
//! Between two checks there are the state of the net, in which no event is raised because the raised ones are those of the next check, and the
//! [`Run`](super::statechart::run::Run). Each check makes a micro-step and counts it, or ends the evolution. So a reaction makes at most one check more than the
//! limit of micro-steps.

use grafsynth_ir::expr::ArithOp;
use grafsynth_ir::net::{Driver, Evolution, InputId, InputKind, StmtKind};

use super::aig::Lit;
use super::number::Number;
use super::reaction::{Maker, Unsupported};
use super::state::State;
use super::statechart::run::Run;

impl Maker<'_> {
    /// The most micro-steps of a reaction.
    pub(super) fn limit(&self) -> u32 {
        match self.net.settings.evolution {
            Evolution::Single => 1,
            Evolution::Stable { limit } => limit,
        }
    }

    /// L3, and what the evolution starts with.
    pub(super) fn begin_micro_steps(&mut self, state: &mut State) {
        self.latch_present(state);
        self.run = Run { running: Lit::TRUE, fresh: Lit::TRUE, ..Run::default() };
        self.store_present();
    }

    /// Any run before a check or, with `goes_on` false, after the last one.
    pub(super) fn any_micro_steps(&mut self, goes_on: bool) {
        let n_bits = u32::BITS - self.limit().leading_zeros();
        let bits: Vec<Lit> = (0..n_bits).map(|_| self.aig.variable()).collect();
        let count = Number::from_code(&mut self.aig, &bits, 0);
        // A fault ends the evolution.
        let fault = if goes_on { Lit::FALSE } else { self.aig.variable() };
        let fresh = self.aig.variable();
        let event = self.run.event.keys().map(|event| (*event, self.aig.variable())).collect();
        let running = Lit::constant(goes_on);
        self.run = Run { fault, running, fresh, event, count, ..Run::default() };
    }

    /// One check of the run, and the micro-step that it decides.
    pub(super) fn one_micro_step(&mut self, state: &mut State) -> Result<(), Unsupported> {
        state.raised.fill(Lit::FALSE);
        for (event, present) in &self.run.event {
            self.events[event.index()] = *present;
        }
        let limit = self.limit();
        let Run { running, fresh, count, .. } = self.run.clone();
        let is_last = self.equals(&count, limit as usize);
        let (chosen, selects) = self.checked(state, running, fresh)?;
        let fires = self.aig.and(selects, !is_last);
        // The loop of a program has this shape too: it makes the whole micro-step under one condition. So most functions are equal without a solver.
        let (before, n_calls) = (state.clone(), self.calls.len());
        self.fire(state, &chosen)?;
        state.keep_unless(&mut self.aig, fires, &before);
        for call in self.calls.iter_mut().skip(n_calls) {
            call.when = self.aig.and(fires, call.when);
        }
        self.take_raised(state);
        let more = Number::arith(&mut self.aig, ArithOp::Add, &count, &Number::constant(1));
        let code = more.code(&mut self.aig, 0, u32::BITS - limit.leading_zeros());
        let more = Number::from_code(&mut self.aig, &code, 0);
        self.run.count = Number::select(&mut self.aig, fires, &more, &count);
        self.run.fault = self.aig.and(selects, is_last);
        self.run.running = fires;
        self.run.fresh = Lit::FALSE;
        self.store_present();
        Ok(())
    }

    fn store_present(&mut self) {
        let inputs = self.net.inputs.iter().filter(|(_, input)| input.kind.is_event());
        self.run.event = inputs.map(|(event, _)| (event, self.events[event.index()])).collect();
    }

    /// The internal events that no list raises.
    fn never_raised(&self) -> Vec<InputId> {
        let raised = |event| {
            self.net
                .statements()
                .any(|stmt| matches!(stmt.kind, StmtKind::Raise(it) if it == event))
        };
        let internal = self.net.inputs.iter();
        let internal = internal.filter(|(_, input)| input.kind == InputKind::InternalEvent);
        internal.map(|(event, _)| event).filter(|event| !raised(*event)).collect()
    }

    /// Invariants between two reactions: an event that no list raises is not raised, and forced charts are as their orders want.
    pub(super) fn invariants_of_rows(&mut self, state: &State) -> Vec<Lit> {
        let mut all = self.stays_forced(state);
        all.extend(self.never_raised().into_iter().map(|event| !state.raised[event.index()]));
        all
    }

    /// Invariants between two checks: timers and task indices of inactive steps are 0, an enclosed step is active only with its enclosing step, an event that no
    /// list raises is absent, and forced charts are as their orders want.
    pub(super) fn invariants_of_micro_steps(&mut self, state: &State) -> Vec<Lit> {
        let mut all = self.stays_forced(state);
        let events = self.never_raised().into_iter();
        all.extend(events.filter_map(|event| self.run.event.get(&event)).map(|it| !*it));
        for (id, step) in self.net.steps.iter() {
            let own = state.active[id.index()];
            let counters = [&state.elapsed[id.index()], &state.task[id.index()]];
            for bit in counters.into_iter().flatten().flat_map(|number| number.bits().to_vec()) {
                all.push(self.aig.or(!bit, own));
            }
            if let Some(parent) = step.parent {
                all.push(self.aig.or(!own, state.active[parent.index()]));
            }
        }
        all
    }

    /// The reason why the evolution cannot be cut: an output that is not a function of the state after it.
    pub(super) fn refuse_firing_outputs(&self) -> Result<(), Unsupported> {
        let is_of_firing = |driver: &Driver| matches!(driver, Driver::Mealy(_) | Driver::Fires(_));
        if self.net.outputs.values().any(|output| is_of_firing(&output.driver)) {
            return Err(
                "an output that shows a firing is not supported in a cut evolution".to_owned()
            );
        }
        Ok(())
    }
}
