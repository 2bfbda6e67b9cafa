//! Library charts from other files: `use "FILE"` at the top of a chart.
//!
//! The driver opens no files. The caller asks `wanted` which files a text names, adds their texts to the table of sources and lists them in
//! [`Texts::libraries`](crate::texts::Texts); `resolve` joins them.

use crate::codes;
use crate::source::Sources;
use crate::task_costs;
use crate::texts::Texts;
use grafsynth_backend_c::cost::Machine;
use grafsynth_frontend::graf::{self, Limits};
use grafsynth_ir::chart::{Design, Import};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId};
use grafsynth_sim::Stimulus;
use itertools::Itertools;

/// The maximum number of files that one design may use.
const MAX_FILES: usize = 1_000;

/// The names of the files that a chart uses, as written. Only the top of the text is read.
#[must_use]
pub fn wanted(file: FileId, text: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for import in graf::imports(file, text) {
        if !names.contains(&import.file) {
            names.push(import.file);
        }
    }
    names
}

/// Adds the library charts of all files that a design uses, directly or indirectly, each file once and after the files that it uses itself.
pub(crate) fn resolve(
    sources: &Sources,
    texts: &Texts,
    limits: &Limits,
    design: &mut Design,
    found: &mut Vec<Diagnostic>,
) {
    let own = design.libraries.len();
    let main = texts.main;
    let mut reading =
        Reading { sources, texts, limits, open: vec![main], done: Vec::new(), design, found };
    let imports = reading.design.imports.clone();
    reading.all(main, &imports);
    // Files are named at the top of the text, so their library charts come before those of the text.
    design.libraries.rotate_left(own);
}

struct Reading<'a> {
    sources: &'a Sources,
    texts: &'a Texts,
    limits: &'a Limits,
    /// The chain of files that leads to the current one.
    open: Vec<FileId>,
    done: Vec<FileId>,
    design: &'a mut Design,
    found: &'a mut Vec<Diagnostic>,
}

impl Reading<'_> {
    fn all(&mut self, from: FileId, imports: &[Import]) {
        for import in imports {
            let known = self
                .texts
                .libraries
                .iter()
                .find(|library| library.from == from && library.name == import.file);
            match known {
                Some(library) => self.one(library.text, import),
                None => {
                    let is_absent = self
                        .texts
                        .absent
                        .iter()
                        .any(|(of, name)| *of == from && *name == import.file);
                    let (what, help) = if is_absent {
                        let own = self.sources.get(from).map_or("", |source| source.path.as_str());
                        let folder = own.rfind(['/', '\\']).map_or("", |at| &own[..=at]);
                        let help = format!(
                            "looked for `{folder}{}`: write the path relative to this file",
                            import.file
                        );
                        ("does not exist", help)
                    } else {
                        let help = "it must be a text file below the folder of the chart; --root DIR allows another folder";
                        ("cannot be read", help.to_owned())
                    };
                    let message = format!("the library file `{}` {what}", import.file);
                    let finding = Diagnostic::error(codes::LIBRARY_FILE, message);
                    self.found.push(finding.at(import.span, "named here").help(help));
                }
            }
        }
    }

    fn one(&mut self, file: FileId, import: &Import) {
        if let Some(start) = self.open.iter().position(|open| *open == file) {
            let mut names: Vec<&str> = self.open[start..]
                .iter()
                .filter_map(|file| self.sources.get(*file))
                .map(|source| source.path.as_str())
                .collect();
            names.push(&import.file);
            self.found.push(
                Diagnostic::error(
                    codes::LIBRARY_FILE,
                    format!("library files use each other in a cycle: {}", names.join(" -> ")),
                )
                .at(import.span, "closes the cycle")
                .help("move the charts that both need to a separate file"),
            );
            return;
        }
        if self.done.contains(&file) || self.done.len() >= MAX_FILES {
            return;
        }
        self.done.push(file);
        let Some(source) = self.sources.get(file) else { return };
        let parsed = graf::parse_within(file, &source.text, self.limits);
        self.found.extend(parsed.diagnostics);
        let Some(library) = parsed.design else { return };
        if let Some(chart) = library.charts.first() {
            self.found.push(
                Diagnostic::error(
                    codes::LIBRARY_FILE,
                    format!("chart `{}` is in a library file", chart.name),
                )
                .at(chart.name.span, "not a library chart, so other files cannot use it")
                .at(import.span, "used here")
                .help("declare it as `library chart`, and `use` it where it is to run"),
            );
        }
        self.open.push(file);
        self.all(file, &library.imports);
        self.open.pop();
        self.design.libraries.extend(library.libraries);
    }
}

