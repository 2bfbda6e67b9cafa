//! Drawings with overlays are those of docs/gallery, and pages are written under numbered names or as PDF.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(folder: &Path, arguments: &str) -> Output {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
    let arguments = arguments.replace("{examples}", root);
    let mut command = Command::new(env!("CARGO_BIN_EXE_grafsynth"));
    command.args(arguments.split(' ')).current_dir(folder).env("NO_COLOR", "1");
    command.output().expect("grafsynth starts")
}

/// Runs a command that must succeed, and returns what it prints on standard error.
fn done(folder: &Path, arguments: &str) -> String {
    let output = run(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments}: {errors}");
    errors
}

/// `scripts/gallery` writes these drawings.
#[test]
fn the_gallery_shows_overlays() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let errors = done(
        folder,
        "draw {examples}/bottle-filler/filler.graf --coverage {examples}/bottle-filler/filler.csv -o filler_coverage.svg",
    );
    assert!(errors.contains("5 of 6 steps were active, 6 of 8 transitions fired"), "{errors}");
    done(
        folder,
        "draw {examples}/split-truck/loader.graf --split {examples}/split-truck/loader.split -o loader_split.svg",
    );
    done(
        folder,
        "sim {examples}/truck/truck.graf --stimulus {examples}/truck/truck.csv --trace run.csv",
    );
    done(folder, "draw {examples}/truck/truck.graf --frames run.csv -o truck_frames.svg");
    for name in ["filler_coverage.svg", "loader_split.svg", "truck_frames.svg"] {
        let drawn = fs::read_to_string(folder.join(name)).expect("it is written");
        let kept = format!("{}/../docs/gallery/{name}", env!("CARGO_MANIFEST_DIR"));
        let kept = fs::read_to_string(kept).unwrap_or_default();
        assert!(kept == drawn, "docs/gallery/{name} is not the drawing: run scripts/gallery");
    }
}

/// `scripts/gallery` writes these tables and drawings.
#[test]
fn the_wirings_of_the_examples_are_those_of_their_splits() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for (example, name) in [
        ("truck", "loader"),
        ("hopper", "hopper"),
        ("launcher", "launcher"),
        ("line", "line"),
        ("station", "station"),
    ] {
        let path = format!("{{examples}}/split-{example}/{name}");
        done(folder, &format!("split {path}.graf --with {path}.split -o ."));
        for end in ["md", "svg"] {
            let name = format!("{name}_wiring.{end}");
            let made = fs::read_to_string(folder.join(&name)).expect("it is written");
            let kept = format!("{}/../examples/split-{example}/{name}", env!("CARGO_MANIFEST_DIR"));
            let kept = fs::read_to_string(kept).unwrap_or_default();
            assert!(kept == made, "{name} is not that of the split: run scripts/gallery");
        }
    }
}

#[test]
fn pages_have_numbered_names_or_are_one_pdf_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    done(folder, "draw {examples}/split-line/line.graf --page letter -o line.svg");
    let page = |n: usize| fs::read_to_string(folder.join(format!("line-{n}.svg")));
    assert!(
        page(1).is_ok_and(|text| text.contains("width=\"215.9mm\"") && text.contains("1 of 2"))
    );
    assert!(page(2).is_ok() && page(3).is_err());
    done(folder, "draw {examples}/split-line/line.graf -o line.pdf");
    let file = fs::read(folder.join("line.pdf")).expect("it is written");
    assert!(file.starts_with(b"%PDF-"));
    fs::write(folder.join("odd.graf"), "chart odd { initial step a \"Ж\" }\n")
        .expect("it is written");
    let errors = done(folder, "draw odd.graf -o odd.pdf");
    assert!(errors.contains("fonts lack: `Ж` (U+0416)"), "{errors}");
    let refused = run(folder, "draw odd.graf --page A4 -o -");
    assert_eq!(refused.status.code(), Some(2));
    let statechart =
        run(folder, "draw {examples}/supervisor/supervisor.scxml --style sfc -o x.svg");
    let errors = String::from_utf8_lossy(&statechart.stderr).into_owned();
    assert!(statechart.status.code() == Some(1) && errors.contains("statechart"), "{errors}");
}

/// A PNG file that is too long for many viewers is written with a note that names `--page`; a shorter one, and pages, have none.
#[test]
fn a_long_png_file_has_a_note() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let chart = |n: usize| {
        let steps: String = (1..n).map(|n| format!("step s{n}\ns{} -> s{n}\n", n - 1)).collect();
        format!("chart line {{\ninitial step s0\n{steps}}}\n")
    };
    fs::write(folder.join("long.graf"), chart(210)).expect("it is written");
    fs::write(folder.join("short.graf"), chart(190)).expect("it is written");
    let errors = done(folder, "draw long.graf -o long.png");
    assert!(errors.contains(" pixels, and many programs show at most 32767 on a side"), "{errors}");
    assert!(errors.contains("--page A4"), "{errors}");
    for line in [
        "long.graf -o long.png --scale 1",
        "long.graf -o p.png --page A4",
        "short.graf -o short.png",
    ] {
        let errors = done(folder, &format!("draw {line}"));
        assert!(!errors.contains("32767"), "{line}: {errors}");
    }
    assert!(!done(folder, "draw long.graf -o long.png -q").contains("32767"));
}

/// Whatever was parsed is drawn; each error is listed, and marked at its element. Nothing is written for a text without a chart, and no pages.
#[test]
fn a_chart_with_errors_is_drawn_with_marks() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let chart = "chart c {\n input a\n output X\n initial step s { X }\n step t { Q }\n s -> t when zz\n t -> nowhere when a\n}\n";
    fs::write(folder.join("c.graf"), chart).expect("it is written");
    let output = run(folder, "draw c.graf");
    assert_eq!(output.status.code(), Some(1));
    let drawn = fs::read_to_string(folder.join("c.svg")).expect("it is drawn");
    for text in ["c.graf has errors", "(1) line 5: unknown name `Q`", ">(1)<", ">(2)<", ">(3)<"] {
        assert!(drawn.contains(text), "{text}: {drawn}");
    }
    assert_eq!(run(folder, "draw c.graf --page A4 -o p.svg").status.code(), Some(1));
    fs::write(folder.join("empty.graf"), "").expect("it is written");
    assert_eq!(run(folder, "draw empty.graf").status.code(), Some(1));
    let files = fs::read_dir(folder).expect("a folder").count();
    assert_eq!(files, 3, "c.graf, c.svg and empty.graf");
}
