//! The number of rows that an exploration tries depends on the different answers, not on the number of inputs. Questions that no exploration decides are
//! decided by other methods or stay open.

use grafsynth_frontend::graf;
use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::lower::lower;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_verify::{Check, Explored, Findings, Limits, facts, findings};
use itertools::Itertools as _;

fn net(text: &str) -> Valid<Net> {
    let parsed = graf::parse(FileId(0), text);
    assert!(parsed.diagnostics.iter().all(|one| !one.is_error()), "{:#?}", parsed.diagnostics);
    let (net, findings) = lower(&parsed.design.expect("a design"));
    net.unwrap_or_else(|| panic!("{findings:#?}"))
}

fn names(word: &str, n: usize) -> String {
    (0..n).map(|at| format!("{word}{at}")).join(", ")
}

/// A ring of ten steps; `receptivity` gives that of each transition.
fn ring(settings: &str, receptivity: impl Fn(usize) -> String) -> String {
    let mut text = format!("chart ring {{ {settings}\n initial step s0\n");
    text.extend((1..10).map(|at| format!(" step s{at}\n")));
    text.extend((0..10).map(|at| format!(" s{at} -> s{} {}\n", (at + 1) % 10, receptivity(at))));
    text + "}\n"
}

/// The situations are enumerated with this number of reactions, and not with one fewer.
fn takes(text: &str, pairs: u64) {
    let net = net(text);
    let by = |pairs: u64| {
        let limits = Limits { pairs, image_work: 0, ..Limits::default() };
        facts(&net, &limits).reach.filter(|reach| reach.exact).map(|reach| reach.by)
    };
    assert_eq!((by(pairs), by(pairs - 1)), (Some(Proof::Explicit), None), "{text}");
}

#[test]
fn a_receptivity_has_two_classes() {
    let read = |at: usize| format!("when i{} and (i{} or not i{})", 4 * at, 4 * at + 1, 4 * at + 2);
    takes(&ring(&format!("input {}", names("i", 40)), read), 20);
}

#[test]
fn an_event_of_n_exclusive_ones_has_two_classes() {
    let settings = format!("events exclusive\n event {}", names("e", 30));
    takes(&ring(&settings, |at| format!("on e{}", 3 * at)), 20);
    // Three of the events lead on from a step; in the rows of the fourth class, none of these occurs.
    let three = |at: usize| format!("when e{} or e{} or e{}", at, at + 10, at + 20);
    takes(&ring(&settings, three), 20);
    let fork = format!(
        "chart fork {{ events exclusive\n event {}\n initial step s step x step y step z\n \
         s -> x on e1 s -> y on e2 s -> z on e3 x -> s y -> s z -> s }}",
        names("e", 30)
    );
    takes(&fork, 4 + 3);
}

#[test]
fn an_operand_is_remembered_only_where_its_edge_is_read() {
    // In each of 10 steps, the operand was false: it stays false, or it rises and the next operand is false or true. Or it was true, and is now false or true.
    let settings = format!("input {}", names("i", 10));
    takes(&ring(&settings, |at| format!("when rise(i{at})")), 10 * (3 + 2));
}

#[test]
fn an_event_that_fires_nothing_makes_no_class() {
    let ring = |queue: &str| {
        let states = (1..10).map(|at| format!(" state s{at}\n")).join("");
        let moves = (0..10).map(|at| format!(" s{at} -> s{} on e{at}\n", (at + 1) % 10)).join("");
        let events = names("e", 10);
        format!(
            "chart r {{ conflict inner-first {queue}\n event {events}\n initial state s0\n{states}{moves}}}"
        )
    };
    // From state k the row leads to one of the states after it, or back to s0 and no further.
    takes(&ring(""), (0..10).map(|at| 11 - at).sum());
}

fn few() -> Limits {
    Limits { pairs: 100, ..Limits::default() }
}

