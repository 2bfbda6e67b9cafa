//! The reaction as functions: semantics §3.9 line by line, for charts that are not statecharts.
//!
//! This is the second encoding of the semantics as a circuit. It shares nothing with the lowering to programs or with the encoder of the circuit under
//! proof, only the text of semantics.md.

use grafsynth_ir::ranks::sort_by_rank;
use std::collections::BTreeMap;

use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Driver, Emission, Evolution, Expr, InputKind, Leaf, Net, OutputId, Policy, Schedule, StepId,
    StepKind, TransitionId,
};

use super::aig::{Aig, Lit};
use super::calls::Call;
use super::forced::{ForcedChart, forced_charts};
use super::number::Number;
use super::state::{Shape, State, Value, held_of, is_move};
use super::statechart::run::{Run, Statechart};
use crate::exclusive::entered;

/// The inputs of a reaction.
#[derive(Debug, Clone)]
pub(crate) struct Inputs {
    pub(crate) values: Vec<Value>,
    /// True if time passes: by one tick if `dt` does not give the number.
    pub(crate) tick: Lit,
    /// The number of ticks that pass, never negative; `None` if a reaction lasts at most one.
    pub(crate) dt: Option<Number>,
}

/// The results of a reaction.
#[derive(Debug, Clone)]
pub(crate) struct Reaction {
    pub(crate) state: State,
    /// The code of each output; for an extern action, one bit that is 1 if it is called.
    pub(crate) outputs: Vec<Vec<Lit>>,
    pub(crate) fault: Lit,
}

/// The maximum number of micro-steps that are unrolled.
const MAX_DEPTH: u32 = 64;

/// The reason of the proofs that do not cover statecharts.
pub(super) const STATECHART: &str = "statecharts are not covered by this symbolic proof";

/// The reason why a net is not supported.
pub(crate) type Unsupported = String;

/// Makes the functions of one net.
pub(crate) struct Maker<'n> {
    pub(crate) net: &'n Net,
    pub(crate) aig: Aig,
    pub(crate) shape: Shape,
    pub(super) node_limit: usize,
    /// The number of micro-steps that are unrolled in a reaction.
    pub(super) depth: u32,
    /// True if the depth equals the limit of the chart, so that one more check decides about the fault.
    pub(super) may_fault: bool,
    pub(super) rank: Vec<u64>,
    pub(super) step_order: Vec<StepId>,
    pub(super) transition_order: Vec<TransitionId>,
    pub(super) over_inputs: Vec<bool>,
    /// For each part of a chart, its enclosing step.
    pub(super) around: Vec<Option<StepId>>,
    pub(super) children: Vec<Vec<StepId>>,
    pub(super) enclosing: Vec<StepId>,
    /// Transitions that compete directly, under `priority-age`.
    pub(super) rivals: BTreeMap<TransitionId, Vec<TransitionId>>,
    /// The condition under which an assignment so far had a value out of range, if that is wanted.
    pub(super) out_of_range: Option<Lit>,
    pub(super) inputs: Inputs,
    pub(super) events: Vec<Lit>,
    pub(super) rise: Vec<Lit>,
    pub(super) fall: Vec<Lit>,
    pub(super) fireable: Vec<Lit>,
    /// For a part of a split: what fires in the next micro-step instead of what the check decides. Whoever sets it shows that both are equal.
    pub(super) claimed: Option<Vec<Lit>>,
    /// What the check decided in the micro-step with a claim.
    pub(super) decided: Vec<Lit>,
    /// The fireable transitions that no forcing order blocks at the start.
    pub(super) free: Vec<Lit>,
    /// The forced charts; a chart comes after those that force it.
    pub(super) forced: Vec<ForcedChart>,
    /// True if END waits for a later round; false in every net except parts of a split.
    pub(super) waits: Lit,
    /// The calls of lists, bodies and tasks in the last reaction, in their order.
    pub(in crate::symbolic) calls: Vec<Call>,
    /// All calls of the last reaction, in their order.
    pub(in crate::symbolic) called: Vec<Call>,
    /// With simultaneous assignments: the values that every list of the micro-step reads.
    pub(super) frozen: Option<Box<State>>,
    /// The transitions that fire in the last reaction, micro-step by micro-step.
    pub(super) fired: Vec<Vec<Lit>>,
    /// For each number of micro-steps (the index): true if the last reaction has one more, or would have it with a larger depth. Not for statecharts.
    pub(super) more: Vec<Lit>,
    /// What the evolution of the current reaction carries, for statecharts and for proofs that cut an evolution.
    pub(in crate::symbolic) run: Run,
    /// For statecharts only.
    pub(super) statechart: Option<Statechart>,
}

