//! The reader of tables.
//!
//! Lines are directives, rows, or parts of rows: the characters of a row may be spread over lines, with blanks and `|` anywhere between them. After an
//! error the reader continues with the next line; a row that begins there is read.

use super::{Kind, Pla, codes};
use grafsynth_ir::Code;
use grafsynth_ir::diag::{Diagnostic, any_error, nearest};
use grafsynth_ir::span::{FileId, Span};
use grafsynth_logic::minimise::Shape;

/// The maximum number of inputs, and of outputs.
const MAX_COLUMNS: usize = 4096;
/// The maximum number of characters in all rows.
const MAX_CELLS: usize = 1 << 27;
/// A reader stops after this many findings.
const MAX_FINDINGS: usize = 1000;

/// Directives whose contents the rows do not need.
const QUIET: [&str; 6] = [".e", ".end", ".p", ".l", ".label", ".title"];
/// All directives, for suggestions.
const KNOWN: [&str; 13] = [
    ".i",
    ".o",
    ".p",
    ".type",
    ".ilb",
    ".ob",
    ".phase",
    ".e",
    ".end",
    ".mv",
    ".kiss",
    ".symbolic",
    ".pair",
];

/// The location of each product of a table, in the order of its lists.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Places {
    /// The locations of the products of the on-set.
    pub on: Vec<Span>,
    /// The locations of the products of the don't-care set.
    pub free: Vec<Span>,
    /// The locations of the products of the off-set.
    pub off: Vec<Span>,
    /// The line that declares the kind of table, if there is one.
    pub kind: Option<Span>,
}

/// Reads a table. All findings of the text are reported at once; if one of them is an error, there is no table.
#[must_use]
pub fn read(file: FileId, text: &str) -> (Option<(Pla, Places)>, Vec<Diagnostic>) {
    let mut reader = Reader {
        file,
        text,
        inputs: None,
        outputs: None,
        kind: Kind::Fd,
        input_names: None,
        output_names: None,
        phase: None,
        announced: None,
        table: None,
        places: Places::default(),
        n_rows: 0,
        n_cells: 0,
        row: Vec::new(),
        findings: Vec::new(),
    };
    reader.lines();
    let table = reader.finish();
    if any_error(&reader.findings) {
        (None, reader.findings)
    } else {
        (table.map(|table| (table, reader.places)), reader.findings)
    }
}

struct Reader<'a> {
    file: FileId,
    text: &'a str,
    inputs: Option<usize>,
    outputs: Option<usize>,
    kind: Kind,
    input_names: Option<(Vec<String>, Span)>,
    output_names: Option<(Vec<String>, Span)>,
    phase: Option<(String, Span)>,
    announced: Option<(usize, Span)>,
    table: Option<Pla>,
    places: Places,
    n_rows: usize,
    n_cells: usize,
    /// The characters of the incomplete row, with their positions.
    row: Vec<(u8, usize)>,
    findings: Vec<Diagnostic>,
}

impl<'a> Reader<'a> {
    fn find(&mut self, finding: Diagnostic) {
        if self.findings.len() < MAX_FINDINGS {
            self.findings.push(finding);
        }
    }

    fn error(&mut self, code: Code, message: impl Into<String>, span: Span, label: &str) {
        self.find(Diagnostic::error(code, message).at(span, label));
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span::new(self.file, start, end)
    }

    fn lines(&mut self) {
        let mut start = 0;
        for line in self.text.split_inclusive('\n') {
            let own = line.split('#').next().unwrap_or_default().trim_end();
            let indent = own.len() - own.trim_start().len();
            let content = own.trim_start();
            if content.starts_with('.') {
                self.row_is_cut();
                if self.directive(content, start + indent) {
                    return;
                }
            } else if !content.is_empty() {
                self.cells(content, start + indent);
            }
            start += line.len();
            if self.findings.len() >= MAX_FINDINGS {
                return;
            }
        }
        self.row_is_cut();
    }

