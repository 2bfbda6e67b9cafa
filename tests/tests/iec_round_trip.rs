//! Charts written as structured text and as PLCopen projects, and read back: the same structure and the same traces.

#![allow(clippy::print_stdout, reason = "tests say how much they did")]

use itertools::Itertools as _;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::net::{Driver, Enter, Net, Qualifier};
use grafsynth_ir::{Diagnostic, FileId, Valid};
use grafsynth_sim::{Stimulus, Trace};
use grafsynth_tests::random_chart::{expressible, standard_features};
use grafsynth_tests::random_net::random_net;
use grafsynth_tests::rounds;

fn net_of(name: &str, text: &str) -> Result<Valid<Net>, String> {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
        (Some(Design::Net(design)), _) => Ok(design.net),
        (Some(Design::Logic(_)) | None, found) => Err(format!("{found:#?}")),
    }
}

fn written(net: &Net, language: &str) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    if language == "st" {
        grafsynth_frontend::st::write_net(net)
    } else {
        grafsynth_frontend::plcopen::write_net(net)
    }
}

fn name_in(language: &str) -> &'static str {
    if language == "st" { "a.st" } else { "a.xml" }
}

/// Steps, transitions, and the users of each action and output, in a canonical form: one line each. Only actions of `of` are included.
fn structure(net: &Net, of: &Net) -> Vec<String> {
    let step = |id| net.steps[id].name.text.as_str();
    let mut lines = Vec::new();
    for one in net.steps.values() {
        lines.push(format!("step {} {} {:?}", one.name, one.is_initial, one.meta.label));
    }
    for one in net.transitions.values() {
        let from = one.requires.iter().map(|id| step(*id)).join(",");
        let to = one
            .enters
            .iter()
            .filter_map(|enter| if let Enter::Step(id) = enter { Some(step(*id)) } else { None })
            .join(",");
        let label = &one.meta.label;
        lines.push(format!("{} -> {} {:?} {label:?}", from, to, one.priority));
    }
    let mut asked: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for output in net.outputs.values() {
        if let Driver::Continuous(emissions) = &output.driver {
            let uses =
                emissions.iter().map(|one| format!("{}({:?})", step(one.step), Qualifier::N));
            asked.entry(output.name.text.clone()).or_default().extend(uses);
        }
    }
    for action in net.actions.values() {
        let uses = action
            .uses
            .iter()
            .map(|one| format!("{}({:?}) {}", step(one.step), one.qualifier, action.duration));
        asked.entry(action.name.text.clone()).or_default().extend(uses);
    }
    let is_there = |name: &str| {
        of.outputs.values().any(|one| one.name.text == name)
            || of.actions.values().any(|one| one.name.text == name)
    };
    for (name, mut uses) in asked {
        uses.iter_mut().for_each(|one| *one = one.trim_end_matches(" 0").to_owned());
        uses.sort();
        if is_there(&name) && !uses.is_empty() {
            lines.push(format!("{name}: {}", uses.join(" ")));
        }
    }
    lines
}

/// The columns of a trace by their names.
fn columns(trace: &Trace) -> BTreeMap<String, Vec<String>> {
    let csv = trace.to_csv();
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let mut columns: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in lines {
        for (name, value) in head.iter().zip(line.split(',')) {
            columns.entry((*name).to_owned()).or_default().push(value.to_owned());
        }
    }
    columns
}

/// Checks that the second trace has all columns of the first one, with the same values, except those that `may_miss` names.
fn agree(first: &Trace, second: &Trace, may_miss: impl Fn(&str) -> bool, about: &str) {
    let (first, second) = (columns(first), columns(second));
    for (name, values) in first {
        match second.get(&name) {
            Some(others) => assert_eq!(&values, others, "column {name}, {about}"),
            None => assert!(may_miss(&name), "no column {name}, {about}"),
        }
    }
}

