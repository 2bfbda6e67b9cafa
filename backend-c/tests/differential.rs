//! Random nets: the emitted C, compiled and run, gives the trace of the reaction program byte for byte, in all tested styles.

#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "tests try the text on real compilers and report what they skip"
)]

use std::io::Write as _;
use std::process::{Command, Stdio};

use grafsynth_backend_c::{Io, Options, Package, Style, emit, multi_harness};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, Policy};

use crate::support::random_net::{Flavour, random_net};
use crate::support::*;

/// Runs all nets in one program for each style, and compares.
fn agree(tag: &str, nets: &[(Valid<Net>, Facts)], styles: &[Style]) -> Vec<&'static str> {
    agree_with(tag, nets, styles, &Options::default())
}

/// Like `agree`, with other options.
fn agree_with(
    tag: &str,
    nets: &[(Valid<Net>, Facts)],
    styles: &[Style],
    wanted: &Options,
) -> Vec<&'static str> {
    let mut taken = Vec::new();
    if !have("gcc") {
        return taken;
    }
    for style in styles {
        let mut packages: Vec<Package> = Vec::new();
        for (index, (net, facts)) in nets.iter().enumerate() {
            let options =
                Options { style: *style, prefix: Some(format!("n{index}")), ..wanted.clone() };
            let package = emit(net, facts, &options)
                .unwrap_or_else(|errors| panic!("{tag} {index}: {errors:#?}"));
            taken.push(package.style);
            if *style == Style::Auto && !package.reason.is_empty() {
                println!("{tag} {index}: bits because of {}", package.reason);
            }
            packages.push(package);
        }
        let all: Vec<(&Valid<Net>, &Package)> =
            nets.iter().map(|(net, _)| net).zip(&packages).collect();
        let folder = Folder::new(&format!("{tag}-{}", style.name()));
        std::fs::write(folder.0.join("all.c"), multi_harness(&all))
            .expect("the file can be written");
        let mut arguments = STRICT.to_vec();
        arguments.extend([
            "-O0",
            "-fsanitize=undefined",
            "-fno-sanitize-recover",
            "all.c",
            "-o",
            "all",
        ]);
        if Command::new("gcc")
            .args(&arguments)
            .current_dir(&folder.0)
            .output()
            .is_ok_and(|it| !it.status.success())
        {
            let keep = std::env::temp_dir().join("grafsynth-c-failed.c");
            let _ = std::fs::copy(folder.0.join("all.c"), keep);
        }
        run(&folder.0, "gcc", &arguments);
        for (index, (net, _)) in nets.iter().enumerate() {
            let mut rows = stimulus(net, 200, index as u64 + 1);
            if wanted.gate {
                // Repeated rows close a gate, so each row occurs three times.
                rows = rows.into_iter().flat_map(|row| [row.clone(), row.clone(), row]).collect();
            }
            let mut child = Command::new(folder.0.join("all"))
                .arg(index.to_string())
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()
                .expect("the program starts");
            let text = stimulus_text(net, &rows);
            let mut pipe = child.stdin.take().expect("a pipe");
            let writer = std::thread::spawn(move || pipe.write_all(text.as_bytes()));
            let output = child.wait_with_output().expect("the program ends");
            let _ = writer.join();
            let wanted = program_trace(net, &rows);
            let got = String::from_utf8(output.stdout).expect("text");
            if got != wanted {
                let pair = wanted.lines().zip(got.lines()).enumerate().find(|(_, (a, b))| a != b);
                let source = &packages[index]
                    .files
                    .iter()
                    .find(|it| it.name.ends_with(".c"))
                    .expect("a source")
                    .text;
                panic!(
                    "{tag} {index} {}: first difference {pair:?}\n{}\n{source}",
                    packages[index].style,
                    wanted.lines().next().unwrap_or_default()
                );
            }
        }
    }
    taken
}

