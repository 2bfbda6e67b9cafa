//! Text to net: the first pass collects names, the second reads declarations. An error ends its declaration; parsing continues with the next one.

use super::RESERVED;
use super::lexer::{Kind, Lexer, Token, unquote};
use crate::arena::Id;
use crate::codes;
use crate::diag::{Code, Diagnostic, nearest};
use crate::net::*;
use crate::span::{FileId, Name, Span};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// The maximum number of findings that are reported; further ones are counted.
const TOLD: usize = 100;

/// The maximum size of a text in bytes.
const SOURCE_LIMIT: usize = 64 << 20;

/// Words that begin a declaration.
pub(super) const HEADS: &[&str] = &[
    "action",
    "assert",
    "assign",
    "assume",
    "device",
    "edge",
    "emergency",
    "ending",
    "events",
    "evolution",
    "final",
    "fire",
    "force",
    "history",
    "input",
    "macro",
    "net",
    "open",
    "output",
    "part",
    "pin",
    "place",
    "policy",
    "queue",
    "schedule",
    "slot",
    "step",
    "tick",
    "timer",
    "transition",
    "var",
];

/// A finding was reported; the rest of the declaration cannot be read.
#[derive(Debug)]
pub(super) struct Fail;

/// The kind of a signal name.
#[derive(Debug, Clone, Copy)]
pub(super) enum Signal {
    Input(InputId),
    Var(VarId),
    Timer(TimerId),
}

type Map<'a, V> = BTreeMap<Cow<'a, str>, V>;

/// Names and their first owners.
#[derive(Default)]
struct Names<'a> {
    parts: Map<'a, PartId>,
    signals: Map<'a, Signal>,
    outputs: Map<'a, OutputId>,
    steps: Map<'a, StepId>,
    transitions: Map<'a, TransitionId>,
    actions: Map<'a, ActionId>,
    slots: Map<'a, SendId>,
    histories: Map<'a, HistoryId>,
    edges: BTreeMap<&'a str, EdgeId>,
}

/// Reads a net. There is a net if no error was found; [`crate::validate()`] checks whether it is valid.
#[must_use]
pub fn parse(file: FileId, source: &str) -> (Option<Net>, Vec<Diagnostic>) {
    if source.len() > SOURCE_LIMIT {
        let message = format!("the text has {} bytes; the limit is {SOURCE_LIMIT}", source.len());
        return (
            None,
            vec![Diagnostic::error(codes::NET_LIMIT, message).at(Span::new(file, 0, 0), "")],
        );
    }
    let names = collect(source);
    let mut lexer = Lexer::new(source);
    let token = lexer.next();
    let mut parser = Parser {
        file,
        source,
        lexer,
        token,
        before: Span::default(),
        names,
        net: Net::default(),
        findings: Vec::new(),
        more: 0,
    };
    parser.net();
    let Parser { net, mut findings, more, .. } = parser;
    if more > 0 {
        let message = format!("{more} more findings in this file are not shown");
        findings.push(Diagnostic::note(codes::NET_SYNTAX, message).at(Span::new(file, 0, 0), ""));
    }
    (findings.is_empty().then_some(net), findings)
}

/// The first pass: collects names, so that a declaration can refer to a later one.
fn collect(source: &str) -> Names<'_> {
    let mut names = Names::default();
    let mut lexer = Lexer::new(source);
    let mut counts = [0usize; 11];
    let mut at_start = true;
    loop {
        let token = lexer.next();
        match token.kind {
            Kind::End => return names,
            Kind::Newline => at_start = true,
            Kind::Word if at_start => {
                at_start = false;
                let head = token.text(source);
                if HEADS.binary_search(&head).is_err() {
                    continue;
                }
                let mut ahead = lexer.clone();
                let token = ahead.next();
                let name = name_text(token, source);
                declare(&mut names, &mut counts, head, name, token.text(source));
            }
            _ => at_start = false,
        }
    }
}

