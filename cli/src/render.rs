//! Shows findings to people, with their source lines or in one line each. Reports for machines are in [`crate::report`].

mod fold;

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Patch, Renderer, Snippet};
use fold::Folded;
use grafsynth_driver::source::{Source, Sources};
use grafsynth_ir::diag::{Diagnostic, Fix, Label, Notation, Severity};
use grafsynth_ir::{FileId, Span};
use similar::DiffTag;
use similar::algorithms::{Capture, Compact, Replace, myers};
use std::ops::Range;
use std::path::Path;

/// How findings are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MessageFormat {
    /// With the source lines, for people.
    Human,
    /// `path:line:column: error[G0101]: message`, one line each.
    Short,
    /// One JSON object per line (docs/report-json.md): findings in the shape of an LSP diagnostic, and every answer.
    Json,
    /// One SARIF 2.1.0 document, with every answer.
    Sarif,
}

/// Settings for how findings are shown.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    /// The format.
    pub(crate) format: MessageFormat,
    /// Colours.
    pub(crate) color: bool,
    /// The maximum number of findings shown for a file; the others are counted.
    pub(crate) max_diagnostics: usize,
    /// Width of the terminal in columns.
    pub(crate) width: usize,
    /// Height of the terminal in lines; `None` if the output goes to a file or a pipe.
    pub(crate) height: Option<usize>,
}

/// Findings as texts for people. Several findings of one kind are one text.
pub(crate) struct Rendered {
    /// The severity of each text, including those that were left out.
    pub(crate) found: Vec<Severity>,
    /// The texts, errors first, those of one severity in the order of their locations; with an empty line at the end of each in the format for people.
    pub(crate) texts: Vec<String>,
    /// How many were left out for each file.
    pub(crate) hidden: String,
}

/// Renders at most [`Style::max_diagnostics`] findings of each file for people.
pub(crate) fn render(sources: &Sources, diagnostics: &[Diagnostic], style: Style) -> Rendered {
    let folded = match style.format {
        MessageFormat::Short => fold::apart(sorted(diagnostics)),
        MessageFormat::Human | MessageFormat::Json | MessageFormat::Sarif => {
            fold::fold(sources, sorted(diagnostics))
        }
    };
    let found = folded.iter().map(|one| one.first.severity).collect();
    let (mut shown, hidden) = limit(folded, |one| one.first, style.max_diagnostics);
    shown.sort_by_key(|one| one.first.severity);
    let color = if style.color { Renderer::styled() } else { Renderer::plain() };
    let renderer = color.decor_style(DecorStyle::Ascii).term_width(style.width);
    let text = |one: &Folded<'_>| match style.format {
        MessageFormat::Short => short(sources, one.first),
        MessageFormat::Human | MessageFormat::Json | MessageFormat::Sarif => {
            human(sources, one, &renderer) + "\n\n"
        }
    };
    let texts = shown.iter().map(text).collect();
    Rendered { found, texts, hidden: hidden_text(sources, &hidden) }
}

/// The findings, with help texts in the notation of the language of each file.
pub(crate) fn spoken(sources: &Sources, diagnostics: &[Diagnostic]) -> Vec<Diagnostic> {
    diagnostics
        .iter()
        .map(|diagnostic| diagnostic.clone().spoken(notation(sources, diagnostic)))
        .collect()
}

/// The notation of the file of a finding.
fn notation(sources: &Sources, diagnostic: &Diagnostic) -> Notation {
    let first = diagnostic.labels.first().and_then(|label| sources.get(label.span.file));
    let path = first.map_or("", |source| source.path.as_str());
    let extension = Path::new(path).extension().and_then(|one| one.to_str()).unwrap_or_default();
    match extension.to_ascii_lowercase().as_str() {
        "rules" => Notation::Rules,
        "scxml" => Notation::Scxml,
        "st" | "xml" => Notation::Iec,
        "c" | "h" => Notation::C,
        _ => Notation::Graf,
    }
}

/// The number of findings that were left out, for each file.
pub(crate) type Hidden = Vec<(Option<FileId>, usize)>;

/// The findings in the order of their locations, at most `max` per file, and how many were left out.
pub(crate) fn sorted_and_limited(
    diagnostics: &[Diagnostic],
    max: usize,
) -> (Vec<&Diagnostic>, Hidden) {
    limit(sorted(diagnostics), |one| one, max)
}

/// The findings in the order of their locations; those without a location are last.
fn sorted(diagnostics: &[Diagnostic]) -> Vec<&Diagnostic> {
    let mut sorted: Vec<&Diagnostic> = diagnostics.iter().collect();
    sorted.sort_by_key(|diagnostic| {
        diagnostic.labels.first().map_or((1, Span::default()), |label| (0, label.span))
    });
    sorted
}

