//! `grafsynth sim FILE --stimulus S.csv`.

use crate::args::Sim;
use crate::evidence;
use crate::exit::Exit;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use crate::partition;
use crate::report::{About, Answer, Status};
use crate::step::Stepping;
use crate::verbs::products;
use crate::waves::of_trace;
use grafsynth_draw::waves::Waves;
use grafsynth_draw::{svg, waves};
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::read::Design;
use grafsynth_driver::trust;
use grafsynth_engines::{Availability, Engine, EngineError, Job, OfCpu, Pace};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::net::{Net, StepId};
use grafsynth_ir::{Diagnostic, FileId, Span, Valid, counted};
use grafsynth_sim::codes;
use grafsynth_sim::{
    Clocked, Difference, Events, Expected, Simulator, Stepper, Stimulus, Trace, TraceLayout,
    run_observed, with_plant,
};
use std::path::Path;

pub(crate) fn run(session: &mut Session, arguments: &Sim) -> Result<Exit, Stop> {
    check_options(session, arguments)?;
    let with = arguments.with.as_deref();
    let engine = choice(&arguments.engine, with)?;
    session.begin(&arguments.input.file);
    let (design, mut found) = session.design(&arguments.input)?;
    let design = match design {
        Design::Net(design) => design,
        Design::Logic(design) => {
            // Fuses are simulated directly, so they need not form a single-clock circuit.
            if design.fuses.is_none() {
                found.extend(design.beyond.iter().cloned());
            }
            session.show(&found);
            if arguments.interactive {
                return Err(Stop::Input("--interactive needs a chart, not logic".to_owned()));
            }
            return logic(session, &design, arguments);
        }
    };
    session.show(&found);
    if session.demands.refuse(&found) {
        return Ok(Exit::Errors);
    }
    let net = &design.net;
    if session.is_impossible(net) {
        return Ok(Exit::Errors);
    }
    if arguments.interactive {
        return interactive(session, net, arguments);
    }
    let runnable = trust::runnable(net, arguments.trust.trust_code);
    let engine = engine.engine(session, &runnable, with)?;
    let max_dt = if engine.pace() == Pace::Rows { 3 } else { 1 };
    let Some((stimulus, expected)) = with_expected(
        session,
        net,
        arguments.stimulus.as_deref(),
        arguments.random,
        arguments.seed,
        max_dt,
    )?
    else {
        return Ok(Exit::Errors);
    };
    let stimulus = match arguments.plant.as_deref() {
        None => stimulus,
        Some(plant) => match driven(session, net, arguments, plant, &stimulus)? {
            Some(driven) => driven,
            None => return Ok(Exit::Errors),
        },
    };
    let keeps_state = arguments.restore.is_some() || arguments.save.is_some();
    if keeps_state && engine.name() != "ir" {
        return Err(Stop::Usage("only the engine `ir` can restore and save a state".to_owned()));
    }
    // For each reaction after the reset, whether a transition fired.
    let mut fired = Vec::new();
    let trace = if keeps_state {
        with_state(session, net, &stimulus, arguments)?
    } else if engine.name() == "ir" {
        // The reference simulator also reports problems to the chart's author: values cut to their range, races, faults.
        let mut simulator = Simulator::new(net);
        let trace = run_observed(&mut simulator, &stimulus, &mut |simulator| {
            fired.push(!simulator.fired().is_empty());
        });
        session.show(&simulator.notes().diagnostics(net));
        trace
    } else {
        match by_engine(session, engine.as_ref(), net, &stimulus, arguments)? {
            Some(trace) => trace,
            None => return Ok(Exit::Errors),
        }
    };
    fired.insert(0, false);
    write(session, &trace, arguments, Some(net), fired)?;
    Ok(as_expected(session, arguments, &expected, &trace))
}

