//! Verilog: one module of one-bit signals with one rising-edge clock.
//!
//! Ports in the header or in separate declarations, `wire`, `reg` with initial values, `assign`, `initial`, `always @(posedge clk)` with
//! non-blocking assignments and `if`.

use super::MAX_NESTING;
use super::ast::{Definition, Expr, ExprId, PldAst, Role, Signal, SignalId};
use super::lexer::{Comments, Kind, Lexer};
use crate::codes;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

pub(crate) fn parse(text: &str, draft: &mut PldAst) {
    let lexer = Lexer::new(text, draft.file, Comments::Verilog, false);
    let mut parser = Parser {
        lexer,
        draft,
        depth: 0,
        inits: BTreeMap::new(),
        clock_at: None,
        awaited_reset: None,
    };
    parser.file();
    let clock = parser.clock_at;
    let inits = std::mem::take(&mut parser.inits);
    if let Some((clock, span)) = clock {
        let signal = draft.at(clock);
        match signal.role {
            // The clock is declared after the block.
            Role::Input => signal.role = Role::Clock,
            Role::Clock | Role::Unknown => {}
            Role::Pin | Role::Output | Role::Internal => {
                let name = &signal.name;
                let message = format!("clock `{name}` is not an input");
                let error = Diagnostic::error(codes::UNSUPPORTED, message)
                    .at(span, "this clock")
                    .at(signal.span, "declared here")
                    .help(format!("use an input as the clock, and `{name}` as a condition: `always @(posedge CLOCK) if ({name}) ..`"));
                draft.report(error);
            }
        }
    }
    let is_unset = |(id, signal): &(usize, &Signal)| {
        signal.definition.is_some_and(|definition| definition.is_registered)
            && SignalId::try_from(*id).is_ok_and(|id| !inits.contains_key(&id))
    };
    let unset: Vec<(String, Span)> = draft
        .signals
        .iter()
        .enumerate()
        .filter(is_unset)
        .map(|(_, signal)| (signal.name.clone(), signal.span))
        .collect();
    draft.warn_of_no_first_value(&unset);
    for (id, (init, span)) in inits {
        let signal = draft.at(id);
        match &mut signal.definition {
            Some(definition) if definition.is_registered => definition.init = init,
            Some(_) | None => {
                let message =
                    format!("`{}` has an initial value but is not a register", signal.name);
                let help = "remove the value, or assign the signal in a clocked block";
                draft.error_with(codes::UNSUPPORTED, span, message, help);
            }
        }
    }
}

/// The help text for a design of several modules, with vectors or with other features of Verilog.
const FLATTEN: &str = "flatten the design first, in yosys: `synth -auto-top -flatten; opt_clean -purge; write_blif FILE.blif`, and read that file";

/// The assignments of a clocked block: the value and its location.
type Assigned = BTreeMap<SignalId, (ExprId, Span)>;

/// A statement and its context. Of two assignments to a signal the later one applies, so a branch of an `if` without an assignment to a signal keeps
/// the value assigned before the `if`, at any depth.
#[derive(Default)]
struct Scope<'s> {
    assigned: Assigned,
    around: Option<&'s Scope<'s>>,
}

impl Scope<'_> {
    /// The scope of a branch of an `if` in this scope.
    fn inside(&self) -> Scope<'_> {
        Scope { assigned: Assigned::new(), around: Some(self) }
    }

    /// The value assigned to a signal so far.
    fn value(&self, id: SignalId) -> Option<ExprId> {
        let here = self.assigned.get(&id).map(|entry| entry.0);
        here.or_else(|| self.around.and_then(|around| around.value(id)))
    }
}

struct Parser<'a, 'd> {
    lexer: Lexer<'a>,
    draft: &'d mut PldAst,
    depth: u32,
    inits: BTreeMap<SignalId, (bool, Span)>,
    /// The clock, and where it is first named.
    clock_at: Option<(SignalId, Span)>,
    /// The asynchronous reset of a clocked block, until its `if` is read.
    awaited_reset: Option<(SignalId, Span)>,
}

