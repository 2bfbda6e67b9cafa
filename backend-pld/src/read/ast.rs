//! The result of a parser, before it becomes a circuit.

use super::{MAX_FINDINGS, advice};
use crate::Dialect;
use crate::codes;
use crate::device::Device;
use grafsynth_ir::diag::{Code, Diagnostic, any_error, joined, nearest};
use grafsynth_ir::logic::{FlopId, Logic, NodeId, PinInput, PinOutput, PinRole, Wire};
use grafsynth_ir::net::Meta;
use grafsynth_ir::span::{FileId, Name, Span};
use grafsynth_logic::build::Builder;
use std::collections::{BTreeMap, BTreeSet};

/// The index of a signal.
pub(crate) type SignalId = u32;
/// The index of an expression; operands come before the expressions that use them.
pub(crate) type ExprId = u32;

/// The role of a signal in the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Mentioned but not declared.
    Unknown,
    /// A pin: an output if it has a function, otherwise an input.
    Pin,
    /// An input.
    Input,
    /// An output.
    Output,
    /// A signal without a pin.
    Internal,
    /// The clock, which is not part of the circuit's functions.
    Clock,
}

/// A named signal.
#[derive(Debug, Clone)]
pub(crate) struct Signal {
    pub(crate) name: String,
    pub(crate) span: Span,
    pub(crate) role: Role,
    /// The pin number, if there is one.
    pub(crate) pin: Option<u32>,
    /// True if it is declared as the complement of its pin.
    pub(crate) is_pin_inverted: bool,
    /// The first function that reads it.
    pub(crate) read_at: Option<Span>,
    /// How many times functions read it.
    pub(crate) n_reads: u32,
    /// The expressions of the signal and of its complement, once some function uses them.
    literals: [Option<ExprId>; 2],
    pub(crate) definition: Option<Definition>,
}

/// A function.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Definition {
    /// The function of the signal itself (a complemented equation is already negated).
    pub(crate) value: ExprId,
    /// The right side as written.
    pub(crate) sum: ExprId,
    pub(crate) is_registered: bool,
    /// True if the equation gave the complement.
    pub(crate) is_complemented: bool,
    /// The power-up value, as far as the text defines it.
    pub(crate) init: bool,
    pub(crate) span: Span,
    /// The number of product terms as written.
    pub(crate) terms: u32,
}

impl Definition {
    /// A combinational function, as written.
    pub(crate) fn new(value: ExprId, span: Span, terms: u32) -> Self {
        Definition {
            value,
            sum: value,
            is_registered: false,
            is_complemented: false,
            init: false,
            span,
            terms,
        }
    }
}

/// An expression; 16 bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Expr {
    Const(bool),
    Signal(SignalId),
    Not(ExprId),
    /// The operands `start..start + count` of [`PldAst::operands`].
    And(u32, u32),
    Or(u32, u32),
    Xor(ExprId, ExprId),
    Mux(ExprId, ExprId, ExprId),
}

impl Signal {
    fn is_input(&self) -> bool {
        match self.role {
            Role::Input => true,
            Role::Pin => self.definition.is_none(),
            Role::Unknown | Role::Output | Role::Internal | Role::Clock => false,
        }
    }

    fn is_output(&self) -> bool {
        match self.role {
            Role::Output => true,
            Role::Pin => self.definition.is_some(),
            Role::Unknown | Role::Input | Role::Internal | Role::Clock => false,
        }
    }

    /// True if the signal is the complement of the level at its pin; false for a signal without a pin, which has no such level.
    pub(crate) fn is_at_pin_inverted(&self) -> bool {
        self.is_pin_inverted && self.role != Role::Internal
    }
}

/// Converts between a signal and the level at its pin.
fn at_pin(builder: &mut Builder, signal: &Signal, value: NodeId) -> NodeId {
    if signal.is_at_pin_inverted() { builder.not(value) } else { value }
}

