//! Lexer for C99 and K&R. Every token has its byte span; comments and preprocessor lines are kept in separate lists.

use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{FileId, Span};

use crate::codes;
use crate::findings::Findings;

/// Kinds of tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A name or a keyword.
    Word,
    /// An integer, with its value and suffixes.
    Number { value: u64, is_unsigned: bool, n_long: u8, is_decimal: bool },
    /// A number with a decimal point or an exponent.
    Float,
    /// A character constant, with its value as `int`.
    Char(i64),
    /// A string.
    Text,
    /// An operator or punctuator of one to three characters.
    Sign,
    /// The end of the text.
    End,
}

/// A token with its span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) span: Span,
}

/// A preprocessor line, from `#` to the end of the (continued) line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) span: Span,
}

/// The result of the lexer.
#[derive(Debug, Default)]
pub(super) struct Lexed {
    /// The tokens; the last one is [`Kind::End`].
    pub(super) tokens: Vec<Token>,
    /// The comments with their delimiters, in source order.
    pub(super) comments: Vec<Span>,
    /// The preprocessor lines in source order.
    pub(super) lines: Vec<Line>,
}

/// The operators and punctuators of C, longest first.
const SIGNS: [&str; 45] = [
    "<<=", ">>=", "...", "->", "++", "--", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "*=",
    "/=", "%=", "+=", "-=", "&=", "^=", "|=", "[", "]", "(", ")", "{", "}", ".", "&", "*", "+",
    "-", "~", "!", "/", "%", "<", ">", "^", "|", "?", ":", ";", "=",
];

/// Lexes the bytes `range` of a text.
pub(super) fn lex(
    file: FileId,
    text: &str,
    range: std::ops::Range<usize>,
    is_unsigned_char: bool,
    findings: &mut Findings,
) -> Lexed {
    let end = range.end.min(text.len());
    let mut lexer = Lexer { file, text, at: range.start, end, is_unsigned_char, findings };
    let mut lexed = Lexed::default();
    while let Some(token) = lexer.token(&mut lexed) {
        lexed.tokens.push(token);
    }
    lexed.tokens.push(Token { kind: Kind::End, span: Span::new(file, end, end) });
    lexed
}

struct Lexer<'t, 'f> {
    file: FileId,
    text: &'t str,
    at: usize,
    end: usize,
    is_unsigned_char: bool,
    findings: &'f mut Findings,
}

impl Lexer<'_, '_> {
    fn byte(&self, ahead: usize) -> u8 {
        let at = self.at + ahead;
        if at < self.end { self.text.as_bytes()[at] } else { 0 }
    }

    fn span(&self, start: usize) -> Span {
        Span::new(self.file, start, self.at.min(self.end))
    }

    fn refuse(&mut self, span: Span, message: impl FnOnce() -> String, label: &str, help: &str) {
        self.findings.report(|| {
            Diagnostic::error(codes::C_CHARACTERS, message()).at(span, label).help(help)
        });
    }

    /// Reads to the end of a line; a backslash before the line break continues it.
    fn rest_of_line(&mut self, lexed: &mut Lexed) {
        while self.at < self.end && self.byte(0) != b'\n' {
            if self.byte(0) == b'/' && self.byte(1) == b'*' {
                self.comment(lexed);
                continue;
            }
            if self.byte(0) == b'/' && self.byte(1) == b'/' {
                return self.comment(lexed);
            }
            let is_continued = self.byte(0) == b'\\'
                && (self.byte(1) == b'\n' || (self.byte(1) == b'\r' && self.byte(2) == b'\n'));
            self.at += if is_continued { 2 + usize::from(self.byte(1) == b'\r') } else { 1 };
        }
    }

    fn comment(&mut self, lexed: &mut Lexed) {
        let start = self.at;
        let rest = &self.text.as_bytes()[start..self.end];
        if self.byte(1) == b'/' {
            self.at += rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        } else if let Some(length) = rest.windows(2).skip(2).position(|pair| pair == b"*/") {
            self.at += length + 4;
        } else {
            self.at = self.end;
            let open = Span::new(self.file, start, start + 2);
            self.refuse(
                open,
                || "unterminated comment".to_owned(),
                "begins here",
                "write `*/` at its end",
            );
        }
        lexed.comments.push(self.span(start));
    }

