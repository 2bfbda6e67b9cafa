//! The findings of one source, up to a limit.

use grafsynth_ir::diag::Diagnostic;

use crate::codes;

/// Findings up to a limit, and the number of further ones.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub(crate) kept: Vec<Diagnostic>,
    pub(crate) limit: usize,
    pub(crate) rest: usize,
}

impl Findings {
    /// Keeps or counts a finding. It is built only if it is kept: an invalid file of 60 MB may have millions.
    pub(crate) fn report(&mut self, make: impl FnOnce() -> Diagnostic) {
        let finding = (self.kept.len() < self.limit).then(make);
        self.keep(finding);
    }

    // Apart from `report`, which is compiled for each finding.
    fn keep(&mut self, finding: Option<Diagnostic>) {
        match finding {
            Some(finding) => self.kept.push(finding),
            None => self.rest += 1,
        }
    }

    /// Returns all findings; if some were only counted, a final one gives their number.
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        if self.rest > 0 {
            let (rest, limit) = (self.rest, self.limit);
            let noun = if rest == 1 { "finding is" } else { "findings are" };
            let mut last = Diagnostic::note(codes::MORE, format!("{rest} more {noun} not shown"))
                .help(format!("fix the first {limit}; the others may be consequences"));
            if let Some(label) = self.kept.last().and_then(|finding| finding.labels.first()) {
                last = last.at(label.span, "the last one shown");
            }
            self.kept.push(last);
        }
        self.kept
    }
}
