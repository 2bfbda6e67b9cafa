//! Inputs that only outputs of chips read need no pin of the CPU, and the report of a split names every object, wire and connection.

use grafsynth_driver::pipeline::BuildOptions;
use grafsynth_driver::report::document::Block;
use grafsynth_driver::report::{json, markdown};
use grafsynth_driver::split::{
    Linked, Objective, PartDevice, Request, RequestedPart, SoFar, Split, link, report, split,
};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::Valid;
use grafsynth_ir::division::Running;
use grafsynth_ir::net::Net;
use grafsynth_split::link::check;
use grafsynth_tests::chart;
use std::sync::Mutex;

/// A statechart with an encoder of six buttons, which nothing else reads.
const PANEL: &str = "chart panel {
    conflict inner-first
    input power, b1, b2, b3, b4, b5, b6
    output key0, key1, key2, lamp
    initial state off
    state on {
        lamp
        key0 if b1 or b3 or b5
        key1 if b2 or b3 or b6
        key2 if b4 or b5 or b6
    }
    off -> on when power
    on -> off when not power
}";

fn request<'a>(
    parts: &'a [RequestedPart],
    objective: Objective,
    (stem, options): (&'a FileStem, &'a BuildOptions),
) -> Request<'a> {
    Request {
        parts,
        places: &[],
        running: Running::Lockstep,
        reset: true,
        objective,
        fits: 4,
        stem,
        options,
        compile: None,
        told: |_| (),
    }
}

fn parts() -> [RequestedPart; 2] {
    let part = |name: &str, device: &str| RequestedPart {
        name: name.to_owned(),
        device: PartDevice::named(device).expect("the device is known"),
    };
    [part("chip", "gal22v10"), part("cpu", "atmega328p")]
}

fn made(net: &Valid<Net>, request: &Request<'_>) -> (Split, Linked) {
    let split = split(net, request).expect("it fits");
    let linked = link(net, &split, request.parts, request.stem).expect("it is wired");
    (split, linked)
}

#[test]
fn buttons_of_an_encoder_on_a_chip_need_no_pins_of_the_cpu() {
    let net = chart("panel.graf", PANEL);
    let (parts, stem, options) = (parts(), FileStem::of_name("panel"), BuildOptions::default());
    let (split, linked) = made(&net, &request(&parts, Objective::Pins, (&stem, &options)));
    // The encoder and the lamp are on the chip. The CPU has `power` and one wire, `active_on`.
    assert_eq!((split.value, split.bound), (2, 2));
    let mut direct: Vec<&str> = linked.link.direct.iter().map(|one| one.name.as_str()).collect();
    direct.sort_unstable();
    assert_eq!(direct, ["b1", "b2", "b3", "b4", "b5", "b6"]);
    let members: Vec<&str> = linked.calls.members.iter().map(|(_, name)| name.as_str()).collect();
    assert_eq!(members, ["power"]);
    assert_eq!(check(&linked.link, &net, &split.division, &linked.chips), Ok(()));
}

#[test]
fn a_report_names_every_object_wire_and_connection() {
    let net = chart("panel.graf", PANEL);
    let (parts, stem, options) = (parts(), FileStem::of_name("panel"), BuildOptions::default());
    let request = request(&parts, Objective::Cycles, (&stem, &options));
    let (split, linked) = made(&net, &request);
    let summary = [split.said(Objective::Cycles)];
    let document =
        report(&net, (&split, &linked), &request, &summary, ("proved", &["proved".to_owned()]));
    let ids: Vec<&str> = document.sections.iter().map(|section| section.id).collect();
    assert_eq!(ids, ["split", "proofs", "partition", "wires", "wiring", "costs"]);
    let rows = |id: &str| -> usize {
        let section = document.sections.iter().find(|section| section.id == id);
        let blocks = section.expect("it is there").blocks.iter();
        blocks.map(|block| if let Block::Table(table) = block { table.rows.len() } else { 0 }).sum()
    };
    assert_eq!(rows("partition"), split.groups.groups.len());
    assert_eq!(rows("wires"), split.division.wires.len());
    assert_eq!(rows("wiring"), linked.wiring.len());
    assert_eq!(rows("costs"), 3);
    let text = markdown(&document);
    for name in ["off", "on", "key0", "key1", "key2", "lamp", "active_on", "it is in a statechart"]
    {
        assert!(text.contains(name), "{name}");
    }
    assert!(json(&document).contains("\"partition\""));
}

#[test]
fn a_search_tells_the_best_partition_so_far_and_its_gap() {
    static TOLD: Mutex<Vec<SoFar>> = Mutex::new(Vec::new());
    let net = chart("panel.graf", PANEL);
    let (parts, stem, options) = (parts(), FileStem::of_name("panel"), BuildOptions::default());
    let told = |so_far| TOLD.lock().expect("no test has failed").push(so_far);
    let request = Request { told, ..request(&parts, Objective::Cells, (&stem, &options)) };
    let split = split(&net, &request).expect("it fits");
    let told = TOLD.lock().expect("no test has failed").clone();
    let (first, last) = (told.first().expect("it tells"), told.last().expect("it tells"));
    assert_eq!(first.to_string(), "none fits so far; 1 partition built");
    assert_eq!((last.value, last.builds), (Some(split.value), split.builds));
    for pair in told.windows(2) {
        assert!(pair[0].value.is_none_or(|value| pair[1].value.is_some_and(|new| new <= value)));
        assert!(pair[0].bound <= pair[1].bound && pair[0].builds <= pair[1].builds);
    }
    // A bound above the best value means that no better partition is left.
    assert!(last.bound.is_none_or(|bound| bound.min(split.value) == split.bound), "{last:?}");
    assert!(told.iter().any(|it| it.to_string().starts_with("best so far: ")), "{told:?}");
}
