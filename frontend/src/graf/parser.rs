//! The part of the parser that knows no grammar: tokens ahead, findings, limits, names, numbers, and how to go on after an error.
#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a parser names the tokens it takes; all others are one case"
)]

use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{FileId, Name, Span};

use super::lexer::{LexError, Lexer, is_typeset_quote};
use super::numbers::{Numbers, name_of, slice};
use super::token::{Kind, Token};
use super::{Comment, Limits};
use crate::codes;

/// The finding was reported; the caller goes on at the next place where it can.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Abandoned;

/// What a grammar rule gives.
pub(crate) type Parse<T> = Result<T, Abandoned>;

/// Words that are never names; everything else is a word of the language only where its neighbours say so.
pub(crate) const RESERVED: &[&str] =
    &["and", "or", "not", "mod", "true", "false", "otherwise", "if"];

/// At most so many tokens are looked at before one is taken.
const AHEAD: usize = 4;

/// Findings up to a limit, and the number of the rest.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub(crate) kept: Vec<Diagnostic>,
    pub(crate) limit: usize,
    pub(crate) rest: usize,
}

impl Findings {
    /// Keeps a finding, or counts it. It is only made if it is kept: a broken file of 60 MB may have millions.
    pub(crate) fn report(&mut self, make: impl FnOnce() -> Diagnostic) {
        if self.kept.len() < self.limit {
            self.kept.push(make());
        } else {
            self.rest += 1;
        }
    }

    /// All findings, and a last one that counts those not shown.
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        if self.rest > 0 {
            let (rest, limit) = (self.rest, self.limit);
            let noun = if rest == 1 { "finding is" } else { "findings are" };
            let mut last = Diagnostic::note(codes::MORE, format!("{rest} more {noun} not shown"))
                .help(format!("correct the first {limit}; the others may follow from them"));
            if let Some(label) = self.kept.last().and_then(|finding| finding.labels.first()) {
                last = last.at(label.span, "the last one shown");
            }
            self.kept.push(last);
        }
        self.kept
    }
}

/// Reads one source.
pub(crate) struct Parser<'a> {
    pub(crate) text: &'a str,
    pub(super) file: FileId,
    lexer: Lexer<'a>,
    pub(super) window: [Token; AHEAD],
    /// One past the last byte of the token taken last.
    pub(crate) previous_end: u32,
    /// None when the names of the source are declared elsewhere and not known here.
    pub(crate) numbers: Option<&'a Numbers<'a>>,
    pub(crate) findings: Findings,
    pub(crate) comments: Vec<Comment>,
    pub(crate) limits: Limits,
    pub(crate) depth: u32,
    end_reported: bool,
    /// Names that begin with a digit and were reported.
    numbered: std::collections::BTreeSet<String>,
    /// Whether the text has a word that may begin a duration of IEC 61131-3, by word.
    pub(super) has_words: std::collections::BTreeMap<String, bool>,
    /// Where a chart begins inside another: whether a brace is missing before it.
    is_brace_missing: Option<bool>,
    is_chart_reported: bool,
    /// Arrows of transitions without targets, of which a chart that is no statechart warns.
    pub(crate) bare_arrows: Vec<Span>,
    /// Check only: nothing is kept, so a large source with an error costs no tree.
    pub(crate) dry: bool,
}

impl<'a> Parser<'a> {
    pub(crate) fn new(
        file: FileId,
        text: &'a str,
        numbers: Option<&'a Numbers<'a>>,
        limits: Limits,
        dry: bool,
    ) -> Self {
        Self::reading(file, text, Lexer::new(text), numbers, limits, dry)
    }

    /// A parser for the part of `text` that begins at byte `start`; places are those in the whole text.
    pub(crate) fn starting_at(
        file: FileId,
        text: &'a str,
        start: u32,
        numbers: Option<&'a Numbers<'a>>,
        limits: Limits,
    ) -> Self {
        let lexer = Lexer::starting_at(text, start as usize);
        let mut parser = Self::reading(file, text, lexer, numbers, limits, false);
        parser.previous_end = start;
        parser
    }

