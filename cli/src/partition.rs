//! The parts and places of a split: from options, from the chart and from a partition file.

use crate::files;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use grafsynth_driver::codes;
use grafsynth_driver::pipeline::BuildOptions;
use grafsynth_driver::split::{self, Objective, PartDevice, Place, Request, RequestedPart};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::{OfCpu, SplitEngine};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid};

/// The partitions that are built to improve on the first one that fits.
pub(crate) const FITS: usize = 8;

/// The compilers for microcontrollers decide whether a part fits the memory of its CPU.
pub(crate) const COMPILE: Option<split::Compile> = Some(grafsynth_engines::memory::sizes);

/// A partition file with its path, for messages.
#[derive(Clone, Copy)]
pub(crate) struct Written<'a> {
    /// The path.
    pub(crate) path: Option<&'a str>,
    /// Its contents.
    pub(crate) partition: &'a split::Written,
}

/// A net with the parts of a partition file, as an engine. Nothing is proved.
///
/// # Errors
/// A partition file that cannot be read; findings about the split, which were shown.
pub(crate) fn engine(
    session: &Session,
    net: &Valid<Net>,
    path: &str,
    of_cpu: OfCpu,
) -> Result<SplitEngine, Stop> {
    let partition = partition_file(path)?;
    let running = partition.running.unwrap_or_default();
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
    let request = Request {
        parts: &parts,
        places: &places,
        running,
        reset: !partition.no_reset,
        objective,
        fits: FITS,
        stem: &stem,
        options: &options,
        compile: COMPILE,
        told: |_| (),
    };
    let engine = split::split(net, &request)
        .and_then(|split| SplitEngine::new(net, split, &parts, &stem, of_cpu));
    engine.map_err(|found| {
        session.show(&found);
        Stop::Errors
    })
}

/// Reads a partition file.
pub(crate) fn partition_file(path: &str) -> Result<split::Written, Stop> {
    let text = files::read_text(path, 1 << 20)?;
    split::read(&text).map_err(|wrong| {
        let lines: Vec<String> =
            wrong.into_iter().map(|(line, what)| format!("{path}:{line}: {what}")).collect();
        Stop::Input(lines.join("\n"))
    })
}

/// The parts from the options or, if there are none, from the partition file.
pub(crate) fn parts(
    options: &[String],
    written: &split::Written,
) -> Result<Vec<RequestedPart>, Stop> {
    let mut wrong = Vec::new();
    let mut all: Vec<(&str, &str)> = Vec::new();
    for text in options {
        match text.split_once('=') {
            Some(part) => all.push(part),
            None => wrong.push(format!("expected --part NAME=DEVICE, found `{text}`")),
        }
    }
    if options.is_empty() {
        all.extend(written.parts.iter().map(|(name, device)| (name.as_str(), device.as_str())));
    }
    let mut parts: Vec<RequestedPart> = Vec::new();
    for (name, device) in all {
        wrong.extend(wrong_name(name, &parts));
        match PartDevice::named(device) {
            Some(device) => parts.push(RequestedPart { name: name.to_owned(), device }),
            None => {
                let near = PartDevice::near(device)
                    .map(|near| format!(", did you mean `{near}`?"))
                    .unwrap_or_default();
                wrong.push(format!(
                    "unknown device `{device}` for part `{name}`{near} (`--part list` lists the devices)"
                ));
            }
        }
    }
    if wrong.is_empty() {
        wrong.extend(wrong_number(&parts));
    }
    if !wrong.is_empty() {
        return Err(Stop::Usage(wrong.join("\n")));
    }
    parts.sort_by_key(is_cpu);
    Ok(parts)
}

fn is_cpu(part: &RequestedPart) -> bool {
    matches!(part.device, PartDevice::Cpu(_))
}

/// Why the next part cannot have this name.
fn wrong_name(name: &str, parts: &[RequestedPart]) -> Option<String> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || !name.chars().all(is_word) {
        return Some(format!("`{name}` cannot be the name of a part: use letters, digits and `_`"));
    }
    if ["link", "link_pins", "wiring"].contains(&name) {
        return Some(format!("a part cannot be called `{name}`: files of the link have this name"));
    }
    let is_taken = parts.iter().any(|part| part.name == name);
    is_taken.then(|| format!("two parts have the name `{name}`"))
}

/// Why these parts are too few or too many for a split.
fn wrong_number(parts: &[RequestedPart]) -> Option<String> {
    let cpus: Vec<&str> =
        parts.iter().filter(|part| is_cpu(part)).map(|part| part.name.as_str()).collect();
    match cpus.as_slice() {
        [] if parts.is_empty() => Some(
            "a split needs one CPU and at least one chip, for example `--part chip=gal22v10 --part cpu=atmega328p`"
                .to_owned(),
        ),
        [] => Some("none of the parts is a CPU: add one, for example `--part cpu=atmega328p`".to_owned()),
        [_] if parts.len() == 1 => {
            Some("none of the parts is a chip: add one, for example `--part chip=gal22v10`".to_owned())
        }
        [_] => None,
        [first, second, ..] => {
            Some(format!("`{first}` and `{second}` are CPUs, but a split has only one"))
        }
    }
}

/// The places from the chart, the partition file and the options.
pub(crate) fn places(
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
            wrong.push(if net.inputs.values().any(|input| input.name.text == name) {
                format!("{at}`{name}` is an input: it is wired to each part that reads it, and has no place")
            } else {
                let near = did_you_mean(&name, split::item_names(net));
                format!("{at}unknown step, transition, variable, output or action `{name}`{near}")
            });
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
