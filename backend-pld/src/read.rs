//! The readers.
//!
//! Each language has a parser that fills a `draft::Draft`: signals by name, and for each a function or a register. `Draft::finish` makes a
//! circuit of it. Parsers go on after an error and report all of them; they hold one token at a time, so memory stays near the size of the text, and
//! nesting is bounded.

mod blif;
mod cupl;
mod draft;
mod equation;
mod galasm;
mod lexer;
mod palasm;
mod verilog;

use crate::Dialect;
use crate::codes;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::span::{FileId, Span};

/// The largest text, in bytes.
const MAX_BYTES: usize = 64 << 20;
/// Parentheses deeper than this are refused.
pub(crate) const MAX_NESTING: u32 = 256;
/// A reader stops after this many findings.
const MAX_FINDINGS: usize = 1000;

pub(crate) fn read(dialect: Dialect, file: FileId, text: &str) -> (Option<Logic>, Vec<Diagnostic>) {
    if text.len() > MAX_BYTES {
        let message =
            format!("the text has {} bytes, and at most {MAX_BYTES} are read", text.len());
        return (
            None,
            vec![
                Diagnostic::error(codes::TOO_LONG, message).at(Span::new(file, 0, 0), "this file"),
            ],
        );
    }
    let mut draft = draft::Draft::new(file, dialect);
    match dialect {
        Dialect::Palasm => palasm::parse(text, &mut draft),
        Dialect::Cupl => cupl::parse(text, &mut draft),
        Dialect::Galasm => galasm::parse(text, &mut draft),
        Dialect::Verilog => verilog::parse(text, &mut draft),
        Dialect::Blif => blif::parse(text, &mut draft),
    }
    let logic = draft.finish();
    let findings = std::mem::take(&mut draft.findings);
    if any_error(&findings) { (None, findings) } else { (logic, findings) }
}
