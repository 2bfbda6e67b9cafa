//! From a net to its outputs: the second half of the pipeline, as one explicit list.
//!
//! ```text
//! facts      verify::facts                what is proved about the net
//! program    ir::lower::program           one reaction as a bounded program
//! logic      logic::encode                one flip-flop per step
//! synchronise  backend_pld::synchronise   flip-flops in front of inputs, if asked for
//! emit       backend_pld::emit            names, products, pins, then text; for a fuse map see crate::jedec
//! read       backend_pld::read, rebind    the text without knowledge of its origin
//! strip      reset, synchronise           removes parts that the chart does not have, after a check that they have no other effect
//! prove      verify::equiv                equal to the net, for every reachable state
//! ```
//! C is generated from the net and its facts; to compare it needs a compiler, so that is left to the caller ([`Built::packages`]).

pub use crate::built::{BuildOptions, Built, MapEntry, OutputFile, Refusal};
use crate::circuit::{ENUMERATION_WORK, delayed_vectors, may_be_free, unconditional};
pub use crate::circuit::{
    Through, emit_options, facts, logic, logic_as, synchronised, through, vectors,
};
pub use crate::circuit_notes::form;
use crate::circuit_notes::{
    code_of, codes_and_dont_cares, one_clock_all_the_same, say_emergency, say_safe,
};
use crate::coding;
use crate::fit_advice;
use crate::output_report::{Note, Outcome, OutputFault, OutputProof, OutputReport};
use crate::report::chip::{Chip, Made};
use crate::target::Target;
use grafsynth_backend_c::File;
use grafsynth_backend_pld::codes::DOES_NOT_FIT;
use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::{Dialect, EmitOptions, Emitted, Object, synchronise};
pub use grafsynth_backend_pld::{Reset, ResetStyle};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::{Net, Sharing, without_c_texts};
use grafsynth_ir::{Diagnostic, FileId, Valid};
pub use grafsynth_logic::BusyMode;
use grafsynth_verify::equiv::only_tested;
use grafsynth_verify::{Limits, OpenReason};

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
    // This is decided here, so that no later step uses don't-cares that this design may not have, not even the advice on what would fit.
    let without = (options.dont_cares && !may_be_free(net))
        .then(|| BuildOptions { dont_cares: false, ..options.clone() });
    let options = without.as_ref().unwrap_or(options);
    let needs_logic =
        targets.iter().any(|target| target.dialect().is_some() || *target == Target::Jedec);
    let free = if needs_logic { unconditional(net, &options.limits) } else { None };
    // C may use the facts that depend on assumptions, because every step has its own representation in C.
    let conditional = facts;
    let facts = free.as_ref().unwrap_or(facts);
    let logic = needs_logic.then(|| logic_as(net, facts, options.busy));
    if let Some(Err(found)) = &logic {
        built.found.extend(found.iter().cloned());
    }
    if let Some(Ok(logic)) = &logic {
        built.found.extend(one_clock_all_the_same(net, logic, options.busy));
    }
    // Two targets need Verilog; it is written once.
    let mut verilog: Option<Option<Emitted>> = None;
    let mut refuses_verilog = 0..0;
    for target in targets {
        let n_found = built.found.len();
        match (target, target.dialect(), &logic) {
            (_, Some(Dialect::Verilog), Some(Ok(logic))) => {
                let emitted = verilog.get_or_insert_with(|| {
                    equations(net, facts, logic, Dialect::Verilog, options, &mut built)
                });
                if let (Target::Ice40, Some(emitted)) = (target, emitted) {
                    ice40(net, emitted, options, &mut built);
                }
            }
            (_, Some(dialect), Some(Ok(logic))) => {
                equations(net, facts, logic, dialect, options, &mut built);
            }
            (Target::Jedec, None, Some(Ok(logic))) => {
                crate::jedec::build(net, facts, logic, options, &mut built);
            }
            // The missing circuit was already reported.
            (_, Some(_), _) | (Target::Jedec, None, _) => {}
            (Target::C(style), None, _) => {
                let c = options.c_for(net, *style);
                match grafsynth_backend_c::emit(net, conditional, &c) {
                    Ok(package) => {
                        built.found.extend(package.diagnostics.iter().cloned());
                        if options.packages.is_empty() {
                            built.files.extend(c_files(net, &package.files));
                        }
                        for ecosystem in &options.packages {
                            match grafsynth_backend_c::package::files(net, &package, *ecosystem) {
                                Ok(files) => built.files.extend(c_files(net, &files)),
                                Err(found) => built.found.extend(found),
                            }
                        }
                        match (options.trusts_code, without_c_texts(net)) {
                            (true, _) | (false, None) => built.packages.push(package),
                            (false, Some(bare)) => {
                                match grafsynth_backend_c::emit(&bare, facts, &c) {
                                    Ok(package) => built.packages.push(package),
                                    Err(found) => built.found.extend(found),
                                }
                            }
                        }
                    }
                    Err(found) => built.found.extend(found),
                }
            }
            (Target::Net, None, _) => {
                let text = grafsynth_ir::text::print(net);
                let name = format!("{}.net", options.stem_for(net));
                built.lines.push(read_back_net(net, &name, &text));
                built.files.push(OutputFile { name, text, keep_existing: false, map: Vec::new() });
            }
            (Target::Json | Target::Template, None, _) => {
                crate::template::build(net, *target, options, &mut built);
            }
            (Target::Logic(_) | Target::Ice40, None, _) => {
                unreachable!("a target of logic has a dialect")
            }
        }
        let mut own = n_found..built.found.len();
        if target.dialect() == Some(Dialect::Verilog) && verilog == Some(None) {
            if refuses_verilog.is_empty() {
                refuses_verilog = own.clone();
            }
            own = refuses_verilog.clone();
        }
        let own = match &logic {
            Some(Err(found)) if target.is_circuit() => found.as_slice(),
            Some(_) | None => built.found.get(own).unwrap_or_default(),
        };
        built.refused.extend(Refusal::of(target.name(), own));
    }
    say_once(&mut built);
    built
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

