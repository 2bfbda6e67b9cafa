//! C to Grafcet (`.c`): translates the control flow of functions to steps and transitions, after B. H. Thomas, *A Scheme for Translating
//! Control Flow in the C Programming Language to Grafcet with Examples*, NBSIR 88-3741, 1988 (NBS88 below). `docs/formats.md` lists what is
//! supported.
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
//! The stages of the translation, by file:
//!
//! 1. `lexer`, `parser`, `declarations`, `parse_expr`: text to tree (`ast`), with error recovery;
//! 2. `resolve`, `calls`, `units`: resolve names to variables and functions, classify array parameters, and find the code that no net can
//!    express and that stays C;
//! 3. `flow`, `value`, `operators`: each function becomes a flow graph whose nodes contain statements of the net, by the rules of C
//!    arithmetic;
//! 4. `shorten`: removes empty joins; with `Options::fuse`, straight-line code becomes one step;
//! 5. `draw`: the graph becomes a macro, calls become macro-steps; `frame` adds the file variables and the start of the function; `library`
//!    writes the C text of code that the net cannot express.
//!
//! **Time.** Each step lasts one reaction, so each iteration of a loop takes at least one reaction. The chart computes the same results as the function if the
//! behaviour of the function is defined. If it is undefined in C (a signed overflow, an index outside its array), the chart saturates.

mod ast;
mod calls;
mod constant;
mod declarations;
mod directives;
mod draw;
mod flow;
mod frame;
mod graph;
mod initial;
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

/// How several calls of one function are translated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Calls {
    /// One macro-step per call: the calls of a function are independent.
    #[default]
    Copy,
    /// One macro-step for all calls. Without recursion, at most one of the calls is active at a time. The caller activates the macro-step
    /// together with a waiting step of its own and joins both, so the waiting step identifies the caller.
    Share,
}

/// Which parts become macro-steps, in addition to functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Group {
    /// No other parts.
    #[default]
    Nothing,
    /// The statements after a comment, up to the next comment of the same block, as in the appendix of NBS88.
    Comments,
    /// The blocks of loops and branches.
    Blocks,
}

/// Options of the translation from C to a chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Bits of `int`: 16 or 32.
    pub int_bits: u32,
    /// Whether plain `char` is unsigned.
    pub is_unsigned_char: bool,
    /// Whether straight-line code becomes one step.
    pub fuse: bool,
    /// Functions that are kept as C.
    pub keep: Vec<String>,
    /// Which parts become macro-steps, in addition to functions.
    pub group: Group,
    /// How several calls of one function are translated.
    pub calls: Calls,
    /// The function that the chart runs. Default: `main`, or the last function that no other function calls.
    pub entry: Option<String>,
    /// Number of elements of an array parameter of unknown length.
    pub array_length: u32,
    /// Macros with numeric values, like the option `-D NAME=VALUE` of a compiler.
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

/// The result of reading a source.
#[derive(Debug, Clone, Default)]
pub struct Parsed {
    /// The chart; `None` after an error.
    pub design: Option<Design>,
    /// The findings in source order.
    pub diagnostics: Vec<Diagnostic>,
    /// C text for code that no net can express: the definitions of the extern functions of the chart. `None` if the chart needs none.
    pub library: Option<String>,
}

/// Reads a C source with the default limits and options.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default(), &Options::default())
}

/// Reads a C source with the given limits and options.
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
                let finding =
                    Diagnostic::error(codes::C_NO_FUNCTION, "no function with a body in this file");
                match first_prototype(&source) {
                    Some(name) => finding.at(name.span, "only declared").help(format!(
                        "write the body `{{ .. }}` of `{name}`, or give the file that contains it"
                    )),
                    None => finding
                        .at(Span::new(file, 0, 0), "")
                        .help("give a file with a function, as in `int f(int a) { return a; }`"),
                }
            });
        }
        return Parsed { diagnostics: graf::sorted(findings.finish()), ..Parsed::default() };
    }
    let (design, library) = drawn.map_or((None, None), |(design, library)| (Some(design), library));
    Parsed { design, diagnostics: graf::sorted(findings.finish()), library }
}

/// The first function that is declared without a body.
fn first_prototype(source: &ast::Source) -> Option<&grafsynth_ir::Name> {
    source.items.iter().find_map(|item| match item {
        ast::External::Function(_) => None,
        ast::External::Declaration(declaration) => declaration
            .declared
            .iter()
            .find(|(declarator, _)| declarator.is_function && !declarator.is_opaque)
            .map(|(declarator, _)| &declarator.name),
    })
}
