//! PALASM. Versions 2 and 4: `PIN` statements or the positional list of the older form, `STRING`, `EQUATIONS`; a simulation section is skipped.
//! Version 1: the device in the first line, three title lines, the list of pins, then equations, with `IF (condition) Y = ..` for tri-state outputs;
//! `FUNCTION TABLE` and `DESCRIPTION` are skipped.

use super::ast::{Definition, PldAst, Role, SignalId};
use super::equation::{Grammar, Sum, sum, supply};
use super::lexer::{Comments, Kind, Lexer};
use crate::codes;
use crate::device::{Clock, Device};
use crate::equations::CLOCK_NAMES;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::{Name, Span};

const GRAMMAR: Grammar = Grammar {
    not: "/",
    and: &["*", "&"],
    or: &["+"],
    xor: &[":+:"],
    parens: true,
    constant: supply,
    lone_constants: false,
};

pub(crate) fn parse(text: &str, draft: &mut PldAst) {
    let lexer = Lexer::new(text, draft.file, Comments::Semicolon, true);
    let mut parser = Parser {
        lexer,
        draft,
        device: None,
        clock: None,
        clock_span: Span::default(),
        globals: vec!["global".to_owned()],
        is_first_version: false,
    };
    match first_version(text) {
        Some(device) => parser.old_file(text, device),
        None => parser.file(),
    }
    let (device, clock) = (parser.device, parser.clock);
    finish(draft, device, clock);
}

/// Determines the clock signal and the power-up values after the whole text is read; `clock` is the clock that the text names, if any.
pub(crate) fn finish(draft: &mut PldAst, device: Option<&'static Device>, clock: Option<SignalId>) {
    draft.device = device;
    let is_registered = draft
        .signals
        .iter()
        .any(|signal| signal.definition.is_some_and(|definition| definition.is_registered));
    if !is_registered {
        return;
    }
    let clock_pin = match device.map(|device| device.clock) {
        Some(Clock::Pin(pin)) => Some(pin),
        Some(Clock::Term | Clock::None) | None => None,
    };
    let by_name = clock_by_name(draft);
    for index in 0..draft.signals.len() {
        let signal = &mut draft.signals[index];
        let id = SignalId::try_from(index).unwrap_or(SignalId::MAX);
        let is_free = signal.role == Role::Pin && signal.definition.is_none();
        let is_clock = clock == Some(id)
            || clock.is_none()
                && (signal.pin.is_some() && signal.pin == clock_pin || by_name == Some(id));
        if is_clock && is_free {
            signal.role = Role::Clock;
        }
        let is_inverted = signal.is_pin_inverted;
        if let Some(definition) = &mut signal.definition
            && definition.is_registered
        {
            definition.init = match device {
                Some(device) => device.power_up_value(is_inverted, definition.is_complemented),
                None => definition.is_complemented,
            };
        }
    }
    if let (Some(device), Some(pin), None) = (device, clock_pin, clock) {
        check_clock_pin(draft, device, pin);
    }
}

/// Warns about a signal that has the name of a clock but is on a pin that is not the clock pin: the clock pin of the device has no name,
/// and nothing reads the signal.
fn check_clock_pin(draft: &mut PldAst, device: &Device, clock_pin: u32) {
    if draft.with_pin(clock_pin).is_some() || !draft.clocks.is_empty() {
        return;
    }
    let is_clock = |name: &str| {
        let name = name.to_ascii_lowercase();
        name.contains("clk") || name.contains("clock")
    };
    let idle = draft.signals.iter().find(|signal| {
        signal.definition.is_none()
            && signal.n_reads == 0
            && signal.pin.is_some_and(|pin| pin != clock_pin)
            && is_clock(&signal.name)
    });
    let register = draft
        .signals
        .iter()
        .find_map(|signal| signal.definition.filter(|definition| definition.is_registered));
    let (Some(idle), Some(register)) = (idle, register) else { return };
    let pin = idle.pin.unwrap_or(0);
    let finding = Diagnostic::warning(
        codes::DEVICE_LIMIT,
        format!(
            "`{}` on pin {pin} clocks nothing: pin {clock_pin} clocks the registers of {}",
            idle.name,
            device.with_article()
        ),
    )
    .at(idle.span, "no equation reads this signal")
    .at(register.span, format!("clocked by pin {clock_pin}, which has no name"))
    .help(format!("connect the clock to pin {clock_pin}: declare `{}` there", idle.name));
    draft.report(finding);
}

