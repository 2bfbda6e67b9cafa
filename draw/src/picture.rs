//! A drawing as data: lines, boxes and texts with coordinates in pixels.

use grafsynth_ir::Gather;
use grafsynth_ir::Span;

/// A drawing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Picture {
    /// The width in pixels.
    pub width: i64,
    /// The height in pixels.
    pub height: i64,
    /// The name of the drawing, for screen readers.
    pub title: String,
    /// All shapes, from back to front.
    pub marks: Vec<Mark>,
}

/// A shape, and the element of the chart that it belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// The shape with its coordinates.
    pub shape: Shape,
    /// The element of the chart; `None` for links, frames and the legend.
    pub element: Option<Element>,
    /// For a part of a link of a Grafcet: the name of a step that it leads to or comes from.
    pub link: Option<String>,
}

impl From<Shape> for Mark {
    fn from(shape: Shape) -> Self {
        Mark { shape, element: None, link: None }
    }
}

impl Mark {
    /// The left, top, right and bottom edge.
    pub(crate) fn bounds(&self) -> (i64, i64, i64, i64) {
        match &self.shape {
            Shape::Rect { x, y, width, height, .. } => (*x, *y, x + width, y + height),
            Shape::Line { from, to, .. } => {
                (from.0.min(to.0), from.1.min(to.1), from.0.max(to.0), from.1.max(to.1))
            }
            Shape::Text { x, y, width, font, .. } => (*x, y - font.size(), x + width, y + 4),
            Shape::Arrow { x, y, .. } | Shape::Crossing { x, y } => (x - 4, y - 4, x + 4, y + 4),
            Shape::Circle { x, y, radius, .. } => (x - radius, y - radius, x + radius, y + radius),
        }
    }
}

/// An element of the chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// A name that is unique in the drawing, such as `machine.ready`.
    pub id: String,
    /// Source location.
    pub span: Span,
}

/// A shape. All coordinates are pixels from the upper left corner.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    /// A rectangle with the upper left corner at (`x`, `y`).
    Rect {
        /// Left side.
        x: i64,
        /// Upper side.
        y: i64,
        /// Width.
        width: i64,
        /// Height.
        height: i64,
        /// How it is drawn.
        pen: Pen,
    },
    /// A line between two points.
    Line {
        /// The first point.
        from: (i64, i64),
        /// The second point.
        to: (i64, i64),
        /// How it is drawn.
        pen: Pen,
    },
    /// A text on one line.
    Text {
        /// Left end.
        x: i64,
        /// Baseline.
        y: i64,
        /// The text; never empty.
        text: String,
        /// The width that a viewer must give to the text.
        width: i64,
        /// The size and weight of the letters.
        font: Font,
    },
    /// An arrowhead at the end of a link.
    Arrow {
        /// The tip.
        x: i64,
        /// The tip.
        y: i64,
        /// Where it points.
        way: Way,
    },
    /// A circle with its middle at (`x`, `y`).
    Circle {
        /// Middle.
        x: i64,
        /// Middle.
        y: i64,
        /// The radius.
        radius: i64,
        /// True for a dot, false for a line.
        is_filled: bool,
    },
    /// A gap in a horizontal line, where a vertical line crosses it without a connection.
    Crossing {
        /// Middle.
        x: i64,
        /// Middle.
        y: i64,
    },
}

/// Where an arrowhead points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Up.
    Up,
    /// Down.
    Down,
}

/// How a line or a border is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pen {
    /// Links, steps and boxes.
    Line,
    /// The bar of a transition.
    Bar,
    /// A frame around a chart or an expansion.
    Frame,
    /// Lines inside symbols, and overlines.
    Detail,
    /// The border of a state, with round corners.
    State,
    /// The line between the regions of a state, and a signal without a value.
    Dashed,
    /// The area of an active step, or below a signal that is 1.
    Shade,
    /// The lines between reactions.
    Grid,
    /// The area of a step on the part of a split with this number; the numbers repeat after [`Pen::PARTS`].
    Part(u8),
    /// The area of a step that was never active.
    Never,
}

