//! `grafsynth compare FILE`: all engines on one stimulus, and the first difference.

use super::compare_charts;
use super::sim::{engine_named, stimulus};
use crate::args::{Compare, Input};
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::compare::Apart;
use grafsynth_driver::judge::{self, Judged, Renames};
use grafsynth_driver::read::Design;
use grafsynth_driver::trust;
use grafsynth_engines::{Availability, Engine, EngineError, Job, ReferenceEngine};
use grafsynth_ir::Span;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Difference, Stimulus, Trace, compare};
use grafsynth_verify::{Limits, Verdict, verdict};

pub(crate) fn run(session: &mut Session, arguments: &Compare) -> Result<Exit, Stop> {
    let renames = Renames::parse(&arguments.rename).map_err(|text| {
        Stop::Usage(format!("`{text}` is no pair of names: write --rename OTHER=NAME"))
    })?;
    let (design, found) = session.design(&arguments.input)?;
    session.show(&found);
    if let Some(other) = &arguments.other {
        return with_other(session, arguments, design, other, &renames);
    }
    let Design::Net(design) = design else {
        return Err(Stop::Usage(format!(
            "{} is logic, which no engine but its own simulation runs: name a chart or other logic to compare it with",
            arguments.input.file
        )));
    };
    let net = &design.net;
    let engines: Vec<Box<dyn Engine>> = if arguments.engines.is_empty() {
        grafsynth_engines::all()
            .into_iter()
            .filter(|engine| engine.name() != "ir" && engine.by_default())
            .collect()
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
    let runnable = super::build::runnable(net, arguments.trust);
    if engines.iter().any(|engine| engine.runs_c()) && !arguments.trust.trust_code {
        session.show(trust::left_out(net).as_slice());
    }
    let job = Job { net: &runnable, facts: &facts, stimulus: &stimulus };
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
                    say(format!("{name:<10} no difference\n"));
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
        say(format!(
            "no difference found in {} reactions: {} engines{skipped}\n",
            stimulus.len(),
            n_equal + 1
        ));
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

/// Two designs: the columns that both traces have must be equal. Where one is logic, it is then proved for every stimulus.
fn with_other(
    session: &mut Session,
    arguments: &Compare,
    design: Design,
    other: &str,
    renames: &Renames,
) -> Result<Exit, Stop> {
    let mut input = Input::plain(other);
    input.reading.machine = arguments.input.reading.machine;
    let (other, found) = session.design(&input)?;
    session.show(&found);
    for design in [&design, &other] {
        if let Design::Logic(logic) = design {
            session.show(&logic.beyond);
            if logic.logic.is_none() {
                return Err(Stop::Errors);
            }
        }
    }
    if let (Design::Net(left), Design::Net(right)) = (&design, &other) {
        return compare_charts::run(session, arguments, &left.net, &right.net);
    }
    // A chart comes first, so that a proof is one about a chart wherever there is one.
    let (design, other) = match (design, other) {
        (Design::Logic(logic), Design::Net(net)) => (Design::Net(net), Design::Logic(logic)),
        pair => pair,
    };
    let other = match (&design, other) {
        (Design::Logic(first), Design::Logic(mut second)) => {
            if let Some(circuit) = grafsynth_driver::pin_numbers::by_number(first, &second) {
                session.note("pins are compared by number, for a fuse map does not name its own\n");
                second.logic = Some(circuit);
            }
            Design::Logic(second)
        }
        (_, other) => other,
    };
    let net = match &design {
        Design::Net(design) => &design.net,
        Design::Logic(design) => &design.interface,
    };
    let rows = arguments.random.or(if arguments.stimulus.is_none() { Some(10_000) } else { None });
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Usage);
    };
    let difference = match (&design, &other) {
        (Design::Net(_), Design::Net(_)) => unreachable!("charts have an answer of their own"),
        (Design::Net(design), Design::Logic(other)) => other
            .circuit()
            .and_then(|circuit| judge::with_net(&design.net, circuit, &stimulus, renames)),
        (Design::Logic(design), Design::Logic(other)) => other
            .circuit()
            .and_then(|circuit| judge::with_logic(design, circuit, &stimulus, renames)),
        (Design::Logic(_), Design::Net(_)) => unreachable!("the chart was put first"),
    };
    let is_equal = difference.as_ref().is_ok_and(|outcome| outcome.difference.is_none());
    let exit = finish(session, &stimulus, difference)?;
    let Design::Logic(other) = &other else { return Ok(exit) };
    let is_test = arguments.no_proof || arguments.stimulus.is_some() || arguments.random.is_some();
    if !is_equal || is_test {
        return Ok(exit);
    }
    let Ok(circuit) = other.circuit() else { return Ok(exit) };
    prove(session, &design, circuit, renames)
}

/// The proof for every stimulus, after some were tried.
fn prove(
    session: &Session,
    design: &Design,
    circuit: &Logic,
    renames: &Renames,
) -> Result<Exit, Stop> {
    let limits = Limits::default();
    let judged: Result<verdict::Verdict<String, String>, _> =
        match design {
            Design::Net(design) => judge::prove_with_net(&design.net, circuit, renames, &limits)
                .map(|verdict| match verdict {
                    Verdict::Proved(certificate) => {
                        verdict::Verdict::Proved(certificate.to_string())
                    }
                    Verdict::Refuted(found) => {
                        let Difference { row, column, left, right } = &found.difference;
                        let mut text = format!(
                            "scan {row}, {column}: `{left}` in the first, `{right}` in the second"
                        );
                        for line in found.stimulus.to_csv(&design.net).lines() {
                            text += &format!("\n  {line}");
                        }
                        verdict::Verdict::Refuted(text)
                    }
                    Verdict::Open(why) => verdict::Verdict::Open(why),
                }),
            Design::Logic(design) => judge::prove_with_logic(design, circuit, renames, &limits)
                .map(|judged| match judged {
                    Judged::Equal(by) => verdict::Verdict::Proved(by.to_string()),
                    Judged::Different(how) => verdict::Verdict::Refuted(how),
                    Judged::Open(why) => verdict::Verdict::Open(why),
                }),
        };
    match judged {
        Err(found) => {
            session.show(&found);
            Ok(Exit::Usage)
        }
        Ok(verdict::Verdict::Proved(how)) => {
            if !session.quiet {
                crate::print(&format!("equal: {how}\n"));
            }
            Ok(Exit::Done)
        }
        Ok(verdict::Verdict::Refuted(how)) => {
            crate::print(&format!("different: {how}\n"));
            Ok(Exit::Refuted)
        }
        Ok(verdict::Verdict::Open(why)) => {
            if !session.quiet {
                crate::print(&format!("open: not proved equal: {why}\n"));
            }
            Ok(Exit::Open)
        }
    }
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
                        "no difference found in {} reactions, {} columns in common\n",
                        stimulus.len(),
                        outcome.n_columns
                    ));
                    if outcome.apart != Apart::default() {
                        crate::print(&format!("not compared: {}\n", outcome.apart));
                    }
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
