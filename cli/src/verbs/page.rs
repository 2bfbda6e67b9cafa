//! `grafsynth page FILE`.

use crate::args::Page;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_draw::{Options, layout};
use grafsynth_driver::stem::FileStem;
use grafsynth_page::{page, reference};
use std::path::PathBuf;

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
    let output = arguments.output.clone().unwrap_or_else(|| match FileStem::of_path(file) {
        Some(stem) => PathBuf::from(format!("{}.html", stem.as_str())),
        None => PathBuf::from("-"),
    });
    if output.as_os_str() == "-" {
        crate::print(&text);
        return Ok(Exit::Done);
    }
    session.write_named(vec![(output.clone(), text.into_bytes())])?;
    session.note(&format!("wrote {}\n", output.display()));
    Ok(Exit::Done)
}