/// Keeps at most `max` findings per file, errors before warnings before notes; returns for each file how many were left out.
fn limit<'a, T>(
    sorted: Vec<T>,
    finding: impl Fn(&T) -> &'a Diagnostic,
    max: usize,
) -> (Vec<T>, Hidden) {
    let file = |one: &T| finding(one).labels.first().map(|label| label.span.file);
    let mut files: Vec<Option<FileId>> = sorted.iter().map(&file).collect();
    files.sort_unstable();
    files.dedup();
    let mut is_kept = vec![true; sorted.len()];
    let mut hidden = Vec::new();
    for of in files {
        let mut all: Vec<usize> = (0..sorted.len()).filter(|at| file(&sorted[*at]) == of).collect();
        if all.len() > max {
            hidden.push((of, all.len() - max));
            all.sort_unstable_by_key(|at| (finding(&sorted[*at]).severity, *at));
            all[max..].iter().for_each(|at| is_kept[*at] = false);
        }
    }
    let kept = sorted.into_iter().zip(is_kept).filter(|(_, is_kept)| *is_kept);
    (kept.map(|(one, _)| one).collect(), hidden)
}

pub(crate) fn severity_word(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}

fn level(severity: Severity) -> Level<'static> {
    match severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    }
}

fn hidden_text(sources: &Sources, hidden: &[(Option<FileId>, usize)]) -> String {
    hidden
        .iter()
        .map(|(file, count)| {
            let path =
                file.and_then(|file| sources.get(file)).map_or("", |source| source.path.as_str());
            format!("{path}: {count} more not shown (see --max-diagnostics)\n")
        })
        .collect()
}

pub(crate) fn short(sources: &Sources, diagnostic: &Diagnostic) -> String {
    let place =
        diagnostic.labels.first().map(|label| sources.describe(label.span)).unwrap_or_default();
    let separator = if place.is_empty() { "" } else { ": " };
    let severity = severity_word(diagnostic.severity);
    let (code, message) = (diagnostic.code.id, &diagnostic.message);
    format!("{place}{separator}{severity}[{code}]: {message}\n")
}

/// The longest part of a source line that is shown; longer lines are cut to a window around the place.
const LINE_WINDOW: usize = 200;
/// Locations of one file that are more lines apart than this are shown in separate windows.
const LINES_APART: usize = 8;

fn human(sources: &Sources, folded: &Folded<'_>, renderer: &Renderer) -> String {
    let diagnostic = folded.first;
    let title =
        level(diagnostic.severity).primary_title(folded.message.as_str()).id(diagnostic.code.id);
    let mut group: Group<'_> = Group::with_title(title);
    let windows = windows(sources, &folded.labels, folded.n_main);
    for window in &windows {
        let mut snippet = Snippet::source(window.text.as_str())
            .path(window.path)
            .line_start(window.first_line + 1)
            .fold(true);
        for (range, label, is_primary) in &window.annotations {
            let kind = if *is_primary { AnnotationKind::Primary } else { AnnotationKind::Context };
            let annotation = kind.span(range.clone());
            snippet = snippet.annotation(if label.is_empty() {
                annotation
            } else {
                annotation.label(label.as_str())
            });
        }
        group = group.element(snippet);
    }
    if let Some(rest) = &folded.rest {
        group = group.element(Level::NOTE.message(rest.as_str()));
    }
    let mut fix_group = None;
    let fix = diagnostic.fix.as_ref().and_then(|fix| Some((fix, patched(sources, fix)?)));
    if let Some((fix, window)) = &fix {
        let title = folded.help.clone().unwrap_or_else(|| "write instead".to_owned());
        if let Some((range, _, _)) = window.annotations.first() {
            // One snippet for each patch: several patches of one snippet show only the new lines, not the deleted ones.
            let snippets = patches(&window.text, range.clone(), &fix.replacement).map(|patch| {
                Snippet::source(window.text.as_str())
                    .path(window.path)
                    .line_start(window.first_line + 1)
                    .patch(patch)
            });
            let title = Group::with_title(Level::HELP.secondary_title(title));
            fix_group = Some(title.elements(snippets));
        }
    } else if let Some(help) = &folded.help {
        group = group.element(Level::HELP.message(help.as_str()));
    }
    if windows.is_empty()
        && let Some(label) = diagnostic.labels.first()
        && let Some(source) = sources.get(label.span.file)
    {
        group = group.element(Origin::path(source.path.as_str()));
    }
    let groups: Vec<Group<'_>> = std::iter::once(group).chain(fix_group).collect();
    renderer.render(&groups)
}

/// A part of a source text with its marks, in bytes of that part.
struct Window<'a> {
    path: &'a str,
    first_line: usize,
    text: String,
    annotations: Vec<(Range<usize>, String, bool)>,
}

