//! IEC 61131-3: files by others, a plant and a crossing on all engines, and charts written and read back.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests read files")]

use grafsynth_backend_c::{Options, Package, Style, multi_harness};
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_engines::{Availability, EngineError, Job, Pace, c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Clocked, Stimulus, Trace, compare};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

fn net_of(name: &str, text: &str) -> Result<Valid<Net>, String> {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    let (design, found) =
        read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
    match design {
        Some(Design::Net(design)) => Ok(design.net),
        Some(Design::Logic(_)) | None => Err(format!("{found:#?}")),
    }
}

/// The folder with files by others, from an environment variable or next to the checkout.
fn corpus() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus");
    let folder = std::env::var_os("GRAFSYNTH_CORPUS").map_or(beside, PathBuf::from);
    let found = folder.is_dir().then_some(folder);
    if found.is_none() {
        println!("skipped: no corpus (GRAFSYNTH_CORPUS names its folder)");
    }
    found
}

/// Each file becomes a chart, or each error about it has a location in the file.
#[test]
fn files_by_others_convert_or_are_refused_by_name_and_place() {
    let Some(corpus) = corpus() else { return };
    let mut n_files = 0;
    for folder in ["iec-st", "iec-st/probes", "plcopen"] {
        let Ok(entries) = std::fs::read_dir(corpus.join(folder)) else { continue };
        for entry in entries.flatten() {
            let path = entry.path();
            let is_ours = path.extension().is_some_and(|one| one == "st" || one == "xml");
            let Some(text) = is_ours.then(|| std::fs::read_to_string(&path).ok()).flatten() else {
                continue;
            };
            n_files += 1;
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
            let name = name.unwrap_or_default();
            let mut sources = Sources::default();
            let main = sources.add(name.clone(), text.as_str());
            let (design, found) =
                read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
            let refusals: Vec<_> = found.iter().filter(|one| one.is_error()).collect();
            assert_eq!(design.is_none(), !refusals.is_empty(), "{name}: {found:#?}");
            for refusal in refusals {
                let label =
                    refusal.labels.first().unwrap_or_else(|| panic!("{name}: {refusal:#?}"));
                assert!((label.span.end as usize) <= text.len(), "{name}: {refusal:#?}");
                assert!(label.span.start < label.span.end, "{name}: {refusal:#?}");
            }
        }
    }
    assert!(n_files > 0, "the corpus has no files of IEC 61131-3");
}

/// The trace of a net in compiled C.
fn c_trace(net: &Valid<Net>, stimulus: &Stimulus, style: Style) -> Option<String> {
    tools::c_compiler()?;
    let facts = grafsynth_verify::structural_facts(net);
    let package: Package =
        grafsynth_backend_c::emit(net, &facts, &Options { style, ..Options::default() })
            .unwrap_or_else(|why| panic!("{why:?}"));
    let harness = multi_harness(&[(net, &package)]);
    let program = c::compile_text(&harness, &[]).unwrap_or_else(|why| panic!("{why}"));
    let input = c::lines(net, stimulus);
    let run = tools::run(
        &program.path,
        &["0"],
        program.folder.path(),
        input.as_bytes(),
        Duration::from_secs(60),
    )
    .unwrap_or_else(|why| panic!("{why:?}"));
    Some(String::from_utf8_lossy(&run.stdout).into_owned())
}

/// The values of a column.
fn column(trace: &Trace, name: &str) -> Vec<String> {
    let csv = trace.to_csv();
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let at = head.iter().position(|one| *one == name).unwrap_or_else(|| panic!("no {name}"));
    lines.map(|line| line.split(',').nth(at).unwrap_or("").to_owned()).collect()
}

fn rows_with(values: &[String], wanted: &str) -> Vec<usize> {
    values.iter().enumerate().filter(|(_, value)| *value == wanted).map(|(row, _)| row).collect()
}

