//! Exit codes.

/// How a verb ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Exit {
    /// Done and true.
    Done = 0,
    /// The input has errors.
    Errors = 1,
    /// Wrong use, or a file that cannot be read or written.
    Usage = 2,
    /// A property or a comparison does not hold.
    Refuted = 3,
    /// A limit was reached before the answer was known.
    Open = 4,
}