impl<'n> Maker<'n> {
    pub(crate) fn new(
        net: &'n Net,
        depth: Option<u32>,
        node_limit: usize,
    ) -> Result<Self, Unsupported> {
        let (statechart, run) = Statechart::of(net)?.unzip();
        let (limit, is_stable) = match net.settings.evolution {
            Evolution::Single => (1, false),
            Evolution::Stable { limit } => (limit, true),
        };
        let mut maker = Maker {
            net,
            aig: Aig::new(),
            shape: Shape::of(net),
            node_limit,
            depth: match &statechart {
                Some(_) => depth.unwrap_or(MAX_DEPTH).min(MAX_DEPTH),
                None => depth.filter(|_| is_stable).unwrap_or(limit).min(limit),
            },
            may_fault: is_stable && depth.is_none_or(|depth| depth >= limit),
            rank: Vec::new(),
            step_order: Vec::new(),
            transition_order: Vec::new(),
            over_inputs: Vec::new(),
            around: vec![None; net.parts.len()],
            children: vec![Vec::new(); net.steps.len()],
            enclosing: Vec::new(),
            rivals: BTreeMap::new(),
            out_of_range: None,
            inputs: Inputs { values: Vec::new(), tick: Lit::FALSE, dt: None },
            fired: Vec::new(),
            more: Vec::new(),
            events: vec![Lit::FALSE; net.inputs.len()],
            rise: vec![Lit::FALSE; net.edges.len()],
            fall: vec![Lit::FALSE; net.edges.len()],
            fireable: vec![Lit::FALSE; net.transitions.len()],
            claimed: None,
            decided: Vec::new(),
            free: Vec::new(),
            forced: forced_charts(net)?,
            waits: Lit::FALSE,
            calls: Vec::new(),
            called: Vec::new(),
            frozen: None,
            run: run.unwrap_or_default(),
            statechart,
        };
        if let Some(statechart) = &maker.statechart {
            maker.shape.chart = statechart.shape(net);
        }
        if maker.depth > MAX_DEPTH {
            return Err(format!("a reaction of up to {} micro-steps is not unrolled", maker.depth));
        }
        maker.orders();
        maker.competition()?;
        Ok(maker)
    }

    pub(super) fn check_size(&self) -> Result<(), Unsupported> {
        if self.aig.len() > self.node_limit {
            return Err(format!("the reaction has more than {} nodes", self.node_limit));
        }
        Ok(())
    }

    /// Computes the ranks and the orders of lists (semantics §3.3, §4).
    fn orders(&mut self) {
        let net = self.net;
        let mut root = 0;
        // The charts that contain a part: by level, the last part visited.
        let mut around: Vec<usize> = Vec::new();
        for (id, part) in net.parts.iter() {
            let level = part.level as usize;
            if level <= 1 {
                root = id.index();
            }
            around.truncate(level.saturating_sub(1));
            around.resize(level.max(1), id.index());
            let rank = match net.settings.schedule {
                Schedule::Declared => root as u64,
                Schedule::Level => u64::from(part.level),
                Schedule::Priority => around
                    .iter()
                    .rev()
                    .find_map(|part| {
                        net.parts[grafsynth_ir::net::PartId::from_index(*part)].priority
                    })
                    .map_or(u64::MAX, u64::from),
            };
            self.rank.push(rank);
        }
        self.step_order = net.steps.ids().collect();
        sort_by_rank(&mut self.step_order, |step| [self.rank[net.steps[*step].part.index()]]);
        let mut transitions: Vec<TransitionId> = net.transitions.ids().collect();
        sort_by_rank(&mut transitions, |transition| {
            [self.rank[net.transitions[*transition].part.index()], self.urgency(*transition)]
        });
        self.transition_order = transitions;
        for edge in net.edges.values() {
            let over_inputs = edge.expr.leaves().all(|leaf| matches!(leaf, Leaf::Input(_)));
            self.over_inputs.push(over_inputs);
        }
        for (id, step) in net.steps.iter() {
            if let Some(parent) = step.parent {
                self.children[parent.index()].push(id);
                self.around[step.part.index()] = Some(parent);
            }
            // Parents are declared before their children, so outer steps come first.
            if step.kind == StepKind::Enclosing {
                self.enclosing.push(id);
            }
        }
    }

