//! README, docs and the pages of the examples: every command runs as printed, every chart is accepted, every printed trace and output is real.
//!
//! The word after the fence decides what happens to a block:
//!
//! ```text
//! console                  each line runs in a shell and must succeed; `# exit code 3` in its comment states another exit code
//! graf, rules              `grafsynth check` accepts the text, without a warning
//! case                     chart on the left, trace on the right (semantics.md §12): `grafsynth sim` must give this trace
//! ebnf, figure             notation and pictures: nothing to run
//! ```
//! Comments in front of a fence, which people who read the page do not see, tell the test the rest:
//!
//! ```text
//! <!-- before: COMMANDS -->        runs first in the folder of the page: makes files that the block needs
//! <!-- printed by: COMMAND -->     the block is part of the output of this command; a line `...` stands for any lines
//! <!-- compiled after: COMMANDS -->   a part of a C program: compiled after these commands have written its surroundings
//! <!-- needs: TOOL TOOL -->        without these tools the block is skipped (a failure in CI)
//! <!-- not run: REASON -->         nothing is run
//! ```
//! The blocks of a page run in order, in one folder: a copy of `examples` or, for the page of an example, the folder of that example in the copy.

#![allow(clippy::disallowed_methods, reason = "tests read files and start programs")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use crate::case_files::{is_ci, is_here};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

const TOOL: &str = env!("CARGO_BIN_EXE_grafsynth");

/// A fenced block.
#[derive(Debug, PartialEq, Eq)]
struct Block {
    /// The line of the fence, from 1.
    line: usize,
    /// The word after the fence.
    info: String,
    /// The comments in front of the fence, as key and text.
    notes: Vec<(String, String)>,
    text: String,
}

impl Block {
    fn note(&self, key: &str) -> Option<&str> {
        self.notes.iter().find(|(own, _)| own == key).map(|(_, text)| text.as_str())
    }
}

/// All fenced blocks of a page.
fn blocks(page: &str) -> Vec<Block> {
    let mut all = Vec::new();
    let mut notes = Vec::new();
    let mut lines = page.lines().enumerate();
    while let Some((at, line)) = lines.next() {
        let line = line.trim();
        if let Some(info) = line.strip_prefix("```") {
            let mut text = String::new();
            for (_, line) in lines.by_ref() {
                if line.trim() == "```" {
                    break;
                }
                text.push_str(line);
                text.push('\n');
            }
            let notes = std::mem::take(&mut notes);
            all.push(Block { line: at + 1, info: info.trim().to_owned(), notes, text });
        } else if let Some(note) =
            line.strip_prefix("<!--").and_then(|rest| rest.strip_suffix("-->"))
            && let Some((key, text)) = note.split_once(':')
        {
            notes.push((key.trim().to_owned(), text.trim().to_owned()));
        } else if !line.is_empty() {
            notes.clear();
        }
    }
    all
}

/// One page while it is tested.
struct Page<'p> {
    name: &'p str,
    home: PathBuf,
    failures: String,
    n_run: usize,
}

