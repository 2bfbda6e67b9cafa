//! The readers.
//!
//! Each language has a parser that fills a `ast::PldAst`: signals by name, and for each a function or a register. `PldAst::finish` converts it to a
//! circuit. Parsers continue after an error and report all errors; they hold one token at a time, so memory stays near the size of the text, and
//! nesting is bounded.

mod advice;
mod ast;
mod blif;
mod cupl;
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

/// The maximum size of a text, in bytes.
const MAX_BYTES: usize = 64 << 20;
/// The maximum nesting depth of parentheses.
pub(crate) const MAX_NESTING: u32 = 256;
/// A reader stops after this many findings.
const MAX_FINDINGS: usize = 1000;

/// The contents of a text of logic.
#[derive(Debug, Clone)]
pub struct Text {
    /// The circuit, if there is no error and it has a single clock.
    pub logic: Option<Logic>,
    /// The parts of the text that a single-clock circuit cannot express (errors: [`Text::logic`] is then `None`) or expresses in a simplified form
    /// (warnings). A device may support them anyway.
    pub beyond: Vec<Diagnostic>,
    /// The macrocells as written, or why the text does not define fuses.
    pub placement: Result<Placement, Vec<Diagnostic>>,
    /// The findings about the text itself.
    pub findings: Vec<Diagnostic>,
}

impl Text {
    fn nothing(findings: Vec<Diagnostic>) -> Self {
        Text { logic: None, beyond: Vec::new(), placement: Err(Vec::new()), findings }
    }
}

pub(crate) fn read(dialect: Dialect, file: FileId, text: &str) -> Text {
    if text.len() > MAX_BYTES {
        let message = format!("the text has {} bytes; the limit is {MAX_BYTES}", text.len());
        return Text::nothing(vec![
            Diagnostic::error(codes::TOO_LONG, message).at(Span::new(file, 0, 0), "this file"),
        ]);
    }
    let mut draft = ast::PldAst::new(file, dialect);
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
                .at(span, "expected declarations and equations")
                .help("check that this is the right file, and give its format with --from if its name does not show the format"),
        ]);
    }
    let logic = draft.finish();
    if any_error(&draft.findings) {
        return Text { beyond: draft.beyond, ..Text::nothing(draft.findings) };
    }
    let placement = place::place(&draft);
    Text { logic, beyond: draft.beyond, placement, findings: draft.findings }
}
