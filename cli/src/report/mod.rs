//! The same answers for people and machines: findings and answers are kept as data, and converted here to text, JSON lines or SARIF.
//!
//! People see each answer when it is ready. JSON has one object per line, printed as it comes (docs/report-json.md). SARIF is one document, printed at the
//! end.

mod answer;
mod json;
mod sarif;
mod tally;

pub(crate) use answer::{About, Answer, Status, proof_name, reason};

use crate::exit::Exit;
use crate::render::{MessageFormat, Style, render, sorted_and_limited};
use grafsynth_driver::source::Sources;
use grafsynth_ir::Diagnostic;
use std::sync::{Arc, Mutex, PoisonError};
use tally::Tally;

/// The machine-readable report.
#[derive(Debug, Clone)]
pub(crate) struct Report {
    format: MessageFormat,
    /// True if the result of the verb goes to standard output, so that the report must go to standard error.
    beside: bool,
    sarif: Arc<Mutex<sarif::Log>>,
    /// Results that are known but not printed yet.
    known: Arc<Mutex<Known>>,
    /// Counts of what was printed for people.
    tally: Arc<Mutex<Tally>>,
}

/// Results about a design that are not printed yet.
#[derive(Debug, Clone, Default)]
struct Known {
    /// The sources of the spans.
    sources: Sources,
    /// Findings, in the terms of the language of each file.
    findings: Vec<Diagnostic>,
    /// Answers, each with its text for people.
    answers: Vec<(Answer, String)>,
}

impl Report {
    /// An empty report. In JSON format, prints the start line, which names the verb.
    pub(crate) fn new(format: MessageFormat, beside: bool, verb: &str) -> Self {
        let report = Report {
            format,
            beside,
            sarif: Arc::default(),
            known: Arc::default(),
            tally: Arc::default(),
        };
        if format == MessageFormat::Json {
            report.line(&json::start(verb));
        }
        report
    }

    /// True if the report is for machines.
    pub(crate) fn is_for_machines(&self) -> bool {
        matches!(self.format, MessageFormat::Json | MessageFormat::Sarif)
    }

    /// Begins the results for this file.
    pub(crate) fn design(&self, file: &str) {
        if self.format == MessageFormat::Json {
            self.line(&json::design(file));
        }
        self.log(|log| log.design(file));
    }

    /// Shows findings to people, as many as fit on the terminal.
    pub(crate) fn show(&self, sources: &Sources, found: &[Diagnostic], style: Style) {
        let rendered = render(sources, found, style);
        let shown = self.tally().shown(&rendered, style.height);
        crate::print_error(&(shown + &rendered.hidden));
    }

    /// Counts an answer that people were given.
    pub(crate) fn count(&self, answer: &Answer) {
        self.tally().answered(answer);
    }

    /// Prints the summary: how many findings were not shown, and what was found.
    pub(crate) fn sum_up(&self, style: Style, is_quiet: bool) {
        if style.format == MessageFormat::Human {
            let tally = self.tally();
            crate::print_error(&tally.left_out());
            if !is_quiet && !self.beside {
                crate::print_error(&tally.summary());
            }
        }
    }

    fn tally(&self) -> std::sync::MutexGuard<'_, Tally> {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds findings.
    pub(crate) fn findings(&self, sources: &Sources, found: &[Diagnostic], style: Style) {
        let (shown, hidden) = sorted_and_limited(found, style.max_diagnostics);
        for diagnostic in shown {
            match self.format {
                MessageFormat::Json => self.line(&json::finding(sources, diagnostic)),
                MessageFormat::Sarif => self.log(|log| log.finding(sources, diagnostic)),
                MessageFormat::Human | MessageFormat::Short => {}
            }
        }
        for (file, count) in hidden {
            if self.format == MessageFormat::Json {
                self.line(&json::hidden(sources, file, count));
            }
        }
    }

    /// Adds an answer.
    pub(crate) fn answer(&self, sources: &Sources, answer: &Answer) {
        match self.format {
            MessageFormat::Json => self.line(&json::answer(sources, answer)),
            MessageFormat::Sarif => self.log(|log| log.answer(sources, answer)),
            MessageFormat::Human | MessageFormat::Short => {}
        }
    }

    /// Records a companion file that was read with the design.
    pub(crate) fn beside(&self, file: &str) {
        if self.format == MessageFormat::Json {
            self.line(&json::beside(file));
        }
        self.log(|log| log.beside(file));
    }

    /// Records findings that are printed later, or at once if the user interrupts the program first.
    pub(crate) fn know_findings(&self, sources: &Sources, findings: Vec<Diagnostic>) {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.sources.clone_from(sources);
        known.findings = findings;
    }

    /// Records answers that are printed later, or at once if the user interrupts the program first.
    pub(crate) fn know_answers(&self, answers: Vec<(Answer, String)>) {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).answers = answers;
    }

    /// Prints what is known so far.
    #[cfg(unix)]
    pub(crate) fn print_known(&self, style: Style) {
        let known = std::mem::take(&mut *self.known.lock().unwrap_or_else(PoisonError::into_inner));
        let Known { sources, findings, answers } = known;
        if self.is_for_machines() {
            self.findings(&sources, &findings, style);
            answers.iter().for_each(|(answer, _)| self.answer(&sources, answer));
        } else {
            self.show(&sources, &findings, style);
            answers.iter().for_each(|(_, text)| crate::print(text));
        }
    }

    /// Adds an error in the use of the tool, or an error about a file.
    pub(crate) fn error(&self, message: &str) {
        match self.format {
            MessageFormat::Json => self.line(&json::error(message)),
            MessageFormat::Sarif => self.log(|log| log.error(message)),
            MessageFormat::Human | MessageFormat::Short => {}
        }
    }

    /// Ends the report.
    pub(crate) fn end(&self, exit: Exit) {
        match self.format {
            MessageFormat::Json => self.line(&json::end(exit)),
            MessageFormat::Sarif => {
                let document = self.sarif.lock().unwrap_or_else(PoisonError::into_inner);
                self.line(&document.document(exit));
            }
            MessageFormat::Human | MessageFormat::Short => {}
        }
    }

    fn log(&self, add: impl FnOnce(&mut sarif::Log)) {
        add(&mut self.sarif.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn line(&self, value: &serde_json::Value) {
        let text = format!("{value}\n");
        if self.beside { crate::print_error(&text) } else { crate::print(&text) }
    }
}
