//! `grafsynth split FILE --part chip=gal22v10 --part cpu=atmega328p -o DIR`.

use super::build::HostC;
use super::build_results::{know, say};
use crate::args::Split as Arguments;
use crate::exit::Exit;
use crate::files;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_driver::codes;
use grafsynth_driver::pipeline::{self, BuildOptions, OutputFile};
use grafsynth_driver::read::Design;
use grafsynth_driver::report::{Outcome, OutputReport};
use grafsynth_driver::split::{self, Objective, PartDevice, Place, Request, RequestedPart, Split};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::{OfCpu, SplitEngine};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid, counted};
use grafsynth_verify::verdict::Verdict;

pub(crate) fn run(session: &mut Session, arguments: &Arguments) -> Result<Exit, Stop> {
    let file = &arguments.input.file;
    session.begin(file);
    let (design, found) = session.design(&arguments.input)?;
    let Design::Net(design) = design else {
        session.show(&found);
        return Err(Stop::Input(format!("{file} is logic, and only charts can be split")));
    };
    let net = &design.net;
    session.know_found(&found);
    if session.is_impossible(net) {
        session.show(&found);
        return Ok(Exit::Errors);
    }
    let written = match &arguments.with {
        None => split::Written::default(),
        Some(path) => partition_file(path)?,
    };
    let parts = parts(&arguments.part, &written)?;
    let written = Written { path: arguments.with.as_deref(), partition: &written };
    let places = places(session, net, &arguments.place, written, &parts)?;
    let stem = FileStem::of_path(file).unwrap_or_else(|| FileStem::of_name(&net.name.text));
    let made_of = session.made_of();
    let options = options(arguments, &stem);
    let request = Request {
        parts: &parts,
        places: &places,
        objective: arguments.minimise,
        stem: &stem,
        options: &options,
    };
    progress::doing(format!("splitting {}", net.name));
    let mut split = match split::split(net, &request) {
        Ok(split) => split,
        Err(mut errors) => {
            let mut all = found;
            all.append(&mut errors);
            session.show(&all);
            session.tell("nothing was written\n");
            return Err(Stop::Errors);
        }
    };
    let mut found = found;
    for (part, division) in split.parts.iter_mut().zip(&split.division.parts) {
        let net = &division.net;
        found.append(&mut part.built.found);
        let engine = HostC { session, net, options: &part.options };
        let checked = pipeline::check_c(net, &part.facts, &part.options, &mut part.built, &engine);
        if let Err((name, words)) = checked {
            session.show(&found);
            return Err(Stop::Input(format!(
                "{name} was not written: the C compiler rejects it\n{words}"
            )));
        }
        know(session, net, &part.built.lines);
    }
    let link = match split::link(net, &split, &parts, &stem) {
        Ok(link) => link,
        Err(errors) => {
            found.extend(errors);
            session.show(&found);
            session.tell("nothing was written\n");
            return Err(Stop::Errors);
        }
    };
    let table = arguments.table.then(|| split::table(net, &split, &link, &request));
    let exit =
        finish(session, arguments, net, &stem, (split, &parts), (made_of, link.files), found)?;
    if let Some(table) = table {
        session.tell(&format!("\n{table}\n"));
    }
    Ok(exit)
}

