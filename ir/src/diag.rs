//! What the tool tells its user: one type for every crate. Only the command line renders it.

use crate::span::Span;

/// A stable name such as `G0103`; `grafsynth explain G0103` prints its page. Each crate lists its codes in a `codes` module.
///
/// Ranges: `G00` settings of the tool and files, `G01` the chart language's syntax, `G02` names, types and lowering, `G03` invariants of a net and
/// its text form, `G04` rules text, `G05` stimuli and traces, `G06` C, `G07` logic and programmable devices, `G08` properties, facts and proofs,
/// `G09` engines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code {
    /// `G` and four digits.
    pub id: &'static str,
    /// A few words, as the heading of its page.
    pub title: &'static str,
}

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The design is not accepted.
    Error,
    /// Accepted, and probably not what was meant.
    Warning,
    /// Worth knowing.
    Note,
}

/// A place and what is seen there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Where.
    pub span: Span,
    /// What is seen there; may be empty when the message says it all.
    pub text: String,
}

/// The words in which a design was written: a way out is told in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Notation {
    /// The chart language, rules, and everything whose words are those of the chart language.
    Graf,
    /// SCXML.
    Scxml,
    /// Structured text and PLCopen XML.
    Iec,
    /// C.
    C,
}

/// An edit that mends the finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fix {
    /// The text to replace.
    pub span: Span,
    /// What to put there.
    pub replacement: String,
}

/// How several findings of one kind, which differ only in what they name, are one finding for people: `inputs i4, i5 and i6 are never used`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plural {
    /// What this finding names, as its message has it: `i4`.
    pub item: String,
    /// The words before the list of what they name: `inputs`.
    pub before: String,
    /// The words after it: `are never used`.
    pub after: String,
}

/// One finding: what is wrong in the user's terms, where, and what to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The kind of finding.
    pub code: Code,
    /// How bad it is.
    pub severity: Severity,
    /// Small letter, no full stop, with the numbers.
    pub message: String,
    /// The first one is the main place. Empty only where no source exists.
    pub labels: Vec<Label>,
    /// What to do next.
    pub help: Option<String>,
    /// The same in other words than those of the chart language, where they differ.
    pub help_in: Vec<(Notation, String)>,
    /// An edit that does it.
    pub fix: Option<Fix>,
    /// How findings with the same words and the same help are said as one. Findings with the same message are one without it.
    pub plural: Option<Plural>,
}

impl Diagnostic {
    /// An error at no place yet.
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Error, message)
    }

    /// A warning at no place yet.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Warning, message)
    }

    /// A note at no place yet.
    pub fn note(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Note, message)
    }

    fn new(code: Code, severity: Severity, message: impl Into<String>) -> Self {
        Diagnostic {
            code,
            severity,
            message: message.into(),
            labels: Vec::new(),
            help: None,
            help_in: Vec::new(),
            fix: None,
            plural: None,
        }
    }

    /// The same with one more place.
    #[must_use]
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// The same with the way out.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// The same with the way out for those who wrote in this notation.
    #[must_use]
    pub fn help_in(mut self, notation: Notation, text: impl Into<String>) -> Self {
        self.help_in.push((notation, text.into()));
        self
    }

    /// The same as those who wrote in this notation are told it.
    #[must_use]
    pub fn spoken(mut self, notation: Notation) -> Self {
        let found = self.help_in.iter().find(|(one, _)| *one == notation);
        if let Some((_, text)) = found {
            self.help = Some(text.clone());
        }
        self.help_in.clear();
        self
    }

    /// The same with an edit that mends it.
    #[must_use]
    pub fn fix(mut self, span: Span, replacement: impl Into<String>) -> Self {
        self.fix = Some(Fix { span, replacement: replacement.into() });
        self
    }

    /// The same with the words for several of its kind: `before` and `after` are what stands around the list of what they name, `item` what this one
    /// names.
    #[must_use]
    pub fn plural(
        mut self,
        item: impl std::fmt::Display,
        before: impl Into<String>,
        after: impl Into<String>,
    ) -> Self {
        let (item, before, after) = (item.to_string(), before.into(), after.into());
        self.plural = Some(Plural { item, before, after });
        self
    }

    /// True for an error.
    #[must_use]
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// True when at least one of them is an error.
#[must_use]
pub fn any_error(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(Diagnostic::is_error)
}

/// The candidate nearest to `word` in edit distance (insert, delete, replace, swap of neighbours; letter case counts half), if it is near enough to
/// be a likely slip of the pen: at most a third of the word's length, and at least one edit. A candidate that shares no letter with `word` is never near.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted: Vec<char> = word.chars().collect();
    let budget = (wanted.len().max(3) / 3) * 2;
    candidates
        .into_iter()
        .filter(|candidate| *candidate != word)
        .filter(|candidate| candidate.chars().count().abs_diff(wanted.len()) * 2 <= budget)
        .filter(|candidate| shares_a_letter(&wanted, candidate))
        .map(|candidate| (distance(&wanted, &candidate.chars().collect::<Vec<_>>()), candidate))
        .filter(|(distance, _)| *distance <= budget)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// True when some letter of `candidate`, its case aside, is one of `word`.
fn shares_a_letter(word: &[char], candidate: &str) -> bool {
    candidate.chars().any(|c| word.iter().any(|own| own.to_lowercase().eq(c.to_lowercase())))
}

/// Twice the optimal string alignment distance, with 1 for a change of letter case.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in rows.iter_mut().enumerate() {
        row[0] = 2 * i;
    }
    for (j, cell) in rows[0].iter_mut().enumerate() {
        *cell = 2 * j;
    }
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let change = if a[i - 1] == b[j - 1] {
                0
            } else if a[i - 1].to_lowercase().eq(b[j - 1].to_lowercase()) {
                1
            } else {
                2
            };
            let mut best =
                (rows[i - 1][j - 1] + change).min(rows[i - 1][j] + 2).min(rows[i][j - 1] + 2);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 2);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn nearest_finds_slips_and_nothing_far() {
        assert_eq!(nearest("loda", ["load", "limit", "m"]), Some("load"));
        assert_eq!(nearest("M", ["m", "n"]), Some("m"));
        assert_eq!(nearest("request", ["a", "b"]), None);
        assert_eq!(nearest("b", ["L", "R"]), None);
    }
}
