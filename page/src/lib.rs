//! Charts as pages: one HTML file that shows a chart and runs it, without a server and without a network.
//!
//! ```text
//! let text = page::page(&net, picture.as_ref(), &reference(&net, 1000))?;   // plant.html
//! let engine = page::cut(&text, Cut::Engine)?;                              // its JavaScript, which node can run
//! ```
//!
//! The files in reading order: `program` writes the reaction program ([`grafsynth_ir::program`]) as JSON, `waits` what each transition waits for, `data`
//! everything that the page knows about the chart, `reference` the run of the simulator that each page repeats, and `html` the file. The JavaScript is
//! `engine.js`, which runs the program without a document, and `page.js`, which shows it. Nothing in a page depends on text of the chart being code: the
//! program is data, and what the user wrote is only displayed.

mod data;
mod html;
mod program;
mod reference;
mod waits;

pub use html::{Cut, cut};
pub use reference::{Reference, reference};

use grafsynth_draw::Picture;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid};

/// The page of a net, with its drawing, if there is one. The same arguments give the same bytes.
///
/// # Errors
/// If the net has no bounded program.
pub fn page(
    net: &Valid<Net>,
    picture: Option<&Picture>,
    reference: &Reference,
) -> Result<String, Vec<Diagnostic>> {
    let data = data::data(net, reference)?;
    let drawing =
        picture.map(|picture| grafsynth_draw::embedded(picture, &|element| key(element.span)));
    Ok(html::html(&net.name.text, &data, drawing.as_deref()))
}

/// The name by which the drawing and the data refer to an element: its location, because several steps of the net may be drawn once.
fn key(span: Span) -> String {
    format!("{}-{}-{}", span.file.0, span.start, span.end)
}
