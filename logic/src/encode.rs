//! From net to logic: symbolic execution of the reaction program.
//!
//! Every cell of the program becomes flip-flops: one for a step (one-hot), one for each bit of a bounded integer or timer (offset binary from its lower bound),
//! as many for each element of an array, and one for each pair of competing steps whose ages are compared (which of the two is older). The program's statements
//! are then executed once over nodes instead of values; the final content of a cell is its D function. A transition of a plain net costs a few nodes, so the
//! cost is linear in the size of the program.
//!
//! States with a history in an enclosing state are coded by the registers of their regions, which store the history; see the module `regions`.
//!
//! # Outputs
//! A pin is sampled after the clock edge with the row's inputs still applied (semantics.md §9), so a continuous output must be a function of the *new*
//! situation. Each value is therefore computed in two forms: as a function of the old state and, if it reads only cells that no later statement stores, as a
//! function of the new state. An output with the second form is combinational. An output without it (a call in a statement list, the fault flag) gets its own
//! flip-flop, whose D function is its function of the old state; its pin shows the same value after the clock edge. A `mealy` output is combinational in the
//! old state and is sampled before the clock edge.
// If the encoding forgot a variant, the circuit would be wrong.
#![warn(clippy::wildcard_enum_match_arm)]

mod multicycle;
mod refused;
mod regions;
mod run;
mod shared_times;
mod substitute;

use crate::build::Builder;
use crate::codes;
use crate::word::{self, Word};
use grafsynth_ir::Gather;
use grafsynth_ir::Valid;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{
    Flop, FlopBit, Function, Logic, Node, NodeId, Open, PinInput, PinInputId, PinOutput, PinRole,
};
use grafsynth_ir::net::{
    self, Driver, Evolution, InputKind, Meta, Net, OpenCell, PropertyLeaf, PropertyRole,
};
use grafsynth_ir::program::{
    CellId, Leaf, Origin, Program, ResetEffect, Stmt, expressions, statements,
};
use multicycle::{Registers, Stepwise};
use regions::Regions;
pub use regions::kept_apart;
use std::collections::BTreeMap;

/// Options of the encoding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodeOptions {
    /// Add the chart's assumptions about its environment (and unused input codes) to [`Logic::never`]. The functions do not depend on this.
    pub assumptions: bool,
    /// The maximum number of nodes of a circuit (about 50 bytes per node during construction).
    pub max_nodes: usize,
    /// The maximum size in nodes of a circuit that composes all micro-steps into one clock, if several clocks are also allowed.
    pub max_composed: usize,
    /// Selects the charts whose reactions take several clocks.
    pub busy: BusyMode,
}

/// The charts whose reactions take several clocks, one per micro-step, with a `busy` output (semantics.md §9). In every mode, an evolution is composed into one
/// clock if the chart has an emergency, or if it calls actions between its micro-steps, because a chip has one strobe per reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BusyMode {
    /// No chart: one clock is one reaction.
    Never,
    /// A chart whose composition into one clock is too large ([`EncodeOptions::max_composed`]).
    WhenTooLarge,
    /// Like `WhenTooLarge`, and also if it is not proved that every evolution ends within the limit.
    #[default]
    WhenUnproved,
    /// Every chart with evolution `stable`.
    Always,
}

impl Default for EncodeOptions {
    /// One clock per reaction, for callers that do not wait for `busy`.
    fn default() -> Self {
        EncodeOptions {
            assumptions: true,
            max_nodes: 2_000_000,
            max_composed: 200_000,
            busy: BusyMode::Never,
        }
    }
}

/// True if it is proved that every evolution ends within the chart's limit, so that the composition of its micro-steps is always deep enough.
#[must_use]
pub fn is_depth_proved(net: &Net, facts: &Facts) -> bool {
    match net.settings.evolution {
        Evolution::Single => true,
        Evolution::Stable { limit } => {
            facts.always_stable.is_some()
                || facts.stable_depth.as_ref().is_some_and(|depth| depth.value <= limit)
        }
    }
}

