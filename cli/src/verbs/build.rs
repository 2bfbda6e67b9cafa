//! `grafsynth build FILE --target T -o DIR`.

use super::build_outputs::{Made, judged, outputs, report_files, write};
use super::build_results::{know, refusal, say};
use crate::args::{Build, BuildTrace, Busy, Input};
use crate::evidence;
use crate::exit::Exit;
use crate::files;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use crate::memory::Bound;
use crate::progress;
use grafsynth_backend_c::package::Ecosystem;
use grafsynth_backend_c::{Package, Style};
use grafsynth_driver::ice40::judge;
use grafsynth_driver::pipeline::{self, BuildOptions, Built, BusyMode, CEngine, Reset};
use grafsynth_driver::read::Design;
use grafsynth_driver::report::{self, Note, Outcome, OutputReport};
use grafsynth_driver::stem::FileStem;
use grafsynth_driver::target::Target;
use grafsynth_driver::template::{ENDLESS, TemplateFile};
use grafsynth_driver::trust;
use grafsynth_engines::{EngineError, Job, exhaustive, ice40, measure};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, PropertyRole};
use grafsynth_ir::{Diagnostic, Valid, counted};
use grafsynth_sim::Stimulus;
use grafsynth_verify::c_code::Induction;
use grafsynth_verify::{Limits, OpenReason};

pub(crate) fn run(session: &mut Session, arguments: &Build) -> Result<Exit, Stop> {
    if let Some(BuildTrace::Ring(entries)) = arguments.trace {
        if arguments.trace_ring.is_some() {
            let both = "is the former name of `--trace-ring`: give only one of them";
            return Err(Stop::Usage(format!("`--trace {entries}` {both}")));
        }
        session.note("`build --trace N` is now `--trace-ring N`; the old name will be removed in the next version\n");
    }
    evidence::check_name(arguments.trace_file())?;
    let exit = all(session, arguments)?;
    session.no_trace(arguments.trace_file());
    Ok(exit)
}

fn all(session: &mut Session, arguments: &Build) -> Result<Exit, Stop> {
    let inputs = session.inputs(&arguments.inputs)?;
    if let [input] = inputs.as_slice() {
        session.begin(&input.file);
        let (design, found) = session.design(input)?;
        return one(session, arguments, Read { input, design, found });
    }
    let of_one = [
        ("--board", arguments.inputs.reading.board.is_some()),
        ("--keep-pins", arguments.keep_pins.is_some()),
        ("--stimulus", arguments.stimulus.is_some()),
    ];
    if let Some((option, _)) = of_one.iter().find(|(_, is_given)| *is_given) {
        return Err(Stop::Usage(format!(
            "{option} accepts one file, but {} were given",
            inputs.len()
        )));
    }
    // All designs are read before anything is written, because conflicts between two of them are known only then.
    let mut exit = Exit::Done;
    let mut all: Vec<(Session, Read<'_>)> = Vec::new();
    for input in &inputs {
        let mut own = session.another();
        own.begin(&input.file);
        match own.design(input) {
            Ok((design, found)) => all.push((own, Read { input, design, found })),
            Err(stop) => exit = exit.worse(session.stopped(stop)),
        }
    }
    let mut target_names = arguments.target.iter().flat_map(|names| names.split(','));
    let is_c = target_names.any(|name| matches!(Target::named(name), Some(Target::C(_))));
    let mut named = super::clashes::Named::new(is_c);
    for (_, read) in &all {
        named.add(&read.input.file, &read.stem(), read.net()).map_err(Stop::Usage)?;
    }
    for (mut own, read) in all {
        own.headline(&read.input.file);
        own.begin(&read.input.file);
        let ended = one(&mut own, arguments, read);
        exit = exit.worse(ended.unwrap_or_else(|stop| session.stopped(stop)));
    }
    Ok(exit)
}

/// A design that is to be built.
struct Read<'a> {
    /// The arguments that it was read with.
    input: &'a Input,
    design: Design,
    /// The findings so far.
    found: Vec<Diagnostic>,
}

impl Read<'_> {
    /// The chart, or the pins of logic.
    fn net(&self) -> &Valid<Net> {
        match &self.design {
            Design::Net(design) => &design.net,
            Design::Logic(design) => &design.interface,
        }
    }

    /// The beginning of the names of its files.
    fn stem(&self) -> FileStem {
        FileStem::of_path(&self.input.file)
            .unwrap_or_else(|| FileStem::of_name(&self.net().name.text))
    }
}