/// The contents of a text.
#[derive(Debug)]
pub(crate) struct PldAst {
    pub(crate) file: FileId,
    pub(crate) name: Name,
    pub(crate) signals: Vec<Signal>,
    pub(crate) findings: Vec<Diagnostic>,
    by_name: BTreeMap<String, SignalId>,
    folds_case: bool,
    exprs: Vec<Expr>,
    operands: Vec<ExprId>,
    unreported: usize,
    /// Set and reset conditions of registers, which override their function: for all registers (`None`) or one. Each condition has the value for
    /// the internal flip-flop; the last one wins.
    pub(crate) controls: BTreeMap<(Option<SignalId>, bool), Definition>,
    /// Output enables.
    pub(crate) enables: BTreeMap<SignalId, Definition>,
    /// The device that the text names, if it is known.
    pub(crate) device: Option<&'static Device>,
    /// The signature that the text defines; at most eight bytes.
    pub(crate) signature: Vec<u8>,
    /// Clocks of individual registers.
    pub(crate) clocks: BTreeMap<SignalId, Definition>,
    /// Outputs that the text declares as tri-state.
    pub(crate) tristate: BTreeSet<SignalId>,
    /// Parts of this text that a single-clock circuit cannot express (errors), or expresses in a simplified form (warnings). A device may support them.
    pub(crate) beyond: Vec<Diagnostic>,
    /// The language of the text.
    dialect: Dialect,
    /// Pins that are assigned to a second signal: the pin, its first signal, and the location of the second one.
    taken: Vec<(u32, SignalId, Span)>,
}

impl PldAst {
    /// True if the text defines the name of the circuit.
    pub(crate) fn is_named(&self) -> bool {
        !self.name.text.is_empty()
    }

    pub(crate) fn new(file: FileId, dialect: Dialect) -> Self {
        let folds_case = match dialect {
            Dialect::Palasm => true,
            Dialect::Cupl | Dialect::Galasm | Dialect::Verilog | Dialect::Blif => false,
        };
        PldAst {
            file,
            name: Name::default(),
            signals: Vec::new(),
            findings: Vec::new(),
            by_name: BTreeMap::new(),
            folds_case,
            exprs: Vec::new(),
            operands: Vec::new(),
            unreported: 0,
            controls: BTreeMap::new(),
            enables: BTreeMap::new(),
            device: None,
            signature: Vec::new(),
            clocks: BTreeMap::new(),
            tristate: BTreeSet::new(),
            beyond: Vec::new(),
            dialect,
            taken: Vec::new(),
        }
    }

    /// Records a finding; if there are too many, findings are only counted.
    pub(crate) fn report(&mut self, finding: Diagnostic) {
        if self.findings.len() < MAX_FINDINGS {
            self.findings.push(finding);
        } else {
            self.unreported += 1;
        }
    }

    /// Records a part that a single-clock circuit cannot express, or expresses in a simplified form.
    pub(crate) fn report_beyond(&mut self, finding: Diagnostic) {
        if self.beyond.len() < MAX_FINDINGS {
            self.beyond.push(finding);
        } else {
            self.unreported += 1;
        }
    }

    /// Records an error at one location.
    pub(crate) fn error(&mut self, code: Code, span: Span, message: impl Into<String>) {
        self.report(Diagnostic::error(code, message).at(span, ""));
    }

    /// Records an error at one location, and a way out.
    pub(crate) fn error_with(
        &mut self,
        code: Code,
        span: Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.report(Diagnostic::error(code, message).at(span, "").help(help));
    }

    /// Warns about registers whose initial value the text does not define; `registers` are their names and locations.
    pub(crate) fn warn_of_no_first_value(&mut self, registers: &[(String, Span)]) {
        let Some((first, _)) = registers.first() else { return };
        let message = match registers.len() {
            1 => format!("register `{first}` has no initial value; 0 is used"),
            n => format!("{n} registers have no initial value (the first is `{first}`); 0 is used"),
        };
        let mut finding = Diagnostic::warning(codes::TAKEN_AS, message)
            .help(self.dialect.first_values(first, registers.len()));
        for (name, span) in registers.iter().take(6) {
            finding = finding.at(*span, format!("`{name}` has no initial value"));
        }
        self.report(finding);
    }

    /// Checks that a defined signal is on a pin of the device that can be an output.
    pub(crate) fn check_output(&mut self, device: Option<&Device>, id: SignalId, span: Span) {
        let signal = &self.signals[id as usize];
        if let (Some(device), Some(pin)) = (device, signal.pin)
            && device.macrocell(pin).is_none()
        {
            let message = format!(
                "`{}` is on pin {pin} of {}, which is not an output",
                signal.name,
                device.with_article()
            );
            let help =
                format!("assign it to an output, one of the pins {}", advice::outputs(device));
            self.error_with(codes::DEVICE_LIMIT, span, message, help);
        }
    }

    /// True if there are so many errors that continuing is useless.
    pub(crate) fn is_hopeless(&self) -> bool {
        self.unreported > 0
    }