/// Encodes a net with one flip-flop per step, or per child of a region; see the module documentation.
///
/// The micro-steps of a stable evolution are composed into one clock: they are unrolled [`Facts::stable_depth`] times if that is proved, else as
/// often as the chart's limit allows; or, depending on [`EncodeOptions::busy`], each micro-step gets its own clock.
///
/// # Errors
/// Returns findings about constructs that a chip does not support: target-language text, calls with arguments, an action that may be called twice in
/// one reaction, and a circuit of more than [`EncodeOptions::max_nodes`] nodes.
pub fn encode(
    net: &Valid<Net>,
    program: &Program,
    facts: &Facts,
    options: &EncodeOptions,
) -> Result<Logic, Vec<Diagnostic>> {
    let one_clock = |max_nodes: usize| composed(net, program, facts, options, max_nodes, None);
    let stepwise = match (net.settings.evolution, options.busy) {
        (Evolution::Single, _) | (_, BusyMode::Never) => None,
        // With several clocks, outputs are in registers, which an emergency could not force between clock edges.
        _ if net.emergency.is_some() => None,
        (
            Evolution::Stable { .. },
            BusyMode::WhenTooLarge | BusyMode::WhenUnproved | BusyMode::Always,
        ) => multicycle::stepwise(net, program),
    };
    let Some(stepwise) = stepwise else { return one_clock(options.max_nodes) };
    let try_composed = match options.busy {
        BusyMode::Never | BusyMode::Always => false,
        BusyMode::WhenTooLarge => true,
        BusyMode::WhenUnproved => is_depth_proved(net, facts),
    };
    if try_composed {
        let is_too_large = |findings: &[Diagnostic]| {
            findings.iter().any(|finding| finding.code == codes::TOO_LARGE)
        };
        match one_clock(options.max_composed.min(options.max_nodes)) {
            Err(findings) if is_too_large(&findings) => {}
            settled => return settled,
        }
    }
    let Stepwise { program, registers } = stepwise;
    composed(net, &program, facts, options, options.max_nodes, Some(&registers))
}

/// The circuit of a program. If a reaction takes several clocks, the program describes one of these clocks, and `registers` are the
/// cells that pins show.
fn composed(
    net: &Valid<Net>,
    program: &Program,
    facts: &Facts,
    options: &EncodeOptions,
    max_nodes: usize,
    registers: Option<&Registers>,
) -> Result<Logic, Vec<Diagnostic>> {
    let regions = regions::regions(net, program);
    let program = regions.as_ref().map_or(program, |regions| &regions.program);
    let mut encoder = Encoder::new(net, program, facts, options);
    encoder.regions = regions.as_ref();
    encoder.max_nodes = max_nodes;
    encoder.stepwise = registers;
    encoder.refuse_reset_effects();
    encoder.block(&program.body, 0);
    if let Some(diagnostic) = encoder.overflow.take() {
        encoder.diagnostics.push(diagnostic);
    }
    if any_error(&encoder.diagnostics) {
        return Err(encoder.diagnostics);
    }
    encoder.finish()
}

/// A symbolic value.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Value {
    Bool(NodeId),
    Int(Word),
}

/// A cell's element or a temporary: where a value can be stored.
type Place = usize;

/// A call site of an extern action.
struct CallSite {
    /// The condition of the call, as a function of the old state.
    before: NodeId,
    /// The condition of the call, as a function of the new state.
    after: Option<NodeId>,
}

/// The bits of an output.
struct Shown {
    /// The bits as functions of the old state.
    before: Vec<NodeId>,
    /// The bits as functions of the new state, if this form exists.
    after: Option<Vec<NodeId>>,
    /// The binary code of the output's value after reset.
    reset: u64,
}

