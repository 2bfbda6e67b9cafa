//! The pin-out of a chip as a drawing, in characters and as SVG, from the same model.
//!
//! ```text
//! Chip ──► Drawing { shape, pins, bars } ──► text()   in characters
//!                                       └──► svg()    with a bar of product terms for each macrocell
//! ```
//! A package with two rows has pin 1 at the upper left and is numbered counter-clockwise; a package with four rows begins in the middle of its
//! upper side. A netlist has no package and is drawn as a symbol: inputs on the left, outputs on the right.

use super::chip::{Chip, Kind};
use super::svg::{Anchor, Pen, Svg, width};
use super::table;
use grafsynth_backend_pld::device::{Clock, Device};
use std::fmt::Write as _;

/// The contents of a drawing.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// The text on the package.
    pub title: String,
    /// The text below it: the name of the design.
    pub subtitle: String,
    /// The shape.
    pub shape: Shape,
    /// The pins: all pins of a package in order; for a symbol, inputs first.
    pub pins: Vec<PinMark>,
    /// The macrocells.
    pub bars: Vec<Bar>,
}

/// The shape to draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A package with two rows of pins.
    Dual,
    /// A package with pins on four sides, pin 1 in the middle of the upper one (PLCC).
    Quad,
    /// Like `Quad`, with pin 1 at the upper left corner (QFP).
    Flat,
    /// A symbol.
    Symbol,
}

/// A pin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinMark {
    /// Its number, if it has one.
    pub number: Option<u32>,
    /// Its signal; empty if it is not used.
    pub name: String,
    /// Its label in the chart.
    pub label: String,
    /// Its function.
    pub role: PinRole,
}

/// The function of a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PinRole {
    /// The supply.
    Supply,
    /// Ground.
    Ground,
    /// The clock.
    Clock,
    /// An active-low output enable.
    Enable,
    /// Controls all registers of the device: it must be tied to a level.
    Control,
    /// An input.
    Input,
    /// A combinational output.
    Output,
    /// A flip-flop that the pin shows.
    Register,
    /// Used to program the soldered device.
    Programming,
    /// Not used, and not driven by the device.
    Idle,
    /// Not used, but driven by the device: it must be left open.
    Driven,
}

impl PinRole {
    /// The role in a word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            PinRole::Supply => "supply",
            PinRole::Ground => "ground",
            PinRole::Clock => "clock",
            PinRole::Enable => "output enable, low",
            PinRole::Control => "control",
            PinRole::Input => "input",
            PinRole::Output => "output",
            PinRole::Register => "output, flip-flop",
            PinRole::Programming => "programming (JTAG)",
            PinRole::Idle => "not used",
            PinRole::Driven => "not used, driven",
        }
    }

    fn is_in(self) -> bool {
        matches!(self, PinRole::Clock | PinRole::Enable | PinRole::Control | PinRole::Input)
    }

    fn is_out(self) -> bool {
        matches!(self, PinRole::Output | PinRole::Register | PinRole::Driven)
    }

    /// The fill colour of a pin and of its arrow.
    fn colour(self) -> &'static str {
        match self {
            PinRole::Supply => "#c0392b",
            PinRole::Ground => "#4d4d4d",
            PinRole::Clock => "#8e44ad",
            PinRole::Enable | PinRole::Control => "#7f6000",
            PinRole::Input => "#1f6fb2",
            PinRole::Output => "#1e8449",
            PinRole::Register => "#b9770e",
            PinRole::Programming => "#5d7a8c",
            PinRole::Idle | PinRole::Driven => "#b3b3b3",
        }
    }
}

/// The product terms of a macrocell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bar {
    /// Its pin.
    pub pin: Option<u32>,
    /// The name of its signal; empty for a spare macrocell.
    pub name: String,
    /// The number of terms of its sum.
    pub used: u32,
    /// The number of available terms, if the macrocell is known.
    pub available: Option<u32>,
    /// The number of terms without don't-cares, if known.
    pub without: Option<u32>,
    /// True if it has a flip-flop.
    pub is_registered: bool,
}

impl Bar {
    /// The number of boxes to draw: one for each term that is available, used or saved.
    fn n_drawn(&self) -> u32 {
        self.available.unwrap_or(0).max(self.used).max(self.without.unwrap_or(0))
    }
}