/// The design to use if a file contains only library charts: the last one, which may use the others, with its parameters as inputs and
/// outputs.
pub(crate) fn last_alone(design: Design) -> Design {
    if !design.charts.is_empty() {
        return design;
    }
    // A file that only names others has no library chart.
    let last = design.libraries.len().checked_sub(1);
    last.and_then(|last| grafsynth_ir::lower::alone(&design, last)).unwrap_or(design)
}

/// Checks the certificates of a design's library charts: the text must be the one that was certified, and its properties are proved again.
///
/// Each certified property gets one proof, within `limits`. Tasks without a declared cost get the estimate of the model of `machine`.
#[must_use]
pub fn certificates(
    design: &Design,
    machine: Option<&'static Machine>,
    limits: &grafsynth_verify::Limits,
) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (index, library) in design.libraries.iter().enumerate() {
        let Some(certificate) = &library.certificate else { continue };
        let hash = graf::fingerprint(library);
        if !certificate.hash.eq_ignore_ascii_case(&hash) {
            found.push(
                Diagnostic::warning(
                    codes::CERTIFICATE,
                    format!("the certificate of `{}` does not match the chart", library.name),
                )
                .at(certificate.span, format!("issued by version {}", certificate.version))
                .at(library.name.span, "changed since then")
                .help(format!(
                    "run `check LIBRARY --certify -` to prove its properties again and print a new certificate (version {}, sha256 \"{hash}\")",
                    env!("CARGO_PKG_VERSION")
                )),
            );
            continue;
        }
        let net = match task_costs::alone(design, index, machine) {
            Ok(net) => net,
            Err(why) => {
                let message = format!(
                    "the certificate of `{}` is not checked: the library chart alone has errors",
                    library.name
                );
                found.push(
                    Diagnostic::warning(codes::CERTIFICATE, message)
                        .at(certificate.span, "this certificate proves nothing")
                        .at(library.name.span, why),
                );
                continue;
            }
        };
        let verdicts = grafsynth_verify::properties(&net, limits);
        for property in &certificate.properties {
            let outcome = verdicts
                .iter()
                .find(|verdict| net.properties[verdict.property].name == property.text)
                .map(|verdict| &verdict.outcome);
            let (why, is_wrong) = match outcome {
                Some(grafsynth_verify::Outcome::Proved { .. }) => continue,
                Some(grafsynth_verify::Outcome::Refuted { row, stimulus, .. }) => {
                    (format!("violated in row {row}, after {}", inputs(&net, stimulus)), true)
                }
                Some(grafsynth_verify::Outcome::Open(why)) => (why.to_string(), false),
                None => ("no property of the library chart has that name".to_owned(), true),
            };
            let message =
                format!("property `{property}` of `{}` is certified but not proved", library.name);
            let finding = if is_wrong {
                Diagnostic::error(codes::CERTIFICATE, message)
            } else {
                Diagnostic::warning(codes::CERTIFICATE, message)
            };
            let help = if is_wrong {
                "correct the library chart, or remove the property from its certificate; `check LIBRARY --certify -`, with the same options as this command, prints a certificate without it"
            } else {
                "remove the property from the certificate, or raise --proof-limit"
            };
            found.push(finding.at(property.span, why).help(help));
        }
    }
    found
}

/// The inputs of the last rows of a stimulus, as one phrase: `(n = 2, dt = 1)`.
fn inputs(net: &Net, stimulus: &Stimulus) -> String {
    const SHOWN: usize = 4;
    let n_rows = stimulus.len();
    let row = |at: usize| {
        let row = stimulus.row(at);
        let values =
            net.inputs.iter().map(|(id, input)| format!("{} = {}", input.name.text, row.value(id)));
        let values = values.chain([format!("dt = {}", row.dt)]).join(", ");
        format!("({values})")
    };
    let left_out = n_rows.saturating_sub(SHOWN);
    let rows = (left_out..n_rows).map(row).join(", ");
    if left_out > 0 { format!("{left_out} rows and {rows}") } else { rows }
}
