//! Reads a text into a table.

use super::{Machine, Row, State, Trit};
use crate::codes;
use crate::graf::{Limits, too_large};
use grafsynth_ir::diag::{Diagnostic, any_error, nearest};
use grafsynth_ir::span::{FileId, Span};
use std::collections::BTreeMap;

/// Maximum number of row pairs that are checked for contradictions.
const MAX_PAIRS: usize = 20_000_000;
/// Maximum number of inputs and of outputs.
const MAX_WIDTH: usize = 4096;
/// Maximum total number of rows that rows for every state expand to.
const MAX_ROWS: usize = 4_000_000;

/// Reads a table with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> (Option<Machine>, Vec<Diagnostic>) {
    parse_within(file, text, &Limits::default())
}

/// Reads a table and reports all findings. Returns no machine if one of them is an error.
#[must_use]
pub fn parse_within(
    file: FileId,
    text: &str,
    limits: &Limits,
) -> (Option<Machine>, Vec<Diagnostic>) {
    if let Some(finding) = too_large(file, text, limits) {
        return (None, vec![finding]);
    }
    let mut reader = Reader {
        file,
        limits: *limits,
        findings: Vec::new(),
        n_more: 0,
        machine: Machine::default(),
        by_name: BTreeMap::new(),
        inputs: None,
        outputs: None,
        wanted: Vec::new(),
        reset: None,
    };
    reader.text(text);
    reader.finish();
    if reader.n_more > 0 {
        let message = format!("{} more findings are not shown", reader.n_more);
        reader.findings.push(Diagnostic::error(codes::KISS2_SYNTAX, message));
    }
    let is_wrong = any_error(&reader.findings);
    ((!is_wrong).then_some(reader.machine), reader.findings)
}

/// A word of a line with its span.
#[derive(Debug, Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    span: Span,
}

struct Reader {
    file: FileId,
    limits: Limits,
    findings: Vec<Diagnostic>,
    n_more: usize,
    machine: Machine,
    by_name: BTreeMap<String, usize>,
    inputs: Option<usize>,
    outputs: Option<usize>,
    /// The numbers of rows (`.p`) and states (`.s`) given in the header.
    wanted: Vec<(bool, usize, Span)>,
    reset: Option<(String, Span)>,
}

/// Shortens a text to 30 characters for a message.
fn cut(text: &str) -> String {
    let short: String = text.chars().take(30).collect();
    if short.len() < text.len() { format!("{short}..") } else { short }
}

impl Reader {
    fn report(&mut self, finding: Diagnostic) {
        if self.findings.len() < self.limits.diagnostics {
            self.findings.push(finding);
        } else if finding.is_error() {
            self.n_more += 1;
        }
    }

    fn error(&mut self, span: Span, message: impl Into<String>) {
        self.report(Diagnostic::error(codes::KISS2_SYNTAX, message).at(span, ""));
    }

    fn text(&mut self, text: &str) {
        let mut at = 0;
        for line in text.split_inclusive('\n') {
            let start = at;
            at += line.len();
            let line = line.split('#').next().unwrap_or_default();
            let mut words = Vec::new();
            let mut rest = line;
            let mut offset = start;
            while let Some(from) = rest.find(|c: char| !c.is_whitespace() && c != '\u{feff}') {
                let tail = &rest[from..];
                let length = tail.find(char::is_whitespace).unwrap_or(tail.len());
                let span = Span::new(self.file, offset + from, offset + from + length);
                words.push(Word { text: &tail[..length], span });
                offset += from + length;
                rest = &tail[length..];
            }
            let Some(first) = words.first().copied() else { continue };
            if first.text == ".e" || first.text == ".end" {
                return;
            }
            if first.text.starts_with('.') && first.text.len() > 1 {
                self.directive(first, &words[1..]);
            } else {
                self.row(&words);
            }
            if self.n_more > 1000 {
                return;
            }
        }
    }