/// The signal without a pin number whose name identifies it as the clock. If there are several, the first: our texts list the clock before the inputs, as
/// `clk_2` if the circuit uses all usual names for other signals.
fn clock_by_name(draft: &PldAst) -> Option<SignalId> {
    let mut free = draft.signals.iter().enumerate().filter(|(_, signal)| {
        signal.role == Role::Pin && signal.definition.is_none() && signal.pin.is_none()
    });
    let is_usual = |name: &str| CLOCK_NAMES.iter().any(|usual| name.eq_ignore_ascii_case(usual));
    let first = free.next()?;
    let number =
        CLOCK_NAMES.first().and_then(|usual| first.1.name.strip_prefix(usual)?.strip_prefix('_'));
    let is_first = is_usual(&first.1.name)
        || number.is_some_and(|it| !it.is_empty() && it.bytes().all(|byte| byte.is_ascii_digit()));
    let found = if is_first { Some(first) } else { free.find(|(_, it)| is_usual(&it.name)) };
    found.and_then(|(index, _)| SignalId::try_from(index).ok())
}

/// Looks up a device; the flip-flops of an unknown device are assumed to be 0 after power-up.
pub(crate) fn find_device(draft: &mut PldAst, name: &str, span: Span) -> Option<&'static Device> {
    let device = Device::find(name);
    if device.is_none() {
        let message =
            format!("unknown device `{name}`: its registers are assumed to power up at 0");
        draft.report(
            Diagnostic::warning(codes::UNKNOWN_DEVICE, message)
                .at(span, "this device")
                .help("write the name of a known device (`grafsynth build --device list`), or check the power-up values yourself"),
        );
    }
    device
}

/// The device of a text of version 1: the first word of its first line that is neither empty nor a comment, if no `CHIP` follows.
fn first_version(text: &str) -> Option<&str> {
    let mut lines = text.lines().map(|line| line.split(';').next().unwrap_or_default().trim());
    let word = lines.by_ref().find(|line| !line.is_empty())?.split_whitespace().next()?;
    let upper = word.to_ascii_uppercase();
    let is_device = upper.contains("PAL")
        && upper.bytes().any(|byte| byte.is_ascii_digit())
        && upper.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
    let has_chip = lines.any(|line| {
        line.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("chip"))
    });
    (is_device && !has_chip).then_some(word)
}

struct Parser<'a, 'd> {
    lexer: Lexer<'a>,
    draft: &'d mut PldAst,
    device: Option<&'static Device>,
    clock: Option<SignalId>,
    clock_span: Span,
    /// Names of the node that sets and resets all registers, in lower case.
    globals: Vec<String>,
    /// True if the text is one of version 1.
    is_first_version: bool,
}

/// Words that begin a section or a declaration.
const SECTIONS: [&str; 8] =
    ["equations", "simulation", "string", "pin", "node", "state", "conditions", "group"];