    /// The static key of a transition: its declared priority, or P.
    pub(super) fn urgency(&self, transition: TransitionId) -> u64 {
        let net = self.net;
        let data = &net.transitions[transition];
        if !is_move(net, transition) {
            return u64::MAX;
        }
        match net.settings.policy {
            Policy::Priority => data.priority.map_or(u64::MAX, u64::from),
            Policy::PriorityAge => entered(data)
                .filter_map(|step| net.steps[step].priority)
                .min()
                .map_or(u64::MAX, u64::from),
            Policy::All | Policy::InnerFirst | Policy::OuterFirst => u64::MAX,
        }
    }

    pub(super) fn key(&self, transition: TransitionId) -> (u64, u64) {
        (self.rank[self.net.transitions[transition].part.index()], self.urgency(transition))
    }

    /// REACTION of semantics §3.9.
    pub(crate) fn reaction(
        &mut self,
        state: &State,
        inputs: &Inputs,
    ) -> Result<Reaction, Unsupported> {
        let mut state = state.clone();
        self.inputs = inputs.clone();
        self.calls.clear();
        self.fired.clear();
        self.more.clear();
        self.latch(&mut state);
        if self.statechart.is_some() {
            self.begin_evolution(&mut state, false);
            self.evolve_statechart(&mut state)?;
            return self.end_of_statechart(state);
        }
        let mealy = self.mealy(&state);
        self.latch_present(&mut state);
        let fault = self.evolve(&mut state)?;
        let mut reaction = self.end_of_reaction(state, fault)?;
        for (output, code) in mealy {
            reaction.outputs[output.index()] = vec![code];
        }
        Ok(reaction)
    }

    /// Step L3: the events that are present in the first check.
    pub(super) fn latch_present(&mut self, state: &mut State) {
        for (event, input) in self.net.inputs.iter().filter(|(_, input)| input.kind.is_event()) {
            let row = match input.kind {
                InputKind::Event => self.inputs.values[event.index()].flag(),
                InputKind::InternalEvent | InputKind::Pin | InputKind::Extern => Lit::FALSE,
            };
            self.events[event.index()] = self.aig.or(row, state.raised[event.index()]);
            state.raised[event.index()] = Lit::FALSE;
        }
    }

    /// The rest of a reaction after its evolution, without mealy outputs.
    pub(super) fn end_of_reaction(
        &mut self,
        mut state: State,
        fault: Lit,
    ) -> Result<Reaction, Unsupported> {
        self.events.fill(Lit::FALSE);
        self.rise.fill(Lit::FALSE);
        self.fall.fill(Lit::FALSE);
        self.decide_waiting(&state);
        self.end(&mut state)?;
        for (edge, operand) in self.net.edges.iter() {
            if self.over_inputs[edge.index()] {
                state.old[edge.index()] = self.flag(&state, &operand.expr);
            }
        }
        let outputs = self.outputs(&state);
        Ok(Reaction { state, outputs, fault })
    }

