//! Shows the runs that demonstrate a result, as text for people and as trace files.
//!
//! People see only the relevant part of a run ([`Evidence`]), in at most [`MOST_ROWS`] lines. `--trace FILE` writes every column of every row;
//! `sim --stimulus FILE` replays that file if it is a `.csv`.

use crate::load::{Session, Stop};
use crate::waves::of_trace;
use grafsynth_draw::{svg, waves};
use grafsynth_driver::evidence::{Broken, Evidence, MOST_ROWS, Piece};
use grafsynth_driver::source::Sources;
use grafsynth_ir::net::Net;
use grafsynth_sim::Trace;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The formats that `--trace FILE` can write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Csv,
    Jsonl,
    Vcd,
    Svg,
}

/// The format of a trace file, by the extension of its name.
fn form(path: &Path) -> Result<Form, Stop> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("csv") => Ok(Form::Csv),
        Some("jsonl") => Ok(Form::Jsonl),
        Some("vcd") => Ok(Form::Vcd),
        Some("svg") => Ok(Form::Svg),
        Some(_) | None => {
            Err(Stop::Usage(format!("{}: a trace is .csv, .jsonl, .vcd or .svg", path.display())))
        }
    }
}

/// The text of a trace, in the format given by the extension of the file name.
pub(crate) fn trace_text(path: &Path, trace: &Trace) -> Result<String, Stop> {
    Ok(match form(path)? {
        Form::Csv => trace.to_csv(),
        Form::Jsonl => trace.to_jsonl(),
        Form::Vcd => trace.to_vcd(),
        Form::Svg => svg(&waves(&of_trace(trace))),
    })
}

/// True for the name of a drawing of waveforms.
pub(crate) fn is_drawing(path: &Path) -> bool {
    matches!(form(path), Ok(Form::Svg))
}

/// Rejects a file name without the extension of a trace format, before any other work.
pub(crate) fn check_name(path: Option<&Path>) -> Result<(), Stop> {
    path.map_or(Ok(()), |path| form(path).map(|_| ()))
}

/// The name of the `n`-th trace file, from 1: `FILE`, then `FILE-2`, `FILE-3`.
fn numbered(path: &Path, n: usize) -> PathBuf {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let extension = path.extension().and_then(|one| one.to_str()).unwrap_or_default();
    match n {
        1 => path.to_owned(),
        n => path.with_file_name(format!("{stem}-{n}.{extension}")),
    }
}

/// The relevant part of runs as text, and the trace files with the whole runs.
#[derive(Debug, Default)]
pub(crate) struct Shown {
    /// The text.
    pub(crate) text: String,
    /// The names of the trace files.
    pub(crate) files: Vec<String>,
}

impl Session {
    /// The relevant part of runs as text for people. The traces, each with a title if there are several, are written to the file of `--trace`, if it was given: the
    /// first of a command to that name, further ones to numbered names.
    pub(crate) fn shown(
        &self,
        path: Option<&Path>,
        evidence: &Evidence,
        traces: &[(&str, &Trace)],
    ) -> Result<Shown, Stop> {
        let files = self.keep_traces(path, traces)?;
        let (mut text, left_out) = table(evidence);
        if let Some(broken) = &evidence.broken {
            text += &format!("    broken: {}\n", broken_text(&self.sources, broken));
        }
        let titled: Vec<String> = files
            .iter()
            .zip(traces)
            .map(|(file, (title, _))| match *title {
                "" => file.clone(),
                title => format!("{file} ({title})"),
            })
            .collect();
        let (names, total) = (titled.join(" and "), evidence.rows.len());
        text += &match (left_out, titled.len()) {
            (0, 0) => String::new(),
            (0, 1) => format!("    the trace is in {names}\n"),
            (0, _) => format!("    the traces are in {names}\n"),
            (n, 0) => format!("    {n} of {total} rows are not shown; --trace FILE writes all\n"),
            (n, _) => format!("    {n} of {total} rows are not shown; all are in {names}\n"),
        };
        Ok(Shown { text, files })
    }

    /// Writes traces to the file of `--trace`, if it was given, and returns the names.
    fn keep_traces(
        &self,
        path: Option<&Path>,
        traces: &[(&str, &Trace)],
    ) -> Result<Vec<String>, Stop> {
        let Some(path) = path else { return Ok(Vec::new()) };
        let mut written = Vec::new();
        for (_, trace) in traces {
            self.traces.set(self.traces.get() + 1);
            let name = numbered(path, self.traces.get());
            written.push(name.display().to_string());
            self.write_named(vec![(name, trace_text(path, trace)?.into_bytes())])?;
        }
        Ok(written)
    }

    /// If `--trace` wrote nothing, reports this, because an existing file of that name is from an earlier run.
    pub(crate) fn no_trace(&self, path: Option<&Path>) {
        if let Some(path) = path.filter(|_| self.traces.get() == 0) {
            let path = path.display();
            self.note(&format!("no counterexample was found, so {path} was not written\n"));
        }
    }

