//! `grafsynth compare FILE…`: all engines with one stimulus, or designs with each other.

use super::compare_charts::{self, cells};
use super::sim::{clocked, engine_named, stimulus};
use crate::args::{Compare, Input, Reading};
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop, charts_below};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_driver::compare::{Apart, Outcome as Compared};
use grafsynth_driver::format::Format;
use grafsynth_driver::judge::{self, Judged, Renames};
use grafsynth_driver::read::Design;
use grafsynth_driver::trust;
use grafsynth_engines::{Availability, Engine, EngineError, Job, ReferenceEngine};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid, counted};
use grafsynth_sim::{Clocked, Difference, Stimulus, Trace, compare};
use grafsynth_verify::{Limits, Scope, Tested, Verdict, verdict};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub(crate) fn run(session: &mut Session, arguments: &Compare) -> Result<Exit, Stop> {
    let renames = Renames::parse(&arguments.rename).map_err(|text| {
        Stop::Usage(format!("`{text}` is not a pair of names: write --rename OTHER=NAME"))
    })?;
    let files = &arguments.inputs.files;
    let reading = &arguments.inputs.reading;
    let input = |file: &str| Input { file: file.to_owned(), reading: reading.clone() };
    if let [folder, other] = files.as_slice()
        && files::is_folder(folder)
        && files::is_folder(other)
    {
        return folders(session, arguments, &renames);
    }
    if files.len() == 1 {
        let inputs = session.inputs(&arguments.inputs)?;
        return match inputs.as_slice() {
            [one] => engines(session, arguments, one),
            all => session.each(all, |session, one| engines(session, arguments, one)),
        };
    }
    if let Some(folder) = files.iter().find(|file| files::is_folder(file)) {
        return Err(Stop::Usage(format!(
            "{folder} is a folder, which can be compared only with one other folder"
        )));
    }
    let [first, others @ ..] = files.as_slice() else { return Ok(Exit::Usage) };
    if let [other] = others {
        return pair(session, arguments, &input(first), other, &renames);
    }
    let others: Vec<Input> = others.iter().map(|file| input(file)).collect();
    session.each(&others, |session, other| {
        pair(session, arguments, &input(first), &other.file, &renames)
    })
}

/// Compares the charts with the same name in two folders, and reports files that only one folder has.
fn folders(session: &Session, arguments: &Compare, renames: &Renames) -> Result<Exit, Stop> {
    let [first, second] = arguments.inputs.files.as_slice() else { return Ok(Exit::Usage) };
    let name = |folder: &str, path: &str| {
        Path::new(path).strip_prefix(folder).unwrap_or(Path::new(path)).to_path_buf()
    };
    let names = |folder: &String| -> Result<BTreeSet<PathBuf>, Stop> {
        Ok(charts_below(folder)?.iter().map(|path| name(folder, path)).collect())
    };
    let (ours, theirs) = (names(first)?, names(second)?);
    let mut exit = Exit::Done;
    for name in ours.symmetric_difference(&theirs) {
        let folder = if ours.contains(name) { first } else { second };
        let subject = name.display().to_string();
        let message = format!("only in {folder}");
        let answer = Answer::new(About::Part, subject.as_str(), Status::Refuted, message.as_str());
        session.answer(&answer, &format!("{subject}: {message}\n"));
        exit = Exit::Refuted;
    }
    let both: Vec<Input> = ours
        .intersection(&theirs)
        .map(|name| Input {
            file: Path::new(first).join(name).to_string_lossy().into_owned(),
            reading: arguments.inputs.reading.clone(),
        })
        .collect();
    let compared = session.each(&both, |session, input| {
        let other = Path::new(second).join(name(first, &input.file));
        pair(session, arguments, input, &other.to_string_lossy(), renames)
    })?;
    Ok(exit.worse(compared))
}

