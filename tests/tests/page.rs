//! Pages: their JavaScript compared with the simulator on random charts, and what a page contains.
//!
//! `PAGE_SEED=77 cargo test -p grafsynth-tests page::` runs one net and reports the difference.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "the environment defines how many nets are run")]

use crate::plants;
use grafsynth_draw::{Options, layout};
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::run::net_trace;
use grafsynth_driver::source::Sources;
use grafsynth_engines::scratch::Scratch;
use grafsynth_engines::{Availability, Engine as _, Job, JsEngine, js_traces, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, Policy};
use grafsynth_page::{Contents, Cut, Reference, SourceText, cut, page, reference};
use grafsynth_sim::{Stimulus, with_plant};
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_tests::{chart, readable, rounds};
use grafsynth_verify::structural_facts;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

/// The number of rows of one stimulus.
const ROWS: usize = 60;
/// The number of nets that node runs in one start.
const BATCH: usize = 25;
const LIMIT: Duration = Duration::from_secs(120);

pub(crate) fn node_is_here() -> bool {
    let is_here = JsEngine.availability() == Availability::Here;
    if !is_here {
        assert!(std::env::var_os("CI").is_none(), "node is missing, and CI must have it");
        println!("skipped: node is not installed");
    }
    is_here
}

/// The first row in which the trace of the page is not the simulator's, byte for byte; `None` if there is none. Rows from the first open cell on are not
/// compared.
fn difference(net: &Valid<Net>, stimulus: &Stimulus, page: &str) -> Option<String> {
    let expected = net_trace(net, stimulus);
    let determined = expected.rows.iter().take_while(|row| row.open.is_empty()).count();
    let expected = expected.to_csv();
    let rows = expected.lines().zip(page.lines().chain(std::iter::repeat("(missing)")));
    rows.take(determined + 1)
        .find(|(expected, found)| expected != found)
        .map(|(expected, found)| format!("expected {expected}\n   found {found}"))
}

fn stimulus(net: &Valid<Net>, seed: u64) -> Stimulus {
    Stimulus::random(net, ROWS, seed, if seed.is_multiple_of(3) { 5 } else { 1 })
}

fn differs(net: &Valid<Net>, seed: u64) -> Option<String> {
    let (stimulus, facts) = (stimulus(net, seed), structural_facts(net));
    let traces = js_traces(&[Job { net, facts: &facts, stimulus: &stimulus }]);
    match traces {
        Ok(traces) => difference(net, &stimulus, traces.first().map_or("", String::as_str)),
        Err(why) => Some(format!("{why:?}")),
    }
}

fn check(policies: Vec<Policy>, quick: u64, deep: u64) {
    if !node_is_here() {
        return;
    }
    let features = Features { policies, ..Features::everything() };
    let seeds: Vec<u64> = match std::env::var("PAGE_SEED").ok().and_then(|seed| seed.parse().ok()) {
        Some(seed) => vec![seed],
        None => (0..rounds(quick, deep)).collect(),
    };
    for batch in seeds.chunks(BATCH) {
        let nets: Vec<_> = batch.iter().map(|seed| random_net(*seed, &features)).collect();
        let stimuli: Vec<_> =
            nets.iter().zip(batch).map(|(net, seed)| stimulus(net, *seed)).collect();
        let facts: Vec<_> = nets.iter().map(structural_facts).collect();
        let jobs = nets.iter().zip(&stimuli).zip(&facts);
        let jobs: Vec<Job<'_>> =
            jobs.map(|((net, stimulus), facts)| Job { net, facts, stimulus }).collect();
        let traces = js_traces(&jobs).expect("node runs the pages");
        for ((net, seed), (stimulus, trace)) in
            nets.iter().zip(batch).zip(stimuli.iter().zip(&traces))
        {
            if difference(net, stimulus, trace).is_none() {
                continue;
            }
            let small = shrink(net, |net| differs(net, *seed).is_some());
            let found = differs(&small, *seed).unwrap_or_default();
            panic!("seed {seed}: {found}\n{}", readable(&small));
        }
    }
}

#[test]
fn grafcet_pages_run_like_the_simulator() {
    check(vec![Policy::All, Policy::Priority, Policy::PriorityAge], 60, 3_000);
}

#[test]
fn statechart_pages_run_like_the_simulator() {
    check(vec![Policy::InnerFirst, Policy::OuterFirst], 60, 3_000);
}

