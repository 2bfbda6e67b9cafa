//! The emitted C under `cppcheck --addon=misra`: only deviations from the advisory rules that `docs/c.md` lists, in every style.

#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::{Options, Package, Style, emit};
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{fleet, rounds};
use std::collections::BTreeSet;
use std::time::Duration;

/// The deviations of `docs/c.md`. All of them are advisory; required and mandatory rules must never be added.
const DEVIATIONS: [&str; 5] = ["2.4", "2.5", "8.11", "8.9", "15.5"];

/// The findings of cppcheck in the C of a net, without the deviations and remarks. Each package is a separate program.
fn findings(seed: u64, net: &Valid<Net>) -> BTreeSet<String> {
    // cppcheck takes seconds for each package, so each net is tested in one style.
    let style = [Style::Tables, Style::Bits, Style::Switch][(seed % 3) as usize];
    // Words, gate, callbacks, trace ring and split functions as chosen by the seed. A style rejects what it does not support.
    let drawn = fleet::options(seed, style);
    let Ok((package, _)) = fleet::emitted(net, drawn) else { return BTreeSet::new() };
    let found = findings_of(&package).into_iter();
    found.map(|found| format!("seed {seed}, {}: {found}", style.name())).collect()
}

fn findings_of(package: &Package) -> Vec<String> {
    let cppcheck = tools::find(&["cppcheck"]).expect("the caller looked for it");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = [
        "-q",
        "--addon=misra",
        "--enable=all",
        "--std=c99",
        "--template={id} {severity} {line} {file}",
    ];
    let mut arguments = options.to_vec();
    for file in package.files.iter().filter(|file| !file.keep_existing) {
        std::fs::write(folder.path().join(&file.name), &file.text).expect("it is written");
        if file.name.ends_with(".c") {
            arguments.push(&file.name);
        }
    }
    let limit = Duration::from_secs(120);
    let run = tools::run(&cppcheck, &arguments, folder.path(), b"", limit).expect("it runs");
    assert!(run.is_success, "{}", run.stderr);
    let mut found = Vec::new();
    for finding in run.stderr.lines() {
        let words: Vec<&str> = finding.splitn(4, ' ').collect();
        let (id, severity, line, name) = match words.as_slice() {
            [id, severity, line, name] => (*id, *severity, *line, *name),
            _ => (finding, "", "", ""),
        };
        let is_known = match id.strip_prefix("misra-c2012-") {
            Some(rule) => DEVIATIONS.contains(&rule),
            // Findings about a random chart's conditions are ignored, such as a guard that is always true or contradicts itself.
            None => matches!(severity, "style" | "information" | "warning"),
        };
        if !is_known {
            let file = package.files.iter().find(|file| file.name == name);
            let at = line.parse::<usize>().unwrap_or(0).saturating_sub(1);
            let text = file.and_then(|file| file.text.lines().nth(at)).unwrap_or_default();
            found.push(format!("{id} in {name}:{line}: {}", text.trim()));
        }
    }
    found
}

#[test]
fn random_charts_in_c_keep_to_misra() {
    if tools::find(&["cppcheck"]).is_none() {
        assert!(std::env::var_os("CI").is_none(), "cppcheck is missing, and CI must have it");
        println!("skipped: cppcheck is not here");
        return;
    }
    // A net with all features as tables, and a plain one in each style: cppcheck takes minutes for some of the large ones.
    let mut found = findings(0, &random_net(0, &Features::everything()));
    for seed in 0..rounds(4, 24) {
        found.extend(findings(seed, &random_net(seed, &Features::plain())));
    }
    assert!(found.is_empty(), "{found:#?}");
}

/// The engines, and the files written with them: tables, byte code with library functions, states and transitions.
#[test]
fn engines_keep_to_misra() {
    if tools::find(&["cppcheck"]).is_none() {
        println!("skipped: cppcheck is not here");
        return;
    }
    let calls = "chart calls {
        evolution stable limit 9
        input a
        input n: int -5..300
        extern condition door()
        extern action speed(int -3..400)
        output R
        var v: int 0..90[4]
        initial step s { R if door() or a }
        step r { entry { v[1] := n / 7; call speed(n * n) } set R }
        s -> r when door() and rise(a) do { if n > 3 { v[0] := v[1] mod 5 } else { call speed(n) } }
        r -> s when r.t > 5
    }";
    let states = "chart states {
        conflict inner-first
        event E, F
        input a
        output R
        var v: int 0..9 = 0
        state A { initial state x { R } state y { entry { v := v + 1 } } history H
            x -> y on E  y -> x after 20 ms }
        state Z { exit { v := 0 } }
        A -> Z on F when rise(a)
        Z -> H on E
    }";
    for (text, style) in [(calls, Style::Engine), (states, Style::Engine), (states, Style::Btrans)]
    {
        let net = grafsynth_tests::chart("misra.graf", text);
        let options = Options { style, ..Options::default() };
        let facts = grafsynth_verify::structural_facts(&net);
        let package = emit(&net, &facts, &options).expect("carried");
        let found = findings_of(&package);
        assert!(found.is_empty(), "{}: {found:#?}", style.name());
    }
}

/// The page lists exactly the rules that are permitted here.
#[test]
fn the_page_names_the_deviations() {
    let page = include_str!("../../docs/c.md");
    let section = page.split("## MISRA").nth(1).expect("docs/c.md mentions MISRA");
    let section = section.split("\n## ").next().unwrap_or_default();
    for rule in DEVIATIONS {
        assert!(section.contains(&format!("| {rule} |")), "docs/c.md does not name {rule}");
    }
    let rows = section.lines().filter(|line| line.starts_with("| ") && !line.contains("rule"));
    assert_eq!(rows.count(), DEVIATIONS.len(), "docs/c.md lists rules without a deviation");
}
