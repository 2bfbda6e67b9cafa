//! The parser: its state, and the functions that all its parts share.
//!
//! Recursive descent over the token list. The parser reports every error and continues at the next statement, declaration or unit.

use std::collections::BTreeSet;

use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, ErrorReported};

use super::ast::Refusal;
use super::lexer::{Kind, LexError, Places, Token, Tokens, tokens};
use super::symbol::{Ident, Symbol, spells};
use crate::codes;
use crate::findings::Findings;

pub(crate) type Parse<T> = Result<T, ErrorReported>;

/// Words that end a list of statements.
const ENDS: &[&str] = &[
    "END_IF",
    "ELSE",
    "ELSIF",
    "END_CASE",
    "END_FOR",
    "END_WHILE",
    "END_REPEAT",
    "UNTIL",
    "END_ACTION",
    "END_STEP",
    "END_TRANSITION",
    "END_PROGRAM",
    "END_FUNCTION",
    "END_FUNCTION_BLOCK",
    "END_VAR",
    "END_CONFIGURATION",
    "END_RESOURCE",
    "END_TYPE",
    "PROGRAM",
    "FUNCTION",
    "FUNCTION_BLOCK",
    "CONFIGURATION",
    "ACTION",
    "INITIAL_STEP",
    "STEP",
    "TRANSITION",
];

/// Keywords that exist only in the text of a chart.
const OF_CHARTS: &[&str] = &[
    "PROGRAM",
    "FUNCTION",
    "FUNCTION_BLOCK",
    "CONFIGURATION",
    "ACTION",
    "INITIAL_STEP",
    "STEP",
    "TRANSITION",
];

pub(crate) struct Parser<'a> {
    pub(crate) text: &'a str,
    pub(crate) places: Places<'a>,
    pub(crate) list: Tokens,
    pub(crate) at: usize,
    pub(crate) findings: &'a mut Findings,
    /// Unsupported features in the current unit. They are kept separate, because the unit may turn out to be unused.
    pub(crate) refused: Vec<Refusal>,
    pub(crate) depth: u32,
    /// Height of the syntax tree of the last expression; at most `limit`.
    pub(crate) height: u32,
    pub(crate) limit: u32,
    /// Whether the text is a single body, in which the keywords of charts are names.
    pub(crate) is_body: bool,
    /// Names whose declarations have syntax errors.
    pub(crate) lost: BTreeSet<Symbol>,
}

impl<'a> Parser<'a> {
    /// Creates a parser at the start of `text`. Reports text that is not a token.
    pub(crate) fn new(
        text: &'a str,
        places: Places<'a>,
        findings: &'a mut Findings,
        limit: u32,
    ) -> Self {
        let list = tokens(text);
        let mut parser = Parser {
            text,
            places,
            list,
            at: 0,
            findings,
            refused: Vec::new(),
            depth: 0,
            height: 0,
            limit,
            is_body: false,
            lost: BTreeSet::new(),
        };
        for error in std::mem::take(&mut parser.list.errors) {
            match error {
                LexError::Character(start, end) => {
                    let span = places.span(start, end);
                    let shown = text.get(start..end).unwrap_or("").escape_debug().to_string();
                    parser.findings.report(|| {
                        Diagnostic::error(
                            codes::ST_CHARACTER,
                            format!("unexpected character `{shown}` in structured text"),
                        )
                        .at(span, "")
                        .help(match shown.as_str() {
                            "“" | "”" | "„" | "‘" | "’" | "\\u{201c}" | "\\u{201d}" => {
                                "write a straight quote `'`"
                            }
                            _ => "remove it, or put it into a comment: (* .. *)",
                        })
                    });
                }
                LexError::Foreign(start, end, instead) => {
                    let span = places.span(start, end);
                    let shown = text.get(start..end).unwrap_or("").to_owned();
                    // A word needs space around it; a sign does not.
                    let is_free = |at: Option<char>| at.is_none_or(char::is_whitespace);
                    let is_word = instead.bytes().all(|byte| byte.is_ascii_alphabetic());
                    let before = text.get(..start).and_then(|part| part.chars().next_back());
                    let after = text.get(end..).and_then(|part| part.chars().next());
                    let left =
                        if is_word && !is_free(before) && before != Some('(') { " " } else { "" };
                    let right = if is_word && !is_free(after) { " " } else { "" };
                    parser.findings.report(|| {
                        Diagnostic::error(
                            codes::ST_CHARACTER,
                            format!("structured text has no operator `{shown}`"),
                        )
                        .at(span, "an operator of C")
                        .help(format!("write `{instead}`"))
                        .fix(span, format!("{left}{instead}{right}"))
                    });
                }
                LexError::Unclosed(start, end, what) => {
                    let span = places.span(start, end);
                    parser.findings.report(|| {
                        Diagnostic::error(codes::ST_CHARACTER, format!("this {what} is not closed"))
                            .at(span, "begins here")
                            .help(match text.get(start..start + 1) {
                                Some("(") => "write `*)` at its end",
                                Some("/") => "write `*/` at its end",
                                Some("{") => "write `}` at its end",
                                Some("\"") => "write `\"` at its end",
                                _ => "write `'` at its end",
                            })
                    });
                }
            }
        }
        parser
    }