struct Encoder<'a> {
    net: &'a Net,
    program: &'a Program,
    facts: &'a Facts,
    options: &'a EncodeOptions,
    max_nodes: usize,
    /// The cells that pins show, if a reaction takes several clocks.
    stepwise: Option<&'a Registers>,
    /// States that are coded by the register of their region.
    regions: Option<&'a Regions>,
    builder: Builder,
    diagnostics: Vec<Diagnostic>,
    overflow: Option<Diagnostic>,
    /// The value of each input as bits.
    inputs: IdMap<net::Input, Value>,
    tick: Option<(PinInputId, NodeId)>,
    /// The first storage place of each cell.
    places: IdMap<grafsynth_ir::program::Cell, Place>,
    /// The first storage place of the temporaries.
    first_temp: Place,
    /// The current value at each place; `None` for a temporary that is not set yet.
    values: Vec<Option<Value>>,
    /// The flip-flops of each place of a cell, as values: its content after the clock edge.
    registers: Vec<Value>,
    /// Values of temporaries as functions of the new state, if this form exists.
    after: Vec<Option<Value>>,
    /// The last top-level statement that stores into the cell, counted from 1; 0 for none.
    last_store: IdMap<grafsynth_ir::program::Cell, usize>,
    /// The current top-level statement, counted from 1.
    now: usize,
    /// Frames of overwritten values, one for each open `If`.
    log: Vec<BTreeMap<Place, Option<Value>>>,
    /// The condition under which the current statement runs, as a function of the old state.
    path: NodeId,
    path_after: Option<NodeId>,
    calls: BTreeMap<net::OutputId, Vec<CallSite>>,
    outputs: BTreeMap<net::OutputId, (Value, Option<Value>)>,
    fault: Option<NodeId>,
    code_reported: bool,
}

/// The name of bit `bit` of an object that has `bits` bits.
fn bit_name(name: &str, bits: usize, bit: usize) -> String {
    if bits == 1 { name.to_owned() } else { format!("{name}_{bit}") }
}

/// True for an input that has a pin.
fn has_pin(kind: InputKind) -> bool {
    match kind {
        InputKind::Pin | InputKind::Extern | InputKind::Event => true,
        InputKind::InternalEvent => false,
    }
}

impl<'a> Encoder<'a> {
    fn new(
        net: &'a Net,
        program: &'a Program,
        facts: &'a Facts,
        options: &'a EncodeOptions,
    ) -> Self {
        let mut builder = Builder::default();
        builder.logic.name = net.name.clone();
        // Flip-flops come first, so that products list state before inputs.
        let mut registers = Vec::new();
        let places = IdMap::build(&program.cells, |_, cell| {
            let first = registers.len();
            for element in 0..cell.len.unwrap_or(1) {
                registers.push(register(net, &mut builder, cell, element));
            }
            first
        });
        let first_temp = registers.len();
        let values =
            registers.iter().cloned().map(Some).chain(program.temps.ids().map(|_| None)).collect();
        let inputs = IdMap::build(&net.inputs, |id, input| {
            if !has_pin(input.kind) {
                return Value::Bool(builder.constant(false));
            }
            let count = input.ty.bits() as usize;
            let mut bits = Vec::with_capacity(count);
            for bit in 0..count {
                let name = bit_name(&input.name.text, count, bit);
                let role = PinRole::Input(id, u32::try_from(bit).unwrap_or(u32::MAX));
                let pin =
                    builder.logic.inputs.push(PinInput { name, role, meta: input.meta.clone() });
                bits.push(builder.input(pin));
            }
            value_of(&mut builder, input.ty, bits)
        });
        let tick = uses_time(&program.body).then(|| {
            let pin =
                PinInput { name: "tick".to_owned(), role: PinRole::Tick, meta: Meta::default() };
            let pin = builder.logic.inputs.push(pin);
            (pin, builder.input(pin))
        });
        let mut last_store = IdMap::filled(&program.cells, 0);
        for (index, stmt) in program.body.iter().enumerate() {
            note_stores(std::slice::from_ref(stmt), index + 1, &mut last_store);
        }
        let path = builder.constant(true);
        Encoder {
            net,
            program,
            facts,
            options,
            max_nodes: options.max_nodes,
            stepwise: None,
            regions: None,
            builder,
            diagnostics: Vec::new(),
            overflow: None,
            inputs,
            tick,
            places,
            first_temp,
            values,
            registers,
            after: vec![None; program.temps.len()],
            last_store,
            now: 0,
            log: Vec::new(),
            path,
            path_after: Some(path),
            calls: BTreeMap::new(),
            outputs: BTreeMap::new(),
            fault: None,
            code_reported: false,
        }
    }

