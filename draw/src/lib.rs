//! Charts as drawings: a chart as its designer wrote it, in the notation of Grafcet (IEC 60848), and statecharts in that of UML.
//!
//! ```text
//! let picture = draw::layout(&design, &Options::default())?;   // boxes, lines and texts with coordinates
//! let file = draw::svg(&picture);
//! ```
//!
//! The files in reading order: [`picture`] is the drawing as data. `content` turns a chart into symbols and links, with conditions written by `notation`;
//! `symbol` draws one symbol; in the style of IEC 61131-3, `action_block` turns the items of a step into rows, which `stack` draws. `foreign` is the legend.
//! `order`, `blocks` and `channels` lay out a graph: rows, columns, links; `exchange` and `layered` look for fewer crossings. Statecharts have a layout of their
//! own: `states` turns a chart into boxes inside of boxes, `vertex` draws one box, `routes` divides transitions at the borders of states, `container` lays out the inside of one
//! state, with `layers` for columns and `tracks` for links, and `nest` joins everything. [`overlay`] adds a situation or leaves blanks,
//! `sheet` puts the parts together, [`mod@waves`] draws traces, `pages` cuts a drawing for paper, and `svg`, `pdf` and `png` write everything: `ink` has the
//! colours of the last two, and `raster` fills areas of pixels, also those of the letters that `outlines` contains.
//!
//! The same chart gives the same drawing on every machine: all coordinates are whole numbers. docs/drawing.md lists the symbols with their meaning.

mod action_block;
mod bars;
mod blocks;
mod channels;
mod columns;
mod container;
mod content;
mod continued;
mod ends;
mod exchange;
mod foreign;
mod grid;
mod ink;
mod layered;
mod layers;
mod nest;
mod notation;
mod notice;
mod order;
mod outlines;
pub mod overlay;
mod pages;
mod pdf;
pub mod picture;
mod png;
mod raster;
mod routes;
mod sheet;
mod stack;
mod states;
mod svg;
mod symbol;
mod text;
mod tracks;
mod trials;
mod vertex;
pub mod waves;

pub use bars::{BarRow, BarTable, bars};
pub use notice::{MarkedError, marked, noticed};
pub use overlay::{Blank, Counts, Frame, Part};
pub use pages::{Page, Paper, TitleBlock, pages};
pub use pdf::pdf;
pub use picture::Picture;
pub use png::{TooLarge, page_png, png};
pub use svg::{embedded, page_svg, svg};
pub use waves::waves;

use grafsynth_ir::chart::{Chart, Design};
use std::collections::BTreeSet;

/// A file with letters of its own, and not with text for the fonts of its reader.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rendered {
    /// The file.
    pub bytes: Vec<u8>,
    /// The characters that its fonts lack, which are question marks in it.
    pub missing: BTreeSet<char>,
}

/// The notation of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// Grafcet (IEC 60848), and UML for statecharts.
    #[default]
    Grafcet,
    /// Sequential function charts (IEC 61131-3): action blocks, and conditions in structured text. Statecharts are refused.
    Sfc,
}

/// The charts to draw, and the notation of conditions.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// The name of the only chart to draw; `None` draws all charts and library charts.
    pub chart: Option<&'a str>,
    /// The notation.
    pub style: Style,
    /// True for the words of the chart language in conditions, false for the signs of the style.
    pub words: bool,
    /// The steps and states that are drawn as active, each by its name or with the names around it (`machine.p1`).
    pub active: &'a [String],
    /// What is left blank.
    pub blank: Blank,
    /// The parts of a split; steps and transitions have the letter of their part, and steps its colour.
    pub parts: &'a [Part],
    /// How often steps were active and transitions fired.
    pub counts: Option<&'a Counts>,
    /// The paper for which the drawing is divided into [`pages`]: charts and expansions are beside each other only on the width of a page.
    pub paper: Option<Paper>,
}

/// Why a design is not drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotDrawn {
    /// There is no chart with the requested name; contains the existing names.
    NoChart(Vec<String>),
    /// There is no step or state with this name, which should be active.
    NoStep(String),
    /// One of the charts is a statechart, which cannot be drawn as a sequential function chart.
    Statechart,
}

/// Lays out the charts of a design.
///
/// # Errors
/// Returns [`NotDrawn`] if the requested chart or an active step does not exist, or if a statechart should be drawn as a sequential function chart.
pub fn layout(design: &Design, options: &Options<'_>) -> Result<Picture, NotDrawn> {
    let content = collected(design, options)?;
    Ok(sheet::draw(&content, title(design, options)))
}

/// Lays out the charts of a design once for each situation, as frames on one sheet, with the explanations once below.
///
/// # Errors
/// As [`layout`].
pub fn frames(
    design: &Design,
    options: &Options<'_>,
    frames: &[Frame],
) -> Result<Picture, NotDrawn> {
    let mut content = collected(design, options)?;
    let frames = frames.iter().map(|frame| {
        overlay::light(&mut content, &frame.active);
        sheet::framed(&content, &frame.title)
    });
    let frames = frames.collect();
    Ok(sheet::sheet(frames, &content, title(design, options)))
}

/// The names of the charts that are drawn.
fn title(design: &Design, options: &Options<'_>) -> String {
    let names = wanted(design, options).into_iter().map(|chart| chart.name.text.as_str());
    names.collect::<Vec<_>>().join(", ")
}

fn wanted<'d>(design: &'d Design, options: &Options<'_>) -> Vec<&'d Chart> {
    let is_wanted = |chart: &&Chart| options.chart.is_none_or(|name| chart.name.text == name);
    design.charts.iter().filter(is_wanted).collect()
}

/// What is drawn, with everything that the options add or leave out.
fn collected(design: &Design, options: &Options<'_>) -> Result<content::Content, NotDrawn> {
    let charts = wanted(design, options);
    if charts.is_empty() && (options.chart.is_some() || design.libraries.is_empty()) {
        let names = design.charts.iter().map(|chart| chart.name.text.clone());
        return Err(NotDrawn::NoChart(names.collect()));
    }
    let mut content = content::content(design, &charts, options.style, options.words);
    if options.style == Style::Sfc && content.scopes.iter().any(|scope| scope.states.is_some()) {
        return Err(NotDrawn::Statechart);
    }
    let is_plain =
        options.blank == Blank::default() && options.parts.is_empty() && options.counts.is_none();
    if !is_plain {
        overlay::keep_order(&mut content.scopes);
    }
    overlay::mark_active(&mut content, options.active)?;
    overlay::leave_blank(&mut content, options.blank);
    overlay::mark_parts(&mut content, options.parts);
    content.room = options.paper.map(Paper::widest);
    if let Some(counts) = options.counts {
        overlay::mark_counts(&mut content, counts);
    }
    Ok(content)
}