impl Drawing {
    /// The drawing of a chip.
    #[must_use]
    pub fn of(chip: &Chip) -> Self {
        let subtitle = super::chip::plain(&chip.circuit.name.text);
        let bars = bars(chip);
        match chip.device.filter(|_| chip.misfit.is_none()) {
            Some(device) => Drawing {
                title: device.burned_as.to_owned(),
                subtitle,
                shape: match device.package {
                    package if package.contains("QFP") => Shape::Flat,
                    package if package.contains("LCC") => Shape::Quad,
                    _ => Shape::Dual,
                },
                pins: (1..=device.n_pins).map(|pin| mark(chip, device, pin)).collect(),
                bars,
            },
            None => {
                let title = match (chip.device, chip.package) {
                    (Some(device), _) => device.burned_as.to_owned(),
                    (None, Some(package)) => package.name.to_owned(),
                    (None, None) => String::new(),
                };
                Drawing { title, subtitle, shape: Shape::Symbol, pins: ports(chip), bars }
            }
        }
    }

    /// The drawing in characters.
    #[must_use]
    pub fn text(&self) -> String {
        match self.shape {
            Shape::Dual => {
                let (left, right) = self.pins.split_at(self.pins.len() / 2);
                let right: Vec<&PinMark> = right.iter().rev().collect();
                self.two_rows(&left.iter().collect::<Vec<_>>(), &right, true)
            }
            Shape::Symbol => {
                let (left, right): (Vec<&PinMark>, Vec<&PinMark>) =
                    self.pins.iter().partition(|pin| pin.role.is_in());
                self.two_rows(&left, &right, false)
            }
            Shape::Quad | Shape::Flat => self.four_rows(),
        }
    }

    fn two_rows(&self, left: &[&PinMark], right: &[&PinMark], is_package: bool) -> String {
        let names = |pins: &[&PinMark]| {
            pins.iter().map(|pin| table::width(&pin.name)).max().unwrap_or(0).max(1)
        };
        let margin = names(left);
        let numbers = |pins: &[&PinMark]| {
            let width = |pin: &&PinMark| pin.number.map_or(0, |pin| pin.to_string().len());
            pins.iter().map(width).max().unwrap_or(0)
        };
        let (lefts, rights) = (numbers(left), numbers(right));
        let inside = [&self.title, &self.subtitle].map(|text| table::width(text) + 4);
        let gap = inside.into_iter().max().unwrap_or(0).max(9);
        let body = lefts + gap + rights + 2;
        let indent = " ".repeat(margin + 5);
        let mut text = String::new();
        if is_package {
            let half = (body - 3) / 2;
            let rest = body - 3 - half;
            let _ = writeln!(text, "{indent}.{}\\_/{}.", "-".repeat(half), "-".repeat(rest));
        } else {
            let _ = writeln!(text, "{indent}.{}.", "-".repeat(body));
        }
        let n_rows = left.len().max(right.len()).max(2);
        let first = (n_rows - 1) / 2;
        for row in 0..n_rows {
            let (near, far) = (left.get(row), right.get(row));
            let name = near.map_or("", |pin| pin.name.as_str());
            let pad = " ".repeat(margin - table::width(name));
            let own_wire = near.map_or("   ", |pin| wire(pin.role, "-->", "<--"));
            let number = |pin: Option<&&PinMark>| {
                pin.and_then(|pin| pin.number).map(|pin| pin.to_string()).unwrap_or_default()
            };
            let middle = match row {
                row if row == first => &self.title,
                row if row == first + 1 => &self.subtitle,
                _ => "",
            };
            let before = (gap - table::width(middle)) / 2;
            let after = gap - table::width(middle) - before;
            let other = far.map_or("   ", |pin| wire(pin.role, "<--", "-->"));
            let (own, theirs) = (number(near), number(far));
            let line = format!(
                "{pad}{name} {own_wire} | {own:>lefts$}{}{middle}{}{theirs:>rights$} | {other} {}",
                " ".repeat(before),
                " ".repeat(after),
                far.map_or("", |pin| pin.name.as_str())
            );
            let _ = writeln!(text, "{}", line.trim_end());
        }
        let _ = writeln!(text, "{indent}'{}'", "-".repeat(body));
        text
    }