    fn reading(
        file: FileId,
        text: &'a str,
        lexer: Lexer<'a>,
        numbers: Option<&'a Numbers<'a>>,
        limits: Limits,
        dry: bool,
    ) -> Self {
        let none = Token { kind: Kind::End, new_line: true, start: 0, end: 0 };
        let mut parser = Parser {
            text,
            file,
            lexer,
            window: [none; AHEAD],
            previous_end: 0,
            numbers,
            findings: Findings { limit: limits.diagnostics, ..Findings::default() },
            comments: Vec::new(),
            limits,
            depth: 0,
            end_reported: false,
            numbered: std::collections::BTreeSet::new(),
            has_words: std::collections::BTreeMap::new(),
            is_brace_missing: None,
            is_chart_reported: false,
            bare_arrows: Vec::new(),
            dry,
        };
        for _ in 0..AHEAD {
            parser.advance();
        }
        parser.previous_end = 0;
        parser
    }

    // Tokens

    /// Takes the next token.
    pub(crate) fn advance(&mut self) -> Token {
        let token = self.window[0];
        self.window.rotate_left(1);
        let Parser { lexer, comments, findings, file, text, dry, .. } = self;
        self.window[AHEAD - 1] = lexer.next(
            &mut |start, end| {
                if !*dry {
                    comments.push(Comment { span: span_of(*file, start, end) });
                }
            },
            &mut |error| findings.report(|| lex_finding(text, *file, error)),
        );
        if token.kind != Kind::End {
            self.previous_end = token.end;
        }
        token
    }

    /// The token `ahead` of the next one (0 to 3).
    pub(crate) fn peek(&self, ahead: usize) -> Token {
        self.window[ahead]
    }

    /// The kind of the token `ahead` of the next one.
    pub(crate) fn kind(&self, ahead: usize) -> Kind {
        self.window[ahead].kind
    }