    /// Reports a row that ends too early.
    fn row_is_cut(&mut self) {
        let (Some(&(_, first)), Some(&(_, last))) = (self.row.first(), self.row.last()) else {
            return;
        };
        let need = self.inputs.unwrap_or(0) + self.outputs.unwrap_or(0);
        let n = self.row.len();
        let message = format!("the row has {n} columns, expected {need}");
        let span = self.span(first, last + 1);
        self.row.clear();
        let inputs = self.inputs.unwrap_or(0);
        let help = format!(
            "write {inputs} characters for the inputs and {} for the outputs",
            need - inputs
        );
        let finding = Diagnostic::error(codes::SYNTAX, message);
        self.find(finding.at(span, "this row ends too early").help(help));
    }

    /// Reads one directive; true if the table ends here.
    fn directive(&mut self, content: &'a str, start: usize) -> bool {
        let word = content.split_whitespace().next().unwrap_or_default();
        let rest = content[word.len()..].trim();
        let span = self.span(start, start + content.len());
        let word_span = self.span(start, start + word.len());
        match word {
            ".i" | ".o" => self.count(word, rest, span),
            ".p" => match rest.parse() {
                Ok(count) => self.announced = Some((count, span)),
                Err(_) => {
                    let message = format!("expected the number of products, found `{rest}`");
                    let help = "write the number, or remove the line: rows are counted";
                    self.find(Diagnostic::error(codes::SYNTAX, message).at(span, "").help(help));
                }
            },
            ".type" | ".typ" => self.kind_of_table(rest, span),
            ".ilb" | ".ob" => {
                let names = rest.split_whitespace().map(str::to_owned).collect();
                let place =
                    if word == ".ilb" { &mut self.input_names } else { &mut self.output_names };
                *place = Some((names, span));
            }
            ".phase" => self.phase = Some((rest.replace(char::is_whitespace, ""), span)),
            ".mv" | ".kiss" | ".symbolic" | ".symbolic-output" | ".pair" => {
                let what = match word {
                    ".mv" => "multi-valued inputs",
                    ".kiss" => "a state table",
                    ".pair" => "paired inputs",
                    _ => "symbolic values",
                };
                let message =
                    format!("`{word}` declares {what}, but only binary tables are supported");
                let help = match word {
                    ".kiss" => {
                        "rename the file to `.kiss2` and remove this line, if it is a state table"
                    }
                    _ => "encode each value in bits, with one column for each bit",
                };
                self.find(
                    Diagnostic::error(codes::UNSUPPORTED, message).at(word_span, "").help(help),
                );
            }
            ".e" | ".end" => return true,
            _ if QUIET.contains(&word) => {}
            _ => {
                let near = nearest(word, KNOWN);
                let mut finding = Diagnostic::warning(
                    codes::UNKNOWN_DIRECTIVE,
                    format!("unknown directive `{word}` is ignored"),
                )
                .at(word_span, "here");
                if let Some(near) = near {
                    finding = finding
                        .help(format!("did you mean `{near}`?"))
                        .fix(word_span, near.to_owned());
                } else {
                    finding = finding.help("remove the line");
                }
                self.find(finding);
            }
        }
        false
    }

    fn kind_of_table(&mut self, rest: &str, span: Span) {
        let error = |message: String| Diagnostic::error(codes::SYNTAX, message);
        match Kind::ALL.into_iter().find(|kind| kind.name() == rest) {
            Some(_) if self.n_rows > 0 => self.find(
                error("`.type` must come before the rows".to_owned())
                    .at(span, "after the first row")
                    .help("move it before the rows"),
            ),
            Some(kind) => {
                self.kind = kind;
                self.places.kind = Some(span);
            }
            None => self.find(
                error(format!("unknown kind of table `{rest}`"))
                    .at(span, "here")
                    .help("the kinds are f, fd, fr and fdr"),
            ),
        }
    }

