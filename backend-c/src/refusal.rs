//! Why a style of C does not support a chart.

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;

/// Why a style does not support the net: the construct in the user's words, and its location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refusal {
    /// The construct.
    pub(crate) what: String,
    /// Its location.
    pub(crate) span: Span,
}

/// Why a style produced no program.
pub(crate) enum Failure {
    /// The style does not support the net.
    Refused(Refusal),
    /// No style supports it.
    Errors(Vec<Diagnostic>),
}

/// Rejects a construct.
///
/// # Errors
/// Always.
pub(crate) fn refuse<T>(what: impl Into<String>, span: Span) -> Result<T, Refusal> {
    Err(Refusal { what: what.into(), span })
}