    /// The text of the next token if it is a word (not a quoted name), else nothing.
    pub(crate) fn word(&self, ahead: usize) -> &'a str {
        let token = self.window[ahead];
        if token.kind == Kind::Word { slice(self.text, token) } else { "" }
    }

    /// True when the token ahead is a word or a quoted name.
    pub(crate) fn is_name(&self, ahead: usize) -> bool {
        matches!(self.window[ahead].kind, Kind::Word | Kind::Quoted)
    }

    /// True when a name stands ahead on the same line as the token before it.
    pub(crate) fn is_name_beside(&self, ahead: usize) -> bool {
        self.is_name(ahead) && !self.window[ahead].new_line
    }

    pub(crate) fn span(&self, token: Token) -> Span {
        span_of(self.file, token.start, token.end)
    }

    /// From the byte `start` to the end of the token taken last.
    pub(crate) fn span_from(&self, start: u32) -> Span {
        span_of(self.file, start, self.previous_end.max(start))
    }

    /// Takes the next token if it is of this kind.
    pub(crate) fn eat(&mut self, kind: Kind) -> bool {
        let is = self.kind(0) == kind;
        if is {
            self.advance();
        }
        is
    }

    /// Takes the next token if it is this word.
    pub(crate) fn eat_word(&mut self, word: &str) -> bool {
        let is = self.word(0) == word;
        if is {
            self.advance();
        }
        is
    }

    /// Takes the next token, which must be of this kind.
    pub(crate) fn expect(&mut self, kind: Kind, what: &str) -> Parse<Token> {
        if self.kind(0) == kind { Ok(self.advance()) } else { Err(self.unexpected(what)) }
    }

    /// Takes the next token, which must be this word.
    pub(crate) fn expect_word(&mut self, word: &str) -> Parse<()> {
        if self.eat_word(word) { Ok(()) } else { Err(self.unexpected(&format!("`{word}`"))) }
    }

    // Findings

    pub(crate) fn report(&mut self, make: impl FnOnce() -> Diagnostic) {
        self.findings.report(make);
    }

    /// Reports that `what` was expected instead of the next token.
    pub(crate) fn unexpected(&mut self, what: &str) -> Abandoned {
        let token = self.peek(0);
        // Where a line ends too early, the end of that line is the place, not the beginning of the next.
        let span = if token.new_line || token.kind == Kind::End {
            span_of(self.file, self.previous_end, self.previous_end)
        } else {
            self.span(token)
        };
        let found = describe(self.text, token);
        // Unknown characters and operators of C were reported already.
        if token.kind != Kind::Unknown
            && !matches!(slice(self.text, token), "&&" | "||" | "|" | "!")
        {
            self.findings.report(|| {
                Diagnostic::error(codes::UNEXPECTED, format!("expected {what}, found {found}"))
                    .at(span, format!("expected {what}"))
            });
        }
        Abandoned
    }

    /// Reports a missing thing at the end of the token taken last.
    pub(crate) fn missing(&mut self, message: &str, help: &str) -> Abandoned {
        let span = span_of(self.file, self.previous_end, self.previous_end);
        self.report(|| Diagnostic::error(codes::MISSING, message).at(span, "here").help(help));
        Abandoned
    }

    // Limits

    /// One level deeper; every caller leaves by [`Parser::leave`], or by an error after which the depth is set back.
    pub(crate) fn enter(&mut self) -> Parse<()> {
        self.depth += 1;
        if self.depth <= self.limits.nesting { Ok(()) } else { Err(self.too_deep()) }
    }

    pub(crate) fn leave(&mut self) {
        self.depth -= 1;
    }

    /// Reports that the limit of nesting is passed here.
    pub(crate) fn too_deep(&mut self) -> Abandoned {
        let (span, limit) = (self.span(self.peek(0)), self.limits.nesting);
        self.report(|| {
            Diagnostic::error(codes::NESTING, format!("nested deeper than {limit} levels"))
                .at(span, "one level too deep")
                .help("split it into named parts, or raise the limit with --nesting-limit")
        });
        Abandoned
    }

    /// Keeps an item of a list, unless nothing is kept.
    pub(crate) fn keep<T>(&self, list: &mut Vec<T>, item: T) {
        if !self.dry {
            list.push(item);
        }
    }

    // Names, numbers, texts

    /// The name that a token stands for; nothing is stored when nothing is kept.
    pub(crate) fn name_at(&self, token: Token) -> Name {
        let text = if self.dry { String::new() } else { name_of(self.text, token).to_owned() };
        Name { text, span: self.span(token) }
    }

    /// A name: a word that is not reserved, or anything in backquotes.
    pub(crate) fn name(&mut self, what: &str) -> Parse<Name> {
        let token = self.peek(0);
        match token.kind {
            Kind::Quoted => Ok(self.name_at(self.window[0])).inspect(|_| {
                self.advance();
            }),
            Kind::Word => {
                let word = self.word(0);
                if RESERVED.contains(&word) {
                    let span = self.span(token);
                    self.report(|| {
                        Diagnostic::error(
                            codes::UNEXPECTED,
                            format!("expected {what}, found the keyword `{word}`"),
                        )
                        .at(span, "not a name")
                        .help("write a name that is also a keyword in backquotes")
                        .fix(span, format!("`{word}`"))
                    });
                    return Err(Abandoned);
                }
                self.advance();
                Ok(self.name_at(token))
            }
            Kind::Number => Ok(self.numbered_name()),
            _ => Err(self.unexpected(what)),
        }
    }

    /// A number where a name is needed: `0`, `1a`. Reported once for each, and taken as the name.
    fn numbered_name(&mut self) -> Name {
        let mut token = self.advance();
        if self.kind(0) == Kind::Word && self.peek(0).start == token.end {
            token.end = self.advance().end;
        }
        let (text, span) = (slice(self.text, token), self.span(token));
        if !self.numbered.contains(text) {
            if self.numbered.len() < self.limits.diagnostics {
                self.numbered.insert(text.to_owned());
            }
            let shown = short(text);
            self.report(|| {
                Diagnostic::error(
                    codes::UNEXPECTED,
                    format!("a name cannot begin with a digit: `{shown}`"),
                )
                .plural(format!("`{shown}`"), "names cannot begin with a digit:", "")
                .at(span, "expected a letter first")
                .help(format!("write `s{shown}`, or `{shown}` in backquotes: `` `{shown}` ``"))
            });
        }
        Name { text: if self.dry { String::new() } else { text.to_owned() }, span }
    }

    /// A whole number from 0 to 4 294 967 295 that needs no more than a word of what it counts.
    pub(crate) fn count(&mut self, what: &str) -> Parse<u32> {
        let token = self.peek(0);
        if token.kind != Kind::Number {
            return Err(self.unexpected(what));
        }
        self.advance();
        match self.number_at(token).and_then(|value| u32::try_from(value).ok()) {
            Some(value) => Ok(value),
            None => {
                let span = self.span(token);
                self.report(|| {
                    Diagnostic::error(codes::NUMBER, format!("{what} is too large"))
                        .at(span, format!("more than {}", u32::MAX))
                });
                // The number is known to be one: parsing goes on with another.
                Ok(u32::MAX)
            }
        }
    }

    /// The value of a token of kind `Number`, or none beyond 64 bits.
    pub(crate) fn number_at(&self, token: Token) -> Option<u64> {
        let text = slice(self.text, token);
        let (digits, radix) = match text.as_bytes() {
            [b'0', b'x' | b'X', ..] => (&text[2..], 16),
            [b'0', b'b' | b'B', ..] => (&text[2..], 2),
            _ => (text, 10),
        };
        digits.bytes().filter(|&b| b != b'_').try_fold(0u64, |value, byte| {
            let digit = u64::from(char::from(byte).to_digit(radix)?);
            value.checked_mul(u64::from(radix))?.checked_add(digit)
        })
    }

    /// A text in quotes, with its escapes resolved.
    pub(crate) fn text(&mut self, what: &str) -> Parse<String> {
        let token = self.peek(0);
        if !matches!(token.kind, Kind::Text | Kind::RawText) {
            return Err(self.unexpected(what));
        }
        self.advance();
        Ok(self.text_at(token))
    }

    fn text_at(&mut self, token: Token) -> String {
        let text = slice(self.text, token);
        if self.dry && !text.contains('\\') {
            return String::new();
        }
        if token.kind == Kind::RawText {
            let inner = text.strip_prefix("\"\"\"").unwrap_or(text);
            let inner = inner.strip_suffix("\"\"\"").unwrap_or(inner);
            let inner =
                inner.strip_prefix("\r\n").or_else(|| inner.strip_prefix('\n')).unwrap_or(inner);
            return if self.dry { String::new() } else { inner.to_owned() };
        }
        let inner = text.strip_prefix('"').unwrap_or(text);
        let inner = inner.strip_suffix('"').unwrap_or(inner);
        let mut value = String::with_capacity(inner.len());
        let mut chars = inner.char_indices();
        while let Some((at, c)) = chars.next() {
            if c != '\\' {
                value.push(c);
                continue;
            }
            match chars.next() {
                Some((_, 'n')) => value.push('\n'),
                Some((_, 't')) => value.push('\t'),
                Some((_, 'r')) => value.push('\r'),
                Some((_, '"')) => value.push('"'),
                Some((_, '\\')) => value.push('\\'),
                other => {
                    let start = token.start + 1 + u32::try_from(at).unwrap_or(0);
                    let length = other.map_or(1, |(_, c)| 1 + c.len_utf8());
                    let span = Span::new(self.file, start as usize, start as usize + length);
                    self.report(|| {
                        Diagnostic::error(codes::ESCAPE, "unknown escape in a string")
                            .at(span, "not an escape")
                            .help("the escapes are \\n \\t \\r \\\" and \\\\; a backslash itself is \\\\")
                    });
                }
            }
        }
        if self.dry { String::new() } else { value }
    }

    // Going on after an error

    /// Reads the items between braces, one call of `item` for each, and goes on behind each that fails. `needs_break`: two items on one line are
    /// parted by `;` (or `,` where a comma separates too).
    pub(crate) fn braced(
        &mut self,
        what: &str,
        separators: Separators,
        item: &mut dyn FnMut(&mut Self) -> Parse<()>,
    ) -> Parse<Span> {
        let open = self.expect(Kind::OpenBrace, &format!("`{{` and {what}"))?;
        self.enter()?;
        let depth = self.depth;
        loop {
            while self.kind(0) == Kind::Semicolon
                || (separators.has_comma() && self.kind(0) == Kind::Comma)
            {
                self.advance();
            }
            match self.kind(0) {
                Kind::CloseBrace => {
                    self.advance();
                    break;
                }
                Kind::End => {
                    self.unclosed(open, what);
                    break;
                }
                _ => {}
            }
            if self.begins_chart_inside() {
                if !std::mem::replace(&mut self.is_chart_reported, true) {
                    let next = self.span(self.peek(1));
                    self.unclosed_before(open, what, next);
                }
                break;
            }
            if separators.are_needed() && self.begins_outer_item() {
                self.unclosed(open, what);
                break;
            }
            let before = self.peek(0).start;
            let result = item(self);
            self.depth = depth;
            if result.is_err() || self.peek(0).start == before {
                self.skip_to_item(before);
            } else if separators.are_needed() {
                self.separated(separators);
            }
        }
        self.leave();
        Ok(self.span_from(open.start))
    }

    /// Between two items on one line something must part them, unless the first ended with a brace.
    pub(crate) fn separated(&mut self, separators: Separators) {
        let next = self.peek(0);
        let is_parted = next.new_line
            || matches!(next.kind, Kind::Semicolon | Kind::CloseBrace | Kind::End | Kind::Unknown)
            || (separators.has_comma() && next.kind == Kind::Comma)
            || self.text.as_bytes().get(self.previous_end as usize - 1) == Some(&b'}');
        if !is_parted {
            self.unexpected("`;` or a line break");
            if !self.is_name(0) {
                self.skip_to_item(u32::MAX);
            }
        }
    }

    /// A chart that begins a line inside of another, when the braces that are still to come do not close both.
    fn begins_chart_inside(&mut self) -> bool {
        let is_chart = self.peek(0).new_line
            && (self.word(0) == "chart" && self.is_name_beside(1)
                || self.word(0) == "library" && self.word(1) == "chart");
        if !is_chart {
            return false;
        }
        if let Some(known) = self.is_brace_missing {
            return known;
        }
        let mut lexer = Lexer::starting_at(self.text, self.peek(0).start as usize);
        let mut open = i64::from(self.depth);
        loop {
            match lexer.next(&mut |_, _| {}, &mut |_| {}).kind {
                Kind::End => break,
                Kind::OpenBrace => open += 1,
                Kind::CloseBrace => open -= 1,
                _ => {}
            }
        }
        self.is_brace_missing = Some(open > 0);
        open > 0
    }

    fn unclosed_before(&mut self, open: Token, what: &str, next: Span) {
        let (open, here) =
            (self.span(open), span_of(self.file, self.previous_end, self.previous_end));
        self.report(|| {
            Diagnostic::error(
                codes::UNCLOSED_BLOCK,
                format!("{what} is not closed before the next chart"),
            )
            .at(open, "opened here")
            .at(here, "expected `}`")
            .at(next, "the next chart")
            .help("write `}` before the next chart")
            .fix(here, "\n}")
        });
    }

    fn unclosed(&mut self, open: Token, what: &str) {
        if self.end_reported {
            return;
        }
        // One missing brace leaves all outer blocks open at the end too; that is one mistake.
        self.end_reported = self.kind(0) == Kind::End;
        let (open, here) =
            (self.span(open), span_of(self.file, self.previous_end, self.previous_end));
        self.report(|| {
            Diagnostic::error(codes::UNCLOSED_BLOCK, format!("{what} is not closed"))
                .at(open, "opened here")
                .at(here, "expected `}` here or earlier")
                .fix(here, "\n}")
        });
    }

    /// True where, inside a step's body or a list, an item of the chart begins that can be nothing else: then a brace is missing.
    pub(crate) fn begins_outer_item(&self) -> bool {
        if !self.peek(0).new_line {
            return false;
        }
        let then_name = self.is_name_beside(1) && !RESERVED.contains(&self.word(1));
        match self.word(0) {
            "step" | "input" | "output" | "var" | "event" | "internal" | "timer" | "extern"
            | "action" | "const" | "macro" | "conflict" | "chart" | "evolution" | "assert"
            | "assume" | "state" | "parallel" | "region" | "history" | "enclosing" | "use" => {
                then_name
            }
            "initial" => {
                matches!(self.word(1), "step" | "macro" | "state" | "parallel" | "enclosing")
            }
            "final" => self.word(1) == "state",
            _ => {
                let is_transition = |at: usize| {
                    self.is_name(at) && matches!(self.kind(at + 1), Kind::Arrow | Kind::Ampersand)
                        || self.kind(at) == Kind::Arrow
                };
                is_transition(0)
                    || (self.is_name(0) && self.kind(1) == Kind::Colon && is_transition(2))
            }
        }
    }

    /// Skips to the next line that no brace opened on the way reaches into. The token at byte `failed` is not where it begins.
    pub(crate) fn skip_to_line(&mut self, failed: u32) {
        let mut open = 0usize;
        loop {
            let token = self.peek(0);
            if token.kind == Kind::End || open == 0 && token.new_line && token.start != failed {
                return;
            }
            match token.kind {
                Kind::OpenBrace => open += 1,
                Kind::CloseBrace => open = open.saturating_sub(1),
                _ => {}
            }
            self.advance();
        }
    }

    /// Skips to a place where an item can begin: a word or an arrow at the start of a line, or behind `;`, outside of braces opened on the way; or
    /// the closing brace of the block. The token at byte `failed` is no such place: it is where the item began that could not be read.
    pub(crate) fn skip_to_item(&mut self, failed: u32) {
        let mut open = 0usize;
        loop {
            let token = self.peek(0);
            match token.kind {
                Kind::End => return,
                Kind::CloseBrace if open == 0 => return,
                Kind::CloseBrace => open -= 1,
                Kind::OpenBrace => open += 1,
                Kind::Semicolon if open == 0 => return,
                Kind::Word | Kind::Quoted | Kind::Arrow | Kind::Number
                    if open == 0
                        && token.new_line
                        && token.start != failed
                        && !matches!(self.word(0), "and" | "or" | "mod" | "not") =>
                {
                    return;
                }
                _ => {}
            }
            self.advance();
        }
    }
}

