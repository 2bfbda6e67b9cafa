//! Reports on the outputs of a build: a line for each ([`OutputReport`]), and with `build --report` a page about all of them ([`document()`]).
//!
//! ```text
//! pipeline, jedec ──► Chip      the data of one output, collected while it is built
//! net, facts, lines, chips ──► Subject ──► sections, one file each ──► Document ──► Markdown, JSON; HTML (by the command line)
//!                                   └────► Drawing (characters, SVG) ──┘
//! ```
//! A section is a function that returns the blocks for a [`Subject`] (or for one [`Chip`] of it), none if there is nothing to report. The lists `BEFORE`, `CHIP`
//! and `AFTER` contain all sections of the report, in order: another kind of target would get its own list, like `CHIP`. The writers add no fact, so all forms
//! have the same ones. A report contains no date, so the same chart gives the same bytes.

pub mod chip;
pub mod document;
pub mod drawing;
pub mod svg;
mod table;

mod clock;
mod codes;
pub mod cpu;
mod design;
mod equations;
mod flashing;
mod json;
mod macrocells;
mod markdown;
mod pins;
mod power_up;
mod programming;
pub(crate) mod proofs;
mod requirements;

#[cfg(test)]
mod tests;

pub use crate::output_report::{
    Note, Outcome, OutputFault, OutputProof, OutputReport, OutputVerdict, Ran, RowFault,
};
pub use chip::Chip;
pub use document::Document;
pub use json::json;
pub use markdown::markdown;

use self::document::{Block, Figure, Section};
use crate::built::{Built, MapEntry, OutputFile};
use crate::source::Sources;
use crate::stem::FileStem;
use crate::task_costs::Counted;
use grafsynth_backend_c::cost::{self, Rounds};
use grafsynth_ir::facts::{Facts, Reach};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_verify::{Limits, PropertyVerdict};

/// A section about the whole design: the name of its kind, its title and its writer.
type Whole = (&'static str, &'static str, fn(&Subject<'_>) -> Vec<Block>);
/// A section about one chip.
type OfChip = (&'static str, &'static str, fn(&Subject<'_>, &Chip) -> Vec<Block>);

/// The first sections.
const BEFORE: [Whole; 2] =
    [("design", "Design", design::write), ("proofs", "What was proved", proofs::write)];

/// The sections of each chip, under its own heading.
const CHIP: [OfChip; 7] = [
    ("codes", "Codes", codes::write),
    ("equations", "Equations", equations::write),
    ("product-terms", "Product terms", macrocells::write),
    ("pins", "Pins", pins::write),
    ("power-up", "Power-up", power_up::write),
    ("clock", "Clock", clock::write),
    ("programming", "Programming", programming::write),
];

/// The last sections, which cover all outputs.
const AFTER: [Whole; 3] = [
    ("cpu", "CPU", cpu::write),
    ("flashing", "Flashing", flashing::write),
    ("requirements", "Requirements", requirements::write),
];

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

/// The report of a build. `facts` are those of the build; if they do not contain the situations, these are enumerated here, within `limits`.
#[must_use]
pub fn document(
    net: &Valid<Net>,
    facts: &Facts,
    built: &Built,
    counted: Option<&Counted>,
    sources: &Sources,
    limits: &Limits,
) -> Document {
    let reach = facts.reach.clone().or_else(|| {
        let limits = Limits { pairs: limits.pairs.min(100_000), ..limits.clone() };
        grafsynth_verify::facts(net, &limits).reach
    });
    let properties = grafsynth_verify::properties(net, limits);
    let rounds = cost::rounds(net, facts);
    collect(&Subject { net, built, counted, rounds, sources, reach, properties, is_logic: false })
}

/// The report of imported logic. `interface` has its columns ([`crate::logic::interface`]).
#[must_use]
pub fn document_of_logic(interface: &Valid<Net>, built: &Built) -> Document {
    collect(&Subject {
        net: interface,
        built,
        counted: None,
        rounds: None,
        sources: &Sources::default(),
        reach: None,
        properties: Vec::new(),
        is_logic: true,
    })
}

/// A report as Markdown, with the drawing of each chip in a file of its own.
#[must_use]
pub fn markdown_files(document: &Document, stem: &FileStem) -> Vec<OutputFile> {
    let page = OutputFile::new(format!("{stem}.report.md"), markdown(document));
    let blocks = document.sections.iter().flat_map(|section| &section.blocks);
    let drawings = blocks.filter_map(|block| match block {
        Block::Figure(figure) => Some(OutputFile::new(figure.file.clone(), figure.svg.clone())),
        _ => None,
    });
    std::iter::once(page).chain(drawings).collect()
}

fn collect(subject: &Subject<'_>) -> Document {
    let Subject { net, built, .. } = subject;
    let mut sections = Vec::new();
    let of_whole = |(id, title, write): Whole| Section {
        id,
        output: None,
        is_part: false,
        title: title.to_owned(),
        blocks: write(subject),
    };
    sections.extend(BEFORE.map(of_whole));
    for chip in &built.chips {
        let figure = Figure {
            about: chip.file.clone(),
            file: format!("{}.svg", chip.file),
            svg: drawing::Drawing::of(chip).svg(),
        };
        let of_chip = |id, title: &str, is_part, blocks| Section {
            id,
            output: Some(chip.file.clone()),
            is_part,
            title: title.to_owned(),
            blocks,
        };
        sections.push(of_chip("output", &chip.file, false, vec![Block::Figure(figure)]));
        sections
            .extend(CHIP.map(|(id, title, write)| of_chip(id, title, true, write(subject, chip))));
    }
    sections.extend(AFTER.map(of_whole));
    sections.retain(|section| !section.blocks.is_empty());
    let subtitle = net.parts.values().next().map_or("", |part| part.meta.label.as_str());
    Document { title: net.name.text.clone(), subtitle: subtitle.to_owned(), sections }
}