impl<'a> Parser<'a, '_> {
    fn file(&mut self) {
        while self.lexer.token.is("`") {
            // A directive such as `timescale occupies its line.
            self.lexer.rest_of_line();
        }
        if self.module_head().is_none() {
            self.recover();
        }
        while self.lexer.token.kind != Kind::End && !self.draft.is_hopeless() {
            if self.lexer.eat_word("endmodule") {
                if self.lexer.token.is_word("module") {
                    let message = "a second module is not supported: a circuit is one flat module";
                    let span = self.lexer.span();
                    self.draft.error_with(codes::UNSUPPORTED, span, message, FLATTEN);
                } else if self.lexer.token.kind != Kind::End {
                    let message = format!(
                        "expected the end of the text after `endmodule`, found {}",
                        self.lexer.token.shown()
                    );
                    let help = "remove it, or move `endmodule` after it";
                    self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
                }
                return;
            }
            let before = self.lexer.token.start;
            self.depth = 0;
            if self.item().is_none() {
                if self.lexer.token.start == before {
                    self.lexer.advance();
                }
                self.recover();
            }
        }
        let _: Option<()> = self.unexpected("`endmodule`");
    }

    /// After an error: skips past the next `;` or to a word that begins an item.
    fn recover(&mut self) {
        let starts = ["assign", "wire", "reg", "always", "initial", "endmodule"];
        while self.lexer.token.kind != Kind::End
            && !starts.iter().any(|word| self.lexer.token.is_word(word))
        {
            if self.lexer.eat(";") {
                return;
            }
            self.lexer.advance();
        }
    }

    fn unexpected<T>(&mut self, wanted: &str) -> Option<T> {
        let message = format!("expected {wanted}, found {}", self.lexer.token.shown());
        let help = match self.lexer.token.kind {
            Kind::End => format!("the text ends too early: write {wanted}"),
            Kind::Sign => {
                format!(
                    "write {wanted} before it; the supported operators are `~ ! & | ^ && || ?:`"
                )
            }
            Kind::Word | Kind::Number | Kind::Quoted => {
                format!("write {wanted} before it, and check the end of the statement before it")
            }
        };
        self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
        None
    }

    fn expect(&mut self, sign: &str) -> Option<()> {
        if self.lexer.eat(sign) { Some(()) } else { self.unexpected(&format!("`{sign}`")) }
    }

    fn name(&mut self) -> Option<(&'a str, Span)> {
        if self.lexer.token.kind != Kind::Word {
            return self.unexpected("a name");
        }
        let span = self.lexer.span();
        Some((self.lexer.advance().text, span))
    }

    /// Reports a range or index in brackets, and skips it; true if there is one.
    ///
    /// The signal is read as a single bit, so that it causes no further findings.
    fn no_vector(&mut self) -> bool {
        if !self.lexer.token.is("[") {
            return false;
        }
        self.draft.error_with(
            codes::UNSUPPORTED,
            self.lexer.span(),
            "vectors are not supported",
            format!("declare each bit, as in `input a1, input a0`, or {FLATTEN}"),
        );
        while !matches!(self.lexer.token.kind, Kind::End) && !self.lexer.eat("]") {
            self.lexer.advance();
        }
        true
    }

    fn module_head(&mut self) -> Option<()> {
        if !self.lexer.eat_word("module") {
            return self.unexpected("`module`");
        }
        let (name, span) = self.name()?;
        self.draft.name = Name::new(name, span);
        if self.lexer.eat("(") && !self.lexer.eat(")") {
            let mut role = Role::Unknown;
            loop {
                if self.lexer.eat_word("input") {
                    role = Role::Input;
                    let _ = self.lexer.eat_word("wire");
                } else if self.lexer.eat_word("output") {
                    role = Role::Output;
                    let _ = self.lexer.eat_word("wire") || self.lexer.eat_word("reg");
                }
                self.no_vector();
                let (name, span) = self.name()?;
                // The old style lists only names here and declares them below.
                if role == Role::Unknown {
                    self.draft.signal(name, span);
                } else {
                    self.draft.declare(name, span, role);
                }
                if self.lexer.eat(")") {
                    break;
                }
                self.expect(",")?;
            }
        }
        self.expect(";")
    }

    fn item(&mut self) -> Option<()> {
        let token = self.lexer.token;
        if token.is(";") {
            self.lexer.advance();
            return Some(());
        }
        for (word, role) in [
            ("input", Role::Input),
            ("output", Role::Output),
            ("wire", Role::Internal),
            ("reg", Role::Internal),
        ] {
            if self.lexer.eat_word(word) {
                if role == Role::Output || role == Role::Input {
                    let _ = self.lexer.eat_word("wire") || self.lexer.eat_word("reg");
                }
                return self.declaration(role, word == "wire");
            }
        }
        if self.lexer.eat_word("assign") {
            loop {
                self.assignment()?;
                if !self.lexer.eat(",") {
                    return self.expect(";");
                }
            }
        }
        if self.lexer.eat_word("initial") {
            return self.initial();
        }
        if self.lexer.eat_word("always") {
            return self.always();
        }
        let message = format!(
            "{} is not supported: expected `wire`, `reg`, `assign`, `initial` or one clocked `always`",
            token.shown()
        );
        self.draft.error_with(codes::UNSUPPORTED, self.lexer.span(), message, FLATTEN);
        None
    }

    /// Reads `wire a = .., b;` and similar; `output reg a;` after a bare port name.
    fn declaration(&mut self, role: Role, is_wire: bool) -> Option<()> {
        self.no_vector();
        loop {
            let (name, span) = self.name()?;
            // A port may be declared again as wire or reg.
            let known = self.draft.find(name).filter(|&id| {
                role == Role::Internal
                    && matches!(self.draft.signals[id as usize].role, Role::Output | Role::Input)
            });
            let id = match known {
                Some(id) => id,
                None => self.draft.declare(name, span, role),
            };
            if self.lexer.eat("=") {
                let start = span.start as usize;
                let value = if is_wire { self.expression()? } else { self.first_value()? };
                let span = self.lexer.span_from(start);
                if is_wire {
                    self.define(id, value, false, span);
                } else {
                    self.note_init(id, value, span);
                }
            }
            if !self.lexer.eat(",") {
                return self.expect(";");
            }
        }
    }

    fn define(&mut self, id: SignalId, value: ExprId, is_registered: bool, span: Span) {
        let definition = Definition { is_registered, ..Definition::new(value, span, 0) };
        self.draft.define(id, definition);
    }

    /// The initial value of a register: `0` and `1` without a width mean one bit here.
    fn first_value(&mut self) -> Option<ExprId> {
        let bit = match self.lexer.token.text {
            "0" => false,
            "1" => true,
            _ => return self.expression(),
        };
        let before = self.lexer.clone();
        self.lexer.advance();
        if self.lexer.token.is(",") || self.lexer.token.is(";") {
            return Some(self.draft.expr(Expr::Const(bit)));
        }
        self.lexer = before;
        self.expression()
    }

    fn note_init(&mut self, id: SignalId, value: ExprId, span: Span) {
        let Expr::Const(init) = self.draft.kind(value) else {
            self.draft.error_with(
                codes::UNSUPPORTED,
                span,
                "the initial value of a register must be constant",
                "write 1'b0 or 1'b1",
            );
            return;
        };
        if self.inits.insert(id, (init, span)).is_some() {
            let message =
                format!("`{}` has two initial values", self.draft.signals[id as usize].name);
            self.draft.error_with(codes::DEFINED_TWICE, span, message, "remove one of them");
        }
    }

    fn assignment(&mut self) -> Option<()> {
        let (name, span) = self.name()?;
        let is_bit = self.no_vector();
        let id = self.draft.signal(name, span);
        self.expect("=")?;
        let value = self.expression()?;
        let span = self.lexer.span_from(span.start as usize);
        // Several bits of a vector are not a second definition of one signal.
        if !is_bit || self.draft.signals[id as usize].definition.is_none() {
            self.define(id, value, false, span);
        }
        Some(())
    }

    fn initial(&mut self) -> Option<()> {
        let is_block = self.lexer.eat_word("begin");
        loop {
            if is_block && self.lexer.eat_word("end") {
                return Some(());
            }
            let (name, span) = self.name()?;
            let id = self.draft.signal(name, span);
            self.expect("=")?;
            let value = self.first_value()?;
            let span = self.lexer.span_from(span.start as usize);
            self.note_init(id, value, span);
            self.expect(";")?;
            if !is_block {
                return Some(());
            }
        }
    }

    fn always(&mut self) -> Option<()> {
        self.expect("@")?;
        self.expect("(")?;
        if !self.lexer.eat_word("posedge") {
            let message = format!(
                "expected `posedge`, found {}: only blocks with one rising clock edge are supported",
                self.lexer.token.shown()
            );
            let help = "write a register as `always @(posedge clk) q <= ..;`, and logic without one as `assign y = ..;`";
            self.draft.error_with(codes::UNSUPPORTED, self.lexer.span(), message, help);
            return None;
        }
        let (name, span) = self.name()?;
        let clock = self.draft.signal(name, span);
        if let Some((_, first)) = self.clock_at.filter(|(known, _)| *known != clock) {
            let message =
                format!("second clock `{name}`: only circuits with one clock are supported");
            let finding = Diagnostic::error(codes::UNSUPPORTED, message)
                .at(span, "")
                .at(first, "the first clock")
                .help("write the registers of each clock to a module in a file of its own");
            self.draft.report(finding);
        }
        self.clock_at.get_or_insert((clock, span));
        let signal = self.draft.at(clock);
        if signal.role == Role::Input {
            signal.role = Role::Clock;
        }
        if self.lexer.eat_word("or") || self.lexer.eat(",") {
            self.asynchronous_reset()?;
        }
        self.expect(")")?;
        let mut block = Scope::default();
        self.statement(&mut block)?;
        if let Some((reset, span)) = self.awaited_reset.take() {
            let name = &self.draft.at(reset).name;
            let message =
                format!("the block is sensitive to `{name}` but does not begin with `if ({name})`");
            let help = format!("remove `{name}` here, or begin the block with `if ({name})`");
            self.draft.error_with(codes::UNSUPPORTED, span, message, help);
        }
        for (id, (value, span)) in block.assigned {
            self.define(id, value, true, span);
        }
        Some(())
    }

    /// Reads `posedge RESET` in addition to the clock: the block must begin with `if (RESET)`.
    fn asynchronous_reset(&mut self) -> Option<()> {
        if !self.lexer.eat_word("posedge") {
            let message = format!(
                "expected `posedge`, found {}: only active-high resets are supported",
                self.lexer.token.shown()
            );
            let help =
                "remove the reset here, and test it in the block: the reset is then synchronous";
            self.draft.error_with(codes::UNSUPPORTED, self.lexer.span(), message, help);
            return None;
        }
        let (name, span) = self.name()?;
        let message = format!("asynchronous reset `{name}` is read as a synchronous one");
        self.draft.report(
            Diagnostic::warning(codes::TAKEN_AS, message)
                .at(span, "the Verilog acts at once, this circuit acts at the next clock")
                .help(format!(
                    "write `always @(posedge clk)` without `{name}` if the reset lasts for a clock"
                )),
        );
        self.awaited_reset = Some((self.draft.signal(name, span), span));
        Some(())
    }

    /// Reads a statement of the clocked block.
    fn statement(&mut self, scope: &mut Scope<'_>) -> Option<()> {
        self.enter()?;
        if self.lexer.eat_word("begin") {
            while !self.lexer.eat_word("end") {
                if self.lexer.token.kind == Kind::End {
                    return self.unexpected("`end`");
                }
                self.statement(scope)?;
            }
        } else if self.lexer.eat_word("if") {
            let start = self.lexer.token.start;
            self.expect("(")?;
            let condition = self.expression()?;
            self.expect(")")?;
            if let Some((reset, _)) = self.awaited_reset
                && self.draft.read(reset) == condition
            {
                self.awaited_reset = None;
            }
            let (mut then, mut otherwise) = (scope.inside(), scope.inside());
            self.statement(&mut then)?;
            if self.lexer.eat_word("else") {
                self.statement(&mut otherwise)?;
            }
            let span = self.lexer.span_from(start);
            let sides = then.assigned.keys().chain(otherwise.assigned.keys()).copied();
            let ids: BTreeSet<SignalId> = sides.gather();
            let mut both = Assigned::new();
            for id in ids {
                let [a, b] = [&then, &otherwise]
                    .map(|side| side.value(id).unwrap_or_else(|| self.draft.read(id)));
                both.insert(id, (self.draft.expr(Expr::Mux(condition, a, b)), span));
            }
            scope.assigned.extend(both);
        } else if !self.lexer.eat(";") {
            let (name, span) = self.name()?;
            self.no_vector();
            let id = self.draft.signal(name, span);
            if self.lexer.token.is("=") {
                let sign = self.lexer.span();
                let finding = Diagnostic::error(
                    codes::UNSUPPORTED,
                    format!("`{name}` is assigned with `=` in a clocked block: the statements after it read its new value in the same clock"),
                )
                .plural(
                    format!("`{name}`"),
                    "",
                    "are assigned with `=` in a clocked block: the statements after them read their new values in the same clock",
                )
                .at(sign, "expected `<=`")
                .help("write `<=`, which assigns all registers together at the clock edge")
                .fix(sign, "<=");
                self.draft.report(finding);
                self.lexer.advance();
            } else if !self.lexer.eat("<=") {
                return self.unexpected("`<=`");
            }
            let value = self.expression()?;
            let span = self.lexer.span_from(span.start as usize);
            self.expect(";")?;
            scope.assigned.insert(id, (value, span));
        }
        self.depth -= 1;
        Some(())
    }

    fn enter(&mut self) -> Option<()> {
        if self.depth >= MAX_NESTING {
            let message = format!("more than {MAX_NESTING} levels of nesting");
            let help = "give a part of the expression a `wire` of its own";
            self.draft.error_with(codes::SYNTAX, self.lexer.span(), message, help);
            return None;
        }
        self.depth += 1;
        Some(())
    }

    /// `a ? b : c`, right-associative without recursion: conditions and middle operands are kept in a list.
    fn expression(&mut self) -> Option<ExprId> {
        let mut waiting = Vec::new();
        let mut value = self.logical_or()?;
        while self.lexer.eat("?") {
            let then = self.nested()?;
            self.expect(":")?;
            waiting.push((value, then));
            value = self.logical_or()?;
        }
        for (condition, then) in waiting.into_iter().rev() {
            value = self.draft.expr(Expr::Mux(condition, then, value));
        }
        Some(value)
    }

    fn nested(&mut self) -> Option<ExprId> {
        self.enter()?;
        let value = self.expression()?;
        self.depth -= 1;
        Some(value)
    }

    // From the lowest precedence: `||`, `&&`, `|`, `^`, `&`, as in table 5-4 of IEEE 1364-2005.

    fn logical_or(&mut self) -> Option<ExprId> {
        let mut all = vec![self.logical_and()?];
        while self.lexer.eat("||") {
            all.push(self.logical_and()?);
        }
        Some(self.draft.list(&all, false))
    }

    fn logical_and(&mut self) -> Option<ExprId> {
        let mut all = vec![self.or()?];
        while self.lexer.eat("&&") {
            all.push(self.or()?);
        }
        Some(self.draft.list(&all, true))
    }

    fn or(&mut self) -> Option<ExprId> {
        let mut all = vec![self.xor()?];
        while self.lexer.eat("|") {
            all.push(self.xor()?);
        }
        Some(self.draft.list(&all, false))
    }

    fn xor(&mut self) -> Option<ExprId> {
        let mut value = self.and()?;
        loop {
            let is_equal = self.lexer.token.is("~^") || self.lexer.token.is("^~");
            if !is_equal && !self.lexer.token.is("^") {
                return Some(value);
            }
            self.lexer.advance();
            let other = self.and()?;
            value = self.draft.expr(Expr::Xor(value, other));
            if is_equal {
                value = self.draft.not(value);
            }
        }
    }

    fn and(&mut self) -> Option<ExprId> {
        let mut all = vec![self.unary()?];
        while self.lexer.eat("&") {
            all.push(self.unary()?);
        }
        Some(self.draft.list(&all, true))
    }

    fn unary(&mut self) -> Option<ExprId> {
        let mut is_negated = false;
        while self.lexer.token.is("~") || self.lexer.token.is("!") {
            self.lexer.advance();
            is_negated = !is_negated;
        }
        let token = self.lexer.token;
        let value = match token.kind {
            Kind::Word => {
                let span = self.lexer.span();
                self.lexer.advance();
                self.no_vector();
                let signal = self.draft.signal(token.text, span);
                self.draft.read(signal)
            }
            Kind::Number => self.constant()?,
            Kind::Sign if token.is("(") => {
                self.lexer.advance();
                let value = self.nested()?;
                self.expect(")")?;
                value
            }
            Kind::Sign | Kind::Quoted | Kind::End => return self.unexpected("a signal"),
        };
        Some(if is_negated { self.draft.not(value) } else { value })
    }

    /// Reads `1'b0` or `1'b1` (in any base).
    fn constant(&mut self) -> Option<ExprId> {
        let span = self.lexer.span();
        let width = self.lexer.advance().text;
        let mut value = None;
        if width == "1" && self.lexer.eat("'") {
            value = match self.lexer.advance().text.to_ascii_lowercase().as_str() {
                "b0" | "h0" | "d0" | "o0" => Some(false),
                "b1" | "h1" | "d1" | "o1" => Some(true),
                _ => None,
            };
        }
        match value {
            Some(value) => Some(self.draft.expr(Expr::Const(value))),
            None => {
                let finding = Diagnostic::error(codes::UNSUPPORTED, "a constant must be one bit")
                    .at(span, "")
                    .help("write 1'b0 or 1'b1");
                self.draft.report(finding);
                None
            }
        }
    }
}
