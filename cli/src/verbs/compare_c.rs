//! `grafsynth compare CHART NAME.c`: a chart and the C that `build` emitted from it, after somebody edited the C.

use super::build_results::report;
use crate::args::{Compare, Input};
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use crate::progress;
use grafsynth_backend_c::is_engine_file;
use grafsynth_driver::c_proof::tables_of;
use grafsynth_driver::edited_c::{self, CMap, CText, EditedC};
use grafsynth_driver::pipeline;
use grafsynth_driver::read::Design;
use grafsynth_driver::report::{Note, OutputReport, OutputVerdict};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::exhaustive::{self, Text};
use grafsynth_ir::Gather;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Span, Valid};
use grafsynth_verify::c_code::{Induction, functions_of};
use grafsynth_verify::{Limits, Open, OpenReason};
use std::collections::BTreeSet;
use std::path::Path;

/// The maximum number of files that the C includes.
const MOST_FILES: usize = 100;

/// C that `build` emitted, with its map.
pub(super) struct Emitted {
    path: String,
    texts: Vec<CText>,
    map: Option<CMap>,
    /// The path of the map.
    map_path: String,
}

/// Reads a file if it is C that `build` emitted: it has a map, or it defines `NAME_init` and `NAME_step`. `None` if it is something else.
pub(super) fn recognised(
    session: &mut Session,
    arguments: &Compare,
    path: &str,
) -> Result<Option<Emitted>, Stop> {
    let is_c = Path::new(path).extension().is_some_and(|it| it.eq_ignore_ascii_case("c"));
    if !is_c {
        return Ok(None);
    }
    is_c_of_chart(path)?;
    let beside = files::companion(path, "map.json").filter(|beside| !files::is_link(beside));
    let map_path = arguments.map.clone().or(beside);
    let map = match map_path.clone() {
        None => None,
        Some(path) => {
            let file = session.text(&path)?;
            let text = session.sources.get(file).map_or("", |source| source.text.as_str());
            let wrong = |why| Stop::Input(format!("{path} is not a map of emitted C: {why}"));
            Some(CMap::parse(text).map_err(wrong)?)
        }
    };
    let texts = texts(session, path)?;
    let is_it = map.is_some() || edited_c::is_emitted(&texts);
    Ok(is_it.then(|| Emitted {
        path: path.to_owned(),
        texts,
        map,
        map_path: map_path.unwrap_or_default(),
    }))
}

/// An error for another file of emitted C than the one with the functions of the chart.
fn is_c_of_chart(path: &str) -> Result<(), Stop> {
    let name = Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned());
    let name = name.unwrap_or_default();
    if is_engine_file(&name) {
        return Err(Stop::Input(format!(
            "{path} is the engine, which is the same for all charts: give the C of the chart, which is beside it"
        )));
    }
    let Some(stem) = name.strip_suffix("_tables.c") else { return Ok(()) };
    let chart = files::folder_of(Path::new(path)).join(format!("{stem}.c"));
    match files::exists(&chart) {
        true => Err(Stop::Input(format!(
            "{path} has the tables of {}: give that file",
            chart.display()
        ))),
        false => Ok(()),
    }
}

/// The C file, and the files in its folder that it includes.
fn texts(session: &mut Session, path: &str) -> Result<Vec<CText>, Stop> {
    let folder = files::folder_of(Path::new(path)).to_path_buf();
    let main = Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned());
    let mut all = vec![read(session, path, main.unwrap_or_default())?];
    let mut known: BTreeSet<String> = all.iter().map(|it| it.name.clone()).gather();
    let mut at = 0;
    while let Some(text) = all.get(at) {
        for name in edited_c::included(&text.text) {
            let file = folder.join(&name);
            let is_plain = !name.contains(['/', '\\']) && !files::is_link(&file.to_string_lossy());
            let is_there = is_plain && files::exists(&file);
            if is_there && known.len() < MOST_FILES && known.insert(name.clone()) {
                all.push(read(session, &file.to_string_lossy(), name)?);
            }
        }
        at += 1;
    }
    // The tables that an engine interprets are a text of their own, which nothing includes.
    if let (Some(_), Some(stem)) = (edited_c::style_of_engine(&all), FileStem::of_path(path)) {
        let name = tables_of(stem.as_str());
        let file = folder.join(&name).to_string_lossy().into_owned();
        if !files::is_link(&file) && files::exists(Path::new(&file)) {
            all.push(read(session, &file, name)?);
        }
    }
    Ok(all)
}

fn read(session: &mut Session, path: &str, name: String) -> Result<CText, Stop> {
    let file = session.text(path)?;
    let text = session.sources.get(file).map(|source| source.text.clone()).unwrap_or_default();
    Ok(CText { file, name, text })
}

