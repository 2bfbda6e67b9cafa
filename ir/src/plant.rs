//! A plant: what a chart controls, as a picture that moves, with sensors that set inputs of the chart (docs/plant.md).
//!
//! A plant has **quantities**, numbers that change with time: the position of a truck, the level of a tank. Their values are exact: a rate is a whole number
//! of units per second and a tick is a whole number of nanoseconds, so a value is a whole number of [`SCALE`]ths of a unit. The simulator of plants is in the
//! crate `sim`, and that of a page in its script.

use crate::arena::{Arena, Id};
use crate::net::{InputId, OutputId};

/// The parts of a unit in which values are counted: a nanosecond at one unit per second.
pub const SCALE: i64 = 1_000_000_000;

/// The largest bound of a quantity, in units. A value then is exact in a 64-bit floating-point number too, as in the script of a page.
pub const MAX_UNITS: i64 = 9_000_000;

/// The largest rate, in units per second.
pub const MAX_RATE: i64 = 1_000_000;

/// The maximum number of quantities, of moves, of sets, of driven inputs, and of shapes.
pub const MAX_ITEMS: usize = 500;

/// Identifies a quantity.
pub type QuantityId = Id<Quantity>;

/// A plant, with its names resolved for one net.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Plant {
    /// The width and the height of the picture, in units of the picture.
    pub view: (i64, i64),
    /// The quantities, in the order of their declarations.
    pub quantities: Arena<Quantity>,
    /// What changes quantities continuously. The rates of one quantity add up.
    pub moves: Vec<Move>,
    /// What sets quantities, in order.
    pub sets: Vec<Set>,
    /// The inputs that the plant drives, each at most once.
    pub sensors: Vec<(InputId, Sensor)>,
    /// The shapes of the picture, from back to front.
    pub shapes: Vec<Shape>,
}

/// A number that changes with time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// What it means, for people; a page lists the quantities that have a label.
    pub label: Option<String>,
    /// Its lowest value, in units.
    pub lo: i64,
    /// Its highest value, in units.
    pub hi: i64,
    /// Its value after a reset, in units.
    pub init: i64,
}

/// A continuous change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Move {
    /// What changes.
    pub quantity: QuantityId,
    /// Units per second, or the factor of `speed`.
    pub rate: i64,
    /// An integer output whose value is multiplied by `rate`.
    pub speed: Option<OutputId>,
    /// When it changes.
    pub when: Condition,
}

/// A change at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Set {
    /// What changes.
    pub quantity: QuantityId,
    /// Its new value, in units.
    pub value: i64,
    /// When it changes.
    pub when: Condition,
}

/// The value of an input that the plant drives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sensor {
    /// Of a Boolean input: whether the condition is true.
    Is(Condition),
    /// Of an integer input: the quantity, rounded down, within the range of the input.
    Measures(QuantityId),
}

/// Something that a condition reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// A quantity, in [`SCALE`]ths of a unit.
    Quantity(QuantityId),
    /// An input of the chart.
    Input(InputId),
    /// An output of the chart.
    Output(OutputId),
}

/// A condition of a plant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Condition {
    /// All of them are true; always true if there are none.
    All(Vec<Condition>),
    /// One of them is true.
    Any(Vec<Condition>),
    /// It is not true.
    Not(Box<Condition>),
    /// The value is within the bounds; `None` is no bound.
    Within(Reading, Option<i64>, Option<i64>),
}

/// A place or a size in the picture: a number plus the values of quantities.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Place {
    /// The part that does not change.
    pub base: i64,
    /// Quantities, each with a factor and a divisor.
    pub terms: Vec<(QuantityId, i64, i64)>,
}

/// A shape of the picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// What it is.
    pub kind: ShapeKind,
    /// Its places, as many as [`ShapeKind::places`].
    pub places: Vec<Place>,
    /// The text of a text.
    pub text: String,
    /// Its colour; an outline without one.
    pub fill: Option<Colour>,
    /// When it is displayed.
    pub when: Condition,
}

/// The kinds of shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShapeKind {
    /// A rectangle: left, top, width, height.
    Rect,
    /// A circle: middle, radius.
    Circle,
    /// A line between two points.
    Line,
    /// A text that begins at a point of its base line.
    Text,
}

impl ShapeKind {
    /// All kinds.
    pub const ALL: [ShapeKind; 4] =
        [ShapeKind::Rect, ShapeKind::Circle, ShapeKind::Line, ShapeKind::Text];

    /// The word of a plant file, which is also the element of SVG.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            ShapeKind::Rect => "rect",
            ShapeKind::Circle => "circle",
            ShapeKind::Line => "line",
            ShapeKind::Text => "text",
        }
    }

    /// The number of places.
    #[must_use]
    pub fn places(self) -> usize {
        match self {
            ShapeKind::Rect | ShapeKind::Line => 4,
            ShapeKind::Circle => 3,
            ShapeKind::Text => 2,
        }
    }
}

/// The colours of shapes. A page has a light and a dark form of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Like the outlines.
    Ink,
    /// White.
    White,
    /// Grey.
    Grey,
    /// Blue.
    Blue,
    /// Green.
    Green,
    /// Yellow.
    Yellow,
    /// Red.
    Red,
    /// Brown.
    Brown,
}

impl Colour {
    /// All colours.
    pub const ALL: [Colour; 8] = [
        Colour::Ink,
        Colour::White,
        Colour::Grey,
        Colour::Blue,
        Colour::Green,
        Colour::Yellow,
        Colour::Red,
        Colour::Brown,
    ];

    /// The word of a plant file.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Colour::Ink => "ink",
            Colour::White => "white",
            Colour::Grey => "grey",
            Colour::Blue => "blue",
            Colour::Green => "green",
            Colour::Yellow => "yellow",
            Colour::Red => "red",
            Colour::Brown => "brown",
        }
    }
}
