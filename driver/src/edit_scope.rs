//! Where an edit of emitted C may be, so that the proof of the tree is a proof of the text that compilers see.
//!
//! The proof reads one way through the preprocessor, for one compiler, from one C file. An edit of a header, of a macro or of a directive can mean something else to
//! the callers of the chart, or to another compiler, and a new function or object can be used from outside. So the edit may only change the bodies of the
//! functions that `build` emitted in the C file, the numbers in the tables of an image, comments, and names of members of the instance. Everything else leaves the answer open.

use crate::c_proof::tables_of;
use grafsynth_backend_c::Package;
use grafsynth_c::tree::{ItemKind, SymbolKind, Unit};
use grafsynth_c::walk::each_item;
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

/// Checks that an edit is inside the scope of the proof. `texts` are the names and texts of the C file and of the files that it may
/// include, `emitted` is the package without edits, and
/// `edited` the package with the state of the map.
///
/// # Errors
/// The first place outside the scope.
pub(crate) fn within<'t>(
    texts: impl Iterator<Item = (&'t str, &'t str)>,
    emitted: &Package,
    edited: &Package,
) -> Result<(), String> {
    let renamed = renamed(emitted, edited);
    let main = format!("{}.c", emitted.stem());
    let tables = tables_of(emitted.stem());
    let original = |name: &str| emitted.files.iter().find(|file| file.name == name);
    for (at, (name, text)) in texts.enumerate() {
        let name = if at == 0 { &main } else { name };
        let Some(file) = original(name) else {
            return Err(format!("`{name}` is not a file that `build` emits"));
        };
        let wanted = with_names(&file.text, &renamed);
        plain_lines(text)?;
        if at == 0 {
            same_directives(&wanted, text)?;
            same_words(&wanted, text)?;
        } else if !emitted.image.is_empty() && *name == tables {
            same_directives(&wanted, text)?;
            only_numbers(&wanted, text)?;
        } else if lines(text) != lines(&wanted) {
            return Err(format!(
                "`{name}` differs from the emitted file, and other files include it"
            ));
        }
    }
    Ok(())
}

/// Checks that the tables of an image differ in numbers only. The declaration of the table decides in which memory a machine has it.
fn only_numbers(emitted: &str, edited: &str) -> Result<(), String> {
    let parts = |text: &str| {
        let text = lines(text).join("\n");
        let (before, rest) = text.split_once('{')?;
        let (numbers, after) = rest.rsplit_once('}')?;
        Some((before.to_owned(), numbers.to_owned(), after.to_owned()))
    };
    let is_number = |word: &str| word.starts_with(|it: char| it.is_ascii_digit());
    let is_list = |text: &str| {
        let mut words = text.split([',', ' ', '\t', '\n']).filter(|word| !word.is_empty());
        words.all(|word| is_number(word) && word.chars().all(|it| it.is_ascii_alphanumeric()))
    };
    match (parts(emitted), parts(edited)) {
        (Some((before, _, after)), Some((own, numbers, end)))
            if before == own && after == end && is_list(&numbers) =>
        {
            Ok(())
        }
        _ => Err("the tables differ in more than numbers".to_owned()),
    }
}

/// Checks that a unit has no function, object or type at file level that the emitted unit does not have.
///
/// # Errors
/// The first one.
pub(crate) fn same_items(emitted: &Unit, edited: &Unit) -> Result<(), String> {
    let names = |unit: &Unit| {
        let mut all: BTreeMap<String, usize> = BTreeMap::new();
        each_item(&unit.items, &mut |item| {
            if let ItemKind::Function { symbol, .. } = &item.kind {
                *all.entry(unit.symbols[*symbol].name.clone()).or_default() += 1;
            }
        });
        // Objects of the file and of functions: a new static object, or a constant table, is state or data that the emitted text does not have.
        let lasting = unit.symbols.values().filter(|symbol| {
            matches!(symbol.kind, SymbolKind::Object { .. } | SymbolKind::Local { is_static: true })
        });
        for symbol in lasting {
            *all.entry(symbol.name.clone()).or_default() += 1;
        }
        all
    };
    let (wanted, found) = (names(emitted), names(edited));
    match found.iter().find(|(name, n)| wanted.get(*name) != Some(n)) {
        Some((name, _)) => {
            Err(format!("`{name}` is not a function, object or table of the emitted C"))
        }
        None => Ok(()),
    }
}

