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
/// Maximum total number of rows after rows for every state (`*`) are expanded.
const MAX_ROWS: usize = 4_000_000;

/// Reads a table with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> (Option<Machine>, Vec<Diagnostic>) {
    parse_within(file, text, &Limits::default())
}

/// Reads a table with the given limits. Returns no machine if a finding is an error.
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
        named: [Span::default(); 2],
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
    /// The lines that name the inputs and the outputs.
    named: [Span; 2],
}

/// Suggests how to correct two contradictory rows: give them the same next state or outputs, or different inputs.
fn apart(machine: &Machine, row: &Row, other: &Row, is_next: bool) -> String {
    let what = if is_next { "the same next state" } else { "the same outputs" };
    let own = |row: &Row| {
        let text: String = row
            .inputs
            .iter()
            .map(|trit| match trit {
                Trit::Low => '0',
                Trit::High => '1',
                Trit::Any => '-',
            })
            .collect();
        (text.len() <= 32).then_some(text)
    };
    // If one row has `-` in a column in which the other row has 0 or 1, the `-` can be replaced by the opposite value.
    let example = [(row, other), (other, row)].into_iter().find_map(|(wide, narrow)| {
        let pairs = || wide.inputs.iter().zip(&narrow.inputs);
        let column = pairs().position(|(a, b)| *a == Trit::Any && *b != Trit::Any)?;
        let opposite = match narrow.inputs[column] {
            Trit::Low => '1',
            Trit::High | Trit::Any => '0',
        };
        let before = own(wide)?;
        let mut after = before.clone();
        after.replace_range(column..=column, &opposite.to_string());
        Some(format!("for instance `{after}` in place of `{before}`"))
    });
    match example {
        Some(example) => format!("give both rows {what}, or make an input differ: {example}"),
        None if row.inputs == other.inputs && !row.inputs.contains(&Trit::Any) => {
            format!("give both rows {what}, or remove one of them")
        }
        None if machine.inputs.is_empty() => format!("give both rows {what}, or remove one"),
        None => format!("give both rows {what}, or write 0 in one and 1 in the other for an input"),
    }
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

    fn error(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.report(Diagnostic::error(codes::KISS2_SYNTAX, message).at(span, "").help(help));
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
                    let message = format!("expected one number after `{}`", head.text);
                    self.error(head.span, message, format!("write it as in `{} 2`", head.text));
                    return;
                };
                let is_width = head.text == ".i" || head.text == ".o";
                if is_width && number > MAX_WIDTH {
                    let message = format!("{number} columns; the limit is {MAX_WIDTH}");
                    let help = if head.text == ".o" {
                        "split the table by outputs"
                    } else {
                        "split the table by outputs, and omit inputs whose columns contain only `-`"
                    };
                    self.error(head.span, message, help);
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
                        "remove one of them",
                    );
                } else if !self.machine.rows.is_empty() {
                    let message = format!("`{}` after the first row", head.text);
                    self.error(head.span, message, "move it before the rows");
                }
            }
            ".r" | ".reset" => match words {
                [word] => self.reset = Some((word.text.to_owned(), word.span)),
                _ => {
                    let help = "name the state in which the machine begins, as in `.r idle`";
                    self.error(head.span, "expected one state after `.r`", help);
                }
            },
            ".ilb" | ".ob" => {
                let names = words.iter().map(|word| word.text.to_owned()).collect();
                let span = words.last().map_or(head.span, |last| head.span.to(last.span));
                if head.text == ".ilb" {
                    self.machine.inputs = names;
                    self.named[0] = span;
                } else {
                    self.machine.outputs = names;
                    self.named[1] = span;
                }
            }
            ".start_kiss" | ".end_kiss" | ".latch_order" | ".code" | ".type" => {}
            other => {
                let known = [".i", ".o", ".p", ".s", ".r", ".ilb", ".ob", ".e"];
                let mut finding = Diagnostic::error(
                    codes::KISS2_SYNTAX,
                    format!("unknown directive `{}` in a KISS2 table", cut(other)),
                )
                .at(head.span, "");
                finding = finding.near(
                    head.span,
                    nearest(other, known),
                    format!("remove it; the directives of a KISS2 table are {}", known.join(" ")),
                );
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
                    let message = format!("expected 0, 1 or - for an {what}, found `{other}`");
                    let help = match what {
                        "input" => "write 0 or 1, or - for an input that does not matter",
                        _ => "write 0 or 1, or - for an output that may be either",
                    };
                    self.error(span, message, help);
                    return None;
                }
            });
        }
        if trits.len() != wanted {
            let n = trits.len();
            let s = if n == 1 { "" } else { "s" };
            let message = format!("{n} {what}{s}, but the table has {wanted}");
            let letter = if what == "input" { "i" } else { "o" };
            let s = if wanted == 1 { "" } else { "s" };
            let help = format!(
                "write {wanted} character{s} here, or declare `.{letter} {n}` if all rows have {n}"
            );
            self.error(if trits.is_empty() { line } else { word.span }, message, help);
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
                "write both lines before the rows, as in `.i 2` and `.o 1`",
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
            let cells = |n: usize| "-".repeat(n.min(8)) + if n > 8 { ".." } else { "" };
            let example = format!("{} a b {}", cells(n_inputs), cells(n_outputs));
            let help = format!("write all of them, as in `{}`", example.trim());
            self.error(line, message, help);
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
            let help =
                "write its rows after `.i` and `.o`: inputs, present state, next state, outputs";
            self.error(start, "the table has no state", help);
        }
        for (names, n, what, letter, span) in [
            (&mut self.machine.inputs, n_inputs, "input", "in", self.named[0]),
            (&mut self.machine.outputs, n_outputs, "output", "out", self.named[1]),
        ] {
            if names.is_empty() {
                *names = (0..n).map(|column| format!("{letter}{column}")).collect();
            } else if names.len() != n {
                let message =
                    format!("wrong number of {what} names: found {}, expected {n}", names.len());
                let help =
                    format!("write one name for each of the {n} {what}s, or remove the line");
                let finding = Diagnostic::error(codes::KISS2_SYNTAX, message).at(span, "");
                self.findings.push(finding.help(help));
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
                let line = if is_rows { ".p" } else { ".s" };
                let help = format!("write `{line} {is}`, or remove the line");
                let finding = Diagnostic::warning(codes::KISS2_COUNT, message).at(span, "");
                self.report(finding.help(help));
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
                    let known = || self.machine.states.iter().map(|state| state.name.as_str());
                    if let Some(near) = nearest(&name, known()) {
                        finding = finding.help(format!("did you mean `{near}`?")).fix(span, near);
                    } else if self.machine.states.is_empty() {
                        finding = finding.help("write its rows, or remove the line");
                    } else {
                        let shown: Vec<String> =
                            known().take(6).map(|name| format!("`{}`", cut(name))).collect();
                        let more = if self.machine.states.len() > 6 { ", .." } else { "" };
                        let shown = shown.join(", ");
                        finding =
                            finding.help(format!("the states of the table are {shown}{more}"));
                    }
                    self.report(finding);
                }
            }
        }
        self.contradictions();
    }

    /// Reports two rows of a state that match a common input but specify different values.
    fn contradictions(&mut self) {
        let machine = std::mem::take(&mut self.machine);
        let n_general = machine.rows.iter().filter(|row| row.from.is_none()).count();
        if n_general.saturating_mul(machine.states.len()) > MAX_ROWS {
            let message = format!(
                "too many rows: {n_general} rows for each of {} states",
                machine.states.len()
            );
            let help = "write the rows with `*` for fewer states, or split the table";
            self.error(Span::new(self.file, 0, 0), message, help);
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
                    let help =
                        "combine rows that have the same next state and outputs, with - for inputs";
                    self.error(row.span, message, help);
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
                            .help(apart(&machine, row, other, next)),
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
