//! CUPL: header, pins, fields, equations (also of lists), `APPEND`, and `$DEFINE` of expressions and numbers. State machines and tables are rejected by
//! name. Names are case-sensitive; keywords are not.

use super::ast::{Definition, Expr, PldAst, Role, SignalId};
use super::lexer::{Comments, Kind, Lexer};
use super::number;
use super::palasm::{clocked, enable, find_device, finish, preset};
use super::sets::{self, Field, Names};
use crate::codes;
use crate::device::{Device, FlipFlop};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::{Name, Span};

/// Fields of the header; their text ends with `;`.
const HEADER: [&str; 12] = [
    "name", "partno", "date", "revision", "rev", "designer", "company", "assembly", "assy",
    "location", "loc", "format",
];

pub(crate) fn parse(text: &str, draft: &mut PldAst) {
    let lexer = Lexer::new(text, draft.file, Comments::Block, true);
    let mut parser = Parser {
        lexer,
        draft,
        device: None,
        mnemonic: None,
        clock: None,
        clock_span: Span::default(),
        names: Names::default(),
    };
    parser.file();
    parser.check_mnemonic();
    let (device, clock) = (parser.device, parser.clock);
    finish(draft, device, clock);
}

struct Parser<'a, 'd> {
    lexer: Lexer<'a>,
    draft: &'d mut PldAst,
    device: Option<&'static Device>,
    /// The device named in the text, in lower case.
    mnemonic: Option<(String, Span)>,
    clock: Option<SignalId>,
    clock_span: Span,
    names: Names,
}

/// The signals on the left side of an equation, with their places.
type Targets = Vec<(SignalId, Span)>;

impl Parser<'_, '_> {
    fn file(&mut self) {
        while self.lexer.token.kind != Kind::End && !self.draft.is_hopeless() {
            let before = self.lexer.token.start;
            let token = self.lexer.token;
            let done = if self.lexer.eat(";") {
                Some(())
            } else if HEADER.iter().any(|word| token.is_word(word)) {
                self.header(token.is_word("name"))
            } else if token.is_word("device") {
                self.device()
            } else if token.is_word("pin") || token.is_word("pinnode") || token.is_word("node") {
                self.pin()
            } else if token.is_word("field") {
                self.field()
            } else if token.is_word("append") {
                self.lexer.advance();
                self.equation(true)
            } else if ["min", "group", "property", "fuse", "loc"]
                .iter()
                .any(|word| token.is_word(word))
            {
                self.left_out()
            } else if ["sequence", "sequenced", "sequencejk", "table", "condition", "function"]
                .iter()
                .any(|word| token.is_word(word))
            {
                self.refuse_block()
            } else if token.is("$") {
                self.directive()
            } else {
                self.equation(false)
            };
            if done.is_none() {
                self.recover(before);
            }
        }
    }

    /// Checks the suffix of a device's mnemonic: `s` and `ma` select modes without registers, `cp` has a power-down pin.
    fn check_mnemonic(&mut self) {
        let (Some((mnemonic, span)), Some(device)) = (self.mnemonic.take(), self.device) else {
            return;
        };
        let Some((_, ending)) =
            ["16v8", "20v8", "22v10"].iter().find_map(|own| mnemonic.split_once(own))
        else {
            return;
        };
        let power_down = ending.strip_prefix("cp");
        let mode = power_down.unwrap_or(ending);
        let register = self
            .draft
            .signals
            .iter()
            .find(|signal| signal.definition.is_some_and(|own| own.is_registered));
        if let (Some(register), true) = (register, ["s", "as", "ma"].contains(&mode)) {
            let message = format!(
                "`{}` is registered, but the device `{mnemonic}` selects a mode without registers",
                register.name
            );
            let finding = Diagnostic::error(codes::DEVICE_LIMIT, message)
                .at(register.span, "")
                .at(span, "this device")
                .help("use the ending `ms` for the registered mode, or no ending to select the mode automatically");
            self.draft.report(finding);
        }
        if power_down.is_some() {
            // Pin 4, according to the data sheets of the devices with this feature.
            const SWITCH: u32 = 4;
            let used = self.draft.signals.iter().find(|signal| signal.pin == Some(SWITCH));
            if let Some(used) = used.filter(|used| used.n_reads > 0) {
                let message = format!(
                    "`{}` is on pin {SWITCH}, the power-down pin of a `{mnemonic}`, which is not a logic input",
                    used.name
                );
                let finding = Diagnostic::error(codes::DEVICE_LIMIT, message)
                    .at(used.span, "")
                    .at(span, "this device")
                    .help("name the device without `cp` to use the pin as an input");
                self.draft.report(finding);
                return;
            }
            let message = format!(
                "the power-down pin of a `{mnemonic}` is ignored: the device is read as a {}",
                device.name
            );
            self.draft.report_beyond(
                Diagnostic::warning(codes::TAKEN_AS, message).at(span, "this device"),
            );
        }
    }

