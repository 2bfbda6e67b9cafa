//! Charts as drawings: a chart as its designer wrote it, in the notation of Grafcet (IEC 60848), and statecharts in that of UML.
//!
//! ```text
//! let picture = draw::layout(&design, &Options::default())?;   // boxes, lines and texts with coordinates
//! let file = draw::svg(&picture);
//! ```
//!
//! The files in reading order: [`picture`] is the drawing as data. `content` turns a chart into symbols and links, with conditions written by `notation`;
//! `symbol` draws one symbol. `order`, `blocks` and `channels` lay out a graph: rows, columns, links. Statecharts have a layout of their own: `states` turns a
//! chart into boxes inside of boxes, `vertex` draws one box, `routes` divides transitions at the borders of states, `container` lays out the inside of one
//! state, with `layers` for columns and `tracks` for links, and `nest` joins everything. [`overlay`] adds a situation or leaves blanks,
//! `sheet` puts the parts together, [`mod@waves`] draws traces, and `svg` writes everything.
//!
//! The same chart gives the same drawing on every machine: all coordinates are whole numbers. docs/drawing.md lists the symbols with their meaning.

mod blocks;
mod channels;
mod container;
mod content;
mod layers;
mod nest;
mod notation;
mod order;
pub mod overlay;
pub mod picture;
mod routes;
mod sheet;
mod states;
mod svg;
mod symbol;
mod text;
mod tracks;
mod vertex;
pub mod waves;

pub use overlay::Blank;
pub use picture::Picture;
pub use svg::{embedded, svg};
pub use waves::waves;

use grafsynth_ir::chart::{Chart, Design};

/// The charts to draw, and the notation of conditions.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// The name of the only chart to draw; `None` draws all charts and library charts.
    pub chart: Option<&'a str>,
    /// True for the words of the chart language in conditions, false for the signs of Grafcet.
    pub words: bool,
    /// The steps and states that are drawn as active, each by its name or with the names around it (`machine.p1`).
    pub active: &'a [String],
    /// What is left blank.
    pub blank: Blank,
}

/// Why a design is not drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotDrawn {
    /// There is no chart with the requested name; contains the existing names.
    NoChart(Vec<String>),
    /// There is no step or state with this name, which should be active.
    NoStep(String),
}

/// Lays out the charts of a design.
///
/// # Errors
/// Returns [`NotDrawn`] if the requested chart or an active step does not exist.
pub fn layout(design: &Design, options: &Options<'_>) -> Result<Picture, NotDrawn> {
    let is_wanted = |chart: &&Chart| options.chart.is_none_or(|name| chart.name.text == name);
    let charts: Vec<&Chart> = design.charts.iter().filter(is_wanted).collect();
    if charts.is_empty() && (options.chart.is_some() || design.libraries.is_empty()) {
        let names = design.charts.iter().map(|chart| chart.name.text.clone());
        return Err(NotDrawn::NoChart(names.collect()));
    }
    let names: Vec<&str> = charts.iter().map(|chart| chart.name.text.as_str()).collect();
    let mut content = content::content(design, &charts, options.words);
    overlay::mark_active(&mut content, options.active)?;
    overlay::leave_blank(&mut content, options.blank);
    Ok(sheet::draw(&content, names.join(", ")))
}
