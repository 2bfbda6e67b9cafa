//! Writes all files or none: also after `kill -9`, with a full disk, and if another grafsynth writes to the same folder.
//!
//! While files are written, the folder contains one additional entry, [`ENTRY`]. It contains a lock, the new files, links to the files that
//! they replace, and the journal, which lists them. The write takes effect at the moment at which the journal is renamed:
//!
//! ```text
//! lock → new files, synced → links to the old ones → journal, synced → each new file is renamed into place → the entry is removed
//!        └ killed here: the next run removes the entry ┘               └ killed here: the next run completes the renames ┘
//! ```
//!
//! A rename that the system refuses (a file of another user in `/tmp`, an immutable file) turns the journal into an undo list: the old files are restored.
//! The journal is not trusted. Its names are checked like those of a new write, and it is valid only in the folder on disk in which it was begun
//! ([`Place`]). A journal that came with somebody's files, in an archive or a copy, replaces nothing.

use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The only entry that a write creates in a folder besides its files.
pub(crate) const ENTRY: &str = ".grafsynth-build";
const LOCK: &str = "lock";
const JOURNAL: &str = "journal";
const UNDO: &str = "undo";
/// The incomplete journal.
const PART: &str = "journal.part";
/// The time for which a write waits for another one in its folder. A write takes milliseconds, so one that takes longer than this is
/// suspended or hangs.
const PATIENCE: Duration = Duration::from_secs(30);
const GLANCE: Duration = Duration::from_millis(5);

/// A file to be written in a folder.
#[derive(Debug, Clone)]
pub(crate) struct Output {
    /// Its name; folders in it are separated by `/`.
    pub(crate) name: String,
    /// Its contents.
    pub(crate) bytes: Vec<u8>,
    /// The file belongs to the user: it is written only if no file with that name exists.
    pub(crate) keep_existing: bool,
}

/// The steps to do after all new files are written, as stored on disk.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Journal {
    /// The location of the entry in which it was written.
    #[serde(default)]
    place: Place,
    /// New folders, outer ones first.
    folders: Vec<String>,
    files: Vec<Move>,
}

/// The identity of a folder on this machine; a copy of the folder has another one.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
struct Place {
    device: u64,
    inode: u64,
}

impl Place {
    #[cfg(unix)]
    fn of(folder: &Path) -> io::Result<Place> {
        use std::os::unix::fs::MetadataExt as _;
        let data = fs::symlink_metadata(folder)?;
        Ok(Place { device: data.dev(), inode: data.ino() })
    }

    #[cfg(not(unix))]
    fn of(_: &Path) -> io::Result<Place> {
        Ok(Place::default())
    }
}

/// The destination of a new file, which has its index in [`Journal::files`] as its name until then.
#[derive(Debug, Serialize, Deserialize)]
struct Move {
    name: String,
    /// True if a file with that name existed; `old-INDEX` is then a link to it.
    replaces: bool,
    keep_existing: bool,
}

/// A folder that is locked against other writers while this value lives.
pub(crate) struct Staging {
    folder: PathBuf,
    entry: PathBuf,
    lock: Option<File>,
    /// Folders that were created for `folder`, outer ones first.
    made: Vec<PathBuf>,
    /// True if a write could be neither completed nor undone: it is left to a later run.
    is_stuck: bool,
}

impl Staging {
    /// Waits until nobody writes in `folder`, and completes or removes the remains of a killed run. The folder is created if it is missing.
    ///
    /// # Errors
    /// The error of the system, another run that has been writing there for 30 s, or a write by a killed run that can be neither completed nor undone.
    pub(crate) fn begin(folder: &Path) -> Result<Self, String> {
        let made = missing(folder);
        let mut staging = Self::wait(folder).inspect_err(|_| remove_folders(&made))?;
        staging.made = made;
        staging.recover()?;
        Ok(staging)
    }

    /// Creates the folder and waits for its lock.
    fn wait(folder: &Path) -> Result<Self, String> {
        let cannot = |error: io::Error| format!("cannot write in {}: {error}", folder.display());
        fs::create_dir_all(folder).map_err(|error| {
            if folder.exists() {
                format!("cannot write in {}: it is not a folder", folder.display())
            } else {
                cannot(error)
            }
        })?;
        let since = Instant::now();
        loop {
            if let Some(staging) = Self::try_begin(folder, true).map_err(cannot)? {
                return Ok(staging);
            }
            if since.elapsed() > PATIENCE {
                return Err(format!(
                    "cannot write in {}: another grafsynth has been writing there for {} s",
                    folder.display(),
                    PATIENCE.as_secs()
                ));
            }
            std::thread::sleep(GLANCE);
        }
    }