/// Counts a declaration and stores its name if it is the first with this name.
fn declare<'a>(
    names: &mut Names<'a>,
    counts: &mut [usize; 11],
    head: &str,
    name: Option<Cow<'a, str>>,
    text: &'a str,
) {
    fn first<'a, V>(map: &mut Map<'a, V>, name: Option<Cow<'a, str>>, value: V) {
        if let Some(name) = name {
            map.entry(name).or_insert(value);
        }
    }
    fn count<T>(count: &mut usize) -> Id<T> {
        *count += 1;
        Id::from_index(*count - 1)
    }
    match head {
        "part" => first(&mut names.parts, name, count(&mut counts[0])),
        "input" => first(&mut names.signals, name, Signal::Input(count(&mut counts[1]))),
        "var" => first(&mut names.signals, name, Signal::Var(count(&mut counts[2]))),
        "timer" => first(&mut names.signals, name, Signal::Timer(count(&mut counts[3]))),
        "output" => first(&mut names.outputs, name, count(&mut counts[4])),
        "step" => first(&mut names.steps, name, count(&mut counts[5])),
        "transition" => first(&mut names.transitions, name, count(&mut counts[6])),
        "action" => first(&mut names.actions, name, count(&mut counts[7])),
        "slot" => first(&mut names.slots, name, count(&mut counts[8])),
        "history" => first(&mut names.histories, name, count(&mut counts[9])),
        "edge" => {
            let id = count(&mut counts[10]);
            names.edges.entry(text).or_insert(id);
        }
        _ => {}
    }
}

fn name_text(token: Token, source: &str) -> Option<Cow<'_, str>> {
    match token.kind {
        Kind::Word => Some(Cow::Borrowed(token.text(source))),
        Kind::Quoted => unquote(token.text(source)),
        _ => None,
    }
}

/// The nearest name; not computed for large nets, where a hundred findings would cost more than parsing.
fn near<V>(wanted: &str, map: &Map<'_, V>) -> Option<String> {
    if map.len() > 2000 || wanted.len() > 100 {
        return None;
    }
    nearest(wanted, map.keys().map(AsRef::as_ref)).map(str::to_owned)
}

/// The parser of the second pass.
pub(super) struct Parser<'a> {
    file: FileId,
    source: &'a str,
    lexer: Lexer<'a>,
    token: Token,
    /// Location of the previous token.
    before: Span,
    names: Names<'a>,
    net: Net,
    findings: Vec<Diagnostic>,
    more: usize,
}

