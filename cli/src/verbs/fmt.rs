//! `grafsynth fmt FILE…`.

use crate::args::Fmt;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use grafsynth_driver::format::Format;
use std::path::PathBuf;

pub(crate) fn run(session: &mut Session, arguments: &Fmt) -> Result<Exit, Stop> {
    let mut changed = Vec::new();
    let mut has_errors = false;
    for path in &arguments.files {
        let file = session.text(path)?;
        let Some(source) = session.sources.get(file) else { continue };
        let format = if path == "-" { Some(Format::Graf) } else { Format::of(path, &source.text) };
        let formatted = match format {
            Some(Format::Graf) => grafsynth_driver::convert::format_graf(file, &source.text),
            Some(Format::Rules) => grafsynth_driver::convert::format_rules(file, &source.text),
            Some(other) => {
                return Err(Stop::Input(format!(
                    "{path}: fmt formats charts (.graf .rules), not {}",
                    other.name()
                )));
            }
            None => return Err(Stop::Input(format!("{path}: fmt formats charts (.graf .rules)"))),
        };
        match formatted {
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