/// Assigns the pins of an iCE40, and adds the job for its tools to the build.
fn ice40(net: &Net, emitted: &Emitted, options: &BuildOptions, built: &mut Built) {
    let stem = options.stem_for(net);
    let board = net.board.device.as_ref().map(|name| name.text.as_str());
    // The pin assignment may be for another chip that the chart is also built for.
    let of_board = board.filter(|name| name.to_ascii_lowercase().starts_with("ice40"));
    let device = options.device.as_deref().or(of_board);
    let pins: Vec<(String, u32)> = if board.is_none() || of_board.is_some() {
        net.board.pins.iter().map(|(name, pin)| (name.text.clone(), *pin)).collect()
    } else {
        Vec::new()
    };
    match crate::ice40::job(&stem, emitted, device, &pins) {
        Ok(job) => {
            if let Some(chip) = built.chips.iter_mut().find(|chip| chip.file == format!("{stem}.v"))
            {
                chip.place_on(job.package, &job.constraints);
            }
            built.files.push(OutputFile {
                name: format!("{stem}.pcf"),
                text: job.constraints.clone(),
                keep_existing: false,
                map: Vec::new(),
            });
            built.bitstreams.push(job);
        }
        Err(found) => built.found.extend(found),
    }
}

/// Writes one text, reads it back and proves it equal to the net; returns the text unless it was rejected or refuted.
fn equations(
    net: &Valid<Net>,
    facts: &Facts,
    logic: &Logic,
    dialect: Dialect,
    options: &BuildOptions,
    built: &mut Built,
) -> Option<Emitted> {
    let is_flat = match dialect {
        Dialect::Palasm | Dialect::Cupl | Dialect::Galasm => true,
        Dialect::Verilog | Dialect::Blif => false,
    };
    let wishes = EmitOptions {
        dont_cares: options.dont_cares && is_flat,
        keep: options.keep_pins.clone(),
        ..emit_options(net, options.device.as_deref(), None)
    };
    let coded = coding::code(net, facts, logic, options.encoding, options.safe, dialect, &wishes);
    let code = code_of(net, facts, logic, &coded, options, dialect, &wishes);
    let asked = fit_advice::BuildContext { net, facts, logic, options, dialect, is_burned: false };
    let logic = &coding::emitted(&coded, options.safe);
    let (circuit, chains) = synchronised(net, logic.clone(), options.synchronise);
    let vectors = options
        .stimulus
        .as_ref()
        .map(|stimulus| delayed_vectors(net, logic, &circuit, &chains, stimulus));
    let vectors = match vectors.transpose() {
        Ok(vectors) => vectors,
        Err(found) => {
            built.found.extend(found);
            return None;
        }
    };
    let emit_options = EmitOptions { reset: options.reset.clone(), vectors, ..wishes };
    let through = through(&circuit, dialect, &emit_options).and_then(|through| {
        let read_back = grafsynth_backend_pld::reset::strip(through.read_back)?;
        let mut read_back = synchronise::strip(read_back, &chains)?;
        grafsynth_logic::state_assignment::observe(&coded.logic, &mut read_back);
        Ok(Through { read_back, ..through })
    });
    let through = match through {
        Ok(through) => through,
        Err(mut found) => {
            fit_advice::advise(&asked, &mut found);
            built.found.extend(found);
            return None;
        }
    };
    let stem = options.stem_for(net);
    // CUPL and GALasm share the usual extension; side by side they need two names.
    let name = match dialect {
        Dialect::Cupl => format!("{stem}.cupl.pld"),
        Dialect::Galasm => format!("{stem}.galasm.pld"),
        Dialect::Palasm | Dialect::Verilog | Dialect::Blif => {
            format!("{stem}.{}", dialect.extension())
        }
    };
    let mut line = if options.prove {
        let verdict = grafsynth_verify::equiv(net, facts, &through.read_back, &options.limits);
        OutputReport::of_verdict(&name, net, &through.read_back, verdict)
    } else {
        let reasons = vec![OpenReason::NotAsked];
        let verdict = only_tested(net, &through.read_back, reasons, &options.limits);
        OutputReport::of_verdict(&name, net, &through.read_back, verdict)
    };
    say_emergency(&mut line, net, &through.read_back, options);
    if let Some(said) = codes_and_dont_cares(&coded, logic, &emit_options) {
        line.notes.push(Note::Codes(said));
    }
    if options.safe {
        say_safe(&mut line, logic, &through.read_back);
    }
    let has_open_pins = |named: &grafsynth_backend_pld::Named| {
        named.pin.is_none() && matches!(named.object, Object::Input(_) | Object::Output(_))
    };
    if is_flat && options.device.is_some() && through.emitted.names.iter().any(has_open_pins) {
        let advice = fit_advice::advice_for(&asked);
        let lacks = through.emitted.lacks.join("; ");
        line.notes.push(Note::PinsOpen(if lacks.is_empty() || advice.is_empty() {
            format!("{lacks}{advice}")
        } else {
            format!("{lacks}; {advice}")
        }));
    }
    line.notes.extend(through.emitted.moved.iter().cloned().map(Note::PinMoved));
    let outcome = line.outcome();
    let is_refuted = outcome == Outcome::Refuted;
    let form = form(net, facts, logic, options.busy);
    if let Some(form) = &form {
        line.notes.push(Note::Form(form.clone()));
    }
    for (history, why) in grafsynth_logic::kept_apart(net) {
        let name = net.histories[history].name.to_string();
        line.notes.push(Note::History { name, why: why.to_string() });
    }
    if let Some(chain) = chains.first() {
        let (pins, stages) = (chains.len(), chain.flops.len());
        line.notes.push(Note::Synchronised { pins, stages });
    }
    built.lines.push(line);
    if is_refuted {
        return None;
    }
    if let Some(code) = code {
        let made = Made {
            file: &name,
            outcome,
            circuit: &circuit,
            chains: &chains,
            code: Some(code),
            evolution: form,
            dont_cares: emit_options.dont_cares,
            budget: emit_options.budget,
        };
        let n_vectors = emit_options.vectors.as_ref().map_or(0, |vectors| vectors.rows.len());
        // The report needs the equations that the text was made from, so they are computed again.
        let again = is_flat.then(|| Equations::new(&circuit, dialect, &emit_options));
        built.chips.push(match again {
            Some(Ok(again)) => Chip::of_equations(made, dialect, &again, n_vectors),
            Some(Err(_)) | None => Chip::of_netlist(made, &through.emitted, n_vectors),
        });
    }
    let map = through
        .emitted
        .map
        .iter()
        .map(|line| MapEntry {
            line: line.line,
            name: line.name.clone(),
            span: line.span,
            req: line.req.clone(),
        })
        .collect();
    built.files.push(OutputFile {
        name,
        text: through.emitted.text.clone(),
        keep_existing: false,
        map,
    });
    if let Some(bench) = through.emitted.bench.clone() {
        built.files.push(OutputFile {
            name: format!("{stem}_tb.{}", dialect.extension()),
            text: bench,
            keep_existing: false,
            map: Vec::new(),
        });
    }
    Some(through.emitted)
}