/// The inputs as the plant sets them; `None` if they take too many ticks, which is reported.
fn driven(
    session: &mut Session,
    net: &Valid<Net>,
    arguments: &Sim,
    plant: &str,
    stimulus: &Stimulus,
) -> Result<Option<Stimulus>, Stop> {
    let Some(plant) = session.plant(net, &arguments.input.file, Some(plant))? else {
        return Ok(None);
    };
    match with_plant(net, &plant, stimulus) {
        Ok(driven) => Ok(Some(driven)),
        Err(finding) => {
            session.show(&[*finding]);
            Ok(None)
        }
    }
}

/// Refuses options that contradict each other.
fn check_options(session: &Session, arguments: &Sim) -> Result<(), Stop> {
    if arguments.stimulus.is_none() && arguments.random.is_none() && !arguments.interactive {
        return Err(Stop::Usage(
            "no stimulus: give --stimulus FILE, --random N or --interactive".to_owned(),
        ));
    }
    evidence::check_name(arguments.trace.as_deref())?;
    if let (Some(trace), Some(save)) = (&arguments.trace, &arguments.save)
        && trace == save
    {
        let path = trace.display();
        return Err(Stop::Usage(format!("{path} would contain both the trace and the state")));
    }
    if arguments.interactive {
        check_interactive(session, arguments)?;
    }
    if arguments.blank && !arguments.trace.as_deref().is_some_and(evidence::is_drawing) {
        return Err(Stop::Usage("--blank needs a drawing: --trace FILE.svg".to_owned()));
    }
    Ok(())
}

/// The trace on an engine; `None` if it refuses the chart, which is reported.
fn by_engine(
    session: &Session,
    engine: &dyn Engine,
    net: &Valid<Net>,
    stimulus: &Stimulus,
    arguments: &Sim,
) -> Result<Option<Trace>, Stop> {
    if let Availability::Missing(tool) = engine.availability() {
        return Err(Stop::Input(format!(
            "engine {} needs {tool}, which is not installed",
            engine.name()
        )));
    }
    let facts = grafsynth_driver::pipeline::facts(net, &grafsynth_verify::Limits::default());
    let runnable = trust::runnable(net, arguments.trust.trust_code);
    if engine.runs_c() && !arguments.trust.trust_code {
        session.show(trust::left_out(net).as_slice());
    }
    let run = |stimulus: &Stimulus| engine.run(&Job { net: &runnable, facts: &facts, stimulus });
    let trace = match engine.pace() {
        Pace::Rows => run(stimulus),
        Pace::Clocks => {
            let Some(clocked) = clocked(session, net, stimulus) else { return Ok(None) };
            run(&clocked.stimulus).map(|trace| clocked.by_rows(net, &trace))
        }
        Pace::Events => {
            let Some(events) = events(session, net, stimulus) else { return Ok(None) };
            run(&events.stimulus).map(|trace| events.by_rows(&trace))
        }
    };
    match trace {
        Ok(trace) => Ok(Some(trace)),
        Err(EngineError::Refused(found)) => {
            session.show(&found);
            Ok(None)
        }
        Err(EngineError::Failed(text)) => {
            Err(Stop::Input(format!("engine {} failed: {text}", engine.name())))
        }
    }
}

/// Reports where the trace differs from the expected values of the stimulus.
fn as_expected(session: &Session, arguments: &Sim, expected: &Expected, trace: &Trace) -> Exit {
    if expected.is_empty() {
        return Exit::Done;
    }
    let subject = arguments.stimulus.as_deref().unwrap_or_default();
    let answer = |status, message: &str| Answer::new(About::Replay, subject, status, message);
    let Some(difference) = expected.first_difference(trace) else {
        let open = expected.open_cells(trace);
        let mut message =
            format!("as expected: {}", counted(expected.cells() - open, "cell", "cells"));
        if open > 0 {
            message += &format!("; not compared: {open} that the chart leaves undefined");
        }
        session.keep(&answer(Status::Done, &message).with("not_compared", open));
        session.note(&format!("{subject}: {message}\n"));
        return Exit::Done;
    };
    let Difference { row, column, left, right } = &difference;
    let message = format!("scan {row}, {column}: expected `{left}`, found `{right}`");
    let answer = answer(Status::Refuted, &message)
        .difference(&difference)
        .with("expected", left.as_str())
        .with("got", right.as_str());
    session.keep(&answer);
    session.warn(&format!("{subject}: different: {message}"));
    Exit::Refuted
}

