use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;

use super::*;
use crate::testing::{chart, valid};

fn answer(left: &Valid<Net>, right: &Valid<Net>, limits: &Limits) -> Answer {
    let common = Common::of(left, right).expect("something in common");
    charts_equal(left, right, &common, limits, 1)
}

#[test]
fn a_chart_equals_itself_by_each_method() {
    let net = valid(chart("a* b c | a>b:x b>c:y c>a:nx"));
    let by_product = answer(&net, &net, &Limits::default());
    assert!(
        matches!(by_product, Verdict::Proved(SameBy::Product { states: 3, .. })),
        "{by_product:?}"
    );
    let few = Limits { pairs: 2, ..Limits::default() };
    let by_induction = answer(&net, &net, &few);
    assert!(matches!(by_induction, Verdict::Proved(SameBy::Induction { .. })), "{by_induction:?}");
    let common = Common::of(&net, &net).expect("everything in common");
    let facts = structural_facts(&net);
    let question = Question {
        left: &net,
        right: &net,
        common: &common,
        facts: (&facts, &facts),
        limits: &few,
    };
    let settled = symbolic::diagram(&question, &Equalities::new());
    assert!(matches!(settled, Diagram::Proved { states: 3 }));
}

#[test]
fn each_method_finds_the_shortest_difference() {
    let left = valid(chart("a* b c | a>b:x b>c:y c>a:nx"));
    let right = valid(chart("a* b c | a>b:x b>c:y c>a:ny"));
    let Verdict::Refuted(found) = answer(&left, &right, &Limits::default()) else {
        panic!("not seen")
    };
    assert_eq!((found.left.len(), found.difference.row, found.is_shortest), (3, 3, true));
    let common = Common::of(&left, &right).expect("something in common");
    let facts = (structural_facts(&left), structural_facts(&right));
    let limits = Limits::default();
    let question = Question {
        left: &left,
        right: &right,
        common: &common,
        facts: (&facts.0, &facts.1),
        limits: &limits,
    };
    let Diagram::Apart(rows) = symbolic::diagram(&question, &Equalities::new()) else {
        panic!("not seen")
    };
    assert_eq!(rows.len(), 3);
    let apart = charts_by_chance(&left, &right, &common, 200, 1, 1).expect_err("not seen");
    assert!(apart.left.len() >= 3);
}

#[test]
fn nothing_in_common_is_no_equality() {
    let left = valid(chart("a* b | a>b:x"));
    let right = valid(chart("a* c | a>c:x"));
    assert_eq!(Common::of(&left, &right).err(), Some(Incomparable::NothingInCommon));
}
