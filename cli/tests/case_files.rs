//! The files under `tests/cases`: which of them are cases, and the command in the first line of each.

#![allow(clippy::disallowed_methods, reason = "tests read files")]

use sha2::{Digest as _, Sha256};
use std::fs;
use std::path::{Path, PathBuf};

/// A file with a command in its first line.
pub(crate) struct Case {
    pub(crate) path: PathBuf,
    /// The external tools without which the accepted output cannot be reproduced.
    #[allow(dead_code, reason = "only one of the two test programs runs cases as they are")]
    pub(crate) tools: Vec<String>,
    /// The words of the command, with `{}` and `{out}`.
    words: Vec<String>,
}

impl Case {
    /// The folder of tests/cases.
    pub(crate) fn root() -> PathBuf {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/cases");
        root.canonicalize().expect("tests/cases is there")
    }

    /// All cases, in the order of their paths.
    pub(crate) fn all() -> Vec<Self> {
        let mut paths = files(&Self::root());
        paths.retain(|path| path.extension().is_some_and(|extension| extension != "out"));
        paths.into_iter().filter_map(Self::read).collect()
    }

    /// Reads a case; `None` for a file without a command, which belongs to another case.
    fn read(path: PathBuf) -> Option<Self> {
        let text = fs::read(&path).ok()?;
        let first = String::from_utf8_lossy(text.split(|byte| *byte == b'\n').next()?).into_owned();
        let (before, after) = first.split_once("run:")?;
        if before.contains(char::is_alphanumeric) {
            return None;
        }
        let ends = ["*/", "*)", "-->", "?>"];
        let line = ends.iter().fold(after.trim(), |line, end| line.trim_end_matches(end));
        let (command, tools) = line.split_once(" needs:").unwrap_or((line, ""));
        let mut words = split(command);
        if !words.iter().any(|word| word == "{}") {
            words.push("{}".to_owned());
        }
        let tools = tools.split_whitespace().map(str::to_owned).collect();
        Some(Self { path, tools, words })
    }

    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().expect("a case is in a folder")
    }

    pub(crate) fn file_name(&self) -> String {
        self.path.file_name().expect("a case has a name").to_string_lossy().into_owned()
    }

    /// The arguments of grafsynth if it writes to the folder `out`.
    pub(crate) fn arguments(&self, out: &str) -> Vec<String> {
        let name = self.file_name();
        let fill = |word: &String| word.replace("{out}", out).replace("{}", &name);
        self.words.iter().map(fill).collect()
    }

    /// The file with the accepted output.
    pub(crate) fn accepted(&self) -> PathBuf {
        self.beside("out")
    }

    /// The file or folder beside the case whose name has one more extension.
    pub(crate) fn beside(&self, extension: &str) -> PathBuf {
        let mut path = self.path.clone().into_os_string();
        path.push(".");
        path.push(extension);
        path.into()
    }
}

/// Whether a program can be started.
pub(crate) fn is_here(tool: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(tool).is_file())
}

/// Whether a missing tool is a failure.
pub(crate) fn is_ci() -> bool {
    std::env::var("CI").is_ok_and(|ci| ci == "true")
}

/// All files below a folder, sorted.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The files whose hash differs from that in a list of outputs. A file that belongs to the user has no hash in the list.
pub(crate) fn wrong_hashes(folder: &Path, list: &[u8]) -> Vec<String> {
    let list: serde_json::Value = serde_json::from_slice(list).expect("a list of outputs");
    let builds = list["builds"].as_array().expect("builds");
    let files = builds.iter().flat_map(|build| build["files"].as_array().expect("files"));
    let is_wrong = |file: &&serde_json::Value| {
        let bytes = fs::read(folder.join(file["name"].as_str().expect("a name")));
        let Ok(bytes) = bytes else { return true };
        let hash: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        file.get("sha256").is_some_and(|expected| *expected != hash)
    };
    files.filter(is_wrong).map(ToString::to_string).collect()
}

/// Splits at blanks; single and double quotes keep blanks together.
fn split(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word = String::new();
    let mut quote = None;
    let mut started = false;
    for c in line.chars() {
        match (quote, c) {
            (Some(q), c) if c == q => quote = None,
            (None, '\'' | '"') => {
                quote = Some(c);
                started = true;
            }
            (None, c) if c.is_whitespace() => {
                if started || !word.is_empty() {
                    words.push(std::mem::take(&mut word));
                }
                started = false;
            }
            (_, c) => word.push(c),
        }
    }
    if started || !word.is_empty() {
        words.push(word);
    }
    words
}
