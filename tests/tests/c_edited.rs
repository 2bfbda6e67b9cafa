//! C as a file beside a map: the map says what the back end says, and executing the tree of emitted C shows no difference from the chart, but damaged C does.

use grafsynth_backend_c::{Options, Style, emit};
use grafsynth_driver::edited_c::{CMap, CText, EditedC, edited};
use grafsynth_driver::report::{Outcome, OutputReport};
use grafsynth_engines::exhaustive::{Text, check_text};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, readable, rounds, small_limits};
use grafsynth_verify::{Limits, OpenReason, facts};

/// The files of emitted C as texts, and its map; `None` if the style does not support the net or does not say how it holds the state.
fn written(net: &Valid<Net>, facts: &Facts, options: &Options) -> Option<(Vec<CText>, CMap)> {
    let package = emit(net, facts, options).ok()?;
    let map = CMap::of(net, &package, options)?;
    let main = format!("{}.c", package.stem());
    let (first, rest): (Vec<_>, Vec<_>) = package.files.iter().partition(|it| it.name == main);
    let texts = first.into_iter().chain(rest).zip(0..).map(|(file, at)| CText {
        file: FileId(at),
        name: file.name.clone(),
        text: file.text.clone(),
    });
    Some((texts.collect(), map))
}

/// The result of executing a text without a proof.
fn executed(net: &Valid<Net>, facts: &Facts, edited: &EditedC) -> OutputReport {
    let limits = Limits { pairs: 300, ..small_limits() };
    let hint = edited.package.representation.as_ref().expect("a map was written");
    let place = |_| String::new();
    let functions = grafsynth_verify::c_code::functions_of(&edited.unit);
    let text = Text {
        unit: &edited.unit,
        functions: &functions,
        hint,
        facts,
        limits: &limits,
        place: &place,
    };
    check_text("own.c", net, &edited.package, &text, Err(OpenReason::NotAsked))
}

#[test]
fn random_charts_come_back_from_their_maps() {
    for seed in 0..rounds(4, 2_000) {
        let net = random_net(seed, &Features::plain());
        let facts = facts(&net, &small_limits());
        let style = [Style::Switch, Style::Tables, Style::Bits][seed as usize % 3];
        let options = Options { style, ..Options::default() };
        let Some((texts, map)) = written(&net, &facts, &options) else { continue };
        let read = CMap::parse(&map.to_text()).expect("a map that was just written");
        let package = emit(&net, &facts, &read.options().expect("known options")).expect("C");
        let hint = package.representation.as_ref().expect("a representation");
        assert_eq!(read.state(&net).as_ref(), Ok(&hint.state), "{}", readable(&net));
        let edited = edited(&net, &facts, &texts, &options, Some(&read)).expect("C");
        assert_eq!(edited.same_interface(), Ok(()));
        let line = executed(&net, &facts, &edited);
        assert_ne!(line.outcome(), Outcome::Refuted, "seed {seed}: {line}\n{}", readable(&net));
    }
}

#[test]
fn a_changed_number_is_found_by_executing_the_text() {
    let text = "chart own { tick 100 ms evolution single input a output q var n: int 0..9
        initial step s step t { q if n < 3 } s -> t when a do { n := n + 1 } t -> s after 500 ms }";
    let net = chart("own.graf", text);
    let facts = facts(&net, &small_limits());
    for style in [Style::Switch, Style::Bits] {
        let options = Options { style, ..Options::default() };
        let (mut texts, map) = written(&net, &facts, &options).expect("C");
        let good = texts[0].text.clone();
        assert!(good.contains("5U") || good.contains("< 5"), "{good}");
        texts[0].text = good.replace("5U", "6U").replace("< 5", "< 6");
        let edited = edited(&net, &facts, &texts, &options, Some(&map)).expect("C");
        assert!(edited.prove(&net, &facts, &Limits::default()).is_err());
        let line = executed(&net, &facts, &edited);
        assert_eq!(line.outcome(), Outcome::Refuted, "{line}");
    }
}
