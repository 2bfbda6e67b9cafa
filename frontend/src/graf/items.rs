//! Parser of the items of a chart, except settings, steps, transitions and instances: declarations, actions, macros, properties, places,
//! boards.

use grafsynth_ir::chart::{
    Action, Block, Board, Declaration, DeclarationKind, Emergency, Expr, Item, Macro, MacroStep,
    Place, Property, StepRole,
};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::parser::{Parse, Parser, Separators, short};
use super::token::Kind;
use crate::codes;

/// The words that begin an item of a chart, for suggestions in messages.
pub(crate) const ITEM_WORDS: &[&str] = &[
    "tick",
    "conflict",
    "evolution",
    "schedule",
    "fire",
    "assign",
    "actions",
    "final",
    "queue",
    "events",
    "priority",
    "shared",
    "input",
    "output",
    "registered",
    "mealy",
    "synchronous",
    "var",
    "const",
    "event",
    "internal",
    "timer",
    "extern",
    "initial",
    "step",
    "entry",
    "exit",
    "macro",
    "enclosing",
    "state",
    "parallel",
    "region",
    "history",
    "use",
    "in",
    "assert",
    "assume",
    "emergency",
    "action",
    "place",
    "device",
];

/// The replacement for an integer type without a range.
const STAND_IN: Type = Type::Int { lo: i16::MIN as i64, hi: i16::MAX as i64 };

