//! `grafsynth compare FILE`: all engines on one stimulus, and the first difference.

use super::sim::{engine_named, stimulus};
use crate::args::Compare;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::read::Design;
use grafsynth_engines::{Availability, Engine, EngineError, Job, ReferenceEngine};
use grafsynth_ir::Span;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Difference, Stimulus, Trace, compare};
use grafsynth_verify::Limits;

pub(crate) fn run(session: &mut Session, arguments: &Compare) -> Result<Exit, Stop> {
    let (design, found) = session.net(&arguments.input)?;
    session.show(&found);
    let net = &design.net;
    if let Some(other) = &arguments.other {
        return with_other(session, arguments, net, other);
    }
    let engines: Vec<Box<dyn Engine>> = if arguments.engines.is_empty() {
        grafsynth_engines::all().into_iter().filter(|engine| engine.name() != "ir").collect()
    } else {
        arguments
            .engines
            .iter()
            .filter(|name| *name != "ir")
            .map(|name| engine_named(name))
            .collect::<Result<_, _>>()?
    };
    let rows = arguments.random.or(if arguments.stimulus.is_none() { Some(1000) } else { None });
    // All engines see the same rows, so a random stimulus is one that a chip can run too.
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Usage);
    };
    let facts = grafsynth_driver::pipeline::facts(net, &Limits::default());
    let job = Job { net, facts: &facts, stimulus: &stimulus };
    let reference = match ReferenceEngine.run(&job) {
        Ok(trace) => trace,
        Err(_) => unreachable!("the reference simulator runs every valid net"),
    };
    let say = |line: String| {
        if !session.quiet {
            crate::print(&line);
        }
    };
    say(format!("{:<10} {} reactions\n", "ir", stimulus.len()));
    let (mut n_equal, mut n_skipped, mut exit) = (0, 0, Exit::Done);
    for engine in &engines {
        let name = engine.name();
        if let Availability::Missing(tool) = engine.availability() {
            say(format!("{name:<10} skipped: {tool} is not here\n"));
            n_skipped += 1;
            continue;
        }
        match engine.run(&job) {
            Ok(trace) => match compare(&reference, &trace) {
                None => {
                    say(format!("{name:<10} equal\n"));
                    n_equal += 1;
                }
                Some(difference) => {
                    crate::print(&format!(
                        "{name:<10} DIFFERENT\n{}",
                        explain(session, net, &difference, &reference, name)
                    ));
                    exit = Exit::Refuted;
                }
            },
            Err(EngineError::Refused(found)) => {
                let why =
                    found.first().map(|diagnostic| diagnostic.message.clone()).unwrap_or_default();
                let more = if found.len() > 1 {
                    format!(" (and {} more)", found.len() - 1)
                } else {
                    String::new()
                };
                say(format!("{name:<10} cannot: {why}{more}\n"));
                n_skipped += 1;
                if !arguments.engines.is_empty() {
                    session.show(&found);
                    exit = exit.max(Exit::Usage);
                }
            }
            Err(EngineError::Failed(text)) => {
                crate::print(&format!("{name:<10} FAILED: {text}\n"));
                exit = Exit::Refuted;
            }
        }
    }
    if exit == Exit::Done {
        let skipped = if n_skipped > 0 { format!(", {n_skipped} not run") } else { String::new() };
        say(format!("equal: {} engines, {} reactions{skipped}\n", n_equal + 1, stimulus.len()));
    }
    Ok(exit)
}

/// The first difference in the user's terms: the reaction, the signal, both values, and where the signal comes from.
fn explain(
    session: &Session,
    net: &Net,
    difference: &Difference,
    reference: &Trace,
    engine: &str,
) -> String {
    let Difference { row, column, left, right } = difference;
    let mut text = format!("  scan {row}, {column}: ir has `{left}`, {engine} has `{right}`\n");
    if let Some(place) = declared(net, column)
        .map(|span| session.sources.describe(span))
        .filter(|place| !place.is_empty())
    {
        text.push_str(&format!("  {column} is declared at {place}\n"));
    }
    let csv = reference.to_csv();
    let mut lines = csv.lines();
    if let Some(header) = lines.next() {
        text.push_str(&format!("  ir, the rows up to it:\n    {header}\n"));
        let from = row.saturating_sub(2);
        for line in lines.skip(from).take(row - from + 1) {
            text.push_str(&format!("    {line}\n"));
        }
    }
    text
}

fn declared(net: &Net, column: &str) -> Option<Span> {
    let plain = column.split('[').next().unwrap_or(column);
    let outputs = net.outputs.values().map(|output| (&output.name.text, output.meta.span));
    let vars = net.vars.values().map(|var| (&var.name.text, var.meta.span));
    outputs.chain(vars).find(|(name, _)| *name == plain).map(|(_, span)| span)
}

/// A chart against another design: the columns that both traces have must be equal.
fn with_other(
    session: &mut Session,
    arguments: &Compare,
    net: &grafsynth_ir::Valid<Net>,
    other: &str,
) -> Result<Exit, Stop> {
    let input = crate::args::Input {
        file: other.to_owned(),
        from: None,
        assert: Vec::new(),
        board: None,
        c: crate::args::COptions::default(),
    };
    let (design, found) = session.design(&input)?;
    session.show(&found);
    let rows = arguments.random.or(if arguments.stimulus.is_none() { Some(10_000) } else { None });
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Usage);
    };
    let difference = match design {
        Design::Net(other) => grafsynth_driver::compare::nets(net, &other.net, &stimulus),
        Design::Logic(logic) => grafsynth_driver::compare::with_logic(net, &logic, &stimulus),
    };
    finish(session, &stimulus, difference)
}

fn finish(
    session: &Session,
    stimulus: &Stimulus,
    difference: Result<grafsynth_driver::compare::Outcome, Vec<grafsynth_ir::Diagnostic>>,
) -> Result<Exit, Stop> {
    match difference {
        Err(found) => {
            session.show(&found);
            Ok(Exit::Usage)
        }
        Ok(outcome) => match outcome.difference {
            None => {
                if !session.quiet {
                    crate::print(&format!(
                        "equal: {} reactions, {} columns in common\n",
                        stimulus.len(),
                        outcome.n_columns
                    ));
                }
                Ok(Exit::Done)
            }
            Some(Difference { row, column, left, right }) => {
                crate::print(&format!(
                    "different: scan {row}, {column}: `{left}` in the first, `{right}` in the second\n"
                ));
                Ok(Exit::Refuted)
            }
        },
    }
}