    /// The signal with this name, created if it is new.
    pub(crate) fn signal(&mut self, name: &str, span: Span) -> SignalId {
        let key = if self.folds_case { name.to_ascii_lowercase() } else { name.to_owned() };
        let next = SignalId::try_from(self.signals.len()).unwrap_or(SignalId::MAX);
        let id = *self.by_name.entry(key).or_insert(next);
        if id == next {
            self.signals.push(Signal {
                name: name.to_owned(),
                span,
                role: Role::Unknown,
                pin: None,
                is_pin_inverted: false,
                read_at: None,
                n_reads: 0,
                literals: [None; 2],
                definition: None,
            });
        }
        id
    }

    /// The signal with this name, if there is one.
    pub(crate) fn find(&self, name: &str) -> Option<SignalId> {
        let key = if self.folds_case { name.to_ascii_lowercase() } else { name.to_owned() };
        self.by_name.get(&key).copied()
    }

    /// The signal on a pin, if there is one.
    pub(crate) fn with_pin(&self, pin: u32) -> Option<SignalId> {
        let found = self.signals.iter().position(|signal| signal.pin == Some(pin))?;
        SignalId::try_from(found).ok()
    }

    pub(crate) fn at(&mut self, id: SignalId) -> &mut Signal {
        &mut self.signals[id as usize]
    }

    /// Declares a signal; a second declaration is a finding.
    pub(crate) fn declare(&mut self, name: &str, span: Span, role: Role) -> SignalId {
        let id = self.signal(name, span);
        let signal = self.at(id);
        if signal.role == Role::Unknown {
            signal.role = role;
            signal.span = span;
        } else {
            let first = signal.span;
            self.report(
                Diagnostic::error(codes::DEFINED_TWICE, format!("`{name}` is declared twice"))
                    .at(span, "declared again here")
                    .at(first, "first declared here")
                    .help("remove one of the declarations, or use another name"),
            );
        }
        id
    }

    /// Reports a signal on a pin that is already used; the free pins are known at the end.
    pub(crate) fn pin_taken(&mut self, pin: u32, other: SignalId, span: Span) {
        self.taken.push((pin, other, span));
    }

    /// Reports pins with two signals.
    fn check_pins(&mut self) {
        for (pin, other, span) in std::mem::take(&mut self.taken) {
            let first = &self.signals[other as usize];
            let message = format!("pin {pin} is already assigned to `{}`", first.name);
            let mut finding = Diagnostic::error(codes::DEFINED_TWICE, message)
                .at(span, "assigned again here")
                .at(first.span, "first assigned here");
            let is_free = |pin: &u32| self.signals.iter().all(|signal| signal.pin != Some(*pin));
            // Free input pins are suggested for an input, free macrocells for an output.
            if let Some(device) = self.device {
                let wants_output = self
                    .signals
                    .iter()
                    .any(|signal| signal.span == span && signal.definition.is_some());
                let cells = device.macrocells.iter().map(|cell| cell.pin);
                let mut free: Vec<u32> = if wants_output {
                    cells.filter(is_free).collect()
                } else {
                    device.inputs.iter().copied().filter(is_free).collect()
                };
                free.sort_unstable();
                let shown: Vec<String> = free.iter().take(6).map(u32::to_string).collect();
                if !shown.is_empty() {
                    let shown = joined(&shown, "or");
                    let what = if wants_output { "output" } else { "input" };
                    let name = device.name;
                    finding = finding.help(format!(
                        "use another free {what} pin of the {name}, such as {shown}"
                    ));
                }
            }
            self.report(finding);
        }
    }

    /// Assigns a function to a signal; a second one is a finding.
    pub(crate) fn define(&mut self, id: SignalId, definition: Definition) {
        let signal = self.at(id);
        match signal.definition {
            None => signal.definition = Some(definition),
            Some(first) => {
                let message = format!("`{}` is assigned twice", signal.name);
                let help = self.dialect.combine(&self.signals[id as usize].name);
                self.report(
                    Diagnostic::error(codes::DEFINED_TWICE, message)
                        .at(definition.span, "assigned again here")
                        .at(first.span, "first assigned here")
                        .help(help),
                );
            }
        }
    }

    /// The next expression's number.
    pub(crate) fn next_expr(&self) -> ExprId {
        ExprId::try_from(self.exprs.len()).unwrap_or(ExprId::MAX)
    }

    pub(crate) fn expr(&mut self, expr: Expr) -> ExprId {
        let id = self.next_expr();
        self.exprs.push(expr);
        id
    }

