//! From a net to its outputs: the back half of the pipeline, as one visible list.
//!
//! ```text
//! facts      verify::facts                what is proved of the net
//! program    ir::lower::program           one reaction as a bounded program
//! logic      logic::encode                one flip-flop per step
//! synchronise  backend_pld::synchronise   flip-flops in front of inputs, if asked for
//! emit       backend_pld::emit            names, products, pins, then text; for a fuse map see crate::jedec
//! read       backend_pld::read, rebind    the text as a stranger sees it
//! strip      reset, synchronise           what the chart does not know, seen to do nothing else
//! prove      verify::equiv                equal to the net, for every reachable state
//! ```
//! C goes from the net and its facts to text; comparing it needs a compiler, so that is left to the caller ([`Built::packages`]).

use crate::codes;
use crate::coding::{self, EncodingChoice};
use crate::report::chip::{Chip, Code, Made};
use crate::report::{Line, Outcome};
use crate::rescue;
use crate::target::Target;
use crate::template::TemplateFile;
use grafsynth_backend_c::package::Ecosystem;
use grafsynth_backend_c::{File, Package};
use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::vectors::TraceRow;
use grafsynth_backend_pld::{Dialect, EmitOptions, Emitted, Object, Vectors, synchronise};
pub use grafsynth_backend_pld::{Reset, ResetStyle};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::{Evolution, Net, Sharing};
use grafsynth_ir::{Diagnostic, FileId, Valid};
pub use grafsynth_logic::BusyMode;
use grafsynth_logic::EncodeOptions;
use grafsynth_logic::recode::Encoding;
use grafsynth_sim::{InputRow, Row, Simulator, Stimulus};
use grafsynth_verify::{Dominance, Limits};

/// What the user chose.
#[derive(Debug, Clone, Default)]
pub struct BuildOptions {
    /// The device family of equations; none takes the default.
    pub device: Option<String>,
    /// C: style, callbacks.
    pub c: grafsynth_backend_c::Options,
    /// C: folders for ecosystems in place of the bare files.
    pub packages: Vec<Ecosystem>,
    /// Templates of the user's, for [`Target::Template`].
    pub templates: Vec<TemplateFile>,
    /// When a reaction of a circuit may take several clocks.
    pub busy: BusyMode,
    /// Flip-flops in front of each input that is not declared `synchronous`.
    pub synchronise: u32,
    /// Verilog: a reset input.
    pub reset: Option<Reset>,
    /// Pins of an earlier build, by the names in its file: signals stay there as far as that is still possible.
    pub keep_pins: Vec<(String, u32)>,
    /// How the steps are coded.
    pub encoding: EncodingChoice,
    /// Equations may do what they like in situations that are not reached, and where the chart's assumptions are broken.
    pub dont_cares: bool,
    /// Every situation that is not reached leads back to the initial one in one clock, and that is proved.
    pub safe: bool,
    /// Test vectors for the SIMULATION section and the test bench.
    pub stimulus: Option<Stimulus>,
    /// Prove the outputs equal.
    pub prove: bool,
    /// Gather what a page says of each chip: [`Built::chips`].
    pub report: bool,
    /// How far proofs may go.
    pub limits: Limits,
}

/// A file to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputFile {
    /// Its name; in a package with the folders that it lies in, parted by `/`.
    pub name: String,
    /// Its text.
    pub text: String,
    /// It is the user's: written only where no file of that name is.
    pub keep_existing: bool,
    /// Which line comes from which place.
    pub map: Vec<MapEntry>,
}

/// One line of an output and where it comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapEntry {
    /// The line, from 1.
    pub line: u32,
    /// What it comes from.
    pub name: String,
    /// Where that was declared.
    pub span: grafsynth_ir::Span,
    /// Its requirement tags.
    pub req: Vec<String>,
}

/// What a build gave.
#[derive(Debug, Clone, Default)]
pub struct Built {
    /// The files, in the order of the targets.
    pub files: Vec<OutputFile>,
    /// What was proved and how, a line for each output.
    pub lines: Vec<Line>,
    /// Findings of the back ends.
    pub found: Vec<Diagnostic>,
    /// C packages, which the caller may compare with the net by running them.
    pub packages: Vec<Package>,
    /// Bitstreams, which the caller may have made where the tools are.
    pub bitstreams: Vec<crate::ice40::Job>,
    /// What a page says of each chip, where one was asked for.
    pub chips: Vec<Chip>,
    /// What was measured of the first C package, where the caller had it measured for the page.
    pub measured: Vec<crate::report::cpu::Measured>,
    /// Which tasks cost what a model says, for the page.
    pub counted: Option<crate::task_costs::Counted>,
}

