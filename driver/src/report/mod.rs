//! Reports on the outputs of a build: a line for each ([`OutputReport`]), and with `build --report` a page with drawings ([`page()`]).
//!
//! ```text
//! pipeline, jedec ──► Chip      the data of one output, collected while it is built
//! net, facts, lines, chips ──► Subject ──► sections, one file each ──► NAME.report.md
//!                                   └────► Drawing ──► NAME.report.md (characters), FILE.svg
//! ```
//! A section is a function that returns the text for a [`Subject`] (or for one [`Chip`] of it), or `None` if there is nothing to report. The lists `BEFORE`,
//! `CHIP` and `AFTER` contain all sections of the page, in order: another kind of target would get its own list, like `CHIP`. The page is Markdown that is
//! readable as plain text too; it contains no date, so the same chart gives the same bytes.

pub mod chip;
pub mod drawing;
pub mod svg;
mod table;

mod clock;
mod codes;
pub mod cpu;
mod design;
mod equations;
mod flashing;
mod macrocells;
mod pins;
mod power_up;
mod programming;
mod proofs;
mod requirements;

#[cfg(test)]
mod tests;

pub use crate::output_report::{
    Note, Outcome, OutputFault, OutputProof, OutputReport, OutputVerdict, Ran, RowFault,
};
pub use chip::Chip;

use crate::built::{Built, MapEntry, OutputFile};
use crate::source::Sources;
use crate::stem::FileStem;
use crate::task_costs::Counted;
use grafsynth_backend_c::cost::{self, Rounds};
use grafsynth_ir::facts::{Facts, Reach};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_verify::{Limits, PropertyVerdict};

/// A section about the whole design: its title and its writer.
type Whole = (&'static str, fn(&Subject<'_>) -> Option<String>);
/// A section about one chip.
type OfChip = (&'static str, fn(&Subject<'_>, &Chip) -> Option<String>);

/// The first sections.
const BEFORE: [Whole; 2] = [("Design", design::write), ("What was proved", proofs::write)];

/// The sections of each chip, under its own heading.
const CHIP: [OfChip; 7] = [
    ("Codes", codes::write),
    ("Equations", equations::write),
    ("Product terms", macrocells::write),
    ("Pins", pins::write),
    ("Power-up", power_up::write),
    ("Clock", clock::write),
    ("Programming", programming::write),
];

/// The last sections, which cover all outputs.
const AFTER: [Whole; 3] =
    [("CPU", cpu::write), ("Flashing", flashing::write), ("Requirements", requirements::write)];

/// The subject of a page.
pub struct Subject<'a> {
    /// The chart.
    pub net: &'a Valid<Net>,
    /// The results of the build.
    pub built: &'a Built,
    /// The tasks whose costs come from a model.
    pub counted: Option<&'a Counted>,
    /// The number of rounds that the bounds count for the loop over micro-steps in its C code.
    pub rounds: Option<Rounds>,
    /// The texts that the chart was read from: properties are shown as they were written.
    pub sources: &'a Sources,
    /// The reachable situations, as far as they could be counted.
    pub reach: Option<Reach>,
    /// The results of the chart's properties.
    pub properties: Vec<PropertyVerdict>,
    /// True for imported logic: the net then has its pins and no behaviour.
    pub is_logic: bool,
}

impl Subject<'_> {
    /// The lines of an output that carry a requirement tag, each once.
    fn tagged<'m>(file: &'m OutputFile, tag: &str) -> Vec<&'m MapEntry> {
        let mut entries: Vec<&MapEntry> = Vec::new();
        for entry in &file.map {
            let is_known = entries.iter().any(|known| known.line == entry.line);
            if !is_known && entry.req.iter().any(|known| known == tag) {
                entries.push(entry);
            }
        }
        entries
    }
}

/// The page of a build, called `stem`, and the drawing of each chip. `facts` are those of the build; if they do not contain the situations, these are
/// enumerated here, within `limits`.
#[must_use]
pub fn page(
    net: &Valid<Net>,
    facts: &Facts,
    built: &Built,
    counted: Option<&Counted>,
    sources: &Sources,
    limits: &Limits,
    stem: &FileStem,
) -> Vec<OutputFile> {
    let reach = facts.reach.clone().or_else(|| {
        let limits = Limits { pairs: limits.pairs.min(100_000), ..limits.clone() };
        grafsynth_verify::facts(net, &limits).reach
    });
    let properties = grafsynth_verify::properties(net, limits);
    let rounds = cost::rounds(net, facts);
    let subject =
        Subject { net, built, counted, rounds, sources, reach, properties, is_logic: false };
    write(&subject, stem)
}

/// The page of imported logic, named `stem`, and the drawing of each chip. `interface` has its columns ([`crate::logic::interface`]).
#[must_use]
pub fn page_of_logic(interface: &Valid<Net>, built: &Built, stem: &FileStem) -> Vec<OutputFile> {
    let sources = Sources::default();
    let subject = Subject {
        net: interface,
        built,
        counted: None,
        rounds: None,
        sources: &sources,
        reach: None,
        properties: Vec::new(),
        is_logic: true,
    };
    write(&subject, stem)
}

fn write(subject: &Subject<'_>, stem: &FileStem) -> Vec<OutputFile> {
    let Subject { net, built, .. } = subject;
    let mut text = format!("# {}\n", table::inline(&net.name.text));
    if !net.parts.values().next().is_none_or(|part| part.meta.label.is_empty()) {
        let label = net.parts.values().next().map_or("", |part| part.meta.label.as_str());
        text += &format!("\n{}\n", table::inline(label));
    }
    let mut add = |level: &str, title: &str, body: Option<String>| {
        if let Some(body) = body {
            text += &format!("\n{level} {title}\n\n{}\n", body.trim_end());
        }
    };
    for (title, write) in BEFORE {
        add("##", title, write(subject));
    }
    let mut files = Vec::new();
    for chip in &built.chips {
        let head = format!("![{}]({})", chip.file, drawing_name(chip));
        add("##", &table::inline(&chip.file), Some(head));
        for (title, write) in CHIP {
            add("###", title, write(subject, chip));
        }
        files.push(OutputFile::new(drawing_name(chip), drawing::Drawing::of(chip).svg()));
    }
    for (title, write) in AFTER {
        add("##", title, write(subject));
    }
    files.insert(0, OutputFile::new(format!("{stem}.report.md"), text));
    files
}

fn drawing_name(chip: &Chip) -> String {
    format!("{}.svg", chip.file)
}
