//! `grafsynth compare FILE`: one design on all engines with one stimulus, each compared with the reference simulator.

use super::compared::{nothing_asked, reactions};
use super::sim::{choice, clocked, events, stimulus};
use crate::args::{Compare, Input};
use crate::evidence::up_to;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_driver::evidence::Evidence;
use grafsynth_driver::read::Design;
use grafsynth_driver::trust;
use grafsynth_engines::{Availability, Engine, EngineError, Job, Pace, ReferenceEngine};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid, counted};
use grafsynth_sim::{Difference, Stimulus, Trace, compare};
use grafsynth_verify::Limits;

/// Runs all engines with one stimulus.
pub(super) fn run(session: &mut Session, arguments: &Compare, input: &Input) -> Result<Exit, Stop> {
    session.begin(&input.file);
    let (design, found) = session.design(input)?;
    session.show(&found);
    let Design::Net(design) = design else {
        return Err(Stop::Input(format!(
            "{} is logic, which has only one engine: give a chart or other logic to compare it with",
            input.file
        )));
    };
    if session.demands.refuse(&found) {
        return Ok(Exit::Errors);
    }
    let net = &design.net;
    if session.is_impossible(net) {
        return Ok(Exit::Errors);
    }
    let runnable = trust::runnable(net, arguments.trust.trust_code);
    let engines = engines(session, arguments, &runnable)?;
    let any = |is_it: fn(&dyn Engine) -> bool| engines.iter().any(|(_, engine)| is_it(&**engine));
    let rows = arguments.random.or(if arguments.stimulus.is_none() { Some(1000) } else { None });
    // All engines get the same rows, so a random stimulus must be one that a chip can run too.
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Errors);
    };
    let facts = grafsynth_driver::pipeline::facts(net, &Limits::default());
    if any(|engine| engine.runs_c()) && !arguments.trust.trust_code {
        session.show(trust::left_out(net).as_slice());
    }
    let job = Job { net: &runnable, facts: &facts, stimulus: &stimulus };
    let reference = match ReferenceEngine.run(&job) {
        Ok(trace) => trace,
        Err(_) => unreachable!("the reference simulator runs every valid net"),
    };
    // An engine that runs one tick per clock is compared with a chart that is run in the same way.
    let mut others = Vec::new();
    if stimulus.long_rows() > 0 && any(|engine| engine.pace() == Pace::Clocks) {
        let Some(clocked) = clocked(session, net, &stimulus) else { return Ok(Exit::Errors) };
        others.push(Paced::new(Pace::Clocks, &runnable, clocked.stimulus, String::new()));
    }
    if any(|engine| engine.pace() == Pace::Events) {
        let Some(events) = events(session, net, &stimulus) else { return Ok(Exit::Errors) };
        let note = format!(" ({}, one at a time)", counted(events.len(), "event", "events"));
        others.push(Paced::new(Pace::Events, &runnable, events.stimulus, note));
    }
    let asked = reference.asked_reactions();
    if asked == 0 && !stimulus.is_empty() {
        return Err(nothing_asked());
    }
    if !session.quiet {
        crate::print(&format!(
            "{:<10} {}\n",
            "ir",
            counted(stimulus.len(), "reaction", "reactions")
        ));
    }
    let mut comparison = Comparison {
        session,
        arguments,
        net,
        job,
        reference: &reference,
        others: &others,
        asked,
        differences: Vec::new(),
        refusals: Vec::new(),
        n_equal: 0,
        n_skipped: 0,
    };
    let mut exit = Exit::Done;
    for (name, engine) in &engines {
        exit = exit.worse(comparison.engine(name, &**engine)?);
    }
    if exit == Exit::Done {
        comparison.sum_up(&input.file);
    }
    Ok(exit)
}

/// An engine with its name on the command line.
type NamedEngine = (String, Box<dyn Engine>);

/// The engines that the user asked for, without the reference; their names may contain a style, as in `c:switch`.
fn engines(
    session: &Session,
    arguments: &Compare,
    net: &Valid<Net>,
) -> Result<Vec<NamedEngine>, Stop> {
    if arguments.engines.is_empty() {
        let all = grafsynth_engines::all().into_iter();
        let all = all.filter(|engine| engine.name() != "ir" && engine.by_default());
        return Ok(all.map(|engine| (engine.name().to_owned(), engine)).collect());
    }
    let named = arguments.engines.iter().filter(|name| *name != "ir");
    let with = arguments.with.as_deref();
    named.map(|name| Ok((name.clone(), choice(name, with)?.engine(session, net, with)?))).collect()
}

/// The comparison of a chart on several engines.
struct Comparison<'a> {
    session: &'a Session,
    arguments: &'a Compare,
    /// The chart. `job` contains the net that runs, which lacks the C code of the chart's author unless it is trusted.
    net: &'a Valid<Net>,
    job: Job<'a>,
    reference: &'a Trace,
    /// What other engines than those that run row by row are compared with.
    others: &'a [Paced],
    /// The number of reactions that are compared.
    asked: usize,
    /// Differences that were already explained: each is explained once, with the engine that showed it first.
    differences: Vec<Known<'a>>,
    refusals: Vec<(&'a str, Vec<Diagnostic>)>,
    n_equal: usize,
    n_skipped: usize,
}

/// The stimulus as engines of one pace run it, and the trace of the reference with it.
struct Paced {
    pace: Pace,
    stimulus: Stimulus,
    trace: Trace,
    /// What a result says about the stimulus.
    note: String,
}

impl Paced {
    fn new(pace: Pace, net: &Valid<Net>, stimulus: Stimulus, note: String) -> Self {
        let trace = grafsynth_sim::run(net, &stimulus);
        Paced { pace, stimulus, trace, note }
    }
}

