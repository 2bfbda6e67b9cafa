//! From a net to its circuit, and from the circuit to a text and back: the common part of equations, netlists and fuse maps.

use crate::codes;
use grafsynth_backend_pld::vectors::TraceRow;
use grafsynth_backend_pld::{Dialect, EmitOptions, Emitted, Vectors, synchronise};
use grafsynth_ir::Gather;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::lower::program::{Additions, ProgramOptions, program_with, shared_timers};
use grafsynth_ir::net::{Evolution, Net, Property, PropertyRole};
use grafsynth_ir::program::SharedTimer;
use grafsynth_ir::{Diagnostic, FileId, Valid, validate};
use grafsynth_logic::{BusyMode, EncodeOptions};
use grafsynth_sim::{Clocked, InputRow, Row, Simulator, Stimulus};
use grafsynth_verify::{Explored, Limits};

/// The maximum work of an enumeration before a build, as reactions times the size of the net; it takes a few hundredths of a second.
pub(crate) const ENUMERATION_WORK: u64 = 20_000_000;

/// The facts that back ends need about a net. These are its structure and, for a chart that evolves until it is stable, a bound on its micro-steps, which only
/// a search of its states can find. The search is limited, so the time does not grow with the number of states.
#[must_use]
pub fn facts(net: &Valid<Net>, limits: &Limits) -> Facts {
    match net.settings.evolution {
        Evolution::Single => grafsynth_verify::structural_facts(net),
        Evolution::Stable { .. } => grafsynth_verify::facts(net, &quick(net, limits)),
    }
}

/// The number of asserts that a short search refutes.
#[must_use]
pub fn refuted(net: &Valid<Net>, limits: &Limits) -> usize {
    if net.properties.iter().all(|one| one.role != PropertyRole::Assert) {
        return 0;
    }
    Explored::of(net, &quick(net, limits)).refuted()
}

/// The limits of a search that a build can wait for.
fn quick(net: &Net, limits: &Limits) -> Limits {
    // The time of a reaction is proportional to the size of what it reads.
    let size = (net.steps.len() + net.transitions.len()).max(1) as u64;
    Limits {
        pairs: limits.pairs.min((ENUMERATION_WORK / size).clamp(1_000, 100_000)),
        // A diagram that unrolls micro-steps is either small or far too large, and a build must not wait for it.
        image_bits: limits.image_bits.min(512),
        image_work: limits.image_work.min(1_000_000),
        ..limits.clone()
    }
}

/// The circuit of a net. Steps that are proved to exclude each other share a timer. The circuit takes one clock per reaction if the depth of its evolution is
/// proved and the composition is not too large, otherwise one clock per
/// micro-step, with `busy` (semantics.md §9).
///
/// # Errors
/// Everything that a chip cannot do, each with its location.
pub fn logic(net: &Valid<Net>, facts: &Facts) -> Result<Logic, Vec<Diagnostic>> {
    logic_as(net, facts, BusyMode::default())
}

/// Like [`logic`], with a choice whether a reaction may take several clocks.
///
/// # Errors
/// Everything that a chip cannot do, each with its location.
pub fn logic_as(net: &Valid<Net>, facts: &Facts, busy: BusyMode) -> Result<Logic, Vec<Diagnostic>> {
    encoded(net, facts, busy, &whole(shared_timers(net, facts)))
}

/// Like [`logic_as`], with a timer for each step whose time is read; `None` if no steps share a timer, because the circuit would be the same.
#[must_use]
pub fn logic_with_own_timers(net: &Valid<Net>, facts: &Facts, busy: BusyMode) -> Option<Logic> {
    let may_share = !shared_timers(net, facts).is_empty();
    may_share.then(|| encoded(net, facts, busy, &[]).ok()).flatten()
}

fn encoded(
    net: &Valid<Net>,
    facts: &Facts,
    busy: BusyMode,
    shared: &[SharedTimer],
) -> Result<Logic, Vec<Diagnostic>> {
    let additions = Additions { shared, ..Additions::default() };
    let program = program_with(net, &ProgramOptions::default(), additions)?;
    let options = EncodeOptions { busy, ..EncodeOptions::default() };
    grafsynth_logic::encode(net, &program, facts, &options)
}

