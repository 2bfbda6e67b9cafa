//! The lexer: one token at a time.

use grafsynth_ir::span::{FileId, Span};

/// The comment syntax.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Comments {
    /// From `;` to the end of the line.
    Semicolon,
    /// `/* .. */`.
    Block,
    /// `/* .. */` and from `//` to the end of the line; attributes `(* .. *)` too.
    Verilog,
}

/// The kind of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Letters, digits, `_`, `$`, not starting with a digit.
    Word,
    /// Starting with a digit: letters and digits follow.
    Number,
    /// Anything else: one character or one of the long operators.
    Sign,
    /// Text in `'..'` or `".."`.
    Quoted,
    /// The end of the text.
    End,
}

/// A token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Token<'a> {
    pub(crate) kind: Kind,
    pub(crate) text: &'a str,
    /// The position where it starts.
    pub(crate) start: usize,
    /// True if it is the first on its line.
    pub(crate) is_first: bool,
}

impl Token<'_> {
    pub(crate) fn is(&self, sign: &str) -> bool {
        self.kind == Kind::Sign && self.text == sign
    }

    pub(crate) fn is_word(&self, word: &str) -> bool {
        self.kind == Kind::Word && self.text.eq_ignore_ascii_case(word)
    }

    /// The token as shown in a message.
    pub(crate) fn shown(&self) -> String {
        if self.kind == Kind::End {
            return "the end of the text".to_owned();
        }
        let cut: String = self.text.chars().take(30).collect();
        if cut.len() < self.text.len() { format!("`{cut}..`") } else { format!("`{cut}`") }
    }
}

/// Operators with more than one character.
const LONG: [&str; 12] = [":+:", ":*:", ":=", "*=", "<=", ">=", "==", "!=", "&&", "||", "~^", "^~"];

/// Reads tokens with one token of lookahead.
#[derive(Debug, Clone)]
pub(crate) struct Lexer<'a> {
    text: &'a str,
    file: FileId,
    comments: Comments,
    quotes: bool,
    at: usize,
    fresh_line: bool,
    /// The next token.
    pub(crate) token: Token<'a>,
    /// The end of the last token.
    pub(crate) end: usize,
}

impl<'a> Lexer<'a> {
    /// A lexer at the start of a text. If `quotes` is true, text in quotes is one token.
    pub(crate) fn new(text: &'a str, file: FileId, comments: Comments, quotes: bool) -> Self {
        Self::starting_at(text, file, comments, quotes, 0)
    }

    /// Like [`Lexer::new`], starting at a byte.
    pub(crate) fn starting_at(
        text: &'a str,
        file: FileId,
        comments: Comments,
        quotes: bool,
        at: usize,
    ) -> Self {
        let token = Token { kind: Kind::End, text: "", start: 0, is_first: true };
        let mut lexer = Lexer { text, file, comments, quotes, at, fresh_line: true, token, end: 0 };
        lexer.advance();
        lexer
    }

    /// The span of the token ahead.
    pub(crate) fn span(&self) -> Span {
        Span::new(self.file, self.token.start, self.token.start + self.token.text.len())
    }

    /// From `start` to the end of the last token.
    pub(crate) fn span_from(&self, start: usize) -> Span {
        Span::new(self.file, start, self.end.max(start))
    }

    /// Consumes the next token.
    pub(crate) fn advance(&mut self) -> Token<'a> {
        let token = self.token;
        self.end = token.start + token.text.len();
        self.token = self.scan();
        token
    }

    /// Consumes the next token if it is this operator.
    pub(crate) fn eat(&mut self, sign: &str) -> bool {
        let found = self.token.is(sign);
        if found {
            self.advance();
        }
        found
    }

    /// Consumes the next token if it is this word, not case-sensitive.
    pub(crate) fn eat_word(&mut self, word: &str) -> bool {
        let found = self.token.is_word(word);
        if found {
            self.advance();
        }
        found
    }

    /// A piece of the text.
    pub(crate) fn slice(&self, start: usize, end: usize) -> &'a str {
        self.text.get(start..end).unwrap_or_default()
    }

    /// The text up to a byte.
    pub(crate) fn upto(&self, end: usize) -> &'a str {
        self.text.get(..end).unwrap_or_default()
    }

    /// Skips to the first token of the next line.
    pub(crate) fn skip_line(&mut self) {
        while self.token.kind != Kind::End && !self.token.is_first {
            self.advance();
        }
    }

    /// The rest of the line from the next token on, without its comment; the token after it is then the next one.
    pub(crate) fn rest_of_line(&mut self) -> &'a str {
        let start = self.token.start;
        let rest = self.text.get(start..).unwrap_or_default();
        let length = rest.find(['\n', '\r']).unwrap_or(rest.len());
        let line = rest.get(..length).unwrap_or_default();
        self.at = start + length;
        self.end = self.at;
        self.token = self.scan();
        if self.comments == Comments::Semicolon {
            line.split(';').next().unwrap_or_default().trim()
        } else {
            line.trim()
        }
    }

    fn skip_blanks(&mut self) {
        loop {
            let rest = self.text.get(self.at..).unwrap_or_default();
            let Some(next) = rest.chars().next() else { return };
            if next == '\n' {
                self.fresh_line = true;
                self.at += 1;
            } else if next.is_whitespace() || next == '\u{feff}' || next == '\u{1a}' {
                self.at += next.len_utf8();
            } else if self.comments == Comments::Semicolon && next == ';'
                || self.comments == Comments::Verilog && rest.starts_with("//")
            {
                self.at += rest.find('\n').unwrap_or(rest.len());
            } else if self.comments != Comments::Semicolon && rest.starts_with("/*") {
                self.skip_block(rest, "*/");
            } else if self.comments == Comments::Verilog
                && rest.starts_with("(*")
                && !rest.starts_with("(*)")
            {
                self.skip_block(rest, "*)");
            } else {
                return;
            }
        }
    }

    fn skip_block(&mut self, rest: &str, close: &str) {
        let length =
            rest.get(2..).and_then(|inner| inner.find(close)).map_or(rest.len(), |at| at + 4);
        self.fresh_line |= rest.get(..length).is_some_and(|comment| comment.contains('\n'));
        self.at += length;
    }

    fn scan(&mut self) -> Token<'a> {
        self.skip_blanks();
        let is_first = self.fresh_line;
        self.fresh_line = false;
        let start = self.at;
        let rest = self.text.get(start..).unwrap_or_default();
        let Some(first) = rest.chars().next() else {
            return Token { kind: Kind::End, text: "", start, is_first: true };
        };
        let is_inner = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
        let (kind, length) = if first.is_ascii_alphabetic() || first == '_' {
            (Kind::Word, rest.find(|c| !is_inner(c)).unwrap_or(rest.len()))
        } else if first.is_ascii_digit() {
            (Kind::Number, rest.find(|c| !is_inner(c)).unwrap_or(rest.len()))
        } else if self.quotes && (first == '\'' || first == '"') {
            let inner = rest.get(1..).unwrap_or_default();
            // A quote that is not closed on its line is an operator.
            match inner.find([first, '\n']) {
                Some(at) if inner.as_bytes().get(at) != Some(&b'\n') => (Kind::Quoted, at + 2),
                _ => (Kind::Sign, 1),
            }
        } else {
            let long = LONG.iter().find(|sign| rest.starts_with(**sign));
            (Kind::Sign, long.map_or(first.len_utf8(), |sign| sign.len()))
        };
        self.at = start + length;
        Token { kind, text: rest.get(..length).unwrap_or_default(), start, is_first }
    }
}
