//! A subset of SVG for drawings: elements with attributes, escaped text, one picture on a white background.
//!
//! All coordinates are whole pixels and every attribute is on its element, so that all viewers show the same picture. The font is monospaced,
//! so the width of a text is known without the font. Viewers that prefer dark colours exchange them by others.

use grafsynth_ir::markup::escape;

/// Each colour, and the one that is shown instead where the reader prefers dark pictures.
const DARK: [(&str, &str); 12] = [
    ("#ffffff", "#16181d"),
    ("#f4f4f0", "#262a31"),
    ("#222222", "#e8e8e8"),
    ("#666666", "#b0b5bd"),
    ("#c0392b", "#e5695c"),
    ("#4d4d4d", "#a2a8b1"),
    ("#8e44ad", "#bd7bd9"),
    ("#7f6000", "#c7a136"),
    ("#1f6fb2", "#5ba3e0"),
    ("#1e8449", "#4fb57c"),
    ("#5d7a8c", "#8eabbd"),
    ("#b3b3b3", "#5b626c"),
];

/// A picture under construction.
pub struct Svg {
    width: u32,
    height: u32,
    title: String,
    body: String,
}

/// The position of a text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins at the point.
    Start,
    /// The middle of the text is at the point.
    Middle,
    /// The text ends at the point.
    End,
}

/// The style of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pen<'a> {
    /// The height of letters, in pixels.
    pub size: u32,
    /// A colour of CSS.
    pub colour: &'a str,
    /// Bold letters.
    pub is_bold: bool,
}

impl Svg {
    /// An empty picture of this size in pixels; the title is for screen readers.
    #[must_use]
    pub fn new(width: u32, height: u32, title: &str) -> Self {
        Svg { width, height, title: escape(title), body: String::new() }
    }

    /// Adds an element without content. Attributes are escaped.
    pub fn element(&mut self, name: &str, attributes: &[(&str, String)]) {
        self.open(name, attributes);
        self.body.push_str("/>\n");
    }

    /// Adds an element with a tooltip.
    pub fn element_with_title(&mut self, name: &str, attributes: &[(&str, String)], title: &str) {
        self.open(name, attributes);
        self.body.push_str(&format!("><title>{}</title></{name}>\n", escape(title)));
    }

    fn open(&mut self, name: &str, attributes: &[(&str, String)]) {
        self.body.push_str("  <");
        self.body.push_str(name);
        for (key, value) in attributes {
            self.body.push_str(&format!(" {key}=\"{}\"", escape(value)));
        }
    }

    /// Adds a filled rectangle, with a border if `stroke` is a colour.
    pub fn rect(&mut self, x: u32, y: u32, width: u32, height: u32, fill: &str, stroke: &str) {
        self.element(
            "rect",
            &[
                ("x", x.to_string()),
                ("y", y.to_string()),
                ("width", width.to_string()),
                ("height", height.to_string()),
                ("fill", fill.to_owned()),
                ("stroke", stroke.to_owned()),
            ],
        );
    }

    /// Adds a shape whose outline is given in SVG's path language.
    pub fn path(&mut self, path: &str, fill: &str, stroke: &str) {
        self.element(
            "path",
            &[
                ("d", path.to_owned()),
                ("fill", fill.to_owned()),
                ("stroke", stroke.to_owned()),
                ("stroke-width", "1.5".to_owned()),
            ],
        );
    }

    /// Adds a text with its baseline at a point. A text longer than `room` pixels is cut with an ellipsis, and the full text is the tooltip.
    pub fn text(&mut self, at: (u32, u32), anchor: Anchor, pen: Pen<'_>, text: &str, room: u32) {
        self.write(at, anchor, pen, text, room, None);
    }

    /// Adds a text that runs from the bottom up.
    pub fn text_upwards(
        &mut self,
        at: (u32, u32),
        anchor: Anchor,
        pen: Pen<'_>,
        text: &str,
        room: u32,
    ) {
        let turn = format!("rotate(-90 {} {})", at.0, at.1);
        self.write(at, anchor, pen, text, room, Some(turn));
    }

    fn write(
        &mut self,
        (x, y): (u32, u32),
        anchor: Anchor,
        pen: Pen<'_>,
        text: &str,
        room: u32,
        turn: Option<String>,
    ) {
        if text.is_empty() {
            return;
        }
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let mut attributes = vec![
            ("x", x.to_string()),
            ("y", y.to_string()),
            ("font-size", pen.size.to_string()),
            ("text-anchor", anchor.to_owned()),
            ("fill", pen.colour.to_owned()),
        ];
        if pen.is_bold {
            attributes.push(("font-weight", "bold".to_owned()));
        }
        attributes.extend(turn.map(|turn| ("transform", turn)));
        self.open("text", &attributes);
        let shown = cut(text, pen.size, room);
        let title =
            if shown == text { String::new() } else { format!("<title>{}</title>", escape(text)) };
        self.body.push_str(&format!(">{title}{}</text>\n", escape(&shown)));
    }

    /// The complete SVG file.
    #[must_use]
    pub fn finish(self) -> String {
        let Svg { width, height, title, body } = self;
        let mut dark = String::new();
        for (light, dark_one) in DARK {
            for kind in ["fill", "stroke"] {
                dark.push_str(&format!("[{kind}=\"{light}\"]{{{kind}:{dark_one}}}"));
            }
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\">\n  <title>{title}</title>\n  <style>@media (prefers-color-scheme:dark){{{dark}}}</style>\n  <rect x=\"0\" y=\"0\" width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{body}</svg>\n"
        )
    }
}

/// The width in pixels of a text with letters of this size, rounded up.
#[must_use]
pub fn width(text: &str, size: u32) -> u32 {
    let columns = u32::try_from(super::table::width(text)).unwrap_or(u32::MAX / 1024);
    // A monospaced letter is 0.6 of its height wide in all requested fonts (0.602 in the widest).
    columns.saturating_mul(size).saturating_mul(31).div_ceil(50)
}

/// A text that fits, with an ellipsis if something was cut off.
fn cut(text: &str, size: u32, room: u32) -> String {
    if width(text, size) <= room {
        return text.to_owned();
    }
    let mut kept = String::new();
    for c in text.chars() {
        kept.push(c);
        if width(&kept, size) + width("…", size) > room {
            kept.pop();
            break;
        }
    }
    kept.push('…');
    kept
}
