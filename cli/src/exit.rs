//! Exit codes: one table for all verbs (docs/exit-codes.md).

use grafsynth_ir::Diagnostic;
use grafsynth_ir::diag::{Severity, any_error};
use grafsynth_verify::Open;

/// The outcome of a verb.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Success.
    Done = 0,
    /// The input is invalid, or the request is impossible.
    Errors = 1,
    /// An option is invalid, or a file cannot be read or written.
    Usage = 2,
    /// A property is violated, an output is not equal to the chart, or a comparison found a difference.
    Refuted = 3,
    /// A question is still open.
    Open = 4,
    /// The user stopped the command.
    Interrupted = 130,
}

impl Exit {
    /// The exit codes by precedence, the lowest first: the code with the highest precedence is returned.
    const STRENGTH: [Exit; 6] =
        [Exit::Done, Exit::Open, Exit::Refuted, Exit::Errors, Exit::Usage, Exit::Interrupted];

    /// Of two exit codes, the one with the higher precedence.
    #[must_use]
    pub(crate) fn worse(self, other: Exit) -> Exit {
        let strength = |exit| Exit::STRENGTH.iter().position(|one| *one == exit);
        if strength(other) > strength(self) { other } else { self }
    }

    /// Its name for machines.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Exit::Done => "done",
            Exit::Errors => "errors",
            Exit::Usage => "usage",
            Exit::Refuted => "refuted",
            Exit::Open => "open",
            Exit::Interrupted => "interrupted",
        }
    }
}

/// The user's choice of strictness.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Demands {
    /// True if a check that was not carried out counts as an open question.
    pub(crate) deny_open: bool,
    /// True if a warning counts as an error.
    pub(crate) deny_warnings: bool,
    /// True if an open question whose answer was tested counts as answered.
    pub(crate) allow_tested: bool,
}

impl Demands {
    /// The exit code of an open question.
    pub(crate) fn open(self, open: &Open) -> Exit {
        if self.allow_tested && open.tested.is_some() { Exit::Done } else { Exit::Open }
    }

    /// The exit code of a check that was not carried out.
    pub(crate) fn unchecked(self) -> Exit {
        if self.deny_open { Exit::Open } else { Exit::Done }
    }

    /// True if the findings prevent a verb from continuing.
    pub(crate) fn refuse(self, found: &[Diagnostic]) -> bool {
        let is_warning = |one: &Diagnostic| one.severity == Severity::Warning;
        any_error(found) || self.deny_warnings && found.iter().any(is_warning)
    }
}

#[cfg(test)]
mod tests {
    use super::Exit;

    #[test]
    fn the_stronger_one_counts_whatever_the_order() {
        let rising = [Exit::Done, Exit::Open, Exit::Refuted, Exit::Errors, Exit::Usage];
        for (at, weak) in rising.iter().enumerate() {
            for strong in &rising[at..] {
                assert_eq!(weak.worse(*strong), *strong);
                assert_eq!(strong.worse(*weak), *strong);
            }
        }
    }
}
