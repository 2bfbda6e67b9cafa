//! The example of each page under `docs/codes` triggers its code if it is run as described on the page.
//!
//! The fence names the language, then the verb with its options (`check` if none). Lines `// stimulus`, `// state` and `// commands` of an example
//! begin a second file, which is passed with `--stimulus` or `--restore`, or as standard input.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Pages whose example is not run here, each with the reason or the place of its test.
const ELSEWHERE: [(&str, &str); 23] = [
    ("G0003", "needs a second design: tests/cases/codes/G0003.graf"),
    ("G0015", "needs what an older build wrote: tests/cases/codes/G0015.graf"),
    ("G0019", "needs a stimulus beside a chart: tests/cases/codes/G0019.graf"),
    ("G0108", "the command line rejects a long file before the reader does"),
    ("G0109", "the command line itself counts what is not shown"),
    ("G0122", "needs a chart beside the plant: tests/cases/codes/G0122.graf"),
    ("G0123", "needs a chart beside the plant: tests/cases/codes/G0123.graf"),
    ("G0120", "needs a file to write to: tests/cases/convert/macro_to_rules.graf"),
    ("G0511", "needs a broken trace"),
    ("G0512", "needs a broken trace"),
    ("G0513", "needs a broken state and a stimulus"),
    ("G0517", "needs a partition file: tests/cases/compare/free_together.graf"),
    ("G0604", "needs a cross compiler: tests/tests/controllers.rs"),
    ("G0640", "no verb reads such a text: c/tests/pages.rs"),
    ("G0641", "no verb reads such a text: c/tests/pages.rs"),
    ("G0642", "no verb reads such a text: c/tests/pages.rs"),
    ("G0643", "no verb reads such a text: c/tests/pages.rs"),
    ("G0644", "no verb reads such a text: c/tests/pages.rs"),
    ("G0715", "needs vectors that no verb makes: the tests of backend-pld"),
    ("G0728", "needs a text of more than 64 MiB"),
    ("G0789", "needs a bug in our own mapper: the tests of fuse maps flip fuses"),
    ("G1010", "no option chooses pins of the CPU yet: tests/tests/link.rs"),
    ("G0729", "needs a text that our own writer never writes"),
];

#[test]
fn each_example_triggers_its_code() {
    let mut silent = Vec::new();
    for (code, text) in pages() {
        if ELSEWHERE.iter().any(|(known, _)| *known == code) {
            continue;
        }
        let printed = run(&text);
        if !printed.contains(&code) {
            silent.push(format!(
                "{code}: {}",
                printed.lines().take(4).collect::<Vec<_>>().join(" | ")
            ));
        }
    }
    assert!(silent.is_empty(), "these examples do not trigger their code:\n{}", silent.join("\n"));
}

fn run(page: &str) -> String {
    let (folder, arguments) = prepare(page);
    let commands = fs::File::open(folder.path().join("commands"));
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(&arguments)
        .current_dir(folder.path())
        .stdin(commands.map_or_else(|_| Stdio::null(), Stdio::from))
        .output()
        .expect("grafsynth starts");
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The texts of all pages.
pub(crate) fn pages() -> Vec<(String, String)> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/codes");
    let paths =
        fs::read_dir(docs).expect("docs/codes").map(|entry| entry.expect("an entry").path());
    let mut pages: Vec<(String, String)> = paths
        .map(|path| {
            let code = path.file_stem().expect("a name").to_string_lossy().into_owned();
            (code, fs::read_to_string(&path).expect("a page"))
        })
        .collect();
    pages.sort();
    pages
}

/// The example of a page in a folder of its own, and the arguments to run it with there.
pub(crate) fn prepare(page: &str) -> (tempfile::TempDir, Vec<String>) {
    let fence = page.split_once("\n```").expect("a fenced example").1;
    let (info, rest) = fence.split_once('\n').expect("a fence");
    let body = rest.split_once("\n```").map_or(rest, |(body, _)| body);
    let (language, verb) = info.split_once(' ').unwrap_or((info, "check"));
    let extension = match language {
        "palasm" => "pds",
        "cupl" | "galasm" => "pld",
        "verilog" => "v",
        other => other,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join(format!("example.{extension}"));
    fs::write(&file, format!("{body}\n")).expect("the example can be written");
    let mut arguments: Vec<String> = verb.split_whitespace().map(str::to_owned).collect();
    // The last option shows readers the purpose of the second file; the test appends it again with the name of that file.
    arguments.retain(|argument| argument != "--stimulus" && argument != "--restore");
    let shown = format!("example.{extension}");
    if arguments.iter().any(|argument| argument == "{}") {
        arguments
            .iter_mut()
            .filter(|argument| *argument == "{}")
            .for_each(|argument| shown.clone_into(argument));
    } else {
        arguments.insert(1, shown);
    }
    for (kind, option) in
        [("stimulus", Some("--stimulus")), ("state", Some("--restore")), ("commands", None)]
    {
        if let Some((_, lines)) = body.split_once(&format!("\n// {kind}\n")) {
            let second: String = lines
                .lines()
                .map_while(|line| line.strip_prefix("// ").or(line.strip_prefix("//")))
                .take_while(|line| !matches!(*line, "trace" | "state" | "stimulus" | "commands"))
                .map(|line| format!("{line}\n"))
                .collect();
            let path = folder.path().join(kind);
            fs::write(&path, second).expect("the second file can be written");
            if let Some(option) = option {
                arguments.extend([option.to_owned(), kind.to_owned()]);
            }
        }
    }
    if arguments[0] == "build" {
        arguments.extend(["-o".to_owned(), "out".to_owned()]);
    }
    (folder, arguments)
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
