//! `STEM.outputs.json`: the files of each build of a design in a folder, with their hashes and the hashes of the source texts.
//! The contents of this file are not trusted, because anybody can change it. It is used only for warnings.

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

/// The version of the format of this file.
const SCHEMA: u32 = 2;

/// The files that the builds of a design have left in a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Outputs {
    schema: u32,
    stem: String,
    /// The builds whose files are there, the newest first.
    builds: Vec<Build>,
}

/// The files that were made from the same texts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Build {
    grafsynth: String,
    sources: Vec<Hashed>,
    files: Vec<File>,
}

/// A text that a build was made from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Hashed {
    name: String,
    sha256: String,
}

/// A file that a build wrote.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
struct File {
    name: String,
    /// The hash of the written bytes; `None` for a file that belongs to the user from then on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sha256: Option<String>,
}

/// A file that was made from an older text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Stale {
    pub(crate) file: String,
    /// The text that has changed since.
    pub(crate) source: String,
}

/// The hash of a text with this name, as it was read.
pub(crate) fn hashed(name: &str, bytes: &[u8]) -> Hashed {
    Hashed { name: name.to_owned(), sha256: sha256(bytes) }
}

/// The name of the list of a design.
pub(crate) fn name_of(stem: &str) -> String {
    format!("{stem}.outputs.json")
}

impl Outputs {
    /// The list of a design without builds.
    pub(crate) fn new(stem: &str) -> Self {
        Outputs { schema: SCHEMA, stem: stem.to_owned(), builds: Vec::new() }
    }

    /// Parses the list of `stem`; returns an empty list if the text is something else or has an unknown version.
    pub(crate) fn parse(stem: &str, text: &[u8]) -> Self {
        serde_json::from_slice(text)
            .ok()
            .filter(|list: &Outputs| list.schema == SCHEMA && list.stem == stem)
            .unwrap_or_else(|| Self::new(stem))
    }

    /// The list as text, with a line break at its end.
    pub(crate) fn to_text(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Adds a build. `files` are the names, and the bytes of those that are not the user's; replaced and missing files are removed from the list.
    pub(crate) fn add<'a>(
        &mut self,
        sources: &[Hashed],
        files: impl Iterator<Item = (&'a str, Option<&'a [u8]>)>,
        is_there: impl Fn(&str) -> bool,
    ) {
        let grafsynth = env!("CARGO_PKG_VERSION").to_owned();
        let mut new = Build { grafsynth, sources: sources.to_vec(), files: Vec::new() };
        for (name, bytes) in files {
            let name = name.to_owned();
            new.files.push(File { name, sha256: bytes.map(sha256) });
        }
        for build in &mut self.builds {
            build.files.retain(|old| {
                is_there(&old.name) && new.files.iter().all(|file| file.name != old.name)
            });
        }
        // The same texts with another target count as one build.
        if let Some(at) = self
            .builds
            .iter()
            .position(|build| build.sources == new.sources && build.grafsynth == new.grafsynth)
        {
            new.files.append(&mut self.builds.remove(at).files);
        }
        new.files.sort_unstable();
        self.builds.retain(|build| !build.files.is_empty());
        self.builds.insert(0, new);
    }

    /// The files that would be left over from older versions of the same texts if these files were written now.
    pub(crate) fn stale(
        &self,
        sources: &[Hashed],
        written: impl Fn(&str) -> bool,
        is_there: impl Fn(&str) -> bool,
    ) -> Vec<Stale> {
        let mut all = Vec::new();
        for build in &self.builds {
            let changed = build.sources.iter().find(|old| {
                sources.iter().any(|now| now.name == old.name && now.sha256 != old.sha256)
            });
            let Some(changed) = changed else { continue };
            for file in &build.files {
                // A file of the user no longer comes from the chart.
                if file.sha256.is_some() && !written(&file.name) && is_there(&file.name) {
                    all.push(Stale { file: file.name.clone(), source: changed.name.clone() });
                }
            }
        }
        all
    }
}

/// The SHA-256 of some bytes, in hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::{Outputs, Stale, hashed};

    #[test]
    fn files_of_older_texts_are_named_until_they_are_gone_or_made_anew() {
        let (old, new) = ([hashed("lamp.graf", b"old")], [hashed("lamp.graf", b"new")]);
        let mut list = Outputs::new("lamp");
        let all = |_: &str| true;
        list.add(&old, [("lamp.c", Some(&b"1"[..])), ("user.c", None)].into_iter(), all);
        list.add(&old, [("lamp.v", Some(&b"2"[..]))].into_iter(), all);
        assert_eq!(list.builds.len(), 1, "the same texts");
        assert!(list.stale(&old, |_| false, all).is_empty());
        let stale = list.stale(&new, |name| name == "lamp.c", all);
        assert_eq!(stale, [Stale { file: "lamp.v".into(), source: "lamp.graf".into() }]);
        assert!(list.stale(&new, |name| name == "lamp.c", |name| name != "lamp.v").is_empty());
        list.add(&new, [("lamp.c", Some(&b"3"[..]))].into_iter(), all);
        assert_eq!(list.builds.len(), 2);
        assert_eq!(list, Outputs::parse("lamp", list.to_text().as_bytes()));
        list.add(&new, [("lamp.v", Some(&b"4"[..]))].into_iter(), |name| name != "user.c");
        assert_eq!(list.builds.len(), 1, "nothing of the old one is left: {}", list.to_text());
    }

    #[test]
    fn another_text_is_an_empty_list() {
        for text in [
            "",
            "{",
            "[]",
            r#"{"schema":1,"chart":"lamp","builds":[]}"#,
            r#"{"schema":2,"stem":"x","builds":[]}"#,
        ] {
            assert_eq!(Outputs::parse("lamp", text.as_bytes()), Outputs::new("lamp"), "{text}");
        }
    }
}