    /// RESET of semantics §3.9.
    pub(crate) fn reset(&mut self) -> Result<Reaction, Unsupported> {
        let net = self.net;
        let mut state = self.shape.before_reset(net);
        let zero = |ty: Type| match ty {
            Type::Bool => Value::Flag(Lit::FALSE),
            Type::Int { .. } => Value::Number(Number::constant(ty.saturate(0))),
        };
        self.inputs = Inputs {
            values: net.inputs.values().map(|input| zero(input.ty)).collect(),
            tick: Lit::FALSE,
            dt: None,
        };
        self.calls.clear();
        self.events.fill(Lit::FALSE);
        self.rise.fill(Lit::FALSE);
        self.fall.fill(Lit::FALSE);
        self.fired.clear();
        self.waits = Lit::FALSE;
        if self.statechart.is_some() {
            self.reset_statechart(&mut state)?;
            return self.end_of_statechart(state);
        }
        let initial = self.initial_situation();
        let is_in = |step: StepId| initial.binary_search(&step).is_ok();
        for ((a, b), older) in &mut state.older {
            *older = Lit::constant(!is_in(*a) || is_in(*b));
        }
        if net.settings.assign_simultaneous {
            self.frozen = Some(Box::new(state.clone()));
        }
        for step in self.step_order.clone() {
            if is_in(step) {
                state.active[step.index()] = Lit::TRUE;
                self.block(&mut state, Lit::TRUE, &net.steps[step].entry);
            }
        }
        self.frozen = None;
        self.end(&mut state)?;
        let mealy = self.mealy(&state);
        let mut outputs = self.outputs(&state);
        for (output, code) in mealy {
            outputs[output.index()] = vec![code];
        }
        Ok(Reaction { state, outputs, fault: Lit::FALSE })
    }

    /// Step L2 without mealy outputs.
    pub(super) fn latch(&mut self, state: &mut State) {
        let net = self.net;
        let tick = self.inputs.tick;
        let dt = self.inputs.dt.clone().unwrap_or_else(|| Number::constant(1));
        for (step, data) in net.steps.iter() {
            let at = step.index();
            let ended = self.part_has_ended(state, data.part);
            let runs = self.aig.and_all([state.active[at], tick, !ended]);
            for (counter, cap) in [
                (state.elapsed[at].as_mut(), self.shape.elapsed[at]),
                (state.last_elapsed[at].as_mut(), self.shape.last_elapsed[at]),
            ] {
                if let (Some(counter), Some(cap)) = (counter, cap) {
                    *counter = advance(&mut self.aig, counter, runs, &dt, cap);
                }
            }
        }
        let all_ended = self.everything_has_ended(state);
        for timer in net.timers.ids() {
            let at = timer.index();
            if let (Some(counter), Some(cap)) = (&state.timers[at], self.shape.timers[at]) {
                let runs = self.aig.and_all([state.held[at], tick, !all_ended]);
                state.timers[at] = Some(advance(&mut self.aig, counter, runs, &dt, cap));
            }
        }
        for (id, part) in self.shape.times.clone() {
            let held = state.latches[&(id, held_of(part))];
            let stopped = self.action_has_ended(state, id);
            let runs = self.aig.and_all([held, tick, !stopped]);
            let counter = advance(
                &mut self.aig,
                &state.times[&(id, part)],
                runs,
                &dt,
                i64::from(net.actions[id].duration),
            );
            state.times.insert((id, part), counter);
        }
    }

    fn mealy(&mut self, state: &State) -> Vec<(OutputId, Lit)> {
        let net = self.net;
        let mut all = Vec::new();
        for (id, output) in net.outputs.iter() {
            if let Driver::Mealy(emissions) = &output.driver {
                let value = self.emitted(state, emissions);
                // The condition is read in the state before the micro-step, like the output itself.
                let emergency = self.emergency(state);
                let forced = self.forced(output, vec![value], emergency);
                all.extend(forced.into_iter().map(|lit| (id, lit)));
            }
        }
        all
    }