fn nets(count: u64, flavour: Flavour) -> Vec<(Valid<Net>, Facts)> {
    (0..count).map(|seed| random_net("chart", seed * 7 + 1, flavour)).collect()
}

/// Nets of each kind: enough to find a bug here, few enough to be fast.
const NETS: u64 = 8;

const PLAIN: Flavour =
    Flavour { policy: Policy::Priority, stable: false, lists: false, forks: false, times: false };

#[test]
fn rings_with_priorities() {
    let tables = Options { style: Style::Tables, ..Options::default() };
    let (mut nets, others): (Vec<_>, Vec<_>) =
        nets(10 * NETS, PLAIN).into_iter().partition(|(net, facts)| {
            emit(net, facts, &tables).is_ok_and(|package| package.style == "switch with tables")
        });
    // Tables suit few of the nets.
    assert!(!nets.is_empty());
    nets.extend(others.into_iter().take(NETS as usize));
    let styles = [Style::Switch, Style::Tables, Style::Bits];
    let taken = agree("rings", &nets, &styles);
    assert!(taken.is_empty() || taken.contains(&"switch with tables"));
}

#[test]
fn rings_with_lists_and_times() {
    let flavour = Flavour { lists: true, times: true, ..PLAIN };
    let taken = agree("lists", &nets(NETS, flavour), &[Style::Auto, Style::Bits]);
    assert!(
        taken.is_empty() || taken.iter().filter(|it| **it == "switch").count() >= 4,
        "{taken:?}"
    );
}

#[test]
fn forks_and_joins() {
    for policy in [Policy::Priority, Policy::All] {
        let flavour = Flavour { policy, forks: true, times: true, ..PLAIN };
        let taken =
            agree(&format!("forks-{policy:?}"), &nets(NETS, flavour), &[Style::Auto, Style::Bits]);
        assert!(
            taken.is_empty() || taken.iter().filter(|it| it.starts_with("switch")).count() >= 4,
            "{taken:?}"
        );
    }
}

#[test]
fn stable_evolution() {
    for policy in [Policy::Priority, Policy::All] {
        let flavour = Flavour { policy, stable: true, forks: true, lists: true, times: true };
        let taken =
            agree(&format!("stable-{policy:?}"), &nets(NETS, flavour), &[Style::Auto, Style::Bits]);
        assert!(
            taken.is_empty() || taken.iter().filter(|it| it.starts_with("switch")).count() >= 4,
            "{taken:?}"
        );
    }
}

/// Tests that inputs and outputs in words, and the gate, cause no visible change in any style.
#[test]
fn words_and_gate() {
    let all = Flavour { lists: true, times: true, forks: true, ..PLAIN };
    let styles = [Style::Switch, Style::Tables, Style::Bits];
    for (at, flavour) in
        [PLAIN, all, Flavour { stable: true, ..all }, Flavour { policy: Policy::All, ..all }]
            .into_iter()
            .enumerate()
    {
        let forms = [(Io::Words, true), (Io::Words, false), (Io::Members, true)];
        for (io, gate) in forms.into_iter().take(if at == 0 { 3 } else { 1 }) {
            // Charts that call functions have no gate.
            let taken: Vec<(Valid<Net>, Facts)> = nets(8 * NETS, flavour)
                .into_iter()
                .filter(|(net, facts)| {
                    emit(net, facts, &Options { gate, ..Options::default() }).is_ok()
                })
                .take(NETS as usize)
                .collect();
            assert!(taken.len() as u64 == NETS, "{at}: {}", taken.len());
            let options = Options { io, gate, ..Options::default() };
            let styles = match (at, io, gate) {
                (0, Io::Words, true) => &styles[..],
                (0, ..) => &styles[1..2],
                _ => &[Style::Auto, Style::Bits][..],
            };
            agree_with(&format!("io-{at}-{gate}-{io:?}"), &taken, styles, &options);
        }
    }
}
