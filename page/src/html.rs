//! The file: one HTML document with its style, its scripts and its data, that may load nothing.

use crate::compact;
use crate::contents::{Language, word, words_of_script};
use grafsynth_ir::markup::escape;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;

const STYLE: &str = include_str!("web/page.css");
pub(crate) const BODY: &str = include_str!("web/body.html");
/// The parts of the script that shows the chart. They are one function, so a part can use what another one declares. The plant follows, and then the start.
pub(crate) const PARTS: [&str; 12] = [
    include_str!("web/basics.js"),
    include_str!("web/words.js"),
    include_str!("web/chart.js"),
    include_str!("web/source.js"),
    include_str!("web/lists.js"),
    include_str!("web/panel.js"),
    include_str!("web/breaks.js"),
    include_str!("web/wave.js"),
    include_str!("web/files.js"),
    include_str!("web/links.js"),
    include_str!("web/keep.js"),
    include_str!("web/page.js"),
];
pub(crate) const START: &str = include_str!("web/start.js");
/// The parts of the script that executes the chart.
pub(crate) const ENGINE: [&str; 2] =
    [include_str!("web/engine.js"), include_str!("web/session.js")];

/// What depends on whether the chart has a plant.
pub(crate) struct PlantFiles {
    style: &'static str,
    /// The part of the document.
    pub(crate) body: &'static str,
    /// The part of the script that executes the chart.
    pub(crate) engine: &'static str,
    /// The part of the script that shows the chart.
    pub(crate) scene: &'static str,
}

/// Of a page with a plant.
pub(crate) const WITH_PLANT: PlantFiles = PlantFiles {
    style: include_str!("web/plant.css"),
    body: include_str!("web/plant.html"),
    engine: include_str!("web/plant.js"),
    scene: include_str!("web/scene.js"),
};
/// Of a page without one.
pub(crate) const WITHOUT_PLANT: PlantFiles =
    PlantFiles { style: "", body: "", engine: "", scene: include_str!("web/no_scene.js") };

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

/// A drawing as it is embedded in a page.
pub(crate) struct Drawing {
    /// The element `svg`.
    pub(crate) svg: String,
    /// The number of marks.
    pub(crate) n_marks: usize,
}

/// A drawing with more marks than this is hidden until the script of the page displays the part in sight.
const LARGE: usize = 5000;

/// The document.
pub(crate) fn html(
    name: &str,
    data: &Value,
    drawing: Option<&Drawing>,
    plant: &PlantFiles,
    language: Language,
) -> String {
    let data = embedded(data);
    let engine = compact::script(&[ENGINE.concat().as_str(), plant.engine].concat());
    let page = compact::script(&format!(
        "\"use strict\";\n(() => {{\nconst WORDS = {};\n{}{}{START}}})();\n",
        words_of_script(),
        PARTS.concat(),
        plant.scene
    ));
    let style = compact::style(&[STYLE, plant.style].concat());
    let policy = format!(
        "default-src 'none'; script-src '{}' '{}'; style-src '{}'; base-uri 'none'; form-action 'none'",
        content_hash(&engine),
        content_hash(&page),
        content_hash(&style)
    );
    let name = escape(name);
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"{}\">\n<head>\n<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{name}</title>\n<style>{style}</style>\n</head>\n<body>\n{}\
         <script id=\"data\" type=\"application/json\">{data}</script>\n<script id=\"engine\">{engine}</script>\n\
         <script id=\"page\">{page}</script>\n</body>\n</html>\n",
        language.tag(),
        body(&name, drawing, plant.body, language)
    );
    out
}

/// The content of the document; the drawing is inserted last, so it cannot contain a place for anything else.
fn body(name: &str, drawing: Option<&Drawing>, plant: &str, language: Language) -> String {
    let (head, tail) = BODY.split_once("{{drawing}}").unwrap_or((BODY, ""));
    let large = if drawing.is_some_and(|it| it.n_marks > LARGE) { "large" } else { "" };
    let svg = drawing.map_or("", |it| it.svg.as_str());
    let no_script = escape(&word("noScript", language));
    let head = head.replace("{{large}}", large).replace("{{noScript}}", &no_script);
    let head = head.replace("{{plant}}", plant).replace("{{name}}", name);
    format!("{head}{svg}{tail}")
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

/// The hash by which a `Content-Security-Policy` names a script or a style.
#[must_use]
pub fn content_hash(text: &str) -> String {
    let digest = Sha256::digest(text.as_bytes());
    format!("sha256-{}", base64(&digest))
}

/// Bytes in base64, with `=` up to a multiple of 4 digits.
#[must_use]
pub fn base64(bytes: &[u8]) -> String {
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