    /// The position of the pin at the upper end of the left side; the numbers increase downwards.
    fn first_left(&self) -> usize {
        match self.shape {
            Shape::Flat => 0,
            Shape::Quad | Shape::Dual | Shape::Symbol => self.pins.len() / 8 + 1,
        }
    }

    /// Draws a package with four rows of pins in characters: one side after the other, because rotated letters are hard to read.
    fn four_rows(&self) -> String {
        let n = self.pins.len();
        let side = n / 4;
        let first_left = self.first_left();
        let sides = [
            ("left, downwards", first_left),
            ("bottom, to the right", first_left + side),
            ("right, upwards", first_left + 2 * side),
            ("top, to the left", first_left + 3 * side),
        ];
        let place = match self.shape {
            Shape::Flat => "at the upper left corner",
            Shape::Quad | Shape::Dual | Shape::Symbol => "in the middle of the top",
        };
        let mut text = format!("{} ({n} pins, pin 1 {place})\n", self.title);
        for (name, first) in sides {
            let _ = writeln!(text, "{name}:");
            for at in first..first + side {
                let Some(pin) = self.pins.get(at % n) else { continue };
                let wire = wire(pin.role, "<--", "-->");
                let line = format!("  {:>3} {wire} {}", pin.number.unwrap_or_default(), pin.name);
                let _ = writeln!(text, "{}", line.trim_end());
            }
        }
        text
    }

