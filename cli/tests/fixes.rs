//! Each edit that a finding proposes fixes it: after the edit, the finding is gone.
//!
//! The texts are the golden cases and the examples of the pages of codes.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use crate::case_files::Case;
use crate::pages;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn each_proposed_edit_mends_its_finding() {
    let mut tried = BTreeSet::new();
    let mut wrong = Vec::new();
    for case in Case::all() {
        // The accepted output shows an edit as a separate part; a case without one need not be run.
        let accepted = fs::read_to_string(case.accepted()).unwrap_or_default();
        if !accepted.contains("\nhelp: ") {
            continue;
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        copy(case.folder(), folder.path());
        mend(&case.file_name(), folder.path(), &case.arguments("made"), &mut tried, &mut wrong);
    }
    for (code, page) in pages::pages() {
        let (folder, arguments) = pages::prepare(&page);
        mend(&code, folder.path(), &arguments, &mut tried, &mut wrong);
    }
    println!("{} codes with edits: {tried:?}", tried.len());
    assert!(tried.len() > 20, "edits are shown and found");
    assert!(wrong.is_empty(), "{} edits do not mend:\n{}", wrong.len(), wrong.join("\n"));
}

/// Applies each edit by itself.
fn mend(
    name: &str,
    folder: &Path,
    arguments: &[String],
    tried: &mut BTreeSet<String>,
    wrong: &mut Vec<String>,
) {
    let before = findings(folder, arguments);
    for finding in before.iter().filter(|finding| finding["data"]["fix"].is_object()) {
        let fix = &finding["data"]["fix"];
        let path = folder.join(fix["file"].as_str().expect("a file"));
        let Ok(text) = fs::read_to_string(&path) else { continue };
        let (start, end) =
            (offset(&text, &fix["range"]["start"]), offset(&text, &fix["range"]["end"]));
        let new = fix["newText"].as_str().expect("a text");
        fs::write(&path, format!("{}{new}{}", &text[..start], &text[end..])).expect("a copy");
        let same = |all: &[Value]| {
            let is_same =
                |one: &&Value| ["code", "message"].iter().all(|key| one[*key] == finding[*key]);
            all.iter().filter(is_same).count()
        };
        let after = findings(folder, arguments);
        fs::write(&path, &text).expect("a copy");
        tried.insert(finding["code"].as_str().expect("a code").to_owned());
        if same(&after) >= same(&before) {
            wrong.push(format!("{name}: {}: {} -> {new:?}", finding["code"], finding["message"]));
        }
    }
}

/// The findings of a run, as data.
fn findings(folder: &Path, arguments: &[String]) -> Vec<Value> {
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(arguments)
        .args(["--message-format", "json"])
        .current_dir(folder)
        .output()
        .expect("grafsynth starts");
    let lines = [output.stdout, output.stderr].concat();
    String::from_utf8_lossy(&lines)
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .filter(|value| value["kind"] == "finding")
        .collect()
}

/// The byte offset of a position, which is a line and a number of UTF-16 code units.
fn offset(text: &str, place: &Value) -> usize {
    let number =
        |key: &str| usize::try_from(place[key].as_u64().expect("a number")).expect("small");
    let line_start: usize = text.split_inclusive('\n').take(number("line")).map(str::len).sum();
    let mut units = 0;
    let line = &text[line_start..];
    let in_line = line.char_indices().find(|(_, c)| {
        let is_there = units >= number("character");
        units += c.len_utf16();
        is_there
    });
    line_start + in_line.map_or(line.len(), |(at, _)| at)
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("a folder") {
        let path: PathBuf = entry.expect("an entry").path();
        let name = path.file_name().expect("a name");
        if path.is_file() && path.extension().is_none_or(|extension| extension != "out") {
            fs::copy(&path, to.join(name)).expect("a file can be copied");
        }
    }
}