/// What parts the items of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separators {
    /// Nothing: each item shows where it ends.
    None,
    /// `;` or a line break.
    Semicolon,
    /// `,` too.
    CommaToo,
    /// As `CommaToo`, but items of a chart stand there as well, and the caller looks for what parts the others.
    Mixed,
}

impl Separators {
    /// A comma parts items as a semicolon does.
    fn has_comma(self) -> bool {
        matches!(self, Separators::CommaToo | Separators::Mixed)
    }

    /// Two items on one line must be parted, and no item of the chart stands there.
    fn are_needed(self) -> bool {
        matches!(self, Separators::Semicolon | Separators::CommaToo)
    }
}

/// A span of this file.
pub(crate) fn span_of(file: FileId, start: u32, end: u32) -> Span {
    Span { file, start, end }
}

/// The text of a token, cut where it is long.
pub(crate) fn slice_short(text: &str, token: Token) -> String {
    short(slice(text, token))
}

/// A text for a message: its first 40 characters, up to the end of the line.
pub(crate) fn short(text: &str) -> String {
    let mut shown: String =
        text.chars().take(40).take_while(|c| *c != '\n').filter(|c| !c.is_control()).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    shown
}

/// A token in a message.
fn describe(text: &str, token: Token) -> String {
    match token.kind {
        Kind::End => "the end of the text".to_owned(),
        Kind::Text | Kind::RawText => format!("the text {}", slice_short(text, token)),
        _ => format!("`{}`", slice_short(text, token).trim_matches('`')),
    }
}

