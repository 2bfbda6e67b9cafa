//! BLIF: `.model`, `.inputs`, `.outputs`, `.clock`, `.latch`, `.names`, `.end`.

use super::ast::{Definition, ExprId, PldAst, Role};
use crate::codes;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::{Name, Span};

pub(crate) fn parse(text: &str, draft: &mut PldAst) {
    let mut parser = Parser {
        text,
        at: 0,
        draft,
        model: None,
        has_ended: false,
        table: None,
        clock: None,
        unset: Vec::new(),
    };
    while let Some(line) = parser.line() {
        if parser.draft.is_hopeless() || !parser.statement(&line) {
            break;
        }
    }
    parser.close_table();
    let unset = std::mem::take(&mut parser.unset);
    draft.warn_of_no_first_value(&unset);
}

/// A word and its position.
type Word<'a> = (&'a str, usize);

/// A `.names` table while its rows are read.
struct Table<'a> {
    inputs: Vec<u32>,
    output: Word<'a>,
    /// Products so far.
    products: Vec<ExprId>,
    /// The output value of the rows: 1 or 0.
    gives: Option<bool>,
    end: usize,
}

struct Parser<'a, 'd> {
    text: &'a str,
    at: usize,
    draft: &'d mut PldAst,
    /// The start of the model.
    model: Option<Span>,
    /// True if its `.end` was read.
    has_ended: bool,
    table: Option<Table<'a>>,
    /// The clock of the latches so far.
    clock: Option<Word<'a>>,
    /// The latches without an initial value.
    unset: Vec<(String, Span)>,
}

