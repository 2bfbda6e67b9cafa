//! C files with a map: the map agrees with the back end; executing the tree of emitted C shows no difference from the chart, and executing damaged C shows one.

use grafsynth_backend_c::{Options, Style, emit};
use grafsynth_driver::edited_c::{CMap, CText, EditedC, edited};
use grafsynth_driver::report::{Outcome, OutputReport};
use grafsynth_engines::exhaustive::{Text, check_text};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId, Valid};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, readable, rounds, small_limits};
use grafsynth_verify::{Limits, OpenReason, facts};

/// The files of emitted C as texts, and its map; `None` if the style does not support the net or does not report how it stores the state.
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

/// Everything that a proof needs is in the map, also what only statecharts have: histories, queues, delayed sends.
#[test]
fn the_state_of_random_statecharts_comes_back_from_their_maps() {
    let mut n_maps = 0;
    for seed in 0..rounds(40, 2_000) {
        let net = random_net(seed, &Features::everything().some(seed));
        if !net.settings.policy.is_statechart() {
            continue;
        }
        let facts = facts(&net, &small_limits());
        for style in [Style::Switch, Style::Bits] {
            let options = Options { style, ..Options::default() };
            let Ok(package) = emit(&net, &facts, &options) else { continue };
            let Some(map) = CMap::of(&net, &package, &options) else { continue };
            let hint = package.representation.as_ref().expect("a map was written");
            let read = CMap::parse(&map.to_text()).expect("a map that was just written");
            assert_eq!(read.state(&net).as_ref(), Ok(&hint.state), "{}", readable(&net));
            n_maps += 1;
        }
    }
    assert!(n_maps >= 10, "{n_maps}");
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

/// The C of a small chart with this code before the last statements of `NAME_step`.
fn with_code(code: &str) -> (Valid<Net>, Facts, Result<EditedC, Vec<Diagnostic>>) {
    let net = chart(
        "c.graf",
        "chart c {
            input a
            output q
            initial step s { q }
            step t
            s -> t when a
            t -> s when not a
        }",
    );
    let facts = facts(&net, &small_limits());
    let options = Options { style: Style::Switch, ..Options::default() };
    let (mut texts, map) = written(&net, &facts, &options).expect("C with a map");
    let last = "    self->state = state;";
    assert!(texts[0].text.contains(last), "{}", texts[0].text);
    texts[0].text = texts[0].text.replace(last, &format!("{code}\n{last}"));
    let edited = edited(&net, &facts, &texts, &options, Some(&map));
    (net, facts, edited)
}

/// The answers to code that has no effect: none may end the program, whatever the code's length and nesting.
#[test]
fn long_and_deep_code_has_an_answer() {
    let nested = |open: &str, inner: &str, close: &str, n: usize| {
        format!("{}{inner}{}", open.repeat(n), close.repeat(n))
    };
    let long = |part: &str, n: usize| format!("if (in->a{}) {{ }}", part.repeat(n));
    let text = "nested more than 256 levels";
    let tree = "more than 1000 levels of operators";
    let run = "nested more than 400 levels";
    for (code, why) in [
        (
            format!("if (in->a) {{ }}{}", " else if (in->a == (state == C_t)) { }".repeat(10_000)),
            "",
        ),
        (long(" || in->a == (state == C_t)", 10_000), ""),
        (long(" && in->a != (state == C_t)", 10_000), ""),
        (nested("if (in->a) { ", "", " }", 200), ""),
        (nested("{ ", "", " }", 200), ""),
        (nested("switch (1) { default: ", "", " }", 200), ""),
        (nested("do { ", "", " } while (false);", 200), ""),
        (nested("if (!(", "in->a", ")) { }", 1), ""),
        (format!("if ({}) {{ }}", nested("!(", "in->a", ")", 110)), ""),
        (format!("if ({}) {{ }}", nested("(in->a ? in->a : ", "true", ")", 80)), ""),
        (long(" + 1", 200), ""),
        (long(" + 1", 900), run),
        (nested("if (in->a) { ", &long(" + 1", 300), " }", 200), run),
        (long(" + 1", 10_000), tree),
        (nested("if (in->a) { } else { ", "", " }", 10_000), text),
        (nested("{ ", "", " }", 10_000), text),
        (format!("if ({}) {{ }}", nested("(", "in->a", ")", 10_000)), text),
        (format!("if ({}) {{ }}", nested("!", "in->a", "", 10_000)), text),
        (format!("if ({}) {{ }}", nested("-", "1", "", 10_000)), text),
        (format!("int x = {}; (void)x;", nested("{", "1", "}", 10_000)), text),
        (format!("if (in->a) {}", nested("while (in->a) ", "{ }", "", 10_000)), text),
    ] {
        let (net, facts, edited) = with_code(&code);
        let name = &code[..code.len().min(60)];
        let answer = match edited {
            Ok(edited) => edited.prove(&net, &facts, &Limits::default()).map(|_| ()),
            Err(found) => Err(found.iter().map(|it| it.message.clone()).collect()),
        };
        match answer {
            Ok(()) => assert_eq!(why, "", "{name}"),
            Err(found) => assert!(!why.is_empty() && found.contains(why), "{name}: {found}"),
        }
    }
}

/// The product of two unsigned 64-bit numbers wraps, whatever its size; that of two signed ones is undefined only if it overflows.
#[test]
fn products_of_constants_of_64_bits_are_exact() {
    let most = "UINT64_C(18446744073709551615)";
    for (condition, is_defined) in [
        (format!("{most} * {most} == 1U"), true),
        (format!("{most} * UINT64_C(9223372036854775809) == UINT64_C(9223372036854775807)"), true),
        ("UINT64_C(9223372036854775808) * UINT64_C(9223372036854775808) == 0U".to_owned(), true),
        (
            "INT64_C(3037000499) * INT64_C(3037000499) == INT64_C(9223372030926249001)".to_owned(),
            true,
        ),
        ("INT64_C(3037000500) * INT64_C(3037000500) > 0".to_owned(), false),
        ("INT64_C(9223372036854775807) * (-INT64_C(9223372036854775807)) > 0".to_owned(), false),
    ] {
        for operands in [condition.clone(), format!("{condition} && in->a")] {
            let is_alone = operands == condition;
            let code = format!("if (!({condition})) {{ state = {}; }}", "C_t");
            let code = if is_alone { code } else { format!("{code} if ({operands}) {{ }}") };
            let (net, facts, edited) = with_code(&code);
            let edited = edited.expect("C that can be read");
            let answer = edited.prove(&net, &facts, &Limits::default());
            match answer {
                Ok(_) => assert!(is_defined, "{operands}"),
                Err(why) => assert!(!is_defined && why.contains("overflows"), "{operands}: {why}"),
            }
        }
    }
}
