//! Lexer: produces one token at a time, on demand, so that a source of 60 MB needs no list of tokens.
//!
//! The lexer reports text that is not a token ([`LexError`]) and continues after it. It does not know the keywords of the language.

use super::token::{Kind, Token};

/// Text that is not a valid token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LexError {
    /// Unexpected characters: start and end.
    Character(u32, u32),
    /// A string without its closing quote: start, and end of the line or text.
    Text(u32, u32),
    /// A name without its closing backquote, or an empty name: start and end.
    Name(u32, u32),
    /// Typographic quotes: from the first to the end of the last one on the line.
    Quotes(u32, u32),
    /// A C operator, which is read as the corresponding operator of this language: start and end.
    Operator(u32, u32),
    /// A comment in C syntax: start, end of the opening sign, and end.
    Comment(u32, u32, u32),
}

/// Lexer over one text.
#[derive(Debug, Clone)]
pub(crate) struct Lexer<'a> {
    text: &'a str,
    bytes: &'a [u8],
    at: usize,
    new_line: bool,
    /// Typographic quotes before this position are already reported.
    quotes_until: usize,
}

impl<'a> Lexer<'a> {
    /// Creates a lexer at the start of `text`; skips a byte order mark.
    pub(crate) fn new(text: &'a str) -> Self {
        Self::starting_at(text, if text.starts_with('\u{feff}') { 3 } else { 0 })
    }

    /// Creates a lexer at byte `at`, which must be between two tokens.
    pub(crate) fn starting_at(text: &'a str, at: usize) -> Self {
        Lexer { text, bytes: text.as_bytes(), at, new_line: true, quotes_until: 0 }
    }

