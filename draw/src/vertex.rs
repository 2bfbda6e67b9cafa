//! How states and pseudo-states look.

use crate::picture::{Font, Pen, Picture, Shape};
use crate::states::{Edge, Kind, Vertex};
use crate::text::{Rich, broken_name, width};

/// The width from which names are broken.
const LONGEST_NAME: i64 = 180;
/// The width from which other texts are broken at blanks.
const LONGEST_LINE: i64 = 220;
/// The distance between lines of text.
const LINE: i64 = 15;
/// The distance of texts from the border of a state.
const MARGIN: i64 = 10;
/// By how much the second line of a text is moved to the right.
const INDENT: i64 = 12;
/// The smallest size of a state.
const STATE: (i64, i64) = (64, 36);

/// A cell as it looks, relative to its upper left corner.
#[derive(Debug, Clone, Default)]
pub(crate) struct Look {
    pub(crate) width: i64,
    pub(crate) height: i64,
    /// The column of all links; `None` if they may be anywhere on the upper and lower side.
    pub(crate) axis: Option<i64>,
    /// The radius of a circle, which links meet at every second pitch; its middle is at half of `reach`.
    pub(crate) radius: Option<i64>,
    /// The width of the part with links; the rest is text. 0 means everything.
    pub(crate) reach: i64,
    pub(crate) picture: Picture,
}

/// The part of a state with its name and activities, from its upper left corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Header {
    pub(crate) height: i64,
    /// The width, if it is a tab that leaves the rest of the upper side to transitions; `None` for the width of the state.
    pub(crate) width: Option<i64>,
}

/// Lines of text: their indents, and the fonts.
struct Lines(Vec<(i64, String, Font)>);

impl Lines {
    fn new() -> Self {
        Lines(Vec::new())
    }

    /// Adds a text; its second line and all others are indented.
    fn add(&mut self, text: &str, font: Font) {
        let lines = Rich::plain(text).lines(font.size(), LONGEST_LINE);
        for (index, line) in lines.into_iter().enumerate() {
            self.0.push((if index == 0 { 0 } else { INDENT }, line.text, font));
        }
    }

    fn width(&self) -> i64 {
        let widths = self.0.iter();
        widths.map(|(indent, text, font)| indent + width(text, font.size())).max().unwrap_or(0)
    }

    fn height(&self) -> i64 {
        i64::try_from(self.0.len()).unwrap_or(0) * LINE
    }

    /// Draws the lines with their upper left corner at (`x`, `y`).
    fn draw(&self, picture: &mut Picture, x: i64, y: i64) {
        for (index, (indent, text, font)) in (0..).zip(&self.0) {
            picture.text((x + indent, y + index * LINE + 12), text, *font);
        }
    }
}

/// The name with comments and tags, and the activities.
fn compartments(vertex: &Vertex) -> (Lines, Lines) {
    let (mut head, mut body) = (Lines::new(), Lines::new());
    for line in broken_name(&vertex.name, Font::Normal.size(), LONGEST_NAME) {
        head.0.push((0, line, Font::Normal));
    }
    vertex.remarks.iter().for_each(|text| head.add(text, Font::Small));
    vertex.lines.iter().for_each(|text| body.add(text, Font::Normal));
    (head, body)
}

/// The name and activities of a state that contains others, without the line below them.
pub(crate) fn header(vertex: &Vertex) -> Look {
    let (head, body) = compartments(vertex);
    let mut look = Look { width: head.width().max(body.width()), ..Look::default() };
    head.draw(&mut look.picture, 0, 5);
    look.height = head.height() + 10;
    if !body.0.is_empty() {
        body.draw(&mut look.picture, 0, look.height + 4);
        look.height += body.height() + 8;
    }
    look
}

/// A child of a container, with the number of links on the side that has most. `inside` is the size of the inside of a child that contains others.
pub(crate) fn look(vertex: &Vertex, inside: Option<(i64, i64)>, n_links: i64) -> Look {
    if let Some((width, height)) = inside {
        return Look { width, height, ..Look::default() };
    }
    match vertex.kind {
        Kind::Initial => round(vertex, 7, n_links),
        Kind::Final => round(vertex, 10, n_links),
        Kind::History(_) => round(vertex, 12, n_links),
        Kind::Bar => Look { width: 32, height: 4, ..Look::default() },
        Kind::Chart | Kind::State | Kind::Region | Kind::Instance | Kind::Unknown => {
            let (head, body) = compartments(vertex);
            let width = head.width().max(body.width()) + 2 * MARGIN;
            let mut height = head.height() + 12;
            if !body.0.is_empty() {
                height += body.height() + 9;
            }
            Look { width: width.max(STATE.0), height: height.max(STATE.1), ..Look::default() }
        }
    }
}