    /// Completes or removes the remains of a killed run in `folder`, unless somebody writes there now.
    ///
    /// # Errors
    /// The write can be neither completed nor undone.
    pub(crate) fn settle(folder: &Path) -> Result<(), String> {
        if fs::symlink_metadata(folder.join(ENTRY)).is_err() {
            return Ok(());
        }
        match Self::try_begin(folder, false) {
            Ok(Some(mut staging)) => staging.recover(),
            Ok(None) => Ok(()),
            Err(_) if !is_file(&folder.join(ENTRY).join(JOURNAL)) => Ok(()),
            Err(error) => Err(format!(
                "{} contains an incomplete write that cannot be completed: {error}",
                folder.join(ENTRY).display()
            )),
        }
    }

    /// Tries once to get the lock; `None` if another run has it, or, without `make`, if there is none.
    fn try_begin(folder: &Path, make: bool) -> io::Result<Option<Self>> {
        let entry = folder.join(ENTRY);
        if make && let Err(error) = fs::create_dir(&entry) {
            match fs::symlink_metadata(&entry) {
                Ok(data) if data.is_dir() => {}
                Ok(_) => {
                    return Err(io::Error::other(format!("{} is not a folder", entry.display())));
                }
                // The folder existed, and its creator has removed it in the meantime.
                Err(_) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
                Err(_) => return Err(error),
            }
        }
        let path = entry.join(LOCK);
        // A link with that name would create a file elsewhere.
        if fs::symlink_metadata(&path).is_ok_and(|data| !data.is_file()) {
            return Err(io::Error::other(format!("{} is not a file", path.display())));
        }
        let opened =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let lock = match opened {
            Ok(lock) => lock,
            // The previous owner of the lock has removed the entry.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            // A file system without locks: the journal still makes each write atomic.
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(error),
        }
        // The previous owner may have removed the file between our opening and locking it: then others lock another file with that name.
        if !is_same(&lock, &path) {
            return Ok(None);
        }
        if !is_ours(&entry)? {
            return Err(io::Error::other(format!(
                "{} belongs to another user: remove it, or choose another folder",
                entry.display()
            )));
        }
        let folder = folder.to_owned();
        let (made, is_stuck) = (Vec::new(), false);
        Ok(Some(Staging { folder, entry, lock: Some(lock), made, is_stuck }))
    }

    /// Writes these files, or none. Existing files that belong to the user are not changed.
    ///
    /// # Errors
    /// The error of the system, in the user's terms; all files are then unchanged.
    pub(crate) fn commit(mut self, outputs: &[Output]) -> Result<(), String> {
        let outputs: Vec<&Output> =
            outputs.iter().filter(|it| !it.keep_existing || !self.has(&it.name)).collect();
        let journal = self.stage(&outputs)?;
        self.publish(&journal)
            .map_err(|error| format!("cannot write in {}: {error}", self.folder.display()))?;
        self.complete(&journal)?;
        self.made.clear();
        Ok(())
    }

    /// Renames the journal. From here on the write has taken effect, whatever happens.
    fn publish(&self, journal: &Journal) -> io::Result<()> {
        let part = self.entry.join(PART);
        write_synced(&part, &serde_json::to_vec(journal)?)?;
        sync_folder(&self.entry)?;
        fs::rename(&part, self.entry.join(JOURNAL))?;
        sync_folder(&self.entry)?;
        sync_folder(&self.folder)
    }

    /// True if anything with that name exists.
    pub(crate) fn has(&self, name: &str) -> bool {
        fs::symlink_metadata(self.folder.join(name)).is_ok()
    }

    /// Writes the new files to the entry, and links to the files that they replace.
    fn stage(&self, outputs: &[&Output]) -> Result<Journal, String> {
        let cannot = |error| format!("cannot write in {}: {error}", self.folder.display());
        let place = Place::of(&self.entry).map_err(cannot)?;
        let mut journal = Journal { place, ..Journal::default() };
        for (index, output) in outputs.iter().enumerate() {
            // Some file systems are not case-sensitive.
            let twin = journal.files.iter().find(|it| it.name.eq_ignore_ascii_case(&output.name));
            if let Some(twin) = twin {
                return Err(format!(
                    "cannot write {} and {} into one folder",
                    twin.name, output.name
                ));
            }
            let replaces = self.check(&output.name)?;
            for folder in folders(&output.name) {
                let is_new = !is_folder(&self.folder.join(folder));
                if is_new && !journal.folders.iter().any(|it| it == folder) {
                    journal.folders.push(folder.to_owned());
                }
            }
            let target = self.folder.join(&output.name);
            let cannot = |error: io::Error| format!("cannot write {}: {error}", target.display());
            let staged = self.entry.join(index.to_string());
            write_synced(&staged, &output.bytes).map_err(cannot)?;
            if replaces {
                let data = fs::metadata(&target).map_err(cannot)?;
                fs::set_permissions(&staged, data.permissions()).map_err(cannot)?;
                let old = self.entry.join(format!("old-{index}"));
                if fs::hard_link(&target, &old).is_err() {
                    fs::copy(&target, &old).map_err(cannot)?;
                }
            }
            let name = output.name.clone();
            journal.files.push(Move { name, replaces, keep_existing: output.keep_existing });
        }
        Ok(journal)
    }

