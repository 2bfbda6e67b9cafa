//! Passes from a net to a simpler net: the rows stay the same, and charts whose rows a pass would change are left alone.

use grafsynth_driver::run::net_trace;
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Driver, Net};
use grafsynth_ir::rewrite::simpler;
use grafsynth_sim::{Stimulus, compare};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, in_parallel, readable, rounds};

/// True if output `q` is an action before the passes and continuous after them; also compares the rows.
fn becomes_continuous(text: &str) -> bool {
    let net = chart("q.graf", text);
    let driver = |net: &Valid<Net>| {
        let q = net.outputs.values().find(|output| output.name.text == "q");
        q.map(|output| output.driver.clone())
    };
    assert!(matches!(driver(&net), Some(Driver::Controlled(_))), "{text}");
    let Some(changed) = simpler(&net) else { return false };
    assert_eq!(rows_differ(&net, &changed, 1), None, "{text}");
    matches!(driver(&changed), Some(Driver::Continuous(_)))
}

fn rows_differ(net: &Valid<Net>, changed: &Valid<Net>, seed: u64) -> Option<String> {
    let stimulus = Stimulus::random(net, 200, seed, 4);
    let difference = compare(&net_trace(net, &stimulus), &net_trace(changed, &stimulus));
    difference.map(|difference| format!("{difference:?}"))
}

#[test]
fn an_output_that_only_n_drives_becomes_continuous_unless_something_tells_the_difference() {
    let with = |declarations: &str, s: &str, r: &str, guard: &str| {
        format!(
            "chart c {{ evolution single\nactions iec\ninput x, y\noutput q\n{declarations}\n\
             initial step s {{ {s} }}\nstep r {{ {r} }}\ns -> r when {guard}\nr -> s when y }}"
        )
    };
    assert!(becomes_continuous(&with("", "q", "", "x")));
    assert!(becomes_continuous(&with("", "q if x", "q if not y", "x")));
    // A variable that only transitions write has its final value when the actions run.
    assert!(becomes_continuous(&with("var v: bool", "q if v; exit { v := not v }", "", "x")));
    // A different qualifier.
    assert!(!becomes_continuous(&with("", "set q", "q", "x")));
    assert!(!becomes_continuous(&with("", "q pulse", "", "x")));
    assert!(!becomes_continuous(&with("", "q after 20 ms", "", "x")));
    // The receptivity reads the value of the last row.
    assert!(!becomes_continuous(&with("", "q", "", "x or q")));
    // A body writes what the condition reads, after Q was computed.
    let body = "var v: bool\naction flip { v := not v }";
    assert!(!becomes_continuous(&with(body, "q if v; flip", "", "x")));
    // A free timer advances after the actions.
    assert!(!becomes_continuous(&with("timer t while x", "q if t >= 20 ms", "", "x")));
}

#[test]
fn random_nets_have_the_same_rows_after_the_passes() {
    let wanted = rounds(300, 20_000);
    let seeds: Vec<u64> = (0..wanted).collect();
    let changed = in_parallel(&seeds, |seed| {
        let features = Features { step_actions: true, ..Features::program().without_statecharts() };
        let net = random_net(*seed, &features);
        let Some(changed) = simpler(&net) else { return false };
        if let Some(difference) = rows_differ(&net, &changed, *seed) {
            panic!("seed {seed}: {difference}\n{}", readable(&net));
        }
        true
    });
    let n_changed = changed.iter().filter(|it| **it).count();
    assert!(
        n_changed * 4 > changed.len(),
        "only {n_changed} nets of {} are changed",
        changed.len()
    );
}
