//! `GALasm` and galette: device, signature, two rows of pins, equations up to `DESCRIPTION`.

use super::advice;
use super::ast::{Definition, PldAst, Role, Signal, SignalId};
use super::equation::{Grammar, sum, supply};
use super::lexer::{Comments, Kind, Lexer};
use super::palasm::{clocked, enable, finish, preset};
use crate::codes;
use crate::device::{Clock, DEVICES, Device, PowerUp};
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::span::{Name, Span};

const GRAMMAR: Grammar = Grammar {
    not: "/",
    and: &["*", "&"],
    or: &["+", "#"],
    xor: &[],
    parens: false,
    constant: supply,
    lone_constants: true,
};

pub(crate) fn parse(text: &str, draft: &mut PldAst) {
    let mut parser = Parser {
        lexer: Lexer::new(text, draft.file, Comments::Semicolon, false),
        draft,
        device: Device::default_device(),
        clock: None,
        clock_span: Span::default(),
        controls: Vec::new(),
        clocked: Vec::new(),
    };
    if parser.head(text).is_some() {
        parser.equations();
        parser.check_reserved();
        parser.check_controls();
        parser.check_mode();
        let (device, clock) = (parser.device, parser.clock);
        finish(parser.draft, Some(device), clock);
    }
}

/// Extensions on left sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Control {
    Enable,
    Clock,
    Reset,
    Preset,
}

/// The modes of a device. All macrocells of a 16V8 or 20V8 are in one of three.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// The only mode of other devices.
    Only,
    /// Some pins are registered.
    Registered,
    /// Some pins are read back or tri-stated: one term of each pin is its enable.
    Complex,
    /// All pins are plain outputs or inputs.
    Simple,
}

/// A breach of the device's limits: where, what, and what to do.
type Problem = (Span, String, String);

/// The left side of an equation.
struct Left<'a> {
    start: usize,
    is_complemented: bool,
    name: &'a str,
    span: Span,
    extension: Option<(Span, &'a str)>,
}

struct Parser<'a, 'd> {
    lexer: Lexer<'a>,
    draft: &'d mut PldAst,
    device: &'static Device,
    clock: Option<SignalId>,
    clock_span: Span,
    /// Enables, clocks, resets and presets, which are checked after all functions are known.
    controls: Vec<(SignalId, Control, Definition)>,
    /// Registers with their own clock, on devices with individual clocks.
    clocked: Vec<SignalId>,
}

/// The line from `at` on without comment and line end, and the position of the next line.
fn line_at(text: &str, at: usize) -> (&str, usize) {
    let rest = text.get(at..).unwrap_or_default();
    let length = rest.find('\n').unwrap_or(rest.len());
    let line = rest.get(..length).unwrap_or_default();
    (line.split(';').next().unwrap_or_default().trim(), at + (length + 1).min(rest.len()))
}