/// Writes the files, all or none, and reports what is proved.
fn finish(
    session: &mut Session,
    arguments: &Arguments,
    net: &Valid<Net>,
    stem: &FileStem,
    (split, parts): (Split, &[RequestedPart]),
    (made_of, link): (Vec<files::Hashed>, Vec<OutputFile>),
    found: Vec<grafsynth_ir::Diagnostic>,
) -> Result<Exit, Stop> {
    let worst =
        split.parts.iter().map(|part| part.built.outcome()).max().unwrap_or(Outcome::Proved);
    let exit = match (&split.joined, worst) {
        (Verdict::Refuted(_), _) | (_, Outcome::Refuted) => Exit::Refuted,
        (Verdict::Open(_), _) | (_, Outcome::Open | Outcome::NotChecked) => Exit::Open,
        (Verdict::Proved(_), Outcome::Proved) => Exit::Done,
    };
    let unwritten = match exit {
        Exit::Refuted => Some("a part, or the joined parts, are not equal to the chart"),
        Exit::Open if !arguments.unproved => {
            Some("a proof is open; `--unproved` writes the files all the same")
        }
        _ => None,
    };
    session.show(&found);
    if unwritten.is_none() {
        let of_parts = split.parts.iter().flat_map(|part| &part.built.files);
        let written = of_parts.chain(&link).map(|file| files::Output {
            name: file.name.clone(),
            bytes: file.text.clone().into_bytes(),
            keep_existing: file.keep_existing,
        });
        let mut outputs: Vec<files::Output> = written.collect();
        let text = split::write(net, &split, parts, arguments.minimise);
        let name = format!("{stem}.split");
        // A partition that the user gave, perhaps edited, is not overwritten.
        let keep_existing = arguments.with.is_some();
        outputs.push(files::Output { name, bytes: text.into_bytes(), keep_existing });
        if exit == Exit::Open {
            outputs.iter_mut().for_each(note_unproved);
        }
        let read = session.paths();
        let folder = &arguments.output;
        files::Plan { folder, stem: stem.as_str(), made_of, read, outputs }.write()?;
    }
    for (at, part) in split.parts.iter().enumerate() {
        let own = &split.division.parts[at].net;
        session.tell(&about(net, &split, parts, at));
        let lines: Vec<OutputReport> = part.built.lines.clone();
        say(session, own, None, &lines, None)?;
    }
    let (status, message) = joined(&split);
    let answer = Answer::new(About::Output, "joined parts", status, message.as_str());
    session.answer(&answer, &format!("joined parts: {message}\n"));
    if let Some(why) = unwritten {
        session.tell(&format!("nothing was written: {why}\n"));
    }
    Ok(exit)
}

/// What a part has.
fn about(net: &Net, split: &Split, parts: &[RequestedPart], at: usize) -> String {
    let owners = &split.division.owners;
    let steps = net.steps.ids().filter(|id| owners.steps[*id] == at).count();
    let copies = split.division.parts[at].steps.len().saturating_sub(steps);
    let transitions = net.transitions.ids().filter(|id| owners.transitions[*id] == at).count();
    let out = split.division.wires.iter().filter(|wire| wire.from == at).count();
    let into =
        split.division.wires.iter().filter(|wire| wire.to.iter().any(|(to, _)| *to == at)).count();
    format!(
        "{} on {}: {} and {}, {}, {} out, {into} in\n",
        parts[at].name,
        parts[at].device.name(),
        counted(steps, "step", "steps"),
        counted(copies, "copy", "copies"),
        counted(transitions, "transition", "transitions"),
        counted(out, "wire", "wires"),
    )
}

/// Whether the joined parts are the chart.
fn joined(split: &Split) -> (Status, String) {
    match &split.joined {
        Verdict::Proved(proof) => {
            let functions = counted(proof.compared, "function", "functions");
            let message = format!(
                "proved equal to the chart {} ({functions}, {} by construction)",
                proof.scope, proof.same
            );
            (Status::Proved, message)
        }
        Verdict::Refuted(apart) => {
            let message = format!("NOT equal to the chart: {} differs, {}", apart.what, apart.when);
            (Status::Refuted, message)
        }
        Verdict::Open(open) => {
            let reasons: Vec<String> = open.reasons.iter().map(ToString::to_string).collect();
            (Status::Open, format!("open whether they are the chart: {}", reasons.join("; ")))
        }
    }
}

/// What the head of each text says if a proof of the split is open.
const UNPROVED: &str = "A proof of this split is open: see the output of grafsynth split.";