/// Runs a script after the engine of a page, in a folder that contains its data as `data.json` and a stimulus as `stimulus.csv`; returns what it prints.
pub(crate) fn run(page: &str, stimulus: &str, script: &str) -> String {
    let folder = Scratch::new().expect("a folder");
    let engine = cut(page, Cut::Engine).expect("an engine");
    let write =
        |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");
    write("run.js", &format!("{engine}\n{script}"));
    write("data.json", cut(page, Cut::Data).expect("data"));
    write("stimulus.csv", stimulus);
    let node = tools::find(&["node", "nodejs"]).expect("node");
    let done = tools::run(&node, &["run.js"], folder.path(), b"", LIMIT).expect("it runs");
    assert!(done.is_success, "{}", done.stderr);
    String::from_utf8(done.stdout).expect("text")
}

#[test]
fn a_page_repeats_its_reference_and_notices_a_difference() {
    if !node_is_here() {
        return;
    }
    let script = include_str!("page_scripts/repeat.js");
    let features = Features {
        policies: vec![Policy::All, Policy::PriorityAge, Policy::InnerFirst],
        ..Features::everything()
    };
    for seed in 0..6 {
        let net = random_net(seed, &features);
        let reference = reference(&net, 200);
        let page = page(&net, &reference, &Contents::default()).expect("a page");
        let compared = reference.hashes.iter().flatten().count();
        assert_eq!(
            run(&page, "", script),
            format!("{compared} equal, spoiled: found\n"),
            "seed {seed}"
        );
    }
}

/// Sessions on the panel: the recording gives the same rows, whatever was looked at in between.
#[test]
fn a_recorded_session_replays() {
    if !node_is_here() {
        return;
    }
    let script = include_str!("page_scripts/session.js");
    for (name, text) in [
        ("truck.graf", include_str!("../../examples/truck/truck.graf")),
        ("oven.graf", include_str!("../../examples/microwave/oven.graf")),
        ("supervisor.scxml", include_str!("../../examples/supervisor/supervisor.scxml")),
    ] {
        let net = chart(name, text);
        let stimulus = Stimulus::random(&net, 300, 5, 3);
        let page = page(&net, &Reference::default(), &Contents::default()).expect("a page");
        let expected = stimulus.to_csv(&net) + &net_trace(&net, &stimulus).to_csv();
        assert_eq!(run(&page, &stimulus.to_csv(&net), script), expected, "{name}");
    }
}

/// A chart whose texts try to leave their places.
const HOSTILE: &str = r#"chart h {
    evolution stable
    input a "</script><script>document.title='bad'</script>", b "{{name}} {{drawing}} \u{202E}evil <!-- <img src=x onerror=alert(1)> 😀"
    extern action ring(int 0..9)
    output Z "& &lt; ' \" 😀 lamp"
    initial step s "]]></svg><script>document.title='bad'</script>" { Z }
    step r "مرحبا" { entry { ring(3) }; code c "system()" }
    s -> r when rise(a)
    r -> s when b and r.t >= 20 ms
}
"#;

/// A plant whose texts try the same.
const HOSTILE_PLANT: &str = r#"view 99, 9
quantity q "<b onclick=alert(1)>&amp; 😀": 0..9
text 1, 5, "</text></svg><script>document.title='bad'</script>"
"#;

const TRUCK_PLANT: &str = include_str!("../../examples/truck/truck.plant");

/// A chart with a step that is active only within a reaction.
const STABLE: &str = "chart stable {
    evolution stable
    input x
    initial step start
    step mid
    step end
    start -> mid when x
    mid -> end when true
    end -> start when not x
}
";

fn hostile() -> String {
    HOSTILE.replace("\\u{202E}", "\u{202E}")
}

/// The page of a chart with its drawing.
fn drawn(name: &str, text: &str) -> String {
    drawn_with(name, text, None)
}

/// The page of a chart with its drawing and with a plant.
fn drawn_with(name: &str, text: &str, plant_text: Option<&str>) -> String {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    let (design, found) =
        read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
    let Some(Design::Net(design)) = design else { panic!("{name}: {found:#?}") };
    let picture = design.chart.as_ref().and_then(|chart| layout(chart, &Options::default()).ok());
    assert!(picture.is_some(), "{name} is drawn");
    let plant = plant_text.map(|text| plants::read(&design.net, text));
    let sources = [SourceText { file: main, name, text }];
    let contents = Contents {
        picture: picture.as_ref(),
        sources: &sources,
        plant: plant.as_ref(),
        ..Contents::default()
    };
    page(&design.net, &reference(&design.net, 1000), &contents).expect("a page")
}

