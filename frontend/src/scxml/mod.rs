//! W3C SCXML 1.0 (`.scxml`): parser and writer of statecharts with integers and Booleans. `docs/formats.md` lists what is supported.
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
//! `read` parses a document, `names` and `events` resolve its names, `values` infers the types and ranges of its data, and `build`
//! constructs the chart. Everything that would be a run-time error is rejected here with its location, so a chart that was read never
//! raises an `error` event.

mod bits;
mod build;
mod events;
mod expr;
mod legalize;
mod lints;
mod mentions;
mod names;
mod read;
mod time;
mod tree;
mod values;
mod write;

pub use write::{write_design, write_net};

use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::{FileId, Span};

use crate::codes;
use crate::findings::Findings;
use crate::graf::{Limits, Parsed};
use crate::xml;

/// The namespace of SCXML.
const SCXML: &str = "http://www.w3.org/2005/07/scxml";
/// The namespace of grafsynth, for properties that a controller needs but SCXML does not have: ranges, inputs and outputs.
const GRAFSYNTH: &str = "urn:grafsynth:scxml:1";

/// Reads a document with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default())
}

/// Reads a document with the given limits.
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
    // A mistake in an unrolled loop is found once per iteration, but reported only once.
    diagnostics.dedup();
    if any_error(&diagnostics) {
        // The remains of a rejected document would cause further errors.
        design = None;
    }
    Parsed { design, diagnostics, comments: Vec::new() }
}

/// The finding for a feature of SCXML that controllers do not support.
fn refuse(span: Span, what: &str, help: &str) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::error(codes::SCXML_REFUSED, format!("{what} is not supported"))
            .at(span, "")
            .help(help),
    )
}

#[cfg(test)]
mod tests;
