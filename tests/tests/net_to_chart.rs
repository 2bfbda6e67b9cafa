//! Nets written back as charts: hierarchy, regions and history are reconstructed, and the result behaves like the net.

#![allow(clippy::disallowed_methods, reason = "tests read files")]
#![allow(clippy::print_stdout, reason = "tests report what they saw")]

use grafsynth_driver::read::{Design, NetDesign, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::net::{Net, Policy, StepKind};
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{Stimulus, run};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::rounds;
use itertools::Itertools as _;
use std::fs;
use std::path::{Path, PathBuf};

fn design_of(name: &str, text: &str) -> Option<Box<NetDesign>> {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()).0 {
        Some(Design::Net(design)) => Some(design),
        Some(Design::Logic(_)) | None => None,
    }
}

/// Writes the net as a chart, reads it, and runs both; returns the reasons if it cannot be a chart.
fn net_to_chart(
    what: &str,
    net: &Valid<Net>,
    stimulus: &Stimulus,
    is_from_chart: bool,
) -> Result<(), Vec<String>> {
    let text = grafsynth_frontend::graf::write_net(net).map_err(|found| {
        assert!(found.iter().all(|it| it.code.id == "G0120"), "{what}: {found:#?}");
        found.into_iter().map(|it| it.message).collect::<Vec<String>>()
    })?;
    let again = behaves_as(what, net, stimulus, &text);
    // A net from a chart is reconstructed exactly; a random net may have forms that lowering shortens.
    if is_from_chart {
        let twice = grafsynth_frontend::graf::write_net(&again);
        assert_eq!(twice.as_deref(), Ok(text.as_str()), "{what}");
    }
    Ok(())
}

/// Reads the chart, and runs it and the net.
fn behaves_as(what: &str, net: &Valid<Net>, stimulus: &Stimulus, text: &str) -> Valid<Net> {
    let parsed = grafsynth_frontend::graf::parse(FileId(0), text);
    let design =
        parsed.design.unwrap_or_else(|| panic!("{what}: {:#?}\n{text}", parsed.diagnostics));
    let (again, found) = grafsynth_ir::lower::lower(&design);
    let again = again.unwrap_or_else(|| panic!("{what}: {found:#?}\n{text}"));
    let (rows, problems) = Stimulus::parse_csv(&again, FileId(0), &stimulus.to_csv(net));
    let rows = rows.unwrap_or_else(|| panic!("{what}: {problems:#?}\n{text}"));
    let (expected, got) = (run(net, stimulus).to_csv(), run(&again, &rows).to_csv());
    if let Some((row, (left, right))) =
        expected.lines().zip(got.lines()).enumerate().find(|(_, (a, b))| a != b)
    {
        panic!(
            "{what}, row {row}:\n  {left}\n  {right}\n{text}\n{}",
            grafsynth_ir::text::print(net)
        );
    }
    assert_eq!(expected.len(), got.len(), "{what}");
    again
}

fn is_hierarchical(net: &Net) -> bool {
    net.steps.values().any(|step| step.parent.is_some())
}

/// Checks that most random nets with hierarchy can be written as charts; the others report the reason.
fn random_nets(features: &Features, n_nets: u64, least: u32, share: u32) {
    let (mut drawn, mut refused) = (0_u32, 0_u32);
    for seed in 0..rounds(n_nets, 4 * n_nets) {
        let net = random_net(seed, features);
        if !is_hierarchical(&net) {
            continue;
        }
        let stimulus = Stimulus::random(&net, 60, seed, 3);
        match net_to_chart(&format!("seed {seed}"), &net, &stimulus, false) {
            Ok(()) => drawn += 1,
            Err(why) => {
                refused += 1;
                if refused < 12 {
                    println!("seed {seed}: {}", why.join("; "));
                }
            }
        }
    }
    println!("drawn {drawn}, refused {refused}");
    assert!(drawn > least && drawn * share > refused, "drawn {drawn}, refused {refused}");
}

#[test]
fn random_statecharts_are_drawn_again() {
    let policies = vec![Policy::InnerFirst, Policy::OuterFirst];
    // Controlled actions are for Grafcet charts.
    let features = Features {
        policies,
        controlled_actions: false,
        several_parts: false,
        sharing: false,
        ..Features::everything()
    };
    random_nets(&features, 600, 100, 2);
}

#[test]
fn random_enclosing_steps_are_drawn_again() {
    // Such a net has its transitions in any order; in a chart, transitions of an enclosed part are consecutive.
    let features = Features {
        several_parts: false,
        sharing: false,
        ..Features::everything().without_statecharts()
    };
    random_nets(&features, 2000, 20, 40);
}

fn below(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            below(&path, out);
        } else {
            out.push(path);
        }
    }
}