    // Tokens

    pub(crate) fn peek(&self, ahead: usize) -> Token {
        let last = self.list.tokens.len().saturating_sub(1);
        let end = Token { kind: Kind::End, start: self.text.len(), end: self.text.len() };
        self.list.tokens.get((self.at + ahead).min(last)).copied().unwrap_or(end)
    }

    pub(crate) fn kind(&self, ahead: usize) -> Kind {
        self.peek(ahead).kind
    }

    pub(crate) fn slice(&self, token: Token) -> &'a str {
        self.text.get(token.start..token.end).unwrap_or("")
    }

    /// The token that is `ahead` tokens after the current one, in capitals; empty if it is not a word.
    pub(crate) fn word(&self, ahead: usize) -> Symbol {
        let token = self.peek(ahead);
        Symbol::of(if token.kind == Kind::Word { self.slice(token) } else { "" })
    }

    pub(crate) fn is(&self, word: &str) -> bool {
        let token = self.peek(0);
        token.kind == Kind::Word && spells(self.slice(token), word)
    }

    pub(crate) fn advance(&mut self) -> Token {
        let token = self.peek(0);
        if token.kind != Kind::End {
            self.at += 1;
        }
        token
    }

    pub(crate) fn take(&mut self, kind: Kind) -> bool {
        let found = self.kind(0) == kind;
        if found {
            self.advance();
        }
        found
    }

    pub(crate) fn take_word(&mut self, word: &str) -> bool {
        let found = self.is(word);
        if found {
            self.advance();
        }
        found
    }

    pub(crate) fn span(&self, token: Token) -> Span {
        self.places.span(token.start, token.end)
    }

    pub(crate) fn here(&self) -> Span {
        self.span(self.peek(0))
    }

    /// The span from `start` to the end of the last consumed token.
    pub(crate) fn span_from(&self, start: usize) -> Span {
        let end = match self.at.checked_sub(1).and_then(|at| self.list.tokens.get(at)) {
            Some(last) => last.end.max(start),
            None => start,
        };
        self.places.span(start, end)
    }

    pub(crate) fn name_of(&self, token: Token) -> Ident {
        Ident::new(self.slice(token), self.span(token))
    }

    // Findings

    pub(crate) fn report(&mut self, make: impl FnOnce() -> Diagnostic) -> ErrorReported {
        self.findings.report(make);
        ErrorReported
    }

    /// The current token, as shown in messages.
    pub(crate) fn found(&self) -> String {
        match self.kind(0) {
            Kind::End => "the end of the text".to_owned(),
            _ => format!("`{}`", crate::graf::parser::short(self.slice(self.peek(0)))),
        }
    }

    pub(crate) fn expected(&mut self, what: &str) -> ErrorReported {
        let (span, found) = (self.here(), self.found());
        let is_end = self.kind(0) == Kind::End;
        let before = self.at.checked_sub(1).and_then(|at| self.list.tokens.get(at)).copied();
        let word = self.word(0);
        let opener = word.strip_prefix("END_").filter(|_| !word.is_empty()).map(str::to_owned);
        let finding =
            Diagnostic::error(codes::ST_UNEXPECTED, format!("expected {what}, found {found}"));
        let places = self.places;
        self.report(|| match before {
            // The `;` is missing after the previous token.
            Some(before) if what == "`;`" => finding
                .at(places.span(before.start, before.end), "expected `;` after this")
                .help("write `;`")
                .fix(places.span(before.end, before.end), ";"),
            _ if is_end => finding
                .at(span, format!("expected {what}"))
                .help(format!("write {what} at the end of the text")),
            _ => {
                let finding = finding.at(span, format!("expected {what}"));
                match opener {
                    Some(opener) if what.contains("statement") => finding
                        .help(format!("remove {found}, or write the `{opener}` that it closes")),
                    _ if what.contains(" or ") => {
                        finding.help(format!("write {what} before {found}, or remove {found}"))
                    }
                    _ => finding.help(format!("write {what} before {found}")),
                }
            }
        })
    }

    pub(crate) fn expect(&mut self, kind: Kind, what: &str) -> Parse<Token> {
        if self.kind(0) == kind { Ok(self.advance()) } else { Err(self.expected(what)) }
    }

    pub(crate) fn expect_word(&mut self, word: &str) -> Parse<()> {
        if self.take_word(word) { Ok(()) } else { Err(self.expected(&format!("`{word}`"))) }
    }

    pub(crate) fn name(&mut self, what: &str) -> Parse<Ident> {
        if self.kind(0) == Kind::Word && !self.is_reserved(&self.word(0)) {
            let token = self.advance();
            return Ok(self.name_of(token));
        }
        Err(self.expected(what))
    }

    /// Records an unsupported feature.
    pub(crate) fn refuse(&mut self, what: impl Into<String>, span: Span, help: &str) {
        // Further findings would not be shown; they are usually consequences of earlier ones.
        if self.refused.len() < 10_000 {
            let what: String = what.into();
            self.refused.push(Refusal::unsupported(&what, span, help));
        }
    }

    /// Increases the nesting depth for `inside`; an error if the limit is reached.
    pub(crate) fn deeper<T>(&mut self, inside: impl FnOnce(&mut Self) -> Parse<T>) -> Parse<T> {
        if self.depth >= self.limit {
            return Err(self.too_deep());
        }
        self.depth += 1;
        let result = inside(self);
        self.depth -= 1;
        result
    }

    /// Parses a nested statement or whole expression, which counts as two levels because it uses as much stack.
    pub(crate) fn inside<T>(&mut self, read: impl FnOnce(&mut Self) -> Parse<T>) -> Parse<T> {
        self.deeper(|parser| parser.deeper(read))
    }

    /// Reports that the nesting limit is exceeded here. A separate function, because the frame of the caller is on the stack once per
    /// level.
    pub(crate) fn too_deep(&mut self) -> ErrorReported {
        let (span, limit) = (self.here(), self.limit);
        self.report(|| {
            Diagnostic::error(codes::NESTING, format!("more than {limit} levels of nesting"))
                .at(span, "too deep here")
                .help("break it up, or raise the limit with --nesting-limit")
        })
    }

    /// Recovers from an error: skips past the next semicolon, or up to a word that ends a list or begins a unit.
    pub(crate) fn skip_statement(&mut self) {
        loop {
            match self.kind(0) {
                Kind::End => return,
                Kind::Semicolon => {
                    self.advance();
                    return;
                }
                Kind::Word if self.ends_list(&self.word(0)) => return,
                _ => {
                    self.advance();
                }
            }
        }
    }

    /// Recovers from an error in a statement that began at the token `start`: skips to its end, including the end of each list that it opened.
    pub(crate) fn skip_statement_from(&mut self, start: usize) {
        let depth = |token: Token, text: &str| match Symbol::of(text).as_str() {
            _ if token.kind != Kind::Word => 0,
            "IF" | "CASE" | "FOR" | "WHILE" | "REPEAT" => 1,
            "END_IF" | "END_CASE" | "END_FOR" | "END_WHILE" | "END_REPEAT" => -1,
            _ => 0,
        };
        let mut open: i32 = (start..self.at)
            .filter_map(|at| self.list.tokens.get(at))
            .map(|token| depth(*token, self.slice(*token)))
            .sum();
        while open > 0 {
            let (token, word) = (self.peek(0), self.word(0));
            let change = depth(token, self.slice(token));
            let is_outside = self.ends_list(&word)
                && change == 0
                && !matches!(word.as_str(), "ELSE" | "ELSIF" | "UNTIL");
            if token.kind == Kind::End || is_outside {
                return;
            }
            open += change;
            self.advance();
        }
        self.skip_statement();
    }

    /// Remembers that the declaration of the name at this token has an error.
    pub(crate) fn lose(&mut self, at: usize) {
        if let Some(token) = self.list.tokens.get(at)
            && token.kind == Kind::Word
        {
            let name = Symbol::of(self.slice(*token));
            self.lost.insert(name);
        }
    }

    /// Whether a list of statements ends here.
    pub(crate) fn at_end_of_list(&self) -> bool {
        self.kind(0) == Kind::End || self.ends_list(&self.word(0))
    }

    fn ends_list(&self, word: &str) -> bool {
        ENDS.contains(&word) && !(self.is_body && OF_CHARTS.contains(&word))
    }

    pub(super) fn is_reserved(&self, word: &str) -> bool {
        is_reserved(word) && !(self.is_body && OF_CHARTS.contains(&word))
    }

    /// The comment after the last consumed token, on the same line.
    pub(crate) fn label(&self) -> String {
        let Some(last) = self.at.checked_sub(1).and_then(|at| self.list.tokens.get(at)) else {
            return String::new();
        };
        let first = self.list.asides.partition_point(|aside| aside.from < last.end);
        let Some(aside) = self.list.asides.get(first) else { return String::new() };
        let between = self.text.get(last.end..aside.from).unwrap_or("\n");
        if aside.is_pragma || !between.bytes().all(|byte| matches!(byte, b' ' | b'\t')) {
            return String::new();
        }
        let text = self.text.get(aside.start..aside.end).unwrap_or("");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

/// Words that are never names.
pub(crate) fn is_reserved(word: &str) -> bool {
    ENDS.contains(&word)
        || matches!(
            word,
            "IF" | "THEN"
                | "CASE"
                | "OF"
                | "FOR"
                | "TO"
                | "BY"
                | "DO"
                | "WHILE"
                | "REPEAT"
                | "EXIT"
                | "RETURN"
                | "TRUE"
                | "FALSE"
                | "NOT"
                | "AND"
                | "OR"
                | "XOR"
                | "MOD"
                | "ARRAY"
                | "STRUCT"
                | "END_STRUCT"
                | "VAR"
                | "VAR_INPUT"
                | "VAR_OUTPUT"
                | "VAR_IN_OUT"
                | "VAR_GLOBAL"
                | "VAR_EXTERNAL"
                | "VAR_TEMP"
                | "AT"
        )
}