    pub(crate) fn read(&mut self, signal: SignalId) -> ExprId {
        self.at(signal).n_reads += 1;
        if let Some(known) = self.at(signal).literals[1] {
            return known;
        }
        let made = self.expr(Expr::Signal(signal));
        self.at(signal).literals[1] = Some(made);
        made
    }

    pub(crate) fn not(&mut self, a: ExprId) -> ExprId {
        let Expr::Signal(signal) = self.kind(a) else { return self.expr(Expr::Not(a)) };
        if let Some(known) = self.at(signal).literals[0] {
            return known;
        }
        let made = self.expr(Expr::Not(a));
        self.at(signal).literals[0] = Some(made);
        made
    }

    pub(crate) fn list(&mut self, all: &[ExprId], is_and: bool) -> ExprId {
        if let [only] = all {
            return *only;
        }
        let start = u32::try_from(self.operands.len()).unwrap_or(u32::MAX);
        let count = u32::try_from(all.len()).unwrap_or(u32::MAX);
        self.operands.extend_from_slice(all);
        self.expr(if is_and { Expr::And(start, count) } else { Expr::Or(start, count) })
    }

    /// The kind of an expression.
    pub(crate) fn kind(&self, expr: ExprId) -> Expr {
        self.exprs[expr as usize]
    }

    /// The operands of a list.
    pub(crate) fn operands(&self, start: u32, count: u32) -> &[ExprId] {
        self.operands.get(start as usize..start as usize + count as usize).unwrap_or_default()
    }

    /// The circuit, if there is no error.
    pub(crate) fn finish(&mut self) -> Option<Logic> {
        self.check_pins();
        self.check_names();
        if self.unreported > 0 {
            let message = format!("{} more findings are not shown", self.unreported);
            let span = Span::new(self.file, 0, 0);
            self.findings.push(Diagnostic::error(codes::SYNTAX, message).at(span, "in this file"));
        }
        let order = self.order()?;
        if any_error(&self.findings) || any_error(&self.beyond) {
            return None;
        }
        Some(self.build(&order))
    }

    fn check_names(&mut self) {
        let (mut found, mut clocks) = (Vec::new(), Vec::new());
        for signal in &self.signals {
            let declared = || {
                self.signals
                    .iter()
                    .filter(|other| other.role != Role::Unknown)
                    .map(|other| other.name.as_str())
            };
            match (signal.role, signal.definition) {
                (Role::Unknown, _) => {
                    if found.len() >= MAX_FINDINGS {
                        self.unreported += 1;
                        continue;
                    }
                    let mut finding = Diagnostic::error(
                        codes::UNKNOWN_NAME,
                        format!("`{}` is not declared", signal.name),
                    )
                    .at(signal.span, "first used here");
                    // The search for the nearest name takes time proportional to the number of names.
                    if found.len() < 100
                        && let Some(near) = nearest(&signal.name, declared())
                    {
                        finding =
                            finding.help(format!("did you mean `{near}`?")).fix(signal.span, near);
                    } else {
                        finding = finding.help(self.dialect.declare(&signal.name));
                    }
                    found.push(finding);
                }
                (Role::Output | Role::Internal, None)
                    if signal.role == Role::Output || (signal.n_reads > 0) =>
                {
                    found.push(
                        Diagnostic::error(
                            codes::UNDEFINED,
                            if signal.role == Role::Output {
                                format!("output `{}` is never assigned", signal.name)
                            } else {
                                format!("`{}` is read and never assigned", signal.name)
                            },
                        )
                        .at(signal.span, "declared here")
                        .help(self.dialect.define(&signal.name)),
                    )
                }
                (Role::Input | Role::Clock, Some(definition)) => found.push(
                    Diagnostic::error(
                        codes::DEFINED_TWICE,
                        format!("input `{}` is assigned", signal.name),
                    )
                    .at(definition.span, "assigned here")
                    .at(signal.span, "declared here")
                    .help("declare it as an output, or assign another signal"),
                ),
                (Role::Clock, None) if (signal.n_reads > 0) => clocks.push(
                    Diagnostic::error(
                        codes::UNSUPPORTED,
                        format!("clock `{}` is also read as a signal", signal.name),
                    )
                    .at(signal.span, "this clock")
                    .help("use a separate input for the signal"),
                ),
                (Role::Pin | Role::Input | Role::Output | Role::Internal | Role::Clock, _) => {}
            }
        }
        for finding in found {
            self.report(finding);
        }
        for finding in clocks {
            self.report_beyond(finding);
        }
    }