/// Compares a chart with C that `build` emitted from it.
pub(super) fn run(
    session: &mut Session,
    arguments: &Compare,
    input: &Input,
    emitted: &Emitted,
) -> Result<Exit, Stop> {
    for (option, is_given) in [
        ("--stimulus", arguments.stimulus.is_some()),
        ("--random", arguments.random.is_some()),
        ("--rename", !arguments.rename.is_empty()),
        ("--engines", !arguments.engines.is_empty()),
    ] {
        if is_given {
            let path = &emitted.path;
            return Err(Stop::Usage(format!(
                "{option} has no effect on {path}, which is emitted C"
            )));
        }
    }
    session.begin(&input.file);
    let (design, found) = session.design(input)?;
    session.show(&found);
    let Design::Net(design) = design else {
        return Err(Stop::Input(format!(
            "{} is logic, and {} is the C of a chart",
            input.file, emitted.path
        )));
    };
    if session.demands.refuse(&found) || session.is_impossible(&design.net) {
        return Ok(Exit::Errors);
    }
    progress::doing(format!("comparing {} and {}", input.file, emitted.path));
    let net = &design.net;
    let limits = Limits::default();
    let facts = pipeline::facts(net, &limits);
    let wrong = |why| Stop::Input(format!("{}: {why}", emitted.map_path));
    let options = match &emitted.map {
        Some(map) => {
            map.is_of(net).map_err(wrong)?;
            map.options().map_err(wrong)?
        }
        None => grafsynth_backend_c::Options {
            stem: FileStem::of_path(&emitted.path).map(|stem| stem.as_str().to_owned()),
            machine: input.reading.machine,
            style: edited_c::style_of_engine(&emitted.texts).unwrap_or_default(),
            ..Default::default()
        },
    };
    let edited = match edited_c::edited(net, &facts, &emitted.texts, &options, emitted.map.as_ref())
    {
        Ok(edited) => edited,
        Err(found) => {
            session.show(&found);
            return if any_error(&found) { Err(Stop::Errors) } else { Ok(Exit::Errors) };
        }
    };
    if let Some(map) = &emitted.map {
        let instance = format!("{}_t", edited.package.prefix());
        map.scalars_of(&edited.unit, &instance).map_err(wrong)?;
    }
    let one = One { session, arguments, net, facts: &facts, edited: &edited, limits: &limits };
    let line = one.line(emitted)?;
    report(session, net, arguments.trace.as_deref(), &line)?;
    Ok(match &line.verdict {
        OutputVerdict::Proved(_) => Exit::Done,
        OutputVerdict::Refuted(_) => Exit::Refuted,
        OutputVerdict::Open(open) | OutputVerdict::ReadBack(open) => session.demands.open(open),
        OutputVerdict::NotChecked => Exit::Open,
    })
}

struct One<'a> {
    session: &'a Session,
    arguments: &'a Compare,
    net: &'a Valid<Net>,
    facts: &'a Facts,
    edited: &'a EditedC,
    limits: &'a Limits,
}

impl One<'_> {
    /// The result of the comparison.
    fn line(&self, emitted: &Emitted) -> Result<OutputReport, Stop> {
        let One { net, facts, edited, limits, .. } = *self;
        let name = emitted.path.as_str();
        if edited.package.representation.is_none() && !self.arguments.trust.trust_code {
            let style = edited.package.style;
            return Ok(OutputReport::open(
                name,
                OpenReason::Method(format!(
                    "it is C of the style `{style}`, whose tables no proof reads; write the chart with `--target c-program` or `c-switch`, whose C can be compared, or compile and run this C with `--trust-code`"
                )),
            ));
        }
        if let Err(why) = edited.same_interface() {
            return Ok(OutputReport::open(name, OpenReason::Method(why)));
        }
        let read = if self.arguments.no_proof {
            Err(OpenReason::NotAsked)
        } else {
            let because = match (&emitted.map, self.edited.package.representation.is_some()) {
                (None, true) => {
                    " (there is no map beside it: it is read as C that `build` emits without options)"
                }
                _ => "",
            };
            let proved = edited.prove(net, facts, limits);
            proved.map_err(|why| OpenReason::Method(format!("no induction: {why}{because}")))
        };
        let mut line = if self.arguments.trust.trust_code {
            let checked = exhaustive::check(name, net, &edited.package, limits, read);
            checked.map_err(|exhaustive::Refused(words)| {
                Stop::Input(format!("the C compiler rejects {name}\n{words}"))
            })?
        } else {
            self.executed(name, read)
        };
        if !edited.beyond.is_empty() && matches!(line.verdict, OutputVerdict::Proved(_)) {
            line.notes.push(Note::NotCompared(edited.beyond.clone()));
        }
        Ok(line)
    }

    /// The result without a compiler.
    fn executed(&self, name: &str, read: Result<Induction, OpenReason>) -> OutputReport {
        let One { session, net, facts, edited, limits, .. } = *self;
        let place = |span: Span| {
            let source = session.sources.get(span.file).filter(|_| span.file != FileId(u32::MAX));
            let path = source.map_or(name, |source| source.path.as_str());
            match session.sources.start(span) {
                Some(at) => format!("{path}:{}", at.line),
                None => path.to_owned(),
            }
        };
        let Some(hint) = &edited.package.representation else {
            return OutputReport::new(
                name,
                match read {
                    // There is no proof without a representation.
                    Ok(_) => OutputVerdict::NotChecked,
                    Err(why) => OutputVerdict::Open(Open::because(why)),
                },
            );
        };
        let mut hint = hint.clone();
        if edited.unreadable.is_some() {
            hint.state.clear();
        }
        let functions = functions_of(&edited.unit);
        let text = Text {
            unit: &edited.unit,
            functions: &functions,
            hint: &hint,
            facts,
            limits,
            place: &place,
        };
        exhaustive::check_text(name, net, &edited.package, &text, read)
    }
}