impl Page<'_> {
    fn fail(&mut self, block: &Block, what: &str) {
        let _ = writeln!(self.failures, "{}:{}: {what}", self.name, block.line);
    }

    fn shell(&self, commands: &str) -> Output {
        let folder = Path::new(TOOL).parent().expect("a folder");
        let path = std::env::var("PATH").unwrap_or_default();
        let mut shell = Command::new("bash");
        shell.args(["-ec", commands]).current_dir(&self.home).env("NO_COLOR", "1");
        shell.env("PATH", format!("{}:{path}", folder.display())).output().expect("bash starts")
    }

    fn must(&mut self, block: &Block, commands: &str, code: i32) -> Option<String> {
        let output = self.shell(commands);
        let text = text(&output);
        if output.status.code() == Some(code) {
            return Some(text);
        }
        let tail: Vec<&str> = text.lines().rev().take(12).collect();
        let tail: Vec<&str> = tail.into_iter().rev().collect();
        let what = format!("`{commands}`: {}\n    {}", output.status, tail.join("\n    "));
        self.fail(block, &what);
        None
    }

    fn test(&mut self, block: &Block) {
        if block.note("not run").is_some() || matches!(block.info.as_str(), "ebnf" | "figure") {
            return;
        }
        let tools = block.note("needs").unwrap_or_default().split_whitespace();
        let missing: Vec<&str> = tools.filter(|tool| !is_here(tool)).collect();
        if !missing.is_empty() {
            println!("skipped: {}:{}: needs {}", self.name, block.line, missing.join(", "));
            if is_ci() {
                self.fail(block, &format!("needs {}", missing.join(", ")));
            }
            return;
        }
        self.n_run += 1;
        let before = block.notes.iter().filter(|(key, _)| key == "before");
        if !before.into_iter().all(|(_, commands)| self.must(block, commands, 0).is_some()) {
            return;
        }
        if let Some(commands) = block.note("compiled after") {
            self.compile(block, commands);
        } else if let Some(command) = block.note("printed by") {
            self.printed(block, command);
        } else {
            match block.info.as_str() {
                "console" => self.console(block),
                "graf" | "rules" => self.accepted(block),
                "case" => self.case(block),
                _ => self.fail(block, "nothing tests this block: see cli/tests/printed.rs"),
            }
        }
    }

    fn console(&mut self, block: &Block) {
        for line in block.text.lines().filter(|line| !line.trim().is_empty()) {
            let code = line.split_once("# ").and_then(|(_, comment)| exit_code(comment));
            self.must(block, line, code.unwrap_or(0));
        }
    }

    fn printed(&mut self, block: &Block, command: &str) {
        let printed = text(&self.shell(command));
        if let Some(line) = missing_line(&block.text, &printed) {
            self.fail(block, &format!("`{command}` does not print `{line}`:\n{printed}"));
        }
    }

    fn accepted(&mut self, block: &Block) {
        let name = format!("snippet{}.{}", block.line, block.info);
        fs::write(self.home.join(&name), &block.text).expect("it is written");
        if let Some(said) = self.must(block, &format!("grafsynth check {name}"), 0)
            && said.contains("warning")
        {
            self.fail(block, &said);
        }
    }

    fn case(&mut self, block: &Block) {
        let (chart, trace) = columns(&block.text);
        let name = format!("case{}", block.line);
        let file = self.home.join(&name);
        fs::write(file.with_extension("graf"), chart).expect("it is written");
        fs::write(file.with_extension("csv"), trace).expect("it is written");
        self.must(block, &format!("grafsynth sim {name}.graf --stimulus {name}.csv"), 0);
    }

    /// Compiles a part of a C program. Lines from `#include` on are a file; other text is put into a function.
    fn compile(&mut self, block: &Block, commands: &str) {
        let Some(header) = self.must(block, commands, 0) else { return };
        let is_file = block.text.contains("#include");
        let text = if is_file {
            block.text.clone()
        } else {
            format!("{header}\nvoid part(void);\nvoid part(void)\n{{\n{}}}\n", block.text)
        };
        let name = format!("part{}.c", block.line);
        fs::write(self.home.join(&name), text).expect("it is written");
        self.must(block, &format!("cc -std=c99 -fsyntax-only -Wall -Werror -I. {name}"), 0);
    }
}

/// The exit code that a comment such as `exit code 3: they differ` states.
fn exit_code(comment: &str) -> Option<i32> {
    let (_, rest) = comment.split_once("exit code ")?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// The first printed line that the output lacks; lines follow each other as in the output, `...` stands for any lines.
fn missing_line<'t>(printed: &'t str, output: &str) -> Option<&'t str> {
    let all: Vec<&str> = output.lines().map(str::trim_end).collect();
    let mut at = 0;
    let mut may_skip = true;
    for line in printed.lines().map(str::trim_end) {
        if line.trim() == "..." {
            may_skip = true;
            continue;
        }
        match all[at..].iter().position(|real| *real == line) {
            Some(0) => at += 1,
            Some(skipped) if may_skip => at += skipped + 1,
            Some(_) | None => return Some(line),
        }
        may_skip = false;
    }
    None
}

/// The chart and the trace of a case. The trace is the text after the first `NUMBER,NUMBER,` or `scan,dt` of a line that follows a space, without the
/// remark in parentheses and without a second trace at the end.
fn columns(text: &str) -> (String, String) {
    let (mut before, mut chart, mut trace) = (String::new(), String::new(), String::new());
    for line in text.lines() {
        let at = row_start(line).unwrap_or(line.len());
        let (left, row) = line.split_at(at);
        // A remark in the column of the trace.
        let (left, row) = left.split_once("   (").map_or((left, row), |(left, _)| (left, ""));
        let list = if left.starts_with("library") { &mut before } else { &mut chart };
        let _ = writeln!(list, "{}", left.trim_end());
        let row = row.split("  ").next().unwrap_or_default().trim_end();
        if !row.is_empty() {
            let _ = writeln!(trace, "{row}");
        }
    }
    (format!("{before}chart c {{\ntick 10 ms\n{chart}}}\n"), trace)
}

