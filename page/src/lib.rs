//! Charts as pages: one HTML file that shows a chart and runs it, without a server and without a network.
//!
//! ```text
//! let contents = Contents { picture: picture.as_ref(), language: Language::Fr, ..Contents::default() };
//! let text = page::page(&net, &reference(&net, 1000), &contents)?;          // plant.html
//! let engine = page::cut(&text, Cut::Engine)?;                              // its JavaScript, which node can run
//! ```
//!
//! The files in reading order: `program` writes the reaction program ([`grafsynth_ir::program`]) as JSON, `waits` what each transition waits for, `data`
//! everything that the page knows about the chart, `plant` the plant, `reference` the run of the simulator that each page repeats, `contents` what else is in a
//! page, and `html` the file. The JavaScript in `web` is `engine.js` and `session.js`, which run the program without a document, and the parts that show it. Nothing in a page
//! depends on text of the chart being code: the program is data, and what the user wrote is only displayed. The words of the interface are in `words.json`, in
//! all languages.

mod compact;
mod contents;
mod data;
mod html;
mod plant;
mod program;
mod reference;
mod waits;

pub use contents::{Contents, Language, SourceText};
pub use html::{Cut, base64, content_hash, cut};
pub use reference::{Reference, reference};

use crate::html::Drawing;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid};

/// The page of a net. The same arguments give the same bytes.
///
/// # Errors
/// If the net has no bounded program.
pub fn page(
    net: &Valid<Net>,
    reference: &Reference,
    contents: &Contents<'_>,
) -> Result<String, Vec<Diagnostic>> {
    let data = data::data(net, reference, contents)?;
    let drawing = contents.picture.map(|picture| Drawing {
        svg: grafsynth_draw::embedded(picture, &|element| key(element.span)),
        n_marks: picture.marks.len(),
    });
    let plant = if contents.plant.is_some() { &html::WITH_PLANT } else { &html::WITHOUT_PLANT };
    Ok(html::html(&net.name.text, &data, drawing.as_ref(), plant, contents.language))
}

/// The name by which the drawing and the data refer to an element: its location, because several steps of the net may be drawn once.
fn key(span: Span) -> String {
    format!("{}-{}-{}", span.file.0, span.start, span.end)
}