    pub(super) fn emitted(&mut self, state: &State, emissions: &[Emission]) -> Lit {
        let mut ways = Vec::new();
        for emission in emissions {
            let active = state.active[emission.step.index()];
            let condition = emission
                .condition
                .as_ref()
                .map_or(Lit::TRUE, |condition| self.flag(state, condition));
            ways.push(self.aig.and(active, condition));
        }
        self.aig.or_all(ways)
    }

    /// The condition under which the last reaction takes more micro-steps than are encoded. If the chart's limit is encoded, that is a fault instead.
    pub(super) fn overrun(&self) -> Lit {
        let more = self.more.get(self.depth as usize).filter(|_| !self.may_fault);
        more.copied().unwrap_or(Lit::FALSE)
    }

    /// EVOLVE of semantics §3.9; returns the fault.
    fn evolve(&mut self, state: &mut State) -> Result<Lit, Unsupported> {
        let is_stable = self.net.settings.evolution != Evolution::Single;
        let mut running = Lit::TRUE;
        let mut fresh = Lit::TRUE;
        for round in 0..=self.depth {
            let is_last = Lit::constant(round == self.depth);
            let goes_on = self.micro_step(state, (running, fresh), is_last)?;
            self.more.push(goes_on);
            if is_last == Lit::TRUE {
                return Ok(if self.may_fault { goes_on } else { Lit::FALSE });
            }
            if !is_stable {
                return Ok(Lit::FALSE);
            }
            running = goes_on;
            fresh = Lit::FALSE;
        }
        Ok(Lit::FALSE)
    }

    /// One round of EVOLVE, if the evolution is `running`: a check, and the micro-step that it decides unless `is_last`. Returns whether something is selected.
    pub(super) fn micro_step(
        &mut self,
        state: &mut State,
        (running, fresh): (Lit, Lit),
        is_last: Lit,
    ) -> Result<Lit, Unsupported> {
        let (chosen, selects) = self.checked(state, running, fresh)?;
        let may_fire = self.aig.and(running, !is_last);
        if may_fire == Lit::FALSE {
            return Ok(selects);
        }
        let fires: Vec<Lit> = chosen.iter().map(|one| self.aig.and(*one, may_fire)).collect();
        let fires = match self.claimed.take() {
            Some(claimed) => {
                self.decided = fires;
                claimed
            }
            None => fires,
        };
        self.fire(state, &fires)?;
        self.fired.push(fires);
        if self.net.settings.evolution != Evolution::Single {
            self.take_raised(state);
        }
        Ok(selects)
    }

    /// The events that were raised are those of the next check.
    pub(super) fn take_raised(&mut self, state: &mut State) {
        for event in 0..state.raised.len() {
            // If nothing fired, nothing was raised, and no further check reads the event.
            self.events[event] = state.raised[event];
            state.raised[event] = Lit::FALSE;
        }
    }

    /// A check: the transitions that it selects if the evolution is `running`, and whether there is one.
    pub(super) fn checked(
        &mut self,
        state: &mut State,
        running: Lit,
        fresh: Lit,
    ) -> Result<(Vec<Lit>, Lit), Unsupported> {
        let net = self.net;
        let now: Vec<Lit> =
            net.edges.values().map(|operand| self.flag(state, &operand.expr)).collect();
        let chosen = self.check(state, &now, fresh)?;
        let any = self.aig.or_all(chosen.iter().copied());
        for (edge, now) in now.iter().enumerate() {
            if !self.over_inputs[edge] {
                // The operand is compared in this check, whether or not something fires; firings below do not change the compared value.
                state.old[edge] = self.aig.ite(running, *now, state.old[edge]);
            }
        }
        Ok((chosen, self.aig.and(running, any)))
    }