fn lex_finding(text: &str, file: FileId, error: LexError) -> Diagnostic {
    match error {
        LexError::Character(start, end) => {
            let shown = text.get(start as usize..end as usize).unwrap_or("");
            let visible: String =
                shown.chars().take(8).map(|c| c.escape_debug().to_string()).collect();
            let noun = if shown.chars().nth(1).is_some() { "characters" } else { "character" };
            let finding =
                Diagnostic::error(codes::CHARACTER, format!("unexpected {noun} `{visible}`"))
                    .at(span_of(file, start, end), "not part of the language");
            match shown {
                "'" | "‘" | "’" => {
                    finding.help("write texts in double quotes and names in backquotes")
                }
                _ => finding,
            }
        }
        LexError::Operator(start, end) => {
            let span = span_of(file, start, end);
            let shown = text.get(span.range()).unwrap_or("");
            let (help, word) = match shown {
                "!" => ("write `not`, or `/` before a name", "not "),
                "&&" => ("write `and`", "and"),
                _ => ("write `or`", "or"),
            };
            Diagnostic::error(codes::CHARACTER, format!("unknown operator `{shown}`"))
                .at(span, "an operator of C")
                .help(help)
                .fix(span, word)
        }
        LexError::Quotes(start, end) => {
            let span = span_of(file, start, end);
            let straight: String = (text.get(span.range()).unwrap_or("").chars())
                .map(|c| if is_typeset_quote(c) { '"' } else { c })
                .collect();
            let mut chars = text.get(start as usize..).unwrap_or("").chars();
            let first = chars.next().unwrap_or('“');
            let first_end = start + u32::try_from(first.len_utf8()).unwrap_or(1);
            Diagnostic::error(codes::CHARACTER, format!("typographic quote `{first}`"))
                .at(span_of(file, start, first_end), "expected `\"`")
                .help("write texts in straight quotes `\"`")
                .fix(span, straight)
        }
        LexError::Comment(start, sign, end) => {
            let all = text.get(start as usize..end as usize).unwrap_or("");
            let shown = text.get(start as usize..sign as usize).unwrap_or("");
            let finding =
                Diagnostic::error(codes::CHARACTER, format!("unknown comment sign `{shown}`"))
                    .at(span_of(file, start, sign), "a comment begins with `#`");
            let ends_line = text[end as usize..].chars().find(|c| !matches!(c, ' ' | '\t' | '\r'));
            if shown == "//" {
                return finding.help("write `#`").fix(span_of(file, start, sign), "#");
            }
            if all.contains('\n') || !matches!(ends_line, None | Some('\n')) {
                return finding
                    .help("write `#` before each line of the comment, on lines of its own");
            }
            let inner = all[2..].strip_suffix("*/").unwrap_or(&all[2..]).trim_end();
            finding.help("write `#`").fix(span_of(file, start, end), format!("#{inner}"))
        }
        LexError::Text(start, end) => Diagnostic::error(
            codes::UNCLOSED_QUOTE,
            "text without its closing quote",
        )
        .at(span_of(file, start, end), "begins here")
        .help("end the text on its line, or write a longer text between `\"\"\"` and `\"\"\"`"),
        LexError::Name(start, end) if end == start + 2 => Diagnostic::error(
            codes::UNCLOSED_QUOTE,
            "a name in backquotes needs at least one character",
        )
        .at(span_of(file, start, end), "empty name"),
        LexError::Name(start, end) => {
            Diagnostic::error(codes::UNCLOSED_QUOTE, "name without its closing backquote")
                .at(span_of(file, start, end), "begins here")
        }
    }
}