/// Adds that sentence to the head of a text, as a comment of its language. A drawing has no head.
fn note_unproved(output: &mut files::Output) {
    let Ok(text) = String::from_utf8(output.bytes.clone()) else { return };
    let extension = output.name.rsplit('.').next().unwrap_or_default();
    let noted = match extension {
        "c" | "h" | "pld" => format!("/* {UNPROVED} */\n{text}"),
        "md" => format!("{UNPROVED}\n\n{text}"),
        "split" => format!("# {UNPROVED}\n{text}"),
        "jed" => in_jedec(&text).unwrap_or(text),
        _ => text,
    };
    output.bytes = noted.into_bytes();
}

/// A fuse map with the sentence at the start of its design specification, with a new checksum: the sum of all bytes from STX to ETX.
fn in_jedec(text: &str) -> Option<String> {
    let (before, rest) = text.split_once('\u{2}')?;
    let (design, after) = rest.split_once('\u{3}')?;
    let design = format!("\u{2}{UNPROVED}\n{design}\u{3}");
    let sum = design.bytes().fold(0_u16, |sum, byte| sum.wrapping_add(u16::from(byte)));
    let after = after.get(4..)?;
    Some(format!("{before}{design}{sum:04X}{after}"))
}

/// The options of the builds of the parts.
fn options(arguments: &Arguments, stem: &FileStem) -> BuildOptions {
    BuildOptions {
        stem: Some(stem.clone()),
        prove: true,
        dont_cares: true,
        trusts_code: arguments.trust.trust_code,
        limits: arguments.limits.limits(),
        ..BuildOptions::default()
    }
}

/// A partition file with its path, for messages.
#[derive(Clone, Copy)]
struct Written<'a> {
    path: Option<&'a str>,
    partition: &'a split::Written,
}

/// A net with the parts of a partition file, as an engine. Nothing is proved.
///
/// # Errors
/// A partition file that cannot be read; findings about the split, which were shown.
pub(super) fn engine(
    session: &Session,
    net: &Valid<Net>,
    path: &str,
    of_cpu: OfCpu,
) -> Result<SplitEngine, Stop> {
    let partition = partition_file(path)?;
    let parts = parts(&[], &partition)?;
    let written = Written { path: Some(path), partition: &partition };
    let places = places(session, net, &[], written, &parts)?;
    let stem = FileStem::of_name(&net.name.text);
    let options = BuildOptions {
        stem: Some(stem.clone()),
        dont_cares: true,
        trusts_code: true,
        ..BuildOptions::default()
    };
    let objective = Objective::default();
    let request =
        Request { parts: &parts, places: &places, objective, stem: &stem, options: &options };
    let engine = split::split(net, &request)
        .and_then(|split| SplitEngine::new(net, split, &parts, &stem, of_cpu));
    engine.map_err(|found| {
        session.show(&found);
        Stop::Errors
    })
}

fn partition_file(path: &str) -> Result<split::Written, Stop> {
    let text = files::read_text(path, 1 << 20).map_err(Stop::Input)?;
    split::read(&text).map_err(|wrong| {
        let lines: Vec<String> =
            wrong.into_iter().map(|(line, what)| format!("{path}:{line}: {what}")).collect();
        Stop::Input(lines.join("\n"))
    })
}