    /// Checks whether a file can be written under that name, and whether it replaces one.
    fn check(&self, name: &str) -> Result<bool, String> {
        if !is_inside(name) {
            return Err(format!(
                "cannot write `{name}`: it is not the name of a file in the folder"
            ));
        }
        let shown = |path: &Path| format!("cannot write {}", path.display());
        for folder in folders(name) {
            let path = self.folder.join(folder);
            match fs::symlink_metadata(&path) {
                Ok(data) if data.is_symlink() => {
                    return Err(format!(
                        "{}: {} is a symbolic link, which is not followed: remove it, or choose another folder",
                        shown(&self.folder.join(name)),
                        path.display()
                    ));
                }
                Ok(data) if !data.is_dir() => {
                    return Err(format!(
                        "{}: {} is not a folder",
                        shown(&self.folder.join(name)),
                        path.display()
                    ));
                }
                Ok(_) | Err(_) => {}
            }
        }
        let path = self.folder.join(name);
        let data = match fs::symlink_metadata(&path) {
            Ok(data) => data,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(format!("{}: {error}", shown(&path))),
        };
        let why = if data.is_symlink() {
            "it is a symbolic link, which is not followed: remove it, or choose another folder"
        } else if data.is_dir() {
            "it is a folder"
        } else if !data.is_file() {
            "it is not a file"
        } else if data.permissions().readonly() {
            "it is read-only"
        } else {
            return Ok(true);
        };
        Err(format!("{}: {why}", shown(&path)))
    }

    /// Renames the remaining new files into place; a killed run may have renamed some. Undoes everything if one cannot be renamed.
    fn complete(&mut self, journal: &Journal) -> Result<(), String> {
        let Err(why) = self.apply(journal) else { return Ok(()) };
        let undone = fs::rename(self.entry.join(JOURNAL), self.entry.join(UNDO))
            .and_then(|()| self.undo(journal));
        match undone {
            Ok(()) => Err(why),
            Err(error) => {
                self.is_stuck = true;
                Err(format!("{why}; the previous files cannot be restored: {error}"))
            }
        }
    }

    fn apply(&self, journal: &Journal) -> Result<(), String> {
        for folder in &journal.folders {
            let path = self.folder.join(folder);
            fs::create_dir_all(&path)
                .map_err(|error| format!("cannot create {}: {error}", path.display()))?;
        }
        for (index, file) in journal.files.iter().enumerate() {
            let staged = self.entry.join(index.to_string());
            if !is_file(&staged) {
                continue;
            }
            self.check(&file.name)?;
            if file.keep_existing && self.has(&file.name) {
                // The user has created it in the meantime.
                continue;
            }
            let target = self.folder.join(&file.name);
            fs::rename(&staged, &target)
                .map_err(|error| format!("cannot write {}: {error}", target.display()))?;
        }
        let parents = journal.files.iter().flat_map(|file| folders(&file.name));
        let mut parents: Vec<&str> = parents.collect();
        parents.sort_unstable();
        parents.dedup();
        for folder in parents {
            let path = self.folder.join(folder);
            sync_folder(&path)
                .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        }
        sync_folder(&self.folder)
            .map_err(|error| format!("cannot write in {}: {error}", self.folder.display()))
    }

    /// Restores the replaced files and removes the new ones.
    fn undo(&self, journal: &Journal) -> io::Result<()> {
        for (index, file) in journal.files.iter().enumerate() {
            if self.check(&file.name).is_err() {
                // The file could not be written, so it is unchanged.
                continue;
            }
            let target = self.folder.join(&file.name);
            let old = self.entry.join(format!("old-{index}"));
            let is_in_place = !is_file(&self.entry.join(index.to_string()));
            if file.replaces && is_file(&old) && is_in_place {
                fs::rename(old, target)?;
            } else if !file.replaces && is_in_place {
                remove(&target)?;
            }
        }
        for folder in journal.folders.iter().rev() {
            // The folder is removed only if it is empty, because somebody else may have added files.
            let _ = fs::remove_dir(self.folder.join(folder));
        }
        Ok(())
    }

