//! W3C SCXML 1.0 (`.scxml`): reader and writer of statecharts with integers and Booleans. `docs/formats.md` lists what is read.
//!
//! ```
//! use grafsynth_frontend::scxml;
//! use grafsynth_ir::FileId;
//!
//! let text = "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0'>
//!               <state id='off'><transition event='press' target='on'/></state>
//!               <state id='on'><transition event='press' target='off'/></state>
//!             </scxml>";
//! let parsed = scxml::parse(FileId(0), text);
//! assert!(parsed.diagnostics.is_empty());
//! assert_eq!(parsed.design.map(|design| design.charts.len()), Some(1));
//! ```
//!
//! `read` takes a document apart, `names` and `events` find out what it names, `values` what its data hold, and `build` puts the chart
//! together. Whatever would be an error when the chart runs is refused here, with its place, so that a chart that was read raises no `error` event.

mod build;
mod events;
mod expr;
mod lints;
mod mentions;
mod names;
mod read;
mod sayable;
mod time;
mod tree;
mod values;
mod write;

pub use write::{write_design, write_net};

use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::{FileId, Span};

use crate::codes;
use crate::graf::parser::Findings;
use crate::graf::{Limits, Parsed};
use crate::xml;

/// The namespace of SCXML.
const SCXML: &str = "http://www.w3.org/2005/07/scxml";
/// Our own, for what a controller needs and SCXML has no word for: ranges, inputs and outputs.
const GRAFSYNTH: &str = "urn:grafsynth:scxml:1";

/// Reads a document with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default())
}

/// Reads a document.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits) -> Parsed {
    let mut found = Findings { limit: limits.diagnostics, ..Findings::default() };
    let mut design = None;
    match xml::parse(file, text, limits) {
        Err(finding) => found.report(|| *finding),
        Ok(document) => {
            let machine = read::machine(file, text, &document, limits, &mut found);
            drop(document);
            if let Some((machine, language)) = machine {
                lints::lints(&machine, &mut found);
                design = Some(build::design(&machine, language, limits.nesting, &mut found));
            }
        }
    }
    let mut diagnostics = found.finish();
    // The note that counts the rest stays last.
    diagnostics.sort_by_key(|finding| {
        let start = finding.labels.first().map_or(0, |label| label.span.start);
        (finding.code == codes::MORE, start)
    });
    // A loop that is written out has its mistakes once in each turn.
    diagnostics.dedup();
    if any_error(&diagnostics) {
        // What is left of a refused document would bring mistakes of its own.
        design = None;
    }
    Parsed { design, diagnostics, comments: Vec::new() }
}

/// The finding for something that SCXML has and a controller has not.
fn refuse(span: Span, what: &str, help: &str) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::error(codes::SCXML_REFUSED, format!("{what} is not read"))
            .at(span, "")
            .help(help),
    )
}

#[cfg(test)]
mod tests;
