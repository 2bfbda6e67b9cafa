//! PNG files through other programs: Python reads them, and a browser shows the SVG file of the same drawing alike.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]

use crate::page::browser;
use grafsynth_draw::picture::{Picture, Shape};
use grafsynth_draw::waves::{Group, Signal, Waves};
use grafsynth_draw::{Counts, MarkedError, Options, Style, layout, marked, png, svg, waves};
use grafsynth_driver::read::{ReadLimits, Texts, read, unchecked};
use grafsynth_driver::source::Sources;
use grafsynth_engines::scratch::Scratch;
use grafsynth_engines::tools;
use grafsynth_frontend::graf;
use grafsynth_ir::FileId;
use grafsynth_ir::chart::{Design, Item};
use grafsynth_tests::rounds;
use std::fs;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);

/// Prints the size, the bits and the kind of colours, and the length of the pixels of a PNG file, after a check of its checksums.
const READER: &str = "
import struct, sys, zlib
file = sys.stdin.buffer.read()
assert file[:8] == b'\\x89PNG\\r\\n\\x1a\\n'
at, data = 8, b''
while at < len(file):
    (n,) = struct.unpack('>I', file[at : at + 4])
    kind, content = file[at + 4 : at + 8], file[at + 8 : at + 8 + n]
    assert struct.unpack('>I', file[at + 8 + n : at + 12 + n])[0] == zlib.crc32(kind + content), kind
    if kind == b'IHDR':
        width, height, bits, colours = struct.unpack('>IIBB', content[:10])
    if kind == b'IDAT':
        data += content
    at += 12 + n
print(width, height, bits, colours, len(zlib.decompress(data)))
";

/// One drawing of each kind.
fn pictures() -> Vec<(&'static str, Picture)> {
    let parsed = |text: &str| graf::parse(FileId(0), text).design.expect("it is a chart");
    let drawn = |design: &Design, options: &Options<'_>| layout(design, options).expect("drawn");
    let plain = Options::default();
    let filler = parsed(include_str!("../../examples/bottle-filler/filler.graf"));
    let drill = parsed(include_str!("../../examples/drill/drill.graf"));
    let line = parsed(include_str!("../../examples/split-line/line.graf"));
    let oven = parsed(include_str!("../../examples/microwave/oven.graf"));
    let steps = line.charts.iter().flat_map(|chart| &chart.items).filter_map(|item| match item {
        Item::Step(step) => Some(step.meta.span),
        _ => None,
    });
    let by_element = steps.zip((0..3).cycle()).collect();
    let counts = Counts { by_element, note: "of 9 reactions".to_owned() };
    vec![
        ("grafcet", drawn(&drill, &plain)),
        ("sfc", drawn(&filler, &Options { style: Style::Sfc, ..plain })),
        ("statechart", drawn(&oven, &plain)),
        ("coverage", drawn(&line, &Options { counts: Some(&counts), ..plain })),
        ("waves", waves(&run())),
    ]
}

/// A run of 40 reactions with a signal of each kind.
fn run() -> Waves {
    let values = |n: i64| (0..40).map(|row| (row % 11 != 5).then_some(row / 3 % n)).collect();
    let signal = |name: &str, group, n| Signal {
        name: name.to_owned(),
        group,
        is_bool: n == 2,
        values: values(n),
    };
    Waves {
        title: "filler".to_owned(),
        ticks: (0..40).collect(),
        tick_ns: Some(1_000_000),
        fired: (0..40).map(|row| row % 7 == 3).collect(),
        signals: vec![
            signal("a", Group::Input, 2),
            signal("p1", Group::Step, 2),
            signal("level", Group::Variable, 7),
        ],
        is_blank: false,
    }
}

#[test]
fn python_reads_png_files() {
    let Some(python) = tools::find(&["python3"]) else {
        println!("skipped: python3 is not installed");
        return;
    };
    let folder = Scratch::new().expect("a folder");
    for (name, picture) in pictures() {
        let file = png(&picture, 1).expect("it is small").bytes;
        let done = tools::run(&python, &["-c", READER], folder.path(), &file, LIMIT);
        let done = done.expect("it runs");
        assert!(done.is_success, "{name}: {}", done.stderr);
        let is_coloured = ["coverage", "waves"].contains(&name);
        let (kind, n_parts) = if is_coloured { (2, 3) } else { (0, 1) };
        let Picture { width, height, .. } = picture;
        let length = height * (width * n_parts + 1);
        let wanted = format!("{width} {height} 8 {kind} {length}\n");
        assert_eq!(String::from_utf8_lossy(&done.stdout), wanted, "{name}");
    }
}