    /// The drawing as SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        match self.shape {
            Shape::Dual => {
                let (left, right) = self.pins.split_at(self.pins.len() / 2);
                let right: Vec<&PinMark> = right.iter().rev().collect();
                self.svg_two_rows(&left.iter().collect::<Vec<_>>(), &right, true)
            }
            Shape::Symbol => {
                let (left, right): (Vec<&PinMark>, Vec<&PinMark>) =
                    self.pins.iter().partition(|pin| pin.role.is_in());
                self.svg_two_rows(&left, &right, false)
            }
            Shape::Quad | Shape::Flat => self.svg_four_rows(),
        }
    }

    fn heading(&self) -> String {
        match (self.title.as_str(), self.subtitle.as_str()) {
            ("", name) => name.to_owned(),
            (device, name) => format!("{name} on {device}"),
        }
    }

    fn svg_two_rows(&self, left: &[&PinMark], right: &[&PinMark], is_package: bool) -> String {
        let n_rows = u32::try_from(left.len().max(right.len()).max(2)).unwrap_or(2);
        let (left_names, right_names) = (room(left), room(right));
        let inside = width(&self.title, LARGE).max(width(&self.subtitle, LARGE)).min(MOST_ROOM);
        let body = (inside + 72).max(120);
        let x = MARGIN + left_names + STUB + 6;
        let top = MARGIN + 14;
        let height = n_rows * ROW + 12;
        let end = x + body;
        // Bars are drawn next to their pins if all these pins are on the right.
        let place_of =
            |bar: &Bar| right.iter().position(|pin| pin.number.is_some() && pin.number == bar.pin);
        let is_beside = is_package && self.bars.iter().all(|bar| place_of(bar).is_some());
        let bars_x = end + STUB + 6 + right_names + 24;
        let bars = Bars::new(&self.bars, !is_beside);
        let bars_height = if is_beside { height } else { bars.height() };
        let legend_y = top + height.max(bars_height) + 34;
        let legend = legend(&self.pins, &self.bars);
        let picture = (bars_x + bars.width()).max(MARGIN + legend_width(&legend)) + MARGIN;
        let mut svg = Svg::new(picture, legend_y + 14, &self.heading());
        if is_package {
            let middle = x + body / 2;
            let path = format!(
                "M{} {top} A9 9 0 0 0 {} {top} H{end} V{} H{x} V{top} Z",
                middle - 9,
                middle + 9,
                top + height
            );
            svg.path(&path, BODY, INK);
        } else {
            svg.rect(x, top, body, height, BODY, INK);
        }
        self.titles(&mut svg, (x + body / 2, top + height / 2), body - 60);
        for (row, pin) in (0..).zip(left) {
            draw_pin(&mut svg, pin, (x, top + 6 + row * ROW + ROW / 2), Side::Left, left_names);
        }
        for (row, pin) in (0..).zip(right) {
            draw_pin(&mut svg, pin, (end, top + 6 + row * ROW + ROW / 2), Side::Right, right_names);
        }
        let row_of = |at: usize, bar: &Bar| {
            let row = if is_beside { place_of(bar).unwrap_or(at) } else { at };
            u32::try_from(row).unwrap_or(0)
        };
        let rows = self.bars.iter().enumerate().map(|(at, bar)| row_of(at, bar));
        if let Some(first) = rows.min() {
            bars.head(&mut svg, (bars_x, top + 4 + first * ROW));
        }
        for (at, bar) in self.bars.iter().enumerate() {
            bars.draw(&mut svg, bar, (bars_x, top + 6 + row_of(at, bar) * ROW + ROW / 2));
        }
        draw_legend(&mut svg, &legend, (MARGIN, legend_y));
        svg.finish()
    }

    /// Draws the names of device and design, centred at a point.
    fn titles(&self, svg: &mut Svg, (x, y): (u32, u32), room: u32) {
        let large = Pen { size: LARGE, colour: INK, is_bold: true };
        let small = Pen { size: SMALL, colour: INK, is_bold: false };
        if self.title.is_empty() {
            svg.text((x, y + 5), Anchor::Middle, large, &self.subtitle, room);
        } else {
            svg.text((x, y), Anchor::Middle, large, &self.title, room);
            svg.text((x, y + 18), Anchor::Middle, small, &self.subtitle, room);
        }
    }

    fn svg_four_rows(&self) -> String {
        let n = self.pins.len();
        let side = n / 4;
        let first_left = self.first_left();
        let of_side = |which: usize| -> Vec<&PinMark> {
            let first = first_left + which * side;
            (first..first + side).filter_map(|at| self.pins.get(at % n)).collect()
        };
        let [left, bottom, mut right, mut upper] = [0, 1, 2, 3].map(of_side);
        // These two sides are numbered against the direction in which they are drawn.
        right.reverse();
        upper.reverse();
        let names = room(&self.pins.iter().collect::<Vec<_>>());
        let x = MARGIN + names + STUB + 6;
        let top = x;
        let length = u32::try_from(side).unwrap_or(0) * ROW + 40;
        let bars_x = x + length + STUB + 6 + names + 24;
        let bars = Bars::new(&self.bars, true);
        let bottom_y = top + length;
        let legend_y = (bottom_y + STUB + 6 + names).max(top + bars.height()) + 30;
        let legend = legend(&self.pins, &self.bars);
        let picture = (bars_x + bars.width()).max(MARGIN + legend_width(&legend)) + MARGIN;
        let mut svg = Svg::new(picture, legend_y + 14, &self.heading());
        svg.path(
            &format!("M{x} {} L{} {top} H{} V{bottom_y} H{x} Z", top + 14, x + 14, x + length),
            BODY,
            INK,
        );
        self.titles(&mut svg, (x + length / 2, top + length / 2), length.saturating_sub(90));
        let along = |at: u32| 20 + at * ROW + ROW / 2;
        for (at, pin) in (0..).zip(&left) {
            draw_pin(&mut svg, pin, (x, top + along(at)), Side::Left, names);
        }
        for (at, pin) in (0..).zip(&right) {
            draw_pin(&mut svg, pin, (x + length, top + along(at)), Side::Right, names);
        }
        for (at, pin) in (0..).zip(&upper) {
            draw_pin(&mut svg, pin, (x + along(at), top), Side::Top, names);
        }
        for (at, pin) in (0..).zip(&bottom) {
            draw_pin(&mut svg, pin, (x + along(at), bottom_y), Side::Bottom, names);
        }
        if !self.bars.is_empty() {
            bars.head(&mut svg, (bars_x, top + 4));
        }
        for (row, bar) in (0..).zip(&self.bars) {
            bars.draw(&mut svg, bar, (bars_x, top + 6 + row * ROW + ROW / 2));
        }
        draw_legend(&mut svg, &legend, (MARGIN, legend_y));
        svg.finish()
    }
}

/// A wire with its direction, if it has one.
fn wire(role: PinRole, inwards: &'static str, outwards: &'static str) -> &'static str {
    match role {
        PinRole::Supply | PinRole::Ground | PinRole::Programming => "---",
        PinRole::Idle => "   ",
        PinRole::Driven | PinRole::Output | PinRole::Register => outwards,
        PinRole::Clock | PinRole::Enable | PinRole::Control | PinRole::Input => inwards,
    }
}