fn open(text: &str) -> (Findings, Vec<Check>) {
    let net = net(text);
    let found = findings(&net, &facts(&net, &few()), &few());
    let open = found.checked.iter().filter(|it| it.open.is_some()).map(|it| it.check).collect();
    (found, open)
}

/// Rings of ten steps that share 40 inputs, with a less urgent way back to the first step, and a list in each step.
fn rings(n: usize, variable: impl Fn(usize) -> usize, back: bool) -> String {
    let mut text = format!("chart rings {{ conflict priority\n input {}\n", names("i", 40));
    text.extend((0..n).map(|ring| format!(" var n{ring}: int 0..9\n")));
    for ring in 0..n {
        for step in 0..10 {
            let kind = if step == 0 { "initial step" } else { "step" };
            text += &format!(
                " {kind} s{ring}_{step} {{ entry {{ n{} := {step} }} }}\n",
                variable(ring)
            );
            let (next, input) = ((step + 1) % 10, (ring * 10 + step) % 40);
            text += &format!(" s{ring}_{step} -> s{ring}_{next} when i{input} priority 1\n");
            if back && step > 0 {
                text += &format!(
                    " s{ring}_{step} -> s{ring}_0 when i{} priority 2\n",
                    (input + 1) % 40
                );
            }
        }
    }
    text + "}\n"
}

#[test]
fn other_methods_answer_for_large_charts() {
    assert_eq!(open(&rings(30, |ring| ring, false)).1, []);
    // The way back starves if the way forward always wins; runs show that.
    let (found, open_checks) = open(&rings(30, |ring| ring, true));
    assert_eq!(open_checks, []);
    assert!(found.found.iter().any(|it| it.code.id == "G0808"));
    assert_eq!(found.decided.len(), 30 * 9);
    // Two rings write one variable.
    let (_, open_checks) = open(&rings(30, |ring| ring.min(28), false));
    assert_eq!(open_checks, [Check::Races]);
}

/// A fork has too many situations for a short search; the diagram counts them, and the search ends early with the same answers.
#[test]
fn a_search_ends_when_other_methods_answer_everything() {
    let mut text =
        "chart fork { conflict priority\n input go, i0, i1, i2\n initial step s\n".to_owned();
    for branch in 0..3 {
        text.extend((0..30).map(|step| format!(" step b{branch}_{step}\n")));
        for step in 0..29 {
            let next = step + 1;
            text += &format!(" b{branch}_{step} -> b{branch}_{next} when i{branch}\n");
        }
    }
    text += " s -> b0_0 & b1_0 & b2_0 when go\n b0_29 & b1_29 & b2_29 -> s }";
    let net = net(&text);
    let explored = Explored::of(&net, &Limits::default());
    let soon = explored.facts();
    let all = facts(&net, &Limits::default());
    let reach = |of: &Facts| of.reach.as_ref().map(|it| (it.situations, it.exact, it.by));
    assert_eq!(reach(&soon), Some((27_001, true, Proof::Symbolic)));
    assert_eq!(reach(&all), Some((27_001, true, Proof::Explicit)));
    assert_eq!(soon.unreachable_steps, all.unreachable_steps);
    assert_eq!(soon.dead_transitions, all.dead_transitions);
    let findings = explored.findings(&soon);
    assert!(findings.found.is_empty() && findings.checked.iter().all(|it| it.open.is_none()));
}

#[test]
fn a_join_that_may_wait_for_ever_stays_open() {
    // If `y` leads to `w`, `z` waits for ever.
    let text = "chart c { conflict priority\n input a, b, c, d\n initial step s step x step y step z step w\n \
                s -> x & y when a x -> z when b y & z -> s when c y -> w when d priority 1 }";
    let small = net(text);
    let limits = Limits { pairs: 1, image_work: 0, ..Limits::default() };
    let found = findings(&small, &facts(&small, &limits), &limits);
    let is_open =
        |check: Check| found.checked.iter().any(|it| it.check == check && it.open.is_some());
    assert!(is_open(Check::DeadEnds), "{:?}", found.checked);
}
