//! Text in XML and HTML: every crate that writes a drawing or a page escapes names and comments with it.

/// A text as content or attribute of XML and HTML. Characters that XML does not allow, and those that change the direction of text, become U+FFFD.
///
/// ```
/// use grafsynth_ir::markup::escape;
/// assert_eq!(escape("a<b> & \"c\"\n\u{1}é"), "a&lt;b&gt; &amp; &quot;c&quot; \u{FFFD}é");
/// assert_eq!(escape("a\u{202E}b"), "a\u{FFFD}b");
/// ```
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            c if c.is_control()
                || matches!(c, '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}' | '\u{FFFE}' | '\u{FFFF}') =>
            {
                out.push('\u{FFFD}');
            }
            c => out.push(c),
        }
    }
    out
}
