//! `grafsynth fmt FILE…`.

use crate::args::Fmt;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use grafsynth_driver::languages::{self, GRAF, Language};
use std::path::PathBuf;

pub(crate) fn run(session: &mut Session, arguments: &Fmt) -> Result<Exit, Stop> {
    let mut changed = Vec::new();
    let mut has_errors = false;
    for path in &arguments.files {
        let file = session.text(path)?;
        let Some(source) = session.sources.get(file) else { continue };
        let language = if path == "-" { Some(GRAF) } else { Language::of(path, &source.text) };
        let Some(canonical) = language.and_then(|language| language.canonical) else {
            let known = languages::extensions(|language| language.canonical.is_some());
            let other = language.map(|it| format!(", not {}", it.name)).unwrap_or_default();
            return Err(Stop::Input(format!("{path}: fmt formats charts ({known}){other}")));
        };
        match canonical(file, &source.text) {
            Err(found) => {
                session.show(&found);
                has_errors = true;
            }
            Ok(text) if path == "-" => crate::print(&text),
            Ok(text) if text == source.text => {}
            Ok(text) => changed.push((PathBuf::from(path), text.into_bytes())),
        }
    }
    if has_errors {
        return Err(Stop::Errors);
    }
    if arguments.check {
        for (path, _) in &changed {
            crate::print(&format!("{}: not in canonical form\n", path.display()));
        }
        return Ok(if changed.is_empty() { Exit::Done } else { Exit::Errors });
    }
    let paths: Vec<PathBuf> = changed.iter().map(|(path, _)| path.clone()).collect();
    files::write_named(changed)?;
    for path in &paths {
        session.note(&format!("formatted {}\n", path.display()));
    }
    Ok(Exit::Done)
}