    fn token(&mut self, lexed: &mut Lexed) -> Option<Token> {
        let mut is_first = self.at == 0 || self.text.as_bytes().get(self.at - 1) == Some(&b'\n');
        loop {
            match self.byte(0) {
                _ if self.at >= self.end => return None,
                b'\n' => {
                    is_first = true;
                    self.at += 1;
                }
                b' ' | b'\t' | b'\r' | 0x0b | 0x0c => self.at += 1,
                b'\\' if matches!(self.byte(1), b'\n' | b'\r') => self.at += 1,
                b'/' if matches!(self.byte(1), b'*' | b'/') => self.comment(lexed),
                b'#' if is_first => {
                    let start = self.at;
                    self.rest_of_line(lexed);
                    lexed.lines.push(Line { span: self.span(start) });
                }
                _ => break,
            }
        }
        let start = self.at;
        let first = self.byte(0);
        let kind = match first {
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                while self.byte(0).is_ascii_alphanumeric() || self.byte(0) == b'_' {
                    self.at += 1;
                }
                Kind::Word
            }
            b'0'..=b'9' => self.number(start),
            b'.' if self.byte(1).is_ascii_digit() => self.number(start),
            b'\'' => self.character(start),
            b'"' => self.string(start),
            _ => {
                let rest = &self.text.as_bytes()[start..self.end];
                if let Some(sign) = SIGNS.iter().find(|sign| rest.starts_with(sign.as_bytes())) {
                    self.at += sign.len();
                    Kind::Sign
                } else if first == b',' {
                    self.at += 1;
                    Kind::Sign
                } else {
                    let letter = self.text[start..].chars().next().unwrap_or('?');
                    self.at += letter.len_utf8();
                    let span = self.span(start);
                    let help = match letter {
                        '“' | '”' | '„' => "write a straight quote `\"`",
                        '‘' | '’' => "write a straight quote `'`",
                        '–' | '—' | '−' => "write `-`",
                        _ => "remove it, or put it into a comment",
                    };
                    self.refuse(
                        span,
                        || format!("unexpected character {letter:?}"),
                        "not part of C",
                        help,
                    );
                    return self.token_behind(lexed);
                }
            }
        };
        Some(Token { kind, span: self.span(start) })
    }

    /// Reads the token after a run of unexpected characters, in a loop, so that a long run needs no stack.
    fn token_behind(&mut self, lexed: &mut Lexed) -> Option<Token> {
        while self.at < self.end {
            let byte = self.byte(0);
            if byte.is_ascii()
                && byte != b'$'
                && byte != b'@'
                && byte != b'`'
                && byte != b'\\'
                && byte != 0
                && byte != b'#'
                && (byte > 31 || byte.is_ascii_whitespace())
            {
                return self.token(lexed);
            }
            self.at += self.text[self.at..].chars().next().map_or(1, char::len_utf8);
        }
        None
    }

    fn number(&mut self, start: usize) -> Kind {
        let is_hex = self.byte(0) == b'0' && matches!(self.byte(1), b'x' | b'X');
        let mut is_float = false;
        while self.byte(0).is_ascii_alphanumeric() || matches!(self.byte(0), b'.' | b'_') {
            let byte = self.byte(0);
            is_float |= byte == b'.'
                || (!is_hex && matches!(byte, b'e' | b'E'))
                || (is_hex && matches!(byte, b'p' | b'P'));
            let is_exponent =
                if is_hex { matches!(byte, b'p' | b'P') } else { matches!(byte, b'e' | b'E') };
            self.at += 1;
            if is_exponent && matches!(self.byte(0), b'+' | b'-') {
                self.at += 1;
            }
        }
        if is_float {
            return Kind::Float;
        }
        let word = &self.text[start..self.at];
        let digits = word.trim_end_matches(['u', 'U', 'l', 'L']);
        let suffix = &word[digits.len()..];
        let (radix, digits) = if is_hex {
            (16, digits.get(2..).unwrap_or(""))
        } else if let Some(binary) = digits.strip_prefix("0b") {
            (2, binary)
        } else if digits.len() > 1 && digits.starts_with('0') {
            (8, &digits[1..])
        } else {
            (10, digits)
        };
        let n_unsigned = suffix.bytes().filter(|byte| byte.eq_ignore_ascii_case(&b'u')).count();
        let n_long = suffix.len() - n_unsigned;
        let value = match u64::from_str_radix(digits, radix) {
            Ok(value) if n_unsigned <= 1 && n_long <= 2 => value,
            _ => {
                let span = self.span(start);
                let word = word.to_owned();
                self.refuse(
                    span,
                    || format!("`{word}` is not a valid C number"),
                    match radix {
                        8 => "a leading 0 makes the number octal, so only the digits 0 to 7 are allowed",
                        _ => "expected digits and an optional suffix such as `u` or `L`",
                    },
                    "write digits only, as in 15, 0x0F or 017; a name begins with a letter",
                );
                0
            }
        };
        let n_long = u8::try_from(n_long).unwrap_or(2);
        Kind::Number { value, is_unsigned: n_unsigned > 0, n_long, is_decimal: radix == 10 }
    }

    /// Reads one character of a constant or string, starting at the backslash or the character itself; `None` at the end of the line.
    fn escaped(&mut self) -> Option<i64> {
        let byte = self.byte(0);
        if self.at >= self.end || byte == b'\n' {
            return None;
        }
        if byte != b'\\' {
            let letter = self.text[self.at..].chars().next()?;
            self.at += letter.len_utf8();
            return Some(i64::from(u32::from(letter)));
        }
        let start = self.at;
        self.at += 2;
        Some(match self.text.as_bytes().get(start + 1).copied().unwrap_or(0) {
            b'n' => 10,
            b't' => 9,
            b'r' => 13,
            b'v' => 11,
            b'b' => 8,
            b'f' => 12,
            b'a' => 7,
            sign @ (b'\\' | b'\'' | b'"' | b'?') => i64::from(sign),
            b'x' => {
                let mut value: i64 = 0;
                while self.byte(0).is_ascii_hexdigit() {
                    value = (value * 16
                        + i64::from((self.byte(0) as char).to_digit(16).unwrap_or(0)))
                        & 0xff;
                    self.at += 1;
                }
                value
            }
            digit @ b'0'..=b'7' => {
                let mut value = i64::from(digit - b'0');
                for _ in 0..2 {
                    if matches!(self.byte(0), b'0'..=b'7') {
                        value = value * 8 + i64::from(self.byte(0) - b'0');
                        self.at += 1;
                    }
                }
                value & 0xff
            }
            _ => {
                self.at = start + 1;
                let letter =
                    self.text.get(self.at..).and_then(|rest| rest.chars().next()).unwrap_or('?');
                self.at = (self.at + letter.len_utf8()).min(self.end);
                let span = self.span(start);
                let help = format!("write `\\\\` for a backslash, or `{letter}` alone");
                self.refuse(span, || format!("unknown escape `\\{letter}`"), "", &help);
                0
            }
        })
    }

    fn character(&mut self, start: usize) -> Kind {
        self.at += 1;
        let value = if self.byte(0) == b'\'' { None } else { self.escaped() };
        if self.byte(0) == b'\'' && self.at < self.end {
            self.at += 1;
        } else {
            while self.at < self.end && !matches!(self.byte(0), b'\'' | b'\n') {
                self.at += self.text[self.at..].chars().next().map_or(1, char::len_utf8);
            }
            if self.byte(0) == b'\'' {
                self.at += 1;
            }
            let span = self.span(start);
            let written = self.text.get(start + 1..self.at).unwrap_or_default();
            let is_closed = written.ends_with('\'');
            let n = written.trim_end_matches('\'').chars().count();
            let label = match (is_closed, n) {
                (false, _) => "no closing `'`".to_owned(),
                (true, 0) => "no character".to_owned(),
                (true, n) => format!("{n} characters"),
            };
            let help = if is_closed && n > 1 {
                "write one character, as in 'a', or a string in double quotes"
            } else {
                "write one character between two quotes, as in 'a'"
            };
            self.refuse(
                span,
                || "a character constant must contain one character and end with '".to_owned(),
                &label,
                help,
            );
        }
        let value = value.unwrap_or(0);
        Kind::Char(if value > 127 && value < 256 && !self.is_unsigned_char {
            value - 256
        } else {
            value
        })
    }

    fn string(&mut self, start: usize) -> Kind {
        self.at += 1;
        while self.byte(0) != b'"' || self.at >= self.end {
            if self.escaped().is_none() {
                let span = self.span(start);
                self.refuse(
                    span,
                    || "unterminated string".to_owned(),
                    "no closing quote on this line",
                    "write `\"` at its end",
                );
                return Kind::Text;
            }
        }
        self.at += 1;
        Kind::Text
    }
}

/// The characters of a string token, without quotes, with escapes resolved, and without the terminating 0.
pub(super) fn characters(
    file: FileId,
    text: &str,
    span: Span,
    findings: &mut Findings,
) -> Vec<i64> {
    let range = span.range();
    let end = range.end.saturating_sub(usize::from(
        text[range.clone()].len() > 1 && text[range.clone()].ends_with('"'),
    ));
    let mut lexer =
        Lexer { file, text, at: range.start + 1, end, is_unsigned_char: false, findings };
    let mut all = Vec::new();
    while let Some(value) = lexer.escaped() {
        // A string consists of bytes; a character above U+00FF counts as its UTF-8 bytes.
        match u32::try_from(value).ok().and_then(char::from_u32) {
            Some(letter) if value > 255 => {
                let mut buffer = [0; 4];
                all.extend(
                    letter
                        .encode_utf8(&mut buffer)
                        .bytes()
                        .map(|byte| i64::from(i8::from_ne_bytes([byte]))),
                );
            }
            _ => all.push(if value > 127 { value - 256 } else { value }),
        }
    }
    all
}