    /// Makes the D functions, outputs and constraints from the final values.
    fn finish(mut self) -> Result<Logic, Vec<Diagnostic>> {
        let program = self.program;
        let mut flops = self.builder.logic.flops.ids();
        let mut next: Vec<(grafsynth_ir::logic::FlopId, NodeId)> = Vec::new();
        for (id, cell) in program.cells.iter() {
            for element in 0..cell.len.unwrap_or(1) as usize {
                let value = self.values[self.places[id] + element].clone();
                let Some(value) = value else { unreachable!("a cell always has a value") };
                for bit in to_bits(&mut self.builder, value, cell.ty) {
                    if let Some(flop) = flops.next() {
                        next.push((flop, bit));
                    }
                }
            }
        }
        for (flop, bit) in next {
            self.builder.logic.flops[flop].next = bit;
        }
        self.output_pins()?;
        self.fault_pin();
        if let Some(registers) = self.stepwise {
            let value = self.register_bits(registers.busy);
            self.signal("busy", PinRole::Busy, value, None);
        }
        if self.options.assumptions {
            self.constraints();
            self.open_cells();
        }
        self.shared_times();
        Ok(self.builder.finish())
    }

    /// Adds the don't-cares of the net's unspecified cells. If the next situation is unspecified, all clocked functions are open. Of the pins, only mealy
    /// outputs have don't-cares, because the condition reads the situation before the clock edge and only they are functions of it. A circuit with several
    /// clocks ignores open cells: it behaves like the simulator.
    fn open_cells(&mut self) {
        if self.net.unspecified.is_empty() || self.stepwise.is_some() {
            return;
        }
        let mut next = Vec::new();
        let mut of_output: BTreeMap<net::OutputId, Vec<NodeId>> = BTreeMap::new();
        for cell in &self.net.unspecified {
            let Some(when) = self.before_the_clock(&cell.when) else { continue };
            match cell.what {
                OpenCell::Next => next.push(when),
                OpenCell::Output(output) => of_output.entry(output).or_default().push(when),
            }
        }
        let next = self.builder.or(next);
        let mut open = Vec::new();
        for flop in self.builder.logic.flops.ids() {
            open.push(Open { of: Function::Next(flop), when: next });
        }
        let pins: Vec<_> = self
            .builder
            .logic
            .outputs
            .iter()
            .map(|(pin, output)| (pin, output.role, output.mealy, output.registered.is_some()))
            .collect();
        for (pin, role, is_mealy, is_clocked) in pins {
            let own = if let PinRole::Output(output, _) = role {
                of_output.get(&output).cloned().unwrap_or_default()
            } else {
                Vec::new()
            };
            let when = match (is_mealy, is_clocked) {
                (true, _) => self.builder.or(own),
                (false, true) => self.builder.or(own.into_iter().chain([next])),
                (false, false) => continue,
            };
            open.push(Open { of: Function::Output(pin), when });
        }
        open.retain(|open| self.builder.as_constant(open.when) != Some(false));
        self.builder.logic.open = open;
    }

    /// A condition over inputs and steps, as a function of the inputs and of the flip-flops before the clock edge. `None` if a step has no flip-flop of
    /// its own.
    fn before_the_clock(&mut self, when: &net::Expr) -> Option<NodeId> {
        let step_of: BTreeMap<net::StepId, CellId> = (self.program.cells.iter())
            .filter_map(|(cell, data)| {
                if let Origin::Step(step) = data.origin { Some((step, cell)) } else { None }
            })
            .gather();
        // Validation guarantees that the condition reads nothing else.
        let leaf = |leaf: &net::Leaf| {
            if let net::Leaf::Input(input) = leaf {
                return Ok(Leaf::Input(*input));
            }
            let step = if let net::Leaf::Active(step) = leaf { step_of.get(step) } else { None };
            step.map(|cell| Leaf::Cell(*cell)).ok_or(())
        };
        let when = when
            .try_map(
                &mut |one: &net::Leaf, span| leaf(one).map(|one| Expr::leaf(one, span)),
                &mut |one, _| leaf(one),
            )
            .ok()?;
        let values = std::mem::take(&mut self.values);
        self.values = self
            .registers
            .iter()
            .cloned()
            .map(Some)
            .chain(self.program.temps.ids().map(|_| None))
            .collect();
        let node = self.eval_bool(&when, false);
        self.values = values;
        node
    }

