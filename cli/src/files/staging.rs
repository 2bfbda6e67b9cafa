//! All files of one write, or none: also under `kill -9`, a full disk, and another grafsynth that writes into the same folder.
//!
//! The folder has one entry of ours while files are written, [`ENTRY`]. In it are a lock, the new files, links to the files that they replace, and
//! the journal, which names them. The moment at which the journal gets its name is the moment at which the write has happened:
//!
//! ```text
//! lock → new files, synced → links to the old ones → journal, synced → each new file is renamed into place → the entry is removed
//!        └ killed here: the next run removes the entry ┘               └ killed here: the next run completes the renames ┘
//! ```
//!
//! A rename that the system refuses (a file of another user in `/tmp`, an immutable one) turns the journal into an undo list: the old files come back.
//! What the journal says is not trusted: its names are checked as those of a new write are, and it holds only in the very folder on disk in which it was
//! begun ([`Place`]): one that came with somebody's files, in an archive or a copy, replaces nothing.

use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The one entry that a write makes in a folder beside its files.
pub(crate) const ENTRY: &str = ".grafsynth-build";
const LOCK: &str = "lock";
const JOURNAL: &str = "journal";
const UNDO: &str = "undo";
/// The journal before it is whole.
const PART: &str = "journal.part";
/// How long a write waits for another one in its folder. A write takes milliseconds: whatever is longer is stopped or hangs.
const PATIENCE: Duration = Duration::from_secs(30);
const GLANCE: Duration = Duration::from_millis(5);

/// A file to be written in a folder.
#[derive(Debug, Clone)]
pub(crate) struct Output {
    /// Its name; folders in it are parted by `/`.
    pub(crate) name: String,
    /// What it shall hold.
    pub(crate) bytes: Vec<u8>,
    /// It is the user's: written only where no file of that name is.
    pub(crate) keep_existing: bool,
}

/// What has to be done when all new files are there, as it is kept on disk.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Journal {
    /// Where the entry is that it was written in.
    #[serde(default)]
    place: Place,
    /// Folders that are made, outer ones first.
    folders: Vec<String>,
    files: Vec<Move>,
}

/// What tells a folder on this machine from a copy of it.
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

/// The new file `index` and where it goes.
#[derive(Debug, Serialize, Deserialize)]
struct Move {
    name: String,
    /// A file of that name was there, and `old-index` is a link to it.
    replaces: bool,
    keep_existing: bool,
}

/// A folder in which nobody else writes while this value lives.
pub(crate) struct Staging {
    folder: PathBuf,
    entry: PathBuf,
    lock: Option<File>,
    /// Folders that were made for `folder`, outer ones first.
    made: Vec<PathBuf>,
    /// A write that could neither be completed nor undone: it is left to a later run.
    is_stuck: bool,
}

impl Staging {
    /// Waits until nobody writes in `folder`, and completes or removes what a killed run left there. The folder is made where it is missing.
    ///
    /// # Errors
    /// What the system says, that another run has been writing there for 30 s, or that a write by a killed run can neither be completed nor undone.
    pub(crate) fn begin(folder: &Path) -> Result<Self, String> {
        let made = missing(folder);
        let mut staging = Self::wait(folder).inspect_err(|_| remove_folders(&made))?;
        staging.made = made;
        staging.recover()?;
        Ok(staging)
    }