fn c_files(net: &Net, files: &[File]) -> Vec<OutputFile> {
    let req = |object: &grafsynth_backend_c::Object| match *object {
        grafsynth_backend_c::Object::Step(id) => net.steps[id].meta.req.clone(),
        grafsynth_backend_c::Object::Transition(id) => net.transitions[id].meta.req.clone(),
        grafsynth_backend_c::Object::Input(id) => net.inputs[id].meta.req.clone(),
        grafsynth_backend_c::Object::Output(id) => net.outputs[id].meta.req.clone(),
        grafsynth_backend_c::Object::Var(id) => net.vars[id].meta.req.clone(),
        grafsynth_backend_c::Object::Timer(id) => net.timers[id].meta.req.clone(),
        grafsynth_backend_c::Object::Action(id) => net.actions[id].meta.req.clone(),
    };
    files
        .iter()
        .map(|file| OutputFile {
            name: file.name.clone(),
            text: file.text.clone(),
            keep_existing: file.keep_existing,
            map: file
                .map
                .iter()
                .flat_map(|(line, objects)| {
                    objects.iter().map(|object| MapEntry {
                        line: *line,
                        name: object.name(net).to_owned(),
                        span: object.span(net),
                        req: req(object),
                    })
                })
                .collect(),
        })
        .collect()
}

fn read_back_net(net: &Net, name: &str, text: &str) -> OutputReport {
    let (again, found) = grafsynth_ir::text::parse(FileId(u32::MAX), text);
    match again {
        Some(again) if !any_error(&found) && grafsynth_ir::text::same(net, &again) => {
            OutputReport::proved(name, OutputProof::SameNet)
        }
        Some(_) | None => OutputReport::refuted(name, OutputFault::ReadsBackAsAnother),
    }
}