    fn byte(&self, ahead: usize) -> u8 {
        self.bytes.get(self.at + ahead).copied().unwrap_or(0)
    }

    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or("")
    }

    /// Returns the next token. Passes comments to `comment` as ranges without the line break, and errors to `error`.
    pub(crate) fn next(
        &mut self,
        comment: &mut dyn FnMut(u32, u32),
        error: &mut dyn FnMut(LexError),
    ) -> Token {
        self.skip_space(comment, error);
        let start = self.at;
        let kind = self.kind(error);
        let token = Token { kind, new_line: self.new_line, start: cut(start), end: cut(self.at) };
        self.new_line = false;
        token
    }

    fn skip_space(&mut self, comment: &mut dyn FnMut(u32, u32), error: &mut dyn FnMut(LexError)) {
        loop {
            match self.byte(0) {
                b'\n' => {
                    self.new_line = true;
                    self.at += 1;
                }
                b' ' | b'\t' | b'\r' | 0x0b | 0x0c => self.at += 1,
                b'#' => {
                    let start = self.at;
                    let line = memchr_newline(&self.bytes[self.at..]);
                    self.at += line;
                    // A carriage return is part of the line break.
                    let end =
                        if self.bytes[..self.at].ends_with(b"\r") { self.at - 1 } else { self.at };
                    comment(cut(start), cut(end));
                }
                b'/' if self.begins_comment_of_c() => {
                    let start = self.at;
                    let rest = &self.rest()[2..];
                    let length = if self.byte(1) == b'/' {
                        memchr_newline(rest.as_bytes())
                    } else {
                        rest.find("*/").map_or(rest.len(), |at| at + 2)
                    };
                    self.new_line |= rest[..length].contains('\n');
                    self.at += 2 + length;
                    error(LexError::Comment(cut(start), cut(start + 2), cut(self.at)));
                }
                byte if byte >= 0x80 => match self.rest().chars().next() {
                    Some(c) if c.is_whitespace() => {
                        // U+0085, U+2028 and U+2029 are line breaks too.
                        self.new_line |= matches!(c, '\u{85}' | '\u{2028}' | '\u{2029}');
                        self.at += c.len_utf8();
                    }
                    _ => return,
                },
                _ => return,
            }
        }
    }

    /// Whether a C comment begins here: `/*`, which no expression contains, or `//` before a blank, another `/` or the end of the line.
    /// `//b` is a double negation.
    fn begins_comment_of_c(&self) -> bool {
        match self.byte(1) {
            b'*' => true,
            b'/' => matches!(self.byte(2), b' ' | b'\t' | b'\r' | b'\n' | b'/' | 0),
            _ => false,
        }
    }

    fn kind(&mut self, error: &mut dyn FnMut(LexError)) -> Kind {
        if self.at >= self.bytes.len() {
            return Kind::End;
        }
        let first = self.byte(0);
        let second = self.byte(1);
        let (kind, length) = match (first, second) {
            (b'a'..=b'z' | b'A'..=b'Z' | b'_', _) => return self.word(),
            (b'0'..=b'9', _) => return self.number(),
            (b'"', _) => return self.string(error),
            (b'`', _) => return self.quoted(error),
            (b'-', b'>') => (Kind::Arrow, 2),
            (b':', b'=') => (Kind::Assign, 2),
            (b'.', b'.') => (Kind::Range, 2),
            (b'=', b'=') => (Kind::Equal, 2),
            (b'<', b'>') | (b'!', b'=') => (Kind::NotEqual, 2),
            (b'<', b'=') => (Kind::LessEqual, 2),
            (b'>', b'=') => (Kind::GreaterEqual, 2),
            (b'|', b'-') => (Kind::Yields, 2),
            (b'&', b'&') => return self.of_c(Kind::AndSign, 2, error),
            (b'|', b'|') => return self.of_c(Kind::OrSign, 2, error),
            (b'|', _) => return self.of_c(Kind::OrSign, 1, error),
            (b'!', _) => return self.of_c(Kind::NotSign, 1, error),
            (b'%', _) => return self.of_c(Kind::PercentSign, 1, error),
            (b'@', _) => (Kind::At, 1),
            (b'(', _) => (Kind::Open, 1),
            (b')', _) => (Kind::Close, 1),
            (b'{', _) => (Kind::OpenBrace, 1),
            (b'}', _) => (Kind::CloseBrace, 1),
            (b'[', _) => (Kind::OpenBracket, 1),
            (b']', _) => (Kind::CloseBracket, 1),
            (b',', _) => (Kind::Comma, 1),
            (b';', _) => (Kind::Semicolon, 1),
            (b':', _) => (Kind::Colon, 1),
            (b'.', _) => (Kind::Dot, 1),
            (b'&', _) => (Kind::Ampersand, 1),
            (b'+', _) => (Kind::Plus, 1),
            (b'-', _) => (Kind::Minus, 1),
            (b'*', _) => (Kind::Star, 1),
            (b'/', _) => (Kind::Slash, 1),
            (b'=', _) => (Kind::Equal, 1),
            (b'<', _) => (Kind::Less, 1),
            (b'>', _) => (Kind::Greater, 1),
            (0x80.., _) => return self.beyond_ascii(error),
            _ => return self.unknown(error),
        };
        self.at += length;
        kind
    }

    /// Reads a word: an identifier of UAX #31 that may begin with `_` and excludes the middle dot, which is an operator of Grafcet.
    fn word(&mut self) -> Kind {
        loop {
            match self.byte(0) {
                b'a'..=b'z' | b'A'..=b'Z' | b'_' | b'0'..=b'9' => self.at += 1,
                byte if byte >= 0x80 => match self.rest().chars().next() {
                    Some(c) if is_word_part(c) => self.at += c.len_utf8(),
                    _ => return Kind::Word,
                },
                _ => return Kind::Word,
            }
        }
    }

    fn number(&mut self) -> Kind {
        let digits = |lexer: &mut Self, accepts: fn(u8) -> bool| {
            while accepts(lexer.byte(0)) || lexer.byte(0) == b'_' {
                lexer.at += 1;
            }
        };
        match (self.byte(0), self.byte(1), self.byte(2)) {
            (b'0', b'x' | b'X', b'0'..=b'9' | b'a'..=b'f' | b'A'..=b'F') => {
                self.at += 2;
                digits(self, |b| b.is_ascii_hexdigit());
                return Kind::Number;
            }
            (b'0', b'b' | b'B', b'0' | b'1') => {
                self.at += 2;
                digits(self, |b| b == b'0' || b == b'1');
                return Kind::Number;
            }
            _ => digits(self, |b| b.is_ascii_digit()),
        }
        if self.byte(0) == b'.' && self.byte(1).is_ascii_digit() {
            self.at += 1;
            digits(self, |b| b.is_ascii_digit());
            return Kind::Fraction;
        }
        Kind::Number
    }

    fn string(&mut self, error: &mut dyn FnMut(LexError)) -> Kind {
        let start = self.at;
        if self.bytes[self.at..].starts_with(b"\"\"\"") {
            self.at += 3;
            match self.rest().find("\"\"\"") {
                Some(length) => self.at += length + 3,
                None => {
                    self.at = self.bytes.len();
                    error(LexError::Text(cut(start), cut(self.at)));
                }
            }
            return Kind::RawText;
        }
        self.at += 1;
        loop {
            match self.byte(0) {
                b'"' => {
                    self.at += 1;
                    return Kind::Text;
                }
                // A backslash escapes the next character, except a line break or the end of the text.
                b'\\' if self.at + 1 < self.bytes.len() && self.byte(1) != b'\n' => self.at += 2,
                b'\n' | 0 if self.byte(0) == b'\n' || self.at >= self.bytes.len() => {
                    error(LexError::Text(cut(start), cut(self.at)));
                    return Kind::Text;
                }
                _ => self.at += 1,
            }
        }
    }

    fn quoted(&mut self, error: &mut dyn FnMut(LexError)) -> Kind {
        let start = self.at;
        self.at += 1;
        loop {
            match self.byte(0) {
                b'`' => {
                    self.at += 1;
                    if self.at == start + 2 {
                        error(LexError::Name(cut(start), cut(self.at)));
                    }
                    return Kind::Quoted;
                }
                b'\n' | 0 if self.byte(0) == b'\n' || self.at >= self.bytes.len() => {
                    error(LexError::Name(cut(start), cut(self.at)));
                    return Kind::Quoted;
                }
                _ => self.at += 1,
            }
        }
    }

    /// Reads a C operator as the operator that it corresponds to, and reports an error.
    fn of_c(&mut self, kind: Kind, length: usize, error: &mut dyn FnMut(LexError)) -> Kind {
        let start = self.at;
        self.at += length;
        error(LexError::Operator(cut(start), cut(self.at)));
        kind
    }

    /// Reads a text between typographic quotes, up to the next double quote of any kind on the line.
    fn typeset_string(&mut self, error: &mut dyn FnMut(LexError)) -> Kind {
        let start = self.at;
        let line = &self.rest()[..memchr_newline(&self.bytes[start..])];
        if start >= self.quotes_until
            && let Some((at, last)) = line.char_indices().rfind(|(_, c)| is_typeset_quote(*c))
        {
            self.quotes_until = start + at + last.len_utf8();
            error(LexError::Quotes(cut(start), cut(self.quotes_until)));
        }
        let mut chars = line.char_indices().skip(1);
        self.at += chars
            .find(|(_, c)| *c == '"' || is_typeset_quote(*c))
            .map_or(line.len(), |(at, c)| at + c.len_utf8());
        Kind::Text
    }

    fn beyond_ascii(&mut self, error: &mut dyn FnMut(LexError)) -> Kind {
        let Some(c) = self.rest().chars().next() else { return Kind::End };
        let kind = match c {
            '·' | '⋅' => Kind::MiddleDot,
            '→' => Kind::Arrow,
            '↑' => Kind::Up,
            '↓' => Kind::Down,
            '≤' => Kind::LessEqual,
            '≥' => Kind::GreaterEqual,
            '≠' => Kind::NotEqual,
            '¬' => Kind::NotSign,
            '∧' => Kind::AndSign,
            '∨' => Kind::OrSign,
            _ if is_typeset_quote(c) => return self.typeset_string(error),
            _ if unicode_ident::is_xid_start(c) => return self.word(),
            _ => return self.unknown(error),
        };
        self.at += c.len_utf8();
        kind
    }

    /// Reads a run of unexpected characters of any length as one token with one error.
    fn unknown(&mut self, error: &mut dyn FnMut(LexError)) -> Kind {
        let start = self.at;
        for c in self.rest().chars() {
            let has_meaning = match c {
                '!' => self.byte(1) == b'=' && self.at > start,
                '|' => self.byte(1) == b'-' && self.at > start,
                _ => c.is_whitespace() || is_word_part(c) || KNOWN.contains(c),
            };
            if has_meaning && self.at > start {
                break;
            }
            self.at += c.len_utf8();
        }
        error(LexError::Character(cut(start), cut(self.at)));
        Kind::Unknown
    }
}