const ROW: u32 = 26;
const MARGIN: u32 = 16;
const STUB: u32 = 30;
const LARGE: u32 = 15;
const SMALL: u32 = 12;
const MOST_ROOM: u32 = 240;
const BARS_TITLE: &str = "product terms: used/available";
const SAVED: &str = "#f3d9a4";
const INK: &str = "#222222";
const GREY: &str = "#666666";
const BODY: &str = "#f4f4f0";

/// The width for the names of a row, limited to what fits in a drawing.
fn room(pins: &[&PinMark]) -> u32 {
    pins.iter().map(|pin| width(&pin.name, SMALL)).max().unwrap_or(0).min(MOST_ROOM)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Top,
    Bottom,
}

/// Draws a pin at a point of the package's border: its leg, number, arrow and name.
fn draw_pin(svg: &mut Svg, pin: &PinMark, (x, y): (u32, u32), side: Side, room: u32) {
    let colour = pin.role.colour();
    let title = match (pin.number, pin.label.as_str()) {
        (Some(number), "") => format!("pin {number}: {}", pin.role.word()),
        (Some(number), label) => format!("pin {number}: {}, {label}", pin.role.word()),
        (None, "") => pin.role.word().to_owned(),
        (None, label) => format!("{}, {label}", pin.role.word()),
    };
    // The leg.
    let (leg_x, leg_y, leg_w, leg_h) = match side {
        Side::Left => (x - 8, y - 5, 8, 10),
        Side::Right => (x, y - 5, 8, 10),
        Side::Top => (x - 5, y - 8, 10, 8),
        Side::Bottom => (x - 5, y, 10, 8),
    };
    svg.element_with_title(
        "rect",
        &[
            ("x", leg_x.to_string()),
            ("y", leg_y.to_string()),
            ("width", leg_w.to_string()),
            ("height", leg_h.to_string()),
            ("fill", colour.to_owned()),
            ("stroke", INK.to_owned()),
        ],
        &title,
    );
    let number = pin.number.map(|pin| pin.to_string()).unwrap_or_default();
    let small = Pen { size: SMALL, colour: INK, is_bold: false };
    let (at, anchor) = match side {
        Side::Left => ((x + 6, y + 4), Anchor::Start),
        Side::Right => ((x - 6, y + 4), Anchor::End),
        Side::Top => ((x, y + 16), Anchor::Middle),
        Side::Bottom => ((x, y - 6), Anchor::Middle),
    };
    svg.text(at, anchor, small, &number, STUB * 2);
    // The arrow points towards the package for an input.
    let (near, far) = (10, STUB);
    let point = |distance: u32, aside: i64| {
        let shift = |base: u32| i64::from(base) + aside;
        match side {
            Side::Left => format!("{} {}", x - distance, shift(y)),
            Side::Right => format!("{} {}", x + distance, shift(y)),
            Side::Top => format!("{} {}", shift(x), y - distance),
            Side::Bottom => format!("{} {}", shift(x), y + distance),
        }
    };
    if pin.role != PinRole::Idle {
        svg.path(&format!("M{} L{}", point(near, 0), point(far, 0)), "none", colour);
    }
    let head = if pin.role.is_in() {
        Some((near, near + 8))
    } else if pin.role.is_out() {
        Some((far, far - 8))
    } else {
        None
    };
    if let Some((tip, base)) = head {
        let path = format!("M{} L{} L{} Z", point(tip, 0), point(base, -4), point(base, 4));
        svg.path(&path, colour, colour);
    }
    let is_dim = matches!(pin.role, PinRole::Idle | PinRole::Driven);
    let named = Pen { size: SMALL, colour: if is_dim { GREY } else { INK }, is_bold: false };
    let off = STUB + 6;
    match side {
        Side::Left => svg.text((x - off, y + 4), Anchor::End, named, &pin.name, room),
        Side::Right => svg.text((x + off, y + 4), Anchor::Start, named, &pin.name, room),
        Side::Top => svg.text_upwards((x + 4, y - off), Anchor::Start, named, &pin.name, room),
        Side::Bottom => svg.text_upwards((x + 4, y + off), Anchor::End, named, &pin.name, room),
    }
}

/// The layout of the bars, whose boxes all have the same size.
struct Bars {
    /// The width of the box of one term.
    term: u32,
    /// The width of the names; 0 if the adjacent pins have names.
    names: u32,
    /// The maximum number of terms of a bar.
    most: u32,
    n_bars: u32,
}