impl<'a> Parser<'a, '_> {
    fn file(&mut self) {
        while self.lexer.token.kind != Kind::End && !self.draft.is_hopeless() {
            let token = self.lexer.token;
            let word = token.text.to_ascii_lowercase();
            let span = self.lexer.span();
            match word.as_str() {
                "title" | "pattern" | "revision" | "author" | "company" | "date" | "option"
                | "options"
                    if token.is_first =>
                {
                    self.lexer.advance();
                    if !self.lexer.token.is_first {
                        self.lexer.rest_of_line();
                    }
                }
                "chip" if token.is_first => self.chip(),
                "pin" | "node" => self.pin(),
                "string" => self.string(),
                "equations" => {
                    self.lexer.advance();
                    self.equations();
                }
                "simulation" => return,
                "state" | "conditions" => {
                    let message = format!(
                        "the {} section is not supported: write its functions as equations",
                        token.text
                    );
                    let help =
                        "write the next state of each bit of the state as an equation: `q0 := ..`";
                    self.draft.error_with(codes::UNSUPPORTED, span, message, help);
                    self.skip_section();
                }
                _ => {
                    let message = format!("expected a declaration, found {}", token.shown());
                    let help = "the lines before `EQUATIONS` are `CHIP NAME DEVICE`, `PIN NUMBER NAME`, `NODE` or `STRING`; a remark begins with `;`";
                    self.draft.error_with(codes::SYNTAX, span, message, help);
                    self.lexer.advance();
                    self.lexer.skip_line();
                }
            }
        }
    }

    /// Reads a text of version 1: device, three title lines, pins, equations.
    fn old_file(&mut self, text: &'a str, device: &str) {
        self.is_first_version = true;
        let start = text.find(device).unwrap_or(0);
        let span = Span::new(self.draft.file, start, start + device.len());
        let name = device.split('-').next().unwrap_or(device);
        self.device = find_device(self.draft, name, span);
        let mut at = start;
        for line in 0..4 {
            let rest = text.get(at..).unwrap_or_default();
            let length = rest.find('\n').map_or(rest.len(), |length| length + 1);
            if line == 1 {
                let title = rest.get(..length).unwrap_or_default().trim();
                self.draft.name =
                    Name::new(title, Span::new(self.draft.file, at, at + title.len()));
            }
            at += length;
        }
        self.lexer = Lexer::starting_at(text, self.draft.file, Comments::Semicolon, false, at);
        // The list ends at the first equation: at a name followed by an equals sign, or at `IF`.
        let mut pin = 0;
        let most = self.device.map_or(64, |device| device.n_pins);
        while pin < most && self.is_pin_name() {
            pin += 1;
            let is_inverted = self.lexer.eat("/");
            let (span, token) = (self.lexer.span(), self.lexer.advance());
            self.declare(token.text, span, Some(pin), is_inverted, Role::Pin);
        }
        if let Some(device) = self.device
            && pin != device.n_pins
        {
            let message = format!(
                "{pin} pins are named, but {} has {}",
                device.with_article(),
                device.n_pins
            );
            let help = "name each pin in order, with `NC` for a pin that is not connected";
            self.draft.error_with(codes::DEVICE_LIMIT, self.lexer.span(), message, help);
        }
        self.equations();
    }

    /// True at the end, or at a section of version 1 without information about the circuit.
    fn is_old_end(&self) -> bool {
        let token = self.lexer.token;
        self.is_first_version
            && token.is_first
            && (token.is_word("description") || token.is_word("function"))
    }

    fn skip_section(&mut self) {
        self.lexer.advance();
        while self.lexer.token.kind != Kind::End
            && !(self.lexer.token.is_first
                && (self.lexer.token.is_word("equations")
                    || self.lexer.token.is_word("simulation")))
        {
            self.lexer.advance();
        }
    }

    /// Reads `CHIP name device`, followed by the pin names in the older form.
    fn chip(&mut self) {
        self.lexer.advance();
        if !self.lexer.token.is_first {
            self.draft.name =
                Name::new(self.lexer.token.text.trim_matches('\''), self.lexer.span());
            self.lexer.advance();
        }
        if self.lexer.token.is_first {
            self.draft.error_with(
                codes::SYNTAX,
                self.lexer.span_from(self.lexer.end),
                "expected the device after the chip's name",
                "write both on one line, as in `CHIP lamp PALCE22V10`",
            );
            return;
        }
        let start = self.lexer.token.start;
        while !self.lexer.token.is_first && self.lexer.token.kind != Kind::End {
            // Device names may contain hyphens: `PAL16R8-7`.
            self.lexer.advance();
            if self.lexer.token.start > self.lexer.end {
                break;
            }
        }
        let span = self.lexer.span_from(start);
        let name = self.lexer.slice(start, self.lexer.end);
        let name = name.split('-').next().unwrap_or(name);
        self.device = find_device(self.draft, name, span);
        let mut pin = 0;
        while self.is_pin_name() {
            pin += 1;
            let is_inverted = self.lexer.eat("/");
            let (span, token) = (self.lexer.span(), self.lexer.advance());
            if self.device.is_some_and(|device| device.has_global_reset && pin > device.n_pins) {
                self.globals.push(token.text.to_ascii_lowercase());
            } else {
                self.declare(token.text, span, Some(pin), is_inverted, Role::Pin);
            }
        }
        if let (Some(device), true) = (self.device, pin > 0)
            && !(device.n_pins..=device.n_pins + 1).contains(&pin)
        {
            let message = format!(
                "{pin} pins are named, but {} has {}",
                device.with_article(),
                device.n_pins
            );
            let help = "name each pin in order, with `NC` for a pin that is not connected, or write `PIN NUMBER NAME` lines";
            self.draft.error_with(codes::DEVICE_LIMIT, self.draft.name.span, message, help);
        }
    }

    fn is_pin_name(&self) -> bool {
        let token = self.lexer.token;
        let is_section = token.is_first && SECTIONS.iter().any(|word| token.is_word(word));
        !is_section && (token.kind == Kind::Word || token.kind == Kind::Number || token.is("/"))
    }

    /// Reads `PIN 2 name [REGISTERED | COMBINATORIAL | LATCHED]`, `PIN ? name` or `NODE 1 GLOBAL`.
    fn pin(&mut self) {
        let is_node = self.lexer.token.is_word("node");
        self.lexer.advance();
        let number = self.lexer.token;
        let number_span = self.lexer.span();
        let pin = match number.kind {
            Kind::Number => number.text.parse::<u32>().ok(),
            Kind::Word | Kind::Sign | Kind::Quoted | Kind::End => None,
        };
        if pin.is_none() && !number.is("?") {
            self.draft.error_with(
                codes::SYNTAX,
                number_span,
                format!("expected a pin number or `?`, found {}", number.shown()),
                "write the number before the name, as in `PIN 2 start`; `?` leaves the pin unassigned",
            );
            self.lexer.skip_line();
            return;
        }
        self.lexer.advance();
        let is_inverted = self.lexer.eat("/");
        if self.lexer.token.kind != Kind::Word || self.lexer.token.is_first {
            let message = format!("expected the pin's name, found {}", self.lexer.token.shown());
            let help = "write the name after the number, as in `PIN 2 start`";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            self.lexer.skip_line();
            return;
        }
        let (span, token) = (self.lexer.span(), self.lexer.advance());
        if !is_node {
            if let (Some(device), Some(pin)) = (self.device, pin)
                && (pin == 0 || pin > device.n_pins)
            {
                let message =
                    format!("{} has no pin {pin}: it has {}", device.with_article(), device.n_pins);
                let help = format!("write a number from 1 to {}, or `?`", device.n_pins);
                self.draft.error_with(codes::DEVICE_LIMIT, number_span, message, help);
            }
            if let Some(pin) = pin
                && let Some(other) = self.draft.with_pin(pin)
            {
                self.draft.pin_taken(pin, other, span);
            }
        }
        let role = if is_node { Role::Internal } else { Role::Pin };
        if is_node && pin == Some(1) && self.device.is_some_and(|device| device.has_global_reset) {
            // The only node of a 22V10: set and reset of all its registers.
            self.globals.push(token.text.to_ascii_lowercase());
        } else {
            self.declare(token.text, span, pin.filter(|_| !is_node), is_inverted, role);
        }
        while !self.lexer.token.is_first && self.lexer.token.kind != Kind::End {
            let token = self.lexer.token;
            let known =
                ["registered", "combinatorial", "latched", "reg", "comb", "lat", "output", "input"];
            if !known.iter().any(|word| token.is_word(word)) {
                let message =
                    format!("expected `REGISTERED` or `COMBINATORIAL`, found {}", token.shown());
                let help =
                    "write one of them, or nothing: the equations decide; a remark begins with `;`";
                self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
                self.lexer.skip_line();
                return;
            }
            self.lexer.advance();
        }
    }

    fn declare(&mut self, name: &str, span: Span, pin: Option<u32>, is_inverted: bool, role: Role) {
        if ["nc", "gnd", "vcc", "global"].iter().any(|word| name.eq_ignore_ascii_case(word)) {
            return;
        }
        let id = self.draft.declare(name, span, role);
        let signal = self.draft.at(id);
        signal.pin = pin;
        signal.is_pin_inverted = is_inverted;
    }

    /// Reads `STRING NAME 'text'`: the text replaces the name wherever it is used.
    fn string(&mut self) {
        self.lexer.advance();
        let name = self.lexer.advance();
        let span = self.lexer.span();
        let text = self.lexer.token;
        if name.kind != Kind::Word || text.kind != Kind::Quoted {
            self.draft.error_with(
                codes::SYNTAX,
                span,
                "expected a name and a text in quotes after `STRING`",
                "write it as in `STRING both 'a * b'`",
            );
            self.lexer.skip_line();
            return;
        }
        self.lexer.advance();
        // A string is an internal signal whose function is its text. This is equivalent unless the text is a sum, which causes a warning.
        let id = self.draft.declare(name.text, span, Role::Internal);
        let mut lexer = Lexer::starting_at(
            self.lexer.upto(text.start + text.text.len() - 1),
            self.draft.file,
            Comments::Semicolon,
            true,
            text.start + 1,
        );
        if let Some(read) = sum(&mut lexer, self.draft, &GRAMMAR) {
            if lexer.token.kind != Kind::End {
                let message = format!("expected an operator, found {}", lexer.token.shown());
                let help = "write `*` (and), `+` (or) or `:+:` (exclusive or) before it";
                self.draft.error_with(codes::SYNTAX, lexer.span(), message, help);
            }
            if read.terms > 1 {
                let message =
                    format!("the string `{}` is a sum; it is read as if in parentheses", name.text);
                self.draft.report(
                    Diagnostic::warning(codes::TAKEN_AS, message)
                        .at(span, "this text")
                        .help("put the text in parentheses: PALASM inserts it without them"),
                );
            }
            self.define(id, read, false, false, span);
        }
    }

    fn define(
        &mut self,
        id: SignalId,
        read: Sum,
        is_complemented: bool,
        is_registered: bool,
        span: Span,
    ) {
        let value = if is_complemented { self.draft.not(read.value) } else { read.value };
        let definition = Definition {
            value,
            sum: read.value,
            is_registered,
            is_complemented,
            init: false,
            span,
            terms: read.terms,
        };
        self.draft.define(id, definition);
    }

    fn equations(&mut self) {
        while self.lexer.token.kind != Kind::End && !self.draft.is_hopeless() {
            let token = self.lexer.token;
            if self.is_old_end() {
                return;
            }
            if token.is_first
                && (token.is_word("simulation")
                    || token.is_word("state")
                    || token.is_word("conditions"))
            {
                return;
            }
            if token.is_word("minimize_on") || token.is_word("minimize_off") {
                self.lexer.advance();
                continue;
            }
            if self.equation().is_none() {
                // Skips at least one token, then to the next line; a stray operator does not begin an equation.
                let is_operator = self.lexer.token.kind == Kind::Sign && !self.lexer.token.is("/");
                if self.lexer.token.start == token.start || is_operator {
                    self.lexer.advance();
                }
                self.lexer.skip_line();
            }
        }
    }

    fn equation(&mut self) -> Option<()> {
        let start = self.lexer.token.start;
        let condition = self.condition()?;
        let is_complemented = self.lexer.eat("/");
        let (span, name) = (self.lexer.span(), self.lexer.token);
        if name.kind != Kind::Word {
            self.draft.error_with(
                codes::SYNTAX,
                span,
                format!("expected the name of an output, found {}", name.shown()),
                "an equation is `NAME = ..`, or `NAME := ..` for a register",
            );
            return None;
        }
        if name.is_word("if") || name.is_word("case") {
            self.draft.error_with(
                codes::UNSUPPORTED,
                span,
                "`IF` and `CASE` of PALASM 4 are not supported",
                "write a sum of products: `q := c * a + /c * b` for `a` if `c` is true, else `b`",
            );
            return None;
        }
        self.lexer.advance();
        if self.lexer.eat(".") {
            return self.control(name.text, span, start);
        }
        let sign = self.lexer.token;
        let is_registered = match sign.text {
            ":=" => true,
            "=" => false,
            "*=" => {
                let message = format!(
                    "latch `{}` is not supported: the circuit must be synchronous",
                    name.text
                );
                let help = format!("write `{} :=` for a register", name.text);
                self.draft.error_with(codes::UNSUPPORTED, self.lexer.span(), message, help);
                return None;
            }
            _ => {
                self.draft.error_with(
                    codes::SYNTAX,
                    self.lexer.span(),
                    format!("expected `:=` or `=`, found {}", sign.shown()),
                    "an equation is `NAME = ..`, or `NAME := ..` for a register",
                );
                return None;
            }
        };
        self.lexer.advance();
        let read = sum(&mut self.lexer, self.draft, &GRAMMAR)?;
        self.end_of_statement()?;
        let id = self.draft.signal(name.text, span);
        let whole = self.lexer.span_from(start);
        self.draft.check_output(self.device, id, span);
        self.define(id, read, is_complemented, is_registered, whole);
        if let Some(condition) = condition {
            enable(self.draft, id, condition);
        }
        Some(())
    }

    /// `IF (condition)` of version 1 before an equation: the output is driven while the condition is true. `None` after an error.
    #[expect(clippy::option_option, reason = "an error, no condition, or one")]
    fn condition(&mut self) -> Option<Option<Definition>> {
        if !self.is_first_version || !self.lexer.token.is_word("if") {
            return Some(None);
        }
        let start = self.lexer.token.start;
        self.lexer.advance();
        if !self.lexer.eat("(") {
            let message = format!("expected `(` after `IF`, found {}", self.lexer.token.shown());
            let help = "write the condition in parentheses, as in `IF (CS) IO = A * B`";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        let read = sum(&mut self.lexer, self.draft, &GRAMMAR)?;
        if !self.lexer.eat(")") {
            let message = format!("expected `)`, found {}", self.lexer.token.shown());
            let help = "write the condition in parentheses, as in `IF (CS) IO = A * B`";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        Some(Some(Definition::new(read.value, self.lexer.span_from(start), read.terms)))
    }

    fn end_of_statement(&mut self) -> Option<()> {
        if self.lexer.token.is_first || self.lexer.token.kind == Kind::End {
            return Some(());
        }
        let message = format!(
            "expected an operator or the next equation, found {}",
            self.lexer.token.shown()
        );
        let help = "write `*` (and), `+` (or) or `:+:` (exclusive or) before it; an equation begins a new line";
        self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
        None
    }

    /// Reads `P1.TRST = VCC`, `P1.CLKF = CLK`, `GLOBAL.RSTF = RST` and so on.
    fn control(&mut self, name: &str, span: Span, start: usize) -> Option<()> {
        let (suffix_span, suffix) = (self.lexer.span(), self.lexer.advance());
        if !self.lexer.eat("=") {
            self.draft.error_with(
                codes::SYNTAX,
                self.lexer.span(),
                format!("expected `=`, found {}", self.lexer.token.shown()),
                format!("write `{name}.{} = ..`", suffix.text),
            );
            return None;
        }
        let read = sum(&mut self.lexer, self.draft, &GRAMMAR)?;
        self.end_of_statement()?;
        let whole = self.lexer.span_from(start);
        let of = if self.globals.contains(&name.to_ascii_lowercase()) {
            None
        } else {
            Some(self.draft.signal(name, span))
        };
        let definition = Definition::new(read.value, whole, read.terms);
        match (suffix.text.to_ascii_lowercase().as_str(), of) {
            ("cmbf", Some(_)) => {
                let message =
                    "`.CMBF` is not supported: a pin is either registered or combinational";
                let help = "remove the equation, and write `:=` for a registered pin or `=` for a combinational one";
                self.draft.error_with(codes::UNSUPPORTED, suffix_span, message, help);
            }
            ("trst", Some(id)) => enable(self.draft, id, definition),
            ("clkf", of) => {
                clocked(self.draft, (&mut self.clock, &mut self.clock_span), of, definition);
            }
            ("setf", of) => preset(self.draft, of, true, definition),
            ("rstf", of) => preset(self.draft, of, false, definition),
            _ => {
                let message = format!("unsupported extension `.{}`", suffix.text);
                let help =
                    "write .TRST (output enable), .CLKF (clock), .SETF (set) or .RSTF (reset)";
                self.draft.error_with(codes::UNSUPPORTED, suffix_span, message, help);
            }
        }
        Some(())
    }
}

/// Reads an output enable: one that is always on is redundant; any other is ignored in the circuit, with a warning, but kept for the fuse map.
pub(crate) fn enable(draft: &mut PldAst, id: SignalId, definition: Definition) {
    if let Some(first) = draft.enables.insert(id, definition) {
        let message = format!("`{}` has two output enables", draft.signals[id as usize].name);
        let finding = Diagnostic::error(codes::DEFINED_TWICE, message)
            .at(definition.span, "here")
            .at(first.span, "and here")
            .help("remove one of them, or write one equation with one product for both");
        draft.report(finding);
    }
    if !matches!(draft.kind(definition.value), super::ast::Expr::Const(true)) {
        let name = &draft.signals[id as usize].name;
        let message =
            format!("the output enable of `{name}` is ignored: the pin is read as always driven");
        draft.report_beyond(
            Diagnostic::warning(codes::TAKEN_AS, message).at(definition.span, "this enable").help(
                "a fuse map made from this text keeps the enable; to simulate it, assign its expression to an output of its own",
            ),
        );
    }
}

/// The signal that a clock equation names; anything else is an error.
pub(crate) fn clock_of(draft: &mut PldAst, definition: &Definition) -> Option<SignalId> {
    if let super::ast::Expr::Signal(signal) = draft.kind(definition.value) {
        draft.at(signal).n_reads -= 1;
        return Some(signal);
    }
    let message = "the clock is not a plain pin; only the rising edge of one pin is supported";
    draft.report_beyond(
        Diagnostic::error(codes::UNSUPPORTED, message)
            .at(definition.span, "")
            .help("gate the function instead of the clock"),
    );
    None
}

/// Checks that all registers have one clock.
pub(crate) fn clocked(
    draft: &mut PldAst,
    (known, known_span): (&mut Option<SignalId>, &mut Span),
    of: Option<SignalId>,
    definition: Definition,
) {
    if let Some(id) = of {
        draft.clocks.insert(id, definition);
    }
    let Some(clock) = clock_of(draft, &definition) else { return };
    let span = definition.span;
    match *known {
        None => {
            *known = Some(clock);
            *known_span = span;
        }
        Some(other) if other == clock => {}
        Some(other) => {
            let message = format!(
                "registers have different clocks: `{}` and `{}`",
                draft.signals[other as usize].name, draft.signals[clock as usize].name
            );
            draft.report_beyond(
                Diagnostic::error(codes::UNSUPPORTED, message)
                    .at(span, "here")
                    .at(*known_span, "and here")
                    .help("only circuits with one clock are supported: split the file, one circuit per clock"),
            );
        }
    }
}

/// Reads set and reset conditions; an asynchronous one is read as synchronous, with a warning.
pub(crate) fn preset(draft: &mut PldAst, of: Option<SignalId>, to: bool, definition: Definition) {
    if matches!(draft.kind(definition.value), super::ast::Expr::Const(false)) {
        return;
    }
    let what = if to { "set" } else { "reset" };
    // The preset of a 22V10 is synchronous; all others are asynchronous.
    if !(to && of.is_none()) {
        let message = format!("this asynchronous {what} is read as a synchronous one");
        draft.report_beyond(
            Diagnostic::warning(codes::TAKEN_AS, message)
                .at(definition.span, format!("in the device, this {what} acts at once"))
                .help(format!(
                    "keep it if the {what} lasts for at least one clock; a fuse map made from this text keeps it asynchronous"
                )),
        );
    }
    if let Some(first) = draft.controls.insert((of, to), definition) {
        let message = format!("two conditions for one {what}");
        draft.report(
            Diagnostic::error(codes::DEFINED_TWICE, message)
                .at(definition.span, "here")
                .at(first.span, "and here")
                .help("remove one of them, or write one equation with one product for both"),
        );
    }
}