impl<'a> Parser<'a, '_> {
    /// Reads device, signature and pins.
    fn head(&mut self, text: &'a str) -> Option<()> {
        // Comments may come first; an empty line is not a comment.
        let mut first = 0;
        while text
            .get(first..)
            .is_some_and(|rest| rest.trim_start_matches([' ', '\t', '\u{feff}']).starts_with(';'))
        {
            first = line_at(text, first).1;
        }
        let (line, after) = line_at(text, first);
        // Text after the device's name on its line is a remark.
        let name = line.split_whitespace().next().unwrap_or_default();
        let file = self.draft.file;
        let start = first + text.get(first..).and_then(|rest| rest.find(name)).unwrap_or(0);
        let span = Span::new(file, start, start + name.len());
        let Some(device) = DEVICES.iter().find(|device| device.name.eq_ignore_ascii_case(name))
        else {
            let mut finding = if name.is_empty() {
                Diagnostic::error(
                    codes::SYNTAX,
                    "expected the device on the first line, which is empty",
                )
                .at(span, "")
            } else {
                Diagnostic::error(
                    codes::UNKNOWN_DEVICE,
                    format!("unknown device `{}`", name.chars().take(30).collect::<String>()),
                )
                .at(span, "expected a device here")
            };
            let known: Vec<String> =
                DEVICES.iter().map(|device| device.name.to_ascii_uppercase()).collect();
            finding = finding.near(
                span,
                nearest(name, known.iter().map(String::as_str)),
                format!("known devices: {}", known.join(", ")),
            );
            self.draft.report(finding);
            return None;
        };
        self.device = device;
        let (signature, after) = line_at(text, after);
        self.draft.signature = signature.bytes().take(8).collect();
        let start = after.saturating_sub(signature.len() + 1);
        self.draft.name = Name::new(signature, Span::new(file, start, start + signature.len()));
        self.lexer = Lexer::starting_at(text, file, Comments::Semicolon, false, after);
        let half = device.n_pins / 2;
        for row in 0..2 {
            self.pin_row(row * half, half)?;
        }
        Some(())
    }

    fn pin_row(&mut self, before: u32, count: u32) -> Option<()> {
        let row = if before == 0 { "first" } else { "second" };
        let start = self.lexer.token.start;
        let mut found = 0;
        while self.lexer.token.kind != Kind::End && (found == 0 || !self.lexer.token.is_first) {
            found += 1;
            let slash = self.lexer.span();
            let is_inverted = self.lexer.eat("/");
            let (span, token) = (self.lexer.span(), self.lexer.token);
            if is_inverted && span.start != slash.end {
                self.draft.error_with(
                    codes::SYNTAX,
                    slash,
                    "expected a pin's name after `/`, found a blank",
                    "write `/` directly before the name, as in `/oe`",
                );
                continue;
            }
            if token.kind != Kind::Word {
                let message = format!("expected a pin's name, found {}", token.shown());
                let help =
                    "a name begins with a letter; write `NC` for a pin that is not connected";
                self.draft.error_with(codes::SYNTAX, span, message, help);
                self.lexer.advance();
                // Adjacent text without a blank belongs to the same invalid name.
                while !self.lexer.token.is_first
                    && self.lexer.token.start == self.lexer.end
                    && self.lexer.token.kind != Kind::End
                {
                    self.lexer.advance();
                }
                continue;
            }
            self.lexer.advance();
            self.declare(token.text, span, before + found, is_inverted);
        }
        if found == count {
            return Some(());
        }
        let span = if found == 0 {
            Span::new(self.draft.file, start, start)
        } else {
            self.lexer.span_from(start)
        };
        let message = format!(
            "the {row} row of pins has {found} names, but a {} has {count} pins on each side",
            self.device.name
        );
        let help = if found < count {
            "write `NC` for each pin that is not connected".to_owned()
        } else {
            format!("write each side of the device on its own line, with {count} names each")
        };
        self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
        None
    }

    fn declare(&mut self, name: &str, span: Span, pin: u32, is_inverted: bool) {
        let device = self.device;
        let needs = if device.grounds.contains(&pin) {
            Some("GND")
        } else if device.supplies.contains(&pin) {
            Some("VCC")
        } else {
            None
        };
        let is_supply = name == "GND" || name == "VCC";
        if needs.is_some() || is_supply {
            if needs != Some(name) || is_inverted {
                let (message, help) = match needs {
                    Some(supply) => (
                        format!("pin {pin} of a {} is `{supply}`, not `{name}`", device.name),
                        format!("write `{supply}` here; check the number of names before it"),
                    ),
                    None => {
                        let pins = if name == "GND" { device.grounds } else { device.supplies };
                        let own = advice::pin_list(pins.iter().copied());
                        (
                            format!("`{name}` is not on pin {pin} of a {}", device.name),
                            format!("`{name}` is pin {own}; check the number of names before it"),
                        )
                    }
                };
                self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
            }
            return;
        }
        if name == "NC" {
            return;
        }
        if device.has_global_reset && (name == "AR" || name == "SP") {
            let message = format!(
                "`{name}` is the {} of all registers of a {}, not a pin",
                if name == "AR" { "reset" } else { "preset" },
                device.name
            );
            let help = "give the pin another name";
            self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
            return;
        }
        let id = self.draft.declare(name, span, Role::Pin);
        let signal = self.draft.at(id);
        signal.pin = Some(pin);
        signal.is_pin_inverted = is_inverted;
    }

    fn equations(&mut self) {
        while self.lexer.token.kind != Kind::End
            && !self.lexer.token.is_word("DESCRIPTION")
            && !self.draft.is_hopeless()
        {
            let before = self.lexer.token.start;
            if self.equation().is_none() {
                // A stray operator does not begin an equation, so the rest of its line belongs to the error.
                let is_operator = self.lexer.token.kind == Kind::Sign && !self.lexer.token.is("/");
                if self.lexer.token.start == before || is_operator {
                    self.lexer.advance();
                }
                self.lexer.skip_line();
            }
        }
    }

    /// Reads `NAME.R = a * b`; `None` if the text is not an equation.
    fn equation(&mut self) -> Option<()> {
        let left = self.left()?;
        let read = sum(&mut self.lexer, self.draft, &GRAMMAR)?;
        if !self.lexer.token.is_first {
            let message = format!(
                "expected an operator or the end of the line, found {}",
                self.lexer.token.shown()
            );
            let help = "write `*` (and) or `+` (or) before it; `/` means not";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        let whole = self.lexer.span_from(left.start);
        self.assign(&left, Definition::new(read.value, whole, read.terms));
        Some(())
    }

    /// Reads the left side of an equation, and the sign after it.
    fn left(&mut self) -> Option<Left<'a>> {
        let start = self.lexer.token.start;
        let is_complemented = self.lexer.eat("/");
        let (span, name) = (self.lexer.span(), self.lexer.token);
        let form = "an equation is `NAME = ..`, or `NAME.R = ..` for a register; write `DESCRIPTION` before a text";
        if name.kind != Kind::Word {
            let message = format!("expected the name of an output, found {}", name.shown());
            self.draft.error_with(codes::SYNTAX, span, message, form);
            return None;
        }
        self.lexer.advance();
        let extension = if self.lexer.token.is(".") && !self.lexer.token.is_first {
            self.lexer.advance();
            Some((self.lexer.span(), self.lexer.advance().text))
        } else {
            None
        };
        if !self.lexer.token.is_first && self.lexer.eat("=") {
            return Some(Left { start, is_complemented, span, name: name.text, extension });
        }
        let sign = self.lexer.span();
        if self.lexer.token.is(":=") {
            let whole = Span::new(sign.file, span.end as usize, sign.end as usize);
            let finding = Diagnostic::error(codes::SYNTAX, "GALasm has no operator `:=`")
                .plural(
                    format!("`{}`", name.text),
                    "GALasm has no operator `:=`, which the equations of",
                    "contain",
                )
                .at(sign, "expected `=`")
                .help(format!("write `{}.R =` for a register", name.text))
                .fix(whole, ".R =");
            self.draft.report(finding);
        } else {
            let found = self.lexer.token.shown();
            let message = format!("expected `=` after `{}`, found {found}", name.text);
            self.draft.error_with(codes::SYNTAX, sign, message, form);
        }
        None
    }

    /// Defines what the left side names: a signal, a control of a signal, or the common reset or preset.
    fn assign(&mut self, left: &Left<'a>, mut definition: Definition) {
        let Left { name, span, extension, is_complemented, .. } = *left;
        if self.device.has_global_reset && (name == "AR" || name == "SP") {
            if let Some((span, extension)) = extension {
                let message = format!("extension `.{extension}` is not allowed on `{name}`");
                let help = format!("write `{name} = ..`");
                self.draft.error_with(codes::SYNTAX, span, message, help);
            }
            self.check_control_form(name, is_complemented, &definition);
            preset(self.draft, None, name == "SP", definition);
            return;
        }
        let control = match extension {
            None | Some((_, "R" | "T")) => None,
            Some((_, "E")) => Some(Control::Enable),
            Some((_, "CLK")) => Some(Control::Clock),
            Some((_, "ARST")) => Some(Control::Reset),
            Some((_, "APRST")) => Some(Control::Preset),
            Some((span, other)) => {
                let shown: String = other.chars().take(30).collect();
                let message = format!("unknown extension `.{shown}`");
                let help = "use .R, .T or .E, and on a gal20ra10 also .CLK, .ARST or .APRST";
                self.draft.error_with(codes::SYNTAX, span, message, help);
                return;
            }
        };
        if control.is_some() {
            self.check_control_form(name, is_complemented, &definition);
        }
        if ["NC", "VCC", "GND"].contains(&name) {
            let message = format!("`{name}` cannot be assigned");
            let help = "assign an output by the name in the list of pins";
            self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
            return;
        }
        let id = self.draft.signal(name, span);
        let pin = self.draft.at(id).pin;
        if let Some(pin) = pin.filter(|pin| self.device.macrocell(*pin).is_none()) {
            let device = self.device.name;
            let message = format!("`{name}` is on pin {pin} of a {device}, which is not an output");
            let help =
                format!("assign it to an output, one of the pins {}", advice::outputs(self.device));
            self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
        }
        if let Some(control) = control {
            let mut known = self.controls.iter();
            if let Some((_, _, first)) =
                known.find(|(other, kind, _)| *other == id && *kind == control)
            {
                let message = format!("`{name}` has this control twice");
                let finding = Diagnostic::error(codes::DEFINED_TWICE, message)
                    .at(definition.span, "here")
                    .at(first.span, "and here")
                    .help("remove one of them, or write one equation with one product for both");
                self.draft.report(finding);
            } else {
                self.controls.push((id, control, definition));
            }
            return;
        }
        definition.is_registered = matches!(extension, Some((_, "R")));
        definition.is_complemented = is_complemented;
        if is_complemented {
            definition.value = self.draft.not(definition.value);
        }
        if matches!(extension, Some((_, "T"))) {
            self.draft.tristate.insert(id);
        }
        self.draft.define(id, definition);
    }

    /// Reports names that are not signals but are read.
    fn check_reserved(&mut self) {
        for (name, what) in [
            ("NC", "stands for pins that are not connected"),
            ("AR", "is the reset of all registers"),
            ("SP", "is the preset of all registers"),
        ] {
            let Some(id) = self.draft.find(name) else { continue };
            let signal = self.draft.at(id);
            if signal.role == Role::Unknown
                && let Some(span) = signal.read_at
            {
                // Reported once, here.
                signal.role = Role::Input;
                let message = format!("`{name}` {what} and cannot be read");
                let help = match name {
                    "NC" => "replace `NC` in the list of pins by a name, and read that name",
                    _ => "read the signals of its equation instead",
                };
                self.draft.error_with(codes::UNKNOWN_NAME, span, message, help);
            }
        }
    }

    fn check_control_form(&mut self, name: &str, is_complemented: bool, definition: &Definition) {
        let what = match name {
            "AR" => "the reset `AR`".to_owned(),
            "SP" => "the preset `SP`".to_owned(),
            _ => format!("this control of `{name}`"),
        };
        if is_complemented {
            self.draft.error_with(
                codes::DEVICE_LIMIT,
                definition.span,
                format!("{what} cannot be complemented"),
                "remove the `/` on the left, and write the complement on the right",
            );
        }
        if definition.terms > 1 {
            let message =
                format!("{what} has {} product terms; the device supports one", definition.terms);
            let help = "write one product; for a sum, assign it to another output and read that output here";
            self.draft.error_with(codes::DEVICE_LIMIT, definition.span, message, help);
        }
    }

    /// Adds the controls to their functions, unless they do not belong there.
    fn check_controls(&mut self) {
        for (id, control, definition) in std::mem::take(&mut self.controls) {
            if let Some((message, help)) = self.wrong_control(id, control) {
                self.draft.error_with(codes::DEVICE_LIMIT, definition.span, message, help);
                continue;
            }
            let function = self.draft.signals[id as usize].definition;
            if let (Control::Enable, Some(function)) = (control, function)
                && !function.is_registered
                && !self.draft.tristate.contains(&id)
            {
                let name = &self.draft.signals[id as usize].name;
                let message = format!("`{name}` has an output enable, but is not tri-state");
                let finding = Diagnostic::error(codes::DEVICE_LIMIT, message)
                    .at(function.span, "")
                    .at(definition.span, "its output enable")
                    .help(format!("write its equation as `{name}.T = ..`"));
                self.draft.report(finding);
                continue;
            }
            match control {
                Control::Enable => enable(self.draft, id, definition),
                Control::Clock => {
                    self.clocked.push(id);
                    let known = (&mut self.clock, &mut self.clock_span);
                    clocked(self.draft, known, Some(id), definition);
                }
                Control::Reset => preset(self.draft, Some(id), false, definition),
                Control::Preset => preset(self.draft, Some(id), true, definition),
            }
        }
    }

    /// Why a signal cannot have a control on this device, and what to do.
    fn wrong_control(&self, id: SignalId, control: Control) -> Option<(String, String)> {
        let Device { name: device, control_pins, .. } = self.device;
        let name = &self.draft.signals[id as usize].name;
        if control != Control::Enable && self.device.clock != Clock::Term {
            let common = "; `AR` resets all registers, and `SP` presets them";
            let common = if self.device.has_global_reset { common } else { "" };
            return Some((
                format!("a {device} has no clock, reset or preset for a single register"),
                format!("remove this equation{common}"),
            ));
        }
        let Some(function) = self.draft.signals[id as usize].definition else {
            return Some((
                format!("`{name}` has a control but no equation"),
                format!("write its equation, `{name} = ..`, or remove the control"),
            ));
        };
        match control {
            Control::Enable => {
                let is_common = function.is_registered && self.device.power_up == PowerUp::PinsHigh;
                let pins = advice::pin_list(control_pins.iter().copied());
                is_common.then(|| (
                    format!("all registered pins of a {device} are enabled by one pin, not by a product term"),
                    format!("remove this equation; pin {pins} enables them while it is low"),
                ))
            }
            Control::Clock | Control::Reset | Control::Preset => {
                (!function.is_registered).then(|| {
                    (
                        format!("`{name}` is not registered, so this control has no effect"),
                        format!("write its equation as `{name}.R = ..`, or remove the control"),
                    )
                })
            }
        }
    }

    /// Checks the restrictions of the device's structure.
    fn check_mode(&mut self) {
        let mode = self.mode();
        let signals = &self.draft.signals;
        let placed = || {
            let ids = (0..SignalId::MAX).zip(signals);
            ids.filter_map(|(id, signal)| Some((id, signal, signal.pin?)))
        };
        let mut found: Vec<Problem> = Vec::new();
        for (id, signal, pin) in placed() {
            found.extend(self.without_clock(id, signal));
            found.extend(self.control_pin(signal, pin, mode));
        }
        for (_, signal, pin) in placed() {
            found.extend(self.deaf_pin(signal, pin, mode));
            found.extend(self.too_wide(signal, pin, mode));
        }
        for (span, message, help) in found {
            self.draft.error_with(codes::DEVICE_LIMIT, span, message, help);
        }
    }

    /// The mode in which the design uses the device.
    fn mode(&self) -> Mode {
        let device = self.device;
        let signals = &self.draft.signals;
        if device.power_up != PowerUp::PinsHigh {
            return Mode::Only;
        }
        if signals.iter().any(|it| it.definition.is_some_and(|it| it.is_registered)) {
            return Mode::Registered;
        }
        let middle = device.macrocells.len() / 2;
        let is_complex = (0..SignalId::MAX).zip(signals).any(|(id, signal)| {
            let Some(cell) = signal.pin.and_then(|pin| device.macrocell(pin)) else {
                return false;
            };
            let is_switched = self.draft.tristate.contains(&id);
            let is_middle =
                device.macrocells[middle - 1..=middle].iter().any(|it| it.pin == cell.pin);
            is_switched || signal.n_reads > 0 && (signal.definition.is_some() || is_middle)
        });
        if is_complex { Mode::Complex } else { Mode::Simple }
    }

    /// A register without a clock, on a device with a clock for each register.
    fn without_clock(&self, id: SignalId, signal: &Signal) -> Option<Problem> {
        let function = signal.definition.filter(|function| function.is_registered)?;
        if self.device.clock != Clock::Term || self.clocked.contains(&id) {
            return None;
        }
        let (name, device) = (&signal.name, self.device.name);
        let message = format!(
            "`{name}` is registered but has no clock: the registers of a {device} have no common one"
        );
        Some((function.span, message, format!("add `{name}.CLK = ..`")))
    }

    /// A pin that is read but controls the registers or the outputs.
    fn control_pin(&self, signal: &Signal, pin: u32, mode: Mode) -> Option<Problem> {
        let (name, device) = (&signal.name, self.device);
        let is_control = device.control_pins.contains(&pin);
        let is_clock = device.clock == Clock::Pin(pin);
        let role = if mode == Mode::Registered && (is_control || is_clock) {
            format!("of a {} with registers is the clock or enable, not an input", device.name)
        } else if is_control && !device.free_when_combinational {
            format!("of a {} controls all outputs and is not an input", device.name)
        } else {
            return None;
        };
        let is_free = |pin: &u32| self.draft.signals.iter().all(|it| it.pin != Some(*pin));
        let free = advice::pin_list(device.inputs.iter().copied().filter(is_free));
        let free = if free.is_empty() { String::new() } else { format!("; free inputs: {free}") };
        (signal.n_reads > 0).then(|| {
            (
                signal.read_at.unwrap_or(signal.span),
                format!("pin {pin} {role}: `{name}`"),
                format!("move `{name}` to another pin{free}"),
            )
        })
    }

    /// A pin that is read but has no feedback in the complex mode.
    fn deaf_pin(&self, signal: &Signal, pin: u32, mode: Mode) -> Option<Problem> {
        let (name, device) = (&signal.name, self.device);
        let is_deaf = mode == Mode::Complex && device.deaf_pins.contains(&pin);
        let deaf = advice::pin_list(device.deaf_pins.iter().copied());
        (is_deaf && signal.n_reads > 0).then(|| {
            (
                signal.read_at.unwrap_or(signal.span),
                format!(
                    "pin {pin} of a {} cannot be read back when another pin is: `{name}`",
                    device.name
                ),
                format!("move `{name}` to another pin, not {deaf}"),
            )
        })
    }

    /// A function with more product terms than its macrocell.
    fn too_wide(&self, signal: &Signal, pin: u32, mode: Mode) -> Option<Problem> {
        let (function, cell) = (signal.definition?, self.device.macrocell(pin)?);
        let (name, terms) = (&signal.name, function.terms);
        // All terms are for the function, because none is for an enable.
        let is_whole = function.is_registered || mode == Mode::Simple;
        let limit = if is_whole { cell.registered_terms } else { cell.combinational_terms };
        (terms > limit).then(|| {
            (
                function.span,
                format!(
                    "`{name}` has {terms} product terms, but the macrocell of pin {pin} has {limit}"
                ),
                more_terms(self.device, name, terms, is_whole),
            )
        })
    }
}

/// The help text for a function that has more product terms than its macrocell.
fn more_terms(device: &Device, name: &str, terms: u32, is_registered: bool) -> String {
    let large = device.macrocells.iter().filter(|cell| {
        let limit = if is_registered { cell.registered_terms } else { cell.combinational_terms };
        limit >= terms
    });
    let pins = advice::pin_list(large.map(|cell| cell.pin));
    if pins.is_empty() {
        "minimise the equation, or assign some of its terms to another output and read that output here".to_owned()
    } else {
        format!("move `{name}` to a larger macrocell; {terms} terms fit pins {pins}")
    }
}
