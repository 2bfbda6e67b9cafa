//! Where `draw` and `page` write: the file that the user names, or one with the name of the input file.

use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::stem::FileStem;
use std::path::{Path, PathBuf};

/// The file to write: the named one, or `STEM.extension` for an input file, or standard output (`-`).
pub(super) fn target(named: Option<&Path>, file: &str, extension: &str) -> PathBuf {
    match (named, FileStem::of_path(file)) {
        (Some(path), _) => path.to_owned(),
        (None, Some(stem)) => PathBuf::from(format!("{}.{extension}", stem.as_str())),
        (None, None) => PathBuf::from("-"),
    }
}

/// True for standard output.
pub(super) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes a text to a file or to standard output, and reports the file.
pub(super) fn write_text(session: &Session, path: PathBuf, text: String) -> Result<Exit, Stop> {
    if is_stdout(&path) {
        crate::print(&text);
        return Ok(Exit::Done);
    }
    write(session, vec![(path, text.into_bytes())])
}

/// Writes files and reports them.
pub(super) fn write(session: &Session, files: Vec<(PathBuf, Vec<u8>)>) -> Result<Exit, Stop> {
    let names: Vec<String> = files.iter().map(|(path, _)| path.display().to_string()).collect();
    session.write_named(files)?;
    session.note(&format!("wrote {}\n", names.join(", ")));
    Ok(Exit::Done)
}