impl Parser<'_> {
    /// Parses one item of a chart or macro; a declaration list gives several items.
    pub(crate) fn item(&mut self, items: &mut Vec<Item>) -> Parse<()> {
        let start = self.peek(0).start;
        let named = self.is_name(0);
        if self.kind(0) == Kind::Arrow
            || self.kind(0) == Kind::Number
                && (matches!(self.kind(1), Kind::Arrow | Kind::Ampersand | Kind::Colon)
                    || self.kind(1) == Kind::Word
                        && self.peek(1).start == self.peek(0).end
                        && matches!(self.kind(2), Kind::Arrow | Kind::Ampersand | Kind::Colon))
            || named
                && matches!(self.kind(1), Kind::Arrow | Kind::Ampersand | Kind::Dot)
                && !(self.word(0) == "initial" && self.kind(1) == Kind::Arrow)
            || named && self.kind(1) == Kind::Colon
            || self.word(0) == "in" && self.is_name_beside(1)
        {
            return self.transition_item(items);
        }
        // Nested items have separate functions: a single large stack frame would overflow the stack on deep nesting.
        match self.word(0) {
            // A step named `initial` needs backquotes before an arrow.
            "initial" if self.kind(1) == Kind::Arrow => self.outside_of_states(),
            "region" | "history" if self.is_name_beside(1) => self.outside_of_states(),
            "step" | "initial" | "entry" | "exit" => self.step_or_macro_step(items),
            "enclosing" if self.word(1) == "step" => {
                self.advance();
                self.enclosing(items, start, StepRole::Plain)
            }
            "state" | "parallel" => self.state(items, start, StepRole::Plain),
            "macro" => self.macro_or_macro_step(items, start),
            "input" | "output" | "registered" | "mealy" | "synchronous" | "var" | "const"
            | "event" | "internal" | "timer" | "extern" => self.declarations(items),
            _ => self.other_item(items, start),
        }
    }

    fn transition_item(&mut self, items: &mut Vec<Item>) -> Parse<()> {
        let transition = self.transition()?;
        self.keep(items, Item::Transition(transition));
        Ok(())
    }

    fn macro_or_macro_step(&mut self, items: &mut Vec<Item>, start: u32) -> Parse<()> {
        // `macro step req "R1" { … }` declares a macro named `step` with a tag.
        if self.word(1) == "step"
            && self.is_name(2)
            && !matches!(self.kind(3), Kind::Text | Kind::RawText)
        {
            self.advance();
            let step = self.macro_step(start, StepRole::Plain)?;
            self.keep(items, Item::MacroStep(step));
            return Ok(());
        }
        let body = self.macro_body(start)?;
        self.keep(items, Item::Macro(body));
        Ok(())
    }

    /// Parses an item that contains no other items.
    fn other_item(&mut self, items: &mut Vec<Item>, start: u32) -> Parse<()> {
        let item = match self.word(0) {
            "use" => Item::Use(self.instance()?),
            "final" if self.word(1) == "state" => {
                self.advance();
                Item::Step(self.final_state(start)?)
            }
            "assume" | "assert" => Item::Property(self.property()?),
            "emergency" => Item::Emergency(self.emergency()?),
            "action" => Item::Action(self.controlled_action(start)?),
            "place" => Item::Place(self.place()?),
            "device" => Item::Board(self.board()?),
            "tick" | "conflict" | "evolution" | "schedule" | "fire" | "assign" | "actions"
            | "final" | "queue" | "events" | "priority" | "shared" => {
                Item::Setting(self.setting()?)
            }
            "chart" if self.is_name(1) => {
                return Err(self.misplaced(
                    "a chart is not allowed inside another chart",
                    "move it out of the braces of the other chart",
                ));
            }
            _ => return Err(self.no_item()),
        };
        self.keep(items, item);
        Ok(())
    }

    fn no_item(&mut self) -> ErrorReported {
        let token = self.peek(0);
        if !self.is_name(0) {
            return self.unexpected("an item of the chart");
        }
        let word = super::numbers::name_of(self.text, token);
        let shown = short(word);
        let span = self.span(token);
        let near = nearest(word, ITEM_WORDS.iter().copied().chain(["chart", "library"]));
        self.report(|| {
            let finding = Diagnostic::error(
                codes::UNKNOWN_WORD,
                format!("unknown item `{shown}` of a chart"),
            );
            finding.unknown_word(
                span,
                near,
                "a transition is written `p1 -> p2 when m`, a step `step p1 { R }`",
            )
        });
        ErrorReported
    }

    pub(crate) fn misplaced(&mut self, message: &str, help: &str) -> ErrorReported {
        let span = self.here();
        self.report(|| {
            Diagnostic::error(codes::MISPLACED, message).at(span, "not allowed here").help(help)
        });
        ErrorReported
    }

    /// Parses `"label"` and `req "R12"`, in any order and number (at most one label).
    pub(crate) fn attributes(&mut self, meta: &mut Meta) -> Parse<()> {
        while self.attribute(meta)? {}
        Ok(())
    }

    /// Parses one attribute; false if there is none.
    pub(crate) fn attribute(&mut self, meta: &mut Meta) -> Parse<bool> {
        if matches!(self.kind(0), Kind::Text | Kind::RawText) {
            let token = self.peek(0);
            let label = self.text("a label")?;
            if meta.label.is_empty() {
                meta.label = label;
            } else {
                let span = self.span(token);
                self.report(|| {
                    Diagnostic::error(codes::TWICE, "a second label")
                        .at(span, "the item already has a label")
                        .help("remove one of them, or write both in one text")
                });
            }
            return Ok(true);
        }
        if self.word(0) == "req" && matches!(self.kind(1), Kind::Text | Kind::RawText) {
            self.advance();
            let tag = self.text("a tag in quotes")?;
            self.keep(&mut meta.req, tag);
            return Ok(true);
        }
        Ok(false)
    }

    // Controlled actions

    /// Parses `action count { … }`; the braces are optional.
    fn controlled_action(&mut self, start: u32) -> Parse<Action> {
        self.advance();
        let name = self.name("the name of the action")?;
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        let body =
            if self.kind(0) == Kind::OpenBrace { self.block("the action")? } else { Block::new() };
        meta.span = self.span_from(start);
        Ok(Action { name, body, meta })
    }

    // Macros

    /// Parses `macro fill { … }`.
    fn macro_body(&mut self, start: u32) -> Parse<Macro> {
        self.advance();
        let name = self.name("the name of the macro")?;
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        let mut items = Vec::new();
        self.braced("the macro", Separators::None, &mut |parser| parser.item(&mut items))?;
        meta.span = self.span_from(start);
        Ok(Macro { name, items, meta })
    }

    /// Parses `macro step m1 = fill`, at `step`.
    pub(crate) fn macro_step(&mut self, start: u32, role: StepRole) -> Parse<MacroStep> {
        self.advance();
        let name = self.name("the name of the macro-step")?;
        self.expect(Kind::Equal, "`=` and the name of its macro")?;
        let body = self.name("the name of a macro")?;
        let mut meta = Meta::default();
        let mut priority = None;
        loop {
            if self.attribute(&mut meta)? {
            } else if self.word(0) == "priority"
                && self.kind(1) == Kind::Number
                && !self.peek(0).new_line
            {
                let span = self.here();
                self.advance();
                let value = self.count("a priority")?;
                self.once(&mut priority, value, span, "priority");
            } else {
                break;
            }
        }
        meta.span = self.span_from(start);
        Ok(MacroStep { name, body, role, priority, meta })
    }

    /// Stores a clause that is allowed only once; reports a second one.
    pub(crate) fn once<T>(&mut self, slot: &mut Option<T>, value: T, span: Span, what: &str) {
        if slot.is_some() {
            self.report(|| {
                Diagnostic::error(codes::TWICE, format!("`{what}` is given twice"))
                    .at(span, "second occurrence")
                    .help("remove one of them")
            });
        } else {
            *slot = Some(value);
        }
    }

    // Declarations

    fn declarations(&mut self, items: &mut Vec<Item>) -> Parse<()> {
        let mut start = self.peek(0).start;
        // Modifiers are allowed before or after the keyword: `mealy output Q`, `output mealy Q`.
        let mut modifiers = Modifiers::default();
        while modifiers.add(self.word(0)) {
            self.advance();
        }
        let keyword = self.word(0);
        if !modifiers.fit(keyword) {
            return Err(self.unexpected(
                "`output` after `registered` or `mealy`, `input` after `synchronous`, `event` after `internal`",
            ));
        }
        self.advance();
        while self.is_name_beside(1) && !matches!(self.word(0), "condition" | "action") {
            let mut more = modifiers;
            if !more.add(self.word(0)) || !more.fit(keyword) {
                break;
            }
            modifiers = more;
            self.advance();
        }
        let is_condition = match keyword {
            "extern" => {
                self.choice("kind of extern function", &[("condition", true), ("action", false)])?
            }
            _ => false,
        };
        loop {
            let name = self.name("a name")?;
            let mut meta = Meta::default();
            self.attributes(&mut meta)?;
            // If the declaration cannot be parsed, a replacement of the same kind prevents findings at the uses of its name.
            let is_number = self.kind(0) == Kind::Colon && self.word(1) == "int"
                || self.numbers.is_some_and(|numbers| numbers.contains(&name.text));
            let list = DeclarationList { keyword, modifiers, is_condition };
            let kind = match self.declared(list) {
                Ok(kind) => kind,
                Err(ErrorReported) => {
                    meta.span = name.span;
                    let kind = list.stand_in(is_number);
                    self.keep(items, Item::Declaration(Declaration { name, kind, meta }));
                    return Err(ErrorReported);
                }
            };
            self.attributes(&mut meta)?;
            meta.span = self.span_from(start);
            self.keep(items, Item::Declaration(Declaration { name, kind, meta }));
            if !self.eat(Kind::Comma) && !self.comma_missing(keyword) {
                return Ok(());
            }
            start = self.peek(0).start;
        }
    }

    /// Reports `output raise lower`: a name next to a declared name that does not begin an item. Returns whether there was one.
    fn comma_missing(&mut self, keyword: &str) -> bool {
        let next = self.peek(0);
        if !self.is_name_beside(0)
            || self.begins_outer_item()
            || matches!(self.kind(1), Kind::Arrow | Kind::Ampersand | Kind::Dot)
            || self.kind(1) == Kind::Colon
                && matches!(self.kind(3), Kind::Arrow | Kind::Ampersand | Kind::Dot)
            || ITEM_WORDS.contains(&self.word(0))
        {
            return false;
        }
        let shown = short(super::numbers::name_of(self.text, next));
        let place = super::parser::span_of(self.file, self.previous_end, self.previous_end);
        self.report(|| {
            Diagnostic::error(
                codes::UNEXPECTED,
                format!("expected `,` between the names after `{keyword}`, found `{shown}`"),
            )
            .at(place, "expected `,`")
            .help("write a comma between all names")
            .fix(place, ",")
        });
        true
    }

    /// Parses the rest of a declaration, after the name.
    fn declared(&mut self, list: DeclarationList<'_>) -> Parse<DeclarationKind> {
        let Modifiers { registered, mealy, synchronous, internal } = list.modifiers;
        Ok(match list.keyword {
            "input" => DeclarationKind::Input { ty: self.optional_type()?, synchronous },
            "output" => {
                let ty = self.optional_type()?;
                let init = if self.initial_sign() { Some(self.expr()?) } else { None };
                DeclarationKind::Output { ty, init, registered, mealy, safe: self.safe_value()? }
            }
            "var" => self.variable()?,
            "const" => {
                self.expect(Kind::Equal, "`=` and its value")?;
                DeclarationKind::Const { value: self.expr()? }
            }
            "event" => DeclarationKind::Event { internal },
            "timer" => {
                self.expect_word("while")?;
                DeclarationKind::Timer { condition: self.expr()? }
            }
            _ if list.is_condition => {
                if self.eat(Kind::Open) {
                    self.expect(Kind::Close, "`)`: conditions have no arguments")?;
                }
                DeclarationKind::ExternCondition { ty: self.optional_type()? }
            }
            _ => DeclarationKind::ExternAction { params: self.parameters()? },
        })
    }

    /// Parses `safe on` or `safe 3` on the line of its output. `on` and `off` mean `true` and `false` here.
    fn safe_value(&mut self) -> Parse<Option<Expr>> {
        let is_transition =
            matches!(self.kind(1), Kind::Colon | Kind::Arrow | Kind::Ampersand | Kind::Dot);
        if self.word(0) != "safe" || self.peek(0).new_line || is_transition {
            return Ok(None);
        }
        self.advance();
        let span = self.here();
        let value = match self.word(0) {
            "on" => true,
            "off" => false,
            _ => return self.expr().map(Some),
        };
        self.advance();
        Ok(Some(Expr::new(ExprKind::Bool(value), span)))
    }

    pub(crate) fn optional_type(&mut self) -> Parse<Type> {
        if self.eat(Kind::Colon) { self.value_type() } else { Ok(Type::Bool) }
    }

    /// Consumes the `=` before an initial value; reports `:=` instead of it.
    fn initial_sign(&mut self) -> bool {
        if self.kind(0) == Kind::Assign {
            let span = self.here();
            self.report(|| {
                Diagnostic::error(codes::UNEXPECTED, "expected `=`, found `:=`")
                    .at(span, "an initial value follows `=`")
                    .fix(span, "=")
            });
            self.advance();
            return true;
        }
        self.eat(Kind::Equal)
    }

    /// Parses `bool` or `int 0..9`.
    fn value_type(&mut self) -> Parse<Type> {
        if self.eat_word("bool") {
            return Ok(Type::Bool);
        }
        let written = self.word(0);
        if written != "int" && written.eq_ignore_ascii_case("bool") {
            let span = self.here();
            self.advance();
            self.report(|| {
                Diagnostic::error(codes::UNEXPECTED, format!("unknown type `{written}`"))
                    .at(span, "types are lower case")
                    .help("write `bool`, or omit the type")
                    .fix(span, "bool")
            });
            return Ok(Type::Bool);
        }
        if super::numbers::is_foreign_integer(written) {
            let span = self.here();
            self.advance();
            self.report(|| {
                Diagnostic::error(codes::UNEXPECTED, format!("unknown type `{written}`"))
                    .at(span, "an integer type needs its range")
                    .help("write the smallest and the largest value, as in `int 0..9`")
            });
            return Ok(STAND_IN);
        }
        if written != "int" {
            return Err(self.unexpected("a type: `bool` or `int 0..9`"));
        }
        let start = self.advance().start;
        if !matches!(self.kind(0), Kind::Number | Kind::Minus) {
            let span = self.span_from(start);
            self.report(|| {
                Diagnostic::error(codes::RANGE, "an integer type needs its range")
                    .at(span, "no bounds")
                    .help("write the smallest and the largest value: `int 0..9`")
            });
            return Err(ErrorReported);
        }
        let bounds_start = self.peek(0).start;
        let lo = self.bound()?;
        self.expect(Kind::Range, "`..` and the largest value")?;
        let hi = self.bound()?;
        let span = self.span_from(bounds_start);
        if lo > hi {
            self.report(|| {
                Diagnostic::error(codes::RANGE, format!("the range {lo}..{hi} is empty"))
                    .at(span, "the smaller bound must come first")
                    .help(format!("write {hi}..{lo}"))
                    .fix(span, format!("{hi}..{lo}"))
            });
            return Ok(Type::Int { lo: hi, hi: lo });
        }
        Ok(Type::Int { lo, hi })
    }

    fn bound(&mut self) -> Parse<i64> {
        let is_negative = self.eat(Kind::Minus);
        let token = self.expect(Kind::Number, "a whole number as a bound")?;
        let value = self.number_at(token).and_then(|value| i64::try_from(value).ok());
        let value = value.unwrap_or_else(|| {
            let span = self.span(token);
            self.report(|| {
                Diagnostic::error(codes::NUMBER, "number beyond 64 bits")
                    .at(span, "too large")
                    .help("write a number from -2147483648 to 2147483647")
            });
            0
        });
        Ok(if is_negative { -value } else { value })
    }

    /// Parses `: int 0..9[4] = 0` or `: bool[2] = [true, false]`.
    fn variable(&mut self) -> Parse<DeclarationKind> {
        let ty = self.optional_type()?;
        let mut len = None;
        if self.eat(Kind::OpenBracket) {
            let span = self.here();
            let n = self.count("the number of elements")?;
            if n == 0 {
                self.report(|| {
                    Diagnostic::error(codes::NUMBER, "an array needs at least one element")
                        .at(span, "none")
                        .help("write the number of elements, 1 or more")
                });
            }
            len = Some(n.max(1));
            self.expect(Kind::CloseBracket, "`]`")?;
        }
        let mut init = Vec::new();
        if self.initial_sign() {
            if self.eat(Kind::OpenBracket) {
                loop {
                    let value: Expr = self.expr()?;
                    self.keep(&mut init, value);
                    if !self.eat(Kind::Comma) {
                        break;
                    }
                }
                self.expect(Kind::CloseBracket, "`,` or `]`")?;
            } else {
                init.push(self.expr()?);
            }
        }
        Ok(DeclarationKind::Var { ty, len, init })
    }

    /// Parses `(int 0..9, on: bool)`.
    fn parameters(&mut self) -> Parse<Vec<(String, Type)>> {
        let mut params = Vec::new();
        if !self.eat(Kind::Open) {
            return Ok(params);
        }
        while self.kind(0) != Kind::Close {
            let name = if self.is_name(0) && self.kind(1) == Kind::Colon {
                let name = self.name("the name of a parameter")?;
                self.advance();
                name.text
            } else {
                String::new()
            };
            let ty = self.value_type()?;
            self.keep(&mut params, (name, ty));
            if !self.eat(Kind::Comma) {
                break;
            }
        }
        self.expect(Kind::Close, "`,` or `)`")?;
        Ok(params)
    }

    // Properties, places, boards

    /// Parses `assume never (a and b)` or `assert safe: always x "label" req "R1"`.
    pub(crate) fn property(&mut self) -> Parse<Property> {
        let start = self.peek(0).start;
        let is_assumption = self.word(0) == "assume";
        self.advance();
        self.property_from(start, is_assumption)
    }

    /// Parses a property after its `assume` or `assert`.
    pub(crate) fn property_from(&mut self, start: u32, is_assumption: bool) -> Parse<Property> {
        let name = if self.is_name(0) && self.kind(1) == Kind::Colon {
            let name = self.name("the name of the property")?;
            self.advance();
            Some(name)
        } else {
            None
        };
        let is_never = match self.word(0) {
            "never" => true,
            "always" => false,
            _ => return Err(self.unexpected("`never` or `always`")),
        };
        self.advance();
        let expr = self.expr()?;
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        meta.span = self.span_from(start);
        Ok(Property { name, is_assumption, is_never, expr, meta })
    }

    /// Parses `emergency stop or not guard "label" req "R1"`.
    fn emergency(&mut self) -> Parse<Emergency> {
        let start = self.advance().start;
        let condition = self.expr()?;
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        meta.span = self.span_from(start);
        Ok(Emergency { condition, meta })
    }

    /// Parses `place p2, m1.s3 on chip`.
    pub(crate) fn place(&mut self) -> Parse<Place> {
        let start = self.advance().start;
        let mut items = Vec::new();
        loop {
            let item = self.path("the name of a step or variable")?;
            self.keep(&mut items, item);
            if !self.eat(Kind::Comma) {
                break;
            }
        }
        self.expect_word("on")?;
        let part = self.name("the name of a part")?;
        Ok(Place { items, part, span: self.span_from(start) })
    }

    /// Parses `device gal22v10 { clock 1  m 2  n[0] 3 }`.
    pub(crate) fn board(&mut self) -> Parse<Board> {
        let start = self.advance().start;
        let device = self.device()?;
        let mut pins = Vec::new();
        if self.kind(0) == Kind::OpenBrace {
            self.braced("the pins", Separators::None, &mut |parser| {
                if parser.eat(Kind::Comma) {
                    return Ok(());
                }
                let name = parser.signal()?;
                let pin = parser.count("the number of a pin")?;
                parser.keep(&mut pins, (name, pin));
                Ok(())
            })?;
        }
        Ok(Board { device, pins, span: self.span_from(start) })
    }

    /// Parses the name of a device, which may contain `-` between words and numbers: `atf1504-plcc44`.
    fn device(&mut self) -> Parse<Name> {
        let is_quoted = self.kind(0) == Kind::Quoted;
        let mut name = self.name("the name of a device")?;
        let is_part = |kind: Kind| matches!(kind, Kind::Word | Kind::Number);
        let adjoins = |parser: &Self, at: usize, end: u32| parser.peek(at).start == end;
        // A part such as `15lp` is a number and a word.
        while !is_quoted
            && adjoins(self, 0, self.previous_end)
            && (is_part(self.kind(0)) || self.kind(0) == Kind::Minus)
            && (is_part(self.kind(0))
                || is_part(self.kind(1)) && adjoins(self, 1, self.peek(0).end))
        {
            self.advance();
        }
        name.span = self.span_from(name.span.start);
        if !is_quoted && !self.dry {
            name.text = self.text[name.span.range()].to_owned();
        }
        Ok(name)
    }

    /// Parses a signal of a board: a name with dots and an optional number of a bit or element.
    fn signal(&mut self) -> Parse<Name> {
        let path = self.path("the name of a signal")?;
        let mut name = Name { text: path.to_string(), span: path.span() };
        if self.eat(Kind::OpenBracket) {
            let index = self.count("the number of a bit or element")?;
            self.expect(Kind::CloseBracket, "`]`")?;
            name.text.push_str(&format!("[{index}]"));
            name.span = self.span_from(name.span.start);
        }
        Ok(name)
    }
}

