//! Reading and writing files. All that grafsynth writes goes through here: whole or not at all, and only where it was told to.
//!
//! A path that the user named is followed where it is a symbolic link. A name that grafsynth makes in a folder never is, since the link may come with
//! a chart of somebody else's.

#![expect(
    clippy::disallowed_methods,
    reason = "this module is where the command line touches files"
)]

mod outputs;
mod staging;

use outputs::Outputs;
pub(crate) use outputs::{Hashed, Stale, hashed};
pub(crate) use staging::Output;
use staging::Staging;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The largest source that is read unless `--source-limit` says otherwise: 64 MiB.
pub(crate) const SOURCE_LIMIT: u64 = 64 << 20;

/// Reads a text; `-` is standard input.
///
/// # Errors
/// What the system says, that the text is longer than `limit` bytes, or the first byte that is not UTF-8; in the user's terms.
pub(crate) fn read_text(path: &str, limit: u64) -> Result<String, String> {
    let bytes = read_bytes(path, limit)?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
        format!("{path} is not UTF-8 text: byte {at}, in line {line}")
    })
}

/// Taken while files are written; true once some were.
static WRITING: Mutex<bool> = Mutex::new(false);

/// Waits until no files are being written, and keeps others from it. Whether some were written before.
pub(crate) fn writing() -> MutexGuard<'static, bool> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// True for a folder.
pub(crate) fn is_folder(path: &str) -> bool {
    path != "-" && Path::new(path).is_dir()
}

/// The name of the file `NAME.extension` beside `path`, if something of that name is there.
pub(crate) fn companion(path: &str, extension: &str) -> Option<String> {
    if path == "-" {
        return None;
    }
    let beside = Path::new(path).with_extension(extension);
    let is_there = fs::symlink_metadata(&beside).is_ok_and(|data| !data.is_dir());
    (is_there && beside != Path::new(path)).then(|| beside.to_string_lossy().into_owned())
}

/// True for a symbolic link.
pub(crate) fn is_link(path: &str) -> bool {
    fs::symlink_metadata(path).is_ok_and(|data| data.is_symlink())
}