    /// The flip-flop of a Boolean cell.
    fn register_bits(&self, cell: CellId) -> NodeId {
        match &self.registers[self.places[cell]] {
            Value::Bool(node) => *node,
            Value::Int(_) => unreachable!("a flag is Boolean"),
        }
    }

    fn signal(&mut self, name: &str, role: PinRole, value: NodeId, registered: Option<bool>) {
        self.builder.logic.outputs.push(PinOutput {
            name: name.to_owned(),
            role,
            value,
            registered,
            mealy: false,
            meta: Meta::default(),
        });
    }

    /// Adds a fault pin if a fault is possible. If the reaction takes several clocks, its register is already a cell.
    fn fault_pin(&mut self) {
        let reset = self.program.reset_fault;
        let is_never = |value: NodeId| self.builder.as_constant(value) == Some(false) && !reset;
        let (value, own) = match self.stepwise {
            Some(registers) => {
                let next = match &self.values[self.places[registers.fault]] {
                    Some(Value::Bool(next)) => *next,
                    Some(Value::Int(_)) | None => unreachable!("a flag is Boolean"),
                };
                if is_never(next) {
                    return;
                }
                (self.register_bits(registers.fault), None)
            }
            None => match self.fault {
                Some(value) if !is_never(value) => (value, Some(reset)),
                Some(_) | None => return,
            },
        };
        self.signal("fault", PinRole::Fault, value, own);
    }

    /// The bits of each output in both forms, and its value at reset.
    fn shown(&mut self) -> BTreeMap<net::OutputId, Shown> {
        let (net, program) = (self.net, self.program);
        let mut all = BTreeMap::new();
        for (id, (before, after)) in std::mem::take(&mut self.outputs) {
            let ty = net.outputs[id].ty;
            let reset = program.reset_outputs.get(id.index()).copied().unwrap_or(0);
            let reset = ty.saturate(reset).abs_diff(ty.bounds().0);
            let before = to_bits(&mut self.builder, before, ty);
            let after = after.map(|after| to_bits(&mut self.builder, after, ty));
            all.insert(id, Shown { before, after, reset });
        }
        for (id, output) in net.outputs.iter() {
            if !output.is_extern() {
                continue;
            }
            let sites = self.calls.remove(&id).unwrap_or_default();
            if !self.exclusive(&sites) {
                let message = format!(
                    "`{}` may be called twice in one reaction, but a chip has only one strobe pin for it",
                    output.name
                );
                self.diagnostics.push(
                    Diagnostic::error(codes::CALLED_TWICE, message)
                        .at(output.meta.span, "this action")
                        .help("call it from one place or from places that exclude each other in a reaction, or build for `c`"),
                );
                continue;
            }
            let is_called_at_reset = program
                .reset_effects
                .iter()
                .any(|effect| matches!(effect, ResetEffect::Call(called, _) if *called == id));
            if let Some(&strobe) = self.stepwise.and_then(|all| all.strobes.get(&id)) {
                let held = self.register_bits(strobe);
                let shown = Shown {
                    before: vec![held],
                    after: Some(vec![held]),
                    reset: u64::from(is_called_at_reset),
                };
                all.insert(id, shown);
                continue;
            }
            let after: Option<Vec<NodeId>> = sites.iter().map(|site| site.after).collect();
            let after = after.map(|after| vec![self.builder.or(after)]);
            let before = vec![self.builder.or(sites.iter().map(|site| site.before))];
            all.insert(id, Shown { before, after, reset: u64::from(is_called_at_reset) });
        }
        all
    }

    /// The value of every node at reset, with all inputs 0: its value in row 0 of a trace.
    fn reset_values(&self) -> IdMap<Node, bool> {
        let logic = &self.builder.logic;
        let mut sim = crate::sim::LogicSim::new(logic);
        for (pin, input) in logic.inputs.iter() {
            if let PinRole::Input(id, bit) = input.role {
                let ty = self.net.inputs[id].ty;
                sim.set_input(pin, ty.saturate(0).abs_diff(ty.bounds().0) >> bit & 1);
            }
        }
        IdMap::build(&logic.nodes, |node, _| sim.node(node) & 1 == 1)
    }

