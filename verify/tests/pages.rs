//! The example on each page of findings gives that finding, and correct charts give none.

use grafsynth_frontend::graf;
use grafsynth_ir::lower::lower;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_verify::{Limits, Outcome, facts, findings, properties};

const PAGES: &[(&str, &str)] = &[
    ("G0801", include_str!("../../docs/codes/G0801.md")),
    ("G0802", include_str!("../../docs/codes/G0802.md")),
    ("G0803", include_str!("../../docs/codes/G0803.md")),
    ("G0804", include_str!("../../docs/codes/G0804.md")),
    ("G0805", include_str!("../../docs/codes/G0805.md")),
    ("G0806", include_str!("../../docs/codes/G0806.md")),
    ("G0807", include_str!("../../docs/codes/G0807.md")),
    ("G0808", include_str!("../../docs/codes/G0808.md")),
    ("G0809", include_str!("../../docs/codes/G0809.md")),
    ("G0810", include_str!("../../docs/codes/G0810.md")),
    ("G0811", include_str!("../../docs/codes/G0811.md")),
    ("G0812", include_str!("../../docs/codes/G0812.md")),
    ("G0813", include_str!("../../docs/codes/G0813.md")),
];

fn net(text: &str) -> Valid<Net> {
    let parsed = graf::parse(FileId(0), text);
    assert!(parsed.diagnostics.iter().all(|one| !one.is_error()), "{:#?}", parsed.diagnostics);
    let (net, findings) = lower(&parsed.design.expect("a design"));
    net.unwrap_or_else(|| panic!("{findings:#?}"))
}

fn codes(text: &str) -> Vec<&'static str> {
    let net = net(text);
    let found = findings(&net, &facts(&net, &Limits::default()), &Limits::default());
    found.found.iter().map(|one| one.code.id).collect()
}

/// Like `codes`, including notes that are shown on request.
fn all_codes(text: &str) -> Vec<&'static str> {
    let net = net(text);
    let found = findings(&net, &facts(&net, &Limits::default()), &Limits::default());
    found.found.iter().chain(&found.notes).map(|one| one.code.id).collect()
}

#[test]
fn each_page_shows_its_finding() {
    assert_eq!(PAGES.len(), grafsynth_verify::codes::ALL.len());
    for ((id, page), code) in PAGES.iter().zip(grafsynth_verify::codes::ALL) {
        assert_eq!(*id, code.id);
        assert!(page.starts_with(&format!("# {id}: {}\n", code.title)), "{id}");
        let example = page
            .split("```")
            .nth(1)
            .and_then(|fence| fence.strip_prefix("graf")?.split_once('\n'))
            .map(|(_, example)| example)
            .expect("an example");
        let is_note = *id == grafsynth_verify::codes::DECIDED_CONFLICT.id;
        let found = if is_note { all_codes(example) } else { codes(example) };
        assert!(found.contains(id), "{id}: found {found:?}");
        // A transition that leads to a step which is never active never fires.
        let follows = |one: &str| *id == "G0801" && one == "G0802";
        assert!(found.iter().all(|one| one == id || follows(one)), "{id}: found {found:?}");
    }
}

#[test]
fn the_arbiter_starves_nobody_by_age_and_the_fixed_one_does() {
    assert!(codes(include_str!("../../examples/arbiter/arbiter.graf")).is_empty());
    assert_eq!(codes(include_str!("../../examples/arbiter/arbiter_fixed.graf")), ["G0808"]);
}

#[test]
fn the_examples_are_quiet_and_keep_their_promises() {
    for (name, text) in [
        ("truck", include_str!("../../examples/truck/truck.graf")),
        ("crossing", include_str!("../../examples/crossing/crossing.graf")),
        ("filler", include_str!("../../examples/bottle-filler/filler.graf")),
        ("fig7", include_str!("../../examples/conflict/fig7.graf")),
        ("fig6", include_str!("../../examples/conflict/fig6.graf")),
    ] {
        println!("{name}: {:?}", codes(text));
        let net = net(text);
        for verdict in properties(&net, &Limits::default()) {
            assert!(!matches!(verdict.outcome, Outcome::Refuted { .. }), "{name}: {verdict:?}");
            println!("{name}: {verdict:?}");
        }
    }
    assert_eq!(codes(include_str!("../../examples/conflict/fig5.graf")), ["G0804"]);
    assert!(codes(include_str!("../../examples/conflict/fig7.graf")).is_empty());
}