    fn count(&mut self, word: &str, rest: &str, span: Span) {
        let what = if word == ".i" { "inputs" } else { "outputs" };
        let place = if word == ".i" { self.inputs } else { self.outputs };
        match rest.parse::<usize>() {
            Ok(count) if count > MAX_COLUMNS => {
                let message = format!("{count} {what} exceed the limit of {MAX_COLUMNS}");
                let help = if word == ".o" {
                    "split the table by outputs"
                } else {
                    "split the table by outputs, and omit inputs whose columns contain only `-`"
                };
                self.find(Diagnostic::error(codes::TOO_LARGE, message).at(span, "").help(help));
            }
            Ok(count) if self.table.is_some() && place != Some(count) => {
                let message = format!("the number of {what} changes after the first row");
                let help = "remove this line, or move it before the rows";
                self.find(Diagnostic::error(codes::SYNTAX, message).at(span, "").help(help));
            }
            Ok(count) if word == ".i" => self.inputs = Some(count),
            Ok(count) => self.outputs = Some(count),
            Err(_) => {
                let message = format!("expected the number of {what}, found `{rest}`");
                let help = format!("write it as in `{word} 2`");
                self.find(Diagnostic::error(codes::SYNTAX, message).at(span, "").help(help));
            }
        }
    }

    /// Reads characters of rows.
    fn cells(&mut self, content: &str, start: usize) {
        let (Some(inputs), Some(outputs)) = (self.inputs, self.outputs) else {
            if self.n_rows == 0 {
                let missing = match (self.inputs, self.outputs) {
                    (None, None) => "`.i` and `.o`",
                    (None, Some(_)) => "`.i`",
                    _ => "`.o`",
                };
                let message = format!("a row before {missing}");
                let span = self.span(start, start + content.len());
                self.find(Diagnostic::error(codes::SYNTAX, message).at(span, "this row").help(
                    format!(
                        "declare the number of inputs and outputs first, for example `.i {}`",
                        content.split_whitespace().next().unwrap_or_default().len()
                    ),
                ));
            }
            self.n_rows += 1;
            return;
        };
        if inputs + outputs == 0 {
            let span = self.span(start, start + content.len());
            let finding = Diagnostic::error(codes::SYNTAX, "a row in a table without columns");
            let help = "write the number of columns in `.i` and `.o`";
            self.find(finding.at(span, "this row").help(help));
            return;
        }
        for (at, c) in content.char_indices() {
            if c.is_whitespace() || c == '|' {
                continue;
            }
            let is_input = self.row.len() < inputs;
            let is_known = if is_input { "01-2~3?".contains(c) } else { "01-2~34".contains(c) };
            if !is_known {
                let (what, known) = if is_input {
                    ("an input", "0, 1 and - (or 2)")
                } else {
                    ("an output", "0, 1, - (or 2), ~ (or 3) and 4")
                };
                let message = format!("invalid character `{c}` for {what}");
                let span = self.span(start + at, start + at + c.len_utf8());
                self.find(
                    Diagnostic::error(codes::SYNTAX, message)
                        .at(span, format!("in column {} of the row", self.row.len() + 1))
                        .help(format!("valid characters are {known}")),
                );
                self.row.clear();
                return;
            }
            let mut bytes = [0];
            c.encode_utf8(&mut bytes);
            self.row.push((bytes[0], start + at));
            if self.row.len() == inputs + outputs {
                self.row_is_full(inputs, outputs);
            }
        }
    }

