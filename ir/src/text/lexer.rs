//! Tokens of the text form, produced one at a time: nothing is stored, so a long line needs no memory.

use super::is_word_char;
use crate::span::{FileId, Span};
use std::borrow::Cow;

/// Kinds of tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A plain name or a keyword, including dots.
    Word,
    /// A name in back quotes.
    Quoted,
    /// `.ending` after a quoted name.
    Suffix,
    /// A text in double quotes.
    Str,
    /// Decimal digits.
    Number,
    /// `%N`
    Edge,
    /// `?N`
    Position,
    /// Punctuation.
    Symbol,
    /// The end of a line.
    Newline,
    /// The end of the text.
    End,
    /// A quote that is not closed in its line.
    Open,
    /// A character that starts no token.
    Bad,
}

/// A token: its kind and its bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) start: usize,
    pub(super) end: usize,
}

/// The rest of a text.
#[derive(Debug, Clone)]
pub(super) struct Lexer<'a> {
    source: &'a str,
    at: usize,
}

/// The length of the symbol at the beginning, if there is one.
fn sign(text: &[u8]) -> Option<usize> {
    Some(match text {
        [b'-', b'>', ..] | [b':' | b'<' | b'>', b'=', ..] | [b'<', b'>', ..] | [b'.', b'.', ..] => {
            2
        }
        [
            b'(' | b')' | b'[' | b']' | b'{' | b'}' | b',' | b';' | b'=' | b'<' | b'>' | b'+'
            | b'-' | b'*' | b'/',
            ..,
        ] => 1,
        _ => return None,
    })
}

impl<'a> Lexer<'a> {
    pub(super) fn new(source: &'a str) -> Self {
        Lexer { source, at: 0 }
    }

    pub(super) fn next(&mut self) -> Token {
        self.skip_blanks();
        let start = self.at;
        let rest = &self.source[start..];
        let Some(first) = rest.chars().next() else {
            return Token { kind: Kind::End, start, end: start };
        };
        let (kind, length) = match first {
            '\n' => (Kind::Newline, 1),
            '`' | '"' => match quoted(rest, first) {
                Some(length) => (if first == '`' { Kind::Quoted } else { Kind::Str }, length),
                None => (Kind::Open, rest.find('\n').unwrap_or(rest.len())),
            },
            '%' | '?' if rest[1..].starts_with(|c: char| c.is_ascii_digit()) => {
                (if first == '%' { Kind::Edge } else { Kind::Position }, 1 + digits(&rest[1..]))
            }
            '0'..='9' => (Kind::Number, digits(rest)),
            '.' if !rest.starts_with("..")
                && self.source[..start].ends_with(|c: char| c == '`' || c.is_ascii_digit()) =>
            {
                (Kind::Suffix, 1 + word(&rest[1..]))
            }
            c if c.is_alphabetic() || c == '_' => (Kind::Word, dotted(rest)),
            c => match sign(rest.as_bytes()) {
                Some(length) => (Kind::Symbol, length),
                None => (Kind::Bad, c.len_utf8()),
            },
        };
        self.at = start + length;
        Token { kind, start, end: self.at }
    }

    fn skip_blanks(&mut self) {
        let bytes = self.source.as_bytes();
        loop {
            while matches!(bytes.get(self.at), Some(b' ' | b'\t' | b'\r')) {
                self.at += 1;
            }
            if !bytes[self.at..].starts_with(b"//") {
                return;
            }
            let rest = &self.source[self.at..];
            self.at += rest.find('\n').unwrap_or(rest.len());
        }
    }
}

impl Token {
    pub(super) fn text<'a>(&self, source: &'a str) -> &'a str {
        &source[self.start..self.end]
    }

    pub(super) fn span(&self, file: FileId) -> Span {
        Span::new(file, self.start, self.end)
    }
}

fn digits(text: &str) -> usize {
    text.bytes().take_while(u8::is_ascii_digit).count()
}

fn word(text: &str) -> usize {
    // Names are nearly always ASCII: scan bytes until one is not.
    let ascii =
        text.bytes().take_while(|byte| byte.is_ascii_alphanumeric() || *byte == b'_').count();
    if text.as_bytes().get(ascii).is_none_or(u8::is_ascii) {
        return ascii;
    }
    text.find(|c| !is_word_char(c)).unwrap_or(text.len())
}

/// The length of words joined by single dots; `0..9` and `a..` end before the dots.
fn dotted(text: &str) -> usize {
    let mut length = word(text);
    while let Some(rest) = text[length..].strip_prefix('.') {
        match word(rest) {
            0 => break,
            more => length += 1 + more,
        }
    }
    length
}

/// The length of a quoted text with both quotes; `None` if its line ends first.
fn quoted(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '\n' => return None,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// The text between quotes, with escapes resolved; `None` if an escape is unknown.
pub(super) fn unquote(text: &str) -> Option<Cow<'_, str>> {
    let inner = text.get(1..text.len().checked_sub(1)?)?;
    if !inner.contains('\\') {
        return Some(Cow::Borrowed(inner));
    }
    let mut out = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match chars.next()? {
            'n' => out.push('\n'),
            't' => out.push('\t'),
            'r' => out.push('\r'),
            c @ ('\\' | '"' | '`') => out.push(c),
            'u' => {
                let hex = chars.as_str().strip_prefix('{')?;
                let (hex, rest) = hex.split_once('}')?;
                out.push(char::from_u32(u32::from_str_radix(hex, 16).ok()?)?);
                chars = rest.chars();
            }
            _ => return None,
        }
    }
    Some(Cow::Owned(out))
}

/// `text` in quotes on one line, so that [`unquote`] returns it.
pub(super) fn quote(text: &str, quote: char) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push(quote);
    for c in text.chars() {
        match c {
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            '\\' => out.push_str("\\\\"),
            c if c == quote => {
                out.push('\\');
                out.push(c);
            }
            c if c.is_control() => out.push_str(&format!("\\u{{{:x}}}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push(quote);
    out
}