/// Every chart of the W3C's assertions and every example with hierarchy.
#[test]
fn charts_with_hierarchy_are_drawn_again() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    below(&here.join("scxml/w3c"), &mut paths);
    let n_assertions = paths.len();
    below(&here.join("../examples"), &mut paths);
    below(&here.join("cases"), &mut paths);
    paths.sort();
    let (mut n_drawn, mut n_states, mut n_enclosing) = (0, 0, 0);
    for path in paths {
        let name = path.to_string_lossy().into_owned();
        let Ok(text) = fs::read_to_string(&path) else { continue };
        if !matches!(path.extension().and_then(|it| it.to_str()), Some("graf" | "scxml" | "net")) {
            continue;
        }
        let Some(design) = design_of(&name, &text) else { continue };
        let net = &design.net;
        if !is_hierarchical(net) && !name.contains("w3c") {
            continue;
        }
        for seed in 0..3 {
            let stimulus = Stimulus::random(net, 80, seed, 3);
            // A chart in another language behaves the same after it is written in the chart language.
            if let Some(chart) = design.chart.as_ref().filter(|it| it.libraries.is_empty()) {
                let text = grafsynth_frontend::graf::write_design(chart);
                behaves_as(&name, net, &stimulus, &text);
            }
            if let Err(why) = net_to_chart(&name, net, &stimulus, true) {
                println!("{name}: {}", why.join("; "));
                assert!(
                    !name.contains("w3c") && !net.settings.policy.is_statechart()
                        || why.iter().all(|it| it.contains("partial chart"))
                        // The states that such a transition leaves depend on variables that no chart has (semantics C35).
                        || name.contains("inner_history"),
                    "{name}: {why:?}"
                );
                break;
            }
            n_drawn += u32::from(seed == 0);
        }
        let has = |kind| net.steps.values().any(|step| step.kind == kind);
        n_states += u32::from(has(StepKind::Composite) || has(StepKind::Parallel));
        n_enclosing += u32::from(has(StepKind::Enclosing));
    }
    println!(
        "{n_drawn} drawn; {n_states} with states in states, {n_enclosing} with enclosing steps"
    );
    assert!(n_drawn as usize > n_assertions, "{n_drawn} drawn, {n_assertions} assertions");
    assert!(n_states > 20 && n_enclosing > 2, "{n_states} {n_enclosing}");
}

/// Delays and outer-first priority have no syntax in SCXML; the document expresses them in another way.
#[test]
fn delays_and_the_outer_state_first_in_scxml() {
    let charts = [
        "chart c { conflict outer-first tick 10 ms event E, F, G
            output R
            var n: int 0..9
            initial state p {
                on G when n > 4 { n := 0 }
                initial state q { initial step a step b { R } a -> b on E, F do { n := n + 1 } b -> a on E, G do { n := n + 2 } in b on F do { n := n + 1 } }
                step r
                q -> r on E when n > 3
                r -> q on F
                q -> q on G when n = 2
            }
            parallel s { region x { step u step v u -> v on E v -> u on E do { n := n + 1 } } region y { step w step z w -> z on F z -> w on E } }
            p -> s on F when n > 2
            s -> p on E when n > 6
            s -> p on G
        }",
        "chart c { conflict inner-first tick 10 ms event E, F
            output R
            var n: int 0..9
            initial state p {
                initial step a { R }
                step b
                a -> b after 50 ms
                b -> a on E after 20 ms do { n := n + 1 }
                b -> b on F
            }
            step r
            p -> r after 120 ms
            r -> p on F
        }",
        "chart c { conflict outer-first tick 10 ms event E, F
            var n: int 0..9
            initial state p {
                initial step a
                step b
                a -> b on E
                b -> a on E when n < 5 after 30 ms do { n := n + 1 }
            }
            step r
            p -> r on E when n > 2 after 40 ms do { n := 0 }
            r -> p on F
        }",
    ];
    for (at, chart) in charts.iter().enumerate() {
        let design = design_of("c.graf", chart).unwrap_or_else(|| panic!("chart {at}"));
        let drawn = design.chart.as_ref().expect("it was drawn");
        let (text, lost) = grafsynth_frontend::scxml::write_design(drawn, &design.net)
            .unwrap_or_else(|found| panic!("chart {at}: {found:#?}"));
        assert!(!lost.is_empty(), "chart {at}");
        let again = design_of("c.scxml", &text).unwrap_or_else(|| panic!("chart {at}\n{text}"));
        for seed in 0..20 {
            let stimulus = Stimulus::random(&design.net, 100, seed, 3);
            let csv = stimulus.to_csv(&design.net);
            let rows = Stimulus::parse_csv(&again.net, FileId(0), &csv).0.expect("the same inputs");
            let cells = |net: &Valid<Net>, rows: &Stimulus| -> Vec<String> {
                let csv = run(net, rows).to_csv();
                let head: Vec<String> =
                    csv.lines().next().unwrap_or("").split(',').map(str::to_owned).collect();
                // A variable that replaces a delay has its own column.
                let kept = |at: usize| !head[at].ends_with("_is_over");
                csv.lines()
                    .map(|line| {
                        let cells = line.split(',').enumerate().filter(|(at, _)| kept(*at));
                        cells.map(|(_, cell)| cell).join(",")
                    })
                    .collect()
            };
            let sorted = |lines: Vec<String>| -> Vec<Vec<String>> {
                // Outputs and variables may be in another order.
                let head: Vec<String> = lines[0].split(',').map(str::to_owned).collect();
                let mut order: Vec<usize> = (0..head.len()).collect();
                order.sort_by(|a, b| head[*a].cmp(&head[*b]));
                lines
                    .iter()
                    .map(|line| {
                        let cells: Vec<&str> = line.split(',').collect();
                        order.iter().map(|at| cells[*at].to_owned()).collect()
                    })
                    .collect()
            };
            let (expected, got) =
                (sorted(cells(&design.net, &stimulus)), sorted(cells(&again.net, &rows)));
            let differs = expected.iter().zip(&got).position(|(a, b)| a != b);
            assert_eq!(
                differs,
                None,
                "chart {at}, seed {seed}: {:?} {:?}\n{text}",
                differs.map(|row| &expected[row]),
                differs.map(|row| &got[row])
            );
        }
    }
}
