//! The partition file `plant.split`: the parts, and the part of each object. Users can edit it and read it again with `--with`.

use grafsynth_ir::division::Running;
use grafsynth_ir::net::Net;
use grafsynth_split::Item;

use super::{Request, Split};

/// The contents of a partition file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Written {
    /// The parts, in order: name, device, and the line number, from 1.
    pub parts: Vec<(String, String, u32)>,
    /// How the parts run together, if a line says it.
    pub running: Option<Running>,
    /// True if a line says that no wire resets the chips.
    pub no_reset: bool,
    /// The places, in order: the object, the part, and the line number, from 1.
    pub places: Vec<(String, String, u32)>,
}

/// The text of the partition.
#[must_use]
pub fn write(net: &Net, split: &Split, request: &Request<'_>) -> String {
    let Request { parts, objective, .. } = *request;
    let mut text = format!(
        "# Partition of {}. To change it, edit this file and run: grafsynth split FILE --with THIS-FILE -o DIR\n",
        net.name
    );
    text += &format!("# minimised: {}\n\n", split.said(objective));
    if split.division.running != Running::default() {
        text += &format!("link {}\n", split.division.running.name());
    }
    if !request.reset {
        text += "no reset\n";
    }
    for part in parts {
        text += &format!("part {} = {}\n", part.name, part.device.name());
    }
    for (at, part) in parts.iter().enumerate() {
        text.push('\n');
        for (group, items) in split.groups.groups.iter().enumerate() {
            if split.partition.part.get(group) != Some(&at) {
                continue;
            }
            let names: Vec<String> = items
                .iter()
                .filter(|item| !matches!(item, Item::Event(_)))
                .map(|item| plain(net, *item))
                .collect();
            let why = match split.groups.cpu_only.get(&group) {
                Some((item, why)) => format!("  # {}: {why}", item.describe(net)),
                None => String::new(),
            };
            text += &format!("place {} on {}{why}\n", names.join(", "), part.name);
        }
    }
    text.push('\n');
    for wire in &split.division.wires {
        let to: Vec<&str> = wire
            .to
            .iter()
            .filter_map(|(part, _)| parts.get(*part))
            .map(|part| part.name.as_str())
            .collect();
        let from = parts.get(wire.from).map_or("", |part| part.name.as_str());
        text += &format!("# wire {}: from {from} to {}\n", wire.name, to.join(", "));
    }
    text
}

fn plain(net: &Net, item: Item) -> String {
    item.describe(net).replace('`', "")
}

/// Reads a partition file.
///
/// # Errors
/// Each line with a syntax error: its number and what was expected.
pub fn read(text: &str) -> Result<Written, Vec<(u32, String)>> {
    let mut written = Written::default();
    let mut wrong = Vec::new();
    // Some editors begin a file with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in (1..).zip(text.lines()) {
        // Tabs and several blanks are one blank.
        let line: Vec<&str> =
            line.split('#').next().unwrap_or_default().split_whitespace().collect();
        let line = line.join(" ");
        if line.is_empty() {
            continue;
        }
        if let Some(rest) = line.strip_prefix("part ")
            && let Some((name, device)) = rest.split_once('=')
        {
            written.parts.push((name.trim().to_owned(), device.trim().to_owned(), number));
        } else if let Some(running) =
            line.strip_prefix("link ").and_then(|it| Running::named(it.trim()))
        {
            match written.running.replace(running) {
                Some(before) if before != running => wrong.push((
                    number,
                    format!("another line says `link {}`: remove one of them", before.name()),
                )),
                _ => {}
            }
        } else if line == "no reset" {
            written.no_reset = true;
        } else if let Some(rest) = line.strip_prefix("place ")
            && let Some((names, part)) = rest.rsplit_once(" on ")
        {
            let names = names
                .split(',')
                .map(|name| (name.trim().to_owned(), part.trim().to_owned(), number));
            written.places.extend(names);
        } else {
            wrong.push((
                number,
                "expected `part NAME = DEVICE`, `place NAME, .. on PART`, `link lockstep`, `link free-running` or `no reset`"
                    .to_owned(),
            ));
        }
    }
    if wrong.is_empty() { Ok(written) } else { Err(wrong) }
}
