//! Textual IEC 61131-3 (`.st`, `.exp`): parser and writer for sequential function charts and structured text.
//!
//! ```
//! use grafsynth_frontend::st;
//! use grafsynth_ir::FileId;
//!
//! let parsed = st::parse(
//!     FileId(0),
//!     "PROGRAM lamp VAR_INPUT b : BOOL; END_VAR VAR_OUTPUT l : BOOL; END_VAR
//!      INITIAL_STEP off: END_STEP STEP on: l(N); END_STEP
//!      TRANSITION FROM off TO on := b; END_TRANSITION END_PROGRAM",
//! );
//! assert!(parsed.diagnostics.is_empty());
//! assert_eq!(parsed.design.map(|design| design.charts.len()), Some(1));
//! ```
//!
//! `docs/formats.md` lists what is supported, ignored and refused, and defines the meaning of each construct. The parser builds a tree (`ast`), which the
//! parser of PLCopen XML builds too; `elaborate` turns the tree into charts.

pub(crate) mod ast;
pub(crate) mod elaborate;
pub(crate) mod lexer;
mod lints;
pub(crate) mod parse;
mod parse_decl;
pub(crate) mod parse_expr;
pub(crate) mod parse_sfc;
mod parse_stmt;
mod parse_units;
pub(crate) mod symbol;
pub(crate) mod write;

use grafsynth_ir::FileId;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::net::Net;

use crate::codes;
use crate::findings::Findings;
use crate::graf::{Limits, Parsed, sorted, too_large};
use lexer::Places;
use parse::Parser;

/// Reads a text with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default())
}

/// Reads a text with the given limits.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits) -> Parsed {
    if let Some(finding) = too_large(file, text, limits) {
        return Parsed { diagnostics: vec![finding], ..Parsed::default() };
    }
    let mut findings = Findings { kept: Vec::new(), limit: limits.diagnostics, rest: 0 };
    let mut parser = Parser::new(text, Places::Direct(file), &mut findings, limits.nesting);
    let library = parser.library();
    let outside = std::mem::take(&mut parser.refused);
    for refusal in outside {
        findings.report(|| refusal.diagnostic());
    }
    finish(&library, findings)
}

/// Turns the tree into charts, and collects the findings of both stages.
pub(crate) fn finish(library: &ast::Library, mut findings: Findings) -> Parsed {
    let broken = any_error(&findings.kept);
    let (design, found) = elaborate::design(library);
    let warnings = if broken { Vec::new() } else { lints::lints(library) };
    for finding in found.into_iter().chain(warnings) {
        // In a text with errors, a missing program is a consequence and is not reported.
        if broken && finding.code == codes::ST_NO_POU {
            continue;
        }
        findings.report(|| finding);
    }
    Parsed { design, diagnostics: sorted(findings.finish()), comments: Vec::new() }
}

/// Writes a net as text that reads back as the same net. The diagnostics list what the text cannot contain.
///
/// # Errors
/// Returns a finding for everything in the net that IEC 61131-3 cannot express.
pub fn write_net(net: &Net) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    write::net(net)
}

#[cfg(test)]
mod tests;
