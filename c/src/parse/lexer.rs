//! Text to preprocessing tokens (C99 5.1.1.2, 6.4). Comments and spliced line ends are white space.

use grafsynth_ir::{FileId, Span};
use std::collections::BTreeMap;

/// The kinds of tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TokenKind {
    /// An identifier or a keyword.
    Word,
    /// A number (C99 6.4.8): digits, letters and dots.
    Number,
    /// A character constant with its quotes.
    Character,
    /// A string literal with its quotes.
    String,
    /// An operator or punctuator.
    Sign,
    /// Something that cannot be part of a program; the preprocessor may still remove it.
    Stray(Stray),
    /// A block of user code that is not read; `text` is the code.
    Opaque,
    /// A standard header that was included; `text` is its name.
    Header,
    /// The end of the text.
    End,
}

/// Why a token cannot be part of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stray {
    Character,
    Unterminated,
    Comment,
    Trigraph,
    Splice,
}

impl Stray {
    pub(crate) fn message(self) -> &'static str {
        match self {
            Stray::Character => "unexpected character",
            Stray::Unterminated => "the closing quotation mark is missing on this line",
            Stray::Comment => "the comment is not closed",
            Stray::Trigraph => "trigraphs are not supported",
            Stray::Splice => "a backslash ends a line within a word",
        }
    }
}

/// A token. Copies are cheap: its text is part of the source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Token<'a> {
    pub(crate) kind: TokenKind,
    pub(crate) text: &'a str,
    /// The location of the token; for a token from a macro, the location of the macro's use.
    pub(crate) span: Span,
    /// The macros that this token does not invoke again: the index of a hide set in [`super::macros`].
    pub(crate) hidden: u32,
    /// True for the first token of a line.
    pub(crate) starts_line: bool,
    /// True if white space precedes the token.
    pub(crate) has_space: bool,
}

impl Token<'_> {
    /// True if the token is this operator or punctuator.
    pub(crate) fn is(&self, sign: &str) -> bool {
        self.kind == TokenKind::Sign && self.text == sign
    }

    /// True if the token is this word.
    pub(crate) fn is_word(&self, word: &str) -> bool {
        self.kind == TokenKind::Word && self.text == word
    }
}

/// The length of the longest operator or punctuator at the start of a text (C99 6.4.6). Digraphs are rejected where they occur, because the two characters of a
/// digraph are a syntax error as separate tokens.
fn sign(rest: &[u8]) -> Option<usize> {
    match rest {
        [b'<', b'<', b'=', ..] | [b'>', b'>', b'=', ..] | [b'.', b'.', b'.', ..] => Some(3),
        [first, b'=', ..] if b"<>=!*/%+-&^|".contains(first) => Some(2),
        [first, second, ..] if first == second && b"+-<>&|#".contains(first) => Some(2),
        [b'-', b'>', ..] => Some(2),
        [first, ..] if b"[](){}.&*+-~!/%<>^|?:;=,#".contains(first) => Some(1),
        _ => None,
    }
}

/// The blocks of user code that are not read, by their first line.
#[derive(Debug, Default)]
pub(crate) struct Verbatim<'a> {
    by_first_line: BTreeMap<&'a str, Vec<&'a str>>,
}

