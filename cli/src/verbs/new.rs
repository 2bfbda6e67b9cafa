//! `grafsynth new NAME`: a small project that builds and passes at once.

use crate::args::New;
use crate::exit::Exit;
use crate::files::{self, Output};
use std::path::Path;

const FILES: [(&str, &str); 4] = [
    ("NAME.graf", include_str!("../templates/chart.graf")),
    ("NAME.board", include_str!("../templates/chart.board")),
    ("NAME.csv", include_str!("../templates/chart.csv")),
    ("Makefile", include_str!("../templates/Makefile")),
];

pub(crate) fn run(arguments: &New, quiet: bool) -> Result<Exit, String> {
    let folder = Path::new(&arguments.name);
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_identifier = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_identifier {
        return Err(format!(
            "`{name}` cannot be the name of a chart: use letters, digits and _, not beginning with a digit"
        ));
    }
    if files::is_taken(folder) {
        return Err(format!("{} is there already", folder.display()));
    }
    let all: Vec<_> = FILES
        .iter()
        .map(|(file, text)| {
            let bytes = text.replace("NAME", name).into_bytes();
            let name = format!("{name}/{}", file.replace("NAME", name));
            Output { name, bytes, keep_existing: false }
        })
        .collect();
    files::write_in(files::folder_of(folder), &all)?;
    if !quiet {
        crate::print(&format!(
            "{} holds {name}.graf, {name}.board, {name}.csv and a Makefile\n",
            folder.display()
        ));
    }
    Ok(Exit::Done)
}
