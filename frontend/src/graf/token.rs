//! Tokens of the chart language.

/// Reserved words that join two operands.
pub(crate) const INFIX: &[&str] = &["and", "or", "mod", "band", "bor", "bxor", "shl", "shr"];

/// The target of a transition that activates no step, unless a step has this name.
pub(crate) const SINK: &str = "sink";

/// A token: its kind and its byte range. It takes 12 bytes, so lookahead is cheap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Token {
    /// The kind of token.
    pub(crate) kind: Kind,
    /// Whether a line break precedes the token.
    pub(crate) new_line: bool,
    /// Offset of the first byte.
    pub(crate) start: u32,
    /// Offset after the last byte.
    pub(crate) end: u32,
}

/// Kinds of tokens. Keywords are not distinguished from names here, because the language reserves very few words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An identifier or a keyword.
    Word,
    /// A name in backquotes, which is never a keyword.
    Quoted,
    /// `12`, `0x1f`, `0b101`.
    Number,
    /// `1.5`; only durations use it.
    Fraction,
    /// `"text"`.
    Text,
    /// `"""text"""`, without escapes.
    RawText,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `{`
    OpenBrace,
    /// `}`
    CloseBrace,
    /// `[`
    OpenBracket,
    /// `]`
    CloseBracket,
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// `:`
    Colon,
    /// `:=`
    Assign,
    /// `.`
    Dot,
    /// `..`
    Range,
    /// `->` or `→`
    Arrow,
    /// `&`
    Ampersand,
    /// `+`
    Plus,
    /// `-`
    Minus,
    /// `*`
    Star,
    /// `·` or `⋅`
    MiddleDot,
    /// `/`
    Slash,
    /// `=` or `==`
    Equal,
    /// `<>`, `!=` or `≠`
    NotEqual,
    /// `<`
    Less,
    /// `<=` or `≤`
    LessEqual,
    /// `>`
    Greater,
    /// `>=` or `≥`
    GreaterEqual,
    /// `↑`
    Up,
    /// `↓`
    Down,
    /// `¬`
    NotSign,
    /// `∧`
    AndSign,
    /// `∨`
    OrSign,
    /// `%`, which is reported.
    PercentSign,
    /// `|-`, used in rules text.
    Yields,
    /// `@`, used in rules text.
    At,
    /// An unexpected character, reported when it was read.
    Unknown,
    /// The end of the text.
    End,
}