/// Elements of TC6 XML that are written, from the schema 2.01: their contents in order, and their required attributes.
const ELEMENTS: [(&str, &[&str], &[&str]); 29] = [
    ("project", &["fileHeader", "contentHeader", "types", "instances"], &[]),
    ("fileHeader", &[], &["companyName", "productName", "productVersion", "creationDateTime"]),
    ("contentHeader", &["coordinateInfo"], &["name"]),
    ("types", &["dataTypes", "pous"], &[]),
    (
        "pou",
        &["interface", "actions", "transitions", "body", "addData", "documentation"],
        &["name", "pouType"],
    ),
    ("interface", &["inputVars", "outputVars", "localVars"], &[]),
    ("variable", &["type", "initialValue", "addData", "documentation"], &["name"]),
    ("subrangeSigned", &["range", "baseType"], &[]),
    ("range", &[], &["lower", "upper"]),
    ("array", &["dimension", "baseType"], &[]),
    ("dimension", &[], &["lower", "upper"]),
    ("derived", &[], &["name"]),
    ("simpleValue", &[], &["value"]),
    (
        "action",
        &[
            "relPosition",
            "body",
            "reference",
            "inline",
            "connectionPointOut",
            "addData",
            "documentation",
        ],
        &[],
    ),
    ("reference", &[], &["name"]),
    (
        "step",
        &[
            "position",
            "connectionPointIn",
            "connectionPointOut",
            "connectionPointOutAction",
            "addData",
            "documentation",
        ],
        &["localId", "name"],
    ),
    ("connectionPointOutAction", &[], &["formalParameter"]),
    (
        "transition",
        &[
            "position",
            "connectionPointIn",
            "connectionPointOut",
            "condition",
            "addData",
            "documentation",
        ],
        &["localId"],
    ),
    ("condition", &["reference", "connectionPointIn", "inline"], &[]),
    ("inline", &["ST"], &["name"]),
    (
        "jumpStep",
        &["position", "connectionPointIn", "addData", "documentation"],
        &["localId", "targetName"],
    ),
    ("selectionDivergence", &["position", "connectionPointIn", "connectionPointOut"], &["localId"]),
    (
        "selectionConvergence",
        &["position", "connectionPointIn", "connectionPointOut"],
        &["localId"],
    ),
    (
        "simultaneousDivergence",
        &["position", "connectionPointIn", "connectionPointOut"],
        &["localId"],
    ),
    (
        "simultaneousConvergence",
        &["position", "connectionPointIn", "connectionPointOut"],
        &["localId"],
    ),
    ("actionBlock", &["position", "connectionPointIn", "action"], &["localId"]),
    ("connection", &["position"], &["refLocalId"]),
    ("task", &["pouInstance"], &["name", "priority"]),
    ("pouInstance", &[], &["name", "typeName"]),
];

/// Checks the elements of a written project against the schema: numbers of elements are unique, and wires and jumps have targets.
fn check_project(text: &str) {
    let document = roxmltree::Document::parse(text).unwrap_or_else(|why| panic!("{why}\n{text}"));
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        let name = node.tag_name().name();
        let Some((_, children, attributes)) = ELEMENTS.iter().find(|one| one.0 == name) else {
            continue;
        };
        let mut at = 0;
        for child in node.children().filter(roxmltree::Node::is_element) {
            let child = child.tag_name().name();
            let place = children.iter().position(|one| *one == child);
            let place = place.unwrap_or_else(|| panic!("`{child}` in `{name}`\n{text}"));
            assert!(place >= at, "`{child}` comes too late in `{name}`\n{text}");
            at = place;
        }
        for attribute in *attributes {
            assert!(node.has_attribute(*attribute), "`{name}` without {attribute}\n{text}");
        }
        if name != "SFC" && node.parent_element().is_some_and(|one| one.tag_name().name() == "SFC")
        {
            let id = node.attribute("localId");
            let around = node.parent_element().expect("it has one");
            let same = around.children().filter(|one| one.attribute("localId") == id).count();
            assert_eq!(same, 1, "number {id:?} of `{name}`\n{text}");
            for wire in node.descendants().filter(|one| one.tag_name().name() == "connection") {
                let from = wire.attribute("refLocalId");
                let is_there = around.children().any(|one| one.attribute("localId") == from);
                assert!(is_there, "a wire from {from:?}\n{text}");
            }
            if let Some(target) = node.attribute("targetName") {
                let is_there = around.children().any(|one| {
                    one.tag_name().name() == "step" && one.attribute("name") == Some(target)
                });
                assert!(is_there, "a jump to {target}\n{text}");
            }
        }
    }
}

/// Nets that the standard can express, written and read back: the same structure, equal traces, and after constant folding the same text each time.
#[test]
fn charts_written_as_programs_come_back() {
    let mut n_of: BTreeMap<&str, u64> = BTreeMap::new();
    for seed in 0..rounds(400, 2_500) {
        let Some(net) = expressible(random_net(seed, &standard_features()), seed % 2 == 1) else {
            continue;
        };
        for language in ["st", "plcopen"] {
            let Ok((text, lost)) = written(&net, language) else { continue };
            let about = format!("seed {seed}\n{text}");
            let again =
                net_of(name_in(language), &text).unwrap_or_else(|why| panic!("{why}, {about}"));
            let renamed = lost.iter().any(|one| one.message.contains(" is renamed to "));
            let stimulus = Stimulus::random(&net, 40, seed, 3);
            let (first, second) =
                (grafsynth_sim::run(&net, &stimulus), grafsynth_sim::run(&again, &stimulus));
            if !renamed {
                agree(&first, &second, |_| false, &about);
                assert_eq!(structure(&net, &net), structure(&again, &net), "{about}");
            }
            // Reading folds constants (`0 MOD 2`); after that, the text is the same each time. A timer becomes a TON with its variables.
            let write = |net: &Valid<Net>| {
                written(net, language).unwrap_or_else(|why| panic!("{why:#?}, {about}")).0
            };
            let second = write(&again);
            if net.timers.is_empty() {
                let third = net_of(name_in(language), &second)
                    .unwrap_or_else(|why| panic!("{why}, {about}"));
                assert_eq!(write(&third), second, "{about}");
            }
            let is_text = language == "st";
            if !is_text {
                check_project(&text);
            }
            *n_of.entry(if is_text { "texts" } else { "projects" }).or_default() += 1;
            *n_of.entry("the same at once").or_default() += u64::from(second == text);
            let has_lists =
                net.steps.values().any(|one| !one.entry.is_empty() || !one.exit.is_empty());
            *n_of.entry("with lists of steps").or_default() += u64::from(has_lists);
            *n_of.entry("with free timers").or_default() += u64::from(!net.timers.is_empty());
        }
    }
    println!("{n_of:?}");
    for (what, least) in
        [("texts", 100), ("projects", 100), ("with lists of steps", 30), ("with free timers", 30)]
    {
        assert!(n_of.get(what).is_some_and(|n| *n >= least), "too few {what}: {n_of:?}");
    }
}

