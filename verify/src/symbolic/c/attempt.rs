//! One attempt: a reaction of the net and a call of the C in one graph, and what must be true after them.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use grafsynth_c::tree::{StructId, Symbol, SymbolKind};
use grafsynth_ir::instance::Holds;
use grafsynth_ir::net::{InputId, InputKind};
use grafsynth_ir::program::Origin;
use grafsynth_sim::MAX_DT;

use super::exec::Program;
use super::memory::{Cell, INPUTS, INSTANCE, Memory, Scalar};
use super::net_values::differs;
use super::question::{Check, Focus, Question, Subject};
use super::report::Earlier;
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::number::Number;
use crate::symbolic::reaction::{Inputs, Reaction};
use crate::symbolic::state::{State, Value};
use crate::symbolic::{Model, known_depth};

/// The structures of the interface.
pub(super) struct Structures {
    pub(super) instance: Option<StructId>,
    pub(super) inputs: Option<StructId>,
    pub(super) outputs: Option<StructId>,
}

pub(super) struct Attempt<'a> {
    pub(super) of: Subject<'a>,
    pub(super) model: Model<'a>,
    /// True if the reaction starts only in states in which one step of a component is active, or none.
    pub(super) is_case: bool,
    pub(super) program: Program<'a>,
    pub(super) structures: Structures,
    /// The state of the net before the reaction.
    pub(super) state: State,
    pub(super) inputs: Inputs,
    /// The values of the instance before the reaction, in the order of the hint.
    pub(super) before: Vec<Scalar>,
    /// The cells of the scalars that hold nothing of the net before the reaction, in the order of the hint.
    pub(super) extra: Vec<Cell>,
    /// The members of the gate, if there is one, by the number of their cell: before the reaction, the mark has any of its values, and the others have none.
    pub(super) gate_members: BTreeMap<usize, Rc<Cell>>,
    /// The variables that this attempt creates itself, each group with the condition that it has a possible value.
    pub(super) valid: Vec<(Vec<Lit>, Lit)>,
    /// For each of these variables, its position in its word, for the order of decision diagrams.
    pub(super) bit_of: BTreeMap<Lit, u32>,
    /// The sets of steps of which exactly one is active, each with the invariant as a function once a question needs it.
    pub(super) invariants: Vec<(BTreeSet<Lit>, Option<Lit>)>,
    /// For a statechart: scalars by their number in the hint, each with the condition that its steps do not exclude each other.
    pub(super) exclusive: Vec<(usize, Lit)>,
    /// Conditions that are true in every state of the instance that the hint describes.
    pub(super) assumed: Vec<Lit>,
    /// After `NAME_init`: the members that are no part of the relation and may have no value, by their number in the hint. `None` elsewhere: a reaction must not
    /// take a value away.
    pub(super) unset: Option<Vec<usize>>,
    /// After the first part of a reaction: for each extern condition, the literal that an earlier part called it.
    pub(super) asked_before: BTreeMap<InputId, Lit>,
    /// For each extern condition, the literal that this part of the reaction calls it.
    pub(super) asked_here: BTreeMap<InputId, Lit>,
    /// Variables that no statement changes, besides those of the inputs.
    pub(super) constant_in_loop: BTreeSet<Lit>,
    /// True if the reaction of the net takes more micro-steps than any reachable one.
    pub(super) overrun: Lit,
    /// True if the reaction of the net fails.
    pub(super) fault: Lit,
    /// The literals of the net's state that are true in every reachable state, once a question needs them.
    pub(super) stuck: Option<Vec<Lit>>,
    /// The state of the net after the reaction.
    pub(super) next: Option<State>,
    /// The variables of each timer in the instance, by its number in the hint, and later its value after the reaction.
    pub(super) time_bits: Vec<(usize, Vec<Lit>)>,
    pub(super) next_times: Vec<(Vec<Lit>, Number)>,
    /// The variables of the number of ticks.
    pub(super) dt_bits: Vec<Lit>,
    /// The number of ticks of the reaction that is cut.
    pub(super) dt_now: Option<Number>,
    /// The instance before the reaction that is cut, if callbacks compare it with the one after it.
    pub(super) earlier: Option<Earlier>,
}

