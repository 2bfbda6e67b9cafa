//! `grafsynth split FILE --part chip=gal22v10 --part cpu=atmega328p -o DIR`.

use super::build::HostC;
use super::build_results::{know, say};
use crate::args::Split as Arguments;
use crate::exit::Exit;
use crate::files;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use crate::progress;
use grafsynth_driver::codes;
use grafsynth_driver::pipeline::{self, BuildOptions, OutputFile};
use grafsynth_driver::read::Design;
use grafsynth_driver::report::{Outcome, OutputReport};
use grafsynth_driver::split::{self, PartDevice, Place, Request, RequestedPart, Split};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid, counted};
use grafsynth_verify::verdict::Verdict;

pub(crate) fn run(session: &mut Session, arguments: &Arguments) -> Result<Exit, Stop> {
    let file = &arguments.input.file;
    session.begin(file);
    let (design, found) = session.design(&arguments.input)?;
    let Design::Net(design) = design else {
        session.show(&found);
        return Err(Stop::Input(format!("{file} contains logic; `split` accepts only charts")));
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
    let parts = parts(arguments, &written)?;
    let places = places(session, net, arguments, &written, &parts)?;
    let stem = FileStem::of_path(file).unwrap_or_else(|| FileStem::of_name(&net.name.text));
    let made_of = session.made_of();
    let options = options(arguments, &stem);
    if net.board.device.is_some() {
        session.note(
            "the device and pins of the board are not used: `--part` names the devices, and `split` chooses the pins\n",
        );
    }
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
    let link = match split::link(net, &split, &request) {
        Ok(link) => link,
        Err(errors) => {
            found.extend(errors);
            session.show(&found);
            session.tell("nothing was written\n");
            return Err(Stop::Errors);
        }
    };
    finish(session, arguments, net, &stem, (split, &parts), (made_of, link), found)
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
        Exit::Refuted => Some("a part or the joined parts differ from the chart"),
        Exit::Open if !arguments.unproved => {
            Some("a proof is open; use `--unproved` to write the files anyway")
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
    session.tell(&format!("{}\n", joined(&split)));
    if let Some(why) = unwritten {
        session.tell(&format!("nothing was written: {why}\n"));
    }
    Ok(exit)
}

/// The contents of a part: its device, and the numbers of its steps, transitions and wires.
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

/// The verdict on the joined parts.
fn joined(split: &Split) -> String {
    match &split.joined {
        Verdict::Proved(proof) => format!(
            "joined parts: proved equal to the chart {} ({}, {} by construction)",
            proof.scope,
            counted(proof.compared, "function", "functions"),
            proof.same
        ),
        Verdict::Refuted(apart) => {
            format!("joined parts: DIFFER from the chart: {}, {}", apart.what, apart.when)
        }
        Verdict::Open(open) => {
            let reasons: Vec<String> = open.reasons.iter().map(ToString::to_string).collect();
            format!("joined parts: open: {}", reasons.join("; "))
        }
    }
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

fn partition_file(path: &str) -> Result<split::Written, Stop> {
    let text = files::read_text(path, 1 << 20)?;
    split::read(&text).map_err(|wrong| {
        let lines: Vec<String> =
            wrong.into_iter().map(|(line, what)| format!("{path}:{line}: {what}")).collect();
        Stop::Input(lines.join("\n"))
    })
}

/// The parts from the options or, if there are none, from the partition file.
fn parts(arguments: &Arguments, written: &split::Written) -> Result<Vec<RequestedPart>, Stop> {
    let mut all: Vec<(String, String)> = Vec::new();
    for text in &arguments.part {
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
                "`{name}` cannot be the name of a part: use letters, digits and `_`"
            )));
        }
        if ["link", "link_pins", "wiring"].contains(&name.as_str()) {
            return Err(Stop::Usage(format!(
                "a part cannot be called `{name}`: files of the link have this name"
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
                "unknown device `{device}` for part `{name}`{near} (`--part list` lists the devices)"
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

/// The places from the chart, the partition file and the options.
fn places(
    session: &Session,
    net: &Net,
    arguments: &Arguments,
    written: &split::Written,
    parts: &[RequestedPart],
) -> Result<Vec<Place>, Stop> {
    let mut all: Vec<(String, String, String)> = Vec::new();
    for (item, part, line) in &written.places {
        let file = arguments.with.as_deref().unwrap_or_default();
        all.push((item.clone(), part.clone(), format!("{file}:{line}: ")));
    }
    for text in &arguments.place {
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
                "{at}unknown step, transition, variable, output or action `{name}`{near}"
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
