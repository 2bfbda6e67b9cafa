//! From a net to its outputs: the second half of the pipeline. Each target is one call; a circuit goes through the stages of the module `stages`.
//!
//! ```text
//! facts      verify::facts                what is proved about the net
//! program    ir::lower::program           one reaction as a bounded program
//! logic      logic::encode                one flip-flop per step
//! circuits   crate::stages                encode, emit, read back, prove, describe
//! C          crate::stages::c             emit; then check, with an engine that can run C
//! ```

pub use crate::built::{BuildOptions, Built, MapEntry, OutputFile, Refusal};
use crate::circuit::{ENUMERATION_WORK, may_be_free, unconditional, without_assumptions};
pub use crate::circuit::{
    Through, emit_options, facts, logic, logic_as, logic_with_own_timers, refuted, synchronised,
    through, vectors,
};
pub use crate::circuit_notes::form;
use crate::circuit_notes::one_clock_all_the_same;
use crate::context::{BuildContext, Medium};
use crate::output_report::{Note, OutputFault, OutputProof, OutputReport};
pub use crate::stages::c::{CEngine, check as check_c, images};
use crate::stages::{self, Described};
use crate::target::Target;
use grafsynth_backend_pld::codes::DOES_NOT_FIT;
use grafsynth_backend_pld::{Dialect, Emitted};
pub use grafsynth_backend_pld::{Reset, ResetStyle};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, Sharing};
use grafsynth_ir::{Diagnostic, FileId, Valid};
pub use grafsynth_logic::BusyMode;
use grafsynth_sim::{InputRow, breaks_assumption};
use grafsynth_verify::Limits;

/// Errors about variables that the designer declares as not shared with a halted step, although they are (semantics §6). They depend on the
/// situations, not only on the structure.
fn refused_sharing(net: &Valid<Net>) -> Vec<Diagnostic> {
    if !net.sharing.values().any(|said| *said == Sharing::Refuse) {
        return Vec::new();
    }
    let size = (net.steps.len() + net.transitions.len()).max(1) as u64;
    let pairs = (ENUMERATION_WORK / size).clamp(1_000, 100_000);
    let facts = grafsynth_verify::facts(net, &Limits { pairs, ..Limits::default() });
    grafsynth_verify::sharing::refused(net, &facts)
}

/// Builds all targets of one net. Outputs that were refuted are left out of [`Built::files`].
#[must_use]
pub fn build(net: &Valid<Net>, facts: &Facts, targets: &[Target], options: &BuildOptions) -> Built {
    let mut built = Built { found: refused_sharing(net), ..Built::default() };
    if !built.found.is_empty() {
        return built;
    }
    // Synchronisers start at 0. So the circuit reacts to a row with all inputs 0 first, which the plant need not give.
    let zero = InputRow { dt: 0, ..InputRow::zero(net) };
    if options.synchronise > 0
        && breaks_assumption(net, &zero)
        && let Some(free) = without_assumptions(net)
    {
        return build(&free, &self::facts(&free, &options.limits), targets, options);
    }
    // This is decided here, so that no later step, not even the advice on what would fit, uses don't-cares that are not allowed for this design.
    let without = (options.dont_cares && !may_be_free(net))
        .then(|| BuildOptions { dont_cares: false, ..options.clone() });
    let options = without.as_ref().unwrap_or(options);
    let needs_logic = targets.iter().any(|target| target.is_circuit());
    let free = if needs_logic { unconditional(net, &options.limits) } else { None };
    let of_circuit = free.as_ref().unwrap_or(facts);
    let logic = needs_logic.then(|| logic_as(net, of_circuit, options.busy)).transpose();
    let own_timers = matches!(logic, Ok(Some(_)))
        .then(|| logic_with_own_timers(net, of_circuit, options.busy))
        .flatten();
    let own_timers = own_timers.as_ref();
    match &logic {
        Ok(Some(logic)) => built.found.extend(one_clock_all_the_same(net, logic, options.busy)),
        Ok(None) => {}
        Err(found) => built.found.extend(found.iter().cloned()),
    }
    let circuit = |medium: Medium| match &logic {
        Ok(Some(logic)) => {
            Ok(BuildContext { net, facts: of_circuit, logic, own_timers, options, medium })
        }
        Ok(None) => unreachable!("a circuit is encoded if a target needs one"),
        Err(found) => Err(found.clone()),
    };
    // Two targets need Verilog; it is written once.
    let mut verilog: Option<Result<Option<Emitted>, Vec<Diagnostic>>> = None;
    for target in targets {
        let medium = match (*target, target.dialect()) {
            (Target::Jedec, None) => Some(Medium::Fuses),
            (_, dialect) => dialect.map(Medium::Text),
        };
        let found = match (*target, medium) {
            (_, Some(Medium::Text(Dialect::Verilog))) => {
                let emitted = verilog.get_or_insert_with(|| {
                    let context = circuit(Medium::Text(Dialect::Verilog))?;
                    Ok(add(stages::circuit(&context)?, &mut built))
                });
                match (target, emitted) {
                    (Target::Ice40, Ok(Some(emitted))) => ice40(net, emitted, options, &mut built),
                    (_, Ok(_)) => Vec::new(),
                    (_, Err(found)) => found.clone(),
                }
            }
            (_, Some(medium)) => match circuit(medium).and_then(|it| stages::circuit(&it)) {
                Ok(made) => {
                    add(made, &mut built);
                    Vec::new()
                }
                Err(found) => found,
            },
            // C may use the facts that depend on assumptions, because every step has its own representation in C.
            (Target::C(style), None) => stages::c::emit(net, facts, style, options, &mut built),
            (Target::Json | Target::Template, None) => {
                crate::template::build(net, *target, options, &mut built)
            }
            (_, None) => net_text(net, options, &mut built),
        };
        built.refused.extend(Refusal::of(target.name(), &found));
        built.found.extend(found);
    }
    say_once(&mut built);
    built
}

