//! CUPL: header, pins, equations.

use super::draft::{Definition, Draft, Role, SignalId};
use super::equation::{Grammar, sum};
use super::lexer::{Comments, Kind, Lexer};
use super::palasm::{clock_of, enable, find_device, finish, one_clock, preset};
use crate::codes;
use crate::device::Device;
use grafsynth_ir::diag::{Diagnostic, Severity};
use grafsynth_ir::span::{Name, Span};

const GRAMMAR: Grammar = Grammar {
    not: "!",
    and: &["&"],
    or: &["#"],
    xor: &["$"],
    parens: true,
    constant,
    lone_constants: false,
};

/// `'b'0`, `'h'1` and so on: one bit.
fn constant(lexer: &mut Lexer<'_>) -> Option<bool> {
    let token = lexer.token;
    if token.kind != Kind::Quoted
        || !["'b'", "'d'", "'h'", "'o'"].iter().any(|base| token.text.eq_ignore_ascii_case(base))
    {
        return None;
    }
    let mut ahead = lexer.clone();
    ahead.advance();
    let value = match ahead.token.text {
        "0" => false,
        "1" => true,
        _ => return None,
    };
    ahead.advance();
    *lexer = ahead;
    Some(value)
}

/// Fields of the header; their text ends with `;`.
const HEADER: [&str; 12] = [
    "name", "partno", "date", "revision", "rev", "designer", "company", "assembly", "assy",
    "location", "loc", "format",
];

pub(crate) fn parse(text: &str, draft: &mut Draft) {
    let lexer = Lexer::new(text, draft.file, Comments::Block, true);
    let mut parser =
        Parser { lexer, draft, device: None, clock: None, clock_span: Span::default() };
    parser.file();
    let (device, clock) = (parser.device, parser.clock);
    finish(draft, device, clock);
}

