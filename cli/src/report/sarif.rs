//! SARIF 2.1.0. Findings are results of the kind `fail` with their level; answers have the kind `pass`, `fail`, `open`, `notApplicable` or `informational`, and
//! their basis as properties.

use super::answer::{Answer, Status};
use super::json::uri;
use crate::exit::Exit;
use crate::render::{path_of, severity_word};
use grafsynth_driver::source::Sources;
use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The results so far.
#[derive(Debug, Default)]
pub(super) struct Log {
    /// The file of answers without a location.
    design: String,
    rules: BTreeMap<String, String>,
    results: Vec<Value>,
    /// Files that were read with a design.
    artifacts: Vec<Value>,
    errors: Vec<Value>,
}

impl Log {
    pub(super) fn design(&mut self, file: &str) {
        file.clone_into(&mut self.design);
    }

    pub(super) fn beside(&mut self, file: &str) {
        self.artifacts.push(json!({"location": {"uri": uri(file)}}));
    }

    pub(super) fn finding(&mut self, sources: &Sources, diagnostic: &Diagnostic) {
        self.rules.insert(diagnostic.code.id.to_owned(), diagnostic.code.title.to_owned());
        let mut locations =
            diagnostic.labels.iter().map(|label| location(sources, label.span, &label.text));
        let text = match &diagnostic.help {
            Some(help) => format!("{} (help: {help})", diagnostic.message),
            None => diagnostic.message.clone(),
        };
        let first: Vec<Value> = locations.next().into_iter().collect();
        let mut result = json!({
            "ruleId": diagnostic.code.id,
            "level": severity_word(diagnostic.severity),
            "message": {"text": text},
            "locations": first,
        });
        let related: Vec<Value> = locations.collect();
        if !related.is_empty() {
            result["relatedLocations"] = json!(related);
        }
        if let Some(fix) = &diagnostic.fix {
            let place = location(sources, fix.span, "");
            let change = json!({
                "artifactLocation": place["physicalLocation"]["artifactLocation"],
                "replacements": [{
                    "deletedRegion": place["physicalLocation"]["region"],
                    "insertedContent": {"text": fix.replacement},
                }],
            });
            let text = diagnostic.help.as_deref().unwrap_or("write instead");
            result["fixes"] = json!([{"description": {"text": text}, "artifactChanges": [change]}]);
        }
        self.results.push(result);
    }

    pub(super) fn answer(&mut self, sources: &Sources, answer: &Answer) {
        self.rules.insert(answer.about.name().to_owned(), answer.about.title().to_owned());
        let kind = match answer.status {
            Status::Proved => "pass",
            Status::Refuted => "fail",
            Status::Open => "open",
            Status::NotChecked => "notApplicable",
            Status::Done => "informational",
        };
        let place = match answer.place {
            Some(span) => location(sources, span, ""),
            None => json!({"physicalLocation": {"artifactLocation": {"uri": uri(&self.design)}}}),
        };
        let mut properties = json!({"subject": answer.subject, "status": answer.status.name()});
        if !answer.requirements.is_empty() {
            properties["requirements"] = json!(answer.requirements);
        }
        for (name, detail) in &answer.details {
            properties[name] = detail.clone();
        }
        self.results.push(json!({
            "ruleId": answer.about.name(),
            "kind": kind,
            // The standard defines levels for failures only.
            "level": if answer.status == Status::Refuted { "error" } else { "none" },
            "message": {"text": format!("{}: {}", answer.subject, answer.message)},
            "locations": [place],
            "properties": properties,
        }));
    }

    pub(super) fn error(&mut self, message: &str) {
        self.errors.push(json!({"level": "error", "message": {"text": message}}));
    }

    /// The whole document.
    pub(super) fn document(&self, exit: Exit) -> Value {
        let rules: Vec<Value> = self
            .rules
            .iter()
            .map(|(id, title)| json!({"id": id, "shortDescription": {"text": title}}))
            .collect();
        // A run that finds errors is still a successful run.
        let ran = !matches!(exit, Exit::Usage | Exit::Interrupted);
        let mut invocation = json!({
            "executionSuccessful": ran,
            "exitCode": exit as u8,
            "exitCodeDescription": exit.name(),
        });
        if !self.errors.is_empty() {
            invocation["toolExecutionNotifications"] = json!(self.errors);
        }
        json!({
            "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
            "version": "2.1.0",
            "runs": [{
                "tool": {"driver": {
                    "name": "grafsynth",
                    "version": env!("CARGO_PKG_VERSION"),
                    "rules": rules,
                }},
                "invocations": [invocation],
                "columnKind": "unicodeCodePoints",
                "artifacts": self.artifacts,
                "results": self.results,
            }],
        })
    }
}

fn location(sources: &Sources, span: Span, text: &str) -> Value {
    let (start, end) = (sources.start(span), sources.end(span));
    let mut value = json!({
        "physicalLocation": {
            "artifactLocation": {"uri": uri(path_of(sources, span))},
            "region": {
                "startLine": start.map_or(1, |at| at.line),
                "startColumn": start.map_or(1, |at| at.column),
                "endLine": end.map_or(1, |at| at.line),
                "endColumn": end.map_or(1, |at| at.column),
            },
        },
    });
    if !text.is_empty() {
        value["message"] = json!({"text": text});
    }
    value
}