/// Runs all engines with one stimulus.
fn engines(session: &mut Session, arguments: &Compare, input: &Input) -> Result<Exit, Stop> {
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
    // All engines get the same rows, so a random stimulus must be one that a chip can run too.
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Errors);
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
    // An engine that runs one tick per clock is compared with a chart that is run in the same way.
    let clocked = if stimulus.long_rows() > 0 && engines.iter().any(|engine| engine.is_chip()) {
        let Some(clocked) = clocked(session, net, &stimulus) else { return Ok(Exit::Errors) };
        let trace = grafsynth_sim::run(&runnable, &clocked.stimulus);
        Some((clocked, trace))
    } else {
        None
    };
    let asked = reference.asked_reactions();
    if asked == 0 && !stimulus.is_empty() {
        return Err(nothing_asked());
    }
    let answer = |name: &str, status, message: &str| {
        Answer::new(About::Equality, name, status, message).with("reactions", asked)
    };
    let say = |line: String| {
        if !session.quiet {
            crate::print(&line);
        }
    };
    say(format!("{:<10} {}\n", "ir", counted(stimulus.len(), "reaction", "reactions")));
    let (mut n_equal, mut n_skipped, mut exit) = (0, 0, Exit::Done);
    for engine in &engines {
        let name = engine.name();
        if let Availability::Missing(tool) = engine.availability() {
            let message = format!("skipped: {tool} is not installed");
            session.answer(
                &answer(name, Status::NotChecked, &message),
                &format!("{name:<10} {message}\n"),
            );
            n_skipped += 1;
            continue;
        }
        progress::doing(format!("running engine {name} on {}", net.name));
        let by_clocks = clocked.as_ref().filter(|_| engine.is_chip());
        let reference = by_clocks.map_or(&reference, |(_, trace)| trace);
        let stimulus = by_clocks.map_or(&stimulus, |(clocked, _)| &clocked.stimulus);
        match engine.run(&Job { stimulus, ..job }) {
            Ok(trace) => match compare(reference, &trace) {
                None => {
                    let message = "no difference";
                    session.answer(
                        &answer(name, Status::Done, message),
                        &format!("{name:<10} {message}\n"),
                    );
                    n_equal += 1;
                }
                Some(difference) => {
                    let Difference { row, column, left, right } = &difference;
                    let message = format!(
                        "different: scan {row}, {column}: ir has `{left}`, {name} has `{right}`"
                    );
                    let text = explain(session, net, &difference, reference, name);
                    session.answer(
                        &answer(name, Status::Refuted, &message)
                            .difference(&difference)
                            .witness(&stimulus.to_csv(net)),
                        &format!("{name:<10} DIFFERENT\n{text}"),
                    );
                    exit = exit.worse(Exit::Refuted);
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
                let message = format!("not run: {why}{more}");
                session.answer(
                    &answer(name, Status::NotChecked, &message),
                    &format!("{name:<10} {message}\n"),
                );
                n_skipped += 1;
                if !arguments.engines.is_empty() {
                    session.show(&found);
                    exit = exit.worse(Exit::Errors);
                }
            }
            Err(EngineError::Failed(text)) => {
                let message = format!("FAILED: {text}");
                session.answer(
                    &answer(name, Status::Refuted, &message),
                    &format!("{name:<10} {message}\n"),
                );
                exit = exit.worse(Exit::Errors);
            }
        }
    }
    if exit == Exit::Done {
        let skipped = if n_skipped > 0 { format!(", {n_skipped} not run") } else { String::new() };
        let message = format!(
            "no difference found in {}: {}{skipped}",
            reactions(asked, stimulus.len()),
            counted(n_equal + 1, "engine", "engines")
        );
        session.answer(&answer(&input.file, Status::Done, &message), &format!("{message}\n"));
    }
    Ok(exit)
}

/// How many reactions were compared, out of how many.
fn reactions(asked: usize, total: usize) -> String {
    let all = counted(total, "reaction", "reactions");
    if asked == total {
        return all;
    }
    format!("{asked} of {all} (the others follow a violated assumption)")
}

/// The error if every row of a stimulus follows a violated assumption, so nothing was compared.
fn nothing_asked() -> Stop {
    Stop::Input("each row follows a violated assumption, so there is nothing to compare".to_owned())
}

/// The first difference in the user's terms: the reaction, the signal, both values, and where the signal is declared.
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
        text.push_str(&format!("  trace of ir up to this row:\n    {header}\n"));
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

