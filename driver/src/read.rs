//! Sources to a design: the first half of every pipeline.

use crate::codes;
use crate::languages::{self, Language, Reader};
use crate::libraries;
use crate::logic::LogicDesign;
use crate::source::Sources;
use crate::stem::FileStem;
use crate::task_costs;
use grafsynth_frontend::graf;
use grafsynth_ir::diag::{Code, any_error};
use grafsynth_ir::net::Net;
use grafsynth_ir::plant::Plant;
use grafsynth_ir::{Diagnostic, FileId, Span, Valid, chart, lower, validate};

pub use crate::design::{Design, NetDesign};
pub use crate::texts::{LibraryText, Texts};
pub use grafsynth_frontend::c::{Calls as CCalls, Group as CGroup, Options as COptions};

/// Limits of the front ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadLimits {
    /// The maximum nesting depth.
    pub nesting: u32,
    /// The maximum size of a source in bytes.
    pub source: usize,
    /// The maximum number of findings kept for a file; the rest is counted.
    pub diagnostics: usize,
}

impl ReadLimits {
    fn front(self) -> graf::Limits {
        graf::Limits { nesting: self.nesting, source: self.source, diagnostics: self.diagnostics }
    }
}

impl Default for ReadLimits {
    fn default() -> Self {
        ReadLimits { nesting: 256, source: 64 << 20, diagnostics: 100 }
    }
}

/// Reads the plant of a net (docs/plant.md). With errors there is no plant.
#[must_use]
pub fn plant(
    sources: &Sources,
    file: FileId,
    net: &Net,
    limits: ReadLimits,
) -> (Option<Plant>, Vec<Diagnostic>) {
    let text = sources.get(file).map_or("", |source| &source.text);
    grafsynth_frontend::plant::parse(net, file, text, &limits.front())
}

/// Reads a design, its board and its properties. The design is returned only if no finding is an error.
#[must_use]
pub fn read(
    sources: &Sources,
    texts: &Texts,
    limits: ReadLimits,
) -> (Option<Design>, Vec<Diagnostic>) {
    let Some(source) = sources.get(texts.main) else { return (None, Vec::new()) };
    let Some(language) = texts.language.or_else(|| Language::of(&source.path, &source.text)) else {
        return (None, vec![unknown_language(&source.path)]);
    };
    let (main, text, front) = (texts.main, &source.text, limits.front());
    let (design, found) = match language.read {
        Reader::Chart(parse) => {
            let mut parsed = parse(main, text, &front);
            let design =
                chart_design(sources, texts, limits, parsed.design, &mut parsed.diagnostics);
            (design, parsed.diagnostics)
        }
        Reader::C(parse) => {
            let mut parsed = parse(main, text, &front, &texts.c);
            let mut design =
                chart_design(sources, texts, limits, parsed.design, &mut parsed.diagnostics);
            if let Some(Design::Net(design)) = &mut design {
                design.library = parsed.library;
            }
            (design, parsed.diagnostics)
        }
        Reader::Net(parse) => {
            let name = texts.stem.as_ref().map(FileStem::identifier).unwrap_or_default();
            let (net, mut found) = parse(main, text, &front, &name);
            let net = net.and_then(|net| kept(validate(net), &mut found));
            let design =
                net.and_then(|net| with_properties(sources, texts, limits, None, net, &mut found));
            (design, found)
        }
        Reader::Equations(dialect) => {
            let read = grafsynth_backend_pld::read_text(dialect, main, text);
            let mut found = Vec::new();
            (logic_design(read, texts, &mut found), found)
        }
        Reader::Circuit(parse) => {
            let (read, mut found) = parse(main, text);
            (read.and_then(|read| logic_design(read, texts, &mut found)), found)
        }
        Reader::Fuses(parse) => {
            let (design, found) = parse(main, text);
            (design.map(|design| Design::Logic(Box::new(design))), found)
        }
    };
    let design = if any_error(&found) { None } else { design };
    (design, found)
}

/// The chart of a text that [`read`] rejects, as far as it was parsed, without its library charts. Nothing is checked: it may contain unknown names.
#[must_use]
pub fn unchecked(sources: &Sources, texts: &Texts, limits: ReadLimits) -> Option<chart::Design> {
    let source = sources.get(texts.main)?;
    let language = texts.language.or_else(|| Language::of(&source.path, &source.text))?;
    let front = limits.front();
    match language.read {
        Reader::Chart(parse) => parse(texts.main, &source.text, &front).design,
        Reader::C(parse) => parse(texts.main, &source.text, &front, &texts.c).design,
        Reader::Net(_) | Reader::Equations(_) | Reader::Circuit(_) | Reader::Fuses(_) => None,
    }
}

/// True if a finding only repeats an earlier one. This is the case if a transition never fires for a reason that the reader reported at the same location, or
/// if a step is never active because no transition leads to it, which was reported.
#[must_use]
pub fn is_consequence(finding: &Diagnostic, read: &[Diagnostic]) -> bool {
    use grafsynth_frontend::codes::{C_CONDITION_ASSIGNS, ST_NOT_CALLED};
    let reasons: &[Code] = if finding.code == grafsynth_verify::codes::DEAD_TRANSITION {
        &[ST_NOT_CALLED, C_CONDITION_ASSIGNS]
    } else if finding.code == grafsynth_verify::codes::UNREACHABLE_STEP {
        &[grafsynth_ir::lower::codes::UNREACHED_STEP]
    } else {
        return false;
    };
    // The name of a step is a part of the place of the step.
    let is_step = finding.code == grafsynth_verify::codes::UNREACHABLE_STEP;
    let is_there = |place: Span, at: Span| {
        place == at || is_step && place.file == at.file && place.to(at) == at
    };
    read.iter().filter(|one| reasons.contains(&one.code)).any(|one| {
        let places = || one.labels.iter().map(|label| label.span);
        finding.labels.iter().any(|label| places().any(|place| is_there(place, label.span)))
    })
}