impl Built {
    /// The worst of all lines.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.lines.iter().map(|line| line.outcome).max().unwrap_or(Outcome::Proved)
    }
}

/// Reactions times steps and transitions that an enumeration before a build may look at: some hundredths of a second.
const ENUMERATION_WORK: u64 = 20_000_000;

/// What the back ends need to know of a net: the structure, and for a chart that evolves until it is stable a bound on its micro-steps, which only
/// an enumeration can give. It costs time in proportion to the net, not to its states.
#[must_use]
pub fn facts(net: &Valid<Net>, limits: &Limits) -> Facts {
    match net.settings.evolution {
        Evolution::Single => grafsynth_verify::structural_facts(net),
        Evolution::Stable { .. } => {
            // A reaction takes time in proportion to what it looks at.
            let size = (net.steps.len() + net.transitions.len()).max(1) as u64;
            let limits = Limits {
                pairs: limits.pairs.min((ENUMERATION_WORK / size).clamp(1_000, 100_000)),
                // A diagram that unrolls micro-steps is small or hopeless, and a build is not to wait for it.
                image_bits: limits.image_bits.min(512),
                image_work: limits.image_work.min(1_000_000),
                ..limits.clone()
            };
            grafsynth_verify::facts(net, &limits)
        }
    }
}

/// Errors about variables that the designer wants not to be shared with a halted step (semantics §6). They need the situations, not the structure alone.
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
    let needs_logic =
        targets.iter().any(|target| target.dialect().is_some() || *target == Target::Jedec);
    let logic = needs_logic.then(|| logic_as(net, facts, options.busy));
    if let Some(Err(found)) = &logic {
        built.found.extend(found.iter().cloned());
    }
    // Verilog is asked for by two targets, and written once.
    let mut verilog: Option<Option<Emitted>> = None;
    for target in targets {
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
            // Why there is no circuit was said.
            (_, Some(_), _) | (Target::Jedec, None, _) => {}
            (Target::C(style), None, _) => {
                let mut c = options.c.clone();
                if let Some(style) = style {
                    c.style = *style;
                }
                match grafsynth_backend_c::emit(net, facts, &c) {
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
                        built.packages.push(package);
                    }
                    Err(found) => built.found.extend(found),
                }
            }
            (Target::Net, None, _) => {
                let text = grafsynth_ir::text::print(net);
                let name = format!("{}.net", file_stem(net));
                built.lines.push(read_back_net(net, &name, &text));
                built.files.push(OutputFile { name, text, keep_existing: false, map: Vec::new() });
            }
            (Target::Json | Target::Template, None, _) => {
                crate::template::build(net, *target, &options.templates, &mut built);
            }
            (Target::Logic(_) | Target::Ice40, None, _) => {
                unreachable!("a target of logic has a dialect")
            }
        }
    }
    built
}

/// The circuit of a net: one clock a reaction where the depth of its evolution is proved and the composition is not too large, else one micro-step a
/// clock with `busy` (semantics.md §9).
///
/// # Errors
/// What a chip cannot do, each with its place.
pub fn logic(net: &Valid<Net>, facts: &Facts) -> Result<Logic, Vec<Diagnostic>> {
    logic_as(net, facts, BusyMode::default())
}

/// The circuit of a net, with a choice when a reaction may take several clocks.
///
/// # Errors
/// What a chip cannot do, each with its place.
pub fn logic_as(net: &Valid<Net>, facts: &Facts, busy: BusyMode) -> Result<Logic, Vec<Diagnostic>> {
    let program = program(net, &ProgramOptions::default())?;
    grafsynth_logic::encode(
        net,
        &program,
        facts,
        &EncodeOptions { busy, ..EncodeOptions::default() },
    )
}

/// A text and the circuit that a stranger reads in it.
#[derive(Debug, Clone)]
pub struct Through {
    /// The text with its names.
    pub emitted: Emitted,
    /// Read back, with the roles of the emitted circuit.
    pub read_back: Logic,
}

