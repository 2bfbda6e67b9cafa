//! What is said about each output: what was proved, and how.

use grafsynth_verify::equiv::Verdict;

/// How sure we are of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// It does what the net does.
    Proved,
    /// It was not found out.
    Open,
    /// It does something else.
    Refuted,
}

/// A line of the report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// The output.
    pub name: String,
    /// How sure.
    pub outcome: Outcome,
    /// What was proved and how, or what differs, or what was tried.
    pub text: String,
}

impl Line {
    /// A proved output.
    #[must_use]
    pub fn proved(name: &str, text: impl Into<String>) -> Self {
        Line { name: name.to_owned(), outcome: Outcome::Proved, text: text.into() }
    }

    /// An output of which it is not known.
    #[must_use]
    pub fn open(name: &str, text: impl Into<String>) -> Self {
        Line { name: name.to_owned(), outcome: Outcome::Open, text: text.into() }
    }

    /// An output that is wrong.
    #[must_use]
    pub fn refuted(name: &str, text: impl Into<String>) -> Self {
        Line { name: name.to_owned(), outcome: Outcome::Refuted, text: text.into() }
    }

    /// The line for what the verifier says of a text that was read back.
    #[must_use]
    pub fn of_verdict(name: &str, verdict: &Verdict) -> Self {
        match verdict {
            Verdict::Proved(certificate) => {
                Line::proved(name, format!("read back and {certificate}"))
            }
            Verdict::Refuted(found) => {
                let difference = &found.difference;
                Line::refuted(
                    name,
                    format!(
                        "differs from the chart after {} reactions: {} is `{}` in the chart and `{}` in the output",
                        found.stimulus.len(),
                        difference.column,
                        difference.left,
                        difference.right
                    ),
                )
            }
            Verdict::Open(why) => Line::open(name, format!("read back; {why}")),
        }
    }
}

impl std::fmt::Display for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:<24} {}", self.name, self.text)
    }
}