/// Random projects and the drawn one, if the schema and a validator are available.
#[test]
#[allow(clippy::disallowed_methods, reason = "tests read files and start a validator")]
fn written_projects_are_valid_against_the_schema() {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus");
    let corpus = std::env::var_os("GRAFSYNTH_CORPUS").map_or(beside, PathBuf::from);
    let schema = corpus.join("plcopen/tc6_xml_v201.xsd");
    if !schema.is_file() || Command::new("xmllint").arg("--version").output().is_err() {
        println!("skipped: xmllint or the schema is not here (GRAFSYNTH_CORPUS names its folder)");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let drawn = net_of("drawn.graf", include_str!("../cases/plcopen/drawn.graf"))
        .unwrap_or_else(|why| panic!("{why}"));
    let random = (0..rounds(120, 2_000))
        .filter_map(|seed| expressible(random_net(seed, &standard_features()), seed % 2 == 1));
    let mut n_files = 0;
    let mut command = Command::new("xmllint");
    command.arg("--noout").arg("--schema").arg(&schema);
    for net in random.chain([drawn]) {
        let Ok((text, _)) = written(&net, "plcopen") else { continue };
        let path = folder.path().join(format!("{n_files}.xml"));
        std::fs::write(&path, text).expect("it can be written");
        command.arg(path);
        n_files += 1;
    }
    let checked = command.output().expect("xmllint runs");
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    println!("{n_files} projects are valid");
    assert!(n_files > 30, "only {n_files}");
}

/// A chart with macro-steps, lists of steps, a timer and comments, in both formats: it is the same except for renamed objects.
#[test]
fn macro_steps_lists_timers_and_comments_come_back() {
    let net = net_of("drawn.graf", include_str!("../cases/plcopen/drawn.graf"))
        .unwrap_or_else(|why| panic!("{why}"));
    for language in ["st", "plcopen"] {
        let (text, lost) = written(&net, language).unwrap_or_else(|why| panic!("{why:#?}"));
        let said: Vec<&str> = lost.iter().map(|one| one.message.as_str()).collect();
        for part in [
            "macro-step `wash` is expanded",
            "macro-step `wash.rinse` is expanded",
            "the timer `soak` is written as an instance of TON",
        ] {
            assert!(said.contains(&part), "{part} is not in {said:?}");
        }
        assert!(
            lost.iter().all(|one| one.labels.iter().all(|label| label.span.end > 0)),
            "{lost:?}"
        );
        if language == "plcopen" {
            check_project(&text);
        }
        for comment in ["nothing runs", "water flows in", "somebody wants it"] {
            assert!(text.contains(comment), "{comment} is not in\n{text}");
        }
        let again = net_of(name_in(language), &text).unwrap_or_else(|why| panic!("{why}\n{text}"));
        for seed in 0..20 {
            let stimulus = Stimulus::random(&net, 200, seed, 2);
            let (first, second) =
                (grafsynth_sim::run(&net, &stimulus), grafsynth_sim::run(&again, &stimulus));
            // Steps have other names; their behaviour is the same.
            let (mut first_columns, second_columns) = (columns(&first), columns(&second));
            first_columns.remove("steps");
            for (name, values) in first_columns {
                assert_eq!(Some(&values), second_columns.get(&name), "{name}\n{text}");
            }
            let renamed = |steps: &[String]| -> Vec<String> {
                steps.iter().map(|one| one.replace('.', "_")).collect()
            };
            assert_eq!(renamed(&columns(&first)["steps"]), columns(&second)["steps"], "{text}");
        }
    }
    let (stimulus, _) = Stimulus::parse_csv(&net, FileId(0), "go,full\n1,0\n");
    assert!(stimulus.is_some());
}
