//! Golden cases: the first line of each file under `tests/cases` is the command to run; the file next to it has the expected output, files and exit code.
//!
//! The first line is a comment with `run:` and the arguments of grafsynth. `{}` is replaced by the file itself; without `{}`, the file is appended.
//! `{out}` is replaced by an empty folder, or by a copy of the folder `FILE.in` next to the case. The contents of `{out}` after the run belong to the
//! accepted output, except the list of outputs: its hashes are compared with the files instead. After `needs:`, the first line names the external tools
//! that the command uses; without one of them the case is skipped. `GRAFSYNTH_BLESS=1` writes the accepted output of cases without one and replaces
//! outputs that differ: read the difference before committing it.
//!
//! Each case is a test with the name of its file; `cargo test -p grafsynth --test cases truck` runs the cases with `truck` in their names.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]
#![allow(clippy::print_stdout, reason = "this program is its own test harness")]

mod case_files;

use case_files::{Case, files, is_ci, is_here, wrong_hashes};
use libtest_mimic::{Arguments, Completion, Failed, Trial};
use std::fmt::Write as _;
use std::fs;
use std::process::{Command, ExitCode};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let cases = Case::all();
    assert!(!cases.is_empty(), "no cases under {}", Case::root().display());
    libtest_mimic::run(&arguments, cases.into_iter().map(trial).collect()).exit_code()
}

fn trial(case: Case) -> Trial {
    let path = case.path.strip_prefix(Case::root()).expect("a case is in tests/cases");
    let name = path.display().to_string();
    Trial::ignorable_test(name.clone(), move || {
        let missing: Vec<&str> =
            case.tools.iter().map(String::as_str).filter(|tool| !is_here(tool)).collect();
        if missing.is_empty() {
            return check(&case).map(|()| Completion::Completed);
        }
        let reason = format!("needs {}", missing.join(", "));
        if is_ci() {
            return Err(reason.into());
        }
        println!("\nskipped: {name}: {reason}");
        Ok(Completion::ignored_with(reason))
    })
}

fn check(case: &Case) -> Result<(), Failed> {
    let got = run(case)?;
    let expected = fs::read_to_string(case.accepted()).unwrap_or_default();
    if got == expected {
        return Ok(());
    }
    if std::env::var_os("GRAFSYNTH_BLESS").is_some() {
        fs::write(case.accepted(), &got)?;
        println!("\nblessed {}", case.accepted().display());
        return Ok(());
    }
    let diff = similar::TextDiff::from_lines(&expected, &got);
    let diff = diff.unified_diff().context_radius(3).header("accepted", "now").to_string();
    Err(format!("GRAFSYNTH_BLESS=1 accepts the new output:\n{diff}").into())
}

/// Sizes of compiled C depend on the compiler, and on whether it is installed: a line with such sizes has `N` for each number and for their source.
fn without_sizes(line: &str) -> String {
    let source = |line: &str| {
        let start = line.find("(compiled with ").or_else(|| line.find("(estimated)"))?;
        Some(start..start + line[start..].find(')')? + 1)
    };
    let Some(range) = source(line) else { return line.to_owned() };
    let mut line = line.to_owned();
    line.replace_range(range, "N");
    let word = |word: &str| {
        if !word.is_empty() && word.chars().all(|c| c.is_ascii_digit()) { "N" } else { word }
            .to_owned()
    };
    line.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Everything that the command of a case prints and writes.
fn run(case: &Case) -> Result<String, Failed> {
    let out = tempfile::tempdir()?;
    let before = case.beside("in");
    if before.is_dir() {
        for path in files(&before) {
            fs::copy(&path, out.path().join(path.strip_prefix(&before)?))?;
        }
    }
    let out_path = out.path().display().to_string();
    let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(case.arguments(&out_path))
        .current_dir(case.folder())
        .env("NO_COLOR", "1")
        .env_remove("RUST_BACKTRACE")
        .output()?;
    let mut text = String::new();
    let clean = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).replace(&out_path, "{out}");
        text.lines().map(without_sizes).collect::<Vec<_>>().join("\n")
    };
    let code = output.status.code().map_or_else(|| "a signal".to_owned(), |code| code.to_string());
    writeln!(text, "exit {code}")?;
    for (title, bytes) in [("stdout", &output.stdout), ("stderr", &output.stderr)] {
        if !bytes.is_empty() {
            writeln!(text, "---- {title}\n{}", clean(bytes).trim_end())?;
        }
    }
    for path in files(out.path()) {
        let shown = path.strip_prefix(out.path())?.display().to_string();
        let bytes = fs::read(&path)?;
        if shown.ends_with(".outputs.json") {
            let wrong = wrong_hashes(out.path(), &bytes);
            if !wrong.is_empty() {
                return Err(format!("{shown} is wrong about {wrong:?}").into());
            }
            continue;
        }
        // The map of emitted C repeats the chart; `edited_c` tests it. Maps of lines have the name of a file with its extension.
        if shown.strip_suffix(".map.json").is_some_and(|stem| !stem.contains('.')) {
            continue;
        }
        writeln!(text, "---- {shown}\n{}", clean(&bytes).trim_end())?;
    }
    Ok(text)
}