/// Writes a circuit in a language and reads it back.
///
/// # Errors
/// What the language cannot say, or what the reader does not understand of our own text.
pub fn through(
    logic: &Logic,
    dialect: Dialect,
    options: &EmitOptions,
) -> Result<Through, Vec<Diagnostic>> {
    let emitted = grafsynth_backend_pld::emit(logic, dialect, options)?;
    // The text is no file of the user's, so its findings must not point into one: a number that no source has.
    let (read_back, found) = grafsynth_backend_pld::read(dialect, FileId(u32::MAX), &emitted.text);
    let Some(mut read_back) = read_back.filter(|_| !any_error(&found)) else { return Err(found) };
    let found = grafsynth_backend_pld::rebind(&mut read_back, &emitted);
    if any_error(&found) { Err(found) } else { Ok(Through { emitted, read_back }) }
}

/// What the back end needs to know of a net beyond its circuit.
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
        pins: net.board.pins.iter().map(|(name, pin)| (name.text.clone(), *pin)).collect(),
        vectors,
        notes: transitions.collect(),
        ..EmitOptions::default()
    }
}

/// The circuit with `stages` flip-flops in front of each input that is not declared `synchronous`, and of the tick; each wakes with the code that its
/// input has at reset.
#[must_use]
pub fn synchronised(net: &Net, logic: Logic, stages: u32) -> (Logic, Vec<synchronise::Chain>) {
    synchronise::add(logic, stages, |pin| match pin.role {
        PinRole::Input(id, bit) if !net.inputs[id].synchronous => {
            let ty = net.inputs[id].ty;
            let code = ty.saturate(0).abs_diff(ty.bounds().0);
            Some(code.checked_shr(bit).unwrap_or(0) & 1 == 1)
        }
        PinRole::Tick => Some(false),
        PinRole::Input(..)
        | PinRole::Reset
        | PinRole::Output(..)
        | PinRole::Busy
        | PinRole::Fault
        | PinRole::Unknown => None,
    })
}

/// The vectors of a circuit behind synchronisers: what its pins show comes as many clocks earlier as there are stages.
pub(crate) fn delayed_vectors(
    net: &Valid<Net>,
    logic: &Logic,
    circuit: &Logic,
    chains: &[synchronise::Chain],
    stimulus: &Stimulus,
) -> Result<Vectors, Vec<Diagnostic>> {
    let Some(chain) = chains.first() else { return vectors(net, logic, stimulus) };
    if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        let message = "a circuit that is `busy` takes its inputs when it is ready, and synchronisers move them on with every clock: no bench can say what it must show";
        return Err(vec![
            Diagnostic::error(codes::NO_BENCH, message)
                .help("leave out `--stimulus` or `--synchronise`, or use `--busy never`"),
        ]);
    }
    let idle = InputRow { dt: 0, ..InputRow::zero(net) };
    let rows = std::iter::repeat_n(idle, chain.flops.len()).chain(stimulus.rows());
    let mut vectors = vectors_of(net, logic, rows)?;
    synchronise::delayed(circuit, chains, &mut vectors);
    Ok(vectors)
}

/// The name that the files of a net begin with.
#[must_use]
pub fn file_stem(net: &Net) -> String {
    let stem: String = net
        .name
        .text
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' })
        .collect();
    if stem.is_empty() { "chart".to_owned() } else { stem }
}