/// A circle with its name to the right. It is larger if it has several links on a side.
fn round(vertex: &Vertex, least: i64, n_links: i64) -> Look {
    let mut head = Lines(vec![(0, vertex.name.clone(), Font::Normal)]);
    vertex.remarks.iter().for_each(|text| head.add(text, Font::Small));
    vertex.lines.iter().for_each(|text| head.add(text, Font::Normal));
    let n_links = n_links.max(1);
    let (middle, radius) = (8 * (n_links + 1), least.max(8 * (n_links - 1) + 5));
    let mut look = Look { width: 2 * middle, height: 2 * radius, ..Look::default() };
    (look.reach, look.radius) = (2 * middle, Some(radius));
    if !vertex.name.is_empty() {
        let x = middle + radius + 5;
        let high = head.height();
        look.height = look.height.max(high + 4);
        head.draw(&mut look.picture, x, (look.height - high) / 2);
        look.width = look.width.max(x + head.width() + 4);
    }
    look
}

/// Draws what depends on the final size: borders, circles, and texts in the middle. A state that contains others has a header.
pub(crate) fn finish(vertex: &Vertex, look: &mut Look, header: Option<Header>) {
    let pen = if vertex.kind == Kind::Instance { Pen::Line } else { Pen::State };
    let (wide, high, middle) = (look.width, look.height, look.reach / 2);
    let radius = look.radius.unwrap_or(0);
    let picture = &mut look.picture;
    let mut circle = |radius: i64, is_filled: bool| {
        picture.add(Shape::Circle { x: middle, y: high / 2, radius, is_filled });
    };
    match vertex.kind {
        Kind::Initial => circle(radius, true),
        Kind::Final => {
            circle(radius, false);
            circle(radius / 2, true);
        }
        Kind::History(is_deep) => {
            circle(radius, false);
            let text = if is_deep { "H*" } else { "H" };
            let x = middle - width(text, Font::Normal.size()) / 2;
            picture.text((x, high / 2 + 4), text, Font::Normal);
        }
        Kind::Bar => picture.line((0, 2), (wide, 2), Pen::Bar),
        // The state around an active region is active, too.
        Kind::Region => {}
        Kind::Chart | Kind::State | Kind::Instance | Kind::Unknown => {
            if vertex.is_active {
                // Of a composite state, only the part with its name: its active states are in the rest.
                let header = header.map(|it| (it.width.unwrap_or(wide), it.height));
                picture.rect((0, 0), header.unwrap_or((wide, high)), Pen::Shade);
            }
            picture.rect((0, 0), (wide, high), pen);
            if vertex.is_active {
                picture.add(Shape::Circle { x: wide - 10, y: 10, radius: 4, is_filled: true });
            }
            let (head, body) = compartments(vertex);
            if let Some(Header { height, width }) = header {
                let end = width.unwrap_or(wide);
                picture.line((0, height), (end, height), Pen::Detail);
                if !body.0.is_empty() {
                    let y = head.height() + 10;
                    picture.line((0, y), (end, y), Pen::Detail);
                }
                if end < wide {
                    picture.line((end, 0), (end, height), Pen::Detail);
                }
                return;
            }
            let top = if body.0.is_empty() { (high - head.height()) / 2 } else { 6 };
            for (index, (_, text, font)) in (0..).zip(&head.0) {
                let x = (wide - width(text, font.size())) / 2;
                picture.text((x, top + index * LINE + 12), text, *font);
            }
            if !body.0.is_empty() {
                let y = head.height() + 12;
                picture.line((0, y), (wide, y), Pen::Detail);
                body.draw(picture, MARGIN, y + 3);
            }
        }
    }
}

/// The label of a transition beside its line; `None` if it has no text.
pub(crate) fn label(edge: &Edge) -> Option<Look> {
    let mut lines = Lines::new();
    if !edge.label.is_empty() {
        lines.add(&edge.label, Font::Normal);
    }
    edge.remarks.iter().for_each(|text| lines.add(text, Font::Small));
    if lines.0.is_empty() {
        return None;
    }
    let mut look = Look { width: 8 + 6 + lines.width(), ..Look::default() };
    look.height = lines.height() + 4;
    look.axis = Some(8);
    lines.draw(&mut look.picture, 8 + 6, 1);
    Some(look)
}