impl Pen {
    /// The number of colours of parts.
    pub const PARTS: u8 = 6;

    /// The colour of a part.
    #[must_use]
    pub fn of_part(part: usize) -> Pen {
        Pen::Part(u8::try_from(part % usize::from(Pen::PARTS)).unwrap_or(0))
    }
}

/// The size and weight of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Font {
    /// Names, conditions and actions.
    Normal,
    /// Comments and remarks.
    Small,
    /// Headings.
    Heading,
}

impl Font {
    /// The size in pixels.
    #[must_use]
    pub fn size(self) -> i64 {
        match self {
            Font::Normal => 12,
            Font::Small => 11,
            Font::Heading => 14,
        }
    }
}

impl Picture {
    /// Moves all shapes.
    pub(crate) fn shift(&mut self, dx: i64, dy: i64) {
        for mark in &mut self.marks {
            match &mut mark.shape {
                Shape::Rect { x, y, .. }
                | Shape::Text { x, y, .. }
                | Shape::Arrow { x, y, .. }
                | Shape::Crossing { x, y } => (*x, *y) = (*x + dx, *y + dy),
                Shape::Circle { x, y, .. } => (*x, *y) = (*x + dx, *y + dy),
                Shape::Line { from, to, .. } => {
                    *from = (from.0 + dx, from.1 + dy);
                    *to = (to.0 + dx, to.1 + dy);
                }
            }
        }
    }

    /// Adds a shape without an element.
    pub(crate) fn add(&mut self, shape: Shape) {
        self.marks.push(shape.into());
    }

    /// Adds another drawing with its upper left corner at (`x`, `y`).
    pub(crate) fn put(&mut self, mut other: Picture, x: i64, y: i64) {
        other.shift(x, y);
        self.width = self.width.max(x + other.width);
        self.height = self.height.max(y + other.height);
        self.marks.append(&mut other.marks);
    }

    pub(crate) fn line(&mut self, from: (i64, i64), to: (i64, i64), pen: Pen) {
        self.add(Shape::Line { from, to, pen });
    }

    pub(crate) fn rect(&mut self, (x, y): (i64, i64), (width, height): (i64, i64), pen: Pen) {
        self.add(Shape::Rect { x, y, width, height, pen });
    }

    /// Adds a text, and returns its width.
    pub(crate) fn text(&mut self, (x, y): (i64, i64), text: &str, font: Font) -> i64 {
        let width = crate::text::width(text, font.size());
        if !text.trim().is_empty() {
            self.add(Shape::Text { x, y, text: text.to_owned(), width, font });
        }
        width
    }

    /// Adds a heading, and returns its width.
    pub(crate) fn heading(&mut self, (x, y): (i64, i64), text: &str) -> i64 {
        // Bold letters are up to a tenth wider.
        let width = crate::text::width(text, Font::Heading.size()) * 9 / 8;
        if !text.is_empty() {
            self.add(Shape::Text { x, y, text: text.to_owned(), width, font: Font::Heading });
        }
        width
    }

    /// Adds a text with its overlines.
    pub(crate) fn rich(&mut self, (x, y): (i64, i64), rich: &crate::text::Rich, font: Font) {
        let mut at = x;
        let mut ends: std::collections::BTreeMap<_, _> = [(0, x)].into_iter().gather();
        for (start, run) in rich.runs() {
            at += self.text((at, y), run, font);
            ends.insert(start + run.len(), at);
        }
        for bar in &rich.bars {
            if let (Some(from), Some(to)) = (ends.get(&bar.start), ends.get(&bar.end)) {
                let y = y - font.size() + 1 - 3 * bar.level;
                self.line((*from, y), (*to, y), Pen::Detail);
            }
        }
    }
}