/// Adds an output to a build; returns its text.
fn add(made: Described, built: &mut Built) -> Option<Emitted> {
    built.lines.push(made.report);
    built.chips.extend(made.chip);
    built.files.extend(made.files);
    made.emitted
}

/// Removes repetitions: if several targets give the same findings, or advice on what would fit, it is reported once.
fn say_once(built: &mut Built) {
    let mut once: Vec<Diagnostic> = Vec::new();
    for one in std::mem::take(&mut built.found) {
        let is_same = |other: &Diagnostic| {
            (other.code, &other.message, &other.labels) == (one.code, &one.message, &one.labels)
        };
        if !once.iter().any(is_same) {
            once.push(one);
        }
    }
    built.found = once;
    let mut is_advised = built.found.iter().any(|one| one.code == DOES_NOT_FIT);
    for note in built.lines.iter_mut().flat_map(|line| &mut line.notes) {
        if let Note::PinsOpen(advice) = note
            && std::mem::replace(&mut is_advised, true)
        {
            advice.clear();
        }
    }
}

/// Assigns the pins of an iCE40, and adds the job for its tools to the build; returns the findings.
fn ice40(
    net: &Net,
    emitted: &Emitted,
    options: &BuildOptions,
    built: &mut Built,
) -> Vec<Diagnostic> {
    let stem = options.stem_for(net);
    let board = net.board.device.as_ref().map(|name| name.text.as_str());
    // The pin assignment may be for another chip that the chart is also built for.
    let of_board = board.filter(|name| name.to_ascii_lowercase().starts_with("ice40"));
    let device = options.device.as_deref().or(of_board);
    let is_for_it = board.is_none() || of_board.is_some();
    let pins = if is_for_it { net.board.pins.as_slice() } else { &[] };
    match crate::ice40::job(&stem, emitted, device, pins) {
        Ok(job) => {
            if let Some(chip) = built.chips.iter_mut().find(|chip| chip.file == format!("{stem}.v"))
            {
                chip.place_on(job.package, &job.constraints);
            }
            let constraints = job.constraints.clone();
            built.files.push(OutputFile::new(format!("{stem}.pcf"), constraints));
            built.bitstreams.push(job);
            Vec::new()
        }
        Err(found) => found,
    }
}

/// Adds the text of the net, which is read back.
fn net_text(net: &Net, options: &BuildOptions, built: &mut Built) -> Vec<Diagnostic> {
    let text = grafsynth_ir::text::print(net);
    let name = format!("{}.net", options.stem_for(net));
    let (again, found) = grafsynth_ir::text::parse(FileId(u32::MAX), &text);
    built.lines.push(match again {
        Some(again) if !any_error(&found) && grafsynth_ir::text::same(net, &again) => {
            OutputReport::proved(&name, OutputProof::SameNet)
        }
        Some(_) | None => OutputReport::refuted(&name, OutputFault::ReadsBackAsAnother),
    });
    built.files.push(OutputFile::new(name, text));
    Vec::new()
}