/// Builds one design.
fn one(session: &mut Session, arguments: &Build, read: Read<'_>) -> Result<Exit, Stop> {
    let stem = read.stem();
    let Read { input, design, mut found } = read;
    let design = match design {
        Design::Net(design) => design,
        Design::Logic(design) => {
            session.show(&found);
            return super::refit::run(session, arguments, input, &stem, &design);
        }
    };
    session.know_found(&found);
    let made_of = session.made_of();
    if session.is_impossible(&design.net) {
        session.show(&found);
        return Ok(Exit::Errors);
    }
    let targets = targets(&arguments.target)?;
    let net = &design.net;
    let Some(options) = options(session, arguments, input, &stem, net, &targets)? else {
        return Ok(Exit::Errors);
    };
    progress::doing(format!("exploring the states of {}", net.name));
    let facts = pipeline::facts(net, &options.limits);
    progress::doing(format!(
        "building and proving {} of {}",
        arguments.target.join(", "),
        net.name
    ));
    let mut built = made(net, &facts, &targets, &options);
    found.append(&mut built.found);
    let engine = HostC { session, net, options: &options };
    if let Err((name, words)) = pipeline::check_c(net, &facts, &options, &mut built, &engine) {
        session.show(&found);
        return Err(Stop::Input(format!(
            "{name} was not written: the C compiler rejects it\n{words}"
        )));
    }
    if !built.packages.is_empty() && !options.trusts_code {
        found.extend(trust::left_out(net));
    }
    session.know_found(&found);
    know(session, net, &built.lines);
    let mut bitstreams = bitstreams(&options.limits, &mut built);
    if arguments.blob {
        bitstreams.extend(pipeline::images(&built));
    }
    let outcome = built.outcome();
    if session.demands.refuse(&found) {
        return refused(session, arguments, net, &built, &targets, &found);
    }
    if outcome == Outcome::Refuted {
        session.show(&found);
        let why = "an output is not equal to the chart";
        say(session, net, arguments.trace_file(), &built.lines, Some(why))?;
        return Ok(Exit::Refuted);
    }
    if arguments.measure {
        let runnable = trust::runnable(net, arguments.trust.trust_code);
        built.measured = measured(session, &runnable, &facts, &options, &targets);
    }
    if let Some(form) = arguments.report {
        let counted = design.counted.as_ref();
        let (sources, limits) = (&session.sources, &options.limits);
        let document = report::document(net, &facts, &built, counted, sources, limits);
        let drawn = grafsynth_draw::Options::default();
        let chart = design.chart.as_ref().map(|chart| (chart, &drawn));
        built.files.extend(report_files(form, &document, chart, &stem));
    }
    let outputs = outputs(session, arguments, &built, bitstreams);
    let made = Made { stem: &stem, net, made_of, outputs, lines: &built.lines };
    write(session, arguments, made, found)?;
    if arguments.report.is_none() && !session.quiet {
        refuted_asserts(session, net, &input.file, &options.limits);
    }
    Ok(judged(session, arguments, &built.lines))
}

/// Notes the asserts that a short search refutes: a build does not prove asserts.
fn refuted_asserts(session: &Session, net: &Valid<Net>, file: &str, limits: &Limits) {
    let asserts = net.properties.iter().filter(|one| one.role == PropertyRole::Assert).count();
    let n = pipeline::refuted(net, limits);
    if n > 0 {
        let (asserts, is) =
            (counted(asserts, "assert", "asserts"), if n == 1 { "is" } else { "are" });
        session.note(&format!(
            "{n} of {asserts} {is} refuted: `grafsynth check {file}` shows the trace\n"
        ));
    }
}

/// The options of a build; `None` if the stimulus has errors, which were shown.
fn options(
    session: &mut Session,
    arguments: &Build,
    input: &Input,
    stem: &FileStem,
    net: &Valid<Net>,
    targets: &[Target],
) -> Result<Option<BuildOptions>, Stop> {
    let style = style(arguments, targets)?;
    let packages = packages(&arguments.package)?;
    if targets.contains(&Target::Template) == arguments.template.is_empty() {
        return Err(Stop::Usage(
            "the target `template` and the option --template FILE must be used together".to_owned(),
        ));
    }
    let templates = templates(session, &arguments.template)?;
    let stimulus = match &arguments.stimulus {
        None => None,
        Some(path) => match super::sim::stimulus(session, net, Some(path), None, 0, 1)? {
            Some(stimulus) => Some(stimulus),
            None => return Ok(None),
        },
    };
    let keep_pins = match &arguments.keep_pins {
        Some(path) => earlier_pins(session, path)?,
        None => Vec::new(),
    };
    Ok(Some(BuildOptions {
        stem: Some(stem.clone()),
        device: arguments.device.clone(),
        c: grafsynth_backend_c::Options {
            style,
            machine: input.reading.machine,
            goal: arguments.optimise,
            io: arguments.io,
            gate: arguments.gate,
            safe_state: arguments.safe_state,
            trace: arguments.ring(),
            callbacks: arguments.callbacks,
            source: input.file.rsplit(['/', '\\']).next().unwrap_or_default().to_owned(),
            ..Default::default()
        },
        packages,
        templates,
        busy: match arguments.busy {
            Busy::Never => BusyMode::Never,
            Busy::TooLarge => BusyMode::WhenTooLarge,
            Busy::Unproved => BusyMode::WhenUnproved,
            Busy::Always => BusyMode::Always,
        },
        synchronise: arguments.synchronise,
        keep_pins,
        encoding: arguments.encoding,
        dont_cares: !arguments.no_dc,
        safe: arguments.safe,
        reset_wire: None,
        reset: arguments
            .reset
            .as_ref()
            .map(|name| Reset { name: name.clone(), style: arguments.reset_style }),
        stimulus,
        prove: !arguments.no_proof,
        trusts_code: arguments.trust.trust_code,
        report: arguments.report.is_some(),
        limits: arguments.limits.limits(),
    }))
}

