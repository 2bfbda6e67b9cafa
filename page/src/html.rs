//! The file: one HTML document with its style, its scripts and its data, that may load nothing.

use grafsynth_ir::markup::escape;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;

const STYLE: &str = include_str!("page.css");
const ENGINE: &str = include_str!("engine.js");
const PAGE: &str = include_str!("page.js");
const BODY: &str = include_str!("body.html");

/// A part of a page that can be cut out of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// The script that executes the chart.
    Engine,
    /// The chart as JSON.
    Data,
}

/// The bytes of a part of a page that [`page`](crate::page) wrote; `None` for any other text.
#[must_use]
pub fn cut(page: &str, part: Cut) -> Option<&str> {
    let start = match part {
        Cut::Engine => "<script id=\"engine\">",
        Cut::Data => "<script id=\"data\" type=\"application/json\">",
    };
    let (_, rest) = page.split_once(start)?;
    rest.split_once("</script>").map(|(text, _)| text)
}

/// The document.
pub(crate) fn html(name: &str, data: &Value, drawing: Option<&str>) -> String {
    let data = embedded(data);
    let drawing = drawing.unwrap_or_default();
    let policy = format!(
        "default-src 'none'; script-src '{}' '{}'; style-src '{}'; base-uri 'none'; form-action 'none'",
        hash(ENGINE),
        hash(PAGE),
        hash(STYLE)
    );
    let name = escape(name);
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{name}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{}\
         <script id=\"data\" type=\"application/json\">{data}</script>\n<script id=\"engine\">{ENGINE}</script>\n<script id=\"page\">{PAGE}</script>\n</body>\n</html>\n",
        body(&name, drawing)
    );
    out
}

/// The content of the document; name and drawing are inserted once, so they cannot contain a place for the other.
fn body(name: &str, drawing: &str) -> String {
    let (head, tail) = BODY.split_once("{{drawing}}").unwrap_or((BODY, ""));
    format!("{}{drawing}{}", head.replace("{{name}}", name), tail)
}

/// JSON inside of a script element, which ends at the first `</script`: no sign `<` remains.
fn embedded(data: &Value) -> String {
    let text = data.to_string();
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' | '>' | '&' => {
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            // Signs that change the direction of text would also change how the source of the page looks.
            '\u{2028}'
            | '\u{2029}'
            | '\u{202A}'..='\u{202E}'
            | '\u{2066}'..='\u{2069}'
            | '\u{200E}'
            | '\u{200F}' => {
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out
}

/// The hash of a script or a style, as a source of a Content-Security-Policy.
fn hash(text: &str) -> String {
    let digest = Sha256::digest(text.as_bytes());
    format!("sha256-{}", base64(&digest))
}

fn base64(bytes: &[u8]) -> String {
    const SIGNS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for group in bytes.chunks(3) {
        let mut bits = 0;
        for at in 0..3 {
            bits = bits << 8 | u32::from(group.get(at).copied().unwrap_or(0));
        }
        for at in 0..4 {
            let sign = SIGNS[(bits >> (18 - 6 * at) & 63) as usize];
            out.push(if at <= group.len() { char::from(sign) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{base64, embedded};
    use serde_json::json;

    #[test]
    fn base64_of_each_remainder() {
        let known =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg==")];
        for (text, expected) in known {
            assert_eq!(base64(text.as_bytes()), expected);
        }
    }

    #[test]
    fn data_does_not_end_its_element() {
        let text = embedded(&json!({ "name": "</script><!--\u{202E}" }));
        assert!(!text.contains(['<', '>', '\u{202E}']), "{text}");
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&text).unwrap()["name"],
            "</script><!--\u{202E}"
        );
    }
}
