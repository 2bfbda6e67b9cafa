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

impl Written<'_> {
    /// The place of a line, for the beginning of a message.
    fn at(&self, line: u32) -> String {
        format!("{}:{line}: ", self.path.unwrap_or_default())
    }
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
    let written = Written { path: Some(path), partition: &partition };
    let parts = parts(&[], written)?;
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

/// The parts of the partition file and of the options; a part of an option replaces one of the file that has its name.
pub(crate) fn parts(options: &[String], written: Written<'_>) -> Result<Vec<RequestedPart>, Stop> {
    let mut wrong = Vec::new();
    let mut all: Vec<(&str, &str, String)> = Vec::new();
    for text in options {
        match text.split_once('=') {
            Some((name, device)) => all.push((name, device, String::new())),
            None => wrong.push(format!("expected --part NAME=DEVICE, found `{text}`")),
        }
    }
    let replaced: Vec<&str> = all.iter().map(|(name, ..)| *name).collect();
    let of_file =
        written.partition.parts.iter().filter(|(name, ..)| !replaced.contains(&name.as_str()));
    all.extend(of_file.map(|(name, device, line)| (&name[..], &device[..], written.at(*line))));
    let mut parts: Vec<RequestedPart> = Vec::new();
    for (name, device, at) in all {
        wrong.extend(wrong_name(name, &parts).map(|why| format!("{at}{why}")));
        match PartDevice::named(device) {
            Some(device) => parts.push(RequestedPart { name: name.to_owned(), device }),
            None => {
                let near = PartDevice::near(device)
                    .map(|near| format!(", did you mean `{near}`?"))
                    .unwrap_or_default();
                wrong.push(format!(
                    "{at}unknown device `{device}` for part `{name}`{near} (`--part list` lists the devices)"
                ));
            }
        }
    }
    if wrong.is_empty() {
        wrong.extend(wrong_number(&parts));
    }
    if !wrong.is_empty() {
        let text = wrong.join("\n");
        return Err(if options.is_empty() && !written.partition.parts.is_empty() {
            Stop::Input(text)
        } else {
            Stop::Usage(text)
        });
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
    let other = parts.iter().find(|part| part.name.eq_ignore_ascii_case(name))?;
    Some(match other.name == name {
        true => format!("two parts have the name `{name}`"),
        false => format!(
            "two parts have the names `{}` and `{name}`, which are one name for files on Windows and macOS",
            other.name
        ),
    })
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

/// The places of options: object, part, and an empty location, because an option is in no file.
fn of_options(options: &[String]) -> Result<Vec<(String, String, String)>, Stop> {
    let mut all = Vec::new();
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
    Ok(all)
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
        all.push((item.clone(), part.clone(), written.at(*line)));
    }
    all.extend(of_options(options)?);
    let mut places = Vec::new();
    let mut wrong = Vec::new();
    let mut is_usage = false;
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
        let before = wrong.len();
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
        // What an option says is wrong in the command; what the file says is wrong in the file.
        is_usage |= wrong.len() > before && at.is_empty();
        if let (Some(item), Some(part)) = (item, found) {
            places.push(Place { item, part, span: Span::default() });
        }
    }
    match wrong.join("\n") {
        text if text.is_empty() => Ok(places),
        text if is_usage => Err(Stop::Usage(text)),
        text => Err(Stop::Input(text)),
    }
}
