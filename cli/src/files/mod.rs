//! Reading and writing files. This module writes all files of grafsynth: completely or not at all, and only to the requested places.
//!
//! A path that the user named is followed if it is a symbolic link. A name that grafsynth makes in a folder is never followed, because the link may come with
//! a chart from somebody else.

#![expect(
    clippy::disallowed_methods,
    reason = "this module is where the command line touches files"
)]

mod outputs;
mod staging;

use outputs::Outputs;
pub(crate) use outputs::{Hashed, Stale, hashed, sha256};
pub(crate) use staging::Output;
use staging::Staging;
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The default of `--source-limit`, the maximum size of a source: 64 MiB.
pub(crate) const SOURCE_LIMIT: u64 = 64 << 20;

/// Reads a text; `-` is standard input.
///
/// # Errors
/// The error of the system, a text longer than `limit` bytes, or the first byte that is not UTF-8; in the user's terms.
pub(crate) fn read_text(path: &str, limit: u64) -> Result<String, String> {
    let bytes = read_bytes(path, limit)?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
        format!("{path} is not UTF-8 text: byte {at}, in line {line}")
    })
}

/// The files that were read or looked for.
static TOUCHED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

fn touch(path: &Path) {
    let path = path.to_string_lossy().into_owned();
    TOUCHED.lock().unwrap_or_else(PoisonError::into_inner).insert(path);
}

/// The files that were read or looked for since the last call: a result may change if one of them does.
pub(crate) fn touched() -> BTreeSet<String> {
    std::mem::take(&mut *TOUCHED.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Locked while files are written; true once some were written.
static WRITING: Mutex<bool> = Mutex::new(false);

/// Waits until no files are being written, and blocks others from writing. Returns whether some were written before.
pub(crate) fn writing() -> MutexGuard<'static, bool> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// True if the path is a folder.
pub(crate) fn is_folder(path: &str) -> bool {
    path != "-" && Path::new(path).is_dir()
}

/// The name of the file `NAME.extension` in the folder of `path`, if it exists.
pub(crate) fn companion(path: &str, extension: &str) -> Option<String> {
    if path == "-" {
        return None;
    }
    let beside = Path::new(path).with_extension(extension);
    touch(&beside);
    let is_there = fs::symlink_metadata(&beside).is_ok_and(|data| !data.is_dir());
    (is_there && beside != Path::new(path)).then(|| beside.to_string_lossy().into_owned())
}

/// True for a symbolic link.
pub(crate) fn is_link(path: &str) -> bool {
    fs::symlink_metadata(path).is_ok_and(|data| data.is_symlink())
}

/// The files in and below a folder, in the order of their paths. Names that begin with a dot are skipped, and symbolic links to folders are not followed.
///
/// # Errors
/// The error of the system, or a name that is not UTF-8.
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
                // A broken link is reported when the file is read.
                let text = path.to_str().ok_or_else(|| cannot(&path, &"its name is not UTF-8"))?;
                found.push(text.to_owned());
            }
        }
    }
    found.sort_unstable();
    Ok(found)
}

/// Completes or removes the remains of a killed build in the folder; if that is impossible, reports why.
fn settle(folder: &Path) {
    if let Err(why) = Staging::settle(folder) {
        crate::print_error(&format!("grafsynth: {why}\n"));
    }
}

/// Reads the bytes of a file; `-` is standard input.
///
/// # Errors
/// The error of the system, or a file longer than `limit` bytes.
pub(crate) fn read_bytes(path: &str, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    if path != "-" {
        touch(Path::new(path));
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
    /// The output folder; a symbolic link is followed.
    pub(crate) folder: &'a Path,
    /// The beginning of the file name of the list of outputs.
    pub(crate) stem: &'a str,
    /// The texts that the outputs are made from.
    pub(crate) made_of: Vec<Hashed>,
    /// All files that were read, which must not be replaced.
    pub(crate) read: Vec<&'a str>,
    /// The outputs, with names relative to the folder.
    pub(crate) outputs: Vec<Output>,
}

impl Plan<'_> {
    /// The files of the same stem that stay in the folder but were made from older versions of the texts.
    pub(crate) fn stale(&self) -> Vec<Stale> {
        let list = self.folder.join(outputs::name_of(self.stem));
        let Ok(text) = read_bytes(&list.to_string_lossy(), SOURCE_LIMIT) else { return Vec::new() };
        Outputs::parse(self.stem, &text).stale(
            &self.made_of,
            |name| self.outputs.iter().any(|output| output.name == name),
            |name| self.folder.join(name).is_file(),
        )
    }

    /// Writes all outputs and the list of outputs, or nothing.
    ///
    /// # Errors
    /// The error of the system, a name that leads out of the folder or to a symbolic link, two outputs with the same name, or an output that would replace a
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

/// Writes files below a folder: all of them, or none.
///
/// # Errors
/// Like [`Plan::write`].
pub(crate) fn write_in(folder: &Path, outputs: &[Output]) -> Result<(), String> {
    let staging = Staging::begin(folder)?;
    let mut is_written = writing();
    staging.commit(outputs)?;
    *is_written = true;
    Ok(())
}

/// Writes files that the user named: those of one folder all or none. Special files (`/dev/null`, a pipe) are written to directly.
///
/// # Errors
/// The error of the system, in the user's terms.
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
                    "cannot write {}: it is a symbolic link to a missing file",
                    path.display()
                ));
            }
            Err(_) => path.clone(),
        };
        let name = target.file_name().and_then(|name| name.to_str());
        let name =
            name.ok_or_else(|| format!("cannot write {}: it is not a file name", path.display()))?;
        let output = Output { name: name.to_owned(), bytes, keep_existing: false };
        let folder = folder_of(&target);
        match by_folder.iter_mut().find(|(known, _)| known == folder) {
            Some((_, outputs)) => outputs.push(output),
            None => by_folder.push((folder.to_owned(), vec![output])),
        }
    }
    by_folder.iter().try_for_each(|(folder, outputs)| write_in(folder, outputs))
}

/// The folder that contains a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The canonical path of a file, the same for every spelling of its path; the path unchanged if there is no such file.
pub(crate) fn canonical(path: &str) -> String {
    std::fs::canonicalize(path)
        .map_or_else(|_| path.to_owned(), |path| path.to_string_lossy().into_owned())
}

/// True if there is a regular file with that name: not a folder, and not a special file.
pub(crate) fn exists(path: &Path) -> bool {
    path.is_file()
}

/// True if anything with that name exists.
pub(crate) fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// True if `path` does not exist and its folder is `root` or below it. The path comes from an untrusted text; the result reveals nothing
/// about other folders.
pub(crate) fn is_absent_within(path: &Path, root: &Path) -> bool {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")));
    let is_below = |folder: PathBuf| fs::canonicalize(root).is_ok_and(|it| folder.starts_with(it));
    folder.is_ok_and(is_below) && !is_taken(path)
}

/// The size of a regular file below `root`, after following symbolic links; `None` otherwise. The path comes from an untrusted text.
pub(crate) fn size_within(path: &Path, root: &Path) -> Option<u64> {
    touch(path);
    let path = fs::canonicalize(path).ok()?;
    let data = fs::metadata(&path).ok().filter(fs::Metadata::is_file)?;
    path.starts_with(fs::canonicalize(root).ok()?).then_some(data.len())
}