/// The members of the instance whose names differ, with their new names.
fn renamed(emitted: &Package, edited: &Package) -> BTreeMap<String, String> {
    let state = |package: &Package| package.representation.clone().map(|hint| hint.state);
    let (Some(old), Some(new)) = (state(emitted), state(edited)) else { return BTreeMap::new() };
    let pairs = old.into_iter().zip(new).filter(|((_, a), (_, b))| a == b);
    pairs
        .map(|((old, _), (new, _))| (old.member, new.member))
        .filter(|(old, new)| old != new)
        .gather()
}

/// The lines of a text without comments, blanks at their ends, and empty lines.
fn lines(text: &str) -> Vec<String> {
    // In quotes, the marks of comments mean nothing; then the text is compared as it is.
    if text.contains(['"', '\'']) && text.lines().any(has_quoted_mark) {
        return text.lines().map(str::to_owned).collect();
    }
    let mut code = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("/*").into_iter().chain(rest.find("//")).min() {
        let (before, comment) = rest.split_at(at);
        code.push_str(before);
        let end = if comment.starts_with("/*") {
            code.push(' ');
            comment.get(2..).and_then(|it| it.find("*/")).map(|n| n + 4)
        } else {
            comment.find('\n')
        };
        rest = comment.get(end.unwrap_or(comment.len())..).unwrap_or_default();
    }
    code.push_str(rest);
    code.lines().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect()
}

/// True if a quotation mark and the mark of a comment are on one line.
fn has_quoted_mark(line: &str) -> bool {
    let code = line.split("/*").next().unwrap_or(line);
    let code = code.split("//").next().unwrap_or(code);
    code.len() < line.len() && code.contains(['"', '\''])
}

/// A text with other words in place of some words.
fn with_names(text: &str, renamed: &BTreeMap<String, String>) -> String {
    let mut all = String::with_capacity(text.len());
    let mut rest = text;
    while !rest.is_empty() {
        let is_word = |it: char| it.is_ascii_alphanumeric() || it == '_';
        let n = rest.find(|it| !is_word(it)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(n);
        all.push_str(renamed.get(word).map_or(word, String::as_str));
        let n = after.find(is_word).unwrap_or(after.len());
        let (other, after) = after.split_at(n);
        all.push_str(other);
        rest = after;
    }
    all
}

/// Checks that all lines with a `#`, outside of comments, are those of the emitted text.
fn same_directives(emitted: &str, edited: &str) -> Result<(), String> {
    let directives = |text: &str| -> Vec<String> {
        lines(text).into_iter().filter(|line| line.contains('#')).collect()
    };
    if directives(emitted) == directives(edited) {
        return Ok(());
    }
    Err("the lines with `#` differ from those of the emitted C".to_owned())
}

/// Checks that no line means something else to a compiler that knows other spellings, or joins lines.
fn plain_lines(text: &str) -> Result<(), String> {
    let text = text.replace("\r\n", "\n");
    let is_joined = text.lines().any(|line| line.trim_end().ends_with('\\'));
    let odd = ["??", "%:", "<:", ":>", "<%", "%>", "\r", "\u{b}", "\u{c}"];
    if is_joined || odd.iter().any(|it| text.contains(it)) {
        return Err(
            "the text has joined lines, digraphs, trigraphs or control characters".to_owned()
        );
    }
    Ok(())
}

/// Checks that the text uses no word of C or of an implementation that promises a compiler something which the proof does not check, unless the emitted text has it.
fn same_words(emitted: &str, edited: &str) -> Result<(), String> {
    const PROMISES: [&str; 6] = ["restrict", "inline", "volatile", "register", "asm", "extern"];
    let words = |text: &str| -> BTreeSet<String> {
        let all = text.split(|it: char| !(it.is_ascii_alphanumeric() || it == '_'));
        all.filter(|it| PROMISES.contains(it) || it.starts_with("__") || it.starts_with("_P"))
            .map(str::to_owned)
            .gather()
    };
    match words(edited).difference(&words(emitted)).next() {
        Some(word) => Err(format!("it uses `{word}`, which the emitted C does not use")),
        None => Ok(()),
    }
}