/// How the second design is read: like the first, except for options that apply only to the first.
fn of_second(first: &Reading, path: &str) -> Reading {
    Reading {
        from: first.from.clone().filter(|_| Format::of(path, "").is_none()),
        assert: Vec::new(),
        board: None,
        ..first.clone()
    }
}

/// Compares two designs: the common columns of both traces must be equal. If one is logic, this is then proved for every stimulus.
fn pair(
    session: &mut Session,
    arguments: &Compare,
    input: &Input,
    other: &str,
    renames: &Renames,
) -> Result<Exit, Stop> {
    session.begin(&input.file);
    let (design, found) = session.design(input)?;
    session.show(&found);
    let second = Input { file: other.to_owned(), reading: of_second(&input.reading, other) };
    let (other, also) = session.design(&second)?;
    session.show(&also);
    if session.demands.refuse(&found) || session.demands.refuse(&also) {
        return Ok(Exit::Errors);
    }
    for design in [&design, &other] {
        if let Design::Logic(logic) = design {
            session.show(&logic.beyond);
            if logic.logic.is_none() {
                return Err(Stop::Errors);
            }
        }
    }
    let subject = format!("{} and {}", input.file, second.file);
    progress::doing(format!("comparing {subject}"));
    if let (Design::Net(left), Design::Net(right)) = (&design, &other) {
        return compare_charts::run(session, arguments, &subject, &left.net, &right.net);
    }
    // A chart comes first, so that a proof is about a chart if there is one.
    let (design, other) = match (design, other) {
        (Design::Logic(logic), Design::Net(net)) => (Design::Net(net), Design::Logic(logic)),
        pair => pair,
    };
    let other = match (&design, other) {
        (Design::Logic(first), Design::Logic(mut second)) => {
            if let Some(circuit) = grafsynth_driver::pin_numbers::by_number(first, &second) {
                session.note(
                    "pins are compared by number because a fuse map does not name its pins\n",
                );
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
    if session.is_impossible(net) {
        return Ok(Exit::Errors);
    }
    let rows = arguments.random.or(if arguments.stimulus.is_none() { Some(10_000) } else { None });
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Errors);
    };
    let Some(Clocked { stimulus, .. }) = clocked(session, net, &stimulus) else {
        return Ok(Exit::Errors);
    };
    let tested = match (&design, &other) {
        (Design::Net(_), Design::Net(_)) => unreachable!("charts are compared elsewhere"),
        (Design::Net(design), Design::Logic(other)) => other
            .circuit()
            .and_then(|circuit| judge::with_net(&design.net, circuit, &stimulus, renames)),
        (Design::Logic(design), Design::Logic(other)) => other
            .circuit()
            .and_then(|circuit| judge::with_logic(design, circuit, &stimulus, renames)),
        (Design::Logic(_), Design::Net(_)) => unreachable!("the chart was put first"),
    };
    let tested = match tested {
        Ok(tested) => tested,
        Err(found) => {
            session.show(&found);
            return Ok(Exit::Errors);
        }
    };
    let is_test = arguments.no_proof || arguments.stimulus.is_some() || arguments.random.is_some();
    let asked = grafsynth_sim::run(net, &stimulus).asked_reactions();
    if asked == 0 && !stimulus.is_empty() {
        return Err(nothing_asked());
    }
    let exit = after_a_test(session, &subject, net, &stimulus, asked, &tested, is_test);
    if exit != Exit::Done || is_test {
        return Ok(exit);
    }
    let Design::Logic(other) = &other else { return Ok(exit) };
    let Ok(circuit) = other.circuit() else { return Ok(exit) };
    prove(session, &subject, &design, circuit, renames, &tested, stimulus.len())
}

/// How two designs were proved equal, also in words; or the answer that they differ, and its text for people.
type Proven = verdict::Verdict<(Proof, String), Box<(Answer, String)>>;

/// The proof for every stimulus, after some were tried.
fn prove(
    session: &Session,
    subject: &str,
    design: &Design,
    circuit: &Logic,
    renames: &Renames,
    tested: &Compared,
    reactions: usize,
) -> Result<Exit, Stop> {
    let limits = Limits::default();
    let answer = |status, message: &str| with_parts(subject, status, message, tested);
    let judged: Result<Proven, _> = match design {
        Design::Net(design) => {
            judge::prove_with_net(&design.net, circuit, renames, &limits).map(|verdict| {
                match verdict {
                    Verdict::Proved(certificate) => {
                        verdict::Verdict::Proved((certificate.proof(), certificate.to_string()))
                    }
                    Verdict::Refuted(found) => {
                        let message = cells(&found.difference, "first", "second");
                        let witness = found.stimulus.to_csv(&design.net);
                        let answer = answer(Status::Refuted, &message)
                            .difference(&found.difference)
                            .witness(&witness);
                        let rows: String =
                            witness.lines().map(|line| format!("  {line}\n")).collect();
                        let text = format!("different: {message}\n{rows}");
                        verdict::Verdict::Refuted(Box::new((answer, text)))
                    }
                    Verdict::Open(why) => verdict::Verdict::Open(why),
                }
            })
        }
        Design::Logic(design) => {
            judge::prove_with_logic(design, circuit, renames, &limits).map(|judged| match judged {
                Judged::Equal(by) => verdict::Verdict::Proved((by.proof(), by.to_string())),
                Judged::Different(apart) => {
                    let answer = answer(Status::Refuted, &apart.to_string())
                        .with("row", apart.clocks())
                        .with("column", apart.output.as_str())
                        .witness(&apart.to_csv());
                    verdict::Verdict::Refuted(Box::new((answer, format!("different: {apart}\n"))))
                }
                Judged::Open(why) => verdict::Verdict::Open(why),
            })
        }
    };
    // A clock is one tick; a circuit has no other reaction.
    let scope = Scope::OneTick;
    Ok(match judged {
        Err(found) => {
            session.show(&found);
            Exit::Errors
        }
        Ok(verdict::Verdict::Proved((by, how))) => {
            let answer = answer(Status::Proved, &how).proved_by(by, &scope);
            session.answer(&answer, &format!("equal: {how}\n"));
            Exit::Done
        }
        Ok(verdict::Verdict::Refuted(found)) => {
            let (answer, text) = *found;
            session.answer(&answer, &text);
            Exit::Refuted
        }
        Ok(verdict::Verdict::Open(mut why)) => {
            let text = format!("open: not proved equal: {why}\n");
            // The run before the proof is also a test.
            why.tested
                .get_or_insert_with(|| Tested { reactions: reactions as u64, ..Tested::default() });
            session.answer(&answer(Status::Open, &why.to_string()).open(&why), &text);
            session.demands.open(&why)
        }
    })
}

/// An answer about two designs with the compared columns.
fn with_parts(subject: &str, status: Status, message: &str, compared: &Compared) -> Answer {
    let answer =
        Answer::new(About::Equality, subject, status, message).with("columns", compared.n_columns);
    let apart: Vec<String> = compared.apart.parts().collect();
    if apart.is_empty() { answer } else { answer.with("not_compared", apart) }
}

/// Reports the result of a test. If a proof follows, machines get only its answer.
fn after_a_test(
    session: &Session,
    subject: &str,
    net: &Valid<Net>,
    stimulus: &Stimulus,
    asked: usize,
    outcome: &Compared,
    is_test: bool,
) -> Exit {
    let answer = |status, message: &str| {
        with_parts(subject, status, message, outcome).with("reactions", asked)
    };
    match &outcome.difference {
        None => {
            let mut text = format!(
                "no difference found in {}, {} in common\n",
                reactions(asked, stimulus.len()),
                counted(outcome.n_columns, "column", "columns")
            );
            let answer = answer(Status::Done, text.trim_end());
            if outcome.apart != Apart::default() {
                text += &format!("not compared: {}\n", outcome.apart);
            }
            if is_test {
                session.answer(&answer, &text);
            } else if !session.quiet {
                crate::print(&text);
            }
            Exit::Done
        }
        Some(difference) => {
            let message = cells(difference, "first", "second");
            let answer = answer(Status::Refuted, &message)
                .difference(difference)
                .witness(&stimulus.to_csv(net));
            session.answer(&answer, &format!("different: {message}\n"));
            Exit::Refuted
        }
    }
}
