//! The files that a run read, and whether they have changed since.

#![expect(clippy::disallowed_methods, reason = "this module looks at files and at the clock")]

use crate::files::sha256;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// The time between two reads of a file that is being written.
const PAUSE: Duration = Duration::from_millis(10);
/// How long a file that is empty or absent is given to come back: editors truncate a file before they write it, or replace it.
const PATIENCE: Duration = Duration::from_millis(400);
/// How long after a change a file is read even if its time of modification is the same: the clock of some file systems is coarse.
const COARSE: Duration = Duration::from_secs(2);

/// What the system says about a file without reading it: time of modification, length, and the number of the file.
type Stamp = Option<(Option<SystemTime>, u64, u64)>;

/// A file: its stamp, the hash of its content (`None` if there is no such file), and the moment of its last change.
#[derive(Debug)]
struct Known {
    stamp: Stamp,
    hash: Option<String>,
    changed: Option<Instant>,
}

/// The files that were seen.
pub(super) struct Seen {
    limit: u64,
    files: BTreeMap<String, Known>,
}

impl Seen {
    /// No files yet; of each, at most `limit` bytes are compared.
    pub(super) fn new(limit: u64) -> Self {
        Seen { limit, files: BTreeMap::new() }
    }

    /// Watches these files, too, from their present content on. Files that do not exist are watched until they do.
    pub(super) fn also(&mut self, paths: impl Iterator<Item = String>) {
        for path in paths {
            let limit = self.limit;
            self.files.entry(path).or_insert_with_key(|path| Known {
                stamp: stamp(path),
                hash: hash(path, limit),
                changed: None,
            });
        }
    }

    /// A file whose content has changed since it was read, when it is written completely as far as one can see; `None` if there is none.
    pub(super) fn changed(&mut self) -> Option<String> {
        let limit = self.limit;
        let mut first = None;
        for (path, known) in &mut self.files {
            let now = stamp(path);
            let is_young = known.changed.is_some_and(|changed| changed.elapsed() < COARSE);
            if now == known.stamp && !is_young {
                continue;
            }
            let settled = if now == known.stamp { hash(path, limit) } else { settled(path, limit) };
            known.stamp = stamp(path);
            if settled != known.hash {
                known.hash = settled;
                known.changed = Some(Instant::now());
                first.get_or_insert_with(|| path.clone());
            }
        }
        first
    }
}

fn stamp(path: &str) -> Stamp {
    let data = fs::metadata(path).ok()?;
    Some((data.modified().ok(), data.len(), number(&data)))
}

#[cfg(unix)]
fn number(data: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(data)
}

#[cfg(not(unix))]
fn number(_: &fs::Metadata) -> u64 {
    0
}

/// The hash of the first bytes of a file; `None` if it cannot be read.
fn hash(path: &str, limit: u64) -> Option<String> {
    let mut bytes = Vec::new();
    fs::File::open(path).ok()?.take(limit).read_to_end(&mut bytes).ok()?;
    Some(sha256(&bytes))
}

/// The hash when two reads in a row give the same, and the file is neither empty nor absent, unless it stays so.
fn settled(path: &str, limit: u64) -> Option<String> {
    let since = Instant::now();
    let mut before = hash(path, limit);
    loop {
        sleep(PAUSE);
        let now = hash(path, limit);
        let is_there = fs::metadata(path).is_ok_and(|data| data.len() > 0);
        if now == before && is_there || since.elapsed() > PATIENCE {
            return now;
        }
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::Seen;
    use std::fs;

    #[test]
    fn a_change_is_one_of_the_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let (a, b) = (path("a"), path("b"));
        fs::write(&a, "one").unwrap();
        let mut seen = Seen::new(1000);
        seen.also([a.clone(), b.clone()].into_iter());
        assert_eq!(seen.changed(), None);
        // Written again with the same content.
        fs::write(&a, "one").unwrap();
        assert_eq!(seen.changed(), None);
        fs::write(&a, "two").unwrap();
        assert_eq!(seen.changed().as_ref(), Some(&a));
        assert_eq!(seen.changed(), None);
        // Replaced by another file with its name, of the same length.
        fs::write(path("new"), "six").unwrap();
        fs::rename(path("new"), &a).unwrap();
        assert_eq!(seen.changed().as_ref(), Some(&a));
        // A file that did not exist.
        fs::write(&b, "x").unwrap();
        assert_eq!(seen.changed().as_ref(), Some(&b));
        // Deleted, and made again.
        fs::remove_file(&b).unwrap();
        assert_eq!(seen.changed().as_ref(), Some(&b));
        fs::write(&b, "x").unwrap();
        assert_eq!(seen.changed().as_ref(), Some(&b));
        assert_eq!(seen.changed(), None);
    }
}
