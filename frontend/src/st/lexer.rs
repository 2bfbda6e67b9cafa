//! Lexer: identifiers, numbers in any base, times, addresses, comments, pragmas.

use grafsynth_ir::{FileId, Span};

use super::symbol::Symbol;
use crate::xml::Mapped;

/// Maps positions in the text to spans in the source.
#[derive(Clone, Copy)]
pub(crate) enum Places<'a> {
    /// The text is the source.
    Direct(FileId),
    /// The text is the content of an XML element.
    Mapped(&'a Mapped<'a>),
}

impl Places<'_> {
    pub(crate) fn span(self, start: usize, end: usize) -> Span {
        match self {
            Places::Direct(file) => Span::new(file, start, end),
            Places::Mapped(mapped) => mapped.span(start..end),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Word,
    /// Decimal digits with `_`, or with a base: `16#ff`.
    Number,
    /// `1.5`, `1E3`
    Real,
    /// `T#5s`, `TIME#1h2m`
    Time,
    /// `INT#5`, `BOOL#1`, `BYTE#16#ff`: a literal with a type prefix.
    Typed,
    /// `'..'`, `".."`
    Text,
    /// `%IX0.0`
    Address,
    /// `:=`
    Assign,
    /// `=>`
    Arrow,
    /// `..`
    Range,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Plus,
    Minus,
    Star,
    Power,
    Slash,
    Ampersand,
    /// `||`, reported and read as `OR`.
    Bars,
    /// `!`, reported and read as `NOT`.
    Exclamation,
    Open,
    Close,
    OpenBracket,
    CloseBracket,
    Comma,
    Semicolon,
    Colon,
    Dot,
    Hash,
    Caret,
    End,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Token {
    pub(crate) kind: Kind,
    pub(crate) start: usize,
    pub(crate) end: usize,
}

/// A comment or a pragma, without its delimiters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Aside {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) is_pragma: bool,
    /// Whether the settings of a pragma have been used.
    pub(crate) is_read: bool,
    /// Offset of the opening delimiter.
    pub(crate) from: usize,
}

/// Text that is not a valid token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LexError {
    Character(usize, usize),
    /// A C operator, with the operator of structured text that replaces it.
    Foreign(usize, usize, &'static str),
    /// A comment, pragma or string without its end.
    Unclosed(usize, usize, &'static str),
}

/// All tokens of a text, with the comments and pragmas between them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tokens {
    pub(crate) tokens: Vec<Token>,
    pub(crate) asides: Vec<Aside>,
    pub(crate) errors: Vec<LexError>,
}

struct Lexer<'a> {
    text: &'a str,
    bytes: &'a [u8],
    at: usize,
    out: Tokens,
}

/// Splits a text into tokens; the last one is [`Kind::End`].
pub(crate) fn tokens(text: &str) -> Tokens {
    let at = if text.starts_with('\u{feff}') { 3 } else { 0 };
    let mut lexer = Lexer { text, bytes: text.as_bytes(), at, out: Tokens::default() };
    lexer.all();
    lexer.out
}