/// Functions that find a named object: by a reference in the text, or by a token that was read before.
macro_rules! references {
    ($($(#[$doc:meta])* $by_ref:ident $by_token:ident: $map:ident -> $id:ty, $what:literal;)*) => {
        $(
            $(#[$doc])*
            pub(super) fn $by_ref(&mut self) -> Result<$id, Fail> {
                let token = self.reference($what)?;
                self.$by_token(token)
            }

            pub(super) fn $by_token(&mut self, token: Token) -> Result<$id, Fail> {
                if token.kind == Kind::Position {
                    return Ok(self.at_position(token));
                }
                let found = name_text(token, self.source).and_then(|name| self.names.$map.get(&name).copied());
                Ok(match found {
                    Some(id) => id,
                    None => {
                        let near = near(token.text(self.source), &self.names.$map);
                        self.unknown(token, $what, near);
                        Id::from_index(0)
                    }
                })
            }
        )*
    };
}

impl<'a> Parser<'a> {
    references! {
        part_ref part_named: parts -> PartId, "partial chart";
        output_ref output_named: outputs -> OutputId, "output";
        step_ref step_named: steps -> StepId, "step";
        transition_ref transition_named: transitions -> TransitionId, "transition";
        action_ref action_named: actions -> ActionId, "action";
        slot_ref slot_named: slots -> SendId, "send slot";
        history_ref history_named: histories -> HistoryId, "history";
    }

    /// Reads the name of an input or event.
    pub(super) fn input_ref(&mut self) -> Result<InputId, Fail> {
        let token = self.reference("input or event")?;
        if token.kind == Kind::Position {
            return Ok(self.at_position(token));
        }
        match self.signal(token)? {
            Signal::Input(id) => Ok(id),
            Signal::Var(_) | Signal::Timer(_) => self.other_kind(token, "an input or event"),
        }
    }

    pub(super) fn var_ref(&mut self) -> Result<VarId, Fail> {
        let token = self.reference("variable")?;
        if token.kind == Kind::Position {
            return Ok(self.at_position(token));
        }
        match self.signal(token)? {
            Signal::Var(id) => Ok(id),
            Signal::Input(_) | Signal::Timer(_) => self.other_kind(token, "a variable"),
        }
    }

    fn other_kind<T>(&mut self, token: Token, wanted: &str) -> Result<T, Fail> {
        let message = format!("{} is not {wanted}", token.text(self.source));
        self.fail(codes::NET_NAME, token.span(self.file), message)
    }

    /// The signal with a name; an unknown name is reported, and parsing continues with some signal.
    pub(super) fn signal(&mut self, token: Token) -> Result<Signal, Fail> {
        let found =
            name_text(token, self.source).and_then(|name| self.names.signals.get(&name).copied());
        if found.is_none() {
            let what = "input, event, variable or timer";
            if token.kind == Kind::Position {
                let message = "a position alone does not select a kind of signal";
                let help = "write `input ?0`, `var ?0` or `timer ?0`";
                self.told(
                    Diagnostic::error(codes::NET_SYNTAX, message)
                        .at(token.span(self.file), "")
                        .help(help),
                );
                return Err(Fail);
            }
            let near = near(token.text(self.source), &self.names.signals);
            self.unknown(token, what, near);
        }
        Ok(found.unwrap_or(Signal::Input(Id::from_index(0))))
    }

    fn unknown(&mut self, token: Token, what: &str, near: Option<String>) {
        let text = token.text(self.source);
        let quote = if token.kind == Kind::Word { "`" } else { "" };
        let message = format!("unknown {what} {quote}{text}{quote}");
        let diagnostic = Diagnostic::error(codes::NET_NAME, message).at(token.span(self.file), "");
        let help = "write a name that an earlier line of this net declares, or declare this one in an earlier line";
        self.told(diagnostic.near(token.span(self.file), near, help));
    }

    /// A token that refers to an object.
    fn reference(&mut self, what: &str) -> Result<Token, Fail> {
        match self.token.kind {
            Kind::Word | Kind::Quoted => self.not_reserved()?,
            Kind::Position => {}
            _ => return self.unexpected(&format!("the name of a {what}")),
        }
        Ok(self.bump())
    }

    pub(super) fn edge(&mut self) -> Result<EdgeId, Fail> {
        match self.token.kind {
            Kind::Position => self.position(),
            Kind::Edge => {
                let token = self.bump();
                if let Some(id) = self.names.edges.get(token.text(self.source)) {
                    return Ok(*id);
                }
                self.unknown(token, "edge", None);
                Ok(Id::from_index(0))
            }
            _ => self.unexpected("an edge such as `%0`"),
        }
    }

    /// `?N`
    pub(super) fn position<T>(&mut self) -> Result<Id<T>, Fail> {
        if self.token.kind != Kind::Position {
            return self.unexpected("a position such as `?0`");
        }
        let token = self.bump();
        Ok(self.at_position(token))
    }

    pub(super) fn at_position<T>(&mut self, token: Token) -> Id<T> {
        Id::from_index(token.text(self.source)[1..].parse().unwrap_or(usize::MAX))
    }
}

/// Control of the parser, and findings.
impl<'a> Parser<'a> {
    pub(super) fn file(&self) -> FileId {
        self.file
    }

    pub(super) fn source(&self) -> &'a str {
        self.source
    }

    pub(super) fn token(&self) -> Token {
        self.token
    }

    pub(super) fn text(&self) -> &'a str {
        self.token.text(self.source)
    }

    pub(super) fn here(&self) -> Span {
        self.token.span(self.file)
    }

    /// The location of the previous token.
    pub(super) fn before(&self) -> Span {
        self.before
    }

    pub(super) fn bump(&mut self) -> Token {
        self.before = self.here();
        std::mem::replace(&mut self.token, self.lexer.next())
    }

    pub(super) fn peek_kind(&self) -> Kind {
        self.lexer.clone().next().kind
    }

    pub(super) fn net_mut(&mut self) -> &mut Net {
        &mut self.net
    }

    /// True if the next token is a word that begins a declaration.
    pub(super) fn at_head(&self) -> bool {
        self.token.kind == Kind::Word && HEADS.binary_search(&self.text()).is_ok()
    }

    /// True if the next token is this word or symbol.
    pub(super) fn is(&self, text: &str) -> bool {
        matches!(self.token.kind, Kind::Word | Kind::Symbol) && self.text() == text
    }

    pub(super) fn eat(&mut self, text: &str) -> bool {
        let found = self.is(text);
        if found {
            self.bump();
        }
        found
    }

    pub(super) fn expect(&mut self, text: &str) -> Result<(), Fail> {
        if self.eat(text) { Ok(()) } else { self.unexpected(&format!("`{text}`")) }
    }

    pub(super) fn fail<T>(
        &mut self,
        code: Code,
        span: Span,
        message: impl Into<String>,
    ) -> Result<T, Fail> {
        self.told(Diagnostic::error(code, message).at(span, ""));
        Err(Fail)
    }

    pub(super) fn unexpected<T>(&mut self, wanted: &str) -> Result<T, Fail> {
        let found = match self.token.kind {
            Kind::Newline => "the end of the line".to_owned(),
            Kind::End => "the end of the text".to_owned(),
            Kind::Open => "a quote that is not closed in its line".to_owned(),
            _ => format!("`{}`", self.text().chars().take(40).collect::<String>()),
        };
        self.fail(codes::NET_SYNTAX, self.here(), format!("expected {wanted}, found {found}"))
    }

    pub(super) fn told(&mut self, diagnostic: Diagnostic) {
        if self.findings.len() < TOLD {
            self.findings.push(diagnostic);
        } else {
            self.more += 1;
        }
    }

    /// Rejects a keyword where a name is expected.
    pub(super) fn not_reserved(&mut self) -> Result<(), Fail> {
        if self.token.kind != Kind::Word || RESERVED.binary_search(&self.text()).is_err() {
            return Ok(());
        }
        let word = self.text();
        let help = "write a name that is also a keyword in backquotes";
        let message = format!("`{word}` is a keyword, not a name");
        self.told(Diagnostic::error(codes::NET_SYNTAX, message).at(self.here(), "").help(help));
        Err(Fail)
    }

    /// `( [x {, x}] )`
    pub(super) fn list<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, Fail>,
    ) -> Result<Vec<T>, Fail> {
        self.expect("(")?;
        let mut all = Vec::new();
        if self.eat(")") {
            return Ok(all);
        }
        loop {
            all.push(item(self)?);
            if self.eat(")") {
                return Ok(all);
            }
            self.expect(",")?;
        }
    }

    /// Reads a number with its sign.
    pub(super) fn integer(&mut self) -> Result<i64, Fail> {
        let start = self.here();
        let is_negative = self.eat("-");
        if self.token.kind != Kind::Number {
            return self.unexpected("a number");
        }
        let digits = self.bump();
        let span = start.to(self.before);
        let magnitude: Option<i128> = digits.text(self.source).parse().ok();
        let value = magnitude.map(|value| if is_negative { -value } else { value });
        match value.and_then(|value| i64::try_from(value).ok()) {
            Some(value) => Ok(value),
            None => {
                self.told(
                    Diagnostic::error(codes::NET_NUMBER, "the number does not fit in 64 bits")
                        .at(span, ""),
                );
                Ok(0)
            }
        }
    }

    /// The unit of time at the next token in nanoseconds, if there is one.
    fn unit(&self) -> Option<u64> {
        if self.token.kind != Kind::Word {
            return None;
        }
        match self.text() {
            "us" | "µs" | "μs" => Some(1_000),
            "ms" => Some(1_000_000),
            "s" => Some(1_000_000_000),
            "min" => Some(60_000_000_000),
            "h" => Some(3_600_000_000_000),
            _ => None,
        }
    }

    /// `100000000 ns`; another unit is reported with its value in nanoseconds, and parsing continues.
    pub(super) fn nanoseconds(&mut self) -> Result<u64, Fail> {
        let start = self.here();
        let value: u64 = self.number()?;
        let Some(unit) = self.unit() else {
            self.expect("ns")?;
            return Ok(value);
        };
        let written = format!("{value} {}", self.text());
        self.bump();
        let span = start.to(self.before);
        let finding = Diagnostic::error(
            codes::NET_SYNTAX,
            format!("durations in a net are in nanoseconds, found `{written}`"),
        )
        .at(span, "expected `ns`");
        Ok(match value.checked_mul(unit) {
            Some(ns) => {
                self.told(finding.help(format!("write `{ns} ns`")).fix(span, format!("{ns} ns")));
                ns
            }
            None => {
                self.told(finding);
                value
            }
        })
    }

    /// Reports a unit of time after a number of ticks in a condition, where units are not allowed.
    pub(super) fn no_unit(&mut self, ticks: i64, start: Span) {
        let Some(unit) = self.unit() else { return };
        let written = format!("{ticks} {}", self.text());
        self.bump();
        let span = start.to(self.before);
        let finding = Diagnostic::error(
            codes::NET_SYNTAX,
            format!("a condition in a net compares times in ticks, found `{written}`"),
        )
        .at(span, "expected a number of ticks");
        let tick = self.net.settings.tick_ns.max(1);
        let n_ticks = u64::try_from(ticks).ok().and_then(|value| value.checked_mul(unit));
        self.told(match n_ticks.map(|ns| ns.div_ceil(tick)) {
            Some(n) => {
                finding.help(format!("write `{n}`: a tick is {tick} ns")).fix(span, n.to_string())
            }
            None => finding,
        });
    }

    /// A number without sign; a number that is too large is reported, and parsing continues with 0.
    pub(super) fn number<T: TryFrom<u64> + Default>(&mut self) -> Result<T, Fail> {
        if self.token.kind != Kind::Number {
            return self.unexpected("a number");
        }
        let token = self.bump();
        let value: Option<u64> = token.text(self.source).parse().ok();
        match value.and_then(|value| T::try_from(value).ok()) {
            Some(value) => Ok(value),
            None => {
                let bits = 8 * size_of::<T>();
                let message = format!("the number does not fit in {bits} bits");
                self.told(
                    Diagnostic::error(codes::NET_NUMBER, message).at(token.span(self.file), ""),
                );
                Ok(T::default())
            }
        }
    }

    pub(super) fn string(&mut self, what: &str) -> Result<String, Fail> {
        if self.token.kind != Kind::Str {
            return self.unexpected(what);
        }
        let token = self.bump();
        match unquote(token.text(self.source)) {
            Some(text) => Ok(text.into_owned()),
            None => self.fail(
                codes::NET_SYNTAX,
                token.span(self.file),
                "the text contains an unknown escape",
            ),
        }
    }

    /// Reads the name of the declared object.
    pub(super) fn name(&mut self) -> Result<Name, Fail> {
        match self.token.kind {
            Kind::Word => self.not_reserved()?,
            Kind::Quoted => {}
            _ => return self.unexpected("a name"),
        }
        let token = self.bump();
        match name_text(token, self.source) {
            Some(text) => Ok(Name::new(text, token.span(self.file))),
            None => self.fail(
                codes::NET_SYNTAX,
                token.span(self.file),
                "the name contains an unknown escape",
            ),
        }
    }

    /// `NAME META`; the keyword has already been read.
    pub(super) fn head(&mut self) -> Result<(Name, Meta), Fail> {
        let start = self.before;
        let name = self.name()?;
        let meta = self.meta(start)?;
        Ok((name, meta))
    }

    pub(super) fn meta(&mut self, start: Span) -> Result<Meta, Fail> {
        let mut meta = Meta { span: start.to(self.before), ..Meta::default() };
        if self.token.kind == Kind::Str {
            meta.label = self.string("a comment")?;
        }
        while self.eat("req") {
            let tag = self.string("a requirement tag in double quotes")?;
            meta.req.push(tag);
        }
        Ok(meta)
    }
}