    fn output_pins(&mut self) -> Result<(), Vec<Diagnostic>> {
        let net = self.net;
        let all = self.shown();
        if any_error(&self.diagnostics) {
            return Err(std::mem::take(&mut self.diagnostics));
        }
        let at_reset = self.reset_values();
        for (id, shown) in all {
            let output = &net.outputs[id];
            let reset = |bit: usize| shown.reset >> bit & 1 == 1;
            // A form that is correct after each reaction may still be wrong after reset: for example a call at the end of a statement list that always
            // runs.
            let after = shown.after.filter(|bits| {
                bits.iter().enumerate().all(|(bit, &node)| at_reset[node] == reset(bit))
            });
            let is_mealy = matches!(output.driver, Driver::Mealy(_) | Driver::Fires(_));
            let (bits, is_registered, mealy) = match after {
                // With several clocks, every output already has a register.
                Some(after) if self.stepwise.is_some() => (after, false, false),
                _ if output.registered => (shown.before, true, false),
                _ if is_mealy => (shown.before, false, true),
                Some(after) => (after, false, false),
                None => (shown.before, true, false),
            };
            let count = bits.len();
            for (bit, value) in bits.into_iter().enumerate() {
                self.builder.logic.outputs.push(PinOutput {
                    name: bit_name(&output.name.text, count, bit),
                    role: PinRole::Output(id, u32::try_from(bit).unwrap_or(u32::MAX)),
                    value,
                    registered: is_registered.then(|| reset(bit)),
                    mealy,
                    meta: output.meta.clone(),
                });
            }
        }
        Ok(())
    }

    /// Adds the guarantees of the environment: input codes in range, `assume`, exclusive events.
    fn constraints(&mut self) {
        let net = self.net;
        let mut never = Vec::new();
        for (id, input) in net.inputs.iter() {
            if let Value::Int(word) = &self.inputs[id] {
                let (lo, hi) = input.ty.bounds();
                let full = Word { hi: i128::from(lo) + (1 << word.bits.len()) - 1, ..word.clone() };
                let limit = Word::constant(hi);
                never.push(word::compare(
                    &mut self.builder,
                    grafsynth_ir::expr::CompareOp::Gt,
                    &full,
                    &limit,
                ));
            }
        }
        if net.settings.events_exclusive {
            let mut seen = self.builder.constant(false);
            let mut twice = Vec::new();
            for (id, input) in net.inputs.iter() {
                if let (InputKind::Event, Value::Bool(event)) =
                    (input.kind, self.inputs[id].clone())
                {
                    twice.push(self.builder.and([seen, event]));
                    seen = self.builder.or([seen, event]);
                }
            }
            never.push(self.builder.or(twice));
        }
        for property in &net.properties {
            if property.role == PropertyRole::Assume
                && let Some(expr) = over_inputs(&property.never)
                && let Some(Value::Bool(node)) = self.eval(&expr, false)
            {
                never.push(node);
            }
        }
        never.retain(|&node| self.builder.as_constant(node) != Some(false));
        self.builder.logic.never = never;
    }
}

/// Makes the flip-flops of one element of a cell.
fn register(
    net: &Net,
    builder: &mut Builder,
    cell: &grafsynth_ir::program::Cell,
    element: u32,
) -> Value {
    let name = match cell.len {
        Some(_) => format!("{}_{element}", cell.name),
        None => cell.name.clone(),
    };
    let init = cell.init.get(element as usize).copied().unwrap_or(0);
    let code = cell.ty.saturate(init).abs_diff(cell.ty.bounds().0);
    let count = cell.ty.bits() as usize;
    let meta = meta_of(net, cell.origin);
    let mut bits = Vec::with_capacity(count);
    for bit in 0..count {
        let init = code >> bit & 1 == 1;
        let (flop, value) = builder.flop_named(&bit_name(&name, count, bit), init);
        let bit = u32::try_from(bit).unwrap_or(u32::MAX);
        let flop: &mut Flop = &mut builder.logic.flops[flop];
        flop.holds = Some(FlopBit { origin: cell.origin, element, bit, inverted: false });
        flop.meta = meta.clone();
        bits.push(value);
    }
    value_of(builder, cell.ty, bits)
}