/// Runs an imported circuit, one clock for each tick.
fn logic(session: &mut Session, design: &LogicDesign, arguments: &Sim) -> Result<Exit, Stop> {
    if arguments.restore.is_some() || arguments.save.is_some() {
        return Err(Stop::Input(
            "the state of logic cannot be saved or restored, because logic has no step names"
                .to_owned(),
        ));
    }
    if !["ir", "equations", "jedec"].contains(&arguments.engine.as_str()) {
        return Err(Stop::Input(format!(
            "engine {} runs charts; logic is simulated directly (omit --engine)",
            arguments.engine
        )));
    }
    if design.fuses.is_none() && design.circuit().is_err() {
        return Err(Stop::Errors);
    }
    let Some((stimulus, expected)) = with_expected(
        session,
        &design.interface,
        arguments.stimulus.as_deref(),
        arguments.random,
        arguments.seed,
        1,
    )?
    else {
        return Ok(Exit::Errors);
    };
    let Some(clocked) = clocked(session, &design.interface, &stimulus) else {
        return Ok(Exit::Errors);
    };
    match grafsynth_driver::run::design_trace(design, &clocked.stimulus) {
        Ok(trace) => {
            let trace = clocked.by_rows(&design.interface, &trace);
            write(session, &trace, arguments, None, Vec::new())?;
            Ok(as_expected(session, arguments, &expected, &trace))
        }
        Err(found) => {
            session.show(&found);
            Ok(Exit::Errors)
        }
    }
}

/// Writes the trace to the requested destination. Waveforms show the times and the reactions in which a transition `fired`, if these are known.
fn write(
    session: &Session,
    trace: &Trace,
    arguments: &Sim,
    net: Option<&Valid<Net>>,
    fired: Vec<bool>,
) -> Result<(), Stop> {
    let Some(path) = &arguments.trace else {
        crate::print(&trace.to_csv());
        return Ok(());
    };
    let text = trace_text(path, trace, arguments, net, fired)?;
    session.write_named(vec![(path.clone(), text)])
}

/// The trace in the format that the name of the file shows.
fn trace_text(
    path: &Path,
    trace: &Trace,
    arguments: &Sim,
    net: Option<&Valid<Net>>,
    fired: Vec<bool>,
) -> Result<Vec<u8>, Stop> {
    if !evidence::is_drawing(path) {
        return Ok(evidence::trace_text(path, trace)?.into_bytes());
    }
    let title = net.map(|net| net.name.text.clone()).unwrap_or_default();
    let tick_ns = net.map(|net| net.settings.tick_ns);
    let is_blank = arguments.blank;
    Ok(svg(&waves(&Waves { title, tick_ns, fired, is_blank, ..of_trace(trace) })).into_bytes())
}

/// An engine that the user named.
pub(super) enum Choice {
    /// An engine that needs nothing else.
    Plain(Box<dyn Engine>),
    /// The parts of a partition file.
    Split(OfCpu),
}

impl Choice {
    /// The engine for a net.
    ///
    /// # Errors
    /// There is no split: see [`partition::engine`].
    pub(super) fn engine(
        self,
        session: &Session,
        net: &Valid<Net>,
        with: Option<&str>,
    ) -> Result<Box<dyn Engine>, Stop> {
        match self {
            Choice::Plain(engine) => Ok(engine),
            Choice::Split(of_cpu) => {
                let path = with.unwrap_or_default();
                Ok(Box::new(partition::engine(session, net, path, of_cpu)?))
            }
        }
    }
}