/// The structures of the C of a chart: those that its header declares.
fn structures(of: &Subject<'_>) -> Structures {
    let named = |suffix: &str| {
        let name = format!("{}{suffix}", of.hint.prefix);
        let is_it =
            |symbol: &&Symbol| symbol.name == name && matches!(symbol.kind, SymbolKind::Typedef);
        let symbol = of.unit.symbols.values().find(is_it)?;
        symbol.canonical.ty.as_struct()
    };
    Structures { instance: named("_t"), inputs: named("_in_t"), outputs: named("_out_t") }
}

impl<'a> Attempt<'a> {
    pub(super) fn new(of: Subject<'a>, focus: Option<Focus>) -> Result<Self, String> {
        let depth = if of.is_cut { Some(1) } else { known_depth(of.facts) };
        let mut model = Model::of(of.net, depth, of.limits)?;
        let aig = std::mem::replace(model.aig(), Aig::new());
        let mut program = Program::new(of.unit, aig, of.limits.circuit_nodes)?;
        program.most_rounds = of.facts.most_rounds(of.net).map(|rounds| rounds.value);
        let structures = structures(&of);
        let (mut state, mut inputs) = (model.state.clone(), model.inputs.clone());
        let is_statechart = of.net.settings.policy.is_statechart();
        // A state of a statechart may be active within a reaction only.
        for step in of.facts.unreachable_steps.iter().filter(|_| !is_statechart) {
            state.active[step.index()] = Lit::FALSE;
        }
        if let Some(focus) = focus {
            for step in &of.facts.components[focus.component].steps {
                state.active[step.index()] = Lit::constant(Some(*step) == focus.active);
            }
        }
        for (id, input) in of.net.inputs.iter() {
            if input.kind == InputKind::InternalEvent {
                inputs.values[id.index()] = Value::Flag(Lit::FALSE);
            }
        }
        let mut this = Attempt {
            of,
            model,
            is_case: focus.is_some(),
            program,
            structures,
            state,
            inputs,
            before: Vec::new(),
            extra: Vec::new(),
            gate_members: BTreeMap::new(),
            valid: Vec::new(),
            bit_of: BTreeMap::new(),
            invariants: Vec::new(),
            exclusive: Vec::new(),
            assumed: Vec::new(),
            unset: None,
            asked_before: BTreeMap::new(),
            asked_here: BTreeMap::new(),
            constant_in_loop: BTreeSet::new(),
            overrun: Lit::FALSE,
            fault: Lit::FALSE,
            stuck: None,
            next: None,
            time_bits: Vec::new(),
            next_times: Vec::new(),
            dt_bits: Vec::new(),
            dt_now: None,
            earlier: None,
        };
        let is_queue =
            |(_, holds): &(_, Holds)| matches!(holds, Holds::Piece(Origin::ExternalQueue, _));
        if is_statechart && of.hint.state.iter().any(is_queue) {
            this.model.maker.with_external_queue();
        }
        let all = of.facts.invariants.iter().chain(of.further);
        let singles = all.filter(|invariant| invariant.count == 1);
        for invariant in singles {
            let steps = invariant.steps.iter().map(|step| this.state.active[step.index()]);
            this.invariants.push((steps.gather(), None));
        }
        for (place, holds) in &of.hint.state {
            let value = this.held(place, holds)?;
            this.before.push(value);
        }
        this.relate_recorded();
        this.hold_extra()?;
        Ok(this)
    }

    pub(super) fn aig(&mut self) -> &mut Aig {
        &mut self.program.aig
    }

    /// Runs a part with the graph in the model, where the second encoding expects it.
    pub(super) fn with_model<T>(&mut self, part: impl FnOnce(&mut Self) -> T) -> T {
        std::mem::swap(&mut self.program.aig, &mut self.model.maker.aig);
        let done = part(self);
        std::mem::swap(&mut self.program.aig, &mut self.model.maker.aig);
        done
    }

    /// The checks after reset.
    pub(super) fn reset(&mut self) -> Result<Vec<Check>, String> {
        let Reaction { state, outputs, fault } =
            self.with_model(|this| this.model.maker.reset())?;
        let wanted = self.model.maker.called.clone();
        let mut memory = self.memory(None)?;
        self.unset = Some(Vec::new());
        self.link();
        self.call("_init", &mut memory, None)?;
        if !self.program.asked.is_empty() {
            return Err(format!("`{}_init` calls an extern condition", self.of.hint.prefix));
        }
        let mut checks = self.call_checks(&wanted)?;
        checks.extend(self.gate_after_reset(&memory)?);
        checks.extend(self.related(&state, fault, &memory)?);
        checks.extend(self.shown_outputs(&outputs, &memory)?);
        checks.extend(self.queries(&state, Some(fault), &memory)?);
        if self.of.is_cut {
            checks.extend(self.invariants_of_row(&state));
        }
        checks.extend(self.obligations());
        Ok(checks)
    }