fn value_of(builder: &mut Builder, ty: Type, bits: Vec<NodeId>) -> Value {
    match ty {
        Type::Bool => Value::Bool(bits.first().copied().unwrap_or_else(|| builder.constant(false))),
        Type::Int { lo, hi } => Value::Int(Word::register(bits, lo, hi)),
    }
}

/// The bits of a register of type `ty` that holds `value`, saturated.
fn to_bits(builder: &mut Builder, value: Value, ty: Type) -> Vec<NodeId> {
    match (value, ty) {
        (Value::Bool(node), Type::Bool) => vec![node],
        (Value::Bool(node), Type::Int { lo, hi }) => {
            Word::flag(node).saturated(builder, lo, hi).register_bits(builder, lo, hi)
        }
        (Value::Int(word), Type::Bool) => {
            let zero = Word::constant(0);
            vec![word::compare(builder, grafsynth_ir::expr::CompareOp::Ne, &word, &zero)]
        }
        (Value::Int(word), Type::Int { lo, hi }) => {
            word.saturated(builder, lo, hi).register_bits(builder, lo, hi)
        }
    }
}

/// Location, comment and tags of the object that a cell stores.
#[allow(clippy::wildcard_enum_match_arm, reason = "a location changes no function")]
fn meta_of(net: &Net, origin: Origin) -> Meta {
    match origin {
        Origin::Step(step)
        | Origin::Region(step)
        | Origin::Elapsed(step)
        | Origin::SharedElapsed(step)
        | Origin::LastElapsed(step)
        | Origin::TaskIndex(step)
        | Origin::Older(step, _)
        | Origin::Recorded(_, step) => net.steps[step].meta.clone(),
        Origin::Var(var) => net.vars[var].meta.clone(),
        Origin::Timer(timer) | Origin::TimerCondition(timer) => net.timers[timer].meta.clone(),
        Origin::ActionQ(action)
        | Origin::ActionLatch(action, _)
        | Origin::ActionTimer(action, _) => net.actions[action].meta.clone(),
        Origin::Pending(event) => net.inputs[event].meta.clone(),
        Origin::SendTimer(send) | Origin::SendRuns(send) => net.sends[send].meta.clone(),
        Origin::HeldOutput(output, _) => net.outputs[output].meta.clone(),
        _ => Meta::default(),
    }
}

/// An assumption as an expression of the program, if it reads only inputs.
fn over_inputs(expr: &net::PropertyExpr) -> Option<Expr<Leaf>> {
    let input = |leaf: &PropertyLeaf| match leaf {
        PropertyLeaf::Net(net::Leaf::Input(input)) => Ok(Leaf::Input(*input)),
        PropertyLeaf::Net(_) | PropertyLeaf::Output(_) => Err(()),
    };
    expr.try_map(
        &mut |leaf, span| input(leaf).map(|leaf| Expr::leaf(leaf, span)),
        &mut |leaf, _| input(leaf),
    )
    .ok()
}

/// True when some expression reads `dt`.
fn uses_time(block: &[Stmt]) -> bool {
    expressions(block).any(|expr| expr.leaves().any(|leaf| *leaf == Leaf::Dt))
}

/// Marks the cells that `block` stores.
fn note_stores(block: &[Stmt], at: usize, last: &mut IdMap<grafsynth_ir::program::Cell, usize>) {
    for stmt in statements(block) {
        if let Stmt::Store(cell, ..) = stmt {
            last[*cell] = at;
        }
    }
}

/// True if the operator at the top of the expression is Boolean, so that the Boolean algebra may simplify it.
fn is_compound(expr: &Expr<Leaf>) -> bool {
    matches!(
        expr.kind,
        ExprKind::And(_) | ExprKind::Or(_) | ExprKind::Not(_) | ExprKind::Select(..)
    )
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod pages;
