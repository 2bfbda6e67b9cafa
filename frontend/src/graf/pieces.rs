//! Writes single items of a chart as text, and splits such a text into words. A comparison of two charts uses both.

use super::lexer::Lexer;
use super::token::Kind;
use super::write::Writer;
use super::write_text::{Text, conditions};
use grafsynth_ir::chart::{Chart, Item, Library};

/// A token of a canonical text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Word {
    /// A name without its backquotes, or a keyword.
    Name(String),
    /// Any other token, as written.
    Sign(String),
}

/// Writes single items of one chart in the canonical form.
#[derive(Debug, Default)]
pub struct ItemWriter {
    text: Text,
}

impl ItemWriter {
    /// Creates a writer for a chart or library chart with these outermost items.
    #[must_use]
    pub fn new(items: &[Item]) -> Self {
        let mut text = Text::default();
        text.exprs.conditions = conditions(items);
        ItemWriter { text }
    }

    /// Writes an item with its contents, without a final line break. `is_region` means that its parent is a parallel state.
    #[must_use]
    pub fn item(&self, item: &Item, is_region: bool) -> String {
        self.with(|writer| {
            if let Item::State(state) = item {
                writer.state(state, is_region);
            } else {
                writer.item(item);
            }
        })
    }

    /// Writes a chart with its contents.
    #[must_use]
    pub fn chart(&self, chart: &Chart) -> String {
        self.with(|writer| writer.chart(chart))
    }

    /// Writes a library chart with its contents, without its certificate.
    #[must_use]
    pub fn library(&self, library: &Library) -> String {
        self.with(|writer| writer.library(library))
    }

    fn with(&self, write: impl FnOnce(&mut Writer<'_>)) -> String {
        let mut writer = Writer::bare(self.text.clone());
        write(&mut writer);
        writer.lines.render()
    }
}

/// The words of a canonical text, without line breaks and the `;` that replaces them, so that two layouts of the same items have the same
/// words.
#[must_use]
pub fn words(text: &str) -> Vec<Word> {
    let mut lexer = Lexer::new(text);
    let mut words = Vec::new();
    loop {
        let token = lexer.next(&mut |_, _| {}, &mut |_| {});
        let written = text.get(token.start as usize..token.end as usize).unwrap_or_default();
        if token.kind == Kind::End {
            return words;
        }
        if token.kind == Kind::Word || token.kind == Kind::Quoted {
            words.push(Word::Name(written.trim_matches('`').to_owned()));
        } else if token.kind != Kind::Semicolon {
            words.push(Word::Sign(written.to_owned()));
        }
    }
}