/// The style of the C.
fn style(arguments: &Build, targets: &[Target]) -> Result<Style, Stop> {
    let style = Style::from_name(&arguments.style).ok_or_else(|| {
        let (name, known) = (&arguments.style, Style::ALL.map(Style::name));
        let near = did_you_mean(name, known);
        Stop::Usage(format!("unknown style `{name}`{near} (known: {})", known.join(", ")))
    })?;
    let has_image = |target: &Target| match target {
        Target::C(own) => own.unwrap_or(style).has_image(),
        _ => false,
    };
    if arguments.blob && !targets.iter().any(has_image) {
        return Err(Stop::Usage("--blob requires the target c-engine or c-program".to_owned()));
    }
    Ok(style)
}

/// Builds all targets. Templates are the user's programs, so their work is bounded.
fn made(net: &Valid<Net>, facts: &Facts, targets: &[Target], options: &BuildOptions) -> Built {
    let (templates, others): (Vec<Target>, Vec<Target>) =
        targets.iter().partition(|target| **target == Target::Template);
    let mut built = pipeline::build(net, facts, &others, options);
    if !templates.is_empty() {
        let bound = Bound::start(ENDLESS.id, "a template");
        let mut rendered = pipeline::build(net, facts, &templates, options);
        drop(bound);
        built.files.append(&mut rendered.files);
        built.lines.append(&mut rendered.lines);
        built.found.append(&mut rendered.found);
        built.refused.append(&mut rendered.refused);
    }
    built
}

/// Reports that findings prevent the outputs from being written.
fn refused(
    session: &mut Session,
    arguments: &Build,
    net: &Valid<Net>,
    built: &Built,
    targets: &[Target],
    found: &[Diagnostic],
) -> Result<Exit, Stop> {
    session.show(found);
    let why = match any_error(found) {
        true if targets.len() > 1 => refusal(&built.refused),
        true => refusal(&[]),
        false => "warnings are denied".to_owned(),
    };
    // The findings do not name the targets.
    if built.lines.is_empty() && built.refused.len() > 1 {
        session.tell(&format!("nothing was written: {why}\n"));
    }
    let is_option = |one: &Diagnostic| {
        one.code == grafsynth_driver::codes::UNKNOWN_DEVICE && one.labels.is_empty()
    };
    say(session, net, arguments.trace_file(), &built.lines, Some(&why))?;
    if arguments.device.is_some() && found.iter().any(is_option) {
        return Ok(Exit::Usage);
    }
    Err(Stop::Errors)
}

/// The number of random reactions that `--measure` runs.
const REACTIONS: usize = 1_000;

/// Measurements of the C code on simulated machines, if their tools are available; reports what could not be measured.
fn measured(
    session: &Session,
    net: &Valid<Net>,
    facts: &Facts,
    options: &BuildOptions,
    targets: &[Target],
) -> Vec<report::cpu::Measured> {
    let Some(style) = targets.iter().find_map(|target| match target {
        Target::C(style) => Some(style.unwrap_or(options.c.style)),
        _ => None,
    }) else {
        return Vec::new();
    };
    let c = grafsynth_backend_c::Options { style, ..options.c.clone() };
    let stimulus = Stimulus::random(net, REACTIONS, 1, 3);
    let job = Job { net, facts, stimulus: &stimulus };
    let mut all = Vec::new();
    for meter in measure::meters() {
        match meter.run(&job, &c) {
            Ok(it) => all.push(report::cpu::Measured {
                machine: meter.machine(),
                reactions: it.reactions,
                step: it.step,
                init: it.init,
                stack: it.stack,
                text: it.text,
            }),
            Err(EngineError::Refused(_)) => {}
            Err(EngineError::Failed(why)) if !session.quiet => {
                crate::print_error(&format!(
                    "grafsynth: not measured on {}: {why}\n",
                    meter.machine()
                ));
            }
            Err(EngineError::Failed(_)) => {}
        }
    }
    all
}

