//! The grammar-independent part of the parser: lookahead, findings, limits, names, numbers and error recovery.

use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::{FileId, Name, Span};

use super::lexer::{LexError, Lexer, is_typeset_quote};
use super::numbers::{Numbers, name_of, slice};
use super::token::{INFIX, Kind, Token};
use super::{Comment, Limits};
use crate::codes;
use crate::findings::Findings;

/// Result of a grammar rule.
pub(crate) type Parse<T> = Result<T, ErrorReported>;

/// Reserved words, which are never names. All other keywords depend on their context.
pub(crate) const RESERVED: &[&str] = &[
    "and",
    "or",
    "not",
    "mod",
    "band",
    "bor",
    "bxor",
    "bnot",
    "shl",
    "shr",
    "true",
    "false",
    "otherwise",
    "if",
];

/// Maximum lookahead in tokens.
const AHEAD: usize = 4;

/// Parser of one source.
pub(crate) struct Parser<'a> {
    pub(crate) text: &'a str,
    pub(super) file: FileId,
    lexer: Lexer<'a>,
    pub(super) window: [Token; AHEAD],
    /// Offset after the last consumed token.
    pub(crate) previous_end: u32,
    /// The integer names; `None` if they are declared in another source and are unknown here.
    pub(crate) numbers: Option<&'a Numbers<'a>>,
    pub(crate) findings: Findings,
    pub(crate) comments: Vec<Comment>,
    pub(crate) limits: Limits,
    pub(crate) depth: u32,
    end_reported: bool,
    /// Names that begin with a digit and are already reported.
    numbered: std::collections::BTreeSet<String>,
    /// Cache per word that may begin a duration of IEC 61131-3: whether the text contains the word.
    pub(super) has_words: std::collections::BTreeMap<String, bool>,
    /// For a chart that begins inside another chart: whether a closing brace is missing before it.
    is_brace_missing: Option<bool>,
    is_chart_reported: bool,
    /// Arrows of transitions without targets. They are reported if the chart is not a statechart.
    pub(crate) bare_arrows: Vec<Span>,
    /// True if the parser only checks: it builds no tree, so that a large source with an error costs no memory.
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

    /// Creates a parser for the part of `text` that begins at byte `start`. Spans refer to the whole text.
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

    /// Consumes the next token.
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

    /// Looks ahead by `ahead` tokens (0 to 3); 0 is the next token.
    pub(crate) fn peek(&self, ahead: usize) -> Token {
        self.window[ahead]
    }

    /// The kind of the token at lookahead `ahead`.
    pub(crate) fn kind(&self, ahead: usize) -> Kind {
        self.window[ahead].kind
    }

    /// The text of the token at lookahead `ahead` if it is a word (not a quoted name), otherwise an empty text.
    pub(crate) fn word(&self, ahead: usize) -> &'a str {
        let token = self.window[ahead];
        if token.kind == Kind::Word { slice(self.text, token) } else { "" }
    }

    /// Whether the token at lookahead `ahead` is a word or a quoted name.
    pub(crate) fn is_name(&self, ahead: usize) -> bool {
        matches!(self.window[ahead].kind, Kind::Word | Kind::Quoted)
    }

    /// Whether the token at lookahead `ahead` is a name on the same line as the token before it.
    pub(crate) fn is_name_beside(&self, ahead: usize) -> bool {
        self.is_name(ahead) && !self.window[ahead].new_line
    }

    pub(crate) fn span(&self, token: Token) -> Span {
        span_of(self.file, token.start, token.end)
    }

    /// The span from byte `start` to the end of the last consumed token.
    pub(crate) fn span_from(&self, start: u32) -> Span {
        span_of(self.file, start, self.previous_end.max(start))
    }

    /// Consumes the next token if it has this kind.
    pub(crate) fn eat(&mut self, kind: Kind) -> bool {
        let is = self.kind(0) == kind;
        if is {
            self.advance();
        }
        is
    }

    /// Consumes the next token if it is this word.
    pub(crate) fn eat_word(&mut self, word: &str) -> bool {
        let is = self.word(0) == word;
        if is {
            self.advance();
        }
        is
    }

    /// Consumes the next token, which must have this kind.
    pub(crate) fn expect(&mut self, kind: Kind, what: &str) -> Parse<Token> {
        if self.kind(0) == kind { Ok(self.advance()) } else { Err(self.unexpected(what)) }
    }

    /// Consumes the next token, which must be this word.
    pub(crate) fn expect_word(&mut self, word: &str) -> Parse<()> {
        if self.eat_word(word) { Ok(()) } else { Err(self.unexpected(&format!("`{word}`"))) }
    }

    // Findings

    pub(crate) fn report(&mut self, make: impl FnOnce() -> Diagnostic) {
        self.findings.report(make);
    }

    /// Reports that `what` was expected instead of the next token.
    pub(crate) fn unexpected(&mut self, what: &str) -> ErrorReported {
        let token = self.peek(0);
        // If a line ends too early, the location is the end of that line, not the beginning of the next.
        let span = if token.new_line || token.kind == Kind::End {
            span_of(self.file, self.previous_end, self.previous_end)
        } else {
            self.span(token)
        };
        let found = describe(self.text, token);
        // Unknown characters and C operators are already reported.
        if token.kind != Kind::Unknown
            && !matches!(slice(self.text, token), "&&" | "||" | "|" | "!")
        {
            self.findings.report(|| {
                let finding =
                    Diagnostic::error(codes::UNEXPECTED, format!("expected {what}, found {found}"))
                        .at(span, format!("expected {what}"));
                if token.kind == Kind::End {
                    finding.help(format!("write {what} at the end of the text"))
                } else if token.new_line {
                    finding.help(format!("write {what} at the end of this line"))
                } else {
                    finding.help(format!("write {what} before {found}, or replace {found}"))
                }
            });
        }
        ErrorReported
    }

    /// Reports something missing at the end of the last consumed token.
    pub(crate) fn missing(&mut self, message: &str, help: &str) -> ErrorReported {
        let span = span_of(self.file, self.previous_end, self.previous_end);
        self.report(|| Diagnostic::error(codes::MISSING, message).at(span, "here").help(help));
        ErrorReported
    }

    // Limits

    /// Increases the nesting depth. The caller must call [`Parser::leave`], or return an error: error recovery restores the depth.
    pub(crate) fn enter(&mut self) -> Parse<()> {
        self.depth += 1;
        if self.depth <= self.limits.nesting { Ok(()) } else { Err(self.too_deep()) }
    }

    pub(crate) fn leave(&mut self) {
        self.depth -= 1;
    }

    /// Reports that the nesting limit is exceeded here.
    pub(crate) fn too_deep(&mut self) -> ErrorReported {
        let (span, limit) = (self.span(self.peek(0)), self.limits.nesting);
        self.report(|| {
            Diagnostic::error(codes::NESTING, format!("nested deeper than {limit} levels"))
                .at(span, "one level too deep")
                .help("split it into named parts, or raise the limit with --nesting-limit")
        });
        ErrorReported
    }

    /// Adds an item to a list, unless this parser only checks.
    pub(crate) fn keep<T>(&self, list: &mut Vec<T>, item: T) {
        if !self.dry {
            list.push(item);
        }
    }

    // Names, numbers, strings

    /// The name that a token denotes. A parser that only checks stores nothing.
    pub(crate) fn name_at(&self, token: Token) -> Name {
        let text = if self.dry { String::new() } else { name_of(self.text, token).to_owned() };
        Name { text, span: self.span(token) }
    }

    /// Parses a name: a word that is not reserved, or anything in backquotes.
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
                    return Err(ErrorReported);
                }
                self.advance();
                Ok(self.name_at(token))
            }
            Kind::Number => Ok(self.numbered_name()),
            _ => Err(self.unexpected(what)),
        }
    }

    /// Parses a number where a name is expected: `0`, `1a`. Reports each one once and uses it as the name.
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

    /// Parses a whole number from 0 to 4 294 967 295. `what` names the quantity in messages.
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
                        .help("write a smaller number")
                });
                // The token is a number, so parsing continues with another value.
                Ok(u32::MAX)
            }
        }
    }

    /// The value of a token of kind `Number`; `None` if it exceeds 64 bits.
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

    /// Parses a quoted text and resolves its escapes.
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

    // Error recovery

    /// Parses the items between braces. Calls `item` once for each and continues after each one that fails. `separators` defines how two
    /// items on one line are separated.
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

    /// Requires a separator between two items on one line, unless the first ended with a brace.
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

    /// Whether a line inside a chart begins with another chart, and too few closing braces follow to close both charts.
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
        // One missing brace also leaves all outer blocks open at the end. That is reported once.
        self.end_reported = self.kind(0) == Kind::End;
        let (open, here) =
            (self.span(open), span_of(self.file, self.previous_end, self.previous_end));
        self.report(|| {
            Diagnostic::error(codes::UNCLOSED_BLOCK, format!("{what} is not closed"))
                .at(open, "opened here")
                .at(here, "expected `}` here or earlier")
                .help("write `}` where the block ends")
                .fix(here, "\n}")
        });
    }

    /// Inside the body of a step or a list: whether the next tokens can only begin an item of the chart, which means that a brace is
    /// missing.
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

    /// Skips to the next line that is outside all braces opened during the skip. Parsing must not resume at byte `failed`.
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

    /// Skips to a place where an item can begin: a `;`, a name, number or arrow at the start of a line, or the closing brace of the block.
    /// Braces that open during the skip are skipped with their contents. Parsing must not resume at byte `failed`, where the item that
    /// could not be read began.
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
                        && !INFIX.contains(&self.word(0))
                        && !matches!(self.word(0), "not" | "bnot") =>
                {
                    return;
                }
                _ => {}
            }
            self.advance();
        }
    }
}

