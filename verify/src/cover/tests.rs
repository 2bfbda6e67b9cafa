use grafsynth_ir::net::{Net, Policy};

use super::cover;
use crate::testing::{chart, names};

fn components(net: &Net) -> Vec<String> {
    cover(net)
        .components
        .iter()
        .map(|c| format!("{}{}", if c.always { "" } else { "? " }, names(net, &c.steps)))
        .collect()
}

fn n_uncovered(cover: &super::Cover) -> usize {
    cover.component_of.values().filter(|component| component.is_none()).count()
}

#[test]
fn a_ring_is_one_component() {
    let net = chart("a* b c | a>b b>c c>a");
    assert_eq!(components(&net), ["a b c"]);
}

#[test]
fn a_fork_gives_its_branches() {
    let net = chart("s* a1 a2 b1 b2 e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s");
    assert_eq!(components(&net), ["s a1 a2 e", "? b1 b2"]);
}

#[test]
fn forks_within_choices_within_forks() {
    let net = chart("s* a a1 a2 b c d | s>a,b a>a1,a2:x a>c:nx a1,a2>c b>d c,d>s");
    let found = components(&net);
    assert_eq!(found.len(), 3, "{found:?}");
    assert_eq!(found.iter().filter(|one| !one.starts_with('?')).count(), 1, "{found:?}");
    assert_eq!(n_uncovered(&cover(&net)), 0);
}

#[test]
fn a_choice_that_may_fire_both_ways_is_no_component_under_all() {
    let net = chart("s* a b | s>a:x s>b:y a>s b>s");
    assert!(components(&net).is_empty());
    let mut net = chart("s* a b | s>a:x s>b:y a>s b>s");
    net.settings.policy = Policy::Priority;
    assert_eq!(components(&net), ["s a b"]);
    let net = chart("s* a b | s>a:x s>b:nx a>s b>s");
    assert_eq!(components(&net), ["s a b"]);
}

#[test]
fn two_transitions_to_one_step_do_no_harm() {
    let net = chart("s* a | s>a:x s>a:y a>s");
    assert_eq!(components(&net), ["s a"]);
}

#[test]
fn two_tokens_are_no_component() {
    let net = chart("a* b* c | a>b b>c c>a");
    assert!(components(&net).is_empty());
}

#[test]
fn a_set_that_is_filled_twice_goes_out_on_both_sides() {
    let net = chart("a* b c d | a>b,d b>c:x c,d>a b>a,b,c:nx");
    assert!(components(&net).is_empty(), "{:?}", components(&net));
}

#[test]
fn sources_and_sinks() {
    let net = chart("a* b c | a>b b> >c");
    assert_eq!(components(&net), ["? a b"]);
}

#[test]
fn processes_that_meet_are_found_by_search() {
    let net = chart("p1* p2 q1* q2 q3 | p1,q1>p2,q2 p2>p1 q2>q3 q3>q1");
    assert_eq!(components(&net), ["p1 p2", "q1 q2 q3"]);
}

#[test]
fn large_charts_are_covered_in_linear_time() {
    let mut text = String::new();
    let mut moves = String::new();
    for cell in 0..500 {
        let star = if cell == 0 { "*" } else { "" };
        text += &format!("s{cell}{star} a{cell} b{cell} c{cell} ");
        moves += &format!(
            "s{cell}>a{cell},b{cell} a{cell}>c{cell} c{cell},b{cell}>s{} ",
            (cell + 1) % 500
        );
    }
    let net = chart(&format!("{text}| {moves}"));
    let found = cover(&net);
    assert_eq!((found.components.len(), n_uncovered(&found)), (501, 0));
}