struct Parser<'a, 'd> {
    lexer: Lexer<'a>,
    draft: &'d mut Draft,
    device: Option<&'static Device>,
    clock: Option<SignalId>,
    clock_span: Span,
}

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
            } else if [
                "field",
                "sequence",
                "table",
                "condition",
                "function",
                "append",
                "group",
                "min",
                "fuse",
                "property",
            ]
            .iter()
            .any(|word| token.is_word(word))
                || token.is("$")
            {
                let message = format!(
                    "`{}` is not supported by this reader yet: write equations",
                    token.text
                );
                self.draft.error(codes::UNSUPPORTED, self.lexer.span(), message);
                None
            } else {
                self.equation()
            };
            if done.is_none() {
                self.recover(before);
            }
        }
    }

    /// After an error: past the next `;` (and at least one token on).
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
        }
        self.semicolon()
    }

    /// `PIN 2 = !name ;`, without a number for one that is left open, or lists in brackets for both.
    fn pin(&mut self) -> Option<()> {
        let is_node = !self.lexer.token.is_word("pin");
        self.lexer.advance();
        let numbers = self.numbers()?;
        if !self.lexer.eat("=") {
            let message = format!("expected `=`, found {}", self.lexer.token.shown());
            self.draft.error(codes::SYNTAX, self.lexer.span(), message);
            return None;
        }
        let is_all_inverted = self.lexer.eat("!");
        let is_list = self.lexer.eat("[");
        let mut count = 0;
        loop {
            let is_inverted = self.lexer.eat("!") != is_all_inverted;
            let (span, token) = (self.lexer.span(), self.lexer.token);
            if token.kind != Kind::Word {
                self.draft.error(
                    codes::SYNTAX,
                    span,
                    format!("expected a pin's name, found {}", token.shown()),
                );
                return None;
            }
            self.lexer.advance();
            let id = self.draft.declare(
                token.text,
                span,
                if is_node { Role::Internal } else { Role::Pin },
            );
            let number = numbers.get(count).copied();
            if let (Some(number), Some(device), false) = (number, self.device, is_node)
                && (number == 0 || number > device.n_pins)
            {
                let message =
                    format!("a {} has no pin {number}: it has {}", device.name, device.n_pins);
                self.draft.error(codes::DEVICE_LIMIT, span, message);
            }
            let taken = number
                .filter(|_| !is_node)
                .and_then(|_| self.draft.signals.iter().find(|signal| signal.pin == number));
            if let Some(other) = taken {
                let message = format!("pin {} is `{}` already", number.unwrap_or(0), other.name);
                let finding = Diagnostic::error(codes::DEFINED_TWICE, message)
                    .at(span, "here")
                    .at(other.span, "and here");
                self.draft.report(finding);
            }
            let signal = self.draft.at(id);
            signal.pin = number.filter(|_| !is_node);
            signal.is_pin_inverted = is_inverted;
            count += 1;
            if !is_list {
                break;
            }
            if self.lexer.eat("]") {
                break;
            }
            if !self.lexer.eat(",") {
                let message = format!("expected `,` or `]`, found {}", self.lexer.token.shown());
                self.draft.error(codes::SYNTAX, self.lexer.span(), message);
                return None;
            }
        }
        if !numbers.is_empty() && numbers.len() != count {
            let message = format!("{} pin numbers and {count} names", numbers.len());
            self.draft.error(codes::SYNTAX, self.lexer.span_from(self.lexer.end), message);
        }
        self.semicolon()
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
                self.draft.error(
                    codes::SYNTAX,
                    span,
                    format!("expected a pin number, found {}", token.shown()),
                );
                return None;
            };
            self.lexer.advance();
            if is_list && self.lexer.eat(".") {
                self.lexer.eat(".");
                let last = self.lexer.advance().text.parse::<u32>().unwrap_or(0);
                if last < number || last - number > 1000 {
                    self.draft.error(
                        codes::SYNTAX,
                        span,
                        "expected a range of pin numbers such as `2..5`",
                    );
                    return None;
                }
                numbers.extend(number..=last);
            } else {
                numbers.push(number);
            }
            if !is_list || self.lexer.eat("]") {
                return Some(numbers);
            }
            if !self.lexer.eat(",") {
                let message = format!("expected `,` or `]`, found {}", self.lexer.token.shown());
                self.draft.error(codes::SYNTAX, self.lexer.span(), message);
                return None;
            }
        }
    }

    fn equation(&mut self) -> Option<()> {
        let start = self.lexer.token.start;
        let is_complemented = self.lexer.eat("!");
        let (span, name) = (self.lexer.span(), self.lexer.token);
        if name.kind != Kind::Word {
            self.draft.error(
                codes::SYNTAX,
                span,
                format!("expected the name of an output, found {}", name.shown()),
            );
            return None;
        }
        self.lexer.advance();
        let extension = if self.lexer.eat(".") {
            Some((self.lexer.span(), self.lexer.advance().text.to_ascii_lowercase()))
        } else {
            None
        };
        if !self.lexer.eat("=") {
            let message = format!("expected `=`, found {}", self.lexer.token.shown());
            self.draft.error(codes::SYNTAX, self.lexer.span(), message);
            return None;
        }
        let read = sum(&mut self.lexer, self.draft, &GRAMMAR)?;
        self.semicolon()?;
        let id = self.draft.signal(name.text, span);
        let mut definition = Definition {
            value: read.value,
            sum: read.value,
            is_registered: false,
            is_complemented: false,
            init: false,
            span: self.lexer.span_from(start),
            terms: read.terms,
        };
        match extension.as_ref().map(|(_, text)| text.as_str()) {
            None | Some("d") => {
                definition.is_registered = extension.is_some();
                definition.is_complemented = is_complemented;
                if is_complemented {
                    definition.value = self.draft.not(definition.value);
                }
                let signal = self.draft.at(id);
                // A name without a pin is an intermediate variable.
                if signal.role == Role::Unknown {
                    signal.role = Role::Internal;
                }
                if let (Some(device), Some(pin)) = (self.device, signal.pin)
                    && device.macrocell(pin).is_none()
                {
                    let message = format!(
                        "`{}` is pin {pin} of a {}, which is no output",
                        name.text, device.name
                    );
                    self.draft.error(codes::DEVICE_LIMIT, span, message);
                }
                self.draft.define(id, definition);
            }
            Some("oe") => enable(self.draft, id, definition),
            Some("ck") => {
                self.draft.clocks.insert(id, definition);
                if let Some(clock) = clock_of(self.draft, &definition) {
                    one_clock(
                        self.draft,
                        &mut self.clock,
                        &mut self.clock_span,
                        clock,
                        definition.span,
                    );
                }
            }
            Some("ar") => preset(self.draft, Some(id), false, definition),
            Some("sp") => {
                // Synchronous here, so nothing is lost.
                let before = self.draft.findings.len();
                preset(self.draft, Some(id), true, definition);
                if self
                    .draft
                    .findings
                    .get(before)
                    .is_some_and(|finding| finding.severity == Severity::Warning)
                {
                    self.draft.findings.remove(before);
                }
            }
            Some(other) => {
                let message = format!(
                    "`.{other}` is not supported by this reader: known are .d .ck .ar .sp .oe"
                );
                let at = extension.as_ref().map_or(span, |(span, _)| *span);
                self.draft.error(codes::UNSUPPORTED, at, message);
            }
        }
        Some(())
    }

    fn semicolon(&mut self) -> Option<()> {
        if self.lexer.eat(";") {
            return Some(());
        }
        let message = format!("expected `;`, found {}", self.lexer.token.shown());
        self.draft.error(codes::SYNTAX, self.lexer.span(), message);
        None
    }
}
