//! Golden cases: the first line of each file under `tests/cases` is the command to run; the file beside it has the expected output, files and exit code.
//!
//! The first line is a comment with `run:` and the arguments of grafsynth. `{}` is replaced by the file itself; without `{}`, the file is appended.
//! `{out}` is replaced by an empty folder, or by a copy of the folder `FILE.in` next to the case. The contents of `{out}` after the run belong to the
//! accepted output, except the list of outputs: its hashes are compared with the files instead. `GRAFSYNTH_BLESS=1` writes the accepted output of cases
//! without one and replaces outputs that differ: read the difference before committing it.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn every_case_gives_what_lies_beside_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/cases")
        .canonicalize()
        .expect("tests/cases is there");
    let mut cases = Vec::new();
    collect(&root, &mut cases);
    cases.sort();
    assert!(!cases.is_empty(), "no cases under {}", root.display());
    let bless = std::env::var_os("GRAFSYNTH_BLESS").is_some();
    let mut wrong = Vec::new();
    for case in &cases {
        let accepted = PathBuf::from(format!("{}.out", case.display()));
        let got = run(case);
        let expected = fs::read_to_string(&accepted).unwrap_or_default();
        if got == expected {
            continue;
        }
        if bless {
            fs::write(&accepted, &got).expect("the accepted output can be written");
            println!("blessed {}", accepted.display());
        } else {
            wrong.push(format!("{}\n{}", case.display(), difference(&expected, &got)));
        }
    }
    println!("{} cases", cases.len());
    assert!(
        wrong.is_empty(),
        "{} of {} cases differ (GRAFSYNTH_BLESS=1 accepts the new output):\n\n{}",
        wrong.len(),
        cases.len(),
        wrong.join("\n\n")
    );
}

pub(crate) fn collect(folder: &Path, cases: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of cases") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, cases);
        } else if path.extension().is_some_and(|extension| extension != "out")
            && command(&path).is_some()
        {
            cases.push(path);
        }
    }
}

/// The command in the first line, if there is one. Files without one belong to another case.
pub(crate) fn command(case: &Path) -> Option<String> {
    let text = fs::read(case).ok()?;
    let first = text.split(|byte| *byte == b'\n').next()?;
    let first = String::from_utf8_lossy(first);
    let (before, after) = first.split_once("run:")?;
    (before.trim().chars().all(|c| !c.is_alphanumeric())).then(|| {
        let ends = ["*/", "*)", "-->", "?>"];
        let line = ends.iter().fold(after.trim(), |line, end| line.trim_end_matches(end));
        line.trim().to_owned()
    })
}

fn run(case: &Path) -> String {
    let folder = case.parent().expect("a case is in a folder");
    let name = case.file_name().expect("a case has a name").to_string_lossy().into_owned();
    let out = tempfile::tempdir().expect("a temporary folder");
    let before = PathBuf::from(format!("{}.in", case.display()));
    if before.is_dir() {
        let mut there = Vec::new();
        files(&before, &mut there);
        for path in there {
            let name = path.strip_prefix(&before).expect("it is in the folder");
            fs::copy(&path, out.path().join(name)).expect("a file can be copied");
        }
    }
    let line = command(case).expect("a case has a command");
    let mut arguments = split(&line);
    if !arguments.iter().any(|argument| argument == "{}") {
        arguments.push("{}".to_owned());
    }
    let out_path = out.path().display().to_string();
    let arguments: Vec<String> = arguments
        .iter()
        .map(|argument| argument.replace("{out}", &out_path).replace("{}", &name))
        .collect();
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(&arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .env_remove("RUST_BACKTRACE")
        .output()
        .expect("grafsynth starts");
    let mut text = String::new();
    let clean = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace(&out_path, "{out}");
    let code = output.status.code().map_or_else(|| "a signal".to_owned(), |code| code.to_string());
    let _ = writeln!(text, "exit {code}");
    for (title, bytes) in [("stdout", &output.stdout), ("stderr", &output.stderr)] {
        if !bytes.is_empty() {
            let _ = writeln!(text, "---- {title}\n{}", clean(bytes).trim_end());
        }
    }
    let mut written = Vec::new();
    files(out.path(), &mut written);
    written.sort();
    for path in written {
        let shown =
            path.strip_prefix(out.path()).expect("it is in the folder").display().to_string();
        let bytes = fs::read(&path).expect("an output can be read");
        if shown.ends_with(".outputs.json") {
            let wrong = wrong_hashes(out.path(), &bytes);
            assert!(wrong.is_empty(), "{}: {shown} is wrong about {wrong:?}", case.display());
            continue;
        }
        let _ = writeln!(text, "---- {shown}\n{}", clean(&bytes).trim_end());
    }
    text
}

/// The files that differ from a list of outputs. A file that belongs to the user has no hash.
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

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the output folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// Splits at blanks; single and double quotes keep blanks together.
pub(crate) fn split(line: &str) -> Vec<String> {
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

fn difference(expected: &str, got: &str) -> String {
    let diff = similar::TextDiff::from_lines(expected, got);
    diff.unified_diff().context_radius(3).header("accepted", "now").to_string()
}

/// Each code has a page with its title and three sections. (The crates test the examples of their own pages; those of the command line are cases.)
#[test]
fn every_code_has_its_page_and_every_page_its_code() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/codes");
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/cases/codes");
    let mut pages: Vec<String> = fs::read_dir(&docs)
        .expect("docs/codes is there")
        .filter_map(|entry| entry.expect("an entry").file_name().to_str().map(str::to_owned))
        .filter_map(|name| name.strip_suffix(".md").map(str::to_owned))
        .collect();
    pages.sort();
    let list = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .arg("explain")
        .output()
        .expect("grafsynth starts");
    let list = String::from_utf8(list.stdout).expect("explain prints text");
    let mut codes = Vec::new();
    for line in list.lines() {
        let (code, title) = line.split_once("  ").expect("a code and its title");
        codes.push(code.to_owned());
        let page = fs::read_to_string(docs.join(format!("{code}.md"))).unwrap_or_default();
        assert!(
            page.starts_with(&format!("# {code}: {title}\n")),
            "docs/codes/{code}.md must begin with `# {code}: {title}`"
        );
        for section in ["\n## Cause\n", "\n## Example\n", "\n## Way out\n"] {
            assert!(page.contains(section), "docs/codes/{code}.md has no section{section}");
        }
        if code.starts_with("G00") {
            let shown = fs::read_dir(&cases).expect("tests/cases/codes is there").any(|entry| {
                let path = entry.expect("an entry").path();
                path.extension().is_some_and(|extension| extension == "out")
                    && fs::read_to_string(path)
                        .is_ok_and(|text| text.contains(&format!("[{code}]")))
            });
            assert!(shown, "no case under tests/cases/codes shows {code}");
        }
    }
    assert_eq!(codes, pages, "codes that explain lists, and pages under docs/codes");
}
