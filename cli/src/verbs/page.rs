//! `grafsynth page FILE`.

use crate::args::Page;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::verbs::products;
use grafsynth_draw::{Options, layout};
use grafsynth_page::{page, reference};

/// The number of reactions of the reference run that a page repeats.
const REACTIONS: usize = 1000;

pub(crate) fn run(session: &mut Session, arguments: &Page) -> Result<Exit, Stop> {
    let file = &arguments.input.file;
    let (design, found) = session.net(&arguments.input)?;
    session.show(&found);
    if session.demands.refuse(&found) || session.is_impossible(&design.net) {
        return Ok(Exit::Errors);
    }
    // A page of a net without a drawing has a list of its steps instead.
    let options = Options { words: arguments.words, ..Options::default() };
    let picture = design.chart.as_ref().and_then(|chart| layout(chart, &options).ok());
    let reference = reference(&design.net, REACTIONS);
    let text = page(&design.net, picture.as_ref(), &reference).map_err(|found| {
        session.show(&found);
        Stop::Errors
    })?;
    products::write_text(session, products::target(arguments.output.as_deref(), file, "html"), text)
}
