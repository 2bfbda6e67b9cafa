//! What a page contains besides its chart: the drawing, the source and the language.

use grafsynth_draw::Picture;
use grafsynth_ir::FileId;
use grafsynth_ir::plant::Plant;
use serde_json::{Map, Value};

/// The words of the interface in all languages: the one table that `web/words.js` reads, too.
pub(crate) const WORDS: &str = include_str!("web/words.json");

/// What a page contains besides its chart. By default nothing, in English.
#[derive(Debug, Clone, Copy, Default)]
pub struct Contents<'a> {
    /// The drawing; without one, the page has a list of steps instead.
    pub picture: Option<&'a Picture>,
    /// The texts from which the chart was read; the page shows those that contain steps or transitions.
    pub sources: &'a [SourceText<'a>],
    /// The plant of the chart, which the page shows and runs.
    pub plant: Option<&'a Plant>,
    /// The language of the interface when the page is opened.
    pub language: Language,
}

/// A text from which a chart was read.
#[derive(Debug, Clone, Copy)]
pub struct SourceText<'a> {
    /// Its number in the spans of the net.
    pub file: FileId,
    /// Its name, as the page shows it.
    pub name: &'a str,
    /// The text.
    pub text: &'a str,
}

/// A language of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Language {
    /// English.
    #[default]
    En,
    /// French.
    Fr,
    /// German.
    De,
    /// Spanish.
    Es,
    /// Portuguese.
    Pt,
}

impl Language {
    /// All languages, in the order of the table.
    pub const ALL: [Language; 5] =
        [Language::En, Language::Fr, Language::De, Language::Es, Language::Pt];

    /// The tag of the language, such as `fr`.
    #[must_use]
    pub fn tag(self) -> &'static str {
        match self {
            Language::En => "en",
            Language::Fr => "fr",
            Language::De => "de",
            Language::Es => "es",
            Language::Pt => "pt",
        }
    }
}

/// A word of the table in a language; empty if there is none, which a test excludes.
pub(crate) fn word(key: &str, language: Language) -> String {
    let table: Value = serde_json::from_str(WORDS).unwrap_or_default();
    let at = Language::ALL.iter().position(|one| *one == language).unwrap_or_default();
    table[key][at].as_str().unwrap_or_default().to_owned()
}

/// The table as a text of JavaScript: a line for each word, with its key and the languages in order, and `|` between two of them. It takes less space than the
/// JSON.
pub(crate) fn words_of_script() -> String {
    let table: Map<String, Value> = serde_json::from_str(WORDS).unwrap_or_default();
    let line = |(key, words): (&String, &Value)| {
        let words = words.as_array().into_iter().flatten().filter_map(Value::as_str);
        [key.as_str()].into_iter().chain(words).collect::<Vec<_>>().join("|")
    };
    let lines: Vec<String> = table.iter().map(line).collect();
    Value::from(lines.join("\n")).to_string()
}

#[cfg(test)]
mod tests {
    use super::{Language, WORDS, word};
    use crate::html::{BODY, ENGINE, PARTS, START, WITH_PLANT, WITHOUT_PLANT};
    use serde_json::{Map, Value};
    use std::collections::BTreeSet;

    fn table() -> Map<String, Value> {
        serde_json::from_str(WORDS).expect("the table is JSON")
    }

    /// The scripts and the document.
    fn texts() -> impl Iterator<Item = &'static str> {
        let plant = [WITH_PLANT, WITHOUT_PLANT];
        let plant = plant.into_iter().flat_map(|it| [it.body, it.engine, it.scene]);
        PARTS.into_iter().chain(ENGINE).chain([START, BODY]).chain(plant)
    }

    /// The texts that follow a mark, up to a quote.
    fn after<'a>(text: &'a str, mark: &'a str) -> impl Iterator<Item = &'a str> {
        text.split(mark).skip(1).filter_map(|rest| rest.split('"').next())
    }

    /// The names in braces.
    fn places(text: &str) -> BTreeSet<&str> {
        text.split('{').skip(1).filter_map(|rest| rest.split('}').next()).collect()
    }

    #[test]
    fn every_word_is_in_every_language_with_the_same_places() {
        for (key, words) in &table() {
            let words: Vec<&str> = words
                .as_array()
                .expect("a list")
                .iter()
                .map(|it| it.as_str().expect("a text"))
                .collect();
            assert_eq!(words.len(), Language::ALL.len(), "`{key}`");
            for word in &words {
                assert!(!word.trim().is_empty(), "`{key}` is empty in a language");
                assert!(!word.contains('|'), "`{key}` has the sign between two words");
                assert_eq!(places(word), places(words[0]), "`{key}`: {word}");
            }
        }
        assert_eq!(word("steps", Language::Fr), "Étapes");
    }

    #[test]
    fn the_table_has_what_a_page_uses_and_nothing_else() {
        let table = table();
        for text in texts() {
            for mark in
                ["word(\"", "phrase(\"", "problem(\"", "note(\"", "data-word=\"", "data-name=\""]
            {
                for key in after(text, mark) {
                    assert!(table.contains_key(key), "{mark}{key}\" is not in the table");
                }
            }
        }
        // The keys of the kinds of steps and of the states of transitions are computed; that of the document without scripts is in Rust.
        let is_computed =
            |key: &str| key.starts_with("kind-") || key.starts_with("state-") || key == "noScript";
        for key in table.keys().filter(|key| !is_computed(key)) {
            let quoted = format!("\"{key}\"");
            assert!(texts().any(|text| text.contains(&quoted)), "`{key}` is not used");
        }
        for key in ["fired", "ready", "enabled", "near", "waits"].map(|it| format!("state-{it}")) {
            assert!(table.contains_key(&key), "{key}");
        }
        for key in
            ["step", "enclosing", "state", "parallel", "final"].map(|it| format!("kind-{it}"))
        {
            assert!(table.contains_key(&key), "{key}");
        }
    }
}