/// The modifiers of a declaration.
#[derive(Debug, Clone, Copy, Default)]
struct Modifiers {
    registered: bool,
    mealy: bool,
    synchronous: bool,
    internal: bool,
}

impl Modifiers {
    /// Adds the modifier with this name; false if it is not a modifier.
    fn add(&mut self, word: &str) -> bool {
        let modifier = match word {
            "registered" => &mut self.registered,
            "mealy" => &mut self.mealy,
            "synchronous" => &mut self.synchronous,
            "internal" => &mut self.internal,
            _ => return false,
        };
        *modifier = true;
        true
    }

    /// Whether all modifiers are allowed with this keyword.
    fn fit(self, keyword: &str) -> bool {
        let is = |word: &str| keyword == word;
        (is("output") || !(self.registered || self.mealy))
            && (is("input") || !self.synchronous)
            && (is("event") || !self.internal)
    }
}

/// The common part of all declarations after one keyword.
#[derive(Debug, Clone, Copy)]
struct DeclarationList<'k> {
    keyword: &'k str,
    modifiers: Modifiers,
    /// For `extern`: whether it is a condition, not an action.
    is_condition: bool,
}

impl DeclarationList<'_> {
    /// The simplest declaration of this kind: a replacement for one that cannot be parsed.
    fn stand_in(self, is_number: bool) -> DeclarationKind {
        let Modifiers { registered, mealy, synchronous, internal } = self.modifiers;
        let ty = if is_number { Type::Int { lo: 1, hi: 1 } } else { Type::Bool };
        let value = if is_number { Expr::int(1) } else { Expr::bool(true) };
        match self.keyword {
            "input" => DeclarationKind::Input { ty, synchronous },
            "output" => DeclarationKind::Output { ty, init: None, registered, mealy, safe: None },
            "var" => DeclarationKind::Var { ty, len: None, init: Vec::new() },
            "const" => DeclarationKind::Const { value },
            "event" => DeclarationKind::Event { internal },
            "timer" => DeclarationKind::Timer { condition: Expr::bool(false) },
            _ if self.is_condition => DeclarationKind::ExternCondition { ty },
            _ => DeclarationKind::ExternAction { params: Vec::new() },
        }
    }
}