/// The design of a logic text. A text with neither a circuit nor macrocells is not a design.
fn logic_design(
    mut said: grafsynth_backend_pld::read::Text,
    texts: &Texts,
    found: &mut Vec<Diagnostic>,
) -> Option<Design> {
    if let (Some(logic), Some(stem)) = (&mut said.logic, &texts.stem)
        && logic.name.text.is_empty()
    {
        logic.name.text = stem.identifier();
    }
    found.extend(said.findings.iter().cloned());
    if any_error(found) || said.logic.is_none() && said.placement.is_err() {
        found.extend(said.beyond);
        return None;
    }
    kept(LogicDesign::of_text(said), found).map(|design| Design::Logic(Box::new(design)))
}

/// The value, if there is one; otherwise the findings of the failure are added to the others.
fn kept<T>(made: Result<T, Vec<Diagnostic>>, found: &mut Vec<Diagnostic>) -> Option<T> {
    made.map_err(|more| found.extend(more)).ok()
}

fn unknown_language(path: &str) -> Diagnostic {
    let message = format!("cannot determine the format of {path} from its name");
    Diagnostic::error(codes::UNKNOWN_FORMAT, message).help(format!(
        "give it with --from, as in `--from graf`, or rename the file; endings: {}",
        languages::extensions(|_| true)
    ))
}

/// Reads the property files for a net, whose integer names define the meaning of `+` and `*`.
fn read_properties(
    sources: &Sources,
    texts: &Texts,
    limits: ReadLimits,
    net: &Net,
) -> (Vec<chart::Property>, Vec<Diagnostic>) {
    let inputs = net.inputs.values().map(|input| (&input.name, input.ty));
    let outputs = net.outputs.values().map(|output| (&output.name, output.ty));
    let vars = net.vars.values().map(|var| (&var.name, var.ty));
    let integers: Vec<&str> = inputs
        .chain(outputs)
        .chain(vars)
        .filter(|(_, ty)| !ty.is_bool())
        .map(|(name, _)| name.text.as_str())
        .collect();
    let mut properties = Vec::new();
    let mut found = Vec::new();
    for file in &texts.properties {
        if let Some(source) = sources.get(*file) {
            let (more, diagnostics) = grafsynth_frontend::props::parse_for(
                *file,
                &source.text,
                integers.iter().copied(),
                &limits.front(),
            );
            properties.extend(more);
            found.extend(diagnostics);
        }
    }
    (properties, found)
}

fn chart_design(
    sources: &Sources,
    texts: &Texts,
    limits: ReadLimits,
    design: Option<chart::Design>,
    found: &mut Vec<Diagnostic>,
) -> Option<Design> {
    let mut design = design?;
    let front = limits.front();
    libraries::resolve(sources, texts, &front, &mut design, found);
    let mut design = libraries::last_alone(design);
    if let Some(stem) = &texts.stem {
        for chart in design.charts.iter_mut().filter(|chart| chart.is_unnamed) {
            chart.name.text = stem.identifier();
        }
    }
    if let Some(file) = texts.board
        && let Some(source) = sources.get(file)
    {
        let (board, diagnostics) =
            grafsynth_frontend::board::parse_within(file, &source.text, &limits.front());
        found.extend(diagnostics);
        if let Some(chart) = design.charts.first_mut() {
            // The board file is separate so that one chart can be used with several boards: it replaces the chart's own board.
            if !board.boards.is_empty() {
                chart.items.retain(|item| !matches!(item, chart::Item::Board(_)));
            }
            chart.items.extend(board.boards.into_iter().map(chart::Item::Board));
            chart.items.extend(board.places.into_iter().map(chart::Item::Place));
        }
    }
    let (net, more, counted) = task_costs::lower(&design, texts.machine);
    // After an error of the reader, parts of the design are missing, so warnings about the rest could be wrong.
    let is_whole = !any_error(found);
    // The error "no initial step" could be wrong too, because the reader may have refused the declaration of that step.
    let is_kept = |finding: &Diagnostic| {
        is_whole || finding.is_error() && finding.code != lower::codes::NO_INITIAL_STEP
    };
    found.extend(more.into_iter().filter(is_kept));
    let mut design = with_properties(sources, texts, limits, Some(design), net?, found)?;
    if let Design::Net(design) = &mut design {
        design.counted = counted;
    }
    Some(design)
}

fn with_properties(
    sources: &Sources,
    texts: &Texts,
    limits: ReadLimits,
    chart: Option<chart::Design>,
    net: Valid<Net>,
    found: &mut Vec<Diagnostic>,
) -> Option<Design> {
    let mut net = net;
    if !texts.properties.is_empty() {
        let (properties, more) = read_properties(sources, texts, limits, &net);
        found.extend(more);
        let with_all = lower::properties(&net, &properties).and_then(|more| {
            let mut net = net.into_inner();
            net.properties.extend(more);
            validate(net)
        });
        net = kept(with_all, found)?;
    }
    Some(Design::Net(Box::new(NetDesign { chart, net, counted: None, library: None })))
}
