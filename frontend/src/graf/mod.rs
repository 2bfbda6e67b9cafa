//! The chart language (`.graf`): parser, formatter and writer. `docs/language.md` is its reference.
//!
//! ```
//! use grafsynth_frontend::graf;
//! use grafsynth_ir::FileId;
//!
//! let parsed = graf::parse(FileId(0), "chart lamp { input b output L initial step off step on { L } off -> on when b }");
//! assert!(parsed.diagnostics.is_empty());
//! assert_eq!(parsed.design.map(|design| design.charts.len()), Some(1));
//! ```
//!
//! The parser is a hand-written recursive descent parser with an on-demand lexer. It continues after each error. It never recurses deeper
//! than [`Limits::nesting`]. Its running time is linear in the length of the text.

pub(crate) mod bodies;
mod design;
mod durations;
pub(crate) mod expr;
pub(crate) mod items;
mod layout;
pub(crate) mod lexer;
mod library;
pub(crate) mod names;
pub(crate) mod numbers;
pub(crate) mod parser;
pub mod pieces;
pub(crate) mod settings;
pub(crate) mod steps;
pub(crate) mod token;
mod transitions;
pub(crate) mod write;
mod write_bodies;
pub(crate) mod write_expr;
mod write_library;
mod write_steps;
pub(crate) mod write_text;

use grafsynth_ir::chart::{Certificate, Design, Import, Library};
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Span};

use crate::codes;
use numbers::Numbers;
use parser::Parser;

/// Limits for parsing a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Maximum size of a source in bytes.
    pub source: usize,
    /// Maximum nesting depth. Nested blocks and nested expressions count together.
    pub nesting: u32,
    /// Maximum number of findings that are kept. Further findings are only counted.
    pub diagnostics: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { source: 64 << 20, nesting: 256, diagnostics: 100 }
    }
}

/// A comment of a source: from its `#` to the end of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Comment {
    /// The location. The text is in the source.
    pub span: Span,
}

/// The result of reading a source.
#[derive(Debug, Clone, Default)]
pub struct Parsed {
    /// The design. After an error, it lacks the parts that could not be parsed. `None` if the text has no design, or if a large source has
    /// errors.
    pub design: Option<Design>,
    /// The findings in source order: at most [`Limits::diagnostics`], and one more that counts the rest.
    pub diagnostics: Vec<Diagnostic>,
    /// The comments in source order.
    pub comments: Vec<Comment>,
}

/// Sources above this size in bytes are first checked without building a tree, so that an invalid source costs no memory.
pub(crate) const CHECK_FIRST: usize = 1 << 20;

/// Reads a chart with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default())
}

/// Reads a chart with the given limits.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits) -> Parsed {
    if let Some(finding) = too_large(file, text, limits) {
        return Parsed { diagnostics: vec![finding], ..Parsed::default() };
    }
    let numbers = Numbers::declared_in(text);
    if text.len() > CHECK_FIRST {
        let mut parser = Parser::new(file, text, Some(&numbers), *limits, true);
        parser.design();
        let diagnostics = parser.findings.finish();
        if any_error(&diagnostics) {
            return Parsed { diagnostics: sorted(diagnostics), ..Parsed::default() };
        }
    }
    let mut parser = Parser::new(file, text, Some(&numbers), *limits, false);
    let design = parser.design();
    Parsed { design, diagnostics: sorted(parser.findings.finish()), comments: parser.comments }
}

/// The imports at the top of a source, without those that cannot be parsed.
#[must_use]
pub fn imports(file: FileId, text: &str) -> Vec<Import> {
    let limits = Limits::default();
    if too_large(file, text, &limits).is_some() {
        return Vec::new();
    }
    Parser::new(file, text, None, limits, false).imports()
}

/// SHA-256 of the canonical text of a library chart, as 64 hexadecimal digits. Layout, comments and the certificate do not affect it; any
/// other change does.
#[must_use]
pub fn fingerprint(library: &Library) -> String {
    use sha2::Digest;
    let bare = Library { certificate: None, ..library.clone() };
    let text = write_design(&Design { libraries: vec![bare], ..Design::default() });
    let hash = sha2::Sha256::digest(text.as_bytes());
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The text of a certificate in a chart, without indentation and without a final line break.
#[must_use]
pub fn write_certificate(certificate: &Certificate) -> String {
    write_library::certificate_doc(certificate).pretty(layout::WIDTH).to_string()
}

/// Formats a chart in the canonical form. Comments and single blank lines are kept; the meaning does not change.
///
/// # Errors
/// Returns the findings of the source if it has errors. The source is not changed.
pub fn format(file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    format_within(file, text, &Limits::default())
}

/// Like [`format()`], with the given limits.
///
/// # Errors
/// Returns the findings of the source if it has errors. The source is not changed.
pub fn format_within(file: FileId, text: &str, limits: &Limits) -> Result<String, Vec<Diagnostic>> {
    let parsed = parse_within(file, text, limits);
    match parsed.design {
        Some(design) if !any_error(&parsed.diagnostics) => {
            let source = write::Source { text, comments: &parsed.comments };
            Ok(write::write(&design, Some(source)))
        }
        _ => Err(parsed.diagnostics),
    }
}

/// Writes a design in the canonical form, with blank lines between the kinds of items.
///
/// In a name that contains a backquote or a line break, these characters are replaced by apostrophes, because a name in backquotes cannot
/// contain them.
#[must_use]
pub fn write_design(design: &Design) -> String {
    write::write(design, None)
}

/// Writes a net as the chart that lowers to it.
///
/// # Errors
/// Returns a finding for everything in the net that the chart language cannot express.
pub fn write_net(net: &Net) -> Result<String, Vec<Diagnostic>> {
    crate::from_net::design(net).map(|design| write_design(&design))
}

/// Sorts findings in source order, because the lexer reports ahead of the parser. The finding that counts the rest stays last.
pub(crate) fn sorted(mut findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    findings.sort_by_key(|finding| {
        (finding.code == codes::MORE, finding.labels.first().map_or(0, |label| label.span.start))
    });
    findings
}

/// The finding for a source that exceeds the size limit.
pub(crate) fn too_large(file: FileId, text: &str, limits: &Limits) -> Option<Diagnostic> {
    (text.len() > limits.source).then(|| {
        let (is, most) = (text.len(), limits.source);
        Diagnostic::error(
            codes::TOO_LARGE,
            format!("the source has {is} bytes; the limit is {most}"),
        )
        .at(Span::new(file, most, most), "the limit is here")
        .help("split it into several files, or raise the limit with --source-limit")
    })
}

#[cfg(test)]
pub(crate) mod random;
#[cfg(test)]
mod round_trip;
#[cfg(test)]
pub(crate) mod tests;
