//! Tokens of the chart language.

/// A token: its kind and the bytes it covers. 12 bytes, so that looking ahead costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Token {
    /// What it is.
    pub(crate) kind: Kind,
    /// True when a line break lies between it and the token before it.
    pub(crate) new_line: bool,
    /// First byte.
    pub(crate) start: u32,
    /// One past the last byte.
    pub(crate) end: u32,
}

/// Kinds of tokens. Words are not told apart here: the language has hardly any reserved ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An identifier or a word of the language.
    Word,
    /// A name in backquotes, which is never a word of the language.
    Quoted,
    /// `12`, `0x1f`, `0b101`.
    Number,
    /// `1.5`, which only durations use.
    Fraction,
    /// `"text"`.
    Text,
    /// `"""text"""`, taken as it stands.
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
    /// `|-`, of rules text
    Yields,
    /// `@`, of rules text
    At,
    /// A character without a meaning; it was reported when it was read.
    Unknown,
    /// The end of the text.
    End,
}