impl<'a> Parser<'a, '_> {
    /// The words of the next non-empty line; a `\` at its end joins the next line.
    fn line(&mut self) -> Option<Vec<Word<'a>>> {
        let mut words = Vec::new();
        loop {
            let rest = self.text.get(self.at..).unwrap_or_default();
            if rest.is_empty() {
                return if words.is_empty() { None } else { Some(words) };
            }
            let length = rest.find('\n').unwrap_or(rest.len());
            let line = rest.get(..length).unwrap_or_default();
            let line_start = self.at;
            self.at += (length + 1).min(rest.len());
            let line = line.split('#').next().unwrap_or_default();
            let is_joined = line.trim_end().ends_with('\\');
            let line = line.trim_end().trim_end_matches('\\');
            let mut from = 0;
            for word in line.split_whitespace() {
                let start =
                    line.get(from..).and_then(|rest| rest.find(word)).map_or(from, |at| from + at);
                words.push((word, line_start + start));
                from = start + word.len();
            }
            if !is_joined && !words.is_empty() {
                return Some(words);
            }
        }
    }

    fn span(&self, word: Word<'_>) -> Span {
        Span::new(self.draft.file, word.1, word.1 + word.0.len())
    }

    fn error_with(&mut self, word: Word<'_>, message: impl Into<String>, help: impl Into<String>) {
        let span = self.span(word);
        self.draft.error_with(codes::SYNTAX, span, message, help);
    }

    /// Reads a statement; false if the rest of the text is not read.
    fn statement(&mut self, words: &[Word<'a>]) -> bool {
        let first = words[0];
        if first.0 == ".model" {
            return self.model(first, words.get(1).copied());
        }
        if self.has_ended {
            let message =
                format!("expected the end of the text after `.end`, found `{}`", start_of(first));
            let help = "remove it, or move `.end` after it";
            self.error_with(first, message, help);
            return false;
        }
        if !first.0.starts_with('.') {
            self.row(words);
            return true;
        }
        self.close_table();
        let rest = &words[1..];
        match first.0 {
            ".inputs" | ".outputs" | ".clock" => {
                let role = match first.0 {
                    ".inputs" => Role::Input,
                    ".outputs" => Role::Output,
                    _ => Role::Clock,
                };
                for word in rest {
                    self.declare(*word, role);
                }
            }
            ".latch" => self.latch(first, rest),
            ".names" => self.names(first, rest),
            ".end" => self.has_ended = true,
            ".exdc" => {
                let message =
                    "external don't-cares are ignored: the model keeps its behaviour for them";
                let span = self.span(first);
                self.draft
                    .report(Diagnostic::warning(codes::TAKEN_AS, message).at(span, "from here on").help(
                        "remove this part if the behaviour is correct without it; `grafsynth minimise` uses the don't-cares of a table (.pla)",
                    ));
                return false;
            }
            ".default_input_arrival"
            | ".default_output_required"
            | ".area"
            | ".delay"
            | ".wire_load_slope"
            | ".wire"
            | ".cycle"
            | ".clock_event" => {}
            _ => {
                let span = self.span(first);
                let message = format!(
                    "`{}` is not supported: a circuit is one flat model of `.names` and `.latch`",
                    start_of(first)
                );
                let help = "flatten the design first, in yosys: `synth -auto-top -flatten; opt_clean -purge; write_blif FILE.blif`";
                self.draft.error_with(codes::UNSUPPORTED, span, message, help);
            }
        }
        true
    }

    fn model(&mut self, head: Word<'_>, name: Option<Word<'a>>) -> bool {
        let span = self.span(head);
        if let Some(first) = self.model {
            let finding = Diagnostic::error(
                codes::UNSUPPORTED,
                "a second model is not supported: a circuit is one flat model",
            )
            .at(span, "this one")
            .at(first, "the first")
            .help("write each model to its own file, or flatten the design first (in yosys: `flatten`)");
            self.draft.report(finding);
            return false;
        }
        self.model = Some(span);
        if let Some(name) = name {
            self.draft.name = Name::new(name.0, self.span(name));
        }
        true
    }

    fn declare(&mut self, word: Word<'_>, role: Role) {
        let span = self.span(word);
        let id = self.draft.signal(word.0, span);
        let signal = self.draft.at(id);
        match (signal.role, role) {
            // The clock is usually also listed as an input.
            (Role::Unknown | Role::Input, Role::Clock) => signal.role = Role::Clock,
            (Role::Clock, Role::Input | Role::Clock) => {}
            (Role::Unknown, _) => {
                signal.role = role;
                signal.span = span;
            }
            _ => {
                self.draft.declare(word.0, span, role);
            }
        }
    }

    /// The signal that a latch or table drives; it becomes internal if it has no role yet.
    fn driven(&mut self, word: Word<'_>) -> u32 {
        let span = self.span(word);
        let id = self.draft.signal(word.0, span);
        let signal = self.draft.at(id);
        if signal.role == Role::Unknown {
            signal.role = Role::Internal;
            signal.span = span;
        }
        id
    }

    /// Reads `.latch input output [type control] [init]`.
    fn latch(&mut self, head: Word<'_>, words: &[Word<'a>]) {
        let (Some(&input), Some(&output)) = (words.first(), words.get(1)) else {
            self.error_with(
                head,
                "`.latch` needs an input and an output",
                "write it as in `.latch NEXT q re clk 0`",
            );
            return;
        };
        let mut rest = words.get(2..).unwrap_or_default();
        if let [kind, control, after @ ..] = rest {
            if ["fe", "ah", "al", "as"].contains(&kind.0) {
                let span = self.span(*kind);
                let message = format!(
                    "a latch of type `{}` is not supported: only rising-edge registers are",
                    kind.0
                );
                let help = "write `re` if the rising edge can be used instead, or convert the design to rising-edge registers";
                self.draft.error_with(codes::UNSUPPORTED, span, message, help);
            } else if kind.0 != "re" {
                let message = format!("expected the type of the latch, found `{}`", kind.0);
                self.error_with(*kind, message, "write `re` before the clock, as in `re clk 0`");
            }
            if control.0 != "NIL" {
                if let Some(known) = self.clock.filter(|known| known.0 != control.0) {
                    let message = format!(
                        "second clock `{}`: only circuits with one clock are supported",
                        control.0
                    );
                    let finding = Diagnostic::error(codes::UNSUPPORTED, message)
                        .at(self.span(*control), "")
                        .at(self.span(known), "the first clock")
                        .help("write the registers of each clock to a file of their own");
                    self.draft.report(finding);
                }
                self.clock.get_or_insert(*control);
                self.declare(*control, Role::Clock);
            }
            rest = after;
        }
        let init = match rest.first() {
            Some(("0", _)) => false,
            Some(("1", _)) => true,
            // Without an initial value, the value is 3: unknown.
            None | Some(("2" | "3", _)) => {
                let place = rest.first().copied().unwrap_or(output);
                self.unset.push((output.0.to_owned(), self.span(place)));
                false
            }
            Some(word) => {
                let message = format!("expected the initial value 0 to 3, found `{}`", word.0);
                self.error_with(*word, message, "write 0 or 1, or 2 or 3 if it is not known");
                false
            }
        };
        let span = self.span(input);
        let data = self.draft.signal(input.0, span);
        let value = self.draft.read(data);
        let id = self.driven(output);
        let span = self.span(output);
        let definition =
            Definition { is_registered: true, init, ..Definition::new(value, span, 1) };
        self.draft.define(id, definition);
    }

    fn names(&mut self, head: Word<'a>, words: &[Word<'a>]) {
        let Some((output, inputs)) = words.split_last() else {
            let help = "write the inputs and then the output, as in `.names a b y`";
            self.error_with(head, "`.names` needs an output", help);
            return;
        };
        let mut ids = Vec::with_capacity(inputs.len());
        for input in inputs {
            let span = self.span(*input);
            let id = self.draft.signal(input.0, span);
            self.draft.at(id).n_reads += 1;
            ids.push(id);
        }
        self.table = Some(Table {
            inputs: ids,
            output: *output,
            products: Vec::new(),
            gives: None,
            end: output.1 + output.0.len(),
        });
    }

    fn row(&mut self, words: &[Word<'a>]) {
        let Some(mut table) = self.table.take() else {
            self.error_with(
                words[0],
                format!("expected a directive such as `.names`, found `{}`", start_of(words[0])),
                "write the `.names` of this row before it; a line that continues ends with `\\`",
            );
            return;
        };
        let (plane, value) = match words {
            [value] if table.inputs.is_empty() => ("", *value),
            [plane, value] => (plane.0, *value),
            _ => {
                let help = match table.inputs.len() {
                    0 => "a table without inputs has rows of one character, `1` or `0`".to_owned(),
                    n if n <= 16 => format!("write it as in `{} 1`", "-".repeat(n)),
                    n => format!("write {n} characters, a blank, and `1` or `0`"),
                };
                let message = "expected one row of a table: the inputs, then the output";
                self.error_with(words[0], message, help);
                self.table = Some(table);
                return;
            }
        };
        let gives = match value.0 {
            "1" => true,
            "0" => false,
            _ => {
                self.error_with(
                    value,
                    format!("expected 0 or 1, found `{}`", start_of(value)),
                    "write 1 in rows where the output is true, or 0 in rows where it is false",
                );
                self.table = Some(table);
                return;
            }
        };
        if *table.gives.get_or_insert(gives) != gives {
            self.error_with(
                value,
                "the rows of one table give either 1 or 0",
                "remove the rows with 0, which are the default of a table with rows of 1",
            );
        }
        if plane.len() != table.inputs.len() {
            self.error_with(
                words[0],
                format!(
                    "the row has {} columns, but the table has {} inputs",
                    plane.len(),
                    table.inputs.len()
                ),
                "write one of 0, 1 and - for each name of `.names` but the last",
            );
        }
        let mut literals = Vec::new();
        for (sign, &input) in plane.chars().zip(&table.inputs) {
            match sign {
                '-' => {}
                '1' | '0' => {
                    let read = self.draft.read(input);
                    literals.push(if sign == '1' { read } else { self.draft.not(read) });
                }
                _ => self.error_with(
                    words[0],
                    format!("expected 0, 1 or -, found `{sign}`"),
                    "write 0 or 1, or - for an input that does not matter",
                ),
            }
        }
        let product = self.draft.list(&literals, true);
        table.products.push(product);
        table.end = value.1 + value.0.len();
        self.table = Some(table);
    }

    fn close_table(&mut self) {
        let Some(table) = self.table.take() else { return };
        let id = self.driven(table.output);
        let mut value = self.draft.list(&table.products, false);
        if table.gives == Some(false) {
            value = self.draft.not(value);
        }
        let span = Span::new(self.draft.file, table.output.1, table.end);
        let terms = u32::try_from(table.products.len()).unwrap_or(u32::MAX);
        let definition = Definition::new(value, span, terms);
        self.draft.define(id, definition);
    }
}

/// The first characters of a word, for a message.
fn start_of(word: Word<'_>) -> String {
    word.0.chars().take(30).collect()
}
