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
mod number;
mod palasm;
mod place;
mod range;
mod sets;
mod verilog;

use crate::Dialect;
use crate::codes;
use crate::placement::Placement;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::span::{FileId, Span};

/// The largest text, in bytes.
const MAX_BYTES: usize = 64 << 20;
/// Parentheses deeper than this are refused.
pub(crate) const MAX_NESTING: u32 = 256;
/// A reader stops after this many findings.
const MAX_FINDINGS: usize = 1000;

/// What a text of logic says.
#[derive(Debug, Clone)]
pub struct Text {
    /// The circuit, if nothing is wrong and one clock drives it all.
    pub logic: Option<Logic>,
    /// What of the text a circuit with one clock cannot say (errors: there is no [`Text::logic`] then) or says in a simpler sense (warnings). A device
    /// may hold it all the same.
    pub beyond: Vec<Diagnostic>,
    /// The macrocells as written, or why the text does not say which fuses to burn.
    pub placement: Result<Placement, Vec<Diagnostic>>,
    /// What is wrong with the text itself.
    pub findings: Vec<Diagnostic>,
}

impl Text {
    fn nothing(findings: Vec<Diagnostic>) -> Self {
        Text { logic: None, beyond: Vec::new(), placement: Err(Vec::new()), findings }
    }
}

pub(crate) fn read(dialect: Dialect, file: FileId, text: &str) -> Text {
    if text.len() > MAX_BYTES {
        let message =
            format!("the text has {} bytes, and at most {MAX_BYTES} are read", text.len());
        return Text::nothing(vec![
            Diagnostic::error(codes::TOO_LONG, message).at(Span::new(file, 0, 0), "this file"),
        ]);
    }
    let mut draft = draft::Draft::new(file, dialect);
    match dialect {
        Dialect::Palasm => palasm::parse(text, &mut draft),
        Dialect::Cupl => cupl::parse(text, &mut draft),
        Dialect::Galasm => galasm::parse(text, &mut draft),
        Dialect::Verilog => verilog::parse(text, &mut draft),
        Dialect::Blif => blif::parse(text, &mut draft),
    }
    let is_module = matches!(dialect, Dialect::Verilog | Dialect::Blif);
    if draft.signals.is_empty() && draft.findings.is_empty() && !(is_module && draft.is_named()) {
        let span = Span::new(file, 0, 0);
        return Text::nothing(vec![
            Diagnostic::error(codes::SYNTAX, "no equation in this text")
                .at(span, "expected declarations and equations"),
        ]);
    }
    let logic = draft.finish();
    if any_error(&draft.findings) {
        return Text { beyond: draft.beyond, ..Text::nothing(draft.findings) };
    }
    let placement = place::place(&draft);
    Text { logic, beyond: draft.beyond, placement, findings: draft.findings }
}