/// Compares the rows from the reference simulator, from compiled C in both styles, and from every other engine, which must be equal. A chip processes one tick
/// per clock: it gets the stimulus with each row of several ticks split into rows of one tick. `too_large` lists the engines that may reject the net, each with
/// the only permitted code; each rejection is printed. Returns the reference trace.
fn all_engines(net: &Valid<Net>, stimulus: &Stimulus, too_large: &[(&str, &str)]) -> Trace {
    let expected = grafsynth_driver::run::net_trace(net, stimulus);
    for style in [Style::Auto, Style::Bits] {
        match c_trace(net, stimulus, style) {
            Some(got) => assert_eq!(got, expected.to_csv(), "style {}", style.name()),
            None => println!("skipped: a C compiler is not installed"),
        }
    }
    let ticks = Clocked::of(net, stimulus).expect("not too many clocks").stimulus;
    let by_ticks = grafsynth_driver::run::net_trace(net, &ticks);
    let facts = grafsynth_driver::pipeline::facts(net, &grafsynth_verify::Limits::default());
    let mut n_run = 0;
    for engine in grafsynth_engines::all().into_iter().filter(|engine| engine.by_default()) {
        let name = engine.name();
        if let Availability::Missing(tool) = engine.availability() {
            println!("skipped: {name} needs {tool}, which is not installed");
            continue;
        }
        let (stimulus, expected) =
            if engine.pace() == Pace::Clocks { (&ticks, &by_ticks) } else { (stimulus, &expected) };
        match engine.run(&Job { net, facts: &facts, stimulus }) {
            Ok(got) => {
                let difference = compare(expected, &got);
                assert!(difference.is_none(), "{name}: {difference:?}");
                n_run += 1;
            }
            // A device has limited pins, terms and power-up values.
            Err(EngineError::Refused(found))
                if found.iter().all(|one| {
                    too_large.contains(&(name, one.code.id))
                        || name == "jedec" && grafsynth_tests::DEVICE_LIMITS.contains(&one.code.id)
                }) =>
            {
                println!("{name} refuses: {} {}", found[0].code.id, found[0].message);
            }
            Err(why) => panic!("{name}: {why:?}"),
        }
    }
    println!("{n_run} engines give the same trace");
    expected
}

/// GALasm texts are for one device, and both charts have more registers than a GAL22V10.
const DEVICE_TOO_SMALL: [(&str, &str); 1] = [("galasm", "G0711")];

/// Annex F of the standard. The expected values, for scans of 50 ms, follow from the standard's picture of the plant.
#[test]
fn the_gravel_plant_fills_warns_loads_and_runs_out() {
    let net = net_of("gravel.st", include_str!("../../examples/gravel/gravel.st"))
        .unwrap_or_else(|why| panic!("{why}"));
    let csv = include_str!("../../examples/gravel/gravel.csv");
    let (stimulus, found) = Stimulus::parse_csv(&net, grafsynth_ir::FileId(0), csv);
    let stimulus = stimulus.unwrap_or_else(|| panic!("{found:#?}"));
    let trace = all_engines(&net, &stimulus, &DEVICE_TOO_SMALL);
    // The lamp test of row 1 lights the lamps before anything is switched on.
    assert_eq!(column(&trace, "control_lamp")[1], "1");
    assert_eq!(column(&trace, "truck_lamp")[1], "1");
    // Filling starts in row 3; a pulse every 100 ms and the two scans that restart the timer: levels 1, 2, 3 in rows 5, 9, 13.
    let level = column(&trace, "bin_level");
    assert_eq!((rows_with(&level, "1")[0], rows_with(&level, "2")[0]), (5, 9));
    assert_eq!(rows_with(&level, "3")[0], 13);
    // The transition reads the counter's Q in the next scan, and the valve closes with the step.
    assert_eq!(rows_with(&column(&trace, "silo_valve"), "1"), (3..=13).collect::<Vec<_>>());
    // The silo runs empty in row 7; the siren sounds until it is acknowledged in row 13.
    assert_eq!(rows_with(&column(&trace, "siren"), "1"), (7..=12).collect::<Vec<_>>());
    // Loading starts once the truck is on the ramp (row 18, read in row 19): 300 ms run-in are 6 scans, then the bin empties for 2, then 400 ms
    // run-out are 8.
    let motor = rows_with(&column(&trace, "conveyor_motor"), "1");
    assert_eq!(motor, (19..=34).collect::<Vec<_>>());
    assert_eq!(rows_with(&column(&trace, "bin_valve"), "1"), vec![25, 26]);
    // An empty bin resets the level.
    assert_eq!(level[27], "0");
    // The plant is switched off in the last row.
    assert_eq!(column(&trace, "control_lamp").last().map(String::as_str), Some("0"));
}

