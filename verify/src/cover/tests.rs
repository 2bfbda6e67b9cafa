use grafsynth_ir::net::{Net, Policy};

use super::cover;
use crate::testing::{chart, find, names};

fn components(net: &Net) -> Vec<String> {
    cover(net)
        .components
        .iter()
        .map(|c| format!("{}{}", if c.always { "" } else { "? " }, names(net, &c.steps)))
        .collect()
}

fn further(net: &Net) -> Vec<String> {
    cover(net).further.iter().map(|one| names(net, &one.steps)).collect()
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

#[test]
fn invariants_reach_through_forks() {
    let net = chart("s* a1 a2 b1 b2 e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s");
    assert_eq!(further(&net), ["s b1 b2 e"]);
    // Forks in forks, and two forks one after the other.
    let net = chart("s* a b c1 c2 c3 d1 d2 | s>a,b b>c1,c2,c3 c1,c2,c3>d1,d2 d1,d2,a>s");
    let found = cover(&net);
    assert_eq!(n_uncovered(&found), 0);
    for (_, step) in net.steps.iter().filter(|(_, step)| !step.is_initial) {
        let is_in = |one: &grafsynth_ir::facts::Invariant| {
            names(&net, &one.steps).split(' ').any(|name| name == step.name.text)
        };
        let mut all = found.invariants.iter().chain(&found.further);
        assert!(all.any(is_in), "{}", step.name.text);
    }
}

#[test]
fn branches_that_may_lose_or_gain_a_token_have_no_invariant() {
    for text in [
        // A transition leaves one branch only, takes a part of the targets, or enters one branch from elsewhere.
        "s* a1 a2 b1 b2 e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s b1>",
        "s* a1 a2 b1 b2 e | s>a1,b1 s>a1:x a1>a2 b1>b2 a2,b2>e e>s",
        "s* a1 a2 b1 b2 e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s >b2:x",
        // A step of a branch is active at reset too, or the first step is not.
        "s* a1 a2 b1 b2* e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s",
        "s* a1* a2 b1* b2 e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s",
        "s a1 a2 b1 b2 e | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s",
        // Two transitions in a branch fire together and double its token.
        "s* a1 a2 b1 b2 b3 e | s>a1,b1 a1>a2 b1>b2:x b1>b3:y a2,b2>e a2,b3>e e>s",
        // Two transitions fork together, with different first steps.
        "s* a1 a2 b1 b2 e | s>a1,b1:x s>a2,b2:y a1>a2 b1>b2 a2,b2>e e>s",
    ] {
        let net = chart(text);
        assert_eq!(net.settings.policy, Policy::All);
        assert!(further(&net).is_empty(), "{text}: {:?}", further(&net));
    }
}

#[test]
fn forcing_one_branch_breaks_its_invariant() {
    use grafsynth_ir::net::{Forcing, ForcingOrder, PartId};
    let text = "s* a1 a2 b1 b2 e f* g | s>a1,b1 a1>a2 b1>b2 a2,b2>e e>s f>g:x g>f:nx";
    // Some steps get a part of their own, and `g` forces the part of `b1` to a situation.
    let forced = |moved: &[&str], situation: &[&str]| {
        let mut net = chart(text);
        let part = net.parts[PartId::from_index(0)].clone();
        let other = net.parts.push(part);
        for name in moved {
            let step = find(&net, name);
            net.steps[step].part = other;
        }
        let steps = situation.iter().map(|name| find(&net, name)).collect();
        let (step, target) = (find(&net, "g"), vec![net.steps[find(&net, "b1")].part]);
        let order = ForcingOrder::Situation(steps);
        net.forcings.push(Forcing { step, target, order, span: Default::default() });
        let found = cover(&net);
        let all = found.invariants.iter().chain(&found.further);
        all.map(|one| names(&net, &one.steps)).collect::<Vec<_>>()
    };
    for (situation, keeps) in [
        (["s"].as_slice(), true),
        (&["b1"], true),
        (&["a1", "b2"], true),
        (&["a1"], false),
        (&["s", "b2"], false),
        (&[], false),
    ] {
        let all = forced(&["f", "g"], situation);
        assert_eq!(all.contains(&"s b1 b2 e".to_owned()), keeps, "{situation:?}: {all:?}");
    }
    let all = forced(&["b1", "b2"], &["b1"]);
    assert!(!all.contains(&"s b1 b2 e".to_owned()), "{all:?}");
}
