//! Random charts in the styles of C with strict settings of each compiler: no warning as C99, as C++11, on an AVR and on a Cortex-M3.

#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::Style;
use grafsynth_engines::tools;
use grafsynth_tests::fleet::{Chart, draw};
use grafsynth_tests::{in_parallel, rounds};
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);
const STRICT: [&str; 7] =
    ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow"];

/// A compiler, with its options in addition to [`STRICT`], and whether these are used.
struct Judge {
    program: &'static str,
    flags: &'static [&'static str],
    is_strict: bool,
}

const JUDGES: [Judge; 7] = [
    Judge { program: "gcc", flags: &["-std=c99", "-O2", "-c"], is_strict: true },
    Judge { program: "clang", flags: &["-std=c99", "-fsyntax-only"], is_strict: true },
    Judge { program: "gcc", flags: &["-x", "c++", "-std=c++11", "-fsyntax-only"], is_strict: true },
    Judge {
        program: "clang",
        flags: &["-x", "c++", "-std=c++11", "-fsyntax-only"],
        is_strict: true,
    },
    Judge {
        program: "avr-gcc",
        flags: &["-std=gnu99", "-mmcu=atmega1284p", "-Os", "-c", "-Wall", "-Wextra", "-Werror"],
        is_strict: false,
    },
    Judge {
        program: "arm-none-eabi-gcc",
        flags: &["-std=c99", "-mcpu=cortex-m3", "-mthumb", "-Os", "-c"],
        is_strict: true,
    },
    Judge {
        program: "arm-none-eabi-g++",
        flags: &["-x", "c++", "-std=c++11", "-mcpu=cortex-m3", "-mthumb", "-Os", "-c"],
        is_strict: true,
    },
];

/// Writes a chart's files, and returns those to be compiled: all except the user's.
fn write(folder: &Path, chart: &Chart) -> Vec<String> {
    let mut sources = Vec::new();
    for file in &chart.package.files {
        std::fs::write(folder.join(&file.name), &file.text).expect("it is written");
        if file.name.ends_with(".c") && !file.keep_existing {
            sources.push(file.name.clone());
        }
    }
    sources
}

#[test]
fn no_compiler_warns_of_a_random_chart() {
    let styles =
        [Style::Auto, Style::Switch, Style::Tables, Style::Bits, Style::Engine, Style::Program];
    let folder = tempfile::tempdir().expect("a folder");
    let mut sources = Vec::new();
    for style in styles {
        let place = folder.path().join(style.name());
        std::fs::create_dir(&place).expect("a folder");
        for chart in &draw(style, rounds(2, 8)).charts {
            let written = write(&place, chart);
            sources.extend(written.into_iter().map(|name| format!("{}/{name}", style.name())));
        }
    }
    // The engines' files are written again with each chart, so duplicates are removed.
    sources.sort_unstable();
    sources.dedup();
    let found = in_parallel(&JUDGES, |judge| {
        let Some(program) = tools::find(&[judge.program]) else {
            assert!(std::env::var_os("CI").is_none(), "CI must have {}", judge.program);
            println!("skipped: {} is not here", judge.program);
            return None;
        };
        let made = tempfile::tempdir().expect("a folder");
        let all: Vec<String> =
            sources.iter().map(|name| folder.path().join(name).display().to_string()).collect();
        let mut arguments: Vec<&str> = judge.flags.to_vec();
        if judge.is_strict {
            arguments.extend(STRICT);
        }
        arguments.extend(all.iter().map(String::as_str));
        let run = tools::run(&program, &arguments, made.path(), b"", LIMIT).expect("it runs");
        let about = format!("{} {}", judge.program, judge.flags.join(" "));
        (!run.is_success || !run.stderr.trim().is_empty())
            .then(|| format!("{about}\n{}", run.stderr.chars().take(4000).collect::<String>()))
    });
    let found: Vec<String> = found.into_iter().flatten().collect();
    assert!(found.is_empty(), "{}", found.join("\n\n"));
}
