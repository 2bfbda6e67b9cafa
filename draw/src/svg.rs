//! A drawing as SVG.
//!
//! Colours follow the viewer's preference for light or dark. Text remains text: each text states its width, so that the drawing fits with any font.

use crate::pages::Page;
use crate::picture::{Element, Font, Mark, Pen, Picture, Shape, Way};
use grafsynth_ir::markup::escape;
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

/// The styles of overlays, for files that have one.
const OVERLAY_STYLE: &str = "\
    .p0{fill:#fde3b4}\n.p1{fill:#c9e7c3}\n.p2{fill:#d9d2f0}\n.p3{fill:#c5e6ea}\n.p4{fill:#f6cfdc}\n.p5{fill:#e3ddd3}\n\
    .n{fill:#f7d0c8}\n\
    @media (prefers-color-scheme:dark){\n\
    .p0{fill:#5c4514}\n.p1{fill:#24502a}\n.p2{fill:#443a6b}\n.p3{fill:#1d4f57}\n.p4{fill:#64303f}\n.p5{fill:#4a453d}\n\
    .n{fill:#6b2d22}\n\
    }\n";

/// The drawing as an SVG file.
#[must_use]
pub fn svg(picture: &Picture) -> String {
    file(picture, &format!("width=\"{}\" height=\"{}\"", picture.width, picture.height))
}

/// A page as an SVG file of the size of its paper.
#[must_use]
pub fn page_svg(page: &Page) -> String {
    let millimetres = |tenths: i64| format!("{}.{}mm", tenths / 10, tenths % 10);
    let (width, height) = (millimetres(page.size.0), millimetres(page.size.1));
    file(&page.picture, &format!("width=\"{width}\" height=\"{height}\""))
}

/// A file with these attributes for the size at which it is shown.
fn file(picture: &Picture, size: &str) -> String {
    let (width, height) = (picture.width, picture.height);
    let is_overlay =
        |mark: &Mark| matches!(mark.shape, Shape::Rect { pen: Pen::Part(_) | Pen::Never, .. });
    let more = if picture.marks.iter().any(is_overlay) { OVERLAY_STYLE } else { "" };
    let head = format!(
        "<style>\n{STYLE}{more}</style>\n<rect class=\"bg\" width=\"{width}\" height=\"{height}\"/>\n"
    );
    let attributes = |element: &Element| {
        let Element { id, span } = element;
        format!("id=\"{}\" data-span=\"{}-{}\"", escape(id), span.start, span.end)
    };
    written(picture, size, &head, &attributes)
}

/// The drawing as an element of an HTML page, which has its own styles for the classes of the file. `key` names each element, in the attribute `data-element`.
#[must_use]
pub fn embedded(picture: &Picture, key: &dyn Fn(&Element) -> String) -> String {
    let size = format!("width=\"{}\" height=\"{}\"", picture.width, picture.height);
    written(picture, &size, "", &|element| format!("data-element=\"{}\"", escape(&key(element))))
}

/// The drawing with `head` before its marks, and with these attributes on the group of each element.
fn written(
    picture: &Picture,
    size: &str,
    head: &str,
    attributes: &dyn Fn(&Element) -> String,
) -> String {
    let Picture { width, height, title, marks } = picture;
    let mut out = String::with_capacity(marks.len() * 80 + 2000);
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" {size} viewBox=\"0 0 {width} {height}\" role=\"img\" xml:space=\"preserve\">\n<title>{}</title>\n{head}",
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
        Pen::Never => "n",
        Pen::Part(part) => ["p0", "p1", "p2", "p3", "p4", "p5"]
            .get(usize::from(part % Pen::PARTS))
            .copied()
            .unwrap_or_default(),
    }
}
