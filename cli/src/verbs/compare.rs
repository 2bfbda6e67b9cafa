//! `grafsynth compare FILE…`: all engines with one stimulus, or designs with each other.

use super::{compare_c, compare_charts, compare_engines, compare_logic};
use crate::args::{Compare, Input, Reading};
use crate::evidence;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop, charts_below};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_driver::judge::Renames;
use grafsynth_driver::languages::Language;
use grafsynth_driver::read::Design;
use grafsynth_ir::Gather;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub(crate) fn run(session: &mut Session, arguments: &Compare) -> Result<Exit, Stop> {
    evidence::check_name(arguments.trace.as_deref())?;
    let exit = all(session, arguments)?;
    session.no_trace(arguments.trace.as_deref());
    Ok(exit)
}

fn all(session: &mut Session, arguments: &Compare) -> Result<Exit, Stop> {
    let renames = Renames::parse(&arguments.rename).map_err(|text| {
        Stop::Usage(format!("`{text}` is not a pair of names: write --rename LOGIC=NAME"))
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
            [one] => compare_engines::run(session, arguments, one),
            all => session.each(all, |session, one| compare_engines::run(session, arguments, one)),
        };
    }
    if let Some(folder) = files.iter().find(|file| files::is_folder(file)) {
        return Err(Stop::Usage(format!(
            "{folder} is a folder, which can be compared only with one other folder"
        )));
    }
    let [first, others @ ..] = files.as_slice() else { return Ok(Exit::Usage) };
    if let [other] = others {
        return pair(session, arguments, &input(first), other, &renames, true);
    }
    let others: Vec<Input> = others.iter().map(|file| input(file)).collect();
    // People see the findings about the first design once.
    let mut is_new = true;
    session.each(&others, |session, other| {
        let is_new = std::mem::take(&mut is_new);
        pair(session, arguments, &input(first), &other.file, &renames, is_new)
    })
}

/// Compares the charts with the same name in two folders, and reports files that only one folder has.
fn folders(session: &Session, arguments: &Compare, renames: &Renames) -> Result<Exit, Stop> {
    let [first, second] = arguments.inputs.files.as_slice() else { return Ok(Exit::Usage) };
    let name = |folder: &str, path: &str| {
        Path::new(path).strip_prefix(folder).unwrap_or(Path::new(path)).to_path_buf()
    };
    let names = |folder: &String| -> Result<BTreeSet<PathBuf>, Stop> {
        Ok(charts_below(folder)?.iter().map(|path| name(folder, path)).gather())
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
        pair(session, arguments, input, &other.to_string_lossy(), renames, true)
    })?;
    Ok(exit.worse(compared))
}

/// How the second design is read: like the first, except for options that apply only to the first.
fn of_second(first: &Reading, path: &str) -> Reading {
    Reading {
        from: first.from.clone().filter(|_| Language::of(path, "").is_none()),
        assert: Vec::new(),
        board: None,
        ..first.clone()
    }
}

/// Compares two designs in the columns that both have: by a test, by a proof for every stimulus, or by both.
/// `is_new`: the findings about the first design were not shown yet.
fn pair(
    session: &mut Session,
    arguments: &Compare,
    input: &Input,
    other: &str,
    renames: &Renames,
    is_new: bool,
) -> Result<Exit, Stop> {
    if let Some(emitted) = compare_c::recognised(session, arguments, other)? {
        return compare_c::run(session, arguments, input, &emitted);
    }
    if let Some(emitted) = compare_c::recognised(session, arguments, &input.file)? {
        let chart = Input { file: other.to_owned(), reading: input.reading.clone() };
        return compare_c::run(session, arguments, &chart, &emitted);
    }
    if let Some(map) = &arguments.map {
        let both = format!("{} and {other}", input.file);
        return Err(Stop::Usage(format!("--map {map} has no effect on {both}: neither is C")));
    }
    session.begin(&input.file);
    let (design, found) = session.design(input)?;
    if is_new || session.is_for_machines() {
        session.show(&found);
    }
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
        (Design::Logic(logic), Design::Net(net)) => (Design::Net(net), logic),
        (design, Design::Logic(logic)) => (design, logic),
        (Design::Net(_), Design::Net(_)) => unreachable!("two charts were compared above"),
    };
    compare_logic::run(session, arguments, &subject, &design, *other, renames)
}
