//! Parser of program organisation units and configurations.
#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a parser matches the tokens that it accepts; all others are one case"
)]

use grafsynth_ir::Name;
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};

use super::ast::{Body, Instance, Library, Options, Pou, PouKind, Task};
use super::lexer::Kind;
use super::parse::{Parse, Parser};
use crate::codes;

/// Words that begin a unit or another declaration outside of units.
const UNITS: &[&str] =
    &["PROGRAM", "FUNCTION", "FUNCTION_BLOCK", "CONFIGURATION", "TYPE", "VAR_GLOBAL", "INTERFACE"];

impl Parser<'_> {
    /// Parses a whole source.
    pub(crate) fn library(&mut self) -> Library {
        let mut library = Library::default();
        loop {
            let word = self.word(0);
            let before = self.at;
            let result = match word.as_str() {
                _ if self.kind(0) == Kind::End => break,
                "PROGRAM" | "FUNCTION" | "FUNCTION_BLOCK" => {
                    self.pou().map(|pou| library.pous.push(pou))
                }
                "CONFIGURATION" => self.configuration(&mut library),
                "TYPE" => self.types(&mut library.types),
                "VAR_GLOBAL" => self.var_block(&mut library.globals),
                "INTERFACE" | "CLASS" | "NAMESPACE" => {
                    let span = self.here();
                    let what = format!("`{word}` (object-oriented IEC 61131-3)");
                    self.refuse(what, span, "write function blocks without methods");
                    Err(ErrorReported)
                }
                _ if self.kind(0) == Kind::Semicolon => {
                    self.advance();
                    Ok(())
                }
                _ => Err(self.no_unit()),
            };
            if result.is_err() {
                self.lose(before + 1);
                if self.at == before {
                    self.advance();
                }
                self.skip_to_unit();
            }
        }
        library.lost = std::mem::take(&mut self.lost);
        self.unread_pragmas();
        library
    }

    fn no_unit(&mut self) -> ErrorReported {
        let (span, word) = (self.here(), self.word(0));
        let near = nearest(&word, UNITS.iter().copied());
        self.report(|| {
            let finding = Diagnostic::error(
                codes::ST_UNEXPECTED,
                "expected a program, function block, function or configuration",
            );
            match near {
                Some(near) => finding
                    .at(span, "unknown word")
                    .help(format!("did you mean `{near}`?"))
                    .fix(span, near),
                None => finding.at(span, "outside of every unit").help(
                    "remove it, or write `PROGRAM name` before it and `END_PROGRAM` at its end",
                ),
            }
        })
    }

    fn skip_to_unit(&mut self) {
        loop {
            let word = self.word(0);
            if self.kind(0) == Kind::End || UNITS.contains(&word.as_str()) {
                return;
            }
            let closes = matches!(
                word.as_str(),
                "END_PROGRAM"
                    | "END_FUNCTION"
                    | "END_FUNCTION_BLOCK"
                    | "END_CONFIGURATION"
                    | "END_TYPE"
                    | "END_INTERFACE"
                    | "END_CLASS"
                    | "END_NAMESPACE"
            );
            self.advance();
            if closes {
                return;
            }
        }
    }

    fn pou(&mut self) -> Parse<Pou> {
        // A comment above a unit describes the unit.
        let above = self.at.checked_sub(1).and_then(|at| self.list.tokens.get(at));
        let from = above.map_or(0, |token| token.end);
        let first_refused = self.refused.len();
        let word = self.word(0);
        self.advance();
        let name = self.name("a name")?;
        let kind = match word.as_str() {
            "PROGRAM" => PouKind::Program,
            "FUNCTION_BLOCK" => PouKind::FunctionBlock,
            _ => PouKind::Function(if self.take(Kind::Colon) {
                Some(self.type_ref()?)
            } else {
                None
            }),
        };
        let end = format!("END_{word}");
        if self.is("EXTENDS") || self.is("IMPLEMENTS") {
            let span = self.here();
            self.refuse("inheritance of function blocks", span, "declare an instance instead");
            self.advance();
            let _ = self.name("a name");
        }
        let mut vars = Vec::new();
        while self.word(0).starts_with("VAR") {
            if self.var_block(&mut vars).is_err() {
                self.skip_past_var();
            }
        }
        let body = self.body(&end);
        if !self.take_word(&end) {
            let span = self.here();
            let name_span = name.span;
            self.report(|| {
                Diagnostic::error(codes::ST_UNEXPECTED, format!("missing `{end}`"))
                    .at(span, "expected here at the latest")
                    .at(name_span, "begins here")
                    .help(format!("write `{end}` at the end of this unit"))
            });
            self.skip_to_unit();
        }
        let to = self.list.tokens.get(self.at.saturating_sub(1)).map_or(from, |token| token.end);
        let options = self.options(from, to);
        let refused = self.refused.split_off(first_refused);
        Ok(Pou { kind, name, vars, body, actions: Vec::new(), options, refused })
    }

    fn body(&mut self, end: &str) -> Body {
        let is_sfc =
            matches!(self.word(0).as_str(), "INITIAL_STEP" | "STEP" | "TRANSITION" | "ACTION");
        if is_sfc {
            return Body::Sfc(self.sfc(end));
        }
        let mut list = Vec::new();
        loop {
            list.extend(self.statements());
            if self.is(end) || self.kind(0) == Kind::End || UNITS.contains(&self.word(0).as_str()) {
                return Body::Statements(list);
            }
            self.expected("a statement");
            self.advance();
        }
    }

    /// The settings of the pragmas between two positions, without those that an inner element has already read.
    pub(crate) fn options(&mut self, from: usize, to: usize) -> Options {
        let mut options = Options::default();
        for setting in self.pragmas(from, to) {
            if setting.text == "final scan" {
                options.final_scan = true;
            } else {
                options.settings.push(setting);
            }
        }
        options
    }

    /// The settings of the pragmas between two positions. Each setting is returned once, to the first caller.
    pub(crate) fn pragmas(&mut self, from: usize, to: usize) -> Vec<Name> {
        let mut found = Vec::new();
        for aside in self.list.asides.iter_mut() {
            if !aside.is_pragma || aside.is_read || aside.from < from || aside.from >= to {
                continue;
            }
            let text = self.text.get(aside.start..aside.end).unwrap_or("");
            let mut words = text.split_whitespace();
            if words.next() != Some("grafsynth") {
                continue;
            }
            aside.is_read = true;
            let rest = words.collect::<Vec<_>>().join(" ");
            let span = self.places.span(aside.from, aside.end + 1);
            let settings = rest.split(';').map(str::trim).filter(|one| !one.is_empty());
            found.extend(settings.map(|setting| Name::new(setting, span)));
        }
        found
    }

    /// Reports unused pragmas: `grafsynth` pragmas in a wrong place, and those of other tools once per kind.
    pub(crate) fn unread_pragmas(&mut self) {
        let mut told: Vec<&str> = Vec::new();
        for aside in &self.list.asides {
            if !aside.is_pragma || aside.is_read {
                continue;
            }
            let text = self.text.get(aside.start..aside.end).unwrap_or("");
            let word = text.split_whitespace().next().unwrap_or("");
            let span = self.places.span(aside.from, aside.end + 1);
            if word == "grafsynth" {
                self.findings.report(|| {
                    Diagnostic::error(codes::ST_UNEXPECTED, "this pragma is outside every program")
                        .at(span, "has no effect here")
                        .help("move it into a PROGRAM or directly above one")
                });
            } else if !told.contains(&word) {
                told.push(word);
                self.findings.report(|| {
                    Diagnostic::warning(
                        codes::ST_LEFT_OUT,
                        format!("pragmas `{{{word} ..}}` are ignored"),
                    )
                    .at(span, "first occurrence")
                    .help("grafsynth reads only {grafsynth SETTING}, such as {grafsynth conflict all}")
                });
            }
        }
    }

    // Configurations

    fn configuration(&mut self, library: &mut Library) -> Parse<()> {
        self.advance();
        self.name("the name of the configuration")?;
        loop {
            match self.word(0).as_str() {
                "END_CONFIGURATION" => {
                    self.advance();
                    return Ok(());
                }
                "RESOURCE" => {
                    self.advance();
                    self.name("the name of the resource")?;
                    self.expect_word("ON")?;
                    self.name("a processor")?;
                }
                "END_RESOURCE" => {
                    self.advance();
                }
                "TASK" => {
                    let task = self.task()?;
                    library.tasks.push(task);
                }
                "PROGRAM" => {
                    let program = self.program_instance()?;
                    library.programs.push(program);
                }
                "VAR_GLOBAL" => self.var_block(&mut library.globals)?,
                "VAR_CONFIG" | "VAR_ACCESS" => self.skip_past_var(),
                _ if self.kind(0) == Kind::Semicolon => {
                    self.advance();
                }
                _ => {
                    return Err(
                        self.expected("`RESOURCE`, `TASK`, `PROGRAM` or `END_CONFIGURATION`")
                    );
                }
            }
        }
    }

    fn task(&mut self) -> Parse<Task> {
        self.advance();
        let name = self.name("the name of the task")?;
        let mut interval = None;
        if self.take(Kind::Open) {
            loop {
                let key = self.name("`INTERVAL` or `PRIORITY`")?;
                self.expect(Kind::Assign, "`:=`")?;
                if key.id == "INTERVAL" && self.kind(0) == Kind::Time {
                    let token = self.advance();
                    interval = self.time(token).and_then(|ns| u64::try_from(ns).ok());
                } else {
                    self.expression()?;
                    if key.id != "PRIORITY" {
                        self.findings.report(|| {
                            Diagnostic::warning(
                                codes::ST_LEFT_OUT,
                                format!("`{key}` of task `{name}` is ignored: its programs run once per tick"),
                            )
                            .at(key.span, "")
                            .help("write an INTERVAL such as T#10ms")
                        });
                    }
                }
                if !self.take(Kind::Comma) {
                    break;
                }
            }
            self.expect(Kind::Close, "`)`")?;
        }
        self.take(Kind::Semicolon);
        Ok(Task { name, interval: interval.filter(|ns| *ns > 0) })
    }

    fn program_instance(&mut self) -> Parse<Instance> {
        self.advance();
        if matches!(self.word(0).as_str(), "RETAIN" | "NON_RETAIN") {
            self.advance();
        }
        let name = self.name("the name of the program's instance")?;
        let task = if self.take_word("WITH") { Some(self.name("a task")?) } else { None };
        self.expect(Kind::Colon, "`:` and a program")?;
        let program = self.name("a program")?;
        let start = self.peek(0).start;
        if self.take(Kind::Open) {
            let open_at = self.places.span(start, start + 1);
            self.findings.report(|| {
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("the connections of instance `{name}` are ignored: the inputs and outputs of its program are those of the design"),
                )
                .at(open_at, "ignored from here")
                .help("assign pins to the inputs and outputs in a board file")
            });
            let mut open = 1usize;
            while open > 0 && self.kind(0) != Kind::End {
                match self.advance().kind {
                    Kind::Open => open += 1,
                    Kind::Close => open -= 1,
                    _ => {}
                }
            }
        }
        self.take(Kind::Semicolon);
        Ok(Instance { name, task, program })
    }

    pub(crate) fn skip_past_var(&mut self) {
        while self.kind(0) != Kind::End {
            let word = self.word(0);
            if UNITS.contains(&word.as_str()) && word != "VAR_GLOBAL" {
                return;
            }
            self.advance();
            if word == "END_VAR" {
                return;
            }
        }
    }
}