/// Groups the labels by file and nearness, and extracts their source lines. The first `n_main` labels are the main ones.
fn windows<'a>(sources: &'a Sources, labels: &[Label], n_main: usize) -> Vec<Window<'a>> {
    let mut rest: Vec<(usize, &Label)> = labels.iter().enumerate().collect();
    let mut windows = Vec::new();
    while let Some((_, first)) = rest.first().copied() {
        let Some(source) = sources.get(first.span.file) else {
            rest.remove(0);
            continue;
        };
        let at = source.line_of(first.span.start as usize);
        let (near, far): (Vec<_>, Vec<_>) = rest.into_iter().partition(|(_, label)| {
            label.span.file == first.span.file
                && source.line_of(label.span.start as usize).abs_diff(at) <= LINES_APART
        });
        rest = far;
        windows.push(window(source, &near, n_main));
    }
    windows
}

/// An edit as one patch for each group of changed lines, so that equal lines between them are not shown as changed, and deleted lines are shown.
fn patches<'a>(
    text: &str,
    range: Range<usize>,
    replacement: &'a str,
) -> impl Iterator<Item = Patch<'a>> {
    let old: Vec<&str> =
        text.get(range.clone()).unwrap_or_default().split_inclusive('\n').collect();
    let new: Vec<&str> = replacement.split_inclusive('\n').collect();
    // The number of bytes in front of each line.
    let starts = |lines: &[&str]| -> Vec<usize> {
        let ends = lines.iter().scan(0, |end, line| {
            *end += line.len();
            Some(*end)
        });
        std::iter::once(0).chain(ends).collect()
    };
    let (old_starts, new_starts) = (starts(&old), starts(&new));
    let bytes = |starts: &[usize], lines: Range<usize>| starts[lines.start]..starts[lines.end];
    // A last line that only lost its line break is equal.
    let keys = |lines: &[&str]| -> Vec<String> {
        lines.iter().map(|line| line.trim_end_matches('\n').to_owned()).collect()
    };
    let (old_keys, new_keys) = (keys(&old), keys(&new));
    // By name: a choice of algorithm at run time compiles all of them.
    let mut diff = Compact::new(Replace::new(Capture::new()), &old_keys, &new_keys);
    let Ok(()) = myers::diff(&mut diff, &old_keys, 0..old.len(), &new_keys, 0..new.len());
    let changes = diff.into_inner().into_inner().into_ops();
    changes.into_iter().filter(|change| change.tag() != DiffTag::Equal).map(move |change| {
        let was = bytes(&old_starts, change.old_range());
        let is = bytes(&new_starts, change.new_range());
        Patch::new(range.start + was.start..range.start + was.end, &replacement[is])
    })
}

/// The source lines that an edit changes, with its span: all of them, so that deleted lines are shown too.
fn patched<'a>(sources: &'a Sources, fix: &Fix) -> Option<Window<'a>> {
    let source = sources.get(fix.span.file)?;
    let (start, end) = (fix.span.start as usize, fix.span.end as usize);
    let (first, last) = (source.line_of(start), source.line_of(end));
    if first == last {
        let label = Label { span: fix.span, text: String::new() };
        return windows(sources, std::slice::from_ref(&label), 1).into_iter().next();
    }
    let (from, to) = (source.line_range(first).start, source.line_range(last).end);
    let text = source.text.get(from..to)?.to_owned() + "\n";
    let annotations = vec![(start - from..end - from, String::new(), true)];
    Some(Window { path: source.path.as_str(), first_line: first, text, annotations })
}

fn window<'a>(source: &'a Source, labels: &[(usize, &Label)], n_main: usize) -> Window<'a> {
    let lines = || labels.iter().map(|(_, label)| source.line_of(label.span.start as usize));
    let (first_line, last_line) = (lines().min().unwrap_or(0), lines().max().unwrap_or(0));
    // Only the first line of a span over several lines is shown.
    let mut text = String::new();
    let mut annotations = Vec::new();
    for line in first_line..=last_line {
        let range = source.line_range(line);
        let here: Vec<_> = labels
            .iter()
            .filter(|(_, label)| source.line_of(label.span.start as usize) == line)
            .collect();
        let anchor =
            here.iter().map(|(_, label)| label.span.start as usize).min().unwrap_or(range.start);
        let (from, to) = if range.len() <= LINE_WINDOW {
            (range.start, range.end)
        } else {
            let from = source.boundary(anchor.saturating_sub(LINE_WINDOW / 2).max(range.start));
            (from, source.boundary((from + LINE_WINDOW).min(range.end)))
        };
        let offset = text.len();
        text.push_str(source.text.get(from..to).unwrap_or_default());
        for (index, label) in here {
            let start = source.boundary((label.span.start as usize).clamp(from, to));
            let mut end = source.boundary((label.span.end as usize).clamp(start, to));
            if end == start && start < to {
                end = start
                    + source
                        .text
                        .get(start..)
                        .and_then(|s| s.chars().next())
                        .map_or(0, char::len_utf8);
            }
            annotations.push((
                offset + start - from..offset + end - from,
                label.text.clone(),
                *index < n_main,
            ));
        }
        text.push('\n');
    }
    Window { path: source.path.as_str(), first_line, text, annotations }
}

pub(crate) fn path_of(sources: &Sources, span: Span) -> &str {
    sources.get(span.file).map_or("", |source| source.path.as_str())
}