    /// Completes or undoes the write in the entry, and empties the entry; reports it.
    fn recover(&mut self) -> Result<(), String> {
        let say = |what: &str| {
            let folder = self.folder.display();
            crate::print_error(&format!("grafsynth: {folder}: an interrupted write {what}\n"));
        };
        let is_there = |name: &str| is_file(&self.entry.join(name));
        let is_known = self.journal(UNDO).is_some() || self.journal(JOURNAL).is_some();
        if is_known {
            say("was completed");
        } else if is_there(UNDO) || is_there(JOURNAL) {
            say(
                "was not completed, because it was started in another folder and this folder is a copy",
            );
        }
        if let Some(journal) = self.journal(UNDO) {
            if let Err(error) = self.undo(&journal) {
                self.is_stuck = true;
                let entry = self.entry.display();
                return Err(format!("cannot undo the write in {entry}: {error}"));
            }
        } else if let Some(journal) = self.journal(JOURNAL)
            && let Err(why) = self.complete(&journal)
            && self.is_stuck
        {
            return Err(why);
        }
        self.empty();
        Ok(())
    }

    /// Reads a journal; `None` unless it is complete and names nothing outside the folder.
    fn journal(&self, name: &str) -> Option<Journal> {
        let path = self.entry.join(name);
        if !fs::symlink_metadata(&path).ok()?.is_file() {
            return None;
        }
        let journal: Journal = serde_json::from_slice(&fs::read(path).ok()?).ok()?;
        if journal.place != Place::of(&self.entry).ok()? {
            return None;
        }
        let mut names = journal.folders.iter().chain(journal.files.iter().map(|file| &file.name));
        names.all(|name| is_inside(name)).then_some(journal)
    }

    /// Removes the files of a write, the journal first: without it, the rest is meaningless. Best effort: the next run removes the remaining files.
    fn empty(&self) {
        for name in [JOURNAL, UNDO] {
            let _ = fs::remove_file(self.entry.join(name));
        }
        let _ = sync_folder(&self.entry);
        let Ok(entries) = fs::read_dir(&self.entry) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let is_ours = name.to_str().is_some_and(|name| {
                let number = name.strip_prefix("old-").unwrap_or(name);
                name == PART || number.bytes().all(|byte| byte.is_ascii_digit())
            });
            if is_ours {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if self.is_stuck {
            return;
        }
        self.empty();
        // Processes that wait for the lock see that the file is gone and start again; if one of them was quicker, the entry belongs to it.
        let _ = fs::remove_file(self.entry.join(LOCK));
        drop(self.lock.take());
        let _ = fs::remove_dir(&self.entry);
        remove_folders(&self.made);
    }
}

/// The folders of a name, outer ones first: `a`, `a/b` of `a/b/c`.
fn folders(name: &str) -> impl Iterator<Item = &str> {
    name.match_indices('/').map(|(at, _)| &name[..at])
}

/// True for the name of a file below the folder, outside [`ENTRY`].
fn is_inside(name: &str) -> bool {
    !name.is_empty()
        && !name.contains(['\\', '\0'])
        && !name.starts_with(".grafsynth-")
        && name.split('/').all(|part| !matches!(part, "" | "." | ".."))
        && Path::new(name).is_relative()
}

/// The missing folders on the path to `folder`, outer ones first.
fn missing(folder: &Path) -> Vec<PathBuf> {
    let all = folder.ancestors().take_while(|it| !it.as_os_str().is_empty() && !it.exists());
    let mut all: Vec<PathBuf> = all.map(Path::to_owned).collect();
    all.reverse();
    all
}

/// Removes the folders that are empty. A folder in which somebody else has added files is kept.
fn remove_folders(made: &[PathBuf]) {
    for folder in made.iter().rev() {
        let _ = fs::remove_dir(folder);
    }
}

/// True if the entry belongs to the current user. In a folder such as `/tmp`, another user could create a journal that lists files to
/// replace.
#[cfg(unix)]
fn is_ours(entry: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt as _;
    let probe = entry.join(PART);
    remove(&probe)?;
    let file = OpenOptions::new().write(true).create_new(true).open(&probe)?;
    let (ours, theirs) = (file.metadata()?.uid(), fs::symlink_metadata(entry)?.uid());
    remove(&probe)?;
    Ok(ours == theirs)
}

#[cfg(not(unix))]
fn is_ours(_: &Path) -> io::Result<bool> {
    Ok(true)
}

fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|data| data.is_file())
}

fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|data| data.is_dir())
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // The remains of a killed run may be a link to a file in the folder, which must not be written through.
    remove(path)?;
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Makes the names in a folder durable; does nothing if folders cannot be synced.
fn sync_folder(path: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    match File::open(path)?.sync_all() {
        Err(error)
            if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) =>
        {
            Ok(())
        }
        other => other,
    }
}

/// True if the locked file still has its name.
#[cfg(unix)]
fn is_same(lock: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    match (lock.metadata(), fs::symlink_metadata(path)) {
        (Ok(ours), Ok(named)) => ours.ino() == named.ino() && ours.dev() == named.dev(),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_same(_: &File, path: &Path) -> bool {
    path.is_file()
}