/// Extends the range of each timer to all values of its flip-flops: every code is then valid, and the last one is easy to recognise.
fn whole(mut timers: Vec<SharedTimer>) -> Vec<SharedTimer> {
    for timer in &mut timers {
        let n_bits = Type::Int { lo: 0, hi: timer.cap }.bits();
        timer.cap = (1_i64 << n_bits.min(32)) - 1;
    }
    timers
}

/// A text, and the circuit that an independent parser reads from it.
#[derive(Debug, Clone)]
pub struct Through {
    /// The text with its names.
    pub emitted: Emitted,
    /// The circuit read back from the text, with the roles of the emitted circuit.
    pub read_back: Logic,
}

/// Writes a circuit in a language and reads it back.
///
/// # Errors
/// The language cannot express the circuit, or the parser cannot read the emitted text.
pub fn through(
    logic: &Logic,
    dialect: Dialect,
    options: &EmitOptions,
) -> Result<Through, Vec<Diagnostic>> {
    let emitted = grafsynth_backend_pld::emit(logic, dialect, options)?;
    let read_back = read_back(&emitted)?;
    Ok(Through { emitted, read_back })
}

/// The circuit that an independent parser reads from a text, with the roles of the emitted circuit.
pub(crate) fn read_back(emitted: &Emitted) -> Result<Logic, Vec<Diagnostic>> {
    // The text is not a file of the user, so its findings must not refer to one: this number has no source.
    let file = FileId(u32::MAX);
    let (read_back, found) = grafsynth_backend_pld::read(emitted.dialect, file, &emitted.text);
    let Some(mut read_back) = read_back.filter(|_| !any_error(&found)) else { return Err(found) };
    let found = grafsynth_backend_pld::rebind(&mut read_back, emitted);
    if any_error(&found) { Err(found) } else { Ok(read_back) }
}

/// The options for the back end that come from a net, not from its circuit.
#[must_use]
pub fn emit_options(net: &Net, device: Option<&str>, vectors: Option<Vectors>) -> EmitOptions {
    let transitions = net.transitions.values().take(200).map(|transition| {
        let names =
            |steps: Vec<&str>| if steps.is_empty() { "()".to_owned() } else { steps.join(" & ") };
        let sources =
            transition.requires.iter().map(|step| net.steps[*step].name.text.as_str()).collect();
        let targets = transition
            .enters
            .iter()
            .filter_map(|enter| match enter {
                grafsynth_ir::net::Enter::Step(step) => Some(net.steps[*step].name.text.as_str()),
                grafsynth_ir::net::Enter::InitialContent(_)
                | grafsynth_ir::net::Enter::History(_) => None,
            })
            .collect();
        format!("{}: {} -> {}", transition.name.text, names(sources), names(targets))
    });
    EmitOptions {
        device: device
            .map(str::to_owned)
            .or_else(|| net.board.device.as_ref().map(|name| name.text.clone())),
        device_span: match device {
            Some(_) => None,
            None => net.board.device.as_ref().map(|name| name.span),
        },
        pins: net.board.pins.iter().map(|(name, pin)| (name.text.clone(), *pin)).collect(),
        pin_spans: (net.board.pins.iter()).map(|(name, _)| (name.text.clone(), name.span)).gather(),
        vectors,
        notes: transitions.collect(),
        ..EmitOptions::default()
    }
}

/// The circuit with `stages` flip-flops before each input that is not declared `synchronous`, before the tick, and before the wire that resets it. Their power-up
/// value is the code of their input at reset; those of the wire reset the circuit until they have passed it on.
#[must_use]
pub fn synchronised(net: &Net, logic: Logic, stages: u32) -> (Logic, Vec<synchronise::Chain>) {
    synchronise::add(logic, stages, |pin| match pin.role {
        PinRole::Input(id, bit) if !net.inputs[id].synchronous => {
            let ty = net.inputs[id].ty;
            let code = ty.saturate(0).abs_diff(ty.bounds().0);
            Some(code.checked_shr(bit).unwrap_or(0) & 1 == 1)
        }
        PinRole::Tick => Some(false),
        PinRole::Reset => Some(true),
        _ => None,
    })
}

