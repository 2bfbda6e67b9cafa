//! Charts as drawings: a chart as its designer wrote it, in the notation of Grafcet (IEC 60848).
//!
//! ```text
//! let picture = draw::layout(&design, &Options::default())?;   // boxes, lines and texts with coordinates
//! let file = draw::svg(&picture);
//! ```
//!
//! The files in reading order: [`picture`] is the drawing as data. `content` turns a chart into symbols and links, with conditions written by `notation`;
//! `symbol` draws one symbol. `order`, `blocks` and `channels` lay out a graph: rows, columns, links. `sheet` puts the parts together, and `svg` writes them.
//!
//! The same chart gives the same drawing on every machine: all coordinates are whole numbers. docs/drawing.md lists the symbols with their meaning.

mod blocks;
mod channels;
mod content;
mod notation;
mod order;
pub mod picture;
mod sheet;
mod svg;
mod symbol;
mod text;

pub use picture::Picture;
pub use svg::{embedded, svg};

use grafsynth_ir::chart::{Chart, Design, Item, SettingKind};
use grafsynth_ir::net::Policy;

/// What is drawn, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// The name of the only chart to draw; `None` draws all charts and library charts.
    pub chart: Option<&'a str>,
    /// True for the words of the chart language in conditions, false for the signs of Grafcet.
    pub words: bool,
}

/// Why a design is not drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotDrawn {
    /// The chart with this name is a statechart.
    Statechart(String),
    /// There is no chart with the requested name; with the names that there are.
    NoChart(Vec<String>),
}

/// Lays out the charts of a design.
///
/// # Errors
/// Returns [`NotDrawn`] if a chart is a statechart, or if the requested chart does not exist.
pub fn layout(design: &Design, options: &Options<'_>) -> Result<Picture, NotDrawn> {
    let is_wanted = |chart: &&Chart| options.chart.is_none_or(|name| chart.name.text == name);
    let charts: Vec<&Chart> = design.charts.iter().filter(is_wanted).collect();
    if charts.is_empty() && (options.chart.is_some() || design.libraries.is_empty()) {
        let names = design.charts.iter().map(|chart| chart.name.text.clone());
        return Err(NotDrawn::NoChart(names.collect()));
    }
    let libraries = design.libraries.iter().filter(|_| options.chart.is_none());
    let parts = charts.iter().map(|chart| (&chart.name, &chart.items));
    let parts = parts.chain(libraries.map(|library| (&library.name, &library.items)));
    if let Some((name, _)) = { parts }.find(|(_, items)| items.iter().any(is_statechart)) {
        return Err(NotDrawn::Statechart(name.text.clone()));
    }
    let names: Vec<&str> = charts.iter().map(|chart| chart.name.text.as_str()).collect();
    let content = content::content(design, &charts, options.words);
    Ok(sheet::draw(&content, names.join(", ")))
}

fn is_statechart(item: &Item) -> bool {
    match item {
        Item::State(_) => true,
        Item::Setting(setting) => {
            matches!(setting.kind, SettingKind::Conflict(Policy::InnerFirst | Policy::OuterFirst))
        }
        _ => false,
    }
}