    /// CHECK of semantics §3.9: for each transition, whether it is in F'.
    fn check(&mut self, state: &State, now: &[Lit], fresh: Lit) -> Result<Vec<Lit>, Unsupported> {
        let net = self.net;
        for (edge, now) in now.iter().enumerate() {
            let alive = if self.over_inputs[edge] { fresh } else { Lit::TRUE };
            let rises = self.aig.and(*now, !state.old[edge]);
            let falls = self.aig.and(!*now, state.old[edge]);
            self.rise[edge] = self.aig.and(alive, rises);
            self.fall[edge] = self.aig.and(alive, falls);
        }
        for (id, transition) in net.transitions.iter() {
            let mut parts: Vec<Lit> =
                transition.requires.iter().map(|step| state.active[step.index()]).collect();
            if transition.requires.is_empty()
                && let Some(step) = self.around[transition.part.index()]
            {
                parts.push(state.active[step.index()]);
            }
            if !transition.events.is_empty() {
                let events: Vec<Lit> =
                    transition.events.iter().map(|event| self.events[event.index()]).collect();
                parts.push(self.aig.or_all(events));
            }
            parts.push(self.flag(state, &transition.guard));
            self.fireable[id.index()] = self.aig.and_all(parts);
        }
        self.check_size()?;
        self.hold_forced(state);
        let mut chosen = self.select(state)?;
        self.stop_forced(state, &mut chosen);
        Ok(chosen)
    }

    /// NEXT of semantics §3.9: the situation after these transitions have fired, and the steps that restart.
    pub(super) fn next(&mut self, state: &State, fires: &[Lit]) -> (Vec<Lit>, Vec<Lit>) {
        let net = self.net;
        let n = net.steps.len();
        let mut leaves: Vec<Vec<Lit>> = vec![Vec::new(); n];
        let mut enters: Vec<Vec<Lit>> = vec![Vec::new(); n];
        let mut restarts: Vec<Vec<Lit>> = vec![Vec::new(); n];
        for (id, transition) in net.transitions.iter().filter(|(id, _)| is_move(net, *id)) {
            let fires = fires[id.index()];
            if fires == Lit::FALSE {
                continue;
            }
            transition.requires.iter().for_each(|step| leaves[step.index()].push(fires));
            for step in entered(transition) {
                enters[step.index()].push(fires);
                if transition.restart {
                    restarts[step.index()].push(fires);
                }
            }
        }
        // N1
        let before = state.active.clone();
        let mut next = Vec::with_capacity(n);
        let mut restarted = Vec::with_capacity(n);
        for step in 0..n {
            let left = self.aig.or_all(leaves[step].iter().copied());
            let entered = self.aig.or_all(enters[step].iter().copied());
            let stays = self.aig.and(before[step], !left);
            next.push(self.aig.or(stays, entered));
            let again = self.aig.or_all(restarts[step].iter().copied());
            restarted.push(self.aig.and_all([before[step], left, again]));
        }
        // N2
        for outer in self.enclosing.clone() {
            let e = outer.index();
            let gone = self.aig.or(!next[e], restarted[e]);
            let clears = self.aig.and(before[e], gone);
            let fresh = self.aig.or(!before[e], restarted[e]);
            let brings = self.aig.and(next[e], fresh);
            let mut inside = Vec::new();
            let mut todo = self.children[e].clone();
            while let Some(step) = todo.pop() {
                inside.push(step);
                todo.extend(&self.children[step.index()]);
            }
            for step in inside {
                let at = step.index();
                next[at] = self.aig.and(next[at], !clears);
                restarted[at] = self.aig.and(restarted[at], !clears);
            }
            for step in self.children[e].clone() {
                let at = step.index();
                if net.steps[step].activation_link {
                    next[at] = self.aig.or(next[at], brings);
                    let again = self.aig.and_all([brings, clears, before[at]]);
                    restarted[at] = self.aig.or(restarted[at], again);
                }
            }
        }
        self.force(&before, &mut next, &mut restarted);
        (next, restarted)
    }