/// The parts of the options, or else those of the partition file.
fn parts(options: &[String], written: &split::Written) -> Result<Vec<RequestedPart>, Stop> {
    let mut all: Vec<(String, String)> = Vec::new();
    for text in options {
        let Some((name, device)) = text.split_once('=') else {
            return Err(Stop::Usage(format!("expected --part NAME=DEVICE, found `{text}`")));
        };
        all.push((name.to_owned(), device.to_owned()));
    }
    if all.is_empty() {
        all.clone_from(&written.parts);
    }
    let mut parts: Vec<RequestedPart> = Vec::new();
    for (name, device) in all {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.is_empty() || !name.chars().all(is_word) {
            return Err(Stop::Usage(format!(
                "the name of a part must consist of letters, digits and `_`, but `{name}` does not"
            )));
        }
        if ["link", "link_pins", "wiring"].contains(&name.as_str()) {
            return Err(Stop::Usage(format!(
                "a part cannot be called `{name}`: the link has files of that name"
            )));
        }
        if parts.iter().any(|part| part.name == name) {
            return Err(Stop::Usage(format!("two parts have the name `{name}`")));
        }
        let Some(found) = PartDevice::named(&device) else {
            let near = PartDevice::near(&device)
                .map(|near| format!(", did you mean `{near}`?"))
                .unwrap_or_default();
            return Err(Stop::Usage(format!(
                "unknown device `{device}` of part `{name}`{near} (`--part list` lists them)"
            )));
        };
        parts.push(RequestedPart { name, device: found });
    }
    let is_cpu = |part: &RequestedPart| matches!(part.device, PartDevice::Cpu(_));
    if parts.len() < 2 || parts.iter().filter(|part| is_cpu(part)).count() != 1 {
        return Err(Stop::Usage(
            "a split needs one CPU and at least one chip, for example `--part chip=gal22v10 --part cpu=atmega328p`"
                .to_owned(),
        ));
    }
    parts.sort_by_key(is_cpu);
    Ok(parts)
}

/// The places of the chart, of the partition file and of the options.
fn places(
    session: &Session,
    net: &Net,
    options: &[String],
    written: Written<'_>,
    parts: &[RequestedPart],
) -> Result<Vec<Place>, Stop> {
    let mut all: Vec<(String, String, String)> = Vec::new();
    for (item, part, line) in &written.partition.places {
        let file = written.path.unwrap_or_default();
        all.push((item.clone(), part.clone(), format!("{file}:{line}: ")));
    }
    for text in options {
        // `a,b=chip,c=cpu`: the names before each `=` are placed on the part after it.
        let mut names: Vec<&str> = Vec::new();
        for piece in text.split(',') {
            match piece.rsplit_once('=') {
                None => names.push(piece),
                Some((name, part)) => {
                    names.push(name);
                    let placed = names.drain(..);
                    all.extend(placed.map(|name| {
                        (name.trim().to_owned(), part.trim().to_owned(), String::new())
                    }));
                }
            }
        }
        if !names.is_empty() {
            return Err(Stop::Usage(format!("expected --place NAMES=PART, found `{text}`")));
        }
    }
    let mut places = Vec::new();
    let mut wrong = Vec::new();
    let mut found = Vec::new();
    let near_part = |part: &str| did_you_mean(part, parts.iter().map(|it| it.name.as_str()));
    for placement in &net.placements {
        let part = parts.iter().position(|it| it.name == placement.part.text);
        match part {
            Some(part) => places.push(Place {
                item: split::placed_item(placement.item),
                part,
                span: placement.span,
            }),
            None => {
                let name = &placement.part.text;
                let message = format!("unknown part `{name}`{}", near_part(name));
                let known: Vec<&str> = parts.iter().map(|it| it.name.as_str()).collect();
                found.push(
                    grafsynth_ir::Diagnostic::error(codes::NO_PARTITION, message)
                        .at(placement.part.span, "")
                        .help(format!("the parts are {}", known.join(", "))),
                );
            }
        }
    }
    if !found.is_empty() {
        session.show(&found);
        return Err(Stop::Errors);
    }
    for (name, part, at) in all {
        let item = split::item(net, &name);
        if item.is_none() {
            let near = did_you_mean(&name, split::item_names(net));
            wrong.push(format!(
                "{at}`{name}` is no step, transition, variable, output or action{near}"
            ));
        }
        let found = parts.iter().position(|it| it.name == part);
        if found.is_none() {
            wrong.push(format!("{at}unknown part `{part}`{}", near_part(&part)));
        }
        if let (Some(item), Some(part)) = (item, found) {
            places.push(Place { item, part, span: Span::default() });
        }
    }
    if wrong.is_empty() { Ok(places) } else { Err(Stop::Usage(wrong.join("\n"))) }
}
