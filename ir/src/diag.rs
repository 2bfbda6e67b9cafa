//! Diagnostics: one type for every crate. Only the command line renders it.

use crate::span::Span;

/// A stable name such as `G0103`; `grafsynth explain G0103` prints its page. Each crate lists its codes in a `codes` module.
///
/// Ranges: `G00` settings of the tool and files, `G01` the chart language's syntax, `G02` names, types and lowering, `G03` invariants of a net and
/// its text form, `G04` rules text, `G05` stimuli and traces, `G06` C, `G07` logic and programmable devices, `G08` properties, facts and proofs,
/// `G09` engines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code {
    /// `G` and four digits.
    pub id: &'static str,
    /// The title of the code: a few words, the heading of its page.
    pub title: &'static str,
}

/// Proof that an error was reported: the error type of a pass that reports findings itself and continues at the next place where it can resume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorReported;

/// The severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The design is rejected.
    Error,
    /// The design is accepted, but probably not as intended.
    Warning,
    /// Additional information.
    Note,
}

/// A source location and what is wrong or relevant there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Source location.
    pub span: Span,
    /// The description of what is wrong or relevant there; may be empty if the message is sufficient.
    pub text: String,
}

/// The notation of a design, so that the help can use its words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Notation {
    /// The chart language, and all notations that use its words.
    Graf,
    /// Rules text.
    Rules,
    /// SCXML.
    Scxml,
    /// Structured text and PLCopen XML.
    Iec,
    /// C.
    C,
}

/// An edit that fixes the finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fix {
    /// The text to replace.
    pub span: Span,
    /// The new text.
    pub replacement: String,
}

/// The wording that combines several findings of one kind, which differ only in the object that they name: `inputs i4, i5 and i6 are never used`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plural {
    /// The object that this finding names, as written in its message: `i4`.
    pub item: String,
    /// The words before the list of objects: `inputs`.
    pub before: String,
    /// The words after the list: `are never used`.
    pub after: String,
}

/// One finding: what is wrong in the user's terms, where, and what to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The kind of finding.
    pub code: Code,
    /// The severity of the finding.
    pub severity: Severity,
    /// The problem, with names and numbers; begins with a small letter and has no full stop.
    pub message: String,
    /// The first one is the primary location. Empty only if there is no source.
    pub labels: Vec<Label>,
    /// The next action for the user.
    pub help: Option<String>,
    /// The help in the words of other notations, where they differ from the chart language.
    pub help_in: Vec<(Notation, String)>,
    /// An edit that carries out the help.
    pub fix: Option<Fix>,
    /// How this finding is combined with others that have the same wording and help. Findings with the same message are combined even without it.
    pub plural: Option<Plural>,
}