    /// FIRE of semantics §3.9.
    pub(super) fn fire(&mut self, state: &mut State, fires: &[Lit]) -> Result<(), Unsupported> {
        let net = self.net;
        let n = net.steps.len();
        let before = state.active.clone();
        let (next, restarted) = self.next(state, fires);
        self.check_size()?;
        let mut down = Vec::with_capacity(n);
        let mut up = Vec::with_capacity(n);
        for step in 0..n {
            let drops = self.aig.and(before[step], !next[step]);
            let rises = self.aig.and(next[step], !before[step]);
            down.push(self.aig.or(drops, restarted[step]));
            up.push(self.aig.or(rises, restarted[step]));
        }
        if net.settings.assign_simultaneous {
            self.frozen = Some(Box::new(state.clone()));
        }
        // F2
        for step in self.step_order.clone() {
            let at = step.index();
            self.block(state, down[at], &net.steps[step].exit);
            state.active[at] = self.aig.and(state.active[at], !down[at]);
            if let Some(mut counter) = state.elapsed[at].take() {
                self.set(down[at], &mut counter, &Number::constant(0));
                state.elapsed[at] = Some(counter);
            }
        }
        // F3
        for id in self.transition_order.clone() {
            self.block(state, fires[id.index()], &net.transitions[id].actions);
        }
        // F4
        for step in self.step_order.clone() {
            let at = step.index();
            state.active[at] = self.aig.or(state.active[at], up[at]);
            let counters =
                [&mut state.elapsed[at], &mut state.last_elapsed[at], &mut state.task[at]];
            for number in counters.into_iter().flatten() {
                *number = Number::select(&mut self.aig, up[at], &Number::constant(0), number);
            }
            self.block(state, up[at], &net.steps[step].entry);
        }
        self.frozen = None;
        // The intermediate values that lists saw are no longer needed: this is the same set, with fewer nodes.
        state.active = next;
        // The task index of an inactive step is never read; kept at 0 it is a single state.
        for (index, down) in state.task.iter_mut().zip(&down) {
            if let Some(index) = index {
                *index = Number::select(&mut self.aig, *down, &Number::constant(0), index);
            }
        }
        // F5
        for ((a, b), older) in &mut state.older {
            let stays = self.aig.and(*older, !up[a.index()]);
            *older = self.aig.or(up[b.index()], stays);
        }
        self.check_size()
    }

    /// The outputs that follow only from a state at the end of a reaction and from the inputs of that reaction. `None` for the others.
    pub(crate) fn outputs_of_state(
        &mut self,
        state: &State,
        inputs: &Inputs,
    ) -> Vec<Option<Vec<Lit>>> {
        self.inputs = inputs.clone();
        self.events.fill(Lit::FALSE);
        self.rise.fill(Lit::FALSE);
        self.fall.fill(Lit::FALSE);
        self.calls.clear();
        let all = self.outputs(state);
        let net = self.net;
        all.into_iter()
            .zip(net.outputs.values())
            .map(|(code, output)| match &output.driver {
                Driver::Continuous(_) | Driver::Stored(_) => Some(code),
                Driver::Mealy(_)
                | Driver::Fires(_)
                | Driver::Controlled(_)
                | Driver::Extern { .. } => None,
            })
            .collect()
    }

    /// The condition that an assumption forbids, as a function of the inputs.
    pub(crate) fn forbidden(&mut self, state: &State, inputs: &Inputs, never: &Expr) -> Lit {
        self.inputs = inputs.clone();
        for (event, input) in self.net.inputs.iter() {
            if input.kind.is_event() {
                self.events[event.index()] = inputs.values[event.index()].flag();
            }
        }
        let forbidden = self.flag(state, never);
        self.events.fill(Lit::FALSE);
        forbidden
    }
}

/// `min(counter + dt, cap)` if the counter is running.
fn advance(aig: &mut Aig, counter: &Number, runs: Lit, dt: &Number, cap: i64) -> Number {
    let more = Number::arith(aig, grafsynth_ir::expr::ArithOp::Add, counter, dt);
    let capped = more.saturate(aig, 0, cap);
    Number::select(aig, runs, &capped, counter)
}

/// Returns an error if the net leaves cells open: then properties of the results of a reaction cannot be derived.
pub(super) fn refuse_open_cells(net: &Net) -> Result<(), Unsupported> {
    if net.unspecified.is_empty() {
        return Ok(());
    }
    Err("open cells are not covered by the symbolic search".to_owned())
}