/// The separators that are allowed or required between the items of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separators {
    /// No separator: the end of each item is unambiguous.
    None,
    /// `;` or a line break.
    Semicolon,
    /// `,`, `;` or a line break.
    CommaToo,
    /// Like `CommaToo`, but the block also contains items of the chart. The caller checks the separators between the other items.
    Mixed,
}

impl Separators {
    /// Whether a comma separates items.
    fn has_comma(self) -> bool {
        matches!(self, Separators::CommaToo | Separators::Mixed)
    }

    /// Whether [`Parser::braced`] requires a separator between two items on one line. Such a block contains no items of the chart.
    fn are_needed(self) -> bool {
        matches!(self, Separators::Semicolon | Separators::CommaToo)
    }
}

/// A span in this file.
pub(crate) fn span_of(file: FileId, start: u32, end: u32) -> Span {
    Span { file, start, end }
}

/// The text of a token, shortened if it is long.
pub(crate) fn slice_short(text: &str, token: Token) -> String {
    short(slice(text, token))
}

/// A text shortened for a message: its first 40 characters, at most to the end of the line.
pub(crate) fn short(text: &str) -> String {
    let mut shown: String =
        text.chars().take(40).take_while(|c| *c != '\n').filter(|c| !c.is_control()).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    shown
}

/// Describes a token in a message.
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
                _ => finding.help("remove it, or put it into a text in double quotes or a comment"),
            }
        }
        LexError::Operator(start, end) => {
            let span = span_of(file, start, end);
            let shown = text.get(span.range()).unwrap_or("");
            let (help, word) = match shown {
                "!" => ("write `not`, or `/` before a name", "not "),
                "&&" => ("write `and`", "and"),
                "%" => ("write `mod`", "mod"),
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
                Diagnostic::error(codes::CHARACTER, format!("unknown comment marker `{shown}`"))
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
        .at(span_of(file, start, end), "empty name")
        .help("write a name between the backquotes"),
        LexError::Name(start, end) => {
            Diagnostic::error(codes::UNCLOSED_QUOTE, "name without its closing backquote")
                .at(span_of(file, start, end), "begins here")
                .help("write a backquote at the end of the name")
        }
    }
}