    /// The checks after a reaction, and, if requested, those of the queries and of `NAME_stop` before it.
    pub(super) fn reaction(&mut self, has_queries: bool) -> Result<Vec<Check>, String> {
        let dt = self.dt()?;
        self.inputs.tick = Lit::TRUE;
        self.inputs.dt = Some(dt.clone());
        let (state, inputs) = (self.state.clone(), self.inputs.clone());
        let Reaction { state: next, outputs, fault } =
            self.with_model(|this| this.model.maker.reaction(&state, &inputs))?;
        let wanted = self.model.maker.called.clone();
        self.overrun = self.model.maker.overrun();
        let before = self.before.clone();
        let mut memory = self.memory(Some(&before))?;
        let mut checks = Vec::new();
        if has_queries {
            checks = self.queries(&state, None, &memory)?;
            checks.extend(self.stopped(&memory)?);
            checks.extend(self.stays_stopped(&memory, &dt)?);
        }
        let start = memory.clone();
        self.link();
        self.call(self.of.reaction(), &mut memory, Some(&dt))?;
        self.keeps_gate(&memory)?;
        checks.extend(self.report_checks(
            |_, step| Ok(Some(state.active[step.index()])),
            |step| Some(next.active[step.index()]),
        )?);
        checks.extend(self.call_checks(&wanted)?);
        if !memory.is_unchanged(&start, INPUTS) {
            return Err(format!("`{}_step` changes its inputs", self.of.hint.prefix));
        }
        checks.extend(self.related(&next, fault, &memory)?);
        self.next_times(&memory)?;
        self.next = Some(next);
        self.fault = fault;
        checks.extend(self.shown_outputs(&outputs, &memory)?);
        if let Some(name) = &self.of.hint.fault {
            let value = self.ask(name, &memory)?;
            let broken = differs(self.aig(), &value, &Value::Flag(fault));
            checks.push(Check { question: Question::Fault, broken });
        }
        checks.extend(self.obligations());
        Ok(checks)
    }

    pub(super) fn obligations(&mut self) -> Vec<Check> {
        let all = std::mem::take(&mut self.program.obligations);
        all.into_iter()
            .map(|one| {
                let span = one.loc.0;
                let question = Question::Obligation(one.what, span.file.0, span.range().start);
                Check { question, broken: one.broken }
            })
            .collect()
    }

    /// The ticks of a reaction: every value that the contract and the parameter allow, or any number if there is no parameter.
    pub(super) fn dt(&mut self) -> Result<Number, String> {
        let machine = self.of.unit.machine;
        let step = self.function(&format!("{}_step", self.of.hint.prefix));
        let params = step.map(|step| self.params(step)).unwrap_or_default();
        let kinds = params
            .iter()
            .filter_map(|param| self.of.unit.integer(&self.of.unit.symbols[*param].canonical.ty));
        let n_bits = match kinds.collect::<Vec<_>>().as_slice() {
            [] => 16,
            [kind] if !machine.is_signed(*kind) => machine.bits(*kind),
            _ => {
                return Err(format!(
                    "`{}_step` does not have the parameters of a reaction",
                    self.of.hint.prefix
                ));
            }
        };
        // The contract ends at `MAX_DT` (semantics §7), which is below the maximum of a wide parameter.
        let bits = self.fresh(n_bits.min(u32::BITS - MAX_DT.leading_zeros()));
        let dt = Number::from_code(self.aig(), &bits, 0);
        self.dt_bits = bits;
        Ok(dt)
    }

    /// Stores the value of each timer of the instance after the reaction.
    fn next_times(&mut self, memory: &Memory) -> Result<(), String> {
        for (at, bits) in std::mem::take(&mut self.time_bits) {
            let cell =
                self.read(memory, INSTANCE, self.structures.instance, &self.of.hint.state[at].0)?;
            if let Some(Scalar::Int(value)) = &cell.value {
                let next = value.number(self.aig());
                self.next_times.push((bits, next));
            }
        }
        Ok(())
    }
}