    /// Refuses `SEQUENCE f { .. }` and similar blocks.
    fn refuse_block(&mut self) -> Option<()> {
        let token = self.lexer.token;
        let message =
            format!("`{}` is not supported: write its functions as equations", token.text);
        self.draft.report(
            Diagnostic::error(codes::UNSUPPORTED, message)
                .at(self.lexer.span(), "")
                .help("copy the equations from CUPL's listing (.doc)"),
        );
        let mut depth = 0_u32;
        while self.lexer.token.kind != Kind::End {
            let token = self.lexer.advance();
            if token.is("{") {
                depth = depth.saturating_add(1);
            } else if token.is("}") {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    break;
                }
            } else if token.is(";") && depth == 0 {
                break;
            }
        }
        Some(())
    }

    /// Skips options of the minimiser and the fitter, because they do not change the circuit.
    fn left_out(&mut self) -> Option<()> {
        let (span, token) = (self.lexer.span(), self.lexer.token);
        let message = format!("`{}` is ignored: it does not change the circuit", token.text);
        self.draft.report(Diagnostic::warning(codes::TAKEN_AS, message).at(span, "this statement"));
        while self.lexer.token.kind != Kind::End && !self.lexer.eat(";") {
            self.lexer.advance();
        }
        Some(())
    }

    /// Reads `FIELD name = [A7..0] ;`.
    fn field(&mut self) -> Option<()> {
        self.lexer.advance();
        let (span, name) = (self.lexer.span(), self.lexer.token);
        if name.kind != Kind::Word {
            self.draft.error_with(
                codes::SYNTAX,
                span,
                format!("expected the field's name, found {}", name.shown()),
                "write it as in `FIELD address = [A15..A12] ;`",
            );
            return None;
        }
        self.lexer.advance();
        if !self.lexer.eat("=") || !self.lexer.token.is("[") {
            let message = format!("expected `= [`, found {}", self.lexer.token.shown());
            let help = format!("write it as in `FIELD {} = [A15..A12] ;`", name.text);
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        let signals = sets::list(&mut self.lexer, self.draft)?;
        let whole = self.lexer.span_from(name.start);
        self.semicolon()?;
        let signals: Vec<SignalId> = signals.into_iter().map(|(signal, _)| signal).collect();
        let field = match Field::new(self.draft, &signals) {
            Ok(field) => field,
            Err(why) => {
                let message =
                    format!("the bits of the field `{}` are not numbered: {why}", name.text);
                let help =
                    "use names with different indices from 0 to 31, or names without indices";
                self.draft.error_with(codes::UNSUPPORTED, whole, message, help);
                return Some(());
            }
        };
        if self.names.fields.insert(name.text.to_owned(), field).is_some() {
            self.draft.error_with(
                codes::DEFINED_TWICE,
                span,
                format!("the field `{}` is declared twice", name.text),
                "remove one of the declarations, or use another name",
            );
        }
        Some(())
    }

    /// Reads `$DEFINE name expression`, like an intermediate variable; `$DEFINE name 'b'01`: a number. Other directives are rejected by name.
    fn directive(&mut self) -> Option<()> {
        let start = self.lexer.token.start;
        self.lexer.advance();
        let (span, word) = (self.lexer.span(), self.lexer.token);
        if word.is_word("define") && !word.is_first {
            self.lexer.advance();
            let (span, name) = (self.lexer.span(), self.lexer.token);
            if name.kind != Kind::Word || name.is_first {
                self.draft.error_with(
                    codes::UNSUPPORTED,
                    span,
                    "`$DEFINE` of an operator is not supported",
                    "remove this line, and write the operators of CUPL in the equations: `&`, `#`, `!` and `$`",
                );
                self.lexer.advance();
                self.lexer.skip_line();
                return Some(());
            }
            self.lexer.advance();
            if matches!(self.lexer.token.kind, Kind::Number | Kind::Quoted)
                && !self.lexer.token.is_first
            {
                return self.define_number(name.text, start);
            }
            let (value, weakest) = sets::definition(&mut self.lexer, self.draft, &self.names)?;
            let value = value.bits;
            let id = self.draft.declare(name.text, span, Role::Internal);
            let whole = self.lexer.span_from(start);
            if !self.lexer.token.is_first || value.len() != 1 {
                self.draft.error_with(
                    codes::UNSUPPORTED,
                    whole,
                    "`$DEFINE` is supported only for one expression of one bit",
                    "write the text where the name is used, or run CUPL's preprocessor first",
                );
                self.lexer.skip_line();
                return Some(());
            }
            let definition = Definition::new(value[0], whole, 0);
            self.draft.define(id, definition);
            self.names.defined.insert(id, weakest);
            return Some(());
        }
        let message = format!("`${}` is not supported", word.text);
        let help = "run CUPL's preprocessor first, or write the text that it produces";
        self.draft.error_with(codes::UNSUPPORTED, span, message, help);
        self.lexer.advance();
        if !self.lexer.token.is_first {
            self.lexer.skip_line();
        }
        Some(())
    }

    fn define_number(&mut self, name: &str, start: usize) -> Option<()> {
        let number = number::definition(&mut self.lexer, self.draft, &self.names.numbers)?;
        let whole = self.lexer.span_from(start);
        if !self.lexer.token.is_first {
            let message =
                format!("`$DEFINE {name}` is supported only for one number or one expression");
            let help = "write the text where the name is used, or run CUPL's preprocessor first";
            self.draft.error_with(codes::UNSUPPORTED, whole, message, help);
            self.lexer.skip_line();
        } else if self.names.numbers.insert(name.to_owned(), number).is_some() {
            let message = format!("the number `{name}` is declared twice");
            let help = "remove one of the declarations, or use another name";
            self.draft.error_with(codes::DEFINED_TWICE, whole, message, help);
        }
        Some(())
    }

    /// After an error: skips past the next `;`, or at least one token.
    fn recover(&mut self, before: usize) {
        if self.lexer.token.start == before {
            self.lexer.advance();
        }
        while self.lexer.token.kind != Kind::End {
            if self.lexer.eat(";") {
                return;
            }
            self.lexer.advance();
        }
    }

    fn header(&mut self, is_name: bool) -> Option<()> {
        self.lexer.advance();
        let start = self.lexer.token.start;
        while self.lexer.token.kind != Kind::End && !self.lexer.token.is(";") {
            self.lexer.advance();
        }
        if is_name && self.lexer.end > start {
            let text = self.lexer.slice(start, self.lexer.end).trim();
            self.draft.name = Name::new(text, self.lexer.span_from(start));
        }
        self.semicolon()
    }

    fn device(&mut self) -> Option<()> {
        self.lexer.advance();
        let (span, token) = (self.lexer.span(), self.lexer.advance());
        if !token.is_word("virtual") {
            self.device = find_device(self.draft, token.text, span);
            self.mnemonic = Some((token.text.to_ascii_lowercase(), span));
        }
        self.semicolon()
    }

    /// Reads `PIN 2 = !name ;`, without a number if the pin is not assigned, or with lists in brackets for both.
    fn pin(&mut self) -> Option<()> {
        let is_node = !self.lexer.token.is_word("pin");
        let start = self.lexer.token.start;
        self.lexer.advance();
        let numbers = self.numbers()?;
        if !self.lexer.eat("=") {
            let message = format!("expected `=`, found {}", self.lexer.token.shown());
            let help = "write it as in `PIN 2 = start ;`";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        let is_all_inverted = self.lexer.eat("!");
        let mut names = Vec::new();
        if self.lexer.token.is("[") {
            let mut ahead = self.lexer.clone();
            ahead.advance();
            if ahead.token.is("!") {
                names = self.inverted_names(is_all_inverted)?;
            } else {
                let plain = sets::names(&mut self.lexer, self.draft)?;
                names.extend(plain.into_iter().map(|(name, span)| (name, span, is_all_inverted)));
            }
        } else {
            let is_inverted = self.lexer.eat("!") != is_all_inverted;
            let (span, token) = (self.lexer.span(), self.lexer.token);
            if token.kind != Kind::Word {
                self.draft.error_with(
                    codes::SYNTAX,
                    span,
                    format!("expected a pin's name, found {}", token.shown()),
                    "a name begins with a letter, as in `PIN 2 = start ;`",
                );
                return None;
            }
            self.lexer.advance();
            names.push((token.text.to_owned(), span, is_inverted));
        }
        let count = names.len();
        for (at, (name, span, is_inverted)) in names.into_iter().enumerate() {
            let id =
                self.draft.declare(&name, span, if is_node { Role::Internal } else { Role::Pin });
            let number = numbers.get(at).copied();
            if let (Some(number), Some(device), false) = (number, self.device, is_node)
                && (number == 0 || number > device.n_pins)
            {
                let message = format!(
                    "{} has no pin {number}: it has {}",
                    device.with_article(),
                    device.n_pins
                );
                let help = format!("write a number from 1 to {}", device.n_pins);
                self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
            }
            let taken =
                number.filter(|_| !is_node).and_then(|pin| Some((pin, self.draft.with_pin(pin)?)));
            if let Some((pin, other)) = taken {
                self.draft.pin_taken(pin, other, span);
            }
            let signal = self.draft.at(id);
            signal.pin = number.filter(|_| !is_node);
            signal.is_pin_inverted = is_inverted;
        }
        if !numbers.is_empty() && numbers.len() != count {
            let message = format!("{} pin numbers but {count} names", numbers.len());
            let help = "write as many names as numbers, as in `PIN [2..4] = [a, b, c] ;`";
            self.draft.error_with(codes::SYNTAX, self.lexer.span_from(start), message, help);
        }
        self.semicolon()
    }

    /// `[!a, b, !c]`: a list in which individual names may be inverted.
    fn inverted_names(&mut self, is_all_inverted: bool) -> Option<Vec<(String, Span, bool)>> {
        self.lexer.advance();
        let mut names = Vec::new();
        loop {
            let is_inverted = self.lexer.eat("!") != is_all_inverted;
            let (span, token) = (self.lexer.span(), self.lexer.token);
            if token.kind != Kind::Word {
                let message = format!("expected a pin's name, found {}", token.shown());
                let help = "a name begins with a letter, as in `PIN [2, 3] = [start, !stop] ;`";
                self.draft.error_with(codes::SYNTAX, span, message, help);
                return None;
            }
            self.lexer.advance();
            names.push((token.text.to_owned(), span, is_inverted));
            if self.lexer.eat("]") {
                return Some(names);
            }
            if !self.lexer.eat(",") {
                let message = format!("expected `,` or `]`, found {}", self.lexer.token.shown());
                let help = "separate the entries by `,`, and close the list with `]`";
                self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
                return None;
            }
        }
    }

    fn numbers(&mut self) -> Option<Vec<u32>> {
        let is_list = self.lexer.eat("[");
        let mut numbers = Vec::new();
        if self.lexer.token.is("=") {
            return Some(numbers);
        }
        loop {
            let (span, token) = (self.lexer.span(), self.lexer.token);
            // `1..4` is two numbers with two dots between them.
            let Some(number) =
                token.text.parse::<u32>().ok().filter(|_| token.kind == Kind::Number)
            else {
                self.draft.error_with(
                    codes::SYNTAX,
                    span,
                    format!("expected a pin number, found {}", token.shown()),
                    "write it as in `PIN 2 = start ;`, or `PIN = start ;` for an unassigned pin",
                );
                return None;
            };
            self.lexer.advance();
            if is_list && self.lexer.eat(".") {
                self.lexer.eat(".");
                let last = self.lexer.advance().text.parse::<u32>().unwrap_or(0);
                if last == 0 || last.abs_diff(number) > 1000 {
                    self.draft.error_with(
                        codes::SYNTAX,
                        span,
                        "expected a range of pin numbers such as `2..5`",
                        "write both numbers, as in `PIN [2..5] = [a, b, c, d] ;`",
                    );
                    return None;
                }
                if last < number {
                    numbers.extend((last..=number).rev());
                } else {
                    numbers.extend(number..=last);
                }
            } else {
                numbers.push(number);
            }
            if !is_list || self.lexer.eat("]") {
                return Some(numbers);
            }
            if !self.lexer.eat(",") {
                let message = format!("expected `,` or `]`, found {}", self.lexer.token.shown());
                let help = "separate the entries by `,`, and close the list with `]`";
                self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
                return None;
            }
        }
    }

    /// Reads `!x.d = expression ;`, also with a list or a field on the left.
    fn equation(&mut self, is_append: bool) -> Option<()> {
        let start = self.lexer.token.start;
        let is_complemented = self.lexer.eat("!");
        let name = self.lexer.token.text;
        let (targets, field) = self.targets()?;
        let extension = if self.lexer.eat(".") {
            Some((self.lexer.span(), self.lexer.advance().text.to_ascii_lowercase()))
        } else {
            None
        };
        if !self.lexer.eat("=") {
            let message = format!("expected `=`, found {}", self.lexer.token.shown());
            let help = "an equation is `NAME = .. ;`, or `NAME.D = .. ;` for a register; check the `;` before it";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        let value = sets::expression(&mut self.lexer, self.draft, &self.names)?;
        self.semicolon()?;
        // Assignments to a list go by position, unless a field is assigned to it.
        let target = match field {
            Some(field) => Some(field),
            None if value.is_field => {
                let listed: Vec<SignalId> = targets.iter().map(|(id, _)| *id).collect();
                Some(Field::as_listed(self.draft, &listed))
            }
            None => None,
        };
        if let (Some(target), true) = (target, value.bits.len() > 1)
            && let Err(why) = target.takes(&value)
        {
            let finding = Diagnostic::error(codes::UNSUPPORTED, why)
                .at(self.lexer.span_from(start), "")
                .help("write one equation for each bit, or lists in brackets");
            self.draft.report(finding);
            return Some(());
        }
        // The preprocessor would also replace a defined name on the left side by its text.
        let is_defined = targets.iter().any(|(id, _)| self.names.defined.contains_key(id))
            || self.names.numbers.contains_key(name);
        if is_defined {
            let finding = Diagnostic::error(
                codes::DEFINED_TWICE,
                format!("`{name}` is defined by `$DEFINE` and cannot be assigned"),
            )
            .at(self.lexer.span_from(start), "assigned here")
            .help("assign the signal itself, or use another name");
            self.draft.report(finding);
            return Some(());
        }
        let values = value.bits;
        if values.len() != 1 && values.len() != targets.len() {
            let message = format!("{} bits for {} signals", values.len(), targets.len());
            let help =
                "write lists of the same length on both sides, or one equation for each signal";
            self.draft.error_with(codes::SYNTAX, self.lexer.span_from(start), message, help);
            return Some(());
        }
        for (at, (id, span)) in targets.into_iter().enumerate() {
            let value = if values.len() == 1 { values[0] } else { values[at] };
            let definition = Definition::new(value, self.lexer.span_from(start), 0);
            let extension = extension.as_ref().map(|(span, text)| (*span, text.as_str()));
            self.assign(id, span, is_complemented, is_append, extension, definition);
        }
        Some(())
    }

    /// Reads the signals on the left: a name, a list in brackets, or the name of a field, which is the second result.
    fn targets(&mut self) -> Option<(Targets, Option<Field>)> {
        let (span, name) = (self.lexer.span(), self.lexer.token);
        if name.is("[") {
            return Some((sets::list(&mut self.lexer, self.draft)?, None));
        }
        if name.kind != Kind::Word {
            self.draft.error_with(
                codes::SYNTAX,
                span,
                format!("expected the name of an output, found {}", name.shown()),
                "an equation is `NAME = .. ;`, or `NAME.D = .. ;` for a register; check the `;` before it",
            );
            return None;
        }
        self.lexer.advance();
        let Some(field) = self.names.fields.get(name.text) else {
            return Some((vec![(self.draft.signal(name.text, span), span)], None));
        };
        let targets = field.signals.iter().map(|signal| (*signal, span)).collect();
        Some((targets, Some(field.clone())))
    }

    fn assign(
        &mut self,
        id: SignalId,
        span: Span,
        is_complemented: bool,
        is_append: bool,
        extension: Option<(Span, &str)>,
        mut definition: Definition,
    ) {
        let at = extension.map_or(span, |(span, _)| span);
        let complement_if = |draft: &mut PldAst, is_complement: bool, value| {
            if is_complement { draft.not(value) } else { value }
        };
        match extension.map(|(_, text)| text) {
            // A T flip-flop keeps its value unless its sum is true: `APPEND` would need the sum alone.
            Some("t") if !is_append => {
                if let Some(device) = self.device.filter(|own| !own.has_flip_flop(FlipFlop::T)) {
                    let message = format!("a {} has no T flip-flops", device.name);
                    self.draft.error(codes::DEVICE_LIMIT, at, message);
                    return;
                }
                let sum = complement_if(self.draft, is_complemented, definition.sum);
                let own = self.draft.read(id);
                definition.value = self.draft.expr(Expr::Xor(own, sum));
                definition.sum = complement_if(self.draft, is_complemented, definition.value);
                definition.is_registered = true;
                definition.is_complemented = is_complemented;
                self.draft.check_output(self.device, id, span);
                self.draft.define(id, definition);
            }
            None | Some("d") => {
                definition.is_registered = extension.is_some();
                definition.is_complemented = is_complemented;
                definition.value = complement_if(self.draft, is_complemented, definition.value);
                let signal = self.draft.at(id);
                // A name without a pin is an intermediate variable.
                if signal.role == Role::Unknown {
                    signal.role = Role::Internal;
                }
                self.draft.check_output(self.device, id, span);
                match self.draft.at(id).definition {
                    Some(first) if is_append => {
                        if (first.is_complemented, first.is_registered)
                            != (is_complemented, definition.is_registered)
                        {
                            self.report_other_form(id, first.span, definition.span);
                            return;
                        }
                        let sum = self.draft.list(&[first.sum, definition.sum], false);
                        let value = complement_if(self.draft, is_complemented, sum);
                        self.draft.at(id).definition = Some(Definition { sum, value, ..first });
                    }
                    Some(_) | None => self.draft.define(id, definition),
                }
            }
            Some("oe") => enable(self.draft, id, definition),
            Some("ck") => {
                let known = (&mut self.clock, &mut self.clock_span);
                clocked(self.draft, known, Some(id), definition);
            }
            Some("ar") => preset(self.draft, Some(id), false, definition),
            Some("sp") => {
                // A circuit with one clock expresses a synchronous preset exactly, so nothing is reported.
                let before = self.draft.beyond.len();
                preset(self.draft, Some(id), true, definition);
                self.draft.beyond.truncate(before);
            }
            Some(other) => {
                let message = format!("unsupported extension `.{other}`");
                let help = "write .d or .t (register), .ck (clock), .ar (reset), .sp (preset) or .oe (output enable)";
                self.draft.error_with(codes::UNSUPPORTED, at, message, help);
            }
        }
    }

    /// Reports an `APPEND` to an equation with another left side.
    fn report_other_form(&mut self, id: SignalId, first: Span, span: Span) {
        let name = &self.draft.signals[id as usize].name;
        let message = format!("`APPEND` to `{name}` has a different form than its first equation");
        let finding = Diagnostic::error(codes::DEFINED_TWICE, message)
            .at(span, "here")
            .at(first, "the first one")
            .help("write the same left side in both, with `!` and `.d` in both or in neither");
        self.draft.report(finding);
    }

    fn semicolon(&mut self) -> Option<()> {
        if self.lexer.eat(";") {
            return Some(());
        }
        let message = format!("expected `;`, found {}", self.lexer.token.shown());
        let help = "write `;` after the statement, or an operator (`&`, `#` or `$`) before it";
        self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
        None
    }
}