/// The pins of an iCE40, and what its tools need.
fn ice40(net: &Net, emitted: &Emitted, options: &BuildOptions, built: &mut Built) {
    let stem = file_stem(net);
    let board = net.board.device.as_ref().map(|name| name.text.as_str());
    // The board may be that of another chip that the chart is also built for.
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

/// Writes one text, reads it back and has it proved; gives the text unless it was refused or refuted.
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
        dont_cares: may_be_free(net) && options.dont_cares && is_flat,
        keep: options.keep_pins.clone(),
        ..emit_options(net, options.device.as_deref(), None)
    };
    let coded = coding::code(net, facts, logic, options.encoding, options.safe, dialect, &wishes);
    let code = code_of(net, facts, logic, &coded, options, dialect, &wishes);
    let asked = rescue::Asked { net, facts, logic, options, is_burned: false };
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
        grafsynth_logic::recode::observe(&coded.logic, &mut read_back);
        Ok(Through { read_back, ..through })
    });
    let through = match through {
        Ok(through) => through,
        Err(mut found) => {
            rescue::advise(&asked, &mut found);
            built.found.extend(found);
            return None;
        }
    };
    let stem = file_stem(net);
    // CUPL and GALasm share the usual extension; side by side they need two names.
    let name = match dialect {
        Dialect::Cupl => format!("{stem}.cupl.pld"),
        Dialect::Galasm => format!("{stem}.galasm.pld"),
        Dialect::Palasm | Dialect::Verilog | Dialect::Blif => {
            format!("{stem}.{}", dialect.extension())
        }
    };
    let mut line = if options.prove {
        Line::of_verdict(
            &name,
            &grafsynth_verify::equiv(net, facts, &through.read_back, &options.limits),
        )
    } else {
        Line::open(&name, "read back; not proved, as asked")
    };
    say_emergency(&mut line, net, &through.read_back, options);
    if let Some(said) = codes_and_dont_cares(&coded, logic, &emit_options) {
        line.text = format!("{}; {said}", line.text);
    }
    if options.safe {
        say_safe(&mut line, logic, &through.read_back);
    }
    let has_open_pins = |named: &grafsynth_backend_pld::Named| {
        named.pin.is_none() && matches!(named.object, Object::Input(_) | Object::Output(_))
    };
    if is_flat && options.device.is_some() && through.emitted.names.iter().any(has_open_pins) {
        let advice = rescue::advice_for(&asked);
        line.text = format!("{}; pins are open, for it does not fit; {advice}", line.text);
    }
    let is_refuted = line.outcome == Outcome::Refuted;
    let form = form(net, facts, logic, options.busy);
    if let Some(form) = &form {
        line.text = format!("{}; {form}", line.text);
    }
    for (history, why) in grafsynth_logic::kept_apart(net) {
        let name = &net.histories[history].name;
        line.text = format!("{}; history `{name}` has flip-flops of its own: {why}", line.text);
    }
    if let Some(chain) = chains.first() {
        let (pins, stages) = (chains.len(), chain.flops.len());
        line.text =
            format!("{}; {pins} inputs arrive {stages} clocks later, by synchronisers", line.text);
    }
    let outcome = line.outcome;
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
        // The text was made of these equations, and is made of them again.
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

/// What a page says of the codes of a circuit; none where no page was asked for.
pub(crate) fn code_of(
    net: &Net,
    facts: &Facts,
    logic: &Logic,
    coded: &coding::Coded,
    options: &BuildOptions,
    dialect: Dialect,
    wishes: &EmitOptions,
) -> Option<Code> {
    if !options.report {
        return None;
    }
    let n_groups = coding::groups(net, facts, logic).len();
    let mut code = Code::of(coded, options.encoding, n_groups, options.safe);
    code.why_not_one_hot =
        coding::why_not_one_hot(net, facts, logic, options.encoding, options.safe, dialect, wishes);
    Some(code)
}

/// Says of a circuit that was to be made safe whether that is proved of what was read back; if it is not, the line is open.
pub(crate) fn say_safe(line: &mut Line, logic: &Logic, read_back: &Logic) {
    let said = if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        "not made safe: it makes one micro-step a clock".to_owned()
    } else {
        match grafsynth_logic::recode::is_safe(read_back) {
            Ok(codes) if codes.illegal == 0 => "safe: no code is illegal".to_owned(),
            Ok(codes) => format!(
                "safe: all {} illegal codes of {} flip-flops lead back in one clock, proved over all codes",
                codes.illegal, codes.n_flops
            ),
            Err(why) => {
                line.outcome = line.outcome.max(Outcome::Open);
                format!("not proved safe: {why}")
            }
        }
    };
    line.text = format!("{}; {said}", line.text);
}

/// Whether functions may be anything in states that are not reached. In a design with an emergency they may not, or what is proved of its pins would
/// hold in reachable states only.
pub(crate) fn may_be_free(net: &Net) -> bool {
    net.emergency.is_none()
}

/// Says of a circuit whether the emergency dominates in every state of what was read back; if it does not, the line is refuted.
pub(crate) fn say_emergency(
    line: &mut Line,
    net: &Valid<Net>,
    read_back: &Logic,
    options: &BuildOptions,
) {
    if !options.prove {
        return;
    }
    let Some(found) = grafsynth_verify::dominates(net, read_back, &options.limits) else { return };
    line.outcome = line.outcome.max(match found {
        Dominance::Proved { .. } => Outcome::Proved,
        Dominance::Open(_) => Outcome::Open,
        Dominance::Refuted { .. } => Outcome::Refuted,
    });
    line.text = format!("{}; {found}", line.text);
}

