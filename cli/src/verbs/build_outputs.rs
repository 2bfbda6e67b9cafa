//! The outputs of a build as files: all of them are written, or none; and the exit code that follows from their results.

use super::build_results::say;
use crate::args::{Build, ReportForm};
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use crate::report_page;
use grafsynth_draw::{Options, layout, svg};
use grafsynth_driver::codes;
use grafsynth_driver::pipeline::{Built, MapEntry, OutputFile};
use grafsynth_driver::report::{self, Document, Outcome, OutputReport, OutputVerdict};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::chart::Design;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_verify::OpenReason;
use serde_json::json;

/// The result of a build.
pub(super) struct Made<'a> {
    /// The beginning of the file name of the list of outputs.
    pub(super) stem: &'a FileStem,
    /// The chart, or the pins of logic.
    pub(super) net: &'a Valid<Net>,
    /// The texts that determine the outputs.
    pub(super) made_of: Vec<files::Hashed>,
    /// The files.
    pub(super) outputs: Vec<files::Output>,
    /// Their results.
    pub(super) lines: &'a [OutputReport],
}

/// Shows the findings, writes all files or none, and reports the results.
pub(super) fn write(
    session: &Session,
    arguments: &Build,
    made: Made<'_>,
    mut found: Vec<Diagnostic>,
) -> Result<(), Stop> {
    let Made { stem, net, made_of, outputs, lines } = made;
    let read = session.paths();
    let folder = &arguments.output;
    let plan = files::Plan { folder, stem: stem.as_str(), made_of, read, outputs };
    found.extend(stale(&plan.stale()));
    session.show(&found);
    let written = plan.write();
    let unwritten = written.as_ref().err().map(String::as_str);
    say(session, net, arguments.trace_file(), lines, unwritten)?;
    Ok(written?)
}

/// Warns about files that remain from an older text of the same chart.
fn stale(all: &[files::Stale]) -> Option<Diagnostic> {
    let first = all.first()?;
    let files: Vec<&str> = all.iter().map(|stale| stale.file.as_str()).collect();
    let (files, was) = (files.join(", "), if all.len() == 1 { "was" } else { "were" });
    let message = format!("{files} {was} made from an older {}", first.source);
    let help = "build these targets again too, or delete the files";
    Some(Diagnostic::warning(codes::OLDER_SOURCE, message).help(help))
}

/// The exit code for the written outputs. A proof that the user did not request does not count as an open question; an output that was not even tested does
/// count as one.
pub(super) fn judged(session: &Session, arguments: &Build, lines: &[OutputReport]) -> Exit {
    let of_line = |line: &OutputReport| match &line.verdict {
        OutputVerdict::ReadBack(open) | OutputVerdict::Open(open)
            if arguments.no_proof
                && open.reasons.iter().all(|reason| *reason == OpenReason::NotAsked) =>
        {
            Exit::Done
        }
        OutputVerdict::ReadBack(open) | OutputVerdict::Open(open) => session.demands.open(open),
        OutputVerdict::Proved(_) | OutputVerdict::Refuted(_) | OutputVerdict::NotChecked
            if line.outcome() == Outcome::Open && !arguments.no_proof =>
        {
            Exit::Open
        }
        OutputVerdict::Proved(_) | OutputVerdict::Refuted(_) | OutputVerdict::NotChecked => {
            Exit::Done
        }
    };
    lines.iter().map(of_line).fold(Exit::Done, Exit::worse)
}

/// The files with their maps, and the bitstreams.
pub(super) fn outputs(
    session: &Session,
    arguments: &Build,
    built: &Built,
    bitstreams: Vec<(String, Vec<u8>)>,
) -> Vec<files::Output> {
    let output = |name, bytes| files::Output { name, bytes, keep_existing: false };
    let mut all: Vec<_> = bitstreams.into_iter().map(|(name, it)| output(name, it)).collect();
    for file in &built.files {
        let keep_existing = file.keep_existing;
        let is_kept = keep_existing && files::exists(&arguments.output.join(&file.name));
        if arguments.emit.is_some() && !file.map.is_empty() && !is_kept {
            let map = map_text(session, &file.name, &file.map).into_bytes();
            all.push(output(format!("{}.map.json", file.name), map));
        }
        let bytes = file.text.clone().into_bytes();
        all.push(files::Output { name: file.name.clone(), bytes, keep_existing });
    }
    all
}

fn map_text(session: &Session, name: &str, map: &[MapEntry]) -> String {
    let lines: Vec<_> = map
        .iter()
        .map(|entry| {
            let start = session.sources.start(entry.span);
            json!({
                "line": entry.line,
                "name": entry.name,
                "source": session.sources.get(entry.span.file).map(|source| source.path.clone()),
                "source_line": start.map(|at| at.line),
                "source_column": start.map(|at| at.column),
                "req": entry.req,
            })
        })
        .collect();
    let mut text =
        serde_json::to_string_pretty(&json!({"file": name, "lines": lines})).unwrap_or_default();
    text.push('\n');
    text
}

/// The files of a report. Its page shows the chart if that can be drawn.
pub(super) fn report_files(
    form: ReportForm,
    document: &Document,
    chart: Option<(&Design, &Options<'_>)>,
    stem: &FileStem,
) -> Vec<OutputFile> {
    let one = |name, text| OutputFile { name, text, keep_existing: false, map: Vec::new() };
    match form {
        ReportForm::Html => {
            let picture = chart.and_then(|(chart, drawn)| layout(chart, drawn).ok());
            let chart = picture.map(|it| report_page::Chart { svg: svg(&it), width: it.width });
            let page = report_page::html(document, chart.as_ref());
            vec![one(format!("{stem}.report.html"), page)]
        }
        ReportForm::Md => report::markdown_files(document, stem),
        ReportForm::Json => {
            vec![one(format!("{stem}.report.json"), report::json(document))]
        }
    }
}
