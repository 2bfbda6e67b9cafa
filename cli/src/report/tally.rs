//! Counts what was printed for people in a run: for the summary line, and to show only as much as fits on the terminal.

use super::answer::{About, Answer, Status};
use crate::render::Rendered;
use grafsynth_ir::diag::{Severity, joined};
use serde_json::Value;

/// Lines of a terminal that are kept free for the summary line, the output of the verb, and the prompt.
const KEPT_FREE: usize = 5;

/// The counts so far.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// The number of lines printed for findings.
    lines: usize,
    /// The number of findings that were not shown.
    hidden: usize,
    errors: usize,
    warnings: usize,
    notes: usize,
    outputs: Vec<(String, Status)>,
    /// The number of outputs that were not written, for any reason.
    unwritten: usize,
    asserts: Vec<Status>,
}

impl Tally {
    /// The text of the findings that fit on a terminal of this height: all findings before the first one that does not fit, but at least
    /// one per run.
    pub(super) fn shown(&mut self, rendered: &Rendered, height: Option<usize>) -> String {
        for severity in &rendered.found {
            match severity {
                Severity::Error => self.errors += 1,
                Severity::Warning => self.warnings += 1,
                Severity::Note => self.notes += 1,
            }
        }
        let mut text = String::new();
        for one in &rendered.texts {
            let lines = one.lines().count();
            let room = height.map(|height| height.saturating_sub(KEPT_FREE));
            let fits = room.is_none_or(|room| self.lines + lines <= room) || self.lines == 0;
            if self.hidden > 0 || !fits {
                self.hidden += 1;
                continue;
            }
            self.lines += lines;
            text.push_str(one);
        }
        text
    }

    /// Counts an answer.
    pub(super) fn answered(&mut self, answer: &Answer) {
        match answer.about {
            About::Output if answer.details.get("written") == Some(&Value::Bool(false)) => {
                self.unwritten += 1;
                if answer.status == Status::Refuted {
                    self.outputs.push((answer.subject.clone(), answer.status));
                }
            }
            About::Output => self.outputs.push((answer.subject.clone(), answer.status)),
            About::Assert => self.asserts.push(answer.status),
            _ => {}
        }
    }

    /// The line that reports how many findings were not shown.
    pub(super) fn left_out(&self) -> String {
        match self.hidden {
            0 => String::new(),
            1 => "1 more finding; `--message-format short` or a pipe shows all\n".to_owned(),
            n => format!("{n} more findings; `--message-format short` or a pipe shows all\n"),
        }
    }

    /// The line at the end of a run that found something, or answered several questions.
    pub(super) fn summary(&self) -> String {
        let found = self.errors + self.warnings + self.notes;
        if found == 0 && self.outputs.len() < 2 && self.asserts.len() < 2 {
            return String::new();
        }
        let counts = [(self.errors, "error"), (self.warnings, "warning"), (self.notes, "note")];
        let findings: Vec<String> =
            counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| counted(*n, what)).collect();
        let mut parts: Vec<String> = Vec::new();
        if !findings.is_empty() {
            parts.push(findings.join(", "));
        }
        let kinds = [
            (Status::Proved, "proved"),
            (Status::Refuted, "refuted"),
            (Status::Open, "open"),
            (Status::NotChecked, "not checked"),
        ];
        for (status, word) in kinds {
            let names: Vec<&str> = self
                .outputs
                .iter()
                .filter(|(_, one)| *one == status)
                .map(|(name, _)| name.as_str())
                .collect();
            if !names.is_empty() {
                parts.push(format!("{} {word}", joined(&names, "and")));
            }
        }
        let asserts: Vec<String> = kinds
            .iter()
            .map(|(status, word)| (self.asserts.iter().filter(|one| *one == status).count(), word))
            .filter(|(n, _)| *n > 0)
            .enumerate()
            .map(|(at, (n, word))| match at {
                0 => format!("{} {word}", counted(n, "assert")),
                _ => format!("{n} {word}"),
            })
            .collect();
        if !asserts.is_empty() {
            parts.push(asserts.join(", "));
        }
        if self.unwritten > 0 {
            parts.push("nothing written".to_owned());
        }
        parts.join("; ") + "\n"
    }
}

fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::{About, Answer, Rendered, Severity, Status, Tally};

    /// Warnings of these numbers of lines.
    fn warnings(lines: &[usize]) -> Rendered {
        Rendered {
            found: vec![Severity::Warning; lines.len()],
            texts: lines.iter().map(|n| "line\n".repeat(*n)).collect(),
            hidden: String::new(),
        }
    }

    #[test]
    fn a_terminal_shows_what_it_has_room_for() {
        let mut tally = Tally::default();
        let text = tally.shown(&warnings(&[10, 6, 1]), Some(20));
        assert_eq!(text.lines().count(), 10, "nothing is shown after the first that does not fit");
        assert!(tally.left_out().starts_with("2 more findings;"));
        assert_eq!(tally.summary(), "3 warnings\n", "what is not shown is counted");
        let mut tally = Tally::default();
        assert_eq!(tally.shown(&warnings(&[30]), Some(20)).lines().count(), 30);
        assert_eq!(Tally::default().shown(&warnings(&[90, 1]), None).lines().count(), 91);
    }

    #[test]
    fn the_summary_says_what_is_known_of_outputs_and_asserts() {
        let mut tally = Tally::default();
        let answer = |about, name: &str, status| Answer::new(about, name, status, "");
        tally.answered(&answer(About::Output, "lamp.c", Status::Proved));
        assert_eq!(tally.summary(), "", "one answer needs no summary");
        tally.answered(&answer(About::Output, "lamp.pds", Status::Proved));
        tally.answered(&answer(About::Assert, "never a", Status::Proved));
        tally.answered(&answer(About::Assert, "never b", Status::Refuted));
        tally.answered(&answer(About::Output, "lamp.v", Status::Open).with("written", false));
        assert_eq!(
            tally.summary(),
            "lamp.c and lamp.pds proved; 1 assert proved, 1 refuted; nothing written\n"
        );
    }
}
