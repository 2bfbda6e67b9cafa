//! The C that we emit is read back by `grafsynth-c` for every compiler, printing the tree and reading it again gives the same tree, the printed C behaves like
//! the original, and mutated texts cause findings, never a panic.

#![allow(clippy::disallowed_methods, reason = "tests read files")]
#![allow(clippy::print_stdout, reason = "tests report what they skip and what they counted")]

use grafsynth_backend_c::{Io, Options, Package, Style};
use grafsynth_c::tree::Unit;
use grafsynth_c::{Config, Input, SourceFile, parse, print};
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId, Valid};
use grafsynth_sim::Random;
use grafsynth_tests::fleet::{Compiler, check, draw, draw_of, emitted, options};
use grafsynth_tests::random_chart::random_chart;
use grafsynth_tests::random_net::Features;
use grafsynth_tests::{in_parallel, rounds};
use std::path::{Path, PathBuf};

/// Functions of the engines that only read the state.
const READERS: [&str; 2] = ["gb_rise", "gb_fall"];

/// The user's C texts of a chart.
fn texts(net: &Net) -> Vec<&str> {
    let all = net.texts().into_iter().filter(|(text, _)| text.is_c());
    all.map(|(text, _)| text.text.as_str()).collect()
}

/// The files of a package, `main` first.
fn files<'a>(package: &'a Package, main: &str) -> Vec<SourceFile<'a>> {
    let mut order: Vec<_> = package.files.iter().filter(|file| file.name == main).collect();
    order.extend(package.files.iter().filter(|file| file.name != main));
    let source = |(at, file): (usize, &&'a grafsynth_backend_c::File)| SourceFile {
        file: FileId(at as u32),
        name: &file.name,
        text: &file.text,
    };
    order.iter().enumerate().map(source).collect()
}

/// The text of the engines is not read: it is the same for all charts.
fn is_read(name: &str) -> bool {
    let is_text = name.ends_with(".c") || name.ends_with(".h");
    is_text && !(name.starts_with("grafsynth_") && name.ends_with(".c"))
}

/// The finding with its line.
fn shown(found: &[Diagnostic], files: &[SourceFile]) -> String {
    let Some(first) = found.first() else { return "no finding".to_owned() };
    let Some(label) = first.labels.first() else { return first.message.clone() };
    let file = files.iter().find(|file| file.file == label.span.file).expect("a file");
    let line = file.text[..label.span.range().start].matches('\n').count();
    let text = file.text.lines().nth(line).unwrap_or_default().trim();
    format!("{}:{}: {}: `{text}`", file.name, line + 1, first.message)
}

/// Reads the printed text.
fn again(text: &str, verbatim: &[&str], config: &Config) -> Result<Unit, String> {
    let files = [SourceFile { file: FileId(0), name: "printed.c", text }];
    let (unit, found) = parse(&Input { files: &files, verbatim, readers: &READERS, config });
    unit.ok_or_else(|| shown(&found, &files))
}

/// Reads a file of a package, prints it and reads it again; returns the reason if that fails.
fn failure(package: &Package, name: &str, verbatim: &[&str], config: &Config) -> Option<String> {
    let files = files(package, name);
    let about = |why: String| Some(format!("{name} for {}: {why}", config.name));
    let (unit, found) = parse(&Input { files: &files, verbatim, readers: &READERS, config });
    let Some(unit) = unit else { return about(shown(&found, &files)) };
    match again(&print(&unit), verbatim, config) {
        Ok(second) if second == unit => None,
        Ok(_) => about("the printed text is read as another tree".to_owned()),
        Err(why) => about(format!("the printed text: {why}")),
    }
}

/// Reads all files of a package: `.c` files for each compiler, headers for one of them.
fn all_read(net: &Net, package: &Package, turn: usize) -> (usize, Option<String>) {
    let (verbatim, configs) = (texts(net), Config::all());
    let mut n_read = 0;
    for file in package.files.iter().filter(|file| is_read(&file.name)) {
        for (at, config) in configs.iter().enumerate() {
            if file.name.ends_with(".c") || at == turn % configs.len() {
                n_read += 1;
                if let Some(why) = failure(package, &file.name, &verbatim, config) {
                    return (n_read, Some(why));
                }
            }
        }
    }
    (n_read, None)
}

/// Files below a folder.
fn collect(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { collect(&path, into) } else { into.push(path) }
    }
}

/// The charts of the examples and of the golden cases. Files with errors, and those that need others, are left out.
pub(crate) fn charts() -> Vec<(String, Valid<Net>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    collect(&root.join("../examples"), &mut paths);
    collect(&root.join("cases"), &mut paths);
    paths.sort();
    let known = ["graf", "scxml", "st", "exp", "xml", "c", "rules", "net", "kiss2"];
    paths.retain(|path| path.extension().is_some_and(|it| known.iter().any(|known| it == *known)));
    let read_one = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).ok()?;
        let name = path.file_name()?.to_string_lossy().into_owned();
        let mut sources = Sources::default();
        let main = sources.add(&name, &text);
        match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
            (Some(Design::Net(design)), _) => Some((path.display().to_string(), design.net)),
            (Some(Design::Logic(_)) | None, _) => None,
        }
    };
    in_parallel(&paths, read_one).into_iter().flatten().collect()
}