    /// Makes the folder and waits for its lock.
    fn wait(folder: &Path) -> Result<Self, String> {
        let cannot = |error: io::Error| format!("cannot write in {}: {error}", folder.display());
        fs::create_dir_all(folder).map_err(cannot)?;
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

    /// Completes or removes what a killed run left in `folder`, if it left something and nobody writes there now.
    ///
    /// # Errors
    /// That it can neither be completed nor undone.
    pub(crate) fn settle(folder: &Path) -> Result<(), String> {
        if fs::symlink_metadata(folder.join(ENTRY)).is_err() {
            return Ok(());
        }
        match Self::try_begin(folder, false) {
            Ok(Some(mut staging)) => staging.recover(),
            Ok(None) => Ok(()),
            Err(_) if !is_file(&folder.join(ENTRY).join(JOURNAL)) => Ok(()),
            Err(error) => Err(format!(
                "{} holds a write that was not completed, and it cannot be now: {error}",
                folder.join(ENTRY).display()
            )),
        }
    }

    /// One try to get the lock; none if another one has it, or, without `make`, if there is none.
    fn try_begin(folder: &Path, make: bool) -> io::Result<Option<Self>> {
        let entry = folder.join(ENTRY);
        if make && let Err(error) = fs::create_dir(&entry) {
            match fs::symlink_metadata(&entry) {
                Ok(data) if data.is_dir() => {}
                Ok(_) => {
                    return Err(io::Error::other(format!("{} is not a folder", entry.display())));
                }
                // It was there, and the one that had made it has removed it.
                Err(_) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
                Err(_) => return Err(error),
            }
        }
        let path = entry.join(LOCK);
        // Through a link of that name a file elsewhere would be made.
        if fs::symlink_metadata(&path).is_ok_and(|data| !data.is_file()) {
            return Err(io::Error::other(format!("{} is not a file", path.display())));
        }
        let opened =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let lock = match opened {
            Ok(lock) => lock,
            // The one that had the lock has removed the entry.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            // A file system without locks: the journal still makes each write whole.
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(error),
        }
        // The one that had the lock may have removed the file between our opening and locking it: then others lock another file of that name.
        if !is_same(&lock, &path) {
            return Ok(None);
        }
        if !is_ours(&entry)? {
            return Err(io::Error::other(format!(
                "{} is of another user: remove it, or choose another folder",
                entry.display()
            )));
        }
        let folder = folder.to_owned();
        let (made, is_stuck) = (Vec::new(), false);
        Ok(Some(Staging { folder, entry, lock: Some(lock), made, is_stuck }))
    }

    /// Writes these files, or none. Those that are the user's and are there already are left alone.
    ///
    /// # Errors
    /// What the system says, in the user's terms; all files are then as they were.
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

    /// Gives the journal its name. From here on the write has happened, whatever comes.
    fn publish(&self, journal: &Journal) -> io::Result<()> {
        let part = self.entry.join(PART);
        write_synced(&part, &serde_json::to_vec(journal)?)?;
        sync_folder(&self.entry)?;
        fs::rename(&part, self.entry.join(JOURNAL))?;
        sync_folder(&self.entry)?;
        sync_folder(&self.folder)
    }

    /// True if there is a file of that name, or anything else.
    pub(crate) fn has(&self, name: &str) -> bool {
        fs::symlink_metadata(self.folder.join(name)).is_ok()
    }

    /// Writes the new files into the entry, and links to those that they replace.
    fn stage(&self, outputs: &[&Output]) -> Result<Journal, String> {
        let cannot = |error| format!("cannot write in {}: {error}", self.folder.display());
        let place = Place::of(&self.entry).map_err(cannot)?;
        let mut journal = Journal { place, ..Journal::default() };
        for (index, output) in outputs.iter().enumerate() {
            // Some file systems take names that differ in letter case for one.
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

    /// Whether a file can be written under that name, and whether it replaces one.
    fn check(&self, name: &str) -> Result<bool, String> {
        if !is_inside(name) {
            return Err(format!("cannot write `{name}`: it is no name of a file in a folder"));
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

    /// Renames the new files into place: those that are still here, since a killed run may have done a part. Undoes all if one cannot be renamed.
    fn complete(&mut self, journal: &Journal) -> Result<(), String> {
        let Err(why) = self.apply(journal) else { return Ok(()) };
        let undone = fs::rename(self.entry.join(JOURNAL), self.entry.join(UNDO))
            .and_then(|()| self.undo(journal));
        match undone {
            Ok(()) => Err(why),
            Err(error) => {
                self.is_stuck = true;
                Err(format!("{why}; nor can the files of before come back: {error}"))
            }
        }
    }

    fn apply(&self, journal: &Journal) -> Result<(), String> {
        for folder in &journal.folders {
            let path = self.folder.join(folder);
            fs::create_dir_all(&path)
                .map_err(|error| format!("cannot make {}: {error}", path.display()))?;
        }
        for (index, file) in journal.files.iter().enumerate() {
            let staged = self.entry.join(index.to_string());
            if !is_file(&staged) {
                continue;
            }
            self.check(&file.name)?;
            if file.keep_existing && self.has(&file.name) {
                // The user has made it since.
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

    /// Brings the replaced files back and removes the new ones.
    fn undo(&self, journal: &Journal) -> io::Result<()> {
        for (index, file) in journal.files.iter().enumerate() {
            if self.check(&file.name).is_err() {
                // It could not be written, so it is as it was.
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
            // Only if it is empty: somebody else may have put something there.
            let _ = fs::remove_dir(self.folder.join(folder));
        }
        Ok(())
    }

    /// Completes or undoes what the entry holds, and empties it; says so.
    fn recover(&mut self) -> Result<(), String> {
        let say = |what: &str| {
            let folder = self.folder.display();
            crate::print_error(&format!("grafsynth: {folder}: a write that was stopped {what}\n"));
        };
        let is_there = |name: &str| is_file(&self.entry.join(name));
        let is_known = self.journal(UNDO).is_some() || self.journal(JOURNAL).is_some();
        if is_known {
            say("is completed now");
        } else if is_there(UNDO) || is_there(JOURNAL) {
            say("was begun in another folder, of which this is a copy: it is not completed");
        }
        if let Some(journal) = self.journal(UNDO) {
            if let Err(error) = self.undo(&journal) {
                self.is_stuck = true;
                let entry = self.entry.display();
                return Err(format!("cannot undo the write that {entry} holds: {error}"));
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

    /// A journal that is whole and names nothing outside the folder.
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

    /// Removes what a write needs, the journal first: without it, the rest means nothing. Best effort: what stays, the next run removes.
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
        // Those who wait for the lock see that the file is gone and begin anew; if one of them was quicker, the entry is theirs.
        let _ = fs::remove_file(self.entry.join(LOCK));
        drop(self.lock.take());
        let _ = fs::remove_dir(&self.entry);
        remove_folders(&self.made);
    }
}

/// The folders that a name lies in, outer ones first: `a`, `a/b` of `a/b/c`.
fn folders(name: &str) -> impl Iterator<Item = &str> {
    name.match_indices('/').map(|(at, _)| &name[..at])
}

/// True for a name that leads to a file below the folder and not to an entry of ours.
fn is_inside(name: &str) -> bool {
    !name.is_empty()
        && !name.contains(['\\', '\0'])
        && !name.starts_with(".grafsynth-")
        && name.split('/').all(|part| !matches!(part, "" | "." | ".."))
        && Path::new(name).is_relative()
}

/// The folders on the way to `folder` that are not there, outer ones first.
fn missing(folder: &Path) -> Vec<PathBuf> {
    let all = folder.ancestors().take_while(|it| !it.as_os_str().is_empty() && !it.exists());
    let mut all: Vec<PathBuf> = all.map(Path::to_owned).collect();
    all.reverse();
    all
}

/// Removes folders that are empty: where one is not, somebody else has put something there.
fn remove_folders(made: &[PathBuf]) {
    for folder in made.iter().rev() {
        let _ = fs::remove_dir(folder);
    }
}

/// True if the entry is of the user who runs us. In a folder like `/tmp` somebody else could have a journal there that tells us what to replace.
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
    // What a killed run left under that name may be a link to a file in the folder: it is not written through.
    remove(path)?;
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Makes the names in a folder last; a no-op where folders cannot be synced.
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

/// True if the file that was locked still has its name.
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
