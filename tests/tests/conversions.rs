//! Charts written in every chart language, read back, and from there written in a third one: a written chart behaves like the original, or is rejected.

#![allow(clippy::print_stdout, reason = "tests say how much they did")]

use grafsynth_tests::conversions::{Came, FORMS, design_of, there_and_back};
use grafsynth_tests::random_chart::{random_chart, shrunk};
use grafsynth_tests::{in_parallel, rounds};
use std::collections::BTreeMap;

/// The result of writing a chart in this language and reading it back, with or without its drawing.
fn came(text: &str, form: &str, seed: u64) -> Came {
    let mut design = design_of("a.graf", text).unwrap_or_else(|why| panic!("{why}\n{text}"));
    if seed / 6 % 2 == 1 {
        design.chart = None;
    }
    there_and_back(&design, form, seed)
}

#[test]
fn random_charts_behave_alike_in_every_language() {
    let seeds: Vec<u64> = (0..rounds(240, 20_000)).collect();
    let all = in_parallel(&seeds, |seed| {
        let text = random_chart(*seed)?;
        let all = FORMS.map(|form| (form, came(&text, form, *seed)));
        for (form, one) in &all {
            if let Came::Otherwise(_) = one {
                let differs = |text: &str| matches!(came(text, form, *seed), Came::Otherwise(_));
                let small = shrunk(&text, differs);
                let Came::Otherwise(why) = came(&small, form, *seed) else { continue };
                panic!("seed {seed} in {form}\n{small}\n{why}");
            }
        }
        Some(all)
    });
    let mut n_of: BTreeMap<(&str, &str), u64> = BTreeMap::new();
    for (form, one) in all.into_iter().flatten().flatten() {
        let what = match one {
            Came::Refused(_) => "refused",
            Came::Alike(0) => "alike",
            Came::Alike(_) => "alike, losses listed",
            Came::Said => "otherwise, as listed",
            Came::Otherwise(_) => "otherwise",
        };
        *n_of.entry((form, what)).or_default() += 1;
    }
    println!("{n_of:?}");
    for form in FORMS {
        let alike = |what| n_of.get(&(form, what)).copied().unwrap_or(0);
        let n_alike = alike("alike") + alike("alike, losses listed");
        assert!(n_alike >= 6, "only {n_alike} charts in {form}");
    }
}

/// The smallest charts that were once written incorrectly.
#[test]
fn what_was_once_written_wrongly_behaves_alike_or_is_refused() {
    let charts: [(&str, &str, &[&str], bool); 13] = [
        (
            "several durations of one action",
            "chart c { output Q initial step s { Q D 40 ms; Q D 20 ms; Q P0 } }",
            &["rules", "st", "plcopen", "net"],
            true,
        ),
        (
            "several durations of an action without an output",
            "chart c { output Q action M initial step s { M L 40 ms; M D 20 ms; M D 30 ms; Q N if M } }",
            &["rules", "net"],
            true,
        ),
        (
            "an action before the output that uses it",
            "chart c { output P action M output Q initial step s { M D 20 ms; Q N if M; Q P0; P } }",
            &["rules", "net"],
            true,
        ),
        (
            "an exit list and a restart",
            "chart c { conflict priority actions iec input a var v: int 0..9 initial step s { exit { v := v + 1 } } s -> s when a restart }",
            &["st", "plcopen"],
            false,
        ),
        (
            "an entry list and a restart by another transition",
            "chart c { conflict priority input a var v: int 0..9 initial step s { entry { v := v + 1 } } initial step r s -> r when a r -> s when a restart }",
            &["st", "plcopen"],
            false,
        ),
        (
            "an exit list that reads a controlled output",
            "chart c { conflict priority actions iec input a output R var w initial step s { R; exit { w := R } } step r { R R } s -> r when a r -> s when not a }",
            &["st", "plcopen"],
            false,
        ),
        (
            "an entry list that reads an action",
            "chart c { conflict priority input a action M var w initial step s { M D 10 ms } step r { M P; entry { w := M } } s -> r when a r -> s when not a }",
            &["st", "plcopen"],
            false,
        ),
        (
            "a transition with a list before a step with a reaction",
            "chart c { event e var v t1: s -> r do { v := false } initial step s { on e { v := true } } step r }",
            &["rules"],
            false,
        ),
        (
            "an input with the name of a timer keyword",
            "chart c { input while timer T while while and while or not s.active initial step s step r s -> r when T >= 20 ms }",
            &["rules"],
            true,
        ),
        (
            "variables at addresses of pins",
            "chart c { conflict priority input a var v: int 0..9 = 3 \"%IX0.1\" var w \"%QX0.1\" initial step s step r s -> r when a and v > 2 and not w }",
            &["st", "plcopen"],
            true,
        ),
        (
            "a transition with a keyword as its name",
            "chart c { conflict priority input a initial step s step `to` `from`: s -> `to` when a t: `to` -> s when not a }",
            &["st", "plcopen"],
            true,
        ),
        (
            "transitions with the names that a list and the timers get",
            "chart c { conflict priority input a var v: int 0..9 timer T while a initial step s { exit { v := v + 1 } } step r timers: s -> r when T >= 20 ms s_exit: r -> s when not a }",
            &["st", "plcopen"],
            true,
        ),
        (
            "a cancel of an event that is never sent",
            "chart c { conflict inner-first event e queue 1 state s1 { state s2 { exit { cancel x } step s3 } } t: in s1 on s2.done do { send e as x } }",
            &["scxml"],
            true,
        ),
    ];
    for (what, text, forms, is_written) in charts {
        for form in forms {
            for seed in 0..12 {
                match came(text, form, seed) {
                    Came::Otherwise(why) => panic!("{what}, in {form}: {why}"),
                    Came::Said => panic!("{what}, in {form}: otherwise, as listed"),
                    Came::Alike(_) => assert!(is_written, "{what}, in {form}"),
                    Came::Refused(why) => assert!(!is_written, "{what}, in {form}: {why}"),
                }
            }
        }
    }
}