    /// A line for people with the location of the declaration of a trace column; empty if the column is not declared in a text.
    pub(crate) fn declaration(&self, net: &Net, column: &str) -> String {
        let plain = column.split('[').next().unwrap_or(column);
        let inputs = net.inputs.values().map(|input| (&input.name.text, input.meta.span));
        let outputs = net.outputs.values().map(|output| (&output.name.text, output.meta.span));
        let vars = net.vars.values().map(|var| (&var.name.text, var.meta.span));
        let mut all = outputs.chain(vars).chain(inputs);
        let place = all.find(|(name, _)| *name == plain);
        match place.map(|(_, span)| self.sources.describe(span)).filter(|it| !it.is_empty()) {
            Some(place) => format!("  {column} is declared at {place}\n"),
            None => String::new(),
        }
    }
}

/// The rows of a trace up to this one.
pub(crate) fn up_to(row: usize, trace: &Trace) -> Trace {
    Trace { layout: trace.layout.clone(), rows: trace.rows.iter().take(row + 1).cloned().collect() }
}

/// The broken term with its values: `a and b (a = 1, b = 1)`; only the values if they show the whole term.
fn broken_text(sources: &Sources, broken: &Broken) -> String {
    let parts: Vec<String> = broken
        .parts
        .iter()
        .map(|part| {
            let unit = match (part.is_time, part.value) {
                (false, _) => "",
                (true, 1) => " tick",
                (true, _) => " ticks",
            };
            format!("{} = {}{unit}", part.name, part.value)
        })
        .collect();
    let parts = parts.join(", ");
    match term(sources, broken) {
        Some(term) if broken.parts.iter().all(|part| part.name != term) => {
            format!("{term} ({parts})")
        }
        Some(_) | None => parts,
    }
}

/// The text of a broken term, on one line; `None` if it is not in a source text.
fn term(sources: &Sources, broken: &Broken) -> Option<String> {
    let text = sources.get(broken.span.file)?.text.get(broken.span.range())?;
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // The parentheses of `never ( .. )` belong to the property, not to the term.
    let inner = text.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
    let text = match inner {
        Some(inner) if !inner.contains(['(', ')']) => inner.to_owned(),
        Some(_) | None => text,
    };
    (!text.is_empty()).then_some(text)
}

/// The broken term for machines.
pub(crate) fn broken_json(sources: &Sources, broken: &Broken) -> Value {
    let parts: Vec<Value> =
        broken.parts.iter().map(|part| json!({"name": part.name, "value": part.value})).collect();
    match term(sources, broken) {
        Some(term) => json!({"term": term, "parts": parts}),
        None => json!({"parts": parts}),
    }
}

/// The rows as an aligned table, and the number of rows left out.
fn table(evidence: &Evidence) -> (String, usize) {
    let pieces = evidence.excerpt(MOST_ROWS);
    let mut left_out = 0;
    // One line of cells for each piece; `None` for a gap.
    let lines: Vec<Option<Vec<String>>> = pieces
        .iter()
        .map(|piece| match piece {
            Piece::Gap(n) => {
                left_out += n;
                None
            }
            Piece::Rows(first, times) => {
                let mut cells = evidence.rows[*first].clone();
                if *times > 1 {
                    let last = evidence.rows.get(first + times - 1);
                    let last = last.and_then(|row| row.first()).map_or("", String::as_str);
                    if let Some(number) = cells.first_mut() {
                        *number = format!("{number}..{last}");
                    }
                    cells.push(format!("x {times}"));
                }
                Some(cells)
            }
        })
        .collect();
    let shown = || lines.iter().flatten();
    let width = |at: usize| {
        let cells = shown().filter_map(|line| line.get(at)).map(|cell| cell.chars().count());
        cells.chain([evidence.columns[at].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..evidence.columns.len()).map(width).collect();
    // Names are aligned at their beginning, numbers at their end.
    let is_number = |at: usize| {
        at == 0
            || shown()
                .filter_map(|line| line.get(at))
                .all(|cell| cell.trim_start_matches('-').chars().all(|c| c.is_ascii_digit()))
                && shown().any(|line| line.get(at).is_some_and(|cell| !cell.is_empty()))
    };
    let numbers: Vec<bool> = (0..evidence.columns.len()).map(is_number).collect();
    let row = |cells: &[String]| {
        let mut text = String::from("   ");
        for (at, cell) in cells.iter().enumerate() {
            let width = widths.get(at).copied().unwrap_or(0);
            match numbers.get(at) {
                Some(true) => text += &format!(" {cell:>width$} "),
                Some(false) | None => text += &format!(" {cell:<width$} "),
            }
        }
        text.truncate(text.trim_end().len());
        text + "\n"
    };
    let mut text = row(&evidence.columns);
    for (line, piece) in lines.iter().zip(&pieces) {
        match (line, piece) {
            (Some(cells), _) => text += &row(cells),
            (None, Piece::Gap(n)) => text += &format!("    ... {n} rows\n"),
            (None, Piece::Rows(..)) => {}
        }
    }
    (text, left_out)
}