/// The engine with that name, or an error that lists the known ones. An engine of splits needs a partition file.
pub(super) fn choice(name: &str, with: Option<&str>) -> Result<Choice, Stop> {
    if let Some(of_cpu) = OfCpu::named(name) {
        return match with {
            Some(_) => Ok(Choice::Split(of_cpu)),
            None => Err(Stop::Usage(format!("engine {name} needs a partition file: --with FILE"))),
        };
    }
    grafsynth_engines::named(name).map(Choice::Plain).ok_or_else(|| {
        let all = grafsynth_engines::all();
        let of_splits = OfCpu::ALL.iter().map(|it| it.name());
        let known: Vec<&str> = all.iter().map(|engine| engine.name()).chain(of_splits).collect();
        let near = did_you_mean(name, known.iter().copied());
        Stop::Usage(format!("unknown engine `{name}`{near} (engines: {})", known.join(", ")))
    })
}

/// The requested stimulus; `None` if it has errors, which were shown.
pub(super) fn stimulus(
    session: &mut Session,
    net: &Valid<Net>,
    path: Option<&str>,
    random: Option<usize>,
    seed: u64,
    max_dt: u32,
) -> Result<Option<Stimulus>, Stop> {
    let read = with_expected(session, net, path, random, seed, max_dt)?;
    Ok(read.map(|(stimulus, _)| stimulus))
}

/// Like [`stimulus`], with the expected values.
fn with_expected(
    session: &mut Session,
    net: &Valid<Net>,
    path: Option<&str>,
    random: Option<usize>,
    seed: u64,
    max_dt: u32,
) -> Result<Option<(Stimulus, Expected)>, Stop> {
    match path {
        Some(path) => {
            let file = session.text(path)?;
            let text =
                session.sources.get(file).map(|source| source.text.clone()).unwrap_or_default();
            let (read, found) = Stimulus::parse_with_expected(net, file, &text);
            session.show(&found);
            Ok(if any_error(&found) { None } else { read })
        }
        None => {
            let stimulus = Stimulus::random(net, random.unwrap_or(1000), seed, max_dt);
            Ok(Some((stimulus, Expected::default())))
        }
    }
}

/// The stimulus with one row for each clock of a chip; reports it if a row takes several clocks. `None` if there are too many
/// clocks; the error was then shown.
pub(super) fn clocked(session: &Session, net: &Valid<Net>, stimulus: &Stimulus) -> Option<Clocked> {
    match Clocked::of(net, stimulus) {
        Ok(clocked) => {
            if stimulus.long_rows() > 0 {
                session.note(&format!(
                    "a row with dt above 1 runs on a chip as that many clocks, each with one tick ({} of {} rows; {} clocks in total)\n",
                    stimulus.long_rows(),
                    stimulus.len(),
                    clocked.stimulus.len()
                ));
            }
            Some(clocked)
        }
        Err(finding) => {
            session.show(&[*finding]);
            None
        }
    }
}

/// The stimulus as parts that run on their own get it: one event at a time. `None` if that is not possible; the error was then shown.
pub(super) fn events(session: &Session, net: &Valid<Net>, stimulus: &Stimulus) -> Option<Events> {
    Events::of(net, stimulus).map_err(|finding| session.show(&[*finding])).ok()
}

/// Reports sets of steps of which at most one can be active (or exactly one), if the restored state violates that.
fn impossible(net: &Valid<Net>, simulator: &Simulator<'_>, file: FileId) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for component in grafsynth_verify::structural_facts(net).components {
        let name = |step: &StepId| net.steps[*step].name.text.as_str();
        let is_active = |step: &&StepId| simulator.is_active(**step);
        let active: Vec<&str> = component.steps.iter().filter(is_active).map(name).collect();
        if active.len() == 1 || active.is_empty() && !component.always {
            continue;
        }
        let all: Vec<&str> = component.steps.iter().map(name).collect();
        let least = if component.always { "exactly one" } else { "at most one" };
        let are = if active.is_empty() { "none" } else { &active.join(", ") };
        let message = format!(
            "no reaction leads to this state: in each situation, {least} of the steps {} is active, but here {are}",
            all.join(", ")
        );
        let finding = Diagnostic::warning(codes::BAD_STATE, message);
        found.push(
            finding.at(Span::new(file, 0, 0), "").help("start from reset, or save the state again"),
        );
    }
    found
}