/// A difference that was explained.
struct Known<'a> {
    engine: &'a str,
    difference: Difference,
    /// The traces of the reference and of the engine, up to the difference.
    traces: (Trace, Trace),
    /// The files that contain them.
    files: Vec<String>,
}

impl<'a> Comparison<'a> {
    fn answer(&self, name: &str, status: Status, message: &str) -> Answer {
        Answer::new(About::Equality, name, status, message).with("reactions", self.asked)
    }

    /// Runs one engine and reports the result.
    fn engine(&mut self, name: &'a str, engine: &dyn Engine) -> Result<Exit, Stop> {
        if let Availability::Missing(tool) = engine.availability() {
            let message = format!("skipped: {tool} is not installed");
            let answer = self.answer(name, Status::NotChecked, &message);
            self.session.answer(&answer, &format!("{name:<10} {message}\n"));
            self.n_skipped += 1;
            return Ok(Exit::Done);
        }
        progress::doing(format!("running engine {name} on {}", self.net.name));
        let own = self.others.iter().find(|one| one.pace == engine.pace());
        let reference = own.map_or(self.reference, |one| &one.trace);
        let stimulus = own.map_or(self.job.stimulus, |one| &one.stimulus);
        match engine.run(&Job { stimulus, ..self.job }) {
            Ok(trace) => match compare(reference, &trace) {
                None => {
                    let note = own.map_or("", |one| one.note.as_str());
                    let message = format!("no difference{note}");
                    let answer = self.answer(name, Status::Done, &message);
                    self.session.answer(&answer, &format!("{name:<10} {message}\n"));
                    self.n_equal += 1;
                    Ok(Exit::Done)
                }
                Some(difference) => self.different(name, difference, stimulus, (reference, &trace)),
            },
            Err(EngineError::Refused(found)) => Ok(self.refused(name, found)),
            Err(EngineError::Failed(text)) => {
                let message = format!("FAILED: {text}");
                let answer = self.answer(name, Status::Refuted, &message);
                self.session.answer(&answer, &format!("{name:<10} {message}\n"));
                Ok(Exit::Errors)
            }
        }
    }

    /// The first difference in the user's terms: the reaction, the signal, both values, where the signal is declared, and the relevant part of both runs.
    fn different(
        &mut self,
        name: &'a str,
        difference: Difference,
        stimulus: &Stimulus,
        (reference, trace): (&Trace, &Trace),
    ) -> Result<Exit, Stop> {
        let Difference { row, column, left, right } = &difference;
        let traces = (up_to(*row, reference), up_to(*row, trace));
        let message =
            format!("different: scan {row}, {column}: ir has `{left}`, {name} has `{right}`");
        let answer = self
            .answer(name, Status::Refuted, &message)
            .difference(&difference)
            .witness(&stimulus.to_csv(self.net));
        let is_known =
            |known: &&Known<'_>| known.difference == difference && known.traces == traces;
        if let Some(known) = self.differences.iter().find(is_known) {
            let text = format!("{name:<10} DIFFERENT in the same way as {}\n", known.engine);
            self.session.answer(&answer.traces(known.files.clone()), &text);
            return Ok(Exit::Refuted);
        }
        let mut short = stimulus.clone();
        short.truncate(*row);
        let (ours, theirs) = (("ir", &traces.0), (name, &traces.1));
        let evidence = Evidence::of_traces(self.job.net, &short, column, ours, theirs);
        let shown =
            self.session.shown(self.arguments.trace.as_deref(), &evidence, &[ours, theirs])?;
        let text = format!(
            "{name:<10} DIFFERENT\n  scan {row}, {column}: ir has `{left}`, {name} has `{right}`\n{}{}",
            self.session.declaration(self.net, column),
            shown.text
        );
        self.session.answer(&answer.traces(shown.files.clone()), &text);
        self.differences.push(Known { engine: name, difference, traces, files: shown.files });
        Ok(Exit::Refuted)
    }

    /// Reports that an engine cannot run the chart. If the user named the engines, the findings say why.
    fn refused(&mut self, name: &'a str, found: Vec<Diagnostic>) -> Exit {
        let why = found.first().map(|finding| finding.message.clone()).unwrap_or_default();
        let more = if found.len() > 1 {
            format!(" (and {} more)", found.len() - 1)
        } else {
            String::new()
        };
        let message = format!("not run: {why}{more}");
        let is_asked = !self.arguments.engines.is_empty();
        let earlier = self.refusals.iter().find(|(_, known)| *known == found);
        let earlier = earlier.map(|(engine, _)| *engine);
        let text = match (earlier, found.first()) {
            (Some(engine), _) => format!("not run, for the same reason as {engine}"),
            (None, Some(first)) if is_asked => format!("not run: see {}{more}", first.code.id),
            (None, _) => message.clone(),
        };
        let answer = self.answer(name, Status::NotChecked, &message);
        self.session.answer(&answer, &format!("{name:<10} {text}\n"));
        self.n_skipped += 1;
        if is_asked && (earlier.is_none() || self.session.is_for_machines()) {
            self.session.show(&found);
        }
        if earlier.is_none() {
            self.refusals.push((name, found));
        }
        if is_asked { Exit::Errors } else { Exit::Done }
    }

    /// Reports that no engine differs.
    fn sum_up(&self, file: &str) {
        let skipped = match self.n_skipped {
            0 => String::new(),
            n => format!(", {n} not run"),
        };
        let message = format!(
            "no difference found in {}: {}{skipped}",
            reactions(self.asked, self.job.stimulus.len()),
            counted(self.n_equal + 1, "engine", "engines")
        );
        self.session.answer(&self.answer(file, Status::Done, &message), &format!("{message}\n"));
    }
}