/// The option sets with which an example is emitted.
fn option_sets() -> [Options; 6] {
    let plain = Options::default;
    [
        plain(),
        Options { gate: true, ..plain() },
        Options { safe_state: true, ..plain() },
        Options { trace: Some(16), ..plain() },
        Options { io: Io::Words, ..plain() },
        Options { callbacks: true, ..plain() },
    ]
}

#[test]
fn examples_and_cases_are_read() {
    let charts = charts();
    assert!(charts.len() > 100, "{} charts", charts.len());
    let is_deep = rounds(0, 1) > 0;
    let (styles, sets) = (Style::ALL, option_sets());
    let mut work = Vec::new();
    for (at, chart) in charts.iter().enumerate() {
        for (style_at, style) in styles.iter().enumerate() {
            for (set_at, set) in sets.iter().enumerate() {
                // Each style with one set of options; over all charts, every pair occurs.
                let is_chosen = (at + style_at) % sets.len() == set_at && (at + style_at) % 3 == 0;
                if is_deep || is_chosen {
                    work.push((chart, Options { style: *style, ..set.clone() }, at));
                }
            }
        }
    }
    let found = in_parallel(&work, |((name, net), options, turn)| {
        let Ok((package, _)) = emitted(net, options.clone()) else { return (0, None) };
        let (n_read, why) = all_read(net, &package, *turn);
        (n_read, why.map(|why| format!("{name}, {}: {why}", options.style.name())))
    });
    let n_read: usize = found.iter().map(|(n_read, _)| n_read).sum();
    println!("{} charts, {} packages, {n_read} texts read", charts.len(), work.len());
    let failed: Vec<String> = found.into_iter().filter_map(|(_, why)| why).collect();
    assert!(failed.is_empty(), "{} failures:\n{}", failed.len(), failed.join("\n"));
    assert!(n_read > 1_000, "{n_read} texts");
}

#[test]
fn random_charts_in_every_style_are_read() {
    for style in Style::ALL {
        let mut charts = draw(style, rounds(9, 1_000)).charts;
        charts.extend(draw_of(style, rounds(4, 500), &Features::entering()).charts);
        let found = in_parallel(&charts, |chart| {
            let (_, why) = all_read(&chart.net, &chart.package, chart.seed as usize);
            why.map(|why| format!("seed {}, {:?}: {why}", chart.seed, chart.options))
        });
        let failed: Vec<String> = found.into_iter().flatten().collect();
        assert!(failed.is_empty(), "style {}: {}", style.name(), failed.join("\n"));
    }
}

/// Charts with odd names, macro-steps and qualifiers, each in one style.
#[test]
fn drawn_charts_are_read() {
    let seeds: Vec<u64> = (0..rounds(20, 1_000)).collect();
    let found = in_parallel(&seeds, |seed| {
        let net = grafsynth_tests::chart("random.graf", &random_chart(*seed)?);
        let style = Style::ALL[*seed as usize % Style::ALL.len()];
        let (package, options) = emitted(&net, options(*seed, style)).ok()?;
        let (n_read, why) = all_read(&net, &package, *seed as usize);
        Some((n_read, why.map(|why| format!("seed {seed}, {options:?}: {why}"))))
    });
    let n_read: usize = found.iter().flatten().map(|(n_read, _)| n_read).sum();
    let failed: Vec<String> = found.into_iter().flatten().filter_map(|(_, why)| why).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert!(n_read > 50, "{n_read} texts");
}

#[test]
fn text_of_the_user_is_one_statement() {
    let net = grafsynth_tests::chart(
        "lamp.graf",
        "chart lamp {\n input go\n output lit\n initial step off\n step on {\n lit\n code c \"\"\"\n float x = 'unread;\n   #if 0\n \"\"\"\n }\n \
         off -> on when go\n on -> off when not go do { code c \"out->lit = false;\" }\n}\n",
    );
    for style in [Style::Switch, Style::Bits, Style::Tables] {
        let options = Options { style, ..Options::default() };
        let Ok((package, _)) = emitted(&net, options) else { continue };
        let (n_read, why) = all_read(&net, &package, 0);
        assert_eq!(why, None);
        assert!(n_read > 3);
        let config = Config::host();
        let name = &package.files.iter().find(|file| file.name.ends_with(".c")).expect("C").name;
        assert!(failure(&package, name, &[], &config).is_some(), "without the texts it is not C");
    }
}