/// Whether `c` is a typographic double quote, which must be written `"`.
pub(crate) fn is_typeset_quote(c: char) -> bool {
    matches!(c, '“' | '”' | '„' | '‟' | '«' | '»')
}

/// First characters of tokens other than words, and the comment marker.
const KNOWN: &str = "\"`@(){}[],;:.&+-*/=<>#·⋅→↑↓≤≥≠¬∧∨“”„‟«»";

/// Whether `c` is allowed inside a word after its first letter.
pub(crate) fn is_word_part(c: char) -> bool {
    c != '·' && unicode_ident::is_xid_continue(c)
}

/// Whether `name` is a complete word and needs no backquotes. It may still be a keyword.
pub(crate) fn is_word(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c == '_' || unicode_ident::is_xid_start(c))
        && chars.all(is_word_part)
}

fn cut(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// Number of bytes before the next line break, or of all bytes if there is none.
fn memchr_newline(bytes: &[u8]) -> usize {
    bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> (Vec<Kind>, Vec<LexError>, Vec<(u32, u32)>) {
        let (mut lexer, mut kinds, mut errors, mut comments) =
            (Lexer::new(text), Vec::new(), Vec::new(), Vec::new());
        loop {
            let token = lexer.next(&mut |a, b| comments.push((a, b)), &mut |e| errors.push(e));
            if token.kind == Kind::End {
                return (kinds, errors, comments);
            }
            kinds.push(token.kind);
        }
    }

    #[test]
    fn signs_of_grafcet() {
        use Kind::*;
        let (kinds, errors, _) = kinds("a·/b + ↑c → d ≤ 1..2 1.5 <> := : -> -");
        assert_eq!(errors, []);
        let expected = [
            Word, MiddleDot, Slash, Word, Plus, Up, Word, Arrow, Word, LessEqual, Number, Range,
            Number, Fraction, NotEqual, Assign, Colon, Arrow, Minus,
        ];
        assert_eq!(kinds, expected);
    }

    #[test]
    fn words_are_unicode_and_may_be_quoted() {
        assert_eq!(
            kinds("é e\u{301} 步骤 _x x1 `and` `1 b`").0,
            [Kind::Word; 5].into_iter().chain([Kind::Quoted; 2]).collect::<Vec<_>>()
        );
        assert!(
            is_word("é")
                && is_word("_1")
                && !is_word("1")
                && !is_word("a.b")
                && !is_word("")
                && !is_word("a·b")
        );
    }

    #[test]
    fn comments_and_strings() {
        let (kinds_, errors, comments) = kinds("# one\r\n\"a \\\" # b\" \"\"\"c\n\"d\"\"\" # two");
        assert_eq!(kinds_, [Kind::Text, Kind::RawText]);
        assert_eq!((errors.len(), comments), (0, vec![(0, 5), (29, 34)]));
        assert_eq!(kinds("\"open\nx").1, [LexError::Text(0, 5)]);
        assert_eq!(kinds("\"\"\"open\nx").1, [LexError::Text(0, 9)]);
        assert_eq!(kinds("`open\nx ``").1, [LexError::Name(0, 5), LexError::Name(8, 10)]);
        assert_eq!(kinds("\"\\").1, [LexError::Text(0, 2)]);
    }

    #[test]
    fn a_run_of_unknown_characters_is_one_error() {
        assert_eq!(kinds("a ?!?$x !=").1, [LexError::Character(2, 6)]);
        assert_eq!(kinds("\u{0}\u{1}").1, [LexError::Character(0, 2)]);
    }
}
