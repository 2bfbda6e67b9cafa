//! `grafsynth page FILE`.

use crate::args::{Page, PageLanguage};
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::verbs::products;
use grafsynth_draw::{Options, layout};
use grafsynth_page::{Contents, Language, SourceText, page, reference};
use std::path::Path;

/// The number of reactions of the reference run that a page repeats.
const REACTIONS: usize = 1000;

pub(crate) fn run(session: &mut Session, arguments: &Page) -> Result<Exit, Stop> {
    let file = &arguments.input.file;
    let (design, found) = session.net(&arguments.input)?;
    session.show(&found);
    if session.demands.refuse(&found) || session.is_impossible(&design.net) {
        return Ok(Exit::Errors);
    }
    let plant = session.plant(&design.net, file, arguments.plant.as_deref())?;
    // A page of a net without a drawing has a list of its steps instead.
    let options = Options { words: arguments.words, ..Options::default() };
    let picture = design.chart.as_ref().and_then(|chart| layout(chart, &options).ok());
    let reference = reference(&design.net, REACTIONS);
    let sources = if arguments.no_source { Vec::new() } else { sources(session) };
    let language = language(arguments.language);
    let contents =
        Contents { picture: picture.as_ref(), sources: &sources, plant: plant.as_ref(), language };
    let text = match page(&design.net, &reference, &contents) {
        Ok(text) => text,
        Err(found) => {
            session.show(&found);
            return Err(Stop::Errors);
        }
    };
    products::write_text(session, products::target(arguments.output.as_deref(), file, "html"), text)
}

/// All texts that were read, each with the name of its file but not its folder: a page may be sent to others.
fn sources(session: &Session) -> Vec<SourceText<'_>> {
    let all = session.sources.iter();
    all.map(|(file, source)| SourceText { file, name: name(&source.path), text: &source.text })
        .collect()
}

fn name(path: &str) -> &str {
    Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
}

fn language(chosen: PageLanguage) -> Language {
    match chosen {
        PageLanguage::En => Language::En,
        PageLanguage::Fr => Language::Fr,
        PageLanguage::De => Language::De,
        PageLanguage::Es => Language::Es,
        PageLanguage::Pt => Language::Pt,
    }
}