#[test]
fn a_page_is_small_and_runs_only_its_own_scripts() {
    let truck = drawn("truck.graf", include_str!("../../examples/truck/truck.graf"));
    assert!(!truck.contains("Grafsynth.Plant ="), "only a page with a plant contains its script");
    let plant = drawn_with(
        "truck.graf",
        include_str!("../../examples/truck/truck.graf"),
        Some(TRUCK_PLANT),
    );
    assert!(plant.len() <= 120 * 1024, "{} bytes", plant.len());
    let hostile = drawn_with("hostile.graf", &hostile(), Some(HOSTILE_PLANT));
    for page in [&truck, &plant, &hostile] {
        assert_eq!(page.matches("<script").count(), 3, "data, engine and page");
        assert_eq!(page.matches("</script").count(), 3);
        assert_eq!(page.matches("<svg xmlns").count(), 1);
        assert!(page.contains("content=\"default-src 'none'; script-src 'sha256-"));
        for forbidden in
            ["<img", "onerror=\"", "http://", "https://", "eval(", "innerHTML", "\u{202E}"]
        {
            let allowed = page.matches("http://www.w3.org/2000/svg").count();
            let count =
                page.matches(forbidden).count() - if forbidden == "http://" { allowed } else { 0 };
            assert_eq!(count, 0, "{forbidden}");
        }
    }
}

#[test]
fn a_page_of_a_thousand_steps_is_small() {
    let mut text = String::from("chart ring {\n    evolution single\n    input a, b\n");
    for step in 0..1000 {
        let initial = if step == 0 { "initial " } else { "" };
        text += &format!("    {initial}step s{step}\n");
    }
    for step in 0..1000 {
        text += &format!("    s{step} -> s{} when a and b\n", (step + 1) % 1000);
    }
    let page = drawn("ring.graf", &(text + "}\n"));
    assert!(page.len() <= 2 * 1024 * 1024, "{} bytes", page.len());
    assert!(page.contains("<div id=\"drawing\" class=\"large\""), "only a part is displayed");
}

/// Chromium and node; `None` if one of them is missing.
pub(crate) fn browser() -> Option<(PathBuf, PathBuf)> {
    let chromium = tools::find(&["chromium", "chromium-browser", "google-chrome"]);
    if chromium.is_none() {
        assert!(std::env::var_os("CI").is_none(), "chromium is missing, and CI must have it");
        println!("skipped: chromium is not installed");
    }
    let is_node_here = node_is_here();
    chromium.zip(tools::find(&["node", "nodejs"]).filter(|_| is_node_here))
}

/// In a browser: pages start without a problem and without a request, repeat their reference, obey the keyboard, and record what the simulator repeats;
/// breakpoints, forced inputs, links, the source, the languages, and the roles and names that assistive technology finds.
#[test]
fn pages_work_in_a_browser() {
    let Some((chromium, node)) = browser() else { return };
    let folder = Scratch::new().expect("a folder");
    let write =
        |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");
    let truck = include_str!("../../examples/truck/truck.graf");
    write("truck.html", &drawn("truck.graf", truck));
    write("plant.html", &drawn_with("truck.graf", truck, Some(TRUCK_PLANT)));
    write("hostile.html", &drawn_with("hostile.graf", &hostile(), Some(HOSTILE_PLANT)));
    let supervisor = include_str!("../../examples/supervisor/supervisor.scxml");
    write("queue.html", &drawn("supervisor.scxml", supervisor));
    write("stable.html", &drawn("stable.graf", STABLE));
    write("chromium.js", include_str!("page_scripts/chromium.js"));
    write("browser.js", include_str!("page_scripts/browser.js"));
    let arguments = ["browser.js", &chromium.display().to_string()];
    let done = tools::run(&node, &arguments, folder.path(), b"", LIMIT).expect("it runs");
    assert!(done.is_success, "{}", done.stderr);
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    let text =
        |scenario: &str, name: &str| found[scenario][name].as_str().unwrap_or_default().to_owned();
    assert_eq!(text("truck", "reference"), "equal to the reference in 1000 reactions");
    let roles = found["reading"]["roles"].as_str().unwrap_or_default();
    assert_eq!(roles, include_str!("page_scripts/truck.roles.txt"), "found:\n{roles}");
    let net = chart("truck.graf", truck);
    for (scenario, least) in [("truck", 10), ("plant", 1000)] {
        let stimulus = plants::operation(&net, &text(scenario, "stimulus"));
        assert!(stimulus.len() >= least, "{scenario}: {} rows", stimulus.len());
        assert_eq!(text(scenario, "trace"), net_trace(&net, &stimulus).to_csv(), "{scenario}");
    }
    // What the plant of the page set is what that of the simulator sets if the same button is pressed.
    let recording = text("plant", "stimulus");
    let pressed: String = recording.lines().fold(String::new(), |text, line| {
        let cells: Vec<&str> = line.split(',').collect();
        text + cells[0] + "," + cells[1] + "\n"
    });
    assert!(pressed.starts_with("dt,m\n1,1\n"), "{pressed}");
    let plant = plants::read(&net, TRUCK_PLANT);
    let driven = with_plant(&net, &plant, &plants::operation(&net, &pressed)).expect("few ticks");
    assert_eq!(driven.to_csv(&net), recording);
}