/// The vectors of a circuit with synchronisers: the inputs of each row are applied as many clocks earlier as there are stages.
pub(crate) fn delayed_vectors(
    net: &Valid<Net>,
    logic: &Logic,
    circuit: &Logic,
    chains: &[synchronise::Chain],
    stimulus: &Stimulus,
) -> Result<Vectors, Vec<Diagnostic>> {
    let Some(chain) = chains.first() else { return vectors(net, logic, stimulus) };
    if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        let message = "a circuit with `busy` reads its inputs when it is ready, but synchronisers shift them with every clock: no test bench can predict its outputs";
        return Err(vec![
            Diagnostic::error(codes::NO_BENCH, message)
                .help("omit `--stimulus` or `--synchronise`, or use `--busy never`"),
        ]);
    }
    let idle = InputRow { dt: 0, ..InputRow::zero(net) };
    let clocked = Clocked::of(net, stimulus).map_err(|finding| vec![*finding])?;
    let rows = std::iter::repeat_n(idle, chain.flops.len()).chain(clocked.stimulus.rows());
    let mut vectors = vectors_of(net, logic, rows)?;
    synchronise::delayed(circuit, chains, &mut vectors);
    Ok(vectors)
}

/// Whether functions may use unreachable states as don't-cares. In a design with an emergency they must not, because the proof about its pins would
/// then apply to reachable states only.
pub(crate) fn may_be_free(net: &Net) -> bool {
    net.emergency.is_none()
}

/// The facts proved about a net without its assumptions, if a circuit must not rely on them. In a design with an emergency, the pins must be right even after
/// an assumption was violated in any chart. `None` if the facts can be used unchanged.
pub(crate) fn unconditional(net: &Valid<Net>, limits: &Limits) -> Option<Facts> {
    if may_be_free(net) {
        return None;
    }
    without_assumptions(net).map(|free| facts(&free, limits))
}

/// The net without its assumptions; `None` if it has none.
pub(crate) fn without_assumptions(net: &Valid<Net>) -> Option<Valid<Net>> {
    let is_assumed = |property: &Property| property.role == PropertyRole::Assume;
    if !net.properties.iter().any(is_assumed) {
        return None;
    }
    let mut free = net.clone().into_inner();
    free.properties.retain(|property| !is_assumed(property));
    // Removing a property keeps a net valid.
    validate(free).ok()
}

/// The reference trace of a stimulus as bits of the circuit's pins, one vector for each clock.
///
/// # Errors
/// The stimulus takes more clocks than the limit for a chip.
pub fn vectors(
    net: &Valid<Net>,
    logic: &Logic,
    stimulus: &Stimulus,
) -> Result<Vectors, Vec<Diagnostic>> {
    let clocked = Clocked::of(net, stimulus).map_err(|finding| vec![*finding])?;
    vectors_of(net, logic, clocked.stimulus.rows())
}

fn vectors_of(
    net: &Valid<Net>,
    logic: &Logic,
    inputs: impl Iterator<Item = InputRow>,
) -> Result<Vectors, Vec<Diagnostic>> {
    let mut simulator = Simulator::new(net);
    let first = vector_row(net, &simulator.reset(), &InputRow { dt: 0, ..InputRow::zero(net) });
    let mut rows = vec![first];
    for input in inputs {
        let row = simulator.step(&input);
        if row.open.next {
            // Rows after an undefined situation do not constrain a correct circuit.
            break;
        }
        rows.push(vector_row(net, row, &input));
    }
    Vectors::of(net, logic, &rows)
}

fn vector_row(net: &Net, row: &Row, input: &InputRow) -> TraceRow {
    let outputs = net
        .outputs
        .iter()
        .map(|(id, output)| {
            if row.open.any() {
                return None;
            }
            Some(match &output.driver {
                grafsynth_ir::net::Driver::Extern { .. } => {
                    let is_call = |effect: &&grafsynth_sim::Effect| matches!(effect, grafsynth_sim::Effect::Call(called, _) if *called == id);
                    i64::try_from(row.effects.iter().filter(is_call).count()).unwrap_or(i64::MAX)
                }
                grafsynth_ir::net::Driver::Continuous(_)
                | grafsynth_ir::net::Driver::Mealy(_)
                | grafsynth_ir::net::Driver::Fires(_)
                | grafsynth_ir::net::Driver::Controlled(_)
                | grafsynth_ir::net::Driver::Stored(_) => row.outputs[id.index()],
            })
        })
        .collect();
    let mut steps = vec![false; net.steps.len()];
    for step in &row.steps {
        steps[step.index()] = true;
    }
    TraceRow {
        dt: u64::from(input.dt),
        inputs: input.values.clone(),
        outputs,
        steps,
        fault: row.fault,
    }
}
