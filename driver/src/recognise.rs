//! The words by which the language of a text is recognised.

/// A text, and the words at the start of its lines.
#[derive(Debug)]
pub(crate) struct Words<'t> {
    /// The whole text.
    pub(crate) all: &'t str,
    /// The text without comments.
    pub(crate) code: String,
    first: Vec<String>,
}

impl Words<'_> {
    pub(crate) fn of(text: &str) -> Words<'_> {
        let all = text.trim_start_matches('\u{feff}');
        let code = without_comments(all);
        let first = |line: &str| line.split_whitespace().next().map(str::to_owned);
        Words { all, first: code.lines().filter_map(first).collect(), code }
    }

    /// True if a line begins with one of the words.
    pub(crate) fn has(&self, words: &[&str]) -> bool {
        self.first.iter().any(|first| words.contains(&first.as_str()))
    }

    /// True if a line begins with the word, in upper or lower case.
    pub(crate) fn has_any_case(&self, word: &str) -> bool {
        self.first.iter().any(|first| first.eq_ignore_ascii_case(word))
    }

    /// True if the text begins with one of the words.
    pub(crate) fn begins(&self, words: &[&str]) -> bool {
        self.first.first().is_some_and(|first| words.contains(&first.as_str()))
    }
}

/// True if the first line that is not a comment names a GAL, as in GALasm.
pub(crate) fn names_a_gal(text: &str) -> bool {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with(';'));
    first.is_some_and(|line| {
        let word = line.split_whitespace().next().unwrap_or_default().to_ascii_uppercase();
        word.starts_with("GAL")
            && word.bytes().any(|byte| byte.is_ascii_digit())
            && !word.contains('=')
    })
}

/// A text without its comments, in any language: block comments of C, IEC and XML, and lines that start with `//`, `;` or `#` (except C directives).
fn without_comments(text: &str) -> String {
    let mut rest = text;
    let mut code = String::new();
    while let Some((at, close)) = [("/*", "*/"), ("(*", "*)"), ("<!--", "-->")]
        .into_iter()
        .filter_map(|(open, close)| Some((rest.find(open)?, close)))
        .min()
    {
        code += &rest[..at];
        code.push(' ');
        rest = rest[at..].split_once(close).map_or("", |(_, after)| after);
    }
    code += rest;
    let is_code = |line: &&str| {
        let line = line.trim_start();
        let is_directive = line.starts_with("#include") || line.starts_with("#define");
        !line.starts_with("//")
            && !line.starts_with(';')
            && (!line.starts_with('#') || is_directive)
    };
    code.lines().filter(is_code).flat_map(|line| [line, "\n"]).collect()
}