    fn directive(&mut self, head: Word<'_>, words: &[Word<'_>]) {
        match head.text {
            ".i" | ".o" | ".p" | ".s" => {
                let number = match words {
                    [word] => word.text.parse::<usize>().ok(),
                    _ => None,
                };
                let Some(number) = number else {
                    self.error(head.span, format!("expected one number after `{}`", head.text));
                    return;
                };
                let is_width = head.text == ".i" || head.text == ".o";
                if is_width && number > MAX_WIDTH {
                    self.error(head.span, format!("{number} columns; the limit is {MAX_WIDTH}"));
                    return;
                }
                let place = match head.text {
                    ".i" => &mut self.inputs,
                    ".o" => &mut self.outputs,
                    _ => {
                        self.wanted.push((head.text == ".p", number, head.span));
                        return;
                    }
                };
                if place.replace(number).is_some_and(|before| before != number) {
                    self.error(
                        head.span,
                        format!("`{}` is given twice, with different numbers", head.text),
                    );
                } else if !self.machine.rows.is_empty() {
                    self.error(head.span, format!("`{}` after the first row", head.text));
                }
            }
            ".r" | ".reset" => match words {
                [word] => self.reset = Some((word.text.to_owned(), word.span)),
                _ => self.error(head.span, "expected one state after `.r`"),
            },
            ".ilb" | ".ob" => {
                let names = words.iter().map(|word| word.text.to_owned()).collect();
                if head.text == ".ilb" {
                    self.machine.inputs = names;
                } else {
                    self.machine.outputs = names;
                }
            }
            ".start_kiss" | ".end_kiss" | ".latch_order" | ".code" | ".type" => {}
            other => {
                let known = [".i", ".o", ".p", ".s", ".r", ".ilb", ".ob", ".e"];
                let mut finding = Diagnostic::error(
                    codes::KISS2_SYNTAX,
                    format!("unknown line `{}` in a KISS2 table", cut(other)),
                )
                .at(head.span, "");
                if let Some(near) = nearest(other, known) {
                    finding = finding.help(format!("did you mean `{near}`?")).fix(head.span, near);
                }
                self.report(finding);
            }
        }
    }

    fn trits(
        &mut self,
        word: Option<Word<'_>>,
        wanted: usize,
        what: &str,
        line: Span,
    ) -> Option<Vec<Trit>> {
        let Some(word) = word else { return Some(Vec::new()) };
        let mut trits = Vec::with_capacity(word.text.len().min(MAX_WIDTH));
        for (at, c) in word.text.char_indices() {
            trits.push(match c {
                '0' => Trit::Low,
                '1' => Trit::High,
                '-' | '2' | '~' => Trit::Any,
                other => {
                    let start = word.span.start as usize + at;
                    let span = Span::new(self.file, start, start + other.len_utf8());
                    self.error(span, format!("expected 0, 1 or - for an {what}, found `{other}`"));
                    return None;
                }
            });
        }
        if trits.len() != wanted {
            let message = format!("{} {what}s, but the table has {wanted}", trits.len());
            self.error(if trits.is_empty() { line } else { word.span }, message);
            return None;
        }
        Some(trits)
    }

    fn state(&mut self, word: Word<'_>) -> usize {
        let next = self.machine.states.len();
        let id = *self.by_name.entry(word.text.to_owned()).or_insert(next);
        if id == next {
            self.machine.states.push(State { name: word.text.to_owned(), span: word.span });
        }
        id
    }

    /// Reads `inputs present next outputs`. In a table without inputs or outputs, the respective word is absent.
    fn row(&mut self, words: &[Word<'_>]) {
        let (Some(first), Some(last)) = (words.first(), words.last()) else { return };
        let line = first.span.to(last.span);
        let (Some(n_inputs), Some(n_outputs)) = (self.inputs, self.outputs) else {
            self.error(
                line,
                "the numbers of inputs and outputs (`.i` and `.o`) must come before the first row",
            );
            self.n_more += usize::from(self.inputs.is_none() && self.outputs.is_none());
            return;
        };
        let wanted = 2 + usize::from(n_inputs > 0) + usize::from(n_outputs > 0);
        if words.len() != wanted {
            let message = format!(
                "a row has {wanted} words (inputs, present state, next state, outputs), but this one has {}",
                words.len()
            );
            self.error(line, message);
            return;
        }
        let mut words = words.iter().copied();
        let inputs = if n_inputs > 0 { words.next() } else { None };
        let (Some(present), Some(next)) = (words.next(), words.next()) else { return };
        let inputs = self.trits(inputs, n_inputs, "input", line);
        let outputs = self.trits(words.next(), n_outputs, "output", line);
        let from = (present.text != "*").then(|| self.state(present));
        let to = (next.text != "*" && next.text != "-").then(|| self.state(next));
        if let (Some(inputs), Some(outputs)) = (inputs, outputs) {
            self.machine.rows.push(Row { inputs, from, to, outputs, span: line });
        }
    }

    fn finish(&mut self) {
        let start = Span::new(self.file, 0, 0);
        let (n_inputs, n_outputs) = (self.inputs.unwrap_or(0), self.outputs.unwrap_or(0));
        if self.findings.is_empty() && self.machine.states.is_empty() {
            self.error(start, "the table has no state");
        }
        for (names, n, what, letter) in [
            (&mut self.machine.inputs, n_inputs, "input", "in"),
            (&mut self.machine.outputs, n_outputs, "output", "out"),
        ] {
            if names.is_empty() {
                *names = (0..n).map(|column| format!("{letter}{column}")).collect();
            } else if names.len() != n {
                let message = format!("{} names of {what}s, but the table has {n}", names.len());
                self.findings.push(Diagnostic::error(codes::KISS2_SYNTAX, message).at(start, ""));
            }
        }
        for (is_rows, wanted, span) in std::mem::take(&mut self.wanted) {
            let (is, what) = if is_rows {
                (self.machine.rows.len(), "rows")
            } else {
                (self.machine.states.len(), "states")
            };
            if is != wanted && !any_error(&self.findings) {
                let message = format!("the header gives {wanted} {what}, but the table has {is}");
                self.report(Diagnostic::warning(codes::KISS2_COUNT, message).at(span, ""));
            }
        }
        if let Some((name, span)) = self.reset.take() {
            match self.by_name.get(&name) {
                Some(state) => self.machine.initial = *state,
                None => {
                    let mut finding = Diagnostic::error(
                        codes::KISS2_SYNTAX,
                        format!("unknown state `{}`", cut(&name)),
                    )
                    .at(span, "");
                    let known = self.machine.states.iter().map(|state| state.name.as_str());
                    if let Some(near) = nearest(&name, known) {
                        finding = finding.help(format!("did you mean `{near}`?")).fix(span, near);
                    }
                    self.report(finding);
                }
            }
        }
        self.contradictions();
    }

    /// Reports rows of one state for a common input with different values, unless one of the values is unspecified.
    fn contradictions(&mut self) {
        let machine = std::mem::take(&mut self.machine);
        let n_general = machine.rows.iter().filter(|row| row.from.is_none()).count();
        if n_general.saturating_mul(machine.states.len()) > MAX_ROWS {
            let message = format!(
                "too many rows: {n_general} rows for each of {} states",
                machine.states.len()
            );
            self.error(Span::new(self.file, 0, 0), message);
            self.machine = machine;
            return;
        }
        let mut pairs = 0_usize;
        'states: for (state, rows) in machine.rows_by_state().iter().enumerate() {
            for (at, row) in rows.iter().enumerate() {
                pairs += at;
                if pairs > MAX_PAIRS {
                    let message = format!(
                        "state `{}` has {} rows, too many to check for contradictions",
                        cut(&machine.states[state].name),
                        rows.len()
                    );
                    self.error(row.span, message);
                    break 'states;
                }
                for other in &rows[..at] {
                    if !row.meets(other) {
                        continue;
                    }
                    let next = matches!((row.to, other.to), (Some(a), Some(b)) if a != b);
                    let differ =
                        |(a, b): &(&Trit, &Trit)| a != b && **a != Trit::Any && **b != Trit::Any;
                    let output =
                        row.outputs.iter().zip(&other.outputs).position(|pair| differ(&pair));
                    if !next && output.is_none() {
                        continue;
                    }
                    let what = match output {
                        Some(output) if !next => {
                            format!("give `{}` two values", machine.outputs[output])
                        }
                        Some(_) | None => "have different next states".to_owned(),
                    };
                    let message = format!(
                        "two rows of state `{}` apply to the same input and {what}",
                        cut(&machine.states[state].name)
                    );
                    self.report(
                        Diagnostic::error(codes::KISS2_CONTRADICTION, message)
                            .at(row.span, "second row")
                            .at(other.span, "first row")
                            .help(
                                "make their inputs differ in one column, or one of the cells `-`",
                            ),
                    );
                    if self.n_more > 0 {
                        break 'states;
                    }
                }
            }
        }
        self.machine = machine;
    }
}