    /// The signals that an expression reads; `seen` stores for each expression its last reader.
    fn reads(&self, value: ExprId, reader: SignalId, seen: &mut [SignalId]) -> Vec<SignalId> {
        let mut found = Vec::new();
        let mut open = vec![value];
        while let Some(next) = open.pop() {
            if std::mem::replace(&mut seen[next as usize], reader) == reader {
                continue;
            }
            match self.exprs[next as usize] {
                Expr::Const(_) => {}
                Expr::Signal(signal) => found.push(signal),
                Expr::Not(a) => open.push(a),
                Expr::And(start, count) | Expr::Or(start, count) => {
                    open.extend(self.operands(start, count))
                }
                Expr::Xor(a, b) => open.extend([a, b]),
                Expr::Mux(a, b, c) => open.extend([a, b, c]),
            }
        }
        found
    }

    /// Combinational signals sorted so that each follows its operands; `None` if there is a cycle.
    fn order(&mut self) -> Option<Vec<SignalId>> {
        #[derive(Clone, Copy, PartialEq)]
        enum State {
            New,
            Open,
            Done,
        }
        let combinational = |signal: SignalId| {
            self.signals[signal as usize]
                .definition
                .filter(|definition| !definition.is_registered)
                .map(|definition| definition.value)
        };
        let mut seen = vec![SignalId::MAX; self.exprs.len()];
        let mut state = vec![State::New; self.signals.len()];
        let mut order = Vec::new();
        let mut loops = Vec::new();
        for start in (0..SignalId::MAX).take(self.signals.len()) {
            let Some(value) = combinational(start).filter(|_| state[start as usize] == State::New)
            else {
                continue;
            };
            // The stack contains each open signal with the signals that it must still visit.
            let mut stack = vec![(start, self.reads(value, start, &mut seen))];
            state[start as usize] = State::Open;
            while let Some((signal, open)) = stack.last_mut() {
                let Some(other) = open.pop() else {
                    state[*signal as usize] = State::Done;
                    order.push(*signal);
                    stack.pop();
                    continue;
                };
                let Some(value) = combinational(other) else { continue };
                match state[other as usize] {
                    State::Done => {}
                    State::New => {
                        state[other as usize] = State::Open;
                        let reads = self.reads(value, other, &mut seen);
                        stack.push((other, reads));
                    }
                    State::Open => {
                        let members: Vec<usize> = stack
                            .iter()
                            .map(|entry| entry.0 as usize)
                            .skip_while(|member| *member != other as usize)
                            .collect();
                        loops.push(members);
                    }
                }
            }
        }
        for members in &loops {
            let names: Vec<&str> =
                members.iter().take(6).map(|&member| self.signals[member].name.as_str()).collect();
            let dots = if members.len() > 6 { ", .." } else { "" };
            let message = match names.as_slice() {
                [only] => format!("combinational loop: `{only}` depends on itself"),
                _ => format!("combinational loop through {}{dots}", names.join(", ")),
            };
            let help = self.dialect.register(names.first().copied().unwrap_or("q"));
            let mut finding = Diagnostic::error(codes::LOOP, message).help(format!(
                "write {help} for a register, which keeps its value until the next clock"
            ));
            if let [only] = names.as_slice() {
                finding = finding.plural(
                    format!("`{only}`"),
                    "combinational loops:",
                    "depend on themselves",
                );
            }
            for &member in members.iter().take(6) {
                if let Some(definition) = self.signals[member].definition {
                    finding = finding.at(definition.span, "assigned without a register");
                }
            }
            self.report_beyond(finding);
        }
        loops.is_empty().then_some(order)
    }