impl Bars {
    fn new(bars: &[Bar], is_named: bool) -> Self {
        let name = |bar: &Bar| width(&bar_name(bar), SMALL);
        let names = bars.iter().map(name).max().unwrap_or(0).min(MOST_ROOM);
        let most = bars.iter().map(Bar::n_drawn).max().unwrap_or(0);
        Bars {
            // A long bar has narrow boxes.
            term: (280 / most.max(1)).clamp(3, 14),
            names: if is_named { names + 10 } else { 0 },
            most,
            n_bars: u32::try_from(bars.len()).unwrap_or(0),
        }
    }

    fn height(&self) -> u32 {
        self.n_bars * ROW + 12
    }

    fn width(&self) -> u32 {
        if self.n_bars == 0 {
            return 0;
        }
        let drawn = self.names + self.most * self.term + 10 + width("999/999 (999)", SMALL);
        drawn.max(width(BARS_TITLE, SMALL))
    }

    fn head(&self, svg: &mut Svg, at: (u32, u32)) {
        let pen = Pen { size: SMALL, colour: GREY, is_bold: false };
        svg.text(at, Anchor::Start, pen, BARS_TITLE, u32::MAX);
    }

    fn draw(&self, svg: &mut Svg, bar: &Bar, (x, y): (u32, u32)) {
        let small = Pen { size: SMALL, colour: INK, is_bold: false };
        if self.names > 0 {
            svg.text((x, y + 4), Anchor::Start, small, &bar_name(bar), MOST_ROOM);
        }
        let x = x + self.names;
        let role = if bar.is_registered { PinRole::Register } else { PinRole::Output };
        let shown = bar.n_drawn();
        for term in 0..shown {
            let is_saved = term >= bar.used && bar.without.is_some_and(|without| term < without);
            let fill = match term {
                term if term < bar.used => role.colour(),
                _ if is_saved => SAVED,
                _ => "#ffffff",
            };
            let is_there = bar.available.is_none_or(|available| term < available);
            let stroke = if is_there { "#999999" } else { "#c0392b" };
            svg.rect(x + term * self.term, y - 7, self.term, 14, fill, stroke);
        }
        let mut text = bar.used.to_string();
        if let Some(available) = bar.available {
            text += &format!("/{available}");
        }
        if let Some(without) = bar.without.filter(|without| *without > bar.used) {
            text += &format!(" ({without})");
        }
        let at = (x + shown * self.term + 8, y + 4);
        svg.text(at, Anchor::Start, small, &text, MOST_ROOM);
    }
}

fn bar_name(bar: &Bar) -> String {
    match (bar.pin, bar.name.as_str()) {
        (Some(pin), "") => format!("{pin} spare"),
        (Some(pin), name) => format!("{pin} {name}"),
        (None, name) => name.to_owned(),
    }
}

/// Colours and their meanings: the roles that occur, in order, and saved terms.
fn legend(pins: &[PinMark], bars: &[Bar]) -> Vec<(&'static str, &'static str)> {
    let mut roles: Vec<PinRole> = pins.iter().map(|pin| pin.role).collect();
    roles.sort_unstable();
    roles.dedup();
    let is_saved = |bar: &Bar| bar.without.is_some_and(|without| without > bar.used);
    let saved = bars.iter().any(is_saved).then_some((SAVED, "saved by don't-cares"));
    roles.into_iter().map(|role| (role.colour(), role.word())).chain(saved).collect()
}

fn legend_width(legend: &[(&str, &str)]) -> u32 {
    legend.iter().map(|(_, word)| width(word, SMALL) + 34).sum()
}

fn draw_legend(svg: &mut Svg, legend: &[(&str, &str)], (mut x, y): (u32, u32)) {
    for (colour, word) in legend {
        svg.rect(x, y - 9, 10, 10, colour, INK);
        let pen = Pen { size: SMALL, colour: GREY, is_bold: false };
        svg.text((x + 16, y), Anchor::Start, pen, word, u32::MAX);
        x += width(word, SMALL) + 34;
    }
}

