//! Reading and writing files: whole or not at all.

#![expect(
    clippy::disallowed_methods,
    reason = "this module is where the command line touches files"
)]

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

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

/// Reads the bytes of a file; `-` is standard input.
///
/// # Errors
/// What the system says, or that there are more than `limit` bytes.
pub(crate) fn read_bytes(path: &str, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
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

/// Writes all files, or none: each goes to a temporary file in its folder first, and only when all are there are they renamed. Folders are made.
///
/// # Errors
/// What the system says, in the user's terms. Files that were there before are then untouched, unless a rename fails half-way, which names them;
/// folders that were made are gone again.
pub(crate) fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<(), String> {
    let mut staged: Vec<(PathBuf, &Path)> = Vec::new();
    let mut made: Vec<PathBuf> = Vec::new();
    let outcome = stage(files, &mut staged, &mut made);
    if outcome.is_err() {
        for (temporary, _) in &staged {
            // Best effort: what cannot be removed is a temporary file beside its target.
            let _ = fs::remove_file(temporary);
        }
        for folder in made.iter().rev() {
            // Only if it is empty: somebody else may have put something there.
            let _ = fs::remove_dir(folder);
        }
        return outcome;
    }
    let mut done: Vec<String> = Vec::new();
    for (temporary, path) in &staged {
        if let Err(error) = fs::rename(temporary, path) {
            let already = if done.is_empty() { "nothing".to_owned() } else { done.join(", ") };
            return Err(format!(
                "cannot replace {}: {error} ({already} was replaced)",
                path.display()
            ));
        }
        done.push(path.display().to_string());
    }
    Ok(())
}

fn stage<'a>(
    files: &'a [(PathBuf, Vec<u8>)],
    staged: &mut Vec<(PathBuf, &'a Path)>,
    made: &mut Vec<PathBuf>,
) -> Result<(), String> {
    for (path, bytes) in files {
        let say = |error: io::Error| format!("cannot write {}: {error}", path.display());
        let name = path.file_name().ok_or_else(|| format!("{} names no file", path.display()))?;
        if path.is_dir() {
            return Err(format!("cannot write {}: it is a folder", path.display()));
        }
        if let Some(folder) = path.parent() {
            let missing = folder.ancestors().take_while(|it| !it.as_os_str().is_empty());
            let missing: Vec<_> = missing.take_while(|it| !it.exists()).collect();
            made.extend(missing.iter().rev().map(|it| it.to_path_buf()));
            fs::create_dir_all(folder).map_err(say)?;
        }
        let temporary =
            path.with_file_name(format!(".{}.{}", name.to_string_lossy(), std::process::id()));
        staged.push((temporary.clone(), path));
        let mut file = fs::File::create(&temporary).map_err(say)?;
        file.write_all(bytes).map_err(say)?;
    }
    Ok(())
}

/// One name for all ways of writing the place of a file; the name itself where there is no such file.
pub(crate) fn canonical(path: &str) -> String {
    std::fs::canonicalize(path)
        .map_or_else(|_| path.to_owned(), |path| path.to_string_lossy().into_owned())
}

/// True if there is a file of that name.
pub(crate) fn exists(path: &Path) -> bool {
    path.exists()
}
