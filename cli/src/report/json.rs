//! JSON lines: docs/report-json.md describes them, docs/report.schema.json defines them.

use super::answer::Answer;
use crate::exit::Exit;
use crate::render::path_of;
use grafsynth_driver::source::Sources;
use grafsynth_ir::diag::{Diagnostic, Severity};
use grafsynth_ir::{FileId, Span};
use percent_encoding::{AsciiSet, CONTROLS, utf8_percent_encode};
use serde_json::{Value, json};

/// The version of the lines. Members may be added within a version; removing a member or changing its meaning requires a new version.
const VERSION: u32 = 1;

/// Characters that must be escaped in the path of a URI.
const NOT_IN_A_PATH: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}')
    .add(b':');

/// A path as a URI reference.
pub(super) fn uri(path: &str) -> String {
    let path = if cfg!(windows) { path.replace('\\', "/") } else { path.to_owned() };
    utf8_percent_encode(&path, NOT_IN_A_PATH).to_string()
}

pub(super) fn start(verb: &str) -> Value {
    json!({
        "kind": "start",
        "format": "grafsynth-report",
        "version": VERSION,
        "grafsynth": env!("CARGO_PKG_VERSION"),
        "verb": verb,
    })
}

pub(super) fn design(file: &str) -> Value {
    json!({"kind": "design", "file": file})
}

pub(super) fn beside(file: &str) -> Value {
    json!({"kind": "beside", "file": file})
}

pub(super) fn error(message: &str) -> Value {
    json!({"kind": "error", "message": message})
}

pub(super) fn end(exit: Exit) -> Value {
    json!({"kind": "end", "exit": exit as u8, "outcome": exit.name()})
}

pub(super) fn hidden(sources: &Sources, file: Option<FileId>, count: usize) -> Value {
    let path = file.and_then(|file| sources.get(file)).map_or("", |source| source.path.as_str());
    json!({"kind": "hidden", "file": path, "findings": count})
}

/// A finding: the members of a diagnostic of the Language Server Protocol, plus `kind` and `file`.
pub(super) fn finding(sources: &Sources, diagnostic: &Diagnostic) -> Value {
    let severity = match diagnostic.severity {
        Severity::Error => 1,
        Severity::Warning => 2,
        Severity::Note => 3,
    };
    let main = diagnostic.labels.first().map_or_else(Span::default, |label| label.span);
    let related: Vec<Value> = diagnostic
        .labels
        .iter()
        .enumerate()
        .filter(|(index, label)| *index > 0 || !label.text.is_empty())
        .map(|(_, label)| {
            json!({
                "location": {"uri": uri(path_of(sources, label.span)), "range": range(sources, label.span)},
                "message": label.text,
            })
        })
        .collect();
    let mut value = json!({
        "kind": "finding",
        "file": if diagnostic.labels.is_empty() { "" } else { path_of(sources, main) },
        "range": range(sources, main),
        "severity": severity,
        "code": diagnostic.code.id,
        "source": "grafsynth",
        "message": diagnostic.message,
        "relatedInformation": related,
    });
    if let Some(help) = &diagnostic.help {
        value["data"]["help"] = json!(help);
    }
    if let Some(fix) = &diagnostic.fix {
        value["data"]["fix"] = json!({
            "file": path_of(sources, fix.span),
            "range": range(sources, fix.span),
            "newText": fix.replacement,
        });
    }
    value
}

pub(super) fn answer(sources: &Sources, answer: &Answer) -> Value {
    let mut value = json!({
        "kind": "answer",
        "about": answer.about.name(),
        "subject": answer.subject,
        "status": answer.status.name(),
        "message": answer.message,
    });
    if let Some(span) = answer.place {
        value["file"] = json!(path_of(sources, span));
        value["range"] = range(sources, span);
    }
    if !answer.requirements.is_empty() {
        value["requirements"] = json!(answer.requirements);
    }
    for (name, detail) in &answer.details {
        value[name] = detail.clone();
    }
    value
}

fn range(sources: &Sources, span: Span) -> Value {
    let place = |offset: u32| {
        sources.get(span.file).map_or_else(
            || json!({"line": 0, "character": 0}),
            |source| {
                let at = source.boundary(offset as usize);
                let line = source.line_of(at);
                // The protocol counts UTF-16 code units.
                let before = source.text.get(source.line_range(line).start..at).unwrap_or_default();
                json!({"line": line, "character": before.encode_utf16().count()})
            },
        )
    };
    json!({"start": place(span.start), "end": place(span.end)})
}