/// The pins of an earlier output, by its names.
fn earlier_pins(session: &mut Session, path: &str) -> Result<Vec<(String, u32)>, Stop> {
    let (design, found) = session.design(&Input::plain(path))?;
    session.show(&found);
    let Design::Logic(design) = design else {
        return Err(Stop::Input(format!(
            "--keep-pins needs an output of an earlier build (.jed, .pld or .pds), but {path} is a chart"
        )));
    };
    match design.placement {
        Ok(placement) => {
            Ok(placement.pins.into_iter().map(|named| (named.name, named.pin)).collect())
        }
        Err(found) => {
            session.show(&found);
            Err(Stop::Input(format!("--keep-pins: {path} does not assign signals to pins")))
        }
    }
}

fn targets(names: &[String]) -> Result<Vec<Target>, Stop> {
    let mut targets: Vec<Target> = Vec::new();
    for name in names.iter().flat_map(|names| names.split(',')) {
        let target = Target::named(name).ok_or_else(|| {
            if let Some(package) = Ecosystem::ALL.iter().find(|one| one.name() == name) {
                let package = package.name();
                return Stop::Usage(format!(
                    "`{package}` is a package of C, not a target; use --target c --package {package}"
                ));
            }
            let known: Vec<&str> = Target::all().map(|(_, name, _)| name).collect();
            let near = did_you_mean(name, known.iter().copied());
            Stop::Usage(format!(
                "unknown target `{name}`{near} (targets: {})",
                known.join(", ")
            ))
        })?;
        if !targets.contains(&target) {
            targets.push(target);
        }
    }
    if targets.iter().filter(|target| matches!(target, Target::C(_))).count() > 1 {
        return Err(Stop::Usage(
            "two styles of C would write files with the same names: build them into two folders"
                .to_owned(),
        ));
    }
    Ok(targets)
}

/// The templates, as sources for the locations of findings.
fn templates(session: &mut Session, paths: &[String]) -> Result<Vec<TemplateFile>, Stop> {
    let read = |path: &String| {
        let text = files::read_text(path, session.source_limit)?;
        let file = session.sources.add(path.clone(), text.clone());
        Ok(TemplateFile { file, path: path.clone(), text })
    };
    paths.iter().map(read).collect()
}

fn packages(names: &[String]) -> Result<Vec<Ecosystem>, Stop> {
    let known = Ecosystem::ALL.map(Ecosystem::name);
    let mut packages = Vec::new();
    for name in names {
        let package = Ecosystem::named(name).ok_or_else(|| {
            let near = did_you_mean(name, known);
            let known = known.join(", ");
            Stop::Usage(format!("unknown package `{name}`{near} (packages: {known})"))
        })?;
        if !packages.contains(&package) {
            packages.push(package);
        }
    }
    Ok(packages)
}

/// Compiles C with the compiler of the host, and compares its run with the net.
pub(super) struct HostC<'a> {
    pub(super) session: &'a Session,
    pub(super) net: &'a Valid<Net>,
    pub(super) options: &'a BuildOptions,
}

impl CEngine for HostC<'_> {
    fn check(
        &self,
        name: &str,
        package: &Package,
        read: Result<Induction, OpenReason>,
    ) -> Result<OutputReport, String> {
        let checked = exhaustive::check(name, self.net, package, &self.options.limits, read);
        checked.map_err(|exhaustive::Refused(words)| words)
    }

    fn begins(&self, name: &str, lines: &[OutputReport]) {
        know(self.session, self.net, lines);
        progress::doing(format!("compiling and running {name}"));
    }
}

/// Makes the bitstreams and reads them back, if the tools are available; returns those that are correct.
fn bitstreams(limits: &Limits, built: &mut Built) -> Vec<(String, Vec<u8>)> {
    let mut made = Vec::new();
    for job in std::mem::take(&mut built.bitstreams) {
        let missing = ice40::missing();
        if !missing.is_empty() {
            let missing = missing.iter().map(ToString::to_string).collect();
            built.lines.push(OutputReport::open(&job.name, OpenReason::ToolMissing(missing)));
            continue;
        }
        progress::doing(format!("placing and routing {}", job.name));
        match ice40::bitstream(&job) {
            Ok(bitstream) => {
                let mut line = judge(&job, &bitstream.read_back, limits);
                if !bitstream.remark.is_empty() {
                    line.notes.push(Note::Remark(bitstream.remark.clone()));
                }
                if line.outcome() != Outcome::Refuted {
                    made.push((job.name, bitstream.bytes));
                }
                built.lines.push(line);
            }
            Err(why) => {
                built.lines.push(OutputReport::open(&job.name, OpenReason::ToolFailed(why)));
            }
        }
    }
    made
}