/// In the long tests: the light of each block of 4 x 4 pixels of a drawing is the same in the PNG file and in a browser, which has its own letters for
/// headings. A text that is moved by 5 pixels is noticed.
#[test]
fn a_browser_shows_what_png_files_contain() {
    if rounds(0, 1) == 0 {
        return;
    }
    let Some((chromium, node)) = browser() else { return };
    let folder = Scratch::new().expect("a folder");
    let write =
        |name: &str, data: &[u8]| fs::write(folder.path().join(name), data).expect("written");
    write("chromium.js", include_bytes!("page_scripts/chromium.js"));
    write("pictures.js", include_bytes!("page_scripts/pictures.js"));
    let mut arguments = vec!["pictures.js".to_owned(), chromium.display().to_string()];
    for (name, picture) in pictures() {
        let mut spoiled = picture.clone();
        let text = spoiled.marks.iter_mut().find_map(|mark| match &mut mark.shape {
            Shape::Text { x, width, .. } if *width > 20 => Some(x),
            _ => None,
        });
        *text.expect("a text") += 5;
        for (name, png_picture) in [(name.to_owned(), &picture), (format!("{name}-bad"), &spoiled)]
        {
            write(&format!("{name}.svg"), svg(&picture).as_bytes());
            write(&format!("{name}.png"), &png(png_picture, 2).expect("it is small").bytes);
            arguments.push(name);
        }
    }
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = tools::run(&node, &arguments, folder.path(), b"", LIMIT).expect("it runs");
    assert!(done.is_success, "{}", done.stderr);
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    println!("{found:#}");
    for (name, _) in pictures() {
        let number = |name: &str, key: &str| found[name][key].as_f64().expect("a number");
        let spoiled = format!("{name}-bad");
        assert!((number(name, "png") - 2.0 * number(name, "svg")).abs() < 0.5, "{name}");
        assert!(number(name, "worst") < 90.0, "{name}: {}", found[name]);
        assert!(number(&spoiled, "worst") > 90.0, "{spoiled}: {}", found[spoiled.as_str()]);
    }
}

/// The charts of all cases with errors, as far as they were parsed, are drawn without a panic.
#[test]
fn what_was_parsed_of_charts_with_errors_is_drawn() {
    let mut folders = vec![std::path::PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/cases"))];
    let (mut n_drawn, mut n_marked) = (0, 0);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder").flatten() {
            if entry.path().is_dir() {
                folders.push(entry.path());
                continue;
            }
            let (name, Ok(text)) =
                (entry.path().display().to_string(), fs::read_to_string(entry.path()))
            else {
                continue;
            };
            let mut sources = Sources::default();
            let main = sources.add(name, text);
            let texts = Texts { main, ..Texts::default() };
            let (None, found) = read(&sources, &texts, ReadLimits::default()) else { continue };
            let Some(design) = unchecked(&sources, &texts, ReadLimits::default()) else { continue };
            let Ok(picture) = layout(&design, &Options::default()) else { continue };
            let errors: Vec<MarkedError> = found
                .iter()
                .map(|one| MarkedError {
                    places: one.labels.iter().map(|label| label.span).collect(),
                    text: one.message.clone(),
                })
                .collect();
            let before = picture.marks.len();
            n_drawn += 1;
            // A heading, a line for each error, the area behind both; more are marks in the drawing.
            let sheet = marked(&picture, "it has errors", &errors);
            n_marked += usize::from(sheet.marks.len() > before + 2 + errors.len());
        }
    }
    println!("{n_drawn} charts with errors drawn, in {n_marked} of them an element is marked");
    assert!(n_drawn > 50 && n_marked * 4 > n_drawn, "{n_marked} of {n_drawn}");
}