impl<'a> Verbatim<'a> {
    pub(crate) fn new(texts: &[&'a str]) -> Self {
        let mut by_first_line: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for text in texts {
            if let Some(first) = text.lines().next() {
                let all = by_first_line.entry(first.trim()).or_default();
                if !all.contains(text) {
                    all.push(text);
                }
            }
        }
        Verbatim { by_first_line }
    }

    /// The text in the block whose opening brace precedes `rest`, and the number of bytes up to and including its closing brace.
    fn find(&self, rest: &str) -> Option<(&'a str, usize)> {
        if self.by_first_line.is_empty() {
            return None;
        }
        let (blank, body) = rest.split_once('\n')?;
        if !blank.trim().is_empty() {
            return None;
        }
        let first = body.split_once('\n').map_or(body, |(first, _)| first);
        let candidates = self.by_first_line.get(first.trim())?;
        candidates.iter().find_map(|text| {
            let mut lines = body.split_inclusive('\n');
            let mut length = blank.len() + 1;
            for wanted in text.lines() {
                let line = lines.next()?;
                if line.trim() != wanted.trim() {
                    return None;
                }
                length += line.len();
            }
            let last = lines.next()?;
            let indent = last.len() - last.trim_start().len();
            last.trim_start().starts_with('}').then_some((*text, length + indent + 1))
        })
    }
}

/// The tokens of a file. The last one is [`TokenKind::End`].
pub(crate) fn lex<'a>(file: FileId, text: &'a str, verbatim: &Verbatim<'a>) -> Vec<Token<'a>> {
    let mut lexer = Lexer { text, at: 0, starts_line: true, has_space: false };
    let mut tokens = Vec::new();
    loop {
        let stray = lexer.skip_space();
        let start = lexer.at;
        let (kind, text) = match stray {
            Some((stray, from)) => (TokenKind::Stray(stray), &text[from.min(start)..start]),
            None => lexer.token(verbatim),
        };
        let span = Span::new(file, lexer.at.min(start), lexer.at);
        let Lexer { starts_line, has_space, .. } = lexer;
        tokens.push(Token { kind, text, span, hidden: 0, starts_line, has_space });
        if kind == TokenKind::End {
            return tokens;
        }
        (lexer.starts_line, lexer.has_space) = (false, false);
    }
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    starts_line: bool,
    has_space: bool,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Skips white space and comments. If a comment is not closed, returns the error and the position at which it begins.
    fn skip_space(&mut self) -> Option<(Stray, usize)> {
        loop {
            match &self.text.as_bytes()[self.at..] {
                [b'\n', ..] => {
                    self.starts_line = true;
                    self.at += 1;
                }
                [b' ' | b'\t' | b'\r' | b'\x0b' | b'\x0c', ..] => self.at += 1,
                [b'\\', ..] => self.at += splice(self.rest())?,
                [b'/', b'/', ..] => self.line_comment(),
                [b'/', b'*', ..] => {
                    let from = self.at;
                    let Some(end) = self.text[from + 2..].find("*/") else {
                        self.at = self.text.len();
                        return Some((Stray::Comment, from));
                    };
                    self.at += end + 4;
                }
                _ => return None,
            }
            self.has_space = true;
        }
    }

    /// Skips a comment to the end of its line; after a backslash, the comment continues on the next line.
    fn line_comment(&mut self) {
        while let Some(length) = self.rest().find('\n') {
            let line = &self.rest()[..length];
            let goes_on = line.ends_with('\\') || line.ends_with("\\\r");
            self.at += length;
            if !goes_on {
                return;
            }
            self.at += 1;
        }
        self.at = self.text.len();
    }

    fn token(&mut self, verbatim: &Verbatim<'a>) -> (TokenKind, &'a str) {
        let rest = self.rest();
        let Some(first) = rest.chars().next() else { return (TokenKind::End, "") };
        if first.is_ascii_alphabetic() || first == '_' {
            let length = rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
            // A word must not continue after a spliced line end, because a compiler would join both parts.
            let glued =
                splice(&rest[length..]).is_some_and(|it| rest[length + it..].starts_with(is_word));
            let kind = if glued { TokenKind::Stray(Stray::Splice) } else { TokenKind::Word };
            return self.take(kind, length);
        }
        let second = rest[first.len_utf8()..].chars().next();
        if first.is_ascii_digit() || first == '.' && second.is_some_and(|c| c.is_ascii_digit()) {
            return self.take(TokenKind::Number, number(rest));
        }
        if first == '"' || first == '\'' {
            return self.quoted(first);
        }
        if rest.starts_with("??")
            && rest[2..].starts_with(['=', '/', '\'', '(', ')', '!', '<', '>', '-'])
        {
            return self.take(TokenKind::Stray(Stray::Trigraph), 3);
        }
        if first == '{'
            && let Some((text, length)) = verbatim.find(&rest[1..])
        {
            self.at += 1 + length;
            return (TokenKind::Opaque, text);
        }
        match sign(rest.as_bytes()) {
            Some(length) => self.take(TokenKind::Sign, length),
            None => self.take(TokenKind::Stray(Stray::Character), first.len_utf8()),
        }
    }

    fn take(&mut self, kind: TokenKind, length: usize) -> (TokenKind, &'a str) {
        let text = &self.rest()[..length];
        self.at += length;
        (kind, text)
    }

    fn quoted(&mut self, quote: char) -> (TokenKind, &'a str) {
        let rest = self.rest();
        let mut is_escaped = false;
        for (at, c) in rest.char_indices().skip(1) {
            match c {
                '\n' => break,
                _ if is_escaped => is_escaped = false,
                '\\' => is_escaped = true,
                _ if c == quote => {
                    let kind = if quote == '"' { TokenKind::String } else { TokenKind::Character };
                    return self.take(kind, at + 1);
                }
                _ => {}
            }
        }
        let length = rest.find('\n').unwrap_or(rest.len());
        self.take(TokenKind::Stray(Stray::Unterminated), length)
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The length of a spliced line end (C99 5.1.1.2p1, phase 2).
fn splice(rest: &str) -> Option<usize> {
    let after = rest.strip_prefix('\\')?;
    if after.starts_with('\n') {
        Some(2)
    } else if after.starts_with("\r\n") {
        Some(3)
    } else {
        None
    }
}

/// The length of a preprocessing number (C99 6.4.8).
fn number(rest: &str) -> usize {
    let mut last = ' ';
    for (at, c) in rest.char_indices() {
        let is_sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E' | 'p' | 'P');
        if !(is_word(c) || c == '.' || is_sign) {
            return at;
        }
        last = c;
    }
    rest.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str, verbatim: &[&str]) -> Vec<String> {
        lex(FileId(0), text, &Verbatim::new(verbatim))
            .iter()
            .map(|token| {
                if let TokenKind::Stray(stray) = token.kind {
                    format!("{stray:?}")
                } else if token.kind == TokenKind::Opaque {
                    format!("<{}>", token.text)
                } else {
                    token.text.to_owned()
                }
            })
            .collect()
    }

    #[test]
    fn tokens_are_the_longest_possible() {
        let text = "a+++b>>=0x1FU/**/c//x\\\ny\nd\\\n'\\''..5";
        let expected = ["a", "++", "+", "b", ">>=", "0x1FU", "c", "d", "'\\''", ".", ".5", ""];
        assert_eq!(words(text, &[]), expected);
        assert_eq!(
            words("a ??/ 'x\n é /* ", &[])[1..],
            ["Trigraph", "Unterminated", "Character", "Comment", ""]
        );
        assert_eq!(words("ab\\\ncd", &[]), ["Splice", "cd", ""]);
    }

    #[test]
    fn text_of_the_user_is_one_token() {
        let user = "x = 'unbalanced;\n#if 0";
        let text = format!("a {{\n    x = 'unbalanced;  \n  #if 0\n }} b {{ {user}");
        assert_eq!(words(&text, &[user])[..4], ["a", &format!("<{user}>"), "b", "{"]);
        assert_eq!(words("{\n  y;\n}", &["y", "z"])[0], "{");
    }
}