/// The Beremiz traffic light: its function block only, because the program around it belongs to a screen.
#[test]
fn the_traffic_light_of_others_goes_through_its_phases() {
    let Some(corpus) = corpus() else { return };
    let Ok(text) = std::fs::read_to_string(corpus.join("plcopen/beremiz_traffic_light.xml")) else {
        println!("skipped: no traffic light in the corpus");
        return;
    };
    let net = net_of("light.xml", &text).unwrap_or_else(|why| panic!("{why}"));
    // One row is a second (ten scans of 100 ms), switched on in row 4; a pedestrian requests in row 28.
    let rows: Vec<String> = (1..=45)
        .map(|row| format!("{},{},10", u8::from((4..44).contains(&row)), u8::from(row == 28)))
        .collect();
    let csv = format!("SWITCH_BUTTON,PEDESTRIAN_BUTTON,dt\n{}\n", rows.join("\n"));
    let (stimulus, found) = Stimulus::parse_csv(&net, grafsynth_ir::FileId(0), &csv);
    let stimulus = stimulus.unwrap_or_else(|| panic!("{found:#?}"));
    let trace = all_engines(&net, &stimulus, &DEVICE_TOO_SMALL);
    let steps = column(&trace, "steps");
    let lit = |name: &str, row: usize| column(&trace, name)[row] == "1";
    // While it is off, orange blinks and nothing else is on. Each change takes 500 ms, so it is visible within two rows of a
    // second.
    assert_eq!(steps[..4], ["Standstill"; 4]);
    assert!(lit("ORANGE_LIGHT", 0) && (1..4).any(|row| !lit("ORANGE_LIGHT", row)));
    // After it is switched on: orange, with red for pedestrians. The D action of 2 s is true two rows later and read in the row
    // after that.
    assert_eq!(steps[4..7], ["ORANGE"; 3]);
    assert!(lit("ORANGE_LIGHT", 5) && lit("PEDESTRIAN_RED_LIGHT", 5) && !lit("RED_LIGHT", 5));
    assert_eq!(steps[7..10], ["RED"; 3]);
    assert!(lit("RED_LIGHT", 7) && !lit("ORANGE_LIGHT", 7));
    // Pedestrians have green for 10 s; cars get green 2 s later.
    assert_eq!(steps[10..21], ["PEDESTRIAN_GREEN"; 11]);
    assert!(lit("PEDESTRIAN_GREEN_LIGHT", 10) && !lit("PEDESTRIAN_RED_LIGHT", 10));
    assert_eq!(steps[21..24], ["PEDESTRIAN_RED"; 3]);
    assert_eq!(steps[24], "GREEN");
    assert!(lit("GREEN_LIGHT", 24) && !lit("RED_LIGHT", 24) && lit("PEDESTRIAN_RED_LIGHT", 24));
    // The button of row 28 is latched. The timer is done 2 s later, and GREEN is left in the row after that, long before its 20 s
    // have passed.
    assert_eq!(steps[30], "GREEN");
    assert_eq!(steps[31], "ORANGE");
    // In the last row it is switched off again.
    assert_eq!(steps[44], "Standstill");
    // Cars and pedestrians never have green at once.
    assert!(
        (0..steps.len())
            .all(|row| !(lit("GREEN_LIGHT", row) && lit("PEDESTRIAN_GREEN_LIGHT", row)))
    );
}

/// Projects are valid according to the schema, if the schema and a validator are available.
#[test]
fn projects_are_valid_against_the_schema() {
    let Some(corpus) = corpus() else { return };
    let schema = corpus.join("plcopen/tc6_xml_v201.xsd");
    let is_here = Command::new("xmllint").arg("--version").output().is_ok();
    if !schema.is_file() || !is_here {
        println!("skipped: xmllint or the schema is not here");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let cases = [
        ("a.graf", include_str!("../../examples/truck/truck.graf")),
        ("a.graf", include_str!("../../examples/conflict/fig7.graf")),
        ("a.st", include_str!("../cases/st/qualifiers.st")),
        ("a.graf", include_str!("../cases/sfc/e_reset_delayed.graf")),
        ("a.graf", include_str!("../cases/plcopen/drawn.graf")),
    ];
    for (name, text) in cases {
        let net = net_of(name, text).unwrap_or_else(|why| panic!("{why}"));
        let (project, _) =
            grafsynth_frontend::plcopen::write_net(&net).unwrap_or_else(|why| panic!("{why:#?}"));
        let path = folder.path().join("a.xml");
        std::fs::write(&path, &project).expect("it can be written");
        let checked = Command::new("xmllint")
            .arg("--noout")
            .arg("--schema")
            .args([&schema, &path])
            .output()
            .expect("xmllint runs");
        assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    }
}