    fn row_is_full(&mut self, inputs: usize, outputs: usize) {
        let row = std::mem::take(&mut self.row);
        self.n_rows += 1;
        self.n_cells += row.len();
        if self.n_cells > MAX_CELLS {
            if self.n_cells - row.len() <= MAX_CELLS {
                let message = format!("the rows have more than {MAX_CELLS} characters");
                let span = self.span(row[0].1, row[0].1 + 1);
                self.error(codes::TOO_LARGE, message, span, "up to here");
            }
            return;
        }
        let kind = self.kind;
        let place = Span::new(self.file, row[0].1, row[row.len() - 1].1 + 1);
        let table = self.table.get_or_insert_with(|| Pla::new(kind, Shape::new(inputs, outputs)));
        let mut literals = Vec::new();
        for (input, (cell, _)) in row[..inputs].iter().enumerate() {
            match cell {
                b'0' => literals.push((input, false)),
                b'1' => literals.push((input, true)),
                // An input with no possible value: the product is empty.
                b'~' | b'3' | b'?' => return,
                _ => {}
            }
        }
        let with = |wanted: &[u8]| -> Vec<usize> {
            row[inputs..]
                .iter()
                .enumerate()
                .filter(|(_, (cell, _))| wanted.contains(cell))
                .map(|(output, _)| output)
                .collect()
        };
        let (on, free, off) = (with(b"14"), with(b"-2"), with(b"0"));
        if !on.is_empty() {
            table.on.add(literals.iter().copied(), on);
            self.places.on.push(place);
        }
        if !free.is_empty() && matches!(kind, Kind::Fd | Kind::Fdr) {
            table.free.add(literals.iter().copied(), free);
            self.places.free.push(place);
        }
        if !off.is_empty() && kind.says_off() {
            table.off.add(literals.iter().copied(), off);
            self.places.off.push(place);
        }
    }

    fn finish(&mut self) -> Option<Pla> {
        let end = self.span(self.text.len(), self.text.len());
        let (inputs, outputs) = match (self.inputs, self.outputs) {
            (Some(inputs), Some(outputs)) => (inputs, outputs),
            (inputs, outputs) => {
                if !any_error(&self.findings) {
                    let missing = match (inputs, outputs) {
                        (None, None) => "neither `.i` nor `.o`",
                        (None, Some(_)) => "no `.i`",
                        _ => "no `.o`",
                    };
                    let finding =
                        Diagnostic::error(codes::SYNTAX, format!("the table has {missing}"));
                    let help =
                        "write the numbers of inputs and outputs first, as in `.i 2` and `.o 1`";
                    self.find(finding.at(end, "the text ends here").help(help));
                }
                return None;
            }
        };
        let kind = self.kind;
        let mut table =
            self.table.take().unwrap_or_else(|| Pla::new(kind, Shape::new(inputs, outputs)));
        if let Some((count, span)) = self.announced
            && count != self.n_rows
        {
            let message =
                format!("`.p` declares {count} products, but the table has {}", self.n_rows);
            let help = format!("write `.p {}`, or remove the line", self.n_rows);
            self.find(Diagnostic::warning(codes::MISCOUNTED, message).at(span, "").help(help));
        }
        let input_names = self.input_names.take();
        let output_names = self.output_names.take();
        table.inputs = self.names(input_names, inputs, "inputs");
        table.outputs = self.names(output_names, outputs, "outputs");
        if let Some((phase, span)) = self.phase.take() {
            if phase.len() != outputs || phase.chars().any(|c| !matches!(c, '0' | '1')) {
                let message = format!("`.phase` needs {outputs} characters 0 or 1");
                let help =
                    "write 1 for an output as listed and 0 for its complement, or remove the line";
                self.find(Diagnostic::error(codes::SYNTAX, message).at(span, "").help(help));
            } else {
                table.is_inverted = phase.chars().map(|c| c == '0').collect();
            }
        }
        Some(table)
    }

    fn names(
        &mut self,
        names: Option<(Vec<String>, Span)>,
        count: usize,
        what: &str,
    ) -> Option<Vec<String>> {
        let (names, span) = names?;
        if names.len() == count {
            return Some(names);
        }
        let message = format!("{} names for {count} {what}", names.len());
        self.find(
            Diagnostic::warning(codes::MISCOUNTED, message)
                .at(span, "these names are not used")
                .help(format!("write {count} names, or remove the line")),
        );
        None
    }
}