/// The files in a folder and below it, in the order of their paths. What begins with a dot is not looked at, and symbolic links to folders are not followed.
///
/// # Errors
/// What the system says, or a name that is not UTF-8.
pub(crate) fn below(folder: &str) -> Result<Vec<String>, String> {
    let cannot =
        |path: &Path, why: &dyn std::fmt::Display| format!("cannot read {}: {why}", path.display());
    let mut found = Vec::new();
    let mut open = vec![PathBuf::from(folder)];
    while let Some(folder) = open.pop() {
        settle(&folder);
        for entry in fs::read_dir(&folder).map_err(|why| cannot(&folder, &why))? {
            let entry = entry.map_err(|why| cannot(&folder, &why))?;
            if entry.file_name().to_string_lossy().starts_with('.') {
                continue;
            }
            let path = entry.path();
            if entry.file_type().map_err(|why| cannot(&path, &why))?.is_dir() {
                open.push(path);
            } else if path.is_file() || !path.exists() {
                // A link that leads nowhere is for the reader to complain of.
                let text = path.to_str().ok_or_else(|| cannot(&path, &"its name is not UTF-8"))?;
                found.push(text.to_owned());
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Completes or removes what a build left in the folder that was killed there; says why, where that cannot be.
fn settle(folder: &Path) {
    if let Err(why) = Staging::settle(folder) {
        crate::print_error(&format!("grafsynth: {why}\n"));
    }
}

/// Reads the bytes of a file; `-` is standard input.
///
/// # Errors
/// What the system says, or that there are more than `limit` bytes.
pub(crate) fn read_bytes(path: &str, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    if path != "-" {
        settle(folder_of(Path::new(path)));
    }
    let taken = if path == "-" {
        io::stdin().lock().take(limit + 1).read_to_end(&mut bytes)
    } else {
        fs::File::open(path).and_then(|file| {
            if file.metadata().is_ok_and(|data| data.is_dir()) {
                return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a folder"));
            }
            file.take(limit + 1).read_to_end(&mut bytes)
        })
    };
    taken.map_err(|error| format!("cannot read {path}: {error}"))?;
    if bytes.len() as u64 > limit {
        return Err(format!("{path} is longer than {limit} bytes (see --source-limit)"));
    }
    Ok(bytes)
}

/// The outputs of a build.
pub(crate) struct Plan<'a> {
    /// Where they go; a symbolic link is followed.
    pub(crate) folder: &'a Path,
    /// What the name of the list of outputs begins with.
    pub(crate) stem: &'a str,
    /// The texts that decide what they are.
    pub(crate) made_of: Vec<Hashed>,
    /// All files that were read, which are not to be replaced.
    pub(crate) read: Vec<&'a str>,
    /// Their names below the folder, and what they shall hold.
    pub(crate) outputs: Vec<Output>,
}

impl Plan<'_> {
    /// The files of the same stem that stay in the folder and were made of other texts of the same names.
    pub(crate) fn stale(&self) -> Vec<Stale> {
        let list = self.folder.join(outputs::name_of(self.stem));
        let Ok(text) = read_bytes(&list.to_string_lossy(), SOURCE_LIMIT) else { return Vec::new() };
        Outputs::parse(self.stem, &text).stale(
            &self.made_of,
            |name| self.outputs.iter().any(|output| output.name == name),
            |name| self.folder.join(name).is_file(),
        )
    }

    /// Writes all of them and the list of outputs, or nothing.
    ///
    /// # Errors
    /// What the system says, a name that leads out of the folder or to a symbolic link, two outputs of one name, or an output that would replace a
    /// file that was read.
    pub(crate) fn write(mut self) -> Result<(), String> {
        let read: Vec<PathBuf> =
            self.read.iter().filter_map(|path| fs::canonicalize(path).ok()).collect();
        let staging = Staging::begin(self.folder)?;
        for output in &self.outputs {
            let path = self.folder.join(&output.name);
            if fs::canonicalize(&path).is_ok_and(|path| read.contains(&path))
                && !output.keep_existing
            {
                return Err(format!(
                    "cannot write {}: the build reads it; choose another folder with --output",
                    path.display()
                ));
            }
        }
        let name = outputs::name_of(self.stem);
        let before = fs::read(self.folder.join(&name)).unwrap_or_default();
        let mut list = Outputs::parse(self.stem, &before);
        let files = self.outputs.iter().map(|output| {
            (output.name.as_str(), (!output.keep_existing).then_some(output.bytes.as_slice()))
        });
        list.add(&self.made_of, files, |name| staging.has(name));
        let bytes = list.to_text().into_bytes();
        self.outputs.push(Output { name, bytes, keep_existing: false });
        let mut is_written = writing();
        staging.commit(&self.outputs)?;
        *is_written = true;
        Ok(())
    }
}

/// Writes files below a folder: all, or none.
///
/// # Errors
/// As [`Plan::write`].
pub(crate) fn write_in(folder: &Path, outputs: &[Output]) -> Result<(), String> {
    let staging = Staging::begin(folder)?;
    let mut is_written = writing();
    staging.commit(outputs)?;
    *is_written = true;
    Ok(())
}

/// Writes files that the user named: those of one folder all or none. What is no ordinary file (`/dev/null`, a pipe) is written to as it is.
///
/// # Errors
/// What the system says, in the user's terms.
pub(crate) fn write_named(files: Vec<(PathBuf, Vec<u8>)>) -> Result<(), String> {
    let mut by_folder: Vec<(PathBuf, Vec<Output>)> = Vec::new();
    for (path, bytes) in files {
        let say = |error: io::Error| format!("cannot write {}: {error}", path.display());
        let target = match fs::metadata(&path) {
            Ok(data) if data.is_file() => fs::canonicalize(&path).map_err(say)?,
            Ok(data) if data.is_dir() => {
                return Err(format!("cannot write {}: it is a folder", path.display()));
            }
            Ok(_) => {
                let file = fs::OpenOptions::new().write(true).open(&path);
                file.and_then(|mut file| file.write_all(&bytes)).map_err(say)?;
                continue;
            }
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(say(error)),
            Err(_) if path.is_symlink() => {
                return Err(format!(
                    "cannot write {}: it is a symbolic link that leads to no file",
                    path.display()
                ));
            }
            Err(_) => path.clone(),
        };
        let name = target.file_name().and_then(|name| name.to_str());
        let name =
            name.ok_or_else(|| format!("cannot write {}: it names no file", path.display()))?;
        let output = Output { name: name.to_owned(), bytes, keep_existing: false };
        let folder = folder_of(&target);
        match by_folder.iter_mut().find(|(known, _)| known == folder) {
            Some((_, outputs)) => outputs.push(output),
            None => by_folder.push((folder.to_owned(), vec![output])),
        }
    }
    by_folder.iter().try_for_each(|(folder, outputs)| write_in(folder, outputs))
}

/// The folder that a file lies in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// One name for all ways of writing the place of a file; the name itself where there is no such file.
pub(crate) fn canonical(path: &str) -> String {
    std::fs::canonicalize(path)
        .map_or_else(|_| path.to_owned(), |path| path.to_string_lossy().into_owned())
}

/// True if there is a file of that name: no folder, and nothing that has no end or makes its reader wait.
pub(crate) fn exists(path: &Path) -> bool {
    path.is_file()
}

/// True if there is anything of that name.
pub(crate) fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// The size of an ordinary file below `root`, wherever symbolic links lead; none for all else. A text that somebody else wrote names it.
pub(crate) fn size_within(path: &Path, root: &Path) -> Option<u64> {
    let path = fs::canonicalize(path).ok()?;
    let data = fs::metadata(&path).ok().filter(fs::Metadata::is_file)?;
    path.starts_with(fs::canonicalize(root).ok()?).then_some(data.len())
}