/// Refuses options that a session cannot have.
fn check_interactive(session: &Session, arguments: &Sim) -> Result<(), Stop> {
    let wrong = |text: &str| Err(Stop::Usage(text.to_owned()));
    if arguments.engine != "ir" {
        return wrong("--interactive runs the engine `ir` only (omit --engine)");
    }
    if arguments.input.file == "-" {
        return wrong(
            "--interactive reads commands from standard input, so the chart must be a file",
        );
    }
    if session.is_for_machines() {
        return wrong(
            "--interactive supports only the message formats human and short; use --record or --trace to write the result",
        );
    }
    let files = [&arguments.record, &arguments.trace, &arguments.save];
    let mut known: Vec<&std::path::PathBuf> = Vec::new();
    for file in files.into_iter().flatten() {
        if known.contains(&file) {
            return Err(Stop::Usage(format!(
                "{} is the output of two options; give each option its own file",
                file.display()
            )));
        }
        known.push(file);
    }
    Ok(())
}

/// A session in which a person or a script drives the chart. The requested files are written at its end, all of them or none.
fn interactive(session: &mut Session, net: &Valid<Net>, arguments: &Sim) -> Result<Exit, Stop> {
    let simulator = starting(session, net, arguments)?;
    let mut stepping = Stepping::new(Stepper::new(simulator));
    stepping.run(session)?;
    let stepper = stepping.stepper();
    session.show(&stepper.simulator().notes().diagnostics(net));
    let mut files = Vec::new();
    if let Some(path) = &arguments.record {
        files.push((path.clone(), stepper.stimulus().to_csv(net).into_bytes()));
    }
    if let Some(path) = &arguments.trace {
        files.push((
            path.clone(),
            trace_text(path, &stepper.trace(), arguments, Some(net), Vec::new())?,
        ));
    }
    if let Some(path) = &arguments.save {
        files.push((path.clone(), stepper.simulator().save().into_bytes()));
    }
    if files.is_empty() {
        return Ok(Exit::Done);
    }
    products::write(session, files)
}

/// The simulator after reset, or in the state of `--restore`.
fn starting<'n>(
    session: &mut Session,
    net: &'n Valid<Net>,
    arguments: &Sim,
) -> Result<Simulator<'n>, Stop> {
    let mut simulator = Simulator::new(net);
    simulator.reset();
    if let Some(path) = &arguments.restore {
        let file = session.text(path)?;
        let text = session.sources.get(file).map(|source| source.text.clone()).unwrap_or_default();
        let restored = simulator.restore(&text).map_err(|found: Vec<Diagnostic>| {
            session.show(&found);
            Stop::Errors
        })?;
        session.show(&impossible(net, &simulator, file));
        if !session.quiet {
            for (what, names) in [
                ("limited to its range", &restored.cut),
                ("new", &restored.new),
                ("lost", &restored.lost),
            ] {
                for name in names {
                    crate::print_error(&format!("{path}: {name}: {what}\n"));
                }
            }
        }
    }
    Ok(simulator)
}

fn with_state(
    session: &mut Session,
    net: &Valid<Net>,
    stimulus: &Stimulus,
    arguments: &Sim,
) -> Result<Trace, Stop> {
    let mut simulator = starting(session, net, arguments)?;
    let mut trace = Trace::new(TraceLayout::of(net));
    trace.push(trace.layout.row(simulator.row()));
    for input in stimulus.rows() {
        let row = trace.layout.row(simulator.step(&input));
        trace.push(row);
    }
    if let Some(path) = &arguments.save {
        session.write_named(vec![(path.clone(), simulator.save().into_bytes())])?;
    }
    Ok(trace)
}