/// A pin of a device.
fn mark(chip: &Chip, device: &Device, pin: u32) -> PinMark {
    let here: Vec<_> = chip.signals.iter().filter(|signal| signal.pin == Some(pin)).collect();
    let cell = chip.cells.iter().find(|cell| cell.pin == Some(pin));
    let names: Vec<String> = here.iter().map(|signal| signal.on_pin()).collect();
    let labels = here.iter().map(|signal| signal.meta.label.as_str());
    let label = labels.filter(|label| !label.is_empty()).collect::<Vec<_>>().join(", ");
    let of = |role, name: &str| PinMark {
        number: Some(pin),
        name: name.to_owned(),
        label: label.clone(),
        role,
    };
    let name = names.join(" = ");
    if device.supplies.contains(&pin) {
        return of(PinRole::Supply, "Vcc");
    }
    if device.grounds.contains(&pin) {
        return of(PinRole::Ground, "GND");
    }
    if device.jtag_pins.contains(&pin) {
        return of(PinRole::Programming, "JTAG");
    }
    match here.first().map(|signal| signal.kind) {
        Some(Kind::Clock) => of(PinRole::Clock, &name),
        Some(Kind::Input(_) | Kind::Reset) => of(PinRole::Input, &name),
        Some(Kind::Flop(_) | Kind::Output(_) | Kind::Buried) => {
            let is_registered = cell.is_some_and(super::chip::Cell::is_registered);
            of(if is_registered { PinRole::Register } else { PinRole::Output }, &name)
        }
        None if chip.enables.contains(&pin) => of(PinRole::Enable, "/OE"),
        None if device.control_pins.contains(&pin)
            && chip.cells.iter().any(super::chip::Cell::is_registered) =>
        {
            of(PinRole::Control, "/PL")
        }
        None if device.clock == Clock::Pin(pin)
            && chip.cells.iter().any(super::chip::Cell::is_registered) =>
        {
            of(PinRole::Clock, "clock")
        }
        None => {
            let is_driven =
                chip.wakes.iter().any(|(known, level)| *known == pin && level.is_some());
            of(if is_driven { PinRole::Driven } else { PinRole::Idle }, "")
        }
    }
}

/// The pins of a symbol: the clock, inputs, then outputs.
fn ports(chip: &Chip) -> Vec<PinMark> {
    let port = |signal: &super::chip::Signal| {
        let role = match signal.kind {
            Kind::Clock => PinRole::Clock,
            Kind::Reset | Kind::Input(_) => PinRole::Input,
            Kind::Output(output) => match chip.circuit.outputs[output].registered {
                Some(_) => PinRole::Register,
                None => PinRole::Output,
            },
            // Equations show every register; a netlist shows only its inputs and outputs.
            Kind::Flop(_) | Kind::Buried if chip.cells.is_empty() => return None,
            Kind::Flop(_) => PinRole::Register,
            Kind::Buried => PinRole::Output,
        };
        Some(PinMark {
            number: signal.pin,
            name: signal.on_pin(),
            label: signal.meta.label.clone(),
            role,
        })
    };
    let mut ports: Vec<PinMark> = chip.signals.iter().filter_map(port).collect();
    ports.sort_by_key(|pin| (!pin.role.is_in(), pin.role != PinRole::Clock));
    ports
}

/// The bars of all macrocells: by pin, then those without one.
fn bars(chip: &Chip) -> Vec<Bar> {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let of_cell = |cell: &super::chip::Cell| Bar {
        pin: cell.pin,
        name: chip.names(cell).join(" = "),
        used: count(cell.n_terms()),
        available: cell.available,
        without: cell.count.without.map(|(found, _)| count(found)),
        is_registered: cell.is_registered(),
    };
    let mut bars: Vec<Bar> = chip.cells.iter().map(of_cell).collect();
    // A device with logic blocks has many spare macrocells, and the fitter chooses which of them a function uses.
    let is_open = |device: &&Device| chip.misfit.is_none() && device.blocks.is_none();
    if let Some(device) = chip.device.filter(is_open) {
        for cell in device.macrocells {
            if bars.iter().all(|bar| bar.pin != Some(cell.pin)) {
                bars.push(Bar {
                    pin: Some(cell.pin),
                    name: String::new(),
                    used: 0,
                    available: Some(cell.registered_terms.max(cell.combinational_terms)),
                    without: None,
                    is_registered: cell.registered_terms > 0,
                });
            }
        }
    }
    bars.sort_by_key(|bar| (bar.pin.is_none(), bar.pin));
    bars
}
