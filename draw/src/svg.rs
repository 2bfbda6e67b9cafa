//! A drawing as SVG.
//!
//! Colours follow the viewer's preference for light or dark. Text remains text: each text states its width, so that the drawing fits with any font.

use crate::picture::{Element, Font, Mark, Pen, Picture, Shape, Way};
use std::fmt::Write as _;

/// The styles of the file; a viewer that ignores media queries shows the light ones.
const STYLE: &str = "\
    svg{background:#fff}\n\
    .bg{fill:#fff}\n\
    .l,.d,.b,.f,.u,.r{stroke:#111;fill:none;stroke-width:1.5}\n\
    .d,.r{stroke-width:1}\n\
    .r{stroke-dasharray:6 4}\n\
    .b{stroke-width:4}\n\
    .f{stroke:#888;stroke-width:1}\n\
    .w{fill:#cfe0f4}\n\
    .g{stroke:#ddd;stroke-width:1}\n\
    .x{stroke:#fff;stroke-width:4}\n\
    .a{fill:#111}\n\
    text{fill:#111;font-family:'Liberation Sans',Arimo,Arial,Helvetica,sans-serif;font-size:12px;white-space:pre}\n\
    .s{font-size:11px;fill:#555}\n\
    .h{font-size:14px;font-weight:bold}\n\
    @media (prefers-color-scheme:dark){\n\
    svg{background:#16181d}\n\
    .bg{fill:#16181d}\n\
    .l,.d,.b,.u,.r{stroke:#e8e8e8}\n\
    .w{fill:#27415f}\n\
    .g{stroke:#33373f}\n\
    .f{stroke:#8a8f98}\n\
    .x{stroke:#16181d}\n\
    .a,text{fill:#e8e8e8}\n\
    .s{fill:#b0b5bd}\n\
    }\n";

/// The drawing as an SVG file.
#[must_use]
pub fn svg(picture: &Picture) -> String {
    let (width, height) = (picture.width, picture.height);
    let head = format!(
        "<style>\n{STYLE}</style>\n<rect class=\"bg\" width=\"{width}\" height=\"{height}\"/>\n"
    );
    let attributes = |element: &Element| {
        let Element { id, span } = element;
        format!("id=\"{}\" data-span=\"{}-{}\"", escape(id), span.start, span.end)
    };
    written(picture, &head, &attributes)
}

/// The drawing as an element of an HTML page, which has its own styles for the classes of the file. `key` names each element, in the attribute `data-element`.
#[must_use]
pub fn embedded(picture: &Picture, key: &dyn Fn(&Element) -> String) -> String {
    written(picture, "", &|element| format!("data-element=\"{}\"", escape(&key(element))))
}

/// The drawing with `head` before its marks, and with these attributes on the group of each element.
fn written(picture: &Picture, head: &str, attributes: &dyn Fn(&Element) -> String) -> String {
    let Picture { width, height, title, marks } = picture;
    let mut out = String::with_capacity(marks.len() * 80 + 2000);
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\" xml:space=\"preserve\">\n<title>{}</title>\n{head}",
        escape(title)
    );
    let mut open: Option<&Element> = None;
    for mark in marks {
        if open != mark.element.as_ref() {
            if open.is_some() {
                out.push_str("</g>\n");
            }
            open = mark.element.as_ref();
            if let Some(element) = open {
                let _ = writeln!(out, "<g {}>", attributes(element));
            }
        }
        write_mark(&mut out, mark);
    }
    if open.is_some() {
        out.push_str("</g>\n");
    }
    out.push_str("</svg>\n");
    out
}

fn write_mark(out: &mut String, mark: &Mark) {
    let _ = match &mark.shape {
        Shape::Rect { x, y, width, height, pen } => {
            let round = if *pen == Pen::State { " rx=\"8\"" } else { "" };
            writeln!(
                out,
                "<rect class=\"{}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"{round}/>",
                class(*pen)
            )
        }
        Shape::Line { from, to, pen } => writeln!(
            out,
            "<line class=\"{}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>",
            class(*pen),
            from.0,
            from.1,
            to.0,
            to.1
        ),
        Shape::Text { x, y, text, width, font } => {
            let class = match font {
                Font::Normal => "",
                Font::Small => " class=\"s\"",
                Font::Heading => " class=\"h\"",
            };
            // The direction keeps signs in place in names of scripts that are written from right to left.
            writeln!(
                out,
                "<text{class} x=\"{x}\" y=\"{y}\" textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\">{}</text>",
                escape(text)
            )
        }
        Shape::Arrow { x, y, way } => {
            let back = if *way == Way::Up { 9 } else { -9 };
            writeln!(out, "<path class=\"a\" d=\"M{x} {y}l-4 {back}h8z\"/>")
        }
        Shape::Circle { x, y, radius, is_filled } => {
            let class = if *is_filled { "a" } else { "l" };
            writeln!(out, "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>")
        }
        Shape::Crossing { x, y } => writeln!(
            out,
            "<line class=\"x\" x1=\"{}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\"/>",
            x - 4,
            x + 4
        ),
    };
}

fn class(pen: Pen) -> &'static str {
    match pen {
        Pen::Line => "l",
        Pen::Bar => "b",
        Pen::Frame => "f",
        Pen::Detail => "d",
        Pen::State => "u",
        Pen::Dashed => "r",
        Pen::Shade => "w",
        Pen::Grid => "g",
    }
}

/// A text as content or attribute of XML. Characters that XML does not allow, and those that change the direction of text, become U+FFFD.
fn escape(text: &str) -> String {
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
