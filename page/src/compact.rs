//! Scripts and styles without what only their readers need: indentation, empty lines, comments, and blanks beside signs. A page is small, and its lines are
//! still those of the source.

/// Signs that need no blank beside them.
const SIGNS: &str = "{}()[]<>=+-*/%!?:;,|&^";

/// A script. Its texts, templates and regular expressions stay as they are; a comment has lines of its own.
pub(crate) fn script(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // Templates in which the reader is, each with the number of braces that are open in its expression.
    let mut templates: Vec<usize> = Vec::new();
    for line in text.lines().map(str::trim_start) {
        if templates.is_empty() && (line.is_empty() || line.starts_with("//")) {
            continue;
        }
        let start = out.len();
        code(line, &mut out, start, &mut templates);
        out.push('\n');
    }
    out
}

/// One line of a script; `start` is where it begins in `out`.
fn code(line: &str, out: &mut String, start: usize, templates: &mut Vec<usize>) {
    let mut rest = line;
    while let Some(c) = rest.chars().next() {
        let after = &rest[c.len_utf8()..];
        let length = match c {
            '"' | '\'' => quoted(rest, c),
            '`' => {
                out.push(c);
                rest = template(after, out, templates);
                continue;
            }
            '}' if templates.last() == Some(&0) => {
                templates.pop();
                out.push(c);
                rest = template(after, out, templates);
                continue;
            }
            '/' if begins_expression(&out[start..]) => expression(rest),
            ' ' => {
                let next = after.chars().next();
                let last = out[start..].chars().next_back();
                if is_needed(last, next) {
                    out.push(' ');
                }
                rest = after;
                continue;
            }
            '{' | '}' => {
                if let Some(open) = templates.last_mut() {
                    *open = if c == '{' { *open + 1 } else { open.saturating_sub(1) };
                }
                1
            }
            c => c.len_utf8(),
        };
        let (part, left) = rest.split_at(length);
        out.push_str(part);
        rest = left;
    }
}

/// Whether a blank between two signs separates them.
fn is_needed(last: Option<char>, next: Option<char>) -> bool {
    let (Some(last), Some(next)) = (last, next) else { return false };
    let is_sign = |c: char| SIGNS.contains(c);
    // `a - -b` and `a + +b` are not `a --b` and `a ++b`.
    last == ' ' || last == next && "+-/".contains(next) || !(is_sign(last) || is_sign(next))
}

/// The length of a text in quotes.
fn quoted(text: &str, quote: char) -> usize {
    ended(text, |c| c == quote)
}

/// The length of a regular expression with its slashes: a slash in brackets does not end it.
fn expression(text: &str) -> usize {
    let mut is_class = false;
    ended(text, |c| {
        match c {
            '[' => is_class = true,
            ']' => is_class = false,
            _ => {}
        }
        c == '/' && !is_class
    })
}

/// The length up to the sign that ends what the first sign began; a backslash protects the sign after it.
fn ended(text: &str, mut is_end: impl FnMut(char) -> bool) -> usize {
    let mut is_protected = false;
    for (at, c) in text.char_indices().skip(1) {
        if !is_protected && is_end(c) {
            return at + c.len_utf8();
        }
        is_protected = c == '\\' && !is_protected;
    }
    text.len()
}

/// Copies the text of a template up to its end or its next expression, and returns what follows.
fn template<'t>(text: &'t str, out: &mut String, templates: &mut Vec<usize>) -> &'t str {
    let mut is_protected = false;
    let mut last = ' ';
    for (at, c) in text.char_indices() {
        let is_expression = last == '$' && c == '{';
        if !is_protected && (c == '`' || is_expression) {
            if is_expression {
                templates.push(0);
            }
            let end = at + c.len_utf8();
            out.push_str(&text[..end]);
            return &text[end..];
        }
        is_protected = c == '\\' && !is_protected;
        last = c;
    }
    out.push_str(text);
    ""
}

/// Whether a slash after this text begins a regular expression and is not a division.
fn begins_expression(before: &str) -> bool {
    let before = before.trim_end();
    before.ends_with("return")
        || before.chars().next_back().is_none_or(|c| "{(,=:[!&|?;>".contains(c))
}

/// A style. Its texts stay as they are.
pub(crate) fn style(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.lines().map(str::trim_start) {
        if line.is_empty() || line.starts_with("/*") {
            continue;
        }
        let mut is_text = false;
        let mut signs = line.chars().peekable();
        while let Some(c) = signs.next() {
            is_text ^= c == '"';
            let last = out.chars().next_back();
            let is_needless = c == ' '
                && !is_text
                && (last.is_some_and(|c| "{};:,".contains(c))
                    || signs.peek().is_some_and(|c| "{}".contains(*c)));
            if is_needless {
                continue;
            }
            // The last declaration of a rule needs no semicolon.
            if c == '}' && !is_text && last == Some(';') {
                out.pop();
            }
            out.push(c);
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{script, style};

    #[test]
    fn blanks_in_texts_stay() {
        for (text, expected) in [
            (
                "    const a = b - -c;\n\n// x = y\n  f(a, `x = ${ g({ a: \"} = `\" }) } = y`);",
                "const a=b- -c;\nf(a,`x = ${g({a:\"} = `\"})} = y`);\n",
            ),
            ("return / = [/ ] /.test(a) / b / c;", "return/ = [/ ] /.test(a)/b/c;\n"),
            (
                "case \"a = \\\" b\": return typeof x in y;",
                "case \"a = \\\" b\":return typeof x in y;\n",
            ),
            ("`${a ? `b = ${ c }` : \"d\"} = e` + f", "`${a?`b = ${c}`:\"d\"} = e`+f\n"),
            ("a = (b) / 2 + '/ = ';", "a=(b)/2+'/ = ';\n"),
        ] {
            assert_eq!(script(text), expected, "{text}");
        }
    }

    #[test]
    fn a_style_keeps_its_selectors() {
        assert_eq!(
            style("/* x */\n  a :not(b) > c, d { font: 1px \"A { B\"; margin: 0 1px; }\n"),
            "a :not(b) > c,d{font:1px \"A { B\";margin:0 1px}\n"
        );
    }
}
