//! The identity of names: structured text does not distinguish capital and small letters.
//!
//! A name gets its [`Symbol`] once, where it is read. Everything after the parser compares, sorts and looks up symbols; only messages and the names of the
//! chart use the spelling. No other file of `st` or `plcopen` compares names or keywords without regard to case.

use std::borrow::Borrow;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use grafsynth_ir::{Name, Span};

/// The identity of a name or word: its text in capitals. A copy shares the text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Symbol(Arc<str>);

impl Symbol {
    /// The symbol of a name with this spelling.
    pub(crate) fn of(text: &str) -> Self {
        Symbol(text.to_uppercase().into())
    }

    /// The text in capitals.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

/// Whether a text spells a keyword or attribute, which is ASCII.
pub(crate) fn spells(text: &str, word: &str) -> bool {
    text.eq_ignore_ascii_case(word)
}

impl Deref for Symbol {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl Borrow<str> for Symbol {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl PartialEq<str> for Symbol {
    fn eq(&self, other: &str) -> bool {
        *self.0 == *other
    }
}

impl PartialEq<&str> for Symbol {
    fn eq(&self, other: &&str) -> bool {
        *self.0 == **other
    }
}

impl fmt::Display for Symbol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A name in the source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Ident {
    /// The text as it is written.
    pub(crate) text: String,
    pub(crate) span: Span,
    pub(crate) id: Symbol,
}

impl Ident {
    pub(crate) fn new(text: impl Into<String>, span: Span) -> Self {
        let text = text.into();
        Ident { id: Symbol::of(&text), text, span }
    }

    /// The name in the chart, as it is written.
    pub(crate) fn name(&self) -> Name {
        Name::new(self.text.as_str(), self.span)
    }
}

impl fmt::Display for Ident {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