impl Lexer<'_> {
    fn byte(&self, ahead: usize) -> u8 {
        self.bytes.get(self.at + ahead).copied().unwrap_or(0)
    }

    fn all(&mut self) {
        while self.at < self.bytes.len() {
            let start = self.at;
            let byte = self.byte(0);
            if byte.is_ascii_whitespace() {
                self.at += 1;
                continue;
            }
            match (byte, self.byte(1)) {
                (b'(', b'*') => self.comment(b"(*", b"*)", "comment"),
                (b'/', b'*') => self.comment(b"/*", b"*/", "comment"),
                (b'/', b'/') => {
                    let end = self.line_end();
                    self.aside(start + 2, end, false, start);
                    self.at = end;
                }
                (b'{', _) => self.pragma(),
                _ => {
                    if let Some(kind) = self.token() {
                        self.out.tokens.push(Token { kind, start, end: self.at });
                    }
                }
            }
        }
        let end = self.bytes.len();
        self.out.tokens.push(Token { kind: Kind::End, start: end, end });
    }

    fn line_end(&self) -> usize {
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        self.at + rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len())
    }

    fn aside(&mut self, start: usize, end: usize, is_pragma: bool, from: usize) {
        let is_read = false;
        self.out.asides.push(Aside { start, end: end.max(start), is_pragma, from, is_read });
    }

    /// Reads a comment; comments may be nested.
    fn comment(&mut self, open: &[u8], close: &[u8], what: &'static str) {
        let start = self.at;
        let mut depth = 0usize;
        while self.at < self.bytes.len() {
            let rest = &self.bytes[self.at..];
            if rest.starts_with(open) {
                depth += 1;
                self.at += 2;
            } else if rest.starts_with(close) {
                depth -= 1;
                self.at += 2;
                if depth == 0 {
                    self.aside(start + 2, self.at - 2, false, start);
                    return;
                }
            } else {
                self.at += 1;
            }
        }
        self.out.errors.push(LexError::Unclosed(start, start + 2, what));
    }

    fn pragma(&mut self) {
        let start = self.at;
        let rest = &self.bytes[start..];
        match rest.iter().position(|&byte| byte == b'}') {
            Some(length) => {
                self.aside(start + 1, start + length, true, start);
                self.at = start + length + 1;
            }
            None => {
                self.out.errors.push(LexError::Unclosed(start, start + 1, "pragma"));
                self.at = self.bytes.len();
            }
        }
    }

    fn one(&mut self, kind: Kind, length: usize) -> Option<Kind> {
        self.at += length;
        Some(kind)
    }

    /// Reports a C operator and adds the token that replaces it.
    fn foreign(&mut self, kind: Kind, length: usize, instead: &'static str) -> Option<Kind> {
        self.out.errors.push(LexError::Foreign(self.at, self.at + length, instead));
        self.one(kind, length)
    }

    fn token(&mut self) -> Option<Kind> {
        let (byte, next) = (self.byte(0), self.byte(1));
        match (byte, next) {
            (b':', b'=') => return self.one(Kind::Assign, 2),
            (b'=', b'>') => return self.one(Kind::Arrow, 2),
            (b'.', b'.') => return self.one(Kind::Range, 2),
            (b'<', b'>') => return self.one(Kind::NotEqual, 2),
            (b'<', b'=') => return self.one(Kind::LessEqual, 2),
            (b'>', b'=') => return self.one(Kind::GreaterEqual, 2),
            (b'*', b'*') => return self.one(Kind::Power, 2),
            (b'&', b'&') => return self.foreign(Kind::Ampersand, 2, "AND"),
            (b'|', b'|') => return self.foreign(Kind::Bars, 2, "OR"),
            (b'|', _) => return self.foreign(Kind::Bars, 1, "OR"),
            (b'=', b'=') => return self.foreign(Kind::Equal, 2, "="),
            (b'!', b'=') => return self.foreign(Kind::NotEqual, 2, "<>"),
            (b'!', _) => return self.foreign(Kind::Exclamation, 1, "NOT"),
            _ => {}
        }
        let kind = match byte {
            b'=' => Kind::Equal,
            b'<' => Kind::Less,
            b'>' => Kind::Greater,
            b'+' => Kind::Plus,
            b'-' => Kind::Minus,
            b'*' => Kind::Star,
            b'/' => Kind::Slash,
            b'&' => Kind::Ampersand,
            b'(' => Kind::Open,
            b')' => Kind::Close,
            b'[' => Kind::OpenBracket,
            b']' => Kind::CloseBracket,
            b',' => Kind::Comma,
            b';' => Kind::Semicolon,
            b':' => Kind::Colon,
            b'.' => Kind::Dot,
            b'#' => Kind::Hash,
            b'^' => Kind::Caret,
            b'\'' | b'"' => return self.string(byte),
            b'%' => return self.address(),
            b'0'..=b'9' => return Some(self.number()),
            _ => return self.word(),
        };
        self.one(kind, 1)
    }

    fn string(&mut self, quote: u8) -> Option<Kind> {
        let start = self.at;
        self.at += 1;
        while self.at < self.bytes.len() {
            match self.byte(0) {
                b'$' => self.at += 2,
                b'\n' => break,
                byte if byte == quote => {
                    self.at += 1;
                    return Some(Kind::Text);
                }
                _ => self.at += 1,
            }
        }
        self.at = self.at.min(self.bytes.len());
        while !self.text.is_char_boundary(self.at) {
            self.at += 1;
        }
        self.out.errors.push(LexError::Unclosed(start, self.at, "string"));
        None
    }

    fn address(&mut self) -> Option<Kind> {
        let start = self.at;
        self.at += 1;
        let is_part = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'*');
        // `%IX0..` is an address followed by a range sign.
        while is_part(self.byte(0)) && !(self.byte(0) == b'.' && self.byte(1) == b'.') {
            self.at += 1;
        }
        if self.at == start + 1 {
            self.out.errors.push(LexError::Character(start, self.at));
            return None;
        }
        Some(Kind::Address)
    }

    fn digits(&mut self, is_digit: impl Fn(u8) -> bool) {
        while is_digit(self.byte(0)) || (self.byte(0) == b'_' && is_digit(self.byte(1))) {
            self.at += 1;
        }
    }

    fn number(&mut self) -> Kind {
        self.digits(|byte| byte.is_ascii_digit());
        if self.byte(0) == b'#' && self.byte(1).is_ascii_alphanumeric() {
            self.at += 1;
            self.digits(|byte| byte.is_ascii_alphanumeric());
            return Kind::Number;
        }
        let mut kind = Kind::Number;
        if self.byte(0) == b'.' && self.byte(1).is_ascii_digit() {
            self.at += 1;
            self.digits(|byte| byte.is_ascii_digit());
            kind = Kind::Real;
        }
        if matches!(self.byte(0), b'e' | b'E') {
            let sign = usize::from(matches!(self.byte(1), b'+' | b'-'));
            if self.byte(1 + sign).is_ascii_digit() {
                self.at += 1 + sign;
                self.digits(|byte| byte.is_ascii_digit());
                kind = Kind::Real;
            }
        }
        kind
    }

    fn word(&mut self) -> Option<Kind> {
        let start = self.at;
        let rest = self.text.get(start..).unwrap_or("");
        let mut chars = rest.chars();
        let first = chars.next()?;
        if first != '_' && !unicode_ident::is_xid_start(first) {
            self.at += first.len_utf8();
            self.out.errors.push(LexError::Character(start, self.at));
            return None;
        }
        let length: usize = rest
            .chars()
            .take_while(|&c| unicode_ident::is_xid_continue(c))
            .map(char::len_utf8)
            .sum();
        self.at += length;
        if self.byte(0) != b'#' {
            return Some(Kind::Word);
        }
        let word = Symbol::of(&rest[..length]);
        if matches!(word.as_str(), "T" | "TIME" | "LT" | "LTIME" | "LTIME_" | "TIME_") {
            self.at += 1;
            if self.byte(0) == b'-' {
                self.at += 1;
            }
            self.digits(|byte| byte.is_ascii_alphanumeric() || byte == b'.');
            return Some(Kind::Time);
        }
        if matches!(word.as_str(), "D" | "DATE" | "TOD" | "TIME_OF_DAY" | "DT" | "DATE_AND_TIME") {
            self.at += 1;
            self.digits(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b':' | b'-'));
            return Some(Kind::Text);
        }
        self.at += 1;
        Some(Kind::Typed)
    }
}