/// What a line says of codes and don't-cares; nothing where each step has its flip-flop and each function is what it is everywhere.
pub(crate) fn codes_and_dont_cares(
    coded: &coding::Coded,
    emitted: &Logic,
    options: &EmitOptions,
) -> Option<String> {
    let mut parts = Vec::new();
    if coded.n_coded > 0 {
        parts.push(format!(
            "{} flip-flops, {} {} coded {}",
            coded.logic.flops.len(),
            coded.n_coded,
            if coded.n_coded == 1 { "step" } else { "steps" },
            match coded.encoding {
                Encoding::OneHot => "one-hot",
                Encoding::ZeroHot => "zero-hot",
                Encoding::Compact => "compactly",
            }
        ));
        parts.extend(coded.why.as_ref().map(|why| format!("chosen, for {why}")));
    }
    if coded.n_unread > 0 {
        let (inputs, have) =
            if coded.n_unread == 1 { ("input", "has") } else { ("inputs", "have") };
        parts.push(format!("{} {inputs} that nothing reads {have} no pin", coded.n_unread));
    }
    if options.dont_cares {
        let kinds = [
            (emitted.unreachable.is_empty(), "situations that are not reached"),
            (emitted.never.is_empty(), "broken assumptions"),
            (emitted.open.is_empty(), "what the chart leaves open"),
        ];
        let kinds: Vec<&str> =
            kinds.into_iter().filter(|(is_none, _)| !is_none).map(|(_, kind)| kind).collect();
        match &kinds[..] {
            [] => {}
            [only] => parts.push(format!("don't-cares: {only}")),
            [all @ .., last] => parts.push(format!("don't-cares: {} and {last}", all.join(", "))),
        }
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// How a circuit evolves until it is stable, and why so; nothing for a chart that makes one micro-step a reaction.
#[must_use]
pub fn form(net: &Net, facts: &Facts, logic: &Logic, busy: BusyMode) -> Option<String> {
    let Evolution::Stable { limit } = net.settings.evolution else { return None };
    let is_proved = grafsynth_logic::is_depth_proved(net, facts);
    if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        let why = match busy {
            BusyMode::Always | BusyMode::Never => "as asked".to_owned(),
            BusyMode::WhenUnproved if !is_proved => {
                format!("for it is not proved that {limit} of them are always enough")
            }
            BusyMode::WhenUnproved | BusyMode::WhenTooLarge => {
                "for they are too large in one".to_owned()
            }
        };
        return Some(format!("one micro-step a clock with `busy`, {why}"));
    }
    let why = match &facts.stable_depth {
        Some(depth) => format!("{} deep as proved", depth.value),
        None if is_proved => match &facts.rounds {
            Some(rounds) => format!("{} checks as proved", rounds.value),
            None => format!("{limit} are always enough as proved"),
        },
        None => match busy {
            BusyMode::Never | BusyMode::WhenTooLarge => "as asked".to_owned(),
            BusyMode::WhenUnproved | BusyMode::Always => {
                "for none can have a clock of its own: nothing fires, or actions are called on the way".to_owned()
            }
        },
    };
    Some(format!("micro-steps composed into one clock, {why}"))
}

/// The reference trace of a stimulus as bits of the circuit's pins.
///
/// # Errors
/// A stimulus with more than one tick in a row.
pub fn vectors(
    net: &Valid<Net>,
    logic: &Logic,
    stimulus: &Stimulus,
) -> Result<Vectors, Vec<Diagnostic>> {
    vectors_of(net, logic, stimulus.rows())
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
            // What follows from an open situation says nothing of a right circuit.
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

fn read_back_net(net: &Net, name: &str, text: &str) -> Line {
    let (again, found) = grafsynth_ir::text::parse(FileId(u32::MAX), text);
    match again {
        Some(again) if !any_error(&found) && grafsynth_ir::text::same(net, &again) => {
            Line::proved(name, "read back: the same net")
        }
        Some(_) | None => Line::refuted(name, "reads back as another net"),
    }
}