fn row_start(line: &str) -> Option<usize> {
    let starts = line.match_indices(' ').map(|(at, _)| at + 1);
    let mut starts = std::iter::once(0).chain(starts);
    starts.find(|&at| {
        let mut cells = line[at..].split(',');
        let mut is_number = || {
            cells
                .next()
                .is_some_and(|cell| !cell.is_empty() && cell.bytes().all(|c| c.is_ascii_digit()))
        };
        line[at..].starts_with("scan,dt") || (is_number() && is_number() && cells.next().is_some())
    })
}

fn text(output: &Output) -> String {
    let (out, err) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    format!("{out}{err}")
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let target = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).expect("it is copied");
        }
    }
}

/// The pages with their names, relative to the repository.
fn pages(root: &Path) -> Vec<String> {
    let mut pages: Vec<String> =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(str::to_owned).to_vec();
    for entry in fs::read_dir(root.join("docs")).expect("docs") {
        let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
        if name.ends_with(".md") {
            pages.push(format!("docs/{name}"));
        }
    }
    for entry in fs::read_dir(root.join("examples")).expect("examples") {
        let folder = entry.expect("an entry").file_name().to_string_lossy().into_owned();
        if root.join("examples").join(&folder).join("README.md").exists() {
            pages.push(format!("examples/{folder}/README.md"));
        }
    }
    pages.sort();
    pages
}

#[test]
fn commands_and_snippets_of_the_pages_are_true() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let todo = Mutex::new(pages(&root));
    let failures = Mutex::new(String::new());
    let n_run = Mutex::new(0);
    let work = || {
        while let Some(name) = { todo.lock().expect("a list").pop() } {
            let blocks = blocks(&fs::read_to_string(root.join(&name)).expect("a page"));
            if blocks.is_empty() {
                continue;
            }
            let folder = tempfile::tempdir().expect("a temporary folder");
            copy(&root.join("examples"), &folder.path().join("examples"));
            let home = match name.strip_prefix("examples/") {
                Some(_) => folder.path().join(&name).parent().expect("a folder").to_owned(),
                None => folder.path().to_owned(),
            };
            let mut page = Page { name: &name, home, failures: String::new(), n_run: 0 };
            blocks.iter().for_each(|block| page.test(block));
            failures.lock().expect("a text").push_str(&page.failures);
            *n_run.lock().expect("a number") += page.n_run;
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(work);
        }
    });
    let failures = failures.into_inner().expect("a text");
    assert!(failures.is_empty(), "{failures}");
    let n_run = n_run.into_inner().expect("a number");
    assert!(n_run >= 60, "only {n_run} blocks were tested");
}

#[test]
fn a_page_that_lies_is_found() {
    let page = "<!-- needs: bash -->\n```console\nfalse\ntrue   # exit code 1: not so\n```\n\
        <!-- printed by: echo a; echo b; echo c -->\n```text\na\nc\n```\n```graf\nchart {\n```\n```\nno word\n```\n";
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut tested =
        Page { name: "page", home: folder.path().to_owned(), failures: String::new(), n_run: 0 };
    let all = blocks(page);
    assert_eq!(all.iter().map(|block| block.line).collect::<Vec<_>>(), [2, 7, 11, 14]);
    assert_eq!(all[1].note("printed by"), Some("echo a; echo b; echo c"));
    all.iter().for_each(|block| tested.test(block));
    for line in ["page:2: `false`", "page:2: `true", "page:7: ", "page:11: ", "page:14: "] {
        assert!(tested.failures.contains(line), "{line} is missing in:\n{}", tested.failures);
    }
    assert_eq!(missing_line("a\n...\nc\n", "x\na\nb\nb\nc\nd\n"), None);
    assert_eq!(missing_line("a\nc\n", "a\nb\nc\n"), Some("c"));
    let case = "input a   scan,dt,a,steps\nvar n: int 0..9 = 0 0,0,0,s   (a remark)\nt   1,1,1,r      on a chip\n";
    let (chart, trace) = columns(case);
    assert_eq!(chart, "chart c {\ntick 10 ms\ninput a\nvar n: int 0..9 = 0\nt\n}\n");
    assert_eq!(trace, "scan,dt,a,steps\n0,0,0,s\n1,1,1,r\n");
}