/// A package whose `NAME.c` is replaced by the text printed from its own tree; the headers stay.
fn printed(net: &Net, package: &Package) -> Package {
    let mut package = package.clone();
    let (verbatim, config) = (texts(net), Config::host());
    for at in 0..package.files.len() {
        let name = package.files[at].name.clone();
        if !name.ends_with(".c") || !is_read(&name) {
            continue;
        }
        let files = files(&package, &name);
        let (unit, found) = parse(&Input {
            files: &files,
            verbatim: &verbatim,
            readers: &READERS,
            config: &config,
        });
        let mut unit = unit.unwrap_or_else(|| panic!("{}", shown(&found, &files)));
        unit.items.retain(|item| item.span.0.file == FileId(0));
        let own = package.files[at].text.lines().filter(|line| line.starts_with("#include \""));
        let text = own.map(|line| format!("{line}\n")).collect::<String>() + "\n" + &print(&unit);
        package.files[at].text = text;
    }
    package
}

#[test]
fn printed_c_behaves_as_the_original() {
    let strict = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Werror", "-pedantic"];
    let Some(compiler) = Compiler::plain() else {
        assert!(std::env::var_os("CI").is_none(), "CI must have a C compiler");
        println!("skipped: no C compiler is installed");
        return;
    };
    let compiler = Compiler { flags: strict.to_vec(), ..compiler };
    for style in Style::ALL {
        let mut drawn = draw(style, rounds(3, 200));
        for chart in &mut drawn.charts {
            let text = printed(&chart.net, &chart.package);
            assert_ne!(text, chart.package);
            chart.package = text;
        }
        check(&drawn, 20, &compiler);
    }
}

/// The text with a few random changes of bytes or of tokens.
fn mutated(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len().max(1));
        let end = (at + 1 + random.below(40)).min(bytes.len());
        match random.below(7) {
            0 => bytes[at..end.min(at + 1)].fill(random.below(256) as u8),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let part = bytes[at..end].to_vec();
                let to = random.below(bytes.len().max(1));
                bytes.splice(to..to, part);
            }
            3 => {
                const SIGNS: &[u8] = b"(){}[];,*&+-<>=!?:.#\\\"'/ \n0aUL";
                bytes.insert(at, SIGNS[random.below(SIGNS.len())]);
            }
            4 => bytes.truncate(end),
            _ => {
                // A word in the place of another one.
                let (from, to) = (word(&bytes, at), word(&bytes, random.below(bytes.len().max(1))));
                let part = bytes[from].to_vec();
                bytes.splice(to, part);
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The word, or the single character, at a position.
fn word(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let is_word =
        |at: usize| bytes.get(at).is_some_and(|it| it.is_ascii_alphanumeric() || *it == b'_');
    if !is_word(at) {
        return at.min(bytes.len())..(at + 1).min(bytes.len());
    }
    let start = (0..=at).rev().take_while(|at| is_word(*at)).last().unwrap_or(at);
    let end = (at..bytes.len()).take_while(|at| is_word(*at)).last().unwrap_or(at);
    start..end + 1
}

/// No mutant causes a panic. A mutant that is still C is printed and read back as the same tree.
#[test]
fn mutants_are_read_or_refused() {
    let mut subjects = Vec::new();
    for style in Style::ALL {
        subjects.extend(draw(style, 6).charts);
    }
    let seeds: Vec<u64> = (0..rounds(3_000, 100_000)).collect();
    let found = in_parallel(&seeds, |seed| {
        let mut random = Random::new(*seed);
        let chart = random.pick(&subjects).expect("charts");
        let (verbatim, configs) = (texts(&chart.net), Config::all());
        let config = random.pick(&configs).expect("configurations");
        let mut package = chart.package.clone();
        let readable: Vec<usize> =
            (0..package.files.len()).filter(|at| is_read(&package.files[*at].name)).collect();
        let changed = *random.pick(&readable).expect("a file");
        package.files[changed].text = mutated(&package.files[changed].text, &mut random);
        let main = package.files.iter().find(|file| file.name.ends_with(".c")).expect("C");
        let files = files(&package, &main.name);
        let (unit, found) =
            parse(&Input { files: &files, verbatim: &verbatim, readers: &READERS, config });
        let Some(unit) = unit else {
            assert!(found.iter().any(Diagnostic::is_error), "seed {seed}");
            return false;
        };
        match again(&print(&unit), &verbatim, config) {
            Ok(second) => assert!(second == unit, "seed {seed}: another tree"),
            Err(why) => panic!("seed {seed}: the printed text: {why}"),
        }
        true
    });
    let n_good = found.iter().filter(|is_good| **is_good).count();
    println!("{} mutants, {n_good} of them are still C", seeds.len());
    assert!(n_good * 20 > seeds.len() && n_good < seeds.len(), "{n_good} are still C");
}