impl Diagnostic {
    /// An error without a location so far.
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Error, message)
    }

    /// A warning without a location so far.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Warning, message)
    }

    /// A note without a location so far.
    pub fn note(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Note, message)
    }

    fn new(code: Code, severity: Severity, message: impl Into<String>) -> Self {
        Diagnostic {
            code,
            severity,
            message: with_short_words(message.into()),
            labels: Vec::new(),
            help: None,
            help_in: Vec::new(),
            fix: None,
            plural: None,
        }
    }

    /// Adds a label.
    #[must_use]
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: with_short_words(text.into()) });
        self
    }

    /// Sets the help text.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(with_short_words(text.into()));
        self
    }

    /// An error about something that exists twice: the spans of the second and of the first one.
    #[must_use]
    pub fn twice(
        code: Code,
        message: impl Into<String>,
        [again, first]: [Span; 2],
        help: impl Into<String>,
    ) -> Self {
        Self::error(code, message).at(again, "again here").at(first, "first here").help(help)
    }

    /// Sets the help text for an unknown name at `span`: the known name `near` it, which is also the fix, or `otherwise`.
    #[must_use]
    pub fn near(
        self,
        span: Span,
        near: Option<impl Into<String>>,
        otherwise: impl Into<String>,
    ) -> Self {
        match near.map(Into::into) {
            Some(near) => self.help(format!("did you mean `{near}`?")).fix(span, near),
            None => self.help(otherwise),
        }
    }

    /// Labels an unknown word: the known word `near` it, which is also the fix, or "unknown here" with a help text.
    #[must_use]
    pub fn unknown_word(
        self,
        span: Span,
        near: Option<&str>,
        otherwise: impl Into<String>,
    ) -> Self {
        match near {
            Some(near) => self.at(span, format!("did you mean `{near}`?")).fix(span, near),
            None => self.at(span, "unknown here").help(otherwise),
        }
    }

    /// Sets the help text for one notation.
    #[must_use]
    pub fn help_in(mut self, notation: Notation, text: impl Into<String>) -> Self {
        self.help_in.push((notation, with_short_words(text.into())));
        self
    }

    /// Selects the help text for one notation.
    #[must_use]
    pub fn spoken(mut self, notation: Notation) -> Self {
        let found = self.help_in.iter().find(|(one, _)| *one == notation);
        if let Some((_, text)) = found {
            self.help = Some(text.clone());
        }
        self.help_in.clear();
        self
    }

    /// Sets an edit that fixes the finding.
    #[must_use]
    pub fn fix(mut self, span: Span, replacement: impl Into<String>) -> Self {
        self.fix = Some(Fix { span, replacement: replacement.into() });
        self
    }

    /// Sets the wording for several findings of this kind: `before` and `after` surround the list of objects, and `item` is the object that this finding
    /// names.
    #[must_use]
    pub fn plural(
        mut self,
        item: impl std::fmt::Display,
        before: impl Into<String>,
        after: impl Into<String>,
    ) -> Self {
        let (item, before, after) = (item.to_string(), before.into(), after.into());
        self.plural = Some(Plural { item, before, after });
        self
    }

    /// True for an error.
    #[must_use]
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// The items as a list in a sentence: `a, b and c` with the word `and`.
#[must_use]
pub fn joined(items: &[impl AsRef<str>], word: &str) -> String {
    let all: Vec<&str> = items.iter().map(AsRef::as_ref).collect();
    match all.split_last() {
        Some((last, before)) if !before.is_empty() => {
            format!("{} {word} {last}", before.join(", "))
        }
        _ => all.concat(),
    }
}

/// The longest word of a finding, in bytes. Longer ones are names in broken files, where one "name" can be the whole file.
const LONGEST_WORD: usize = 200;

/// The text with each word that is longer than [`LONGEST_WORD`] cut and ended with `…`.
fn with_short_words(text: String) -> String {
    if text.len() <= LONGEST_WORD {
        return text;
    }
    let mut short = String::new();
    for word in text.split_inclusive(char::is_whitespace) {
        if word.len() <= LONGEST_WORD {
            short.push_str(word);
            continue;
        }
        let end = (0..=LONGEST_WORD).rev().find(|at| word.is_char_boundary(*at)).unwrap_or(0);
        short.push_str(&word[..end]);
        short.push('…');
        if word.trim_end().ends_with('`') {
            short.push('`');
        }
        short.extend(word.chars().next_back().filter(|last| last.is_whitespace()));
    }
    short
}

/// A duration of `ns` nanoseconds in the chart language, in the largest unit that needs no fraction: `1500 ms`.
#[must_use]
pub fn duration(ns: u64) -> String {
    const UNITS: [(u64, &str); 6] = [
        (3_600_000_000_000, "h"),
        (60_000_000_000, "min"),
        (1_000_000_000, "s"),
        (1_000_000, "ms"),
        (1_000, "us"),
        (1, "ns"),
    ];
    if ns == 0 {
        return "0 s".to_owned();
    }
    let fits = UNITS.iter().find(|(unit, _)| ns.is_multiple_of(*unit));
    fits.map_or_else(String::new, |(unit, word)| format!("{} {word}", ns / unit))
}

/// A number with the word for what it counts: `1 state`, `2 states`.
pub fn counted<N: std::fmt::Display + PartialEq + From<u8>>(n: N, one: &str, many: &str) -> String {
    let word = if n == N::from(1) { one } else { many };
    format!("{n} {word}")
}

/// True if at least one of them is an error.
#[must_use]
pub fn any_error(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(Diagnostic::is_error)
}

/// The candidate nearest to `word` in edit distance (insert, delete, replace, swap of neighbours; a difference in case counts half), if it is a likely typing
/// error. The distance must be at most a third of the word's length, but one edit is always allowed. A candidate that shares no letter with `word` never
/// matches, nor does one that differs only in its digits: `s2` and `s1` are different steps.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_of(word, candidates, |candidate| !differs_in_digits(word, candidate))
}