    /// The circuit between the pins: inputs, outputs and flip-flops are levels at pins, so a signal that is declared as the complement of its pin is
    /// inverted at the pin.
    fn build(&self, order: &[SignalId]) -> Logic {
        let mut builder = Builder::default();
        builder.logic.name = self.name.clone();
        let meta = |signal: &Signal| Meta { span: signal.span, ..Meta::default() };
        let mut values: Vec<Option<NodeId>> = vec![None; self.signals.len()];
        let mut flops: Vec<Option<FlopId>> = vec![None; self.signals.len()];
        for (index, signal) in self.signals.iter().enumerate() {
            let registered = signal.definition.filter(|definition| definition.is_registered);
            if let Some(definition) = registered {
                let init = definition.init != signal.is_at_pin_inverted();
                let (id, value) = builder.flop_named(&signal.name, init);
                builder.logic.flops[id].meta = meta(signal);
                flops[index] = Some(id);
                values[index] = Some(at_pin(&mut builder, signal, value));
            }
        }
        for (index, signal) in self.signals.iter().enumerate() {
            if signal.is_input() {
                let pin = PinInput {
                    name: signal.name.clone(),
                    role: PinRole::Unknown,
                    meta: meta(signal),
                };
                let pin = builder.logic.inputs.push(pin);
                let level = builder.input(pin);
                values[index] = Some(at_pin(&mut builder, signal, level));
            }
        }
        let mut made: Vec<Option<NodeId>> = vec![None; self.exprs.len()];
        for &id in order {
            let signal = &self.signals[id as usize];
            if let Some(definition) = signal.definition {
                let value = self.value(&mut builder, definition.value, &values, &mut made);
                values[id as usize] = Some(value);
                if signal.role == Role::Internal {
                    builder.logic.wires.push(Wire {
                        name: signal.name.clone(),
                        node: value,
                        meta: meta(signal),
                    });
                }
            }
        }
        for (index, signal) in self.signals.iter().enumerate() {
            if let (Some(definition), Some(flop)) = (signal.definition, flops[index]) {
                let mut next = self.value(&mut builder, definition.value, &values, &mut made);
                let id = SignalId::try_from(index).unwrap_or(SignalId::MAX);
                for (to, of) in [(true, None), (true, Some(id)), (false, None), (false, Some(id))] {
                    if let Some(control) = self.controls.get(&(of, to)) {
                        let condition = self.value(&mut builder, control.value, &values, &mut made);
                        // The condition acts on the flip-flop, which stores the complement if the equation defines it.
                        let value = builder.constant(to != definition.is_complemented);
                        next = builder.mux(condition, value, next);
                    }
                }
                builder.logic.flops[flop].next = at_pin(&mut builder, signal, next);
            }
        }
        for (index, signal) in self.signals.iter().enumerate() {
            if let (true, Some(value)) = (signal.is_output(), values[index]) {
                let value = at_pin(&mut builder, signal, value);
                builder.logic.outputs.push(PinOutput {
                    name: signal.name.clone(),
                    role: PinRole::Unknown,
                    value,
                    registered: None,
                    mealy: false,
                    meta: meta(signal),
                });
            }
        }
        builder.finish()
    }

    /// The node of an expression; `made` stores the nodes of all expressions.
    fn value(
        &self,
        builder: &mut Builder,
        value: ExprId,
        values: &[Option<NodeId>],
        made: &mut [Option<NodeId>],
    ) -> NodeId {
        let mut cone = BTreeSet::new();
        let mut open = vec![value];
        while let Some(next) = open.pop() {
            if made[next as usize].is_some() || !cone.insert(next) {
                continue;
            }
            match self.exprs[next as usize] {
                Expr::Const(_) | Expr::Signal(_) => {}
                Expr::Not(a) => open.push(a),
                Expr::And(start, count) | Expr::Or(start, count) => {
                    open.extend(self.operands(start, count))
                }
                Expr::Xor(a, b) => open.extend([a, b]),
                Expr::Mux(a, b, c) => open.extend([a, b, c]),
            }
        }
        // Operands have smaller indices than the expressions that use them.
        for id in cone {
            let node = |expr: ExprId| {
                made[expr as usize].unwrap_or_else(|| unreachable!("operands come first"))
            };
            let new = match self.exprs[id as usize] {
                Expr::Const(value) => builder.constant(value),
                Expr::Signal(signal) => match values[signal as usize] {
                    Some(value) => value,
                    None => builder.constant(false),
                },
                Expr::Not(a) => {
                    let a = node(a);
                    builder.not(a)
                }
                Expr::And(start, count) => {
                    let all: Vec<NodeId> =
                        self.operands(start, count).iter().map(|&operand| node(operand)).collect();
                    builder.and(all)
                }
                Expr::Or(start, count) => {
                    let all: Vec<NodeId> =
                        self.operands(start, count).iter().map(|&operand| node(operand)).collect();
                    builder.or(all)
                }
                Expr::Xor(a, b) => {
                    let (a, b) = (node(a), node(b));
                    builder.xor(a, b)
                }
                Expr::Mux(a, b, c) => {
                    let (a, b, c) = (node(a), node(b), node(c));
                    builder.mux(a, b, c)
                }
            };
            made[id as usize] = Some(new);
        }
        made[value as usize].unwrap_or_else(|| unreachable!("it was made just now"))
    }
}
