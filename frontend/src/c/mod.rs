//! C to Grafcet (`.c`): the control flow of functions as steps and transitions, after B. H. Thomas, *A Scheme for Translating Control Flow in the C
//! Programming Language to Grafcet with Examples*, NBSIR 88-3741, 1988 (NBS88 below). `docs/formats.md` says what is read.
//!
//! ```
//! use grafsynth_frontend::c;
//! use grafsynth_ir::FileId;
//!
//! let parsed = c::parse(FileId(0), "int twice(int n) { return 2 * n; }");
//! assert!(parsed.diagnostics.is_empty());
//! assert_eq!(parsed.design.map(|design| design.charts[0].name.text.clone()), Some("twice_chart".to_owned()));
//! ```
//!
//! The way of a source, one file for each part:
//!
//! 1. `lexer`, `parser`, `declarations`, `parse_expr`: text to tree (`ast`), with recovery;
//! 2. `resolve`, `calls`, `units`: names to variables and functions, which parameter is an array, what stands in no net and so is left to a library;
//! 3. `flow`, `value`, `operators`: a function becomes a flow graph whose nodes hold statements of the net, by the rules of C's arithmetic;
//! 4. `shorten`: empty joins disappear; with `Options::fuse` straight-line code becomes one step;
//! 5. `draw`: the graph becomes a macro, calls become macro-steps; `frame`: what stands around them; `library` writes the C text of what the net cannot say.
//!
//! **Time.** Each step lasts one reaction, so a loop takes at least one reaction a turn. The chart computes what the function computes as long as the
//! function's behaviour is defined; where C leaves it undefined (a signed overflow, an index outside its array) the chart saturates.

mod ast;
mod calls;
mod constant;
mod declarations;
mod directives;
mod draw;
mod flow;
mod frame;
mod lexer;
mod library;
mod number;
mod operators;
mod parse_expr;
mod parser;
mod pieces;
mod resolve;
mod sequence;
mod shorten;
mod texts;
mod types;
mod units;
mod value;

#[cfg(test)]
mod tests;

use crate::codes;
use crate::graf::{self, Limits};
use grafsynth_ir::chart::Design;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::{FileId, Span};

/// How calls of one function share its chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Calls {
    /// One macro-step for each call: the calls of a function need nothing from each other.
    #[default]
    Copy,
    /// One macro-step for all calls. In a C program they always exclude each other (there is no recursion), so a caller forks into the macro-step and a
    /// step of its own that waits, and joins both: the waiting step remembers whose call it is.
    Share,
}

/// What macro-steps are made of, besides functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Group {
    /// Nothing else.
    #[default]
    Nothing,
    /// The statements behind a comment, up to the next one of the same block, as in the appendix of NBS88.
    Comments,
    /// The blocks of loops and branches.
    Blocks,
}

/// How a C source becomes a chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Bits of `int`: 16 or 32.
    pub int_bits: u32,
    /// Plain `char` is unsigned.
    pub is_unsigned_char: bool,
    /// Straight-line code becomes one step.
    pub fuse: bool,
    /// Functions that stay C.
    pub keep: Vec<String>,
    /// What else becomes a macro-step.
    pub group: Group,
    /// How calls of one function share its chart.
    pub calls: Calls,
    /// The function that the chart runs; `main`, or the one that no other calls.
    pub entry: Option<String>,
    /// Elements of an array parameter whose length nothing says.
    pub array_length: u32,
    /// Names that stand for a number, as `-D NAME=VALUE` gives them to a compiler.
    pub defines: Vec<(String, i64)>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            int_bits: 32,
            is_unsigned_char: false,
            fuse: false,
            keep: Vec::new(),
            group: Group::Nothing,
            calls: Calls::Copy,
            entry: None,
            array_length: 16,
            defines: Vec::new(),
        }
    }
}

/// What was found in a source.
#[derive(Debug, Clone, Default)]
pub struct Parsed {
    /// The chart; none after an error.
    pub design: Option<Design>,
    /// In the order of the text.
    pub diagnostics: Vec<Diagnostic>,
    /// C text for what no net says: the definitions of the extern functions of the chart. None where the chart needs none.
    pub library: Option<String>,
}

/// Reads a C source with the default limits and options.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default(), &Options::default())
}

/// Reads a C source.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits, options: &Options) -> Parsed {
    if let Some(finding) = graf::too_large(file, text, limits) {
        return Parsed { diagnostics: vec![finding], ..Parsed::default() };
    }
    let (source, mut findings) =
        parser::parse(file, text, limits, options.is_unsigned_char, &options.defines);
    if any_error(&findings.kept) {
        return Parsed { diagnostics: graf::sorted(findings.finish()), ..Parsed::default() };
    }
    let resolved = resolve::resolve(file, text, &source, options, &mut findings);
    let drawn = match resolved {
        Some(program) if !any_error(&findings.kept) => draw::draw(&program, &mut findings),
        Some(_) | None => None,
    };
    if any_error(&findings.kept) || drawn.is_none() {
        if !any_error(&findings.kept) {
            findings.report(|| {
                Diagnostic::error(codes::C_NO_FUNCTION, "no function stands in this file")
                    .at(Span::new(file, 0, 0), "")
            });
        }
        return Parsed { diagnostics: graf::sorted(findings.finish()), ..Parsed::default() };
    }
    let (design, library) = drawn.map_or((None, None), |(design, library)| (Some(design), library));
    Parsed { design, diagnostics: graf::sorted(findings.finish()), library }
}