/// Like [`nearest`], but the candidate may differ only in its digits, as types of chips do: `gal22v10` for `gal22v11`.
pub fn nearest_type<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    nearest_of(word, candidates, |_| true)
}

/// The nearest of the likely candidates for which `may_be` is true; this is checked last, only for the few that are near.
fn nearest_of<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
    may_be: impl Fn(&str) -> bool,
) -> Option<&'a str> {
    let wanted: Vec<char> = word.chars().collect();
    let budget = (wanted.len().max(3) / 3) * 2;
    candidates
        .into_iter()
        .filter(|candidate| candidate.chars().count().abs_diff(wanted.len()) * 2 <= budget)
        .filter(|candidate| *candidate != word && shares_a_letter(&wanted, candidate))
        .map(|candidate| (distance(&wanted, &candidate.chars().collect::<Vec<_>>()), candidate))
        .filter(|(distance, candidate)| *distance <= budget && may_be(candidate))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// True if some letter of `candidate` occurs in `word`, ignoring case.
fn shares_a_letter(word: &[char], candidate: &str) -> bool {
    let mut letters = candidate.chars().filter(|c| c.is_alphanumeric());
    letters.any(|c| word.iter().any(|own| is_same_letter(*own, c)))
}

/// True if the two letters are equal except for their case.
fn is_same_letter(a: char, b: char) -> bool {
    // The tables of Unicode are slow, and names are nearly always ASCII.
    let is_ascii = a.is_ascii() && b.is_ascii();
    if is_ascii { a.eq_ignore_ascii_case(&b) } else { a.to_lowercase().eq(b.to_lowercase()) }
}

/// True if the two names differ only in their digits.
fn differs_in_digits(word: &str, candidate: &str) -> bool {
    let digits = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<String>();
    let others = |text: &str| {
        text.chars()
            .filter(|c| !c.is_ascii_digit())
            .flat_map(char::to_lowercase)
            .collect::<String>()
    };
    digits(word) != digits(candidate) && others(word) == others(candidate)
}

/// Twice the optimal string alignment distance, with 1 for a change of letter case.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in rows.iter_mut().enumerate() {
        row[0] = 2 * i;
    }
    for (j, cell) in rows[0].iter_mut().enumerate() {
        *cell = 2 * j;
    }
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let change = if a[i - 1] == b[j - 1] {
                0
            } else if is_same_letter(a[i - 1], b[j - 1]) {
                1
            } else {
                2
            };
            let mut best =
                (rows[i - 1][j - 1] + change).min(rows[i - 1][j] + 2).min(rows[i][j - 1] + 2);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 2);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::{joined, nearest, nearest_type, with_short_words};

    #[test]
    fn the_last_item_of_a_list_follows_a_word() {
        assert_eq!(joined(&["a", "b", "c"], "and"), "a, b and c");
        assert_eq!(joined(&["a", "b"], "or"), "a or b");
        assert_eq!(joined(&["a"], "and"), "a");
        assert_eq!(joined(&[""; 0], "and"), "");
    }

    #[test]
    fn long_words_of_a_finding_are_cut() {
        let same = "a short text".to_owned();
        assert_eq!(with_short_words(same.clone()), same);
        let lines = format!("first {}\nsecond", "x".repeat(500));
        assert_eq!(with_short_words(lines), format!("first {}…\nsecond", "x".repeat(200)));
        let name = format!("`{}` is unknown", "x".repeat(500));
        assert_eq!(with_short_words(name), format!("`{}…` is unknown", "x".repeat(199)));
        let wide = format!("a{}", "é".repeat(500));
        assert_eq!(with_short_words(wide), format!("a{}…", "é".repeat(99)));
    }

    #[test]
    fn nearest_finds_slips_and_nothing_far() {
        assert_eq!(nearest("loda", ["load", "limit", "m"]), Some("load"));
        assert_eq!(nearest("M", ["m", "n"]), Some("m"));
        assert_eq!(nearest("request", ["a", "b"]), None);
        assert_eq!(nearest("b", ["L", "R"]), None);
        assert_eq!(nearest(".z", [".i", ".o"]), None);
        assert_eq!(nearest("s2", ["s1", "s10"]), None);
        assert_eq!(nearest("srv2", ["src2"]), Some("src2"));
        assert_eq!(nearest_type("gal22v11", ["pal22v10", "gal22v10"]), Some("gal22v10"));
    }
}
